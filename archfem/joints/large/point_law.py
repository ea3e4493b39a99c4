"""The contact law at a place and along a facet, over a step, compiled.

The law of `archfem.joints.contact_law`, written for loops: every compiled kernel of joints takes
tractions, energies, limits of the shear and their derivatives from here. A contact is a record with
the parameters of `ContactLaw`, or one that has these among its fields. Normal tractions come with
what a joint releases as it opens: the traction of a spring that is never open, less the true one.
"""

from typing import Any

import numpy as np

from archfem._numba import inlined_kernel, kernel
from archfem.joints.contact_law import COHESIVE_OPENING, SLIP_LIMIT_TOLERANCE, ContactLaw
from archfem.joints.large.closing_law import excess_means, facet_step_excess, point_step_excess
from archfem.joints.large.lanes import any_lane, greatest, least, select
from archfem.joints.normal_law import GAUSS_POINTS, GAUSS_WEIGHTS

# Parameters of the law at one place
CONTACT_RECORD: np.dtype[Any] = np.dtype([(name, np.float64) for name in ContactLaw._fields])

# Least divisor: its inverse is a number, unlike that of zero or of a denormal number
LEAST_DIVISOR = 1e-300


@inlined_kernel
def releases(contact, gaps):  # type: ignore
    """Return whether a joint releases anything on the way between gaps: where it is not linear."""
    return max(gaps) > 0.0 or contact.closing_rate > 0.0


@inlined_kernel
def joint_means(contact, ends, first, second, facet):  # type: ignore
    """Return means over a step at a place, or times φ_i along a facet of unit length.

    Gaps of the facet's ends move from (a, c) to (b, d) in the step, at the rates `first` and
    `second`; a place moves from a to b. The means are of the traction, of the release, and the rate
    of that. Rates of a facet are of (1, 1), (1, 2) and (2, 2).
    """
    normal, taken, rates, _, _ = linear_means(contact, ends, first, second, facet)
    if contact.closing_rate == 0.0:
        return normal, taken, rates
    more, k = _step_excess(contact, ends, (first, second), facet)
    normal, taken = (
        (normal[0] - more[0], normal[1] - more[1]),
        (taken[0] + more[0], taken[1] + more[1]),
    )
    return normal, taken, (rates[0] - k[0], rates[1] - k[1], rates[2] - k[2])


@inlined_kernel
def _step_excess(contact, ends, rates, facet):  # type: ignore
    """Return means over a step of the traction beyond the linear law, and its derivatives."""
    stiffness, rate, (first, second) = contact.normal_stiffness, contact.closing_rate, rates
    if facet:
        closings = -ends[0], -ends[1], -ends[2], -ends[3]
        return facet_step_excess(stiffness, rate, closings, first, second)
    more, slope = point_step_excess(stiffness, rate, -ends[0], -ends[2], first, second)
    return (more, 0.0), (slope, 0.0, 0.0)


@inlined_kernel
def linear_means(contact, ends, first, second, facet):  # type: ignore
    """Return `joint_means` of the linear law, the fraction closed, and its rate."""
    if facet:
        return _facet_means(contact, ends, first, second)
    normal, taken, rate, time, moves = _point_means(contact, ends[0], ends[2], first, second)
    return (normal, 0.0), (taken, 0.0), (rate, 0.0, 0.0), (time, 0.0), (moves, 0.0, 0.0)


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
    return _means_by_parts(contact, ends, first, second)


@kernel
def _means_by_parts(contact, ends, first, second):  # type: ignore
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
    """Return means of the traction as `linear_means`, and their derivatives by gaps at the end.

    Gaps are shifted by the lag; the excess over the linear law has none.
    """
    stiffness = contact.normal_stiffness
    if facet:
        means, rates = linear_tractions(stiffness, ends, lag)
    else:
        # the derivative is that of a spring which is never open, less that of the release
        normal, _, taken, _, _ = _point_means(contact, ends[0], ends[2], lag, 1.0 + lag)
        means, rates = (normal, 0.0), ((0.5 + lag) * stiffness - taken, 0.0, 0.0)
    if contact.closing_rate == 0.0:
        return means, rates
    more, k = _step_excess(contact, ends, (lag, 1.0 + lag), facet)
    means = means[0] - more[0], means[1] - more[1]
    return means, (rates[0] + k[0], rates[1] + k[1], rates[2] + k[2])


@inlined_kernel
def linear_tractions(stiffness, ends, lag):  # type: ignore
    """Return means over a step of the linear traction times φ_i along a facet, and derivatives.

    The derivatives are those of `mean_tractions`.
    """
    a, c, b, d = ends
    whole, none = (0.5 + lag) * stiffness, 0.0 * stiffness
    if not any_lane(greatest(greatest(a, c), greatest(b, d)) > 0.0):  # closed
        share = stiffness * (1 / 12)
        near, far, third = share * (a + b), share * (c + d), whole * (1 / 3)
        return (2.0 * near + far, near + 2.0 * far), (third, 0.5 * third, third)
    if not any_lane(least(least(a, c), least(b, d)) <= 0.0):  # open
        return (none, none), (none, none, none)
    # zero crossings at start and end divide the facet into three parts, of which one at most is
    # closed all the time
    low = select((a <= 0.0) ^ (c <= 0.0), a / (a - c), 0.0)
    high = select((b <= 0.0) ^ (d <= 0.0), b / (b - d), 0.0)
    one, two = least(low, high), greatest(low, high)
    first_closed, first_moves = _part_state(ends, 0.0, one)
    second_closed, second_moves = _part_state(ends, one, two)
    third_closed, third_moves = _part_state(ends, two, 1.0)
    begin = select(first_closed, 0.0, select(second_closed, one, two))
    end = select(first_closed, one, select(second_closed, two, 1.0))
    length = select(first_closed | second_closed | third_closed, end - begin, 0.0)
    # ∫ of products of linear functions between both ends of that part
    p0, p1, begun, slope = 1.0 - begin, 1.0 - end, a + b, c + d - a - b
    s0, s1 = begun + begin * slope, begun + end * slope
    share = stiffness * length * (1 / 12)
    near = share * (s0 * (2.0 * p0 + p1) + s1 * (p0 + 2.0 * p1))
    far = share * (s0 * (2.0 * begin + end) + s1 * (begin + 2.0 * end))
    share = whole * length * (1 / 6)
    k00 = 2.0 * share * (p0 * p0 + p0 * p1 + p1 * p1)
    k01 = share * (2.0 * p0 * begin + p0 * end + p1 * begin + 2.0 * p1 * end)
    k11 = 2.0 * share * (begin * begin + begin * end + end * end)
    sums = near, far, k00, k01, k11
    if any_lane(first_moves):
        sums = _add_crossing(stiffness, ends, lag, (first_moves, 0.0, one), sums)
    if any_lane(second_moves):
        sums = _add_crossing(stiffness, ends, lag, (second_moves, one, two), sums)
    if any_lane(third_moves):
        sums = _add_crossing(stiffness, ends, lag, (third_moves, two, 1.0), sums)
    return (sums[0], sums[1]), (sums[2], sums[3], sums[4])


@inlined_kernel
def _part_state(ends, begin, end):  # type: ignore
    """Return whether a part of a facet is closed during a step, and whether it opens or closes."""
    (a, c, b, d), middle = ends, 0.5 * (begin + end)
    before, after = a + middle * (c - a) <= 0.0, b + middle * (d - b) <= 0.0
    is_part = begin < end
    return is_part & before & after, is_part & (before ^ after)


@inlined_kernel
def _add_crossing(stiffness, ends, lag, part, sums):  # type: ignore
    """Add the means of a part that opens or closes during the step, by Gauss's rule."""
    (a, c, b, d), (moves, begin, end), (near, far, k00, k01, k11) = ends, part, sums
    length, whole = select(moves, end - begin, 0.0), (0.5 + lag) * stiffness
    for k in range(len(GAUSS_POINTS)):
        y = begin + GAUSS_POINTS[k] * length
        x = 1.0 - y
        before, after = x * a + y * c, x * b + y * d
        # at rest a part is as short as rounding, and both gaps may vanish there
        inverse = 1.0 / greatest(abs(before) + abs(after), LEAST_DIVISOR)
        closing, opened = least(before, after), greatest(before, after) * inverse
        square = 0.5 * opened * opened
        taken = select(
            before > 0.0,
            lag * (opened - square) + (1.0 + lag) * square,
            lag * square + (1.0 + lag) * (opened - square),
        )
        weight = GAUSS_WEIGHTS[k] * length
        mean = -0.5 * weight * stiffness * closing * closing * inverse
        rate = weight * (whole - stiffness * taken)
        near, far = near + x * mean, far + y * mean
        k00, k01, k11 = k00 + x * x * rate, k01 + x * y * rate, k11 + y * y * rate
    return near, far, k00, k01, k11


@inlined_kernel
def damping_tractions(contact, ends, lag, facet):  # type: ignore
    """Return means of the traction that the lag of damping adds, from gaps without it."""
    a, c, b, d = ends
    p, q = lag * (b - a), lag * (d - c)
    stiffness, lagged = contact.normal_stiffness, (a + p, c + q, b + p, d + q)
    if not facet:
        later = _point_means(contact, lagged[0], lagged[2], lag, 1.0 + lag)[0]
        return later - _point_means(contact, a, b, 0.0, 1.0)[0], 0.0
    (n0, n1), _ = linear_tractions(stiffness, lagged, lag)
    (m0, m1), _ = linear_tractions(stiffness, ends, 0.0)
    return n0 - m0, n1 - m1


@inlined_kernel
def closed_means(contact, ends, lag, facet):  # type: ignore
    """Return means of the fraction that coheres as `joint_means`, and their derivatives."""
    reach = COHESIVE_OPENING * contact.cohesion / contact.normal_stiffness
    a, c, b, d = ends
    ends = a - reach, c - reach, b - reach, d - reach
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
    energy, force, moment = linear_energy(contact.normal_stiffness, first, last)
    if contact.closing_rate > 0.0:
        mean, (near, far), _ = _excess_between(contact, first, last)
        energy, force, moment = energy + mean, force - near - far, moment + 0.5 * (near - far)
    return energy, force, moment


@inlined_kernel
def linear_energy(stiffness, first, last):  # type: ignore
    """Return `facet_energy` of the linear law."""
    # closed from the end that is pressed most, over a share of the length
    low, high = least(first, last), greatest(first, last)
    share = select(high <= 0.0, 1.0, select(low < 0.0, low / (low - high), 0.0))
    # with the gap at the other end, or 0 where the closed part ends before
    high = least(high, 0.0)
    third = stiffness * (1 / 6) * share
    near, far = third * (2.0 * low + high), third * (low + 2.0 * high)
    near, far = near + (1.0 - share) * far, share * far
    is_turned = first > last
    near, far = select(is_turned, far, near), select(is_turned, near, far)
    return 0.5 * (first * near + last * far), near + far, 0.5 * (far - near)


@inlined_kernel
def limit_rate(contact, normal, closed):  # type: ignore
    """Return the derivative of `shear_limit` from those of its arguments."""
    return contact.cohesion * closed - contact.friction * normal


@inlined_kernel
def shear_limit(contact, normal, closed):  # type: ignore
    """Return Coulomb's limit of the shear from a normal force and the closed area."""
    return contact.resistance + max(limit_rate(contact, normal, closed), 0.0)


@inlined_kernel
def sign(x):  # type: ignore
    """Return the sign of a number, 0 of 0."""
    return select(x > 0.0, 1.0, select(x < 0.0, -1.0, 0.0))


@inlined_kernel
def _clip(x, limit):  # type: ignore
    """Return a number clipped to ± a limit."""
    return least(greatest(x, -limit), limit)


@inlined_kernel
def shear_means(first, change, lag, limit):  # type: ignore
    """Return mean shear over a step, its loss by slip, derivatives by change and limit, loss.

    The loss is an energy times the shear stiffness. A point that sticks during the whole step has
    the derivatives 1/2 + lag and 0.
    """
    shear = first + (0.5 + lag) * change
    most = greatest(greatest(abs(first), abs(first + change)), abs(shear))
    # at an instant, beyond the tolerance of the limit
    moves = (change != 0.0) | (abs(first) > (1.0 + SLIP_LIMIT_TOLERANCE) * limit)
    slides, none = (most > limit) & moves, 0.0 * first
    means = shear, none, none + 0.5 + lag, none, lag * change * change
    if any_lane(slides):
        means = _select_means(slides, _sliding_means(first, change, lag, limit), means)
    return means


@inlined_kernel
def _select_means(mask, one, other):  # type: ignore
    """Return the first means where a condition holds, else the second."""
    return (
        select(mask, one[0], other[0]),
        select(mask, one[1], other[1]),
        select(mask, one[2], other[2]),
        select(mask, one[3], other[3]),
        select(mask, one[4], other[4]),
    )


@inlined_kernel
def _sliding_means(first, change, lag, limit):  # type: ignore
    """Return `shear_means` of a point that slips during a step, or at an instant."""
    # elastic shear at the start and the end, clipped to the limit
    start = _clip(first, limit)
    trial, moves = start + change, change != 0.0
    last = _clip(trial, limit)
    # fraction of the step in which the point slips
    over = trial - last
    slid = least(greatest(over / select(moves, change, 1.0), 0.0), 1.0)
    slid = select((over != 0.0) & moves, slid, 0.0)
    # mean shear, with damping clipped to the limit
    mean = start + 0.5 * change - 0.5 * over * slid
    damped = mean + lag * change
    shear, held = _clip(damped, limit), 1.0 - slid
    # slips at the limit all the step, or at an instant: the shear follows the limit
    follows = (abs(damped) > limit) | ((change == 0.0) & (abs(first) > limit))
    lost = select(abs(first) > limit, sign(first), 0.0)
    by_change = select(follows, 0.0, 0.5 * held * held + lag)
    by_limit = select(follows, sign(shear), held * lost + slid * sign(change))
    # loss: excess at the start, friction, damping
    rubbing = 0.5 * (first * first - start * start) + abs(over) * limit + (shear - mean) * change
    return shear, first + change - last, by_change, by_limit, rubbing
