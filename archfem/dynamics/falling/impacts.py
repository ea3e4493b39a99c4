"""A step of Moreau and Jean's scheme: contacts at half of it, impulses, velocities and poses.

With θ = ½ and H the rows of normal and tangential relative velocity at the contacts found at
q + ½ Δt v,

    M (v₁ - v₀) = Δt p + Hᵀ P,   0 <= u_N1 + e u_N0 ⊥ P_N >= 0,   q₁ = q₀ + ½ Δt (v₀ + v₁),

|P_T| <= μ P_N, and P_T opposes u_T1 where that is not zero (Moreau, in: Nonsmooth Mechanics and
Applications, 1988; Jean, Comput. Methods Appl. Mech. Eng. 177 (1999) 235). Solved by projected
Gauss and Seidel, contact by contact, from the impulses of the step before.
"""

from typing import NamedTuple

import numba
import numpy as np

from archfem.arrays import Array
from archfem.dynamics.falling.carried import Carried, keep, recall
from archfem.dynamics.falling.contact import Contacts, World, find, place

SWEEPS = 500
"""Sweeps over the contacts of a step before its impulses are taken as they are."""

SETTLED = 1e-5
"""Change of an impulse, relative to the largest, below which a sweep is the last."""


class Laws(NamedTuple):
    """What holds at every step.

    Attributes:
        dt: Δt [s].
        gravity: downward [m/s²].
        restitution: e [-].
        slow: speed of approach below which nothing bounces [m/s].
    """

    dt: float
    gravity: float
    restitution: float
    slow: float


class Room(NamedTuple):
    """What steps work with.

    Attributes:
        world: the pieces where they are.
        found: contacts.
        carried: impulses of the step before.
        middle: poses at half of the step (b, 3).
        rows: of each contact, the arms' cross products with normal and tangent, first and second
            body, 1/(H M⁻¹ Hᵀ) of normal and tangent, wanted u_N and u_T, and μ (c, 9).
        moving: velocities, the ground's last (b + 1, 3).
    """

    world: World
    found: Contacts
    carried: Carried
    middle: Array
    rows: Array
    moving: Array


@numba.njit(cache=True)
def step(bodies, laws, room, q, v, ground):  # type: ignore
    """Take one step.

    Args:
        bodies: that move.
        laws: that hold.
        room: to work with.
        q: poses, moved on (b, 3).
        v: velocities, changed (b, 3).
        ground: its mean acceleration over the step (2,) [m/s²].

    Returns:
        Sweeps that were needed, -1 where there is no room for the contacts; and the deepest
        overlap [m].
    """
    half, count = 0.5 * laws.dt, len(q)
    for b in range(count):
        for axis in range(3):
            room.middle[b, axis] = q[b, axis] + half * v[b, axis]
    place(bodies, room.middle, room.world)
    touching = find(bodies, room.world, room.found)
    if touching < 0:
        return -1, 0.0
    recall(bodies, room.middle, room.found, touching, room.carried)
    room.moving[:count] = v
    room.moving[count] = 0.0
    _rows(bodies, laws, room, touching)
    for b in range(count):
        if bodies.inverse[b, 0] > 0.0:
            room.moving[b, 0] -= laws.dt * ground[0]
            room.moving[b, 1] -= laws.dt * (laws.gravity + ground[1])
    sweeps = _impulses(bodies, room, touching)
    keep(bodies, room.middle, room.found, touching, room.carried)
    for b in range(count):
        for axis in range(3):
            q[b, axis] += half * (v[b, axis] + room.moving[b, axis])
            v[b, axis] = room.moving[b, axis]
    overlap = 0.0
    for k in range(touching):
        overlap = max(overlap, -room.found.gap[k])
    return sweeps, overlap


@numba.njit(cache=True)
def _rows(bodies, laws, room, touching):  # type: ignore
    """What the sweeps need of each contact, with the velocities before the step."""
    found, rows = room.found, room.rows
    for k in range(touching):
        a, b = found.bodies[k]
        nx, ny = found.normal[k]
        (ma, ia), (mb, ib) = bodies.inverse[a], bodies.inverse[b]
        xa, ya = _arm(bodies, room.middle, found.point[k], a)
        xb, yb = _arm(bodies, room.middle, found.point[k], b)
        na, ta = xa * ny - ya * nx, xa * nx + ya * ny
        nb, tb = xb * ny - yb * nx, xb * nx + yb * ny
        rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3] = na, ta, nb, tb
        rows[k, 4] = 1.0 / (ma + mb + ia * na * na + ib * nb * nb)
        rows[k, 5] = 1.0 / (ma + mb + ia * ta * ta + ib * tb * tb)
        before = _speed(room.moving[a], room.moving[b], nx, ny, na, nb)
        rows[k, 6] = -laws.restitution * before if before < -laws.slow else 0.0
        rows[k, 7] = 0.0
        turn_a, turn_b = room.moving[a, 2] ** 2, room.moving[b, 2] ** 2
        pull_x, pull_y = turn_a * xa - turn_b * xb, turn_a * ya - turn_b * yb
        rows[k, 6] -= 0.5 * laws.dt * (pull_x * nx + pull_y * ny)
        rows[k, 7] -= 0.5 * laws.dt * (pull_y * nx - pull_x * ny)
        rows[k, 8] = bodies.friction[a, b]


@numba.njit(cache=True)
def _arm(bodies, q, point, body):  # type: ignore
    """From a body's centroid to a point; of the ground, which does not move, nothing."""
    if body == len(q):
        return 0.0, 0.0
    x = point[0] - bodies.centre[body, 0] - q[body, 0]
    return x, point[1] - bodies.centre[body, 1] - q[body, 1]


@numba.njit(cache=True)
def _speed(va, vb, nx, ny, ra, rb):  # type: ignore
    """Relative velocity along a direction."""
    return (vb[0] - va[0]) * nx + (vb[1] - va[1]) * ny + rb * vb[2] - ra * va[2]


@numba.njit(cache=True)
def _push(bodies, a, b, moving, nx, ny, ra, rb, impulse):  # type: ignore
    """Give two bodies an impulse along a direction."""
    (ma, ia), (mb, ib) = bodies.inverse[a], bodies.inverse[b]
    moving[a, 0] -= ma * nx * impulse
    moving[a, 1] -= ma * ny * impulse
    moving[a, 2] -= ia * ra * impulse
    moving[b, 0] += mb * nx * impulse
    moving[b, 1] += mb * ny * impulse
    moving[b, 2] += ib * rb * impulse


@numba.njit(cache=True)
def _impulses(bodies, room, touching):  # type: ignore
    """Sweep over the contacts until impulses hardly change; the number of sweeps."""
    found, rows, moving = room.found, room.rows, room.moving
    for k in range(touching):
        a, b = found.bodies[k]
        nx, ny = found.normal[k]
        _push(bodies, a, b, moving, nx, ny, rows[k, 0], rows[k, 2], found.impulse[k, 0])
        _push(bodies, a, b, moving, -ny, nx, rows[k, 1], rows[k, 3], found.impulse[k, 1])
    for sweep in range(1, SWEEPS + 1):
        change, largest = 0.0, 0.0
        for k in range(touching):
            a, b = found.bodies[k]
            nx, ny = found.normal[k]
            na, ta, nb, tb, kn, kt, wanted, slip, friction = rows[k]
            old = found.impulse[k, 0]
            new = max(old - kn * (_speed(moving[a], moving[b], nx, ny, na, nb) - wanted), 0.0)
            _push(bodies, a, b, moving, nx, ny, na, nb, new - old)
            found.impulse[k, 0] = new
            change, largest = max(change, abs(new - old)), max(largest, new)
            old, most = found.impulse[k, 1], friction * new
            new = old - kt * (_speed(moving[a], moving[b], -ny, nx, ta, tb) - slip)
            new = min(max(new, -most), most)
            _push(bodies, a, b, moving, -ny, nx, ta, tb, new - old)
            found.impulse[k, 1] = new
            change = max(change, abs(new - old))
        if change <= SETTLED * largest:
            return sweep
    return SWEEPS + 1
