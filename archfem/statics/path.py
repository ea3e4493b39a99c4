"""Paths of equilibrium: a load that grows, or a support that moves, step by step."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from archfem.arrays import Array
from archfem.errors import DidNotConverge
from archfem.masonry.actions import BodyForce, PointLoad
from archfem.models.gauges import Gauges
from archfem.models.model import Model
from archfem.models.moving import Moving
from archfem.statics.equilibrium import Equilibrium, self_weight
from archfem.statics.lasting import ROUNDS, lasts, upset
from archfem.statics.loading import Load
from archfem.statics.newton import ROUGHLY, Solver, magnitude
from archfem.statics.search import found_or_crept

TOLERANCE, ITERATIONS = 1e-9, 30
"""Force left out of balance, relative to the sum of all loads; Newton's iterations in a step."""

FIRST = 1e-6
"""First displacement, relative to the structure's size."""

DENSE = 400
"""Unknowns up to which a bordered system is solved as a dense one."""

FIRM = 1e-3
"""Share of the closed stiffness that a tangent is given where it alone leads nowhere: where several
joints slide or turn under the same load it is singular, although each step has an equilibrium."""


@dataclass(eq=False)
class LoadPath:
    """Equilibria under a growing load found so far, and what is needed for the next.

    Attributes:
        model: what is loaded, at the last step.
        dead: generalised forces of the self-weight (n,).
        load: what grows.
        unit: displacement and factor of the first step of an elastic structure.
        states: coordinates at each step, the dead load's first (n,).
        resisted: N, V, M of every joint at each step (n_joints, 3) [N, N, N m].
        factors: of the load at each step [-].
        iterations: of Newton's method in each step.
        units: of the factors.
        moving: what it is whose displacement is told.
    """

    model: Model
    dead: Array
    load: Load
    unit: tuple[float, float]
    states: list[Array]
    resisted: list[Array]
    factors: list[float]
    iterations: list[int]
    units = "1"
    moving = "load"

    @classmethod
    def of(
        cls, model: Model, actions: Sequence[BodyForce | PointLoad], start: Equilibrium
    ) -> "LoadPath":
        """Begin at the dead load's equilibrium.

        Args:
            model: what is loaded.
            actions: that grow together.
            start: the equilibrium under the dead load.

        Returns:
            A path of this one state.

        Raises:
            InvalidInput: the load is zero.
        """
        load = Load.of(model, actions)
        live = load.forces(start.q)
        first = FIRST * model.structure.size
        give = float(live @ splu(model.tangent(start.q).tocsc()).solve(live)) / load.size
        unit = (first, first / give)
        resisted = [model.resultants(start.q)]
        return cls(model, self_weight(model), load, unit, [start.q], resisted, [0.0], [0])

    @property
    def displacements(self) -> Array:
        """Of the load along itself, since the dead load (steps,) [m]."""
        first = self.load.moved(self.states[0])
        return np.array([self.load.moved(q) - first for q in self.states])

    @property
    def resultants(self) -> Array:
        """N, V, M of every joint (steps, n_joints, 3) [N, N, N m]."""
        return np.array(self.resisted)

    @property
    def faces(self) -> Array:
        """Gaps at mid-depth, rotations and slips of joints (steps, 3, n_joints) [m, rad, m]."""
        gauges = Gauges.on(self.model)
        return gauges.faces(np.array([gauges.read(q) for q in self.states]))

    def advance(self, border: Array, distance: float) -> bool:
        """Add the equilibrium at a distance along the border's direction.

        Args:
            border: a and b of the further equation (2,).
            distance: its right side, from the last state on.

        Returns:
            Whether there is one.
        """
        along, up = border / np.array(self.unit)
        probe = self.load.forces(self.states[-1]) / self.load.size
        row = np.append(along * probe, up)
        x = np.append(self.states[-1], self.factors[-1])
        target = float(row @ x) + distance
        return any(self._reached(row, target, distance, share) for share in (0.0, FIRM))

    def onward(self, distance: float) -> bool:
        """Add the equilibrium in the hyperplane across the last step, at a distance.

        Unlike `advance` it follows a path on which the load itself moves back for a while, as when
        a hinge moves from one joint to the next. Lengths are mean ones of all that has mass.

        Args:
            distance: from the last state on, in units of the first step.

        Returns:
            Whether there is one.
        """
        if len(self.states) < 2:
            return self.advance(np.array([1.0, 1.0]) / np.sqrt(2.0), distance)
        mass = self.model.structure.weight / self.model.structure.gravity
        moved, grown = self.states[-1] - self.states[-2], self.factors[-1] - self.factors[-2]
        across = np.append(
            self.model.mass @ moved / (mass * self.unit[0] ** 2), grown / self.unit[1] ** 2
        )
        step = np.append(moved, grown)
        length = np.sqrt(across @ step)
        row = across / length
        x = np.append(self.states[-1], self.factors[-1])
        target = float(row @ x) + distance
        return self._reached(row, target, distance, 0.0, x + distance / length * step)

    def creep(self, grown: float, farthest: float) -> bool:
        """Add the equilibrium to which the structure creeps under a load that has grown.

        Where many joints slide, full steps of Newton's method lead nowhere although the structure
        bears more. Blocks that may turn far do not creep.

        Args:
            grown: growth of the factor [-].
            farthest: displacement of the load beyond which it has given way [m].

        Returns:
            Whether there is one.
        """
        q, factor = self.states[-1], self.factors[-1] + grown
        load = self.dead + factor * self.load.forces(q)
        if isinstance(self.model, Moving):
            return False
        try:
            model, solved = found_or_crept(Solver(len(q)), self.model, load, q)
        except DidNotConverge:
            return False
        if self.load.moved(solved.q) - self.load.moved(self.states[0]) > farthest:
            return False
        self._add(model, np.append(solved.q, factor), solved.iterations)
        return True

    def _reached(
        self,
        row: Array,
        target: float,
        distance: float,
        share: float,
        start: Array | None = None,
    ) -> bool:
        """Add the equilibrium where row × (q, λ) is the target, once it lasts.

        Returns:
            Whether Newton's method found it.
        """
        x = np.append(self.states[-1], self.factors[-1]) if start is None else start
        model, taken = self.model, 0
        for number in range(ROUNDS):
            found = self._balanced(model, x, (row, target, distance), share)
            if found is None:
                return False
            x, taken = found[0], taken + found[1]
            if not upset(model) or (number > 0 and lasts(model, x[:-1], found[1])):
                self._add(model, x, taken)
                return True
            model = model.remembering(model.remembered(x[:-1]))
        return False

    def _balanced(
        self, model: Model, x: Array, ahead: tuple[Array, float, float], share: float
    ) -> tuple[Array, int] | None:
        """Find (q, λ) in one (n + 1,) and its iterations; tangents share the closed one."""
        row, target, distance = ahead
        for iteration in range(ITERATIONS if share == 0.0 else 2 * ITERATIONS):
            tangent, rate = model.tangent(x[:-1]), self.load.rate(x[:-1])
            if rate is not None:
                tangent = tangent - x[-1] * rate
            rest, missing = self._rest(model, x), target - row @ x
            if abs(missing) <= TOLERANCE * distance and self._fits(rest, x, tangent):
                return x, iteration
            if share > 0.0:
                tangent = (1.0 - share) * tangent + share * model.closed()
            step = _solved(tangent, self.load.forces(x[:-1]), row, np.append(rest, missing))
            if step is None:
                return None
            x = x + step
        return None

    def _add(self, model: Model, x: Array, iterations: int) -> None:
        """Add an equilibrium, (q, λ) in one (n + 1,), and what the joints remember of it."""
        self.states.append(x[:-1])
        self.resisted.append(model.resultants(x[:-1]))
        self.model = model.remembering(model.remembered(x[:-1]))
        self.factors.append(float(x[-1]))
        self.iterations.append(iterations)

    def _rest(self, model: Model, x: Array) -> Array:
        """Forces out of balance at q and λ in one (n,)."""
        rest: Array = self.dead + x[-1] * self.load.forces(x[:-1]) - model.force(x[:-1])
        return rest

    def _fits(self, rest: Array, x: Array, tangent: sparse.csr_matrix) -> bool:
        """Whether forces are in balance, or off by no more than round-off of large motions."""
        load = magnitude(self.dead) + abs(x[-1]) * magnitude(self.load.forces(x[:-1]))
        off = magnitude(rest)
        if off <= TOLERANCE * load or off > ROUGHLY * load:
            return bool(off <= TOLERANCE * load)
        return bool(off <= 8.0 * np.finfo(float).eps * magnitude(abs(tangent) @ abs(x[:-1])))


def _solved(tangent: sparse.csr_matrix, load: Array, row: Array, right: Array) -> Array | None:
    """Solve for steps of q and λ; None where their matrix is exactly singular."""
    size = len(load)
    try:
        if size < DENSE:
            matrix = np.empty((size + 1, size + 1))
            matrix[:size, :size] = tangent.toarray()
            matrix[:size, size], matrix[size] = -load, row
            return np.asarray(np.linalg.solve(matrix, right))
        column = sparse.csr_matrix(-load[:, None])
        bordered = sparse.vstack([sparse.hstack([tangent, column]), sparse.csr_matrix(row)], "csc")
        return np.asarray(splu(bordered).solve(right))
    except (RuntimeError, np.linalg.LinAlgError):  # SuperLU's, LAPACK's
        return None
