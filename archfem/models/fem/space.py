"""Lagrange space with jumps across joints: two blocks never share a node.

The mesh is conforming, so nodes of the ordinary space are renumbered by pairs (block of the cell,
old node). The jump across a joint is then plain UFL, and the sparsity pattern of forms is right
without interface elements or constraints.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem._typing import Array, Numbers
from archfem.joints.operator import JointOperator
from archfem.joints.own_law import make_operator
from archfem.joints.quadrature import JointPoints, Quadrature
from archfem.models.fem import _fenicsx
from archfem.models.fem.mesh import Mesh

Nodes = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class BrokenSpace:
    """Displacements that may jump across joints.

    Component a of node k is degree of freedom 2 k + a.
    """

    mesh: Mesh
    degree: int  # of the polynomials, 1 or 2
    functions: Any  # DOLFINx space
    places: Array  # nodes (m, 2) [m]
    owner: Nodes  # block of each node (m,)
    cells: Nodes  # nodes of each cell (n_cells, nodes a cell)

    @property
    def free(self) -> Numbers:
        """Degrees of freedom of the free blocks."""
        moves = ~np.array([block.fixed for block in self.mesh.structure.blocks])
        nodes = np.flatnonzero(moves[self.owner])
        return (2 * nodes[:, None] + np.arange(2)).ravel()

    def constant(self, value: float) -> Any:
        """Return a constant of forms on the mesh: with another value the same code serves."""
        return _fenicsx.constant(self.mesh.grid, value)

    @cached_property
    def facets(self) -> "OrderedFacets":
        """Facets on all joints, in the order of their joints, along each of them."""
        mesh = self.mesh
        cells_at = _fenicsx.find_connectivity(mesh.grid, 1, 2)
        facets_of = _fenicsx.find_connectivity(mesh.grid, 2, 1)
        local = _fenicsx.facet_nodes(self.functions)
        cells, nodes, offsets = [], [], []
        for facet, number in zip(*mesh.joints, strict=True):
            joint = mesh.structure.joints[number]
            pair = sorted(cells_at(facet), key=lambda cell: mesh.blocks[cell])
            positions = [int(np.flatnonzero(facets_of(cell) == facet)[0]) for cell in pair]
            sides = [self.cells[c][local[k]] for c, k in zip(pair, positions, strict=True)]
            along = [(self.places[side] - joint.middle) @ joint.tangent for side in sides]
            cells.append(pair)
            nodes.append([side[np.argsort(x)] for side, x in zip(sides, along, strict=True)])
            offsets.append(np.sort(along[0]))
        order = np.lexsort((np.array(offsets)[:, 0], mesh.joints[1]))
        columns = *mesh.joints, cells, nodes, offsets
        return OrderedFacets(*(np.array(column)[order] for column in columns))


class OrderedFacets(NamedTuple):
    """Facets on joints, joint after joint and along each of them."""

    numbers: Nodes  # in the mesh (f,)
    joint: Nodes  # number of the joint of each (f,)
    cells: Nodes  # on both sides, that of the lower block first (f, 2)
    nodes: Nodes  # on both sides, along the joint (f, 2, k)
    offsets: Array  # of the nodes from the joint's mid-depth (f, k) [m]


def build_broken_space(mesh: Mesh, degree: int = 1) -> BrokenSpace:
    """Return the space of displacements that are continuous in each block."""
    continuous = _fenicsx.vector_space(mesh.grid, "Lagrange", degree, 2)
    old = _fenicsx.cell_dofs(continuous)
    count = int(old.max()) + 1
    keys = mesh.blocks[:, None].astype(np.int64) * count + old
    # distinct pairs of block and old node, as one number each
    pairs, number = np.unique(keys, return_inverse=True)
    cells = number.reshape(old.shape).astype(np.int32)
    places = continuous.tabulate_dof_coordinates()[pairs % count, :2]
    functions = _fenicsx.renumber_space(continuous, cells, len(pairs))
    return BrokenSpace(mesh, degree, functions, places, (pairs // count).astype(np.int32), cells)


def build_joint_operator(space: BrokenSpace, rule: Quadrature) -> JointOperator:
    """Return opening and slip at the joint points in terms of the free nodal displacements.

    Rows are one-dimensional Lagrange polynomials on the facets, the trace of the elements. Entries
    are therefore exact, and only nodes on the joint appear.
    """
    structure = space.mesh.structure
    facets, rules, entries = space.facets, [], []
    for number in range(len(structure.joints)):
        of_joint = facets.joint == number
        offsets, nodes = facets.offsets[of_joint], facets.nodes[of_joint]
        breaks = np.append(offsets[:, 0], offsets[-1, -1])
        rules.append(rule.on_joint(breaks, space.degree))
        entries.append(_interpolation(rules[-1][0], offsets, nodes))
    points = JointPoints.on(structure, rules)
    jumps = _jumps(entries, len(space.places))
    opening, slip = (
        _component(jumps, directions)[:, space.free].tocsr()
        for directions in (structure.normals[points.joint], structure.tangents[points.joint])
    )
    return make_operator(structure, rule, points, opening, slip)


def _interpolation(points: Array, offsets: Array, nodes: Nodes) -> tuple[Array, Nodes]:
    """Return facet polynomials at points (p, k), and the nodes of both sides (p, 2, k)."""
    facet = np.clip(np.searchsorted(offsets[:, -1], points), 0, len(offsets) - 1)
    nodal = offsets[facet]
    # Lagrange polynomials
    values = np.ones_like(nodal)
    for k in range(nodal.shape[1]):
        for other in range(nodal.shape[1]):
            if other != k:
                values[:, k] *= (points - nodal[:, other]) / (nodal[:, k] - nodal[:, other])
    values[np.abs(values) < 1e-12] = 0.0  # a point on a node belongs to that node alone
    return values, nodes[facet]


def _jumps(entries: list[tuple[Array, Nodes]], count: int) -> sparse.csr_matrix:
    """Return the matrix from nodal values to the jump, higher side less lower side (p, m)."""
    values = np.concatenate([value for value, _ in entries])
    nodes = np.concatenate([node for _, node in entries])
    rows = np.repeat(np.arange(len(values)), values.shape[1])
    shape = (len(values), count)
    lower, higher = (
        sparse.csr_matrix((values.ravel(), (rows, nodes[:, side].ravel())), shape)
        for side in range(2)
    )
    return higher - lower


def _component(jumps: sparse.csr_matrix, directions: Array) -> sparse.csc_matrix:
    """Return the rows of the jump's component along a direction at each point (p, 2 m)."""
    x, y = (sparse.diags(directions[:, axis]) @ jumps for axis in range(2))
    joined = (sparse.kron(x, [[1.0, 0.0]]) + sparse.kron(y, [[0.0, 1.0]])).tocsc()
    joined.eliminate_zeros()
    return joined
