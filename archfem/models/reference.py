"""Models with all nodes: linear blocks assembled once, and the reference without any shortcut.

Both are of elastic blocks, meshed by gmsh and assembled by DOLFINx. The reference assembles the
weak forms of its joints at every iteration; it is the independent check of the other models.

Displacements are linear along a step, from u_0 to u_1, and the tractions of `joints.contact_law`
are averaged over it. Internal forces are, for all v,

    ∫ w σ(ū):ε(v) + Σ_joints ∫ w (<t_n> ⟦v⟧·n + <t_s> ⟦v⟧·t),    ū = (½ - λ) u_0 + (½ + λ) u_1.

With the time lag β of damping, λ = β/Δt; the lag also shifts gaps to g + λ Δg. Friction over the
step is limited by μ |<t_n>| + c times the part of it for which the joint is closed.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
import ufl
from dolfinx import fem
from scipy import sparse

from archfem._typing import Array, Numbers
from archfem.errors import InvalidInput
from archfem.joints.operator import JointOperator, Pattern
from archfem.joints.quadrature import Quadrature
from archfem.masonry.structure import rigid_motion_matrix
from archfem.models.fem import _fenicsx
from archfem.models.fem.forms import Fields, Forms
from archfem.models.fem.joint_facets import PointReader
from archfem.models.fem.space import BrokenSpace, build_joint_operator
from archfem.models.linear_blocks import LinearBlockModel, linear_observer
from archfem.models.model import Cells, Model, ModelStep, Observer


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
        block_stiffness=forms.stiffness[free][:, free],
        mass_influence=mass @ axes,
        operator=build_joint_operator(space, rule),
        cells=_build_cells(space, forms, free),
    )


def _build_cells(space: BrokenSpace, forms: Forms, free: Numbers) -> Cells:
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


@dataclass(frozen=True, eq=False)
class StepForms:
    """Weak forms of a step, compiled when first used."""

    forms: Forms  # those of an instant

    @cached_property
    def _step(self) -> Fields:
        """Displacements at its start and its end."""
        functions = self.forms.space.functions
        return fem.Function(functions), fem.Function(functions)

    @cached_property
    def _lag(self) -> Any:
        return _fenicsx.constant(self.forms.space.mesh.grid, 0.0)

    def set_step(self, start: Array, end: Array, slip: Array, lag: float) -> Self:
        """Set displacements at both ends of the step, slip at its start and lag in all forms."""
        self._step[0].x.array[:], self._step[1].x.array[:] = start, end
        self._lag.value = lag
        self.forms.facets.set_point_values(slip)
        return self

    @cached_property
    def _work(self) -> Any:
        """Work of the mean tractions on a displacement v, a UFL form."""
        v = ufl.TestFunction(self.forms.space.functions)
        means = [faces.means(self._step, self._lag) for faces in self.forms.faces]
        return self.forms.joint_work(means, v)

    @cached_property
    def force(self) -> Any:
        """Mean of the forces of the joints (2 m,) [N]."""
        return fem.form(self._work)

    @cached_property
    def tangent(self) -> _fenicsx.MatrixAssembler:
        """Derivative of `force` by the displacement at the end [N/m]."""
        return _fenicsx.MatrixAssembler(fem.form(ufl.derivative(self._work, self._step[1])))

    @cached_property
    def tractions(self) -> PointReader:
        """Mean tractions and final irreversible slip at joint facet points (3, f, k)."""
        step, lag = self._step, self._lag
        return self.forms.point_reader(
            [[*f.means(step, lag), f.slip_after_step(step, lag)] for f in self.forms.faces]
        )

    @cached_property
    def dissipation(self) -> Any:
        """Energy lost to friction and damping in the joints [J]."""
        lost = [faces.dissipation(self._step, self._lag) for faces in self.forms.faces]
        return fem.form(self.forms.over_joints(lost))


class MonolithicModel(Model):
    """A model whose forces and tangents are assembled from compiled UFL forms."""

    fidelity = "monolithic"
    large_displacements = False
    operator = None

    def __init__(self, space: BrokenSpace, rule: Quadrature) -> None:
        linear = build_full_model(space, rule)
        self.structure = linear.structure
        self.size = linear.size
        self.mass_influence = linear.mass_influence
        self.cells = linear.cells
        self.support_motion = linear.support_motion
        self.free = space.free
        self.steps = StepForms(Forms(space, rule))
        self._forms = self.steps.forms
        self.facets = self._forms.facets
        self._linear = linear
        self._places, self._owner = space.places, space.owner
        self._displacement = np.zeros(2 * len(space.places))  # workspace, of all nodes
        self._memory = linear.memory
        coupled = self._of_free_blocks(self.steps.tangent.assemble())
        self._pattern = Pattern.of(linear.mass, linear.block_stiffness, coupled)
        self.mass = self._pattern.spread(linear.mass)
        self.block_stiffness = self._pattern.spread(linear.block_stiffness)
        self._closed = linear.closed_tangent()
        # assembled tangents of the joints and of the model in the last call
        self._last: tuple[sparse.csr_matrix, sparse.csr_matrix] | None = None

    def with_support_motion(self, motion: Array) -> Self:
        """Return the model with supports displaced: their nodes follow."""
        displacement = self._support_displacement(motion)
        return self.copy_with(support_motion=motion, _displacement=displacement)

    def _support_displacement(self, motion: Array) -> Array:
        """Displacements of all nodes, zero but for those of fixed blocks (2 m,) [m]."""
        displacement = np.zeros_like(self._displacement)
        for number in set(range(len(motion))) - set(self.structure.free):
            nodes = np.flatnonzero(self._owner == number)
            rigid = rigid_motion_matrix(self._places[nodes], self.structure.blocks[number].centroid)
            displacement.reshape(-1, 2)[nodes] = rigid @ motion[number]
        return displacement

    def with_initial_gaps(self, gaps: Array) -> Self:
        """Refuse initial gaps, which the weak forms do not contain."""
        raise InvalidInput(
            f"a model '{self.fidelity}' cannot be built in stages: use 'full', which is the same"
        )

    @property
    def memory(self) -> Array:
        """Irreversible slip of each joint point (p,) [m]."""
        return self._memory

    def with_memory(self, memory: Array) -> Self:
        """Return the model with another joint memory."""
        return self.copy_with(_memory=memory, _derived=self.derived)

    def updated_memory(self, q: Array) -> Array:
        """Return the irreversible slip of each joint point once the model is at q (p,) [m]."""
        return self.facets.gather(self._tractions(q)[2])

    def begin_step(self, start: Array, damping_lag: float) -> ModelStep:
        """Return a time step from a state with the present joint memory."""
        if any(joint.contact.closure is not None for joint in self.structure.joints):
            raise InvalidInput(
                f"contacts have a closure, of which a model '{self.fidelity}' has no means over a "
                "time step: use scheme=af.dynamics.Newmark(), or fidelity 'full', which is the "
                "same but for them"
            )
        return MonolithicStep(self, start, damping_lag)

    @property
    def kinematics(self) -> JointOperator:
        """Joint operator at the same points, for openings and slips only."""
        return self._linear.with_support_motion(self.support_motion).operator

    def observer(self) -> Observer:
        """Return the observer of joint faces and block displacements."""
        return linear_observer(self, self.kinematics)

    def spread(self, q: Array) -> Array:
        """Return displacements of all nodes, those of fixed blocks included (2 m,) [m]."""
        # one workspace: each call overwrites what the last one returned
        self._displacement[self.free] = q
        return self._displacement

    def force(self, q: Array) -> Array:
        """Return the internal forces of blocks and joints (n,)."""
        return self._forms.force(self.spread(q), self._memory)[self.free]

    def tangent(self, q: Array) -> sparse.csr_matrix:
        """Return the derivative of `force`, the same object while no point changes its state."""
        of_joints = self._forms.joint_tangent(self.spread(q), self._memory)
        if self._last is None or not np.array_equal(of_joints.data, self._last[0].data):
            self._last = of_joints, self.add_joints(1.0, of_joints)
        return self._last[1]

    def support_forces(self, q: Array, motion: Array) -> Array:
        """Return the linearised change of `force` due to a small motion of the supports (n,)."""
        tangent = self._forms.tangent(self.spread(q), self._memory)
        return (tangent @ self._support_displacement(motion))[self.free]

    def _of_free_blocks(self, matrix: sparse.csr_matrix) -> sparse.csr_matrix:
        """Return the rows and columns of an assembled matrix for the free blocks (n, n)."""
        # Rows of fixed blocks are left out, rather than replaced as by boundary conditions of
        # DOLFINx: coordinates are those of the free blocks, as for every other fidelity.
        return matrix[self.free][:, self.free]

    def add_joints(self, block_factor: float, of_joints: sparse.csr_matrix) -> sparse.csr_matrix:
        """Return the block stiffness times a factor, plus an assembled tangent of joints (n, n)."""
        joints = self._pattern.spread(self._of_free_blocks(of_joints))
        return self._pattern.with_data(block_factor * self.block_stiffness.data + joints.data)

    def closed_tangent(self) -> sparse.csr_matrix:
        """Return the tangent with every joint closed over its whole depth."""
        return self._pattern.spread(self._closed)

    def energy(self, q: Array) -> float:
        """Return the potential energy of blocks and joints without further slip [J]."""
        return self._forms.energy(self.spread(q), self._memory)

    def resultants(self, q: Array) -> Array:
        """Return N, V, M of every joint, for the whole width (n_joints, 3) [N, N, N m]."""
        return self.facets.resultants(*self._tractions(q)[:2])

    def _tractions(self, q: Array) -> Array:
        return self._forms.tractions(self.spread(q), self._memory)


@dataclass(frozen=True, eq=False)
class MonolithicStep(ModelStep):
    """A time step of the reference model."""

    model: MonolithicModel  # with the joint memory at the start
    start: Array  # coordinates at its start (n,)
    damping_lag: float  # time lag of damping over the length of the step [-]

    def _forms(self, q: Array) -> StepForms:
        """Return the forms of the step to q, which the steps of a model share."""
        model, start = self.model, self.model.spread(self.start).copy()
        return model.steps.set_step(start, model.spread(q), model.memory, self.damping_lag)

    def force(self, q: Array) -> Array:
        """Return the mean of the internal forces of blocks and joints (n,)."""
        model, lag = self.model, self.damping_lag
        mean = (0.5 - lag) * self.start + (0.5 + lag) * q
        of_joints = _fenicsx.assemble_vector(self._forms(q).force)[model.free]
        return np.asarray(model.block_stiffness @ mean) + of_joints

    def tangent(self, q: Array) -> sparse.csr_matrix:
        """Return the derivative of `force` (n, n)."""
        of_joints = self._forms(q).tangent.assemble()
        return self.model.add_joints(0.5 + self.damping_lag, of_joints)

    def _tractions(self, q: Array) -> Array:
        return self.model.facets.read(self._forms(q).tractions)

    def resultants(self, q: Array) -> Array:
        """Return the means of N, V, M of every joint (n_joints, 3) [N, N, N m]."""
        return self.model.facets.resultants(*self._tractions(q)[:2])

    def updated_memory(self, q: Array) -> Array:
        """Return the irreversible slip of each joint point at the end (p,) [m]."""
        return self.model.facets.gather(self._tractions(q)[2])

    def dissipation(self, q: Array) -> float:
        """Return the energy lost to friction and damping [J]."""
        change = q - self.start
        of_blocks = change @ (self.model.block_stiffness @ change)
        at_joints = fem.assemble_scalar(self._forms(q).dissipation)
        return float(self.damping_lag * of_blocks + at_joints)
