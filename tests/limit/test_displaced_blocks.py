"""Blocks at other places: rates by finite differences, work of loads, faces and what touches."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import archfem as af
from archfem.limit.displaced_blocks import (
    Bodies,
    Contact,
    PlacedBlocks,
    find_corners,
    find_mechanism,
    merge_blocks,
)

STONE = af.masonry.STONE_TO_STONE
STEP = 1e-6
"""Of central differences: they err by 1e-11 of lengths of metres."""


@pytest.fixture(scope="module")
def blocks():
    """A ring of five stones with plane faces, each displaced and turned, with loads that stay."""
    ring = af.circular_arch(radius=2.0, thickness=0.5, embrace=150.0, voussoirs=5, chords=1)
    loads = [
        af.masonry.AttachedLoad(2, tuple(ring.blocks[2].points[1]), weight=7e3, force=(1e3, -2e3)),
        af.masonry.AttachedLoad(4, tuple(ring.blocks[4].points[2]), force=(-3e3, 5e2)),
    ]
    moved = np.random.default_rng(1).uniform(-0.2, 0.2, (len(ring.blocks), 3))
    return PlacedBlocks.at_rest(ring, loads, -1.0).moved(moved)


@pytest.fixture(scope="module")
def bodies(blocks):
    """Bodies of one, two and two blocks, between supports at rest."""
    return Bodies(blocks, np.array([-1, 0, 1, 1, 2, 2, -1]))


def later(blocks, motion, time):
    return blocks.moved(blocks.displacement + time * motion)


def rate(value, blocks, motion):
    return (value(later(blocks, motion, STEP)) - value(later(blocks, motion, -STEP))) / (2 * STEP)


def velocities(bodies, seed=2):
    return np.random.default_rng(seed).uniform(-1.0, 1.0, 3 * bodies.count)


def test_bodies_move_as_one_about_the_mean_of_their_centroids(bodies):
    """Blocks of a body keep their distances; the references move by the velocities given."""
    velocity = velocities(bodies)
    motion, blocks = bodies.spread(velocity), bodies.blocks
    assert not motion[[0, 6]].any()
    assert bodies.gather(motion) == pytest.approx(velocity)
    for number, members in enumerate(([1], [2, 3], [4, 5])):
        assert bodies.references[number] == pytest.approx(blocks.centroids[members].mean(axis=0))
        assert motion[members, :2].mean(axis=0) == pytest.approx(
            velocity[3 * number : 3 * number + 2]
        )
        assert motion[members, 2] == pytest.approx(velocity[3 * number + 2])

    def apart(placed):
        return np.linalg.norm(placed.centroids[5] - placed.centroids[4])

    assert rate(apart, blocks, motion) == pytest.approx(0.0, abs=1e-9)


def test_generalised_forces_do_the_work_of_the_loads(bodies):
    velocity = velocities(bodies)
    motion, blocks = bodies.spread(velocity), bodies.blocks
    for loads in (blocks.dead, blocks.live):
        assert bodies.generalised(loads) @ velocity == pytest.approx(np.sum(loads * motion))


def test_dead_loads_do_the_work_of_weights_and_forces_at_their_points(blocks):
    """By differences of potential: heights of centroids and loads, and ways along the forces."""
    motion = np.random.default_rng(3).uniform(-1.0, 1.0, blocks.displacement.shape)
    ring = blocks.structure
    own = [block.area * block.material.unit_weight * ring.width for block in ring.blocks]

    def work(placed):
        points = [placed.places(np.array([load.point]), load.block)[0] for load in blocks.loads]
        total = -np.dot(own, placed.centroids[:, 1])
        for load, point in zip(blocks.loads, points, strict=True):
            total += load.force @ point - load.weight * point[1]
        return total

    def along(placed):
        first = blocks.loads[0]
        point = placed.places(np.array([first.point]), first.block)[0]
        return np.dot(own, placed.centroids[:, 0]) + first.weight * point[0]

    for forces, potential in ((blocks.dead, work), (-blocks.live, along)):
        works = forces * motion
        # round-off of potentials over the step, relative to the works, which cancel in the sum
        error = 1e-8 * np.abs(works).sum()
        assert np.sum(works) == pytest.approx(rate(potential, blocks, motion), abs=error)


def test_gaps_and_slips_have_the_rates_of_corners_seen_from_faces(bodies):
    """Corners of either block, at any place: gaps by `gaps`, slips along the face."""
    velocity, blocks = velocities(bodies), bodies.blocks
    motion, pairs = bodies.spread(velocity), blocks.structure.pairs
    contacts, gaps, slips = [], [], []
    for joint in range(len(pairs)):
        for side in (0, 1):
            for end in (0, 1):
                point, normal = blocks.faces[side, joint, end], blocks.normals[1 - side, joint]
                contacts.append(Contact(joint, *pairs[joint, [side, 1 - side]], point, normal))

                def height(placed, side=side, joint=joint, end=end):
                    arm = placed.faces[side, joint, end] - placed.faces[1 - side, joint, 0]
                    return arm @ placed.normals[1 - side, joint]

                def way(placed, side=side, joint=joint, end=end):
                    arm = placed.faces[side, joint, end] - placed.faces[1 - side, joint, 0]
                    x, y = placed.normals[1 - side, joint]
                    return arm @ [y, -x]

                gaps.append(rate(height, blocks, motion))
                slips.append(rate(way, blocks, motion))
    normal, along = bodies.rates(contacts)
    assert normal @ velocity == pytest.approx(gaps, abs=1e-8)
    assert along @ velocity == pytest.approx(slips, abs=1e-8)
    # contacts between blocks of one body do not move
    within = [k for k, each in enumerate(contacts) if {each.corner, each.face} == {2, 3}]
    assert not normal[within].any()
    assert not along[within].any()


def test_the_fastest_corner_of_a_mechanism_moves_at_1_m_s():
    """Speeds of all corners by differences of the outlines."""
    ring = af.circular_arch(radius=2.0, thickness=0.5, embrace=150.0, voussoirs=5)
    blocks = PlacedBlocks.at_rest(ring)
    motion = find_mechanism(blocks, range(len(ring.joints)), ring.friction).motion
    ends = [later(blocks, motion, time).outlines for time in (STEP, -STEP)]
    speeds = [
        np.linalg.norm(after - before, axis=1).max() / (2 * STEP)
        for after, before in zip(*ends, strict=True)
    ]
    assert max(speeds) == pytest.approx(1.0, rel=1e-8)


def test_faces_and_normals_turn_with_their_blocks(blocks):
    ring = blocks.structure
    for joint, pair in enumerate(ring.pairs):
        for side, block in enumerate(pair):
            at_rest = find_corners(ring)[side, joint]
            assert blocks.faces[side, joint] == pytest.approx(blocks.places(at_rest, block))
            cos, sin = (f(blocks.displacement[block, 2]) for f in (np.cos, np.sin))
            turned = np.array([[cos, -sin], [sin, cos]]) @ ring.normals[joint]
            assert blocks.normals[side, joint] == pytest.approx((1 - 2 * side) * turned)


def pile(*boxes):
    """Boxes (left, bottom, right, top), the first fixed, each on the one before."""
    made = []
    for k, (left, low, right, high) in enumerate(boxes):
        outline = ((left, low), (right, low), (right, high), (left, high))
        made.append(af.Block(outline, af.STONE, f"block {k}", fixed=k == 0))
    joints = []
    for k, (lower, upper) in enumerate(pairwise(boxes)):
        left, right = max(lower[0], upper[0]), min(lower[2], upper[2])
        ends = (left, lower[3]), (right, lower[3])
        joints.append(af.Joint((k, k + 1), *ends, STONE, f"joint {k}"))
    return af.Structure(tuple(made), tuple(joints))


TWO = pile((-1.0, -0.5, 1.0, 0.0), (-0.5, 0.0, 0.5, 1.0))
SIZE = TWO.size


def placed(x, y, turn=0.0):
    return PlacedBlocks.at_rest(TWO).moved(np.array([[0.0, 0.0, 0.0], [x, y, turn]]))


def test_corners_of_a_narrow_block_have_gaps_and_those_of_the_wide_one_are_beside_it():
    gaps = placed(0.0, 0.03).gaps
    assert gaps[1, 0] == pytest.approx([0.03, 0.03])
    assert np.isinf(gaps[0, 0]).all()
    far = placed(1.2, 0.0).gaps
    assert np.isinf(far[1, 0]).tolist() == [False, True]
    assert far[0, 0] == pytest.approx([np.inf, 0.0])


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize(("beyond", "touches"), [(0.9e-6, True), (1.1e-6, False)])
def test_a_corner_is_on_a_face_up_to_a_millionth_of_the_size(side, beyond, touches):
    """Along the face, beyond its end, and across it, to either side."""
    off = placed(side * (0.5 + beyond * SIZE), 0.0)
    end = 1 if side > 0.0 else 0
    assert bool(np.isfinite(off.gaps[1, 0, end])) is touches
    contacts = placed(0.0, side * beyond * SIZE).touching([0])
    assert len(contacts) == (2 if touches else 0)
    assert placed(0.0, 0.0).touching([]) == []


def test_corners_that_coincide_are_one_contact_of_the_higher_block():
    """Equal faces coincide; faces that have slid touch by a corner of each."""
    equal = pile((-0.5, -0.5, 0.5, 0.0), (-0.5, 0.0, 0.5, 1.0))

    def touching(x):
        moved = np.array([[0.0, 0.0, 0.0], [x, 0.0, 0.0]])
        return PlacedBlocks.at_rest(equal).moved(moved).touching([0])

    for x in (0.0, 0.9e-6 * equal.size):
        assert [(each.corner, each.face) for each in touching(x)] == [(1, 0), (1, 0)]
    slid = touching(0.2)
    assert sorted((each.corner, each.face) for each in slid) == [(0, 1), (1, 0)]
    for each in slid:
        assert each.normal == pytest.approx([0.0, 1.0 if each.corner else -1.0])
        assert each.point == pytest.approx([-0.3 if each.corner else 0.5, 0.0])


def test_welded_blocks_are_bodies_and_those_on_supports_at_rest():
    ring = af.circular_arch(radius=2.0, thickness=0.5, embrace=150.0, voussoirs=5)
    assert merge_blocks(ring, []).tolist() == [-1, 0, 1, 2, 3, 4, -1]
    assert merge_blocks(ring, [0, 2, 3]).tolist() == [-1, -1, 0, 0, 0, 1, -1]
    assert merge_blocks(ring, range(6)).tolist() == 7 * [-1]


def test_faces_beyond_their_joint_slide_on_all_of_it():
    """The face of a wide block is the whole of its top, that of a narrow one its foot."""
    corners = find_corners(TWO)
    assert corners[0, 0, :, 0] == pytest.approx([-1.0, 1.0])
    assert corners[1, 0, :, 0] == pytest.approx([-0.5, 0.5])
    assert not corners[..., 1].any()


def test_masses_are_those_of_blocks_and_of_loads_with_weight(blocks):
    found = [(number, weight) for number, _, weight in blocks.masses]
    ring = blocks.structure
    own = [(k, each.area * 20e3) for k, each in enumerate(ring.blocks)]
    assert found == [*((k, pytest.approx(weight)) for k, weight in own), (2, 7e3)]
    assert blocks.masses[-1][1] == pytest.approx(blocks.attached[0][1])


def test_a_tie_that_was_longer_does_not_pull():
    """A block of 0.6 × 2.4 m turned by θ: moments about its toe, with and without its tie."""
    turn, force, wall = 0.1, 5e3, af.column(breadth=0.6, heights=[2.4])
    weight = 0.6 * 2.4 * wall.blocks[1].material.unit_weight
    tie = af.masonry.AttachedLoad("block 1", (-0.3, 2.0), force=(-force, 0.0), passive=True)
    (cosine, sine), toe = (np.cos(turn), np.sin(turn)), np.array([0.3, 0.0])
    x, y = np.array([[cosine, sine], [-sine, cosine]]) @ (wall.centroids[1] - toe) + toe
    moved = np.array([[0.0, 0.0, 0.0], [x - wall.centroids[1, 0], y - wall.centroids[1, 1], -turn]])
    turned = PlacedBlocks.at_rest(wall, [tie]).moved(moved)
    # the tie's point is 0.6 m behind the toe and 2 m above it
    stretch = 0.6 * (1.0 - cosine) + 2.0 * sine
    assert turned.stretches == pytest.approx([stretch])
    for longest, pull in ((0.9 * stretch, force), (stretch, force), (1.1 * stretch, 0.0)):
        found = find_mechanism(replace(turned, longest=np.array([longest])), [0], wall.friction)
        moment = weight * (0.3 * cosine - 1.2 * sine) + pull * (2.0 * cosine + 0.6 * sine)
        factor = moment / (weight * (1.2 * cosine + 0.3 * sine))
        assert found.factor == pytest.approx(factor, rel=1e-6)
