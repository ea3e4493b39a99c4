"""A sparse Cholesky factor whose solves are compiled, dense block by dense block.

Columns of the factor L that fill in alike are kept together as one group, with J its columns and R
the rows below them. Of each group one dense panel is stored,

    P = [ L_JJ⁻¹ ; L_RJ L_JJ⁻¹ ],

with which solving with L and then with its transpose are products only,

    x_J ← P_1 x_J,  x_R ← x_R - P_2 x_J,      then in reverse      x_J ← Pᵀ [x_J; -x_R].

Groups form a tree: each passes on to the group of its first row below. Solves may keep to a part
of it. The factor itself is found front by front (Duff and Reid, ACM Trans. Math. Softw. 9, 1983).
"""

from typing import NamedTuple

import numba
import numpy as np
from scipy import sparse
from scipy.linalg import solve_triangular

from archfem.arrays import Array
from archfem.dynamics.stepping.elimination import Elimination, Indices


class Factor(NamedTuple):
    """The factor, in an order of the coordinates that keeps it sparse.

    Attributes:
        first: first column of each group, and the number of columns (groups + 1,).
        below: where its rows begin in `rows` (groups + 1,).
        rows: rows below the columns of each group.
        places: where its panel begins in `panels` (groups + 1,).
        panels: P of each group, column by column.
        parent: group of the first row below, -1 where there is none (groups,).
    """

    first: Indices
    below: Indices
    rows: Indices
    places: Indices
    panels: Array
    parent: Indices


def factorised(matrix: sparse.csr_matrix, elimination: Elimination) -> Factor:
    """Return the factor of a symmetric positive definite matrix.

    Args:
        matrix: its coordinates in the order of elimination.
        elimination: of a pattern that has all its entries.

    Raises:
        LinAlgError: the matrix is not positive definite.
        ValueError: it has an entry that the pattern has not.
    """
    panels = _panels(matrix.tocsc(), elimination)
    return Factor(
        np.array([start for start, _ in elimination.groups] + [matrix.shape[0]]),
        np.cumsum([0, *map(len, elimination.rows)]),
        np.concatenate(elimination.rows).astype(np.int64),
        np.cumsum([0, *map(len, panels)]),
        np.concatenate(panels),
        elimination.parent,
    )


def _panels(matrix: sparse.csc_matrix, elimination: Elimination) -> list[Array]:
    """Panel of each group, column by column, from fronts that pass on what is left of them."""
    rows, parent = elimination.rows, elimination.parent
    place = np.full(matrix.shape[0], -1)
    waiting: list[list[tuple[Indices, Array]]] = [[] for _ in rows]
    panels = []
    for number, (start, end) in enumerate(elimination.groups):
        width, height = end - start, end - start + len(rows[number])
        place[start:end] = np.arange(width)
        place[rows[number]] = np.arange(width, height)
        front = np.zeros((height, height))
        entries = slice(matrix.indptr[start], matrix.indptr[end])
        columns = np.repeat(np.arange(width), np.diff(matrix.indptr[start : end + 1]))
        keep = matrix.indices[entries] >= start + columns
        found = place[matrix.indices[entries][keep]]
        if found.min(initial=0) < 0:
            raise ValueError(f"columns {start} to {end - 1} have entries that the plan has not")
        front[found, columns[keep]] = matrix.data[entries][keep]
        for own, rest in waiting[number]:
            front[np.ix_(place[own], place[own])] += rest
        waiting[number] = []
        place[start:end], place[rows[number]] = -1, -1
        inverse = solve_triangular(
            np.linalg.cholesky(front[:width, :width]), np.eye(width), lower=True
        )
        lower = front[width:, :width] @ inverse.T
        if parent[number] >= 0:
            rest = front[width:, width:] - lower @ lower.T
            waiting[parent[number]].append((rows[number], rest))
        panels.append(np.concatenate([inverse, lower @ inverse]).T.ravel())
    return panels


@numba.njit(cache=True, fastmath={"contract", "reassoc"})
def forward(factor, vector, room):  # type: ignore
    """Solve L x = b in place; groups in which b has only zeros cost nothing.

    Args:
        factor: `Factor`.
        vector: b, then x (n,).
        room: for intermediate results (n,).
    """
    for group in range(len(factor.parent)):
        start, width = factor.first[group], factor.first[group + 1] - factor.first[group]
        own = vector[start : start + width]
        if _zero(own):
            continue
        rows = factor.rows[factor.below[group] : factor.below[group + 1]]
        height = width + len(rows)
        panel = factor.panels[factor.places[group] : factor.places[group + 1]]
        total = room[:height]
        total[:] = 0.0
        done = 0
        while done + 4 <= width:
            a, b, c, d = four(panel, done, height)
            p, q, r, s = own[done], own[done + 1], own[done + 2], own[done + 3]
            for i in range(height):
                total[i] += a[i] * p + b[i] * q + c[i] * r + d[i] * s
            done += 4
        for column in range(done, width):
            a, p = panel[column * height : (column + 1) * height], own[column]
            for i in range(height):
                total[i] += a[i] * p
        for i in range(width):
            own[i] = total[i]
        for i in range(len(rows)):
            vector[rows[i]] -= total[width + i]


@numba.njit(cache=True, fastmath={"contract", "reassoc"})
def backward(factor, vector, room, wanted):  # type: ignore
    """Solve Lᵀ x = b in place, in the groups that are wanted.

    Args:
        factor: `Factor`.
        vector: b, then x (n,).
        room: for intermediate results (n,).
        wanted: whether a group is to be solved; with it all that it passes on to (groups,).
    """
    for group in range(len(factor.parent) - 1, -1, -1):
        if not wanted[group]:
            continue
        start, width = factor.first[group], factor.first[group + 1] - factor.first[group]
        own = vector[start : start + width]
        rows = factor.rows[factor.below[group] : factor.below[group + 1]]
        height = width + len(rows)
        panel = factor.panels[factor.places[group] : factor.places[group + 1]]
        known = room[:height]
        for i in range(width):
            known[i] = own[i]
        for i in range(len(rows)):
            known[width + i] = -vector[rows[i]]
        done = 0
        while done + 4 <= width:
            a, b, c, d = four(panel, done, height)
            p, q, r, s = 0.0, 0.0, 0.0, 0.0
            for i in range(height):
                p += a[i] * known[i]
                q += b[i] * known[i]
                r += c[i] * known[i]
                s += d[i] * known[i]
            own[done], own[done + 1], own[done + 2], own[done + 3] = p, q, r, s
            done += 4
        for column in range(done, width):
            a, p = panel[column * height : (column + 1) * height], 0.0
            for i in range(height):
                p += a[i] * known[i]
            own[column] = p


@numba.njit(cache=True)
def _zero(vector):  # type: ignore
    """Whether there is nothing in a vector."""
    for value in vector:  # noqa: SIM110  (numba compiles no generators)
        if value != 0.0:
            return False
    return True


@numba.njit(cache=True, inline="always")
def four(panel, column, height):  # type: ignore
    """Return four columns of a panel, from one on.

    Args:
        panel: column by column.
        column: the first of them.
        height: of a column.
    """
    start = column * height
    return (
        panel[start : start + height],
        panel[start + height : start + 2 * height],
        panel[start + 2 * height : start + 3 * height],
        panel[start + 3 * height : start + 4 * height],
    )
