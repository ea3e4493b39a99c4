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

from archfem.compiled.kernel import ITERATIONS, integrals, open_part

ROUGH = 1e-3
"""What the first pass leaves of its residual; later ones leave the less the better they converge,
as of Eisenstat and Walker (SIAM J. Sci. Comput. 17, 1996)."""


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
    facets, stiffness = law[0], chosen(law[1], rows)
    matrix, free, own = _square(compliance, rows), chosen(start, rows), chosen(force, rows)
    root, wanted = np.zeros((len(rows), 2)), np.empty(len(rows))
    gap, left, last = free + matrix @ own, ROUGH, 0.0
    for passes in range(1, ITERATIONS + 1):
        _roots(gap, stiffness, facets, root)
        gap = _solve(free, matrix, (root, facets), own, (left, 0.1 * enough))
        pulls(gap, (facets, stiffness), wanted)
        off = np.max(np.abs(wanted - own))
        if off <= enough:
            for i in range(len(rows)):
                force[rows[i]] = own[i]
            return passes
        left = min(ROUGH, (off / last) ** 2) if last > 0.0 else ROUGH
        last = off
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
def chosen(vector, rows):  # type: ignore
    """Entries of a vector."""
    result = np.empty(len(rows))
    for i in range(len(rows)):
        result[i] = vector[rows[i]]
    return result


@numba.njit(cache=True)
def _square(matrix, rows):  # type: ignore
    """Rows and columns of a matrix."""
    result = np.empty((len(rows), len(rows)))
    for i in range(len(rows)):
        line = matrix[rows[i]]
        for j in range(len(rows)):
            result[i, j] = line[rows[j]]
    return result


@numba.njit(cache=True)
def _roots(gap, stiffness, facets, root):  # type: ignore
    """R: the diagonal entry of each row and, for the first end of a facet, the one below it."""
    root[:] = 0.0
    for i in range(0, len(gap), 2 if facets else 1):
        scale = np.sqrt(stiffness[i])
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
    """Solve for μ with R given by conjugate gradients, from the last λ; the gaps, and λ in place.

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
