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

from archfem.kernel import ITERATIONS, integrals, open_part

RESIDUAL = 1e-14
"""Residual of the conjugate gradients, relative to the right side."""


@numba.njit(cache=True)
def release(start, rows, compliance, law, force, enough):  # type: ignore
    """Find λ where it may differ from zero; return the number of passes, -1 if it does not settle.

    Args:
        start: z₀ (p,), of which the rows are used.
        rows: points that may open, in order; of a facet both ends.
        compliance: F (p, p), of which these rows and columns are used.
        law: exact facets?, stiffness (p,), arm (p,) and joint (p,) of the points.
        force: λ, as a first guess (p,); changed at the rows.
        enough: error of λ that is left [N].
    """
    gap = np.empty(len(rows))
    root = np.zeros((len(rows), 2))
    find_gaps(gap, start, rows, compliance, force)
    for passes in range(1, ITERATIONS + 1):
        _roots(gap, rows, law, root)
        _forces(start, rows, compliance, (root, gap), law[0], force)
        find_gaps(gap, start, rows, compliance, force)
        off = 0.0
        for i in range(len(rows)):
            wanted = pull(gap[i], gap[i ^ 1] if law[0] else 0.0, law[1][rows[i]], law[0])
            off = max(off, abs(wanted - force[rows[i]]))
        if off <= enough:
            return passes
    return -1


@numba.njit(cache=True)
def pull(gap, other, stiffness, facets):  # type: ignore
    """λ at a point: the tension that the closed stiffness would hold where the joint is open."""
    if not facets:
        return stiffness * max(gap, 0.0)
    if gap <= 0.0 and other <= 0.0:
        return 0.0
    low, high = open_part(gap, other)
    first, mixed, _ = integrals(low, high)
    return stiffness * (first * gap + mixed * other)


@numba.njit(cache=True)
def pulls(gap, law, force):  # type: ignore
    """λ at all points."""
    facets, stiffness = law[0], law[1]
    for row in range(len(gap)):
        force[row] = pull(gap[row], gap[row ^ 1] if facets else 0.0, stiffness[row], facets)


@numba.njit(cache=True)
def find_gaps(result, start, rows, compliance, force):  # type: ignore
    """Find z = z₀ + F λ at the rows (rows,)."""
    for i in range(len(rows)):
        result[i] = start[rows[i]]
    for row in rows:
        if force[row] != 0.0:
            column = compliance[row]
            for i in range(len(rows)):
                result[i] += column[rows[i]] * force[row]


@numba.njit(cache=True)
def _roots(gap, rows, law, root):  # type: ignore
    """R: the diagonal entry of each row and, for the first end of a facet, the one below it."""
    facets, stiffness = law[0], law[1]
    root[:] = 0.0
    for i in range(0, len(rows), 2 if facets else 1):
        scale = np.sqrt(stiffness[rows[i]])
        if not facets:
            root[i, 0] = scale if gap[i] > 0.0 else 0.0
        elif gap[i] > 0.0 or gap[i + 1] > 0.0:
            low, high = open_part(gap[i], gap[i + 1])
            first, mixed, second = integrals(low, high)
            corner = np.sqrt(max(first, 1e-300))
            root[i, 0] = scale * corner
            root[i, 1] = scale * mixed / corner
            root[i + 1, 0] = scale * np.sqrt(max(second - (mixed / corner) ** 2, 0.0))


@numba.njit(cache=True)
def _forces(start, rows, compliance, joints, facets, force):  # type: ignore
    """Solve for μ with R given, from the last gaps, and set λ."""
    root, gap = joints
    force[rows] = 0.0
    acts = root[:, 0] != 0.0
    if facets:
        acts[1::2] = acts[0::2]
    active = np.flatnonzero(acts)
    if len(active) == 0:
        return
    own, chosen = root[active], rows[active]
    matrix = _whole(compliance, chosen, own, facets)
    right, solution = start[chosen], gap[active]
    _whiten(right, own, facets)
    _whiten(solution, own, facets)
    _conjugate_gradients(matrix, right, solution)
    for i in range(len(active)):
        force[chosen[i]] = solution[i] * own[i, 0]
        if facets and i % 2 == 1:
            force[chosen[i]] += solution[i - 1] * own[i - 1, 1]


@numba.njit(cache=True)
def _whiten(vector, root, facets):  # type: ignore
    """Rᵀ times a vector, in place."""
    for i in range(len(vector)):
        vector[i] *= root[i, 0]
        if facets and i % 2 == 0:
            vector[i] += root[i, 1] * vector[i + 1]


@numba.njit(cache=True)
def _whole(compliance, rows, root, facets):  # type: ignore
    """1 - Rᵀ F R of the active rows."""
    size = len(rows)
    matrix = np.empty((size, size))
    for i in range(size):
        column = compliance[rows[i]]
        for j in range(size):
            matrix[i, j] = -column[rows[j]]
        _whiten(matrix[i], root, facets)
    for i in range(size):
        matrix[i] *= root[i, 0]
        if facets and i % 2 == 0:
            matrix[i] += root[i, 1] * matrix[i + 1]
        matrix[i, i] += 1.0
    return matrix


@numba.njit(cache=True)
def _conjugate_gradients(matrix, right, solution):  # type: ignore
    """Solve a symmetric positive definite system from a first guess, in place."""
    rest = right - matrix @ solution
    direction = rest.copy()
    square = rest @ rest
    enough = RESIDUAL**2 * (right @ right)
    for _ in range(4 * len(right)):
        if square <= enough:
            break
        image = matrix @ direction
        length = square / (direction @ image)
        solution += length * direction
        rest -= length * image
        new = rest @ rest
        direction *= new / square
        direction += rest
        square = new
