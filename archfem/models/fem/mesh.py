"""Conforming meshes of all blocks by gmsh: cell tags are blocks, facet tags are joints.

Blocks share their nodes along joints; `space` breaks the displacement there. Tags are numbers of
blocks and joints plus one, since gmsh counts from one, and every group has its name. Recent meshes
are cached by the shapes of the structure, whatever its materials.

The edges of blocks are divided into cells first. A block with corners is meshed from side to side,
so its opposite sides need the same number of cells. Neighbours share edges, so the numbers depend
on each other through the whole structure. They solve a small integer programme (Tam and Armstrong,
International Journal for Numerical Methods in Engineering 36 (1993) 2581). It gives the fewest
cells with equal opposite sides and at least the required number on each edge. A freely meshed block
of quadrilaterals needs an even number on each edge, as it could not be filled otherwise. Even
numbers are always feasible: any solution may be doubled.

Blocks without corners take the numbers of their neighbours; on their other edges, and inside, the
cells grow with the distance from those, up to a size that is in proportion to 1 / `along`.
"""

from collections.abc import Hashable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from functools import cached_property
from itertools import pairwise
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.spatial import cKDTree

from archfem._files import atomic_write, temporary_folder
from archfem._optional import require_package
from archfem._recent import RecentResults
from archfem._threads import hold_signals
from archfem._typing import Array, Numbers
from archfem._validation import validate_arguments
from archfem.errors import InvalidInput, MeshError
from archfem.masonry.structure import CONTACT_TOLERANCE, Structure
from archfem.models.discretisation import Discretisation
from archfem.models.fem import _fenicsx

with require_package("gmsh"):
    import gmsh

# Excess of a number of cells over an integer that counts as round-off [-]
CELL_ROUND_OFF = 1e-6


@dataclass(frozen=True, eq=False)
class Edges:
    """Edges between the points at which outlines bend or meet; touching blocks share them."""

    structure: Structure
    points: Array  # ends of the edges (n, 2) [m]
    ends: Numbers  # both points of each edge, the lower number first (m, 2)
    boundaries: tuple[Numbers, ...]  # points around each block, anticlockwise
    # edges around each block; the k-th starts at the k-th point of the boundary
    around: tuple[Numbers, ...]

    @cached_property
    def lengths(self) -> Array:
        """Lengths of the edges (m,) [m]."""
        start, end = self.points[self.ends.T]
        return np.linalg.norm(end - start, axis=1)

    @cached_property
    def structured(self) -> tuple[int, ...]:
        """Blocks that are meshed from side to side."""
        blocks = self.structure.blocks
        return tuple(number for number, block in enumerate(blocks) if block.corners is not None)

    @cached_property
    def unstructured(self) -> tuple[int, ...]:
        """Blocks that are meshed freely."""
        return tuple(n for n in range(len(self.boundaries)) if n not in set(self.structured))

    def corners(self, number: int) -> Numbers:
        """Return the points at the four corners of a structured block (4,)."""
        block, boundary = self.structure.blocks[number], self.boundaries[number]
        corners = block.points[list(block.corners or ())]
        away = np.linalg.norm(self.points[boundary] - corners[:, None], axis=2)
        return boundary[np.argmin(away, axis=1)]

    @cached_property
    def sides(self) -> dict[int, list[Numbers]]:
        """Edges on the four sides of each structured block, by its number."""
        return {number: self._sides(number) for number in self.structured}

    def _sides(self, number: int) -> list[Numbers]:
        boundary, around = self.boundaries[number], self.around[number]
        starts = [int(np.flatnonzero(boundary == point)[0]) for point in self.corners(number)]
        # edges from the first corner on, cut at the others
        rolled = np.roll(around, -starts[0])
        stops = [(start - starts[0]) % len(boundary) for start in starts] + [len(boundary)]
        return [rolled[a:b] for a, b in pairwise(stops)]

    @cached_property
    def joints(self) -> tuple[Numbers, ...]:
        """Edges on each joint: those of both its blocks, between its ends."""
        near = CONTACT_TOLERANCE * self.structure.size
        edges = []
        for joint in self.structure.joints:
            shared = np.intersect1d(self.around[joint.lower], self.around[joint.higher])
            relative = self.points[self.ends[shared]] - joint.ends[0]
            along = relative @ joint.tangent
            off = relative @ np.array([-joint.tangent[1], joint.tangent[0]])
            within = (np.abs(off) <= near) & (along > -near) & (along < joint.depth + near)
            edges.append(shared[within.all(axis=1)])
        return tuple(edges)


def find_edges(structure: Structure, chords: Sequence[int]) -> Edges:
    """Find the edges of a structure's blocks."""
    near = CONTACT_TOLERANCE * structure.size
    drawn = [block.drawn(n) for block, n in zip(structure.blocks, chords, strict=True)]
    # merge points nearer than the tolerance
    corners = np.concatenate(drawn)
    first = np.array([min(group) for group in cKDTree(corners).query_ball_point(corners, near)])
    distinct, number = np.unique(first, return_inverse=True)
    points = corners[distinct]
    starts = np.cumsum([0, *map(len, drawn)])
    boundaries = tuple(
        _insert_points_on_edges(number[a:b], points, near) for a, b in pairwise(starts)
    )
    # edges are pairs of consecutive points, shared by blocks
    pairs = [np.sort(np.stack([loop, np.roll(loop, -1)], axis=1), axis=1) for loop in boundaries]
    ends, of_pair = np.unique(np.concatenate(pairs), axis=0, return_inverse=True)
    around = np.split(of_pair.ravel(), np.cumsum([len(loop) for loop in boundaries])[:-1])
    return Edges(structure, points, ends, boundaries, tuple(around))


def _insert_points_on_edges(boundary: Numbers, points: Array, near: float) -> Numbers:
    """Return a boundary with the points of other blocks that lie on its edges."""
    boundary = boundary[boundary != np.roll(boundary, 1)]
    starts = points[boundary]
    edges = np.roll(starts, -1, axis=0) - starts
    lengths = np.linalg.norm(edges, axis=1)[:, None]
    low, high = starts.min(axis=0) - near, starts.max(axis=0) + near
    others = np.flatnonzero(np.all((points >= low) & (points <= high), axis=1))
    # place along each edge, and distance from it, of each point nearby (edges, points)
    x, y = np.moveaxis(points[others] - starts[:, None], 2, 0)
    along = (x * edges[:, :1] + y * edges[:, 1:]) / lengths
    off = (y * edges[:, :1] - x * edges[:, 1:]) / lengths
    edge, point = np.nonzero((np.abs(off) <= near) & (along > near) & (along < lengths - near))
    order = np.lexsort((along[edge, point], edge))
    return np.insert(boundary, edge[order] + 1, others[point[order]])


@dataclass(frozen=True, eq=False)
class CellSizes:
    """Cell size that grows with the distance d from facets: the minimum of l + 0.35 d."""

    middles: Array  # of the facets (f, 2) [m]
    lengths: Array  # of the facets (f,) [m]
    max_size: float  # [m]
    growth: float = 0.35  # of the size with the distance [-]

    def evaluate(self, places: Array) -> Array:
        """Return the size of cells at places (...,) [m]."""
        away = np.linalg.norm(places[..., None, :] - self.middles, axis=-1)
        sizes = self.lengths + self.growth * np.maximum(away - 0.5 * self.lengths, 0.0)
        return np.minimum(sizes.min(axis=-1), self.max_size)


@dataclass(frozen=True, eq=False)
class Division:
    """Edges divided into cells."""

    edges: Edges
    stations: tuple[Array, ...]  # cell ends of each edge, from 0 at its first point to 1
    units: Numbers  # divisor of each edge's number of cells (m,)
    sizes: dict[int, CellSizes]  # of the cells in each block without corners


def divide_edges(structure: Structure, settings: Discretisation) -> Division:
    """Divide the edges of a structure's blocks into cells."""
    chords = [_cells_along(block.fixed, settings) for block in structure.blocks]
    edges = find_edges(structure, chords)
    units = _cell_multiples(edges, settings)
    _check_cell_count(edges, settings)
    # the fewest cells; the same with cells of equal length on all edges of a side
    minimum, fine = _minimum_edge_cells(edges, settings)
    counts = _solve_cell_counts(edges, units, minimum)
    counts = _solve_cell_counts(edges, units, _distribute_cells(edges, units, counts, minimum))
    # more cells on free edges, by the graded size of cells inside the blocks
    free = edges.unstructured
    sizes = {number: _block_cell_sizes(edges, number, fine, counts, settings) for number in free}
    graded = _grade_edges(edges, sizes)
    for edge, cells in graded.items():
        counts[edge] = max(counts[edge], round(cells[-1]))
    counts = _solve_cell_counts(edges, units, counts)
    stations = [np.linspace(0.0, 1.0, count + 1) for count in counts]
    for edge, cells in graded.items():
        place = np.linspace(0.0, 1.0, len(cells))
        stations[edge] = np.interp(stations[edge] * cells[-1], cells, place)
    return Division(edges, tuple(stations), units, sizes)


def _cells_along(fixed: bool, settings: Discretisation) -> int:
    """Return the number of cells along a block; a fixed block has one."""
    return 1 if fixed else settings.along


def _check_cell_count(edges: Edges, settings: Discretisation, max_cells: int = 1_000_000) -> None:
    """Refuse a mesh with too many cells for the memory, before it is generated."""
    count = sum(prod(map(float, _side_cells(edges, n, settings))) for n in edges.structured)
    for number in edges.unstructured:
        block, largest = edges.structure.blocks[number], _max_cell_size(edges, number, settings)
        count += 0.0 if block.fixed else block.area / largest / largest
    if not count <= max_cells:
        raise MeshError(
            f"a mesh of {count:.3g} cells, and there is room for {max_cells}: use fewer cells, "
            "larger ones (max_cell_size), or fidelity 'rigid', which has none"
        )


def _side_cells(edges: Edges, number: int, settings: Discretisation) -> list[int]:
    """Return the minimum number of cells on two adjacent sides of a structured block."""
    block = edges.structure.blocks[number]
    lengths = [edges.lengths[side].sum() for side in edges.sides[number]]
    long = [0.5 * (lengths[k] + lengths[k + 2]) for k in range(2)]
    wanted = [_cells_along(block.fixed, settings), settings.through]
    # faces of sectors are already drawn with so many chords
    if not block.fixed and block.centre is None:
        # no cell of a stone is longer than twice the stone's thickness across it
        slender = [long[k] / (2.0 * long[1 - k]) for k in range(2)]
        wanted = [
            max(n, int(np.ceil(s - CELL_ROUND_OFF))) for n, s in zip(wanted, slender, strict=True)
        ]
    return wanted


def _minimum_edge_cells(edges: Edges, settings: Discretisation) -> tuple[Numbers, Array]:
    """Return minimum numbers of cells on edges, and whether a side or joint sets each of them."""
    # cells on the edges of a side, or of a joint between two blocks without corners, are not longer
    # than those of the whole side
    minimum = np.ones(len(edges.ends), dtype=np.intp)
    fine = np.zeros(len(edges.ends), dtype=bool)

    def distribute(side: Numbers, cells: int) -> None:
        shares = cells * edges.lengths[side] / edges.lengths[side].sum()
        minimum[side] = np.maximum(minimum[side], np.ceil(shares - CELL_ROUND_OFF).astype(int))
        fine[side] = True

    for number in edges.structured:
        wanted = _side_cells(edges, number, settings)
        for side, cells in zip(edges.sides[number], wanted * 2, strict=True):
            distribute(side, cells)
    free = set(edges.unstructured)
    for joint, shared in zip(edges.structure.joints, edges.joints, strict=True):
        if free.issuperset(joint.blocks):
            distribute(shared, settings.through)
    return minimum, fine


def _solve_cell_counts(edges: Edges, units: Numbers, minimum: Numbers) -> Numbers:
    """Solve the integer programme for the numbers of cells."""
    # equal numbers on opposite sides of structured blocks
    size, rows = len(edges.ends), []
    for number in edges.structured:
        sides = edges.sides[number]
        for side, other in zip(sides[:2], sides[2:], strict=True):
            both = np.concatenate([side, other])
            signs = np.repeat([1, -1], [len(side), len(other)])
            places = (np.zeros(len(both), dtype=int), both)
            rows.append(sparse.csr_matrix((signs * units[both], places), (1, size)))
    # weights: long edges take additional cells first
    solution = milp(
        units * edges.lengths.mean() / edges.lengths,
        integrality=np.ones(size),
        bounds=Bounds(np.ceil(minimum / units), np.inf),
        constraints=LinearConstraint(sparse.vstack(rows), 0.0, 0.0) if rows else (),
    )
    if solution.x is None:
        raise MeshError(
            "no numbers of cells make opposite sides of all four-sided blocks agree: mesh some of "
            "them freely, by leaving out their corners"
        )
    return units * np.round(solution.x).astype(np.intp)


def _distribute_cells(edges: Edges, units: Numbers, counts: Numbers, minimum: Numbers) -> Numbers:
    """Return minimum numbers that distribute each side's cells to its edges by length."""
    distributed = minimum.copy()
    for number in edges.structured:
        for side in edges.sides[number]:
            lengths = edges.lengths[side]
            shares = counts[side].sum() * lengths / lengths.sum() + CELL_ROUND_OFF
            multiple = (shares // units[side]).astype(int) * units[side]
            distributed[side] = np.maximum(distributed[side], multiple)
    return distributed


def _cell_multiples(edges: Edges, settings: Discretisation) -> Numbers:
    """Return the divisor of each edge's number of cells."""
    unit = np.ones(len(edges.ends), dtype=np.intp)
    if settings.cell == "quadrilateral":
        for number in edges.unstructured:
            unit[edges.around[number]] = 2
    return unit


def _block_cell_sizes(
    edges: Edges, number: int, fine: Array, counts: Numbers, settings: Discretisation
) -> CellSizes:
    """Return the cell sizes in a freely meshed block, which grow from its fine edges."""
    block, around = edges.structure.blocks[number], edges.around[number]
    small = around[fine[around]]
    ends = edges.points[edges.ends[small]]
    middles = [
        start + (end - start) * (np.arange(count)[:, None] + 0.5) / count
        for (start, end), count in zip(ends, counts[small], strict=True)
    ]
    lengths = np.repeat(edges.lengths[small] / counts[small], counts[small])
    max_size = np.inf if block.fixed else _max_cell_size(edges, number, settings)
    return CellSizes(np.concatenate(middles), lengths, max_size)


def _max_cell_size(edges: Edges, number: int, settings: Discretisation) -> float:
    """Return the largest size of cells in a freely meshed block [m]."""
    if settings.max_cell_size is not None:
        return settings.max_cell_size
    # of a square 1 / along of its side, so that the inside refines with the joints
    perimeter = float(edges.lengths[edges.around[number]].sum())
    return 4.0 * edges.structure.blocks[number].area / (settings.along * perimeter)


def _grade_edges(
    edges: Edges, sizes: dict[int, CellSizes], intervals: int = 500
) -> dict[int, Array]:
    """Return cumulative numbers of cells along edges that belong to freely meshed blocks only."""
    structured = {edge for number in edges.structured for edge in edges.around[number]}
    cells: dict[int, Array] = {}
    for number, size in sizes.items():
        for edge in set(edges.around[number].tolist()) - structured:
            start, end = edges.points[edges.ends[edge]]
            places = start + (end - start) * np.linspace(0.0, 1.0, intervals + 1)[:, None]
            # integral of the cells per length, by the trapezoidal rule
            density = edges.lengths[edge] / size.evaluate(places)
            steps = 0.5 * (density[1:] + density[:-1]) / intervals
            total = np.append(0.0, np.cumsum(steps))
            if edge not in cells or cells[edge][-1] < total[-1]:
                cells[edge] = total
    return cells


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
        path: path of the file, *.msh.
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
        path: path of the file.

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
    with hold_signals():
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
    backwards = [[-line for line in reversed(along)] for along in lines]
    for number, block in enumerate(structure.blocks):
        loop = [
            line
            for start, edge in zip(edges.boundaries[number], edges.around[number], strict=True)
            for line in (lines if start == edges.ends[edge, 0] else backwards)[edge]
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


_recent_meshes = RecentResults[Mesh](4)


def get_mesh(structure: Structure, settings: Discretisation) -> Mesh:
    """Return the mesh of a structure, or a recent one of a structure of the same shapes."""
    cells = (*settings.cells, settings.cell, settings.max_cell_size, settings.degree)
    key = (*map(_shape_key, (*structure.blocks, *structure.joints)), cells)
    mesh = _recent_meshes.look_up(key, lambda: generate_mesh(structure, settings))
    return replace(mesh, structure=structure)


def _shape_key(part: object) -> Hashable:
    """Return all fields of a block or joint but material and contact."""
    names = (field.name for field in fields(part))  # type: ignore[arg-type]
    values = tuple(getattr(part, name) for name in names if name not in ("material", "contact"))
    return type(part).__name__, values
