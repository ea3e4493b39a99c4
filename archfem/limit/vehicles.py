"""Vehicles over a bridge: collapse factor at every position of a row of axles, and its rating."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from archfem._display import ProgressReport, ResultDisplay, track_progress
from archfem._typing import Array, Flags, Metres, Newtons, Numbers, Pascals
from archfem._validation import check_choice, check_number, check_numbers
from archfem.errors import InvalidInput, logger
from archfem.limit.backfill import BlocksWithFill
from archfem.limit.collapse import Collapse, read_bounds, solve_as_given
from archfem.limit.collapse_warnings import warn_locking
from archfem.limit.fill_bounds import FillBounds, bound_least_factor, refine_bounds
from archfem.limit.fill_strength import Fill, PlasticFill, as_pressure
from archfem.limit.linear_programme import Optimum, Programme
from archfem.limit.nonassociated import find_weakest, starting_forces
from archfem.limit.self_weight import is_balanced, refuse_bonds, self_weight_programme
from archfem.masonry.loads import Action, PointLoad
from archfem.masonry.standing import find_bodies, is_light, parse_axles
from archfem.masonry.structure import (
    CONTACT_TOLERANCE,
    HasStructure,
    Structure,
    find_clear_spans,
    structure_of,
)

DRIVING_DIRECTIONS = ("right", "left")

# Least load on a road [Pa], below which it is in kPa
MIN_AREA_LOAD = 100.0

# Least weight of parapets along a bridge [N/m]: less is a mistake of units
MIN_PARAPETS = 100.0

# Largest spacing of axles and width of wheels [m], above which they are in mm
MAX_LENGTH = 100.0


# Partial and dynamic factor on a lorry of one's own [-] by EN 1990 and EN 1991-2, annex B, and by
# CS 458 (from memory)
CODE_FACTORS: Mapping[str, tuple[float, float]] = {
    "by Eurocodes on a good road": (1.35, 1.2),
    "by Eurocodes on a fair road": (1.35, 1.4),
    "alone at walking pace": (1.1, 1.0),
}

# Name of the factors of CS454-single on a lorry of one's own
BY_CS454 = "by CS 454 (1.9, and 1.8 on the worst axle, from memory)"

# Axles that stand on the structure, from left to right, or these and a distributed load
AxleRow = tuple[PointLoad, ...]


@dataclass(frozen=True)
class Vehicle:
    """A vehicle of a code, or one's own.

    Attributes:
        name: name in tables and pictures.
        axles: weight of each axle, from the front [N].
        spacings: distances between the axles, one fewer [m].
        live: partial factor of the code on its weight [-]; None where it is not given, and 1.
        source: code and clause of the axles, and the part of the code's load that is left out.
        grade: "read" where weights and spacings were read in the code's table or in a text that
            quotes it, "from memory" otherwise.
        live_source: code and clause of the partial factor, and its grade.
        impact: dynamic factor of the code on its weight [-]; None likewise.
        impact_source: code and clause of the dynamic factor, and its grade.
        impact_on: "all axles" that the dynamic factor multiplies; or "worst axle", that one alone
            with which the factor at collapse is least, as in BD 21.
        area_load: load of the code on the road beside and below the axles, wherever it is adverse,
            without the dynamic factor [Pa].
        wheels: width between the outer faces of the wheels, at the road [m].
        lane: width of a lane, beyond which a vehicle does not spread [m].
        width_source: code and clause of wheels and lane, and their grade.
        left_out: part of the code's load that acts at the same time and is left out; else empty.
    """

    name: str
    axles: tuple[Newtons, ...]
    spacings: tuple[Metres, ...] = ()
    live: float | None = None
    source: str = "given"
    grade: str = "given"
    live_source: str = "given"
    impact: float | None = None
    impact_source: str = "given"
    area_load: Pascals = 0.0
    wheels: Metres = 1.5
    lane: Metres = 3.0
    width_source: str = "as a single axle of CS 454, and a lane of EN 1991-2, 4.2.3; from memory"
    left_out: str = ""
    impact_on: str = "all axles"

    def __post_init__(self) -> None:
        """Refuse weights, spacings and factors out of range."""
        parse_axles(self.axles, self.spacings)
        check_choice(self.impact_on, f"impact_on of {self.name}", ("all axles", "worst axle"))
        for key in ("area_load", "wheels", "lane"):
            check_number(getattr(self, key), f"{key} of {self.name}", minimum=0.0)
        longest = max([*self.spacings, self.wheels])
        weak = 0.0 < self.area_load < MIN_AREA_LOAD
        if is_light(self.axles) or weak or longest > MAX_LENGTH:
            raise InvalidInput(
                f"vehicle '{self.name}' has axles of {self.axles} N, spacings of {self.spacings} "
                f"m, wheels over {self.wheels:g} m and {self.area_load} Pa: that can only be a "
                "wrong unit"
            )
        check_factor(self.factors[0], f"partial factor on the live load of {self.name}")
        check_factor(self.factors[1], f"dynamic factor of {self.name}")

    @property
    def factors(self) -> tuple[float, float]:
        """Partial and dynamic factor on its weight [-], 1 where one is not given."""
        return 1.0 if self.live is None else self.live, 1.0 if self.impact is None else self.impact

    def choose_factors(
        self, live: float | None, impact: float | None
    ) -> tuple[float, float, tuple[str, ...]]:
        """Return both factors [-], those given or its own, and the names of those nobody gives.

        Args:
            live: partial factor that is given [-], or None.
            impact: dynamic factor that is given [-], or None.
        """
        given = {"live": live, "impact": impact}
        missing = tuple(k for k, x in given.items() if x is None and getattr(self, k) is None)
        own = self.factors
        live = own[0] if live is None else check_factor(live, "live, factor on the vehicle")
        impact = own[1] if impact is None else check_factor(impact, "impact, dynamic factor")
        return live, impact, missing

    def factored(self, live: float, impact: float) -> list[Array]:
        """Return weights with both factors [N]: a row, or one for each axle that has the impact.

        Mirrored rows count once, as vehicles are driven in both directions.

        Args:
            live: partial factor [-].
            impact: dynamic factor [-].
        """
        weights = live * np.array(self.axles)
        if self.impact_on == "all axles" or impact == 1.0:
            return [impact * weights]
        kept = dict[Any, Array]()
        for row in weights * (1.0 + (impact - 1.0) * np.eye(len(weights))):
            behind = tuple(row.tolist())
            ways = (behind, self.spacings), (behind[::-1], self.spacings[::-1])
            kept.setdefault(min(ways), row)
        return [*kept.values()]

    def list_products(
        self, structure: Structure, live: float, missing: Sequence[str]
    ) -> dict[str, float]:
        """Return partial times dynamic factor of codes on one's own vehicle, or by the span.

        Args:
            structure: the bridge.
            live: partial factor [-].
            missing: names of the factors that nobody gave.
        """
        if self.grade == "given":
            codes = CODE_FACTORS.items()
            products = {f"{k} ({a:g} × {b:g}, from memory)": a * b for k, (a, b) in codes}
            one = len(self.axles) == 1
            return products | ({BY_CS454: prod(VEHICLES["CS454-single"].factors)} if one else {})
        spans = [high - low for low, high in find_clear_spans(structure).values()]
        if "impact" not in missing or not spans:
            return {}
        half = 0.5 * min(spans)
        impact = float(np.clip(1.44 / (np.sqrt(half) - 0.2) + 0.82, 1.0, 1.67))
        return {
            f"with impact {impact:.3g} (by half the span, {half:.3g} m; from memory)": live * impact
        }

    def spread_over(self, structure: Structure) -> float:
        """Return the width over which one vehicle spreads on a bridge, by rule [m].

        It is the width of the wheels and, at 1 in 2 to both sides, the least depth of fill above
        the rings; at most that of a lane, and of the bridge.

        Args:
            structure: the bridge.
        """
        ring = [block for block in structure.blocks if block.role == "ring"]
        points = np.concatenate([block.drawn() for block in ring] or [np.zeros((0, 2))])
        # a corner at the end of the fill misses it by rounding, and does not a micrometre aside
        tops = [
            [block.top(x + aside) for block in structure.blocks for aside in (-1e-6, 0.0, 1e-6)]
            for x in points[:, 0].tolist()
        ]
        covers = [
            max(top for top in above if top is not None) - y
            for above, y in zip(tops, points[:, 1], strict=True)
        ]
        depth = max(min(covers, default=0.0), 0.0)
        return min(self.wheels + depth, self.lane, structure.width)

    def describe_width(self, structure: Structure, width: float) -> str:
        """Describe the parts of a width that carries one vehicle.

        Args:
            structure: the bridge.
            width: that carries the vehicle [m].
        """
        if width != self.spread_over(structure):
            return f"over {width:.3g} m of width (given)"
        fill = width - self.wheels
        words = f"{self.wheels:g} m over the wheels and {fill:.3g} m of fill above the crown"
        if width >= min(self.lane, structure.width):
            words = "all of the bridge" if width < self.lane else "all of a lane"
        words += f", never more than a lane of {self.lane:g} m"
        return f"over {width:.3g} m of width: {words} ({self.width_source})"


def _read_vehicles() -> dict[str, Vehicle]:
    """Return the vehicles of codes, with the properties that those of a code share."""
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
        factors: over direction ("right", "left") and position of the vehicle's middle [m].
            `factor`: multiple of the vehicle's weight at collapse [-]; `axles`: number of its axles
            on the structure; `loaded`: length of road under a distributed load [m].
        worst: collapse with the least factor.
        direction: driving direction of the vehicle there.
        position: x of its middle there [m].

    The least factor of each direction is `factors.factor.min("position")`, and its place
    `factors.factor.idxmin("position")`.
    """

    factors: xr.Dataset
    worst: Collapse
    direction: str
    position: float

    @classmethod
    def least_of(cls, each: Sequence["MovingLoad"]) -> "MovingLoad":
        """Return the worst of some loads, with the least factors of all at each place.

        Args:
            each: loads at the same places.
        """
        worst = min(each, key=lambda moving: moving.worst.factor)
        least = xr.concat([moving.factors["factor"] for moving in each], "load").min("load")
        least = least.assign_attrs(worst.factors["factor"].attrs)
        return replace(worst, factors=worst.factors.assign(factor=least))

    def joined(self, other: "MovingLoad") -> "MovingLoad":
        """Return the load at these and other places, with the worse of both collapses.

        Args:
            other: the same load at other places.
        """
        everywhere = xr.concat([self.factors, other.factors], "position").sortby("position")
        everywhere = everywhere.drop_duplicates("position")
        worse = min(self, other, key=lambda each: each.worst.factor)
        return replace(worse, factors=everywhere)

    def factors_at(self, places: Sequence[float]) -> Array:
        """Return the factors at some places (2 n,) [-], driving right and left, interpolated.

        Args:
            places: x of the vehicle's middle (n,) [m].
        """
        known = self.factors["factor"].clip(max=1e9)  # infinite ones interpolate to no number
        ways = [known.sel(direction=way) for way in DRIVING_DIRECTIONS]
        return np.concatenate([np.interp(places, known["position"], way) for way in ways])

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


def moving_load(  # noqa: PLR0913  (loads, their places, and the strength of the bridge)
    structure: Structure | HasStructure,
    axles: float | Sequence[float],
    *,
    spacings: Sequence[float] = (),
    positions: Sequence[float] | None = None,
    area_load: float = 0.0,
    friction: str | None = "coulomb",
    strength: float | None = None,
    fill: Fill | PlasticFill | None = None,
    dead: Sequence[Action] = (),
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
            default from where it drives onto the structure to where it is off it again. Steps are
            1/100 of the structure's length, or 1/20 with a plastic fill. `rate` also searches
            places between these, so that its factor may be less.
        area_load: distributed load beside and below the axles, where it is adverse [Pa]. With a
            plastic fill that is found with the fill as `Fill`, and a warning says so.
        friction: as for `collapse_factor`.
        strength: as for `collapse_factor` [Pa].
        fill: as for `collapse_factor`, and as given alone: `rate` has the range over it. With a
            plastic fill factors are lower bounds, the least one on meshes as fine as its `gap`
            requires, others on coarser ones; Ctrl-C ends that refinement.
        dead: loads beside self-weight that do not grow, as for `collapse_factor`.

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
    vehicle, steps = parse_axles(axles, spacings), 20 if isinstance(fill, PlasticFill) else 100
    places = vehicle_positions(structure, vehicle, positions, steps)
    rows = [
        [axles_on_structure(structure, vehicle, direction, x) for x in places]
        for direction in DRIVING_DIRECTIONS
    ]
    on_bridge = np.array([[len(row) for row in rows_one_way] for rows_one_way in rows])
    if not on_bridge.any():
        raise InvalidInput(
            f"the vehicle is nowhere on the structure: positions are from {places.min():.4g} to "
            f"{places.max():.4g} m; move them onto it"
        )
    options = dict[str, Any](friction=friction, strength=strength, fill=fill, dead=dead)
    distinct = tuple(dict.fromkeys((*rows[0], *rows[1])))
    strips = cut_road(structure, check_area_load(area_load))
    laid, factor_of, bounds = _solve_rows(structure, distinct, strips, options)
    factors = np.array([[factor_of[row] for row in rows_one_way] for rows_one_way in rows])
    direction, place = _find_worst(factors, on_bridge)
    row = rows[direction][place]
    if row in bounds:
        worst = read_bounds(structure, bounds[row], friction)
        worst = replace(worst, live=laid[row], structure=structure)
    else:
        worst = solve_as_given(structure, live=list(laid[row]), **options)
        worst = replace(worst, factor=worst.lower)  # where none was found, the bound
    if friction == "nonassociated":
        factors[direction, place] = worst.factor  # by the whole search: may be a weaker state
    length = area_load and -strips[0].force[1] / (area_load * structure.width)  # of a strip
    loaded = [[length * (len(laid[row]) - len(row)) for row in one_way] for one_way in rows]
    dataset = _tabulate_places(places, factors, on_bridge, loaded)
    moving = MovingLoad(dataset, worst, DRIVING_DIRECTIONS[direction], float(places[place]))
    if positions is None and fill is None and (ends := places_at_ends(structure, vehicle, moving)):
        given = options | {"spacings": spacings, "area_load": area_load}
        return moving.joined(moving_load(structure, axles, positions=ends, **given))
    return moving


def _tabulate_places(places: Array, factors: Array, axles: Numbers, loaded: Any) -> xr.Dataset:
    """Return factors, axles and loaded lengths over direction and place, each with its unit."""
    dims = ("direction", "position")
    variables = {
        "factor": (dims, factors, {"units": "1", "long_name": "factor at collapse"}),
        "axles": (dims, axles, {"units": "1", "long_name": "axles on the structure"}),
        "loaded": (dims, loaded, {"units": "m", "long_name": "road under the distributed load"}),
    }
    position = ("position", places, {"units": "m"})
    return xr.Dataset(variables, {"direction": list(DRIVING_DIRECTIONS), "position": position})


def check_factor(value: float, name: str) -> float:
    """Return a partial factor, which must be a plausible one."""
    return check_number(value, f"{name} [-]", minimum=0.1, maximum=10.0)


def vehicle_positions(
    structure: Structure, vehicle: Array, positions: Sequence[float] | None, steps: int = 100
) -> Array:
    """Return the positions of the vehicle's middle (n,) [m].

    By default they are from where it drives onto the structure to where it leaves, in steps of a
    share of the structure's length.
    """
    if bodies := find_bodies(structure):
        raise InvalidInput(
            f"axles would drive over '{bodies[0]}', which stands on the structure: take it off, in "
            'a case by a file with base = "…" and remove = ["structure.standing"]'
        )
    if positions is not None:
        places = np.array(check_numbers(positions, "positions [m]"))
        if not len(places):
            raise InvalidInput("positions has none: give some, or leave it out")
        return places
    points = np.concatenate([structure.blocks[number].drawn() for number in structure.free])
    half = float(vehicle[0, 1])
    low, high = float(points[:, 0].min()), float(points[:, 0].max())
    count = 1 + int(np.ceil(steps * (high - low + 2.0 * half) / (high - low)))
    return np.linspace(low - half, high + half, count)


def axles_on_structure(
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


def axles_on_rings(
    structure: Structure,
    vehicle: Array,
    direction: str,
    position: float,
    fill: Fill | PlasticFill | None,
) -> list[float]:
    """Return the places of the axles that load a ring, or any stone where there is none [m]."""
    stones, _ = self_weight_programme(structure, None, np.inf, as_pressure(fill))
    free = stones.rigid_regions.structure
    rings = np.array([free.blocks[number].role == "ring" for number in free.free])
    rings |= not rings.any()
    return [
        load.x
        for load in axles_on_structure(structure, vehicle, direction, position)
        if np.abs(stones.load([load]).reshape(-1, 3)[rings]).max() > 1e-9 * -load.force[1]
    ]


def check_area_load(area_load: float) -> float:
    """Return a distributed load that can be in Pa, or refuse it."""
    check_number(area_load, "area_load [Pa]", minimum=0.0)
    if 0.0 < area_load < MIN_AREA_LOAD:
        raise InvalidInput(
            f"area_load {area_load:g} Pa looks like kPa: give it in Pa, 9 kPa is 9e3"
        )
    return area_load


def cut_road(structure: Structure, area_load: float, count: int = 40) -> AxleRow:
    """Return a distributed load as a point load on each of some strips of the road."""
    points = np.concatenate([structure.blocks[number].drawn() for number in structure.free])
    edges = np.linspace(points[:, 0].min(), points[:, 0].max(), count + 1)
    weight = area_load * structure.width * float(edges[1] - edges[0])
    strips = [
        axles_on_structure(structure, np.array([[weight, 0.0]]), "right", x)
        for x in (0.5 * (edges[:-1] + edges[1:])).tolist()
    ]
    return tuple(load for strip in strips for load in strip) if area_load else ()


def lay_parapets(structure: Structure, weight: float) -> AxleRow:
    """Return the weight of parapets along a bridge as loads on 100 strips of the road [N/m]."""
    if 0.0 < check_number(weight, "parapets [N/m]", minimum=0.0) < MIN_PARAPETS:
        raise InvalidInput(
            f"parapets {weight:g} N/m look like kN/m: give them in N/m, or as '{weight:g} kN/m'"
        )
    return cut_road(structure, weight / structure.width, 100)


def _solve_rows(
    structure: Structure, rows: Sequence[AxleRow], strips: AxleRow, options: dict[str, Any]
) -> tuple[dict[AxleRow, AxleRow], dict[AxleRow, float], dict[AxleRow, FillBounds]]:
    """Return each row of axles with the adverse strips, its factor and its bounds."""
    laid, is_plastic = {row: row for row in rows}, isinstance(options["fill"], PlasticFill)
    if not is_plastic or strips:
        pressed = options | {"fill": as_pressure(options["fill"])}
        stones, dead = self_weight_programme(structure, **pressed)
        stands = is_balanced(dead.minimise_residual(), dead)
        loads = {row: stones.load(row) for row in rows}
        if strips and stands:
            pairs = _lay_strips(dead, loads, {strip: stones.load([strip]) for strip in strips})
            laid, loads = {row: pair[0] for row, pair in pairs.items()}, dict(pairs.values())
    if not is_plastic:
        factors = collapse_factors(stones, dead, loads, options) if stands else {}
        return laid, {row: factors.get(laid[row], np.nan) for row in rows}, {}
    if strips:
        logger.warning(
            "the distributed load stands where it is adverse to the stones with the fill as "
            "pressure, %s: other parts may be worse with a plastic fill",
            "af.limit.Fill" if stands else "but these do not stand so, and it is left out",
        )
    searches = {
        row: refine_bounds(structure, list(laid[row]), **options) for row in rows if laid[row]
    }
    bounds = bound_least_factor(searches)
    factors = {row: bounds[row].lower if row in bounds else np.inf for row in rows}
    return laid, factors, bounds


class _RoadMechanisms:
    """Mechanisms under loads on a road, which bound the factor of any other load from above.

    By the kinematic theorem the bound is the resistance of a mechanism over a power: that of the
    axles, and of the strips of a distributed load that sink in it.
    """

    def __init__(self, dead: Programme, strips: Mapping[PointLoad, Array]) -> None:
        self._dead, self._strips = dead, np.array([*strips])
        self.road = np.array([*strips.values()]).reshape(len(strips), len(dead.load))
        self._before: Optimum | None = None
        self._motions, self._resistances = np.zeros((0, len(dead.load))), np.zeros(0)  # power of 1
        # the first ones are of the distributed load alone, on stretches: else a search ends early
        for size in (len(strips) // 8, len(strips) // 4, len(strips) // 2):
            for first in range(0, len(strips) - size + 1, max(size // 2, 1)):
                self.solve(self.road[first : first + size].sum(axis=0))

    def solve(self, load: Array) -> float:
        """Return the factor of a load, infinite without any, and keep its mechanism."""
        # cuts at the thrusts of the load before leave few to add
        dead = self._dead.with_cuts_at(self._before)
        optimum = dead.with_load_factor(load).solve(forces=False) if load.any() else None
        if optimum is None:
            return np.inf
        self._before = optimum
        self._motions = np.vstack([self._motions, optimum.multipliers])
        self._resistances = np.append(self._resistances, -optimum.value)
        return -optimum.value

    def bound(self, loads: Array) -> tuple[Array, Flags]:
        """Return the least bound of each load (n, 3 n_free), and which strips are adverse to it."""
        scale, motions = self._dead.blocks.dimensionless, self._motions.T
        sinks = scale(self.road) @ motions
        power = scale(loads) @ motions + np.maximum(sinks, 0.0).sum(axis=0)
        bounds = self._resistances / np.maximum(power, 1e-100)
        if not bounds.shape[1]:
            return np.full(len(loads), np.inf), np.zeros((len(loads), len(self.road)), dtype=bool)
        best = bounds.argmin(axis=1)
        adverse = sinks > 1e-9 * sinks.max(axis=0, initial=0.0)
        return bounds.min(axis=1), adverse.T[best]

    def lay(self, axles: Array, factor: float, adverse: Flags | None, rounds: int = 20) -> Any:
        """Return the least factor of axles found with sets of adverse strips, and this set.

        The factor is that with the given set, or infinite without any.
        """
        for _ in range(rounds):
            bounds, other = self.bound(axles[None])
            if not bounds[0] < (1.0 - 1e-5) * factor:  # crushing has endless mechanisms
                break
            # the factor is that of this set: what is below it is round-off
            if adverse is not None and (other[0] == adverse).all():
                break
            adverse = other[0]
            factor = self.solve(axles + self.road[adverse].sum(axis=0))
        return factor, adverse

    def join(self, row: AxleRow, axles: Array, adverse: Flags) -> tuple[AxleRow, Array]:
        """Return a row of axles with the strips that are adverse to it, and the forces of all."""
        return (*row, *self._strips[adverse]), axles + self.road[adverse].sum(axis=0)


def _lay_strips(
    dead: Programme, axles: dict[AxleRow, Array], strips: Mapping[PointLoad, Array]
) -> dict[AxleRow, tuple[AxleRow, Array]]:
    """Return each row of axles with the strips of the least factor, and the forces of all."""
    # At each place the best mechanism so far selects the strips; that of these is added, until none
    # is better.
    known, bare = _RoadMechanisms(dead, strips), np.zeros(len(strips), dtype=bool)
    places = track_progress("places", axles)
    chosen = {row: (known.solve(axles[row]), bare) for row in places}
    # and back with the mechanisms of all places
    for row in track_progress("places with distributed load", (*axles, *reversed(axles))):
        chosen[row] = known.lay(axles[row], *chosen[row])
    return {row: known.join(row, axles[row], chosen[row][1]) for row in axles}


def find_worst_rows(
    dead: Programme, axles: dict[AxleRow, Array], strips: Mapping[PointLoad, Array], guide: Array
) -> tuple[dict[AxleRow, Array], Array]:
    """Return the solved rows, the least factor first, with adverse strips, and the next guide.

    The guide has the factor of each row in another state, in whose order rows are solved, or zeros:
    then all are. Factors of a weaker state are bounds from below, which end the search exactly.
    Those of a stronger state are scaled by the least share of them so far, less a margin.
    """
    known, rows, loads = _RoadMechanisms(dead, strips), [*axles], np.array([*axles.values()])
    factors, sets = np.full(len(rows), np.inf), np.zeros((len(rows), len(strips)), dtype=bool)
    solved, share = np.zeros(len(rows), dtype=bool), 1.0
    for k in track_progress("places", guide.argsort(kind="stable").tolist()):
        # less a tenth: crushing takes much the same share at all places of nearly the least factor
        if (1.0 - 0.1 * (share < 1.0)) * share * guide[k] > factors.min():
            break
        factors[k], sets[k] = known.lay(loads[k], known.solve(loads[k]), sets[k])
        solved[k] = True
        if np.isfinite(guide[k]):  # what falls at no factor there says nothing of the share
            share = min(share, factors[k] / max(guide[k], 1e-100))
    # and back with the mechanisms of all places
    while (above := known.bound(loads)[0]).min() < (1.0 - 1e-5) * factors.min():
        # of places that mirror each other the first one, whatever the rounding
        k = int(np.argmax(above <= (1.0 + 1e-5) * above.min()))
        factor, sets[k] = known.lay(loads[k], factors[k], sets[k] if solved[k] else None)
        factors[k], solved[k] = min(factor, above[k]), True  # the bound ends it in any case
    # those of places that mirror each other are alike, in the order of the rows
    alike, level = factors.copy(), 0.0
    for k in factors.argsort(kind="stable"):
        level = level if factors[k] <= (1.0 + 1e-6) * level else factors[k]
        alike[k] = level
    order = (k for k in alike.argsort(kind="stable") if solved[k])
    worst = dict(known.join(rows[k], loads[k], sets[k]) for k in order)
    return worst, np.where(solved, np.minimum(factors, above), share * guide)


def collapse_factors(
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
    each = track_progress("places", programmes.items())
    associated = {row: programme.solve() for row, programme in each}
    searched = options["friction"] == "nonassociated"
    states = _search_nonassociated(programmes, associated) if searched else associated
    for row, state in states.items():
        if state is not None:
            factors[row] = -state.value
        elif associated[row] is not None:  # the whole search, or a bound
            factors[row] = solve_as_given(stones.whole, live=list(row), **options).lower
    if np.inf in factors.values():
        warn_locking(stones.whole, options["friction"], options["fill"])
    return factors


def _search_nonassociated(
    programmes: dict[AxleRow, Programme], associated: dict[AxleRow, Optimum | None]
) -> dict[AxleRow, Optimum | None]:
    """Find the state of least factor without dilatancy at each place, started from neighbours."""
    # Forwards from the associated optimum, two random states and the solution of the place
    # before; then backwards once more from the solution of the place behind.
    states: dict[AxleRow, Optimum | None] = dict.fromkeys(programmes)
    with ProgressReport("sliding without dilatancy", 2 * len(programmes)) as progress:
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
                way = "back" if backwards else "there"
                progress.show(f"place {seed + 1} of {len(programmes)}, {way}", 1)
    return states


def _find_worst(factors: Array, count: Numbers) -> tuple[int, int]:
    """Return direction and position of the least factor; if none is finite, of the most axles."""
    if not (finite := np.isfinite(factors)).any():
        # the middle of such places: a vehicle there loads some stones
        direction = int(count.max(axis=1).argmax())
        crowded = np.flatnonzero(count[direction] == count.max())
        return direction, int(crowded[len(crowded) // 2])
    # of places that differ by round-off, as on a symmetric bridge, the first
    flat = (factors <= (1.0 + 1e-6) * factors[finite].min()).argmax()
    direction, place = np.unravel_index(flat, factors.shape)
    return int(direction), int(place)


def places_at_ends(
    structure: Structure, vehicle: Array, moving: MovingLoad, share: float = 1.05
) -> list[float]:
    """Return places where an axle stands at an end of a stone, near those of least factors [m]."""
    # A mechanism resists an axle least at an end of the stone on which it stands, where the factor
    # jumps from stone to stone. A fill spreads axles over both.
    corners = np.concatenate([structure.blocks[number].points[:, 0] for number in structure.free])
    beside = 2.0 * CONTACT_TOLERANCE * structure.size
    ends = np.unique(np.concatenate([corners - beside, corners + beside]))
    least, places = moving.factors["factor"], set[float]()
    for sense, way in ((1.0, "right"), (-1.0, "left")):
        factors = least.sel(direction=way).values
        low = np.isfinite(factors) & (factors <= share * moving.worst.factor)
        for place in least["position"].values[low]:
            for ahead in vehicle[:, 1]:
                after = int(np.searchsorted(ends, place + sense * ahead))
                places |= {float(x - sense * ahead) for x in ends[max(after - 1, 0) : after + 1]}
    return sorted(places - {*least["position"].values.tolist()})


def name_missing(missing: Sequence[str]) -> str:
    """Return which factors of a code are missing, as words behind a name; empty for none."""
    return f", without {'partial factors' if 'live' in missing else 'impact'}" if missing else ""


def find_vehicle(vehicle: str | Vehicle) -> Vehicle:
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


def with_cs454(vehicle: Vehicle) -> Vehicle:
    """Return a vehicle of one's own with the factors of CS 454."""
    code = VEHICLES["CS454-single"]
    return replace(vehicle, live=code.live, impact=code.impact, impact_on=code.impact_on)


VEHICLES: Mapping[str, Vehicle] = _read_vehicles()

# Vehicles of a code for roads, by its name
VEHICLES_OF_CODES: Mapping[str, tuple[str, ...]] = {"Eurocode": ("LM1", "LM2")} | {
    code: tuple(name for name in VEHICLES if name.startswith(code)) for code in ("CS454", "HL93")
}
