"""State of collapse from positions of blocks, and doubts of what was near another kind."""

from dataclasses import replace

import numpy as np
import pytest
from loose_blocks import G, floor

import archfem as af
from archfem.dynamics import LooseBlocks, RigidBlockSimulation, classify_collapse, collapse_state
from archfem.masonry.structure import with_contacts


def pulse(peak, duration=0.5):
    return af.Motion(np.full(round(duration / 0.01), peak * G), 0.01)


def shaken(structure, motion):
    falling = RigidBlockSimulation(structure, dt=1e-3)
    return classify_collapse(
        structure, falling.frames(LooseBlocks.as_built(structure), 15.0, motion)
    )


def test_a_ring_that_hardly_moves_stands(ring):
    found = shaken(ring, pulse(0.3))
    assert (found.kind, found.time, found.blocks, found.resting) == ("stands", None, (), True)
    assert found.residual < 1e-3


def test_a_ring_shaken_hard_has_fallen():
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=9, chords=1)
    found = shaken(ring, pulse(0.7))
    assert found.kind == "fallen"
    assert found.resting
    assert 0.5 < found.time < 2.0
    assert "voussoir 5" in found.blocks
    assert found.residual > 1.0


def test_a_block_that_has_slid_is_dislocated():
    """Newmark's block: ½ (a - μ g) t² a / (μ g) under 0.8 g for 0.3 s at μ = 0.5."""
    structure = floor((-0.5, 0.0, 0.5, 0.5), friction=0.5)
    found = shaken(structure, af.Motion(np.repeat([0.8 * G, 0.0], [301, 2]), 1e-3))
    assert found.kind == "dislocated"
    slid = 0.5 * (0.8 - 0.5) * G * 0.3**2 * 0.8 / 0.5
    assert found.residual == pytest.approx(slid, rel=5e-3)  # the pulse ends 0.5 ms later


@pytest.mark.parametrize(
    ("moved", "said"),
    [
        ([0.0, 0.05, 0.049, 0.0, 0.0], ""),
        ([0.0, 0.051, 0.049, 0.0, 0.0], " (block 2)"),
        ([0.06, 0.05, 0.08, 0.04, 0.07], " (block 3, block 5, block 1)"),
        ([0.06, 0.051, 0.08, 0.09, 0.07], " (block 4, block 3, block 5 and 2 more)"),
    ],
)
def test_the_stones_that_are_dislocated_are_named_the_farthest_first(moved, said):
    """Of drums 0.5 m broad, so beyond 50 mm; as far in earlier frames says nothing."""
    column = af.column(breadth=0.5, heights=[0.5] * 5)
    frames = [LooseBlocks.as_built(column, time) for time in (1.0, 2.0)]
    free = list(column.free)
    frames[0].poses[free, 0], frames[1].poses[free, 0] = 0.1, moved
    found = classify_collapse(column, frames)
    kind = "dislocated" if said else "stands"
    assert (found.kind, found.dislocated_stones) == (kind, said)
    assert found.text == f"{kind}{said}, while blocks still move"


def test_a_toppled_column_has_fallen():
    column = af.column(breadth=0.6, heights=[2.4])
    found = shaken(column, pulse(0.4, 1.0))
    assert found.kind == "fallen"
    assert found.blocks == ("block 1",)


def arches(thin):
    """Two rings apart from each other on feet of their own, the second thinner."""
    rings = [
        af.circular_arch(radius=3.0, thickness=t, embrace=150.0, voussoirs=9, chords=1)
        for t in (0.9, thin)
    ]
    blocks, joints = [], []
    for k, ring in enumerate(rings):
        first = len(blocks)
        for block in ring.blocks:
            outline = tuple((x + 10.0 * k, y) for x, y in block.outline)
            blocks.append(
                af.Block(
                    outline,
                    block.material,
                    f"{block.name} of {k}",
                    fixed=block.fixed,
                    part=f"{block.part} of {k}",
                    role=block.role,
                )
            )
        for joint in ring.joints:
            ends = [(x + 10.0 * k, y) for x, y in joint.ends.tolist()]
            pair = tuple(number + first for number in joint.blocks)
            name, part = f"{joint.name} of {k}", f"{joint.part} of {k}"
            joints.append(af.Joint(pair, *ends, joint.contact, name, part, "ring"))
    return af.Structure(tuple(blocks), tuple(joints))


def test_one_ring_of_two_has_partly_fallen():
    found = shaken(arches(0.35), pulse(0.5))
    assert found.kind == "partly fallen"
    assert all(name.endswith(" of 1") for name in found.blocks)


def test_a_block_is_lost_once_it_has_sunk_or_turned():
    structure = floor((0.0, 0.0, 0.5, 2.0))
    for pose, kind in (
        ((0.04, 0.0, 0.0), "stands"),
        ((0.06, 0.0, 0.0), "dislocated"),
        ((0.0, -0.49, 0.0), "dislocated"),
        ((0.0, -0.51, 0.0), "fallen"),
        ((0.0, 0.0, 0.78), "dislocated"),
        ((0.0, 0.0, -0.79), "fallen"),
    ):
        start = LooseBlocks.as_built(structure, 3.0)
        start.poses[1] = pose
        found = classify_collapse(structure, [start])
        assert (found.kind, found.time) == (kind, 3.0 if kind == "fallen" else None)
    start.poses[1] = 0.0, 0.0, np.pi / 2.0
    assert classify_collapse(structure, [start]).residual == pytest.approx(
        np.sqrt(2.0) * np.hypot(0.25, 1.0)
    )


@pytest.mark.parametrize(
    ("sunk", "kind", "time"),
    [
        ([0.0, 0.51, 0.52, 0.49, 0.01], "stands", None),  # it sags, and closes again
        ([0.0, 0.51, 0.49, 0.49, 0.49], "dislocated", None),  # jammed
        ([0.0, 0.51, 0.49, 0.52, 5.0], "fallen", 4.0),
        ([0.0, 0.51, 0.52, 5.0, 4.9], "fallen", 2.0),
    ],
)
def test_a_block_is_lost_only_if_it_does_not_come_back(sunk, kind, time):
    """A block of 1 m², which is 0.5 m broad, at 1 to 5 s."""
    structure = floor((0.0, 0.0, 0.5, 2.0))
    frames = [LooseBlocks.as_built(structure, 1.0 + k) for k in range(len(sunk))]
    for frame, depth in zip(frames, sunk, strict=True):
        frame.poses[1, 1] = -depth
    found = classify_collapse(structure, frames)
    assert (found.kind, found.time) == (kind, time)


@pytest.mark.parametrize(("share", "kind"), [(0.98, "stands"), (1.02, "fallen")])
def test_a_block_that_rocks_beyond_the_limit_is_lost_only_if_it_topples(share, kind):
    """A block 1 m by 0.7 m topples at 55°, by the energy that lifts its centroid over its corner.

    With 0.98 of that it turns to 47.5°, where cos(55° - turn) = cos 55° + 0.98 (1 - cos 55°), and
    back. Frames come each 0.02 s, in which it turns there by less than 1 % of that.
    """
    structure = floor((0.0, 0.0, 1.0, 0.7), friction=5.0, floor=(-2.0, 3.0))
    start, radius, tilt = LooseBlocks.as_built(structure), np.hypot(0.5, 0.35), np.arctan(1 / 0.7)
    # ½ (4/3) radius² speed² = share · g · radius (1 - cos tilt), about the lower right corner
    speed = np.sqrt(1.5 * share * G / radius * (1.0 - np.cos(tilt)))
    start.velocities[1] = 0.35 * speed, 0.5 * speed, -speed
    frames = list(RigidBlockSimulation(structure, dt=5e-4).frames(start, 10.0))
    assert classify_collapse(structure, frames).kind == kind
    if kind == "stands":
        turn = max(-each.poses[1, 2] for each in frames)
        back = np.arccos(np.cos(tilt) + share * (1.0 - np.cos(tilt)))
        assert turn == pytest.approx(tilt - back, rel=0.01)
        assert turn > np.pi / 4.0
    brief = [*collapse_state.follow_until_lost(structure, iter(frames))]
    assert (len(brief) < len(frames)) == (kind == "fallen")


@pytest.mark.parametrize(
    ("spread", "end", "kind", "drop"),
    [
        (0.045, 3.0, "dislocated", np.sqrt(3.0) * 0.045),  # jammed, 78 mm below its place
        (0.6, 3.0, "fallen", None),
        (0.6, 0.16, "unknown", None),
        (0.045, 0.3, "unknown", np.sqrt(3.0) * 0.045),  # it trembles in its new place
    ],
)
def test_a_ring_of_thin_stones_that_sags_is_lost_only_where_nothing_bears_it(
    spread, end, kind, drop
):
    """Springings at 60° move apart by `spread` each: a ring sinks by tan 60° times that.

    Half the root of the area of its stones, 0.4 m by 0.05 m, is 71 mm.
    """
    thin = af.circular_arch(radius=3.0, thickness=0.4, embrace=60.0, voussoirs=62, chords=1)
    start = LooseBlocks.as_built(thin)
    start.poses[[0, -1], 0] = -spread, spread
    frames = list(RigidBlockSimulation(thin, dt=1e-3).frames(start, end))
    found = classify_collapse(thin, frames, start.poses)
    assert found.kind == kind
    assert found.text.startswith(
        "not decided: still moving, out of place" if kind == "unknown" else kind
    )
    assert (found.time is None) == (kind != "fallen")
    assert found.resting == (end > 1.0)
    assert len(found.blocks) == 62
    followed = list(collapse_state.follow_until_lost(thin, iter(frames)))
    assert (len(followed) < len(frames)) == (kind == "fallen")
    if drop:
        assert -frames[-1].poses[31, 1] == pytest.approx(drop, rel=0.01)


def test_a_fall_is_followed_until_a_stone_is_lost_for_good():
    """A free fall by the diagonal of 6 m by 8 m lasts 1.43 s; frames come each 0.1 s."""
    structure = floor((0.0, 0.0, 1.0, 7.0), floor=(0.0, 6.0))
    frames = [LooseBlocks.as_built(structure, 0.1 * k) for k in range(60)]
    for frame in frames[10:20] + frames[21:]:  # from 1 s on, and from 2.1 s on
        frame.poses[1, 1] = -2.0
    last = [*collapse_state.follow_until_lost(structure, iter(frames))][-1]
    assert last.time == pytest.approx(3.6)


def test_a_fall_is_followed_by_the_blocks_that_are_restored():
    """Grains in place of fill have poses that are not those of the structure."""
    structure = floor((0.0, 0.0, 1.0, 7.0), floor=(0.0, 6.0))
    frames = [LooseBlocks.as_built(structure, 1.0 * k) for k in range(9)]
    fallen = LooseBlocks.as_built(structure)
    fallen.poses[1, 2] = 1.0
    found = collapse_state.follow_until_lost(structure, iter(frames), lambda _: fallen)
    assert [each.time for each in found] == [0.0, 1.0, 2.0]


@pytest.mark.parametrize("friction", [0.6, pytest.param(1.0, marks=pytest.mark.slow)])
def test_steep_friction_leaves_in_doubt_where_stones_lie_and_not_that_they_fall(friction):
    """A ring under 1.4 g for half a second, whose stones hit the ground from 0.64 s on.

    In a tenth of all steps impulses do not settle, and in none before the first stone is lost.
    """
    contact = af.Contact(1e9, 4e8, friction)
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17, chords=1)
    ring = with_contacts(ring, lambda _: contact)
    start, motion = LooseBlocks.as_built(ring), pulse(1.4)
    frames = list(RigidBlockSimulation(ring, dt=1e-3).frames(start, 10.0, motion))
    found = classify_collapse(ring, frames)
    assert (found.kind, found.unsettled) == ("fallen", 0.0)
    assert found.time == pytest.approx(0.36, abs=0.02)
    assert frames[-1].settling.unsettled_share > 0.02
    assert "in doubt" not in found.text


def test_a_fall_whose_impulses_did_not_settle_before_it_is_in_doubt():
    """In 2 of 10 steps up to the loss at 2 s, and in none after it."""
    structure = floor((0.0, 0.0, 0.5, 2.0))
    start = LooseBlocks.as_built(structure)
    simulation = RigidBlockSimulation(structure, dt=1e-3)
    (first, *_), frames = simulation.frames(start, 1.0), []
    for time, steps, sunk in ((0.0, 1, 0.0), (2.0, 10, 0.6), (5.0, 100, 0.6)):
        settling = replace(first.settling, unsettled=2 * (steps > 1), steps=steps)
        frames.append(replace(first, time=time, settling=settling, poses=first.poses.copy()))
        frames[-1].poses[1, 1] = -sunk
    found = classify_collapse(structure, [*frames[:-1], replace(frames[-1], resting=True)])
    assert found.unsettled == 0.2
    assert found.text.endswith("in doubt: impulses did not settle in 20% of the steps")


def test_a_run_without_frames_is_refused():
    with pytest.raises(af.errors.InvalidInput, match="no frames"):
        classify_collapse(floor((0.0, 0.0, 0.5, 2.0)), [])


@pytest.mark.parametrize(
    ("kind", "displacement", "residual", "words"),
    [
        ("stands", 0.059, 0.006, []),
        ("stands", 0.062, 0.006, ["displaced by 62 mm, 0.62 of the depth"]),
        ("stands", 0.03, 0.0068, ["of 6.8 mm is within a factor of 1.5 of 10 mm"]),
        ("dislocated", 0.03, 0.0148, ["of 14.8 mm is within a factor of 1.5 of 10 mm"]),
        ("dislocated", 0.07, 0.0152, ["displaced by 70 mm"]),
        ("fallen", 0.09, 0.012, []),
    ],
)
def test_a_kind_of_collapse_near_another_is_doubted(kind, displacement, residual, words):
    """Limits of a column 0.1 m deep: 60 mm on the way, and 10 mm × 1.5 and / 1.5 at the end."""
    column = af.column(breadth=0.1, heights=[0.3])
    state = collapse_state.CollapseState(kind, None, (), displacement, residual, resting=True)
    doubts = list(collapse_state.doubt_collapse(column, state))
    assert len(doubts) == len(words)
    assert all(word in doubt.cause for word, doubt in zip(words, doubts, strict=True))


@pytest.mark.parametrize(
    ("kind", "largest", "end", "resting", "doubted"),
    [
        ("stands", 0.009, 0.008, False, False),  # moves by less than would dislocate it, 10 mm
        ("stands", 0.03, 0.008, False, True),
        ("dislocated", 0.03, 0.02, True, False),
        ("dislocated", 0.03, 0.012, False, True),
    ],
)
def test_what_has_moved_far_and_does_not_rest_is_doubted(kind, largest, end, resting, doubted):
    """In place of a residual displacement near its limit, which a phase of rocking is not."""
    column = af.column(breadth=0.1, heights=[0.3])
    state = collapse_state.CollapseState(kind, None, (), largest, end, resting)
    for held, rest, remedy in (
        (False, 4.0, "motion.rest=10`"),
        (False, 9.995, "suite.pairs.NAME.rest=20"),
        (True, 0.0, "hold the push longer"),
    ):
        doubts = list(collapse_state.doubt_collapse(column, state, held, rest))
        assert [doubt.cause for doubt in doubts] == doubted * [
            "blocks still move at the end: they may come back from "
            f"{1e3 * end:.0f} mm, or go farther"
        ]
        assert all(remedy in doubt.remedy for doubt in doubts)
