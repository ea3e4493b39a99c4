"""Convergence of a finding over mesh and time step, and time against error of a case.

References:
    Richardson, Phil. Trans. R. Soc. A 210 (1911) 307-357. Roache, J. Fluids Eng. 116 (1994) 405-413
    and Celik and others, J. Fluids Eng. 130 (2008) 078001 for the grid convergence index.
    Eça and Hoekstra, J. Comput. Phys. 262 (2014) 104-130 for data without a plausible order.
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
from archfem._validation import check_array, validate_arguments, validate_methods
from archfem.cases.case import Case, case_of
from archfem.dynamics.accuracy import Accuracy, TimedRun, compare_runs, plan_comparison, time_run
from archfem.dynamics.analysis import Analysis
from archfem.dynamics.model_selection import Setting
from archfem.dynamics.schemes import Viscous
from archfem.errors import DidNotConverge, InvalidInput
from archfem.motion.motion import Motion
from archfem.studies.cache import dead_load_of, ground_motion
from archfem.studies.evaluators import Findings
from archfem.studies.study import Study


@dataclass(frozen=True, eq=False)
class Convergence:
    """Values of a finding over sizes of cells or time steps.

    Attributes:
        sizes: sizes relative to the finest, the coarsest first (n,) [-].
        values: values of the finding (n,).
        order: observed order of the last three values; NaN if their differences do not decrease.
        limit: value at size zero by Richardson's extrapolation; the finest value if the order is
            not plausible.
        error: grid convergence index of the finest value, in its unit; three times the range of the
            last three values if the order is not plausible.
    """

    sizes: Array
    values: Array
    order: float
    limit: float
    error: float


@validate_arguments
def converged(sizes: Sequence[float] | Array, values: Sequence[float] | Array) -> Convergence:
    """Return observed order, extrapolated limit and error bar of a value.

    An order from 0.5 to 2.1 is plausible: beyond, values are not extrapolated.

    Args:
        sizes: sizes of cells or steps, three or more, in any unit, the coarsest first (n,).
        values: values (n,).

    Raises:
        InvalidInput: there are fewer than three sizes, they do not decrease, or a value is not
            finite.
    """
    h, f = check_array(sizes, "sizes"), check_array(values, "values")
    if h.ndim != 1 or len(h) < 3 or h.shape != f.shape or (np.diff(h) >= 0.0).any() or h[-1] <= 0.0:
        raise InvalidInput(
            f"values {f.tolist()} at sizes {h.tolist()}: give three or more, the coarsest first"
        )
    last, before = float(f[-1] - f[-2]), float(f[-2] - f[-3])
    ratio = float(h[-2] / h[-1])
    monotonic = last != 0.0 and before / last > 1.0
    order = _solve_order(before / last, ratio, float(h[-3] / h[-2])) if monotonic else nan
    # The order of elements and schemes is 2 at most: a larger observed order is chance.
    if not 0.5 <= order <= 2.1:
        return Convergence(h / h[-1], f, order, float(f[-1]), 3.0 * float(np.ptp(f[-3:])))
    correction = last / (ratio**order - 1.0)
    # 1.25 is the safety factor of Roache
    return Convergence(h / h[-1], f, order, float(f[-1]) + correction, 1.25 * abs(correction))


def _solve_order(changes: float, ratio: float, coarser: float) -> float:
    """Solve changes = (c^p - 1) r^p / (r^p - 1) for the order p by fixed-point iteration."""
    order = log(changes) / log(ratio)
    for _ in range(100):
        factor = (ratio**order - 1.0) / (coarser**order - 1.0)
        previous, order = order, max(log(changes * factor) / log(ratio), 1e-6)
        if abs(order - previous) < 1e-12:
            break
    return order


@validate_methods
@dataclass(frozen=True, eq=False)
class MeshSensitivity:
    """Sensitivity of a finding to mesh, time step, joint quadrature and fidelity.

    Attributes:
        quantity: name of the finding.
        mesh: convergence over the cells of a block.
        step: convergence over time steps; None without time steps.
        rules: values by joint quadrature.
        rungs: fidelities and their values.
        table: all findings of all points, over `point`.
    """

    quantity: str
    mesh: Convergence
    step: Convergence | None
    rules: Mapping[str, float]
    rungs: Mapping[str, float]
    table: xr.Dataset

    @property
    def error(self) -> float:
        """Sum of the error bars of mesh and step, in the unit of the finding."""
        return self.mesh.error + (0.0 if self.step is None else self.step.error)

    @property
    def paths(self) -> dict[str, tuple[Array, Array, float, float]]:
        """Sizes, values, limit and error bar of mesh and step, as `draw_convergence` draws them."""
        found = {"mesh": self.mesh} | ({} if self.step is None else {"step": self.step})
        return {name: (x.sizes, x.values, x.limit, x.error) for name, x in found.items()}

    def of(self, quantity: str) -> "MeshSensitivity":
        """Return the sensitivity of another finding.

        Args:
            quantity: name of the finding.

        Raises:
            InvalidInput: there is no such finding, or a point of the mesh or step failed.
        """
        return _sensitivity(self.table, quantity)

    def text(self) -> str:
        """Return a table with a line for mesh, step, and each quadrature and fidelity."""
        rows = []
        for name, path in {"mesh": self.mesh, "step": self.step}.items():
            if path is not None:
                order = f"{path.order:.2f}" if isfinite(path.order) else "-"
                finest, limit = f"{path.values[-1]:.6g}", f"{path.limit:.6g}"
                rows.append([name, finest, order, limit, f"{path.error:.2g}"])
        for kind, values in (("quadrature", self.rules), ("fidelity", self.rungs)):
            rows += [[f"{kind} {name}", f"{v:.6g}", "", "", ""] for name, v in values.items()]
        return align_columns([self.quantity, "value", "order", "limit", "error bar"], rows)


@validate_arguments
def mesh_sensitivity(  # noqa: PLR0913  (each varied setting is a keyword with its usual values)
    subject: Analysis | Case,
    quantity: str = "eccentricity",
    compute: Any = None,
    *,
    motion: Motion | None = None,
    cells: Sequence[int] = (2, 4, 8),
    steps: Sequence[float] = (0.01, 0.005, 0.0025),
    rules: Sequence[str] = ("nodal", "lobatto", "gauss", "exact"),
    rungs: Sequence[str] = ("rigid", "faces", "condensed"),
    folder: str | Path | None = None,
    workers: int | None = None,
) -> MeshSensitivity:
    """Compute the sensitivity of a finding to mesh, time step, joint quadrature and fidelity.

    One setting at a time differs from the finest mesh, the finest step, and the quadrature and
    fidelity of the case.

    Args:
        subject: analysis or case.
        quantity: name of the finding.
        compute: function to evaluate, as for a `Study`; by default "history" with a motion, else
            "dead load".
        motion: motion of an analysis, or in place of that of a case.
        cells: cells of a block in each direction, three or more numbers, the coarsest first.
        steps: time steps, three or more, the coarsest first [s].
        rules: joint quadratures.
        rungs: fidelities.
        folder: folder for finished points, as for `Study.run`.
        workers: number of processes, as for `Study.run`.

    Returns:
        Observed order, extrapolated value and error bar over mesh and step, and the values by
        quadrature and fidelity; `of(name)` returns those of another finding.

    Raises:
        InvalidInput: there is no such finding, or a point of the mesh or step failed.
    """
    case = case_of(subject, motion)
    compute = compute or ("history" if case.has_motion else "dead load")
    finest: dict[str, Any] = {"model.cells": [cells[-1], cells[-1]]}
    variations: list[tuple[str, str, dict[str, Any]]]
    variations = [("mesh", f"{1.0 / n:.17g}", {"model.cells": [n, n]}) for n in cells]
    if compute != "dead load":
        finest["analysis.dt"] = steps[-1]
        variations += [("step", f"{dt:.17g}", {"analysis.dt": dt}) for dt in steps]
    variations += [("quadrature", rule, {"model.quadrature": rule}) for rule in rules]
    variations += [("fidelity", name, {"model.fidelity": name}) for name in rungs]
    points = [finest | changes for *_, changes in variations]
    study = Study(case, points, compute, title=f"{case.title}: mesh and step")
    table = study.run(folder, workers=workers)
    kinds, values = (np.array(c, dtype=object) for c in list(zip(*variations, strict=True))[:2])
    table = table.assign_coords(varied=("point", kinds), to=("point", values))
    return _sensitivity(table, quantity)


def _sensitivity(table: xr.Dataset, quantity: str) -> MeshSensitivity:
    """Evaluate the points of the study of `mesh_sensitivity` for one finding."""
    if quantity not in table or table[quantity].dtype == object:
        numeric = [name for name in table.data_vars if table[name].dtype != object]
        raise InvalidInput(
            f"quantity '{quantity}' is none of the numbers that were computed: {numeric}"
            + "".join({f"; {error}" for error in table["error"].values if error})
        )

    def select(kind: str) -> dict[str, float]:
        rows = table["varied"].values == kind
        values = table[quantity].values[rows].tolist()
        return dict(zip(table["to"].values[rows].tolist(), values, strict=True))

    paths = [select("mesh"), select("step")]
    invalid = [value for path in paths for value in path.values() if not abs(value) < inf]
    if invalid:
        errors = "; ".join(sorted({error for error in table["error"].values if error}))
        raise InvalidInput(
            f"'{quantity}' is {invalid[0]} for a mesh or a step: take another finding. {errors}"
        )
    mesh, *step = (converged(list(map(float, path)), list(path.values())) for path in paths if path)
    rules, rungs = select("quadrature"), select("fidelity")
    return MeshSensitivity(quantity, mesh, step[0] if step else None, rules, rungs, table)


@validate_arguments
def case_accuracy(
    case: Case, folder: str | Path | None = None, *, workers: int | None = 1
) -> Accuracy:
    """Compare processor time and error of fidelities, meshes, quadratures and steps of a case.

    It is `archfem.accuracy` as a study, from the dead load of the case.

    Args:
        case: case with one motion; its own fidelity, mesh, quadrature and time step are not used.
        folder: folder for finished settings, as for `Study.run`.
        workers: number of processes; several share the memory bandwidth, which raises the processor
            time by a few per cent.

    Returns:
        All settings with times and errors, the reference and the error of the reference.

    Raises:
        InvalidInput: the case has no motion, or several; or as for `Study.run`.
        DidNotConverge: the reference failed.
        StudyStopped: as for `Study.run`; finished settings are kept.
    """
    motion = ground_motion(case)
    settings, _, damping = plan_comparison(case.structure, case.analysis.damping)
    varied = ("fidelity", "cells", "quadrature", "quadrature_points", "tolerance")
    study = Study(
        case.without(*(f"model.{key}" for key in varied)),
        [_case_keys(setting) for setting in settings],
        {"name": evaluate_time, "damping": damping},
        title=f"{case.title}: speed against error",
    )
    table = study.run(folder, workers=workers)
    if "peaks" not in table:
        raise DidNotConverge(f"no setting ran: {table['error'].values[0] or 'each failed'}")
    runs = [_to_run(table.isel(point=k)) for k in range(len(settings))]
    return compare_runs(settings, runs, motion.duration, case.analysis.tolerance)


def _case_keys(setting: Setting) -> dict[str, Any]:
    """Values of a setting by their keys in a case file."""
    model = setting.discretisation
    keys: dict[str, Any] = {
        "model.fidelity": model.fidelity,
        "model.cells": list(model.cells),
        "model.quadrature": model.quadrature,
        "analysis.dt": setting.dt,
    }
    points = model.quadrature_points
    return keys if points is None else keys | {"model.quadrature_points": points}


def evaluate_time(case: Case, damping: Viscous | None) -> Findings:
    """Return the processor time of a run of a case, and the largest |e| of each joint."""
    result, motion = dead_load_of(case), ground_motion(case)
    assert case.analysis.dt is not None  # each setting has a step
    options = {"start": result.dead, "damping": damping}
    run = time_run(result.dead.model, motion, case.analysis.dt, **options)
    findings: Findings = {"coordinates": run.size, "seconds": run.seconds}
    return findings if run.peaks is None else findings | {"peaks": run.peaks}


def _to_run(row: xr.Dataset) -> TimedRun:
    """Convert the row of a point to a timed run; the row of a failed point is NaN."""
    if not row["coordinates"].notnull():
        return TimedRun(0, inf, None)
    peaks = row["peaks"].values
    failed = bool(np.isnan(peaks).any())
    return TimedRun(int(row["coordinates"]), float(row["seconds"]), None if failed else peaks)
