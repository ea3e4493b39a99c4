"""What outlines must not do: cross themselves, overlap, or be the same."""

from collections.abc import Sequence

import numpy as np

from archfem.arrays import Array
from archfem.errors import InvalidStructure

ROUND_OFF = 1e-6
"""Depth of an overlap that is none, relative to the size of all outlines."""


def check_simple(outline: Array, name: str) -> None:
    """Refuse an outline that crosses or touches itself.

    Args:
        outline: vertices of a block, either way round (n, 2) [m].
        name: of the block.

    Raises:
        InvalidStructure: names the block.
    """
    import shapely

    polygon = shapely.Polygon(outline)
    if not polygon.is_valid:
        raise InvalidStructure(
            f"the outline of '{name}' crosses or touches itself "
            f"({shapely.is_valid_reason(polygon)}): correct it there"
        )


def check_apart(
    outlines: Sequence[Array],
    names: Sequence[str],
    slight: float = 0.0,
    fixed: Sequence[bool] | None = None,
) -> None:
    """Refuse outlines that are the same or overlap.

    Args:
        outlines: of blocks, none of which crosses itself, each (n, 2) [m].
        names: of the blocks.
        slight: depth of overlap that a survey's tolerance might remove [m], for the advice.
        fixed: whether each block is fixed; of two such it does not matter whether they overlap.

    Raises:
        InvalidStructure: names the two blocks, and where and by how much they overlap.
    """
    import shapely

    near = ROUND_OFF * float(np.linalg.norm(np.ptp(np.concatenate(outlines), axis=0)))
    polygons = np.array([shapely.Polygon(points) for points in outlines])
    a, b = shapely.STRtree(polygons).query(polygons, predicate="intersects")
    still = np.zeros(len(polygons), dtype=bool) if fixed is None else np.array(fixed, dtype=bool)
    counted = (a < b) & ~(still[a] & still[b])
    a, b = a[counted], b[counted]
    common = shapely.intersection(polygons[a], polygons[b])
    length = shapely.length(common)
    depth = 2.0 * shapely.area(common) / np.where(length > 0.0, length, 1.0)
    if not np.any(depth > near):
        return
    worst = int(np.argmax(depth > near))
    first, second, both = a[worst], b[worst], common[worst]
    if both.area > (1.0 - 1e-6) * max(polygons[first].area, polygons[second].area):
        raise InvalidStructure(
            f"'{names[first]}' and '{names[second]}' are the same: leave one out"
        )
    remedy = ", or raise snap above that" if depth[worst] < slight else ""
    raise InvalidStructure(
        f"'{names[first]}' and '{names[second]}' overlap by {1e4 * both.area:.3g} cm², about "
        f"{1e3 * depth[worst]:.3g} mm deep at ({both.centroid.x:.3f}, {both.centroid.y:.3f}): "
        f"correct their outlines{remedy}"
    )
