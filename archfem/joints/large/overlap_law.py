"""The contact law on the overlap of two faces, over a step, compiled.

Faces of depth h that have slid by s overlap on ℓ = h - |s|, around their mean middle. The gap is
linear there, g - x ℓ σ with x from -½ to ½. The traction is integrated exactly over facets, or by
springs at the points of a rule. With Φ = ½∫<gap>₋² dx the joint stores k_n w ℓ Φ, and the mean
forces over a step are those whose work is the change of that:

    F_g = k_n w ℓ̄ Σ f̄_i,   F_σ = -k_n w ℓ̄² Σ x_i f̄_i,
    F_s = k_n w Δℓ/Δs (Φ̄ - ℓ̄ σ̄ Σ x_i f̄_i) + Σ τ̄_i,

with f̄_i the means of ∫φ_i <gap>₋ dx, or of W_i <gap>₋, for gaps linear in time, and bars for means
of both ends. The shear τ̄_i of a point is that of a spring in series with a slider, as in
`contact_law.shear_over_step`.

Where faces stretch, points slip by s + x η, with η the elongation of the higher face less that of
the lower one, and the forces that do the work on η are Σ x_i τ̄_i.

A point that slips one way in one iteration and the other way in the next has passed the state in
which it sticks, and Newton's method would alternate. The derivative for such a point is that of
sticking, and the difference of its force from sticking is returned separately.
"""

from typing import Any, NamedTuple

import numpy as np

from archfem._numba import inlined_kernel
from archfem._typing import Array
from archfem.joints.contact_law import GAUSS_POINTS, GAUSS_WEIGHTS
from archfem.joints.operator import SLIP_LIMIT_TOLERANCE

# Slip, relative to the depth of the joint, below which |s| in the overlap is rounded [-]
ROUNDED_SLIP = 1e-5


@inlined_kernel
def point_means(a, b, first, second):  # type: ignore
    """Return means of <g>₋ and <g>₊ at a place, the latter's rate, and the fraction closed."""
    if a <= 0.0 and b <= 0.0:
        return 0.5 * (a + b), 0.0, 0.0, 1.0
    if a > 0.0 and b > 0.0:
        return 0.0, 0.5 * (a + b), 0.5 * (first + second), 0.0
    # the place opens or closes during the step: fractions of it open and closed
    total = abs(a) + abs(b)
    opened, closed = max(a, b) / total, -min(a, b) / total
    square = 0.5 * opened**2
    rate = first * (opened - square if a > 0.0 else square)
    rate += second * (opened - square if b > 0.0 else square)
    return 0.5 * min(a, b) * closed, 0.5 * max(a, b) * opened, rate, closed


@inlined_kernel
def facet_means(ends, first, second):  # type: ignore
    """Return `point_means` integrated with the linear functions of a facet of unit length."""
    a, c, b, d = ends
    if max(ends) <= 0.0 or min(ends) > 0.0:
        return _uniform_means(ends, 0.5 * (first + second))
    # Gauss's rule between the zero crossings, with sums for φ_0 and φ_1 and their products
    _, _, breaks = _zero_crossings(ends)
    n0 = n1 = t0 = t1 = r00 = r01 = r11 = s0 = s1 = 0.0
    for piece in range(3):
        length = breaks[piece + 1] - breaks[piece]
        if length <= 0.0:
            continue
        for k in range(3):
            place = breaks[piece] + GAUSS_POINTS[k] * length
            near, far = 1.0 - place, place
            normal, taken, rate, time = point_means(
                near * a + far * c, near * b + far * d, first, second
            )
            weight = GAUSS_WEIGHTS[k] * length
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


@inlined_kernel
def _zero_crossings(ends):  # type: ignore
    """Return zero crossings of a facet at start and end, 0 for none, and the ends of its parts."""
    a, c, b, d = ends
    low = a / (a - c) if (a <= 0.0) != (c <= 0.0) else 0.0
    high = b / (b - d) if (b <= 0.0) != (d <= 0.0) else 0.0
    return low, high, (0.0, min(low, high), max(low, high), 1.0)


@inlined_kernel
def _uniform_means(ends, rate):  # type: ignore
    """Return `facet_means` of a facet that is closed, or open, all over and all the step."""
    a, c, b, d = ends
    near, far = (a + b) / 12.0, (c + d) / 12.0
    means, none = (2.0 * near + far, near + 2.0 * far), (0.0, 0.0)
    if max(ends) <= 0.0:
        return means, none, (0.0, 0.0, 0.0), (0.5, 0.5)
    return none, means, (rate / 3.0, rate / 6.0, rate / 3.0), none


@inlined_kernel
def closed_means(ends, first, second, facet):  # type: ignore
    """Return the fraction of a step for which a facet, or a place, is closed, and its rate."""
    a, c, b, d = ends
    if not facet:
        time, rate = _closed_time(a, b, first, second)
        return (time, 0.0), (rate, 0.0, 0.0)
    low, high, breaks = _zero_crossings(ends)
    s0 = s1 = r00 = r01 = r11 = 0.0
    for piece in range(3):
        length = breaks[piece + 1] - breaks[piece]
        if length <= 0.0:
            continue
        for k in range(3):
            place = breaks[piece] + GAUSS_POINTS[k] * length
            near, far = 1.0 - place, place
            time, rate = _closed_time(near * a + far * c, near * b + far * d, first, second)
            weight = GAUSS_WEIGHTS[k] * length
            s0 += weight * near * time
            s1 += weight * far * time
            r00 += weight * near * near * rate
            r01 += weight * near * far * rate
            r11 += weight * far * far * rate
    # at an instant the end of the closed part moves
    if low == high and 0.0 < low < 1.0:
        moves = -0.5 * (first + second) / abs(a - c)
        r00 += (1.0 - low) ** 2 * moves
        r01 += (1.0 - low) * low * moves
        r11 += low**2 * moves
    return (s0, s1), (r00, r01, r11)


@inlined_kernel
def _closed_time(a, b, first, second):  # type: ignore
    """Return the fraction of a step for which a place is closed, and its derivative."""
    if (a <= 0.0) == (b <= 0.0):
        return 1.0 if a <= 0.0 else 0.0, 0.0
    whole = abs(a) + abs(b)
    time = -min(a, b) / whole
    by_first = 1.0 - time if a <= 0.0 else time
    by_second = 1.0 - time if b <= 0.0 else time
    return time, -(first * by_first + second * by_second) / whole


@inlined_kernel
def shear_means(first, change, lag, limit):  # type: ignore
    """Return mean shear, excess, derivatives and loss of a point that slips during a step."""
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


class FaceLaw(NamedTuple):
    """Parameters of the law of all joint segments."""

    depth: Array  # h (j,) [m]
    normal_stiffness: Array  # k_n w (j,) [Pa]
    friction: Array  # μ, infinite where a joint never slides (j,) [-]
    first_point: Any  # first point of each segment, and the number of all (j + 1,)
    place: Array  # x of the points; of a facet its two ends (p,) [-]
    depth_share: Array  # part of the depth of a point, or of its whole facet (p,) [-]
    shear_spring: Array  # k_s times the area of each point (p,) [N/m]
    facets: bool  # whether points are ends of facets; else springs
    cohesion: Array  # c w, which adds to friction where a joint is closed (j,) [N/m]
    # whether places that touched at the start stay opposite, like nodes of a mesh, so that the
    # overlap is h (j,)
    paired: Any


@inlined_kernel
def lost_overlap(depth, slip):  # type: ignore
    """Return |s|, by which the overlap is shorter than the depth, and its derivative by s."""
    # Rounded where it is below 1e-5 of the depth. The force that pushes a face off an edge would
    # jump where the slip changes its sign, and Newton's method would alternate there.
    size, bend = abs(slip), ROUNDED_SLIP * depth
    if size < bend:
        return 0.5 * slip * slip / bend, slip / bend
    return size - 0.5 * bend, np.sign(slip)


@inlined_kernel
def overlap(depth, slip):  # type: ignore
    """Return the length on which the faces overlap, and its derivative by the slip."""
    lost, rate = lost_overlap(depth, slip)
    if lost >= depth:
        return 0.0, 0.0
    return depth - lost, -rate


@inlined_kernel
def overlap_length(law, segment, slip):  # type: ignore
    """Return the length on which the law of a segment acts, and its derivative by the slip."""
    if law.paired[segment]:
        return law.depth[segment], 0.0
    return overlap(law.depth[segment], slip)


@inlined_kernel
def closing_energy(law, segment, length, opening, turn):  # type: ignore
    """Return Φ, half the mean square of <gap>₋ over the overlap, and its derivatives."""
    if not law.facets:
        # springs: sums over the points
        phi = whole = tilted = 0.0
        for point in range(law.first_point[segment], law.first_point[segment + 1]):
            place, share = law.place[point], law.depth_share[point]
            gap = min(opening - place * length * turn, 0.0)
            phi += 0.5 * share * gap * gap
            whole += share * gap
            tilted += share * place * gap
        return phi, whole, tilted
    # closed part of the overlap, from `low` to `high`
    first, last = opening + 0.5 * length * turn, opening - 0.5 * length * turn
    low, high = 0.0, 1.0
    if first > 0.0 and last > 0.0:
        return 0.0, 0.0, 0.0
    if (first <= 0.0) != (last <= 0.0):
        zero = first / (first - last)
        if first <= 0.0:
            high = zero
        else:
            low = zero
    # integrals of 1, x and x² over that part
    step, a, b = last - first, high - low, 0.5 * (high**2 - low**2)
    c = (high**3 - low**3) / 3.0
    whole, tilted = first * a + step * b, first * b + step * c
    return 0.5 * (first * whole + step * tilted), whole, tilted - 0.5 * whole


@inlined_kernel
def mean_closings(ends, lag, facet):  # type: ignore
    """Return means of ∫φ_i <gap>₋ on a facet of unit length, or of <gap>₋, and their rates."""
    half = 0.5 + lag
    # closed during the whole step
    if max(ends) <= 0.0:
        a, c, b, d = ends
        near, far = (a + b) / 12.0, (c + d) / 12.0
        if facet:
            return (2.0 * near + far, near + 2.0 * far), (half / 3.0, half / 6.0, half / 3.0)
        return (6.0 * near, 0.0), (half, 0.0, 0.0)
    # open during the whole step
    if min(ends) > 0.0:
        return (0.0, 0.0), (0.0, 0.0, 0.0)
    # opening or closing: the rate of <gap>₋ is that of the gap less that of <gap>₊
    if not facet:
        normal, _, rate, _ = point_means(ends[0], ends[2], lag, 1.0 + lag)
        return (normal, 0.0), (half - rate, 0.0, 0.0)
    normal, _, rates, _ = facet_means(ends, lag, 1.0 + lag)
    return normal, (half / 3.0 - rates[0], half / 6.0 - rates[1], half / 3.0 - rates[2])


@inlined_kernel
def overlap_slope(depth, before, after, first, last):  # type: ignore
    """Return Δℓ/Δs over a step, and its derivative by the slip at the end."""
    (l0, r0), (l1, r1) = first, last
    moved, bend = after - before, ROUNDED_SLIP * depth
    if max(abs(before), abs(after)) < bend:
        return -0.5 * (before + after) / bend, -0.5 / bend
    # beyond, on one side of zero slip, or without slip, it is the derivative
    same = r0 == r1 and l0 > 0.0 and l1 > 0.0
    if same or abs(moved) <= 1e-12 * (abs(before) + abs(after)):
        return r1, 0.0
    slope = l1 - l0
    if l0 > 0.0 and l1 > 0.0:  # small lengths round less
        slope = lost_overlap(depth, before)[0] - lost_overlap(depth, after)[0]
    slope /= moved
    return slope, (r1 - slope) / moved


@inlined_kernel
def friction_limits(law, point, segment, pressed, lagged, lag):  # type: ignore
    """Return Coulomb's limits μ N + c A of a facet per length of the overlap, and their rates."""
    (n0, n1), (k00, k01, k11) = pressed
    scale, hold = -law.friction[segment] * law.normal_stiffness[segment], law.cohesion[segment]
    if scale == -np.inf:
        return (np.inf, np.inf), (0.0, 0.0, 0.0)
    # friction, from the mean normal forces
    scale *= law.depth_share[point]
    ends, rates = (scale * n0, scale * n1), (scale * k00, scale * k01, scale * k11)
    if hold == 0.0:
        return ends, rates
    # cohesion, on the mean closed area, distributed to the ends
    hold *= law.depth_share[point]
    time, by = closed_means(lagged, lag, 1.0 + lag, law.facets)
    ends = ends[0] + hold * time[0], ends[1] + hold * time[1]
    return ends, (rates[0] + hold * by[0], rates[1] + hold * by[1], rates[2] + hold * by[2])


@inlined_kernel
def friction_mean(first, change, lag, limit):  # type: ignore
    """Return `shear_means` of a point that slips or sticks, also without displacement."""
    # sticks during the whole step; at an instant within the tolerance of the limit
    trial = first + (0.5 + lag) * change
    touching = change == 0.0 and abs(first) <= (1.0 + SLIP_LIMIT_TOLERANCE) * limit
    if touching or max(abs(first), abs(first + change), abs(trial)) <= limit:
        return trial, 0.0, 0.5 + lag, 0.0, lag * change * change
    means = shear_means(first, change, lag, limit)
    # slips at an instant: the shear follows the limit
    if change == 0.0 and abs(first) > limit:
        return means[0], means[1], 0.0, np.sign(means[0]), means[4]
    return means


@inlined_kernel
def segment_forces(law, segment, ends, lag, memory):  # type: ignore
    """Return forces of a segment over a step, their derivatives, shear, loss and corrections."""
    # overlap at both ends of the step; gaps at the middle and over the overlap
    laps = overlap_length(law, segment, ends[0][1]), overlap_length(law, segment, ends[1][1])
    (l0, _), (l1, shrinks) = laps
    mean, half, tilts = 0.5 * (l0 + l1), 0.5 * shrinks, shrinks * ends[1][2]
    bounds = ends[0][0], ends[1][0], l0 * ends[0][2], l1 * ends[1][2]
    (total, moment, gap, place, square, loss), rubs = _sum_points(
        law, segment, (bounds, ends), (mean, half, tilts, l1), lag, memory
    )
    # derivatives of the moment sum, of F_g and of F_σ, by the measures at the end
    leans = place, -tilts * square, -l1 * square
    stiff = law.normal_stiffness[segment]
    scale = stiff * mean
    opens = scale * gap, stiff * (half * total - mean * tilts * place), -scale * l1 * place
    turns = (
        -scale * mean * leans[0],
        -scale * (mean * leans[1] + 2.0 * half * moment),
        -scale * mean * leans[2],
    )
    # F_s: edge force and shear
    push, slides = _edge_force(law, segment, ends, laps, (moment, leans))
    force = scale * total, push + rubs[0], -scale * mean * moment, rubs[1]
    slides = slides[0] + rubs[3], slides[1] + rubs[4], slides[2] + rubs[5]
    rates = opens, slides, turns, (rubs[6], rubs[7], rubs[8])
    others = rubs[0], rubs[2] + scale * loss, (rubs[11], rubs[12])
    return force, rates, (rubs[9], rubs[10]), others


@inlined_kernel
def _edge_force(law, segment, ends, laps, moments):  # type: ignore
    """Return the force along the joint due to the shrinking overlap, and its derivatives."""
    if law.paired[segment]:
        return 0.0, (0.0, 0.0, 0.0)
    ((g0, s0, t0), (g1, s1, t1), _), (first, last) = ends, laps
    (l0, _), (l1, shrinks), (moment, leans) = first, last, moments
    # k_n w Δℓ/Δs (Φ̄ - ℓ̄ σ̄ Σ x_i f̄_i)
    mean, turn = 0.5 * (l0 + l1), 0.5 * (t0 + t1)
    before = closing_energy(law, segment, l0, g0, t0)[0]
    after, whole, tilted = closing_energy(law, segment, l1, g1, t1)
    slope, bends = overlap_slope(law.depth[segment], s0, s1, first, last)
    push, stiff = 0.5 * (before + after) - mean * turn * moment, law.normal_stiffness[segment]
    # derivatives by opening, slip and rotation at the end
    by_opening = 0.5 * whole - mean * turn * leans[0]
    by_slip = -0.5 * shrinks * (t1 * tilted + turn * moment) - mean * turn * leans[1]
    by_turn = -0.5 * (l1 * tilted + mean * moment) - mean * turn * leans[2]
    by_slip = stiff * (slope * by_slip + bends * push)
    return stiff * slope * push, (stiff * slope * by_opening, by_slip, stiff * slope * by_turn)


@inlined_kernel
def _sum_points(law, segment, ends, overlap, lag, memory):  # type: ignore
    """Return sums over the points of a segment: of normal forces and rates, and of shear."""
    (g0, g1, r0, r1), measures = ends
    total = moment = by_gap = by_place = by_square = lost = 0.0
    rubs = 13 * (0.0,)
    stride = 2 if law.facets else 1
    for point in range(law.first_point[segment], law.first_point[segment + 1], stride):
        # gaps at both ends of the facet at start (a, c) and end (b, d), shifted by the lag
        x0, x1 = law.place[point], law.place[point + stride - 1]
        a, c, b, d = g0 - x0 * r0, g0 - x1 * r0, g1 - x0 * r1, g1 - x1 * r1
        p, q, share = lag * (b - a), lag * (d - c), law.depth_share[point]
        lagged = a + p, c + q, b + p, d + q
        pressed = mean_closings(lagged, lag, law.facets)
        (n0, n1), (k00, k01, k11) = pressed
        # loss by damping: lagged less unlagged mean, on the change of the gap
        if lag > 0.0:
            m0, m1 = mean_closings((a, c, b, d), 0.0, law.facets)[0]
            lost += share * ((n0 - m0) * (b - a) + (n1 - m1) * (d - c))
        # sums of f, x f, and of their derivatives by the gap: 1, x, x²
        near, far = k00 + k01, k01 + k11
        total += share * (n0 + n1)
        moment += share * (x0 * n0 + x1 * n1)
        by_gap += share * (near + far)
        by_place += share * (x0 * near + x1 * far)
        by_square += share * (x0 * x0 * k00 + 2.0 * x0 * x1 * k01 + x1 * x1 * k11)
        # shear of the point, or of both ends of the facet
        (near, far), (k00, k01, k11) = friction_limits(law, point, segment, pressed, lagged, lag)
        held = near, k00 + k01, x0 * k00 + x1 * k01
        rubs = _add_point_shear(law, point, (measures, lag), (held, overlap), memory, rubs)
        if law.facets:
            held = far, k01 + k11, x0 * k01 + x1 * k11
            rubs = _add_point_shear(law, point + 1, (measures, lag), (held, overlap), memory, rubs)
    return (total, moment, by_gap, by_place, by_square, lost), rubs


@inlined_kernel
def _add_point_shear(law, point, step, limits, memory, sums):  # type: ignore
    """Return the sums with the shear of a point added; store its slip and slip direction."""
    (((_, s0, _), (_, s1, _), (e0, e1)), lag), (slip, end_slip, directions) = step, memory
    (limit, by_gap, by_place), (mean, half, tilts, length) = limits
    stiff, place = law.shear_spring[point], law.place[point]
    # slip of the point at both ends of the step, with the elongation of the faces
    begin, now = s0 + place * e0, s1 + place * e1
    first, change = stiff * (begin - slip[point]), stiff * (now - begin)
    most = mean * limit if limit < np.inf else limit
    shear, over, by_change, by_limit, rubbing = friction_mean(first, change, lag, most)
    end_slip[point] = slip[point] + over / stiff
    # slip direction reversed since the last evaluation: derivative and correction of sticking
    direction, missing = np.sign(over), 0.0
    if direction * directions[point] < 0.0:
        by_change, by_limit, direction = 0.5 + lag, 0.0, 0.0
        missing = first + by_change * change - shear
    directions[point] = direction
    # derivatives by opening, slip and rotation at the end, through the limit and the spring
    along = stiff * by_change
    a = b = c = 0.0
    if by_limit != 0.0:
        a, c = by_limit * mean * by_gap, -by_limit * mean * length * by_place
        b = by_limit * (half * limit - mean * tilts * by_place)
    return (
        sums[0] + shear,
        sums[1] + place * shear,
        sums[2] + rubbing / stiff,
        sums[3] + a,
        sums[4] + b + along,
        sums[5] + c,
        sums[6] + place * a,
        sums[7] + place * (b + along),
        sums[8] + place * c,
        sums[9] + place * along,
        sums[10] + place * place * along,
        sums[11] + missing,
        sums[12] + place * missing,
    )
