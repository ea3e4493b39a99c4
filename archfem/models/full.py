"""The rung with all nodes: elastic blocks meshed by gmsh, assembled by DOLFINx."""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem.joints.quadrature import Quadrature
from archfem.models.cells import Cells
from archfem.models.fem.forms import Forms
from archfem.models.fem.space import BrokenSpace, joint_operator
from archfem.models.jointed import Jointed


def full(space: BrokenSpace, rule: Quadrature) -> Jointed:
    """Model every node of the free blocks.

    Coordinates are nodal displacements, x and y in turn [m]. Blocks' stiffness and consistent
    mass come from the weak forms; joints from the joint operator on the same quadrature.

    Args:
        space: broken across the joints.
        rule: quadrature on each facet of a joint.

    Returns:
        The model, its nodes in the order of the space.
    """
    forms = Forms(space, rule)
    free = space.free
    mass = forms.mass()[free][:, free]
    axes = np.zeros((len(free), 2))
    axes[0::2, 0] = axes[1::2, 1] = 1.0
    return Jointed(
        space.mesh.structure,
        "full",
        mass=mass,
        blocks=forms.stiffness()[free][:, free],
        body=mass @ axes,
        operator=joint_operator(space, rule),
        cells=_cells(space, forms, free),
    )


def _cells(space: BrokenSpace, forms: Forms, free: NDArray[np.intp]) -> Cells:
    """The cells of the free blocks, as polygons around their corners."""
    moving = np.isin(space.mesh.blocks, space.mesh.structure.free)
    nodes = free[0::2] // 2
    number = np.full(len(space.places), -1)
    number[nodes] = np.arange(len(nodes))
    corners = [0, 1, 3, 2] if space.cells.shape[1] in (4, 9) else [0, 1, 2]
    rows = (3 * np.flatnonzero(moving)[:, None] + np.arange(3)).ravel()
    return Cells(
        places=space.places[nodes],
        block=space.owner[nodes].astype(int),
        polygons=tuple(number[space.cells[moving][:, corners]]),
        lift=sparse.identity(len(free), format="csr"),
        stress=forms.stress()[rows][:, free].tocsr(),
    )
