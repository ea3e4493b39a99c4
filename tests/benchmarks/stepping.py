"""Runs of a time history whose steps can be taken again and again, for timing."""

import os
import time
from collections.abc import Callable, Iterator
from functools import cached_property
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from timing import Clock, least, watched

import archfem as af


class SteppedRun:
    """A time history, and its stepper without recording.

    Args:
        call: calls `af.time_history`, with steps of a fixed length.

    Attributes:
        call: the argument.
        history: result of the first call.
        method: method that takes the steps.
        steps: number of steps.
        iterations: mean number of iterations a step.
        fallbacks: number of steps that SNES takes over from another method.
    """

    def __init__(self, call: Callable[[], af.History]) -> None:
        self.call, self._original = call, af.dynamics.Stepper.batches
        self._arguments: tuple[Any, ...] = ()
        self.steps, self.fallbacks, iterations = 0, 0, 0

        def batches(*arguments: Any) -> Iterator[af.dynamics.Batch]:
            nonlocal iterations
            self._arguments = arguments
            for batch in self._original(*arguments):
                self.steps += len(batch.times)
                self.fallbacks += batch.fallback * len(batch.times)
                iterations += int(batch.iterations.sum())
                yield batch

        # This call also compiles, and fills caches which later ones use.
        with patch.object(af.dynamics.Stepper, "batches", batches):
            self.history = call()
        self.method = self._arguments[0].name
        self.iterations = iterations / self.steps

    @cached_property
    def setup(self) -> float:
        """Measure the wall time from another call to its first step [s]."""
        first = []

        def batches(*arguments: Any) -> Iterator[af.dynamics.Batch]:
            first.append(time.perf_counter())
            return self._original(*arguments)

        begun = time.perf_counter()
        with patch.object(af.dynamics.Stepper, "batches", batches):
            self.call()
        return first[0] - begun

    def take_steps(self) -> None:
        """Take all steps and record nothing."""
        taken = 0
        for batch in self._original(*self._arguments):
            taken += len(batch.times)
            if taken >= self.steps:  # the run may have ended by an event
                break

    def time_steps(self, repeat: int) -> Clock:
        """Time a step without recording."""
        return least(watched(self.take_steps), self.steps, repeat)

    def time_call(self, repeat: int) -> Clock:
        """Time the whole call: set-up, steps and recording, divided by the number of steps."""
        return least(watched(self.call), self.steps, repeat)

    @property
    def largest_eccentricity(self) -> float:
        """Return the largest |e| over joints and steps [-]."""
        return float(np.nanmax(np.abs(self.history.joints["eccentricity"].values)))


def peak_memory() -> float:
    """Return the largest memory that this process has held [MB].

    `getrusage` would include the memory of the process that started this one.
    """
    status = Path(f"/proc/{os.getpid()}/status").read_text(encoding="ascii")
    return int(status.split("VmHWM:")[1].split()[0]) / 1024.0
