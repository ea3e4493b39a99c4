"""How long something holds, in records over time whose steps may differ in length.

Forces of a record are those, in the mean, of the step that ends with it; so a record lasts for the
length of that step. The first record, of the start, is taken to last as long as the second.
"""

from collections.abc import Callable, Iterable
from typing import TypeVar

import numpy as np

from archfem.arrays import Array

Found = TypeVar("Found")

ROUND_OFF = 1e-6
"""Relative: a time that is shorter than another by less is as long."""


def step_lengths(time: Array) -> Array:
    """Return how long each record lasts (steps,) [s]; a single one is of no length.

    Args:
        time: of the records (steps,) [s].
    """
    steps = np.diff(time)
    return np.concatenate([steps[:1] if len(steps) else np.zeros(1), steps])


class Unbroken:
    """Adds up for how long something holds without a break, step by step.

    Args:
        least: time for which it must hold to count [s].
    """

    def __init__(self, least: float) -> None:
        self._least, self._elapsed = (1.0 - ROUND_OFF) * least, 0.0

    def lasts(self, holds: bool, step: float) -> bool:
        """Take in one step, and say whether it has held for long enough.

        Args:
            holds: whether it does in this step.
            step: length of it [s].

        Returns:
            Whether it holds, and has for the least time, this step included.
        """
        self._elapsed = self._elapsed + step if holds else 0.0
        return holds and self._elapsed >= self._least


def first_lasting(
    instants: Iterable[int], time: Array, least: float, look: Callable[[int], Found | None]
) -> Found | None:
    """Find the first of what holds without a break for long enough.

    Args:
        instants: numbers of the records at which to look, in order; it does not hold at others.
        time: of all records (steps,) [s]. A single one tells of a state that stays.
        least: time for which it must hold [s].
        look: at a record; None where it does not hold.

    Returns:
        What was found at the beginning of that time, or None.
    """
    lengths, unbroken = step_lengths(time), Unbroken(least if len(time) > 1 else 0.0)
    before, first = -1, None
    for instant in map(int, instants):
        found = look(instant)
        if found is None or instant != before + 1:
            unbroken.lasts(False, 0.0)
            first = None
        before = instant
        if found is None:
            continue
        first = found if first is None else first
        if unbroken.lasts(True, float(lengths[instant])):
            return first
    return None
