"""VTK's unstructured grids (.vtu), as ParaView reads them, written without VTK."""

from base64 import b64encode
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from archfem.arrays import Array
from archfem.files import in_one_stroke

KINDS = {3: 5, 4: 9}
"""VTK's numbers for triangles and quadrilaterals; other polygons have 7."""

TYPES = {"f": ("Float64", "<f8"), "i": ("Int64", "<i8"), "u": ("UInt8", "u1"), "b": ("UInt8", "u1")}
"""VTK's names for kinds of numbers, and NumPy's."""


def write_vtu(
    path: Path,
    points: Array,
    polygons: Sequence[NDArray[np.intp]],
    point_data: Mapping[str, Array],
    cell_data: Mapping[str, NDArray[Any]],
) -> None:
    """Write polygons and what is known of their points and of themselves.

    Args:
        path: of the file; folders are made.
        points: in the plane (m, 2).
        polygons: each the numbers of its corners in order.
        point_data: by name, (m,) or (m, k); vectors in the plane get a third component of 0.
        cell_data: by name, (n_polygons,) or (n_polygons, k).
    """
    sizes = [len(polygon) for polygon in polygons]
    cells: dict[str, NDArray[Any]] = {
        "connectivity": np.concatenate(polygons).astype(np.int64),
        "offsets": np.cumsum(sizes, dtype=np.int64),
        "types": np.array([KINDS.get(size, 7) for size in sizes], dtype=np.uint8),
    }
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" '
        'header_type="UInt64"><UnstructuredGrid>',
        f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(polygons)}">',
        *_section("Points", {"": _spatial(points)}),
        *_section("Cells", cells),
        *_section("PointData", {name: _spatial(each) for name, each in point_data.items()}),
        *_section("CellData", cell_data),
        "</Piece></UnstructuredGrid></VTKFile>",
    ]
    with in_one_stroke(path) as draft:
        draft.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_collection(path: Path, entries: Sequence[tuple[float, int, str]]) -> None:
    """Write the list of files that make a series (.pvd).

    Args:
        path: of the list; folders are made.
        entries: time [s], number of the part, and name of the file from the folder of the list.
    """
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="Collection" version="1.0"><Collection>',
        *(
            f'<DataSet timestep="{time:.9g}" group="" part="{part}" file={quoteattr(name)}/>'
            for time, part, name in entries
        ),
        "</Collection></VTKFile>",
    ]
    with in_one_stroke(path) as draft:
        draft.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _spatial(values: Array) -> Array:
    """Vectors in the plane as vectors in space; other values as they are."""
    if values.ndim == 2 and values.shape[1] == 2:
        return np.column_stack([values, np.zeros(len(values))])
    return values


def _section(name: str, arrays: Mapping[str, NDArray[Any]]) -> list[str]:
    """Some arrays under a name."""
    return [f"<{name}>", *(_array(key, values) for key, values in arrays.items()), f"</{name}>"]


def _array(name: str, values: NDArray[Any]) -> str:
    """An array, its bytes in letters after their number."""
    kind, form = TYPES[values.dtype.kind] if values.dtype != np.uint8 else TYPES["u"]
    data = np.ascontiguousarray(values, dtype=form).tobytes()
    size = np.array([len(data)], dtype="<u8").tobytes()
    width = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
    return (
        f'<DataArray type="{kind}" Name={quoteattr(name)}{width} format="binary">'
        f"{b64encode(size + data).decode()}</DataArray>"
    )
