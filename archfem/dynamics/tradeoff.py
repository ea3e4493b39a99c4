"""Speed against error: one scene over rungs, meshes, quadratures and time steps."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from tqdm import tqdm

from archfem.arrays import Array
from archfem.dynamics.candidates import LEVELS, best, label
from archfem.dynamics.ladder import Damping, damping_for
from archfem.dynamics.probe import largest_difference, peaks
from archfem.dynamics.schemes import Viscous
from archfem.dynamics.time_history import time_history
from archfem.errors import DidNotConverge
from archfem.masonry.structure import Structure
from archfem.models.build import build
from archfem.models.discretisation import Discretisation
from archfem.motion.motion import Motion
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
class Trial:
    """One setting, and what came of it.

    Attributes:
        setting: the model and the time step.
        size: coordinates.
        seconds: to step through the motion, once the model is built [s].
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
    settings = list(_settings(rungs, cells, rules, steps))
    finest = best(structure, LEVELS[-1])
    model = build(structure, finest)
    damping = damping_for(model, damping)
    reference = peaks(model, motion, damping, FINE)
    halved = replace(finest, cells=(finest.through // 2, finest.along // 2))
    doubt = _trial(Setting(halved, 2.0 * FINE), structure, motion, damping, reference).error
    trials = [
        _trial(setting, structure, motion, damping, reference)
        for setting in tqdm(settings, unit="setting", disable=None, leave=False)
    ]
    return Accuracy(tuple(trials), Setting(finest, FINE), doubt, motion.duration, tolerance)


def _settings(
    rungs: Sequence[str],
    cells: Sequence[tuple[int, int]],
    rules: Sequence[tuple[str, int | None]],
    steps: Sequence[float],
) -> Iterator[Setting]:
    """All combinations, each scene once: rigid joints with exact facets have no mesh."""
    for rung in rungs:
        for rule, points in rules:
            meshless = rung == "rigid" and rule == "exact"
            for mesh in [(1, 1)] if meshless else cells:
                asked = Discretisation(rung, mesh, quadrature=rule, points=points)
                yield from (Setting(asked, dt) for dt in steps)


def _trial(
    setting: Setting,
    structure: Structure,
    motion: Motion,
    damping: Viscous | None,
    reference: Array,
) -> Trial:
    """Build, run and compare one setting; what is compiled on first use is not counted."""
    model = build(structure, setting.discretisation)
    time_history(model, motion.cut(0.0, 2.0 * setting.dt), damping=damping, dt=setting.dt)
    start = perf_counter()
    try:
        error = largest_difference(peaks(model, motion, damping, setting.dt), reference)
    except DidNotConverge:
        error = np.inf
    return Trial(setting, model.size, perf_counter() - start, error)
