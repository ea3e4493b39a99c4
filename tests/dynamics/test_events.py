"""Events that end a run, on joints whose state is known and in whole runs."""

from itertools import pairwise

import numpy as np
import pytest

import archfem as af
from archfem.dynamics.events import (
    CountedMechanism,
    EveryMechanism,
    MovingMechanism,
    possible_counts,
)

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


def told(event, structure, *states, criteria=None):
    """What a fresh watch says of the last of some states, one after another."""
    watch = event.watch(structure, criteria or af.Criteria())
    return [watch(resultants, STEP) for resultants in states][-1]


def test_both_events_see_four_alternating_hinges():
    for event in (CountedMechanism(), MovingMechanism()):
        reason = told(event, ring(), state(ring(), ALTERNATING))
        assert "motion and count agree: by motion local (arch)" in reason
        assert "by joints 0, 6, 12 and 17; " in reason


def test_four_hinges_on_one_face_are_counted_and_do_not_move():
    counted = told(CountedMechanism(), ring(), state(ring(), SAME_SIDE))
    assert "motion and count disagree: by motion none, by count local (arch)" in counted
    twice = [state(ring(), SAME_SIDE)] * 2
    assert told(MovingMechanism(), ring(), state(ring()), *twice) is None


def test_one_sliding_joint_moves_a_block_that_nobody_counts():
    stack = af.column(breadth=1.0, heights=[1.0, 1.0])
    sliding = state(stack, sliding={1: 0.6})
    assert told(CountedMechanism(), stack, sliding) is None
    assert "disagree: by motion local" in told(MovingMechanism(), stack, sliding)


def test_a_run_may_wait_for_a_wider_class():
    """Three hinges of the ring and one at the foot of the right pier: a ring and a pier move."""
    hinges = state(on_piers(), {3: -0.5, 8: 0.5, 13: -0.5, 19: 0.5})
    assert "agree: by motion semi-global (arch + right pier)" in told(
        MovingMechanism(), on_piers(), hinges
    )
    for event in (CountedMechanism, MovingMechanism):
        assert told(event(kinds=("semi-global",)), on_piers(), hinges)
        assert told(event(kinds=("local", "global")), on_piers(), hinges) is None


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
    assert told(event, ring(), state(ring(), {0: 0.5})) is None
    assert told(event, lone, state(lone, {0: 0.5})) is not None


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
        assert told(event, structure, resultants) is None
    resultants[1] = state(structure, {1: 0.5})[1]
    assert told(CountedMechanism(), structure, resultants) is None
    assert "motion local (column)" in told(MovingMechanism(), structure, resultants)


def test_every_mechanism_waits_for_the_last_and_remembers_the_others():
    structure, event = on_piers(), EveryMechanism()
    watch = event.watch(structure, af.Criteria())
    in_ring = state(structure, {3: -0.5, 6: -0.5, 9: -0.5, 12: -0.5})  # one face: cannot move
    with_pier = state(structure, {0: -0.5, 3: -0.5, 6: -0.5, 9: -0.5})
    moving = state(structure, {3: -0.5, 8: 0.5, 13: -0.5, 19: 0.5})
    assert possible_counts(structure) == ("any four joints", "four in a ring", "ring and pier")
    for resultants in (state(structure), in_ring, in_ring, with_pier):
        assert watch(resultants, STEP) is None
    assert "by each definition" in watch(moving, STEP)
    assert told(event, structure, moving) is None  # a fresh watch: never four in the ring
    assert "by each definition" in told(EveryMechanism(), ring(), state(ring(), ALTERNATING))
    alone = af.column(breadth=1.0, heights=[1.0])
    assert possible_counts(alone) == ()
    assert "by each definition" in told(EveryMechanism(), alone, state(alone, {0: 0.5}))


def test_events_wait_for_as_long_as_a_mechanism_lasts():
    """0.6 ms, a break, then twice 0.6 ms by different joints: only the last is long enough."""
    hinges = [state(ring(), each) for each in (ALTERNATING, ALTERNATING | {9: 0.5})]
    for event in (CountedMechanism(), MovingMechanism(), EveryMechanism()):
        watch = event.watch(ring(), af.Criteria())
        said = [watch(each, 6e-4) for each in (hinges[0], state(ring()), *hinges)]
        assert said[:3] == [None] * 3
        assert "a mechanism" in said[3]
        assert event.watch(ring(), af.Criteria(duration=0.0))(hinges[0], 6e-4) is not None
