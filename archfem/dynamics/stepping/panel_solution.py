"""Solution of a system whose matrix `panel_lu` has eliminated, compiled.

Rows and columns are taken four at a time, so that values that are fetched once serve them all.
"""

from archfem.dynamics.stepping.panels import four
from archfem.joints.moving.compiled import summing


@summing
def back(panels, entries, vector, room):  # type: ignore
    """Solve a system in place by its triangles.

    Args:
        panels: `Panels`.
        entries: as `eliminated` leaves them.
        vector: right side, then solution (n,).
        room: for intermediate results (n,).
    """
    _down(panels, entries, vector, room)
    _up(panels, entries, vector, room)


@summing
def _down(panels, entries, vector, room):  # type: ignore
    """Solve with the lower triangle."""
    first, below = panels.first, panels.below
    for group in range(len(first) - 1):
        start, width = first[group], first[group + 1] - first[group]
        rows, own = panels.rows[below[group] : below[group + 1]], vector[start : start + width]
        place, count = panels.places[group], len(rows)
        for i in range(1, width):
            row, value = entries[place + i * (width + count) :], own[i]
            for k in range(i):
                value -= row[k] * own[k]
            own[i] = value
        total, lower = room[:count], entries[place + width * (width + count) :]
        _columns_times(lower, own, total)
        for i in range(count):
            vector[rows[i]] -= total[i]


@summing
def _columns_times(lower, own, total):  # type: ignore
    """Sum up the columns below a group by its values, four at a time."""
    count, done = len(total), 0
    for i in range(count):
        total[i] = 0.0
    while done + 4 <= len(own):
        p, q, r, s = four(lower, done, count)
        a, b, c, d = own[done], own[done + 1], own[done + 2], own[done + 3]
        for i in range(count):
            total[i] += a * p[i] + b * q[i] + c * r[i] + d * s[i]
        done += 4
    for k in range(done, len(own)):
        column, value = lower[k * count :], own[k]
        for i in range(count):
            total[i] += value * column[i]


@summing
def _up(panels, entries, vector, room):  # type: ignore
    """Solve with the upper triangle."""
    first, below = panels.first, panels.below
    for group in range(len(first) - 2, -1, -1):
        start, width = first[group], first[group + 1] - first[group]
        rows, own = panels.rows[below[group] : below[group + 1]], vector[start : start + width]
        place, later = panels.places[group], room[: len(rows)]
        for i in range(len(rows)):
            later[i] = vector[rows[i]]
        _take_rows(entries[place:], later, own)
        for k in range(width - 1, -1, -1):
            row, value = entries[place + k * (width + len(rows)) :], own[k]
            for j in range(k + 1, width):
                value -= row[j] * own[j]
            own[k] = value * row[k]


@summing
def _take_rows(upper, later, own):  # type: ignore
    """Take from the values of a group those that follow by its rows, four rows at a time."""
    width, count, done = len(own), len(later), 0
    size, right = width + count, upper[width:]
    while done + 4 <= width:
        p, q, r, s = four(right, done, size)
        a, b, c, d = 0.0, 0.0, 0.0, 0.0
        for j in range(count):
            a += p[j] * later[j]
            b += q[j] * later[j]
            c += r[j] * later[j]
            d += s[j] * later[j]
        own[done] -= a
        own[done + 1] -= b
        own[done + 2] -= c
        own[done + 3] -= d
        done += 4
    for k in range(done, width):
        row, value = right[k * size :], 0.0
        for j in range(count):
            value += row[j] * later[j]
        own[k] -= value
