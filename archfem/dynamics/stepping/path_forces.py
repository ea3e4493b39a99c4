"""What joints carry over a step, compiled: stretch by stretch across them, row by row along them.

The law of `path_law`. A facet is cut where it opens or closes at either end of the path of its
gaps, as in `facets.Facets`; where it stays closed or open all the way, what it carries is linear.
"""

import numpy as np

from archfem.joints.moving.compiled import computing, inlined
from archfem.joints.moving.means import facet_means, point_means, shear_means


@computing
def press(law, gap, stretches):  # type: ignore
    """Find what stretches of joints carry across them over the step.

    Args:
        law: `PathLaw`, whose `work` is filled.
        gap: z, of all rows (r,) [m].
        stretches: their numbers (k,).
    """
    half, facets, start, points = 0.5 * law.gain, law.still.facets, law.start, law.points
    parts, pressed, carried = law.stretches, law.work.points, law.work.stretches
    step, area = (2, 0.5) if facets else (1, 1.0)
    for number in stretches:
        part, found = parts[number], carried[number]
        near, far = gap[part.near], gap[part.far]
        moved = half * (near - start[part.near]), half * (far - start[part.far])
        before, after = (near - moved[0], far - moved[1]), (near + moved[0], far + moved[1])
        found.near = found.far = found.first = found.mixed = found.last = 0.0
        if max(before[0], before[1], after[0], after[1]) <= 0.0:
            for k in range(part.begin, part.end):
                point, passed = points[k], pressed[k]
                passed.normal = point.near * near + point.far * far
                passed.area = area * point.whole
                passed.near = passed.far = 0.0
            continue
        for first in range(part.begin, part.end, step):
            a, b = points[first].share, points[first + step - 1].share
            ends = between(before, a), between(before, b), between(after, a), between(after, b)
            means = _means(ends, (1.0 - half, 1.0 + half), facets)
            for end in range(step):
                point, passed = points[first + end], pressed[first + end]
                _open_point(point, passed, means, end, (a, b))
                taken, share = point.stiffness * means[1][end], point.share
                found.near += (1.0 - share) * taken
                found.far += share * taken
                found.first += (1.0 - share) * passed.near
                found.mixed += (1.0 - share) * passed.far
                found.last += share * passed.far


@inlined
def _open_point(point, passed, means, end, shares):  # type: ignore
    """What a point carries of a facet, or a spring, that opens or closes on its path."""
    (normal, _, rate, time), (a, b), stiffness = means, shares, point.stiffness
    passed.normal = stiffness * normal[end]
    passed.area = point.whole * time[end]
    passed.near = stiffness * (rate[end] * (1.0 - a) + rate[end + 1] * (1.0 - b))
    passed.far = stiffness * (rate[end] * a + rate[end + 1] * b)


@inlined
def _means(ends, rates, facets):  # type: ignore
    """What `facet_means` gives of a facet, or with zeros `point_means` of a spring."""
    if facets:
        return facet_means(ends, rates[0], rates[1])
    normal, taken, rate, time = point_means(ends[0], ends[2], rates[0], rates[1])
    return (normal, 0.0), (taken, 0.0), (rate, 0.0, 0.0), (time, 0.0)


@inlined
def between(ends, share):  # type: ignore
    """Return the value at a point of a stretch.

    Args:
        ends: values at its ends.
        share: of the far one [-].
    """
    return (1.0 - share) * ends[0] + share * ends[1]


@computing
def slide(law, gap, rows):  # type: ignore
    """Find what the points of rows of slips carry along the joints over the step.

    Args:
        law: `PathLaw`, whose `work` is filled; `press` has been there for their points.
        gap: z, of all rows (r,) [m].
        rows: of slips (k,).
    """
    known, found, along, members = law.points, law.work.points, law.work.along, law.members
    first, start, gain, late = law.first, law.start, law.gain, law.late
    for row in rows:
        slip, taken, rate = gain * (gap[row] - start[row]), 0.0, 0.0
        group = row - len(law.stiffness)
        for place in range(first[group], first[group + 1]):
            point, passed = known[members[place]], found[members[place]]
            held, change = point.elastic * (start[row] - point.slid), point.elastic * slip
            limit = np.inf
            if point.friction < np.inf:
                limit = max(point.cohesion * passed.area - point.friction * passed.normal, 0.0)
            trial = held + (0.5 + late) * change
            passed.lost, passed.shear, passed.slides = late * change * slip, trial, 0.0
            passed.by_change, passed.by_limit = 0.5 + late, 0.0
            if max(abs(held), abs(held + change), abs(trial)) > limit:
                shear, slid, by_change, by_limit, rubbing = shear_means(held, change, late, limit)
                passed.shear, passed.slides = shear, slid / point.elastic
                passed.by_change, passed.by_limit = by_change, by_limit
                passed.lost = rubbing / point.elastic
                taken += trial - shear
                rate += point.elastic * (1.0 - gain * by_change)
        along[group, 0], along[group, 1] = taken, rate
