"""Linear blocks between dry joints: the model behind every rung that has matrices."""

from copy import copy
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.joints.operator import JointOperator
from archfem.joints.passage import Passage
from archfem.joints.rigid import gaps_of
from archfem.joints.sparsity import Pattern
from archfem.masonry.actions import Action, BodyForce, Settlement
from archfem.masonry.structure import Structure
from archfem.models.cells import Cells
from archfem.models.model import Prediction


class Jointed:
    """A model whose only nonlinearity is the status of its joint points.

    Forces are K q + Gᵀ W t(G q). The tangent changes only when a point opens, closes or begins to
    slide, so the last one is kept and given again, as the same object, until then. `Model` says
    what attributes and methods mean; `built` is told by `begun`.
    """

    def __init__(
        self,
        structure: Structure,
        fidelity: str,
        *,
        mass: sparse.csr_matrix,
        blocks: sparse.csr_matrix,
        body: Array,
        operator: JointOperator,
        cells: Cells,
    ) -> None:
        pattern = Pattern.of(mass, blocks, operator.couplings())
        self.structure = structure
        self.fidelity = fidelity
        self.size = mass.shape[0]
        self.mass = pattern.spread(mass)
        self.blocks = pattern.spread(blocks)
        self.body = body
        self.operator = operator
        self.cells = cells
        self.supports = np.zeros((len(structure.blocks), 3))
        self.built: Array | None = None
        self._pattern = pattern
        self._across = operator.tangents(pattern)
        self.prediction: Prediction | None = None
        self.doubts: tuple[str, ...] = ()
        self._last: tuple[Array, sparse.csr_matrix] | None = None

    def with_operator(self, operator: JointOperator) -> "Jointed":
        """Return a model of the same blocks, between joints taken in another way.

        Args:
            operator: of the joints, on the same coordinates.
        """
        return Jointed(
            self.structure,
            self.fidelity,
            mass=self.mass,
            blocks=self.blocks,
            body=self.body,
            operator=operator,
            cells=self.cells,
        ).moved(self.supports)

    def settled(self, settlement: Settlement) -> Self:
        """Return the same model with a support that has moved, further than before.

        Args:
            settlement: the support and its motion.
        """
        return self.moved(settlement.added(self.structure, self.supports))

    def moved(self, supports: Array) -> Self:
        """Return the same model with its supports moved: joints open and slip as much at q = 0.

        Args:
            supports: motions of the fixed blocks, from where they were built, zero for the others
                (n_blocks, 3) [m, m, rad].
        """
        other = copy(self)
        other.supports = supports
        offset = self.built
        if supports.any():
            gaps = gaps_of(self.structure, self.operator.points, supports)
            offset = gaps if self.built is None else gaps + self.built
        other.operator = replace(self.operator, offset=offset)
        other._last = None
        return other

    def begun(self, built: Array) -> Self:
        """Return the same model, whose blocks were placed one after the other.

        Args:
            built: opening and slip at q = 0, on supports that have not moved, of joints that began
                between blocks which had been displaced (2, p) [m]; kept as `built`.
        """
        other = copy(self)
        other.built = built
        return other.moved(self.supports)

    def between(self, operator: JointOperator) -> Self:
        """Return the same model between joints at the same points, which answer in another way.

        Args:
            operator: with the same opening and slip.
        """
        other = copy(self)
        other.operator = operator
        other._last = None
        return other

    @property
    def memory(self) -> Array:
        """How far each joint point has slid for good (p,) [m]; then which bonds broke (2 p,)."""
        return self.operator.memory

    def remembering(self, memory: Array) -> Self:
        """Return the same model, whose joints have slid so far.

        Args:
            memory: as `memory`.
        """
        other = copy(self)
        other.operator = self.operator.remembering(memory)
        return other

    def remembered(self, q: Array) -> Array:
        """Return what the joints remember once the model is at q, as `memory`.

        Args:
            q: coordinates (n,).
        """
        return self.operator.remembered(q)

    def passage(self, start: Array, late: float) -> "JointedPassage":
        """Return a step from a state that the joints remember.

        Args:
            start: coordinates at its start (n,).
            late: lag of damping over the length of the step [-].
        """
        return JointedPassage(self, Passage(self.operator, start, late))

    def predicted(self, prediction: Prediction) -> Self:
        """Return the same model, with what was predicted of it.

        Args:
            prediction: to be kept as `prediction`.
        """
        other = copy(self)
        other.prediction = prediction
        return other

    def force(self, q: Array) -> Array:
        """Return the internal forces of blocks and joints (n,).

        Args:
            q: coordinates (n,).
        """
        of_blocks: Array = self.blocks @ q
        return of_blocks + self.operator.force(q)

    def tangent(self, q: Array) -> sparse.csr_matrix:
        """Return the derivative of `force`, the same object while no point opens or closes.

        Args:
            q: coordinates (n,).
        """
        stiffness = self.operator.stiffness(q)
        if self._last is None or not np.array_equal(stiffness, self._last[0]):
            self._last = (stiffness, self.matrix(1.0, stiffness))
        return self._last[1]

    def pulled(self, q: Array, motion: Array) -> Array:
        """Return the change of `force` by a small motion of the supports, as `tangent` has it (n,).

        Args:
            q: coordinates (n,).
            motion: of the fixed blocks, zero for the others (n_blocks, 3) [m, m, rad].
        """
        joints = self.operator
        gaps = gaps_of(self.structure, joints.points, motion)
        return joints.pushed(*joints.answered(joints.stiffness(q), gaps))

    def matrix(self, share: float, stiffness: Array) -> sparse.csr_matrix:
        """Return the stiffness of blocks and joints together (n, n).

        Args:
            share: factor of that of the blocks [-].
            stiffness: of the joints, as by `JointOperator.stiffness` (m,) [N/m].
        """
        return self._pattern.matrix(share * self.blocks.data + self._across @ stiffness)

    def closed(self) -> sparse.csr_matrix:
        """Tangent with every joint closed over its whole depth, and nothing sliding."""
        return self.matrix(1.0, self.operator.glued())

    def energy(self, q: Array) -> float:
        """Return the potential energy of blocks and joints if nothing slid any further [J].

        Args:
            q: coordinates (n,).
        """
        return 0.5 * float(q @ (self.blocks @ q)) + self.operator.energy(q)

    def resultants(self, q: Array) -> Array:
        """Return N, V, M of every joint, for the whole width (n_joints, 3) [N, N, N m].

        Args:
            q: coordinates (n,).
        """
        return self.operator.resultants(q)

    def load(self, action: Action) -> Array:
        """Return the generalised forces of an action (n,).

        Args:
            action: body force or point load.
        """
        if isinstance(action, BodyForce):
            multiples = np.array([action.horizontal, action.vertical])
            inertia: Array = self.body @ multiples
            return inertia * self.structure.gravity
        block, point = action.place(self.structure)
        force: Array = self.cells.at(block, point).T @ np.array(action.force)
        return force


@dataclass(frozen=True, eq=False)
class JointedPassage:
    """A step of a model with matrices; `models.model.Passage` says what its methods mean.

    Attributes:
        model: with what its joints remember of the time before.
        joints: the same step of the joints alone.
    """

    model: Jointed
    joints: Passage

    def force(self, q: Array) -> Array:
        """Return the mean of the internal forces of blocks and joints (n,).

        Args:
            q: coordinates at the end (n,).
        """
        start, late = self.joints.start, self.joints.late
        of_blocks: Array = self.model.blocks @ ((0.5 - late) * start + (0.5 + late) * q)
        return of_blocks + self.joints.force(q)

    def tangent(self, q: Array) -> sparse.csr_matrix:
        """Return the derivative of `force` (n, n).

        Args:
            q: coordinates at the end (n,).
        """
        return self.model.matrix(0.5 + self.joints.late, self.joints.stiffness(q))

    def resultants(self, q: Array) -> Array:
        """Return the means of N, V, M of every joint (n_joints, 3) [N, N, N m].

        Args:
            q: coordinates at the end (n,).
        """
        return self.joints.resultants(q)

    def remembered(self, q: Array) -> Array:
        """Return what the joints remember at the end, as `Model.memory`.

        Args:
            q: coordinates at the end (n,).
        """
        return self.joints.remembered(q)

    def raising(self, q: Array) -> "JointedPassage":
        """Return the same step with teeth where the slip on the way to q puts them.

        Args:
            q: coordinates at the end (n,).
        """
        joints = self.joints.raising(q)
        return self if joints is self.joints else JointedPassage(self.model, joints)

    def lost(self, q: Array) -> float:
        """Return the energy that friction and the lag of damping take [J].

        Args:
            q: coordinates at the end (n,).
        """
        moved = q - self.joints.start
        return self.joints.lost(q) + self.joints.late * float(moved @ (self.model.blocks @ moved))
