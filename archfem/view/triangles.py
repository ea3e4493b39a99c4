"""Triangulation of the cells of a model, so fine that colours may vary linearly in a triangle."""

import numpy as np
from matplotlib.tri import Triangulation, UniformTriRefiner
from numpy.typing import NDArray
from scipy import sparse

from archfem._typing import Array
from archfem.masonry.block import triangulate_polygon
from archfem.models.model import Cells


class Triangles:
    """Triangulation of the cells of a model; `cell` is the cell of each triangle (t,)."""

    def __init__(self, cells: Cells) -> None:
        cut = [np.asarray(c)[triangulate_polygon(cells.places[c])] for c in cells.polygons]
        corners = np.concatenate(cut)
        # each refinement divides a triangle into four; in about 600 triangles the linear variation
        # of colours cannot be seen
        refinements = int(np.clip(np.round(0.5 * np.log2(600 / len(corners))), 0, 2))
        unit = Triangulation([0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
        fine = UniformTriRefiner(unit).refine_triangulation(subdiv=refinements)
        shares = np.column_stack([1.0 - fine.x - fine.y, fine.x, fine.y])  # of the three corners
        count = len(shares)
        rows = np.repeat(np.arange(count * len(corners)), 3)
        columns = np.repeat(corners, count, axis=0).ravel()
        values = np.tile(shares.ravel(), len(corners))
        shape = count * len(corners), len(cells.places)
        self._interpolation = sparse.csr_matrix((values, (rows, columns)), shape)
        first = count * np.arange(len(corners))
        self._corners = (first[:, None, None] + fine.triangles).reshape(-1, 3)
        owner = np.repeat(np.arange(len(cut)), [len(triangles) for triangles in cut])
        self.cell: NDArray[np.intp] = np.repeat(owner, len(fine.triangles))

    def corners(self, values: Array) -> Array:
        """Interpolate values at the points of the cells to the corners (t, 3, …)."""
        return (self._interpolation @ values)[self._corners]
