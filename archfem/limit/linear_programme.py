"""Equilibrium of rigid blocks as a linear programme over the forces at the ends of the joints.

Each joint carries a compression at its intrados end, F_i, one at its extrados end, F_e, and a
shear force V. They are equivalent to the resultants

    N = F_i + F_e,   M = (F_e - F_i) h/2,

and turn |M| <= N h/2 into F_i, F_e >= 0. By virtual work the balance with the loads f is the
transpose of the kinematics: -G_oᵀ F + G_sᵀ V = f, with G_o the openings of the two ends and G_s
the slips in terms of the motions of the blocks. Forces are in mean block weights and rotations in
mean joint depths, so that coefficients are of order one.

References: Livesley, Int. J. Numer. Meth. Eng. 12 (1978) 1853-1871.
"""

from collections.abc import Sequence
from contextlib import suppress
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property

import highspy
import numpy as np
from highspy import HighsBasis, HighsBasisStatus, HighsModelStatus
from scipy import sparse
from scipy.sparse import csgraph
from scipy.sparse.linalg import splu

from archfem._recent import RecentResults
from archfem._typing import Array, Flags, Numbers
from archfem.errors import DidNotConverge
from archfem.joints.rigid_kinematics import jump_rates
from archfem.masonry.loads import BodyForce, PointLoad
from archfem.masonry.structure import Structure, largest_displacement, rigid_motion_matrix

# Round-off of a cost, relative to the largest [-]: well below the tolerances of the solver
ROUND_OFF = 1e-12


# Share of the factor at which a state of least compressions is sought: solvers meet the optimum to
# 1e-7 or so, and at the optimum itself none might remain
HELD_SHARE = 1.0 - 1e-6

# Time after which the simplex method is taken to stall that looks for any state of equilibrium;
# with 3000 unknowns it takes 0.1 to 4 s [s]
STALLED_AFTER = 15.0

# Number of the primal simplex method among the strategies of HiGHS
PRIMAL_SIMPLEX = 4


class NoEquilibrium(DidNotConverge):
    """The programme is infeasible: no forces within the limits balance the loads."""


@dataclass(frozen=True, eq=False)
class LinearSolution:
    """Optimum of a linear programme, from which the next one of the same unknowns starts."""

    x: Array  # unknowns (n,)
    equation_multipliers: Array  # derivatives of the objective by the right sides
    limit_multipliers: Array
    cost: Array  # (n,)
    basis: HighsBasis


def solve_linear(
    cost: Array,
    bounds: Array,
    equations: tuple[sparse.csr_matrix, Array],
    limits: tuple[sparse.csr_matrix, Array],
    solver: str = "simplex",
    known: LinearSolution | None = None,
) -> LinearSolution | None:
    """Minimise a cost under equations and limits A x <= b; None where it is unbounded.

    The simplex method starts from the basis of a known solution, in which further rows are slack.
    """
    count, high = len(equations[1]), np.concatenate([equations[1], limits[1]])
    low = np.where(np.arange(len(high)) < count, high, -np.inf)
    matrix = sparse.vstack([equations[0], limits[0]], format="csc")
    sizes, entries = (*matrix.shape[::-1], matrix.nnz), (matrix.indptr, matrix.indices, matrix.data)
    # by columns, a minimum without a constant, of continuous unknowns
    programme = *sizes, 1, 1, 0.0, cost, *bounds.T, low, high, *entries, np.zeros(len(cost))
    # Residuals are of order one. Where round-off stops the solver, presolve changes its path; then
    # a coarser tolerance lets it end, or the interior point. Without a cost presolve comes first:
    # it finds at once that fine pieces of fill do not stand, where the simplex method stalls, and
    # where that stalls all the same, the least residual decides (`minimise_residual`).
    first = (solver, "off" if np.any(cost) else "on", 1e-9)
    more = (solver, "on", 1e-9), (solver, "on", 1e-8), ("ipm", "on", 1e-8)
    for way, presolve, tolerance in dict.fromkeys((first, *more)):
        highs = highspy.Highs()
        feasibility = (f"{side}_feasibility_tolerance" for side in ("primal", "dual"))
        options = {"output_flag": False, **dict.fromkeys(feasibility, tolerance)}
        options |= {"time_limit": np.inf if np.any(cost) else STALLED_AFTER}
        # one or two iterations for each row and unknown are usual; where it cycles, the next way
        options["simplex_iteration_limit"] = 3 * sum(matrix.shape)
        for name, value in (options | {"solver": way, "presolve": presolve}).items():
            highs.setOptionValue(name, value)
        highs.passModel(*programme)
        if known and presolve == "off":
            _start_from(highs, known, cost)
        highs.run()
        if (status := highs.getModelStatus()) == HighsModelStatus.kInfeasible:
            raise NoEquilibrium("no state of equilibrium fulfils the limits")
        if status == HighsModelStatus.kUnbounded:
            return None
        if status == HighsModelStatus.kOptimal:
            found = highs.getSolution()
            x, duals = np.array(found.col_value), np.array(found.row_dual)
            return LinearSolution(x, duals[:count], duals[count:], cost, highs.getBasis())
        if status == HighsModelStatus.kTimeLimit:
            break
    words = highs.modelStatusToString(status)
    raise DidNotConverge(f"the linear programme found no state: {words}")


def _start_from(highs: highspy.Highs, known: LinearSolution, cost: Array) -> None:
    """Set the basis of a known solution, and the method for which it is feasible."""
    basis, rows = highspy.HighsBasis(), list(known.basis.row_status)
    basis.valid, basis.col_status = True, known.basis.col_status
    basis.row_status = rows + [HighsBasisStatus.kBasic] * (highs.getNumRow() - len(rows))
    highs.setBasis(basis)
    # it is primal feasible where costs alone have changed, and dual feasible where limits have
    if not np.array_equal(known.cost, cost):
        highs.setOptionValue("simplex_strategy", PRIMAL_SIMPLEX)


@dataclass(frozen=True, eq=False)
class RigidBlocks:
    """Rigid blocks of a structure, with forces at the two ends of each joint."""

    structure: Structure
    # by what they depend on, each without and with further unknowns; a search without dilatancy
    # alternates between four, sixteen leave room
    _reductions: RecentResults["ReducedBalance"] = field(
        default_factory=lambda: RecentResults(16), init=False
    )

    @property
    def force_unit(self) -> float:
        """Unit of force in the programme: the mean weight of a free block [N]."""
        return self.structure.weight / len(self.structure.free)

    @cached_property
    def length_unit(self) -> float:
        """Unit of length in the programme: the mean depth of a joint [m]."""
        return float(self.structure.depths.mean())

    @cached_property
    def coordinate_units(self) -> Array:
        """Units of the block coordinates in the programme (3 n_free,) [m, m, rad]."""
        return np.tile([1.0, 1.0, 1.0 / self.length_unit], len(self.structure.free))

    @cached_property
    def cohesion(self) -> Array:
        """Cohesive shear strength c A of the whole joints (n_joints,) [mean block weights]."""
        return self.structure.cohesion / self.force_unit

    @cached_property
    def tension(self) -> Array:
        """Tensile strength T of the whole joints, f_t w h (n_joints,) [mean block weights]."""
        structure = self.structure
        return structure.tension * structure.width * structure.depths / self.force_unit

    @property
    def bond(self) -> Array:
        """Plastic tension T/2 of the ends of joints, with no shear (3 n_joints,)."""
        # Tension f_t over the whole depth turns about an edge as T at mid-depth does: it is T/2 at
        # both ends, N = F_i + F_e >= -T and |M| <= (N + T) h/2.
        return np.concatenate([0.5 * self.tension, 0.5 * self.tension, 0.0 * self.tension])

    def crushing_forces(self, strength: float | Array) -> Array:
        """Return σ w h of each joint, with tension beside the stress block (n_joints,)."""
        structure = self.structure
        return strength * structure.width * structure.depths / self.force_unit + self.tension

    @cached_property
    def rates(self) -> sparse.csr_matrix:
        """Openings of intrados and extrados ends, and slips (3 n_joints, 3 n_blocks) [-, m]."""
        structure, (intrados, extrados) = self.structure, np.moveaxis(self.structure.ends, 1, 0)
        places = intrados, extrados, intrados
        return self.end_rates(structure.normals, structure.tangents, places, structure.centroids)

    def end_rates(
        self, normals: Array, tangents: Array, places: Sequence[Array], centroids: Array
    ) -> sparse.csr_matrix:
        """Return `rates` of openings at the first two places and of slips at the third."""
        directions = np.concatenate([normals, normals, tangents])
        pairs = np.tile(self.structure.pairs, (3, 1))
        return jump_rates(directions, np.concatenate(places), pairs, centroids)

    @cached_property
    def kinematics(self) -> sparse.csr_matrix:
        """The same with motions of the free blocks alone (3 n_joints, 3 n_free) [-, m]."""
        return self.rates[:, np.repeat([not b.fixed for b in self.structure.blocks], 3)]

    def gaps(self, motion: Array) -> Array:
        """Return intrados openings, extrados openings and slips of a motion (3, n_joints) [m]."""
        return (self.rates @ motion.ravel()).reshape(3, -1)

    @cached_property
    def balance(self) -> sparse.csr_matrix:
        """Equilibrium matrix of free blocks in the programme's units (3 n_free, 3 n_joints)."""
        signs = sparse.diags(np.repeat([-1.0, -1.0, 1.0], len(self.structure.depths)))
        return (sparse.diags(self.coordinate_units) @ self.kinematics.T @ signs).tocsr()

    def reduce(
        self, columns: sparse.csr_matrix, friction: Array, coheres: Flags
    ) -> "ReducedBalance":
        """Return the balance in few unknowns, kept for programmes of other loads and costs."""
        single = _find_single_blocks(columns)
        key = tuple(part.tobytes() for part in (single, friction, coheres))
        reduced = self._reductions.look_up(
            key, lambda: ReducedBalance(self, single, friction, coheres)
        )
        key += tuple(part.tobytes() for part in (columns.indptr, columns.indices, columns.data))
        return self._reductions.look_up(key, lambda: reduced.with_columns(columns))

    def load(self, actions: Sequence[BodyForce | PointLoad]) -> Array:
        """Return the generalised forces of actions on the free blocks (3 n_free,) [N, N, N m]."""
        structure = self.structure
        load = np.zeros(3 * len(structure.free))
        for action in actions:
            if isinstance(action, BodyForce):
                free = [structure.blocks[number] for number in structure.free]
                weight = np.array([b.area * b.material.unit_weight * structure.width for b in free])
                load[0::3] += weight * action.horizontal
                load[1::3] += weight * action.vertical
            else:
                number, point = action.place(structure)
                motion = rigid_motion_matrix(point[None, :], structure.centroids[number])[0]
                first = structure.first_coordinates[number]
                load[first : first + 3] += np.array(action.force) @ motion
        return load

    def dimensionless(self, load: Array) -> Array:
        """Return generalised forces in the programme's units (3 n_free,)."""
        return self.coordinate_units * load / self.force_unit

    def motion(self, multipliers: Array) -> Array:
        """Return the motion of all blocks, zero for fixed ones (n_blocks, 3) [m, m, rad]."""
        motion = np.zeros((len(self.structure.blocks), 3))
        motion[list(self.structure.free)] = (self.coordinate_units * multipliers).reshape(-1, 3)
        return motion

    def largest_displacement(self, motion: Array) -> float:
        """Return the largest displacement of a corner of any block [m]."""
        outlines = [block.drawn() for block in self.structure.blocks]
        return largest_displacement(outlines, self.structure.centroids, motion)

    def resultants(self, forces: Array) -> Array:
        """Return N, V, M of every joint (n_joints, 3) [N, N, N m]."""
        intrados, extrados, shear = self.force_unit * forces.reshape(3, -1)
        moment = (extrados - intrados) * self.structure.depths / 2.0
        return np.stack([intrados + extrados, shear, moment], axis=1)


@dataclass(frozen=True, eq=False)
class Limits:
    """Linear limits on the joint forces, `rows @ forces <= bounds`, besides those of friction."""

    rows: sparse.csr_matrix  # (m, 3 n_joints) [-]
    bounds: Array  # (m,) [mean block weights]

    def joined(self, other: "Limits") -> "Limits":
        """Return both sets of limits together."""
        rows = sparse.vstack([self.rows, other.rows], format="csr")
        return Limits(rows, np.concatenate([self.bounds, other.bounds]))


def uneven_compression(joint_count: int) -> Array:
    """Return a cost of compressions whose least state is unique, so that crushing cuts converge."""
    # weights from 1 to 2 without regularity
    weights = 1.0 + np.arange(2 * joint_count) * 0.5 * (5.0**0.5 - 1.0) % 1.0
    return np.concatenate([weights, np.zeros(joint_count)])


def crushing_cuts(joints: Numbers, at: Array, crushing: Array) -> Limits:
    """Return tangents at N_0 = `at` of the crushing limit |M| <= N h/2 - N²/(2 σ w)."""
    # A rectangular stress block of the full strength σ demands F >= N²/(2 N_c) at each end, with
    # N_c = σ w h; the tangent at N_0 is F >= N_0/N_c N - N_0²/(2 N_c).
    slope, count = at / crushing[joints], len(joints)
    # built row by row, in a tenth of the time of products of sparse matrices
    values = np.stack([slope - 1.0, slope, slope, slope - 1.0]).reshape(2, 2, count)
    column = np.tile(np.stack([joints, joints + len(crushing)], axis=1).ravel(), 2)
    entries = values.transpose(0, 2, 1).ravel(), column, np.arange(0, 4 * count + 1, 2)
    rows = sparse.csr_matrix(entries, (2 * count, 3 * len(crushing)))
    return Limits(rows, np.tile(slope * at / 2.0, 2))


@dataclass(frozen=True, eq=False)
class Optimum:
    """Optimal solution of a programme."""

    value: float  # minimum of the objective
    forces: Array  # F_i, F_e and V of all joints (3 n_joints,) [mean block weights]
    multipliers: Array  # of the balance: the motion of the free blocks (3 n_free,)
    unknowns: Array = field(default_factory=lambda: np.zeros(0))  # z, besides the forces (k,)


@dataclass(frozen=True, eq=False)
class Programme:
    """Linear programme over joint forces x and further unknowns z."""

    # min  a·x + b·z   subject to   A x + D z = f,   F_i, F_e >= 0,   |V| <= r + μ N,
    #                               limits on x,     0 <= z <= c

    blocks: RigidBlocks  # their balance is A
    load: Array  # f (3 n_free,) [mean block weights]
    friction: Array  # μ, infinite in joints that never slide (n_joints,) [-]
    cohesion: Array  # r, shear strength without compression (n_joints,) [mean block weights]
    limits: Limits | None = None  # further ones on the joint forces
    # crushing force σ w h, infinite in joints of fill in pieces (n_joints,) [mean block weights]
    crushing: Array | None = None
    force_cost: Array | None = None  # a (3 n_joints,); None for zero
    columns: sparse.csr_matrix | None = None  # D (3 n_free, k); None without z
    unknown_cost: Array = field(default_factory=lambda: np.zeros(0))  # b (k,)
    upper_bounds: Array = field(default_factory=lambda: np.zeros(0))  # c (k,), infinite for none
    # whether the solver starts from the last optimum: which of many is found depends on that then
    starts_from_last: bool = False

    def with_unknowns(
        self, columns: sparse.csr_matrix, cost: Array, upper_bound: float = np.inf
    ) -> "Programme":
        """Return the programme with further unknowns before its present ones."""
        if self.columns is not None:
            columns = sparse.hstack([columns, self.columns], format="csr")
        upper_bounds = np.concatenate([np.full(len(cost), upper_bound), self.upper_bounds])
        cost = np.concatenate([cost, self.unknown_cost])
        return replace(self, columns=columns, unknown_cost=cost, upper_bounds=upper_bounds)

    def with_load_factor(self, load: Array) -> "Programme":
        """Return the programme that maximises the factor of a further load, its first unknown."""
        column = sparse.csr_matrix(-self.blocks.dimensionless(load)[:, None])
        return self.with_unknowns(column, np.array([-1.0]))

    def minimise_residual(self, enough: float = np.inf) -> Optimum:
        """Minimise the sum of residual forces; the multipliers are the motion of the fall.

        A lower bound above `enough` ends the rounds of crushing cuts [mean block weights].
        """
        identity = sparse.identity(len(self.load))
        columns = sparse.hstack([identity, -identity], format="csr")
        programme = self.with_unknowns(columns, np.ones(2 * len(self.load)))
        if self.crushing is not None and enough < np.inf:
            least = programme.solve(enough=-np.inf)  # of the first round
            if least is not None and least.value > enough:
                return least
        # Any state of equilibrium is an optimum, and is found faster where there is one.
        with suppress(DidNotConverge):
            state = self.solve()
            assert state is not None  # it has no objective
            return state
        optimum = programme.solve(enough=enough)
        assert optimum is not None  # a sum of magnitudes is bounded from below
        return optimum

    def with_cuts_at(self, state: Optimum | None) -> "Programme":
        """Return the programme with crushing cuts at the thrusts of a state, as of other loads."""
        if self.crushing is None or state is None:
            return self
        thrust = state.forces.reshape(3, -1)[:2].sum(axis=0)
        crushes = np.flatnonzero(np.isfinite(self.crushing))
        cuts = crushing_cuts(crushes, thrust[crushes], self.crushing)
        return self.limited(cuts)

    def limited(self, further: Limits) -> "Programme":
        """Return the programme with further limits on the joint forces."""
        return replace(self, limits=self.limits.joined(further) if self.limits else further)

    def objective(self, state: Optimum) -> float:
        """Return the objective a·x + b·z at a state of another programme of the same unknowns."""
        force_cost = 0.0 if self.force_cost is None else self.force_cost @ state.forces
        return float(force_cost + self.unknown_cost @ state.unknowns)

    def solve(
        self,
        *,
        forces: bool = True,
        enough: float = np.inf,
        max_rounds: int = 60,
        crushing_tolerance: float = 1e-7,
    ) -> Optimum | None:
        """Solve, adding crushing cuts until none is violated; None where it is unbounded.

        Without forces, until the objective and its mechanism, from below, no longer change, or the
        objective is above `enough`.
        """
        empty = sparse.csr_matrix((0, 3 * len(self.friction)))
        limits = self.limits or Limits(empty, np.zeros(0))
        if self.crushing is not None:  # this tangent bounds every thrust by the crushing force
            crushes = np.flatnonzero(np.isfinite(self.crushing))
            limits = limits.joined(crushing_cuts(crushes, self.crushing[crushes], self.crushing))
        columns = sparse.csr_matrix((len(self.load), 0)) if self.columns is None else self.columns
        reduced = self.blocks.reduce(columns, self.friction, self.cohesion > 0.0)
        if not self.starts_from_last:
            reduced.known.clear()
        # As tangents of a parabola the cuts converge quadratically, in about six rounds, where one
        # state is optimal. Where many are, as in walls, each round may find another one: once the
        # optimum is known, that of least compressions is sought.
        found, programme, before = None, self, np.inf
        for _ in range(max_rounds):
            try:
                optimum = reduced.solve(programme, limits)
            except DidNotConverge:
                if found is None:
                    raise
                found, programme, before = None, self, np.inf  # the optimum was not yet known
                continue
            if optimum is None or self.crushing is None or optimum.value > enough:
                return optimum
            ends = optimum.forces.reshape(3, -1)[:2]
            thrust = ends.sum(axis=0)
            excess = thrust**2 / (2.0 * self.crushing) - ends.min(axis=0)
            violated = np.flatnonzero(excess > crushing_tolerance * self.crushing)
            if not len(violated):
                return optimum if found is None else self._join_states(found, optimum)
            limits = limits.joined(crushing_cuts(violated, thrust[violated], self.crushing))
            if found is None and abs(optimum.value - before) <= 1e-9 * abs(optimum.value):
                if not forces:
                    return optimum
                held = self._hold_factor(optimum)
                found, programme = (None, self) if held is None else (optimum, held)
            before = optimum.value
        raise DidNotConverge(
            f"the crushing limit is still violated after {max_rounds} rounds of cuts: "
            "check that strength is in Pa"
        )

    def _hold_factor(self, optimum: Optimum) -> "Programme | None":
        """Return the programme of least compressions below a factor; None without a factor."""
        if self.force_cost is not None or np.count_nonzero(self.unknown_cost[1:]):
            return None
        load, upper_bounds = self.load, self.upper_bounds.copy()
        if self.columns is not None and self.unknown_cost[0]:
            load = load - self.columns[:, [0]].toarray()[:, 0] * HELD_SHARE * optimum.unknowns[0]
            upper_bounds[0] = 0.0
        return replace(
            self,
            load=load,
            force_cost=uneven_compression(len(self.friction)),
            unknown_cost=np.zeros_like(self.unknown_cost),
            upper_bounds=upper_bounds,
        )

    def _join_states(self, found: Optimum, state: Optimum) -> Optimum:
        """Return the mechanism of an optimum, and the forces below its factor."""
        unknowns = state.unknowns.copy()
        if self.columns is not None and self.unknown_cost[0]:
            unknowns[0] = HELD_SHARE * found.unknowns[0]
        value = float(self.unknown_cost @ unknowns)
        return replace(found, value=value, forces=state.forces, unknowns=unknowns)


class ReducedBalance:
    """Equilibrium in few unknowns v, of which joint forces are x = T v + t, with t of the load.

    Blocks with two joints, the links, pass the forces of one on to the other. Their balance is
    solved for the forces of one joint each, the pivots. A chain of any length, such as a ring, then
    has the unknowns of a single joint. Limits of the pivots become rows. In other joints forces are
    sums >= 0 of generators of the friction cone, a compression at either end with a shear of ±μ
    times it. They need no rows. The last of v are z. Programmes of the same friction and columns
    share it.
    """

    def __init__(
        self, blocks: RigidBlocks, single: Numbers, friction: Array, coheres: Flags
    ) -> None:
        """Eliminate chains without single blocks, and express the other forces by generators."""
        balance = blocks.balance
        links, self._pivots = _find_chains(blocks.structure, single)
        self._is_pivot = np.zeros(balance.shape[1], dtype=bool)
        self._is_pivot.reshape(3, -1)[:, self._pivots] = True
        self._kept = np.ones(balance.shape[0], dtype=bool)
        self._kept.reshape(-1, 3)[links] = False
        self._balance, used = balance[self._kept], ~self._is_pivot[: len(friction)]
        # these carry shear without compression
        self._alone = np.flatnonzero(used & (coheres | ~np.isfinite(friction)))
        self._map = _cone_generators(friction, used, self._alone)
        self._count, passed = self._map.shape[1], balance[~self._kept]
        if len(links):
            self._factors = splu(passed[:, self._is_pivot].tocsc())
            self._map = self._map + self._pass_on(passed @ self._map)
        self._equations = self._balance @ self._map
        # the last solutions by their count of rows, from which the next one starts
        self.known: dict[int, LinearSolution] = {}
        self._slides = self._pivots[np.isfinite(friction[self._pivots])]
        self._rows = _pivot_limits(friction, self._pivots, self._slides)
        self._limits = self._rows @ self._map

    def with_columns(self, columns: sparse.csr_matrix) -> "ReducedBalance":
        """Return the balance with further unknowns z."""
        passed, other = self._pass_on(columns[~self._kept]), copy(self)
        other.known = {}
        direct = columns[self._kept] + self._balance @ passed
        other._map = sparse.hstack([self._map, passed], format="csr")
        other._equations = sparse.hstack([self._equations, direct], format="csr")
        other._limits = sparse.hstack([self._limits, self._rows @ passed], format="csr")
        return other

    def _pass_on(self, loads: sparse.csr_matrix) -> sparse.csr_matrix:
        """Return the forces of all joints with which pivots carry loads on the links of chains."""
        shape, loads = (len(self._is_pivot), loads.shape[1]), loads.tocsc()
        # only forces at the end of a chain and loads act on its links
        if not len(acting := np.flatnonzero(np.diff(loads.indptr))):
            return sparse.csr_matrix(shape)
        solved = self._factors.solve(-loads[:, acting].toarray())
        row, column = np.nonzero(solved)
        place = np.flatnonzero(self._is_pivot)[row], acting[column]
        return sparse.csr_matrix((solved[row, column], place), shape)

    def solve(self, programme: Programme, further: Limits, large: int = 600) -> Optimum | None:
        """Solve a programme: by the interior point from `large` equations on, else the simplex.

        In walls the simplex method takes 40 iterations a block. Without an objective any state
        will do, which it finds faster.
        """
        constant = np.zeros(self._map.shape[0])
        if len(self._pivots):
            constant[self._is_pivot] = self._factors.solve(programme.load[~self._kept])
        force_cost, cost = np.zeros_like(constant), np.zeros(self._map.shape[1])
        if programme.force_cost is not None:
            force_cost += programme.force_cost
            cost += self._map.T @ force_cost
            # Round-off as a cost leads the simplex method through 100 000 bases of one objective.
            cost[np.abs(cost) < ROUND_OFF * np.abs(cost).max()] = 0.0
        cost[self._count :] += programme.unknown_cost
        strength = np.tile(programme.cohesion[self._slides], 2)
        bounds = np.concatenate([np.zeros(2 * len(self._pivots)), strength]) - self._rows @ constant
        reduced = self._limits
        if len(further.bounds):
            bounds = np.concatenate([bounds, further.bounds - further.rows @ constant])
            reduced = sparse.vstack([reduced, further.rows @ self._map], format="csr")
        load = programme.load[self._kept] - self._balance @ constant
        count = len(load) + len(bounds)
        known = {rows: each for rows, each in self.known.items() if rows <= count}
        solver = "ipm" if len(load) > large and cost.any() and not known else "simplex"
        given = cost, self._bounds(programme), (self._equations, load), (reduced, bounds), solver
        if (result := solve_linear(*given, next(reversed(known.values()), None))) is None:
            return None
        self.known = known | {count: result}
        forces, unknowns = self._map @ result.x + constant, result.x[self._count :]
        multipliers = self._multipliers(result, force_cost, further.rows)
        value = float(force_cost @ forces + programme.unknown_cost @ unknowns)
        return Optimum(value, forces, multipliers, unknowns)

    def _bounds(self, programme: Programme) -> Array:
        """Return the bounds of the unknowns of a programme (m, 2)."""
        largest = np.where(np.isfinite(programme.friction), programme.cohesion, np.inf)
        bounds = np.zeros((self._map.shape[1], 2))
        bounds[:, 1] = np.inf
        alone = slice(self._count - len(self._alone), self._count)
        bounds[alone] = largest[self._alone, None] * [-1.0, 1.0]
        bounds[self._count :, 1] = programme.upper_bounds
        return bounds

    def _multipliers(
        self, result: LinearSolution, force_cost: Array, further: sparse.csr_matrix
    ) -> Array:
        """Return the multipliers of the balance of all blocks (3 n_free,)."""
        every = np.empty(len(self._kept))
        every[self._kept] = result.equation_multipliers
        if len(self._pivots):
            # the forces of pivots are unknowns without bounds: their reduced costs vanish
            cost = force_cost - self._balance.T @ result.equation_multipliers
            own, others = np.split(result.limit_multipliers, [self._rows.shape[0]])
            cost -= self._rows.T @ own + further.T @ others
            every[~self._kept] = self._factors.solve(cost[self._is_pivot], trans="T")
        return every


def _find_single_blocks(columns: sparse.csr_matrix) -> Numbers:
    """Return the free blocks on which an unknown acts alone (n,)."""
    # It would enter the rows of its whole chain.
    single = np.bincount(columns.indices, minlength=columns.shape[1]) <= 3
    row = np.repeat(np.arange(columns.shape[0]), np.diff(columns.indptr))
    return np.unique(row[single[columns.indices]] // 3)


def _find_chains(structure: Structure, excluded: Numbers) -> tuple[Numbers, Numbers]:
    """Return the free blocks that link two joints, and a joint of each for a pivot (n,)."""
    place = np.full(len(structure.blocks), -1)
    place[list(structure.free)] = np.arange(len(structure.free))
    block, joint = place[structure.pairs.ravel()], np.repeat(np.arange(len(structure.pairs)), 2)
    is_link = np.bincount(block[block >= 0], minlength=len(structure.free)) == 2
    is_link[excluded] = False
    links, number = np.flatnonzero(is_link), np.cumsum(is_link) - 1
    ends = (block >= 0) & is_link[block]
    entries = np.ones(2 * len(links)), (number[block[ends]], joint[ends])
    incidence = sparse.csr_matrix(entries, (len(links), len(structure.pairs)))
    # n links in a row have n + 1 joints: any distinct ones can be solved for
    pivots = csgraph.maximum_bipartite_matching(incidence, perm_type="column")
    return links, np.asarray(pivots, dtype=np.intp)


def _cone_generators(friction: Array, used: Flags, alone: Numbers) -> sparse.csr_matrix:
    """Return generators of the forces of some joints (3 n_joints, m)."""
    cone, count = np.isfinite(friction) & (friction > 0.0), len(used)
    slides, plain = np.flatnonzero(used & cone), np.flatnonzero(used & ~cone)
    # both ends with a shear of μ, both with -μ, both without shear, shear alone
    ends = [slides, count + slides, slides, count + slides, plain, count + plain]
    rows = np.concatenate([*ends, 2 * count + alone])
    signs = np.repeat([1.0, 1.0, -1.0, -1.0], len(slides))
    values = np.concatenate([np.ones(len(rows)), signs * np.tile(friction[slides], 4)])
    columns = np.concatenate([np.arange(len(rows)), np.arange(len(signs))])
    places = np.concatenate([rows, np.tile(2 * count + slides, 4)]), columns
    return sparse.csr_matrix((values, places), (3 * count, len(rows)))


def _pivot_limits(friction: Array, pivots: Numbers, slides: Numbers) -> sparse.csr_matrix:
    """Return the rows of F_i, F_e >= 0 for pivots, and of ±V - μ N <= r for those that slide."""
    count, ends = len(friction), np.concatenate([pivots, len(friction) + pivots])
    pressed, cone = np.arange(len(ends)), len(ends) + np.arange(2 * len(slides))
    both, slope = np.tile(slides, 2), np.tile(-friction[slides], 2)
    rows = np.concatenate([pressed, cone, cone, cone])
    columns = np.concatenate([ends, both, count + both, 2 * count + both])
    signs = np.repeat([1.0, -1.0], len(slides))
    values = np.concatenate([-np.ones(len(ends)), slope, slope, signs])
    limits = sparse.csr_matrix((values, (rows, columns)), (len(ends) + len(cone), 3 * count))
    limits.eliminate_zeros()
    return limits
