"""The small problem of a step over which joints open and slide: Newton's method at its rows.

A joint that slides lowers its shear as it opens, but does not open as it slides: λ is not the
gradient of an energy, and the problem

    z = z₀ + F λ(z),

is not symmetric. It is solved by Newton's method, (1 - F λ') δ = z₀ + F λ - z, in the rows that
open or slide and in the openings that press on those, by a dense factor where they are few and by
stabilised biconjugate gradients (van der Vorst, SIAM J. Sci. Stat. Comput. 13 (1992) 631) where
they are many. Where the passes go round in a circle of holding and sliding they go less far.
"""

from typing import Any

import numba
import numpy as np
from numba.extending import overload

from archfem.dynamics.stepping.loop import ITERATIONS
from archfem.dynamics.stepping.open_points import chosen, square
from archfem.dynamics.stepping.path_law import PathLaw, press, slide
from archfem.dynamics.stepping.small_problem import (
    AHEAD,
    EXACT,
    ROUNDED,
    exact,
    expected,
    largest,
    release,
    shift,
)

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


def is_path_law(law: Any) -> bool:
    """Return whether this is the type of a law over a step.

    Args:
        law: as numba types it, or None where there is none.
    """
    return getattr(law, "instance_class", None) is PathLaw


@overload(release)
def _release(law, start, rows, compliance, force, enough):  # type: ignore
    return _released if is_path_law(law) else None


@overload(exact)
def _exact(law, gap, force, near):  # type: ignore
    return _fits if is_path_law(law) else None


@overload(expected)
def _expected(law, gap, before, force):  # type: ignore
    return _foreseen if is_path_law(law) else None


@overload(largest)
def _largest(law, gap):  # type: ignore
    if is_path_law(law):
        return lambda law, gap: np.max(law.still.stiffness * np.abs(gap[: len(law.group)]))
    return None


@overload(shift)
def _shift(law, gap):  # type: ignore
    return _shifted if is_path_law(law) else None


def _shifted(law, gap):  # type: ignore
    """Add to gaps found from displacements those before anything moves."""
    for row in range(len(gap)):
        gap[row] += law.offset[row]


def _foreseen(law, gap, before, force):  # type: ignore
    """Return which rows are at work, or will be soon if they go on as they did (r,)."""
    near = np.zeros(len(gap), dtype=np.bool_)
    for row in range(len(gap)):
        law.guess[row] = law.start[row] + law.speed[row] / law.gain
    for row in range(len(law.group)):
        if gap[row] + AHEAD * (gap[row] - before[row]) > 0.0 or force[row] != 0.0:
            _involve(law, row, near)
            if law.group[row] >= 0:
                _involve(law, law.group[row], near)
    for row in range(len(law.group), len(gap)):
        if force[row] != 0.0:
            _involve(law, row, near)
    return near


@numba.njit(cache=True)
def _involve(law, row, near):  # type: ignore
    """Take a row to be at work, with the other end of its facet or what presses on its points."""
    near[row] = True
    points = len(law.group)
    if row < points:
        if law.still.facets:
            near[row ^ 1] = True
        return
    for place in range(law.first[row - points], law.first[row - points + 1]):
        _involve_point(law, law.members[place], near)


@numba.njit(cache=True)
def _involve_point(law, point, near):  # type: ignore
    """Take the opening at a point to be at work."""
    near[point] = True
    if law.still.facets:
        near[point ^ 1] = True


def _fits(law, gap, force, near):  # type: ignore
    """Return whether the gaps ask for the λ they were found with; adds rows at work to near."""
    taken, points = law.work.taken, len(law.group)
    for row in range(0, points, 2 if law.still.facets else 1):
        press(law, gap, row)
    for row in range(points, len(gap)):
        slide(law, gap, row)
    most, off = 0.0, 0.0
    for row in range(len(gap)):
        if row < points:
            most = max(most, law.still.stiffness[row] * abs(gap[row]))
        off = max(off, abs(taken[row] - force[row]))
        law.guess[row] = gap[row]
        if taken[row] != 0.0 and not near[row]:
            _involve(law, row, near)
    return off <= EXACT * most


def _released(law, start, rows, compliance, force, enough):  # type: ignore
    """Find λ where it may differ from zero; passes, or -1 if it does not settle."""
    size, local = len(rows), np.full(len(start), -1)
    for k in range(size):
        local[rows[k]] = k
    matrix, free, own = square(compliance, rows), chosen(start, rows), chosen(force, rows)
    gap, z, last = start.copy(), chosen(law.guess, rows), np.inf
    wanted, share, calm = np.empty(size), 1.0, 0
    rooms = (
        np.empty((5 * size + len(law.group), 2), dtype=np.int64),
        np.empty(5 * size + len(law.group)),
    )
    count = _taken(law, (gap, z), rows, local, wanted, rooms)
    for passes in range(1, ITERATIONS + 1):
        step = _newton(matrix, free + matrix @ wanted - z, rooms, count)
        for entry in range(count):
            wanted[rooms[0][entry, 0]] += rooms[1][entry] * step[rooms[0][entry, 1]]
        for k in range(size):
            own[k] += share * (wanted[k] - own[k])
        z = free + matrix @ own
        count = _taken(law, (gap, z), rows, local, wanted, rooms)
        off = np.max(np.abs(wanted - own))
        if off <= enough or last <= off <= ROUNDED * enough:
            for k in range(size):
                force[rows[k]] = own[k]
            return passes
        calm = calm + 1 if off <= SLOW * last else 0
        share = 1.0 if passes < WHOLE or calm >= CALM else 0.5
        last = off
    return -1


@numba.njit(cache=True)
def _taken(law, gaps, rows, local, wanted, entries):  # type: ignore
    """λ of the rows, and its derivatives as entries of a matrix; returns how many those are."""
    (gap, z), points = gaps, len(law.group)
    for k in range(len(rows)):
        gap[rows[k]] = z[k]
    count, facets, work = 0, law.still.facets, law.work
    for k in range(len(rows)):
        row = rows[k]
        if row < points:
            if not facets or row % 2 == 0:
                press(law, gap, row)
            if work.rate[row, 0] != 0.0:
                count = _enter(entries, count, k, k, work.rate[row, 0])
            if facets and work.rate[row, 1] != 0.0:
                count = _enter(entries, count, k, local[row ^ 1], work.rate[row, 1])
        else:
            rate = slide(law, gap, row)
            if rate != 0.0 or work.taken[row] != 0.0:
                count = _enter(entries, count, k, k, rate)
                count = _pressed(law, k, row, local, entries, count)
        wanted[k] = work.taken[row]
    return count


@numba.njit(cache=True)
def _pressed(law, k, row, local, entries, count):  # type: ignore
    """Enter how λ of a row of slips changes with the openings at its points."""
    work, facets, group = law.work, law.still.facets, row - len(law.group)
    for place in range(law.first[group], law.first[group + 1]):
        point = law.members[place]
        by_limit = work.rates[point, 1]
        if by_limit == 0.0 or law.friction[point] == 0.0:
            continue
        factor, whole = by_limit * law.friction[point], law.still.stiffness[point]
        if not facets:
            value = factor * (whole - work.rate[point, 0])
            count = _enter(entries, count, k, local[point], value)
        else:
            near = factor * (whole / 3.0 - work.rate[point, 0])
            far = factor * (whole / 6.0 - work.rate[point, 1])
            count = _enter(entries, count, k, local[point], near)
            count = _enter(entries, count, k, local[point ^ 1], far)
    return count


@numba.njit(cache=True)
def _enter(entries, count, row, column, value):  # type: ignore
    """Add an entry; returns how many there are."""
    entries[0][count, 0], entries[0][count, 1] = row, column
    entries[1][count] = value
    return count + 1


@numba.njit(cache=True)
def _newton(matrix, rest, entries, count):  # type: ignore
    """Solve (1 - F λ') δ = rest for those rows on which some λ depends; 0 elsewhere."""
    places, values = entries
    used = np.zeros(len(rest), dtype=np.bool_)
    for entry in range(count):
        used[places[entry, 1]] = True
    rows = np.flatnonzero(used)
    if len(rows) > FEW:
        return _gradients(matrix, rest, entries, count)
    number = np.cumsum(used) - 1
    whole = np.eye(len(rows))
    for entry in range(count):
        line, column = matrix[places[entry, 0]], number[places[entry, 1]]
        for k in range(len(rows)):
            whole[column, k] -= values[entry] * line[rows[k]]  # transposed, as F is symmetric
    step = np.zeros(len(rest))
    step[rows] = np.linalg.solve(whole.T, rest[rows])
    return step


@numba.njit(cache=True)
def _applied(matrix, vector, entries, count):  # type: ignore
    """(1 - F λ') times a vector."""
    image = np.zeros(len(vector))
    for entry in range(count):
        image[entries[0][entry, 0]] += entries[1][entry] * vector[entries[0][entry, 1]]
    return vector - matrix @ image


@numba.njit(cache=True)
def _gradients(matrix, rest, entries, count):  # type: ignore
    """Solve (1 - F λ') δ = rest by stabilised biconjugate gradients from zero."""
    solution, left, shadow = np.zeros(len(rest)), rest.copy(), rest.copy()
    direction, rho = rest.copy(), rest @ rest
    end = (ROUGH**2) * rho
    for _ in range(2 * len(rest)):
        if left @ left <= end:
            break
        image = _applied(matrix, direction, entries, count)
        length = rho / (shadow @ image)
        half = left - length * image
        other = _applied(matrix, half, entries, count)
        square_of = other @ other
        weight = (other @ half) / square_of if square_of > 0.0 else 0.0
        solution += length * direction + weight * half
        left = half - weight * other
        new = shadow @ left
        if new == 0.0 or weight == 0.0:
            break
        direction = left + (new / rho) * (length / weight) * (direction - weight * image)
        rho = new
    return solution
