"""Polygons cut into triangles, so fine that colours may run straight between their corners."""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem.arrays import Array
from archfem.models.cells import Cells

Numbers = NDArray[np.intp]

ENOUGH, FINEST = 600, 4
"""Triangles of a picture that are not cut further, and pieces of a side at most."""


class Triangles:
    """Triangles over the cells of a model.

    Attributes:
        cell: of each triangle (t,).
    """

    def __init__(self, cells: Cells) -> None:
        cut = [_cut(cell, cells.places[cell]) for cell in cells.polygons]
        corners = np.concatenate(cut)
        pieces = int(np.clip(round((ENOUGH / len(corners)) ** 0.5), 1, FINEST))
        share, parts = _grid(pieces)
        count = len(share)
        rows = np.repeat(np.arange(count * len(corners)), 3)
        columns = np.repeat(corners, count, axis=0).ravel()
        values = np.tile(share.ravel(), len(corners))
        shape = count * len(corners), len(cells.places)
        self._points = sparse.csr_matrix((values, (rows, columns)), shape)
        self._corners = (count * np.arange(len(corners))[:, None, None] + parts).reshape(-1, 3)
        owner = np.repeat(np.arange(len(cut)), [len(each) for each in cut])
        self.cell: Numbers = np.repeat(owner, len(parts))

    def corners(self, values: Array) -> Array:
        """Return what is known at the points of the cells, at the corners of the triangles.

        Args:
            values: at the points (m, …).

        Returns:
            (t, 3, …).
        """
        found: Array = (self._points @ values)[self._corners]
        return found


def _grid(pieces: int) -> tuple[Array, Numbers]:
    """Points on a triangle of so many pieces a side, as shares of its corners; and its parts."""
    places = [(i, j) for i in range(pieces + 1) for j in range(pieces + 1 - i)]
    number = {place: k for k, place in enumerate(places)}
    share = np.array([(pieces - i - j, i, j) for i, j in places]) / pieces
    up = [[(i, j), (i + 1, j), (i, j + 1)] for i, j in places if i + j < pieces]
    down = [[(i + 1, j), (i + 1, j + 1), (i, j + 1)] for i, j in places if i + j < pieces - 1]
    return share, np.array([[number[place] for place in each] for each in up + down])


def _cut(cell: Numbers, places: Array) -> Numbers:
    """Triangles (n - 2, 3) of a polygon (n,), concave or not, with corners at places (n, 2)."""
    # ears are cut off, the roundest first, so that slivers are few
    left, found = list(range(len(cell))), []
    if _area(places) < 0.0:
        left.reverse()
    while len(left) > 3:
        before, after = np.roll(left, 1), np.roll(left, -1)
        ears = np.stack([before, left, after], axis=1)
        order = np.argsort(-_roundness(places[ears]), kind="stable")
        best = next((k for k in order if _is_empty(places, ears[k], left)), order[0])
        found.append(ears[best])
        del left[best]
    found.append(np.array(left))
    numbers: Numbers = cell[np.array(found)]
    return numbers


def _area(places: Array) -> float:
    """Area within a polygon (n, 2), positive where it runs anticlockwise [m²]."""
    x, y = places.T
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _roundness(corners: Array) -> Array:
    """Area of triangles (t, 3, 2) over their sides squared; negative where they lie outside."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    sides = corners - np.roll(corners, 1, axis=1)
    found: Array = area / np.sum(sides**2, axis=(1, 2)).clip(1e-300)
    return found


def _is_empty(places: Array, ear: Numbers, left: list[int]) -> bool:
    """Return whether an ear turns the right way round and has no other corner within."""
    corners = places[ear]
    if _roundness(corners[None])[0] <= 0.0:
        return False
    others = places[[k for k in left if k not in ear]]
    within = np.ones(len(others), dtype=bool)
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        side, step = end - start, others - start
        within &= side[0] * step[:, 1] - side[1] * step[:, 0] > 0.0
    return not within.any()
