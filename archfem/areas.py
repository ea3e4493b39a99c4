"""Areas of plane figures, with their centroids and polar second moments."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def polygon_measures(points: Array) -> tuple[float, Array, float]:
    """Measure a polygon by the triangles to its first vertex.

    Args:
        points: vertices in anticlockwise order (n, 2) [m].

    Returns:
        Area [m²], negative clockwise; centroid (2,) [m]; polar second moment about it [m⁴].
    """
    a, b = points[1:-1] - points[0], points[2:] - points[0]
    twice = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    area = 0.5 * float(np.sum(twice))
    if area <= 0.0:
        return area, points[0], 0.0
    arm = (twice @ (a + b)) / (6.0 * area)
    about_first = float(np.sum(twice * np.sum(a * a + a * b + b * b, axis=1))) / 12.0
    return area, points[0] + arm, about_first - area * float(arm @ arm)


def sector_measures(points: Array, centre: Array) -> tuple[float, Array, float]:
    """Measure an annular sector.

    Args:
        points: its four corners; the first and third side are arcs (4, 2) [m].
        centre: of the arcs (2,) [m].

    Returns:
        Area [m²], centroid (2,) [m], polar second moment about it [m⁴].
    """
    arm = points - centre
    radii = np.sort(np.linalg.norm(arm[[0, 2]], axis=1))
    bisector = arm.sum(axis=0) / np.linalg.norm(arm.sum(axis=0))
    angle = abs(np.arctan2(arm[0, 0] * arm[1, 1] - arm[0, 1] * arm[1, 0], arm[0] @ arm[1]))
    area = 0.5 * float(radii[1] ** 2 - radii[0] ** 2) * angle
    reach = float(radii[1] ** 3 - radii[0] ** 3) / 3.0 * 2.0 * np.sin(angle / 2.0) / area
    about_centre = 0.25 * float(radii[1] ** 4 - radii[0] ** 4) * angle
    return area, centre + reach * bisector, about_centre - area * reach**2
