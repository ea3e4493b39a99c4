"""Vehicles over a bridge: collapse factor at every position of a row of axles, and its rating."""

import logging
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from tqdm import tqdm

from archfem._display import ResultDisplay
from archfem._typing import Array, Metres, Newtons, Numbers, Pascals
from archfem._validation import check_number, check_numbers, validate_arguments
from archfem.errors import InvalidInput
from archfem.limit.backfill import (
    BlocksWithFill,
    Fill,
    is_balanced,
    refuse_bonds,
    self_weight_programme,
)
from archfem.limit.collapse import Collapse, collapse_factor, describe_crushing, warn_locking
from archfem.limit.instability import DeepenedBlocks
from archfem.limit.linear_programme import Optimum, Programme
from archfem.limit.nonassociated import find_weakest, starting_forces
from archfem.limit.plastic_fill import PlasticFill
from archfem.masonry.loads import PointLoad
from archfem.masonry.structure import HasStructure, Structure, structure_of

DRIVING_DIRECTIONS = ("right", "left")

logger = logging.getLogger("archfem")

# Axles that stand on the structure, from left to right, or these and a distributed load
AxleRow = tuple[PointLoad, ...]


@dataclass(frozen=True)
class Vehicle:
    """A vehicle of a code, or one's own.

    Attributes:
        name: in tables and pictures.
        axles: weight of each axle, from the front [N].
        spacings: distances between the axles, one fewer [m].
        live: partial factor of the code on its weight [-].
        source: code and clause of the axles, and what of the code's load is left out.
        grade: "read" where weights and spacings were read in the code's table or in a text that
            quotes it, "from memory" otherwise.
        live_source: code and clause of the partial factor, and its grade.
        impact: dynamic factor of the code on its weight [-].
        impact_source: code and clause of the dynamic factor, and its grade.
        area_load: load of the code on the road beside and below the axles, wherever it is adverse,
            without the dynamic factor [Pa].
        wheels: width between the outer faces of the wheels, at the road [m].
        lane: width of a lane, beyond which a vehicle does not spread [m].
        width_source: code and clause of wheels and lane, and their grade.
        left_out: what of the code's load acts at the same time and is left out; else empty.
    """

    name: str
    axles: tuple[Newtons, ...]
    spacings: tuple[Metres, ...] = ()
    live: float = 1.0
    source: str = "given"
    grade: str = "given"
    live_source: str = "given"
    impact: float = 1.0
    impact_source: str = "given"
    area_load: Pascals = 0.0
    wheels: Metres = 1.5
    lane: Metres = 3.0
    width_source: str = "as a single axle of CS 454, and a lane of EN 1991-2, 4.2.3; from memory"
    left_out: str = ""

    def __post_init__(self) -> None:
        """Refuse weights, spacings and factors out of range."""
        _parse_axles(self.axles, self.spacings)
        for key in ("area_load", "wheels", "lane"):
            check_number(getattr(self, key), f"{key} of {self.name}", minimum=0.0)
        longest = max(self.spacings, default=0.0)
        light = min(self.axles) < 1e3 and max(self.axles) != 1.0  # the factor of 1 N is a load
        if light or longest > 100.0 or 0.0 < self.area_load < 100.0:
            raise InvalidInput(
                f"vehicle '{self.name}' has axles of {self.axles} N, spacings of {self.spacings} m "
                f"and {self.area_load} Pa: that can only be a wrong unit"
            )
        _check_factor(self.live, f"partial factor on the live load of {self.name}")
        _check_factor(self.impact, f"dynamic factor of {self.name}")

    def spread_over(self, structure: Structure) -> float:
        """Return the width over which one vehicle spreads on a bridge, by rule [m].

        It is the width of the wheels and, at 1 in 2 to both sides, the least depth of fill above
        the rings; at most that of a lane, and of the bridge.

        Args:
            structure: the bridge.
        """
        ring = [block for block in structure.blocks if block.role == "ring"]
        points = np.concatenate([block.drawn() for block in ring] or [np.zeros((0, 2))])
        tops = [[block.top(x) for block in structure.blocks] for x in points[:, 0].tolist()]
        covers = [
            max(top for top in above if top is not None) - y
            for above, y in zip(tops, points[:, 1], strict=True)
        ]
        depth = max(min(covers, default=0.0), 0.0)
        return min(self.wheels + depth, self.lane, structure.width)


def _read_vehicles() -> dict[str, Vehicle]:
    """Return the vehicles of codes, with what those of a code share."""
    text = Path(__file__).with_name("vehicles.toml").read_text(encoding="utf-8")
    vehicles = {}
    for shared in tomllib.loads(text).values():
        for name, own in shared.pop("vehicles").items():
            axles, spacings = tuple(own.pop("axles")), tuple(own.pop("spacings", ()))
            vehicles[name] = Vehicle(name, axles, spacings, **shared | own)
    return vehicles


@dataclass(frozen=True, eq=False, repr=False)
class MovingLoad(ResultDisplay):
    """Collapse factors of a vehicle that moves over a structure.

    Attributes:
        factors: `factor`, the multiple of the vehicle's weight at collapse [-], `axles`, the number
            of its axles on the structure, and `loaded`, the length of road under a distributed load
            [m], over direction ("right", "left") and position of the vehicle's middle [m].
        worst: collapse with the least factor.
        direction: driving direction of the vehicle there.
        position: x of its middle there [m].
    """

    factors: xr.Dataset
    worst: Collapse
    direction: str
    position: float

    def _summary(self) -> str:
        """Describe the least factor and its place in one line."""
        return f"MovingLoad: least factor {self.worst.factor:.4g}, {self._place}"

    def __str__(self) -> str:
        """Describe the worst place and its collapse in one line."""
        return f"worst {self._place}: {self.worst}"

    @property
    def _place(self) -> str:
        """Place and direction of the vehicle, in words."""
        return f"at x = {self.position:.3g} m (the vehicle's middle), driving {self.direction}"


def moving_load(
    structure: Structure | HasStructure,
    axles: float | Sequence[float],
    *,
    spacings: Sequence[float] = (),
    positions: Sequence[float] | None = None,
    area_load: float = 0.0,
    friction: str | None = "coulomb",
    strength: float | None = None,
    fill: Fill | PlasticFill | None = None,
) -> MovingLoad:
    """Find the collapse factor of a vehicle at every place on a bridge, and the worst place.

    At each place the vehicle is a row of vertical point loads on the road, which grow together
    over self-weight (`collapse_factor`): through a fill they spread in fans, elsewhere they stand
    on the stones. Axles before and behind the structure do not count. The programme is set up
    once, and only its live load moves. Sliding without dilatancy is searched at each place from
    the solution at the place beside it and from a few more states. The whole search of
    `collapse_factor` follows at the worst place, and where that finds nothing.

    A distributed load grows with the axles. At each place it stands on those parts of the road, in
    40 strips, that sink in the mechanism of the least factor; sets of strips are searched, from the
    mechanisms of other places and of the distributed load alone.

    Args:
        structure: the bridge, or an `archfem.Analysis` of it.
        axles: weight of each axle over the bridge's whole width, from the front [N].
        spacings: distances between the axles, one fewer [m].
        positions: x of the vehicle's middle, halfway between first and last axle (n,) [m]; by
            default 101, from where it drives onto the structure to where it is off it again, or 21
            with a plastic fill.
        area_load: distributed load beside and below the axles, where it is adverse [Pa]. With a
            plastic fill that is found with the fill as `Fill`, and a warning says so.
        friction: as for `collapse_factor`.
        strength: as for `collapse_factor` [Pa].
        fill: as for `collapse_factor`. A plastic fill takes some seconds at each place; factors
            are its lower bounds.

    Returns:
        Factors over both directions and all positions: infinite where the vehicle never makes a
        mechanism, undefined (NaN) where the structure does not stand. And the worst collapse.

    Raises:
        InvalidInput: weights, spacings or positions are out of range, the vehicle is nowhere on
            the structure, or as for `collapse_factor`.
        DidNotConverge: the solver of linear programmes gave up.

    References:
        Gilbert, RING Theory and Modelling Guide, University of Sheffield (2005).
    """
    structure = structure_of(structure)
    refuse_bonds(structure)
    vehicle, count = _parse_axles(axles, spacings), 21 if isinstance(fill, PlasticFill) else 101
    places = _vehicle_positions(structure, vehicle, positions, count)
    rows = [
        [_axles_on_structure(structure, vehicle, direction, x) for x in places]
        for direction in DRIVING_DIRECTIONS
    ]
    on_bridge = np.array([[len(row) for row in rows_one_way] for rows_one_way in rows])
    if not on_bridge.any():
        raise InvalidInput(
            f"the vehicle is nowhere on the structure: positions are from {places.min():.4g} to "
            f"{places.max():.4g} m; move them onto it"
        )
    options: dict[str, Any] = {"friction": friction, "strength": strength, "fill": fill}
    distinct = tuple(dict.fromkeys((*rows[0], *rows[1])))
    strips = _cut_road(structure, check_number(area_load, "area_load [Pa]", minimum=0.0))
    laid, factor_of = _solve_rows(structure, distinct, strips, options)
    factors = np.array([[factor_of[row] for row in rows_one_way] for rows_one_way in rows])
    direction, place = _find_worst(factors, on_bridge)
    live = laid[rows[direction][place]]
    worst = collapse_factor(structure, live=list(live), **options)
    if friction == "nonassociated":
        factors[direction, place] = worst.factor  # by the whole search: may be a weaker state
    length = area_load and -strips[0].force[1] / (area_load * structure.width)  # of a strip
    loaded = [[length * (len(laid[row]) - len(row)) for row in one_way] for one_way in rows]
    dims = ("direction", "position")
    variables = {
        "factor": (dims, factors, {"units": "1", "long_name": "factor at collapse"}),
        "axles": (dims, on_bridge, {"units": "1", "long_name": "axles on the structure"}),
        "loaded": (dims, loaded, {"units": "m", "long_name": "road under the distributed load"}),
    }
    position = ("position", places, {"units": "m"})
    coordinates = {"direction": list(DRIVING_DIRECTIONS), "position": position}
    dataset = xr.Dataset(variables, coordinates)
    return MovingLoad(dataset, worst, DRIVING_DIRECTIONS[direction], float(places[place]))


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
        strength: compressive strength of the stones at the joints [Pa], or None.
        moving: factors at all places in both directions, on the factored vehicle over factored
            weights, and the collapse at the worst place.
        geometric: geometric factor of safety at the worst place [-]: depth of the joints over the
            least share of it, about their middles, that carries the factored vehicle; below 1 where
            only deeper joints would. Undefined (NaN) where joints of any depth do not carry it,
            infinite where hinges alone do. Not searched, and NaN, with a plastic fill.
        by_rule: factor at the worst place with the width by rule and all of the code's distributed
            load, where others were given; else NaN.
    """

    structure: Structure
    vehicle: Vehicle
    live: float
    impact: float
    dead: float
    width: float
    area_load: float
    strength: float | None
    moving: MovingLoad
    geometric: float
    by_rule: float

    @property
    def factor(self) -> float:
        """Rating factor: multiple of the factored vehicle at collapse [-]."""
        return self.moving.worst.factor

    @property
    def passes(self) -> bool:
        """Whether the bridge carries the factored vehicle everywhere; no if it falls unloaded."""
        return bool(self.factor >= 1.0)

    @property
    def outcome(self) -> str:
        """Whether it passes, without what, and the factor by rule where less was given."""
        names = {"partial": "live", "dynamic": "impact"}
        missing = [n for n, key in names.items() if self._source(key).startswith("none")]
        without = [f"{' and '.join(missing)} factor{'s'[: len(missing) - 1]}"] if missing else []
        without += [self.vehicle.left_out] if self.vehicle.left_out else []
        words = "passes" if self.passes else "fails"
        words += f" without {' and '.join(without)}" if without else ""
        return words if np.isnan(self.by_rule) else f"{words}; {self._rule_text()}"

    def _rule_text(self) -> str:
        """Return the factor with the width by rule and the whole load of the code."""
        rule, code = self.vehicle.spread_over(self.structure), self.vehicle.area_load
        load = f" and {code / 1e3:g} kN/m² beside the axles" if code else ""
        return f"over {rule:.3g} m of width{load}, by rule, {self.by_rule:.4g} at this place"

    def table(self) -> str:
        """Return factors [-], axles and loaded road at all places [m], as rows of CSV."""
        head = "direction,position of the vehicle's middle [m],factor [-],axles [-]"
        rows = [f"{head},road under the distributed load [m]"]
        for way in DRIVING_DIRECTIONS:
            here = self.moving.factors.sel(direction=way)
            values = (here[key].values for key in ("position", "factor", "axles", "loaded"))
            each = zip(*values, strict=True)
            rows += [f"{way},{x:.6g},{f:.6g},{n},{length:.4g}" for x, f, n, length in each]
        return "\n".join(rows)

    def _summary(self) -> str:
        """Describe the result in one line."""
        return (
            f"Rating of '{self.structure.name}' for {self.vehicle.name}: factor {self.factor:.4g} "
            f"at x = {self.moving.position:.3g} m (the vehicle's middle), {self.outcome}"
        )

    def __str__(self) -> str:
        """Describe outcome, worst places, mechanism, factors and sources, a line each."""
        vehicle = self.vehicle
        own = vehicle.source == vehicle.grade  # "given"
        source = vehicle.source if own else f"{vehicle.source} ({vehicle.grade})"
        factors = self.moving.factors["factor"].min("position")
        least = (f"{way} {float(factors.sel(direction=way)):.4g}" for way in DRIVING_DIRECTIONS)
        by_rule = self.width == vehicle.spread_over(self.structure)
        also, beside = "", ""
        if self.area_load:
            also = " and on the distributed load × live"
            beside = f", and {self.area_load / 1e3:g} kN/m² of road where it is adverse"
        favourable = "EN 1990:2002, Table A2.4(B), favourable; from memory"
        lines = [
            f"{self._summary()}",
            f"the factor is on axles × live × impact{also}; codes with partial factors require 1",
            f"least factor driving {', '.join(least)}",
            f"{self.moving}",
            f"geometric factor of safety at that place: {self._geometric_text()}",
            "it is of the same vehicle; Heyman requires it, often 2 (from memory), and no code",
            f"{vehicle.name}: axles {len(vehicle.axles)}, {sum(vehicle.axles) / 1e3:.4g} kN"
            f"{beside}; {source}",
            f"over {self.width:.3g} m of width ({vehicle.width_source if by_rule else 'given'})",
            f"live load by {self.live:g} ({self._source('live')})",
            f"impact by {self.impact:g} ({self._source('impact')})",
            f"dead load by {self.dead:g} ({favourable if self.dead == 1.0 else 'given'})",
            describe_crushing(self.strength),
        ]
        return "\n".join(lines)

    def _source(self, factor: str) -> str:
        """Return where a factor on the vehicle comes from."""
        vehicle = self.vehicle
        value, source = getattr(self, factor), str(getattr(vehicle, f"{factor}_source"))
        if value != getattr(vehicle, factor):
            return "given"
        # a vehicle of one's own has factors of 1 where it gives none
        return "none given" if value == 1.0 and source == "given" else source

    def _geometric_text(self) -> str:
        """Return the geometric factor of safety, in words where it is below 1."""
        if self.moving.worst.fill_motion is not None:
            return "not searched with a plastic fill"
        if np.isnan(self.geometric):
            return "none, joints of any depth do not carry the vehicle: they slide or crush"
        text = f"{self.geometric:.3g}"
        if self.geometric < 1.0:
            text += f", below 1: joints are too thin by {100.0 * (1.0 - self.geometric):.2g} %"
        return text


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
) -> Rating:
    """Rate a bridge for a vehicle: the multiple of it, with partial factors, at collapse.

    The vehicle drives over the bridge in both directions (`moving_load`), from on to off in steps
    of 1/100 of the bridge's length, or 1/20 with a plastic fill. Its axles spread through a fill
    along the bridge; across it they spread evenly over `width`. The distributed load of its code
    grows with them, where it is adverse (`moving_load`). The geometric factor of safety is
    Heyman's: all joints are narrowed about their middles, at unchanged weights and with the vehicle
    at its worst place, until it is carried no longer; or deepened until it is carried.

    Args:
        structure: the bridge, or an `archfem.Analysis` of it.
        vehicle: one of `archfem.limit.VEHICLES` by its name, or one's own.
        live: partial factor on its weight [-]; by default that of its code.
        impact: dynamic factor on its weight [-]; by default that of its code, but 1 for LM71, whose
            factor depends on the span.
        dead: partial factor on the weights of stones and fill [-]; by default 1, as for weights
            that stabilise. Weights on one side alone are not increased.
        width: width over which one vehicle spreads [m]; by default that of the wheels and of the
            least depth of fill above the rings, at most a lane (`Vehicle.spread_over`).
        area_load: distributed load beside and below the axles [Pa]; by default that of its code.
            Where less of it or a larger width is given, `by_rule` is the factor without.
        friction: as for `collapse_factor`; the geometric factor takes "coulomb" for
            "nonassociated".
        strength: as for `collapse_factor`, divided by its partial factor [Pa].
        fill: as for `collapse_factor`.

    Returns:
        Factor, worst place, its mechanism, and the factors at all places.

    Raises:
        InvalidInput: the vehicle is unknown, a factor or the width is out of range, or as for
            `moving_load`.
        DidNotConverge: the solver of linear programmes gave up.

    References:
        Heyman, The Masonry Arch, Ellis Horwood (1982).
    """
    structure, driven = structure_of(structure), _find_vehicle(vehicle)
    live = driven.live if live is None else _check_factor(live, "live, factor on the vehicle")
    impact = driven.impact if impact is None else _check_factor(impact, "impact, dynamic factor")
    _check_factor(dead, "dead, factor on the weights")
    rule = driven.spread_over(structure)
    width = rule if width is None else width
    area_load = driven.area_load if area_load is None else area_load
    if not 0.0 < width <= structure.width:
        raise InvalidInput(
            f"width {width:.4g} m is not above 0 and up to that of the bridge, "
            f"{structure.width:.4g} m: give the part over which one vehicle spreads"
        )
    weighted, code = _scale_weights(structure, dead), np.array(driven.axles) * live * impact
    options: dict[str, Any] = {"friction": friction, "strength": strength, "fill": fill}

    def drive(width: float, area_load: float, positions: Sequence[float]) -> MovingLoad:
        # the structure is modelled over its whole width, of which a vehicle loads a part
        axles = (structure.width / width * code).tolist()
        given = options | {"spacings": driven.spacings, "area_load": live * area_load}
        return moving_load(weighted, axles, positions=positions, **given)

    is_plastic = isinstance(fill, PlasticFill)
    positions = _places_along(weighted, _parse_axles(driven.axles, driven.spacings))
    moving = drive(width, area_load, positions[::5] if is_plastic else positions)
    by_rule = np.nan
    if width > (1.0 + 1e-9) * rule or area_load < driven.area_load:
        least = min(width, rule), max(area_load, driven.area_load)
        by_rule = drive(*least, [moving.position]).worst.factor
    geometric = np.nan if is_plastic else _geometric_factor(weighted, moving, options)
    factors = live, impact, dead, width, area_load, strength
    return Rating(structure, driven, *factors, moving, geometric, by_rule)


def _find_vehicle(vehicle: str | Vehicle) -> Vehicle:
    """Return a vehicle of the library by its name, or the given one."""
    if isinstance(vehicle, Vehicle):
        return vehicle
    known = {name.lower(): each for name, each in VEHICLES.items()}
    if vehicle.lower() not in known:
        raise InvalidInput(
            f"vehicle {vehicle!r} is not known: use one of {', '.join(VEHICLES)}, or give your own "
            "as af.limit.Vehicle(name, axles, spacings)"
        )
    return known[vehicle.lower()]


def _check_factor(value: float, name: str) -> float:
    """Return a partial factor, which must be a plausible one."""
    return check_number(value, f"{name} [-]", minimum=0.1, maximum=10.0)


def _scale_weights(structure: Structure, factor: float) -> Structure:
    """Return a structure whose blocks weigh a multiple."""
    if factor == 1.0:
        return structure
    blocks = []
    for block in structure.blocks:
        material = replace(block.material, unit_weight=factor * block.material.unit_weight)
        blocks.append(replace(block, material=material))
    return replace(structure, blocks=tuple(blocks))


def _places_along(structure: Structure, vehicle: Array, steps: int = 100) -> Sequence[float]:
    """Return places from where the vehicle drives onto the structure to where it leaves [m]."""
    ends = _vehicle_positions(structure, vehicle, None, 2)
    length = float(np.ptp(ends)) - 2.0 * float(vehicle[0, 1])
    count = 1 + int(np.ceil(steps * float(np.ptp(ends)) / length))
    return tuple(np.linspace(ends[0], ends[1], count).tolist())


def _geometric_factor(
    structure: Structure, moving: MovingLoad, options: dict[str, Any], tolerance: float = 1e-4
) -> float:
    """Return the depth of joints over the least one that carries the worst row of axles [-]."""
    stones, dead = self_weight_programme(structure, **options)
    axles = stones.load([load for load in moving.worst.live if isinstance(load, PointLoad)])

    def is_carried(share: float) -> bool:
        blocks = DeepenedBlocks(dead.blocks.structure, share)
        crushing = None if dead.crushing is None else share * dead.crushing
        changed = replace(dead, blocks=blocks, cohesion=share * dead.cohesion, crushing=crushing)
        if not is_balanced(changed.minimise_residual(), changed):
            return False
        optimum = changed.with_load_factor(axles).solve()
        return optimum is None or -optimum.value >= 1.0

    # what narrower joints carry wider ones carry, so that halving finds the least
    low, high = 0.0, 1.0
    while not moving.worst.factor >= 1.0 and not is_carried(high):
        low, high = high, 2.0 * high
        if high > 1e3:  # no depth helps
            return np.nan
    while high - low > tolerance * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if is_carried(middle) else (middle, high)
        if high < tolerance:
            return np.inf
    return 1.0 / high


def _parse_axles(axles: float | Sequence[float], spacings: Sequence[float]) -> Array:
    """Return the weight of each axle, and its place before the middle (n_axles, 2) [N, m]."""
    weights = np.array(check_numbers([axles] if isinstance(axles, Real) else axles, "axles [N]"))
    gaps = np.array(check_numbers(spacings, "spacings [m]"))
    if not len(weights) or (weights <= 0.0).any() or (gaps <= 0.0).any():
        raise InvalidInput(
            f"axles {weights.tolist()} N with spacings {gaps.tolist()} m: give weights and "
            "spacings above 0, and at least one axle"
        )
    if len(gaps) != len(weights) - 1:
        raise InvalidInput(
            f"{len(weights)} axles and {len(gaps)} spacings: give one between each two axles, "
            "as in spacings = [1.3] m"
        )
    behind = np.concatenate([[0.0], np.cumsum(gaps)])
    return np.stack([weights, behind[-1] / 2.0 - behind], axis=1)


def _vehicle_positions(
    structure: Structure, vehicle: Array, positions: Sequence[float] | None, count: int = 101
) -> Array:
    """Return the positions of the vehicle's middle (n,) [m]."""
    if positions is not None:
        places = np.array(check_numbers(positions, "positions [m]"))
        if not len(places):
            raise InvalidInput("positions has none: give some, or leave it out")
        return places
    points = np.concatenate([structure.blocks[number].drawn() for number in structure.free])
    half = float(vehicle[0, 1])
    low, high = float(points[:, 0].min()), float(points[:, 0].max())
    return np.linspace(low - half, high + half, count)


def _axles_on_structure(
    structure: Structure, vehicle: Array, direction: str, position: float
) -> AxleRow:
    """Return the axles that stand on the structure, from left to right."""
    sense = 1.0 if direction == "right" else -1.0
    axles = sorted((position + sense * ahead, weight) for weight, ahead in vehicle.tolist())
    # blocks below or above an axle have corners on both sides of it
    corners = [structure.blocks[number].points[:, 0] for number in structure.free]
    return tuple(
        PointLoad(x, (0.0, -weight))
        for x, weight in axles
        if any(np.ptp(np.sign(places - x)) > 0 for places in corners)
    )


def _cut_road(structure: Structure, area_load: float, count: int = 40) -> AxleRow:
    """Return a distributed load as a point load on each of some strips of the road."""
    points = np.concatenate([structure.blocks[number].drawn() for number in structure.free])
    edges = np.linspace(points[:, 0].min(), points[:, 0].max(), count + 1)
    weight = area_load * structure.width * float(edges[1] - edges[0])
    strips = [
        _axles_on_structure(structure, np.array([[weight, 0.0]]), "right", x)
        for x in (0.5 * (edges[:-1] + edges[1:])).tolist()
    ]
    return tuple(load for strip in strips for load in strip) if area_load else ()


def _solve_rows(
    structure: Structure, rows: Sequence[AxleRow], strips: AxleRow, options: dict[str, Any]
) -> tuple[dict[AxleRow, AxleRow], dict[AxleRow, float]]:
    """Return each row of axles with the adverse strips, and its collapse factor."""
    laid, fill = {row: row for row in rows}, options["fill"]
    if is_plastic := isinstance(fill, PlasticFill):
        keys = ("friction_angle", "cohesion", "spread", "backing")
        fill = Fill(**{key: getattr(fill, key) for key in keys})
    if not is_plastic or strips:
        stones, dead = self_weight_programme(structure, **(options | {"fill": fill}))
        stands = is_balanced(dead.minimise_residual(), dead)
        loads = {row: stones.load(row) for row in rows}
        if strips and stands:
            laid, loads = _lay_strips(dead, loads, strips, [stones.load([s]) for s in strips])
    if not is_plastic:
        factors = _collapse_factors(stones, dead, loads, options) if stands else {}
        return laid, {row: factors.get(laid[row], np.nan) for row in rows}
    if strips:
        logger.warning(
            "the distributed load stands where it is adverse to the stones with the fill as "
            "pressure, %s: other parts may be worse with a plastic fill",
            "af.limit.Fill" if stands else "but these do not stand so, and it is left out",
        )
    factors = _bound_factors(structure, tuple(laid.values()), options)
    return laid, {row: factors[laid[row]] for row in rows}


def _lay_strips(
    dead: Programme,
    axles: dict[AxleRow, Array],
    strips: AxleRow,
    forces: Sequence[Array],
    rounds: int = 20,
) -> tuple[dict[AxleRow, AxleRow], dict[AxleRow, Array]]:
    """Return each row of axles with the strips of the least factor, and the forces of all."""
    # A mechanism bounds the factor of any load from above: by its resistance over the power of the
    # axles, and of the strips that sink in it (kinematic theorem). At each place the best one so
    # far selects the strips; the mechanism of these is added, until none is better. The first ones
    # are of the distributed load alone, on stretches of the road: else a search may end early.
    road, motions, resistances = np.array(forces), list[Array](), list[float]()
    powers = np.array([dead.blocks.dimensionless(force) for force in road])

    def solve(load: Array) -> float:
        optimum = dead.with_load_factor(load).solve() if load.any() else None
        if optimum is None:
            return np.inf
        motions.append(optimum.multipliers)
        resistances.append(-optimum.value)  # at a power of 1
        return -optimum.value

    for size in (len(road) // 8, len(road) // 4, len(road) // 2):
        for first in range(0, len(road) - size + 1, max(size // 2, 1)):
            solve(road[first : first + size].sum(axis=0))
    chosen = {row: (solve(load), np.zeros(len(road), dtype=bool)) for row, load in axles.items()}
    for row in (*axles, *reversed(axles)):  # and back with the mechanisms of all places
        load = dead.blocks.dimensionless(axles[row])
        for _ in range(rounds if motions else 0):
            sinks = powers @ np.array(motions).T
            power = load @ np.array(motions).T + np.maximum(sinks, 0.0).sum(axis=0)
            bounds = np.array(resistances) / np.maximum(power, 1e-300)
            best = int(bounds.argmin())
            if bounds[best] >= (1.0 - 1e-5) * chosen[row][0]:  # crushing has endless mechanisms
                break
            adverse = sinks[:, best] > 1e-9 * sinks[:, best].max()
            chosen[row] = solve(axles[row] + road[adverse].sum(axis=0)), adverse
    laid = {row: (*row, *np.array(strips, dtype=object)[chosen[row][1]]) for row in axles}
    return laid, {laid[row]: axles[row] + road[chosen[row][1]].sum(axis=0) for row in axles}


def _collapse_factors(
    stones: BlocksWithFill, dead: Programme, loads: dict[AxleRow, Array], options: dict[str, Any]
) -> dict[AxleRow, float]:
    """Return the collapse factor of each row of axles; a full search only where it is needed."""
    factors = dict.fromkeys(loads, np.inf)
    # rows whose load reaches the stones, beyond round-off of the fan
    programmes = {
        row: dead.with_load_factor(load)
        for row, load in loads.items()
        if np.abs(load).max() > 1e-9 * -sum(axle.force[1] for axle in row)
    }
    associated = {row: programme.solve() for row, programme in programmes.items()}
    searched = options["friction"] == "nonassociated"
    states = _search_nonassociated(programmes, associated) if searched else associated
    for row, state in states.items():
        if state is not None:
            factors[row] = -state.value
        elif associated[row] is not None:  # the whole search, or a bound
            factors[row] = collapse_factor(stones.whole, live=list(row), **options).factor
    if np.inf in factors.values():
        warn_locking(stones.whole, options["friction"])
    return factors


def _bound_factors(
    structure: Structure, rows: Sequence[AxleRow], options: dict[str, Any]
) -> dict[AxleRow, float]:
    """Return the lower bound of each row of axles with a plastic fill."""
    shown = tqdm(rows, unit="place", disable=None, leave=False)
    return {
        row: collapse_factor(structure, live=list(row), **options).lower if row else np.inf
        for row in shown
    }


def _search_nonassociated(
    programmes: dict[AxleRow, Programme], associated: dict[AxleRow, Optimum | None]
) -> dict[AxleRow, Optimum | None]:
    """Find the state of least factor without dilatancy at each place, started from neighbours."""
    # Forwards from the associated optimum, two random states and the solution of the place
    # before; then backwards once more from the solution of the place behind.
    states: dict[AxleRow, Optimum | None] = dict.fromkeys(programmes)
    for backwards in (False, True):
        neighbour: list[Array] = []
        for seed, row in enumerate(reversed(programmes) if backwards else programmes):
            programme, weakest = programmes[row], states[row]
            starts = list(neighbour)
            if not backwards:
                starts += starting_forces(programme, associated[row], 2, seed)
            state = find_weakest(programme, starts)
            if weakest is None or (state is not None and state.value > weakest.value):
                states[row] = weakest = state
            neighbour = [] if weakest is None else [weakest.forces]
    return states


def _find_worst(factors: Array, count: Numbers) -> tuple[int, int]:
    """Return direction and position of the least factor; if none is finite, of the most axles."""
    finite, flat = np.isfinite(factors), count.argmax()
    if finite.any():
        # of places that differ by round-off, as on a symmetric bridge, the first
        flat = (factors <= (1.0 + 1e-6) * factors[finite].min()).argmax()
    direction, place = np.unravel_index(flat, factors.shape)
    return int(direction), int(place)


VEHICLES: Mapping[str, Vehicle] = _read_vehicles()
