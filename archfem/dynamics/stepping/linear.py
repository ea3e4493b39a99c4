"""A step of a structure that is linear but for its joints, in whatever coordinates it is given.

With w = u + β v the contact where the equation of a step is written, and C = α M + R,

    (K + μ M + ν R) w = p + M y + R x + Gᵀ λ,    z = G w,    λ = J(z) z,

K with all joints closed, y and x from the state before, λ the tension taken out of open joints. How
w and λ are found is the strategy's: it overloads `solve` for the type of its system. All else is
the same for all: images of the state under M, K, R and G follow it by Newmark's formulas without
further products, and give resultants and energies.
"""

from typing import Any, NamedTuple

import numba
import numpy as np
from numba.core import types
from numba.extending import overload
from numpy.typing import NDArray
from scipy import sparse

from archfem.arrays import Array
from archfem.dynamics.stepping import open_points  # noqa: F401  (solves the small problem)
from archfem.dynamics.stepping.chain import Chain, chain_of
from archfem.dynamics.stepping.equation import Equation
from archfem.dynamics.stepping.joint_law import Law, joint_resultants, law_of, pulls
from archfem.dynamics.stepping.loop import begin, measure, settle
from archfem.dynamics.stepping.newmark import Numbers, add_mixed, follow, mix
from archfem.dynamics.stepping.path_law import PathLaw, pairs_of, path_law
from archfem.dynamics.stepping.small_problem import add_held, is_of
from archfem.dynamics.stepping.sparse_rows import Rows, add_rows, rows_of, stored, times, trimmed

Matrix = Rows | Array


class Linear(NamedTuple):
    """What the systems of linear strategies have in common, as their field `linear`.

    Attributes:
        mass: M.
        closed: K, with all joints closed.
        rest: R, what of C is not proportional to M; without entries where there is none.
        opening: G, also of slips where those are followed (r, n).
        shear: shear resultants of the joints, without rows where slips are followed (n_joints, n).
        weight: forces of gravity, and of joints before anything moves (n,).
        body: forces per unit ground acceleration (2, n).
        numbers: of the time step.
        law: of the joints, at an instant or over steps.
    """

    mass: Matrix
    closed: Matrix
    rest: Matrix
    opening: Matrix
    shear: Matrix
    weight: Array
    body: Array
    numbers: Numbers
    law: Law | PathLaw


class Kept(NamedTuple):
    """What is carried from step to step; of the two ends of a step, each is the old one in turn.

    Attributes:
        images: of u, v and a under M, K and R (2, 3, 3, n).
        gaps: openings at u, v and a, the tension taken out at u, and how much more is taken out
            where the law sees the joints (2, 5, p).
        gap: openings that the law sees (p,).
        before: the same a step earlier (p,).
        force: λ (p,).
        contact: w (n,).
        right: right side of a step (n,).
    """

    images: Array
    gaps: Array
    gap: Array
    before: Array
    force: Array
    contact: Array
    right: Array


def reordered(equation: Equation, order: NDArray[Any], dt: float) -> Linear:
    """Return the matrices of an equation of motion by rows, its coordinates in another order.

    Args:
        equation: of motion, with joints on supports that have not moved.
        order: numbers of the coordinates, the first one first (n,).
        dt: time step [s].
    """
    model, joints = equation.model, equation.joints
    assert joints is not None
    square = [model.mass, model.closed(), equation.rest]
    mass, closed, rest = (rows_of(trimmed(matrix[order][:, order])) for matrix in square)
    rows = gaps_of(equation, dt)
    opening, shear = (rows_of(trimmed(matrix[:, order])) for matrix in (rows.gaps, rows.shear))
    body = np.ascontiguousarray(model.body[order].T)
    weight, numbers = rows.weight[order], equation.numbers(dt)
    return Linear(mass, closed, rest, opening, shear, weight, body, numbers, rows.law)


class Gaps(NamedTuple):
    """What a linear strategy needs to know of the joints.

    Attributes:
        gaps: rows of the gaps that the law asks for (r, n).
        shear: shear resultants of joints none of which slides (n_joints, n).
        weight: gravity, and what joints exert before anything moves (n,).
        law: of the joints.
    """

    gaps: sparse.csr_matrix
    shear: sparse.csr_matrix
    weight: Array
    law: Law | PathLaw


def gaps_of(equation: Equation, dt: float) -> Gaps:
    """Return what a linear strategy needs to know of the joints.

    Args:
        equation: of motion, whose joints a compiled loop can follow.
        dt: time step [s].
    """
    joints = equation.joints
    assert joints is not None
    shear, weight = joints.shear_resultants(), equation.weight
    if not equation.conserving:
        return Gaps(joints.opening, shear, weight, law_of(joints))
    law, rows = path_law(joints, equation.numbers(dt), dt)
    if joints.offset is not None:
        weight = weight - joints.pushed(*joints.bonded(joints.offset))
    if joints.slides:
        return Gaps(rows, shear[:0], weight, law._replace(chain=_chain(equation, law, rows, dt)))
    return Gaps(rows, shear, weight, law)


def _chain(equation: Equation, law: PathLaw, rows: sparse.csr_matrix, dt: float) -> Chain:
    """The joints as those of a chain, damping on what they have if closed with them."""
    model, damping, numbers = equation.model, equation.damping, equation.numbers(dt)
    follows = damping is None or damping.joints == "closed"
    held = 1.0 + (0.0 if damping is None or follows else numbers.rate * damping.stiffness)
    blocks = trimmed(numbers.inertia * model.mass + held * model.blocks)
    (pairs, values), size = pairs_of(law), rows.shape[0]
    share = held if damping is not None and damping.joints == "initial" else 1.0
    rates = sparse.csr_matrix((share * values, pairs.T), (size, size))
    return chain_of(trimmed(rows), blocks, rates, (len(law.stretches), len(law.stiffness)))


def solve(system: Any, vector: Any, gap: Any, before: Any, force: Any) -> Any:
    """Solve a step: from its right side to the contact, in place; leaves the gaps there and λ.

    To be overloaded for the type of a system.

    Args:
        system: of a strategy, with a field `linear`.
        vector: right side, then w (n,).
        gap: openings that the law sees, at the start of the step, then at w (p,) [m].
        before: those a step earlier (p,) [m], for the strategy to keep.
        force: λ at the start of the step, then at w (p,) [N].

    Returns:
        Passes over the joints; -1 if they do not settle.
    """
    raise NotImplementedError


def law_type(system: types.Type) -> types.Type | None:
    """Return the type of the law of a system, or None where it has no field `linear`.

    Args:
        system: as numba types it.
    """
    if not isinstance(system, types.NamedTuple) or "linear" not in system.fields:
        return None
    linear = system.types[system.fields.index("linear")]
    law: types.Type = linear.types[linear.fields.index("law")]
    return law


@overload(begin)
def _begin(system, state, memory):  # type: ignore
    return _started if is_of(law_type(system), Law) else None


@overload(settle)
def _settle(system, kept, step, states, ground):  # type: ignore
    return _settled if law_type(system) else None


@overload(measure)
def _measure(system, kept, step, states, ground, results, memory):  # type: ignore
    return _measured if is_of(law_type(system), Law) else None


def _started(system, state, memory):  # type: ignore
    """Images of a state under M, K and R, its gaps and what the joints do there."""
    linear, size, points = system.linear, state.shape[1], len(system.linear.law.stiffness)
    gaps, gap, force = np.zeros((2, 5, points)), np.empty(points), np.empty(points)
    for k in range(3):
        times(linear.opening, state[k], gaps[0, k])
    mix(gap, gaps[0], (1.0, linear.numbers.lag, 0.0))
    pulls(gap, linear.law, force)
    _late(gaps[0], linear.numbers.lag, linear.law)
    images = images_of(linear, state)
    return Kept(images, gaps, gap, gap.copy(), force, np.empty(size), np.empty(size))


@numba.njit(cache=True)
def images_of(linear, state):  # type: ignore
    """Return images of a state under M, K and R, as the first of two ends of a step (2, 3, 3, n).

    Args:
        linear: `Linear`.
        state: u, v and a (3, n).
    """
    images = np.zeros((2, 3, 3, state.shape[1]))
    for k in range(3):
        times(linear.mass, state[k], images[0, 0, k])
        times(linear.closed, state[k], images[0, 1, k])
        if stored(linear.rest) > 0:
            times(linear.rest, state[k], images[0, 2, k])
    return images


def _settled(system, kept, step, states, ground):  # type: ignore
    """Take a step, and let the images follow."""
    linear, right, contact = system.linear, kept.right, kept.contact
    old, new = kept.images[step % 2], kept.images[(step + 1) % 2]
    _add_load(right, ground, linear.weight, linear.body)
    add_mixed(right, old[0], linear.numbers.pushed)
    if stored(linear.rest) > 0:
        add_mixed(right, old[2], linear.numbers.dragged)
    add_held(linear.law, linear.opening, right)
    contact[:] = right
    passes = solve(system, contact, kept.gap, kept.before, kept.force)
    if passes > 0:
        add_rows(linear.opening, range(len(kept.force)), kept.force, right)
        _follow_images(contact, right, (old, new), linear)
        follow(contact, states[0], states[1], linear.numbers)
    return passes


def _measured(system, kept, step, states, ground, results, memory):  # type: ignore
    """Resultants and energies at the end of a step."""
    resultants, energy = results
    linear, numbers = system.linear, system.linear.numbers
    gap, contact = kept.gap, kept.contact
    turn, next_turn = step % 2, (step + 1) % 2
    old, new = kept.gaps[turn], kept.gaps[next_turn]
    follow(gap, old, new, numbers)
    _late(new, numbers.lag, linear.law)
    if numbers.share != 1.0:
        mix(gap, new, (1.0, numbers.lag, 0.0))
        mix(contact, states[1], (1.0, numbers.lag, 0.0))
        pulls(gap, linear.law, kept.force)
    shear = np.empty(len(resultants))
    times(linear.shear, contact, shear)
    joint_resultants(resultants, gap, shear, linear.law)
    images, forces = (kept.images[turn], kept.images[next_turn]), (linear.weight, linear.body)
    closed_energies(states, images, forces, ground, (numbers.drag, numbers.lag), energy)
    _joint_energies(old, new, energy)


@numba.njit(cache=True)
def _add_load(result, ground, weight, body):  # type: ignore
    """Forces of gravity and of the ground."""
    across, up = body[0], body[1]
    x, y = ground[0], ground[1]
    for k in range(len(result)):
        result[k] = weight[k] - x * across[k] - y * up[k]


@numba.njit(cache=True)
def _follow_images(contact, right, images, linear):  # type: ignore
    """Images of the state under M, K and R after a step; overwrites its right side."""
    (old, new), numbers = images, linear.numbers
    image = np.empty(len(contact))
    times(linear.mass, contact, image)
    follow(image, old[0], new[0], numbers)
    for k in range(len(right)):
        right[k] -= numbers.inertia * image[k]
    if stored(linear.rest) > 0:
        times(linear.rest, contact, image)
        follow(image, old[2], new[2], numbers)
        for k in range(len(right)):
            right[k] -= numbers.rate * image[k]
    follow(right, old[1], new[1], numbers)


@numba.njit(cache=True)
def _late(gaps, lag, law):  # type: ignore
    """Tension taken out at the gaps as they are, and how much more where the law sees them."""
    pulls(gaps[0], law, gaps[3])
    if lag > 0.0:
        seen, stays, late = np.empty(gaps.shape[1]), gaps[3], gaps[4]
        mix(seen, gaps, (1.0, lag, 0.0))
        pulls(seen, law, late)
        for row in range(len(late)):
            late[row] -= stays[row]


@numba.njit(cache=True, fastmath={"contract", "reassoc"})
def closed_energies(states, images, forces, ground, damping, energy):  # type: ignore
    """Energies of a step as if all joints were closed and held tension."""
    (old, new), (weight, body), (drag, lag) = images, forces, damping
    across, up = body[0], body[1]
    before, u, v = states[0, 0], states[1, 0], states[1, 1]
    inertia, late, rate = (old[0, 1], new[0, 1]), (old[1, 1], new[1, 1]), (old[2, 1], new[2, 1])
    elastic = new[1, 0]
    kinetic, potential, work, lost = 0.0, 0.0, 0.0, 0.0
    for k in range(len(u)):
        moved = u[k] - before[k]
        kinetic += 0.5 * v[k] * inertia[1][k]
        potential += u[k] * (0.5 * elastic[k] - weight[k])
        work -= moved * (ground[0] * across[k] + ground[1] * up[k])
        held = drag * (inertia[0][k] + inertia[1][k]) + lag * (late[0][k] + late[1][k])
        lost += 0.5 * moved * (held + rate[0][k] + rate[1][k])
    energy[0], energy[1], energy[2], energy[3] = kinetic, potential, work, lost


@numba.njit(cache=True)
def _joint_energies(old, new, energy):  # type: ignore
    """Take off what open joints do not store or damp."""
    for row in range(old.shape[1]):
        energy[1] -= 0.5 * new[0, row] * new[3, row]
        energy[3] -= 0.5 * (new[0, row] - old[0, row]) * (old[4, row] + new[4, row])
