"""The one compiled loop over steps; what a step is, the type of the strategy's system says.

A system is a NamedTuple. For its type `begin`, `settle` and `measure` are given by
`numba.extending.overload`, so that numba picks them when it compiles `advance`. The loop knows
neither matrices nor joints: how gaps, resultants and energies come about is the system's own.
"""

from pathlib import Path
from typing import Any

import numba

from archfem.files import forget_stale

ITERATIONS = 40
"""Passes over the joints in a step before it is given up."""


def begin(system: Any, state: Any, memory: Any) -> Any:
    """Return what is carried from step to step; to be overloaded.

    Args:
        system: of a strategy.
        state: from which the first step goes, in the strategy's terms (3, n).
        memory: what the joints remember there (m,).
    """
    raise NotImplementedError


def settle(system: Any, kept: Any, step: Any, states: Any, ground: Any) -> Any:
    """Find the state at the end of a step; to be overloaded.

    Args:
        system: of a strategy.
        kept: what is carried from step to step, as `begin` gave it.
        step: number of the step in its batch.
        states: at its start, and at its end, filled (2, 3, n).
        ground: acceleration of the ground where the equation is written (2,) [m/s²].

    Returns:
        Passes over the joints; -1 if they do not settle.
    """
    raise NotImplementedError


def measure(
    system: Any, kept: Any, step: Any, states: Any, ground: Any, results: Any, memory: Any
) -> Any:
    """Find the resultants, energies and memory of a step that has settled; to be overloaded.

    Args:
        system: of a strategy.
        kept: what is carried from step to step.
        step: number of the step in its batch.
        states: at its start and at its end (2, 3, n).
        ground: mean acceleration of the ground over the step (2,) [m/s²].
        results: N, V, M (n_joints, 3) [N, N, N m], and energies as by `energy.Meter.step`
            (4,) [J], both filled.
        memory: what the joints remember at its end, filled (m,).
    """
    raise NotImplementedError


forget_stale(Path(__file__).parent, Path(__file__).parents[2] / "joints" / "moving")


@numba.njit(cache=True)
def advance(series, memories, results, ground, system):  # type: ignore
    """Take steps until the end, or until one does not settle.

    Args:
        series: coordinates, their velocity and acceleration at the start in [0]; filled
            (steps + 1, 3, n).
        memories: what the joints remember at the start in [0]; filled (steps + 1, m).
        results: N, V, M (steps, n_joints, 3), passes over the joints (steps,) and energies as by
            `energy.Meter.step` (steps, 4), all filled.
        ground: acceleration where the equation is written, and its mean over the step
            (2, steps, 2).
        system: of a strategy.

    Returns:
        How many steps were taken.
    """
    resultants, passes, energies = results
    kept = begin(system, series[0], memories[0])
    for step in range(len(resultants)):
        states = series[step : step + 2]
        passes[step] = settle(system, kept, step, states, ground[0, step])
        if passes[step] < 0:
            return step
        found = resultants[step], energies[step]
        measure(system, kept, step, states, ground[1, step], found, memories[step + 1])
    return len(resultants)
