"""The joint law, compiled: forces that joints release as they open and slide, with derivatives.

Tractions and limits are by `archfem.joints.large.point_law`. A row of gaps z is an opening at one
point of a joint, or the slip that some of its points share. If all joints were closed and stuck,
their forces K z would be linear. The law returns the rest,

    λ = K z - f̄(z),

the released forces: zero where a joint stays closed and sticks. With the conserving scheme z lies
in the middle of the path of the gaps over a step, and f̄ is the mean over it. With Newmark's method
and HHT the path has no length, and f̄ is the force at an instant.
"""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from archfem._numba import inlined_kernel, kernel
from archfem._typing import Array
from archfem.dynamics.solvers.newmark import StepNumbers
from archfem.joints.contact_law import ContactLaw
from archfem.joints.large.point_law import (
    closed_means,
    instant_release,
    joint_means,
    limit_rate,
    releases,
    shear_limit,
    shear_means,
)
from archfem.joints.operator import JointOperator
from archfem.joints.quadrature import JointPoints

# Difference of two rows of gaps, relative to the largest entry of their joint, of equal ones
SAME_ROW_TOLERANCE = 1e-9


def _record_type(integers: str, floats: str) -> np.dtype[Any]:
    """Return the type of a record; compiled functions take few arrays faster than many."""
    fields = [(name, np.int64) for name in integers.split()]
    return np.dtype([*fields, *((name, np.float64) for name in floats.split())], align=True)


# Properties of a joint point: segment along which its opening is interpolated, row of its slip (-1
# where slips are not followed) and joint; weight of the far end of the segment [-], closed normal
# force per opening at the near and at the far end [N/m], area (of a facet, that of the whole) [m²],
# shear stiffness [N/m], irreversible slip before the step [m], distance from mid-depth [m], and the
# parameters of the contact law.
POINT_RECORD = _record_type(
    "segment slip_row joint",
    " ".join(["share near far area shear slip lever", *ContactLaw._fields]),
)

# Forces of a point over a step: mean normal force, positive in tension [N], area that coheres [m²],
# derivatives of its released force by z at both ends of its segment [N/m], mean shear [N], elastic
# shear lost by slip [N], derivatives of the mean shear by its elastic change and by Coulomb's limit
# [-], and energy dissipated along the joint, times its shear stiffness [N²].
POINT_STATE_RECORD = _record_type("", "normal area near far shear slip by_change by_limit lost")

# Points of a joint between which the opening is linear: first point, one after the last, and rows
# of the openings at both ends.
SEGMENT_RECORD = _record_type("begin end near far", "")

# Released forces of a segment at both ends [N], and derivatives of the first by z there, of each
# by z at the other end, and of the last by z there [N/m].
SEGMENT_STATE_RECORD = _record_type("", "near far first mixed last")


class GapRows(NamedTuple):
    """Rows of gaps, openings before slips, from which the gaps at all points follow.

    Joints are cut into segments of points with the opening g = (1 - ξ) z[near] + ξ z[far]. Between
    plane faces one segment is the whole joint. Elsewhere the opening is linear along exact facets,
    which share the gap where they meet, and springs have a row each.
    """

    rows: sparse.csr_matrix  # of the gaps (r, n)
    offset: Array  # gaps of the undisplaced structure (r,) [m]
    openings: int  # number of rows that are openings
    begin: Any  # first point of each segment, and the number of points (s + 1,)
    near: Any  # row of one end of each segment (s,)
    far: Any  # row of its other end, the same where it has only one (s,)
    share: Array  # ξ of each point (p,) [-]
    group: Any  # row of each point's slip, -1 where slips are not followed (p,)

    @property
    def segment(self) -> Any:
        """Segment of each point (p,)."""
        return np.repeat(np.arange(len(self.near)), np.diff(self.begin))

    @property
    def sizes(self) -> Any:
        """Number of points of each slip row (g,)."""
        return np.bincount(self.group[self.group >= 0], minlength=len(self.offset))[self.openings :]


@lru_cache(maxsize=1)  # the pattern of the tangent and the equations of a step both need them
def gap_rows(joints: JointOperator) -> GapRows:
    """Return the rows of gaps of joints; slips are followed where any of them can slide."""
    points = joints.points
    offset = np.zeros((2, len(points.offset))) if joints.gap_offset is None else joints.gap_offset
    openings: list[int] = []
    slips: list[int] = []
    segments: list[Any] = []
    share, group = np.zeros(len(points.offset)), np.full(len(points.offset), -1)
    for joint in range(points.joint_count):
        own = np.flatnonzero(points.joint == joint)
        gaps = _dense_rows(joints.opening[own], offset[0][own])
        first, parts, share[own] = _segments(joints, own, gaps)
        segments.append(parts + np.array([own[0], len(openings), len(openings)]))
        openings += own[first].tolist()
        if joints.slides:
            first, number = _distinct_rows(_dense_rows(joints.slip[own], offset[1][own]))
            group[own] = number + len(slips)
            slips += own[first].tolist()
    begin, near, far = np.concatenate(segments).T
    return GapRows(
        sparse.vstack([joints.opening[openings], joints.slip[slips]], "csr"),
        np.concatenate([offset[0][openings], offset[1][slips]]),
        len(openings),
        np.append(begin, len(points.offset)),
        near,
        far,
        share,
        np.where(group < 0, group, group + len(openings)),
    )


def _segments(joints: JointOperator, own: Any, gaps: Array) -> tuple[Any, Any, Array]:
    """Cut a joint into segments: points that define its rows, begin, near, far (s, 3), and ξ."""
    # interpolate between the outermost points: on a plane face that is exact
    arm = joints.points.offset[own]
    ends = int(arm.argmin()), int(arm.argmax())
    length = arm[ends[1]] - arm[ends[0]]
    shares = ((arm - arm[ends[0]]) / (length if length > 0.0 else 1.0))[:, None]
    error = gaps - (1.0 - shares) * gaps[ends[0]] - shares * gaps[ends[1]]
    if np.abs(error).max() <= SAME_ROW_TOLERANCE:
        return np.array(ends), np.array([[0, 0, 1]]), shares.ravel()
    first, number = _distinct_rows(gaps)
    step = joints.law.end_count
    places = np.arange(len(own))
    parts = [places[::step], number[::step], number[step - 1 :: step]]
    return first, np.stack(parts, axis=1), (places % step).astype(float)


def _dense_rows(rows: sparse.csr_matrix, offset: Array) -> Array:
    """Return rows and offsets as dense arrays, each scaled by its largest entry (k, m)."""
    parts = rows[:, np.unique(rows.indices)].toarray(), offset[:, None]
    return np.hstack([each / max(np.abs(each).max(initial=0.0), 1e-300) for each in parts])


def _distinct_rows(rows: Array) -> tuple[Any, Any]:
    """Group equal rows; return the first row of each group, and the group of each row (k,)."""
    distinct: list[int] = []
    number = np.empty(len(rows), int)
    for row, values in enumerate(rows):
        errors = [float(np.abs(rows[first] - values).max()) for first in distinct]
        same = [k for k, error in enumerate(errors) if error <= SAME_ROW_TOLERANCE]
        if not same:
            distinct.append(row)
        number[row] = same[0] if same else len(distinct) - 1
    return np.array(distinct), number


class JointLaw(NamedTuple):
    """The joint law for one length of step, with the joints' state at the start of the step."""

    facets: bool  # whether pairs of points are facets, integrated exactly
    gain: float  # change of a gap over the step per change of z, 0 at an instant [-]
    damping_lag: float  # lag of damping over the length of the step [-]
    openings: int  # number of rows that are openings
    stored: float  # energy of the undisplaced joints, as if closed and stuck [J]
    points: Any  # records `POINT_RECORD` (p,)
    point_states: Any  # records `POINT_STATE_RECORD` (p,)
    segments: Any  # records `SEGMENT_RECORD` (s,)
    segment_states: Any  # records `SEGMENT_STATE_RECORD` (s,)
    groups: Any  # of slip rows, begin of their points in `members` and of their pairs (2, g + 1)
    members: Any  # points sorted by their slip rows (p,)
    slips: Array  # released force of each slip row [N], and its derivative there [N/m] (g, 2)
    stiffness: Array  # of openings the largest, of slips the sum of their points (r,) [N/m]
    offset: Array  # gaps of the undisplaced structure (r,) [m]
    start: Array  # gaps at the start of the step (r,) [m]
    speed: Array  # their change per step at the rates there (r,) [m]
    guess: Array  # z at which forces were evaluated last (r,) [m]


def joint_law(
    joints: JointOperator, numbers: StepNumbers, dt: float, conserving: bool
) -> tuple[JointLaw, Any, Any]:
    """Return the law of joints over steps, rows of their gaps (r, n), and pairs of these (q, 2).

    Pairs are the row of a released force and the row of z of each of its derivatives.
    """
    points, gaps = joints.points, gap_rows(joints)
    area, facets = np.repeat(joints.law.area, joints.law.end_count), joints.law.end_count == 2
    stiffness = area * points.contact.normal_stiffness
    count = len(points.offset)
    offset = np.zeros((2, count)) if joints.gap_offset is None else joints.gap_offset
    segments = _records(SEGMENT_RECORD, gaps.begin[:-1], gaps.begin[1:], gaps.near, gaps.far)
    law_points = _point_records(points, gaps, area, facets)
    members = np.argsort(gaps.group, kind="stable")
    members = members[gaps.group[members] >= 0]
    first = np.append(0, np.cumsum(gaps.sizes))
    pairs, pair = _derivative_pairs(segments, law_points["segment"], members, first, gaps.openings)
    law = JointLaw(
        facets,
        numbers.gain if conserving else 0.0,
        numbers.lag / dt,
        gaps.openings,
        0.5 * float(np.sum(offset * joints.elastic_forces(offset))),
        law_points,
        np.zeros(count, POINT_STATE_RECORD),
        segments,
        np.zeros(len(segments), SEGMENT_STATE_RECORD),
        np.stack([first, pair]),
        members,
        np.zeros((len(gaps.sizes), 2)),
        _row_stiffness(gaps, stiffness, points.shear_spring),
        gaps.offset,
        *np.zeros((3, len(gaps.offset))),
    )
    return law, gaps.rows, pairs


def _point_records(points: JointPoints, gaps: GapRows, area: Array, facets: bool) -> Any:
    """Return the records of all joint points (p,)."""
    stiffness = area * points.contact.normal_stiffness
    return _records(
        POINT_RECORD,
        gaps.segment,
        gaps.group,
        points.joint,
        gaps.share,
        *_normal_derivatives(stiffness, gaps.share, facets).T,
        area,
        points.shear_spring,
        0.0,
        points.offset,
        *points.contact,
    )


def _records(kind: np.dtype[Any], *columns: Any) -> Any:
    """Return records from one array, or one number, for each of their fields."""
    records = np.zeros(len(columns[0]), kind)
    for name, column in zip(kind.names or (), columns, strict=True):
        records[name] = column
    return records


def _row_stiffness(gaps: GapRows, stiffness: Array, shear: Array) -> Array:
    """Return the largest stiffness of each opening row, and the sum of slip rows (r,) [N/m]."""
    largest: Array = np.zeros(gaps.openings)
    for ends in (gaps.near, gaps.far):
        np.maximum.at(largest, ends[gaps.segment], stiffness)
    follows = gaps.group >= 0
    group = gaps.group[follows] - gaps.openings
    return np.append(largest, np.bincount(group, shear[follows], len(gaps.sizes)))


def _normal_derivatives(stiffness: Array, share: Array, facets: bool) -> Array:
    """Return derivatives of closed normal forces by openings at the segment's ends (p, 2)."""
    ends = np.stack([1.0 - share, share], axis=1)
    if facets:  # ∫ φ_i φ_j over a facet: 1/3 at its own end, 1/6 at the other
        other = ends.reshape(-1, 2, 2)[:, ::-1].reshape(-1, 2)
        ends = ends / 3.0 + other / 6.0
    return np.asarray(stiffness[:, None] * ends)


def _derivative_pairs(
    segments: Any, segment_of: Any, members: Any, first: Any, openings: int
) -> tuple[Any, Any]:
    """Return pairs (row of λ, row of z) with derivatives (q, 2), and where those of slips begin."""
    pairs: list[tuple[int, int]] = []
    begin = []
    for _, _, near, far in segments.tolist():
        pairs += [(near, near), (near, far), (far, near), (far, far)]
    for group in range(len(first) - 1):
        row, last = openings + group, -1
        begin.append(len(pairs))
        pairs.append((row, row))
        for point in members[first[group] : first[group + 1]]:
            if segment_of[point] != last:
                last = segment_of[point]
                pairs += [(row, segments["near"][last]), (row, segments["far"][last])]
    return np.array(pairs, np.int64).reshape(-1, 2), np.array([*begin, len(pairs)], np.int64)


@kernel
def predict_gaps(law, gap, before):  # type: ignore
    """Predict z from its rate, or at an instant from its change in the step before."""
    for row in range(len(gap)):
        if law.gain > 0.0:
            law.guess[row] = law.start[row] + law.speed[row] / law.gain
        else:
            law.guess[row] = 2.0 * gap[row] - before[row]


@kernel
def evaluate_openings(law, gap, segments):  # type: ignore
    """Evaluate normal and released forces of some segments at z, into their states."""
    half, facets, start, points = 0.5 * law.gain, law.facets, law.start, law.points
    rates, (step, area) = (1.0 - half, 1.0 + half), (2, 0.5) if facets else (1, 1.0)
    for number in segments:
        segment, state = law.segments[number], law.segment_states[number]
        # ends of the path of the gaps, at which the law sees them, on either side of z
        near, far = gap[segment.near], gap[segment.far]
        moved = half * (near - start[segment.near]), half * (far - start[segment.far])
        before, after = (near - moved[0], far - moved[1]), (near + moved[0], far + moved[1])
        stiffens = points[segment.begin].closing_rate > 0.0
        state.near = state.far = state.first = state.mixed = state.last = 0.0
        if max(before + after) <= 0.0 and not stiffens:
            # forces are linear over the whole path
            for k in range(segment.begin, segment.end):
                point, point_state = points[k], law.point_states[k]
                point_state.normal = point.near * near + point.far * far
                point_state.area = area * point.area
                point_state.near = point_state.far = 0.0
            continue
        for first in range(segment.begin, segment.end, step):
            # means over the path at a spring, or exactly over a facet
            a, b = points[first].share, points[first + step - 1].share
            ends = gaps_between(before, after, a, b)
            means = joint_means(points[first], ends, rates[0], rates[1], facets)
            closed = 0.0, 0.0
            if points[first].cohesion != 0.0:
                closed = closed_means(points[first], ends, 0.0, facets)[0]
            for end in range(step):
                # forces of the points go to the ends of the segment by linear interpolation
                point, point_state = points[first + end], law.point_states[first + end]
                _open_point(point, point_state, means, end, (a, b))
                point_state.area = point.area * closed[end]
                released, share = point.area * means[1][end], point.share
                state.near += (1.0 - share) * released
                state.far += share * released
                state.first += (1.0 - share) * point_state.near
                state.mixed += (1.0 - share) * point_state.far
                state.last += share * point_state.far


@inlined_kernel
def _open_point(point, state, means, end, shares):  # type: ignore
    """Store normal force and derivatives of a point from the means over its path."""
    (normal, _, rate), (a, b), area = means, shares, point.area
    state.normal = area * normal[end]
    # chain rule: openings of the facet's ends by those of the segment's ends
    state.near = area * (rate[end] * (1.0 - a) + rate[end + 1] * (1.0 - b))
    state.far = area * (rate[end] * a + rate[end + 1] * b)


@inlined_kernel
def between(ends, share):  # type: ignore
    """Interpolate between the ends of a segment."""
    return (1.0 - share) * ends[0] + share * ends[1]


@inlined_kernel
def gaps_between(before, after, a, b):  # type: ignore
    """Interpolate to the ends of a facet, at start and end of a step, as for `joint_means`."""
    return between(before, a), between(before, b), between(after, a), between(after, b)


@kernel
def evaluate_slips(law, gap, rows):  # type: ignore
    """Evaluate shear and released forces of some slip rows at z, after `evaluate_openings`."""
    first, start, gain, late = law.groups[0], law.start, law.gain, law.damping_lag
    for row in rows:
        slip, released, rate = gain * (gap[row] - start[row]), 0.0, 0.0
        group = row - law.openings
        for place in range(first[group], first[group + 1]):
            point, state = law.points[law.members[place]], law.point_states[law.members[place]]
            # elastic trial shear at the start, its change, and Coulomb's limit
            shear, change = point.shear * (start[row] - point.slip), point.shear * slip
            limit = shear_limit(point, state.normal, state.area)
            means = shear_means(shear, change, late, limit)
            state.shear, state.slip, state.by_change, state.by_limit, state.lost = means
            if state.by_change != 0.5 + late or state.by_limit != 0.0:
                # it slides during the step: the mean follows the friction limit
                released += shear + (0.5 + late) * change - state.shear
                rate += point.shear * (1.0 - gain * state.by_change)
        law.slips[group, 0], law.slips[group, 1] = released, rate


@kernel
def collect_released(law, selection, released):  # type: ignore
    """Sum up released forces of selected rows: their places, their segments, their slip rows."""
    (place, segments, slips), openings = selection, law.openings
    released[:] = 0.0
    for number in segments:
        segment, state = law.segments[number], law.segment_states[number]
        released[place[segment.near]] += state.near
        released[place[segment.far]] += state.far
    for row in slips:
        released[place[row]] = law.slips[row - openings, 0]


@kernel
def collect_derivatives(law, selection, entries):  # type: ignore
    """List the derivatives λ′ that are not zero of selected rows; returns how many there are.

    Entries are place of the force, place of z and number of the pair (m, 3), and values (m,).
    """
    (place, segments, slips), count, openings = selection, 0, law.openings
    for number in segments:
        segment, state = law.segments[number], law.segment_states[number]
        if state.first != 0.0 or state.last != 0.0:
            a, b, pair = place[segment.near], place[segment.far], 4 * number
            _enter(entries, count, (a, a, pair), state.first)
            _enter(entries, count + 1, (a, b, pair + 1), state.mixed)
            _enter(entries, count + 2, (b, a, pair + 2), state.mixed)
            _enter(entries, count + 3, (b, b, pair + 3), state.last)
            count += 4
    for row in slips:
        group = row - openings
        if law.slips[group, 0] != 0.0 or law.slips[group, 1] != 0.0:
            count = _slip_derivatives(law, place, row, entries, count)
    return count


@inlined_kernel
def _slip_derivatives(law, place, row, entries, count):  # type: ignore
    """List the derivatives of a slip row by its slip and, as friction grows, by openings."""
    group, last, entered = row - law.openings, -1, -1
    pair, k = law.groups[1, group] - 1, place[row]
    _enter(entries, count, (k, k, pair + 1), law.slips[group, 1])
    count += 1
    for member in range(law.groups[0, group], law.groups[0, group + 1]):
        point, state = law.points[law.members[member]], law.point_states[law.members[member]]
        if point.segment != last:
            last, pair = point.segment, pair + 2
        if state.by_limit == 0.0 or point.friction == 0.0:
            continue
        if entered != last:
            segment, entered = law.segments[last], last
            _enter(entries, count, (k, place[segment.near], pair), 0.0)
            _enter(entries, count + 1, (k, place[segment.far], pair + 1), 0.0)
            count += 2
        # normal force of the point: that of a closed point, less the force that it releases
        entries[1][count - 2] -= state.by_limit * limit_rate(point, point.near - state.near, 0.0)
        entries[1][count - 1] -= state.by_limit * limit_rate(point, point.far - state.far, 0.0)
    return count


@inlined_kernel
def _enter(entries, number, where, value):  # type: ignore
    """Store one derivative: its places (row, column, pair) and its value."""
    for k in range(3):
        entries[0][number, k] = where[k]
    entries[1][number] = value


@kernel
def open_forces(law, gap, released):  # type: ignore
    """Evaluate the forces that joints release at an instant, of all opening rows; their energy."""
    points, facets, energy = law.points, law.facets, 0.0
    released[:] = 0.0
    for segment in law.segments:
        opening, first = (gap[segment.near], gap[segment.far]), points[segment.begin]
        if not releases(first, opening):
            continue
        if facets:  # they cover their segment: integrals over them are one over all of it
            area = 0.0
            for number in range(segment.begin, segment.end, 2):
                area += points[number].area
            taken, lacking = instant_release(first, opening + opening, True)
            released[segment.near] += area * taken[0]
            released[segment.far] += area * taken[1]
            energy += area * lacking
            continue
        for number in range(segment.begin, segment.end):
            point, place = points[number], between(opening, points[number].share)
            taken, lacking = instant_release(point, (place, place, place, place), False)
            force = point.area * taken[0]
            released[segment.near] += (1.0 - point.share) * force
            released[segment.far] += point.share * force
            energy += point.area * lacking
    return energy


@kernel
def largest_force(law, gap):  # type: ignore
    """Return the largest force of a row if all joints were closed and stuck, for tolerances.

    The rounding of a slip, times its stiffness, bounds the accuracy of λ where points slide; where
    they have slid far it exceeds all forces. Four units in the last place, over the tolerance.
    """
    largest, openings = 0.0, law.openings
    for row in range(openings):
        largest = max(largest, law.stiffness[row] * abs(gap[row]))
    for row in range(openings, len(gap)):
        round_off = (4.0 * 2.2e-16 / 1e-12) * abs(gap[row])
        largest = max(largest, law.stiffness[row] * round_off)
    return largest


@kernel
def hold_reversed(last, released, entries, count):  # type: ignore
    """Hold points that reversed their slip: set their λ and λ′ to zero, as if they stuck."""
    rows, values = entries
    for k in range(count):
        if last[rows[k, 0]] * released[rows[k, 0]] < 0.0:
            values[k] = 0.0
    for row in range(len(released)):
        if last[row] * released[row] < 0.0:
            released[row] = 0.0


@kernel
def add_derivatives(entries, count, along, result):  # type: ignore
    """Add the change λ′ Δz of the released forces due to a change `along` of the gaps."""
    rows, values = entries
    for k in range(count):
        result[rows[k, 0]] += values[k] * along[rows[k, 1]]
