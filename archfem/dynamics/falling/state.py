"""Where blocks are and how they move."""

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
