"""Finite motion of a collapse mechanism: load factor along the path of rigid blocks.

Limit analysis gives the velocities with which a structure begins to fall, and the factor α of the
horizontal forces that start it. Here the blocks follow that mechanism by finite rotations and
slips. Joints that neither open nor slip are welded, so that a few rigid bodies remain; hinges are
pins at corners, and a sliding corner stays on the face that it touches. At each place along the
path, α is the factor at which the horizontal forces balance the weights (virtual work).

Three events change the mechanism: a joint that closes again, a contact that would need tension,
and a corner that slides off its face. There, limit analysis is repeated on the displaced blocks,
with friction at the contacts that remain, and its mechanism is followed from then on.

Faces slide flat: sliding in limit analysis dilates by μ (associated flow), the finite motion does
not. Where a joint slides and others hinge, α at rest can therefore be below the collapse factor.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog
from scipy.sparse import csgraph, csr_matrix

from archfem._typing import Array
from archfem.errors import DidNotConverge
from archfem.limit.linear_programme import NoEquilibrium
from archfem.masonry.block import largest_overlap
from archfem.masonry.loads import AttachedLoad
from archfem.masonry.structure import Structure, join_joint_names

# Distance of points that touch, relative to the size of the structure [-]
TOUCHING = 1e-6

# Velocities, relative to the largest of any corner, that count as zero [-]
STILL = 1e-6


class PathEnd(StrEnum):
    """Reason for which the path of a mechanism ends."""

    FALLS = "falls"
    LOCKS = "locks"
    COLLIDES = "collides"
    ENDURES = "endures"

    @property
    def sentence(self) -> str:
        """Meaning of the reason, as a sentence."""
        return _END_SENTENCES[self]


_END_SENTENCES = {
    PathEnd.FALLS: "at the end it falls without any horizontal force",
    PathEnd.LOCKS: "at the end its contacts permit no further motion",
    PathEnd.COLLIDES: "at the end it runs into blocks that it has no joint with",
    PathEnd.ENDURES: "it still needs a horizontal force where the path is cut off",
}


class Contact(NamedTuple):
    """A corner of one block on the face of another, or two corners that coincide."""

    joint: int
    corner: int  # number of the block whose corner it is
    face: int  # number of the block whose face it is
    point: Array  # present place of the corner (2,) [m]
    normal: Array  # unit normal of the face, towards the block of the corner (2,)
    slip: int = 0  # sense along the face's tangent in which it slides, 1 or -1; 0 where it sticks


@dataclass(frozen=True, eq=False)
class Mechanism:
    """A mechanism at a place: rigid bodies and the contacts between them that persist.

    Attributes:
        factor: factor α of the horizontal forces that sets it in motion [-].
        motion: velocities of all blocks' centroids and rotations (n_blocks, 3), scaled so that the
            fastest corner has 1 m/s.
        body: number of the body of each block; -1 for blocks at rest (n_blocks,).
        contacts: contacts that persist.
    """

    factor: float
    motion: Array
    body: NDArray[np.intp]
    contacts: tuple[Contact, ...]


@dataclass(frozen=True, eq=False)
class PlacedBlocks:
    """Rigid blocks after displacements of any size, with the loads that they carry."""

    structure: Structure
    displacement: Array  # of centroids, and rotations (n_blocks, 3) [m, m, rad]
    loads: tuple[AttachedLoad, ...] = ()
    direction: float = 1.0  # sense of the horizontal forces along x, 1 or -1

    def moved(self, displacement: Array) -> "PlacedBlocks":
        """Return the blocks at other displacements from rest."""
        return replace(self, displacement=displacement)

    @cached_property
    def rest(self) -> Array:
        """Centroids at rest (n_blocks, 2) [m]."""
        return np.array([block.centroid for block in self.structure.blocks])

    @cached_property
    def centroids(self) -> Array:
        """Present centroids (n_blocks, 2) [m]."""
        return self.rest + self.displacement[:, :2]

    def places(self, points: Array, block: int) -> Array:
        """Return the present places of points of a block, given at rest (p, 2) [m]."""
        turned = (points - self.rest[block]) @ rotation(self.displacement[block, 2]).T
        return turned + self.centroids[block]

    @cached_property
    def outlines(self) -> list[Array]:
        """Present outlines of the blocks, arcs as chords."""
        drawn = (block.drawn() for block in self.structure.blocks)
        return [self.places(points, number) for number, points in enumerate(drawn)]

    @cached_property
    def masses(self) -> list[tuple[int, Array, float]]:
        """Block, present place and weight of all that is accelerated [m, N]."""
        structure = self.structure
        weights = [
            (k, self.centroids[k], b.area * b.material.unit_weight * structure.width)
            for k, b in enumerate(structure.blocks)
        ]
        carried = [(k, place, load.weight) for k, place, load in self.attached if load.weight]
        return weights + carried

    @cached_property
    def attached(self) -> list[tuple[int, Array, AttachedLoad]]:
        """Block and present place of each attached load [m]."""
        numbers = [self.structure.block_number(load.block) for load in self.loads]
        return [
            (k, self.places(np.array([load.point]), k)[0], load)
            for k, load in zip(numbers, self.loads, strict=True)
        ]

    @cached_property
    def dead(self) -> Array:
        """Weights and constant forces, about the centroids (n_blocks, 3) [N, N, N m]."""
        forces = [(k, place, (0.0, -weight)) for k, place, weight in self.masses]
        forces += [(k, place, load.force) for k, place, load in self.attached]
        return self._resultants(forces)

    @cached_property
    def live(self) -> Array:
        """Horizontal forces at a factor of one, about the centroids (n_blocks, 3) [N, N, N m]."""
        return self._resultants(
            [(k, place, (self.direction * weight, 0.0)) for k, place, weight in self.masses]
        )

    def _resultants(self, forces: Sequence[tuple[int, Array, Sequence[float]]]) -> Array:
        """Return the resultants of forces on each block about its centroid (n_blocks, 3)."""
        total = np.zeros((len(self.structure.blocks), 3))
        for block, place, (x, y) in forces:
            arm = place - self.centroids[block]
            total[block] += (x, y, arm[0] * y - arm[1] * x)
        return total

    @cached_property
    def faces(self) -> Array:
        """Ends of the joints on lower and higher blocks (2, n_joints, 2, 2) [m]."""
        joints = self.structure.joints
        return np.array(
            [
                [self.places(joint.ends, joint.lower) for joint in joints],
                [self.places(joint.ends, joint.higher) for joint in joints],
            ]
        )

    @cached_property
    def normals(self) -> Array:
        """Normals of the faces, towards the other block (2, n_joints, 2)."""
        turns = self.displacement[self.structure.pairs.T, 2]
        sign = np.array([1.0, -1.0])[:, None]
        cos, sin = sign * np.cos(turns), sign * np.sin(turns)
        x, y = self.structure.normals.T
        return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)

    @cached_property
    def gaps(self) -> Array:
        """Gap of each corner from the other block's face (2, n_joints, 2) [m].

        First axis: corners of the lower, of the higher block. Infinite beside the face.
        """
        near = TOUCHING * self.structure.size
        gaps = np.full((2, len(self.structure.joints), 2), np.inf)
        for side in (0, 1):
            face, corners = self.faces[1 - side], self.faces[side]
            along = face[:, 1] - face[:, 0]
            depth = np.linalg.norm(along, axis=1)[:, None]
            arm = corners - face[:, :1]
            share = np.einsum("jei,ji->je", arm, along) / depth
            height = np.einsum("jei,ji->je", arm, self.normals[1 - side])
            beside = (share < -near) | (share > depth + near)
            gaps[side] = np.where(beside, np.inf, height)
        return gaps

    def touching(self, joints: Sequence[int]) -> list[Contact]:
        """Return the contacts at some joints; corners that coincide are one contact."""
        near, contacts = TOUCHING * self.structure.size, []
        for joint in joints:
            pair = self.structure.pairs[joint]
            apart = np.linalg.norm(self.faces[1, joint] - self.faces[0, joint], axis=1)
            for side in (1, 0):
                for end in np.flatnonzero(np.abs(self.gaps[side, joint]) <= near):
                    if side == 0 and apart[end] <= near:
                        continue  # the corner of the higher block is at the same place
                    point, normal = self.faces[side, joint, end], self.normals[1 - side, joint]
                    contacts.append(Contact(joint, pair[side], pair[1 - side], point, normal))
        return contacts


def rotation(turn: float) -> Array:
    """Return the matrix that turns vectors anticlockwise (2, 2)."""
    return np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])


def tangent(normal: Array) -> Array:
    """Return the unit tangent of a face, a quarter turn clockwise from its normal (2,)."""
    return np.array([normal[1], -normal[0]])


def merge_blocks(structure: Structure, welded: Sequence[int]) -> NDArray[np.intp]:
    """Return the number of the body of each block, -1 for those welded to fixed ones."""
    count = len(structure.blocks)
    fixed = [number for number, block in enumerate(structure.blocks) if block.fixed]
    # supports are one body, the ground
    pairs = [tuple(structure.pairs[joint]) for joint in welded]
    pairs += [(fixed[0], number) for number in fixed]
    rows, columns = np.array(pairs).T
    graph = csr_matrix((np.ones(len(pairs)), (rows, columns)), (count, count))
    labels = csgraph.connected_components(graph, directed=False)[1]
    ground = labels[fixed[0]]
    numbers = {label: k for k, label in enumerate(dict.fromkeys(labels[labels != ground]))}
    return np.array([numbers.get(label, -1) for label in labels], dtype=np.intp)


@dataclass(frozen=True, eq=False)
class Bodies:
    """Rigid bodies at a place, and the rates of their contacts."""

    blocks: PlacedBlocks
    body: NDArray[np.intp]  # number of the body of each block, -1 at rest (n_blocks,)

    @cached_property
    def count(self) -> int:
        """Number of bodies that move."""
        return int(self.body.max()) + 1

    @cached_property
    def references(self) -> Array:
        """Reference point of each body, the mean of its centroids (n_bodies, 2) [m]."""
        centroids = self.blocks.centroids
        return np.array([centroids[self.body == k].mean(axis=0) for k in range(self.count)])

    @cached_property
    def expansion(self) -> Array:
        """Matrix from velocities of the bodies to those of all blocks (3 n_blocks, 3 n_bodies)."""
        matrix = np.zeros((len(self.body), 3, max(self.count, 1), 3))
        for block, body in enumerate(self.body):
            if body >= 0:
                matrix[block, :2, body] = self._point_rows(self.blocks.centroids[block], body)
                matrix[block, 2, body, 2] = 1.0
        return matrix.reshape(3 * len(self.body), -1)

    def _point_rows(self, point: Array, body: int) -> Array:
        """Return the velocity of a point for unit velocities of its body (2, 3)."""
        x, y = point - self.references[body]
        return np.array([[1.0, 0.0, -y], [0.0, 1.0, x]])

    def rates(self, contacts: Sequence[Contact]) -> Array:
        """Return rates of the contacts' gaps and slips (2, n_contacts, 3 n_bodies)."""
        rows = np.zeros((2, len(contacts), self.count, 3))
        for k, contact in enumerate(contacts):
            axes = np.array([contact.normal, tangent(contact.normal)])
            for block, sign in ((contact.corner, 1.0), (contact.face, -1.0)):
                if (body := self.body[block]) >= 0:
                    rows[:, k, body] += sign * axes @ self._point_rows(contact.point, body)
        return rows.reshape(2, len(contacts), -1)

    def generalised(self, loads: Array) -> Array:
        """Return generalised forces of the bodies from those of the blocks (3 n_bodies,)."""
        return self.expansion.T @ loads.ravel()


def largest_speed(blocks: PlacedBlocks, motion: Array) -> float:
    """Return the largest speed of a corner of any block [m/s]."""
    speeds = []
    for outline, centroid, (u, v, turn) in zip(
        blocks.outlines, blocks.centroids, motion, strict=True
    ):
        x, y = (outline - centroid).T
        speeds.append(np.hypot(u - turn * y, v + turn * x).max())
    return float(max(speeds))


def find_mechanism(
    blocks: PlacedBlocks, joints: Sequence[int], friction: Array
) -> Mechanism | None:
    """Find the mechanism of least factor by limit analysis of the blocks at their present places.

    Forces N >= 0 and |T| <= μ N act at the contacts of the joints that may move; the largest factor
    at which they balance the loads is sought, and its dual is the motion.

    Args:
        blocks: at their present places.
        joints: numbers of the joints that may open or slip; the others are welded.
        friction: coefficients μ of all joints, infinite where nothing slides (n_joints,).

    Returns:
        The mechanism; None where no factor sets the blocks in motion.

    Raises:
        NoEquilibrium: the blocks cannot be at rest here under any factor.
    """
    among = set(joints)
    welded = [k for k in range(len(blocks.structure.joints)) if k not in among]
    bodies = Bodies(blocks, merge_blocks(blocks.structure, welded))
    if not bodies.count:
        return None
    contacts = blocks.touching(joints)
    coefficient = friction[[contact.joint for contact in contacts]]
    solution = _solve_static(bodies, contacts, coefficient)
    if solution is None:
        return None
    factor, velocity = solution
    motion = (bodies.expansion @ velocity).reshape(-1, 3)
    return classify_motion(
        blocks, joints, motion / largest_speed(blocks, motion), coefficient, contacts, factor
    )


def _solve_static(
    bodies: Bodies, contacts: Sequence[Contact], coefficient: Array
) -> tuple[float, Array] | None:
    """Return the largest factor in equilibrium, and the bodies' velocities by duality."""
    normal, along = bodies.rates(contacts)
    dead, live = (bodies.generalised(load) for load in (bodies.blocks.dead, bodies.blocks.live))
    # forces in mean body weights and lengths in metres over the size keep coefficients near one
    unit = np.abs(bodies.blocks.dead[:, 1]).sum() / bodies.count
    lengths = np.tile([1.0, 1.0, 1.0 / bodies.blocks.structure.size], bodies.count)
    count, slides = len(contacts), np.isfinite(coefficient)
    balance = lengths[:, None] * np.hstack([normal.T, along.T, (live / unit)[:, None]])
    cone = np.hstack([np.diag(-np.where(slides, coefficient, 0.0)), np.eye(count)])[slides]
    mirrored = np.hstack([cone[:, :count], -cone[:, count:]])
    limits = np.hstack([np.vstack([cone, mirrored]), np.zeros((2 * len(cone), 1))])
    for presolve in (False, True):  # where round-off stops the solver presolve changes its path
        result = linprog(
            np.append(np.zeros(2 * count), -1.0),
            A_ub=csr_matrix(limits),
            b_ub=np.zeros(len(limits)),
            A_eq=csr_matrix(balance),
            b_eq=-lengths * dead / unit,
            bounds=[(0.0, None)] * count + [(None, None)] * (count + 1),
            method="highs-ds",
            options={"presolve": presolve},
        )
        if result.status in (0, 2, 3):  # optimal, infeasible, unbounded
            break
    if result.status == 3:
        return None
    if result.status == 2:
        raise NoEquilibrium("the blocks cannot rest here under any horizontal force")
    if result.status != 0:
        raise DidNotConverge(f"the linear programme found no mechanism: {result.message}")
    return float(result.x[-1]), -lengths * np.array(result.eqlin.marginals)


def classify_motion(
    blocks: PlacedBlocks,
    joints: Sequence[int],
    motion: Array,
    coefficient: Array,
    contacts: Sequence[Contact],
    factor: float,
) -> Mechanism:
    """Weld joints that do not move, and select the contacts that a motion keeps."""
    every = Bodies(blocks, np.arange(len(motion)))
    normal, along = every.rates(contacts) @ motion.ravel()
    slip = np.where(np.abs(along) > STILL, np.sign(along), 0.0)
    # associated flow opens a sliding contact by μ |slip|; flat sliding by nothing
    dilation = np.where(np.isfinite(coefficient), coefficient, 0.0) * np.abs(along)
    keeps = (np.abs(normal) <= STILL) | (np.abs(normal - dilation) <= STILL)
    still = [
        joint
        for joint in range(len(blocks.structure.joints))
        if joint not in set(joints) or _moves_as_one(blocks, joint, motion)
    ]
    body = merge_blocks(blocks.structure, still)
    kept = tuple(
        _sliding_contact(blocks, contact, int(sense))
        for contact, keep, sense in zip(contacts, keeps, slip, strict=True)
        if keep and body[contact.corner] != body[contact.face]
    )
    return Mechanism(factor, motion, body, kept)


def _moves_as_one(blocks: PlacedBlocks, joint: int, motion: Array) -> bool:
    """Return whether both blocks of a joint have the same rigid motion."""
    lower, higher = blocks.structure.pairs[joint]
    middle = blocks.faces[:, joint].mean(axis=(0, 1))
    jump = np.zeros(2)
    for block, sign in ((higher, 1.0), (lower, -1.0)):
        x, y = middle - blocks.centroids[block]
        u, v, turn = motion[block]
        jump += sign * np.array([u - turn * y, v + turn * x])
    turn = (motion[higher, 2] - motion[lower, 2]) * blocks.structure.depths[joint]
    return bool(max(np.abs(jump).max(), abs(turn)) <= STILL)


def _sliding_contact(blocks: PlacedBlocks, contact: Contact, slip: int) -> Contact:
    """Return a contact with its slip, at the corner that stays on the other block's face."""
    joint = contact.joint
    lower, higher = blocks.structure.pairs[joint]
    end = int(np.linalg.norm(blocks.faces[:, joint] - contact.point, axis=-1).min(axis=0).argmin())
    apart = np.linalg.norm(blocks.faces[1, joint, end] - blocks.faces[0, joint, end])
    coincide = apart <= TOUCHING * blocks.structure.size
    if not slip or not coincide:
        return contact._replace(slip=slip)
    # Of corners that coincide, that of the higher block stays on the face where it slides inwards.
    outward = blocks.faces[0, joint, end] - blocks.faces[0, joint, 1 - end]
    if slip * (tangent(contact.normal) @ outward) < 0.0:
        return contact._replace(slip=slip)
    point, normal = blocks.faces[0, joint, end], blocks.normals[1, joint]
    # the corner's velocity relative to the face, and the face's tangent, both change sign
    return Contact(joint, lower, higher, point, normal, slip)


@dataclass(frozen=True, eq=False)
class Linkage:
    """Bodies and contacts of a mechanism, which stay the same until an event."""

    start: PlacedBlocks
    mechanism: Mechanism

    @cached_property
    def anchors(self) -> list[tuple[Array, Array, Array]]:
        """At rest: point on the corner's block, on the face's, normal of the face."""
        found = []
        for contact in self.mechanism.contacts:
            on_corner, on_face = (
                self._at_rest(contact.point, block) for block in (contact.corner, contact.face)
            )
            turn = rotation(self.start.displacement[contact.face, 2])
            found.append((on_corner, on_face, contact.normal @ turn))
        return found

    def _at_rest(self, point: Array, block: int) -> Array:
        """Return the place at rest of a point that moves with a block (2,) [m]."""
        turn = rotation(self.start.displacement[block, 2])
        return (point - self.start.centroids[block]) @ turn + self.start.rest[block]

    @cached_property
    def first_velocity(self) -> Array:
        """Velocities of the bodies at the start (3 n_bodies,)."""
        expansion = Bodies(self.start, self.mechanism.body).expansion
        return np.linalg.lstsq(expansion, self.mechanism.motion.ravel(), rcond=None)[0]

    def place(self, blocks: PlacedBlocks, motion: Array) -> "LinkageState":
        """Return the state after a finite motion of the bodies from other places of the blocks."""
        body = self.mechanism.body
        bodies = Bodies(blocks, body)
        displacement = blocks.displacement.copy()
        for number, (x, y, turn) in enumerate(motion.reshape(-1, 3)):
            own, reference = body == number, bodies.references[number]
            arm = blocks.centroids[own] - reference
            displacement[own, :2] += (x, y) + arm @ (rotation(turn).T - np.eye(2))
            displacement[own, 2] += turn
        return LinkageState(self, blocks.moved(displacement))


@dataclass(frozen=True, eq=False)
class LinkageState:
    """A linkage at one place along its path."""

    linkage: Linkage
    blocks: PlacedBlocks

    @cached_property
    def bodies(self) -> Bodies:
        """Bodies at this place."""
        return Bodies(self.blocks, self.linkage.mechanism.body)

    @cached_property
    def contacts(self) -> list[Contact]:
        """Contacts at this place."""
        moved = []
        for contact, (on_corner, _, normal) in zip(
            self.linkage.mechanism.contacts, self.linkage.anchors, strict=True
        ):
            turn = rotation(self.blocks.displacement[contact.face, 2])
            point = self.blocks.places(on_corner[None, :], contact.corner)[0]
            moved.append(contact._replace(point=point, normal=turn @ normal))
        return moved

    @cached_property
    def misfits(self) -> Array:
        """Violation of each constraint, gaps of all contacts and slips of sticking ones [m]."""
        jumps = []
        for contact, (_, on_face, _) in zip(self.contacts, self.linkage.anchors, strict=True):
            jumps.append(contact.point - self.blocks.places(on_face[None, :], contact.face)[0])
        gaps = [contact.normal @ jump for contact, jump in zip(self.contacts, jumps, strict=True)]
        slips = [
            tangent(contact.normal) @ jump
            for contact, jump in zip(self.contacts, jumps, strict=True)
            if not contact.slip
        ]
        return np.array(gaps + slips)

    @cached_property
    def rates(self) -> tuple[Array, Array]:
        """Rates of gaps and slips of all contacts (n_contacts, 3 n_bodies)."""
        normal, along = self.bodies.rates(self.contacts)
        return normal, along

    @cached_property
    def sticks(self) -> NDArray[np.bool_]:
        """Whether each contact sticks (n_contacts,)."""
        return np.array([not contact.slip for contact in self.contacts], dtype=bool)

    @cached_property
    def units(self) -> Array:
        """Units of the bodies' coordinates, rotations over the size (3 n_bodies,) [m, m, rad]."""
        return np.tile([1.0, 1.0, 1.0 / self.blocks.structure.size], self.bodies.count)

    @cached_property
    def jacobian(self) -> Array:
        """Rates of the constraints with scaled velocities (n_constraints, 3 n_bodies)."""
        normal, along = self.rates
        return np.vstack([normal, along[self.sticks]]) * self.units

    def velocity(self, previous: Array) -> Array | None:
        """Return the velocities of the bodies that are nearest to previous ones, or None."""
        # A basis of all motions that the constraints permit; usually it is one motion.
        _, singular, basis = np.linalg.svd(self.jacobian)
        rank = int(np.sum(singular > 1e-9 * max(singular.max(initial=0.0), 1.0)))
        free = basis[rank:]
        velocity = self.units * (free.T @ (free @ (previous / self.units)))
        motion = (self.bodies.expansion @ velocity).reshape(-1, 3)
        speed = largest_speed(self.blocks, motion)
        if speed <= STILL * largest_speed(
            self.blocks, (self.bodies.expansion @ previous).reshape(-1, 3)
        ):
            return None
        return velocity / speed

    def corrected(self, iterations: int = 12) -> "LinkageState | None":
        """Return the nearest state that fulfils the constraints, by Newton's method."""
        state = self
        for _ in range(iterations):
            if not len(state.misfits) or np.abs(state.misfits).max() <= 1e-13 * state._size:
                return state
            step = np.linalg.lstsq(state.jacobian, -state.misfits, rcond=1e-10)[0]
            state = state.linkage.place(state.blocks, state.units * step)
        # redundant constraints that contradict each other: the linkage locks
        return state if np.abs(state.misfits).max() <= 1e-9 * state._size else None

    @property
    def _size(self) -> float:
        return self.blocks.structure.size

    def advanced(self, velocity: Array, step: float) -> "tuple[LinkageState, Array] | None":
        """Return state and velocities after a step along the path, by the mid-point rule."""
        middle = self.linkage.place(self.blocks, 0.5 * step * velocity).corrected()
        if middle is None or (halfway := middle.velocity(velocity)) is None:
            return None
        end = self.linkage.place(self.blocks, step * halfway).corrected()
        if end is None or (after := end.velocity(halfway)) is None:
            return None
        return end, after

    def balance(self, velocity: Array, friction: Array) -> tuple[float, Array]:
        """Return the factor α in equilibrium, and the normal forces (n_contacts,) [N].

        Normal forces that equilibrium does not determine are undefined (NaN).
        """
        normal, along = self.rates
        dead, live = (self.bodies.generalised(load) for load in (self.blocks.dead, self.blocks.live))
        slipping = np.flatnonzero(~self.sticks)
        coefficient = friction[[contact.joint for contact in self.contacts]]
        forces = normal.copy()
        senses = np.sign(along[slipping] @ velocity)
        # friction opposes the slip
        forces[slipping] -= (coefficient[slipping] * senses)[:, None] * along[slipping]
        # unknown: normal forces, shear of sticking contacts, factor
        columns = np.vstack([forces, along[self.sticks], live]).T * self.units[:, None]
        solution, _, rank, _ = np.linalg.lstsq(columns, -self.units * dead, rcond=1e-10)
        determined = rank == columns.shape[1]
        if not determined and len(slipping):
            solution = self._least_factor(columns, -self.units * dead, solution)
        # Virtual work on the velocity, with the work of friction.
        normal_forces = solution[: len(forces)]
        work = dead @ velocity + normal_forces @ (forces @ velocity)
        factor = -work / (live @ velocity)
        return float(factor), normal_forces if determined else np.full(len(forces), np.nan)

    def _least_factor(self, columns: Array, loads: Array, fallback: Array) -> Array:
        """Return the forces of least factor where friction makes it indeterminate."""
        unit = np.abs(loads).max()
        free = [(None, None)] * (columns.shape[1] - len(self.contacts))
        objective = np.zeros(columns.shape[1])
        objective[-1] = 1.0
        scaled = columns.copy()
        scaled[:, -1] /= unit
        result = linprog(
            objective,
            A_eq=scaled,
            b_eq=loads / unit,
            bounds=[(0.0, None)] * len(self.contacts) + free,
            method="highs",
        )
        if result.status != 0:
            return fallback
        forces = result.x * unit
        forces[-1] = result.x[-1]
        return forces


@dataclass(frozen=True)
class PathEvent:
    """A change of the mechanism along its path, or its end.

    Attributes:
        place: number of the place where it happens.
        text: what happens.
    """

    place: int
    text: str


@dataclass(frozen=True, eq=False)
class MechanismPath:
    """Path of a mechanism: factor and displacements from rest to the fall.

    Attributes:
        blocks: blocks at rest, with their loads.
        factors: factor α of the horizontal forces at each place (n,) [-].
        displacements: of all blocks' centroids, and rotations (n, n_blocks, 3) [m, m, rad].
        velocity: velocities at rest (n_blocks, 3), the fastest corner at 1 m/s.
        mechanisms: mechanisms that are followed one after the other.
        events: events that change or end the mechanism.
        end: reason for which the path ends; `end.sentence` gives its meaning.
    """

    blocks: PlacedBlocks
    factors: Array
    displacements: Array
    velocity: Array
    mechanisms: tuple[Mechanism, ...]
    events: tuple[PathEvent, ...]
    end: PathEnd


class _Stop(Exception):
    """Raised with the reason where the path ends."""

    def __init__(self, end: PathEnd) -> None:
        super().__init__(end.sentence)
        self.end = end


@dataclass(eq=False)
class PathFollower:
    """Follows a mechanism from event to event."""

    blocks: PlacedBlocks  # at rest
    joints: Sequence[int]  # joints that may open or slip
    friction: Array  # coefficients, infinite where nothing slides (n_joints,)
    factors: list[float] = field(default_factory=list)
    displacements: list[Array] = field(default_factory=list)
    events: list[PathEvent] = field(default_factory=list)
    travel: float = 0.0  # of the fastest corner, so far [m]

    def follow(self, mechanism: Mechanism, max_events: int = 20) -> MechanismPath:
        """Follow a mechanism until it falls, locks, collides, or the path is cut off."""
        mechanisms, state = [mechanism], self._start(self.blocks, mechanism)
        velocity = state.velocity(state.linkage.first_velocity)
        bodies = Bodies(self.blocks, mechanism.body)
        first = np.zeros(3 * bodies.count) if velocity is None else velocity
        try:
            while len(mechanisms) <= max_events:
                blocks = self._follow_linkage(state, velocity)
                mechanisms.append(self._renew(blocks))
                state = self._start(blocks, mechanisms[-1])
                velocity = state.velocity(state.linkage.first_velocity)
            raise DidNotConverge(
                f"the mechanism changed {max_events} times before it fell, the last time as "
                f"{self.events[-1].text}: check the joints there, or assess fewer blocks"
            )
        except _Stop as stop:
            end = stop.end
        return MechanismPath(
            self.blocks,
            np.array(self.factors),
            np.array(self.displacements),
            (bodies.expansion @ first).reshape(-1, 3),
            tuple(mechanisms),
            tuple(self.events),
            end,
        )

    @staticmethod
    def _start(blocks: PlacedBlocks, mechanism: Mechanism) -> LinkageState:
        """Return the first state of the linkage of a mechanism."""
        return LinkageState(Linkage(blocks, mechanism), blocks)

    def _record(self, blocks: PlacedBlocks, factor: float) -> None:
        """Append a place to the path."""
        self.factors.append(factor)
        self.displacements.append(blocks.displacement)

    def _renew(self, blocks: PlacedBlocks) -> Mechanism:
        """Return the mechanism of limit analysis at the present places."""
        try:
            mechanism = find_mechanism(blocks, self.joints, self.friction)
        except NoEquilibrium as error:
            self._record(blocks, 0.0)
            raise _Stop(PathEnd.FALLS) from error
        if mechanism is None:
            raise _Stop(PathEnd.LOCKS)
        if mechanism.factor <= 0.0:
            self._record(blocks, 0.0)
            raise _Stop(PathEnd.FALLS)
        return mechanism

    def _follow_linkage(self, state: LinkageState, velocity: Array | None) -> PlacedBlocks:
        """Follow a linkage to its next event and return the blocks there."""
        size = self.blocks.structure.size
        if velocity is None:
            self._record(state.blocks, state.linkage.mechanism.factor)
            raise _Stop(PathEnd.LOCKS)
        factor = state.balance(velocity, self.friction)[0]
        self._record(state.blocks, factor)
        step = 1e-3 * size
        while self.travel <= size:
            trial = state.advanced(velocity, step)
            ahead = None if trial is None else trial[0].balance(trial[1], self.friction)[0]
            # a factor that changes by less than 2 % a step keeps the curve smooth
            if ahead is None or abs(ahead - factor) > 0.02 * max(abs(self.factors[0]), 1e-3):
                step *= 0.5
                if step > 1e-9 * size:
                    continue
            if trial is None or ahead is None:
                raise _Stop(PathEnd.LOCKS)
            if self._event(*trial, step):
                return self._finish(state, velocity, step)
            (state, velocity), factor = trial, ahead
            self.travel += step
            self._record(state.blocks, factor)
            step = min(1.5 * step, 0.01 * size)
        raise _Stop(PathEnd.ENDURES)

    def _finish(self, state: LinkageState, velocity: Array, step: float) -> PlacedBlocks:
        """Record the place of the first event within a step, and return the blocks there."""
        shortest, event = 0.0, None
        while step - shortest > 1e-9 * self.blocks.structure.size:
            middle = 0.5 * (shortest + step)
            trial = state.advanced(velocity, middle)
            if trial is not None and not self._event(*trial, middle):
                shortest = middle
            else:
                step = middle
        trial = state.advanced(velocity, step)
        if trial is None or not (event := self._event(*trial, step)):
            raise _Stop(PathEnd.LOCKS)
        self.travel += step
        blocks = trial[0].blocks
        self._record(blocks, max(trial[0].balance(trial[1], self.friction)[0], 0.0))
        self.events.append(PathEvent(len(self.factors) - 1, event))
        if event in (PathEnd.FALLS, PathEnd.COLLIDES):
            raise _Stop(PathEnd(event))
        return blocks

    def _event(self, state: LinkageState, velocity: Array, step: float) -> str:
        """Return the event that has happened at a state, or an empty text."""
        factor, normal_forces = state.balance(velocity, self.friction)
        if factor <= 0.0:
            return PathEnd.FALLS
        blocks, near = state.blocks, TOUCHING * self.blocks.structure.size
        names = [joint.name for joint in blocks.structure.joints]
        body, pairs = state.bodies.body, blocks.structure.pairs
        # deeper than a step reaches, a corner is behind the face and not in it
        closed = (blocks.gaps < -0.5 * near) & (blocks.gaps > -4.0 * step - near)
        closes = closed.any(axis=(0, 2)) & (body[pairs[:, 0]] != body[pairs[:, 1]])
        if closes.any():
            return f"{join_joint_names([names[k] for k in np.flatnonzero(closes)])} closes"
        unit = np.abs(blocks.dead[:, 1]).sum() / len(blocks.structure.free)
        for contact, force in zip(state.contacts, normal_forces, strict=True):
            if force < -1e-5 * unit:  # well above the tolerance of the programme that follows
                return f"a contact of {names[contact.joint]} opens"
            if contact.slip and self._is_off(blocks, contact, near):
                return f"a corner slides off its face at {names[contact.joint]}"
        depth = largest_overlap(blocks.outlines, body)
        return PathEnd.COLLIDES if depth > 1e-5 * blocks.structure.size else ""

    @staticmethod
    def _is_off(blocks: PlacedBlocks, contact: Contact, near: float) -> bool:
        """Return whether a corner has left the face on which it slides."""
        side = int(contact.face == blocks.structure.pairs[contact.joint, 1])
        face = blocks.faces[side, contact.joint]
        along = (face[1] - face[0]) / blocks.structure.depths[contact.joint]
        share = (contact.point - face[0]) @ along
        return not -2.0 * near <= share <= blocks.structure.depths[contact.joint] + 2.0 * near

    def last_equilibrium(self, path: MechanismPath, samples: int = 9) -> int:
        """Return the last place up to which the joints that the mechanism keeps closed hold."""
        # Places are checked from rest on, then bisected between the last two.
        places = np.unique(np.linspace(0, len(path.factors) - 1, samples).astype(int))
        bad = next((k for k in places if not self._holds(path, k)), None)
        if bad is None:
            return len(path.factors) - 1
        good = max(int(k) for k in (*places[places < bad], 0))
        while bad - good > 1:
            middle = (good + bad) // 2
            good, bad = (middle, bad) if self._holds(path, middle) else (good, middle)
        return good

    def _holds(self, path: MechanismPath, place: int, tolerance: float = 1e-4) -> bool:
        """Return whether limit analysis at a place gives the factor of the path."""
        if path.factors[place] <= 0.0:
            return True  # the fall itself
        blocks = self.blocks.moved(path.displacements[place])
        try:
            mechanism = find_mechanism(blocks, self.joints, self.friction)
        except NoEquilibrium:
            return False
        return mechanism is None or mechanism.factor >= (1.0 - tolerance) * path.factors[place]
