"""How long a history is one, and not one of many: growth of a perturbation that nobody could see.

Where joints rattle, the least difference grows: two motions that differ by 1e-10 of themselves, or
two steppers that differ by rounding, then part after a while, and no stepper is nearer to the truth
than the other. Until then a history may be compared step by step; from then on only what it has in
common with its neighbours, such as the largest |e|, means anything.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from archfem.arrays import Array
from archfem.dynamics.history import History
from archfem.dynamics.probe import largest_difference, peaks_of
from archfem.dynamics.time_history import STEP, time_history
from archfem.models.model import Model
from archfem.motion.motion import Motion
from archfem.statics.equilibrium import dead_load

NUDGE = 1e-10
"""By how much the motion is changed, of itself: more than what steppers leave of the residual of a
step, less than anything measured."""

SEEN = 1e-6
"""Difference of N in any joint, of the largest N, from which two histories are not the same."""

FIRST = 100.0
"""How much larger than the change of the motion a difference is from which its growth is told."""


@dataclass(frozen=True)
class Predictability:
    """How long a history is the same as that of a motion which hardly differs.

    Attributes:
        until: time at which N of a joint first differs by more than a millionth of the largest
            N [s]; infinite where it never does.
        growth: rate at which the difference grew until then, or to its largest value [1/s]; 0
            where it stayed as small as the change of the motion.
        difference: the largest difference of N in the end, of the largest N [-].
        peaks: difference of the largest |e| of a joint, which outlives equality [-].
    """

    until: float
    growth: float
    difference: float
    peaks: float

    @property
    def text(self) -> str:
        """The same in words."""
        if self.until == np.inf:
            return f"histories stay equal to {self.difference:.1e}"
        return (
            f"histories are the same up to {self.until:.3g} s: a difference grows by "
            f"exp({self.growth:.3g} t); from then on only statistics are, and the largest |e| of "
            f"a joint differs by {self.peaks:.1g}"
        )


def predictability(model: Model, motion: Motion, **options: Any) -> Predictability:
    """Find out how long a history is determined, by two runs whose motions differ by 1e-10.

    Args:
        model: any rung of the ladder.
        motion: of the ground.
        options: of `time_history`, the same for both; without `dt` steps of 5 ms.

    Returns:
        When histories part, how fast they do, and what is left of their largest |e|.

    Raises:
        DidNotConverge: a step of a run failed.
    """
    options = {"start": dead_load(model), **options}
    options["dt"] = options.get("dt") or STEP
    runs = [time_history(model, each, **options) for each in (motion, motion.scaled(1.0 + NUDGE))]
    return parted(*runs)


def parted(one: History, other: History) -> Predictability:
    """Return how long two histories at the same times are the same.

    Args:
        one: of a run.
        other: of one that hardly differs, by its motion or its stepper.
    """
    steps = min(len(one.time), len(other.time))
    forces = [run.joints["N"].values[:steps] for run in (one, other)]
    off = np.abs(forces[0] - forces[1]).max(axis=1) / np.abs(forces[0]).max()
    beyond = np.flatnonzero(off > SEEN)
    until = float(one.time[beyond[0]]) if len(beyond) else np.inf
    last = int(beyond[0]) if len(beyond) else int(off.argmax())
    peaks = largest_difference(peaks_of(one), peaks_of(other))
    return Predictability(until, _growth(one.time, off, last), float(off.max()), peaks)


def _growth(times: Array, off: Array, last: int) -> float:
    """Rate of growth of a difference, from where it is seen first [1/s]."""
    first = int(np.argmax(off > FIRST * NUDGE))
    if not 0 < first < last:
        return 0.0
    return float(np.log(off[last] / off[first]) / (times[last] - times[first]))
