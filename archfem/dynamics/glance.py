"""A quick look at joints at every step: which fail, and how."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

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

    def __call__(self, resultants: Array, least: int) -> Iterator[frozenset[str]]:
        """Yield what holds of the joints at each step; nothing does where fewer than so many fail.

        Args:
            resultants: N, V, M of all joints (steps, n_joints, 3) [N, N, N m].
            least: how many of those looked at.

        Yields:
            Names, step by step.
        """
        own = resultants[:, self._numbers]
        e, friction = ratios(own, self._depth)
        limits = ratio_at_sliding(own[..., 0], e, *self._laws)
        hinges, slides = failing(e, friction, limits, self._criteria.hinge)
        apart = borne(own[..., 0], self._tension) <= 0.0
        fail = np.count_nonzero(hinges | slides | apart, axis=1)
        senses = np.where(hinges, np.sign(e), 0.0), np.where(slides, np.sign(own[..., 1]), 0.0)
        states = np.stack([*senses, slides, apart], axis=1).astype(np.int8)
        for step, count in enumerate(fail.tolist()):
            key = states[step].tobytes() if count >= least else b""
            if key and key not in self._seen:
                self._seen[key] = self._ask(self.labelled(resultants[step]))
            yield self._seen[key] if key else frozenset()

    def labelled(self, resultants: Array) -> xr.Dataset:
        """Return all joints with labels and flags, as made by `joint_dataset`.

        Args:
            resultants: N, V, M of all joints (n_joints, 3) [N, N, N m].
        """
        return joint_dataset(self._structure, resultants, criteria=self._criteria)


@dataclass(frozen=True, eq=False)
class Look:
    """A watch that looks at many steps at once for what it tells step by step.

    Attributes:
        glance: at the joints.
        least: how many of them must fail for anything to hold.
        told: by what holds at a step, its N, V, M and its length, words that say why the run ends,
            or None.
    """

    glance: Glance
    least: int
    told: Callable[[frozenset[str], Array, float], str | None]

    def __call__(self, resultants: Array, step: float) -> str | None:
        """Return words that say why the run ends with a step, or None.

        Args:
            resultants: N, V, M (n_joints, 3) [N, N, N m].
            step: its length [s].
        """
        found = self.first(resultants[None], [step])
        return None if found is None else found[1]

    def first(self, resultants: Array, steps: Iterable[float]) -> tuple[int, str] | None:
        """Return the first step that ends the run and why; None where none does.

        Args:
            resultants: N, V, M of steps one after another (steps, n_joints, 3) [N, N, N m].
            steps: their lengths (steps,) [s].
        """
        states = zip(self.glance(resultants, self.least), resultants, steps, strict=True)
        for number, (now, own, step) in enumerate(states):
            if words := self.told(now, own, step):
                return number, words
        return None
