"""Drawings that are no structure: their outlines, and the places where these do not fit."""

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from archfem._typing import Array
from archfem.errors import Fault, InvalidInput, InvalidStructure
from archfem.masonry.block import check_simple
from archfem.masonry.survey.drawings import Outline, read_drawing, read_polylines
from archfem.masonry.survey.outlines import AMBIGUOUS_GAP_RATIO, close_gaps

# Kind of overlaps that are no error
CLOSED_BY_SNAP = "overlap that snap closes"


def sketch_drawing(
    path: str | Path, unit: str | None, ignored: Iterable[str], snap: float
) -> tuple[list[Outline], list[Outline]]:
    """Read the curves of a drawing in error: closed outlines, and open lines."""
    path, layers, strays = Path(path), Counter(dict.fromkeys(ignored, 0)), list[str]()
    try:
        closed = read_drawing(path, unit, layers, snap, strays)
        return closed, read_polylines(path, unit, layers, snap)[1] if strays else []
    except InvalidInput:
        if path.suffix.lower() != ".dxf":
            raise
    return read_polylines(path, unit, layers, snap)


def find_faults(closed: Sequence[Outline], snap: float, error: str) -> dict[str, list[Array]]:
    """Return places where outlines do not fit by kind, in coordinates of the drawing.

    Overlaps are those that an error names, and apart from them those that snap closes. Gaps are
    narrow ones that it leaves open. Stones that the error names otherwise are not joined.
    """
    import shapely

    if not closed:
        return {}
    factor, names = closed[0].frame.factor, [each.name for each in closed]
    near, named = snap / factor, list[Fault]()
    try:
        for each in closed:
            check_simple(each.points, each.name)
        close_gaps(list(closed), snap)
    except InvalidStructure as wrong:
        named = list(wrong.faults)
    polygons = shapely.make_valid(np.array([shapely.Polygon(each.drawn) for each in closed]))
    one, other = shapely.STRtree(polygons).query(polygons, predicate="intersects")
    common = shapely.intersection(polygons[one], polygons[other])
    pairs = [(names[a], names[b]) for a, b in zip(one, other, strict=True)]
    refused = {fault[1:3] for fault in named if fault[0] == "overlap"}
    is_refused = np.array([pair in refused for pair in pairs])
    whole, reach = shapely.union_all(polygons), 0.5 * AMBIGUOUS_GAP_RATIO * near
    # what is narrower than the reach to both sides closes where the outline grows and shrinks
    grown = shapely.buffer(whole, reach, join_style="mitre", mitre_limit=10.0)
    filled = shapely.buffer(grown, -reach, join_style="mitre", mitre_limit=10.0)
    # as deep as half of snap in the mean, or wider than snap at one place
    found = {
        "overlap": _trace(common[is_refused], 0.0, 0.0),
        "gap": _trace(shapely.difference(filled, whole), 0.0, near),
        "short contact": [np.array([x[3]]) / factor for x in named if x[0] == "short contact"],
        CLOSED_BY_SNAP: _trace(common[~is_refused & (one < other)], 0.5 * near, 0.0),
    }
    if not (named or found["gap"]):
        stones = [
            polygon for polygon, name in zip(polygons, names, strict=True) if f"'{name}'" in error
        ]
        found["face not joined"] = [
            x for stone in stones for x in _find_unjoined(stone, polygons, near)
        ]
    return found


def _trace(shapes: Any, mean: float, widest: float) -> list[Array]:
    """Return the outlines of what is deeper in the mean, and wider at one place, than lengths."""
    import shapely

    parts = shapely.get_parts(shapely.get_parts(shapes))
    parts = parts[shapely.area(parts) > 0.0]
    deep = 2.0 * shapely.area(parts) / shapely.length(parts) > mean
    deep &= ~shapely.is_empty(shapely.buffer(parts, -0.5 * widest))
    return [shapely.get_coordinates(part.exterior)[:-1] for part in parts[deep]]


def _find_unjoined(stone: Any, polygons: Any, near: float) -> list[Array]:
    """Return the faces nearest to a stone among those that snap does not join to it."""
    import shapely

    away = shapely.distance(stone, polygons)
    least = away[away > near].min(initial=np.inf)
    if least > 0.1 * stone.length:
        return [shapely.get_coordinates(stone)]
    beside = polygons[(away > near) & (away < 2.0 * least)]
    return _trace(shapely.intersection(shapely.buffer(stone, 2.0 * least), beside), 0.0, 0.0)
