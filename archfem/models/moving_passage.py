"""A step of a model whose blocks move as far as they like."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.joints.moving.moved import Answer


class Turning(Protocol):
    """What a step asks of its model."""

    blocks: sparse.csr_matrix

    def over(self, start: Array, end: Array, late: float) -> Answer:
        """Return what joints do over a step."""

    def gathered(self, force: Array) -> Array:
        """Return forces on joints' coordinates as those of the model (n,)."""

    def assembled(self, share: float, factor: float, rate: Array) -> sparse.csr_matrix:
        """Return the stiffness of blocks and joints together (n, n)."""


@dataclass(frozen=True, eq=False)
class MovingPassage:
    """A step of such a model; `models.model.Passage` says what its methods mean.

    Attributes:
        model: with what its joints remember of the time before.
        start: coordinates at its start (n,).
        late: lag of damping over the length of the step [-].
    """

    model: Turning
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

    def raising(self, q: Array) -> "MovingPassage":
        """Return the step itself, whose joints have no teeth.

        Args:
            q: coordinates at the end (n,).
        """
        return self
