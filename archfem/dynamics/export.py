"""Series of files of a run: VTU and PVD for ParaView, XDMF and HDF5.

Blocks share no points, so that openings remain. Displacements [m] are at points and mean stresses
[Pa] in cells.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ElementTree, SubElement

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from archfem._files import atomic_write
from archfem._typing import Array
from archfem.errors import InvalidInput
from archfem.masonry.block import rotate
from archfem.models.export import Solids, write_collection, write_vtu
from archfem.models.model import Model


@dataclass(frozen=True, eq=False)
class FieldFrame:
    """Displacement and stress fields at an instant of a run."""

    time: float  # [s]
    displacement: Array  # of every point (m, 2) [m]
    stress: Array | None  # mean stress of every polygon (p, 3) [Pa], or None


def write_vtk(model: Model, run: xr.Dataset, path: str | Path) -> Path:
    """Write a run as a series for ParaView: blocks, and joints as the gaps between their faces."""
    path = _check_suffix(path, ".pvd")
    solids, folder, entries = Solids(model), path.with_suffix(""), []
    # a joint is a quadrilateral, flat at rest, with its resultants and flags
    joints = [np.arange(4 * k, 4 * k + 4) for k in range(len(model.structure.joints))]
    for number, frame in enumerate(frames(solids, run)):
        files = [folder / f"{part}_{number:05d}.vtu" for part in ("blocks", "joints")]
        cells, moved = solids.cells, {"displacement": frame.displacement}
        write_vtu(files[0], cells.places, cells.polygons, moved, solids.cell_data(frame.stress))
        gaps = solids.joint_faces(frame.displacement).reshape(-1, 2)
        corners = solids.corners.reshape(-1, 2)
        write_vtu(files[1], corners, joints, {"displacement": gaps}, _joint_data(run, frame.time))
        names = [f"{folder.name}/{file.name}" for file in files]
        entries += [(frame.time, part, name) for part, name in enumerate(names)]
    write_collection(path, entries)
    return path


def write_xdmf(model: Model, run: xr.Dataset, path: str | Path) -> Path:
    """Write the fields of a run as XDMF: a text file, and an HDF5 file of all numbers."""
    path = _check_suffix(path, ".xdmf")
    solids, numbers = Solids(model), path.with_suffix(".h5")
    mixed = np.concatenate([[*_xdmf_cell_type(len(cell)), *cell] for cell in solids.cells.polygons])
    data = {
        "points": (("point", "axis"), solids.cells.places),
        "cells": (("entry",), mixed.astype(np.int64)),
        "block": (("cell",), solids.cells.owner.astype(np.int64)),
    }
    series = list(frames(solids, run))
    for number, frame in enumerate(series):
        # XDMF vectors have three components
        vectors = np.column_stack([frame.displacement, np.zeros(len(frame.displacement))])
        data[f"displacement_{number}"] = (("point", "xyz"), vectors)
        for name, values in solids.cell_data(frame.stress).items():
            if name != "block":
                data[f"{name}_{number}"] = (("cell",), values)
    with atomic_write(numbers) as draft:
        xr.Dataset(data).to_netcdf(draft, engine="netcdf4")
    with atomic_write(path) as draft:
        tree = _xdmf_tree(solids, series, len(mixed), numbers.name)
        tree.write(draft, "utf-8", xml_declaration=True)
    return path


def frames(solids: Solids, run: xr.Dataset) -> Iterator[FieldFrame]:
    """Yield the recorded fields of a run, then the frames of its fall."""
    if "q" not in run:
        raise InvalidInput(
            "the run has no fields to write: record them with "
            "time_history(..., record=Record(fields_every=10))"
        )
    for time, q in zip(run["frame_time"].values, run["q"].values, strict=True):
        yield FieldFrame(float(time), solids.displacement(q), solids.stress(q))
    if "fall_pose" not in run:
        return
    # loose blocks are rigid: points turn about the centroids, and stresses are zero
    block = solids.cells.block
    arms = solids.cells.places - solids.model.structure.centroids[block]
    stress = None if solids.model.cells.stress is None else np.zeros((len(solids.cells.owner), 3))
    for time, poses in zip(run["fall_time"].values, run["fall_pose"].values, strict=True):
        turned = rotate(arms, poses[block, 2])
        yield FieldFrame(float(time), poses[block, :2] + turned - arms, stress)


def _joint_data(run: xr.Dataset, time: float) -> dict[str, NDArray[Any]]:
    """Return resultants, gaps and flags of the joints at the recorded step nearest a time."""
    step = run.sel(time=time, method="nearest")
    data: dict[str, NDArray[Any]] = {"joint": np.arange(run.sizes["joint"], dtype=np.int64)}
    names = ("N", "V", "M", "eccentricity", "friction", "opening", "slip", "rotation")
    for name in (*names, "hinge", "slide", "open"):
        values = step[name].values
        data[name] = values.astype(np.uint8 if values.dtype == bool else float)
    return data


def _check_suffix(path: str | Path, suffix: str) -> Path:
    """Refuse a path with another suffix."""
    path = Path(path)
    if path.suffix != suffix:
        raise InvalidInput(f"{path} does not end in {suffix}: give a name that does")
    return path


def _xdmf_cell_type(size: int) -> tuple[int, ...]:
    """Return XDMF's cell type of a polygon, and its number of corners from five corners on."""
    return {3: (4,), 4: (5,)}.get(size, (3, size))


def _xdmf_tree(solids: Solids, series: list[FieldFrame], entries: int, file: str) -> ElementTree:
    """Return the XML tree that describes the arrays of the HDF5 file."""
    points, cells = len(solids.cells.places), str(len(solids.cells.polygons))
    root, name = Element("Xdmf", Version="3.0"), solids.model.structure.name
    grids = SubElement(SubElement(root, "Domain"), "Grid", Name=name, GridType="Collection")
    grids.set("CollectionType", "Temporal")

    def add_data(parent: Element, name: str, shape: str, kind: str = "Float") -> None:
        item = SubElement(parent, "DataItem", Dimensions=shape, NumberType=kind, Precision="8")
        item.set("Format", "HDF")
        item.text = f"{file}:/{name}"

    for number, frame in enumerate(series):
        grid = SubElement(grids, "Grid", Name=f"frame {number}", GridType="Uniform")
        SubElement(grid, "Time", Value=f"{frame.time:.9g}")
        topology = SubElement(grid, "Topology", TopologyType="Mixed", NumberOfElements=cells)
        add_data(topology, "cells", str(entries), "Int")
        add_data(SubElement(grid, "Geometry", GeometryType="XY"), "points", f"{points} 2")
        moved = {"Name": "displacement", "AttributeType": "Vector", "Center": "Node"}
        vectors = SubElement(grid, "Attribute", moved)
        add_data(vectors, f"displacement_{number}", f"{points} 3")
        for name in solids.cell_data(frame.stress):
            field = SubElement(grid, "Attribute", Name=name, AttributeType="Scalar", Center="Cell")
            # blocks do not change
            data, kind = (name, "Int") if name == "block" else (f"{name}_{number}", "Float")
            add_data(field, data, cells, kind)
    return ElementTree(root)
