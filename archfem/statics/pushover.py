"""Pushover: a load grows, or a support moves, until the structure resists no more.

`continuation` adds one equilibrium after the other. This module has the length of the steps,
relaxation where they fail and joints slide, stopping rules, and the extrapolation of the limit.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from archfem._display import ResultDisplay
from archfem._threads import single_threaded
from archfem._typing import Array
from archfem._validation import check_between, check_choice, check_fields, check_type
from archfem.errors import DidNotConverge, InvalidInput
from archfem.joints.criteria import Criteria
from archfem.joints.resultants import joint_dataset, select_joint
from archfem.masonry.loads import Action, BodyForce, PointLoad, Settlement, list_loads
from archfem.models.model import Model
from archfem.statics.continuation import LoadPath, SupportPath
from archfem.statics.equilibrium import Equilibrium, Subject, resolve_start

Path = LoadPath | SupportPath

# Growth of steps from one to the next [-]
STEP_GROWTH = 1.1

# Steps over which a path whose joints slide must progress. Other paths also take many small steps,
# as about a hinge that moves from joint to joint.
STAGNATION_STEPS = 40

# Steps of so little progress after which relaxation decides whether the load can grow
FEW_STEPS = 15

# Begin of the outcome of such a path
CRAWLS = "it crawls"

# Begin of the outcome of one that was not followed further
NOT_FOUND = "no equilibrium was found past"

# Outcome of a path whose load would have to turn round
LOST = "it bears no load any more"

# Smallest relative load increment of relaxation, to which failed trials are halved: the accuracy of
# the limit [-]
MIN_RELAXATION_LOAD_STEP = 0.002


@dataclass(frozen=True, kw_only=True)
class Stop:
    """Rules that end a pushover, the first one that is met.

    Attributes:
        slope: tangent of the curve relative to its initial tangent [-]; with large displacements
            control by "path" continues past the peak, and the slope does not end it.
        displacement: displacement of the loaded point over the structure's size, `Structure.size`
            [-]: 0.1 is a tenth of it.
        hinges: number of hinged joints, or None not to count them.
        steps: number of steps.
    """

    slope: float = 1e-6
    displacement: float = 0.1
    hinges: int | None = None
    steps: int = 400

    def __post_init__(self) -> None:
        """Refuse rules that are met at once, or never."""
        check_fields(self)
        check_between(self.slope, "slope [-]", 0.0, 1.0, ends="[)")
        if not (self.displacement > 0.0 and self.steps >= 1):
            raise InvalidInput(
                f"displacement {self.displacement:.3g} and steps {self.steps} must be above 0"
            )


@dataclass(frozen=True, eq=False, repr=False)
class Pushover(ResultDisplay):
    """Result of a pushover: curve, joints and limit.

    Attributes:
        curve: over step, the factor [-], the displacement of the load along itself since the dead
            load [m], and the number of Newton iterations; step 0 is the dead load. For a settlement
            the displacement is that of the support's fastest corner. The factor is then the work of
            the weights on a unit of the settlement, as in `collapse_factor` [N m].
        joints: N, V, M and derived quantities over step and joint.
        hinges: joints in the order in which they first hinge, with the face that stays in contact.
        hinge_steps: step at which each of them first hinges.
        outcome: rule that ended the pushover, as text.
        limit: limit of the factor, by extrapolation of the curve [-]; undefined (NaN) where it is
            still too steep, crawls as joints slide, or is lost under large displacements.
        uncertainty: distance of `limit` from the last factor [-].
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
        """Largest factor under a load; of a settlement that of the last step.

        The curve falls after it where bonds break, displacements are large or joints have slid.
        """
        factors = self.curve["factor"]
        return float(factors.max() if factors.units == "1" else factors[-1])

    def _summary(self) -> str:
        """Describe the pushover in one or two lines."""
        return f"Pushover: {self.sentence}"

    @property
    def sentence(self) -> str:
        """Factor, its limit, number of hinges and end, in words."""
        steps, limit = self.curve.sizes["step"] - 1, ""
        end = float(self.curve["factor"][-1])
        last = "" if end == self.factor else f", at the end {end:.4g}"
        if np.isfinite(self.limit):
            limit = f", tends to {self.limit:.4g} ± {self.uncertainty:.2g}"
        return (
            f"factor {self.factor:.4g} after {steps} steps{limit}{last}, "
            f"{len(self.hinges)} hinge{'s' if len(self.hinges) != 1 else ''}; {self.outcome}"
        )

    def joint(self, joint: str | int) -> xr.Dataset:
        """Return the resultants and the displacements of one joint over the steps.

        Args:
            joint: its name or number.

        Raises:
            InvalidInput: there is no such joint.
        """
        return select_joint(self.joints, joint)


@single_threaded
def pushover(
    model: Model | Subject,
    live: BodyForce | PointLoad | Settlement | Sequence[BodyForce | PointLoad],
    *,
    control: str = "displacement",
    start: Equilibrium | None = None,
    stop: Stop | None = None,
    criteria: Criteria | None = None,
    dead: Sequence[Action] = (),
) -> Pushover:
    """Let a load grow over the dead load, and follow the equilibrium.

    In each step the unknowns are q and the factor λ, with one more equation:

        f(q) = f_dead + λ f_live,   a d(q) / d_1 + b λ / λ_1 = s.

    Here d = f_live·q / F is the displacement of the load along itself, with F the sum of the sizes
    of its forces: the mean of their points, weighted by them. Control is by force
    where a = 0, by displacement where b = 0. For arc length, (a, b) is the direction of the last
    step, in units of the first. Control then turns from one to the other as the curve bends (Riks).
    Steps grow by a tenth each. Where Newton's method fails and joints slide, as those of fill in
    pieces do, the load grows by itself. The structure is then relaxed to rest under it; else steps
    are halved.

    Displacements are small and the joint law is the gradient of a convex energy: the curve never
    falls nor snaps back, but rises to the limit of rigid blocks as an asymptote. The thrust at a
    hinge nears the edge as the square root of its turning, whence the extrapolation

        λ = λ_limit - C d^(-1/2).

    Bonds break or soften between steps, so that with them the curve does fall; control by "path" is
    then by "arc length", and that by displacement where it falls.

    A *settlement* moves a support instead, under the dead load alone. The force of the structure on
    it changes, and tends to that of the limit state with the least resistance to the settlement.
    Spreading supports bring an arch to its least thrust.

    Args:
        model: model of any fidelity, or an `archfem.Analysis`.
        live: one action, or several that grow together; a `Settlement` stands alone.
        control: "displacement", "arc length", "path" or "force"; "path" continues normal to the
            last step in all coordinates, and so follows snap-back where displacements are large.
        start: the dead load's equilibrium, computed first if not given.
        stop: rules that end the pushover.
        criteria: conditions of a hinge; by default the usual ones.
        dead: loads that act beside self-weight and do not grow, such as that of a press. They are
            applied at `start`, before the live load.

    Returns:
        The curve, the joints along it, and its limit.

    Raises:
        InvalidInput: control is unknown, or not by displacement for a settlement; the load misses
            the structure or is zero.
        DidNotConverge: the structure does not stand under its own weight or the other dead loads,
            or there is no first step.

    References:
        Riks, Int. J. Solids Struct. 15 (1979) 529-551.
    """
    check_choice(control, "control", ("displacement", "arc length", "path", "force"))
    for value, kind in ((start, Equilibrium), (stop, Stop), (criteria, Criteria)):
        if value is not None:
            check_type(value, kind, kind.__name__.lower(), f"give a {kind.__name__}")
    model, begin = resolve_start(model, start)
    assert isinstance(begin, Equilibrium)
    model, held = begin.transfer_memory(model), None
    if dead:
        loading = LoadPath.of(model, list_loads(dead), begin)
        loading.advance_to_whole()
        model, held = loading.model, loading.load
        begin = replace(begin, model=model, q=loading.states[-1])
    path: Path
    if isinstance(live, Settlement):
        if control != "displacement":
            raise InvalidInput(f"a settlement is a displacement: control {control!r} has no force")
        path = SupportPath.of(model, live, begin, held)
    else:
        path = LoadPath.of(model, list_loads(live), begin, held)
        if control == "path" and path.model.operator is not None and path.model.operator.bonds:
            control = "arc length"  # a bond breaks at once: no path leads through that
    criteria = criteria or Criteria()
    return _label_result(path, criteria, follow(path, control, stop or Stop(), criteria))


def follow(path: Path, control: str, stop: Stop, criteria: Criteria) -> str:
    """Add states until a rule ends the path, and return this rule as text."""
    # normals (displacement, factor) of the added equation; that of arc length turns with the curve
    fixed = {"displacement": np.array([1.0, 0.0]), "force": np.array([0.0, 1.0])}
    min_distance, easy_iterations, easy_growth = 1e-3, 4, 1.4
    distance, direction = 1.0, np.array([1.0, 1.0]) / np.sqrt(2.0)
    taken: list[float] = []
    if control == "path" and path.model.large_displacements:
        stop = replace(stop, slope=0.0)
    relaxation = _StepRelaxation(path, criteria, stop.displacement * path.model.structure.size)
    while True:
        border = fixed.get(control, direction)
        if control == "path" and isinstance(path, LoadPath):
            is_added = path.advance_normal(distance)
        else:
            # where the last step had to be relaxed, this one has to be, too
            ways = [path.advance, relaxation.advance][:: -1 if relaxation.is_last else 1]
            is_added = any(advance(border, distance) for advance in ways)
        if not is_added:
            distance /= 2.0
            if distance < min_distance or _has_reached_bound(path):
                reason = continue_by_relaxation(path, stop, criteria)
                return reason or failure_message(path, control, criteria)
            continue
        step = _last_step(path)
        # small displacements lose load where bonds break alone: the way back would unload the rest
        loses = step[1] < 0.0 and not path.model.large_displacements
        direction = fixed["displacement"] if loses else step / np.linalg.norm(step)
        if reason := stop_reason(path, stop, criteria, step):
            return reason
        if _is_stagnating(path, 0.02, FEW_STEPS) and sliding_joints(path, criteria):
            reason = continue_by_relaxation(path, stop, criteria, 0.01)
            return reason or _crawl_message(path, FEW_STEPS, "fiftieth")
        taken.append(distance)
        is_easy = control == "path" and path.iterations[-1] <= easy_iterations
        distance *= easy_growth if is_easy else STEP_GROWTH
        if control == "path":
            distance = min(distance, _resolve_peak(path.factors, taken))


def _resolve_peak(
    factors: Sequence[float] | Array, taken: list[float], accuracy: float = 5e-4
) -> float:
    """Return the longest step that does not miss the peak by more than a share of it."""
    highest = max(factors)
    if len(factors) < 3 or factors[-1] < 0.97 * highest:
        return np.inf
    # a parabola through both ends of a step d rises above them by its second derivative × d²/8
    slopes = np.diff(factors[-3:]) / taken[-2:]
    bend = 2.0 * abs(slopes[1] - slopes[0]) / sum(taken[-2:])
    longest = float(np.sqrt(8.0 * accuracy * highest / max(bend, np.finfo(float).tiny)))
    return max(longest, 0.5 * taken[-1])


def _last_step(path: Path) -> Array:
    """Return displacement and factor of the last step, in units of the first (2,)."""
    last = np.array([path.displacements[-2:], path.factors[-2:]])
    return np.diff(last)[:, 0] / np.array(path.unit)


def stop_reason(path: Path, stop: Stop, criteria: Criteria, step: Array) -> str | None:
    """Return the rule that is met after a step, as text, or None."""
    slope, displacement = abs(float(step[1] / step[0])), float(path.displacements[-1])
    is_flat = slope <= stop.slope
    is_far = displacement >= stop.displacement * path.model.structure.size
    if path.factors[-1] <= 0.0 and path.units == "1":
        # under small displacements only bonds that broke push back, until the dry joints bear
        if is_flat or is_far or path.model.large_displacements:
            return LOST
    elif is_flat:
        return f"the slope fell to {slope:.2g} of the initial one"
    elif is_far:
        return f"the {path.moving} moved by {displacement:.3g} m"
    if stop.hinges is not None:
        count = int((_last_joints(path, criteria)["hinge"] != 0).sum())
        if count >= stop.hinges:
            return f"{count} joints hinge"
    # Share of all displacement by which the path must progress. How fast it crawls depends on
    # round-off, so that most paths that take all their steps crawl.
    is_last = len(path.states) > stop.steps
    if _is_stagnating(path, 0.1 if is_last else 0.01) and sliding_joints(path, criteria):
        return _crawl_message(path, STAGNATION_STEPS, "tenth")
    return f"{stop.steps} steps were taken" if is_last else None


def _crawl_message(path: Path, steps: int, part: str) -> str:
    """Say that a path makes no progress."""
    return (
        f"{CRAWLS}: in {steps} steps the {path.moving} moved by less than a {part} of "
        f"{path.displacements[-1]:.3g} m, and the factor went no further than "
        f"{path.factors[-1]:.5g}"
    )


def _is_stagnating(path: Path, share: float, steps: int = STAGNATION_STEPS) -> bool:
    """Return whether displacement and factor change too little, although each step has a state."""
    if len(path.states) <= steps:
        return False
    before, after = path.displacements[[-steps, -1]]
    first, last = np.array(path.factors)[[-steps, -1]]
    change = abs(last - first) / max(abs(last), np.finfo(float).tiny)
    return bool(after - before <= share * after and change <= MIN_RELAXATION_LOAD_STEP)


def _has_reached_bound(path: Path) -> bool:
    """Return whether limit analysis proves that the load grows by less than relaxation resolves."""
    if not isinstance(path, LoadPath) or path.factors[-1] <= 0.0:
        return False
    return path.bound / path.factors[-1] - 1.0 <= MIN_RELAXATION_LOAD_STEP


def sliding_joints(path: Path, criteria: Criteria) -> list[str]:
    """Return the names of the joints that slide in the last state."""
    joints = _last_joints(path, criteria)
    return [str(name) for name in joints["name"].values[joints["slide"].values]]


def _last_joints(path: Path, criteria: Criteria) -> xr.Dataset:
    """Return the joints in the last state."""
    return joint_dataset(path.model.structure, path.joint_forces[-1], criteria=criteria)


def continue_by_relaxation(
    path: Path, stop: Stop, criteria: Criteria, share: float = 0.05
) -> str | None:
    """Load a structure whose joints slide further by relaxation; return the rule that ended it.

    The first trial is by a share of the load.
    """
    if not (isinstance(path, LoadPath) and len(path.states) > 1 and sliding_joints(path, criteria)):
        return None
    farthest = stop.displacement * path.model.structure.size
    # no state is sought beyond what limit analysis proves to be the most
    while (share := min(share, path.bound / path.factors[-1] - 1.0)) > MIN_RELAXATION_LOAD_STEP:
        if not path.advance_by_relaxation(share * path.factors[-1], farthest):
            share /= 2.0
        elif reason := stop_reason(path, stop, criteria, _last_step(path)):
            return reason
    return None


def failure_message(path: Path, control: str, criteria: Criteria) -> str:
    """Return a message that no equilibrium follows, and which joints slide in the last one."""
    if len(path.states) == 1:
        raise DidNotConverge("no equilibrium just after the dead load: the structure hardly stands")
    slides = sliding_joints(path, criteria) if isinstance(path, LoadPath) else []
    is_limit = control == "force" or (slides and control != "path")
    message = "the load cannot grow beyond" if is_limit else NOT_FOUND
    message += f" a factor of {path.factors[-1]:.5g}"
    if slides:
        message += f", at which {len(slides)} joints slide, such as '{slides[0]}'"
    if control == "path" and not slides and path.model.large_displacements:
        message += "; hinges jump between stiff joints: give softer ones, or quadrature = 'exact'"
    if slides and any(block.grain for block in path.model.structure.blocks):
        message += "; pieces of fill flow where little holds them: cohesion does, or a wall"
    return message


@dataclass
class _StepRelaxation:
    """Relaxation in place of failed steps; the more trials fail, the rarer they are."""

    path: Path  # to which states are added
    criteria: Criteria  # conditions of sliding
    farthest: float  # displacement of the load beyond which the structure has collapsed [m]
    wait: int = 0  # steps that must fail between two trials
    failed: int = 0  # steps that have failed since the last trial
    is_last: bool = False  # whether the last step was added so

    def advance(self, border: Array, distance: float) -> bool:
        """Add a relaxed state under the load increment of the failed step, if joints slide."""
        path, self.failed = self.path, self.failed + 1
        if not isinstance(path, LoadPath) or len(path.states) < 2 or self.failed <= self.wait:
            return False
        step = _last_step(path)
        if step[1] <= 0.0 or not sliding_joints(path, self.criteria):
            return False
        increment = float(distance * step[1] / (border @ step)) * path.unit[1]
        increment = max(increment, MIN_RELAXATION_LOAD_STEP * path.factors[-1])
        is_added = path.advance_by_relaxation(increment, self.farthest)
        self.wait, self.failed = (0 if is_added else 2 * self.wait + 1), 0
        self.is_last = is_added
        return is_added


def _label_result(path: Path, criteria: Criteria, outcome: str) -> Pushover:
    """Return the path as labelled datasets, with hinges and limit."""
    count, factors = len(path.states), np.array(path.factors)
    steps = np.arange(count, dtype=float)
    structure, faces = path.model.structure, path.faces
    large = path.model.large_displacements
    joints = joint_dataset(structure, path.resultants, steps, criteria, faces=faces, moved=large)
    joints = joints.rename(time="step").assign_coords(step=np.arange(count))
    curve = xr.Dataset(
        {
            "factor": ("step", factors, {"units": path.units}),
            "displacement": ("step", path.displacements, {"units": "m"}),
            "iterations": ("step", np.array(path.iterations)),
        },
        {"step": np.arange(count)},
    )
    limit, uncertainty = np.nan, np.nan
    # sliding has its limit at once, and no asymptote of hinges; no load has none, nor has a curve
    # that bends down by large displacements, and was lost there
    if not outcome.startswith((CRAWLS, LOST, *[NOT_FOUND] * large)):
        limit, uncertainty = _extrapolate_limit(path.displacements, factors)
        sliding = bool(joints["slide"][-1].any())
        if np.isnan(limit) and sliding and isinstance(path, LoadPath) and _has_reached_bound(path):
            limit, uncertainty = path.bound, path.bound - float(factors[-1])
    return Pushover(curve, joints, *hinge_order(joints), outcome, limit, uncertainty)


def hinge_order(joints: xr.Dataset) -> tuple[tuple[tuple[int, str], ...], tuple[int, ...]]:
    """Sort joints by the step at which they first hinge; in a step, those nearer the edge first."""
    side = joints["hinge"].transpose("step", "joint").values
    first = np.argmax(side != 0, axis=0)
    e = np.abs(joints["eccentricity"].transpose("step", "joint").values)
    order = sorted(np.flatnonzero(side.any(axis=0)), key=lambda j: (first[j], -e[first[j], j]))
    faces = {1: "extrados", -1: "intrados"}
    hinges = tuple((int(j), faces[int(side[first[j], j])]) for j in order)
    return hinges, tuple(int(first[j]) for j in order)


def _extrapolate_limit(displacements: Array, factors: Array) -> tuple[float, float]:
    """Return the limit of λ = λ_limit - C d^(-1/2), and its distance from the last factor."""
    # C is fitted over the last doubling of d, since points of a joint open one by one. While part
    # of d is elastic C is too high, so that the limit lies in between.
    last, before = float(factors[-1]), float(factors[-2])
    # The last step may be shorter than one that grows as usual: its change is scaled up to that.
    d, step = float(displacements[-1]), float(displacements[-1] - displacements[-2])
    shortness = max(1.0, (1.0 - 1.0 / STEP_GROWTH) * d / step) if step > 0.0 else 1.0
    flat = 1e-6 * abs(last)
    if abs(last - before) * shortness <= flat:  # the limit is reached
        return last, flat
    half = min(int(np.searchsorted(displacements, 0.5 * displacements[-1])), len(factors) - 2)
    x = np.maximum(displacements, displacements[1]) ** -0.5
    # one step defines no curve, and no load that moves back has an asymptote
    if len(factors) > 2 and x[half] > x[-1]:
        beyond = (last - float(factors[half])) * x[-1] / (x[half] - x[-1])
        if abs(beyond) <= 0.2 * abs(last):  # beyond that the asymptote does not hold
            return last + beyond, abs(beyond)
    return float("nan"), float("nan")
