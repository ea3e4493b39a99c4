"""Histories of one structure under many motions, scales and properties, reduced to findings.

Model, dead load and compiled system are those of a change of properties, and are built once for all
its motions and scales. The largest values, the first mechanisms and the outcome of each history are
kept. It is computed by `time_history`, so that its answers are those of a run on its own.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from archfem._display import ResultDisplay
from archfem._validation import check_number, check_type, validate_arguments, validate_methods
from archfem.cases.verdict_keys import check_ranges
from archfem.dynamics.analysis import Analysis
from archfem.dynamics.collapse_state import FALLEN_STATES, doubt_soft_blocks
from archfem.dynamics.history import History, classify_outcome
from archfem.dynamics.verdict import ALL_DEFINITIONS
from archfem.errors import ArchfemError, InvalidInput
from archfem.masonry.structure import Structure
from archfem.models.model import Doubt
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite
from archfem.studies.evaluators import PreparedRuns, largest_values
from archfem.studies.parameter_space import WholePoint
from archfem.studies.result_store import evaluate_with_progress
from archfem.studies.variations import change_properties

# Properties that a change may have, as `verdict_range` varies them
CHANGED = ("k_n", "k_s", "friction", "damping_ratio", "damping_kind", "finish")

# Findings of `of_history` that are kept, and their units
PEAKS = {
    **{"largest_displacement": "m", "residual_displacement": "m", "eccentricity": "1"},
    **{"friction": "1", "rotation": "rad", "opening": "m", "slip": "m"},
}


@dataclass(frozen=True, eq=False)
class EnsemblePart(WholePoint):
    """Histories that one process computes one after another: motions and scales of one change."""

    analysis: Analysis = field(repr=False)
    changes: tuple[tuple[str, Any], ...]
    runs: Sequence[tuple[Motion, float]] = field(repr=False)
    # from motions to histories; None where another process prepares it
    run: Callable[[Motion], History] | None = field(default=None, repr=False)


@validate_methods
@dataclass(frozen=True, eq=False, repr=False)
class Ensemble(ResultDisplay):
    """Findings of many histories.

    Attributes:
        dataset: over `motion`, `scale` and, with changes of properties, `change`: the `outcome`, as
            of `Verdict`, how the run `ended` and its `error`, the text of a run without an answer,
            or ""; the largest `displacement` of a corner and that at the end, `residual` [m]; over
            time and the joints of rings and piers the largest `eccentricity` |e| [-], `friction`
            |V|/N [-], `rotation` [rad], `opening` and `slip` [m]. Over `definition` too, the `time`
            of the first mechanism [s], infinite if there is none; and over `joint` besides, whether
            a joint has `failed` in it.
        analysis: settings of all histories.
        motions: unscaled motions.
        changes: changed properties; empty as given.
    """

    dataset: xr.Dataset
    analysis: Analysis
    motions: tuple[Motion, ...]
    changes: tuple[Mapping[str, Any], ...]

    @property
    def displacement(self) -> xr.DataArray:
        """Largest displacement of a corner (motions, scales[, changes]) [m]."""
        return self.dataset["displacement"]

    @property
    def outcome(self) -> xr.DataArray:
        """Outcome of each history, as of `Verdict` (motions, scales[, changes])."""
        return self.dataset["outcome"]

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Reasons why falls may be wrong, each with its remedy; `history` has those of a run."""
        falls = np.isin(self.outcome.values, FALLEN_STATES).any()
        return doubt_soft_blocks(self.analysis.structure) if falls else ()

    def history(self, motion: int, scale: int = 0, change: int = 0) -> History:
        """Compute one history as a whole, with joints over time and fields if they are recorded.

        Args:
            motion: number of the motion.
            scale: number of the scale.
            change: number of the change of properties.

        Raises:
            InvalidInput: there is no such history.
            DidNotConverge: a step failed.
        """
        scales = self.dataset["scale"].values
        sizes = len(self.motions), len(scales), len(self.changes)
        numbers = motion, scale, change
        if not all(0 <= number < size for number, size in zip(numbers, sizes, strict=True)):
            raise InvalidInput(
                f"history {numbers} does not exist: there are {sizes[0]} motions, {sizes[1]} "
                f"scales and {sizes[2]} changes, numbered from 0"
            )
        run = prepare_histories(self.analysis, self.changes[change])
        return run(self.motions[motion].scaled(float(scales[scale])))

    def _summary(self) -> str:
        """Return how many histories have which outcome."""
        kinds, counts = np.unique(self.outcome.values, return_counts=True)
        words = ", ".join(f"{count} {kind}" for kind, count in zip(kinds, counts, strict=True))
        return f"Ensemble: {self.outcome.size} histories: {words}"


def draw_ensemble_result(found: Ensemble) -> Any:
    """Draw displacements over scales, by outcome."""
    from archfem.view.studies import draw_ensemble  # matplotlib is slow to import

    return draw_ensemble(found.dataset)


@validate_arguments
def ensemble(
    analysis: Analysis | Structure,
    motions: Motion | Suite | Iterable[Motion],
    *,
    scales: Sequence[float] = (1.0,),
    changes: Sequence[Mapping[str, Any]] | None = None,
    workers: int = 1,
) -> Ensemble:
    """Compute histories of a structure under all motions, scales and changes of its properties.

    Every history equals that of `analysis.run(motion.scaled(scale))` for the changed properties.
    Chains of rigid stones, as rings on piers, with large displacements are the fastest.

    Args:
        analysis: settings of all histories; or a structure, of rigid stones with 5 % of damping and
            large displacements.
        motions: motions, or one.
        scales: factors on the motions (s,) [-].
        changes: properties of one structure each, by the names of `verdict_range`: factors "k_n",
            "k_s" and "damping_ratio", "friction" added to each coefficient, "damping_kind" and
            "finish"; {} is as given. None stands for [{}], without a dimension.
        workers: number of processes.

    Returns:
        Findings over (motion, scale[, change]); `history` computes one as a whole.

    Raises:
        InvalidInput: an argument is out of range, or a property is unknown.
        DidNotConverge: a structure does not stand under dead load.

    Example:
        >>> ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=7)
        >>> analysis = af.Analysis(ring, fidelity="rigid", displacements="large", dt=0.005)
        >>> motions = [af.Motion.synthetic(duration=0.5, seed=seed) for seed in (1, 2)]
        >>> af.ensemble(analysis, motions, scales=(0.5, 1.0)).outcome.dims
        ('motion', 'scale')
    """
    if isinstance(analysis, Structure):
        analysis = Analysis(analysis, fidelity="rigid", damping="effective", displacements="large")
    motions = _list_motions(motions)
    factors = [check_number(scale, "scale", minimum=1e-6) for scale in scales]
    varied = [_check_change(change) for change in (changes if changes is not None else [{}])]
    if not (factors and varied):
        raise InvalidInput("scales and changes are empty: give one of each, or leave them out")
    runs = [(motion, scale) for motion in motions for scale in factors]
    # a structure that does not stand is refused before any run; parts suffice for all processes
    prepared = [prepare_histories(analysis, change) for change in varied]
    count = 1 if workers == 1 else min(len(runs), max(1, 2 * workers // len(varied)))
    parts, found = [], dict[int, dict[str, Any]]()
    for change, run in zip(varied, prepared, strict=True):
        for chosen in np.array_split(np.arange(len(runs)), count):
            own, some = run if workers == 1 else None, [runs[k] for k in chosen]
            parts.append(EnsemblePart(analysis, tuple(change.items()), some, own))
    for k, row in evaluate_with_progress(
        [*enumerate(parts)], evaluate_part, workers, name="ensemble"
    ):
        if row["error"]:
            raise ArchfemError(f"histories of change {dict(parts[k].changes)}: {row['error']}")
        found[k] = row["found"]
    joints = [joint.name for joint in analysis.structure.joints]
    dataset = _join_parts([found[k] for k in range(len(parts))], varied, motions, factors, joints)
    if changes is None:
        dataset = dataset.isel(change=0)
    return Ensemble(dataset, analysis, tuple(motions), tuple(varied))


def _list_motions(motions: Motion | Suite | Iterable[Motion]) -> list[Motion]:
    """Return the motions, or refuse other values."""
    given = [motions] if isinstance(motions, Motion) else motions
    listed = list(given.motions if isinstance(given, Suite) else given)
    for motion in listed:
        check_type(motion, Motion, "motion", "give archfem.Motion, e.g. Motion.read(path)")
    if not listed:
        raise InvalidInput("there are no motions: give one or more")
    return listed


def _check_change(change: Mapping[str, Any]) -> dict[str, Any]:
    """Return a change of properties, or refuse unknown names and values."""
    if unknown := [name for name in change if name not in CHANGED]:
        raise InvalidInput(
            f"{unknown[0]!r} cannot be changed here: use {CHANGED}; scales have their own argument"
        )
    return {name: values[0] for name, values in check_ranges(change).items()}


def prepare_histories(
    analysis: Analysis, changes: Mapping[str, Any]
) -> Callable[[Motion], History]:
    """Return a function from motions to histories of a structure with changed properties."""
    if analysis.selects_model and not changes:
        return PreparedRuns(analysis, None, analysis.damping).run
    return change_properties(analysis, changes).run


def evaluate_part(part: EnsemblePart) -> dict[str, Any]:
    """Return the findings of some histories, each as a row; texts are joined by line feeds."""
    run = part.run or prepare_histories(part.analysis, dict(part.changes))
    rows = [_reduce(part.analysis.structure, run, motion.scaled(s)) for motion, s in part.runs]
    found: dict[str, Any] = {name: [row[name] for row in rows] for name in PEAKS}
    for name in ("outcome", "ended", "error"):
        found[name] = "\n".join(str(row[name]).replace("\n", " ") for row in rows)
    for name in ("time", "failed"):
        found[name] = np.array([row[name] for row in rows], float).ravel()
    return found


def _reduce(
    structure: Structure, run: Callable[[Motion], History], motion: Motion
) -> dict[str, Any]:
    """Return the findings of one history."""
    failed = np.zeros((len(ALL_DEFINITIONS), len(structure.joints)))
    time = np.full(len(ALL_DEFINITIONS), np.nan)
    try:
        history = run(motion)
    except ArchfemError as error:
        none = dict.fromkeys(PEAKS, np.nan) | {"outcome": "unknown", "ended": "failed"}
        return {**none, "error": f"{type(error).__name__}: {error}", "time": time, "failed": failed}
    for number, definition in enumerate(ALL_DEFINITIONS):
        if definition in history.mechanisms:
            found = history.mechanisms[definition]
            time[number] = np.inf if found is None or found.time is None else found.time
            failed[number, list(found.joints) if found else []] = 1.0
    return {
        **largest_values(history),
        "outcome": classify_outcome(history),
        **{"ended": str(history.ending), "error": "", "time": time, "failed": failed},
    }


def _join_parts(
    parts: Sequence[Mapping[str, Any]],
    changes: Sequence[Any],
    motions: Sequence[Motion],
    scales: Sequence[float],
    joints: Sequence[str],
) -> xr.Dataset:
    """Return the findings of parts, by change and then by run, over motion, scale and change."""
    names = {"largest_displacement": "displacement", "residual_displacement": "residual"}
    units = PEAKS | {"time": "s"}
    further = {"time": (len(ALL_DEFINITIONS),), "failed": (len(ALL_DEFINITIONS), len(joints))}
    variables = {}
    for name, first in parts[0].items():
        column = [x[name].split("\n") if isinstance(first, str) else x[name] for x in parts]
        values = np.concatenate(column, dtype=bool if name == "failed" else None, casting="unsafe")
        shape = len(changes), len(motions), len(scales), *further.get(name, ())
        dims = ("change", "motion", "scale", "definition", "joint")[: len(shape)]
        attributes = {"units": units[name]} if name in units else {}
        variables[names.get(name, name)] = dims, values.reshape(shape), attributes
    coordinates = {
        "motion": [motion.name or f"motion {k}" for k, motion in enumerate(motions, start=1)],
        "scale": list(scales),
        "definition": list(ALL_DEFINITIONS),
        "name": ("joint", list(joints)),
    }
    return xr.Dataset(variables, coordinates).transpose("motion", "scale", "change", ...)
