"""The Prusias ad Hypium bridge: results of Demirel and Aldemir (2021), and an independent trial.

They report a collapse mechanism under all of six motions at R = 3, by their criterion of four
failed joints in one ring. Six made pairs give it under two by their law, and under none where
joints slide: the verdict is a range, which `tests/benchmarks/bridge_range.py` tabulates.
"""

from dataclasses import replace
from pathlib import Path

import pytest

import archfem as af

MESHES = Path(__file__).parents[2] / "meshes"
PAPER_STRESS = 0.6e6
"""Largest principal compression in arch stones under dead load that the paper reports [Pa]."""

PAPER = [
    "contacts.stone to stone.friction=none",
    "contacts.soil to stone.friction=none",
    "criteria.friction=0.60",
    "analysis.scheme=newmark",
]
"""The paper's law of joints, which are elastic in shear and judged by the friction they need."""

SPRINGS = "model={ fidelity = 'full', quadrature = 'nodal' }"


def case(name, *changes):
    stones = "model={ fidelity = { backfill = 'full', rest = 'faces' }, quadrature = 'exact' }"
    return af.Case.read(MESHES / f"{name}.toml", [stones, *changes])


@pytest.fixture(scope="module")
def dead():
    return af.cases.dead_load_of_case(case("prusias"))


@pytest.mark.slow
def test_no_criterion_is_exceeded_under_dead_load(dead):
    joints = af.joints.assessed_joints(dead.joints)
    assert float(abs(joints["eccentricity"]).max()) < 0.25
    assert float(joints["friction"].max()) < 0.25 * 0.60
    assert float(joints["N"].min()) > 1e5


@pytest.mark.slow
def test_compression_nears_that_of_the_paper_under_two_metres_of_fill(dead, verified):
    """The paper does not give its cover; a trial by other means found 0.32 MPa, and 2 m for 0.6."""
    deep = case("prusias", "structure.backfill.cover=2 m", "structure.backfill.erosion=0 m")
    largest = []
    for state in (dead, af.cases.dead_load_of_case(deep)):
        use = af.statics.strength_use(state.model, state.q)
        rings = use["part"].str.endswith("arch").values
        largest.append(float(use["compression"][rings].max()))
    assert 0.15e6 < largest[0] < PAPER_STRESS / 2.0
    assert largest[1] == pytest.approx(PAPER_STRESS, rel=0.15)
    label = "bridge under 2 m of fill, largest compression in stones [MPa]"
    source = "Demirel and Aldemir (2021), who do not state their cover"
    verified(label, PAPER_STRESS / 1e6, source, largest[1] / 1e6)


@pytest.mark.slow
def test_modes_of_a_trial(verified):
    """3.03, 3.57, 4.22 Hz with 0.29, 0.26, 0.21 of the mass, by another mesh and program.

    That bridge was not eroded, its sidewalls stood fixed and ended at the springings. Meshes and
    courses differ: two per cent.
    """
    held = case(
        "prusias",
        "structure.sidewalls.state=fixed",
        "structure.sidewalls.north sidewall.state=fixed",
        "structure.sidewalls.south sidewall.state=fixed",
        "structure.sidewalls.south sidewall.above=0 m",
        "structure.backfill.erosion=0 m",
    )
    state = af.cases.dead_load_of_case(held)
    found = af.modes(state.model, 3, start=state)
    assert found.frequencies == pytest.approx([3.03, 3.57, 4.22], rel=0.02)
    assert found.mass_ratios[:, 0] == pytest.approx([0.29, 0.26, 0.21], abs=0.01)
    label = "bridge, uneroded and held, first modes [Hz]"
    verified(label, [3.03, 3.57, 4.22], "another mesh and program", found.frequencies)


@pytest.mark.slow
def test_the_restored_bridge_is_stiffer_and_nearer_its_centre_lines(dead):
    restored = af.cases.dead_load_of_case(case("prusias_restored"))
    first = [float(af.modes(each.model, 1, start=each).frequencies[0]) for each in (dead, restored)]
    assert first[1] > 1.4 * first[0]
    largest = [
        float(abs(af.joints.assessed_joints(each.joints)["eccentricity"]).max())
        for each in (dead, restored)
    ]
    assert largest[1] < 0.7 * largest[0]


@pytest.mark.slow
def test_run_command_on_the_bridge(tmp_path, capsys):
    changes = [
        "model={ fidelity = { backfill = 'full', rest = 'rigid' }, cells = [2, 2] }",
        "suite.matched=false",
        "suite.pairs={ pair-1 = { synthetic = { seed = 1, duration = 1, pga = 1.0 } } }",
    ]
    options = [word for text in changes for word in ("--set", text)]
    command = ["run", str(MESHES / "prusias.toml"), "--out", str(tmp_path), *options]
    assert af.commands.main(command) == 3  # elastic fill in tension is in doubt
    printed = capsys.readouterr().out
    assert "the first and the last effective along x" in printed
    for name in ("dead.png", "dead_stress.png", "free_body.png", "suite.txt", "envelope.png"):
        assert (tmp_path / name).is_file()
    for name in ("history.nc", "summary.txt", "critical_instant.png", "joints.png"):
        assert (tmp_path / "pair-1" / name).is_file()


@pytest.mark.slow
def test_the_verdict_of_the_paper_by_its_own_rule_and_by_exact_joints():
    """R = 3, pair 1: five springs count four joints anywhere as it stands, exact joints none.

    Under this pair four in one ring at once, as the paper words it, are not met, and no motion of
    the blocks is possible. Over the record four of one ring fail; of the restored bridge none.
    """
    found = {}
    for name in ("prusias", "prusias_restored"):
        for rule, changes in {"springs": [SPRINGS, *PAPER], "exact": PAPER}.items():
            own = case(name, *changes)
            state = af.cases.dead_load_of_case(own)
            motion = own.ground_suite().motions[0]
            run = af.cases.run_time_history(own, motion, state, af.cases.damping_of(own, state)[0])
            found[name, rule] = af.first_mechanisms(run)
    first = found["prusias", "springs"]
    assert first["any joints at once"].kind == "global"
    assert 2.0 < first["any joints at once"].time < 5.0
    assert first["one part at once"] is None
    assert first["verified"] is None
    assert first["one part over the record"].part.endswith("arch")
    exact = found["prusias", "exact"]
    assert {name for name in exact if exact[name]} <= {"one part over the record"}
    for rule in ("springs", "exact"):
        assert not any(found["prusias_restored", rule].values())


@pytest.mark.slow
def test_the_criterion_of_the_paper_is_met_for_an_instant_by_its_own_law_alone():
    """R = 3, pair 2: four neighbours in the northern ring, for some steps; none where joints slide.

    Their springs never slide; a joint counts as sliding from |V| / N = 0.60 on.
    """
    own = case("prusias").alone("pair-2")
    motion = own.ground_suite().motions[0].cut(0.0, 12.0)
    found = {}
    for friction in (None, 0.60):
        joints = [
            replace(joint, contact=replace(joint.contact, friction=friction))
            for joint in own.structure.joints
        ]
        structure = replace(own.structure, joints=tuple(joints))
        fidelities = {"backfill": "full", "rest": "rigid"}
        model = af.build(structure, fidelity=fidelities, quadrature="nodal")
        start = af.dead_load(model)
        damping = af.cases.damping_of(own, start)[0]
        criteria = af.Criteria(friction=0.60)
        given = {"dt": 0.005, "start": start, "damping": damping, "criteria": criteria}
        found[friction] = af.time_history(model, motion, **given)
    first = found[None].demirel_aldemir
    assert (first.kind, first.part, len(first.joints)) == ("local", "north arch", 4)
    assert first.duration < 0.05
    assert found[None].verified is None
    assert found[0.60].demirel_aldemir is None
    assert found[0.60].mechanism is None


@pytest.mark.slow
def test_the_bridge_stands_at_the_peak_of_1999(verified):
    """Joints slide and stones move without limit, under the pair that displaces it most."""
    own = af.Case.read(MESHES / "prusias.toml", ["suite.reduction=1"]).alone("pair-6")
    motion = own.ground_suite().motions[0].scaled_to_pga(0.299 * af.units.STANDARD_GRAVITY)
    fidelity = {"backfill": "full", "rest": "rigid"}
    model = af.build(own.structure, fidelity=fidelity, displacements="large", cells=(2, 2))
    damping = af.effective_damping(model, 0.05, "closed")
    run = af.time_history(model, motion, start=af.dead_load(model), damping=damping, dt=0.005)
    assert run.verdict.outcome == "stands"
    assert not any(run.verdict.mechanisms.values())
    (doubt,) = run.verdict.doubts
    assert doubt.words.startswith("elastic fill bears")
    # 9 mm are left; rattling joints may add some on another processor
    assert run.verdict.residual < 0.015
    case = "the bridge under a pair of the 0.299 g of Düzce 1999"
    verified(case, "stands", "its survival", run.verdict.outcome)
