"""Drawings with one closed outline for each block: GeoJSON, DXF, SVG, IFC, tagged gmsh files.

A drawing is an elevation: x to the right, y upwards. ezdxf reads DXF files and meshio gmsh files;
nothing in them is executed. Only calls of these two are within `_foreign_reader`, since files that
are damaged raise errors of any class there.
"""

import json
import re
from cmath import rect
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from itertools import pairwise
from math import acos, atan, ceil, dist, isclose, log10, radians, tau
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from archfem._files import atomic_write, check_file, read_text
from archfem._optional import require_package
from archfem._typing import Array, Numbers
from archfem._validation import short_repr
from archfem.errors import InvalidInput
from archfem.masonry.block import drop_straight_vertices, measure_polygon, trace_boundary
from archfem.masonry.structure import suggest_name
from archfem.masonry.survey.assemblies import is_assembly, read_plane_assembly, trace_elevation
from archfem.masonry.survey.dxf import MAX_ENTITIES, POLYLINES, Entity, load_dxf
from archfem.masonry.survey.ifc import load_ifc_reader
from archfem.masonry.survey.svg import read_svg
from archfem.units import in_unit

# Entities of a DXF file that draw no stone; all others but polylines may draw one
ANNOTATIONS = (
    *("TEXT", "MTEXT", "ATTDEF", "DIMENSION", "ARC_DIMENSION", "LARGE_RADIAL_DIMENSION", "LEADER"),
    *("MULTILEADER", "TOLERANCE", "POINT", "RAY", "XLINE", "VIEWPORT", "IMAGE", "WIPEOUT"),
    *("PDFUNDERLAY", "DWFUNDERLAY", "DGNUNDERLAY", "OLE2FRAME", "ACAD_TABLE", "LIGHT", "SUN"),
)
UNITS = ("mm", "cm", "m")  # that a drawing without one may have
SMALLEST_BLOCK, LARGEST_BLOCK = 0.1, 20.0  # typical diagonals by a unit of the drawing [m]


@dataclass(frozen=True)
class Frame:
    """Coordinates of a drawing, y upwards or, in SVG files, downwards."""

    factor: float = 1.0  # unit of the coordinates [m]
    unit: str = "m"  # name of the unit
    upwards: float = 1.0  # 1 or -1
    stated: str = ""  # another unit that the file states, and that its sizes permit

    def place(self, point: Sequence[float]) -> str:
        """Return a place [m] in words, in coordinates of the drawing, to a millimetre or better."""
        decimals = max(ceil(log10(1e3 * self.factor) - 1e-9), 0)
        drawn = np.round(np.multiply(point, [1.0, self.upwards]), 6) / self.factor + 0.0
        x, y = (f"{v:.{min(max(len(f'{abs(v):.0f}') + decimals, 6), 15)}g}" for v in drawn)
        return f"({x}, {y}) {self.unit}"

    def length(self, value: float) -> str:
        """Return a length [m] in words, in the unit of the drawing."""
        return f"{value / self.factor:.3g} {self.unit}"


@dataclass(frozen=True, eq=False)
class Outline:
    """A closed polygon of a drawing with its properties."""

    points: Array  # vertices in either direction, the first not repeated (n, 2) [m]
    name: str  # name of the block
    layer: str  # layer of the outline; in GeoJSON its part
    material: str | None = None  # name of the material
    fixed: bool | None = None  # whether the block is fixed
    role: str | None = None  # role of the part
    frame: Frame = Frame()  # coordinates of the drawing

    @property
    def drawn(self) -> Array:
        """Vertices in coordinates of the drawing, y upwards (n, 2)."""
        return self.points / self.frame.factor


def read_drawing(
    path: str | Path,
    unit: str | None = None,
    ignored: Counter[str] | None = None,
    snap: float = 1e-3,
    faults: list[str] | None = None,
) -> list[Outline]:
    """Read the closed polygons of a drawing; arcs stray by half of snap.

    Outlines on the layers that are keys of `ignored` are left out, and counted there; so are those
    that the drawing hides, under "layer (hidden)". Entities of DXF files that are no outlines are
    errors, or named in `faults`.
    """
    path, ignored = Path(path), Counter() if ignored is None else ignored
    strays = list[str]()
    readers: dict[str, Callable[..., Iterator[Outline]]] = {
        **dict.fromkeys((".geojson", ".json"), _read_geojson),
        ".dxf": partial(_read_dxf, snap=snap, faults=strays),
        ".ifc": _read_ifc,
        ".msh": _read_msh,
        ".svg": partial(_read_svg, snap=snap),
    }
    if (read := readers.get(path.suffix.lower())) is None:
        raise InvalidInput(f"{path} is no drawing: give a .geojson, .dxf, .svg, .ifc or .msh file")
    check_file(path, "drawing", max_bytes=2**25)
    try:
        outlines = list(read(path, unit, ignored))
        if strays and (faults is None or not outlines):
            raise InvalidInput("; ".join(strays))
        if faults is not None:
            faults += strays
        _check_sizes(outlines)
    except InvalidInput as error:
        raise InvalidInput(f"{path}: {error}") from error
    return outlines


def read_polylines(
    path: Path, unit: str | None, ignored: Counter[str], snap: float
) -> tuple[list[Outline], list[Outline]]:
    """Read the curves of a DXF file that is in error: closed outlines, and open lines."""
    with _foreign_reader("ezdxf", "DXF drawing"):
        read, stated = load_dxf(path, ignored)
    frame = Frame(*stated or (1.0, "units")) if unit is None else _read_unit(unit)
    closed, lines = list[Outline](), list[Outline]()
    for entity in read:
        points = np.array([point[:2] for point in entity.points], dtype=float) * frame.factor
        if entity.kind in POLYLINES and len(points) > 1 and np.isfinite(points).all():
            is_closed = entity.closed or dist(points[0], points[-1]) <= snap
            kept = closed if is_closed and len(points) > 2 else lines
            kept.append(Outline(points, f"{len(kept) + 1}", entity.layer, frame=frame))
    if not (closed or lines):
        raise InvalidInput(f"{path} has no polylines to draw")
    return closed, lines


@contextmanager
def _foreign_reader(library: str, kind: str) -> Iterator[None]:
    """Turn any error of a library that reads a file into one that names its cause."""
    try:
        with _limit_memory():
            yield
    # Damaged files end in errors of all classes there, and in SystemExit. No code of ours runs
    # inside, whose mistakes would be hidden.
    except (Exception, SystemExit) as error:
        cause = f"{type(error).__name__}: {error}".removesuffix(": ")
        raise InvalidInput(
            f"it is no {kind} that {library} reads ({cause}): save it again from the program that "
            "wrote it"
        ) from error


@contextmanager
def _limit_memory(more: int = 2**30) -> Iterator[None]:
    """Limit the additional memory of the process [bytes]."""
    # a damaged number of nodes makes meshio fill arrays of any size, and the kernel kills
    statistics = Path("/proc/self/statm")
    if not statistics.exists() or find_spec("resource") is None:  # elsewhere than on Linux
        yield
        return
    resource = import_module("resource")
    limits = resource.getrlimit(resource.RLIMIT_AS)
    taken = int(statistics.read_text().split()[0]) * resource.getpagesize()
    allowed = min(each for each in (taken + more, *limits) if each != resource.RLIM_INFINITY)
    resource.setrlimit(resource.RLIMIT_AS, (allowed, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, limits)


def _check_sizes(outlines: list[Outline]) -> None:
    """Refuse a drawing without outlines, with too many, or whose unit is evidently wrong."""
    if not outlines:
        raise InvalidInput(
            "it has no closed outlines to read: in a DXF draw them in model space, not on a sheet, "
            "and on layers that are shown"
        )
    points = sum(len(each.points) for each in outlines)
    if points > 20_000:  # every edge is compared with every vertex
        raise InvalidInput(
            f"it has {points} vertices, and there is room for 20000: leave out those along "
            "straight edges"
        )
    _check_unit([each.points for each in outlines], outlines[0].frame)


def _check_unit(polygons: Sequence[Array], frame: Frame, least: float = 0.02) -> float:
    """Return the size of a typical polygon [m]; refuse one that shows that the unit is wrong."""
    # the median diagonal is insensitive to a few long blocks, such as a fill
    typical = float(np.median([np.hypot(*np.ptp(each, axis=0)) for each in polygons]))
    if least <= typical <= LARGEST_BLOCK:
        return typical
    points = np.concatenate(polygons)
    away = np.abs(points).max(axis=0)
    problem = f"a block is typically {typical:.3g} m large"
    # longitudes and latitudes make blocks far smaller than a unit
    if typical < 0.02 and frame == Frame() and away[0] <= 180.0 and away[1] <= 90.0:
        problem += "; coordinates in degrees (CRS84) do not do, export projected metres"
    raise _refuse_unit(problem, points, frame)


def _read_geojson(path: Path, unit: str | None, ignored: Counter[str]) -> Iterator[Outline]:
    """Read the polygons of a GeoJSON file, or the blocks of a plane assembly of compas."""
    try:
        found = json.loads(read_text(path, "drawing"))
    except (ValueError, RecursionError) as error:
        raise InvalidInput(f"it is not JSON: {error}") from error
    frame = _read_unit(unit or "m")
    if is_assembly(found):
        for name, points, fixed in read_plane_assembly(found):
            if "blocks" in ignored:
                ignored["blocks"] += 1
            else:
                points = _check_polygon(points, f"'{name}'", frame.factor)
                yield Outline(points, name, "blocks", fixed=fixed, frame=frame)
        return
    if not isinstance(found, dict) or not isinstance(found.get("features"), list):
        raise InvalidInput("it is no GeoJSON FeatureCollection: export the outlines as one")
    for number, feature in enumerate(found["features"], 1):
        outline = _read_feature(_as_table(feature, f"feature {number}"), number, frame.factor)
        if outline.layer in ignored:
            ignored[outline.layer] += 1
        else:
            yield replace(outline, frame=frame)


def _read_unit(unit: str, upwards: float = 1.0, other: Frame | None = None) -> Frame:
    """Return the coordinates of a drawing in a unit, which may contradict that of the file."""
    factor = in_unit(f"1 {unit}", "m", "unit")
    # a US survey foot is 2e-6 longer than a foot
    stated = other.unit if other and not isclose(factor, other.factor, rel_tol=1e-5) else ""
    return Frame(factor, unit, upwards, stated)


def _refuse_unit(problem: str, points: Array, frame: Frame = Frame()) -> InvalidInput:
    """Return the error of a drawing whose unit is not known, with its breadth in likely ones."""
    breadth = float(np.ptp(points[:, 0])) / frame.factor if len(points) else 0.0
    sizes = ", ".join(f'{_read_unit(x).factor * breadth:.3g} m by unit = "{x}"' for x in UNITS)
    return InvalidInput(f"{problem}: give the unit that makes its breadth right, {sizes}")


def _as_table(value: Any, name: str) -> dict[str, Any]:
    """Return a JSON object; null is an empty one."""
    if not isinstance(value, dict | None):
        raise InvalidInput(f"{name} is {short_repr(value)}, where GeoJSON has an object in braces")
    return value or {}


def _read_feature(feature: dict[str, Any], number: int, factor: float) -> Outline:
    """Read the polygon of a feature, named by its number if it has no name."""
    data = _as_table(feature.get("properties"), f"'properties' of feature {number}")
    name = str(data.get("name") or f"outline {number}")
    _check_properties(data, name)
    geometry = _as_table(feature.get("geometry"), f"'geometry' of '{name}'")
    kind, rings = geometry.get("type"), geometry.get("coordinates")
    if kind == "MultiPolygon" and isinstance(rings, list) and len(rings) == 1:
        kind, rings = "Polygon", rings[0]
    if kind != "Polygon" or not isinstance(rings, list) or not rings:
        raise InvalidInput(f"'{name}' is a {kind}: give each block as one Polygon")
    if len(rings) > 1:
        raise InvalidInput(f"'{name}' has a hole: cut it into blocks without holes")
    points = _check_polygon(rings[0], f"'{name}'", factor)
    part, material, role = (str(data.get(key) or "") for key in ("part", "material", "role"))
    return Outline(points, name, part, material or None, data.get("fixed"), role or None)


def _check_properties(data: dict[str, Any], name: str) -> None:
    """Refuse misspelt properties and values of the wrong kind."""
    words = ("name", "part", "role", "material")
    if not data.get("part") and {key.lower() for key in data} >= {"layer"}:
        raise InvalidInput(
            f"'{name}' has a property 'layer', which is not read, and no part: rename it to part; "
            "read are name, part, role, material and fixed"
        )
    for key in set(data) - {*words, "fixed"}:  # others are ignored
        if hint := suggest_name(key.lower(), [*words, "fixed"], 0.8):
            raise InvalidInput(f"'{name}' has a property '{key}': {hint}")
    if data.get("fixed") not in (None, True, False):  # 0 and 1 too, as many programs export
        raise InvalidInput(f"'{name}': fixed = {short_repr(data['fixed'])} is not true or false")
    for key in words:
        # numbers are names too, of blocks and parts
        if not isinstance(data.get(key), str | int | float | None):
            raise InvalidInput(f"'{name}': {key} = {short_repr(data[key])} is a table: give words")


def _read_dxf(
    path: Path, unit: str | None, ignored: Counter[str], snap: float, faults: list[str]
) -> Iterator[Outline]:
    """Read the closed polylines of a DXF file, named by the texts inside them.

    Other things on layers that are read are faults.
    """
    with _foreign_reader("ezdxf", "DXF drawing"):
        read, stated = load_dxf(path, ignored)
    if len(read) > MAX_ENTITIES:
        raise InvalidInput(f"it has more than {MAX_ENTITIES} entities: leave out other things")
    polylines = [entity for entity in read if entity.kind in POLYLINES]
    faults += _find_strays(read, {entity.layer for entity in polylines})
    points = [complex(*point[:2]) for each in polylines for point in each.points]
    corners = np.array([point for point in points if abs(point) < 1e12])  # others are refused
    header = frame = Frame(*stated) if stated else None
    frame = frame if unit is None else _read_unit(unit, other=frame)
    if frame is None:
        drawn = np.column_stack([corners.real, corners.imag])
        raise _refuse_unit("the drawing does not say its unit ($INSUNITS)", drawn)
    # before ends are compared, whose distance a wrong unit would misstate
    known = [np.multiply(each.points, frame.factor)[:, :2] for each in polylines if each.points]
    if 0 < len(corners) == len(points):
        # a unit of the case is deliberate, as of a model in a laboratory
        size = _check_unit(known, frame, SMALLEST_BLOCK if unit is None else 0.02) / frame.factor
        if header and not SMALLEST_BLOCK <= size * header.factor <= LARGEST_BLOCK:
            frame = replace(frame, stated="")
    outlines = [_read_polyline(entity, frame, snap, corners, faults) for entity in polylines]
    texts = []
    for entity in read:
        if text := entity.text:
            place = _check_coordinates(entity.points, f"the text '{text}'", frame.factor)[0]
            texts.append((text, place))
    # what many stones have in common, as their material, is the name of none
    said = Counter(text for text, _ in texts)
    texts = [each for each in texts if said[each[0]] == 1]
    inside, counts = _find_texts(outlines, texts), Counter[str]()
    for outline, words in zip(outlines, inside, strict=True):
        counts[outline.layer] += 1
        if len(outline.points):
            yield replace(outline, name=_block_name(outline, words, counts[outline.layer]))


def _find_texts(outlines: Sequence[Outline], texts: Sequence[tuple[str, Array]]) -> list[list[str]]:
    """Return the texts inside each outline: each in the smallest one of those around it."""
    shapes = np.array([shapely.Polygon(each.points) for each in outlines])
    # an outline that crosses itself has its text, if it is within its hull
    shapes = np.where(shapely.is_valid(shapes), shapes, shapely.convex_hull(shapes))
    areas, inside = shapely.area(shapes), [list[str]() for _ in outlines]
    for words, (x, y) in texts:
        if len(around := np.flatnonzero(shapely.contains_xy(shapes, x, y))):
            inside[around[np.argmin(areas[around])]].append(words)
    return inside


def _find_strays(read: Sequence[Entity], layers: Collection[str]) -> Iterator[str]:
    """Yield what is neither polyline nor annotation, beside layers of polylines, in words."""
    others = [each for each in read if each.kind not in (*POLYLINES, *ANNOTATIONS, "INSERT")]
    if others and not layers:
        found = ", ".join(f"{n} {kind}" for kind, n in Counter(x.kind for x in others).items())
        raise InvalidInput(f"it has no polylines, but {found}: make a closed one of each stone")
    for kind, layer in dict.fromkeys((each.kind, each.layer) for each in others):
        beside = " beside its polylines" if layer in layers else ", which would be left out"
        yield (
            f"layer '{layer}' has a {kind}{beside}: make a closed polyline of each stone, and "
            "ignore layers of other things"
        )


def _draw_arcs(entity: Entity, corners: Array, snap: float) -> list[tuple[float, ...]]:
    """Return the vertices of a polyline with chords of its arcs, which stray by half of snap.

    An arc is divided at the corners of all outlines along it, then evenly between these. Outlines
    on both sides of it therefore have the same vertices.
    """
    points, bulges = entity.points, (*entity.bulges, *[0.0] * len(entity.points))
    drawn = list[tuple[float, ...]]()
    for point, after, bulge in zip(points, points[1:] + points[:1], bulges, strict=False):
        drawn.append(point)
        start, end, turn = complex(*point[:2]), complex(*after[:2]), 4.0 * atan(bulge)
        if start == end or not 1e-9 < abs(bulge) < 1e6:
            continue
        # p₁ - p₀ = arm (exp(i θ) - 1), with the arm from the centre to p₀
        arm = (end - start) / (rect(1.0, turn) - 1.0)
        near = snap / abs(arm)
        # stones keep their corners where other vertices turn by at most 10 degrees
        step = min(max(2.0 * acos(max(1.0 - 0.5 * near, 0.0)), 1e-3), radians(9.0))
        away = (corners - start) / arm + 1.0
        angles = np.copysign(1.0, turn) * np.angle(away) % tau
        on = (np.abs(np.abs(away) - 1.0) <= near) & (angles > near) & (angles < abs(turn) - near)
        breaks = [0.0, *sorted(angles[on]), abs(turn)]
        for low, high in pairwise(breaks):
            for angle in np.linspace(low, high, ceil((high - low) / step) + 1)[1:]:
                place = start + arm * (rect(1.0, np.copysign(angle, turn)) - 1.0)
                drawn.append((place.real, place.imag, *point[2:]))
        drawn.pop()  # the end, which is the next vertex
    return drawn


def _read_polyline(
    entity: Entity, frame: Frame, snap: float, corners: Array, faults: list[str]
) -> Outline:
    """Return the outline of a closed polyline, whose ends may be apart by the tolerance.

    One that is not closed is a fault, and has no points.
    """
    given, layer, factor = entity.points, entity.layer, frame.factor
    if not given:
        raise InvalidInput(f"a polyline on layer '{layer}' has no vertices: take it out")
    where = f"a polyline at {frame.place([factor * x for x in given[0][:2]])} on layer '{layer}'"
    if entity.is_mesh:
        raise InvalidInput(f"{where} is a mesh: draw the block as a closed polyline")
    _check_coordinates(given, where, factor)
    if not entity.closed:
        if (gap := factor * dist(given[0], given[-1])) > snap:
            faults.append(
                f"{where} is not closed, its ends are {1e3 * gap:.3g} mm apart: close the outline "
                "of a stone; put any other line on a layer with ignore = true"
            )
            return Outline(np.zeros((0, 2)), where, layer, frame=frame)
        entity = replace(entity, points=given[:-1] if len(given) > 1 else given)
    points = _draw_arcs(entity, corners, snap / factor)
    return Outline(_check_polygon(points, where, factor), where, layer, frame=frame)


def _block_name(outline: Outline, inside: Sequence[str], number: int) -> str:
    """Return the text inside an outline, else its layer and number."""
    if len(inside) > 1:
        raise InvalidInput(
            f"{outline.name} has the texts {inside} in it: leave the one that is its name, and "
            "put notes on a layer that is not read"
        )
    if inside:
        return inside[0]
    # a number alone, such as layer 0 of entities without one, is no name
    stem = f"layer {outline.layer}, stone" if outline.layer.isdigit() else outline.layer
    return f"{stem} {number}"


def _check_polygon(given: Any, name: str, factor: float) -> Array:
    """Return the vertices of a polygon without a repeated last one (n, 2) [m]."""
    points = _check_plane(given, name, factor, f"{name} does not lie", "draw")
    points = points[np.any(points != np.roll(points, -1, axis=0), axis=1)]  # no edge of no length
    if len(points) < 3:
        raise InvalidInput(f"{name} has {len(points)} vertices: a block has at least 3")
    return points


def _check_coordinates(given: Any, name: str, factor: float) -> Array:
    """Return points in the plane or in space (n, 2 or more) [m]."""
    try:
        points = np.array(given, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInput(f"{name} has coordinates that are no list of points") from error
    if points.ndim != 2 or points.shape[1] < 2 or not np.all(np.isfinite(points)):
        raise InvalidInput(f"{name} has coordinates that are no finite points in the plane")
    if not len(points):
        raise InvalidInput(f"{name} has no points")
    far = float(np.abs(points).max()) * factor
    if far > 1e9:  # round-off beyond moves vertices by more than a micrometre
        raise InvalidInput(
            f"{name} has a coordinate of {far:.3g} m, and there is room up to 1e+09 m: move the "
            "drawing, or give its unit"
        )
    return factor * points


def _read_svg(
    path: Path, unit: str | None, ignored: Counter[str], snap: float
) -> Iterator[Outline]:
    """Read the closed shapes of an SVG file."""
    text = read_text(path, "drawing")
    if unit is None:
        found = [points for _, _, points in read_svg(text, np.inf, ignored)]
        problem = "an SVG file has the size on paper alone"
        raise _refuse_unit(problem, np.concatenate([np.zeros((0, 2)), *found]))
    frame = _read_unit(unit, -1.0)
    for name, layer, points in read_svg(text, 0.5 * snap / frame.factor, ignored):
        yield Outline(_check_polygon(points, f"'{name}'", frame.factor), name, layer, frame=frame)


def _read_ifc(path: Path, unit: str | None, ignored: Counter[str]) -> Iterator[Outline]:
    """Read the solids of an IFC file as an elevation, each on the layer of its class."""
    if unit is not None:
        raise InvalidInput(f"an IFC file states its unit: leave unit = {unit!r} out")
    read = load_ifc_reader()
    with _foreign_reader("ifcopenshell", "IFC file"):
        solids = read(path, ignored)
    if solids:
        outlines = trace_elevation([solid for solid, _ in solids])
        for (solid, kind), points in zip(solids, outlines, strict=True):
            yield Outline(_check_polygon(points, f"'{solid.name}'", 1.0), solid.name, kind)


def _read_msh(path: Path, unit: str | None, ignored: Counter[str]) -> Iterator[Outline]:
    """Read the physical surfaces of a gmsh mesh."""
    frame = _read_unit(unit or "m")
    for name, points in read_physical_surfaces(path, frame.factor):
        if (part := infer_part(name)) in ignored:
            ignored[part] += 1
        else:
            yield Outline(points, name, part, frame=frame)


def read_physical_surfaces(path: Path, factor: float = 1.0) -> list[tuple[str, Array]]:
    """Read names and outlines (n, 2) [m] of the physical surfaces, ordered by tag."""
    corners = {"triangle": 3, "triangle6": 3, "quad": 4, "quad8": 4, "quad9": 4}
    points, names, found = _load_msh(path, factor, 2, corners)
    if not found:
        raise InvalidInput("it has no physical surface: tag each block with one, in gmsh")
    surfaces = []
    for tag, cells in sorted(found.items()):
        outline = _trace_outline(cells, points, names.get(tag, str(tag)))
        surfaces.append((names.get(tag, f"block {tag}"), outline))
    return surfaces


def read_physical_curves(path: Path, factor: float = 1.0) -> list[tuple[str, Array]]:
    """Read name and edge mid-points (n, 2) [m] of each named physical curve."""
    points, names, found = _load_msh(path, factor, 1, {"line": 2, "line3": 2})
    named = [(names[tag], edges) for tag, edges in found.items() if tag in names]
    return [(name, points[np.array(edges)].mean(axis=1)) for name, edges in named]


def infer_part(name: str) -> str:
    """Infer the part of a block from its name: up to a comma, or without its number."""
    head, comma, _ = name.partition(",")
    return head.strip() if comma else re.sub(r"\s*\d+$", "", name)


def _load_msh(
    path: Path, factor: float, dimension: int, corners: Mapping[str, int]
) -> tuple[Array, dict[int, str], dict[int, list[Numbers]]]:
    """Load points [m], and names and corners of cells of physical groups by tag, with meshio."""
    with require_package("meshio"):
        import meshio
    with _foreign_reader("meshio", "mesh of gmsh"):
        read = meshio.gmsh.read(path)
        tags = read.cell_data.get("gmsh:physical", [])  # none where nothing is tagged
        blocks = [
            (each.type, np.array(each.data, dtype=np.intp), np.array(tag, dtype=np.intp))
            for each, tag in zip(read.cells, tags, strict=False)
        ]
        groups = [(name, int(tag), int(size)) for name, (tag, size) in read.field_data.items()]
        points = np.array(read.points, dtype=float)
    cells: dict[int, list[Numbers]] = {}
    for kind, numbers, of_group in blocks:
        # a negative number would silently count from the end
        if numbers.size and not 0 <= numbers.min() <= numbers.max() < len(points):
            raise InvalidInput(
                f"cells ({kind}) have nodes that are not in the file: save the whole mesh"
            )
        if kind in corners:
            if numbers.size == 0 or numbers.shape[1] < corners[kind]:
                raise InvalidInput(
                    f"cells ({kind}) have no {corners[kind]} nodes: save the whole mesh"
                )
            for cell, tag in zip(numbers[:, : corners[kind]], of_group.tolist(), strict=True):
                cells.setdefault(tag, []).append(cell)
    names = {tag: name for name, tag, size in groups if size == dimension}
    return _check_plane(points, "the mesh", factor), names, cells


def _check_plane(
    given: Any, name: str, factor: float, problem: str = "it does not lie", verb: str = "mesh"
) -> Array:
    """Return points in the plane of x and y (n, 2) [m]."""
    points = _check_coordinates(given, name, factor)
    if np.any(np.ptp(points[:, 2:], axis=0) > 1e-6 * np.ptp(points[:, :2])):
        raise InvalidInput(f"{problem} in the plane of x and y: {verb} an elevation in it")
    return points[:, :2]


def _trace_outline(cells: list[Numbers], points: Array, name: str) -> Array:
    """Trace the points around cells in order, without points on straight edges."""
    areas = (measure_polygon(points[cell])[0] for cell in cells)
    loop = trace_boundary([c if a > 0.0 else c[::-1] for c, a in zip(cells, areas, strict=True)])
    if not loop:
        raise InvalidInput(
            f"physical surface '{name}' is in pieces or has a hole, or its cells overlap: tag "
            "each block by itself"
        )
    outline = drop_straight_vertices(points[loop], 1e-9)  # up to round-off
    if len(outline) < 3:
        raise InvalidInput(f"physical surface '{name}' has no area: tag each block with its own")
    return outline


def write_dxf(
    path: str | Path,
    outlines: Mapping[str, Sequence[tuple[str, Array]]],
    lines: Mapping[str, Sequence[tuple[str, Array]]] | None = None,
) -> Path:
    """Write outlines with names, and optional lines, as a DXF drawing."""
    import ezdxf

    drawing = ezdxf.new("R2010", units=ezdxf.units.M)  # type: ignore[attr-defined]
    space = drawing.modelspace()
    for layer, polygons in outlines.items():
        for name, points in polygons:
            space.add_lwpolyline(points.tolist(), close=True, dxfattribs={"layer": layer})
            inside = shapely.Polygon(points).representative_point()
            # names of 0.05 m on a layer of their own, so that the outlines can be read alone
            note = {"layer": f"{layer} names", "height": 0.05, "insert": (inside.x, inside.y)}
            space.add_text(name, dxfattribs=note)
    for layer, runs in (lines or {}).items():
        for _, points in runs:
            space.add_lwpolyline(points.tolist(), dxfattribs={"layer": layer})
    with atomic_write(Path(path)) as draft:
        drawing.saveas(draft)
    return Path(path)
