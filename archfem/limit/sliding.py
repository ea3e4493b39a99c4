"""Sliding without dilatancy in limit analysis: states of equilibrium that slide without opening.

Let φ(R) be the optimum of the linear programme whose joints carry |V| <= R. A state with normal
forces N is a solution without dilatancy where it is itself an optimum for R = c A + μ N: its
mechanism slides where |V| = R, opens only ends that carry nothing, and dissipates R |slip|. With y
the mechanism that is dual to φ, and t(y) its slips, the gap

    value(x) + [c A + μ N(x)]·t(y) - [φ(R) + R·t(y)]  >=  0

is zero for such a pair, and is linear in the forces x for a given mechanism and in the mechanism
for given forces: a bilinear programme over two separate polyhedra, searched from many starts by
solving for one and the other in turn, and from the weakest solution downwards.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from archfem.arrays import Array
from archfem.errors import DidNotConverge
from archfem.limit.programme import Optimum, Programme
from archfem.limit.turns import (
    CLOSED,
    ROOM,
    WEAKER,
    Turn,
    fixed,
    gaps,
    resistance,
    solution,
    thrust,
    weaker,
)

STARTS = 40
"""States from which the search starts, besides the associated one; fewer for many joints."""

JOINTS = 150
"""Joints up to which every start is tried, and normal forces are bounded one by one."""

PATIENCE = 30
"""Turns after which no solution weaker than the weakest is looked for any longer."""


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
        found = f"found from {low:.4g} to {high:.4g}" if np.isfinite(low) else "were not found"
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
    tried = [solution(programme, forces) for forces in starts]
    found = [turn for turn in tried if turn is not None]
    thrusts = np.array([thrust(forces) for forces in starts])
    seen = thrusts.reshape(-1, len(programme.blocks.structure.depths)).min(axis=0, initial=np.inf)
    associated = -np.inf if start is None else start.value
    bound = max(associated, _bound(programme, seen))
    limits = scale * associated, scale * bound
    led = len(found)
    first = max(found, key=_value, default=None)
    least = -np.inf if first is None else first.state.value + WEAKER * abs(first.state.value)
    if starts and bound > least:
        found += weaker(programme, first, starts[0], PATIENCE)
    values = [scale * turn.state.value for turn in found] or [np.nan]
    known = WithoutDilatancy(
        (min(limits), max(limits)), (min(values), max(values)), (len(starts), led)
    )
    if not found:
        return None, known
    weakest = max(found, key=_value)
    return weakest.state, _checked(programme, weakest, known)


def _value(turn: Turn) -> float:
    return turn.state.value


def weakest_from(programme: Programme, starts: Sequence[Array]) -> Optimum | None:
    """Return the weakest state without dilatancy that is found from given forces, or None.

    Args:
        programme: with Coulomb's limits.
        starts: forces at the joints (3 n_joints,) each [mean block weights], as solutions under
            loads near by have them.
    """
    found = [turn for forces in starts if (turn := solution(programme, forces))]
    return max((turn.state for turn in found), key=lambda state: state.value, default=None)


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
    limits = fixed(programme, resistance(programme, least))
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


def _checked(programme: Programme, found: Turn, known: WithoutDilatancy) -> WithoutDilatancy:
    """Add how well a state fulfils what a solution must."""
    state = found.state
    normal, shear = thrust(state.forces), np.abs(state.forces.reshape(3, -1)[2])
    left = programme.blocks.balance @ state.forces - programme.load
    if programme.columns is not None:
        left = left + programme.columns @ state.unknowns
    opened = gaps(programme, state.coordinates)
    carries = state.forces[: 2 * len(normal)] > CLOSED * max(float(normal.max()), 1.0)
    slides = np.isfinite(programme.blocks.structure.friction)
    excess = np.max((shear - resistance(programme, normal))[slides], initial=0.0)
    opening = np.max(opened[: len(carries)][carries], initial=0.0)
    if programme.crushing is not None:
        opening = np.nan
    return replace(
        known,
        unbalanced=float(np.abs(left).max()),
        excess=float(excess) / _largest(normal),
        opening=float(opening) / _largest(opened),
        gap=max(found.gap, 0.0) / _largest(np.array([state.value, ROOM])),
    )


def _largest(values: Array) -> float:
    """Largest magnitude, to divide by."""
    return float(np.abs(values).max(initial=np.finfo(float).tiny))
