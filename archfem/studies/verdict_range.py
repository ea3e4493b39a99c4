"""Range of a verdict: the same run over properties that nobody knows exactly.

Joint rule, stiffness, friction, damping, sign of the motion and time step are varied one at a time
and all together, by a Latin hypercube. The result is the share of runs in which the structure
falls, and the properties that decide it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.stats import binomtest, qmc, rankdata
from tqdm import tqdm

from archfem._display import ResultDisplay
from archfem._files import align_columns
from archfem._typing import Array
from archfem._validation import check_integer, check_number, check_type
from archfem.dynamics.damping import effective_damping
from archfem.dynamics.fall import COLLAPSE_STATES, FALLEN_STATES, CollapseState, classify_collapse
from archfem.dynamics.model_selection import build
from archfem.dynamics.rigid_body.bodies import LooseBlocks
from archfem.dynamics.rigid_body.time_stepping import RigidBlockSimulation
from archfem.dynamics.schemes import Rayleigh, StiffnessDamping, Viscous
from archfem.dynamics.time_history import time_history
from archfem.errors import DidNotConverge, InvalidInput
from archfem.masonry.structure import Structure
from archfem.models.model import Model
from archfem.motion.motion import Motion
from archfem.statics.equilibrium import dead_load
from archfem.studies.evaluators import Evaluator
from archfem.studies.process_pool import evaluate_on_processes, evaluate_serially

# Joint rules: exact integration, springs at the ends and the middle (as in 3DEC), rigid contact
JOINT_RULES = ("exact", "three points", "rigid")

# What is varied by default: values, of which numbers are the ends of a range
DEFAULT_RANGES: dict[str, tuple[Any, ...]] = {
    "joint_rule": JOINT_RULES,
    "k_n": (1.0 / 3.0, 3.0),
    "k_s": (1.0 / 3.0, 3.0),
    "friction": (-0.1, 0.1),
    "damping_ratio": (0.5, 2.0),
    "damping_kind": ("stiffness", "mass and stiffness"),
    "sign": ("as given", "reversed"),
    "dt": ("as given", "half"),
}

# Values at which a run is as given
NEUTRAL: dict[str, Any] = {
    "joint_rule": "exact",
    "k_n": 1.0,
    "k_s": 1.0,
    "friction": 0.0,
    "damping_ratio": 1.0,
    "scale": 1.0,
    "sign": "as given",
    "dt": "as given",
}


class RunSettings(NamedTuple):
    """Run that is varied."""

    structure: Structure
    motion: Motion
    damping: Viscous | None  # as given; None for effective damping of each model by 5 %
    dt: float  # [s]
    fidelity: str


@dataclass(frozen=True, eq=False)
class Variation:
    """One run of the range: the settings as given, and the changed values by name."""

    base: RunSettings = field(repr=False)
    changes: tuple[tuple[str, Any], ...]

    @property
    def case(self) -> "Variation":
        """The variation itself, as evaluators take it."""
        return self


@dataclass(frozen=True, eq=False, repr=False)
class VerdictRange(ResultDisplay):
    """Verdicts over a range of properties.

    Attributes:
        dataset: over `run`: the value of each varied property; `outcome`, as of `Verdict`;
            `displacement` and `residual`, the largest of a corner and that at the end [m]; `time`
            of the first lost block [s]; `error`, the text of a run without an answer, or "";
            `sampled`, whether the run is of the Latin hypercube.
        units: normal and shear stiffness of the structure's joints, on the mean [N/m³].
    """

    dataset: xr.Dataset
    units: Mapping[str, float]

    @property
    def falls(self) -> Array:
        """Whether the structure partly or wholly falls, by run (runs,)."""
        return np.isin(self.dataset["outcome"].values, FALLEN_STATES)

    @property
    def answered(self) -> Array:
        """Whether a run has an answer (runs,)."""
        return self.dataset["error"].values == ""

    @property
    def share(self) -> float:
        """Share of the sampled runs with an answer in which the structure falls [-]."""
        sampled = self.dataset["sampled"].values & self.answered
        return float(self.falls[sampled].mean())

    def interval(self, confidence: float = 0.95) -> tuple[float, float]:
        """Return the confidence interval of `share` by Clopper and Pearson (1934).

        Args:
            confidence: probability that the interval contains the share [-].
        """
        sampled = self.dataset["sampled"].values & self.answered
        test = binomtest(int(self.falls[sampled].sum()), int(sampled.sum()))
        bounds = test.proportion_ci(confidence)
        return float(bounds.low), float(bounds.high)

    @property
    def properties(self) -> tuple[str, ...]:
        """Names of the varied properties."""
        return tuple(str(name) for name in self.dataset.attrs["properties"])

    def importance(self) -> dict[str, float]:
        """Return the share of the variance of the damage that each property explains [-].

        Damage is the rank of a run by its outcome and residual displacement. The share is the
        correlation ratio of the ranks, numbers in three groups of equal size (a first-order index
        of sensitivity; Saltelli and others, Global Sensitivity Analysis, 2008, section 1.2.6).

        Returns:
            By property, in descending order; chance alone explains about 2 / runs.
        """
        ranks = self._damage_ranks()
        shares = {
            name: _correlation_ratio(self.dataset[name].values[self.answered], ranks)
            for name in self.properties
        }
        return dict(sorted(shares.items(), key=lambda item: -item[1]))

    def _damage_ranks(self) -> Array:
        """Return the rank of each answered run by outcome and residual displacement (runs,)."""
        rows = self.dataset.isel(run=np.flatnonzero(self.answered))
        kind = np.array([COLLAPSE_STATES.index(str(name)) for name in rows["outcome"].values])
        # among fallen structures distances to the ground say nothing
        fallen = np.isin(rows["outcome"].values, FALLEN_STATES)
        residual = np.where(fallen, 0.0, rows["residual"].values)
        return rankdata(np.where(fallen, 10.0 + kind, residual / max(residual.max(), 1e-12)))

    @property
    def sentence(self) -> str:
        """How often the structure falls, and where."""
        falls, answered = self.falls[self.answered], int(self.answered.sum())
        missing = len(self.answered) - answered
        text = f"falls in {int(falls.sum())} of {answered}"
        if 0 < falls.sum() < len(falls):
            text += f": {self._describe_falls()}"
        low, high = self.interval()
        text += f"; of those sampled {self.share:.0%} fall ({low:.0%} to {high:.0%})"
        return text + (f"; {missing} have no answer" if missing else "")

    def _describe_falls(self) -> str:
        """Return the one or two conditions that separate runs that fall from others best."""
        rows = self.dataset.isel(run=np.flatnonzero(self.answered))
        falls, conditions = self.falls[self.answered], []
        chosen = np.ones(len(falls), dtype=bool)
        for _ in range(2):
            best = max(
                _list_conditions(rows, self.properties, chosen),
                key=lambda condition: _separation(falls, chosen & condition.holds),
                default=None,
            )
            before = _separation(falls, chosen)
            if best is None or _separation(falls, chosen & best.holds) <= before:
                break
            conditions.append(self._condition_text(best))
            chosen &= best.holds
        inside, total = int(falls[chosen].sum()), int(falls.sum())
        where = " and ".join(conditions)
        return f"{inside} of the {total} with {where}, where {inside} of {int(chosen.sum())} fall"

    def _condition_text(self, condition: "Condition") -> str:
        """Return a condition in words, with stiffness as a value."""
        name, value, below = condition.name, condition.value, condition.below
        if below is None:
            return f"{name.replace('_', ' ')} '{value}'"
        word = "below" if below else "above"
        if name in self.units:
            return f"{name} {word} {value * self.units[name] / 1e9:.3g} GPa/m"
        kind = "changed by" if name == "friction" else "×"
        return (
            f"{name.replace('_', ' ')} {kind} {value:+.3g}"
            if name == "friction"
            else (f"{name.replace('_', ' ')} {word} × {value:.3g}")
        )

    def table(self) -> str:
        """Return the share of the variance that each property explains, and falls by value."""
        falls, rows = self.falls[self.answered], []
        data = self.dataset.isel(run=np.flatnonzero(self.answered))
        for name, share in self.importance().items():
            groups = _group_values(data[name].values)
            cells = [
                f"{label}: {int(falls[chosen].sum())} of {int(chosen.sum())}"
                for label, chosen in groups
            ]
            rows.append([name.replace("_", " "), f"{share:.0%}", ", ".join(cells)])
        return align_columns(["property", "explains", "falls"], rows)

    def __str__(self) -> str:
        """Sentence, and a line for each property."""
        return f"{self.sentence}\n{self.table()}"

    def _summary(self) -> str:
        return f"VerdictRange: {self.sentence}"


class Condition(NamedTuple):
    """Condition on a property: a value of its own, or below or above a number."""

    name: str
    value: Any
    below: bool | None
    holds: Array  # (runs,)


def _list_conditions(rows: xr.Dataset, names: Sequence[str], among: Array) -> Iterator[Condition]:
    """Yield all conditions that split some runs."""
    for name in names:
        values = rows[name].values
        present = np.unique(values[among])
        if values.dtype.kind == "f":
            for edge in 0.5 * (present[1:] + present[:-1]):
                yield Condition(name, float(edge), True, values < edge)
                yield Condition(name, float(edge), False, values > edge)
        else:
            for value in present:
                yield Condition(name, str(value), None, values == value)


def _separation(falls: Array, chosen: Array) -> float:
    """Return how well chosen runs and runs that fall agree: F1, the mean of both shares [-]."""
    inside = float(falls[chosen].sum())
    return 2.0 * inside / max(float(chosen.sum() + falls.sum()), 1.0)


def _group_values(values: Array, groups: int = 3) -> list[tuple[str, Array]]:
    """Return labels and members of the groups of a property: values, or thirds of numbers."""
    if values.dtype.kind != "f" or len(np.unique(values)) <= groups:
        return [
            (f"{value:.3g}" if values.dtype.kind == "f" else str(value), values == value)
            for value in np.unique(values)
        ]
    edges = np.quantile(values, np.linspace(0.0, 1.0, groups + 1))
    members = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, groups - 1)
    return [
        (f"{edges[k]:.3g} to {edges[k + 1]:.3g}", members == k)
        for k in range(groups)
        if (members == k).any()
    ]


def _correlation_ratio(values: Array, ranks: Array) -> float:
    """Return the variance of the group means of ranks over their variance [-]."""
    total = float(np.sum((ranks - ranks.mean()) ** 2))
    between = sum(
        float(chosen.sum() * (ranks[chosen].mean() - ranks.mean()) ** 2)
        for _, chosen in _group_values(values)
    )
    return between / total if total > 0.0 else 0.0


def verdict_range(
    structure: Structure,
    motion: Motion,
    *,
    damping: Viscous | None = None,
    dt: float = 0.005,
    fidelity: str = "rigid",
    vary: Mapping[str, Sequence[Any]] | None = None,
    samples: int = 26,
    seed: int = 0,
    workers: int = 1,
) -> VerdictRange:
    """Run a motion with large displacements over the properties that nobody knows exactly.

    The run as given comes first, then each property at each of its values alone, then a Latin
    hypercube over all (McKay, Beckman and Conover, 1979). By default these are varied:

    - "joint_rule": "exact" integration over each joint, "three points" (springs at its ends and
      middle), and "rigid" blocks in contact, without elastic joints or damping;
    - "k_n" and "k_s": factors from 1/3 to 3 on the stiffness of the joints, evenly in its logarithm;
    - "friction": -0.1 to 0.1, added to each coefficient that is given, at least to 0.05;
    - "damping_ratio": factors from 0.5 to 2; "damping_kind": "stiffness", or "mass and stiffness"
      (`Rayleigh`), which drags loose blocks;
    - "sign": the motion "as given" or "reversed" along x; "dt": the step "as given" or "half".

    Args:
        structure: structure of free and fixed blocks.
        motion: ground acceleration.
        damping: damping as given; by default `effective_damping` of the structure by 5 %.
        dt: time step as given [s].
        fidelity: fidelity of the blocks with elastic joints.
        vary: values by name, for those of the default ranges: numbers are the ends of a range, and
            a single value holds a property there. Also "scale", factors on the motion, and any
            other name with a mapping from labels to structures or to motions.
        samples: number of runs of the Latin hypercube.
        seed: seed of its random numbers.
        workers: number of processes.

    Returns:
        All runs. A run without an equilibrium counts neither as standing nor as fallen.

    Raises:
        InvalidInput: an argument is out of range, or a name or value is unknown.
        DidNotConverge: the structure as given does not stand under dead load.
    """
    check_type(structure, Structure, "structure", "give a Structure")
    check_type(motion, Motion, "motion", "give a Motion, e.g. Motion.read(path)")
    check_integer(samples, "samples")
    ranges = _check_ranges({**DEFAULT_RANGES, **(vary or {})})
    model = build(structure, fidelity=fidelity, displacements="large")
    base = RunSettings(structure, motion, damping, dt, fidelity)
    dead_load(model)  # a structure that does not stand is refused before any run
    changes = [*_single_changes(ranges, damping), *_sample_changes(ranges, samples, seed)]
    points = [(k, Variation(base, tuple(each.items()))) for k, each in enumerate(changes)]
    evaluator = Evaluator(evaluate_variation)
    rows: dict[int, dict[str, Any]] = {}
    evaluated = (
        evaluate_serially(points, evaluator)
        if workers == 1
        else evaluate_on_processes(points, evaluator, workers)
    )
    with tqdm(total=len(points), unit="run", disable=None, leave=False) as bar:
        for number, row in evaluated:
            rows[number] = row
            bar.update()
    dataset = _build_dataset(ranges, changes, [rows[k] for k in range(len(points))], damping)
    dataset["sampled"] = "run", np.arange(len(points)) >= len(points) - samples
    contacts = [joint.contact for joint in structure.joints]
    units = {
        "k_n": float(np.mean([contact.normal_stiffness for contact in contacts])),
        "k_s": float(np.mean([contact.shear_stiffness for contact in contacts])),
    }
    return VerdictRange(dataset, units)


def _check_ranges(ranges: Mapping[str, Any]) -> dict[str, Any]:
    """Return the ranges, or refuse unknown names and values."""
    checked: dict[str, Any] = {}
    for name, values in ranges.items():
        if isinstance(values, Mapping):
            for value in values.values():
                if not isinstance(value, Structure | Motion):
                    raise InvalidInput(
                        f"{name} = {value!r}: give labels with structures or with motions"
                    )
            checked[name] = dict(values)
            continue
        known = {**NEUTRAL, "damping_kind": ""}
        if name not in known:
            raise InvalidInput(
                f"{name!r} cannot be varied: name one of {sorted(known)}, or give a mapping from "
                "labels to structures or to motions"
            )
        values = (values,) if isinstance(values, str | float | int) else tuple(values)
        if name in DEFAULT_RANGES and isinstance(DEFAULT_RANGES[name][0], str):
            unknown = [value for value in values if value not in DEFAULT_RANGES[name]]
            if unknown or not values:
                raise InvalidInput(f"{name} = {values!r}: give some of {DEFAULT_RANGES[name]}")
        else:
            values = tuple(float(check_number(value, name)) for value in values)
            if not values or (name != "friction" and min(values) <= 0.0):
                raise InvalidInput(f"{name} = {values!r}: give the ends of a range above 0")
        checked[name] = values
    return checked


def _damping_kind(damping: Viscous | None) -> str:
    """Return the name of the kind of a damping."""
    return "mass and stiffness" if isinstance(damping, Rayleigh) else "stiffness"


def _single_changes(ranges: Mapping[str, Any], damping: Viscous | None) -> list[dict[str, Any]]:
    """Return the run as given, and each property at each other value alone."""
    neutral = {**NEUTRAL, "damping_kind": _damping_kind(damping)}
    changes: list[dict[str, Any]] = [{}]
    for name, values in ranges.items():
        options = list(values)
        changes += [{name: value} for value in options if value != neutral.get(name)]
    return changes


def _sample_changes(ranges: Mapping[str, Any], samples: int, seed: int) -> list[dict[str, Any]]:
    """Return a Latin hypercube over all properties."""
    sampler = qmc.LatinHypercube(d=len(ranges), seed=seed)
    return [
        {
            name: _value_at(values, share)
            for (name, values), share in zip(ranges.items(), row, strict=True)
        }
        for row in sampler.random(samples)
    ]


def _value_at(values: Any, share: float) -> Any:
    """Return the value at a share of a range: a label, or a number between the ends."""
    options = list(values)
    if isinstance(options[0], str):
        return options[int(share * len(options))]
    low, high = min(options), max(options)
    # factors over more than twice are spread evenly in their logarithm
    if low > 0.0 and high / low > 2.0:
        return float(low * (high / low) ** share)
    return float(low + share * (high - low))


def evaluate_variation(variation: Variation) -> dict[str, Any]:
    """Return outcome, displacements and time of collapse of one run."""
    base, changes = variation.base, {**NEUTRAL, **dict(variation.changes)}
    structure, motion = base.structure, base.motion
    for value in changes.values():
        structure = value if isinstance(value, Structure) else structure
        motion = value if isinstance(value, Motion) else motion
    structure = _vary_contacts(structure, changes)
    motion = motion.scaled(changes["scale"])
    if changes["sign"] == "reversed":
        motion = motion.reversed()
    dt = base.dt * (0.5 if changes["dt"] == "half" else 1.0)
    if changes["joint_rule"] == "rigid":
        state = _run_rigid_blocks(structure, motion, dt)
    else:
        state = _run_elastic_joints(structure, motion, dt, base, changes)
    return {
        "outcome": state.kind,
        "displacement": state.displacement,
        "residual": state.residual,
        "time": np.nan if state.time is None else state.time,
    }


def _vary_contacts(
    structure: Structure, changes: Mapping[str, Any], min_friction: float = 0.05
) -> Structure:
    """Return the structure with other stiffness and friction of its joints."""
    joints = []
    for joint in structure.joints:
        contact = joint.contact
        contact = replace(
            contact,
            normal_stiffness=changes["k_n"] * contact.normal_stiffness,
            shear_stiffness=changes["k_s"] * contact.shear_stiffness,
            friction=max(contact.coefficient + changes["friction"], min_friction),
        )
        joints.append(replace(joint, contact=contact))
    return replace(structure, joints=tuple(joints))


def _run_elastic_joints(
    structure: Structure, motion: Motion, dt: float, base: RunSettings, changes: Mapping[str, Any]
) -> CollapseState:
    """Run a model with elastic joints, and return its state of collapse."""
    rule: dict[str, Any] = {}
    if changes["joint_rule"] == "three points":
        rule = {"quadrature": "trapezoidal", "points": 3}
    model = build(structure, fidelity=base.fidelity, displacements="large", **rule)
    kind = changes.get("damping_kind") or _damping_kind(base.damping)
    damping = _vary_damping(model, base.damping, kind, changes["damping_ratio"])
    run = time_history(model, motion, dt=dt, damping=damping)
    if run.fall is None:
        raise DidNotConverge(f"the run {run.outcome}", last=None)
    return run.fall


def _vary_damping(model: Model, damping: Viscous | None, kind: str, factor: float) -> Viscous:
    """Return damping of a kind with a multiple of the ratio."""
    if damping is None:
        word = "stiffness" if kind == "stiffness" else "rayleigh"
        return effective_damping(model, 0.05 * factor, kind=word)
    ratio = factor * damping.ratio
    if kind == _damping_kind(damping):
        return replace(damping, ratio=ratio)
    if isinstance(damping, Rayleigh):
        return StiffnessDamping(ratio, damping.frequencies[0], damping.joints)
    return Rayleigh(ratio, (damping.frequency, 2.0 * damping.frequency), damping.joints)


def _run_rigid_blocks(
    structure: Structure, motion: Motion, dt: float, settling_time: float = 20.0
) -> CollapseState:
    """Run rigid blocks in contact, and return their state of collapse."""
    # impulses need steps shorter than those of elastic joints
    simulation = RigidBlockSimulation(structure, dt=min(dt / 5.0, 1e-3))
    end = motion.duration + settling_time
    frames = simulation.frames(LooseBlocks.as_built(structure), end, motion, spacing=0.05)
    return classify_collapse(structure, frames)


def _build_dataset(
    ranges: Mapping[str, Any],
    changes: Sequence[Mapping[str, Any]],
    rows: Sequence[Mapping[str, Any]],
    damping: Viscous | None,
) -> xr.Dataset:
    """Return the table of all runs."""
    neutral = {**NEUTRAL, "damping_kind": _damping_kind(damping)}
    columns: dict[str, Any] = {}
    for name, values in ranges.items():
        first = "as given" if isinstance(values, Mapping) else neutral[name]
        columns[name] = "run", np.array([change.get(name, first) for change in changes])
    for name, missing in (
        ("outcome", "unknown"),
        ("displacement", np.nan),
        ("residual", np.nan),
        ("time", np.nan),
    ):
        columns[name] = "run", np.array([row["found"].get(name, missing) for row in rows])
    columns["error"] = "run", np.array([str(row["error"]) for row in rows])
    for name, unit in (("displacement", "m"), ("residual", "m"), ("time", "s")):
        columns[name] = (*columns[name], {"units": unit})
    return xr.Dataset(columns, attrs={"properties": list(ranges)})
