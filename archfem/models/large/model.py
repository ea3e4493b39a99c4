"""Models of large displacements: blocks with rotations and slips of any size.

A model of small displacements is written in corotational coordinates of its blocks: displacement
of the centroid, rotation, and elastic motions in the frame that rotates with the block. These
neither move the centroid nor rotate the block on the mean (mean axes), so the mass matrix is
constant. Inertia forces on them due to the spin of the block are neglected.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from scipy import sparse
from scipy.linalg import qr
from scipy.sparse.linalg import splu

from archfem._typing import Array, Numbers
from archfem.errors import InvalidInput
from archfem.joints.large.face_kinematics import face_pose
from archfem.joints.large.forces import (
    JointStepForces,
    allocate_step_forces,
    compute_step_forces,
    facet_slips,
    joint_energy,
    measure_states,
)
from archfem.joints.large.rates import assemble_rates, find_rate_blocks
from archfem.joints.operator import Pattern
from archfem.masonry.block import rotate
from archfem.masonry.loads import Action, BodyForce, PointLoad
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import rigid_motion_matrix
from archfem.models.condensed import project_model
from archfem.models.large.joints import JointSegments, build_large_joints, measure_segments
from archfem.models.linear_blocks import LinearBlockModel, joint_orientation
from archfem.models.model import Cells, Model, ModelStep, Observer


@dataclass(frozen=True, eq=False)
class CorotationalCoordinates:
    """Blocks of a model of small displacements in coordinates of their own.

    A fill retains its coordinates: it deforms rather than rotates, and its displacements are small.
    """

    basis: sparse.csr_matrix  # those coordinates in the model's (n, n)
    # coordinates of each free block, and whether it has a rotating frame, by block number
    blocks: dict[int, tuple[range, bool]]
    centres: Array  # about which blocks rotate (n_blocks, 2) [m]

    @classmethod
    def of(cls, small: LinearBlockModel) -> "CorotationalCoordinates":
        """Return the coordinates of the blocks of a model."""
        bases, order, blocks, count = [], [], {}, 0
        # fill in one piece deforms with the blocks below: it gets no rotating frame
        soft, stones = find_yielding_blocks(small.structure), small.structure.blocks
        fill = {number for number in soft if not stones[number].grain}
        centres = small.structure.centroids.copy()
        for number in small.structure.free:
            columns = np.flatnonzero(small.cells.coordinate_owner == number)
            has_frame = number not in fill or len(columns) == 3
            basis: Any = sparse.identity(len(columns))
            if has_frame:
                basis, centres[number] = _corotational_basis(small, columns, number)
            blocks[number] = range(count, count + basis.shape[1]), has_frame
            count += basis.shape[1]
            bases.append(basis)
            order.append(columns)
        stacked = sparse.block_diag(bases, format="csr")
        return cls(stacked[np.argsort(np.concatenate(order))], blocks, centres)


def _corotational_basis(small: LinearBlockModel, columns: Any, number: int) -> tuple[Array, Array]:
    """Return rigid and elastic motions of a block in the model's coordinates, and its centre."""
    mass = small.mass[columns][:, columns].toarray()
    cells = small.cells
    nodes = np.flatnonzero(cells.block == number)
    shapes = cells.shapes_at(nodes)[:, columns].toarray()

    def rigid_motions(centre: Array) -> Array:
        motion = rigid_motion_matrix(cells.places[nodes], centre).reshape(-1, 3)
        return np.linalg.lstsq(shapes, motion, rcond=None)[0]

    # the centre of mass uncouples displacement and rotation
    centre = np.array(small.structure.blocks[number].centroid)
    rigid = rigid_motions(centre)
    inertia = rigid.T @ mass @ rigid
    centre = centre + np.array([inertia[1, 2], -inertia[0, 2]]) / inertia[0, 0]
    rigid = rigid_motions(centre)
    if len(columns) == 3:
        return rigid, centre
    return np.column_stack([rigid, _mean_axis_motions(small, columns, rigid.T @ mass)]), centre


def _mean_axis_motions(small: LinearBlockModel, columns: Any, momentum: Array) -> Array:
    """Return a sparse basis of a block's motions without momentum, from its momenta (3, s).

    Each motion displaces one coordinate, and three that are common to all motions. A face then sees
    few motions unless it has one of the three. These are therefore at the corners of one face: the
    first, so that of two stacked blocks one sees few motions at their joint.
    """
    operator = small.operator
    touched = (abs(operator.opening) + abs(operator.slip))[:, columns]
    joint = operator.points.joint
    first = touched[joint == joint[touched.getnnz(axis=1) > 0][0]]
    # pivots by weight: corners touch half as many points; other faces only where one has too few
    weights = np.where(first.getnnz(axis=0) > 0, 1.0, 1e-3)
    weights /= np.maximum(touched.getnnz(axis=0), 1) ** 2
    scaled = momentum / np.linalg.norm(momentum, axis=1)[:, None] * weights
    order = qr(scaled, mode="r", pivoting=True)[1]
    common, own = np.sort(order[:3]), np.sort(order[3:])
    basis = np.zeros((len(columns), len(own)))
    basis[own, np.arange(len(own))] = 1.0
    basis[common] = -np.linalg.solve(momentum[:, common], momentum[:, own])
    return basis


def check_small_model(small: Model) -> LinearBlockModel:
    """Return a model of small displacements, or refuse one that cannot have large ones."""
    if not isinstance(small, LinearBlockModel):
        raise InvalidInput(
            f"large displacements do not exist with fidelity '{small.fidelity}': use 'full', which "
            "is the same model, or a lower one"
        )
    if not small.operator.points.is_plain:
        joints = small.structure.joints
        first = next(x for x in joints if x.contact.dilatancy or x.contact.tension)
        raise InvalidInput(
            "joints with dilatancy or tension do not exist with large displacements, as at "
            f"'{first.name}' of contact '{first.contact.name}': leave these out, or give "
            "displacements 'small', which follow no fall"
        )
    return small


@dataclass(frozen=True, eq=False)
class RotatingCells(Cells):
    """Cells of blocks in corotational coordinates."""

    # coordinate of the rotation of each point's block, -1 without a rotating frame (m,)
    turns: Any = ()

    @classmethod
    def of(cls, cells: Cells, blocks: dict[int, tuple[range, bool]]) -> "RotatingCells":
        """Return the cells on rotating blocks."""
        turn = {n: span.start + 2 if has_frame else -1 for n, (span, has_frame) in blocks.items()}
        turns = np.array([turn[int(block)] for block in cells.block])
        return cls(
            cells.places, cells.block, cells.polygons, cells.shape_functions, cells.stress, turns
        )

    @cached_property
    def _arms(self) -> tuple[Array, sparse.csr_matrix]:
        """Vectors from the centroids to the points (2, m), and elastic displacements (2 m, n)."""
        columns = self.shape_functions.tocsc()
        turn = np.unique(self.turns[self.turns >= 0])
        arms = np.zeros_like(self.places)
        # displacements by a unit rotation are the arms, rotated by 90°
        for column in turn:
            motion = columns[:, column].toarray().reshape(-1, 2)
            points = self.turns == column
            arms[points] = np.column_stack([motion[points, 1], -motion[points, 0]])
        rigid = np.zeros(self.shape_functions.shape[1], bool)
        rigid[np.concatenate([turn, turn - 1, turn - 2])] = True
        elastic = (self.shape_functions @ sparse.diags((~rigid).astype(float))).tocsr()
        elastic.eliminate_zeros()
        return arms.T, elastic

    def select(self, points: Any) -> "RotatingCells":
        """Return some of the points alone, without polygons."""
        places, block, turns = self.places[points], self.block[points], self.turns[points]
        return RotatingCells(places, block, (), self.shapes_at(points), None, turns)

    def displacement(self, q: Array) -> Array:
        """Return the displacements of all points (…, m, 2) [m]."""
        (rx, ry), elastic = self._arms
        turns = self.turns
        turn, x, y = (np.where(turns >= 0, q[..., turns - k], 0.0) for k in (0, 2, 1))
        # (x, y) + (R - I) r + R u, with cos θ - 1 by the half angle
        c, s, less = np.cos(turn), np.sin(turn), -2.0 * np.sin(0.5 * turn) ** 2
        dx, dy = x + less * rx - s * ry, y + s * rx + less * ry
        if elastic.nnz:
            strained = np.asarray(elastic @ q.T).T.reshape(*x.shape, 2)
            u, v = strained[..., 0], strained[..., 1]
            dx, dy = dx + c * u - s * v, dy + s * u + c * v
        return np.stack([dx, dy], axis=-1)


@dataclass(frozen=True, eq=False)
class RotatingPoint:
    """A point of a block with a rotating frame."""

    first: int  # first coordinate of the block
    arm: Array  # from the centroid of the block (2,) [m]
    shapes: Array  # displacements by the elastic motions (2, s)

    def _local(self, q: Array) -> tuple[Array, Array, Array]:
        """Return the place in the block's frame, the rotation matrix, and its derivative."""
        c, s = np.cos(q[self.first + 2]), np.sin(q[self.first + 2])
        strained = self.shapes @ q[self.first + 3 : self.first + 3 + self.shapes.shape[1]]
        return self.arm + strained, np.array([[c, -s], [s, c]]), np.array([[-s, -c], [c, -s]])

    def displacement(self, q: Array) -> Array:
        """Return the displacement from coordinates (2,) [m]."""
        place, rotation, _ = self._local(q)
        return q[self.first : self.first + 2] + rotation @ place - self.arm

    def gradient(self, q: Array, size: int) -> sparse.csr_matrix:
        """Return the derivative of the displacement (2, n)."""
        place, rotation, rate = self._local(q)
        local = np.column_stack([np.eye(2), rate @ place, rotation @ self.shapes])
        gradient = sparse.lil_matrix((2, size))
        gradient[:, self.first + np.arange(local.shape[1])] = local
        return gradient.tocsr()

    def force_rate(self, q: Array, force: Array, size: int) -> sparse.csr_matrix:
        """Return the derivative of the generalised forces of a force on the point (n, n)."""
        place, rotation, rate = self._local(q)
        turn, elastic = self.first + 2, self.first + 3 + np.arange(self.shapes.shape[1])
        matrix = sparse.lil_matrix((size, size))
        matrix[turn, turn] = -force @ (rotation @ place)
        matrix[turn, elastic] = matrix[elastic, turn] = force @ (rate @ self.shapes)
        return matrix.tocsr()


class LargeDisplacementModel(Model):
    """A model in corotational coordinates of the blocks, built from one of small displacements."""

    large_displacements = True
    operator = None

    def __init__(self, small: Model) -> None:
        small = check_small_model(small)
        blocks = CorotationalCoordinates.of(small)
        # the model of small displacements in the same coordinates
        self.small = project_model(small, blocks.basis, small.fidelity)
        self.structure = small.structure
        self.fidelity = small.fidelity
        self.size = self.small.size
        # first coordinate of each free block, and the number of all
        self.block_starts = np.array([0, *(span.stop for span, _ in blocks.blocks.values())])
        # whether each free block has a rotating frame; fill has none
        self.has_frame = np.array([turns for _, turns in blocks.blocks.values()])
        self.centres = blocks.centres  # about which blocks rotate (n_blocks, 2) [m]
        self.segments = JointSegments.of(self.small)
        self.joints = build_large_joints(self.small, self.segments, blocks.blocks, blocks.centres)
        sides = self.joints.kinematics
        # entries of `JointStepForces.force` that act on a coordinate, and these coordinates
        used = np.arange(sides.index.shape[-1]) < sides.size[:, :, None]
        self._forces = np.flatnonzero(used)
        self._rows = sides.index.ravel()[self._forces]
        _, pairs = find_rate_blocks(sides.index, sides.size)
        coupled = sparse.csr_matrix((np.ones(len(pairs[0])), pairs), (self.size, self.size))
        pattern = Pattern.of(self.small.mass, self.small.block_stiffness, coupled)
        self.mass = pattern.spread(self.small.mass)
        self.block_stiffness = pattern.spread(self.small.block_stiffness)
        self._pattern = pattern
        self._entries = pattern.find_entries(*pairs).astype(np.uint32)
        self.mass_influence = self.small.mass_influence
        self.cells: RotatingCells = RotatingCells.of(self.small.cells, blocks.blocks)
        self.support_motion = self.small.support_motion
        self._points: dict[PointLoad, RotatingPoint] = {}
        self._slip = np.zeros_like(allocate_step_forces(self.joints).irreversible_slip)

    def with_support_motion(self, motion: Array) -> Self:
        """Return the model with supports displaced, as far as they like."""
        sides = self.joints.kinematics._replace(fixed_pose=self.segments.fixed_poses(motion))
        joints = self.joints._replace(kinematics=sides)
        return self.copy_with(support_motion=motion, joints=joints)

    def with_initial_gaps(self, gaps: Array) -> Self:
        """Return the model with gaps and slips of its joints at q = 0, due to construction."""
        measures = np.column_stack(measure_segments(self.small, self.segments, *gaps))
        joints = self.joints._replace(initial_measures=np.ascontiguousarray(measures))
        return self.copy_with(initial_gaps=gaps, joints=joints)

    @property
    def memory(self) -> Array:
        """Irreversible slip of each joint point (p,) [m]."""
        return self._slip

    def with_memory(self, memory: Array) -> Self:
        """Return the model with another joint memory."""
        return self.copy_with(_slip=np.ascontiguousarray(memory, float), _derived=self.derived)

    def updated_memory(self, q: Array) -> Array:
        """Return the irreversible slip of each joint point once the model is at q (p,) [m]."""
        return self._instant(q).irreversible_slip

    def small_displacement_model(self) -> Model:
        """Return the model of small displacements in the same coordinates."""
        return self.small

    def with_joint_state(self, built: Model) -> Self:
        """Return the model with initial gaps and memory of its model of small displacements."""
        model = self if built.initial_gaps is None else self.with_initial_gaps(built.initial_gaps)
        # slip is positive toward the extrados there, to the left of the joint's normal here
        orientation = joint_orientation(self.structure)[self.small.operator.points.joint]
        return model.with_memory(orientation * built.memory)

    def begin_step(self, start: Array, damping_lag: float) -> ModelStep:
        """Return a time step from a state with the present joint memory."""
        return LargeDisplacementStep(self, start, damping_lag)

    def observer(self) -> Observer:
        """Return the observer of joint faces and corners of blocks."""
        corners = self._corners
        return LargeObserver(len(self.structure.joints), corners.block, self, corners)

    @cached_property
    def _corners(self) -> RotatingCells:
        """Corners of the free blocks."""
        return self.cells.select(self.cells.corners(self.structure))

    def step_forces(self, start: Array, end: Array, damping_lag: float) -> JointStepForces:
        """Return the mean forces of the joints over a step."""
        forces = allocate_step_forces(self.joints)
        states = _plain(start), _plain(end)
        compute_step_forces(self.joints, *states, damping_lag, self._slip, forces)
        return forces

    def _instant(self, q: Array) -> JointStepForces:
        """Return the forces of the joints at an instant, a step without displacement."""
        return self.step_forces(q, q, 0.0)

    def gather_forces(self, force: Array) -> Array:
        """Return generalised forces from those on the coordinates of each face (n,)."""
        return np.asarray(np.bincount(self._rows, force.ravel()[self._forces], self.size), float)

    def assemble_tangent(
        self, block_factor: float, joint_factor: float, forces: JointStepForces
    ) -> sparse.csr_matrix:
        """Return block stiffness and joint tangent, each times a factor (n, n)."""
        sides = self.joints.kinematics
        workspace = np.empty((2, 3, 5, sides.shapes.shape[3]))
        of_joints = np.zeros(len(self._pattern.indices))
        assemble_rates(sides, forces.rates, workspace, self._entries, of_joints)
        of_blocks = block_factor * self.block_stiffness.data
        return self._pattern.with_data(of_blocks + joint_factor * of_joints)

    def force(self, q: Array) -> Array:
        """Return the internal forces of blocks and joints (n,)."""
        return np.asarray(self.block_stiffness @ q) + self.gather_forces(self._instant(q).force)

    def tangent(self, q: Array) -> sparse.csr_matrix:
        """Return the derivative of `force`; unsymmetric where joints slide (n, n)."""
        # the mean force depends on the end of a step by half as much as the force at an instant
        return self.assemble_tangent(1.0, 2.0, self._instant(q))

    def support_forces(self, q: Array, motion: Array) -> Array:
        """Return the approximate change of `force` due to a small motion of the supports (n,)."""
        # rotations of the blocks are neglected: this serves as an initial guess
        return self.small.with_memory(self.memory).support_forces(q, motion)

    def closed_tangent(self) -> sparse.csr_matrix:
        """Return the tangent at q = 0 with every joint closed over its whole depth (n, n)."""
        return self._pattern.spread(self.small.closed_tangent())

    def energy(self, q: Array) -> float:
        """Return the potential energy of blocks and joints without further slip [J]."""
        of_blocks = 0.5 * float(q @ (self.block_stiffness @ q))
        return of_blocks + float(joint_energy(self.joints, _plain(q), self._slip))

    def resultants(self, q: Array) -> Array:
        """Return N, V, M of every joint about the middle of the overlap (n_joints, 3)."""
        return self._instant(q).resultants

    def measures(self, q: Array) -> Array:
        """Return opening, slip and rotation of every joint (…, n_joints, 3) [m, m, -]."""
        measures = measure_states(self.joints, _plain(np.atleast_2d(q)))
        return measures.reshape(*q.shape[:-1], *measures.shape[1:])

    def face_mismatch(self, q: Array) -> tuple[float, str]:
        """Return the largest slip between paired facets, over their length, and its joint."""
        law = self.joints.face_law
        if not law.paired.any():
            return 0.0, ""
        # facets much shorter than usual do not count by their own length
        depth, usual = law.depth, np.median(law.depth[law.paired])
        slips = facet_slips(self.joints, _plain(q))
        slips = slips * depth / np.maximum(depth, usual)
        worst = int(np.argmax(slips))
        return float(slips[worst]), self.structure.joints[self.joints.joint[worst]].name

    def load(self, action: Action, q: Array | None = None) -> Array:
        """Return the generalised forces of an action; point loads keep their direction (n,)."""
        if q is None or isinstance(action, BodyForce) or not (point := self._find_point(action)):
            return self.small.load(action)
        return point.gradient(q, self.size).T @ np.array(action.force)

    def load_rate(self, action: Action, q: Array) -> sparse.csr_matrix:
        """Return the derivative of `load` by the coordinates (n, n)."""
        if isinstance(action, BodyForce) or not (point := self._find_point(action)):
            return super().load_rate(action, q)
        return point.force_rate(q, np.array(action.force), self.size)

    def work(self, action: Action, q: Array) -> float:
        """Return the work of an action since before anything moved [J]."""
        if isinstance(action, BodyForce) or not (point := self._find_point(action)):
            return super().work(action, q)
        return float(point.displacement(q) @ np.array(action.force))

    def _find_point(self, action: PointLoad) -> RotatingPoint | None:
        """Return the point at which a load acts; None where its block has no rotating frame."""
        if action in self._points:
            return self._points[action]
        block, place = action.place(self.structure)
        number = self.structure.free.index(block)
        if not self.has_frame[number]:
            return None
        rows = self.small.cells.displacement_rows(block, place)
        first, end = self.block_starts[number], self.block_starts[number + 1]
        # of the rigid motion, rotation gives the vector from the centroid to the point
        local = rows[:, first:end].toarray()
        point = RotatingPoint(int(first), np.array([local[1, 2], -local[0, 2]]), local[:, 3:])
        self._points[action] = point
        return point

    def rigid_motions(self, q: Array, velocity: Array) -> tuple[Array, Array]:
        """Return displacement and velocity of each block as a rigid body, each (n_blocks, 3)."""
        structure = self.structure
        poses = np.array(self.support_motion, dtype=float)
        velocities = np.zeros((len(structure.blocks), 3))
        for number, block in enumerate(structure.free):
            own = slice(*self.block_starts[number : number + 2])
            motion, speed = q[own], velocity[own]
            if not self.has_frame[number]:
                mean = self._momentum_projection(block, own)
                motion, speed = mean @ motion, mean @ speed
            # from the centre of mass of the mesh to the centroid of the outline
            arm = structure.blocks[block].centroid - self.centres[block]
            rotated = rotate(arm, motion[2])
            poses[block] = *(motion[:2] + rotated - arm), motion[2]
            spin = speed[2] * np.array([-rotated[1], rotated[0]])
            velocities[block] = *(speed[:2] + spin), speed[2]
        return poses, velocities

    def _momentum_projection(self, block: int, own: slice) -> Array:
        """Return the matrix from fill coordinates to a rigid motion of equal momentum (3, s)."""
        cells = self.small.cells
        nodes = np.flatnonzero(cells.block == block)
        shapes = cells.shapes_at(nodes)[:, own]
        motion = rigid_motion_matrix(cells.places[nodes], self.centres[block]).reshape(-1, 3)
        # sparse normal equations: a fill has thousands of coordinates, of unit shapes
        rigid = splu((shapes.T @ shapes).tocsc()).solve(shapes.T @ motion)
        mass = rigid.T @ self.mass[own, own]
        return np.linalg.solve(mass @ rigid, mass)


@dataclass(frozen=True, eq=False)
class LargeDisplacementStep(ModelStep):
    """A time step of a model of large displacements."""

    model: LargeDisplacementModel  # with the joint memory at the start
    start: Array  # coordinates at its start (n,)
    damping_lag: float  # time lag of damping over the length of the step, β/Δt [-]

    def _joints(self, q: Array) -> JointStepForces:
        """Return the mean forces of the joints."""
        return self.model.step_forces(self.start, q, self.damping_lag)

    def force(self, q: Array) -> Array:
        """Return the mean of the internal forces of blocks and joints (n,)."""
        middle = (0.5 - self.damping_lag) * self.start + (0.5 + self.damping_lag) * q
        of_blocks = np.asarray(self.model.block_stiffness @ middle)
        return of_blocks + self.model.gather_forces(self._joints(q).force)

    def tangent(self, q: Array) -> sparse.csr_matrix:
        """Return the derivative of `force` (n, n)."""
        return self.model.assemble_tangent(0.5 + self.damping_lag, 1.0, self._joints(q))

    def resultants(self, q: Array) -> Array:
        """Return the means of N, V, M of every joint (n_joints, 3) [N, N, N m]."""
        return self._joints(q).resultants

    def updated_memory(self, q: Array) -> Array:
        """Return the irreversible slip of each joint point at the end (p,) [m]."""
        return self._joints(q).irreversible_slip

    def dissipation(self, q: Array) -> float:
        """Return the energy lost to friction and damping [J]."""
        change = q - self.start
        in_blocks = self.damping_lag * float(change @ (self.model.block_stiffness @ change))
        return float(self._joints(q).dissipation.sum()) + in_blocks


@dataclass(frozen=True, eq=False)
class LargeObserver(Observer):
    """Observer of a model of large displacements."""

    joint_count: int
    corner_blocks: Numbers
    model: LargeDisplacementModel
    corner_cells: RotatingCells

    def read(self, q: Array) -> Array:
        """Return gaps, rotations and slips of joints, then corner displacements, in a row (r,)."""
        return self.read_many(q[None])[0]

    def read_many(self, states: Array, faces: Array | None = None) -> Array:
        """Return the rows of `read` for many states (steps, r)."""
        if faces is None:
            faces = np.moveaxis(self.model.measures(states)[..., [0, 2, 1]], -1, 1)
        count = 3 * self.joint_count
        rows = np.empty((len(states), count + 2 * len(self.corner_blocks)))
        places = rows[:, :count].reshape(faces.shape)  # a view
        places[:] = faces
        places[:, 1] = 2.0 * np.arcsin(0.5 * faces[:, 1])
        rows[:, count:] = self.corner_cells.displacement(states).reshape(len(states), -1)
        return rows

    def joint_ends(self, q: Array) -> Array:
        """Return the displacements of both ends of each joint's overlap (n_joints, 2, 2) [m]."""
        structure, q = self.model.structure, np.ascontiguousarray(q, float)
        joints, poses = self.model.joints, np.zeros((self.joint_count, 2, 3))
        # pose of a face is the mean of its segments'
        depth = joints.face_law.depth
        weight = depth / np.bincount(joints.joint, depth)[joints.joint]
        for segment, joint in enumerate(joints.joint):
            for side in range(2):
                pose = np.array(face_pose(joints.kinematics, segment, side, q))
                poses[joint, side] += weight[segment] * pose
        mean, apart = poses.mean(axis=1), poses[:, 1] - poses[:, 0]
        # mean direction of both faces: their tangent, rotated
        along = rotate(structure.tangents, mean[:, 2])
        slip = np.sum(along * apart[:, :2], axis=1)
        length, middle = structure.overlaps(slip)
        half = 0.5 * length * np.cos(0.5 * apart[:, 2])
        offsets = np.stack([middle - half, middle + half], axis=1)
        middles = structure.middles + mean[:, :2]
        return middles[:, None] + offsets[..., None] * along[:, None] - structure.ends


def _plain(q: Array) -> Array:
    """Return coordinates as the one kind of array for which the joints are compiled."""
    return np.require(q, float, ("C", "W"))
