"""Speed against error of a case over rungs, meshes, rules and steps: a study, a point a setting."""

from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from archfem.cases.case import Case
from archfem.cases.run import expected_damping
from archfem.dynamics.schemes import Viscous
from archfem.dynamics.tradeoff import (
    Accuracy,
    Run,
    Setting,
    compared,
    references_of,
    settings_of,
    timed,
)
from archfem.errors import DidNotConverge
from archfem.models.build import build
from archfem.studies.finders import Found
from archfem.studies.memory import ground_motion, resting
from archfem.studies.study import Study

VARIED = ("fidelity", "cells", "quadrature", "points", "tolerance")
"""Keys of a case's model that settings say."""


def case_accuracy(
    case: Case, folder: str | Path | None = None, *, workers: int | None = 1, client: Any = None
) -> Accuracy:
    """Run a case over rungs × meshes × quadratures × time steps against a converged reference.

    Args:
        case: with one motion; its own rung, mesh, rule and step do not matter.
        folder: as for `Study.run`, and `workers` and `client`.
        workers: more than one share what there is of memory bandwidth: seconds are the processor's,
            and rise by a few per cent.
        client: likewise.

    Returns:
        As `archfem.accuracy`, of the structure under its dead load as the case says it was built.

    Raises:
        InvalidInput: the case has no motion, or several; or as `Study.run`.
        DidNotConverge: the reference failed.
        StudyStopped: the disk is full or the scheduler was lost; what was finished is kept.
    """
    motion = ground_motion(case)
    references = references_of(case.structure)
    damping = expected_damping(case)
    if callable(damping):
        damping = damping(build(case.structure, references[0].discretisation))
    settings = [*references, *settings_of(case.structure)]
    model = {key: value for key, value in case.model.items() if key not in VARIED}
    study = Study.of(
        Case.of({**case.settings, "model": model}, case.folder),
        [_changes(setting) for setting in settings],
        {"name": timed_case, "damping": damping},
        title=f"{case.title}: speed against error",
    )
    table = study.run(folder, workers=workers, client=client)
    if "peaks" not in table:
        raise DidNotConverge(f"no setting ran: {table['error'].values[0] or 'each failed'}")
    runs = [_run(table.isel(point=k)) for k in range(len(settings))]
    return compared(settings, runs, motion.duration, case.tolerance)


def _changes(setting: Setting) -> dict[str, Any]:
    """What a setting is in a case file."""
    asked = setting.discretisation
    told: dict[str, Any] = {
        "model.fidelity": asked.fidelity,
        "model.cells": list(asked.cells),
        "model.quadrature": asked.quadrature,
        "analysis.dt": setting.dt,
    }
    return told if asked.points is None else told | {"model.points": asked.points}


def _run(row: xr.Dataset) -> Run:
    """A point of the table: one that ended in an error has neither size nor peaks."""
    if not row["coordinates"].notnull():
        return Run(0, inf, None)
    peaks = row["peaks"].values
    failed = bool(np.isnan(peaks).any())
    return Run(int(row["coordinates"]), float(row["seconds"]), None if failed else peaks)


def timed_case(case: Case, damping: Viscous | None) -> Found:
    """Return how long a run of a case takes, and the largest |e| of each joint.

    Args:
        case: with one motion and a time step.
        damping: None is undamped.

    Returns:
        Its `coordinates`, `seconds` of the processor [s], and `peaks` [-], which a run that failed
        has none of.

    Raises:
        InvalidInput: it has no motion, or several.
        DidNotConverge: the structure does not stand.
    """
    rest, motion = resting(case), ground_motion(case)
    run = timed(rest.dead.model, motion, damping, case.analysis["dt"], start=rest.dead)
    found: Found = {"coordinates": run.size, "seconds": run.seconds}
    return found if run.peaks is None else found | {"peaks": run.peaks}
