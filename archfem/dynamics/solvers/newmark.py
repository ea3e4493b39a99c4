"""Formulas of Newmark's method, HHT-α and the midpoint rule, compiled.

Let w = u + β v be the contact displacement where the equation of a step is written. The state after
the step follows from w and the state (u, v, a) before it. Images under a matrix L follow likewise:
from L w and L u, L v, L a before the step follow those after it, without a further product. So a
step needs one product with M; forces of closed joints come from the balance of the step.
"""

from typing import NamedTuple

import numpy as np

from archfem._numba import summing_kernel
from archfem._typing import Array

Factors = tuple[float, float, float]


class StepNumbers(NamedTuple):
    """Coefficients of a time step; vectors (3,) are factors of u, v and a before it."""

    share: float  # where the equation is written, 1 + α [-]
    lag: float  # β of damping that follows the joints [s]
    drag: float  # coefficient of mass-proportional damping [1/s]
    gain: float  # change of u per change of w [-]
    inertia: float  # μ, change of acceleration and drag per change of w [1/s²]
    rate: float  # ν, change of the velocity in the equation per change of w [1/s]
    base: Factors  # w if u does not change (3,)
    inertia_load: Factors  # y, where M y is the load of inertia and drag from before (3,)
    damping_load: Factors  # x, where R x is the load of damping from before (3,)
    velocity: tuple[Factors, float]  # v after it if u does not change, and its change per u [1/s]
    acceleration: tuple[Factors, float]  # likewise a [1/s²]


def step_numbers(
    dt: float, scheme: tuple[float, float, float], lag: float, drag: float
) -> StepNumbers:
    """Return the coefficients of a step from Newmark's β and γ, HHT's α, and damping."""
    beta, gamma, alpha = scheme
    share, to_velocity, to_acceleration = 1.0 + alpha, gamma / (beta * dt), 1.0 / (beta * dt**2)
    # Newmark's formulas solved for the velocity and acceleration at the end
    velocity = np.array([0.0, 1.0 - gamma / beta, dt * (1.0 - 0.5 * gamma / beta)])
    acceleration = np.array([0.0, -1.0 / (beta * dt), 1.0 - 0.5 / beta])
    # HHT writes velocity and displacement between the ends of the step
    between = (1.0 - share) * np.array([0.0, 1.0, 0.0]) + share * velocity
    base = np.array([1.0, 0.0, 0.0]) + lag * between
    gain = 1.0 / (share * (1.0 + lag * to_velocity))
    inertia = gain * (to_acceleration + drag * share * to_velocity)
    rate = gain * share * to_velocity
    return StepNumbers(
        share,
        lag,
        drag,
        gain,
        inertia,
        rate,
        _factors(base),
        _factors(inertia * base - acceleration - drag * between),
        _factors(rate * base - between),
        (_factors(velocity), to_velocity),
        (_factors(acceleration), to_acceleration),
    )


def _factors(values: Array) -> Factors:
    """Return factors of u, v and a as a tuple, which compiled functions take faster."""
    u, v, a = values.tolist()
    return u, v, a


@summing_kernel
def update_images(image, before, after, numbers):  # type: ignore
    """Fill the images of u, v and a after a step (3, n) from that of w (n,) and those before."""
    u, v, a = before[0], before[1], before[2]
    new_u, new_v, new_a = after[0], after[1], after[2]
    p, q, gain = numbers.base[1], numbers.base[2], numbers.gain
    velocity, to_velocity = numbers.velocity
    acceleration, to_acceleration = numbers.acceleration
    r, s, t, z = velocity[1], velocity[2], acceleration[1], acceleration[2]
    for k in range(len(image)):
        # change of u, then Newmark's formulas
        change = gain * (image[k] - u[k] - p * v[k] - q * a[k])
        new_u[k] = u[k] + change
        new_v[k] = to_velocity * change + r * v[k] + s * a[k]
        new_a[k] = to_acceleration * change + t * v[k] + z * a[k]


@summing_kernel
def add_combination(result, images, factors):  # type: ignore
    """Add the images of u, v and a (3, n), each times its factor."""
    u, v, a = images[0], images[1], images[2]
    p, q, r = factors[0], factors[1], factors[2]
    for k in range(len(result)):
        result[k] += p * u[k] + q * v[k] + r * a[k]
