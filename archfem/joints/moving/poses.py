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

from archfem.arrays import Array
from archfem.joints.moving.compiled import computing, inlined
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


@inlined
def _shaped(sides, joint, side, q):  # type: ignore
    """U ξ and Θ ξ of a face."""
    x = y = turn = 0.0
    for k in range(3 if sides.turns[joint, side] else 0, sides.size[joint, side]):
        own = q[sides.index[joint, side, k]]
        x += sides.shapes[joint, side, 0, k] * own
        y += sides.shapes[joint, side, 1, k] * own
        turn += sides.shapes[joint, side, 2, k] * own
    return x, y, turn


@inlined
def _turned(arm, shift, half):  # type: ignore
    """R r - r + R u, of cosine and sine of half the angle; and cosine and sine of the angle."""
    (rx, ry), (dx, dy), (ch, sh) = arm, shift, half
    less, s = -2.0 * sh * sh, 2.0 * sh * ch  # cos θ - 1, sin θ
    c = 1.0 + less
    x, y = less * rx - s * ry + c * dx - s * dy, s * rx + less * ry + s * dx + c * dy
    return (x, y), (c, s)


@inlined
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


@inlined
def _straight(sides, joint, side, q):  # type: ignore
    """Pose of a face of a block without a frame."""
    dx, dy, turn = _shaped(sides, joint, side, q)
    held = sides.held
    return held[joint, side, 0] + dx, held[joint, side, 1] + dy, held[joint, side, 2] + turn


@computing
def pose(sides, joint, side, q):  # type: ignore
    """Return the pose of a face [m, m, rad].

    Args:
        sides: `Sides`.
        joint: its number.
        side: 0 of the lower block, 1 of the higher.
        q: coordinates (n,).
    """
    if not sides.turns[joint, side]:
        return _straight(sides, joint, side, q)
    index, (dx, dy, turn) = sides.index, _shaped(sides, joint, side, q)
    arm, angle = (sides.arm[joint, side, 0], sides.arm[joint, side, 1]), q[index[joint, side, 2]]
    (x, y), _ = _turned(arm, (dx, dy), both(0.5 * angle))
    return q[index[joint, side, 0]] + x, q[index[joint, side, 1]] + y, angle + turn


@inlined
def swing(sides, joint, side, before, after):  # type: ignore
    """Return the poses of a face at both ends of a step, and how the block turns.

    Args:
        sides: `Sides`.
        joint: its number.
        side: 0 of the lower block, 1 of the higher.
        before: coordinates at the start (n,).
        after: coordinates at the end (n,).

    Returns:
        Pose at the start and at the end [m, m, rad]; what `swing_bend` needs to know of the step;
        and for its mean and its end cosine and sine of the angle, a factor of the shapes, and how
        the middle goes with the angle.
    """
    rx, ry = sides.arm[joint, side, 0], sides.arm[joint, side, 1]
    if not sides.turns[joint, side]:
        start, last = (
            _straight(sides, joint, side, before),
            _straight(sides, joint, side, after),
        )
        still = (1.0, 0.0), 1.0, (0.0, 0.0)
        return (start, last), ((1.0, 0.0), (rx, ry), (1.0, 0.0, 1.0, 0.0)), (still, still)
    index = sides.index
    x, y, turn = index[joint, side, 0], index[joint, side, 1], index[joint, side, 2]
    half = 0.5 * (after[turn] - before[turn])
    mean, shrunk, falls = small_turn(half)
    begin = both(0.5 * before[turn])
    u0, v0, tilt = _shaped(sides, joint, side, before)
    (dx, dy), (c, s) = _turned((rx, ry), (u0, v0), begin)
    start = before[x] + dx, before[y] + dy, before[turn] + tilt
    u1, v1, tilt = _shaped(sides, joint, side, after)
    end = added(begin[0], begin[1], mean, half * shrunk)
    (dx, dy), (c1, s1) = _turned((rx, ry), (u1, v1), end)
    last = after[x] + dx, after[y] + dy, after[turn] + tilt
    c, s = added(c, s, mean, half * shrunk)
    px, py = rx + 0.5 * (u0 + u1), ry + 0.5 * (v0 + v1)
    bx, by = rx + u1, ry + v1
    arm = -shrunk * (s * px + c * py), shrunk * (c * px - s * py)
    now = (c1, s1), 1.0, (-(s1 * bx + c1 * by), c1 * bx - s1 * by)
    step = (c, s), (px, py), (mean, half * shrunk, shrunk, falls)
    return (start, last), step, (((c, s), mean, arm), now)


@inlined
def shape(sides, joint, side, k, way):  # type: ignore
    """Return how a face goes with one of its shapes: x, y and angle.

    Args:
        sides: `Sides`.
        joint: its number.
        side: 0 of the lower block, 1 of the higher.
        k: number of the coordinate among the face's.
        way: of the mean of a step or its end, as `swing` returned it.
    """
    (c, s), factor, _ = way
    u, v = sides.shapes[joint, side, 0, k], sides.shapes[joint, side, 1, k]
    turn = sides.shapes[joint, side, 2, k]
    return factor * (c * u - s * v), factor * (s * u + c * v), turn


@inlined
def gather(sides, joint, side, way, push, found):  # type: ignore
    """Write down the generalised forces of a force on a face.

    Args:
        sides: `Sides`.
        joint: its number.
        side: 0 of the lower block, 1 of the higher.
        way: of the mean of the step, as `swing` returned it.
        push: on the pose [N, N, N m].
        found: filled for this face in its first places (…, s).
    """
    (fx, fy, ft), first = push, 0
    if sides.turns[joint, side]:
        first = 3
        found[0], found[1] = fx, fy
        found[2] = way[2][0] * fx + way[2][1] * fy + ft
    for k in range(first, sides.size[joint, side]):
        x, y, turn = shape(sides, joint, side, k, way)
        found[k] = x * fx + y * fy + turn * ft


@inlined
def swing_bend(sides, joint, side, step, push, rates):  # type: ignore
    """Add the derivative of generalised forces on a face by the coordinates at the end.

    Args:
        sides: `Sides`.
        joint: its number.
        side: 0 of the lower block, 1 of the higher, of one that turns.
        step: as `swing` returned it.
        push: on the pose, which is held [N, N, N m].
        rates: of all joints, added to (j, 2, s, 2, s).
    """
    (c, s), (x, y), (mean, sine, shrunk, falls) = step
    fx, fy = push[0], push[1]
    along = fx * (c * x - s * y) + fy * (s * x + c * y)  # F·R x
    across = -fx * (s * x + c * y) + fy * (c * x - s * y)  # F·J R x
    rates[joint, side, 2, side, 2] += 0.5 * (falls * across - shrunk * along)
    for k in range(3, sides.size[joint, side]):
        u, v = sides.shapes[joint, side, 0, k], sides.shapes[joint, side, 1, k]
        straight = fx * (c * u - s * v) + fy * (s * u + c * v)
        turned = -fx * (s * u + c * v) + fy * (c * u - s * v)
        rates[joint, side, k, side, 2] += 0.5 * (mean * turned - sine * straight)
        rates[joint, side, 2, side, k] += 0.5 * shrunk * turned
