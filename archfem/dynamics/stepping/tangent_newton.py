"""Newton's method for a step on the whole structure, compiled: its passes.

A pass goes from contact w, and λ with which it is in balance, to where λ would be as its rates say.
The right side of it is what λ lacks, so that it leaves the balance as it is; and it ends where λ is
what the gaps ask for, as in `sliding_points`.
"""

from typing import Any, NamedTuple

import numba
import numpy as np

from archfem.arrays import Array
from archfem.dynamics.stepping.chain_newton import FALLS, LEAST, TRIES, WHOLE, lacking
from archfem.dynamics.stepping.elimination import Indices
from archfem.dynamics.stepping.newton_pass import taken_out
from archfem.dynamics.stepping.panel_lu import back, eliminated
from archfem.dynamics.stepping.path_forces import press, slide
from archfem.dynamics.stepping.path_law import PathLaw
from archfem.dynamics.stepping.small_problem import ROUNDED, SETTLED, largest
from archfem.dynamics.stepping.sparse_rows import row_times
from archfem.joints.moving.compiled import computing

SLOWLY = 0.1
"""Part of the error of λ that a pass by an earlier tangent may leave; else that is renewed."""


class Pairs(NamedTuple):
    """Rows of gaps of which one changes the force at another.

    Those of which both move the same coordinates as those of others make a block with them.

    Attributes:
        rows: at which it changes, and by which (q, 2).
        sorted: their numbers, block by block (q,).
        first: where in that the blocks begin (b + 1,).
        others: rows by which it changes in each block (o,).
        other: where in those the blocks begin (b + 1,).
        local: which of the block's own it is, in the order of `sorted` (q,).
        begin: where in `places` the entries of the blocks begin (b + 1,).
        places: entries of the tangent, coordinates of the former by those of the latter.
    """

    rows: Indices
    sorted: Indices
    first: Indices
    others: Indices
    other: Indices
    local: Indices
    begin: Indices
    places: Indices


class Room(NamedTuple):
    """Room for what is found in a step.

    Attributes:
        entries: of the tangent, or of its triangles.
        rates: derivatives of λ, of each pair of rows (q,) [N/m].
        contact: w (n,).
        change: of it in a pass (n,).
        image: for intermediate results (n,).
        force: λ with which w is in balance (r,).
        wanted: λ that the gaps ask for (r,).
        along: change of the gaps in a pass (r,).
        move: change of λ in a pass (r,).
        left: for rows of a block (r,).
        line: for coordinates of a block (n,).
        all: numbers of all rows, of all stretches, and of all rows of slips.
    """

    entries: Array
    rates: Array
    contact: Array
    change: Array
    image: Array
    force: Array
    wanted: Array
    along: Array
    move: Array
    left: Array
    line: Array
    all: tuple[Any, Any, Any]

    @classmethod
    def of(cls, law: PathLaw, size: int, entries: int, pairs: int) -> "Room":
        """Return room for a step.

        Args:
            law: of the joints.
            size: how many coordinates there are.
            entries: of the tangent.
            pairs: of rows that depend on each other.
        """
        rows = np.arange(len(law.start))
        known = rows, np.arange(len(law.stretches)), rows[len(law.stiffness) :].copy()
        contact, change, image, line = np.zeros((4, size))
        force, wanted, along, move, left = np.zeros((5, len(rows)))
        return cls(
            np.zeros(entries),
            np.zeros(pairs),
            contact,
            change,
            image,
            force,
            wanted,
            along,
            move,
            left,
            line,
            known,
        )


@numba.njit(cache=True)
def sought(system, right, gap, force):  # type: ignore
    """Find the contact in a step.

    Args:
        system: `TangentSystem`.
        right: side of the equation of the step, then w (n,).
        gap: z of the last step, then of this (r,) [m].
        force: λ, filled (r,) [N].

    Returns:
        Passes; -1 if they do not settle.
    """
    law, room = system.linear.law, system.room
    enough, taken, afresh = SETTLED * largest(law, gap), 0, True
    for row in range(len(force)):
        afresh = afresh and force[row] == 0.0
    for whole in (WHOLE, 1):
        passes = _settled(system, right, gap, (enough, whole), afresh or taken > 0)
        taken += abs(passes)
        if passes > 0:
            for k in range(len(right)):
                right[k] = room.contact[k]
            for row in range(len(gap)):
                gap[row], force[row] = law.guess[row], room.force[row]
            return taken
    return -1


@computing
def _settled(system, right, gap, until, afresh):  # type: ignore
    """Take passes until λ is what the gaps ask for; how many, less than 0 if it is not."""
    law, (enough, whole) = system.linear.law, until
    for row in range(len(gap)):
        law.guess[row] = law.start[row] + law.speed[row] / law.gain
    _asked(law, system.room)
    if not _first(system, right, afresh):
        return -1
    last, off = largest(law, law.guess), lacking(system.room.force, system.room.wanted)[0]
    for passes in range(1, TRIES + 1):
        if off <= enough or last <= off <= ROUNDED * enough:
            return passes
        renew = off > SLOWLY * last and off**2 > last * enough
        if not off < np.inf or not _direction(system, renew):
            return -passes
        last, off = off, _went(system, passes >= whole)
    return -TRIES


@computing
def _first(system, right, renew):  # type: ignore
    """Go from a guess of the gaps to contact in balance, λ as its rates say; whether it is."""
    law, room, rows = system.linear.law, system.room, system.linear.opening
    wanted, force, guess, contact = room.wanted, room.force, law.guess, room.contact
    if renew:
        _rated(law, room.rates)
    for row in range(len(force)):
        force[row], room.along[row] = wanted[row], law.offset[row] - guess[row]
    _add_rated(system, room.along, force)
    for k in range(len(contact)):
        contact[k] = right[k]
    _add_forces(rows, force, contact)
    if not _resolved(system, contact, renew):
        return False
    for row in range(len(force)):
        moved = row_times(rows, row, contact)
        force[row], room.along[row] = wanted[row], moved + law.offset[row] - guess[row]
        guess[row] = moved + law.offset[row]
    _add_rated(system, room.along, force)
    _asked(law, room)
    return True


@computing
def _direction(system, renew):  # type: ignore
    """Find changes of contact, gaps and λ in a pass; whether there are any."""
    room, rows = system.room, system.linear.opening
    if renew:
        _rated(system.linear.law, room.rates)
    for row in range(len(room.force)):
        room.move[row] = room.wanted[row] - room.force[row]
    for k in range(len(room.change)):
        room.change[k] = 0.0
    _add_forces(rows, room.move, room.change)
    if not _resolved(system, room.change, renew):
        return False
    for row in range(len(room.force)):
        room.along[row] = row_times(rows, row, room.change)
    _add_rated(system, room.along, room.move)
    return True


@computing
def _went(system, careful):  # type: ignore
    """Go by these changes, or so far that λ errs less; returns what it errs by [N]."""
    law, room = system.linear.law, system.room
    before, share, gone = lacking(room.force, room.wanted)[1], 1.0, 0.0
    while True:
        for row in range(len(room.force)):
            law.guess[row] += (share - gone) * room.along[row]
            room.force[row] += (share - gone) * room.move[row]
        for k in range(len(room.contact)):
            room.contact[k] += (share - gone) * room.change[k]
        _asked(law, room)
        off, total = lacking(room.force, room.wanted)
        if not careful or share <= LEAST or total <= (1.0 - FALLS * share) * before:
            return off
        share, gone = 0.5 * share, share


@computing
def _asked(law, room):  # type: ignore
    """Find λ that the gaps ask for."""
    press(law, law.guess, room.all[1])
    slide(law, law.guess, room.all[2])
    taken_out(law, room.all, room.wanted)


@computing
def _rated(law, rates):  # type: ignore
    """Find derivatives of λ, in the order of the pairs."""
    carried, place = law.work.stretches, 0
    for number in range(len(carried)):
        found = carried[number]
        rates[place], rates[place + 3] = found.first, found.last
        rates[place + 1] = rates[place + 2] = found.mixed
        place += 4
    points, pressed, members, first = law.points, law.work.points, law.members, law.first
    for group in range(len(law.along)):
        rates[place], last = law.work.along[group, 1], -1
        place += 1
        for member in range(first[group], first[group + 1]):
            point, passed = points[members[member]], pressed[members[member]]
            if point.stretch != last:
                rates[place], rates[place + 1], last = 0.0, 0.0, point.stretch
                place += 2
            if passed.by_limit != 0.0:
                factor = passed.by_limit * point.friction
                rates[place - 2] += factor * (point.near - passed.near)
                rates[place - 1] += factor * (point.far - passed.far)


@computing
def _add_rated(system, along, result):  # type: ignore
    """Add the change of λ with that of the gaps, as its rates say."""
    rates, rows = system.room.rates, system.pairs.rows
    for pair in range(len(rates)):
        if rates[pair] != 0.0:
            result[rows[pair, 0]] += rates[pair] * along[rows[pair, 1]]


@computing
def _add_forces(rows, force, result):  # type: ignore
    """Add what forces at the rows of gaps do to the coordinates."""
    indptr, indices, data = rows
    for row in range(len(force)):
        if force[row] != 0.0:
            for entry in range(indptr[row], indptr[row + 1]):
                result[indices[entry]] += data[entry] * force[row]


@computing
def _resolved(system, vector, renew):  # type: ignore
    """Solve with the tangent in place, or with one of a pass before; whether it is regular."""
    room = system.room
    if renew:
        _summed(system)
        if not eliminated(system.panels, room.entries, room.image):
            return False
    back(system.panels, room.entries, vector, room.image)
    return True


@computing
def _summed(system):  # type: ignore
    """Sum up the tangent, K + μ M + ν R - Gᵀ λ' G."""
    entries, rates, pairs = system.room.entries, system.room.rates, system.pairs
    for k in range(len(entries)):
        entries[k] = system.panels.base[k]
    for block in range(len(pairs.begin) - 1):
        for member in range(pairs.first[block], pairs.first[block + 1]):
            if rates[pairs.sorted[member]] != 0.0:
                _take_block(system, block)
                break


@computing
def _take_block(system, block):  # type: ignore
    """Take from the tangent what the pairs of a block change."""
    room, pairs = system.room, system.pairs
    entries, rates, left, line = room.entries, room.rates, room.left, room.line
    indptr, _, data = system.linear.opening
    first, last, place = pairs.first[block], pairs.first[block + 1], pairs.begin[block]
    others = pairs.others[pairs.other[block] : pairs.other[block + 1]]
    row = pairs.rows[pairs.sorted[first], 0]
    width = indptr[others[0] + 1] - indptr[others[0]]
    for i in range(indptr[row + 1] - indptr[row]):
        for k in range(len(others)):
            left[k] = 0.0
        for member in range(first, last):
            pair = pairs.sorted[member]
            left[pairs.local[member]] += rates[pair] * data[indptr[pairs.rows[pair, 0]] + i]
        for j in range(width):
            line[j] = 0.0
        for k in range(len(others)):
            factor, start = left[k], indptr[others[k]]
            for j in range(width):
                line[j] += factor * data[start + j]
        for j in range(width):
            entries[pairs.places[place + j]] -= line[j]
        place += width
