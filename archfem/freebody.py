"""One block cut free: the forces on it from its joints and its weight, and whether they balance."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from archfem.errors import InvalidInput
from archfem.models.cells import Cells
from archfem.naming import block_number
from archfem.resultants import thrust_line
from archfem.structure import Array, Block, Structure


@dataclass(frozen=True, eq=False)
class FreeBody:
    """Forces on one block, for the whole width.

    Attributes:
        block: the one cut free.
        names: of the joints that press on it, and "weight", the last (n,).
        joints: numbers of those joints (n - 1,).
        points: where the forces act (n, 2) [m].
        forces: on the block (n, 2) [N].
    """

    block: Block
    names: tuple[str, ...]
    joints: tuple[int, ...]
    points: Array
    forces: Array

    @property
    def sizes(self) -> Array:
        """Lengths of the forces (n,) [N]."""
        return np.linalg.norm(self.forces, axis=1)

    @property
    def sum(self) -> Array:
        """What the forces add up to, zero at rest (2,) [N]."""
        return self.forces.sum(axis=0)

    @property
    def moment(self) -> float:
        """Moment of the forces about the centroid, zero at rest, anticlockwise [N m]."""
        arm, force = self.points - self.points[-1], self.forces
        return float(np.sum(arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]))

    @property
    def closing_error(self) -> float:
        """Length of the sum of all forces, relative to the largest of them [-]."""
        return float(np.linalg.norm(self.sum) / self.sizes.max())


def forces_on(
    structure: Structure, joints: xr.Dataset, block: int | str, cells: Cells | None = None
) -> FreeBody:
    """Find the forces on one block at rest: the resultants of its joints, and its weight.

    With n the joint's normal, from its lower to its higher block, and t its tangent, toward the
    extrados, the force on the higher block is N n - V t, on the lower one the opposite. It acts
    where the thrust line crosses the joint, e h from mid-depth; where N is zero, at mid-depth.
    Under dead load the forces close; under shaking what they lack is the block's inertia.

    Args:
        structure: whose block it is.
        joints: as made by `joint_dataset`, at one instant.
        block: its number or name; it must not be fixed.
        cells: of a model with a mesh, for the weight as meshed: there the arcs of sectors are
            chords, which makes them lighter. By default that of the true outline.

    Raises:
        InvalidInput: the block is fixed, or `joints` has several instants or is of another
            structure.
        InvalidStructure: there is no such block.
    """
    number = block_number([each.name for each in structure.blocks], block)
    own = structure.blocks[number]
    if own.fixed:
        raise InvalidInput(
            f"block '{own.name}' is fixed, and what holds it is not known: cut a block free that "
            "can move"
        )
    if joints["N"].dims != ("joint",) or joints.sizes["joint"] != len(structure.joints):
        raise InvalidInput(
            f"joints have dimensions {dict(joints.sizes)}: give one instant of the "
            f"{len(structure.joints)} joints of this structure, e.g. joints.isel(time=-1)"
        )
    around = [k for k, joint in enumerate(structure.joints) if number in joint.blocks]
    sense = np.array([1.0 if structure.joints[k].higher == number else -1.0 for k in around])
    tangents = np.array([structure.joints[k].tangent for k in around])
    normal, shear = (sense * joints[key].values[around] for key in ("N", "V"))
    pushes = normal[:, None] * structure.normals[around] - shear[:, None] * tangents
    middles = np.array([structure.joints[k].middle for k in around])
    crossings = thrust_line(structure, joints).values[around]
    area, centroid = _area(own, number, cells)
    weight = area * structure.width * own.material.unit_weight
    return FreeBody(
        own,
        (*(structure.joints[k].name for k in around), "weight"),
        tuple(around),
        np.concatenate([np.where(np.isnan(crossings), middles, crossings), centroid[None]]),
        np.concatenate([pushes, [[0.0, -weight]]]),
    )


def _area(block: Block, number: int, cells: Cells | None) -> tuple[float, Array]:
    """Area and centroid of a block, or of the cells it is meshed with."""
    if cells is None or cells.stress is None:
        return block.area, block.centroid
    pieces = [
        Block(tuple(map(tuple, cells.places[cell])), block.material, block.name)
        for cell, owner in zip(cells.polygons, cells.owner, strict=True)
        if owner == number
    ]
    areas = np.array([piece.area for piece in pieces])
    centroids = np.array([piece.centroid for piece in pieces])
    return float(areas.sum()), areas @ centroids / areas.sum()
