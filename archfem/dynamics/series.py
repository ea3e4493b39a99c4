"""Runs as series of files: VTU and PVD for ParaView, XDMF and HDF5."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.files import in_one_stroke
from archfem.models.exchange.solids import Solids
from archfem.models.exchange.vtu import write_collection, write_vtu
from archfem.models.model import Model

JOINT_DATA = ("N", "V", "M", "eccentricity", "friction", "opening", "slip", "rotation")
FLAGS = ("hinge", "slide", "open")
"""What files tell of each joint, as far as a run has it."""

STRESSES = ("stress_xx", "stress_yy", "stress_xy")
"""Names of the components of stress."""


@dataclass(frozen=True, eq=False)
class Frame:
    """An instant of a run.

    Attributes:
        time: when [s].
        moved: displacement of every point (m, 2) [m].
        stress: mean stress of every polygon (p, 3) [Pa], or None.
    """

    time: float
    moved: Array
    stress: Array | None


def write_vtk(model: Model, run: xr.Dataset, path: str | Path) -> Path:
    """Write a run as a series for ParaView: blocks, and joints as the gaps between their faces.

    Blocks share no points, so that openings stay. Points bear `displacement` [m], cells the number
    of their `block` and, where blocks deform, mean stresses `stress_xx`, `stress_yy`, `stress_xy`
    [Pa]; warp by displacement to see what moves. The second part has a quadrilateral for each
    joint, flat at rest, which bears N, V, M, eccentricity, opening, slip and flags.

    Args:
        model: that made the run.
        run: with fields.
        path: of the list, *.pvd; the files it names stand in a folder beside it.

    Returns:
        The list.

    Raises:
        InvalidInput: the run has no fields, or is another model's; or the name ends otherwise.
    """
    path = _named(path, ".pvd")
    solids, folder, entries = Solids(model), path.with_suffix(""), []
    joints = [np.arange(4 * k, 4 * k + 4) for k in range(len(model.structure.joints))]
    for number, frame in enumerate(frames(solids, run)):
        files = [folder / f"{part}_{number:05d}.vtu" for part in ("blocks", "joints")]
        data: dict[str, NDArray[Any]] = {"block": solids.owner.astype(np.int64)}
        if frame.stress is not None:
            data |= dict(zip(STRESSES, frame.stress.T, strict=True))
        write_vtu(files[0], solids.places, solids.polygons, {"displacement": frame.moved}, data)
        gaps = solids.between(frame.moved).reshape(-1, 2)
        corners = solids.corners.reshape(-1, 2)
        write_vtu(files[1], corners, joints, {"displacement": gaps}, _of_joints(run, frame.time))
        names = [f"{folder.name}/{file.name}" for file in files]
        entries += [(frame.time, part, name) for part, name in enumerate(names)]
    write_collection(path, entries)
    return path


def write_xdmf(model: Model, run: xr.Dataset, path: str | Path) -> Path:
    """Write the fields of a run as XDMF: a small text, and an HDF5 file of all numbers beside it.

    Blocks share no points, so that openings stay; displacements [m] are at points and mean stresses
    [Pa] in cells, as for `write_vtk`.

    Args:
        model: that made the run.
        run: with fields.
        path: of the text, *.xdmf; the numbers get the same name with .h5.

    Returns:
        The text.

    Raises:
        InvalidInput: the run has no fields, or is another model's; or the name ends otherwise.
    """
    path = _named(path, ".xdmf")
    solids, heavy = Solids(model), path.with_suffix(".h5")
    mixed = np.concatenate([[*_kind(len(cell)), *cell] for cell in solids.polygons])
    data = {
        "points": (("point", "axis"), solids.places),
        "cells": (("entry",), mixed.astype(np.int64)),
        "block": (("cell",), solids.owner.astype(np.int64)),
    }
    shown = list(frames(solids, run))
    for number, frame in enumerate(shown):
        space = np.column_stack([frame.moved, np.zeros(len(frame.moved))])
        data[f"displacement_{number}"] = (("point", "xyz"), space)
        if frame.stress is not None:
            for name, row in zip(STRESSES, frame.stress.T, strict=True):
                data[f"{name}_{number}"] = (("cell",), row)
    with in_one_stroke(heavy) as draft:
        xr.Dataset(data).to_netcdf(draft, engine="netcdf4")
    with in_one_stroke(path) as draft:
        draft.write_text(_xdmf(solids, shown, len(mixed), heavy.name), encoding="utf-8")
    return path


def frames(solids: Solids, run: xr.Dataset) -> Iterator[Frame]:
    """Return the instants of a run of which fields were kept, those of a fall at the end.

    Args:
        solids: of the model that made it.
        run: with fields.

    Yields:
        Each instant.

    Raises:
        InvalidInput: the run has no fields, or is another model's.
    """
    if "q" not in run:
        raise InvalidInput(
            "the run has no fields to write: record them with "
            "time_history(..., record=Record(fields_every=10))"
        )
    for time, q in zip(run["frame_time"].values, run["q"].values, strict=True):
        yield Frame(float(time), solids.displacement(q), solids.stress(q))
    if "fall_pose" not in run:
        return
    blocks = solids.model.structure.blocks
    arm = solids.places - np.array([block.centroid for block in blocks])[solids.block]
    for time, poses in zip(run["fall_time"].values, run["fall_pose"].values, strict=True):
        own = poses[solids.block]
        c, s = np.cos(own[:, 2]), np.sin(own[:, 2])
        turned = np.column_stack([c * arm[:, 0] - s * arm[:, 1], s * arm[:, 0] + c * arm[:, 1]])
        stress = None if solids.model.cells.stress is None else np.zeros((len(solids.owner), 3))
        yield Frame(float(time), own[:, :2] + turned - arm, stress)


def _of_joints(run: xr.Dataset, time: float) -> dict[str, NDArray[Any]]:
    """What the joints do at the recorded step nearest a time; nothing after it."""
    step = run.sel(time=time, method="nearest")
    found = {name: step[name].values for name in (*JOINT_DATA, *FLAGS) if name in run}
    kinds = {name: np.uint8 if each.dtype == bool else float for name, each in found.items()}
    kept = {name: each.astype(kinds[name]) for name, each in found.items()}
    return {"joint": np.arange(run.sizes["joint"], dtype=np.int64), **kept}


def _named(path: str | Path, suffix: str) -> Path:
    """A path that must end so."""
    path = Path(path)
    if path.suffix != suffix:
        raise InvalidInput(f"{path} does not end in {suffix}: give a name that does")
    return path


def _kind(size: int) -> tuple[int, ...]:
    """XDMF's number of a kind of polygon, and the count of its corners where that needs it."""
    return {3: (4,), 4: (5,)}.get(size, (3, size))


def _xdmf(solids: Solids, shown: list[Frame], entries: int, heavy: str) -> str:
    """The text that tells what the numbers are."""
    points, cells = len(solids.places), len(solids.polygons)

    def item(name: str, shape: str, kind: str = "Float") -> str:
        return (
            f'<DataItem Dimensions="{shape}" NumberType="{kind}" Precision="8" Format="HDF">'
            f"{heavy}:/{name}</DataItem>"
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
    for number, frame in enumerate(shown):
        lines += [
            f'<Grid Name="frame {number}" GridType="Uniform"><Time Value="{frame.time:.9g}"/>',
            f'<Topology TopologyType="Mixed" NumberOfElements="{cells}">',
            item("cells", str(entries), "Int") + "</Topology>",
            f'<Geometry GeometryType="XY">{item("points", f"{points} 2")}</Geometry>',
            attribute("block", "Scalar", "Cell", item("block", str(cells), "Int")),
            attribute(
                "displacement", "Vector", "Node", item(f"displacement_{number}", f"{points} 3")
            ),
        ]
        if frame.stress is not None:
            lines += [
                attribute(name, "Scalar", "Cell", item(f"{name}_{number}", str(cells)))
                for name in STRESSES
            ]
        lines.append("</Grid>")
    return "\n".join([*lines, "</Grid></Domain></Xdmf>\n"])
