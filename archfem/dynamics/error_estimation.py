"""A-posteriori error of models, time steps and small displacements, from short runs.

The measure is the largest |e| of every joint, by which hinges are detected. Runs are made over the
strongest window of the motion. With P(m, s) the peaks of a model m in steps s, the distance of
P(m, s) to the exact solution is at most

    |P(m, s) - P(ref, s)| + |P(ref, s) - P(ref, 0)|,

the model error and the time-step error. Both models of the first term take the same steps, so that
it is the error of the model alone. The second term is extrapolated from steps s/2, at which the
error of a scheme of second order is a quarter (Richardson): 4/3 of the difference.

*Chaotic spread.* Where impacts dominate, a single motion is not significant: the highest of many
bounces depends on less than the difference of two models, which may agree by coincidence. Runs
under slightly weaker and stronger motions give the spread of the largest |e|, a lower bound of the
error.

*Small displacements.* Where joints rotate, the thrust moves with them. Rigid blocks are run twice,
with small and with large displacements, since the effect of geometry is almost independent of the
strain of blocks. Blocks of soil cannot be rigid; with them the error is estimated from the largest
rotation of a joint.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.sparse.linalg import eigsh

from archfem._typing import Array
from archfem.dynamics.history import Ending, History
from archfem.dynamics.schemes import StiffnessDamping, Viscous
from archfem.dynamics.time_history import time_history
from archfem.errors import DidNotConverge
from archfem.joints.criteria import assessed_joints
from archfem.masonry.loads import BodyForce
from archfem.masonry.stiffness_ratio import find_soft_blocks
from archfem.models.builder import build
from archfem.models.discretisation import Discretisation
from archfem.models.model import Model
from archfem.motion.motion import Motion
from archfem.statics.equilibrium import Equilibrium, dead_load, self_weight
from archfem.statics.newton import EquilibriumSolver
from archfem.statics.relaxation import solve_local

# Length of the strongest window of a motion [s]
WINDOW_LENGTH = 8.0

# Factor from an error in the window to that of the whole motion [-]. With it, predicted errors of
# eight arches and columns under one motion each were 1.0 to 2.7 times the actual errors
ERROR_SAFETY_FACTOR = 1.5

# Largest change of |e| by large displacements, over the rotation of a joint [1/rad]: found at
# rotations of 0.6 mrad in six arches and columns under four motions each; about 1 at 20 mrad
ERROR_PER_ROTATION = 7.0


def strongest_window(motion: Motion) -> Motion:
    """Return the part of a motion around its horizontal peak, eight seconds long at most."""
    peak = float(motion.times()[np.argmax(np.abs(motion.horizontal))])
    start = max(0.0, min(peak - WINDOW_LENGTH / 2.0, motion.duration - WINDOW_LENGTH))
    return motion.cut(start, min(start + WINDOW_LENGTH, motion.duration))


def severe_motion(model: Model, eccentricity: float = 0.40) -> Motion:
    """Return a synthetic motion whose peak, acting statically, brings |e| to a value."""
    solver, rest = EquilibriumSolver(model.size), dead_load(model)
    low, high = 0.0, 2.0
    for _ in range(10):
        middle = 0.5 * (low + high)
        load = self_weight(model) + model.load(BodyForce(middle))
        try:  # a few full steps from the dead load: under too large a load a long search is idle
            pushed, solution = solve_local(solver, rest.model, load, rest.q)
            joints = Equilibrium(pushed, solution.q, 1, solution.iterations).joints
            severe = float(abs(assessed_joints(joints)["eccentricity"]).max()) > eccentricity
        except DidNotConverge:
            severe = True
        low, high = (low, middle) if severe else (middle, high)
    pga = max(low, 0.02) * model.structure.gravity
    return Motion.synthetic(duration=WINDOW_LENGTH, pga=pga, seed=1)


def default_damping(model: Model) -> StiffnessDamping:
    """Return stiffness damping of 5 % at the first frequency with all joints closed."""
    stiffness, mass = model.closed_tangent().tocsc(), model.mass.tocsc()
    square = eigsh(stiffness, 1, mass, sigma=0.0, return_eigenvectors=False)[0]
    return StiffnessDamping(0.05, float(np.sqrt(square) / (2.0 * np.pi)))


def run_peaks(
    model: Model,
    motion: Motion,
    damping: Viscous | None,
    dt: float | None,
    *,
    tolerance: float | None = None,
    start: Equilibrium | None = None,
) -> Array:
    """Return the largest |e| of each assessed joint over a run, as `peak_eccentricities`."""
    run = time_history(model, motion, damping=damping, dt=dt, tolerance=tolerance, start=start)
    return peak_eccentricities(run)


def peak_eccentricities(run: History) -> Array:
    """Return the largest |e| of each assessed joint of a run (n,) [-]; 0.5 where it came apart."""
    return abs(assessed_joints(run.joints)["eccentricity"]).fillna(0.5).max("time").values


def largest_difference(first: Array, second: Array) -> float:
    """Return the largest difference, over the joints, of the peaks of two runs [-]."""
    return float(np.abs(first - second).max())


@dataclass(frozen=True)
class StepSettings:
    """Time step of a run, or tolerance for steps of varying length."""

    dt: float | None  # time step [s]; None for steps of varying length
    step_tolerance: float | None  # tolerance on |e| of these [-]; None with a time step

    @property
    def label(self) -> str:
        """Short text."""
        if self.dt is not None:
            return f"steps of {1e3 * self.dt:g} ms"
        return f"steps for {self.step_tolerance:.2g} in |e|"

    @property
    def halved(self) -> "StepSettings":
        """Steps about half as long; a tolerance varies with the square of the length."""
        tolerance = self.step_tolerance
        return StepSettings(self.dt and self.dt / 2.0, tolerance and tolerance / 4.0)


@dataclass(frozen=True, eq=False)
class _RunPeaks:
    """Largest |e| of each assessed joint (n,), and largest rotation of any joint [rad]."""

    peaks: Array
    largest_rotation: float


@dataclass(frozen=True, eq=False)
class ErrorEstimator:
    """Reference model under the strongest window of a motion, and the runs made so far."""

    model: Model  # the reference, the finest
    window: Motion  # strongest part of the motion
    damping: Viscous | None  # of all runs
    callback: Callable[[], object] = lambda: None  # called after each run
    _runs: dict[tuple[Model, StepSettings, float], _RunPeaks] = field(default_factory=dict)
    _dead_loads: dict[Model, Equilibrium] = field(default_factory=dict)

    def with_reference(self, model: Model) -> "ErrorEstimator":
        """Return the estimator with another reference model, and the same cached runs."""
        return replace(self, model=model)

    def time_step_error(self, steps: StepSettings) -> float:
        """Return the error of steps in the largest |e| of a joint, for any model [-]."""
        full, half = (self._peaks(self.model, each) for each in (steps, steps.halved))
        return ERROR_SAFETY_FACTOR * (4.0 / 3.0) * largest_difference(full, half)

    def model_error(self, model: Model, steps: StepSettings) -> float:
        """Return the error of a model in the largest |e| of a joint; infinite if it fails [-]."""
        reference = self._peaks(self.model, steps)
        try:
            return ERROR_SAFETY_FACTOR * largest_difference(self._peaks(model, steps), reference)
        except DidNotConverge:
            return np.inf

    def chaotic_spread(
        self, model: Model, steps: StepSettings, changes: tuple[float, ...] = (0.01, 0.02)
    ) -> float:
        """Return the spread of the largest |e| of a joint due to impacts; infinite if a run fails.

        Without impacts |e| grows evenly with the motion: its mean over a weaker and a stronger
        motion is that of the motion itself. The deviation from this mean is the spread [-].
        """
        try:
            # records are no more accurate than these changes of their scale
            deviation = max(self._deviation(model, steps, change) for change in changes)
        except DidNotConverge:
            return np.inf
        return ERROR_SAFETY_FACTOR * deviation

    def largest_rotation(self, steps: StepSettings) -> float:
        """Return the largest rotation of a joint of the reference model [rad]."""
        return self._run(self.model, steps).largest_rotation

    def _deviation(self, model: Model, steps: StepSettings, change: float) -> float:
        """Return the deviation of |e| from its mean over a weaker and a stronger motion."""
        weaker, stronger = (self._peaks(model, steps, 1.0 + part) for part in (-change, change))
        return largest_difference(self._peaks(model, steps), 0.5 * (weaker + stronger))

    def _peaks(self, model: Model, steps: StepSettings, scale: float = 1.0) -> Array:
        """Return the largest |e| of the joints of a model under the scaled window."""
        return self._run(model, steps, scale).peaks

    def _run(self, model: Model, steps: StepSettings, scale: float = 1.0) -> _RunPeaks:
        """Return the peaks of a model under the scaled window; each run is made once."""
        key = model, steps, scale
        if key not in self._runs:
            if model not in self._dead_loads:
                self._dead_loads[model] = dead_load(model)
            run = time_history(
                model,
                self.window if scale == 1.0 else self.window.scaled(scale),
                damping=self.damping,
                dt=steps.dt,
                tolerance=steps.step_tolerance,
                start=self._dead_loads[model],
            )
            self._runs[key] = _RunPeaks(peak_eccentricities(run), _largest_rotation(run))
            self.callback()
        return self._runs[key]


def _largest_rotation(run: History) -> float:
    """Return the largest rotation of a joint of a run [rad]."""
    return float(np.abs(run.joints["rotation"]).max())


def small_displacement_error(
    estimator: ErrorEstimator, steps: StepSettings, negligible_rotation: float = 1e-4
) -> float:
    """Return the error of small displacements in the largest |e|; infinite if a run fails."""
    structure = estimator.model.structure
    if find_soft_blocks(structure):
        return ERROR_PER_ROTATION * estimator.largest_rotation(steps)

    def run_rigid(displacements: str) -> History:
        settings = Discretisation("rigid", quadrature="exact", displacements=displacements)
        return time_history(
            build(structure, settings),
            estimator.window,
            damping=estimator.damping,
            dt=steps.dt,
            tolerance=steps.step_tolerance,
        )

    small = run_rigid("small")
    rotation = _largest_rotation(small)
    # below this rotation [rad] the estimate is far within any tolerance, and a second run is saved
    if rotation <= negligible_rotation:
        return ERROR_PER_ROTATION * rotation
    try:
        large = run_rigid("large")
    except DidNotConverge:
        return np.inf
    if large.ending is Ending.PARTED:
        return np.inf
    difference = largest_difference(peak_eccentricities(small), peak_eccentricities(large))
    return ERROR_SAFETY_FACTOR * difference
