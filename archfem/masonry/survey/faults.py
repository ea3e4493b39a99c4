"""Drawings that are no structure: their outlines, and the places where these do not fit."""

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from archfem._typing import Array
from archfem.errors import InvalidInput
from archfem.masonry.survey.drawings import Outline, read_drawing, read_polylines
from archfem.masonry.survey.outlines import AMBIGUOUS_GAP_RATIO


def sketch_drawing(
    path: str | Path, unit: str | None, ignored: Iterable[str], snap: float
) -> tuple[list[Outline], list[Outline]]:
    """Read the curves of a drawing in error: closed outlines, and open lines."""
    path, layers = Path(path), Counter(dict.fromkeys(ignored, 0))
    try:
        return read_drawing(path, unit, layers, snap), []
    except InvalidInput:
        if path.suffix.lower() != ".dxf":
            raise
    return read_polylines(path, unit, layers, snap)


def find_faults(closed: Sequence[Outline], snap: float) -> tuple[list[Array], list[Array]]:
    """Return overlaps, and narrow gaps that snap leaves open, in coordinates of the drawing."""
    import shapely

    if not closed:
        return [], []
    near = snap / closed[0].frame.factor
    polygons = shapely.make_valid(np.array([shapely.Polygon(each.drawn) for each in closed]))
    one, other = shapely.STRtree(polygons).query(polygons, predicate="intersects")
    common = shapely.intersection(polygons[one[one < other]], polygons[other[one < other]])
    whole, reach = shapely.union_all(polygons), 0.5 * AMBIGUOUS_GAP_RATIO * near
    # what is narrower than the reach to both sides closes where the outline grows and shrinks
    grown = shapely.buffer(whole, reach, join_style="mitre", mitre_limit=10.0)
    filled = shapely.buffer(grown, -reach, join_style="mitre", mitre_limit=10.0)
    faults = []
    # as deep as half of snap in the mean, or wider than snap at one place
    for shapes, mean, widest in ((common, 0.5, 0.0), (shapely.difference(filled, whole), 0.0, 1.0)):
        parts = shapely.get_parts(shapely.get_parts(shapes))
        parts = parts[shapely.area(parts) > 0.0]
        deep = 2.0 * shapely.area(parts) / shapely.length(parts) > mean * near
        deep &= ~shapely.is_empty(shapely.buffer(parts, -0.5 * widest * near))
        faults.append([shapely.get_coordinates(part.exterior)[:-1] for part in parts[deep]])
    return faults[0], faults[1]
