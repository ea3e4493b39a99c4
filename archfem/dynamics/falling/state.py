"""Where blocks are and how they move, and their energy on the way."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from archfem.arrays import Array
from archfem.masonry.structure import Structure


@dataclass(frozen=True, eq=False)
class Loose:
    """Poses and velocities of all blocks of a structure at one time, relative to the ground.

    Attributes:
        time: since the motion began [s].
        poses: displacement of each block's centroid from where it was built, and its turn,
            anticlockwise (n_blocks, 3) [m, m, rad].
        velocities: their rates; those of fixed blocks count for nothing (n_blocks, 3).
    """

    time: float
    poses: Array
    velocities: Array

    @classmethod
    def built(cls, structure: Structure, time: float = 0.0) -> Self:
        """Return the blocks as built, at rest.

        Args:
            structure: whose blocks.
            time: since the motion began [s].
        """
        count = len(structure.blocks)
        return cls(time, np.zeros((count, 3)), np.zeros((count, 3)))


@dataclass(frozen=True)
class Balance:
    """Energy since the start of a run, relative to the ground [J].

    Attributes:
        kinetic: of all blocks.
        potential: of their weight, zero at the start.
        work: that the motion of the ground has done.
        lost: in impacts and by friction.
        gained: by which, at most, it rose above what it had been at any time before, the work of
            the ground apart; of a true solution nothing.
    """

    kinetic: float
    potential: float
    work: float
    lost: float
    gained: float


@dataclass(frozen=True, eq=False)
class Frame(Loose):
    """The blocks at one time of a run.

    Attributes:
        balance: energy since the start.
        overlap: deepest of two blocks, or of one in the ground, since the start [m].
        unsettled: steps since the start whose impulses were taken before they had settled.
        resting: whether all blocks have come to rest.
    """

    balance: Balance
    overlap: float
    unsettled: int
    resting: bool = False
