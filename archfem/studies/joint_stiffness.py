"""Influence of the joint stiffness on the findings of a case."""

from pathlib import Path
from typing import Any

import xarray as xr

from archfem._validation import validate_arguments
from archfem.cases.case import Case
from archfem.masonry.joint_closing import JointStiffness as JointStiffness
from archfem.studies.study import Study


@validate_arguments
def stiffness_report(
    case: Case,
    stiffness: JointStiffness,
    find: Any = "history",
    *,
    contact: str = "stone to stone",
    folder: str | Path | None = None,
    workers: int | None = None,
) -> xr.Dataset:
    """Compute the influence of the joint stiffness on the findings of a case.

    Args:
        case: case of the structure.
        stiffness: range of the stiffness.
        find: function to evaluate, as `compute` of a `Study`.
        contact: name of the contact whose stiffness is varied.
        folder: folder for finished points, as for `Study.run`.
        workers: number of processes, as for `Study.run`.

    Returns:
        The findings over `point`: usual values, k_n low, k_n high, k_s low, k_s high;
        `archfem.view.draw_tornado` draws them.

    Raises:
        InvalidInput: the function is invalid.
    """
    ranges = {
        f"contacts.{contact}.normal_stiffness": stiffness.normal,
        f"contacts.{contact}.shear_stiffness": stiffness.shear,
    }
    usual = {key: values[1] for key, values in ranges.items()}
    points = [usual, *(usual | {key: ranges[key][end]} for key in ranges for end in (0, 2))]
    return Study(case, points, find).run(folder, workers=workers)
