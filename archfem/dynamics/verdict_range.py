"""Range of a verdict over uncertain properties: share of falls, and the decisive properties."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import betaincinv, xlogy

from archfem._display import DOUBT_MARK, ResultDisplay
from archfem._files import align_columns
from archfem._netcdf import read_dataset, write_dataset
from archfem._typing import Array
from archfem._validation import validate_methods
from archfem.dynamics.collapse_state import COLLAPSE_STATES, FALLEN_STATES
from archfem.masonry.structure import join_names
from archfem.models.model import Doubt, read_doubts
from archfem.statics.equilibrium import MAX_SLIP_AT_REST
from archfem.units import format_mm

# Kind of the file of all runs
FILE_KIND = "file of a verdict's range"

# Largest share of random permutations of the outcomes with a condition that separates them as well
# as the one that is named [-], and the number of permutations
MAX_CHANCE, PERMUTATIONS = 0.05, 999
MAX_EDGES = 250  # conditions of each sense on one property

# What is counted: its runs, and their verb
COUNTED = {
    "falls": ("falls", "fall"),
    "dislocated": ("dislocations", "are dislocated"),
    "falls or dislocated": ("falls and dislocations", "fall or are dislocated"),
}

# Displacements of equal runs of other time steps differ by chance up to here [-]
MAX_RATIO_OF_DISPLACEMENTS = 1.5

# Names of single changes: the run as given, and that of other time steps
UNVARIED, HALF_STEP = "unvaried", "half the time step"

# Properties that vary by a factor, in words
_FACTORS = {"k_n": "normal stiffness", "k_s": "shear stiffness", "damping_ratio": "damping"}


@validate_methods
@dataclass(frozen=True, eq=False, repr=False)
class VerdictRange(ResultDisplay):
    """Verdicts over a range of properties.

    Attributes:
        dataset: over `run`: the value of each varied property; `outcome`, as of `Verdict`;
            `displacement` and `residual`, the largest of a corner and that at the end [m]; `time`
            of the first lost block [s]; `error`, the text of a run without an answer, or "";
            `sampled`, whether the run is of the Latin hypercube; and where some runs are in doubt
            by it `slip_at_rest`, the largest displacement along a joint under dead load [m].
            Its attribute `motion` is the name of the motion, empty where motions are varied;
            `k_n` and `k_s` are the mean stiffnesses of the joints as given [N/m³], and `doubts` has
            those of the structures as JSON.
    """

    dataset: xr.Dataset

    @property
    def falls(self) -> NDArray[np.bool_]:
        """Whether the structure partly or wholly falls, by run (runs,)."""
        return np.isin(self.dataset["outcome"].values, FALLEN_STATES)

    @property
    def dislocated(self) -> NDArray[np.bool_]:
        """Whether the structure is dislocated, and has not fallen, by run (runs,)."""
        return np.asarray(self.dataset["outcome"].values == COLLAPSE_STATES[1])

    @property
    def counted(self) -> str:
        """What is explained, a key of `COUNTED`: falls, or dislocations where none falls.

        It is both at once where properties separate these, and none separates falls alone.
        """
        return self._explained[0]

    @property
    def decisive(self) -> NDArray[np.bool_]:
        """Whether a run is `counted` (runs,)."""
        return self._explained[1]

    @property
    def is_dislocation_worst(self) -> bool:
        """Whether the structure is dislocated in some answered runs, and falls in none."""
        falls, parted = (x[self.answered].any() for x in (self.falls, self.dislocated))
        return bool(parted and not falls)

    @property
    def answered(self) -> NDArray[np.bool_]:
        """Whether a run has an answer (runs,)."""
        return self.dataset["error"].values == ""

    @property
    def in_doubt(self) -> NDArray[np.bool_]:
        """Whether joints are displaced so far under dead load that a run is in doubt (runs,)."""
        if "slip_at_rest" not in self.dataset:
            return np.zeros_like(self.answered)
        return np.asarray(self.dataset["slip_at_rest"].values > MAX_SLIP_AT_REST)

    @property
    def answers(self) -> xr.Dataset:
        """The runs with an answer."""
        return self.dataset.isel(run=np.flatnonzero(self.answered))

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
        falls, count, tail = self.falls[sampled].sum(), sampled.sum(), 0.5 * (1.0 - confidence)
        # without any fall, or any other outcome, the bound is 0 or 1, and the function undefined
        low = betaincinv(falls, count - falls + 1, tail) if falls > 0 else 0.0
        high = betaincinv(falls + 1, count - falls, 1.0 - tail) if falls < count else 1.0
        return float(low), float(high)

    @property
    def properties(self) -> tuple[str, ...]:
        """Names of the varied properties."""
        # files store a list of one name as the name
        return tuple(str(name) for name in np.atleast_1d(self.dataset.attrs["properties"]))

    @property
    def _compared(self) -> NDArray[np.bool_]:
        """Whether a run tells what a property explains (runs,).

        Runs of single changes share all other values, so that no property varies evenly in them.
        """
        sampled = self.answered & self.dataset["sampled"].values
        return sampled if sampled.any() else self.answered

    def importance(self) -> dict[str, float]:
        """Return the share of the variance of the outcomes that each property explains [-].

        An outcome is 1 where `decisive`, else 0; where all or none are, it is the rank of a run by
        its residual displacement. The share is the correlation ratio, numbers in three parts of
        their range (a first-order index of sensitivity; Saltelli and others, Global Sensitivity
        Analysis, 2008, section 1.2.6). Runs that are `in_doubt` count, as in `share`; those of
        single changes do not, where there are sampled ones.

        Returns:
            By property, in descending order; chance alone explains about 2 / runs of one property,
            and more of the largest: see `beyond_chance`.
        """
        from scipy.stats import rankdata  # slow to import, and of no use to a single run

        outcomes = self.decisive[self._compared].astype(float)
        if np.ptp(outcomes) == 0.0:  # among fallen structures distances to the ground say nothing
            residuals = np.where(self.falls, 0.0, self.dataset["residual"].values)
            outcomes = rankdata(residuals[self._compared])  # equal runs share a mean rank
        shares = zip(self.properties, self._correlate(outcomes[None])[:, 0].tolist(), strict=True)
        return dict(sorted(shares, key=lambda item: -item[1]))

    @cached_property
    def beyond_chance(self) -> frozenset[str]:
        """Properties with a larger share by `importance` than chance gives any, at the 5 % level.

        Of random permutations of the outcomes, the largest share of all properties is the measure
        of chance (Westfall and Young, 1993). There are none where outcomes are all alike.
        """
        decisive, random = self.decisive[self._compared].astype(float), np.random.default_rng(0)
        if np.ptp(decisive) == 0.0:
            return frozenset()
        chance = [random.permutation(decisive) for _ in range(PERMUTATIONS)]
        largest = np.sort(self._correlate(np.array(chance)).max(axis=0))
        # the outcomes themselves are one of their permutations
        least = largest[-int(MAX_CHANCE * (PERMUTATIONS + 1))] + 1e-9
        return frozenset(name for name, share in self.importance().items() if share > least)

    def _correlate(self, outcomes: Array) -> Array:
        """Return correlation ratios of outcomes (n, compared runs) by property (properties, n)."""
        columns = (self.dataset[name].values[self._compared] for name in self.properties)
        return np.array([_correlation_ratios(each, outcomes) for each in columns])

    @property
    def is_mixed(self) -> bool:
        """Whether some runs are decisive, and others are not."""
        return len(np.unique(self.decisive[self.answered])) > 1

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Reasons why the outcomes may be wrong, each with its remedy."""
        return *self._doubt_rest(), *read_doubts(self.dataset.attrs.get("doubts", "[]"))

    def _doubt_rest(self) -> Iterator[Doubt]:
        """Yield the doubt of variations that do not stand as drawn under dead load."""
        doubted, others = (self.answered & each for each in (self.in_doubt, ~self.in_doubt))
        if not doubted.any():
            return
        kinds = self.falls, self.dislocated
        counts = [np.count_nonzero(x & kind) for x in (doubted, others) for kind in kinds]
        slips = np.where(self.answered, self.dataset["slip_at_rest"].values, 0.0)
        # a k_s that is not varied leaves nothing out
        factors = self.dataset["k_s"].values if "k_s" in self.properties else np.ones_like(slips)
        yield Doubt(
            "shear displaces joints by up to {:mm} under dead load in {} of {} variations, which "
            "do not stand as drawn: of them {} fall and {} are dislocated, of the others {} and {}",
            leave_out_soft(factors, slips, "`--set verdict.vary.k_s=[{:.2g},{:.3g}]`"),
            (float(slips.max()), *map(int, (doubted.sum(), self.answered.sum(), *counts))),
        )

    @property
    def count(self) -> str:
        """How often the structure falls, and is dislocated."""
        falls, parted = (each[self.answered].sum() for each in (self.falls, self.dislocated))
        also = f" and is dislocated in {parted}" if parted else ""
        if doubted := int(((self.falls | self.dislocated) & self.in_doubt)[self.answered].sum()):
            also += f" ({doubted} of these {falls + parted} in doubt under dead load)"
        return f"falls in {falls or 'none'} of {self.answered.sum()} variations{also}"

    @property
    def displacement_ends(self) -> str:
        """Range of the largest displacements of the runs that do not fall; empty without such.

        Runs with rigid joints are apart where these alone hardly move.
        """
        sizes, apart, alike = self._held_displacements
        if not np.isfinite(sizes).any():
            return ""
        others = ""
        if alike:
            ends = " to ".join(format_mm(x) for x in (sizes[apart].min(), sizes[apart].max()))
            others, sizes = f"; with rigid joints {ends}", sizes[~apart]
        least, usual, largest = np.quantile(sizes, (0.0, 0.95, 1.0), method="inverted_cdf")
        ends = f"{format_mm(least)} to {format_mm(largest)}"
        return f"{ends}, in 95 % of {len(sizes)} runs {format_mm(usual)} or less{others}"

    @property
    def _held_displacements(self) -> tuple[Array, NDArray[np.bool_], bool]:
        """Displacements of runs that do not fall, which hardly move, and if these are all rigid.

        Where they are, all runs with rigid joints count as such.
        """
        held = self.answers.isel(run=np.flatnonzero(~self.falls[self.answered]))
        sizes = held["displacement"].values
        hardly = sizes < sizes.max(initial=0.0) / 100
        rigid = held["joint_rule"].values == "rigid" if "joint_rule" in held else ~hardly
        alike = bool(hardly.any() and rigid[hardly].all() and not rigid.all())
        return sizes, rigid if alike else hardly, alike

    @property
    def displacements(self) -> str:
        """Range of the largest displacements, in words; empty without any."""
        return f"largest displacements {self.displacement_ends}" * bool(self.displacement_ends)

    @property
    def single_changes(self) -> "list[SingleChange]":
        """The runs that change one property, and that as given, the worst first; maybe none."""
        rows = self.dataset.isel(run=np.flatnonzero(~self.dataset["sampled"].values))
        changes, doubted = [], self.in_doubt[~self.dataset["sampled"].values].tolist()
        for k in range(rows.sizes["run"]):
            run, given = rows.isel(run=k), rows.isel(run=0)
            changed = [name for name in self.properties if run[name] != given[name]]
            words = [_name_change(name, run[name].item()) for name in changed] or [UNVARIED]
            words[0] += " (in doubt under dead load)" * (doubted[k] and not doubted[0])
            numbers = float(run["displacement"]), float(run["residual"])
            changes.append(SingleChange(words[0], str(run["outcome"].item()), *numbers))
        return sorted(changes, key=lambda each: (-each.rank, -self.measure(each)))

    def measure(self, change: "SingleChange") -> float:
        """Return the displacement of a run that governs: the residual for dislocations [m].

        Args:
            change: run of `single_changes`.
        """
        return change.residual if self.is_dislocation_worst else change.displacement

    @property
    def _by_steps(self) -> "list[SingleChange]":
        """The unvaried run, and that of half its step, where they do not fall."""
        made = [x for x in self.single_changes if x.rank in (0, 1)]
        return [x for x in made if x.name in (UNVARIED, HALF_STEP)]

    @property
    def is_quiet(self) -> bool:
        """Whether unvaried, by any step, it is displaced no farther than a structure as drawn."""
        return all(x.displacement <= MAX_SLIP_AT_REST for x in self._by_steps)

    @cached_property
    def step_ratio(self) -> float:
        """Ratio of displacements up to which other time steps alone may change them [-].

        It is of blocks that rock or slide: of runs that are `is_quiet` it says nothing.
        """
        sizes = [self.measure(x) for x in self._by_steps]
        least, most = min(sizes, default=1.0), max(sizes, default=1.0)
        return max(MAX_RATIO_OF_DISPLACEMENTS, most / least if least > 0.0 else inf)

    def is_beyond_steps(self, change: "SingleChange", given: "SingleChange") -> bool:
        """Return whether a change displaces the structure farther than time steps alone may.

        Args:
            change: run of `single_changes`; half the step itself counts.
            given: the unvaried run.
        """
        # half the step is as far, but for round-off
        return self.measure(change) > (1.0 - 1e-9) * self.step_ratio * self.measure(given)

    @property
    def what_changes(self) -> list[str]:
        """Clauses on the single changes that decide a fall, and on those that displace most."""
        made = [each for each in self.single_changes if each.rank >= 0]
        given = next((each for each in made if each.name == UNVARIED), None)
        others = [each for each in made if each is not given]
        if given is None or not others:
            return []
        fallen, held = ([x for x in others if (x.rank > 1) is down] for down in (True, False))
        count = f"of {len(others)} single changes"
        falls = given.rank > 1
        if falls or (given.rank and not fallen):
            free = [each.name for each in others if each.rank < (2 if falls else 1)]
            state, negated = ("falls", "does not") if falls else ("is dislocated", "is not")
            few = f"with {len(free)} {count} it {negated}: {join_names(free)}"
            moved = [] if falls else [self._compare_displacements(given, others)]
            return [f"unvaried it {state}, and {few if free else f'so with all {count}'}", *moved]
        names = f"{len(fallen)} {count}: {join_names([each.name for each in fallen])}"
        parted = [each.name for each in held if each.rank > given.rank]
        neither = "is dislocated or " * (self.is_dislocation_worst and not parted)
        clauses = [f"it {neither}falls with {names if fallen else f'none {count}'}"]
        if parted:
            clauses.append(f"it is dislocated with {len(parted)}: {join_names(parted)}")
        return [*clauses, self._compare_displacements(given, held)]

    def _compare_displacements(self, given: "SingleChange", held: "list[SingleChange]") -> str:
        """Say how far the unvaried structure is displaced, and with which changes farthest."""
        moved = sorted(held, key=lambda each: -self.measure(each))[:2]
        larger = [each for each in moved if self.is_beyond_steps(each, given)]
        as_much = moved and not larger and not self.is_quiet
        alike = ": other time steps alone may change it as much" * bool(as_much)
        larger = larger or moved[:1]
        listed = [f"{format_mm(self.measure(each))} with {each.name}" for each in larger]
        verb = "remains" if self.is_dislocation_worst else "is"
        own = f"unvaried it {verb} displaced by {format_mm(self.measure(given))}"
        return ", by ".join([own, *listed]) + alike

    @property
    def unanswered(self) -> str:
        """How many runs have no answer, for the end of a sentence; empty if all have one."""
        missing = int((~self.answered).sum())
        reason = next((error for error in self.dataset["error"].values if error), "")
        first = f", the first: {reason:.300}" * bool(reason)
        return f"; {missing} of {len(self.answered)} have no answer{first}" if missing else ""

    @property
    def sentence(self) -> str:
        """How often the structure falls, and where."""
        if not (self.answered & self.dataset["sampled"].values).any():
            errors = [error for error in self.dataset["error"].values if error]
            return f"{len(errors)} of {len(self.answered)} runs have no answer: {errors[0]}"
        text = f"{self.headline}; {self.groups}"
        text += f", under '{motion}' alone" if (motion := self.dataset.attrs.get("motion")) else ""
        return text + self.unanswered

    @property
    def headline(self) -> str:
        """How often the structure falls, and where, without the falls among sampled runs."""
        return f"{self.count}: {self.where}" if self.is_mixed else self.count

    @property
    def groups(self) -> str:
        """Decisive runs of those that vary one property, and of the sample, with its interval."""
        sampled, (low, high) = self.dataset["sampled"].values, self.interval()
        words = []
        for name, group in ("one property or none", ~sampled), ("all", sampled):
            if own := int((self.answered & group).sum()):
                count = int(self.decisive[self.answered & group].sum())
                words.append(f"{count} of the {own} that vary {name}")
        share = f"{low:.0%} to {high:.0%} at 95%"
        # without these the sample were none of the ranges, but one of stiffer joints
        doubted = int((self.answered & self.in_doubt).sum())
        also = f"; shares count {doubted} runs in doubt under dead load" * bool(doubted)
        if self.counted != "falls":
            number = int((self.answered & sampled).sum())
            return f"{', '.join(words)}; share of falls {share} by the {number}{also}"
        return f"{', '.join(words)} ({share}){also}"

    @cached_property
    def _explained(self) -> "tuple[str, NDArray[np.bool_], list[Condition]]":
        """What is `counted`, whether a run is (runs,), and the conditions that separate these.

        Each of two tests has half of the chance of a false condition (Bonferroni).
        """
        events = {"falls": self.falls}
        if self.is_dislocation_worst:
            events = {"dislocated": self.dislocated}
        elif self.dislocated[self.answered].any():
            events["falls or dislocated"] = self.falls | self.dislocated
        for name, runs in events.items():
            if found := self._find_conditions(runs[self.answered], MAX_CHANCE / len(events)):
                return name, runs, found
        name, runs = next(iter(events.items()))
        return name, runs, []

    def _find_conditions(self, decisive: NDArray[np.bool_], max_chance: float) -> "list[Condition]":
        """Return the one or two conditions that separate decisive runs by more than chance.

        They are tested by sampled runs: those of single changes share all other properties.
        """
        rows, chosen = self.answers, np.ones(len(decisive), dtype=bool)
        conditions = list[Condition]()
        for _ in range(2):
            tested = chosen & rows["sampled"].values
            among = rows.isel(run=np.flatnonzero(tested))
            best = _find_condition(among, self.properties, decisive[tested], max_chance)
            if best is None:
                break
            conditions.append(best)
            chosen &= best.holds(rows)
        return conditions

    @property
    def deciding(self) -> tuple[str, ...]:
        """Properties in words that separate decisive runs from others by more than chance."""
        names = [each.name for each in self._explained[2]]
        return tuple(dict.fromkeys(_FACTORS.get(name, property_text(name)) for name in names))

    @property
    def where(self) -> str:
        """The one or two conditions that separate decisive runs from others by more than chance."""
        decisive, conditions = self.decisive[self.answered], self._explained[2]
        runs, verb = COUNTED[self.counted]
        if not conditions:
            sampled = self.answers["sampled"].values
            among = f" among the {sampled.sum()} that vary all" * bool(~sampled.all())
            alone = decisive[~sampled]  # the unvaried run is the first
            if self.answered[0] and (count := int((alone[1:] != alone[:1]).sum())):
                among += f", but {count} of {len(alone) - 1} single changes alter the outcome"
            return f"no property separates {runs} from the others by more than chance{among}"
        chosen = np.all([each.holds(self.answers) for each in conditions], axis=0)
        where = " and ".join(map(self._condition_text, conditions))
        inside = int(decisive[chosen].sum())
        which = f"all {runs}" if inside == decisive.sum() else f"{inside} of the {runs}"
        return f"{which} are with {where}, where {inside} of {int(chosen.sum())} {verb}"

    def _condition_text(self, condition: "Condition") -> str:
        """Return a condition in words, with joint stiffness in MPa/mm rather than as a factor."""
        name, value, below = condition.name, condition.value, condition.below
        if below is None:
            return f"{property_text(name)} '{value}'"
        word = "below" if below else "above"
        if name in ("k_n", "k_s"):
            return f"{name} {word} {value * self.dataset.attrs[name] / 1e9:.3g} MPa/mm"
        if name == "friction":
            return f"friction {word} that given {value:+.2g}"
        return f"{property_text(name)} {word} × {value:.3g}"

    def save(self, path: str | Path) -> Path:
        """Write all runs to a NetCDF file, which `read` reads.

        Args:
            path: file to write; folders are created.
        """
        return write_dataset(self.dataset, Path(path), FILE_KIND)

    @classmethod
    def read(cls, path: str | Path) -> "VerdictRange":
        """Read a file written by `save`.

        Args:
            path: file to read.

        Raises:
            InvalidInput: there is no such file, or it is damaged or of another version.
        """
        return cls(read_dataset(path, FILE_KIND))

    def tabulate(self) -> tuple[list[str], list[list[str]]]:
        """Return what is `counted` by value, and the share that a property explains.

        Returns:
            The titles of the columns, and a row for each property.
        """
        decisive, rows = self.decisive[self._compared], []
        data = self.dataset.isel(run=np.flatnonzero(self._compared))
        for name, share in self.importance().items():
            groups = _group_values(data[name].values)
            cells = [
                f"{label}: {int(decisive[chosen].sum())} of {int(chosen.sum())}"
                for label, chosen in groups
            ]
            explained = f"{share:.0%}" if name in self.beyond_chance else "no more than chance"
            own = [explained] * bool(self.beyond_chance)
            rows.append([property_text(name), *own, ", ".join(cells)])
        head = ["explains, of the variance of the outcome"] * bool(self.beyond_chance)
        return ["property", *head, self.counted], rows

    def table(self) -> str:
        """Return the table of `tabulate` as text."""
        return align_columns(*self.tabulate())

    def __str__(self) -> str:
        """Sentence, doubts, displacements, and a line for each property."""
        doubts = [f"{DOUBT_MARK}{doubt}" for doubt in self.doubts]
        moved = filter(None, [self.displacements, "; ".join(self.what_changes)])
        none = "no varied property explains the variance of the outcomes more than chance does"
        shares = [none] * (self.is_mixed and not self.beyond_chance)
        return "\n".join([self.sentence, *doubts, *moved, *shares, self.table()])

    def _summary(self) -> str:
        return f"VerdictRange: {self.sentence}"


def leave_out_soft(factors: Array, slips: Array, given: str) -> str:
    """Return the remedy of runs with soft joints from all factors on k_s and slips at rest [m]."""
    # slips are nearly in inverse proportion to k_s; rounded up to two digits
    enough = 1.05 * float((factors * slips)[slips > MAX_SLIP_AT_REST].max()) / MAX_SLIP_AT_REST
    if enough < factors.max():
        return f"leave them out, {given.format(enough, factors.max())}"
    return "`archfem check` says which joints, and what to do"


class SingleChange(NamedTuple):
    """Run in which one property has another value."""

    name: str  # property and value in words
    outcome: str  # as of `Verdict`; "unknown" without an answer
    displacement: float  # largest of a corner [m]
    residual: float  # that at the end [m]

    @property
    def rank(self) -> int:
        """Place of the outcome among the states of collapse, the worst last; -1 if unknown."""
        return COLLAPSE_STATES.index(self.outcome) if self.outcome in COLLAPSE_STATES else -1


class Condition(NamedTuple):
    """Condition on a property: a value of its own, or below or above a number."""

    name: str
    value: Any
    below: bool | None

    def holds(self, rows: xr.Dataset) -> NDArray[np.bool_]:
        """Return whether runs meet the condition (runs,)."""
        values = rows[self.name].values
        if self.below is None:
            return np.asarray(values == self.value)
        return np.asarray(values < self.value if self.below else values > self.value)


def property_text(name: str) -> str:
    """Return the name of a property as users read it; k_n and k_s are symbols."""
    return name if name in ("k_n", "k_s") else name.replace("_", " ")


def _name_change(name: str, value: Any) -> str:
    """Return a property with its changed value in words."""
    if name in _FACTORS or name == "scale":
        sign, factor = ("×", value) if value > 1.0 else ("/", 1.0 / value)
        return f"{_FACTORS.get(name, 'motion')} {sign} {factor:.3g}"
    if name == "friction":
        return f"friction {'+' if value > 0.0 else '-'} {abs(value):.3g}"
    labels = {"sign": f"motion {value}", "dt": HALF_STEP}
    return labels.get(name, f"{property_text(name)} '{value}'")


def _list_conditions(rows: xr.Dataset, names: Sequence[str]) -> Iterator[Condition]:
    """Yield conditions that split some runs."""
    for name in names:
        values = rows[name].values
        present = np.unique(values)
        if values.dtype.kind == "f":
            edges = 0.5 * (present[1:] + present[:-1])
            for edge in edges[:: len(edges) // MAX_EDGES + 1]:
                yield from (Condition(name, float(edge), below) for below in (True, False))
        elif len(present) > 1:
            yield from (Condition(name, value, None) for value in present)


def _find_condition(
    rows: xr.Dataset, names: Sequence[str], falls: NDArray[np.bool_], max_chance: float
) -> Condition | None:
    """Return the condition that separates falls best; None if chance may find one as good.

    Outcomes in random order have a best condition too, over all properties and edges. It is the
    measure of chance: the test by maxima of Westfall and Young, Resampling-Based Multiple Testing
    (1993), section 2.3.
    """
    conditions = [*_list_conditions(rows, names)]
    if not conditions or falls.all() == falls.any():
        return None
    members = np.array([condition.holds(rows) for condition in conditions], dtype=float)
    gains, random = _separation(members, falls), np.random.default_rng(0)
    chance = [_separation(members, random.permutation(falls)).max() for _ in range(PERMUTATIONS)]
    as_good = 1 + np.count_nonzero(np.array(chance) > gains.max() - 1e-9)
    if as_good > max_chance * (PERMUTATIONS + 1):
        return None
    return conditions[int(gains.argmax())]


def _separation(members: Array, falls: NDArray[np.bool_]) -> Array:
    """Return the gain of log-likelihood if the members have their own share of falls (conditions,).

    Unlike by the share alone, one run that falls then separates less than a rule does. It is zero
    where members fall less often than the others.
    """
    sizes, inside = members.sum(axis=1), members @ falls
    count, total = len(falls), falls.sum()

    def likelihood(falls: Any, runs: Any) -> Any:
        return xlogy(falls, falls / runs) + xlogy(runs - falls, 1.0 - falls / runs)

    gains = likelihood(inside, sizes) + likelihood(total - inside, count - sizes)
    more = inside / sizes > total / count
    return np.where(more, gains - likelihood(total, count), 0.0)


def _group_values(values: Array, groups: int = 3) -> list[tuple[str, NDArray[np.bool_]]]:
    """Return labels and members of the groups of a property: values, or thirds of numbers."""
    if values.dtype.kind != "f" or len(np.unique(values)) <= groups:
        return [
            (f"{value:.3g}" if values.dtype.kind == "f" else str(value), values == value)
            for value in np.unique(values)
        ]
    # thirds of the range, of factors in their logarithm: the value as given is in the middle one
    space = np.geomspace if values.min() > 0.0 else np.linspace
    edges = space(values.min(), values.max(), groups + 1)
    members = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, groups - 1)
    return [
        (f"{edges[k]:.3g} to {edges[k + 1]:.3g}", members == k)
        for k in range(groups)
        if (members == k).any()
    ]


def _correlation_ratios(values: Array, outcomes: Array) -> Array:
    """Return the variance of the group means of outcomes (n, runs) over their variance (n,) [-]."""
    apart = outcomes - outcomes.mean(axis=1, keepdims=True)
    total, groups = (apart**2).sum(axis=1), [chosen for _, chosen in _group_values(values)]
    between = sum(apart[:, chosen].sum(axis=1) ** 2 / chosen.sum() for chosen in groups)
    return np.divide(between, total, out=np.zeros_like(total), where=total > 0.0)
