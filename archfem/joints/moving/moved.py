"""Joints of blocks that move as far as they like, over a step, compiled.

The mean forces of a step, what joints remember at its end, and the derivative by the coordinates
there: faces' poses by `poses`, measures by `frames`, the law by `overlap`. At an instant, that is
over a step that goes nowhere, forces are those of statics and twice the derivative is the tangent.
"""

from typing import Any, NamedTuple

import numba
import numpy as np

from archfem.arrays import Array
from archfem.joints.moving.frames import bend, discrete, gradient, measures
from archfem.joints.moving.overlap import Faces, lap, press_faces, stored
from archfem.joints.moving.poses import Sides, pose, pose_bend, pose_gradient, stretched
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


@numba.njit(cache=True)
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
        longer = stretched(joints.sides, joint, q)
        length = lap(faces, joint, found[1])[0]
        phi = stored(faces, joint, length, found[0], found[2])[0]
        total += faces.normal[joint] * length * phi
        for point in range(faces.first[joint], faces.first[joint + 1]):
            elastic = found[1] + faces.place[point] * longer - slid[point]
            total += 0.5 * faces.shear[point] * elastic**2
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
    sides, size = joints.sides, found.force.shape[2]
    poses, ends = np.empty((2, 2, 3)), np.empty((2, 4))
    rates, now, curved = np.empty((3, 6)), np.empty((3, 6)), np.empty((6, 6))
    own, last = np.empty((2, 3, size)), np.empty((2, 3, size))
    turned, force, rate = np.empty((size, size)), np.empty(4), np.empty((4, 4))
    pushed = np.empty(6)
    normals = np.empty((len(slid), 4))
    found.resultants[:] = 0.0
    for joint in range(len(joints.angle)):
        for side in range(2):
            pose(sides, joint, side, before, poses[0, side])
            pose(sides, joint, side, after, poses[1, side])
            pose_gradient(sides, joint, side, before, after, own[side])
            pose_gradient(sides, joint, side, after, after, last[side])
        angle = joints.angle[joint]
        for end in range(2):
            measures(poses[end, 0], poses[end, 1], angle, ends[end])
        ends[0, 3], ends[1, 3] = stretched(sides, joint, before), stretched(sides, joint, after)
        discrete(poses[0], poses[1], angle, rates)
        gradient(poses[1], angle, now)
        lagging = press_faces(joints.faces, joint, ends, late, force, rate, normals)
        limit_faces(joints.faces, joint, ends, late, normals)
        shear, rubbing = rub_faces(
            joints.faces, joint, ends, late, normals, slid, (force, rate, found.slid)
        )
        found.lost[joint] = lagging + rubbing
        _sum_up(joints, joint, force, shear, found.resultants)
        bend(poses[0], poses[1], angle, force, curved)
        _between(rates, rate, now, curved)
        _pushed(rates, force, pushed)
        for side in range(2):
            pushing = pushed[3 * side : 3 * side + 3]
            _pushed(own[side], pushing, found.force[joint, side])
            pose_bend(sides, joint, side, before, after, pushing, turned)
            for other in range(2):
                block = found.rate[joint, side, :, other, :]
                block[:] = 0.0
                if other == side:
                    block[:] = turned
                part = curved[3 * side : 3 * side + 3, 3 * other : 3 * other + 3]
                _between(own[side], part, last[other], block)
        if sides.stretch.shape[2] > 0:
            _stretch(sides, joint, (force, rate), (rates, now), (own, last), found)


@numba.njit(cache=True)
def _sum_up(joints, joint, force, shear, resultants):  # type: ignore
    """Add a joint's, or a piece's, forces to N, V, M of the whole."""
    whole, hand = joints.whole[joint], joints.hand[joint]
    resultants[whole, 0] -= force[0]
    resultants[whole, 1] += hand * shear
    resultants[whole, 2] += hand * force[2] - joints.aside[joint] * force[0]


@numba.njit(cache=True)
def _stretch(sides, joint, law, frame, poses, found):  # type: ignore
    """Add what the stretch of the faces does: its force, and how all forces change with it."""
    (force, rate), (rates, now), (own, last) = law, frame, poses
    size = own.shape[2]
    by_after, by_first = np.zeros((2, size)), np.zeros((2, size))
    for side in range(2):
        for pose_part in range(3):
            column = 3 * side + pose_part
            by_now = rate[3, 0] * now[0, column] + rate[3, 1] * now[1, column]
            by_now += rate[3, 2] * now[2, column]
            for k in range(sides.size[joint, side]):
                by_after[side, k] += by_now * last[side, pose_part, k]
                by_first[side, k] += rates[1, column] * rate[1, 3] * own[side, pose_part, k]
    for side, sign in ((0, -1.0), (1, 1.0)):
        for k in range(sides.size[joint, side]):
            pulled = sign * sides.stretch[joint, side, k]
            found.force[joint, side, k] += force[3] * pulled
            for other, against in ((0, -1.0), (1, 1.0)):
                for m in range(sides.size[joint, other]):
                    longer = against * sides.stretch[joint, other, m]
                    found.rate[joint, side, k, other, m] += (
                        pulled * (by_after[other, m] + rate[3, 3] * longer)
                        + by_first[side, k] * longer
                    )


@numba.njit(cache=True)
def _pushed(rates, force, found):  # type: ignore
    """Ratesᵀ force, filled."""
    for column in range(len(found)):
        found[column] = 0.0
        for row in range(3):
            found[column] += rates[row, column] * force[row]


@numba.njit(cache=True)
def _between(left, middle, right, found):  # type: ignore
    """Leftᵀ middle right, added."""
    for column in range(left.shape[1]):
        for k in range(3):
            value = 0.0
            for row in range(3):
                value += left[row, column] * middle[row, k]
            if value != 0.0:
                for other in range(right.shape[1]):
                    found[column, other] += value * right[k, other]
