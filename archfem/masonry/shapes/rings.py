"""Single rings and columns, and a ring on two piers."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from math import asin, degrees, isfinite, pi, radians, sin

import numpy as np

from archfem.arguments import real, reals
from archfem.errors import InvalidStructure
from archfem.masonry.block import Block, Point
from archfem.masonry.materials import STONE, STONE_TO_STONE, Contact, Material
from archfem.masonry.structure import Joint, Structure
from archfem.units import G, in_degrees

MOST = 10_000
"""Voussoirs, or chords of each, beyond which nobody means it."""


def circular_arch(  # noqa: PLR0913  (all are lengths and properties of one ring)
    *,
    thickness: float,
    voussoirs: int,
    radius: float | None = None,
    embrace: float | str | None = None,
    span: float | None = None,
    rise: float | None = None,
    width: float = 1.0,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    chords: int | None = None,
    gravity: float = G,
) -> Structure:
    """Return a ring of equal voussoirs with radial joints between two fixed abutments.

    The circle is centred on the origin and its crown lies on the y axis. Blocks and joints are
    numbered from the left: block 0 is the left abutment and joint 0 the left springing.

    Args:
        thickness: ring depth t, from intrados to extrados [m].
        voussoirs: number of stones.
        radius: of the centre line [m]; goes with `embrace`.
        embrace: angle that the ring subtends, between its springing joints [degrees];
            a small one is given with its unit, "5 degree".
        span: clear span, at the intrados [m]; goes with `rise`, instead of the two above.
        rise: clear rise, at the intrados, at most half the span [m].
        width: out of plane [m].
        material: of the stones.
        contact: of the joints.
        chords: None makes stones that are true sectors of the ring; a number, stones whose faces
            follow the circle by so many straight pieces, each lighter than its sector by the
            fraction φ²/6 of the angle φ it subtends.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidInput: an angle looks like radians.
        InvalidStructure: the lengths do not make a ring.

    Example:
        >>> ring = af.circular_arch(radius=2.95, embrace=159.0, thickness=0.55, voussoirs=17)
        >>> len(ring.blocks), len(ring.joints), round(ring.weight)
        (19, 18, 90051)
    """
    real(thickness, "thickness [m]")
    radius, embrace = _circle(radius, embrace, span, rise, thickness)
    if not 0.0 < thickness < 2.0 * radius:
        raise InvalidStructure(
            f"thickness {thickness:.3g} m is not between 0 and twice the radius {radius:.3g} m"
        )
    if not 0.0 < embrace < 360.0:
        raise InvalidStructure(f"embrace {embrace:.4g}° is not between 0° and 360°: give degrees")
    pieces = 1 if chords is None else chords
    for key, count in (("voussoirs", voussoirs), ("chords", pieces)):
        if not 1 <= real(count, key) <= MOST or count != int(count):
            raise InvalidStructure(f"{key} {count} is not a whole number from 1 to {MOST}")
    voussoirs, pieces = int(voussoirs), int(pieces)
    turn = embrace / voussoirs / pieces
    if turn > 120.0:
        raise InvalidStructure(f"a stone turns {turn:.4g}° in one piece: use more voussoirs")

    half = radians(embrace) / 2.0
    angles = np.linspace(-half, half, voussoirs * pieces + 1)
    inner, outer = radius - thickness / 2.0, radius + thickness / 2.0
    faces = [(_on_circle(inner, a), _on_circle(outer, a)) for a in angles]
    centre = (0.0, 0.0) if chords is None else None
    stones = [
        stone_between(
            faces[k * pieces : (k + 1) * pieces + 1], material, f"voussoir {k + 1}", centre
        )
        for k in range(voussoirs)
    ]
    depth = thickness / 2.0 if half < 0.5 * pi else min(thickness / 2.0, 0.9 * inner * sin(half))
    left = abutment_behind(faces[0], -1.0, depth, material, "left abutment")
    right = abutment_behind(faces[-1], 1.0, depth, material, "right abutment")
    joints = [
        Joint((k, k + 1), *faces[k * pieces], contact, f"joint {k}", "arch", "ring")
        for k in range(voussoirs + 1)
    ]
    return Structure((left, *stones, right), tuple(joints), width, gravity, "circular arch")


def column(
    *,
    breadth: float,
    heights: Sequence[float],
    width: float = 1.0,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    gravity: float = G,
) -> Structure:
    """Return rectangular blocks on a fixed base; one block is the classical rocking block.

    Joint 0 is the base. Its "intrados" is the left edge and its "extrados" the right one, so that
    eccentricity is positive to the right. The base's mid-point is the origin.

    Args:
        breadth: of all blocks [m].
        heights: of the blocks, from below [m].
        width: out of plane [m].
        material: of the blocks.
        contact: of the joints.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidStructure: a length is not positive.

    Example:
        >>> [joint.name for joint in af.column(breadth=0.6, heights=[1.2, 1.2]).joints]
        ['joint 0', 'joint 1']
    """
    heights = reals(heights, "heights of the blocks [m]")
    if real(breadth, "breadth [m]") <= 0.0 or not heights or min(heights) <= 0.0:
        raise InvalidStructure(
            f"a column of breadth {breadth} m and heights {list(heights)} m: give lengths above 0"
        )
    half = breadth / 2.0
    levels = [-0.2 * min(heights), 0.0, *np.cumsum(heights).tolist()]
    blocks = [
        Block(
            ((-half, top), (-half, low), (half, low), (half, top)),
            material,
            f"block {k}" if k else "base",
            fixed=k == 0,
            corners=(0, 1, 2, 3),
            part="column",
            role="pier",
        )
        for k, (low, top) in enumerate(pairwise(levels))
    ]
    joints = [
        Joint((k, k + 1), (-half, y), (half, y), contact, f"joint {k}", "column", "pier")
        for k, y in enumerate(levels[1:-1])
    ]
    return Structure(tuple(blocks), tuple(joints), width, gravity, "column")


def arch_on_piers(  # noqa: PLR0913  (all are lengths and properties of one structure)
    *,
    radius: float,
    thickness: float,
    voussoirs: int,
    pier_breadth: float,
    courses: Sequence[float],
    width: float = 1.0,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    chords: int | None = None,
    gravity: float = G,
) -> Structure:
    """Return a semicircular ring on two piers, centred under its feet.

    Blocks and joints are numbered from the foot of the left pier over the ring to the foot of the
    right one: block 0 is the left foundation and joint 0 the left base. "Intrados" is the side of
    the opening throughout. Joints belong to the parts "left pier", "arch" and "right pier"; the
    springings belong to the arch.

    Args:
        radius: of the ring's centre line, which is centred on the origin [m].
        thickness: of the ring [m].
        voussoirs: number of stones in the ring.
        pier_breadth: of both piers, at least the thickness of the ring [m].
        courses: heights of the courses of each pier, from below [m].
        width: out of plane [m].
        material: of all blocks.
        contact: of all joints.
        chords: as for `circular_arch`.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidStructure: the lengths do not make a ring, or it does not stand on its piers.
    """
    ring = circular_arch(
        radius=radius, thickness=thickness, embrace=180.0, voussoirs=voussoirs, chords=chords
    )
    courses = reals(courses, "heights of the courses [m]")
    if not thickness <= real(pier_breadth, "pier_breadth [m]") < 2.0 * radius:
        raise InvalidStructure(
            f"pier_breadth {pier_breadth:.3g} m is not between the ring's thickness "
            f"{thickness:.3g} m and twice its radius {radius:.3g} m"
        )
    if not courses or min(courses) <= 0.0:
        raise InvalidStructure(f"courses {list(courses)} m: give at least one height above 0")
    levels = [0.0, *np.cumsum(courses).tolist()]
    levels = [level - levels[-1] for level in [-0.2 * min(courses), *levels]]
    left = _pier(-radius, pier_breadth, levels, material, "left pier")
    right = _pier(radius, pier_breadth, levels, material, "right pier")
    stones = tuple(replace(stone, material=material) for stone in ring.blocks[1:-1])
    blocks = (*left, *stones, *reversed(right))
    inner = -radius + pier_breadth / 2.0, radius - pier_breadth / 2.0
    outer = -radius - pier_breadth / 2.0, radius + pier_breadth / 2.0
    beds = [((inner[0], y), (outer[0], y), "left pier", "pier") for y in levels[1:-1]]
    beds += [(each.intrados, each.extrados, "arch", "ring") for each in ring.joints]
    beds += [((inner[1], y), (outer[1], y), "right pier", "pier") for y in reversed(levels[1:-1])]
    joints = tuple(
        Joint((k, k + 1), intrados, extrados, contact, f"joint {k}", part, role)
        for k, (intrados, extrados, part, role) in enumerate(beds)
    )
    return Structure(blocks, joints, width, gravity, "arch on piers")


def _pier(
    middle: float, breadth: float, levels: Sequence[float], material: Material, part: str
) -> list[Block]:
    """Foundation and courses between levels, from below."""
    left, right = middle - breadth / 2.0, middle + breadth / 2.0
    return [
        Block(
            ((left, top), (left, low), (right, low), (right, top)),
            material,
            f"{part} course {k}" if k else f"{part} foundation",
            fixed=k == 0,
            corners=(0, 1, 2, 3),
            part=part,
            role="pier",
        )
        for k, (low, top) in enumerate(pairwise(levels))
    ]


def _circle(
    radius: float | None,
    embrace: float | str | None,
    span: float | None,
    rise: float | None,
    thickness: float,
) -> tuple[float, float]:
    """Radius of the centre line and embrace, from whichever pair was given."""
    given = {"radius [m]": radius, "span [m]": span, "rise [m]": rise}
    for name, value in given.items():
        if value is not None:
            real(value, name)
    if radius is not None and embrace is not None and span is None and rise is None:
        return radius, in_degrees(embrace, "embrace")
    if span is None or rise is None or radius is not None or embrace is not None:
        raise InvalidStructure("give a ring either radius and embrace, or span and rise")
    if not 0.0 < rise <= span / 2.0:
        raise InvalidStructure(
            f"rise {rise:.4g} m is not between 0 and half the span {span:.4g} m: a circular arch "
            "is at most a semicircle by span and rise; give radius and embrace beyond"
        )
    inner = (span / 2.0 * (span / 2.0 / rise) + rise) / 2.0
    if not isfinite(inner):
        raise InvalidStructure(
            f"span {span:.4g} m and rise {rise:.4g} m make no circle: give both in metres"
        )
    return inner + thickness / 2.0, degrees(2.0 * asin(min(1.0, span / 2.0 / inner)))


def _on_circle(radius: float, angle: float) -> Point:
    """Point at an angle from the crown, positive to the right."""
    return (float(radius * np.sin(angle)), float(radius * np.cos(angle)))


def stone_between(
    faces: Sequence[tuple[Point, Point]], material: Material, name: str, centre: Point | None
) -> Block:
    """Return a voussoir from its radial sections.

    Args:
        faces: intrados and extrados of each section, left to right [m].
        material: of the stone.
        name: of the stone.
        centre: of the arcs, or None for straight faces [m].
    """
    intrados = [face[0] for face in faces]
    extrados = [face[1] for face in reversed(faces)]
    n = len(faces)
    corners = (0, n - 1, n, 2 * n - 1)
    outline = (*intrados, *extrados)
    return Block(outline, material, name, corners=corners, part="arch", centre=centre, role="ring")


def abutment_behind(
    face: tuple[Point, Point], side: float, depth: float, material: Material, name: str
) -> Block:
    """Return the fixed block behind a springing joint.

    Args:
        face: the joint's intrados and extrados [m].
        side: -1 at the left and 1 at the right.
        depth: of the block, across the joint [m].
        material: of the block.
        name: of the block and its part.
    """
    inner, outer = np.array(face[0]), np.array(face[1])
    radial = (outer - inner) / np.linalg.norm(outer - inner)
    shift = side * depth * np.array([radial[1], -radial[0]])
    near, far = (face[0], face[1]), (tuple(inner + shift), tuple(outer + shift))
    start, end = (near, far) if side > 0 else (far, near)
    outline = tuple((float(x), float(y)) for x, y in (start[0], end[0], end[1], start[1]))
    return Block(outline, material, name, fixed=True, corners=(0, 1, 2, 3), part=name, role="other")
