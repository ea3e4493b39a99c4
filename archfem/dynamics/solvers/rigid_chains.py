"""Steps of chains of rigid stones with large displacements, for Newton's method.

The stones of an arch and its piers form chains, or trees where rings share a pier: joints link each
stone to at most one that is eliminated later. The tangent then has blocks of three by three, D_i on
the diagonal, U_i to the right of it and L_i below it, and its factor has no others:

    F_i = L_i D_i⁻¹,   D_p ← D_p - F_i U_i,

with p the stone to which i is linked. Each joint has a dense block of six by six, from the three
coordinates of both its stones. The equation is that of `newton`, the law is `joints.large`.
"""

from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload
from scipy import sparse
from scipy.sparse.csgraph import breadth_first_order, connected_components

from archfem._numba import INNER_OPTIONS, inlined_kernel, kernel
from archfem._typing import Array
from archfem.dynamics.solvers.base import evaluate_step, is_system, solve_step, start_run
from archfem.dynamics.solvers.equation import Equation
from archfem.dynamics.solvers.semismooth_newton import (
    Correction,
    Tolerances,
    add_share,
    newton_driver,
    residual_work,
    reverse_correction,
)
from archfem.joints.large.face_kinematics import (
    add_angles,
    cosine_sine,
    face_forces,
    force_derivative,
    rotation_series,
    step_measures,
)
from archfem.joints.large.forces import LargeDisplacementJoints
from archfem.joints.large.overlap_law import (
    FaceLaw,
    closing_energy,
    damping_loss,
    overlap,
    segment_forces,
)

# Motion of a stone over a step: cosine and sine of half its angle at the start, series of half its
# rotation, cosine and sine of its angle in the middle and at the end, and of half the latter
STONE_FIELDS = ("bc", "bs", "mean", "shrunk", "rate", "turn", "c", "s", "c1", "s1", "hc", "hs")
STONE_RECORD: np.dtype[Any] = np.dtype([(name, np.float64) for name in STONE_FIELDS])

# A face of a joint: first coordinate of its stone, arm from the centroid, pose if it is fixed
FACE_RECORD: np.dtype[Any] = np.dtype(
    [("first", np.int64), *((name, np.float64) for name in ("rx", "ry", "x", "y", "turn"))]
)


class StoneTree(NamedTuple):
    """Order of elimination of stones that joints link without a closed loop."""

    order: Any  # coordinates (n,)
    parent: Any  # stone that is eliminated later and linked to each; their number if none (m,)


class ChainSystem(NamedTuple):
    """Chains of rigid stones, as a system of steps. A last stone, of no chain, is the ground."""

    law: FaceLaw
    faces: Any  # lower and higher face of each joint, `FACE_RECORD` (j, 2)
    frame: Array  # angle of the normal, orientation, initial opening, slip and rotation (j, 5)
    parent: Any  # as of `StoneTree` (m,)
    stones: Any  # their motion, `STONE_RECORD` (m + 1,)
    mass: Array  # diagonal of M (n,)
    weight: Array  # forces of gravity (n,)
    body: Array  # forces per unit ground acceleration (2, n)
    work: "ChainWorkspace"
    # derivatives of each joint: of forces on jump and angles (16), of the middles of both faces by
    # the angle, mean and at the end (8), rotation stiffness of both (2) (j, 26)
    rates: Array
    missing: Array  # forces that joints lack if points that reversed stick (j, 6)
    resultants: Array  # mean N, V, M (j, 3)
    start: Array  # opening, slip and rotation at the start (j, 3)
    end: Array  # and at the end, and the loss of the shear (j, 4)
    reverses: Any  # whether the slip of points has reversed (j,)
    blocks: Array  # D, U, L and F (4, m + 1, 3, 3)
    slip: Array  # irreversible slip before the step (p,) [m]
    end_slip: Array  # and after it (p,) [m]
    directions: Array  # slip direction of points in the last evaluation (p,)
    step: tuple[float, float, float]  # Δt, β/Δt, and the coefficient of M in C
    past: Array  # accelerations at the end of the step before the last (n,)
    known: Any  # number of steps so far in this run (1,)
    tolerances: Tolerances


class ChainWorkspace(NamedTuple):
    """Vectors of a step, each with zeros for the ground (n + 3,)."""

    before: Array  # coordinates at its start
    after: Array  # and at its end, as tried
    move: Array  # Δq
    correction: Array  # of Δq
    residual: Array  # forces out of balance
    constant: Array  # forces that do not depend on the end of the step


def find_stone_tree(equation: Equation) -> StoneTree | None:
    """Return the order of elimination of rigid stones; None for other structures and damping."""
    model: Any = equation.model
    if not model.large_displacements:
        return None
    sides = model.joints.kinematics
    rigid = np.isin(sides.size, (0, 3)).all() and not sides.stretch.size
    if not rigid or len(model.joints.joint) != model.joints.joint_count:
        return None
    if not model.has_frame.all() or equation.rest.data.any() or model.block_stiffness.data.any():
        return None
    mass = model.mass.diagonal()
    off_diagonal = model.mass - sparse.diags(mass)
    if abs(off_diagonal).max() > 1e-12 * mass.max():
        return None
    count = model.size // 3
    pairs = sides.index[:, :, 0][(sides.size == 3).all(axis=1)] // 3
    links = sparse.csr_matrix((np.ones(len(pairs)), pairs.T), (count, count))
    links = ((links + links.T) > 0).astype(int)
    parts, part = connected_components(links, directed=False)
    if links.nnz // 2 != count - parts:  # a closed loop
        return None
    last_first, parent = [], np.full(count, -1)
    for number in range(parts):
        root = int(np.flatnonzero(part == number)[0])
        order, parents = breadth_first_order(links, root, directed=False)
        last_first += order.tolist()
        parent[order] = parents[order]
    stones = np.array(last_first[::-1])
    place = np.append(np.argsort(stones), count)
    parents = np.where(parent < 0, count, parent)[stones]
    return StoneTree((3 * stones[:, None] + np.arange(3)).ravel(), place[parents])


def chain_system(equation: Equation, tree: StoneTree, dt: float) -> ChainSystem:
    """Return the data of steps of one length [s]."""
    model: Any = equation.model
    joints: LargeDisplacementJoints = model.joints
    sides, law, order = joints.kinematics, joints.face_law, tree.order
    size, count, points = model.size, len(joints.joint), len(law.place)
    place = np.append(np.argsort(order), size)
    faces = np.zeros((count, 2), FACE_RECORD)
    free = sides.size == 3
    faces["first"] = place[np.where(free, sides.index[:, :, 0], size)]
    faces["rx"], faces["ry"] = np.moveaxis(np.where(free[..., None], sides.arm, 0.0), -1, 0)
    faces["x"], faces["y"], faces["turn"] = np.moveaxis(sides.fixed_pose, -1, 0)
    frame = np.column_stack([joints.normal_angle, joints.orientation, joints.initial_measures])
    balance = 1e-9 * float(np.linalg.norm(equation.weight))
    tolerances = Tolerances(balance, balance, 1e-13 * model.structure.size, 1e4 * balance, 0.0)
    stones = np.zeros(size // 3 + 1, STONE_RECORD)
    return ChainSystem(  # type: ignore[call-arg]
        law,
        faces,
        np.ascontiguousarray(frame[:, :5]),
        tree.parent,
        stones,
        model.mass.diagonal()[order],
        equation.weight[order],
        np.ascontiguousarray(model.mass_influence[order].T),
        ChainWorkspace(*np.zeros((6, size + 3))),
        np.zeros((count, 26)),
        np.zeros((count, 6)),
        np.zeros((count, 3)),
        np.zeros((count, 3)),
        np.zeros((count, 4)),
        np.zeros(count, bool),
        np.zeros((4, len(stones), 3, 3)),
        *np.zeros((3, points)),
        (dt, equation.lag / dt, equation.drag),
        np.zeros(size),
        np.zeros(1, np.int64),
        tolerances,
    )


def constant_chain_parts(system: ChainSystem) -> tuple[Any, ...]:
    """Return the parts of the data that no step changes."""
    return system.law, system.faces, system.frame, system.parent, system.mass, system.weight


# ---- joints


@kernel
def _move_stones(stones, before, after, begins):  # type: ignore
    """Evaluate the rotations of all stones over the step."""
    for number in range(len(stones)):
        stone, turn = stones[number], 3 * number + 2
        if begins:
            stone.bc, stone.bs = cosine_sine(0.5 * before[turn])
        half = 0.5 * (after[turn] - before[turn])
        stone.mean, stone.shrunk, stone.rate = rotation_series(half)
        stone.turn = half * stone.shrunk
        # in the middle of the step, and half the angle at its end
        less = -2.0 * stone.bs * stone.bs
        c, s = 1.0 + less, 2.0 * stone.bs * stone.bc
        stone.c, stone.s = add_angles(c, s, stone.mean, stone.turn)
        stone.hc, stone.hs = add_angles(stone.bc, stone.bs, stone.mean, stone.turn)
        stone.c1, stone.s1 = 1.0 - 2.0 * stone.hs * stone.hs, 2.0 * stone.hs * stone.hc


@inlined_kernel
def _shift(rx, ry, c, s):  # type: ignore
    """Return R r - r from cosine and sine of half the angle."""
    less, more = -2.0 * s * s, 2.0 * s * c
    return less * rx - more * ry, more * rx + less * ry


@inlined_kernel
def _face_poses(face, stone, before, after):  # type: ignore
    """Return the poses of a face at both ends of a step, and of its middle by the angle."""
    first, rx, ry = face.first, face.rx, face.ry
    x, y = _shift(rx, ry, stone.bc, stone.bs)
    start = (
        face.x + before[first] + x,
        face.y + before[first + 1] + y,
        face.turn + before[first + 2],
    )
    x, y = _shift(rx, ry, stone.hc, stone.hs)
    last = face.x + after[first] + x, face.y + after[first + 1] + y, face.turn + after[first + 2]
    c, s, c1, s1 = stone.c, stone.s, stone.c1, stone.s1
    mean = -stone.shrunk * (s * rx + c * ry), stone.shrunk * (c * rx - s * ry)
    return (start, last), mean, (-(s1 * rx + c1 * ry), c1 * rx - s1 * ry)


@inlined_kernel
def _rotation_stiffness(face, stone, x, y):  # type: ignore
    """Return the derivative of the moment about the centroid of a constant force on a face."""
    along, across = x * stone.c + y * stone.s, y * stone.c - x * stone.s
    turned, straight = across * face.rx - along * face.ry, along * face.rx + across * face.ry
    return 0.5 * (stone.rate * turned - stone.shrunk * straight)


@inlined_kernel
def _evaluate_joint(system, joint, before, after, residual):  # type: ignore
    """Subtract the mean forces of a joint over the step; store its derivatives and resultants."""
    low, high, stones = system.faces[joint, 0], system.faces[joint, 1], system.stones
    below, above, frame = stones[low.first // 3], stones[high.first // 3], system.frame[joint]
    lower, low_mean, low_end = _face_poses(low, below, before, after)
    higher, high_mean, high_end = _face_poses(high, above, before, after)
    start, end, rates, now, step = step_measures(lower, higher, frame[0])
    start = start[0] + frame[2], start[1] + frame[3], start[2] + frame[4]
    end = end[0] + frame[2], end[1] + frame[3], end[2] + frame[4]
    memory = system.slip, system.end_slip, system.directions
    force, law_rate, _, ((shear, moment), loss, missing) = segment_forces(
        system.law, joint, (start, end, (0.0, 0.0)), system.step[1], memory
    )
    begun, kept, resultants = system.start[joint], system.end[joint], system.resultants[joint]
    begun[0], begun[1], begun[2] = start
    kept[0], kept[1], kept[2], kept[3] = end[0], end[1], end[2], loss
    resultants[0], resultants[1], resultants[2] = -force[0], frame[1] * shear, frame[1] * moment
    x, y, turn, other = face_forces(rates, force)
    k, m = low.first, high.first
    residual[k], residual[k + 1] = residual[k] + x, residual[k + 1] + y
    residual[k + 2] += low_mean[0] * x + low_mean[1] * y - turn
    residual[m], residual[m + 1] = residual[m] - x, residual[m + 1] - y
    residual[m + 2] -= high_mean[0] * x + high_mean[1] * y + other
    # points that reverse their slip: forces as if they stuck, of which rates are the derivatives
    system.reverses[joint] = missing[0] != 0.0
    if system.reverses[joint]:
        dx, dy, turn, other = face_forces(rates, (0.0, missing[0], 0.0))
        lack = system.missing[joint]
        lack[0], lack[1], lack[2] = -dx, -dy, turn - low_mean[0] * dx - low_mean[1] * dy
        lack[3], lack[4], lack[5] = dx, dy, high_mean[0] * dx + high_mean[1] * dy + other
        x, y = x + dx, y + dy
    force = force[0], force[1] + missing[0], force[2]
    a, b, c, d = force_derivative(step, rates, now, force, law_rate)
    row = system.rates[joint]
    row[0], row[1], row[2], row[3] = a
    row[4], row[5], row[6], row[7] = b
    row[8], row[9], row[10], row[11] = c
    row[12], row[13], row[14], row[15] = d
    row[16], row[17], row[18], row[19] = low_mean + low_end
    row[20], row[21], row[22], row[23] = high_mean + high_end
    row[24] = _rotation_stiffness(low, below, -x, -y)
    row[25] = _rotation_stiffness(high, above, x, y)


@kernel
def _add_joint(row, low, high, parent, blocks):  # type: ignore
    """Add the derivatives of a joint to the blocks of both its stones."""
    # L V: columns of the lower stone, and of the higher one
    (p, q), (r, s) = (row[16], row[17]), (row[18], row[19])
    (t, u), (v, w) = (row[20], row[21]), (row[22], row[23])
    diagonal, right, below = blocks[0], blocks[1], blocks[2]
    child = min(low, high)
    linked = parent[child] == max(low, high) if child < len(parent) else False
    # rows of Uᵀ: -x, -y, -x p - y q + angle of the lower face; x, y, x t + y u + of the higher one
    for side in range(2):
        # columns by the coordinates of the stone on this side
        if side == 0:
            sign, dx, dy = -1.0, -r, -s
        else:
            sign, dx, dy = 1.0, v, w
        a0, a1 = sign * row[0], sign * row[1]
        a2 = dx * row[0] + dy * row[1] + row[2 + side]
        b0, b1 = sign * row[4], sign * row[5]
        b2 = dx * row[4] + dy * row[5] + row[6 + side]
        c0, c1 = sign * row[8], sign * row[9]
        c2 = dx * row[8] + dy * row[9] + row[10 + side]
        d0, d1 = sign * row[12], sign * row[13]
        d2 = dx * row[12] + dy * row[13] + row[14 + side]
        if side == 0:
            block = diagonal[low]
            cross = below[child] if child == low else right[child]
        else:
            block = diagonal[high]
            cross = right[child] if child == low else below[child]
        e0, e1, e2 = c0 - p * a0 - q * b0, c1 - p * a1 - q * b1, c2 - p * a2 - q * b2
        f0, f1, f2 = d0 + t * a0 + u * b0, d1 + t * a1 + u * b1, d2 + t * a2 + u * b2
        if side == 0:
            _add_rows(block, -1.0, (a0, a1, a2), (b0, b1, b2), (e0, e1, e2))
            block[2, 2] += row[24]
            if linked:
                _add_rows(cross, 1.0, (a0, a1, a2), (b0, b1, b2), (f0, f1, f2))
        else:
            _add_rows(block, 1.0, (a0, a1, a2), (b0, b1, b2), (f0, f1, f2))
            block[2, 2] += row[25]
            if linked:
                _add_rows(cross, -1.0, (a0, a1, a2), (b0, b1, b2), (e0, e1, e2))


@inlined_kernel
def _add_rows(block, sign, x, y, turn):  # type: ignore
    """Add three rows to a block, the first two with a sign."""
    for k in range(3):
        block[0, k] += sign * x[k]
        block[1, k] += sign * y[k]
        block[2, k] += turn[k]


@kernel
def _eliminate(parent, blocks):  # type: ignore
    """Factorise the tangent: invert D, and store F; returns whether all of it is finite."""
    diagonal, right, below, factor = blocks[0], blocks[1], blocks[2], blocks[3]
    total = 0.0
    for i in range(len(parent)):
        d = diagonal[i]
        a, b, c = d[0, 0], d[0, 1], d[0, 2]
        p, q, r = d[1, 0], d[1, 1], d[1, 2]
        u, v, w = d[2, 0], d[2, 1], d[2, 2]
        x, y, z = q * w - r * v, r * u - p * w, p * v - q * u
        scale = 1.0 / (a * x + b * y + c * z)
        total += scale
        d[0, 0], d[0, 1], d[0, 2] = x * scale, (c * v - b * w) * scale, (b * r - c * q) * scale
        d[1, 0], d[1, 1], d[1, 2] = y * scale, (a * w - c * u) * scale, (c * p - a * r) * scale
        d[2, 0], d[2, 1], d[2, 2] = z * scale, (b * u - a * v) * scale, (a * q - b * p) * scale
        if parent[i] == len(parent):
            continue
        e, f, g, h = below[i], factor[i], right[i], diagonal[parent[i]]
        for k in range(3):
            f0 = e[k, 0] * d[0, 0] + e[k, 1] * d[1, 0] + e[k, 2] * d[2, 0]
            f1 = e[k, 0] * d[0, 1] + e[k, 1] * d[1, 1] + e[k, 2] * d[2, 1]
            f2 = e[k, 0] * d[0, 2] + e[k, 1] * d[1, 2] + e[k, 2] * d[2, 2]
            f[k, 0], f[k, 1], f[k, 2] = f0, f1, f2
            for m in range(3):
                h[k, m] -= f0 * g[0, m] + f1 * g[1, m] + f2 * g[2, m]
    return np.isfinite(total)


@kernel
def _substitute(parent, blocks, x):  # type: ignore
    """Solve with the factor, x in place of the right side."""
    count = len(parent)
    inverse, right, factor = blocks[0], blocks[1], blocks[3]
    for i in range(count):
        if parent[i] < count:
            f, k, m = factor[i], 3 * i, 3 * parent[i]
            a, b, c = x[k], x[k + 1], x[k + 2]
            x[m] -= f[0, 0] * a + f[0, 1] * b + f[0, 2] * c
            x[m + 1] -= f[1, 0] * a + f[1, 1] * b + f[1, 2] * c
            x[m + 2] -= f[2, 0] * a + f[2, 1] * b + f[2, 2] * c
    for i in range(count - 1, -1, -1):
        d, k = inverse[i], 3 * i
        a, b, c = x[k], x[k + 1], x[k + 2]
        if parent[i] < count:
            g, m = right[i], 3 * parent[i]
            p, q, r = x[m], x[m + 1], x[m + 2]
            a -= g[0, 0] * p + g[0, 1] * q + g[0, 2] * r
            b -= g[1, 0] * p + g[1, 1] * q + g[1, 2] * r
            c -= g[2, 0] * p + g[2, 1] * q + g[2, 2] * r
        x[k] = d[0, 0] * a + d[0, 1] * b + d[0, 2] * c
        x[k + 1] = d[1, 0] * a + d[1, 1] * b + d[1, 2] * c
        x[k + 2] = d[2, 0] * a + d[2, 1] * b + d[2, 2] * c


# ---- steps


@overload(start_run, jit_options=INNER_OPTIONS)
def _start_run(system, state, memory):  # type: ignore
    return _start_chain_run if is_system(system, ChainSystem) else None


@overload(solve_step, jit_options=INNER_OPTIONS)
def _solve_step(system, step, states, ground):  # type: ignore
    return _solve_chain_step if is_system(system, ChainSystem) else None


@overload(evaluate_step, jit_options=INNER_OPTIONS)
def _evaluate_step(system, step, states, ground, results, memory):  # type: ignore
    return _evaluate_chain_step if is_system(system, ChainSystem) else None


def _start_chain_run(system, state, memory):  # type: ignore
    """Copy the memory, and forget the steps of an earlier run."""
    system.known[0] = 0
    for point in range(len(memory)):
        system.slip[point] = memory[point]


@kernel
def _chain_residual(system, work, iteration):  # type: ignore
    """Evaluate the forces out of balance at the trial displacements."""
    before, after, move, residual = work.before, work.after, work.move, work.residual
    dt, _, drag = system.step
    inertia, count, square, reverses = 2.0 / dt**2 + drag / dt, len(system.mass), 0.0, False
    for k in range(count):
        after[k] = before[k] + move[k]
        residual[k] = work.constant[k] - inertia * system.mass[k] * move[k]
    if iteration != 1:  # only the first correction is compared with the guess
        for point in range(len(system.directions)):
            system.directions[point] = 0.0
    _move_stones(system.stones, before, after, iteration == 0)
    for joint in range(len(system.faces)):
        _evaluate_joint(system, joint, before, after, residual)
        reverses = reverses or system.reverses[joint]
    for k in range(count):
        square += residual[k] ** 2
    return np.sqrt(square), reverses


@kernel
def _chain_correction(system, work, iteration, reuse, hold):  # type: ignore
    """Solve for the correction of Δq."""
    correction, faces = work.correction, system.faces
    for k in range(len(correction)):
        correction[k] = work.residual[k]
    for joint in range(len(faces) if hold else 0):
        for k in range(6 if system.reverses[joint] else 0):
            correction[faces[joint, k // 3].first + k % 3] -= system.missing[joint, k]
    if not reuse:
        dt, _, drag = system.step
        blocks, inertia = system.blocks, 2.0 / dt**2 + drag / dt
        blocks[:3] = 0.0
        for k in range(len(system.mass)):
            blocks[0, k // 3, k % 3, k % 3] = inertia * system.mass[k]
        for joint in range(len(faces)):
            low, high = faces[joint, 0].first // 3, faces[joint, 1].first // 3
            _add_joint(system.rates[joint], low, high, system.parent, blocks)
        if not _eliminate(system.parent, blocks):
            return False
    _substitute(system.parent, system.blocks, correction)
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
            # the midpoint rule: velocity and acceleration from the change of coordinates
            for k in range(len(system.mass)):
                new[0, k] = work.after[k]
                new[1, k] = (2.0 / dt) * work.move[k] - old[1, k]
                new[2, k] = (new[1, k] - old[1, k]) / dt
                system.past[k] = old[2, k]
            system.known[0] += 1
            return total
    return -1


def _evaluate_chain_step(system, step, states, ground, results, memory):  # type: ignore
    """Copy mean resultants and memory, and evaluate the energies of a step."""
    (resultants, energy), work, law = results, system.work, system.law
    dt, _, drag = system.step
    energy[0] = energy[1] = energy[2] = energy[3] = 0.0
    for joint in range(len(resultants)):
        for k in range(3):
            resultants[joint, k] = system.resultants[joint, k]
        opening, slip, turn, loss = system.end[joint]
        first = system.start[joint]
        ends = (first[0], first[1], first[2]), (opening, slip, turn)
        energy[3] += loss + damping_loss(law, joint, ends, system.step[1])
        (length, _), (middle, _) = overlap(law, joint, slip)
        phi = closing_energy(law, joint, length, opening - middle * turn, turn)[0]
        energy[1] += law.width * length * phi
        for point in range(law.first_point[joint], law.first_point[joint + 1]):
            system.slip[point] = system.end_slip[point]
            energy[1] += 0.5 * law.shear_spring[point] * (slip - system.slip[point]) ** 2
    for k in range(len(system.mass)):
        speed, move = states[1, 1, k], work.move[k]
        energy[0] += 0.5 * system.mass[k] * speed * speed
        energy[1] -= system.weight[k] * states[1, 0, k]
        energy[2] -= move * (ground[0] * system.body[0, k] + ground[1] * system.body[1, k])
        energy[3] += drag * system.mass[k] * move * move / dt
    for point in range(len(memory)):
        memory[point] = system.slip[point]
