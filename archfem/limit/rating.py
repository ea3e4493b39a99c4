"""Rating of bridges for vehicles of codes: partial factors, widths, geometric factor of safety."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from archfem._display import ResultDisplay
from archfem._typing import Array, Metres, NewtonsPerMetre, Pascals
from archfem._validation import validate_arguments
from archfem.errors import InvalidInput
from archfem.limit.collapse import describe_crushing, describe_fill
from archfem.limit.collapse_warnings import describe_closing
from archfem.limit.fill_range import say_part
from archfem.limit.fill_strength import Fill, PlasticFill, as_pressure, has_backing, place_backing
from archfem.limit.self_weight import check_options, say_strength
from archfem.limit.thickness import find_geometric_factors
from archfem.limit.vehicles import (
    BY_CS454,
    DRIVING_DIRECTIONS,
    MovingLoad,
    Vehicle,
    axles_on_rings,
    check_area_load,
    check_factor,
    find_vehicle,
    lay_parapets,
    moving_load,
    name_missing,
    places_at_ends,
    vehicle_positions,
)
from archfem.limit.worst_places import (
    ASSUMED_STRENGTH,
    CRUSHING_PREFIX,
    find_least_factors,
    further_searches,
    refine_worst_places,
    scale_weights,
    spread_over_bridge,
)
from archfem.masonry.loads import PointLoad
from archfem.masonry.standing import describe_axles, parse_axles
from archfem.masonry.structure import (
    HasStructure,
    Structure,
    describe_spans,
    find_clear_spans,
    join_names,
    join_words,
    structure_of,
)
from archfem.units import Ends, MPa, kN

# Factors of a rating that its outcome is made of, in other states of fill and stones
_BARE = ("without_backing", "without_either", "active_without_backing")
_STATES = ("without_pressure", "full_pressure", *_BARE, "active_alone", "by_pressure")
# States without pressure, which may bear more than those with the active one alone
_ACTIVE = {"without_pressure": "active_alone", "without_either": "active_without_backing"}

# What a rating assumes of fill and stones
_PRESSURE, _BACKING = "the pressure of the fill", "the backing"
_PASSIVE = "the passive pressure of the fill"
_HARD_STONES = "stones that do not crush"


@dataclass(frozen=True, eq=False, repr=False)
class Rating(ResultDisplay):
    """Rating of a bridge for a vehicle.

    Attributes:
        structure: the bridge, with its characteristic weights.
        vehicle: axles, spacings and sources.
        live: partial factor on the vehicle's weight [-].
        impact: dynamic factor on the vehicle's weight [-].
        dead: partial factor on the weights of stones and fill [-].
        width: width of the bridge over which one vehicle spreads [m].
        area_load: distributed load of the code, where it is adverse, without factors [Pa].
        moving: factors at all places in both directions, on the factored vehicle over factored
            weights, and the collapse at the worst place.
        geometric: geometric factor of safety at the worst place, with the fill as given [-]: depth
            of the joints over the least share of it, about their middles, that carries the factored
            vehicle; below 1 where only deeper joints would. Undefined (NaN) where joints of any
            depth do not carry it, infinite where hinges alone do. Not searched, and NaN, with a
            plastic fill.
        by_rule: factor at the worst place, with the fill as given, over the width by rule and with
            all of the code's distributed load, where others were given; else NaN.
        strength: compressive strength of the stones at the joints [Pa]; infinite where it does not
            count.
        without_pressure: least factor with no pressure of a `Fill`, at a place of its own; NaN
            without a fill, and where the bridge then does not stand.
        full_pressure: least factor with all of its passive pressure; else NaN.
        deepest: factor at the worst place with joints of any depth, where it is below 1 as they
            slide; else NaN. It differs from stone to stone.
        without_backing: least factor without the backing of a `Fill`; NaN without one, and where
            the bridge then does not stand.
        without_either: least factor without backing and without pressure; NaN likewise.
        active_alone: least factor with the active pressure of a `Fill` alone; NaN likewise.
        active_without_backing: the same without its backing; NaN likewise.
        crushing: least factors with stones of `ASSUMED_STRENGTH`, where no strength was given:
            "factor", of a plastic fill as weight and pressure, and those of other states by their
            names above; else none.
        by_pressure: least factor with a plastic fill as weight and pressure (`Fill`) of its
            strength, which the four states above have then too; else NaN.
        by_cs454: least factors of a vehicle of one's own with those of CS 454 [-], 1.9 and 1.8 on
            the worst axle: "factor", "crushing" and those of other states by their names above;
            else none, with a plastic fill, and of one axle alone, whose factors are multiples.
        fill: strength of the fill, or None.
        missing: "live" and "impact" where neither the vehicle nor its user gave them.
        parapets: weight of the parapets along the bridge, without factor [N/m].
        friction: as given to `rate`.
        geometric_hard: `geometric` of stones that do not crush [-].
        places: driving direction and x of the vehicle's middle [m] at the worst place of each least
            factor, by the names above, of those of `crushing` behind "crushing "; of the factor
            itself in `moving` alone.
    """

    structure: Structure
    vehicle: Vehicle
    live: float
    impact: float
    dead: float
    width: float
    area_load: float
    moving: MovingLoad
    geometric: float
    by_rule: float
    strength: float = np.inf
    without_pressure: float = np.nan
    full_pressure: float = np.nan
    deepest: float = np.nan
    without_backing: float = np.nan
    without_either: float = np.nan
    crushing: Mapping[str, float] = field(default_factory=dict)
    by_pressure: float = np.nan
    by_cs454: Mapping[str, Any] = field(default_factory=dict)
    fill: Fill | PlasticFill | None = None
    missing: Sequence[str] = ()
    parapets: float = 0.0
    friction: str | None = "coulomb"
    geometric_hard: float = np.nan
    places: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    active_alone: float = np.nan
    active_without_backing: float = np.nan

    @property
    def factor(self) -> float:
        """Rating factor: multiple of the factored vehicle at collapse [-]."""
        return self.moving.worst.factor

    @property
    def factors(self) -> dict[str, float]:
        """Least factors by state of the fill, and the geometric one, by the names above [-]."""
        names = ["factor", *["by_pressure"] * isinstance(self.fill, PlasticFill)]
        names += [*_STATES[:2], *(_BARE if has_backing(self.fill) else ()), "active_alone"]
        return {name: float(getattr(self, name)) for name in [*names, "geometric"]}

    @property
    def is_width_by_rule(self) -> bool:
        """Whether one vehicle spreads over the width by rule."""
        return bool(np.isclose(self.width, self.vehicle.spread_over(self.structure)))

    @property
    def passes(self) -> bool:
        """Whether the bridge carries the factored vehicle everywhere; no if it falls unloaded."""
        return bool(self.factor >= 1.0)

    @property
    def outcome(self) -> str:
        """Whether it passes, on which condition, and the factor by rule where less was given."""
        return "; ".join(self.clauses)

    @property
    def clauses(self) -> list[str]:
        """Clauses of the outcome: on which condition it passes, range, what is left out, rule."""
        words, codes = self._verdict, f"the code's {' × '.join(self.missing)}"
        if np.isnan(self.factor):
            return [words]
        if self.missing:
            most = f" if {codes} is at most {self.factor:.4g}"
            parts = (each for each in self.list_losses() if "pressure of the fill" in each[1])
            most += "".join(f", {of} {x:.4g}" for x, of in parts)
            words += most if self.passes else f" even without {codes}"
        left = f"left out: {self.vehicle.left_out}" if self.vehicle.left_out else ""
        return [*filter(None, [words, self.say_range(), left, self._rule_text()])]

    @property
    def label(self) -> str:
        """Name of the vehicle, and which factors of a code it has not."""
        return self.vehicle.name + name_missing(self.missing)

    @property
    def short_outcome(self) -> str:
        """Whether it passes, with which parts of a bridge alone, and which factors are missing."""
        return self._verdict + name_missing(self.missing)

    @property
    def _verdict(self) -> str:
        """Whether it passes, and with which parts of a bridge alone."""
        if np.isnan(self.factor):
            return "does not stand under its own weight"
        only = f" only with {self.needed}" * bool(self.passes and self.needed)
        return f"passes{only}" if self.passes else "fails"

    @property
    def headline(self) -> str:
        """Factor, place and outcome; no factor where the bridge does not stand."""
        if np.isnan(self.factor):
            return f"{self.outcome}, {self.place}"
        return f"{self.said_factor} {self.place}, {self.outcome}"

    @property
    def said_factor(self) -> str:
        """The factor, without crushing where no strength counts, in words."""
        return f"factor {self.factor:.4g}{' without crushing' * bool(self.crushing)}"

    @property
    def _as_given(self) -> str:
        """Of which state of the fill a number alone is, in words."""
        return ", with the fill as given" if self.fill is not None else ""

    def _list_states(self) -> dict[tuple[str, ...], str]:
        """Return the name of the state without each set of the assumed parts of fill and stones."""
        names: dict[tuple[str, ...], str] = {(): "factor"}
        if self.fill is not None:
            names[_PRESSURE,] = "without_pressure"
        if has_backing(self.fill):
            names |= {(_BACKING,): "without_backing", (_PRESSURE, _BACKING): "without_either"}
        hard = {(*x, _HARD_STONES): f"{CRUSHING_PREFIX}{key}" for x, key in names.items()}
        own = "by_pressure" if isinstance(self.fill, PlasticFill) else "factor"
        return {**names, (): own, **(hard if self.crushing else {})}

    def _list_alike(self, state: str) -> list[str]:
        """Return a state, and if it is without pressure that with the active one alone."""
        name = state.removeprefix(CRUSHING_PREFIX)
        return [state, *(f"{state.removesuffix(x)}{_ACTIVE[x]}" for x in {name} & {*_ACTIVE})]

    def _factor_in(self, state: str) -> float:
        """Return the least factor in a state; NaN where the bridge then does not stand [-]."""
        crushing = self.crushing.get(state.removeprefix(CRUSHING_PREFIX), np.nan)
        return float(crushing if state.startswith(CRUSHING_PREFIX) else getattr(self, state))

    def _say_factor(self, state: str) -> str:
        """Return the least factor in a state, and where axles then stand over the rings."""
        if np.isnan(factor := self._factor_in(state)):
            return "the bridge does not stand"
        axles = parse_axles(self.vehicle.axles, self.vehicle.spacings)
        own = {"factor": (self.moving.direction, self.moving.position)}
        place = {**own, **self.places}.get(state)
        at = axles_on_rings(self.structure, axles, *place, self.fill) if place else []
        where = f" ({'axles' if len(at) > 1 else 'axle'} at x = {_name_places(at)} m)" * bool(at)
        return f"{factor:.4g}{where}"

    @property
    def needed(self) -> str:
        """Parts of fill and stones without which alone what passes would fail, in words, or ""."""
        if isinstance(self.fill, PlasticFill) and not self.by_pressure >= 1.0:
            return "the fill as a plastic body"
        cuts, states = dict[tuple[str, ...], bool](), self._list_states()
        for parts in sorted(states, key=len):
            fails = [not self._factor_in(x) >= 1.0 for x in self._list_alike(states[parts])]
            if any(fails) and not any({*cut} <= {*parts} for cut in cuts):
                cuts[parts] = fails[0]
        # what passes without any pressure needs more than the active one
        named = [[x if bare or x != _PRESSURE else _PASSIVE for x in c] for c, bare in cuts.items()]
        single = [cut[0] for cut in named if len(cut) == 1]
        several = [" or ".join(cut) for cut in named if len(cut) > 1]
        return ", and ".join(filter(None, [" and ".join(single), *several]))

    @property
    def _ends(self) -> list[float]:
        """Factors over all that is assumed of fill and stones, or this one [-]."""
        full = [] if np.isnan(self.full_pressure) else [self.full_pressure]
        states = self._list_states().values() if full or self.crushing else ()
        alike = [x for each in states for x in self._list_alike(each)]
        return [self.factor, *map(self._factor_in, alike), *full]

    @property
    def least(self) -> float:
        """Least factor over what is assumed, 0 where the bridge does not stand [-]."""
        return float(np.nan_to_num(self._ends, posinf=np.inf).min())

    def list_losses(self) -> list[tuple[float, str]]:
        """Return the least factor as what is assumed falls away, part by part, and the parts.

        It is 0 where the bridge then does not stand [-].
        """
        each = ((self._factor_in(state), words) for state, words in self._list_cut_states())
        return [(float(np.nan_to_num(x, posinf=np.inf)), words) for x, words in each]

    def say_losses(self) -> list[str]:
        """Return `list_losses` in words, each with the worst place of its own."""
        return [f"{self._say_factor(state)} {words}" for state, words in self._list_cut_states()]

    def _list_cut_states(self) -> Iterator[tuple[str, str]]:
        """Yield the states in which what is assumed falls away, part by part, and the parts."""
        states, parts, before = self._list_states(), tuple[str, ...](), ""
        if isinstance(self.fill, PlasticFill):
            yield "by_pressure", "with the fill as weight and pressure"
        also = "also " * (self.fill is not None)
        for part, words in (
            (_PRESSURE, "without the pressure of the fill"),
            (_BACKING, "without the backing"),
            (_HARD_STONES, f"if stones {also}crush at {ASSUMED_STRENGTH / MPa:g} MPa"),
        ):
            if (*parts, part) in states:
                parts = *parts, part
                alike = self._list_alike(states[parts])
                state = min(alike, key=lambda x: np.nan_to_num(self._factor_in(x), posinf=np.inf))
                # of the pressure it is said where it is another one than before
                of = f"with the active {_PRESSURE[4:]} alone" if state in alike[1:] else ""
                if part == _PRESSURE:
                    words = of or words
                elif of != before:
                    words += f" and {of or 'without the pressure of the fill'}"
                before = of
                yield state, words

    def say_range(self) -> str:
        """Return the least and the greatest factor over all that is assumed, in words."""
        subjects = [*["the fill"] * (self.fill is not None), *["the stones"] * bool(self.crushing)]
        words = f"the factor is {_say_ends(self._ends)} over what is assumed of "
        return (words + join_words(subjects)) * (len(self._ends) > 1)

    def _rule_text(self) -> str:
        """Return the factor with the width by rule and the code's whole load, if it is known."""
        if np.isnan(self.by_rule):
            return ""
        rule, code = self.vehicle.spread_over(self.structure), self.vehicle.area_load
        load = f" and {code / 1e3:g} kN/m² beside the axles" if code else ""
        width = f"over {rule:.3g} m of width{load}, by rule"
        return f"{width}, {self.by_rule:.4g} at this place{self._as_given}"

    def table(self) -> str:
        """Return factors [-], axles and loaded road [m] where loads count, as rows of CSV."""
        head = "direction,position of the vehicle's middle [m],factor [-],axles [-]"
        head = f"{head},road under the distributed load [m]"
        every = self.moving.factors.to_dataframe(["direction", "position"]).reset_index()
        rows = every[np.isfinite(every["factor"])]
        rows = rows.assign(loaded=rows["loaded"].map("{:.4g}".format))
        look = {"index": False, "header": False, "float_format": "%.6g", "lineterminator": "\n"}
        return f"{head}\n{rows.to_csv(**look)}".rstrip()

    def _summary(self) -> str:
        """Describe the result in one line."""
        vehicle = "" if np.isnan(self.factor) else f" for {self.vehicle.name}"
        return f"Rating of '{self.structure.name}'{vehicle}: {self.headline}"

    @property
    def place(self) -> str:
        """Where the axles over the rings that fail stand at the worst place, in words."""
        if np.isnan(self.factor):
            return "and carries no vehicle"
        axles = parse_axles(self.vehicle.axles, self.vehicle.spacings)
        place = self.moving.direction, self.moving.position
        stand = axles_on_rings(self.structure, axles, *place, self.fill)
        worst, joints = self.moving.worst, self.structure.joints
        spans, moves = find_clear_spans(self.structure), {joints[k].part for k, _ in worst.hinges}
        moves |= {joints[number].part for number in worst.sliding}
        over: dict[str, list[float]] = {}
        for x in stand if len(spans) > 1 else []:
            # the ring below the axle, or the nearest one
            part = min(spans, key=lambda name: max(spans[name][0] - x, x - spans[name][1]))
            if part in moves:
                over.setdefault(f"'{part}'", []).append(x)
        stand = [x for here in over.values() for x in here] or stand
        if not (spans and stand):
            return f"at x = {self.moving.position:.3g} m (the vehicle's middle)"
        others = _name_places(self._axles_at.keys() - {*stand})
        only = [name.strip("'") for name in over] if over else list(spans)
        apart = _name_places([x - spans[only[0]][0] for x in stand])
        clear = f", {apart} m from the left clear springing" if len(only) == 1 else ""
        count = f"{len(stand)} axle{'s'[: len(stand) - 1]}"
        count += f" of {len(axles)}" if len(axles) > len(stand) else ""
        loads = [f"{self._axles_at[x] / kN:.4g}" for x in sorted(stand)]
        count += f" ({join_words(loads)} kN)" * (len({*loads}) > 1 and len(loads) < 5)
        beside = over and not all(any(a <= x <= b for a, b in spans.values()) for x in stand)
        name = f" over {'or beside ' if beside else ''}{join_names(list(over))}" if over else ""
        others = f" (the other{'s'[: len(axles) - len(stand) - 1]} at {others} m)" if others else ""
        return f"with {count}{name} at x = {_name_places(stand)} m{clear}{others}"

    def __str__(self) -> str:
        """Describe outcome, worst places, mechanism, factors and sources, a line each."""
        vehicle = self.vehicle
        own = vehicle.source == vehicle.grade  # "given"
        source = vehicle.source if own else f"{vehicle.source} ({vehicle.grade})"
        factors = self.moving.factors["factor"].min("position")
        least = (f"{way} {float(factors.sel(direction=way)):.4g}" for way in DRIVING_DIRECTIONS)
        hard, geometric = (self._geometric_text(x) for x in (self.geometric_hard, self.geometric))
        crushing = say_strength(self.structure, self.strength, hard)
        also = " and on the distributed load × live" * bool(self.area_load)
        beside = f", and {self.area_load / 1e3:g} kN/m² of road where it is adverse" * bool(also)
        favourable = "EN 1990:2002, Table A2.4(B), favourable; from memory"
        of_fill = filter(None, [describe_fill(self.fill, self.structure)])
        resistance = [self._describe_crushing(), *of_fill]
        if np.isnan(self.factor):
            return "\n".join([self._summary(), describe_spans(self.structure), *resistance])
        lines = [
            f"{self._summary()}",
            f"the factor is on axles × live × impact{also}; codes with partial factors require 1",
            *self.describe_codes(),
            *self.describe_pressure(),
            *self.describe_backing(),
            self._describe_basis(),
            describe_closing(self.moving.worst.joints["N"].values, self.structure),
            f"least factor driving {', '.join(least)}",
            f"{self.moving}",
            *describe_axles(self.structure, self._axles_at, self.width),
            *self._describe_hinges(),
            f"every x is that of the case and the picture; {describe_spans(self.structure)}",
            f"geometric factor of safety at that place{self._as_given}, {crushing}: {geometric}",
            "the geometric factor is Heyman's criterion, often 2 or more (from memory), which no "
            "code has",
            f"{vehicle.name}: axles {len(vehicle.axles)}, {sum(vehicle.axles) / 1e3:.4g} kN"
            f"{beside}; {source}",
            vehicle.describe_width(self.structure, self.width),
            f"live load by {self.live:g} ({self._source('live')})",
            f"impact by {self.impact:g}{self._impact_axle()} ({self._source('impact')})",
            f"dead load by {self.dead:g} ({favourable if self.dead == 1.0 else 'given'})",
            *([f"parapets of {self.parapets / kN:g} kN/m"] if self.parapets else []),
            *resistance,
        ]
        return "\n".join(lines)

    def _describe_basis(self) -> str:
        """Return the line on width, fill, friction and strength of the factor."""
        law = "plastic" if isinstance(self.fill, PlasticFill) else "pressure"
        of_fill = f", fill of law {law} and {self.fill.friction_angle:g}°" if self.fill else ""
        friction = Ends.of(self.structure.friction[self.structure.judged])
        sliding = f"friction {friction:g}{' without dilatancy' * (self.friction != 'coulomb')}"
        law = f"{of_fill}, {sliding if self.friction else 'no sliding'}"
        crushing = say_strength(self.structure, self.strength)
        return f"computed with {self.width:.3g} m of width{law}, {crushing}"

    def describe_pressure(self) -> list[str]:
        """Return the line on the range of the factor over the pressure of the fill, if any."""
        fill = as_pressure(self.fill)
        if np.isnan(self.full_pressure) or fill is None:
            return []
        least, begin, own = self._say_factor("without_pressure"), "over the pressure", "factor"
        if np.isnan(self.without_pressure):
            least = "none, as the bridge does not stand,"
        if isinstance(self.fill, PlasticFill):
            begin, own = "not as a plastic body, but by the pressure", "by_pressure"
        part = f"{say_part(fill.active)} of the active and up to {say_part(fill.mobilisation)} of"
        most = f"{self._say_factor('full_pressure')} with all of it"
        return [
            f"{begin} of the fill, each at its worst place: {least} with neither active nor "
            f"passive, {self._say_factor('active_alone')} with the active one alone, "
            f"{self._say_factor(own)} with {part} the passive one, {most}"
        ]

    def describe_backing(self) -> list[str]:
        """Return the line on what the backing adds, if there is some."""
        if not has_backing(self.fill):
            return []
        with_pressure, neither, active = map(self._say_factor, _BARE)
        return [
            f"without the backing but with the pressure, each at its worst place: {with_pressure}; "
            f"with the active one alone: {active}; without either: {neither}"
        ]

    def _describe_crushing(self) -> str:
        """Return at which strength joints crush, or the factor with an assumed one."""
        text = describe_crushing(self.strength, self.structure)
        return f"{text}; {self.crushing_text}" if self.crushing_text else text

    @property
    def crushing_text(self) -> str:
        """Factors with an assumed strength of the stones where none counts, in words, or ""."""
        if not self.crushing:
            return ""
        first, *others = self.crushing.values()
        words = self._say_factor(f"{CRUSHING_PREFIX}factor")
        words = "the least factor is " * (not np.isnan(first)) + words
        law = " with the fill as weight and pressure" * isinstance(self.fill, PlasticFill)
        ends = f" ({_say_ends([first, *others])} over what is assumed of the fill)" * bool(others)
        return f"at {ASSUMED_STRENGTH / MPa:g} MPa {words}{law}{ends}"

    @property
    def by_codes(self) -> dict[str, "Rating"]:
        """Ratings of a vehicle of one's own with the factors of codes, by their names.

        They are from memory. With a distributed load or an impact on one axle they are of CS 454
        alone. Of a train of a code the dynamic factor is that of the span.
        """
        if np.isnan(self.factor):
            return {}
        found = dict[str, Mapping[str, Any]]()
        # the dynamic factor is not on a distributed load, and may be on one axle alone
        products = self.vehicle.list_products(self.structure, self.live, self.missing)
        for name, product in products.items() if self._is_multiple else ():
            share = self.live * self.impact / product
            of: Any = {x: share * getattr(self, x) for x in ("factor", "by_rule", *_STATES)}
            crushing = {state: share * factor for state, factor in self.crushing.items()}
            found[name] = of | {"crushing": crushing}
        found |= {BY_CS454: self.by_cs454} if self.by_cs454 else {}
        return {name: self._with_factors(of) for name, of in found.items()}

    @property
    def least_by_codes(self) -> tuple[float, str]:
        """Least factor by codes, and of which; "" where that of its own factors is less."""
        codes = self.by_codes
        own = [(self.factor, "")] * (not self.missing or not codes)
        return min([*own, *((x.factor, by) for by, x in codes.items())])

    @property
    def rank(self) -> tuple[float, str]:
        """Factor by which vehicles are ranked: without factors `least_by_codes`, else its own."""
        return self.least_by_codes if self.missing else (self.factor, "")

    @property
    def _is_multiple(self) -> bool:
        """Whether the factor with other factors on the vehicle is a multiple of this one."""
        alike = self.impact == 1.0 or len(self.vehicle.axles) == 1
        return not self.area_load and (alike or self.vehicle.impact_on == "all axles")

    def _with_factors(self, of: Mapping[str, Any]) -> "Rating":
        """Return this with the factors, in each state, of another code on the same vehicle."""
        moving = replace(self.moving, worst=replace(self.moving.worst, factor=of["factor"]))
        states: dict[str, Any] = {each: of.get(each, np.nan) for each in ("by_rule", *_STATES)}
        states["places"] = of.get("places", self.places)
        return replace(self, moving=moving, missing=(), crushing=of["crushing"], **states)

    def describe_codes(self) -> list[str]:
        """Return the lines on a vehicle of one's own with the factors of codes, if it is one."""
        codes, product, lines = self.by_codes, self.live * self.impact, list[str]()
        if codes and self._is_multiple and len(self.missing) < 2 and self.vehicle.grade == "given":
            lines = [f"bare axles {product * self.factor:.4g}, live × impact {product:.4g} given"]
        name = self.vehicle.name
        return lines + [
            f"{name} {by}: factor {each.factor:.4g}, {each.outcome}" for by, each in codes.items()
        ]

    @property
    def _axles_at(self) -> dict[float, float]:
        """Weight of each axle by its x at the worst place, from the front [N, m]."""
        sense = 1.0 if self.moving.direction == "right" else -1.0
        axles = parse_axles(self.vehicle.axles, self.vehicle.spacings).tolist()
        return {self.moving.position + sense * ahead: load for load, ahead in axles}

    def _describe_hinges(self) -> list[str]:
        """Return the line on where the hinges of the worst place are, if there are some."""
        joints = self.structure.joints
        ends = [getattr(joints[number], side) for number, side in self.moving.worst.hinges]
        return [f"hinges at x = {', '.join(f'{x:.2f}' for x, _ in ends)} m"] if ends else []

    def _source(self, factor: str) -> str:
        """Return where a factor on the vehicle comes from."""
        source = str(getattr(self.vehicle, f"{factor}_source"))
        if factor in self.missing:
            return "none given" if source == "given" else source
        return source if getattr(self, factor) == getattr(self.vehicle, factor) else "given"

    def _impact_axle(self) -> str:
        """Return which axle alone has the dynamic factor at the worst place, in words."""
        vehicle = self.vehicle
        if vehicle.impact_on == "all axles" or len(vehicle.axles) == 1:
            return ""
        live = [load for load in self.moving.worst.live if isinstance(load, PointLoad)]
        forces = {load.x: -load.force[1] for load in reversed(live)}  # axles are the first
        worst = int(np.argmax([forces.get(x, 0.0) / load for x, load in self._axles_at.items()]))
        return f" on the worst axle alone, here number {worst + 1} from the front"

    def _geometric_text(self, factor: float) -> str:
        """Return a geometric factor of safety, in words where it is below 1."""
        if self.moving.worst.fill_motion is not None:
            return "not searched with a plastic fill"
        if np.isnan(factor):
            carried = f", but slide at {self.deepest:.4g} of it" if self.deepest > 0.0 else ""
            return f"none, joints of any depth do not carry the vehicle there{carried}"
        text = f"{factor:.3g}"
        if factor < 1.0:
            text += f", below 1: joints are too thin by {100.0 * (1.0 - factor):.2g} %"
        return text


def _say_ends(factors: Sequence[float]) -> str:
    """Return the least and the greatest of some factors; "none" where one is undefined."""
    known = [factor for factor in factors if not np.isnan(factor)]
    least = f"{min(known):.4g}" if len(known) == len(factors) else "none"
    return f"{least} to {max(known):.4g}" if known else least


def _name_places(places: Collection[float]) -> str:
    """Return some places in words, of many the first and the last; "" for none [m]."""
    each = [f"{x:.2f}" for x in sorted(places)]
    return f"{each[0]} to {each[-1]}" if len(each) > 4 else join_words(each)


@validate_arguments
def rate(  # noqa: PLR0913  (factors of the check, and the strength of the bridge)
    structure: Structure | HasStructure,
    vehicle: str | Vehicle,
    *,
    live: float | None = None,
    impact: float | None = None,
    dead: float = 1.0,
    width: Metres | None = None,
    area_load: Pascals | None = None,
    friction: str | None = "coulomb",
    strength: Pascals | None = None,
    fill: Fill | PlasticFill | None = None,
    parapets: NewtonsPerMetre = 0.0,
) -> Rating:
    """Rate a bridge for a vehicle: the multiple of it, with partial factors, at collapse.

    The vehicle drives over the bridge in both directions (`moving_load`), from on to off in steps
    of 1/100 of the bridge's length, or 1/20 with a plastic fill. With a `Fill` the steps beside all
    places of at most 1.1 times the least factor are searched to a hundredth. Without fill places
    follow where an axle stands at an end of a stone, beside the least factors of these. Its axles
    spread through a fill along the bridge; across it they spread evenly over `width`. The
    distributed load of its code grows with them, where it is adverse (`moving_load`). The geometric
    factor of safety is Heyman's: all joints are narrowed about their middles, at unchanged weights
    and with the vehicle at its worst place, until it is carried no longer; or deepened until it is
    carried.

    Joints are rigid. Elastic ones close, so that a ring sinks and bears less: `archfem.pushover`
    with large displacements and control by "path" finds how much less.

    Args:
        structure: the bridge, or an `archfem.Analysis` of it.
        vehicle: one of `archfem.limit.VEHICLES` by its name, or one's own.
        live: partial factor on its weight [-]; by default that of its code.
        impact: dynamic factor on its weight, or on that of one axle (`Vehicle.impact_on`) [-]; by
            default that of its code, but 1 for LM71, whose factor depends on the span.
        dead: partial factor on the weights of stones and fill [-]; by default 1, as for weights
            that stabilise. Weights on one side alone are not increased.
        width: width over which one vehicle spreads [m]; by default that of the wheels and of the
            least depth of fill above the rings, at most a lane (`Vehicle.spread_over`).
        area_load: distributed load beside and below the axles [Pa]; by default that of its code.
            Where less of it or a larger width is given, `by_rule` is the factor without.
        friction: as for `collapse_factor`; the geometric factor takes "coulomb" for
            "nonassociated".
        strength: as for `collapse_factor`, divided by its partial factor [Pa]. Without one the
            result is also that of 5 MPa; with an infinite one it is not.
        fill: as for `collapse_factor`.
        parapets: weight of both parapets along the bridge, where they stand on it [N/m]. It spreads
            evenly over the width, and through the fill, but raises no pressure of the fill.

    Returns:
        Factor, worst place, its mechanism, and the factors at all places.

    Raises:
        InvalidInput: the vehicle is unknown, a factor or the width is out of range, or as for
            `moving_load`.
        DidNotConverge: the solver of linear programmes gave up.

    References:
        Heyman, The Masonry Arch, Ellis Horwood (1982).
    """
    structure, driven = structure_of(structure), find_vehicle(vehicle)
    crushes = strength is None or np.isfinite(strength)  # infinite says that it does not
    live, impact, missing = driven.choose_factors(live, impact)
    check_factor(dead, "dead, factor on the weights")
    rule = driven.spread_over(structure)
    width = rule if width is None else width
    area_load = driven.area_load if area_load is None else check_area_load(area_load)
    _check_width(width, structure)
    weighted, rows = scale_weights(structure, dead), driven.factored(live, impact)
    strength, fill = check_options(structure, friction, strength), place_backing(fill, structure)
    laid = lay_parapets(structure, dead * parapets)
    options = dict[str, Any](friction=friction, strength=strength, fill=fill, dead=laid)

    def drive(width: float, area_load: float, positions: Sequence[float]) -> MovingLoad:
        # the structure is modelled over its whole width, of which a vehicle loads a part
        given = options | {"spacings": driven.spacings, "area_load": live * area_load}
        given["positions"] = positions
        spread = [(structure.width / width * row).tolist() for row in rows]
        return MovingLoad.least_of([moving_load(weighted, row, **given) for row in spread])

    is_plastic = isinstance(fill, PlasticFill)
    axles = parse_axles(driven.axles, driven.spacings)
    positions = _places_along(weighted, axles)
    moving = drive(width, area_load, positions[::5] if is_plastic else positions)
    if fill is None and (ends := places_at_ends(weighted, axles, moving)):
        moving, positions = moving.joined(drive(width, area_load, ends)), [*positions, *ends]
    if isinstance(fill, Fill) and not np.isnan(moving.worst.factor):
        loads = spread_over_bridge(weighted, rows, width, axles)
        worst = refine_worst_places(weighted, positions, loads, live * area_load, options, moving)
        moving = moving.joined(drive(width, area_load, worst))
    least = min(width, rule), max(area_load, driven.area_load)
    is_by_rule = np.allclose(least, (width, area_load), rtol=1e-9, atol=0.0)
    by_rule = np.nan if is_by_rule else drive(*least, [moving.position]).worst.factor
    more = dict[str, Any](fill=fill, friction=friction, missing=missing, parapets=parapets)
    none = {"geometric": np.nan}
    more |= none if is_plastic else find_geometric_factors(weighted, moving, options)
    for key, each, by, states in further_searches(driven, rows, live, area_load, options, crushes):
        loads = spread_over_bridge(weighted, each, width, axles)
        known = None if key or is_plastic else moving
        found = find_least_factors(weighted, positions, loads, by * area_load, states, known)
        more |= {key: found} if key else found
    factors = live, impact, dead, width, area_load
    return Rating(structure, driven, *factors, moving, by_rule=by_rule, strength=strength, **more)


def rate_again(found: Rating, structure: Structure, width: float | None, **options: Any) -> float:
    """Return the factor of a rated vehicle over another bridge, or of other stones and fill.

    Width and places are those by rule where they were for the rating; NaN without equilibrium.
    """
    vehicle, options = found.vehicle, dict(options)
    options["strength"] = check_options(structure, options["friction"], options["strength"])
    options["fill"] = place_backing(options["fill"], structure)
    options["dead"] = lay_parapets(structure, found.dead * found.parapets)
    usual = vehicle.spread_over(structure) if found.is_width_by_rule else found.width
    weighted = scale_weights(structure, found.dead)
    axles = parse_axles(vehicle.axles, vehicle.spacings)
    rows = vehicle.factored(found.live, found.impact)
    loads = spread_over_bridge(structure, rows, usual if width is None else width, axles)
    given = _places_along(weighted, axles), loads, found.live * found.area_load, {"": options}
    # another property may move the worst place anywhere: no factors guide the search
    return find_least_factors(weighted, *given, None).get("", np.nan)


def _check_width(width: float, structure: Structure) -> None:
    """Raise an error where one vehicle spreads over more than the bridge, or over nothing."""
    if not 0.0 < width <= structure.width:
        raise InvalidInput(
            f"width {width:.4g} m is not above 0 and up to that of the bridge, "
            f"{structure.width:.4g} m: give the part over which one vehicle spreads"
        )


def _places_along(structure: Structure, vehicle: Array, steps: int = 100) -> Sequence[float]:
    """Return places from where the vehicle drives onto the structure to where it leaves [m]."""
    return tuple(vehicle_positions(structure, vehicle, None, steps).tolist())
