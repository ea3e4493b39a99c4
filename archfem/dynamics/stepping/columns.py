"""The compliance that a small problem needs: of its rows, in the columns where λ is not zero.

Rows of which λ is known to be zero are there for their gaps alone, which press on what slides; they
are as many as the others. A column is taken in when its λ is no longer zero, and stays.
"""

from typing import NamedTuple

import numba
import numpy as np

from archfem.arrays import Array
from archfem.dynamics.stepping.elimination import Indices
from archfem.joints.moving.compiled import summing


class Columns(NamedTuple):
    """F of some rows, as far as λ is not zero.

    Attributes:
        entries: of F, of all columns that have been taken in (k, k).
        rows: their numbers in the structure (k,).
        places: which of the rows each column is, in the order in which they came (k,).
        column: which column each row is, -1 if it is none (k,).
        taken: how many columns have been (1,).
        force: room for λ of the columns (k,).
    """

    entries: Array
    rows: Indices
    places: Indices
    column: Indices
    taken: Indices
    force: Array


@numba.njit(cache=True)
def no_columns(rows):  # type: ignore
    """Return room for rows, without a column.

    Args:
        rows: their numbers in the structure (k,).
    """
    size = len(rows)
    entries, places = np.empty((size, size)), np.empty(size, np.int64)
    column, taken = np.full(size, -1), np.zeros(1, np.int64)
    return Columns(entries, rows, places, column, taken, np.empty(size))


@numba.njit(cache=True)
def take_in(columns, compliance, force, entries, count):  # type: ignore
    """Take in the columns of rows where λ or a derivative of it is not zero.

    Args:
        columns: `Columns`.
        compliance: F of the structure (p, p).
        force: λ of the rows (k,).
        entries: rows and columns of the derivatives of λ.
        count: how many of those there are.
    """
    before, rows = columns.taken[0], columns.rows
    for k in range(len(force)):
        if force[k] != 0.0:
            _name(columns, k)
    for entry in range(count):
        _name(columns, entries[entry, 0])
    numbers = rows[columns.places[before : columns.taken[0]]]
    for i in range(len(rows)):
        own, whole = columns.entries[i][before:], compliance[rows[i]]
        for j in range(len(numbers)):
            own[j] = whole[numbers[j]]


@numba.njit(cache=True)
def _name(columns, row):  # type: ignore
    """Make a row the next column, if it is none."""
    if columns.column[row] < 0:
        columns.column[row] = columns.taken[0]
        columns.places[columns.taken[0]] = row
        columns.taken[0] += 1


@summing
def add_gaps(columns, force, gaps):  # type: ignore
    """Add F λ.

    Args:
        columns: `Columns`, among them all of which λ is not zero.
        force: λ of the rows (k,).
        gaps: of the rows, changed (k,).
    """
    count, own = columns.taken[0], columns.force
    for j in range(count):
        own[j] = force[columns.places[j]]
    for i in range(len(gaps)):
        row, total = columns.entries[i], 0.0
        for j in range(count):
            total += row[j] * own[j]
        gaps[i] += total
