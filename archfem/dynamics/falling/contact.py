"""Where pieces touch: a sorted sweep along x, separating axes, and the clipped incident edge.

The axis that separates two convex polygons best, or along which they overlap least, is normal to
an edge of one of them, the reference; the edge of the other that faces it most is cut to its
length, and up to two points remain that touch. Edges at which a body was cut into pieces separate
them too, but are never a reference. (Separating axes: Gottschalk, Lin and Manocha, SIGGRAPH 1996.)
"""

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from archfem.arrays import Array
from archfem.dynamics.falling.bodies import Bodies


class World(NamedTuple):
    """The pieces where they are.

    Attributes:
        points: vertices (k, 2) [m].
        normals: of their edges, outward (k, 2).
        boxes: least x, largest x, least y, largest y of each piece (p, 4) [m].
        order: pieces by their least x, nearly so before they are sorted (p,).
    """

    points: Array
    normals: Array
    boxes: Array
    order: NDArray[np.int64]


class Contacts(NamedTuple):
    """Points at which bodies touch, and the impulses there; only the first `count` are filled.

    Attributes:
        bodies: the two bodies; the ground is the last of all (c, 2).
        key: of the two pieces (c,).
        point: where (c, 2) [m].
        normal: from the first body to the second (c, 2).
        gap: between them, negative where they overlap (c,) [m].
        impulse: along the normal, and along the normal turned by +90° (c, 2) [N s].
    """

    bodies: NDArray[np.int64]
    key: NDArray[np.int64]
    point: Array
    normal: Array
    gap: Array
    impulse: Array


def world_of(bodies: Bodies) -> World:
    """Return room for the pieces.

    Args:
        bodies: of which they are.
    """
    pieces = len(bodies.owner)
    return World(
        np.empty_like(bodies.arms),
        np.empty_like(bodies.normals),
        np.empty((pieces, 4)),
        np.arange(pieces),
    )


def room_for(pieces: int) -> Contacts:
    """Return room for contacts: twice what a heap in the plane can have.

    Pieces and the pairs that touch make a plane graph, so of n pieces fewer than 3 n pairs do, n
    more with the ground, at two points each.

    Args:
        pieces: how many there are.
    """
    most = 16 * pieces + 16
    return Contacts(
        np.zeros((most, 2), dtype=np.int64),
        np.zeros(most, dtype=np.int64),
        np.zeros((most, 2)),
        np.zeros((most, 2)),
        np.zeros(most),
        np.zeros((most, 2)),
    )


@numba.njit(cache=True)
def place(bodies, q, world):  # type: ignore
    """Put the pieces where the bodies' poses say, and sort them along x.

    Args:
        bodies: with their shapes.
        q: poses (b, 3) [m, m, rad].
        world: filled.
    """
    points, normals, boxes, _ = world
    for piece in range(len(bodies.owner)):
        body = bodies.owner[piece]
        c, s = np.cos(q[body, 2]), np.sin(q[body, 2])
        x, y = bodies.centre[body, 0] + q[body, 0], bodies.centre[body, 1] + q[body, 1]
        box = boxes[piece]
        box[0], box[1], box[2], box[3] = np.inf, -np.inf, np.inf, -np.inf
        for k in range(bodies.start[piece], bodies.start[piece + 1]):
            arm, normal = bodies.arms[k], bodies.normals[k]
            points[k, 0] = x + c * arm[0] - s * arm[1]
            points[k, 1] = y + s * arm[0] + c * arm[1]
            normals[k, 0] = c * normal[0] - s * normal[1]
            normals[k, 1] = s * normal[0] + c * normal[1]
            box[0], box[1] = min(box[0], points[k, 0]), max(box[1], points[k, 0])
            box[2], box[3] = min(box[2], points[k, 1]), max(box[3], points[k, 1])
    _sort(world)


@numba.njit(cache=True)
def _sort(world):  # type: ignore
    """Sort by insertion: what was sorted a step ago nearly is so still."""
    order, boxes = world.order, world.boxes
    for k in range(1, len(order)):
        piece = order[k]
        low = boxes[piece, 0]
        place = k - 1
        while place >= 0 and boxes[order[place], 0] > low:
            order[place + 1] = order[place]
            place -= 1
        order[place + 1] = piece


@numba.njit(cache=True)
def find(bodies, world, found):  # type: ignore
    """Find all points at which bodies touch each other or the ground.

    Args:
        bodies: with their shapes.
        world: their pieces where they are.
        found: contacts, filled but for their impulses.

    Returns:
        How many there are; -1 where there is no room for them.
    """
    count, most = 0, len(found.key) - 4
    order, boxes, near = world.order, world.boxes, bodies.near
    for k in range(len(order)):
        one = order[k]
        body = bodies.owner[one]
        free = bodies.inverse[body, 0] > 0.0
        if free and boxes[one, 2] <= bodies.level + near:
            count = _with_ground(bodies, world, one, found, count)
        for later in range(k + 1, len(order)):
            two = order[later]
            if boxes[two, 0] > boxes[one, 1] + near:
                break
            apart = boxes[one, 2] > boxes[two, 3] + near or boxes[two, 2] > boxes[one, 3] + near
            other = bodies.owner[two]
            if not apart and body != other and (free or bodies.inverse[other, 0] > 0.0):
                count = _touch(bodies, world, min(one, two), max(one, two), found, count)
            if count > most:
                return -1
    return count


@numba.njit(cache=True)
def _with_ground(bodies, world, piece, found, count):  # type: ignore
    """Outermost vertices of a piece that touch the ground, one or two."""
    left, right = -1, -1
    for k in range(bodies.start[piece], bodies.start[piece + 1]):
        if world.points[k, 1] <= bodies.level + bodies.near:
            if left < 0 or world.points[k, 0] < world.points[left, 0]:
                left = k
            if right < 0 or world.points[k, 0] > world.points[right, 0]:
                right = k
    pieces, ground = len(bodies.owner), len(bodies.mass)
    for k in (left, right):
        gap = world.points[k, 1] - bodies.level
        # from the piece, the first, to the ground, the second: downward
        found.bodies[count, 0], found.bodies[count, 1] = bodies.owner[piece], ground
        found.key[count] = piece * (pieces + 1) + pieces
        found.point[count, 0], found.point[count, 1] = world.points[k, 0], bodies.level
        found.normal[count, 0], found.normal[count, 1] = 0.0, -1.0
        found.gap[count] = gap
        count += 1
        if left == right:
            break
    return count


@numba.njit(cache=True)
def _apart(bodies, world, one, two):  # type: ignore
    """The edge of a piece along whose normal another lies farthest off, and by how much."""
    best, edge = -np.inf, -1
    for k in range(bodies.start[one], bodies.start[one + 1]):
        nx, ny = world.normals[k, 0], world.normals[k, 1]
        least = np.inf
        for j in range(bodies.start[two], bodies.start[two + 1]):
            least = min(least, nx * world.points[j, 0] + ny * world.points[j, 1])
        least -= nx * world.points[k, 0] + ny * world.points[k, 1]
        if least > bodies.near:
            return least, k
        if bodies.outer[k] and least > best:
            best, edge = least, k
    return best, edge


@numba.njit(cache=True)
def _touch(bodies, world, one, two, found, count):  # type: ignore
    """Points at which two pieces touch."""
    here, edge = _apart(bodies, world, one, two)
    if here > bodies.near:
        return count
    there, other = _apart(bodies, world, two, one)
    if there > bodies.near:
        return count
    if there > here:
        return _clip(bodies, world, two, other, one, -1.0, found, count)
    return _clip(bodies, world, one, edge, two, 1.0, found, count)


@numba.njit(cache=True)
def _next(bodies, piece, k):  # type: ignore
    """The vertex after one of a piece."""
    return k + 1 if k + 1 < bodies.start[piece + 1] else bodies.start[piece]


@numba.njit(cache=True)
def _clip(bodies, world, one, edge, two, way, found, count):  # type: ignore
    """Points of the edge that faces the reference edge, cut to its length, that touch it."""
    n, start = world.normals[edge], world.points[edge]
    along = world.points[_next(bodies, one, edge)] - start
    length = np.sqrt(along[0] ** 2 + along[1] ** 2)
    incident, least = -1, np.inf
    for k in range(bodies.start[two], bodies.start[two + 1]):
        facing = n[0] * world.normals[k, 0] + n[1] * world.normals[k, 1]
        if bodies.outer[k] and facing < least:
            incident, least = k, facing
    a, b = world.points[incident], world.points[_next(bodies, two, incident)]
    tx, ty = along[0] / length, along[1] / length
    xa = (a[0] - start[0]) * tx + (a[1] - start[1]) * ty
    xb = (b[0] - start[0]) * tx + (b[1] - start[1]) * ty
    ya = (a[0] - start[0]) * n[0] + (a[1] - start[1]) * n[1]
    yb = (b[0] - start[0]) * n[0] + (b[1] - start[1]) * n[1]
    low, high = max(0.0, min(xa, xb)), min(length, max(xa, xb))
    if low > high:
        return count
    first, second = (one, two) if way > 0.0 else (two, one)
    for x in (low, high):
        y = ya if xb == xa else ya + (yb - ya) * (x - xa) / (xb - xa)
        if y <= bodies.near:
            found.bodies[count, 0] = bodies.owner[first]
            found.bodies[count, 1] = bodies.owner[second]
            found.key[count] = first * (len(bodies.owner) + 1) + second
            for axis in range(2):
                t = tx if axis == 0 else ty
                found.point[count, axis] = start[axis] + x * t + 0.5 * y * n[axis]
                found.normal[count, axis] = way * n[axis]
            found.gap[count] = y
            count += 1
        if low == high:
            break
    return count
