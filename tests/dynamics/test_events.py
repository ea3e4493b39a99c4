"""Events that end a run, and the scan of joints for failures."""

from itertools import pairwise

import numpy as np
import pytest

import archfem as af
from archfem.dynamics import CountedMechanism, EveryMechanism, MovingMechanism
from archfem.dynamics.events import FailureScan, RecordCounter, applicable_definitions

WEIGHT = 1e4

STEP = 0.005
"""Length of a step, in which a mechanism lasts for long enough [s]."""


def ring():
    return af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)


def on_piers():
    return af.arch_on_piers(
        radius=3.0, thickness=0.6, voussoirs=15, pier_breadth=1.2, courses=[0.5] * 2
    )


def state(structure, hinges=(), sliding=()):
    """N, V, M with some joints hinging {joint: e} or sliding {joint: V/N}."""
    resultants = np.zeros((len(structure.joints), 3))
    resultants[:, 0] = WEIGHT
    for joint, e in dict(hinges).items():
        resultants[joint, 2] = e * WEIGHT * structure.joints[joint].depth
    for joint, ratio in dict(sliding).items():
        resultants[joint, 1] = ratio * WEIGHT
    return resultants


ALTERNATING = {0: -0.5, 6: 0.5, 12: -0.5, 17: 0.5}
SAME_SIDE = {0: -0.5, 6: -0.5, 12: -0.5, 17: -0.5}


def stop_reason(event, structure, *states, criteria=None):
    """The reason by which a new monitor stops at the last of some states, or None."""
    watch = event.start_monitor(structure, criteria or af.Criteria())
    return [watch(resultants, STEP) for resultants in states][-1]


def test_both_events_see_four_alternating_hinges():
    for event in (CountedMechanism(), MovingMechanism()):
        reason = stop_reason(event, ring(), state(ring(), ALTERNATING))
        assert "motion and count agree: by motion local (arch)" in reason
        assert "by joints 0, 6, 12 and 17; " in reason


def test_four_hinges_on_one_face_are_counted_and_do_not_move():
    counted = stop_reason(CountedMechanism(), ring(), state(ring(), SAME_SIDE))
    assert "motion and count disagree: by motion none, by count local (arch)" in counted
    twice = [state(ring(), SAME_SIDE)] * 2
    assert stop_reason(MovingMechanism(), ring(), state(ring()), *twice) is None


def test_one_sliding_joint_moves_a_block_without_a_counted_mechanism():
    stack = af.column(breadth=1.0, heights=[1.0, 1.0])
    sliding = state(stack, sliding={1: 0.6})
    assert stop_reason(CountedMechanism(), stack, sliding) is None
    assert "disagree: by motion local" in stop_reason(MovingMechanism(), stack, sliding)


def test_a_run_may_wait_for_a_wider_class():
    """Three hinges of the ring and one at the foot of the right pier: a ring and a pier move."""
    hinges = state(on_piers(), {3: -0.5, 8: 0.5, 13: -0.5, 19: 0.5})
    assert "agree: by motion semi-global (arch + right pier)" in stop_reason(
        MovingMechanism(), on_piers(), hinges
    )
    for event in (CountedMechanism, MovingMechanism):
        assert stop_reason(event(kinds=("semi-global",)), on_piers(), hinges)
        assert stop_reason(event(kinds=("local", "global")), on_piers(), hinges) is None


def test_a_run_ends_when_its_blocks_can_move():
    """The instant is that of the record of the whole run, looked through afterwards."""
    model = af.build(ring(), fidelity="rigid")
    motion = af.Motion.synthetic(duration=3.0, pga=6.0, seed=2)
    damping = af.Rayleigh(0.05, (8.0, 16.0))
    whole = af.time_history(model, motion, dt=0.005, damping=damping)
    expected = whole.verified
    halted = af.time_history(model, motion, dt=0.005, damping=damping, until=MovingMechanism())
    assert halted.time[-1] == pytest.approx(expected.moved.time)
    assert "a mechanism that moves" in halted.outcome
    assert str(expected) in halted.outcome


def test_an_event_serves_several_structures():
    """The same numbers of joints, in another structure, are another state."""
    event, lone = MovingMechanism(), af.column(breadth=1.0, heights=[1.0] * 18)
    assert stop_reason(event, ring(), state(ring(), {0: 0.5})) is None
    assert stop_reason(event, lone, state(lone, {0: 0.5})) is not None


def with_soil():
    """Two stones and, on them, twenty flat bodies of soil."""
    stones = af.column(breadth=1.0, heights=[1.0, 1.0])
    levels = [2.0 + 0.1 * k for k in range(21)]
    soil = [
        af.Block(
            ((-0.5, y), (0.5, y), (0.5, top), (-0.5, top)),
            af.masonry.BACKFILL,
            f"soil {y:.1f}",
            part="fill",
        )
        for y, top in pairwise(levels)
    ]
    return af.masonry.assembled(
        [*stones.blocks, *soil], af.masonry.STONE_TO_STONE, joints=stones.joints
    )


def test_soil_that_slides_is_no_event():
    structure = with_soil()
    resultants = state(structure, sliding=dict.fromkeys(range(2, 22), 0.7))
    for event in (CountedMechanism(), MovingMechanism()):
        assert stop_reason(event, structure, resultants) is None
    resultants[1] = state(structure, {1: 0.5})[1]
    assert stop_reason(CountedMechanism(), structure, resultants) is None
    assert "motion local (column)" in stop_reason(MovingMechanism(), structure, resultants)


def test_every_mechanism_waits_for_the_last_and_keeps_the_others():
    structure, event = on_piers(), EveryMechanism()
    watch = event.start_monitor(structure, af.Criteria())
    in_ring = state(structure, {3: -0.5, 6: -0.5, 9: -0.5, 12: -0.5})  # one face: cannot move
    with_pier = state(structure, {0: -0.5, 3: -0.5, 6: -0.5, 9: -0.5})
    moving = state(structure, {3: -0.5, 8: 0.5, 13: -0.5, 19: 0.5})
    assert applicable_definitions(structure) == (
        "any joints at once",
        "one part at once",
        "ring and pier at once",
        "one part over the record",
    )
    for resultants in (state(structure), in_ring, in_ring, with_pier):
        assert watch(resultants, STEP) is None
    assert "by each definition" in watch(moving, STEP)
    assert stop_reason(event, structure, moving) is None  # a fresh watch: never four in the ring
    assert "by each definition" in stop_reason(EveryMechanism(), ring(), state(ring(), ALTERNATING))
    alone = af.column(breadth=1.0, heights=[1.0])
    assert applicable_definitions(alone) == ()
    assert "by each definition" in stop_reason(EveryMechanism(), alone, state(alone, {0: 0.5}))


def test_events_wait_for_as_long_as_a_mechanism_lasts():
    """0.6 ms, a break, then twice 0.6 ms by different joints: only the last is long enough."""
    hinges = [state(ring(), each) for each in (ALTERNATING, ALTERNATING | {9: 0.5})]
    for event in (CountedMechanism(), MovingMechanism(), EveryMechanism()):
        watch = event.start_monitor(ring(), af.Criteria())
        said = [watch(each, 6e-4) for each in (hinges[0], state(ring()), *hinges)]
        assert said[:3] == [None] * 3
        assert "a mechanism" in said[3]
        assert event.start_monitor(ring(), af.Criteria(duration=0.0))(hinges[0], 6e-4) is not None


SCAN_WEIGHT = 1e4


def hinging(structure, hinges):
    """N, V, M with some joints hinging, {joint: e}."""
    resultants = np.zeros((len(structure.joints), 3))
    resultants[:, 0] = SCAN_WEIGHT
    for joint, e in hinges.items():
        resultants[joint, 2] = e * SCAN_WEIGHT * structure.joints[joint].depth
    return resultants


def at(scan, resultants, min_failures):
    """The result of a scan of one step."""
    (found,) = scan(resultants[None], min_failures)
    return found


class Query:
    """Query that stores the joints of each call."""

    def __init__(self):
        self.calls = []

    def __call__(self, seen):
        self.calls.append(seen.joint_states())
        return frozenset({str(len(self.calls))})


def test_a_query_runs_only_where_joints_fail_and_once_for_each_set(ring):
    query = Query()
    scan = FailureScan(ring, af.Criteria(), range(18), query)
    first, second = hinging(ring, {0: -0.5, 6: -0.5}), hinging(ring, {0: -0.5, 6: 0.5})
    assert at(scan, hinging(ring, {}), 1) == frozenset()
    for number, hinges in enumerate((first, second), 1):
        assert at(scan, hinges, 1) == {str(number)}
        assert np.flatnonzero(query.calls[-1]["hinge"]).tolist() == [0, 6]
        assert query.calls[-1]["M"].values == pytest.approx(hinges[:, 2])
        # other forces, the same joints on the same faces
        assert at(scan, 1.1 * hinges, 1) == {str(number)}
    assert len(query.calls) == 2


def test_a_joint_may_slide_either_way_or_come_apart(ring):
    query = Query()
    scan = FailureScan(ring, af.Criteria(), range(18), query)
    for number, force in enumerate(
        ([SCAN_WEIGHT, SCAN_WEIGHT, 0.0], [SCAN_WEIGHT, -SCAN_WEIGHT, 0.0], [0.0, 0.0, 0.0]), 1
    ):
        resultants = hinging(ring, {})
        resultants[3] = force
        assert at(scan, resultants, 1) == at(scan, resultants, 1) == {str(number)}


def test_only_some_joints_and_so_many_of_them_count(ring):
    scan = FailureScan(ring, af.Criteria(), [1, 2, 3], Query())
    assert not at(scan, hinging(ring, {0: 0.5}), 1)
    assert not at(scan, hinging(ring, {0: 0.5, 1: 0.5}), 2)
    assert at(scan, hinging(ring, {1: 0.5, 2: 0.5}), 2)


def test_many_steps_at_once_are_seen_as_one_by_one(ring):
    steps = np.array([hinging(ring, {}), hinging(ring, {2: 0.5}), hinging(ring, {2: -0.5, 9: 0.5})])
    steps[1, 4] = SCAN_WEIGHT, -SCAN_WEIGHT, 0.0
    query, alone = Query(), Query()
    together = list(FailureScan(ring, af.Criteria(), range(18), query)(steps, 1))
    scan = FailureScan(ring, af.Criteria(), range(18), alone)
    assert together == [at(scan, step, 1) for step in steps] == [set(), {"1"}, {"2"}]
    for first, second in zip(query.calls, alone.calls, strict=True):
        assert first.identical(second)


def test_joints_that_fail_over_a_record_in_one_step_are_named_in_order():
    """Not in that of a set of texts, which changes from process to process."""
    counter = RecordCounter(ring(), af.Criteria(duration=0.0, failures=30))
    counter.add_step(frozenset(f"joint {number}" for number in range(8)), STEP)
    assert counter.failed["arch"] == [joint.name for joint in ring().joints[:8]]
