"""A user's own polygons: the outlines of a survey as blocks."""

import json
import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from archfem._typing import Array
from archfem._validation import validate_arguments
from archfem.errors import InvalidInput, InvalidStructure
from archfem.masonry.assembly import assembled, by_materials, touching
from archfem.masonry.block import Block
from archfem.masonry.materials import (
    MATERIAL_PRESETS,
    SOIL_TO_STONE,
    STONE,
    STONE_TO_STONE,
    Contact,
    Material,
)
from archfem.masonry.parts import Direction, assign_roles, find_directions
from archfem.masonry.structure import CONTACT_TOLERANCE, Structure
from archfem.masonry.survey.drawings import Outline, outlines_in, physical_curves
from archfem.masonry.survey.snapping import NEARLY, snapped
from archfem.units import G, in_unit

# A vertex that turns by more than the one is a corner, by less than the other none
SHARP, FLAT = np.radians(45.0), np.radians(10.0)

# How the presets of two materials touch
STONE_AND_SOIL = {"stone/backfill": SOIL_TO_STONE}

logger = logging.getLogger("archfem")


@dataclass(frozen=True, kw_only=True)
class Layer:
    """What the outlines on one layer of a drawing are (GeoJSON: of one part).

    Attributes:
        part: of the structure; by default the layer's own name.
        role: of the part, "ring", "pier" or "other"; by default as its name says (`infer_role`).
        material: its name; by default that of the whole survey.
        fixed: whether they are abutments or foundations.
        ignore: whether they are none at all.
    """

    part: str | None = None
    role: str | None = None
    material: str | None = None
    fixed: bool = False
    ignore: bool = False


@dataclass(frozen=True, eq=False)
class Survey:
    """Blocks of a survey, touching exactly.

    Attributes:
        blocks: in the order of the file.
        moved: largest movement of a vertex that this took [m].
    """

    blocks: tuple[Block, ...]
    moved: float


@validate_arguments
def read_outlines(
    path: str | Path,
    *,
    unit: str | None = None,
    snap: float = 1e-3,
    layers: Mapping[str, Layer] | None = None,
    material: Material = STONE,
    materials: Mapping[str, Material] = MATERIAL_PRESETS,
) -> Survey:
    """Return the blocks that a drawing outlines, made to touch.

    Four-sided blocks get corners, so that their meshes are structured; through the thickness lie
    the sides across a ring or a pier, otherwise the shorter ones.

    Args:
        path: a GeoJSON or DXF file or a mesh of gmsh (see `outlines_in`), y upwards.
        unit: of its coordinates; by default what a DXF file says, metres in GeoJSON.
        snap: vertices and edges nearer than this are made to touch [m].
        layers: what is on the layers of the drawing. Where they are given, all must be. What a
            GeoJSON feature says itself of role, material and fixed comes first.
        material: of blocks of which neither feature nor layer says one.
        materials: by name.

    Raises:
        InvalidInput: the file is none, or says what is not known.
        InvalidStructure: the outlines overlap, leave gaps or do not bound blocks; or roles are
            not known or contradict one another.
    """
    known = layers or {}
    ignored = [name for name, layer in known.items() if layer.ignore]
    outlines = outlines_in(path, unit, ignored)
    if layers is not None:
        _check_layers(outlines, layers, path)
    try:
        names = [outline.name for outline in outlines]
        points, moved = snapped([outline.points for outline in outlines], names, snap)
        blocks = [
            _block(outline, own, known.get(outline.layer, Layer()), material, materials)
            for outline, own in zip(outlines, points, strict=True)
        ]
        survey = Survey(_cornered(assign_roles(blocks), snap), moved)
    except (InvalidInput, InvalidStructure) as error:
        raise type(error)(f"{path}: {error}") from error
    logger.info("%s: vertices moved by up to %.3g mm", path, 1e3 * moved)
    return survey


def surveyed(  # noqa: PLR0913  (the drawing, and what its blocks are and how they touch)
    path: str | Path,
    *,
    unit: str | None = None,
    snap: float = 1e-3,
    layers: Mapping[str, Layer] | None = None,
    material: Material = STONE,
    materials: Mapping[str, Material] = MATERIAL_PRESETS,
    contact: Contact = STONE_TO_STONE,
    contacts: Mapping[str, Contact] = STONE_AND_SOIL,
    width: float = 1.0,
    gravity: float = G,
) -> Structure:
    """Return a structure of the outlines in a drawing.

    Args:
        path: as for `read_outlines`.
        unit: likewise.
        snap: likewise [m].
        layers: likewise.
        material: likewise.
        materials: likewise.
        contact: of blocks of one material.
        contacts: of blocks of two materials, "stone/backfill".
        width: out of plane [m].
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidInput: as `read_outlines`; or nothing is said of how two materials touch.
        InvalidStructure: likewise; or the blocks do not hang together.
    """
    survey = read_outlines(
        path, unit=unit, snap=snap, layers=layers, material=material, materials=materials
    )
    structure = assembled(
        survey.blocks,
        by_materials(contact, contacts),
        width=width,
        gravity=gravity,
        name=Path(path).stem,
    )
    return (
        _named_by_curves(structure, Path(path), unit) if Path(path).suffix == ".msh" else structure
    )


def _named_by_curves(structure: Structure, path: Path, unit: str | None) -> Structure:
    """The same with each joint named as the physical curve along it, if there is one."""
    near, names = CONTACT_TOLERANCE * structure.size, dict[int, str]()
    for name, middles in physical_curves(path, in_unit(f"1 {unit or 'm'}", "m", "unit")):
        away = middles[None] - structure.middles[:, None]
        along = np.abs(np.einsum("jpk,jk->jp", away, structure.tangents))
        beside = np.abs(np.einsum("jpk,jk->jp", away, structure.normals))
        on = np.all((beside < near) & (along < structure.depths[:, None] / 2.0), axis=1)
        names |= {int(number): name for number in np.flatnonzero(on)}
    joints = tuple(
        replace(joint, name=names.get(number, joint.name))
        for number, joint in enumerate(structure.joints)
    )
    return replace(structure, joints=joints)


def _check_layers(outlines: list[Outline], layers: Mapping[str, Layer], path: str | Path) -> None:
    """Refuse layers of the file that are not told, and layers told that are not in the file."""
    there = {outline.layer for outline in outlines}
    if strange := sorted(there - set(layers)):
        raise InvalidInput(
            f"{path}: of layer '{strange[0]}' nothing is said: name its part, or ignore it"
        )
    told = {name for name, layer in layers.items() if not layer.ignore}
    if missing := sorted(told - there):
        raise InvalidInput(
            f"{path} has no outlines on layer '{missing[0]}': its layers are {sorted(there)}"
        )


def _block(
    outline: Outline,
    points: Array,
    layer: Layer,
    material: Material,
    materials: Mapping[str, Material],
) -> Block:
    """A block with what its outline and its layer say."""
    name = outline.material or layer.material
    if name is not None and name not in materials:
        raise InvalidInput(
            f"'{outline.name}' is of '{name}', which is not among the materials "
            f"{sorted(materials)}: name one of them"
        )
    return Block(
        tuple((float(x), float(y)) for x, y in points),
        material if name is None else materials[name],
        outline.name,
        layer.fixed if outline.fixed is None else bool(outline.fixed),
        part=outline.layer if layer.part is None else layer.part,
        role=outline.role or layer.role or "",
    )


def _cornered(blocks: Sequence[Block], snap: float) -> tuple[Block, ...]:
    """Blocks with corners where they are four-sided; none may only just touch."""
    touches = touching(blocks)
    for a, b, line in touches:
        length = float(np.linalg.norm(line[1] - line[0]))
        if length <= NEARLY * snap:
            raise InvalidStructure(
                f"'{blocks[a].name}' and '{blocks[b].name}' touch along {1e3 * length:.3g} mm "
                f"only at ({line[0, 0]:.3f}, {line[0, 1]:.3f}): raise snap = {snap:.3g} m above "
                "that, or correct the drawing"
            )
    ways = find_directions(blocks, touches)
    return tuple(replace(each, corners=_corners(each, ways.get(each.part))) for each in blocks)


def _corners(block: Block, way: Direction | None) -> tuple[int, int, int, int] | None:
    """Four clear corners, the first and third side along the row or else the longer, or None."""
    steps = np.roll(block.points, -1, axis=0) - block.points
    before = np.roll(steps, 1, axis=0)
    turns = np.arctan2(
        before[:, 0] * steps[:, 1] - before[:, 1] * steps[:, 0], np.sum(before * steps, axis=1)
    )
    found = np.flatnonzero(turns > SHARP)
    if len(found) != 4 or np.any(np.abs(np.delete(turns, found)) > FLAT):
        return None
    corners = block.points[found]
    sides = np.roll(corners, -1, axis=0) - corners
    if way is None:
        measure = np.linalg.norm(sides, axis=1)
    else:
        measure = -np.abs(sides @ way.outward(block.centroid)) / np.linalg.norm(sides, axis=1)
    first = int(measure[1] + measure[3] > measure[0] + measure[2])
    a, b, c, d = (int(n) for n in np.roll(found, -first))
    return a, b, c, d


def write_outlines(structure: Structure, path: str | Path) -> None:
    """Write the blocks of a structure as GeoJSON that `read_outlines` reads.

    Arcs become chords. Coordinates are metres in the plane, not degrees.

    Args:
        structure: whose blocks are written, with their parts, roles and names of materials.
        path: of the file.
    """
    features = []
    for block in structure.blocks:
        ring = block.drawn().tolist()
        told = {
            "name": block.name,
            "part": block.part,
            "role": block.role,
            "material": block.material.name,
            "fixed": block.fixed,
        }
        geometry = {"type": "Polygon", "coordinates": [[*ring, ring[0]]]}
        features.append({"type": "Feature", "properties": told, "geometry": geometry})
    lines = ",\n".join(json.dumps(feature, ensure_ascii=False) for feature in features)
    text = f'{{"type": "FeatureCollection", "features": [\n{lines}\n]}}\n'
    Path(path).write_text(text, encoding="utf-8")
