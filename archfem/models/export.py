"""Export of one state of a model as DXF, VTU or a file of meshio.

Blocks are polygons, and joints gaps between their faces. No two blocks share a point, so that
joints open and slide in a file as in the model. VTK's unstructured grids (.vtu), as ParaView
reads them, are written without VTK.
"""

from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from archfem._files import atomic_write
from archfem._optional import require_package
from archfem._typing import Array, Numbers
from archfem._validation import validate_arguments
from archfem.errors import InvalidInput
from archfem.masonry.block import trace_boundary
from archfem.masonry.structure import rigid_motion_matrix
from archfem.masonry.survey.drawings import write_dxf
from archfem.models.model import Cells, Model, check_coordinate_count


@dataclass(frozen=True, eq=False)
class Solids:
    """Polygons of all blocks and faces of all joints of a model, with their displacements."""

    model: Model

    @cached_property
    def _supports(self) -> list[tuple[int, Array]]:
        """Numbers and outlines of the fixed blocks."""
        blocks = enumerate(self.model.structure.blocks)
        return [(number, block.drawn()) for number, block in blocks if block.fixed]

    @cached_property
    def cells(self) -> Cells:
        """Polygons of all blocks as built: the cells, then one for each fixed block."""
        cells = self.model.cells
        outlines = [points for _, points in self._supports]
        ends = np.cumsum([len(cells.places), *map(len, outlines)])
        fixed = [np.full(len(points), number) for number, points in self._supports]
        return Cells(
            np.concatenate([cells.places, *outlines]),
            np.concatenate([cells.block, *fixed]).astype(np.intp),
            (*map(np.asarray, cells.polygons), *(np.arange(a, b) for a, b in pairwise(ends))),
            cells.shape_functions,
        )

    def displacement(self, q: Array) -> Array:
        """Return the displacements of all points (m, 2) [m]."""
        check_coordinate_count(self.model, len(q))
        centroids = self.model.structure.centroids
        fixed = [
            rigid_motion_matrix(points, centroids[number]) @ self.model.support_motion[number]
            for number, points in self._supports
        ]
        return np.concatenate([self.model.cells.displacement(q), *fixed])

    def cell_data(self, stress: Array | None) -> dict[str, NDArray[Any]]:
        """Return block numbers and stresses (p, 3) [Pa] of the polygons, by name in a file."""
        data: dict[str, NDArray[Any]] = {"block": self.cells.owner.astype(np.int64)}
        if stress is not None:
            data |= dict(zip(("stress_xx", "stress_yy", "stress_xy"), stress.T, strict=True))
        return data

    def stress(self, q: Array) -> Array | None:
        """Return σ_xx, σ_yy and σ_xy of every polygon (p, 3) [Pa]; None where blocks are rigid."""
        if self.model.cells.stress is None:
            return None
        # fixed blocks do not deform: they have no stress
        stress = np.full((len(self.cells.polygons), 3), np.nan)
        stress[: len(self.model.cells.polygons)] = (self.model.cells.stress @ q).reshape(-1, 3)
        return stress

    @cached_property
    def corners(self) -> Array:
        """Faces of joints as built, along the lower block and back along the higher (j, 4, 2)."""
        joints = self.model.structure.joints
        return np.array([[*joint.ends, *joint.ends[::-1]] for joint in joints])

    @cached_property
    def _anchors(self) -> tuple[Numbers, Array]:
        """Ends of the polygon edge nearest to each corner (4 j, 2), and place on it (4 j,)."""
        joints = self.model.structure.joints
        blocks = np.repeat([n for joint in joints for n in (joint.lower, joint.higher)], 2)
        nearest = [
            self.cells.nearest_edge(number, point)[:2]
            for number, point in zip(blocks, self.corners.reshape(-1, 2), strict=True)
        ]
        edges, fractions = zip(*nearest, strict=True)
        return np.array(edges), np.array(fractions)

    def joint_faces(self, displacement: Array) -> Array:
        """Return the displacements of both faces of each joint, from those of all points.

        They are those of `corners` (n_joints, 4, 2) [m].
        """
        edges, fraction = self._anchors
        first, second = displacement[edges[:, 0]], displacement[edges[:, 1]]
        return (first + fraction[:, None] * (second - first)).reshape(-1, 4, 2)


def write_vtu(
    path: Path,
    points: Array,
    polygons: Sequence[Numbers],
    point_data: Mapping[str, Array],
    cell_data: Mapping[str, NDArray[Any]],
) -> None:
    """Write polygons with data of their points and cells."""
    sizes = [len(polygon) for polygon in polygons]
    # VTK's types by the number of corners: triangles, quadrilaterals, other polygons
    types = [{3: 5, 4: 9}.get(size, 7) for size in sizes]
    cells: dict[str, NDArray[Any]] = {
        "connectivity": np.concatenate(polygons).astype(np.int64),
        "offsets": np.cumsum(sizes, dtype=np.int64),
        "types": np.array(types, dtype=np.uint8),
    }
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" '
        'header_type="UInt64"><UnstructuredGrid>',
        f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(polygons)}">',
        *_section("Points", {"": _spatial(points)}),
        *_section("Cells", cells),
        *_section("PointData", {name: _spatial(values) for name, values in point_data.items()}),
        *_section("CellData", cell_data),
        "</Piece></UnstructuredGrid></VTKFile>",
    ]
    with atomic_write(path) as draft:
        draft.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_collection(path: Path, entries: Sequence[tuple[float, int, str]]) -> None:
    """Write the list of files that make a series (.pvd)."""
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="Collection" version="1.0"><Collection>',
        *(
            f'<DataSet timestep="{time:.9g}" group="" part="{part}" file={quoteattr(name)}/>'
            for time, part, name in entries
        ),
        "</Collection></VTKFile>",
    ]
    with atomic_write(path) as draft:
        draft.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _spatial(values: Array) -> Array:
    """Return plane vectors as space vectors; other values unchanged."""
    if values.ndim == 2 and values.shape[1] == 2:
        return np.column_stack([values, np.zeros(len(values))])
    return values


def _section(name: str, arrays: Mapping[str, NDArray[Any]]) -> list[str]:
    """Return the lines of a section of arrays."""
    return [f"<{name}>", *(_array(key, values) for key, values in arrays.items()), f"</{name}>"]


def _array(name: str, values: NDArray[Any]) -> str:
    """Return an array as XML: the number of bytes and the bytes, base64-encoded."""
    # VTK's and NumPy's names of number types, by NumPy's kind; other kinds are bytes or flags
    number_types = {"f": ("Float64", "<f8"), "i": ("Int64", "<i8")}
    kind, number_type = number_types.get(values.dtype.kind, ("UInt8", "u1"))
    data = np.ascontiguousarray(values, dtype=number_type).tobytes()
    size = np.array([len(data)], dtype="<u8").tobytes()
    width = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
    return (
        f'<DataArray type="{kind}" Name={quoteattr(name)}{width} format="binary">'
        f"{b64encode(size + data).decode()}</DataArray>"
    )


@validate_arguments
def write_state(model: Model, q: Array, path: str | Path, *, magnification: float = 1.0) -> Path:
    """Write a displaced state of a model for programs that draw or mesh.

    As *.dxf: displaced outlines of all blocks, each on the layer of its part, over those as built,
    and the joints as built. As *.vtu, or any format of meshio with data (*.vtk, *.xdmf, *.e …): the
    cells as built, with displacements [m] at their points, and block numbers and stresses [Pa] of
    the cells. Blocks share no points, so that openings are visible.

    Args:
        model: model of the structure.
        q: coordinates (n,), e.g. `dead.q`.
        path: path of the file; its suffix determines the format.
        magnification: magnification of displacements in a drawing [-].

    Returns:
        The file.

    Raises:
        InvalidInput: q belongs to another model, or meshio is not installed or cannot write the
            format.
    """
    path, solids = Path(path), Solids(model)
    displacement = solids.displacement(np.asarray(q, dtype=float))
    if path.suffix == ".dxf":
        return _write_drawing(solids, displacement, path, magnification)
    data = solids.cell_data(solids.stress(q))
    if path.suffix == ".vtu":
        points = {"displacement": displacement}
        write_vtu(path, solids.cells.places, solids.cells.polygons, points, data)
        return path
    return _write_with_meshio(solids, displacement, data, path)


def _write_drawing(solids: Solids, displacement: Array, path: Path, magnification: float) -> Path:
    """Write a drawing of the blocks as built and displaced."""
    structure = solids.model.structure
    places = solids.cells.places + magnification * displacement
    outlines: dict[str, list[tuple[str, Array]]] = {}
    for number, block in enumerate(structure.blocks):
        own = np.flatnonzero(solids.cells.owner == number)
        loop = trace_boundary([solids.cells.polygons[k] for k in own])
        outlines.setdefault(block.part or "blocks", []).append((block.name, places[loop]))
    drawn = [(block.name, block.drawn()) for block in structure.blocks]
    built = [(name, np.vstack([points, points[:1]])) for name, points in drawn]
    joints = [(joint.name, joint.ends) for joint in structure.joints]
    return write_dxf(path, outlines, {"as built": built, "joints": joints})


def _write_with_meshio(
    solids: Solids, displacement: Array, data: dict[str, NDArray[Any]], path: Path
) -> Path:
    """Write a file in one of meshio's formats."""
    with require_package("meshio"):
        import meshio
    # meshio stores the cells of each type together
    types: dict[str, list[int]] = {}
    for number, polygon in enumerate(solids.cells.polygons):
        cell_type = {3: "triangle", 4: "quad"}.get(len(polygon), f"polygon{len(polygon)}")
        types.setdefault(cell_type, []).append(number)
    cells = [(t, np.array([solids.cells.polygons[k] for k in rows])) for t, rows in types.items()]
    cell_data = {name: [values[rows] for rows in types.values()] for name, values in data.items()}
    point_data = {"displacement": _spatial(displacement)}
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        # it refuses polygons of more than some corners, such as rigid blocks with arcs
        meshio.Mesh(_spatial(solids.cells.places), cells, point_data, cell_data).write(path)
    except Exception as error:  # meshio and its formats raise exceptions of any class
        raise InvalidInput(
            f"meshio does not write this model as {path}: {error}; try .vtu or .vtk"
        ) from error
    return path
