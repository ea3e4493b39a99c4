"""Annual rate of collapse of a structure, from capacities under sampled properties and a hazard.

Each sample pairs properties of the structure with a record, and brackets the scale of that record
at which the structure falls. A lognormal fragility is fitted to the brackets of each alternative,
and integrated with the hazard curve of the site. Intervals are by the bootstrap over records, with
all samples of each.

References:
    Cornell, Jalayer, Hamburger and Foutch, J. Struct. Eng. 128 (2002) 526-533, for the rate.
    Porter, Kennedy and Bachman, Earthq. Spectra 23 (2007) 471-489, for the fragility.
"""

import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from math import exp, inf, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy import stats
from scipy.special import ndtr

from archfem._display import DOUBT_MARK, ResultDisplay
from archfem._files import align_columns
from archfem._netcdf import read_dataset, write_dataset
from archfem._recent import RecentResults
from archfem._typing import Array
from archfem._validation import (
    check_choice,
    check_integer,
    check_number,
    check_type,
    validate_arguments,
    validate_methods,
)
from archfem.cases.verdict_keys import check_ranges, default_ranges
from archfem.dynamics.analysis import Analysis
from archfem.dynamics.collapse_state import FALLEN_STATES, CollapseState, doubt_soft_blocks
from archfem.dynamics.recorder import Record
from archfem.dynamics.scale_search import check_search
from archfem.dynamics.verdict_range import leave_out_soft
from archfem.errors import DidNotConverge, InvalidInput
from archfem.masonry.structure import Structure
from archfem.models.model import Doubt, read_doubts, write_doubts
from archfem.motion.design_spectra import DesignSpectrum
from archfem.motion.hazard import DESIGN_PERIOD, MEASURES, Hazard
from archfem.motion.motion import Motion, admissible_range
from archfem.motion.response_spectra import measure_intensity, response_spectrum
from archfem.motion.suite import Suite
from archfem.statics.equilibrium import MAX_SLIP_AT_REST, Equilibrium
from archfem.statics.fill_checks import fill_doubts
from archfem.statics.modes import modes
from archfem.studies.fragility import (
    LEAST_DEVIATION,
    Fragility,
    Rate,
    fit_brackets,
    fragility,
    integrate_rates,
    variance_component,
)
from archfem.studies.result_store import evaluate_with_progress
from archfem.studies.variations import Variation, as_falling, doubt_runs, draw_samples, prepare_runs
from archfem.units import STANDARD_GRAVITY

# Kind of the file of all samples
FILE_KIND = "file of a risk"

# Properties that are varied by default; the alternatives of joint rules are for `alternatives`
VARIED = ("k_n", "k_s", "friction", "damping_ratio")

# Number of samples in the first round, at whose median the others begin their search; also the
# least number of answers to which a lognormal is fitted [-]
FIRST_ROUND = 8

# Variables of the table that are results, and their values before a run; an error has any length
RESULTS = {
    **{"lower": 0.0, "upper": inf, "admissible_step": inf, "runs": 0, "lacks_joints": 0},
    "error": np.array("", dtype=object),
}

# Peak acceleration at which those begin [m/s²]
FIRST_PEAK = 2.0

# Largest factor between scales that are tried until the fall is bracketed, and most runs of one [-]
SEARCH_FACTOR, MOST_RUNS = 1.6, 12

# Samples of the bootstrap
RESAMPLES = 400

# Share of the rate beyond the last point of the hazard from which it is in doubt [-]: a slope that
# is wrong by half there moves the rate by more than a usual interval, 20 %
LARGEST_EXTRAPOLATED_SHARE = 1.0 / 3.0

# Difference from the target spectrum at 475 years from which a hazard is in doubt [-]: soil factors
# of codes begin at 1.1 to 1.2, and rates go with the third power or so
HAZARD_TOLERANCE = 0.1

# Number of records below which a rate is in doubt [-]
FEWEST_RECORDS = 7

# Dispersion of the spectra of records below which they count as matched [-]: of three motions
# matched to a spectrum it was 0.05, of synthetic ones of one generator 0.13 to 0.15
MATCHED_DISPERSION = 0.1

# Dispersion from record to record that matched ones lack, 0.2 to 0.4 in FEMA P-695 (2009) [-]
USUAL_RECORD_DISPERSION = 0.3


@dataclass(frozen=True, eq=False)
class RiskSample(Variation):
    """One structure and record, and how its capacity is searched."""

    begin: float  # first scale [-]
    between: tuple[float, float]  # smallest and largest scale [-]
    precision: float  # relative width of the bracket [-]


def bracket_capacity(sample: RiskSample) -> dict[str, Any]:
    """Return the largest scale that stands below the smallest that falls, that one, and runs.

    The admissible step is that which follows sliding in both; infinite if those of the runs do.
    Joints lack where the one that stands has loose blocks in strong motion.
    """
    run = prepare_runs(sample.analysis, dict(sample.changes))
    smallest, largest = admissible_range(sample.between, sample.motion)
    stands, falls, runs, states = 0.0, inf, 0, dict[float, CollapseState]()
    scale = min(max(sample.begin, smallest), largest)
    factor = _search_factor(wide := 1.0 + sample.precision)
    while runs < MOST_RUNS:
        runs += 1
        states[scale] = run(sample.motion.scaled(scale))
        if states[scale].kind in FALLEN_STATES:
            falls = scale
        else:
            stands = scale
        if falls <= smallest or stands >= largest or falls <= (wide + 1e-9) * stands:
            break
        if falls == inf:
            scale = min(factor * stands, largest)
        elif stands == 0.0:
            scale = max(falls / factor, smallest)
        else:
            scale = sqrt(stands * falls)
    bounds = [states[at].admissible_step for at in (stands, falls) if at in states]
    lacking = stands in states and states[stands].lacks_joints
    found = {"lower": stands, "upper": falls, "runs": runs, "admissible_step": min(bounds)}
    slip = getattr(run, "slip_at_rest", 0.0)  # else it is in no doubt by it
    in_doubt = {"slip_at_rest": slip} if slip > MAX_SLIP_AT_REST else {}
    return found | {"lacks_joints": lacking} | in_doubt


def _search_factor(wide: float) -> float:
    """Return the factor between scales whose bisections end at the width of a bracket [-]."""
    # with a little more the last bracket would take another run, for which the rate is no surer
    factor = wide
    while factor**2 <= SEARCH_FACTOR:
        factor **= 2
    return factor


@validate_arguments
def collapse_risk(  # noqa: PLR0913  (one call, one argument for each thing that may vary)
    analysis: Analysis | Structure,
    motions: Suite | Iterable[Motion],
    hazard: Hazard,
    *,
    samples: int = 80,
    vary: Mapping[str, Any] | None = None,
    alternatives: Mapping[str, tuple[float, Any]] | None = None,
    precision: float = 0.25,
    between: tuple[float, float] = (0.05, 20.0),
    seed: int = 0,
    workers: int = 1,
    out: str | Path | None = None,
    target: DesignSpectrum | None = None,
) -> "CollapseRisk":
    """Compute the annual rate at which a structure falls, from sampled properties and records.

    Properties are a Latin hypercube over their ranges, alternatives are drawn by their weights, and
    records are dealt in turn. Each sample is scaled until its fall is bracketed; where it falls at
    one scale and stands at a larger one, the bracket is that of one of several crossings.

    Args:
        analysis: settings of all runs, which have large displacements; or a structure, of rigid
            stones with 5 % of damping.
        motions: records; their own scales do not matter.
        hazard: hazard of the site.
        samples: number of samples, at least 8. With a larger one than that of `out` the samples
            kept there stay, and a further hypercube is added.
        vary: as for `verdict_range`, of properties alone; by default "k_n", "k_s", "friction" and
            "damping_ratio".
        alternatives: by label, a weight and an analysis or a structure, such as joints of other
            finish or another thickness, in place of `analysis`; weights need not add up to 1.
        precision: relative width of the brackets [-].
        between: smallest and largest scale; no ground motion may exceed 5 g.
        seed: seed of the random numbers.
        workers: number of processes.
        out: file that keeps the samples so far; a call with the same arguments continues it, also
            with another hazard, on which no run depends.
        target: design spectrum of the motions, of which a hazard of other ground is doubted.

    Returns:
        Capacities, fragility, rate and their intervals.

    Raises:
        InvalidInput: an argument is out of range, or `out` is of other arguments.
        DidNotConverge: a structure does not stand under dead load, fewer than half of the first 8
            samples have an answer, or fewer than 8 of all.
    """
    check_type(hazard, Hazard, "hazard", "give an archfem.Hazard")
    check_integer(samples, "samples", minimum=FIRST_ROUND)
    width = check_number(precision, "precision", minimum=0.01, maximum=1.0)
    check_search(width, between)
    records = list(motions.motions if isinstance(motions, Suite) else motions)
    if len(records) < 2:
        raise InvalidInput(f"{len(records)} motion: give several records, seven or more at best")
    tree = _resolve_alternatives(analysis, alternatives)
    ranges = _check_varied(vary or {}, [each.structure for _, each, _ in tree.values()])
    weights = {label: weight for label, (weight, *_) in tree.items()}
    blocks = _size_blocks(out, samples)
    parts = [draw_samples(ranges, weights, len(records), *block, seed) for block in blocks]
    draws = [row for part in parts for row in part[0]]
    labels, order = (np.concatenate([part[k] for part in parts]) for k in (1, 2))
    table = _describe_samples(ranges, draws, labels, order)
    table = table.assign(_measure_records(next(iter(tree.values()))[2], records, hazard))
    table.attrs |= _describe_inputs(tree, hazard, target, [width, list(between), seed])
    table.attrs["dt"] = next(iter(tree.values()))[1].dt
    table.attrs["blocks"] = json.dumps([size for _, size in blocks])
    _continue_file(out, table)
    for begin, end in ((0, FIRST_ROUND), (FIRST_ROUND, samples)):
        todo = [k for k in range(begin, end) if not table["runs"].values[k]]
        scales = _first_scales(table, hazard.measure, begin)
        points = []
        for k in todo:
            varied = tree[labels[k]][1], records[order[k]], tuple(draws[k].items())
            points.append((k, RiskSample(*varied, float(scales[order[k]]), between, width)))
        for k, row in evaluate_with_progress(points, bracket_capacity, workers, "risk"):
            _store_row(table, k, row)
            if out is not None:
                write_dataset(table, Path(out), FILE_KIND)
    found = CollapseRisk(table)
    found.check_answered()
    return found


def _size_blocks(out: str | Path | None, samples: int) -> list[tuple[int, int]]:
    """Return beginning and size of each hypercube: those of a file, and one of added samples."""
    sizes = [samples]
    if out is not None and Path(out).exists():
        kept = read_dataset(out, FILE_KIND)
        sizes = json.loads(kept.attrs["blocks"])
        if (added := samples - sum(sizes)) < 0:
            raise InvalidInput(
                f"{out} has {sum(sizes)} samples, and a part of a Latin hypercube is none: give "
                f"samples = {sum(sizes)} or more, or name another file"
            )
        sizes += [added] if added else []
    return [(sum(sizes[:k]), size) for k, size in enumerate(sizes)]


def _describe_inputs(
    tree: Mapping[str, tuple[float, Analysis, Equilibrium]],
    hazard: Hazard,
    target: DesignSpectrum | None,
    options: list[Any],
) -> dict[str, str]:
    """Return hazard, digests of the inputs, and doubts of hazard and structures, as texts."""
    doubts = [] if target is None else _doubt_hazard(hazard, target)
    doubts += [doubt for *_, rest in tree.values() for doubt in rest.model.doubts]
    structures = [each.structure for _, each, _ in tree.values()]
    doubts += [doubt for each in structures for doubt in fill_doubts(each)]
    doubts += doubt_soft_blocks(*structures)
    return {
        "hazard": json.dumps(asdict(hazard), default=np.ndarray.tolist),
        "inputs": json.dumps([*(each.fingerprint for _, each, _ in tree.values()), *options]),
        "doubts": write_doubts(doubts),
    }


def _doubt_hazard(hazard: Hazard, target: DesignSpectrum) -> list[Doubt]:
    """Return a doubt where hazard and target spectrum differ once in 475 years."""
    period = {"pga": 0.0, "sa": hazard.period}.get(hazard.measure)
    if period is None:
        return []
    design = STANDARD_GRAVITY * float(target.horizontal(np.array([period]))[0])
    given, unit = float(hazard.intensity_of(DESIGN_PERIOD)), MEASURES[hazard.measure]
    if abs(given - design) <= HAZARD_TOLERANCE * design:
        return []
    years = f"once in {DESIGN_PERIOD:g} years the hazard has a {hazard.measure} of"
    cause = f"{years} {given:.3g} {unit}, the target of the motions {design:.3g} {unit}"
    return [Doubt(cause, "give the hazard on the ground of the target: that of rock, times S")]


def _check_varied(vary: Mapping[str, Any], structures: Sequence[Structure]) -> dict[str, Any]:
    """Return the ranges of properties, or refuse those that the structure does not have."""
    defaults = default_ranges(*structures)
    ranges = check_ranges({name: defaults[name] for name in VARIED} | dict(vary))
    for name, values in ranges.items():
        if name in ("scale", "sign") or isinstance(values, Mapping):
            raise InvalidInput(
                f"{name!r} cannot be varied here: scales are searched; give reversed motions among "
                "the records, and structures as alternatives"
            )
    return ranges


def _resolve_alternatives(
    analysis: Analysis | Structure, alternatives: Mapping[str, tuple[float, Any]] | None
) -> dict[str, tuple[float, Analysis, Equilibrium]]:
    """Return weight, analysis and dead load of each alternative, weights adding up to 1."""
    given = dict(alternatives or {"as given": (1.0, analysis)})
    weights = [check_number(weight, "weight", minimum=0.0) for weight, _ in given.values()]
    if not sum(weights) > 0.0:
        raise InvalidInput(f"weights {weights} of alternatives: give one above 0")
    tree = {}
    for (label, (_, each)), weight in zip(given.items(), weights, strict=True):
        if isinstance(each, Structure) and isinstance(analysis, Analysis):
            each = replace(analysis, structure=each)
        falling = replace(as_falling(each), record=Record(whole_fall=False))
        # a structure that does not stand is refused before any run
        tree[label] = weight / sum(weights), falling, falling.dead_load()
    return tree


def _measure_records(
    rest: Equilibrium, records: Sequence[Motion], hazard: Hazard
) -> dict[str, Any]:
    """Return the intensities of the records, unscaled, by measure, each over `record`."""
    period = 1.0 / float(modes(rest.model, 1, rest).frequencies[0])
    band = np.geomspace(0.2 * period, 3.0 * period, 10)
    rows = []
    for record in records:
        measured, spectrum = measure_intensity(record), response_spectrum(record, band)
        at_period = response_spectrum(record, np.array([hazard.period or period]))
        if measured.pga == 0.0:
            raise InvalidInput(f"motion '{record.name}' is zero along x: leave it out")
        mean = float(np.exp(np.log(spectrum).mean()))
        rows.append((measured.pga, measured.pgv, float(at_period[0]), mean))
    columns = np.array(rows).T
    return {
        f"unscaled_{name}": ("record", column, {"units": MEASURES[name]})
        for name, column in zip(MEASURES, columns, strict=True)
    }


def _describe_samples(
    ranges: Mapping[str, Any], draws: Sequence[Mapping[str, Any]], labels: Any, order: Any
) -> xr.Dataset:
    """Return the table of all samples, without results."""
    count = len(draws)
    columns: dict[str, Any] = {name: [row[name] for row in draws] for name in ranges}
    columns |= {"alternative": labels, "record_number": order}
    columns |= {name: np.full(count, value) for name, value in RESULTS.items()}
    variables = {name: ("sample", column) for name, column in columns.items()}
    return xr.Dataset(variables, attrs={"properties": json.dumps(list(ranges))})


def _continue_file(out: str | Path | None, table: xr.Dataset) -> None:
    """Store the results that a file has of the same samples, its first ones."""
    if out is None or not Path(out).exists():
        return
    kept = read_dataset(out, FILE_KIND)
    count = kept.sizes["sample"]
    first = table.isel(sample=slice(count))
    varies = (*RESULTS, "unscaled_sa")  # which is at the period of the hazard
    same = all(
        key in kept and (key in varies or np.array_equal(kept[key].values, first[key].values))
        for key in first
    )
    keys = ("properties", "inputs")
    if not same or any(kept.attrs[key] != table.attrs[key] for key in keys):
        raise InvalidInput(
            f"{out} has samples of other arguments: name another file, or delete this one"
        )
    for name in (*RESULTS, *{"slip_at_rest"} & kept.keys()):
        _column_of(table, name)[:count] = kept[name].values
    write_dataset(table, Path(out), FILE_KIND)  # with the hazard of this call


def _first_scales(table: xr.Dataset, measure: str, begin: int) -> Array:
    """Return the scale of each record to begin with: to `FIRST_PEAK`, or the median capacity."""
    name = measure if begin else "pga"
    unscaled = table[f"unscaled_{name}"].values
    if not begin:
        return np.asarray(FIRST_PEAK / unscaled)
    found = CollapseRisk(table.isel(sample=slice(begin)))
    found.check_answered(FIRST_ROUND // 2)  # of fewer than half the rate would say nothing
    low, high = found.capacities(name)
    middle = np.where(np.isfinite(high), np.sqrt(np.maximum(low, high / 4.0) * high), 2.0 * low)
    return np.asarray(float(np.median(middle)) / unscaled)


def _store_row(table: xr.Dataset, number: int, row: Mapping[str, Any]) -> None:
    """Store the bracket of a sample, or the text of its error."""
    for name, value in {**row["found"], "error": str(row["error"])}.items():
        _column_of(table, name)[number] = value


def _column_of(table: xr.Dataset, name: str) -> Any:
    """Return the values of a result, of which one may be new."""
    if name not in table:
        table[name] = "sample", np.zeros(table.sizes["sample"])
    return table[name].values


@validate_methods
@dataclass(frozen=True, eq=False, repr=False)
class CollapseRisk(ResultDisplay):
    """Capacities of sampled structures under records, and the annual rate at which they fall.

    Attributes:
        dataset: over `sample`: the varied properties, the `alternative`, the
            `record_number`, `lower` and `upper` scale of the bracket, `runs`, `error`, and where
            some samples are in doubt by it `slip_at_rest`, the largest displacement along a joint
            under dead load, of these [m]; over `record` the intensities of the unscaled records,
            `unscaled_pga` and others.
    """

    dataset: xr.Dataset

    @property
    def hazard(self) -> Hazard:
        """Hazard curve of the site."""
        values = json.loads(self.dataset.attrs["hazard"])
        return Hazard(values.pop("intensity"), values.pop("rate"), **values)

    @cached_property
    def answered(self) -> Any:
        """Numbers of the samples with a capacity (n,)."""
        return np.flatnonzero((self.dataset["runs"] > 0) & (self.dataset["error"] == ""))

    def check_answered(self, needed: int = FIRST_ROUND) -> None:
        """Refuse too few samples with an answer.

        Args:
            needed: number of those that are needed.

        Raises:
            DidNotConverge: there are fewer.
        """
        if len(self.answered) < needed:
            raise DidNotConverge(
                f"{self._describe_missing()}; a rate needs {FIRST_ROUND} answers: cure that, or "
                "give more samples",
                last=None,
            )

    def _describe_missing(self) -> str:
        """Say how many samples have no answer, with the most common reason and its remedy."""
        errors = [" ".join(str(error).split()) for error in self.dataset["error"].values]
        failed = [error for error in errors if error]
        if not failed:
            return f"{len(errors) - len(self.answered)} of {len(errors)} samples were not run yet"
        # reasons are the same that differ in names and numbers alone
        kinds = [re.sub(r"'[^']*'|\d[\d.e+-]*", "", error) for error in failed]
        kind, often = Counter(kinds).most_common(1)[0]
        reason = failed[kinds.index(kind)].partition(": ")[2]
        share = "" if often == len(failed) else f", {often} of them"
        verb = "has" if len(failed) == 1 else "have"
        return f"{len(failed)} of {len(errors)} samples {verb} no answer{share} because {reason}"

    def capacities(self, measure: str | None = None) -> tuple[Array, Array]:
        """Return the brackets of the intensity at which each answered sample falls, each (n,).

        Args:
            measure: "pga", "pgv", "sa" or "sa_avg"; by default that of the hazard.
        """
        rows = self.dataset.isel(sample=self.answered)
        if measure is not None:
            check_choice(measure, "measure", tuple(MEASURES))
        name = f"unscaled_{measure or self.hazard.measure}"
        unscaled = self.dataset[name].values[rows["record_number"].values]
        return unscaled * rows["lower"].values, unscaled * rows["upper"].values

    @cached_property
    def _curves(self) -> RecentResults[Fragility]:
        """Fragility curves that were fitted, by intensity measure."""
        return RecentResults(len(MEASURES))

    def fragility(self, measure: str | None = None) -> Fragility:
        """Return the lognormal fragility over all alternatives.

        Args:
            measure: as for `capacities`.

        Raises:
            InvalidInput: more than half of the samples never fall.
            DidNotConverge: fewer than 8 samples have an answer.
        """
        self.check_answered()
        name = measure or self.hazard.measure
        return self._curves.look_up(name, lambda: fragility(*reversed(self.capacities(name))))

    @cached_property
    def best_measure(self) -> str:
        """Intensity measure with the least dispersion, which predicts falls best."""
        return min(MEASURES, key=lambda name: float(fit_brackets(self._log_brackets(name))[1][0]))

    def _log_brackets(self, measure: str | None = None) -> Array:
        """Return the logarithms of the brackets of capacity (2, 1, n)."""
        with np.errstate(divide="ignore"):
            return np.log(np.array(self.capacities(measure)))[:, None, :]

    @cached_property
    def _bootstrap_samples(self) -> Any:
        """Answered samples of the bootstrap, whole records at a time (RESAMPLES, n)."""
        random, records = np.random.default_rng(0), self._of_answered("record_number")
        members = [np.flatnonzero(records == record) for record in np.unique(records)]
        drawn = np.empty((RESAMPLES, len(records)), int)
        for row in drawn:
            chosen = random.integers(len(members), size=2 * len(members) + len(records))
            row[:] = np.concatenate([members[k] for k in chosen])[: len(records)]
        return drawn

    def _of_answered(self, name: str) -> Any:
        """Return a variable of the answered samples (n,)."""
        return self.dataset[name].values[self.answered]

    @cached_property
    def _groups(self) -> list[Any]:
        """Masks of answered samples with one fit each (n,): alternatives, or all if one has few."""
        labels = self._of_answered("alternative")
        groups = [labels == label for label in np.unique(labels)]
        few = min(int(group.sum()) for group in groups) < FIRST_ROUND
        return [np.full(len(labels), True)] if few else groups

    def _fits(self, drawn: Any, group: Any) -> tuple[Array, Array]:
        """Return the lognormal fits of a group (n,) in resampled samples (k, n), each (k,)."""
        return fit_brackets(self._log_brackets()[:, 0, drawn], group[drawn])

    @cached_property
    def _rate_cache(self) -> dict[str | None, Rate]:
        """Rates that were computed, by alternative; None is all."""
        return {}

    def _integrate(self, drawn: Any, groups: Sequence[Any], variance: float = 0.0) -> Array:
        """Return the rates by resampled samples (k, n) of groups, with more variance (k,)."""
        rates = np.zeros(len(drawn))
        for group in groups:
            middle, deviation = self._fits(drawn, group)
            wide = np.sqrt(deviation**2 + variance)
            rates += group.mean() * integrate_rates(middle, wide, self.hazard)
        return rates / float(np.sum([group.mean() for group in groups]))

    def rate(self, alternative: str | None = None) -> Rate:
        """Return the annual rate of collapse with its 90 % interval.

        Args:
            alternative: label of one alternative; by default all by their weights.

        Raises:
            InvalidInput: there is no such alternative, or it has fewer than 8 answered samples.
            DidNotConverge: fewer than 8 samples have an answer.
        """
        self.check_answered()
        if alternative in self._rate_cache:
            return self._rate_cache[alternative]
        labels = self._of_answered("alternative")
        own = np.full(len(labels), True) if alternative is None else labels == alternative
        if own.sum() < FIRST_ROUND:
            raise InvalidInput(
                f"alternative {alternative!r} has {own.sum()} answered samples: name one of "
                f"{sorted(set(labels))} with at least {FIRST_ROUND}, or take more samples"
            )
        groups = self._groups if alternative is None else [own]
        drawn = np.vstack([np.arange(len(labels)), self._bootstrap_samples])
        drawn = drawn[np.all([group[drawn].any(axis=1) for group in groups], axis=0)]
        rates = self._integrate(drawn, groups)
        # Quantiles of the bootstrap are too narrow where records are few: with 7 they contain the
        # rate in three of four cases, and Student's t of its logarithm in 83 %.
        freedom = max(len(np.unique(self._of_answered("record_number")[own])) - 1, 1)
        error = float(np.log(rates[1:]).std()) * sqrt(1.0 + 1.0 / freedom)
        factor, mean = exp(float(stats.t.ppf(0.95, freedom)) * error), float(rates[0])
        rate = Rate(mean, mean / factor, mean * factor)
        self._rate_cache[alternative] = rate
        return rate

    def dispersions(self) -> dict[str, float]:
        """Return the dispersion of the capacity in total, by records, alternatives, and the rest.

        Not a number are parts that the samples do not separate, as where each record has only one.
        Parts are components of variance of a one-way analysis each (Searle, Casella and McCulloch,
        Variance components, 1992, section 3.6); the rest is of properties, and chance.
        """
        low, high = self.capacities()
        bounded = np.isfinite(high)
        low = np.where(bounded, np.maximum(low, 0.1 * high), low)
        logs = np.log(np.where(bounded, np.sqrt(low * high), low))
        # middles of brackets vary by their width too (Sheppard's correction)
        rounding = float(np.mean(np.log(np.where(bounded, high / low, 1.0)) ** 2)) / 12.0
        total = max(float(np.var(logs, ddof=1)) - rounding, 0.0)
        names = {"records": "record_number", "alternatives": "alternative"}
        parts = {k: variance_component(logs, self._of_answered(x)) for k, x in names.items()}
        rest = float(np.maximum(total - sum(parts.values()), 0.0))  # nan remains
        parts = {"total": total, **parts, "properties": rest}
        return {name: sqrt(variance) for name, variance in parts.items()}

    def disaggregation(self, bins: int = 12) -> tuple[Array, Array]:
        """Return the edges of bins of intensity (bins + 1,), and the share of the rate in each.

        A thousandth of the rate lies below the first edge. The rest lies above the last one, where
        all structures fall.

        Args:
            bins: number of bins.
        """
        curve, every = self.fragility(), np.arange(len(self.answered))[None]
        place = np.log(curve.median) + curve.dispersion * np.linspace(LEAST_DEVIATION, 2.5, 3501)
        middle = (place[1:] + place[:-1]) / 2.0
        fits = [(group.mean(), *self._fits(every, group)) for group in self._groups]
        falls = sum(share * ndtr((middle - mean) / wide) for share, mean, wide in fits)
        rates = self.hazard.rate_of(np.exp(place))
        below = np.cumsum(np.append(0.0, falls * -np.diff(rates)))
        below /= below[-1] + rates[-1]
        first, steps = np.interp(0.001, below, place), check_integer(bins, "bins")
        edges = np.linspace(first, place[-1], steps + 1)
        return np.exp(edges), np.diff(np.interp(edges, place, below))

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Reasons why the rate may be wrong, each with its remedy."""
        last, unit = self.hazard.intensity[-1], MEASURES[self.hazard.measure]
        edges, shares = self.disaggregation(240)
        beyond = 1.0 - float(shares[edges[:-1] <= last].sum())
        doubts = [*read_doubts(self.dataset.attrs["doubts"])]
        if beyond > LARGEST_EXTRAPOLATED_SHARE:
            cause = (
                f"{beyond:.0%} of the rate comes from intensities above {last:.3g} {unit}, once in "
                f"{1.0 / self.hazard.rate[-1]:.4g} years, where the hazard is extrapolated"
            )
            doubts.append(Doubt(cause, "give its points at longer return periods"))
        doubts += self._doubt_records()
        found, dt = self.dataset, self.dataset.attrs["dt"]
        steps, lacking = found["admissible_step"].values, found["lacks_joints"].values
        doubts += doubt_runs(steps.tolist(), lacking.tolist(), dt, "samples")
        doubts += self._doubt_rest()
        count = len(self.dataset["sample"])
        # a twentieth of all is what the 90 % interval leaves out at each of its ends
        if count - len(self.answered) > 0.05 * count:
            doubts.append(Doubt(f"the rate is that of some: {self._describe_missing()}", ""))
        return tuple(doubts)

    def _doubt_rest(self) -> Iterator[Doubt]:
        """Yield the doubt of samples that do not stand as drawn under dead load."""
        slips = self._of_answered("slip_at_rest") if "slip_at_rest" in self.dataset else np.zeros(1)
        stands = np.flatnonzero(slips <= MAX_SLIP_AT_REST)
        if len(stands) == len(slips):
            return
        cause = "shear displaces joints by up to {:mm} under dead load in {} of {} samples, which "
        cause += "do not stand as drawn"
        if len(stands) >= FIRST_ROUND:
            every = [np.full(len(slips), True)]
            rates = [self._integrate(x[None], every)[0] for x in (stands, np.arange(len(slips)))]
            cause += f"; without these the rate is {rates[0] / rates[1]:.2g} times as large"
        given = "`collapse_risk(…, vary={{'k_s': ({:.2g}, {:.3g})}})`"
        remedy = leave_out_soft(self._of_answered("k_s"), slips, given)
        yield Doubt(cause, remedy, (float(slips.max()), len(slips) - len(stands), len(slips)))

    def _doubt_records(self) -> Iterator[Doubt]:
        """Yield a doubt where records are few, or hardly differ in their spectra."""
        records = np.unique(self._of_answered("record_number"))
        mean, peak = (self.dataset[f"unscaled_{name}"].values for name in ("sa_avg", "pga"))
        spread = float(np.log(mean / peak)[records].std(ddof=1)) if len(records) > 1 else 0.0
        alike = spread < MATCHED_DISPERSION
        if len(records) >= FEWEST_RECORDS and not alike:
            return
        known = float(np.nan_to_num(self.dispersions()["records"]))
        lacking = max(USUAL_RECORD_DISPERSION**2 - known**2, 0.0)
        every = np.arange(len(self.answered))[None]
        wider = float(self._integrate(every, self._groups, lacking)[0])
        matched = f", of spectra as of matched ones (dispersion {spread:.2f})" if alike else ""
        yield Doubt(
            f"{len(records)} records{matched}: the interval is that of these, without other "
            f"records, hazard and model. With the usual dispersion of {USUAL_RECORD_DISPERSION:g} "
            f"from record to record, in place of {known:.2f}, the rate is "
            f"{wider / self.rate().rate:.2g} times as large",
            f"take {FEWEST_RECORDS} records or more that are scaled, and not matched",
        )

    @property
    def sentence(self) -> str:
        """The rate, and its basis."""
        curve, parts = self.fragility(), self.dispersions()
        records = len(np.unique(self._of_answered("record_number")))
        times = curve.median / float(self.hazard.intensity_of(DESIGN_PERIOD))
        failed = len(self.dataset["sample"]) - len(self.answered)
        known = ", ".join(f"{name} {x:.2f}" for name, x in parts.items() if name != "total")
        shares = "its parts unknown, with one sample a record" if "nan" in known else known
        text = (
            f"falls at {self.rate()}; median {curve.median:.3g} "
            f"{MEASURES[self.hazard.measure]} of {self.hazard.measure}, {times:.2g} times that of "
            f"{DESIGN_PERIOD:g} years, dispersion {curve.dispersion:.2f} ({shares}); "
            f"{self.best_measure} has the least dispersion; "
            f"{len(self.answered)} samples under {records} records"
        )
        have = "sample has" if failed == 1 else "samples have"
        return text + (f"; {failed} {have} no answer" if failed else "")

    def table(self) -> str:
        """Return a line for each alternative: samples, rate, interval, probability in 50 years."""
        labels = self._of_answered("alternative")
        counts = {None: len(labels)}
        if len(set(labels)) > 1:
            counts |= {label: int(np.sum(labels == label)) for label in sorted(set(labels))}
        enough = [label for label, count in counts.items() if count >= FIRST_ROUND]
        rows = [[each or "all", str(counts[each]), str(self.rate(each))] for each in enough]
        return align_columns(["alternative", "samples", "falls"], rows)

    def __str__(self) -> str:
        """Sentence, source of the hazard, doubts and table."""
        doubts = [f"{DOUBT_MARK}{doubt}" for doubt in self.doubts]
        return "\n".join([self.sentence, self.hazard.origin, *doubts, self.table()])

    def _summary(self) -> str:
        rate, median, *_ = self.sentence.split("; ")
        return f"CollapseRisk: {rate}; {median}"

    def save(self, path: str | Path) -> Path:
        """Write all samples to a NetCDF file, which `read` reads.

        Args:
            path: file to write; folders are created.
        """
        return write_dataset(self.dataset, Path(path), FILE_KIND)

    @classmethod
    def read(cls, path: str | Path) -> "CollapseRisk":
        """Read a file written by `save`, or kept by `collapse_risk(…, out=…)`.

        Args:
            path: file to read.

        Raises:
            InvalidInput: there is no such file, or it is damaged or of another version.
        """
        return cls(read_dataset(path, FILE_KIND))


def draw_risk_result(found: CollapseRisk) -> Any:
    """Draw fragility, hazard, and the intensities of the falls."""
    from archfem.view.studies import draw_collapse_risk  # matplotlib is slow to import

    return draw_collapse_risk(found)
