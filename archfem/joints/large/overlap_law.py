"""The contact law on the overlap of two faces, over a step, compiled.

Each end of the overlap is that of the face which ends first. With s^- and s^+ the slips at which
both faces end together, R(s) = |s|, and a along the mean line from the mean middle of the joint,

    a^± = ±h/2 ∓ ½ (R(s - s^±) - R(s^±)),   ℓ = a^+ - a^-,   c = ½ (a^+ + a^-).

Faces as long as the joint have s^± = 0: they overlap on ℓ = h - |s| around c = 0. A stone on a
longer face has ℓ = h, c = ±s/2, until it slides over the end of that. The gap is linear on the
overlap, g' - x ℓ σ with g' = g - c σ and x from -½ to ½. The traction of `point_law` is integrated
exactly over facets, or by springs at the points of a rule. With Φ the mean energy on an area the
joint stores w ℓ Φ, and the mean forces over a step are those whose work is the change of that:

    F_g = w ℓ̄ Σ t̄_i,   F'_σ = -w ℓ̄² Σ x_i t̄_i,
    F'_s = w Δℓ/Δs (Φ̄ - ℓ̄ σ̄ Σ x_i t̄_i) + Σ τ̄_i,

with t̄_i the means of ∫φ_i t_n dx, or of W_i t_n, for gaps linear in time, and bars for means
of both ends. As Δg' = Δg - c̄ Δσ - σ̄ Δc, they do that work on g, σ and s with

    F_σ = F'_σ - c̄ F_g,   F_s = F'_s - σ̄ Δc/Δs F_g.

The shear τ̄_i of a point is that of a spring in series with a slider, as in
`contact_law.shear_over_step`.

Where faces stretch, points slip by s + x η, with η the elongation of the higher face less that of
the lower one, and the forces that do the work on η are Σ x_i τ̄_i.

A point that slips one way in one iteration and the other way in the next has passed the state in
which it sticks, and Newton's method would alternate. The derivative for such a point is that of
sticking, and the difference of its force from sticking is returned separately.
"""

from typing import Any, NamedTuple

import numpy as np

from archfem._numba import inlined_kernel, kernel
from archfem._typing import Array
from archfem.joints.large.closing_law import facet_step_excess
from archfem.joints.large.point_law import (
    closed_means,
    damping_tractions,
    facet_energy,
    limit_rate,
    mean_tractions,
    point_energy,
    shear_means,
)

# Slip, relative to the depth of the joint, below which |s| in the overlap is rounded [-]
ROUNDED_SLIP = 1e-5


class FaceLaw(NamedTuple):
    """Parameters of the law of all joint segments."""

    depth: Array  # h (j,) [m]
    width: float  # w [m]
    contacts: Any  # records of the contact law (j,)
    first_point: Any  # first point of each segment, and the number of all (j + 1,)
    place: Array  # x of the points; of a facet its two ends (p,) [-]
    depth_share: Array  # part of the depth of a point, or of its whole facet (p,) [-]
    shear_spring: Array  # k_s times the area of each point (p,) [N/m]
    facets: bool  # whether points are ends of facets; else springs
    # whether places that touched at the start stay opposite, like nodes of a mesh, so that the
    # overlap is h (j,)
    paired: Any
    # slips at which both faces end together, at their ends right and left of the normal; 0 where
    # they end with the joint (j, 2) [m]
    end_slip: Array


@inlined_kernel
def rounded_size(depth, slip):  # type: ignore
    """Return R(s), the size of a slip, and its derivative."""
    # Rounded where it is below 1e-5 of the depth. The force that pushes a face off an edge would
    # jump where the slip changes its sign, and Newton's method would alternate there.
    size, bend = abs(slip), ROUNDED_SLIP * depth
    if size < bend:
        return 0.5 * slip * slip / bend, slip / bend
    return size - 0.5 * bend, np.sign(slip)


@inlined_kernel
def _lost_end(depth, slip, end_slip):  # type: ignore
    """Return by how much an end of the overlap has moved inward, and its derivative by s."""
    size, rate = rounded_size(depth, slip - end_slip)
    if end_slip != 0.0:
        size -= rounded_size(depth, end_slip)[0]
    return 0.5 * size, 0.5 * rate


@inlined_kernel
def overlap(law, segment, slip):  # type: ignore
    """Return length and middle of the overlap, each with its derivative by the slip."""
    depth = law.depth[segment]
    if law.paired[segment]:
        return (depth, 0.0), (0.0, 0.0)
    right, right_rate = _lost_end(depth, slip, law.end_slip[segment, 0])
    left, left_rate = _lost_end(depth, slip, law.end_slip[segment, 1])
    middle = 0.5 * (right - left), 0.5 * (right_rate - left_rate)
    if right + left >= depth:
        return (0.0, 0.0), middle
    return (depth - (right + left), -(right_rate + left_rate)), middle


@inlined_kernel
def closing_energy(law, segment, length, opening, turn):  # type: ignore
    """Return the mean energy Φ over the overlap, and its derivatives by gap and tilt."""
    contact = law.contacts[segment]
    if law.facets:
        return facet_energy(contact, opening + 0.5 * length * turn, opening - 0.5 * length * turn)
    # springs: sums over the points
    phi = whole = tilted = 0.0
    for point in range(law.first_point[segment], law.first_point[segment + 1]):
        place, share = law.place[point], law.depth_share[point]
        stored, traction = point_energy(contact, opening - place * length * turn)
        phi += share * stored
        whole += share * traction
        tilted += share * place * traction
    return phi, whole, tilted


@inlined_kernel
def _size_slope(depth, before, after):  # type: ignore
    """Return ΔR/Δs over a step, and its derivative by the slip at the end."""
    moved, bend = after - before, ROUNDED_SLIP * depth
    if max(abs(before), abs(after)) < bend:
        return 0.5 * (before + after) / bend, 0.5 / bend
    (first, r0), (last, r1) = rounded_size(depth, before), rounded_size(depth, after)
    # beyond, on one side of zero slip, or without slip, it is the derivative
    if r0 == r1 or abs(moved) <= 1e-12 * (abs(before) + abs(after)):
        return r1, 0.0
    slope = (last - first) / moved
    return slope, (r1 - slope) / moved


@inlined_kernel
def _overlap_slopes(law, segment, slips, lengths):  # type: ignore
    """Return Δℓ/Δs and Δc/Δs over a step, each with its derivative by the slip at the end."""
    depth, (before, after), ((l0, _), (l1, shrinks)) = law.depth[segment], slips, lengths
    end = law.end_slip[segment, 0]
    right, right_bend = _size_slope(depth, before - end, after - end)
    end = law.end_slip[segment, 1]
    left, left_bend = _size_slope(depth, before - end, after - end)
    middle = 0.25 * (right - left), 0.25 * (right_bend - left_bend)
    if l0 > 0.0 and l1 > 0.0:
        return (-0.5 * (right + left), -0.5 * (right_bend + left_bend)), middle
    # the faces part, or meet
    moved = after - before
    if abs(moved) <= 1e-12 * (abs(before) + abs(after)):
        return (shrinks, 0.0), middle
    slope = (l1 - l0) / moved
    return (slope, (shrinks - slope) / moved), middle


@inlined_kernel
def friction_limits(law, point, segment, pressed, lagged, lag):  # type: ignore
    """Return Coulomb's limits μ N + c A of a facet per length of the overlap, and their rates."""
    contact, share = law.contacts[segment], law.width * law.depth_share[point]
    (n0, n1), (k00, k01, k11) = pressed
    # cohesion acts on the mean closed area, distributed to the ends
    (a0, a1), (m00, m01, m11) = (0.0, 0.0), (0.0, 0.0, 0.0)
    if contact.cohesion != 0.0:
        (a0, a1), (m00, m01, m11) = closed_means(contact, lagged, lag, law.facets)
    limits = share * limit_rate(contact, n0, a0), share * limit_rate(contact, n1, a1)
    return limits, (
        share * limit_rate(contact, k00, m00),
        share * limit_rate(contact, k01, m01),
        share * limit_rate(contact, k11, m11),
    )


@inlined_kernel
def segment_forces(law, segment, ends, lag, memory):  # type: ignore
    """Return forces of a segment over a step, their derivatives, shear, moment, loss, corrections.

    Shear and moment are the resultants on the overlap, the moment about its middle. The loss is
    that of the shear.
    """
    # overlap at both ends of the step; gaps at the middle and over the overlap
    (g0, s0, t0), (g1, s1, t1), longer = ends
    first, (c0, _) = overlap(law, segment, s0)
    last, (c1, moves) = overlap(law, segment, s1)
    (l0, _), (l1, shrinks), is_off_middle = first, last, c0 != 0.0 or c1 != 0.0 or moves != 0.0
    g0, g1 = g0 - c0 * t0, g1 - c1 * t1
    ends = (g0, s0, t0), (g1, s1, t1), longer
    mean, half, tilts = 0.5 * (l0 + l1), 0.5 * shrinks, shrinks * t1
    bounds = g0, g1, l0 * t0, l1 * t1
    sums, rubs, is_stuck = _sum_stuck(law, segment, (bounds, ends), mean, lag, memory)
    if not is_stuck:
        sums, rubs = _sum_points(law, segment, (bounds, ends), (mean, half, tilts, l1), lag, memory)
    total, moment, gap, place, square = sums
    # derivatives of the moment sum, of F_g and of F_σ, by the measures at the end
    leans = place, -tilts * square, -l1 * square
    scale = law.width * mean
    opens = scale * gap, law.width * (half * total - mean * tilts * place), -scale * l1 * place
    turns = (
        -scale * mean * leans[0],
        -scale * (mean * leans[1] + 2.0 * half * moment),
        -scale * mean * leans[2],
    )
    # F_s: edge force and shear
    push, slides, slope = _edge_force(law, segment, ends, (first, last), (moment, leans))
    about = -scale * mean * moment
    force = scale * total, push + rubs[0], about, rubs[1]
    slides = slides[0] + rubs[3], slides[1] + rubs[4], slides[2] + rubs[5]
    rates = opens, slides, turns, (rubs[6], rubs[7], rubs[8])
    if is_off_middle:
        moved, of_moved = about_mean_middle(force, rates, (c0, c1, moves, slope), (t0, t1))
        force = moved[0], moved[1], moved[2], force[3]
        rates = of_moved[0], of_moved[1], of_moved[2], _by_gap(rates[3], c1, moves * t1)
    others = (rubs[0], about), rubs[2], (rubs[11], rubs[12])
    return force, rates, (rubs[9], rubs[10]), others


@inlined_kernel
def damping_loss(law, segment, ends, lag):  # type: ignore
    """Return the energy that a segment loses over a step by the lag of its normal forces."""
    if lag <= 0.0:
        return 0.0
    (g0, s0, t0), (g1, s1, t1) = ends
    (l0, _), (c0, _) = overlap(law, segment, s0)
    (l1, _), (c1, _) = overlap(law, segment, s1)
    g0, g1, r0, r1 = g0 - c0 * t0, g1 - c1 * t1, l0 * t0, l1 * t1
    contact, loss, stride = law.contacts[segment], 0.0, 2 if law.facets else 1
    for point in range(law.first_point[segment], law.first_point[segment + 1], stride):
        x0, x1 = law.place[point], law.place[point + stride - 1]
        a, c, b, d = g0 - x0 * r0, g0 - x1 * r0, g1 - x0 * r1, g1 - x1 * r1
        m0, m1 = damping_tractions(contact, (a, c, b, d), lag, law.facets)
        loss += law.depth_share[point] * (m0 * (b - a) + m1 * (d - c))
    return law.width * 0.5 * (l0 + l1) * loss


@inlined_kernel
def about_mean_middle(force, rates, middle, turns):  # type: ignore
    """Return forces and derivatives by g, s and σ from those by the gap at the overlap's middle."""
    (c0, c1, moves, (slope, bends)), (t0, t1) = middle, turns
    mean, turn, total = 0.5 * (c0 + c1), 0.5 * (t0 + t1), force[0]
    # derivatives by g' = g - c σ at the end
    opens = _by_gap(rates[0], c1, moves * t1)
    slides = _by_gap(rates[1], c1, moves * t1)
    turning = _by_gap(rates[2], c1, moves * t1)
    # F_s - σ̄ Δc/Δs F_g and F_σ - c̄ F_g
    pull = turn * slope
    slides = (
        slides[0] - pull * opens[0],
        slides[1] - pull * opens[1] - turn * bends * total,
        slides[2] - pull * opens[2] - 0.5 * slope * total,
    )
    turning = (
        turning[0] - mean * opens[0],
        turning[1] - mean * opens[1] - 0.5 * moves * total,
        turning[2] - mean * opens[2],
    )
    return (total, force[1] - pull * total, force[2] - mean * total), (opens, slides, turning)


@inlined_kernel
def _by_gap(row, middle, moved):  # type: ignore
    """Return derivatives by g, s and σ from those by g', s and σ."""
    return row[0], row[1] - moved * row[0], row[2] - middle * row[0]


@inlined_kernel
def _edge_force(law, segment, ends, lengths, moments):  # type: ignore
    """Return the force along the joint due to the shrinking overlap, its derivatives, and Δc/Δs."""
    if law.paired[segment]:
        return 0.0, (0.0, 0.0, 0.0), (0.0, 0.0)
    ((g0, s0, t0), (g1, s1, t1), _), (first, last) = ends, lengths
    (l0, _), (l1, shrinks), (moment, leans) = first, last, moments
    # w Δℓ/Δs (Φ̄ - ℓ̄ σ̄ Σ x_i t̄_i)
    mean, turn = 0.5 * (l0 + l1), 0.5 * (t0 + t1)
    before = closing_energy(law, segment, l0, g0, t0)[0]
    after, whole, tilted = closing_energy(law, segment, l1, g1, t1)
    (slope, bends), middle = _overlap_slopes(law, segment, (s0, s1), lengths)
    push, width = 0.5 * (before + after) - mean * turn * moment, law.width
    # derivatives by opening, slip and rotation at the end
    by_opening = 0.5 * whole - mean * turn * leans[0]
    by_slip = -0.5 * shrinks * (t1 * tilted + turn * moment) - mean * turn * leans[1]
    by_turn = -0.5 * (l1 * tilted + mean * moment) - mean * turn * leans[2]
    by_slip = width * (slope * by_slip + bends * push)
    rates = width * slope * by_opening, by_slip, width * slope * by_turn
    return width * slope * push, rates, middle


@inlined_kernel
def _sum_points(law, segment, ends, overlap, lag, memory):  # type: ignore
    """Return sums over the points of a segment: of normal forces and rates, and of shear."""
    (g0, g1, r0, r1), measures = ends
    contact = law.contacts[segment]
    total = moment = by_gap = by_place = by_square = lost = 0.0
    rubs = 13 * (0.0,)
    stride = 2 if law.facets else 1
    for point in range(law.first_point[segment], law.first_point[segment + 1], stride):
        # gaps at both ends of the facet at start (a, c) and end (b, d), shifted by the lag
        x0, x1 = law.place[point], law.place[point + stride - 1]
        a, c, b, d = g0 - x0 * r0, g0 - x1 * r0, g1 - x0 * r1, g1 - x1 * r1
        p, q, share = lag * (b - a), lag * (d - c), law.depth_share[point]
        lagged = a + p, c + q, b + p, d + q
        pressed = mean_tractions(contact, lagged, lag, law.facets)
        (n0, n1), (k00, k01, k11) = pressed
        # sums of f, x f, and of their derivatives by the gap: 1, x, x²
        near, far = k00 + k01, k01 + k11
        total += share * (n0 + n1)
        moment += share * (x0 * n0 + x1 * n1)
        by_gap += share * (near + far)
        by_place += share * (x0 * near + x1 * far)
        by_square += share * (x0 * x0 * k00 + 2.0 * x0 * x1 * k01 + x1 * x1 * k11)
        # shear of the point, or of both ends of the facet
        (near, far), (k00, k01, k11) = friction_limits(law, point, segment, pressed, lagged, lag)
        is_free = near == 0.0 and far == 0.0 and contact.resistance == 0.0
        for end in range(stride):
            if is_free:
                lost += _follow_free_point(law, point + end, measures, memory)
                continue
            held = near, k00 + k01, x0 * k00 + x1 * k01
            if end == 1:
                held = far, k01 + k11, x0 * k01 + x1 * k11
            limits = contact.resistance, held, overlap
            rubs = _add_point_shear(law, point + end, (measures, lag), limits, memory, rubs)
    rubs = rubs[:2] + (rubs[2] + lost,) + rubs[3:]  # noqa: RUF005 (numba has no other)
    return (total, moment, by_gap, by_place, by_square), rubs


@inlined_kernel
def _sum_stuck(law, segment, ends, overlap, lag, memory):  # type: ignore
    """Return `_sum_points` of facets that stay closed and stick, and whether all of them do.

    The facets cover the overlap: sums of their integrals are those over all of it.
    """
    ((g0, g1, r0, r1), ((_, s0, _), (_, s1, _), (e0, e1))), contact = ends, law.contacts[segment]
    sums, rubs = 5 * (0.0,), 13 * (0.0,)
    # gaps without and with the lag of damping, at the end that is more open
    more, tilt = lag * (g1 - g0), lag * (r1 - r0)
    widest = max(g0 + 0.5 * abs(r0), g1 + 0.5 * abs(r1))
    lagged = max(g0 + more + 0.5 * abs(r0 + tilt), g1 + more + 0.5 * abs(r1 + tilt))
    if not law.facets or max(widest, lagged) > 0.0:
        return sums, rubs, False
    gap, turn, stiff = 0.5 * (g0 + g1) + more, 0.5 * (r0 + r1) + tilt, contact.normal_stiffness
    whole, excess = (0.5 + lag) * stiff, (0.0, 0.0)
    pressed = stiff * gap, -stiff * turn / 12.0, whole, 0.0, whole / 12.0
    shear = stretched = lost = along = first_moment = second_moment = 0.0
    begin, end = law.first_point[segment], law.first_point[segment + 1]
    for point in range(begin, end):
        # Coulomb's limit from the normal force of this end of a facet
        is_first = (point - begin) % 2 == 0
        place, other = law.place[point], law.place[point + 1 if is_first else point - 1]
        normal = stiff / 6.0 * (3.0 * gap - (2.0 * place + other) * turn)
        if contact.closing_rate > 0.0:
            if is_first:
                pressed, excess = _add_facet_excess(law, point, contact, (g0, g1, r0, r1), pressed)
            normal -= excess[0] if is_first else excess[1]
        share, spring = overlap * law.width * law.depth_share[point], law.shear_spring[point]
        limit = contact.resistance + share * limit_rate(contact, normal, 0.5)
        first = spring * (s0 + place * e0 - memory[0][point])
        change = spring * (s1 - s0 + place * (e1 - e0))
        mean = first + (0.5 + lag) * change
        if not max(abs(first), abs(first + change), abs(mean)) <= limit:
            return sums, rubs, False
        rate = (0.5 + lag) * spring
        shear += mean
        stretched += place * mean
        lost += lag * change * change / spring
        along += rate
        first_moment += place * rate
        second_moment += place * place * rate
    for point in range(begin, end):
        memory[1][point], memory[2][point] = memory[0][point], 0.0
    held = first_moment, 0.0, first_moment, second_moment, 0.0, 0.0
    return pressed, (shear, stretched, lost, 0.0, along, 0.0, 0.0) + held, True  # noqa: RUF005


@kernel
def _add_facet_excess(law, point, contact, bounds, sums):  # type: ignore
    """Return sums with what a facet presses beyond the linear law, and the means of that."""
    (g0, g1, r0, r1), (total, moment, by_gap, by_place, by_square) = bounds, sums
    x, y, share = law.place[point], law.place[point + 1], law.depth_share[point]
    # the excess has no lag
    closings = x * r0 - g0, y * r0 - g0, x * r1 - g1, y * r1 - g1
    excess, (k00, k01, k11) = facet_step_excess(
        contact.normal_stiffness, contact.closing_rate, closings, 0.0, 1.0
    )
    near, far = k00 + k01, k01 + k11
    total -= share * (excess[0] + excess[1])
    moment -= share * (x * excess[0] + y * excess[1])
    by_gap += share * (near + far)
    by_place += share * (x * near + y * far)
    by_square += share * (x * x * k00 + 2.0 * x * y * k01 + y * y * k11)
    return (total, moment, by_gap, by_place, by_square), excess


@inlined_kernel
def _follow_free_point(law, point, measures, memory):  # type: ignore
    """Store the slip of a point without friction, which sticks nowhere; return the energy lost."""
    ((_, s0, _), (_, s1, _), (e0, e1)), (slip, end_slip, directions) = measures, memory
    place = law.place[point]
    stretched = s0 + place * e0 - slip[point]
    end_slip[point], directions[point] = s1 + place * e1, 0.0
    return 0.5 * law.shear_spring[point] * stretched * stretched


@inlined_kernel
def _add_point_shear(law, point, step, limits, memory, sums):  # type: ignore
    """Return the sums with the shear of a point added; store its slip and slip direction."""
    (((_, s0, _), (_, s1, _), (e0, e1)), lag), (slip, end_slip, directions) = step, memory
    resistance, (limit, by_gap, by_place), (mean, half, tilts, length) = limits
    stiff, place = law.shear_spring[point], law.place[point]
    # slip of the point at both ends of the step, with the elongation of the faces
    begin, now = s0 + place * e0, s1 + place * e1
    first, change = stiff * (begin - slip[point]), stiff * (now - begin)
    most = resistance + mean * limit
    shear, over, by_change, by_limit, rubbing = shear_means(first, change, lag, most)
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
