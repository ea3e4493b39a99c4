"""Blocks that turn and slide as far as they like: the models whose displacements may be large.

Made of a model of small displacements, whose blocks are written in coordinates of their own: the
displacement of the centroid and the turn, and the elastic modes of the block in the frame that
turns with it. Those neither move the centroid nor turn the block on the mean (mean axes), so the
mass stays constant and diagonal; that inertia forces act on the modes as a block spins is left out.
"""

from copy import copy
from typing import Self

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.joints.moving.moved import (
    Answer,
    all_measures,
    answer,
    joint_energy,
    paired_slips,
    pass_joints,
)
from archfem.joints.sparsity import Pattern
from archfem.masonry.actions import Action, BodyForce, PointLoad, Settlement
from archfem.models.cells import Cells
from archfem.models.model import Model, Passage, Prediction
from archfem.models.moving_passage import MovingPassage
from archfem.models.reduced import projected
from archfem.models.turning_blocks import OwnCoordinates, jointed, slots_of
from archfem.models.turning_joints import Pieces, built_measures, joints_of
from archfem.models.turning_places import StillPoint, TurningCells, TurningPoint


class Moving:
    """A model whose blocks move as far as they like; `Model` says what its members mean.

    Args:
        small: the same structure with small displacements, on a rung that has matrices; with exact
            facets where faces bend.

    Attributes:
        starts: where the coordinates of each block that moves begin, and the number of all.
        turning: whether each of those blocks has a frame that turns; a fill has none.
        centres: about which blocks turn (n_blocks, 2) [m].
        pieces: of the joints.
        built: as of `Jointed.begun`; None where all was built in one go.

    Raises:
        InvalidInput: the joints obey a law that is not known for large motion, or faces bend
            between springs.
    """

    operator = None

    def __init__(self, small: Model) -> None:
        small = jointed(small)
        blocks = OwnCoordinates.of(small)
        self.at_rest = projected(small, blocks.basis, small.fidelity)
        self.structure = small.structure
        self.fidelity = small.fidelity
        self.size = self.at_rest.size
        self.starts = blocks.starts
        self.turning = np.array([turns for _, turns in blocks.blocks.values()])
        self.centres = blocks.centres
        self.pieces = Pieces.of(self.at_rest)
        self.joints = joints_of(self.at_rest, self.pieces, blocks.blocks, blocks.centres)
        self._slots, coupled = slots_of(self.joints.sides, self.size)
        pattern = Pattern.of(self.at_rest.mass, self.at_rest.blocks, coupled)
        self.mass = pattern.spread(self.at_rest.mass)
        self.blocks = pattern.spread(self.at_rest.blocks)
        self._pattern = pattern
        self._entries = pattern.places(*self._slots.pairs)
        self.body = self.at_rest.body
        self.cells: Cells = TurningCells.of(self.at_rest.cells, blocks.blocks)
        self.supports = self.at_rest.supports
        self.built: Array | None = None
        self.prediction: Prediction | None = None
        self.doubts: tuple[str, ...] = ()
        self._points: dict[PointLoad, TurningPoint] = {}
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
        held = self.pieces.held(supports)
        other.joints = self.joints._replace(sides=sides._replace(held=held))
        return other

    def begun(self, built: Array) -> Self:
        """Return the same model, whose blocks were placed one after the other.

        Args:
            built: opening and slip at which joint points began, as of `Jointed.begun` (2, p) [m].
        """
        other = copy(self)
        other.built = built
        began = built_measures(self.at_rest, self.pieces, built)
        other.joints = self.joints._replace(built=np.ascontiguousarray(began))
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

    def passage(self, start: Array, late: float) -> Passage:
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
        pass_joints(self.joints, _plain(start), _plain(end), late, self._slid, found)
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
        return np.asarray(np.bincount(rows, force.ravel()[places], self.size), dtype=float)

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
        return of_blocks + float(joint_energy(self.joints, _plain(q), self._slid))

    def resultants(self, q: Array) -> Array:
        """Return N, V, M of every joint, about the middle of what overlaps (n_joints, 3).

        Args:
            q: coordinates (n,).
        """
        return self._at(q).resultants

    def measures(self, q: Array) -> Array:
        """Return opening at mid-depth, slip and turn of every joint (…, n_joints, 3) [m, m, -].

        Args:
            q: coordinates of one state or of many (…, n).
        """
        found: Array = all_measures(self.joints, _plain(np.atleast_2d(q)))
        return found.reshape(*q.shape[:-1], *found.shape[1:])

    def mismatch(self, q: Array) -> tuple[float, str]:
        """Return how far faces have slid past the facets they are paired by, and at which joint.

        Args:
            q: coordinates (n,).

        Returns:
            The slip over the length of a facet, of a sliver over that of the usual one [-], 0 where
            all faces are plane; and a name.
        """
        faces = self.joints.faces
        if not faces.paired.any():
            return 0.0, ""
        depth, usual = faces.depth, np.median(faces.depth[faces.paired])
        slips = paired_slips(self.joints, _plain(q))
        slips = slips * depth / np.maximum(depth, usual)
        worst = int(np.argmax(slips))
        return float(slips[worst]), self.structure.joints[self.joints.whole[worst]].name

    def load(self, action: Action, q: Array | None = None) -> Array:
        """Return the generalised forces of an action; a point load turns with nothing (n,).

        Args:
            action: body force or point load.
            q: coordinates at which it acts; None before anything moves (n,).
        """
        if isinstance(action, BodyForce) or q is None:
            return self.at_rest.load(action)
        force: Array = self._place(action).gradient(q, self.size).T @ np.array(action.force)
        return force

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

    def _place(self, action: PointLoad) -> TurningPoint | StillPoint:
        """Where a point load acts."""
        if action in self._points:
            return self._points[action]
        block, point = action.place(self.structure)
        rows = self.at_rest.cells.at(block, point)
        number = self.structure.free.index(block)
        first, end = self.starts[number], self.starts[number + 1]
        if not self.turning[number]:
            return StillPoint(rows)
        local = rows[:, first:end].toarray()
        found = TurningPoint(int(first), np.array([local[1, 2], -local[0, 2]]), local[:, 3:])
        self._points[action] = found
        return found


def _plain(q: Array) -> Array:
    """Coordinates in the one kind of array for which the joints are compiled, and not for more."""
    plain: Array = np.require(q, float, ("C", "W"))
    return plain
