"""The contact law on the overlap of two faces, over a step, compiled.

Faces of depth h that have slid by s overlap on ℓ = h - |s|, around their mean middle. The gap is
linear there, g - x ℓ σ with x from -½ to ½. The traction of `point_law` is integrated exactly over
facets, or by springs at the points of a rule. With Φ the mean energy on an area the joint stores
w ℓ Φ, and the mean forces over a step are those whose work is the change of that:

    F_g = w ℓ̄ Σ t̄_i,   F_σ = -w ℓ̄² Σ x_i t̄_i,
    F_s = w Δℓ/Δs (Φ̄ - ℓ̄ σ̄ Σ x_i t̄_i) + Σ τ̄_i,

with t̄_i the means of ∫φ_i t_n dx, or of W_i t_n, for gaps linear in time, and bars for means
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
from archfem.joints.large.point_law import (
    closed_means,
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
def _friction_limits(law, point, segment, pressed, lagged, lag):  # type: ignore
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
    scale = law.width * mean
    opens = scale * gap, law.width * (half * total - mean * tilts * place), -scale * l1 * place
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
    # w Δℓ/Δs (Φ̄ - ℓ̄ σ̄ Σ x_i t̄_i)
    mean, turn = 0.5 * (l0 + l1), 0.5 * (t0 + t1)
    before = closing_energy(law, segment, l0, g0, t0)[0]
    after, whole, tilted = closing_energy(law, segment, l1, g1, t1)
    slope, bends = overlap_slope(law.depth[segment], s0, s1, first, last)
    push, width = 0.5 * (before + after) - mean * turn * moment, law.width
    # derivatives by opening, slip and rotation at the end
    by_opening = 0.5 * whole - mean * turn * leans[0]
    by_slip = -0.5 * shrinks * (t1 * tilted + turn * moment) - mean * turn * leans[1]
    by_turn = -0.5 * (l1 * tilted + mean * moment) - mean * turn * leans[2]
    by_slip = width * (slope * by_slip + bends * push)
    return width * slope * push, (width * slope * by_opening, by_slip, width * slope * by_turn)


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
        # loss by damping: lagged less unlagged mean, on the change of the gap
        if lag > 0.0:
            m0, m1 = mean_tractions(contact, (a, c, b, d), 0.0, law.facets)[0]
            lost += share * ((n0 - m0) * (b - a) + (n1 - m1) * (d - c))
        # sums of f, x f, and of their derivatives by the gap: 1, x, x²
        near, far = k00 + k01, k01 + k11
        total += share * (n0 + n1)
        moment += share * (x0 * n0 + x1 * n1)
        by_gap += share * (near + far)
        by_place += share * (x0 * near + x1 * far)
        by_square += share * (x0 * x0 * k00 + 2.0 * x0 * x1 * k01 + x1 * x1 * k11)
        # shear of the point, or of both ends of the facet
        (near, far), (k00, k01, k11) = _friction_limits(law, point, segment, pressed, lagged, lag)
        held = near, k00 + k01, x0 * k00 + x1 * k01
        limits = contact.resistance, held, overlap
        rubs = _add_point_shear(law, point, (measures, lag), limits, memory, rubs)
        if law.facets:
            held = far, k01 + k11, x0 * k01 + x1 * k11
            limits = contact.resistance, held, overlap
            rubs = _add_point_shear(law, point + 1, (measures, lag), limits, memory, rubs)
    return (total, moment, by_gap, by_place, by_square, lost), rubs


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
