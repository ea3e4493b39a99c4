"""The small problem of a step over which joints open and slide: Newton's method at its rows.

A joint that slides lowers its shear as it opens, but does not open as it slides: λ is not the
gradient of an energy, and the problem

    z = z₀ + F λ(z),

is not symmetric. It is solved by Newton's method, (1 - F λ') δ = z₀ + F λ - z, in the rows that
open or slide and in the openings that press on those, by a dense factor where they are few and by
stabilised biconjugate gradients (van der Vorst, SIAM J. Sci. Stat. Comput. 13 (1992) 631) where
they are many and these converge. Where some passes have not been enough, further ones go no
farther than λ errs less; and where those are not, λ is led from where it is known to where it is
sought.
"""

import numba
import numpy as np

from archfem.dynamics.stepping.chain_newton import FALLS, LEAST, TRIES, WHOLE, along_chain
from archfem.dynamics.stepping.columns import add_gaps, no_columns, take_in
from archfem.dynamics.stepping.loop import ITERATIONS
from archfem.dynamics.stepping.newton_pass import holding, newton_change, prepared, rates, taken_out
from archfem.dynamics.stepping.open_points import chosen
from archfem.dynamics.stepping.path_forces import press, slide
from archfem.dynamics.stepping.path_law import PathLaw
from archfem.dynamics.stepping.small_problem import (
    AHEAD,
    EXACT,
    ROUNDED,
    SETTLED,
    add_held,
    exact,
    expected,
    largest,
    release,
    shift,
    solved_by,
)
from archfem.dynamics.stepping.sparse_rows import add_rows
from archfem.joints.moving.compiled import computing

FIRST, LAST = 0.25, 1e-4
"""Shares of its way that λ is led at first, and at least."""

ROUNDING = 4.0 * np.finfo(float).eps / SETTLED
"""Of what a slip rounds to, in the errors of λ that end the passes."""


def _shifted(law, gap):  # type: ignore
    """Add to gaps found from displacements those before anything moves."""
    offset = law.offset
    for row in range(len(gap)):
        gap[row] += offset[row]


def _held(law, opening, right):  # type: ignore
    """Add to a right side what joints would carry more had nothing slid before the step."""
    force, points = np.zeros(len(law.start)), law.points
    for k in range(len(points)):
        if points[k].group >= 0:
            force[points[k].group] += points[k].elastic * points[k].slid
    add_rows(opening, range(len(force)), force, right)


def _largest(law, gap):  # type: ignore
    """Return the largest force of a point if all joints held tension, or what rounds as that does.

    What a slip rounds to, times its stiffness, is all that λ can be told to where points slide, and
    is more than all forces where they have slid far.
    """
    most, openings, stiffness, along = 0.0, len(law.stiffness), law.stiffness, law.along
    for row in range(openings):
        most = max(most, stiffness[row] * abs(gap[row]))
    for row in range(openings, len(gap)):
        most = max(most, ROUNDING * along[row - openings] * abs(gap[row]))
    return most


def _foreseen(law, gap, before, force):  # type: ignore
    """Return which rows are at work, or will be soon if they go on as they did (r,)."""
    works, near, openings = force != 0.0, force != 0.0, len(law.stiffness)
    if law.chain.half > 0:
        near[:] = True
    guess, start, speed, points = law.guess, law.start, law.speed, law.points
    for row in range(len(gap)):
        guess[row] = start[row] + speed[row] / law.gain
        if row < openings and gap[row] + AHEAD * (gap[row] - before[row]) > 0.0:
            works[row] = True
    if law.chain.half > 0:
        return near
    for part in law.stretches:
        if works[part.near] or works[part.far]:
            near[part.near] = near[part.far] = True
            for k in range(part.begin, part.end):
                if points[k].group >= 0:
                    near[points[k].group] = True
    _work_at(law, guess, near, True)
    return near


@computing
def _involve(law, near):  # type: ignore
    """Add to rows of slips at work the openings that press on their points."""
    points, stretches = law.points, law.stretches
    for k in range(len(points)):
        if points[k].group >= 0 and near[points[k].group]:
            stretch = stretches[points[k].stretch]
            near[stretch.near] = near[stretch.far] = True


def _fits(law, gap, force, near):  # type: ignore
    """Return whether the gaps ask for the λ they were found with; adds rows at work to near.

    Of rows that are near, λ is known to fit the guess, so that the gaps need but be that.
    """
    across, along, guess, off = law.stiffness, law.along, law.guess, 0.0
    for row in range(len(gap)):
        if near[row]:
            stiffness = across[row] if row < len(across) else along[row - len(across)]
            off = max(off, stiffness * abs(gap[row] - guess[row]))
        guess[row] = gap[row]
    whole = off > EXACT * largest(law, gap)
    if _work_at(law, gap, near, whole):
        return not whole
    return False


@numba.njit(cache=True)
def _work_at(law, gap, near, whole):  # type: ignore
    """Add to near what further rows are at work at some gaps.

    Looks at all rows if it is to, else at those that are not near.

    Returns:
        Whether there are none.
    """
    openings, more = len(law.stiffness), False
    stretches, slips = _others(law, near, whole)
    press(law, gap, stretches)
    slide(law, gap, slips)
    parts, found, along = law.stretches, law.work.stretches, law.work.along
    for number in stretches:
        part, carried = parts[number], found[number]
        if carried.near != 0.0 or carried.far != 0.0:
            more = more or not (near[part.near] and near[part.far])
            near[part.near] = near[part.far] = True
    for row in slips:
        if along[row - openings, 0] != 0.0:
            more = more or not near[row]
            near[row] = True
    _involve(law, near)
    return not more


@numba.njit(cache=True)
def _others(law, near, whole):  # type: ignore
    """Numbers of stretches of which not both ends are near, and of slips that are not."""
    openings, stretches = len(law.stiffness), law.stretches
    wanted = np.empty(len(stretches), dtype=np.bool_)
    for number in range(len(stretches)):
        part = stretches[number]
        wanted[number] = whole or not (near[part.near] and near[part.far])
    far = np.ones(len(near) - openings, dtype=np.bool_)
    for row in range(openings, len(near)):
        far[row - openings] = whole or not near[row]
    return np.flatnonzero(wanted), openings + np.flatnonzero(far)


def _released(law, start, rows, compliance, force, enough):  # type: ignore
    """Find λ where it may differ from zero, from the guess on, at which what joints carry is known.

    Returns:
        Passes; -1 if it does not settle.
    """
    if law.chain.half > 0:
        found = along_chain(law, start, (enough, ROUNDED))
        if found > 0:
            for k in range(len(force)):
                force[law.chain.order[k]] = law.chain.rooms[0, k]
            return found
        for row in range(len(start)):
            law.guess[row] = law.start[row] + law.speed[row] / law.gain
    local = np.full(len(start), -1)
    for k in range(len(rows)):
        local[rows[k]] = k
    known = local, _within(law.stretches, local), rows[np.searchsorted(rows, len(law.stiffness)) :]
    own, z, free = np.zeros(len(rows)), chosen(law.guess, rows), chosen(start, rows)
    problem = (compliance, no_columns(rows), known)
    passes = _settled(law, problem, free, own, enough)
    if passes < 0:
        passes = _led(law, problem, (free, z), own, enough)
    for k in range(len(rows)):
        force[rows[k]] = own[k]
    return passes


@numba.njit(cache=True)
def _led(law, problem, ends, own, enough):  # type: ignore
    """Lead λ from where it fits a guess to where it is sought, as far at once as it settles.

    What is added to z₀ so that the guess fits is taken away bit by bit.

    Args:
        law: `PathLaw`.
        problem: F (p, p), the rows' columns of it, and what is known of them.
        ends: z₀ (k,) and the guess of z (k,).
        own: filled with λ (k,).
        enough: error of λ that is left [N].

    Returns:
        Passes; -1 if it does not settle.
    """
    (compliance, columns, known), (free, z), rows = problem, ends, problem[1].rows
    _go(law, (rows, known), z, own)
    take_in(columns, compliance, own, law.work.places, 0)
    added, done, share, passes = free - z, 0.0, FIRST, ITERATIONS
    add_gaps(columns, own, added)
    while done < 1.0:
        goal = min(done + share, 1.0)
        taken = _settled(law, problem, free - (1.0 - goal) * added, own, enough)
        passes += abs(taken)
        if taken > 0:
            done, share, z = goal, 2.0 * share, chosen(law.guess, rows)
        else:
            share *= 0.25
            if share < LAST:
                return -1
            _go(law, (rows, known), z, own)
    return passes


@numba.njit(cache=True)
def _settled(law, problem, free, own, enough):  # type: ignore
    """Find λ by Newton's method from the guess on.

    A factor is used again where the last pass promises that it is enough for the next, its error
    falling as much as before.

    Returns:
        Passes; -1 if it does not settle.
    """
    (compliance, columns, known), size = problem, len(free)
    wanted, room, off = np.empty(size), np.empty(size**2), np.inf
    taken_out(law, known, wanted)
    own[:] = wanted
    entries, count = (law.work.places, law.work.values), rates(law, known)
    take_in(columns, compliance, wanted, entries[0], count)
    system = prepared(columns, entries, count, room)
    for passes in range(1, TRIES + 1):
        rest = free - chosen(law.guess, columns.rows)
        add_gaps(columns, wanted, rest)
        change = newton_change(rest, (entries, count), (columns, system))
        last, off = off, _moved(law, problem, free, (own, wanted, change), passes >= WHOLE)
        if off <= enough or last <= off <= ROUNDED * enough:
            return passes
        if not off < np.inf:
            return -1
        renew = passes == 1 or off**2 > last * enough
        count = rates(law, known) if renew else count
        take_in(columns, compliance, wanted, entries[0], count)
        if renew:
            system = prepared(columns, entries, count, room)
    return -1


@numba.njit(cache=True)
def _moved(law, problem, free, forces, careful):  # type: ignore
    """Move λ as Newton's method says, or so far that it errs less.

    Args:
        law: `PathLaw`.
        problem: F (p, p), the rows' columns of it, and what is known of them.
        free: z₀ (k,).
        forces: λ and what is wanted there, both changed, and the change of that (k,).
        careful: whether to go less far where λ errs more than it did.

    Returns:
        Its error [N].
    """
    (_, columns, known), (own, wanted, change) = problem, forces
    move, before, share = wanted + change - own, np.sum((wanted - own) ** 2), 1.0
    was, held = wanted.copy(), np.empty(len(own))
    while True:
        trial, z = own + share * move, free.copy()
        holding(was, trial, held)
        add_gaps(columns, trial, z)
        _go(law, (columns.rows, known), z, wanted)
        error = wanted - trial
        if not careful or share <= LEAST or np.sum(error**2) <= (1.0 - FALLS * share) * before:
            own[:] = trial
            return np.max(np.abs(error))
        share *= 0.5


@computing
def _go(law, known, z, wanted):  # type: ignore
    """Take gaps of the rows as the guess, and find λ that they ask for."""
    (rows, among), guess = known, law.guess
    for k in range(len(rows)):
        guess[rows[k]] = z[k]
    press(law, guess, among[1])
    slide(law, guess, among[2])
    taken_out(law, among, wanted)


solved_by(
    PathLaw,
    (expected, _foreseen),
    (release, _released),
    (exact, _fits),
    (shift, _shifted),
    (largest, _largest),
    (add_held, _held),
)


@numba.njit(cache=True)
def _within(stretches, local):  # type: ignore
    """Numbers of the stretches of which both ends are among the rows."""
    inside = np.empty(len(stretches), dtype=np.bool_)
    for number in range(len(stretches)):
        part = stretches[number]
        inside[number] = local[part.near] >= 0 and local[part.far] >= 0
    return np.flatnonzero(inside)
