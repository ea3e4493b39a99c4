"""Rigid blocks in equilibrium: forces at the joint ends, what joints carry, the linear programme.

Each joint carries a compression at its intrados end, F_i, one at its extrados end, F_e, and a
shear force V. They are as good as resultants,

    N = F_i + F_e,   M = (F_e - F_i) h/2,

and turn |M| <= N h/2 into F_i, F_e >= 0. Virtual work makes their balance with the loads f the
transpose of the opening of the two ends and of the slip in terms of the motions of the blocks:
-G_oᵀ F + G_sᵀ V = f. Livesley, Int. J. Numer. Meth. Eng. 12 (1978) 1853-1871.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.optimize import linprog

from archfem.actions import BodyForce, PointLoad
from archfem.errors import DidNotConverge
from archfem.kinematics import first_coordinate, motion_of, rigid_joints
from archfem.quadrature import Quadrature
from archfem.structure import Array, Structure

FEASIBLE = 1e-9
"""Residual of balance and limits that the linear programme accepts, in mean block weights."""

CUT = 1e-7
"""Largest violation of the crushing limit accepted, as a fraction of the crushing force σ w h."""

CUTS = 60  # rounds of crushing cuts; as tangents of a parabola they need about six


def rigid_load(structure: Structure, actions: Sequence[BodyForce | PointLoad]) -> Array:
    """Generalised forces of actions on the free blocks (3 n_free,) [N, N, N m].

    Raises:
        InvalidInput: a point load misses the structure.
    """
    start = first_coordinate(structure)
    load = np.zeros(3 * len(start))
    for action in actions:
        if isinstance(action, BodyForce):
            for number, first in start.items():
                block = structure.blocks[number]
                weight = block.area * block.material.unit_weight * structure.width
                load[first : first + 2] += weight * np.array([action.horizontal, action.vertical])
        else:
            number, point = action.place(structure)
            motion = motion_of(point[None, :], structure.blocks[number].centroid)[0]
            load[start[number] : start[number] + 3] += np.array(action.force) @ motion
    return load


@dataclass(frozen=True, eq=False)
class RigidBlocks:
    """The blocks of a structure, rigid, with forces at the two ends of each joint.

    Attributes:
        structure: whose blocks they are.
    """

    structure: Structure

    @property
    def force(self) -> float:
        """Unit of force in the programme: the mean weight of a free block [N]."""
        return self.structure.weight / len(self.structure.free)

    @cached_property
    def length(self) -> float:
        """Unit of length in the programme: the mean depth of a joint [m]."""
        return float(self.structure.depths.mean())

    @cached_property
    def coordinates(self) -> Array:
        """Units of the block coordinates in the programme (3 n_free,) [m, m, rad]."""
        return np.tile([1.0, 1.0, 1.0 / self.length], len(self.structure.free))

    @cached_property
    def kinematics(self) -> sparse.csr_matrix:
        """Openings of all intrados ends, of all extrados ends, and slips, of the free blocks.

        Shape (3 n_joints, 3 n_free) [-, -, m].
        """
        ends = rigid_joints(self.structure, 1, Quadrature("nodal"))
        rows = [ends.opening[0::2], ends.opening[1::2], ends.slip[0::2]]
        return sparse.vstack(rows, format="csr")

    def gaps(self, motion: Array) -> Array:
        """Openings at the intrados and the extrados, and slip, of a motion of all blocks.

        Args:
            motion: of the centroid of every block, fixed ones too (n_blocks, 3) [m, m, rad].

        Returns:
            (3, n_joints) [m].
        """
        gaps = np.zeros((3, len(self.structure.joints)))
        for number, joint in enumerate(self.structure.joints):
            jump = np.zeros((2, 2))
            for block, sign in ((joint.higher, 1.0), (joint.lower, -1.0)):
                points = motion_of(joint.ends, self.structure.blocks[block].centroid)
                jump += sign * points @ motion[block]
            gaps[:2, number] = jump @ self.structure.normals[number]
            gaps[2, number] = jump[0] @ joint.tangent
        return gaps

    @cached_property
    def balance(self) -> sparse.csr_matrix:
        """Balance of each free block, in the programme's units (3 n_free, 3 n_joints)."""
        sign = np.repeat([-1.0, -1.0, 1.0], len(self.structure.depths))
        return sparse.diags(self.coordinates) @ self.kinematics.T @ sparse.diags(sign)

    def scaled(self, load: Array) -> Array:
        """Generalised forces in the programme's units (3 n_free,)."""
        return self.coordinates * load / self.force

    def motion(self, coordinates: Array) -> Array:
        """Motion of all blocks from the multipliers of the balance (n_blocks, 3) [m, m, rad]."""
        motion = np.zeros((len(self.structure.blocks), 3))
        motion[list(self.structure.free)] = (self.coordinates * coordinates).reshape(-1, 3)
        return motion

    def reach(self, motion: Array) -> float:
        """Largest displacement of a corner of any block, for a motion (n_blocks, 3) [m]."""
        return max(
            float(np.linalg.norm(motion_of(block.drawn(), block.centroid) @ own, axis=1).max())
            for block, own in zip(self.structure.blocks, motion, strict=True)
        )

    def resultants(self, forces: Array) -> Array:
        """N, V, M from the programme's forces (3 n_joints,): (n_joints, 3) [N, N, N m]."""
        intrados, extrados, shear = self.force * forces.reshape(3, -1)
        moment = (extrados - intrados) * self.structure.depths / 2.0
        return np.stack([intrados + extrados, shear, moment], axis=1)


@dataclass(frozen=True, eq=False)
class Limits:
    """Linear limits on the joint forces, `rows @ forces <= bounds`, besides F_i, F_e >= 0.

    Attributes:
        rows: (m, 3 n_joints) [-].
        bounds: (m,) [mean block weights].
    """

    rows: sparse.csr_matrix
    bounds: Array

    def with_(self, other: "Limits") -> "Limits":
        """Both sets of limits together."""
        return Limits(
            sparse.vstack([self.rows, other.rows], format="csr"),
            np.concatenate([self.bounds, other.bounds]),
        )


def no_limits(joints: int) -> Limits:
    """No limits on the forces of so many joints."""
    return Limits(sparse.csr_matrix((0, 3 * joints)), np.zeros(0))


def friction_limits(coefficient: Array, cohesion: Array) -> Limits:
    """|V| <= c + μ N for each joint, with μ (n_joints,) [-] and c (n_joints,) [block weights]."""
    slope, one = sparse.diags(-coefficient), sparse.identity(len(coefficient))
    rows = sparse.bmat([[slope, slope, one], [slope, slope, -one]], format="csr")
    return Limits(rows, np.tile(cohesion, 2))


def crushing_cuts(joints: NDArray[np.intp], at: Array, crushing: Array) -> Limits:
    """Tangents of the crushing limit |M| <= N h/2 - N²/(2 σ w), for given joints.

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
    """

    value: float
    forces: Array
    coordinates: Array


@dataclass(frozen=True, eq=False)
class Programme:
    """A linear programme over joint forces x and further unknowns z >= 0.

        min  a·x + b·z   subject to   A x + D z = f,   limits on x,   F_i, F_e >= 0

    Attributes:
        blocks: which give A.
        load: f (3 n_free,) [block weights].
        limits: on the joint forces.
        crushing: crushing force σ w h of the joints (n_joints,) [block weights], or None.
        cost: a (3 n_joints,), or None for nothing.
        columns: D (3 n_free, k), or None for no unknowns but the forces.
        prices: b (k,).
    """

    blocks: RigidBlocks
    load: Array
    limits: Limits
    crushing: Array | None = None
    cost: Array | None = None
    columns: sparse.csr_matrix | None = None
    prices: Array = field(default_factory=lambda: np.zeros(0))

    def solve(self) -> Optimum | None:
        """Solve, adding crushing cuts until none is violated; None where it is unbounded.

        Raises:
            DidNotConverge: the solver gave up, or no state fulfils the limits.
        """
        limits = self.limits
        if self.crushing is not None:
            every = np.arange(len(self.crushing))
            for share in (0.25, 0.5, 1.0):
                limits = limits.with_(crushing_cuts(every, share * self.crushing, self.crushing))
        for _ in range(CUTS):
            found = self._solve_within(limits)
            if found is None or self.crushing is None:
                return found
            thrust = found.forces.reshape(3, -1)[:2].sum(axis=0)
            least = found.forces.reshape(3, -1)[:2].min(axis=0)
            excess = thrust**2 / (2.0 * self.crushing) - least
            broken = np.flatnonzero(excess > CUT * self.crushing)
            if not len(broken):
                return found
            limits = limits.with_(crushing_cuts(broken, thrust[broken], self.crushing))
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
        found = linprog(
            cost,
            A_ub=sparse.hstack([limits.rows, beside], format="csr"),
            b_ub=limits.bounds,
            A_eq=balance,
            b_eq=self.load,
            bounds=bounds,
            method="highs-ds",
            options={
                "primal_feasibility_tolerance": FEASIBLE,
                "dual_feasibility_tolerance": FEASIBLE,
                "presolve": False,
            },
        )
        if found.status == 3:
            return None
        if found.status != 0:
            raise DidNotConverge(f"the linear programme found no state: {found.message}")
        return Optimum(float(found.fun), found.x[:size], np.array(found.eqlin.marginals))
