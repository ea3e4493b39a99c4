"""Steps of chains of rigid stones with large displacements, for Newton's method.

Stones are eliminated by `stone_tree`. Each joint has a dense block of six by six, from the three
coordinates of both its stones. Eight joints are evaluated at a time, by `lane_law`. The equation is
that of `newton`.
"""

from typing import Any, NamedTuple

import numpy as np

from archfem._numba import inlined_kernel, kernel, summing_kernel
from archfem._typing import Array
from archfem.dynamics.solvers import stone_tree
from archfem.dynamics.solvers.base import is_kind, overload_steps
from archfem.dynamics.solvers.equation import Equation
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
from archfem.joints.large.face_kinematics import (
    add_angles,
    cosine_sine,
    face_forces,
    force_derivative,
    measure_step,
    rotation_series,
    short_series,
)
from archfem.joints.large.forces import LargeDisplacementJoints
from archfem.joints.large.lane_law import (
    LaneLaw,
    lane_damping_loss,
    lane_energy,
    lane_forces,
    lane_law,
    lane_overlap,
    pad,
)
from archfem.joints.large.lanes import WIDTH, any_lane, gather, lane, load, spread, store, with_lane

# Rows of stones: cosine and sine of half the angle at the start and the end, cosine and sine of the
# angle in the middle of the step, series of half its rotation, that half, and x and y
BC, BS, HC, HS, C, S, SHRUNK, RATE, HALF, X, Y = range(11)

# Rows of joints: of both faces the arm from the centroid and the pose if it is fixed, direction of
# the normal, half the difference of the angles of fixed faces, and the initial measures
FACE, DIRECTION, INITIAL, ORIENTATION = 0, 8, 12, 15


class ChainSystem(NamedTuple):
    """Chains of rigid stones, as a system of steps. A last stone, of no chain, is the ground."""

    law: LaneLaw
    stone: Any  # lower and higher stone of each joint (2, j)
    joint: Array  # rows of joints (16, j)
    parent: Any  # as of `StoneTree` (m,)
    stones: Array  # rows of the stones' motion (11, m + 1)
    mass: Array  # diagonal of M (n,)
    weight: Array  # forces of gravity (n,)
    body: Array  # forces per unit ground acceleration (2, n)
    work: StepWorkspace  # with zeros for the ground
    # derivatives of each joint: of forces on jump and angles (16), of the middles of both faces by
    # the angle, mean and at the end (8), rotation stiffness of both (2) (26, j)
    rates: Array
    # the same by the coordinates of both stones: rows of the lower stone's forces by its own
    # coordinates and by the higher's, and of the higher stone's (36, j)
    coupling: Array
    # forces of joints on both stones, and what they lack if points that reversed stick (12, j)
    forces: Array
    resultants: Array  # mean N, V, M (3, j)
    # jump, direction and half the difference of the angles at the start, each two rows, opening at
    # the middle of the overlap, slip, rotation, length and middle of the overlap, energy (12, j)
    start: Array
    end: Array  # opening, slip and rotation at the end, energy, and loss of the shear (5, j)
    blocks: Array  # D, U, L and F (4, m + 1, 3, 3)
    slip: Array  # irreversible slip before the step (p, j) [m]
    end_slip: Array  # and after it (p, j) [m]
    directions: Array  # slip direction of points in the last evaluation (p, j)
    tractions: Array  # mean normal tractions, at ends of facets times φ_i (p, j) [Pa]
    step: tuple[float, float, float]  # Δt, β/Δt, and the coefficient of M in C
    past: Array  # accelerations at the end of the step before the last (n,)
    known: Any  # number of steps so far in this run (1,)
    tolerances: Tolerances


def chain_system(equation: Equation, tree: stone_tree.StoneTree, dt: float) -> ChainSystem:
    """Return the data of steps of one length [s]."""
    model: Any = equation.model
    joints: LargeDisplacementJoints = model.joints
    law, order, count = joints.face_law, tree.order, len(joints.joint)
    points, size = len(law.place) // count, pad(count)
    balance = 1e-9 * float(np.linalg.norm(equation.weight))
    tolerances = Tolerances(balance, balance, 1e-13 * model.structure.size, 1e4 * balance, 0.0)
    stones = len(tree.parent) + 1
    return ChainSystem(  # type: ignore[call-arg]
        lane_law(law),
        *_joint_rows(joints, order),
        tree.parent,
        np.zeros((11, pad(stones))),
        model.mass.diagonal()[order],
        equation.weight[order],
        np.ascontiguousarray(model.mass_influence[order].T),
        StepWorkspace(*np.zeros((6, model.size + 3))),
        np.zeros((26, size)),
        np.zeros((36, size)),
        np.zeros((12, size)),
        np.zeros((3, size)),
        np.zeros((12, size)),
        np.zeros((5, size)),
        np.zeros((4, stones, 3, 3)),
        *np.zeros((4, points, size)),
        (dt, equation.lag / dt, equation.drag),
        np.zeros(model.size),
        np.zeros(1, np.int64),
        tolerances,
    )


def _joint_rows(joints: LargeDisplacementJoints, order: Any) -> tuple[Any, Array]:
    """Return the stones of each joint (2, j), and the rows of joints (16, j)."""
    sides, count = joints.kinematics, len(joints.joint)
    place, free = np.append(np.argsort(order), len(order)), sides.size == 3
    stone = np.full((2, pad(count)), len(order) // 3)
    stone[:, :count] = place[np.where(free, sides.index[:, :, 0], len(order))].T // 3
    rows = np.zeros((16, pad(count)))
    arm, turn = np.where(free[..., None], sides.arm, 0.0), sides.fixed_pose[:, :, 2]
    faces = np.concatenate([arm, sides.fixed_pose[:, :, :2]], axis=2)
    direction, difference = joints.normal_angle + 0.5 * turn.sum(1), 0.5 * (turn[:, 1] - turn[:, 0])
    rows[:, :count] = [
        *faces.reshape(count, 8).T,
        *(np.cos(direction), np.sin(direction), np.cos(difference), np.sin(difference)),
        *joints.initial_measures.T[:3],
        joints.orientation,
    ]
    return stone, rows


def constant_chain_parts(system: ChainSystem) -> tuple[Any, ...]:
    """Return the parts of the data that no step changes."""
    return system.law, system.stone, system.joint, system.parent, system.mass, system.weight


# ---- joints


@inlined_kernel
def _load_four(rows, first, at):  # type: ignore
    """Return four rows."""
    return (
        *(load(rows, first, at), load(rows, first + 1, at)),
        *(load(rows, first + 2, at), load(rows, first + 3, at)),
    )


@inlined_kernel
def _move_stones(stones, before, after, begins):  # type: ignore
    """Evaluate the rotations of all stones over the step."""
    for number in range(len(before) // 3):
        first = 3 * number
        if begins:
            stones[BC, number], stones[BS, number] = cosine_sine(0.5 * before[first + 2])
        stones[HALF, number] = 0.5 * (after[first + 2] - before[first + 2])
        stones[X, number], stones[Y, number] = after[first], after[first + 1]
    for at in range(0, stones.shape[1], WIDTH):
        half, bc, bs = load(stones, HALF, at), load(stones, BC, at), load(stones, BS, at)
        mean, shrunk, rate = _lane_series(half)
        turn = half * shrunk
        # in the middle of the step, and half the angle at its end
        c, s = add_angles(1.0 - 2.0 * bs * bs, 2.0 * bs * bc, mean, turn)
        hc, hs = add_angles(bc, bs, mean, turn)
        store(stones, C, at, c)
        store(stones, S, at, s)
        store(stones, HC, at, hc)
        store(stones, HS, at, hs)
        store(stones, SHRUNK, at, shrunk)
        store(stones, RATE, at, rate)


@inlined_kernel
def _lane_series(x):  # type: ignore
    """Return `rotation_series`."""
    c, s, rate = short_series(x)
    if any_lane(abs(x) > 0.25):
        for k in range(WIDTH):
            own = rotation_series(lane(x, k))
            c, s = with_lane(c, k, own[0]), with_lane(s, k, own[1])
            rate = with_lane(rate, k, own[2])
    return c, s, rate


@inlined_kernel
def _face_place(system, at, side, cosine, sine):  # type: ignore
    """Return the displacement of the middles of faces; the rows are of half the stones' angle."""
    stones, joint, first = system.stones, system.joint, FACE + 4 * side
    rx, ry = load(joint, first, at), load(joint, first + 1, at)
    c = gather(stones, cosine, system.stone, side, at)
    s = gather(stones, sine, system.stone, side, at)
    # R r - r, with cos θ - 1 by the half angle
    less, more = -2.0 * s * s, 2.0 * s * c
    x = load(joint, first + 2, at) + gather(stones, X, system.stone, side, at)
    y = load(joint, first + 3, at) + gather(stones, Y, system.stone, side, at)
    return (x + (less * rx - more * ry), y + (more * rx + less * ry)), (c, s)


@inlined_kernel
def _start_joints(system, at):  # type: ignore
    """Store what joints are at the start of a step, where the stones are then."""
    rows, joint, law = system.start, system.joint, system.law
    (xa, ya), (c, s) = _face_place(system, at, 0, BC, BS)
    (xb, yb), (cb, sb) = _face_place(system, at, 1, BC, BS)
    x, y = xb - xa, yb - ya
    x0, y0, x1, y1 = _load_four(joint, DIRECTION, at)
    normal, apart = add_angles(x0, y0, c, s), add_angles(x1, y1, cb, sb)
    normal, apart = add_angles(*normal, cb, sb), add_angles(*apart, c, -s)
    gap, slide, tilt, _ = _load_four(joint, INITIAL, at)
    opening, slip = normal[0] * x + normal[1] * y + gap, normal[0] * y - normal[1] * x + slide
    turn = 2.0 * apart[1] + tilt
    (length, _), (middle, _) = lane_overlap(law, at, slip)
    opening = opening - middle * turn
    energy = lane_energy(law, at, length, opening, turn)[0]
    _store_rows(rows, 0, at, (x, y, normal[0], normal[1], apart[0], apart[1]))
    _store_rows(rows, 6, at, (opening, slip, turn, length, middle, energy))


@inlined_kernel
def _store_rows(rows, first, at, values):  # type: ignore
    """Store values in rows one after another."""
    for k in range(len(values)):
        store(rows, first + k, at, values[k])


@inlined_kernel
def _middle_rates(system, at, side, half_angle):  # type: ignore
    """Return the derivatives of the middles of faces by the angle, mean and at the end."""
    rx, ry = load(system.joint, FACE + 4 * side, at), load(system.joint, FACE + 4 * side + 1, at)
    stones, (hc, hs) = system.stones, half_angle
    shrunk = gather(stones, SHRUNK, system.stone, side, at)
    c = gather(stones, C, system.stone, side, at)
    s = gather(stones, S, system.stone, side, at)
    c1, s1 = 1.0 - 2.0 * hs * hs, 2.0 * hs * hc
    mean = -shrunk * (s * rx + c * ry), shrunk * (c * rx - s * ry)
    return mean, (-(s1 * rx + c1 * ry), c1 * rx - s1 * ry), (rx, ry, c, s, shrunk)


@inlined_kernel
def _rotation_stiffness(system, at, side, frame, x, y):  # type: ignore
    """Return the derivative of the moment about the centroid of constant forces on faces."""
    rx, ry, c, s, shrunk = frame
    along, across = x * c + y * s, y * c - x * s
    turned, straight = across * rx - along * ry, along * rx + across * ry
    rate = gather(system.stones, RATE, system.stone, side, at)
    return 0.5 * (rate * turned - shrunk * straight)


@inlined_kernel
def _on_stones(push, low_mean, high_mean):  # type: ignore
    """Return forces and moments on the lower and on the higher stones, from those on faces."""
    x, y, low, high = push
    return (
        *(-x, -y, low - (low_mean[0] * x + low_mean[1] * y)),
        *(x, y, high + (high_mean[0] * x + high_mean[1] * y)),
    )


@inlined_kernel
def _measure_joints(system, at):  # type: ignore
    """Return the motion of joints over the step, and of half the angles of both stones.

    The former is the start as of `lane_forces`, measures at the end, and the rest of
    `measure_step`.
    """
    stones, joint, rows = system.stones, system.joint, system.start
    (xa, ya), low_half = _face_place(system, at, 0, HC, HS)
    (xb, yb), high_half = _face_place(system, at, 1, HC, HS)
    low, high = gather(stones, HALF, system.stone, 0, at), gather(stones, HALF, system.stone, 1, at)
    half, quarter = 0.5 * (low + high), 0.5 * (high - low)
    x, y, c, s = _load_four(rows, 0, at)
    begin = (c, s), (load(rows, 4, at), load(rows, 5, at))
    turns = (half, _lane_series(half)), (quarter, _lane_series(quarter))
    jumps = (x, y), (xb - xa, yb - ya)
    _, end, rates, now, step = measure_step(jumps, begin, turns)
    opening, slip, turn, _ = _load_four(joint, INITIAL, at)
    end = end[0] + opening, end[1] + slip, end[2] + turn
    start = *_load_four(rows, 6, at), load(rows, 10, at), load(rows, 11, at)
    return (start, end, (rates, now, step)), (low_half, high_half)


@inlined_kernel
def _evaluate_joints(system, at):  # type: ignore
    """Store the mean forces of joints over the step, their derivatives and resultants."""
    (start, end, (rates, now, step)), (low_half, high_half) = _measure_joints(system, at)
    memory = system.slip, system.end_slip, system.directions, system.tractions
    force, law_rate, (shear, moment, loss), missing, energy = lane_forces(
        system.law, at, start, end, system.step[1], memory
    )
    _store_rows(system.end, 0, at, (end[0], end[1], end[2], energy, loss))
    side = load(system.joint, ORIENTATION, at)
    _store_rows(system.resultants, 0, at, (-force[0], side * shear, side * moment))
    low_mean, low_end, low_frame = _middle_rates(system, at, 0, low_half)
    high_mean, high_end, high_frame = _middle_rates(system, at, 1, high_half)
    push = face_forces(rates, force)
    _store_rows(system.forces, 0, at, _on_stones(push, low_mean, high_mean))
    # points that reverse their slip: forces as if they stuck, of which rates are the derivatives
    none, reverses = spread(0.0), any_lane(missing != 0.0)
    lack = face_forces(rates, (none, missing, none))
    _store_rows(system.forces, 6, at, _on_stones(lack, low_mean, high_mean))
    x, y = push[0] + lack[0], push[1] + lack[1]
    force = force[0], force[1] + missing, force[2]
    a, b, c, d = force_derivative(step, rates, now, force, law_rate)
    _store_rows(system.rates, 0, at, a)
    _store_rows(system.rates, 4, at, b)
    _store_rows(system.rates, 8, at, c)
    _store_rows(system.rates, 12, at, d)
    _store_rows(system.rates, 16, at, low_mean + low_end)
    _store_rows(system.rates, 20, at, high_mean + high_end)
    low_bend = _rotation_stiffness(system, at, 0, low_frame, -x, -y)
    high_bend = _rotation_stiffness(system, at, 1, high_frame, x, y)
    _store_rows(system.rates, 24, at, (low_bend, high_bend))
    return reverses


@inlined_kernel
def _couple_joints(system, at):  # type: ignore
    """Store the derivatives of the forces of joints on both stones, four blocks of three by three.

    These are Uᵀ L V, and the rotation stiffness of both stones.
    """
    rates, blocks = system.rates, system.coupling
    p, q, r, s = _load_four(rates, 16, at)
    t, u, v, w = _load_four(rates, 20, at)
    first, second, third, fourth = (
        *(_load_four(rates, 0, at), _load_four(rates, 4, at)),
        *(_load_four(rates, 8, at), _load_four(rates, 12, at)),
    )
    for side in range(2):
        # L V: columns by the coordinates of the stone on this side
        sign, dx, dy = (-1.0, -r, -s) if side == 0 else (1.0, v, w)
        a, b = _by_stone(first, side, sign, dx, dy), _by_stone(second, side, sign, dx, dy)
        c, d = _by_stone(third, side, sign, dx, dy), _by_stone(fourth, side, sign, dx, dy)
        # rows of Uᵀ: -x, -y, -x p - y q + angle of the lower face; x, y, x t + y u + of the higher
        for k in range(3):
            place = 9 * side + k
            store(blocks, place, at, -a[k])
            store(blocks, place + 3, at, -b[k])
            store(blocks, place + 6, at, c[k] - p * a[k] - q * b[k])
            store(blocks, place + 18, at, a[k])
            store(blocks, place + 21, at, b[k])
            store(blocks, place + 24, at, d[k] + t * a[k] + u * b[k])
    store(blocks, 8, at, load(blocks, 8, at) + load(rates, 24, at))
    store(blocks, 35, at, load(blocks, 35, at) + load(rates, 25, at))


@inlined_kernel
def _by_stone(row, side, sign, dx, dy):  # type: ignore
    """Return the derivatives by the coordinates of a stone from those by its face."""
    turn = row[2] if side == 0 else row[3]
    return sign * row[0], sign * row[1], dx * row[0] + dy * row[1] + turn


# ---- steps


def _start_chain_run(system, state, memory):  # type: ignore
    """Copy the memory, and forget the steps of an earlier run."""
    system.known[0] = 0
    points, number = len(system.slip), 0
    for joint in range(len(memory) // points):
        for point in range(points):
            system.slip[point, joint] = memory[number]
            number += 1


# called from two places: twice its code would not fit into the processor's cache
@kernel
def _chain_residual(system, work, iteration):  # type: ignore
    """Evaluate the forces out of balance at the trial displacements."""
    before, after, move, residual = work.before, work.after, work.move, work.residual
    dt, _, drag = system.step
    inertia, count, reverses = 2.0 / dt**2 + drag / dt, len(system.mass), False
    for k in range(count):
        after[k] = before[k] + move[k]
        residual[k] = work.constant[k] - inertia * system.mass[k] * move[k]
    if iteration != 1:  # only the first correction is compared with the guess
        system.directions[:] = 0.0
    if iteration == 0:
        _move_stones(system.stones, before, before, True)
        for at in range(0, system.joint.shape[1], WIDTH):
            _start_joints(system, at)
    _move_stones(system.stones, before, after, False)
    for at in range(0, system.joint.shape[1], WIDTH):
        turned = _evaluate_joints(system, at)
        reverses = reverses or turned
    _add_forces(system, -1.0, 0, residual)
    return np.sqrt(_add_squares(residual, count)), reverses


@summing_kernel
def _add_squares(values, count):  # type: ignore
    """Return the sum of the squares of the first values."""
    total = 0.0
    for k in range(count):
        total += values[k] ** 2
    return total


@inlined_kernel
def _add_forces(system, factor, first, total):  # type: ignore
    """Add forces of joints on their stones, times a factor, to a vector."""
    stone, forces = system.stone, system.forces
    for joint in range(len(system.law.face_law.depth)):
        for side in range(2):
            place, row = 3 * stone[side, joint], first + 3 * side
            for k in range(3):
                total[place + k] += factor * forces[row + k, joint]


@inlined_kernel
def _chain_correction(system, work, iteration, reuse, hold):  # type: ignore
    """Solve for the correction of Δq."""
    correction, stone, count = work.correction, system.stone, len(system.law.face_law.depth)
    for k in range(len(correction)):
        correction[k] = work.residual[k]
    if hold:
        _add_forces(system, -1.0, 6, correction)
    if not reuse:
        dt, _, drag = system.step
        blocks, inertia = system.blocks, 2.0 / dt**2 + drag / dt
        blocks[:3] = 0.0
        for k in range(len(system.mass)):
            blocks[0, k // 3, k % 3, k % 3] = inertia * system.mass[k]
        for at in range(0, stone.shape[1], WIDTH):
            _couple_joints(system, at)
        for joint in range(count):
            stones = stone[0, joint], stone[1, joint]
            stone_tree.add_joint_blocks(system.coupling, joint, stones, system.parent, blocks)
        if not stone_tree.eliminate_stones(system.parent, blocks):
            return False
    stone_tree.substitute_stones(system.parent, system.blocks, correction)
    return True


_solve_chain = newton_driver(
    _chain_residual, Correction(_chain_correction, add_share, residual_work, reverse_correction)
)


def _solve_chain_step(system, step, states, ground):  # type: ignore
    """Solve a step from where the velocity leads; a second try starts where the blocks are."""
    (old, new), total, work, dt = states, 0, system.work, system.step[0]
    for k in range(len(system.mass)):
        work.before[k] = old[0, k]
        loads = system.weight[k] - ground[0] * system.body[0, k] - ground[1] * system.body[1, k]
        work.constant[k] = loads + 2.0 / dt * system.mass[k] * old[1, k]
    for share, limits in ((1.0, (12, 3, False)), (0.0, (60, 0, False))):
        for k in range(len(system.mass)):
            # accelerations of stiff modes change their sign from step to step: those of two steps
            # ago come closest
            rate = system.past[k] if system.known[0] > 0 else -old[2, k]
            work.move[k] = share * dt * (old[1, k] + 0.5 * dt * rate)
        iterations = _solve_chain(system, work, system.tolerances, limits)
        total += abs(iterations)
        if iterations > 0:
            end_step(work, dt, old, new)
            for k in range(len(system.mass)):
                system.past[k] = old[2, k]
            system.known[0] += 1
            return total
    return -1


def _evaluate_chain_step(system, step, states, ground, results, memory):  # type: ignore
    """Copy mean resultants, measures and memory, and evaluate the energies of a step."""
    (resultants, energy, faces), work, slip = results, system.work, system.slip
    dt, lag, drag = system.step
    energy[0] = energy[1] = energy[2] = energy[3] = 0.0
    for at in range(0, system.joint.shape[1], WIDTH):
        loss, elastic = _joint_energies(system, at, lag)
        for k in range(min(WIDTH, len(resultants) - at)):
            energy[1] += lane(elastic, k)
            energy[3] += lane(loss, k)
    for joint in range(len(resultants)):
        for k in range(3):
            resultants[joint, k] = system.resultants[k, joint]
        side = system.joint[ORIENTATION, joint]
        faces[0, joint], faces[1, joint] = system.end[0, joint], side * system.end[2, joint]
        faces[2, joint] = side * system.end[1, joint]
    for k in range(len(system.mass)):
        speed, move = states[1, 1, k], work.move[k]
        energy[0] += 0.5 * system.mass[k] * speed * speed
        energy[1] -= system.weight[k] * states[1, 0, k]
        energy[2] -= move * (ground[0] * system.body[0, k] + ground[1] * system.body[1, k])
        energy[3] += drag * system.mass[k] * move * move / dt
    number = 0
    for joint in range(len(resultants)):
        for point in range(len(slip)):
            slip[point, joint] = system.end_slip[point, joint]
            if number < len(memory):
                memory[number] = slip[point, joint]
            number += 1


@inlined_kernel
def _joint_energies(system, at, lag):  # type: ignore
    """Return the energy that joints lose in a step, and the energy stored at its end."""
    law, rows, end = system.law, system.start, system.end
    g1, slip, turn = load(end, 0, at), load(end, 1, at), load(end, 2, at)
    (length, _), (middle, _) = lane_overlap(law, at, slip)
    loss, elastic = load(end, 4, at), law.face_law.width * length * load(end, 3, at)
    if lag > 0.0:
        t0, l0 = load(rows, 8, at), load(rows, 9, at)
        start, last = (load(rows, 6, at), l0 * t0, l0), (g1 - middle * turn, length * turn, length)
        loss += lane_damping_loss(law, at, start, last, lag, system.tractions)
    for point in range(len(law.spring)):
        stretched = slip - load(system.end_slip, point, at)
        elastic += 0.5 * load(law.spring, point, at) * stretched * stretched
    return loss, elastic


overload_steps(is_kind(ChainSystem), _start_chain_run, _solve_chain_step, _evaluate_chain_step)
