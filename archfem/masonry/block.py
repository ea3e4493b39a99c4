"""`Block`: a plane body of stone or soil, its outline, area and centroid."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from archfem.annotated import check_fields
from archfem.arguments import unmasked
from archfem.arrays import Array
from archfem.errors import InvalidStructure
from archfem.masonry.geometry import (
    area_of_polygon,
    area_of_sector,
    heights_of_arc,
    heights_of_edges,
    side_of_line,
)
from archfem.masonry.materials import Material

Point = tuple[float, float]
"""A place in the plane: x and y [m]."""


@dataclass(frozen=True)
class Block:
    """A plane body bounded by straight edges, or a voussoir cut from a circular ring.

    Attributes:
        outline: vertices in anticlockwise order [m].
        material: what it is made of.
        name: how a person finds it.
        fixed: an abutment or foundation, which does not move of itself.
        corners: numbers of the four vertices between which a structured mesh is spanned, or None
            for an unstructured one. Cells *along* lie on the first and third of the four sides so
            made, cells *through the thickness* on the second and fourth.
        part: the part of the structure it belongs to, e.g. "arch" or "north pier".
        centre: where given, the first and third sides of the four-sided outline are arcs about
            this point, and the other two are radial: an annular sector.
        role: of its part: "ring" or "pier", which are judged, or "other", which follows what
            carries it. Where nothing of a part tells it, the structure fills it in by the words of
            the part's name, and warns where they leave it open; without a name a part is a ring.
        grain: whether it is one of many pieces that stand for a body which deforms and gives way
            between them, as `jointed_fill` makes them.
    """

    outline: tuple[Point, ...]
    material: Material
    name: str
    fixed: bool = False
    corners: tuple[int, int, int, int] | None = None
    part: str = ""
    centre: Point | None = None
    role: str = ""
    grain: bool = False

    def __post_init__(self) -> None:
        """Refuse outlines that do not bound an area anticlockwise."""
        unmasked(self.outline, f"outline of block '{self.name}'")
        check_fields(self)
        if len(self.outline) < 3 or not np.all(np.isfinite(self.outline)):
            raise InvalidStructure(
                f"block '{self.name}' has outline {self.outline}: give at least 3 finite points"
            )
        if self.area <= 0.0:
            raise InvalidStructure(
                f"block '{self.name}' has area {self.area:.3g} m²: give its outline anticlockwise"
            )

    @cached_property
    def points(self) -> Array:
        """Vertices (n, 2) [m]."""
        return np.array(self.outline, dtype=float)

    def arc(self, side: int, pieces: int) -> Array:
        """Return points on an arc of a sector, at equal angles (pieces + 1, 2) [m].

        Args:
            side: 0 or 2, of its four sides.
            pieces: chords between the points.
        """
        arm = self.points - np.array(self.centre)
        start, end = arm[side], arm[side + 1]
        turn = np.arctan2(start[0] * end[1] - start[1] * end[0], start @ end)
        angles = turn * np.linspace(0.0, 1.0, pieces + 1)[:, None]
        across = np.array([-start[1], start[0]])
        points: Array = np.array(self.centre) + np.cos(angles) * start + np.sin(angles) * across
        return points

    def drawn(self, pieces: int = 16) -> Array:
        """Return the outline with each arc replaced by chords (n, 2) [m].

        Args:
            pieces: chords of each arc; a polygon has none.
        """
        if self.centre is None:
            return self.points
        if pieces not in self._drawn:
            self._drawn[pieces] = np.concatenate([self.arc(0, pieces), self.arc(2, pieces)])
        return self._drawn[pieces]

    @cached_property
    def _drawn(self) -> dict[int, Array]:
        """Outlines of so many chords an arc, as far as they were asked for."""
        return {}

    def top(self, x: float) -> float | None:
        """Return the largest y at which a vertical meets the outline, arcs as arcs [m].

        Args:
            x: of the vertical [m].

        Returns:
            The height, or None where the vertical misses the block.
        """
        arcs = () if self.centre is None else (0, 2)
        met = heights_of_edges(self.points, x, arcs)
        for side in arcs:
            met += heights_of_arc(self.points[side : side + 2], np.array(self.centre), x)
        return max(met, default=None)

    def side_of(self, line: Array, near: float) -> int:
        """Return on which side of a line it lies that it touches with straight edges.

        Args:
            line: its start and end (2, 2) [m].
            near: distance of points that count as one [m].

        Returns:
            1 for left, -1 for right, 0 where its edges do not cover the line.
        """
        return side_of_line(self.points, line, near, arcs=() if self.centre is None else (0, 2))

    @cached_property
    def _measures(self) -> tuple[float, Array, float]:
        """Area, centroid, polar second moment of area about the centroid."""
        if self.centre is None:
            return area_of_polygon(self.points)
        return area_of_sector(self.points, np.array(self.centre))

    @property
    def area(self) -> float:
        """Area [m²]."""
        return self._measures[0]

    @property
    def centroid(self) -> Array:
        """Centre of gravity (2,) [m]."""
        return self._measures[1]

    @property
    def polar_moment(self) -> float:
        """Polar second moment of area about the centroid [m⁴]."""
        return self._measures[2]
