"""What joints carry as a table: CSV, Parquet or Excel."""

from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr

from archfem.errors import InvalidInput
from archfem.files import in_one_stroke

if TYPE_CHECKING:
    import pandas as pd

WRITERS = {".csv": "pandas", ".parquet": "pyarrow", ".xlsx": "openpyxl"}
"""What each kind of file is written with."""

ROWS = 1_048_575
"""Rows of a sheet of Excel below its head."""


def joint_table(joints: xr.Dataset) -> "pd.DataFrame":
    """Return what joints carry as a table with a row for each joint, at each instant if several.

    Args:
        joints: e.g. `run.joints`, `dead.joints` or `pushover.joints`.

    Returns:
        Columns `time` or whatever else the dataset goes over, `joint` (its number), name, part and
        role, and a column for each quantity, in its own unit.
    """
    over = [name for name in joints.dims if name != "joint"]
    names = [name for name, values in joints.items() if set(values.dims) <= {*over, "joint"}]
    numbered = joints[names]
    if "joint" not in numbered.coords:
        numbered = numbered.assign_coords(joint=range(joints.sizes["joint"]))
    frame = numbered.to_dataframe(dim_order=[*over, "joint"]).reset_index()
    first = [*over, "joint", *(key for key in ("name", "part", "role") if key in frame)]
    return frame[[*first, *(key for key in frame if key not in first)]]


def write_joint_table(joints: xr.Dataset, path: str | Path) -> Path:
    """Write what joints carry as a table.

    Args:
        joints: as for `joint_table`.
        path: *.csv, *.parquet or *.xlsx; folders are made.

    Returns:
        The file.

    Raises:
        InvalidInput: the name ends otherwise, what writes such files is not installed, or there are
            more rows than a sheet has.
    """
    path = Path(path)
    if path.suffix not in WRITERS:
        raise InvalidInput(f"{path}: a table is written as {', '.join(WRITERS)}")
    table = joint_table(joints)
    if path.suffix == ".xlsx" and len(table) > ROWS:
        raise InvalidInput(
            f"{len(table)} rows do not fit into a sheet of Excel, which has {ROWS}: write .parquet "
            "or .csv, or fewer steps"
        )
    try:
        with in_one_stroke(path) as draft:
            if path.suffix == ".csv":
                table.to_csv(draft, index=False)
            elif path.suffix == ".parquet":
                table.to_parquet(draft, index=False, engine="pyarrow")
            else:
                table.to_excel(draft, index=False, sheet_name="joints", engine="openpyxl")
    except ImportError as error:
        needed = WRITERS[path.suffix]
        raise InvalidInput(
            f"{path.suffix} is written with {needed}, which is not installed: pip install "
            f"'archfem[tables]', or write .csv"
        ) from error
    return path
