"""A-posteriori error of model, time step and small displacements, from short runs.

The measure is the largest |e| of every joint, by which hinges are detected. Settings are run over
the strongest part of the motion, each with half the time step of the one before. P_k are the peaks
of setting k, and n is the finest setting:

    error of n = |P_n - P_(n-1)| / (2^p - 1),    error of k = |P_k - P_n| + error of n,

for the joint with the largest difference. The first is Richardson's extrapolation. The order p is
2, that of the scheme in the time step; where a joint slides by more than the tolerance, over its
depth, it is 1: steps in which sliding begins, ends or reverses err in proportion to their length.

*Small displacements.* Where joints rotate, the thrust moves with them. This error is estimated from
the largest rotation of a joint.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import chain

import numpy as np
from scipy.sparse.linalg import eigsh

from archfem._threads import single_threaded
from archfem._typing import Array
from archfem.dynamics.monitor import RunMonitor
from archfem.dynamics.recorder import start_batch
from archfem.dynamics.schemes import HHT, StiffnessDamping, Viscous
from archfem.dynamics.separation import LooseningMonitor
from archfem.dynamics.solvers.equation import Equation
from archfem.dynamics.solvers.integrator import Stepper
from archfem.dynamics.solvers.selection import stepper_for
from archfem.dynamics.state import State
from archfem.errors import DidNotConverge
from archfem.joints.criteria import assessed_joints
from archfem.joints.resultants import eccentricity_and_friction
from archfem.masonry.loads import BodyForce
from archfem.models.model import Model
from archfem.motion.motion import Motion
from archfem.statics.equilibrium import Equilibrium, dead_load, self_weight
from archfem.statics.newton import EquilibriumSolver
from archfem.statics.relaxation import solve_local


def strongest_window(
    motion: Motion, share: float = 0.6, least: float = 3.5, lead: float = 0.5
) -> Motion:
    """Return the shortest part with a share of the Arias intensity, and the time before it [s]."""
    energy = np.cumsum(np.append(0.0, motion.horizontal**2))
    starts = np.flatnonzero(energy <= (1.0 - share) * energy[-1])
    # round-off must not put the end of the last part beyond the motion
    ends = np.searchsorted(energy, np.minimum(energy[starts] + share * energy[-1], energy[-1]))
    shortest = int(np.argmin(np.maximum(ends - starts, 1)))
    end = motion.dt * ends[shortest]
    start = max(0.0, min(motion.dt * starts[shortest], motion.duration - least))
    # a run that starts from rest amid the strongest shaking begins with a jolt: joints slide that
    # do not slide in the whole run. Start some periods of a stone structure earlier
    return motion.cut(max(0.0, start - lead), min(max(end, start + least), motion.duration))


def severe_motion(model: Model, eccentricity: float = 0.40) -> Motion:
    """Return a synthetic motion whose peak, as a static load, causes a given eccentricity."""
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
    return Motion.synthetic(duration=8.0, pga=pga, seed=1)


def default_damping(model: Model) -> StiffnessDamping:
    """Return stiffness damping of 5 % at the first frequency with all joints closed."""
    stiffness, mass = model.closed_tangent().tocsc(), model.mass.tocsc()
    square = eigsh(stiffness, 1, mass, sigma=0.0, return_eigenvectors=False)[0]
    return StiffnessDamping(0.05, float(np.sqrt(square) / (2.0 * np.pi)))


def largest_difference(first: Array, second: Array) -> float:
    """Return the largest difference, over the joints, of the peaks of two runs [-]."""
    return float(np.abs(first - second).max())


@dataclass(frozen=True)
class RunPeaks:
    """Largest eccentricities, rotation and slip of the joints in a run."""

    peaks: Array | None  # largest |e| of each assessed joint (n,) [-]; None for a failed run
    rotation: float = 0.0  # largest rotation of a joint [rad]
    times: Array = field(default_factory=lambda: np.zeros(0))  # of the peaks (n,) [s]
    states: tuple[State, ...] = ()  # at the start of the run, and at intervals of some steps
    slip: float = 0.0  # largest slip of an assessed joint from the start, over its depth [-]
    displacement: float = 0.0  # largest displacement of a stone's corner from the start [m]


# Parts of a run: the state at the start of each, and the time of its end [s]
Parts = Sequence[tuple[State, float]]


@single_threaded
def run_peaks(
    model: Model, motion: Motion, damping: Viscous | None, dt: float, parts: Parts | None = None
) -> RunPeaks:
    """Run a model of small displacements, from dead load by default, and return its peaks."""
    equation = Equation(model, motion, damping)
    if parts is None:
        rest = dead_load(model)
        parts = [(equation.at_rest(rest.q, memory=rest.model.memory), motion.duration)]
    return follow_peaks(stepper_for("auto", equation), dt, parts)


def follow_peaks(stepper: Stepper, dt: float, parts: Parts) -> RunPeaks:
    """Return the peaks over parts of a run by a solver; none where a step fails or blocks are lost.

    The rotation is that of small displacements.
    """
    model, motion = stepper.equation.model, stepper.equation.motion
    structure = model.structure
    depths = structure.depths[structure.judged]
    peaks, times, rotation, states = np.zeros(len(depths)), np.zeros(len(depths)), 0.0, []
    observer, slip, displacement = model.observer(), 0.0, 0.0
    try:
        for start, end in parts:
            first = start_batch(stepper, start, dt)
            at_rest = observer.faces(first.read(observer))[0, 2, structure.judged] / depths
            monitor = RunMonitor(model, first, damps=isinstance(stepper.equation.scheme, HHT))
            large = model.large_displacements
            loosening = LooseningMonitor.of(model, start) if large else None
            for batch in chain([first], stepper.batches(start, dt, min(end, motion.duration))):
                readings = batch.read(observer)
                monitor.add(batch, readings)
                monitor.check_run()
                if loosening and loosening.find_end(batch)[1]:
                    return RunPeaks(None)
                slips = observer.faces(readings)[:, 2, structure.judged] / depths
                slip = max(slip, float(np.abs(slips - at_rest).max()))
                resultants = batch.resultants[:, structure.judged]
                values = np.abs(eccentricity_and_friction(resultants, depths)[0])
                values[np.isnan(values)] = 0.5  # joints that came apart
                steps = values.argmax(axis=0)
                largest = values[steps, np.arange(len(steps))]
                times = np.where(largest > peaks, batch.times[steps], times)
                peaks = np.maximum(peaks, largest)
                states += [batch.state(k) for k in range(0, len(batch.times), 32)]
            rotation = max(rotation, monitor.largest_turn)
            moved = monitor.displacements
            displacement = max(displacement, float(moved.largest[moved.stones].max()))
    except DidNotConverge:
        return RunPeaks(None)
    return RunPeaks(peaks, rotation, times, tuple(states), slip, displacement)


def parts_about_peaks(run: RunPeaks, before: float = 1.0, after: float = 0.25) -> Parts:
    """Return the parts of a run about the peaks of its joints [s]."""
    parts: list[tuple[State, float]] = []
    for time in np.sort(run.times):
        start = [state for state in run.states if state.time <= max(0.0, time - before)][-1]
        if parts and start.time <= parts[-1][1]:
            start = parts.pop()[0]
        parts.append((start, float(time) + after))
    return parts


def convergence_order(runs: Sequence[RunPeaks], tolerance: float) -> int:
    """Return the order in the time step: 1 where a joint slides by more than the tolerance."""
    return 1 if max(run.slip for run in runs) > tolerance else 2


def estimate_errors(runs: Sequence[RunPeaks], order: int = 2) -> list[float]:
    """Return the error of each run in the largest |e| of a joint, by the order of convergence [-].

    Each run has half the time step of the one before.
    """
    finest = runs[-1].peaks
    if len(runs) < 2 or finest is None or runs[-2].peaks is None:
        return [np.inf] * len(runs)
    differences = [np.inf if x.peaks is None else largest_difference(x.peaks, finest) for x in runs]
    remaining = differences[-2] / (2.0**order - 1.0)
    return [difference + remaining for difference in differences]
