"""The small problem of a step over which joints open and slide: Newton's method at its rows.

A joint that slides lowers its shear as it opens, but does not open as it slides: λ is not the
gradient of an energy, and the problem

    z = z₀ + F λ(z),

is not symmetric. It is solved by Newton's method, (1 - λ' F) μ = λ(z₀ + F λ) - λ for the change μ
of λ, in the rows that open or slide and in the openings that press on those, by a dense factor
where they are few and by minimal residuals (Saad and Schultz, SIAM J. Sci. Stat. Comput. 7 (1986)
856) in single precision where they are many and these converge: a pass only leads to the next.
Where some passes have not been enough, further ones go no farther than λ errs less; and where those
are not, λ is led from where it is known to where it is sought.
"""

import numpy as np

from archfem.dynamics.stepping.at_work import fits, foreseen
from archfem.dynamics.stepping.chain_newton import (
    FALLS,
    LEAST,
    TRIES,
    WHOLE,
    along_chain,
    lacking,
)
from archfem.dynamics.stepping.columns import add_gaps, begin, forget, keep, take_in
from archfem.dynamics.stepping.loop import ITERATIONS
from archfem.dynamics.stepping.newton_pass import (
    holding,
    lacking_at,
    newton_change,
    prepared,
    rates,
    taken_out,
)
from archfem.dynamics.stepping.path_forces import press, slide
from archfem.dynamics.stepping.path_law import PathLaw
from archfem.dynamics.stepping.small_problem import (
    ROUNDED,
    SETTLED,
    add_held,
    exact,
    expected,
    largest,
    release,
    shift,
    solved_by,
    unload,
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


def _released(law, start, rows, compliance, force, enough):  # type: ignore
    """Find λ where it may differ from zero, from the guess on.

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
    if not force.any():
        forget(compliance)
    own, passes = compliance.vectors.force, _found(law, start, rows, compliance, force, enough)
    for k in range(len(rows)):
        force[compliance.rows[k]] = own[k]
    return passes


def _unloading(law, gap, rows, compliance, force):  # type: ignore
    """Take from gaps what λ opens or moves."""
    _unloaded(law, gap, rows, compliance, force)


@computing
def _unloaded(law, gap, rows, compliance, force):  # type: ignore
    """Take from gaps what λ opens or moves."""
    begin(compliance, rows)
    taken, moved, own = compliance.vectors.force, compliance.vectors.free, compliance.rows
    for k in range(len(rows)):
        taken[k], moved[k] = force[own[k]], 0.0
    take_in(compliance, taken[: len(rows)], law.work.places, 0)
    add_gaps(compliance, taken, moved[: len(rows)])
    for k in range(len(rows)):
        gap[own[k]] -= moved[k]


@computing
def _found(law, start, rows, compliance, force, enough):  # type: ignore
    """Find λ of the rows from the guess on, at once or led there.

    Args:
        law: `PathLaw`.
        start: z₀ (p,).
        rows: numbers of the rows (k,).
        compliance: `Compliance`, in the room of which λ is left.
        force: λ of the last step, or as it was found last (p,).
        enough: error of λ that is left [N].

    Returns:
        Passes; -1 if it does not settle.
    """
    begin(compliance, rows)
    count, inside, slips, vectors = len(rows), _within(law, compliance.place), 0, compliance.vectors
    free, guess, own = vectors.free[:count], vectors.guess[:count], compliance.rows
    for k in range(count):
        vectors.force[k] = force[own[k]]
        free[k], guess[k] = start[own[k]], law.guess[own[k]]
        if own[k] >= len(law.stiffness):
            law.work.slips[slips] = own[k]
            slips += 1
    known = compliance.place, law.work.some[:inside], law.work.slips[:slips]
    _go(law, (own[:count], known), guess, vectors.wanted[:count])
    passes = _settled(law, (compliance, known), free, enough)
    return passes if passes > 0 else _led(law, (compliance, known), count, enough)


@computing
def _led(law, problem, size, enough):  # type: ignore
    """Lead λ from where it fits a guess to where it is sought, as far at once as it settles.

    What is added to z₀ so that the guess fits is taken away bit by bit.

    Args:
        law: `PathLaw`.
        problem: `Compliance`, in the room of which are z₀ and the guess of z; and what is known of
            the rows.
        size: how many there are.
        enough: error of λ that is left [N].

    Returns:
        Passes; -1 if it does not settle.
    """
    (compliance, known), done, share, passes = problem, 0.0, FIRST, ITERATIONS
    rows, vectors = compliance.rows[:size], compliance.vectors
    free, z, wanted = vectors.free[:size], vectors.guess[:size], vectors.wanted[:size]
    added, goal = vectors.added[:size], vectors.goal[:size]
    _go(law, (rows, known), z, wanted)
    take_in(compliance, wanted, law.work.places, 0)
    for k in range(size):
        added[k] = free[k] - z[k]
    add_gaps(compliance, wanted, added)
    while done < 1.0:
        end = min(done + share, 1.0)
        for k in range(size):
            goal[k] = free[k] - (1.0 - end) * added[k]
        taken = _settled(law, problem, goal, enough)
        passes += abs(taken)
        if taken > 0:
            done, share = end, 2.0 * share
            for k in range(size):
                z[k] = law.guess[rows[k]]
        else:
            share *= 0.25
            if share < LAST:
                return -1
            _go(law, (rows, known), z, wanted)
    return passes


@computing
def _settled(law, problem, free, enough):  # type: ignore
    """Find λ by Newton's method from the guess on, of which λ is wanted.

    At first λ lacks what the gaps are off the guess, later what they ask for. The equations are
    used again where the last pass promises that they are enough for the next, its error falling as
    much as before, and no row was added to them.

    Returns:
        Passes; -1 if it does not settle.
    """
    (compliance, known), size, off = problem, len(free), np.inf
    vectors, rows = compliance.vectors, compliance.rows
    own, wanted = vectors.force[:size], vectors.wanted[:size]
    rest, change = vectors.rest[:size], vectors.change[:size]
    entries, count = (law.work.places, law.work.values), rates(law, known)
    keep(compliance, own, wanted, entries[0], count)
    for k in range(size):
        own[k] = wanted[k]
    prepared(compliance, entries, count)
    for k in range(size):
        rest[k] = free[k] - law.guess[rows[k]]
    add_gaps(compliance, wanted, rest)
    lacking_at(rest, (entries, count), change)
    for passes in range(1, TRIES + 1):
        newton_change(change, (entries, count), compliance)
        last, off = off, _moved(law, problem, free, passes >= WHOLE)
        if off <= enough or last <= off <= ROUNDED * enough:
            return passes
        if not off < np.inf:
            return -1
        take_in(compliance, wanted, entries[0], 0)
        added = compliance.sizes[1] > compliance.sizes[3]
        if passes == 1 or added or off**2 > last * enough:
            count = rates(law, known)
            take_in(compliance, wanted, entries[0], count)
            prepared(compliance, entries, count)
        for k in range(size):
            change[k] = wanted[k] - own[k]
    return -1


@computing
def _moved(law, problem, free, careful):  # type: ignore
    """Move λ as Newton's method says, or so far that it errs less.

    Args:
        law: `PathLaw`.
        problem: `Compliance`, in the room of which are λ, what is wanted there and the change of
            that; and what is known of the rows.
        free: z₀ (k,).
        careful: whether to go less far where λ errs more than it did.

    Returns:
        Its error [N].
    """
    (compliance, known), size, share = problem, len(free), 1.0
    vectors = compliance.vectors
    own, wanted, move = vectors.force[:size], vectors.wanted[:size], vectors.change[:size]
    was, trial, z = vectors.was[:size], vectors.trial[:size], vectors.rest[:size]
    before = lacking(own, wanted)[1]
    for k in range(size):
        was[k] = wanted[k]
    while True:
        for k in range(size):
            trial[k], z[k] = own[k] + share * move[k], free[k]
        holding(was, trial, vectors.held[:size])
        add_gaps(compliance, trial, z)
        _go(law, (compliance.rows[:size], known), z, wanted)
        off, left = lacking(trial, wanted)
        if not careful or share <= LEAST or left <= (1.0 - FALLS * share) * before:
            for k in range(size):
                own[k] = trial[k]
            return off
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
    (expected, foreseen),
    (release, _released),
    (unload, _unloading),
    (exact, fits),
    (shift, _shifted),
    (largest, _largest),
    (add_held, _held),
)


@computing
def _within(law, local):  # type: ignore
    """Name the stretches of which both ends are among the rows; how many."""
    inside, count, stretches = law.work.some, 0, law.stretches
    for number in range(len(stretches)):
        if local[stretches[number].near] >= 0 and local[stretches[number].far] >= 0:
            inside[count] = number
            count += 1
    return count
