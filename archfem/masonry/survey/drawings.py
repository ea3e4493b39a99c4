"""Drawings with one closed outline for each block: GeoJSON, DXF and tagged gmsh files.

A drawing is an elevation: x to the right, y upwards. meshio reads gmsh files; nothing in them is
executed.
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

# Largest size of a drawing [bytes]
MAX_DRAWING_BYTES = 2**25

# Range of the median diagonal of the blocks [m]; beyond it the unit is wrong
BLOCK_SIZE_RANGE = (0.02, 20.0)

# Properties of a GeoJSON feature that are read; others are ignored
FEATURE_PROPERTIES = ("name", "part", "role", "material", "fixed")

# Cells of a mesh that belong to blocks, and the number of their corners
CORNERS_PER_CELL = {"triangle": 3, "triangle6": 3, "quad": 4, "quad8": 4, "quad9": 4}


@dataclass(frozen=True, eq=False)
class Outline:
    """A closed polygon of a drawing with its properties."""

    points: Array  # vertices in either direction, the first not repeated (n, 2) [m]
    name: str  # name of the block
    layer: str  # layer of the outline; in GeoJSON its part
    material: str | None = None  # name of the material
    fixed: bool | None = None  # whether the block is fixed
    role: str | None = None  # role of the part


def read_drawing(
    path: str | Path, unit: str | None = None, ignored: Collection[str] = ()
) -> list[Outline]:
    """Read the closed polygons of a drawing, without those on ignored layers."""
    path = Path(path)
    readers = {".geojson": _read_geojson, ".json": _read_geojson}
    readers |= {".dxf": _read_dxf, ".msh": _read_msh}
    if path.suffix.lower() not in readers:
        raise InvalidInput(f"{path} is no drawing: give a .geojson, a .dxf or a .msh file")
    check_file(path, "drawing", MAX_DRAWING_BYTES)
    try:
        outlines = list(readers[path.suffix.lower()](path, unit, ignored))
        _check_sizes(outlines)
    except InvalidInput as error:
        raise InvalidInput(f"{path}: {error}") from error
    return outlines


def _check_sizes(outlines: list[Outline]) -> None:
    """Refuse a drawing without outlines, or one whose unit is evidently wrong."""
    if not outlines:
        raise InvalidInput("it has no closed outlines to read")
    # the median is insensitive to a few long blocks, such as a fill
    typical = float(np.median([np.hypot(*np.ptp(each.points, axis=0)) for each in outlines]))
    if BLOCK_SIZE_RANGE[0] <= typical <= BLOCK_SIZE_RANGE[1]:
        return
    away = np.abs(np.concatenate([each.points for each in outlines])).max(axis=0)
    remedy = 'give the unit of the drawing, e.g. unit = "mm"'
    # longitudes and latitudes make blocks far smaller than a unit
    if typical < BLOCK_SIZE_RANGE[0] and away[0] <= 180.0 and away[1] <= 90.0:
        remedy += "; coordinates in degrees (CRS84) do not do: export projected metres"
    raise InvalidInput(f"a block is typically {typical:.3g} m large: {remedy}")


def _read_geojson(path: Path, unit: str | None, ignored: Collection[str]) -> Iterator[Outline]:
    """Read the polygons of a GeoJSON file."""
    try:
        found = json.loads(read_text(path, "drawing", MAX_DRAWING_BYTES))
    except (ValueError, RecursionError) as error:
        raise InvalidInput(f"it is not JSON: {error}") from error
    if not isinstance(found, dict) or not isinstance(found.get("features"), list):
        raise InvalidInput("it is no GeoJSON FeatureCollection: export the outlines as one")
    factor = in_unit(f"1 {unit or 'm'}", "m", "unit")
    for number, feature in enumerate(found["features"], 1):
        try:
            outline = _read_feature(feature, f"outline {number}", factor)
        except (AttributeError, TypeError) as error:
            raise InvalidInput(f"feature {number} is not as GeoJSON has it: {error}") from error
        if outline.layer not in ignored:
            yield outline


def _read_feature(feature: dict[str, Any], name: str, factor: float) -> Outline:
    """Read the polygon of a feature; the given name is used if it has none."""
    data = feature.get("properties") or {}
    name = str(data.get("name") or name)
    _check_properties(data, name)
    geometry = feature.get("geometry") or {}
    rings = geometry.get("coordinates")
    if geometry.get("type") != "Polygon" or not rings:
        raise InvalidInput(f"'{name}' is a {geometry.get('type')}: give each block as one Polygon")
    if len(rings) > 1:
        raise InvalidInput(f"'{name}' has a hole: cut it into blocks without holes")
    points = _check_polygon(rings[0], f"'{name}'", factor)
    own = (data.get(key) for key in ("material", "fixed", "role"))
    return Outline(points, name, str(data.get("part") or ""), *own)


def _check_properties(data: dict[str, Any], name: str) -> None:
    """Refuse misspelt properties and values of the wrong kind."""
    for key in set(data) - set(FEATURE_PROPERTIES):
        if hint := suggest_name(key.lower(), FEATURE_PROPERTIES, 0.8):
            raise InvalidInput(f"'{name}' has a property '{key}': {hint}")
    if data.get("fixed") not in (None, True, False):
        raise InvalidInput(f"'{name}': fixed = {data['fixed']!r} is not true or false")


def _read_dxf(path: Path, unit: str | None, ignored: Collection[str]) -> Iterator[Outline]:
    """Read the closed polylines of a DXF file, named by the texts inside them."""
    from ezdxf.filemanagement import readfile  # slow to import
    from ezdxf.lldxf.const import DXFError

    try:
        drawing = readfile(path)
    except (OSError, UnicodeDecodeError, DXFError) as error:
        raise InvalidInput(f"it is not DXF: {error}") from error
    read = [entity for entity in drawing.modelspace() if entity.dxf.layer not in ignored]
    polylines = [entity for entity in read if entity.dxftype() in ("LWPOLYLINE", "POLYLINE")]
    layers = {entity.dxf.layer for entity in polylines}
    # entities with which stones are drawn, but which are not closed outlines
    curves = ("LINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE", "INSERT")
    for entity in read:
        if entity.dxftype() in curves and entity.dxf.layer in layers:
            raise InvalidInput(
                f"layer '{entity.dxf.layer}' has a {entity.dxftype()} beside its polylines: make "
                "a closed polyline of each stone, and leave out layers of other things"
            )
    factor = _dxf_unit(drawing, unit)
    outlines = [_read_polyline(entity, factor) for entity in polylines]
    texts = [text for entity in read if (text := _read_text(entity, factor))]
    counts: Counter[str] = Counter()
    for outline in outlines:
        counts[outline.layer] += 1
        yield replace(outline, name=_block_name(outline, texts, counts[outline.layer]))


def _dxf_unit(drawing: Any, unit: str | None) -> float:
    """Return the unit of a DXF drawing [m]."""
    from ezdxf import units
    from ezdxf.enums import InsertUnits

    if unit is not None:
        return in_unit(f"1 {unit}", "m", "unit")
    if not drawing.units:
        raise InvalidInput('the drawing does not say its unit ($INSUNITS): give one, e.g. "mm"')
    return float(units.conversion_factor(drawing.units, InsertUnits.Meters))


def _read_polyline(entity: Any, factor: float) -> Outline:
    """Read a closed polyline."""
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
    return Outline(_check_polygon(given, where, factor), where, layer)


def _read_text(entity: Any, factor: float) -> tuple[str, Array] | None:
    """Read a text and its position (2,) [m]; None for other entities."""
    if entity.dxftype() == "MTEXT":
        place = entity.dxf.insert
    elif entity.dxftype() == "TEXT":
        place = entity.get_placement()[1]
    else:
        return None
    words = " ".join(entity.plain_text().split())
    return words, factor * np.array([place.x, place.y])


def _block_name(outline: Outline, texts: list[tuple[str, Array]], number: int) -> str:
    """Return the text inside an outline, else its layer and number."""
    import shapely

    polygon = shapely.Polygon(outline.points)
    inside = [words for words, (x, y) in texts if shapely.contains_xy(polygon, x, y)]
    if len(inside) > 1:
        raise InvalidInput(
            f"{outline.name} has the texts {inside} in it: leave the one that is its name, and "
            "put notes on a layer that is not read"
        )
    return inside[0] if inside else f"{outline.layer} {number}"


def _check_polygon(given: Any, name: str, factor: float) -> Array:
    """Return the vertices of a polygon without a repeated last one (n, 2) [m]."""
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


def _read_msh(path: Path, unit: str | None, ignored: Collection[str]) -> Iterator[Outline]:
    """Read the physical surfaces of a gmsh mesh."""
    factor = in_unit(f"1 {unit or 'm'}", "m", "unit")
    for name, points in read_physical_surfaces(path, factor):
        if infer_part(name) not in ignored:
            yield Outline(points, name, infer_part(name))


def read_physical_surfaces(path: Path, factor: float = 1.0) -> list[tuple[str, Array]]:
    """Read names and outlines (n, 2) [m] of the physical surfaces, ordered by tag."""
    mesh = _read_mesh(path)
    names = _group_names(mesh, 2)
    points = _check_plane(mesh.points) * factor
    found: dict[int, list[NDArray[np.intp]]] = {}
    for cells, tags in _tagged_cells(mesh, set(CORNERS_PER_CELL)):
        for cell, tag in zip(cells.data[:, : CORNERS_PER_CELL[cells.type]], tags, strict=True):
            found.setdefault(int(tag), []).append(cell)
    if not found:
        raise InvalidInput("it has no physical surface: tag each block with one, in gmsh")
    surfaces = []
    for tag, cells in sorted(found.items()):
        outline = _trace_outline(cells, points, names.get(tag, str(tag)))
        surfaces.append((names.get(tag, f"block {tag}"), points[outline]))
    return surfaces


def read_physical_curves(path: Path, factor: float = 1.0) -> list[tuple[str, Array]]:
    """Read name and edge mid-points (n, 2) [m] of each named physical curve."""
    mesh = _read_mesh(path)
    names, points = _group_names(mesh, 1), mesh.points[:, :2] * factor
    found: dict[str, list[Array]] = {}
    for cells, tags in _tagged_cells(mesh, {"line", "line3"}):
        for edge, tag in zip(cells.data[:, :2], tags, strict=True):
            if int(tag) in names:
                found.setdefault(names[int(tag)], []).append(points[edge].mean(axis=0))
    return [(name, np.array(middles)) for name, middles in found.items()]


def infer_part(name: str) -> str:
    """Infer the part of a block from its name: up to a comma, or without its number."""
    head, comma, _ = name.partition(",")
    return head.strip() if comma else re.sub(r"\s*\d+$", "", name)


def _read_mesh(path: Path) -> Any:
    """Read a mesh file with meshio."""
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


def _group_names(mesh: Any, dimension: int) -> dict[int, str]:
    """Return the names of the physical groups of one dimension by tag."""
    return {
        int(tag): name for name, (tag, size) in mesh.field_data.items() if int(size) == dimension
    }


def _tagged_cells(mesh: Any, kinds: set[str]) -> list[tuple[Any, Any]]:
    """Return blocks of cells of some kinds, each with the physical tags of its cells."""
    tags = mesh.cell_data.get("gmsh:physical", [])
    pairs = zip(mesh.cells, tags, strict=True) if tags else ()
    return [(cells, tag) for cells, tag in pairs if cells.type in kinds]


def _check_plane(points: Array) -> Array:
    """Return the points of a mesh in the plane of x and y (n, 2)."""
    if points.shape[1] > 2 and np.ptp(points[:, 2]) > 1e-6 * np.ptp(points[:, :2]):
        raise InvalidInput("it does not lie in the plane of x and y: mesh an elevation in it")
    return points[:, :2]


def _trace_outline(cells: list[NDArray[np.intp]], points: Array, name: str) -> list[int]:
    """Trace the points around cells in order, without points on straight edges."""
    ends: Counter[tuple[int, int]] = Counter()
    for cell in cells:
        x, y = points[cell].T
        around = cell if float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) > 0.0 else cell[::-1]
        ends.update((int(a), int(b)) for a, b in zip(around, np.roll(around, -1), strict=True))
    # an edge between two cells occurs in both directions, one on the boundary in one
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
    # a point lies on a straight edge if the sine of the turn there vanishes to round-off
    turn = before[:, 0] * ahead[:, 1] - before[:, 1] * ahead[:, 0]
    lengths = np.linalg.norm(before, axis=1) * np.linalg.norm(ahead, axis=1)
    return [
        point for point, bends in zip(loop, np.abs(turn) > 1e-9 * lengths, strict=True) if bends
    ]


def write_dxf(
    path: str | Path,
    outlines: Mapping[str, Sequence[tuple[str, Array]]],
    lines: Mapping[str, Sequence[tuple[str, Array]]] | None = None,
) -> Path:
    """Write outlines with names, and optional lines, as a DXF drawing."""
    import ezdxf
    import shapely

    drawing = ezdxf.new("R2010", units=ezdxf.units.M)  # type: ignore[attr-defined]
    space = drawing.modelspace()
    for layer, polygons in outlines.items():
        for name, points in polygons:
            given = [(float(x), float(y)) for x, y in points]
            space.add_lwpolyline(given, close=True, dxfattribs={"layer": layer})
            inside = shapely.Polygon(given).representative_point()
            # names of 0.05 m on a layer of their own, so that the outlines can be read alone
            note = {"layer": f"{layer} names", "height": 0.05, "insert": (inside.x, inside.y)}
            space.add_text(name, dxfattribs=note)
    for layer, runs in (lines or {}).items():
        for _, points in runs:
            given = [(float(x), float(y)) for x, y in points]
            space.add_lwpolyline(given, dxfattribs={"layer": layer})
    with atomic_write(Path(path)) as draft:
        drawing.saveas(draft)
    return Path(path)
