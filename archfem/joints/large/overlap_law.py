"""The contact law on the overlap of two faces, over a step, compiled.

Each end of the overlap is that of the face which ends first. Both faces end together at the slips
s^- and s^+. With R(s) = |s|, and a along the mean line from the mean middle of the joint,

    a^± = ±h/2 ∓ ½ (R(s - s^±) - R(s^±)),   ℓ = a^+ - a^-,   c = ½ (a^+ + a^-).

Faces as long as the joint have s^± = 0: they overlap on ℓ = h - |s| around c = 0. A stone on a
longer face has ℓ = h, c = ±s/2, until it slides over the end of that. The gap is linear on the
overlap, g' - x ℓ σ with g' = g - c σ and x from -½ to ½. The traction of `point_law` is integrated
exactly over facets, or by springs at the points of a rule. With Φ the mean energy on an area the
joint stores w ℓ Φ. The mean forces over a step are those whose work is the change of that energy:

    F_g = w ℓ̄ Σ t̄_i,   F'_σ = -w ℓ̄² Σ x_i t̄_i,
    F'_s = w Δℓ/Δs (Φ̄ - ℓ̄ σ̄ Σ x_i t̄_i) + Σ τ̄_i.

Here t̄_i are the means of ∫φ_i t_n dx, or of W_i t_n, for gaps linear in time. Other bars are
means of both ends. As Δg' = Δg - c̄ Δσ - σ̄ Δc, they do that work on g, σ and s with

    F_σ = F'_σ - c̄ F_g,   F_s = F'_s - σ̄ Δc/Δs F_g.

The shear τ̄_i of a point is that of a spring in series with a slider, as in
`contact_law.shear_over_step`.

Where faces stretch, points slip by s + x η, with η the elongation of the higher face less that of
the lower one. The forces that do the work on η are Σ x_i τ̄_i.

A point that slips one way in one iteration and the other way in the next has passed the state in
which it sticks. Newton's method would alternate. The derivative for such a point is that of
sticking, and the difference of its force from sticking is returned separately.
"""

from typing import Any, NamedTuple

import numpy as np

from archfem._numba import inlined_kernel
from archfem._typing import Array
from archfem.joints.large.lanes import any_lane, greatest, select
from archfem.joints.large.point_law import (
    closed_means,
    damping_tractions,
    facet_energy,
    limit_rate,
    mean_tractions,
    point_energy,
    shear_means,
    sign,
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
def _smooth_size(bend, slip):  # type: ignore
    """Return R(s), the size of a slip, and its derivative; rounded below a slip `bend`."""
    # The force that pushes a face off an edge would jump where the slip changes its sign, and
    # Newton's method would alternate there.
    size, share = abs(slip), slip / bend
    is_small = size < bend
    return (
        select(is_small, 0.5 * slip * share, size - 0.5 * bend),
        select(is_small, share, sign(slip)),
    )


@inlined_kernel
def overlap_between(depth, ends, sizes, slip):  # type: ignore
    """Return `overlap` from the slips s^+ and s^- at which faces end together, and R of them."""
    bend = ROUNDED_SLIP * depth
    right, right_rate = _smooth_size(bend, slip - ends[0])
    left, left_rate = _smooth_size(bend, slip - ends[1])
    right, left = right - sizes[0], left - sizes[1]
    rest = depth - 0.5 * (right + left)
    is_left = rest > 0.0
    length = select(is_left, rest, 0.0), select(is_left, -0.5 * (right_rate + left_rate), 0.0)
    return length, (0.25 * (right - left), 0.25 * (right_rate - left_rate))


@inlined_kernel
def overlap(law, segment, slip):  # type: ignore
    """Return length and middle of the overlap, each with its derivative by the slip."""
    depth = law.depth[segment]
    if law.paired[segment]:
        return (depth, 0.0), (0.0, 0.0)
    ends = law.end_slip[segment, 0], law.end_slip[segment, 1]
    bend = ROUNDED_SLIP * depth
    sizes = _smooth_size(bend, ends[0])[0], _smooth_size(bend, ends[1])[0]
    return overlap_between(depth, ends, sizes, slip)


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
def _size_slope(bend, before, after):  # type: ignore
    """Return ΔR/Δs over a step, and its derivative by the slip at the end."""
    (first, r0), (last, r1) = _smooth_size(bend, before), _smooth_size(bend, after)
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
def overlap_slopes(depth, ends, slips, lengths):  # type: ignore
    """Return Δℓ/Δs and Δc/Δs over a step, each with its derivative by the slip at the end."""
    bend, (before, after), (l0, (l1, shrinks)) = ROUNDED_SLIP * depth, slips, lengths
    right, right_bend = _size_slope(bend, before - ends[0], after - ends[0])
    left, left_bend = _size_slope(bend, before - ends[1], after - ends[1])
    slope, bends = -0.5 * (right + left), -0.5 * (right_bend + left_bend)
    parts = (l0 <= 0.0) | (l1 <= 0.0)
    if any_lane(parts):  # the faces part, or meet
        moved = after - before
        is_still = abs(moved) <= 1e-12 * (abs(before) + abs(after))
        whole = (l1 - l0) / moved
        slope = select(parts, select(is_still, shrinks, whole), slope)
        bends = select(parts, select(is_still, 0.0, (shrinks - whole) / moved), bends)
    return (slope, bends), (0.25 * (right - left), 0.25 * (right_bend - left_bend))


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
def add_pressure(sums, share, places, pressed):  # type: ignore
    """Return sums with those of a facet: f, x f, and derivatives by the gap times 1, x and x²."""
    (x, y), ((n0, n1), (k00, k01, k11)) = places, pressed
    near, far = k00 + k01, k01 + k11
    return (
        sums[0] + share * (n0 + n1),
        sums[1] + share * (x * n0 + y * n1),
        sums[2] + share * (near + far),
        sums[3] + share * (x * near + y * far),
        sums[4] + share * (x * x * k00 + 2.0 * x * y * k01 + y * y * k11),
    )


@inlined_kernel
def press_overlap(sums, lengths):  # type: ignore
    """Return F_g and F'_σ, their derivatives by g', s and σ at the end, and those of Σ x_i t̄_i.

    Lengths of the overlap are the mean one, half its rate by s, that rate times σ, and the last.
    """
    (total, moment, gap, place, square), (mean, half, tilts, last) = sums, lengths
    leans = place, -tilts * square, -last * square
    opens = mean * gap, half * total - mean * tilts * place, -mean * last * place
    turns = (
        -mean * mean * leans[0],
        -mean * (mean * leans[1] + 2.0 * half * moment),
        -mean * mean * leans[2],
    )
    return (mean * total, -mean * mean * moment), (opens, turns), leans


@inlined_kernel
def edge_force(energies, slopes, lengths, turns, moments):  # type: ignore
    """Return w Δℓ/Δs (Φ̄ - ℓ̄ σ̄ Σ x_i t̄_i), and its derivatives by opening, slip and rotation.

    Energies are w Φ at start and end, and the derivatives of the latter by gap and tilt.
    """
    (before, after, whole, tilted), (slope, bends) = energies, slopes
    (mean, half, _, last), (t0, t1), (moment, leans) = lengths, turns, moments
    turn = 0.5 * (t0 + t1)
    push = 0.5 * (before + after) - mean * turn * moment
    by_slip = -half * (t1 * tilted + turn * moment) - mean * turn * leans[1]
    by_turn = -0.5 * (last * tilted + mean * moment) - mean * turn * leans[2]
    by_opening = 0.5 * whole - mean * turn * leans[0]
    return slope * push, (slope * by_opening, slope * by_slip + bends * push, slope * by_turn)


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
    lengths = 0.5 * (l0 + l1), 0.5 * shrinks, shrinks * t1, l1
    bounds = g0, g1, l0 * t0, l1 * t1
    sums, rubs = _sum_points(law, segment, (bounds, ends), lengths, lag, memory)
    (pressed, about), (opens, turns), leans = press_overlap(sums, lengths)
    # F_s: edge force and shear
    push, slides, slope = 0.0, (0.0, 0.0, 0.0), (0.0, 0.0)
    if not law.paired[segment]:
        (slopes, slope), energies = _edge_energies(law, segment, ends, (first, last))
        push, slides = edge_force(energies, slopes, lengths, (t0, t1), (sums[1], leans))
    force = pressed, push + rubs[0], about, rubs[1]
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
def _edge_energies(law, segment, ends, lengths):  # type: ignore
    """Return `overlap_slopes`, and the energies of `edge_force`, of a segment over a step."""
    ((g0, s0, t0), (g1, s1, t1), _), (first, last), width = ends, lengths, law.width
    end_slips = law.end_slip[segment, 0], law.end_slip[segment, 1]
    slopes = overlap_slopes(law.depth[segment], end_slips, (s0, s1), (first[0], last))
    before = closing_energy(law, segment, first[0], g0, t0)[0]
    after, whole, tilted = closing_energy(law, segment, last[0], g1, t1)
    return slopes, (width * before, width * after, width * whole, width * tilted)


@inlined_kernel
def _sum_points(law, segment, ends, overlap, lag, memory):  # type: ignore
    """Return sums over the points of a segment: of normal forces and rates, and of shear."""
    (g0, g1, r0, r1), measures = ends
    contact = law.contacts[segment]
    sums, rubs, lost = 5 * (0.0,), 13 * (0.0,), 0.0
    stride = 2 if law.facets else 1
    for point in range(law.first_point[segment], law.first_point[segment + 1], stride):
        # gaps at both ends of the facet at start (a, c) and end (b, d), shifted by the lag
        x0, x1 = law.place[point], law.place[point + stride - 1]
        a, c, b, d = g0 - x0 * r0, g0 - x1 * r0, g1 - x0 * r1, g1 - x1 * r1
        p, q, share = lag * (b - a), lag * (d - c), law.width * law.depth_share[point]
        lagged = a + p, c + q, b + p, d + q
        pressed = mean_tractions(contact, lagged, lag, law.facets)
        sums = add_pressure(sums, share, (x0, x1), pressed)
        # shear of the point, or of both ends of the facet
        (near, far), (k00, k01, k11) = friction_limits(law, point, segment, pressed, lagged, lag)
        # faces that touch without pressure stick: without that a first tangent would be singular
        touches = min(lagged) == 0.0 == max(lagged)
        is_free = near == 0.0 and far == 0.0 and contact.resistance == 0.0 and not touches
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
    return sums, rubs


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
