"""Walls of dry stone in running bond, in their plane: rectangles and gables, with openings.

The origin is at the middle of the foot. Head joints stand above one another in every second course
and are counted from the jambs of the openings, in walls without openings from the middle. Where
jambs of two storeys are nearly above one another, those of the lower one count; a head joint too
near a jamb, the end of a lintel or another head joint moves a little, or is left out.
"""

from bisect import bisect
from collections.abc import Sequence, Set
from dataclasses import dataclass, replace
from itertools import combinations, pairwise, permutations

import numpy as np

from archfem._typing import Array, Metres, MetresPerSecondSquared, NewtonsPerMetre
from archfem._validation import (
    check_between,
    check_fields,
    check_integer,
    count_pieces,
    validate_arguments,
)
from archfem.errors import InvalidStructure
from archfem.masonry.assembly import assembled
from archfem.masonry.block import Block
from archfem.masonry.materials import STONE, STONE_TO_STONE, Contact, Material
from archfem.masonry.structure import Structure, join_words, record_origin
from archfem.units import G

# Least distance of a head joint from the edge of a wall, over the length of a stone
LEAST_END = 0.2

# Over the length of a stone: least stone beside a jamb or lintel, and most by which a head joint
# moves; longest stone with a joint left out; least overlap of head joints and bearing of a lintel
LEAST_STONE, LONGEST_STONE, LEAST_OVERLAP, LEAST_BEARING = 0.375, 1.5, 0.25, 0.25
ROUND_OFF = 1e-9  # of places of head joints, over the same

# Depth of the ground below a wall, and its breadth beside it [m]
GROUND_DEPTH, GROUND_BESIDE = 0.5, 1.0

Span = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Opening:
    """A door or window of a wall, below a lintel of one course.

    Openings too near one another for two lintels have one.

    Attributes:
        left: place x of the left jamb, from the middle of the wall [m].
        breadth: clear breadth [m].
        head: height of the lintel's lower face above the ground [m].
        sill: height of the sill above the ground; 0 of a door [m].
        bearing: length on which the lintel bears beside each jamb; by default to the first head
            joints of its course from a quarter of a stone on [m].
        name: name of the opening.
    """

    left: Metres
    breadth: Metres
    head: Metres
    sill: Metres = 0.0
    bearing: Metres | None = None
    name: str = "opening"

    @property
    def right(self) -> float:
        """Place x of the right jamb [m]."""
        return self.left + self.breadth


@dataclass(frozen=True, kw_only=True)
class Floor:
    """A floor or roof as weight of the stones below a bed of a wall, by their lengths there.

    What is above an opening weighs on all of these stones. A roof on the slopes of a gable weighs
    on their stones by horizontal length.

    Attributes:
        level: height above the ground, up to the eaves, where a bed is laid, more than half a
            course from those of openings, or at one; the ridge for a roof on slopes [m].
        load: weight per horizontal metre of the whole breadth of the wall [N/m].
        name: thing that these stones stand for besides themselves.
    """

    level: Metres
    load: NewtonsPerMetre
    name: str = "floor"

    def __post_init__(self) -> None:
        """Check that the load is one of newtons per metre."""
        check_fields(self)
        remedy = "give it in N/m, of which 6 kN/m are 6e3"
        check_between(self.load, f"'{self.name}': load [N/m]", 50.0, 1e6, ends="[]", remedy=remedy)


@record_origin
@validate_arguments
def wall(  # noqa: PLR0913  (all are lengths and properties of one structure)
    *,
    breadth: Metres,
    height: Metres,
    width: Metres,
    eaves: Metres | None = None,
    openings: Sequence[Opening] = (),
    floors: Sequence[Floor] = (),
    course: Metres = 0.25,
    stone: Metres = 0.5,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    gravity: MetresPerSecondSquared = G,
) -> Structure:
    """Return a wall in running bond on fixed ground, in its plane.

    Courses are of equal height between the levels of eaves, sills, heads, floors and ridge, stones
    of equal length between jambs. Head joints of a course are half a stone beside those of the next
    one, or a quarter where jambs or lintels need it. Every course begins its numbers at the left:
    "course 3, stone 1".

    Args:
        breadth: breadth at the ground [m].
        height: height of the ridge [m].
        width: thickness of the wall, out of plane [m].
        eaves: height of the upright sides, below a gable with its ridge in the middle; by default
            that of the wall, and 0 makes a triangle [m].
        openings: doors and windows.
        floors: floors and roofs that weigh on it.
        course: height of a course, about [m].
        stone: length of a stone, about [m].
        material: material of all stones.
        contact: contact of all joints.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidInput: there are more than 10 000 stones.
        InvalidStructure: a length is not positive; or an opening or its lintel is not within the
            wall, overlaps another opening, or leaves no course for its lintel; or a floor is on no
            bed.

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
    thin = "a wall is no thicker than it is high: give its thickness in m"
    check_between(width, "width [m]", 0.0, height, ends="(]", remedy=thin, error=InvalidStructure)
    shoulder = height if eaves is None else eaves
    check_between(shoulder, "eaves [m]", 0.0, height, ends="[]", error=InvalidStructure)

    def half(level: float) -> float:
        """Return half the breadth of the wall at a level [m]."""
        below = shoulder == height or level <= shoulder
        return 0.5 * breadth * (1.0 if below else (height - level) / (height - shoulder))

    for each in openings:
        _check_opening(each, height, half(each.head) - LEAST_END * stone)
    _check_overlap(openings)
    _check_bearings(openings, stone)
    side = 0.5 * breadth + GROUND_BESIDE
    ground = ((-side, -GROUND_DEPTH), (side, -GROUND_DEPTH), (side, 0.0), (-side, 0.0))
    blocks = [Block(ground, material, "ground", fixed=True, part="ground", role="other")]
    stops = {0.0, shoulder, height}.union(*((each.sill, each.head) for each in openings))
    levels = _divide(sorted(stops | _find_beds(floors, stops, shoulder, course)), course)
    for each in openings:
        if each.bearing is not None:
            top = levels[levels.index(each.head) + 1]  # of the lintel, below a slope
            _check_opening(each, height, half(top) - LEAST_END * stone)
    laid = _lay_courses(levels, 0.5 * breadth, openings, stone)
    for k, (low, high) in enumerate(pairwise(levels)):
        inner = [x for x in laid[k] if abs(x) < half(high) - LEAST_END * stone]
        lower, upper = ([-end, *inner, end] for end in (half(low), half(high)))
        rows = zip(pairwise(lower), pairwise(upper), strict=True)
        gaps = {each.left for each in openings if each.sill <= low < each.head}
        stones = [sides for sides in rows if sides[0][0] not in gaps]
        for number, ((a, b), (c, d)) in enumerate(stones, 1):
            corners = dict.fromkeys([(a, low), (b, low), (d, high), (c, high)])  # three at a ridge
            name = f"course {k + 1}, stone {number}"
            blocks.append(Block(tuple(corners), material, name, part="wall", role="pier"))
    blocks = _put_floors(blocks, floors, levels, shoulder, breadth / width)
    return assembled(blocks, contact, width=width, gravity=gravity, name="wall")


def _find_beds(
    floors: Sequence[Floor], stops: Set[float], eaves: float, course: float
) -> set[float]:
    """Return the levels of floors where beds are laid: no course is then thinner than half."""
    levels = {floor.level for floor in floors if 0.0 < floor.level < eaves}
    return {level for level in levels if min(abs(level - y) for y in stops) > 0.5 * course}


def _put_floors(
    blocks: Sequence[Block],
    floors: Sequence[Floor],
    levels: Sequence[float],
    eaves: float,
    slenderness: float,
) -> list[Block]:
    """Return blocks with floors on a wall, of some breadth over its width, as their weight."""
    beds, loaded = [y for y in levels[1:] if y <= eaves or y == levels[-1]], [*blocks]
    for floor in floors:
        above = bisect(beds, floor.level)
        near = beds[max(above - 1, 0) : above + 1]
        bed = min(near, key=lambda each: abs(each - floor.level))
        if abs(bed - floor.level) > 1e-3:  # beds are printed to the millimetre
            nearest = " and ".join(f"{each:.3f}" for each in near)
            raise InvalidStructure(
                f"'{floor.name}' at {floor.level:.4g} m is at no bed that bears floors, up to the "
                f"eaves or at the ridge: take the nearest, {nearest} m"
            )
        lengths = []  # of each block at the bed, and along the slopes below a ridge
        for block in blocks:
            x, y = block.points.T
            top = np.ptp(x[y == y.max()])
            lengths.append(top * (y.max() == bed) + (np.ptp(x) - top) * (bed == levels[-1]))
        load = floor.load * slenderness / sum(lengths)
        for k in np.flatnonzero(lengths):
            material, area = loaded[k].material, loaded[k].area
            weight = round(material.unit_weight + load * lengths[k] / area, 3)  # equal ones share
            words = join_words([*filter(None, [material.stands_for]), floor.name])
            material = replace(material, unit_weight=weight, stands_for=words)
            loaded[k] = replace(loaded[k], material=material)
    return loaded


def _check_opening(opening: Opening, height: float, reach: float) -> None:
    """Refuse an opening that is not within a wall, up to `reach` from its middle at the head."""
    if opening.bearing is not None:
        check_between(opening.bearing, f"{opening.name}: bearing [m]", 0.0, error=InvalidStructure)
    within = 0.0 <= opening.sill < opening.head < height and opening.breadth > 0.0
    bearing = opening.bearing or 0.0
    words = ", with its bearing," if bearing else ""
    left, right = opening.left - bearing, opening.right + bearing
    if not within or max(-left, right) >= reach:
        room = "no room for it and a lintel"
        if reach > 0.0 and opening.head < height:
            room = (
                f"room for it below {reach:.4g} m from the middle, {LEAST_END:g} of a stone inside,"
            )
        why = f"the wall is {height:.4g} m high, and has {room} there: move it, or make it smaller"
        if opening.sill >= opening.head:
            why = "its sill must be below its head"
        raise InvalidStructure(
            f"opening '{opening.name}' is from x = {left:.4g} to {right:.4g} m{words} "
            f"and from {opening.sill:.4g} to {opening.head:.4g} m high: {why}"
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


def _check_bearings(openings: Sequence[Opening], stone: float) -> None:
    """Refuse given bearings for which there is no room, or only that of a sliver, beside them."""
    least = LEAST_STONE * stone
    for one, other in permutations(openings, 2):
        if one.bearing is None or not other.sill <= one.head <= other.head:
            continue
        needed = one.bearing
        if one.head == other.head:
            needed += other.bearing or LEAST_BEARING * stone
        free = max(one.left - other.right, other.left - one.right) - needed
        if min(abs(free), least - free) > ROUND_OFF * stone:
            raise InvalidStructure(
                f"openings '{one.name}' and '{other.name}' are {needed + free:.4g} m apart, and "
                f"bearings of lintels take {needed:.4g} m: change these until the lintels meet, or "
                f"leave {least:.4g} m for a stone between them"
            )


def _divide(stops: Sequence[float], size: float) -> list[float]:
    """Divide intervals into equal pieces of about a given size, and return all their ends."""
    pieces = [
        np.linspace(low, high, count_pieces(high - low, size, "courses") + 1)
        for low, high in pairwise(stops)
    ]
    return np.unique(np.concatenate(pieces)).tolist()


def _lay_courses(
    levels: Sequence[float], half: float, openings: Sequence[Opening], stone: float
) -> list[Array]:
    """Return the places at which stones end in each course, from below."""
    bond, lows = _lay_bond(half, openings, stone), levels[:-1]
    check_integer(len(levels) * len(bond[0]), "courses times stones", maximum=10_000)
    # lintels of the lowest head end half a stone beside the jambs
    first = levels.index(min(each.head for each in openings)) + 1 if openings else 0
    courses = [bond[(k - first) % 2] for k in range(len(lows))]
    holes = [[(e.left, e.right) for e in openings if e.sill <= low < e.head] for low in lows]
    heads = [[e for e in openings if e.head == low] for low in lows]
    lintels = [_span_lintels(*each, stone) for each in zip(courses, holes, heads, strict=True)]
    jambs, ends = (
        [[x for span in spans for x in span if np.isfinite(x)] for spans in rows] + [[]]
        for rows in (holes, lintels)
    )
    laid, below = [], list[float]()
    for k, joints in enumerate(courses):
        free = _outside(joints, holes[k] + lintels[k], -ROUND_OFF * stone)
        above = ends[k + 1] + [x for x in jambs[k + 1] if x not in joints]
        below = ends[k] + _settle(free, jambs[k] + ends[k], below + above, stone)
        laid.append(np.unique(jambs[k] + below))
    return laid


def _lay_bond(half: float, openings: Sequence[Opening], stone: float) -> tuple[Array, Array]:
    """Return the head joints of courses with joints at the jambs, and of those between them."""
    jambs: list[float] = []
    for _, x in sorted((each.head, x) for each in openings for x in (each.left, each.right)):
        # half a stone between nearer ones would be less than the least overlap
        if all(abs(x - other) >= 2.0 * LEAST_OVERLAP * stone for other in jambs):
            jambs.append(x)
    whole, between = [], []
    for low, high in pairwise([-half, *(sorted(jambs) or [0.0]), half]):
        # half stones: their number is even between jambs, any beside the outer ones
        outer = low == -half or high == half
        count = count_pieces(high - low, 0.5 * stone if outer else stone, "stones of a course")
        joints = np.linspace(low, high, (count if outer else 2 * count) + 1)
        joints = joints[::-1] if low == -half else joints  # counted from the jamb
        whole.append(joints[::2])
        between.append(joints[1::2])
    return np.unique(np.concatenate(whole)), np.concatenate(between)


def _outside(joints: Array, spans: Sequence[Span], inside: float) -> Array:
    """Return the head joints outside of spans, or within them by up to a length."""
    for low, high in spans:
        joints = joints[(joints <= low + inside) | (joints >= high - inside)]
    return joints


def _span_lintels(
    joints: Array, holes: Sequence[Span], heads: Sequence[Opening], stone: float
) -> list[Span]:
    """Return from where to where lintels of a course are; infinite to the ends of the wall."""
    least, bearing = LEAST_STONE * stone, LEAST_BEARING * stone
    spans = [
        (each.left - each.bearing, each.right + each.bearing) for each in heads if each.bearing
    ]
    known, heads = [*holes, *spans], [each for each in heads if not each.bearing]
    kept = [(left - least, right + least) for left, right in known]
    kept += [(each.left - bearing, each.right + bearing) for each in heads]
    inner = _outside(joints, kept, ROUND_OFF * stone)
    stops = [-np.inf, *inner, *(x for span in known for x in span), np.inf]
    for each in heads:
        left = max(x for x in stops if x <= each.left)
        right = min(x for x in stops if x >= each.right)
        # beside a jamb that the bond does not follow, half a stone is enough where one fits beyond
        alone = not any(left < x.left < each.left or each.right < x.left < right for x in heads)
        if alone and each.left - left > stone and each.left not in joints:
            left = each.left - 0.5 * stone
        if alone and right - each.right > stone and each.right not in joints:
            right = each.right + 0.5 * stone
        spans.append((left, right))
    return spans


def _settle(
    joints: Array, ends: Sequence[float], others: Sequence[float], stone: float
) -> list[float]:
    """Move head joints too near ends in their course, or joints of others, or leave them out."""
    least, overlap, near = (share * stone for share in (LEAST_STONE, LEAST_OVERLAP, ROUND_OFF))

    def has_room(x: float, fixed: Sequence[float]) -> bool:
        limits = (fixed, least), (others, overlap)
        return all((np.abs(np.array(far) - x) >= length - near).all() for far, length in limits)

    settled = [x for x in joints.tolist() if has_room(x, ends)]
    for joint in sorted(set(joints.tolist()).difference(settled), key=abs):
        fixed = [*ends, *settled]
        low = max((x for x in fixed if x < joint), default=-np.inf)
        high = min((x for x in fixed if x > joint), default=np.inf)
        places = [x + move for x in fixed for move in (-least, least)]
        places += [x + move for x in others for move in (-overlap, overlap)]
        # the nearest place counts, and one farther than this is beyond a jamb
        fits = [x for x in places if abs(x - joint) <= least and has_room(x, fixed)]
        if fits and high - low > LONGEST_STONE * stone:
            settled.append(min(fits, key=lambda x: (round(abs(x - joint) / near), abs(x))))
    return settled
