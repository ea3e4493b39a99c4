"""The slow reference: weak forms assembled at every iteration, sharing no shortcut."""

from copy import copy

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
        self._free = space.free
        self.supports = linear.supports
        self._places, self._owner = space.places, space.owner
        self._everywhere = np.zeros(2 * len(space.places))
        # The forms' pattern couples all nodes of the two cells at a facet, even where it is zero.
        self._pattern = Pattern.of(linear.mass, self._assembled(np.zeros(self.size)))
        self.mass = self._pattern.spread(linear.mass)
        self.blocks = self._pattern.spread(linear.blocks)
        self._closed = linear.closed()
        self.prediction: Prediction | None = None

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
        other._everywhere = np.zeros_like(self._everywhere)
        for number in set(range(len(supports))) - set(self.structure.free):
            nodes = np.flatnonzero(self._owner == number)
            motion = motion_of(self._places[nodes], self.structure.blocks[number].centroid)
            other._everywhere.reshape(-1, 2)[nodes] = motion @ supports[number]
        return other

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

    def _spread(self, q: Array) -> Array:
        """Displacements of all nodes, those of fixed blocks included."""
        self._everywhere[self._free] = q
        return self._everywhere

    def force(self, q: Array) -> Array:
        """Return the internal forces of blocks and joints (n,).

        Args:
            q: coordinates (n,).
        """
        return self._forms.force(self._spread(q))[self._free]

    def tangent(self, q: Array) -> sparse.csr_matrix:
        """Return the derivative of `force`, assembled anew.

        Args:
            q: coordinates (n,).
        """
        return self._pattern.spread(self._assembled(q))

    def _assembled(self, q: Array) -> sparse.csr_matrix:
        return self._forms.tangent(self._spread(q))[self._free][:, self._free]

    def closed(self) -> sparse.csr_matrix:
        """Tangent with every joint closed over its whole depth."""
        return self._pattern.spread(self._closed)

    def energy(self, q: Array) -> float:
        """Return the potential energy of blocks and joints [J].

        Args:
            q: coordinates (n,).
        """
        return self._forms.energy(self._spread(q))

    def resultants(self, q: Array) -> Array:
        """Return N, V, M of every joint, for the whole width (n_joints, 3) [N, N, N m].

        Args:
            q: coordinates (n,).
        """
        return self._forms.resultants(self._spread(q))
