"""Weak forms in UFL: the definition that everything else is measured against.

Find u in the broken space such that for all v

    ∫ w ρ ü·v + ∫ w σ(u):ε(v) + Σ_joints ∫ w (t_n ⟦v⟧·n + t_s ⟦v⟧·t) = ∫ w ρ b·v

with plane stress σ and the tractions of `joints.law`, of the gap g = ⟦u⟧·n and the slip s = ⟦u⟧·t:

    t_n = k_n <g>_-,    t_s = k_s (s - s_p),    |t_s| ≤ μ |t_n| + c on the closed part of a joint,

where s_p is how far each point had slid for good, and has to grow where friction does not hold t_s.
Joints without friction coefficient never slide. `step_forms` has the means of all over a step.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from scipy import sparse

from archfem.arrays import Array
from archfem.joints.quadrature import Quadrature
from archfem.models.fem import _fenicsx
from archfem.models.fem.joint_facets import JointFacets, Reading
from archfem.models.fem.joint_forms import Faces, Fields
from archfem.models.fem.space import BrokenSpace


def strain(u: Any) -> Any:
    """Return the small strain ε(u), a UFL expression.

    Args:
        u: displacement, a UFL expression [m].
    """
    return ufl.sym(ufl.grad(u))


def plane_stress(u: Any, young: Any, poisson: Any) -> Any:
    """Return the stress of a linear elastic sheet that is free out of plane [Pa].

    Args:
        u: displacement, a UFL expression [m].
        young: Young's modulus [Pa].
        poisson: Poisson's ratio [-].
    """
    shear = young / (2.0 * (1.0 + poisson))
    plane = young * poisson / (1.0 - poisson**2)
    return 2.0 * shear * strain(u) + plane * ufl.tr(strain(u)) * ufl.Identity(2)


@dataclass(frozen=True, eq=False)
class Forms:
    """Weak forms of a structure on its broken space.

    Materials and contacts enter as constants of the forms, so that changing a number compiles
    nothing. Matrices and vectors are over all nodes, those of fixed blocks included.

    Attributes:
        space: of the displacements.
        rule: quadrature along the joints.
    """

    space: BrokenSpace
    rule: Quadrature

    @cached_property
    def _measures(self) -> list[tuple[Any, Any]]:
        """Pairs (material, its dx)."""
        mesh, structure = self.space.mesh, self.space.mesh.structure
        materials = list(dict.fromkeys(block.material for block in structure.blocks))
        of_block = np.array([materials.index(block.material) for block in structure.blocks])
        cells = np.arange(len(mesh.blocks), dtype=np.int32)
        tags = _fenicsx.tags(mesh.grid, 2, cells, of_block[mesh.blocks])
        dx = _fenicsx.cell_measure(mesh.grid, tags)
        return [(material, dx(k)) for k, material in enumerate(materials)]

    @cached_property
    def facets(self) -> JointFacets:
        """Facets on joints, and what their points carry."""
        return JointFacets(self.space, self.rule)

    @cached_property
    def faces(self) -> list[Faces]:
        """Faces of joints, of one contact each."""
        return [Faces(self.facets, patch) for patch in self.facets.patches]

    def _number(self, value: float) -> Any:
        return _fenicsx.constant(self.space.mesh.grid, value)

    @property
    def _width(self) -> Any:
        return self._number(self.space.mesh.structure.width)

    def bodies(self, u: Any, v: Any) -> Any:
        """Return ∫ w σ(u):ε(v), a UFL form.

        Args:
            u: displacement, a UFL expression [m].
            v: another.
        """
        width = self._width
        terms = [
            width
            * ufl.inner(plane_stress(u, self._number(m.young), self._number(m.poisson)), strain(v))
            * dx
            for m, dx in self._measures
        ]
        return sum(terms[1:], terms[0])

    def over_joints(self, densities: list[Any]) -> Any:
        """Return Σ ∫ w d over the joints, a UFL form.

        Args:
            densities: for each of `faces`, a UFL expression.
        """
        width = self._width
        pairs = zip(densities, self.faces, strict=True)
        terms = [width * density * faces.patch.measure for density, faces in pairs]
        return sum(terms[1:], terms[0])

    def pushed(self, tractions: list[Fields], v: Any) -> Any:
        """Return Σ ∫ w (t_n ⟦v⟧·n + t_s ⟦v⟧·t), a UFL form.

        Args:
            tractions: across and along the joint, for each of `faces`, UFL expressions [Pa].
            v: displacement, a UFL expression.
        """
        pairs = zip(tractions, self.faces, strict=True)
        return self.over_joints([n * f.opening(v) + s * f.slip(v) for (n, s), f in pairs])

    def reading(self, values: list[list[Any]]) -> Reading:
        """Compile what reads values at the points of joints.

        Args:
            values: for each of `faces`, n UFL expressions.

        Returns:
            What `JointFacets.read` takes.
        """
        patches = [faces.patch for faces in self.faces]
        return self.facets.reading(list(zip(patches, values, strict=True)))

    def stiffness(self) -> sparse.csr_matrix:
        """Assemble the blocks' stiffness [N/m]."""
        u, v = ufl.TrialFunction(self.space.functions), ufl.TestFunction(self.space.functions)
        return _fenicsx.assembled_matrix(fem.form(self.bodies(u, v)))

    def mass(self) -> sparse.csr_matrix:
        """Assemble the consistent mass [kg]."""
        structure = self.space.mesh.structure
        u, v = ufl.TrialFunction(self.space.functions), ufl.TestFunction(self.space.functions)
        width = self._number(structure.width)
        terms = [
            width * self._number(m.unit_weight / structure.gravity) * ufl.inner(u, v) * dx
            for m, dx in self._measures
        ]
        return _fenicsx.assembled_matrix(fem.form(sum(terms[1:], terms[0])))

    @cached_property
    def _displacements(self) -> Fields:
        """The displacement, and the same where derivatives shall not see it."""
        return fem.Function(self.space.functions), fem.Function(self.space.functions)

    def _placed(self, displacement: Array, slid: Array | None) -> None:
        """Give all forms a displacement, and how far each joint point has slid before."""
        for u in self._displacements:
            u.x.array[:] = displacement
        self.facets.carry(np.zeros(self.facets.count) if slid is None else slid)

    @cached_property
    def _force(self) -> Any:
        u, v = self._displacements[0], ufl.TestFunction(self.space.functions)
        pushed = self.pushed([faces.tractions(u) for faces in self.faces], v)
        return fem.form(self.bodies(u, v) + pushed)

    def force(self, displacement: Array, slid: Array | None = None) -> Array:
        """Return the assembled internal forces of blocks and joints (2 m,) [N].

        Args:
            displacement: of all nodes (2 m,) [m].
            slid: how far each joint point has slid for good (p,) [m]; None where nothing has.
        """
        self._placed(displacement, slid)
        return _fenicsx.assembled_vector(self._force)

    @cached_property
    def _tangent(self) -> Any:
        (u, same), v = self._displacements, ufl.TestFunction(self.space.functions)
        pushed = self.pushed([faces.steady_tractions(u, same) for faces in self.faces], v)
        return fem.form(ufl.derivative(self.bodies(u, v) + pushed, u))

    def tangent(self, displacement: Array, slid: Array | None = None) -> sparse.csr_matrix:
        """Return the assembled derivative of `force` (2 m, 2 m) [N/m].

        Args:
            displacement: of all nodes (2 m,) [m].
            slid: how far each joint point has slid for good (p,) [m]; None where nothing has.
        """
        self._placed(displacement, slid)
        return _fenicsx.assembled_matrix(self._tangent)

    @cached_property
    def _energy(self) -> Any:
        u = self._displacements[0]
        stored = self.over_joints([faces.energy(u) for faces in self.faces])
        return fem.form(0.5 * self.bodies(u, u) + stored)

    def energy(self, displacement: Array, slid: Array | None = None) -> float:
        """Return the potential energy of blocks and joints if nothing slid any further [J].

        Args:
            displacement: of all nodes (2 m,) [m].
            slid: how far each joint point has slid for good (p,) [m]; None where nothing has.
        """
        self._placed(displacement, slid)
        return float(fem.assemble_scalar(self._energy))

    @cached_property
    def _tractions(self) -> Reading:
        u = self._displacements[0]
        return self.reading([[*faces.tractions(u), faces.slid(u)] for faces in self.faces])

    def tractions(self, displacement: Array, slid: Array | None = None) -> Array:
        """Return what acts at the points of each joint facet, and how far they have slid then.

        Args:
            displacement: of all nodes (2 m,) [m].
            slid: how far each joint point has slid for good (p,) [m]; None where nothing has.

        Returns:
            Tractions across and along the joint [Pa], and how far the points have slid for good
            [m], as `JointFacets.read` (3, f, k).
        """
        self._placed(displacement, slid)
        return self.facets.read(self._tractions)

    def stress(self) -> sparse.csr_matrix:
        """Mean stress of each cell, (σ_xx, σ_yy, σ_xy), from nodal displacements (3 cells, 2 m)."""
        grid = self.space.mesh.grid
        cellwise = _fenicsx.space(grid, "DG", 0, 3)
        u, test = ufl.TrialFunction(self.space.functions), ufl.TestFunction(cellwise)
        terms = []
        for m, dx in self._measures:
            s = plane_stress(u, self._number(m.young), self._number(m.poisson))
            terms.append(ufl.inner(ufl.as_vector([s[0, 0], s[1, 1], s[0, 1]]), test) * dx)
        integral = _fenicsx.assembled_matrix(fem.form(sum(terms[1:], terms[0])))
        ones = ufl.inner(ufl.as_vector([1.0, 1.0, 1.0]), test) * ufl.dx(domain=grid)
        areas = _fenicsx.assembled_vector(fem.form(ones))
        order = (3 * _fenicsx.cell_dofs(cellwise) + np.arange(3)).ravel()
        return (sparse.diags(1.0 / areas) @ integral)[order]
