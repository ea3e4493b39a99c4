"""Pushover: a load that grows over self-weight until a structure hardly resists any more."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np
import xarray as xr
from scipy import sparse
from scipy.sparse.linalg import splu

from archfem.actions import BodyForce, PointLoad
from archfem.criteria import HINGE, hinged
from archfem.errors import DidNotConverge, InvalidInput
from archfem.models import Model
from archfem.newton import magnitude
from archfem.resultants import joint_dataset
from archfem.statics import Equilibrium, dead_load, self_weight
from archfem.structure import Array

CONTROLS = ("displacement", "arc length", "force")

TOLERANCE, ROUGHLY, ITERATIONS = 1e-9, 1e-7, 30
"""Force left out of balance, relative to the sum of all loads; the same where round-off of large
motions is above that; Newton's iterations in a step."""

FIRST, GROWTH, SMALLEST = 1e-6, 1.1, 1e-3
"""First displacement relative to the structure's size, growth of steps, and the smallest step,
relative to the first, to which they are halved before giving up."""


FLAT, STEEP = 1e-6, 0.2
"""Growth of the factor in the last step below which the limit has been reached, and the largest
extrapolation beyond the last factor; both relative to it."""


@dataclass(frozen=True, kw_only=True)
class Stop:
    """When a pushover ends, whichever comes first.

    Attributes:
        slope: tangent of the curve relative to its initial tangent [-].
        displacement: of the loaded point, relative to the structure's size [-].
        hinges: number of hinged joints, or None not to count them.
        steps: number of steps.
    """

    slope: float = 1e-6
    displacement: float = 0.1
    hinges: int | None = None
    steps: int = 400

    def __post_init__(self) -> None:
        """Refuse what would stop at once, or never."""
        if not 0.0 <= self.slope < 1.0:
            raise InvalidInput(f"slope {self.slope:.3g} is not between 0 and 1")
        if not (self.displacement > 0.0 and self.steps >= 1):
            raise InvalidInput(
                f"displacement {self.displacement:.3g} and steps {self.steps} must be above 0"
            )


@dataclass(frozen=True, eq=False)
class Pushover:
    """What a pushover found.

    Attributes:
        curve: over step, the factor [-], the displacement of the load along itself since the dead
            load [m], and Newton's iterations; step 0 is the dead load.
        joints: N, V, M and what follows over step and joint.
        hinges: joints in the order in which they first hinge, with the face that stays in contact.
        outcome: the rule by which it ended, in words.
        limit: factor that the curve tends to, by extrapolation [-]; undefined (NaN) where it is
            still too steep to tell.
        uncertainty: of `limit`: how far beyond the last factor it was extrapolated [-].
    """

    curve: xr.Dataset
    joints: xr.Dataset
    hinges: tuple[tuple[int, str], ...]
    outcome: str
    limit: float
    uncertainty: float

    @property
    def factor(self) -> float:
        """Largest factor that was reached [-]."""
        return float(self.curve["factor"].max())


def pushover(
    model: Model,
    load: BodyForce | PointLoad | Sequence[BodyForce | PointLoad],
    *,
    control: str = "displacement",
    start: Equilibrium | None = None,
    stop: Stop | None = None,
) -> Pushover:
    """Let a load grow over the dead load, and follow the equilibrium.

    In each step the unknowns are q and the factor λ, with one more equation,

        f(q) = f_dead + λ f_live,   a d(q) / d_1 + b λ / λ_1 = s,

    where d = f_live·q / |f_live| is the displacement of the load along itself: a = 0 is control by
    force, b = 0 by displacement, and for arc length (a, b) is the direction of the last step, in
    units of the first, so that it turns from one to the other as the curve bends (Riks). Steps
    grow by a tenth each, and are halved where Newton's method fails.

    Displacements are small and the joint law is the gradient of a convex energy: the curve never
    falls nor snaps back, but rises to the limit of rigid blocks as an asymptote. The thrust at a
    hinge nears the edge as the square root of its turning, whence the extrapolation

        λ = λ_limit - C d^(-1/2).

    Args:
        model: any rung of the ladder.
        load: one action, or several that grow together.
        control: "displacement", "arc length" or "force".
        start: the dead load's equilibrium, found first if not given.
        stop: when to end.

    Raises:
        InvalidInput: control is unknown, the load misses the structure or is zero.
        DidNotConverge: the structure does not stand under its own weight, or no first step.

    References:
        Riks, Int. J. Solids Struct. 15 (1979) 529-551.
    """
    if control not in CONTROLS:
        raise InvalidInput(f"control {control!r} is not known: use one of {CONTROLS}")
    actions = [load] if isinstance(load, BodyForce | PointLoad) else list(load)
    path = _Path.of(model, actions, start or dead_load(model))
    outcome = _follow(path, control, stop or Stop())
    return _read(path, outcome)


@dataclass(eq=False)
class _Path:
    """Equilibria found so far, and what is needed for the next.

    Attributes:
        dead, live: generalised forces (n,).
        probe: displacement of the load along itself is probe·(q - q_0) (n,).
        unit: displacement and factor of the first step of an elastic structure.
    """

    model: Model
    dead: Array
    live: Array
    probe: Array
    unit: tuple[float, float]
    states: list[Array]
    factors: list[float]
    iterations: list[int]

    @classmethod
    def of(
        cls, model: Model, actions: Sequence[BodyForce | PointLoad], start: Equilibrium
    ) -> "_Path":
        live = sum((model.load(action) for action in actions), np.zeros(model.size))
        size = sum(_size(model, action) for action in actions)
        if size == 0.0:
            raise InvalidInput("the load is zero: give it a force or a multiple of g")
        probe = live / size
        first = FIRST * model.structure.size
        give = float(probe @ splu(model.tangent(start.q).tocsc()).solve(live))
        unit = (first, first / give)
        return cls(model, self_weight(model), live, probe, unit, [start.q], [0.0], [0])

    @property
    def displacements(self) -> Array:
        """Of the load along itself, since the dead load (steps,) [m]."""
        return np.array([self.probe @ (q - self.states[0]) for q in self.states])

    def advance(self, border: Array, distance: float) -> bool:
        """Add the equilibrium at a distance along the border's direction; whether there is one.

        Args:
            border: a / d_1 and b / λ_1 of the further equation (2,).
            distance: its right side, from the last state on.
        """
        row = sparse.csr_matrix(np.append(border[0] * self.probe, border[1]))
        column = sparse.csr_matrix(-self.live[:, None])
        x = np.append(self.states[-1], self.factors[-1])
        target = row @ x + distance
        for iteration in range(ITERATIONS):
            tangent = self.model.tangent(x[:-1])
            rest, ahead = self._rest(x), target - row @ x
            if abs(ahead) <= TOLERANCE * distance and self._fits(rest, x, tangent):
                self.states.append(x[:-1])
                self.factors.append(float(x[-1]))
                self.iterations.append(iteration)
                return True
            matrix = sparse.vstack([sparse.hstack([tangent, column]), row], "csc")
            try:
                x = x + splu(matrix).solve(np.append(rest, ahead))
            except RuntimeError:  # SuperLU: exactly singular
                return False
        return False

    def _rest(self, x: Array) -> Array:
        """Forces out of balance at q and λ in one (n,)."""
        return self.dead + x[-1] * self.live - self.model.force(x[:-1])

    def _fits(self, rest: Array, x: Array, tangent: sparse.csr_matrix) -> bool:
        """Whether forces are in balance, or off by no more than round-off of large motions."""
        load = magnitude(self.dead) + abs(x[-1]) * magnitude(self.live)
        rounding = 8.0 * np.finfo(float).eps * magnitude(abs(tangent) @ abs(x[:-1]))
        return magnitude(rest) <= min(max(TOLERANCE * load, rounding), ROUGHLY * load)


def _follow(path: _Path, control: str, stop: Stop) -> str:
    """Add states until a rule ends it, and say which."""
    distance, direction = 1.0, np.array([1.0, 1.0]) / np.sqrt(2.0)
    fixed = {"displacement": np.array([1.0, 0.0]), "force": np.array([0.0, 1.0])}
    while True:
        border = fixed.get(control, direction) / np.array(path.unit)
        if not path.advance(border, distance):
            distance /= 2.0
            if distance < SMALLEST:
                return _stuck(path, control)
            continue
        moved = np.array([np.diff(path.displacements[-2:])[0], np.diff(path.factors[-2:])[0]])
        moved /= np.array(path.unit)
        direction = moved / np.linalg.norm(moved)
        if reason := _finished(path, stop, moved):
            return reason
        distance *= GROWTH


def _finished(path: _Path, stop: Stop, moved: Array) -> str | None:
    """The rule that is met, in words, or None."""
    slope, reached = float(moved[1] / moved[0]), float(path.displacements[-1])
    if slope <= stop.slope:
        return f"the slope fell to {slope:.2g} of the initial one"
    if reached >= stop.displacement * path.model.structure.size:
        return f"the load moved by {reached:.3g} m"
    joints = joint_dataset(path.model.structure, path.model.resultants(path.states[-1]))
    count = int((hinged(joints) != 0).sum())
    if stop.hinges is not None and count >= stop.hinges:
        return f"{count} joints hinge"
    return f"{stop.steps} steps were taken" if len(path.states) > stop.steps else None


def _stuck(path: _Path, control: str) -> str:
    """Say that no further equilibrium was found; under force control that is the limit."""
    if len(path.states) == 1:
        raise DidNotConverge("no equilibrium just after the dead load: the structure hardly stands")
    what = "the load cannot grow beyond" if control == "force" else "no equilibrium was found past"
    return f"{what} a factor of {path.factors[-1]:.5g}"


def _read(path: _Path, outcome: str) -> Pushover:
    """Label what was found."""
    structure, count = path.model.structure, len(path.states)
    resultants = np.array([path.model.resultants(q) for q in path.states])
    joints = joint_dataset(structure, resultants, np.arange(count, dtype=float))
    joints = joints.rename(time="step").assign_coords(step=np.arange(count))
    curve = xr.Dataset(
        {
            "factor": ("step", np.array(path.factors), {"units": "1"}),
            "displacement": ("step", path.displacements, {"units": "m"}),
            "iterations": ("step", np.array(path.iterations)),
        },
        {"step": np.arange(count)},
    )
    limit, uncertainty = _extrapolated(path.displacements, np.array(path.factors))
    return Pushover(curve, joints, _hinge_order(joints), outcome, limit, uncertainty)


def _hinge_order(joints: xr.Dataset) -> tuple[tuple[int, str], ...]:
    """Joints by the step at which they first hinge; within a step, those nearer the edge first."""
    side = hinged(joints, HINGE).transpose("step", "joint").values
    first = np.argmax(side != 0, axis=0)
    e = np.abs(joints["eccentricity"].transpose("step", "joint").values)
    order = sorted(np.flatnonzero(side.any(axis=0)), key=lambda j: (first[j], -e[first[j], j]))
    return tuple((int(j), "extrados" if side[first[j], j] > 0 else "intrados") for j in order)


def _extrapolated(displacements: Array, factors: Array) -> tuple[float, float]:
    """Limit of λ = λ_limit - C d^(-1/2), and how far the curve is below it.

    Taken over the last doubling of d, since points of a joint open one by one. While part of d is
    elastic it is too high, so that the limit lies in between; a flat last step has reached it.
    """
    last, before = float(factors[-1]), float(factors[-2])
    if last - before <= FLAT * last:
        return last, FLAT * last
    half = min(int(np.searchsorted(displacements, 0.5 * displacements[-1])), len(factors) - 2)
    x = np.maximum(displacements, displacements[1]) ** -0.5
    beyond = (last - float(factors[half])) * x[-1] / (x[half] - x[-1])
    return (last + beyond, beyond) if beyond <= STEEP * last else (float("nan"), float("nan"))


def _size(model: Model, action: BodyForce | PointLoad) -> float:
    """Size of an action [N]."""
    if isinstance(action, PointLoad):
        return hypot(*action.force)
    return model.structure.weight * hypot(action.horizontal, action.vertical)
