"""One sparsity pattern for a family of matrices, so that adding matrices is adding their data."""

from copy import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem._typing import Array


@dataclass(frozen=True, eq=False)
class Pattern:
    """Positions at which matrices of a family may have entries."""

    indptr: NDArray[np.int32]  # starts of the rows (n + 1,)
    indices: NDArray[np.int32]  # columns, ascending in each row (nnz,)

    @classmethod
    def of(cls, *matrices: sparse.csr_matrix) -> "Pattern":
        """Return the union of the patterns of some matrices."""
        ones = [sparse.csr_matrix((np.ones(m.nnz), m.indices, m.indptr), m.shape) for m in matrices]
        union = sum(ones[1:], ones[0]).tocsr()
        union.sort_indices()
        return cls(union.indptr, union.indices)

    @property
    def size(self) -> int:
        """Number of rows."""
        return len(self.indptr) - 1

    def find_entries(self, rows: NDArray[np.int32], columns: NDArray[np.int32]) -> NDArray[np.intp]:
        """Return the positions of entries in the data of this pattern (k,)."""
        # one sorted key for each entry: row times size plus column
        row = np.repeat(np.arange(self.size, dtype=np.int64), np.diff(self.indptr))
        keys = row * self.size + self.indices
        sought = rows.astype(np.int64) * self.size + columns
        entries = np.searchsorted(keys, sought)
        assert np.array_equal(keys[entries], sought), "an entry lies outside the pattern"
        return entries

    def with_data(self, data: Array) -> sparse.csr_matrix:
        """Return a matrix with this pattern."""
        result = copy(self._bare)
        result.data = data
        return result

    @cached_property
    def _bare(self) -> sparse.csr_matrix:
        """A matrix without data: copying it skips the checks that a new one needs."""
        bare = sparse.csr_matrix((self.size, self.size))
        bare.indptr, bare.indices = self.indptr, self.indices
        return bare

    def spread(self, matrix: sparse.csr_matrix) -> sparse.csr_matrix:
        """Return a matrix stored on this pattern."""
        entries = matrix.tocoo()
        data = np.zeros(len(self.indices))
        np.add.at(data, self.find_entries(entries.row, entries.col), entries.data)
        return self.with_data(data)

    def outer_product_map(
        self, left: sparse.csr_matrix, right: sparse.csr_matrix
    ) -> sparse.csr_matrix:
        """Return the linear map (nnz, m) from factors d to the entries of Σ_k d_k l_k r_kᵀ."""
        # every pair of entries of row k of both matrices, one after the other
        count, right_count = np.diff(left.indptr), np.diff(right.indptr)
        size = count * right_count
        row = np.repeat(np.arange(left.shape[0]), size)
        within = np.arange(len(row)) - np.repeat(np.cumsum(size) - size, size)
        first = left.indptr[row] + within // right_count[row]
        second = right.indptr[row] + within % right_count[row]
        entries = self.find_entries(left.indices[first], right.indices[second])
        values = left.data[first] * right.data[second]
        return sparse.csr_matrix((values, (entries, row)), (len(self.indices), left.shape[0]))
