"""One conforming mesh of all blocks: cell tags are blocks, facet tags are joints.

Blocks share their nodes along joints; `space` breaks the displacement there. Tags are numbers
of blocks and joints plus one, since gmsh counts from one, and every group carries its name.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from archfem.errors import InvalidInput, MeshError
from archfem.masonry.structure import TOUCHING, Structure
from archfem.models.discretisation import Discretisation
from archfem.models.fem import _fenicsx
from archfem.models.fem.division import Division, divided
from archfem.packages import needed

with needed("gmsh"):
    import gmsh

FRONTAL = 6
"""Gmsh's number for the frontal Delaunay algorithm."""

MESH = b"$MeshFormat"
"""How a file of gmsh begins that is a mesh; anything else gmsh may read as a script."""

FULL_QUAD = 3
"""Gmsh's number for recombination that leaves no triangle: it splits a mesh twice as coarse."""


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


def mesh(structure: Structure, asked: Discretisation | None = None) -> Mesh:
    """Mesh a structure.

    Args:
        structure: what to mesh.
        asked: number and kind of cells; by default the usual ones.

    Returns:
        The mesh.

    Raises:
        MeshError: the blocks cannot be cut conformingly as asked.
    """
    with _model(structure.name):
        _generate(structure, asked or Discretisation())
        return _imported(structure)


def write_mesh(structure: Structure, path: str | Path, asked: Discretisation | None = None) -> None:
    """Mesh a structure and write a gmsh file with named physical groups.

    Args:
        structure: what to mesh.
        path: of the file, *.msh.
        asked: number and kind of cells; by default the usual ones.

    Raises:
        MeshError: the blocks cannot be cut conformingly as asked.
    """
    with _model(structure.name):
        _generate(structure, asked or Discretisation())
        gmsh.write(str(path))


def read_mesh(structure: Structure, path: str | Path) -> Mesh:
    """Read the mesh of a structure from a gmsh file, of `write_mesh` or of one's own.

    Cells belong to the block whose name their physical surface bears; without a name to the block
    of its tag less one. Facets between two blocks belong to the joint that they lie on, whatever
    their physical curves; blocks must share their nodes there.

    Args:
        structure: what was meshed.
        path: of the file.

    Returns:
        The mesh.

    Raises:
        InvalidInput: there is no such file.
        MeshError: it is no mesh, or its groups are not the structure's blocks and joints.
    """
    if not Path(path).is_file():
        raise InvalidInput(f"there is no mesh file {path}: write it with write_mesh")
    given = Path(path).read_bytes()
    if not given.startswith(MESH):
        raise MeshError(
            f"{path} does not begin with {MESH.decode()}: gmsh would run it as a script, commands "
            "of the shell and all; give a mesh as gmsh saves it"
        )
    with _model(structure.name), TemporaryDirectory() as alone:
        mesh_only = Path(alone) / "mesh.msh"  # without options beside it, which gmsh runs too
        mesh_only.write_bytes(given)
        try:
            gmsh.merge(str(mesh_only))
            return _own(structure)
        except MeshError:
            raise
        except Exception as error:  # neither gmsh nor FEniCSx raise anything more specific
            raise MeshError(f"{path} is not a gmsh mesh of it: {error}") from error


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


def _generate(structure: Structure, asked: Discretisation) -> None:
    """Build geometry and mesh of all blocks in the current gmsh model."""
    division = divided(structure, asked)
    edges = division.edges
    geo = gmsh.model.geo
    corners = [geo.addPoint(x, y, 0.0) for x, y in edges.points]
    pieces = [_pieces(division, edge, corners) for edge in range(len(edges.ends))]
    for number, block in enumerate(structure.blocks):
        loop = [
            line
            for start, edge in zip(edges.boundaries[number], edges.around[number], strict=True)
            for line in _run(pieces[edge], start == edges.ends[edge, 0])
        ]
        surface = geo.addPlaneSurface([geo.addCurveLoop(loop)], number + 1)
        if block.corners is not None:
            ends = [corners[point] for point in edges.corners(number)]
            geo.mesh.setTransfiniteSurface(surface, "Alternate", ends)
        if asked.cell == "quadrilateral":
            geo.mesh.setRecombine(2, surface)
        gmsh.model.addPhysicalGroup(2, [surface], number + 1, block.name)
    for number, (joint, shared) in enumerate(zip(structure.joints, edges.joints, strict=True)):
        lines = [line for edge in shared for line in pieces[edge]]
        gmsh.model.addPhysicalGroup(1, lines, number + 1, joint.name)
    geo.synchronize()
    _fill(division)


def _pieces(division: Division, edge: int, corners: list[int]) -> list[int]:
    """Lines along an edge, of as many cells each as its number is a multiple of."""
    geo = gmsh.model.geo
    unit = int(division.units[edge])
    first, last = division.edges.ends[edge]
    start, end = division.edges.points[[first, last]]
    inner = division.stations[edge][unit:-unit:unit, None]
    points = [geo.addPoint(x, y, 0.0) for x, y in start + (end - start) * inner]
    lines = [geo.addLine(a, b) for a, b in pairwise([corners[first], *points, corners[last]])]
    for line in lines:
        geo.mesh.setTransfiniteCurve(line, unit + 1)
    return lines


def _run(lines: list[int], forward: bool) -> list[int]:
    """Lines along an edge, or back along it."""
    return lines if forward else [-line for line in reversed(lines)]


def _fill(division: Division) -> None:
    """Mesh the blocks, those without corners with cells of their sizes."""

    def size(dimension: int, tag: int, x: float, y: float, z: float, given: float) -> float:
        own = division.sizes.get(tag - 1) if dimension == 2 else None
        return given if own is None else float(own.at(np.array([x, y])))

    if division.sizes:
        gmsh.option.setNumber("Mesh.RecombinationAlgorithm", FULL_QUAD)
    gmsh.option.setNumber("Mesh.Algorithm", FRONTAL)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
    gmsh.model.mesh.setSizeCallback(size)
    failure = ""
    try:
        gmsh.model.mesh.generate(2)
    except Exception as error:  # gmsh raises nothing more specific
        failure = f": {error}"
    for number, block in enumerate(division.edges.structure.blocks):
        kinds = gmsh.model.mesh.getElementTypes(2, number + 1)
        if not len(kinds):
            raise MeshError(
                f"gmsh cannot mesh block '{block.name}'{failure}: check that its outline crosses "
                "neither itself nor another's"
            )
        if len(kinds) > 1:
            raise MeshError(
                f"triangles are left among the quadrilaterals of block '{block.name}', and a mesh "
                "has one kind of cell: use cell = 'triangle'"
            )


def _imported(structure: Structure) -> Mesh:
    """The current gmsh model as a checked mesh."""
    grid, cells, facets = _fenicsx.mesh_from_gmsh(gmsh.model)
    count = grid.topology.index_map(2).size_local
    blocks = np.full(count, -1, dtype=np.int32)
    blocks[cells.indices] = cells.values - 1
    result = Mesh(structure, grid, blocks, (facets.indices, facets.values - 1))
    _check(result)
    return result


def _own(structure: Structure) -> Mesh:
    """The current gmsh model, whose groups are a user's own, as a checked mesh."""
    numbers = {block.name: number for number, block in enumerate(structure.blocks)}
    groups = [int(tag) for _, tag in gmsh.model.getPhysicalGroups(2)]
    names = {tag: gmsh.model.getPhysicalName(2, tag) or f"block {tag}" for tag in groups}
    strange = sorted({*names.values()} - {*numbers})
    if strange or len(names) != len(numbers):
        raise MeshError(
            f"the mesh has {len(names)} physical surfaces, of which {strange} are no blocks, and "
            f"the structure {len(numbers)} blocks: the mesh is of another structure"
        )
    grid, cells, _ = _fenicsx.mesh_from_gmsh(gmsh.model)
    blocks = np.full(grid.topology.index_map(2).size_local, -1, dtype=np.int32)
    blocks[cells.indices] = [numbers[names[int(tag)]] for tag in cells.values]
    result = Mesh(structure, grid, blocks, _joint_facets(structure, grid, blocks))
    _check(result)
    return result


def _joint_facets(
    structure: Structure, grid: Any, blocks: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Facets between two blocks, and the joint that each lies on."""
    cells_at, nodes_of = _fenicsx.connect(grid, 1, 2), _facet_points(grid)
    near, by_pair = TOUCHING * structure.size, structure.pairs.tolist()
    facets, joints = [], []
    for facet in range(grid.topology.index_map(1).size_local):
        sides = sorted({int(blocks[cell]) for cell in cells_at(facet)})
        if len(sides) < 2:
            continue
        middle = grid.geometry.x[nodes_of(facet)][:, :2].mean(axis=0)
        found = [number for number, pair in enumerate(by_pair) if pair == sides]
        away = middle - structure.middles[found]
        beside = np.abs(np.sum(away * structure.normals[found], axis=1))
        along = np.abs(np.sum(away * structure.tangents[found], axis=1))
        on = np.flatnonzero((beside < near) & (along < structure.depths[found] / 2.0))
        if not len(on):
            names = [structure.blocks[number].name for number in sides]
            raise MeshError(
                f"between {names} cells touch at ({middle[0]:.4g}, {middle[1]:.4g}), where the "
                "structure has no joint: the mesh is of another structure"
            )
        facets.append(facet)
        joints.append(found[on[0]])
    return np.array(facets, dtype=np.int32), np.array(joints, dtype=np.int32)


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
    wrong = np.flatnonzero(np.abs(covered - structure.depths) > 4.0 * TOUCHING * structure.size)
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
