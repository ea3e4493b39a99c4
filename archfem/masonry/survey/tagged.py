"""A user's own mesh of gmsh (.msh) as outlines: what lies in one physical surface is one block.

The file is read by meshio: nothing in it is executed.
"""

import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from archfem.arrays import Array
from archfem.errors import InvalidInput

STRAIGHT = 1e-9
"""Sine of the turn below which a vertex lies on a straight edge."""

CORNERS = {"triangle": 3, "triangle6": 3, "quad": 4, "quad8": 4, "quad9": 4}
"""Cells that make blocks, and how many of their points are corners."""

CURVES = {"line", "line3"}
"""Cells that make physical curves."""


def physical_surfaces(path: Path, factor: float = 1.0) -> list[tuple[str, Array]]:
    """Return the name and the outline of each physical surface, in the order of their tags.

    Args:
        path: a mesh file of gmsh.
        factor: metres in a unit of the file.

    Raises:
        InvalidInput: it is no such mesh, does not lie in the plane, or a surface is in pieces or
            has a hole.
    """
    mesh = _mesh(path)
    names = _names(mesh, 2)
    points = _plane(mesh.points) * factor
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
    """Return the name and the middles of the edges of each named physical curve, each (n, 2) [m].

    Args:
        path: a mesh file of gmsh.
        factor: metres in a unit of the file.

    Raises:
        InvalidInput: it is no such mesh.
    """
    mesh = _mesh(path)
    names, points = _names(mesh, 1), mesh.points[:, :2] * factor
    found: dict[str, list[Array]] = {}
    for cells, tags in _tagged(mesh, CURVES):
        for edge, tag in zip(cells.data[:, :2], tags, strict=True):
            if int(tag) in names:
                found.setdefault(names[int(tag)], []).append(points[edge].mean(axis=0))
    return [(name, np.array(middles)) for name, middles in found.items()]


def part_of(name: str) -> str:
    """Return the part that a block belongs to by its name: up to a comma, or without its number.

    Args:
        name: of the block, e.g. "north arch, voussoir 3" or "voussoir 3".
    """
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


def _plane(points: Array) -> Array:
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
