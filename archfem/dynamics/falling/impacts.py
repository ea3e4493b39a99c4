"""A step of Moreau and Jean's scheme: contacts at half of it, impulses, velocities and poses.

With θ = ½ and H the rows of normal and tangential relative velocity at the contacts found at
q + ½ Δt v,

    M (v₁ - v₀) = Δt p + Hᵀ P,   0 <= u_N1 + e u_N0 ⊥ P_N >= 0,   q₁ = q₀ + ½ Δt (v₀ + v₁),

|P_T| <= μ P_N, and P_T opposes u_T1 where that is not zero (Moreau, in: Nonsmooth Mechanics and
Applications, 1988; Jean, Comput. Methods Appl. Mech. Eng. 177 (1999) 235). Solved by projected
Gauss and Seidel, contact by contact, from the impulses of the step before. Impulses that do no work
need not have settled; those that do are swept on.
"""

from typing import NamedTuple

import numba

from archfem.arrays import Array
from archfem.dynamics.falling.carried import Carried, keep, recall
from archfem.dynamics.falling.contact import Contacts, World, find, place

PATIENCE = 40
"""How many times as many sweeps a step may have whose impulses would add energy."""


class Laws(NamedTuple):
    """What holds at every step.

    Attributes:
        dt: Δt [s].
        gravity: downward [m/s²].
        restitution: e [-].
        slow: speed of approach below which nothing bounces [m/s].
        sweeps: over the contacts of a step, before its impulses are taken as they are.
        settled: change of an impulse, relative to the largest, below which a sweep is the last.
    """

    dt: float
    gravity: float
    restitution: float
    slow: float
    sweeps: int
    settled: float


class Room(NamedTuple):
    """What steps work with.

    Attributes:
        world: the pieces where they are.
        found: contacts.
        carried: impulses of the step before.
        middle: poses at half of the step (b, 3).
        rows: of each contact, the arms' cross products with the normal, first and second body, and
            with the tangent, 1/(H M⁻¹ Hᵀ) of normal and tangent, wanted u_N and u_T, and μ (c, 9).
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
        Sweeps that were needed, one too many if impulses did not settle, -1 where there is no room
        for the contacts; and the deepest overlap [m].
    """
    found, carried, middle, moving = room.found, room.carried, room.middle, room.moving
    half, count = 0.5 * laws.dt, len(q)
    middle[:] = q + half * v
    place(bodies, middle, room.world)
    touching = find(bodies, room.world, found)
    if touching < 0:
        return -1, 0.0
    recall(bodies, middle, found, touching, carried)
    moving[:count] = v
    moving[count] = 0.0
    _rows(bodies, laws, room, touching)
    for b in range(count):
        if bodies.inverse[b, 0] > 0.0:
            moving[b, 0] -= laws.dt * ground[0]
            moving[b, 1] -= laws.dt * (laws.gravity + ground[1])
    _carry_on(bodies, room, touching)
    for _ in range(PATIENCE):
        sweeps = _impulses(bodies, laws, room, touching)
        if sweeps <= laws.sweeps or not _gains(bodies, laws, v, moving, ground):
            break
    keep(bodies, middle, found, touching, carried)
    q += half * (v + moving[:count])
    v[:] = moving[:count]
    overlap = 0.0
    for k in range(touching):
        overlap = max(overlap, -found.gap[k])
    return sweeps, overlap


@numba.njit(cache=True)
def _rows(bodies, laws, room, touching):  # type: ignore
    """What the sweeps need of each contact, with the velocities before the step.

    Where bodies spin, the relative velocity of the two points at contact changes in half a step by
    ½ Δt of that of ω² r: what is wanted of u is wanted at the end of the step. With it a block that
    turns about its corner keeps its energy to O(Δt²).
    """
    found, rows, moving, middle = room.found, room.rows, room.moving, room.middle
    for k in range(touching):
        a, b = found.bodies[k]
        nx, ny = found.normal[k]
        (ma, ia), (mb, ib) = bodies.inverse[a], bodies.inverse[b]
        xa, ya = _arm(bodies, middle, found.point[k], a)
        xb, yb = _arm(bodies, middle, found.point[k], b)
        na, ta = xa * ny - ya * nx, xa * nx + ya * ny
        nb, tb = xb * ny - yb * nx, xb * nx + yb * ny
        rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3] = na, nb, ta, tb
        rows[k, 4] = 1.0 / (ma + mb + ia * na * na + ib * nb * nb)
        rows[k, 5] = 1.0 / (ma + mb + ia * ta * ta + ib * tb * tb)
        before = _speed(moving, (a, b), (nx, ny), (na, nb))
        bounce = -laws.restitution * before if before < -laws.slow else 0.0
        spin_a, spin_b = moving[a, 2] ** 2, moving[b, 2] ** 2
        pull_x, pull_y = spin_a * xa - spin_b * xb, spin_a * ya - spin_b * yb
        rows[k, 6] = bounce - 0.5 * laws.dt * (pull_x * nx + pull_y * ny)
        rows[k, 7] = -0.5 * laws.dt * (pull_y * nx - pull_x * ny)
        rows[k, 8] = bodies.friction[a, b]


@numba.njit(cache=True)
def _arm(bodies, q, point, body):  # type: ignore
    """From a body's centroid to a point; of the ground, which does not move, nothing."""
    if body == len(q):
        return 0.0, 0.0
    x = point[0] - bodies.centre[body, 0] - q[body, 0]
    return x, point[1] - bodies.centre[body, 1] - q[body, 1]


@numba.njit(cache=True)
def _speed(moving, pair, way, arms):  # type: ignore
    """Velocity of the second of two bodies relative to the first, along a direction."""
    one, two = moving[pair[0]], moving[pair[1]]
    straight = (two[0] - one[0]) * way[0] + (two[1] - one[1]) * way[1]
    return straight + arms[1] * two[2] - arms[0] * one[2]


@numba.njit(cache=True)
def _push(bodies, moving, pair, way, arms, impulse):  # type: ignore
    """Give the second of two bodies an impulse along a direction, and the first the opposite."""
    for side in range(2):
        m, inertia = bodies.inverse[pair[side]]
        body, signed = moving[pair[side]], impulse if side else -impulse
        body[0] += m * way[0] * signed
        body[1] += m * way[1] * signed
        body[2] += inertia * arms[side] * signed


@numba.njit(cache=True)
def _gains(bodies, laws, before, after, ground):  # type: ignore
    """Whether the impulses of a step have done work, but for what rounds."""
    work = kinetic = 0.0
    for b in range(len(before)):
        m, inertia = bodies.mass[b]
        if bodies.inverse[b, 0] == 0.0:
            continue
        (x0, y0, w0), (x1, y1, w1) = before[b], after[b]
        along = x1 - x0 + laws.dt * ground[0]
        up = y1 - y0 + laws.dt * (laws.gravity + ground[1])
        work += 0.5 * m * (along * (x0 + x1) + up * (y0 + y1)) + 0.5 * inertia * (w1**2 - w0**2)
        kinetic += 0.5 * m * (x1**2 + y1**2) + 0.5 * inertia * w1**2
    return work > laws.settled * kinetic


@numba.njit(cache=True)
def _carry_on(bodies, room, touching):  # type: ignore
    """Begin with the impulses that the contacts have."""
    found, moving = room.found, room.moving
    for k in range(touching):
        a, b = found.bodies[k]
        nx, ny = found.normal[k]
        na, nb, ta, tb = room.rows[k, :4]
        _push(bodies, moving, (a, b), (nx, ny), (na, nb), found.impulse[k, 0])
        _push(bodies, moving, (a, b), (-ny, nx), (ta, tb), found.impulse[k, 1])


@numba.njit(cache=True)
def _impulses(bodies, laws, room, touching):  # type: ignore
    """Sweep over the contacts until impulses hardly change; the number of sweeps."""
    found, moving = room.found, room.moving
    for sweep in range(1, laws.sweeps + 1):
        change, largest = 0.0, 0.0
        for k in range(touching):
            a, b = found.bodies[k]
            nx, ny = found.normal[k]
            na, nb, ta, tb, kn, kt, wanted, slip, friction = room.rows[k]
            old = found.impulse[k, 0]
            speed = _speed(moving, (a, b), (nx, ny), (na, nb))
            new = max(old - kn * (speed - wanted), 0.0)
            _push(bodies, moving, (a, b), (nx, ny), (na, nb), new - old)
            found.impulse[k, 0] = new
            change, largest = max(change, abs(new - old)), max(largest, new)
            old, most = found.impulse[k, 1], friction * new
            speed = _speed(moving, (a, b), (-ny, nx), (ta, tb))
            new = min(max(old - kt * (speed - slip), -most), most)
            _push(bodies, moving, (a, b), (-ny, nx), (ta, tb), new - old)
            found.impulse[k, 1] = new
            change = max(change, abs(new - old))
        if change <= laws.settled * largest:
            return sweep
    return laws.sweeps + 1
