"""One pass of Newton's method at the rows of a small problem: its equations, and their solution.

Of (1 - λ' F) μ = d for the change μ of λ, d what λ lacks, the rows matter where λ' has any entry;
in the others μ is d.
"""

import numpy as np

from archfem.dynamics.stepping.compliance import line, rows_in, square
from archfem.dynamics.stepping.residuals import minimised
from archfem.joints.moving.compiled import computing, inlined, summing

FEW = 100
"""Rows up to which the problem is solved directly."""


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


@computing
def prepared(compliance, entries, count):  # type: ignore
    """Get ready to solve with 1 - λ' F, of few columns by its factor.

    Args:
        compliance: `Compliance`, among its columns all rows of λ'; in its room that is.
        entries: rows and columns of λ', and its values there.
        count: how many of them there are.
    """
    compliance.sizes[3] = size = compliance.sizes[1]
    if size <= FEW:
        _factorise(compliance, entries, count)
    else:
        _equations(compliance, entries, count, rows_in(compliance.rough, size))


@computing
def _factorise(compliance, entries, count):  # type: ignore
    """Factorise 1 - λ' F of the columns."""
    matrix = square(compliance.matrix, compliance.sizes[3])
    _equations(compliance, entries, count, matrix)
    factorised(matrix, compliance.exchanges)


@summing
def _equations(compliance, entries, count, matrix):  # type: ignore
    """Fill 1 - λ' F of the columns, by two entries at a time where these follow in a row."""
    (places, values), (size, wide) = entries, matrix.shape
    for i in range(size):
        own = matrix[i]
        for k in range(wide):
            own[k] = 0.0
        own[i] = 1.0
    entry = 0
    while entry < count:
        row, entered = places[entry, 0], values[entry]
        own, other = matrix[compliance.column[row]], line(compliance, places[entry, 1])
        entry += 1
        if entry < count and places[entry, 0] == row:
            also, further = values[entry], line(compliance, places[entry, 1])
            for k in range(wide):
                own[k] -= entered * other[k] + also * further[k]
            entry += 1
        else:
            for k in range(wide):
                own[k] -= entered * other[k]


@computing
def lacking_at(rest, entered, lacks):  # type: ignore
    """Find what λ lacks, to first order, where gaps are off by a rest: λ' r.

    Args:
        rest: r (k,).
        entered: rows and columns of λ' with its values, and how many those are.
        lacks: filled (k,).
    """
    (places, values), count = entered
    for k in range(len(lacks)):
        lacks[k] = 0.0
    for k in range(count):
        lacks[places[k, 0]] += values[k] * rest[places[k, 1]]


@computing
def newton_change(change, entered, compliance):  # type: ignore
    """Solve (1 - λ' F) μ = d in place for the change μ of λ.

    Args:
        change: d, then μ (k,).
        entered: rows and columns of λ' with its values, and how many those are.
        compliance: `Compliance`, in the room of which `prepared` has left the equations.
    """
    size = compliance.sizes[3]
    own = compliance.vectors.column[:size]
    for k in range(size):
        own[k] = change[compliance.places[k]]
    if size > FEW and not minimised(compliance, own):
        _factorise(compliance, *entered)
        _substitute(square(compliance.matrix, size), compliance.exchanges, own)
    elif size <= FEW:
        _substitute(square(compliance.matrix, size), compliance.exchanges, own)
    for k in range(size):
        change[compliance.places[k]] = own[k]


@computing
def factorised(matrix, exchanges):  # type: ignore
    """Factorise a matrix in place.

    Faster than LAPACK's where there are but some tens of rows. Of a matrix that is singular,
    solutions are not numbers.

    Args:
        matrix: changed (c, c).
        exchanges: filled with the row with which each was exchanged (c,).
    """
    size = len(matrix)
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
