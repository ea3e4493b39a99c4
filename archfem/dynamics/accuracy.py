"""Processor time against error of a run, over fidelities, meshes, quadratures and time steps."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from time import process_time
from typing import Any

import numpy as np
from tqdm import tqdm

from archfem._files import align_columns
from archfem._typing import Array
from archfem._validation import validate_arguments
from archfem.dynamics.analysis import Analysis
from archfem.dynamics.damping import resolve_effective_damping
from archfem.dynamics.error_estimation import largest_difference, severe_motion
from archfem.dynamics.history import Ending, History
from archfem.dynamics.model_selection import Setting, exact_discretisation, stone_fidelity
from archfem.dynamics.recorder import Record
from archfem.dynamics.schemes import EffectiveDamping, Viscous
from archfem.dynamics.time_history import time_history
from archfem.errors import DidNotConverge
from archfem.joints.criteria import assessed_joints, eccentricity_magnitude
from archfem.masonry.structure import Structure
from archfem.models.builder import build
from archfem.models.discretisation import Discretisation
from archfem.models.model import Model
from archfem.motion.motion import Motion

# Settings tried by default; quadratures with their points on a facet (None: default), steps in [s]
TRIED_FIDELITIES = ("rigid", "faces", "condensed")
TRIED_MESHES = ((2, 2), (4, 4), (8, 8))
TRIED_QUADRATURES = (("nodal", None), ("lobatto", None), ("gauss", None), ("exact", None))
TRIED_TIME_STEPS = (0.01, 0.005, 0.0025)


@dataclass(frozen=True)
class TimedRun:
    """Number of coordinates, processor time and peak eccentricities of a run."""

    size: int  # number of coordinates
    seconds: float  # processor time of the time steps, without building the model [s]
    peaks: Array | None  # largest |e| of each assessed joint (n,) [-]; None for a failed run


@dataclass(frozen=True)
class SettingResult:
    """A setting, its processor time and its error."""

    setting: Setting
    size: int  # number of coordinates
    seconds: float  # processor time of the time steps, without building the model [s]
    error: float  # of the largest |e| of the worst joint [-]; infinite for a failed run


@dataclass(frozen=True)
class Accuracy:
    """Results of all settings of one structure and motion."""

    trials: tuple[SettingResult, ...]  # in the order tried
    reference: Setting  # with which all are compared
    # error of the reference, from twice its time step and half its cells [-]; errors much below it
    # are not significant
    reference_error: float
    duration: float  # of the motion [s]
    tolerance: float  # on the error, for `choice` [-]

    @property
    def front(self) -> tuple[SettingResult, ...]:
        """Pareto front of time and error, the fastest first."""
        front: list[SettingResult] = []
        for trial in sorted(self.trials, key=lambda trial: (trial.seconds, trial.error)):
            if not front or trial.error < front[-1].error:
                front.append(trial)
        return tuple(front)

    @property
    def choice(self) -> SettingResult | None:
        """The fastest setting within the tolerance, or None."""
        return next((trial for trial in self.front if trial.error <= self.tolerance), None)

    def table(self) -> str:
        """Return all settings as aligned text, the fastest first; a star marks the front."""
        front = set(self.front)
        head = ["setting", "coordinates", "time [s]", "× real time", "error in |e|", "front"]
        rows = [
            [
                trial.setting.label,
                str(trial.size),
                f"{trial.seconds:.3f}",
                # a setting that fails at once may take no measurable time
                f"{self.duration / trial.seconds:.0f}" if trial.seconds > 0.0 else "",
                f"{trial.error:.5f}" if np.isfinite(trial.error) else "failed",
                "*" if trial in front else "",
            ]
            for trial in sorted(self.trials, key=lambda trial: trial.seconds)
        ]
        return align_columns(head, rows)


@validate_arguments
def accuracy(
    structure: Structure | Analysis,
    motion: Motion | None = None,
    *,
    damping: Viscous | EffectiveDamping | str | None = None,
    rungs: Sequence[str] = TRIED_FIDELITIES,
    cells: Sequence[tuple[int, int]] = TRIED_MESHES,
    rules: Sequence[tuple[str, int | None]] = TRIED_QUADRATURES,
    steps: Sequence[float] = TRIED_TIME_STEPS,
    tolerance: float | None = None,
) -> Accuracy:
    """Compare processor time and error of fidelities, meshes, quadratures and time steps.

    The error of a setting is the largest difference, over the joints, of the largest |e| to that of
    a converged reference.

    Args:
        structure: structure of blocks and joints; or an `Analysis`, whose damping and tolerance
            are then the defaults.
        motion: ground motion; by default a synthetic one that brings |e| to 0.4.
        damping: damping of all runs, as for `time_history`; effective modes are those of the
            reference model.
        rungs: fidelities to try.
        cells: meshes to try; "rigid" takes the first number as facets on a joint.
        rules: quadratures to try, each with its points on a facet (None: 3).
        steps: time steps to try [s].
        tolerance: tolerance on the error, by which one setting is chosen [-]; by default 0.005.

    Returns:
        All settings with times and errors, the reference and the error of the reference.

    Raises:
        InvalidInput: a fidelity, rule or step is out of range.
        DidNotConverge: the reference itself failed.
    """
    given = structure if isinstance(structure, Analysis) else Analysis(structure)
    structure, damping = given.structure, damping or given.damping
    tried = rungs, cells, rules, steps
    settings, reference, viscous = plan_comparison(structure, damping, *tried)
    motion = motion or severe_motion(reference)
    runs = [
        time_run(build(structure, setting.discretisation), motion, setting.dt, damping=viscous)
        for setting in tqdm(settings, unit="setting", disable=None, leave=False)
    ]
    tolerance = given.tolerance if tolerance is None else tolerance
    return compare_runs(settings, runs, motion.duration, tolerance)


def plan_comparison(
    structure: Structure, damping: Viscous | EffectiveDamping | str | None, *tried: Any
) -> tuple[list[Setting], Model, Viscous | None]:
    """Return the settings to compare, the reference model, and the damping of all runs.

    The first two settings are the reference and the coarser one; `tried` is as for
    `candidate_settings`. Effective modes are those of the reference model.
    """
    references = reference_settings(structure)
    model = build(structure, references[0].discretisation)
    viscous, _ = resolve_effective_damping(damping, model, None)
    return [*references, *candidate_settings(structure, *tried)], model, viscous


def reference_settings(structure: Structure, dt: float = 0.00125) -> tuple[Setting, Setting]:
    """Return the reference, and a coarser setting for the error of the reference."""
    finest = exact_discretisation(structure, "condensed", (12, 12))
    halved = replace(finest, cells=(finest.through // 2, finest.along // 2))
    return Setting(finest, dt), Setting(halved, 2.0 * dt)


def candidate_settings(
    structure: Structure,
    fidelities: Sequence[str] = TRIED_FIDELITIES,
    meshes: Sequence[tuple[int, int]] = TRIED_MESHES,
    quadratures: Sequence[tuple[str, int | None]] = TRIED_QUADRATURES,
    steps: Sequence[float] = TRIED_TIME_STEPS,
) -> Iterator[Setting]:
    """Yield settings of all combinations of fidelity, quadrature, mesh and step, none twice."""
    for name in fidelities:
        fidelity = stone_fidelity(structure, name)
        for rule, count in quadratures:
            # rigid joints with exact facets have no mesh
            meshless = fidelity == "rigid" and rule == "exact"
            for cells in [(1, 1)] if meshless else meshes:
                settings = Discretisation(fidelity, cells, quadrature=rule, quadrature_points=count)
                yield from (Setting(settings, dt) for dt in steps)


def time_run(model: Model, motion: Motion, dt: float, **options: Any) -> TimedRun:
    """Run a model and measure the processor time; options are those of `time_history`."""
    # two steps beforehand, so that compilation is not measured
    time_history(model, motion.cut(0.0, max(2.0 * dt, motion.dt)), dt=dt, **options)
    begin = process_time()
    try:
        run = time_history(model, motion, dt=dt, record=Record(repeat=False), **options)
    except DidNotConverge:
        return TimedRun(model.size, process_time() - begin, None)
    if run.ending is Ending.INTERRUPTED:
        raise KeyboardInterrupt
    return TimedRun(model.size, process_time() - begin, peak_eccentricities(run))


def peak_eccentricities(run: History) -> Array:
    """Return the largest |e| of each assessed joint of a run (n,) [-]; 0.5 where it came apart."""
    return eccentricity_magnitude(assessed_joints(run.joints)).max("time").values


def compare_runs(
    settings: Sequence[Setting], runs: Sequence[TimedRun], duration: float, tolerance: float
) -> Accuracy:
    """Return the errors of runs; the first two are the reference and the coarser one."""
    reference = runs[0].peaks
    if reference is None:
        raise DidNotConverge(
            f"the reference, {settings[0].label}, did not reach the end of the motion: there is "
            "nothing to compare with; take a weaker motion (motion.scale) or a shorter one"
        )
    trials = []
    for setting, run in zip(settings, runs, strict=True):
        error = np.inf if run.peaks is None else largest_difference(run.peaks, reference)
        trials.append(SettingResult(setting, run.size, run.seconds, error))
    return Accuracy(tuple(trials[2:]), settings[0], trials[1].error, duration, tolerance)
