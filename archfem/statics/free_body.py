"""Free-body diagram of a block: forces from its joints, its weight, and their balance."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from archfem._typing import Array
from archfem._validation import validate_arguments
from archfem.errors import InvalidInput
from archfem.joints.resultants import check_instant, thrust_line
from archfem.masonry.block import Block, measure_polygon
from archfem.masonry.structure import Structure
from archfem.models.model import Cells


@dataclass(frozen=True, eq=False)
class FreeBody:
    """Forces on one block, for the whole width.

    Attributes:
        block: the block.
        names: names of the joints that press on it, and last "weight" (n,).
        joints: numbers of those joints (n - 1,).
        points: points of action of the forces (n, 2) [m].
        forces: forces on the block (n, 2) [N].
    """

    block: Block
    names: tuple[str, ...]
    joints: tuple[int, ...]
    points: Array
    forces: Array

    @property
    def sizes(self) -> Array:
        """Magnitudes of the forces (n,) [N]."""
        return np.linalg.norm(self.forces, axis=1)

    @property
    def sum(self) -> Array:
        """Sum of the forces, zero at rest (2,) [N]."""
        return self.forces.sum(axis=0)

    @property
    def moment(self) -> float:
        """Moment of the forces about the centroid, zero at rest, anticlockwise [N m]."""
        arm, force = self.points - self.points[-1], self.forces
        return float(np.sum(arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]))

    @property
    def closing_error(self) -> float:
        """Magnitude of the sum of all forces, relative to the largest of them [-]."""
        return float(np.linalg.norm(self.sum) / self.sizes.max())


@validate_arguments
def forces_on(
    structure: Structure, joints: xr.Dataset, block: int | str, cells: Cells | None = None
) -> FreeBody:
    """Compute the forces on one block at rest: the resultants of its joints, and its weight.

    The joint's normal n is from its lower to its higher block, and its tangent t is toward the
    extrados. The force on the higher block is N n - V t, on the lower one the opposite. It acts
    where the thrust line crosses the joint, e h from mid-depth; where N is zero, at mid-depth.
    Under dead load the forces close; under shaking their sum is the block's inertia force.

    Args:
        structure: structure of the block.
        joints: as made by `joint_dataset`, at one instant.
        block: its number or name; it must not be fixed.
        cells: cells of a model with a mesh, for the weight as meshed: there the arcs of sectors are
            chords, which makes them lighter. By default that of the true outline.

    Returns:
        The forces and their points of action, the weight last.

    Raises:
        InvalidInput: there is no such block, or it is fixed, or `joints` has several instants or
            is of another structure.
    """
    number = structure.block_number(block)
    body = structure.blocks[number]
    if body.fixed:
        raise InvalidInput(
            f"block '{body.name}' is fixed, and what holds it is not known: cut a block free that "
            "can move"
        )
    check_instant(structure, joints)
    around = np.flatnonzero((structure.pairs == number).any(axis=1))
    sense = np.where(structure.pairs[around, 1] == number, 1.0, -1.0)
    normal, shear = (sense * joints[key].values[around] for key in ("N", "V"))
    forces = normal[:, None] * structure.normals[around]
    forces -= shear[:, None] * structure.tangents[around]
    crossings = thrust_line(structure, joints).values[around]
    crossings = np.where(np.isnan(crossings), structure.middles[around], crossings)
    area, centroid = _area_and_centroid(body, number, cells)
    weight = area * structure.width * body.material.unit_weight
    names = (*(structure.joints[k].name for k in around), "weight")
    points = np.concatenate([crossings, centroid[None]])
    forces = np.concatenate([forces, [[0.0, -weight]]])
    return FreeBody(body, names, tuple(map(int, around)), points, forces)


def _area_and_centroid(block: Block, number: int, cells: Cells | None) -> tuple[float, Array]:
    """Return area and centroid of a block, or of its cells [m², m]."""
    if cells is None or cells.stress is None:
        return block.area, block.centroid
    own = (cell for cell, owner in zip(cells.polygons, cells.owner, strict=True) if owner == number)
    areas, centroids, _ = zip(*(measure_polygon(cells.places[cell]) for cell in own), strict=True)
    return float(np.sum(areas)), areas @ np.array(centroids) / np.sum(areas)
