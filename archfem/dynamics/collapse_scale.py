"""By what factor a ground motion must be multiplied until the structure falls."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from archfem.annotated import as_annotated
from archfem.arguments import instance
from archfem.dynamics.falling.verdict import Fall
from archfem.dynamics.history import history_of
from archfem.dynamics.scales import (
    COLLAPSE,
    Bracket,
    MechanismScales,
    ScaledRun,
    largest_scale,
    search,
)
from archfem.dynamics.schemes import Viscous
from archfem.dynamics.time_history import time_history
from archfem.errors import DidNotConverge, InvalidInput
from archfem.models.model import Model
from archfem.models.moving import Moving
from archfem.motion.motion import Motion
from archfem.statics.equilibrium import Equilibrium, dead_load
from archfem.tables import aligned

STEPS = (0.005, 0.0025)
"""Time steps by which collapse is looked for: a fall under a record is sensitive to everything, and
what two steps do not agree on is not known [s]."""


@dataclass(frozen=True)
class CollapseScale:
    """Between which scales a structure falls, by several time steps.

    A structure has fallen once it is "partly fallen" or "fallen", as `Fall` says. Response need not
    be monotonic: it may stand where a weaker motion brought it down.

    Attributes:
        searches: for each time step [s] the runs that were made.
    """

    searches: dict[float, MechanismScales]

    def bracket(self, dt: float) -> Bracket:
        """Return what one time step found.

        Args:
            dt: the time step [s].
        """
        return self.searches[dt][COLLAPSE]

    @property
    def lower(self) -> float:
        """Scale up to which it stood by every step, of those tried [-]."""
        return min(self.bracket(dt).lower for dt in self.searches)

    @property
    def upper(self) -> float:
        """Least scale at which it fell by every step [-]; infinite where by some it never did."""
        return max(self.bracket(dt).upper for dt in self.searches)

    @property
    def above(self) -> tuple[float, ...]:
        """Scales at which it stood although it fell at a smaller one."""
        return tuple(sorted({s for dt in self.searches for s in self.bracket(dt).above}))

    def falls(self, dt: float) -> tuple[tuple[float, Fall | None], ...]:
        """Return what each run has left, in order of the scales; None where it was broken off.

        Args:
            dt: the time step [s].
        """
        return tuple((run.scale, run.fall) for run in self.searches[dt].runs)

    def table(self) -> str:
        """One line a run."""
        rows = [
            [
                f"{1e3 * dt:g} ms",
                f"{scale:.3g}",
                fall.kind if fall else "-",
                f"{fall.time:.2f} s" if fall and fall.time is not None else "-",
                f"{fall.residual:.3g} m" if fall else "-",
            ]
            for dt in self.searches
            for scale, fall in self.falls(dt)
        ]
        return aligned(["step", "scale", "the structure", "at", "residual"], rows)


@as_annotated
def collapse_scale(
    model: Model,
    motion: Motion,
    *,
    start: Equilibrium | None = None,
    damping: Viscous | None = None,
    dt: Sequence[float] = STEPS,
    precision: float = 0.05,
    between: tuple[float, float] = (0.1, 10.0),
) -> CollapseScale:
    """Find the least factor on a motion at which a structure falls.

    Scales are sought as by `mechanism_scales`, once for each time step.

    Args:
        model: whose displacements may be large, `build(…, displacements="large")`.
        motion: multiplied as a whole, vertical component included.
        start: the dead load, found first where it is not given.
        damping: as for `time_history`.
        dt: time steps [s].
        precision: relative width of the last brackets [-].
        between: least and largest scale tried [-]; no ground motion may exceed 5 g.

    Returns:
        All runs, with the scales between which it falls by each step.

    Raises:
        InvalidInput: displacements are small, precision, steps or scales cannot be meant.
        DidNotConverge: the structure does not stand under dead load.
    """
    instance(model, Moving, "model", "build it with displacements='large'")
    if not 1e-4 <= precision <= 1.0 or not 0.0 < between[0] <= between[1] or not dt:
        raise InvalidInput(
            f"precision {precision:g} between scales {between} by steps {tuple(dt)}: give 0.0001 "
            "to 1, two scales above 0, the smaller first, and a step or two"
        )
    begin = start or dead_load(model)
    least, largest = between

    def shaken(step: float, scale: float) -> ScaledRun:
        try:
            run = time_history(model, motion.scaled(scale), start=begin, damping=damping, dt=step)
        except DidNotConverge as error:
            run = history_of(error)
        return ScaledRun(scale, {}, run.ended, run.outcome, run.fall)

    limits = (least, max(least, min(largest, largest_scale(motion))))
    return CollapseScale(
        {step: search(partial(shaken, step), (COLLAPSE,), precision, limits) for step in dt}
    )
