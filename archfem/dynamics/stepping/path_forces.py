"""What joints carry over a step, compiled: stretch by stretch across them, row by row along them.

The law of `path_law`. A facet is cut where it opens or closes at either end of the path of its
gaps, as in `facets.Facets`; where it stays closed or open all the way, what it carries is linear.
"""

import numba
import numpy as np

from archfem.joints.moving.means import facet_means, point_means, shear_means


@numba.njit(cache=True)
def press(law, gap, stretches):  # type: ignore
    """Find what stretches of joints carry across them over the step.

    Args:
        law: `PathLaw`, whose `work` is filled.
        gap: z, of all rows (r,) [m].
        stretches: their numbers (k,).
    """
    half, facets, work = 0.5 * law.gain, law.still.facets, law.work
    for stretch in stretches:
        near, far = law.near[stretch], law.far[stretch]
        moved = half * (gap[near] - law.start[near]), half * (gap[far] - law.start[far])
        before = gap[near] - moved[0], gap[far] - moved[1]
        after = gap[near] + moved[0], gap[far] + moved[1]
        for point in range(law.begin[stretch], law.begin[stretch + 1], 2 if facets else 1):
            other = point + 1 if facets else point
            a, b = law.share[point], law.share[other]
            ends = between(before, a), between(before, b), between(after, a), between(after, b)
            normal, taken, rate, time = _means(ends, (1.0 - half, 1.0 + half), facets)
            stiffness, area = law.still.stiffness[point], law.area[point]
            for k in range(other - point + 1):
                work.normal[point + k] = stiffness * normal[k]
                work.taken[point + k] = stiffness * taken[k]
                work.area[point + k] = area * time[k]
                by = stiffness * rate[k], stiffness * rate[k + 1]
                work.rate[point + k, 0] = by[0] * (1.0 - a) + by[1] * (1.0 - b)
                work.rate[point + k, 1] = by[0] * a + by[1] * b
    _sum_up(law, stretches)


@numba.njit(cache=True)
def _sum_up(law, stretches):  # type: ignore
    """λ of stretches and its derivatives, from those of their points."""
    work = law.work
    for stretch in stretches:
        near = far = first = mixed = last = 0.0
        for point in range(law.begin[stretch], law.begin[stretch + 1]):
            share, taken = law.share[point], work.taken[point]
            near += (1.0 - share) * taken
            far += share * taken
            first += (1.0 - share) * work.rate[point, 0]
            mixed += (1.0 - share) * work.rate[point, 1]
            last += share * work.rate[point, 1]
        work.ends[stretch, 0], work.ends[stretch, 1] = near, far
        work.rates[stretch, 0], work.rates[stretch, 1] = first, mixed
        work.rates[stretch, 2] = last


@numba.njit(cache=True)
def _means(ends, rates, facets):  # type: ignore
    """What `facet_means` gives of a facet, or with zeros `point_means` of a spring."""
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
def slide(law, gap, rows):  # type: ignore
    """Find what the points of rows of slips carry along the joints over the step.

    Args:
        law: `PathLaw`, whose `work` is filled; `press` has been there for their points.
        gap: z, of all rows (r,) [m].
        rows: of slips (k,).
    """
    work, late, openings = law.work, law.late, len(law.stiffness)
    for row in rows:
        slip, taken, rate = law.gain * (gap[row] - law.start[row]), 0.0, 0.0
        group = row - openings
        for place in range(law.first[group], law.first[group + 1]):
            point = law.members[place]
            stiffness, limit = law.shear[point], np.inf
            first = stiffness * (law.start[row] - law.slid[point])
            if law.friction[point] < np.inf:
                limit = law.cohesion[point] * work.area[point]
                limit = max(limit - law.friction[point] * work.normal[point], 0.0)
            change = stiffness * slip
            trial = first + (0.5 + late) * change
            work.lost[point] = late * change * slip
            work.held[point, 0], work.held[point, 1] = 0.5 + late, 0.0
            work.shear[point], work.slid[point] = trial, 0.0
            if max(abs(first), abs(first + change), abs(trial)) > limit:
                shear, slid, by_change, by_limit, rubbing = shear_means(first, change, late, limit)
                work.shear[point], work.slid[point] = shear, slid / stiffness
                work.held[point, 0], work.held[point, 1] = by_change, by_limit
                work.lost[point] = rubbing / stiffness
                taken += trial - shear
                rate += stiffness * (1.0 - law.gain * by_change)
        work.along[group, 0], work.along[group, 1] = taken, rate
