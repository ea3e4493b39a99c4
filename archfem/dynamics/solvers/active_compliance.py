"""The compliance of active joint rows, and the workspace of their dense problems.

Rows whose λ is zero are there for their gaps alone, which press on joints that slide; they are as
many as the others. A column is added once its λ is not zero, and stays to the end of the problem.
Few rows and columns change from one problem to the next. F of a whole structure is too large for
the cache of the processor. Entries therefore stay in place: the last row or column replaces one
that is removed, and only new ones are copied. Without that, steps of a bridge take half as long
again.
"""

from typing import Any, NamedTuple

import numpy as np

from archfem._numba import inlined_kernel, kernel, summing_kernel, view_kernel
from archfem._typing import Array
from archfem.dynamics.solvers.supernodal_lu import Indices

# Products with a matrix after which its factor takes no longer
MAX_KRYLOV_VECTORS = 48

# Columns for which room is added at a time
COLUMN_BLOCK = 64

# Entries of a row that are taken at once: each has room for a multiple of these
ROW_PADDING = 16


class ActiveRows(NamedTuple):
    """F of a structure, and the workspace of dense problems in some of its rows.

    Workspaces have room for all rows of the structure; pages that are never touched cost no memory.
    They are allocated once, as allocation in every iteration is slower than the arithmetic.
    Functions that are called for each row are inlined, as it takes long to pass so many arrays.
    """

    full: Array  # F (p, p), symmetric, filled for rows that have been active
    filled: Any  # whether a row is filled in F (p,)
    near: Any  # whether a row is in the problem at hand (p,)
    marks: Any  # scratch, False between uses (p,)
    sizes: Indices  # number of rows, of columns, room for columns, and number of equations (4,)
    numbers: Indices  # of the rows in the structure (p,)
    place: Indices  # place of each row of the structure among them, -1 for none (p,)
    row_of: Indices  # row of each column (p,)
    column_of: Indices  # column of each row, -1 for none (p,)
    entries: Array  # of F in these, row by row (p q,), q the room of a row of p
    single: Array  # of the equations in single precision (p q,)
    matrix: Array  # of the equations, then its factor (p²,)
    pivots: Indices  # row exchanges of the factor (p,)
    force: Array  # λ (q,)
    released: Array  # λ(z) (q,)
    before: Array  # λ(z) before an iteration (q,)
    change: Array  # residual of λ, then its correction (q,)
    trial: Array  # λ that is tried (q,)
    free: Array  # gaps if nothing were released (q,)
    gap: Array  # gaps that λ yields (q,)
    guess: Array  # of the gaps (q,)
    column: Array  # λ or a right side of the columns (q,)
    image: Array  # product with F (q,)
    basis: Array  # Krylov vectors in single precision (d + 1, q)
    triangle: Array  # of the least-squares problem in the basis (d, d)
    rotations: Array  # that lead to it, and its right side (d + 1, 3)
    segments: Indices  # numbers of segments in the problem (s,)
    slips: Indices  # numbers of slip rows in the problem (p,)
    derivatives: tuple[Indices, Array]  # places of λ′, with its pair, and values (m, 3), (m,)

    @classmethod
    def of(cls, size: int, segments: int, pairs: int) -> "ActiveRows":
        """Return the workspace for a structure of some rows, segments and pairs of rows."""

        def flags() -> Any:
            return np.zeros(size, bool)

        def integers(value: int = 0) -> Indices:
            return np.full(size, value, np.int64)

        room = size + -size % ROW_PADDING
        return cls(  # type: ignore[call-arg]  # lengths of unpacked arrays are unknown to it
            np.empty((size, size)),
            *(flags(), flags(), flags()),
            np.array([0, 0, min(COLUMN_BLOCK, room), 0]),
            *(integers(), integers(-1), integers(), integers()),
            _allocate_aligned(size * room, float),
            _allocate_aligned(size * room, np.float32),
            np.empty(size**2),
            integers(),
            *_allocate_aligned(10 * room, float).reshape((10, room)),
            _allocate_aligned((MAX_KRYLOV_VECTORS + 1) * room, np.float32).reshape((-1, room)),
            np.empty((MAX_KRYLOV_VECTORS, MAX_KRYLOV_VECTORS)),
            np.empty((MAX_KRYLOV_VECTORS + 1, 3)),
            np.empty(segments, np.int64),
            integers(),
            (np.zeros((pairs, 3), np.int64), np.zeros(pairs)),
        )


def _allocate_aligned(count: int, kind: Any) -> Array:
    """Return zeros aligned to cache lines of 64 bytes, as loads across two lines are slow."""
    size = count * np.dtype(kind).itemsize
    memory = np.zeros(size + 64, np.uint8)
    begin = -memory.ctypes.data % 64
    return np.asarray(memory[begin : begin + size].view(kind))


@view_kernel
def row_room(count):  # type: ignore
    """Return the storage length of a row of `count` entries, a multiple of `ROW_PADDING`."""
    return (count + ROW_PADDING - 1) // ROW_PADDING * ROW_PADDING


@view_kernel
def rows_of(entries, count, wide):  # type: ignore
    """Return the first `count` rows, of `wide` entries each, of a matrix stored in a flat array."""
    return entries[: count * wide].reshape((count, wide))


@summing_kernel
def multiply_rows(matrix, vector, images):  # type: ignore
    """Multiply rows of a matrix by a vector (c,) into images (k,)."""
    count, zero = len(images), vector.dtype.type(0.0)
    tail = count % 4
    # four rows at a time: each entry of the vector is loaded once for all of them
    for row in range(0, count - tail, 4):
        a, b, c, d = matrix[row], matrix[row + 1], matrix[row + 2], matrix[row + 3]
        p, q, r, s = zero, zero, zero, zero
        for k in range(len(vector)):
            p += a[k] * vector[k]
            q += b[k] * vector[k]
            r += c[k] * vector[k]
            s += d[k] * vector[k]
        images[row], images[row + 1], images[row + 2], images[row + 3] = p, q, r, s
    for row in range(count - tail, count):
        own, p = matrix[row], zero
        for k in range(len(vector)):
            p += own[k] * vector[k]
        images[row] = p


@kernel
def clear_problem(active):  # type: ignore
    """Remove all rows, so that the order of later ones does not depend on earlier problems."""
    for k in range(active.sizes[0]):
        active.place[active.numbers[k]] = -1
    active.sizes[0], active.sizes[1] = 0, 0


@kernel
def begin_problem(active, rows):  # type: ignore
    """Replace the rows of the problem by others (k,); those in both keep their columns."""
    marks, sizes, k = active.marks, active.sizes, 0
    for row in rows:
        marks[row] = True
    while k < sizes[0]:
        if marks[active.numbers[k]]:
            k += 1
        else:
            _remove_row(active, k)
    for row in rows:
        marks[row] = False
        if active.place[row] < 0:
            _add_row(active, row)


@inlined_kernel
def _add_row(active, row):  # type: ignore
    """Add a row of the structure."""
    k, wide, full = active.sizes[0], active.sizes[2], active.full[row]
    active.sizes[0] += 1
    active.numbers[k], active.place[row], active.column_of[k] = row, k, -1
    for j in range(active.sizes[1]):
        active.entries[k * wide + j] = full[active.numbers[active.row_of[j]]]


@inlined_kernel
def _remove_row(active, k):  # type: ignore
    """Remove a row; the last one takes its place."""
    if active.column_of[k] >= 0:
        _remove_column(active, active.column_of[k])
    last, wide = active.sizes[0] - 1, active.sizes[2]
    active.place[active.numbers[k]] = -1
    if k < last:
        for j in range(active.sizes[1]):
            active.entries[k * wide + j] = active.entries[last * wide + j]
        row, column = active.numbers[last], active.column_of[last]
        active.numbers[k], active.place[row], active.column_of[k] = row, k, column
        if column >= 0:
            active.row_of[column] = k
    active.sizes[0] = last


@inlined_kernel
def _remove_column(active, column):  # type: ignore
    """Remove a column; the last one takes its place."""
    last, entries, wide = active.sizes[1] - 1, active.entries, active.sizes[2]
    active.column_of[active.row_of[column]] = -1
    if column < last:
        row = active.row_of[last]
        active.row_of[column], active.column_of[row] = row, column
        for k in range(active.sizes[0]):
            entries[k * wide + column] = entries[k * wide + last]
    active.sizes[1] = last


@kernel
def update_columns(active, before, force, count):  # type: ignore
    """Remove columns of rows whose λ and λ′ are zero, and add columns of the others.

    A column with λ in the last step stays: it often returns, and takes long to copy.
    """
    marks, column, (places, _) = active.marks, 0, active.derivatives
    for entry in range(count):
        marks[places[entry, 0]] = True
    while column < active.sizes[1]:
        row = active.row_of[column]
        if force[row] == 0.0 and before[row] == 0.0 and not marks[row]:
            _remove_column(active, column)
        else:
            column += 1
    for entry in range(count):
        marks[places[entry, 0]] = False
    add_columns(active, force, count)


@kernel
def add_columns(active, force, count):  # type: ignore
    """Add columns of rows whose λ, or one of the first `count` derivatives λ′, is not zero."""
    for k in range(active.sizes[0]):
        if force[k] != 0.0:
            _add_column(active, k)
    for entry in range(count):
        _add_column(active, active.derivatives[0][entry, 0])


@inlined_kernel
def _add_column(active, row):  # type: ignore
    """Add the column of a row, unless the row has one."""
    if active.column_of[row] < 0:
        column, full = active.sizes[1], active.full[active.numbers[row]]
        if column == active.sizes[2]:
            _widen(active)
        active.column_of[row], active.row_of[column] = column, row
        active.sizes[1] += 1
        for k in range(active.sizes[0]):
            active.entries[k * active.sizes[2] + column] = full[active.numbers[k]]


@kernel
def _widen(active):  # type: ignore
    """Lengthen the storage of each row by `COLUMN_BLOCK` entries."""
    rows, columns, wide = active.sizes[0], active.sizes[1], active.sizes[2]
    wider = min(wide + COLUMN_BLOCK, row_room(len(active.place)))
    # from the last entry on: each moves to a higher address, which none still needs
    for k in range(rows - 1, 0, -1):
        for j in range(columns - 1, -1, -1):
            active.entries[k * wider + j] = active.entries[k * wide + j]
    active.sizes[2] = wider


@kernel
def add_gaps(active, force, gaps):  # type: ignore
    """Add F λ to the gaps of the rows (k,); all λ that are not zero have a column."""
    size, count, own, image = active.sizes[0], active.sizes[1], active.column, active.image
    for j in range(count):
        own[j] = force[active.row_of[j]]
    for j in range(count, row_room(count)):
        own[j] = 0.0
    multiply_rows(
        rows_of(active.entries, size, active.sizes[2]), own[: row_room(count)], image[:size]
    )
    for k in range(size):
        gaps[k] += image[k]
