"""Outlines as people draw them: closed polygons in GeoJSON and DXF files.

The drawing is an elevation: x to the right, y upwards.
"""

import json
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.files import check_file, text_of
from archfem.masonry.naming import did_you_mean
from archfem.masonry.survey.tagged import part_of, physical_surfaces
from archfem.units import in_unit

LARGEST = 2**25
"""Most bytes of a drawing."""

SIZES = (0.02, 20.0)
"""Between what the diagonal of half of all blocks lies [m]; otherwise the unit is wrong."""

PROPERTIES = ("name", "part", "role", "material", "fixed")
"""What is read of a GeoJSON feature; others are left alone."""

CURVES = ("LINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE", "INSERT")
"""What stones are drawn with in DXF but cannot be read from."""


@dataclass(frozen=True, eq=False)
class Outline:
    """A closed polygon of a drawing and what the drawing says of it.

    Attributes:
        points: vertices, either way round, the first not repeated (n, 2) [m].
        name: of the block.
        layer: that it is drawn on; in GeoJSON its part.
        material: name of its material, or None.
        fixed: or None.
        role: of its part, or None.
    """

    points: Array
    name: str
    layer: str
    material: str | None = None
    fixed: bool | None = None
    role: str | None = None


def outlines_in(
    path: str | Path, unit: str | None = None, ignored: Collection[str] = ()
) -> list[Outline]:
    """Return the closed polygons of a drawing.

    Args:
        path: a .geojson or .json file, a FeatureCollection of Polygons with the properties of
            `PROPERTIES`; or a .dxf file, closed LWPOLYLINEs and POLYLINEs, each named by the TEXT
            or MTEXT whose insertion point lies in it, or else by its layer and a number; or a .msh
            file of gmsh, each physical surface a block on the layer that `part_of` tells.
        unit: of the coordinates. By default what a DXF file says ($INSUNITS), metres in GeoJSON.
        ignored: layers of a DXF file that are not read.

    Raises:
        InvalidInput: it is no such file, or holds what cannot be a block.
    """
    path = Path(path)
    readers = {".geojson": _geojson, ".json": _geojson, ".dxf": _dxf, ".msh": _msh}
    if path.suffix.lower() not in readers:
        raise InvalidInput(f"{path} is no drawing: give a .geojson, a .dxf or a .msh file")
    check_file(path, "drawing", LARGEST)
    try:
        outlines = list(readers[path.suffix.lower()](path, unit, ignored))
        _check_sizes(outlines)
    except InvalidInput as error:
        raise InvalidInput(f"{path}: {error}") from error
    return outlines


def _geojson(path: Path, unit: str | None, ignored: Collection[str]) -> Iterator[Outline]:
    """Polygons of a GeoJSON file."""
    try:
        found = json.loads(text_of(path, "drawing", LARGEST))
    except (ValueError, RecursionError) as error:
        raise InvalidInput(f"it is not JSON: {error}") from error
    if not isinstance(found, dict) or not isinstance(found.get("features"), list):
        raise InvalidInput("it is no GeoJSON FeatureCollection: export the outlines as one")
    factor = in_unit(f"1 {unit or 'm'}", "m", "unit")
    for number, feature in enumerate(found["features"], 1):
        try:
            outline = _feature(feature, f"outline {number}", factor)
        except (AttributeError, TypeError) as error:
            raise InvalidInput(f"feature {number} is not as GeoJSON has it: {error}") from error
        if outline.layer not in ignored:
            yield outline


def _msh(path: Path, unit: str | None, ignored: Collection[str]) -> Iterator[Outline]:
    """Physical surfaces of a mesh of gmsh."""
    factor = in_unit(f"1 {unit or 'm'}", "m", "unit")
    for name, points in physical_surfaces(path, factor):
        if part_of(name) not in ignored:
            yield Outline(points, name, part_of(name))


def _feature(feature: dict[str, Any], name: str, factor: float) -> Outline:
    """The polygon of one feature, named so where it has no name."""
    told = feature.get("properties") or {}
    name = str(told.get("name") or name)
    _check_properties(told, name)
    geometry = feature.get("geometry") or {}
    rings = geometry.get("coordinates")
    if geometry.get("type") != "Polygon" or not rings:
        raise InvalidInput(f"'{name}' is a {geometry.get('type')}: give each block as one Polygon")
    if len(rings) > 1:
        raise InvalidInput(f"'{name}' has a hole: cut it into blocks without holes")
    points = _plane(rings[0], f"'{name}'", factor)
    part = str(told.get("part") or "")
    return Outline(points, name, part, told.get("material"), told.get("fixed"), told.get("role"))


def _check_properties(told: dict[str, Any], name: str) -> None:
    """Refuse properties that are misspelt or of the wrong kind."""
    for key in set(told) - set(PROPERTIES):
        if hint := did_you_mean(key.lower(), PROPERTIES, 0.8):
            raise InvalidInput(f"'{name}' has a property '{key}': {hint}")
    if told.get("fixed") not in (None, True, False):
        raise InvalidInput(f"'{name}': fixed = {told['fixed']!r} is not true or false")


def _dxf(path: Path, unit: str | None, ignored: Collection[str]) -> Iterator[Outline]:
    """Closed polylines of a DXF file."""
    from ezdxf.filemanagement import readfile  # slow to import
    from ezdxf.lldxf.const import DXFError

    try:
        drawing = readfile(path)
    except (OSError, UnicodeDecodeError, DXFError) as error:
        raise InvalidInput(f"it is not DXF: {error}") from error
    read = [entity for entity in drawing.modelspace() if entity.dxf.layer not in ignored]
    polylines = [entity for entity in read if entity.dxftype() in ("LWPOLYLINE", "POLYLINE")]
    layers = {entity.dxf.layer for entity in polylines}
    for entity in read:
        if entity.dxftype() in CURVES and entity.dxf.layer in layers:
            raise InvalidInput(
                f"layer '{entity.dxf.layer}' has a {entity.dxftype()} beside its polylines: make "
                "a closed polyline of each stone, and leave out layers of other things"
            )
    factor = _dxf_metres(drawing, unit)
    outlines = [_polyline(entity, factor) for entity in polylines]
    texts = [text for entity in read if (text := _text(entity, factor))]
    counts: dict[str, int] = {}
    for outline in outlines:
        counts[outline.layer] = counts.get(outline.layer, 0) + 1
        yield replace(outline, name=_name(outline, texts, counts[outline.layer]))


def _dxf_metres(drawing: Any, unit: str | None) -> float:
    """Metres in a unit of a DXF drawing."""
    from ezdxf import units
    from ezdxf.enums import InsertUnits

    if unit is not None:
        return in_unit(f"1 {unit}", "m", "unit")
    if not drawing.units:
        raise InvalidInput('the drawing does not say its unit ($INSUNITS): give one, e.g. "mm"')
    return float(units.conversion_factor(drawing.units, InsertUnits.Meters))


def _polyline(entity: Any, factor: float) -> Outline:
    """A closed polyline, by its layer."""
    light = entity.dxftype() == "LWPOLYLINE"
    given = [tuple(p) for p in (entity.vertices_in_wcs() if light else entity.points_in_wcs())]
    layer = entity.dxf.layer
    where = f"a polyline at ({given[0][0]:.6g}, {given[0][1]:.6g}) on layer '{layer}'"
    if not (light or entity.is_2d_polyline or entity.is_3d_polyline):
        raise InvalidInput(f"{where} is a mesh: draw the block as a closed polyline")
    if entity.has_arc:
        raise InvalidInput(f"{where} has arcs, and joints are straight: draw chords instead")
    if not entity.is_closed and given[0] != given[-1]:
        raise InvalidInput(f"{where} is not closed: close it, or leave its layer out")
    return Outline(_plane(given, where, factor), where, layer)


def _text(entity: Any, factor: float) -> tuple[str, Array] | None:
    """What a text says, and where it stands [m]."""
    if entity.dxftype() == "MTEXT":
        place = entity.dxf.insert
    elif entity.dxftype() == "TEXT":
        place = entity.get_placement()[1]
    else:
        return None
    words = " ".join(entity.plain_text().split())
    return words, factor * np.array([place.x, place.y])


def _name(outline: Outline, texts: list[tuple[str, Array]], number: int) -> str:
    """The text in an outline, or its layer and number."""
    import shapely

    polygon = shapely.Polygon(outline.points)
    inside = [words for words, (x, y) in texts if shapely.contains_xy(polygon, x, y)]
    if len(inside) > 1:
        raise InvalidInput(
            f"{outline.name} has the texts {inside} in it: leave the one that is its name, and "
            "put notes on a layer that is not read"
        )
    return inside[0] if inside else f"{outline.layer} {number}"


def _plane(given: Any, name: str, factor: float) -> Array:
    """Vertices of a polygon (n, 2) [m]."""
    try:
        points = factor * np.array(given, dtype=float)
    except (TypeError, ValueError) as error:
        raise InvalidInput(f"{name} has coordinates that are no list of points") from error
    if points.ndim != 2 or points.shape[1] < 2 or not np.all(np.isfinite(points)):
        raise InvalidInput(f"{name} has coordinates that are no finite points in the plane")
    if np.any(np.ptp(points[:, 2:], axis=0) > 1e-6 * np.ptp(points[:, :2])):
        raise InvalidInput(f"{name} does not lie in the plane of x and y: draw an elevation in it")
    points = points[:, :2]
    points = points[:-1] if np.array_equal(points[0], points[-1]) else points
    if len(points) < 3:
        raise InvalidInput(f"{name} has {len(points)} vertices: a block has at least 3")
    return points


def _check_sizes(outlines: list[Outline]) -> None:
    """Refuse a drawing without outlines, or in another unit than is said."""
    if not outlines:
        raise InvalidInput("it has no closed outlines to read")
    typical = float(np.median([np.hypot(*np.ptp(each.points, axis=0)) for each in outlines]))
    if SIZES[0] <= typical <= SIZES[1]:
        return
    away = np.abs(np.concatenate([each.points for each in outlines])).max(axis=0)
    remedy = 'give the unit of the drawing, e.g. unit = "mm"'
    if typical < SIZES[0] and away[0] <= 180.0 and away[1] <= 90.0:
        remedy += "; coordinates in degrees (CRS84) do not do: export projected metres"
    raise InvalidInput(f"a block is typically {typical:.3g} m large: {remedy}")
