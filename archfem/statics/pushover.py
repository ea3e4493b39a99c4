"""Pushover: a load grows, or a support moves, until a structure hardly resists any more."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from archfem.arguments import instance
from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.joints.criteria import Criteria, flagged
from archfem.joints.resultants import joint_dataset, one_joint
from archfem.masonry.actions import BodyForce, PointLoad, Settlement, loads
from archfem.models.model import Model, check_model
from archfem.models.moving import Moving
from archfem.shown import Shown
from archfem.statics.ends import Path, Stop
from archfem.statics.equilibrium import Equilibrium, dead_load
from archfem.statics.following import GROWTH, follow
from archfem.statics.path import LoadPath
from archfem.statics.support_path import SupportPath
from archfem.threads import on_one_thread

CONTROLS = ("displacement", "arc length", "path", "force")

FLAT, STEEP = 1e-6, 0.2
"""Growth of the factor in the last step below which the limit has been reached, and the largest
extrapolation beyond the last factor; both relative to it."""


@dataclass(frozen=True, eq=False, repr=False)
class Pushover(Shown, picture="pushover.draw_pushover"):
    """What a pushover found.

    Attributes:
        curve: over step, the factor [-], the displacement of the load along itself since the dead
            load [m], and Newton's iterations; step 0 is the dead load. For a settlement the
            displacement is that of the support's fastest corner, and the factor the work of the
            weights on a unit of the settlement, as `collapse_factor` has it [N m].
        joints: N, V, M and what follows over step and joint.
        hinges: joints in the order in which they first hinge, with the face that stays in contact.
        hinge_steps: the step at which each of them does.
        outcome: the rule by which it ended, in words.
        limit: factor that the curve tends to, by extrapolation [-]; undefined (NaN) where it is
            still too steep to tell.
        uncertainty: of `limit`: how far beyond the last factor it was extrapolated [-].
    """

    curve: xr.Dataset
    joints: xr.Dataset
    hinges: tuple[tuple[int, str], ...]
    hinge_steps: tuple[int, ...]
    outcome: str
    limit: float
    uncertainty: float

    @property
    def factor(self) -> float:
        """Factor that was reached at last; under a load that is also the largest."""
        return float(self.curve["factor"][-1])

    def _words(self) -> str:
        """What it is, in a line or two."""
        steps, known = self.curve.sizes["step"] - 1, np.isfinite(self.limit)
        beyond = f", tends to {self.limit:.4g} ± {self.uncertainty:.2g}" if known else ""
        return (
            f"Pushover: factor {self.factor:.4g} after {steps} steps{beyond}, "
            f"{len(self.hinges)} hinges; {self.outcome}"
        )

    def joint(self, joint: str | int) -> xr.Dataset:
        """Return what one joint carries over the steps.

        Args:
            joint: its name or number.

        Raises:
            InvalidInput: there is no such joint.
        """
        return one_joint(self.joints, joint)


@on_one_thread
def pushover(
    model: Model,
    load: BodyForce | PointLoad | Settlement | Sequence[BodyForce | PointLoad],
    *,
    control: str = "displacement",
    start: Equilibrium | None = None,
    stop: Stop | None = None,
    criteria: Criteria | None = None,
) -> Pushover:
    """Let a load grow over the dead load, and follow the equilibrium.

    In each step the unknowns are q and the factor λ, with one more equation,

        f(q) = f_dead + λ f_live,   a d(q) / d_1 + b λ / λ_1 = s,

    where d = f_live·q / |f_live| is the displacement of the load along itself: a = 0 is control by
    force, b = 0 by displacement, and for arc length (a, b) is the direction of the last step, in
    units of the first, so that it turns from one to the other as the curve bends (Riks). Steps
    grow by a tenth each. Where Newton's method fails and joints slide, as those of fill in pieces
    do, the load grows by itself, and the structure creeps to rest under it; else steps are halved.

    Displacements are small and the joint law is the gradient of a convex energy: the curve never
    falls nor snaps back, but rises to the limit of rigid blocks as an asymptote. The thrust at a
    hinge nears the edge as the square root of its turning, whence the extrapolation

        λ = λ_limit - C d^(-1/2).

    Bonds break between steps, so that with them the curve does fall; follow it by displacement.

    A *settlement* moves a support instead, under the dead load alone. What changes is the force
    with which the structure holds it back, and it tends to that of the limit state which resists
    the settlement least: spreading supports bring an arch to its least thrust.

    Args:
        model: any rung of the ladder.
        load: one action, or several that grow together; a `Settlement` comes alone.
        control: "displacement", "arc length", "path" or "force"; "path" goes on across the last
            step in all coordinates, and so follows what snaps back where displacements are large.
        start: the dead load's equilibrium, found first if not given.
        stop: when to end.
        criteria: what makes a joint hinge; by default the usual ones.

    Returns:
        The curve, the joints along it, and the limit that it tends to.

    Raises:
        InvalidInput: control is unknown, or not by displacement for a settlement; the load misses
            the structure or is zero.
        DidNotConverge: the structure does not stand under its own weight, or no first step.

    References:
        Riks, Int. J. Solids Struct. 15 (1979) 529-551.
    """
    check_model(model)
    if control not in CONTROLS:
        raise InvalidInput(f"control {control!r} is not known: use one of {CONTROLS}")
    for value, kind in ((start, Equilibrium), (stop, Stop), (criteria, Criteria)):
        if value is not None:
            instance(value, kind, kind.__name__.lower(), f"give a {kind.__name__}")
    begin = start or dead_load(model)
    model = begin.continued(model)
    path: Path
    if isinstance(load, Settlement):
        if control != "displacement":
            raise InvalidInput(f"a settlement is a displacement: control {control!r} has no force")
        path = SupportPath.of(model, load, begin)
    else:
        actions = loads(load)
        path = LoadPath.of(model, actions, begin)
    criteria = criteria or Criteria()
    return _read(path, criteria, follow(path, control, stop or Stop(), criteria))


def _read(path: Path, criteria: Criteria, outcome: str) -> Pushover:
    """Label what was found."""
    count, factors = len(path.states), np.array(path.factors)
    steps = np.arange(count, dtype=float)
    structure, faces = path.model.structure, path.faces
    moved = isinstance(path.model, Moving)
    joints = joint_dataset(structure, path.resultants, steps, criteria, faces=faces, moved=moved)
    joints = joints.rename(time="step").assign_coords(step=np.arange(count))
    curve = xr.Dataset(
        {
            "factor": ("step", factors, {"units": path.units}),
            "displacement": ("step", path.displacements, {"units": "m"}),
            "iterations": ("step", np.array(path.iterations)),
        },
        {"step": np.arange(count)},
    )
    limit, uncertainty = _extrapolated(path.displacements, factors)
    return Pushover(curve, joints, *hinge_order(joints), outcome, limit, uncertainty)


def hinge_order(
    joints: xr.Dataset, criteria: Criteria | None = None
) -> tuple[tuple[tuple[int, str], ...], tuple[int, ...]]:
    """Sort joints by the step at which they first hinge; in a step, those nearer the edge first.

    Args:
        joints: over step and joint, as of a `Pushover`.
        criteria: by default those by which the joints were judged already.

    Returns:
        Joints with the face that stays in contact, and the steps.
    """
    joints = flagged(joints, criteria)
    side = joints["hinge"].transpose("step", "joint").values
    first = np.argmax(side != 0, axis=0)
    e = np.abs(joints["eccentricity"].transpose("step", "joint").values)
    order = sorted(np.flatnonzero(side.any(axis=0)), key=lambda j: (first[j], -e[first[j], j]))
    faces = {1: "extrados", -1: "intrados"}
    hinges = tuple((int(j), faces[int(side[first[j], j])]) for j in order)
    return hinges, tuple(int(first[j]) for j in order)


def _shortness(displacements: Array) -> float:
    """How much shorter the last step is than one that grows as usual, at least 1 [-]."""
    last, step = float(displacements[-1]), float(displacements[-1] - displacements[-2])
    return max(1.0, (1.0 - 1.0 / GROWTH) * last / step) if step > 0.0 else 1.0


def _extrapolated(displacements: Array, factors: Array) -> tuple[float, float]:
    """Return the limit of λ = λ_limit - C d^(-1/2), and how far from it the curve ends.

    Taken over the last doubling of d, since points of a joint open one by one. While part of d is
    elastic it is too high, so that the limit lies in between; a flat last step has reached it.
    """
    last, before = float(factors[-1]), float(factors[-2])
    grown = abs(last - before) * _shortness(displacements)
    if grown <= FLAT * abs(last):
        return last, FLAT * abs(last)
    if len(factors) == 2:  # one step tells no curve
        return float("nan"), float("nan")
    half = min(int(np.searchsorted(displacements, 0.5 * displacements[-1])), len(factors) - 2)
    x = np.maximum(displacements, displacements[1]) ** -0.5
    beyond = (last - float(factors[half])) * x[-1] / (x[half] - x[-1])
    if abs(beyond) > STEEP * abs(last):
        return float("nan"), float("nan")
    return last + beyond, abs(beyond)
