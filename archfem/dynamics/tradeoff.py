"""Speed against error: one scene over rungs, meshes, quadratures and time steps."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from time import process_time

import numpy as np
from tqdm import tqdm

from archfem.arrays import Array
from archfem.dynamics.candidates import LEVELS, best, label, stones
from archfem.dynamics.history import Ending
from archfem.dynamics.ladder import Damping, damping_for
from archfem.dynamics.probe import largest_difference, peaks_of
from archfem.dynamics.schemes import Viscous
from archfem.dynamics.time_history import time_history
from archfem.errors import DidNotConverge
from archfem.masonry.structure import Structure
from archfem.models.build import build
from archfem.models.discretisation import Discretisation
from archfem.models.model import Model
from archfem.motion.motion import Motion
from archfem.statics.equilibrium import Equilibrium
from archfem.tables import aligned

RUNGS = ("rigid", "faces", "condensed")
CELLS = ((2, 2), (4, 4), (8, 8))
RULES = (("nodal", None), ("lobatto", None), ("gauss", None), ("exact", None))
STEPS = (0.01, 0.005, 0.0025)

FINE = 0.00125
"""Time step of the reference [s]."""


@dataclass(frozen=True)
class Setting:
    """A model and a time step.

    Attributes:
        discretisation: rung, mesh, and rule on the joints.
        dt: time step [s].
    """

    discretisation: Discretisation
    dt: float

    @property
    def label(self) -> str:
        """The setting in a few words."""
        return f"{label(self.discretisation)} {1e3 * self.dt:g} ms"


@dataclass(frozen=True)
class Run:
    """What a run of one setting came to.

    Attributes:
        size: coordinates.
        seconds: of the processor, to step through the motion once the model is built [s].
        peaks: largest |e| of each judged joint (n,) [-]; None where the run failed.
    """

    size: int
    seconds: float
    peaks: Array | None


@dataclass(frozen=True)
class Trial:
    """One setting, and what came of it.

    Attributes:
        setting: the model and the time step.
        size: coordinates.
        seconds: of the processor, to step through the motion once the model is built [s].
        error: in the largest |e| of the worst joint, against the reference [-]; infinite where
            the run failed.
    """

    setting: Setting
    size: int
    seconds: float
    error: float


@dataclass(frozen=True)
class Accuracy:
    """Settings tried on one scene.

    Attributes:
        trials: in the order tried.
        reference: the setting that all are compared with.
        doubt: error of the reference itself, by its difference to the same model at twice the
            time step and half the cells [-]; errors much below it mean nothing.
        duration: of the motion [s].
        tolerance: by which one is chosen [-].
    """

    trials: tuple[Trial, ...]
    reference: Setting
    doubt: float
    duration: float
    tolerance: float

    @property
    def front(self) -> tuple[Trial, ...]:
        """Settings than which none is both faster and more accurate, the fastest first."""
        found: list[Trial] = []
        for trial in sorted(self.trials, key=lambda trial: (trial.seconds, trial.error)):
            if not found or trial.error < found[-1].error:
                found.append(trial)
        return tuple(found)

    @property
    def chosen(self) -> Trial | None:
        """The fastest setting within the tolerance, or None."""
        return next((trial for trial in self.front if trial.error <= self.tolerance), None)

    def table(self) -> str:
        """All settings as aligned text, the fastest first; a star marks the front."""
        front = set(self.front)
        head = ["setting", "coordinates", "time [s]", "× real time", "error in |e|", "front"]
        rows = [
            [
                trial.setting.label,
                str(trial.size),
                f"{trial.seconds:.3f}",
                f"{self.duration / trial.seconds:.0f}",
                f"{trial.error:.5f}" if np.isfinite(trial.error) else "failed",
                "*" if trial in front else "",
            ]
            for trial in sorted(self.trials, key=lambda trial: trial.seconds)
        ]
        return aligned(head, rows)


def accuracy(
    structure: Structure,
    motion: Motion,
    *,
    damping: Damping = None,
    rungs: Sequence[str] = RUNGS,
    cells: Sequence[tuple[int, int]] = CELLS,
    rules: Sequence[tuple[str, int | None]] = RULES,
    steps: Sequence[float] = STEPS,
    tolerance: float = 0.005,
) -> Accuracy:
    """Run a scene over rungs × meshes × quadratures × time steps against a converged reference.

    The error of a setting is the largest difference, over the joints, of the largest |e|.

    Args:
        structure: what stands.
        motion: of the ground.
        damping: of all runs, or a function that finds it of the reference.
        rungs: fidelities to try.
        cells: meshes to try; "rigid" takes the first number as facets on a joint.
        rules: quadratures to try, each with its points on a facet (None: 3).
        steps: time steps to try [s].
        tolerance: by which one is chosen [-].

    Returns:
        All settings with their times and errors, beside the reference and its own doubt.

    Raises:
        InvalidInput: a rung, rule or step is not known.
        DidNotConverge: the reference itself failed.
    """
    references = references_of(structure)
    damping = damping_for(build(structure, references[0].discretisation), damping)
    asked = [*references, *settings_of(structure, rungs, cells, rules, steps)]
    runs = [
        timed(build(structure, each.discretisation), motion, damping, each.dt)
        for each in tqdm(asked, unit="setting", disable=None, leave=False)
    ]
    return compared(asked, runs, motion.duration, tolerance)


def references_of(structure: Structure) -> tuple[Setting, Setting]:
    """Return the setting that all others are compared with, and one that tells of its own error.

    Args:
        structure: what stands.

    Returns:
        The finest, and the same at twice the time step and half the cells.
    """
    finest = best(structure, LEVELS[-1])
    halved = replace(finest, cells=(finest.through // 2, finest.along // 2))
    return Setting(finest, FINE), Setting(halved, 2.0 * FINE)


def settings_of(
    structure: Structure,
    rungs: Sequence[str] = RUNGS,
    cells: Sequence[tuple[int, int]] = CELLS,
    rules: Sequence[tuple[str, int | None]] = RULES,
    steps: Sequence[float] = STEPS,
) -> Iterator[Setting]:
    """Yield all combinations, each scene once: rigid joints with exact facets have no mesh.

    Args:
        structure: what stands; its soft blocks, such as backfill, keep all their nodes.
        rungs: fidelities of the stones.
        cells: meshes.
        rules: quadratures, each with its points on a facet.
        steps: time steps [s].

    Yields:
        Each setting.

    Raises:
        InvalidInput: a rung or rule is not known.
    """
    for rung in rungs:
        fidelity = stones(structure, rung)
        for rule, points in rules:
            meshless = fidelity == "rigid" and rule == "exact"
            for mesh in [(1, 1)] if meshless else cells:
                asked = Discretisation(fidelity, mesh, quadrature=rule, points=points)
                yield from (Setting(asked, dt) for dt in steps)


def timed(
    model: Model,
    motion: Motion,
    damping: Viscous | None,
    dt: float,
    start: Equilibrium | None = None,
) -> Run:
    """Run a model and say how long that took; what is compiled on first use is not counted.

    Args:
        model: of one setting.
        motion: of the ground.
        damping: None is undamped.
        dt: time step [s].
        start: the dead load, found first where it is not given.

    Returns:
        Size, time, and what the joints came to.

    Raises:
        KeyboardInterrupt: on Ctrl-C.
    """
    time_history(model, motion.cut(0.0, 2.0 * dt), damping=damping, dt=dt, start=start)
    begun = process_time()
    try:
        run = time_history(model, motion, damping=damping, dt=dt, start=start)
    except DidNotConverge:
        return Run(model.size, process_time() - begun, None)
    if run.ended is Ending.INTERRUPTED:
        raise KeyboardInterrupt
    return Run(model.size, process_time() - begun, peaks_of(run))


def compared(
    settings: Sequence[Setting], runs: Sequence[Run], duration: float, tolerance: float
) -> Accuracy:
    """Return what runs of settings tell, by the first of them, the reference.

    Args:
        settings: as by `references_of`, then all others.
        runs: one for each.
        duration: of the motion [s].
        tolerance: by which one is chosen [-].

    Raises:
        DidNotConverge: the reference failed.
    """
    reference = runs[0].peaks
    if reference is None:
        raise DidNotConverge(
            f"the reference, {settings[0].label}, did not reach the end of the motion: there is "
            "nothing to compare with; take a weaker motion (motion.scale) or a shorter one"
        )
    trials = [
        Trial(
            setting,
            run.size,
            run.seconds,
            np.inf if run.peaks is None else largest_difference(run.peaks, reference),
        )
        for setting, run in zip(settings, runs, strict=True)
    ]
    return Accuracy(tuple(trials[2:]), settings[0], trials[1].error, duration, tolerance)
