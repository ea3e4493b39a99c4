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

import numpy as np

from archfem.joints.moving.compiled import inlined

SMALL = 0.25
"""Angle up to which series are taken [rad]; the terms left out are below 1e-17, of the derivative
of sin x / x below 1e-14 of it."""


@inlined
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


@inlined
def both(x):  # type: ignore
    """Return cos x and sin x.

    Args:
        x: angle [rad].
    """
    c, s, _ = small_turn(x)
    return c, x * s


@inlined
def added(c, s, more_c, more_s):  # type: ignore
    """Return cosine and sine of the sum of two angles.

    Args:
        c: cosine of the first [-].
        s: its sine [-].
        more_c: cosine of the second [-].
        more_s: its sine [-].
    """
    return c * more_c - s * more_s, s * more_c + c * more_s


@inlined
def measures(lower, higher, angle):  # type: ignore
    """Return opening, slip and turn of a joint [m, m, -].

    Args:
        lower: pose of the face of the lower block [m, m, rad].
        higher: pose of the face of the higher block [m, m, rad].
        angle: direction of the joint's normal before anything moved [rad].
    """
    direction = angle + 0.5 * (lower[2] + higher[2])
    c, s = np.cos(direction), np.sin(direction)
    x, y = higher[0] - lower[0], higher[1] - lower[1]
    return c * x + s * y, c * y - s * x, 2.0 * np.sin(0.5 * (higher[2] - lower[2]))


@inlined
def follow(lower, higher, angle):  # type: ignore
    """Return the measures at both ends of a step, and their derivatives.

    A derivative is told by its entries c, s, a, b and t: its rows are (c, s, a, a), (-s, c, -b, -b)
    and (0, 0, -t, t).

    Args:
        lower: poses of the face of the lower block at the start and at the end [m, m, rad].
        higher: poses of the face of the higher block [m, m, rad].
        angle: direction of the joint's normal before anything moved [rad].

    Returns:
        Opening, slip and turn at the start and at the end; D, which takes the change of the poses
        to theirs; the derivative at the end; and what `curved` needs to know of the step.
    """
    ((xa, ya, a0), (xc, yc, a1)), ((xb, yb, b0), (xd, yd, b1)) = lower, higher
    half, quarter = 0.25 * ((a1 - a0) + (b1 - b0)), 0.25 * ((b1 - b0) - (a1 - a0))
    mean, shrunk, falls = small_turn(half)
    first = angle + 0.5 * (a0 + b0)
    c0, s0 = np.cos(first), np.sin(first)
    c, s = added(c0, s0, mean, half * shrunk)
    c1, s1 = added(c, s, mean, half * shrunk)
    x0, y0, x1, y1 = xb - xa, yb - ya, xd - xc, yd - yc
    near, less, drops = small_turn(quarter)
    cosine, sine = both(0.5 * (b0 - a0))
    start = c0 * x0 + s0 * y0, c0 * y0 - s0 * x0, 2.0 * sine
    cosine, sine = added(cosine, sine, near, quarter * less)
    last = added(cosine, sine, near, quarter * less)
    end = c1 * x1 + s1 * y1, c1 * y1 - s1 * x1, 2.0 * last[1]
    x, y = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
    along, across = 0.5 * shrunk * (c * y - s * x), 0.5 * shrunk * (c * x + s * y)
    rates = mean * c, mean * s, along, across, less * cosine
    now = c1, s1, 0.5 * end[1], 0.5 * end[0], last[0]
    by_turn = 0.25 * (drops * cosine - less * sine)
    return start, end, rates, now, ((c, s), (c1, s1), (x, y), (shrunk, falls), by_turn)


@inlined
def pushed(rates, force):  # type: ignore
    """Return Dᵀ f: the force on the jump, and the moments on both faces [N, N, N m, N m].

    Args:
        rates: D, as `follow` returns it.
        force: f, on opening, slip and turn [N, N, N m].
    """
    c, s, a, b, t = rates
    middle, apart = a * force[0] - b * force[1], t * force[2]
    x, y = c * force[0] - s * force[1], s * force[0] + c * force[1]
    return x, y, middle - apart, middle + apart


@inlined
def seen(now, row):  # type: ignore
    """Return a row times a derivative: by the jump's x and y, and by the faces' angles.

    Args:
        now: the derivative, as `follow` returns it.
        row: by opening, slip and turn.
    """
    c, s, a, b, t = now
    middle, apart = a * row[0] - b * row[1], t * row[2]
    return c * row[0] - s * row[1], s * row[0] + c * row[1], middle - apart, middle + apart


@inlined
def curved(step, rates, now, force, law):  # type: ignore
    """Return the derivative of Dᵀ f by the jump and the angles at the end, row by row.

    Args:
        step: as `follow` returned it.
        rates: D.
        now: the derivative of the measures at the end.
        force: f, on opening, slip and turn [N, N, N m].
        law: its derivatives by opening, slip and turn at the end, row by row.
    """
    (c, s), (c1, s1), (x, y), (shrunk, falls), by_turn = step
    f, g = force[0], force[1]
    ax, ay = -f * s - g * c, f * c - g * s  # f_g t_m - f_s n_m
    by_angle = 0.125 * (falls * (ax * x + ay * y) + shrunk * (ax * y - ay * x))
    by_turn *= force[2]
    same, other = by_angle + by_turn, by_angle - by_turn
    px, py = -0.25 * (f * s1 + g * c1), 0.25 * (f * c1 - g * s1)
    qx, qy = 0.25 * shrunk * ax, 0.25 * shrunk * ay
    first, second, third = seen(now, law[0]), seen(now, law[1]), seen(now, law[2])
    c, s, a, b, t = rates
    middle = _mixed(a, first, -b, second, (qx, qy, 0.0, 0.0))
    return (
        _mixed(c, first, -s, second, (0.0, 0.0, px, px)),
        _mixed(s, first, c, second, (0.0, 0.0, py, py)),
        _mixed(1.0, middle, -t, third, (0.0, 0.0, same, other)),
        _mixed(1.0, middle, t, third, (0.0, 0.0, other, same)),
    )


@inlined
def _mixed(a, first, b, second, more):  # type: ignore
    """Return a sum of three rows, of which two have factors."""
    return (
        a * first[0] + b * second[0] + more[0],
        a * first[1] + b * second[1] + more[1],
        a * first[2] + b * second[2] + more[2],
        a * first[3] + b * second[3] + more[3],
    )
