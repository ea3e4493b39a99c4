"""Masses, shapes, friction and convex pieces of blocks."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from loose_blocks import G, floor

import archfem as af
from archfem.dynamics.rigid_body.bodies import (
    check_rigid_blocks,
    make_bodies,
    split_convex,
)
from archfem.masonry.block import drop_straight_vertices


def test_mass_and_moment_of_a_box():
    structure = replace(floor((0.0, 0.0, 0.5, 2.0)), width=3.0)
    bodies = make_bodies(structure)
    mass = 20e3 / G * 0.5 * 2.0 * 3.0
    assert bodies.mass[1] == pytest.approx([mass, mass * (0.5**2 + 2.0**2) / 12.0], rel=1e-12)
    assert bodies.inverse_mass[1] == pytest.approx(1.0 / bodies.mass[1], rel=1e-15)
    assert not bodies.inverse_mass[[0, 2]].any()  # the floor, and the ground
    assert bodies.reach[1] == pytest.approx(np.hypot(0.25, 1.0), rel=1e-12)


def test_the_ground_is_where_the_fixed_blocks_end():
    structure = floor((0.0, 0.0, 0.5, 2.0))
    assert make_bodies(structure).level == -1.0
    assert make_bodies(structure, level=-3.0).level == -3.0
    with pytest.raises(af.errors.InvalidInput, match="above the foot of block 'block 1'"):
        make_bodies(structure, level=0.1)


def test_friction_is_that_of_the_joint_or_the_least():
    ring = af.circular_arch(radius=3.0, thickness=0.5, embrace=150.0, voussoirs=3)
    rough = replace(ring.joints[1].contact, friction=0.9)
    joints = tuple(
        replace(joint, contact=rough) if k == 1 else joint for k, joint in enumerate(ring.joints)
    )
    ring = replace(ring, joints=joints)
    found = make_bodies(ring).friction
    assert found[1, 2] == found[2, 1] == 0.9
    assert found[0, 1] == found[1, 3] == found[2, -1] == 0.6
    assert make_bodies(ring, friction=0.3).friction[1, 3] == 0.3


def test_friction_must_be_known():
    endless = af.circular_arch(
        radius=3.0,
        thickness=0.5,
        embrace=150.0,
        voussoirs=3,
        contact=af.Contact(1e9, 1e9, None),
    )
    with pytest.raises(af.errors.InvalidInput, match="give friction"):
        make_bodies(endless)
    assert np.isfinite(make_bodies(endless, friction=0.5).friction).all()


def test_a_sector_of_a_wide_angle_has_chords():
    ring = af.circular_arch(radius=3.0, thickness=0.5, embrace=150.0, voussoirs=3)
    bodies = make_bodies(ring)
    assert np.bincount(bodies.owner).tolist() == [1, 4, 4, 4, 1]  # 50° in chords of 12.5°
    cuts = ~bodies.outer
    assert np.bincount(bodies.owner.repeat(np.diff(bodies.piece_starts)), cuts).tolist() == [
        0,
        6,
        6,
        6,
        0,
    ]


def test_joints_with_bonds_are_refused():
    ring = af.circular_arch(
        radius=3.0,
        thickness=0.5,
        embrace=150.0,
        voussoirs=3,
        contact=af.Contact(1e9, 1e9, 0.6, cohesion=1e4, tension=5e3),
    )
    with pytest.raises(af.errors.InvalidInput, match=r"tensile strength 5e\+03 Pa"):
        check_rigid_blocks(ring)


def test_a_soft_body_is_doubted(caplog):
    soil = af.Material(6.25e6, 0.2, 18e3, name="soil")
    structure = floor((0.0, 0.0, 2.0, 2.0))
    blocks = (structure.blocks[0], replace(structure.blocks[1], material=soil))
    check_rigid_blocks(replace(structure, blocks=blocks))
    assert "'block 1' is soft" in caplog.text


def covered(points, pieces):
    """Area of the pieces, each convex."""
    polygons = [shapely.Polygon(points[list(piece)]) for piece in pieces]
    for polygon in polygons:
        assert polygon.exterior.is_ccw
        assert polygon.convex_hull.area == pytest.approx(polygon.area, rel=1e-12)
    return sum(polygon.area for polygon in polygons), shapely.union_all(polygons).area


def test_a_convex_outline_stays_whole():
    assert split_convex(np.array([(0.0, 0.0), (2.0, 0.0), (3.0, 1.0), (0.0, 2.0)])) == [
        (0, 1, 2, 3)
    ]


def test_an_angle_becomes_two_pieces():
    points = np.array([(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)], dtype=float)
    pieces = split_convex(points)
    assert len(pieces) == 2
    assert covered(points, pieces) == pytest.approx((5.0, 5.0), rel=1e-12)


def test_a_voussoir_of_chords_is_cut_along_its_depth():
    ring = af.circular_arch(radius=3.0, thickness=0.5, embrace=90.0, voussoirs=2, chords=4)
    points = drop_straight_vertices(ring.blocks[1].points)
    pieces = split_convex(points)
    assert len(pieces) == 4
    area = ring.blocks[1].area
    assert covered(points, pieces) == pytest.approx((area, area), rel=1e-9)


def test_any_star_is_covered_once():
    """Also with equal radii, whose edges may be straight, and with the deepest notches."""
    rng = np.random.default_rng(1)
    for count in rng.integers(4, 13, 100):
        some = rng.choice([0.2, 0.5, 2.0**-0.5, 1.0], count)
        radii = np.where(rng.random(count) < rng.random(), some, rng.uniform(0.2, 1.0, count))
        angles = 2.0 * np.pi * np.arange(count) / count
        points = drop_straight_vertices(
            radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
        )
        area = shapely.Polygon(points).area
        assert covered(points, split_convex(points)) == pytest.approx((area, area), rel=1e-9)


def test_vertices_on_a_straight_edge_are_left_out():
    points = np.array([(0, 0), (1, 0), (2, 0), (2, 2), (1, 2), (0, 2), (0, 1)], dtype=float)
    assert drop_straight_vertices(points).tolist() == [[0, 0], [2, 0], [2, 2], [0, 2]]


def test_an_outline_that_crosses_itself_is_refused():
    points = np.array([(0, 0), (3, 0), (0, 3), (3, 3)], dtype=float)
    with pytest.raises(af.errors.InvalidStructure, match="crosses itself"):
        split_convex(points)


@pytest.mark.parametrize(
    ("box", "gap", "slop"),
    [
        ((0.0, 0.0, 0.2, 0.2), 8e-5, 2e-5),
        ((0.0, 0.0, 0.2, 0.8), 8e-5, 4e-5),
        ((0.0, 0.0, 0.9, 1.6), 8e-5, 5e-5),
    ],
)
def test_overlaps_are_corrected_from_a_ten_thousandth_of_the_smallest_block_on(box, gap, slop):
    """Its size is the root of its area; gaps up to a millionth of the whole, 80 m, are contacts."""
    structure = floor(box, (10.0, 0.0, 14.0, 3.0))
    found = make_bodies(structure)
    assert structure.size == pytest.approx(80.0, rel=2e-3)
    assert found.contact_gap == pytest.approx(gap, rel=2e-3)
    assert found.slop == pytest.approx(slop, rel=1e-9)


@pytest.mark.parametrize(("side", "gap"), [(0.2, 2e-5), (0.45, 4.5e-5), (0.8, 5e-5), (4.0, 5e-5)])
def test_points_are_in_contact_within_a_ten_thousandth_of_a_small_block(side, gap):
    """Within 0.05 mm of a large one."""
    structure = floor((0.0, 0.0, side, side), floor=(-1.0, 5.0))
    assert make_bodies(structure).contact_gap == pytest.approx(gap, rel=1e-9)


@pytest.mark.parametrize(("turn", "kept"), [(0.95e-7, 4), (1.05e-7, 5)])
def test_a_vertex_is_on_a_straight_edge_up_to_a_ten_millionth(turn, kept):
    """In radians, of edges of any length."""
    points = np.array([(0, 0), (2.0, -turn), (5.0, -turn), (5, 3), (0, 3)], dtype=float)
    points[2, 1] = -turn + 3.0 * np.tan(turn / 2.0)
    points[1, 1] = -2.0 * np.tan(turn / 2.0)
    points[2, 1] = points[1, 1] + 3.0 * np.tan(turn / 2.0)
    assert len(drop_straight_vertices(points)) == kept


def test_a_foot_below_the_ground_is_distinguished_from_round_off():
    """By a millionth of the structure's size, 80 m."""
    structure = floor((0.0, 0.0, 0.5, 2.0))
    assert make_bodies(structure, level=0.95e-6 * structure.size).level > 0.0
    with pytest.raises(af.errors.InvalidInput, match="above the foot"):
        make_bodies(structure, level=1.05e-6 * structure.size)


def test_an_arc_of_up_to_fifteen_degrees_is_one_chord():
    """An arc of thirty degrees has two; 0.1 degrees more need another."""
    for embrace, count in ((45.0, 1), (45.3, 2), (90.0, 2), (90.3, 3)):
        ring = af.circular_arch(radius=3.0, thickness=0.5, embrace=embrace, voussoirs=3)
        assert np.bincount(make_bodies(ring).owner)[1] == count


def test_the_reach_of_a_body_of_several_pieces_is_to_its_farthest_vertex():
    ring = af.circular_arch(radius=3.0, thickness=0.5, embrace=150.0, voussoirs=3)
    block, found = ring.blocks[1], make_bodies(ring).reach[1]
    assert found == pytest.approx(np.hypot(*(block.points - block.centroid).T).max(), rel=1e-12)
