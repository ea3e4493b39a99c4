"""The compliance of active joint rows, and the workspace of their dense problems.

Workspaces have room for all rows of the structure; pages that are never touched cost no memory.
They are allocated once, as allocation in every iteration is slower than the arithmetic.

Rows whose λ is zero are there for their gaps alone, which press on joints that slide; they are as
many as the others. A column is added once its λ is not zero, and stays to the end of the problem.
Few rows and columns change from one problem to the next, and the compliance of a whole structure is
too large for the cache of the processor. So entries stay in place: the last row or column replaces
one that is removed, and only new ones are fetched.
"""

from typing import Any, NamedTuple

import numpy as np

from archfem._numba import kernel, summing_kernel, view_kernel
from archfem._typing import Array
from archfem.dynamics.solvers.supernodal_lu import Indices, four

# Columns for which room is added at a time
COLUMN_BLOCK = 64

# Entries of a row that are taken at once: each has room for a multiple of these
ROW_PADDING = 16

# Products with a matrix after which its factor takes no longer
MAX_KRYLOV_VECTORS = 48


# Rows of the array of vectors of a problem, one array as compiled functions take few ones faster:
# λ; λ(z); residual of λ, then its correction; residual of the gaps, then gaps; λ(z) before an
# iteration; λ that is tried; gaps if nothing were released; guess of the gaps; λ or a right side
# of the columns instead; and product with F.
FORCE, RELEASED, CHANGE, RESIDUAL, BEFORE, TRIAL, FREE, GUESS, COLUMN, IMAGE = range(10)


# Rows of the index of a problem: number of each of its rows in the structure, place of each row of
# the structure among them (-1 for none), row of each column, column of each row (-1 for none), and
# row exchanges of the factor.
NUMBER, PLACE, COLUMN_ROW, ROW_COLUMN, PIVOT = range(5)

# Flags of the rows of the structure: filled in F, in the problem at hand, and scratch, which is
# False between uses.
FILLED, NEAR, MARK = range(3)


class ActiveCompliance(NamedTuple):
    """F of a structure, and the workspace of dense problems in some of its rows."""

    full: Array  # F (p, p), symmetric, filled for rows that have been active
    flags: Any  # of rows of the structure, as named above (3, p)
    indices: Indices  # of rows and columns of the problem, as named above (5, p)
    entries: Array  # of F in these, row by row (p q,), q the room of a row of p
    sizes: Indices  # number of rows, of columns, room for columns, and number of equations (4,)
    matrix: Array  # of the equations (p²,)
    single: Array  # the same in single precision (p q,)
    basis: Array  # Krylov vectors in single precision (d + 1, q)
    triangle: Array  # of the least-squares problem in the basis (d, d)
    rotations: Array  # that lead to it, and its right side (d + 1, 3)
    vectors: Array  # of the rows, as named above (10, q)
    segments: Indices  # numbers of segments in the problem (s,)
    slips: Indices  # numbers of slip rows in the problem (p,)
    derivatives: tuple[Indices, Array]  # places of λ′, with its pair, and values (m, 3), (m,)

    @classmethod
    def of(cls, size: int, segments: int, pairs: int) -> "ActiveCompliance":
        """Return the workspace for a structure of some rows, segments and pairs of rows."""
        wide, depth, index = padded(size), MAX_KRYLOV_VECTORS, np.zeros((5, size), np.int64)
        index[PLACE] = -1
        single, basis = (_aligned(count * wide, np.float32) for count in (size, depth + 1))
        return cls(
            np.empty((size, size)),
            np.zeros((3, size), bool),
            index,
            _aligned(size * wide, float),
            np.array([0, 0, min(COLUMN_BLOCK, wide), 0]),
            np.empty(size**2),
            single,
            basis.reshape((depth + 1, wide)),
            np.empty((depth, depth)),
            np.empty((depth + 1, 3)),
            _aligned(10 * wide, float).reshape((10, wide)),
            np.empty(segments, np.int64),
            np.empty(size, np.int64),
            (np.zeros((pairs, 3), np.int64), np.zeros(pairs)),
        )


def _aligned(count: int, kind: Any) -> Array:
    """Return zeros that begin with a line of memory of 64 bytes (count,)."""
    size = count * np.dtype(kind).itemsize
    memory = np.zeros(size + 64, np.uint8)
    begin = -memory.ctypes.data % 64
    return np.asarray(memory[begin : begin + size].view(kind))


@view_kernel
def square(entries, size):  # type: ignore
    """Return a square matrix in an array that may be larger (k, k)."""
    return entries[: size**2].reshape((size, size))


@view_kernel
def padded(count):  # type: ignore
    """Return the room of a row of some entries."""
    return (count + ROW_PADDING - 1) // ROW_PADDING * ROW_PADDING


@view_kernel
def padded_square(entries, size):  # type: ignore
    """Return a square matrix in an array, with all the room of its rows."""
    return entries[: size * padded(size)].reshape((size, padded(size)))


@view_kernel
def line(compliance, row):  # type: ignore
    """Return a row of F in its columns, with all its room (c,)."""
    start = row * compliance.sizes[2]
    return compliance.entries[start : start + padded(compliance.sizes[1])]


@summing_kernel
def products(entries, wide, vector, images):  # type: ignore
    """Multiply rows of a matrix, each of some room, by a vector (c,) into images (k,)."""
    count, zero, tail = len(images), vector.dtype.type(0.0), len(images) % 4
    # four rows at a time: each entry of the vector is loaded once for all of them
    for row in range(0, count - tail, 4):
        a, b, c, d = four(entries, row, wide)
        p, q, r, s = zero, zero, zero, zero
        for k in range(len(vector)):
            p += a[k] * vector[k]
            q += b[k] * vector[k]
            r += c[k] * vector[k]
            s += d[k] * vector[k]
        images[row], images[row + 1], images[row + 2], images[row + 3] = p, q, r, s
    for row in range(count - tail, count):
        own, p = entries[row * wide : row * wide + len(vector)], zero
        for k in range(len(vector)):
            p += own[k] * vector[k]
        images[row] = p


@kernel
def clear_problem(compliance):  # type: ignore
    """Remove all rows, so that the order of later ones does not depend on earlier problems."""
    for k in range(compliance.sizes[0]):
        compliance.indices[PLACE, compliance.indices[NUMBER, k]] = -1
    compliance.sizes[0], compliance.sizes[1] = 0, 0
    compliance.sizes[2] = min(COLUMN_BLOCK, padded(compliance.indices.shape[1]))


@kernel
def begin_problem(compliance, rows):  # type: ignore
    """Begin a problem in some rows (k,), with the columns that are still there."""
    marks, sizes, k = compliance.flags[MARK], compliance.sizes, 0
    for row in rows:
        marks[row] = True
    while k < sizes[0]:
        if marks[compliance.indices[NUMBER, k]]:
            k += 1
        else:
            _remove_row(compliance, k)
    for row in rows:
        marks[row] = False
        if compliance.indices[PLACE, row] < 0:
            _add_row(compliance, row)


@kernel
def _add_row(compliance, row):  # type: ignore
    """Add a row of the structure."""
    k, full = compliance.sizes[0], compliance.full[row]
    compliance.sizes[0] += 1
    (
        compliance.indices[NUMBER, k],
        compliance.indices[PLACE, row],
        compliance.indices[ROW_COLUMN, k],
    ) = (
        row,
        k,
        -1,
    )
    own = line(compliance, k)
    for j in range(compliance.sizes[1]):
        own[j] = full[compliance.indices[NUMBER, compliance.indices[COLUMN_ROW, j]]]


@kernel
def _remove_row(compliance, k):  # type: ignore
    """Remove a row; the last one takes its place."""
    column, last = compliance.indices[ROW_COLUMN], compliance.sizes[0] - 1
    if column[k] >= 0:
        _remove_column(compliance, column[k])
    own, other = line(compliance, k), line(compliance, last)
    for j in range(len(own)):
        own[j] = other[j]
    compliance.indices[PLACE, compliance.indices[NUMBER, k]] = -1
    if k < last:
        row = compliance.indices[NUMBER, last]
        compliance.indices[NUMBER, k], compliance.indices[PLACE, row], column[k] = (
            row,
            k,
            column[last],
        )
        if column[k] >= 0:
            compliance.indices[COLUMN_ROW, column[k]] = k
    compliance.sizes[0] = last


@kernel
def _remove_column(compliance, column):  # type: ignore
    """Remove a column; the last one takes its place."""
    last, entries, wide = compliance.sizes[1] - 1, compliance.entries, compliance.sizes[2]
    compliance.indices[ROW_COLUMN, compliance.indices[COLUMN_ROW, column]] = -1
    if column < last:
        row = compliance.indices[COLUMN_ROW, last]
        compliance.indices[COLUMN_ROW, column], compliance.indices[ROW_COLUMN, row] = row, column
        for k in range(compliance.sizes[0]):
            entries[k * wide + column] = entries[k * wide + last]
    compliance.sizes[1] = last


@kernel
def update_columns(compliance, before, force, places, count):  # type: ignore
    """Remove columns without λ or derivative, and add those with one.

    A column with λ in the last step stays: it often returns, and takes long to fetch.
    """
    marks, column = compliance.flags[MARK], 0
    for entry in range(count):
        marks[places[entry, 0]] = True
    while column < compliance.sizes[1]:
        row = compliance.indices[COLUMN_ROW, column]
        if force[row] == 0.0 and before[row] == 0.0 and not marks[row]:
            _remove_column(compliance, column)
        else:
            column += 1
    for entry in range(count):
        marks[places[entry, 0]] = False
    add_columns(compliance, force, places, count)


@kernel
def add_columns(compliance, force, places, count):  # type: ignore
    """Add the columns of rows with λ, or with one of some derivatives."""
    for k in range(len(force)):
        if force[k] != 0.0 and compliance.indices[ROW_COLUMN, k] < 0:
            _add_column(compliance, k)
    for entry in range(count):
        if compliance.indices[ROW_COLUMN, places[entry, 0]] < 0:
            _add_column(compliance, places[entry, 0])


@kernel
def _add_column(compliance, row):  # type: ignore
    """Make a row the next column."""
    column, entries, rows = compliance.sizes[1], compliance.entries, compliance.indices[NUMBER]
    if column == compliance.sizes[2]:
        _widen(compliance)
    compliance.indices[ROW_COLUMN, row], compliance.indices[COLUMN_ROW, column] = column, row
    compliance.sizes[1] += 1
    wide, full = compliance.sizes[2], compliance.full[rows[row]]
    for k in range(compliance.sizes[0]):
        entries[k * wide + column] = full[rows[k]]


@kernel
def _widen(compliance):  # type: ignore
    """Make room for more columns, from the last row on as rows move backwards."""
    entries, (rows, columns, wide, _) = compliance.entries, compliance.sizes
    wider = min(wide + COLUMN_BLOCK, padded(compliance.indices.shape[1]))
    for k in range(rows - 1, 0, -1):
        for j in range(columns - 1, -1, -1):
            entries[k * wider + j] = entries[k * wide + j]
    compliance.sizes[2] = wider


@summing_kernel
def add_gaps(compliance, force, gaps):  # type: ignore
    """Add F λ to the gaps of the rows (k,); all λ that are not zero have a column."""
    count, places = compliance.sizes[1], compliance.indices[COLUMN_ROW]
    own = compliance.vectors[COLUMN][: padded(count)]
    for j in range(count):
        own[j] = force[places[j]]
    for j in range(count, len(own)):
        own[j] = 0.0
    images = compliance.vectors[IMAGE][: len(gaps)]
    products(compliance.entries, compliance.sizes[2], own, images)
    for i in range(len(gaps)):
        gaps[i] += images[i]
