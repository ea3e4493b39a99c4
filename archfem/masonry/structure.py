"""What stands and what touches: the joints between blocks, and the structure that both form."""

import hashlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from archfem.annotated import check_fields
from archfem.arguments import real
from archfem.arrays import Array
from archfem.errors import InvalidStructure
from archfem.masonry.block import Block, Point
from archfem.masonry.materials import Contact
from archfem.masonry.naming import number_of
from archfem.masonry.overlaps import check_apart, check_simple
from archfem.masonry.roles import judged_parts, with_roles
from archfem.shown import Shown
from archfem.units import G

TOUCHING = 1e-6
"""Largest distance of two points that count as one, relative to the size of the structure."""


@dataclass(frozen=True)
class Joint:
    """A straight dry joint between two blocks.

    Attributes:
        blocks: numbers of the two blocks it separates, in either order.
        intrados: its end on the inner face [m].
        extrados: its end on the outer face [m]; eccentricity is positive toward it.
        contact: stiffness and friction.
        name: how a person finds it.
        part: the part of the structure it belongs to; mechanisms are counted by part.
        role: of that part: "ring" or "pier", which are judged, or "other". Where nothing of the
            part tells it, the structure fills it in, as for a block.
    """

    blocks: tuple[int, int]
    intrados: Point
    extrados: Point
    contact: Contact
    name: str
    part: str = ""
    role: str = ""

    def __post_init__(self) -> None:
        """Refuse what is no joint."""
        check_fields(self)

    @property
    def lower(self) -> int:
        """The block of lower number; the joint's normal points away from it."""
        return min(self.blocks)

    @property
    def higher(self) -> int:
        """The block of higher number."""
        return max(self.blocks)

    @cached_property
    def ends(self) -> Array:
        """Both ends, intrados first (2, 2) [m]."""
        return np.array([self.intrados, self.extrados], dtype=float)

    @cached_property
    def middle(self) -> Array:
        """Mid-point, from which eccentricity is measured (2,) [m]."""
        middle: Array = self.ends.mean(axis=0)
        return middle

    @cached_property
    def depth(self) -> float:
        """Length h from intrados to extrados [m]."""
        return float(np.linalg.norm(self.ends[1] - self.ends[0]))

    @cached_property
    def tangent(self) -> Array:
        """Unit vector from intrados to extrados (2,)."""
        tangent: Array = (self.ends[1] - self.ends[0]) / self.depth
        return tangent


@dataclass(frozen=True, repr=False)
class Structure(Shown, picture="structure.draw_structure"):
    """Blocks in contact along dry joints.

    Attributes:
        blocks: the bodies; fixed ones are abutments. Their roles, and those of the joints, are
            filled in where they are not told.
        joints: where they touch.
        width: out-of-plane width w [m].
        gravity: acceleration of gravity, along -y [m/s²].
        name: what it is called in titles and files.
    """

    blocks: tuple[Block, ...]
    joints: tuple[Joint, ...]
    width: float = 1.0
    gravity: float = G
    name: str = "structure"

    def __post_init__(self) -> None:
        """Fill in roles, and refuse what does not hang together, or overlaps."""
        check_fields(self)
        object.__setattr__(self, "blocks", with_roles(self.blocks, self.joints))
        object.__setattr__(self, "joints", with_roles(self.joints, self.blocks))
        if not 1e-3 <= real(self.width, "width [m]") < 1e4:
            raise InvalidStructure(
                f"width {self.width:.3g} m is not between 1 mm and 10 km: give metres"
            )
        if not 0.1 <= real(self.gravity, "gravity [m/s²]") < 1e3:
            raise InvalidStructure(f"gravity {self.gravity:.3g} m/s² is not between 0.1 and 1000")
        for kind, things in (("block", self.blocks), ("joint", self.joints)):
            names = [thing.name for thing in things]
            twice = sorted({name for name in names if names.count(name) > 1})
            if twice:
                raise InvalidStructure(f"{kind} names {twice} are used twice: name each once")
        if all(block.fixed for block in self.blocks):
            raise InvalidStructure("no block is free to move: leave at least one not fixed")
        _ = self.normals
        self._check_support()
        self._check_outlines()

    @cached_property
    def size(self) -> float:
        """Diagonal of the box around all blocks [m]."""
        points = np.concatenate([block.drawn() for block in self.blocks])
        return float(np.linalg.norm(np.ptp(points, axis=0)))

    @cached_property
    def fingerprint(self) -> str:
        """What tells its geometry from any other, to a billionth of its size."""
        points = [*(block.points for block in self.blocks), *(joint.ends for joint in self.joints)]
        places = np.round(np.concatenate(points) / self.size, 9) + 0.0  # of -0.0 too 0.0
        told = f"{self.size:.9g} {self.width:.9g} {[len(each) for each in points]}"
        return hashlib.sha256(told.encode() + places.tobytes()).hexdigest()[:16]

    @cached_property
    def normals(self) -> Array:
        """Unit normals of the joints, from the lower to the higher block (n_joints, 2)."""
        return np.array([self._normal(joint) for joint in self.joints]).reshape(-1, 2)

    @cached_property
    def tangents(self) -> Array:
        """Unit vectors of the joints, from intrados to extrados (n_joints, 2)."""
        return np.array([joint.tangent for joint in self.joints])

    @cached_property
    def ends(self) -> Array:
        """Ends of the joints, intrados first (n_joints, 2, 2) [m]."""
        return np.array([joint.ends for joint in self.joints])

    @cached_property
    def middles(self) -> Array:
        """Mid-points of the joints (n_joints, 2) [m]."""
        return np.array([joint.middle for joint in self.joints])

    @cached_property
    def depths(self) -> Array:
        """Depths h of the joints (n_joints,) [m]."""
        return np.array([joint.depth for joint in self.joints])

    @cached_property
    def friction(self) -> Array:
        """Coefficients μ of the joints (n_joints,) [-]."""
        return np.array([joint.contact.coefficient for joint in self.joints])

    @cached_property
    def cohesion(self) -> Array:
        """Shear that cohesion holds in joints closed all over, c A (n_joints,) [N]."""
        return self.width * self.depths * [joint.contact.cohesion for joint in self.joints]

    @cached_property
    def tension(self) -> Array:
        """Tensile strengths f_t of the joints (n_joints,) [Pa]."""
        return np.array([joint.contact.tension for joint in self.joints])

    @cached_property
    def pairs(self) -> NDArray[np.intp]:
        """Numbers of the two blocks at each joint, the lower first (n_joints, 2)."""
        return np.array([(joint.lower, joint.higher) for joint in self.joints], dtype=np.intp)

    def _normal(self, joint: Joint) -> Array:
        """Outward normal of the lower block's edge, which must also be one of the higher's."""
        if not 0 <= joint.lower < joint.higher < len(self.blocks):
            raise InvalidStructure(
                f"joint '{joint.name}' is between blocks {joint.blocks}: "
                f"give two different numbers from 0 to {len(self.blocks) - 1}"
            )
        near = TOUCHING * self.size
        if joint.depth <= near:
            raise InvalidStructure(
                f"joint '{joint.name}' is {joint.depth:.3g} m long: its two ends are one point"
            )
        sides = [self.blocks[number].side_of(joint.ends, near) for number in sorted(joint.blocks)]
        if sides[0] * sides[1] >= 0:
            names = [self.blocks[number].name for number in sorted(joint.blocks)]
            raise InvalidStructure(
                f"joint '{joint.name}' lists blocks {names}, which share no face along "
                f"{joint.intrados}-{joint.extrados} within {near:.1e} m: check which blocks it "
                "joins and where its ends are"
            )
        return float(sides[0]) * np.array([joint.tangent[1], -joint.tangent[0]])

    def _check_support(self) -> None:
        """Every block must be joined, through others, to one that is fixed."""
        held = {number for number, block in enumerate(self.blocks) if block.fixed}
        pairs = [set(joint.blocks) for joint in self.joints]
        while reached := {b for pair in pairs if pair & held for b in pair} - held:
            held |= reached
        loose = [block.name for number, block in enumerate(self.blocks) if number not in held]
        if loose:
            raise InvalidStructure(
                f"blocks {loose} rest on nothing: join each, through others, to a fixed block"
            )

    def _check_outlines(self) -> None:
        """Bodies neither cross themselves nor reach into one another."""
        outlines = [block.drawn() for block in self.blocks]
        names = [block.name for block in self.blocks]
        for outline, name in zip(outlines, names, strict=True):
            check_simple(outline, name)
        check_apart(outlines, names, fixed=[block.fixed for block in self.blocks])

    @cached_property
    def free(self) -> tuple[int, ...]:
        """Numbers of the blocks that move."""
        return tuple(number for number, block in enumerate(self.blocks) if not block.fixed)

    @cached_property
    def judged(self) -> NDArray[np.bool_]:
        """Whether each joint is judged, as `judged_parts` says of its part (n_joints,)."""
        parts = judged_parts({joint.part: joint.role for joint in self.joints})
        return np.array([joint.part in parts for joint in self.joints], dtype=bool)

    @cached_property
    def weight(self) -> float:
        """Weight of the blocks that move, for the whole width [N]."""
        free = (self.blocks[number] for number in self.free)
        return self.width * sum(block.area * block.material.unit_weight for block in free)

    def _words(self) -> str:
        """What it is, in a line or two."""
        free, count = len(self.free), len(self.blocks)
        return (
            f"Structure '{self.name}': {free} blocks that move, {count - free} fixed, "
            f"{len(self.joints)} joints; size {self.size:.3g} m, width {self.width:.3g} m, "
            f"weight {self.weight / 1e3:.4g} kN"
        )

    def density(self, block: Block) -> float:
        """Return the density of a block's material under this structure's gravity [kg/m³].

        Args:
            block: one of the structure, or any other.
        """
        return block.material.unit_weight / self.gravity

    def joint_number(self, joint: int | str) -> int:
        """Return the number of a joint.

        Args:
            joint: number or name.

        Raises:
            InvalidInput: there is no such joint; the nearest name is suggested.
        """
        return number_of("joint", [each.name for each in self.joints], joint)

    def block_number(self, block: int | str) -> int:
        """Return the number of a block.

        Args:
            block: number or name.

        Raises:
            InvalidInput: there is no such block; the nearest name is suggested.
        """
        return number_of("block", [each.name for each in self.blocks], block)
