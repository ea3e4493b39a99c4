"""The findings of a study as one table: an `xarray.Dataset`, and files that others read too."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from archfem.files import in_one_stroke
from archfem.netcdf import read_dataset, write_dataset
from archfem.studies.over import Axis
from archfem.studies.store import told_when_full
from archfem.studies.worker import Row

FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""How cells begin that a spreadsheet computes."""

NETCDF, CSV, PARQUET = "results.nc", "results.csv", "results.parquet"

ALONG = "entry"
"""Dimension of findings that are rows of numbers; shorter rows end in NaN."""


def table(axes: Sequence[Axis], rows: Sequence[Row], attributes: Mapping[str, Any]) -> xr.Dataset:
    """Return the rows of a study as a dataset.

    Args:
        axes: of the study.
        rows: of its points, the last axis fastest.
        attributes: of the dataset.

    Returns:
        A variable for each finding, over the axes, NaN or empty where a point failed, and `error`,
        the words that say why, empty where there is none.
    """
    shape = {axis.name: len(axis.rows) for axis in axes}
    found = xr.Dataset(attrs=dict(attributes))
    for axis in axes:
        for k, key in enumerate(axis.keys):
            found.coords[_place(key)] = _place(axis.name), _column([row[k] for row in axis.rows])
        if axis.name not in axis.keys:
            found.coords[axis.name] = axis.name, np.arange(len(axis.rows))
    dims, sizes = tuple(_place(name) for name in shape), tuple(shape.values())
    for name in dict.fromkeys(name for row in rows for name in row["found"]):
        values = [row["found"].get(name) for row in rows]
        key = _safe(name) if _safe(name) not in found.coords else f"{_safe(name)} found"
        if any(isinstance(value, list) for value in values):
            found[key] = (*dims, ALONG), _padded(values, rows).reshape(*sizes, -1)
        else:
            found[key] = dims, _column(values).reshape(sizes)
    found["error"] = dims, np.array([row["error"] for row in rows], dtype=object).reshape(sizes)
    return found


def load_tables() -> None:
    """Load what tables take, which is otherwise loaded when the first is made and written."""
    frame = xr.Dataset({"number": ("point", [0.0])}).to_dataframe()
    frame.to_csv()
    with suppress(ImportError):
        frame.to_parquet()


def write_table(found: xr.Dataset, folder: Path) -> list[Path]:
    """Write a table as NetCDF and CSV, and as Parquet where pyarrow is there.

    Rows of numbers are in the NetCDF file alone.

    Args:
        found: as by `table`.
        folder: for the files.

    Returns:
        The files.

    Raises:
        StudyStopped: the disk is full.
    """
    files = [folder / NETCDF, folder / CSV]
    flat = found.drop_dims(ALONG, errors="ignore")
    frame = flat.to_dataframe(dim_order=list(flat.dims) or None).reset_index()
    with told_when_full(folder):
        write_dataset(found, files[0])
        with in_one_stroke(files[1]) as draft:
            frame.map(_harmless).rename(columns=_harmless).to_csv(draft, index=False)
        with suppress(ImportError), in_one_stroke(folder / PARQUET) as draft:
            frame.to_parquet(draft, index=False)
            files.append(folder / PARQUET)
    return files


def _harmless(value: Any) -> Any:
    """A value that no spreadsheet takes for a formula: words that look like one are quoted."""
    return f"'{value}" if isinstance(value, str) and value.startswith(FORMULA) else value


def read_table(path: str | Path) -> xr.Dataset:
    """Return a table that `write_table` has written, loaded.

    Args:
        path: the NetCDF file.

    Raises:
        InvalidInput: there is none, or it is damaged.
    """
    return read_dataset(path, "table")


def _column(values: Sequence[Any]) -> Any:
    """Values as numbers where all are, else as words."""
    if all(value is None or isinstance(value, int | float) for value in values):
        return np.array([np.nan if value is None else float(value) for value in values])
    return np.array(["" if value is None else _words(value) for value in values], dtype=object)


def _words(value: Any) -> str:
    return value if isinstance(value, str) else repr(value)


def _padded(values: Sequence[Any], rows: Sequence[Row]) -> Any:
    """Rows of numbers (points, longest of the study); NaN beyond the end of each."""
    longest = max(len(v) for row in rows for v in row["found"].values() if isinstance(v, list))
    padded = np.full((len(values), longest), np.nan)
    for k, value in enumerate(values):
        if isinstance(value, list):
            padded[k, : len(value)] = value
    return padded


def _place(name: str) -> str:
    """A key as the name of a coordinate, in which NetCDF has no spaces."""
    return _safe(name).replace(" ", "_")


def _safe(name: str) -> str:
    """A name as NetCDF takes it."""
    return name.replace("/", "|")
