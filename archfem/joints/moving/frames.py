"""Opening, slip and turn of a joint whose faces have moved far, compiled.

With d the displacement of the middle of the higher face relative to that of the lower, n and t the
normal and the tangent of the joint turned by the mean of both faces' angles, and δ the difference,

    g = n·d,   s = t·d,   σ = 2 sin(δ/2):

the gap of two places of the faces that touched at a distance a from the middle is g - a σ, and all
slip by the same s. Of small motions they are what `operator` makes of them. No angle is taken to
be small.

Over a step the discrete derivative D takes the change of the faces' poses to that of the measures
exactly, so forces Dᵀ f do the work that f does on the measures (Gonzalez, J. Nonlinear Sci. 6
(1996) 449, here in closed form). A pose is (x, y, θ), displacement of the middle and angle.
"""

import numba
import numpy as np

SMALL = 1e-4
"""Angle below which sin x / x is its series, whose next term is x⁴/120."""


@numba.njit(cache=True)
def sinc(x):  # type: ignore
    """Return sin x / x.

    Args:
        x: angle [rad].
    """
    return 1.0 - x * x / 6.0 if abs(x) < SMALL else np.sin(x) / x


@numba.njit(cache=True)
def sinc_rate(x):  # type: ignore
    """Return the derivative of sin x / x.

    Args:
        x: angle [rad].
    """
    return -x / 3.0 if abs(x) < SMALL else (np.cos(x) - np.sin(x) / x) / x


@numba.njit(cache=True)
def measures(lower, higher, angle, found):  # type: ignore
    """Find opening, slip and turn of a joint.

    Args:
        lower: pose of the face of the lower block (3,) [m, m, rad].
        higher: pose of the face of the higher block (3,) [m, m, rad].
        angle: direction of the joint's normal before anything moved [rad].
        found: g, s and σ, filled (3,) [m, m, -].
    """
    direction = angle + 0.5 * (lower[2] + higher[2])
    c, s = np.cos(direction), np.sin(direction)
    x, y = higher[0] - lower[0], higher[1] - lower[1]
    found[0], found[1] = c * x + s * y, c * y - s * x
    found[2] = 2.0 * np.sin(0.5 * (higher[2] - lower[2]))


@numba.njit(cache=True)
def gradient(pose, angle, rates):  # type: ignore
    """Find the derivative of the measures by the poses of both faces.

    Args:
        pose: of the lower and of the higher face (2, 3) [m, m, rad].
        angle: direction of the joint's normal before anything moved [rad].
        rates: filled (3, 6).
    """
    direction = angle + 0.5 * (pose[0, 2] + pose[1, 2])
    c, s = np.cos(direction), np.sin(direction)
    x, y = pose[1, 0] - pose[0, 0], pose[1, 1] - pose[0, 1]
    opening, slip = c * x + s * y, c * y - s * x
    turn = np.cos(0.5 * (pose[1, 2] - pose[0, 2]))
    for side, sign in ((0, -1.0), (3, 1.0)):
        rates[0, side], rates[0, side + 1], rates[0, side + 2] = sign * c, sign * s, 0.5 * slip
        rates[1, side], rates[1, side + 1], rates[1, side + 2] = -sign * s, sign * c, -0.5 * opening
        rates[2, side], rates[2, side + 1], rates[2, side + 2] = 0.0, 0.0, sign * turn


@numba.njit(cache=True)
def discrete(before, after, angle, rates):  # type: ignore
    """Find D, which takes the change of the poses over a step to that of the measures.

    Args:
        before: poses of both faces at the start (2, 3) [m, m, rad].
        after: poses at the end (2, 3) [m, m, rad].
        angle: direction of the joint's normal before anything moved [rad].
        rates: filled (3, 6).
    """
    first = angle + 0.5 * (before[0, 2] + before[1, 2])
    change = 0.5 * (after[0, 2] + after[1, 2]) - 0.5 * (before[0, 2] + before[1, 2])
    middle, shrunk, mean = first + 0.5 * change, sinc(0.5 * change), np.cos(0.5 * change)
    c, s = np.cos(middle), np.sin(middle)
    x = 0.5 * (before[1, 0] - before[0, 0] + after[1, 0] - after[0, 0])
    y = 0.5 * (before[1, 1] - before[0, 1] + after[1, 1] - after[0, 1])
    across, along = 0.5 * shrunk * (c * x + s * y), 0.5 * shrunk * (c * y - s * x)
    start, end = before[1, 2] - before[0, 2], after[1, 2] - after[0, 2]
    turn = sinc(0.25 * (end - start)) * np.cos(0.25 * (start + end))
    c, s = mean * c, mean * s
    for side, sign in ((0, -1.0), (3, 1.0)):
        rates[0, side], rates[0, side + 1], rates[0, side + 2] = sign * c, sign * s, along
        rates[1, side], rates[1, side + 1], rates[1, side + 2] = -sign * s, sign * c, -across
        rates[2, side], rates[2, side + 1], rates[2, side + 2] = 0.0, 0.0, sign * turn


@numba.njit(cache=True)
def bend(before, after, angle, force, rates):  # type: ignore
    """Find the derivative of Dᵀ f by the poses at the end, with f held.

    Args:
        before: poses of both faces at the start (2, 3) [m, m, rad].
        after: poses at the end (2, 3) [m, m, rad].
        angle: direction of the joint's normal before anything moved [rad].
        force: f, on opening, slip and turn (3,) [N, N, N m].
        rates: filled (6, 6).
    """
    first = angle + 0.5 * (before[0, 2] + before[1, 2])
    change = 0.5 * (after[0, 2] + after[1, 2]) - 0.5 * (before[0, 2] + before[1, 2])
    middle, end = first + 0.5 * change, first + change
    c, s = np.cos(end), np.sin(end)
    pull = (-0.5 * force[0] * s - 0.5 * force[1] * c, 0.5 * force[0] * c - 0.5 * force[1] * s)
    c, s = np.cos(middle), np.sin(middle)
    arm = (-force[0] * s - force[1] * c, force[0] * c - force[1] * s)  # f_g t_m - f_s n_m
    x = 0.5 * (before[1, 0] - before[0, 0] + after[1, 0] - after[0, 0])
    y = 0.5 * (before[1, 1] - before[0, 1] + after[1, 1] - after[0, 1])
    shrunk, falls = sinc(0.5 * change), sinc_rate(0.5 * change)
    by_angle = 0.5 * falls * (arm[0] * x + arm[1] * y) + 0.5 * shrunk * (-arm[1] * x + arm[0] * y)
    by_angle *= 0.25
    by_place = (0.25 * shrunk * arm[0], 0.25 * shrunk * arm[1])
    start, stop = before[1, 2] - before[0, 2], after[1, 2] - after[0, 2]
    quarter, half = 0.25 * (stop - start), 0.25 * (start + stop)
    by_turn = 0.25 * (sinc_rate(quarter) * np.cos(half) - sinc(quarter) * np.sin(half)) * force[2]
    rates[:] = 0.0
    for side, sign in ((0, -1.0), (3, 1.0)):
        for other, against in ((0, -1.0), (3, 1.0)):
            for axis in range(2):
                rates[side + axis, other + 2] = 0.5 * sign * pull[axis]
                rates[side + 2, other + axis] = against * by_place[axis]
            rates[side + 2, other + 2] = by_angle + sign * against * by_turn
