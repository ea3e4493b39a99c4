"""Marks of joints: where they are, and that they go with the blocks."""

import numpy as np
import pytest
from pictures import SLIDING, WEIGHT, resultants

import archfem as af
from archfem.view import joint_marks as marks_of
from archfem.view.joint_marks import joint_marks


def test_arrows_show_the_direction_of_slip(ring, joints):
    """V > 0: the higher block, on the side of the normal, moves toward the extrados."""
    arrows = joint_marks(ring, joints).slips.reshape(-1, 2, 7, 2)
    for number, pair in zip(SLIDING, arrows, strict=True):
        joint, normal = ring.joints[number], ring.normals[number]
        tip, tail = pair[0, 3], pair[0, [0, 6]].mean(axis=0)
        assert (pair[0].mean(axis=0) - joint.middle) @ normal > 0.0
        assert np.sign((tip - tail) @ joint.tangent) == np.sign(SLIDING[number])
        assert pair.mean(axis=(0, 1)) == pytest.approx(joint.middle)


def test_only_joints_of_rings_and_piers_are_marked(bridge):
    """All joints hinge, or slide, or are open: those of soil and sidewalls show nothing."""
    judged = np.array([joint.role != "other" for joint in bridge.joints])
    assert 0 < judged.sum() < len(judged)
    depth = np.array([joint.depth for joint in bridge.joints])
    rows = np.zeros((len(depth), 3))
    rows[:, 0], rows[:, 1], rows[:, 2] = WEIGHT, WEIGHT, 0.48 * WEIGHT * depth
    marks = joint_marks(bridge, af.joints.joint_dataset(bridge, rows))
    assert marks.hinges == pytest.approx(
        np.array([joint.extrados for joint, own in zip(bridge.joints, judged, strict=True) if own])
    )
    assert len(marks.slips) == 2 * judged.sum()
    assert np.isfinite(marks.thrust[:, 0]).tolist() == judged.tolist()
    apart = af.joints.joint_dataset(bridge, 0.0 * rows)
    assert len(joint_marks(bridge, apart).gaps) == judged.sum()


def test_a_thrust_line_runs_through_each_ring_and_pier(bridge):
    """One link a voussoir and a course between beds; none through soil or skewbacks."""
    rows = np.tile([WEIGHT, 0.0, 0.0], (len(bridge.joints), 1))
    links = joint_marks(bridge, af.joints.joint_dataset(bridge, rows)).links
    assert len(links) == 14 + 17 + 15 + 2 * 4
    assert np.linalg.norm(links[:, 1] - links[:, 0], axis=1).max() < 0.7  # a stone is that long


def test_marks_follow_the_blocks(ring):
    """A rigid body displacement of all blocks carries every mark along."""
    still = af.joints.joint_dataset(ring, resultants(ring))
    shift = np.tile([0.3, -0.2], (len(ring.joints), 2, 1))
    rest, moved = joint_marks(ring, still), joint_marks(ring, still, shift=shift)
    for name in ("thrust", "links", "hinges", "slips", "gaps"):
        expected = getattr(rest, name) + np.array([0.3, -0.2])
        assert getattr(moved, name) == pytest.approx(expected, nan_ok=True)


def test_ends_of_joints_move_as_the_mean_of_their_blocks(ring):
    """Translated free blocks: an inner joint goes all the way, a springing half of it."""
    model = af.build(ring, fidelity="rigid")
    q = np.tile([0.01, 0.02, 0.0], len(ring.free))
    moved = model.observer().joint_ends(q)
    assert moved[1:-1] == pytest.approx(np.broadcast_to([0.01, 0.02], (16, 2, 2)))
    assert moved[[0, -1]] == pytest.approx(np.broadcast_to([0.005, 0.01], (2, 2, 2)))


def test_joints_go_with_supports_that_have_moved(ring):
    """All of the ring 5 cm to the left, supports too: so are the joints' ends."""
    moved = af.build(ring, fidelity="rigid")
    for block in (0, 18):
        moved = moved.settled(af.Settlement(block, (-0.05, 0.0, 0.0)))
    dead = af.dead_load(moved)
    ends = moved.observer().joint_ends(dead.q)
    np.testing.assert_allclose(ends[..., 0], -0.05, atol=5e-4)  # the dead load moves by 0.3 mm


def test_no_thrust_line_runs_along_the_ground():
    """Two posts on one ground and a lintel: a link through each of the five stones."""

    def box(left, low, right, high, name, **given):
        corners = ((left, low), (right, low), (right, high), (left, high))
        return af.Block(corners, af.STONE, name, **given)

    posts = [
        box(x, y, x + 0.5, y + 1.0, f"{side} {y:g}", part=f"{side} pier", role="pier")
        for x, side in ((0.0, "left"), (2.5, "right"))
        for y in (0.0, 1.0)
    ]
    ground = box(-1.0, -0.5, 4.0, 0.0, "ground", fixed=True, role="other")
    lintel = box(-0.2, 2.0, 3.2, 2.5, "lintel", part="lintel", role="ring")
    portal = af.masonry.assembled([ground, *posts, lintel], af.Contact(1e9, 4e8, friction=0.6))
    assert [joint.role != "other" for joint in portal.joints] == 6 * [True]
    rows = np.tile([WEIGHT, 0.0, 0.0], (6, 1))
    links = joint_marks(portal, af.joints.joint_dataset(portal, rows)).links
    assert len(links) == 5
    assert (np.abs(np.diff(links[..., 1])) > 0.5).sum() == 4  # the lintel's alone is level


@pytest.mark.parametrize(
    ("displacement", "by"),
    [
        *((0.0, 1.0), (0.5, 1.0), (0.041, 1.0), (0.039, 2.0)),
        # between two steps the nearer by their ratio
        *((0.06 / 3.1, 2.0), (0.06 / 3.2, 5.0), (0.06 / 7.0, 5.0), (0.06 / 7.1, 10.0)),
        *((0.06 / 2e6, 2e6), (0.06 / 5e11, 5e11), (1e-30, 5e11)),
    ],
)
def test_a_magnification_shows_a_displacement_as_a_twentieth_of_the_structure(displacement, by):
    """The round number by which it comes nearest to 6 % of the size; 1 from 4 % on."""
    assert marks_of.round_magnification(displacement) == by


def test_a_mechanism_is_drawn_as_large_and_only_where_it_moves(column):
    """The two upper stones turn about a corner; the lower ones move by less than can be seen."""
    structure = column.structure
    motion = np.zeros((4, 3))
    motion[2] = motion[3] = [0.0, 0.0, 3.0]
    scaled = marks_of.scale_motion(structure, motion)
    outlines = marks_of.outline_moving_blocks(structure, scaled)
    assert len(outlines) == 2
    moved = [
        np.abs(o - b.drawn()).max() for o, b in zip(outlines, structure.blocks[2:], strict=True)
    ]
    corner = np.hypot(0.2, 0.4) * np.abs(scaled[2, 2])  # half of 0.4 m and of 0.8 m
    assert corner == pytest.approx(0.06 * structure.size, rel=0.01)
    assert 0.8 * corner < max(moved) < corner
    for share, count in ((0.9e-4, 0), (1.05e-4, 1)):
        motion = np.zeros((4, 3))
        motion[1, 0] = share * structure.size
        assert len(marks_of.outline_moving_blocks(structure, motion)) == count
