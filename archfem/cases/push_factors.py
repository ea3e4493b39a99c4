"""Pushes as multiples of the acceleration of a site, by `[limit]` or the spectrum of a case."""

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from archfem.cases import defaults
from archfem.cases.case import Case
from archfem.errors import ArchfemError
from archfem.limit.collapse import Collapse, Outcome
from archfem.limit.fill_range import FillRange
from archfem.masonry.loads import Action, BodyForce
from archfem.units import STANDARD_GRAVITY, Ends


def site_acceleration(case: Case) -> float:
    """Return the ground acceleration of [limit] or the site's spectrum [g]; else NaN."""
    if case.limit.demand is not None:
        return case.limit.demand / STANDARD_GRAVITY
    return peak_of_spectrum(case)


def peak_of_spectrum(case: Case) -> float:
    """Return the acceleration of the site's spectrum at period zero [g]; NaN without one."""
    spectrum = case.assessment.spectrum or case.target
    return float(spectrum.horizontal(0.0)) if spectrum is not None else np.nan


class PushFactors(NamedTuple):
    """Factors on a load at which a mechanism forms [-], over what is assumed of a fill."""

    least: float
    most: float
    site: str = ""  # the site's acceleration, of which they are multiples, in words
    proved: float | None = None  # bound from below, where a search may have missed the least
    bounded: bool = False  # whether they are upper estimates, as `Collapse.bounded`

    @property
    def outcome(self) -> str:
        """Whether the site's acceleration is withstood as a push, in words."""
        if self.least < 1.0:
            only = "is withstood only by what is assumed of the fill"
            return only if self.most >= 1.0 else "is not withstood"
        unproved = self.bounded if self.proved is None else self.proved < 1.0
        return "is withstood by an upper estimate alone" if unproved else "is withstood"

    def __str__(self) -> str:
        """Return both factors in words, and the bound from below where the search has one."""
        text = f"{'≤ ' * self.bounded}{Ends((self.least, self.most)):.{3 if self.site else 4}g}"
        if self.proved is None:
            return text
        proved = f"proved ≥ {self.proved:.3g}" if self.proved else "no lower bound is known"
        return f"{text} ({proved})"


def compare_with_site(case: Case, *senses: Collapse | None) -> PushFactors | None:
    """Return the multiple of the site's ground acceleration at collapse; None if unknown.

    It is that of a push by the weight, the least of its senses under each assumption on a fill.
    """
    pushed = [x for x in senses if x and x.push and x.outcome is not Outcome.BRACKETED]
    if not (ends := [x for x in pushed if np.isfinite(x.range[0])]):
        return None
    over = [x.over_fill for x in ends if x.over_fill]
    low, high = FillRange.least_of(over).ends if over else np.min([x.range for x in ends], axis=0)
    unit = abs(ends[0].push)
    factors = compare_push(case, low * unit, high * unit, case.limit.dead)
    searched = [x.solutions for x in ends if x.solutions and x.solutions.may_be_less and not over]
    if factors and searched:  # the search may have missed a weaker solution
        proved = min(each.bracket[0] for each in searched) * factors.least / low
        factors = factors._replace(proved=max(proved, 0.0))
    # the least of the fills for which a state was found
    bounded = any(x.bounded or (x.over_fill and x.over_fill.unknown) for x in pushed)
    return factors and factors._replace(bounded=bounded)


def compare_with_motion(case: Case, found: Collapse) -> str:
    """Say how many times the peak of the case's motion a push is; "" where it has a demand.

    The peak of one motion is no demand of a site.
    """
    if case.motion and np.isnan(site_acceleration(case)):
        with suppress(ArchfemError):  # limit analysis needs no record
            motion = case.ground_motion()
            peak = replace(case, limit=replace(case.limit, demand=motion.pga))
            if factors := compare_with_site(peak, found):
                words = factors.site.replace("demand of", f"PGA of '{motion.name}',")
                return f"{factors} times {words}"
    return ""


def compare_push(case: Case, low: float, high: float, dead: Iterable[Action]) -> PushFactors | None:
    """Return how many times the site's ground acceleration two pushes are [g].

    With loads that stay, which may have the vertical part of the demand.
    """
    spectrum, ground = case.assessment.spectrum or case.target, site_acceleration(case)
    if np.isnan(ground):
        return None
    rock = getattr(spectrum, "ag", None)
    size = f"the site's {ground:.3g} g"
    if case.limit.demand is not None:
        size = f"the demand of {ground:.3g} g"
    elif rock is not None:
        open_values = defaults.describe_spectrum_defaults(case)
        soil = f" × S {ground / rock:.3g}"
        size = f"the site's {rock:.3g} g{soil * (soil != ' × S 1')}"
        size += f" ({open_values} by default)" * bool(open_values)
    motions = [case.motion] if case.motion else [*(case.suite or {"pairs": {}})["pairs"].values()]
    # a table of a spectrum alone may have no vertical
    rises = getattr(spectrum, "vertical_values", spectrum) is not None or any(
        "vertical" in x or x.get("synthetic", {"vertical_ratio": 0.0}).get("vertical_ratio", 1.0)
        for x in motions
    )
    if rises and not any(isinstance(load, BodyForce) and load.vertical for load in dead):
        size += "; vertical acceleration is left out"
    return PushFactors(low / ground, high / ground, size)
