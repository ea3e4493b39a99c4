"""The law of joints that stiffen as they close, in excess of the linear law, compiled.

A closing δ > 0 presses the faces by (Goodman 1976; Bandis, Lumsden and Barton, Int. J. Rock Mech.
Min. Sci. 20 (1983) 249-268)

    σ = k_n δ / (1 - δ/δ_m),

so that the tangent is k_n (1 + σ/p_0)² with p_0 = k_n δ_m. Beyond `LARGEST_CLOSING` of δ_m the law
follows its tangent. The excess over the linear law is

    σ_e = σ - k_n δ,   Φ_e = ∫ σ_e dδ,   Ψ_e = ∫ Φ_e dδ.

Where a closing changes linearly from u to v, along a facet or in time, means have a closed form. It
is piecewise where the path opens or leaves the hyperbola. The distance from δ_m over δ_m is
y = 1 - δ/δ_m = ȳ (1 + z τ), τ from -1 to 1, and σ_e/p_0 = 1/y - 2 + y. Means of 1/(1 + z τ) and
1/(1 + z τ)², times powers of τ, follow from two functions of z:

    S = (atanh z / z - 1) / z² = 1/3 + z² T,   B = 1 / (1 - z²).

No terms cancel. E is the mean of Φ_e. E_u and E_v are the means of σ_e times the linear functions
of both ends, and E_uu, E_uv and E_vv those of the tangent.

Kernels take numbers, or eight at a time (`lanes`).
"""

from typing import Any

import numpy as np

from archfem._numba import allocating_entry, inlined_kernel, kernel
from archfem.joints.contact_law import LARGEST_CLOSING
from archfem.joints.large.lanes import any_lane, greatest, least, logarithm, select

# σ_e/p_0 at the largest closing, and its derivative by the share of δ_m
LARGEST_TRACTION = LARGEST_CLOSING**2 / (1.0 - LARGEST_CLOSING)
LARGEST_TANGENT = LARGEST_CLOSING * (2.0 - LARGEST_CLOSING) / (1.0 - LARGEST_CLOSING) ** 2

# Closing over δ_m below which a logarithm would cancel in Φ_e, and a series serves [-]
SERIES_CLOSING = 0.2

# Change over a step, relative to the distance from δ_m and to the slope of a facet that is partly
# open, up to which Gauss's rule of three points in time errs by 1e-10 of the work at most; beyond,
# its energy is corrected
SMALL_CHANGE = 0.1

# The same for its rule of two points
SMALLEST_CHANGE = 0.01

# Points and weights of the rule of two points, then of that of three
_legendre: Any = np.polynomial.legendre  # without type annotations
_rules = np.array([np.pad(_legendre.leggauss(2), ((0, 0), (0, 1))), _legendre.leggauss(3)])
TIME_POINTS, TIME_WEIGHTS = 0.5 * (1.0 + _rules[:, 0].copy()), 0.5 * _rules[:, 1].copy()

# Coefficients of the series of Φ_e and of T, the highest power first, an even number. T takes
# twelve up to a z² of 0.0625, and six up to 0.01, where most facets are
ENERGY_SERIES = 1.0 / np.arange(22.0, 2.0, -1.0)
SERIES_SQUARES, SHORT_SERIES = (0.01, 0.0625), 6
LOG_SERIES = 1.0 / np.arange(27.0, 3.0, -2.0)


@kernel
def excess_energy(stiffness, rate, closing):  # type: ignore
    """Return Φ_e at a closing."""
    whole = rate * greatest(closing, 0.0)
    share = least(whole, LARGEST_CLOSING)
    energy, is_far = _sum_series(ENERGY_SERIES, 0, share), share >= SERIES_CLOSING
    energy = energy * share * share * share
    if any_lane(is_far):
        energy = select(is_far, -logarithm(1.0 - share) - share - 0.5 * share * share, energy)
    beyond = whole - share
    energy += beyond * (LARGEST_TRACTION + 0.5 * beyond * LARGEST_TANGENT)
    return stiffness / (rate * rate) * energy


@kernel
def excess_means(stiffness, rate, first, last):  # type: ignore
    """Return E, (E_u, E_v) and (E_uu, E_uv, E_vv) between two closings."""
    (near, far), pairs = excess_forces(stiffness, rate, first, last)
    # E is Φ_e at the less closed end, and the change of the closing times the mean of that end
    low, beside = least(first, last), select(first < last, near, far)
    energy = abs(last - first) * beside
    if any_lane(low > 0.0):
        energy += excess_energy(stiffness, rate, low)
    return energy, (near, far), pairs


@kernel
def excess_forces(stiffness, rate, first, last):  # type: ignore
    """Return (E_u, E_v) and (E_uu, E_uv, E_vv) between two closings."""
    u, v = rate * first, rate * last
    low, high = least(u, v), greatest(u, v)
    if any_lane((low < 0.0) | (high > LARGEST_CLOSING)):
        means = _piecewise_means(u, v)
    else:
        means = _spread(_hyperbola_moments(u, v), 0.0, 1.0)
    near, far, first_pair, mixed, last_pair = means
    force = stiffness / rate
    pairs = stiffness * first_pair, stiffness * mixed, stiffness * last_pair
    return (force * near, force * far), pairs


@kernel
def _piecewise_means(u, v):  # type: ignore
    """Return sums as `_spread` of a path that opens or leaves the hyperbola."""
    # parts on the hyperbola and beyond it, from their ends; of a path without length all or nothing
    p = least(greatest(u, 0.0), LARGEST_CLOSING)
    q = least(greatest(v, 0.0), LARGEST_CLOSING)
    is_still, is_whole = u == v, (p == u) & (q == v)
    share = 1.0 / select(is_still, 1.0, v - u)
    begin, end = (p - u) * share, (q - u) * share
    begin, end = select(is_whole, 0.0, begin), select(is_whole, 1.0, end)
    means = _spread(_hyperbola_moments(p, q), begin, end)
    if any_lane(greatest(u, v) > LARGEST_CLOSING):
        p, q = greatest(u, LARGEST_CLOSING), greatest(v, LARGEST_CLOSING)
        is_whole = (p == u) & (q == v)
        begin, end = (p - u) * share, select(is_whole, 1.0, (q - u) * share)
        (near, far, first, mixed, last), more = means, _spread(_tangent_moments(p, q), begin, end)
        means = near + more[0], far + more[1], first + more[2], mixed + more[3], last + more[4]
    return means


@inlined_kernel
def _hyperbola_moments(u, v):  # type: ignore
    """Return means of σ_e/p_0 times 1 and τ, and of its derivative times 1, τ and τ²."""
    middle = 0.5 * (u + v)
    rest = 1.0 - middle
    inverse = 1.0 / rest
    z = 0.5 * (u - v) * inverse
    square, scale = z * z, inverse * inverse
    series, base = _log_series(z, square), middle * (1.0 + rest) * (1 / 3)
    curved = 1.0 / (1.0 - square)
    traction = (middle * middle + square * (1 / 3 + square * series)) * inverse
    tilted = -z * inverse * (base + square * series)
    return (
        traction,
        tilted,
        scale * (3.0 * base + square * curved),
        -z * scale * (2 / 3 + square * (curved - series)),
        scale * (base + square * (curved - 2.0 * series)),
    )


@inlined_kernel
def _log_series(z, square):  # type: ignore
    """Return T."""
    skipped = 0 if any_lane(square > SERIES_SQUARES[0]) else len(LOG_SERIES) - SHORT_SERIES
    total, is_far = _sum_series(LOG_SERIES, skipped, square), square > SERIES_SQUARES[1]
    if any_lane(is_far):
        tangent = 0.5 * logarithm((1.0 + z) / (1.0 - z)) / z
        total = select(is_far, (tangent - 1.0 - square * (1 / 3)) / (square * square), total)
    return total


@inlined_kernel
def _sum_series(coefficients, first, x):  # type: ignore
    """Return the sum of a series from a coefficient on."""
    # even and odd powers beside each other: each of them waits for half as many results
    odd, even, square = 0.0, 0.0, x * x
    for k in range(first, len(coefficients), 2):
        odd = odd * square + coefficients[k]
        even = even * square + coefficients[k + 1]
    return odd * x + even


@inlined_kernel
def _tangent_moments(u, v):  # type: ignore
    """Return `_hyperbola_moments` of closings beyond the hyperbola."""
    traction = LARGEST_TRACTION + (0.5 * (u + v) - LARGEST_CLOSING) * LARGEST_TANGENT
    return traction, (v - u) * (LARGEST_TANGENT / 6), LARGEST_TANGENT, 0.0, LARGEST_TANGENT / 3


@inlined_kernel
def _spread(moments, begin, end):  # type: ignore
    """Return the parts of a path's E_u, E_v, E_uu, E_uv and E_vv from moments between two places.

    They are for a path of unit stiffness and closure.
    """
    traction, tilted, tangent, turned, bent = moments
    length, middle = end - begin, 0.5 * (begin + end)
    half, other = 0.5 * length, 1.0 - middle
    far = middle * traction + half * tilted
    mixed = middle * tangent + half * turned  # of the tangent times the place
    last = middle * mixed + half * (middle * turned + half * bent)
    return (
        length * (other * traction - half * tilted),
        length * far,
        length * (other * (tangent - mixed) - half * (other * turned - half * bent)),
        length * (mixed - last),
        length * last,
    )


@kernel
def without_lag(before, after, first, second):  # type: ignore
    """Return closings at start and end without the lag of damping, and their rates."""
    if first == 0.0 or first == second:  # no lag, or no path
        return before, after, first, second
    ahead = first / (second - first) * (after - before)
    return before - ahead, after - ahead, 0.0, second - first


@kernel
def point_step_excess(stiffness, rate, before, after, first, second):  # type: ignore
    """Return the mean excess over a step at a place, and its derivative by the closing.

    The closings at start and end, which contain the lag of damping, change at the rates `first`
    and `second`. The excess is elastic: damping is that of the linear law.
    """
    before, after, first, second = without_lag(before, after, first, second)
    (near, far), (start, mixed, end) = excess_forces(stiffness, rate, before, after)
    return near + far, first * (start + mixed) + second * (mixed + end)


@kernel
def crossing(before, after):  # type: ignore
    """Return the part of a step after which a closing changes its sign, 0 if it does not."""
    return select((before > 0.0) ^ (after > 0.0), before / (before - after), 0.0)


@kernel
def facet_step_excess(stiffness, rate, ends, first, second):  # type: ignore
    """Return the mean excess over a step times φ_i along a facet, and its derivatives.

    Closings of the ends move from (a, c) to (b, d), with lag and rates as at a place. Where they
    change much, Gauss's rule in time is corrected along the change, so that the work is the change
    of E (Gonzalez, J. Nonlinear Sci. 6 (1996) 449-467), with derivatives that are made symmetric.
    """
    a, b, _, _ = without_lag(ends[0], ends[2], first, second)
    c, d, first, second = without_lag(ends[1], ends[3], first, second)
    highest = greatest(greatest(a, b), greatest(c, d))
    near = far = first_pair = mixed = last_pair = 0.0 * stiffness
    if not any_lane(highest > 0.0):
        return (near, far), (first_pair, mixed, last_pair)
    if not any_lane((a != b) | (c != d)):  # at an instant
        means, pairs = excess_forces(stiffness, rate, a, c)
        mean = 0.5 * (first + second)
        return means, (mean * pairs[0], mean * pairs[1], mean * pairs[2])
    ends = a, c, b, d
    change, scale = greatest(abs(b - a), abs(d - c)), _smooth_change(rate, ends, highest)
    needs_three = change > SMALLEST_CHANGE * scale
    count = 3 if any_lane(needs_three) else 2
    # the means are smooth in time between the moments at which the ends open or close
    one, other = crossing(a, b), crossing(c, d)
    begin = 0.0 * one
    for end in (least(one, other), greatest(one, other), 1.0 + 0.0 * one):
        length = end - begin
        for k in range(count if any_lane(length > 0.0) else 0):
            time = begin + select(needs_three, TIME_POINTS[1, k], TIME_POINTS[0, k]) * length
            weight = select(needs_three, TIME_WEIGHTS[1, k], TIME_WEIGHTS[0, k]) * length
            p, q = a + time * (b - a), c + time * (d - c)
            (n0, n1), (k00, k01, k11) = excess_forces(stiffness, rate, p, q)
            near += weight * n0
            far += weight * n1
            weight *= first + time * (second - first)
            first_pair += weight * k00
            mixed += weight * k01
            last_pair += weight * k11
        begin = end
    means, pairs = (near, far), (first_pair, mixed, last_pair)
    is_large = change > SMALL_CHANGE * scale
    if any_lane(is_large):
        return _conserve_energy(stiffness, rate, ends, (first, second), (means, pairs), is_large)
    return means, pairs


@inlined_kernel
def _smooth_change(rate, ends, highest):  # type: ignore
    """Return the change of closings on the scale of which the means of a facet vary in time."""
    (a, c, b, d), whole = ends, 1.0 / rate
    limit = LARGEST_CLOSING * whole
    scale, lowest = whole - least(highest, limit), least(least(a, b), least(c, d))
    # the place at which a facet opens, or leaves the hyperbola, moves as its slope changes
    slope = select((c > a) ^ (d > b), 0.0, least(abs(c - a), abs(d - b)))
    scale = select((lowest < 0.0) | (highest > limit), least(scale, slope), scale)
    leaves = ((a > limit) ^ (b > limit)) | ((c > limit) ^ (d > limit))
    return select(leaves, 0.0, scale)


@kernel
def _conserve_energy(stiffness, rate, ends, rates, results, is_large):  # type: ignore
    """Correct means over a step, so that their work is the change of energy, and derivatives.

    Each mean is corrected in proportion to itself and to the change of its closing.
    """
    (a, c, b, d), (first, second), ((near, far), (k00, k01, k11)) = ends, rates, results
    x, y, turn = b - a, d - c, second - first
    scale = near * x * x + far * y * y
    is_large = is_large & (scale > 0.0)
    scale = select(is_large, scale, 1.0)
    before, (f0, f1), _ = excess_means(stiffness, rate, a, c)
    after, (l0, l1), _ = excess_means(stiffness, rate, b, d)
    factor = select(is_large, (after - before - near * x - far * y) / scale, 0.0)
    # derivatives of the factor by both ends
    by_near = second * l0 - first * f0 - k00 * x - k01 * y - turn * near
    by_far = second * l1 - first * f1 - k01 * x - k11 * y - turn * far
    by_near -= factor * (k00 * x * x + k01 * y * y + 2.0 * turn * near * x)
    by_far -= factor * (k01 * x * x + k11 * y * y + 2.0 * turn * far * y)
    by_near = select(is_large, by_near / scale, 0.0)
    by_far = select(is_large, by_far / scale, 0.0)
    means = near * (1.0 + factor * x), far * (1.0 + factor * y)
    mixed = near * x * by_far + far * y * by_near + factor * k01 * (x + y)
    pairs = (
        k00 * (1.0 + factor * x) + near * (x * by_near + factor * turn),
        k01 + 0.5 * mixed,
        k11 * (1.0 + factor * y) + far * (y * by_far + factor * turn),
    )
    return means, pairs


@allocating_entry
def sum_excess(stiffness, rate, start, end, rates, step):  # type: ignore
    """Return means of the excess over a step at joint points, and its derivatives by closings.

    Each facet has `step` points, its two ends, or one of springs. Means are per area of the facet
    or spring (f, step); derivatives are those of `NormalLaw.coupling_pairs` (step, step, f).
    """
    count = len(stiffness)
    means, pairs = np.zeros((count, step)), np.zeros((step, step, count))
    for k in range(count):
        if rate[k] == 0.0:
            continue
        if step == 1:
            means[k, 0], pairs[0, 0, k] = point_step_excess(
                stiffness[k], rate[k], start[k], end[k], rates[0], rates[1]
            )
            continue
        ends = start[2 * k], start[2 * k + 1], end[2 * k], end[2 * k + 1]
        (means[k, 0], means[k, 1]), (pairs[0, 0, k], mixed, pairs[1, 1, k]) = facet_step_excess(
            stiffness[k], rate[k], ends, rates[0], rates[1]
        )
        pairs[0, 1, k] = pairs[1, 0, k] = mixed
    return means, pairs


@allocating_entry
def excess_energies(stiffness, rate, closing, step):  # type: ignore
    """Return the energy in excess of the linear law, per area of each facet or spring (f,)."""
    energies = np.zeros(len(stiffness))
    for k in range(len(energies)):
        if rate[k] > 0.0:
            first, last = closing[step * k], closing[step * k + step - 1]
            energies[k] = excess_means(stiffness[k], rate[k], first, last)[0]
    return energies
