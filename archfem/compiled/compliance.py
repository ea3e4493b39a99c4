"""Time stepping for large structures: one sparse factor for the run, unknowns at open points only.

The effective matrix with all joints closed is factorised once for a time step. With it a step is

    (K + μ M + ν C) w = p + M y + C x + Gᵀ λ,    z = G w,    λ = J(z) z,

w the contact u + β v where the equation is written, λ the forces that take tension out of the
closed joints. Multiplying by G leaves a small problem in the points that are open, with their
compliance F = G (K + μ M + ν C)⁻¹ Gᵀ, found point by point as they open. What comes out is checked
against the gaps of the whole structure. It is `contact` without the modes, for structures that
have too many of them, and takes any damping: the history is that of the equilibrium solves of
`dynamics`, to rounding.
"""

import numpy as np
from scipy import sparse

from archfem.compiled import march
from archfem.compiled.batches import POINT, STEPS, Reordered, Room, compiled_law, shear_resultants
from archfem.compiled.factor import Plan, factorised
from archfem.compiled.newmark import Numbers, numbers_of
from archfem.compiled.products import Rows
from archfem.dynamics import Stepper
from archfem.models.jointed import Jointed
from archfem.schemes import Rayleigh

NOTHING = 1e-16
"""Entries of a matrix, relative to its largest, that are rounding left by cancellation."""


def applies(model: Jointed) -> bool:
    """Whether supports have not moved."""
    return model.operator.offset is None


def work(model: Jointed) -> float:
    """About how long a step takes with joints that open often, set-up included [µs]."""
    return 25.0 + POINT * model.operator.opening.shape[0] + (4e-3 + 5.0 / STEPS) * model.mass.nnz


class ComplianceMethod(Reordered):
    """Steps with one sparse factor of a model's effective matrix.

    Args:
        exact: the same steps, and what they are made of.
        damping: None is undamped.
    """

    name = "compliance"

    def __init__(self, exact: Stepper, damping: Rayleigh | None) -> None:
        assert isinstance(exact.model, Jointed)
        self._model = exact.model
        self._scheme = exact.scheme
        self._lag = exact.lag
        self._drag = damping.mass if damping else 0.0
        model, rest = self._model, exact.damping - self._drag * self._model.mass
        parts = [_trimmed(each) for each in (model.mass, rest, model.closed())]
        self._plan = Plan.of(sum(abs(part) for part in parts))
        super().__init__(self._plan.order)
        self._parts = [part[self._order][:, self._order] for part in parts]
        self._weight = exact.weight[self._order]
        self._law = compiled_law(self._model)
        self._step: tuple[float, march.Matrices, Numbers] | None = None

    def take(self, dt: float, room: Room) -> int:
        """Take steps up to the last, or up to one whose open points do not settle."""
        matrices, numbers = self._prepared(dt)
        return int(
            march.advance(
                room.series,
                room.gap,
                (room.resultants, room.iterations, room.energy),
                np.stack([room.seen, room.mean]),
                matrices,
                numbers,
                self._law,
            )
        )

    def _prepared(self, dt: float) -> tuple[march.Matrices, Numbers]:
        """What a step of this length needs."""
        if self._step is None or self._step[0] != dt:
            scheme = (self._scheme.beta, self._scheme.gamma, self._scheme.alpha)
            numbers = numbers_of(dt, scheme, self._lag, self._drag)
            self._step = (dt, self._matrices(numbers), numbers)
        return self._step[1:]

    def _matrices(self, numbers: Numbers) -> march.Matrices:
        model, count = self._model, len(self._law[1])
        mass, damping, closed = self._parts
        effective = closed + numbers.inertia * mass + numbers.rate * damping
        return march.Matrices(
            _rows(mass),
            _rows(damping),
            _rows(closed),
            _rows(_trimmed(model.operator.opening[:, self._order])),
            _rows(_trimmed(shear_resultants(model)[:, self._order])),
            self._weight,
            np.ascontiguousarray(model.body[self._order].T),
            factorised(effective, self._plan),
            self._plan.group_of,
            np.empty((count, count)),
            np.zeros(count, dtype=np.bool_),
        )


def _trimmed(matrix: sparse.csr_matrix) -> sparse.csr_matrix:
    """A matrix without entries that are nothing but rounding."""
    kept = matrix.tocsr(copy=True)
    kept.data[np.abs(kept.data) <= NOTHING * np.abs(kept.data).max(initial=0.0)] = 0.0
    kept.eliminate_zeros()
    return kept


def _rows(matrix: sparse.csr_matrix) -> Rows:
    return matrix.indptr, matrix.indices, matrix.data
