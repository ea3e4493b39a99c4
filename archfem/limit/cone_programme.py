"""Second-order cone programmes: their rows, entry by entry, and their solution by Clarabel.

References: Goulart and Chen, Clarabel: an interior-point solver for conic programs (2024).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy import sparse

from archfem._optional import require_package
from archfem._typing import Array, Numbers
from archfem.errors import logger


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of a matrix, entry by entry."""

    row: list[Any] = field(default_factory=list)
    column: list[Any] = field(default_factory=list)
    value: list[Array] = field(default_factory=list)
    right: list[Array] = field(default_factory=list)

    @property
    def count(self) -> int:
        """Number of rows."""
        return sum(map(len, self.right))

    def put(self, rows: Numbers, columns: Numbers, values: Array) -> None:
        """Add entries to rows (n,)."""
        self.row.append(rows)
        self.column.append(columns)
        self.value.append(values)

    def add(self, columns: Numbers, values: Array | float, right: Array | float = 0.0) -> None:
        """Append rows, each with the same number of entries (n, k)."""
        number = np.repeat(self.count + np.arange(len(columns)), columns.shape[1])
        self.put(number, columns.ravel(), np.broadcast_to(values, columns.shape).ravel())
        self.right.append(np.broadcast_to(np.asarray(right, dtype=float), len(columns)))

    def matrix(self, size: int, count: int = 0) -> sparse.csr_matrix:
        """Return the matrix of the rows, and of empty ones up to a count."""
        entries = np.concatenate(self.value or [np.empty(0)])
        places = [np.concatenate(each or [np.empty(0, int)]) for each in (self.row, self.column)]
        shape = max(self.count, count), size
        return sparse.csr_matrix((entries, tuple(places)), shape=shape)

    def cones(self, size: int) -> tuple[sparse.csr_matrix, Array]:
        """Return matrix and right sides of cones, of whose rows all first ones were added first."""
        order = np.arange(self.count).reshape(3, -1).T.ravel()
        return self.matrix(size)[order], self.bounds[order]

    @property
    def bounds(self) -> Array:
        """Right sides (n,)."""
        return np.concatenate(self.right or [np.empty(0)])


def solve_cones(
    cost: Array, matrix: sparse.csc_matrix, right: Array, cones: Sequence[tuple[str, int]]
) -> tuple[str, Array, Array] | None:
    """Minimise a cost over x with right - A x in a product of cones; None without convergence.

    Args:
        cost: costs of the unknowns (n,).
        matrix: A (m, n).
        right: right sides (m,).
        cones: kind and size of each cone: "zero", "positive" or "second order".

    Returns:
        "solved", "infeasible" or "unbounded", the unknowns (n,), and the multipliers (m,).
    """
    with require_package("Clarabel"):
        import clarabel  # type: ignore[import-untyped]
    kinds = {
        "zero": clarabel.ZeroConeT,
        "positive": clarabel.NonnegativeConeT,
        "second order": clarabel.SecondOrderConeT,
    }
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.max_iter = False, 200
    listed = [kinds[kind](size) for kind, size in cones]
    nothing = sparse.csc_matrix((len(cost), len(cost)))
    # cones have no scale: unknowns of order one, and a last column of order one for the factor
    columns = np.ones(len(cost))
    # a load that does not reach the structure has an empty one
    columns[-1] = 1.0 / (abs(matrix[:, [-1]]).max() or 1.0)
    unit = np.abs(right).max()
    scaled = (matrix @ sparse.diags(columns)).tocsc()
    solver = clarabel.DefaultSolver(nothing, cost, scaled, right / unit, listed, settings)
    solution = solver.solve()
    words = {
        "Solved": "solved",
        "AlmostSolved": "solved",
        "PrimalInfeasible": "infeasible",
        "DualInfeasible": "unbounded",
    }
    status = words.get(str(solution.status))
    if status is None:
        logger.info("Clarabel ended with %s", solution.status)
        return None
    return status, unit * columns * np.array(solution.x), np.array(solution.z)
