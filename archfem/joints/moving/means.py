"""Means over a step of what a joint's places carry while gaps go straight, compiled."""

from pathlib import Path

import numpy as np

from archfem.files import forget_stale
from archfem.joints.facets import PLACES, SHARES
from archfem.joints.moving.compiled import inlined

forget_stale(Path(__file__).parent)


@inlined
def point_means(a, b, first, second):  # type: ignore
    """Return means over a step of closing and of opening at a place, rate of the latter, and time.

    Args:
        a: gap at the start of its path [m].
        b: gap at the end [m].
        first: change of the start with a parameter [-].
        second: change of the end with it [-].
    """
    if a <= 0.0 and b <= 0.0:
        return 0.5 * (a + b), 0.0, 0.0, 1.0
    if a > 0.0 and b > 0.0:
        return 0.0, 0.5 * (a + b), 0.5 * (first + second), 0.0
    whole = abs(a) + abs(b)
    opened, closed = max(a, b) / whole, -min(a, b) / whole
    square = 0.5 * opened**2
    rate = first * (opened - square if a > 0.0 else square)
    rate += second * (opened - square if b > 0.0 else square)
    return 0.5 * min(a, b) * closed, 0.5 * max(a, b) * opened, rate, closed


@inlined
def facet_means(ends, first, second):  # type: ignore
    """Return the same integrated with the linear functions of a facet of unit length.

    Args:
        ends: gaps of both ends at the start, and of both at the end, of their paths [m].
        first: change of the start with a parameter [-].
        second: change of the end with it [-].
    """
    a, c, b, d = ends
    if max(ends) <= 0.0 or min(ends) > 0.0:
        return _whole_means(ends, 0.5 * (first + second))
    _, _, breaks = _cut(ends)
    n0 = n1 = t0 = t1 = r00 = r01 = r11 = s0 = s1 = 0.0
    for piece in range(3):
        length = breaks[piece + 1] - breaks[piece]
        if length <= 0.0:
            continue
        for k in range(3):
            place = breaks[piece] + PLACES[k] * length
            near, far = 1.0 - place, place
            normal, taken, rate, time = point_means(
                near * a + far * c, near * b + far * d, first, second
            )
            weight = SHARES[k] * length
            n0 += weight * near * normal
            n1 += weight * far * normal
            t0 += weight * near * taken
            t1 += weight * far * taken
            r00 += weight * near * near * rate
            r01 += weight * near * far * rate
            r11 += weight * far * far * rate
            s0 += weight * near * time
            s1 += weight * far * time
    return (n0, n1), (t0, t1), (r00, r01, r11), (s0, s1)


@inlined
def _cut(ends):  # type: ignore
    """Where a facet opens or closes at the start and at the end, 0 if nowhere; and its pieces."""
    a, c, b, d = ends
    low = a / (a - c) if (a <= 0.0) != (c <= 0.0) else 0.0
    high = b / (b - d) if (b <= 0.0) != (d <= 0.0) else 0.0
    return low, high, (0.0, min(low, high), max(low, high), 1.0)


@inlined
def _whole_means(ends, rate):  # type: ignore
    """What `facet_means` returns of a facet that is closed, or open, everywhere and all the way."""
    a, c, b, d = ends
    near, far = (a + b) / 12.0, (c + d) / 12.0
    means, none = (2.0 * near + far, near + 2.0 * far), (0.0, 0.0)
    if max(ends) <= 0.0:
        return means, none, (0.0, 0.0, 0.0), (0.5, 0.5)
    return none, means, (rate / 3.0, rate / 6.0, rate / 3.0), none


@inlined
def closed_means(ends, first, second, facet):  # type: ignore
    """Return the mean time for which a facet of unit length is closed, or a place, and its rate.

    Args:
        ends: gaps of both ends at the start, and of both at the end, of their paths [m].
        first: change of the start with a parameter [-].
        second: change of the end with it [-].
        facet: whether it is one; else only its first end counts.

    Returns:
        Integrated with the two linear functions of the facet, and their derivatives by the first
        and by the second gap, and of the second by the second [-, 1/m].
    """
    a, c, b, d = ends
    if not facet:
        time, rate = _closed_rate(a, b, first, second)
        return (time, 0.0), (rate, 0.0, 0.0)
    low, high, breaks = _cut(ends)
    s0 = s1 = r00 = r01 = r11 = 0.0
    for piece in range(3):
        length = breaks[piece + 1] - breaks[piece]
        if length <= 0.0:
            continue
        for k in range(3):
            place = breaks[piece] + PLACES[k] * length
            near, far = 1.0 - place, place
            time, rate = _closed_rate(near * a + far * c, near * b + far * d, first, second)
            weight = SHARES[k] * length
            s0 += weight * near * time
            s1 += weight * far * time
            r00 += weight * near * near * rate
            r01 += weight * near * far * rate
            r11 += weight * far * far * rate
    if low == high and 0.0 < low < 1.0:  # the end of what is closed moves, at an instant
        moves = -0.5 * (first + second) / abs(a - c)
        r00 += (1.0 - low) ** 2 * moves
        r01 += (1.0 - low) * low * moves
        r11 += low**2 * moves
    return (s0, s1), (r00, r01, r11)


@inlined
def _closed_rate(a, b, first, second):  # type: ignore
    """Part of a step for which a place is closed, and its derivative."""
    if (a <= 0.0) == (b <= 0.0):
        return 1.0 if a <= 0.0 else 0.0, 0.0
    whole = abs(a) + abs(b)
    time = -min(a, b) / whole
    by_first = 1.0 - time if a <= 0.0 else time
    by_second = 1.0 - time if b <= 0.0 else time
    return time, -(first * by_first + second * by_second) / whole


@inlined
def shear_means(first, change, late, limit):  # type: ignore
    """Return what a point that slides during a step carries, as `joints.law.shear_over_step`.

    Args:
        first: elastic shear at the start [N].
        change: of it, if the point did not slide [N].
        late: lag of damping over the length of the step [-].
        limit: Coulomb's, finite [N].

    Returns:
        Mean shear, what the elastic shear loses by sliding, derivatives of the mean by its elastic
        change and by the limit, and the energy lost times the stiffness.
    """
    start = min(max(first, -limit), limit)
    last = min(max(start + change, -limit), limit)
    over = start + change - last
    slid = min(max(over / change, 0.0), 1.0) if over != 0.0 and change != 0.0 else 0.0
    mean = start + 0.5 * change - 0.5 * over * slid
    shear = min(max(mean + late * change, -limit), limit)
    if abs(mean + late * change) > limit:
        by_change, by_limit = 0.0, np.sign(shear)
    else:
        lost = np.sign(first) if abs(first) > limit else 0.0
        by_change = 0.5 * (1.0 - slid) ** 2 + late
        by_limit = (1.0 - slid) * lost + slid * np.sign(change)
    rubbing = 0.5 * (first**2 - start**2) + abs(over) * limit + (shear - mean) * change
    return shear, first + change - last, by_change, by_limit, rubbing
