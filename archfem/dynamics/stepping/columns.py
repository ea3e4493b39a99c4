"""The compliance that a small problem needs: of its rows, in the columns where λ is not zero.

Rows of which λ is known to be zero are there for their gaps alone, which press on what slides; they
are as many as the others. A column is taken in when its λ is no longer zero, and stays to the end
of the problem. Few of either come or go from one problem to the next, and the compliance of a whole
structure is too large to lie near at hand: so the entries stay where they are, the last row or
column takes the place of one that goes, and only what comes is fetched.
"""

from archfem.dynamics.stepping.compliance import NARROW, broad, line, products
from archfem.joints.moving.compiled import computing, summing


@computing
def forget(compliance):  # type: ignore
    """Have no rows any more, so that what follows does not depend on what was.

    Args:
        compliance: `Compliance`.
    """
    for k in range(compliance.sizes[0]):
        compliance.place[compliance.rows[k]] = -1
    compliance.sizes[0], compliance.sizes[1] = 0, 0
    compliance.sizes[2] = min(NARROW, broad(len(compliance.rows)))


@computing
def begin(compliance, rows):  # type: ignore
    """Begin a problem in these rows, of the columns those that are still there.

    Args:
        compliance: `Compliance`.
        rows: their numbers in the structure (k,).
    """
    needed, sizes, k = compliance.needed, compliance.sizes, 0
    for row in rows:
        needed[row] = True
    while k < sizes[0]:
        if needed[compliance.rows[k]]:
            k += 1
        else:
            _leave(compliance, k)
    for row in rows:
        needed[row] = False
        if compliance.place[row] < 0:
            _come(compliance, row)


@computing
def _come(compliance, row):  # type: ignore
    """Take in a row of the structure."""
    k, whole = compliance.sizes[0], compliance.whole[row]
    compliance.sizes[0] += 1
    compliance.rows[k], compliance.place[row], compliance.column[k] = row, k, -1
    own = line(compliance, k)
    for j in range(compliance.sizes[1]):
        own[j] = whole[compliance.rows[compliance.places[j]]]


@computing
def _leave(compliance, k):  # type: ignore
    """Let a row go; the last one takes its place."""
    column, last = compliance.column, compliance.sizes[0] - 1
    if column[k] >= 0:
        _drop(compliance, column[k])
    own, other = line(compliance, k), line(compliance, last)
    for j in range(len(own)):
        own[j] = other[j]
    compliance.place[compliance.rows[k]] = -1
    if k < last:
        row = compliance.rows[last]
        compliance.rows[k], compliance.place[row], column[k] = row, k, column[last]
        if column[k] >= 0:
            compliance.places[column[k]] = k
    compliance.sizes[0] = last


@computing
def _drop(compliance, column):  # type: ignore
    """Let a column go; the last one takes its place."""
    last, entries, wide = compliance.sizes[1] - 1, compliance.entries, compliance.sizes[2]
    compliance.column[compliance.places[column]] = -1
    if column < last:
        row = compliance.places[last]
        compliance.places[column], compliance.column[row] = row, column
        for k in range(compliance.sizes[0]):
            entries[k * wide + column] = entries[k * wide + last]
    compliance.sizes[1] = last


@computing
def keep(compliance, was, force, entries, count):  # type: ignore
    """Let columns go of rows where λ and its derivatives are zero, and take in those of others.

    One that was at work in the last step stays: it often is again, and takes long to come by.

    Args:
        compliance: `Compliance`.
        was: λ of the last step (k,).
        force: λ of the rows now (k,).
        entries: rows and columns of the derivatives of λ.
        count: how many of those there are.
    """
    needed, places, column = compliance.needed, compliance.places, 0
    for entry in range(count):
        needed[entries[entry, 0]] = True
    while column < compliance.sizes[1]:
        row = places[column]
        if force[row] == 0.0 and was[row] == 0.0 and not needed[row]:
            _drop(compliance, column)
        else:
            column += 1
    for entry in range(count):
        needed[entries[entry, 0]] = False
    take_in(compliance, force, entries, count)


@computing
def take_in(compliance, force, entries, count):  # type: ignore
    """Take in the columns of rows where λ or a derivative of it is not zero.

    Args:
        compliance: `Compliance`.
        force: λ of the rows (k,).
        entries: rows and columns of the derivatives of λ.
        count: how many of those there are.
    """
    for k in range(len(force)):
        if force[k] != 0.0 and compliance.column[k] < 0:
            _become(compliance, k)
    for entry in range(count):
        if compliance.column[entries[entry, 0]] < 0:
            _become(compliance, entries[entry, 0])


@computing
def _become(compliance, row):  # type: ignore
    """Make a row the next column."""
    column, entries = compliance.sizes[1], compliance.entries
    if column == compliance.sizes[2]:
        _widen(compliance)
    compliance.column[row], compliance.places[column] = column, row
    compliance.sizes[1] += 1
    rows, wide, whole = compliance.rows, compliance.sizes[2], compliance.whole[compliance.rows[row]]
    for k in range(compliance.sizes[0]):
        entries[k * wide + column] = whole[rows[k]]


@computing
def _widen(compliance):  # type: ignore
    """Make room for more columns."""
    entries, (rows, columns, wide, _) = compliance.entries, compliance.sizes
    wider = min(wide + NARROW, broad(len(compliance.rows)))
    for k in range(rows - 1, 0, -1):
        for j in range(columns - 1, -1, -1):
            entries[k * wider + j] = entries[k * wide + j]
    compliance.sizes[2] = wider


@summing
def add_gaps(compliance, force, gaps):  # type: ignore
    """Add F λ.

    Args:
        compliance: `Compliance`, among its columns all of which λ is not zero.
        force: λ of the rows (k,).
        gaps: of the rows, changed (k,).
    """
    count, places = compliance.sizes[1], compliance.places
    own = compliance.vectors.column[: broad(count)]
    for j in range(count):
        own[j] = force[places[j]]
    for j in range(count, len(own)):
        own[j] = 0.0
    images = compliance.vectors.image[: len(gaps)]
    products(compliance.entries, compliance.sizes[2], own, images)
    for i in range(len(gaps)):
        gaps[i] += images[i]
