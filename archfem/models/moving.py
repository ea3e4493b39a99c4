"""Blocks that turn and slide as far as they like: the models whose displacements may be large.

Made of a model of small displacements, whose blocks are written in coordinates of their own: the
displacement of the centroid and the turn, and the elastic modes of the block in the frame that
turns with it. Those neither move the centroid nor turn the block on the mean (mean axes), so the
mass stays constant and diagonal; that inertia forces act on the modes as a block spins is left out.
"""

from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from scipy import sparse
from scipy.linalg import eigh

from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.joints.faces import face_matrix
from archfem.joints.facets import Facets
from archfem.joints.moved import (
    Answer,
    Moved,
    all_measures,
    answer,
    joint_energy,
    pass_joints,
)
from archfem.joints.overlap import Faces
from archfem.joints.poses import Sides
from archfem.joints.sparsity import Pattern
from archfem.masonry.actions import Action, BodyForce, PointLoad, Settlement
from archfem.masonry.rigid_motion import motion_of
from archfem.models.cells import Cells
from archfem.models.jointed import Jointed
from archfem.models.model import Prediction
from archfem.models.reduced import projected

PLANE = ("rigid", "faces")
"""Rungs whose faces stay plane."""


class Moving:
    """A model whose blocks move as far as they like; `Model` says what its members mean.

    Args:
        small: the same structure with small displacements, "rigid" or "faces", with exact facets.

    Raises:
        InvalidInput: faces bend, or the joints obey a law that is not known for large motion.
    """

    operator = None

    def __init__(self, small: Jointed) -> None:
        _check(small)
        blocks = _Blocks.of(small)
        self.at_rest = projected(small, blocks.basis, small.fidelity)
        self.structure = small.structure
        self.fidelity = small.fidelity
        self.size = self.at_rest.size
        self.starts = np.append(sorted(blocks.starts.values()), self.size)
        self.joints = blocks.joints(self.at_rest)
        self._slots, coupled = _couplings(self.joints.sides, self.size)
        pattern = Pattern.of(self.at_rest.mass, self.at_rest.blocks, coupled)
        self.mass = pattern.spread(self.at_rest.mass)
        self.blocks = pattern.spread(self.at_rest.blocks)
        self._pattern = pattern
        self._entries = pattern.places(*self._slots.pairs)
        self.body = self.at_rest.body
        self.cells = TurningCells.of(self.at_rest.cells, blocks.starts)
        self.supports = self.at_rest.supports
        self.prediction: Prediction | None = None
        self._points: dict[PointLoad, _Point] = {}
        self._slid = np.zeros_like(answer(self.joints).slid)

    def settled(self, settlement: Settlement) -> Self:
        """Return the same model with a support that has moved, further than before.

        Args:
            settlement: the support and its motion.
        """
        return self.moved(settlement.added(self.structure, self.supports))

    def moved(self, supports: Array) -> Self:
        """Return the same model with its supports moved so far from where they were built.

        Args:
            supports: motions of the fixed blocks, zero for the others (n_blocks, 3) [m, m, rad].
        """
        other = copy(self)
        other.supports = supports
        sides = self.joints.sides
        held = _held(self.structure, supports)
        other.joints = self.joints._replace(sides=sides._replace(held=held))
        return other

    def predicted(self, prediction: Prediction) -> Self:
        """Return the same model, with what was predicted of it.

        Args:
            prediction: to be kept as `prediction`.
        """
        other = copy(self)
        other.prediction = prediction
        return other

    @property
    def memory(self) -> Array:
        """How far each joint point has slid for good (p,) [m]."""
        return self._slid

    def remembering(self, memory: Array) -> Self:
        """Return the same model, whose joints have slid so far.

        Args:
            memory: how far each joint point has slid for good (p,) [m].
        """
        other = copy(self)
        other._slid = np.ascontiguousarray(memory, float)
        return other

    def remembered(self, q: Array) -> Array:
        """Return how far each joint point has slid for good once the model is at q (p,) [m].

        Args:
            q: coordinates (n,).
        """
        return self._at(q).slid

    def passage(self, start: Array, late: float) -> "MovingPassage":
        """Return a step from a state that the joints remember.

        Args:
            start: coordinates at its start (n,).
            late: lag of damping over the length of the step [-].
        """
        return MovingPassage(self, start, late)

    def over(self, start: Array, end: Array, late: float) -> Answer:
        """Return what joints do over a step.

        Args:
            start: coordinates at its start (n,).
            end: coordinates at its end (n,).
            late: lag of damping over the length of the step [-].
        """
        found = answer(self.joints)
        pass_joints(self.joints, start, end, late, self._slid, found)
        return found

    def _at(self, q: Array) -> Answer:
        """What joints do at an instant."""
        return self.over(q, q, 0.0)

    def gathered(self, force: Array) -> Array:
        """Return forces on joints' coordinates as those of the model (n,).

        Args:
            force: as `Answer.force` (j, 2, s).
        """
        rows, places = self._slots.rows
        return np.bincount(rows, force.ravel()[places], self.size)

    def assembled(self, share: float, factor: float, rate: Array) -> sparse.csr_matrix:
        """Return the stiffness of blocks and joints together (n, n).

        Args:
            share: factor of that of the blocks [-].
            factor: of that of the joints [-].
            rate: as `Answer.rate` (j, 2, s, 2, s).
        """
        of_joints = np.bincount(
            self._entries, rate.ravel()[self._slots.places], len(self._pattern.indices)
        )
        return self._pattern.matrix(share * self.blocks.data + factor * of_joints)

    def force(self, q: Array) -> Array:
        """Return the internal forces of blocks and joints (n,).

        Args:
            q: coordinates (n,).
        """
        return np.asarray(self.blocks @ q) + self.gathered(self._at(q).force)

    def tangent(self, q: Array) -> sparse.csr_matrix:
        """Return the derivative of `force`; not symmetric where joints slide (n, n).

        Args:
            q: coordinates (n,).
        """
        return self.assembled(1.0, 2.0, self._at(q).rate)

    def pulled(self, q: Array, motion: Array) -> Array:
        """Return the change of `force` by a small motion of the supports, nearly (n,).

        As if blocks had not turned yet: it is a first guess that is asked for.

        Args:
            q: coordinates (n,).
            motion: of the fixed blocks, zero for the others (n_blocks, 3) [m, m, rad].
        """
        return self.at_rest.remembering(self.memory).pulled(q, motion)

    def closed(self) -> sparse.csr_matrix:
        """Return the tangent before anything moves, with every joint closed (n, n)."""
        return self._pattern.spread(self.at_rest.closed())

    def energy(self, q: Array) -> float:
        """Return the potential energy of blocks and joints if nothing slid any further [J].

        Args:
            q: coordinates (n,).
        """
        of_blocks = 0.5 * float(q @ (self.blocks @ q))
        return of_blocks + float(joint_energy(self.joints, q, self._slid))

    def resultants(self, q: Array) -> Array:
        """Return N, V, M of every joint, about the middle of what overlaps (n_joints, 3).

        Args:
            q: coordinates (n,).
        """
        return self._at(q).resultants

    def measures(self, q: Array) -> Array:
        """Return opening at mid-depth, slip and turn of every joint (n_joints, 3) [m, m, -].

        Args:
            q: coordinates (n,).
        """
        found: Array = all_measures(self.joints, q)
        return found

    def load(self, action: Action, q: Array | None = None) -> Array:
        """Return the generalised forces of an action; a point load turns with nothing (n,).

        Args:
            action: body force or point load.
            q: coordinates at which it acts; None before anything moves (n,).
        """
        if isinstance(action, BodyForce) or q is None:
            return self.at_rest.load(action)
        place = self._place(action)
        return place.gradient(q, self.size).T @ np.array(action.force)

    def load_rate(self, action: Action, q: Array) -> sparse.csr_matrix:
        """Return the derivative of `load` by the coordinates (n, n).

        Args:
            action: body force or point load.
            q: coordinates at which it acts (n,).
        """
        if isinstance(action, BodyForce):
            return sparse.csr_matrix((self.size, self.size))
        return self._place(action).bend(q, np.array(action.force), self.size)

    def work(self, action: Action, q: Array) -> float:
        """Return the work of an action since before anything moved [J].

        Args:
            action: body force or point load.
            q: coordinates (n,).
        """
        if isinstance(action, BodyForce):
            return float(self.load(action) @ q)
        return float(self._place(action).displacement(q) @ np.array(action.force))

    def _place(self, action: PointLoad) -> "_Point":
        """Where a point load acts."""
        if action in self._points:
            return self._points[action]
        block, point = action.place(self.structure)
        rows = self.at_rest.cells.at(block, point)
        number = self.structure.free.index(block)
        first, end = self.starts[number], self.starts[number + 1]
        local = rows[:, first:end].toarray()
        found = _Point(int(first), np.array([local[1, 2], -local[0, 2]]), local[:, 3:])
        self._points[action] = found
        return found


@dataclass(frozen=True, eq=False)
class _Point:
    """A point of a block that turns.

    Attributes:
        first: first coordinate of the block.
        arm: from its centroid (2,) [m].
        shapes: displacements there of its modes (2, s).
    """

    first: int
    arm: Array
    shapes: Array

    def _turned(self, q: Array) -> tuple[Array, Array, Array]:
        """Where it is in the block, the block's rotation, and the derivative of that."""
        c, s = np.cos(q[self.first + 2]), np.sin(q[self.first + 2])
        strained = self.shapes @ q[self.first + 3 : self.first + 3 + self.shapes.shape[1]]
        return self.arm + strained, np.array([[c, -s], [s, c]]), np.array([[-s, -c], [c, -s]])

    def displacement(self, q: Array) -> Array:
        """Displacement from coordinates (2,) [m]."""
        place, turn, _ = self._turned(q)
        return q[self.first : self.first + 2] + turn @ place - self.arm

    def gradient(self, q: Array, size: int) -> sparse.csr_matrix:
        """Its derivative (2, n)."""
        place, turn, rate = self._turned(q)
        local = np.column_stack([np.eye(2), rate @ place, turn @ self.shapes])
        columns = self.first + np.arange(local.shape[1])
        found = sparse.lil_matrix((2, size))
        found[:, columns] = local
        return found.tocsr()

    def bend(self, q: Array, force: Array, size: int) -> sparse.csr_matrix:
        """Derivative of the generalised forces of a force (n, n)."""
        place, turn, rate = self._turned(q)
        theta, modes = self.first + 2, self.first + 3 + np.arange(self.shapes.shape[1])
        found = sparse.lil_matrix((size, size))
        found[theta, theta] = -force @ (turn @ place)
        found[theta, modes] = found[modes, theta] = force @ (rate @ self.shapes)
        return found.tocsr()


@dataclass(frozen=True, eq=False)
class MovingPassage:
    """A step of such a model; `models.model.Passage` says what its methods mean.

    Attributes:
        model: with what its joints remember of the time before.
        start: coordinates at its start (n,).
        late: lag of damping over the length of the step [-].
    """

    model: Moving
    start: Array
    late: float

    def _over(self, q: Array) -> Answer:
        return self.model.over(self.start, q, self.late)

    def force(self, q: Array) -> Array:
        """Return the mean of the internal forces of blocks and joints (n,).

        Args:
            q: coordinates at the end (n,).
        """
        middle = (0.5 - self.late) * self.start + (0.5 + self.late) * q
        return np.asarray(self.model.blocks @ middle) + self.model.gathered(self._over(q).force)

    def tangent(self, q: Array) -> sparse.csr_matrix:
        """Return the derivative of `force` (n, n).

        Args:
            q: coordinates at the end (n,).
        """
        return self.model.assembled(0.5 + self.late, 1.0, self._over(q).rate)

    def resultants(self, q: Array) -> Array:
        """Return the means of N, V, M of every joint (n_joints, 3) [N, N, N m].

        Args:
            q: coordinates at the end (n,).
        """
        return self._over(q).resultants

    def remembered(self, q: Array) -> Array:
        """Return how far each joint point has slid for good at the end (p,) [m].

        Args:
            q: coordinates at the end (n,).
        """
        return self._over(q).slid

    def lost(self, q: Array) -> float:
        """Return the energy that friction and the lag of damping take [J].

        Args:
            q: coordinates at the end (n,).
        """
        moved = q - self.start
        in_blocks = self.late * float(moved @ (self.model.blocks @ moved))
        return float(self._over(q).lost.sum()) + in_blocks


@dataclass(frozen=True, eq=False)
class TurningCells(Cells):
    """Cells of blocks that turn.

    Attributes:
        turns: coordinate of the turn of the block that each point belongs to (m,).
    """

    turns: Array | None = None

    @classmethod
    def of(cls, cells: Cells, starts: dict[int, int]) -> "TurningCells":
        """Return the same cells on blocks that turn.

        Args:
            cells: whose `lift` holds for small displacements.
            starts: first coordinate of each block that moves.
        """
        turns = np.array([starts[int(block)] + 2 for block in cells.block])
        return cls(cells.places, cells.block, cells.polygons, cells.lift, cells.stress, turns)

    @cached_property
    def _about(self) -> tuple[Array, sparse.csr_matrix]:
        """Arms of the points from the centroids (m, 2), and their elastic displacements."""
        columns = self.lift.tocsc()
        turn = np.unique(self.turns)
        arms = np.zeros_like(self.places)
        for column in turn:
            motion = columns[:, column].toarray().reshape(-1, 2)
            own = self.turns == column
            arms[own] = np.column_stack([motion[own, 1], -motion[own, 0]])
        rigid = np.zeros(self.lift.shape[1], bool)
        rigid[np.concatenate([turn, turn - 1, turn - 2])] = True
        return arms, self.lift @ sparse.diags((~rigid).astype(float))

    def displacement(self, q: Array) -> Array:
        """Return the displacement of every point (m, 2) [m].

        Args:
            q: coordinates (n,).
        """
        arms, elastic = self._about
        turn = q[self.turns]
        strained = (elastic @ q).reshape(-1, 2)
        c, s, less = np.cos(turn), np.sin(turn), -2.0 * np.sin(0.5 * turn) ** 2
        return np.column_stack(
            [
                q[self.turns - 2]
                + less * arms[:, 0]
                - s * arms[:, 1]
                + c * strained[:, 0]
                - s * strained[:, 1],
                q[self.turns - 1]
                + s * arms[:, 0]
                + less * arms[:, 1]
                + s * strained[:, 0]
                + c * strained[:, 1],
            ]
        )


@dataclass(frozen=True, eq=False)
class _Blocks:
    """Blocks of a model of small displacements in coordinates of their own."""

    structure: object
    basis: sparse.csr_matrix
    starts: dict[int, int]
    centres: Array
    size: int

    @classmethod
    def of(cls, small: Jointed) -> "_Blocks":
        lift = small.cells.lift.tocoo()
        moving = lift.data != 0.0
        owner = np.zeros(small.size, dtype=np.intp)
        owner[lift.col[moving]] = small.cells.block[lift.row[moving] // 2]
        starts, pieces, order, count = {}, [], [], 0
        centres = np.array([block.centroid for block in small.structure.blocks], float)
        for number in small.structure.free:
            own = np.flatnonzero(owner == number)
            shapes, centres[number] = _own_coordinates(small, own, number)
            starts[number] = count
            count += shapes.shape[1]
            pieces.append(shapes)
            order.append(own)
        stacked = sparse.block_diag(pieces, format="csr")
        basis = stacked[np.argsort(np.concatenate(order))]
        return cls(small.structure, basis, starts, centres, count)

    def joints(self, model: Jointed) -> Moved:
        structure, operator = model.structure, model.operator
        points = operator.points
        count = points.count
        normals, tangents = structure.normals, structure.tangents
        matrix = face_matrix(operator)[0].tocsr()
        ends = np.append(sorted(self.starts.values()), self.size)
        sizes = {b: int(ends[np.searchsorted(ends, s) + 1] - s) for b, s in self.starts.items()}
        most = max(sizes.values()) - 3
        start, size = np.full((count, 2), -1), np.zeros((count, 2), int)
        arm, shapes = np.zeros((count, 2, 2)), np.zeros((count, 2, 3, most))
        for joint in range(count):
            for side, sign in ((0, -1.0), (1, 1.0)):
                block = int(structure.pairs[joint, side])
                arm[joint, side] = structure.middles[joint] - self.centres[block]
                if block not in self.starts:
                    continue
                first, number = self.starts[block], sizes[block]
                start[joint, side], size[joint, side] = first, number
                rows = matrix[[joint, count + joint, 2 * count + joint], first + 3 : first + number]
                gap, turn, slip = sign * rows.toarray()
                own = shapes[joint, side, :, : number - 3]
                own[:2] = np.outer(normals[joint], gap) + np.outer(tangents[joint], slip)
                own[2] = turn
        sides = Sides(start, size, arm, shapes, _held(structure, model.supports))
        return Moved(sides, _faces(model), np.arctan2(normals[:, 1], normals[:, 0]))


def _own_coordinates(small: Jointed, own: Array, number: int) -> tuple[Array, Array]:
    """Motions of a block in the model's coordinates: rigid ones, then modes; and its centre."""
    mass = small.mass[own][:, own].toarray()
    stiffness = small.blocks[own][:, own].toarray()
    cells = small.cells
    nodes = np.flatnonzero(cells.block == number)
    rows = (2 * nodes[:, None] + np.arange(2)).ravel()
    lift = small.cells.lift[rows][:, own].toarray()

    def about(centre: Array) -> Array:
        motion = motion_of(cells.places[nodes], centre).reshape(-1, 3)
        found: Array = np.linalg.lstsq(lift, motion, rcond=None)[0]
        return found

    centre = np.array(small.structure.blocks[number].centroid)
    rigid = about(centre)
    inertia = rigid.T @ mass @ rigid
    centre = centre + np.array([inertia[1, 2], -inertia[0, 2]]) / inertia[0, 0]
    rigid = about(centre)
    if len(own) == 3:
        return rigid, centre
    values, modes = eigh(stiffness, mass)
    return np.column_stack([rigid, modes[:, 3:]]), centre


def _faces(model: Jointed) -> Faces:
    """What the law of the joints needs."""
    structure, points = model.structure, model.operator.points
    contacts = [joint.contact for joint in structure.joints]
    depth, facets = structure.depths, isinstance(model.operator.law, Facets)
    share = points.weight / (structure.width * depth[points.joint])
    return Faces(
        depth,
        structure.width * np.array([each.normal_stiffness for each in contacts]),
        np.array([each.coefficient for each in contacts]),
        np.searchsorted(points.joint, np.arange(points.count + 1)),
        points.arm / depth[points.joint],
        np.repeat(share[0::2] + share[1::2], 2) if facets else share,
        points.shear,
        facets,
    )


def _held(structure, supports: Array) -> Array:
    """Poses of the faces of blocks that do not move by themselves (j, 2, 3)."""
    centres = np.array([block.centroid for block in structure.blocks])
    held = np.zeros((len(structure.joints), 2, 3))
    for joint, pair in enumerate(structure.pairs):
        for side, block in enumerate(pair):
            x, y, turn = supports[block]
            rx, ry = structure.middles[joint] - centres[block]
            less = -2.0 * np.sin(0.5 * turn) ** 2
            held[joint, side] = (
                x + less * rx - np.sin(turn) * ry,
                y + np.sin(turn) * rx + less * ry,
                turn,
            )
    return held


@dataclass(frozen=True, eq=False)
class _Slots:
    """Where what joints do goes among the model's coordinates."""

    rows: tuple[Array, Array]
    pairs: tuple[Array, Array]
    places: Array


def _couplings(sides: Sides, size: int) -> tuple[_Slots, sparse.csr_matrix]:
    """Slots of all joints, and a matrix with an entry wherever a joint couples coordinates."""
    most = 3 + sides.shapes.shape[-1]
    local = np.arange(most)
    number = sides.start[:, :, None] + local  # (j, 2, s)
    used = (sides.start[:, :, None] >= 0) & (local < sides.size[:, :, None])
    flat = number.reshape(len(number), -1)
    known = used.reshape(len(number), -1)
    both = known[:, :, None] & known[:, None, :]
    places = np.flatnonzero(both)
    rows = np.broadcast_to(flat[:, :, None], both.shape)[both]
    columns = np.broadcast_to(flat[:, None, :], both.shape)[both]
    coupled = sparse.csr_matrix((np.ones(len(rows)), (rows, columns)), (size, size))
    own = np.flatnonzero(known)
    return _Slots((flat.ravel()[own], own), (rows, columns), places), coupled


def _check(small: Jointed) -> None:
    """Refuse what is not known for large displacements."""
    if small.fidelity not in PLANE:
        raise InvalidInput(
            f"large displacements are not known on the rung '{small.fidelity}': use one of {PLANE}"
        )
    cohesion = float(small.operator.points.cohesion.max())
    if cohesion > 0.0:
        raise InvalidInput(
            f"a joint with cohesion {cohesion:.4g} Pa is not known with large displacements: "
            "leave cohesion out"
        )
