"""What a model and its steps err by, measured on the strongest part of a motion.

The largest |e| of every joint is compared, since that is what hinges are judged by. With P(m, s)
those of a model m in steps s, the truth is nearer than

    |P(m, s) - P(best, s)| + |P(best, s) - P(best, 0)|

to P(m, s): what the model errs by, and what the steps do. Both models of the first part take the
same steps, so that it is of the model alone. The second part is found from steps s/2, by which the
error of a scheme of second order falls to a quarter (Richardson): it is 4/3 of the difference.

Where impacts decide, one motion tells little: which of many bounces is the highest hangs on less
than models differ by, and two may agree by luck. Motions a little weaker and stronger tell how much
of the largest |e| is left to chance: nothing is predicted to err by less.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from archfem.arrays import Array
from archfem.dynamics.history import History
from archfem.dynamics.probe import largest_difference, peaks_of
from archfem.dynamics.schemes import Viscous
from archfem.dynamics.time_history import time_history
from archfem.errors import DidNotConverge
from archfem.models.model import Model
from archfem.motion.motion import Motion
from archfem.statics.equilibrium import Equilibrium, dead_load

SAFETY = 1.5
"""By how much an error elsewhere in the motion may exceed that in the window. With it, what was
predicted of eight arches and columns, a motion each, was 1.0 to 2.7 times what came about."""

NEAR = (0.01, 0.02)
"""By how much motions near by are weaker and stronger: records are known no better."""

RICHARDSON = 4.0 / 3.0
"""Error of a scheme of second order, of what it changes by in steps half as long."""


@dataclass(frozen=True)
class Steps:
    """How a run steps: at a time step, or by a tolerance.

    Attributes:
        dt: time step [s]; None where steps choose their length.
        pace: tolerance of |e| by which they do so [-]; None where there is a time step.
    """

    dt: float | None
    pace: float | None

    @property
    def label(self) -> str:
        """In a few words."""
        if self.dt is not None:
            return f"steps of {1e3 * self.dt:g} ms"
        return f"steps for {self.pace:.2g} in |e|"

    @property
    def halved(self) -> "Steps":
        """Steps about half as long: their error goes with the square of their length."""
        return Steps(self.dt and self.dt / 2.0, self.pace and self.pace / 4.0)


@dataclass(frozen=True, eq=False)
class _Told:
    """What a run tells: the largest |e| of each judged joint (n,), and turn of any [rad]."""

    peaks: Array
    turn: float


@dataclass(frozen=True, eq=False)
class Yardstick:
    """The finest model under the strongest part of a motion, with which others are compared.

    Attributes:
        model: the finest.
        window: the part of the motion.
        damping: of all runs.
        told: called after each run.
    """

    model: Model
    window: Motion
    damping: Viscous | None
    told: Callable[[], object] = lambda: None
    _known: dict[tuple[Model, Steps, float], _Told] = field(default_factory=dict)
    _dead: dict[Model, Equilibrium] = field(default_factory=dict)

    def by(self, finer: Model) -> "Yardstick":
        """Return the same with another finest model; what is known of all models stays.

        Args:
            finer: the model.
        """
        return replace(self, model=finer)

    def in_time(self, steps: Steps) -> float:
        """Return the error of steps in the largest |e| of a joint, whatever the model [-].

        Args:
            steps: of the run.

        Raises:
            DidNotConverge: the finest model failed.
        """
        whole, half = (self._peaks(self.model, each) for each in (steps, steps.halved))
        return SAFETY * RICHARDSON * largest_difference(whole, half)

    def in_model(self, model: Model, steps: Steps) -> float:
        """Return the error of a model in the largest |e| of a joint; infinite where it fails [-].

        Args:
            model: to be compared.
            steps: of the run.

        Raises:
            DidNotConverge: the finest model failed.
        """
        best = self._peaks(self.model, steps)
        try:
            return SAFETY * largest_difference(self._peaks(model, steps), best)
        except DidNotConverge:
            return np.inf

    def by_chance(self, model: Model, steps: Steps) -> float:
        """Return what impacts leave to chance of the largest |e| of a joint [-].

        Unless impacts decide, |e| grows evenly with the motion: its mean over a weaker and a
        stronger one is that of the motion itself. It is taken by how far it strays from that;
        infinite where one of them makes the model fail.

        Args:
            model: to be shaken.
            steps: of the run.
        """
        try:
            return SAFETY * max(self._stray(model, steps, near) for near in NEAR)
        except DidNotConverge:
            return np.inf

    def turn(self, steps: Steps) -> float:
        """Return how far a joint of the finest model turns at most [rad].

        Args:
            steps: of the run.

        Raises:
            DidNotConverge: the finest model failed.
        """
        return self._run(self.model, steps).turn

    def _stray(self, model: Model, steps: Steps, near: float) -> float:
        """How far |e| is from its mean over motions so much weaker and stronger."""
        weaker, stronger = (self._peaks(model, steps, 1.0 + part) for part in (-near, near))
        return largest_difference(self._peaks(model, steps), 0.5 * (weaker + stronger))

    def _peaks(self, model: Model, steps: Steps, share: float = 1.0) -> Array:
        """Largest |e| of the joints of a model under so much of the motion."""
        return self._run(model, steps, share).peaks

    def _run(self, model: Model, steps: Steps, share: float = 1.0) -> _Told:
        """What a model tells under so much of the motion, run once."""
        asked = model, steps, share
        if asked not in self._known:
            if model not in self._dead:
                self._dead[model] = dead_load(model)
            run = time_history(
                model,
                self.window if share == 1.0 else self.window.scaled(share),
                damping=self.damping,
                dt=steps.dt,
                tolerance=steps.pace,
                start=self._dead[model],
            )
            self._known[asked] = _Told(peaks_of(run), _turned(run))
            self.told()
        return self._known[asked]


def _turned(run: History) -> float:
    """How far a joint turns at most [rad]."""
    return float(np.abs(run.joints["rotation"]).max())
