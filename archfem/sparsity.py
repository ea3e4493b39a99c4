"""One sparsity pattern for a family of matrices, so that sums are sums of their data."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem.structure import Array


@dataclass(frozen=True, eq=False)
class Pattern:
    """Positions at which any matrix of a family may have an entry.

    Attributes:
        indptr: starts of the rows (n + 1,).
        indices: columns, ascending in each row (nnz,).
    """

    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]

    @classmethod
    def of(cls, *matrices: sparse.csr_matrix) -> "Pattern":
        """The union of several patterns."""
        ones = [sparse.csr_matrix((np.ones(m.nnz), m.indices, m.indptr), m.shape) for m in matrices]
        union = sum(ones[1:], ones[0]).tocsr()
        union.sort_indices()
        return cls(union.indptr, union.indices)

    @property
    def size(self) -> int:
        """Number of rows."""
        return len(self.indptr) - 1

    @property
    def _keys(self) -> NDArray[np.int64]:
        rows = np.repeat(np.arange(self.size, dtype=np.int64), np.diff(self.indptr))
        return rows * self.size + self.indices

    def matrix(self, data: Array) -> sparse.csr_matrix:
        """A matrix of this pattern from its entries (nnz,)."""
        result = sparse.csr_matrix((self.size, self.size))
        result.indptr, result.indices, result.data = self.indptr, self.indices, data
        return result

    def spread(self, matrix: sparse.csr_matrix) -> sparse.csr_matrix:
        """The same matrix stored on this pattern."""
        entries = matrix.tocoo()
        keys = entries.row.astype(np.int64) * self.size + entries.col
        data = np.zeros(len(self.indices))
        np.add.at(data, np.searchsorted(self._keys, keys), entries.data)
        return self.matrix(data)

    def outer(self, rows: sparse.csr_matrix, weights: Array) -> sparse.csr_matrix:
        """Linear map (nnz, p) from factors d to the entries of Σ_i d_i w_i r_i r_iᵀ.

        Args:
            rows: r_i (p, n).
            weights: w_i (p,).
        """
        length = np.diff(rows.indptr)
        point = np.repeat(np.arange(rows.shape[0]), length**2)
        within = np.arange(len(point)) - np.repeat(np.cumsum(length**2) - length**2, length**2)
        first = rows.indptr[point] + within // length[point]
        second = rows.indptr[point] + within % length[point]
        keys = rows.indices[first].astype(np.int64) * self.size + rows.indices[second]
        values = rows.data[first] * rows.data[second] * weights[point]
        place = np.searchsorted(self._keys, keys)
        return sparse.csr_matrix((values, (place, point)), (len(self.indices), rows.shape[0]))
