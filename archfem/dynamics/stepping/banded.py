"""The strategy for chains of blocks: time and memory grow with their number, not its square.

Where blocks follow one another the matrices have a small bandwidth, and a step is one solve with a
banded factor of

    K_s + μ M + ν R + Gᵀ D G,

K_s the stiffness without that of joints across their faces, D that of their closed parts, which
follows from the gaps that come out. The factor is kept until D changes.
"""

from typing import Any, ClassVar, NamedTuple, Self

import numba
import numpy as np
from numba.extending import overload
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from archfem.arrays import Array
from archfem.dynamics.stepping.band import factorise, substitute
from archfem.dynamics.stepping.equation import Equation
from archfem.dynamics.stepping.joint_law import closed_stiffness, pulls
from archfem.dynamics.stepping.linear import Linear, reordered, solve
from archfem.dynamics.stepping.loop import ITERATIONS
from archfem.dynamics.stepping.small_problem import SETTLED
from archfem.dynamics.stepping.sparse_rows import times
from archfem.dynamics.stepping.strategy import Reordered

WIDEST = 64
"""Bandwidth up to which a factor is made anew whenever a joint opens."""

AFRESH = 256
"""Changes of the joints after which the band is summed up anew, lest rounding add up."""


class BandedSystem(NamedTuple):
    """A structure's matrices in an order of small bandwidth.

    Attributes:
        linear: its matrices by rows.
        without: K_s + μ M + ν R as a band, rows from the diagonal leftwards (n, width).
        band: the same with the joints as they are closed now.
        factor: of that.
        stiffness: D now, of each point with itself and with its partner (p, 2).
        wanted: room for what the gaps ask for instead (p, 2).
        changes: of D since the band was summed up; negative as long as it never was (1,).
    """

    linear: Linear
    without: Array
    band: Array
    factor: Array
    stiffness: Array
    wanted: Array
    changes: Any


class Banded(Reordered):
    """Steps on matrices of small bandwidth.

    Args:
        equation: of motion.
        order: of the coordinates (n,).
        width: bandwidth in this order.
    """

    name: ClassVar[str] = "chain"
    setup: float = 0.0

    def __init__(self, equation: Equation, order: NDArray[Any], width: int) -> None:
        super().__init__(order)
        self._equation = equation
        self._width = width

    @classmethod
    def of(cls, equation: Equation) -> Self | None:
        """Return the strategy, or None where the bandwidth is too large, or steps are averaged.

        Args:
            equation: of motion.
        """
        order, width = narrow(equation.model.mass)
        fits = equation.joints is not None and not equation.conserving and width <= WIDEST
        return cls(equation, order, width) if fits else None

    def system(self, dt: float) -> BandedSystem:
        """Return all that steps of this length need.

        Args:
            dt: time step [s].
        """
        equation, joints, order = self._equation, self._equation.joints, self.order
        assert joints is not None
        linear = reordered(equation, order, dt)
        numbers = linear.numbers
        without = (
            equation.model.blocks
            + joints.slip.T @ sparse.diags(joints.points.shear) @ joints.slip
            + numbers.inertia * equation.model.mass
            + numbers.rate * equation.rest
        ).tocsr()
        band = banded(without[order][:, order], self._width)
        points = (len(joints.points.arm), 2)
        return BandedSystem(
            linear,
            band,
            np.empty_like(band),
            np.empty_like(band),
            np.zeros(points),
            np.zeros(points),
            np.full(1, -1),
        )


def narrow(matrix: sparse.csr_matrix) -> tuple[NDArray[Any], int]:
    """Return an order that brings couplings near the diagonal (n,), and the bandwidth.

    Args:
        matrix: symmetric (n, n).
    """
    found = reverse_cuthill_mckee(matrix, symmetric_mode=True)
    natural = np.arange(matrix.shape[0])
    best = min((found, natural), key=lambda each: _bandwidth(matrix, each))
    return best, _bandwidth(matrix, best)


def _bandwidth(matrix: sparse.csr_matrix, order: NDArray[Any]) -> int:
    place = np.argsort(order)
    rows = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    return int(np.abs(place[rows] - place[matrix.indices]).max(initial=0))


def banded(matrix: sparse.csr_matrix, width: int) -> Array:
    """Return the lower band of a matrix, rows from the diagonal leftwards (n, width + 1).

    Args:
        matrix: symmetric (n, n).
        width: bandwidth; entries beyond it are left out.
    """
    entries = matrix.tocoo()
    left = entries.row - entries.col
    lower = (left >= 0) & (left <= width)
    result = np.zeros((matrix.shape[0], width + 1))
    result[entries.row[lower], left[lower]] = entries.data[lower]
    return result


@overload(solve)
def _solve(system, vector, gap, before, force):  # type: ignore
    return _solved if getattr(system, "instance_class", None) is BandedSystem else None


def _solved(system, vector, gap, before, force):  # type: ignore
    """Solve a step: from its right side to the contact, in place; leaves gaps and λ.

    Begins with the factor of the last step.

    Returns:
        How often that was solved; -1 if the joints do not settle.
    """
    linear, law = system.linear, system.linear.law
    right = vector.copy()
    if system.changes[0] < 0 or system.changes[0] >= AFRESH:
        system.band[:] = system.without
        system.stiffness[:] = 0.0
        closed_stiffness(gap, law, system.wanted)
        if not _changed(system):
            return -1
        system.changes[0] = 0
    for passes in range(1, ITERATIONS + 1):
        vector[:] = right
        substitute(system.factor, vector)
        times(linear.opening, vector, gap)
        closed_stiffness(gap, law, system.wanted)
        if _agreed(gap, system.stiffness, system.wanted, law.facets):
            pulls(gap, law, force)
            return passes
        if not _changed(system):
            return -1
    return -1


@numba.njit(cache=True)
def _agreed(gap, old, new, facets):  # type: ignore
    """Whether the gaps ask for the stiffness they were found with."""
    largest, off = 0.0, 0.0
    for row in range(len(gap)):
        other = gap[row ^ 1] if facets else 0.0
        force = new[row, 0] * gap[row] + new[row, 1] * other
        largest = max(largest, abs(force))
        off = max(off, abs(force - old[row, 0] * gap[row] - old[row, 1] * other))
    return off <= SETTLED * largest


@numba.njit(cache=True)
def _changed(system):  # type: ignore
    """Bring the band to the stiffness that is wanted of the joints; whether it is definite."""
    stiffness, wanted, band = system.stiffness, system.wanted, system.band
    indptr, indices, data = system.linear.opening
    for row in range(len(stiffness)):
        for which in range(2):
            difference = wanted[row, which] - stiffness[row, which]
            if difference == 0.0:
                continue
            stiffness[row, which] = wanted[row, which]
            other = row if which == 0 else row ^ 1
            for first in range(indptr[row], indptr[row + 1]):
                i, left = indices[first], difference * data[first]
                for second in range(indptr[other], indptr[other + 1]):
                    j = indices[second]
                    if j <= i:
                        band[i, i - j] += left * data[second]
    system.changes[0] += 1
    if factorise(band, system.factor):
        return True
    system.changes[0] = -1
    return False
