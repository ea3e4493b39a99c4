"""A quick look at joints at every step: which fail, and how."""

from collections.abc import Callable, Sequence

import numpy as np
import xarray as xr

from archfem.arrays import Array
from archfem.joints.criteria import Criteria, borne, failing, ratio_at_sliding
from archfem.joints.resultants import joint_dataset, ratios
from archfem.masonry.structure import Structure


class Glance:
    """A quick look at some joints of a structure at every step of a run.

    Labels, which take long, and what is asked of them, are for states of joints that have not been
    seen before.

    Args:
        structure: whose joints they are.
        criteria: by which they fail.
        numbers: of the joints looked at.
        ask: of labelled joints, whether what is looked for holds: names of what does.
    """

    def __init__(
        self,
        structure: Structure,
        criteria: Criteria,
        numbers: Sequence[int],
        ask: Callable[[xr.Dataset], frozenset[str]],
    ) -> None:
        self._structure, self._criteria, self._ask = structure, criteria, ask
        self._numbers = np.array(numbers, dtype=np.intp)
        self._depth = structure.depths[self._numbers]
        self._laws = (
            criteria.coefficients(structure.friction[self._numbers]),
            criteria.cohesions(structure.cohesion[self._numbers]),
        )
        self._tension = structure.tension[self._numbers]
        self._seen: dict[bytes, frozenset[str]] = {}

    def __call__(self, resultants: Array, least: int) -> frozenset[str]:
        """Return what holds of the joints; nothing does where fewer than so many fail.

        Args:
            resultants: N, V, M of all joints (n_joints, 3) [N, N, N m].
            least: how many of those looked at.
        """
        own = resultants[self._numbers]
        e, friction = ratios(own, self._depth)
        limits = ratio_at_sliding(own[:, 0], e, *self._laws)
        hinges, slides = failing(e, friction, limits, self._criteria.hinge)
        apart = borne(own[:, 0], self._tension) <= 0.0
        if np.count_nonzero(hinges | slides | apart) < least:
            return frozenset()
        senses = np.where(hinges, np.sign(e), 0.0), np.where(slides, np.sign(own[:, 1]), 0.0)
        key = np.stack([*senses, slides, apart]).astype(np.int8).tobytes()
        if key not in self._seen:
            self._seen[key] = self._ask(self.labelled(resultants))
        return self._seen[key]

    def labelled(self, resultants: Array) -> xr.Dataset:
        """Return all joints with labels and flags, as made by `joint_dataset`.

        Args:
            resultants: N, V, M of all joints (n_joints, 3) [N, N, N m].
        """
        return joint_dataset(self._structure, resultants, criteria=self._criteria)
