"""The contact law on the overlaps of eight joints at a time, over a step, compiled.

The law is that of `overlap_law`, written for `lanes`: where joints differ, both ways are computed,
and `select` takes one. Faces do not stretch, and each joint is one segment of as many points.
Cohesive joints, and those that are no facets, press by `point_law`, joint by joint.
"""

from typing import NamedTuple

import numpy as np

from archfem._numba import inlined_kernel, kernel
from archfem._typing import Array
from archfem.joints.large.closing_law import excess_means, facet_step_excess
from archfem.joints.large.lanes import WIDTH, any_lane, lane, load, select, spread, store, with_lane
from archfem.joints.large.overlap_law import (
    ROUNDED_SLIP,
    FaceLaw,
    about_mean_middle,
    add_pressure,
    closing_energy,
    edge_force,
    friction_limits,
    overlap_between,
    overlap_slopes,
    press_overlap,
)
from archfem.joints.large.point_law import (
    damping_tractions,
    linear_energy,
    linear_tractions,
    mean_tractions,
    shear_means,
    sign,
)

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
def lane_overlap(law, at, slip):  # type: ignore
    """Return length and middle of the overlaps, each with its derivative by the slip."""
    depth, rows = load(law.joint, DEPTH, at), law.joint
    sizes = load(rows, RIGHT_SIZE, at), load(rows, LEFT_SIZE, at)
    return overlap_between(depth, _end_slips(law, at), sizes, slip)


@inlined_kernel
def _end_slips(law, at):  # type: ignore
    """Return the slips at which faces end together, at both ends of the overlaps."""
    return load(law.joint, RIGHT_SLIP, at), load(law.joint, LEFT_SLIP, at)


# ---- normal forces


@kernel
def _press_apart(law, point, at, ends, lag):  # type: ignore
    """Return means as `linear_tractions`, and Coulomb's limits with rates, joint by joint."""
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

    The values of the linear law, on which damping depends, are stored.
    """
    # the gaps, shifted by the lag
    a, c, b, d = ends
    p, q = lag * (b - a), lag * (d - c)
    lagged = a + p, c + q, b + p, d + q
    if not law.by_lanes:
        return _press_apart(law, point, at, lagged, lag)
    stiffness = load(law.joint, STIFFNESS, at)
    (near, far), (k00, k01, k11) = linear_tractions(stiffness, lagged, lag)
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
    energy, force, moment = linear_energy(stiffness, first, last)
    if law.stiffens:
        more, (near, far), _ = excess_means(stiffness, load(law.joint, RATE, at), -first, -last)
        energy, force, moment = energy + more, force - near - far, moment + 0.5 * (near - far)
    return energy, force, moment


# ---- shear


@inlined_kernel
def _add_point_shear(law, point, at, step, limits, memory, sums):  # type: ignore
    """Return the sums with the shear of points added; store their slip and slip direction."""
    (s0, s1, lag), (slip, end_slip, directions, _) = step, memory
    is_free, limit, by_gap, by_place, (mean, half, tilts, length) = limits
    spring, begin = load(law.spring, point, at), load(slip, point, at)
    flexibility = load(law.flexibility, point, at)
    first, change = spring * (s0 - begin), spring * (s1 - s0)
    # points without friction hold nothing: below, what they would have without a limit is left out
    most = select(is_free, np.inf, load(law.joint, RESISTANCE, at) + mean * limit)
    shear, over, by_change, by_limit, loss = shear_means(first, change, lag, most)
    # slip direction reversed since the last evaluation: derivative and correction of sticking
    direction, missing = sign(over), spread(0.0)
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
    sums = none, none, none, none, none
    rubs, stride = (none, none, none, none, none, none), 2 if law.face_law.facets else 1
    step, resistance = (slips[0], slips[1], lag), load(law.joint, RESISTANCE, at)
    for point in range(0, len(law.place), stride):
        # gaps at both ends of the facet at start and end
        x0, x1 = load(law.place, point, at), load(law.place, point + stride - 1, at)
        gaps = g0 - x0 * r0, g0 - x1 * r0, g1 - x0 * r1, g1 - x1 * r1
        pressed, limits = _press_facet(law, point, at, gaps, lag, memory[3])
        sums = add_pressure(sums, load(law.share, point, at), (x0, x1), pressed)
        # shear of the points, or of both ends of the facets
        (near, far), (k00, k01, k11) = limits
        is_free = (near == 0.0) & (far == 0.0) & (resistance == 0.0)
        own = is_free, near, k00 + k01, x0 * k00 + x1 * k01, overlap
        rubs = _add_point_shear(law, point, at, step, own, memory, rubs)
        if stride == 2:
            own = is_free, far, k01 + k11, x0 * k01 + x1 * k11, overlap
            rubs = _add_point_shear(law, point + 1, at, step, own, memory, rubs)
    return sums, rubs


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
    lengths, ends = (0.5 * (l0 + l1), 0.5 * shrinks, shrinks * t1, l1), (g0, g1, l0 * t0, l1 * t1)
    sums, rubs = _sum_points(law, at, ends, (s0, s1), lengths, lag, memory)
    (pressed, about), (opens, turns), leans = press_overlap(sums, lengths)
    # F_s: edge force and shear
    after, whole, tilted = lane_energy(law, at, l1, g1, t1)
    depth, ends = load(law.joint, DEPTH, at), _end_slips(law, at)
    slopes, drags = overlap_slopes(depth, ends, (s0, s1), (l0, last))
    energies = width * before, width * after, width * whole, width * tilted
    push, slides = edge_force(energies, slopes, lengths, (t0, t1), (sums[1], leans))
    force = pressed, push + rubs[0], about
    rates = opens, (slides[0] + rubs[2], slides[1] + rubs[3], slides[2] + rubs[4]), turns
    whole_force, rates = about_mean_middle(force, rates, (c0, c1, moves, drags), (t0, t1))
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
            near, far = linear_tractions(load(law.joint, STIFFNESS, at), (a, c, b, d), 0.0)[0]
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
