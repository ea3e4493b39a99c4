"""Newmark's formulas, compiled: for the state of a step and for whatever is linear in it.

Let w = u + β v be the contact where the equation of a step is written. From w and the state before
(u, v, a) follows the one after. The same holds of the images of all of these under a matrix L: from
L w and L u, L v, L a before follow those after, without a product. So one product with M a step
gives all inertia forces, and forces of closed joints and gaps, whose L w is known, are had for
nothing.
"""

from typing import NamedTuple

import numba
import numpy as np

from archfem.arrays import Array


class Numbers(NamedTuple):
    """Numbers of a time step; three of them are factors of u, v and a before it.

    Attributes:
        share: where the equation is written, 1 + α.
        lag: of the contact behind the displacement [s].
        drag: coefficient of damping by mass [1/s].
        gain: change of displacement per change of contact.
        inertia: μ, change of acceleration and drag per change of contact [1/s²].
        rate: ν, change of velocity where the equation is written per change of contact [1/s].
        base: contact if u does not change (3,).
        pushed: y of which M y is what inertia and drag leave on the right side (3,).
        dragged: x of which C x is what damping leaves there (3,).
        velocity: after the step if u does not change (3,), and its change per change of u [1/s].
        acceleration: likewise (3,), [1/s²].
    """

    share: float
    lag: float
    drag: float
    gain: float
    inertia: float
    rate: float
    base: Array
    pushed: Array
    dragged: Array
    velocity: tuple[Array, float]
    acceleration: tuple[Array, float]


def numbers_of(dt: float, scheme: tuple[float, float, float], lag: float, drag: float) -> Numbers:
    """Return the numbers of a time step.

    Args:
        dt: its length [s].
        scheme: β, γ and α of Newmark's method or HHT [-].
        lag: β of damping that follows the joints [s].
        drag: coefficient of damping by mass [1/s].
    """
    beta, gamma, alpha = scheme
    share, to_velocity, to_acceleration = 1.0 + alpha, gamma / (beta * dt), 1.0 / (beta * dt**2)
    velocity = np.array([0.0, 1.0 - gamma / beta, dt * (1.0 - 0.5 * gamma / beta)])
    acceleration = np.array([0.0, -1.0 / (beta * dt), 1.0 - 0.5 / beta])
    between = (1.0 - share) * np.array([0.0, 1.0, 0.0]) + share * velocity
    base = np.array([1.0, 0.0, 0.0]) + lag * between
    gain = 1.0 / (share * (1.0 + lag * to_velocity))
    inertia = gain * (to_acceleration + drag * share * to_velocity)
    rate = gain * share * to_velocity
    return Numbers(
        share,
        lag,
        drag,
        gain,
        inertia,
        rate,
        base,
        inertia * base - acceleration - drag * between,
        rate * base - between,
        (velocity, to_velocity),
        (acceleration, to_acceleration),
    )


@numba.njit(cache=True, fastmath={"contract"})
def follow(image, before, after, numbers):  # type: ignore
    """Images of u, v and a after a step.

    Args:
        image: of w (n,).
        before: images before the step (3, n).
        after: filled (3, n).
        numbers: `Numbers`.
    """
    u, v, a = before[0], before[1], before[2]
    new_u, new_v, new_a = after[0], after[1], after[2]
    base, gain = numbers.base, numbers.gain
    p, q = base[1], base[2]
    (velocity, to_velocity), (acceleration, to_acceleration) = (
        numbers.velocity,
        numbers.acceleration,
    )
    r, s, t, z = velocity[1], velocity[2], acceleration[1], acceleration[2]
    for k in range(len(image)):
        change = gain * (image[k] - u[k] - p * v[k] - q * a[k])
        new_u[k] = u[k] + change
        new_v[k] = to_velocity * change + r * v[k] + s * a[k]
        new_a[k] = to_acceleration * change + t * v[k] + z * a[k]


@numba.njit(cache=True, fastmath={"contract"})
def add_mixed(result, images, factors):  # type: ignore
    """Add the images of u, v and a, each times its factor.

    Args:
        result: to which they are added (n,).
        images: of u, v and a (3, n).
        factors: of them (3,).
    """
    u, v, a = images[0], images[1], images[2]
    p, q, r = factors[0], factors[1], factors[2]
    for k in range(len(result)):
        result[k] += p * u[k] + q * v[k] + r * a[k]


@numba.njit(cache=True)
def mix(result, images, factors):  # type: ignore
    """Sum up the images of u, v and a, each times its factor.

    Args:
        result: filled (n,).
        images: of u, v and a (3, n).
        factors: of them (3,).
    """
    result[:] = 0.0
    add_mixed(result, images, factors)
