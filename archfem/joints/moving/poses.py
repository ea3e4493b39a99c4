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
import numpy as np

from archfem.arrays import Array
from archfem.joints.moving.frames import sinc, sinc_rate


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
        held: pose where the block does not move (j, 2, 3) [m, m, rad].
    """

    index: Any
    size: Any
    turns: Any
    arm: Array
    shapes: Array
    stretch: Array
    held: Array


@numba.njit(cache=True)
def _first(sides, joint, side):  # type: ignore
    """The first of the coordinates that is not of the frame."""
    return 3 if sides.turns[joint, side] else 0


@numba.njit(cache=True)
def _strained(sides, joint, side, q):  # type: ignore
    """U ξ."""
    x = y = 0.0
    for k in range(_first(sides, joint, side), sides.size[joint, side]):
        own = q[sides.index[joint, side, k]]
        x += sides.shapes[joint, side, 0, k] * own
        y += sides.shapes[joint, side, 1, k] * own
    return x, y


@numba.njit(cache=True)
def _reach(sides, joint, side, q):  # type: ignore
    """R + U ξ."""
    x, y = _strained(sides, joint, side, q)
    return sides.arm[joint, side, 0] + x, sides.arm[joint, side, 1] + y


@numba.njit(cache=True)
def _midway(sides, joint, side, before, after):  # type: ignore
    """Half-way through a step: r + U ξ on the mean, half the turn, and cosine and sine there."""
    turn = sides.index[joint, side, 2]
    (x0, y0), (x1, y1) = _reach(sides, joint, side, before), _reach(sides, joint, side, after)
    half = 0.5 * (after[turn] - before[turn])
    middle = before[turn] + half
    return (0.5 * (x0 + x1), 0.5 * (y0 + y1)), half, (np.cos(middle), np.sin(middle))


@numba.njit(cache=True)
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
    size, index = sides.size[joint, side], sides.index[joint, side]
    if size == 0:
        found[:] = sides.held[joint, side]
        return
    dx, dy = _strained(sides, joint, side, q)
    rx, ry = sides.arm[joint, side, 0], sides.arm[joint, side, 1]
    if sides.turns[joint, side]:
        turn = q[index[2]]
        c, s = np.cos(turn), np.sin(turn)
        less = -2.0 * np.sin(0.5 * turn) ** 2  # cos θ - 1
        found[0] = q[index[0]] + less * rx - s * ry + c * dx - s * dy
        found[1] = q[index[1]] + s * rx + less * ry + s * dx + c * dy
        found[2] = turn
    else:
        found[0], found[1], found[2] = dx, dy, 0.0
    for k in range(_first(sides, joint, side), size):
        found[2] += sides.shapes[joint, side, 2, k] * q[index[k]]


@numba.njit(cache=True)
def pose_gradient(sides, joint, side, before, after, rates):  # type: ignore
    """Find what takes the change of coordinates over a step to that of the pose of a face.

    With both ends the same it is the derivative there.

    Args:
        sides: `Sides`.
        joint: its number.
        side: 0 of the lower block, 1 of the higher.
        before: coordinates at the start (n,).
        after: coordinates at the end (n,).
        rates: filled in its first columns (3, s).
    """
    size = sides.size[joint, side]
    rates[:] = 0.0
    if not sides.turns[joint, side]:
        rates[:, :size] = sides.shapes[joint, side, :, :size]
        return
    (x, y), half, (c, s) = _midway(sides, joint, side, before, after)
    shrunk, mean = sinc(half), np.cos(half)
    rates[0, 0] = rates[1, 1] = rates[2, 2] = 1.0
    rates[0, 2], rates[1, 2] = -shrunk * (s * x + c * y), shrunk * (c * x - s * y)
    for k in range(3, size):
        u, v = sides.shapes[joint, side, 0, k], sides.shapes[joint, side, 1, k]
        rates[0, k], rates[1, k] = mean * (c * u - s * v), mean * (s * u + c * v)
        rates[2, k] = sides.shapes[joint, side, 2, k]


@numba.njit(cache=True)
def pose_bend(sides, joint, side, before, after, force, rates):  # type: ignore
    """Find the derivative of generalised forces on a face by the coordinates at the end.

    Args:
        sides: `Sides`.
        joint: its number.
        side: 0 of the lower block, 1 of the higher.
        before: coordinates at the start (n,).
        after: coordinates at the end (n,).
        force: on the pose, which is held (3,) [N, N, N m].
        rates: filled in its first rows and columns (s, s).
    """
    size = sides.size[joint, side]
    rates[:] = 0.0
    if not sides.turns[joint, side]:
        return
    (x, y), half, (c, s) = _midway(sides, joint, side, before, after)
    shrunk, mean = sinc(half), np.cos(half)
    along = force[0] * (c * x - s * y) + force[1] * (s * x + c * y)  # F·R x
    across = -force[0] * (s * x + c * y) + force[1] * (c * x - s * y)  # F·J R x
    rates[2, 2] = 0.5 * (sinc_rate(half) * across - shrunk * along)
    for k in range(3, size):
        u, v = sides.shapes[joint, side, 0, k], sides.shapes[joint, side, 1, k]
        straight = force[0] * (c * u - s * v) + force[1] * (s * u + c * v)
        turned = -force[0] * (s * u + c * v) + force[1] * (c * u - s * v)
        rates[k, 2] = 0.5 * (mean * turned - np.sin(half) * straight)
        rates[2, k] = 0.5 * shrunk * turned
