"""Worst places of a vehicle on a bridge, and its least factors in states of fill and stones."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice, product
from typing import Any

import numpy as np

from archfem._display import track_progress
from archfem._typing import Array
from archfem.limit.backfill import BlocksWithFill
from archfem.limit.fill_range import WEAKER_FILLS, vary_pressure
from archfem.limit.fill_strength import Fill, PlasticFill, as_pressure
from archfem.limit.linear_programme import Programme
from archfem.limit.self_weight import is_balanced, self_weight_programme
from archfem.limit.vehicles import (
    DRIVING_DIRECTIONS,
    AxleRow,
    MovingLoad,
    Vehicle,
    axles_on_structure,
    collapse_factors,
    cut_road,
    find_worst_rows,
    with_cs454,
)
from archfem.masonry.loads import PointLoad
from archfem.masonry.structure import Structure

# Strength of masonry where none is given [Pa]: squared stones in lime mortar have 3 to 10 MPa (from
# memory)
ASSUMED_STRENGTH = 5e6

# Vehicle by its number, driving direction and x of its middle [m]
_Place = tuple[int, str, float]

# Multiple of the least factor up to which the search between places looks beside a place: between
# two it is at most 8 % less than at both, of fill 0.05 m deep on four spans in steps of 0.3 m
_NEARLY_LEAST = 1.1

# Prefix of the states in which stones crush at the assumed strength
CRUSHING_PREFIX = "crushing "

# Each state with those whose factors guide its search, in the order of their searches
_GUIDES: dict[str, Sequence[str]] = {"": (), **WEAKER_FILLS}
_GUIDES |= {f"{CRUSHING_PREFIX}{state}": (state, "by_pressure") for state in WEAKER_FILLS}


def scale_weights(structure: Structure, factor: float) -> Structure:
    """Return a structure whose blocks weigh a multiple."""
    if factor == 1.0:
        return structure
    known = {block.material for block in structure.blocks}
    scaled = {each: replace(each, unit_weight=factor * each.unit_weight) for each in known}
    blocks = (replace(block, material=scaled[block.material]) for block in structure.blocks)
    return replace(structure, blocks=tuple(blocks))


def spread_over_bridge(
    structure: Structure, rows: Sequence[Array], width: float, axles: Array
) -> list[Array]:
    """Return axles as they load the whole width, over which the structure is modelled."""
    return [np.column_stack([structure.width / width * row, axles[:, 1]]) for row in rows]


def refine_worst_places(
    structure: Structure,
    places: Sequence[float],
    vehicles: Sequence[Array],
    area_load: float,
    options: dict[str, Any],
    moving: MovingLoad,
) -> list[float]:
    """Return the worst place of a vehicle on a fill in each direction, between those known [m]."""
    stones, dead = self_weight_programme(structure, **options)
    strips = {strip: stones.load([strip]) for strip in cut_road(structure, area_load)}
    near = list[_Place]()
    for way in DRIVING_DIRECTIONS:
        factors = moving.factors["factor"].sel(direction=way)
        least = factors.values <= _NEARLY_LEAST * min(factors.values.min(), 1e9)
        at = factors["position"].values[least].tolist()
        near += [(k, way, x) for k in range(len(vehicles)) for x in at]
    _, worst = _search_between(structure, places, vehicles, near, stones, dead, strips)
    return sorted({x for *_, x in worst.values()})


def _search_between(
    structure: Structure,
    places: Sequence[float],
    vehicles: Sequence[Array],
    near: Sequence[_Place],
    stones: BlocksWithFill,
    dead: Programme,
    strips: Mapping[PointLoad, Array],
) -> tuple[dict[AxleRow, Array], dict[AxleRow, _Place]]:
    """Return rows of axles beside places of nearly the least factor, and the worst of each way.

    A fill spreads the axles, so that the factor is continuous there, and smooth but where the
    mechanism changes. Mechanisms of some places bound the factors at all others from above.
    """
    known, rows, worst = np.unique(places), dict[AxleRow, Array](), dict[AxleRow, _Place]()
    step = float(np.median(np.diff(known))) if len(known) > 1 else 0.0
    for way in DRIVING_DIRECTIONS:
        beside, found = [place for place in near if place[1] == way], dict[AxleRow, Array]()
        # to a tenth of the step between places, then to a hundredth
        for fine in (0.1 * step, 0.01 * step) if beside else ():
            tried = {
                (k, way, round(float(np.clip(x + by * fine, known[0], known[-1])), 9)): by == 0
                for by in (*range(-10, 0), *range(1, 11), 0)
                for k, _, x in beside
            }
            at = {axles_on_structure(structure, vehicles[x[0]], *x[1:]): x for x in sorted(tried)}
            loads = {row: stones.load(row) for row in at if row}
            guide = np.array([0.0 if tried[at[row]] else np.inf for row in loads])
            found, _ = find_worst_rows(dead, loads, strips, guide)
            first = next(iter(found))  # with strips behind its axles
            beside = [next(at[row] for row in loads if first[: len(row)] == row)]
        rows |= found
        worst |= zip(islice(found, 1), beside, strict=False)
    return rows, worst


def find_least_factors(
    structure: Structure,
    places: Sequence[float],
    vehicles: Sequence[Array],
    area_load: float,
    states: dict[str, dict[str, Any]],
    moving: MovingLoad | None,
) -> dict[str, Any]:
    """Return the least factor in each state; none where the structure does not stand in it.

    Those of states with crushing are in a table of their own, undefined (NaN) where it does not;
    another has driving direction and place of each. Factors of the same vehicle as it is rated, if
    it is given, are those of the state "factor".
    """
    at = list(product(range(len(vehicles)), DRIVING_DIRECTIONS, places))
    rows = [axles_on_structure(structure, vehicles[x[0]], *x[1:]) for x in at]
    place_of = dict(zip(rows, at, strict=True))
    # the fans of loads do not depend on pressure, backing and strength
    stones, _ = self_weight_programme(structure, **next(iter(states.values())))
    axles = {row: stones.load(row) for row in dict.fromkeys(rows) if row}
    guides = dict[str, Array]()
    if moving is not None:
        own = dict(zip(rows, np.tile(moving.factors_at(places), len(vehicles)), strict=True))
        guides["factor"] = np.array([own[row] for row in axles])
    strips = {strip: stones.load([strip]) for strip in cut_road(structure, area_load)}
    factors, spots = dict[str, Any](), dict[str, tuple[str, float]]()
    for name in track_progress("other states", [name for name in _GUIDES if name in states]):
        given = states[name]
        stones, dead = self_weight_programme(structure, **given)
        if not is_balanced(dead.minimise_residual(), dead):
            continue
        guide = next((guides[x] for x in _GUIDES[name] if x in guides), np.zeros(len(axles)))
        # these are worst with sliding that dilates: without, one of the next may be
        several = given["friction"] == "nonassociated"
        worst, guides[name] = find_worst_rows(dead, axles, strips, guide)
        if isinstance(given["fill"], Fill) and worst and not several:
            low = guides[name] <= _NEARLY_LEAST * min(guides[name].min(), 1e9)
            near = [place_of[row] for row, is_low in zip(axles, low, strict=True) if is_low]
            worst, at_row = _search_between(structure, places, vehicles, near, stones, dead, strips)
        else:  # rows have adverse strips behind their axles
            first = islice(worst, 3 if several else 1)
            at_row = {x: next(place_of[a] for a in axles if x[: len(a)] == a) for x in first}
        found = collapse_factors(stones, dead, {row: worst[row] for row in at_row}, given)
        row = min(found, key=found.__getitem__)
        factors[name], spots[name] = found[row], at_row[row][1:]
    crushed = [name for name in states if name.startswith(CRUSHING_PREFIX)]
    table = {name.removeprefix(CRUSHING_PREFIX): factors.pop(name, np.nan) for name in crushed}
    return factors | {"crushing": table, "places": spots}


def further_searches(
    driven: Vehicle,
    rows: Sequence[Array],
    live: float,
    area_load: float,
    options: dict[str, Any],
    crushes: bool,
) -> Iterator[tuple[str, Sequence[Array], float, dict[str, dict[str, Any]]]]:
    """Yield name, rows of weights, partial factor and states of further least factors."""
    if states := _other_states(options, crushes):
        yield "", rows, live, states
    is_multiple = len(driven.axles) == 1 and not area_load
    if driven.grade == "given" and not (is_multiple or isinstance(options["fill"], PlasticFill)):
        factors = (other := with_cs454(driven)).factors
        yield "by_cs454", other.factored(*factors), factors[0], {"factor": options} | states


def _other_states(options: dict[str, Any], crushes: bool) -> dict[str, dict[str, Any]]:
    """Return the options with other pressures of a fill, without backing, all with crushing too.

    Stones of which it was said that they do not crush do not.
    """
    fill = as_pressure(options["fill"])
    fills = vary_pressure(fill) if fill is not None else {}
    states = {name: options | {"fill": other} for name, other in fills.items()}
    if fill is not options["fill"]:
        states["by_pressure"] = options | {"fill": fill}
    if np.isinf(options["strength"]) and crushes:
        soft = options | {"strength": ASSUMED_STRENGTH}
        crushed = {"factor": fill, **fills}
        states |= {f"{CRUSHING_PREFIX}{x}": soft | {"fill": other} for x, other in crushed.items()}
    return states
