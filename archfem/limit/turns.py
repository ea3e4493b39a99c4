"""Turns of the search for states without dilatancy: a mechanism for forces, forces for a mechanism.

The gap of `sliding` is bilinear in forces and mechanism: each turn makes it smaller in the one and
then in the other, until it is none or falls no more. Where it falls no more the slips of the
mechanism are changed at random and the turns go on; to go down from a solution, forces are held to
an objective that is a little worse than its own. The gap itself is always that of the whole
programme, so that what is found is a solution whatever led there.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from archfem.arrays import Array
from archfem.errors import DidNotConverge
from archfem.limit.programme import Limits, Optimum, Programme, friction_limits

ROUNDS = 30
"""Turns of forces and mechanism from one start; most end within three."""

PREFERRED = 1e-4
"""Share of the objective by which, among states of one gap, the weakest is taken."""

ROOM = 1e-8
"""Resistance added to c A + μ N, lest round-off make the programme infeasible [block weights]."""

CLOSED = 1e-7
"""Gap, relative to the objective, that counts as none: programmes are solved to 1e-9."""

WEAKER = 1e-3
"""Share by which the next solution must be weaker."""


@dataclass(frozen=True, eq=False)
class Turn:
    """Forces, the mechanism that they were found for, and how far they are from a solution.

    Attributes:
        state: the forces and their objective, with the mechanism as its coordinates.
        gap: of the two [units of the objective].
        solved: whether that counts as none.
    """

    state: Optimum
    gap: float
    solved: bool


def solution(programme: Programme, forces: Array) -> Turn | None:
    """Return a solution without dilatancy near given forces, or None.

    Args:
        programme: with Coulomb's limits.
        forces: at the joints (3 n_joints,) [mean block weights].
    """
    least = np.inf
    for _ in range(ROUNDS):
        turn = _turned(programme, programme, forces, 1.0)
        if turn is None or turn.solved:
            return turn
        if turn.gap > (1.0 - CLOSED) * least:
            return None
        least, forces = turn.gap, turn.state.forces
    return None


def weaker(
    programme: Programme, begin: Turn | None, forces: Array, patience: int
) -> Iterator[Turn]:
    """Go down from solution to solution without dilatancy, each weaker than the one before.

    Args:
        programme: with Coulomb's limits.
        begin: a solution; None where none is known.
        forces: from which to begin where none is (3 n_joints,) [mean block weights].
        patience: turns without a weaker solution after which it ends.

    Yields:
        Solutions.
    """
    chance, waited, kick, least = np.random.default_rng(1), 0, begin is not None, np.inf
    held = programme
    if begin is not None:
        held, forces = _below(programme, begin.state.value), begin.state.forces
    while waited < patience:
        factor = chance.lognormal(size=len(forces) // 3) if kick else 1.0
        turn = _turned(programme, held, forces, factor)
        if turn is None:
            return
        if turn.solved:
            yield turn
            held, waited = _below(programme, turn.state.value), 0
        kick = turn.solved or turn.gap > (1.0 - CLOSED) * least
        least, forces = np.inf if kick else turn.gap, turn.state.forces
        waited += 1


def _turned(
    programme: Programme, held: Programme, forces: Array, factor: Array | float
) -> Turn | None:
    """The mechanism for forces, and the forces of `held` for it, its slips times a factor."""
    resisted = resistance(programme, thrust(forces)) + ROOM
    try:
        mechanism = replace(programme, limits=fixed(programme, resisted)).solve()
        if mechanism is None:
            return None
        slipped = slips(programme, mechanism.coordinates)
        state = _weakest(held, factor * slipped)
    except DidNotConverge:  # round-off left no state
        return None
    if state is None:
        return None
    value = programme.objective(state)
    lost = float((resistance(programme, thrust(state.forces)) - resisted) @ slipped)
    gap = value + lost - mechanism.value
    least = CLOSED * max(abs(value), abs(mechanism.value)) + ROOM * float(slipped.sum())
    found = Optimum(value, state.forces, mechanism.coordinates, state.unknowns)
    return Turn(found, gap, gap <= least)


def _weakest(programme: Programme, slipped: Array) -> Optimum | None:
    """Forces of least gap to a mechanism of given slips, and of these the weakest."""
    rubbed = friction(programme) * slipped
    cost = np.concatenate([rubbed, rubbed, np.zeros(len(rubbed))])
    if programme.cost is not None:
        cost += (1.0 - PREFERRED) * programme.cost
    return replace(programme, cost=cost, prices=(1.0 - PREFERRED) * programme.prices).solve()


def _below(programme: Programme, value: float) -> Programme:
    """The programme held to objectives above a value, as weaker states have them."""
    least = value + WEAKER * abs(value)
    if programme.cost is None:  # the first unknown is the factor, at a price of -1
        return replace(programme, most=np.concatenate([[max(-least, 0.0)], programme.most[1:]]))
    row = Limits(sparse.csr_matrix(-programme.cost[None, :]), np.array([-least]))
    return replace(programme, limits=programme.limits.joined(row))


def friction(programme: Programme) -> Array:
    """Return Coulomb's μ, zero where a joint never slides and nothing is dissipated (n_joints,).

    Args:
        programme: of the structure.
    """
    coefficient = programme.blocks.structure.friction
    return np.where(np.isfinite(coefficient), coefficient, 0.0)


def resistance(programme: Programme, thrusts: Array) -> Array:
    """Return the shear c A + μ N at which joints slide (n_joints,) [block weights].

    Args:
        programme: of the structure.
        thrusts: N (n_joints,) [block weights].
    """
    resisted: Array = programme.blocks.cohesion + friction(programme) * thrusts
    return resisted


def fixed(programme: Programme, resisted: Array) -> Limits:
    """Return limits |V| <= R that do not depend on N, none where a joint never slides.

    Args:
        programme: of the structure.
        resisted: R (n_joints,) [block weights].
    """
    slides = np.isfinite(programme.blocks.structure.friction)
    return friction_limits(np.where(slides, 0.0, np.inf), resisted)


def gaps(programme: Programme, coordinates: Array) -> Array:
    """Return openings of both ends and slips of a mechanism, with those of a moving support.

    Args:
        programme: of the structure.
        coordinates: multipliers of its balance (3 n_free,).

    Returns:
        Intrados ends of all joints, then extrados ends, then slips (3 n_joints,).
    """
    found: Array = -(programme.blocks.balance.T @ coordinates)
    return found if programme.cost is None else found + programme.cost


def slips(programme: Programme, coordinates: Array) -> Array:
    """Return the sizes of the slips of a mechanism (n_joints,).

    Args:
        programme: of the structure.
        coordinates: multipliers of its balance (3 n_free,).
    """
    found: Array = np.abs(gaps(programme, coordinates).reshape(3, -1)[2])
    return found


def thrust(forces: Array) -> Array:
    """Return the normal force of each joint (n_joints,) [block weights].

    Args:
        forces: F_i of all joints, then F_e, then V (3 n_joints,) [block weights].
    """
    found: Array = forces.reshape(3, -1)[:2].sum(axis=0)
    return found
