"""Simulation of free rigid blocks with impacts and friction: frames, checks, and halved steps.

The steps themselves are in `time_stepping`.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from archfem._display import ProgressReport
from archfem._typing import Array
from archfem._validation import check_number, check_type, validate_methods
from archfem.dynamics.rigid_body import time_stepping
from archfem.dynamics.rigid_body.bodies import (
    Bodies,
    FallEnergy,
    FallFrame,
    LooseBlocks,
    Settling,
    check_rigid_blocks,
    make_bodies,
)
from archfem.dynamics.rigid_body.contact_detection import (
    allocate_contacts,
    allocate_pieces,
    allocate_stored_impulses,
)
from archfem.errors import DidNotConverge, Interrupted, InvalidInput, logger
from archfem.masonry.structure import Structure
from archfem.motion.motion import Motion

# Energy gained without work, over the energy exchanged, from which a run is refused: speeds, which
# vary with its root, then err by half a per cent [-]
REFUSED_ENERGY_GAIN = 1e-2

# The same for a run without exchange: lift of its weight, relative to the structure's size [-]
ENERGY_GAIN_NOISE = 1e-6

# Steps that are tried where none is given, until halving them changes little [s]
TRIED_STEPS = (5e-4, 2.5e-4, 1.25e-4, 6.25e-5)

# Largest change of a block's displacement by halving the step, below what verdicts distinguish: a
# doubt begins where a displacement is within a factor of 1.5 of a limit [-]
MAX_STEP_CHANGE = 0.2

# Free blocks up to which steps are tried; a fall of more takes minutes, and has the first of them
MAX_COMPARED_BLOCKS = 100

# Largest number of sweeps of the first step, which has no impulses of a step before
FIRST_STEP_SWEEPS = 20000


@validate_methods
@dataclass(frozen=True, eq=False)
class RigidBlockSimulation:
    """Free rigid blocks with impacts and friction, by the scheme of Moreau and Jean.

    The results are motions and final positions. Contact forces of standing blocks are not unique,
    since rigid blocks touch at two points, and are not computed. Cohesion acts where faces of
    blocks with a common joint touch at both ends of their common length, and on all of that.

    Attributes:
        bodies: masses, convex pieces and friction of the blocks.

    Args:
        structure: structure of the blocks; fixed ones move with the ground.
        dt: time step [s]. None halves steps, from 0.5 ms, until that changes no block's largest
            displacement by more than a fifth; more than 100 free blocks take 0.5 ms.
        restitution: e, ratio of normal speeds after and before an impact; 0 for stones [-].
        friction: coefficient between blocks without a common joint, and to the ground [-]; None
            takes the smallest of the structure's joints.
        level: height of the ground [m]; None takes the lowest point of the fixed blocks.
        rocking_ratio: angular velocity after over that before, where a face that turns about one
            end closes at the other: of all faces, or by names of joints [-]. None, and joints not
            named, take that of an impact at the closing end alone (Housner's of one block). It is
            the least that contact without tension keeps. A smaller ratio, as measured on rubber, is
            kept by a couple between the two blocks of the joint, which takes energy.

    Raises:
        InvalidInput: a number is out of range; there is no coefficient of friction; a joint has a
            bond or a law of its own; or the ground lies above the foot of a free block.
    """

    structure: Structure
    dt: float | None = None
    restitution: float = 0.0
    friction: float | None = None
    level: float | None = None
    rocking_ratio: float | Mapping[str, float] | None = None
    bodies: Bodies = field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_type(self.structure, Structure, "structure", "give a Structure")
        if self.dt is not None and not 1e-6 <= check_number(self.dt, "dt [s]") <= 0.01:
            raise InvalidInput(f"dt {self.dt:g} s is not between 1e-6 and 0.01 s: give 5e-4")
        if not 0.0 <= check_number(self.restitution, "restitution") <= 1.0:
            raise InvalidInput(f"restitution {self.restitution:g} is not between 0 and 1")
        check_rigid_blocks(self.structure)
        bodies = make_bodies(self.structure, self.friction, self.level, self.rocking_ratio)
        object.__setattr__(self, "bodies", bodies)

    def frames(
        self, start: LooseBlocks, end: float, motion: Motion | None = None, *, spacing: float = 0.02
    ) -> Iterator[FallFrame]:
        """Simulate until all blocks rest, or until an end, and yield frames on the way.

        Args:
            start: poses and velocities at the start.
            end: latest time of the end [s].
            motion: ground acceleration; None for a ground at rest.
            spacing: time between frames, a whole number of steps [s].

        Yields:
            The start, and frames at equal intervals; the last at rest, or at the end. Where no step
            is given, the last has `step_change`.

        Raises:
            InvalidInput: the start has other blocks, or the times do not fit.
            DidNotConverge: blocks pass through each other, the energy increases without work, or
                there are too many contacts. Where no step is given, `last` has the frames before,
                as after Ctrl-C.
        """
        self._check(start, end, spacing)
        if self.dt is not None:
            yield from self._take_steps(self.dt, start, end, motion, spacing)
        elif len(self.structure.free) > MAX_COMPARED_BLOCKS:
            yield from self._take_steps(TRIED_STEPS[0], start, end, motion, spacing)
        else:
            yield from self._halve_steps(start, end, motion, spacing)

    def _halve_steps(
        self, start: LooseBlocks, end: float, motion: Motion | None, spacing: float
    ) -> list[FallFrame]:
        """Return the frames by steps the half of which change little, or by the shortest ones."""
        frames, followed = list[FallFrame](), list[FallFrame]()
        failure, change = None, float("nan")
        for dt in TRIED_STEPS:
            finer: list[FallFrame] = []
            try:
                # frames before an error are kept
                finer.extend(self._take_steps(dt, start, end, motion, spacing))
            except DidNotConverge as error:
                logger.info("the fall is repeated with shorter steps: %s", error)
                failure, followed = error, finer
                continue
            except KeyboardInterrupt as error:
                raise Interrupted(frames or finer) from error
            change = self._step_change(frames, finer) if frames else float("nan")
            frames = finer
            balanced = frames[-1].energy.gained_share <= time_stepping.MAX_ENERGY_GAIN
            if change <= MAX_STEP_CHANGE and balanced:
                break
        if not frames:
            raise DidNotConverge(
                f"loose blocks could not be followed from {start.time:.4g} s on, by steps of "
                f"{1e3 * TRIED_STEPS[0]:g} to {1e3 * TRIED_STEPS[-1]:g} ms: {failure}",
                last=followed,
            ) from failure
        return [*frames[:-1], replace(frames[-1], step_change=change)]

    def _step_change(self, coarse: Sequence[FallFrame], fine: Sequence[FallFrame]) -> float:
        """Return the largest relative change of any block's largest or last displacement [-]."""
        # a block that has moved by half its size and stays there is lost, wherever it rests
        free = list(self.structure.free)
        lost = 0.5 * np.sqrt([self.structure.blocks[number].area for number in free])
        reach = self.bodies.reach[free]
        largest = []
        for frames in (coarse, fine):
            moved = np.array([frame.poses[free] - frames[0].poses[free] for frame in frames])
            bounds = np.hypot(moved[..., 0], moved[..., 1]) + reach * np.abs(moved[..., 2])
            largest.append(np.minimum([bounds.max(axis=0), bounds[-1]], lost))
        # what is small beside a block is compared with a fiftieth of that, and what is last with it
        scale = np.array([np.maximum(np.maximum(*largest)[0], 0.02 * lost), lost])
        return float(np.max(np.abs(largest[1] - largest[0]) / scale))

    def _take_steps(
        self, dt: float, start: LooseBlocks, end: float, motion: Motion | None, spacing: float
    ) -> Iterator[FallFrame]:
        """Yield the frames by steps of one length [s]."""
        run = _Run(self, dt, start)
        yield run.frame(start.time, False)
        stride = max(1, round(spacing / dt))
        steps = int(np.ceil((end - start.time) / dt - 1e-6))
        anchor, since = start.poses, start.time
        still = 0.0 if motion is None else end - motion.duration
        after = f" ({still:.3g} s after the motion)" * bool(still > 0.0)
        with ProgressReport("loose blocks", end - start.time, rarely=True) as progress:
            for first, last in pairwise([*range(0, steps, stride), steps]):
                middles = start.time + dt * (np.arange(first, last) + 0.5)
                run.advance(np.zeros((last - first, 2)) if motion is None else motion.at(middles))
                time = start.time + dt * last
                shaken = motion is not None and time <= motion.duration
                # at rest: no point moves by more than 0.5 mm in half a second on a ground at rest
                if shaken or run.largest_displacement(anchor) > 5e-4:
                    anchor, since = run.poses, time
                resting = time - since >= 0.5
                words = f"{time:.3g} of {end:.3g} s at most{after}, by steps of {1e3 * dt:g} ms"
                progress.show(words, dt * (last - first))
                yield run.frame(time, resting)
                if resting:
                    return

    def final_frame(
        self, start: LooseBlocks, end: float, motion: Motion | None = None
    ) -> FallFrame:
        """Return the last frame of a simulation, at rest or at its end.

        Args:
            start: poses and velocities at the start.
            end: latest time of the end [s].
            motion: ground acceleration; None for a ground at rest.

        Returns:
            The frame, with energies and the deepest overlap since the start.

        Raises:
            InvalidInput: as `frames`.
            DidNotConverge: as `frames`.
        """
        *_, frame = self.frames(start, end, motion)
        return frame

    def _check(self, start: LooseBlocks, end: float, spacing: float) -> None:
        """Refuse a start with other blocks, and times that do not fit."""
        check_type(start, LooseBlocks, "start", "give LooseBlocks.as_built(structure), or the like")
        shape = (len(self.structure.blocks), 3)
        for name, values in (("poses", start.poses), ("velocities", start.velocities)):
            if np.shape(values) != shape or not np.all(np.isfinite(values)):
                raise InvalidInput(
                    f"{name} of shape {np.shape(values)}: give finite numbers of shape {shape}"
                )
        if not check_number(end, "end [s]") > start.time:
            raise InvalidInput(f"end {end:g} s is not after the start at {start.time:g} s")
        step = TRIED_STEPS[0] if self.dt is None else self.dt
        if check_number(spacing, "spacing [s]") < step:
            raise InvalidInput(f"spacing {spacing:g} s is below the step {step:g} s")


def prepare_steps(
    simulation: RigidBlockSimulation, dt: float
) -> tuple[time_stepping.StepParameters, time_stepping.StepWorkspace]:
    """Return parameters and workspace of the time steps of a length [s]."""
    structure, bodies = simulation.structure, simulation.bodies
    weight_speed = structure.gravity * dt
    # a rocking ratio follows from velocities before the impact, which foreseen contacts change
    has_ratio = bool(bodies.rocking.any())
    parameters = time_stepping.StepParameters(
        *(dt, structure.gravity, 0.0 if has_ratio else 0.5 * dt, simulation.restitution),
        # impacts below 0.05 m/s, the speed of a fall by 0.13 mm, do not bounce
        *(0.05, 2.0 * weight_speed),
        time_stepping.MAX_SWEEPS * -(-len(structure.free) // 100),
        time_stepping.SETTLED * weight_speed,
        ENERGY_GAIN_NOISE * structure.weight * structure.size,
    )
    contacts, count = allocate_contacts(len(bodies.owner)), len(bodies.mass)
    workspace = time_stepping.StepWorkspace(
        allocate_pieces(bodies),
        contacts,
        allocate_stored_impulses(contacts),
        np.empty((count, 3)),
        np.empty((len(contacts.key), 17)),
        np.zeros((count + 1, 3)),
        *(
            time_stepping.SweepResult(np.zeros((count + 1, 3)), np.zeros((len(contacts.key), 3)))
            for _ in range(2)
        ),
    )
    return parameters, workspace


class _Run:
    """State and workspace of a simulation."""

    def __init__(self, simulation: RigidBlockSimulation, dt: float, start: LooseBlocks) -> None:
        self._simulation, self._dt, bodies = simulation, dt, simulation.bodies
        self._q = np.array(start.poses, dtype=float)
        self._v = np.array(start.velocities, dtype=float)
        self._v[bodies.inverse_mass[:-1, 0] == 0.0] = 0.0
        # speed of a free fall after one step
        self._weight_speed = simulation.structure.gravity * dt
        self._parameters, self._workspace = prepare_steps(simulation, dt)
        self._is_first = True
        # fields of FallEnergy, then the largest loss and the largest energy exchanged so far, and
        # what is left of the strain energy [J]
        kinetic = time_stepping.kinetic_energy(bodies, self._v)
        self._energy = np.array([kinetic, *[0.0] * 5, kinetic, start.strain_energy])
        # fields of Settling
        self._settling = np.zeros(4)
        self._overlap, self._time = 0.0, start.time

    @property
    def poses(self) -> Array:
        """Poses of the blocks (n_blocks, 3) [m, m, rad]."""
        return self._q.copy()

    def largest_displacement(self, before: Array) -> float:
        """Return an upper bound of the displacement of any point since some poses [m]."""
        x, y, rotation = (self._q - before).T
        reach = self._simulation.bodies.reach
        return float(np.max(np.hypot(x, y) + reach * np.abs(rotation)))

    def advance(self, ground: Array) -> None:
        """Advance by steps with ground accelerations (steps, 2) [m/s²]."""
        if self._is_first:
            strict = self._parameters._replace(
                max_sweeps=FIRST_STEP_SWEEPS, tolerance=1e-3 * self._parameters.tolerance
            )
            self._advance(ground[:1], strict)
            # it aims at less than the stated residual, by which it counts as the other steps do
            self._settling[1] = self._settling[0] > self._parameters.tolerance
            self._is_first, ground = False, ground[1:]
        self._advance(ground, self._parameters)

    def _advance(self, ground: Array, parameters: time_stepping.StepParameters) -> None:
        """Advance by steps with parameters."""
        ground = np.ascontiguousarray(ground)
        overlap, is_crowded = time_stepping.advance_steps(
            self._simulation.bodies,
            parameters,
            self._workspace,
            (self._q, self._v, ground, self._energy, self._settling),
        )
        self._overlap = max(self._overlap, overlap)
        if is_crowded:
            raise DidNotConverge(
                f"{len(self._simulation.bodies.owner)} pieces touch at more points than pieces in "
                f"the plane can, near {self._time:.4g} s: blocks overlap by {self._overlap:.3g} m; "
                f"give a smaller dt than {self._dt:g} s"
            )

    def frame(self, time: float, resting: bool) -> FallFrame:
        """Return the present frame after checks of overlap and energy."""
        self._time = time
        self._check(time)
        kinetic, potential, work, lost, gained = self._energy[:5].tolist()
        beyond = max(gained - self._parameters.energy_noise, 0.0)
        share = beyond / max(float(self._energy[6]), np.finfo(float).tiny)
        residual, *counts = self._settling.tolist()
        settling = Settling(residual / self._weight_speed, *map(int, counts))
        energy = FallEnergy(kinetic, potential, work, lost, gained, share)
        poses, velocities = self._q.copy(), self._v.copy()
        return FallFrame(time, poses, velocities, energy, self._overlap, settling, resting)

    def _check(self, time: float) -> None:
        """Refuse blocks that pass through each other, and energy gained without work."""
        structure, bodies = self._simulation.structure, self._simulation.bodies
        # beyond a fifth of the smallest block, the edge of least overlap may be the opposite one
        if self._overlap > 0.2 * bodies.reach[list(structure.free)].min():
            raise DidNotConverge(
                f"by {time:.4g} s blocks overlap by {self._overlap:.3g} m and pass through each "
                "other: begin with blocks apart, and give a smaller dt than "
                f"{self._dt:g} s"
            )
        noise = self._parameters.energy_noise
        gained, allowed = self._energy[4], REFUSED_ENERGY_GAIN * self._energy[6] + noise
        if not gained <= allowed:
            raise DidNotConverge(
                f"by {time:.4g} s the blocks have gained {gained:.3g} J without work, of "
                f"{self._energy[6]:.3g} J exchanged (impulses of {self._settling[1]:.0f} steps did "
                f"not settle): give a smaller dt than {self._dt:g} s"
            )
