"""Opening, slip and turn of a joint whose faces have moved far, compiled.

With d the displacement of the middle of the higher face relative to that of the lower, n and t the
normal and the tangent of the joint turned by the mean of both faces' angles, and δ the difference,

    g = n·d,   s = t·d,   σ = 2 sin(δ/2):

the gap of two places of the faces that touched at a distance a from the middle is g - a σ, and all
slip by the same s. Of small motions they are what `operator` makes of them. No angle is taken to
be small.

Over a step the discrete derivative D takes the change of the faces' poses to that of the measures
exactly, so forces Dᵀ f do the work that f does on the measures (Gonzalez, J. Nonlinear Sci. 6
(1996) 449, here in closed form). A pose is (x, y, θ), displacement of the middle and angle. Both
blocks move a joint by one jump, so derivatives have four columns: by the jump's x and y, and by the
angles of the lower and of the higher face.

Sines of angles at the end of a step follow from those at its start by addition theorems: those of
what a step turns are short series.
"""

import numba
import numpy as np

SMALL = 0.25
"""Angle up to which series are taken [rad]; the terms left out are below 1e-17, of the derivative
of sin x / x below 1e-14 of it."""


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def small_turn(x):  # type: ignore
    """Return cos x, sin x / x and the derivative of the latter.

    Args:
        x: angle [rad].
    """
    if abs(x) > SMALL:
        c, s = np.cos(x), np.sin(x) / x
        return c, s, (c - s) / x
    y = x * x
    c = y * (1 / 40320 + y * (-1 / 3628800 + y * (1 / 479001600)))
    c = 1.0 + y * (-1 / 2 + y * (1 / 24 + y * (-1 / 720 + c)))
    s = y * (1 / 362880 + y * (-1 / 39916800))
    s = 1.0 + y * (-1 / 6 + y * (1 / 120 + y * (-1 / 5040 + s)))
    return c, s, x * (-1 / 3 + y * (1 / 30 + y * (-1 / 840 + y * (1 / 45360 - y * (1 / 3991680)))))


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def both(x):  # type: ignore
    """Return cos x and sin x.

    Args:
        x: angle [rad].
    """
    c, s, _ = small_turn(x)
    return c, x * s


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def added(c, s, more_c, more_s):  # type: ignore
    """Return cosine and sine of the sum of two angles.

    Args:
        c: cosine of the first [-].
        s: its sine [-].
        more_c: cosine of the second [-].
        more_s: its sine [-].
    """
    return c * more_c - s * more_s, s * more_c + c * more_s


@numba.njit(cache=True, error_model="numpy", forceinline=True)
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


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def follow(before, after, angle, ends, rates, now):  # type: ignore
    """Find the measures at both ends of a step, and their derivatives.

    Args:
        before: poses of both faces at the start (2, 3) [m, m, rad].
        after: poses at the end (2, 3) [m, m, rad].
        angle: direction of the joint's normal before anything moved [rad].
        ends: opening, slip and turn at the start and at the end, filled (2, 3 or more).
        rates: D, which takes the change of the poses to that of the measures, filled (3, 4).
        now: derivative at the end, filled (3, 4).

    Returns:
        What `bend` needs to know of the step.
    """
    first = angle + 0.5 * (before[0, 2] + before[1, 2])
    turns = after[0, 2] - before[0, 2], after[1, 2] - before[1, 2]
    half, quarter = 0.25 * (turns[0] + turns[1]), 0.25 * (turns[1] - turns[0])
    mean, shrunk, falls = small_turn(half)
    c0, s0 = np.cos(first), np.sin(first)
    c, s = added(c0, s0, mean, half * shrunk)
    c1, s1 = added(c, s, mean, half * shrunk)
    x0, y0 = before[1, 0] - before[0, 0], before[1, 1] - before[0, 1]
    x1, y1 = after[1, 0] - after[0, 0], after[1, 1] - after[0, 1]
    ends[0, 0], ends[0, 1] = c0 * x0 + s0 * y0, c0 * y0 - s0 * x0
    ends[1, 0], ends[1, 1] = c1 * x1 + s1 * y1, c1 * y1 - s1 * x1
    start = 0.5 * (before[1, 2] - before[0, 2])
    near, less, drops = small_turn(quarter)
    cosine, sine = both(start)
    ends[0, 2] = 2.0 * sine
    cosine, sine = added(cosine, sine, near, quarter * less)
    last = added(cosine, sine, near, quarter * less)
    ends[1, 2] = 2.0 * last[1]
    x, y = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
    across, along = 0.5 * shrunk * (c * x + s * y), 0.5 * shrunk * (c * y - s * x)
    _fill(rates, (mean * c, mean * s), (along, across), less * cosine)
    _fill(now, (c1, s1), (0.5 * ends[1, 1], 0.5 * ends[1, 0]), last[0])
    by_turn = 0.25 * (drops * cosine - less * sine)
    return (c, s), (c1, s1), (x, y), (shrunk, falls), by_turn


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def _fill(rates, normal, arms, turn):  # type: ignore
    """Write down a derivative."""
    (c, s), (along, across) = normal, arms
    rates[0, 0], rates[0, 1], rates[0, 2], rates[0, 3] = c, s, along, along
    rates[1, 0], rates[1, 1], rates[1, 2], rates[1, 3] = -s, c, -across, -across
    rates[2, 0], rates[2, 1], rates[2, 2], rates[2, 3] = 0.0, 0.0, -turn, turn


@numba.njit(cache=True, error_model="numpy", forceinline=True)
def bend(step, force, rates):  # type: ignore
    """Add the derivative of Dᵀ f by the jump and the angles at the end, with f held.

    Args:
        step: as `follow` returned it.
        force: f, on opening, slip and turn (3 or more,) [N, N, N m].
        rates: added to (4, 4).
    """
    (c, s), (c1, s1), (x, y), (shrunk, falls), by_turn = step
    f, g = force[0], force[1]
    ax, ay = -f * s - g * c, f * c - g * s  # f_g t_m - f_s n_m
    by_angle = 0.125 * (falls * (ax * x + ay * y) + shrunk * (ax * y - ay * x))
    by_turn *= force[2]
    pull = (-0.25 * (f * s1 + g * c1), 0.25 * (f * c1 - g * s1))
    place = (0.25 * shrunk * ax, 0.25 * shrunk * ay)
    for axis in range(2):
        for side in range(2, 4):
            rates[axis, side] += pull[axis]
            rates[side, axis] += place[axis]
    rates[2, 2] += by_angle + by_turn
    rates[3, 3] += by_angle + by_turn
    rates[2, 3] += by_angle - by_turn
    rates[3, 2] += by_angle - by_turn
