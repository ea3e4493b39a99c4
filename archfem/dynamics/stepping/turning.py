"""The strategy for blocks that move as far as they like: Newton's method at every step.

Nothing is linear here but the inertia and the blocks themselves. With the coordinates in an order
that makes the tangent a narrow band,

    (2 M/Δt² + C/Δt + (½ + β/Δt) K) Δq - 2 M v/Δt + K q + f̄(q, q + Δq) = p - M r a_g,

f̄ the mean force of the joints, by `joints.moving`. Passes that go round in a circle, of points that
hold and slide in turn, are shortened until they leave less out of balance.
"""

from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numba.extending import overload
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from archfem.arrays import Array
from archfem.dynamics.stepping.band_lu import banded, half_width
from archfem.dynamics.stepping.elimination import Elimination, Indices
from archfem.dynamics.stepping.equation import Equation
from archfem.dynamics.stepping.loop import begin, measure, settle
from archfem.dynamics.stepping.panel_lu import NO_PANELS, Panels, panels_of
from archfem.dynamics.stepping.sparse_rows import Rows, row_times, rows_of, stored, trimmed
from archfem.dynamics.stepping.strategy import Reordered
from archfem.dynamics.stepping.turning_newton import sought
from archfem.joints.moving.compiled import computing
from archfem.joints.moving.moved import Answer, Moved, answer, joint_energy
from archfem.joints.moving.poses import Sides
from archfem.models.moving import Moving

ENOUGH = 1e-9
"""Force left out of balance, relative to the weight: energy drifts by 1e-8 of what is exchanged."""

ROUNDED = 1e-13
"""Correction, relative to the size of the structure, below which more passes change nothing."""

WHOLE = (3, 0)
"""Passes that go all the way, before those that must leave less out of balance; at a second try
none does."""

WIDE = 40
"""Half-width of a band from which a sparse factor takes its place, and is kept while it serves."""

COARSER = 10.0
"""Of `ENOUGH`, where factors are kept: passes by them round to about as much."""

SETUP = 0.05
"""Estimate of the time until the first step can be taken [s]."""


class TurningSystem(NamedTuple):
    """A structure in the order of its band, and the numbers of a step.

    Attributes:
        turning: joints.
        room: for what joints do over a step.
        slid: how far points have slid for good at its start (p,) [m].
        mass: M.
        blocks: K, of the blocks alone.
        viscous: C.
        effective: 2 M/Δt² + C/Δt + (½ + β/Δt) K.
        band: the same as a band (n, 3 b + 1), without rows where that is wide.
        panels: the same in panels then, to which joints add.
        weight: forces of gravity (n,).
        body: forces per unit ground acceleration (2, n).
        step: Δt, and β/Δt.
        enough: force left out of balance that ends the passes [N], and correction [m].
    """

    turning: Moved
    room: Answer
    slid: Array
    mass: Rows
    blocks: Rows
    viscous: Rows
    effective: Rows
    band: Array
    panels: Panels
    weight: Array
    body: Array
    step: tuple[float, float]
    enough: tuple[float, float]


class Turning(Reordered):
    """Steps of blocks that move as far as they like.

    Args:
        equation: of motion.
    """

    name: ClassVar[str] = "turning"

    def __init__(self, equation: Equation) -> None:
        model = equation.model
        assert isinstance(model, Moving)
        self._equation: Equation = equation
        self._model: Moving = model
        order, self._elimination = _narrow(model), None
        if half_width(model.closed()[order][:, order]) >= WIDE:
            self._elimination = Elimination.of(model.closed())
            order = self._elimination.order
        super().__init__(order)

    @classmethod
    def of(cls, equation: Equation) -> Self | None:
        """Return the strategy, or None where displacements are small.

        Args:
            equation: of motion.
        """
        fits = isinstance(equation.model, Moving) and equation.conserving
        return cls(equation) if fits else None

    @property
    def setup(self) -> float:
        """Estimate of the time until the first step can be taken [s]."""
        return SETUP

    def system(self, dt: float) -> TurningSystem:
        """Return all that steps of this length need.

        Args:
            dt: time step [s].
        """
        equation, model, order = self._equation, self._model, self.order
        late = equation.lag / dt
        mass, blocks, viscous = (
            each[order][:, order].tocsr() for each in (model.mass, model.blocks, equation.viscous)
        )
        effective = ((2.0 / dt**2) * mass + viscous / dt + (0.5 + late) * blocks).tocsr()
        room, sides = answer(model.joints), self._sides()
        band, panels = np.zeros((0, 1)), NO_PANELS
        if self._elimination is None:
            band = banded(effective, half_width(model.closed()[order][:, order]))
        else:
            panels = panels_of(effective, self._elimination, _rates(sides))
        balance = ENOUGH * (COARSER if self._elimination else 1.0)
        return TurningSystem(
            model.joints._replace(sides=sides),
            room,
            np.zeros_like(room.slid),
            rows_of(trimmed(mass)),
            rows_of(trimmed(blocks)),
            rows_of(trimmed(viscous)),
            rows_of(effective),
            band,
            panels,
            equation.weight[order],
            np.ascontiguousarray(model.body[order].T),
            (dt, late),
            (balance * float(np.linalg.norm(equation.weight)), ROUNDED * model.structure.size),
        )

    def _sides(self) -> Sides:
        """The joints' faces, with coordinates in the order of the band."""
        sides = self._model.joints.sides
        return sides._replace(index=self._place[sides.index])


def _narrow(model: Moving) -> Any:
    """Order coordinates so that neighbours stay close: blocks, or with a fill each by itself."""
    if not model.turning.all():
        return reverse_cuthill_mckee(model.closed(), symmetric_mode=True)
    free, pairs = np.array(model.structure.free), model.structure.pairs
    place = np.full(len(model.structure.blocks), -1)
    place[free] = np.arange(len(free))
    inner = place[pairs[np.all(place[pairs] >= 0, axis=1)]]
    graph = sparse.csr_matrix((np.ones(len(inner)), inner.T), 2 * (len(free),))
    blocks = reverse_cuthill_mckee((graph + graph.T).tocsr(), symmetric_mode=True)
    return np.concatenate([np.arange(*model.starts[k : k + 2]) for k in blocks])


def _rates(sides: Sides) -> Indices:
    """Rows and columns of `Answer.rate`, negative where there is none (2, j, 2, s, 2, s)."""
    own = np.where(np.arange(sides.index.shape[-1]) < sides.size[:, :, None], sides.index, -1)
    rows, columns = np.broadcast_arrays(own[:, :, :, None, None], own[:, None, None])
    none = (rows < 0) | (columns < 0)
    return np.stack([np.where(none, -1, rows), np.where(none, -1, columns)])


class Turned(NamedTuple):
    """What is carried from step to step.

    Attributes:
        band: of a pass, destroyed by it (n, 3 b + 1).
        rest: forces out of balance, destroyed by a pass (n,).
        image: room (n,).
        pulled: K q at the start of the step (n,).
        constant: what of the forces does not depend on the end of the step (n,).
        move: Δq (n,).
        along: the correction (n,).
        entries: of the factor in panels.
        known: whether they are of a pass before (1,).
    """

    band: Array
    rest: Array
    image: Array
    pulled: Array
    constant: Array
    move: Array
    along: Array
    entries: Array
    known: Any


def _is_system(system: Any) -> bool:
    return getattr(system, "instance_class", None) is TurningSystem


@overload(begin)
def _begin(system, state, memory):  # type: ignore
    return _started if _is_system(system) else None


@overload(settle)
def _settle(system, kept, step, states, ground):  # type: ignore
    return _settled if _is_system(system) else None


@overload(measure)
def _measure(system, kept, step, states, ground, results, memory):  # type: ignore
    return _measured if _is_system(system) else None


def _started(system, state, memory):  # type: ignore
    """Room for the steps, and what joints remember."""
    size = state.shape[1]
    system.slid[: len(memory)] = memory
    return Turned(
        np.empty_like(system.band),
        np.zeros(size),
        np.zeros(size),
        np.zeros(size),
        np.zeros(size),
        np.zeros(size),
        np.zeros(size),
        np.empty_like(system.panels.base),
        np.zeros(1, dtype=np.bool_),
    )


def _settled(system, kept, step, states, ground):  # type: ignore
    """Take a step by Newton's method."""
    (old, new), looks = states, 0
    _load(system, kept, old, ground)
    for whole in WHOLE:
        for k in range(len(kept.move)):
            kept.move[k] = system.step[0] * old[1, k]
        found, done = sought(system, kept, old[0], new[0], whole)
        looks += found
        if done:
            for k in range(len(kept.move)):
                new[1, k] = (2.0 / system.step[0]) * kept.move[k] - old[1, k]
                new[2, k] = (new[1, k] - old[1, k]) / system.step[0]
            return looks
    return -1


@computing
def _load(system, kept, old, ground):  # type: ignore
    """Forces that do not depend on the end of the step."""
    constant, body, blocks = kept.constant, system.body, stored(system.blocks) > 0
    pulled = kept.pulled
    for k in range(len(constant)):
        inertia = 2.0 / system.step[0] * row_times(system.mass, k, old[1])
        constant[k] = system.weight[k] + inertia - ground[0] * body[0, k] - ground[1] * body[1, k]
        if blocks:
            pulled[k] = row_times(system.blocks, k, old[0])
            constant[k] -= pulled[k]


def _measured(system, kept, step, states, ground, results, memory):  # type: ignore
    """Mean resultants and energies of a step, and what joints remember at its end."""
    (resultants, energy), room, new = results, system.room, states[1]
    resultants[:] = room.resultants
    _energies(system, kept, new, ground, energy)
    memory[:] = system.slid[: len(memory)]


@computing
def _energies(system, kept, new, ground, energy):  # type: ignore
    """Find energies of a step; what joints remember from now on is what they do at its end."""
    (dt, late), room, move = system.step, system.room, kept.move
    energy[0] = energy[1] = energy[2] = energy[3] = 0.0
    for k in range(len(room.slid)):
        system.slid[k] = room.slid[k]
    for k in range(len(room.lost)):
        energy[3] += room.lost[k]
    for k in range(len(move)):
        energy[0] += 0.5 * new[1, k] * row_times(system.mass, k, new[1])
        energy[1] -= system.weight[k] * new[0, k]
        energy[2] -= move[k] * (ground[0] * system.body[0, k] + ground[1] * system.body[1, k])
        more = row_times(system.blocks, k, move)
        energy[1] += 0.5 * new[0, k] * (kept.pulled[k] + more)
        energy[3] += late * move[k] * more
        energy[3] += move[k] * row_times(system.viscous, k, move) / dt
    energy[1] += joint_energy(system.turning, new[0], system.slid)
