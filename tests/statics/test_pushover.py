"""Pushover: it rises to the limit of rigid blocks, whichever way it is controlled."""

from dataclasses import replace
from functools import cache
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from glued import glued
from repeats import each_once

import archfem as af
from archfem import pushover
from archfem.limit.linear_programme import RigidBlocks
from archfem.masonry.structure import with_contacts
from archfem.statics import Stop
from archfem.statics.pushover import (
    _extrapolate_limit,
    follow,
    stop_reason,
)

RING = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17, chords=1)
KEYSTONE = abs(RING.joints[8].extrados[0]) * (1.0 - 1e-9)


def rigid(structure, **given):
    """Rigid blocks; by Lobatto's rule, the default here, joints reach |e| = 0.5."""
    return af.build(structure, fidelity="rigid", **{"quadrature": "lobatto", **given})


def pair(x):
    return [af.PointLoad(side * x, (0.0, -1e3)) for side in (-1.0, 1.0)]


LOADS = {
    "sideways": af.BodyForce(1.0),
    "eccentric": af.PointLoad(1.4, (0.0, -1e3)),
    "two at the crown": pair(KEYSTONE),
}


@cache
def limit_of(load):
    """The limit of the ring's rigid blocks, which slide at the springings under two loads alone."""
    friction = "nonassociated" if load == "two at the crown" else None
    return af.collapse_factor(RING, live=LOADS[load], friction=friction).factor


@cache
def pushed(load, control):
    """The ring's rigid blocks pushed over, which many tests look at."""
    return pushover(rigid(RING), LOADS[load], control=control)


@cache
def spread(motion):
    """The ring's rigid blocks on a support that moves."""
    return pushover(rigid(RING), af.Settlement("left abutment", motion))


REACHED = 5e-3
"""Relative tolerance of a pushover against the limit of the polygon that it models."""


QUICK = [("force", "sideways"), ("displacement", "eccentric")]
"""Those of less than a second."""


@pytest.mark.parametrize(
    ("control", "load"),
    [
        pytest.param(*each, marks=() if each in QUICK else pytest.mark.slow)
        for each in product(("displacement", "arc length", "path", "force"), LOADS)
    ],
)
def test_rigid_blocks_on_elastic_joints_reach_the_limit(control, load):
    limit = limit_of(load)
    found = pushed(load, control)
    if (control, load) == ("force", "sideways"):
        assert "cannot grow beyond a factor of 0.457" in found.outcome
    assert found.factor == pytest.approx(limit, rel=REACHED)
    assert found.factor <= limit * (1.0 + 1e-6)  # joints' end points carry the edge exactly


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fidelity", "load"),
    [
        ("faces", "two at the crown"),
        ("condensed", "sideways"),
        ("full", "two at the crown"),
        ("faces", "sideways"),
        ("condensed", "two at the crown"),
        ("full", "sideways"),
    ],
)
def test_every_fidelity_reaches_the_limit_of_its_polygon(fidelity, load, verified):
    limit = limit_of(load)
    found = pushover(
        af.build(RING, fidelity=fidelity, cells=(2, 2), quadrature="lobatto"), LOADS[load]
    )
    assert found.factor == pytest.approx(limit, rel=REACHED)
    assert found.factor <= limit * (1.0 + 1e-5)
    case = f"pushover of fidelity {fidelity}, {load}: limit"
    verified(case, limit, "limit analysis of its polygon", found.factor)


@pytest.mark.slow
@pytest.mark.parametrize("fidelity", ["rigid", "faces"])
def test_exact_facets_only_approach_it_and_their_extrapolation_reaches_it(fidelity):
    """The compressed strip never vanishes: 2 % are missing after 10 % of the span and rise."""
    limit = limit_of("eccentric")
    found = pushover(af.build(RING, fidelity=fidelity, quadrature="exact"), LOADS["eccentric"])
    assert found.factor < 0.99 * limit
    assert found.limit == pytest.approx(limit, rel=REACHED)
    assert found.uncertainty == pytest.approx(0.02 * limit, rel=0.2)


def test_a_rule_without_points_at_the_faces_cannot_reach_it():
    """Gauss's outermost point is the lever arm: the curve is flat below the limit, and says so."""
    limit = limit_of("sideways")
    found = pushover(rigid(RING, quadrature="gauss"), LOADS["sideways"])
    assert "slope fell" in found.outcome
    assert found.factor == pytest.approx(0.93 * limit, rel=5e-3)
    outermost = 0.5 - 0.5 * (1.0 - np.sqrt(0.6)) / 4  # of three points on four facets
    assert float(abs(found.joints["eccentricity"]).max()) == pytest.approx(outermost, abs=1e-6)


def test_hinges_are_those_of_the_mechanism():
    collapse = af.collapse_factor(RING, live=af.BodyForce(1.0), friction=None)
    found = pushed("sideways", "displacement")
    assert set(collapse.hinges) <= set(found.hinges)
    assert found.hinges[0] == (6, "extrados")


def test_ring_on_piers_reaches_its_limit():
    structure = af.arch_on_piers(
        radius=3.0, thickness=0.6, voussoirs=15, pier_breadth=1.2, courses=[0.5] * 4, chords=1
    )
    limit = af.collapse_factor(structure, live=af.BodyForce(1.0), friction=None).factor
    found = pushover(rigid(structure), af.BodyForce(1.0))
    assert found.factor == pytest.approx(limit, rel=REACHED)
    assert found.hinges[-1][0] in range(5, 24)


def test_curve_of_a_rocking_block_follows_the_joint_section():
    """Compressed depth c = 3 (h/2 - |e|) and turning θ = 2 N / (k_n w c²) once |e| > h/6.

    The joint never slides, so that its whole depth bears shear.
    """
    block = glued(af.column(breadth=0.6, heights=[2.4]))
    found = pushover(rigid(block, cells=(200, 1)), af.BodyForce(1.0), stop=Stop(displacement=1e-3))
    contact, weight = block.joints[0].contact, block.weight
    factor = found.curve["factor"].values
    slip = factor * weight / (contact.shear_stiffness * 0.6)
    e = factor * 1.2
    turning = np.where(
        e <= 0.1,
        12.0 * e * weight / (contact.normal_stiffness * 0.6**3),
        2.0 * weight / (contact.normal_stiffness * (3.0 * (0.3 - e)) ** 2),
    )
    assert e[-1] > 0.2
    np.testing.assert_allclose(found.curve["displacement"], slip + 1.2 * turning, rtol=2e-3)


def test_curve_starts_at_the_dead_load_and_never_falls():
    found = pushed("eccentric", "displacement")
    assert float(found.curve["factor"][0]) == 0.0
    assert float(found.curve["displacement"][0]) == 0.0
    assert int(found.curve["iterations"][0]) == 0
    assert float(found.curve["displacement"].diff("step").min()) > 0.0
    assert float(found.curve["factor"].diff("step").min()) > -1e-6 * found.factor
    dead = found.joints["eccentricity"].isel(step=0)
    np.testing.assert_allclose(dead, dead[::-1], atol=1e-9)
    assert "slope" in found.outcome


@pytest.mark.parametrize(
    ("rule", "reach"),
    each_once(({}, {"quadrature": "gauss", "quadrature_points": 4}), (3e-3, 1e-2)),
)
def test_limit_lies_between_the_largest_factor_and_the_extrapolation(reach, rule):
    model = rigid(RING, cells=(32, 1), **rule)
    limit = limit_of("sideways")
    found = pushover(model, af.BodyForce(1.0), stop=Stop(displacement=reach))
    assert "moved by" in found.outcome
    assert found.factor < limit < found.limit + REACHED * limit
    assert found.uncertainty == pytest.approx(found.limit - found.factor)
    assert found.uncertainty < 0.2 * limit


def test_a_load_without_a_limit_has_no_extrapolation():
    found = pushover(rigid(RING), pair(1.4))
    assert np.isnan(found.limit)
    assert found.hinges == ()


@pytest.mark.slow
def test_other_rules_stop_a_pushover():
    by_hinges = pushover(rigid(RING), af.BodyForce(1.0), stop=Stop(hinges=2))
    assert 2 <= len(by_hinges.hinges) < 4
    assert "joints hinge" in by_hinges.outcome
    early = af.Criteria(hinge=0.3)
    sooner = pushover(rigid(RING), af.BodyForce(1.0), stop=Stop(hinges=2), criteria=early)
    assert sooner.factor < by_hinges.factor
    assert af.Criteria.of(sooner.joints) == early
    by_steps = pushover(rigid(RING), af.BodyForce(1.0), stop=Stop(steps=5))
    assert by_steps.curve.sizes["step"] == 6
    assert "5 steps" in by_steps.outcome


def test_a_ring_that_does_not_stand_is_not_pushed():
    thin = af.circular_arch(radius=1.0, thickness=0.08, embrace=180.0, voussoirs=5)
    with pytest.raises(af.DidNotConverge, match="joints hinge"):
        pushover(rigid(thin), af.BodyForce(1.0))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: pushover(rigid(RING), af.BodyForce(1.0), control="work"), "is not known"),
        (lambda: pushover(rigid(RING), af.BodyForce(0.0)), "load is zero"),
        (lambda: pushover(rigid(RING), af.PointLoad(9.0, (0.0, -1.0))), "misses the structure"),
        (
            lambda: pushover(rigid(RING), af.Settlement(0, (0.1, 0.0, 0.0)), control="force"),
            "settlement is a displacement",
        ),
        (lambda: pushover(rigid(RING), af.Settlement(0, (0.0, 0.0, 0.0))), "is zero"),
        (lambda: pushover(rigid(RING), af.Settlement(5, (0.1, 0.0, 0.0))), "cannot settle"),
    ],
)
def test_invalid_input_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"slope": 1.5}, r"slope \[-\] = 1.5 is not between 0 and 1"),
        ({"steps": 0}, "steps 0 must be above 0"),
    ],
)
def test_rules_that_would_stop_at_once_or_never_are_refused(given, message):
    with pytest.raises(af.InvalidInput, match=message):
        Stop(**given)


def test_the_outcome_names_the_load_or_the_support_that_moved():
    stop = Stop(displacement=1e-5)
    for load, what in ((af.BodyForce(1.0), "load"), (af.Settlement(0, (-1.0, 0, 0)), "support")):
        assert f"the {what} moved by" in pushover(rigid(RING), load, stop=stop).outcome


@pytest.mark.parametrize(
    "motion",
    [
        (-1.0, 0.0, 0.0),
        pytest.param((1.0, 0.0, 0.0), marks=pytest.mark.slow),
        pytest.param((0.0, -1.0, 0.0), marks=pytest.mark.slow),
    ],
)
def test_a_support_that_moves_finds_the_limit_state_that_resists_it_least(motion):
    """Out: the least thrust; in: the greatest; down: the least share of the weight."""
    settlement = af.Settlement("left abutment", motion)
    limit = af.collapse_factor(RING, live=settlement, friction=None).factor
    found = spread(motion)
    assert found.factor == pytest.approx(limit, rel=REACHED)
    assert found.limit == pytest.approx(limit, rel=REACHED)
    factor = found.curve["factor"]
    assert float(factor.diff("step").max()) < 1e-9 * abs(limit)  # never resists it more
    assert float(factor[0] - factor[-1]) > 0.02 * abs(limit)
    assert len(found.hinges) >= 3
    assert factor.attrs["units"] == "N m"


@pytest.mark.slow
@pytest.mark.parametrize("fidelity", ["faces", "full"])
def test_spreading_supports_bring_meshed_fidelities_to_the_least_thrust(fidelity):
    settlement = af.Settlement("left abutment", (-1.0, 0.0, 0.0))
    limit = af.collapse_factor(RING, live=settlement, friction=None).factor
    found = pushover(
        af.build(RING, fidelity=fidelity, cells=(2, 2), quadrature="lobatto"),
        settlement,
        stop=Stop(slope=1e-4),
    )
    assert found.factor == pytest.approx(limit, rel=REACHED)
    assert found.factor < 0.8 * float(found.curve["factor"][0])  # the thrust of the dead load


@pytest.mark.parametrize("motion", [(-2.0, 0.0, 0.0), (-1.0, -0.3, 0.4)])
def test_work_on_a_settlement_is_the_thrust_on_the_support(motion):
    """Work of N and V on the point at M / N from mid-depth, which moves with the support."""
    found = pushover(rigid(RING), af.Settlement("left abutment", motion), stop=Stop(steps=3))
    joint, last = RING.joints[0], found.joints.isel(step=-1, joint=0)
    support = RING.blocks[RING.block_number("left abutment")]
    place = joint.middle + float(last["M"]) / float(last["N"]) * joint.tangent
    x, y = place - support.centroid
    way = np.array([motion[0] - motion[2] * y, motion[1] + motion[2] * x])
    work = float(last["V"]) * joint.tangent @ way - float(last["N"]) * RING.normals[0] @ way
    assert found.factor == pytest.approx(work, rel=1e-9)
    assert float(found.curve["displacement"][-1]) > 0.0
    assert int(found.curve["iterations"][0]) == 0


def test_a_pushover_in_a_line():
    found, endless = pushed("eccentric", "displacement"), pushed("sideways", "force")
    steps = len(found.curve["factor"]) - 1
    assert repr(found).startswith(f"Pushover: factor {found.factor:.4g} after {steps} steps, tends")
    unknown = replace(endless, limit=np.nan)
    assert f"steps, {len(endless.hinges)} hinge" in repr(unknown)


def test_joints_turn_as_the_mechanism_of_limit_analysis():
    """Far along, what the joints turn from step to step is its motion, and only its hinges turn."""
    found = pushed("sideways", "displacement")
    mechanism = af.collapse_factor(RING, live=LOADS["sideways"], friction=None)
    intrados, extrados, _ = RigidBlocks(RING).gaps(mechanism.motion)
    expected = (intrados - extrados) / RING.depths
    turned = found.joints["rotation"].isel(step=[-2, -1]).diff("step").values[0]
    scale = (turned @ expected) / (expected @ expected)
    assert scale > 0.0
    # closed joints still turn elastically
    assert turned == pytest.approx(scale * expected, abs=0.02 * np.abs(scale * expected).max())
    wide = found.joints["opening"].isel(step=-1).values
    assert set(np.argsort(wide)[-4:]) == {joint for joint, _ in mechanism.hinges}


def test_openings_over_a_settlement_are_those_of_its_equilibria():
    """Openings of each step are those of the dead load on a support moved so far at once."""
    model, found = rigid(RING), spread((-1.0, 0.0, 0.0))
    step = int(np.argmin(np.abs(found.curve["displacement"].values - 2e-3)))
    far = float(found.curve["displacement"][step])
    direct = af.dead_load(model.settled(af.Settlement("left abutment", (-far, 0.0, 0.0))))
    for name in ("opening", "rotation", "slip"):
        expected = direct.joints[name].values
        got = found.joints[name].isel(step=step).values
        assert got == pytest.approx(expected, abs=1e-5 * np.abs(expected).max())
    assert float(found.joints["opening"].isel(step=step).max()) > 1e-4


def test_a_limit_is_extrapolated_from_the_last_doubling():
    """A curve λ - C d^-1/2 is exact; flat to a millionth, or too steep, by hand."""
    moved = np.concatenate([[0.0], np.geomspace(1e-6, 1e-3, 40)])
    factors = np.concatenate([[0.0], 0.3 - 1e-5 * moved[1:] ** -0.5])
    found, off = _extrapolate_limit(moved, factors)
    assert found == pytest.approx(0.3, rel=1e-9)
    assert off == pytest.approx(0.3 - factors[-1])
    for growth, flat in ((0.95e-6, True), (1.05e-6, False)):
        last = np.array([0.0, 0.1, 0.2, 0.2 / (1.0 - growth)])
        found, off = _extrapolate_limit(np.array([0.0, 1.0, 2.0, 4.0]), last)
        assert bool(found == last[-1]) is flat
        assert off == pytest.approx(1e-6 * last[-1]) or not flat
    # a last step of a 22nd of the way brings half of what one of an eleventh would
    for last, growth, flat in ((1.0 / 22.0, 0.48e-6, True), (1.0 / 22.0, 0.52e-6, False),
                               (0.0, 0.95e-6, True)):  # fmt: skip
        factors = np.array([0.0, 0.1, 1.0 - growth, 1.0])
        found, _ = _extrapolate_limit(np.array([0.0, 0.3, 1.0 - last, 1.0]), factors)
        assert bool(found == 1.0) is flat
    # C is that of the first step beyond half of the way
    found, off = _extrapolate_limit(
        np.array([0.0, 0.52, 0.9, 1.0]), np.array([0.0, 0.95, 0.99, 1.0])
    )
    assert off == pytest.approx(0.05 / (0.52**-0.5 - 1.0), rel=1e-9)
    assert found == pytest.approx(1.0 + off, rel=1e-9)
    assert np.isnan(_extrapolate_limit(np.array([0.0, 2.0, 1.0]), np.array([0.0, 0.9, 1.0]))).all()
    for share, known in ((0.19, True), (0.21, False)):
        root = 2.0**-0.5  # of the displacement half as large, which the last one lies beyond
        rise = share * (1.0 - root) / root
        found, off = _extrapolate_limit(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0 - rise, 1.0]))
        assert np.isfinite(found) == known
        assert off == pytest.approx(share) or not known


class Steps:
    """A path that fails at given steps, and otherwise rises evenly."""

    moving, units = "load", "1"

    def __init__(self, fails=(), slope=1.0):
        self.fails, self.distances, self.slope = list(fails), [], slope
        self.borders = []
        self.unit, self.states, self.iterations = (1.0, 1.0), [0], [0]
        self.displacements, self.factors = np.zeros(1), [0.0]
        self.model = SimpleNamespace(structure=SimpleNamespace(size=1e9))
        self.joint_forces = []

    def advance(self, border, distance):
        self.distances.append(distance)
        self.borders.append(border.tolist())
        if self.fails and self.fails.pop(0):
            return False
        self.states.append(0)
        self.iterations.append(9)
        self.displacements = np.append(self.displacements, self.displacements[-1] + distance)
        self.factors.append(self.factors[-1] + self.slope * distance)
        return True


def test_steps_grow_by_a_tenth_and_are_halved_where_they_fail():
    path = Steps([False, False, True, True, False])
    said = follow(path, "force", Stop(steps=4), af.Criteria())
    assert said == "4 steps were taken"
    known = [1.0, 1.1, 1.21, 0.605, 0.3025, 0.33275]
    assert path.distances == pytest.approx(known)


def test_steps_are_given_up_below_a_thousandth_of_the_first():
    """2^-9 is still tried, 2^-10 is not, but 1.1 of it: sliding joints then decide the reason."""
    path = Steps([True] * 99)
    with pytest.raises(af.DidNotConverge, match="no equilibrium just after the dead load"):
        follow(path, "force", Stop(), af.Criteria())
    assert path.distances == pytest.approx(0.5 ** np.arange(10))
    path = Steps([False, *[True] * 99])
    assert follow(path, "force", Stop(), af.Criteria()).startswith("the load cannot grow beyond")
    assert path.distances[1:] == pytest.approx(1.1 * 0.5 ** np.arange(11))


@pytest.mark.parametrize(
    ("control", "large", "outcome"),
    [
        ("path", False, "the slope fell to 0.05 of the initial one"),
        ("path", True, "3 steps were taken"),
        ("force", True, "the slope fell to 0.05 of the initial one"),
    ],
)
def test_a_path_of_large_displacements_continues_past_its_peak(control, large, outcome):
    path = Steps(slope=0.05)
    path.model.large_displacements = large
    assert follow(path, control, Stop(slope=0.06, steps=3), af.Criteria()) == outcome


def test_rules_end_a_path_where_they_are_met():
    """Rules: a slope, a displacement relative to the size, a vanished load, a number of steps."""
    path, criteria = Steps(), af.Criteria()
    path.displacements, path.factors = np.array([0.0, 0.5]), [0.0, 1.0]
    path.model.structure.size = 5.0
    path.states = [0, 0]  # that of the dead load, and one step
    even = np.array([1.0, 1.0])
    assert stop_reason(path, Stop(displacement=0.101), criteria, even) is None
    assert stop_reason(path, Stop(displacement=0.099), criteria, even) == "the load moved by 0.5 m"
    for slope, ends in ((0.98e-6, True), (-0.98e-6, True), (1.02e-6, False)):
        said = stop_reason(path, Stop(displacement=1.0), criteria, np.array([1.0, slope]))
        assert (said is not None) is ends
    assert stop_reason(path, Stop(displacement=1.0, steps=2), criteria, even) is None
    path.states.append(0)
    assert (
        stop_reason(path, Stop(displacement=1.0, steps=2), criteria, even) == "2 steps were taken"
    )
    path.factors = [0.0, 0.05]
    assert stop_reason(path, Stop(displacement=1.0), criteria, even) is None
    path.factors, flat = [0.0, -1e-9], np.array([1.0, 0.0])
    for large, distance, step in ((True, 1.0, even), (False, 0.099, even), (False, 1.0, flat)):
        path.model.large_displacements = large
        said = stop_reason(path, Stop(displacement=distance), criteria, step)
        assert said == "it bears no load any more"
    assert stop_reason(path, Stop(displacement=1.0), criteria, even) is None  # broken bonds
    path.units = "N m"
    assert stop_reason(path, Stop(displacement=1.0), criteria, even) is None


def test_arc_length_continues_in_the_direction_of_the_last_step():
    """Arcs have length one, half of each at first; both units are those of the first step."""
    path = Steps()
    path.unit = (0.5, 2.0)
    follow(path, "arc length", Stop(steps=3), af.Criteria())
    even, later = 0.5**0.5, np.array([2.0, 0.5]) / np.hypot(2.0, 0.5)
    assert path.borders[0] == pytest.approx([even, even])
    assert path.borders[1] == path.borders[2] == pytest.approx(later.tolist())
    for control, border in (("force", [0.0, 1.0]), ("displacement", [1.0, 0.0])):
        path = Steps()
        follow(path, control, Stop(steps=2), af.Criteria())
        assert path.borders == [border] * 2


@pytest.mark.parametrize("load", [af.BodyForce(0.1), af.Settlement("left abutment", (-1.0, 0, 0))])
def test_the_first_step_is_a_millionth_of_the_structure(load):
    found = pushover(rigid(RING), load, stop=Stop(steps=1))
    moved = found.curve["displacement"].values
    assert moved == pytest.approx([0.0, 1e-6 * RING.size], rel=1e-6)


@pytest.mark.parametrize("displacements", ["small", pytest.param("large", marks=pytest.mark.slow)])
def test_a_press_stays_while_a_pier_is_pushed(displacements):
    """The limit of rigid blocks: (W + P) b/2 = λ W h about the toe."""
    stiff = af.Contact(1e13, 1e13, friction=0.7)
    pier = af.column(breadth=0.6, heights=[1.0, 1.0, 1.0], contact=stiff)
    weight = pier.weight
    push = af.PointLoad(0.0, (weight, 0.0), y=1.5)
    press = af.PointLoad(0.0, (0.0, -2.0 * weight))
    model = af.build(pier, fidelity="rigid", displacements=displacements)
    control = "displacement" if displacements == "small" else "path"
    found = af.pushover(model, push, dead=[press], control=control)
    # nothing is pushed at first, and the base carries pier and press
    assert found.joints["N"].values[0, 0] == pytest.approx(3.0 * weight)
    # below the limit by the compression zone of stiff joints
    assert found.factor == pytest.approx(0.6, rel=0.02)
    assert found.factor < 0.6


def test_a_dead_load_is_refused_where_it_makes_the_structure_fall():
    pier = af.column(breadth=0.6, heights=[1.0, 1.0, 1.0])
    model = af.build(pier, fidelity="rigid")
    push = af.PointLoad(0.0, (0.5 * pier.weight, 0.0), y=1.5)
    with pytest.raises(af.DidNotConverge, match="of the loads that stay"):
        af.pushover(model, push, dead=[push])


@pytest.mark.slow
def test_a_support_spreads_below_a_press():
    """The thrust of limit analysis under the same loads."""
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
    press, spread = af.PointLoad(0.0, (0.0, -2e4)), af.Settlement("left abutment", (-1.0, 0.0, 0.0))
    found = af.pushover(af.build(ring, fidelity="rigid"), spread, dead=[press])
    exact = af.collapse_factor(ring, live=spread, dead=[press]).factor
    assert found.limit == pytest.approx(exact, abs=3.0 * found.uncertainty + 1e-3 * exact)
    large = af.build(ring, fidelity="rigid", displacements="large")
    with pytest.raises(af.InvalidInput, match="small displacements"):
        af.pushover(large, spread, dead=[press])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stiffness", "factor"),
    [(50e6, 0.037855), (200e6, 0.060848)],
)
def test_a_strip_on_soil_turns_under_a_smaller_push(stiffness, factor):
    """By hand: N (e d - 2 θ) / 2 m of a strip of 0.4 × 4 m is largest at (0.5 - e)³ = 8 N / 9 k d³.

    There θ = 2 N / (9 k d² (0.5 - e)²); on rigid ground 0.1 g turn it. The ground is broader.
    """
    stiff, soil = af.Contact(1e10, 4e9, 0.6), af.Contact(stiffness, 0.5 * stiffness, 0.6)
    strip = af.column(breadth=0.4, heights=[2.0, 2.0], contact=stiff)
    ground = replace(strip.blocks[0], outline=((-2, -1), (2, -1), (2, 0), (-2, 0)))
    joints = replace(strip.joints[0], contact=soil), *strip.joints[1:]
    strip = replace(strip, blocks=(ground, *strip.blocks[1:]), joints=joints)
    model = af.build(strip, fidelity="rigid", displacements="large")
    found = af.pushover(model, af.BodyForce(1.0)).factor
    left = (8.0 * strip.weight / (9.0 * stiffness * 0.4**3)) ** (1.0 / 3.0)
    turn = 2.0 * strip.weight / (9.0 * stiffness * 0.4**2 * left**2)
    assert ((0.5 - left) * 0.4 - 2.0 * turn) / 2.0 == pytest.approx(factor, rel=1e-4)
    assert found == pytest.approx(factor, rel=5e-3)


@pytest.mark.parametrize("stiffer", [100.0, pytest.param(1000.0, marks=pytest.mark.slow)])
def test_a_path_that_folds_between_stiff_joints_names_the_remedy_and_no_limit(stiffer):
    """Springs at points carry the peak of rigid blocks, whose factor limit analysis gives.

    The curve turns there within a hundredth of a millimetre: an extrapolation gave 0.535.
    """
    contact = af.Contact(stiffer * 1.48e9, stiffer * 0.30e9)
    stiff = with_contacts(RING, lambda _: contact)
    model = af.build(stiff, fidelity="rigid", displacements="large", quadrature="trapezoidal")
    found = af.pushover(model, af.BodyForce(1.0, 0.0), control="path")
    peak = af.collapse_factor(stiff, live=af.BodyForce(1.0, 0.0), friction=None).factor
    assert found.factor == pytest.approx(peak, rel=1e-3)
    assert "hinges jump between stiff joints: give softer ones, or quadrature" in found.outcome
    assert np.isnan(found.limit)
