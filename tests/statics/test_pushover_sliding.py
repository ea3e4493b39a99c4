"""Pushovers whose joints slide: limits, relaxation in place of steps, rules and messages."""

from math import radians, tan
from types import SimpleNamespace

import numpy as np
import pytest
from bonded import bonded_wall

import archfem as af
from archfem.limit import closed_cohesion
from archfem.masonry import BACKFILL
from archfem.statics import Stop, pushover
from archfem.statics.continuation import LoadPath
from archfem.statics.pushover import _extrapolate_limit, follow, stop_reason

SIDEWAYS = af.BodyForce(1.0)

EXACT = 1e-7
"""Relative: programmes are solved to 1e-9 block weights, and the curve is flat at its end."""

TENDS = 1e-3
"""Relative tolerance of the extrapolation of a curve against its limit."""

REACHED = 5e-3
"""Relative: what is missing where a path ends far along, and its last steps are coarse."""


def boxed(length, size, angle=35.0):
    """Dry fill in pieces between two walls, on a floor, 1.5 m high."""
    shape = {"material": af.STONE, "fixed": True}
    boxes = {
        "floor": ((-0.5, length + 0.5), (-0.5, 0.0), shape),
        "fill": ((0.0, length), (0.0, 1.5), {"material": BACKFILL}),
        "back": ((-0.5, 0.0), (0.0, 1.5), shape),
        "wall": ((length, length + 0.5), (0.0, 1.5), shape),
    }
    blocks = [
        af.Block(((x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])), name=name, part=name,
                 role="other", **kind)
        for name, (x, y, kind) in boxes.items()
    ]  # fmt: skip
    contact = af.Contact(0.3e9, 0.24e9, tan(radians(30.0)))
    return af.masonry.jointed_fill(
        af.masonry.assembled(blocks, contact), size, friction_angle=angle
    )


def filled_bridge(cohesion, above):
    """One span under fill in pieces of 35°, between sidewalls that rise so far [Pa, m]."""
    ring = af.shapes.Arch(
        measured="centre line", name="arch", span=4.0, rise=1.6, thickness=0.45, voussoirs=11
    )
    wall = {"length": 1.5, "height": 2.0, "above": above}
    whole = af.bridge(
        arches=[ring],
        sidewalls=[af.shapes.Sidewall(name=f"{side} wall", **wall) for side in ("left", "right")],
        backfill=af.shapes.Backfill(cover=0.5),
        width=4.0,
    )
    return af.masonry.jointed_fill(whole, 0.8, friction_angle=35.0, cohesion=cohesion)


def flat(structure):
    """Least factor found of joints that slide without dilating."""
    return af.collapse_factor(structure, live=SIDEWAYS, friction="nonassociated").factor


@pytest.mark.slow
def test_dry_fill_reaches_the_limit_of_joints_that_slide_flat(verified):
    """With dilatancy no factor is too large: pieces that wedge between fixed walls lock."""
    fill = boxed(2.0, 1.5)
    push = af.pushover(af.build(fill, fidelity="rigid", cells=(1, 1)), SIDEWAYS)
    assert np.isinf(af.collapse_factor(fill, live=SIDEWAYS).factor)
    limit = flat(fill)
    verified("dry fill between walls, pushed sideways: limit", limit, "limit analysis", push.factor)
    assert push.factor == pytest.approx(limit, rel=EXACT)


@pytest.mark.slow
@pytest.mark.parametrize("control", ["displacement", "force"])
def test_dry_fill_continues_by_creep_where_steps_would_be_tiny(control):
    """By steps alone it was at 0.88 of the limit after 400 of them."""
    fill = boxed(3.0, 0.7)
    push = af.pushover(af.build(fill, fidelity="rigid", cells=(1, 1)), SIDEWAYS, control=control)
    limit = flat(fill)
    assert "moved by" in push.outcome
    assert push.factor == pytest.approx(limit, rel=REACHED)
    assert push.limit == pytest.approx(limit, rel=REACHED)


@pytest.mark.slow
@pytest.mark.parametrize(("cohesion", "above"), [(0.0, 2.2), (10e3, 0.8)], ids=["dry", "10 kPa"])
def test_a_bridge_under_fill_in_pieces_tends_to_the_limit_of_flat_sliding(
    cohesion, above, verified
):
    """Joints that open lose cohesion: with what is left the limits agree, with all it is higher."""
    fill = filled_bridge(cohesion, above)
    model = af.build(fill, fidelity="rigid", cells=(2, 1))
    push = af.pushover(model, SIDEWAYS, control="force")
    limit = flat(closed_cohesion(fill, push.joints.isel(step=-1)))
    case = f"bridge under fill in pieces, {cohesion:g} Pa, pushed sideways: limit"
    verified(case, limit, "limit analysis", push.limit)
    assert push.limit == pytest.approx(limit, rel=TENDS)
    assert 0.99 * limit < push.factor < limit
    associated = af.collapse_factor(fill, live=SIDEWAYS).factor
    assert limit < 0.84 * associated
    if cohesion:
        assert flat(fill) > 1.15 * limit


def test_a_path_that_crawls_has_no_extrapolated_limit(monkeypatch):
    """It slides at its limit; the asymptote is that of hinges, and may lie above all bounds."""
    model = af.build(af.column(breadth=1.0, heights=[1.0, 1.0]), fidelity="rigid")
    assert af.pushover(model, SIDEWAYS).limit > 0.0
    follow = pushover.follow
    monkeypatch.setattr(pushover, "follow", lambda *given: f"it crawls: {follow(*given)}")
    push = af.pushover(model, SIDEWAYS)
    assert np.isnan(push.limit)
    assert "tends to" not in str(push)


@pytest.mark.slow
def test_a_path_that_crawls_at_its_limit_ends_with_that_reason():
    model = af.build(filled_bridge(0.0, 2.2), fidelity="rigid", cells=(2, 1))
    push = af.pushover(model, SIDEWAYS)
    assert push.outcome.startswith("it crawls: in ")
    assert np.isnan(push.limit)  # sliding has no asymptote of hinges, which may lie too high
    assert "tends to" not in str(push)
    assert push.factor == pytest.approx(0.27481, rel=2.0 * REACHED)


@pytest.mark.parametrize(
    ("moved", "grown", "steps", "slides", "most", "crawls"),
    [
        (0.99e-2, 1.95e-3, 40, True, 400, True),
        (0.99e-2, 1.95e-3, 40, False, 400, False),  # a hinge that moves on
        (1.01e-2, 0.0, 40, True, 400, False),  # a hundredth of the way
        (0.0, 2.05e-3, 40, True, 400, False),  # two thousandths of the load
        (0.0, -2.05e-3, 40, True, 400, False),
        (0.0, 0.0, 39, True, 400, False),
        # no more steps are left: a tenth of the way
        (0.99e-1, 0.0, 40, True, 40, True),
        (1.01e-1, 0.0, 40, True, 40, False),
    ],
)
def test_a_path_that_barely_moves_in_many_steps_crawls(
    moved, grown, steps, slides, most, crawls, monkeypatch
):
    """Shares are of the last displacement and factor; what lies before those steps is all one."""
    names = ["bed"] if slides else []
    monkeypatch.setattr(pushover, "sliding_joints", lambda path, criteria: names)
    part = np.append(0.0, np.linspace(0.0, 1.0, 40))[-steps - 1 :]
    way, factors = 3.0 - 3.0 * moved * (1.0 - part), 0.5 - 0.5 * grown * (1.0 - part)
    way[0], factors[0] = 0.0, 0.0
    path = SimpleNamespace(
        displacements=way, factors=list(factors), units="1", moving="load", states=way
    )
    path.model = SimpleNamespace(structure=SimpleNamespace(size=1e3))
    reason = stop_reason(path, Stop(steps=most), af.Criteria(), np.array([1.0, 0.1]))
    assert (reason is not None and reason.startswith("it crawls")) == crawls
    assert not crawls or "moved by less than a tenth of 3 m" in reason


@pytest.mark.parametrize(("control", "each", "growth"), [("path", 4, 1.4), ("path", 5, 1.1),
                                                         ("force", 4, 1.1)])  # fmt: skip
def test_steps_along_the_path_grow_faster_where_they_are_easy(control, each, growth):
    distances = []
    path = SimpleNamespace(displacements=np.zeros(1), factors=[0.0], iterations=[0], states=[0])
    structure = SimpleNamespace(size=1e9)
    path.model = SimpleNamespace(structure=structure, large_displacements=False)
    path.unit, path.units, path.moving = (1.0, 1.0), "1", "load"

    def advance(border, distance):
        distances.append(distance)
        path.displacements = np.append(path.displacements, path.displacements[-1] + distance)
        for values, new in ((path.factors, path.displacements[-1]), (path.iterations, each)):
            values.append(new)
        path.states.append(0)
        return True

    path.advance = advance
    follow(path, control, Stop(steps=4), af.Criteria())
    assert distances == pytest.approx(growth ** np.arange(4.0))


class Slow(LoadPath):
    """A path that creeps at given steps."""

    displacements = np.array([0.0, 2.0])

    def __init__(self, creeps=()):
        self.creeps, self.creep_calls, self.states = list(creeps), [], [0, 0]
        self.factors, self.unit = [0.0, 0.4], (1.0, 0.1)

    def advance_by_relaxation(self, grown, farthest):
        self.creep_calls.append((grown, farthest))
        return self.creeps.pop(0)


def test_creep_replaces_failed_steps_and_is_tried_less_after_failures(monkeypatch):
    """After 1, 2 and 3 trials in vain, 1, 3 and 7 steps must fail; after a success, none."""
    monkeypatch.setattr(pushover, "sliding_joints", lambda path, criteria: ["bed 3"])
    path = Slow([False, False, False, True, False])
    creeping = pushover._StepRelaxation(path, af.Criteria(), 9.0)
    tried = []
    for k in range(17):
        before = len(path.creep_calls)
        creeping.advance(np.array([0.0, 1.0]), 1.0)
        if len(path.creep_calls) > before:
            tried.append(k)
    assert tried == [0, 2, 6, 14, 15]


def test_creep_brings_as_much_load_as_the_step_would_have_brought(monkeypatch):
    """Along the last step, (2, 4) units; at least two thousandths of the load there is."""
    slides = ["bed 3"]
    monkeypatch.setattr(pushover, "sliding_joints", lambda path, criteria: slides)
    for border, distance, grown in (
        ([0.0, 1.0], 0.5, 0.05),
        ([1.0, 0.0], 0.5, 0.1),
        ([0.6, 0.8], 0.5, 0.5 * 4.0 / 4.4 * 0.1),
        ([0.0, 1.0], 1e-3, 0.002 * 0.4),
    ):
        path = Slow([True])
        assert pushover._StepRelaxation(path, af.Criteria(), 9.0).advance(
            np.array(border), distance
        )
        assert path.creep_calls == [(pytest.approx(grown), 9.0)]
    path = Slow([True])
    path.factors = [0.395, 0.4]  # 0.05 units in 2 of displacement
    assert pushover._StepRelaxation(path, af.Criteria(), 9.0).advance(np.array([1.0, 0.0]), 1.0)
    assert path.creep_calls == [(pytest.approx(0.0025), 9.0)]
    falling, fresh, settled = Slow(), Slow(), SimpleNamespace(states=[0, 0])
    falling.factors, fresh.states = [0.4, 0.4], [0]
    for path in (falling, fresh, settled):
        assert not pushover._StepRelaxation(path, af.Criteria(), 9.0).advance(
            np.array([0.0, 1.0]), 1.0
        )
    slides.clear()
    assert not pushover._StepRelaxation(Slow(), af.Criteria(), 9.0).advance(
        np.array([0.0, 1.0]), 1.0
    )


def test_a_last_step_that_is_short_does_not_look_flat():
    """λ = 1 - 0.1 d^(-1/2): its limit is 1, however little the last step brought."""
    way = np.append(np.geomspace(1.0, 50.0, 40), 50.0 + 1e-5)
    limit, uncertainty = _extrapolate_limit(way, 1.0 - 0.1 / np.sqrt(way))
    assert limit == pytest.approx(1.0, rel=1e-9)
    assert uncertainty == pytest.approx(0.1 / np.sqrt(50.0), rel=1e-3)


STOP = af.statics.Stop(displacement=0.25)


class RelaxedPath(LoadPath):
    """A path whose joints slide, and that creeps at given steps."""

    displacements = np.array([0.0, 2.0])
    bound = np.inf

    def __init__(self, creeps, states=2, factor=0.4, grain=False):
        self.creeps, self.creep_calls = list(creeps), []
        self.states, self.factors, self.unit = [0] * states, [0.0, factor], (1.0, 0.1)
        blocks = (SimpleNamespace(grain=grain),)
        self.model = SimpleNamespace(structure=SimpleNamespace(size=8.0, blocks=blocks))

    def advance_by_relaxation(self, grown, farthest):
        self.creep_calls.append((grown, farthest))
        if not self.creeps.pop(0):
            return False
        self.factors.append(self.factors[-1] + grown)
        self.displacements = np.append(self.displacements, self.displacements[-1] + 0.5)
        return True

    def advance(self, border, distance):
        return False


@pytest.fixture
def slides(monkeypatch):
    """Names of the joints that slide."""
    names = ["bed 3", "bed 4"]
    monkeypatch.setattr(pushover, "sliding_joints", lambda path, criteria: names)
    return names


def test_loads_grow_by_a_twentieth_and_less_while_the_structure_creeps(slides, monkeypatch):
    """Halved where it does not come to rest, down to a 25th of that; so far as the rules let it."""
    moved = []

    def finished(path, stop, criteria, step):
        moved.append(step)

    monkeypatch.setattr(pushover, "stop_reason", finished)
    path = RelaxedPath([True, False, True, *[False] * 9])
    assert pushover.continue_by_relaxation(path, STOP, af.Criteria()) is None
    grown = [each for each, _ in path.creep_calls]
    first, second = 0.05 * 0.4, 0.05 * 0.42
    rest = 0.42 + 0.5 * second
    assert grown == pytest.approx(
        [first, second, 0.5 * second, *(0.025 * rest / 2.0**k for k in range(4))]
    )
    assert {farthest for _, farthest in path.creep_calls} == {2.0}
    assert moved[0] == pytest.approx([0.5, first / 0.1])
    assert len(moved) == 2


def test_creep_seeks_nothing_beyond_what_limit_analysis_proves(slides):
    """A hundredth more at first, and no trial within two thousandths of the bound."""
    path = RelaxedPath([False] * 9)
    path.bound = 0.4 * 1.01
    assert pushover.continue_by_relaxation(path, STOP, af.Criteria()) is None
    grown = [each for each, _ in path.creep_calls]
    assert grown == pytest.approx([0.004, 0.002, 0.001])
    for bound, trials in ((1.0019, 0), (1.0021, 1)):
        path = RelaxedPath([False])
        path.bound = 0.4 * bound
        assert pushover.continue_by_relaxation(path, STOP, af.Criteria()) is None
        assert len(path.creep_calls) == trials
        path = RelaxedPath([False] * 99)
        path.bound = 0.4 * bound
        pushover.follow(path, "displacement", STOP, af.Criteria())
        assert (len(path.creep_calls) == 1) == (trials == 0)


def test_a_step_after_a_relaxed_one_is_relaxed_first(monkeypatch):
    monkeypatch.setattr(pushover, "sliding_joints", lambda path, criteria: ["bed 3"])
    monkeypatch.setattr(pushover, "_is_stagnating", lambda *given: False)
    path, ways = RelaxedPath([True, True, False, *[False] * 9]), []
    relax = path.advance_by_relaxation

    def note(way, advance):
        def noted(*given):
            ways.append(way)
            return advance(*given)

        return noted

    path.advance, path.advance_by_relaxation = note("step", path.advance), note("creep", relax)
    stop = af.statics.Stop(displacement=0.5, slope=0.0)
    pushover.follow(path, "displacement", stop, af.Criteria())
    assert ways[:4] == ["step", "creep", "creep", "creep"]


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.3, 0.4])
def test_a_wall_that_slides_ends_at_what_limit_analysis_proves(friction):
    """All of its beds slide at μ: no equilibrium is above."""
    wall = bonded_wall(courses=6, friction=friction)
    push = af.pushover(af.build(wall, fidelity="rigid"), SIDEWAYS)
    assert push.factor <= friction * (1.0 + 1e-9)
    assert push.factor == pytest.approx(friction, rel=2.1e-3)
    assert push.limit == pytest.approx(friction, abs=1e-9 + push.uncertainty)
    assert push.curve.sizes["step"] < 60


def test_the_bound_of_a_path_is_that_of_limit_analysis_with_its_loads():
    pier = af.column(breadth=1.0, heights=[1.0, 1.0])
    model = af.build(pier, fidelity="rigid")
    start = af.dead_load(model)
    path = LoadPath.of(model, [SIDEWAYS], start)
    assert path.bound == pytest.approx(0.5)  # B / H
    press = af.PointLoad(0.0, (0.0, -1e4))
    held = LoadPath.of(model, [press], start).load
    found = af.collapse_factor(pier, live=SIDEWAYS, dead=[press]).factor
    assert LoadPath.of(model, [SIDEWAYS], start, held).bound == pytest.approx(found)
    large = af.build(pier, fidelity="rigid", displacements="large")
    assert LoadPath.of(large, [SIDEWAYS], af.dead_load(large)).bound == np.inf


def test_a_path_has_ended_once_its_slope_is_small_enough():
    """In units of the first step: a twentieth of its load at ten times its way."""
    stop, moved = af.statics.Stop(slope=0.01), np.array([10.0, 0.05])
    assert pushover.stop_reason(RelaxedPath([]), stop, af.Criteria(), moved) == (
        "the slope fell to 0.005 of the initial one"
    )


def test_a_path_creeps_where_its_steps_fail_as_far_as_the_rules_let_it(slides):
    """To a quarter of its size, 8 m; the last step brought two units of way and four of load."""
    path = RelaxedPath([True])
    assert pushover.follow(path, "force", STOP, af.Criteria()) == "the load moved by 2.5 m"
    assert path.creep_calls == [(pytest.approx(0.1), 2.0)]


@pytest.mark.parametrize(
    ("ways", "bend", "longest"),
    [
        ([-0.4, 0.0, 0.3], 0.1, (4.0 * 5e-4 * 3.0 / 0.1) ** 0.5),
        ([-0.2, 0.0, 0.25], 1.0, 0.125),  # but no less than half of the last step
        ([-0.2, 0.0, 0.297], 1.0, 0.1485),
        ([-0.2, 0.0, 0.303], 1.0, np.inf),  # 3 % below the peak, which is past
        ([-0.2, 0.0], 1.0, np.inf),
    ],
)
def test_steps_miss_a_peak_by_a_two_thousandth_of_it(ways, bend, longest):
    """λ = 3 - bend s²: amid a step L it is higher than at both ends by bend L²/4."""
    ways = np.array(ways)
    found = pushover._resolve_peak(3.0 - bend * ways**2, list(np.diff(ways)))
    assert found == pytest.approx(longest, rel=1e-9)


def test_a_rule_ends_the_creep(slides, monkeypatch):
    monkeypatch.setattr(pushover, "stop_reason", lambda path, stop, criteria, step: "it is enough")
    assert (
        pushover.continue_by_relaxation(RelaxedPath([False, True]), STOP, af.Criteria())
        == "it is enough"
    )


def test_only_joints_that_slide_after_a_first_step_creep(slides):
    assert (
        pushover.continue_by_relaxation(RelaxedPath([True], states=1), STOP, af.Criteria()) is None
    )
    slides.clear()
    assert pushover.continue_by_relaxation(RelaxedPath([True]), STOP, af.Criteria()) is None
    assert (
        pushover.continue_by_relaxation(SimpleNamespace(states=[0, 0]), STOP, af.Criteria()) is None
    )


@pytest.mark.parametrize(
    ("control", "grain", "words"),
    [
        ("force", False, "the load cannot grow beyond a factor of 0.4, at which 2 joints slide"),
        ("displacement", False, "the load cannot grow beyond a factor of 0.4"),
        ("path", True, "no equilibrium was found past a factor of 0.4"),
    ],
)
def test_sliding_joints_are_named_where_nothing_more_is_found(slides, control, grain, words):
    said = pushover.failure_message(RelaxedPath([], grain=grain), control, af.Criteria())
    assert said.startswith(words)
    assert "such as 'bed 3'" in said
    assert ("pieces of fill flow" in said) is grain
    slides.clear()
    said = pushover.failure_message(RelaxedPath([]), "displacement", af.Criteria())
    assert said == "no equilibrium was found past a factor of 0.4"
    with pytest.raises(af.DidNotConverge, match="just after the dead load"):
        pushover.failure_message(RelaxedPath([], states=1), control, af.Criteria())


def test_hinges_of_one_step_are_in_the_order_of_their_eccentricities(stack):
    """Joint 0 hinges first by less than joint 1 in a case, and a step before it in the other."""
    for first, expected in ((0.0, ((1, "intrados"), (0, "extrados"))),
                            (0.47, ((0, "extrados"), (1, "intrados")))):  # fmt: skip
        rows = np.zeros((3, 2, 3))
        rows[..., 0] = 1e3  # a joint is 1 m deep
        rows[1, 0, 2], rows[2, :, 2] = 1e3 * first, (470.0, -490.0)
        joints = af.joints.joint_dataset(stack, rows, np.arange(3.0)).rename(time="step")
        hinges, steps = pushover.hinge_order(joints)
        assert hinges == expected
        assert steps == ((2, 2) if first == 0.0 else (1, 2))
