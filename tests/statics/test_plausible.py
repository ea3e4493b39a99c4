"""What is found at rest, but cannot be meant: friction that nothing has, slips that nobody drew."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

import archfem as af
from archfem.commands.line import DOUBTFUL
from archfem.statics.plausible import dead_load_doubts


def resting(**given):
    """A ring with joints of some friction, under its weight."""
    told = {"radius": 2.95, "thickness": 0.55, "embrace": 159.0, "voussoirs": 9} | given
    contact = af.Contact(1.48e9, 0.30e9, told.pop("friction", 0.6))
    ring = af.circular_arch(**told, contact=contact)
    return af.dead_load(af.build(ring, fidelity="rigid"))


def test_an_ordinary_ring_is_not_in_doubt():
    assert dead_load_doubts(resting()) == ()
    assert dead_load_doubts(resting(friction=None)) == ()


def test_joints_that_never_slide_must_not_bear_what_no_stone_bears():
    """Plane blocks one beside the other between walls: what holds them is shear alone."""
    dead = resting(embrace=7.0, friction=None)
    assert float(dead.joints["friction"].max()) > 3.5
    (words,) = dead_load_doubts(dead)
    assert "joints slide from 1 on: they hold only because they never slide" in words


def test_criteria_say_from_where_joints_slide():
    assert "slide from 0.2 on" in dead_load_doubts(resting(friction=None), 0.2)[0]


def test_slips_and_coefficients_that_nobody_means():
    """A wedge that friction does not hold comes to rest millimetres below where it was drawn."""
    slid, smooth = dead_load_doubts(resting(embrace=7.0, voussoirs=3, friction=1e-3))
    assert "joints slide by up to 1.18 mm" in slid
    assert "the least coefficient of friction is 0.001" in smooth


@pytest.mark.parametrize(
    ("read", "least", "factor"), [("friction", 1.0, 1.0), ("slip", 1e-3, 1e3), ("slip", -1e-3, 1e3)]
)
def test_doubts_begin_where_they_are_said_to(read, least, factor):
    """By two per cent to either side: V / N of one, a slip of a millimetre either way."""
    dead = resting()
    for share, doubted in ((0.98, False), (1.02, True)):
        found = dead.joints.copy(deep=True)
        found[read].values[3] = share * least
        said = dead_load_doubts(SimpleNamespace(model=dead.model, joints=found))
        assert len(said) == doubted
        assert all(f"{share * abs(least) * factor:.3g} " in words for words in said)


def test_joints_of_stone_are_not_smooth():
    assert dead_load_doubts(SimpleNamespace(**smooth(0.102))) == ()
    (words,) = dead_load_doubts(SimpleNamespace(**smooth(0.098)))
    assert words == "the least coefficient of friction is 0.098: joints of stone have 0.6 to 0.75"


def test_one_smooth_joint_among_rough_ones_is_told(stack):
    rough, other = stack.joints
    slippery = replace(other, contact=replace(other.contact, friction=0.02))
    mixed = replace(stack, joints=(rough, slippery))
    (words,) = dead_load_doubts(af.dead_load(af.build(mixed, fidelity="rigid")))
    assert words.startswith("the least coefficient of friction is 0.02")


def smooth(friction):
    """A block that rests on a level joint, which needs no friction."""
    block = af.column(breadth=1.0, heights=[1.0], contact=af.Contact(1e9, 4e8, friction))
    dead = af.dead_load(af.build(block, fidelity="rigid"))
    return {"model": dead.model, "joints": dead.joints}


def test_what_limit_analysis_does_not_let_stand():
    """A state of joints with 0.6, put to joints with 0.2: no thrust line is within those."""
    dead = resting()
    weaker = af.build(
        replace(
            dead.model.structure,
            joints=tuple(
                replace(joint, contact=replace(joint.contact, friction=0.2))
                for joint in dead.model.structure.joints
            ),
        ),
        fidelity="rigid",
    )
    assert not af.stands(weaker.structure)
    assert "archfem.stands says that it falls" in dead_load_doubts(replace(dead, model=weaker))[-1]


@pytest.mark.parametrize(("embrace", "code"), [(159.0, 0), (7.0, DOUBTFUL)])
def test_check_says_so(embrace, code, tmp_path, capsys):
    path = tmp_path / "ring.toml"
    path.write_text(
        '[structure]\nshape = "circular_arch"\nradius = 2.95\nthickness = 0.55\nvoussoirs = 9\n'
        f'embrace = {embrace}\n[model]\nfidelity = "rigid"\n'
        '[contacts."stone to stone"]\nfriction = "none"\n'
    )
    assert af.commands.main(["check", str(path)]) == code
    said = capsys.readouterr().out
    assert ("in doubt: under dead load |V| / N is" in said) == bool(code)
    assert ("toml: ready" in said) != bool(code)
