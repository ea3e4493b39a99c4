"""Bridges and arcades: rings on piers, sidewalls behind them, backfill and paving above.

Stones are polygons: the faces of a voussoir follow the circle by chords, so that the fill can rest
on them.
"""

from collections.abc import Sequence
from itertools import chain
from typing import Any

import numpy as np

from archfem._typing import Angle, Metres, MetresPerSecondSquared
from archfem._validation import check_numbers, validate_arguments
from archfem.errors import InvalidStructure
from archfem.masonry.assembly import assembled
from archfem.masonry.block import Block, Point
from archfem.masonry.materials import STONE, STONE_TO_STONE, Contact, Material
from archfem.masonry.shapes.bridge_parts import Arch, Backfill, Paving, Pier, Sidewall
from archfem.masonry.shapes.stonework import Face, StoneworkBuilder, fill_ledge
from archfem.masonry.structure import Structure, record_origin
from archfem.units import G


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
        material: of all stones.
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
        _check_cover(bottom, top)
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


def _check_cover(bottom: Sequence[Point], surface: Sequence[Point]) -> None:
    """Check that the fill covers rings and sidewalls."""
    min_cover = 0.02  # [m]; thinner layers make slivers in the mesh
    x, y = np.array(bottom).T
    cover = np.interp(x, *np.array(surface).T) - y
    if cover.min() < min_cover:
        place = int(np.argmin(cover))
        raise InvalidStructure(
            f"the fill is {cover[place]:.3f} m above the stones at x = {x[place]:.2f} m, and it "
            f"must be at least {min_cover} m: give more cover, less erosion or lower sidewalls"
        )


# One length for all parts, or one for each, from left to right
Lengths = Metres | Sequence[Metres]


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

    Coordinates are those of a `bridge`: x from the left springing, y from the springing level.

    Args:
        span: clear span between the springings [m].
        thickness: of the ring [m].
        voussoirs: number of stones.
        breadth: of each buttress [m].
        height: of the buttresses, from foundation to springing level [m].
        rise: clear rise of the intrados above its springings [m]; or
        embrace: angle subtended by the ring [degrees].
        measured: "intrados"; or "centre line", along which span and rise are measured then.
        course: height of a course, about [m].
        chords: straight pieces of each face of a voussoir.
        width: out of plane [m].
        material: of all blocks.
        contact: of all joints.
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
        heights: of the piers, one more than arches, from foundation to springing level [m].
        breadths: of the piers [m].
        thicknesses: of the rings [m].
        voussoirs: numbers of stones.
        rises: clear rises of the intrados above their springings [m]; or
        embraces: angles subtended by the rings [degrees].
        measured: "intrados"; or "centre line", along which spans and rises are measured then.
        course: height of a course, about [m].
        chords: straight pieces of each face of a voussoir.
        width: out of plane [m].
        material: of all blocks.
        contact: of all joints.
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
    # A pier is flush with the intrados of its rings: half their springing joints stand on it.
    reach = [0.0, *(arch.reach for arch in arches), 0.0]
    of_piers = _expand_values(count + 1, breadths=breadths, heights=heights)
    piers = [
        Pier(gap=broad - right - left, height=high, course=course, name=f"pier {k}")
        for k, (broad, high, right, left) in enumerate(
            zip(*of_piers, reach[1:], reach[:-1], strict=True), 1
        )
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
