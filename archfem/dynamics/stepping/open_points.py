"""The small problem of a step: the tension to be taken out of the open joint points.

With z the gaps at the points, z₀ those if all joints held tension, and F their compliance,

    z = z₀ + F λ,    λ = J(z) z,

J block-diagonal, zero where a joint is closed and positive semi-definite elsewhere: J = R Rᵀ. In
μ = Rᵀ z

    (1 - Rᵀ F R) μ = Rᵀ z₀,    λ = R μ,

which is symmetric and, as the open structure has at least mass, positive definite. Its eigenvalues
lie between 0 and 1, few of them near 0, so conjugate gradients take a few products; they start
from the gaps of the last pass, and those of the first pass from the λ of the last step.
"""

import numba
import numpy as np

from archfem.dynamics.stepping.joint_law import Law, integrals, open_part, pull, pulls
from archfem.dynamics.stepping.loop import ITERATIONS
from archfem.dynamics.stepping.small_problem import (
    AHEAD,
    EXACT,
    ROUNDED,
    add_held,
    exact,
    expected,
    largest,
    release,
    shift,
    solved_by,
    unload,
)

FEW = 24
"""Points up to which the problem is solved directly."""

ROUGH = 1e-3
"""What the first pass leaves of its residual; later ones leave the less the better they converge,
as of Eisenstat and Walker (SIAM J. Sci. Comput. 17, 1996)."""


def _released(law, start, rows, compliance, force, enough):  # type: ignore
    """Find λ where it may differ from zero; passes, or -1 if it does not settle."""
    law = Law(law.facets, chosen(law.stiffness, rows), law.arm, law.joint)
    matrix, free, own = square(compliance.whole, rows), chosen(start, rows), chosen(force, rows)
    root, wanted = np.zeros((len(rows), 2)), np.empty(len(rows))
    gap, left, last = free + matrix @ own, ROUGH, np.inf
    for passes in range(1, ITERATIONS + 1):
        _roots(gap, law, root)
        if len(rows) <= FEW:
            gap = _direct(free, matrix, (root, law.facets), own)
        else:
            gap = _solve(free, matrix, (root, law.facets), own, (left, 0.1 * enough))
        pulls(gap, law, wanted)
        off = np.max(np.abs(wanted - own))
        if off <= enough or last <= off <= ROUNDED * enough:
            for i in range(len(rows)):
                force[rows[i]] = own[i]
            return passes
        left = min(ROUGH, (off / last) ** 2) if last < np.inf else ROUGH
        last = off
    return -1


def _unloaded(law, gap, rows, compliance, force):  # type: ignore
    """Take from gaps what λ opens."""
    moved = square(compliance.whole, rows) @ chosen(force, rows)
    for k in range(len(rows)):
        gap[rows[k]] -= moved[k]


def _fits(law, gap, force, near):  # type: ignore
    """Return whether the gaps ask for the λ they were found with; adds open points to near."""
    facets, stiffness, _, _ = law
    most, off = 0.0, 0.0
    for row in range(len(gap)):
        wanted = pull(gap[row], gap[row ^ 1] if facets else 0.0, stiffness[row], facets)
        most = max(most, stiffness[row] * abs(gap[row]))
        off = max(off, abs(wanted - force[row]))
        if wanted > 0.0:
            near[row] = True
            if facets:
                near[row ^ 1] = True
    return off <= EXACT * most


def _foreseen(law, gap, before, force):  # type: ignore
    """Return which points are open, or will be soon if they go on as they did (p,)."""
    near = np.empty(len(gap), dtype=np.bool_)
    for row in range(len(gap)):
        near[row] = force[row] != 0.0 or gap[row] + AHEAD * (gap[row] - before[row]) > 0.0
    if law.facets:
        for row in range(0, len(gap), 2):
            near[row] = near[row + 1] = near[row] or near[row + 1]
    return near


def _largest(law, gap):  # type: ignore
    """Return the largest force of a point if all joints held tension."""
    return np.max(law.stiffness * np.abs(gap))


def _same(law, gap):  # type: ignore
    """Leave gaps as they are."""


def _none(law, opening, right):  # type: ignore
    """Add nothing."""


solved_by(
    Law,
    (expected, _foreseen),
    (release, _released),
    (unload, _unloaded),
    (exact, _fits),
    (shift, _same),
    (largest, _largest),
    (add_held, _none),
)


@numba.njit(cache=True)
def chosen(vector, rows):  # type: ignore
    """Return entries of a vector (rows,).

    Args:
        vector: of which to take them (n,).
        rows: their numbers (rows,).
    """
    result = np.empty(len(rows))
    for i in range(len(rows)):
        result[i] = vector[rows[i]]
    return result


@numba.njit(cache=True)
def square(matrix, rows):  # type: ignore
    """Return some rows and columns of a matrix (rows, rows).

    Args:
        matrix: of which to take them (n, n).
        rows: their numbers (rows,).
    """
    result = np.empty((len(rows), len(rows)))
    for i in range(len(rows)):
        row = rows[i]
        for j in range(len(rows)):
            result[i, j] = matrix[row, rows[j]]
    return result


@numba.njit(cache=True)
def _roots(gap, law, root):  # type: ignore
    """R: the diagonal entry of each row and, for the first end of a facet, the one below it."""
    root[:] = 0.0
    for i in range(0, len(gap), 2 if law.facets else 1):
        scale = np.sqrt(law.stiffness[i])
        if not law.facets:
            root[i, 0] = scale if gap[i] > 0.0 else 0.0
        elif gap[i] > 0.0 or gap[i + 1] > 0.0:
            low, high = open_part(gap[i], gap[i + 1])
            first, mixed, second = integrals(low, high)
            corner = np.sqrt(max(first, 1e-300))
            below = min(mixed / corner, np.sqrt(second))  # more is rounding of a tiny opening
            root[i, 0] = scale * corner
            root[i, 1] = scale * below
            root[i + 1, 0] = scale * np.sqrt(max(second - below**2, 0.0))


@numba.njit(cache=True)
def _times_root(roots, vector):  # type: ignore
    """R times a vector."""
    root, facets = roots
    result = root[:, 0] * vector
    if facets:
        for i in range(1, len(vector), 2):
            result[i] += root[i - 1, 1] * vector[i - 1]
    return result


@numba.njit(cache=True)
def _times_transposed(roots, vector):  # type: ignore
    """Rᵀ times a vector."""
    root, facets = roots
    result = root[:, 0] * vector
    if facets:
        for i in range(0, len(vector), 2):
            result[i] += root[i, 1] * vector[i + 1]
    return result


@numba.njit(cache=True)
def _solve(free, matrix, roots, force, until):  # type: ignore
    """Return the gaps, and λ in place: by conjugate gradients for μ, R given, from the last λ.

    Ends when the residual is a fraction of the first, or an error of λ small enough.
    """
    solution = _times_transposed(roots, free + matrix @ force)
    image = _times_root(roots, solution)
    rest = _times_transposed(roots, free + matrix @ image) - solution
    direction, square = rest.copy(), rest @ rest
    stiffest = max(np.max(np.abs(roots[0])) ** 2, 1e-300)
    end = max(until[0] ** 2 * square, until[1] ** 2 / stiffest)
    for _ in range(4 * len(free)):
        if square <= end:
            break
        image = direction - _times_transposed(roots, matrix @ _times_root(roots, direction))
        length = square / (direction @ image)
        solution += length * direction
        rest -= length * image
        new = rest @ rest
        direction = rest + (new / square) * direction
        square = new
    image = _times_root(roots, solution)
    for i in range(len(force)):
        force[i] = image[i]
    return free + matrix @ force


@numba.njit(cache=True)
def _direct(free, matrix, roots, force):  # type: ignore
    """Solve for μ with R given by Cholesky's factor; the gaps, and λ in place."""
    (root, facets), size = roots, len(free)
    factor, solution = np.empty((size, size)), _times_transposed(roots, free)
    for i in range(size):
        for j in range(i + 1):
            total = -_between(root, matrix, (i, j), facets)
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            factor[i, j] = total / factor[j, j] if j < i else np.sqrt(1.0 + total)
        for k in range(i):
            solution[i] -= factor[i, k] * solution[k]
        solution[i] /= factor[i, i]
    for i in range(size - 1, -1, -1):
        solution[i] /= factor[i, i]
        for k in range(i):
            solution[k] -= factor[i, k] * solution[i]
    force[:] = _times_root(roots, solution)
    return free + matrix @ force


@numba.njit(cache=True)
def _between(root, matrix, place, facets):  # type: ignore
    """One entry of Rᵀ F R."""
    i, j = place
    if not facets:
        return root[i, 0] * matrix[i, j] * root[j, 0]
    own = matrix[i, j] * root[j, 0] + matrix[i, j ^ 1] * root[j, 1]
    other = matrix[i ^ 1, j] * root[j, 0] + matrix[i ^ 1, j ^ 1] * root[j, 1]
    return root[i, 0] * own + root[i, 1] * other
