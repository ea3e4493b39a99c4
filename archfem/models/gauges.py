"""What is read off the coordinates of a model at every step, as by gauges fixed to it.

At each joint its faces (gap, rotation, slip), and for each block the displacement of its middle.
All of it is linear in the coordinates: readings are D q + d.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, cast
from weakref import WeakKeyDictionary

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.joints.faces import face_matrix
from archfem.joints.operator import JointOperator
from archfem.models.model import Model
from archfem.models.moving import Moving
from archfem.models.turning_places import TurningCells

_made: WeakKeyDictionary[Model, "Gauges"] = WeakKeyDictionary()


class Assembled(Protocol):
    """A model whose joints' forces come from weak forms, and that tells of their openings too."""

    @property
    def kinematics(self) -> JointOperator:
        """From coordinates to openings and slips; its forces are of no concern."""


class Readings(Protocol):
    """Readings of a model, whatever its displacements may be."""

    @property
    def joints(self) -> int:
        """Number of joints."""

    def read(self, q: Array) -> Array:
        """Return all readings (r,).

        Args:
            q: coordinates (n,).
        """

    def faces(self, readings: Array) -> Array:
        """Return gaps at mid-depth, rotations and slips of the joints (…, 3, n_joints).

        Args:
            readings: (…, r).
        """
        own = readings[..., : 3 * self.joints]
        return own.reshape(*readings.shape[:-1], 3, self.joints)

    def middles(self, readings: Array) -> Array:
        """Return displacements of the blocks' middles (…, n_blocks, 2) [m]; 0 of fixed blocks.

        Args:
            readings: (…, r).
        """
        return readings[..., 3 * self.joints :].reshape(*readings.shape[:-1], -1, 2)


@dataclass(frozen=True, eq=False)
class Gauges(Readings):
    """Readings of a model.

    Attributes:
        matrix: D, from coordinates to readings, of the joints first, then of the blocks (r, n).
        offset: d, readings at q = 0, which supports cause that have moved (r,).
        count: number of joints.
    """

    matrix: sparse.csr_matrix
    offset: Array
    count: int

    @property
    def joints(self) -> int:
        """Number of joints."""
        return self.count

    @classmethod
    def on(cls, model: Model) -> "Gauges | MovedGauges":
        """Return the gauges of a model, made once.

        Args:
            model: any rung.
        """
        if isinstance(model, Moving):
            return MovedGauges(model)
        if model not in _made:
            _made[model] = cls.made_for(model)
        return _made[model]

    @classmethod
    def made_for(cls, model: Model) -> "Gauges":
        """Put gauges on a model of small displacements.

        Args:
            model: any rung.

        Returns:
            The gauges, made anew.
        """
        operator = model.operator or cast(Assembled, model).kinematics
        faces, moved = face_matrix(operator)
        cells = model.cells
        blocks = len(model.structure.blocks)
        share = 1.0 / np.bincount(cells.block)[cells.block]
        places = np.arange(len(share))
        mean = sparse.csr_matrix((share, (cells.block, places)), (blocks, len(share)))
        middles = sparse.kron(mean, sparse.identity(2)) @ cells.lift
        offset = np.concatenate([moved, np.zeros(2 * blocks)])
        return cls(sparse.vstack([faces, middles], "csr"), offset, len(model.structure.joints))

    def read(self, q: Array) -> Array:
        """Return all readings (r,).

        Args:
            q: coordinates (n,).
        """
        return np.asarray(self.matrix @ q + self.offset)


@dataclass(frozen=True, eq=False)
class MovedGauges(Readings):
    """Readings of a model whose blocks move as far as they like, in the same order.

    Attributes:
        model: whose they are.
    """

    model: Moving

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.model.structure.joints)

    def read(self, q: Array) -> Array:
        """Return all readings (r,).

        Args:
            q: coordinates (n,).
        """
        found: Array = self.over(q[None])[0]
        return found

    @cached_property
    def _middles(self) -> TurningCells:
        """The blocks as points."""
        cells = self.model.cells
        assert isinstance(cells, TurningCells)
        return cells.middles(len(self.model.structure.blocks))

    def over(self, states: Array) -> Array:
        """Return the readings of many states (steps, r).

        Args:
            states: coordinates (steps, n).
        """
        gap, slip, turn = np.moveaxis(self.model.measures(states), -1, 0)
        middles = self._middles.displacement(states).reshape(
            len(states), 2 * len(self._middles.turns)
        )
        return np.concatenate([gap, 2.0 * np.arcsin(0.5 * turn), slip, middles], axis=1)
