"""Where ends of joints and loose blocks are, against plain geometry of rigid blocks."""

import numpy as np
import pytest
from bonded import bonded_wall
from matplotlib.backends.backend_agg import FigureCanvasAgg
from mechanisms import twitching

import archfem as af
from archfem.masonry.structure import join_joint_names
from archfem.view.joint_marks import joint_marks
from archfem.view.positions import FallingBlocks, decisive_instant, mechanism_instant, rotate


def placed(structure, number, points, pose):
    """Points of a block that has moved by a pose about its centroid."""
    centre = structure.blocks[number].centroid
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return centre + pose[:2] + (points - centre) @ np.array([[c, s], [-s, c]])


def test_ends_of_a_joint_lie_between_the_faces_wherever_they_are(column):
    """Two stones turned by the same angle as one, and the second shifted along their joint."""
    structure, angle, slip = column.structure, 0.7, 0.1
    joint = structure.joints[1]
    pivot = np.array(structure.blocks[1].centroid)
    q = np.zeros(column.size)
    along = rotate(np.array(joint.tangent), angle) * slip
    for number, shift in ((1, np.zeros(2)), (2, along)):
        centre = np.array(structure.blocks[number].centroid)
        q[3 * number - 3 : 3 * number - 1] = pivot + rotate(centre - pivot, angle) - centre + shift
        q[3 * number - 1] = angle
    ends = structure.ends + column.observer().joint_ends(q)
    lower, higher = (
        placed(structure, number, structure.ends[1], q[3 * number - 3 : 3 * number])
        for number in (1, 2)
    )
    overlap = np.array([higher[0], lower[1]])  # the higher stone hangs over by the slip
    np.testing.assert_allclose(ends[1], overlap, atol=1e-12)


def test_ends_of_a_hinge_are_those_of_both_faces(column):
    """A stone turned about a corner: there its two faces touch, and so do the ends."""
    structure, angle = column.structure, 0.4
    joint = 2
    corner = structure.ends[joint, 1]
    centre = np.array(structure.blocks[3].centroid)
    q = np.zeros(column.size)
    q[6:8], q[8] = corner + rotate(centre - corner, angle) - centre, angle
    ends = structure.ends + column.observer().joint_ends(q)
    np.testing.assert_allclose(ends[joint, 1], corner, atol=1e-12)
    far = placed(structure, 3, structure.ends[joint, 0], q[6:9])
    np.testing.assert_allclose(ends[joint, 0], 0.5 * (far + structure.ends[joint, 0]), atol=1e-12)


def test_small_motions_move_ends_as_of_small_displacements(column):
    """Ends agree to the square of the motion, 1e-6 of 1e-3."""
    small = af.build(column.structure, fidelity="rigid")
    q = 1e-6 * np.random.default_rng(1).standard_normal(column.size)
    middle, wanted = (model.observer().joint_ends(q).mean(axis=1) for model in (column, small))
    np.testing.assert_allclose(middle, wanted, atol=1e-11)


def test_the_thrust_line_passes_through_the_hinge_of_moved_faces(column, toppled):
    """The last instant before stones are loose, between the ends of the overlap."""
    q = toppled.dataset["last_q"].values
    joints = toppled.joints.isel(time=-1)
    ends = column.structure.ends + column.observer().joint_ends(q)
    marks = joint_marks(column.structure, joints, shift=ends - column.structure.ends)
    share = 0.5 + joints["eccentricity"].values[:, None]
    through = (1.0 - share) * ends[:, 0] + share * ends[:, 1]
    np.testing.assert_allclose(marks.thrust, through, atol=1e-12)
    assert len(marks.hinges) >= 1


def test_poses_of_a_fall_run_straight_between_frames(column, toppled):
    falls = FallingBlocks.of(column.structure, toppled)
    times, poses = falls.times, falls.poses
    assert times[0] == pytest.approx(toppled.time[-1])
    assert (np.diff(times) > 0.0).all()
    middle = 0.5 * (times[3] + times[4])
    np.testing.assert_allclose(falls.pose(middle), 0.5 * (poses[3] + poses[4]), atol=1e-12)
    for time, pose in ((times[0], poses[0]), (times[-1], poses[-1]), (1e9, poses[-1])):
        np.testing.assert_allclose(falls.pose(time), pose, atol=1e-12)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_poses_are_interpolated_and_held_beyond_the_frames(column, count):
    random = np.random.default_rng(3)
    times, poses = 2.0 + random.uniform(0.1, 0.5, count).cumsum(), random.normal(size=(count, 4, 3))
    falls = FallingBlocks(column.structure, times, poses, 0.0)
    for time in np.linspace(times[0] - 0.2, times[-1] + 0.2, 17):
        held = [np.interp(time, times, each) for each in poses.reshape(count, -1).T]
        np.testing.assert_allclose(falls.pose(time).ravel(), held, atol=1e-12)


def test_a_fall_begins_where_the_model_left_off_and_ends_above_ground(column, toppled):
    falls, cells = FallingBlocks.of(column.structure, toppled), column.cells
    before = cells.places + cells.displacement(toppled.dataset["last_q"].values)
    np.testing.assert_allclose(falls.places(cells.places, cells.block, falls.times[0]), before)
    lying = np.concatenate(falls.outlines(falls.times[-1])[1:])
    reach = 1e-2  # stones overlap the ground by so much at most, in metres
    assert lying[:, 1].min() == pytest.approx(falls.level, abs=reach)


def test_outlines_of_a_fall_keep_their_areas(column, toppled):
    falls = FallingBlocks.of(column.structure, toppled)
    for block, outline in zip(
        column.structure.blocks, falls.outlines(falls.times[-1]), strict=True
    ):
        x, y = outline.T
        area = 0.5 * abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
        assert area == pytest.approx(block.area)


def test_a_run_that_held_has_no_fall(column):
    still = af.Motion(np.zeros(51), 0.005)
    run = af.time_history(column, still, dt=0.005)
    assert FallingBlocks.of(column.structure, run) is None
    with pytest.raises(af.InvalidInput, match="no fall to draw"):
        af.view.draw_fall(run)


def test_a_fall_is_drawn_at_four_instants(toppled):
    figure = af.view.draw_fall(toppled)
    times = [float(axes.get_title().split()[2]) for axes in figure.axes]
    assert len(times) == 4
    assert times == sorted(times)
    assert times[0] == pytest.approx(float(toppled.dataset["fall_time"][0]), abs=0.006)
    FigureCanvasAgg(figure).draw()  # equal scales shrink axes of another aspect ratio
    boxes = [axes.get_position() for axes in figure.axes]
    assert sum(box.width * box.height for box in boxes) > 0.7


def test_the_instant_that_decides_is_the_fall_or_else_a_motion(toppled, ring):
    """Hinges at 1 s all at the extrados, where nothing can move; they alternate at 2 s."""
    assert decisive_instant(toppled) == float(toppled.dataset["fall_time"][0])
    resultants = np.tile([1e4, 0.0, 0.0], (4, 18, 1))
    resultants[1, [0, 6, 12, 17], 2] = 0.49e4 * 0.55
    resultants[2, [0, 6, 12, 17], 2] = 0.49e4 * 0.55 * np.array([-1.0, 1.0, -1.0, 1.0])
    dataset = af.joints.joint_dataset(ring, resultants, np.arange(4.0))
    assert decisive_instant(af.History(dataset, ring)) == 2.0
    assert decisive_instant(af.History(dataset)) == 1.0  # by count alone
    assert mechanism_instant(af.History(dataset, ring)) == 2.0
    assert decisive_instant(af.History(dataset.isel(time=[0, 3]), ring)) == 0.0


def test_a_mechanism_too_small_to_matter_does_not_decide():
    structure, joints = twitching("pier 2")
    assert decisive_instant(af.History(joints, structure)) == 3.0


def test_a_wall_shows_the_instant_at_which_it_is_farthest_apart():
    """Four beds slide at rest, which says nothing of the motion; one slips on at 2 s."""
    wall = bonded_wall(3)
    resultants = np.tile([1e4, 0.0, 0.0], (4, len(wall.joints), 1))
    resultants[:, np.flatnonzero(~wall.heads)[::6][:4], 1] = 0.6e4
    dataset = af.joints.joint_dataset(wall, resultants, np.arange(4.0))
    still = dataset["N"] * 0.0
    slip = still.copy()
    slip[:, 3] = -2e-3  # by the dead load
    slip[2, 4] = -1e-3
    dataset = dataset.assign(slip=slip, opening=still)
    assert af.History(dataset, wall).mechanism.time == 0.0  # by count, which says nothing
    assert mechanism_instant(af.History(dataset, wall)) is None  # nor does a page or a film
    assert decisive_instant(af.History(dataset, wall)) == 2.0
    assert decisive_instant(af.History(dataset)) == 2.0
    dataset["opening"][3, 5] = 1.5e-3
    assert decisive_instant(af.History(dataset, wall)) == 3.0


def test_the_joints_of_a_fall_are_those_of_its_picture(toppled):
    structure, time = toppled.structure, decisive_instant(toppled)
    marks = joint_marks(structure, toppled.joints.sel(time=time, method="nearest"))
    drawn = [
        joint.name
        for joint in structure.joints
        if any(np.allclose(end, mark) for end in joint.ends for mark in marks.hinges)
    ]
    assert len(drawn) == len(marks.hinges) > 0 == len(marks.slips) + len(marks.gaps)
    by = f"by hinges ({join_joint_names(drawn)}) at {time:.3f} s, when blocks come loose"
    assert toppled.fall.mechanism == by
    assert f"\nit falls {by}\n" in str(toppled.verdict)


def test_a_joint_that_is_open_at_rest_does_not_decide(ring):
    """The second joint has |e| = 0.49 from the start, the others up to 0.3 at 2 s."""
    resultants = np.tile([1e4, 0.0, 0.0], (4, 18, 1))
    resultants[:, 1, 2] = 0.49e4 * 0.55
    resultants[2, 6, 2] = 0.3e4 * 0.55
    dataset = af.joints.joint_dataset(ring, resultants, np.arange(4.0))
    assert decisive_instant(af.History(dataset, ring)) == 2.0
