"""Selection of recorded motions: scaled records whose mean spectrum follows a design spectrum."""

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from csv import writer
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from functools import lru_cache
from io import StringIO
from math import inf, nan
from os import PathLike
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from archfem._display import ResultDisplay
from archfem._files import align_columns
from archfem._typing import Array, Numbers
from archfem._validation import (
    check_fields,
    check_integer,
    check_number,
    validate_arguments,
    validate_methods,
)
from archfem.errors import ArchfemError, DidNotConverge, InvalidInput
from archfem.motion.design_spectra import DesignSpectrum
from archfem.motion.motion import Motion
from archfem.motion.records.reader import join_channels, read_channels
from archfem.motion.records.record_file import Channel
from archfem.motion.response_spectra import response_spectrum, rotated_spectrum
from archfem.motion.suite import Suite
from archfem.units import STANDARD_GRAVITY

# Spectral measure of a record: of one horizontal component, or over all directions of a pair
Measure = Literal["horizontal", "RotD50", "RotD100"]


@validate_methods
@dataclass(frozen=True)
class SelectionRule:
    """Rule of a code for the mean spectrum of scaled records, by ratio to the design spectrum.

    Periods are checked from max(shortest, shortest_ratio T₁) to max(longest, longest_ratio T₁),
    with the fundamental period T₁ of the structure.

    Attributes:
        name: name of the code.
        lower: least mean spectrum over the design spectrum [-].
        upper: largest mean spectrum over the design spectrum [-].
        zero_period: least mean peak acceleration over the spectrum at period zero [-]; 0 for none.
        shortest: first period, at least [s].
        shortest_ratio: first period over T₁, at least [-].
        longest: last period, at least [s].
        longest_ratio: last period over T₁, at least [-].
        fewest: least number of records.
        source: clauses of the code, and how they are known.

    Raises:
        InvalidInput: a value is negative, or the bounds are not in order.
    """

    name: str
    lower: float
    upper: float
    zero_period: float
    shortest: float
    shortest_ratio: float
    longest: float
    longest_ratio: float
    fewest: int
    source: str

    def __post_init__(self) -> None:
        """Check that bounds are ratios in order."""
        check_fields(self)
        for key in ("zero_period", "shortest", "shortest_ratio", "longest", "longest_ratio"):
            check_number(getattr(self, key), f"{self.name}, {key}", minimum=0.0)
        if not 0.0 <= self.lower < self.upper:
            raise InvalidInput(
                f"{self.name}: the mean is to be from {self.lower:g} to {self.upper:g} times the "
                "design spectrum: give 0 <= lower < upper, such as 0.9 and 1.3"
            )

    def band(self, period: float) -> tuple[float, float]:
        """Return the first and last period that are checked [s].

        Args:
            period: fundamental period T₁ of the structure [s].

        Raises:
            InvalidInput: the period is not positive, or the range is empty.
        """
        first = max(self.shortest, self.shortest_ratio * period)
        last = max(self.longest, self.longest_ratio * period)
        if not (0.0 < period < inf and 0.0 < first < last < inf):
            raise InvalidInput(
                f"{self.name} at T₁ = {period:g} s checks periods from {first:g} to {last:g} s: "
                "give a positive period, and a rule with 0 < first < last"
            )
        return first, last


# Rules by name. Neither code's text could be read: secondary sources confirm what they name.
SELECTION_RULES: Mapping[str, SelectionRule] = {
    rule.name: rule
    for rule in (
        SelectionRule(
            *("EC8", 0.9, inf, 1.0, 0.0, 0.2, 0.0, 2.0, 3),
            "EN 1998-1:2004, 3.2.3.1.2(4), by 3.2.3.1.3 also for records: 0.9 as quoted by "
            "Iervolino et al. (2008); 0.2 T₁ to 2 T₁, zero period and 3 records from memory",
        ),
        SelectionRule(
            *("NTC-2018", 0.9, 1.3, 0.0, 0.15, 0.0, 2.0, 2.0, 3),
            "NTC 2018, 3.2.3.6 and 7.3.5, from memory: -10 % and +30 %, 3 records; the clause has "
            "'periods of interest' for records, the range here is its range for artificial motions",
        ),
    )
}


@dataclass(frozen=True, eq=False)
class SelectedRecord:
    """A record that may be or was selected, and its scale.

    Attributes:
        motion: as recorded; its horizontal is the selected component.
        event: earthquake by date or name, "" where it is unknown.
        scale: factor on all components [-]; 1 before the selection.
        sources: for each component of the motion, its file and number of the channel, from 1.
    """

    motion: Motion
    event: str
    scale: float
    sources: Mapping[str, tuple[Path, int]]


@validate_methods
@dataclass(frozen=True, eq=False, repr=False)
class RecordSelection(ResultDisplay):
    """Records and scales whose mean spectrum follows a design spectrum by a code's rule.

    Attributes:
        rule: rule of the code.
        measure: spectral measure of a record.
        band: first and last period that are checked [s].
        scales: least and largest scale that were allowed [-].
        records: selected records.
        periods: periods of the spectra (m,) [s].
        spectra: scaled spectra of the records (n, m) [m/s²].
        target: design spectrum (m,) [m/s²].
        zero_period_ratio: mean peak acceleration over the design spectrum at period zero [-],
            undefined (NaN) where the rule does not need it.
        candidates: how many components, or pairs, there were to choose from.
        skipped: names of files that are not used, each with the reason.
    """

    rule: SelectionRule
    measure: Measure
    band: tuple[float, float]
    scales: tuple[float, float]
    records: tuple[SelectedRecord, ...]
    periods: Array
    spectra: Array
    target: Array
    zero_period_ratio: float
    candidates: int
    skipped: Mapping[str, str]

    @property
    def mean(self) -> Array:
        """Mean of the scaled spectra (m,) [m/s²]."""
        return self.spectra.mean(axis=0)

    @property
    def bounds(self) -> tuple[float, float]:
        """Least and largest ratio of the mean spectrum to the design spectrum [-]."""
        ratio = self.mean / self.target
        return float(ratio.min()), float(ratio.max())

    @property
    def shortfall(self) -> float:
        """Ratio by which the rule is missed, at the period where it is missed most [-]."""
        return float(_measure_miss(self.rule, *self.bounds, self.zero_period_ratio))

    @property
    def meets(self) -> bool:
        """Whether the mean spectrum meets the rule, up to round-off."""
        return self.shortfall <= 1e-9

    @property
    def unknown_events(self) -> tuple[str, ...]:
        """Names of the records whose event is unknown; each counts as an event of its own."""
        return tuple(record.motion.name for record in self.records if not record.event)

    def spectra_at(self, periods: Array) -> Array:
        """Return the scaled spectra of the records at any periods (n, m) [m/s²].

        Args:
            periods: natural periods (m,) [s].

        Raises:
            InvalidInput: a period is negative.
        """
        spectra = (_compute_spectrum(each.motion, self.measure, periods) for each in self.records)
        return np.array([each.scale * row for each, row in zip(self.records, spectra, strict=True)])

    def suite(self, name: str = "selection") -> Suite:
        """Return the scaled records as a suite, for time histories and incremental analyses.

        Args:
            name: name of the suite.
        """
        return Suite(name, tuple(each.motion.scaled(each.scale) for each in self.records))

    def table(self) -> str:
        """Return name, event, scale, scaled peak [m/s²] and files of the records, as CSV."""
        text = StringIO()
        writer(text, lineterminator="\n").writerows(self._rows())
        return text.getvalue().rstrip("\n")

    def _rows(self) -> list[list[str]]:
        """Return the head and the texts of a row of each record."""
        rows = [["record", "event", "scale [-]", "scaled PGA [m/s²]", "files"]]
        for record in self.records:
            files = " + ".join(dict.fromkeys(path.name for path, _ in record.sources.values()))
            row = record.motion.name, record.event or "unknown", f"{record.scale:.4g}"
            rows.append([*row, f"{record.scale * record.motion.pga:.4g}", files])
        return rows

    def _summary(self) -> str:
        """Describe the result in one line."""
        low, high = self.bounds
        state = "met" if self.meets else f"missed by {self.shortfall:.3g} of the design spectrum"
        return (
            f"RecordSelection of {len(self.records)} from {self.candidates} candidates: mean over "
            f"design spectrum {low:.3f} to {high:.3f} from {self.band[0]:.3g} to "
            f"{self.band[1]:.3g} s, {self.rule.name} is {state}"
        )

    def __str__(self) -> str:
        """Describe outcome, rule, records, unknown events and skipped files."""
        rule, peaks = self.rule, ""
        if not np.isnan(self.zero_period_ratio):
            peaks = f"; mean peak over design spectrum {self.zero_period_ratio:.3f}, "
            peaks += f"at least {rule.zero_period:g}"
        most = f"at most {rule.upper:g}" if rule.upper < inf else "no upper bound"
        head, *rows = self._rows()
        lines = [
            self._summary(),
            f"mean of {self.measure} at least {rule.lower:g}, {most}{peaks}; scales from "
            f"{self.scales[0]:g} to {self.scales[1]:g}",
            align_columns(head, rows),
            f"{rule.name}: {rule.source}",
        ]
        if self.unknown_events:
            names = ", ".join(self.unknown_events)
            lines.append(f"event unknown, each counted as an event of its own: {names}")
        lines += [f"not used: {name}: {reason}" for name, reason in self.skipped.items()]
        return "\n".join(lines)


@validate_arguments
def select_records(
    folder: str | PathLike[str],
    spectrum: DesignSpectrum,
    period: float,
    *,
    count: int = 7,
    rule: str | SelectionRule = "EC8",
    scales: tuple[float, float] = (1.0 / 3.0, 3.0),
    measure: Measure = "horizontal",
    events: Mapping[str, str] | None = None,
) -> RecordSelection:
    """Select records of a folder whose scaled mean spectrum follows a design spectrum.

    Files of one instrument are joined where their names differ by the direction alone: vertical and
    second horizontal accompany the horizontal that is selected. Each record is scaled to the least
    square of its ratio to the design spectrum minus 1; one further factor brings the mean of the
    set within the rule. Sets are built record by record from the best 30 ones. Single records are
    then exchanged until no exchange lowers the root mean square of the mean's ratio minus 1. The
    search is deterministic, and need not find the best of all sets.

    At most one record of each event is selected. The event is the date of the earthquake in the
    head of a file or in its name, else PEER's name for it: all earthquakes of a day are one event.

    Args:
        folder: folder of the files, with those below it.
        spectrum: design spectrum for 5 % damping; its horizontal values are in g.
        period: fundamental period T₁ of the structure [s].
        count: how many records to select.
        rule: EC8 or NTC-2018, or a rule of your own; `dataclasses.replace` changes a value.
        scales: least and largest scale of a record [-]. The codes give none: this is our choice.
        measure: "horizontal" compares single components, "RotD50" and "RotD100" the median and the
            maximum over all directions of a pair.
        events: event by file name, with * and ?, where the file does not name its event.

    Returns:
        The selected records with their scales and spectra; `suite()` makes motions of them.

    Raises:
        InvalidInput: a value is out of range, or the folder has records of fewer events than count.
        DidNotConverge: no set was found that meets the rule; `last` is the nearest selection.

    References:
        Iervolino, Maddaloni, Cosenza, Eurocode 8 compliant real record sets for seismic analysis
        of structures, J. Earthquake Engineering 12 (2008). Boore, Orientation-independent,
        nongeometric-mean measures of seismic intensity, BSSA 100 (2010).
    """
    if not isinstance(rule, SelectionRule) and rule not in SELECTION_RULES:
        raise InvalidInput(
            f"rule {rule!r} is unknown: use one of {', '.join(SELECTION_RULES)}, or a SelectionRule"
        )
    chosen_rule = rule if isinstance(rule, SelectionRule) else SELECTION_RULES[rule]
    check_integer(count, f"count of records for {chosen_rule.name}", minimum=chosen_rule.fewest)
    if not 0.0 < scales[0] <= scales[1] < inf:
        raise InvalidInput(f"scales {scales}: expected 0 < least <= largest")
    band = chosen_rule.band(period)
    # the search compares spectra at fewer periods than those at which its result is checked
    periods = np.geomspace(*band, 60)
    # a spectrum that is not defined over the whole range is refused before files are read
    target = _tabulate_target(spectrum, chosen_rule, periods)
    candidates, skipped = _read_candidates(Path(folder), _list_files(folder), measure)
    candidates = _name_events(candidates, events or {})
    _check_events(candidates, count, folder, skipped)
    table = _compute_spectra(candidates, measure, periods)
    search = _Search(chosen_rule, table / target, _number_events(candidates), scales)
    chosen = [candidates[index] for index in search.find(count)]
    settings: dict[str, Any] = {"rule": chosen_rule, "measure": measure, "band": band}
    settings |= {"scales": scales, "candidates": len(candidates), "skipped": skipped}
    selection = _scale_records(chosen, spectrum, settings)
    if not selection.meets:
        raise DidNotConverge(
            f"{selection!r}: no set was found that meets the rule; error.last is the nearest: add "
            "records, allow other scales or fewer records, or change the rule",
            last=selection,
        )
    return selection


def _tabulate_target(spectrum: DesignSpectrum, rule: SelectionRule, periods: Array) -> Array:
    """Return the design spectrum at period zero, infinite if not needed, and at others [m/s²]."""
    peak = float(spectrum.horizontal(0.0)) if rule.zero_period else inf
    values = np.array([peak, *spectrum.horizontal(periods)]) * STANDARD_GRAVITY
    if not np.all(values > 0.0):
        raise InvalidInput("the design spectrum has values that are not positive: check its keys")
    return values


def _list_files(folder: str | PathLike[str]) -> tuple[tuple[Path, int, int], ...]:
    """List the files of a folder, with time of change and size, by which content is cached."""
    place = Path(folder)
    if not place.is_dir():
        raise InvalidInput(f"{place} is no folder: give one that has records")
    files = [path for path in sorted(place.rglob("*")) if path.is_file() and path.name[0] != "."]
    return tuple((path, path.stat().st_mtime_ns, path.stat().st_size) for path in files)


@lru_cache(maxsize=1)  # a folder takes memory, and is usually searched with several settings
def _read_candidates(
    folder: Path, files: tuple[tuple[Path, int, int], ...], measure: Measure
) -> tuple[tuple[SelectedRecord, ...], Mapping[str, str]]:
    """Read all files; return candidates, and files that are not used with reasons."""
    skipped: dict[str, str] = {}
    groups: dict[Path, list[_Source]] = defaultdict(list)
    for path, _, _ in files:
        try:
            channels = read_channels(path)
        except ArchfemError as error:
            skipped[str(path.relative_to(folder))] = str(error).removeprefix(f"{path}: ")
            continue
        alone = len(channels) == 1
        key = _strip_direction(path, channels[0].direction) if alone else path
        groups[key] += [_Source(path, k, channel) for k, channel in enumerate(channels, 1)]
    found: list[SelectedRecord] = []
    for sources in groups.values():
        refusal = _refuse_group(sources, measure)
        try:
            found += [] if refusal else list(_combine_components(sources, measure))
        except InvalidInput as error:  # of components at other times
            refusal = str(error)
        if refusal:
            skipped |= {str(each.path.relative_to(folder)): refusal for each in sources}
    return tuple(found), skipped


class _Source(NamedTuple):
    """A component and where it was read."""

    path: Path
    number: int  # of the channel in the file, from 1
    channel: Channel


def _strip_direction(path: Path, direction: str) -> Path:
    """Return a path without the direction in its name; files of one instrument then share it."""
    # "DWN, turned up" is DWN in the name, "E-W" is EW, and 0 is 000 degrees
    token = re.sub(r"\W", "", direction.partition(",")[0])
    token = token.zfill(3) if token.isdigit() else token
    pattern = re.compile(rf"[-_ ]?{token}(?=\.|$)", re.IGNORECASE)
    return path.with_name(pattern.sub("", path.name, count=1)) if token else path


def _refuse_group(sources: Sequence[_Source], measure: Measure) -> str:
    """Return why the components of an instrument cannot be used, or an empty text."""
    level = [each.channel for each in sources if not each.channel.is_vertical]
    steps = {each.channel.dt for each in sources}
    if not level:
        return "vertical component alone"
    if len(level) > 2 or len(sources) - len(level) > 1 or len(steps) > 1:
        return f"{len(sources)} components or their steps are not those of one instrument"
    if len(level) == 1 and measure != "horizontal":
        return f"{measure} needs two horizontal components"
    return "" if all(np.any(each.samples) for each in level) else "at rest"


def _combine_components(sources: Sequence[_Source], measure: Measure) -> Iterator[SelectedRecord]:
    """Yield a motion for each horizontal component, or one for the pair."""
    level = [each for each in sources if not each.channel.is_vertical]
    upright = [each for each in sources if each.channel.is_vertical]
    event = _find_event(sources[0].path)
    for first in level if measure == "horizontal" else level[:1]:
        others = [each for each in level if each is not first]
        parts = dict(zip(("horizontal", "transverse"), [first, *others], strict=False))
        parts |= dict(zip(("vertical",), upright, strict=False))
        several = len({each.path for each in sources}) < len(sources)
        # components of one file differ by their direction alone
        name = f"{first.path.stem} {first.channel.direction}" if several else first.path.stem
        rows = join_channels({key: each.channel for key, each in parts.items()})
        motion = Motion(**rows, name=name)
        places = {key: (each.path, each.number) for key, each in parts.items()}
        yield SelectedRecord(motion, event, 1.0, places)


def _find_event(path: Path) -> str:
    """Find the date of the earthquake in the head of a file or in its name, or PEER's name."""
    with path.open("rb") as file:
        head = file.read(4000)
    text = "" if b"\0" in head else head.decode("latin-1")
    months = ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"]
    year, day = r"((?:19|20)\d\d)", r"(\d{1,2})"
    name = re.search(rf"(?<!\d){year}(\d\d)(\d\d)(?:\d{{4,6}})?(?!\d)", path.name)
    for line in text.splitlines()[:40]:
        if "process" in line.lower():  # the date of processing
            continue
        if found := re.search(rf"(?<!\d){year}(?:[-/]| +){day}(?:[-/]| +){day}(?!\d)", line):
            return _format_date(*found.groups())
        if found := re.search(rf"\b({'|'.join(months)})[a-z]*\.? +{day}, *{year}", line, re.I):
            return _format_date(found[3], months.index(found[1].lower()) + 1, found[2])
        if found := re.search(rf"(?<!\d){day}/{day}/({year}|\d\d)(?!\d)", line):
            return _format_date(found[3], found[1], found[2])
        if found := re.search(rf"event.*?(?<!\d){year}(\d\d)(\d\d)(?!\d)", line, re.I):
            return _format_date(*found.groups())
    if name:
        return _format_date(*name.groups())
    return found[1] if (found := re.match(r"RSN\d+_([^_]+)_", path.name)) else ""


def _format_date(year: str, month: str | int, day: str) -> str:
    """Format a date as 1999-08-17; the month is the number up to 12."""
    first, second = int(month), int(day)
    first, second = (second, first) if first > 12 else (first, second)
    return f"{year if len(year) == 4 else '19' + year}-{first:02d}-{second:02d}"


def _name_events(
    candidates: Sequence[SelectedRecord], events: Mapping[str, str]
) -> tuple[SelectedRecord, ...]:
    """Replace events by those that were given for file names."""
    named = list(candidates)
    for pattern, event in events.items():
        found = False
        for index, each in enumerate(candidates):
            if any(fnmatch(path.name, pattern) for path, _ in each.sources.values()):
                named[index], found = replace(each, event=event), True
        if not found:
            raise InvalidInput(f"events: no record that can be used has a file {pattern!r}")
    return tuple(named)


def _number_events(candidates: Sequence[SelectedRecord]) -> Numbers:
    """Return a number of the event of each candidate (n,); files of an unknown one share it."""
    keys = [each.event or min(each.sources.values()) for each in candidates]
    return np.array([keys.index(key) for key in keys])


def _check_events(
    candidates: Sequence[SelectedRecord],
    count: int,
    folder: str | PathLike[str],
    skipped: Mapping[str, str],
) -> None:
    """Refuse a folder with records of too few events."""
    events = len(set(_number_events(candidates))) if candidates else 0
    if events < count:
        reasons = "; ".join(f"{name}: {reason}" for name, reason in list(skipped.items())[:20])
        raise InvalidInput(
            f"{folder} has {len(candidates)} candidates of {events} events, fewer than "
            f"{count} to select: add records, or name events that were taken for one by events="
            + (f"; not used: {reasons}" if reasons else "")
        )


@lru_cache(maxsize=4000)
def _spectrum_of_motion(motion: Motion, measure: Measure, periods: tuple[float, ...]) -> Array:
    """Compute the peak acceleration and the spectrum of a motion once (1 + m,) [m/s²]."""
    return _compute_spectrum(motion, measure, np.array([0.0, *periods]))


def _compute_spectra(motions: Sequence[SelectedRecord], measure: Measure, periods: Array) -> Array:
    """Return peak acceleration and spectrum of each candidate (n, 1 + m) [m/s²]."""
    return np.array([_spectrum_of_motion(each.motion, measure, tuple(periods)) for each in motions])


def _compute_spectrum(motion: Motion, measure: Measure, periods: Array) -> Array:
    """Compute the spectrum of a motion by a measure (m,) [m/s²]."""
    if measure == "horizontal":
        return response_spectrum(motion, periods)
    return rotated_spectrum(motion, periods, 50.0 if measure == "RotD50" else 100.0)


class _Search:
    """Search for the records whose scaled mean spectrum is nearest to the design spectrum."""

    def __init__(
        self,
        rule: SelectionRule,
        ratios: Array,  # spectra over the design spectrum, period zero first (n, 1 + m) [-]
        events: Numbers,  # number of the event of each record (n,)
        scales: tuple[float, float],  # the least and the largest [-]
    ) -> None:
        self.rule, self.events, self.limits = rule, events, scales
        # scale of least squares: minimum of Σ (s r - 1)²
        inside = ratios[:, 1:]
        self.scales = np.clip(inside.sum(axis=1) / (inside**2).sum(axis=1), *scales)
        self.ratios = self.scales[:, None] * ratios

    def find(self, count: int, starts: int = 30) -> list[int]:
        """Return the numbers of the selected records, in order."""
        best, lowest = list[int](), inf
        for first in np.argsort(self._evaluate([]), kind="stable")[:starts]:
            chosen = [int(first)]
            while len(chosen) < count:
                chosen.append(int(np.argmin(self._evaluate(chosen))))
            cost = self._exchange(chosen)
            if cost < lowest - 1e-12:
                best, lowest = chosen, cost
        return sorted(best)

    def _exchange(self, chosen: list[int]) -> float:
        """Exchange single records, in place, as long as the cost decreases; return the cost."""
        cost, place, since = inf, 0, 0
        while since < len(chosen):
            costs = self._evaluate(chosen[:place] + chosen[place + 1 :])
            best = int(np.argmin(costs))
            since = 0 if costs[best] < cost - 1e-12 else since + 1
            if not since:
                cost, chosen[place] = float(costs[best]), best
            place = (place + 1) % len(chosen)
        return cost

    def _evaluate(self, chosen: list[int]) -> Array:
        """Return the cost of a set with each further record (n,), infinite for its events."""
        mean = (self.ratios[chosen].sum(axis=0) + self.ratios) / (len(chosen) + 1)
        least = np.minimum(self.scales, self.scales[chosen].min(initial=inf))
        most = np.maximum(self.scales, self.scales[chosen].max(initial=0.0))
        scaled = self.common_factor(mean, least, most)[:, None] * mean
        inside = scaled[:, 1:]
        miss = _measure_miss(self.rule, inside.min(axis=1), inside.max(axis=1), scaled[:, 0])
        # a set that misses the rule by 0.001 is worse than any set that meets it
        cost = 1e3 * miss + np.sqrt(np.mean((inside - 1.0) ** 2, axis=1))
        return np.where(np.isin(self.events, self.events[chosen]), inf, cost)

    def common_factor(self, mean: Array, least: Array, most: Array) -> Array:
        """Return the factor of each set that brings its mean spectrum (n, 1 + m) to the target."""
        # the factor of least squares is brought within the rule, then within the allowed scales
        inside = mean[:, 1:]
        lowest, highest = self.rule.lower / inside.min(axis=1), self.rule.upper / inside.max(axis=1)
        if self.rule.zero_period:
            lowest = np.maximum(lowest, self.rule.zero_period / mean[:, 0])
        factor = np.clip(inside.sum(axis=1) / (inside**2).sum(axis=1), lowest, highest)
        if self.rule.upper < inf:  # where the rule cannot be met, it is missed on both sides
            factor = np.where(lowest > highest, np.sqrt(lowest * highest), factor)
        return np.clip(factor, self.limits[0] / least, self.limits[1] / most)


def _measure_miss(
    rule: SelectionRule, low: float | Array, high: float | Array, zero: float | Array
) -> Array:
    """Return by how much ratios miss a rule [-], 0 where they meet it."""
    miss: Array = np.maximum(np.maximum(rule.lower - low, high - rule.upper), 0.0)
    return np.maximum(miss, rule.zero_period - zero) if rule.zero_period else miss


def _scale_records(
    chosen: Sequence[SelectedRecord], spectrum: DesignSpectrum, settings: dict[str, Any]
) -> RecordSelection:
    """Scale the selected records, and check them at more periods than the search does."""
    rule, (first, last) = settings["rule"], settings["band"]
    periods = np.geomspace(first, last, 120)
    target = _tabulate_target(spectrum, rule, periods)
    spectra = _compute_spectra(chosen, settings["measure"], periods)
    fine = _Search(rule, spectra / target, np.arange(len(chosen)), settings["scales"])
    mean = fine.ratios.mean(axis=0, keepdims=True)
    factor = fine.common_factor(mean, fine.scales.min(), fine.scales.max())[0]
    final = factor * fine.scales
    pairs = zip(chosen, final, strict=True)
    return RecordSelection(
        **settings,
        records=tuple(replace(each, scale=float(scale)) for each, scale in pairs),
        periods=periods,
        spectra=final[:, None] * spectra[:, 1:],
        target=target[1:],
        zero_period_ratio=float(factor * mean[0, 0]) if rule.zero_period else nan,
    )
