"""Many compiled steps at a time, and SNES for the one that does not settle."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from archfem.dynamics import Batch, State, Stepper
from archfem.joints import Facets
from archfem.kernel import ITERATIONS
from archfem.models.jointed import Jointed
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


def compiled_law(model: Jointed) -> tuple[bool, Array, Array, NDArray[np.intp]]:
    """The joint law as the compiled loops take it.

    Returns:
        Whether facets are exact, and for each point its stiffness (p,) [N/m], that of the whole
        facet where facets are exact, its arm (p,) [m] and its joint (p,).
    """
    points = model.joints.points
    stiffness = points.weight * points.normal_stiffness
    facets = isinstance(model.joints.law, Facets)
    if facets:
        stiffness = np.repeat(stiffness[0::2] + stiffness[1::2], 2)
    return facets, stiffness, points.arm, points.joint
