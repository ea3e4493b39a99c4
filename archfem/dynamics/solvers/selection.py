"""Selection of the solver of a run, by the size of displacements and the width of the tangent."""

from archfem._threads import single_threaded
from archfem._validation import short_repr
from archfem.dynamics.solvers.base import StepSolver
from archfem.dynamics.solvers.compliance import ComplianceSolver
from archfem.dynamics.solvers.equation import Equation
from archfem.dynamics.solvers.integrator import Stepper
from archfem.dynamics.solvers.joint_law import gap_rows
from archfem.dynamics.solvers.newton import NewtonSolver
from archfem.dynamics.solvers.snes import SnesSolver
from archfem.errors import InvalidInput, logger
from archfem.statics.newton import Newton

# by the name of their `method`
SOLVERS: dict[str, type[StepSolver]] = {"newton": NewtonSolver, "compliance": ComplianceSolver}


@single_threaded
def stepper_for(
    method: "str | Stepper", equation: Equation, newton: Newton | None = None
) -> Stepper:
    """Return the stepper of a run."""
    if isinstance(method, Stepper):
        return method
    methods = ("auto", *SOLVERS, "snes")
    if not isinstance(method, str) or method not in methods:
        raise InvalidInput(f"method {short_repr(method)} does not exist: use one of {methods}")
    stored, key = equation.model.derived, (method, equation.damping, equation.scheme)
    # the solver of the last run serves again, whatever the ground motion
    if stored.get("solver", (None,))[0] != key:
        stored["solver"] = key, _make_solver(method, equation)
    return Stepper(equation, stored["solver"][1], exact=SnesSolver(equation, newton))


def _make_solver(method: str, equation: Equation) -> StepSolver | None:
    """Return the solver of a method, or None for SNES."""
    if method == "snes":
        return None
    if method == "auto":
        return select_solver(equation)
    if (solver := SOLVERS[method].of(equation)) is None:
        raise InvalidInput(
            f"method '{method}' does not apply to this model of fidelity "
            f"'{equation.model.fidelity}': compliance needs small displacements, and joints that "
            "do not stiffen as they close; both need joints that neither dilate, nor resist "
            "tension, nor have a law of their own; with Newmark's method or HHT both need supports "
            "that have not moved; neither applies to monolithic models; use method='auto' or 'snes'"
        )
    return solver


def select_solver(equation: Equation) -> StepSolver | None:
    """Return the solver of a run, or None where only SNES applies.

    Newton's method on the whole structure takes large displacements. It takes small ones where the
    tangent is a narrow band, as of rigid stones in a chain, or one with many rows of gaps. Its time
    grows with the square of the width; that of the compliance method with the square of the number
    of rows that open and slide, and tenfold where minimal residuals fail.
    """
    newton, joints = NewtonSolver.of(equation), equation.joints
    if newton is None:
        operator = equation.model.operator
        if operator is not None and not operator.points.is_plain:
            logger.info("joints dilate, resist tension or have an own law: SNES solves every step")
        return None
    if equation.model.large_displacements or joints is None:
        return newton
    if joints.points.stiffens:  # every row is active
        return newton
    rows = len(gap_rows(joints).offset)
    # Chains of rigid stones have a half width of 5 to 11, and take 0.8 to 0.95 of the time of the
    # compliance method. Short ones that never slide take up to 1.3 times as long: their equations
    # in the open rows are few.
    if newton.half_width <= 12:
        return newton if joints.slides or rows > 60 else ComplianceSolver.of(equation)
    # Under strong motions the compliance method takes 0.3 to 0.9 of the time up to 350 rows, as of
    # a ring of 34 elastic stones or a wall of 44 rigid ones. From 45 elastic stones that slide on,
    # which have 460 rows, it takes up to ten times as long.
    return newton if newton.is_narrow and rows > 400 else ComplianceSolver.of(equation)
