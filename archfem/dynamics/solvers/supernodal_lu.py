"""Sparse LU factors in dense panels: elimination order, factor without exchanges, and solves.

The order is one of minimum degree (George and Liu, SIAM Review 31, 1989). Columns of the factor
with the same fill form a group, and so does a branch of the elimination tree with few columns.

The pattern is symmetric, the matrix need not be. The rows of each group from the diagonal on are
one dense block, and the columns below them another. Groups form a tree, and the update of a group
to its ancestors is stored. Where few entries change, only their groups and ancestors are eliminated
again; solves of a symmetric pattern may keep to branches of the tree, too.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import solve_triangular
from scipy.sparse.linalg import splu

from archfem._numba import entry, kernel, summing_kernel
from archfem._typing import Array

Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Elimination:
    """Order of elimination of matrices of one pattern, in groups of columns."""

    order: Indices
    # coordinates, each branch of the elimination tree without a gap (n,)
    groups: list[tuple[int, int]]
    # first column of each group, and one after its last
    rows: list[Indices]
    # rows below each group
    parent: Indices
    # group of the first row below, -1 where there is none (groups,)
    group_of: Indices
    # group of each coordinate, in this order (n,)

    @classmethod
    def of(cls, pattern: sparse.csr_matrix) -> "Elimination":
        """Return the order for a matrix with all entries of those to be factorised (n, n)."""
        # made symmetric: cancellation may remove an entry without its mirror image
        ones = sparse.csr_matrix((np.ones(pattern.nnz), pattern.indices, pattern.indptr))
        ones = ones + ones.T
        dominant = (ones + pattern.shape[0] * sparse.identity(pattern.shape[0])).tocsc()
        factor = splu(dominant, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        order = np.argsort(factor.perm_c)
        # no entry of a dominant matrix cancels: the factor has the fill of any other one
        lower = sparse.tril(factor.L, -1, "csc").sorted_indices()
        fill = np.split(lower.indices, lower.indptr[1:-1])
        after = _postorder([int(rows[0]) if len(rows) else len(fill) for rows in fill])
        place = np.argsort(after)
        fill = [np.sort(place[fill[column]]) for column in after]
        groups = _groups(fill)
        group_of = np.repeat(np.arange(len(groups)), [end - start for start, end in groups])
        rows = [fill[end - 1] for _, end in groups]
        parent = np.array([group_of[own[0]] if len(own) else -1 for own in rows])
        return cls(order[after], groups, rows, parent, group_of)


def _postorder(parent: list[int]) -> Indices:
    """Return children before parents, branches without gaps; roots have parent `len(parent)`."""
    children: list[list[int]] = [[] for _ in range(len(parent) + 1)]
    for node, above in enumerate(parent):
        children[above].append(node)
    order, stack = [], list(children[-1])
    while stack:  # parents before children, reversed below
        node = stack.pop()
        order.append(node)
        stack.extend(children[node])
    return np.array(order[::-1])


def _groups(fill: list[Indices]) -> list[tuple[int, int]]:
    """Return the first column of each group, and one after its last."""
    branch = np.ones(len(fill), dtype=np.int64)
    for column, rows in enumerate(fill):
        if len(rows):
            branch[rows[0]] += branch[column]
    groups: list[tuple[int, int]] = []
    entries: list[int] = []
    for column, rows in enumerate(fill):
        start, own = column, len(rows) + 1
        leaf = column - int(branch[column]) + 1
        while groups and groups[-1][0] >= leaf:
            # join the group before if the branch is small, or few zeros are stored by that
            before, joined = groups[-1], own + entries[-1]
            width, height = column + 1 - before[0], column + 1 - before[0] + len(rows)
            stored = width * height - width * (width - 1) // 2
            below = fill[before[1] - 1]
            follows = len(below) > 0 and start <= below[0] <= column
            dense = width <= 64 and stored <= 64 + 1.15 * joined
            # a whole branch of up to 16 columns becomes one group
            if not (branch[column] <= 16 or (follows and dense)):
                break
            start, own = before[0], joined
            groups.pop()
            entries.pop()
        groups.append((start, column + 1))
        entries.append(own)
    return groups


class Panels(NamedTuple):
    """A matrix of which some entries change, in the order of its elimination."""

    first: Indices  # first column of each group, and the number of columns (groups + 1,)
    below: Indices  # begin of its rows in `rows` (groups + 1,)
    rows: Any  # rows below the columns of each group
    parent: Indices  # group of the first row below, -1 where there is none (groups,)
    places: Indices  # begin of its entries: its rows, then columns below them (groups + 1,)
    updates: Indices  # begin of its products (groups + 1,)
    targets: Any  # entries from which its products are subtracted, row by row
    group_of: Indices  # group of each coordinate (n,)
    changed: Any  # whether entries of a group have changed since it was factorised (groups,)
    base: Array  # entries without changes
    entries: Array  # of the matrix
    factor: Array  # entries of its triangles, pivots inverted
    products: Array  # of the blocks of each group, in an even number of rows
    image: Array  # intermediate results (n,)
    smallest_step: float  # pivot, relative to its row, below which rows would have to be exchanged


def panels_of(
    matrix: sparse.csr_matrix, elimination: Elimination, rows: Any, columns: Any
) -> Panels:
    """Return a matrix in panels, of which entries in some rows and columns (k,) change."""
    panels = _layout(matrix, elimination, 1e-6)
    panels.changed[panels.group_of[np.minimum(rows, columns)]] = True
    add_ancestors(panels)
    # all others, as inside a fill, are eliminated once
    if not eliminate(panels._replace(changed=~panels.changed)):
        raise np.linalg.LinAlgError("a fill without joints is not held by its own inertia")
    return panels


class SymmetricFactor(NamedTuple):
    """The factor C Cᵀ of a symmetric positive definite matrix.

    The panel of a group holds the inverse of its triangle, and below it the rows further down times
    that inverse. So both substitutions are products with it, in which loops are long.
    """

    first: Indices  # first column of each group, and the number of columns (groups + 1,)
    below: Indices  # begin of its rows in `rows` (groups + 1,)
    rows: Any  # rows below the columns of each group
    parent: Indices  # group of the first row below, -1 where there is none (groups,)
    places: Indices  # begin of its panel (groups + 1,)
    panels: Array  # column by column
    image: Array  # intermediate results (n,)


def symmetric_factor(matrix: sparse.csr_matrix, elimination: Elimination) -> SymmetricFactor:
    """Return the factor of a symmetric positive definite matrix.

    Raises LinAlgError where it is not definite, and ValueError where the pattern lacks entries.
    """
    lu, parts = _layout(matrix, elimination, 0.0), []  # no exchanges, however small a pivot is
    lu.changed[:] = True
    regular = eliminate(lu)
    for group, width in enumerate(np.diff(lu.first)):
        entries = lu.factor[lu.places[group] : lu.places[group + 1]]
        count = lu.below[group + 1] - lu.below[group]
        top = entries[: width * (width + count)].reshape(width, -1)[:, :width]
        left = entries[width * (width + count) :].reshape(width, count)
        inverse_pivots = np.diag(top)
        if not (regular and np.all(inverse_pivots > 0.0)):
            raise np.linalg.LinAlgError("the matrix is not positive definite")
        unit = np.tril(top, -1) + np.identity(width)
        inverse = solve_triangular(unit, np.identity(width), lower=True, unit_diagonal=True)
        panel = np.vstack([np.sqrt(inverse_pivots)[:, None] * inverse, left.T @ inverse])
        parts.append(panel.T.ravel())
    places = np.concatenate([[0], np.cumsum([len(part) for part in parts])])
    panels = np.concatenate(parts)
    return SymmetricFactor(lu.first, lu.below, lu.rows, lu.parent, places, panels, lu.image)


def _layout(matrix: sparse.csr_matrix, elimination: Elimination, smallest: float) -> Panels:
    """Return the panels of a matrix, with the targets of the elimination of all groups."""
    size, counts = matrix.shape[0], np.array([len(own) for own in elimination.rows])
    first = np.array([start for start, _ in elimination.groups] + [size], np.int64)
    # compiled indices without a sign need no check of it
    width, rows = np.diff(first), np.concatenate(elimination.rows).astype(np.uint32)
    sizes = width * (width + 2 * counts)
    # an odd number of rows below leaves room for one more, as two are multiplied at a time
    padded = (counts + counts % 2) * counts
    below, places, updates = (
        np.concatenate([[0], np.cumsum(each)]) for each in (counts, sizes, padded)
    )
    panels = Panels(
        *(first, below, rows, elimination.parent, places, updates),
        *(np.zeros(updates[-1], np.uint32), elimination.group_of, np.zeros(len(width), bool)),
        *(np.zeros(places[-1]), np.zeros(places[-1]), np.zeros(places[-1])),
        *(np.zeros(updates[-1]), np.zeros(size), smallest),
    )
    pairs = [np.broadcast_arrays(own[:, None], own) for own in elimination.rows]
    ends = (np.concatenate([each[k].ravel() for each in pairs]) for k in range(2))
    filled = [begin + np.arange(count**2) for begin, count in zip(updates, counts, strict=False)]
    panels.targets[np.concatenate(filled)] = panel_places(panels, *ends)
    of_matrix = matrix.tocoo()
    np.add.at(panels.base, panel_places(panels, of_matrix.row, of_matrix.col), of_matrix.data)
    panels.entries[:] = panels.base
    return panels


def panel_places(panels: Panels, rows: Any, columns: Any) -> Indices:
    """Return the positions in `entries` of the matrix entries at some rows and columns (k,)."""
    first, low, high = panels.first, np.minimum(rows, columns), np.maximum(rows, columns)
    group = np.searchsorted(first, low, "right") - 1
    start, width, count = first[group], np.diff(first)[group], np.diff(panels.below)[group]
    # place of the higher coordinate among the rows below the group, by a search in all of them
    size = first[-1]
    keys = size * np.repeat(np.arange(len(first) - 1), np.diff(panels.below)) + panels.rows
    later = np.searchsorted(keys, size * group + high) - panels.below[group]
    inner, near, far = high < start + width, low - start, high - start
    match = np.append(keys, -1)[later + panels.below[group]] == size * group + high
    if not np.all(inner | match):
        raise ValueError("the matrix has entries that the pattern of its factor lacks")
    upper = np.where(rows <= columns, near, far) * (width + count)
    upper += np.where(rows <= columns, np.where(inner, far, width + later), near)
    lower = width * (width + count) + near * count + later
    return np.asarray(panels.places[group] + np.where(inner | (rows <= columns), upper, lower))


@entry
def add_ancestors(panels):  # type: ignore
    """Mark the ancestors of groups that have changed as changed; returns the panels."""
    changed = panels.changed
    for group in range(len(changed)):
        if changed[group] and panels.parent[group] >= 0:
            changed[panels.parent[group]] = True
    return panels


@entry
def eliminate(panels):  # type: ignore
    """Factorise the groups that have changed; returns whether no pivot has become small."""
    entries, rows, changed = panels.factor, panels.rows, panels.changed
    for group in range(len(changed)):
        if changed[group]:
            for k in range(panels.places[group], panels.places[group + 1]):
                entries[k] = panels.entries[k]
    for group in range(len(changed)):
        start, end = panels.places[group], panels.places[group + 1]
        width = panels.first[group + 1] - panels.first[group]
        count = panels.below[group + 1] - panels.below[group]
        middle = start + width * (width + count)
        top = entries[start:middle].reshape((width, width + count))
        left = entries[middle:end].reshape((width, count))
        products = panels.products[panels.updates[group] : panels.updates[group + 1]]
        kept = 0  # rows below, of groups that do not change
        if changed[group]:
            if not _eliminate_rows(top, panels.smallest_step):
                return False
            _eliminate_columns(top, left)
            _multiply_blocks(top, left, products)
        else:
            own = rows[panels.below[group] : panels.below[group + 1]]
            while kept < count and not changed[panels.group_of[own[kept]]]:
                kept += 1
        targets = panels.targets[panels.updates[group] : panels.updates[group + 1]]
        # each entry of the product goes to its position in the panels of later groups
        for i in range(kept, count):
            for k in range(i * count + kept, (i + 1) * count):
                entries[targets[k]] -= products[k]
    return True


@summing_kernel
def _eliminate_rows(top, smallest):  # type: ignore
    """Eliminate in each row of a group the columns before its own."""
    width, size = top.shape
    for i in range(width):
        own = top[i]
        for last in range(i):
            row = top[last]
            own[last] = factor = own[last] * row[last]
            for j in range(last + 1, size):
                own[j] -= factor * row[j]
        # without row exchanges, a pivot that is small in its row would round all others off
        largest = 0.0
        for j in range(i, size):
            largest = max(largest, abs(own[j]))
        if not abs(own[i]) > smallest * largest:
            return False
        own[i] = 1.0 / own[i]
    return True


@summing_kernel
def _eliminate_columns(top, left):  # type: ignore
    """Eliminate in the rows below a group, stored by columns, the columns of the group."""
    width, count = left.shape
    for m in range(width):
        # columns before this one, then its pivot
        own = left[m]
        for last in range(m):
            factor, other = top[last, m], left[last]
            for i in range(count):
                own[i] -= factor * other[i]
        inverse = top[m, m]
        for i in range(count):
            own[i] *= inverse


@summing_kernel
def _multiply_blocks(top, left, products):  # type: ignore
    """Multiply the blocks of a group, two rows at a time."""
    width, count = left.shape
    for i in range(0, count, 2):
        m = min(i + 1, count - 1)  # the second row
        one = products[i * count : (i + 1) * count]
        two = products[(i + 1) * count : (i + 2) * count]
        for j in range(count):
            one[j] = two[j] = 0.0
        # both rows of the product, four columns of the group at a time
        for k in range(0, width - width % 4, 4):
            p, q, r, s = top[k][width:], top[k + 1][width:], top[k + 2][width:], top[k + 3][width:]
            a, b, c, d = left[k, i], left[k + 1, i], left[k + 2, i], left[k + 3, i]
            e, f, g, h = left[k, m], left[k + 1, m], left[k + 2, m], left[k + 3, m]
            for j in range(count):
                one[j] += a * p[j] + b * q[j] + c * r[j] + d * s[j]
                two[j] += e * p[j] + f * q[j] + g * r[j] + h * s[j]
        for k in range(width - width % 4, width):
            row, a, e = top[k][width:], left[k, i], left[k, m]
            for j in range(count):
                one[j] += a * row[j]
                two[j] += e * row[j]


@summing_kernel
def solve_panels(panels, vector):  # type: ignore
    """Solve in place by the factor of `eliminate`."""
    # forward substitution, group by group
    for group in range(len(panels.parent)):
        start, width = panels.first[group], panels.first[group + 1] - panels.first[group]
        rows = panels.rows[panels.below[group] : panels.below[group + 1]]
        own, size = vector[start : start + width], width + len(rows)
        block = panels.factor[panels.places[group] :]
        for k in range(width):
            row, value = block[k * size :], own[k]
            for j in range(k):
                value -= row[j] * own[j]
            own[k] = value
            column = block[width * size + k * len(rows) :]
            for i in range(len(rows)):
                vector[rows[i]] -= column[i] * value
    # back substitution, from the last group on
    for group in range(len(panels.parent) - 1, -1, -1):
        start, width = panels.first[group], panels.first[group + 1] - panels.first[group]
        rows = panels.rows[panels.below[group] : panels.below[group + 1]]
        own, later, size = vector[start : start + width], panels.image, width + len(rows)
        block = panels.factor[panels.places[group] :]
        for i in range(len(rows)):
            later[i] = vector[rows[i]]
        for k in range(width - 1, -1, -1):
            row, value = block[k * size :], own[k]
            for j in range(k + 1, width):
                value -= row[j] * own[j]
            for i in range(len(rows)):
                value -= row[width + i] * later[i]
            own[k] = value * row[k]


@kernel
def _is_zero(vector):  # type: ignore
    """Return whether a vector has only zeros."""
    zero = True
    for value in vector:
        zero = zero and value == 0.0
    return zero


@summing_kernel
def solve_forward(factor, vector):  # type: ignore
    """Solve C x = b in place; groups with only zeros cost nothing."""
    for group in range(len(factor.parent)):
        start, width = factor.first[group], factor.first[group + 1] - factor.first[group]
        own = vector[start : start + width]
        if _is_zero(own):
            continue
        rows = factor.rows[factor.below[group] : factor.below[group + 1]]
        panel, size = factor.panels[factor.places[group] :], width + len(rows)
        total = factor.image[:size]
        for i in range(size):
            total[i] = 0.0
        for k in range(width):
            column, value = panel[k * size :], own[k]
            for i in range(size):
                total[i] += value * column[i]
        for i in range(width):
            own[i] = total[i]
        for i in range(len(rows)):
            vector[rows[i]] -= total[width + i]


@summing_kernel
def solve_backward(factor, vector, marked):  # type: ignore
    """Solve Cᵀ x = b in place, in the groups that are marked (groups,), with all ancestors."""
    for group in range(len(marked) - 1, -1, -1):
        if not marked[group]:
            continue
        start, width = factor.first[group], factor.first[group + 1] - factor.first[group]
        rows = factor.rows[factor.below[group] : factor.below[group + 1]]
        panel, size = factor.panels[factor.places[group] :], width + len(rows)
        # right side of the group, and the solution below it, which later groups have found
        own, known = vector[start : start + width], factor.image[:size]
        for i in range(width):
            known[i] = own[i]
        for i in range(len(rows)):
            known[width + i] = -vector[rows[i]]
        for k in range(width):
            column, value = panel[k * size :], 0.0
            for i in range(size):
                value += column[i] * known[i]
            own[k] = value
