"""What outlines must not do: cross themselves, overlap, or be the same."""

from collections.abc import Sequence

import numpy as np

from archfem.arrays import Array
from archfem.errors import InvalidStructure
from archfem.masonry.structure import TOUCHING


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


def check_apart(outlines: Sequence[Array], names: Sequence[str], slight: float = 0.0) -> None:
    """Refuse outlines that are the same or overlap.

    Args:
        outlines: of blocks, none of which crosses itself, each (n, 2) [m].
        names: of the blocks.
        slight: depth of overlap that a survey's tolerance might remove [m], for the advice.

    Raises:
        InvalidStructure: names the two blocks, and where and by how much they overlap.
    """
    import shapely

    near = TOUCHING * float(np.linalg.norm(np.ptp(np.concatenate(outlines), axis=0)))
    polygons = [shapely.Polygon(points) for points in outlines]
    pairs = shapely.STRtree(polygons).query(polygons, predicate="intersects").T
    for a, b in pairs[pairs[:, 0] < pairs[:, 1]].tolist():
        common = shapely.intersection(polygons[a], polygons[b])
        depth = 2.0 * common.area / common.length if common.length else 0.0
        if depth <= near:
            continue
        if common.area > (1.0 - 1e-6) * max(polygons[a].area, polygons[b].area):
            raise InvalidStructure(f"'{names[a]}' and '{names[b]}' are the same: leave one out")
        x, y = common.centroid.x, common.centroid.y
        remedy = ", or raise snap above that" if depth < slight else ""
        raise InvalidStructure(
            f"'{names[a]}' and '{names[b]}' overlap by {1e4 * common.area:.3g} cm², about "
            f"{1e3 * depth:.3g} mm deep at ({x:.3f}, {y:.3f}): correct their outlines{remedy}"
        )
