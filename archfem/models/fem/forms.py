"""Weak forms of blocks and joints in UFL: the definition behind all meshed models.

Find u in the broken space such that for all v

    ∫ w ρ ü·v + ∫ w σ(u):ε(v) + Σ_joints ∫ w (t_n ⟦v⟧·n + t_s ⟦v⟧·t) = ∫ w ρ b·v.

The stress σ is plane. The tractions are those of `joints.contact_law`. They follow from the gap
g = ⟦u⟧·n and the slip s = ⟦u⟧·t:

    t_n = k_n <g>_-,    t_s = k_s (s - s_p),    |t_s| ≤ μ |t_n| + c on the closed part of a joint.

The irreversible slip s_p of each point grows where friction does not hold t_s.
`models.reference` has the means over a step.

The normal n is from one side of a facet to the other, and ⟦u⟧ is the jump along it. Neither gap nor
slip depends on which side is first. Here t is ±n rotated to the left. Its sign lets t point to the
extrados for n from the lower to the higher block.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from scipy import sparse

from archfem._typing import Array
from archfem.joints.contact_law import (
    SLIP_LIMIT_TOLERANCE,
    ContactLaw,
    clip_to_friction,
    contact_fraction,
    lagged_path,
    shear_loss,
    shear_over_step,
)
from archfem.joints.quadrature import Quadrature
from archfem.masonry.materials import Material
from archfem.models.fem import _fenicsx
from archfem.models.fem.joint_facets import JointFacets, Patch, PointReader
from archfem.models.fem.space import BrokenSpace

# Overlap of faces that just touch [m], and friction reserve there [Pa]: far below round-off of any
# other value, but it makes UFL's derivatives those of a closed joint that holds. That of |x| is
# zero at x = 0, which would halve the stiffness. `ufl.conditional` has a branch for this point, but
# the law is written once for NumPy and UFL, which share no function with such a branch.
CONTACT_PERTURBATION = 1e-200

Fields = tuple[Any, Any]


@dataclass(frozen=True, eq=False)
class ContactFaces:
    """UFL expressions of gap, slip and tractions on facets of one contact and one graph colour."""

    facets: JointFacets  # on all joints
    patch: Patch  # those of this contact and of one colour

    @cached_property
    def _law(self) -> ContactLaw:
        """Contact law with constants of the forms."""
        return ContactLaw.of(self.patch.contact).mapped(self.facets.space.constant)

    @cached_property
    def _normal(self) -> Any:
        return ufl.FacetNormal(self.facets.space.mesh.grid)("+")

    def opening(self, u: Any) -> Any:
        """Return the gap of a displacement, positive open [m]."""
        return ufl.dot(u("-") - u("+"), self._normal)

    def slip(self, u: Any) -> Any:
        """Return the slip of a displacement, of the higher block toward the extrados [m]."""
        tangent = self.facets.tangent_sign(self.patch.colour) * ufl.perp(self._normal)
        return ufl.dot(u("-") - u("+"), tangent)

    def _trial_shear(self, u: Any) -> Any:
        """Traction along the joint without further slip [Pa]."""
        return self._law.shear_traction(self.slip(u) - self._irreversible_slip)

    @property
    def _irreversible_slip(self) -> Any:
        """Irreversible slip before [m]."""
        return self.facets.point_values(self.patch.colour)

    def _gap(self, u: Any) -> Any:
        """Gap of the normal law, slightly closed where faces just touch [m]."""
        return self.opening(u) - CONTACT_PERTURBATION

    def tractions(self, u: Any) -> Fields:
        """Return the tractions across and along the joint [Pa]."""
        return self._tractions(u, 0.0)

    def tangent_tractions(self, u: Any, fixed: Any) -> Fields:
        """Return tractions to differentiate, with a limit raised so that round-off causes no slip.

        The limit is a little larger; `fixed` equals u, but the derivative by u leaves it constant.
        """
        limit, closed = self._limit(fixed), self._is_closed(fixed)
        return self._tractions(u, SLIP_LIMIT_TOLERANCE * limit + CONTACT_PERTURBATION * closed)

    def _normal_traction(self, u: Any) -> Any:
        """Traction across the joint [Pa]."""
        law = self._law
        stiffens = self.patch.contact.closure is not None
        return (law.closing_traction if stiffens else law.normal_traction)(self._gap(u))

    def _tractions(self, u: Any, reserve: Any) -> Fields:
        """Tractions with Coulomb's limit raised by `reserve` [Pa]."""
        normal = self._normal_traction(u)
        return normal, clip_to_friction(self._trial_shear(u), self._limit(u) + reserve)

    def _is_closed(self, u: Any) -> Any:
        """Closed part of the joint: one where it is closed, else zero [-]."""
        return ufl.conditional(ufl.lt(self._law.cohesive_gap(self._gap(u)), 0.0), 1.0, 0.0)

    def _limit(self, u: Any) -> Any:
        """Coulomb's limit at the normal traction that a displacement causes [Pa]."""
        return self._law.shear_limit(self._normal_traction(u), self._is_closed(u))

    def energy(self, u: Any) -> Any:
        """Return the energy stored per area without further slip [J/m²]."""
        along = 0.5 * self._trial_shear(u) ** 2 / self._law.shear_stiffness
        if self.patch.contact.closure is not None:
            return self._law.closing_energy(self.opening(u), ufl.ln) + along
        return self._law.normal_energy(self.opening(u)) + along

    def add_slip(self, u: Any) -> Any:
        """Return the irreversible slip once the joint is displaced by u [m]."""
        return self._add_slip(self._trial_shear(u) - self.tractions(u)[1])

    def _add_slip(self, lost: Any) -> Any:
        """Irreversible slip once an elastic traction is lost [m]."""
        return self._irreversible_slip + lost / self._law.shear_stiffness

    def _gap_path(self, step: Fields, lag: Any) -> Fields:
        """Gaps at start and end of the step, plus their change times `lag`, due to damping [m]."""
        return lagged_path(self._gap(step[0]), self._gap(step[1]), lag)

    def _shear_path(self, step: Fields) -> Fields:
        """Elastic traction at the start, and its change without further slip [Pa]."""
        change = self.slip(step[1]) - self.slip(step[0])
        return self._trial_shear(step[0]), self._law.shear_traction(change)

    def _mean_limit(self, step: Fields, lag: Any) -> Any:
        """Coulomb's limit over a step: that of the mean normal traction [Pa]."""
        path = self._gap_path(step, lag)
        closed = contact_fraction(*map(self._law.cohesive_gap, path))
        return self._law.shear_limit(self._law.mean_normal_traction(*path), closed)

    def means(self, step: Fields, lag: Any) -> Fields:
        """Return the means over a step of the tractions across and along the joint [Pa]."""
        return self._law.mean_normal_traction(*self._gap_path(step, lag)), self._shear(step, lag)[0]

    def _shear(self, step: Fields, lag: Any) -> Fields:
        """Mean traction along the joint over a step, and its loss by slip [Pa]."""
        return shear_over_step(*self._shear_path(step), lag, self._mean_limit(step, lag))

    def slip_after_step(self, step: Fields, lag: Any) -> Any:
        """Return the irreversible slip at the end of a step [m]."""
        return self._add_slip(self._shear(step, lag)[1])

    def dissipation(self, step: Fields, lag: Any) -> Any:
        """Return the energy per area lost to friction and damping over a step [J/m²]."""
        # damping across the joint: lagged minus unlagged mean traction, on the change of the gap
        before, after = self._gap_path(step, 0.0)
        means = (self._law.mean_normal_traction(*self._gap_path(step, each)) for each in (lag, 0.0))
        across = (next(means) - next(means)) * (after - before)
        along = shear_loss(*self._shear_path(step), lag, self._mean_limit(step, lag))
        return across + along / self._law.shear_stiffness


def strain(u: Any) -> Any:
    """Return the small strain ε(u), a UFL expression."""
    return ufl.sym(ufl.grad(u))


def plane_stress(u: Any, young: Any, poisson: Any) -> Any:
    """Return the stress of a linear elastic sheet that is free out of plane [Pa]."""
    shear = young / (2.0 * (1.0 + poisson))
    plane = young * poisson / (1.0 - poisson**2)
    return 2.0 * shear * strain(u) + plane * ufl.tr(strain(u)) * ufl.Identity(2)


@dataclass(frozen=True, eq=False)
class Forms:
    """Weak forms of a structure on its broken space.

    Materials and contacts enter as constants of the forms, so that changing a number compiles
    nothing. Matrices and vectors are over all nodes, those of fixed blocks included.
    """

    space: BrokenSpace  # of the displacements
    rule: Quadrature  # quadrature along the joints

    @cached_property
    def _measures(self) -> list[tuple[Any, Any]]:
        """Materials and the measures over their cells."""
        mesh, structure = self.space.mesh, self.space.mesh.structure
        materials = list(dict.fromkeys(block.material for block in structure.blocks))
        of_block = np.array([materials.index(block.material) for block in structure.blocks])
        cells = np.arange(len(mesh.blocks), dtype=np.int32)
        tags = _fenicsx.tag_entities(mesh.grid, 2, cells, of_block[mesh.blocks])
        dx = ufl.Measure("dx", domain=mesh.grid, subdomain_data=tags)
        return [(material, dx(k)) for k, material in enumerate(materials)]

    @cached_property
    def facets(self) -> JointFacets:
        """Facets on joints, and values at their points."""
        return JointFacets(self.space, self.rule)

    @cached_property
    def faces(self) -> list[ContactFaces]:
        """Faces of the joints, one entry for each contact and colour."""
        return [ContactFaces(self.facets, patch) for patch in self.facets.patches]

    def _stress(self, u: Any, material: Material) -> Any:
        moduli = map(self.space.constant, (material.young, material.poisson))
        return plane_stress(u, *moduli)

    def block_work(self, u: Any, v: Any) -> Any:
        """Return ∫ w σ(u):ε(v), a UFL form."""
        width = self.space.constant(self.space.mesh.structure.width)
        return sum(
            width * ufl.inner(self._stress(u, material), strain(v)) * dx
            for material, dx in self._measures
        )

    def over_joints(self, densities: list[Any]) -> Any:
        """Return Σ ∫ w d over the joints, a UFL form."""
        width = self.space.constant(self.space.mesh.structure.width)
        pairs = zip(densities, self.faces, strict=True)
        return sum(width * density * faces.patch.measure for density, faces in pairs)

    def joint_work(self, tractions: list[Fields], v: Any) -> Any:
        """Return Σ ∫ w (t_n ⟦v⟧·n + t_s ⟦v⟧·t), a UFL form."""
        pairs = zip(tractions, self.faces, strict=True)
        return self.over_joints([n * f.opening(v) + s * f.slip(v) for (n, s), f in pairs])

    def point_reader(self, values: list[list[Any]]) -> PointReader:
        """Compile the form that evaluates expressions at the points of joints."""
        patches = [faces.patch for faces in self.faces]
        return self.facets.point_reader(list(zip(patches, values, strict=True)))

    @cached_property
    def stiffness(self) -> sparse.csr_matrix:
        """Stiffness of the blocks, assembled once since their law is linear (2 m, 2 m) [N/m]."""
        u, v = ufl.TrialFunction(self.space.functions), ufl.TestFunction(self.space.functions)
        return _fenicsx.assemble_matrix(fem.form(self.block_work(u, v)))

    def mass(self) -> sparse.csr_matrix:
        """Assemble the consistent mass [kg]."""
        structure = self.space.mesh.structure
        u, v = ufl.TrialFunction(self.space.functions), ufl.TestFunction(self.space.functions)
        width = self.space.constant(structure.width)
        integral = sum(
            width * self.space.constant(m.unit_weight / structure.gravity) * ufl.inner(u, v) * dx
            for m, dx in self._measures
        )
        return _fenicsx.assemble_matrix(fem.form(integral))

    @cached_property
    def _displacements(self) -> Fields:
        """The displacement, and a copy by which no form is differentiated."""
        return fem.Function(self.space.functions), fem.Function(self.space.functions)

    def _set_state(self, displacement: Array, slip: Array | None) -> None:
        """Set displacement and irreversible slip in all forms."""
        for u in self._displacements:
            u.x.array[:] = displacement
        self.facets.set_point_values(np.zeros(self.facets.count) if slip is None else slip)

    @cached_property
    def _force(self) -> Any:
        u, v = self._displacements[0], ufl.TestFunction(self.space.functions)
        return fem.form(self.joint_work([faces.tractions(u) for faces in self.faces], v))

    def force(self, displacement: Array, slip: Array | None = None) -> Array:
        """Return the internal forces of blocks and joints (2 m,) [N]."""
        self._set_state(displacement, slip)
        return np.asarray(self.stiffness @ displacement) + _fenicsx.assemble_vector(self._force)

    @cached_property
    def _joint_tangent(self) -> _fenicsx.MatrixAssembler:
        (u, fixed), v = self._displacements, ufl.TestFunction(self.space.functions)
        of_joints = self.joint_work([f.tangent_tractions(u, fixed) for f in self.faces], v)
        return _fenicsx.MatrixAssembler(fem.form(ufl.derivative(of_joints, u)))

    def joint_tangent(self, displacement: Array, slip: Array | None = None) -> sparse.csr_matrix:
        """Return the derivative of the joint forces (2 m, 2 m) [N/m]."""
        self._set_state(displacement, slip)
        return self._joint_tangent.assemble()

    def tangent(self, displacement: Array, slip: Array | None = None) -> sparse.csr_matrix:
        """Return the derivative of `force` (2 m, 2 m) [N/m]."""
        return self.stiffness + self.joint_tangent(displacement, slip)

    @cached_property
    def _energy(self) -> Any:
        u = self._displacements[0]
        return fem.form(self.over_joints([faces.energy(u) for faces in self.faces]))

    def energy(self, displacement: Array, slip: Array | None = None) -> float:
        """Return the potential energy of blocks and joints without further slip [J]."""
        self._set_state(displacement, slip)
        of_blocks = 0.5 * displacement @ (self.stiffness @ displacement)
        return float(of_blocks + fem.assemble_scalar(self._energy))

    @cached_property
    def _tractions(self) -> PointReader:
        u = self._displacements[0]
        return self.point_reader([[*faces.tractions(u), faces.add_slip(u)] for faces in self.faces])

    def tractions(self, displacement: Array, slip: Array | None = None) -> Array:
        """Return tractions and irreversible slip of the points of each joint facet (3, f, k)."""
        self._set_state(displacement, slip)
        return self.facets.read(self._tractions)

    def stress(self) -> sparse.csr_matrix:
        """Return the matrix from nodal displacements to mean stresses of the cells (3 n, 2 m)."""
        grid = self.space.mesh.grid
        cellwise = _fenicsx.vector_space(grid, "DG", 0, 3)
        u, test = ufl.TrialFunction(self.space.functions), ufl.TestFunction(cellwise)
        terms = []
        for material, dx in self._measures:
            s = self._stress(u, material)
            terms.append(ufl.inner(ufl.as_vector([s[0, 0], s[1, 1], s[0, 1]]), test) * dx)
        integral = _fenicsx.assemble_matrix(fem.form(sum(terms)))
        ones = ufl.inner(ufl.as_vector([1.0, 1.0, 1.0]), test) * ufl.dx(domain=grid)
        areas = _fenicsx.assemble_vector(fem.form(ones))
        # σ_xx, σ_yy, σ_xy of each cell in turn
        order = (3 * _fenicsx.cell_dofs(cellwise) + np.arange(3)).ravel()
        return (sparse.diags(1.0 / areas) @ integral)[order]
