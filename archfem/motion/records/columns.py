"""Plain columns of accelerations, with a time column or a step from header or keyword."""

import re

import numpy as np

from archfem._typing import Array
from archfem._validation import check_number
from archfem.motion.records.record_file import NUMBER_PATTERN, Channel, RecordText, parse_unit


def read(
    text: RecordText, *, column: int | None, units: str | None, dt: float | None
) -> list[Channel]:
    """Read the acceleration columns of a plain file."""
    # Lines before the first line of numbers, and lines that begin with #, %, ! or *, are comments;
    # they may state units and step. An increasing first column is time.
    rows, lines, comments = _read_table(text)
    unit = _find_unit(text, comments, units)
    step = _find_step(text, rows, lines, _list_stated_steps(comments, dt))
    first = 1 if _is_time(rows) else 0
    if column is None:
        chosen = list(range(first, rows.shape[1]))
        directions = re.findall(r"\b(?:N-S|E-W|U-D|NS|EW|UD|UP|DOWN)\b", comments.upper())
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
    return Channel.from_table(rows[:, chosen] * unit, step, named)


def _read_table(text: RecordText) -> tuple[Array, list[int], str]:
    """Return the numbers (n, columns), their line numbers, and all comments in one string."""
    start = text.header_length()
    comments, table, lines = list(text.lines[:start]), [], []
    for line in range(start, len(text.lines)):
        content = text.lines[line].strip()
        if content.startswith(("#", "%", "!", "*")):
            comments.append(content)
        elif content:
            table.append(text.parse_row(line))
            lines.append(line)
            if len(table[-1]) != len(table[0]):
                raise text.error(
                    f"{len(table[-1])} columns where the first row has {len(table[0])}: this is "
                    "neither a table nor a known format",
                    line,
                )
    _refuse_decimal_commas(text, start, "\n".join(comments))
    text.check_end()
    if len(table) < 2:
        raise text.error("one row is no accelerogram", start)
    return np.array(table), lines, "\n".join(comments)


def _refuse_decimal_commas(text: RecordText, start: int, comments: str) -> None:
    """Refuse numbers like 0,01, whose parts would be read as two columns or as a step of 0 s."""
    remedy = "these look like decimal commas: write points, and separate columns by ; or ,"
    step = r"(?:\bdt|\bdelta\s*t|\bstep|interval)\b[^\d\n]{0,12}\d+,\d+"
    if stated := re.search(step, comments, re.IGNORECASE):
        raise text.error(f"{stated[0]!r}: {remedy}")
    # beside semicolons, or without any point, a comma between digits separates no columns
    rows = text.lines[start:]
    if text.contains(r"\d,\d", len(text.lines), start) and "." not in "".join(rows):
        raise text.error(remedy, start)
    for line, row in enumerate(rows, start):
        if ";" in row and re.search(r"\d,\d", row):
            raise text.error(remedy, line)


def _is_time(rows: Array) -> bool:
    """Return whether the first of several columns is time: at least 90 % of it increases."""
    several = rows.shape[1] > 1 and len(rows) > 2
    return bool(several and np.mean(np.diff(rows[:, 0]) > 0.0) > 0.9)


def _find_unit(text: RecordText, comments: str, units: str | None) -> float:
    """Return the unit of the columns [m/s²]."""
    written = text.find_units(comments)
    if units is not None:
        unit = parse_unit(units)
        if written and unit not in written:
            raise text.error(f"units={units!r} contradicts the unit stated in the comments")
        return unit
    if len(written) != 1:
        found = "no unit" if not written else "several units"
        raise text.error(f"the comments state {found}: give units= as g, m/s2, cm/s2 or gal")
    return written.pop()


def _list_stated_steps(comments: str, dt: float | None) -> list[float]:
    """Return the steps stated by keyword and in the comments [s]."""
    number = rf"\b[^\d+\-.\n]{{0,12}}({NUMBER_PATTERN})\s*"
    step_pattern = r"\b(?:dt|delta\s*t|time\s*step|sampl\w*\s+interval)" + number + "(ms)?"
    rate_pattern = r"\bsampl\w*\s+(?:rate|freq\w*)" + number + r"(?:Hz|sps)\b"
    steps = [] if dt is None else [check_number(dt, "dt [s]")]
    for value, milli in re.findall(step_pattern, comments, re.IGNORECASE):
        steps.append(float(value) * (1e-3 if milli else 1.0))
    rates = re.findall(rate_pattern, comments, re.IGNORECASE)
    return steps + [1.0 / max(float(rate), 1e-9) for rate in rates]


def _find_step(text: RecordText, rows: Array, lines: list[int], stated: list[float]) -> float:
    """Return the time between samples [s], on which all sources must agree."""
    if _is_time(rows):
        stated = [*stated, _time_column_step(text, rows[:, 0], lines)]
    if not stated:
        raise text.error("neither a time column nor a stated step: give dt= in seconds")
    if max(stated) - min(stated) > 0.01 * max(stated):
        raise text.error(
            f"the step is stated twice and differs: {min(stated):g} and {max(stated):g} s"
        )
    return text.check_step(stated[0])


def _time_column_step(text: RecordText, times: Array, lines: list[int]) -> float:
    """Return the constant step of a time column [s]."""
    step, apart = text.fit_step(times)
    steps = np.diff(times)
    usual = np.median(steps)
    # printed times are rounded, by up to a quarter of a step
    if step <= 0.0 or max(apart, np.abs(steps - step).max()) > 0.25 * step:
        jump = int(np.argmax(np.abs(steps - usual)))
        raise text.error(
            f"time is not uniform: {times[jump]:g} to {times[jump + 1]:g} s, elsewhere steps of "
            f"{usual:g} s; bring the record to a constant step",
            lines[jump + 1],
        )
    return float(f"{step:.6g}")
