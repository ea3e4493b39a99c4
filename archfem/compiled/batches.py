"""Compiled steps, many at a time, and SNES for the one that does not settle."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem.compiled.kernel import ITERATIONS
from archfem.dynamics import Batch, State, Stepper
from archfem.joints import Facets
from archfem.models.jointed import Jointed
from archfem.structure import Array

BATCH = 128
"""Steps between two looks at events, Ctrl-C and the progress bar."""

STEPS = 2000
"""Steps over which set-up is spread where methods are compared."""

POINT = 0.45
"""What open points take of a step under strong motion, for each joint point there is [µs]."""


@dataclass(frozen=True, eq=False)
class Room:
    """What some compiled steps start from, and room for what they find.

    Attributes:
        series: coordinates, their velocity and acceleration, in the method's own coordinates; those
            at the start in [0], the others to be filled (steps + 1, 3, n).
        gap: openings that the law sees at the start (p,) [m].
        seen: acceleration of the ground where each step's equation is written (steps, 2) [m/s²].
        mean: its mean over each step (steps, 2) [m/s²].
        resultants: N, V, M, to be filled (steps, n_joints, 3) [N, N, N m].
        iterations: passes over the joints, to be filled (steps,).
        energy: as by `Meter.step`, to be filled (steps, 4) [J].
    """

    series: Array
    gap: Array
    seen: Array
    mean: Array
    resultants: Array
    iterations: NDArray[np.int64]
    energy: Array


class Method(Protocol):
    """A way to take steps that is compiled.

    Attributes:
        name: as users give it.
    """

    name: str

    def enter(self, vectors: Array) -> Array:
        """From displacements, velocities, … to the method's own coordinates (3, n)."""

    def leave(self, vectors: Array) -> Array:
        """Back from those (3, n)."""

    def take(self, dt: float, room: Room) -> int:
        """Take steps of a length up to the last, or up to one whose joints do not settle.

        Returns:
            How many were taken.
        """


class Reordered:
    """Coordinates in an order that suits the factor of a method.

    Args:
        order: numbers of the coordinates, the first one first (n,).
    """

    def __init__(self, order: NDArray[np.int64]) -> None:
        self._order = order
        self._place = np.argsort(order)

    def enter(self, vectors: Array) -> Array:
        """From coordinates to those in order (3, n)."""
        return vectors[:, self._order]

    def leave(self, vectors: Array) -> Array:
        """Back from those (3, n)."""
        return vectors[:, self._place]


class CompiledStepper:
    """Advances a model under a ground motion by a compiled method.

    A step that this gives up is taken by SNES instead.

    Args:
        method: takes the steps.
        exact: takes those that it leaves.
    """

    def __init__(self, method: Method, exact: Stepper) -> None:
        assert isinstance(exact.model, Jointed)
        self.method = method
        self.exact = exact
        self.name = method.name
        self.model = exact.model
        self.motion = exact.motion
        self.lag = exact.lag

    def at_rest(self, q: Array, time: float = 0.0) -> State:
        """The state of a structure at rest as the ground begins to move."""
        return self.exact.at_rest(q, time)

    def energy(self, state: State) -> Array:
        """Kinetic and potential energy of a state, and two zeros (4,) [J]."""
        return self.exact.energy(state)

    def batches(self, start: State, dt: float, end: float) -> Iterator[Batch]:
        """Yield the steps to the end, many at a time.

        Args:
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
            batch = self._batch(state, dt, times)
            if len(batch.times):
                yield batch
                done += len(batch.times)
                state = batch.state(len(batch.times) - 1)
            if len(batch.times) < len(times):
                (fallback,) = self.exact.batches(state, dt, state.time + dt)
                passes = fallback.iterations + ITERATIONS  # those in vain count too
                yield replace(fallback, iterations=passes, fallback=True)
                done += 1
                state = fallback.state(0)

    def _batch(self, state: State, dt: float, times: Array) -> Batch:
        """Take steps up to these times, or up to one whose joints do not settle."""
        steps, joints = len(times), self.model.operator
        start = self.method.enter(np.stack([state.q, state.velocity, state.acceleration]))
        series = np.empty((steps + 1, *start.shape))
        series[0] = start
        ground = self.motion.at(np.append(times[0] - dt, times))
        room = Room(
            series,
            joints.opening @ (state.q + self.lag * state.velocity),
            self.motion.at(times + self.exact.scheme.alpha * dt),
            0.5 * (ground[:-1] + ground[1:]),
            np.empty((steps, joints.points.count, 3)),
            np.zeros(steps, dtype=np.int64),
            np.empty((steps, 4)),
        )
        count = self.method.take(dt, room)
        return Batch(
            times[:count],
            room.resultants[:count],
            room.iterations[:count],
            np.full(count, dt),
            room.energy[:count],
            lambda k: State(float(times[k]), *self.method.leave(series[k + 1])),
        )


def compiled_law(model: Jointed) -> tuple[bool, Array, Array, NDArray[np.intp]]:
    """The joint law as the compiled loops take it.

    Returns:
        Whether facets are exact, and for each point its stiffness (p,) [N/m], that of the whole
        facet where facets are exact, its arm (p,) [m] and its joint (p,).
    """
    points = model.operator.points
    stiffness = points.weight * points.normal_stiffness
    facets = isinstance(model.operator.law, Facets)
    if facets:
        stiffness = np.repeat(stiffness[0::2] + stiffness[1::2], 2)
    return facets, stiffness, points.arm, points.joint


def shear_resultants(model: Jointed) -> sparse.csr_matrix:
    """Shear resultant of each joint from coordinates, sparse (n_joints, n)."""
    joints = model.operator
    return (joints.sums[0] @ joints.law.shear @ joints.slip).tocsr()
