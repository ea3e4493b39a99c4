"""Impulses of one step as a start for those of the next, found again by a table of keys."""

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from archfem.arrays import Array
from archfem.dynamics.falling.contact import Contacts

MIXING = 0x9E3779B1
"""Odd number by which keys are multiplied to scatter them: 2³² over the golden ratio."""


class Carried(NamedTuple):
    """Impulses of the step before.

    Attributes:
        key: of the two pieces at each contact (c,).
        place: of the contact along the tangent, from the first body's centroid (c,) [m].
        impulse: there (c, 2) [N s].
        slots: number of a contact by a hash of its key, -1 where there is none (2^m,).
    """

    key: NDArray[np.int64]
    place: Array
    impulse: Array
    slots: NDArray[np.int64]


def nothing_carried(room: Contacts) -> Carried:
    """Return the start of a run, where no impulse is known.

    Args:
        room: for the contacts of a step.
    """
    most = len(room.key)
    return Carried(
        np.zeros(most, dtype=np.int64),
        np.zeros(most),
        np.zeros((most, 2)),
        np.full(1 << int(2 * most).bit_length(), -1, dtype=np.int64),
    )


@numba.njit(cache=True)
def keep(bodies, q, found, count, carried):  # type: ignore
    """Keep the impulses of a step.

    Args:
        bodies: that touch.
        q: poses at which contacts were found (b, 3).
        found: contacts and their impulses.
        count: of them.
        carried: filled.
    """
    slots = carried.slots
    slots[:] = -1
    for k in range(count):
        carried.key[k] = found.key[k]
        carried.place[k] = _place(bodies, q, found, k)
        carried.impulse[k] = found.impulse[k]
        slot = _slot(found.key[k], len(slots))
        while slots[slot] >= 0:
            slot = (slot + 1) % len(slots)
        slots[slot] = k


@numba.njit(cache=True)
def recall(bodies, q, found, count, carried):  # type: ignore
    """Give contacts the impulses that the nearest of the same pieces had, each once.

    Args:
        bodies: that touch.
        q: poses at which contacts were found (b, 3).
        found: contacts; their impulses are filled.
        count: of them.
        carried: of the step before; the keys of what is found are taken out.
    """
    slots = carried.slots
    for k in range(count):
        found.impulse[k] = 0.0
        place, best, least = _place(bodies, q, found, k), -1, np.inf
        slot = _slot(found.key[k], len(slots))
        while slots[slot] >= 0:
            old = slots[slot]
            off = abs(carried.place[old] - place)
            if carried.key[old] == found.key[k] and off < least:
                best, least = old, off
            slot = (slot + 1) % len(slots)
        if best >= 0:
            found.impulse[k] = carried.impulse[best]
            carried.key[best] = -1


@numba.njit(cache=True)
def _slot(key, size):  # type: ignore
    """Where the search for a key begins."""
    return ((key * MIXING) >> 16) & (size - 1)


@numba.njit(cache=True)
def _place(bodies, q, found, k):  # type: ignore
    """Place of a contact along its tangent, from the first body's centroid."""
    body = found.bodies[k, 0]
    rx = found.point[k, 0] - bodies.centre[body, 0] - q[body, 0]
    ry = found.point[k, 1] - bodies.centre[body, 1] - q[body, 1]
    return ry * found.normal[k, 0] - rx * found.normal[k, 1]
