"""Plain columns of accelerations, with a time column or a step from header or keyword."""

import re
from dataclasses import replace

import numpy as np

from archfem._typing import Array
from archfem._validation import check_number
from archfem.motion.records.record_file import (
    CLOCK_PATTERN,
    NUMBER_PATTERN,
    TIME_UNIT_PATTERN,
    Channel,
    RecordText,
    parse_time_unit,
    parse_unit,
)


def read(
    text: RecordText, *, column: int | None, units: str | None, dt: float | None
) -> list[Channel]:
    """Read the acceleration columns of a plain file."""
    # Lines before the first line of numbers, and lines that begin with #, %, ! or *, are comments;
    # they may state units and step. An increasing first column is time.
    text = _count_seconds(text)
    rows, rest, lines, comments = _read_table(text)
    unit = _find_unit(text, comments, units)
    falls = np.diff(rows[:, 0])
    # even steps: accelerations may fall as well
    if _is_time(rows[::-1]) and np.ptp(falls) < 0.5 * abs(falls.mean()):
        raise text.error("the times of the first column run backwards: reverse its rows", lines[0])
    first = 1 if _is_time(rows) else 0
    if first:
        rows[:, 0] *= _find_time_unit(comments)
    step = _find_step(text, rows, lines, _list_stated_steps(comments, dt))
    directions = _find_directions(comments, rows.shape[1], first)
    if not (first or directions) and _runs_along_lines(rows):
        rows, rest = np.append(rows, rest)[:, None], []
    if rest:
        raise text.error(
            "the last row is shorter than the others: the file is cut short", lines[-1]
        )
    if column is None:
        chosen = list(range(first, rows.shape[1]))
        if len(chosen) != 1 and len(directions) != len(chosen):
            raise text.error(
                f"{len(chosen)} columns could be the acceleration: choose with column=, from 1; "
                "name them above, as N-S, E-W or U-D; or, where the samples follow one another "
                "along the lines, write one a line"
            )
    else:
        if not first < column <= rows.shape[1]:
            raise text.error(
                f"column {column} is not an acceleration of this file: "
                f"choose from {first + 1} to {rows.shape[1]}"
            )
        chosen, directions = [column - 1], []
    named = directions if len(directions) == len(chosen) else [""] * len(chosen)
    begin = float(rows[0, 0]) if first else None
    return Channel.from_table(rows[:, chosen] * unit, step, named, begin)


def _count_seconds(text: RecordText) -> RecordText:
    """Return the text with a time of the clock in front of numbers in seconds."""
    lines = list(text.lines)
    for line, content in enumerate(lines):
        if found := re.match(rf"\s*{CLOCK_PATTERN}Z?(?=[\s,;]+[-+.\d])", content):
            lines[line] = f"{text.parse_clock(found[0], line):.6f}{content[found.end() :]}"
    return replace(text, lines=tuple(lines))


def _find_directions(comments: str, width: int, first: int) -> list[str]:
    """Return the directions of the columns from the first acceleration on, as far as named."""
    words = r"N-S|E-W|U-D|NS|EW|UD|UP|DOWN"
    name = rf"(?:^|[\s_])({words}|[BCEHLS][NLG][ZNE12]|[ZNEV]|NORTH|EAST|VERT(?:ICAL)?)(?=$|[\s_])"
    # single letters name columns only in a head that has a cell for each column
    for comment in reversed(comments.upper().splitlines()):
        head = re.sub(r"[(\[].*?[)\]]", " ", comment).strip("#%!* \t")
        cells = re.split(r"\s*[,;\t]\s*" if re.search(r"[,;\t]", head) else r"\s+", head.strip())
        found = [re.search(name, cell) for cell in cells[first:]]
        if len(cells) == width and all(found):
            return [match[1] for match in found if match]
    return re.findall(rf"\b(?:{words})\b", comments.upper())


def _runs_along_lines(rows: Array) -> bool:
    """Return whether samples follow one another along the lines of a table, by their steps."""
    if len(rows) < 10 or rows.shape[1] < 2:
        return False
    along = np.abs(np.diff(rows.ravel()))
    by_column = [along[k :: rows.shape[1]].mean() for k in range(rows.shape[1])]
    # steps are as large within a line as to the next, and smaller than down a column
    down = np.abs(np.diff(rows, axis=0)).mean()
    return bool(max(by_column) < 1.5 * min(by_column) and along.mean() < 0.8 * down)


def _read_table(text: RecordText) -> tuple[Array, list[float], list[int], str]:
    """Return numbers (n, columns), a shorter last row, line numbers, and comments in one string."""
    start = text.header_length()
    comments, table, lines = list(text.lines[:start]), list[list[float]](), list[int]()
    for line in range(start, len(text.lines)):
        content = text.lines[line].strip()
        if content.startswith(("#", "%", "!", "*")):
            comments.append(content)
        elif content:
            table.append(text.parse_row(line))
            lines.append(line)
    rest = table.pop() if len(table[-1]) < len(table[0]) else []
    for row, line in zip(table, lines, strict=False):
        if len(row) != len(table[0]):
            raise text.error(
                f"{len(row)} columns where the first row has {len(table[0])}: this is neither a "
                "table nor a known format",
                line,
            )
    _refuse_decimal_commas(text, start, "\n".join(comments))
    text.check_end()
    if len(table) < 2:
        raise text.error("one row is no accelerogram", start)
    return np.array(table), rest, lines, "\n".join(comments)


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
        if written and not np.isclose(unit, list(written), rtol=1e-9, atol=0.0).any():
            raise text.error(f"units={units!r} contradicts the unit stated in the comments")
        return unit
    if len(written) != 1:
        found = "no unit" if not written else "several units"
        raise text.error(f"the comments state {found}: give units= as g, m/s2, gal or 0.1 gal")
    return written.pop()


def _find_time_unit(comments: str) -> float:
    """Return the unit of the first column [s] by the start of its head: Time (ms), t/ms or ms."""
    name = r"(?:[^\W\d_][^,;\t\d=)\]]{0,30}?[(\[]\s*|(?:t|time)[\s/_]+)"
    unit = rf"({TIME_UNIT_PATTERN})"
    pattern = rf"^[#%!*\s\"']*(?:{name}{unit}|{unit}[ \"']*[,;\t])"
    found = re.search(pattern, comments, re.IGNORECASE | re.MULTILINE)
    return parse_time_unit(found and (found[1] or found[2]))


def _list_stated_steps(comments: str, dt: float | None) -> list[float]:
    """Return the steps stated by keyword and in the comments [s]."""
    number = rf"[^\d+\-.\n]{{0,12}}({NUMBER_PATTERN})[ \t(\[]*"
    key, unit = r"\b(?:dt|delta\s*t|time\s*step|sampl\w*\s+interval)", rf"({TIME_UNIT_PATTERN})?"
    step_pattern = rf"{key}(?![^\W_])[ \t(\[_]*{unit}{number}{unit}"
    rate_pattern = rf"\bsampl\w*\s+(?:rate|freq\w*)\b{number}(?:Hz|sps)\b"
    steps = [] if dt is None else [check_number(dt, "dt [s]")]
    for before, value, after in re.findall(step_pattern, comments, re.IGNORECASE):
        steps.append(float(value) * parse_time_unit(before or after))
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
