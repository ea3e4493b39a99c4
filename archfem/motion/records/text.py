"""The text of a record file, its numbers, and errors that name file and line."""

import re
from collections import Counter
from dataclasses import dataclass
from math import isfinite
from os import PathLike
from pathlib import Path

import numpy as np

from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.files import content_of

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[EeDd][-+]?\d+)?"
"""Pattern of a number as Fortran and C print it."""

LONGEST_STEP = 0.1
"""Sampling slower than 10 Hz [s] cannot hold the shaking of a structure: a misread header."""

COUNT = r"\d{1,9}"
"""Pattern of a number of samples."""

_NUMERIC = re.compile(r"[\s\d+\-.,;EeDd]+", re.ASCII)
_DIGIT = re.compile(r"[0-9]")
_RUN_TOGETHER = re.compile(r"(?<=[\d.])(?=[-+])")
_ALIKE = 0.97  # share of numbers printed alike from which on the rest count as damaged


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
        """Return the text of a file: UTF-8 where it is that, else Western or Turkish in 8 bits.

        Args:
            path: the file.

        Raises:
            InvalidInput: there is no such file, it cannot be read, or it is not text.
        """
        content = content_of(path, "record").rstrip(b"\x1a")  # what ends a text under DOS
        place = Path(path)
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
        """Return the error that names the file and the line.

        Args:
            message: what is wrong, and what to do.
            line: index of the line, counted from 1 in the message; None is the whole file.
        """
        where = f"{self.path}" if line is None else f"{self.path}, line {line + 1}"
        return InvalidInput(f"{where}: {message}")

    def is_numeric(self, line: int) -> bool:
        """Return whether a line holds numbers and nothing else.

        Args:
            line: its index.
        """
        content = self.lines[line]
        return bool(_NUMERIC.fullmatch(content) and _DIGIT.search(content))

    def row(self, line: int, width: int | None = None) -> list[float]:
        """Return the numbers of one line; numbers run together are parted at their signs.

        Where that does not part them, a stated width of the columns does.

        Args:
            line: its index.
            width: of the columns, where the file states it.

        Raises:
            InvalidInput: something in the line is not a finite number.
        """
        content = self.lines[line].strip()
        if content and not self.is_numeric(line):
            raise self.error(f"numbers expected, got {content[:40]!r}", line)
        try:
            row = [float(token) for token in self._tokens(line, width)]
        except ValueError as error:
            raise self.error(f"not a number in {content[:40]!r}", line) from error
        if not all(map(isfinite, row)):
            raise self.error(f"a number too large in {content[:40]!r}", line)
        return row

    def _tokens(self, line: int, width: int | None) -> list[str]:
        """Return the parts of a line that should be numbers, with E for Fortran's D."""
        content = self.lines[line].upper().replace("D", "E")
        tokens = _RUN_TOGETHER.sub(" ", content).replace(",", " ").replace(";", " ").split()
        if width and not all(re.fullmatch(NUMBER, token) for token in tokens):
            return [content[at : at + width] for at in range(0, len(content.rstrip()), width)]
        return tokens

    def block(self, first: int, count: int, width: int | None = None) -> tuple[Array, int]:
        """Return as many numbers as a header states.

        Args:
            first: index of the line they begin in.
            count: how many there are.
            width: of the columns, where the file states it.

        Returns:
            The numbers (count,) and the index of the line after them.

        Raises:
            InvalidInput: the numbers end early, or do not end with a line.
        """
        if count < 1:
            raise self.error(f"the header states {count} samples")
        numbers: list[float] = []
        line = first
        while len(numbers) < count and line < len(self.lines):
            numbers.extend(self.row(line, width))
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
        """Refuse a number printed unlike nearly all others of its block: it has been damaged."""
        tails = [
            (len(token.partition(".")[2]), line)
            for line in range(first, end)
            for token in self._tokens(line, width)
        ]
        usual, times = Counter(length for length, _ in tails).most_common(1)[0]
        if _ALIKE * len(tails) < times < len(tails):
            line = next(line for length, line in tails if length != usual)
            raise self.error("a number has not as many digits as the others: it is damaged", line)

    def last_block(self, first: int, count: int) -> Array:
        """Return as many numbers as a header states, which end the file (count,).

        Args:
            first: index of the line they begin in.
            count: how many there are.

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
        last = range(max(len(self.lines) - 12, 0), len(self.lines))
        tokens = [token for line in last for token in self._tokens(line, None)]
        shapes = [re.sub(r"\d", "0", re.sub(r"[-+]", "+", token)) for token in tokens]
        tails = [shape.partition(".")[2] for shape in shapes]
        if len(set(tails[-6:-1])) == 1 and len(tails[-1]) < len(tails[-2]):
            raise self.error(f"the last number {tokens[-1]!r} is cut off", len(self.lines) - 1)

    def find(
        self, pattern: str, start: int = 0, stop: int | None = None
    ) -> tuple[int, re.Match[str]]:
        """Return the first line (its index) that holds a pattern, and the match.

        Args:
            pattern: regular expression; capitals do not matter.
            start: index of the first line searched.
            stop: index of the line after the last; None searches to the end.

        Raises:
            InvalidInput: there is none.
        """
        search = re.compile(pattern, re.IGNORECASE).search
        for line, content in enumerate(self.lines[start:stop], start):
            match = search(content)
            if match:
                return line, match
        raise self.error(f"no line tells {pattern!r}: the header is damaged")

    def holds(self, pattern: str, stop: int, start: int = 0) -> bool:
        """Return whether a line holds a pattern.

        Args:
            pattern: regular expression; capitals do not matter.
            stop: index of the line after the last searched.
            start: index of the first.
        """
        search = re.compile(pattern, re.IGNORECASE).search
        return any(search(line) for line in self.lines[start:stop])

    def header_length(self) -> int:
        """Return how many lines stand before the first line of numbers.

        Raises:
            InvalidInput: no line has numbers only.
        """
        for line in range(len(self.lines)):
            if self.is_numeric(line):
                return line
        raise self.error("no line of numbers: not an accelerogram")

    def step(self, dt: float, line: int | None = None) -> float:
        """Return a sampling interval that can be meant [s].

        Args:
            dt: as the file has it [s].
            line: index of the line that has it, for errors.

        Raises:
            InvalidInput: it is not positive or longer than 0.1 s.
        """
        if not 0.0 < dt <= LONGEST_STEP:
            raise self.error(
                f"sampling interval {dt:g} s, expected more than 0 and up to 0.1 s", line
            )
        return dt

    def check_peak(self, samples: Array, stated: float, tolerance: float = 0.02) -> None:
        """Compare the samples with the peak that the header states, both in one unit.

        Args:
            samples: accelerations (n,).
            stated: peak, of either sign.
            tolerance: difference that is accepted, by the larger peak [-].

        Raises:
            InvalidInput: they differ: samples, units or header are damaged.
        """
        peak = np.abs(samples).max()
        apart = abs(peak - abs(stated))
        if not (isfinite(apart) and apart <= tolerance * max(peak, abs(stated))):
            raise self.error(
                f"the header states a peak of {abs(stated):g}, the samples reach {peak:g}: "
                "one of them is damaged"
            )


def stated_width(line: str) -> int | None:
    """Return the width of the columns where a line states a Fortran format such as (8F10.3).

    Args:
        line: the line.
    """
    match = re.search(r"\(\s*\d+[FE](\d+)\.\d+\s*\)", line, re.IGNORECASE)
    return int(match[1]) if match else None
