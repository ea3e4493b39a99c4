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
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.optimize import OptimizeResult, linprog
from scipy.sparse import csgraph
from scipy.sparse.linalg import splu

from archfem._typing import Array
from archfem.errors import DidNotConverge
from archfem.joints.rigid_kinematics import jump_rates
from archfem.masonry.loads import BodyForce, PointLoad
from archfem.masonry.structure import Structure, largest_displacement, rigid_motion_matrix


class NoEquilibrium(DidNotConverge):
    """The programme is infeasible: no forces within the limits balance the loads."""


def solve_linear(
    cost: Array,
    bounds: Array,
    equations: tuple[sparse.csr_matrix | Array, Array],
    limits: tuple[sparse.csr_matrix | None, Array | None] = (None, None),
    method: str = "highs-ds",
) -> OptimizeResult | None:
    """Minimise a cost under equations and limits A x <= b; None where it is unbounded."""
    # Residuals are of order one. Where round-off stops the solver, presolve changes its path, and
    # then a coarser tolerance lets it end.
    for presolve, tolerance in ((False, 1e-9), (True, 1e-9), (True, 1e-8)):
        feasibility = (f"{side}_feasibility_tolerance" for side in ("primal", "dual"))
        options = {**dict.fromkeys(feasibility, tolerance), "presolve": presolve}
        result = linprog(cost, *limits, *equations, bounds, method, options=options)
        if result.status == 2:
            raise NoEquilibrium("no state of equilibrium fulfils the limits")
        if result.status in (0, 3):
            return result if result.status == 0 else None
    raise DidNotConverge(f"the linear programme found no state: {result.message}")


def rigid_load(structure: Structure, actions: Sequence[BodyForce | PointLoad]) -> Array:
    """Return the generalised forces of actions on the free blocks (3 n_free,) [N, N, N m]."""
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


@dataclass(frozen=True, eq=False)
class RigidBlocks:
    """Rigid blocks of a structure, with forces at the two ends of each joint."""

    structure: Structure

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
    def rates(self) -> sparse.csr_matrix:
        """Openings of intrados and extrados ends, and slips (3 n_joints, 3 n_blocks) [-, m]."""
        structure, (intrados, extrados) = self.structure, np.moveaxis(self.structure.ends, 1, 0)
        frames = (
            (structure.normals, intrados),
            (structure.normals, extrados),
            (structure.tangents, intrados),
        )
        rows = [jump_rates(*frame, structure.pairs, structure.centroids) for frame in frames]
        return sparse.vstack(rows, format="csr")

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
        sign = np.repeat([-1.0, -1.0, 1.0], len(self.structure.depths))
        return sparse.diags(self.coordinate_units) @ self.kinematics.T @ sparse.diags(sign)

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


def no_limits(joint_count: int) -> Limits:
    """Return an empty set of limits on the joint forces."""
    return Limits(sparse.csr_matrix((0, 3 * joint_count)), np.zeros(0))


def crushing_cuts(joints: NDArray[np.intp], at: Array, crushing: Array) -> Limits:
    """Return tangents at N_0 = `at` of the crushing limit |M| <= N h/2 - N²/(2 σ w)."""
    # A rectangular stress block of the full strength σ demands F >= N²/(2 N_c) at each end, with
    # N_c = σ w h; the tangent at N_0 is F >= N_0/N_c N - N_0²/(2 N_c).
    slope, row, count = at / crushing[joints], np.arange(len(joints)), len(crushing)
    shape = (len(joints), count)
    tangent = sparse.csr_matrix((slope, (row, joints)), shape)
    end = sparse.csr_matrix((np.ones(len(joints)), (row, joints)), shape)
    shear = sparse.csr_matrix(shape)
    rows = sparse.bmat([[tangent - end, tangent, None], [tangent, tangent - end, shear]])
    return Limits(rows.tocsr(), np.tile(slope * at / 2.0, 2))


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
    crushing: Array | None = None  # crushing force σ w h (n_joints,) [mean block weights]
    force_cost: Array | None = None  # a (3 n_joints,); None for zero
    columns: sparse.csr_matrix | None = None  # D (3 n_free, k); None without z
    unknown_cost: Array = field(default_factory=lambda: np.zeros(0))  # b (k,)
    upper_bounds: Array = field(default_factory=lambda: np.zeros(0))  # c (k,), infinite for none

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

    def minimise_residual(self) -> Optimum:
        """Minimise the sum of residual forces; the multipliers are the motion of the fall."""
        # Any state of equilibrium is an optimum, and is found faster where there is one.
        with suppress(DidNotConverge):
            state = self.solve()
            assert state is not None  # it has no objective
            return state
        identity = sparse.identity(len(self.load))
        columns = sparse.hstack([identity, -identity], format="csr")
        optimum = self.with_unknowns(columns, np.ones(2 * len(self.load))).solve()
        assert optimum is not None  # a sum of magnitudes is bounded from below
        return optimum

    def objective(self, state: Optimum) -> float:
        """Return the objective a·x + b·z at a state of another programme of the same unknowns."""
        force_cost = 0.0 if self.force_cost is None else self.force_cost @ state.forces
        return float(force_cost + self.unknown_cost @ state.unknowns)

    def solve(self, max_rounds: int = 60, crushing_tolerance: float = 1e-7) -> Optimum | None:
        """Solve, adding crushing cuts until none is violated; None where it is unbounded."""
        limits = self.limits or no_limits(len(self.friction))
        if self.crushing is not None:
            every = np.arange(len(self.crushing))
            for share in (0.25, 0.5, 1.0):
                limits = limits.joined(crushing_cuts(every, share * self.crushing, self.crushing))
        # As tangents of a parabola the cuts converge quadratically, in about six rounds.
        for _ in range(max_rounds):
            optimum = self._solve_linear(limits)
            if optimum is None or self.crushing is None:
                return optimum
            thrust = optimum.forces.reshape(3, -1)[:2].sum(axis=0)
            smaller_end = optimum.forces.reshape(3, -1)[:2].min(axis=0)
            excess = thrust**2 / (2.0 * self.crushing) - smaller_end
            violated = np.flatnonzero(excess > crushing_tolerance * self.crushing)
            if not len(violated):
                return optimum
            limits = limits.joined(crushing_cuts(violated, thrust[violated], self.crushing))
        raise DidNotConverge(
            f"the crushing limit is still violated after {max_rounds} rounds of cuts: "
            "check that strength is in Pa"
        )

    def _solve_linear(self, limits: Limits) -> Optimum | None:
        """Solve with linear limits only."""
        reduced = ReducedProgramme(self, limits)
        result = reduced.solve()
        if result is None:
            return None
        forces, multipliers = reduced.map @ result.x + reduced.constant, reduced.multipliers(result)
        unknowns = result.x[len(result.x) - len(self.unknown_cost) :]
        value = float(reduced.force_cost @ forces + self.unknown_cost @ unknowns)
        return Optimum(value, forces, multipliers, unknowns)


class ReducedProgramme:
    """Linear programme in few unknowns v, of which joint forces are x = T v + t.

    Blocks with two joints, as in a ring, pass the forces of one joint on to the other. Their
    balance is solved for the forces of one joint each, the pivots, so that a chain of any length
    has the unknowns of a single joint; limits of the pivots become rows. In other joints forces
    are sums >= 0 of generators of the friction cone, a compression at either end with a shear of
    ±μ times it, which need no rows. The last of v are z.
    """

    def __init__(self, programme: Programme, limits: Limits) -> None:
        """Eliminate chains, and express the other forces by generators."""
        joint_count, load = len(programme.friction), programme.load
        balance, columns = programme.blocks.balance, programme.columns
        if columns is None:
            columns = sparse.csr_matrix((len(load), 0))
        links, pivots = _find_chains(programme.blocks.structure, columns)
        self._kept = ~np.isin(np.arange(len(load)) // 3, links)
        self._pivot = np.isin(np.arange(3 * joint_count) % joint_count, pivots)
        extra = columns.shape[1]
        self.map, largest = _cone_generators(programme, ~self._pivot[:joint_count], extra)
        count = self.map.shape[1] - extra
        free = np.concatenate([np.zeros(count - len(largest)), largest])
        lower = np.concatenate([-free, np.zeros(extra)])
        upper = np.concatenate([np.where(free > 0.0, free, np.inf), programme.upper_bounds])
        self._bounds = np.stack([lower, upper], axis=1)
        loads = sparse.csr_matrix(
            (columns.data, columns.indices + count, columns.indptr), (len(load), count + extra)
        )
        self.constant = np.zeros(3 * joint_count)
        if len(links):
            self._eliminate(balance[~self._kept], loads[~self._kept], load[~self._kept])
        self.force_cost = np.zeros(3 * joint_count)
        if programme.force_cost is not None:
            self.force_cost += programme.force_cost
        self._cost = self.map.T @ self.force_cost
        self._cost[count:] += programme.unknown_cost
        self._balance = balance[self._kept]
        self._equations = self._balance @ self.map + loads[self._kept]
        self._load = load[self._kept] - self._balance @ self.constant
        self._limits = _pivot_limits(programme, pivots)
        if len(limits.bounds):
            self._limits = self._limits.joined(limits)

    def _eliminate(self, own: sparse.csr_matrix, loads: sparse.csr_matrix, load: Array) -> None:
        """Solve the balance of the links of chains for the forces of their pivots."""
        self._factors = splu(own[:, self._pivot].tocsc())
        passed_on = (own @ self.map + loads).tocsc()
        # only forces at the end of a chain and loads act on its links
        acting = np.flatnonzero(np.diff(passed_on.indptr))
        solved = self._factors.solve(-passed_on[:, acting].toarray())
        row, column = np.nonzero(solved)
        place = np.flatnonzero(self._pivot)[row], acting[column]
        self.map = self.map + sparse.csr_matrix((solved[row, column], place), self.map.shape)
        self.constant[self._pivot] = self._factors.solve(load)

    def solve(self, large: int = 600) -> OptimizeResult | None:
        """Return SciPy's result: by the interior point from `large` equations on, else the simplex.

        In walls the simplex method takes 40 iterations a block. Without an objective any state
        will do, which it finds faster.
        """
        method = "highs-ipm" if len(self._load) > large and self._cost.any() else "highs-ds"
        rows = self._limits.rows
        limits = rows @ self.map, self._limits.bounds - rows @ self.constant
        return solve_linear(self._cost, self._bounds, (self._equations, self._load), limits, method)

    def multipliers(self, result: OptimizeResult) -> Array:
        """Return the multipliers of the balance of all blocks (3 n_free,)."""
        every = np.empty(len(self._kept))
        every[self._kept] = result.eqlin.marginals
        if not self._kept.all():
            # the forces of pivots are unknowns without bounds: their reduced costs vanish
            cost = self.force_cost - self._balance.T @ result.eqlin.marginals
            cost -= self._limits.rows.T @ result.ineqlin.marginals
            every[~self._kept] = self._factors.solve(cost[self._pivot], trans="T")
        return every


def _find_chains(
    structure: Structure, columns: sparse.csr_matrix
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the free blocks that link two joints, and a joint of each for a pivot (n,)."""
    place = np.full(len(structure.blocks), -1)
    place[list(structure.free)] = np.arange(len(structure.free))
    block, joint = place[structure.pairs.ravel()], np.repeat(np.arange(len(structure.pairs)), 2)
    # An unknown that acts on one block alone would enter the rows of its whole chain.
    single = np.bincount(columns.indices, minlength=columns.shape[1]) <= 3
    row = np.repeat(np.arange(columns.shape[0]), np.diff(columns.indptr))
    is_link = np.bincount(block[block >= 0], minlength=len(structure.free)) == 2
    is_link[row[single[columns.indices]] // 3] = False
    links, number = np.flatnonzero(is_link), np.cumsum(is_link) - 1
    ends = (block >= 0) & is_link[block]
    entries = np.ones(2 * len(links)), (number[block[ends]], joint[ends])
    incidence = sparse.csr_matrix(entries, (len(links), len(structure.pairs)))
    # n links in a row have n + 1 joints: any distinct ones can be solved for
    pivots = csgraph.maximum_bipartite_matching(incidence, perm_type="column")
    return links, np.asarray(pivots, dtype=np.intp)


def _cone_generators(
    programme: Programme, used: NDArray[np.bool_], extra: int
) -> tuple[sparse.csr_matrix, Array]:
    """Return generators of the forces of some joints, and bounds of the last ones.

    Columns (3 n_joints, m + extra) are followed by `extra` zero ones.
    """
    friction, count = programme.friction, len(used)
    cone = np.isfinite(friction) & (friction > 0.0)
    slides, plain = np.flatnonzero(used & cone), np.flatnonzero(used & ~cone)
    largest = np.where(np.isfinite(friction), programme.cohesion, np.inf)
    alone = np.flatnonzero(used & (largest > 0.0))  # these carry shear without compression
    # both ends with a shear of μ, both with -μ, both without shear, shear alone
    both, ends = np.tile(slides, 2), np.concatenate([slides, slides + count])
    rows = np.concatenate([ends, ends, plain, plain + count, alone + 2 * count])
    columns = np.arange(len(rows) + extra)
    shear, slope = np.tile(both + 2 * count, 2), np.repeat([1.0, -1.0], len(both))
    entries = np.concatenate([np.ones(len(rows)), slope * np.tile(friction[both], 2)])
    across = np.concatenate([columns[: len(rows)], columns[: len(shear)]])
    place = np.concatenate([rows, shear]), across
    return sparse.csr_matrix((entries, place), (3 * count, len(columns))), largest[alone]


def _pivot_limits(programme: Programme, pivots: NDArray[np.intp]) -> Limits:
    """Return the limits F_i, F_e >= 0 and |V| <= r + μ N of the pivots."""
    friction, count = programme.friction, len(programme.friction)
    slides = pivots[np.isfinite(friction[pivots])]
    first = 2 * len(pivots) + np.arange(2 * len(slides)).reshape(2, -1)  # of V, of -V
    row = [np.arange(2 * len(pivots)), *(first.ravel() for _ in range(3))]
    column = [np.concatenate([pivots, pivots + count])]
    column += [np.tile(slides + side * count, 2) for side in range(3)]
    slope = -np.tile(friction[slides], 2)
    entries = [-np.ones(2 * len(pivots)), slope, slope, np.repeat([1.0, -1.0], len(slides))]
    shape = (2 * len(pivots) + 2 * len(slides), 3 * count)
    place = np.concatenate(row), np.concatenate(column)
    rows = sparse.csr_matrix((np.concatenate(entries), place), shape)
    strength = np.tile(programme.cohesion[slides], 2)
    return Limits(rows, np.concatenate([np.zeros(2 * len(pivots)), strength]))
