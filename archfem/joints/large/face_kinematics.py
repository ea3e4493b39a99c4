"""Poses of block faces, and gap, slip and rotation between them, at large rotations, compiled.

A block has the displacement (x, y) of its centroid and its rotation θ. An elastic block also has
modal coordinates ξ in the frame that rotates with it. A face with its middle at r from the centroid
has the pose

    p = (x, y) + R(θ)(r + U ξ) - r,   θ + Θ ξ.

These are displacements, not positions: the difference of two large numbers would lose the digits
that stiff joints need. A block without a frame, such as fill, moves its faces by shapes alone, to
which the same formulas apply with θ = 0. Where nodes slide apart on a face it gets longer, by E ξ.

The middle of the higher face has the displacement d relative to that of the lower one. The normal n
and the tangent t of the joint are rotated by the mean of both faces' angles; δ is the difference of
the angles. The measures of a joint are

    g = n·d,   s = t·d,   σ = 2 sin(δ/2).

Two places of the faces that touched at a distance a from the middle have the gap g - a σ. All slip
by the same s. For small motions they are those of `operator`; no angle is assumed small.

Over a step the discrete derivative D maps the change of the poses exactly to that of the measures.
Forces Dᵀ f therefore do the work that f does on the measures (Gonzalez, J. Nonlinear Sci. 6 (1996)
449, here in closed form). Both blocks move a joint by one jump, so derivatives have four columns:
by the jump's x and y, and by the angles of the lower and of the higher face. Sines of angles at the
end of a step follow from those at its start by addition theorems. The rotation during the step
takes short series.
"""

from typing import Any, NamedTuple

import numpy as np

from archfem._numba import entry, inlined_kernel
from archfem._typing import Array


@inlined_kernel
def rotation_series(x):  # type: ignore
    """Return cos x, sin x / x and the derivative of the latter."""
    if abs(x) > 0.25:
        c, s = np.cos(x), np.sin(x) / x
        return c, s, (c - s) / x
    return short_series(x)


@inlined_kernel
def short_series(x):  # type: ignore
    """Return `rotation_series` of |x| up to 0.25."""
    # Taylor series; the omitted terms are below 1e-17, in the derivative below 1e-14 of it
    y = x * x
    c = y * (1 / 40320 + y * (-1 / 3628800 + y * (1 / 479001600)))
    c = 1.0 + y * (-1 / 2 + y * (1 / 24 + y * (-1 / 720 + c)))
    s = y * (1 / 362880 + y * (-1 / 39916800))
    s = 1.0 + y * (-1 / 6 + y * (1 / 120 + y * (-1 / 5040 + s)))
    return c, s, x * (-1 / 3 + y * (1 / 30 + y * (-1 / 840 + y * (1 / 45360 - y * (1 / 3991680)))))


@inlined_kernel
def cosine_sine(x):  # type: ignore
    """Return cos x and sin x."""
    c, s, _ = rotation_series(x)
    return c, x * s


@inlined_kernel
def add_angles(c, s, more_c, more_s):  # type: ignore
    """Return cosine and sine of the sum of two angles."""
    return c * more_c - s * more_s, s * more_c + c * more_s


@inlined_kernel
def joint_measures(lower, higher, angle):  # type: ignore
    """Return opening, slip and rotation of a joint [m, m, -]."""
    direction = angle + 0.5 * (lower[2] + higher[2])
    c, s = np.cos(direction), np.sin(direction)
    x, y = higher[0] - lower[0], higher[1] - lower[1]
    return c * x + s * y, c * y - s * x, 2.0 * np.sin(0.5 * (higher[2] - lower[2]))


@inlined_kernel
def step_measures(lower, higher, angle):  # type: ignore
    """Return the measures at both ends of a step, and their derivatives, from poses."""
    ((xa, ya, a0), (xc, yc, a1)), ((xb, yb, b0), (xd, yd, b1)) = lower, higher
    # half the change of the mean angle, and half that of half the difference
    half, quarter = 0.25 * ((a1 - a0) + (b1 - b0)), 0.25 * ((b1 - b0) - (a1 - a0))
    first = angle + 0.5 * (a0 + b0)
    begin = (np.cos(first), np.sin(first)), cosine_sine(0.5 * (b0 - a0))
    turns = (half, rotation_series(half)), (quarter, rotation_series(quarter))
    return measure_step(((xb - xa, yb - ya), (xd - xc, yd - yc)), begin, turns)


@inlined_kernel
def measure_step(jumps, begin, turns):  # type: ignore
    """Return the measures at both ends of a step, and their derivatives.

    The jumps are those at both ends; cosine and sine at the start are of the direction of the
    normal, and of half the difference of both angles; and of both there is half the change, with
    its `rotation_series`. A derivative is stored as c, s, a, b and t: its rows are (c, s, a, a),
    (-s, c, -b, -b) and (0, 0, -t, t).
    """
    ((x0, y0), (x1, y1)), ((c0, s0), (cosine, sine)) = jumps, begin
    (half, (mean, shrunk, shrunk_rate)), (quarter, (near, less, less_rate)) = turns
    # direction of the normal in the middle and at the end of the step
    c, s = add_angles(c0, s0, mean, half * shrunk)
    c1, s1 = add_angles(c, s, mean, half * shrunk)
    start = c0 * x0 + s0 * y0, c0 * y0 - s0 * x0, 2.0 * sine
    # cosine and sine of half the difference of the angles in the middle and at the end
    cosine, sine = add_angles(cosine, sine, near, quarter * less)
    last = add_angles(cosine, sine, near, quarter * less)
    end = c1 * x1 + s1 * y1, c1 * y1 - s1 * x1, 2.0 * last[1]
    # discrete derivative, from the mean jump and the middle direction
    x, y = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
    along, across = 0.5 * shrunk * (c * y - s * x), 0.5 * shrunk * (c * x + s * y)
    rates = mean * c, mean * s, along, across, less * cosine
    # derivative of the measures at the end
    now = c1, s1, 0.5 * end[1], 0.5 * end[0], last[0]
    by_turn = 0.25 * (less_rate * cosine - less * sine)
    return start, end, rates, now, ((c, s), (c1, s1), (x, y), (shrunk, shrunk_rate), by_turn)


@inlined_kernel
def face_forces(rates, force):  # type: ignore
    """Return Dᵀ f: the force on the jump, and the moments on both faces [N, N, N m, N m].

    Derivatives by the measures become those by the jump's x and y and both angles alike.
    """
    c, s, a, b, t = rates
    middle, apart = a * force[0] - b * force[1], t * force[2]
    x, y = c * force[0] - s * force[1], s * force[0] + c * force[1]
    return x, y, middle - apart, middle + apart


@inlined_kernel
def force_derivative(step, rates, now, force, law):  # type: ignore
    """Return the derivative of Dᵀ f by the jump and the angles at the end, row by row."""
    (c, s), (c1, s1), (x, y), (shrunk, shrunk_rate), by_turn = step
    f, g = force[0], force[1]
    # derivative of D at constant f: f_g t - f_s n in the middle of the step
    ax, ay = -f * s - g * c, f * c - g * s
    by_angle = 0.125 * (shrunk_rate * (ax * x + ay * y) + shrunk * (ax * y - ay * x))
    by_turn *= force[2]
    same, other = by_angle + by_turn, by_angle - by_turn
    px, py = -0.25 * (f * s1 + g * c1), 0.25 * (f * c1 - g * s1)
    qx, qy = 0.25 * shrunk * ax, 0.25 * shrunk * ay
    # derivative of f at constant D: the law's, times that of the measures at the end
    first = face_forces(now, law[0])
    second = face_forces(now, law[1])
    third = face_forces(now, law[2])
    c, s, a, b, t = rates
    middle = _combine_rows(a, first, -b, second, (qx, qy, 0.0, 0.0))
    return (
        _combine_rows(c, first, -s, second, (0.0, 0.0, px, px)),
        _combine_rows(s, first, c, second, (0.0, 0.0, py, py)),
        _combine_rows(1.0, middle, -t, third, (0.0, 0.0, same, other)),
        _combine_rows(1.0, middle, t, third, (0.0, 0.0, other, same)),
    )


@inlined_kernel
def _combine_rows(a, first, b, second, third):  # type: ignore
    """Return the sum of three rows, two of them with factors."""
    return (
        a * first[0] + b * second[0] + third[0],
        a * first[1] + b * second[1] + third[1],
        a * first[2] + b * second[2] + third[2],
        a * first[3] + b * second[3] + third[3],
    )


class FaceKinematics(NamedTuple):
    """The two faces of all joint segments, of the lower and of the higher block."""

    # coordinates that move the face; first those of the block's frame, x, y and θ, if any (j, 2, s)
    index: Any
    size: Any  # number of these coordinates, 0 for a fixed block (j, 2)
    # whether the block has a rotating frame; else displacements by its shapes are small (j, 2)
    has_frame: Any
    arm: Array  # from the centroid to the middle of the face (j, 2, 2) [m]
    shapes: Array  # U and Θ: x, y and angle of the face per coordinate, 0 of the frame (j, 2, 3, s)
    # E: elongation of the face per coordinate (j, 2, s), or (j, 2, 0) where no face stretches
    stretch: Array
    fixed_pose: Array  # pose of a face of a fixed block, else 0 (j, 2, 3) [m, m, rad]
    # first place of the derivatives of the forces on one face by the coordinates of another, from
    # `rates.find_rate_blocks` (j, 2, 2)
    block_start: Any


@inlined_kernel
def _shape_motion(sides, joint, side, q):  # type: ignore
    """Return displacement U ξ and rotation Θ ξ of a face due to its block's elastic coordinates."""
    x = y = turn = 0.0
    for k in range(3 if sides.has_frame[joint, side] else 0, sides.size[joint, side]):
        coordinate = q[sides.index[joint, side, k]]
        x += sides.shapes[joint, side, 0, k] * coordinate
        y += sides.shapes[joint, side, 1, k] * coordinate
        turn += sides.shapes[joint, side, 2, k] * coordinate
    return x, y, turn


@inlined_kernel
def _rotate_arm(arm, shift, half):  # type: ignore
    """Return R r - r + R u, and cosine and sine of the angle, from those of half the angle."""
    (rx, ry), (dx, dy), (ch, sh) = arm, shift, half
    less, s = -2.0 * sh * sh, 2.0 * sh * ch  # cos θ - 1, sin θ
    c = 1.0 + less
    x, y = less * rx - s * ry + c * dx - s * dy, s * rx + less * ry + s * dx + c * dy
    return (x, y), (c, s)


@inlined_kernel
def relative_stretch(sides, joint, q):  # type: ignore
    """Return the elongation of the higher face of a joint less that of the lower [m]."""
    total = 0.0
    if sides.stretch.shape[2] == 0:
        return total
    for side, sign in ((0, -1.0), (1, 1.0)):
        for k in range(sides.size[joint, side]):
            total += sign * sides.stretch[joint, side, k] * q[sides.index[joint, side, k]]
    return total


@inlined_kernel
def _frameless_pose(sides, joint, side, q):  # type: ignore
    """Return the pose of a face of a block without a frame."""
    dx, dy, turn = _shape_motion(sides, joint, side, q)
    fixed = sides.fixed_pose
    return fixed[joint, side, 0] + dx, fixed[joint, side, 1] + dy, fixed[joint, side, 2] + turn


# compiled for Python too: films place faces by it
@entry
def face_pose(sides, joint, side, q):  # type: ignore
    """Return the pose of a face [m, m, rad]."""
    if not sides.has_frame[joint, side]:
        return _frameless_pose(sides, joint, side, q)
    index, (dx, dy, turn) = sides.index, _shape_motion(sides, joint, side, q)
    arm, angle = (sides.arm[joint, side, 0], sides.arm[joint, side, 1]), q[index[joint, side, 2]]
    (x, y), _ = _rotate_arm(arm, (dx, dy), cosine_sine(0.5 * angle))
    return q[index[joint, side, 0]] + x, q[index[joint, side, 1]] + y, angle + turn


@inlined_kernel
def step_poses(sides, joint, side, before, after):  # type: ignore
    """Return the poses of a face over a step, the rotation of its block, and pose derivatives.

    Poses are at the start and at the end. A derivative has cosine and sine of the rotation, a
    factor of the shapes, and the derivative of the face's middle by the block's angle. The first
    derivative is that of the mean over the step, the second that at its end.
    """
    rx, ry = sides.arm[joint, side, 0], sides.arm[joint, side, 1]
    if not sides.has_frame[joint, side]:
        poses = (
            _frameless_pose(sides, joint, side, before),
            _frameless_pose(sides, joint, side, after),
        )
        fixed = (1.0, 0.0), 1.0, (0.0, 0.0)
        return poses, ((1.0, 0.0), (rx, ry), (1.0, 0.0, 1.0, 0.0)), (fixed, fixed)
    index = sides.index
    x, y, turn = index[joint, side, 0], index[joint, side, 1], index[joint, side, 2]
    half = 0.5 * (after[turn] - before[turn])
    mean, shrunk, shrunk_rate = rotation_series(half)
    # pose at the start, by the half angle
    begin = cosine_sine(0.5 * before[turn])
    u0, v0, tilt = _shape_motion(sides, joint, side, before)
    (dx, dy), (c, s) = _rotate_arm((rx, ry), (u0, v0), begin)
    start = before[x] + dx, before[y] + dy, before[turn] + tilt
    # pose at the end, its half angle by addition
    u1, v1, tilt = _shape_motion(sides, joint, side, after)
    end = add_angles(begin[0], begin[1], mean, half * shrunk)
    (dx, dy), (c1, s1) = _rotate_arm((rx, ry), (u1, v1), end)
    last = after[x] + dx, after[y] + dy, after[turn] + tilt
    # discrete derivative: rotation in the middle of the step, and the mean arm
    c, s = add_angles(c, s, mean, half * shrunk)
    px, py = rx + 0.5 * (u0 + u1), ry + 0.5 * (v0 + v1)
    by_angle = -shrunk * (s * px + c * py), shrunk * (c * px - s * py)
    # derivative at the end
    bx, by = rx + u1, ry + v1
    now = (c1, s1), 1.0, (-(s1 * bx + c1 * by), c1 * bx - s1 * by)
    rotation = (c, s), (px, py), (mean, half * shrunk, shrunk, shrunk_rate)
    return (start, last), rotation, (((c, s), mean, by_angle), now)


@inlined_kernel
def shape_rates(sides, joint, side, k, rate):  # type: ignore
    """Return the derivative of a pose by one of the shapes: x, y and angle."""
    (c, s), factor, _ = rate
    u, v = sides.shapes[joint, side, 0, k], sides.shapes[joint, side, 1, k]
    turn = sides.shapes[joint, side, 2, k]
    return factor * (c * u - s * v), factor * (s * u + c * v), turn


@inlined_kernel
def gather_face_forces(sides, joint, side, rate, push, forces):  # type: ignore
    """Store the generalised forces of a force and a moment on a face."""
    (fx, fy, ft), first = push, 0
    if sides.has_frame[joint, side]:
        # the frame: force, and moment about the centroid
        first = 3
        forces[0], forces[1] = fx, fy
        forces[2] = rate[2][0] * fx + rate[2][1] * fy + ft
    for k in range(first, sides.size[joint, side]):
        x, y, turn = shape_rates(sides, joint, side, k, rate)
        forces[k] = x * fx + y * fy + turn * ft


@inlined_kernel
def rotation_stiffness(rotation, push):  # type: ignore
    """Return the derivative of generalised forces by the coordinates at a constant force on a face.

    The coordinate k has the shapes u and v, and a to e are the five numbers returned. The moment
    changes with the block's angle by a, and with k by d u + e v. The force on k changes with the
    angle by b u + c v.
    """
    (c, s), (x, y), (mean, sine, shrunk, shrunk_rate) = rotation
    # the force in the block's frame
    along, across = push[0] * c + push[1] * s, push[1] * c - push[0] * s
    turned, straight = across * x - along * y, along * x + across * y
    return (
        0.5 * (shrunk_rate * turned - shrunk * straight),
        0.5 * (mean * across - sine * along),
        -0.5 * (mean * along + sine * across),
        0.5 * shrunk * across,
        -0.5 * shrunk * along,
    )
