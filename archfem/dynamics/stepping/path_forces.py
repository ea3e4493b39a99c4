"""What joints carry over a step, compiled: stretch by stretch across them, row by row along them.

The law of `path_law`. A facet is cut where it opens or closes at either end of the path of its
gaps, as in `facets.Facets`; where it stays closed or open all the way, what it carries is linear.
"""

import numba
import numpy as np

from archfem.joints.moving.means import facet_means, point_means


@numba.njit(cache=True)
def press(law, gap, stretches):  # type: ignore
    """Find what stretches of joints carry across them over the step.

    Args:
        law: `PathLaw`, whose `work` is filled.
        gap: z, of all rows (r,) [m].
        stretches: their numbers (k,).
    """
    half, facets, start = 0.5 * law.gain, law.still.facets, law.start
    points, parts, pressed, carried = law.points, law.stretches, law.work.points, law.work.stretches
    for number in stretches:
        part = parts[number]
        near, far = gap[part.near], gap[part.far]
        moved = half * (near - start[part.near]), half * (far - start[part.far])
        before, after = (near - moved[0], far - moved[1]), (near + moved[0], far + moved[1])
        if max(before[0], before[1], after[0], after[1]) <= 0.0:
            _press_closed((points, pressed), part, (near, far), facets)
        else:
            _press_open((points, pressed), part, (before, after), (facets, half))
        _sum_up((points, pressed), part, carried[number])


@numba.njit(cache=True)
def _press_closed(points, part, gaps, facets):  # type: ignore
    """What points of a stretch carry that stays closed."""
    known, found = points
    for k in range(part.begin, part.end):
        point, pressed = known[k], found[k]
        pressed.normal = point.near * gaps[0] + point.far * gaps[1]
        pressed.area = 0.5 * point.whole if facets else point.whole
        pressed.taken = pressed.near = pressed.far = 0.0


@numba.njit(cache=True)
def _press_open(points, part, path, rule):  # type: ignore
    """What points of a stretch carry that opens, or closes, somewhere on its path."""
    (known, found), (before, after), (facets, half) = points, path, rule
    for k in range(part.begin, part.end, 2 if facets else 1):
        point, other = known[k], k + 1 if facets else k
        a, b = point.share, known[other].share
        ends = between(before, a), between(before, b), between(after, a), between(after, b)
        normal, taken, rate, time = _means(ends, (1.0 - half, 1.0 + half), facets)
        for end in range(other - k + 1):
            pressed = found[k + end]
            pressed.normal = point.stiffness * normal[end]
            pressed.taken = point.stiffness * taken[end]
            pressed.area = point.whole * time[end]
            first, second = point.stiffness * rate[end], point.stiffness * rate[end + 1]
            pressed.near = first * (1.0 - a) + second * (1.0 - b)
            pressed.far = first * a + second * b


@numba.njit(cache=True)
def _sum_up(points, part, carried):  # type: ignore
    """λ of a stretch and its derivatives, from those of its points."""
    (known, found), near, far, first, mixed, last = points, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(part.begin, part.end):
        share, pressed = known[k].share, found[k]
        near += (1.0 - share) * pressed.taken
        far += share * pressed.taken
        first += (1.0 - share) * pressed.near
        mixed += (1.0 - share) * pressed.far
        last += share * pressed.far
    carried.near, carried.far = near, far
    carried.first, carried.mixed, carried.last = first, mixed, last


@numba.njit(cache=True)
def _means(ends, rates, facets):  # type: ignore
    """What `facet_means` gives of a facet, or with zeros `point_means` of a spring."""
    if facets and (max(ends) <= 0.0 or min(ends) > 0.0):
        return _whole_means(ends, 0.5 * (rates[0] + rates[1]))
    if facets:
        return facet_means(ends, rates[0], rates[1])
    normal, taken, rate, time = point_means(ends[0], ends[2], rates[0], rates[1])
    return (normal, 0.0), (taken, 0.0), (rate, 0.0, 0.0), (time, 0.0)


@numba.njit(cache=True)
def between(ends, share):  # type: ignore
    """Return the value at a point of a stretch.

    Args:
        ends: values at its ends.
        share: of the far one [-].
    """
    return (1.0 - share) * ends[0] + share * ends[1]


@numba.njit(cache=True)
def _whole_means(ends, rate):  # type: ignore
    """The same of a facet that is closed, or open, everywhere and all the way."""
    a, c, b, d = ends
    near, far = (a + b) / 12.0, (c + d) / 12.0
    means, none = (2.0 * near + far, near + 2.0 * far), (0.0, 0.0)
    if max(ends) <= 0.0:
        return means, none, (0.0, 0.0, 0.0), (0.5, 0.5)
    return none, means, (rate / 3.0, rate / 6.0, rate / 3.0), none


@numba.njit(cache=True)
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
                shear, slid, by_change, by_limit, rubbing = _rub(held, change, late, limit)
                passed.shear, passed.slides = shear, slid / point.elastic
                passed.by_change, passed.by_limit = by_change, by_limit
                passed.lost = rubbing / point.elastic
                taken += trial - shear
                rate += point.elastic * (1.0 - gain * by_change)
        along[group, 0], along[group, 1] = taken, rate


@numba.njit(cache=True)
def _rub(first, change, late, limit):  # type: ignore
    """Shear of a point that slides during the step, as `joints.law.shear_over_step`.

    Returns:
        Mean shear, what the elastic shear loses by sliding, derivatives of the mean by its elastic
        change and by the limit, and the energy lost times the stiffness.
    """
    start = min(max(first, -limit), limit)
    last = min(max(start + change, -limit), limit)
    over = start + change - last
    slid = min(max(over / change, 0.0), 1.0) if over != 0.0 and change != 0.0 else 0.0
    mean = start + 0.5 * change - 0.5 * over * slid
    shear = min(max(mean + late * change, -limit), limit)
    if abs(mean + late * change) > limit:
        by_change, by_limit = 0.0, np.sign(shear)
    else:
        lost = np.sign(first) if abs(first) > limit else 0.0
        by_change = 0.5 * (1.0 - slid) ** 2 + late
        by_limit = (1.0 - slid) * lost + slid * np.sign(change)
    rubbing = 0.5 * (first**2 - start**2) + abs(over) * limit + (shear - mean) * change
    return shear, first + change - last, by_change, by_limit, rubbing
