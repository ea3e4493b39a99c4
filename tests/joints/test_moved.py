"""Joints that move as far as they like, over a step: exact increments, energies, derivatives."""

import numpy as np
import pytest
from kernels import either
from repeats import each_once

import archfem as af
from archfem.joints.contact_law import NO_LIMIT, ContactLaw
from archfem.joints.large import face_kinematics
from archfem.joints.large.face_kinematics import FaceKinematics
from archfem.joints.large.forces import (
    LargeDisplacementJoints,
    allocate_step_forces,
    compute_step_forces,
    joint_energy,
)
from archfem.joints.large.overlap_law import FaceLaw
from archfem.joints.large.point_law import CONTACT_RECORD
from archfem.joints.large.rates import assemble_rates, find_rate_blocks

joint_measures = either(face_kinematics.joint_measures)
step_measures = either(face_kinematics.step_measures)
face_forces = either(face_kinematics.face_forces)
rotation_series = either(face_kinematics.rotation_series)
cosine_sine = either(face_kinematics.cosine_sine)
face_pose = either(face_kinematics.face_pose)
gather_face_forces = either(face_kinematics.gather_face_forces)
step_poses = either(face_kinematics.step_poses)

SEEDS = range(12)

KINDS = [(0, False), (3, False), (3, True)]
"""Shapes of the blocks, and whether block 1 is a fill."""


def random_poses(seed):
    rng = np.random.default_rng(seed)
    before = rng.normal(size=(2, 3))
    return before, before + rng.normal(size=(2, 3)) * 10.0 ** rng.uniform(-6, 0), rng.uniform(-3, 3)


def measured(poses, angle):
    return np.array(joint_measures(tuple(poses[0]), tuple(poses[1]), angle))


@pytest.mark.usefixtures("each_way")
@pytest.mark.parametrize("seed", SEEDS)
def test_the_discrete_derivative_gives_the_change_of_the_measures(seed):
    """D Δp = Δ(g, s, σ), to rounding."""
    before, after, angle = random_poses(seed)
    lower, higher = (tuple(map(tuple, each)) for each in np.stack([before, after], axis=1))
    start, end, rates, *_ = step_measures(lower, higher, angle)
    for found, poses in ((start, before), (end, after)):
        assert found == pytest.approx(measured(poses, angle), abs=2e-15)
    low, high = after - before
    moved = np.array([*(high - low)[:2], low[2], high[2]])
    for row, change in zip(np.eye(3), np.subtract(end, start), strict=True):
        assert abs(face_forces(rates, tuple(row)) @ moved - change) < 4e-15


@pytest.mark.usefixtures("each_way")
@pytest.mark.parametrize("x", [0.0, 1e-9, 1e-3, 0.2499, -0.2499, 0.3, 2.0])
def test_series_of_small_turns(x):
    """Against NumPy, and the derivative of sin x / x against differences of it."""
    assert rotation_series(x)[:2] == pytest.approx((np.cos(x), np.sinc(x / np.pi)), abs=2e-16)
    assert cosine_sine(x) == pytest.approx((np.cos(x), np.sin(x)), abs=2e-16)
    there, back = (rotation_series(x + d)[1] for d in (1e-4, -1e-4))
    assert rotation_series(x)[2] == pytest.approx((there - back) / 2e-4, abs=1e-9)


@pytest.mark.usefixtures("each_way")
def test_turning_about_a_place_where_the_faces_touch_is_no_slip():
    """Whatever the angle; the gap at an arm a is -a σ less that at the place."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        angle, turn, arm = rng.uniform(-3, 3), rng.uniform(-2, 2), rng.uniform(-0.5, 0.5)
        along = np.array([-np.sin(angle), np.cos(angle)])
        spin = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        moved = arm * along - spin @ (arm * along)
        found = measured(np.array([[0.0, 0.0, 0.0], [*moved, turn]]), angle)
        assert abs(found[1]) < 1e-15
        assert found[0] - arm * found[2] == pytest.approx(0.0, abs=1e-15)


def two_joints(shapes, friction, facets, rng, fill=False):
    """Block 0 on block 1 on the ground, with modes or without; block 1 may be a fill, no stone."""
    count, size = 4, 3 + shapes
    moves, stretch = np.zeros((2, 2, 3, size)), np.zeros((2, 2, size))
    moves[..., 3:] = 0.1 * rng.normal(size=(2, 2, 3, shapes))
    stretch[..., 3:] = 0.1 * rng.normal(size=(2, 2, shapes))
    if fill:
        for joint, side in ((0, 1), (1, 0)):
            moves[joint, side, :, :3] = rng.normal(size=(3, 3))
            stretch[joint, side, :3] = 0.1 * rng.normal(size=3)
    index = np.array([[0, size], [size, 0]])[..., None] + np.arange(size)
    sizes = np.array([[size, size], [size, 0]])
    sides = FaceKinematics(
        index,
        sizes,
        np.array([[True, not fill], [not fill, False]]),
        rng.normal(size=(2, 2, 2)),
        moves,
        stretch if shapes else stretch[..., :0],
        np.zeros((2, 2, 3)),
        find_rate_blocks(index, sizes)[0],
    )
    edges = np.linspace(-0.5, 0.5, count + 1)
    if facets:
        place = np.tile(np.column_stack([edges[:-1], edges[1:]]).ravel(), 2)
    else:
        place = np.tile(0.5 * (edges[:-1] + edges[1:]), 2)
    points = len(place) // 2
    laws = [af.Contact(1e6, 1e6, friction), af.Contact(2e6, 1e6, friction, cohesion=2e3)]
    records = np.array([ContactLaw.of(law) for law in laws], CONTACT_RECORD)
    # faces that extend beyond their joints by about as far as they slide, but for one end
    longer = np.array([[-0.08, 0.05], [0.0, 0.1]])
    faces = FaceLaw(
        np.array([1.0, 0.8]),
        1.0,
        records,
        np.array([0, points, 2 * points]),
        place,
        np.full(2 * points, 1.0 / count),
        np.repeat([3e4, 2e4], points) / points,
        facets,
        np.array([False, shapes > 0]),
        longer,
    )
    whole = np.arange(2)
    angles, built = rng.uniform(-3, 3, 2), 0.03 * rng.normal(size=(2, 4))
    return LargeDisplacementJoints(sides, faces, angles, np.ones(2), whole, np.zeros(2), 2, built)


def gathered(joints, before, after, late, slid):
    """Force (n,), its derivative (n, n), and all that joints do."""
    found, size = allocate_step_forces(joints), len(before)
    compute_step_forces(joints, before, after, late, slid, found)
    force, rate = np.zeros(size), np.zeros((size, size))
    index, sizes = joints.kinematics.index, joints.kinematics.size
    for joint in range(2):
        for side in range(2):
            own = index[joint, side, : sizes[joint, side]]
            force[own] += found.force[joint, side, : len(own)]
    np.add.at(rate, tuple(find_rate_blocks(index, sizes)[1]), assembled(joints, found))
    return force, rate, found


def assembled(joints, found):
    """Derivatives at the places of all blocks (e,)."""
    sides = joints.kinematics
    rates = np.zeros(find_rate_blocks(sides.index, sides.size)[1].shape[1])
    places, workspace = np.arange(len(rates)), np.empty((2, 3, 5, sides.shapes.shape[3]))
    assemble_rates(sides, found.rates, workspace, places.astype(np.uint32), rates)
    return rates


@pytest.mark.parametrize("facets", [True, False])
@pytest.mark.parametrize("friction", [0.5, np.inf])
@pytest.mark.parametrize(("shapes", "fill"), KINDS)
def test_work_is_the_change_of_energy_and_a_loss_that_is_never_negative(
    shapes, fill, friction, facets
):
    """However far blocks move in a step, with damping by a lag and without."""
    rng = np.random.default_rng(shapes)
    for trial in range(40):
        joints = two_joints(shapes, friction, facets, rng, fill)
        size = 2 * (3 + shapes)
        before = 0.05 * rng.normal(size=size)
        after = before + rng.normal(size=size) * 10.0 ** rng.uniform(-4, -0.5)
        slid = 0.01 * rng.normal(size=len(joints.face_law.place))
        force, _, found = gathered(joints, before, after, 0.3 * (trial % 2), slid)
        stored = [
            joint_energy(joints, *each)
            for each in ((before, slid), (after, found.irreversible_slip))
        ]
        scale = max(*stored, np.abs(force * (after - before)).sum())
        work = force @ (after - before)
        assert abs(work - stored[1] + stored[0] - found.dissipation.sum()) < 1e-13 * scale
        assert found.dissipation.min() > -1e-14 * scale


@pytest.mark.parametrize("facets", [True, False])
@pytest.mark.parametrize(("kind", "friction"), each_once(KINDS, (0.5, np.inf)))
def test_the_derivative_is_that_of_the_force(kind, friction, facets):
    """By central differences, but where the law bends between them: in three of four states."""
    (shapes, fill), rng, errors = kind, np.random.default_rng(3), []
    for trial in range(20):
        joints = two_joints(shapes, friction, facets, rng, fill)
        size = 2 * (3 + shapes)
        before = 0.05 * rng.normal(size=size)
        after = before + rng.normal(size=size) * 10.0 ** rng.uniform(-3, -1)
        slid = 0.01 * rng.normal(size=len(joints.face_law.place))
        late = 0.3 * (trial % 2)
        rate = gathered(joints, before, after, late, slid)[1]
        steps = 1e-7 * np.eye(size)
        there, back = (
            np.array([gathered(joints, before, after + w * s, late, slid)[0] for s in steps])
            for w in (1.0, -1.0)
        )
        errors.append(np.abs((there - back).T / 2e-7 - rate).max() / 1e6)
    assert np.quantile(errors, 0.75) < 1e-7


@pytest.mark.usefixtures("each_way")
@pytest.mark.parametrize("turns", [True, False])
@pytest.mark.parametrize("seed", SEEDS)
def test_the_pose_follows_its_discrete_derivative(seed, turns):
    """P Δq = Δp, of a block with modes that turns by radians, and of one without a frame."""
    rng = np.random.default_rng(seed)
    sides = two_joints(3, 0.5, True, rng, fill=not turns).kinematics
    before, after = rng.normal(size=(2, 12))
    ends, _, (mean, _) = step_poses(sides, 0, 1, before, after)
    for found, q in zip(ends, (before, after), strict=True):
        assert found == pytest.approx(face_pose(sides, 0, 1, q), abs=4e-15)
    moves = np.zeros((3, 6))
    for way, row in zip(np.eye(3), moves, strict=True):
        gather_face_forces(sides, 0, 1, mean, tuple(way), row)
    change = np.subtract(ends[1], ends[0])
    assert np.abs(moves @ (after - before)[6:] - change).max() < 1e-14


@pytest.mark.parametrize("facets", [True, False])
@pytest.mark.parametrize(("shapes", "fill"), KINDS)
def test_a_slip_that_reversed_holds_as_a_joint_that_never_slid(shapes, fill, facets):
    """Force and what it lacks, and the rate, are then those of joints that never slide."""
    rng = np.random.default_rng(shapes + 7)
    joints, size = two_joints(shapes, 0.002, facets, rng, fill), 2 * (3 + shapes)
    # all points are pressed: what nothing presses slides freely, and cannot be held
    joints = joints._replace(initial_measures=joints.initial_measures - np.array([0.5, 0, 0, 0]))
    held = joints.face_law.contacts.copy()
    held["friction"], held["resistance"] = 0.0, NO_LIMIT
    still = joints._replace(face_law=joints.face_law._replace(contacts=held))
    before = 0.05 * rng.normal(size=size)
    after = before + 0.01 * rng.normal(size=size)
    slid = 0.01 * rng.normal(size=len(joints.face_law.place))
    sliding, holding, late = allocate_step_forces(joints), allocate_step_forces(joints), 0.3
    compute_step_forces(joints, before, after, late, slid, sliding)
    slides, force, lost = (
        sliding.slip_direction != 0.0,
        sliding.force.copy(),
        sliding.dissipation.copy(),
    )
    assert slides.any()
    assert not sliding.reverses.any()
    sliding.slip_direction[:] = -sliding.slip_direction
    compute_step_forces(joints, before, after, late, slid, sliding)
    compute_step_forces(still, before, after, late, slid, holding)
    assert np.array_equal(sliding.force, force)
    assert np.array_equal(sliding.dissipation, lost)
    assert not sliding.slip_direction[slides].any()
    scale = abs(holding.force).max()
    assert sliding.force + sliding.missing_force == pytest.approx(holding.force, abs=1e-12 * scale)
    rates = assembled(joints, holding)
    assert assembled(joints, sliding) == pytest.approx(rates, abs=1e-12 * abs(rates).max())
