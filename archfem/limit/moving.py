"""A vehicle that moves over a bridge: the collapse factor wherever it stands."""

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from archfem.arguments import reals
from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.limit.collapse import Collapse, collapse_factor
from archfem.limit.fill import Fill
from archfem.limit.filled import Stones
from archfem.limit.programme import Optimum, Programme
from archfem.limit.sliding import some_starts, weakest_from
from archfem.limit.weight import balanced, self_weight
from archfem.masonry.actions import PointLoad
from archfem.masonry.structure import Structure

DIRECTIONS = ("right", "left")

POSITIONS = 101
"""How many places are looked at where none are given, from before the bridge to behind it."""

UNFELT = 1e-9
"""Part of a vehicle's weight that reaches the stones below which they do not feel it."""


CHANCES = 2
"""States by chance from which sliding without dilatancy is searched at each place."""

Row = tuple[PointLoad, ...]
"""Axles that stand on the structure, from left to right."""


@dataclass(frozen=True, eq=False)
class MovingLoad:
    """What limit analysis found of a vehicle that moves over a structure.

    Attributes:
        factors: `factor`, the multiple of the vehicle's weight at collapse [-], and `axles`, how
            many of its axles stand on the structure, over direction ("right", "left") and position
            of the vehicle's middle [m].
        worst: the collapse with the least factor.
        direction: in which the vehicle drives there.
        position: of its middle there [m].
    """

    factors: xr.Dataset
    worst: Collapse
    direction: str
    position: float

    def __str__(self) -> str:
        """The worst place and what happens there in one line."""
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
    on the stones. Axles before and behind the structure do nothing. The programme is made once,
    and only its live load moves. Sliding without dilatancy is searched at each place from what was
    found beside it and from a few states more, and by the whole search of `collapse_factor` at the
    worst place, and where nothing is found.

    Args:
        structure: the bridge.
        axles: weight of each axle over the bridge's whole width, from the front [N].
        spacings: of the axles, one fewer [m].
        positions: x of the vehicle's middle, halfway between first and last axle (n,) [m]; by
            default 101, from where it comes onto the structure to where it leaves.
        friction: as for `collapse_factor`.
        strength: as for `collapse_factor` [Pa].
        fill: as for `collapse_factor`.

    Returns:
        Factors over both directions and all positions: infinite where the vehicle never makes a
        mechanism, undefined (NaN) where the structure does not stand. And the worst collapse.

    Raises:
        InvalidInput: weights, spacings or positions cannot be meant, the vehicle is nowhere on the
            structure, or as for `collapse_factor`.
        DidNotConverge: the solver of linear programmes gave up.

    References:
        Gilbert, RING Theory and Modelling Guide, University of Sheffield (2005).
    """
    stones, dead = self_weight(structure, friction, strength, fill)
    vehicle = _vehicle(axles, spacings)
    places = _places(structure, vehicle, positions)
    rows = {sense: [_row(structure, vehicle, sense, x) for x in places] for sense in DIRECTIONS}
    count = np.array([[len(row) for row in rows[sense]] for sense in DIRECTIONS])
    if not count.any():
        raise InvalidInput(
            f"the vehicle is nowhere on the structure: positions are from {places.min():.4g} to "
            f"{places.max():.4g} m; move them onto it"
        )
    options: dict[str, Any] = {"friction": friction, "strength": strength, "fill": fill}
    factors = np.full(count.shape, np.nan)
    if balanced(dead.unbalanced(), dead):
        places_of = tuple(dict.fromkeys((*rows["right"], *rows["left"])))
        found = _factors(stones, dead, places_of, options)
        factors[:] = [[found[row] for row in rows[sense]] for sense in DIRECTIONS]
    way, place = _worst(factors, count)
    direction = DIRECTIONS[way]
    live = list(rows[direction][place])
    worst = collapse_factor(structure, live=live, **options)
    if friction == "nonassociated":
        factors[way, place] = worst.factor  # by the whole search, which may find a weaker state
    return MovingLoad(_dataset(places, factors, count), worst, direction, float(places[place]))


def _vehicle(axles: float | Sequence[float], spacings: Sequence[float]) -> Array:
    """Weight of each axle, and its place before the vehicle's middle (n_axles, 2) [N, m]."""
    one = isinstance(axles, Real)
    weights = np.array(reals([axles] if one else axles, "axles [N]"))
    gaps = np.array(reals(spacings, "spacings [m]"))
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


def _places(structure: Structure, vehicle: Array, positions: Sequence[float] | None) -> Array:
    """Positions of the vehicle's middle (n,) [m]."""
    if positions is not None:
        places = np.array(reals(positions, "positions [m]"))
        if not len(places):
            raise InvalidInput("positions has none: give some, or leave it out")
        return places
    points = np.concatenate([structure.blocks[number].drawn() for number in structure.free])
    half = float(vehicle[0, 1])
    low, high = float(points[:, 0].min()), float(points[:, 0].max())
    return np.linspace(low - half, high + half, POSITIONS)


def _row(structure: Structure, vehicle: Array, direction: str, position: float) -> Row:
    """The axles that stand on the structure, from left to right."""
    sense = 1.0 if direction == "right" else -1.0
    axles = sorted((position + sense * ahead, weight) for weight, ahead in vehicle.tolist())
    return tuple(PointLoad(x, (0.0, -weight)) for x, weight in axles if _under(structure, x))


def _under(structure: Structure, x: float) -> bool:
    """Whether a block that moves lies below or above x."""
    return any(
        np.ptp(np.sign(structure.blocks[number].points[:, 0] - x)) > 0 for number in structure.free
    )


def _factors(
    stones: Stones, dead: Programme, rows: Sequence[Row], options: dict[str, Any]
) -> dict[Row, float]:
    """Collapse factor of each row of axles, by the programme made once where that can be."""
    found = dict.fromkeys(rows, np.inf)
    loads = {row: stones.load(row) for row in rows}
    felt = {
        row: dead.growing(load)
        for row, load in loads.items()
        if np.abs(load).max() > UNFELT * -sum(axle.force[1] for axle in row)
    }
    associated = {row: programme.solve() for row, programme in felt.items()}
    states = associated
    if options["friction"] == "nonassociated":
        states = _without_dilatancy(felt, associated)
    for row, state in states.items():
        if state is not None:
            found[row] = -state.value
        elif associated[row] is not None:  # the whole search, or a bound
            found[row] = collapse_factor(stones.whole, live=list(row), **options).factor
    return found


def _without_dilatancy(
    felt: dict[Row, Programme], associated: dict[Row, Optimum | None]
) -> dict[Row, Optimum | None]:
    """Search states that slide without dilatancy from place to place, for the weakest of each.

    Each search starts from the associated optimum, from a few states by chance, and from what was
    found at the place before; then once more from what was found at the place behind.

    Returns:
        The weakest state that was found at each; None where none was.
    """
    states: dict[Row, Optimum | None] = dict.fromkeys(felt)
    for back in (False, True):
        beside: list[Array] = []
        for seed, row in enumerate(reversed(felt) if back else felt):
            programme, start, known = felt[row], associated[row], states[row]
            starts = list(beside)
            if not back:
                starts += some_starts(programme, start, CHANCES, seed)
            found = weakest_from(programme, starts)
            if known is None or (found is not None and found.value > known.value):
                states[row] = known = found
            beside = [] if known is None else [known.forces]
    return states


def _worst(factors: Array, count: NDArray[np.intp]) -> tuple[int, int]:
    """Direction and place of the least factor; where none is finite, of most axles."""
    finite = np.isfinite(factors)
    best = np.where(finite, factors, np.inf).argmin() if finite.any() else count.argmax()
    way, place = np.unravel_index(best, factors.shape)
    return int(way), int(place)


def _dataset(places: Array, factors: Array, count: NDArray[np.intp]) -> xr.Dataset:
    """Factors and numbers of axles over direction and position."""
    dims = ("direction", "position")
    return xr.Dataset(
        {
            "factor": (dims, factors, {"units": "1", "long_name": "factor at collapse"}),
            "axles": (dims, count, {"units": "1", "long_name": "axles on the structure"}),
        },
        {"direction": list(DIRECTIONS), "position": ("position", places, {"units": "m"})},
    )
