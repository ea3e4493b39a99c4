"""Newton's method for a step on the whole structure, compiled: its passes.

A pass goes from contact w, and λ with which it is in balance, to where λ would be as its rates say.
The right side of it is what λ lacks, so that it leaves the balance as it is; and it ends where λ is
what the gaps ask for, as in `sliding_points`.
"""

import numba
import numpy as np

from archfem.dynamics.stepping.chain_newton import FALLS, LEAST, TRIES, WHOLE, lacking
from archfem.dynamics.stepping.newton_pass import holding, taken_out
from archfem.dynamics.stepping.panel_solution import back
from archfem.dynamics.stepping.path_forces import press, slide
from archfem.dynamics.stepping.small_problem import ROUNDED, SETTLED, largest
from archfem.dynamics.stepping.sparse_rows import add_rows, row_times
from archfem.dynamics.stepping.tangent_pass import add_rated, rated, resolved
from archfem.joints.moving.compiled import computing

SLOWLY = 0.03
"""Part of the error of λ that a pass by an earlier tangent may leave; else that is renewed."""


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
        renew = passes == 1 or (off > SLOWLY * last and off**2 > last * enough)
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
        rated(law, room.rates)
    for row in range(len(force)):
        force[row], room.along[row] = wanted[row], law.offset[row] - guess[row]
    add_rated(system, room.along, force)
    for k in range(len(contact)):
        contact[k] = right[k]
    add_rows(rows, range(len(force)), force, contact)
    if not resolved(system, contact, renew):
        return False
    for row in range(len(force)):
        moved = row_times(rows, row, contact)
        force[row], room.along[row] = wanted[row], moved + law.offset[row] - guess[row]
        guess[row] = moved + law.offset[row]
    add_rated(system, room.along, force)
    _asked(law, room)
    return True


@computing
def _direction(system, renew):  # type: ignore
    """Find changes of contact, gaps and λ in a pass; whether there are any."""
    room, rows = system.room, system.linear.opening
    if renew:
        rated(system.linear.law, room.rates)
    for row in range(len(room.force)):
        room.move[row] = room.wanted[row] - room.force[row]
    for k in range(len(room.change)):
        room.change[k] = 0.0
    add_rows(rows, range(len(room.move)), room.move, room.change)
    if not resolved(system, room.change, renew):
        return False
    for row in range(len(room.force)):
        room.along[row] = row_times(rows, row, room.change)
    add_rated(system, room.along, room.move)
    return True


@computing
def _went(system, careful):  # type: ignore
    """Go by these changes, or so far that λ errs less; returns what it errs by [N]."""
    law, room = system.linear.law, system.room
    total, share = lacking(room.force, room.wanted)[1], 1.0
    for row in range(len(room.force)):
        room.before[0, row] = law.guess[row]
        room.before[1, row], room.before[2, row] = room.force[row], room.wanted[row]
    for k in range(len(room.contact)):
        room.origin[k] = room.contact[k]
    while True:
        _go(system, share)
        off, left = lacking(room.force, room.wanted)
        if not careful or share <= LEAST or left <= (1.0 - FALLS * share) * total:
            return off
        share *= 0.5


@computing
def _go(system, share):  # type: ignore
    """Go a share of the changes; points that would turn round hold, and the rest follows."""
    law, room, rows = system.linear.law, system.room, system.linear.opening
    gaps, force, wanted = room.before
    for row in range(len(force)):
        law.guess[row] = gaps[row] + share * room.along[row]
        room.force[row] = force[row] + share * room.move[row]
    for k in range(len(room.contact)):
        room.contact[k] = room.origin[k] + share * room.change[k]
    if holding(wanted, room.force, room.left):
        for k in range(len(room.line)):
            room.line[k] = 0.0
        add_rows(rows, range(len(room.left)), room.left, room.line)
        back(system.panels, room.closed, room.line, room.image)
        for row in range(len(force)):
            law.guess[row] += row_times(rows, row, room.line)
        for k in range(len(room.contact)):
            room.contact[k] += room.line[k]
    _asked(law, room)


@computing
def _asked(law, room):  # type: ignore
    """Find λ that the gaps ask for."""
    press(law, law.guess, room.all[1])
    slide(law, law.guess, room.all[2])
    taken_out(law, room.all, room.wanted)
