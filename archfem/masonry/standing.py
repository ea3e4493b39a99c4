"""Bodies that stand on a structure, such as a lorry on a bridge: loads whose mass is pushed.

A body is a rigid block on the joint below its base. On an elastic fill, limit analysis and
assessments take it column by column, as they take the fill: its weight and its horizontal force go
to the stones straight below, with the moment of that force about the road.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from archfem._typing import Metres, Newtons
from archfem._validation import check_between, check_fields, validate_arguments
from archfem.errors import InvalidInput
from archfem.masonry.assembly import name_joints, touching
from archfem.masonry.block import Block, as_point
from archfem.masonry.materials import SOIL_TO_STONE, Contact, Material
from archfem.masonry.structure import CONTACT_TOLERANCE, Joint, Structure, join_names
from archfem.units import GPa


@dataclass(frozen=True, kw_only=True)
class StandingBody:
    """A rigid body on a level top, such as a lorry on a road.

    Attributes:
        x: middle of its base, below its centre of gravity [m].
        length: length of its base along the structure [m].
        weight: weight, which is accelerated as a mass [N].
        centre_of_gravity: height of its centre of gravity above the base [m].
        width: width of the structure, out of plane, that carries it [m]; None for all of it. On
            less its weight counts more, by the whole width over this one.
        contact: contact of its base.
        name: name of the block, and of its part.

    Raises:
        InvalidInput: a value is no number, not above zero, or too large to be metres and newtons.
    """

    x: Metres
    length: Metres
    weight: Newtons
    centre_of_gravity: Metres
    width: Metres | None = None
    contact: Contact = SOIL_TO_STONE
    name: str = "body"

    def __post_init__(self) -> None:
        """Check that the values are possible."""
        check_fields(self)
        check_between(self.weight, f"'{self.name}': weight [N]", 0.0, 1e9, remedy="give newtons")
        for key in ("length", "centre_of_gravity", "width"):
            if (value := getattr(self, key)) is not None:
                check_between(value, f"'{self.name}': {key} [m]", 0.0, 100.0, remedy="give metres")

    def place(self, structure: Structure) -> Block:
        """Return the block of this body on the top of a structure.

        Args:
            structure: whose highest point at x is the level of the base.

        Raises:
            InvalidInput: it stands beside the structure, or on less width than there is.
        """
        tops = [top for block in structure.blocks if (top := block.top(self.x)) is not None]
        if not tops:
            raise InvalidInput(
                f"'{self.name}' stands at x = {self.x:.4g} m beside the structure: move it onto a "
                "block"
            )
        width = structure.width if self.width is None else self.width
        if width > structure.width:
            raise InvalidInput(
                f"'{self.name}': width {width:.4g} m, and the structure has {structure.width:.4g} "
                "m: leave it out"
            )
        bottom, height = max(tops), 2.0 * self.centre_of_gravity
        left, right, top = self.x - 0.5 * self.length, self.x + 0.5 * self.length, bottom + height
        corners = (left, bottom), (right, bottom), (right, top), (left, top)
        unit_weight = self.weight / (self.length * height * width)
        # it stands for itself, at any weight
        material = Material(30.0 * GPa, 0.2, unit_weight, None, self.name, stands_for=self.name)
        return Block(corners, material, self.name, part=self.name, role="other")


def find_bodies(structure: Structure) -> list[str]:
    """Return the names of the bodies that stand on a structure."""
    return [block.name for block in structure.blocks if block.material.stands_for == block.name]


def describe_carried(structure: Structure) -> str:
    """Describe masses that count at the middle of blocks which stand for them; empty for none."""
    own = {*find_bodies(structure)}
    words = (structure.blocks[number].material.stands_for for number in structure.free)
    carried = sorted({each for each in words if each is not None and each not in own})
    if not carried:
        return ""
    return (
        f"the mass of {join_names(carried)} counts at the middle of each block that stands for it: "
        "where it is higher, the structure moves at less than computed; as blocks of its own, or "
        "in an assessment as [assessment] loads, it acts at its height"
    )


@validate_arguments
def carrying(structure: Structure, bodies: Sequence[StandingBody]) -> Structure:
    """Stand bodies on a structure, each on what is level below it.

    Args:
        structure: structure of any kind; a fill that shall be in pieces is cut before.
        bodies: from the lower to the upper one where they stand on each other.

    Returns:
        The structure with a block for each body, and a joint to each block below it.

    Raises:
        InvalidInput: a body stands beside the structure, or on no level top.
        InvalidStructure: it overlaps what is there, or has a name that is used.
    """
    carrier = structure
    for body in bodies:
        carrier = _stand(carrier, body)
    if structure.origin is None:
        return carrier
    shape, arguments = structure.origin
    return replace(carrier, origin=(shape, {**arguments, "standing": [*bodies]}))


def _stand(structure: Structure, body: StandingBody) -> Structure:
    """Return a structure with one body on it."""
    number, block = len(structure.blocks), body.place(structure)
    blocks = (*structure.blocks, block)
    touches = [touch for touch in touching(blocks) if number in touch[:2]]
    level = block.points[0][1] + CONTACT_TOLERANCE * structure.size
    stands = sum(float(np.ptp(ends[:, 0])) for *_, ends in touches if ends[:, 1].max() < level)
    if stands < body.length - 4.0 * len(touches) * CONTACT_TOLERANCE * structure.size:
        raise InvalidInput(
            f"'{body.name}' stands on {stands:.4g} m of its {body.length:.4g} m, as the top of the "
            f"structure beside x = {body.x:.4g} m is not level: make it shorter, move it, or give "
            "the structure a fill or a paving"
        )
    joints = [
        Joint((a, b), as_point(ends[0]), as_point(ends[1]), body.contact, "", body.name, "other")
        for a, b, ends in touches
    ]
    joints = [*structure.joints, *name_joints(joints, blocks)]
    return replace(structure, blocks=blocks, joints=tuple(joints))
