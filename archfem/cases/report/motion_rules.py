"""Rules of a norm for suites of motions, what is found and whether it is met; ratings by it."""

import re
from collections.abc import Iterator
from csv import reader
from inspect import signature
from typing import NamedTuple

import numpy as np

from archfem._typing import Array
from archfem.cases.report.report_data import ReportData
from archfem.errors import InvalidInput
from archfem.masonry.structure import join_words
from archfem.motion.design_spectra import DesignSpectrum
from archfem.motion.motion import Motion
from archfem.motion.record_selection import SELECTION_RULES, SelectionRule
from archfem.motion.response_spectra import response_spectrum
from archfem.motion.signal_processing import PLATEAU
from archfem.units import STANDARD_GRAVITY
from archfem.view.pages.document import Grid, TextBlock

# Rules by the words of norms in [report], without spaces
_NORMS = {"EN1998": "EC8", "EC8": "EC8", "EUROCODE8": "EC8", "NTC": "NTC-2018"}

# Words of a rating by a norm, by what the norm is called
_NORMS_OF_RATINGS = {
    **dict.fromkeys(("EUROCODE", "EN199", "NTC"), "by Eurocodes|^LM(1|2|71)"),
    **dict.fromkeys(("CS45", "BD21"), "by CS 454|^CS454"),
}

# Years of editions whose rules are others
_OTHER_EDITIONS = ("2008", "2024")

# Longest period up to which motions are compared beyond the rule, where blocks rock [s]
LONGEST_PERIOD = 4.0

# Shortest stationary part of artificial motions, in both norms: from memory [s]
MIN_PLATEAU = 10.0

# Digits of what is found and printed, by which rules are judged
DIGITS = 3


class Check(NamedTuple):
    """One rule for the motions of a report."""

    rule: str
    required: str
    found: str
    met: bool | None  # None where it could not be checked

    @property
    def state(self) -> str:
        """Whether the rule is met, in words."""
        return {True: "met", False: "not met", None: "not checked"}[self.met]


def find_rule(data: ReportData) -> SelectionRule | None:
    """Return the rule for motions of the norm of a report; None if it is of another norm."""
    norm = data.case.report.get("norm", "").replace(" ", "").upper()
    if any(year in norm for year in _OTHER_EDITIONS):
        return None
    found = (rule for words, rule in _NORMS.items() if words in norm)
    return SELECTION_RULES.get(next(found, ""))


def name_norm(rule: SelectionRule | None) -> str:
    """Return the name of the norm of a rule, which may be one of several that a report names."""
    return re.split("[:,]", rule.source)[0] if rule else ""


def check_motions(data: ReportData) -> list[Check]:
    """Check the motions of a report by the rules of its norm; none without a norm or a run."""
    rule = find_rule(data)
    if rule is None or not data.runs:
        return []
    count = len(data.runs)
    number = Check("number of motions", f"≥ {rule.fewest}", f"{count}", count >= rule.fewest)
    return [number, *_check_spectra(data, rule), *_check_plateaus(data)]


def find_missed(data: ReportData) -> list[Check]:
    """Return the rules of the norm that the motions of a report do not meet."""
    return [check for check in check_motions(data) if check.met is False]


def find_target(data: ReportData) -> DesignSpectrum | None:
    """Return the spectrum that motions are compared with: of their suite, or of an assessment."""
    return data.case.target or data.case.assessment.spectrum


def _check_spectra(data: ReportData, rule: SelectionRule) -> Iterator[Check]:
    """Yield the checks of the mean spectrum, before a reduction, against the target."""
    target, reduction = find_target(data), (data.case.suite or {}).get("reduction", 1.0)
    if target is None:
        yield Check("mean spectrum over the target", "a spectrum", "the case gives none", None)
        return
    required = f"{rule.lower:g} to {rule.upper:g}" if rule.upper < np.inf else f"≥ {rule.lower:g}"
    ratios = f"{rule.shortest_ratio:g} T₁" if rule.shortest_ratio else f"{rule.shortest:g} s"
    end = f"{rule.longest_ratio:g} T₁"
    if rule.longest > 0.0:
        end = f"the longer of {end} and {rule.longest:g} s"
    name = f"mean spectrum over the target, from {ratios} to {end}"
    period, motions = find_period(data), [*data.motions.values()]
    if period is None:
        yield Check(name, required, "the period T₁ is unknown: run `archfem modes`", None)
    else:
        band = rule.band(period)
        periods = np.geomspace(*band, 120)
        try:
            every = np.array([_mean_spectrum([motion], periods) for motion in motions])
            ratios = reduction * every / target.horizontal(periods)
        except InvalidInput as error:  # a spectrum that ends below the longest period
            yield Check(name, required, str(error), None)
        else:
            met, (least, most) = _meets(ratios, rule)
            within = f"from {band[0]:.3g} to {band[1]:.3g} s"
            causes = "" if met else _name_causes([each.name for each in motions], ratios, rule)
            yield Check(name, required, f"{least:g} to {most:g} {within}{causes}", met)
        yield from _compare_beyond(motions, target, reduction, band[1])
    if rule.zero_period:
        mean = np.mean([motion.pga for motion in motions]) / STANDARD_GRAVITY
        exact = reduction * mean / target.horizontal(0.0)
        ratio = _round(exact)
        met = ratio >= rule.zero_period
        name = "mean PGA over the target at period zero"
        larger = np.ceil(1e3 * rule.zero_period / exact) / 1e3
        found = f"{ratio:g}" if met else f"{ratio:g}: scale by {larger:g}"
        yield Check(name, f"≥ {rule.zero_period:g}", found, met)


def _meets(ratios: Array, rule: SelectionRule) -> tuple[bool, tuple[float, float]]:
    """Return whether the mean of spectra over the target (motions, periods) is within, its ends."""
    mean = ratios.mean(axis=0)
    least, most = _round(mean.min()), _round(mean.max())
    return rule.lower <= least and most <= rule.upper, (least, most)


def _name_causes(names: list[str], ratios: Array, rule: SelectionRule) -> str:
    """Name the fewest of the lowest motions without which the rule is met; "" if none are."""
    order = ratios[:, ratios.mean(axis=0).argmin()].argsort()
    for count in range(1, len(names) - rule.fewest + 1):
        if _meets(ratios[order[count:]], rule)[0]:
            left = [f"'{names[k]}'" for k in order[:count]]
            return f"; met without {join_words(left)}"
    return ""


def _round(value: float) -> float:
    """Return a number as it is printed."""
    return float(f"{value:.{DIGITS}g}")


def _compare_beyond(
    motions: list[Motion], target: DesignSpectrum, reduction: float, shortest: float
) -> Iterator[Check]:
    """Yield the motions over the target at the periods of rocking, for which there is no rule."""
    periods = np.geomspace(shortest, LONGEST_PERIOD, 60)
    try:
        design = reduction / target.horizontal(periods)
    except InvalidInput:  # a spectrum that ends before
        return
    ratios = {motion.name: design * _mean_spectrum([motion], periods) for motion in motions}
    mean = np.mean([*ratios.values()], axis=0)
    name, worst = max(ratios.items(), key=lambda each: float(np.abs(np.log(each[1])).max()))
    at = int(np.abs(np.log(worst)).argmax())
    yield Check(
        f"the same from there to {LONGEST_PERIOD:g} s",
        "no rule: T₁ is that of closed joints, and what rocks has longer periods",
        f"{mean.min():.3g} to {mean.max():.3g}; '{name}' {worst[at]:.3g} at {periods[at]:.3g} s",
        None,
    )


def _mean_spectrum(motions: list[Motion], periods: Array) -> Array:
    """Return the mean horizontal spectrum of some motions [g]."""
    spectra = np.array([response_spectrum(motion, periods, 0.05) for motion in motions])
    return spectra.mean(axis=0) / STANDARD_GRAVITY


def _check_plateaus(data: ReportData) -> Iterator[Check]:
    """Yield the check of the stationary part of synthetic motions, whose envelope is known."""
    tables = (data.case.suite or {}).get("pairs") or {"": data.case.motion or {}}
    usual = signature(Motion.synthetic).parameters["duration"].default
    made = [each["synthetic"] for each in tables.values() if "synthetic" in each]
    if durations := [float(each.get("duration", usual)) for each in made]:
        share, least = PLATEAU[1] - PLATEAU[0], min(durations)
        part = _round(share * least)
        found = f"{part:g} s, {share:.0%} of {least:g} s"
        name = "stationary part of artificial motions"
        yield Check(name, f"≥ {MIN_PLATEAU:g} s", found, part >= MIN_PLATEAU)
    if len(made) < len(tables):
        name, found = "stationary part of motions from files", "unknown; records need none"
        yield Check(name, f"≥ {MIN_PLATEAU:g} s if artificial", found, None)


def find_period(data: ReportData) -> float | None:
    """Return the period of the computed mode with the largest mass along x [s]."""
    _, *rows = reader((data.read_text("modes.csv") or "").splitlines() or [""])
    modes = [(float(share), float(period)) for _, period, share, *_ in rows]
    return max(modes)[1] if modes else None


def tabulate_checks(data: ReportData) -> list[Grid | TextBlock]:
    """Tabulate the rules of the norm of a report for its motions; without one, say why not."""
    rule, checks = find_rule(data), check_motions(data)
    if rule is None or not checks:
        norm = data.case.report.get("norm")
        why = f"those of {norm} are unknown" if norm else "[report] names no norm"
        rules = "number of motions, mean spectrum, stationary part"
        return [TextBlock(f"Rules for motions ({rules}) were not checked, for {why}.")]
    rows = [(*check[:3], check.state) for check in checks]
    caption = f"Rules for motions. {rule.source}. Stationary part from memory".replace("; ", ". ")
    return [Grid(("rule", "required", "found", ""), rows, caption, "words")]


def note_checks(data: ReportData) -> list[str]:
    """Return a note on each rule of the norm that the motions do not meet."""
    found = [f"{x.rule}, {x.required}, is {x.found}" for x in find_missed(data)]
    norm = name_norm(find_rule(data))
    return [f"motions do not meet {norm} (from memory): {each}" for each in found]


def is_of_norm(data: ReportData, text: str) -> bool:
    """Return whether a text on a rating is of the norm of the report; of no code without one."""
    norm = data.case.report.get("norm", "").upper().replace(" ", "")
    if not norm:
        return not any(words in text for words in (" by Eurocodes", " by CS 454", "from memory"))
    return any(x in norm and re.search(words, text) for x, words in _NORMS_OF_RATINGS.items())


def note_rating(data: ReportData) -> list[str]:
    """Return a note where archfem has no rating by the norm of a report, and others stand."""
    norm = data.case.report.get("norm", "")
    of_norm = any(is_of_norm(data, row.demand) for row in data.statements["rating"].rows)
    words = f"archfem has no rating by {norm}: {'Eurocodes' if of_norm else 'others'} stand for it"
    return [words] * bool(norm and not re.search("EN ?199|EUROCODE|CS ?45|BD ?21", norm.upper()))
