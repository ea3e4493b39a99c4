"""Which way a ring or a pier runs, so that its joints can be told and counted.

A surveyed ring says nothing of its centre. It is found from the stones: the circle that fits the
mid-points of the joints between them best (Kåsa, IEEE Transactions on Instrumentation and
Measurement 25 (1976) 8), of few stones their centroids too. Only directions are taken from it, so
that an ellipse or a pointed arch does as well.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from archfem.arrays import Array
from archfem.masonry.block import Block

STRAIGHT = 0.005
"""Spread of a ring's stones across its length, relative to that along it, up to which it has no
centre: a circle embracing 2.5° has as much."""


@dataclass(frozen=True, eq=False)
class Direction:
    """Which way a ring or a pier runs.

    Attributes:
        middle: of its stones (2,) [m].
        centre: of the circle that it follows (2,) [m]; None where it is straight.
        upright: for a straight one, whether it stands rather than lies.
    """

    middle: Array
    centre: Array | None
    upright: bool

    def outward(self, place: Array) -> Array:
        """Return the unit vector (2,) from the inner to the outer face; of one that stands, right.

        Args:
            place: on the ring or the pier (2,) [m].
        """
        if self.centre is None:
            return np.array([1.0, 0.0] if self.upright else [0.0, 1.0])
        arm = place - self.centre
        return arm / np.linalg.norm(arm)

    def separates(self, line: Array) -> bool:
        """Return whether a line lies across, as the joints between its stones do.

        Args:
            line: its two ends (2, 2) [m].
        """
        step = line[1] - line[0]
        return bool(2.0 * (step @ self.outward(line.mean(axis=0))) ** 2 > step @ step)

    def along(self, place: Array) -> float:
        """Return where a place lies along: to the right, upwards, or clockwise about the centre.

        Angles count from the gap that the ring leaves open, so from the left springing.

        Args:
            place: on the ring or the pier (2,) [m].

        Returns:
            A coordinate [m], of a ring an angle [rad], that grows from joint to joint.
        """
        if self.centre is None:
            return float(place[1] if self.upright else place[0])
        gap, arm = self.centre - self.middle, place - self.centre
        clockwise = np.arctan2(gap[1] * arm[0] - gap[0] * arm[1], gap @ arm) % (2.0 * np.pi)
        return float(clockwise if gap[1] <= 0.0 else -clockwise)


def directions_of(
    blocks: Sequence[Block], lines: Iterable[tuple[int, int, Array]]
) -> dict[str, Direction]:
    """Return which way rings and piers run, by the names of their parts; only of named ones.

    Args:
        blocks: of a structure, with their roles.
        lines: on which two of them touch (2, 2) [m], after the numbers of the two.
    """
    stones: dict[str, list[Array]] = {}
    beds: dict[str, list[Array]] = {}
    roles = {block.part: block.role for block in blocks}
    for block in blocks:
        if block.part and not block.fixed and block.role != "other":
            stones.setdefault(block.part, []).append(block.centroid)
    for a, b, line in lines:
        part = blocks[a].part
        if part in stones and part == blocks[b].part and not blocks[a].fixed | blocks[b].fixed:
            beds.setdefault(part, []).append(line.mean(axis=0))
    for part, found in stones.items():
        middles = beds.get(part, [])
        stones[part] = middles if len(middles) > 2 else [*middles, *found]
    return {part: _through(np.array(found), roles[part]) for part, found in stones.items()}


def _through(places: Array, role: str) -> Direction:
    """The direction of what runs through places (n, 2)."""
    middle = places.mean(axis=0)
    arms = places - middle
    _, spread, axes = np.linalg.svd(np.append(arms, np.zeros((2, 2)), axis=0))
    upright = bool(abs(axes[0, 1]) > abs(axes[0, 0]))
    if role == "pier" or spread[1] <= STRAIGHT * spread[0]:
        return Direction(middle, None, role == "pier" or upright)
    design = np.column_stack([2.0 * arms, np.ones(len(arms))])
    found = np.linalg.lstsq(design, np.sum(arms**2, axis=1), rcond=None)[0]
    return Direction(middle, middle + found[:2], upright)
