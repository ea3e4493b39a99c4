"""The model of rigid blocks between elastic joints: three coordinates a block, no mesh."""

from itertools import pairwise

import numpy as np
from scipy import sparse

from archfem.joints.quadrature import Quadrature
from archfem.joints.rigid_kinematics import rigid_joint_operator
from archfem.masonry.structure import Structure, rigid_motion_matrix
from archfem.models.linear_blocks import LinearBlockModel
from archfem.models.model import Cells


def build_rigid_model(
    structure: Structure, cells: int = 4, rule: Quadrature | None = None
) -> LinearBlockModel:
    """Build the model of rigid blocks, in the motions (u, v, θ) of their centroids [m, m, rad]."""
    rule = rule or Quadrature("exact")
    # Gaps of rigid faces are linear: one exact facet suffices without friction and bonds, which
    # vary along it. Trapezoidal points, if given, are those of the whole joint.
    linear = not np.isfinite(structure.friction).any() and not structure.tension.any()
    whole = rule.rule == "exact" and linear
    whole |= rule.rule == "trapezoidal" and rule.points is not None
    facets = 1 if whole else cells
    free = [structure.blocks[number] for number in structure.free]
    density = np.array([structure.density(block) * structure.width for block in free])
    mass = density * [block.area for block in free]
    inertia = density * [block.polar_moment for block in free]
    diagonal = np.column_stack([mass, mass, inertia]).ravel()
    size = 3 * len(free)
    influence = np.zeros((size, 2))
    influence[0::3, 0] = influence[1::3, 1] = mass
    return LinearBlockModel(
        structure,
        "rigid",
        mass=sparse.diags(diagonal).tocsr(),
        block_stiffness=sparse.csr_matrix((size, size)),
        mass_influence=influence,
        operator=rigid_joint_operator(structure, facets, rule),
        cells=_build_cells(structure),
    )


def _build_cells(structure: Structure) -> Cells:
    """Return one polygon for each free block."""
    outlines = [structure.blocks[number].drawn() for number in structure.free]
    starts = np.cumsum([0, *map(len, outlines)])
    motions = [
        rigid_motion_matrix(outline, structure.blocks[number].centroid).reshape(-1, 3)
        for number, outline in zip(structure.free, outlines, strict=True)
    ]
    return Cells(
        places=np.concatenate(outlines),
        block=np.repeat(structure.free, [len(outline) for outline in outlines]),
        polygons=tuple(np.arange(a, b) for a, b in pairwise(starts)),
        shape_functions=sparse.block_diag(motions, format="csr"),
    )
