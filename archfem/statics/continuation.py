"""Continuation of equilibria: a growing load, or a support that moves, step by step.

A step of a growing load has one more unknown, the load factor λ, and one more equation,
row·(q, λ) = target: control by force, by displacement or by arc length differ in the row alone.
The bordered system is solved as a whole, so that its matrix stays regular where the tangent is
singular. Loads may depend on the coordinates where blocks rotate far.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from math import hypot

import numpy as np
from scipy import sparse
from scipy.linalg import lapack
from scipy.sparse.csgraph import connected_components

from archfem._typing import Array
from archfem.errors import ArchfemError, DidNotConverge, InvalidInput
from archfem.limit.linear_programme import RigidBlocks
from archfem.limit.self_weight import self_weight_programme
from archfem.masonry.loads import BodyForce, PointLoad, Settlement
from archfem.models.model import Model
from archfem.statics import relaxation
from archfem.statics.equilibrium import Equilibrium, self_weight
from archfem.statics.newton import MAX_ROUND_OFF_RESIDUAL, EquilibriumSolver, load_magnitude
from archfem.statics.newton_iteration import factorise

# Residual relative to the sum of all loads, and of the added equation relative to the step [-]
RESIDUAL_TOLERANCE = 1e-9

# Row and right side of the added equation, and the length of the step
Goal = tuple[Array, float, float]

# Finds the next equilibrium of a path, whose steps are small: what slid in creep stays there
_solve_next = partial(relaxation.solve_or_relax, in_proportion=False)

# First displacement, relative to the structure's size [-]
FIRST_DISPLACEMENT = 1e-6


@dataclass(frozen=True, eq=False)
class GrowingLoad:
    """Actions on a model that grow together."""

    model: Model
    actions: tuple[BodyForce | PointLoad, ...]
    size: float  # sum of the magnitudes of the actions [N]
    first: Array  # generalised forces before anything moves (n,)

    @classmethod
    def of(cls, model: Model, actions: Sequence[BodyForce | PointLoad]) -> "GrowingLoad":
        """Return the growing load of some actions on a model."""
        size = sum(_action_size(model, action) for action in actions)
        if size == 0.0:
            raise InvalidInput("the load is zero: give it a force or a multiple of g")
        first = np.sum([model.load(action) for action in actions], axis=0)
        return cls(model, tuple(actions), size, first)

    def forces(self, q: Array) -> Array:
        """Return the generalised forces (n,)."""
        if not self.model.large_displacements:
            return self.first
        return np.sum([self.model.load(action, q) for action in self.actions], axis=0)

    def rate(self, q: Array) -> sparse.csr_matrix | None:
        """Return the derivative of `forces` (n, n); None where it does not depend on q."""
        if not self.model.large_displacements:
            return None
        return sum(self.model.load_rate(action, q) for action in self.actions)

    def displacement(self, q: Array) -> float:
        """Return the displacement conjugate to the load: work of the load by its magnitude [m]."""
        if self.model.large_displacements:
            return sum(self.model.work(action, q) for action in self.actions) / self.size
        return float(self.first @ q) / self.size


def _action_size(model: Model, action: BodyForce | PointLoad) -> float:
    """Return the magnitude of an action [N]."""
    if isinstance(action, PointLoad):
        return hypot(*action.force)
    return model.structure.weight * hypot(action.horizontal, action.vertical)


@dataclass(eq=False)
class EquilibriumPath:
    """Equilibria in the order of their steps, the dead load's first."""

    model: Model  # with the joint memory, and the support motion, of the last step
    dead: Array  # generalised forces of the self-weight (n,)
    unit: tuple[float, float]  # displacement and factor of the first step of an elastic structure
    states: list[Array]  # coordinates at each step (n,)
    joint_forces: list[Array]  # N, V, M of every joint at each step (n_joints, 3) [N, N, N m]
    iterations: list[int]  # of Newton's method in each step

    @property
    def resultants(self) -> Array:
        """N, V, M of every joint (steps, n_joints, 3) [N, N, N m]."""
        return np.array(self.joint_forces)

    def _add_state(self, model: Model, q: Array, iterations: int) -> None:
        """Add an equilibrium."""
        self.model = model
        self.states.append(q)
        self.joint_forces.append(model.resultants(q))
        self.iterations.append(iterations)


@dataclass(eq=False)
class LoadPath(EquilibriumPath):
    """Equilibria under a growing load."""

    load: GrowingLoad
    factors: list[float]  # of the load at each step [-]
    held: GrowingLoad | None = None  # loads beside self-weight that do not grow
    units = "1"  # of the factors
    moving = "load"  # name of the moving object in messages

    @classmethod
    def of(
        cls,
        model: Model,
        actions: Sequence[BodyForce | PointLoad],
        start: Equilibrium,
        held: GrowingLoad | None = None,
    ) -> "LoadPath":
        """Begin at the dead load's equilibrium."""
        load = GrowingLoad.of(model, actions)
        live = load.forces(start.q)
        displacement = FIRST_DISPLACEMENT * model.structure.size
        compliance = float(live @ factorise(model.tangent(start.q)).solve(live)) / load.size
        unit, forces = (displacement, displacement / compliance), [model.resultants(start.q)]
        return cls(model, self_weight(model), unit, [start.q], forces, [0], load, [0.0], held)

    def _permanent_load(self, q: Array) -> Array:
        """Return the generalised forces that do not grow (n,)."""
        return self.dead if self.held is None else self.dead + self.held.forces(q)

    def _load_rate(self, x: Array) -> sparse.csr_matrix | None:
        """Return the derivative of all loads at (q, λ) by q (n, n); None where there is none."""
        rate = self.load.rate(x[:-1])
        if rate is None:
            return None
        held = None if self.held is None else self.held.rate(x[:-1])
        return x[-1] * rate if held is None else x[-1] * rate + held

    @cached_property
    def bound(self) -> float:
        """Factor that no state exceeds by limit analysis; infinite where it cannot say [-]."""
        if self.model.large_displacements or self.model.structure.has_own_laws:
            return np.inf
        dead = self.held.actions if self.held is not None else ()
        try:
            given = self.model.structure, "coulomb", np.inf, None, dead
            stones, programme = self_weight_programme(*given)
            best = programme.with_load_factor(stones.load(self.load.actions)).solve()
        except ArchfemError:  # such as for bodies that are too soft to be rigid
            return np.inf
        return np.inf if best is None else -best.value

    @property
    def displacements(self) -> Array:
        """Displacement conjugate to the load, since the dead load (steps,) [m]."""
        first = self.load.displacement(self.states[0])
        return np.array([self.load.displacement(q) - first for q in self.states])

    @property
    def faces(self) -> Array:
        """Gaps at mid-depth, rotations and slips of joints (steps, 3, n_joints) [m, rad, m]."""
        observer = self.model.observer()
        return observer.faces(np.array([observer.read(q) for q in self.states]))

    def advance(self, border: Array, distance: float) -> bool:
        """Add the equilibrium at a distance along a direction of displacement and factor (2,)."""
        along, up = border / np.array(self.unit)
        probe = self.load.forces(self.states[-1]) / self.load.size
        row = np.append(along * probe, up)
        x = np.append(self.states[-1], self.factors[-1])
        target = float(row @ x) + distance
        # Where several joints slide or turn under the same load the tangent is singular, although
        # each step has an equilibrium: then a small part of the closed stiffness is mixed in.
        return any(self._solve_step((row, target, distance), share) for share in (0.0, 1e-3))

    def advance_to_whole(self, min_share: float = 1.0 / 64.0) -> None:
        """Add equilibria up to a factor of 1, by steps that are halved where none is found."""
        share, force = 1.0, np.array([0.0, 1.0])
        while self.factors[-1] < 1.0 - RESIDUAL_TOLERANCE:
            step = min(share, 1.0 - self.factors[-1])
            if self.advance(force, step / self.unit[1]):
                continue
            share /= 2.0
            if share < min_share:
                raise DidNotConverge(
                    f"it carries {self.factors[-1]:.3g} of the loads that stay, dead = …, and no "
                    "more: they alone make it fall; give smaller ones"
                )

    def advance_normal(self, distance: float) -> bool:
        """Add the equilibrium in the hyperplane normal to the last step, at a distance."""
        # Unlike `advance` this follows a path on which the load moves back for a while, as when a
        # hinge moves from one joint to the next. Lengths are mass-weighted means.
        if len(self.states) < 2:
            return self.advance(np.array([1.0, 1.0]) / np.sqrt(2.0), distance)
        step, weighted = self._last_steps(1)
        length = np.sqrt(weighted @ step)
        row = weighted / length
        x = np.append(self.states[-1], self.factors[-1])
        target, straight = float(row @ x) + distance, x + distance / length * step
        # Blocks turn between stiff joints, which straight steps would open: bend with the path.
        guesses = [straight]
        if len(self.states) > 2:
            before, weighted = self._last_steps(2)
            earlier = np.sqrt(weighted @ before)
            bend = (step / length - before / earlier) / (length + earlier)
            guesses.insert(0, straight + distance * (distance + length) * bend)
        sense = self._sense(self.model, x, step)
        goal = row, target, distance
        return any(self._solve_step(goal, 0.0, guess, sense) for guess in guesses)

    def _sense(self, model: Model, x: Array, step: Array) -> float:
        """Return 1 or -1, which changes where a path turns back, never where it bends, or 0."""
        live, rate = self.load.forces(x[:-1]), self._load_rate(x)
        tangent = model.tangent(x[:-1])
        return _determinant_sign(tangent if rate is None else tangent - rate, live, step)

    def _last_steps(self, number: int) -> tuple[Array, Array]:
        """Return change of (q, λ) in the last step but some, and the same weighted (n + 1,)."""
        mass = self.model.structure.weight / self.model.structure.gravity
        motion = self.states[-number] - self.states[-number - 1]
        increment = self.factors[-number] - self.factors[-number - 1]
        inertia = self.model.mass @ motion / (mass * self.unit[0] ** 2)
        weighted = np.append(inertia, increment / self.unit[1] ** 2)
        return np.append(motion, increment), weighted

    def advance_by_relaxation(self, increment: float, farthest: float) -> bool:
        """Add the relaxed equilibrium under a larger factor, unless the load moves too far."""
        # Where many joints slide, full Newton steps fail although the structure bears more.
        if self.model.large_displacements:  # relaxation is for small rotations
            return False
        q, factor = self.states[-1], self.factors[-1] + increment
        load = self._permanent_load(q) + factor * self.load.forces(q)
        try:
            model, solution = _solve_next(EquilibriumSolver(len(q)), self.model, load, q)
        except DidNotConverge:
            return False
        if self.load.displacement(solution.q) - self.load.displacement(self.states[0]) > farthest:
            return False
        self._add_loaded_state(model, solution.q, factor, solution.iterations)
        return True

    def _solve_step(
        self, goal: Goal, share: float, guess: Array | None = None, sense: float = 0.0
    ) -> bool:
        """Add the equilibrium with row·(q, λ) = target, once joint memory is stationary."""
        last = np.append(self.states[-1], self.factors[-1])
        x = last if guess is None else guess
        model, iterations = self.model, 0
        for number in range(relaxation.MAX_IRREVERSIBLE_ITERATIONS):
            solution = self._iterate(model, x, goal, share)
            if solution is None:
                return False
            x, iterations = solution[0], iterations + solution[1]
            if not relaxation.has_irreversible_joints(model) or (
                number > 0 and relaxation.is_stationary(model, x[:-1], solution[1])
            ):
                # a singular matrix, as under joints that slide together, has no sense
                if sense and self._sense(model, x, x - last) == -sense:
                    return False
                self._add_loaded_state(model, x[:-1], float(x[-1]), iterations)
                return True
            model = model.with_memory(model.updated_memory(x[:-1]))
        return False

    def _iterate(
        self, model: Model, x: Array, goal: Goal, share: float
    ) -> tuple[Array, int] | None:
        """Find (q, λ) in one (n + 1,), and the number of iterations, by Newton's method."""
        row, target, distance = goal
        for iteration in range(30 if share == 0.0 else 60):
            tangent, rate = model.tangent(x[:-1]), self._load_rate(x)
            if rate is not None:
                tangent = tangent - rate
            live = self.load.forces(x[:-1])
            residual = self._permanent_load(x[:-1]) + x[-1] * live - model.force(x[:-1])
            missing = target - row @ x
            on_target = abs(missing) <= RESIDUAL_TOLERANCE * distance
            if on_target and self._is_converged(residual, x, tangent):
                return x, iteration
            # `share` of the closed stiffness makes the tangent regular
            if share > 0.0:
                tangent = (1.0 - share) * tangent + share * model.closed_tangent()
            step = _solve_bordered(tangent, live, row, np.append(residual, missing))
            if step is None:
                return None
            x = x + step
        return None

    def _add_loaded_state(self, model: Model, q: Array, factor: float, iterations: int) -> None:
        """Add an equilibrium under a factor, and update the joint memory."""
        self._add_state(model, q, iterations)
        self.model = model.with_memory(model.updated_memory(q))
        self.factors.append(factor)

    def _is_converged(self, residual: Array, x: Array, tangent: sparse.csr_matrix) -> bool:
        """Return whether forces are in balance, up to round-off of large motions."""
        load = load_magnitude(self._permanent_load(x[:-1]))
        load += abs(x[-1]) * load_magnitude(self.load.forces(x[:-1]))
        size = load_magnitude(residual)
        if size <= RESIDUAL_TOLERANCE * load or size > MAX_ROUND_OFF_RESIDUAL * load:
            return size <= RESIDUAL_TOLERANCE * load
        return bool(size <= 8.0 * np.finfo(float).eps * load_magnitude(abs(tangent) @ abs(x[:-1])))


def _solve_bordered(
    tangent: sparse.csr_matrix, load: Array, row: Array, right: Array
) -> Array | None:
    """Solve for steps of q and λ; None where their matrix is singular, or no step is finite."""
    try:
        matrix = _border(tangent, load, row)
        dense = isinstance(matrix, np.ndarray)
        step = np.linalg.solve(matrix, right) if dense else factorise(matrix).solve(right)
    except (RuntimeError, np.linalg.LinAlgError):  # from SuperLU, from LAPACK
        return None
    return np.asarray(step) if np.isfinite(step).all() else None


def _border(tangent: sparse.csr_matrix, load: Array, row: Array) -> Array | sparse.csc_matrix:
    """Return the matrix of the steps of q and λ; dense up to where LAPACK is faster."""
    size = len(load)
    if size < 400:
        matrix = np.empty((size + 1, size + 1))
        matrix[:size, :size] = tangent.toarray()
        matrix[:size, size], matrix[size] = -load, row
        return matrix
    column = sparse.csr_matrix(-load[:, None])
    return sparse.vstack([sparse.hstack([tangent, column]), sparse.csr_matrix(row)], "csc")


def _determinant_sign(tangent: sparse.csr_matrix, load: Array, row: Array) -> float:
    """Return the sign of the determinant of the matrix of steps; 0 where it is singular."""
    matrix, places = _border(tangent, load, row), np.arange(len(row))
    # Solutions x of A x = b and y of A' y = c, for right sides of the size of A and no symmetry
    magnitude, wave = abs(matrix), np.cos(places**2)
    b, c = wave * (magnitude @ np.ones(len(row))), wave * (magnitude.T @ np.ones(len(row)))
    if isinstance(matrix, np.ndarray):
        factors, swaps, info = lapack.dgetrf(matrix)
        if info != 0:
            return 0.0
        x, y = lapack.dgetrs(factors, swaps, b)[0], lapack.dgetrs(factors, swaps, c, trans=1)[0]
        pivots, exchanges = factors.diagonal(), np.count_nonzero(swaps != places)
    else:
        try:
            lu = factorise(matrix)
        except RuntimeError:
            return 0.0
        x, y, pivots, exchanges = lu.solve(b), lu.solve(c, "T"), lu.U.diagonal(), 0
        for order in (lu.perm_r, lu.perm_c):
            cycles = sparse.csr_matrix((np.ones(len(row)), (places, order)))
            exchanges += len(row) - connected_components(cycles)[0]
    # Of a singular matrix x and y are null vectors but for their length, and y'Ax = y'b is no more
    # than the rounding of A: so is the determinant, and its sign a coin toss.
    if abs(y @ b) <= 8.0 * np.finfo(float).eps * (abs(y) @ (magnitude @ abs(x))):
        return 0.0
    return float(np.prod(np.sign(pivots))) * (-1.0) ** exchanges


@dataclass(eq=False)
class SupportPath(EquilibriumPath):
    """Equilibria under the dead load over a moving support."""

    support_motion: Array  # before this support moves (n_blocks, 3) [m, m, rad]
    motion: Array  # of all blocks, for a multiple of one (n_blocks, 3) [m, m, rad]
    corner_displacement: float  # of the support's fastest corner, for a multiple of one [m]
    multiples: list[float]  # of the motion at each step [-]
    units = "N m"  # of the factors
    moving = "support"  # name of the moving object in messages

    @classmethod
    def of(
        cls,
        model: Model,
        settlement: Settlement,
        start: Equilibrium,
        held: GrowingLoad | None = None,
    ) -> "SupportPath":
        """Begin at the dead load's equilibrium."""
        if held is not None and model.large_displacements:
            raise InvalidInput(
                "a settlement with loads that stay, dead = …, is for small displacements: build "
                'the model with displacements="small", or leave the loads out'
            )
        motion = settlement.added(model.structure, np.zeros_like(model.support_motion))
        corner = RigidBlocks(model.structure).largest_displacement(motion)
        if corner == 0.0:
            raise InvalidInput(f"the settlement of '{settlement.block}' is zero: give it a motion")
        unit = FIRST_DISPLACEMENT * model.structure.size, np.inf
        dead = self_weight(model) if held is None else self_weight(model) + held.first
        common = model, dead, unit, [start.q], [model.resultants(start.q)], [0]
        return cls(*common, model.support_motion, motion, corner, [0.0])

    @property
    def displacements(self) -> Array:
        """Displacement of the support's fastest corner, since the dead load (steps,) [m]."""
        return self.corner_displacement * np.array(self.multiples)

    @property
    def faces(self) -> Array:
        """Gaps at mid-depth, rotations and slips of joints (steps, 3, n_joints) [m, rad, m]."""
        fixed = self._model_at(0.0).observer()
        if self.model.large_displacements:
            steps = zip(self.multiples, self.states, strict=True)
            readings = [self._model_at(multiple).observer().read(q) for multiple, q in steps]
            return fixed.faces(np.array(readings))
        # readings are linear in coordinates and support motion
        origin = np.zeros(self.model.size)
        by_motion = self._model_at(1.0).observer().read(origin) - fixed.read(origin)
        by_coordinates = np.array([fixed.read(q) for q in self.states])
        return fixed.faces(by_coordinates + np.array(self.multiples)[:, None] * by_motion)

    @property
    def factors(self) -> Array:
        """Work of the weights on a unit of the motion (steps,) [N m]."""
        # F·o - V·s: the motion alone would cause the openings o and the slips s. F are the
        # compressions at both ends of each joint
        blocks = RigidBlocks(self.model.structure)
        intrados, extrados, slip = blocks.gaps(self.motion)
        normal, shear, moment = np.moveaxis(self.resultants, -1, 0)
        middle, turn = 0.5 * (intrados + extrados), (extrados - intrados) / blocks.structure.depths
        return normal @ middle + moment @ turn - shear @ slip

    def advance(self, border: Array, distance: float) -> bool:
        """Move the support on by a distance, and add the equilibrium there."""
        multiple = self.multiples[-1] + distance * self.unit[0] / self.corner_displacement
        model, solver = self._model_at(multiple), EquilibriumSolver(self.model.size)
        try:
            model, solution = _solve_next(solver, model, self.dead, self._predict(multiple))
        except DidNotConverge:
            return False
        self.multiples.append(multiple)
        self._add_state(model, solution.q, solution.iterations)
        if len(self.multiples) == 2:  # the first step gives the unit of the factor
            before, after = self.factors
            change = abs(float(after - before))
            is_change = change > RESIDUAL_TOLERANCE * abs(before)
            self.unit = (self.unit[0], change if is_change else np.inf)
        return True

    def _predict(self, multiple: float) -> Array:
        """Return the coordinates extrapolated from the last step, an initial guess (n,)."""
        last, increment = self.states[-1], multiple - self.multiples[-1]
        if len(self.multiples) < 2:
            return relaxation.linear_predictor(self.model, last, increment * self.motion)
        rate = (last - self.states[-2]) / (self.multiples[-1] - self.multiples[-2])
        return last + increment * rate

    def _model_at(self, multiple: float) -> Model:
        """Return the model with its support moved by a multiple of the motion."""
        return self.model.with_support_motion(self.support_motion + multiple * self.motion)
