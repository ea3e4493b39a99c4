"""A quick look at joints at every step: which fail, and whether they have failed so before."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from archfem.arrays import Array
from archfem.joints.criteria import Criteria, borne, failing
from archfem.joints.resultants import joint_dataset, ratios
from archfem.masonry.structure import Structure


class Glance:
    """A quick look at some joints of a structure at every step of a run.

    Labels, which take long, are given only to states of joints that have not been seen before.

    Args:
        structure: whose joints they are.
        criteria: by which they fail.
        numbers: of the joints looked at.
    """

    def __init__(self, structure: Structure, criteria: Criteria, numbers: Sequence[int]) -> None:
        self._structure, self._criteria = structure, criteria
        self._numbers = np.array(numbers, dtype=np.intp)
        self._depth = structure.depths[self._numbers]
        self._coefficients = criteria.coefficients(structure.friction[self._numbers])
        self._tension = structure.tension[self._numbers]
        self._seen: set[bytes] = set()

    def __call__(self, resultants: Array, least: int) -> xr.Dataset | None:
        """Label all joints where so many of those looked at fail in a way not yet seen.

        Args:
            resultants: N, V, M of all joints (n_joints, 3) [N, N, N m].
            least: how many.

        Returns:
            As made by `joint_dataset`; None where fewer fail, or each as it did before.
        """
        own = resultants[self._numbers]
        e, friction = ratios(own, self._depth)
        hinges, slides = failing(e, friction, self._coefficients, self._criteria.hinge)
        apart = borne(own[:, 0], self._tension) <= 0.0
        if np.count_nonzero(hinges | slides | apart) < least:
            return None
        senses = np.where(hinges, np.sign(e), 0.0), np.where(slides, np.sign(own[:, 1]), 0.0)
        key = np.stack([*senses, slides, apart]).astype(np.int8).tobytes()
        if key in self._seen:
            return None
        self._seen.add(key)
        return joint_dataset(self._structure, resultants, criteria=self._criteria)
