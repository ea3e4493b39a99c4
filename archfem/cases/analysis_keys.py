"""Sections [limit], [pushover], [rating] and [assessment]: capacity, kinematic assessment."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from archfem._validation import check_choice, check_number, declared_keys, validate_methods
from archfem.cases.motion_keys import build_spectrum
from archfem.cases.structure_keys import find_table
from archfem.cases.toml_file import Table, check_table, read_object
from archfem.errors import Interrupted, InvalidInput
from archfem.joints.criteria import Criteria
from archfem.limit.collapse import Collapse, collapse_factor, describe_crushing
from archfem.limit.fill_strength import Fill, PlasticFill
from archfem.limit.rating import Rating, rate
from archfem.limit.self_weight import check_options, self_weight_programme
from archfem.limit.vehicles import VEHICLES, VEHICLES_OF_CODES, Vehicle
from archfem.limit.worst_places import ASSUMED_STRENGTH
from archfem.masonry.loads import Action, AttachedLoad, BodyForce, PointLoad, Settlement, name_side
from archfem.masonry.materials import check_strength
from archfem.masonry.out_of_plane import take_highest_strip
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure, join_names
from archfem.motion.design_spectra import DesignSpectrum
from archfem.motion.motion import Motion
from archfem.statics import mechanism_assessment
from archfem.statics.assessed_mechanism import KinematicAssessment
from archfem.statics.assessment_checks import LimitState
from archfem.statics.equilibrium import Equilibrium
from archfem.statics.mechanism_assessment import kinematic_assessment
from archfem.statics.pushover import Pushover, Stop, pushover
from archfem.units import G, MPa, describe_if_in_g, kN

# Least weight of the heaviest axle of a vehicle that a case may give without its unit [N]: those of
# lorries in kg are less
LIGHT_AXLE = 20e3

# Words of [limit] and [assessment]: laws of the joints, and of the fill
FRICTION_LAWS = ("coulomb", "nonassociated", "none")
FILL_LAWS: Mapping[str, type[Fill | PlasticFill]] = {"pressure": Fill, "plastic": PlasticFill}

# Notes on the strip of a whole wall that has courses of different lengths, and where it has none
_STRIP = (
    "it is {:.4g} m of wall with courses as long as the longest, heavier than the wall, and has "
    "all loads of this, weights on a gable at its top; it falls alone unless the gable is tied "
    "together along its length, as by a beam on it: then say by what, as `tied_along`"
)
_LEFT_OUT = (
    "its strip through the highest place is left out, as by the case it is tied along by: {}"
)


@validate_methods
@dataclass(frozen=True)
class LimitAnalysis:
    """Limit analysis of a case: the live load, and the strength of joints, stones and fill.

    Attributes:
        live: loads that grow together; the collapse factor multiplies them. Without any, friction
            and strengths are those of a rating.
        friction: friction law, "coulomb", "nonassociated", or None without sliding.
        strength: compressive strength of the stones at the joints [Pa], that of [limit] or else
            the least that [materials] give; None, or infinite for "none", without crushing.
        fill: strength of the fill, or None.
        dead: loads beside self-weight that do not grow.
        demand: peak acceleration of the ground that pushes are compared with [m/s²]; by default
            that of the spectrum of [assessment], or of the target of [suite].
    """

    live: Sequence[Action]
    friction: str | None
    strength: float | None = None
    fill: Fill | PlasticFill | None = None
    dead: Sequence[Action] = ()
    demand: float | None = None

    @property
    def resistance(self) -> dict[str, Any]:
        """Arguments of `collapse_factor` other than the load, which `rate` has too."""
        return {"friction": self.friction, "strength": self.strength, "fill": self.fill}

    def check(self, structure: Structure) -> None:
        """Refuse all that `solve` or a rating refuses, before other results are computed.

        Args:
            structure: structure of the case.

        Raises:
            InvalidInput: a load misses the structure, blocks are too soft to be rigid, or the
                strength is in another unit.
        """
        check_options(structure, self.friction, self.strength)
        _check_places(structure, *self.live, *self.dead)
        if self.live and not isinstance(self.fill, PlasticFill):
            given = self.friction, self.strength, self.fill, self.dead
            self_weight_programme(structure, *given)[0].load(self.live)

    def solve(self, structure: Structure) -> Collapse:
        """Compute the load factor at which a structure of rigid blocks becomes a mechanism.

        Args:
            structure: structure of the case.

        Returns:
            Result of `archfem.collapse_factor`.

        Raises:
            InvalidInput: there is no load, or a load misses the structure; or blocks are too soft
                to be rigid and the case gives no strength of a fill.
        """
        if not self.live:
            raise InvalidInput(
                "limit has no load: give horizontal = 1.0, a multiple of each block's weight, or "
                'point = { x = "1.4 m", force = ["0 kN", "-1 kN"] }'
            )
        return collapse_factor(structure, live=self.live, dead=self.dead, **self.resistance)

    def solve_so_far(self, structure: Structure) -> Collapse:
        """Return the result of `solve`; of a search that is interrupted the bound so far.

        Args:
            structure: structure of the case.
        """
        try:
            return self.solve(structure)
        except Interrupted as error:
            found: Collapse = error.last
            return found

    def describe_crushing(self, structure: Structure) -> str:
        """Describe at which strength joints crush; of point loads without any, by an assumed one.

        Args:
            structure: structure of the case.
        """
        words, fill = describe_crushing(self.strength, structure), self.fill
        has_points = any(isinstance(load, PointLoad) for load in self.live)
        # a search of sliding without dilatancy in walls takes minutes
        takes_long = isinstance(fill, PlasticFill) or self.friction == "nonassociated"
        if self.strength is not None or not has_points or takes_long:
            return words
        weaker = replace(self, strength=ASSUMED_STRENGTH).solve(structure)
        return f"{words}; with {ASSUMED_STRENGTH / MPa:g} MPa, {weaker.sentence}"

    @property
    def opposite(self) -> "LimitAnalysis | None":
        """The analysis with the load in the other sense; None unless all of it is horizontal."""
        loads = [load for load in self.live if isinstance(load, BodyForce) and not load.vertical]
        if len(loads) < len(self.live):
            return None
        return replace(self, live=[BodyForce(-load.horizontal) for load in loads])


@dataclass(frozen=True)
class PushoverSettings:
    """Pushover of a case."""

    live: Settlement | tuple[Action, ...]  # loads that grow together, or the support that moves
    dead: tuple[Action, ...]  # loads beside self-weight that do not grow
    options: dict[str, Any]  # other arguments of `pushover`

    def check(self, structure: Structure) -> None:
        """Refuse a load that misses the structure, and a settlement of another block."""
        live = [self.live] if isinstance(self.live, Settlement) else self.live
        _check_places(structure, *live, *self.dead)

    def solve(self, start: Equilibrium, criteria: Criteria) -> Pushover:
        """Push the structure from its dead load."""
        given = {**self.options, "dead": self.dead, "criteria": criteria}
        return pushover(start.model, self.live, start=start, **given)

    def __str__(self) -> str:
        """Describe the loads and the control in one line."""
        grows = "a support moves"
        if not isinstance(self.live, Settlement):
            grows = f"loads that grow together: {len(self.live)}"
        control = self.options.get("control", "displacement")
        return f"pushover: {grows}; loads that stay: {len(self.dead)}; control by {control}"


def _check_places(structure: Structure, *loads: Action | Settlement) -> None:
    """Refuse loads at points that miss the structure, and settlements of blocks that are free."""
    for load in loads:
        if not isinstance(load, BodyForce):
            load.place(structure)


# Keys of loads that grow, as multiples of the weight or at points, and of loads that stay
_LOAD_KEYS = declared_keys(BodyForce) | {"point": (dict, [dict]), "dead": [dict]}


def limit_keys() -> dict[str, Any]:
    """Return the keys of [limit]."""
    return _keys_beside(collapse_factor, "live", "dead") | _LOAD_KEYS | {"demand": "m/s**2"}


def pushover_keys() -> dict[str, Any]:
    """Return the keys of [pushover]; hinges are those of [criteria]."""
    own = _keys_beside(pushover, "live", "dead", "start", "criteria")
    return own | _LOAD_KEYS | {"settlement": dict}


def rating_keys() -> dict[str, Any]:
    """Return the keys of [rating]; joints and fill are those of [limit]."""
    own = {"vehicle": (str, dict, [(str, dict)])}
    return _keys_beside(rate, "friction", "strength", "fill") | own


def assessment_keys() -> dict[str, Any]:
    """Return the keys of [assessment]; the strength is that of [limit]."""
    return _keys_beside(kinematic_assessment, "strength") | {"tied_along": str}


def find_given_strength(structure: Structure, settings: Table) -> float | None:
    """Return the least strength that [materials] give for blocks at assessed joints [Pa]."""
    numbers = np.unique(structure.pairs[structure.judged])
    materials = {structure.blocks[number].material for number in numbers}
    given = (x.strength for x in materials if "strength" in find_table(settings, x).given)
    return min(filter(None, given), default=None)


def parse_limit(table: Any, strength: float | None = None) -> LimitAnalysis:
    """Return the limit analysis of a case, by default with the strength of its stones."""
    values = check_table(table, limit_keys(), "limit")
    live, dead = _read_loads(values, "limit")
    friction = _check_friction(values.get("friction", "coulomb"), "limit.friction")
    fill = _fill(values["fill"], "limit.fill") if "fill" in values else None
    given = values.get("strength", strength)
    if "strength" in values and given is None:  # "none"
        given = np.inf
    if given not in (None, np.inf):
        check_strength(given, "limit.strength")
    if (demand := values.get("demand")) is not None:
        check_number(demand, "limit.demand [m/s²]", minimum=1e-3)
        if words := describe_if_in_g(demand, "limit.demand"):
            raise InvalidInput(f"{words}, and else with the unit g")
    return LimitAnalysis(live, friction, given, fill, dead, demand)


def parse_pushover(table: Any) -> PushoverSettings:
    """Return the pushover of a case."""
    values = check_table(table, pushover_keys(), "pushover")
    live, dead = _read_loads(values, "pushover")
    options: dict[str, Any] = {key: values[key] for key in ("control", "stop") if key in values}
    if "stop" in options:
        options["stop"] = read_object(Stop, options["stop"], "pushover.stop")
    if ("settlement" in values) == bool(live):
        raise InvalidInput(
            "pushover has no load, or a load and a settlement: give one of horizontal = 1.0, a "
            'multiple of each block\'s weight, point = { x = "1.4 m", force = ["0 kN", "-1 kN"] }, '
            "or settlement"
        )
    if "settlement" in values:
        moves = read_object(Settlement, values["settlement"], "pushover.settlement")
        return PushoverSettings(moves, dead, options)
    return PushoverSettings(live, dead, options)


def _read_loads(values: Table, section: str) -> tuple[tuple[Action, ...], tuple[Action, ...]]:
    """Return the loads of a section that grow, and those that stay."""
    live: list[Action] = []
    if "horizontal" in values or "vertical" in values:
        live.append(BodyForce(values.get("horizontal", 0.0), values.get("vertical", 0.0)))
    if "point" in values:
        points = values["point"]
        points = points if isinstance(points, list) else [points]
        live += [_point_load(point, f"{section}.point") for point in points]
    dead = (_dead_load(load, f"{section}.dead") for load in values.get("dead", ()))
    return tuple(live), tuple(dead)


def _check_friction(value: Any, key: str) -> str | None:
    """Return the friction law of limit analysis; None without sliding."""
    law = check_choice(value, key, FRICTION_LAWS)
    return None if law == "none" else law


def _fill(table: Any, key: str) -> Fill | PlasticFill:
    """Return the strength of the fill."""
    word = table.get("law", "pressure") if isinstance(table, Mapping) else "pressure"
    law = FILL_LAWS[check_choice(word, f"{key}.law", FILL_LAWS)]
    fill = check_table(table, declared_keys(law) | {"law": str}, key)
    fill.pop("law", None)
    if "friction_angle" not in fill:
        raise InvalidInput(
            f"{key} = {table} lacks its angle of friction: give friction_angle = "
            '"35 degree", which well-packed gravel has'
        )
    return law(**fill)


def _dead_load(table: Any, key: str) -> Action:
    """Return a load that does not grow: a force at a point, or multiples of the weight."""
    if isinstance(table, Mapping) and {"horizontal", "vertical"} & table.keys():
        values = check_table(table, declared_keys(BodyForce), key)
        return BodyForce(values.get("horizontal", 0.0), values.get("vertical", 0.0))
    return _point_load(table, key)


def _point_load(table: Any, key: str) -> PointLoad:
    """Return a concentrated load."""
    point = check_table(table, declared_keys(PointLoad), key)
    if not {"x", "force"} <= point.keys() or len(point["force"]) != 2:
        raise InvalidInput(
            f"{key} = {table}: give a place and the two components of a force, e.g. "
            '{ x = "1.4 m", force = ["0 kN", "-1 kN"] }'
        )
    return PointLoad(**point)


def parse_rating(table: Any) -> Table:
    """Return the rating of a case: the arguments of `rate` that it gives, of its first vehicle."""
    options = check_table(table, rating_keys(), "rating")
    for each in reversed(list_vehicles(options)):
        options["vehicle"] = each
        if isinstance(each, dict):
            options["vehicle"] = vehicle = read_object(Vehicle, each, "rating.vehicle")
            has_unit = all(isinstance(weight, str) for weight in each["axles"])
            heaviest = max(vehicle.axles)
            if not has_unit and 1.0 < heaviest < LIGHT_AXLE:  # 1 N is a load of studies
                raise InvalidInput(
                    f"rating.vehicle '{vehicle.name}': axles = {each['axles']} are in N, and the "
                    f"heaviest, {heaviest / kN:g} kN, is that of a cart: give units, as "
                    f'in "{heaviest * G / kN:.4g} kN" for a mass of {heaviest:g} kg'
                )
    return options


def list_vehicles(rating: Table) -> list[Any]:
    """Return the vehicles of [rating], names and tables."""
    own = rating.get("vehicle", [])
    return own if isinstance(own, list) else [own]


def name_vehicles(names: Sequence[str], rating: Table) -> list[Table]:
    """Return [rating] with each of some vehicles: by name, all of a code, or the case's own."""
    own = {each["name"]: each for each in list_vehicles(rating) if "name" in each}
    known: dict[str, Sequence[Any]] = {name: [name] for name in VEHICLES}
    known |= {**VEHICLES_OF_CODES, **{name: [each] for name, each in own.items()}}
    lower = {name.lower(): vehicles for name, vehicles in known.items()}
    if missing := [name for name in names if name.lower() not in lower]:
        yours = ", ".join([*(f"'{name}' of the case" for name in own), *VEHICLES])
        raise InvalidInput(
            f"vehicle {missing[0]!r} is not known: use one of {yours}; or "
            f"{join_names([*VEHICLES_OF_CODES])}, each for all of a code"
        )
    vehicles = [each for name in names for each in lower[name.lower()]] or list_vehicles(rating)
    return [{**rating, "vehicle": vehicle} for vehicle in vehicles] or [rating]


def rate_case(structure: Structure, rating: Table, limit: LimitAnalysis) -> Rating:
    """Rate the bridge of a case, by the joints and the fill of its [limit]."""
    options = dict(rating)
    if "vehicle" not in options:
        raise InvalidInput(
            'a rating needs a vehicle: write [rating] with vehicle = "LM1", or give --vehicle LM1'
        )
    if limit.dead:
        raise InvalidInput(
            "a rating takes no loads that stay, [limit] dead: leave them out, or ask `archfem "
            "limit` for the factor of the axles as point loads"
        )
    return rate(structure, options.pop("vehicle"), **options, **limit.resistance)


@dataclass(frozen=True)
class AssessmentSettings:
    """Kinematic assessment of a case.

    Args:
        tied_along: what ties a gable together along its slopes, as "a concrete beam": of a whole
            wall across its plane the strip through the highest place is then not assessed.
    """

    spectrum: DesignSpectrum | None  # of the demand; None for that of the case's suite or motion
    directions: tuple[float, ...]  # of the horizontal forces, 1 to the right and -1 to the left
    options: dict[str, Any]  # other arguments of `kinematic_assessment`
    of_limit: tuple[str, ...] = ()  # names of those options that are of the limit analysis
    tied_along: str = ""

    def solve(
        self, structure: Structure, demand: DesignSpectrum | Motion | None, parts: bool = False
    ) -> dict[str, KinematicAssessment]:
        """Assess the structure, or each part by itself, in each direction, with the least fill.

        Of a whole wall across its plane also the strip through its highest place, if it is weaker.
        """
        spectrum = self.spectrum if self.spectrum is not None else demand
        if spectrum is None:
            raise InvalidInput(
                "an assessment needs a spectrum: write [assessment] with spectrum = { code = "
                '"NTC-2018", ag = 0.25, f0 = 2.4, tc_star = 0.32, site = "B" }, or a motion'
            )
        found: dict[str, KinematicAssessment] = {}
        for direction in self.directions:
            side, options = name_side(direction), {**self.options}
            options["direction"] = direction
            if parts:
                # without dilatancy the whole alone is searched
                if "friction" in self.of_limit:
                    del options["friction"]
                each = mechanism_assessment.assess_parts(structure, spectrum, **options)
                found |= {f"{name or 'part'}, {side}": result for name, result in each.items()}
                continue
            loads, whole = options.pop("loads", ()), np.full(2, np.inf)
            bodies = [(side, structure, loads)]
            if (taken := take_highest_strip(structure, loads)) and not self.tied_along:
                bodies.append((f"{side}, strip through the highest place", *taken))
            for name, body, own in bodies:
                last = kinematic_assessment(body, spectrum, loads=own, **options)
                own_notes = [_STRIP.format(body.width)] * (body is not structure)
                own_notes += [_LEFT_OUT.format(self.tied_along)] * bool(taken and self.tied_along)
                notes = (*last.notes, *own_notes)
                listed = {name: replace(last, notes=notes)}
                while above := last.above:
                    listed[f"{name}, {above.mechanism_name}"] = last = above
                # by the linear check, and by that which decides
                ratios = [[x.checks[k].decisive for k in (0, -1)] for x in listed.values()]
                if body is structure or (np.min(ratios, axis=0) < 0.999 * whole).any():
                    found |= listed
                whole = np.min(ratios, axis=0)
        return {name: result.least or result for name, result in found.items()}


def parse_assessment(
    table: Any, limit: LimitAnalysis | None = None, structure: Structure | None = None
) -> AssessmentSettings:
    """Return the kinematic assessment of a case, by default with fill and sliding of its limit."""
    options = check_table(table, assessment_keys(), "assessment")
    tied_along = options.pop("tied_along", "")
    if limit and limit.strength is not None:
        options["strength"] = limit.strength
    spectrum = None
    if "spectrum" in options:
        spectrum = build_spectrum(options.pop("spectrum"), "assessment.spectrum")
    directions = (options.pop("direction"),) if "direction" in options else (1.0, -1.0)
    if not set(directions) <= {1.0, -1.0}:
        raise InvalidInput(
            f"assessment.direction = {directions[0]:g}: give 1 for right or -1 for left, or leave "
            "it out for both"
        )
    if "friction" in options:
        options["friction"] = _check_friction(options["friction"], "assessment.friction")
    if isinstance(state := options.get("limit_state"), dict):
        options["limit_state"] = read_object(LimitState, state, "assessment.limit_state")
    of_limit = list[str]()
    if "fill" in options:
        options["fill"] = _fill(options["fill"], "assessment.fill")
    elif limit and isinstance(limit.fill, Fill):  # with a plastic one no finite motion is known
        options["fill"] = limit.fill
        of_limit.append("fill")
    if "loads" in options:
        loads = options["loads"]
        options["loads"] = [read_object(AttachedLoad, load, "assessment.loads") for load in loads]
    # sliding without dilatancy is not searched with attached loads or a fill
    loaded = options.get("loads") or (structure and find_yielding_blocks(structure))
    flat = limit is not None and limit.friction == "nonassociated"
    if flat and not loaded and not {"friction", "fill"} & options.keys():
        options["friction"] = "nonassociated"
        of_limit.append("friction")
    return AssessmentSettings(spectrum, directions, options, tuple(of_limit), tied_along)


def _keys_beside(function: Callable[..., Any], *given: str) -> dict[str, Any]:
    """Return the keys of the arguments of a function other than the structure and some."""
    left_out = ("structure", "model", *given)
    return {k: v for k, v in declared_keys(function).items() if k not in left_out}
