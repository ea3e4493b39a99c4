"""What a pass of Newton's method on the whole structure takes: rates of λ, the tangent with them.

The tangent is K + μ M + ν R - Gᵀ λ' G; of λ' only what is not zero is taken from the rest.
"""

from typing import Any, NamedTuple

import numpy as np

from archfem.arrays import Array
from archfem.dynamics.stepping.elimination import Indices
from archfem.dynamics.stepping.panel_lu import Panels, eliminated
from archfem.dynamics.stepping.panel_solution import back
from archfem.dynamics.stepping.path_law import PathLaw
from archfem.joints.moving.compiled import computing


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
        closed: triangles of the tangent if all joints held tension and nothing slid.
        contact: w (n,).
        change: of it in a pass (n,).
        origin: of it, where a pass begins (n,).
        image: for intermediate results (n,).
        force: λ with which w is in balance (r,).
        wanted: λ that the gaps ask for (r,).
        along: change of the gaps in a pass (r,).
        move: change of λ in a pass (r,).
        before: gaps, λ and λ that the gaps ask for, where a pass begins (3, r).
        left: for rows of a block (r,), or for λ of points that hold.
        line: for coordinates of a block (n,).
        all: numbers of all rows, of all stretches, and of all rows of slips.
    """

    entries: Array
    rates: Array
    closed: Array
    contact: Array
    change: Array
    origin: Array
    image: Array
    force: Array
    wanted: Array
    along: Array
    move: Array
    before: Array
    left: Array
    line: Array
    all: tuple[Any, Any, Any]

    @classmethod
    def of(cls, law: PathLaw, panels: Panels, pairs: int) -> "Room":
        """Return room for a step.

        Args:
            law: of the joints.
            panels: the tangent with all joints closed.
            pairs: of rows that depend on each other.

        Raises:
            LinAlgError: that cannot be eliminated without row exchanges.
        """
        rows, size = np.arange(len(law.start)), int(panels.first[-1])
        known = rows, np.arange(len(law.stretches)), rows[len(law.stiffness) :].copy()
        contact, change, origin, image, line = np.zeros((5, size))
        force, wanted, along, move, left = np.zeros((5, len(rows)))
        closed = panels.base.copy()
        if not eliminated(panels, closed, image):
            raise np.linalg.LinAlgError("blocks with closed joints are not held by their inertia")
        return cls(
            np.zeros(len(closed)),
            np.zeros(pairs),
            closed,
            contact,
            change,
            origin,
            image,
            force,
            wanted,
            along,
            move,
            np.zeros((3, len(rows))),
            left,
            line,
            known,
        )


@computing
def rated(law, rates):  # type: ignore
    """Find derivatives of λ, in the order of the pairs.

    Args:
        law: `PathLaw`, which knows what joints carry.
        rates: filled (q,).
    """
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
def add_rated(system, along, result):  # type: ignore
    """Add the change of λ with that of the gaps, as its rates say.

    Args:
        system: `TangentSystem`.
        along: change of the gaps (r,).
        result: changed (r,).
    """
    rates, rows = system.room.rates, system.pairs.rows
    for pair in range(len(rates)):
        if rates[pair] != 0.0:
            result[rows[pair, 0]] += rates[pair] * along[rows[pair, 1]]


@computing
def resolved(system, vector, renew):  # type: ignore
    """Solve with the tangent in place, or with one of a pass before.

    Args:
        system: `TangentSystem`.
        vector: right side, then solution (n,).
        renew: whether to sum it up and eliminate it afresh.

    Returns:
        Whether it is regular.
    """
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
