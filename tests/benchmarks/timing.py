"""Clocks and tables."""

import time
from collections.abc import Callable
from typing import NamedTuple


class Clock(NamedTuple):
    """Time of one step.

    Attributes:
        wall: by the clock on the wall [ms].
        cpu: of the processor, all threads [ms].
    """

    wall: float
    cpu: float


def stopwatch() -> Callable[[], tuple[float, float]]:
    """Start two clocks; the function returned reads them, wall and processor [s]."""
    wall, cpu = time.perf_counter(), time.process_time()
    return lambda: (time.perf_counter() - wall, time.process_time() - cpu)


def least(run: Callable[[], tuple[float, float]], steps: int, repeat: int) -> Clock:
    """Repeat a run, which returns its seconds, and take the least time of a step."""
    times = [run() for _ in range(repeat)]
    return Clock(*(1e3 / steps * min(each[k] for each in times) for k in range(2)))


def watched(action: Callable[[], object]) -> Callable[[], tuple[float, float]]:
    """Wrap an action so that calling it returns its seconds."""

    def run() -> tuple[float, float]:
        watch = stopwatch()
        action()
        return watch()

    return run


def table(head: list[object], rows: list[list[object]]) -> str:
    """Write rows as a Markdown table, the first column to the left, the others to the right."""
    cells = [[_cell(value) for value in row] for row in (head, *rows)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    rule = [":" + "-" * (widths[0] - 1), *("-" * (width - 1) + ":" for width in widths[1:])]
    lines = [_line(cells[0], widths), _line(rule, widths)]
    return "\n".join([*lines, *(_line(row, widths) for row in cells[1:])])


def _cell(value: object) -> str:
    text = f"{value:.4g}" if isinstance(value, float) else str(value)
    return text.replace("|", r"\|")


def _line(cells: list[str], widths: list[int]) -> str:
    padded = [cell.rjust(width) for cell, width in zip(cells, widths, strict=True)]
    return "| " + " | ".join([cells[0].ljust(widths[0]), *padded[1:]]) + " |"
