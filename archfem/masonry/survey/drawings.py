"""Outlines as people draw them: closed polygons in GeoJSON and DXF files.

The drawing is an elevation: x to the right, y upwards.

Drawings as DXF: closed polylines and lines on layers, in metres.

A user's own mesh of gmsh (.msh) as outlines: what lies in one physical surface is one block.

The file is read by meshio: nothing in it is executed.
"""

import json
import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from archfem._files import atomic_write, check_file, read_text
from archfem._typing import Array
from archfem.errors import InvalidInput
from archfem.masonry.structure import suggest_name
from archfem.units import in_unit

# Sine of the turn below which a vertex lies on a straight edge
STRAIGHT = 1e-9

# Cells that make blocks, and how many of their points are corners
CORNERS = {"triangle": 3, "triangle6": 3, "quad": 4, "quad8": 4, "quad9": 4}

# Cells that make physical curves
CURVES_TAGGED = {"line", "line3"}


def physical_surfaces(path: Path, factor: float = 1.0) -> list[tuple[str, Array]]:
    """Return the name and the outline of each physical surface, in the order of their tags."""
    mesh = _mesh(path)
    names = _names(mesh, 2)
    points = _plane_tagged(mesh.points) * factor
    found: dict[int, list[NDArray[np.intp]]] = {}
    for cells, tags in _tagged(mesh, set(CORNERS)):
        for cell, tag in zip(cells.data[:, : CORNERS[cells.type]], tags, strict=True):
            found.setdefault(int(tag), []).append(cell)
    if not found:
        raise InvalidInput("it has no physical surface: tag each block with one, in gmsh")
    return [
        (names.get(tag, f"block {tag}"), points[_outline(cells, points, names.get(tag, str(tag)))])
        for tag, cells in sorted(found.items())
    ]


def physical_curves(path: Path, factor: float = 1.0) -> list[tuple[str, Array]]:
    """Return name and edge mid-points (n, 2) [m] of each named physical curve."""
    mesh = _mesh(path)
    names, points = _names(mesh, 1), mesh.points[:, :2] * factor
    found: dict[str, list[Array]] = {}
    for cells, tags in _tagged(mesh, CURVES_TAGGED):
        for edge, tag in zip(cells.data[:, :2], tags, strict=True):
            if int(tag) in names:
                found.setdefault(names[int(tag)], []).append(points[edge].mean(axis=0))
    return [(name, np.array(middles)) for name, middles in found.items()]


def part_of(name: str) -> str:
    """Return the part that a block belongs to by its name: up to a comma, or without its number."""
    head, comma, _ = name.partition(",")
    return head.strip() if comma else re.sub(r"\s*\d+$", "", name)


def _mesh(path: Path) -> Any:
    """A mesh file as meshio has it."""
    try:
        import meshio
    except ImportError as error:
        raise InvalidInput(
            "meshes are read with meshio, which is not installed: pip install 'archfem[exchange]'"
        ) from error
    try:
        return meshio.gmsh.read(path)
    except (Exception, SystemExit) as error:  # meshio and its formats raise all sorts
        raise InvalidInput(f"it is no mesh of gmsh that meshio reads: {error}") from error


def _names(mesh: Any, dimension: int) -> dict[int, str]:
    """Names of the physical groups of one dimension by their tags."""
    return {
        int(tag): name for name, (tag, size) in mesh.field_data.items() if int(size) == dimension
    }


def _tagged(mesh: Any, kinds: set[str]) -> list[tuple[Any, Any]]:
    """Cells of some kinds and the tag of the physical group of each."""
    tags = mesh.cell_data.get("gmsh:physical", [])
    pairs = zip(mesh.cells, tags, strict=True) if tags else ()
    return [(cells, own) for cells, own in pairs if cells.type in kinds]


def _plane_tagged(points: Array) -> Array:
    """Points in the plane of x and y (n, 2)."""
    if points.shape[1] > 2 and np.ptp(points[:, 2]) > 1e-6 * np.ptp(points[:, :2]):
        raise InvalidInput("it does not lie in the plane of x and y: mesh an elevation in it")
    return points[:, :2]


def _outline(cells: list[NDArray[np.intp]], points: Array, name: str) -> list[int]:
    """Points around cells, one after another; without those on straight edges."""
    ends: Counter[tuple[int, int]] = Counter()
    for cell in cells:
        x, y = points[cell].T
        around = cell if float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) > 0.0 else cell[::-1]
        ends.update((int(a), int(b)) for a, b in zip(around, np.roll(around, -1), strict=True))
    rim = [(a, b) for a, b in ends if (b, a) not in ends]
    after = dict(rim)
    loop = [rim[0][0]]
    while (following := after[loop[-1]]) != loop[0] and len(loop) <= len(rim):
        loop.append(following)
    if len(loop) != len(rim) or len(after) != len(rim):
        raise InvalidInput(
            f"physical surface '{name}' is in pieces or has a hole: tag each block by itself"
        )
    places = points[loop]
    before, ahead = places - np.roll(places, 1, axis=0), np.roll(places, -1, axis=0) - places
    turn = before[:, 0] * ahead[:, 1] - before[:, 1] * ahead[:, 0]
    lengths = np.linalg.norm(before, axis=1) * np.linalg.norm(ahead, axis=1)
    return [
        point for point, bends in zip(loop, np.abs(turn) > STRAIGHT * lengths, strict=True) if bends
    ]


# Most bytes of a drawing
LARGEST = 2**25

# Between what the diagonal of half of all blocks lies [m]; otherwise the unit is wrong
SIZES = (0.02, 20.0)

# What is read of a GeoJSON feature; others are left alone
PROPERTIES = ("name", "part", "role", "material", "fixed")

# What stones are drawn with in DXF but cannot be read from
CURVES = ("LINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE", "INSERT")


@dataclass(frozen=True, eq=False)
class Outline:
    """A closed polygon of a drawing and what the drawing says of it."""

    points: Array  # vertices, either way round, the first not repeated (n, 2) [m]
    name: str  # of the block
    layer: str  # that it is drawn on; in GeoJSON its part
    material: str | None = None  # name of its material, or None
    fixed: bool | None = None  # or None
    role: str | None = None  # of its part, or None


def outlines_in(
    path: str | Path, unit: str | None = None, ignored: Collection[str] = ()
) -> list[Outline]:
    """Return the closed polygons of a drawing."""
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
        found = json.loads(read_text(path, "drawing", LARGEST))
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
        if hint := suggest_name(key.lower(), PROPERTIES, 0.8):
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


# Height of names [m]
TEXT = 0.05


def write_dxf(
    path: str | Path,
    outlines: Mapping[str, Sequence[tuple[str, Array]]],
    lines: Mapping[str, Sequence[tuple[str, Array]]] | None = None,
) -> Path:
    """Write a drawing that `read_outlines` reads, and any program for drawings."""
    import ezdxf
    import shapely

    drawing = ezdxf.new("R2010", units=ezdxf.units.M)  # type: ignore[attr-defined]
    space = drawing.modelspace()
    for layer, polygons in outlines.items():
        for name, points in polygons:
            given = [(float(x), float(y)) for x, y in points]
            space.add_lwpolyline(given, close=True, dxfattribs={"layer": layer})
            inside = shapely.Polygon(given).representative_point()
            note = {"layer": f"{layer} names", "height": TEXT, "insert": (inside.x, inside.y)}
            space.add_text(name, dxfattribs=note)
    for layer, runs in (lines or {}).items():
        for _, points in runs:
            given = [(float(x), float(y)) for x, y in points]
            space.add_lwpolyline(given, dxfattribs={"layer": layer})
    with atomic_write(Path(path)) as draft:
        drawing.saveas(draft)
    return Path(path)
