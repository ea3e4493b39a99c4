"""Step to step of a pushover: along its curve, by creep where that leads nowhere, to an end."""

from dataclasses import dataclass

import numpy as np

from archfem.arrays import Array
from archfem.joints.criteria import Criteria
from archfem.statics.ends import KNOWN, Path, Stop, crept, finished, sliding, stuck
from archfem.statics.path import LoadPath

GROWTH, SMALLEST = 1.1, 1e-3
"""Growth of steps, and the smallest one, relative to the first, to which they are halved before
giving up."""

FASTER, EASY = 1.4, 4
"""Growth of steps across the last one where Newton's method needs few iterations, and how many."""

FIXED = {"displacement": np.array([1.0, 0.0]), "force": np.array([0.0, 1.0])}
"""The direction along which steps are measured where it does not turn with the curve (2,)."""


def follow(path: Path, control: str, stop: Stop, criteria: Criteria) -> str:
    """Add states until a rule ends it, and say which.

    Args:
        path: that begins with the dead load.
        control: as for `pushover`.
        stop: the rules.
        criteria: what makes a joint hinge.

    Returns:
        The rule that ended it, in words.

    Raises:
        DidNotConverge: there is no equilibrium just after the dead load.
    """
    distance, direction = 1.0, np.array([1.0, 1.0]) / np.sqrt(2.0)
    farthest = stop.displacement * path.model.structure.size
    creeping = _Creeping(path, criteria, farthest)
    while True:
        border = FIXED.get(control, direction)
        if control == "path" and isinstance(path, LoadPath):
            found = path.onward(distance)
        else:
            found = path.advance(border, distance) or creeping.on(border, distance)
        if not found:
            distance /= 2.0
            if distance < SMALLEST:
                return crept(path, stop, criteria) or stuck(path, control, criteria)
            continue
        moved = _moved(path)
        direction = moved / np.linalg.norm(moved)
        if reason := finished(path, stop, criteria, moved):
            return reason
        easy = control == "path" and path.iterations[-1] <= EASY
        distance *= FASTER if easy else GROWTH


def _moved(path: Path) -> Array:
    """Displacement and factor of the last step, in units of the first (2,)."""
    last = np.array([path.displacements[-2:], path.factors[-2:]])
    moved: Array = np.diff(last)[:, 0] / np.array(path.unit)
    return moved


@dataclass
class _Creeping:
    """Creep in place of steps that fail; the oftener in vain, the seldomer it is tried.

    Attributes:
        path: to which states are added.
        criteria: what makes a joint slide.
        farthest: displacement of the load beyond which it has given way [m].
        wait: steps that must fail between two trials.
        failed: steps that have failed since the last one.
    """

    path: Path
    criteria: Criteria
    farthest: float
    wait: int = 0
    failed: int = 0

    def on(self, border: Array, distance: float) -> bool:
        """Creep under as much more load as the step would have brought, if joints slide.

        Args:
            border: direction along which the step is measured (2,).
            distance: of the step, in units of the first.

        Returns:
            Whether there is a state more.
        """
        path, self.failed = self.path, self.failed + 1
        if not isinstance(path, LoadPath) or len(path.states) < 2 or self.failed <= self.wait:
            return False
        moved = _moved(path)
        if moved[1] <= 0.0 or not sliding(path, self.criteria):
            return False
        grown = float(distance * moved[1] / (border @ moved)) * path.unit[1]
        found = path.creep(max(grown, KNOWN * path.factors[-1]), self.farthest)
        self.wait, self.failed = (0 if found else 2 * self.wait + 1), 0
        return found
