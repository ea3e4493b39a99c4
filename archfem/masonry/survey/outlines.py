"""Structures from the surveyed outlines of their blocks, whose small gaps are closed.

Vertices nearer to one another than the tolerance `snap` are merged. A vertex within `snap` of an
edge of another outline is moved onto it. A joint between two blocks that deviates from a line by
at most `snap` is made straight. Remaining overlaps and narrow gaps are ambiguous, hence errors,
but for chipped corners beside faces that touch over most of their length.
"""

import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby, pairwise
from math import dist
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from archfem._files import atomic_write
from archfem._typing import Array, Metres, MetresPerSecondSquared
from archfem._validation import check_between, validate_arguments
from archfem.errors import InvalidInput, InvalidStructure, logger
from archfem.masonry.assembly import Touch, assembled, by_materials, touching
from archfem.masonry.block import (
    Block,
    as_point,
    check_overlaps,
    check_simple,
    measure_polygon,
    say_others,
)
from archfem.masonry.materials import (
    CONTACT_PRESETS,
    MATERIAL_PRESETS,
    SOIL_TO_STONE,
    STONE,
    STONE_TO_STONE,
    Contact,
    Material,
)
from archfem.masonry.parts import Direction, assign_roles, find_directions
from archfem.masonry.structure import CONTACT_TOLERANCE, LARGE_STONE, Structure, join_names
from archfem.masonry.survey.drawings import (
    ANNOTATIONS,
    Frame,
    Outline,
    read_drawing,
    read_physical_curves,
    read_polylines,
)
from archfem.masonry.survey.dxf import POLYLINES, load_dxf
from archfem.masonry.survey.joint_faces import (
    LEAST_OPENING,
    Chip,
    find_chips,
    measure_openings,
    say_faces,
)
from archfem.masonry.survey.layers import Layer, group_by_place
from archfem.units import G, in_unit

# Gaps and contacts up to this multiple of the tolerance are taken for errors of the survey [-]
AMBIGUOUS_GAP_RATIO = 5.0

# Numbers of places: both ends of an edge, and those around each outline
Edge = tuple[int, int]
Boundaries = list[list[int]]

# Outlines that touch, the largest displacement of a vertex [m], and common lines
Closed = tuple[list[Array], float, list[Touch]]

# Materials by name
Materials = Mapping[str, Material]


class NarrowGap(InvalidStructure):
    """A gap between two faces that is too narrow to be one on purpose."""


@dataclass(frozen=True, eq=False)
class Survey:
    """Blocks of a survey whose outlines touch exactly.

    Attributes:
        blocks: blocks in the order of the file.
        size: breadth and height of the drawing [m].
        moved: largest displacement of a vertex by snapping [m].
        frame: unit of the coordinates.
        ignored: number of outlines on each ignored layer, and as "layer (hidden)" of hidden ones.
        held: other things on ignored layers of a DXF file, in words.
        lost: ignored outlines that lie between stones as one does: layer, place and the share of
            the circumference that touches them [-].
        chips: chipped corners beside joints: both stones, the chip along and across the joint, and
            the length along which it touches [m].
        closed: joints drawn open by more than a millimetre, which were closed, the widest first:
            both stones and the gap in the mean of its length [m].
    """

    blocks: tuple[Block, ...]
    size: tuple[float, float]
    moved: float
    frame: Frame
    ignored: Mapping[str, int]
    held: Mapping[str, str]
    lost: tuple[tuple[str, str, float], ...] = ()
    chips: tuple[tuple[str, str, float, float, float], ...] = ()
    closed: tuple[tuple[str, str, float], ...] = ()

    def __str__(self) -> str:
        counts = [
            f"'{layer}' with {count} outlines{self.held.get(layer, '')}"
            for layer, count in self.ignored.items()
        ]
        moved = self.frame.length(round(self.moved, 9))  # less than a nanometre is round-off
        faces = say_faces(self.chips, self.closed, self.frame.length)
        return (
            f"drawing: {_say_size(self.size)}, read in {self.frame.unit}, corners moved by up to "
            f"{moved}; ignored layers: {', '.join(counts) or 'none'}{faces}"
        )


@validate_arguments
def read_outlines(
    path: str | Path,
    *,
    unit: str | None = None,
    snap: Metres = 1e-3,
    layers: Mapping[str, Layer] | None = None,
    ground: Metres | None = None,
    material: Material = STONE,
    materials: Materials = MATERIAL_PRESETS,
) -> Survey:
    """Read the outlines of a drawing as blocks, and close small gaps between them.

    Four-sided blocks get corners, so that their meshes are structured. The first and third side
    are those along a ring or pier, otherwise the longer ones.

    Args:
        path: GeoJSON, DXF or SVG file or gmsh mesh of an elevation, y upwards; or a plane assembly
            of compas_assembly or compas_dem (.json), whose blocks are on the layer "blocks"; or an
            IFC file whose solids are one, each on the layer of its class, as "IfcMember".
        unit: unit of the coordinates; by default that of the DXF file, and metres otherwise. An SVG
            file needs one.
        snap: vertices and edges nearer than this are made to touch; chords stand for arcs, to half
            of it [m].
        layers: properties of all layers of the drawing by name. Role, material and fixed of a
            GeoJSON feature take precedence.
        ground: level of fixed ground below the drawing; None where it has fixed blocks [m].
        material: material of blocks for which neither feature nor layer names one.
        materials: materials by name.

    Raises:
        InvalidInput: the file is not a drawing, or names an unknown layer or material.
        InvalidStructure: the outlines overlap, leave gaps or do not bound blocks; or roles are
            unknown or contradict one another.
    """
    known = layers or {}
    ignored = Counter({name: 0 for name, layer in known.items() if layer.ignore})
    faults = list[str]()
    outlines = read_drawing(path, unit, ignored, snap, faults)
    if faults:
        try:
            _close_or_advise(outlines, snap, _measure(outlines))
        except (InvalidInput, InvalidStructure) as error:
            faults.append(f"besides, {error}")
        raise InvalidInput(f"{path}: " + ";\n  ".join(faults))
    if layers is not None:
        outlines = group_by_place(outlines, layers, path, ignored)
    size = _measure(outlines)
    if ground is not None:
        outlines.append(_draw_ground(outlines, ground))
    try:
        points, moved, touches = _close_or_advise(outlines, snap, size)
        blocks = [
            _make_block(outline, polygon, known.get(outline.layer, Layer()), material, materials)
            for outline, polygon in zip(outlines, points, strict=True)
        ]
        made = assign_roles(blocks)
        directions = find_directions(made, touching(made))
        made = tuple(replace(b, corners=_find_corners(b, directions.get(b.part))) for b in made)
    except (InvalidInput, InvalidStructure) as error:
        raise type(error)(f"{path}: {error}") from error
    lost = tuple(_find_lost(Path(path), unit, ignored, outlines, snap))
    held = _describe_ignored(Path(path), ignored, outlines)
    names = [block.name for block in made]
    chips = tuple(
        (names[each.stone], names[each.other], each.along, each.across, each.contact)
        for each in find_chips(points, touches, snap)
    )
    gaps = measure_openings([each.points for each in outlines], touches, 4.0 * snap)
    apart = [(names[a], names[b], gap) for (a, b, _), gap in zip(touches, gaps, strict=True)]
    closed = sorted((x for x in apart if x[2] > LEAST_OPENING), key=lambda x: -x[2])
    of_file = made, size, moved, outlines[0].frame, ignored, held, lost
    return Survey(*of_file, chips, tuple(closed))


def _draw_ground(outlines: Sequence[Outline], level: float) -> Outline:
    """Return fixed ground below a level, twice as broad as the drawing."""
    (breadth, height), frame = _measure(outlines), outlines[0].frame
    left = min(each.points[:, 0].min() for each in outlines) - 0.5 * breadth
    right, low = left + 2.0 * breadth, level - 0.1 * max(breadth, height)
    points = np.array([[left, low], [right, low], [right, level], [left, level]])
    return Outline(points, "ground", "ground", None, fixed=True, role="other", frame=frame)


def _describe_ignored(
    path: Path, ignored: Counter[str], outlines: Sequence[Outline]
) -> dict[str, str]:
    """Describe what ignored layers of a DXF file hold beside outlines: see `Survey`."""
    if path.suffix.lower() != ".dxf" or not ignored:
        return {}
    words = dict[str, str]()
    stones = shapely.make_valid(np.array([shapely.Polygon(each.drawn) for each in outlines]))
    others = [each for each in load_dxf(path, Counter())[0] if each.kind not in POLYLINES]
    for layer in ignored:
        own = [each for each in others if each.layer == layer]
        words[layer] = "".join(f", {n} {kind}" for kind, n in Counter(x.kind for x in own).items())
        said = Counter(each.text for each in own)  # what several stones have is the name of none
        texts = np.array([x.points[0][:2] for x in own if x.text and said[x.text] == 1])
        texts = texts.reshape(-1, 2)
        inside = shapely.contains_xy(stones[:, None], *texts.T).sum(axis=1)
        if (named := np.count_nonzero(inside == 1)) > 0.5 * len(stones):
            alone = all(each.kind in (*ANNOTATIONS, "INSERT") for each in own)
            verb = "leave the layer out of" if alone else "move the texts to a layer that is not in"
            words[layer] += (
                f", one text in each of {named} outlines: if it is the stone's name, {verb} "
                "[structure.layers]"
            )
            if crowded := [f"'{outlines[k].name}'" for k in np.flatnonzero(inside > 1)]:
                words[layer] += f", and leave one text in {join_names(crowded)}"
    return words


def _find_lost(
    path: Path, unit: str | None, ignored: Counter[str], outlines: Sequence[Outline], snap: float
) -> Iterator[tuple[str, str, float]]:
    """Yield outlines on ignored layers of a DXF file that lie between stones: see `Survey`."""
    if path.suffix.lower() != ".dxf" or not any(ignored.values()):
        return
    stones = shapely.make_valid(np.array([shapely.Polygon(each.points) for each in outlines]))
    whole, usual = shapely.union_all(stones), float(np.median(shapely.area(stones)))
    near = shapely.buffer(whole, AMBIGUOUS_GAP_RATIO * snap)
    for each in read_polylines(path, unit, Counter(), snap)[0]:
        shape = shapely.make_valid(shapely.Polygon(each.points))
        # neither a frame nor a fill, nor a note within a stone
        if each.layer not in ignored or not 0.1 < shape.area / usual < 5.0:
            continue
        share = shapely.intersection(shape.boundary, near).length / shape.length
        if share > 0.4 and shapely.intersection(shape, whole).area < 0.1 * shape.area:
            yield each.layer, each.frame.place(each.points.mean(axis=0)), share


def _measure(outlines: Sequence[Outline]) -> tuple[float, float]:
    """Return breadth and height of a drawing [m]."""
    breadth, height = np.ptp(np.concatenate([each.points for each in outlines]), axis=0)
    return float(breadth), float(height)


def _say_size(size: tuple[float, float]) -> str:
    """Return breadth and height in words."""
    return f"{size[0]:.3g} × {size[1]:.3g} m"


@validate_arguments
def surveyed(  # noqa: PLR0913  (the drawing, and what its blocks are and how they touch)
    path: str | Path,
    *,
    unit: str | None = None,
    snap: Metres = 1e-3,
    layers: Mapping[str, Layer] | None = None,
    ground: Metres | None = None,
    material: Material = STONE,
    materials: Materials = MATERIAL_PRESETS,
    contact: Contact = STONE_TO_STONE,
    contacts: Mapping[str, Contact] = {"stone/backfill": SOIL_TO_STONE},
    width: Metres = 1.0,
    gravity: MetresPerSecondSquared = G,
) -> Structure:
    """Assemble a structure from the outlines in a drawing.

    Args:
        path: drawing, as for `read_outlines`.
        unit: unit of the coordinates, as for `read_outlines`.
        snap: vertices and edges nearer than this are made to touch [m].
        layers: properties of all layers by name, as for `read_outlines`.
        ground: level of fixed ground, as for `read_outlines` [m].
        material: material of blocks for which neither feature nor layer names one.
        materials: materials by name.
        contact: contact between blocks of one material.
        contacts: contacts between blocks of two materials by both names, as "stone/backfill".
        width: width out of plane [m].
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidInput: as `read_outlines`; or the contact of two materials is missing.
        InvalidStructure: as `read_outlines`; or the blocks are not connected.
    """
    blocks: dict[str, Any] = {"ground": ground, "material": material, "materials": materials}
    survey = read_outlines(path, unit=unit, snap=snap, layers=layers, **blocks)
    if survey.frame.stated:
        question = f"{_question_unit(survey.frame)} By it that is {_say_size(survey.size)}"
        logger.warning("%s: %s; leave unit out, or correct the drawing", path, question)
    law, name = by_materials(contact, contacts), Path(path).stem
    structure = assembled(survey.blocks, law, width=width, gravity=gravity, name=name)
    return _name_joints(structure, Path(path), unit) if Path(path).suffix == ".msh" else structure


def _name_joints(structure: Structure, path: Path, unit: str | None) -> Structure:
    """Return the structure with each joint named after the physical curve along it, if any."""
    near, names = CONTACT_TOLERANCE * structure.size, dict[int, str]()
    for name, middles in read_physical_curves(path, in_unit(f"1 {unit or 'm'}", "m", "unit")):
        away = middles[None] - structure.middles[:, None]
        along = np.abs(np.einsum("jpk,jk->jp", away, structure.tangents))
        beside = np.abs(np.einsum("jpk,jk->jp", away, structure.normals))
        on = np.all((beside < near) & (along < structure.depths[:, None] / 2.0), axis=1)
        names |= {int(number): name for number in np.flatnonzero(on)}
    named = enumerate(structure.joints)
    joints = [replace(joint, name=names.get(number, joint.name)) for number, joint in named]
    return replace(structure, joints=tuple(joints))


def _make_block(
    outline: Outline, points: Array, layer: Layer, material: Material, materials: Materials
) -> Block:
    """Make a block with the properties of its outline, else of its layer."""
    name = outline.material or layer.material
    if name is not None and name not in materials:
        raise InvalidInput(
            f"'{outline.name}' is of '{name}', which is not among the materials "
            f"{sorted(materials)}: name one of them"
        )
    chosen = material if name is None else materials[name]
    fixed = layer.fixed if outline.fixed is None else bool(outline.fixed)
    part = outline.layer if layer.part is None else layer.part
    role = outline.role or layer.role or ""
    corners = tuple((float(x), float(y)) for x, y in points)
    return Block(corners, chosen, outline.name, fixed, part=part, role=role)


def _find_corners(block: Block, direction: Direction | None) -> tuple[int, int, int, int] | None:
    """Return four clear corners, so that sides 1 and 3 run along the ring, or are the longer."""
    steps = np.roll(block.points, -1, axis=0) - block.points
    before = np.roll(steps, 1, axis=0)
    sine = before[:, 0] * steps[:, 1] - before[:, 1] * steps[:, 0]
    turns = np.arctan2(sine, np.sum(before * steps, axis=1))
    # the outline turns by more than 45 degrees at four corners, elsewhere by at most 10 degrees
    found = np.flatnonzero(turns > np.radians(45.0))
    if len(found) != 4 or np.any(np.abs(np.delete(turns, found)) > np.radians(10.0)):
        return None
    corners = block.points[found]
    sides = np.roll(corners, -1, axis=0) - corners
    measure = np.linalg.norm(sides, axis=1)
    if direction is not None:
        measure = -np.abs(sides @ direction.outward(block.centroid)) / measure
    # of the two pairs of opposite sides, that of larger measure lies first
    first = int(measure[1] + measure[3] > measure[0] + measure[2])
    a, b, c, d = (int(n) for n in np.roll(found, -first))
    return a, b, c, d


@validate_arguments
def write_outlines(structure: Structure, path: str | Path) -> None:
    """Write the blocks of a structure as GeoJSON that `read_outlines` reads.

    Arcs become chords. Coordinates are metres in the plane, not degrees. A drawing holds no values
    of materials and contacts: a warning names those that are lost. `archfem.Analysis.write` keeps
    every value.

    Args:
        structure: structure whose blocks are written with part, role and name of the material.
        path: path of the file.
    """
    used: set[Material | Contact] = {block.material for block in structure.blocks}
    used |= {joint.contact for joint in structure.joints}
    kept = {*MATERIAL_PRESETS.values(), *CONTACT_PRESETS.values()}
    if lost := sorted({item.name for item in used - kept}):
        logger.warning(
            "%s does not hold the values of %s: write an Analysis to keep them", path, lost
        )
    features = []
    for block in structure.blocks:
        ring = block.drawn().tolist()
        properties: dict[str, Any] = {key: getattr(block, key) for key in ("name", "part", "role")}
        properties |= {"material": block.material.name, "fixed": block.fixed}
        geometry = {"type": "Polygon", "coordinates": [[*ring, ring[0]]]}
        features.append({"type": "Feature", "properties": properties, "geometry": geometry})
    lines = ",\n".join(json.dumps(feature, ensure_ascii=False) for feature in features)
    text = f'{{"type": "FeatureCollection", "features": [\n{lines}\n]}}\n'
    with atomic_write(Path(path)) as draft:
        draft.write_text(text, encoding="utf-8")


def _close_or_advise(outlines: list[Outline], snap: float, drawn: tuple[float, float]) -> Closed:
    """Close the gaps between outlines; an error names the next tolerance that leaves no error."""
    check_between(snap, "snap [m]", 0.0, remedy="give e.g. 0.001", error=InvalidStructure)
    for outline in outlines:
        check_simple(outline.points, outline.name, outline.frame.place)
    try:
        return close_gaps(outlines, snap)
    except InvalidStructure as error:
        advice, is_gap = str(error), isinstance(error, NarrowGap)
    # a tolerance above a tenth of the smallest stone would distort it
    largest = 0.1 * min(abs(measure_polygon(outline.points)[0]) for outline in outlines) ** 0.5
    values = [
        digit * 10.0**k for k in range(-6, 1) for digit in (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
    ]
    higher = [value for value in values if snap < value <= largest]
    # a lower tolerance would leave a gap open
    lower = [value for value in values[::-1] if 0.05 * snap <= value < snap and not is_gap]
    frame = outlines[0].frame
    asks_unit = is_gap or frame.stated != ""
    for verb, values in (("raise", higher), ("lower", lower)):
        if value := next((each for each in values if _closes_all(outlines, each)), None):
            advice += f", or {verb} snap from {snap / frame.factor:.3g} to {frame.length(value)}"
            if value > 2.0 * snap:
                advice += ", which also closes real openings up to that"
            asks_unit |= verb == "raise"
            break
    if asks_unit:
        size = _say_size(drawn)  # without the ground that is added
        question = f"{_question_unit(frame)} By unit = '{frame.unit}' the drawing is {size}"
        breadths = [np.hypot(*np.ptp(outline.points, axis=0)) for outline in outlines]
        # no stone is that large: what is said first is what a reader tries first
        is_first = np.median(breadths) > LARGE_STONE or frame.stated
        advice = f"{question}; or else {advice}" if is_first else f"{advice}; or {question}"
    raise InvalidStructure(advice)


def _question_unit(frame: Frame) -> str:
    """Ask whether the unit is wrong, or say that it contradicts that of the file."""
    if not frame.stated:
        return "is the unit wrong?"
    return f"unit = '{frame.unit}' contradicts the drawing, in {frame.stated} by its $INSUNITS."


def _closes_all(outlines: list[Outline], snap: float) -> bool:
    """Return whether a tolerance leaves no error, and no outline without a contact."""
    try:
        touches = close_gaps(outlines, snap)[2]
    except InvalidStructure:
        return False
    return len({number for touch in touches for number in touch[:2]}) == len(outlines)


def close_gaps(outlines: list[Outline], snap: float) -> Closed:
    """Close the gaps between outlines; refuse gaps that remain ambiguous."""
    names, frame = [outline.name for outline in outlines], outlines[0].frame
    place, near = frame.place, frame.length(snap)
    # all outlines anticlockwise
    drawn = [outline.points for outline in outlines]
    oriented = [points if measure_polygon(points)[0] > 0.0 else points[::-1] for points in drawn]
    given = np.concatenate(oriented)
    places, number = _merge_vertices(oriented, snap)
    parts = np.split(number, np.cumsum([len(points) for points in oriented])[:-1])
    # merged vertices repeat, inside a boundary and across its end
    boundaries = [part[part != np.roll(part, 1)].tolist() or [int(part[0])] for part in parts]
    for outline, boundary in zip(outlines, boundaries, strict=True):
        if len(boundary) < 3:
            where = f"'{outline.name}' at {place(outline.points[0])}"
            raise InvalidStructure(f"{where} is no larger than snap = {near}: leave it out")
    ties = _find_ties(boundaries, places, snap)
    ties |= _find_bends(boundaries, places, ties, snap)
    placed = _place_tied(places, ties)
    moved = np.linalg.norm([places[number] - given, placed[number] - given], axis=2).max(axis=0)
    worst = int(np.argmax(moved))
    if moved[worst] > 2.0 * snap:
        # corners inside another outline pull at one another
        check_overlaps(oriented, names, snap, place=place)
        owner = np.repeat(names, [len(points) for points in oriented])[worst]
        raise InvalidStructure(
            f"the corner of '{owner}' at {place(given[worst])} would move by "
            f"{1e3 * moved[worst]:.3g} mm to touch all outlines nearer than snap = {near}: "
            "correct the outlines there, leave out vertices that follow one another so closely"
        )
    found = [placed[boundary] for boundary in boundaries]
    blocks = [Block(tuple(map(as_point, points)), STONE, "") for points in found]
    touches, least = touching(blocks), AMBIGUOUS_GAP_RATIO * snap
    _run_checks(
        partial(check_overlaps, found, names, place=place),
        partial(_check_gaps, placed, boundaries, outlines, least, find_chips(found, touches, snap)),
        partial(_check_contacts, touches, names, frame, least),
    )
    return found, float(moved[worst]), touches


def _run_checks(*checks: Callable[[], None]) -> None:
    """Run independent checks, and raise the errors of all in one."""
    errors = list[InvalidStructure]()
    for check in checks:
        try:
            check()
        except InvalidStructure as error:
            errors.append(error)
    if errors:
        kind = NarrowGap if any(isinstance(x, NarrowGap) for x in errors) else InvalidStructure
        faults = [fault for error in errors for fault in error.faults]
        raise kind(";\n  besides, ".join(map(str, errors)), faults)


def _check_contacts(
    touches: Sequence[Touch], names: Sequence[str], frame: Frame, least: float
) -> None:
    """Refuse contacts no longer than a length, of outlines that lie beside one another."""
    short = [touch for touch in touches if dist(*touch[2]) <= least]
    found = [("short contact", names[a], names[b], as_point(ends[0])) for a, b, ends in short]
    if not found:
        return
    _, one, other, start = found[0]
    raise InvalidStructure(
        f"'{one}' and '{other}' touch along {1e3 * dist(*short[0][2]):.3g} mm only at "
        f"{frame.place(start)}{say_others('the first', found, frame.place)}, within "
        f"{frame.length(least)} = {AMBIGUOUS_GAP_RATIO:g} times snap: join the corners there",
        found,
    )


def _edges(boundaries: Boundaries) -> Iterator[tuple[int, int, int]]:
    """Yield the boundary number and the two points of every edge."""
    for number, boundary in enumerate(boundaries):
        for a, b in zip(boundary, boundary[1:] + boundary[:1], strict=True):
            yield number, a, b


def _project(places: Array, a: int, b: int) -> tuple[Array, Array, float]:
    """Return coordinates of all places along and to the left of an edge, and its length [m]."""
    step = places[b] - places[a]
    length = float(np.linalg.norm(step))
    x, y = (places - places[a]).T
    return (x * step[0] + y * step[1]) / length, (step[0] * y - step[1] * x) / length, length


def _merge_vertices(outlines: Sequence[Array], snap: float) -> tuple[Array, Any]:
    """Return merged vertices, the places (n, 2) [m], and the place number of each vertex."""
    points = np.concatenate(outlines)
    tree = cKDTree(points)
    # pairs are counted before memory is taken for them; a few touch at each corner
    near = tree.count_neighbors(tree, snap) / len(points)
    if near > 100.0:
        raise InvalidStructure(
            f"snap = {snap:.3g} m would merge {near:.0f} vertices at each place on average: lower "
            "snap below the shortest side of a block; without a unit it is in metres"
        )
    pairs = [tree.query_pairs(snap, output_type="ndarray")]
    starts = np.cumsum([0, *map(len, outlines)])
    owner = np.repeat(np.arange(len(outlines)), [len(points) for points in outlines])
    vertices = [list(range(a, b)) for a, b in pairwise(starts)]
    for number, a, b in _edges(vertices):
        along, off, length = _project(points, a, b)
        near = (np.abs(off) <= snap) & (owner != number)
        # a vertex beside the end of an edge merges with that end, else it would make a sliver
        for end, away in ((a, along), (b, length - along)):
            others = np.flatnonzero(near & (away >= 0.0) & (away <= snap))
            pairs.append(np.column_stack([others, np.full(len(others), end)]))
    one, two = np.concatenate(pairs).T
    # chains of near vertices merge into their mean
    graph = sparse.coo_matrix((np.ones(len(one)), (one, two)), (len(points), len(points)))
    count, number = connected_components(graph, directed=False)
    sums = np.array([np.bincount(number, weights=x, minlength=count) for x in points.T])
    places = (sums / np.bincount(number)).T
    return places, number


def _find_ties(boundaries: Boundaries, places: Array, snap: float) -> dict[int, Edge]:
    """Return the places near edges of other outlines, each with its nearest such edge."""
    best: dict[int, tuple[float, Edge]] = {}
    for number, a, b in _edges(boundaries):
        along, off, length = _project(places, a, b)
        inside = (np.abs(off) <= snap) & (along > 0.0) & (along < length)
        for place in set(np.flatnonzero(inside).tolist()) - set(boundaries[number]):
            found = (float(abs(off[place])), (a, b))
            best[place] = min(best.get(place, found), found)
    return {place: edge for place, (_, edge) in best.items()}


def _find_bends(
    boundaries: Boundaries, places: Array, ties: dict[int, Edge], snap: float
) -> dict[int, Edge]:
    """Return the inner vertices of nearly straight joints, each with the ends of its joint."""
    on: dict[frozenset[int], list[int]] = {}
    for place, edge in ties.items():
        on.setdefault(frozenset(edge), []).append(place)
    # boundaries with the places tied to their edges
    whole: Boundaries = [[] for _ in boundaries]
    for number, a, b in _edges(boundaries):
        along = _project(places, a, b)[0]
        whole[number] += [a, *sorted(on.get(frozenset((a, b)), []), key=lambda n: along[n])]
    # a joint is a run of edges that one other boundary has in the opposite direction
    across = {(a, b): number for number, a, b in _edges(whole)}
    found: dict[int, Edge] = {}
    for boundary in whole:
        after = boundary[1:] + boundary[:1]
        beyond = [across.get((b, a), -1) for a, b in zip(boundary, after, strict=True)]
        # start where the neighbour changes, so that no joint is split by the start of the list
        turn = next((k for k in range(len(boundary)) if beyond[k] != beyond[k - 1]), 0)
        nodes, beyond = boundary[turn:] + boundary[:turn], beyond[turn:] + beyond[:turn]
        for other, run in groupby(range(len(boundary)), beyond.__getitem__):
            which = list(run)
            ends = nodes[which[0]], nodes[(which[-1] + 1) % len(nodes)]
            middle = [nodes[k] for k in which[1:]]
            if other >= 0 and middle and ends[0] != ends[1]:
                _, off, _ = _project(places, *ends)
                if np.abs(off[middle]).max() <= snap:
                    found |= {place: ends for place in middle if place not in ties}
    return found


def _place_tied(places: Array, ties: dict[int, Edge]) -> Array:
    """Move tied places onto their edges, whose ends may be tied in turn."""
    # rows of tied places: x = (1 - s) x_a + s x_b; one solve satisfies chains of ties
    hold = sparse.identity(len(places), format="lil")
    free = places.copy()
    for place, (a, b) in ties.items():
        along, _, length = _project(places, a, b)
        share = along[place] / length
        hold[place, a], hold[place, b] = share - 1.0, -share
        free[place] = 0.0
    return np.asarray(splu(hold.tocsc()).solve(free))


def _check_gaps(
    places: Array,
    boundaries: Boundaries,
    outlines: list[Outline],
    widest: float,
    chips: list[Chip],
) -> None:
    """Refuse blocks with a gap between their faces that is no wider than a length, but chips."""
    near = CONTACT_TOLERANCE * float(np.linalg.norm(np.ptp(places, axis=0)))
    polygons = [shapely.Polygon(places[boundary]) for boundary in boundaries]
    tree = shapely.STRtree(polygons)
    owners: dict[int, list[int]] = {}
    for number, boundary in enumerate(boundaries):
        for place in boundary:
            owners.setdefault(place, []).append(number)
    found: dict[frozenset[int], tuple[float, int]] = {}  # the widest gap of each pair
    for number, a, b in _edges(boundaries):
        along, off, length = _project(places, a, b)
        beside = (off < -near) & (off >= -widest)
        beside &= (along > -near) & (along < length + near)
        for place in set(np.flatnonzero(beside).tolist()) - set(boundaries[number]):
            foot = places[a] + along[place] / length * (places[b] - places[a])
            middle = shapely.Point(0.5 * (foot + places[place]))
            pairs = [{number, owner} for owner in owners[place]]
            is_chip = any(
                {each.stone, each.other} in pairs and each.holds(foot, places[place])
                for each in chips
            )
            # a gap filled by a third block is none
            if not is_chip and not len(tree.query(middle, predicate="within")):
                pair, gap = frozenset((number, owners[place][0])), (float(-off[place]), place)
                found[pair] = max(found.get(pair, gap), gap)
    if not found:
        return
    gaps = sorted(((gap, sorted(pair)) for pair, gap in found.items()), reverse=True)
    faults = [
        ("gap", outlines[one].name, outlines[other].name, as_point(places[place]))
        for (_, place), (one, other) in gaps
    ]
    (_, one_name, other_name, point), frame = faults[0], outlines[0].frame
    raise NarrowGap(
        f"the faces of '{one_name}' and '{other_name}' are {1e3 * gaps[0][0][0]:.3g} mm apart at "
        f"{frame.place(point)}{say_others('the widest', faults, frame.place)}, within "
        f"{frame.length(widest)} = {AMBIGUOUS_GAP_RATIO:g} times snap, taken for an error of the "
        "survey: draw faces that touch",
        faults,
    )
