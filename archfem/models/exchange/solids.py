"""All blocks of a model as polygons, and its joints as gaps between faces: what files are made of.

No two blocks share a point, so that joints open and slide in a file as they do in the model.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.masonry.rigid_motion import motion_of
from archfem.models.model import Model


@dataclass(frozen=True, eq=False)
class Solids:
    """Blocks and joints of a model, and where they are.

    Attributes:
        model: whose they are.
    """

    model: Model

    @cached_property
    def _fixed(self) -> list[tuple[int, Array]]:
        """Numbers and outlines of the fixed blocks."""
        blocks = enumerate(self.model.structure.blocks)
        return [(number, block.drawn()) for number, block in blocks if block.fixed]

    @cached_property
    def places(self) -> Array:
        """Points as built: those of the cells, then those of fixed blocks (m, 2) [m]."""
        return np.concatenate([self.model.cells.places, *(points for _, points in self._fixed)])

    @cached_property
    def block(self) -> NDArray[np.intp]:
        """Block of each point (m,)."""
        more = [np.full(len(points), number) for number, points in self._fixed]
        found: NDArray[np.intp] = np.concatenate([self.model.cells.block, *more]).astype(np.intp)
        return found

    @cached_property
    def polygons(self) -> list[NDArray[np.intp]]:
        """Numbers of the corners of each polygon: the cells, then one for each fixed block."""
        found = [np.asarray(cell, dtype=np.intp) for cell in self.model.cells.polygons]
        start = len(self.model.cells.places)
        for _, points in self._fixed:
            found.append(np.arange(start, start + len(points)))
            start += len(points)
        return found

    @cached_property
    def owner(self) -> NDArray[np.intp]:
        """Block of each polygon (p,)."""
        found: NDArray[np.intp] = self.block[[polygon[0] for polygon in self.polygons]]
        return found

    def displacement(self, q: Array) -> Array:
        """Return the displacement of every point (m, 2) [m].

        Args:
            q: coordinates (n,).

        Raises:
            InvalidInput: they are another model's.
        """
        if len(q) != self.model.size:
            raise InvalidInput(
                f"there are {len(q)} coordinates, and the model has {self.model.size}: give the "
                "model, of the same cells and degree, that they were computed with"
            )
        centroids = [block.centroid for block in self.model.structure.blocks]
        still = [
            motion_of(points, centroids[number]) @ self.model.supports[number]
            for number, points in self._fixed
        ]
        return np.concatenate([self.model.cells.displacement(q), *still])

    def stress(self, q: Array) -> Array | None:
        """Return σ_xx, σ_yy and σ_xy of every polygon (p, 3) [Pa]; None where blocks are rigid.

        Args:
            q: coordinates (n,). In fixed blocks there is none: not a number.
        """
        if self.model.cells.stress is None:
            return None
        found = np.full((len(self.polygons), 3), np.nan)
        found[: len(self.model.cells.polygons)] = (self.model.cells.stress @ q).reshape(-1, 3)
        return found

    @cached_property
    def corners(self) -> Array:
        """Faces of each joint as built: on the lower block, and back on the other (j, 4, 2)."""
        joints = self.model.structure.joints
        return np.array([[*joint.ends, *joint.ends[::-1]] for joint in joints])

    @cached_property
    def _anchors(self) -> tuple[NDArray[np.intp], Array]:
        """The edge that each corner lies on, by its ends (4 j, 2), and how far along (4 j,)."""
        edges = np.concatenate([np.column_stack([c, np.roll(c, -1)]) for c in self.polygons])
        owner = self.block[edges[:, 0]]
        joints = self.model.structure.joints
        carriers = [number for each in joints for number in (each.lower, each.higher)]
        found, shares = [], []
        for number, point in zip(np.repeat(carriers, 2), self.corners.reshape(-1, 2), strict=True):
            own = edges[owner == number]
            start, step = self.places[own[:, 0]], np.diff(self.places[own], axis=1)[:, 0]
            share = np.sum((point - start) * step, axis=1) / np.sum(step * step, axis=1)
            share = np.clip(share, 0.0, 1.0)
            nearest = int(np.argmin(np.linalg.norm(start + share[:, None] * step - point, axis=1)))
            found.append(own[nearest])
            shares.append(share[nearest])
        return np.array(found), np.array(shares)

    def gaps(self, q: Array) -> Array:
        """Return the displacement of both faces of each joint, as `corners` (n_joints, 4, 2) [m].

        Args:
            q: coordinates (n,).
        """
        return self.between(self.displacement(q))

    def between(self, moved: Array) -> Array:
        """Return the displacement of both faces of each joint (n_joints, 4, 2) [m].

        Args:
            moved: displacement of every point (m, 2) [m].
        """
        edges, share = self._anchors
        first, second = moved[edges[:, 0]], moved[edges[:, 1]]
        found: Array = (first + share[:, None] * (second - first)).reshape(-1, 4, 2)
        return found
