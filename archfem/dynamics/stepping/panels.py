"""A sparse Cholesky factor whose solves are compiled, dense block by dense block.

Columns of the factor L that fill in alike are kept together as one group, with J its columns and R
the rows below them. Of each group one dense panel is stored,

    P = [ L_JJ⁻¹ ; L_RJ L_JJ⁻¹ ],

with which solving with L and then with its transpose are products only,

    x_J ← P_1 x_J,  x_R ← x_R - P_2 x_J,      then in reverse      x_J ← Pᵀ [x_J; -x_R].

Groups form a tree: each passes on to the group of its first row below. Solves may keep to a part
of it. The factor itself is found front by front (Duff and Reid, ACM Trans. Math. Softw. 9, 1983).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import solve_triangular
from scipy.sparse.linalg import splu

from archfem.arrays import Array

Indices = NDArray[np.int64]

LEAF = 16
"""Columns up to which a whole branch of the elimination tree becomes one group."""

WIDEST = 64
"""Columns of a group at most."""

SPARE = (64, 1.15)
"""Entries that a group may have at most, zeros included: so many, and so many for each entry."""


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


@dataclass(frozen=True, eq=False)
class Plan:
    """In which order to eliminate the coordinates of matrices of one pattern.

    Attributes:
        order: of the coordinates, each branch of the elimination tree without a gap (n,).
        groups: first column of each group of the factor and the one after its last.
        rows: rows below each group.
        parent: group of the first row below, -1 where there is none (groups,).
    """

    order: Indices
    groups: list[tuple[int, int]]
    rows: list[Indices]
    parent: Indices

    @classmethod
    def of(cls, pattern: sparse.csr_matrix) -> "Plan":
        """Plan for a symmetric pattern, by minimum degree as SuperLU finds it."""
        ones = sparse.csr_matrix((np.ones(pattern.nnz), pattern.indices, pattern.indptr))
        dominant = (ones + pattern.shape[0] * sparse.identity(pattern.shape[0])).tocsc()
        found = splu(dominant, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        order = np.argsort(found.perm_c)
        fill = _fill(dominant[order][:, order].tocsc())
        after = _postorder([int(rows[0]) if len(rows) else len(fill) for rows in fill])
        place = np.argsort(after)
        fill = [np.sort(place[fill[column]]) for column in after]
        groups = _groups(fill)
        group_of = np.repeat(np.arange(len(groups)), [end - start for start, end in groups])
        rows = [fill[end - 1] for _, end in groups]
        parent = np.array([group_of[own[0]] if len(own) else -1 for own in rows])
        return cls(order[after], groups, rows, parent)

    @property
    def group_of(self) -> Indices:
        """Group of each coordinate, in the order of the plan (n,)."""
        return np.repeat(np.arange(len(self.groups)), [end - start for start, end in self.groups])


def factorised(matrix: sparse.csr_matrix, plan: Plan) -> Factor:
    """Factorise a symmetric positive definite matrix.

    Args:
        matrix: its coordinates in the order of the plan.
        plan: for a pattern that has all its entries.

    Raises:
        LinAlgError: the matrix is not positive definite.
    """
    panels = _panels(matrix.tocsc(), plan)
    return Factor(
        np.array([start for start, _ in plan.groups] + [matrix.shape[0]]),
        np.cumsum([0, *map(len, plan.rows)]),
        np.concatenate(plan.rows).astype(np.int64),
        np.cumsum([0, *map(len, panels)]),
        np.concatenate(panels),
        plan.parent,
    )


def _fill(matrix: sparse.csc_matrix) -> list[Indices]:
    """Rows below the diagonal in each column of the factor, in order."""
    size = matrix.shape[0]
    found: list[set[int]] = []
    children: list[list[int]] = [[] for _ in range(size)]
    for column in range(size):
        own = matrix.indices[matrix.indptr[column] : matrix.indptr[column + 1]]
        rows = set(own[own > column].tolist())
        for child in children[column]:
            rows |= found[child]
        rows.discard(column)
        found.append(rows)
        if rows:
            children[min(rows)].append(column)
    return [np.array(sorted(rows), dtype=np.int64) for rows in found]


def _postorder(parent: list[int]) -> Indices:
    """Children before parents, each branch without a gap; roots have the parent `len(parent)`."""
    children: list[list[int]] = [[] for _ in range(len(parent) + 1)]
    for node, above in enumerate(parent):
        children[above].append(node)
    order, stack = [], list(children[-1])
    while stack:  # parents before children, to be turned round
        node = stack.pop()
        order.append(node)
        stack.extend(children[node])
    return np.array(order[::-1])


def _groups(fill: list[Indices]) -> list[tuple[int, int]]:
    """First column of each group and the one after its last."""
    size = len(fill)
    branch = np.ones(size, dtype=np.int64)
    for column, rows in enumerate(fill):
        if len(rows):
            branch[rows[0]] += branch[column]
    groups: list[tuple[int, int]] = []
    entries: list[int] = []
    for column, rows in enumerate(fill):
        start, own = column, len(rows) + 1
        leaf = column - int(branch[column]) + 1
        while groups and groups[-1][0] >= leaf:
            before = groups[-1]
            joined = own + entries[-1]
            width, height = column + 1 - before[0], column + 1 - before[0] + len(rows)
            whole = width * height - width * (width - 1) // 2
            small = branch[column] <= LEAF
            below = fill[before[1] - 1]
            fits = (
                len(below) > 0
                and start <= below[0] <= column
                and width <= WIDEST
                and whole <= SPARE[0] + SPARE[1] * joined
            )
            if not (small or fits):
                break
            start, own = before[0], joined
            groups.pop()
            entries.pop()
        groups.append((start, column + 1))
        entries.append(own)
    return groups


def _panels(matrix: sparse.csc_matrix, plan: Plan) -> list[Array]:
    """Panel of each group, column by column, from fronts that pass on what is left of them."""
    rows, parent = plan.rows, plan.parent
    place = np.empty(matrix.shape[0], dtype=np.int64)
    waiting: list[list[tuple[Indices, Array]]] = [[] for _ in rows]
    panels = []
    for number, (start, end) in enumerate(plan.groups):
        width, height = end - start, end - start + len(rows[number])
        place[start:end] = np.arange(width)
        place[rows[number]] = np.arange(width, height)
        front = np.zeros((height, height))
        entries = slice(matrix.indptr[start], matrix.indptr[end])
        columns = np.repeat(np.arange(width), np.diff(matrix.indptr[start : end + 1]))
        keep = matrix.indices[entries] >= start + columns
        front[place[matrix.indices[entries][keep]], columns[keep]] = matrix.data[entries][keep]
        for own, rest in waiting[number]:
            front[np.ix_(place[own], place[own])] += rest
        waiting[number] = []
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
            a, b, c, d = _four(panel, done, height)
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
            a, b, c, d = _four(panel, done, height)
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
def _four(panel, column, height):  # type: ignore
    """Four columns of a panel, from this one on."""
    start = column * height
    return (
        panel[start : start + height],
        panel[start + height : start + 2 * height],
        panel[start + 2 * height : start + 3 * height],
        panel[start + 3 * height : start + 4 * height],
    )
