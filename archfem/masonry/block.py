"""Blocks: plane bodies with polygonal or annular outlines, their area and centroid."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import sqrt
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from archfem._typing import Array, Metres, Numbers
from archfem._validation import check_fields, check_numbers, check_sequence, check_unmasked
from archfem.errors import Fault, InvalidStructure
from archfem.masonry.materials import Material


def measure_polygon(points: Array) -> tuple[float, Array, float]:
    """Compute area, centroid and polar moment of a polygon by triangles at its first vertex."""
    a, b = points[1:-1] - points[0], points[2:] - points[0]
    twice = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    area = 0.5 * float(np.sum(twice))
    if area <= 0.0:
        return area, points[0], 0.0
    arm = (twice @ (a + b)) / (6.0 * area)
    about_first = float(np.sum(twice * np.sum(a * a + a * b + b * b, axis=1))) / 12.0
    return area, points[0] + arm, about_first - area * float(arm @ arm)


def measure_sector(points: Array, centre: Array) -> tuple[float, Array, float]:
    """Compute area, centroid and polar moment of an annular sector."""
    arm = points - centre
    radii = np.sort(np.linalg.norm(arm[[0, 2]], axis=1))
    bisector = arm.sum(axis=0) / np.linalg.norm(arm.sum(axis=0))
    angle = abs(np.arctan2(arm[0, 0] * arm[1, 1] - arm[0, 1] * arm[1, 0], arm[0] @ arm[1]))
    area = 0.5 * float(radii[1] ** 2 - radii[0] ** 2) * angle
    reach = float(radii[1] ** 3 - radii[0] ** 3) / 3.0 * 2.0 * np.sin(angle / 2.0) / area
    about_centre = 0.25 * float(radii[1] ** 4 - radii[0] ** 4) * angle
    return area, centre + reach * bisector, about_centre - area * reach**2


def measure_path(points: Array) -> Array:
    """Compute the length of a polyline up to each of its points (n,) [m]."""
    return np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))


def rotate(points: Array, angle: float | Array) -> Array:
    """Rotate points about the origin, anticlockwise (…, 2)."""
    c, s = np.cos(angle), np.sin(angle)
    x, y = points[..., 0], points[..., 1]
    along_x = c * x - s * y
    # finite motions call this ten thousands of times, for which `np.stack` is slow
    turned = np.empty((*along_x.shape, 2))
    turned[..., 0], turned[..., 1] = along_x, s * x + c * y
    return turned


def drop_straight_vertices(points: Array, straight: float = 1e-7) -> Array:
    """Return an outline without vertices at which it turns by less than an angle (m, 2) [m]."""
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    lengths = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    return points[np.abs(turn) > straight * lengths]


def triangulate_polygon(points: Array, tolerance: float = 0.0) -> Numbers:
    """Divide a polygon (n, 2), convex or not, into anticlockwise triangles of vertices (t, 3).

    Vertices are left out that are nearer than a tolerance [m] to the outline of the others.
    """
    outline = shapely.Polygon(points).simplify(tolerance)
    triangles = shapely.constrained_delaunay_triangles(outline)
    # a ring of a triangle repeats its first vertex
    rings = shapely.get_coordinates(shapely.orient_polygons(triangles)).reshape(-1, 4, 2)
    # the coordinates are copies: the nearest vertex gives the number
    distance = np.linalg.norm(rings[:, :3, None] - points, axis=-1)
    return distance.argmin(axis=-1)


def intersect_edges(points: Array, x: float, arcs: Sequence[int] = ()) -> list[float]:
    """Return the heights where a vertical line intersects straight edges of an outline."""
    heights, corners = [], points.tolist()  # floats: outlines have a few corners
    edges = zip(corners, corners[1:] + corners[:1], strict=True)
    for number, ((x_start, y_start), (x_end, y_end)) in enumerate(edges):
        step = x_end - x_start
        low, high = sorted((x_start, x_start + step))
        if number not in arcs and low <= x <= high and high > low:
            heights.append(y_start + (x - x_start) / step * (y_end - y_start))
    return heights


def intersect_arc(ends: Array, centre: Array, x: float) -> list[float]:
    """Return the heights where a vertical line intersects an arc below half a circle."""
    (c_x, c_y), ((s_x, s_y), (e_x, e_y)) = centre.tolist(), (ends - centre).tolist()
    square, arm = s_x * s_x + s_y * s_y, x - c_x  # floats, as for edges
    near = 1e-12 * square
    if arm**2 > square + near:
        return []
    turn = s_x * e_y - s_y * e_x
    sense, rise = (turn > 0.0) - (turn < 0.0), sqrt(max(square - arm**2, 0.0))
    heights = []
    for y in (rise, -rise):
        if min(sense * (s_x * y - s_y * arm), sense * (arm * e_y - y * e_x)) >= -near:
            heights.append(c_y + y)
    return heights


def find_side_of_line(points: Array, line: Array, near: float, arcs: Sequence[int] = ()) -> int:
    """Return the side of a line on which an outline lies: 1 left, -1 right, 0 if not along it."""
    # An anticlockwise outline has its interior on the left: an edge in the direction of the line
    # belongs to an outline on its left, an opposite one to an outline on its right.
    starts, ends, length = _find_edges_on_line(points, line, near, arcs)
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)
    shared = np.maximum(np.minimum(high, length) - np.maximum(low, 0.0), 0.0)
    is_edge = high - low > near
    sides = (ends > starts)[is_edge & (low < length - near) & (high > near)]
    covers = abs(shared[is_edge].sum() - length) <= 4.0 * near
    return (1 if sides[0] else -1) if covers and len(sides) else 0


def _find_edges_on_line(
    points: Array, line: Array, near: float, arcs: Sequence[int]
) -> tuple[Array, Array, float]:
    """Return where the straight edges on a line start and end along it, and its length [m]."""
    length = float(np.linalg.norm(line[1] - line[0]))
    along = (line[1] - line[0]) / length
    arm = points - line[0]
    on_line = np.abs(arm @ [-along[1], along[0]]) <= near
    straight = on_line & np.roll(on_line, -1)
    straight[list(arcs)] = False
    places = arm @ along
    return places[straight], np.roll(places, -1)[straight], length


def trace_boundary(cells: Sequence[Numbers] | Sequence[list[int]]) -> list[int]:
    """Return the points around cells of one sense in order; none where the boundary is no loop."""
    ends = Counter(
        (int(a), int(b)) for cell in cells for a, b in zip(cell, np.roll(cell, -1), strict=True)
    )
    # an edge between two cells occurs in both directions, one on the boundary in one
    rim = [(a, b) for a, b in ends if (b, a) not in ends]
    after = dict(rim)
    loop = [rim[0][0]] if rim else []
    while rim and (following := after.get(loop[-1], loop[0])) != loop[0] and len(loop) <= len(rim):
        loop.append(following)
    # an edge in one direction twice is of cells that overlap
    is_loop = len(loop) == len(rim) == len(after) and max(ends.values(), default=1) == 1
    return loop if is_loop else []


# Coordinates x and y [m]
Point = tuple[Metres, Metres]


def as_point(pair: Sequence[float] | Array) -> Point:
    """Return coordinates as a pair of Python's floats, with -0.0 as 0.0."""
    x, y = pair
    return float(x) + 0.0, float(y) + 0.0


def check_points(given: Any, name: str) -> list[tuple[float, ...]]:
    """Return a sequence of pairs of coordinates [m] as floats."""
    points = enumerate(check_sequence(given, name))
    return [check_numbers(point, f"{name}[{k}] [m]", 2) for k, point in points]


@dataclass(frozen=True)
class Block:
    """A plane body bounded by straight edges, or a voussoir cut from a circular ring.

    Attributes:
        outline: vertices in anticlockwise order [m].
        material: material of the block.
        name: name in tables and messages.
        fixed: whether it is an abutment or foundation, which moves by settlement only.
        corners: numbers of the four vertices between which a structured mesh is spanned, or None
            for an unstructured one. Cells *along* lie on the first and third of the four sides so
            made, cells *through the thickness* on the second and fourth.
        part: the part of the structure it belongs to, e.g. "arch" or "north pier".
        centre: where given, the first and third sides of the four-sided outline are arcs about
            this point, and the other two are radial: an annular sector.
        role: role of its part: "ring" or "pier", which are assessed, or "other", which follows its
            support. By default the structure derives it from words of the part's name, with a
            warning where these are ambiguous; a part without a name is a ring.
        grain: whether it is one of many pieces that model a deformable body with joints, as
            `jointed_fill` creates them.
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
        """Check that the outline bounds an area anticlockwise."""
        check_unmasked(self.outline, f"outline of block '{self.name}'")
        check_fields(self)
        if len(self.outline) < 3 or not np.all(np.isfinite(self.outline)):
            raise InvalidStructure(
                f"block '{self.name}' has outline {self.outline}: give at least 3 finite points"
            )
        # equal values are equal blocks, whichever types of numbers and rows they were given as
        object.__setattr__(self, "outline", tuple(map(as_point, self.outline)))
        if self.centre is not None:
            object.__setattr__(self, "centre", as_point(self.centre))
        if self.corners is not None:
            object.__setattr__(self, "corners", tuple(map(int, self.corners)))
        sides = np.roll(self.points, -1, axis=0) - self.points
        if (short := np.flatnonzero(~sides.any(axis=1))).size:
            first, count = int(short[0]), len(self.outline)
            raise InvalidStructure(
                f"block '{self.name}' has two corners beside each other at {self.outline[first]}, "
                f"points {first + 1} and {(first + 1) % count + 1} of its {count}: leave one out"
            )
        if self.area <= 0.0:
            simple = shapely.LinearRing(self.outline).is_simple
            remedy = "anticlockwise" if simple else "without edges that cross"
            raise InvalidStructure(
                f"block '{self.name}' has area {self.area:.3g} m²: give its outline {remedy}"
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
        return np.array(self.centre) + np.cos(angles) * start + np.sin(angles) * across

    def drawn(self, pieces: int = 16) -> Array:
        """Return the outline with each arc replaced by chords (n, 2) [m].

        Args:
            pieces: chords of each arc; a polygon has none.
        """
        if self.centre is None:
            return self.points
        if pieces not in self._outlines:
            self._outlines[pieces] = np.concatenate([self.arc(0, pieces), self.arc(2, pieces)])
        return self._outlines[pieces]

    @cached_property
    def _outlines(self) -> dict[int, Array]:
        """Cached outlines by number of chords of an arc."""
        return {}

    def top(self, x: float) -> float | None:
        """Return the largest y at which a vertical meets the outline, arcs as arcs [m].

        Args:
            x: place of the vertical [m].

        Returns:
            The height, or None where the vertical misses the block.
        """
        met = intersect_edges(self.points, x, self._arcs)
        for side in self._arcs:
            met += intersect_arc(self.points[side : side + 2], np.array(self.centre), x)
        return max(met, default=None)

    def distance_to(self, other: "Block | Point") -> float:
        """Return the distance to another block or a point, zero where they touch [m].

        Args:
            other: the block, or the point (x, y) [m].
        """
        own = shapely.Polygon(self.drawn())
        if isinstance(other, Block):
            return float(shapely.distance(own, shapely.Polygon(other.drawn())))
        return float(shapely.distance(own, shapely.Point(other)))

    def side_of(self, line: Array, near: float) -> int:
        """Return on which side of a line the block lies, if its straight edges cover the line.

        Args:
            line: its start and end (2, 2) [m].
            near: distance of points that count as one [m].

        Returns:
            1 for left, -1 for right, 0 where its edges do not cover the line.
        """
        return find_side_of_line(self.points, line, near, self._arcs)

    def face_span(self, line: Array, near: float) -> tuple[float, float]:
        """Return where the straight face along a line begins and ends, from the line's start [m].

        Consecutive edges on the line are one face.

        Args:
            line: start and end of a part of the face (2, 2) [m].
            near: distance of points that count as one [m].
        """
        starts, stops, depth = _find_edges_on_line(self.points, line, near, self._arcs)
        edges = np.sort([starts, stops], axis=0).T.tolist()
        low, high = 0.0, depth
        # an outline does not touch itself: edges on the line that meet are consecutive
        for start, end in sorted(edges):
            if start <= high + near and end > near:
                high = max(high, end)
        for start, end in sorted(edges, key=lambda edge: -edge[1]):
            if end >= low - near and start < depth - near:
                low = min(low, start)
        return low, high

    @property
    def _arcs(self) -> tuple[int, ...]:
        """Numbers of the sides that are arcs."""
        return () if self.centre is None else (0, 2)

    @cached_property
    def _measures(self) -> tuple[float, Array, float]:
        """Area, centroid, polar second moment of area about the centroid."""
        if self.centre is None:
            return measure_polygon(self.points)
        return measure_sector(self.points, np.array(self.centre))

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


def say_place(point: Point) -> str:
    """Return a place [m] in words."""
    return f"({point[0]:.3f}, {point[1]:.3f})"


def check_simple(outline: Array, name: str, place: Callable[[Point], str] = say_place) -> None:
    """Refuse an outline that crosses or touches itself."""
    polygon = shapely.Polygon(outline)
    if not polygon.is_valid:
        x, y = shapely.is_valid_reason(polygon).rstrip("]").partition("[")[2].split()
        where = place((float(x), float(y)))
        raise InvalidStructure(
            f"the outline of '{name}' crosses or touches itself at {where}: correct it there"
        )


def check_overlaps(
    outlines: Sequence[Array],
    names: Sequence[str],
    deep: float = 0.0,
    body: Numbers | None = None,
    place: Callable[[Point], str] = say_place,
) -> None:
    """Refuse outlines that cross themselves, are the same or overlap; those of a body may do."""
    for outline, name in zip(outlines, names, strict=True):
        check_simple(outline, name, place)
    # overlaps of less depth, relative to the size of all outlines, are round-off
    near = max(deep, 1e-6 * float(np.linalg.norm(np.ptp(np.concatenate(outlines), axis=0))))
    pairs, common, area, depth = find_overlaps(outlines, body)
    if not np.any(depth > near):
        return
    deepest = [k for k in np.argsort(-depth).tolist() if depth[k] > near]
    middles = [(common[k].centroid.x, common[k].centroid.y) for k in deepest]
    both, (one, other) = common[deepest[0]], (names[k] for k in pairs[deepest[0]])
    where, sizes = place(middles[0]), np.array([measure_polygon(each)[0] for each in outlines])
    areas = sizes[pairs[deepest]].T
    same = area[deepest] > (1.0 - 1e-6) * areas.max(axis=0)
    found = [
        ("overlap", names[pairs[k][0]], names[pairs[k][1]], middle)
        for k, middle in zip(deepest, middles, strict=True)
    ]
    others = say_others("the deepest", found, place)
    if same[0]:
        rest = "" if same.all() else "; correct the outlines of those that only overlap"
        words = f"'{one}' and '{other}' at {where} are the same{others}: leave one out{rest}"
        raise InvalidStructure(words, found)
    is_twice = same.any() or both.area > 0.5 * areas[:, 0].min()
    raise InvalidStructure(
        f"'{one}' and '{other}' overlap by {1e4 * both.area:.3g} cm², about "
        f"{1e3 * depth[deepest[0]]:.3g} mm deep at {where}{others}: correct their outlines"
        f"{', or leave out the one drawn twice' if is_twice else ''}",
        found,
    )


def say_others(rank: str, found: Sequence[Fault], place: Callable[[Point], str]) -> str:
    """Say how many faults of a drawing there are beside the first of them, and where."""
    others = [f"'{a}' and '{b}' at {place(middle)}" for _, a, b, middle in found[1:]]
    more = f" and {len(others) - 8} more" * (len(others) > 8)
    listed = ";\n    ".join(others[:8])
    return f", {rank} of {len(found)} {found[0][0]}s (also {listed}{more})" if others else ""


def find_neighbours(outlines: Sequence[Array], near: float) -> tuple[Numbers, Numbers]:
    """Return the numbers of outlines within a distance of each other, each pair twice (2, n)."""
    polygons = np.array([shapely.Polygon(points) for points in outlines])
    one, other = shapely.STRtree(polygons).query(polygons, predicate="dwithin", distance=near)
    return one, other


def find_overlaps(
    outlines: Sequence[Array], body: Numbers | None
) -> tuple[Numbers, NDArray[np.object_], Array, Array]:
    """Return pairs (n, 2) of different bodies that meet, overlaps, areas, mean depths [m², m]."""
    polygons = np.array([shapely.Polygon(points) for points in outlines])
    pairs = shapely.STRtree(polygons).query(polygons, predicate="intersects").T
    numbers = np.arange(len(polygons)) if body is None else body
    a, b = pairs.T
    pairs = pairs[(a < b) & (numbers[a] != numbers[b])]
    common = shapely.intersection(*polygons[pairs].T)
    # the mean depth follows from area and length
    length, area = shapely.length(common), shapely.area(common)
    return pairs, common, area, 2.0 * area / np.where(length > 0.0, length, 1.0)
