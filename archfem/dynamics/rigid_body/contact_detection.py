"""Contact points between convex pieces, by a sorted sweep and separating axes; warm start.

Pieces are sorted along x, so that only pairs with overlapping intervals are tested. The axis of
largest separation, or of smallest overlap, of two convex polygons is normal to an edge of one of
them, the reference edge. The edge of the other that faces it most, the incident edge, is clipped to
its length, and up to two points remain. Where that is a cut between two pieces of a body, the other
piece bears, and this pair has no contact: what overlaps it has come through the cut. (Separating
axes: Gottschalk, Lin and Manocha, SIGGRAPH 1996.)

A hash table stores the impulses of a step by the pair of pieces, as initial guess of the next. Rows
of relative velocity, effective masses and the residual of impulses belong to contacts too.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from archfem._numba import allocating_entry, entry, kernel
from archfem._typing import Array
from archfem.dynamics.rigid_body.bodies import Bodies


class PlacedPieces(NamedTuple):
    """Workspace: pieces in the present positions of their bodies."""

    points: Array  # vertices (k, 2) [m]
    normals: Array  # outward, of their edges (k, 2)
    boxes: Array  # smallest x, largest x, smallest y, largest y of each piece (p, 4) [m]
    order: NDArray[np.int64]  # pieces in order of their smallest x (p,)


class Contacts(NamedTuple):
    """Contact points and their impulses, of which the first `count` are filled."""

    bodies: NDArray[np.int64]  # the two bodies; the ground is the last of all (c, 2)
    key: NDArray[np.int64]  # of the two pieces (c,)
    point: Array  # position (c, 2) [m]
    normal: Array  # from the first body to the second (c, 2)
    gap: Array  # negative for overlap (c,) [m]
    # along the normal, along the normal turned by +90°, and at both ends of a face, opposite (c, 3)
    impulse: Array  # [N s]


class StoredImpulses(NamedTuple):
    """Impulses of the previous step, with a hash table of their keys."""

    key: NDArray[np.int64]  # of the two pieces at each contact (c,)
    place: Array  # of the contact along the tangent, from the first body's centroid (c,) [m]
    impulse: Array  # (c, 2) [N s]
    slots: NDArray[np.int64]  # number of a contact by hash of its key, -1 for none (2^m,)


def allocate_pieces(bodies: Bodies) -> PlacedPieces:
    """Return the workspace of the pieces."""
    pieces = len(bodies.owner)
    return PlacedPieces(
        np.empty_like(bodies.arms),
        np.empty_like(bodies.normals),
        np.empty((pieces, 4)),
        np.arange(pieces),
    )


def allocate_contacts(pieces: int) -> Contacts:
    """Return the workspace of contacts, for twice as many as pieces in the plane can have."""
    # Pieces and touching pairs make a planar graph: n pieces have fewer than 3 n pairs, and n more
    # with the ground, at two points each
    capacity = 16 * pieces + 16
    return Contacts(
        np.zeros((capacity, 2), dtype=np.int64),
        np.zeros(capacity, dtype=np.int64),
        np.zeros((capacity, 2)),
        np.zeros((capacity, 2)),
        np.zeros(capacity),
        np.zeros((capacity, 3)),
    )


def allocate_stored_impulses(contacts: Contacts) -> StoredImpulses:
    """Return an empty store of impulses, whose table is at most a quarter full."""
    capacity = len(contacts.key)
    return StoredImpulses(
        np.zeros(capacity, dtype=np.int64),
        np.zeros(capacity),
        np.zeros((capacity, 2)),
        np.full(1 << int(2 * capacity).bit_length(), -1, dtype=np.int64),
    )


@entry
def place_pieces(bodies, q, world):  # type: ignore
    """Move the pieces to the poses of their bodies, and sort them along x."""
    points, normals, boxes, _ = world
    for piece in range(len(bodies.owner)):
        # rotation about the centroid, then translation
        body = bodies.owner[piece]
        c, s = np.cos(q[body, 2]), np.sin(q[body, 2])
        x, y = bodies.centre[body, 0] + q[body, 0], bodies.centre[body, 1] + q[body, 1]
        box = boxes[piece]
        box[0], box[1], box[2], box[3] = np.inf, -np.inf, np.inf, -np.inf
        for k in range(bodies.piece_starts[piece], bodies.piece_starts[piece + 1]):
            arm, normal = bodies.arms[k], bodies.normals[k]
            points[k, 0] = x + c * arm[0] - s * arm[1]
            points[k, 1] = y + s * arm[0] + c * arm[1]
            normals[k, 0] = c * normal[0] - s * normal[1]
            normals[k, 1] = s * normal[0] + c * normal[1]
            # bounding box, for the sweep
            box[0], box[1] = min(box[0], points[k, 0]), max(box[1], points[k, 0])
            box[2], box[3] = min(box[2], points[k, 1]), max(box[3], points[k, 1])
    _sort(world)


@kernel
def _sort(world):  # type: ignore
    """Sort the pieces by their smallest x."""
    order, boxes = world.order, world.boxes
    # insertion sort is linear, since the order of the previous step is nearly right
    for k in range(1, len(order)):
        piece = order[k]
        low = boxes[piece, 0]
        place = k - 1
        while place >= 0 and boxes[order[place], 0] > low:
            order[place + 1] = order[place]
            place -= 1
        order[place + 1] = piece


@entry
def find_contacts(bodies, world, contacts, motion):  # type: ignore
    """Find all contact points; return their number, or -1 where the workspace is too small.

    The motion is of the middle of the step: poses, velocities with the ground's, and foresight [s].
    Points that would be too deep in each other after that time are contacts too.
    """
    count, capacity = 0, len(contacts.key) - 4  # a pair and the ground add up to four points
    order, boxes, margin = world.order, world.boxes, _largest_gap(bodies, motion)
    for k in range(len(order)):
        one = order[k]
        body = bodies.owner[one]
        free = bodies.inverse_mass[body, 0] > 0.0
        if free and boxes[one, 2] <= bodies.level + margin:
            count = _touch_ground(bodies, world, one, motion, contacts, count)
        for later in range(k + 1, len(order)):
            two = order[later]
            # all further pieces begin beyond this one
            if boxes[two, 0] > boxes[one, 1] + margin:
                break
            apart = boxes[one, 2] > boxes[two, 3] + margin or boxes[two, 2] > boxes[one, 3] + margin
            other = bodies.owner[two]
            # pieces of one body, and of two fixed bodies, have no contact
            if not apart and body != other and (free or bodies.inverse_mass[other, 0] > 0.0):
                pieces = min(one, two), max(one, two)
                count = _touch(bodies, world, pieces, margin, contacts, count)
            if count > capacity:
                return -1
    return _keep_crossing(bodies, motion, contacts, count) if margin > bodies.contact_gap else count


@kernel
def _largest_gap(bodies, motion):  # type: ignore
    """Return the largest gap that a contact can have [m]."""
    _, speeds, foresight = motion
    fastest = 0.0
    for b in range(len(bodies.mass)):
        speed = np.sqrt(speeds[b, 0] ** 2 + speeds[b, 1] ** 2)
        fastest = max(fastest, speed + bodies.reach[b] * abs(speeds[b, 2]))
    return max(bodies.contact_gap, 2.0 * foresight * fastest - bodies.slop)


@kernel
def _will_cross(bodies, motion, pair, place, gap):  # type: ignore
    """Return whether two points will be too deep in each other if nothing stops them."""
    (middle, speeds, foresight), (a, b), (point, normal) = motion, pair, place
    (xa, ya), (xb, yb) = _arm(bodies, middle, point, a), _arm(bodies, middle, point, b)
    arms = xa * normal[1] - ya * normal[0], xb * normal[1] - yb * normal[0]
    return gap + foresight * relative_speed(speeds, pair, normal, arms) < -bodies.slop


@kernel
def _keep_crossing(bodies, motion, contacts, count):  # type: ignore
    """Drop points that neither touch nor will cross; return the number of the others.

    Where one point of a face will cross, the other is kept too: the impact may turn it in.
    """
    kept, crossing = 0, False
    for k in range(count):
        if k == 0 or contacts.key[k] != contacts.key[k - 1]:
            last = k + 2 if has_partner(contacts, k, count) else k + 1
            crossing = False
            for j in range(k, last):
                pair, place = contacts.bodies[j], (contacts.point[j], contacts.normal[j])
                crossing |= _will_cross(bodies, motion, pair, place, contacts.gap[j])
        if contacts.gap[k] > bodies.contact_gap and not crossing:
            continue
        contacts.key[kept], contacts.gap[kept] = contacts.key[k], contacts.gap[k]
        for axis in range(2):
            contacts.bodies[kept, axis] = contacts.bodies[k, axis]
            contacts.point[kept, axis] = contacts.point[k, axis]
            contacts.normal[kept, axis] = contacts.normal[k, axis]
        kept += 1
    return kept


@kernel
def _touch_ground(bodies, world, piece, motion, contacts, count):  # type: ignore
    """Add the outermost vertices of a piece that touch the ground, one or two."""
    left, right = -1, -1
    pair, down = (bodies.owner[piece], len(bodies.mass)), (0.0, -1.0)
    for k in range(bodies.piece_starts[piece], bodies.piece_starts[piece + 1]):
        point = world.points[k, 0], world.points[k, 1]
        gap = point[1] - bodies.level
        if gap <= bodies.contact_gap or _will_cross(bodies, motion, pair, (point, down), gap):
            if left < 0 or world.points[k, 0] < world.points[left, 0]:
                left = k
            if right < 0 or world.points[k, 0] > world.points[right, 0]:
                right = k
    pieces, ground = len(bodies.owner), len(bodies.mass)
    for k in (left, right):
        if k < 0:
            break
        gap = world.points[k, 1] - bodies.level
        # the normal points from the piece, the first body, to the ground, the second: downward
        contacts.bodies[count, 0], contacts.bodies[count, 1] = bodies.owner[piece], ground
        contacts.key[count] = piece * (pieces + 1) + pieces
        contacts.point[count, 0], contacts.point[count, 1] = world.points[k, 0], bodies.level
        contacts.normal[count, 0], contacts.normal[count, 1] = 0.0, -1.0
        contacts.gap[count] = gap
        count += 1
        if left == right:
            break
    return count


@kernel
def _edge_distance(bodies, world, edge, piece):  # type: ignore
    """Return the distance of a piece's nearest vertex from the line of an edge, outward [m]."""
    nx, ny = world.normals[edge, 0], world.normals[edge, 1]
    nearest = np.inf
    for j in range(bodies.piece_starts[piece], bodies.piece_starts[piece + 1]):
        nearest = min(nearest, nx * world.points[j, 0] + ny * world.points[j, 1])
    return nearest - (nx * world.points[edge, 0] + ny * world.points[edge, 1])


@kernel
def _separation(bodies, world, one, two, margin):  # type: ignore
    """Return the largest separation of two pieces along normals of the first, and its edge."""
    best, edge = -np.inf, -1
    for k in range(bodies.piece_starts[one], bodies.piece_starts[one + 1]):
        nearest = _edge_distance(bodies, world, k, two)
        # any separating edge ends the test
        if nearest > margin:
            return nearest, k
        if nearest > best:
            best, edge = nearest, k
    return best, edge


@kernel
def _touch(bodies, world, pieces, margin, contacts, count):  # type: ignore
    """Add the contact points of two pieces."""
    one, two = pieces
    here, edge = _separation(bodies, world, one, two, margin)
    if here > margin:
        return count
    there, other = _separation(bodies, world, two, one, margin)
    if there > margin:
        return count
    # the reference edge is that of the larger separation; through a cut, another piece bears
    reference = (two, other, one, -1.0) if there > here else (one, edge, two, 1.0)
    if not bodies.outer[reference[1]]:
        return count
    return _clip(bodies, world, reference, margin, contacts, count)


@kernel
def _next_vertex(bodies, piece, k):  # type: ignore
    """Return the vertex after one of a piece."""
    return k + 1 if k + 1 < bodies.piece_starts[piece + 1] else bodies.piece_starts[piece]


@kernel
def _clip(bodies, world, reference, margin, contacts, count):  # type: ignore
    """Add the end points of the incident edge, clipped to the reference edge, that touch it."""
    one, edge, two, sign = reference
    n, start = world.normals[edge], world.points[edge]
    end = world.points[_next_vertex(bodies, one, edge)]
    tx, ty = end[0] - start[0], end[1] - start[1]
    length = np.sqrt(tx**2 + ty**2)
    # the incident edge has the normal most opposite to that of the reference edge
    incident, lowest = -1, np.inf
    for k in range(bodies.piece_starts[two], bodies.piece_starts[two + 1]):
        facing = n[0] * world.normals[k, 0] + n[1] * world.normals[k, 1]
        if facing < lowest:
            incident, lowest = k, facing
    # its ends in coordinates along (x) and away from (y) the reference edge
    a, b = world.points[incident], world.points[_next_vertex(bodies, two, incident)]
    tx, ty = tx / length, ty / length
    xa = (a[0] - start[0]) * tx + (a[1] - start[1]) * ty
    xb = (b[0] - start[0]) * tx + (b[1] - start[1]) * ty
    ya = (a[0] - start[0]) * n[0] + (a[1] - start[1]) * n[1]
    yb = (b[0] - start[0]) * n[0] + (b[1] - start[1]) * n[1]
    low, high = max(0.0, min(xa, xb)), min(length, max(xa, xb))
    if low > high:
        return count
    first, second = (one, two) if sign > 0.0 else (two, one)
    for x in (low, high):
        # gap by linear interpolation along the incident edge
        y = ya if xb == xa else ya + (yb - ya) * (x - xa) / (xb - xa)
        if y <= margin:
            contacts.bodies[count, 0] = bodies.owner[first]
            contacts.bodies[count, 1] = bodies.owner[second]
            contacts.key[count] = first * (len(bodies.owner) + 1) + second
            # the contact point is midway between both edges
            for axis in range(2):
                t = tx if axis == 0 else ty
                contacts.point[count, axis] = start[axis] + x * t + 0.5 * y * n[axis]
                contacts.normal[count, axis] = sign * n[axis]
            contacts.gap[count] = y
            count += 1
        if low == high:
            break
    return count


@kernel
def store_impulses(bodies, q, contacts, count, stored):  # type: ignore
    """Store the impulses of a step."""
    slots = stored.slots
    slots[:] = -1
    for k in range(count):
        stored.key[k] = contacts.key[k]
        stored.place[k] = _tangential_position(bodies, q, contacts, k)
        for axis in range(2):
            stored.impulse[k, axis] = contacts.impulse[k, axis]
        # open addressing: the next free slot after the hash
        slot = _hash_slot(contacts.key[k], len(slots))
        while slots[slot] >= 0:
            slot = (slot + 1) % len(slots)
        slots[slot] = k


@kernel
def restore_impulses(bodies, q, contacts, count, stored):  # type: ignore
    """Set impulses to those of the nearest contacts of the same pieces, each used once."""
    slots = stored.slots
    for k in range(count):
        contacts.impulse[k, 0] = contacts.impulse[k, 1] = contacts.impulse[k, 2] = 0.0
        place, best, nearest = _tangential_position(bodies, q, contacts, k), -1, np.inf
        slot = _hash_slot(contacts.key[k], len(slots))
        # up to two contacts of a pair share a chain of slots
        while slots[slot] >= 0:
            old = slots[slot]
            distance = abs(stored.place[old] - place)
            if stored.key[old] == contacts.key[k] and distance < nearest:
                best, nearest = old, distance
            slot = (slot + 1) % len(slots)
        if best >= 0:
            for axis in range(2):
                contacts.impulse[k, axis] = stored.impulse[best, axis]
            stored.key[best] = -1


@kernel
def _hash_slot(key, size):  # type: ignore
    """Return the first slot of a key, by multiplicative hashing."""
    # the multiplier is 2³² over the golden ratio
    return ((key * 0x9E3779B1) >> 16) & (size - 1)


@kernel
def _tangential_position(bodies, q, contacts, k):  # type: ignore
    """Return the position of a contact along its tangent, from the first body's centroid [m]."""
    body = contacts.bodies[k, 0]
    rx = contacts.point[k, 0] - bodies.centre[body, 0] - q[body, 0]
    ry = contacts.point[k, 1] - bodies.centre[body, 1] - q[body, 1]
    return ry * contacts.normal[k, 0] - rx * contacts.normal[k, 1]


@kernel
def prepare_rows(bodies, parameters, workspace, touching):  # type: ignore
    """Compute the rows of H, their inverse effective masses, and the target velocities."""
    contacts, rows = workspace.contacts, workspace.rows
    speeds, middle = workspace.speeds, workspace.middle
    for k in range(touching):
        a, b = contacts.bodies[k]
        nx, ny = contacts.normal[k]
        (ma, ia), (mb, ib) = bodies.inverse_mass[a], bodies.inverse_mass[b]
        # moment arms of normal (n) and tangential (t) impulses
        xa, ya = _arm(bodies, middle, contacts.point[k], a)
        xb, yb = _arm(bodies, middle, contacts.point[k], b)
        na, ta = xa * ny - ya * nx, xa * nx + ya * ny
        nb, tb = xb * ny - yb * nx, xb * nx + yb * ny
        rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3] = na, nb, ta, tb
        # effective masses 1/(H M⁻¹ Hᵀ)
        rows[k, 11] = ma + mb + ia * na * na + ib * nb * nb
        rows[k, 12] = ma + mb + ia * ta * ta + ib * tb * tb
        rows[k, 4], rows[k, 5] = 1.0 / rows[k, 11], 1.0 / rows[k, 12]
        # Centripetal accelerations ω² r change the relative velocity in half a step by ½ Δt times
        # their difference. Targets hold at the end of the step: a block that turns about its corner
        # then conserves its energy to O(Δt²)
        spin_a, spin_b = speeds[a, 2] ** 2, speeds[b, 2] ** 2
        pull_x, pull_y = spin_a * xa - spin_b * xb, spin_a * ya - spin_b * yb
        rows[k, 6] = -0.5 * parameters.dt * (pull_x * nx + pull_y * ny)
        rows[k, 7] = -0.5 * parameters.dt * (pull_y * nx - pull_x * ny)
        rows[k, 8], rows[k, 14] = bodies.friction[a, b], 0.0
        # points that are still apart may close by the end of the step
        if contacts.gap[k] > bodies.contact_gap:
            rows[k, 6] -= 2.0 * contacts.gap[k] / parameters.dt
    for k in range(touching):
        rows[k, 9] = rows[k, 13] = 0.0
        if not has_partner(contacts, k, touching):
            continue
        rows[k, 14] = rows[k + 1, 14] = _bond_impulse(bodies, parameters, contacts, k)
        a, b = contacts.bodies[k]
        (ma, ia), (mb, ib) = bodies.inverse_mass[a], bodies.inverse_mass[b]
        rows[k, 9] = ma + mb + ia * rows[k, 0] * rows[k + 1, 0] + ib * rows[k, 1] * rows[k + 1, 1]
        determinant = rows[k, 11] * rows[k + 1, 11] - rows[k, 9] ** 2
        # points of a face that coincide are solved one after the other
        if determinant > 1e-9 * rows[k, 11] * rows[k + 1, 11]:
            rows[k, 13] = 1.0 / determinant


@kernel
def _bond_impulse(bodies, parameters, contacts, k):  # type: ignore
    """Return the limit by cohesion at each of the two points of a face in a step [N s]."""
    cohesion = bodies.cohesion[contacts.bodies[k, 0], contacts.bodies[k, 1]]
    if cohesion == 0.0 or max(contacts.gap[k], contacts.gap[k + 1]) > bodies.contact_gap:
        return 0.0
    x = contacts.point[k + 1, 0] - contacts.point[k, 0]
    y = contacts.point[k + 1, 1] - contacts.point[k, 1]
    # All of the length counts, however eccentric the force is: that of each of several faces of a
    # rigid block is not unique.
    return 0.5 * parameters.dt * cohesion * np.sqrt(x**2 + y**2)


@kernel
def _arm(bodies, q, point, body):  # type: ignore
    """Return the vector from a body's centroid to a point; zero for the ground, which is fixed."""
    if body == len(q):
        return 0.0, 0.0
    x = point[0] - bodies.centre[body, 0] - q[body, 0]
    return x, point[1] - bodies.centre[body, 1] - q[body, 1]


@kernel
def relative_speed(speeds, pair, direction, arms):  # type: ignore
    """Return the velocity of the second body relative to the first along a direction."""
    one, two = speeds[pair[0]], speeds[pair[1]]
    translation = (two[0] - one[0]) * direction[0] + (two[1] - one[1]) * direction[1]
    return translation + arms[1] * two[2] - arms[0] * one[2]


@kernel
def _apply_impulse(bodies, speeds, pair, direction, arms, impulse):  # type: ignore
    """Apply an impulse along a direction to the second body, and its reaction to the first."""
    for side in range(2):
        m, inertia = bodies.inverse_mass[pair[side]]
        body, signed = speeds[pair[side]], impulse if side else -impulse
        body[0] += m * direction[0] * signed
        body[1] += m * direction[1] * signed
        body[2] += inertia * arms[side] * signed


@kernel
def apply_initial_impulses(bodies, workspace, touching):  # type: ignore
    """Apply the impulses of the step before, as initial guess of the sweeps."""
    contacts, speeds = workspace.contacts, workspace.speeds
    for k in range(touching):
        a, b = contacts.bodies[k]
        nx, ny = contacts.normal[k]
        na, nb, ta, tb = workspace.rows[k, :4]
        _apply_impulse(bodies, speeds, (a, b), (nx, ny), (na, nb), contacts.impulse[k, 0])
        _apply_impulse(bodies, speeds, (a, b), (-ny, nx), (ta, tb), contacts.impulse[k, 1])


@kernel
def has_partner(contacts, k, touching):  # type: ignore
    """Return whether a contact and the next one are the two points of one face."""
    return k + 1 < touching and contacts.key[k] == contacts.key[k + 1]


@kernel
def measure_residual(bodies, workspace, touching):  # type: ignore
    """Return the largest violation of a contact's condition, as a velocity [m/s]."""
    contacts, speeds = workspace.contacts, workspace.speeds
    worst = 0.0
    for k in range(touching):
        a, b = contacts.bodies[k]
        nx, ny = contacts.normal[k]
        na, nb, ta, tb, kn, kt, target, slip, friction = workspace.rows[k, :9]
        normal, tangential, couple = contacts.impulse[k]
        # no tension and no approach: the impulse equals its projection after a correction
        speed = relative_speed(speeds, (a, b), (nx, ny), (na, nb)) - target
        worst = max(worst, abs(max(normal - kn * speed, 0.0) - normal) / kn)
        # likewise stick, or slip at Coulomb's limit
        speed = relative_speed(speeds, (a, b), (-ny, nx), (ta, tb)) - slip
        limit = friction * normal + workspace.rows[k, 14]
        change = min(max(tangential - kt * speed, -limit), limit) - tangential
        worst = max(worst, abs(change) / kt)
        arm, bound = workspace.rows[k, 15:17]
        if arm != 0.0:
            # no couple, or a face that opens at the bound
            inverse = arm * arm * (bodies.inverse_mass[a, 1] + bodies.inverse_mass[b, 1])
            excess = (arm * (speeds[b, 2] - speeds[a, 2]) - bound) / inverse
            worst = max(worst, abs(max(couple + excess, 0.0) - couple) * inverse)
    return worst


@kernel
def solve_face(inverse, old, gap):  # type: ignore
    """Return the normal impulses of a face's two points that meet the conditions of both."""
    one, two, coupling, factor = inverse
    # relative velocities without these impulses
    free = gap[0] - one * old[0] - coupling * old[1]
    free2 = gap[1] - coupling * old[0] - two * old[1]
    new, new2 = (coupling * free2 - two * free) * factor, (coupling * free - one * free2) * factor
    if new >= 0.0 and new2 >= 0.0:
        return new, new2
    # one end opens, or both
    new = max(-free / one, 0.0)
    if coupling * new + free2 >= 0.0:
        return new, 0.0
    return 0.0, max(-free2 / two, 0.0)


@kernel
def _widest_gap(bodies, world, one, two):  # type: ignore
    """Return a lower bound of the distance of two pieces; negative, their depth of overlap [m]."""
    widest = -np.inf
    for first, second in ((one, two), (two, one)):
        for k in range(bodies.piece_starts[first], bodies.piece_starts[first + 1]):
            widest = max(widest, _edge_distance(bodies, world, k, second))
    return widest


@allocating_entry
def measure_gaps(bodies, world, q):  # type: ignore
    """Return lower bounds of the distances of all bodies and the ground (b + 1, b + 1) [m]."""
    ground = len(bodies.mass)
    gaps = np.full((ground + 1, ground + 1), np.inf)
    place_pieces(bodies, q, world)
    for one in range(len(bodies.owner)):
        body = bodies.owner[one]
        gaps[body, ground] = min(gaps[body, ground], world.boxes[one, 2] - bodies.level)
        gaps[ground, body] = gaps[body, ground]
        for two in range(one):
            other = bodies.owner[two]
            if other != body:
                gap = min(gaps[body, other], _widest_gap(bodies, world, one, two))
                gaps[body, other] = gaps[other, body] = gap
    return gaps


@allocating_entry
def find_meeting(bodies, world, motions, limits, pairs, depths):  # type: ignore
    """Return the first of many poses (steps, b, 3) at which a gap is below its limit, and the pair.

    Limits (b + 1, b + 1) are never positive, and minus infinity exempts a pair. Those of `pairs`
    (j, 2) are lower at each step by `depths` (steps, j). The step is -1 for no meeting.
    """
    ground, limit = len(bodies.mass), limits.copy()
    for step in range(len(motions)):
        # two blocks may have several joints: the deepest counts
        for j in range(len(pairs)):
            limit[pairs[j, 0], pairs[j, 1]] = limits[pairs[j, 0], pairs[j, 1]]
        for j in range(len(pairs)):
            one, two = pairs[j]
            limit[one, two] = min(limit[one, two], limits[one, two] - depths[step, j])
            limit[two, one] = limit[one, two]
        place_pieces(bodies, motions[step], world)
        order, boxes = world.order, world.boxes
        for k in range(len(order)):
            one = order[k]
            body = bodies.owner[one]
            if boxes[one, 2] - bodies.level < limit[body, ground]:
                return step, body, ground
            for later in range(k + 1, len(order)):
                two = order[later]
                # all further pieces begin beyond this one
                if boxes[two, 0] > boxes[one, 1]:
                    break
                if boxes[one, 2] > boxes[two, 3] or boxes[two, 2] > boxes[one, 3]:
                    continue
                deepest = limit[body, bodies.owner[two]]
                if deepest > -np.inf and _widest_gap(bodies, world, one, two) < deepest:
                    return step, body, bodies.owner[two]
    return -1, 0, 0
