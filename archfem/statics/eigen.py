"""The lowest vibrations of sparse matrices, by SLEPc, with nothing missed and nothing made up.

K x = ω² M x is solved by shift-and-invert and the Krylov-Schur method (Stewart, SIAM J. Matrix
Anal. Appl. 23 (2002) 601). By Sylvester's law of inertia the negative pivots of K - σ M are as many
as there are ω² below σ: that tells of negative stiffness, and of a mode that was stepped over.
"""

from collections.abc import Callable

import numpy as np
from scipy import sparse

from archfem._petsc import PETSc, SLEPc
from archfem.arrays import Array
from archfem.errors import DidNotConverge
from archfem.statics.dense_eigen import mechanism, nothing

ACCURACY = 1e-12
"""Residual of a pair, relative to its inverted eigenvalue, at which SLEPc is content."""

APART = 1e-6
"""Eigenvalues nearer than this, relative to their size, count as equal."""

ITERATIONS = 200
"""After which SLEPc gives up."""

LEAST, MOST = 20, 240
"""Bounds on the size of the projected problem, which is else as large as the number of modes."""


def count_below(stiffness: sparse.csr_matrix, mass: sparse.csr_matrix, square: float) -> int:
    """Return the number of ω² below a value, by Sylvester's law.

    Args:
        stiffness: K (n, n), symmetric.
        mass: M (n, n), symmetric and positive.
        square: the value, which is no ω² itself [1/s²].
    """
    solver = _solver(_matrix(stiffness), _matrix(mass), 1, square)
    solver.setUp()
    return _negative(solver)


def lowest(
    stiffness: sparse.csr_matrix,
    mass: sparse.csr_matrix,
    count: int,
    *,
    accuracy: float = ACCURACY,
    iterations: int = ITERATIONS,
    check: Callable[[sparse.csr_matrix, sparse.csr_matrix, float], int] = count_below,
) -> tuple[Array, Array]:
    """Find the lowest ω² and their shapes, so that φᵀ M φ = 1.

    Args:
        stiffness: K (n, n), symmetric.
        mass: M (n, n), symmetric and positive.
        count: how many, from 1 to n.
        accuracy: residual of a pair, relative to its inverted eigenvalue [-].
        iterations: after which SLEPc gives up.
        check: counts the ω² below a value, to tell whether one was stepped over.

    Returns:
        ω² in ascending order (count,) [1/s²], shapes (n, count).

    Raises:
        DidNotConverge: K is singular or negative, or SLEPc did not find all pairs.
    """
    zero = nothing(stiffness, mass)
    if zero <= 0.0:
        raise DidNotConverge(mechanism(0.0, zero))
    solver = _solver(_matrix(stiffness), _matrix(mass), count, -zero)
    solver.setTolerances(accuracy, iterations)
    solver.solve()
    found = solver.getConverged()
    if found < count:
        raise DidNotConverge(
            f"SLEPc found {found} of {count} modes in {solver.getIterationNumber()} iterations "
            f"(reason {int(solver.getConvergedReason())}): ask for fewer, or check units"
        )
    squares, shapes = _pairs(solver, found, mass.shape[0])
    order = np.argsort(squares)[:count]
    squares, shapes = squares[order], shapes[:, order]
    if _negative(solver) or squares[0] <= zero:
        raise DidNotConverge(mechanism(float(squares[0]), zero))
    edge = float(squares[-1]) * (1.0 - APART)
    below, there = int(np.sum(squares < edge)), check(stiffness, mass, edge)
    if there != below:
        raise DidNotConverge(
            f"SLEPc found {below} modes below {np.sqrt(edge) / (2.0 * np.pi):.4g} Hz where there "
            f"are {there}: ask for a few more or fewer"
        )
    return squares, shapes / np.sqrt(np.sum(shapes * (mass @ shapes), axis=0))


def _matrix(matrix: sparse.csr_matrix) -> PETSc.Mat:
    """A matrix as PETSc takes it, on a symmetric pattern."""
    # Cholesky's factorisation does not end on another, and where joints can slide the pattern has
    # slips coupled with openings, but not openings with slips.
    half = matrix.tocoo()
    places = (np.append(half.row, half.col), np.append(half.col, half.row))
    whole = sparse.csr_matrix((0.5 * np.append(half.data, half.data), places), matrix.shape)
    made = PETSc.Mat().createAIJ(whole.shape, csr=(whole.indptr, whole.indices, whole.data))
    made.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    return made


def _pairs(solver: SLEPc.EPS, count: int, size: int) -> tuple[Array, Array]:
    """The ω² that a solver found (count,), and their shapes (size, count)."""
    vector = PETSc.Vec().createSeq(size)
    squares, shapes = np.empty(count), np.empty((size, count))
    for number in range(count):
        squares[number] = solver.getEigenpair(number, vector).real
        shapes[:, number] = vector.array_r
    return squares, shapes


def _solver(stiffness: PETSc.Mat, mass: PETSc.Mat, count: int, shift: float) -> SLEPc.EPS:
    """A solver for the pairs nearest a shift, by a Cholesky factor of K - σ M."""
    solver = SLEPc.EPS().create(PETSc.COMM_SELF)
    solver.setOperators(stiffness, mass)
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    solver.setDimensions(count, mpd=min(max(count, LEAST), MOST))
    solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    solver.setTarget(shift)
    transform = solver.getST()
    transform.setType(SLEPc.ST.Type.SINVERT)
    linear = transform.getKSP()
    linear.setType(PETSc.KSP.Type.PREONLY)
    linear.getPC().setType(PETSc.PC.Type.CHOLESKY)
    return solver


def _negative(solver: SLEPc.EPS) -> int:
    """Number of negative pivots of the solver's factor."""
    return int(solver.getST().getKSP().getPC().getFactorMatrix().getInertia()[0])
