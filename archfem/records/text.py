"""The text of a record file, its numbers, and errors that name file and line."""

import re
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from archfem.errors import InvalidInput
from archfem.units import STANDARD_GRAVITY

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[EeDd][-+]?\d+)?"
"""Pattern of a number as Fortran and C print it."""

LONGEST_STEP = 0.1
"""Sampling slower than 10 Hz [s] cannot hold the shaking of a structure: a misread header."""

_NUMERIC = re.compile(r"[\s\d+\-.,;EeDd]*\d[\s\d+\-.,;EeDd]*")
_RUN_TOGETHER = re.compile(r"(?<=[\d.])(?=[-+])")
_SEPARATORS = re.compile(r"[\s,;]+")

# The order matters: the longer unit is tried first and blotted out before the next is looked for.
_UNITS = (
    (r"mm\s*/\s*s(?:ec)?(?:\s*/\s*s(?:ec)?|\s*(?:\^|\*\*)?\s*2|²)", 1e-3),
    (r"cm\s*/\s*s(?:ec)?(?:\s*/\s*s(?:ec)?|\s*(?:\^|\*\*)?\s*2|²)", 1e-2),
    (r"\bgals?\b", 1e-2),
    (r"\bm\s*/\s*s(?:ec)?(?:\s*/\s*s(?:ec)?|\s*(?:\^|\*\*)?\s*2|²)", 1.0),
    (r"units?\s*(?:of|:|=|in)?\s*\(?g\b|[(\[]\s*g\s*[)\]]|\bin\s+g\b", STANDARD_GRAVITY),
)
_NAMES = {"g": STANDARD_GRAVITY, "m/s2": 1.0, "cm/s2": 1e-2, "gal": 1e-2, "mm/s2": 1e-3}


@dataclass(frozen=True)
class RecordText:
    """The lines of a file that may hold a record.

    Args:
        path: the file.
        lines: its lines without line ends.
        ended: whether the last line has its line end.
    """

    path: Path
    lines: tuple[str, ...]
    ended: bool

    @classmethod
    def opened(cls, path: str | PathLike[str]) -> "RecordText":
        """Read a file: UTF-8 where it is that, else a Western or Turkish 8-bit encoding.

        Raises:
            InvalidInput: there is no such file, it cannot be read, or it is not text.
        """
        place = Path(path)
        try:
            content = place.read_bytes()
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise InvalidInput(f"cannot read the record {place}: {reason}") from error
        if b"\0" in content or not content.strip():
            kind = "not a text file" if content.strip() else "empty"
            raise InvalidInput(f"{place} is {kind}: give an accelerogram as text")
        try:
            text = content.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = content.decode("cp1254", errors="replace")
        # Not `splitlines`: it would also split at form feeds and shift the line numbers.
        lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
        return cls(place, tuple(lines), lines[-1].strip() == "")

    def error(self, message: str, line: int | None = None) -> InvalidInput:
        """Make the error that names the file and the line (an index here, counted from 1 there)."""
        where = f"{self.path}" if line is None else f"{self.path}, line {line + 1}"
        return InvalidInput(f"{where}: {message}")

    def is_numeric(self, line: int) -> bool:
        """Tell whether a line holds numbers and nothing else."""
        return bool(_NUMERIC.fullmatch(self.lines[line]))

    def row(self, line: int) -> list[float]:
        """Return the numbers of one line; numbers run together are parted at their signs.

        Raises:
            InvalidInput: something in the line is not a finite number.
        """
        content = self.lines[line]
        if content.strip() and not self.is_numeric(line):
            raise self.error(f"numbers expected, got {content.strip()[:40]!r}", line)
        tokens = _SEPARATORS.split(_RUN_TOGETHER.sub(" ", content).strip(" \t,;\f\v"))
        try:
            row = [float(token.replace("D", "E").replace("d", "e")) for token in tokens if token]
        except ValueError as error:
            raise self.error(f"not a number in {content.strip()[:40]!r}", line) from error
        if not np.all(np.isfinite(row)):
            raise self.error(f"a number too large in {content.strip()[:40]!r}", line)
        return row

    def block(self, first: int, count: int) -> tuple[np.ndarray, int]:
        """Read as many numbers as a header states.

        Args:
            first: index of the line they begin in.
            count: how many there are.

        Returns:
            The numbers (count,) and the index of the line after them.

        Raises:
            InvalidInput: the numbers end early, or do not end with a line.
        """
        numbers: list[float] = []
        line = first
        while len(numbers) < count and line < len(self.lines):
            numbers.extend(self.row(line))
            line += 1
        if len(numbers) != count:
            short = len(numbers) < count
            remedy = "the file is cut short" if short else "samples or the header are damaged"
            raise self.error(
                f"the header states {count} samples, the file holds "
                f"{len(numbers) if short else 'more'}: {remedy}",
                line - 1,
            )
        return np.array(numbers), line

    def last_block(self, first: int, count: int) -> np.ndarray:
        """Read as many numbers as a header states, which end the file.

        Raises:
            InvalidInput: there are fewer or more, or the last one is cut off.
        """
        numbers, line = self.block(first, count)
        for rest in range(line, len(self.lines)):
            if self.lines[rest].strip():
                raise self.error(f"more follows after the {count} samples of the header", rest)
        self.check_end()
        return numbers

    def check_end(self) -> None:
        """Refuse a file whose last number was cut off, as seen from the shape of those before.

        Raises:
            InvalidInput: the last line has no end and its last number is shorter than all others.
        """
        if self.ended:
            return
        tokens = _SEPARATORS.split(_RUN_TOGETHER.sub(" ", " ".join(self.lines[-12:]).strip()))
        shapes = [re.sub(r"\d", "0", re.sub(r"[-+]", "+", token)) for token in tokens]
        tails = [shape.partition(".")[2] for shape in shapes]
        if len(set(tails[-6:-1])) == 1 and len(tails[-1]) < len(tails[-2]):
            raise self.error(f"the last number {tokens[-1]!r} is cut off", len(self.lines) - 1)

    def find(self, pattern: str, start: int = 0, stop: int | None = None) -> tuple[int, re.Match]:
        """Return the first line (its index) that holds a pattern, and the match.

        Raises:
            InvalidInput: there is none.
        """
        search = re.compile(pattern, re.IGNORECASE).search
        for line in range(start, len(self.lines) if stop is None else stop):
            match = search(self.lines[line])
            if match:
                return line, match
        raise self.error(f"no line tells {pattern!r}: the header is damaged")

    def holds(self, pattern: str, stop: int) -> bool:
        """Tell whether one of the first lines holds a pattern."""
        search = re.compile(pattern, re.IGNORECASE).search
        return any(search(line) for line in self.lines[:stop])

    def header_length(self) -> int:
        """Return how many lines stand before the first line of numbers."""
        for line in range(len(self.lines)):
            if self.is_numeric(line):
                return line
        raise self.error("no line of numbers: not an accelerogram")

    def step(self, dt: float, line: int | None = None) -> float:
        """Return a sampling interval that can be meant [s].

        Raises:
            InvalidInput: it is not positive or longer than 0.1 s.
        """
        if not 0.0 < dt <= LONGEST_STEP:
            raise self.error(
                f"sampling interval {dt:g} s, expected more than 0 and up to 0.1 s", line
            )
        return dt

    def check_peak(self, samples: np.ndarray, stated: float, tolerance: float = 0.02) -> None:
        """Compare the samples with the peak that the header states, both in one unit.

        Raises:
            InvalidInput: they differ: samples, units or header are damaged.
        """
        peak = np.abs(samples).max()
        if abs(peak - abs(stated)) > tolerance * max(peak, abs(stated)):
            raise self.error(
                f"the header states a peak of {abs(stated):g}, the samples reach {peak:g}: "
                "one of them is damaged"
            )


def unit_named(name: str) -> float:
    """Return a unit of acceleration given by keyword [m/s²].

    Raises:
        InvalidInput: it is not one of g, m/s2, cm/s2, gal, mm/s2.
    """
    key = str(name).lower().replace("²", "2").replace("^", "").replace(" ", "")
    if key not in _NAMES:
        raise InvalidInput(f"units {name!r} are unknown: use one of {', '.join(_NAMES)}")
    return _NAMES[key]


def units_written(header: str) -> set[float]:
    """Return the units of acceleration that a header mentions [m/s²]."""
    found = set()
    for pattern, unit in _UNITS:
        header, count = re.subn(pattern, " ", header, flags=re.IGNORECASE)
        if count:
            found.add(unit)
    return found
