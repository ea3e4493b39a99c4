"""Linear elastic or rigid blocks between dry joints, in any coordinates.

Internal forces are f(q) = K q + Gᵀ W t(G q), with K the stiffness of the blocks and t the tractions
of the joints. The joints are the only nonlinearity. What an observer reads is linear, D q + d: at
each joint the gap at mid-depth, rotation and slip of its faces, and the displacements of the
corners of all free blocks.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, Self

import numpy as np
from scipy import sparse

from archfem._typing import Array, Numbers
from archfem.joints.operator import JointOperator, Pattern
from archfem.joints.own_law import OwnLawOperator, OwnLawStep
from archfem.joints.quadrature import Quadrature
from archfem.joints.resultants import face_matrix
from archfem.joints.rigid_kinematics import block_motion_gaps, rigid_joint_operator
from archfem.joints.step_average import StepForces
from archfem.masonry.structure import Structure, rigid_motion_matrix
from archfem.models.model import Cells, Model, ModelStep, Observer


class LinearBlockModel(Model):
    """A model with a constant block stiffness matrix and a joint operator."""

    large_displacements = False
    operator: JointOperator

    def __init__(
        self,
        structure: Structure,
        fidelity: str,
        *,
        mass: sparse.csr_matrix,
        block_stiffness: sparse.csr_matrix,
        mass_influence: Array,
        operator: JointOperator,
        cells: Cells,
    ) -> None:
        pattern = Pattern.of(mass, block_stiffness, operator.coupling_pattern())
        self.structure = structure
        self.fidelity = fidelity
        self.size = mass.shape[0]
        self.mass = pattern.spread(mass)
        self.block_stiffness = pattern.spread(block_stiffness)
        self.mass_influence = mass_influence
        self.operator = operator
        self.cells = cells
        self.support_motion = np.zeros((len(structure.blocks), 3))
        self._pattern = pattern
        self._joint_tangent = operator.tangent_map(pattern)
        # point stiffnesses and tangent of the last call
        self._last: tuple[Array, sparse.csr_matrix] | None = None

    def with_joint_law(self, operator: JointOperator) -> Self:
        """Return the model with another law at the same joint points."""
        return self.copy_with(operator=operator, _last=None)

    def with_support_motion(self, motion: Array) -> Self:
        """Return the model with supports displaced: joints have gaps and slips at q = 0."""
        offset = self.initial_gaps
        # gaps of moved supports add to those of construction
        if motion.any():
            gaps = block_motion_gaps(self.structure, self.operator.points, motion)
            offset = gaps if offset is None else gaps + offset
        operator = replace(self.operator, gap_offset=offset)
        return self.copy_with(operator=operator, support_motion=motion, _last=None)

    def with_initial_gaps(self, gaps: Array) -> Self:
        """Return the model with gaps and slips of its joints at q = 0, due to construction."""
        return self.copy_with(initial_gaps=gaps).with_support_motion(self.support_motion)

    @property
    def memory(self) -> Array:
        """Joint memory, as `Model.memory`."""
        return self.operator.memory

    def with_memory(self, memory: Array) -> Self:
        """Return the model with another joint memory."""
        operator = self.operator.with_memory(memory)
        return self.copy_with(operator=operator, _derived=self.derived)

    def updated_memory(self, q: Array) -> Array:
        """Return the joint memory once the model is at q, as `memory`."""
        return self.operator.updated_memory(q)

    def begin_step(self, start: Array, damping_lag: float) -> ModelStep:
        """Return a time step from a state with the present joint memory."""
        kind: Any = OwnLawStep if isinstance(self.operator, OwnLawOperator) else StepForces
        return LinearBlockStep(self, kind(self.operator, start, damping_lag))

    def observer(self) -> Observer:
        """Return the observer of joint faces and block displacements."""
        return linear_observer(self, self.operator)

    def force(self, q: Array) -> Array:
        """Return the internal forces of blocks and joints (n,)."""
        return np.asarray(self.block_stiffness @ q) + self.operator.force(q)

    def tangent(self, q: Array) -> sparse.csr_matrix:
        """Return the derivative of `force`, the same object while no point changes its state."""
        stiffness = self.operator.stiffness(q)
        if self._last is None or not np.array_equal(stiffness, self._last[0]):
            self._last = (stiffness, self.assemble_tangent(1.0, stiffness))
        return self._last[1]

    def support_forces(self, q: Array, motion: Array) -> Array:
        """Return the linearised change of `force` due to a small motion of the supports (n,)."""
        joints = self.operator
        gaps = block_motion_gaps(self.structure, joints.points, motion)
        return joints.generalised_force(*joints.linear_forces(joints.stiffness(q), gaps))

    def assemble_tangent(self, block_factor: float, stiffness: Array) -> sparse.csr_matrix:
        """Return the block stiffness times a factor, plus the tangent of the joints (n, n)."""
        of_joints = self._joint_tangent @ stiffness
        return self._pattern.with_data(block_factor * self.block_stiffness.data + of_joints)

    def closed_tangent(self) -> sparse.csr_matrix:
        """Return the tangent with every joint closed over its whole depth, without slip."""
        return self.assemble_tangent(1.0, self.operator.elastic_stiffness())

    def energy(self, q: Array) -> float:
        """Return the potential energy of blocks and joints without further slip [J]."""
        return 0.5 * float(q @ (self.block_stiffness @ q)) + self.operator.energy(q)

    def resultants(self, q: Array) -> Array:
        """Return N, V, M of every joint, for the whole width (n_joints, 3) [N, N, N m]."""
        return self.operator.resultants(q)


@dataclass(frozen=True, eq=False)
class LinearBlockStep:
    """A time step of linear blocks between joints."""

    model: LinearBlockModel  # with the joint memory at the start
    joints: StepForces  # the same step of the joints alone

    def force(self, q: Array) -> Array:
        """Return the mean of the internal forces of blocks and joints (n,)."""
        # mean over the step, shifted by the lag of damping: linear in time
        start, lag = self.joints.start, self.joints.damping_lag
        of_blocks = self.model.block_stiffness @ ((0.5 - lag) * start + (0.5 + lag) * q)
        return np.asarray(of_blocks) + self.joints.force(q)

    def tangent(self, q: Array) -> sparse.csr_matrix:
        """Return the derivative of `force` (n, n)."""
        factor = 0.5 + self.joints.damping_lag
        return self.model.assemble_tangent(factor, self.joints.stiffness(q))

    def resultants(self, q: Array) -> Array:
        """Return the means of N, V, M of every joint (n_joints, 3) [N, N, N m]."""
        return self.joints.resultants(q)

    def updated_memory(self, q: Array) -> Array:
        """Return the joint memory at the end of the step, as `Model.memory`."""
        return self.joints.updated_memory(q)

    def with_dilatancy(self, q: Array) -> "LinearBlockStep":
        """Return the step with the dilatancy opening due to the slip on the way to q."""
        joints = self.joints.with_dilatancy(q)
        return self if joints is self.joints else LinearBlockStep(self.model, joints)

    def dissipation(self, q: Array) -> float:
        """Return the energy lost to friction, broken bonds and damping [J]."""
        change = q - self.joints.start
        of_blocks = float(change @ (self.model.block_stiffness @ change))
        return self.joints.dissipation(q) + self.joints.damping_lag * of_blocks


def build_rigid_model(
    structure: Structure, cells: int = 4, rule: Quadrature | None = None
) -> LinearBlockModel:
    """Build the model of rigid blocks, in the motions (u, v, θ) of their centroids [m, m, rad]."""
    rule = rule or Quadrature("exact")
    # Gaps of rigid faces are linear: one exact facet suffices without friction and bonds, which
    # vary along it. Trapezoidal points, if given, are those of the whole joint.
    linear = not np.isfinite(structure.friction).any() and not structure.tension.any()
    whole = rule.rule == "exact" and linear
    whole |= rule.rule == "trapezoidal" and rule.points is not None
    facets = 1 if whole else cells
    free = [structure.blocks[number] for number in structure.free]
    density = np.array([structure.density(block) * structure.width for block in free])
    mass = density * [block.area for block in free]
    inertia = density * [block.polar_moment for block in free]
    diagonal = np.column_stack([mass, mass, inertia]).ravel()
    size = 3 * len(free)
    influence = np.zeros((size, 2))
    influence[0::3, 0] = influence[1::3, 1] = mass
    return LinearBlockModel(
        structure,
        "rigid",
        mass=sparse.diags(diagonal).tocsr(),
        block_stiffness=sparse.csr_matrix((size, size)),
        mass_influence=influence,
        operator=rigid_joint_operator(structure, facets, rule),
        cells=_rigid_cells(structure),
    )


def _rigid_cells(structure: Structure) -> Cells:
    """Return one polygon for each free block."""
    outlines = [structure.blocks[number].drawn() for number in structure.free]
    starts = np.cumsum([0, *map(len, outlines)])
    motions = [
        rigid_motion_matrix(outline, structure.blocks[number].centroid).reshape(-1, 3)
        for number, outline in zip(structure.free, outlines, strict=True)
    ]
    return Cells(
        places=np.concatenate(outlines),
        block=np.repeat(structure.free, [len(outline) for outline in outlines]),
        polygons=tuple(np.arange(a, b) for a, b in pairwise(starts)),
        shape_functions=sparse.block_diag(motions, format="csr"),
    )


@dataclass(frozen=True, eq=False)
class LinearObserver(Observer):
    """Observer of a model of small displacements."""

    matrix: sparse.csr_matrix  # D, from coordinates to readings (r, n)
    offset: Array  # d, readings at q = 0, due to moved supports and construction (r,)
    joint_count: int
    corner_blocks: Numbers
    structure: Structure
    cells: Cells
    support_motion: Array  # (n_blocks, 3) [m, m, rad]

    def read(self, q: Array) -> Array:
        """Return gaps, rotations and slips of joints, then corner displacements, in a row (r,)."""
        return np.asarray(self.matrix @ q + self.offset)

    def read_many(self, states: Array, faces: Array | None = None) -> Array:
        """Return the rows of `read` for many states (steps, r)."""
        del faces
        return np.asarray((self.matrix @ states.T).T + self.offset)

    def joint_ends(self, q: Array) -> Array:
        """Return the displacements of both ends of each joint (n_joints, 2, 2) [m]."""
        return (self._end_rows @ q).reshape(-1, 2, 2) + self._end_shift

    @cached_property
    def _end_rows(self) -> sparse.csr_matrix:
        """Matrix from coordinates to displacements of the joint ends (4 n_joints, n)."""
        # an end is midway between its two blocks, and supports do not depend on the coordinates
        rows = []
        for joint in self.structure.joints:
            free = [number for number in joint.blocks if not self.structure.blocks[number].fixed]
            for end in joint.ends:
                moving = (0.5 * self.cells.displacement_rows(number, end) for number in free)
                rows.append(sum(moving, sparse.csr_matrix((2, self.matrix.shape[1]))))
        return sparse.vstack(rows, format="csr")

    @cached_property
    def _end_shift(self) -> Array:
        """Displacements of the joint ends due to moved supports (n_joints, 2, 2) [m]."""
        shift = np.zeros((len(self.structure.joints), 2, 2))
        for number, joint in enumerate(self.structure.joints):
            for block in joint.blocks:
                motion = rigid_motion_matrix(joint.ends, self.structure.blocks[block].centroid)
                shift[number] += 0.5 * motion @ self.support_motion[block]
        return shift


def joint_orientation(structure: Structure) -> Array:
    """Return 1 where the extrados is on the left of a joint's normal, -1 on the right (j,)."""
    (nx, ny), (tx, ty) = structure.normals.T, structure.tangents.T
    return np.where(nx * ty - ny * tx > 0.0, 1.0, -1.0)


def linear_observer(model: Model, operator: JointOperator) -> LinearObserver:
    """Return the observer of a model of small displacements, built once for each model."""
    if "observer" not in model.derived:
        model.derived["observer"] = _build_observer(model, operator)
    return model.derived["observer"]


def _build_observer(model: Model, operator: JointOperator) -> LinearObserver:
    """Build an observer from the joint operator and the cells."""
    structure, cells = model.structure, model.cells
    of_faces, face_offset = face_matrix(operator)
    corners = cells.corners(structure)
    matrix = sparse.vstack([of_faces, cells.shapes_at(corners)], "csr")
    # corners are read from zero on
    offset = np.concatenate([face_offset, np.zeros(2 * len(corners))])
    count, owner = len(structure.joints), cells.block[corners]
    return LinearObserver(matrix, offset, count, owner, structure, cells, model.support_motion)
