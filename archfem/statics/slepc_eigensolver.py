"""Lowest modes of sparse matrices by SLEPc, with a proof that no mode was missed.

K x = ω² M x is solved by shift-and-invert and the Krylov-Schur method (Stewart, SIAM J. Matrix
Anal. Appl. 23 (2002) 601). By Sylvester's law of inertia the number of negative pivots of K - σ M
equals the number of ω² below σ: this detects negative stiffness, and modes that were missed.
"""

from collections.abc import Callable

import numpy as np
from scipy import sparse

from archfem._petsc import PETSc, SLEPc
from archfem._typing import Array
from archfem.errors import DidNotConverge
from archfem.statics.dense_eigensolver import check_lowest, zero_threshold


def count_modes_below(stiffness: sparse.csr_matrix, mass: sparse.csr_matrix, square: float) -> int:
    """Return the number of ω² below a value, by Sylvester's law."""
    solver = _create_solver(_to_petsc(stiffness), _to_petsc(mass), 1, square)
    solver.setUp()
    return _count_negative_pivots(solver)


def find_lowest_modes(
    stiffness: sparse.csr_matrix,
    mass: sparse.csr_matrix,
    count: int,
    *,
    accuracy: float = 1e-12,
    iterations: int = 200,
    check: Callable[[sparse.csr_matrix, sparse.csr_matrix, float], int] = count_modes_below,
) -> tuple[Array, Array]:
    """Find the lowest ω² and their shapes, with φᵀ M φ = 1."""
    zero = zero_threshold(stiffness, mass)
    check_lowest(0.0, -zero)
    # a shift just below zero: K + zero M is regular for any structure that stands
    solver = _create_solver(_to_petsc(stiffness), _to_petsc(mass), count, -zero)
    solver.setTolerances(accuracy, iterations)
    solver.solve()
    converged = solver.getConverged()
    if converged < count:
        raise DidNotConverge(
            f"SLEPc found {converged} of {count} modes in {solver.getIterationNumber()} iterations "
            f"(reason {int(solver.getConvergedReason())}): ask for fewer, or check units"
        )
    squares, shapes = _read_pairs(solver, converged, mass.shape[0])
    order = np.argsort(squares)[:count]
    squares, shapes = squares[order], shapes[:, order]
    check_lowest(float(squares[0]), np.inf if _count_negative_pivots(solver) else zero)
    # Count modes below the highest one; those within 1e-6 of it count as equal and are left out.
    edge = float(squares[-1]) * (1.0 - 1e-6)
    below, expected = int(np.sum(squares < edge)), check(stiffness, mass, edge)
    if expected != below:
        raise DidNotConverge(
            f"SLEPc found {below} modes below {np.sqrt(edge) / (2.0 * np.pi):.4g} Hz where there "
            f"are {expected}: ask for a few more or fewer"
        )
    return squares, shapes / np.sqrt(np.sum(shapes * (mass @ shapes), axis=0))


def _to_petsc(matrix: sparse.csr_matrix) -> PETSc.Mat:
    """Return a matrix for PETSc, on a symmetric pattern."""
    # Cholesky's factorisation does not end on another, and where joints can slide the pattern has
    # slips coupled with openings, but not openings with slips.
    half = matrix.tocoo()
    places = (np.append(half.row, half.col), np.append(half.col, half.row))
    whole = sparse.csr_matrix((0.5 * np.append(half.data, half.data), places), matrix.shape)
    result = PETSc.Mat().createAIJ(whole.shape, csr=(whole.indptr, whole.indices, whole.data))
    result.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    return result


def _read_pairs(solver: SLEPc.EPS, count: int, size: int) -> tuple[Array, Array]:
    """Return the eigenvalues ω² of a solver (count,), and their shapes (size, count)."""
    vector = PETSc.Vec().createSeq(size)
    squares, shapes = np.empty(count), np.empty((size, count))
    for number in range(count):
        squares[number] = solver.getEigenpair(number, vector).real
        shapes[:, number] = vector.array_r
    return squares, shapes


def _create_solver(stiffness: PETSc.Mat, mass: PETSc.Mat, count: int, shift: float) -> SLEPc.EPS:
    """Return a solver for the pairs nearest a shift, by a Cholesky factor of K - σ M."""
    solver = SLEPc.EPS().create(PETSc.COMM_SELF)
    solver.setOperators(stiffness, mass)
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    # the projected problem is as large as the number of modes, within bounds
    solver.setDimensions(count, mpd=min(max(count, 20), 240))
    solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    solver.setTarget(shift)
    transform = solver.getST()
    transform.setType(SLEPc.ST.Type.SINVERT)
    linear = transform.getKSP()
    linear.setType(PETSc.KSP.Type.PREONLY)
    linear.getPC().setType(PETSc.PC.Type.CHOLESKY)
    return solver


def _count_negative_pivots(solver: SLEPc.EPS) -> int:
    """Return the number of negative pivots of the solver's factor."""
    return int(solver.getST().getKSP().getPC().getFactorMatrix().getInertia()[0])
