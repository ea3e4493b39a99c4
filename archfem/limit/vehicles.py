"""Vehicles over a bridge: collapse factor at every position of a row of axles."""

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from archfem._typing import Array
from archfem._validation import check_numbers
from archfem.errors import InvalidInput
from archfem.limit.backfill import BlocksWithFill, Fill, is_balanced, self_weight_programme
from archfem.limit.collapse import Collapse, collapse_factor
from archfem.limit.linear_programme import Optimum, Programme
from archfem.limit.nonassociated import find_weakest, starting_forces
from archfem.masonry.loads import PointLoad
from archfem.masonry.structure import Structure

DRIVING_DIRECTIONS = ("right", "left")

# Axles that stand on the structure, from left to right
AxleRow = tuple[PointLoad, ...]


@dataclass(frozen=True, eq=False)
class MovingLoad:
    """Collapse factors of a vehicle that moves over a structure.

    Attributes:
        factors: `factor`, the multiple of the vehicle's weight at collapse [-], and `axles`, the
            number of its axles on the structure, over direction ("right", "left") and position
            of the vehicle's middle [m].
        worst: collapse with the least factor.
        direction: driving direction of the vehicle there.
        position: x of its middle there [m].
    """

    factors: xr.Dataset
    worst: Collapse
    direction: str
    position: float

    def __str__(self) -> str:
        """Describe the worst place and its collapse in one line."""
        return f"worst at x = {self.position:.3g} m, driving {self.direction}: {self.worst}"


def moving_load(
    structure: Structure,
    axles: float | Sequence[float],
    *,
    spacings: Sequence[float] = (),
    positions: Sequence[float] | None = None,
    friction: str | None = "coulomb",
    strength: float | None = None,
    fill: Fill | None = None,
) -> MovingLoad:
    """Find the collapse factor of a vehicle at every place on a bridge, and the worst place.

    At each place the vehicle is a row of vertical point loads on the road, which grow together
    over self-weight (`collapse_factor`): through a fill they spread in fans, elsewhere they stand
    on the stones. Axles before and behind the structure do not count. The programme is set up
    once, and only its live load moves. Sliding without dilatancy is searched at each place from
    the solution at the place beside it and from a few more states. The whole search of
    `collapse_factor` follows at the worst place, and where that finds nothing.

    Args:
        structure: the bridge.
        axles: weight of each axle over the bridge's whole width, from the front [N].
        spacings: distances between the axles, one fewer [m].
        positions: x of the vehicle's middle, halfway between first and last axle (n,) [m]; by
            default 101, from where it drives onto the structure to where it is off it again.
        friction: as for `collapse_factor`.
        strength: as for `collapse_factor` [Pa].
        fill: as for `collapse_factor`.

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
    stones, dead = self_weight_programme(structure, friction, strength, fill)
    vehicle = _parse_axles(axles, spacings)
    places = _vehicle_positions(structure, vehicle, positions)
    rows = [
        [_axles_on_structure(structure, vehicle, direction, x) for x in places]
        for direction in DRIVING_DIRECTIONS
    ]
    count = np.array([[len(row) for row in rows_one_way] for rows_one_way in rows])
    if not count.any():
        raise InvalidInput(
            f"the vehicle is nowhere on the structure: positions are from {places.min():.4g} to "
            f"{places.max():.4g} m; move them onto it"
        )
    options: dict[str, Any] = {"friction": friction, "strength": strength, "fill": fill}
    factors = np.full(count.shape, np.nan)
    if is_balanced(dead.minimise_residual(), dead):
        distinct = tuple(dict.fromkeys((*rows[0], *rows[1])))
        factor_of = _collapse_factors(stones, dead, distinct, options)
        factors[:] = [[factor_of[row] for row in rows_one_way] for rows_one_way in rows]
    direction, place = _find_worst(factors, count)
    worst = collapse_factor(structure, live=list(rows[direction][place]), **options)
    if friction == "nonassociated":
        factors[direction, place] = worst.factor  # by the whole search: may be a weaker state
    dataset = _label_factors(places, factors, count)
    return MovingLoad(dataset, worst, DRIVING_DIRECTIONS[direction], float(places[place]))


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
            f"{len(weights)} axles and {len(gaps)} spacings: give one between each two axles"
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


def _collapse_factors(
    stones: BlocksWithFill, dead: Programme, rows: Sequence[AxleRow], options: dict[str, Any]
) -> dict[AxleRow, float]:
    """Return the collapse factor of each row of axles; a full search only where it is needed."""
    factors = dict.fromkeys(rows, np.inf)
    loads = {row: stones.load(row) for row in rows}
    # rows whose load reaches the stones, beyond round-off of the fan
    programmes = {
        row: dead.with_load_factor(load)
        for row, load in loads.items()
        if np.abs(load).max() > 1e-9 * -sum(axle.force[1] for axle in row)
    }
    associated = {row: programme.solve() for row, programme in programmes.items()}
    states = associated
    if options["friction"] == "nonassociated":
        states = _search_nonassociated(programmes, associated)
    for row, state in states.items():
        if state is not None:
            factors[row] = -state.value
        elif associated[row] is not None:  # the whole search, or a bound
            factors[row] = collapse_factor(stones.whole, live=list(row), **options).factor
    return factors


def _search_nonassociated(
    programmes: dict[AxleRow, Programme],
    associated: dict[AxleRow, Optimum | None],
    random_starts: int = 2,
) -> dict[AxleRow, Optimum | None]:
    """Find the state of least factor without dilatancy at each place, started from neighbours."""
    # Forwards from the associated optimum, a few random states and the solution of the place
    # before; then backwards once more from the solution of the place behind.
    states: dict[AxleRow, Optimum | None] = dict.fromkeys(programmes)
    for backwards in (False, True):
        neighbour: list[Array] = []
        for seed, row in enumerate(reversed(programmes) if backwards else programmes):
            programme, weakest = programmes[row], states[row]
            starts = list(neighbour)
            if not backwards:
                starts += starting_forces(programme, associated[row], random_starts, seed)
            state = find_weakest(programme, starts)
            if weakest is None or (state is not None and state.value > weakest.value):
                states[row] = weakest = state
            neighbour = [] if weakest is None else [weakest.forces]
    return states


def _find_worst(factors: Array, count: NDArray[np.intp]) -> tuple[int, int]:
    """Return direction and position of the least factor; if none is finite, of the most axles."""
    finite = np.isfinite(factors)
    flat = np.where(finite, factors, np.inf).argmin() if finite.any() else count.argmax()
    direction, place = np.unravel_index(flat, factors.shape)
    return int(direction), int(place)


def _label_factors(places: Array, factors: Array, count: NDArray[np.intp]) -> xr.Dataset:
    """Return factors and numbers of axles over direction and position."""
    dims = ("direction", "position")
    return xr.Dataset(
        {
            "factor": (dims, factors, {"units": "1", "long_name": "factor at collapse"}),
            "axles": (dims, count, {"units": "1", "long_name": "axles on the structure"}),
        },
        {"direction": list(DRIVING_DIRECTIONS), "position": ("position", places, {"units": "m"})},
    )
