"""In which order to eliminate coordinates, and which of them go together in one dense block.

The order is one of minimum degree (George and Liu, SIAM Review 31, 1989). Columns of the factor
that fill in alike become a group, and so does a branch of the elimination tree with few columns.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

Indices = NDArray[np.int64]

LEAF = 16
"""Columns up to which a whole branch of the elimination tree becomes one group."""

WIDEST = 64
"""Columns of a group at most."""

SPARE = (64, 1.15)
"""Entries that a group may have at most, zeros included: so many, and so many for each entry."""


@dataclass(frozen=True, eq=False)
class Elimination:
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
    def of(cls, pattern: sparse.csr_matrix) -> "Elimination":
        """Return the order for a symmetric pattern, by minimum degree as SuperLU finds it.

        Args:
            pattern: any matrix that has all entries of those to be factorised, on one side of the
                diagonal at least: rounding may leave an entry without its mirror image (n, n).
        """
        ones = sparse.csr_matrix((np.ones(pattern.nnz), pattern.indices, pattern.indptr))
        ones = ones + ones.T
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
        """Group of each coordinate, in this order (n,)."""
        return np.repeat(np.arange(len(self.groups)), [end - start for start, end in self.groups])


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
