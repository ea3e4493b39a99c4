"""Weak forms in UFL: the definition that everything else is measured against.

Find u in the broken space such that for all v

    ∫ w ρ ü·v + ∫ w σ(u):ε(v) + Σ_joints ∫ w (t_n g(v) + t_s s(v)) = ∫ w ρ b·v

with plane stress σ, opening g(v) = ⟦v⟧·n, slip s(v) = ⟦v⟧·t and the tractions of `joints.law`.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from scipy import sparse

from archfem.arrays import Array
from archfem.joints.law import normal_traction, shear_traction
from archfem.joints.quadrature import Quadrature
from archfem.models.fem import _fenicsx
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
    def _measures(self) -> tuple[list[tuple[Any, Any]], list[tuple[Any, Any]]]:
        """Pairs (material, its dx) and (contact, its dS)."""
        mesh, structure = self.space.mesh, self.space.mesh.structure
        materials = list(dict.fromkeys(block.material for block in structure.blocks))
        contacts = list(dict.fromkeys(joint.contact for joint in structure.joints))
        of_block = np.array([materials.index(block.material) for block in structure.blocks])
        of_joint = np.array([contacts.index(joint.contact) for joint in structure.joints])
        facets, numbers = mesh.joints
        cells = np.arange(len(mesh.blocks), dtype=np.int32)
        dx = _fenicsx.cell_measure(
            mesh.grid, _fenicsx.tags(mesh.grid, 2, cells, of_block[mesh.blocks])
        )
        dS = _fenicsx.jump_measure(
            mesh.grid,
            _fenicsx.tags(mesh.grid, 1, facets, of_joint[numbers]),
            *self._scheme,
        )
        return (
            [(material, dx(k)) for k, material in enumerate(materials)],
            [(contact, dS(k)) for k, contact in enumerate(contacts)],
        )

    @property
    def _scheme(self) -> tuple[str, int]:
        """Quadrature along joints as FFCx knows it, by the degree it integrates exactly."""
        points = self.rule.count(self.space.degree)
        if self.rule.rule == "gauss":
            return "default", 2 * points - 1
        return "GLL", 2 * points - 3

    def _number(self, value: float) -> Any:
        return _fenicsx.constant(self.space.mesh.grid, value)

    def _bodies(self, u: Any, v: Any) -> Any:
        """∫ w σ(u):ε(v)."""
        width = self._number(self.space.mesh.structure.width)
        terms = [
            width
            * ufl.inner(plane_stress(u, self._number(m.young), self._number(m.poisson)), strain(v))
            * dx
            for m, dx in self._measures[0]
        ]
        return sum(terms[1:], terms[0])

    def _joints(self, u: Any, v: Any) -> Any:
        """Σ ∫ w (t_n g(v) + t_s s(v)); neither product depends on which side is called +."""
        normal = ufl.FacetNormal(self.space.mesh.grid)("+")
        tangent = ufl.perp(normal)
        width = self._number(self.space.mesh.structure.width)

        def across(w: Any) -> Any:
            return ufl.dot(w("-") - w("+"), normal)

        def along(w: Any) -> Any:
            return ufl.dot(w("-") - w("+"), tangent)

        terms = [
            width
            * (
                normal_traction(across(u), self._number(c.normal_stiffness)) * across(v)
                + shear_traction(along(u), self._number(c.shear_stiffness)) * along(v)
            )
            * dS
            for c, dS in self._measures[1]
        ]
        return sum(terms[1:], terms[0])

    def stiffness(self) -> sparse.csr_matrix:
        """Assemble the blocks' stiffness [N/m]."""
        u, v = ufl.TrialFunction(self.space.functions), ufl.TestFunction(self.space.functions)
        return _fenicsx.assembled_matrix(fem.form(self._bodies(u, v)))

    def mass(self) -> sparse.csr_matrix:
        """Assemble the consistent mass [kg]."""
        structure = self.space.mesh.structure
        u, v = ufl.TrialFunction(self.space.functions), ufl.TestFunction(self.space.functions)
        width = self._number(structure.width)
        terms = [
            width * self._number(m.unit_weight / structure.gravity) * ufl.inner(u, v) * dx
            for m, dx in self._measures[0]
        ]
        return _fenicsx.assembled_matrix(fem.form(sum(terms[1:], terms[0])))

    @cached_property
    def _nonlinear(self) -> tuple[Any, Any, Any]:
        """Displacement, and the compiled internal force and its derivative."""
        u, v = fem.Function(self.space.functions), ufl.TestFunction(self.space.functions)
        force = self._bodies(u, v) + self._joints(u, v)
        return u, fem.form(force), fem.form(ufl.derivative(force, u))

    def force(self, displacement: Array) -> Array:
        """Return the assembled internal forces of blocks and joints (2 m,) [N].

        Args:
            displacement: of all nodes (2 m,) [m].
        """
        u, force, _ = self._nonlinear
        u.x.array[:] = displacement
        return _fenicsx.assembled_vector(force)

    def tangent(self, displacement: Array) -> sparse.csr_matrix:
        """Return the assembled derivative of `force` (2 m, 2 m) [N/m].

        Args:
            displacement: of all nodes (2 m,) [m].
        """
        u, _, tangent = self._nonlinear
        u.x.array[:] = displacement
        return _fenicsx.assembled_matrix(tangent)

    @cached_property
    def _energy(self) -> Any:
        """Half of the work of internal forces on the displacement: forces are homogeneous."""
        u = self._nonlinear[0]
        return fem.form(0.5 * (self._bodies(u, u) + self._joints(u, u)))

    def energy(self, displacement: Array) -> float:
        """Return the potential energy of blocks and joints [J].

        Args:
            displacement: of all nodes (2 m,) [m].
        """
        self._nonlinear[0].x.array[:] = displacement
        return float(fem.assemble_scalar(self._energy))

    @cached_property
    def _resultants(self) -> list[tuple[Any, Any, Any]]:
        """Compiled integrals of N, V and M, for each joint."""
        mesh, structure = self.space.mesh, self.space.mesh.structure
        u = self._nonlinear[0]
        number = fem.Function(_fenicsx.space(mesh.grid, "DG", 0, 1))
        number.x.array[_fenicsx.cell_dofs(number.function_space)[:, 0]] = mesh.blocks
        higher = ufl.conditional(ufl.gt(number("+")[0], number("-")[0]), 1.0, -1.0)
        jump = higher * (u("+") - u("-"))
        facets, of_joint = mesh.joints
        found = []
        for k, joint in enumerate(structure.joints):
            own = facets[of_joint == k]
            tags = _fenicsx.tags(mesh.grid, 1, own, np.ones_like(own))
            dS = _fenicsx.jump_measure(mesh.grid, tags, *self._scheme)(1)
            along = _fenicsx.constant(mesh.grid, joint.tangent)
            arm = ufl.dot(
                ufl.SpatialCoordinate(mesh.grid) - _fenicsx.constant(mesh.grid, joint.middle), along
            )
            width = self._number(structure.width)
            opening = ufl.dot(jump, _fenicsx.constant(mesh.grid, structure.normals[k]))
            pull = width * normal_traction(opening, self._number(joint.contact.normal_stiffness))
            shear = width * shear_traction(
                ufl.dot(jump, along), self._number(joint.contact.shear_stiffness)
            )
            found.append(tuple(fem.form(f * dS) for f in (-pull, shear, -pull * arm("+"))))
        return found

    def resultants(self, displacement: Array) -> Array:
        """Return N, V, M of every joint, integrated from the tractions (n_joints, 3) [N, N, N m].

        Args:
            displacement: of all nodes (2 m,) [m].
        """
        self._nonlinear[0].x.array[:] = displacement
        return np.array([[fem.assemble_scalar(f) for f in joint] for joint in self._resultants])

    def stress(self) -> sparse.csr_matrix:
        """Mean stress of each cell, (σ_xx, σ_yy, σ_xy), from nodal displacements (3 cells, 2 m)."""
        grid = self.space.mesh.grid
        cellwise = _fenicsx.space(grid, "DG", 0, 3)
        u, test = ufl.TrialFunction(self.space.functions), ufl.TestFunction(cellwise)
        terms = []
        for m, dx in self._measures[0]:
            s = plane_stress(u, self._number(m.young), self._number(m.poisson))
            terms.append(ufl.inner(ufl.as_vector([s[0, 0], s[1, 1], s[0, 1]]), test) * dx)
        integral = _fenicsx.assembled_matrix(fem.form(sum(terms[1:], terms[0])))
        ones = ufl.inner(ufl.as_vector([1.0, 1.0, 1.0]), test) * ufl.dx(domain=grid)
        areas = _fenicsx.assembled_vector(fem.form(ones))
        order = (3 * _fenicsx.cell_dofs(cellwise) + np.arange(3)).ravel()
        return (sparse.diags(1.0 / areas) @ integral)[order]
