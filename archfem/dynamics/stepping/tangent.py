"""The strategy for joints that slide: Newton's method on the whole structure, its tangent sparse.

Where many points open or slide at once, the problem in those alone is as large as that of the
structure, and dense. Here each pass solves

    (K + μ M + ν R - Gᵀ λ' G) w = r + Gᵀ (λ - λ' z),

in dense panels, of which those that no joint touches, as inside a fill, are eliminated once. So a
pass takes as long however many points slide; and its tangent serves the next ones while it does.
Blocks that make a chain need none of this: their joints have a band of their own (`chain`).
"""

import itertools
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numba.extending import overload
from scipy import sparse

from archfem.dynamics.stepping import passing  # noqa: F401  (steps of the conserving scheme)
from archfem.dynamics.stepping.elimination import Elimination, Indices
from archfem.dynamics.stepping.equation import Equation
from archfem.dynamics.stepping.linear import Gaps, Linear, gaps_of, reordered, solve
from archfem.dynamics.stepping.panel_lu import Panels, panels_of
from archfem.dynamics.stepping.path_law import PathLaw, pairs_of
from archfem.dynamics.stepping.sparse_rows import trimmed
from archfem.dynamics.stepping.strategy import Reordered
from archfem.dynamics.stepping.tangent_newton import sought
from archfem.dynamics.stepping.tangent_pass import Pairs, Room

ENTRY = 2e-5
"""What ordering and factorising take, for each entry of the mass matrix [s]."""


class TangentSystem(NamedTuple):
    """A structure's matrices in the order in which its tangent is eliminated.

    Attributes:
        linear: its matrices by rows.
        panels: the tangent with all joints closed, to which they add.
        pairs: rows of gaps of which one changes the force at another, and entries of the tangent.
        room: for what is found in a step.
    """

    linear: Linear
    panels: Panels
    pairs: Pairs
    room: Room


class Tangent(Reordered):
    """Steps by Newton's method with the tangent of the whole structure.

    Args:
        equation: of motion, by the conserving scheme.
    """

    name: ClassVar[str] = "tangent"

    def __init__(self, equation: Equation) -> None:
        self._equation, self._elimination = equation, Elimination.of(_pattern(equation))
        super().__init__(self._elimination.order)

    @classmethod
    def of(cls, equation: Equation) -> Self | None:
        """Return the strategy, or None where no joint can slide, or blocks make a chain.

        Args:
            equation: of motion.
        """
        joints = equation.joints
        if joints is None or not equation.conserving or not joints.slides:
            return None
        law = gaps_of(equation, 1.0).law
        return None if isinstance(law, PathLaw) and law.chain.half > 0 else cls(equation)

    @property
    def setup(self) -> float:
        """Estimate of the time until the first step can be taken [s]."""
        return ENTRY * float(self._equation.model.mass.nnz)

    def system(self, dt: float) -> TangentSystem:
        """Return all that steps of this length need.

        Args:
            dt: time step [s].
        """
        equation, order = self._equation, self.order
        linear = reordered(equation, order, dt)
        law, numbers = linear.law, linear.numbers
        assert isinstance(law, PathLaw)
        closed = (
            trimmed(equation.model.closed())
            + numbers.inertia * trimmed(equation.model.mass)
            + numbers.rate * trimmed(equation.rest)
        )[order][:, order].tocsr()
        pairs, changed = _blocks(linear.opening, pairs_of(law)[0])
        panels = panels_of(closed, self._elimination, changed)
        room = Room.of(law, panels, len(pairs.rows))
        return TangentSystem(linear, panels, pairs._replace(places=panels.added), room)


def _blocks(opening: Any, pairs: Indices) -> tuple[Pairs, Indices]:
    """Pairs block by block, and rows and columns of the entries that these change (2, m)."""
    indptr, indices, _ = opening
    moved = [tuple(indices[a:b].tolist()) for a, b in itertools.pairwise(indptr)]
    found: dict[Any, list[int]] = {}
    for number, (row, column) in enumerate(pairs):
        found.setdefault((moved[row], moved[column]), []).append(number)
    others = [np.unique(pairs[each, 1], return_inverse=True) for each in found.values()]
    ends = [np.meshgrid(*key, indexing="ij") for key in found]

    def starts(parts: Any) -> Indices:
        return np.cumsum([0, *map(len, parts)])

    changed = np.concatenate([np.stack([each.ravel() for each in end]) for end in ends], axis=1)
    return Pairs(
        pairs,
        np.concatenate([*found.values()]),
        starts(found.values()),
        np.concatenate([each[0] for each in others]),
        starts([each[0] for each in others]),
        np.concatenate([each[1] for each in others]),
        np.cumsum([0, *(end[0].size for end in ends)]),
        np.zeros(0, np.int64),
    ), changed.astype(np.int64)


def _pattern(equation: Equation) -> sparse.csr_matrix:
    """All entries that the tangent may have, as ones."""
    model = equation.model
    rows: Gaps = gaps_of(equation, 1.0)
    assert isinstance(rows.law, PathLaw)
    pairs, count = pairs_of(rows.law)[0], rows.gaps.shape[0]
    coupled = sparse.csr_matrix((np.ones(len(pairs)), pairs.T), (count, count))
    touched = abs(trimmed(rows.gaps))
    parts = [abs(trimmed(each)) for each in (model.mass, equation.rest, model.closed())]
    pattern = sum(parts) + touched.T @ (coupled + coupled.T) @ touched
    return sparse.csr_matrix((np.ones(pattern.nnz), pattern.indices, pattern.indptr))


@overload(solve)
def _solve(system, vector, gap, before, force):  # type: ignore
    return _solved if getattr(system, "instance_class", None) is TangentSystem else None


def _solved(system, vector, gap, before, force):  # type: ignore
    """Solve a step: from its right side to the contact, in place; leaves gaps and λ.

    Returns:
        Passes; -1 if they do not settle.
    """
    before[:] = gap
    return sought(system, vector, gap, force)
