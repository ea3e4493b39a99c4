"""The small problem of a step in a chain of blocks: Newton's method in the band of its joints.

Passes start from a guess z of the gaps and λ(z). The first leads to gaps in balance with λ as its
rates say; each further one takes what λ lacks of what the gaps ask for.
"""

from typing import Any

import numpy as np

from archfem.dynamics.stepping.newton_pass import rates, taken_out
from archfem.dynamics.stepping.path_forces import press, slide
from archfem.joints.moving.compiled import computing

NARROW = 5
"""Half-width of the band of stones whose joints have a row at each edge and one along."""

WHOLE = 4
"""Passes that take whole steps anyhow."""

TRIES = 16
"""Passes after which λ is led to where it is sought."""

LEAST = 1.0 / 32.0
"""Share of a step that is taken even if λ errs more after it."""

FALLS = 0.1
"""Part by which the square of the error of λ has to fall with a whole step."""


@computing
def along_chain(law, start, until):  # type: ignore
    """Take passes from the guess on until λ is what the gaps ask for.

    Args:
        law: `PathLaw`, with a chain.
        start: z₀ (r,) [m].
        until: error of λ that ends them [N], and the factor by which more may be left once it does
            not fall any further.

    Returns:
        Passes; -1 if it does not settle. What is found is the first of the rooms, in the order of
        the band, and the guess.
    """
    chain, guess = law.chain, law.guess
    (force, wanted, _, along), right, off = chain.rooms, chain.right, np.inf
    _asked(law, wanted)
    for k in range(len(wanted)):
        row = chain.order[k]
        along[k], force[k] = start[row] - guess[row], wanted[k]
    _times(chain.closed, along, right, False)
    _times(chain.loose, wanted, right, True)
    for passes in range(1, TRIES + 1):
        _direction(law, passes == 1)
        last, off = off, _went(law, passes >= WHOLE)
        if off <= until[0] or last <= off <= until[1] * until[0]:
            return passes
        if not off < np.inf:
            return -1
        for k in range(len(wanted)):
            chain.rooms[2, k] = wanted[k] - force[k]
        _times(chain.loose, chain.rooms[2], right, False)
    return -1


@computing
def _times(band, vector, result, adds):  # type: ignore
    """Multiply a band by a vector."""
    half, size = band.shape[1] // 2, len(vector)
    for i in range(size):
        total, row = result[i] if adds else 0.0, band[i]
        first = max(half - i, 0)
        for k in range(first, min(2 * half + 1, half + size - i)):
            total += row[k] * vector[i - half + k]
        result[i] = total


@computing
def _direction(law, first):  # type: ignore
    """Find changes of gaps and λ in a pass from its right side."""
    chain = law.chain
    count, size, right = rates(law, chain.known), len(chain.order), chain.right
    _summed(chain, (law.work.places, law.work.values), count)
    for k in range(chain.half):
        right[size + k] = 0.0
    if chain.half == NARROW:
        _narrow(chain.matrix, right)
    else:
        _solve(chain.matrix, right, chain.half)
    move, along = chain.rooms[2], chain.rooms[3]
    for k in range(size):
        along[k] = right[k]
        if first:
            move[k] = 0.0
    places, values = law.work.places, law.work.values
    for entry in range(count):
        move[places[entry, 0]] += values[entry] * along[places[entry, 1]]


@computing
def _summed(chain, entries, count):  # type: ignore
    """Fill 1 + F₀ (K - λ')."""
    matrix, closed, loose, half = chain.matrix, chain.closed, chain.loose, chain.half
    size, (places, values) = len(chain.order), entries
    for i in range(size):
        row, base = matrix[i], closed[i]
        for k in range(2 * half + 1):
            row[k] = base[k]
    for entry in range(count):
        row, column, value = places[entry, 0], places[entry, 1], values[entry]
        first = max(row, column) - half
        last = min(row, column) + half
        for i in range(max(first, 0), min(last + 1, size)):
            matrix[i, half + column - i] -= loose[i, half + row - i] * value
    for i in range(size, size + half):
        for k in range(2 * half + 1):
            matrix[i, k] = 1.0 if k == half else 0.0


def _solving(half: int | None) -> Any:
    """Return what solves a system of a band in place, by Gauss's elimination without exchanges.

    Rows go on beyond the end. If the half-width is known as this is compiled it takes half as long.

    Args:
        half: of the band, None where it is given with each system.

    Returns:
        A function of the band (r + h, 2 h + 1), the right side (r + h,) and the half-width.
    """

    def solve(matrix, right, given):  # type: ignore
        wide = given if half is None else half
        for k in range(len(right) - wide):
            top, inverse = matrix[k, wide + 1 : 2 * wide + 1], 1.0 / matrix[k, wide]
            matrix[k, wide] = inverse
            for down in range(1, wide + 1):
                row = matrix[k + down]
                factor, low = row[wide - down] * inverse, row[wide - down + 1 : 2 * wide - down + 1]
                for j in range(wide):
                    low[j] -= factor * top[j]
                right[k + down] -= factor * right[k]
        for k in range(len(right) - wide - 1, -1, -1):
            total, top, known = right[k], matrix[k, wide + 1 :], right[k + 1 : k + 1 + wide]
            for j in range(wide):
                total -= top[j] * known[j]
            right[k] = total * matrix[k, wide]

    return solve


_solve = computing(_solving(None))

_narrow_solve = computing(_solving(NARROW))


@computing
def _narrow(matrix, right):  # type: ignore
    """Solve in the band of a ring."""
    _narrow_solve(matrix, right, NARROW)


@computing
def _went(law, careful):  # type: ignore
    """Go by the changes, or so far that λ errs less; returns the largest error of it [N]."""
    chain, share, gone = law.chain, 1.0, 0.0
    force, wanted, move, along = chain.rooms
    before, order, guess = lacking(force, wanted)[1], chain.order, law.guess
    while True:
        for k in range(len(order)):
            guess[order[k]] += (share - gone) * along[k]
            force[k] += (share - gone) * move[k]
        _asked(law, wanted)
        off, total = lacking(force, wanted)
        if not careful or share <= LEAST or total <= (1.0 - FALLS * share) * before:
            return off
        share, gone = 0.5 * share, share


@computing
def _asked(law, wanted):  # type: ignore
    """Find λ that the gaps ask for."""
    known = law.chain.known
    press(law, law.guess, known[1])
    slide(law, law.guess, known[2])
    taken_out(law, known, wanted)


@computing
def lacking(force, wanted):  # type: ignore
    """Return the largest error of λ, and the sum of their squares.

    Args:
        force: λ (r,) [N].
        wanted: that the gaps ask for (r,) [N].
    """
    most, total = 0.0, 0.0
    for k in range(len(force)):
        off = wanted[k] - force[k]
        total += off**2
        if not abs(off) <= most:
            most = abs(off)
    return most, total
