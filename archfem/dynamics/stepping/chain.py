"""Chains of blocks, whose joints are each coupled to the next ones only: what a band makes of that.

With F₀ the compliance of the blocks without joints, and K what joints have if closed, that of the
closed structure is F = (1 + F₀ K)⁻¹ F₀, and with it

    z = z₀ + F λ(z)    is    (1 + F₀ K) (z - z₀) = F₀ λ(z).

F is dense, but F₀ joins the rows of gaps of one joint to those of its neighbours only. So a pass of
Newton's method takes the solution of a band as wide as three joints, however many points slide.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components, reverse_cuthill_mckee
from scipy.sparse.linalg import splu

from archfem.arrays import Array

WIDEST = 24
"""Half-width of a band from which what is dense serves as well."""


class Chain(NamedTuple):
    """Joints of a chain of blocks, and room for passes in their band.

    Attributes:
        half: half-width of the band, 0 where there is none.
        order: of the rows of gaps in the band (r,).
        known: place of each row in it, numbers of all stretches, and those of all rows of slips.
        loose: F₀, row by row from the band's left (r, 2 h + 1).
        closed: 1 + F₀ K, likewise.
        matrix: room for what a pass solves (r + h, 2 h + 1).
        right: and for its right side (r + h,).
        rooms: for λ, what the gaps ask for instead, and their changes in a pass (4, r).
    """

    half: int
    order: Any
    known: tuple[Any, Any, Any]
    loose: Array
    closed: Array
    matrix: Array
    right: Array
    rooms: Array


_NONE = np.zeros(0, np.int64)

_EMPTY = np.zeros((0, 1))

NO_CHAIN = Chain(
    0, _NONE, (_NONE, _NONE, _NONE), _EMPTY, _EMPTY, _EMPTY, np.zeros(0), np.zeros((4, 0))
)
"""Where neighbours are not few."""


def chain_of(rows: sparse.csr_matrix, blocks: sparse.csr_matrix, rates: Any, parts: Any) -> Chain:
    """Return the joints of a chain, or `NO_CHAIN` where blocks make none.

    Args:
        rows: of gaps (r, n).
        blocks: effective matrix of a step without joints (n, n).
        rates: K, with entries also where joints that slide have some (r, r).
        parts: how many stretches there are, and how many rows are openings.
    """
    body = connected_components(blocks)[1]
    entries = abs(rows).tocoo()
    meets = sparse.csr_matrix((entries.data, (entries.row, body[entries.col])))
    meets.data[:] = 1.0
    coupled = sparse.csr_matrix((np.ones(rates.nnz), rates.indices, rates.indptr), rates.shape)
    pattern = meets @ meets.T @ (coupled + coupled.T)
    pattern = (pattern + pattern.T).tocsr()
    order = reverse_cuthill_mckee(pattern, symmetric_mode=True)
    found = pattern[order][:, order].tocoo()
    half = int(np.abs(found.row - found.col).max(initial=0))
    if half > WIDEST:
        return NO_CHAIN
    sorted_rows, count = rows[order], len(order)
    loose = sorted_rows @ splu(blocks.tocsc()).solve(sorted_rows.T.toarray())
    closed = np.eye(count) + loose @ rates[order][:, order].toarray()
    known = np.argsort(order), np.arange(parts[0]), np.arange(parts[1], count)
    return Chain(
        half,
        order.astype(np.int64),
        known,
        _band(loose, half),
        _band(closed, half),
        np.zeros((count + half, 2 * half + 1)),
        np.zeros(count + half),
        np.zeros((4, count)),
    )


def _band(matrix: Array, half: int) -> Array:
    """Rows of a matrix from the left of its band on (r, 2 h + 1)."""
    count = len(matrix)
    wide = np.pad(matrix, ((0, 0), (half, half)))
    places = np.arange(count)[:, None] + np.arange(2 * half + 1)
    return np.ascontiguousarray(wide[np.arange(count)[:, None], places])
