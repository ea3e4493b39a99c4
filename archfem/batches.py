"""Many compiled steps at a time, and SNES for the one that does not settle."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from archfem.dynamics import Batch, State, Stepper
from archfem.kernel import ITERATIONS
from archfem.structure import Array

BATCH = 128
"""Steps between two looks at events, Ctrl-C and the progress bar."""

Take = Callable[[State, float, Array], tuple[Batch, bool]]
"""Takes steps of a length from a state to some times; whether it took them all."""


def in_batches(
    take: Take, exact: Stepper, start: State, *, dt: float, end: float
) -> Iterator[Batch]:
    """Yield the steps to the end, many at a time.

    Args:
        take: the compiled steps.
        exact: takes the step that those leave.
        start: state from which to go.
        dt: time step [s].
        end: time of the last step [s].

    Raises:
        DidNotConverge: SNES failed as well; `last` is the state before.
    """
    total = round((end - start.time) / dt)
    state, done = start, 0
    while done < total:
        times = start.time + dt * np.arange(done + 1, min(done + BATCH, total) + 1)
        batch, complete = take(state, dt, times)
        if len(batch.times):
            yield batch
            done += len(batch.times)
            state = batch.state(len(batch.times) - 1)
        if not complete:
            (fallback,) = exact.batches(state, dt, state.time + dt)
            passes = fallback.iterations + ITERATIONS  # those in vain count too
            yield replace(fallback, iterations=passes, fallback=True)
            done += 1
            state = fallback.state(0)
