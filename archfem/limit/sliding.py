"""Sliding without dilatancy in limit analysis: the iteration of Gilbert and others (2006)."""

from dataclasses import replace

import numpy as np

from archfem.arrays import Array
from archfem.errors import DidNotConverge
from archfem.limit.programme import Optimum, Programme, friction_limits

RATE = 1e-5
"""Relative change of the objective, and excess of |V| over μ N, at which the iteration ends."""

ROUNDS = 200

START, FALL, END = 0.3, 0.6, 1e-3
"""Dilatancy as a share of μ: in the first step, its fall from step to step, the least."""

FRESH, STEADY = 0.6, 30
"""Share of the newest N in the running mean; after so many steps it falls, to damp any cycle."""


def without_dilatancy(programme: Programme, start: Optimum) -> Optimum:
    """Find a state in which joints slide along themselves, without opening.

    Coulomb's limit |V| <= μ N makes the linear programme slide at the angle of friction. Each
    step replaces it, about the normal force N_k of the steps before, by a flatter one that meets
    it at N_k, with a dilatancy α μ that falls from step to step:

        |V| <= (1 - α) μ N_k + α μ N.

    Where the steps no longer change N, the state obeys Coulomb's limit and hardly dilates.

    Args:
        programme: its limits are replaced.
        start: its optimum with associated sliding.

    Returns:
        The last optimum, whose motion dilates by at most 1e-3 μ per slip.

    Raises:
        DidNotConverge: the objective or N still change.

    References:
        Gilbert, Casapulla and Ahmed, Computers & Structures 84 (2006) 873-887.
    """
    friction = programme.blocks.structure.friction
    mean, old = _thrust(start), start
    for step in range(ROUNDS):
        share = max(START * FALL**step, END)
        limits = friction_limits(share * friction, (1.0 - share) * friction * mean)
        new = replace(programme, limits=limits).solve()
        if new is None:
            raise DidNotConverge(
                "sliding without dilatancy finds no limit although associated sliding has one: "
                "forbid sliding with friction=None, or keep 'coulomb'"
            )
        settled = abs(new.value - old.value) <= RATE * abs(new.value)
        if share == END and settled and _excess(new, friction) <= RATE:
            return new
        fresh = FRESH * min(1.0, STEADY / (step + 1))
        mean, old = fresh * _thrust(new) + (1.0 - fresh) * mean, new
    raise DidNotConverge(
        f"sliding without dilatancy did not settle in {ROUNDS} steps: its last objective is "
        f"{old.value:.5g}, with |V| up to {_excess(old, friction):.2g} of the greatest N over μ N"
    )


def _thrust(state: Optimum) -> Array:
    """Normal force of each joint (n_joints,) [block weights]."""
    thrust: Array = state.forces.reshape(3, -1)[:2].sum(axis=0)
    return thrust


def _excess(state: Optimum, friction: Array) -> float:
    """Largest |V| - μ N, relative to the largest N."""
    thrust, shear = _thrust(state), np.abs(state.forces.reshape(3, -1)[2])
    return float(np.max(shear - friction * thrust) / max(thrust.max(), 1.0))
