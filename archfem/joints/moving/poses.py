"""Where the faces of blocks are that turn as far as they like, compiled.

A block has the displacement (x, y) of its centroid, its angle θ, and where it is elastic shapes ξ
in the frame that turns with it. A face with its middle at r from the centroid then has the pose

    p = (x, y) + R(θ)(r + U ξ) - r,   θ + Θ ξ.

Displacements, never positions: the difference of two large numbers would lose what stiff joints
need. Over a step the discrete derivative takes the change of coordinates to that of the pose
exactly, as in `frames`. A block that has no frame, as a fill, moves its faces by shapes alone, to
which the same formulas apply with θ = 0; and where nodes slide apart on a face it gets longer, by
E ξ.
"""

from typing import Any, NamedTuple

import numba

from archfem.arrays import Array
from archfem.joints.moving.frames import added, both, small_turn


class Sides(NamedTuple):
    """The two faces of all joints, of the lower and of the higher block.

    Attributes:
        index: coordinates that move the face; first those of the block's frame, x, y and θ, where
            it has one (j, 2, s).
        size: how many they are, 0 of a block that does not move (j, 2).
        turns: whether the block has a frame that turns; else its face goes as its shapes alone have
            it, by displacements that are small (j, 2).
        arm: from the centroid to the middle of the face (j, 2, 2) [m].
        shapes: U and Θ, x, y and angle of the face per coordinate, 0 of the frame (j, 2, 3, s).
        stretch: how much longer the face gets per coordinate (j, 2, s); without a last axis to
            speak of, (j, 2, 0), where no face stretches.
        held: pose where the block does not move, 0 where it does (j, 2, 3) [m, m, rad].
    """

    index: Any
    size: Any
    turns: Any
    arm: Array
    shapes: Array
    stretch: Array
    held: Array


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _shaped(shapes, index, span, q):  # type: ignore
    """U ξ and Θ ξ of a face."""
    x = y = turn = 0.0
    for k in range(span[0], span[1]):
        own = q[index[k]]
        x += shapes[0, k] * own
        y += shapes[1, k] * own
        turn += shapes[2, k] * own
    return x, y, turn


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _turned(arm, shift, half):  # type: ignore
    """R r - r + R u, of cosine and sine of half the angle; and cosine and sine of the angle."""
    (rx, ry), (dx, dy), (ch, sh) = arm, shift, half
    less, s = -2.0 * sh * sh, 2.0 * sh * ch  # cos θ - 1, sin θ
    c = 1.0 + less
    x, y = less * rx - s * ry + c * dx - s * dy, s * rx + less * ry + s * dx + c * dy
    return (x, y), (c, s)


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def stretched(sides, joint, q):  # type: ignore
    """Return by how much the higher face of a joint has become longer than the lower [m].

    Args:
        sides: `Sides`.
        joint: its number.
        q: coordinates (n,).
    """
    total = 0.0
    if sides.stretch.shape[2] == 0:
        return total
    for side, sign in ((0, -1.0), (1, 1.0)):
        for k in range(sides.size[joint, side]):
            total += sign * sides.stretch[joint, side, k] * q[sides.index[joint, side, k]]
    return total


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def pose(sides, joint, side, q, found):  # type: ignore
    """Find the pose of a face.

    Args:
        sides: `Sides`.
        joint: its number.
        side: 0 of the lower block, 1 of the higher.
        q: coordinates (n,).
        found: filled (3,) [m, m, rad].
    """
    index, shapes = sides.index[joint, side], sides.shapes[joint, side]
    size = sides.size[joint, side]
    if not sides.turns[joint, side]:
        dx, dy, turn = _shaped(shapes, index, (0, size), q)
        found[0] = sides.held[joint, side, 0] + dx
        found[1] = sides.held[joint, side, 1] + dy
        found[2] = sides.held[joint, side, 2] + turn
        return
    dx, dy, turn = _shaped(shapes, index, (3, size), q)
    arm = sides.arm[joint, side, 0], sides.arm[joint, side, 1]
    (x, y), _ = _turned(arm, (dx, dy), both(0.5 * q[index[2]]))
    found[0], found[1], found[2] = q[index[0]] + x, q[index[1]] + y, q[index[2]] + turn


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def swing(sides, joint, side, before, after, poses, moves):  # type: ignore
    """Find the poses of a face at both ends of a step, and their derivatives.

    Args:
        sides: `Sides`.
        joint: its number.
        side: 0 of the lower block, 1 of the higher.
        before: coordinates at the start (n,).
        after: coordinates at the end (n,).
        poses: at the start and at the end, of both sides, filled for this one (2, 2, 3).
        moves: what takes the change of coordinates over the step to that of the pose, and the
            derivative at the end, filled for this side in the first columns (2, 2, 3, s).

    Returns:
        What `swing_bend` needs to know of the step, of a block that turns.
    """
    index, shapes = sides.index[joint, side], sides.shapes[joint, side]
    size = sides.size[joint, side]
    rx, ry = sides.arm[joint, side, 0], sides.arm[joint, side, 1]
    if not sides.turns[joint, side]:
        pose(sides, joint, side, before, poses[0, side])
        pose(sides, joint, side, after, poses[1, side])
        for k in range(size):
            for row in range(3):
                moves[0, side, row, k] = moves[1, side, row, k] = shapes[row, k]
        return (1.0, 0.0), (rx, ry), (1.0, 0.0, 1.0, 0.0)
    x, y, turn = index[0], index[1], index[2]
    half = 0.5 * (after[turn] - before[turn])
    mean, shrunk, falls = small_turn(half)
    start = both(0.5 * before[turn])
    u0, v0, tilt = _shaped(shapes, index, (3, size), before)
    (dx, dy), (c, s) = _turned((rx, ry), (u0, v0), start)
    poses[0, side, 0], poses[0, side, 1] = before[x] + dx, before[y] + dy
    poses[0, side, 2] = before[turn] + tilt
    u1, v1, tilt = _shaped(shapes, index, (3, size), after)
    end = added(start[0], start[1], mean, half * shrunk)
    (dx, dy), last = _turned((rx, ry), (u1, v1), end)
    poses[1, side, 0], poses[1, side, 1] = after[x] + dx, after[y] + dy
    poses[1, side, 2] = after[turn] + tilt
    _turning(shapes, size, (last, 1.0, 1.0), (rx + u1, ry + v1), moves[1, side])
    middle = added(c, s, mean, half * shrunk)
    reach = rx + 0.5 * (u0 + u1), ry + 0.5 * (v0 + v1)
    _turning(shapes, size, (middle, mean, shrunk), reach, moves[0, side])
    return middle, reach, (mean, half * shrunk, shrunk, falls)


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _turning(shapes, size, turn, reach, moves):  # type: ignore
    """Write down a derivative of a pose by the frame and by the shapes."""
    ((c, s), mean, shrunk), (x, y) = turn, reach
    moves[0, 0], moves[0, 1], moves[0, 2] = 1.0, 0.0, -shrunk * (s * x + c * y)
    moves[1, 0], moves[1, 1], moves[1, 2] = 0.0, 1.0, shrunk * (c * x - s * y)
    moves[2, 0], moves[2, 1], moves[2, 2] = 0.0, 0.0, 1.0
    for k in range(3, size):
        u, v = shapes[0, k], shapes[1, k]
        moves[0, k], moves[1, k] = mean * (c * u - s * v), mean * (s * u + c * v)
        moves[2, k] = shapes[2, k]


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def swing_bend(sides, joint, side, step, force, rates):  # type: ignore
    """Add the derivative of generalised forces on a face by the coordinates at the end.

    Args:
        sides: `Sides`.
        joint: its number.
        side: 0 of the lower block, 1 of the higher, of one that turns.
        step: as `swing` returned it.
        force: on the poses of both faces, which is held (2, 3) [N, N, N m].
        rates: of all joints, added to (j, 2, s, 2, s).
    """
    (c, s), (x, y), (mean, sine, shrunk, falls) = step
    fx, fy = force[side, 0], force[side, 1]
    along = fx * (c * x - s * y) + fy * (s * x + c * y)  # F·R x
    across = -fx * (s * x + c * y) + fy * (c * x - s * y)  # F·J R x
    rates[joint, side, 2, side, 2] += 0.5 * (falls * across - shrunk * along)
    for k in range(3, sides.size[joint, side]):
        u, v = sides.shapes[joint, side, 0, k], sides.shapes[joint, side, 1, k]
        straight = fx * (c * u - s * v) + fy * (s * u + c * v)
        turned = -fx * (s * u + c * v) + fy * (c * u - s * v)
        rates[joint, side, k, side, 2] += 0.5 * (mean * turned - sine * straight)
        rates[joint, side, 2, side, k] += 0.5 * shrunk * turned
