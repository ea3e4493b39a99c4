"""Which solver takes the steps of a run: "newton" for large displacements, else "compliance"."""

import logging

from archfem._threads import single_threaded
from archfem._validation import short_repr
from archfem.dynamics.solvers.base import StepSolver
from archfem.dynamics.solvers.compliance import ComplianceSolver
from archfem.dynamics.solvers.equation import Equation
from archfem.dynamics.solvers.integrator import Stepper
from archfem.dynamics.solvers.newton import NewtonSolver
from archfem.dynamics.solvers.snes import SnesSolver
from archfem.errors import InvalidInput
from archfem.statics.newton import Newton

SOLVERS: dict[str, type[StepSolver]] = {"newton": NewtonSolver, "compliance": ComplianceSolver}

METHODS = ("auto", *SOLVERS, "snes")

logger = logging.getLogger("archfem")


@single_threaded
def stepper_for(
    method: "str | Stepper", equation: Equation, newton: Newton | None = None
) -> Stepper:
    """Return the stepper of a run."""
    if isinstance(method, Stepper):
        return method
    if not isinstance(method, str) or method not in METHODS:
        raise InvalidInput(f"method {short_repr(method)} does not exist: use one of {METHODS}")
    solver = None
    if method == "auto":
        solver = select_solver(equation)
    elif method != "snes":
        solver = SOLVERS[method].of(equation)
        if solver is None:
            raise InvalidInput(
                f"method '{method}' does not apply to this model of fidelity "
                f"'{equation.model.fidelity}': compliance needs small displacements; both need "
                "joints that neither dilate nor resist tension and, with Newmark's method or HHT, "
                "whose supports have not moved; neither applies to monolithic models; use "
                "method='auto' or 'snes'"
            )
    return Stepper(equation, solver, exact=SnesSolver(equation, newton))


def select_solver(equation: Equation) -> StepSolver | None:
    """Return the solver of a run, or None where only SNES applies.

    For small displacements the compliance method was the faster one in 48 cases from a ring of 17
    stones to a bridge with its fill.
    """
    if equation.model.large_displacements:
        return NewtonSolver.of(equation)
    solver = ComplianceSolver.of(equation)
    operator = equation.model.operator
    if solver is None and operator is not None and not operator.points.is_plain:
        logger.info("joints dilate or resist tension: every step is solved by SNES")
    return solver
