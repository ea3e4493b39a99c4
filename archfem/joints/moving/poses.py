"""Where the faces of blocks are that turn as far as they like, compiled.

A block has the displacement (x, y) of its centroid, its angle θ, and where it is elastic shapes ξ
in the frame that turns with it. A face with its middle at r from the centroid then has the pose

    p = (x, y) + R(θ)(r + U ξ) - r,   θ + Θ ξ.

Displacements, never positions: the difference of two large numbers would lose what stiff joints
need. Over a step the discrete derivative takes the change of coordinates to that of the pose
exactly, as in `frames`.
"""

from typing import Any, NamedTuple

import numba
import numpy as np

from archfem.arrays import Array
from archfem.joints.moving.frames import small_turn


class Sides(NamedTuple):
    """The two faces of all joints, of the lower and of the higher block.

    Attributes:
        start: first coordinate of the block, -1 of one that does not move (j, 2).
        size: number of its coordinates, 0 of one that does not move (j, 2).
        arm: from the centroid to the middle of the face (j, 2, 2) [m].
        shapes: U and Θ, x, y and angle of the face per shape (j, 2, 3, s).
        held: pose where the block does not move (j, 2, 3) [m, m, rad].
    """

    start: Any
    size: Any
    arm: Array
    shapes: Array
    held: Array


@numba.njit(cache=True)
def _reach(sides, joint, side, q):  # type: ignore
    """R + U ξ."""
    x, y = sides.arm[joint, side, 0], sides.arm[joint, side, 1]
    start = sides.start[joint, side] + 3
    for k in range(sides.size[joint, side] - 3):
        x += sides.shapes[joint, side, 0, k] * q[start + k]
        y += sides.shapes[joint, side, 1, k] * q[start + k]
    return x, y


@numba.njit(cache=True)
def pose(sides, joint, side, q, found):  # type: ignore
    """Find the pose of a face.

    Args:
        sides: `Sides`.
        joint: its number.
        side: 0 of the lower block, 1 of the higher.
        q: coordinates (n,).
        found: filled (3,) [m, m, rad].
    """
    start = sides.start[joint, side]
    if start < 0:
        found[:] = sides.held[joint, side]
        return
    half = 0.5 * q[start + 2]
    _place(sides, joint, side, q, (np.cos(half), np.sin(half)), found)


@numba.njit(cache=True)
def swing(sides, joint, side, before, after, poses, rates):  # type: ignore
    """Find the poses of a face at both ends of a step, and their derivatives.

    Args:
        sides: `Sides`.
        joint: its number.
        side: 0 of the lower block, 1 of the higher, of one that moves.
        before: coordinates at the start (n,).
        after: coordinates at the end (n,).
        poses: at the start and at the end, of both sides, filled for this one (2, 2, 3).
        rates: what takes the change of coordinates over the step to that of the pose, and the
            derivative at the end, filled for this side (2, 2, 3, s).

    Returns:
        What `swing_bend` needs to know of the step.
    """
    start = sides.start[joint, side]
    half = 0.5 * (after[start + 2] - before[start + 2])
    mean, shrunk, falls = small_turn(half)
    ch, sh = np.cos(0.5 * before[start + 2]), np.sin(0.5 * before[start + 2])
    c, s, x0, y0 = _place(sides, joint, side, before, (ch, sh), poses[0, side])
    ch, sh = ch * mean - sh * half * shrunk, sh * mean + ch * half * shrunk
    c1, s1, x1, y1 = _place(sides, joint, side, after, (ch, sh), poses[1, side])
    _turning(sides, joint, side, (c1, s1, 1.0, 1.0), (x1, y1), rates[1, side])
    middle, reach = (c * mean - s * half * shrunk, s * mean + c * half * shrunk), (x0 + x1, y0 + y1)
    reach = 0.5 * reach[0], 0.5 * reach[1]
    _turning(sides, joint, side, (middle[0], middle[1], mean, shrunk), reach, rates[0, side])
    return middle, reach, (mean, half * shrunk, shrunk, falls)


@numba.njit(cache=True)
def _place(sides, joint, side, q, half, found):  # type: ignore
    """Find a pose from cosine and sine of half the turn; cosine, sine and reach are returned."""
    start = sides.start[joint, side]
    less, s = -2.0 * half[1] * half[1], 2.0 * half[1] * half[0]  # cos θ - 1, sin θ
    c, (x, y) = 1.0 + less, _reach(sides, joint, side, q)
    rx, ry = sides.arm[joint, side, 0], sides.arm[joint, side, 1]
    dx, dy = x - rx, y - ry
    found[0] = q[start] + less * rx - s * ry + c * dx - s * dy
    found[1] = q[start + 1] + s * rx + less * ry + s * dx + c * dy
    found[2] = q[start + 2]
    for k in range(sides.size[joint, side] - 3):
        found[2] += sides.shapes[joint, side, 2, k] * q[start + 3 + k]
    return c, s, x, y


@numba.njit(cache=True)
def _turning(sides, joint, side, turn, reach, rates):  # type: ignore
    """Write down a derivative of a pose by the turn and by the shapes."""
    (c, s, mean, shrunk), (x, y) = turn, reach
    rates[0, 2], rates[1, 2] = -shrunk * (s * x + c * y), shrunk * (c * x - s * y)
    for k in range(sides.size[joint, side] - 3):
        u, v = sides.shapes[joint, side, 0, k], sides.shapes[joint, side, 1, k]
        rates[0, 3 + k], rates[1, 3 + k] = mean * (c * u - s * v), mean * (s * u + c * v)
        rates[2, 3 + k] = sides.shapes[joint, side, 2, k]


@numba.njit(cache=True)
def swing_bend(sides, joint, side, step, force, rates):  # type: ignore
    """Add the derivative of generalised forces on a face by the coordinates at the end.

    Args:
        sides: `Sides`.
        joint: its number.
        side: 0 of the lower block, 1 of the higher, of one that moves.
        step: as `swing` returned it.
        force: on the pose, which is held (3,) [N, N, N m].
        rates: of all joints, added to (j, 2, s, 2, s).
    """
    (c, s), (x, y), (mean, sine, shrunk, falls) = step
    fx, fy = force[0], force[1]
    along = fx * (c * x - s * y) + fy * (s * x + c * y)  # F·R x
    across = -fx * (s * x + c * y) + fy * (c * x - s * y)  # F·J R x
    rates[joint, side, 2, side, 2] += 0.5 * (falls * across - shrunk * along)
    for k in range(sides.size[joint, side] - 3):
        u, v = sides.shapes[joint, side, 0, k], sides.shapes[joint, side, 1, k]
        straight = fx * (c * u - s * v) + fy * (s * u + c * v)
        turned = -fx * (s * u + c * v) + fy * (c * u - s * v)
        rates[joint, side, 3 + k, side, 2] += 0.5 * (mean * turned - sine * straight)
        rates[joint, side, 2, side, 3 + k] += 0.5 * shrunk * turned
