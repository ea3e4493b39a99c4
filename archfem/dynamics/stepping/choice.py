"""Which strategy takes a run: the fastest on the run's own motion, timed.

What a step takes depends on how many joints are open or slide, so a few steps are timed where the
motion is weak, where it is as usual, where it is strong and about its peak: the ranking of
strategies while all joints are closed says nothing of where most are open, nor this of the run. All
strategies go from the same states, to which the first of them has shaken the structure over the
steps before. The time until a strategy can begin counts as well, spread over the run. As all give
one history, to rounding, the choice changes nothing but the time.
"""

import logging
import time
from collections.abc import Sequence
from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np

from archfem.arguments import said
from archfem.arrays import Array
from archfem.dynamics.stepping.banded import WIDEST, Banded
from archfem.dynamics.stepping.equation import Equation
from archfem.dynamics.stepping.exact import Exact
from archfem.dynamics.stepping.loop import advance
from archfem.dynamics.stepping.modal import LARGEST, Modal
from archfem.dynamics.stepping.sparse import Sparse
from archfem.dynamics.stepping.stepper import BATCH, Stepper
from archfem.dynamics.stepping.strategy import Strategy
from archfem.dynamics.stepping.tangent import Tangent
from archfem.dynamics.stepping.turning import Turning
from archfem.dynamics.steps import State
from archfem.errors import InvalidInput
from archfem.models.model import Model
from archfem.statics.newton import Newton
from archfem.threads import on_one_thread

STRATEGIES: tuple[type[Strategy], ...] = (Sparse, Banded, Modal, Turning, Tangent)
"""In the order in which they are tried; the first that applies takes runs too short for timing."""

METHODS = ("auto", *sorted(each.name for each in STRATEGIES), "snes")

STRENGTHS = (1 / 6, 1 / 2, 5 / 6, 1.0)
"""Parts of the run in which the motion is weaker than where steps are timed: in the middle of each
third, and at the peak, from which on joints keep what they slid."""

TIMED = 20
"""Steps that are timed at each of those."""

LEAD = 40
"""Steps before those, in which joints open."""

PATIENCE = 0.0015
"""Time for which those of a strategy are repeated, of which the least counts [s]."""

SHORTEST = 1000
"""Steps of a run from which timing pays."""

WORTH = 0.25
"""Part of the fastest run known so far that it may take to set up one more strategy."""

CLEARLY = 0.95
"""Part of the least time so far below which another strategy counts as faster."""

logger = logging.getLogger("archfem")

_chosen: WeakKeyDictionary[Model, dict[object, type[Strategy]]] = WeakKeyDictionary()


@on_one_thread
def stepper_for(
    method: "str | Stepper",
    equation: Equation,
    start: State,
    dt: float,
    newton: Newton | None = None,
) -> Stepper:
    """Return the stepper of a run.

    Args:
        method: "snes", "contact", "chain", "compliance", or "auto": of the last three the fastest,
            where one applies; or a stepper made before, which is then taken as it is.
        equation: of motion.
        start: state from which the run goes.
        dt: its time step [s].
        newton: settings of the equilibrium solves.

    Raises:
        InvalidInput: the method is not known, or does not apply to this model and damping.
    """
    if isinstance(method, Stepper):
        return method
    if not isinstance(method, str) or method not in METHODS:
        raise InvalidInput(f"method {said(method)} is not known: use one of {METHODS}")
    strategy = None
    if method == "auto":
        strategy = chosen(equation, start, dt)
        operator = equation.model.operator
        if operator is not None and not operator.points.plain:
            logger.info("joints dilate or resist tension: every step is solved by SNES")
    elif method != "snes":
        strategy = next(each for each in STRATEGIES if each.name == method).of(equation)
        if strategy is None:
            raise InvalidInput(
                f"the {method} stepper does not apply to a '{equation.model.fidelity}' model of "
                f"{equation.model.size} coordinates under this damping: contact needs at most "
                f"{LARGEST} of them and damping on closed or initial joints, chain a bandwidth up "
                f"to {WIDEST} and Newmark's method or HHT, with which all three need joints whose "
                "supports have not moved; joints that dilate or resist tension have none, nor have "
                "monolithic models; use method='snes'"
            )
    return Stepper(equation, strategy, exact=Exact(equation, newton))


def chosen(
    equation: Equation,
    start: State,
    dt: float,
    strategies: Sequence[type[Strategy]] = STRATEGIES,
) -> Strategy | None:
    """Return the strategy that takes a run fastest, or None where none applies.

    What was found by timing is remembered for a model, its damping, scheme and time step.

    Args:
        equation: of motion.
        start: state from which the run goes.
        dt: its time step [s].
        strategies: to choose from; the first that applies takes a run too short for timing.
    """
    steps = round((equation.motion.duration - start.time) / dt)
    remembered = _chosen.setdefault(equation.model, {})
    key = (equation.damping, equation.scheme, dt, tuple(strategies))
    if key in remembered:
        return remembered[key].of(equation)
    if steps >= SHORTEST:
        fastest = _fastest(equation, start, dt, strategies)
        if fastest is not None:
            remembered[key] = type(fastest)
            return fastest
    made = (each.of(equation) for each in strategies)
    return next((strategy for strategy in made if strategy is not None), None)


def _fastest(
    equation: Equation, start: State, dt: float, strategies: Sequence[type[Strategy]]
) -> Strategy | None:
    """Time those that apply, but for those whose set-up alone would take too much of the run."""
    times = start.time + dt * np.arange(1, round((equation.motion.duration - start.time) / dt) + 1)
    places = _places(np.linalg.norm(equation.motion.at(times), axis=1))
    windows = [times[place : place + TIMED] for place in places]
    fastest, least, states = None, np.inf, None
    for kind in strategies:
        begun = time.process_time()
        strategy = kind.of(equation)
        if strategy is None or strategy.setup > WORTH * least:
            continue
        stepper = Stepper(equation, strategy)
        stepper.prepared(start, dt, windows[0])
        setup = time.process_time() - begun
        states = states or [
            _shaken(stepper, start, dt, times[place - LEAD : place]) for place in places
        ]
        pairs = zip(states, windows, strict=True)
        clocked = [_clocked(stepper, state, dt, window) for state, window in pairs]
        found = setup + len(times) * float(np.mean(clocked))
        if found < CLEARLY * least:
            fastest, least = strategy, found
    return fastest


def _places(strength: Array) -> list[int]:
    """Steps from which on a motion is as strong, on the mean, as where steps are to be timed.

    Args:
        strength: of the motion at each step (steps,).

    Returns:
        The first step of each.
    """
    means = np.convolve(strength, np.full(TIMED, 1.0 / TIMED), "valid")[LEAD:]
    order = np.argsort(means, kind="stable")
    return [LEAD + int(order[int(part * (len(order) - 1))]) for part in STRENGTHS]


def _shaken(stepper: Stepper, start: State, dt: float, times: Array) -> State:
    """The state after some steps, as far as they settle."""
    first = replace(start, time=float(times[0] - dt))
    batch = stepper.taken(first, dt, times)
    return batch.state(len(batch.times) - 1) if len(batch.times) else first


def _clocked(stepper: Stepper, state: State, dt: float, times: Array) -> float:
    """Return the processor time of a step of a batch [s]; infinite where one does not settle.

    To begin takes as long as some steps, and is done once a batch.
    """
    one, many = _least(stepper, state, dt, times[:1]), _least(stepper, state, dt, times)
    return one / BATCH + (many - one) / (len(times) - 1) if many < np.inf else np.inf


def _least(stepper: Stepper, state: State, dt: float, times: Array) -> float:
    """Least processor time in the compiled loop up to these times [s]."""
    advance(*stepper.prepared(state, dt, times))  # compiles it, so that this is not timed
    least, spent = np.inf, 0.0
    while spent < PATIENCE:
        room = stepper.prepared(state, dt, times)
        begun = time.process_time()
        if advance(*room) < len(times):
            return np.inf
        taken = time.process_time() - begun
        least, spent = min(least, taken), spent + taken
    return least
