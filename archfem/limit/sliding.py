"""Sliding without dilatancy in limit analysis: states of equilibrium that slide without opening.

Let φ(R) be the optimum of the linear programme whose joints carry |V| <= R. A state with normal
forces N is a solution without dilatancy where it is itself an optimum for R = c A + μ N: its
mechanism slides where |V| = R, opens only ends that carry nothing, and dissipates R |slip|. With y
the mechanism that is dual to φ, and t(y) its slips, the gap

    value(x) + [c A + μ N(x)]·t(y) - [φ(R) + R·t(y)]  >=  0

is zero for such a pair, and is linear in the forces x for a given mechanism and in the mechanism
for given forces: a bilinear programme over two separate polyhedra, searched from many starts by
solving for one and the other in turn.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from archfem.arrays import Array
from archfem.errors import DidNotConverge
from archfem.limit.programme import Limits, Optimum, Programme, friction_limits

STARTS = 40
"""States from which the search starts, besides the associated one; fewer for many joints."""

JOINTS = 150
"""Joints up to which every start is tried, and normal forces are bounded one by one."""

ROUNDS = 30
"""Turns of forces and mechanism from one start; most end within three."""

PREFERRED = 1e-4
"""Share of the objective by which, among states of one gap, the weakest is taken."""

ROOM = 1e-8
"""Resistance added to c A + μ N, lest round-off make the programme infeasible [block weights]."""

CLOSED = 1e-7
"""Gap, relative to the objective, that counts as none: programmes are solved to 1e-9."""


@dataclass(frozen=True)
class WithoutDilatancy:
    """What is known of the solutions without dilatancy, which need not be unique.

    Attributes:
        bracket: factors between which every solution lies: for a load that grows, a proven lower
            bound and the associated factor.
        between: factors of the weakest and the strongest solution found; undefined (NaN) where
            none was.
        starts: from how many states the search started, and how many of them it led to a
            solution.
        unbalanced: largest residual of the balance of the solution returned [mean block weights].
        excess: largest |V| - c A - μ N, relative to the largest N.
        opening: largest opening of an end that carries force, relative to the largest gap;
            undefined (NaN) with a strength, at which ends that carry force give way.
        gap: complementarity left: by how much friction dissipates more than loads do work,
            relative to the objective.
    """

    bracket: tuple[float, float]
    between: tuple[float, float]
    starts: tuple[int, int]
    unbalanced: float = np.nan
    excess: float = np.nan
    opening: float = np.nan
    gap: float = np.nan

    def __str__(self) -> str:
        """Where solutions lie, in one line."""
        tried, led = self.starts
        least, most = self.bracket
        if not np.isfinite(least):
            return "without dilatancy it does not either: no factor is too large"
        low, high = self.between
        found = f"found from {low:.4g} to {high:.4g}" if led else "were not found"
        return (
            f"solutions without dilatancy {found} ({led} of {tried} starts); all lie from "
            f"{least:.4g} to {most:.4g}"
        )


def without_dilatancy(
    programme: Programme, start: Optimum | None, scale: float
) -> tuple[Optimum | None, WithoutDilatancy]:
    """Find the weakest state in which joints slide along themselves, without opening.

    Args:
        programme: with Coulomb's limits.
        start: its optimum, with associated sliding; None where it has no limit.
        scale: factor per value of the objective.

    Returns:
        The solution of the largest objective that the search found, which is the least factor of
        a load, or None where there is none; and what is known of all solutions.

    References:
        Drucker, J. Appl. Mech. 21 (1954) 71-74. Ferris and Tin-Loi, Int. J. Mech. Sci. 43 (2001)
        209-224. The gap is a disjoint bilinear programme: Konno, Math. Program. 11 (1976) 14-27.
    """
    starts = _starts(programme, start)
    tried = [_solution(programme, forces) for forces in starts]
    found = [state for state in tried if state is not None]
    thrusts = np.array([_thrust(forces) for forces in starts])
    seen = thrusts.reshape(-1, len(programme.blocks.structure.depths)).min(axis=0, initial=np.inf)
    associated = -np.inf if start is None else start.value
    limits = scale * associated, scale * max(associated, _bound(programme, seen))
    values = [scale * state.value for state, _ in found] or [np.nan]
    known = WithoutDilatancy(
        (min(limits), max(limits)), (min(values), max(values)), (len(starts), len(found))
    )
    if not found:
        return None, known
    weakest, gap = max(found, key=lambda each: each[0].value)
    return weakest, _checked(programme, weakest, gap, known)


def weakest_from(programme: Programme, starts: Sequence[Array]) -> Optimum | None:
    """Return the weakest state without dilatancy that is found from given forces, or None.

    Args:
        programme: with Coulomb's limits.
        starts: forces at the joints (3 n_joints,) each [mean block weights], as solutions under
            loads near by have them.
    """
    found = [state for forces in starts if (state := _solution(programme, forces))]
    return max((state for state, _ in found), key=lambda state: state.value, default=None)


def some_starts(programme: Programme, start: Optimum | None, number: int, seed: int) -> list[Array]:
    """Return forces from which to search: the associated optimum's, and so many by chance.

    Args:
        programme: with Coulomb's limits.
        start: its optimum, with associated sliding; None where it has no limit.
        number: of those by chance; fewer where equilibrium permits none of them.
        seed: of chance.
    """
    tried = _vertices(programme, start, number, np.random.default_rng(seed))
    return tried if start is None else [start.forces, *tried]


def _starts(programme: Programme, start: Optimum | None) -> list[Array]:
    """Forces of the associated optimum, and of vertices of what equilibrium permits."""
    joints = len(programme.blocks.structure.depths)
    number = max(2, STARTS * min(joints, JOINTS) ** 2 // joints**2)
    return some_starts(programme, start, number, 0)


def _vertices(
    programme: Programme, start: Optimum | None, number: int, chance: np.random.Generator
) -> list[Array]:
    """Forces of so many vertices of what equilibrium permits; fewer where there are none."""
    tried = []
    for _ in range(number):
        try:
            state = _vertex(programme, start, chance)
        except DidNotConverge:  # no state of equilibrium under so much load
            continue
        if state is not None:
            tried.append(state.forces)
    return tried


def _vertex(
    programme: Programme, start: Optimum | None, chance: np.random.Generator
) -> Optimum | None:
    """State of least compressions, weighted at random, under a random share of the load."""
    joints = len(programme.blocks.structure.depths)
    cost = np.concatenate([chance.random(2 * joints), np.zeros(joints)])
    if programme.cost is not None:
        size = _largest(programme.cost)
        return replace(programme, cost=cost + chance.uniform(-1, 1) * programme.cost / size).solve()
    assert programme.columns is not None
    live, others = programme.columns[:, :1], programme.columns[:, 1:]
    if start is None:
        column = float(abs(live).sum())
        weight = float(np.abs(programme.load).sum())
        size = 10.0 ** chance.uniform(-1, 1) * weight / column if column > 0.0 else 0.0
    else:
        size = float(chance.random() * start.unknowns[0])
    load = programme.load - live @ np.array([size])
    prices, most = programme.prices[1:], programme.most[1:]
    given = replace(programme, cost=cost, load=load, columns=others, prices=prices, most=most)
    return given.solve()


def _solution(programme: Programme, forces: Array) -> tuple[Optimum, float] | None:
    """State and gap of a solution without dilatancy near given forces, or None."""
    least = np.inf
    for _ in range(ROUNDS):
        held = _resistance(programme, _thrust(forces)) + ROOM
        try:
            mechanism = replace(programme, limits=_fixed(programme, held)).solve()
            if mechanism is None:
                return None
            slips = _slips(programme, mechanism.coordinates)
            state = _weakest(programme, slips)
        except DidNotConverge:  # round-off left no state
            return None
        if state is None:
            return None
        forces = state.forces
        value = programme.objective(state)
        lost = float((_resistance(programme, _thrust(forces)) - held) @ slips)
        gap = value + lost - mechanism.value
        if gap <= CLOSED * max(abs(value), abs(mechanism.value)) + ROOM * float(slips.sum()):
            return Optimum(value, forces, mechanism.coordinates, state.unknowns), gap
        if gap > (1.0 - CLOSED) * least:
            return None
        least = gap
    return None


def _weakest(programme: Programme, slips: Array) -> Optimum | None:
    """Forces of least gap to a mechanism of given slips, and of these the weakest."""
    friction = _friction(programme) * slips
    cost = np.concatenate([friction, friction, np.zeros(len(friction))])
    if programme.cost is not None:
        cost += (1.0 - PREFERRED) * programme.cost
    return replace(programme, cost=cost, prices=(1.0 - PREFERRED) * programme.prices).solve()


def _bound(programme: Programme, seen: Array) -> float:
    """Bound the objective of every solution without dilatancy from above.

    A solution's N is at least the least N of any state of equilibrium, so that a state with |V| <=
    c A + μ min N is admissible in the programme of which the solution is an optimum. In joints of
    which a state was seen that leaves them without N there is nothing to look for.

    Returns:
        The bound; -inf where no solution can exist.
    """
    joints = len(programme.blocks.structure.depths)
    least = np.zeros(joints)
    for joint in np.flatnonzero(seen > ROOM) if joints <= JOINTS else ():
        cost = np.zeros(3 * joints)
        cost[[joint, joints + joint]] = 1.0
        found = _least(replace(programme, cost=cost, prices=np.zeros_like(programme.prices)))
        least[joint] = max(found - ROOM, 0.0)
    negated = None if programme.cost is None else -programme.cost
    highest = -_least(replace(programme, cost=negated, prices=-programme.prices))
    limits = _fixed(programme, _resistance(programme, least))
    try:
        safe = replace(programme, limits=limits).solve()
    except DidNotConverge:  # no equilibrium with so little friction
        return highest
    return -np.inf if safe is None else min(highest, safe.value)


def _least(programme: Programme) -> float:
    """Least objective, or -inf where it is without bound or the solver cannot tell."""
    try:
        found = programme.solve()
    except DidNotConverge:
        return -np.inf
    return -np.inf if found is None else found.value


def _checked(
    programme: Programme, state: Optimum, gap: float, known: WithoutDilatancy
) -> WithoutDilatancy:
    """Add how well a state fulfils what a solution must."""
    thrust, shear = _thrust(state.forces), np.abs(state.forces.reshape(3, -1)[2])
    left = programme.blocks.balance @ state.forces - programme.load
    if programme.columns is not None:
        left = left + programme.columns @ state.unknowns
    gaps = _gaps(programme, state.coordinates)
    carries = state.forces[: 2 * len(thrust)] > CLOSED * max(float(thrust.max()), 1.0)
    slides = np.isfinite(programme.blocks.structure.friction)
    excess = np.max((shear - _resistance(programme, thrust))[slides], initial=0.0)
    opening = np.max(gaps[: len(carries)][carries], initial=0.0)
    if programme.crushing is not None:
        opening = np.nan
    return replace(
        known,
        unbalanced=float(np.abs(left).max()),
        excess=float(excess) / _largest(thrust),
        opening=float(opening) / _largest(gaps),
        gap=max(gap, 0.0) / _largest(np.array([state.value, ROOM])),
    )


def _largest(values: Array) -> float:
    """Largest magnitude, to divide by."""
    return float(np.abs(values).max(initial=np.finfo(float).tiny))


def _friction(programme: Programme) -> Array:
    """Coulomb's μ, zero where a joint never slides and nothing is dissipated (n_joints,)."""
    friction = programme.blocks.structure.friction
    return np.where(np.isfinite(friction), friction, 0.0)


def _resistance(programme: Programme, thrust: Array) -> Array:
    """Shear c A + μ N at which joints slide under given N (n_joints,) [block weights]."""
    resistance: Array = programme.blocks.cohesion + _friction(programme) * thrust
    return resistance


def _fixed(programme: Programme, resistance: Array) -> Limits:
    """Limits |V| <= R that do not depend on N, none where a joint never slides."""
    slides = np.isfinite(programme.blocks.structure.friction)
    return friction_limits(np.where(slides, 0.0, np.inf), resistance)


def _gaps(programme: Programme, coordinates: Array) -> Array:
    """Openings of both ends and slips of a mechanism, with those of a moving support."""
    gaps: Array = -(programme.blocks.balance.T @ coordinates)
    return gaps if programme.cost is None else gaps + programme.cost


def _slips(programme: Programme, coordinates: Array) -> Array:
    """Sizes of the slips of a mechanism (n_joints,)."""
    slips: Array = np.abs(_gaps(programme, coordinates).reshape(3, -1)[2])
    return slips


def _thrust(forces: Array) -> Array:
    """Normal force of each joint (n_joints,) [block weights]."""
    thrust: Array = forces.reshape(3, -1)[:2].sum(axis=0)
    return thrust
