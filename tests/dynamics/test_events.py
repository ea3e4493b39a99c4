"""Events that end a run, on joints whose state is known and in whole runs."""

from itertools import pairwise

import numpy as np
import pytest

from archfem.dynamics.events import (
    CountedMechanism,
    EveryMechanism,
    MovingMechanism,
    possible_counts,
)
from archfem.dynamics.schemes import Rayleigh
from archfem.dynamics.time_history import time_history
from archfem.joints.criteria import Criteria
from archfem.limit.verified import Verifier, first_verified_mechanism
from archfem.masonry.assembly import assembled
from archfem.masonry.block import Block
from archfem.masonry.materials import BACKFILL, STONE_TO_STONE
from archfem.masonry.shapes import arch_on_piers, circular_arch, column
from archfem.models.rigid import rigid
from archfem.motion.motion import Motion

WEIGHT = 1e4


def ring():
    return circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)


def on_piers():
    return arch_on_piers(
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
    watch = event.watch(structure, criteria or Criteria())
    return [watch(resultants) for resultants in states][-1]


def test_both_events_see_four_alternating_hinges():
    for event in (CountedMechanism(), MovingMechanism()):
        reason = told(event, ring(), state(ring(), ALTERNATING))
        assert "motion and count agree: by motion local (arch)" in reason
        assert "(0, 6, 12, 17)" in reason


def test_four_hinges_on_one_face_are_counted_and_do_not_move():
    counted = told(CountedMechanism(), ring(), state(ring(), SAME_SIDE))
    assert "motion and count disagree: by motion none, by count local (arch)" in counted
    assert told(MovingMechanism(), ring(), state(ring(), SAME_SIDE)) is None


def test_one_sliding_joint_moves_a_block_that_nobody_counts():
    stack = column(breadth=1.0, heights=[1.0, 1.0])
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


def test_nothing_is_asked_while_no_joint_fails_and_nothing_twice(monkeypatch):
    asked = []
    real = Verifier.moving
    monkeypatch.setattr(Verifier, "moving", lambda *given: asked.append(1) or real(*given))
    structure = ring()
    twice = [state(structure, SAME_SIDE)] * 2
    assert told(MovingMechanism(), structure, state(structure), *twice) is None
    assert len(asked) == 1


def test_a_run_ends_when_its_blocks_can_move():
    """The instant is that of the record of the whole run, looked through afterwards."""
    model, motion = rigid(ring()), Motion.synthetic(duration=3.0, pga=6.0, seed=2)
    damping = Rayleigh(0.05, (8.0, 16.0))
    whole = time_history(model, motion, damping=damping)
    expected = first_verified_mechanism(model.structure, whole.joints)
    halted = time_history(model, motion, damping=damping, until=MovingMechanism())
    assert halted.time[-1] == pytest.approx(expected.moved.time)
    assert "a mechanism that moves" in halted.outcome
    assert str(expected) in halted.outcome


def test_an_event_serves_several_structures():
    """The same numbers of joints, in another structure, are another state."""
    event, lone = MovingMechanism(), column(breadth=1.0, heights=[1.0] * 18)
    assert told(event, ring(), state(ring(), {0: 0.5})) is None
    assert told(event, lone, state(lone, {0: 0.5})) is not None


def with_soil():
    """Two stones and, on them, twenty flat bodies of soil."""
    stones = column(breadth=1.0, heights=[1.0, 1.0])
    levels = [2.0 + 0.1 * k for k in range(21)]
    soil = [
        Block(
            ((-0.5, y), (0.5, y), (0.5, top), (-0.5, top)), BACKFILL, f"soil {y:.1f}", part="fill"
        )
        for y, top in pairwise(levels)
    ]
    return assembled([*stones.blocks, *soil], STONE_TO_STONE, joints=stones.joints)


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
    watch = event.watch(structure, Criteria())
    in_ring = state(structure, {3: -0.5, 6: -0.5, 9: -0.5, 12: -0.5})  # one face: cannot move
    with_pier = state(structure, {0: -0.5, 3: -0.5, 6: -0.5, 9: -0.5})
    moving = state(structure, {3: -0.5, 8: 0.5, 13: -0.5, 19: 0.5})
    assert possible_counts(structure) == ("any four joints", "four in a ring", "ring and pier")
    for resultants in (state(structure), in_ring, in_ring, with_pier):
        assert watch(resultants) is None
    assert "by each definition" in watch(moving)
    assert told(event, structure, moving) is None  # a fresh watch: never four in the ring
    assert "by each definition" in told(EveryMechanism(), ring(), state(ring(), ALTERNATING))
    assert possible_counts(column(breadth=1.0, heights=[1.0])) == ()
