"""Rings on piers from a few numbers: an arch on two buttresses, and arches in a row."""

from collections.abc import Sequence
from typing import Any

from archfem.arguments import reals
from archfem.errors import InvalidStructure
from archfem.masonry.materials import STONE, STONE_TO_STONE, Contact, Material
from archfem.masonry.shapes.bridges import bridge
from archfem.masonry.shapes.parts import Arch, Pier
from archfem.masonry.structure import Structure
from archfem.units import G

Numbers = float | Sequence[float]
"""One for all, or one for each, from left to right."""


def buttressed_arch(  # noqa: PLR0913  (all are lengths and properties of one structure)
    *,
    span: float,
    thickness: float,
    voussoirs: int,
    breadth: float,
    height: float,
    rise: float | None = None,
    embrace: float | str | None = None,
    course: float = 0.40,
    chords: int = 1,
    width: float = 1.0,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    gravity: float = G,
) -> Structure:
    """Return a circular arch between two buttresses in courses, flush with its intrados.

    Lengths are measured as in a `bridge`: x from the left springing, y from the springing level.

    Args:
        span: between the springings, along the centre line [m].
        thickness: of the ring [m].
        voussoirs: number of stones.
        breadth: of each buttress [m].
        height: of the buttresses, from foundation to springing level [m].
        rise: of the centre line above the springings [m]; or
        embrace: angle that the ring subtends [degrees].
        course: height of a course, about [m].
        chords: straight pieces of each face of a voussoir.
        width: out of plane [m].
        material: of all blocks.
        contact: of all joints.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidStructure: the lengths do not go together.
    """
    return arcade(
        spans=[span],
        rises=None if rise is None else [rise],
        embraces=None if embrace is None else [embrace],
        heights=height,
        breadths=breadth,
        thicknesses=thickness,
        voussoirs=voussoirs,
        course=course,
        chords=chords,
        width=width,
        material=material,
        contact=contact,
        gravity=gravity,
    )


def arcade(  # noqa: PLR0913  (all are lengths and properties of one structure)
    *,
    spans: Sequence[float],
    heights: Numbers,
    breadths: Numbers,
    thicknesses: Numbers,
    voussoirs: int | Sequence[int],
    rises: Numbers | None = None,
    embraces: float | str | Sequence[float | str] | None = None,
    course: float = 0.40,
    chords: int = 1,
    width: float = 1.0,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    gravity: float = G,
) -> Structure:
    """Return circular arches in a row, on piers between them and under both ends.

    What is one number holds for all arches, or piers. Parts are called "arch 1" and "pier 1" from
    the left; lengths are measured as in a `bridge`.

    Args:
        spans: of the arches, between their springings along the centre line [m].
        heights: of the piers, one more than arches, from foundation to springing level [m].
        breadths: of the piers [m].
        thicknesses: of the rings [m].
        voussoirs: numbers of stones.
        rises: of the centre lines above the springings [m]; or
        embraces: angles that the rings subtend [degrees].
        course: height of a course, about [m].
        chords: straight pieces of each face of a voussoir.
        width: out of plane [m].
        material: of all blocks.
        contact: of all joints.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidStructure: the numbers or lengths do not go together.
    """
    count = len(reals(spans, "spans [m]"))
    arches = [
        Arch(
            span=span, thickness=thick, voussoirs=stones, rise=rise, embrace=turn, name=f"arch {k}"
        )
        for k, (span, thick, stones, rise, turn) in enumerate(
            zip(
                spans,
                _each(thicknesses, count, "thicknesses"),
                _each(voussoirs, count, "voussoirs"),
                _each(rises, count, "rises"),
                _each(embraces, count, "embraces"),
                strict=True,
            ),
            1,
        )
    ]
    sides = [*(arch.reach for arch in arches), 0.0], [0.0, *(arch.reach for arch in arches)]
    piers = [
        Pier(gap=broad - right - left, height=high, course=course, name=f"pier {k}")
        for k, (broad, high, right, left) in enumerate(
            zip(
                _each(breadths, count + 1, "breadths"),
                _each(heights, count + 1, "heights"),
                *sides,
                strict=True,
            ),
            1,
        )
    ]
    return bridge(
        arches=arches,
        piers=piers,
        chords=chords,
        width=width,
        material=material,
        contact=contact,
        gravity=gravity,
    )


def _each(given: object, count: int, name: str) -> list[Any]:
    """As many values as there are parts."""
    if given is None or isinstance(given, float | int | str):
        return [given] * count
    values: list[Any] = list(given)  # type: ignore[call-overload]
    values = values * count if len(values) == 1 else values
    if len(values) != count:
        raise InvalidStructure(f"{len(values)} {name}: give one for all, or {count}")
    return values
