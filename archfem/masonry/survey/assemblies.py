"""Plane assemblies of compas_assembly and compas_dem (JSON): outlines of blocks, also of IFC.

Blocks are polyhedra, z upwards. Where all of them have the same extent along x or along y, and two
equal faces across it, the assembly is plane: these faces are its elevation.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from archfem._typing import Array
from archfem._validation import short_repr
from archfem.errors import InvalidInput
from archfem.masonry.block import trace_boundary

# Deviation from a plane over the size of an assembly, as by single precision and meshes of CAD [-]
FLATNESS = 1e-4


@dataclass(frozen=True, eq=False)
class Polyhedron:
    """A block of an assembly."""

    name: str
    points: Array  # vertices (n, 3), in units of the file
    faces: list[list[int]]  # vertices of each face, around it
    fixed: bool


def is_assembly(found: Any) -> bool:
    """Return whether a JSON document is an assembly of compas."""
    if not isinstance(found, dict):
        return False
    kind = str(found.get("dtype", ""))
    return kind.startswith(("compas_assembly", "compas_dem")) or {"assembly", "blocks"} <= {*found}


def read_plane_assembly(found: dict[str, Any]) -> Iterator[tuple[str, Array, bool]]:
    """Yield name, outline (n, 2) in units of the file, and whether it is a support, by block."""
    blocks = [_read_block(*each) for each in _find_meshes(found)]
    if not blocks:
        raise InvalidInput("it has no blocks with vertices and faces: export the whole assembly")
    for block, outline in zip(blocks, trace_elevation(blocks), strict=True):
        yield block.name, outline, block.fixed


def trace_elevation(blocks: list[Polyhedron]) -> list[Array]:
    """Return the outlines (n, 2) of prisms of one width across x or y, in units of the file."""
    points = np.concatenate([block.points for block in blocks])
    near = FLATNESS * float(np.ptp(points, axis=0).max())
    uneven = []
    for across, along in ((1, 0), (0, 1)):
        ends = points[:, across].min(), points[:, across].max()
        outlines = [_trace_front(block, across, ends, near) for block in blocks]
        if all(outline is not None for outline in outlines):
            pairs = zip(blocks, outlines, strict=True)
            return [block.points[outline or []][:, [along, 2]] for block, outline in pairs]
        uneven.append(blocks[outlines.index(None)].name)
    raise InvalidInput(
        f"it is not plane: across y '{uneven[0]}' and across x '{uneven[1]}' have not the width of "
        "all blocks, with two equal faces: give an assembly that is an elevation with one width"
    )


def _find_meshes(found: dict[str, Any]) -> Iterator[tuple[str, Any, Any, bool]]:
    """Yield name, mesh, transformation and support flag of the blocks, in any of three layouts."""
    try:
        if "assembly" in found:  # before compas 1: nodes and meshes apart
            nodes = found["assembly"]["vertex"]
            for key, mesh in found["blocks"].items():
                yield f"block {key}", mesh, None, nodes[key].get("is_support") is True
        elif "graph" in found["data"] and "elements" not in found["data"]:
            for key, node in found["data"]["graph"]["data"]["node"].items():
                mesh = node["block"]["data"]
                yield f"block {key}", mesh, None, node.get("is_support") is True
        else:
            for number, element in enumerate(found["data"]["elements"].values()):
                data = element["data"]
                mesh, fixed = data["geometry"]["data"], data.get("is_support") is True
                yield f"block {number}", mesh, data.get("transformation"), fixed
    except (AttributeError, KeyError, TypeError) as error:
        raise InvalidInput(
            "it is no assembly as compas_assembly or compas_dem writes it: "
            f"{short_repr(str(error))} is missing or of another kind"
        ) from error


def _read_block(name: str, mesh: Any, transformation: Any, fixed: bool) -> Polyhedron:
    """Return a block from the data of a compas mesh."""
    try:
        vertices = {str(key): [v["x"], v["y"], v["z"]] for key, v in mesh["vertex"].items()}
        places = {key: number for number, key in enumerate(vertices)}
        faces = [[places[str(key)] for key in face] for face in mesh["face"].values()]
        points = np.array(list(vertices.values()), dtype=float).reshape(-1, 3)
        if transformation is not None:
            matrix = np.array(transformation["data"]["matrix"], dtype=float)
            points = points @ matrix[:3, :3].T + matrix[:3, 3]
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        raise InvalidInput(f"'{name}' is no mesh of compas: {short_repr(str(error))}") from error
    if len(points) < 6 or not np.isfinite(points).all():
        raise InvalidInput(f"'{name}' has {len(points)} finite vertices: a block has at least 6")
    return Polyhedron(name, points, faces, fixed)


def _trace_front(
    block: Polyhedron, across: int, ends: tuple[float, float], near: float
) -> list[int] | None:
    """Return the vertices around the face at the lower end of a prism, or None for other blocks."""
    depth = block.points[:, across]
    front, back = np.abs(depth - ends[0]) < near, np.abs(depth - ends[1]) < near
    if not (front | back).all() or front.sum() != back.sum():
        return None
    plane = np.delete(block.points, across, axis=1)
    away = np.linalg.norm(plane[front][:, None] - plane[back][None], axis=2)
    if away.min(axis=1).max() > near:
        return None
    # the edges of the front that only one of its faces has
    outline = trace_boundary([face for face in block.faces if front[face].all()])
    return outline if len(outline) == front.sum() else None
