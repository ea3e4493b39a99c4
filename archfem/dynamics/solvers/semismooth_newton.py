"""Semismooth Newton iterations of one step, with a line search along each correction.

But for friction the residual is the negative gradient of an energy, which is least along a
correction where the residual does no work. The norm of the residual tells nothing between stiff
joints that open or close on the way.
"""

from typing import Any, NamedTuple

import numpy as np

from archfem._numba import inlined_kernel, summing_kernel
from archfem._typing import Array

# Shares of a correction that a line search tries, at most
MAX_SEARCH_EVALUATIONS = 14


class Tolerances(NamedTuple):
    """When iterations end."""

    residual: float  # largest residual [N]
    stalled: float  # the same where it does not fall any more, by rounding [N]
    round_off: float  # correction that changes nothing [m]
    rounded: float  # largest residual after such a correction [N]
    reduction: float  # of the residual in an iteration, to which the last factor serves again [-]


class StepWorkspace(NamedTuple):
    """Vectors of a step with large displacements, each (n,)."""

    before: Array  # coordinates at its start
    after: Array  # and at its end, as tried
    move: Array  # Δq
    correction: Array  # of Δq
    residual: Array  # forces out of balance
    constant: Array  # forces that do not depend on the end of the step


class Correction(NamedTuple):
    """Compiled functions of a kind of structure, for the corrections of an iteration."""

    find: Any  # finds the correction
    add: Any  # goes from one share of it to another; returns its largest entry
    work: Any  # work of the residual along it
    reverse: Any  # turns it around


@inlined_kernel
def add_share(system, work, before, share):  # type: ignore
    """Go from a share of the correction to another; returns the largest entry of all of it."""
    move, correction, largest, added = work.move, work.correction, 0.0, share - before
    for k in range(len(system.weight)):  # vectors of chains are longer
        move[k] += added * correction[k]
        if not abs(correction[k]) <= largest:  # also where it is not a number
            largest = abs(correction[k])
    return largest


@summing_kernel
def residual_work(system, work):  # type: ignore
    """Return the work of the residual along the correction."""
    total = 0.0
    for k in range(len(system.weight)):
        total += work.correction[k] * work.residual[k]
    return total


@inlined_kernel
def reverse_correction(system, work):  # type: ignore
    """Turn the correction around."""
    for k in range(len(system.weight)):
        work.correction[k] = -work.correction[k]


@inlined_kernel
def end_step(work, dt, old, new):  # type: ignore
    """Fill the state at the end of a step (3, n) by the midpoint rule from its change Δq."""
    for k in range(new.shape[1]):
        new[0, k] = work.after[k]
        new[1, k] = (2.0 / dt) * work.move[k] - old[1, k]
        new[2, k] = (new[1, k] - old[1, k]) / dt


def line_search(evaluate_residual: Any, correction: Correction) -> Any:
    """Return the compiled search along a correction."""
    _, add, work_along, reverse = correction

    @inlined_kernel
    def search_line(system, work, iteration, before, whole):  # type: ignore
        """Add the correction, or unless `whole` the share at which the residual does no work."""
        start, share, evaluations = work_along(system, work), 1.0, 0
        if start < 0.0 and not whole:  # uphill, by friction: the other way leads down
            reverse(system, work)
            start = -start
        # shares on either side of the place, and the work there
        low, high, low_work, high_work = 0.0, np.inf, start, 0.0
        largest = add(system, work, 0.0, share)
        while True:
            found = evaluate_residual(system, work, iteration)
            evaluations += 1
            left = work_along(system, work)
            # as good as any share: the whole correction, where it takes off half the residual
            is_good = evaluations == 1 and found[0] < 0.5 * before
            if whole or is_good or not abs(left) > 0.5 * start:
                break
            if evaluations == MAX_SEARCH_EVALUATIONS:
                break
            if left > 0.0:
                # short of the place: go on where a longer way is worth it
                if high == np.inf and share >= 4.0:
                    break
                low, low_work, following = share, left, 2.0 * share
            else:
                high, high_work = share, left
            if high < np.inf:  # by the secant, and a tenth of the interval at least
                following = low + (high - low) * low_work / (low_work - high_work)
                margin = 0.1 * (high - low)
                following = min(max(following, low + margin), high - margin)
            add(system, work, share, following)
            share = following
        return found, largest * share, evaluations

    return search_line


def newton_driver(evaluate_residual: Any, correction: Correction) -> Any:
    """Return the compiled driver of iterations for small or for large displacements."""
    find_correction, search_line = correction.find, line_search(evaluate_residual, correction)

    @inlined_kernel
    def newton_solve(system, work, tolerances, limits):  # type: ignore
        """Iterate until the residual vanishes; returns evaluations, negative if it does not.

        A point that the first correction takes from sliding one way to sliding the other is held in
        the second: no derivative sees the range in which it sticks. `limits` are the number of
        iterations; that of the first ones with whole corrections, after which a line search is
        used; and whether the first may use an earlier step's factor.
        """
        max_iterations, full_steps, reusable = limits
        error, reverses = evaluate_residual(system, work, 0)
        previous, change, evaluations = np.inf, np.inf, 0
        for iteration in range(max_iterations):
            stalled = error >= previous and error <= tolerances.stalled
            rounded = change <= tolerances.round_off and error <= tolerances.rounded
            if iteration > 0 and (error <= tolerances.residual or stalled or rounded):
                return evaluations
            # a factor serves again if one more step by it should suffice, or while it reduces the
            # residual by more than a new factor is worth
            hold = iteration == 1 and reverses
            suffices = error**2 <= previous * tolerances.residual
            reuse = suffices or error <= tolerances.reduction * previous
            reuse = reuse and reusable and not hold
            if evaluations > 5 * max_iterations or not find_correction(
                system, work, iteration, reuse, hold
            ):
                return -evaluations - 1
            whole, reusable, previous = hold or iteration < full_steps, not hold, error
            found, change, tried = search_line(system, work, iteration + 1, error, whole)
            error, reverses = found
            evaluations += tried
            if not error < np.inf:
                return -evaluations
        return -evaluations

    return newton_solve
