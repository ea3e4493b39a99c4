"""Loads on a structure besides self-weight: body forces, point loads, settlements."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Any

import numpy as np
import shapely

from archfem._typing import Array, Metres, Newtons
from archfem._validation import check_between, check_integer, check_number, check_numbers
from archfem.errors import InvalidInput
from archfem.masonry.structure import Structure, join_words
from archfem.units import kN

# Distance below which points are at one place, relative to the size of a structure [-]
SAME_PLACE = 1e-9


@dataclass(frozen=True)
class BodyForce:
    """A force on every block in proportion to its weight.

    Attributes:
        horizontal: multiple of g, positive along x [-].
        vertical: multiple of g, positive upward [-]; self-weight is -1.

    Raises:
        InvalidInput: one is no number, or more than 1000 g.

    Example:
        >>> block = af.column(breadth=0.6, heights=[2.4])
        >>> round(af.collapse_factor(block, live=af.BodyForce(1.0)).factor, 6)
        0.25
    """

    horizontal: float
    vertical: float = 0.0

    def __post_init__(self) -> None:
        """Check that the values are multiples of g."""
        for name in ("horizontal", "vertical"):
            remedy = "give a multiple of g, such as 0.3"
            check_between(getattr(self, name), f"body force, {name} [g]", -1e3, 1e3, remedy=remedy)


@dataclass(frozen=True)
class PointLoad:
    """A force at the highest point of the structure at x, or at a height of a block.

    On a voussoir with arcs the force acts on the arc itself, so that an inclined force has its true
    lever arm.

    Attributes:
        x: position [m].
        force: its components for the whole width, up positive (2,) [N].
        y: height, within a block or on its outline [m]; None for the highest point at x. At a joint
            the block whose centroid is higher carries the force, of two at one height the first.

    Raises:
        InvalidInput: x or y is no number, or the force no two of up to 1e9 N.

    Example:
        >>> pier = af.column(breadth=0.6, heights=[1.0, 1.0, 1.0])
        >>> weight = pier.weight  # at mid-height it tips over the foot, by W 0.3 m / 1.5 m
        >>> push = af.PointLoad(0.0, (weight, 0.0), y=1.5)
        >>> round(af.collapse_factor(pier, live=push).factor, 6)
        0.2
    """

    x: Metres
    force: tuple[Newtons, Newtons]
    y: Metres | None = None

    def __post_init__(self) -> None:
        """Check position and force."""
        check_number(self.x, "point load, x [m]")
        if self.y is not None:
            check_number(self.y, "point load, y [m]")
        force = check_numbers(self.force, "point load, force (x, y) [N]", 2)
        object.__setattr__(self, "force", force)
        if max(map(abs, force)) > 1e9:  # a mistake of units
            raise InvalidInput(f"a point load of {force} N is above 1e+09 N: give newtons")

    def place(self, structure: Structure) -> tuple[int, Array]:
        """Return the number of the loaded block and the loaded point (2,) [m].

        Args:
            structure: whose blocks that move may carry it.

        Raises:
            InvalidInput: no block that moves lies below or above x, or at y.
        """
        if self.y is not None:
            return self._place_at_height(structure, np.array([self.x, self.y]))
        found = {number: structure.blocks[number].top(self.x) for number in structure.free}
        tops = {number: top for number, top in found.items() if top is not None}
        if not tops:
            points = np.concatenate([structure.blocks[b].drawn() for b in structure.free])
            low, high = points[:, 0].min(), points[:, 0].max()
            raise InvalidInput(
                f"a point load at x = {self.x:.4g} m misses the structure, which reaches from "
                f"{low:.4g} to {high:.4g} m: move it there"
            )
        highest = max(tops.values())
        touching = [n for n, top in tops.items() if top > highest - SAME_PLACE * structure.size]
        return _highest_block(structure, touching), np.array([self.x, highest])

    def _place_at_height(self, structure: Structure, point: Array) -> tuple[int, Array]:
        """Return the highest block that has a point (2,) [m], and the point."""
        outlines = np.array([shapely.Polygon(structure.blocks[n].drawn()) for n in structure.free])
        away = shapely.distance(outlines, shapely.Point(point))
        if away.min() > 1e-3 * structure.size:  # chords for arcs, and coordinates in print
            name = structure.blocks[structure.free[int(away.argmin())]].name
            raise InvalidInput(
                f"a point load at ({self.x:.4g}, {self.y:.4g}) m is {away.min():.4g} m away from "
                f"the nearest block that moves, '{name}': move it there"
            )
        nearest = np.flatnonzero(away <= away.min() + SAME_PLACE * structure.size)
        return _highest_block(structure, [structure.free[k] for k in nearest]), point


def _highest_block(structure: Structure, numbers: Sequence[int]) -> int:
    """Return the block whose centroid is highest, the first of those at one height."""
    heights = np.array([structure.blocks[number].centroid[1] for number in numbers])
    level = heights.max() - SAME_PLACE * structure.size  # rounding decides nothing
    return int(numbers[int(np.argmax(heights > level))])


@dataclass(frozen=True)
class Settlement:
    """A motion of a support.

    Attributes:
        block: number or name of a fixed block.
        motion: motion of its centroid along x and y, and anticlockwise about it (3,) [m, m, rad].
    """

    block: int | str
    motion: tuple[float, float, float]

    def __post_init__(self) -> None:
        """Check block and motion."""
        if not isinstance(self.block, str):
            check_integer(self.block, "settlement, block", minimum=0)
        motion = check_numbers(self.motion, "settlement, motion (x, y, turn) [m, m, rad]", 3)
        object.__setattr__(self, "motion", motion)

    def place(self, structure: Structure) -> int:
        """Return the number of the block that settles.

        Args:
            structure: whose fixed blocks are its supports.

        Raises:
            InvalidInput: there is no such block, or it is not a support.
        """
        supports = {b.name: n for n, b in enumerate(structure.blocks) if b.fixed}
        number = supports.get(self.block, self.block) if isinstance(self.block, str) else self.block
        if number not in supports.values():
            raise InvalidInput(
                f"block {self.block!r} cannot settle: the supports are {supports}; name one of them"
            )
        return int(number)

    def added(self, structure: Structure, supports: Array) -> Array:
        """Add the settlement to motions of the blocks (n_blocks, 3) [m, m, rad].

        Args:
            structure: one of whose supports settles.
            supports: previous motions of its blocks (n_blocks, 3) [m, m, rad], not changed.

        Raises:
            InvalidInput: there is no such support.
        """
        motions = supports.copy()
        motions[self.place(structure)] += self.motion
        return motions


@dataclass(frozen=True)
class AttachedLoad:
    """A load that stays with a point of a block along its motion: a floor, a tie, a vault's thrust.

    Attributes:
        block: number or name of the block that carries it.
        point: where it acts, at rest (x, y) [m].
        weight: that acts downwards and, as a mass, is accelerated with the block [N].
        force: constant force without mass, up positive (2,) [N].
        passive: whether it is that of a tie: any part of `force` acts that equilibrium needs, and
            along a motion all of it where the tie is stretched, and else none.
        anchor: number or name of the block at the other end of a tie, which it pulls back; without
            one the ground holds the tie.
        anchor_point: where this end is, at rest (x, y) [m]; `force` points to it.
        free_length: of the bar of a tie, over which it stretches [m]: it breaks at a strain of 2 %.
            None where it is not known; stretches of more than 4 cm are then in doubt.

    Raises:
        InvalidInput: a value is no number, above 1e9 N, or the weight is negative; an anchor has no
            point, or is not that of a tie along its force; a free length is not that of a tie.
    """

    block: int | str
    point: tuple[Metres, Metres]
    weight: Newtons = 0.0
    force: tuple[Newtons, Newtons] = (0.0, 0.0)
    passive: bool = False
    anchor: int | str | None = None
    anchor_point: tuple[Metres, Metres] | None = None
    free_length: Metres | None = None

    def __post_init__(self) -> None:
        """Check that the values are metres and newtons."""
        if not isinstance(self.block, str):
            check_integer(self.block, "attached load, block", minimum=0)
        for name, unit in (("point", "m"), ("force", "N")):
            pair = check_numbers(getattr(self, name), f"attached load, {name} (x, y) [{unit}]", 2)
            object.__setattr__(self, name, pair)
        check_number(self.weight, "attached load, weight [N]", minimum=0.0)
        if max(self.weight, *map(abs, self.force)) > 1e9:  # a mistake of units
            raise InvalidInput(
                f"an attached load of {self.weight} N and {self.force} N is above 1e+09 N: give "
                "newtons"
            )
        if self.anchor is not None or self.anchor_point is not None:
            self._check_anchor()
        if self.free_length is not None:
            check_between(self.free_length, "attached load, free_length [m]", 0.0)
            if not self.passive:
                raise InvalidInput(f"free_length of {self.block} is of a tie: give passive = true")

    def _check_anchor(self) -> None:
        """Check that a tie between two blocks pulls along itself."""
        if self.anchor is None or self.anchor_point is None or not self.passive:
            raise InvalidInput(
                f"a tie at {self.block} has anchor = {self.anchor!r}, anchor_point = "
                f"{self.anchor_point} and passive = {self.passive}: a bar between two blocks needs "
                "both, and passive = true"
            )
        point = check_numbers(self.anchor_point, "attached load, anchor_point (x, y) [m]", 2)
        object.__setattr__(self, "anchor_point", point)
        along = point[0] - self.point[0], point[1] - self.point[1]
        pull = along[0] * self.force[0] + along[1] * self.force[1]
        if not any(along) or pull < 0.999 * hypot(*along) * hypot(*self.force):  # 2.6°
            raise InvalidInput(
                f"the tie from {self.block} to {self.anchor} pulls by {self.force} N, and its "
                f"other end lies at {along} m: give a force that points there"
            )


Action = BodyForce | PointLoad


def list_loads(given: Action | Sequence[Action]) -> list[Action]:
    """Return one load, or several that grow together, as a list."""
    several = given if isinstance(given, list | tuple) else [given]
    if not several or not all(isinstance(each, BodyForce | PointLoad) for each in several):
        raise InvalidInput(
            f"load {given!r} is none: give BodyForce(horizontal), PointLoad(x, (0, -1)), or a list "
            "of them; a Settlement comes alone"
        )
    return list(several)


def find_push(live: "Action | Settlement | Sequence[Action | Settlement]") -> float:
    """Return the horizontal body force that alone grows [g]; 0 for other loads."""
    several = live if isinstance(live, list | tuple) else [live]
    load = several[0] if len(several) == 1 else None
    return load.horizontal if isinstance(load, BodyForce) and not load.vertical else 0.0


def name_side(direction: float) -> str:
    """Name the sense of a horizontal push along x."""
    return "right" if direction > 0.0 else "left"


def describe_forces(loads: Iterable[Any]) -> str:
    """Describe constant forces without mass, but ties, each once; empty where there are none."""
    places = [
        (load.force, load.x if isinstance(load, PointLoad) else load.point[0])
        for load in loads
        if isinstance(load, PointLoad) or (isinstance(load, AttachedLoad) and not load.passive)
    ]
    found = [f"{hypot(*force) / kN:.3g} kN at x = {x:.3g} m" for force, x in places if any(force)]
    return join_words([*dict.fromkeys(found)])


def describe_massless(
    live: "Settlement | Sequence[Action | Settlement]", dead: Sequence[Action]
) -> str:
    """Describe loads that stay and are not pushed as weights are; empty where there are none."""
    several = live if isinstance(live, list | tuple) else [live]
    pushed = any(isinstance(load, BodyForce) and load.horizontal for load in several)
    weight = -sum(min(load.force[1], 0.0) for load in dead if isinstance(load, PointLoad))
    if not (pushed and weight):
        return ""
    return (
        f"dead loads of {weight / kN:.4g} kN have no mass: they are not pushed; what has mass "
        "stands in [structure.standing], af.masonry.carrying"
    )
