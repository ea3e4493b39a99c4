"""The joint law over a step, compiled: what joints carry on the mean, and what they do not.

The same law as `archfem.joints.passage`, written for loops. A row of gaps is an opening at a point,
or the slip that some points of a joint have in common; with all joints closed and none sliding
forces are linear in them. The law takes out of those

    λ = K z - f̄(z),

z the gaps at the middle of the path that the joints feel, which is zero where a joint stays closed
and holds. A facet is cut where it opens or closes at either end of the path, as in `facets.Facets`.
"""

from typing import Any, NamedTuple

import numba
import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.dynamics.stepping.joint_law import Law, law_of
from archfem.dynamics.stepping.newmark import Numbers
from archfem.joints.facets import PLACES, SHARES
from archfem.joints.operator import JointOperator

SAME = 1e-9
"""Difference of two rows of slips, relative to the largest entry, below which they are one."""


class Work(NamedTuple):
    """What joints do over a step, as found last; filled anew by `press` and `slide`.

    Attributes:
        normal: mean normal forces, positive where they pull (p,) [N].
        area: mean closed area (p,) [m²].
        taken: λ of all rows (r,) [N].
        rate: derivatives of λ at a point by z there and at the other end of its facet (p, 2) [N/m].
        shear: mean shear forces (p,) [N].
        slid: what points slide (p,) [m].
        rates: derivatives of the mean shear by its elastic change and by the limit (p, 2) [-].
        lost: energy that friction and damping take along each point (p,) [J].
    """

    normal: Array
    area: Array
    taken: Array
    rate: Array
    shear: Array
    slid: Array
    rates: Array
    lost: Array


class PathLaw(NamedTuple):
    """The joint law over steps of one length, and the joints at the start of the step at hand.

    Attributes:
        still: the law at an instant.
        gain: change of a gap over the step per change of z [-].
        late: lag of damping over the length of the step [-].
        area: of each point, that of the whole facet where facets are exact (p,) [m²].
        friction: μ (p,) [-].
        cohesion: c (p,) [Pa].
        shear: elastic shear force per slip (p,) [N/m].
        group: row of each point's slip, -1 where slips are not followed (p,).
        first: where in `members` the points of each row of slips begin (g + 1,).
        members: points, sorted by their rows of slips (p,).
        offset: gaps before anything moves, of all rows (r,) [m].
        start: gaps at the start of the step, of all rows (r,) [m].
        speed: change of the gaps per step at their rates there (r,) [m].
        slid: how far points have slid for good before (p,) [m].
        guess: of z at all rows (r,) [m].
        stored: energy of joints before anything moves, if they held tension [J].
        work: room for what joints do over it.
    """

    still: Law
    gain: float
    late: float
    area: Array
    friction: Array
    cohesion: Array
    shear: Array
    group: Any
    first: Any
    members: Any
    offset: Array
    start: Array
    speed: Array
    slid: Array
    guess: Array
    stored: float
    work: Work


def path_law(joints: JointOperator, numbers: Numbers, dt: float) -> tuple[PathLaw, Any]:
    """Return the law of some joints over steps, and the rows of their gaps.

    Args:
        joints: whose slips are followed where any of them can slide.
        numbers: of the time step.
        dt: its length [s].

    Returns:
        The law, and the rows: openings of all points, then slips that differ (r, n).
    """
    points, still = joints.points, law_of(joints)
    kept, group = _slips(joints) if joints.slides else (np.zeros(0, int), np.full(0, -1))
    count = len(points.arm)
    rows = sparse.vstack([joints.opening, joints.slip[kept]], "csr")
    offset = np.zeros((2, count)) if joints.offset is None else joints.offset
    sizes = np.bincount(group, minlength=len(kept)) if len(kept) else np.zeros(0, int)
    area = points.weight.copy()
    if still.facets:
        area = np.repeat(area[0::2] + area[1::2], 2)
    law = PathLaw(
        still,
        numbers.gain,
        numbers.lag / dt,
        area,
        points.friction,
        points.cohesion,
        points.shear,
        count + group if len(kept) else np.full(count, -1),
        np.append(0, np.cumsum(sizes)),
        np.argsort(group, kind="stable") if len(kept) else np.zeros(0, int),
        np.concatenate([offset[0], offset[1][kept]]),
        np.zeros(count + len(kept)),
        np.zeros(count + len(kept)),
        np.zeros(count),
        np.zeros(count + len(kept)),
        0.5 * float(np.sum(offset * joints.bonded(offset))),
        _room(count, count + len(kept)),
    )
    return law, rows


def _room(points: int, rows: int) -> Work:
    """Room for what joints do over a step."""
    normal, area, shear, slid, lost = np.zeros((5, points))
    rate, rates = np.zeros((2, points, 2))
    return Work(normal, area, np.zeros(rows), rate, shear, slid, rates, lost)


def _slips(joints: JointOperator) -> tuple[Any, Any]:
    """Points whose slips differ from those before them on the joint; whose each point has."""
    kept: list[int] = []
    group = np.empty(len(joints.points.arm), int)
    for joint in range(joints.points.count):
        own = np.flatnonzero(joints.points.joint == joint)
        block = joints.slip[own]
        columns = np.unique(block.indices)
        dense = block[:, columns].toarray() / max(abs(block.data).max(initial=0.0), 1e-300)
        found: list[int] = []
        for row, values in enumerate(dense):
            same = [k for k in found if np.abs(dense[k] - values).max(initial=0.0) <= SAME]
            if not same:
                found.append(row)
                same = [row]
            group[own[row]] = len(kept) + found.index(same[0])
        kept += own[found].tolist()
    return np.array(kept), group


@numba.njit(cache=True)
def press(law, gap, row):  # type: ignore
    """Find what a point, or both ends of its facet, carries across the joint over the step.

    Args:
        law: `PathLaw`, whose `work` is filled.
        gap: z, of all rows (r,) [m].
        row: of a point, or of the first end of a facet.
    """
    half, still, work = 0.5 * law.gain, law.still, law.work
    stiffness, area = still.stiffness[row], law.area[row]
    moved = half * (gap[row] - law.start[row])
    a, b = gap[row] - moved, gap[row] + moved
    if not still.facets:
        normal, taken, rate, time = point_means(a, b, 1.0 - half, 1.0 + half)
        work.normal[row], work.taken[row] = stiffness * normal, stiffness * taken
        work.rate[row, 0], work.area[row] = stiffness * rate, area * time
        return
    far = row + 1
    moved = half * (gap[far] - law.start[far])
    ends = (a, gap[far] - moved, b, gap[far] + moved)
    if a <= 0.0 and b <= 0.0 and ends[1] <= 0.0 and ends[3] <= 0.0:
        near, other = stiffness * gap[row] / 6.0, stiffness * gap[far] / 6.0
        work.normal[row], work.normal[far] = 2.0 * near + other, near + 2.0 * other
        work.taken[row] = work.taken[far] = 0.0
        work.rate[row, 0] = work.rate[row, 1] = work.rate[far, 0] = work.rate[far, 1] = 0.0
        work.area[row] = work.area[far] = 0.5 * area
        return
    normal, taken, rate, time = facet_means(ends, 1.0 - half, 1.0 + half)
    work.normal[row], work.normal[far] = stiffness * normal[0], stiffness * normal[1]
    work.taken[row], work.taken[far] = stiffness * taken[0], stiffness * taken[1]
    work.rate[row, 0], work.rate[far, 0] = stiffness * rate[0], stiffness * rate[2]
    work.rate[row, 1] = work.rate[far, 1] = stiffness * rate[1]
    work.area[row], work.area[far] = area * time[0], area * time[1]


@numba.njit(cache=True)
def point_means(a, b, first, second):  # type: ignore
    """Return means over a step of closing and of opening at a place, rate of the latter, and time.

    Args:
        a: gap at the start of its path [m].
        b: gap at the end [m].
        first: change of the start with a parameter [-].
        second: change of the end with it [-].
    """
    if a <= 0.0 and b <= 0.0:
        return 0.5 * (a + b), 0.0, 0.0, 1.0
    if a > 0.0 and b > 0.0:
        return 0.0, 0.5 * (a + b), 0.5 * (first + second), 0.0
    whole = abs(a) + abs(b)
    opened, closed = max(a, b) / whole, -min(a, b) / whole
    square = 0.5 * opened**2
    rate = first * (opened - square if a > 0.0 else square)
    rate += second * (opened - square if b > 0.0 else square)
    return 0.5 * min(a, b) * closed, 0.5 * max(a, b) * opened, rate, closed


@numba.njit(cache=True)
def facet_means(ends, first, second):  # type: ignore
    """Return the same integrated with the linear functions of a facet of unit length.

    Args:
        ends: gaps of both ends at the start, and of both at the end, of their paths [m].
        first: change of the start with a parameter [-].
        second: change of the end with it [-].
    """
    a, c, b, d = ends
    low = a / (a - c) if (a <= 0.0) != (c <= 0.0) else 0.0
    high = b / (b - d) if (b <= 0.0) != (d <= 0.0) else 0.0
    breaks = (0.0, min(low, high), max(low, high), 1.0)
    n0 = n1 = t0 = t1 = r00 = r01 = r11 = s0 = s1 = 0.0
    for piece in range(3):
        length = breaks[piece + 1] - breaks[piece]
        if length <= 0.0:
            continue
        for k in range(3):
            place = breaks[piece] + PLACES[k] * length
            near, far = 1.0 - place, place
            normal, taken, rate, time = point_means(
                near * a + far * c, near * b + far * d, first, second
            )
            weight = SHARES[k] * length
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


@numba.njit(cache=True)
def slide(law, gap, row):  # type: ignore
    """Find what the points of a row of slips carry along the joint over the step.

    Args:
        law: `PathLaw`, whose `work` is filled; `press` has been there for its points.
        gap: z, of all rows (r,) [m].
        row: of slips.

    Returns:
        Derivative of λ by z of this row [N/m].
    """
    work, late = law.work, law.late
    slip, taken, rate = law.gain * (gap[row] - law.start[row]), 0.0, 0.0
    group = row - len(law.group)
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
        work.rates[point, 0], work.rates[point, 1] = 0.5 + late, 0.0
        work.shear[point], work.slid[point] = trial, 0.0
        if max(abs(first), abs(first + change), abs(trial)) > limit:
            _rub(work, point, (first, change, late, limit), stiffness)
            taken += trial - work.shear[point]
            rate += stiffness * (1.0 - law.gain * work.rates[point, 0])
    work.taken[row] = taken
    return rate


@numba.njit(cache=True)
def _rub(work, point, step, stiffness):  # type: ignore
    """Shear of a point that slides during the step, as `joints.law.shear_over_step`."""
    first, change, late, limit = step
    start = min(max(first, -limit), limit)
    last = min(max(start + change, -limit), limit)
    over = start + change - last
    slid = min(max(over / change, 0.0), 1.0) if over != 0.0 and change != 0.0 else 0.0
    mean = start + 0.5 * change - 0.5 * over * slid
    shear = min(max(mean + late * change, -limit), limit)
    work.shear[point], work.slid[point] = shear, (first + change - last) / stiffness
    if abs(mean + late * change) > limit:
        work.rates[point, 0], work.rates[point, 1] = 0.0, np.sign(shear)
    else:
        lost = np.sign(first) if abs(first) > limit else 0.0
        work.rates[point, 0] = 0.5 * (1.0 - slid) ** 2 + late
        work.rates[point, 1] = (1.0 - slid) * lost + slid * np.sign(change)
    rubbing = 0.5 * (first**2 - start**2) + abs(over) * limit + (shear - mean) * change
    work.lost[point] = rubbing / stiffness
