"""Joints of blocks that move as far as they like, over a step, compiled.

The mean forces of a step, what joints remember at its end, and the derivative by the coordinates
there: faces' poses by `poses`, measures by `frames`, the law by `overlap`. At an instant, that is
over a step that goes nowhere, forces are those of statics and twice the derivative is the tangent.
"""

from typing import Any, NamedTuple

import numba
import numpy as np

from archfem.arrays import Array
from archfem.joints.moving.frames import bend, follow, measures
from archfem.joints.moving.overlap import Faces, lap, press_faces, stored
from archfem.joints.moving.poses import Sides, pose, stretched, swing, swing_bend
from archfem.joints.moving.rubbing import limit_faces, rub_faces


class Moved(NamedTuple):
    """Joints between blocks that move.

    Attributes:
        sides: faces of the blocks.
        faces: what the law needs.
        angle: direction of the normals before anything moved (j,) [rad].
        hand: 1 where the extrados is on the left of the normal, -1 where it is on the right: slip,
            turn, V and M are told as positive toward the extrados (j,).
        whole: which joint of the structure each is; where faces bend one is in pieces, as the nodes
            of its mesh divide it (j,).
        aside: how far its middle lies from that of the whole, toward the extrados (j,) [m].
        wholes: number of joints of the structure.
    """

    sides: Sides
    faces: Faces
    angle: Array
    hand: Array
    whole: Any
    aside: Array
    wholes: int


class Answer(NamedTuple):
    """What joints do over a step, filled by `pass_joints`.

    Attributes:
        force: mean generalised forces of each joint, of the lower block's coordinates and of the
            higher's (j, 2, s).
        rate: derivative by the coordinates at the end (j, 2, s, 2, s).
        resultants: mean N, V, M of the joints of the structure (n_joints, 3) [N, N, N m].
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
    count, size = len(joints.angle), joints.sides.shapes.shape[-1]
    return Answer(
        np.zeros((count, 2, size)),
        np.zeros((count, 2, size, 2, size)),
        np.zeros((joints.wholes, 3)),
        np.zeros(len(joints.faces.place)),
        np.zeros(count),
    )


@numba.njit(cache=True, error_model="numpy", forceinline=True)
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


@numba.njit(cache=True, error_model="numpy")
def all_measures(joints, q):  # type: ignore
    """Return opening, slip and turn of the joints of the structure (n_joints, 3) [m, m, -].

    Slip and turn with their signs. Of a joint in pieces, the plane nearest to the openings, and the
    mean slip, as `faces.face_matrix` has them.

    Args:
        joints: `Moved`.
        q: coordinates (n,).
    """
    found, own, depths = np.zeros((joints.wholes, 3)), np.empty(3), joints.faces.depth
    sums = np.zeros((joints.wholes, 4))  # Σd, Σd a, Σd a² with the pieces' own, Σd a g with theirs
    for joint in range(len(joints.angle)):
        find_measures(joints, joint, q, own)
        whole, depth, place = joints.whole[joint], depths[joint], joints.aside[joint]
        spread = 0.25 * depth**3
        found[whole, 0] += depth * own[0]
        found[whole, 1] += depth * joints.hand[joint] * own[1]
        sums[whole, 0] += depth
        sums[whole, 1] += depth * place
        sums[whole, 2] += depth * place**2 + spread
        sums[whole, 3] += depth * place * own[0] - spread * joints.hand[joint] * own[2]
    for whole in range(joints.wholes):
        total, first, second, tilted = sums[whole]
        middle = first / total
        turn = middle * found[whole, 0] - tilted
        turn /= second - middle * first
        found[whole, 0] = found[whole, 0] / total + turn * middle
        found[whole, 1] /= total
        found[whole, 2] = turn
    return found


@numba.njit(cache=True, error_model="numpy")
def paired_slips(joints, q):  # type: ignore
    """Return how far pieces have slid whose places stay opposite, over their length (j,) [-].

    Args:
        joints: `Moved`.
        q: coordinates (n,).
    """
    found, own, faces = np.zeros(len(joints.angle)), np.empty(3), joints.faces
    for joint in range(len(found)):
        if faces.paired[joint]:
            find_measures(joints, joint, q, own)
            found[joint] = abs(own[1]) / faces.depth[joint]
    return found


@numba.njit(cache=True, error_model="numpy")
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
        longer = stretched(joints.sides, joint, q)
        length = lap(faces, joint, found[1])[0]
        phi = stored(faces, joint, length, found[0], found[2])[0]
        total += faces.normal[joint] * length * phi
        for point in range(faces.first[joint], faces.first[joint + 1]):
            elastic = found[1] + faces.place[point] * longer - slid[point]
            total += 0.5 * faces.shear[point] * elastic**2
    return total


@numba.njit(cache=True, error_model="numpy")
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
    sides, size = joints.sides, found.force.shape[2]
    poses, moves, ends = np.empty((2, 2, 3)), np.empty((2, 2, 3, size)), np.empty((2, 4))
    by_faces, curved, pushed = np.empty((2, 3, 4)), np.empty((4, 4)), np.empty((2, 3))
    force, rate, normals = np.empty(4), np.empty((4, 4)), np.empty((len(slid), 4))
    stretches = sides.stretch.shape[2] > 0
    longer = np.empty((2, 2, size if stretches else 0))
    found.resultants[:] = 0.0
    for joint in range(len(joints.angle)):
        swings = (
            swing(sides, joint, 0, before, after, poses, moves),
            swing(sides, joint, 1, before, after, poses, moves),
        )
        step = follow(poses[0], poses[1], joints.angle[joint], ends, by_faces[0], by_faces[1])
        ends[0, 3], ends[1, 3] = stretched(sides, joint, before), stretched(sides, joint, after)
        lagging = press_faces(joints.faces, joint, ends, late, force, rate, normals)
        limit_faces(joints.faces, joint, ends, late, normals)
        shear, rubbing = rub_faces(
            joints.faces, joint, ends, late, normals, slid, (force, rate, found.slid)
        )
        found.lost[joint] = lagging + rubbing
        whole, hand = joints.whole[joint], joints.hand[joint]
        found.resultants[whole, 0] -= force[0]
        found.resultants[whole, 1] += hand * shear
        found.resultants[whole, 2] += hand * force[2] - joints.aside[joint] * force[0]
        _between(by_faces, rate, curved)
        bend(step, force, curved)
        for side in range(2):
            _push(by_faces, force, side, pushed)
            count = sides.size[joint, side]
            _gather(joint, side, count, moves, pushed, found.force)
            for other in range(2):
                counts = count, sides.size[joint, other]
                _spread((joint, side, other), counts, moves, curved, found.rate)
            if sides.turns[joint, side]:
                swing_bend(sides, joint, side, swings[side], pushed, found.rate)
        if stretches:
            _stretch(sides, joint, (force, rate), by_faces, moves, longer, found)


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _between(by_faces, rate, found):  # type: ignore
    """Dᵀ rate B, of all that faces can do to the joint (4, 4)."""
    for column in range(4):
        for row in range(4):
            found[row, column] = 0.0
        for k in range(3):
            value = 0.0
            for j in range(3):
                value += rate[k, j] * by_faces[1, j, column]
            for row in range(4):
                found[row, column] += by_faces[0, k, row] * value


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _push(by_faces, force, side, found):  # type: ignore
    """Forces on the pose of a face."""
    sign, turn = 2.0 * side - 1.0, 0.0
    for row in range(3):
        turn += by_faces[0, row, 2 + side] * force[row]
    found[side, 0] = sign * (by_faces[0, 0, 0] * force[0] + by_faces[0, 1, 0] * force[1])
    found[side, 1] = sign * (by_faces[0, 0, 1] * force[0] + by_faces[0, 1, 1] * force[1])
    found[side, 2] = turn


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _gather(joint, side, count, moves, pushed, found):  # type: ignore
    """Forces on the coordinates of a block."""
    x, y, turn = pushed[side, 0], pushed[side, 1], pushed[side, 2]
    for k in range(count):
        value = moves[0, side, 0, k] * x + moves[0, side, 1, k] * y
        found[joint, side, k] = value + moves[0, side, 2, k] * turn


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _spread(where, counts, moves, curved, found):  # type: ignore
    """Derivative of the forces on a block by the coordinates of one."""
    joint, side, other = where
    toward, against, row, last = 2.0 * side - 1.0, 2.0 * other - 1.0, 2 + side, 2 + other
    for column in range(counts[1]):
        a, b = against * moves[1, other, 0, column], against * moves[1, other, 1, column]
        c = moves[1, other, 2, column]
        x = toward * (curved[0, 0] * a + curved[0, 1] * b + curved[0, last] * c)
        y = toward * (curved[1, 0] * a + curved[1, 1] * b + curved[1, last] * c)
        turn = curved[row, 0] * a + curved[row, 1] * b + curved[row, last] * c
        for k in range(counts[0]):
            value = moves[0, side, 0, k] * x + moves[0, side, 1, k] * y
            found[joint, side, k, other, column] = value + moves[0, side, 2, k] * turn


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _stretch(sides, joint, law, by_faces, moves, longer, found):  # type: ignore
    """Add what the stretch of the faces does: its force, and how all forces change with it."""
    force, rate = law
    for side, sign in ((0, -1.0), (1, 1.0)):  # of the stretch by all, of all by the stretch
        for k in range(sides.size[joint, side]):
            longer[0, side, k] = longer[1, side, k] = 0.0
            for end in range(2):
                x, y, turn = moves[end, side, 0, k], moves[end, side, 1, k], moves[end, side, 2, k]
                for row in range(3):
                    value = sign * (by_faces[end, row, 0] * x + by_faces[end, row, 1] * y)
                    value += by_faces[end, row, 2 + side] * turn
                    factor = rate[3, row] if end else rate[row, 3]
                    longer[1 - end, side, k] += factor * value
    for side, sign in ((0, -1.0), (1, 1.0)):
        for k in range(sides.size[joint, side]):
            pulled = sign * sides.stretch[joint, side, k]
            found.force[joint, side, k] += force[3] * pulled
            for other, against in ((0, -1.0), (1, 1.0)):
                for m in range(sides.size[joint, other]):
                    more = against * sides.stretch[joint, other, m]
                    value = pulled * (longer[0, other, m] + rate[3, 3] * more)
                    found.rate[joint, side, k, other, m] += value + longer[1, side, k] * more
