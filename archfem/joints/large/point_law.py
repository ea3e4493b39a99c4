"""The contact law at a place and along a facet, over a step, compiled.

The law of `archfem.joints.contact_law`, written for loops: every compiled kernel of joints takes
tractions, energies, limits of the shear and their derivatives from here. A contact is a record with
the parameters of `ContactLaw`, or one that has these among its fields. Normal tractions come with
what a joint releases as it opens: the traction of a spring that is never open, less the true one.
"""

from typing import Any

import numpy as np

from archfem._numba import inlined_kernel, kernel
from archfem.joints.contact_law import SLIP_LIMIT_TOLERANCE, ContactLaw
from archfem.joints.large.closing_law import excess_means, facet_step_excess, point_step_excess
from archfem.joints.normal_law import GAUSS_POINTS, GAUSS_WEIGHTS

# Parameters of the law at one place
CONTACT_RECORD: np.dtype[Any] = np.dtype([(name, np.float64) for name in ContactLaw._fields])


@inlined_kernel
def releases(contact, gaps):  # type: ignore
    """Return whether a joint releases anything on the way between gaps: where it is not linear."""
    return max(gaps) > 0.0 or contact.closing_rate > 0.0


@inlined_kernel
def joint_means(contact, ends, first, second, facet):  # type: ignore
    """Return means over a step at a place, or times φ_i along a facet of unit length.

    Gaps of the facet's ends move from (a, c) to (b, d) in the step, at the rates `first` and
    `second`; a place moves from a to b. The means are of the traction, of the release, the rate of
    that, the fraction closed, and its rate. Rates of a facet are of (1, 1), (1, 2) and (2, 2).
    """
    means = linear_means(contact, ends, first, second, facet)
    if contact.closing_rate > 0.0:
        return _add_excess(contact, ends, (first, second), facet, means)
    return means


@inlined_kernel
def linear_means(contact, ends, first, second, facet):  # type: ignore
    """Return `joint_means` of the linear law."""
    if facet:
        return _facet_means(contact, ends, first, second)
    normal, taken, rate, time, moves = _point_means(contact, ends[0], ends[2], first, second)
    return (normal, 0.0), (taken, 0.0), (rate, 0.0, 0.0), (time, 0.0), (moves, 0.0, 0.0)


@inlined_kernel
def _add_excess(contact, ends, rates, facet, means):  # type: ignore
    """Return `joint_means` with the traction by which a joint exceeds the linear law."""
    if not facet:
        return add_point_excess(contact, ends, rates, means)
    stiffness, rate = contact.normal_stiffness, contact.closing_rate
    closings = -ends[0], -ends[1], -ends[2], -ends[3]
    (near, far), (k00, k01, k11) = facet_step_excess(stiffness, rate, closings, rates[0], rates[1])
    normal, taken, slopes, time, moves = means
    normal, taken = (normal[0] - near, normal[1] - far), (taken[0] + near, taken[1] + far)
    return normal, taken, (slopes[0] - k00, slopes[1] - k01, slopes[2] - k11), time, moves


@inlined_kernel
def add_point_excess(contact, ends, rates, means):  # type: ignore
    """Return `joint_means` at a place, with the traction beyond the linear law."""
    stiffness, rate = contact.normal_stiffness, contact.closing_rate
    more, slope = point_step_excess(stiffness, rate, -ends[0], -ends[2], rates[0], rates[1])
    normal, taken, slopes, time, moves = means
    normal, taken = (normal[0] - more, normal[1]), (taken[0] + more, taken[1])
    return normal, taken, (slopes[0] - slope, slopes[1], slopes[2]), time, moves


@inlined_kernel
def _point_means(contact, a, b, first, second):  # type: ignore
    """Return `joint_means` at a place."""
    stiffness = contact.normal_stiffness
    half = 0.5 * stiffness
    if a <= 0.0 and b <= 0.0:
        return half * (a + b), 0.0, 0.0, 1.0, 0.0
    if a > 0.0 and b > 0.0:
        return 0.0, half * (a + b), half * (first + second), 0.0, 0.0
    # the place opens or closes during the step: fractions of it open and closed
    total = abs(a) + abs(b)
    opened, closed = max(a, b) / total, -min(a, b) / total
    square = 0.5 * opened**2
    if a > 0.0:
        rate = first * (opened - square) + second * square
        moves = -(first * closed + second * opened) / total
    else:
        rate = first * square + second * (opened - square)
        moves = -(first * opened + second * closed) / total
    return half * min(a, b) * closed, half * max(a, b) * opened, stiffness * rate, closed, moves


@inlined_kernel
def _facet_means(contact, ends, first, second):  # type: ignore
    """Return `joint_means` along a facet."""
    if max(ends) <= 0.0 or min(ends) > 0.0:
        return _uniform_means(contact, ends, 0.5 * (first + second))
    return _divided_means(contact, ends, first, second)


@kernel
def _divided_means(contact, ends, first, second):  # type: ignore
    """Return `joint_means` of a facet of which parts are open, or open or close in the step."""
    a, c, b, d = ends
    # Gauss's rule between the zero crossings, with sums for φ_0 and φ_1 and their products
    _, _, breaks = _zero_crossings(ends)
    normals = taken = times = (0.0, 0.0)
    rates = moves = (0.0, 0.0, 0.0)
    for piece in range(3):
        length = breaks[piece + 1] - breaks[piece]
        if length <= 0.0:
            continue
        for k in range(len(GAUSS_POINTS)):
            place = breaks[piece] + GAUSS_POINTS[k] * length
            near, far = 1.0 - place, place
            before, after = near * a + far * c, near * b + far * d
            means = _point_means(contact, before, after, first, second)
            weight = GAUSS_WEIGHTS[k] * length
            normals = _add_ends(normals, weight * means[0], near, far)
            taken = _add_ends(taken, weight * means[1], near, far)
            rates = _add_pairs(rates, weight * means[2], near, far)
            times = _add_ends(times, weight * means[3], near, far)
            moves = _add_pairs(moves, weight * means[4], near, far)
    return normals, taken, rates, times, moves


@inlined_kernel
def _add_ends(sums, value, near, far):  # type: ignore
    """Add a value times φ_1 and φ_2 to sums."""
    return sums[0] + near * value, sums[1] + far * value


@inlined_kernel
def _add_pairs(sums, value, near, far):  # type: ignore
    """Add a value times φ_1 φ_1, φ_1 φ_2 and φ_2 φ_2 to sums."""
    return sums[0] + near * near * value, sums[1] + near * far * value, sums[2] + far * far * value


@inlined_kernel
def _zero_crossings(ends):  # type: ignore
    """Return zero crossings of a facet at start and end, 0 for none, and the ends of its parts."""
    a, c, b, d = ends
    low = a / (a - c) if (a <= 0.0) != (c <= 0.0) else 0.0
    high = b / (b - d) if (b <= 0.0) != (d <= 0.0) else 0.0
    return low, high, (0.0, min(low, high), max(low, high), 1.0)


@inlined_kernel
def _uniform_means(contact, ends, rate):  # type: ignore
    """Return `joint_means` of a facet that is closed, or open, all over and all the step."""
    a, c, b, d = ends
    stiffness = contact.normal_stiffness / 12.0
    near, far, rate = stiffness * (a + b), stiffness * (c + d), 2.0 * stiffness * rate
    means, none, fixed = (2.0 * near + far, near + 2.0 * far), (0.0, 0.0), (0.0, 0.0, 0.0)
    if max(ends) <= 0.0:
        return means, none, fixed, (0.5, 0.5), fixed
    return none, means, (2.0 * rate, rate, 2.0 * rate), none, fixed


@inlined_kernel
def mean_tractions(contact, ends, lag, facet):  # type: ignore
    """Return means of the traction as `joint_means`, and their derivatives by gaps at the end."""
    # open during the whole step; what a joint presses beyond the linear law has no lag
    if min(ends) > 0.0 and contact.closing_rate == 0.0:
        return (0.0, 0.0), (0.0, 0.0, 0.0)
    whole = (0.5 + lag) * contact.normal_stiffness
    if facet and contact.closing_rate == 0.0:
        if max(ends) > 0.0:
            return _divided_tractions(contact, ends, lag)
        normal = _uniform_means(contact, ends, 0.0)[0]
        return normal, (whole / 3.0, whole / 6.0, whole / 3.0)
    # the derivative is that of a spring which is never open, less that of the release
    normal, _, rates, _, _ = joint_means(contact, ends, lag, 1.0 + lag, facet)
    if facet:
        return normal, (whole / 3.0 - rates[0], whole / 6.0 - rates[1], whole / 3.0 - rates[2])
    return normal, (whole - rates[0], 0.0, 0.0)


@kernel
def _divided_tractions(contact, ends, lag):  # type: ignore
    """Return `mean_tractions` of the linear law along a facet of which parts are open."""
    # as `_divided_means`, with no derivatives but those that the traction needs
    a, c, b, d = ends
    _, _, breaks = _zero_crossings(ends)
    whole, normals, rates = (0.5 + lag) * contact.normal_stiffness, (0.0, 0.0), (0.0, 0.0, 0.0)
    for piece in range(3):
        begin, length = breaks[piece], breaks[piece + 1] - breaks[piece]
        middle = begin + 0.5 * length
        is_open = a + middle * (c - a) > 0.0 and b + middle * (d - b) > 0.0
        if length <= 0.0 or is_open:
            continue
        for k in range(len(GAUSS_POINTS)):
            place = begin + GAUSS_POINTS[k] * length
            near, far = 1.0 - place, place
            before, after = near * a + far * c, near * b + far * d
            mean, _, taken, _, _ = _point_means(contact, before, after, lag, 1.0 + lag)
            weight = GAUSS_WEIGHTS[k] * length
            normals = _add_ends(normals, weight * mean, near, far)
            rates = _add_pairs(rates, weight * (whole - taken), near, far)
    return normals, rates


@inlined_kernel
def damping_tractions(contact, ends, lag, facet):  # type: ignore
    """Return means of what the lag of damping adds to the traction, from gaps without it."""
    a, c, b, d = ends
    p, q = lag * (b - a), lag * (d - c)
    if facet and max(ends) <= 0.0 and max(a + p, c + q, b + p, d + q) <= 0.0:
        return (
            contact.normal_stiffness / 6.0 * (2.0 * p + q),
            contact.normal_stiffness / 6.0 * (p + 2.0 * q),
        )
    n0, n1 = linear_means(contact, (a + p, c + q, b + p, d + q), lag, 1.0 + lag, facet)[0]
    m0, m1 = linear_means(contact, ends, 0.0, 1.0, facet)[0]
    return n0 - m0, n1 - m1


@inlined_kernel
def closed_means(contact, ends, lag, facet):  # type: ignore
    """Return means of the closed fraction as `joint_means`, and their derivatives."""
    a, c, _, _ = ends
    _, _, _, time, rates = linear_means(contact, ends, lag, 1.0 + lag, facet)
    # at an instant the end of the closed part of a facet moves
    low, high, _ = _zero_crossings(ends)
    if facet and low == high and 0.0 < low < 1.0:
        rates = _add_pairs(rates, -(0.5 + lag) / abs(a - c), 1.0 - low, low)
    return time, rates


@inlined_kernel
def point_energy(contact, gap):  # type: ignore
    """Return the energy stored at a place, and its derivative, the traction."""
    gap = min(gap, 0.0)
    traction = contact.normal_stiffness * gap
    energy = 0.5 * traction * gap
    if contact.closing_rate > 0.0:
        mean, (near, far), _ = _excess_between(contact, gap, gap)
        return energy + mean, traction - near - far
    return energy, traction


@inlined_kernel
def _excess_between(contact, first, last):  # type: ignore
    """Return `excess_means` between two gaps."""
    return excess_means(contact.normal_stiffness, contact.closing_rate, -first, -last)


@inlined_kernel
def instant_release(contact, gaps, facet):  # type: ignore
    """Return the release of `joint_means` at an instant, and the energy that it does not store."""
    taken = linear_means(contact, gaps, 1.0, 1.0, facet)[1]
    energy = 0.5 * (gaps[0] * taken[0] + gaps[1] * taken[1])
    if contact.closing_rate > 0.0:
        mean, (near, far), _ = _excess_between(contact, gaps[0], gaps[1] if facet else gaps[0])
        if facet:
            return (taken[0] + near, taken[1] + far), energy - mean
        return (taken[0] + near + far, taken[1]), energy - mean
    return taken, energy


@inlined_kernel
def facet_energy(contact, first, last):  # type: ignore
    """Return the energy of a facet of unit length, its force, and its moment about the middle."""
    # closed from the end that is pressed most, over this share of the length
    low, high = min(first, last), max(first, last)
    share = 1.0 if high <= 0.0 else (low / (low - high) if low < 0.0 else 0.0)
    # with the gap at the other end, or 0 where the closed part ends before
    high = min(high, 0.0)
    third = contact.normal_stiffness / 6.0 * share
    near, far = third * (2.0 * low + high), third * (low + 2.0 * high)
    near, far = near + (1.0 - share) * far, share * far
    if first > last:
        near, far = far, near
    energy = 0.5 * (first * near + last * far)
    if contact.closing_rate > 0.0:
        mean, (one, other), _ = _excess_between(contact, first, last)
        energy, near, far = energy + mean, near - one, far - other
    return energy, near + far, 0.5 * (far - near)


@inlined_kernel
def limit_rate(contact, normal, closed):  # type: ignore
    """Return the derivative of `shear_limit` from those of its arguments."""
    return contact.cohesion * closed - contact.friction * normal


@inlined_kernel
def shear_limit(contact, normal, closed):  # type: ignore
    """Return Coulomb's limit of the shear from a normal force and the closed area."""
    return contact.resistance + max(limit_rate(contact, normal, closed), 0.0)


@inlined_kernel
def shear_means(first, change, lag, limit):  # type: ignore
    """Return mean shear over a step, what slip loses of it, derivatives by change and limit, loss.

    The loss is an energy times the shear stiffness. A point that sticks during the whole step has
    the derivatives 1/2 + lag and 0.
    """
    trial = first + (0.5 + lag) * change
    stuck = max(abs(first), abs(first + change), abs(trial)) <= limit
    # at an instant, also within the tolerance of the limit
    if stuck or (change == 0.0 and abs(first) <= (1.0 + SLIP_LIMIT_TOLERANCE) * limit):
        return trial, 0.0, 0.5 + lag, 0.0, lag * change * change
    means = _sliding_means(first, change, lag, limit)
    # slips at an instant: the shear follows the limit
    if change == 0.0 and abs(first) > limit:
        return means[0], means[1], 0.0, np.sign(means[0]), means[4]
    return means


@kernel
def _sliding_means(first, change, lag, limit):  # type: ignore
    """Return `shear_means` of a point that slips during a step."""
    # elastic shear at the start and the end, clipped to the limit
    start = min(max(first, -limit), limit)
    last = min(max(start + change, -limit), limit)
    # fraction of the step in which the point slips
    over = start + change - last
    slid = min(max(over / change, 0.0), 1.0) if over != 0.0 and change != 0.0 else 0.0
    # mean shear, with damping clipped to the limit
    mean = start + 0.5 * change - 0.5 * over * slid
    shear = min(max(mean + lag * change, -limit), limit)
    # derivatives by the elastic change and by the limit
    if abs(mean + lag * change) > limit:
        by_change, by_limit = 0.0, np.sign(shear)
    else:
        lost = np.sign(first) if abs(first) > limit else 0.0
        by_change = 0.5 * (1.0 - slid) ** 2 + lag
        by_limit = (1.0 - slid) * lost + slid * np.sign(change)
    # loss: excess at the start, friction, damping
    rubbing = 0.5 * (first**2 - start**2) + abs(over) * limit + (shear - mean) * change
    return shear, first + change - last, by_change, by_limit, rubbing
