"""Where convex pieces touch."""

from itertools import pairwise, product

import numpy as np
import pytest
import shapely
from loose_blocks import floor

import archfem as af
from archfem.dynamics.loose_fill import LooseStructure
from archfem.dynamics.rigid_body.bodies import make_bodies
from archfem.dynamics.rigid_body.contact_detection import (
    allocate_contacts,
    allocate_pieces,
    find_contacts,
    place_pieces,
)


def touching(structure, poses, **options):
    """Bodies, points, normals and gaps of all contacts."""
    bodies = make_bodies(structure, **options)
    world, found = allocate_pieces(bodies), allocate_contacts(len(bodies.owner))
    poses = np.asarray(poses, dtype=float)
    place_pieces(bodies, poses, world)
    count = find_contacts(bodies, world, found, (poses, np.zeros((len(poses) + 1, 3)), 0.0))
    return found.bodies[:count], found.point[:count], found.normal[:count], found.gap[:count]


def test_a_box_on_the_floor_touches_at_its_ends():
    poses = np.zeros((2, 3))
    poses[1, 1] = -1e-3
    bodies, points, normals, gaps = touching(floor((0.0, 0.0, 0.5, 2.0)), poses)
    assert bodies.tolist() == [[0, 1], [0, 1]]
    assert sorted(points[:, 0]) == pytest.approx([0.0, 0.5], abs=1e-12)
    assert points[:, 1] == pytest.approx(-5e-4, abs=1e-12)
    assert normals == pytest.approx(np.array([[0.0, 1.0]] * 2), abs=1e-12)
    assert gaps == pytest.approx(-1e-3, abs=1e-12)


def test_a_tilted_box_touches_at_its_corner():
    structure = floor((0.0, 0.0, 0.5, 2.0))
    turn = -0.1
    c, s = np.cos(turn), np.sin(turn)
    arm = np.array([0.25, -1.0])
    down = arm - np.array([[c, -s], [s, c]]) @ arm
    bodies, points, normals, gaps = touching(structure, [[0, 0, 0], [*down, turn]])
    assert bodies.tolist() == [[0, 1]]
    assert points[0] == pytest.approx([0.5, 0.0], abs=1e-12)
    assert normals[0] == pytest.approx([0.0, 1.0], abs=1e-12)
    assert gaps[0] == pytest.approx(0.0, abs=1e-12)


def test_a_block_on_the_ground_touches_it():
    poses = np.zeros((2, 3))
    poses[1] = 100.0, -1.0, 0.0  # far beside the floor, whose foot is the ground
    bodies, points, normals, _ = touching(floor((0.0, 0.0, 0.5, 2.0)), poses)
    assert bodies.tolist() == [[1, 2], [1, 2]]
    assert points[:, 0] == pytest.approx([100.0, 100.5], abs=1e-12)
    assert normals[:, 1].tolist() == [-1.0, -1.0]


def test_a_cut_between_pieces_is_no_face():
    """A corner in the top of a stone, close to where the stone was cut, is pushed out upwards."""
    ring = af.circular_arch(
        radius=3.0, thickness=0.5, embrace=60.0, voussoirs=2, chords=2, gravity=9.81
    )
    cut = ring.blocks[1].points[4]  # the middle of the extrados
    outward = cut / np.linalg.norm(cut)
    stone = ring.blocks[2].points
    depth, aside = 2e-3, 1e-4
    for way in (-1.0, 1.0):
        along = way * aside * np.array([outward[1], -outward[0]])
        corner = int(np.argmin(stone @ outward))
        move = cut - depth * outward + along - stone[corner]
        poses = np.zeros((4, 3))
        poses[2, :2] = move
        bodies, _, normals, gaps = touching(ring, poses, level=-10.0)
        mine = [k for k, pair in enumerate(bodies.tolist()) if pair == [1, 2]]
        deepest = min(mine, key=lambda k: gaps[k])
        assert abs(normals[deepest] @ outward) > 0.97  # chords lie 7.5° off the circle at most


def test_heaps_of_boxes_touch_where_their_shapes_meet():
    """Pairs found by the sweep are those whose polygons intersect."""
    rng = np.random.default_rng(5)
    boxes = [(2.0 * k, 0.0, 2.0 * k + 1.0, rng.uniform(0.5, 2.0)) for k in range(25)]
    structure = floor(*boxes)
    for _ in range(20):
        poses = np.zeros((26, 3))
        poses[1:, 2] = rng.uniform(-np.pi, np.pi, 25)
        for number in range(1, 26):
            wanted = rng.uniform(0.0, [12.0, 8.0])
            poses[number, :2] = wanted - structure.blocks[number].centroid
        bodies, *_ = touching(structure, poses, level=-50.0)
        shapes = [moved(block, pose) for block, pose in zip(structure.blocks, poses, strict=True)]
        pairs = shapely.STRtree(shapes).query(shapes, predicate="intersects").T.tolist()
        assert {tuple(pair) for pair in bodies.tolist()} <= {tuple(p) for p in pairs if p[0] < p[1]}
        missed = {tuple(p) for p in pairs if p[0] < p[1]} - {tuple(p) for p in bodies.tolist()}
        assert not missed


def moved(block, pose):
    """A block where it is, as a polygon."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    arms = block.points - block.centroid
    return shapely.Polygon(arms @ np.array([[c, s], [-s, c]]) + block.centroid + pose[:2])


def test_no_contact_with_concave_ground_is_deeper_than_the_overlap():
    """A block lies flat on a face of the ground, with a corner at most 3 mm from its end."""
    rng = np.random.default_rng(1)
    deepest, overlap, missed = 0.0, 0.0, 0
    for _ in range(20):
        structure = rough_ground(rng)
        ground = shapely.Polygon(structure.blocks[0].points)
        top = structure.blocks[0].points[2:]
        for (right, left), end in product(pairwise(top), (0, 1)):
            along = (right - left) / np.linalg.norm(right - left)
            shift = (1 - 2 * end) * 10.0 ** rng.uniform(-5.0, -2.5) * rng.uniform(-1.0, 1.0)
            into = shift * along + 10.0 ** rng.uniform(-5.0, -3.0) * np.array([along[1], -along[0]])
            turn = np.arctan2(along[1], along[0])
            arm = structure.blocks[1].points[1 - end] - structure.blocks[1].centroid
            turned = np.array([along, [-along[1], along[0]]]).T @ arm
            corner = (left if end else right) + into
            pose = [*(corner - turned - structure.blocks[1].centroid), turn]
            common = moved(structure.blocks[1], pose).intersection(ground)
            points = map(shapely.Point, shapely.get_coordinates(common))
            depth = max((ground.exterior.distance(point) for point in points), default=0.0)
            if 0.0 < depth < 5e-3:  # else another part of the ground is in the way
                *_, gaps = touching(structure, [[0, 0, 0], pose], level=-10.0)
                missed += not len(gaps)
                deepest, overlap = max(deepest, -gaps.min(initial=0.0)), max(overlap, depth)
    assert missed == 0
    assert overlap > 1e-3  # there are such corners
    assert deepest < 5e-3


def rough_ground(rng):
    """A ground with six corners at random heights in its top, and a block, built below it."""
    places = np.linspace(3.0, -3.0, 6) + rng.uniform(-0.4, 0.4, 6)
    top = [(float(x), float(rng.uniform(-1.0, 1.0))) for x in (4.0, *places, -4.0)]
    slab = af.Block([(-4.0, -1.5), (4.0, -1.5), *top], af.STONE, "ground", fixed=True)
    breadth, height = rng.uniform(0.3, 1.0, 2)
    left, right, foot = -0.5 * breadth, 0.5 * breadth, -1.5 - height
    box = af.Block([(left, foot), (right, foot), (right, -1.5), (left, -1.5)], af.STONE, "box")
    ends = (left, -1.5), (right, -1.5)
    joint = af.Joint((0, 1), *ends, af.Contact(1e9, 1e9, 0.6), "joint")
    return LooseStructure((slab, box), (joint,))
