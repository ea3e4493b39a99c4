"""Bridges and arcades: rings on piers, sidewalls behind them, backfill and paving above.

Stones are polygons: the faces of a voussoir follow the circle by chords, so that the fill can rest
on them.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain, pairwise
from math import cos
from typing import Any, NamedTuple

import numpy as np

from archfem._typing import Angle, Metres, MetresPerSecondSquared
from archfem._validation import check_numbers, count_pieces, validate_arguments
from archfem.errors import InvalidStructure
from archfem.masonry.assembly import assembled
from archfem.masonry.block import Block, Point, check_overlaps
from archfem.masonry.materials import STONE, STONE_TO_STONE, Contact, Material
from archfem.masonry.shapes.bridge_parts import Arch, Backfill, Paving, Pier, Sidewall
from archfem.masonry.shapes.rings import circular_arch
from archfem.masonry.structure import Joint, Structure, record_origin
from archfem.units import G

# Depth of the fixed blocks under piers and behind walls [m]; they do not deform.
FOUNDATION_DEPTH = 0.2

# Gap between rings side by side, below which a skewback takes their lowest stones [m]: rings move
# by more, and there is no joint between them
MIN_GAP = 0.01

# A skewback takes at most the voussoirs of a ring over this at each springing [-]: no stone of an
# arch is larger
MAX_SHARED = 6

# One length for all parts, or one for each, from left to right
Lengths = Metres | Sequence[Metres]

# A springing joint: its intrados and its extrados
Face = tuple[Point, Point]

# A part with stones and joints of its own, and one that consists of courses
Part = Arch | Pier | Sidewall
Courses = Pier | Sidewall

# Levels [m], or distances along the bridge [m]
Pair = tuple[float, float]


@record_origin
@validate_arguments
def bridge(  # noqa: PLR0913  (the parts a bridge may have, and what they are made of)
    *,
    arches: Sequence[Arch],
    piers: Sequence[Pier] = (),
    sidewalls: Sequence[Sidewall] = (),
    backfill: Backfill | None = None,
    paving: Paving | None = None,
    width: Metres = 1.0,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    chords: int = 1,
    gravity: MetresPerSecondSquared = G,
) -> Structure:
    """Return a bridge built from its parts, from left to right.

    Coordinates are measured from the left end of the left sidewall (x) and from the springing
    level (y). Without sidewalls x is zero at the middle of the first springing joint, outside the
    clear span.
    Joints are named by part: "main arch, joint 5" counted from the left springing, "north pier,
    base" and "north pier, joint 1" upwards; others by the blocks they separate. In beds "intrados"
    is the left end.

    Args:
        arches: one or more rings.
        piers: one fewer than arches; or one more, without sidewalls: the first and the last then
            support the outer springings.
        sidewalls: left and right, or none, with outer springings fixed or on piers.
        backfill: or None.
        paving: or None; it rests on the backfill.
        width: out of plane [m].
        material: material of all stones.
        contact: between stones.
        chords: straight pieces of each face of a voussoir.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidStructure: the parts do not fit together.
    """
    _check_parts(arches, piers, sidewalls, backfill is None and paving is not None)
    builder = StoneworkBuilder(material, contact, chords)
    faces, extrados = builder.build(arches, piers, sidewalls)
    if backfill is not None:
        # from left to right: what the fill rests on outside the springings, and all rings
        left, right = fill_ledge(faces[0][0], 1.0, sidewalls[:1]), faces[-1][1]
        right_ledge = fill_ledge(right, -1.0, sidewalls[1:])[::-1]
        bottom = [*left, *chain(*extrados), *right_ledge]
        top = backfill.surface(bottom[0][0], bottom[-1][0], _highest_crown(faces, extrados))
        _check_cover([*bottom, *_find_crowns(arches, faces)], top)
        builder.add([*bottom, *reversed(top)], "backfill", backfill.loaded(width, material))
        if paving is not None:
            builder.pave(top, paving)
    # Before joints are searched: blocks that overlap have wrong ones.
    builder.check()
    soil = contact if backfill is None else backfill.contact

    def select_contact(a: Block, b: Block) -> Contact:
        return soil if "backfill" in (a.part, b.part) else contact

    common: dict[str, Any] = {"width": width, "gravity": gravity, "name": "bridge"}
    return assembled(builder.blocks, select_contact, joints=builder.joints, **common)


def _check_parts(
    arches: Sequence[Arch], piers: Sequence[Pier], sidewalls: Sequence[Sidewall], bare: bool
) -> None:
    """Check the numbers of arches, piers and sidewalls."""
    if not arches or len(piers) not in (len(arches) - 1, len(arches) + 1):
        raise InvalidStructure(
            f"{len(arches)} arches and {len(piers)} piers: give at least one arch, and a pier "
            "between each two, or also one under each end"
        )
    if len(sidewalls) not in ((0, 2) if len(piers) < len(arches) else (0,)):
        raise InvalidStructure(
            f"{len(sidewalls)} sidewalls: give a left and a right one, or none, and none where "
            "piers stand under the ends"
        )
    if bare:
        raise InvalidStructure("paving lies on backfill: give backfill too, or no paving")


def _highest_crown(
    faces: Sequence[tuple[Face, Face]], extrados: Sequence[Sequence[Point]]
) -> Point:
    """Return the highest crown, midway between its springings; of equal ones the first."""
    levels = [max(y for _, y in points) for points in extrados]
    # equal crowns differ by round-off
    level = max(levels)
    left, right = next(f for f, y in zip(faces, levels, strict=True) if y > level - 1e-9)
    return 0.5 * (left[0][0] + right[0][0]), level


def _find_crowns(arches: Sequence[Arch], faces: Sequence[tuple[Face, Face]]) -> list[Point]:
    """Return the crown of the extrados of each ring, on its arc: chords may be below it."""
    middles = (0.5 * (left[0][0] + right[0][0]) for left, right in faces)
    levels = (each.radius * (1.0 - cos(each.half)) + 0.5 * each.thickness for each in arches)
    return list(zip(middles, levels, strict=True))


def _check_cover(bottom: Sequence[Point], surface: Sequence[Point]) -> None:
    """Check that the fill covers rings and sidewalls."""
    min_cover = 0.02  # [m]; thinner layers make slivers in the mesh
    x, y = np.array(bottom).T
    cover = np.interp(x, *np.array(surface).T) - y
    if cover.min() < min_cover:
        place = int(np.argmin(cover))
        raise InvalidStructure(
            f"the fill is {cover[place]:.3f} m above the stones at x = {x[place]:.2f} m, by the "
            f"arcs of rings, and it must be at least {min_cover} m: give more cover, less erosion, "
            "or less of `above`, the height of sidewalls over the springing"
        )


@record_origin
@validate_arguments
def buttressed_arch(  # noqa: PLR0913  (all are lengths and properties of one structure)
    *,
    span: Metres,
    thickness: Metres,
    voussoirs: int,
    breadth: Metres,
    height: Metres,
    rise: Metres | None = None,
    embrace: Angle | None = None,
    measured: str = "intrados",
    course: Metres = 0.40,
    chords: int = 1,
    width: Metres = 1.0,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    gravity: MetresPerSecondSquared = G,
) -> Structure:
    """Return a circular arch between two buttresses in courses, flush with its intrados.

    Coordinates are those of a `bridge`. They start where the centre line of the ring meets the left
    springing joint: above the clear springing, by half the thickness × cos(embrace / 2).

    Args:
        span: clear span between the springings [m].
        thickness: thickness of the ring [m].
        voussoirs: number of stones.
        breadth: breadth of each buttress, outside the clear span: flush with the intrados [m].
        height: height of the buttresses, from foundation to y = 0, the springing level of the
            centre line [m].
        rise: clear rise of the intrados above its springings [m]; or
        embrace: angle subtended by the ring [degrees].
        measured: "intrados"; or "centre line", along which span and rise are measured then.
        course: height of a course, about [m].
        chords: straight pieces of each face of a voussoir.
        width: out of plane [m].
        material: material of all blocks.
        contact: contact of all joints.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidStructure: the lengths do not fit together.
    """
    of_arch: dict[str, Any] = {"spans": [span], "rises": rise, "embraces": embrace}
    of_arch |= {"thicknesses": thickness, "voussoirs": voussoirs, "measured": measured}
    common: dict[str, Any] = {"material": material, "contact": contact, "gravity": gravity}
    common |= {"course": course, "chords": chords, "width": width}
    return arcade(heights=height, breadths=breadth, **of_arch, **common)


@record_origin
@validate_arguments
def arcade(  # noqa: PLR0913  (all are lengths and properties of one structure)
    *,
    spans: Sequence[Metres],
    heights: Lengths,
    breadths: Lengths,
    thicknesses: Lengths,
    voussoirs: int | Sequence[int],
    rises: Lengths | None = None,
    embraces: Angle | Sequence[Angle] | None = None,
    measured: str = "intrados",
    course: Metres = 0.40,
    chords: int = 1,
    width: Metres = 1.0,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    gravity: MetresPerSecondSquared = G,
) -> Structure:
    """Return circular arches in a row, on piers between them and under both ends.

    A single number applies to all arches, or piers. Parts are named "arch 1" and "pier 1" from the
    left; coordinates are those of a `bridge`.

    Args:
        spans: clear spans of the arches between their springings [m].
        heights: heights of the piers, one more than arches, as for `buttressed_arch` [m].
        breadths: breadths of the piers, between the clear spans: flush with the intrados [m].
        thicknesses: thicknesses of the rings [m].
        voussoirs: numbers of stones.
        rises: clear rises of the intrados above their springings [m]; or
        embraces: angles subtended by the rings [degrees].
        measured: "intrados"; or "centre line", along which spans and rises are measured then.
        course: height of a course, about [m].
        chords: straight pieces of each face of a voussoir.
        width: out of plane [m].
        material: material of all blocks.
        contact: contact of all joints.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidStructure: the numbers or lengths do not fit together.
    """
    count = len(check_numbers(spans, "spans [m]"))
    of_rings = _expand_values(
        count, thicknesses=thicknesses, voussoirs=voussoirs, rises=rises, embraces=embraces
    )
    arches = []
    for k, (span, *of_ring) in enumerate(zip(spans, *of_rings, strict=True), 1):
        keys = dict(zip(("thickness", "voussoirs", "rise", "embrace"), of_ring, strict=True))
        arches.append(Arch(span=span, measured=measured, name=f"arch {k}", **keys))
    of_piers = _expand_values(count + 1, breadths=breadths, heights=heights)
    piers = [
        Pier(breadth=broad, height=high, course=course, name=f"pier {k}")
        for k, (broad, high) in enumerate(zip(*of_piers, strict=True), 1)
    ]
    common: dict[str, Any] = {"material": material, "contact": contact, "gravity": gravity}
    return bridge(arches=arches, piers=piers, chords=chords, width=width, **common)


def _expand_values(count: int, **values: Any) -> list[list[Any]]:
    """Return a list of each argument with one value for each part."""
    rows = []
    for name, given in values.items():
        single = given is None or isinstance(given, float | int | str)
        row = [given] if single else list(given)
        row = row * count if len(row) == 1 else row
        if len(row) != count:
            raise InvalidStructure(f"{len(row)} {name}: give one for all, or {count}")
        rows.append(row)
    return rows


class BridgeRing(NamedTuple):
    """The stones of a ring in a bridge, its joints, and the lower ends of both.

    `left` and `right` lead from the springing along the intrados to the outermost joint, and across
    it: the skewbacks there take the stones below it. Joints are numbered from the `first`.
    """

    stones: tuple[Block, ...]
    faces: list[Face]
    left: list[Point]
    right: list[Point]
    first: int = 0

    @property
    def extrados(self) -> list[Point]:
        """The points along the extrados, from left to right [m]."""
        # the extrados is the second half of an outline, from the right
        halves = (reversed(each.outline[len(each.outline) // 2 : -1]) for each in self.stones)
        return [self.faces[0][1], *chain(*halves)]

    def cut(self, first: int, last: int) -> "BridgeRing":
        """Return the ring without its first and its last stones, which skewbacks take."""
        end, faces = len(self.stones) - last, self.faces[first : len(self.faces) - last]
        left, right = (
            list(chain(*(each.outline[: len(each.outline) // 2] for each in taken)))
            for taken in (self.stones[:first], self.stones[end:])
        )
        ends = [*left, *faces[0]], [*reversed(right), *faces[-1]]
        return BridgeRing(self.stones[first:end], faces, *ends, first)


def build_ring(
    arch: Arch, left: float, material: Material, contact: Contact, chords: int
) -> BridgeRing:
    """Build a ring at its position in a bridge."""
    # the embrace with its unit, so that no small angle is taken for radians
    shape: dict[str, Any] = {"embrace": f"{np.degrees(2.0 * arch.half):.17g} degree"}
    shape |= {"radius": arch.radius, "thickness": arch.thickness, "voussoirs": arch.voussoirs}
    ring = circular_arch(material=material, contact=contact, chords=chords, **shape)
    # from the centre of the circle to the left end of the deck and the springing level
    right, up = left + arch.centre_line_span / 2.0, -arch.radius * cos(arch.half)

    def at(point: Point) -> Point:
        return (float(point[0] + right), float(point[1] + up))

    part: dict[str, Any] = {"part": arch.name, "role": arch.role}
    stones = []
    for each in ring.blocks[1:-1]:  # its abutments are other blocks in a bridge
        outline, name = tuple(map(at, each.outline)), f"{arch.name}, {each.name}"
        stones.append(replace(each, outline=outline, name=name, **part))
    faces = [(at(each.intrados), at(each.extrados)) for each in ring.joints]
    return BridgeRing(tuple(stones), faces, [], []).cut(0, 0)


def _count_shared(left: BridgeRing, right: BridgeRing, pier: Pier) -> int:
    """Count the stones at each of two springings below where the rings stand side by side."""
    for count in range(min(len(left.stones), len(right.stones)) // MAX_SHARED + 1):
        if left.faces[-1 - count][1][0] < right.faces[count][1][0] - MIN_GAP:
            return count
    raise InvalidStructure(
        f"'{pier.name}': rings do not stand side by side on {_width_text(pier)}, and one stone "
        f"would take over 1/{MAX_SHARED} of their voussoirs: give a wider one, or thinner rings"
    )


def _width_text(pier: Pier) -> str:
    """Return the width that a pier was given, in words."""
    name, width = ("breadth", pier.breadth) if pier.gap is None else ("gap", pier.gap)
    return f"a {name} of {width:.3g} m"


def fill_ledge(face: Face, inward: float, walls: Sequence[Sidewall]) -> list[Point]:
    """Return the base of the fill outside an outer springing, from the end of the deck inwards."""
    x, y = face[1]
    if not walls:
        return []
    wall = walls[0]
    centre = 0.5 * (face[0][0] + x)
    outer, step = centre - inward * wall.length, x - inward * wall.setback
    if wall.above <= 0.0:
        return [(outer, y)]
    return [(outer, y + wall.above), (step, y + wall.above), (step, y)]


class StoneworkBuilder:
    """Builder of the blocks and joints of a bridge."""

    def __init__(self, material: Material, contact: Contact, chords: int) -> None:
        self.material, self.contact, self.chords = material, contact, chords
        self.blocks: list[Block] = []
        self.joints: list[Joint] = []

    def build(
        self, arches: Sequence[Arch], piers: Sequence[Pier], sidewalls: Sequence[Sidewall]
    ) -> tuple[list[tuple[Face, Face]], list[list[Point]]]:
        """Build all stonework below the fill, from left to right."""
        rings, x = [], sidewalls[0].length if sidewalls else 0.0
        ends: Sequence[Courses] = sidewalls
        if len(piers) > len(arches):
            ends, piers = (piers[0], piers[-1]), piers[1:-1]
        for number, arch in enumerate(arches):
            rings.append(build_ring(arch, x, self.material, self.contact, self.chords))
            x += arch.centre_line_span
            if number < len(piers):
                x += piers[number].gap_beside(arch.reach, arches[number + 1].reach)
        springings = [(ring.faces[0], ring.faces[-1]) for ring in rings]
        shared = [0, *map(_count_shared, rings[:-1], rings[1:], piers), 0]
        rings = [ring.cut(*taken) for ring, taken in zip(rings, pairwise(shared), strict=True)]
        support = self._build_end(springings[0][0], 1.0, ends[:1], "left abutment")
        for number, (arch, ring) in enumerate(zip(arches, rings, strict=True)):
            stones = [support, *range(len(self.blocks), len(self.blocks) + len(ring.stones))]
            self.blocks += ring.stones
            if number < len(piers):
                support = self._build_pier(piers[number], ring.right, rings[number + 1].left)
            else:
                support = self._build_end(ring.faces[-1], -1.0, ends[1:], "right abutment")
            pairs = pairwise([*stones, support])
            for k, (pair, face) in enumerate(zip(pairs, ring.faces, strict=True), ring.first):
                self._add_joint(pair, face, f"joint {k}", arch)
        return springings, [ring.extrados for ring in rings]

    def add(
        self,
        outline: Sequence[Point],
        name: str,
        material: Material | None = None,
        *,
        part: str | None = None,
        role: str = "other",
        fixed: bool = False,
        structured: bool = False,
    ) -> int:
        """Add a block and return its number."""
        points = [(float(px), float(py)) for px, py in outline]
        # Parts of no height or setback leave equal points one after the other.
        points = [point for k, point in enumerate(points) if point != points[k - 1]]
        x, y = np.array(points).T
        # On the right side outlines come out clockwise, and blocks must be anticlockwise.
        if float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) < 0.0:
            points = [points[0], *reversed(points[1:])]
        corners = (0, 1, 2, 3) if structured else None
        given = tuple(points), material or self.material, name, fixed, corners, part or name
        self.blocks.append(Block(*given, role=role))
        return len(self.blocks) - 1

    def pave(self, surface: Sequence[Point], paving: Paving) -> None:
        """Lay paving stones on a surface."""
        # Stones end where the slope of the surface changes.
        breaks, levels = np.array(surface).T
        x: list[float] = []
        for a, b in pairwise(breaks):
            count = count_pieces(b - a, paving.length, "paving stones")
            x.extend(np.linspace(a, b, count + 1)[:-1])
        x.append(breaks[-1])
        points = zip(x, np.interp(x, breaks, levels), strict=True)
        for k, low in enumerate(pairwise(points), 1):
            high = [(px, py + paving.thickness) for px, py in reversed(low)]
            self.add([*low, *high], f"paving stone {k}", part="paving", structured=True)

    def check(self) -> None:
        """Check that no blocks cross themselves or overlap."""
        names = [block.name for block in self.blocks]
        check_overlaps([block.points for block in self.blocks], names)

    def _add_joint(self, pair: tuple[int, int], ends: Face, words: str, part: Part) -> None:
        """Add a joint."""
        name = f"{part.name}, {words}"
        self.joints.append(Joint(pair, *ends, self.contact, name, part.name, part.role))

    def _add_stone(self, outline: Sequence[Point], words: str, part: Part, **options: Any) -> int:
        """Add a block of a pier or sidewall and return its number."""
        name = f"{part.name}, {words}"
        return self.add(outline, name, part=part.name, role=part.role, **options)

    def _build_pier(self, pier: Pier, left: Sequence[Point], right: Sequence[Point]) -> int:
        """Build a pier under two springings; return the number of its skewback.

        Each leads along the intrados to the outermost joint of the ring, and across it.
        """
        (x0, y0), (x1, y1) = left[0], right[0]
        step = pier.height / count_pieces(pier.height, pier.course, f"courses of '{pier.name}'")
        if min(y0, y1) <= -step:
            raise InvalidStructure(
                f"'{pier.name}': rings begin below the uppermost course, of {step:.3g} m: give "
                "higher courses"
            )
        # flush with the intrados below, along the outermost joints of both rings above
        return self._build_skewback(pier, (x0, x1), step, [*right, *reversed(left)])

    def _build_skewback(self, pier: Pier, sides: Pair, step: float, top: Sequence[Point]) -> int:
        """Build the courses of a pier and the skewback on them; return the number of the latter."""
        below = self._build_courses(sides, (-pier.height, -step), pier)
        skewback = self._add_stone([(x, -step) for x in sides] + list(top), "skewback", pier)
        self._add_bed((below, skewback), sides, -step, pier)
        return skewback

    def _build_courses(self, sides: Pair, levels: Pair, part: Courses) -> int:
        """Build a foundation and courses between two levels; return the number of the top one."""
        (left, right), low = sides, levels[0]
        base = low - FOUNDATION_DEPTH
        under = [(left, base), (right, base), (right, low), (left, low)]
        below = self._add_stone(under, "foundation", part, fixed=True)
        return self._stack_courses(below, sides, levels, part)

    def _stack_courses(self, below: int, sides: Pair, levels: Pair, part: Courses) -> int:
        """Build courses on a block, between two levels; return the number of the top one."""
        low, high = levels
        if high - low < 1e-9:  # round-off of nothing to build
            return below
        count = count_pieces(high - low, part.course, f"courses of '{part.name}'")
        for y, top in pairwise(np.linspace(low, high, count + 1)):
            number = self._add_course(sides, (y, top), part)
            self._add_bed((below, number), sides, y, part)
            below = number
        return below

    def _add_course(self, sides: Pair, levels: Pair, part: Courses) -> int:
        """Add a rectangular course and return its number."""
        (left, right), (low, top) = sorted(sides), levels
        # Courses are numbered on above the skewback of a wall.
        count = sum(block.part == part.name and not block.fixed for block in self.blocks)
        outline = [(left, top), (left, low), (right, low), (right, top)]
        return self._add_stone(outline, f"course {count + 1}", part, structured=True)

    def _add_bed(self, pair: tuple[int, int], sides: Pair, level: float, part: Courses) -> None:
        """Add a horizontal joint between two courses."""
        left, right = ((float(x), float(level)) for x in sorted(sides))
        count = sum(joint.part == part.name for joint in self.joints)
        self._add_joint(pair, (left, right), f"joint {count}" if count else "base", part)

    def _build_end(self, face: Face, inward: float, walls: Sequence[Courses], bare: str) -> int:
        """Build the support of an outer springing; return the number of the block at the joint."""
        if not walls:
            outer, inner = face[1], face[0]
            radial = np.subtract(outer, inner)
            # a fixed block, half as deep as the springing joint is long, behind it
            back = inward * 0.5 * np.array([-radial[1], radial[0]])
            far = [tuple(np.add(point, back)) for point in (outer, inner)]
            return self.add([inner, outer, *far], bare, fixed=True, structured=True)
        if isinstance(walls[0], Pier):
            return self._build_end_pier(walls[0], face, inward)
        return self._build_wall(walls[0], face, inward)

    def _build_end_pier(self, pier: Pier, face: Face, inward: float) -> int:
        """Build a pier under a single springing at an end; return the number of its skewback."""
        (x, y), (edge, level) = face
        # from the clear springing, or from that of the centre line
        outer = 0.5 * (x + edge) - inward * pier.gap_beside(0.5 * abs(edge - x))
        step = pier.height / count_pieces(pier.height, pier.course, f"courses of '{pier.name}'")
        if not inward * (edge - outer) >= 0.0 or y <= -step:
            raise InvalidStructure(
                f"'{pier.name}': a ring does not stand on {_width_text(pier)} and a course "
                f"of {step:.3g} m: give a wider one or higher courses"
            )
        # Behind the only springing joint the skewback is level, out to its outer face.
        top = [(x, y), (edge, level), (outer, level)]
        return self._build_skewback(pier, (outer, x), step, top)

    def _build_wall(self, wall: Sidewall, face: Face, inward: float) -> int:
        """Build a sidewall; return the number of its skewback."""
        (x, y), (edge, level) = face
        steps = fill_ledge(face, inward, [wall])
        outer = steps[0][0]
        back = edge - inward * wall.setback
        room = inward * (back - outer)
        if room <= 0.0:
            raise InvalidStructure(
                f"'{wall.name}': nothing is left of its length {wall.length:.3g} m behind the ring "
                f"and the setback of {wall.setback:.3g} m: give it more length or less setback"
            )
        if wall.state == "fixed":
            outline = [(outer, -wall.height), (x, -wall.height), (x, y), (edge, level)]
            return self.add([*outline, *reversed(steps)], wall.name, role=wall.role, fixed=True)
        step = wall.height / count_pieces(wall.height, wall.course, f"courses of '{wall.name}'")
        below = self._build_courses((outer, x), (-wall.height, -step), wall)
        # The skewback reaches from the springing to the setback; courses stand behind it.
        corner = [(back, level)] if wall.setback > 0.0 else []
        outline = [(back, -step), (x, -step), (x, y), (edge, level), *corner]
        skewback = self._add_stone(outline, "skewback", wall)
        self._add_bed((below, skewback), (back, x), -step, wall)
        # the course behind the skewback, as high as both, and those above the springing on it
        behind = self._add_course((outer, back), (-step, level), wall)
        self._add_bed((below, behind), (outer, back), -step, wall)
        high = level + wall.above
        self._stack_courses(behind, (outer, back), (level, high), wall)
        if wall.state == "retained":
            # a fixed wall behind all courses, which touches but does not bond with them
            far = outer - inward * FOUNDATION_DEPTH
            corners = [(outer, -wall.height), (outer, high), (far, high), (far, -wall.height)]
            self._add_stone(corners, "retaining wall", wall, fixed=True)
        return skewback
