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
        entries: of the matrix, then of its triangles, pivots inverted.
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
        if not _split_rows(top):
            return False
        _split_columns(top, left)
        _passed_on(top, left, targets, room, entries)
    return True


@summing
def _split_rows(top):  # type: ignore
    """Eliminate in each row of a group the columns before its own; whether no pivot is small."""
    width, size = top.shape
    for i in range(width):
        own, k = top[i], 0
        while k + 4 <= i:
            p, q, r, s = top[k], top[k + 1], top[k + 2], top[k + 3]
            a = own[k] * p[k]
            b = (own[k + 1] - a * p[k + 1]) * q[k + 1]
            c = (own[k + 2] - a * p[k + 2] - b * q[k + 2]) * r[k + 2]
            d = (own[k + 3] - a * p[k + 3] - b * q[k + 3] - c * r[k + 3]) * s[k + 3]
            own[k], own[k + 1], own[k + 2], own[k + 3] = a, b, c, d
            k += 4
            rest, p, q, r, s = own[k:], p[k:], q[k:], r[k:], s[k:]
            for j in range(len(rest)):
                rest[j] -= a * p[j] + b * q[j] + c * r[j] + d * s[j]
        for last in range(k, i):
            row = top[last]
            own[last] = factor = own[last] * row[last]
            for j in range(last + 1, size):
                own[j] -= factor * row[j]
        largest = 0.0
        for j in range(i, size):
            largest = max(largest, abs(own[j]))
        if not abs(own[i]) > SMALL * largest:
            return False
        own[i] = 1.0 / own[i]
    return True


@summing
def _split_columns(top, left):  # type: ignore
    """Eliminate the same in the rows below, which are given column by column."""
    width, count = left.shape
    for m in range(width):
        own, done = left[m], 0
        while done + 4 <= m:
            a, b, c, d = top[done, m], top[done + 1, m], top[done + 2, m], top[done + 3, m]
            p, q, r, s = left[done], left[done + 1], left[done + 2], left[done + 3]
            for i in range(count):
                own[i] -= a * p[i] + b * q[i] + c * r[i] + d * s[i]
            done += 4
        for k in range(done, m):
            factor, other = top[k, m], left[k]
            for i in range(count):
                own[i] -= factor * other[i]
        inverse = top[m, m]
        for i in range(count):
            own[i] *= inverse


@summing
def _passed_on(top, left, targets, room, entries):  # type: ignore
    """Take what a group's elimination changes from the entries further down, two rows at a time."""
    count = left.shape[1]
    for i in range(0, count, 2):
        pair = i + 1 < count
        one, two = room[:count], room[count : 2 * count]
        _products(top, left, (i, i + 1 if pair else i), one, two)
        own = targets[i * count : (i + 1) * count]
        for j in range(count):
            entries[own[j]] -= one[j]
        if pair:
            own = targets[(i + 1) * count : (i + 2) * count]
            for j in range(count):
                entries[own[j]] -= two[j]


@summing
def _products(top, left, rows, one, two):  # type: ignore
    """Multiply two rows below a group by its rows."""
    (width, count), (m, n), k = left.shape, rows, 0
    for j in range(count):
        one[j] = two[j] = 0.0
    while k + 4 <= width:
        p, q, r, s = top[k][width:], top[k + 1][width:], top[k + 2][width:], top[k + 3][width:]
        a, b, c, d = left[k, m], left[k + 1, m], left[k + 2, m], left[k + 3, m]
        e, f, g, h = left[k, n], left[k + 1, n], left[k + 2, n], left[k + 3, n]
        for j in range(count):
            one[j] += a * p[j] + b * q[j] + c * r[j] + d * s[j]
            two[j] += e * p[j] + f * q[j] + g * r[j] + h * s[j]
        k += 4
    for last in range(k, width):
        row, a, e = top[last][width:], left[last, m], left[last, n]
        for j in range(count):
            one[j] += a * row[j]
            two[j] += e * row[j]
