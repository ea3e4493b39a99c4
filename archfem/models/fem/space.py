"""The Lagrange space broken across joints: two blocks never share a node.

The mesh is conforming, so the ordinary space is numbered afresh by the pairs (block of the cell,
old node). The jump across a joint is then plain UFL, and the sparsity pattern of forms is right
without interface elements or constraints.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem.arrays import Array
from archfem.joints.integration import law_of
from archfem.joints.operator import JointOperator
from archfem.joints.points import JointPoints
from archfem.joints.quadrature import Quadrature
from archfem.models.fem import _fenicsx
from archfem.models.fem.mesh import Mesh

Nodes = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class BrokenSpace:
    """Displacements that may jump across joints.

    Component a of node k is degree of freedom 2 k + a.

    Attributes:
        mesh: on which it lives.
        degree: of the polynomials, 1 or 2.
        functions: the DOLFINx space.
        places: where the nodes are (m, 2) [m].
        owner: block of each node (m,).
        cells: nodes of each cell (n_cells, nodes a cell).
    """

    mesh: Mesh
    degree: int
    functions: Any
    places: Array
    owner: Nodes
    cells: Nodes

    @property
    def free(self) -> NDArray[np.intp]:
        """Degrees of freedom of the blocks that move."""
        moves = ~np.array([block.fixed for block in self.mesh.structure.blocks])
        nodes = np.flatnonzero(moves[self.owner])
        return (2 * nodes[:, None] + np.arange(2)).ravel()


def broken_space(mesh: Mesh, degree: int = 1) -> BrokenSpace:
    """Return the space of displacements that are continuous in each block.

    Args:
        mesh: conforming, of all blocks.
        degree: of the polynomials, 1 or 2.
    """
    whole = _fenicsx.space(mesh.grid, "Lagrange", degree, 2)
    old = _fenicsx.cell_dofs(whole)
    count = int(old.max()) + 1
    keys = mesh.blocks[:, None].astype(np.int64) * count + old
    kept, number = np.unique(keys, return_inverse=True)
    cells = number.reshape(old.shape).astype(np.int32)
    places = whole.tabulate_dof_coordinates()[kept % count, :2]
    functions = _fenicsx.renumbered(whole, cells, len(kept))
    return BrokenSpace(mesh, degree, functions, places, (kept // count).astype(np.int32), cells)


def joint_operator(space: BrokenSpace, rule: Quadrature) -> JointOperator:
    """Return opening and slip at the joint points in terms of the free nodal displacements.

    Rows come from one-dimensional Lagrange polynomials on the facets, which are the trace of the
    elements, so entries are exact and only nodes on the joint appear.

    Args:
        space: broken across the joints.
        rule: quadrature on each facet of a joint.
    """
    structure = space.mesh.structure
    sides = _joint_nodes(space)
    rules, entries = [], []
    for joint, nodes in zip(structure.joints, sides, strict=True):
        arms = (space.places[nodes[:, 0]] - joint.middle) @ joint.tangent
        order = np.argsort(arms[:, 0])
        arms, nodes = arms[order], nodes[order]
        breaks = np.append(arms[:, 0], arms[-1, -1])
        rules.append(rule.on_joint(breaks, space.degree))
        entries.append(_interpolation(rules[-1][0], arms, nodes))
    points = JointPoints.on(structure, rules)
    jumps = _jumps(entries, len(space.places))
    opening, slip = (
        _component(jumps, directions)[:, space.free].tocsr()
        for directions in (structure.normals[points.joint], structure.tangents[points.joint])
    )
    return JointOperator(law_of(rule, points), opening, slip)


def _joint_nodes(space: BrokenSpace) -> list[Nodes]:
    """Nodes of each joint's facets (facets, 2 sides, nodes): lower side first, along the joint."""
    mesh = space.mesh
    cells_at = _fenicsx.connect(mesh.grid, 1, 2)
    facets_of = _fenicsx.connect(mesh.grid, 2, 1)
    local = _fenicsx.facet_nodes(space.functions)
    found: list[list[list[Nodes]]] = [[] for _ in mesh.structure.joints]
    for facet, number in zip(*mesh.joints, strict=True):
        joint = mesh.structure.joints[number]
        pair = []
        for cell in sorted(cells_at(facet), key=lambda cell: mesh.blocks[cell]):
            position = int(np.flatnonzero(facets_of(cell) == facet)[0])
            nodes = space.cells[cell][local[position]]
            pair.append(nodes[np.argsort((space.places[nodes] - joint.middle) @ joint.tangent)])
        found[number].append(pair)
    return [np.array(pairs) for pairs in found]


def _interpolation(points: Array, arms: Array, nodes: Nodes) -> tuple[Array, Nodes]:
    """Values of the facet polynomials at points (p, k), and the nodes of both sides (p, 2, k)."""
    facet = np.clip(np.searchsorted(arms[:, -1], points), 0, len(arms) - 1)
    own = arms[facet]
    values = np.ones_like(own)
    for k in range(own.shape[1]):
        for other in range(own.shape[1]):
            if other != k:
                values[:, k] *= (points - own[:, other]) / (own[:, k] - own[:, other])
    values[np.abs(values) < 1e-12] = 0.0  # a point on a node belongs to that node alone
    return values, nodes[facet]


def _jumps(entries: list[tuple[Array, Nodes]], count: int) -> sparse.csr_matrix:
    """Matrix (p, m) from nodal values to higher side less lower side."""
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
    """Rows for the component of the jump along a direction (p, 2)."""
    x, y = (sparse.diags(directions[:, axis]) @ jumps for axis in range(2))
    joined = (sparse.kron(x, [[1.0, 0.0]]) + sparse.kron(y, [[0.0, 1.0]])).tocsc()
    joined.eliminate_zeros()
    return joined
