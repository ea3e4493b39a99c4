"""What a model and its steps err by, measured on the strongest part of a motion.

The largest |e| of every joint is compared, since that is what hinges are judged by. With P(m, s)
those of a model m in steps s, the truth is nearer than

    |P(m, s) - P(best, s)| + |P(best, s) - P(best, 0)|

to P(m, s): what the model errs by, and what the steps do. Both models of the first part take the
same steps, so that it is of the model alone. The second part is found from steps s/2, by which the
error of a scheme of second order falls to a quarter (Richardson): it is 4/3 of the difference.
"""

from dataclasses import dataclass, field

import numpy as np

from archfem.arrays import Array
from archfem.dynamics.probe import largest_difference, peaks
from archfem.dynamics.schemes import Viscous
from archfem.errors import DidNotConverge
from archfem.models.model import Model
from archfem.motion.motion import Motion
from archfem.statics.equilibrium import Equilibrium, dead_load

SAFETY = 1.5
"""By how much an error elsewhere in the motion may exceed that in the window. With it, what was
predicted of eight arches and columns, a motion each, was 1.0 to 2.7 times what came about; of a
slender block that rocks on one joint 0.2 times: a model may agree in the window by luck."""

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
class Yardstick:
    """The finest model under the strongest part of a motion, with which others are compared.

    Attributes:
        model: the finest.
        window: the part of the motion.
        damping: of all runs.
    """

    model: Model
    window: Motion
    damping: Viscous | None
    _known: dict[Steps, Array] = field(default_factory=dict)
    _dead: list[Equilibrium] = field(default_factory=list)

    def in_time(self, steps: Steps) -> float:
        """Return the error of steps in the largest |e| of a joint, whatever the model [-].

        Args:
            steps: of the run.

        Raises:
            DidNotConverge: the finest model failed.
        """
        return SAFETY * RICHARDSON * largest_difference(self._own(steps), self._own(steps.halved))

    def in_model(self, model: Model, steps: Steps) -> float:
        """Return the error of a model in the largest |e| of a joint; infinite where it fails [-].

        Args:
            model: to be compared.
            steps: of the run.

        Raises:
            DidNotConverge: the finest model failed.
        """
        try:
            found = peaks(model, self.window, self.damping, steps.dt, tolerance=steps.pace)
        except DidNotConverge:
            return np.inf
        return SAFETY * largest_difference(found, self._own(steps))

    def _own(self, steps: Steps) -> Array:
        """Largest |e| of the joints of the finest model, found once."""
        if not self._dead:
            self._dead.append(dead_load(self.model))
        if steps not in self._known:
            self._known[steps] = peaks(
                self.model,
                self.window,
                self.damping,
                steps.dt,
                tolerance=steps.pace,
                start=self._dead[0],
            )
        return self._known[steps]
