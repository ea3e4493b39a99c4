"""One pass of Newton's method at the rows of a small problem: its equations, and their solution.

Of (1 - λ' F) μ = λ' (z₀ + F λ - z) for the change μ of λ the rows matter where λ' has any entry.
"""

import numba
import numpy as np

from archfem.joints.moving.compiled import computing, inlined, summing

FEW = 100
"""Rows up to which the problem is solved directly."""

ROUGH = 1e-3
"""Residual of biconjugate gradients, relative to the first, where a pass is not the last."""


PAYS = 6
"""Columns for each of their products in pairs: with as many a factor takes no longer."""


@computing
def taken_out(law, known, wanted):  # type: ignore
    """Sum up λ of the rows.

    Args:
        law: `PathLaw`, which knows what joints carry.
        known: numbers of rows among them, their stretches, and their slips.
        wanted: filled with λ (k,).
    """
    (local, stretches, slips), openings = known, len(law.stiffness)
    parts, found, along = law.stretches, law.work.stretches, law.work.along
    wanted[:] = 0.0
    for number in stretches:
        part, carried = parts[number], found[number]
        wanted[local[part.near]] += carried.near
        wanted[local[part.far]] += carried.far
    for row in slips:
        wanted[local[row]] = along[row - openings, 0]


@computing
def rates(law, known):  # type: ignore
    """Find derivatives of λ of the rows, as entries of a matrix in the room of the law.

    Args:
        law: `PathLaw`, which knows what joints carry.
        known: numbers of rows among them, their stretches, and their slips.

    Returns:
        How many there are.
    """
    local, stretches, slips = known
    count, entries = 0, (law.work.places, law.work.values)
    parts, found, openings = law.stretches, law.work.stretches, len(law.stiffness)
    for number in stretches:
        part, carried = parts[number], found[number]
        if carried.first != 0.0 or carried.last != 0.0:
            a, b = local[part.near], local[part.far]
            _enter(entries, count, (a, a, carried.first))
            _enter(entries, count + 1, (a, b, carried.mixed))
            _enter(entries, count + 2, (b, a, carried.mixed))
            _enter(entries, count + 3, (b, b, carried.last))
            count += 4
    points, pressed, members = law.points, law.work.points, law.members
    first, along = law.first, law.work.along
    for row in slips:
        k, group, last = local[row], row - openings, -1
        if along[group, 1] == 0.0 and along[group, 0] == 0.0:
            continue
        _enter(entries, count, (k, k, along[group, 1]))
        count += 1
        for place in range(first[group], first[group + 1]):
            point, found_there = points[members[place]], pressed[members[place]]
            factor = found_there.by_limit * point.friction
            if found_there.by_limit == 0.0 or point.friction == 0.0:
                continue
            if point.stretch != last:
                part, last = parts[point.stretch], point.stretch
                _enter(entries, count, (k, local[part.near], 0.0))
                _enter(entries, count + 1, (k, local[part.far], 0.0))
                count += 2
            entries[1][count - 2] += factor * (point.near - found_there.near)
            entries[1][count - 1] += factor * (point.far - found_there.far)
    return count


@inlined
def _enter(entries, number, entry):  # type: ignore
    """Set an entry: its row, column and value."""
    entries[0][number, 0], entries[0][number, 1] = entry[0], entry[1]
    entries[1][number] = entry[2]


@computing
def holding(was, force, change):  # type: ignore
    """Let points hold that would turn round: none slides one way and then, at once, the other.

    Newton's method foresees nothing of the range in between, in which a point holds, and would go
    to and fro across it.

    Args:
        was: λ that the gaps asked for before a pass (r,).
        force: λ after it, changed (r,).
        change: filled with the change of it (r,).

    Returns:
        Whether there are any.
    """
    some = False
    for k in range(len(was)):
        change[k] = 0.0
        if was[k] * force[k] < 0.0:
            change[k], force[k], some = -force[k], 0.0, True
    return some


@numba.njit(cache=True)
def prepared(columns, entries, count, room):  # type: ignore
    """Get ready to solve with 1 - λ' F.

    Args:
        columns: of F, `Columns`, among them all rows of λ'.
        entries: rows and columns of λ', and its values there.
        count: how many of them there are.
        room: of which part is taken (k²,).

    Returns:
        That matrix or, of at most `FEW` columns, its factor (c, c); and with which column each was
        exchanged, which is of no matter where they are many (c,).
    """
    size = columns.taken[0]
    matrix = room[: size**2].reshape((size, size))
    _equations(columns, entries, count, matrix)
    return matrix, factorised(matrix) if size <= FEW else np.zeros(size, np.int64)


@summing
def _equations(columns, entries, count, matrix):  # type: ignore
    """Fill 1 - λ' F of the columns."""
    (places, values), size = entries, len(matrix)
    for i in range(size):
        own = matrix[i]
        for k in range(size):
            own[k] = 0.0
        own[i] = 1.0
    for entry in range(count):
        own, other = matrix[columns.column[places[entry, 0]]], columns.entries[places[entry, 1]]
        value = values[entry]
        for k in range(size):
            own[k] -= value * other[k]


@numba.njit(cache=True)
def newton_change(rest, entered, system):  # type: ignore
    """Solve (1 - λ' F) μ = λ' r for the change μ of λ, which is 0 where no column is.

    Args:
        rest: r (k,).
        entered: rows and columns of λ' with its values, and how many those are.
        system: `Columns`, and what `prepared` returned.

    Returns:
        μ (k,).
    """
    ((places, values), count), (columns, (matrix, exchanges)) = entered, system
    change, own, size = np.zeros(len(rest)), np.zeros(len(exchanges)), len(exchanges)
    for k in range(count):
        own[columns.column[places[k, 0]]] += values[k] * rest[places[k, 1]]
    if size <= FEW:
        _substitute(matrix, exchanges, own)
    elif not _gradients(matrix, own):
        factor = matrix.copy()
        _substitute(factor, factorised(factor), own)
    for k in range(size):
        change[columns.places[k]] = own[k]
    return change


@numba.njit(cache=True, fastmath={"contract"})
def factorised(matrix):  # type: ignore
    """Factorise a matrix in place.

    Faster than LAPACK's where there are but some tens of rows. Of a matrix that is singular,
    solutions are not numbers.

    Args:
        matrix: changed (c, c).

    Returns:
        With which row each was exchanged (c,).
    """
    size = len(matrix)
    exchanges = np.empty(size, np.int64)
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        exchanges[k] = best
        if best != k:
            for j in range(size):
                matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        scale = 1.0 / matrix[k, k] if matrix[k, k] != 0.0 else np.nan
        top = matrix[k][k + 1 :]
        for i in range(k + 1, size):
            factor, row = scale * matrix[i, k], matrix[i][k + 1 :]
            matrix[i, k] = factor
            for j in range(len(top)):
                row[j] -= factor * top[j]
        matrix[k, k] = scale
    return exchanges


@summing
def _substitute(matrix, exchanges, right):  # type: ignore
    """Solve a system in place by its factor."""
    size = len(right)
    for k in range(size):
        best = exchanges[k]
        right[k], right[best] = right[best], right[k]
    for k in range(size):
        total = right[k]
        for j in range(k):
            total -= matrix[k, j] * right[j]
        right[k] = total
    for k in range(size - 1, -1, -1):
        total = right[k]
        for j in range(k + 1, size):
            total -= matrix[k, j] * right[j]
        right[k] = total * matrix[k, k]


@numba.njit(cache=True)
def _gradients(matrix, right):  # type: ignore
    """Solve a system in place by stabilised biconjugate gradients; nothing if a factor costs less.

    Args:
        matrix: of the system (c, c).
        right: its right side, then the solution (c,).

    Returns:
        Whether it is solved.
    """
    solution, left = np.zeros(len(right)), right.copy()
    direction, rho = right.copy(), right @ right
    end = (ROUGH**2) * rho
    for _ in range(len(right) // PAYS + 1):
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
    if not left @ left <= end:
        return False
    right[:] = solution
    return True
