"""Conforming meshes of all blocks by gmsh: cell tags are blocks, facet tags are joints.

Blocks share their nodes along joints; `space` breaks the displacement there. Tags are numbers of
blocks and joints plus one, since gmsh counts from one, and every group has its name. Recent meshes
are cached by the shapes of the structure, whatever its materials.
"""

from collections import OrderedDict
from collections.abc import Hashable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from archfem._files import atomic_write, temporary_folder
from archfem._optional import require_package
from archfem._validation import validate_arguments
from archfem.errors import InvalidInput, MeshError
from archfem.masonry.structure import CONTACT_TOLERANCE, Structure
from archfem.models.discretisation import Discretisation
from archfem.models.fem import _fenicsx
from archfem.models.fem.edge_division import Division, divide_edges

with require_package("gmsh"):
    import gmsh


@dataclass(frozen=True, eq=False)
class Mesh:
    """A mesh of a structure."""

    structure: Structure
    grid: Any  # DOLFINx mesh
    blocks: NDArray[np.int32]  # block of each cell (n_cells,)
    # facets on joints, and the joints they lie on, each (f,)
    joints: tuple[NDArray[np.int32], NDArray[np.int32]]


def generate_mesh(structure: Structure, settings: Discretisation | None = None) -> Mesh:
    """Mesh a structure."""
    with _gmsh_model(structure.name):
        _generate(structure, settings or Discretisation())
        return _import_mesh(structure)


@validate_arguments
def write_mesh(
    structure: Structure, path: str | Path, settings: Discretisation | None = None
) -> None:
    """Mesh a structure and write a gmsh file with named physical groups.

    Args:
        structure: structure to mesh.
        path: of the file, *.msh.
        settings: number and shape of cells; by default `Discretisation()`.

    Raises:
        MeshError: no conforming mesh with these settings exists.
    """
    with _gmsh_model(structure.name):
        _generate(structure, settings or Discretisation())
        with atomic_write(Path(path)) as draft:
            draft.touch()  # gmsh does not say why a file cannot be written
            try:
                gmsh.write(str(draft))
            except Exception as error:  # gmsh raises nothing more specific
                raise InvalidInput(f"gmsh does not write {path}: {error}; name it .msh") from error


@validate_arguments
def read_mesh(structure: Structure, path: str | Path) -> Mesh:
    """Read the mesh of a structure from a gmsh file, by `write_mesh` or another program.

    Cells belong to the block with the name of their physical surface; without a name to the block
    of its tag less one. Facets between two blocks belong to the joint that they lie on, whatever
    their physical curves; blocks must share their nodes there.

    Args:
        structure: meshed structure.
        path: of the file.

    Returns:
        The mesh.

    Raises:
        InvalidInput: the file does not exist.
        MeshError: it is no mesh, or its groups are not the structure's blocks and joints.
    """
    if not Path(path).is_file():
        raise InvalidInput(f"there is no mesh file {path}: write it with write_mesh")
    content, header = Path(path).read_bytes(), b"$MeshFormat"
    if not content.startswith(header):
        raise MeshError(
            f"{path} does not begin with {header.decode()}: gmsh would run it as a script, shell "
            "commands included; give a mesh as gmsh saves it"
        )
    with _gmsh_model(structure.name), temporary_folder() as folder:
        # a folder without options beside the mesh, which gmsh would run too
        copy = folder / "mesh.msh"
        copy.write_bytes(content)
        try:
            gmsh.merge(str(copy))
            return _import_mesh(structure)
        except MeshError:
            raise
        except Exception as error:  # gmsh and FEniCSx raise nothing more specific
            raise MeshError(f"{path} is not a gmsh mesh of it: {error}") from error


@contextmanager
def _gmsh_model(name: str) -> Iterator[None]:
    """Open a new gmsh model without output, and close it at the end."""
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add(name)
        yield
    finally:
        gmsh.finalize()


def _generate(structure: Structure, settings: Discretisation) -> None:
    """Build geometry and mesh of all blocks in the current gmsh model."""
    division = divide_edges(structure, settings)
    edges = division.edges
    geo = gmsh.model.geo
    corners = [geo.addPoint(x, y, 0.0) for x, y in edges.points]
    lines = [_add_lines(division, edge, corners) for edge in range(len(edges.ends))]
    for number, block in enumerate(structure.blocks):
        loop = [
            line
            for start, edge in zip(edges.boundaries[number], edges.around[number], strict=True)
            for line in _orient_lines(lines[edge], start == edges.ends[edge, 0])
        ]
        surface = geo.addPlaneSurface([geo.addCurveLoop(loop)], number + 1)
        if block.corners is not None:
            ends = [corners[point] for point in edges.corners(number)]
            geo.mesh.setTransfiniteSurface(surface, "Alternate", ends)
        if settings.cell == "quadrilateral":
            geo.mesh.setRecombine(2, surface)
        gmsh.model.addPhysicalGroup(2, [surface], number + 1, block.name)
    for number, (joint, shared) in enumerate(zip(structure.joints, edges.joints, strict=True)):
        on_joint = [line for edge in shared for line in lines[edge]]
        gmsh.model.addPhysicalGroup(1, on_joint, number + 1, joint.name)
    geo.synchronize()
    _mesh_blocks(division)


def _add_lines(division: Division, edge: int, corners: list[int]) -> list[int]:
    """Add lines along an edge, each of `division.units` cells; the edge has a multiple of these."""
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


def _orient_lines(lines: list[int], forward: bool) -> list[int]:
    """Return the lines along an edge, or back along it."""
    return lines if forward else [-line for line in reversed(lines)]


def _mesh_blocks(division: Division) -> None:
    """Mesh the blocks, those without corners with graded cells."""

    def size(dimension: int, tag: int, x: float, y: float, z: float, default: float) -> float:
        sizes = division.sizes.get(tag - 1) if dimension == 2 else None
        return default if sizes is None else float(sizes.evaluate(np.array([x, y])))

    if division.sizes:
        # full-quad recombination: splits a mesh twice as coarse and leaves no triangle
        gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 3)
    gmsh.option.setNumber("Mesh.Algorithm", 6)  # frontal Delaunay
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
    gmsh.model.mesh.setSizeCallback(size)
    failure = ""
    try:
        gmsh.model.mesh.generate(2)
    except Exception as error:  # gmsh raises nothing more specific
        failure = f": {error}"
    for number, block in enumerate(division.edges.structure.blocks):
        types = gmsh.model.mesh.getElementTypes(2, number + 1)
        if not len(types):
            raise MeshError(
                f"gmsh cannot mesh block '{block.name}'{failure}: check that its outline crosses "
                "neither itself nor another's"
            )
        if len(types) > 1:
            raise MeshError(
                f"triangles remain among the quadrilaterals of block '{block.name}', and a mesh "
                "has one kind of cell: use cell = 'triangle'"
            )


def _import_mesh(structure: Structure) -> Mesh:
    """Return the current gmsh model, whose surfaces have the names of blocks, as a checked mesh."""
    numbers = {block.name: number for number, block in enumerate(structure.blocks)}
    groups = [int(tag) for _, tag in gmsh.model.getPhysicalGroups(2)]
    names = {tag: gmsh.model.getPhysicalName(2, tag) or f"block {tag}" for tag in groups}
    strange = sorted({*names.values()} - {*numbers})
    if strange or len(names) != len(numbers):
        raise MeshError(
            f"the mesh has {len(names)} physical surfaces, of which {strange} are no blocks, and "
            f"the structure {len(numbers)} blocks: the mesh is of another structure"
        )
    grid, cells = _fenicsx.import_gmsh_mesh(gmsh.model)
    blocks = np.full(grid.topology.index_map(2).size_local, -1, dtype=np.int32)
    blocks[cells.indices] = [numbers[names[int(tag)]] for tag in cells.values]
    if (found := set(blocks.tolist())) != set(numbers.values()):
        raise MeshError(
            f"the mesh has block numbers {sorted(found)}, the structure 0 to {len(numbers) - 1}: "
            "the mesh is of another structure"
        )
    return Mesh(structure, grid, blocks, _find_joint_facets(structure, grid, blocks))


def _find_joint_facets(
    structure: Structure, grid: Any, blocks: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the facets between two blocks, which must cover the joints, and their joints."""
    cells_at = _fenicsx.find_connectivity(grid, 1, 2)
    vertices, point = _fenicsx.find_connectivity(grid, 1, 0), _fenicsx.find_vertex_points(grid)
    near, by_pair = CONTACT_TOLERANCE * structure.size, structure.pairs.tolist()
    facets, joints, covered = [], [], np.zeros(len(structure.joints))
    for facet in range(grid.topology.index_map(1).size_local):
        sides = sorted({int(blocks[cell]) for cell in cells_at(facet)})
        if len(sides) < 2:
            continue
        ends = grid.geometry.x[point[vertices(facet)]][:, :2]
        middle = ends.mean(axis=0)
        # joints between these blocks, and the distance of the facet's middle from theirs
        between = [number for number, pair in enumerate(by_pair) if pair == sides]
        away = middle - structure.middles[between]
        beside = np.abs(np.sum(away * structure.normals[between], axis=1))
        along = np.abs(np.sum(away * structure.tangents[between], axis=1))
        on = np.flatnonzero((beside < near) & (along < structure.depths[between] / 2.0))
        if not len(on):
            names = [structure.blocks[number].name for number in sides]
            raise MeshError(
                f"between {names} cells touch at ({middle[0]:.4g}, {middle[1]:.4g}), where the "
                "structure has no joint: the mesh is of another structure"
            )
        facets.append(facet)
        joints.append(between[on[0]])
        covered[joints[-1]] += np.linalg.norm(ends[1] - ends[0])
    wrong = np.flatnonzero(np.abs(covered - structure.depths) > 4.0 * near)
    if len(wrong):
        joint = structure.joints[wrong[0]]
        raise MeshError(
            f"joint '{joint.name}' is {joint.depth:.6g} m deep but its facets cover "
            f"{covered[wrong[0]]:.6g} m: the mesh is of another structure"
        )
    return np.array(facets, dtype=np.int32), np.array(joints, dtype=np.int32)


_recent_meshes: OrderedDict[Hashable, Mesh] = OrderedDict()


def get_mesh(structure: Structure, settings: Discretisation, max_meshes: int = 4) -> Mesh:
    """Return the mesh of a structure, or a recent one of a structure of the same shapes."""
    cells = (*settings.cells, settings.cell, settings.max_cell_size, settings.degree)
    key = (*map(_shape_key, (*structure.blocks, *structure.joints)), cells)
    try:
        hash(key)
    except TypeError:  # outlines may be lists
        return generate_mesh(structure, settings)
    if key not in _recent_meshes:
        _recent_meshes[key] = generate_mesh(structure, settings)
        while len(_recent_meshes) > max_meshes:
            _recent_meshes.popitem(last=False)
    _recent_meshes.move_to_end(key)
    return replace(_recent_meshes[key], structure=structure)


def _shape_key(part: object) -> Hashable:
    """Return all fields of a block or joint but material and contact."""
    names = (field.name for field in fields(part))  # type: ignore[arg-type]
    values = tuple(getattr(part, name) for name in names if name not in ("material", "contact"))
    return type(part).__name__, values
