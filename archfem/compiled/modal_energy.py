"""The energy balance of steps that `kernel` took, compiled: as by `energy.Meter`, but in modes."""

import numba
import numpy as np

from archfem.compiled.kernel import integrals, open_part


@numba.njit(cache=True)
def energies(series, gaps, loads, opening, numbers, law):  # type: ignore
    """Energies of steps that `advance` took, as by `energy.Meter.step`.

    Args:
        series: η and its velocity (steps + 1, 3, n).
        gaps: openings that the law sees (steps + 1, p).
        loads: modal weight (n,) and mean modal force of the ground over each step (steps, n).
        opening: B (p, n).
        numbers: `Coefficients`.
        law: as for `advance`.

    Returns:
        Kinetic and potential energy at the ends of the steps, and over them the work of the ground
        and what is lost (steps, 4) [J].
    """
    weight, ground = loads
    result = np.zeros((len(ground), 4))
    place = gaps
    if numbers.lag > 0.0:
        place = np.ascontiguousarray(series[:, 0]) @ opening.T
    pull, extra = np.zeros(gaps.shape[1]), np.zeros((2, gaps.shape[1]))
    for step in range(len(ground) + 1):
        _pull(place[step], law, pull)
        old, new = extra[(step + 1) % 2], extra[step % 2]
        if numbers.lag > 0.0:
            _pull(gaps[step], law, new)
            new -= pull
        if step > 0:
            row = result[step - 1]
            _modal_energies(series[step - 1], series[step], weight, ground[step - 1], numbers, row)
            for k in range(len(pull)):
                moved = place[step, k] - place[step - 1, k]
                row[1] -= 0.5 * place[step, k] * pull[k]
                row[3] -= 0.5 * moved * (old[k] + new[k])
    return result


@numba.njit(cache=True)
def _modal_energies(before, after, weight, ground, numbers, row):  # type: ignore
    """Energies of one step as if all joints were closed and held tension."""
    for k in range(len(weight)):
        q, v = after[0, k], after[1, k]
        moved = q - before[0, k]
        row[0] += 0.5 * v * v
        row[1] += (0.5 * numbers.squares[k] * q - weight[k]) * q
        row[2] += ground[k] * moved
        row[3] += 0.5 * numbers.rates[k] * moved * (v + before[1, k])


@numba.njit(cache=True)
def _pull(gap, law, force):  # type: ignore
    """λ = J(z) z: the tension that the closed stiffness would hold where the joint is open."""
    facets, stiffness = law[0], law[1]
    for row in range(len(gap)):
        if not facets:
            force[row] = stiffness[row] * max(gap[row], 0.0)
        elif gap[row] > 0.0 or gap[row ^ 1] > 0.0:
            low, high = open_part(gap[row], gap[row ^ 1])
            first, mixed, _ = integrals(low, high)
            force[row] = stiffness[row] * (first * gap[row] + mixed * gap[row ^ 1])
        else:
            force[row] = 0.0
