"""Functions of DOLFINx that differ between its versions.

Features are tested, never version numbers: 0.5 (Debian 12), 0.9 (Debian 13) and 0.11 work. All of
it is serial: one analysis is one process.
"""

import logging
import sys
from typing import Any

from mpi4py import MPI

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem._petsc import PETSc
from archfem._typing import Array

# The form compiler reports each call of the C compiler on the root logger.
logging.getLogger().addFilter(lambda record: "distutils" not in record.pathname)

if "dolfinx" not in sys.modules:
    # DOLFINx 0.5 makes every library loaded after it global and never undoes it, which breaks
    # the wheels of HDF5 and VTK. Importing it with the switch disarmed avoids that.
    _setdlopenflags = sys.setdlopenflags
    sys.setdlopenflags = lambda flags: None
    try:
        import dolfinx
    finally:
        sys.setdlopenflags = _setdlopenflags

import dolfinx.fem.petsc  # noqa: E402
from dolfinx import cpp, fem  # noqa: E402

try:
    from dolfinx.io import gmshio as _gmsh_io
except ImportError:
    from dolfinx.io import gmsh as _gmsh_io  # type: ignore[attr-defined, no-redef]

Numbers = NDArray[np.int32]


def import_gmsh_mesh(model: Any) -> tuple[Any, Any]:
    """Return the current gmsh model as a plane mesh, and its cell tags."""
    grid, cells = _gmsh_io.model_to_mesh(model, MPI.COMM_SELF, 0, gdim=2)[:2]
    return grid, cells


def find_connectivity(grid: Any, start: int, end: int) -> Any:
    """Return a function from an entity of dimension `start` to adjacent ones of dimension `end`."""
    topology = getattr(grid.topology, "_cpp_object", grid.topology)
    topology.create_connectivity(start, end)
    return grid.topology.connectivity(start, end).links


def tag_entities(grid: Any, dimension: int, entities: Numbers, values: Numbers) -> Any:
    """Return tags of entities of a mesh."""
    order = np.argsort(entities)
    return dolfinx.mesh.meshtags(
        grid, dimension, entities[order].astype(np.int32), values[order].astype(np.int32)
    )


def vector_space(grid: Any, kind: str, degree: int, size: int) -> Any:
    """Return a space of vectors with `size` components."""
    if hasattr(fem, "functionspace"):
        return fem.functionspace(grid, (kind, degree, (size,)))
    return fem.VectorFunctionSpace(grid, (kind, degree), dim=size)


def cell_dofs(space: Any) -> Numbers:
    """Return the nodes of each cell (n_cells, nodes a cell); a node has one dof a component."""
    listed = space.dofmap.list
    flat = listed.array if hasattr(listed, "array") else np.asarray(listed)
    return flat.reshape(-1, space.dofmap.dof_layout.num_dofs)


def facet_nodes(space: Any) -> Numbers:
    """Return positions in a cell's node list of the nodes on its facets (facets, nodes)."""
    layout = space.dofmap.dof_layout
    facets = space.mesh.ufl_cell().num_facets
    count = facets() if callable(facets) else facets
    return np.array([layout.entity_closure_dofs(1, facet) for facet in range(count)])


def renumber_space(space: Any, numbers: Numbers, count: int) -> Any:
    """Return a space with other node numbers (n_cells, nodes a cell) from 0 to count - 1."""
    # No element of DOLFINx is continuous in each block and jumps between blocks. A DG space has
    # four times the nodes, and needs penalties within blocks; spaces on a submesh of each block
    # need integrals over facets of two submeshes, which DOLFINx 0.5 does not have; and in a mesh
    # cut by Gmsh the sides of a joint share no facet for dS. So the map is made by hand.
    old = space.dofmap
    dofmap = cpp.fem.DofMap(
        old.dof_layout,
        dolfinx.common.IndexMap(MPI.COMM_SELF, count),
        old.index_map_bs,
        cpp.graph.AdjacencyList_int32(np.ascontiguousarray(numbers, dtype=np.int32)),
        old.index_map_bs,
    )
    mesh = space._cpp_object.mesh
    element = getattr(space.element, "_cpp_object", space.element)
    if hasattr(cpp.fem, "FunctionSpace"):
        inner = cpp.fem.FunctionSpace(mesh, element, dofmap)
    else:
        try:
            inner = cpp.fem.FunctionSpace_float64(mesh, element, dofmap)
        except TypeError:
            inner = cpp.fem.FunctionSpace_float64(mesh, element, dofmap, space.value_shape)
    new = fem.FunctionSpace(space.mesh, space.ufl_element(), inner)
    new.original = space  # its compiled element must outlive this copy
    return new


def constant(grid: Any, value: Any) -> Any:
    """Return a number in a form that may change without another compilation."""
    return fem.Constant(grid, PETSc.ScalarType(value))


class MatrixAssembler:
    """A bilinear form, and the PETSc matrix that it is assembled into again and again."""

    def __init__(self, form: Any) -> None:
        self._form = form
        self._matrix = fem.petsc.create_matrix(form)

    def assemble(self) -> sparse.csr_matrix:
        """Assemble the form with the present coefficients, always on the same pattern."""
        self._matrix.zeroEntries()
        fem.petsc.assemble_matrix(self._matrix, self._form)
        self._matrix.assemble()
        indptr, indices = self._matrix.getRowIJ()
        data = self._matrix.getValuesCSR()[2]
        return sparse.csr_matrix((data, indices, indptr), self._matrix.getSize())


def assemble_matrix(form: Any) -> sparse.csr_matrix:
    """Assemble a bilinear form once."""
    return MatrixAssembler(form).assemble()


def assemble_vector(form: Any) -> Array:
    """Assemble a linear form."""
    values: Array = fem.assemble_vector(form).array.copy()
    return values


def find_vertex_points(grid: Any) -> Numbers:
    """Return the geometry point of each vertex (n_vertices,)."""
    corners = find_connectivity(grid, 2, 0)
    try:
        listed = grid.geometry.dofmaps[0]
    except (AttributeError, TypeError):
        listed = grid.geometry.dofmap
    points = np.zeros(grid.topology.index_map(0).size_local, dtype=np.int32)
    for cell in range(grid.topology.index_map(2).size_local):
        nodes = listed.links(cell) if hasattr(listed, "links") else listed[cell]
        points[corners(cell)] = nodes
    return points
