"""What a short run tells of a model: the largest |e| of each joint on the strongest motion."""

import numpy as np
from scipy.sparse.linalg import eigsh

from archfem.arrays import Array
from archfem.dynamics.history import History
from archfem.dynamics.schemes import StiffnessDamping, Viscous
from archfem.dynamics.time_history import time_history
from archfem.errors import DidNotConverge
from archfem.joints.criteria import judged
from archfem.masonry.actions import BodyForce
from archfem.models.model import Model
from archfem.motion.motion import Motion
from archfem.statics.equilibrium import Equilibrium, dead_load, self_weight
from archfem.statics.newton import Solver
from archfem.statics.search import found_nearby

WINDOW = 8.0
"""Length of the part of a motion on which errors are predicted, its peak in the middle [s]."""

SEVERE = 0.40
"""|e| to which a probing motion is scaled where none is given."""


def strongest(motion: Motion) -> Motion:
    """Return the part of a motion around its horizontal peak, eight seconds long at most.

    Args:
        motion: of the ground.
    """
    peak = float(motion.times()[np.argmax(np.abs(motion.horizontal))])
    start = max(0.0, min(peak - WINDOW / 2.0, motion.duration - WINDOW))
    return motion.cut(start, min(start + WINDOW, motion.duration))


def severe_motion(model: Model) -> Motion:
    """Return a synthetic motion whose peak, acting statically, brings |e| to 0.4.

    Args:
        model: any rung of the ladder; its judged joints tell.
    """
    solver, rest = Solver(model.size), dead_load(model)
    low, high = 0.0, 2.0
    for _ in range(10):
        middle = 0.5 * (low + high)
        load = self_weight(model) + model.load(BodyForce(middle))
        try:  # from the dead load in a few full steps: a long search under too large a load is idle
            pushed, found = found_nearby(solver, rest.model, load, rest.q)
            joints = Equilibrium(pushed, found.q, 1, found.iterations).joints
            severe = float(abs(judged(joints)["eccentricity"]).max()) > SEVERE
        except DidNotConverge:
            severe = True
        low, high = (low, middle) if severe else (middle, high)
    pga = max(low, 0.02) * model.structure.gravity
    return Motion.synthetic(duration=WINDOW, pga=pga, seed=1)


def usual_damping(model: Model) -> StiffnessDamping:
    """Return five per cent at the first closed frequency, and no drag on the mass.

    Args:
        model: any rung of the ladder.
    """
    square = eigsh(
        model.closed().tocsc(), 1, model.mass.tocsc(), sigma=0.0, return_eigenvectors=False
    )[0]
    first = float(np.sqrt(square) / (2.0 * np.pi))
    return StiffnessDamping(0.05, first)


def peaks(
    model: Model,
    motion: Motion,
    damping: Viscous | None,
    dt: float | None,
    *,
    tolerance: float | None = None,
    start: Equilibrium | None = None,
) -> Array:
    """Return the largest |e| of each judged joint over a run (n,) [-]; 0.5 where it came apart.

    Args:
        model: any rung of the ladder.
        motion: of the ground.
        damping: None is undamped.
        dt: time step [s]; None where steps choose their length.
        tolerance: of |e| by which they do so [-].
        start: the dead load, found first where it is not given.

    Raises:
        DidNotConverge: a step failed.
    """
    run = time_history(model, motion, damping=damping, dt=dt, tolerance=tolerance, start=start)
    return peaks_of(run)


def peaks_of(run: History) -> Array:
    """Return the largest |e| of each judged joint over a run (n,) [-]; 0.5 where it came apart.

    Args:
        run: of any model.
    """
    return abs(judged(run.joints)["eccentricity"]).fillna(0.5).max("time").values


def largest_difference(first: Array, second: Array) -> float:
    """Return the largest difference, over the joints, of two runs' peaks [-].

    Args:
        first: as given by `peaks` (n,) [-].
        second: the same of another model of the same structure (n,) [-].
    """
    return float(np.abs(first - second).max())
