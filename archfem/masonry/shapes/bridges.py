"""Bridges of any number of spans: rings on piers, sidewalls behind them, fill and paving on top.

Stones are polygons: a voussoir's faces follow the circle by chords, so that the fill can lie on
them. What a bridge does not have is not modelled.
"""

from collections.abc import Sequence
from itertools import chain

import numpy as np

from archfem.annotated import as_annotated
from archfem.errors import InvalidStructure
from archfem.masonry.assembly import assembled
from archfem.masonry.block import Block, Point
from archfem.masonry.materials import STONE, STONE_TO_STONE, Contact, Material
from archfem.masonry.shapes.parts import Arch, Backfill, Paving, Pier, Sidewall
from archfem.masonry.shapes.placed import Face
from archfem.masonry.shapes.site import Site, ledge
from archfem.masonry.structure import Structure
from archfem.units import G

THIN = 0.02
"""Least fill above rings and sidewalls [m]."""


@as_annotated
def bridge(  # noqa: PLR0913  (the parts a bridge may have, and what they are made of)
    *,
    arches: Sequence[Arch],
    piers: Sequence[Pier] = (),
    sidewalls: Sequence[Sidewall] = (),
    backfill: Backfill | None = None,
    paving: Paving | None = None,
    width: float = 1.0,
    material: Material = STONE,
    contact: Contact = STONE_TO_STONE,
    chords: int = 1,
    gravity: float = G,
) -> Structure:
    """Return a bridge built from its parts, from left to right.

    Lengths are measured from the left end of the deck (x) and from the springing level (y).
    Joints are named by part: "main arch, joint 5" counted from the left springing, "north pier,
    base" and "north pier, joint 1" upwards; others by the blocks they separate. In beds "intrados"
    is the left end.

    Args:
        arches: one or more rings.
        piers: one fewer; or one more, and then no sidewalls: the first and the last carry the outer
            springings.
        sidewalls: left and right, or none: the outer springings are then fixed, or on piers.
        backfill: or None.
        paving: or None; it lies on the backfill.
        width: out of plane [m].
        material: of all stones.
        contact: between stones.
        chords: straight pieces of each face of a voussoir.
        gravity: acceleration of gravity [m/s²].

    Raises:
        InvalidStructure: the parts do not go together.
    """
    _check(arches, piers, sidewalls, backfill is None and paving is not None)
    site = Site(material, contact, chords)
    faces, extrados = site.build(arches, piers, sidewalls)
    if backfill is not None:
        bottom = _bottom(faces, list(chain(*extrados)), sidewalls)
        top = backfill.surface(bottom[0][0], bottom[-1][0], _crown(faces, extrados))
        _check_cover(bottom, top)
        site.add([*bottom, *reversed(top)], "backfill", backfill.loaded(width, material))
        if paving is not None:
            site.pave(top, paving)
    site.check()
    soil = contact if backfill is None else backfill.contact

    def touch(a: Block, b: Block) -> Contact:
        return soil if "backfill" in (a.part, b.part) else contact

    return assembled(
        site.blocks, touch, joints=site.joints, width=width, gravity=gravity, name="bridge"
    )


def _check(
    arches: Sequence[Arch], piers: Sequence[Pier], sidewalls: Sequence[Sidewall], bare: bool
) -> None:
    """Refuse numbers of parts that do not go together."""
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


def _bottom(
    faces: Sequence[tuple[Face, Face]], extrados: Sequence[Point], sidewalls: Sequence[Sidewall]
) -> list[Point]:
    """What the fill lies on, from left to right."""
    left, right = faces[0][0], faces[-1][1]
    after = ledge(right, -1.0, sidewalls[1:])
    return [*ledge(left, 1.0, sidewalls[:1]), *extrados, *reversed(after)]


def _crown(faces: Sequence[tuple[Face, Face]], extrados: Sequence[Sequence[Point]]) -> Point:
    """The highest crown, midway between the springings of its ring; of equal ones the first."""
    levels = [max(y for _, y in points) for points in extrados]
    level = max(levels)
    left, right = next(f for f, y in zip(faces, levels, strict=True) if y > level - 1e-9)
    return 0.5 * (left[0][0] + right[0][0]), level


def _check_cover(bottom: Sequence[Point], surface: Sequence[Point]) -> None:
    """Refuse a fill through which a ring or a sidewall would show."""
    x, y = np.array(bottom).T
    cover = np.interp(x, *np.array(surface).T) - y
    if cover.min() < THIN:
        place = int(np.argmin(cover))
        raise InvalidStructure(
            f"the fill is {cover[place]:.3f} m above the stones at x = {x[place]:.2f} m, and it "
            f"must be at least {THIN} m: give more cover, less erosion or lower sidewalls"
        )
