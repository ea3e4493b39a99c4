"""The model with all nodes: elastic blocks meshed by gmsh, assembled by DOLFINx."""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem.joints.quadrature import Quadrature
from archfem.models.fem.forms import Forms
from archfem.models.fem.space import BrokenSpace, build_joint_operator
from archfem.models.linear_blocks import LinearBlockModel
from archfem.models.model import Cells


def build_full_model(space: BrokenSpace, rule: Quadrature) -> LinearBlockModel:
    """Build the model in nodal displacements of the free blocks, x and y in turn [m]."""
    forms = Forms(space, rule)
    free = space.free
    mass = forms.mass()[free][:, free]
    axes = np.zeros((len(free), 2))
    axes[0::2, 0] = axes[1::2, 1] = 1.0
    return LinearBlockModel(
        space.mesh.structure,
        "full",
        mass=mass,
        block_stiffness=forms.stiffness()[free][:, free],
        mass_influence=mass @ axes,
        operator=build_joint_operator(space, rule),
        cells=_build_cells(space, forms, free),
    )


def _build_cells(space: BrokenSpace, forms: Forms, free: NDArray[np.intp]) -> Cells:
    """Return the cells of the free blocks as polygons."""
    moving = np.isin(space.mesh.blocks, space.mesh.structure.free)
    nodes = free[0::2] // 2
    number = np.full(len(space.places), -1)
    number[nodes] = np.arange(len(nodes))
    # DOLFINx orders the corners of quadrilaterals like a tensor product
    corners = [0, 1, 3, 2] if space.cells.shape[1] in (4, 9) else [0, 1, 2]
    rows = (3 * np.flatnonzero(moving)[:, None] + np.arange(3)).ravel()
    return Cells(
        places=space.places[nodes],
        block=space.owner[nodes].astype(int),
        polygons=tuple(number[space.cells[moving][:, corners]]),
        shape_functions=sparse.identity(len(free), format="csr"),
        stress=forms.stress()[rows][:, free].tocsr(),
    )
