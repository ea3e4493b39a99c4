"""Single arches (circular, pointed, elliptical, flat, any curve), columns, an arch on piers.

Stones of other curves than circles are polygons whose faces follow the curve by chords. Joints are
normal to the intrados, or converge in a flat arch. Block 0 is the left abutment and joint 0 the
left springing.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import acos, asin, atan2, degrees, isfinite, pi, radians, sin, tan
from typing import Any

import numpy as np

from archfem._typing import Angle, Array, Metres, MetresPerSecondSquared
from archfem._validation import (
    check_between,
    check_integer,
    check_number,
    check_numbers,
    validate_arguments,
)
from archfem.errors import InvalidStructure
from archfem.masonry.block import Block, Point, as_point, check_points, measure_path
from archfem.masonry.materials import STONE, STONE_TO_STONE, Contact, Material
from archfem.masonry.structure import Joint, Structure, record_origin
from archfem.units import G, in_degrees

# Intrados and extrados of a stone, each from left to right (n, 2) [m]
Faces = tuple[Array, Array]


@dataclass(frozen=True)
class RingGeometry:
    """Division of a ring into stones, and the properties that all its blocks and joints share."""

    thickness: float  # [m]
    voussoirs: int  # number of stones
    chords: int  # straight pieces of each face of a stone
    width: float  # out of plane [m]
    material: Material
    contact: Contact
    gravity: float  # [m/s²]

    def check(self, **lengths: float) -> None:
        """Check the numbers of stones and chords, the thickness, and further lengths [m]."""
        check_integer(self.voussoirs, "voussoirs", maximum=10_000)
        check_integer(self.chords, "chords", maximum=10_000)
        # both may be within bounds, and their product beyond the memory
        check_integer(self.voussoirs * self.chords, "voussoirs times chords", maximum=10**6)
        for key, value in {"thickness": self.thickness, **lengths}.items():
            # A ring of a kilometre is a mistake of units.
            check_between(value, f"{key} [m]", 0.0, 1e3, error=InvalidStructure)

    def split(self, inner: Array, outer: Array) -> list[Faces]:
        """Divide points along intrados and extrados, from left to right, into those of stones."""
        # Neighbours share the points of their joint.
        ends = [(k * self.chords, (k + 1) * self.chords + 1) for k in range(self.voussoirs)]
        return [(inner[a:b], outer[a:b]) for a, b in ends]

    def divide(self, section: Callable[[Array], Faces]) -> list[Faces]:
        """Return the faces of equal stones from a parametrisation of intrados and extrados."""
        return self.split(*section(np.linspace(0.0, 1.0, self.voussoirs * self.chords + 1)))

    def assemble(
        self,
        stones: Sequence[Faces],
        name: str,
        centre: Point | None = None,
        abutment_depth: float | None = None,
    ) -> Structure:
        """Assemble stones, from left to right, between two fixed abutments."""
        faces = [(as_point(inner[0]), as_point(outer[0])) for inner, outer in stones]
        faces.append((as_point(stones[-1][0][-1]), as_point(stones[-1][1][-1])))
        of_ring: dict[str, Any] = {"part": "arch", "centre": centre, "role": "ring"}
        blocks = []
        for k, (inner, outer) in enumerate(stones, 1):
            # anticlockwise: along the intrados, and back along the extrados
            outline = tuple(map(as_point, (*inner, *outer[::-1])))
            corners = 0, len(inner) - 1, len(inner), len(outline) - 1
            name_of_stone = f"voussoir {k}"
            blocks.append(Block(outline, self.material, name_of_stone, corners=corners, **of_ring))
        half = 0.5 * float(np.linalg.norm(np.subtract(*faces[0])))
        depth = half if abutment_depth is None else abutment_depth
        left = _build_abutment(faces[0], -1.0, depth, self.material, "left abutment")
        right = _build_abutment(faces[-1], 1.0, depth, self.material, "right abutment")
        joints = [
            Joint((k, k + 1), *face, self.contact, f"joint {k}", "arch", "ring")
            for k, face in enumerate(faces)
        ]
        return Structure((left, *blocks, right), tuple(joints), self.width, self.gravity, name)


@record_origin
def circular_arch(  # noqa: PLR0913  (all are lengths and properties of one ring)
    *,
    thickness: Metres,
    voussoirs: int,
    radius: Metres | None = None,
    embrace: Angle | None = None,
    span: Metres | None = None,
    rise: Metres | None = None,
    width: Metres = 1.0,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    chords: int | None = None,
    gravity: MetresPerSecondSquared = G,
) -> Structure:
    """Return a ring of equal voussoirs with radial joints between two fixed abutments.

    The circle is centred on the origin and its crown lies on the y axis. Blocks and joints are
    numbered from the left: block 0 is the left abutment and joint 0 the left springing.

    Args:
        thickness: ring depth t, from intrados to extrados [m].
        voussoirs: number of stones.
        radius: radius of the centre line [m]; together with `embrace`.
        embrace: angle between the springing joints [degrees]; a small one with its unit,
            "5 degree".
        span: clear span, at the intrados [m]; together with `rise` or `embrace`.
        rise: clear rise, at the intrados, at most half the span [m].
        width: out of plane [m].
        material: material of the stones.
        contact: contact of the joints.
        chords: None for stones that are true sectors of the ring; or the number of straight pieces
            of each face. A stone is then lighter than its sector by the fraction φ²/6, with φ the
            angle of a piece.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidInput: an angle looks like radians.
        InvalidStructure: the lengths do not form a ring.

    Example:
        >>> ring = af.circular_arch(radius=2.95, embrace=159.0, thickness=0.55, voussoirs=17)
        >>> len(ring.blocks), len(ring.joints), round(ring.weight)
        (19, 18, 90051)
    """
    check_number(thickness, "thickness [m]")
    radius, embrace = _resolve_circle(radius, embrace, span, rise, thickness)
    if not 0.0 < thickness < 2.0 * radius:
        raise InvalidStructure(
            f"thickness {thickness:.3g} m is not between 0 and twice the radius {radius:.3g} m"
        )
    voussoirs, pieces = _check_division(embrace, voussoirs, 1 if chords is None else chords)
    half = radians(embrace) / 2.0
    angles = np.linspace(-half, half, voussoirs * pieces + 1)
    inner, outer = radius - thickness / 2.0, radius + thickness / 2.0
    unit = np.column_stack([np.sin(angles), np.cos(angles)])
    # Sectors have their true area and centroid; stones with chords are plain polygons.
    centre = (0.0, 0.0) if chords is None else None
    # Beyond a semicircle the abutments approach each other: they must not meet.
    depth = thickness / 2.0 if half < 0.5 * pi else min(thickness / 2.0, 0.9 * inner * sin(half))
    ring = RingGeometry(thickness, voussoirs, pieces, width, material, contact, gravity)
    return ring.assemble(ring.split(inner * unit, outer * unit), "circular arch", centre, depth)


def _check_division(embrace: float, voussoirs: int, pieces: int) -> tuple[int, int]:
    """Check the number of voussoirs and of straight pieces of each."""
    for key, count in (("voussoirs", voussoirs), ("chords", pieces)):
        if not 1 <= check_number(count, key) <= 10_000 or count != int(count):
            raise InvalidStructure(f"{key} {count} is not a whole number from 1 to 10000")
    turn = embrace / int(voussoirs) / int(pieces)
    if turn > 120.0:
        raise InvalidStructure(f"a stone turns {turn:.4g}° in one piece: use more voussoirs")
    return int(voussoirs), int(pieces)


@record_origin
def column(
    *,
    breadth: Metres,
    heights: Sequence[Metres],
    width: Metres = 1.0,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    gravity: MetresPerSecondSquared = G,
    above: Metres | None = None,
) -> Structure:
    """Return rectangular blocks on a fixed base; one block is the classical rocking block.

    Joint 0 is the base. Its "intrados" is the left edge and its "extrados" the right one, so that
    eccentricity is positive to the right. The base's mid-point is the origin.

    Args:
        breadth: breadth of all blocks [m].
        heights: heights of the blocks, from below [m].
        width: out of plane [m].
        material: material of the blocks.
        contact: contact of the joints.
        gravity: acceleration of gravity [m/s²].
        above: of a wall across its plane, height of its foot above the ground [m].

    Raises:
        InvalidStructure: a length is not positive.

    Example:
        >>> [joint.name for joint in af.column(breadth=0.6, heights=[1.2, 1.2]).joints]
        ['joint 0', 'joint 1']
    """
    heights = check_numbers(heights, "heights of the blocks [m]")
    if check_number(breadth, "breadth [m]") <= 0.0 or not heights or min(heights) <= 0.0:
        raise InvalidStructure(
            f"a column of breadth {breadth} m and heights {list(heights)} m: give lengths above 0"
        )
    half, levels = breadth / 2.0, _bed_levels(heights)
    blocks = _stack_blocks(0.0, breadth, levels, material)
    joints = [
        Joint((k, k + 1), (-half, y), (half, y), contact, f"joint {k}", "column", "pier")
        for k, y in enumerate(levels[1:-1])
    ]
    return Structure(tuple(blocks), tuple(joints), width, gravity, "column", above=above)


@record_origin
def arch_on_piers(  # noqa: PLR0913  (all are lengths and properties of one structure)
    *,
    radius: Metres,
    thickness: Metres,
    voussoirs: int,
    pier_breadth: Metres,
    courses: Sequence[Metres],
    width: Metres = 1.0,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    chords: int | None = None,
    gravity: MetresPerSecondSquared = G,
) -> Structure:
    """Return a semicircular ring on two piers, centred under its feet.

    Blocks and joints are numbered from the foot of the left pier over the ring to the foot of the
    right one: block 0 is the left foundation and joint 0 the left base. "Intrados" is the side of
    the opening throughout. Joints belong to the parts "left pier", "arch" and "right pier"; the
    springings belong to the arch.

    Args:
        radius: radius of the ring's centre line, which is centred on the origin [m].
        thickness: thickness of the ring [m].
        voussoirs: number of stones in the ring.
        pier_breadth: breadth of both piers, centred under the feet of the ring, at least its
            thickness [m].
        courses: heights of the courses of each pier, from below [m].
        width: out of plane [m].
        material: material of all blocks.
        contact: contact of all joints.
        chords: as for `circular_arch`.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidStructure: the lengths do not form a ring, or it does not rest on its piers.
    """
    stones: dict[str, Any] = {"thickness": thickness, "voussoirs": voussoirs, "material": material}
    ring = circular_arch(radius=radius, embrace=180.0, chords=chords, **stones)
    heights = check_numbers(courses, "heights of the courses [m]")
    if not thickness <= check_number(pier_breadth, "pier_breadth [m]") < 2.0 * radius:
        raise InvalidStructure(
            f"pier_breadth {pier_breadth:.3g} m is not between the ring's thickness "
            f"{thickness:.3g} m and twice its radius {radius:.3g} m"
        )
    if not heights or min(heights) <= 0.0:
        raise InvalidStructure(f"courses {list(heights)} m: give at least one height above 0")
    levels = _bed_levels(heights)
    # The springings are at y = 0, at the level of the centre of the ring.
    levels = [level - levels[-1] for level in levels]
    left = _stack_blocks(-radius, pier_breadth, levels, material, "left pier")
    right = _stack_blocks(radius, pier_breadth, levels, material, "right pier")
    # The top courses of the piers take the place of the abutments.
    blocks = (*left, *ring.blocks[1:-1], *reversed(right))
    inner, outer = radius - pier_breadth / 2.0, radius + pier_breadth / 2.0
    beds = [((-inner, y), (-outer, y), "left pier", "pier") for y in levels[1:-1]]
    beds += [(each.intrados, each.extrados, "arch", "ring") for each in ring.joints]
    beds += [((inner, y), (outer, y), "right pier", "pier") for y in reversed(levels[1:-1])]
    joints = tuple(
        Joint((k, k + 1), intrados, extrados, contact, f"joint {k}", part, role)
        for k, (intrados, extrados, part, role) in enumerate(beds)
    )
    return Structure(blocks, joints, width, gravity, "arch on piers")


def _bed_levels(heights: Sequence[float]) -> list[float]:
    """Return the levels of the beds of courses above y = 0, and of the base of a foundation."""
    # The depth of the foundation is arbitrary: it does not deform.
    return [-0.2 * min(heights), 0.0, *np.cumsum(heights).tolist()]


def _stack_blocks(
    middle: float, breadth: float, levels: Sequence[float], material: Material, pier: str = ""
) -> list[Block]:
    """Build rectangular blocks of a pier or a column; the lowest is fixed and has its own name."""
    base, course = (f"{pier} foundation", f"{pier} course") if pier else ("base", "block")
    left, right, blocks = middle - breadth / 2.0, middle + breadth / 2.0, []
    for k, (low, top) in enumerate(pairwise(levels)):
        outline = (left, top), (left, low), (right, low), (right, top)
        name, part = f"{course} {k}" if k else base, pier or "column"
        blocks.append(Block(outline, material, name, k == 0, (0, 1, 2, 3), part, role="pier"))
    return blocks


def _resolve_circle(
    radius: float | None, embrace: Any, span: float | None, rise: float | None, thickness: float
) -> tuple[float, float]:
    """Return radius of the centre line and embrace from one of three pairs."""
    for value, name in ((radius, "radius [m]"), (span, "span [m]"), (rise, "rise [m]")):
        if value is not None:
            check_number(value, name, minimum=0.0)
    if embrace is not None:
        embrace = in_degrees(embrace, "embrace")
        check_between(embrace, "embrace [°]", 0.0, 360.0, error=InvalidStructure)
    if radius is not None and embrace is not None and span is None and rise is None:
        return radius, embrace
    if span is None or radius is not None or (rise is None) == (embrace is None):
        raise InvalidStructure(
            "give a ring two of its numbers: span and rise, span and embrace, or radius and embrace"
        )
    if rise is None:
        return span / (2.0 * sin(radians(embrace) / 2.0)) + thickness / 2.0, embrace
    if not 0.0 < rise <= span / 2.0:
        raise InvalidStructure(
            f"rise {rise:.4g} m is not between 0 and half the span {span:.4g} m: a circular arch "
            "is at most a semicircle by span and rise; give span and embrace beyond"
        )
    inner = (span / 2.0 * (span / 2.0 / rise) + rise) / 2.0
    if not isfinite(inner):
        raise InvalidStructure(
            f"span {span:.4g} m and rise {rise:.4g} m make no circle: give both in metres"
        )
    return inner + thickness / 2.0, degrees(2.0 * asin(min(1.0, span / 2.0 / inner)))


def _build_abutment(
    face: tuple[Point, Point], side: float, depth: float, material: Material, name: str
) -> Block:
    """Build the fixed block behind a springing joint."""
    near = np.array(face)
    radial = (near[1] - near[0]) / np.linalg.norm(near[1] - near[0])
    far = near + side * depth * np.array([radial[1], -radial[0]])
    start, end = (near, far) if side > 0 else (far, near)
    outline = tuple((float(x), float(y)) for x, y in (start[0], end[0], end[1], start[1]))
    return Block(outline, material, name, fixed=True, corners=(0, 1, 2, 3), part=name, role="other")


@record_origin
@validate_arguments
def pointed_arch(  # noqa: PLR0913  (all are lengths and properties of one ring)
    *,
    span: Metres,
    rise: Metres,
    thickness: Metres,
    voussoirs: int,
    chords: int = 4,
    width: Metres = 1.0,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    gravity: MetresPerSecondSquared = G,
) -> Structure:
    """Return a pointed arch of two circular arcs centred on the springing level.

    The arcs have the radius (span²/4 + rise²) / span. Even numbers of stones meet in a vertical
    joint at the crown; odd ones have a keystone there.

    Args:
        span: clear, at the intrados [m].
        rise: clear, at the intrados, at least half the span [m].
        thickness: thickness of the ring, along its joints except that at the crown, which is longer
            [m].
        voussoirs: number of stones.
        chords: straight pieces of each face of a stone.
        width: out of plane [m].
        material: material of the stones.
        contact: contact of the joints.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidStructure: the lengths do not form a pointed arch.
    """
    ring = RingGeometry(thickness, voussoirs, chords, width, material, contact, gravity)
    ring.check(span=span, rise=rise)
    if rise < span / 2.0:
        raise InvalidStructure(
            f"rise {rise:.4g} m is below half the span {span:.4g} m: that is no pointed arch; give "
            "circular_arch(span=…, rise=…) for a flatter one"
        )
    radius = (span**2 / 4.0 + rise**2) / span
    centre = radius - span / 2.0
    # The extrados of both arcs meets above the apex, at a smaller angle than the intrados.
    top, outer_top = atan2(rise, centre), acos(centre / (radius + thickness))
    # Stones are equally long; an odd number leaves half a keystone at the top of each half.
    turns = top * np.minimum(2.0 * np.arange(voussoirs // 2 + 2) / voussoirs, 1.0)

    def arc(start: float, end: float, size: float) -> Array:
        angles = np.linspace(start, end, chords + 1)
        return np.column_stack([centre - size * np.cos(angles), size * np.sin(angles)])

    left = []
    for start, end in pairwise(turns[: (voussoirs + 1) // 2 + 1]):
        far = outer_top if end == top else end
        left.append((arc(start, end, radius), arc(start, far, radius + thickness)))
    return ring.assemble(_mirror_stones(left, voussoirs), "pointed arch")


@record_origin
@validate_arguments
def elliptical_arch(  # noqa: PLR0913  (all are lengths and properties of one ring)
    *,
    span: Metres,
    rise: Metres,
    thickness: Metres,
    voussoirs: int,
    chords: int = 4,
    width: Metres = 1.0,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    gravity: MetresPerSecondSquared = G,
) -> Structure:
    """Return an arch whose intrados is half an ellipse, of stones of equal length along it.

    Args:
        span: clear, at the intrados [m].
        rise: clear, at the intrados; half the span makes a semicircle [m].
        thickness: thickness of the ring, at right angles to the intrados [m].
        voussoirs: number of stones.
        chords: straight pieces of each face of a stone.
        width: out of plane [m].
        material: material of the stones.
        contact: contact of the joints.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidStructure: the lengths do not form an arch.
    """
    ring = RingGeometry(thickness, voussoirs, chords, width, material, contact, gravity)
    ring.check(span=span, rise=rise)
    half = span / 2.0
    angles = np.linspace(0.0, np.pi, 4001)  # the length of the ellipse is exact to 1e-7

    def points(angle: Array) -> Array:
        return np.column_stack([-half * np.cos(angle), rise * np.sin(angle)])

    distances = measure_path(points(angles))

    def section(share: Array) -> Faces:
        # The length of an ellipse has no closed form: its inverse is interpolated.
        angle = np.interp(share * distances[-1], distances, angles)
        normal = np.column_stack([-rise * np.cos(angle), half * np.sin(angle)])
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        return points(angle), points(angle) + thickness * normal

    return ring.assemble(ring.divide(section), "elliptical arch")


@record_origin
@validate_arguments
def flat_arch(
    *,
    span: Metres,
    thickness: Metres,
    voussoirs: int,
    skewback: Angle,
    width: Metres = 1.0,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    gravity: MetresPerSecondSquared = G,
) -> Structure:
    """Return a flat arch with horizontal faces, whose joints converge in one point below.

    Args:
        span: clear, at the soffit, which is divided equally [m].
        thickness: height of the stones [m].
        voussoirs: number of stones.
        skewback: angle of the springing joints from the vertical [degrees].
        width: out of plane [m].
        material: material of the stones.
        contact: contact of the joints.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidInput: the angle looks like radians.
        InvalidStructure: the lengths do not form an arch.
    """
    ring = RingGeometry(thickness, voussoirs, 1, width, material, contact, gravity)
    ring.check(span=span)
    angle = in_degrees(skewback, "skewback")
    options: Any = {"remedy": "try 20°", "error": InvalidStructure}
    check_between(angle, "skewback [°]", 0.0, 60.0, **options)
    # all joints meet in one point below, so that top and soffit are divided into equal shares
    top = span + 2.0 * thickness * tan(np.radians(angle))

    def section(share: Array) -> Faces:
        x, height = share - 0.5, np.full_like(share, thickness)
        return np.column_stack([span * x, np.zeros_like(x)]), np.column_stack([top * x, height])

    return ring.assemble(ring.divide(section), "flat arch")


@record_origin
def arch_along(
    intrados: Sequence[Point] | Array,
    *,
    thickness: Metres,
    voussoirs: int,
    chords: int = 4,
    width: Metres = 1.0,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    gravity: MetresPerSecondSquared = G,
) -> Structure:
    """Return an arch along any intrados, of stones of equal length along it.

    Args:
        intrados: points from one springing to the other, connected by straight lines (n, 2) [m];
            normals are computed from three neighbours, so the points must resolve the curvature.
        thickness: thickness of the ring, at right angles to the intrados [m].
        voussoirs: number of stones.
        chords: straight pieces of each face of a stone.
        width: out of plane [m].
        material: material of the stones.
        contact: contact of the joints.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidInput: the points are no rows of two numbers.
        InvalidStructure: they are fewer than three, two consecutive ones coincide, or the ring
            crosses itself.
    """
    ring = RingGeometry(thickness, voussoirs, chords, width, material, contact, gravity)
    ring.check()
    points = np.array(check_points(intrados, "intrados"))
    if len(points) < 3 or np.any(np.all(np.diff(points, axis=0) == 0.0, axis=1)):
        raise InvalidStructure(
            f"an intrados of {len(points)} points: give at least three, no two alike in a row"
        )
    # Stones are numbered from the left, whichever way the points are listed.
    points = points if points[0, 0] < points[-1, 0] else points[::-1]
    distances = measure_path(points)
    slope = np.gradient(points, distances, axis=0, edge_order=2)

    def section(share: Array) -> Faces:
        at = share * distances[-1]
        x, y, ahead, up = (np.interp(at, distances, each) for each in (*points.T, *slope.T))
        normal = np.column_stack([-up, ahead]) / np.hypot(up, ahead)[:, None]
        inner = np.column_stack([x, y])
        return inner, inner + thickness * normal

    return ring.assemble(ring.divide(section), "arch")


def _mirror_stones(left: list[Faces], count: int) -> list[Faces]:
    """Return the faces of all stones from the left half; for an odd count the last is a half."""

    def mirror(points: Array) -> Array:
        return points[::-1] * (-1.0, 1.0)

    right = [(mirror(inner), mirror(outer)) for inner, outer in reversed(left)]
    if count % 2 == 0:
        return [*left, *right]
    # The halves of the keystone share the point at the crown.
    inner, outer = (np.concatenate([a, b[1:]]) for a, b in zip(left[-1], right[0], strict=True))
    return [*left[:-1], (inner, outer), *right[1:]]
