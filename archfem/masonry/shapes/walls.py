"""Walls of dry stone in running bond, in their plane: rectangles and gables, with openings.

The origin is at the middle of the foot. Head joints stand above one another in every second course
and are counted from the jambs of the openings, in walls without openings from the middle.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from archfem._typing import Array, Metres, MetresPerSecondSquared
from archfem._validation import check_between, check_integer, count_pieces, validate_arguments
from archfem.errors import InvalidStructure
from archfem.masonry.assembly import assembled
from archfem.masonry.block import Block
from archfem.masonry.materials import STONE, STONE_TO_STONE, Contact, Material
from archfem.masonry.structure import Structure, record_origin
from archfem.units import G

# Least distance of a head joint from the edge of a wall, over the length of a stone
LEAST_END = 0.2

# Depth of the ground below a wall, and its breadth beside it [m]
GROUND_DEPTH, GROUND_BESIDE = 0.5, 1.0


@dataclass(frozen=True, kw_only=True)
class Opening:
    """A door or window of a wall, below a lintel of one course.

    The lintel ends at the first head joints of its course beyond both jambs.

    Attributes:
        left: place x of the left jamb, from the middle of the wall [m].
        breadth: clear breadth [m].
        head: height of the lintel's lower face above the ground [m].
        sill: height of the sill above the ground; 0 of a door [m].
        name: name of the opening.
    """

    left: Metres
    breadth: Metres
    head: Metres
    sill: Metres = 0.0
    name: str = "opening"

    @property
    def right(self) -> float:
        """Place x of the right jamb [m]."""
        return self.left + self.breadth


@record_origin
@validate_arguments
def wall(  # noqa: PLR0913  (all are lengths and properties of one structure)
    *,
    breadth: Metres,
    height: Metres,
    width: Metres,
    eaves: Metres | None = None,
    openings: Sequence[Opening] = (),
    course: Metres = 0.25,
    stone: Metres = 0.5,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    gravity: MetresPerSecondSquared = G,
) -> Structure:
    """Return a wall in running bond on fixed ground, in its plane.

    Courses are of equal height between the levels of eaves, sills, heads and ridge, stones of equal
    length between jambs. Head joints of a course are half a stone beside those of the next one.
    Every course begins its numbers at the left: "course 3, stone 1".

    Args:
        breadth: breadth at the ground [m].
        height: height of the ridge [m].
        width: thickness of the wall, out of plane [m].
        eaves: height of the upright sides, below a gable with its ridge in the middle; by default
            that of the wall, and 0 makes a triangle [m].
        openings: doors and windows.
        course: height of a course, about [m].
        stone: length of a stone, about [m].
        material: material of all stones.
        contact: contact of all joints.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidInput: there are more than 10 000 stones.
        InvalidStructure: a length is not positive; or an opening is not within the wall, overlaps
            another, or leaves no course for its lintel.

    Example:
        >>> barn = af.shapes.wall(breadth=4.0, height=4.0, eaves=2.5, width=0.4)
        >>> len(barn.free), round(barn.weight)
        (107, 140400)
    """
    lengths = {"breadth": breadth, "height": height, "course": course, "stone": stone}
    for key, length in lengths.items():
        check_between(length, f"{key} [m]", 0.0, 1e3, error=InvalidStructure)
    taller = "a course is no taller than the wall"
    check_between(
        course, "course [m]", 0.0, height, ends="(]", remedy=taller, error=InvalidStructure
    )
    shoulder = height if eaves is None else eaves
    check_between(shoulder, "eaves [m]", 0.0, height, ends="[]", error=InvalidStructure)

    def half(level: float) -> float:
        """Return half the breadth of the wall at a level [m]."""
        below = shoulder == height or level <= shoulder
        return 0.5 * breadth * (1.0 if below else (height - level) / (height - shoulder))

    for each in openings:
        _check_opening(each, height, half(each.head) - LEAST_END * stone)
    _check_overlap(openings)
    side = 0.5 * breadth + GROUND_BESIDE
    ground = ((-side, -GROUND_DEPTH), (side, -GROUND_DEPTH), (side, 0.0), (-side, 0.0))
    blocks = [Block(ground, material, "ground", fixed=True, part="ground", role="other")]
    stops = {0.0, shoulder, height}.union(*((each.sill, each.head) for each in openings))
    levels = _divide(sorted(stops), course)
    bond = _lay_bond(0.5 * breadth, openings, stone)
    check_integer(len(levels) * len(bond[0]), "courses times stones", maximum=10_000)
    # half stones beside the jambs carry the lintel of the lowest head
    first = levels.index(min(each.head for each in openings)) + 1 if openings else 0
    for k, (low, high) in enumerate(pairwise(levels)):
        joints = _lay_course(bond[(k - first) % 2], openings, low)
        inner = [x for x in joints if abs(x) < half(high) - LEAST_END * stone]
        lower, upper = ([-end, *inner, end] for end in (half(low), half(high)))
        rows = zip(pairwise(lower), pairwise(upper), strict=True)
        gaps = {each.left for each in openings if each.sill <= low < each.head}
        stones = [sides for sides in rows if sides[0][0] not in gaps]
        for number, ((a, b), (c, d)) in enumerate(stones, 1):
            corners = dict.fromkeys([(a, low), (b, low), (d, high), (c, high)])  # three at a ridge
            name = f"course {k + 1}, stone {number}"
            blocks.append(Block(tuple(corners), material, name, part="wall", role="pier"))
    return assembled(blocks, contact, width=width, gravity=gravity, name="wall")


def _check_opening(opening: Opening, height: float, reach: float) -> None:
    """Refuse an opening that is not within a wall, up to `reach` from its middle at the head."""
    within = 0.0 <= opening.sill < opening.head < height and opening.breadth > 0.0
    if not within or max(-opening.left, opening.right) >= reach:
        raise InvalidStructure(
            f"opening '{opening.name}' is from x = {opening.left:.4g} to {opening.right:.4g} m and "
            f"from {opening.sill:.4g} to {opening.head:.4g} m high: the wall is {height:.4g} m "
            f"high, and has room for it below {reach:.4g} m from the middle at its head: "
            "move it, or make it smaller"
        )


def _check_overlap(openings: Sequence[Opening]) -> None:
    """Refuse openings that overlap, or have no lintel between them."""
    for one, other in combinations(openings, 2):
        beside = one.left >= other.right or other.left >= one.right
        if not beside and one.sill <= other.head and other.sill <= one.head:
            raise InvalidStructure(
                f"openings '{one.name}' and '{other.name}' overlap, or leave no course between "
                "them for a lintel: move one of them"
            )


def _divide(stops: Sequence[float], size: float) -> list[float]:
    """Divide intervals into equal pieces of about a given size, and return all their ends."""
    pieces = [
        np.linspace(low, high, count_pieces(high - low, size, "courses") + 1)
        for low, high in pairwise(stops)
    ]
    return np.unique(np.concatenate(pieces)).tolist()


def _lay_bond(half: float, openings: Sequence[Opening], stone: float) -> tuple[Array, Array]:
    """Return the head joints of courses with joints at the jambs, and of those between them."""
    jambs = sorted({x for each in openings for x in (each.left, each.right)}) or [0.0]
    whole, between = [], []
    for low, high in pairwise([-half, *jambs, half]):
        # half stones: their number is even between jambs, any beside the outer ones
        outer = low == -half or high == half
        count = count_pieces(high - low, 0.5 * stone if outer else stone, "stones of a course")
        joints = np.linspace(low, high, (count if outer else 2 * count) + 1)
        joints = joints[::-1] if low == -half else joints  # counted from the jamb
        whole.append(joints[::2])
        between.append(joints[1::2])
    return np.unique(np.concatenate(whole)), np.concatenate(between)


def _lay_course(joints: Array, openings: Sequence[Opening], low: float) -> Array:
    """Return the head joints of a course from a level, given those of the bond."""
    for each in openings:
        if each.sill <= low <= each.head:  # no stone ends in an opening, or within its lintel
            joints = joints[(joints < each.left) | (joints > each.right)]
        if each.sill <= low < each.head:
            joints = np.append(joints, [each.left, each.right])
    return np.unique(joints)
