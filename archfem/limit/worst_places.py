"""Worst places of a vehicle on a bridge, and its least factors in states of fill and stones."""

from collections.abc import Mapping, Sequence
from itertools import islice
from typing import Any

import numpy as np

from archfem._display import track_progress
from archfem._typing import Array
from archfem.limit.backfill import BlocksWithFill
from archfem.limit.fill_range import WEAKER_FILLS
from archfem.limit.fill_strength import Fill
from archfem.limit.linear_programme import Programme
from archfem.limit.self_weight import is_balanced, self_weight_programme
from archfem.limit.vehicles import (
    DRIVING_DIRECTIONS,
    AxleRow,
    MovingLoad,
    axles_on_structure,
    collapse_factors,
    cut_road,
    find_worst_rows,
)
from archfem.masonry.loads import PointLoad
from archfem.masonry.structure import Structure

# Prefix of the states in which stones crush at the assumed strength
CRUSHING_PREFIX = "crushing "

# Each state with those whose factors guide its search, in the order of their searches
_GUIDES: dict[str, Sequence[str]] = {"": (), **WEAKER_FILLS}
_GUIDES |= {f"{CRUSHING_PREFIX}{state}": (state, "by_pressure") for state in WEAKER_FILLS}


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
    """Return the worst place of a vehicle on a fill in each direction, beside that known [m]."""
    stones, dead = self_weight_programme(structure, **options)
    strips = {strip: stones.load([strip]) for strip in cut_road(structure, area_load)}
    worst = dict[float, None]()
    for way in DRIVING_DIRECTIONS:
        factors = moving.factors["factor"].sel(direction=way)
        # of places that mirror each other the first one, whatever the rounding
        first = int(np.argmax(factors.values <= (1.0 + 1e-6) * factors.values.min()))
        known = [(vehicle, way, float(factors["position"][first])) for vehicle in vehicles]
        found = [_search_between(structure, places, x, stones, dead, strips) for x in known]
        worst[min(found, key=lambda each: each[0])[1]] = None
    return sorted(worst)


def _search_between(
    structure: Structure,
    places: Sequence[float],
    worst: tuple[Array, str, float],
    stones: BlocksWithFill,
    dead: Programme,
    strips: Mapping[PointLoad, Array],
) -> tuple[float, float, dict[AxleRow, Array]]:
    """Return the least factor between the places beside one, its place, and its rows of axles.

    A fill spreads the axles, so that the factor is continuous there, and smooth but where the
    mechanism changes. Mechanisms of some places bound the factors at all others from above.
    """
    vehicle, way, place = worst
    known = np.unique(places)
    k = int(np.abs(known - place).argmin())
    low, high = known[max(k - 1, 0)], known[min(k + 1, len(known) - 1)]
    least, rows = np.inf, dict[AxleRow, Array]()
    for _ in range(2):  # to a tenth of the step between places, then to a hundredth
        fine = np.append(place, np.linspace(low, high, 21))
        at = {axles_on_structure(structure, vehicle, way, x): float(x) for x in fine[::-1]}
        loads = {row: stones.load(row) for row in at if row}
        guide = np.where(np.array([at[row] for row in loads]) == place, 0.0, np.inf)
        rows, factors = find_worst_rows(dead, loads, strips, guide)
        k = int(factors.argmin())
        least, place = float(factors[k]), at[[*loads][k]]
        step = 0.05 * (high - low)
        low, high = place - step, place + step
    return least, place, rows


def find_least_factors(
    structure: Structure,
    places: Sequence[float],
    vehicles: Sequence[Array],
    area_load: float,
    states: dict[str, dict[str, Any]],
    moving: MovingLoad | None,
) -> dict[str, Any]:
    """Return the least factor in each state; none where the structure does not stand in it.

    Those of states with crushing are in a table of their own, undefined (NaN) where it does not.
    Factors of the same vehicle as it is rated, if it is given, are those of the state "factor".
    """
    at = [(vehicle, way, x) for vehicle in vehicles for way in DRIVING_DIRECTIONS for x in places]
    rows = [axles_on_structure(structure, *each) for each in at]
    place_of = dict(zip(rows, at, strict=True))
    # the fans of loads do not depend on pressure, backing and strength
    stones, _ = self_weight_programme(structure, **next(iter(states.values())))
    axles = {row: stones.load(row) for row in dict.fromkeys(rows) if row}
    guides = dict[str, Array]()
    if moving is not None:
        own = dict(zip(rows, np.tile(moving.factors_at(places), len(vehicles)), strict=True))
        guides["factor"] = np.array([own[row] for row in axles])
    strips = {strip: stones.load([strip]) for strip in cut_road(structure, area_load)}
    factors = dict[str, Any]()
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
            place = place_of[[*axles][int(guides[name].argmin())]]
            worst = _search_between(structure, places, place, stones, dead, strips)[-1]
        worst = dict(islice(worst.items(), 3 if several else 1))
        factors[name] = min(collapse_factors(stones, dead, worst, given).values())
    crushed = [name for name in states if name.startswith(CRUSHING_PREFIX)]
    table = {name.removeprefix(CRUSHING_PREFIX): factors.pop(name, np.nan) for name in crushed}
    return factors | {"crushing": table}
