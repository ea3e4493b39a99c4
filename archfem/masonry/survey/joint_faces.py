"""Faces of joints in a drawing: corners that are chipped beside them, and faces drawn apart."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import dist, hypot

import numpy as np
import shapely

from archfem._typing import Array
from archfem.masonry.assembly import Touch
from archfem.masonry.structure import list_first

# Faces that are drawn further apart than this are said to have been closed [m]
LEAST_OPENING = 1e-3

# Least sine of the angle of a cut to the normal of its joint [-]: about 20°. The sides of a
# voussoir leave its joints at half of its angle, and those of a course at none.
_LEAST_SLOPE = 0.34

# Largest share of the breadth of a stone that its chip has, or the cut is a face of it [-]
_LARGEST_SHARE = 0.5


@dataclass(frozen=True, eq=False)
class Chip:
    """A corner that a stone lacks beside a joint whose faces touch over most of their length.

    Attributes:
        stone: number of the chipped stone.
        other: number of the stone beyond the joint.
        end: end of the contact, where the chip begins (2,) [m].
        along: length of the chip along the joint [m].
        across: breadth of the chip across the joint [m].
        contact: length along which the faces touch [m].
    """

    stone: int
    other: int
    end: Array
    along: float
    across: float
    contact: float

    def holds(self, *points: Array) -> bool:
        """Return whether points are within the chip, whose sides may slope."""
        reach = 1.5 * hypot(self.along, self.across)
        return all(dist(self.end, point) <= reach for point in points)


def find_chips(polygons: Sequence[Array], touches: Sequence[Touch], near: float) -> list[Chip]:
    """Return the chips of stones that touch, but those that are no larger than a length [m].

    Faces touch over most of their length where the chip is no longer than their contact. Beyond
    its end the other face continues, or is chipped as well, and no third stone fills the chip.
    """
    shapes, found = np.array([shapely.Polygon(each) for each in polygons]), list[Chip]()
    for one, other, ends in touches:
        contact = dist(*ends)
        for end, start in (ends, ends[::-1]):
            axis = (end - start) / contact
            cuts = {n: _measure_cut(polygons[n], end, axis, near) for n in (one, other)}
            for stone, beyond in ((one, other), (other, one)):
                if (cut := cuts[stone]) is None or np.dot(cut, axis) > contact:
                    continue
                along = float(np.dot(cut, axis))
                middle = end + (cut + along * axis) / 3.0
                faces = cuts[beyond] is not None or _continues(polygons[beyond], end, axis, near)
                if faces and not shapely.contains_xy(shapes, *middle).any():
                    across = float(np.linalg.norm(cut - along * axis))
                    found.append(Chip(stone, beyond, end, along, across, contact))
    return found


def _measure_cut(points: Array, end: Array, axis: Array, near: float) -> Array | None:
    """Return the step from the end of a contact over the cut beside it, if a stone has one (2,)."""
    away = points - end
    along, off = away @ axis, np.abs(away @ [-axis[1], axis[0]])
    at, count = int(np.argmin(np.hypot(along, off))), len(points)
    if hypot(along[at], off[at]) > near:
        return None
    for turn in (1, -1):
        last = at
        while (after := (last + turn) % count) != at:
            step = points[after] - points[last]
            slopes = step @ axis > _LEAST_SLOPE * np.linalg.norm(step)
            if not slopes or off[after] > _LARGEST_SHARE * off.max():
                break
            last = after
        if along[last] > near and off[last] > near:
            return np.asarray(away[last])
    return None


def _continues(points: Array, end: Array, axis: Array, near: float) -> bool:
    """Return whether the face of a stone continues beyond the end of a contact."""
    away = points - end
    off = np.abs(away @ [-axis[1], axis[0]])
    return bool(np.any((off <= near) & (away @ axis > near)))


def measure_openings(drawn: Sequence[Array], touches: Sequence[Touch], reach: float) -> list[float]:
    """Return how far the faces of each contact were drawn apart, in the mean of its length [m].

    They are sought within a reach of the contact [m]; faces that overlap are apart by less than 0.
    """
    shapes = shapely.make_valid(np.array([shapely.Polygon(each) for each in drawn]))
    return [float(np.mean([*_measure_gaps(shapes, *each, reach)] or [0.0])) for each in touches]


def _measure_gaps(
    shapes: Array, one: int, other: int, ends: Array, reach: float
) -> Iterator[float]:
    """Yield the gap between drawn faces at three places along a contact [m]."""
    start, end = np.asarray(ends)
    axis = (end - start) / dist(start, end)
    normal = np.array([-axis[1], axis[0]])
    centre = shapely.get_coordinates(shapely.centroid(shapes[other]))[0]
    normal = normal if (centre - start) @ normal > 0.0 else -normal
    for share in (0.2, 0.5, 0.8):
        place = start + share * (end - start)
        line = shapely.LineString([place - reach * normal, place + reach * normal])
        one_side, other_side = (
            (shapely.get_coordinates(shapely.intersection(shapes[n], line)) - place) @ normal
            for n in (one, other)
        )
        if len(one_side) and len(other_side):
            yield float(other_side.min() - one_side.max())


def say_faces(
    chips: Sequence[tuple[str, str, float, float, float]],
    closed: Sequence[tuple[str, str, float]],
    say: Callable[[float], str],
) -> str:
    """Return chipped corners and closed joints of a survey in words, with lengths as they are said.

    A joint that is open in the structure bears after its stones have moved; models have it closed.
    """
    words = [
        f"chipped: '{stone}' by {say(along)} along and {say(across)} across its joint with "
        f"'{other}', which touches along {say(contact)} of {say(contact + along)}"
        for stone, other, along, across, contact in chips
    ]
    if closed:
        gaps = [f"{say(gap)} between '{one}' and '{other}'" for one, other, gap in closed]
        verb = "joints, drawn open by more" if len(gaps) > 1 else "joint, drawn open by more"
        words.append(
            f"closed by snap: {len(gaps)} {verb} than {say(LEAST_OPENING)}, {list_first(gaps, 3)}; "
            "where the structure is open there, its stones move by as much before they bear, which "
            "no result counts"
        )
    return "".join(f";\n  {each}" for each in words)
