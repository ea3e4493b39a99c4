"""The slow reference: weak forms assembled at every iteration, sharing no shortcut."""

from copy import copy
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.joints.operator import JointOperator
from archfem.joints.quadrature import Quadrature
from archfem.joints.sparsity import Pattern
from archfem.masonry.actions import Settlement
from archfem.masonry.rigid_motion import motion_of
from archfem.models.fem.forms import Forms
from archfem.models.fem.space import BrokenSpace
from archfem.models.fem.step_forms import Begun, StepForms
from archfem.models.full import full
from archfem.models.model import Prediction


class Monolithic:
    """A model that asks the compiled UFL forms for everything that depends on displacement.

    `Model` says what attributes and methods mean.
    """

    fidelity = "monolithic"
    operator = None

    def __init__(self, space: BrokenSpace, rule: Quadrature) -> None:
        linear = full(space, rule)
        self.structure = linear.structure
        self.size = linear.size
        self.body = linear.body
        self.cells = linear.cells
        self.load = linear.load
        self._linear = linear
        self._forms = Forms(space, rule)
        self.steps = StepForms(self._forms)
        self.free = space.free
        self.supports = linear.supports
        self._places, self._owner = space.places, space.owner
        self._everywhere = np.zeros(2 * len(space.places))
        self.memory = linear.memory
        # The forms' pattern couples all nodes of the two cells at a facet, even where it is zero.
        coupled = self._forms.tangent(self._everywhere, self.memory)[self.free][:, self.free]
        self._pattern = Pattern.of(linear.mass, coupled)
        self.mass = self._pattern.spread(linear.mass)
        self.blocks = self._pattern.spread(linear.blocks)
        self._closed = linear.closed()
        self.prediction: Prediction | None = None
        self.doubts: tuple[str, ...] = ()

    def settled(self, settlement: Settlement) -> "Monolithic":
        """Return the same model with a support that has moved, further than before.

        Args:
            settlement: the support and its motion.
        """
        return self.moved(settlement.added(self.structure, self.supports))

    def moved(self, supports: Array) -> "Monolithic":
        """Return the same model with its supports moved: their nodes follow.

        Args:
            supports: motions of the fixed blocks, from where they were built, zero for the others
                (n_blocks, 3) [m, m, rad].
        """
        other = copy(self)
        other.supports = supports
        other._everywhere = self._carried(supports)
        return other

    def _carried(self, supports: Array) -> Array:
        """Displacements of all nodes, where only those of fixed blocks move (2 m,) [m]."""
        found = np.zeros_like(self._everywhere)
        for number in set(range(len(supports))) - set(self.structure.free):
            nodes = np.flatnonzero(self._owner == number)
            motion = motion_of(self._places[nodes], self.structure.blocks[number].centroid)
            found.reshape(-1, 2)[nodes] = motion @ supports[number]
        return found

    def remembering(self, memory: Array) -> "Monolithic":
        """Return the same model, whose joints have slid so far.

        Args:
            memory: how far each joint point has slid for good (p,) [m], in the order of the joint
                operator of `full`.
        """
        other = copy(self)
        other.memory = memory
        return other

    def remembered(self, q: Array) -> Array:
        """Return how far each joint point has slid for good once it is at q (p,) [m].

        Args:
            q: coordinates (n,).
        """
        return self._forms.facets.gathered(self._tractions(q)[2])

    def passage(self, start: Array, late: float) -> "MonolithicPassage":
        """Return a step from a state that the joints remember.

        Args:
            start: coordinates at its start (n,).
            late: lag of damping over the length of the step [-].
        """
        return MonolithicPassage(self, Begun(self.spread(start).copy(), self.memory, late))

    def predicted(self, prediction: Prediction) -> "Monolithic":
        """Return the same model, with what was predicted of it.

        Args:
            prediction: to be kept as `prediction`.
        """
        other = copy(self)
        other.prediction = prediction
        return other

    @property
    def kinematics(self) -> JointOperator:
        """From coordinates to openings and slips at points on the joints, for what is read off."""
        return self._linear.moved(self.supports).operator

    def spread(self, q: Array) -> Array:
        """Return displacements of all nodes, those of fixed blocks included (2 m,) [m].

        Args:
            q: coordinates (n,).
        """
        self._everywhere[self.free] = q
        return self._everywhere

    def force(self, q: Array) -> Array:
        """Return the internal forces of blocks and joints (n,).

        Args:
            q: coordinates (n,).
        """
        return self._forms.force(self.spread(q), self.memory)[self.free]

    def tangent(self, q: Array) -> sparse.csr_matrix:
        """Return the derivative of `force`, assembled anew.

        Args:
            q: coordinates (n,).
        """
        return self.of_free(self._forms.tangent(self.spread(q), self.memory))

    def pulled(self, q: Array, motion: Array) -> Array:
        """Return the change of `force` by a small motion of the supports, as `tangent` has it (n,).

        Args:
            q: coordinates (n,).
            motion: of the fixed blocks, zero for the others (n_blocks, 3) [m, m, rad].
        """
        tangent = self._forms.tangent(self.spread(q), self.memory)
        change: Array = (tangent @ self._carried(motion))[self.free]
        return change

    def of_free(self, matrix: sparse.csr_matrix) -> sparse.csr_matrix:
        """Return the part of a matrix that belongs to the coordinates, on the model's pattern.

        Args:
            matrix: over all nodes, assembled from the forms (2 m, 2 m).
        """
        return self._pattern.spread(matrix[self.free][:, self.free])

    def closed(self) -> sparse.csr_matrix:
        """Tangent with every joint closed over its whole depth."""
        return self._pattern.spread(self._closed)

    def energy(self, q: Array) -> float:
        """Return the potential energy of blocks and joints if nothing slid any further [J].

        Args:
            q: coordinates (n,).
        """
        return self._forms.energy(self.spread(q), self.memory)

    def resultants(self, q: Array) -> Array:
        """Return N, V, M of every joint, for the whole width (n_joints, 3) [N, N, N m].

        Args:
            q: coordinates (n,).
        """
        return self._forms.facets.resultants(*self._tractions(q)[:2])

    def _tractions(self, q: Array) -> Array:
        return self._forms.tractions(self.spread(q), self.memory)


@dataclass(frozen=True, eq=False)
class MonolithicPassage:
    """A step of a model by weak forms; `models.model.Passage` says what its methods mean.

    Attributes:
        model: whose joints remember the time before.
        begun: how the step begins.
    """

    model: Monolithic
    begun: Begun

    def force(self, q: Array) -> Array:
        """Return the mean of the internal forces of blocks and joints (n,).

        Args:
            q: coordinates at the end (n,).
        """
        return self.model.steps.force(self.begun, self.model.spread(q))[self.model.free]

    def tangent(self, q: Array) -> sparse.csr_matrix:
        """Return the derivative of `force` (n, n).

        Args:
            q: coordinates at the end (n,).
        """
        return self.model.of_free(self.model.steps.tangent(self.begun, self.model.spread(q)))

    def _tractions(self, q: Array) -> Array:
        return self.model.steps.tractions(self.begun, self.model.spread(q))

    def resultants(self, q: Array) -> Array:
        """Return the means of N, V, M of every joint (n_joints, 3) [N, N, N m].

        Args:
            q: coordinates at the end (n,).
        """
        return self.model.steps.forms.facets.resultants(*self._tractions(q)[:2])

    def remembered(self, q: Array) -> Array:
        """Return how far each joint point has slid for good at the end (p,) [m].

        Args:
            q: coordinates at the end (n,).
        """
        return self.model.steps.forms.facets.gathered(self._tractions(q)[2])

    def raising(self, q: Array) -> "MonolithicPassage":
        """Return the step itself, whose joints have no teeth.

        Args:
            q: coordinates at the end (n,).
        """
        return self

    def lost(self, q: Array) -> float:
        """Return the energy that friction and the lag of damping take [J].

        Args:
            q: coordinates at the end (n,).
        """
        return self.model.steps.lost(self.begun, self.model.spread(q))
