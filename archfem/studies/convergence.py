"""How far a finding hangs on mesh, step, joint quadrature and rung: order, limit and error bar.

References:
    Richardson, Phil. Trans. R. Soc. A 210 (1911) 307-357. Roache, J. Fluids Eng. 116 (1994) 405-413
    and Celik and others, J. Fluids Eng. 130 (2008) 078001 for the grid convergence index.
    Eça and Hoekstra, J. Comput. Phys. 262 (2014) 104-130 where no order can be believed.

Speed against error of a case over rungs, meshes, rules and steps: a study, a point a setting.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite, log, nan
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from archfem._files import align_columns
from archfem._typing import Array
from archfem.cases.case import Case
from archfem.cases.run import expected_damping
from archfem.dynamics.accuracy import (
    Accuracy,
    Setting,
    TimedRun,
    candidate_settings,
    compare_runs,
    reference_settings,
    time_run,
)
from archfem.dynamics.schemes import Viscous
from archfem.errors import DidNotConverge, InvalidInput
from archfem.models.builder import build
from archfem.studies.cache import dead_load_of, ground_motion
from archfem.studies.evaluators import Findings
from archfem.studies.study import Study

# Factors on the estimated error: where an order is seen, and where none is
SAFETY, UNSURE = 1.25, 3.0

# Orders that are believed of elements and schemes whose order is 2: more is chance
ORDERS = 0.5, 2.1


@dataclass(frozen=True, eq=False)
class Convergence:
    """A value over sizes of cells or steps.

    Attributes:
        sizes: relative to the finest (n,), the coarsest first [-].
        values: at each (n,).
        order: observed from the last three; NaN where they do not approach each other steadily.
        limit: value at size zero by Richardson's extrapolation, or the finest where no order is
            seen that can be believed.
        error: grid convergence index of the finest value, in its unit; where no order can be
            believed, three times the range of the last three values.
    """

    sizes: Array
    values: Array
    order: float
    limit: float
    error: float


def converged(sizes: Any, values: Any) -> Convergence:
    """Return order, limit and error bar of a value over three sizes or more.

    Args:
        sizes: of cells or steps (n,), any unit, the coarsest first.
        values: at each (n,).

    Raises:
        InvalidInput: there are fewer than three, sizes do not fall, or a value is no number.
    """
    h, f = np.array(sizes, dtype=float), np.array(values, dtype=float)
    if len(h) < 3 or h.shape != f.shape or (np.diff(h) >= 0.0).any() or not np.isfinite(f).all():
        raise InvalidInput(
            f"values {f.tolist()} at sizes {h.tolist()}: give three or more, the coarsest first"
        )
    last, before = float(f[-1] - f[-2]), float(f[-2] - f[-3])
    ratio = float(h[-2] / h[-1])
    steady = last != 0.0 and before / last > 1.0
    order = _order(before / last, ratio, float(h[-3] / h[-2])) if steady else nan
    if not ORDERS[0] <= order <= ORDERS[1]:
        return Convergence(h / h[-1], f, order, float(f[-1]), UNSURE * float(np.ptp(f[-3:])))
    rest = last / (ratio**order - 1.0)
    return Convergence(h / h[-1], f, order, float(f[-1]) + rest, SAFETY * abs(rest))


def _order(changes: float, ratio: float, coarser: float) -> float:
    """The order p of (c^p - 1) r^p / (r^p - 1), the ratio of two changes, by fixed points."""
    order = log(changes) / log(ratio)
    for _ in range(100):
        more = (ratio**order - 1.0) / (coarser**order - 1.0)
        now = max(log(changes * more) / log(ratio), 1e-6)
        if abs(now - order) < 1e-12:
            break
        order = now
    return order


@dataclass(frozen=True, eq=False)
class MeshSensitivity:
    """What a finding hangs on besides the structure.

    Attributes:
        quantity: name of the finding.
        mesh: over cells a block.
        step: over time steps; None where time is not stepped.
        rules: values by quadrature of the joints.
        rungs: values by rung.
        table: all findings of all points, by `point`.
    """

    quantity: str
    mesh: Convergence
    step: Convergence | None
    rules: Mapping[str, float]
    rungs: Mapping[str, float]
    table: xr.Dataset

    @property
    def error(self) -> float:
        """Error bars of mesh and step together, in the unit of the finding."""
        return self.mesh.error + (0.0 if self.step is None else self.step.error)

    def of(self, quantity: str) -> "MeshSensitivity":
        """Return the same of another finding.

        Args:
            quantity: its name.

        Raises:
            InvalidInput: there is no such finding, or a point that it needs failed.
        """
        return _told(self.table, quantity)

    def text(self) -> str:
        """One line for each of these."""
        rows = []
        for name, found in (("mesh", self.mesh), ("step", self.step)):
            if found is not None:
                order = f"{found.order:.2f}" if isfinite(found.order) else "-"
                rows.append([name, f"{found.values[-1]:.6g}", order, f"{found.limit:.6g}",
                             f"{found.error:.2g}"])  # fmt: skip
        for kind, values in (("rule", self.rules), ("rung", self.rungs)):
            rows += [[f"{kind} {name}", f"{each:.6g}", "", "", ""] for name, each in values.items()]
        return align_columns([self.quantity, "value", "order", "limit", "error bar"], rows)


def mesh_sensitivity(  # noqa: PLR0913  (what differs, each with its usual values)
    case: Case,
    quantity: str = "eccentricity",
    find: Any = None,
    *,
    cells: Sequence[int] = (2, 4, 8),
    steps: Sequence[float] = (0.01, 0.005, 0.0025),
    rules: Sequence[str] = ("nodal", "lobatto", "gauss", "exact"),
    rungs: Sequence[str] = ("rigid", "faces", "condensed"),
    folder: str | Path | None = None,
    workers: int | None = None,
) -> MeshSensitivity:
    """Find how a finding of a case hangs on mesh, step, joint quadrature and rung.

    One differs at a time from the finest mesh, the finest step, and the case's own rule and rung.

    Args:
        case: with or without a motion.
        quantity: name of a finding.
        find: what is to be found, as for `Study.of`; by default "history" where the case has a
            motion, else "dead load".
        cells: a block, each way; three or more, the coarsest first.
        steps: in time [s], likewise.
        rules: quadratures of the joints.
        rungs: fidelities.
        folder: as for `Study.run`, and `workers`.
        workers: likewise.

    Returns:
        Observed order, Richardson's value and error bar over mesh and step, and values by rule and
        rung; `of(name)` gives them of every other finding.

    Raises:
        InvalidInput: there is no such finding, or a point of the mesh or the steps failed.
    """
    find = find or ("history" if case.has_motion else "dead load")
    timed = find != "dead load"
    base: dict[str, Any] = {"model.cells": [cells[-1], cells[-1]]}
    base |= {"analysis.dt": steps[-1]} if timed else {}
    points = [base | {"model.cells": [n, n]} for n in cells]
    points += [base | {"analysis.dt": step} for step in steps] if timed else []
    points += [base | {"model.quadrature": rule} for rule in rules]
    points += [base | {"model.fidelity": rung} for rung in rungs]
    study = Study.of(case, points, find, title=f"{case.title}: mesh and step")
    found = study.run(folder, workers=workers)
    marks = [("mesh", f"{1.0 / n:.17g}") for n in cells]
    marks += [("step", f"{step:.17g}") for step in steps] if timed else []
    marks += [("rule", rule) for rule in rules] + [("rung", rung) for rung in rungs]
    kinds, values = (np.array(each, dtype=object) for each in zip(*marks, strict=True))
    return _told(found.assign_coords(varied=("point", kinds), to=("point", values)), quantity)


def _told(table: xr.Dataset, quantity: str) -> MeshSensitivity:
    """What the points of a study tell of one finding."""
    if quantity not in table or table[quantity].dtype == object:
        known = [name for name in table.data_vars if table[name].dtype != object]
        raise InvalidInput(
            f"quantity '{quantity}' is none of the numbers that were found: {known}"
            + "".join({f"; {error}" for error in table["error"].values if error})
        )

    def along(kind: str) -> dict[str, float]:
        there = table["varied"].values == kind
        values = table[quantity].values[there].tolist()
        return dict(zip(table["to"].values[there].tolist(), values, strict=True))

    mesh, step = (along(kind) for kind in ("mesh", "step"))
    broken = [value for value in (*mesh.values(), *step.values()) if not abs(value) < inf]
    if broken:
        errors = "; ".join(sorted({error for error in table["error"].values if error}))
        raise InvalidInput(
            f"'{quantity}' is {broken[0]} for a mesh or a step: take another finding. {errors}"
        )
    paths = [
        converged([float(size) for size in found], list(found.values())) if found else None
        for found in (mesh, step)
    ]
    assert paths[0] is not None
    return MeshSensitivity(quantity, paths[0], paths[1], along("rule"), along("rung"), table)


# Keys of a case's model that settings say
VARIED = ("fidelity", "cells", "quadrature", "quadrature_points", "tolerance")


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
    references = reference_settings(case.structure)
    damping = expected_damping(case)
    if callable(damping):
        damping = damping(build(case.structure, references[0].discretisation))
    settings = [*references, *candidate_settings(case.structure)]
    model = {key: v for key, v in case.settings.get("model", {}).items() if key not in VARIED}
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
    return compare_runs(settings, runs, motion.duration, case.tolerance)


def _changes(setting: Setting) -> dict[str, Any]:
    """What a setting is in a case file."""
    asked = setting.discretisation
    told: dict[str, Any] = {
        "model.fidelity": asked.fidelity,
        "model.cells": list(asked.cells),
        "model.quadrature": asked.quadrature,
        "analysis.dt": setting.dt,
    }
    return told if asked.points is None else told | {"model.quadrature_points": asked.points}


def _run(row: xr.Dataset) -> TimedRun:
    """A point of the table: one that ended in an error has neither size nor peaks."""
    if not row["coordinates"].notnull():
        return TimedRun(0, inf, None)
    peaks = row["peaks"].values
    failed = bool(np.isnan(peaks).any())
    return TimedRun(int(row["coordinates"]), float(row["seconds"]), None if failed else peaks)


def timed_case(case: Case, damping: Viscous | None) -> Findings:
    """Return how long a run of a case takes, and the largest |e| of each joint."""
    rest, motion = dead_load_of(case), ground_motion(case)
    run = time_run(rest.dead.model, motion, damping, case.analysis["dt"], start=rest.dead)
    found: Findings = {"coordinates": run.size, "seconds": run.seconds}
    return found if run.peaks is None else found | {"peaks": run.peaks}
