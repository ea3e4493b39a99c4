"""The compliance of the joints of a structure, and room for the small problems that need it.

Rooms are for as many rows as the structure has; only what problems use of them takes memory. They
are there from the first step on, for what is made anew in each pass takes longer to come by than to
fill.
"""

from typing import NamedTuple

import numpy as np

from archfem.arrays import Array
from archfem.dynamics.stepping.elimination import Indices
from archfem.joints.moving.compiled import viewing

NARROW = 64
"""Columns for which there is room at first."""

DEEP = 48
"""Products with a matrix after which its factor takes no longer."""


class Vectors(NamedTuple):
    """Room for vectors of the rows of a problem, each (p,).

    Attributes:
        force: λ.
        wanted: λ that the gaps ask for.
        change: of that in a pass, then of λ.
        rest: what the equations lack, then gaps.
        was: λ that the gaps asked for before a pass.
        trial: λ that is tried.
        held: change of λ where points hold.
        free: z₀.
        guess: of z.
        added: to z₀ so that the guess fits.
        goal: z₀ with some of that.
        column: of the columns instead, λ or a right side.
    """

    force: Array
    wanted: Array
    change: Array
    rest: Array
    was: Array
    trial: Array
    held: Array
    free: Array
    guess: Array
    added: Array
    goal: Array
    column: Array


class Compliance(NamedTuple):
    """F of a structure, and room for the small problems that need some of it.

    Attributes:
        whole: F (p, p), symmetric, of which the rows at work are filled.
        entries: of its rows and columns at work, row by row (p²,).
        rows: numbers of the former in the structure (p,).
        place: which of them each row of the structure is, -1 if none (p,).
        places: which of the rows each column is (p,).
        column: which column each of the rows is, -1 if none (p,).
        sizes: how many rows there are, how many columns, for how many of these there is room, and
            how many the equations have (4,).
        needed: whether a row of the structure, or of the problem, is needed; else False (p,).
        matrix: of the equations (p²,).
        rough: the same in single precision (p²,).
        exchanges: of rows in a factor (p,).
        basis: vectors to find a solution among, in single precision (d + 1, p).
        upper: triangle of the equations for their shares (d, d).
        turned: rotations that lead to it, and the right side (d, 2), (d + 1,).
        vectors: of the rows.
    """

    whole: Array
    entries: Array
    rows: Indices
    place: Indices
    places: Indices
    column: Indices
    sizes: Indices
    needed: Array
    matrix: Array
    rough: Array
    exchanges: Indices
    basis: Array
    upper: Array
    turned: tuple[Array, Array]
    vectors: Vectors

    @classmethod
    def of(cls, whole: Array) -> "Compliance":
        """Return room for the problems of a structure.

        Args:
            whole: F (p, p).
        """
        size = len(whole)
        rows, places, column, exchanges = (np.empty(size, np.int64) for _ in range(4))
        return cls(
            whole,
            np.empty(size**2),
            rows,
            np.full(size, -1),
            places,
            column,
            np.array([0, 0, min(NARROW, size), 0]),
            np.zeros(size, bool),
            np.empty(size**2),
            np.empty(size**2, np.float32),
            exchanges,
            np.empty((DEEP + 1, size), np.float32),
            np.empty((DEEP, DEEP)),
            (np.empty((DEEP, 2)), np.empty(DEEP + 1)),
            Vectors(*(np.empty(size) for _ in Vectors._fields)),
        )


@viewing
def square(room, size):  # type: ignore
    """Return a matrix in a room that may be larger (k, k).

    Args:
        room: of entries.
        size: k.
    """
    return room[: size**2].reshape((size, size))


@viewing
def line(compliance, row):  # type: ignore
    """Return a row of F, in its columns (c,).

    Args:
        compliance: `Compliance`.
        row: which of those at work.
    """
    start = row * compliance.sizes[2]
    return compliance.entries[start : start + compliance.sizes[1]]
