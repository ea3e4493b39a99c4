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
    force = np.zeros(len(law.start))
    for point in law.points:
        if point.group >= 0:
            force[point.group] += point.elastic * point.slid
    add_rows(opening, np.flatnonzero(force), force, right)


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
    for part in law.stretches:
        if works[part.near] or works[part.far]:
            near[part.near] = near[part.far] = True
            for point in range(part.begin, part.end):
                if law.points[point].group >= 0:
                    near[law.points[point].group] = True
    _work_at(law, law.guess, near, np.zeros(len(gap)))
    return near


@numba.njit(cache=True)
def _involve(law, near):  # type: ignore
    """Add to rows of slips at work the openings that press on their points."""
    for point in law.points:
        if point.group >= 0 and near[point.group]:
            stretch = law.stretches[point.stretch]
            near[stretch.near] = near[stretch.far] = True


def _fits(law, gap, force, near):  # type: ignore
    """Return whether the gaps ask for the λ they were found with; adds rows at work to near."""
    wanted = np.zeros(len(gap))
    law.guess[:] = gap
    _work_at(law, gap, near, wanted)
    return np.max(np.abs(wanted - force)) <= EXACT * largest(law, gap)


@numba.njit(cache=True)
def _work_at(law, gap, near, wanted):  # type: ignore
    """Add to near what rows are at work at some gaps; λ there, added to what is wanted."""
    openings = len(law.stiffness)
    press(law, gap, np.arange(len(law.stretches)))
    slide(law, gap, np.arange(openings, len(gap)))
    for number in range(len(law.stretches)):
        part, carried = law.stretches[number], law.work.stretches[number]
        wanted[part.near] += carried.near
        wanted[part.far] += carried.far
        if carried.near != 0.0 or carried.far != 0.0:
            near[part.near] = near[part.far] = True
    for row in range(openings, len(gap)):
        wanted[row] = law.work.along[row - openings, 0]
        near[row] = near[row] or wanted[row] != 0.0
    _involve(law, near)


def _released(law, start, rows, compliance, force, enough):  # type: ignore
    """Find λ where it may differ from zero; passes, or -1 if it does not settle."""
    size, local = len(rows), np.full(len(start), -1)
    for k in range(size):
        local[rows[k]] = k
    slips = rows[np.searchsorted(rows, len(law.stiffness)) :]
    known = local, _within(law.stretches, local), slips
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
def _within(stretches, local):  # type: ignore
    """Numbers of the stretches of which both ends are among the rows."""
    inside = np.empty(len(stretches), dtype=np.bool_)
    for number in range(len(stretches)):
        part = stretches[number]
        inside[number] = local[part.near] >= 0 and local[part.far] >= 0
    return np.flatnonzero(inside)


@numba.njit(cache=True)
def _taken(law, gap, known, wanted):  # type: ignore
    """λ of the rows, and its derivatives as entries of a matrix; returns how many those are."""
    local, stretches, slips = known
    press(law, gap, stretches)
    slide(law, gap, slips)
    count, entries = 0, (law.work.places, law.work.values)
    wanted[:] = 0.0
    for number in stretches:
        part, carried = law.stretches[number], law.work.stretches[number]
        a, b = local[part.near], local[part.far]
        wanted[a] += carried.near
        wanted[b] += carried.far
        if carried.first != 0.0 or carried.last != 0.0:
            count = _enter(entries, count, a, a, carried.first)
            count = _enter(entries, count, a, b, carried.mixed)
            count = _enter(entries, count, b, a, carried.mixed)
            count = _enter(entries, count, b, b, carried.last)
    openings, along = len(law.stiffness), law.work.along
    for row in slips:
        k, group = local[row], row - openings
        wanted[k] = along[group, 0]
        if along[group, 1] != 0.0 or wanted[k] != 0.0:
            count = _enter(entries, count, k, k, along[group, 1])
            own = law.members[law.first[group] : law.first[group + 1]]
            count = _press_on(law, own, local, (k, entries, count))
    return count


@numba.njit(cache=True)
def _press_on(law, own, local, entered):  # type: ignore
    """Add derivatives of a slip's λ by the openings that press on its points; returns entries."""
    (k, entries, count), last = entered, -1
    for place in own:
        point, pressed = law.points[place], law.work.points[place]
        if pressed.by_limit == 0.0 or point.friction == 0.0:
            continue
        if point.stretch != last:
            part, last = law.stretches[point.stretch], point.stretch
            count = _enter(entries, count, k, local[part.near], 0.0)
            count = _enter(entries, count, k, local[part.far], 0.0)
        factor = pressed.by_limit * point.friction
        entries[1][count - 2] += factor * (point.near - pressed.near)
        entries[1][count - 1] += factor * (point.far - pressed.far)
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
    whole, change = np.eye(len(rest)), np.zeros(len(rest))
    for entry in range(count):
        row, column, value = places[entry, 0], places[entry, 1], values[entry]
        changes[row] = True
        change[row] += value * rest[column]
        line, other = whole[row], matrix[column]
        for k in range(len(line)):
            line[k] -= value * other[k]
    rows = np.flatnonzero(changes)
    if len(rows) > FEW:
        return _gradients(whole, change)
    own = chosen(change, rows)
    _eliminate(square(whole, rows), own)
    change[rows] = own
    return change


@numba.njit(cache=True, fastmath={"contract"})
def _eliminate(matrix, right):  # type: ignore
    """Solve a small system in place; without a solution none of it is a number.

    Faster than LAPACK's where there are but some tens of rows.
    """
    size = len(right)
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        if best != k:
            right[k], right[best] = right[best], right[k]
            for j in range(k, size):
                matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        scale = 1.0 / matrix[k, k] if matrix[k, k] != 0.0 else np.nan
        top = matrix[k, k + 1 :]
        for i in range(k + 1, size):
            factor, row = scale * matrix[i, k], matrix[i, k + 1 :]
            right[i] -= factor * right[k]
            for j in range(len(top)):
                row[j] -= factor * top[j]
    for k in range(size - 1, -1, -1):
        for j in range(k + 1, size):
            right[k] -= matrix[k, j] * right[j]
        right[k] *= 1.0 / matrix[k, k] if matrix[k, k] != 0.0 else np.nan


@numba.njit(cache=True)
def _gradients(matrix, right):  # type: ignore
    """Solve a system by stabilised biconjugate gradients from zero."""
    solution, left = np.zeros(len(right)), right.copy()
    direction, rho = right.copy(), right @ right
    end = (ROUGH**2) * rho
    for _ in range(2 * len(right)):
        image = matrix @ direction
        seen = right @ image
        if left @ left <= end or seen == 0.0:
            break
        length = rho / seen
        half = left - length * image
        other = matrix @ half
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
