"""Rings of a bridge where they stand: from their springings, named after their part."""

from dataclasses import replace
from math import cos

import numpy as np

from archfem.masonry.block import Point
from archfem.masonry.materials import Contact, Material
from archfem.masonry.shapes.parts import Arch
from archfem.masonry.shapes.rings import circular_arch
from archfem.masonry.structure import Joint, Structure

Face = tuple[Point, Point]
"""A springing joint: its intrados and its extrados."""


def ring_of(
    arch: Arch, left: float, material: Material, contact: Contact, chords: int
) -> Structure:
    """Return a ring at its place in a bridge, between abutments that the bridge does without.

    Args:
        arch: its lengths and its name, which its blocks and joints bear.
        left: x of its left springing, at the centre line [m]; y is 0 there.
        material: of its stones.
        contact: of its joints.
        chords: straight pieces of each face of a voussoir.
    """
    ring = circular_arch(
        radius=arch.radius,
        thickness=arch.thickness,
        embrace=f"{np.degrees(2.0 * arch.half):.17g} degree",
        voussoirs=arch.voussoirs,
        material=material,
        contact=contact,
        chords=chords,
    )
    right, up = left + arch.span / 2.0, -arch.radius * cos(arch.half)

    def at(point: Point) -> Point:
        return (float(point[0] + right), float(point[1] + up))

    blocks = [
        replace(
            block,
            outline=tuple(map(at, block.outline)),
            name=f"{arch.name}, {block.name}",
            part=arch.name,
            role=arch.role,
        )
        for block in ring.blocks
    ]
    joints = [
        replace(each, intrados=at(each.intrados), extrados=at(each.extrados), part=arch.name)
        for each in ring.joints
    ]
    return replace(ring, blocks=tuple(blocks), joints=tuple(joints), name=arch.name)


def face_of(joint: Joint) -> Face:
    """Return both ends of a springing joint.

    Args:
        joint: the first or the last of a ring.
    """
    return joint.intrados, joint.extrados


def extrados_of(ring: Structure) -> list[Point]:
    """Return the points along the extrados of a ring, from left to right [m].

    Args:
        ring: of stones in chords, between two abutments.
    """
    points = [ring.joints[0].extrados]
    for block in ring.blocks[1:-1]:
        half = len(block.outline) // 2
        points += list(reversed(block.outline[half:-1]))
    return points
