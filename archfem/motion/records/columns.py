"""Plain columns: accelerations with a time column, or with a step told by header or keyword."""

import re

import numpy as np

from archfem.arguments import real
from archfem.arrays import Array
from archfem.motion.records.channel import Channel
from archfem.motion.records.text import NUMBER, RecordText
from archfem.motion.records.units import unit_named, units_written

_STEP = re.compile(
    rf"\b(?:dt|delta\s*t|time\s*step|sampl\w*\s+interval)\b[^\d+\-.\n]{{0,12}}({NUMBER})\s*(ms)?",
    re.IGNORECASE,
)
_RATE = re.compile(
    rf"\bsampl\w*\s+(?:rate|freq\w*)\b[^\d+\-.\n]{{0,12}}({NUMBER})\s*(?:Hz|sps)\b",
    re.IGNORECASE,
)
_DIRECTIONS = re.compile(r"\b(N-S|E-W|U-D|NS|EW|UD|UP|DOWN)\b", re.IGNORECASE)
_JITTER = 0.25  # of a step: what rounding in print does to a time column


def read(
    text: RecordText, *, column: int | None, units: str | None, dt: float | None
) -> list[Channel]:
    """Return the acceleration columns of a plain file.

    Lines before the first line of numbers, and lines that begin with `#`, `%`, `!` or `*`, are
    comments; they may state units and step. A first column that grows is time.

    Args:
        text: the file.
        column: which column, counted from 1 in the file; None takes the only acceleration, or as
            many components as the comments name directions (N-S, E-W, U-D).
        units: g, m/s2, cm/s2 or gal; None takes what the comments say.
        dt: time between samples [s]; None takes the time column or what the comments say.

    Raises:
        InvalidInput: a row, the units, the step or the choice of column is missing or in doubt.
    """
    rows, lines, comments = _rows(text)
    unit = _unit(text, comments, units)
    step = _step(text, rows, lines, _told(comments, dt))
    first = 1 if _is_time(rows) else 0
    if column is None:
        chosen = list(range(first, rows.shape[1]))
        directions = [match.upper() for match in _DIRECTIONS.findall(comments)]
        if len(chosen) != 1 and len(directions) != len(chosen):
            raise text.error(
                f"{len(chosen)} columns could be the acceleration: choose with column=, from 1"
            )
    else:
        if not first < column <= rows.shape[1]:
            raise text.error(
                f"column {column} is not an acceleration of this file: "
                f"choose from {first + 1} to {rows.shape[1]}"
            )
        chosen, directions = [column - 1], []
    named = directions if len(directions) == len(chosen) else [""] * len(chosen)
    pairs = zip(chosen, named, strict=True)
    return [Channel.directed(rows[:, index] * unit, step, name) for index, name in pairs]


def _rows(text: RecordText) -> tuple[Array, list[int], str]:
    """Return the table of numbers (n, columns), its lines, and all comments in one string."""
    start = text.header_length()
    comments, table, lines = list(text.lines[:start]), [], []
    for line in range(start, len(text.lines)):
        content = text.lines[line].strip()
        if content.startswith(("#", "%", "!", "*")):
            comments.append(content)
        elif content:
            table.append(text.row(line))
            lines.append(line)
            if len(table[-1]) != len(table[0]):
                raise text.error(
                    f"{len(table[-1])} columns where the first row has {len(table[0])}", line
                )
    if "." not in "".join(text.lines[start:]) and text.holds(r"\d,\d", len(text.lines), start):
        raise text.error("these look like decimal commas: write points", start)
    text.check_end()
    if len(table) < 2:
        raise text.error("one row is no accelerogram", start)
    return np.array(table), lines, "\n".join(comments)


def _is_time(rows: Array) -> bool:
    """Return whether the first of several columns is meant as time: it nearly always grows."""
    if rows.shape[1] == 1 or len(rows) < 3:
        return False
    return bool(np.mean(np.diff(rows[:, 0]) > 0.0) > 0.9)


def _unit(text: RecordText, comments: str, units: str | None) -> float:
    """Return the unit of the columns [m/s²]."""
    written = units_written(comments)
    if units is not None:
        unit = unit_named(units)
        if written and unit not in written:
            raise text.error(f"units={units!r} contradicts the unit stated in the comments")
        return unit
    if len(written) != 1:
        found = "no unit" if not written else "several units"
        raise text.error(f"the comments state {found}: give units= as g, m/s2, cm/s2 or gal")
    return written.pop()


def _told(comments: str, dt: float | None) -> list[float]:
    """Return the steps told by keyword and by the comments [s]."""
    told = [] if dt is None else [real(dt, "dt [s]")]
    told += [float(value) * (1e-3 if milli else 1.0) for value, milli in _STEP.findall(comments)]
    told += [1.0 / max(float(rate), 1e-9) for rate in _RATE.findall(comments)]
    return told


def _step(text: RecordText, rows: Array, lines: list[int], told: list[float]) -> float:
    """Return the time between samples [s], the same by all that tells it."""
    if _is_time(rows):
        told = [*told, _step_of(text, rows[:, 0], lines)]
    if not told:
        raise text.error("neither a time column nor a stated step: give dt= in seconds")
    if max(told) - min(told) > 0.01 * max(told):
        raise text.error(f"the step is told twice and differs: {min(told):g} and {max(told):g} s")
    return text.step(told[0])


def _step_of(text: RecordText, times: Array, lines: list[int]) -> float:
    """Return the constant step of a time column [s]."""
    count = np.arange(len(times))
    step, begin = np.polyfit(count, times, 1)
    apart = np.abs(times - begin - step * count).max()
    if step <= 0.0 or max(apart, np.abs(np.diff(times) - step).max()) > _JITTER * step:
        jump = int(np.argmax(np.abs(np.diff(times) - np.median(np.diff(times)))))
        raise text.error(
            f"time is not uniform: {times[jump]:g} to {times[jump + 1]:g} s, elsewhere steps of "
            f"{np.median(np.diff(times)):g} s; bring the record to a constant step",
            lines[jump + 1],
        )
    return float(f"{step:.6g}")
