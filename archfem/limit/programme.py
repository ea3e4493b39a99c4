"""Linear programmes over the forces at the joints of rigid blocks, and what joints can carry."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.optimize import linprog

from archfem.arrays import Array
from archfem.errors import DidNotConverge
from archfem.limit.blocks import RigidBlocks

FEASIBLE = 1e-9
"""Residual of balance and limits that the linear programme accepts, in mean block weights."""

TRIALS = ((False, FEASIBLE), (True, FEASIBLE), (True, 10.0 * FEASIBLE))
"""Whether the solver simplifies first, and what it accepts: the next where round-off stopped it."""

EXCESS = 1e-7
"""Largest violation of the crushing limit accepted, as a fraction of the crushing force σ w h."""

ENDED = (0, 2, 3)
"""Answers of the solver that are one: an optimum, no state, an objective without bound."""

CUTS = 60  # rounds of crushing cuts; as tangents of a parabola they need about six


class NoState(DidNotConverge):
    """The programme has nothing to choose from: no forces balance the loads within the limits."""


@dataclass(frozen=True, eq=False)
class Limits:
    """Linear limits on the joint forces, `rows @ forces <= bounds`, besides F_i, F_e >= 0.

    Attributes:
        rows: (m, 3 n_joints) [-].
        bounds: (m,) [mean block weights].
    """

    rows: sparse.csr_matrix
    bounds: Array

    def joined(self, other: "Limits") -> "Limits":
        """Return both sets of limits together.

        Args:
            other: limits on the same forces.
        """
        return Limits(
            sparse.vstack([self.rows, other.rows], format="csr"),
            np.concatenate([self.bounds, other.bounds]),
        )


def no_limits(joints: int) -> Limits:
    """Return no limits on the forces of so many joints.

    Args:
        joints: how many.
    """
    return Limits(sparse.csr_matrix((0, 3 * joints)), np.zeros(0))


def friction_limits(coefficient: Array, cohesion: Array) -> Limits:
    """Return the limits |V| <= c + μ N of each joint.

    Args:
        coefficient: μ, infinite where a joint never slides (n_joints,) [-].
        cohesion: c (n_joints,) [mean block weights].
    """
    slides = np.isfinite(coefficient)
    slope, one = sparse.diags(-np.where(slides, coefficient, 0.0)), sparse.diags(1.0 * slides)
    rows = sparse.bmat([[slope, slope, one], [slope, slope, -one]], format="csr")
    return Limits(rows, np.tile(cohesion, 2))


def crushing_cuts(joints: NDArray[np.intp], at: Array, crushing: Array) -> Limits:
    """Return tangents of the crushing limit |M| <= N h/2 - N²/(2 σ w), for given joints.

    A rectangular stress block of the full strength σ asks each end for F >= N²/(2 N_c) with
    N_c = σ w h; the tangent at N_0 is F >= N_0/N_c N - N_0²/(2 N_c).

    Args:
        joints: numbers of joints (m,).
        at: N_0 of each (m,) [block weights].
        crushing: N_c of all joints (n_joints,) [block weights].
    """
    slope, row, count = at / crushing[joints], np.arange(len(joints)), len(crushing)
    shape = (len(joints), count)
    tangent = sparse.csr_matrix((slope, (row, joints)), shape)
    end = sparse.csr_matrix((np.ones(len(joints)), (row, joints)), shape)
    rows = sparse.bmat(
        [[tangent - end, tangent, None], [tangent, tangent - end, sparse.csr_matrix(shape)]]
    )
    return Limits(rows.tocsr(), np.tile(slope * at / 2.0, 2))


@dataclass(frozen=True, eq=False)
class Optimum:
    """The best state that a programme found.

    Attributes:
        value: the least value of the objective.
        forces: F_i, F_e and V of all joints (3 n_joints,) [mean block weights].
        coordinates: multipliers of the balance, the motion of the free blocks (3 n_free,).
        unknowns: z, the unknowns beside the forces (k,).
    """

    value: float
    forces: Array
    coordinates: Array
    unknowns: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, eq=False)
class Programme:
    """A linear programme over joint forces x and further unknowns z.

        min  a·x + b·z   subject to   A x + D z = f,   limits on x,   F_i, F_e >= 0,   0 <= z <= c

    Attributes:
        blocks: which give A.
        load: f (3 n_free,) [block weights].
        limits: on the joint forces.
        crushing: crushing force σ w h of the joints (n_joints,) [block weights], or None.
        cost: a (3 n_joints,), or None for nothing.
        columns: D (3 n_free, k), or None for no unknowns but the forces.
        prices: b (k,).
        most: c (k,), infinite where z has no upper limit.
    """

    blocks: RigidBlocks
    load: Array
    limits: Limits
    crushing: Array | None = None
    cost: Array | None = None
    columns: sparse.csr_matrix | None = None
    prices: Array = field(default_factory=lambda: np.zeros(0))
    most: Array = field(default_factory=lambda: np.zeros(0))

    def also(self, columns: sparse.csr_matrix, prices: Array, most: float = np.inf) -> "Programme":
        """Return the programme with further unknowns before those it has.

        Args:
            columns: of D (3 n_free, m).
            prices: of b (m,).
            most: upper limit of all of them.
        """
        return replace(
            self,
            columns=columns
            if self.columns is None
            else sparse.hstack([columns, self.columns], format="csr"),
            prices=np.concatenate([prices, self.prices]),
            most=np.concatenate([np.full(len(prices), most), self.most]),
        )

    def growing(self, load: Array) -> "Programme":
        """Return the programme whose first unknown is the largest factor of a load beside f.

        Args:
            load: generalised forces (3 n_free,) [N, N, N m].
        """
        column = sparse.csr_matrix(-self.blocks.scaled(load)[:, None])
        return self.also(column, np.array([-1.0]))

    def unbalanced(self) -> Optimum:
        """Return the least forces to be added for equilibrium; their multipliers are a fall."""
        either = sparse.identity(len(self.load))
        columns = sparse.hstack([either, -either], format="csr")
        found = self.also(columns, np.ones(2 * len(self.load))).solve()
        assert found is not None  # no sum of magnitudes is below zero
        return found

    def objective(self, state: Optimum) -> float:
        """Return a·x + b·z of a state that another programme over the same unknowns found.

        Args:
            state: its forces and unknowns.
        """
        cost = 0.0 if self.cost is None else self.cost @ state.forces
        return float(cost + self.prices @ state.unknowns)

    def solve(self) -> Optimum | None:
        """Solve, adding crushing cuts until none is violated.

        Returns:
            The optimum, or None where the objective falls without bound.

        Raises:
            DidNotConverge: the solver gave up; `NoState` where no state fulfils the limits.
        """
        limits = self.limits
        if self.crushing is not None:
            every = np.arange(len(self.crushing))
            for share in (0.25, 0.5, 1.0):
                limits = limits.joined(crushing_cuts(every, share * self.crushing, self.crushing))
        for _ in range(CUTS):
            found = self._solve_within(limits)
            if found is None or self.crushing is None:
                return found
            thrust = found.forces.reshape(3, -1)[:2].sum(axis=0)
            least = found.forces.reshape(3, -1)[:2].min(axis=0)
            excess = thrust**2 / (2.0 * self.crushing) - least
            broken = np.flatnonzero(excess > EXCESS * self.crushing)
            if not len(broken):
                return found
            limits = limits.joined(crushing_cuts(broken, thrust[broken], self.crushing))
        raise DidNotConverge(
            f"the crushing limit is still violated after {CUTS} rounds of cuts: "
            "check that strength is in Pa"
        )

    def _solve_within(self, limits: Limits) -> Optimum | None:
        """Solve with linear limits only."""
        joints, extra = len(self.blocks.structure.depths), len(self.prices)
        size = 3 * joints
        cost = np.concatenate([np.zeros(size) if self.cost is None else self.cost, self.prices])
        balance = self.blocks.balance
        if self.columns is not None:
            balance = sparse.hstack([balance, self.columns], format="csr")
        beside = sparse.csr_matrix((len(limits.bounds), extra))
        bounds = np.tile([0.0, np.inf], (size + extra, 1))
        bounds[2 * joints : size, 0] = -np.inf
        bounds[size:, 1] = self.most
        for presolve, fits in TRIALS:
            found = linprog(
                cost,
                A_ub=sparse.hstack([limits.rows, beside], format="csr"),
                b_ub=limits.bounds,
                A_eq=balance,
                b_eq=self.load,
                bounds=bounds,
                method="highs-ds",
                options={
                    "primal_feasibility_tolerance": fits,
                    "dual_feasibility_tolerance": fits,
                    "presolve": presolve,
                },
            )
            if found.status in ENDED:
                break
        if found.status == 3:
            return None
        if found.status == 2:
            raise NoState("no state of equilibrium fulfils the limits")
        if found.status != 0:
            raise DidNotConverge(f"the linear programme found no state: {found.message}")
        multipliers = np.array(found.eqlin.marginals)
        return Optimum(float(found.fun), found.x[:size], multipliers, found.x[size:])
