"""Outlines in the plane: area, centroid and polar moment, and on which side of a line they lie."""

from collections.abc import Sequence
from itertools import pairwise
from math import hypot

import numpy as np

from archfem.arrays import Array


def area_of_polygon(points: Array) -> tuple[float, Array, float]:
    """Area, centroid and polar moment of a polygon, from the triangles to its first vertex.

    Args:
        points: its vertices, anticlockwise (n, 2) [m].

    Returns:
        Area [m²], centroid (2,) [m], and polar second moment of area about it [m⁴]; where the area
        is not positive, the first vertex and zero.
    """
    a, b = points[1:-1] - points[0], points[2:] - points[0]
    twice = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    area = 0.5 * float(np.sum(twice))
    if area <= 0.0:
        return area, points[0], 0.0
    arm = (twice @ (a + b)) / (6.0 * area)
    about_first = float(np.sum(twice * np.sum(a * a + a * b + b * b, axis=1))) / 12.0
    return area, points[0] + arm, about_first - area * float(arm @ arm)


def area_of_sector(points: Array, centre: Array) -> tuple[float, Array, float]:
    """Area, centroid and polar moment of an annular sector.

    Args:
        points: its four vertices, the first and third sides arcs (4, 2) [m].
        centre: of the arcs (2,) [m].

    Returns:
        Area [m²], centroid (2,) [m], and polar second moment of area about it [m⁴].
    """
    arm = points - centre
    radii = np.sort(np.linalg.norm(arm[[0, 2]], axis=1))
    bisector = arm.sum(axis=0) / np.linalg.norm(arm.sum(axis=0))
    angle = abs(np.arctan2(arm[0, 0] * arm[1, 1] - arm[0, 1] * arm[1, 0], arm[0] @ arm[1]))
    area = 0.5 * float(radii[1] ** 2 - radii[0] ** 2) * angle
    reach = float(radii[1] ** 3 - radii[0] ** 3) / 3.0 * 2.0 * np.sin(angle / 2.0) / area
    about_centre = 0.25 * float(radii[1] ** 4 - radii[0] ** 4) * angle
    return area, centre + reach * bisector, about_centre - area * reach**2


def heights_of_edges(points: Array, x: float, arcs: Sequence[int] = ()) -> list[float]:
    """Heights at which a vertical line meets the straight edges of an outline.

    Args:
        points: vertices in order (n, 2) [m].
        x: of the line [m].
        arcs: numbers of the sides that are not straight.

    Returns:
        The heights; upright edges are left to their neighbours [m].
    """
    start, step = points, np.roll(points, -1, axis=0) - points
    low, high = np.sort(np.stack([start[:, 0], start[:, 0] + step[:, 0]]), axis=0)
    met = (low <= x) & (x <= high) & (high > low)
    met[list(arcs)] = False
    share = (x - start[met, 0]) / step[met, 0]
    heights: list[float] = (start[met, 1] + share * step[met, 1]).tolist()
    return heights


def heights_of_arc(ends: Array, centre: Array, x: float) -> list[float]:
    """Heights at which a vertical line meets an arc of less than half a circle.

    Args:
        ends: of the arc (2, 2) [m].
        centre: of its circle (2,) [m].
        x: of the line [m].

    Returns:
        The heights, ends included [m].
    """
    start, end = ends - centre
    square = float(start @ start)
    sense = np.sign(start[0] * end[1] - start[1] * end[0])
    rise = np.sqrt(max(square - (x - centre[0]) ** 2, 0.0))
    near = 1e-12 * square
    heights = []
    for y in (rise, -rise):
        after = sense * (start[0] * y - start[1] * (x - centre[0]))
        before = sense * ((x - centre[0]) * end[1] - y * end[0])
        if min(after, before) >= -near and (x - centre[0]) ** 2 <= square + near:
            heights.append(float(centre[1] + y))
    return heights


def side_of_line(points: Array, line: Array, near: float, arcs: Sequence[int] = ()) -> int:
    """On which side of a line an outline lies that covers it with straight edges.

    An anticlockwise outline has its inside to the left, so an edge that runs with the line belongs
    to an outline on its left, one against it to an outline on its right.

    Args:
        points: vertices, anticlockwise (n, 2) [m].
        line: its start and end (2, 2) [m].
        near: distance of points that count as one [m].
        arcs: numbers of the sides that are not straight.

    Returns:
        1 for left, -1 for right, 0 where the edges do not cover the line.
    """
    (x, y), (x_end, y_end) = line.tolist()  # a few numbers: faster without arrays
    length = hypot(x_end - x, y_end - y)
    t_x, t_y = (x_end - x) / length, (y_end - y) / length
    moved = [(p_x - x, p_y - y) for p_x, p_y in points.tolist()]
    along = [d_x * t_x + d_y * t_y for d_x, d_y in moved]
    near_line = [abs(d_y * t_x - d_x * t_y) <= near for d_x, d_y in moved]
    covered, side = 0.0, 0
    for edge, (start, end) in enumerate(pairwise([*along, along[0]])):
        low, high = min(start, end), max(start, end)
        straight = edge not in arcs and near_line[edge] and near_line[edge + 1 - len(along)]
        if not straight or high - low <= near:
            continue
        covered += max(min(high, length) - max(low, 0.0), 0.0)
        if side == 0 and low < length - near and high > near:
            side = 1 if end > start else -1
    return side if abs(covered - length) <= 4.0 * near else 0
