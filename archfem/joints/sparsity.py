"""One sparsity pattern for a family of matrices, so that sums are sums of their data."""

from copy import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem.arrays import Array


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
        """Return the union of the patterns of some matrices.

        Args:
            matrices: square and of one size, each (n, n).
        """
        ones = [sparse.csr_matrix((np.ones(m.nnz), m.indices, m.indptr), m.shape) for m in matrices]
        union = sum(ones[1:], ones[0]).tocsr()
        union.sort_indices()
        return cls(union.indptr, union.indices)

    @property
    def size(self) -> int:
        """Number of rows."""
        return len(self.indptr) - 1

    def places(self, rows: NDArray[np.int32], columns: NDArray[np.int32]) -> NDArray[np.intp]:
        """Return the positions of entries in the data of this pattern (k,).

        Args:
            rows: of the entries (k,).
            columns: of the entries (k,).
        """
        own = np.repeat(np.arange(self.size, dtype=np.int64), np.diff(self.indptr))
        keys = own * self.size + self.indices
        wanted = rows.astype(np.int64) * self.size + columns
        places = np.searchsorted(keys, wanted)
        assert np.array_equal(keys[places], wanted), "an entry lies outside the pattern"
        return places

    def matrix(self, data: Array) -> sparse.csr_matrix:
        """Return a matrix of this pattern.

        Args:
            data: its entries, which it shares (nnz,).
        """
        result = copy(self._bare)
        result.data = data
        return result

    @cached_property
    def _bare(self) -> sparse.csr_matrix:
        """A matrix without data; a copy of it is had without the checks of a new one."""
        bare = sparse.csr_matrix((self.size, self.size))
        bare.indptr, bare.indices = self.indptr, self.indices
        return bare

    def spread(self, matrix: sparse.csr_matrix) -> sparse.csr_matrix:
        """Return the same matrix stored on this pattern.

        Args:
            matrix: whose entries all lie in the pattern (n, n).
        """
        entries = matrix.tocoo()
        data = np.zeros(len(self.indices))
        np.add.at(data, self.places(entries.row, entries.col), entries.data)
        return self.matrix(data)

    def outer(self, left: sparse.csr_matrix, right: sparse.csr_matrix) -> sparse.csr_matrix:
        """Return the linear map (nnz, m) from factors d to the entries of Σ_k d_k l_k r_kᵀ.

        Args:
            left: l_k (m, n).
            right: r_k (m, n).
        """
        across, down = np.diff(right.indptr), np.diff(left.indptr)
        size = down * across
        which = np.repeat(np.arange(left.shape[0]), size)
        within = np.arange(len(which)) - np.repeat(np.cumsum(size) - size, size)
        first = left.indptr[which] + within // across[which]
        second = right.indptr[which] + within % across[which]
        places = self.places(left.indices[first], right.indices[second])
        values = left.data[first] * right.data[second]
        return sparse.csr_matrix((values, (places, which)), (len(self.indices), left.shape[0]))
