"""The lowest rung: rigid blocks on elastic joints, three coordinates a block, no mesh."""

from itertools import pairwise

import numpy as np
from scipy import sparse

from archfem.joints.quadrature import Quadrature
from archfem.joints.rigid import rigid_joints
from archfem.masonry.rigid_motion import motion_of
from archfem.masonry.structure import Structure
from archfem.models.cells import Cells
from archfem.models.jointed import Jointed


def rigid(structure: Structure, cells: int = 4, rule: Quadrature | None = None) -> Jointed:
    """Model blocks as rigid: all compliance is in the joints.

    Coordinates are the motions of the free blocks' centroids, (u, v, θ) each [m, m, rad].

    Args:
        structure: what to model.
        cells: facets on each joint; with exact quadrature one is enough where nothing slides
            or breaks.
        rule: quadrature on each facet; by default the exact one.

    Returns:
        The model, its coordinates in the order of `structure.free`.
    """
    rule = rule or Quadrature("exact")
    linear = not np.isfinite(structure.friction).any() and not structure.tension.any()
    whole = rule.rule == "exact" and linear
    facets = 1 if whole else cells  # gaps between rigid faces are linear, friction and bonds not
    free = [structure.blocks[number] for number in structure.free]
    density = np.array([structure.density(block) * structure.width for block in free])
    mass = density * [block.area for block in free]
    inertia = density * [block.polar_moment for block in free]
    diagonal = np.column_stack([mass, mass, inertia]).ravel()
    body = np.zeros((3 * len(free), 2))
    body[0::3, 0] = body[1::3, 1] = mass
    size = 3 * len(free)
    return Jointed(
        structure,
        "rigid",
        mass=sparse.diags(diagonal).tocsr(),
        blocks=sparse.csr_matrix((size, size)),
        body=body,
        operator=rigid_joints(structure, facets, rule),
        cells=_cells(structure),
    )


def _cells(structure: Structure) -> Cells:
    """One polygon a free block."""
    outlines = [structure.blocks[number].drawn() for number in structure.free]
    starts = np.cumsum([0, *map(len, outlines)])
    motions = [
        motion_of(outline, structure.blocks[number].centroid).reshape(-1, 3)
        for number, outline in zip(structure.free, outlines, strict=True)
    ]
    return Cells(
        places=np.concatenate(outlines),
        block=np.repeat(structure.free, [len(outline) for outline in outlines]),
        polygons=tuple(np.arange(a, b) for a, b in pairwise(starts)),
        lift=sparse.block_diag(motions, format="csr"),
    )
