"""Loads that grow together, on models whose blocks may turn far as well as on others."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.masonry.actions import BodyForce, PointLoad
from archfem.models.model import Model
from archfem.models.moving import Moving


@dataclass(frozen=True, eq=False)
class Load:
    """Actions that grow together, on a model.

    Attributes:
        model: that they act on.
        actions: body forces and point loads.
        size: of all [N].
        first: generalised forces before anything moves (n,).
    """

    model: Model
    actions: tuple[BodyForce | PointLoad, ...]
    size: float
    first: Array

    @classmethod
    def of(cls, model: Model, actions: Sequence[BodyForce | PointLoad]) -> "Load":
        """Return actions on a model.

        Args:
            model: that they act on.
            actions: body forces and point loads.

        Raises:
            InvalidInput: they come to nothing.
        """
        size = sum(_size(model, action) for action in actions)
        if size == 0.0:
            raise InvalidInput("the load is zero: give it a force or a multiple of g")
        first = np.sum([model.load(action) for action in actions], axis=0)
        return cls(model, tuple(actions), size, first)

    def forces(self, q: Array) -> Array:
        """Return the generalised forces (n,).

        Args:
            q: coordinates at which they act (n,).
        """
        if not isinstance(self.model, Moving):
            return self.first
        forces: Array = np.sum([self.model.load(action, q) for action in self.actions], axis=0)
        return forces

    def rate(self, q: Array) -> sparse.csr_matrix | None:
        """Return the derivative of `forces` (n, n); None where it does not depend on q.

        Args:
            q: coordinates (n,).
        """
        if not isinstance(self.model, Moving):
            return None
        return sum(self.model.load_rate(action, q) for action in self.actions)

    def moved(self, q: Array) -> float:
        """Return the displacement of the load along itself [m].

        Args:
            q: coordinates (n,).
        """
        if isinstance(self.model, Moving):
            return sum(self.model.work(action, q) for action in self.actions) / self.size
        return float(self.first @ q) / self.size


def _size(model: Model, action: BodyForce | PointLoad) -> float:
    """Size of an action [N]."""
    if isinstance(action, PointLoad):
        return hypot(*action.force)
    return model.structure.weight * hypot(action.horizontal, action.vertical)
