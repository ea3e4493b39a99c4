"""Drawings that are no structure: their outlines, and the places where these do not fit."""

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import shapely

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

    Overlaps and gaps are those that close_gaps names, and apart from them overlaps that snap
    closes. Where all fits, stones that the error names are not joined.
    """
    if not closed:
        return {}
    factor, names = closed[0].frame.factor, [each.name for each in closed]
    near, named, fits = snap / factor, list[Fault](), True
    try:
        for each in closed:
            check_simple(each.points, each.name)
        close_gaps(list(closed), snap)
    except InvalidStructure as wrong:
        named, fits = list(wrong.faults), False
    polygons = shapely.make_valid(np.array([shapely.Polygon(each.drawn) for each in closed]))
    one, other = shapely.STRtree(polygons).query(polygons, predicate="intersects")
    common = shapely.intersection(polygons[one], polygons[other])
    pairs = [(names[a], names[b]) for a, b in zip(one, other, strict=True)]
    refused = {fault[1:3] for fault in named if fault[0] == "overlap"}
    is_refused = np.array([pair in refused for pair in pairs])
    places = {
        kind: [(fault[1:3], np.array([fault[3]]) / factor) for fault in named if fault[0] == kind]
        for kind in ("gap", "short contact")
    }
    whole, stones = shapely.union_all(polygons), dict(zip(names, polygons, strict=True))
    # overlaps that snap closes are as deep as half of snap in the mean
    found = {
        "overlap": _trace(common[is_refused], 0.0),
        "gap": [
            _trace_gap([stones[name] for name in pair], whole, place, AMBIGUOUS_GAP_RATIO * near)
            for pair, place in places["gap"]
        ],
        "short contact": [place for _, place in places["short contact"]],
        CLOSED_BY_SNAP: _trace(common[~is_refused & (one < other)], 0.5 * near),
    }
    if fits:
        found["face not joined"] = [
            x
            for name, stone in stones.items()
            if f"'{name}'" in error
            for x in _find_unjoined(stone, polygons, near)
        ]
    return found


def _trace_gap(pair: Sequence[Any], whole: Any, place: Array, widest: float) -> Array:
    """Return the outline of the gap at a place between two stones, or the place (n, 2)."""
    # what is narrower than the reach to both sides closes where the outline grows and shrinks
    grown = shapely.buffer(
        shapely.union_all(pair), 0.5 * widest, join_style="mitre", mitre_limit=10.0
    )
    filled = shapely.buffer(grown, -0.5 * widest, join_style="mitre", mitre_limit=10.0)
    open_parts = shapely.get_parts(shapely.difference(filled, whole))
    if not len(open_parts):
        return place
    nearest = shapely.distance(open_parts, shapely.Point(place[0])).argmin()
    return shapely.get_coordinates(open_parts[nearest].exterior)[:-1]


def _trace(shapes: Any, mean: float) -> list[Array]:
    """Return the outlines of what is deeper in the mean than a length."""
    parts = shapely.get_parts(shapely.get_parts(shapes))
    parts = parts[shapely.area(parts) > 0.0]
    deep = 2.0 * shapely.area(parts) / shapely.length(parts) > mean
    return [shapely.get_coordinates(part.exterior)[:-1] for part in parts[deep]]


def _find_unjoined(stone: Any, polygons: Any, near: float) -> list[Array]:
    """Return the faces nearest to a stone among those that snap does not join to it."""
    away = shapely.distance(stone, polygons)
    least = away[away > near].min(initial=np.inf)
    if least > 0.1 * stone.length:
        return [shapely.get_coordinates(stone)]
    beside = polygons[(away > near) & (away < 2.0 * least)]
    return _trace(shapely.intersection(shapely.buffer(stone, 2.0 * least), beside), 0.0)
