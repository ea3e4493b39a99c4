"""One conforming mesh of all blocks: cell tags are blocks, facet tags are joints.

Blocks share their nodes along joints; `space` breaks the displacement there. Tags are numbers
of blocks and joints plus one, since gmsh counts from one, and every group carries its name.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import gmsh
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from archfem import _fenicsx
from archfem.errors import InvalidInput, MeshError
from archfem.structure import TOUCHING, Array, Block, Structure

Segment = tuple[int, int]
CELLS = ("quadrilateral", "triangle")


@dataclass(frozen=True)
class Meshing:
    """How finely blocks are cut into cells.

    Attributes:
        through: cells through the thickness, so facets on a joint.
        along: cells along each block; a sector's faces get as many chords. A polygon's face made
            of several chords needs at least one cell to each.
        cell: "quadrilateral" or "triangle".
    """

    through: int = 4
    along: int = 4
    cell: str = "quadrilateral"

    def __post_init__(self) -> None:
        """Refuse impossible settings."""
        for key in ("through", "along"):
            count = getattr(self, key)
            if not (isinstance(count, int | np.integer) and 1 <= count <= 1000):
                raise InvalidInput(f"cells {key} = {count!r}: give a whole number, 1 to 1000")
        if self.cell not in CELLS:
            raise InvalidInput(f"cell '{self.cell}' is not known: use one of {CELLS}")


@dataclass(frozen=True, eq=False)
class Mesh:
    """A structure's mesh.

    Attributes:
        structure: what was meshed.
        grid: the DOLFINx mesh.
        blocks: number of each cell's block (n_cells,).
        joints: facets (f,) and numbers (f,) of their joints.
    """

    structure: Structure
    grid: Any
    blocks: NDArray[np.int32]
    joints: tuple[NDArray[np.int32], NDArray[np.int32]]


def mesh(structure: Structure, meshing: Meshing | None = None) -> Mesh:
    """Mesh a structure.

    Raises:
        MeshError: the blocks cannot be cut conformingly as asked.
    """
    with _model(structure.name):
        _generate(structure, meshing or Meshing())
        return _imported(structure)


def write_mesh(structure: Structure, path: str | Path, meshing: Meshing | None = None) -> None:
    """Mesh a structure and write a gmsh file (.msh) with named physical groups."""
    with _model(structure.name):
        _generate(structure, meshing or Meshing())
        gmsh.write(str(path))


def read_mesh(structure: Structure, path: str | Path) -> Mesh:
    """Read the mesh of a structure from a gmsh file with the same groups as `write_mesh` makes.

    Raises:
        InvalidInput: there is no such file.
        MeshError: its groups are not the structure's blocks and joints.
    """
    if not Path(path).is_file():
        raise InvalidInput(f"there is no mesh file {path}: write it with write_mesh")
    with _model(structure.name):
        try:
            gmsh.merge(str(path))
        except Exception as error:  # gmsh raises nothing more specific
            raise MeshError(f"{path} is not a gmsh mesh: {error}") from error
        return _imported(structure)


@contextmanager
def _model(name: str) -> Iterator[None]:
    """A fresh, silent gmsh model, gone afterwards."""
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add(name)
        yield
    finally:
        gmsh.finalize()


def _generate(structure: Structure, meshing: Meshing) -> None:
    """Build geometry and mesh of all blocks in the current gmsh model."""
    outlines, points = _shared_outlines(structure, meshing)
    counts = _cells_on_segments(structure, outlines, points, meshing)
    geo = gmsh.model.geo
    corners = [geo.addPoint(x, y, 0.0) for x, y in points]
    lines = {s: geo.addLine(corners[s[0]], corners[s[1]]) for s in counts}
    for segment, count in counts.items():
        geo.mesh.setTransfiniteCurve(lines[segment], count + 1)
    for number, (block, outline) in enumerate(zip(structure.blocks, outlines, strict=True)):
        loop = [
            lines[key] if (a, b) == key else -lines[key]
            for a, b in zip(outline, np.roll(outline, -1), strict=True)
            for key in [(min(a, b), max(a, b))]
        ]
        surface = geo.addPlaneSurface([geo.addCurveLoop(loop)], number + 1)
        if block.corners is not None:
            ends = [corners[p] for p in _corner_points(block, points)]
            geo.mesh.setTransfiniteSurface(surface, "Alternate", ends)
        if meshing.cell == "quadrilateral":
            geo.mesh.setRecombine(2, surface)
        gmsh.model.addPhysicalGroup(2, [surface], number + 1, block.name)
    for number, segments in enumerate(_joint_segments(structure, outlines, points)):
        name = structure.joints[number].name
        gmsh.model.addPhysicalGroup(1, [lines[s] for s in segments], number + 1, name)
    geo.synchronize()
    gmsh.model.mesh.generate(2)


def _shared_outlines(
    structure: Structure, meshing: Meshing
) -> tuple[list[NDArray[np.intp]], Array]:
    """Outlines as numbers of points that touching blocks share, and those points."""
    near = TOUCHING * structure.size
    drawn = [block.drawn(_along(block, meshing)) for block in structure.blocks]
    every = np.concatenate(drawn)
    first = np.array([min(group) for group in cKDTree(every).query_ball_point(every, near)])
    kept, number = np.unique(first, return_inverse=True)
    points = every[kept]
    starts = np.cumsum([0, *map(len, drawn)])
    outlines = [
        _with_points_on_edges(number[start : start + len(own)], points, near)
        for start, own in zip(starts, drawn, strict=False)
    ]
    return outlines, points


def _with_points_on_edges(
    outline: NDArray[np.intp], points: Array, near: float
) -> NDArray[np.intp]:
    """Insert points of other blocks that lie on an outline's edges."""
    result: list[int] = []
    for a, b in zip(outline, np.roll(outline, -1), strict=True):
        edge = points[b] - points[a]
        length = np.linalg.norm(edge)
        along = (points - points[a]) @ edge / length
        off = np.abs((points - points[a]) @ np.array([-edge[1], edge[0]]) / length)
        inside = np.flatnonzero((off <= near) & (along > near) & (along < length - near))
        result += [a, *inside[np.argsort(along[inside])]]
    return np.array(result)


def _along(block: Block, meshing: Meshing) -> int:
    """Cells along a block; an abutment, which does not deform, has one."""
    return 1 if block.fixed else meshing.along


def _corner_points(block: Block, points: Array) -> list[int]:
    """Numbers of the points at the four corners of a block."""
    assert block.corners is not None
    corners = block.points[list(block.corners)]
    return [int(np.argmin(np.sum((points - corner) ** 2, axis=1))) for corner in corners]


def _cells_on_segments(
    structure: Structure, outlines: list[NDArray[np.intp]], points: Array, meshing: Meshing
) -> dict[Segment, int]:
    """Number of cells on each segment between two points."""
    counts: dict[Segment, int] = {}
    for block, outline in zip(structure.blocks, outlines, strict=True):
        wanted = (_along(block, meshing), meshing.through)
        for side, segments in enumerate(_sides(block, outline, points)):
            lengths = np.array([np.linalg.norm(points[b] - points[a]) for a, b in segments])
            if block.corners is None:
                size = min(joint.depth for joint in structure.joints) / meshing.through
                shares = np.ceil(lengths / size - 1e-9).astype(int)
            else:
                shares = _shares(lengths, wanted[side % 2], block)
            for (a, b), share in zip(segments, shares, strict=True):
                key = (min(a, b), max(a, b))
                if block.corners is None and key in counts:
                    continue
                if counts.setdefault(key, int(share)) != share:
                    raise MeshError(
                        f"block '{block.name}' wants {share} cells where a neighbour has "
                        f"{counts[key]}: give as many cells along as through the thickness"
                    )
    return counts


def _sides(block: Block, outline: NDArray[np.intp], points: Array) -> list[list[Segment]]:
    """Segments of an outline by side: four from corner to corner, or all as one."""
    if block.corners is None:
        return [list(zip(outline, np.roll(outline, -1), strict=True))]
    starts = [int(np.flatnonzero(outline == p)[0]) for p in _corner_points(block, points)]
    turned = np.roll(outline, -starts[0])
    ends = [(start - starts[0]) % len(outline) for start in starts] + [len(outline)]
    closed = np.append(turned, turned[0])
    return [list(zip(closed[a:b], closed[a + 1 : b + 1], strict=True)) for a, b in pairwise(ends)]


def _shares(lengths: Array, cells: int, block: Block) -> NDArray[np.intp]:
    """Deal a side's cells to its segments, in proportion to their lengths."""
    if cells < len(lengths):
        raise MeshError(
            f"a side of block '{block.name}' has {len(lengths)} pieces but only {cells} cells: "
            "give at least one cell a piece"
        )
    ends = np.round(np.cumsum(lengths) / lengths.sum() * cells).astype(int)
    shares = np.diff(ends, prepend=0)
    if shares.min() < 1:
        raise MeshError(
            f"a side of block '{block.name}' has pieces of very different length: give more cells"
        )
    return shares


def _joint_segments(
    structure: Structure, outlines: list[NDArray[np.intp]], points: Array
) -> list[list[Segment]]:
    """Segments on each joint: those that both its blocks have, between its ends."""
    own = [
        {(min(a, b), max(a, b)) for a, b in zip(line, np.roll(line, -1), strict=True)}
        for line in outlines
    ]
    near = TOUCHING * structure.size
    found = []
    for joint in structure.joints:
        segments = []
        for a, b in own[joint.lower] & own[joint.higher]:
            relative = points[[a, b]] - joint.ends[0]
            along = relative @ joint.tangent
            off = relative - along[:, None] * joint.tangent
            if np.all(np.abs(off) <= near) and np.all(
                (along > -near) & (along < joint.depth + near)
            ):
                segments.append((a, b))
        found.append(segments)
    return found


def _imported(structure: Structure) -> Mesh:
    """The current gmsh model as a checked mesh."""
    grid, cells, facets = _fenicsx.mesh_from_gmsh(gmsh.model)
    count = grid.topology.index_map(2).size_local
    blocks = np.full(count, -1, dtype=np.int32)
    blocks[cells.indices] = cells.values - 1
    result = Mesh(structure, grid, blocks, (facets.indices, facets.values - 1))
    _check(result)
    return result


def _check(mesh: Mesh) -> None:
    """Every cell in a block; every joint facet between the two right blocks, whole joints."""
    structure = mesh.structure
    found = set(mesh.blocks.tolist())
    if found != set(range(len(structure.blocks))):
        raise MeshError(
            f"the mesh has block numbers {sorted(found)}, the structure 0 to "
            f"{len(structure.blocks) - 1}: the mesh is of another structure"
        )
    x = mesh.grid.geometry.x
    cells_at, nodes_of = _fenicsx.connect(mesh.grid, 1, 2), _facet_points(mesh.grid)
    covered = np.zeros(len(structure.joints))
    for facet, number in zip(*mesh.joints, strict=True):
        if not 0 <= number < len(structure.joints):
            raise MeshError(f"the mesh has a joint number {number} that the structure has not")
        joint = structure.joints[number]
        sides = sorted(int(mesh.blocks[cell]) for cell in cells_at(facet))
        if sides != [joint.lower, joint.higher]:
            raise MeshError(
                f"a facet of joint '{joint.name}' lies between blocks {sides}, not "
                f"{[joint.lower, joint.higher]}: the mesh is of another structure"
            )
        ends = x[nodes_of(facet)][:, :2]
        covered[number] += np.linalg.norm(ends[1] - ends[0])
    depth = np.array([joint.depth for joint in structure.joints])
    wrong = np.flatnonzero(np.abs(covered - depth) > 4.0 * TOUCHING * structure.size)
    if len(wrong):
        joint = structure.joints[wrong[0]]
        raise MeshError(
            f"joint '{joint.name}' is {joint.depth:.6g} m deep but its facets cover "
            f"{covered[wrong[0]]:.6g} m: the mesh is of another structure"
        )


def _facet_points(grid: Any) -> Any:
    """A function from a facet to the numbers of its two mesh points."""
    vertices = _fenicsx.connect(grid, 1, 0)
    corner = _fenicsx.points_of_vertices(grid)
    return lambda facet: corner[vertices(facet)]
