"""The protocol of a solver of time steps, and the one compiled loop over steps.

A solver's system is a NamedTuple. For its type `start_run`, `solve_step` and `evaluate_step` are
overloaded by `overload_steps`, and numba picks them when it compiles `advance`. The loop itself has
no matrices and no joints, so that only the code of the solver at hand is compiled. It makes no
arrays: a system contains its workspace.
"""

from collections.abc import Callable
from copy import deepcopy
from typing import Any, ClassVar, Protocol, Self

from numba.extending import overload
from numpy.typing import NDArray

from archfem._numba import INNER_OPTIONS, entry
from archfem.dynamics.solvers.equation import Equation

# Iterations over the joints in a step before it is given up
MAX_ITERATIONS = 40


class StepSolver(Protocol):
    """A compiled solver of time steps, whose history equals that of `SnesSolver` to rounding.

    A further solver provides this class, and for the type of its systems overloads of `start_run`,
    `solve_step` and `evaluate_step`. A structure that is linear but for its joints needs only an
    overload of `linear_step.solve_contact`, and a field `linear` in its system.
    """

    name: ClassVar[str]  # value of `method=` that selects it
    order: NDArray[Any]  # coordinates of the model in the order of the solver's vectors (n,)
    assembled: dict[float, Any]  # systems of which no step has been taken, by length of step [s]
    measures_faces: bool = False  # whether it measures gaps, rotations and slips of joints

    @classmethod
    def of(cls, equation: Equation) -> Self | None:
        """Return the solver for an equation of motion, or None where it does not apply."""

    def assemble(self, dt: float) -> Any:
        """Return the data of steps of one length [s] for the compiled loop."""

    def constants(self, system: Any) -> tuple[Any, ...]:
        """Return the parts of the data that no step changes."""

    def empty_parts(self, system: Any) -> dict[int, Any]:
        """Return new parts for a copy, by identity of those that are too large to be copied."""
        return {}

    def system(self, dt: float) -> Any:
        """Return the data for one run, whose steps change neither later runs nor their bits."""
        stored = self.assembled
        if dt not in stored:
            stored[dt] = self.assemble(dt)
            if len(stored) > 8:  # an adaptive run uses as many lengths of step
                del stored[next(iter(stored))]
        system = stored[dt]
        shared = {id(part): part for part in self.constants(system)}
        return deepcopy(system, shared | self.empty_parts(system))


def start_run(system: Any, state: Any, memory: Any) -> None:
    """Fill the workspace of a system from a state (3, n) and the joints' memory; overloaded."""
    raise NotImplementedError


def solve_step(system: Any, step: Any, states: Any, ground: Any) -> Any:
    """Solve for the state at the end of a step; overloaded."""
    raise NotImplementedError


def evaluate_step(
    system: Any, step: Any, states: Any, ground: Any, results: Any, memory: Any
) -> Any:
    """Evaluate resultants, energies, faces and memory of a step that converged; overloaded."""
    raise NotImplementedError


@entry
def advance(series, memories, results, ground, system):  # type: ignore
    """Take steps until the end, or until one does not converge; returns how many were taken."""
    resultants, iterations, energies, faces = results
    start_run(system, series[0], memories[0])
    for step in range(len(resultants)):
        states = series[step : step + 2]
        iterations[step] = solve_step(system, step, states, ground[0, step])
        if iterations[step] < 0:
            return step
        filled = resultants[step], energies[step], faces[step]
        evaluate_step(system, step, states, ground[1, step], filled, memories[step + 1])
    return len(resultants)


def is_kind(kind: type) -> Callable[[Any], bool]:
    """Return the function that says whether numba types a system as a kind of NamedTuple."""
    return lambda system: getattr(system, "instance_class", None) is kind


def overload_for(fits: Callable[[Any], bool], function: Any, kernel: Any) -> None:
    """Let a function be a kernel for systems whose types in numba fit."""

    def choose(system: Any, *_: Any) -> Any:
        return kernel if fits(system) else None

    overload(function, jit_options=INNER_OPTIONS, strict=False)(choose)


def overload_steps(fits: Callable[[Any], bool], start: Any, solve: Any, evaluate: Any) -> None:
    """Overload `start_run`, `solve_step` and `evaluate_step` for systems that fit."""
    for function, kernel in ((start_run, start), (solve_step, solve), (evaluate_step, evaluate)):
        overload_for(fits, function, kernel)
