"""Checks of a kinematic assessment: rules of codes, and capacity against demand."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from archfem._typing import Array
from archfem._validation import check_between, check_fields
from archfem.errors import InvalidInput, logger
from archfem.limit.fill_range import FillAssumption, FillRange
from archfem.masonry.block import Block
from archfem.masonry.loads import AttachedLoad
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure, list_stack
from archfem.models.model import Doubt
from archfem.motion.design_spectra import (
    DesignSpectrum,
    Eurocode8,
    Eurocode2024,
    FloorSpectrum,
    Ntc2018,
    TableSpectrum,
    damped_acceleration,
    registered_spectra,
)
from archfem.motion.motion import Motion
from archfem.motion.response_spectra import response_spectrum
from archfem.units import STANDARD_GRAVITY, format_ratio

# What a mechanism is compared with
Demand = DesignSpectrum | Motion

# Outcome of a check that passes with the weights of single blocks alone
BY_SPLIT = "passes or fails by the split of weights"

# Outcome of a check whose path ends early, and whose ratio is less than 1
NOT_SHOWN = "is not shown to pass"

# What the doubt of a check by the split of weights begins with
OF_SPLIT = "passes with weights at the centroids of blocks"

# Outcome of a check that passes with the e* of the mechanism found, and fails with e* = 1
BY_MECHANISM = "passes or fails by which mechanism moves at this alpha_0"

# Distance of an attached force, as at an anchor plate, from its block over the block's size [-]
MAX_OFFSET = 0.1

# Foot of a mechanism over the height of the building, from which a floor amplifies the ground [-]:
# at resonance 1.1 / √0.05 times 1.5 z / H, the most of equal storeys, is 1 at 0.136
HIGH_FOOT = 0.125

# Value of a doubt about ratios that are no less than the true one
UPPER_BOUND = "an upper bound"


@dataclass(frozen=True)
class LimitState:
    """Displacement check of a code: capacity, period and damping of the equivalent oscillator.

    The capacity is d_u* = share d₀*. Its period is T = period_factor π √(d_T FC / a*(d_T)) with
    d_T = secant_share d_u*, and the demand is the displacement spectrum up to T. The confidence
    factor FC divides the accelerations of the curve, as in C8.7.1.2.1.3 (from memory).

    Attributes:
        name: name of the code and limit state.
        share: capacity as a share of d₀* [-].
        period_factor: factor of the period, in multiples of π; 2 is the secant period [-].
        secant_share: displacement of the period as a share of d_u* [-].
        damping: ratio to the critical of the demand's spectrum [-].
        source: clause of the code, or another source.

    Raises:
        InvalidInput: a value is out of range.
    """

    name: str
    share: float
    period_factor: float
    secant_share: float
    damping: float
    source: str

    def __post_init__(self) -> None:
        """Check that shares are up to 1 and the damping is a ratio."""
        check_fields(self)
        limits = {"share": 1.0, "secant_share": 1.0, "period_factor": 10.0, "damping": 0.5}
        for key, most in limits.items():
            options: Any = {"ends": "(]", "remedy": "give a ratio, such as 0.4 for 40 %"}
            check_between(getattr(self, key), f"{self.name}, {key} [-]", 0.0, most, **options)

    def doubt(self, spectrum: Demand, structure: Structure, foot: float) -> list[Doubt]:
        """Return doubts about a spectrum of another code than NTC, and about heights.

        Args:
            spectrum: spectrum of the demand; a table and a motion are of no code, and of the foot
                of the structure.
            structure: structure of which a part moves.
            foot: height of the foot of what moves above the ground [m].
        """
        kinds = {type(spectrum), type(getattr(spectrum, "ground_spectrum", None))}
        codes = [name for name, kind in registered_spectra.items() if kind in kinds]
        found = []
        if self.name.startswith("NTC") and not {*codes} <= {"NTC-2018", "table", "floor"}:
            words = f"the check is one of NTC, which was not made for a spectrum of {codes[0]}"
            remedy = "give limit_state with the rules of its code, or a spectrum of NTC-2018"
            found.append(Doubt(words, remedy))
        stack = len(structure.free) == 1 or list_stack(structure)
        if isinstance(spectrum, FloorSpectrum) and spectrum.height and stack:
            words = "the height of its foot above the ground is not given, and taken as 0: what "
            words += "moves is shaken as at z = {:.3g} m, and higher up by more"
            remedy = "give `above`, the height of its foot, 0 on the ground"
            found += [Doubt(words, remedy, (foot,))] * (structure.above is None)
        if above := find_height_left_out(spectrum, structure, foot):
            words = "the spectrum is that of the ground, and {:.3g} m above it, at the foot of what"
            words += " moves, it is larger: each ratio is {}"
            remedy = 'give code = "floor" with height and storeys of the building'
            found.append(Doubt(words, remedy, (above, UPPER_BOUND)))
        return found

    def rate(
        self,
        spectrum: Demand,
        q: float,
        confidence: float,
        foot: float,
        moved: Array,
        curve: Array,
        free_period: float | None = None,
    ) -> tuple[float, float]:
        """Return the ratios of the linear check and by displacements of what stands at a height.

        Args:
            spectrum: spectrum of the demand.
            q: behaviour factor [-].
            confidence: FC [-].
            foot: height above the ground [m].
            moved: spectral displacements (n,) [m].
            curve: accelerations there (n,) [m/s²].
            free_period: T_0 of what vibrates freely [s]; None of what is held until it moves.
        """
        own = place_spectrum(spectrum, foot)
        linear = q * float(curve[0]) / confidence / first_acceleration(own, free_period)
        return linear, self.check(own, confidence, moved, curve, free_period).ratio

    def check(
        self,
        spectrum: Demand,
        confidence: float,
        moved: Array,
        curve: Array,
        free_period: float | None = None,
    ) -> "AssessmentCheck":
        """Check the displacement of a capacity curve against a spectrum.

        Args:
            spectrum: spectrum of the demand.
            confidence: FC, which reduces the accelerations [-].
            moved: spectral displacements (n,) [m].
            curve: accelerations there (n,) [m/s²].
            free_period: T_0 of what vibrates freely [s]; None of what is held until it moves.
        """
        capacity = self.share * float(moved[-1])
        secant = secant_period(moved, curve, self.secant_share * capacity)
        period = float(self.period_factor / 2.0 * np.sqrt(confidence) * secant)
        # The largest spectral displacement up to the period, with that at the points of a table.
        periods = period * np.linspace(0.0, 1.0, 401)[1:]
        points = getattr(getattr(spectrum, "ground_spectrum", spectrum), "periods", periods)
        periods = np.union1d(periods, points[points <= period])
        acceleration = spectral_acceleration(spectrum, periods, self.damping)
        demand = float((acceleration * (periods / (2.0 * np.pi)) ** 2).max())
        # nor does it fail where the ground does not set it in motion
        begins = float(curve[0]) / confidence / first_acceleration(spectrum, free_period)
        ratio = max(capacity / demand, begins)
        given = capacity, demand, "m", ratio, period, self.source
        return AssessmentCheck(self.name, *given)


# Sources of displacement checks; the 2019 values were read in a transcription of the Circolare.
_CIRCOLARE_2009 = "Circolare 617/2009, C8A.4.2.2 and C8A.4.2.3, from memory: its text was not read"
_CIRCOLARE_2019 = "Circolare 7/2019, C8.7.1.2.1.6 and C8.7.1.2.1.8, eq."

# Displacement checks by name
LIMIT_STATES: Mapping[str, LimitState] = {
    name: LimitState(name, *values)
    for name, values in {
        "NTC-2018 SLV": (0.4, 1.68, 1.0, 0.08, f"{_CIRCOLARE_2019} C8.7.1.10"),
        "NTC-2018 SLC": (0.6, 1.56, 1.0, 0.10, f"{_CIRCOLARE_2019} C8.7.1.11"),
        "NTC-2008 SLV": (0.4, 2.0, 0.4, 0.05, _CIRCOLARE_2009),
    }.items()
}


@dataclass(frozen=True)
class AssessmentCheck:
    """One check: capacity against demand.

    Attributes:
        name: name of the check.
        capacity: acceleration [m/s²] or displacement [m] that is allowed.
        demand: demand of the spectrum, in the same unit.
        unit: "m/s²" or "m".
        ratio: factor on the spectrum at which the check is just passed [-].
        period: period of the equivalent oscillator [s]; undefined (NaN) where accelerations are
            checked.
        source: clause of the code.
        over_fill: decisive ratios over all assumptions on a fill; None without one.
        bodies: ratio with one weight for each body that moves as one, at its centroid, and one for
            each load; None where each body has one anyhow.
        bounded: whether the ratio is an upper bound, by which a check fails and does not pass.
        floor: least ratio of all mechanisms of this α₀, that of e* = 1; None where it is the first.
        amplified: amplification and a_Z of a floor spectrum at rest, in brackets; "" of others.
        at_least: whether the ratio is a lower bound, by which a check passes and does not fail: the
            path ends before α vanishes, and its end counts as d₀*.
        untied: ratio without the ties, by which it passes where with them it is not shown to; None
            of others. It is no bound of that with ties: what holds late may lengthen T more than d.
    """

    name: str
    capacity: float
    demand: float
    unit: str
    ratio: float
    period: float
    source: str
    over_fill: FillRange | None = None
    bodies: float | None = None
    bounded: bool = False
    floor: float | None = None
    amplified: str = ""
    at_least: bool = False
    untied: float | None = None

    @property
    def unshown(self) -> bool:
        """Whether it neither passes nor fails, as its ratio is a lower bound and less than 1."""
        return self.at_least and self.decisive < 1.0

    @property
    def passes(self) -> bool:
        """Whether it is withstood under every assumption on a fill, by any split, with e* = 1.

        An upper bound does not show it.
        """
        return self.outcome == "passes" and not self.bounded

    @property
    def outcome(self) -> str:
        """Whether it "passes" or "fails", or that fill, split or mechanism decide, or none does."""
        if self.over_fill is not None and self.over_fill.needed:
            return self.over_fill.outcome
        if self.unshown:
            return NOT_SHOWN
        found = "passes" if self.ratio >= 1.0 else "fails"
        for least, doubtful in ((self.bodies, BY_SPLIT), (self.floor, BY_MECHANISM)):
            if found == "passes" and least is not None and least < 1.0:
                return doubtful
        return found

    @property
    def words(self) -> str:
        """The outcome in words, with an upper bound by which alone it passes, and without ties."""
        alone = f" by {UPPER_BOUND} alone" * (self.outcome == "passes") * self.bounded
        untied = self.untied and f" (without ties it passes: {format_ratio(self.untied)})"
        return f"{self.outcome}{alone}{untied or ''}"

    def doubt_split(self) -> list[Doubt]:
        """Return the doubt of a check that passes with the weights of single blocks alone."""
        if self.outcome != BY_SPLIT:
            return []
        words = f"{{}} {OF_SPLIT}, and with one weight for each body that moves as one it fails: "
        words += "{:.3g}"
        remedy = "bonded or tall courses move as one body: take this ratio"
        return [Doubt(words, remedy, (self.name, self.bodies))]

    def doubt_end(self, remedy: str) -> list[Doubt]:
        """Return the doubt of a check that is neither passed nor failed by the end of a path."""
        words = (
            "the ratio by {} is a lower bound, as its capacity, {:.4g} m, is a share of d* at the "
        )
        words += "end of the path, as d_0*: neither that it passes nor that it fails is shown"
        return [Doubt(words, remedy, (self.name, self.capacity))] * self.unshown

    @property
    def ratios(self) -> str:
        """The ratio as text, or its decisive range over a fill, or from e* = 1 on."""
        at_least = "at least " * self.unshown
        floor = "e* = 1, whatever moves at this alpha_0"
        if self.over_fill is not None:
            of = floor if self.floor is not None else "one weight a body" * bool(self.bodies)
            return at_least + self.over_fill.format_ends(digits=3) + f" ({of})" * bool(of)
        own = at_least + format_ratio(self.ratio)
        if at_least and self.bodies is not None:
            splits = (self.ratio, "the weights apart"), (self.bodies, "one weight a body")
            least, (most, of) = sorted(splits)  # the deciding one first
            own = f"{at_least}{format_ratio(least[0])} ({format_ratio(most)} with {of})"
        return own if self.floor is None else f"{format_ratio(self.floor)} ({floor}) to {own}"

    @property
    def assumed(self) -> float:
        """The least ratio by either split of weights, or with e* = 1, with its own fill [-]."""
        return min(x for x in (self.ratio, self.bodies, self.floor) if x is not None)

    @property
    def decisive(self) -> float:
        """The same, the least over what is assumed of a fill [-]."""
        return self.assumed if self.over_fill is None else self.over_fill.ends[0]

    @property
    def moved(self) -> float:
        """Ratio of capacity and demand, which counts once the mechanism is in motion [-]."""
        return self.capacity / self.demand

    @property
    def at_rest(self) -> bool:
        """Whether the ratio is that up to which the mechanism is not set in motion."""
        return self.ratio > (1.0 + 1e-9) * self.moved  # but for round-off

    def __str__(self) -> str:
        """Describe capacity, demand and outcome in one line."""
        period = "" if np.isnan(self.period) else f" at T = {self.period:.3f} s"
        rest = " before the mechanism begins to move"
        return (
            f"{self.name}: capacity {self.capacity:.4g} {self.unit}, demand {self.demand:.4g} "
            f"{self.unit}{self.amplified}{period}: {self.words}, the spectrum may be "
            f"{self.ratios} times as strong{rest if self.at_rest else ''}"
        )


def list_lower(
    checks: Sequence[AssessmentCheck], others: Sequence[AssessmentCheck]
) -> list[AssessmentCheck]:
    """List the checks with a lower ratio than the same, or the only, one of another mechanism."""
    pairs = zip(checks, [*others, others[-1]], strict=False)
    return [x for x, other in pairs if x.decisive < 0.999 * other.decisive]


def describe_difference(
    displaced: tuple[float, float], linear: tuple[float, float] = (np.inf, np.inf)
) -> str:
    """Say by which of displacements and linear check it passes; "" where their outcomes are alike.

    Args:
        displaced: least ratio of the checks by which it passes, and with the weights of blocks
            apart [-].
        linear: the same of all linear checks, infinite without one.
    """
    outcomes = [_say_passing(*ratios) for ratios in (displaced, linear)]
    if len({*outcomes}) == 1 or np.isinf(linear[0]):
        return ""
    return (
        f"{outcomes[0]} by displacements ({format_ratio(displaced[0])}), {outcomes[1]} by the "
        f"linear check ({format_ratio(linear[0])}); no clause that was read says which governs"
    )


def _say_passing(decisive: float, apart: float) -> str:
    """Say whether it passes by a ratio, also if weights of blocks are apart."""
    if decisive >= 1.0:
        return "passes"
    return "fails" if apart < 1.0 else "passes or fails, by the split of weights,"


def place_spectrum(spectrum: Demand, foot: float) -> Demand:
    """Return the spectrum of what stands at a height above the ground [m]."""
    return spectrum.at(foot) if isinstance(spectrum, FloorSpectrum) else spectrum


def describe_floor(spectrum: Demand) -> str:
    """Describe how a floor amplifies the ground, in brackets; "" where it does not."""
    if not isinstance(spectrum, FloorSpectrum) or not spectrum.amplification:
        return ""
    return f" ({spectrum.describe()})"


def judge_floor(
    spectrum: Demand,
    foot: float,
    free_period: float | None,
    checks: Sequence["AssessmentCheck"],
    shared: bool = False,
) -> tuple[list[str], list[Doubt]]:
    """Return notes on the spectrum where a floor shakes a foot, and doubts of checks that pass.

    The linear check is of what does not vibrate by itself: by T_0 those in doubt may fail. So may
    those with a T_0 of 0 that is shared, given for the whole too, which cross walls hold.
    """
    if not isinstance(spectrum, FloorSpectrum) or not (floor := spectrum.at(foot)).amplification:
        return [], []
    height = spectrum.height or np.inf
    words = f"its foot, z = {foot:.4g} m, is above H = {height:.4g} m of the spectrum: z = H is "
    notes = [f"{words}taken, where the first mode of eq. C7.2.10 is 1"] * (foot > height + 1e-6)
    given = free_period is not None
    if given:
        notes.append(f"free_period = {free_period:g} s is T_0 of what moves above z = {foot:.4g} m")
        if free_period or not shared:
            return notes, []
    values = spectral_acceleration(floor, floor.own_period * np.linspace(0.0, 1.0, 21), 0.05)
    times = float(values.max() / values[0])
    taken = (
        "the linear check takes a_Z, that of what cross walls hold until it moves; of what "
        "vibrates freely, as a parapet or a gable above its eaves, eq. C8.7.1.9 takes the spectrum "
        f"at its own period T_0, up to {times:.3g} times as much"
    )
    notes += [taken] * (not given)
    # what passes once it moves does not depend on when it begins to
    least = [(x, max(x.decisive / times, x.moved * (x.unit == "m"))) for x in checks]
    words = "{} passes with a_Z, and of what vibrates freely its ratio may be {:.3g}, by T_0"
    remedy = "give free_period, its T_0, or 0 if cross walls hold it until it moves"
    remedy = "assess it alone, with its own free_period" if given else remedy
    turn = [Doubt(words, remedy, (x.name, low)) for x, low in least if x.decisive >= 1.0 > low]
    return notes, turn


def spectral_acceleration(spectrum: Demand, periods: Array, damping: float) -> Array:
    """Return the horizontal pseudo-acceleration spectrum at a damping (n,) [m/s²]."""
    if isinstance(spectrum, Motion):
        return response_spectrum(spectrum, periods, damping)
    # the spectral displacement is held beyond the longest period of European codes
    ground = getattr(spectrum, "ground_spectrum", spectrum)
    longest = 4.0 if isinstance(ground, Eurocode8 | Ntc2018 | Eurocode2024) else np.inf
    held = np.minimum(periods, longest)
    beyond = np.where(periods > longest, longest / np.maximum(periods, 1e-9), 1.0)
    own = damped_acceleration(spectrum, held, damping)
    return np.asarray(STANDARD_GRAVITY * own * beyond**2)


def first_acceleration(spectrum: Demand, free_period: float | None) -> float:
    """Return what sets a mechanism in motion: the ground's, or the spectrum's at T_0 [m/s²]."""
    period = check_between(free_period or 0.0, "free_period [s]", 0.0, 4.0, ends="[]")
    return float(spectral_acceleration(spectrum, np.array([period]), 0.05)[0])


def secant_period(moved: Array, curve: Array, displacement: float) -> float:
    """Return the secant period of a capacity curve at a displacement [s]."""
    acceleration = float(np.interp(displacement, np.maximum.accumulate(moved), curve))
    return float(2.0 * np.pi * np.sqrt(displacement / acceleration)) if acceleration else np.inf


def check_assessable(
    structure: Structure, friction: str | None, loads: Sequence[AttachedLoad]
) -> None:
    """Refuse structures and options that the method does not cover."""
    if friction not in ("coulomb", "nonassociated", None):
        raise InvalidInput(
            f"friction {friction!r} is not known: use 'coulomb', 'nonassociated' or None"
        )
    if friction == "nonassociated" and (loads or find_yielding_blocks(structure)):
        raise InvalidInput(
            "friction 'nonassociated' is not searched with attached loads or a fill: use 'coulomb'"
        )
    soft = [structure.blocks[number].name for number in find_yielding_blocks(structure)]
    for load in loads:
        block = structure.blocks[structure.block_number(load.block)]
        if block.name in soft:
            raise InvalidInput(
                f"a load is attached to '{block.name}', which is fill and no stone: stand it on "
                "the fill, [structure.standing] of a case, or name the stone below"
            )
        _check_place(load, load.point, block, structure)
        if load.anchor is not None and load.anchor_point is not None:
            anchor = structure.blocks[structure.block_number(load.anchor)]
            _check_place(load, load.anchor_point, anchor, structure)
    if (structure.tension > 0.0).any():
        raise InvalidInput(
            "joints have tensile strength, which breaks before a mechanism forms: give contacts "
            "with tension 0"
        )
    cohesion = max(joint.contact.cohesion for joint in structure.joints)
    if friction is not None and cohesion > 0.0:
        logger.warning(
            "joints have a cohesion of %.3g Pa, which the assessment leaves out: its factor is on "
            "the safe side, and joints slide that might hold; collapse_factor counts cohesion",
            cohesion,
        )


def _check_place(
    load: AttachedLoad, point: tuple[float, float], block: Block, structure: Structure
) -> None:
    """Refuse a load that acts away from its block, as at a mistyped height.

    Masses may have their centre off the block that carries them, but a structure carries none that
    is further away than its stones reach.
    """
    kind, near, of = "force", MAX_OFFSET * measure_blocks(block), "an anchor"
    if not any(load.force):
        stones = [structure.blocks[number] for number in structure.free]
        kind, near, of = "mass", measure_blocks(*stones), "all stones together"
    if (away := block.distance_to(point)) > near:
        (left, low), (right, high) = block.points.min(axis=0), block.points.max(axis=0)
        raise InvalidInput(
            f"an attached {kind} acts at {point} m, {away:.3g} m from '{block.name}' (x from "
            f"{left:.4g} to {right:.4g} m, y from {low:.4g} to {high:.4g} m), above the "
            f"{near:.3g} m of {of}: correct its point, or name the block there"
        )


def find_height_left_out(spectrum: Demand, structure: Structure, foot: float) -> float:
    """Return how high a foot is above the ground of a spectrum [m], 0 where that matters little."""
    base, tall = structure.above or 0.0, float(np.ptp(structure.ends[..., 1]))
    is_of_foot = isinstance(spectrum, TableSpectrum | Motion)
    above = 0.0 if isinstance(spectrum, FloorSpectrum) else foot - base * is_of_foot
    return above * (above > HIGH_FOOT * (base + tall))


def measure_blocks(*blocks: Block) -> float:
    """Return the length or height of blocks together, if this is larger [m]."""
    return float(np.ptp(np.concatenate([block.points for block in blocks]), axis=0).max())


def doubt_assumed(decided: str, *, decide: bool) -> list[Doubt]:
    """Return the doubt of what is decided by what is assumed of a fill."""
    words = f"what is assumed of the fill decides whether {decided}"
    return [Doubt(words, "measure it, or run motions on fill in pieces")] if decide else []


def add_fill_ranges(found: Any, others: Mapping[FillAssumption, Any]) -> Any:
    """Return a `KinematicAssessment` with ratios and doubt by assumption on a fill, and the least.

    Args:
        found: assessment under the assumption that is given.
        others: assessments by assumption; None does not stand.
    """
    ranges = {}
    for name in ("linear", "displacement"):
        # what has no motion withstands any spectrum
        ratios = {
            key: 0.0 if other is None else getattr(getattr(other, name), "assumed", np.inf)
            for key, other in others.items()
        }
        if ratios and getattr(found, name) is not None:
            ranges[name] = FillRange(ratios)
    if not ranges:
        return found
    unsure = doubt_assumed("it passes", decide=any(each.needed for each in ranges.values()))
    found = replace(found, doubts=(*found.doubts, *unsure))
    values = [*ranges.values()][-1].values
    least = others[min(values, key=values.__getitem__)] or found
    # a lower bound of one is none of all
    cut = all(getattr(other and other.displacement, "at_least", False) for other in others.values())
    changed = [
        {
            k: replace(check, over_fill=ranges[k], at_least=check.at_least and cut)
            for k in ranges
            if (check := getattr(each, k))
        }
        for each in (found, least)
    ]
    return replace(found, **changed[0], least=replace(least, **changed[1]))
