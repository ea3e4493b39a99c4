"""`Falling`: rigid blocks from a pose and velocity to rest, with what they lose on the way."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numba
import numpy as np

from archfem.arguments import instance, real
from archfem.arrays import Array
from archfem.dynamics.falling.bodies import Bodies, bodies_of, check_dry
from archfem.dynamics.falling.carried import nothing_carried
from archfem.dynamics.falling.contact import room_for, world_of
from archfem.dynamics.falling.impacts import Laws, Room, step
from archfem.dynamics.falling.state import Balance, Frame, Loose
from archfem.errors import DidNotConverge, InvalidInput
from archfem.files import forget_stale
from archfem.masonry.structure import Structure
from archfem.motion.motion import Motion

SLOW = 0.05
"""Speed of approach [m/s] below which nothing bounces: that of a fall of 0.13 mm."""

SWEEPS, SETTLED = 500, 1e-5
"""Sweeps over the contacts of a step at most, and the relative change of an impulse that ends
them; what is left is made good in the steps that follow, which begin with its impulses."""

FIRST_SWEEPS, FIRST_SETTLED = 20000, 1e-8
"""The same for the first step of a run, which begins with none."""

RISE = 1e-4
"""Energy that a run may gain beyond the ground's work, relative to what was exchanged."""

NOISE = 1e-6
"""The same for a run that exchanges nothing: height, relative to the structure's size, to which
its weight would be lifted."""

STILL = 5e-4
"""Distance [m] within which every point of the blocks stays that have come to rest."""

LASTING = 0.5
"""Time [s] for which they do, on ground that rests."""

THROUGH = 0.2
"""Overlap, relative to the reach of the smallest block, at which blocks pass through each other."""

forget_stale(Path(__file__).parent)


@dataclass(frozen=True, eq=False)
class Falling:
    """Rigid blocks that hit each other and the ground, by the scheme of Moreau and Jean.

    It says where blocks go and where they come to lie. Forces in what stands are not its subject:
    of rigid blocks that touch at two points they are not unique.

    Args:
        structure: its blocks; fixed ones move with the ground.
        dt: time step [s].
        restitution: e, speed after over before an impact, 0 for stones that do not bounce [-].
        friction: coefficient between blocks that no joint connects, and to the ground; None takes
            the least of the structure's joints.
        level: height of the ground [m]; None takes the lowest point of the fixed blocks.

    Raises:
        InvalidInput: a number is out of range, no coefficient of friction is known, a joint has
            cohesion, or the ground lies above the foot of a free block.
    """

    structure: Structure
    dt: float = 5e-4
    restitution: float = 0.0
    friction: float | None = None
    level: float | None = None
    bodies: Bodies = field(init=False, repr=False)

    def __post_init__(self) -> None:
        instance(self.structure, Structure, "structure", "give a Structure")
        if not 1e-6 <= real(self.dt, "dt [s]") <= 0.01:
            raise InvalidInput(f"dt {self.dt:g} s is not between 1e-6 and 0.01 s: give 5e-4")
        if not 0.0 <= real(self.restitution, "restitution") <= 1.0:
            raise InvalidInput(f"restitution {self.restitution:g} is not between 0 and 1")
        check_dry(self.structure)
        bodies = bodies_of(self.structure, self.friction, self.level)
        object.__setattr__(self, "bodies", bodies)

    def frames(
        self, start: Loose, end: float, motion: Motion | None = None, *, spacing: float = 0.02
    ) -> Iterator[Frame]:
        """Step through time until all rests, or until an end, and give frames on the way.

        Args:
            start: poses and velocities.
            end: time at which to stop at the latest [s].
            motion: of the ground; None leaves it at rest.
            spacing: time between frames, a whole number of steps [s].

        Yields:
            The start, and frames at equal times; the last at rest, or at the end.

        Raises:
            InvalidInput: the start is not one of these blocks, or the times do not fit.
            DidNotConverge: energy came from nowhere, or the blocks' contacts cannot be counted.
        """
        self._check(start, end, spacing)
        run = _Run(self, start)
        yield run.frame(start.time, False)
        stride = max(1, round(spacing / self.dt))
        steps = int(np.ceil((end - start.time) / self.dt - 1e-6))
        anchor, since = start.poses, start.time
        for first, last in pairwise([*range(0, steps, stride), steps]):
            middles = start.time + self.dt * (np.arange(first, last) + 0.5)
            run.advance(np.zeros((last - first, 2)) if motion is None else motion.at(middles))
            time = start.time + self.dt * last
            shaken = motion is not None and time <= motion.duration
            if shaken or run.moved(anchor) > STILL:
                anchor, since = run.poses, time
            resting = time - since >= LASTING
            yield run.frame(time, resting)
            if resting:
                return

    def last(self, start: Loose, end: float, motion: Motion | None = None) -> Frame:
        """Return the last frame of a run, at rest or at its end.

        Args:
            start: poses and velocities.
            end: time at which to stop at the latest [s].
            motion: of the ground; None leaves it at rest.

        Raises:
            InvalidInput: as of `frames`.
            DidNotConverge: as of `frames`.
        """
        *_, frame = self.frames(start, end, motion)
        return frame

    def _check(self, start: Loose, end: float, spacing: float) -> None:
        """Refuse a start that is not one of these blocks, and times that do not fit."""
        instance(start, Loose, "start", "give a Loose, such as Loose.built(structure)")
        shape = (len(self.structure.blocks), 3)
        for name, values in (("poses", start.poses), ("velocities", start.velocities)):
            if np.shape(values) != shape or not np.all(np.isfinite(values)):
                raise InvalidInput(
                    f"{name} of shape {np.shape(values)}: give finite numbers of shape {shape}"
                )
        if not real(end, "end [s]") > start.time:
            raise InvalidInput(f"end {end:g} s is not after the start at {start.time:g} s")
        if real(spacing, "spacing [s]") < self.dt:
            raise InvalidInput(f"spacing {spacing:g} s is below the step {self.dt:g} s")


class _Run:
    """A run on its way.

    Args:
        falling: the blocks and their laws.
        start: poses and velocities.
    """

    def __init__(self, falling: Falling, start: Loose) -> None:
        self._falling, bodies = falling, falling.bodies
        self._q = np.array(start.poses, dtype=float)
        self._v = np.array(start.velocities, dtype=float)
        self._v[bodies.inverse[:-1, 0] == 0.0] = 0.0
        self._laws = Laws(
            falling.dt, falling.structure.gravity, falling.restitution, SLOW, SWEEPS, SETTLED
        )
        self._cold = True
        contacts = room_for(len(bodies.owner))
        self._room = Room(
            world_of(bodies),
            contacts,
            nothing_carried(contacts),
            np.empty_like(self._q),
            np.empty((len(contacts.key), 9)),
            np.zeros((len(self._q) + 1, 3)),
        )
        self._energy = np.array([_kinetic(bodies, self._v), 0.0, 0.0, 0.0, 0.0, 0.0])
        self._exchanged = float(self._energy[0])
        self._overlap, self._unsettled, self._time = 0.0, 0, start.time

    @property
    def poses(self) -> Array:
        """Where the blocks are (n_blocks, 3) [m, m, rad]."""
        return self._q.copy()

    def moved(self, before: Array) -> float:
        """Return by how much the farthest point has moved since the blocks had these poses (m)."""
        x, y, turn = (self._q - before).T
        return float(np.max(np.hypot(x, y) + self._falling.bodies.reach * np.abs(turn)))

    def advance(self, ground: Array) -> None:
        """Take steps."""
        if self._cold:
            self._take(ground[:1], self._laws._replace(sweeps=FIRST_SWEEPS, settled=FIRST_SETTLED))
            self._cold, ground = False, ground[1:]
        self._take(ground, self._laws)

    def _take(self, ground: Array, laws: Laws) -> None:
        """Take steps by these laws."""
        told = advance(
            self._falling.bodies,
            laws,
            self._room,
            (self._q, self._v, np.ascontiguousarray(ground), self._energy),
        )
        overlap, unsettled, exchanged = told
        if unsettled < 0:
            raise DidNotConverge(
                f"{len(self._falling.bodies.owner)} pieces touch at more points than pieces in the "
                f"plane can, near {self._time:.4g} s: blocks overlap by {self._overlap:.3g} m; "
                f"give a smaller dt than {self._falling.dt:g} s"
            )
        self._overlap = max(self._overlap, overlap)
        self._unsettled += unsettled
        self._exchanged = max(self._exchanged, exchanged)

    def frame(self, time: float, resting: bool) -> Frame:
        """Return the blocks as they are, once the energy is found to be right."""
        self._time = time
        self._check(time)
        balance = Balance(*self._energy[:5].tolist())
        told = balance, self._overlap, self._unsettled, resting
        return Frame(time, self._q.copy(), self._v.copy(), *told)

    def _check(self, time: float) -> None:
        """Refuse blocks that pass through each other, and energy from nowhere."""
        structure, bodies = self._falling.structure, self._falling.bodies
        if self._overlap > THROUGH * bodies.reach[list(structure.free)].min():
            raise DidNotConverge(
                f"by {time:.4g} s blocks overlap by {self._overlap:.3g} m and pass through each "
                f"other: begin with blocks apart, and give a smaller dt than {self._falling.dt:g} s"
            )
        noise = NOISE * structure.weight * structure.size
        gained, allowed = self._energy[4], RISE * self._exchanged + noise
        if not gained <= allowed:
            raise DidNotConverge(
                f"by {time:.4g} s the blocks have gained {gained:.3g} J from nowhere, of "
                f"{self._exchanged:.3g} J exchanged ({self._unsettled} steps whose impulses did "
                f"not settle): give a smaller dt than {self._falling.dt:g} s"
            )


@numba.njit(cache=True)
def advance(bodies, laws, room, state):  # type: ignore
    """Take steps.

    Args:
        bodies: that move.
        laws: that hold.
        room: to work with.
        state: poses and velocities, moved on (b, 3); mean acceleration of the ground over each step
            (steps, 2) [m/s²]; energies as in `Balance`, and the most that was lost at any time, all
            brought up to date (6,) [J].

    Returns:
        Deepest overlap [m]; steps whose impulses did not settle, -1 where there was no room for
        contacts; and the most energy that was exchanged [J].
    """
    q, v, ground, energy = state
    overlap, unsettled, exchanged = 0.0, 0, 0.0
    before = q.copy()
    for k in range(len(ground)):
        before[:] = q
        sweeps, deep = step(bodies, laws, room, q, v, ground[k])
        if sweeps < 0:
            return overlap, -1, exchanged
        overlap = max(overlap, deep)
        unsettled += sweeps > laws.sweeps
        work, rise = 0.0, 0.0
        for b in range(len(q)):
            moved = q[b] - before[b]
            mass = bodies.mass[b, 0]
            work -= mass * (ground[k, 0] * moved[0] + ground[k, 1] * moved[1])
            rise += mass * laws.gravity * moved[1]
        kinetic = _kinetic(bodies, v)
        energy[3] += work - rise - (kinetic - energy[0])
        energy[0] = kinetic
        energy[1] += rise
        energy[2] += work
        energy[5] = max(energy[5], energy[3])
        energy[4] = max(energy[4], energy[5] - energy[3])
        exchanged = max(exchanged, kinetic + energy[3])
    return overlap, unsettled, exchanged


@numba.njit(cache=True)
def _kinetic(bodies, v):  # type: ignore
    """Kinetic energy [J]."""
    found = 0.0
    for b in range(len(v)):
        m, inertia = bodies.mass[b]
        found += 0.5 * m * (v[b, 0] ** 2 + v[b, 1] ** 2) + 0.5 * inertia * v[b, 2] ** 2
    return found
