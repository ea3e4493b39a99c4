"""Text of a record file: its numbers, units and channels, and errors with file and line."""

import re
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from math import isfinite
from os import PathLike
from pathlib import Path

import numpy as np

from archfem._typing import Array
from archfem.errors import InvalidInput
from archfem.units import STANDARD_GRAVITY

# Pattern of a number as Fortran and C print it
NUMBER_PATTERN = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[EeDd][-+]?\d+)?"

# Pattern of a factor of a unit, which is not zero
_FACTOR = r"(?=[\d.]*[1-9])(?:\d{1,9}(?:\.\d{0,9})?|\.\d{1,9})(?:e[-+]?\d\d?)?"

# Pattern of a number of samples
COUNT_PATTERN = r"\d{1,9}"


# Pattern of a unit of time other than the second
TIME_UNIT_PATTERN = (
    r"(?:(?:milli[- ]?|micro[- ]?|[muµμ])s(?:ec(?:ond)?s?)?|min(?:ute)?s?|h(?:ou)?rs?)(?![^\W_])"
)

# Pattern of a time on the clock, after a date where there is one
CLOCK_PATTERN = (
    r"(?<![\d:])(?:(\d{4}|\d\d?)([-/.]?)(\d\d?)\2(\d{4}|\d\d?)[T\s_,;-]+(?=\d{6}|\d\d?:)"
    r"|(?=\d\d?:))(\d\d?):?(\d\d):?(\d\d(?:\.\d*)?)(?![\d:])"
)


@dataclass(frozen=True)
class RecordText:
    """The lines of a file that may hold a record."""

    path: Path  # the file
    lines: tuple[str, ...]  # its lines without line ends
    ended: bool  # whether the last line has its line end

    @classmethod
    def decode(cls, path: str | PathLike[str], content: bytes) -> "RecordText":
        """Decode the content of a file: UTF-8, or else Western or Turkish in 8 bits."""
        # end-of-file mark of DOS, and zeros that fill the last block of a tape
        content = re.sub(rb"\s*\0[\0\s]*\Z", b"\n", content.rstrip(b"\x1a"))
        if b"\0" in content or not content.strip():
            kind = "not a text file" if content.strip() else "empty"
            if content.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
                kind = "encoded in UTF-16, and UTF-8 is read"
            raise InvalidInput(f"{Path(path)} is {kind}: give an accelerogram as text")
        try:
            text = content.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = content.decode("cp1254", errors="replace")
        # `splitlines` would also split at form feeds and shift the line numbers
        lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
        return cls(Path(path), tuple(lines), lines[-1].strip() == "")

    def error(self, message: str, line: int | None = None) -> InvalidInput:
        """Create an error with the file and the line."""
        where = f"{self.path}" if line is None else f"{self.path}, line {line + 1}"
        return InvalidInput(f"{where}: {message}")

    def is_numeric(self, line: int) -> bool:
        """Return whether a line consists of numbers."""
        content = self.lines[line]
        numeric = re.fullmatch(r"[\s\d+\-.,;EeDd]+", content, re.ASCII)
        return bool(numeric and re.search(r"[0-9]", content))

    def parse_row(self, line: int, width: int | None = None) -> list[float]:
        """Parse the numbers of one line."""
        # numbers without a space between them are split at their signs, or by the column width
        content = self.lines[line].strip()
        if content and not self.is_numeric(line):
            raise self.error(f"numbers expected, got {content[:40]!r}", line)
        try:
            row = [float(token) for token in self._split_tokens(line, width)]
        except ValueError as error:
            raise self.error(f"not a number in {content[:40]!r}", line) from error
        if not all(map(isfinite, row)):
            raise self.error(f"a number too large in {content[:40]!r}", line)
        return row

    def _split_tokens(self, line: int, width: int | None) -> list[str]:
        """Split a line into the texts of numbers, with E for Fortran's D."""
        content = self.lines[line].upper().replace("D", "E")
        # numbers that run together part before a sign
        tokens = re.sub(r"(?<=[\d.])(?=[-+])|[,;]", " ", content).split()
        if width and not all(re.fullmatch(NUMBER_PATTERN, token) for token in tokens):
            return [content[at : at + width] for at in range(0, len(content.rstrip()), width)]
        return tokens

    def read_block(self, first: int, count: int, width: int | None = None) -> tuple[Array, int]:
        """Read the number of values that a header states; return them and the next line."""
        if count < 1:
            raise self.error(f"the header states {count} samples")
        numbers, line = list[float](), first
        while len(numbers) < count and line < len(self.lines):
            numbers.extend(self.parse_row(line, width))
            line += 1
        if len(numbers) != count:
            short = len(numbers) < count
            remedy = "the file is cut short" if short else "samples or the header are damaged"
            raise self.error(
                f"the header states {count} samples, the file holds "
                f"{len(numbers) if short else 'more'}: {remedy}",
                line - 1,
            )
        self._check_print(first, line, width)
        return np.array(numbers), line

    def _check_print(self, first: int, end: int, width: int | None) -> None:
        """Refuse a number with more or fewer decimals than nearly all others of its block."""
        tokens = [
            (*map(len, token.strip().partition(".")[::2]), line)
            for line in range(first, end)
            for token in self._split_tokens(line, width)
        ]
        usual, times = Counter(decimals for _, decimals, _ in tokens).most_common(1)[0]
        # where 97 % of the numbers have equally many digits, the others are damaged, except
        # that long ones of a narrow column lose decimals
        if 0.97 * len(tokens) < times < len(tokens):
            longest = max(whole for whole, decimals, _ in tokens if decimals == usual)
            for whole, decimals, line in tokens:
                if decimals > usual or (decimals < usual and whole <= longest):
                    raise self.error(
                        "a number has not as many digits as the others: it is damaged", line
                    )

    def read_last_block(self, first: int, count: int) -> Array:
        """Read the stated number of values at the end of the file (count,)."""
        numbers, line = self.read_block(first, count)
        if rest := self.search(r"\S", line):
            raise self.error(f"more follows after the {count} samples of the header", rest[0])
        self.check_end()
        return numbers

    def find_unit(self, header: str, problem: str, line: int | None = None) -> float:
        """Return the unit of acceleration in a header [m/s²], or refuse none and several."""
        units = self.find_units(header)
        if len(units) != 1:
            raise self.error(problem, line)
        return units.pop()

    def check_end(self) -> None:
        """Refuse a file whose last number is truncated, compared with the previous ones."""
        if self.ended:
            return
        last = range(max(len(self.lines) - 12, 0), len(self.lines))
        tokens = [token for line in last for token in self._split_tokens(line, None)]
        shapes = [re.sub(r"\d", "0", re.sub(r"[-+]", "+", token)) for token in tokens]
        tails = [shape.partition(".")[2] for shape in shapes]
        if len(set(tails[-6:-1])) == 1 and len(tails[-1]) < len(tails[-2]):
            raise self.error(f"the last number {tokens[-1]!r} is cut off", len(self.lines) - 1)

    def find(
        self, pattern: str, start: int = 0, stop: int | None = None
    ) -> tuple[int, re.Match[str]]:
        """Return the index of the first line that contains a pattern, and the match."""
        if found := self.search(pattern, start, stop):
            return found
        raise self.error(f"no line has {pattern!r}: the header is damaged")

    def search(
        self, pattern: str, start: int = 0, stop: int | None = None
    ) -> tuple[int, re.Match[str]] | None:
        """Return the first line that contains a pattern and the match, or None."""
        search = re.compile(pattern, re.IGNORECASE).search
        matches = ((line, search(text)) for line, text in enumerate(self.lines[start:stop], start))
        return next(((line, match) for line, match in matches if match), None)

    def find_start(self, key: str, start: int = 0, stop: int | None = None) -> float | None:
        """Return the time on the line of a key [s] since 1970, None where there is no such line."""
        found = self.search(key, start, stop)
        return None if found is None else self.parse_clock(self.lines[found[0]], found[0])

    def parse_clock(self, words: str, line: int) -> float | None:
        """Convert the first date and time in words to seconds since 1970; None without any."""
        found = re.search(CLOCK_PATTERN, words)
        if found is None:
            return None
        first, _, month, last, hour, minute, second = found.groups()
        if first is None:  # the seconds of a day
            first, month, last = "1970", "1", "1"
        year, day = (first, last) if len(first) == 4 else (last, first)
        # the order of day and month is that of the larger number; no shift depends on it
        month, day = (day, month) if int(month) > 12 else (month, day)
        try:
            date_time = datetime(int(year), int(month), int(day), int(hour), int(minute), 0, 0, UTC)
        except ValueError as error:
            raise self.error(f"{found[0]!r} is no time: {error}", line) from error
        return date_time.timestamp() + float(second)

    def contains(self, pattern: str, stop: int, start: int = 0) -> bool:
        """Return whether a line contains a pattern."""
        return self.search(pattern, start, stop) is not None

    def header_length(self, start: int = 0) -> int:
        """Return the index of the first line of numbers from a line on."""
        line = next(filter(self.is_numeric, range(start, len(self.lines))), None)
        if line is None:
            raise self.error("no line of numbers: not an accelerogram")
        return line

    def check_step(self, dt: float, line: int | None = None) -> float:
        """Return a valid sampling interval [s]."""
        if not 0.0 < dt <= 0.1:  # below 10 Hz no motion of a structure is recorded
            hint = f"; write the unit if it is {dt:g} ms" if 0.1 < dt <= 100.0 else ""
            raise self.error(
                f"sampling interval {dt:g} s, expected more than 0 and up to 0.1 s{hint}", line
            )
        return dt

    def check_peak(
        self, samples: Array, stated: float, tolerance: float = 0.02, rounding: float = 0.0
    ) -> None:
        """Compare the samples with the peak that the header states, both in one unit."""
        peak = np.abs(samples).max()
        apart = abs(peak - abs(stated))
        if not (isfinite(apart) and apart <= tolerance * max(peak, abs(stated)) + rounding):
            raise self.error(
                f"the header states a peak of {abs(stated):g}, the samples reach {peak:g}: "
                "one of them is damaged"
            )

    @staticmethod
    def fit_step(times: Array) -> tuple[float, float]:
        """Fit a constant step to times; return it and the largest distance from it [s]."""
        count = np.arange(len(times))
        step, begin = np.polyfit(count, times, 1)
        return step, np.abs(times - begin - step * count).max()

    def space_evenly(self, pairs: Array, line: int) -> tuple[Array, float, float]:
        """Return samples at a constant step, step and start [s], of pairs of time and sample."""
        times, samples = np.reshape(pairs, (-1, 2)).T
        if len(times) < 2 or not np.all(np.diff(times) >= 0.0):
            raise self.error("pairs of a time and a sample are expected, but times decrease", line)
        mean, apart = self.fit_step(times)
        step = self.check_step(float(f"{mean:.6g}"), line)
        # printed times are rounded; a film is digitised at uneven ones
        if apart <= 0.25 * mean:
            return samples, step, float(times[0])
        # between its points a digitised trace is straight, and 1 ms is finer than they are
        fine = 0.001
        even = np.arange(times[0], times[-1] + 0.5 * fine, fine)
        return np.interp(even, times, samples), fine, float(times[0])

    @staticmethod
    def find_column_width(line: str) -> int | None:
        """Return the column width of a Fortran format such as (8F10.3) in a line."""
        match = re.search(r"\(\s*\d+[FE](\d+)\.\d+\s*\)", line, re.IGNORECASE)
        return int(match[1]) if match else None

    @staticmethod
    def find_units(header: str) -> set[float]:
        """Return the values of the units of acceleration in a header [m/s²]."""
        # Longer units first: each match is removed before the search for the next. A number with
        # an operator is a factor, as in gal/10; without one, as in 312 gal, it is a value.
        per_square = r"\s*/\s*s(?:ec|n)?(?:\s*/\s*s(?:ec|n)?|\s*(?:\^|\*\*)?\s*2|²)"
        patterns = (
            *((rf"mm{per_square}", 1e-3), (rf"cms?{per_square}", 1e-2)),
            *((r"\bgals?\b", 1e-2), (rf"\bm{per_square}", 1.0)),
            (
                r"units?\s*(?:of|:|=|in)?\s*\(?g\b|[(\[]\s*g(?=\s*(?:[/x×*·][^)\]]*)?[)\]])|\bin\s+g\b",
                STANDARD_GRAVITY,
            ),
        )
        units, power = set[float](), rf"(?:10|1/)?[-+]?{_FACTOR}"
        for pattern, unit in patterns:
            while found := re.search(pattern, header, re.IGNORECASE):
                head, tail = header[: found.start()].lower(), header[found.end() :].lower()
                before = re.search(rf"(?<![\w.^*+-])({_FACTOR})\s*[x×*·]\s*$", head)
                after = re.match(rf"\s*([/x×*·])\s*({_FACTOR})(?![\w.^*])", tail)
                valued = re.search(
                    rf"(?:(?:^|[\s(\[=:,^*]){power}|\)\s*[x×*·])\s*[x×*·]?\s*$", head
                )
                if (before or not valued) and (after or not re.match(r"\s*/\s*\w", tail)):
                    numbers = after.groups() if after else (None, None)
                    units.add(unit * _combine_factors(before and before[1], *numbers))
                header = f"{head} {tail}"
        return units


@dataclass(frozen=True, eq=False)
class Channel:
    """One component of a record."""

    samples: Array  # accelerations (n,) [m/s²]; a vertical counts upwards
    dt: float  # time between samples [s]
    direction: str = ""  # what the file calls the component, e.g. `N-S`, `270`, `UP`
    is_vertical: bool = False  # whether the component is the vertical one
    start_time: float | None = None  # of the first sample on the file's clock [s]; None if unknown

    @classmethod
    def from_direction(
        cls, samples: Array, dt: float, direction: str, start_time: float | None = None
    ) -> "Channel":
        """Create a channel; a vertical component with positive downwards changes its sign."""
        name = direction.strip()
        if re.search(r"\b(DWN|DOWN|DN)\b|DWN$", name, re.IGNORECASE):
            return cls(-samples, dt, f"{name}, turned up", True, start_time)
        upward = r"\b(UP|UPDO|VERT|VERTICAL|V|VER|U-D|UD|U|Z|[A-Z]{2}Z)\b|UP$"
        return cls(samples, dt, name, bool(re.search(upward, name, re.IGNORECASE)), start_time)

    @classmethod
    def from_table(
        cls, table: Array, dt: float, names: Sequence[str], start_time: float | None = None
    ) -> "list[Channel]":
        """Create a channel of each column of a table (n, columns)."""
        columns = zip(table.T, names, strict=True)
        return [cls.from_direction(column, dt, name, start_time) for column, name in columns]


def parse_time_unit(name: str | None) -> float:
    """Return the value of a unit found by `TIME_UNIT_PATTERN` [s], a second for none."""
    units = {"mic": 1e-6, "min": 60.0, "m": 1e-3, "h": 3600.0, "": 1e-6}
    head = (name or "").lower()
    return next(value for start, value in units.items() if head.startswith(start)) if head else 1.0


def parse_unit(name: str) -> float:
    """Return the value of a unit of acceleration by its name, or of a multiple of it [m/s²]."""
    unit_names = {"g": STANDARD_GRAVITY, "m/s2": 1.0, "cm/s2": 1e-2, "gal": 1e-2, "mm/s2": 1e-3}
    key = str(name).lower().replace("²", "2").replace("^", "").replace(" ", "")
    found = re.fullmatch(
        rf"(?:({_FACTOR})[x×*·]?)?(mm/s2|cm/s2|m/s2|gal|g)(?:([/x×*·])({_FACTOR}))?", key
    )
    if found is None:
        known = ", ".join(unit_names)
        raise InvalidInput(
            f"units {name!r} are unknown: use one of {known}, or a multiple such as 0.1 gal"
        )
    return unit_names[found[2]] * _combine_factors(*found.group(1, 3, 4))


def _combine_factors(before: str | None, operator: str | None, after: str | None) -> float:
    """Return the factor of a unit from the number before it, and the operator and number after."""
    return float(before or 1.0) * float(after or 1.0) ** (-1.0 if operator == "/" else 1.0)
