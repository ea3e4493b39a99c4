"""The small problem of a step over which joints open and slide: Newton's method at its rows.

A joint that slides lowers its shear as it opens, but does not open as it slides: λ is not the
gradient of an energy, and the problem

    z = z₀ + F λ(z),

is not symmetric. It is solved by Newton's method, (1 - F λ') δ = z₀ + F λ - z, in the rows that
open or slide and in the openings that press on those, by a dense factor where they are few and by
stabilised biconjugate gradients (van der Vorst, SIAM J. Sci. Stat. Comput. 13 (1992) 631) where
they are many. Where the passes go round in a circle of holding and sliding they go less far.
"""

import numba
import numpy as np

from archfem.dynamics.stepping.loop import ITERATIONS
from archfem.dynamics.stepping.open_points import chosen, square
from archfem.dynamics.stepping.path_forces import press, slide
from archfem.dynamics.stepping.path_law import PathLaw
from archfem.dynamics.stepping.small_problem import (
    AHEAD,
    EXACT,
    ROUNDED,
    add_held,
    exact,
    expected,
    largest,
    release,
    shift,
    solved_by,
)
from archfem.dynamics.stepping.sparse_rows import add_rows

FEW = 60
"""Rows up to which the problem is solved directly."""

WHOLE = 4
"""Passes that take whole steps anyhow."""

SLOW = 0.7
"""Error left by a pass, of that before, above which passes are taken to go in a circle."""

CALM = 3
"""Passes that do not, one after another, after which a whole step is tried again."""

ROUGH = 1e-3
"""Residual of biconjugate gradients, relative to the first, where a pass is not the last."""


def _shifted(law, gap):  # type: ignore
    """Add to gaps found from displacements those before anything moves."""
    for row in range(len(gap)):
        gap[row] += law.offset[row]


def _held(law, opening, right):  # type: ignore
    """Add to a right side what joints would carry more had nothing slid before the step."""
    force, openings = np.zeros(len(law.start)), len(law.stiffness)
    for point in range(len(law.group)):
        if law.group[point] >= 0:
            force[law.group[point]] += law.shear[point] * law.slid[point]
    add_rows(opening, np.arange(openings, len(force)), force, right)


def _largest(law, gap):  # type: ignore
    """Return the largest force of a point if all joints held tension."""
    return np.max(law.stiffness * np.abs(gap[: len(law.stiffness)]))


def _foreseen(law, gap, before, force):  # type: ignore
    """Return which rows are at work, or will be soon if they go on as they did (r,)."""
    works, near = force != 0.0, force != 0.0
    for row in range(len(gap)):
        law.guess[row] = law.start[row] + law.speed[row] / law.gain
        if row < len(law.stiffness) and gap[row] + AHEAD * (gap[row] - before[row]) > 0.0:
            works[row] = True
    for stretch in range(len(law.near)):
        a, b = law.near[stretch], law.far[stretch]
        if works[a] or works[b]:
            near[a] = near[b] = True
            for point in range(law.begin[stretch], law.begin[stretch + 1]):
                if law.group[point] >= 0:
                    near[law.group[point]] = True
    _involve(law, near)
    return near


@numba.njit(cache=True)
def _involve(law, near):  # type: ignore
    """Add to rows of slips at work the openings that press on their points."""
    for point in range(len(law.group)):
        if law.group[point] >= 0 and near[law.group[point]]:
            stretch = law.stretch[point]
            near[law.near[stretch]] = near[law.far[stretch]] = True


def _fits(law, gap, force, near):  # type: ignore
    """Return whether the gaps ask for the λ they were found with; adds rows at work to near."""
    openings, wanted = len(law.stiffness), np.zeros(len(gap))
    law.guess[:] = gap
    press(law, gap, np.arange(len(law.near)))
    slide(law, gap, np.arange(openings, len(gap)))
    for stretch in range(len(law.near)):
        a, b = law.near[stretch], law.far[stretch]
        wanted[a] += law.work.ends[stretch, 0]
        wanted[b] += law.work.ends[stretch, 1]
        if law.work.ends[stretch, 0] != 0.0 or law.work.ends[stretch, 1] != 0.0:
            near[a] = near[b] = True
    for row in range(openings, len(gap)):
        wanted[row] = law.work.along[row - openings, 0]
        near[row] = near[row] or wanted[row] != 0.0
    _involve(law, near)
    return np.max(np.abs(wanted - force)) <= EXACT * largest(law, gap)


def _released(law, start, rows, compliance, force, enough):  # type: ignore
    """Find λ where it may differ from zero; passes, or -1 if it does not settle."""
    size, local = len(rows), np.full(len(start), -1)
    for k in range(size):
        local[rows[k]] = k
    slips = rows[np.searchsorted(rows, len(law.stiffness)) :]
    known = local, np.flatnonzero((local[law.near] >= 0) & (local[law.far] >= 0)), slips
    matrix, free, own = square(compliance, rows), chosen(start, rows), chosen(force, rows)
    gap, z, last = law.guess.copy(), chosen(law.guess, rows), np.inf
    wanted, share, calm = np.empty(size), 1.0, 0
    entries = (law.work.places, law.work.values)
    count = _taken(law, gap, known, wanted)
    for passes in range(1, ITERATIONS + 1):
        wanted += _newton(matrix, free + matrix @ wanted - z, entries, count)
        for k in range(size):
            own[k] += share * (wanted[k] - own[k])
        z = free + matrix @ own
        for k in range(size):
            gap[rows[k]] = z[k]
        count = _taken(law, gap, known, wanted)
        off = np.max(np.abs(wanted - own))
        if off <= enough or last <= off <= ROUNDED * enough:
            for k in range(size):
                force[rows[k]] = own[k]
            return passes
        calm = calm + 1 if off <= SLOW * last else 0
        share = 1.0 if passes < WHOLE or calm >= CALM else 0.5
        last = off
    return -1


solved_by(
    PathLaw,
    (expected, _foreseen),
    (release, _released),
    (exact, _fits),
    (shift, _shifted),
    (largest, _largest),
    (add_held, _held),
)


@numba.njit(cache=True)
def _taken(law, gap, known, wanted):  # type: ignore
    """λ of the rows, and its derivatives as entries of a matrix; returns how many those are."""
    (local, stretches, slips), openings, work = known, len(law.stiffness), law.work
    press(law, gap, stretches)
    slide(law, gap, slips)
    count, entries = 0, (work.places, work.values)
    wanted[:] = 0.0
    for stretch in stretches:
        a, b = local[law.near[stretch]], local[law.far[stretch]]
        wanted[a] += work.ends[stretch, 0]
        wanted[b] += work.ends[stretch, 1]
        if work.rates[stretch, 0] != 0.0 or work.rates[stretch, 2] != 0.0:
            count = _enter(entries, count, a, a, work.rates[stretch, 0])
            count = _enter(entries, count, a, b, work.rates[stretch, 1])
            count = _enter(entries, count, b, a, work.rates[stretch, 1])
            count = _enter(entries, count, b, b, work.rates[stretch, 2])
    for row in slips:
        k, group, last = local[row], row - openings, -1
        wanted[k] = work.along[group, 0]
        if work.along[group, 1] == 0.0 and wanted[k] == 0.0:
            continue
        count = _enter(entries, count, k, k, work.along[group, 1])
        for place in range(law.first[group], law.first[group + 1]):
            point = law.members[place]
            if work.held[point, 1] == 0.0 or law.friction[point] == 0.0:
                continue
            factor, stretch = work.held[point, 1] * law.friction[point], law.stretch[point]
            if stretch != last:
                count = _enter(entries, count, k, local[law.near[stretch]], 0.0)
                count = _enter(entries, count, k, local[law.far[stretch]], 0.0)
                last = stretch
            for end in range(2):
                value = factor * (law.closed[point, end] - work.rate[point, end])
                work.values[count - 2 + end] += value
    return count


@numba.njit(cache=True)
def _enter(entries, count, row, column, value):  # type: ignore
    """Add an entry; returns how many there are."""
    entries[0][count, 0], entries[0][count, 1] = row, column
    entries[1][count] = value
    return count + 1


@numba.njit(cache=True)
def _newton(matrix, rest, entries, count):  # type: ignore
    """Solve (1 - λ' F) μ = λ' rest for the change μ of λ, which is 0 where no row of λ' is."""
    (places, values), changes = entries, np.zeros(len(rest), dtype=np.bool_)
    change = np.zeros(len(rest))
    for entry in range(count):
        row, column = places[entry, 0], places[entry, 1]
        changes[row] = True
        change[row] += values[entry] * rest[column]
    rows = np.flatnonzero(changes)
    if len(rows) > FEW:
        return _gradients(matrix, change, entries, count)
    whole = np.eye(len(rest))
    for entry in range(count):
        row, column, value = places[entry, 0], places[entry, 1], values[entry]
        for k in range(len(rest)):
            whole[row, k] -= value * matrix[column, k]
    change[rows] = np.linalg.solve(square(whole, rows), chosen(change, rows))
    return change


@numba.njit(cache=True)
def _applied(matrix, vector, entries, count):  # type: ignore
    """(1 - λ' F) times a vector."""
    (places, values), image, result = entries, matrix @ vector, vector.copy()
    for entry in range(count):
        result[places[entry, 0]] -= values[entry] * image[places[entry, 1]]
    return result


@numba.njit(cache=True)
def _gradients(matrix, right, entries, count):  # type: ignore
    """Solve (1 - λ' F) μ = right by stabilised biconjugate gradients from zero."""
    solution, left = np.zeros(len(right)), right.copy()
    direction, rho = right.copy(), right @ right
    end = (ROUGH**2) * rho
    for _ in range(2 * len(right)):
        image = _applied(matrix, direction, entries, count)
        seen = right @ image
        if left @ left <= end or seen == 0.0:
            break
        length = rho / seen
        half = left - length * image
        other = _applied(matrix, half, entries, count)
        square_of = other @ other
        weight = (other @ half) / square_of if square_of > 0.0 else 0.0
        solution += length * direction + weight * half
        left = half - weight * other
        new = right @ left
        if new == 0.0 or weight == 0.0:
            break
        direction = left + (new / rho) * (length / weight) * (direction - weight * image)
        rho = new
    return solution
