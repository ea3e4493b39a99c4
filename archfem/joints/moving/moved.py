"""Joints of blocks that move as far as they like, over a step, compiled.

The mean forces of a step, what joints remember at its end, and the derivative by the coordinates
there: faces' poses by `poses`, measures by `frames`, the law by `overlap`. At an instant, that is
over a step that goes nowhere, forces are those of statics and twice the derivative is the tangent.
"""

from typing import NamedTuple

import numba
import numpy as np

from archfem.arrays import Array
from archfem.joints.moving.frames import bend, follow, measures
from archfem.joints.moving.overlap import (
    Faces,
    overlap,
    press_faces,
    rub_faces,
    stored,
)
from archfem.joints.moving.poses import Sides, pose, swing, swing_bend


class Moved(NamedTuple):
    """Joints between blocks that move.

    Attributes:
        sides: faces of the blocks.
        faces: what the law needs.
        angle: direction of the normals before anything moved (j,) [rad].
        hand: 1 where the extrados is on the left of the normal, -1 where it is on the right: slip,
            turn, V and M are told as positive toward the extrados (j,).
    """

    sides: Sides
    faces: Faces
    angle: Array
    hand: Array


class Answer(NamedTuple):
    """What joints do over a step, filled by `pass_joints`.

    Attributes:
        force: mean generalised forces of each joint, of the lower block's coordinates and of the
            higher's (j, 2, s).
        rate: derivative by the coordinates at the end (j, 2, s, 2, s).
        resultants: mean N, V, M (j, 3) [N, N, N m].
        slid: how far each point has slid for good at the end (p,) [m].
        lost: energy that friction and the lag take (j,) [J].
    """

    force: Array
    rate: Array
    resultants: Array
    slid: Array
    lost: Array


def answer(joints: Moved) -> Answer:
    """Return room for what joints do.

    Args:
        joints: of which.
    """
    count, size = len(joints.angle), 3 + joints.sides.shapes.shape[-1]
    return Answer(
        np.zeros((count, 2, size)),
        np.zeros((count, 2, size, 2, size)),
        np.zeros((count, 3)),
        np.zeros(len(joints.faces.place)),
        np.zeros(count),
    )


@numba.njit(cache=True)
def find_measures(joints, joint, q, found):  # type: ignore
    """Find opening, slip and turn of a joint, positive to the left of its normal.

    Args:
        joints: `Moved`.
        joint: its number.
        q: coordinates (n,).
        found: filled (3,) [m, m, -].
    """
    poses = np.empty((2, 3))
    for side in range(2):
        pose(joints.sides, joint, side, q, poses[side])
    measures(poses[0], poses[1], joints.angle[joint], found)


@numba.njit(cache=True)
def all_measures(joints, q):  # type: ignore
    """Return opening, slip and turn of all joints, with their signs (j, 3) [m, m, -].

    Args:
        joints: `Moved`.
        q: coordinates (n,).
    """
    found = np.empty((len(joints.angle), 3))
    for joint in range(len(found)):
        find_measures(joints, joint, q, found[joint])
        found[joint, 1] *= joints.hand[joint]
        found[joint, 2] *= joints.hand[joint]
    return found


@numba.njit(cache=True)
def joint_energy(joints, q, slid):  # type: ignore
    """Return the energy stored in all joints [J].

    Args:
        joints: `Moved`.
        q: coordinates (n,).
        slid: how far each point has slid for good (p,) [m].
    """
    found, total, faces = np.empty(3), 0.0, joints.faces
    for joint in range(len(joints.angle)):
        find_measures(joints, joint, q, found)
        length = overlap(faces.depth[joint], found[1])[0]
        phi = stored(faces, joint, length, found[0], found[2])[0]
        total += faces.normal[joint] * length * phi
        for point in range(faces.first[joint], faces.first[joint + 1]):
            total += 0.5 * faces.shear[point] * (found[1] - slid[point]) ** 2
    return total


@numba.njit(cache=True)
def pass_joints(joints, before, after, late, slid, found):  # type: ignore
    """Find what joints do over a step.

    Args:
        joints: `Moved`.
        before: coordinates at the start (n,).
        after: coordinates at the end (n,).
        late: lag of damping over the length of the step [-].
        slid: how far each point has slid for good before (p,) [m].
        found: `Answer`, filled.
    """
    sides, faces, size = joints.sides, joints.faces, found.force.shape[2]
    remembered, still = found.slid, ((1.0, 0.0), (0.0, 0.0), (1.0,) * 4)
    poses, moves, ends = np.empty((2, 2, 3)), np.zeros((2, 2, 3, size)), np.empty((2, 3))
    by_faces = np.empty((2, 3, 4))
    force, rate, normals = np.empty(3), np.empty((3, 3)), np.empty((len(slid), 4))
    pushed, curved = np.empty((2, 3)), np.empty((4, 4))
    for joint in range(len(joints.angle)):
        swings = still, still
        if sides.start[joint, 0] >= 0:
            swings = swing(sides, joint, 0, before, after, poses, moves), still
        else:
            poses[:, 0] = sides.held[joint, 0]
        if sides.start[joint, 1] >= 0:
            swings = swings[0], swing(sides, joint, 1, before, after, poses, moves)
        else:
            poses[:, 1] = sides.held[joint, 1]
        step = follow(poses[0], poses[1], joints.angle[joint], ends, by_faces[0], by_faces[1])
        lagging = press_faces(faces, joint, ends, late, force, rate, normals)
        shear, rubbing = rub_faces(faces, joint, ends, late, normals, slid, force, rate, remembered)
        found.resultants[joint, 0] = -force[0]
        found.resultants[joint, 1] = joints.hand[joint] * shear
        found.resultants[joint, 2] = joints.hand[joint] * force[2]
        found.lost[joint] = lagging + rubbing
        _between(by_faces, rate, curved)
        bend(step, force, curved)
        for side in range(2):
            _push(by_faces[0], force, side, pushed[side])
            _gather(sides, joint, side, moves[0], pushed[side], found.force)
            for other in range(2):
                _spread(sides, (joint, side, other), moves, curved, found.rate)
            if sides.start[joint, side] >= 0:
                swing_bend(sides, joint, side, swings[side], pushed[side], found.rate)


@numba.njit(cache=True)
def _between(by_faces, rate, found):  # type: ignore
    """Dᵀ rate B, of all faces can do to the joint (4, 4)."""
    for column in range(4):
        for row in range(4):
            found[row, column] = 0.0
        for k in range(3):
            value = 0.0
            for j in range(3):
                value += rate[k, j] * by_faces[1, j, column]
            for row in range(4):
                found[row, column] += by_faces[0, k, row] * value


@numba.njit(cache=True)
def _push(by_faces, force, side, found):  # type: ignore
    """Forces on the pose of a face (3,)."""
    sign = 2.0 * side - 1.0
    found[0] = sign * (by_faces[0, 0] * force[0] + by_faces[1, 0] * force[1])
    found[1] = sign * (by_faces[0, 1] * force[0] + by_faces[1, 1] * force[1])
    found[2] = 0.0
    for row in range(3):
        found[2] += by_faces[row, 2 + side] * force[row]


@numba.njit(cache=True)
def _gather(sides, joint, side, moves, pushed, found):  # type: ignore
    """Forces on the coordinates of a block."""
    if sides.start[joint, side] < 0:
        return
    found[joint, side, 0], found[joint, side, 1] = pushed[0], pushed[1]
    x, y = moves[side, 0, 2] * pushed[0], moves[side, 1, 2] * pushed[1]
    found[joint, side, 2] = x + y + pushed[2]
    for k in range(3, sides.size[joint, side]):
        value = 0.0
        for row in range(3):
            value += moves[side, row, k] * pushed[row]
        found[joint, side, k] = value


@numba.njit(cache=True)
def _spread(sides, where, moves, curved, found):  # type: ignore
    """Derivative of the forces on a block by the coordinates of one."""
    joint, side, other = where
    sign = 1.0 if side == other else -1.0
    toward, against = 2.0 * side - 1.0, 2.0 * other - 1.0
    for column in range(sides.size[joint, other]):
        if column < 2:
            x, y = sign * curved[0, column], sign * curved[1, column]
            turn = against * curved[2 + side, column]
        else:
            a, b = against * moves[1, other, 0, column], against * moves[1, other, 1, column]
            c = 1.0 if column == 2 else moves[1, other, 2, column]
            last = 2 + other
            x = toward * (curved[0, 0] * a + curved[0, 1] * b + curved[0, last] * c)
            y = toward * (curved[1, 0] * a + curved[1, 1] * b + curved[1, last] * c)
            row = 2 + side
            turn = curved[row, 0] * a + curved[row, 1] * b + curved[row, last] * c
        for k in range(sides.size[joint, side]):
            if k < 2:
                value = y if k else x
            else:
                by_turn = 1.0 if k == 2 else moves[0, side, 2, k]
                value = moves[0, side, 0, k] * x + moves[0, side, 1, k] * y + by_turn * turn
            found[joint, side, k, other, column] = value
