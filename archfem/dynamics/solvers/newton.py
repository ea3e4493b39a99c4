"""Solver "newton": Newton's method on the whole structure, for small and large displacements.

One driver serves both (`semismooth_newton`): an initial guess, the assembled tangent, points that
reverse their slip held once, and a line search. The factor of the tangent is that of
`supernodal_lu`. Small displacements (`linear_step`) solve in every iteration

    (K + μ M + ν R - Gᵀ λ′ G) w = r + Gᵀ (λ - λ′ (z - z₀));

the residual is the difference of λ(z) from the λ that w is in balance with. Large displacements
solve for Δq. With f̄ the mean force of the joints over the step (`joints.large`),

    (2 M/Δt² + C/Δt + (½ + β/Δt) K) Δq - 2 M v/Δt + K q + f̄(q, q + Δq) = p - M r a_g.
"""

from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from archfem._numba import kernel
from archfem._typing import Array
from archfem.dynamics.solvers import joint_law, linear_step, supernodal_lu
from archfem.dynamics.solvers.base import StepSolver, is_kind, overload_for, overload_steps
from archfem.dynamics.solvers.equation import Equation
from archfem.dynamics.solvers.rigid_chains import ChainSystem, chain_system, constant_chain_parts
from archfem.dynamics.solvers.semismooth_newton import (
    Correction,
    StepWorkspace,
    Tolerances,
    add_share,
    end_step,
    newton_driver,
    residual_work,
    reverse_correction,
)
from archfem.dynamics.solvers.sparse_products import (
    SparseRows,
    add_rows,
    multiply,
    row_times,
    sparse_rows,
    without_round_off,
)
from archfem.dynamics.solvers.stone_tree import find_stone_tree
from archfem.joints.large.forces import (
    JointStepForces,
    LargeDisplacementJoints,
    allocate_step_forces,
    compute_step_forces,
    joint_energy,
)
from archfem.joints.large.rates import JointRates, add_rates, copy_rates, find_rate_blocks

# Evaluations in a step, above which the next one begins with a factor of its own: joints open or
# slide then, and change their derivatives much
MAX_EVALUATIONS_TO_KEEP = 5


class NewtonSolver(StepSolver):
    """Steps by Newton's method on all coordinates."""

    name: ClassVar[str] = "newton"

    def __init__(self, equation: Equation) -> None:
        self._equation, self.assembled = equation, {}
        pattern, joints = linear_step.tangent_pattern(equation), equation.joints
        self._elimination = supernodal_lu.Elimination.of(pattern)
        self.order, self.half_width = self._elimination.order, narrowest_width(pattern)
        stiffens = joints is not None and joints.points.stiffens
        self.is_narrow = self.half_width <= (12 if stiffens else 40)
        self._tree = find_stone_tree(equation)
        self.measures_faces = self._tree is not None
        if self._tree is not None:
            self.order = self._tree.order
        # a narrow tangent is factorised faster than the joint law is evaluated, a wide one is not
        self._reduction = 0.0 if self.is_narrow else 0.01
        self.keeps_factor = stiffens and not self.is_narrow
        if self.keeps_factor:
            # a factor takes as long as 4 to 10 iterations with the last one, which take off 6 to 15
            # digits at this reduction: a step needs 5 to 8
            self._reduction = 0.03

    @classmethod
    def of(cls, equation: Equation) -> Self | None:
        """Return the solver, or None where no compiled law covers joints and scheme."""
        large = equation.model.large_displacements and equation.conserving
        return cls(equation) if large or equation.joints is not None else None

    def assemble(self, dt: float) -> "SmallSystem | LargeSystem | ChainSystem":
        """Return the data of steps of one length [s]."""
        if self._tree is not None:
            return chain_system(self._equation, self._tree, dt)
        large = self._equation.model.large_displacements
        return self._large_system(dt) if large else self._small_system(dt)

    def constants(self, system: "SmallSystem | LargeSystem | ChainSystem") -> tuple[Any, ...]:
        """Return the parts of the data that no step changes."""
        if isinstance(system, ChainSystem):
            return constant_chain_parts(system)
        tangent = system.tangent
        changing = "entries", "factor", "products", "changed", "image"
        parts = [getattr(tangent, name) for name in tangent._fields if name not in changing]
        if isinstance(system, SmallSystem):
            return (*parts, *linear_step.constant_parts(system.linear), system.begin, system.places)
        matrices = system.mass, system.blocks, system.viscous, system.effective
        return (*parts, *matrices, system.joints, system.places, system.weight, system.body)

    def _store(self, matrix: sparse.csr_matrix, ends: Any) -> tuple[supernodal_lu.Panels, Any]:
        """Return a matrix to be factorised, and the places of its entries (row, column) there."""
        panels = supernodal_lu.panels_of(matrix, self._elimination, *ends)
        return panels, supernodal_lu.panel_places(panels, *ends).astype(np.uint32)

    def _small_system(self, dt: float) -> "SmallSystem":
        """Return the data of steps with small displacements."""
        linear, pairs, effective = linear_step.linear_system(self._equation, self.order, dt)
        law = linear.law
        begin, ends = linear_step.find_tangent_blocks(linear.gaps, pairs)
        tangent, places = self._store(effective, ends)
        widest = int(np.diff(linear.gaps[0]).max(initial=0))
        blocks = np.zeros(widest), np.zeros(widest**2)
        entries = np.zeros((len(pairs), 3), np.int64), np.zeros(len(pairs))
        factored = np.zeros(len(pairs), np.int64), np.zeros(len(pairs)), np.full(1, -1)
        rows, contact = np.zeros((7, len(law.offset))), np.zeros((3, len(linear.weight)))
        return SmallSystem(  # type: ignore[call-arg]
            linear,
            linear_step.linear_workspace(linear),
            tangent,
            begin,
            places,
            blocks,
            entries,
            factored,
            *rows,
            contact,
            self._reduction,
            self.keeps_factor,
        )

    def _large_system(self, dt: float) -> "LargeSystem":
        """Return the data of steps with large displacements."""
        equation, order, lag = self._equation, self.order, self._equation.lag / dt
        model: Any = equation.model  # of large displacements, with kinematics of its joints
        mass, blocks, viscous = (
            each[order][:, order].tocsr()
            for each in (model.mass, model.block_stiffness, equation.viscous)
        )
        effective = ((2.0 / dt**2) * mass + viscous / dt + (0.5 + lag) * blocks).tocsr()
        place, sides = np.argsort(order), model.joints.kinematics
        forces = allocate_step_forces(model.joints)
        sides = sides._replace(index=place[sides.index])
        tangent, places = self._store(effective, find_rate_blocks(sides.index, sides.size)[1])
        rates = JointRates(*(np.zeros_like(each) for each in forces.rates))
        # energy then drifts by 1e-8 of what is exchanged; reused factors round ten times as much
        balance = 1e-9 if self._reduction == 0.0 else 1e-8
        balance *= float(np.linalg.norm(equation.weight))
        round_off = 1e-13 * model.structure.size
        tolerances = Tolerances(balance, balance, round_off, 1e4 * balance, self._reduction)
        return LargeSystem(
            model.joints._replace(kinematics=sides),
            StepWorkspace(*np.zeros((6, model.size))),
            np.zeros(model.size),
            np.zeros(model.size),
            forces,
            np.zeros_like(forces.irreversible_slip),
            sparse_rows(without_round_off(mass)),
            sparse_rows(without_round_off(blocks)),
            sparse_rows(without_round_off(viscous)),
            sparse_rows(effective),
            tangent,
            np.zeros(1, bool),
            rates,
            places,
            np.zeros((2, 3, 5, sides.shapes.shape[3])),
            equation.weight[order],
            np.ascontiguousarray(model.mass_influence[order].T),
            (dt, lag),
            tolerances,
        )


def narrowest_width(pattern: sparse.csr_matrix) -> int:
    """Return the half-width of a matrix in its own order or, if less, in Cuthill and McKee's."""
    orders = np.arange(pattern.shape[0]), reverse_cuthill_mckee(pattern, symmetric_mode=True)
    ends = [pattern[order][:, order].tocoo() for order in orders]
    return min(int(np.abs(each.row - each.col).max(initial=0)) for each in ends)


# ---- small displacements


class SmallSystem(NamedTuple):
    """A structure of small displacements."""

    linear: linear_step.LinearSystem
    work: linear_step.LinearStepWorkspace
    tangent: Any  # K + μ M + ν R, to which joints add
    begin: supernodal_lu.Indices  # begin of the block of each pair of gap rows (q,)
    places: Any  # entries of the tangent in the blocks, row by row
    blocks: tuple[Array, Array]  # workspace for a row of a block, and for a block
    entries: tuple[Any, Array]  # derivatives: row, column and pair (m, 3), and values (m,)
    factored: tuple[Any, Array, Any]  # pairs and values in the factor, and their number (1,)
    released: Array  # λ(z) (r,)
    last: Array  # the same of the evaluation before (r,)
    balanced: Array  # λ that w is in balance with (r,)
    move: Array  # its change by the correction (r,)
    along: Array  # change of the gaps (r,)
    gap_origin: Array  # gaps before the correction (r,)
    balanced_origin: Array  # balanced λ before the correction (r,)
    contact: Array  # w, w before the correction, and the correction (3, n)
    reduction: float  # as of `Tolerances`
    keeps_factor: bool  # whether a step begins with the factor of the one before


@kernel
def _small_residual(system, work, iteration):  # type: ignore
    """Evaluate λ(z) at the trial gaps, and its difference from the λ in balance."""
    released, last, force = system.released, system.last, system.balanced
    largest, reverses = 0.0, False
    for row in range(len(released)):
        last[row] = released[row]
    linear_step.evaluate_released(system.linear.law, system.linear.places, released)
    if iteration == 0:  # nothing is in balance with the guess
        return np.inf, False
    for row in range(len(released)):
        error = abs(released[row] - force[row])
        if not error <= largest:  # also where it is not a number
            largest = error
        reverses = reverses or last[row] * released[row] < 0.0
    return largest, reverses


@kernel
def _small_correction(system, work, iteration, reuse, hold):  # type: ignore
    """Find the corrections of w, and of z and λ as the derivatives predict them."""
    gaps, law, begin = system.linear.gaps, system.linear.law, iteration == 0
    released, along, move = system.released, system.along, system.move
    origin = system.balanced_origin
    contact, change, right = system.contact, system.contact[2], work.right_side
    if not (reuse or _renew_factor(system, hold)):
        return False
    # right side: at the guess all of it, r + Gᵀ (λ - λ′ (z - z₀)); later, as w is in balance with a
    # λ, only the residual of that, which rounds less
    for row in range(len(move)):
        system.gap_origin[row] = law.guess[row]
        origin[row] = 0.0 if begin else system.balanced[row]
        move[row] = released[row] - origin[row]
        along[row] = law.offset[row] - law.guess[row]
    if begin:
        joint_law.add_derivatives(system.entries, system.factored[2][0], along, move)
    for k in range(len(change)):
        contact[1, k] = 0.0 if begin else contact[0, k]
        change[k] = right[k] if begin else 0.0
    add_rows(gaps, move, change)
    supernodal_lu.solve_panels(system.tangent, change)
    # change of the gaps, and of λ: the balance holds for any share of both
    for row in range(len(move)):
        moved = row_times(gaps, row, change)
        along[row] = moved + along[row] if begin else moved
        move[row] = released[row] - origin[row]
    joint_law.add_derivatives(system.entries, system.factored[2][0], along, move)
    return True


@kernel
def _renew_factor(system, hold):  # type: ignore
    """Factorise the tangent, unless it equals that of the last factor; returns its regularity."""
    tangent, (rows, values) = system.tangent, system.entries
    pairs, factored, number = system.factored
    law, numbers = system.linear.law, system.linear.places
    selection = numbers, numbers[: len(law.segments)], numbers[law.openings :]
    count = joint_law.collect_derivatives(law, selection, system.entries)
    if hold:
        joint_law.hold_reversed(system.last, system.released, system.entries, count)
    same = number[0] == count
    for k in range(count):
        same = same and pairs[k] == rows[k, 2] and factored[k] == values[k]
        pairs[k], factored[k] = rows[k, 2], values[k]
    if same:  # as where all joints stay closed
        return True
    entries, base = tangent.entries, tangent.base
    for k in range(len(entries)):
        entries[k] = base[k]
    linear_step.subtract_derivatives(system, count)
    regular = supernodal_lu.eliminate(tangent)
    number[0] = count if regular else -1
    return regular


@kernel
def _small_move(system, work, before, share):  # type: ignore
    """Add a share of the correction to w, gaps and balanced λ as they were without it."""
    law, contact = system.linear.law, system.contact
    for row in range(len(law.guess)):
        law.guess[row] = system.gap_origin[row] + share * system.along[row]
        system.balanced[row] = system.balanced_origin[row] + share * system.move[row]
    for k in range(contact.shape[1]):
        contact[0, k] = contact[1, k] + share * contact[2, k]
    return 1.0  # no tolerance of these structures is one of a correction


@kernel
def _small_work(system, work):  # type: ignore
    """Return the work of the released forces out of balance along the change of the gaps."""
    total = 0.0
    for row in range(len(system.along)):
        total += system.along[row] * (system.released[row] - system.balanced[row])
    return total


@kernel
def _reverse_small(system, work):  # type: ignore
    """Turn the correction around."""
    for row in range(len(system.along)):
        system.along[row], system.move[row] = -system.along[row], -system.move[row]
    for k in range(system.contact.shape[1]):
        system.contact[2, k] = -system.contact[2, k]


_solve_small = newton_driver(
    _small_residual, Correction(_small_correction, _small_move, _small_work, _reverse_small)
)


def _solve_small_step(system):  # type: ignore
    """Solve a step from where the velocity leads; a second try starts where the blocks are."""
    # an impact between stiff joints leads far into the other block, or away from it
    law, work, total = system.linear.law, system.work, 0
    # relative to the largest force; ten times as much where rounding does not let it fall
    error = 1e-12 * joint_law.largest_force(law, work.gap)
    tolerances = Tolerances(error, 10.0 * error, 0.0, 0.0, system.reduction)
    number = system.factored[2]
    # the derivatives of joints that stiffen change in every step, but little
    earlier = system.keeps_factor and number[0] >= 0
    for limit, full_steps, reusable in ((12, 4, earlier), (60, 1, False)):
        joint_law.predict_gaps(law, work.gap, work.gap_before)
        if full_steps == 1:
            for row in range(len(law.guess)):
                law.guess[row] = law.start[row] if law.gain > 0.0 else work.gap[row]
        iterations = _solve_small(system, work, tolerances, (limit, full_steps, reusable))
        total += abs(iterations)
        if system.keeps_factor and total > MAX_EVALUATIONS_TO_KEEP:
            number[0] = -1
        if iterations > 0:
            for row in range(len(law.guess)):
                work.gap_before[row], work.gap[row] = work.gap[row], law.guess[row]
                work.force[row] = system.balanced[row]
            for k in range(len(system.linear.weight)):
                work.contact[k] = system.contact[0, k]
            return total
    return -1


overload_for(is_kind(SmallSystem), linear_step.solve_contact, _solve_small_step)


# ---- large displacements


class LargeSystem(NamedTuple):
    """A structure of large displacements."""

    joints: LargeDisplacementJoints  # kinematics and law
    work: StepWorkspace
    pulled: Array  # K q at the start of the step (n,)
    momentum: Array  # M v there (n,)
    forces: JointStepForces  # workspace of the joints' forces over a step
    slip: Array  # irreversible slip of the points before the step (p,) [m]
    mass: SparseRows
    blocks: SparseRows  # K, of the blocks alone
    viscous: SparseRows  # C
    effective: SparseRows  # 2 M/Δt² + C/Δt + (½ + β/Δt) K
    tangent: Any  # the same, to which joints add
    factored: Any  # whether it has a factor of this run (1,)
    rates: JointRates  # of the joints in that
    places: Any  # entry of the tangent that each derivative of joint forces adds to (e,)
    faces: Array  # workspace of `add_rates` (2, 3, 5, s)
    weight: Array  # forces of gravity (n,)
    body: Array  # forces per unit ground acceleration (2, n)
    step: tuple[float, float]  # Δt, and β/Δt
    tolerances: Tolerances


def _start_large_run(system, state, memory):  # type: ignore
    """Copy memory and state, and discard the factor of an earlier run."""
    system.factored[0] = False
    multiply(system.blocks, state[0], system.pulled)
    multiply(system.mass, state[1], system.momentum)
    for point in range(len(memory)):
        system.slip[point] = memory[point]


@kernel
def _sum_loads(system, work, old, ground):  # type: ignore
    """Sum up the forces that do not depend on the end of the step."""
    constant, body = work.constant, system.body
    for k in range(len(constant)):
        work.before[k] = old[0, k]
        # gravity, ground motion, 2 M v/Δt, and blocks at the start
        inertia = 2.0 / system.step[0] * system.momentum[k]
        constant[k] = system.weight[k] + inertia - ground[0] * body[0, k] - ground[1] * body[1, k]
        constant[k] -= system.pulled[k]


@kernel
def _large_residual(system, work, iteration):  # type: ignore
    """Evaluate the forces out of balance at the trial displacements."""
    forces, square, reverses = system.forces, 0.0, False
    residual, move, sides = work.residual, work.move, system.joints.kinematics
    for k in range(len(move)):
        work.after[k] = work.before[k] + move[k]
    if iteration != 1:  # only the first correction is compared with the guess
        forces.slip_direction[:] = 0.0
    compute_step_forces(system.joints, work.before, work.after, system.step[1], system.slip, forces)
    # loads less inertia, damping and blocks, then less the mean forces of the joints
    for k in range(len(residual)):
        residual[k] = work.constant[k] - row_times(system.effective, k, move)
    for joint in range(len(forces.force)):
        reverses = reverses or forces.reverses[joint]
        for side in range(2):
            for k in range(sides.size[joint, side]):
                residual[sides.index[joint, side, k]] -= forces.force[joint, side, k]
    for k in range(len(residual)):
        square += residual[k] ** 2
    return np.sqrt(square), reverses


@kernel
def _large_correction(system, work, iteration, reuse, hold):  # type: ignore
    """Solve for the correction of Δq."""
    forces, sides, correction = system.forces, system.joints.kinematics, work.correction
    for k in range(len(correction)):
        correction[k] = work.residual[k]
    if hold:  # what the residual lacks if reversed points stick; rates are those of stuck points
        for joint in range(len(forces.missing_force)):
            for side in range(2 if forces.reverses[joint] else 0):
                for k in range(sides.size[joint, side]):
                    correction[sides.index[joint, side, k]] -= forces.missing_force[joint, side, k]
    if not reuse:
        _renew_tangent(system)
        if not system.factored[0]:
            return False
    supernodal_lu.solve_panels(system.tangent, correction)
    return True


@kernel
def _renew_tangent(system):  # type: ignore
    """Assemble the joints whose derivatives have changed, and factorise the tangent."""
    sides, own, new = system.joints.kinematics, system.rates, system.forces.rates
    tangent, places = system.tangent, system.places
    entries, base, changed = tangent.entries, tangent.base, tangent.changed
    whole = not system.factored[0] or system.tolerances.reduction == 0.0
    for k in range(len(entries) if whole else 0):
        entries[k] = base[k]
    changed[:] = False
    for joint in range(len(sides.size)):
        if not whole:
            if not _has_changed(own.law[joint], new.law[joint]):
                continue
            add_rates(sides, joint, own, -1.0, system.faces, places, entries)
        add_rates(sides, joint, new, 1.0, system.faces, places, entries)
        copy_rates(new, own, joint)
        for side in range(2):
            for k in range(sides.size[joint, side]):
                changed[tangent.group_of[sides.index[joint, side, k]]] = True
    system.factored[0] = supernodal_lu.eliminate(supernodal_lu.add_ancestors(tangent))


@kernel
def _has_changed(last, law):  # type: ignore
    """Return whether the law of a joint differs so much that a correction by the last one errs."""
    largest = change = 0.0
    for row in range(5):
        for column in range(5):
            largest = max(largest, abs(last[row, column]), abs(law[row, column]))
            change = max(change, abs(law[row, column] - last[row, column]))
    # corrections then err by 1e-4, which the next one makes up for
    return change > 1e-4 * largest


_solve_large = newton_driver(
    _large_residual, Correction(_large_correction, add_share, residual_work, reverse_correction)
)


def _solve_large_step(system, step, states, ground):  # type: ignore
    """Solve a step from where the velocity leads; a second try starts where the blocks are."""
    # an impact between stiff joints leads far into the other block, or away from it
    (old, new), total, dt, work = states, 0, system.step[0], system.work
    _sum_loads(system, work, old, ground)
    # the factor of the step before leads as close to the joints' new states as a new one would
    earlier = system.factored[0] and system.tolerances.reduction > 0.0
    for share, limits in ((1.0, (12, 3, earlier)), (0.0, (60, 0, False))):
        for k in range(len(work.move)):
            work.move[k] = share * dt * (old[1, k] - 0.5 * dt * old[2, k])
        iterations = _solve_large(system, work, system.tolerances, limits)
        total += abs(iterations)
        if iterations > 0:
            end_step(work, dt, old, new)
            return total
        system.factored[0] = False
    return -1


def _evaluate_large_step(system, step, states, ground, results, memory):  # type: ignore
    """Copy mean resultants and memory, and evaluate the energies of a step."""
    resultants, energy, _ = results
    for joint in range(len(resultants)):
        for k in range(3):
            resultants[joint, k] = system.forces.resultants[joint, k]
    _evaluate_energies(system, system.work, states[1], ground, energy)
    for point in range(len(memory)):
        memory[point] = system.slip[point]


@kernel
def _evaluate_energies(system, work, new, ground, energy):  # type: ignore
    """Evaluate energies at the end of a step, and work and losses in it."""
    (dt, lag), forces, move = system.step, system.forces, work.move
    energy[0] = energy[1] = energy[2] = energy[3] = 0.0
    for k in range(len(forces.irreversible_slip)):
        system.slip[k] = forces.irreversible_slip[k]
    for k in range(len(forces.dissipation)):
        energy[3] += forces.dissipation[k]
    for k in range(len(move)):
        system.momentum[k] = row_times(system.mass, k, new[1])
        energy[0] += 0.5 * new[1, k] * system.momentum[k]
        energy[1] -= system.weight[k] * new[0, k]
        energy[2] -= move[k] * (ground[0] * system.body[0, k] + ground[1] * system.body[1, k])
        # blocks: their energy, and damping proportional to their stiffness
        more = row_times(system.blocks, k, move)
        system.pulled[k] += more
        energy[1] += 0.5 * new[0, k] * system.pulled[k]
        energy[3] += lag * move[k] * more + move[k] * row_times(system.viscous, k, move) / dt
    energy[1] += joint_energy(system.joints, new[0], system.slip)


overload_steps(is_kind(LargeSystem), _start_large_run, _solve_large_step, _evaluate_large_step)
