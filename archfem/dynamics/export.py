"""Series of files of a run: VTU and PVD for ParaView, XDMF and HDF5.

Blocks share no points, so that openings remain. Displacements [m] are at points and mean stresses
[Pa] in cells.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from archfem._files import atomic_write
from archfem._typing import Array
from archfem.errors import InvalidInput
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
        draft.write_text(_xdmf_text(solids, series, len(mixed), numbers.name), encoding="utf-8")
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
    blocks = solids.model.structure.blocks
    arm = solids.cells.places - np.array([block.centroid for block in blocks])[solids.cells.block]
    stress = None if solids.model.cells.stress is None else np.zeros((len(solids.cells.owner), 3))
    for time, poses in zip(run["fall_time"].values, run["fall_pose"].values, strict=True):
        pose = poses[solids.cells.block]
        c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
        turned = np.column_stack([c * arm[:, 0] - s * arm[:, 1], s * arm[:, 0] + c * arm[:, 1]])
        yield FieldFrame(float(time), pose[:, :2] + turned - arm, stress)


def _joint_data(run: xr.Dataset, time: float) -> dict[str, NDArray[Any]]:
    """Return resultants, gaps and flags of the joints at the recorded step nearest a time."""
    step = run.sel(time=time, method="nearest")
    data: dict[str, NDArray[Any]] = {"joint": np.arange(run.sizes["joint"], dtype=np.int64)}
    names = ("N", "V", "M", "eccentricity", "friction", "opening", "slip", "rotation")
    # files of early versions have no gaps
    for name in (*names, "hinge", "slide", "open"):
        if name in run:
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


def _xdmf_text(solids: Solids, series: list[FieldFrame], entries: int, file: str) -> str:
    """Return the XML text that describes the arrays of the HDF5 file."""
    points, cells = len(solids.cells.places), len(solids.cells.polygons)

    def item(name: str, shape: str, kind: str = "Float") -> str:
        return (
            f'<DataItem Dimensions="{shape}" NumberType="{kind}" Precision="8" Format="HDF">'
            f"{file}:/{name}</DataItem>"
        )

    def attribute(name: str, kind: str, centre: str, data: str) -> str:
        return (
            f'<Attribute Name="{name}" AttributeType="{kind}" Center="{centre}">{data}</Attribute>'
        )

    lines = [
        '<?xml version="1.0"?>',
        '<Xdmf Version="3.0"><Domain>',
        f'<Grid Name={quoteattr(solids.model.structure.name)} GridType="Collection" '
        'CollectionType="Temporal">',
    ]
    for number, frame in enumerate(series):
        vectors = item(f"displacement_{number}", f"{points} 3")
        lines += [
            f'<Grid Name="frame {number}" GridType="Uniform"><Time Value="{frame.time:.9g}"/>',
            f'<Topology TopologyType="Mixed" NumberOfElements="{cells}">',
            item("cells", str(entries), "Int") + "</Topology>",
            f'<Geometry GeometryType="XY">{item("points", f"{points} 2")}</Geometry>',
            attribute("block", "Scalar", "Cell", item("block", str(cells), "Int")),
            attribute("displacement", "Vector", "Node", vectors),
        ]
        lines += [
            attribute(name, "Scalar", "Cell", item(f"{name}_{number}", str(cells)))
            for name in solids.cell_data(frame.stress)
            if name != "block"
        ]
        lines.append("</Grid>")
    return "\n".join([*lines, "</Grid></Domain></Xdmf>\n"])
