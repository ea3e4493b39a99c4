"""The law of joints that stiffen as they close, in excess of the linear law, compiled.

A closing δ > 0 presses the faces by (Goodman 1976; Bandis, Lumsden and Barton, Int. J. Rock Mech.
Min. Sci. 20 (1983) 249-268)

    σ = k_n δ / (1 - δ/δ_m),

so that the tangent is k_n (1 + σ/p_0)² with p_0 = k_n δ_m. Beyond `LARGEST_CLOSING` of δ_m the law
follows its tangent. The excess over the linear law is

    σ_e = σ - k_n δ,   Φ_e = ∫ σ_e dδ,   Ψ_e = ∫ Φ_e dδ.

Where a closing changes linearly from u to v, along a facet or in time, the mean of Φ_e and its
derivatives are divided differences, exact also where the path opens or leaves the hyperbola:

    E = (Ψ_v - Ψ_u) / s,   E_u = (E - Φ_u) / s,   E_v = (Φ_v - E) / s,   s = v - u,
    E_uu = (2 E_u - σ_u) / s,   E_uv = (E_v - E_u) / s,   E_vv = (σ_v - 2 E_v) / s.

E_u and E_v are the means of σ_e times the linear functions of both ends, E_uu, E_uv and E_vv those
of the tangent. Gauss's rule serves where u and v are close, and differences would round.
"""

import math
from typing import Any

import numpy as np

from archfem._numba import allocating_entry, kernel
from archfem._typing import Array
from archfem.joints.contact_law import LARGEST_CLOSING

# Closing over δ_m below which logarithms would cancel in Ψ_e, and a series serves [-]
SERIES_CLOSING = 0.2

# Change of a closing, over its distance from 0 and from δ_m, below which Gauss's rule of six points
# is exact but for round-off, and the divided differences of tangents round by 1e-12 [-]
CLOSE_ENDS = 0.25

# Change over a step, relative to the largest closing and to its distance from δ_m, below which
# Gauss's rule in time conserves energy, and its correction would be round-off [-]
SMALL_CHANGE = 1e-3


def _unit_rule(count: int) -> tuple[Array, Array]:
    """Return points and weights of Gauss's rule on the unit interval."""
    legendre: Any = np.polynomial.legendre  # without type annotations
    points, weights = legendre.leggauss(count)
    return 0.5 * (1.0 + points), 0.5 * weights


SPACE_POINTS, SPACE_WEIGHTS = _unit_rule(6)
TIME_POINTS, TIME_WEIGHTS = _unit_rule(2)

# Coefficients 1 / n and 1 / (n (n + 1)) of the series of Φ_e and Ψ_e, the highest power first
SERIES_POWERS = np.arange(22.0, 2.0, -1.0)
ENERGY_SERIES, SUM_SERIES = 1.0 / SERIES_POWERS, 1.0 / (SERIES_POWERS * (SERIES_POWERS + 1.0))


@kernel
def split_closing(rate, closing):  # type: ignore
    """Return the share of δ_m up to the end of the hyperbola, and the closing beyond it [m]."""
    share = rate * closing
    if share > LARGEST_CLOSING:
        return LARGEST_CLOSING, closing - LARGEST_CLOSING / rate
    return share, 0.0


@kernel
def excess_traction(stiffness, rate, closing):  # type: ignore
    """Return σ_e and its derivative at a closing; the rate is 1/δ_m."""
    if closing <= 0.0:
        return 0.0, 0.0
    share, beyond = split_closing(rate, closing)
    slope = 1.0 / (1.0 - share)
    tangent = stiffness * (slope * slope - 1.0)
    return stiffness / rate * share * share * slope + beyond * tangent, tangent


@kernel
def excess_energy(stiffness, rate, closing):  # type: ignore
    """Return Φ_e and Ψ_e at a closing."""
    if closing <= 0.0:
        return 0.0, 0.0
    share, beyond = split_closing(rate, closing)
    if share < SERIES_CLOSING:
        single = double = 0.0
        for k in range(len(ENERGY_SERIES)):
            single = single * share + ENERGY_SERIES[k]
            double = double * share + SUM_SERIES[k]
        single, double = single * share**3, double * share**4
    else:
        logarithm = math.log1p(-share)
        single = -logarithm - share - 0.5 * share**2
        double = (1.0 - share) * logarithm + share - 0.5 * share**2 - share**3 / 6.0
    energy, total = stiffness * single / rate**2, stiffness * double / rate**3
    if beyond > 0.0:
        traction, tangent = excess_traction(stiffness, rate, LARGEST_CLOSING / rate)
        total += beyond * (energy + beyond * (0.5 * traction + beyond * tangent / 6.0))
        energy += beyond * (traction + 0.5 * beyond * tangent)
    return energy, total


@kernel
def are_close(rate, first, second, change):  # type: ignore
    """Return whether closings differ by little, relative to their distances from 0 and δ_m."""
    low, high = min(first, second), max(first, second)
    if rate * low >= LARGEST_CLOSING:  # the law is linear
        return True
    return high - low <= change * min(low, 1.0 / rate - high)


@kernel
def excess_means(stiffness, rate, first, last):  # type: ignore
    """Return E, (E_u, E_v) and (E_uu, E_uv, E_vv) between two closings."""
    if first <= 0.0 and last <= 0.0:
        return 0.0, (0.0, 0.0), (0.0, 0.0, 0.0)
    if are_close(rate, first, last, CLOSE_ENDS):
        return _gauss_means(stiffness, rate, first, last)
    change = last - first
    t0, t1 = excess_traction(stiffness, rate, first)[0], excess_traction(stiffness, rate, last)[0]
    (e0, sum0), (e1, sum1) = (
        excess_energy(stiffness, rate, first),
        excess_energy(stiffness, rate, last),
    )
    mean = (sum1 - sum0) / change
    near, far = (mean - e0) / change, (e1 - mean) / change
    pairs = (2.0 * near - t0) / change, (far - near) / change, (t1 - 2.0 * far) / change
    return mean, (near, far), pairs


@kernel
def _gauss_means(stiffness, rate, first, last):  # type: ignore
    """Return `excess_means` by Gauss's rule."""
    near = far = first_pair = mixed = last_pair = 0.0
    for k in range(len(SPACE_POINTS)):
        b, weight = SPACE_POINTS[k], SPACE_WEIGHTS[k]
        a = 1.0 - b
        traction, tangent = excess_traction(stiffness, rate, a * first + b * last)
        near += weight * a * traction
        far += weight * b * traction
        first_pair += weight * a * a * tangent
        mixed += weight * a * b * tangent
        last_pair += weight * b * b * tangent
    mean = excess_energy(stiffness, rate, first)[0] + (last - first) * near
    return mean, (near, far), (first_pair, mixed, last_pair)


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
    _, (near, far), (start, mixed, end) = excess_means(stiffness, rate, before, after)
    return near + far, first * (start + mixed) + second * (mixed + end)


@kernel
def crossing(before, after):  # type: ignore
    """Return the part of a step after which a closing changes its sign, 0 if it does not."""
    return before / (before - after) if (before > 0.0) != (after > 0.0) else 0.0


@kernel
def facet_step_excess(stiffness, rate, ends, first, second):  # type: ignore
    """Return the mean excess over a step times φ_i along a facet, and its derivatives.

    Closings of the ends move from (a, c) to (b, d), with lag and rates as at a place. Gauss's rule
    in time is corrected along the change, so that the work is the change of E (Gonzalez, J.
    Nonlinear Sci. 6 (1996) 449-467). The derivatives are made symmetric.
    """
    a, b, _, _ = without_lag(ends[0], ends[2], first, second)
    c, d, first, second = without_lag(ends[1], ends[3], first, second)
    ends = a, c, b, d
    if a == b and c == d:  # at an instant
        _, means, pairs = excess_means(stiffness, rate, a, c)
        scale = 0.5 * (first + second)
        return means, (scale * pairs[0], scale * pairs[1], scale * pairs[2])
    highest = max(ends)
    near = far = first_pair = mixed = last_pair = 0.0
    if highest <= 0.0:
        return (near, far), (first_pair, mixed, last_pair)
    # the means are smooth in time between the moments at which the ends open or close
    one, other = crossing(a, b), crossing(c, d)
    breaks = 0.0, min(one, other), max(one, other), 1.0
    for piece in range(3):
        length = breaks[piece + 1] - breaks[piece]
        if length <= 0.0:
            continue
        for k in range(len(TIME_POINTS)):
            time, weight = breaks[piece] + TIME_POINTS[k] * length, TIME_WEIGHTS[k] * length
            p, q = a + time * (b - a), c + time * (d - c)
            _, (n0, n1), (k00, k01, k11) = excess_means(stiffness, rate, p, q)
            near += weight * n0
            far += weight * n1
            scale = weight * (first + time * (second - first))
            first_pair += scale * k00
            mixed += scale * k01
            last_pair += scale * k11
    means, pairs = (near, far), (first_pair, mixed, last_pair)
    room = max(1.0 / rate - highest, (1.0 - LARGEST_CLOSING) / rate)
    if max(abs(b - a), abs(d - c)) <= SMALL_CHANGE * min(highest, room):
        return means, pairs
    return _conserve_energy(stiffness, rate, ends, (first, second), (means, pairs))


@kernel
def _conserve_energy(stiffness, rate, ends, rates, results):  # type: ignore
    """Correct means over a step, so that their work is the change of energy, and derivatives.

    Each mean is corrected in proportion to itself and to the change of its closing.
    """
    (a, c, b, d), (first, second), ((near, far), (k00, k01, k11)) = ends, rates, results
    x, y, turn = b - a, d - c, second - first
    scale = near * x * x + far * y * y
    if scale <= 0.0:
        return results
    before, (f0, f1), _ = excess_means(stiffness, rate, a, c)
    after, (l0, l1), _ = excess_means(stiffness, rate, b, d)
    factor = (after - before - near * x - far * y) / scale
    # derivatives of the factor by both ends
    by_near = second * l0 - first * f0 - k00 * x - k01 * y - turn * near
    by_far = second * l1 - first * f1 - k01 * x - k11 * y - turn * far
    by_near -= factor * (k00 * x * x + k01 * y * y + 2.0 * turn * near * x)
    by_far -= factor * (k01 * x * x + k11 * y * y + 2.0 * turn * far * y)
    by_near, by_far = by_near / scale, by_far / scale
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
