"""The compliance of the joints of a structure, and room for the small problems that need it.

Rooms are for as many rows as the structure has; only what problems use of them takes memory. They
are there from the first step on, for what is made anew in each pass takes longer to come by than to
fill.
"""

from typing import Any, NamedTuple

import numpy as np

from archfem.arrays import Array
from archfem.dynamics.stepping.elimination import Indices
from archfem.dynamics.stepping.panels import four
from archfem.joints.moving.compiled import summing, viewing

NARROW = 64
"""Columns for which there is room at first."""

WIDE = 16
"""Entries of a row that are taken at once: there is room for a multiple of these in each."""

LINE = 64
"""Bytes of a line of memory: entries are slower to come by where they lie across two."""

DEEP = 48
"""Products with a matrix after which its factor takes no longer."""


class Vectors(NamedTuple):
    """Room for vectors of the rows of a problem, each (q,).

    Attributes:
        force: λ.
        wanted: λ that the gaps ask for.
        change: what λ lacks, then how it changes.
        rest: by which gaps are off, then gaps.
        was: λ that the gaps asked for before a pass.
        trial: λ that is tried.
        held: change of λ where points hold.
        free: z₀.
        guess: of z.
        added: to z₀ so that the guess fits.
        goal: z₀ with some of that.
        column: of the columns instead, λ or a right side.
        image: under F.
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
    image: Array


class Compliance(NamedTuple):
    """F of a structure, and room for the small problems that need some of it.

    Attributes:
        whole: F (p, p), symmetric, of which the rows at work are filled.
        entries: of its rows and columns at work, row by row (p q,), q what there is room for in a
            row of p.
        rows: numbers of the former in the structure (p,).
        place: which of them each row of the structure is, -1 if none (p,).
        places: which of the rows each column is (p,).
        column: which column each of the rows is, -1 if none (p,).
        sizes: how many rows there are, how many columns, for how many of these there is room, and
            how many the equations have (4,).
        needed: whether a row of the structure, or of the problem, is needed; else False (p,).
        matrix: of the equations (p²,).
        rough: the same in single precision (p q,).
        exchanges: of rows in a factor (p,).
        basis: vectors to find a solution among, in single precision (d + 1, q).
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
        wide = broad(size)
        rows, places, column, exchanges = (np.empty(size, np.int64) for _ in range(4))
        return cls(
            whole,
            _aligned(size * wide, float),
            rows,
            np.full(size, -1),
            places,
            column,
            np.array([0, 0, min(NARROW, wide), 0]),
            np.zeros(size, bool),
            np.empty(size**2),
            _aligned(size * wide, np.float32),
            exchanges,
            _aligned((DEEP + 1) * wide, np.float32).reshape((DEEP + 1, wide)),
            np.empty((DEEP, DEEP)),
            (np.empty((DEEP, 2)), np.empty(DEEP + 1)),
            Vectors(*(_aligned(wide, float) for _ in Vectors._fields)),
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
def broad(count):  # type: ignore
    """Return how many entries there is room for in a row of some.

    Args:
        count: of those.
    """
    return (count + WIDE - 1) // WIDE * WIDE


def _aligned(count: int, kind: Any) -> Array:
    """Zeros that begin with a line of memory (count,)."""
    size = count * np.dtype(kind).itemsize
    room = np.zeros(size + LINE, np.uint8)
    begin = -room.ctypes.data % LINE
    zeros: Array = room[begin : begin + size].view(kind)
    return zeros


@viewing
def rows_in(room, size):  # type: ignore
    """Return a square matrix in a room, with all that there is room for in its rows.

    Args:
        room: of entries.
        size: of its rows and columns.
    """
    return room[: size * broad(size)].reshape((size, broad(size)))


@viewing
def line(compliance, row):  # type: ignore
    """Return a row of F, in its columns and what else there is room for (c,).

    Args:
        compliance: `Compliance`.
        row: which of those at work.
    """
    start = row * compliance.sizes[2]
    return compliance.entries[start : start + broad(compliance.sizes[1])]


@summing
def products(room, wide, vector, images):  # type: ignore
    """Multiply the rows of a matrix by a vector, four at a time.

    Args:
        room: of entries, row by row.
        wide: how many of them there is room for in a row.
        vector: by which to multiply (c,).
        images: filled (k,).
    """
    count, zero, tail = len(images), vector.dtype.type(0.0), len(images) % 4
    for row in range(0, count - tail, 4):
        a, b, c, d = four(room, row, wide)
        p, q, r, s = zero, zero, zero, zero
        for k in range(len(vector)):
            p += a[k] * vector[k]
            q += b[k] * vector[k]
            r += c[k] * vector[k]
            s += d[k] * vector[k]
        images[row], images[row + 1], images[row + 2], images[row + 3] = p, q, r, s
    for row in range(count - tail, count):
        own, p = room[row * wide : row * wide + len(vector)], zero
        for k in range(len(vector)):
            p += own[k] * vector[k]
        images[row] = p
