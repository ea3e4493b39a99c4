"""Rings along other curves than one circle: pointed, elliptical, flat, and along any intrados.

Stones are polygons: their faces follow the curve by chords. Joints stand at right angles to the
intrados, or converge in a flat arch; block 0 is the left abutment and joint 0 the left springing.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise
from math import acos, atan2, tan

import numpy as np

from archfem.arguments import real, reals, row, whole
from archfem.arrays import Array
from archfem.errors import InvalidStructure
from archfem.masonry.block import Block, Point
from archfem.masonry.materials import STONE, STONE_TO_STONE, Contact, Material
from archfem.masonry.shapes.rings import abutment_behind
from archfem.masonry.structure import Joint, Structure
from archfem.units import G, in_degrees

Faces = tuple[Array, Array]
"""Intrados and extrados of a stone, each from left to right (n, 2) [m]."""

FINE = 4001
"""Points of a curve between which its length is summed: for an ellipse to 1e-7 of it."""


def pointed_arch(  # noqa: PLR0913  (all are lengths and properties of one ring)
    *,
    span: float,
    rise: float,
    thickness: float,
    voussoirs: int,
    chords: int = 4,
    width: float = 1.0,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    gravity: float = G,
) -> Structure:
    """Return a pointed arch of two circular arcs centred on the springing level.

    The arcs have the radius (span²/4 + rise²) / span. Even numbers of stones meet in an upright
    joint at the crown; odd ones have a keystone there.

    Args:
        span: clear, at the intrados [m].
        rise: clear, at the intrados, at least half the span [m].
        thickness: of the ring, along its joints but that at the crown, which is longer [m].
        voussoirs: number of stones.
        chords: straight pieces of each face of a stone.
        width: out of plane [m].
        material: of the stones.
        contact: of the joints.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidStructure: the lengths do not make a pointed arch.
    """
    _check(thickness, voussoirs, chords, span=span, rise=rise)
    if rise < span / 2.0:
        raise InvalidStructure(
            f"rise {rise:.4g} m is below half the span {span:.4g} m: that is no pointed arch; give "
            "circular_arch(span=…, rise=…) for a flatter one"
        )
    radius = (span**2 / 4.0 + rise**2) / span
    centre = radius - span / 2.0
    top, outer_top = atan2(rise, centre), acos(centre / (radius + thickness))
    turns = np.minimum(2.0 * top / voussoirs * np.arange(voussoirs // 2 + 2), top)

    def arc(start: float, end: float, size: float) -> Array:
        angles = np.linspace(start, end, chords + 1)
        return np.column_stack([centre - size * np.cos(angles), size * np.sin(angles)])

    left = []
    for start, end in pairwise(turns[: (voussoirs + 1) // 2 + 1]):
        far = outer_top if end == top else end
        left.append((arc(start, end, radius), arc(start, far, radius + thickness)))
    return _ring(_mirrored(left, voussoirs), width, material, contact, gravity, "pointed arch")


def elliptical_arch(  # noqa: PLR0913  (all are lengths and properties of one ring)
    *,
    span: float,
    rise: float,
    thickness: float,
    voussoirs: int,
    chords: int = 4,
    width: float = 1.0,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    gravity: float = G,
) -> Structure:
    """Return an arch whose intrados is half an ellipse, of stones equally long along it.

    Args:
        span: clear, at the intrados [m].
        rise: clear, at the intrados; half the span makes a semicircle [m].
        thickness: of the ring, at right angles to the intrados [m].
        voussoirs: number of stones.
        chords: straight pieces of each face of a stone.
        width: out of plane [m].
        material: of the stones.
        contact: of the joints.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidStructure: the lengths do not make an arch.
    """
    _check(thickness, voussoirs, chords, span=span, rise=rise)
    half = span / 2.0
    angles = np.linspace(0.0, np.pi, FINE)
    walked = _lengths(np.column_stack([-half * np.cos(angles), rise * np.sin(angles)]))

    def section(share: Array) -> Faces:
        angle = np.interp(share * walked[-1], walked, angles)
        normal = np.column_stack([-rise * np.cos(angle), half * np.sin(angle)])
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        points = np.column_stack([-half * np.cos(angle), rise * np.sin(angle)])
        return points, points + thickness * normal

    stones = _stones(section, voussoirs, chords)
    return _ring(stones, width, material, contact, gravity, "elliptical arch")


def flat_arch(
    *,
    span: float,
    thickness: float,
    voussoirs: int,
    skewback: float | str,
    width: float = 1.0,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    gravity: float = G,
) -> Structure:
    """Return a flat arch, level above and below, whose joints meet in one point under its middle.

    Args:
        span: clear, at the soffit, which is parted equally [m].
        thickness: height of the stones [m].
        voussoirs: number of stones.
        skewback: angle of the springing joints from the upright [degrees].
        width: out of plane [m].
        material: of the stones.
        contact: of the joints.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidInput: the angle looks like radians.
        InvalidStructure: the lengths do not make an arch.
    """
    _check(thickness, voussoirs, 1, span=span)
    angle = in_degrees(skewback, "skewback")
    if not 0.0 < angle < 60.0:
        raise InvalidStructure(f"skewback {angle:.4g}° is not between 0° and 60°: try 20°")
    growth = 1.0 + thickness * tan(np.radians(angle)) / (span / 2.0)

    def section(share: Array) -> Faces:
        x = span * (share - 0.5)
        low = np.column_stack([x, np.zeros_like(x)])
        return low, np.column_stack([growth * x, np.full_like(x, thickness)])

    stones = _stones(section, voussoirs, 1)
    return _ring(stones, width, material, contact, gravity, "flat arch")


def arch_along(
    intrados: Sequence[Point] | Array,
    *,
    thickness: float,
    voussoirs: int,
    chords: int = 4,
    width: float = 1.0,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    gravity: float = G,
) -> Structure:
    """Return an arch along any intrados, of stones equally long along it.

    Args:
        intrados: points from one springing to the other, straight in between (n, 2) [m]; as many as
            its curvature needs, for normals are found from three neighbours each.
        thickness: of the ring, at right angles to the intrados [m].
        voussoirs: number of stones.
        chords: straight pieces of each face of a stone.
        width: out of plane [m].
        material: of the stones.
        contact: of the joints.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidInput: the points are no rows of two numbers.
        InvalidStructure: they are fewer than three, two follow one another in one place, or the
            ring crosses itself.
    """
    _check(thickness, voussoirs, chords)
    rows = [
        reals(point, f"intrados[{k}] [m]", 2) for k, point in enumerate(row(intrados, "intrados"))
    ]
    points = np.array(rows, dtype=float)
    if len(points) < 3 or np.any(np.all(np.diff(points, axis=0) == 0.0, axis=1)):
        raise InvalidStructure(
            f"an intrados of {len(points)} points: give at least three, no two alike in a row"
        )
    points = points if points[0, 0] < points[-1, 0] else points[::-1]
    walked = _lengths(points)
    slope = np.gradient(points, walked, axis=0, edge_order=2)

    def section(share: Array) -> Faces:
        at = share * walked[-1]
        x, y, ahead, up = (np.interp(at, walked, each) for each in (*points.T, *slope.T))
        normal = np.column_stack([-up, ahead]) / np.hypot(up, ahead)[:, None]
        inner = np.column_stack([x, y])
        return inner, inner + thickness * normal

    stones = _stones(section, voussoirs, chords)
    return _ring(stones, width, material, contact, gravity, "arch")


def _check(thickness: float, voussoirs: int, chords: int, **lengths: float) -> None:
    """Refuse lengths and numbers that cannot be meant."""
    whole(voussoirs, "voussoirs")
    whole(chords, "chords")
    for key, value in {"thickness": thickness, **lengths}.items():
        if not 0.0 < real(value, f"{key} [m]") < 1e3:
            raise InvalidStructure(f"{key} {value:.4g} m is not between 0 and 1000 m")


def _lengths(points: Array) -> Array:
    """Distance walked along a line up to each of its points (n,) [m]."""
    return np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))


def _stones(section: Callable[[Array], Faces], voussoirs: int, chords: int) -> list[Faces]:
    """Faces of equal stones, of a function from shares of the way to both faces."""
    shares = np.linspace(0.0, 1.0, voussoirs * chords + 1)
    inner, outer = section(shares)
    ends = [(k * chords, (k + 1) * chords + 1) for k in range(voussoirs)]
    return [(inner[a:b], outer[a:b]) for a, b in ends]


def _mirrored(left: list[Faces], count: int) -> list[Faces]:
    """Faces of all stones from those of the left half; of an odd count the last is half a stone."""

    def other(points: Array) -> Array:
        return points[::-1] * (-1.0, 1.0)

    if count % 2 == 0:
        return [*left, *((other(a), other(b)) for a, b in reversed(left))]
    inner, outer = (np.concatenate([half, other(half)[1:]]) for half in left[-1])
    return [*left[:-1], (inner, outer), *((other(a), other(b)) for a, b in reversed(left[:-1]))]


def _ring(
    stones: Sequence[Faces],
    width: float,
    material: Material,
    contact: Contact,
    gravity: float,
    name: str,
) -> Structure:
    """A ring of stones, from left to right, between two fixed abutments."""
    sections = [(inner[0], outer[0]) for inner, outer in stones]
    sections.append((stones[-1][0][-1], stones[-1][1][-1]))
    faces = [(_point(inner), _point(outer)) for inner, outer in sections]
    blocks = [
        Block(
            (*map(_point, inner), *map(_point, outer[::-1])),
            material,
            f"voussoir {k}",
            corners=(0, len(inner) - 1, len(inner), len(inner) + len(outer) - 1),
            part="arch",
            role="ring",
        )
        for k, (inner, outer) in enumerate(stones, 1)
    ]
    depth = 0.5 * float(np.linalg.norm(np.subtract(*faces[0])))
    left = abutment_behind(faces[0], -1.0, depth, material, "left abutment")
    right = abutment_behind(faces[-1], 1.0, depth, material, "right abutment")
    joints = [
        Joint((k, k + 1), *face, contact, f"joint {k}", "arch", "ring")
        for k, face in enumerate(faces)
    ]
    return Structure((left, *blocks, right), tuple(joints), width, gravity, name)


def _point(place: Array) -> Point:
    """A place as two numbers, so near the axis as round-off on it."""
    return (float(place[0]) + 0.0, float(place[1]) + 0.0)
