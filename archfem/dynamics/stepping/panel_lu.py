"""Gauss's elimination of a sparse matrix in dense panels, without row exchanges, compiled.

The matrix need not be symmetric, its pattern is. Of each group of coordinates (`elimination`) the
rows from its diagonal on are one dense block, and the columns below them another. Where entries
never change, as inside a fill, groups are eliminated once: what is left is the matrix condensed
onto the coordinates that joints move.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.dynamics.stepping.elimination import Elimination, Indices
from archfem.joints.moving.compiled import computing, summing

SMALL = 1e-6
"""Pivot, relative to the rest of its row, below which rows would have to be exchanged."""


class Panels(NamedTuple):
    """A matrix of which some entries change, in the order in which it is eliminated.

    Attributes:
        first: first column of each group, and the number of columns (groups + 1,).
        below: where its rows begin in `rows` (groups + 1,).
        rows: rows below the columns of each group.
        places: where its blocks begin among the entries, the rows of a group from its first column
            on and then its columns below them, column by column (groups + 1,).
        updates: where its targets begin (groups + 1,).
        targets: which entries its elimination changes further down, row by row.
        changing: groups to eliminate once entries change.
        base: all entries, of other groups eliminated.
        added: which entry each rate of the joints belongs to, -1 to none (j, 2, s, 2, s).
    """

    first: Indices
    below: Indices
    rows: Indices
    places: Indices
    updates: Indices
    targets: Indices
    changing: Indices
    base: Array
    added: Indices


_NONE = np.zeros(0, np.int64)

NO_PANELS = Panels(*(7 * (_NONE,)), np.zeros(0), np.zeros((0, 2, 0, 2, 0), np.int64))
"""Where a band serves."""


def panels_of(matrix: sparse.csr_matrix, elimination: Elimination, pairs: Indices) -> Panels:
    """Return a matrix in panels.

    Args:
        matrix: what of it does not change, in the order of elimination (n, n).
        elimination: of a pattern that has all its entries.
        pairs: row and column of each rate of the joints, negative where there is none
            (2, j, 2, s, 2, s).

    Raises:
        LinAlgError: what does not change cannot be eliminated without row exchanges.
    """
    first = np.array([start for start, _ in elimination.groups] + [matrix.shape[0]], np.int64)
    counts = np.array([len(rows) for rows in elimination.rows])
    width = np.diff(first)
    sizes = width * (width + 2 * counts)
    below, places, updates = (
        np.concatenate([[0], np.cumsum(each)]) for each in (counts, sizes, counts**2)
    )
    rows = np.concatenate(elimination.rows).astype(np.int64)
    layout = NO_PANELS._replace(first=first, below=below, rows=rows, places=places, updates=updates)
    targets = [np.broadcast_arrays(own[:, None], own) for own in elimination.rows]
    ends = (np.concatenate([each[k].ravel() for each in targets]) for k in range(2))
    entries, base = matrix.tocoo(), np.zeros(places[-1])
    np.add.at(base, _entries(layout, entries.row, entries.col), entries.data)
    used = pairs[0] >= 0
    added = np.full(used.shape, -1)
    added[used] = _entries(layout, *pairs[:, used])
    changes = np.zeros(len(width), bool)
    changes[elimination.group_of[pairs[:, used].min(axis=0)]] = True
    for group, parent in enumerate(elimination.parent):
        if changes[group] and parent >= 0:
            changes[parent] = True
    panels = layout._replace(targets=_entries(layout, *ends), added=added, base=base)
    never = panels._replace(changing=np.flatnonzero(~changes))
    if not eliminated(never, base, np.empty(matrix.shape[0])):
        raise np.linalg.LinAlgError("a fill without joints is not held by its own inertia")
    return panels._replace(changing=np.flatnonzero(changes))


def _entries(panels: Panels, rows: Any, columns: Any) -> Indices:
    """Which entry belongs to each row and column (k,)."""
    first, low, high = panels.first, np.minimum(rows, columns), np.maximum(rows, columns)
    size = first[-1]
    group = np.searchsorted(first, low, "right") - 1
    start, width, count = first[group], np.diff(first)[group], np.diff(panels.below)[group]
    keys = size * np.repeat(np.arange(len(first) - 1), np.diff(panels.below)) + panels.rows
    later = np.searchsorted(keys, size * group + high) - panels.below[group]
    inner, near, far = high < start + width, low - start, high - start
    upper = np.where(rows <= columns, near, far) * (width + count)
    upper += np.where(rows <= columns, np.where(inner, far, width + later), near)
    lower = width * (width + count) + near * count + later
    return np.asarray(panels.places[group] + np.where(inner | (rows <= columns), upper, lower))


@computing
def renewed(panels, rates, entries, room):  # type: ignore
    """Split the matrix into triangles.

    Args:
        panels: `Panels`.
        rates: of the joints, which are added (j, 2, s, 2, s).
        entries: filled, as `back` takes them.
        room: for intermediate results (n,).

    Returns:
        Whether no pivot has become small, by which row exchanges would be needed.
    """
    for k in range(len(entries)):
        entries[k] = panels.base[k]
    added = panels.added
    for joint in range(added.shape[0]):
        for side in range(2):
            for k in range(added.shape[2]):
                for other in range(2):
                    for m in range(added.shape[4]):
                        if added[joint, side, k, other, m] >= 0:
                            place = added[joint, side, k, other, m]
                            entries[place] += rates[joint, side, k, other, m]
    return eliminated(panels, entries, room)


@computing
def eliminated(panels, entries, room):  # type: ignore
    """Eliminate the groups that change.

    Args:
        panels: `Panels`.
        entries: of the matrix, then of its triangles.
        room: for intermediate results (n,).

    Returns:
        Whether no pivot has become small.
    """
    for group in panels.changing:
        start, end = panels.places[group], panels.places[group + 1]
        width = panels.first[group + 1] - panels.first[group]
        count = panels.below[group + 1] - panels.below[group]
        top = entries[start : start + width * (width + count)].reshape((width, width + count))
        left = entries[start + width * (width + count) : end].reshape((width, count))
        targets = panels.targets[panels.updates[group] : panels.updates[group + 1]]
        if not _split(top, left):
            return False
        _passed_on(top, left, targets, room, entries)
    return True


@summing
def _split(top, left):  # type: ignore
    """Eliminate the columns of a group within its blocks; whether no pivot is small."""
    width, size = top.shape
    for k in range(width):
        row, largest = top[k], 0.0
        for j in range(k, size):
            largest = max(largest, abs(row[j]))
        if not abs(row[k]) > SMALL * largest:
            return False
        inverse = 1.0 / row[k]
        for i in range(k + 1, width):
            other = top[i]
            factor = other[k] * inverse
            other[k] = factor
            for j in range(k + 1, size):
                other[j] -= factor * row[j]
        column = left[k]
        for i in range(len(column)):
            column[i] *= inverse
        for m in range(k + 1, width):
            other, factor = left[m], row[m]
            for i in range(len(column)):
                other[i] -= factor * column[i]
    return True


@summing
def _passed_on(top, left, targets, room, entries):  # type: ignore
    """Take what a group's elimination changes from the entries further down."""
    width, count = left.shape
    for i in range(count):
        for j in range(count):
            room[j] = 0.0
        done = 0
        while done + 4 <= width:
            a, b, c, d = left[done, i], left[done + 1, i], left[done + 2, i], left[done + 3, i]
            p, q, r, s = top[done], top[done + 1], top[done + 2], top[done + 3]
            p, q, r, s = p[width:], q[width:], r[width:], s[width:]
            for j in range(count):
                room[j] += a * p[j] + b * q[j] + c * r[j] + d * s[j]
            done += 4
        for k in range(done, width):
            factor, row = left[k, i], top[k, width:]
            for j in range(count):
                room[j] += factor * row[j]
        own = targets[i * count : (i + 1) * count]
        for j in range(count):
            entries[own[j]] -= room[j]


@summing
def back(panels, entries, vector, room):  # type: ignore
    """Solve a system in place by its triangles.

    Args:
        panels: `Panels`.
        entries: as `renewed` leaves them.
        vector: right side, then solution (n,).
        room: for intermediate results (n,).
    """
    _down(panels, entries, vector, room)
    _up(panels, entries, vector, room)


@summing
def _down(panels, entries, vector, room):  # type: ignore
    """Solve with the lower triangle."""
    first, below = panels.first, panels.below
    for group in range(len(first) - 1):
        start, width = first[group], first[group + 1] - first[group]
        rows = panels.rows[below[group] : below[group + 1]]
        count, place = len(rows), panels.places[group]
        lower = place + width * (width + count)
        total = room[:count]
        for i in range(count):
            total[i] = 0.0
        for k in range(width):
            value = vector[start + k]
            for i in range(k + 1, width):
                vector[start + i] -= value * entries[place + i * (width + count) + k]
            column = entries[lower + k * count : lower + (k + 1) * count]
            for i in range(count):
                total[i] += value * column[i]
        for i in range(count):
            vector[rows[i]] -= total[i]


@summing
def _up(panels, entries, vector, room):  # type: ignore
    """Solve with the upper triangle."""
    first, below = panels.first, panels.below
    for group in range(len(first) - 2, -1, -1):
        start, width = first[group], first[group + 1] - first[group]
        rows = panels.rows[below[group] : below[group + 1]]
        count, own = len(rows), room[: width + len(rows)]
        for k in range(width):
            own[k] = vector[start + k]
        for i in range(count):
            own[width + i] = vector[rows[i]]
        for k in range(width - 1, -1, -1):
            begin = panels.places[group] + k * (width + count)
            row, value = entries[begin : begin + width + count], own[k]
            for j in range(k + 1, width + count):
                value -= row[j] * own[j]
            own[k] = value / row[k]
            vector[start + k] = own[k]
