"""A quick look at joints at every step: which fail, and how."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from archfem.arrays import Array
from archfem.joints.criteria import Criteria, borne, failing, ratio_at_sliding
from archfem.joints.resultants import joint_dataset, ratios
from archfem.masonry.structure import Structure


@dataclass(frozen=True, eq=False)
class Seen:
    """How some joints are at a step.

    Attributes:
        side: face on which each hinges, 1 extrados, -1 intrados, 0 none (n,).
        sense: sign of its shear force where it slides, else 0 (n,).
        slides: whether its friction is used up (n,).
        apart: whether it has come apart (n,).
        labelled: gives all joints with labels and flags, as made by `joint_dataset`.
    """

    side: NDArray[np.int8]
    sense: NDArray[np.int8]
    slides: NDArray[np.bool_]
    apart: NDArray[np.bool_]
    labelled: Callable[[], xr.Dataset]

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Whether each has failed (n,)."""
        found: NDArray[np.bool_] = (self.side != 0) | self.slides | self.apart
        return found


class Glance:
    """A quick look at some joints of a structure at every step of a run.

    What is asked of them, which takes longer, is for states of joints that have not been seen
    before.

    Args:
        structure: whose joints they are.
        criteria: by which they fail.
        numbers: of the joints looked at.
        ask: of those joints, whether what is looked for holds: names of what does.
    """

    def __init__(
        self,
        structure: Structure,
        criteria: Criteria,
        numbers: Sequence[int],
        ask: Callable[[Seen], frozenset[str]],
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
        hinges, used_up = failing(e, friction, limits, self._criteria.hinge)
        loose = borne(own[..., 0], self._tension) <= 0.0
        fail = np.count_nonzero(hinges | used_up | loose, axis=1)
        senses = np.where(hinges, np.sign(e), 0.0), np.where(used_up, np.sign(own[..., 1]), 0.0)
        states = np.stack([*senses, used_up, loose], axis=1).astype(np.int8)
        for step, count in enumerate(fail.tolist()):
            key = states[step].tobytes() if count >= least else b""
            if key and key not in self._seen:
                side, sense, slides, apart = states[step]
                labelled = partial(self.labelled, resultants[step])
                seen = Seen(side, sense, slides.astype(bool), apart.astype(bool), labelled)
                self._seen[key] = self._ask(seen)
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
