"""A step of a structure that is linear but for its joints: small displacements.

The equation of a step is written at the contact displacement w = u + β v. With C = α M + R,

    (K + μ M + ν R) w = p + M y + R x + Gᵀ λ,    z = G w + z₀,    λ = λ(z),

K is that with all joints closed and stuck, y and x follow from the state before, and λ are the
released forces (`joint_law`). A solver overloads `solve_contact`. The rest is common to all: images
of the state under M, K and R follow by Newmark's formulas and give energies without further
products.
"""

import itertools
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem._numba import inlined_kernel, kernel, summing_kernel
from archfem._typing import Array
from archfem.dynamics.solvers.base import overload_steps
from archfem.dynamics.solvers.equation import Equation
from archfem.dynamics.solvers.joint_law import (
    JointLaw,
    between,
    collect_released,
    evaluate_openings,
    evaluate_slips,
    gaps_between,
    joint_law,
    open_forces,
)
from archfem.dynamics.solvers.newmark import StepNumbers, add_combination, update_images
from archfem.dynamics.solvers.sparse_products import (
    SparseRows,
    add_rows,
    multiply,
    sparse_rows,
    without_round_off,
)
from archfem.joints.large.point_law import linear_means
from archfem.joints.large.rates import list_blocks


class LinearSystem(NamedTuple):
    """A structure that is linear but for its joints, coordinates in the order of a solver."""

    mass: SparseRows  # M
    closed: SparseRows  # K, with all joints closed and stuck
    rest: SparseRows  # R, the part of C not proportional to M; may have no entries
    gaps: SparseRows  # G, rows of openings and slips (r, n)
    shear: SparseRows  # shear resultants of joints that cannot slide (n_joints, n), else no rows
    weight: Array  # forces of gravity, and of joints in the undisplaced structure (n,)
    body: Array  # forces per unit ground acceleration (2, n)
    numbers: StepNumbers
    law: JointLaw
    places: Any  # numbers of all rows, whose begin are those of all segments, too (r,)


class LinearStepWorkspace(NamedTuple):
    """Arrays that persist from step to step; the ends of a step alternate in `images`."""

    images: Array  # of u, v and a under M, K and R (2, 3, 3, n)
    gap: Array  # z (r,)
    gap_before: Array  # z of the step before (r,)
    force: Array  # λ (r,)
    gap_end: Array  # gaps at the end of a step (r,)
    gap_seen: Array  # gaps that the law of an instant sees there (r,)
    spare: Array  # scratch (r,)
    contact: Array  # w (n,)
    right_side: Array  # of the equation of the step (n,)
    product: Array  # of a matrix and w (n,)
    released: Array  # by openings at an instant, and how much more with the lag (2, o)


def find_tangent_blocks(
    gaps: SparseRows, pairs: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """List rows and columns of the tangent's entries that joints change, block after block.

    The derivative of force i by gap j changes a block: rows of all coordinates on which force i
    does work, columns of all that move gap j. Pairs of the same coordinates, as within a joint,
    share a block. The first result is where the block of each pair begins among the entries.
    """
    indptr, indices, _ = gaps
    moved = [tuple(indices[a:b].tolist()) for a, b in itertools.pairwise(indptr)]
    return list_blocks((moved[i], moved[j]) for i, j in pairs)


def tangent_pattern(equation: Equation) -> sparse.csr_matrix:
    """Return a matrix with all entries that the tangent may have."""
    model = equation.model
    if equation.joints is None:  # entries that are zero now are not, once blocks have turned
        return model.closed_tangent()
    parts = (model.mass, model.closed_tangent(), equation.rest)
    pattern = sum(abs(without_round_off(part)) for part in parts)
    # joints couple what moves a released force with what moves the gaps it depends on
    _, gaps, pairs = joint_law(equation.joints, equation.numbers(1.0), 1.0, equation.conserving)
    touched = abs(without_round_off(gaps))
    coupled = sparse.csr_matrix((np.ones(len(pairs)), pairs.T), 2 * (touched.shape[0],))
    return sparse.csr_matrix(pattern + touched.T @ (coupled + coupled.T) @ touched)


def linear_system(
    equation: Equation, order: NDArray[Any], dt: float
) -> tuple[LinearSystem, NDArray[np.int64], sparse.csr_matrix]:
    """Return the data of steps with reordered coordinates.

    Also the pairs of gap rows (q, 2), and K + μ M + ν R (n, n).
    """
    model, joints, numbers = equation.model, equation.joints, equation.numbers(dt)
    assert joints is not None
    law, gaps, pairs = joint_law(joints, numbers, dt, equation.conserving)
    # shear of joints that can slide is summed up point by point instead
    shear, weight = joints.shear_resultants()[: 0 if joints.slides else None], equation.weight
    if joints.gap_offset is not None:
        weight = weight - joints.generalised_force(*joints.elastic_forces(joints.gap_offset))
    mass, closed, rest = (
        without_round_off(each[order][:, order])
        for each in (model.mass, model.closed_tangent(), equation.rest)
    )
    rows = (without_round_off(each[:, order]) for each in (gaps, shear))
    matrices: Any = [sparse_rows(each) for each in (mass, closed, rest, *rows)]
    loads = weight[order], np.ascontiguousarray(model.mass_influence[order].T)
    places = np.arange(len(law.offset))
    system = LinearSystem(*matrices, *loads, numbers, law, places)  # type: ignore[call-arg]
    return system, pairs, closed + numbers.inertia * mass + numbers.rate * rest


def constant_parts(linear: LinearSystem) -> tuple[Any, ...]:
    """Return the parts that no step changes: all but the state of the joints."""
    return tuple(part for part in linear if part is not linear.law)


def linear_workspace(linear: LinearSystem) -> LinearStepWorkspace:
    """Allocate the workspace of runs."""
    size, rows = len(linear.weight), len(linear.law.offset)
    ends, released = np.zeros((2, 3, 3, size)), np.zeros((2, linear.law.openings))
    return LinearStepWorkspace(ends, *np.zeros((6, rows)), *np.zeros((3, size)), released)  # type: ignore[call-arg]


def solve_contact(system: Any) -> Any:
    """Solve a step for w, z and λ in the workspace of a system from its right side; overloaded."""
    raise NotImplementedError


def _is_linear(system: Any) -> bool:
    """Return whether numba types a system as one with a field `linear`."""
    return "linear" in getattr(system, "fields", ())


def _start_linear_run(system, state, memory):  # type: ignore
    """Fill the workspace with images and gaps of a state, and the memory of the joints."""
    linear, law, work, images = system.linear, system.linear.law, system.work, system.work.images
    lag, released, start, speed = linear.numbers.lag, work.released, law.start, law.speed
    for k in range(3):
        multiply(linear.mass, state[k], images[0, 0, k])
        multiply(linear.closed, state[k], images[0, 1, k])
        multiply(linear.rest, state[k], images[0, 2, k])
    # gaps and their rates
    multiply(linear.gaps, state[0], start)
    multiply(linear.gaps, state[1], speed)
    for point in range(len(memory)):
        law.points[point].slip = memory[point]
    for row in range(len(start)):
        start[row] += law.offset[row]
        # at an instant the law sees gaps ahead by the lag of damping
        work.gap[row] = start[row] + (lag * speed[row] if law.gain == 0.0 else 0.0)
        speed[row] *= 2.0 / linear.numbers.velocity[1]
        work.gap_before[row] = work.gap[row] - (speed[row] if law.gain > 0.0 else 0.0)
        work.force[row] = 0.0
    if law.gain == 0.0:
        force = work.force[: law.openings]
        open_forces(law, work.gap, force)
        open_forces(law, start, released[0])
        for row in range(law.openings):
            released[1, row] = force[row] - released[0, row]


def _solve_linear_step(system, step, states, ground):  # type: ignore
    """Solve a step and update state and images."""
    linear, work, numbers = system.linear, system.work, system.linear.numbers
    old, new, right = work.images[step % 2], work.images[(step + 1) % 2], work.right_side
    # right side: gravity and ground, inertia, damping, and joints that slid before the step
    for k in range(len(right)):
        ground_force = ground[0] * linear.body[0, k] + ground[1] * linear.body[1, k]
        right[k] = linear.weight[k] - ground_force
    add_combination(right, old[0], numbers.inertia_load)
    if len(linear.rest[2]) > 0:
        add_combination(right, old[2], numbers.damping_load)
    _add_irreversible_slips(linear.law, linear.gaps, right)
    iterations = solve_contact(system)
    if iterations > 0:
        _update_images(linear, work, (old, new))
        update_images(work.contact, states[0], states[1], numbers)
    return iterations


@kernel
def _add_irreversible_slips(law, gaps, right):  # type: ignore
    """Add forces k s of irreversible slips before the step: stuck joints act about these."""
    indptr, indices, data = gaps
    for k in range(len(law.points)):
        point = law.points[k]
        if point.slip_row >= 0 and point.slip != 0.0:
            for entry in range(indptr[point.slip_row], indptr[point.slip_row + 1]):
                right[indices[entry]] += data[entry] * point.shear * point.slip


@kernel
def _update_images(linear, work, ends):  # type: ignore
    """Update the images of the state after a step; K w follows from the balance of the step."""
    (old, new), numbers = ends, linear.numbers
    right, image = work.right_side, work.product
    add_rows(linear.gaps, work.force, right)
    multiply(linear.mass, work.contact, image)
    update_images(image, old[0], new[0], numbers)
    for k in range(len(right)):
        right[k] -= numbers.inertia * image[k]
    if len(linear.rest[2]) > 0:
        multiply(linear.rest, work.contact, image)
        update_images(image, old[2], new[2], numbers)
        for k in range(len(right)):
            right[k] -= numbers.rate * image[k]
    update_images(right, old[1], new[1], numbers)


def _evaluate_linear_step(system, step, states, ground, results, memory):  # type: ignore
    """Evaluate resultants, energies and memory of a step."""
    linear, law, work = system.linear, system.linear.law, system.work
    resultants, energy, _ = results
    images = work.images[step % 2], work.images[(step + 1) % 2]
    if law.gain == 0.0:
        _gaps_at_end(linear, work, states[1])
    _sum_resultants(law, linear.shear, work.contact, resultants)
    loads = linear.weight, linear.body[0], linear.body[1]
    damping = linear.numbers.drag, linear.numbers.lag
    _energies_if_closed(states, images, loads, damping, ground, energy)
    if law.gain == 0.0:
        _instant_energies(law, linear.numbers.lag, work, energy)
    else:
        _path_energies(law, work.gap, energy, memory)
        energy[1] -= open_forces(law, law.start, work.released[0])


@kernel
def _gaps_at_end(linear, work, state):  # type: ignore
    """Find the gaps at the end of a step; with HHT, also forces where it writes the equation."""
    law, numbers, now, seen = linear.law, linear.numbers, work.gap_end, work.gap_seen
    multiply(linear.gaps, state[0], now)
    if numbers.share == 1.0:
        for row in range(len(seen)):
            seen[row] = work.gap[row]
    else:  # HHT writes the equation before the end: evaluate the joints there
        multiply(linear.gaps, state[1], seen)
        for row in range(len(seen)):
            seen[row] = now[row] + numbers.lag * seen[row]
        for k in range(len(work.contact)):
            work.contact[k] = state[0, k] + numbers.lag * state[1, k]
        evaluate_openings(law, seen, linear.places[: len(law.segments)])


@kernel
def _sum_resultants(law, shear, contact, resultants):  # type: ignore
    """Sum up N, V, M of every joint from the forces of its points."""
    for joint in range(len(resultants)):
        resultants[joint, 0] = resultants[joint, 1] = resultants[joint, 2] = 0.0
        if len(shear[0]) > 1:
            for entry in range(shear[0][joint], shear[0][joint + 1]):
                resultants[joint, 1] += shear[2][entry] * contact[shear[1][entry]]
    for k in range(len(law.points)):
        point, state = law.points[k], law.point_states[k]
        resultants[point.joint, 0] -= state.normal
        resultants[point.joint, 2] -= state.normal * point.lever
        if point.slip_row >= 0:
            resultants[point.joint, 1] += state.shear


@summing_kernel
def _energies_if_closed(states, images, loads, damping, ground, energy):  # type: ignore
    """Evaluate energies of a step as if all joints were closed and stuck, from the images."""
    (old, new), (weight, across, up), (drag, lag) = images, loads, damping
    before, u, v = states[0, 0], states[1, 0], states[1, 1]
    kinetic, potential, work, lost = 0.0, 0.0, 0.0, 0.0
    for k in range(len(u)):
        moved = u[k] - before[k]
        # ½ v·M v; ½ u·K u - u·p; work of the ground; damping by mass, by K and by R
        kinetic += 0.5 * v[k] * new[0, 1, k]
        potential += u[k] * (0.5 * new[1, 0, k] - weight[k])
        work -= moved * (ground[0] * across[k] + ground[1] * up[k])
        viscous = drag * (old[0, 1, k] + new[0, 1, k])
        viscous += lag * (old[1, 1, k] + new[1, 1, k]) + old[2, 1, k] + new[2, 1, k]
        lost += 0.5 * moved * viscous
    energy[0], energy[1], energy[2], energy[3] = kinetic, potential, work, lost


@kernel
def _instant_energies(law, lag, work, energy):  # type: ignore
    """Subtract energy and damping that open joints lack, the latter by the trapezoidal rule."""
    now, force, released = work.gap_end, work.spare[: law.openings], work.released
    late = released[1]
    energy[1] -= open_forces(law, now, released[0])
    if lag > 0.0:
        # how much more is released where the law sees the joints than at the gaps themselves
        open_forces(law, work.gap_seen, force)
        for row in range(len(late)):
            more = force[row] - released[0, row]
            energy[3] -= 0.5 * (now[row] - law.start[row]) * (late[row] + more)
            late[row] = more
    for row in range(len(now)):
        law.start[row] = now[row]


@kernel
def _path_energies(law, gap, energy, memory):  # type: ignore
    """Add dissipation of the joints over their path, and go to the start of the next step.

    Energies are as if joints held tension and were stuck: the damping of open ones is subtracted,
    and the dissipation of friction is added.
    """
    start, speed, gain = law.start, law.speed, law.gain
    if law.damping_lag > 0.0:
        energy[3] += _open_damping(law, gap)
        for point in law.points:
            if point.slip_row >= 0:
                slip = gain * (gap[point.slip_row] - start[point.slip_row])
                energy[3] -= law.damping_lag * point.shear * slip**2
    for row in range(len(start)):
        # the midpoint rule: gaps and rates at the end of the step
        moved = gain * (gap[row] - start[row])
        start[row] += moved
        speed[row] = 2.0 * moved - speed[row]
    for k in range(len(law.points)):
        point, state = law.points[k], law.point_states[k]
        if point.slip_row >= 0:
            energy[3] += state.lost / point.shear
            point.slip += state.slip / point.shear
            memory[k] = point.slip
            # elastic energy of the slip, instead of that of a stuck point
            elastic, slip = start[point.slip_row] - point.slip, start[point.slip_row]
            energy[1] += 0.5 * point.shear * (elastic**2 - slip**2)
    energy[1] += law.stored


@kernel
def _open_damping(law, gap):  # type: ignore
    """Return the energy dissipated by the lag on openings, less that of closed joints [J]."""
    start, points, lost, step = law.start, law.points, 0.0, 2 if law.facets else 1
    for number in range(len(law.segments)):
        part, state = law.segments[number], law.segment_states[number]
        first = start[part.near], start[part.far]
        moved = law.gain * (gap[part.near] - first[0]), law.gain * (gap[part.far] - first[1])
        last = first[0] + moved[0], first[1] + moved[1]
        # work of the released forces, which contain the lag ...
        stiffens = points[part.begin].closing_rate > 0.0
        if not stiffens:
            lost -= moved[0] * state.near + moved[1] * state.far
        late = _shift_by_lag(first + last, law.damping_lag)
        if max(first + last) <= 0.0 and not (stiffens and max(late) > 0.0):
            continue
        # ... less that of the same forces without lag
        for k in range(part.begin, part.end, step):
            point, a, b = points[k], points[k].share, points[k + step - 1].share
            ends = gaps_between(first, last, a, b)
            taken = linear_means(point, ends, 0.0, 0.0, law.facets)[1]
            if stiffens:  # ... of the linear part, as the excess over it has no lag
                late = _shift_by_lag(ends, law.damping_lag)
                more = linear_means(point, late, 0.0, 0.0, law.facets)[1]
                taken = taken[0] - more[0], taken[1] - more[1]
            lost += point.area * (between(moved, a) * taken[0] + between(moved, b) * taken[1])
    return lost


@inlined_kernel
def _shift_by_lag(ends, lag):  # type: ignore
    """Shift the gaps of a facet at start and end of a step by the lag of damping."""
    first, last = lag * (ends[2] - ends[0]), lag * (ends[3] - ends[1])
    return ends[0] + first, ends[1] + last, ends[2] + first, ends[3] + last


@kernel
def evaluate_released(law, places, released):  # type: ignore
    """Evaluate the released forces of all rows at the guess of z."""
    segments, slips = places[: len(law.segments)], places[law.openings :]
    evaluate_openings(law, law.guess, segments)
    evaluate_slips(law, law.guess, slips)
    collect_released(law, (places, segments, slips), released)


@summing_kernel
def subtract_derivatives(system, count):  # type: ignore
    """Subtract Gᵀ λ′ G from the tangent, block by block of gaps with the same coordinates."""
    (rows, values), (indptr, _, data), k = system.entries, system.linear.gaps, 0
    entries, places, (line, dense) = system.tangent.entries, system.places, system.blocks
    while k < count:
        begin = system.begin[rows[k, 2]]
        width = np.int64(indptr[rows[k, 1] + 1] - indptr[rows[k, 1]])
        size = width * np.int64(indptr[rows[k, 0] + 1] - indptr[rows[k, 0]])
        for m in range(size):
            dense[m] = 0.0
        while k < count and system.begin[rows[k, 2]] == begin:
            # one row of λ′ G, then its product with the gap whose force changes
            row = rows[k, 0]
            for j in range(width):
                line[j] = 0.0
            while k < count and rows[k, 0] == row and system.begin[rows[k, 2]] == begin:
                first = np.int64(indptr[rows[k, 1]])
                for j in range(width):
                    line[j] += values[k] * data[first + j]
                k += 1
            place: Any = 0
            for entry in range(indptr[row], indptr[row + 1]):
                for j in range(width):
                    dense[place + j] += data[entry] * line[j]
                place += width
        for m in range(size):
            entries[places[begin + m]] -= dense[m]


overload_steps(_is_linear, _start_linear_run, _solve_linear_step, _evaluate_linear_step)
