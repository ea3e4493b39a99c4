"""The contact law on the overlaps of eight joints at a time, over a step, compiled.

The law is that of `overlap_law`, written for `lanes`: where joints differ, both ways are computed,
and `select` takes one. Faces do not stretch, and each joint is one segment of as many points.
Cohesive joints, and those that are no facets, press by `point_law`, joint by joint.
"""

from typing import NamedTuple

import numpy as np

from archfem._numba import inlined_kernel, kernel
from archfem._typing import Array
from archfem.joints.contact_law import SLIP_LIMIT_TOLERANCE
from archfem.joints.large.closing_law import excess_means, facet_step_excess
from archfem.joints.large.lanes import (
    WIDTH,
    any_lane,
    greatest,
    lane,
    least,
    load,
    select,
    spread,
    store,
    with_lane,
)
from archfem.joints.large.overlap_law import (
    ROUNDED_SLIP,
    FaceLaw,
    about_mean_middle,
    closing_energy,
    friction_limits,
)
from archfem.joints.large.point_law import damping_tractions, mean_tractions
from archfem.joints.normal_law import GAUSS_POINTS, GAUSS_WEIGHTS

# Rows of the parameters of joints: depth, k_n, μ, the limit where open, of both ends of the overlap
# the slip at which faces end together, and R of it, and 1/δ_m
DEPTH, STIFFNESS, FRICTION, RESISTANCE, RIGHT_SLIP, RIGHT_SIZE, LEFT_SLIP, LEFT_SIZE = range(8)
RATE = 8

# 1/δ_m of linear joints among others, which exceed the linear law by less than rounding [1/m]
LINEAR_RATE = 1e-30


class LaneLaw(NamedTuple):
    """Parameters of the law of all joints; those of lanes without a joint do not matter."""

    face_law: FaceLaw
    joint: Array  # rows of parameters (9, j)
    place: Array  # x of the points (p, j) [-]
    share: Array  # width times the part of the depth of a point, or of its facet (p, j) [m]
    spring: Array  # k_s times the area of each point (p, j) [N/m]
    flexibility: Array  # and its inverse [m/N]
    by_lanes: bool  # whether all joints have facets without cohesion
    stiffens: bool  # whether any of them stiffens as it closes


def lane_law(law: FaceLaw) -> LaneLaw:
    """Return the parameters of joints with as many points each."""
    count, contacts = len(law.depth), law.contacts
    size, points = pad(count), int(law.first_point[1])
    rows, bend = np.ones((9, size)), ROUNDED_SLIP * law.depth
    ends = law.end_slip.T
    sizes = np.abs(ends)
    sizes = np.where(sizes < bend, 0.5 * ends**2 / bend, sizes - 0.5 * bend)
    rows[:, :count] = [
        *(law.depth, contacts["normal_stiffness"], contacts["friction"], contacts["resistance"]),
        *(ends[0], sizes[0], ends[1], sizes[1]),
        np.maximum(contacts["closing_rate"], LINEAR_RATE),
    ]
    rows[STIFFNESS, count:] = 0.0
    of_points, spring = np.ones((4, points, size)), law.shear_spring
    values = law.place, law.width * law.depth_share, spring, 1.0 / spring
    of_points[:, :, :count] = np.swapaxes(np.reshape(values, (4, count, points)), 1, 2)
    kind = bool(law.facets and not contacts["cohesion"].any()), bool(contacts["closing_rate"].any())
    return LaneLaw(law, rows, *of_points, *kind)  # type: ignore[call-arg]


def pad(count: int) -> int:
    """Return the least multiple of the number of lanes that is not below a number."""
    return -(-count // WIDTH) * WIDTH


@inlined_kernel
def _sign(x):  # type: ignore
    """Return the signs of numbers, 0 of 0."""
    return select(x > 0.0, 1.0, select(x < 0.0, -1.0, 0.0))


@inlined_kernel
def _clip(x, limit):  # type: ignore
    """Return numbers clipped to ± a limit."""
    return least(greatest(x, -limit), limit)


@inlined_kernel
def _rounded_size(bend, slip):  # type: ignore
    """Return R(s) and its derivative, with the slip below which |s| is rounded."""
    size, share = abs(slip), slip * (1.0 / bend)
    is_small = size < bend
    return (
        select(is_small, 0.5 * slip * share, size - 0.5 * bend),
        select(is_small, share, _sign(slip)),
    )


@inlined_kernel
def lane_overlap(law, at, slip):  # type: ignore
    """Return length and middle of the overlaps, each with its derivative by the slip."""
    depth = load(law.joint, DEPTH, at)
    bend = ROUNDED_SLIP * depth
    right, right_rate = _rounded_size(bend, slip - load(law.joint, RIGHT_SLIP, at))
    left, left_rate = _rounded_size(bend, slip - load(law.joint, LEFT_SLIP, at))
    right, left = right - load(law.joint, RIGHT_SIZE, at), left - load(law.joint, LEFT_SIZE, at)
    rest = depth - 0.5 * (right + left)
    is_left = rest > 0.0
    length = select(is_left, rest, 0.0), select(is_left, -0.5 * (right_rate + left_rate), 0.0)
    return length, (0.25 * (right - left), 0.25 * (right_rate - left_rate))


@inlined_kernel
def _size_slope(bend, before, after):  # type: ignore
    """Return ΔR/Δs over a step, and its derivative by the slip at the end."""
    (first, r0), (last, r1) = _rounded_size(bend, before), _rounded_size(bend, after)
    moved, is_small = after - before, greatest(abs(before), abs(after)) < bend
    slope = (last - first) / moved
    # beyond, on one side of zero slip, or without slip, it is the derivative
    is_rate = (r0 == r1) | (abs(moved) <= 1e-12 * (abs(before) + abs(after)))
    bends = select(is_rate, 0.0, (r1 - slope) / moved)
    slope = select(is_rate, r1, slope)
    return (
        select(is_small, 0.5 * (before + after) / bend, slope),
        select(is_small, 0.5 / bend, bends),
    )


@inlined_kernel
def _overlap_slopes(law, at, slips, lengths):  # type: ignore
    """Return Δℓ/Δs and Δc/Δs over a step, each with its derivative by the slip at the end."""
    (before, after), (l0, (l1, shrinks)) = slips, lengths
    bend = ROUNDED_SLIP * load(law.joint, DEPTH, at)
    end = load(law.joint, RIGHT_SLIP, at)
    right, right_bend = _size_slope(bend, before - end, after - end)
    end = load(law.joint, LEFT_SLIP, at)
    left, left_bend = _size_slope(bend, before - end, after - end)
    slope, bends = -0.5 * (right + left), -0.5 * (right_bend + left_bend)
    parts = (l0 <= 0.0) | (l1 <= 0.0)
    if any_lane(parts):  # the faces part, or meet
        moved = after - before
        is_still = abs(moved) <= 1e-12 * (abs(before) + abs(after))
        whole = (l1 - l0) / moved
        slope = select(parts, select(is_still, shrinks, whole), slope)
        bends = select(parts, select(is_still, 0.0, (shrinks - whole) / moved), bends)
    return (slope, bends), (0.25 * (right - left), 0.25 * (right_bend - left_bend))


# ---- normal forces


@inlined_kernel
def _linear_tractions(stiffness, ends, lag):  # type: ignore
    """Return means of the traction times φ_i along a facet, and their derivatives.

    They are those of `point_law.mean_tractions`.
    """
    a, c, b, d = ends
    whole, none = (0.5 + lag) * stiffness, spread(0.0)
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
    is_part = spread(0.0) + begin < end
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
        inverse = 1.0 / select(moves, abs(before) + abs(after), 1.0)
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


@kernel
def _press_apart(law, point, at, ends, lag):  # type: ignore
    """Return means as `_linear_tractions`, and Coulomb's limits with rates, joint by joint."""
    face_law, none = law.face_law, spread(0.0)
    near, far, k00, k01, k11 = none, none, none, none, none
    near_limit, far_limit, m00, m01, m11 = none, none, none, none, none
    a, c, b, d = ends
    for k in range(min(WIDTH, len(face_law.depth) - at)):
        own, joint = (lane(a, k), lane(c, k), lane(b, k), lane(d, k)), at + k
        number = face_law.first_point[joint] + point
        pressed = mean_tractions(face_law.contacts[joint], own, lag, face_law.facets)
        limits, rates = friction_limits(face_law, number, joint, pressed, own, lag)
        near, far = with_lane(near, k, pressed[0][0]), with_lane(far, k, pressed[0][1])
        k00, k01 = with_lane(k00, k, pressed[1][0]), with_lane(k01, k, pressed[1][1])
        k11 = with_lane(k11, k, pressed[1][2])
        near_limit = with_lane(near_limit, k, limits[0])
        far_limit = with_lane(far_limit, k, limits[1])
        m00, m01 = with_lane(m00, k, rates[0]), with_lane(m01, k, rates[1])
        m11 = with_lane(m11, k, rates[2])
    return ((near, far), (k00, k01, k11)), ((near_limit, far_limit), (m00, m01, m11))


@inlined_kernel
def _press_facet(law, point, at, ends, lag, tractions):  # type: ignore
    """Return means of the traction, and Coulomb's limits, each with derivatives.

    Those of the linear law, on which damping depends, are stored.
    """
    # the gaps, shifted by the lag
    a, c, b, d = ends
    p, q = lag * (b - a), lag * (d - c)
    lagged = a + p, c + q, b + p, d + q
    if not law.by_lanes:
        return _press_apart(law, point, at, lagged, lag)
    stiffness = load(law.joint, STIFFNESS, at)
    (near, far), (k00, k01, k11) = _linear_tractions(stiffness, lagged, lag)
    store(tractions, point, at, near)
    store(tractions, point + 1, at, far)
    if law.stiffens:  # the excess has no lag
        rate, closings = load(law.joint, RATE, at), (-a, -c, -b, -d)
        excess, rates = facet_step_excess(stiffness, rate, closings, 0.0, 1.0)
        near, far = near - excess[0], far - excess[1]
        k00, k01, k11 = k00 + rates[0], k01 + rates[1], k11 + rates[2]
    scale = -load(law.joint, FRICTION, at) * load(law.share, point, at)
    limits = (scale * near, scale * far), (scale * k00, scale * k01, scale * k11)
    return ((near, far), (k00, k01, k11)), limits


@inlined_kernel
def _linear_energy(stiffness, first, last):  # type: ignore
    """Return energy, force and moment as `point_law.facet_energy`."""
    low, high = least(first, last), greatest(first, last)
    share = select(high <= 0.0, 1.0, select(low < 0.0, low / (low - high), 0.0))
    high = least(high, 0.0)
    third = stiffness * (1 / 6) * share
    near, far = third * (2.0 * low + high), third * (low + 2.0 * high)
    near, far = near + (1.0 - share) * far, share * far
    is_turned = first > last
    near, far = select(is_turned, far, near), select(is_turned, near, far)
    return 0.5 * (first * near + last * far), near + far, 0.5 * (far - near)


@kernel
def _energy_apart(law, at, length, opening, turn):  # type: ignore
    """Return `overlap_law.closing_energy` joint by joint."""
    energy = force = moment = spread(0.0)
    for k in range(min(WIDTH, len(law.face_law.depth) - at)):
        own = closing_energy(law.face_law, at + k, lane(length, k), lane(opening, k), lane(turn, k))
        energy, force = with_lane(energy, k, own[0]), with_lane(force, k, own[1])
        moment = with_lane(moment, k, own[2])
    return energy, force, moment


@inlined_kernel
def lane_energy(law, at, length, opening, turn):  # type: ignore
    """Return the mean energy Φ over the overlaps, and its derivatives by gap and tilt."""
    if not law.by_lanes:
        return _energy_apart(law, at, length, opening, turn)
    half, stiffness = 0.5 * length * turn, load(law.joint, STIFFNESS, at)
    first, last = opening + half, opening - half
    energy, force, moment = _linear_energy(stiffness, first, last)
    if law.stiffens:
        more, (near, far), _ = excess_means(stiffness, load(law.joint, RATE, at), -first, -last)
        energy, force, moment = energy + more, force - near - far, moment + 0.5 * (near - far)
    return energy, force, moment


# ---- shear


@inlined_kernel
def _shear_means(first, change, lag, limit, is_free):  # type: ignore
    """Return `point_law.shear_means`; those of free points do not matter."""
    trial = first + (0.5 + lag) * change
    sticks = greatest(greatest(abs(first), abs(first + change)), abs(trial)) <= limit
    is_still = change == 0.0
    sticks = sticks | (is_still & (abs(first) <= (1.0 + SLIP_LIMIT_TOLERANCE) * limit))
    sticks = sticks | is_free
    shear, over, by_change = trial, spread(0.0), spread(0.5 + lag)
    by_limit, loss = spread(0.0), lag * change * change
    if any_lane(~sticks):
        slides = _sliding_means(first, change, lag, limit, is_still)
        shear, over = select(sticks, shear, slides[0]), select(sticks, over, slides[1])
        by_change = select(sticks, by_change, slides[2])
        by_limit, loss = select(sticks, by_limit, slides[3]), select(sticks, loss, slides[4])
    return shear, over, by_change, by_limit, loss


@inlined_kernel
def _sliding_means(first, change, lag, limit, is_still):  # type: ignore
    """Return `_shear_means` of points that slip during a step."""
    start = _clip(first, limit)
    trial = start + change
    last = _clip(trial, limit)
    over = trial - last
    # fraction of the step in which the point slips
    moves = (over != 0.0) & ~is_still
    slid = select(moves, least(greatest(over / select(moves, change, 1.0), 0.0), 1.0), 0.0)
    # mean shear, with damping clipped to the limit
    mean = start + 0.5 * change - 0.5 * over * slid
    damped = mean + lag * change
    shear, held = _clip(damped, limit), 1.0 - slid
    lost = select(abs(first) > limit, _sign(first), 0.0)
    # slips at the limit all the step, or at an instant: the shear follows the limit
    follows = (abs(damped) > limit) | (is_still & (abs(first) > limit))
    by_change = select(follows, 0.0, 0.5 * held * held + lag)
    by_limit = select(follows, _sign(shear), held * lost + slid * _sign(change))
    # loss: excess at the start, friction, damping
    rubbing = 0.5 * (first * first - start * start) + abs(over) * limit + (shear - mean) * change
    return shear, first + change - last, by_change, by_limit, rubbing


@inlined_kernel
def _add_point_shear(law, point, at, step, limits, memory, sums):  # type: ignore
    """Return the sums with the shear of points added; store their slip and slip direction."""
    (s0, s1, lag), (slip, end_slip, directions, _) = step, memory
    is_free, limit, by_gap, by_place, (mean, half, tilts, length) = limits
    spring, begin = load(law.spring, point, at), load(slip, point, at)
    flexibility = load(law.flexibility, point, at)
    first, change = spring * (s0 - begin), spring * (s1 - s0)
    most = load(law.joint, RESISTANCE, at) + mean * limit
    shear, over, by_change, by_limit, loss = _shear_means(first, change, lag, most, is_free)
    # slip direction reversed since the last evaluation: derivative and correction of sticking
    direction, missing = _sign(over), spread(0.0)
    reverses = (direction * load(directions, point, at) < 0.0) & ~is_free
    if any_lane(reverses):
        by_change = select(reverses, 0.5 + lag, by_change)
        by_limit = select(reverses, 0.0, by_limit)
        missing = select(reverses, first + by_change * change - shear, 0.0)
        direction = select(reverses, 0.0, direction)
    # points without friction follow the faces, and lose what they had
    store(end_slip, point, at, select(is_free, s1, begin + over * flexibility))
    store(directions, point, at, select(is_free, 0.0, direction))
    shear, along = select(is_free, 0.0, shear), select(is_free, 0.0, spring * by_change)
    loss = select(is_free, 0.5 * first * first, loss) * flexibility
    by_limit = select(is_free, 0.0, by_limit)
    # derivatives by opening, slip and rotation at the end, through the limit and the spring
    return (
        sums[0] + shear,
        sums[1] + loss,
        sums[2] + by_limit * mean * by_gap,
        sums[3] + by_limit * (half * limit - mean * tilts * by_place) + along,
        sums[4] - by_limit * mean * length * by_place,
        sums[5] + missing,
    )


# ---- forces


@inlined_kernel
def _sum_points(law, at, ends, slips, overlap, lag, memory):  # type: ignore
    """Return sums over the points of joints: of normal forces and rates, and of shear."""
    (g0, g1, r0, r1), none = ends, spread(0.0)
    total, moment, by_gap, by_place, by_square = none, none, none, none, none
    rubs, stride = (none, none, none, none, none, none), 2 if law.face_law.facets else 1
    step, resistance = (slips[0], slips[1], lag), load(law.joint, RESISTANCE, at)
    for point in range(0, len(law.place), stride):
        # gaps at both ends of the facet at start and end
        x0, x1 = load(law.place, point, at), load(law.place, point + stride - 1, at)
        gaps = g0 - x0 * r0, g0 - x1 * r0, g1 - x0 * r1, g1 - x1 * r1
        pressed, limits = _press_facet(law, point, at, gaps, lag, memory[3])
        (n0, n1), (k00, k01, k11) = pressed
        # sums of f, x f, and of their derivatives by the gap: 1, x, x²
        share, near, far = load(law.share, point, at), k00 + k01, k01 + k11
        total += share * (n0 + n1)
        moment += share * (x0 * n0 + x1 * n1)
        by_gap += share * (near + far)
        by_place += share * (x0 * near + x1 * far)
        by_square += share * (x0 * x0 * k00 + 2.0 * x0 * x1 * k01 + x1 * x1 * k11)
        # shear of the points, or of both ends of the facets
        (near, far), (k00, k01, k11) = limits
        is_free = (near == 0.0) & (far == 0.0) & (resistance == 0.0)
        own = is_free, near, k00 + k01, x0 * k00 + x1 * k01, overlap
        rubs = _add_point_shear(law, point, at, step, own, memory, rubs)
        if stride == 2:
            own = is_free, far, k01 + k11, x0 * k01 + x1 * k11, overlap
            rubs = _add_point_shear(law, point + 1, at, step, own, memory, rubs)
    return (total, moment, by_gap, by_place, by_square), rubs


@inlined_kernel
def lane_forces(law, at, start, end, lag, memory):  # type: ignore
    """Return mean forces of joints over a step, their derivatives, and what points lack.

    `start` is opening at the middle of the overlap, slip, rotation, length and middle of the
    overlap, and energy at the start; `end` is opening at the middle of the joint, slip and
    rotation at the end. Results are the forces on these; their derivatives; shear, moment about
    the middle of the overlap, and loss of the shear; the forces that joints lack along if points
    that reversed stick; and the energy at the end.
    """
    (g0, s0, t0, l0, c0, before), (g1, s1, t1) = start, end
    last, (c1, moves) = lane_overlap(law, at, s1)
    (l1, shrinks), width = last, law.face_law.width
    g1 = g1 - c1 * t1
    mean, half, tilts = 0.5 * (l0 + l1), 0.5 * shrinks, shrinks * t1
    sums, rubs = _sum_points(
        law, at, (g0, g1, l0 * t0, l1 * t1), (s0, s1), (mean, half, tilts, l1), lag, memory
    )
    total, moment, gap, place, square = sums
    # derivatives of the moment sum, of F_g and of F_σ, by the measures at the end
    leans = place, -tilts * square, -l1 * square
    opens = mean * gap, half * total - mean * tilts * place, -mean * l1 * place
    turns = (
        -mean * mean * leans[0],
        -mean * (mean * leans[1] + 2.0 * half * moment),
        -mean * mean * leans[2],
    )
    # F_s: edge force w Δℓ/Δs (Φ̄ - ℓ̄ σ̄ Σ x_i t̄_i), and shear
    after, whole, tilted = lane_energy(law, at, l1, g1, t1)
    (slope, bends), drags = _overlap_slopes(law, at, (s0, s1), (l0, last))
    turn = 0.5 * (t0 + t1)
    push = 0.5 * width * (before + after) - mean * turn * moment
    by_slip = -0.5 * shrinks * (t1 * width * tilted + turn * moment) - mean * turn * leans[1]
    slides = (
        slope * (0.5 * width * whole - mean * turn * leans[0]) + rubs[2],
        slope * by_slip + bends * push + rubs[3],
        slope * (-0.5 * (l1 * width * tilted + mean * moment) - mean * turn * leans[2]) + rubs[4],
    )
    force, about = (mean * total, slope * push + rubs[0]), -mean * mean * moment
    rates = opens, slides, turns
    whole_force, rates = about_mean_middle(
        (force[0], force[1], about), rates, (c0, c1, moves, drags), (t0, t1)
    )
    return whole_force, rates, (rubs[0], about, rubs[1]), rubs[5], after


@inlined_kernel
def lane_damping_loss(law, at, start, end, lag, tractions):  # type: ignore
    """Return the energy that joints lose over a step by the lag of their normal forces.

    Both ends are opening and tilt at the middle of the overlap, and its length; the mean tractions
    of all points are those of the linear law with the lag.
    """
    (g0, r0, l0), (g1, r1, l1), loss = start, end, spread(0.0)
    stride = 2 if law.face_law.facets else 1
    for point in range(0, len(law.place), stride):
        x0, x1 = load(law.place, point, at), load(law.place, point + stride - 1, at)
        a, c, b, d = g0 - x0 * r0, g0 - x1 * r0, g1 - x0 * r1, g1 - x1 * r1
        if law.by_lanes:
            near, far = _linear_tractions(load(law.joint, STIFFNESS, at), (a, c, b, d), 0.0)[0]
            near, far = load(tractions, point, at) - near, load(tractions, point + 1, at) - far
        else:
            near, far = _damp_apart(law, at, (a, c, b, d), lag)
        loss += load(law.share, point, at) * (near * (b - a) + far * (d - c))
    return 0.5 * (l0 + l1) * loss


@kernel
def _damp_apart(law, at, ends, lag):  # type: ignore
    """Return `point_law.damping_tractions` joint by joint."""
    (a, c, b, d), face_law, near, far = ends, law.face_law, spread(0.0), spread(0.0)
    for k in range(min(WIDTH, len(face_law.depth) - at)):
        own = lane(a, k), lane(c, k), lane(b, k), lane(d, k)
        means = damping_tractions(face_law.contacts[at + k], own, lag, face_law.facets)
        near, far = with_lane(near, k, means[0]), with_lane(far, k, means[1])
    return near, far
