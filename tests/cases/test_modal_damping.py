"""Cases whose damping comes from their modes, and the command that tells of them."""

import re

import pytest

import archfem as af
from archfem.cases.run import damping_of, expected_damping
from archfem.commands.line import main
from archfem.dynamics.schemes import EffectiveDamping

SMALL_CASE = """
[structure]
shape = "column"
breadth = 1.0
heights = [1.0, 1.0, 1.0]

[model]
fidelity = "rigid"

[analysis]
damping = { ratio = 0.05, modes = "effective" }
"""


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(SMALL_CASE, encoding="utf-8")
    return path


def test_a_case_takes_its_damping_from_the_modes(small):
    case = af.Case.read(small)
    assert case.damping == EffectiveDamping(0.05)
    dead = af.dead_load(af.build(case.structure, fidelity="rigid"))
    damping, how = damping_of(case, dead)
    assert damping == af.dynamics.effective_damping(dead.model, 0.05, dead)
    assert re.fullmatch(
        r"damping: 5 % at \d+\.\d\d Hz, proportional to stiffness; mode 1, the first effective "
        r"along x, has \d+\.\d % of the mass",
        how,
    )
    # Before a model is chosen it comes from one of elastic blocks, lower by what these yield.
    elastic = af.build(case.structure, fidelity="condensed")
    expected = expected_damping(case)(elastic).frequency
    assert expected == damping_of(case, af.dead_load(elastic))[0].frequency
    assert expected == pytest.approx(damping.frequency, rel=0.05)


def test_rayleigh_damping_is_a_word_away(small):
    case = af.Case.read(small, ["analysis.damping.kind=rayleigh", "analysis.damping.share=0.95"])
    assert case.damping == EffectiveDamping(0.05, "rayleigh", share=0.95)
    dead = af.dead_load(af.build(case.structure, fidelity="rigid"))
    damping, how = damping_of(case, dead)
    assert damping == af.dynamics.effective_damping(
        dead.model, 0.05, dead, kind="rayleigh", share=0.95
    )
    assert re.match(r"damping: 5 % at \d+\.\d\d and \d+\.\d\d Hz; modes 1 and ", how)


def test_damping_at_a_frequency(small):
    case = af.Case.read(small, ['analysis.damping={ ratio = 0.05, frequency = "8 Hz" }'])
    assert case.damping == af.StiffnessDamping(0.05, 8.0)
    dead = af.dead_load(af.build(case.structure, fidelity="rigid"))
    assert damping_of(case, dead)[1] == "damping: 5 % at 8.00 Hz, proportional to stiffness"


@pytest.mark.parametrize(
    "damping",
    [
        '{ ratio = 0.05, modes = "all" }',
        '{ ratio = 0.05, modes = "effective", frequencies = [1, 2] }',
        "{ ratio = 0.05, frequencies = [1, 2], share = 0.1 }",
        '{ modes = "effective" }',
        '{ ratio = 0.05, modes = "effective", share = 0.9 }',
        '{ ratio = 0.05, frequency = 8.0, kind = "rayleigh" }',
    ],
)
def test_damping_that_cannot_be_meant(small, damping):
    with pytest.raises(af.InvalidInput, match='or modes = "effective" for them'):
        af.Case.read(small, [f"analysis.damping={damping}"])


def test_share_of_a_case_is_checked_when_it_is_read(small):
    with pytest.raises(af.InvalidInput, match=r"share 2\.0 of the mass"):
        af.Case.read(small, ["analysis.damping.kind=rayleigh", "analysis.damping.share=2.0"])
    with pytest.raises(af.InvalidInput, match="damping kind = 'mass'"):
        af.Case.read(small, ["analysis.damping.kind=mass"])


@pytest.mark.slow
def test_command(small, capsys):
    out = small.parent / "out"
    assert main(["modes", str(small), "--out", str(out), "--count", "3"]) == 0
    said = capsys.readouterr().out
    assert (out / "modes.txt").read_text(encoding="utf-8") in said
    assert "damping: 5 % at" in said
    assert {path.name for path in out.iterdir()} == {"modes.txt", "modes.png", "modes.gif"}
