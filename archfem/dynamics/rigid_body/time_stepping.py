"""Moreau-Jean time stepping of free rigid blocks with impacts and friction, until they rest.

With θ = ½ and H the rows of normal and tangential relative velocity at the contacts found at the
middle of the step, q + ½ Δt v,

    M (v₁ - v₀) = Δt p + Hᵀ P,   0 <= u_N1 + e u_N0 ⊥ P_N >= 0,   q₁ = q₀ + ½ Δt (v₀ + v₁),

|P_T| <= μ P_N, and P_T opposes u_T1 where that is not zero (Moreau, in: Nonsmooth Mechanics and
Applications, 1988; Jean, Comput. Methods Appl. Mech. Eng. 177 (1999) 235). Projected Gauss-Seidel
sweeps over the contacts solve for the impulses P, from those of the step before. Impulses that do
no work need not converge within a step; sweeps continue while unconverged impulses add energy.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from archfem._numba import allocating_entry, delete_stale_cache
from archfem._typing import Array
from archfem._validation import check_number, check_type, validate_methods
from archfem.dynamics.rigid_body.bodies import (
    Bodies,
    FallEnergy,
    FallFrame,
    LooseBlocks,
    check_cohesionless,
    make_bodies,
)
from archfem.dynamics.rigid_body.contact_detection import (
    Contacts,
    PlacedPieces,
    StoredImpulses,
    allocate_contacts,
    allocate_pieces,
    allocate_stored_impulses,
    find_contacts,
    place_pieces,
    restore_impulses,
    store_impulses,
)
from archfem.errors import DidNotConverge, InvalidInput
from archfem.masonry.structure import Structure
from archfem.motion.motion import Motion

# Largest number of sweeps over the contacts of a step; the residual is corrected in later steps
MAX_SWEEPS = 500

# The same for the first step of a run, without impulses of a step before
FIRST_STEP_SWEEPS = 20000

# Energy that a run may gain beyond the work of the ground, relative to the energy exchanged [-]
MAX_ENERGY_GAIN = 1e-4

# The same for a run without exchange: lift of its weight, relative to the structure's size [-]
ENERGY_GAIN_NOISE = 1e-6

delete_stale_cache(Path(__file__).parent)


class StepParameters(NamedTuple):
    """Parameters of all steps."""

    dt: float  # Δt [s]
    gravity: float  # downward [m/s²]
    restitution: float  # e [-]
    min_impact_speed: float  # speed of approach below which e is zero [m/s]
    max_sweeps: int  # over the contacts of a step
    tolerance: float  # on the change of an impulse in a sweep, relative to the largest [-]


class StepWorkspace(NamedTuple):
    """Workspace of the time steps."""

    world: PlacedPieces
    contacts: Contacts
    stored: StoredImpulses
    middle: Array  # poses at the middle of the step (b, 3)
    # of each contact: cross products of the arms with the normal, first and second body, and with
    # the tangent; 1/(H M⁻¹ Hᵀ) of normal and tangent; target u_N and u_T; μ (c, 9)
    rows: Array
    speeds: Array  # velocities during the sweeps, the ground's last (b + 1, 3)


@validate_methods
@dataclass(frozen=True, eq=False)
class RigidBlockSimulation:
    """Free rigid blocks with impacts and friction, by the scheme of Moreau and Jean.

    The results are motions and final positions. Contact forces of standing blocks are not unique,
    since rigid blocks touch at two points, and are not computed.

    Attributes:
        bodies: masses, convex pieces and friction of the blocks.

    Args:
        structure: structure of the blocks; fixed ones move with the ground.
        dt: time step [s].
        restitution: e, ratio of normal speeds after and before an impact; 0 for stones [-].
        friction: coefficient between blocks without a common joint, and to the ground [-]; None
            takes the smallest of the structure's joints.
        level: height of the ground [m]; None takes the lowest point of the fixed blocks.

    Raises:
        InvalidInput: a number is out of range, there is no coefficient of friction, a joint has
            cohesion, or the ground lies above the foot of a free block.
    """

    structure: Structure
    dt: float = 5e-4
    restitution: float = 0.0
    friction: float | None = None
    level: float | None = None
    bodies: Bodies = field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_type(self.structure, Structure, "structure", "give a Structure")
        if not 1e-6 <= check_number(self.dt, "dt [s]") <= 0.01:
            raise InvalidInput(f"dt {self.dt:g} s is not between 1e-6 and 0.01 s: give 5e-4")
        if not 0.0 <= check_number(self.restitution, "restitution") <= 1.0:
            raise InvalidInput(f"restitution {self.restitution:g} is not between 0 and 1")
        check_cohesionless(self.structure)
        bodies = make_bodies(self.structure, self.friction, self.level)
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
            The start, and frames at equal intervals; the last at rest, or at the end.

        Raises:
            InvalidInput: the start has other blocks, or the times do not fit.
            DidNotConverge: the energy increases without work, or there are too many contacts.
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
            # at rest: no point moves by more than 0.5 mm in half a second on a ground at rest
            if shaken or run.largest_displacement(anchor) > 5e-4:
                anchor, since = run.poses, time
            resting = time - since >= 0.5
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
        if check_number(spacing, "spacing [s]") < self.dt:
            raise InvalidInput(f"spacing {spacing:g} s is below the step {self.dt:g} s")


class _Run:
    """State and workspace of a simulation."""

    def __init__(self, simulation: RigidBlockSimulation, start: LooseBlocks) -> None:
        self._simulation, bodies = simulation, simulation.bodies
        self._q = np.array(start.poses, dtype=float)
        self._v = np.array(start.velocities, dtype=float)
        self._v[bodies.inverse_mass[:-1, 0] == 0.0] = 0.0
        # impacts below 0.05 m/s, the speed of a fall by 0.13 mm, do not bounce
        self._parameters = StepParameters(
            *(simulation.dt, simulation.structure.gravity, simulation.restitution),
            *(0.05, MAX_SWEEPS, 1e-5),
        )
        self._is_first = True
        contacts = allocate_contacts(len(bodies.owner))
        self._workspace = StepWorkspace(
            allocate_pieces(bodies),
            contacts,
            allocate_stored_impulses(contacts),
            np.empty_like(self._q),
            np.empty((len(contacts.key), 9)),
            np.zeros((len(self._q) + 1, 3)),
        )
        # fields of FallEnergy, then the largest loss so far [J]
        self._energy = np.array([_kinetic_energy(bodies, self._v), 0.0, 0.0, 0.0, 0.0, 0.0])
        self._exchanged = float(self._energy[0])
        self._overlap, self._unconverged_steps, self._time = 0.0, 0, start.time

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
            strict = self._parameters._replace(max_sweeps=FIRST_STEP_SWEEPS, tolerance=1e-8)
            self._advance(ground[:1], strict)
            self._is_first, ground = False, ground[1:]
        self._advance(ground, self._parameters)

    def _advance(self, ground: Array, parameters: StepParameters) -> None:
        """Advance by steps with parameters."""
        overlap, unconverged_steps, exchanged = advance_steps(
            self._simulation.bodies,
            parameters,
            self._workspace,
            (self._q, self._v, np.ascontiguousarray(ground), self._energy),
        )
        if unconverged_steps < 0:
            raise DidNotConverge(
                f"{len(self._simulation.bodies.owner)} pieces touch at more points than pieces in "
                f"the plane can, near {self._time:.4g} s: blocks overlap by {self._overlap:.3g} m; "
                f"give a smaller dt than {self._simulation.dt:g} s"
            )
        self._overlap = max(self._overlap, overlap)
        self._unconverged_steps += unconverged_steps
        self._exchanged = max(self._exchanged, exchanged)

    def frame(self, time: float, resting: bool) -> FallFrame:
        """Return the present frame after checks of overlap and energy."""
        self._time = time
        self._check(time)
        energy = FallEnergy(*self._energy[:5].tolist())
        results = energy, self._overlap, self._unconverged_steps, resting
        return FallFrame(time, self._q.copy(), self._v.copy(), *results)

    def _check(self, time: float) -> None:
        """Refuse blocks that pass through each other, and energy gained without work."""
        structure, bodies = self._simulation.structure, self._simulation.bodies
        # beyond a fifth of the smallest block, the edge of least overlap may be the opposite one
        if self._overlap > 0.2 * bodies.reach[list(structure.free)].min():
            raise DidNotConverge(
                f"by {time:.4g} s blocks overlap by {self._overlap:.3g} m and pass through each "
                "other: begin with blocks apart, and give a smaller dt than "
                f"{self._simulation.dt:g} s"
            )
        noise = ENERGY_GAIN_NOISE * structure.weight * structure.size
        gained, allowed = self._energy[4], MAX_ENERGY_GAIN * self._exchanged + noise
        if not gained <= allowed:
            raise DidNotConverge(
                f"by {time:.4g} s the blocks have gained {gained:.3g} J from nowhere, of "
                f"{self._exchanged:.3g} J exchanged ({self._unconverged_steps} steps without "
                f"convergence of impulses): give a smaller dt than {self._simulation.dt:g} s"
            )


@allocating_entry
def advance_steps(bodies, parameters, workspace, state):  # type: ignore
    """Advance poses and velocities by steps, with their energies.

    Returns the deepest overlap, the number of unconverged steps, and the largest energy exchanged.
    """
    q, v, ground, energy = state
    overlap, unconverged, exchanged = 0.0, 0, 0.0
    before = q.copy()
    for k in range(len(ground)):
        before[:] = q
        sweeps, deepest = take_step(bodies, parameters, workspace, q, v, ground[k])
        if sweeps < 0:
            return overlap, -1, exchanged
        overlap = max(overlap, deepest)
        unconverged += sweeps > parameters.max_sweeps
        # work of the inertia forces of the ground motion, and potential energy of the weight
        work, rise = 0.0, 0.0
        for b in range(len(q)):
            moved = q[b] - before[b]
            mass = bodies.mass[b, 0]
            work -= mass * (ground[k, 0] * moved[0] + ground[k, 1] * moved[1])
            rise += mass * parameters.gravity * moved[1]
        # the loss is the rest of the balance
        kinetic = _kinetic_energy(bodies, v)
        energy[3] += work - rise - (kinetic - energy[0])
        energy[0] = kinetic
        energy[1] += rise
        energy[2] += work
        # a loss below its maximum is energy gained
        energy[5] = max(energy[5], energy[3])
        energy[4] = max(energy[4], energy[5] - energy[3])
        exchanged = max(exchanged, kinetic + energy[3])
    return overlap, unconverged, exchanged


@allocating_entry
def _kinetic_energy(bodies, v):  # type: ignore
    """Return the kinetic energy of all bodies [J]."""
    kinetic = 0.0
    for b in range(len(v)):
        m, inertia = bodies.mass[b]
        kinetic += 0.5 * m * (v[b, 0] ** 2 + v[b, 1] ** 2) + 0.5 * inertia * v[b, 2] ** 2
    return kinetic


@allocating_entry
def take_step(bodies, parameters, workspace, q, v, ground):  # type: ignore
    """Advance by one step; return the number of sweeps, -1 for too many contacts, and overlap."""
    contacts, stored, middle, speeds = (
        workspace.contacts,
        workspace.stored,
        workspace.middle,
        workspace.speeds,
    )
    # contacts at the middle of the step, with the impulses of the step before
    half, count = 0.5 * parameters.dt, len(q)
    middle[:] = q + half * v
    place_pieces(bodies, middle, workspace.world)
    touching = find_contacts(bodies, workspace.world, contacts)
    if touching < 0:
        return -1, 0.0
    restore_impulses(bodies, middle, contacts, touching, stored)
    # targets follow from the velocities before the step, hence first
    speeds[:count] = v
    speeds[count] = 0.0
    _prepare_rows(bodies, parameters, workspace, touching)
    # free velocities: inertia forces of the ground motion, and weight
    for b in range(count):
        if bodies.inverse_mass[b, 0] > 0.0:
            speeds[b, 0] -= parameters.dt * ground[0]
            speeds[b, 1] -= parameters.dt * (parameters.gravity + ground[1])
    _apply_initial_impulses(bodies, workspace, touching)
    # unconverged impulses must not add energy: up to 40 times as many sweeps
    for _ in range(40):
        sweeps = _sweep_contacts(bodies, parameters, workspace, touching)
        if sweeps <= parameters.max_sweeps or not _adds_energy(
            bodies, parameters, v, speeds, ground
        ):
            break
    store_impulses(bodies, middle, contacts, touching, stored)
    # trapezoidal rule for the poses
    q += half * (v + speeds[:count])
    v[:] = speeds[:count]
    overlap = 0.0
    for k in range(touching):
        overlap = max(overlap, -contacts.gap[k])
    return sweeps, overlap


@allocating_entry
def _prepare_rows(bodies, parameters, workspace, touching):  # type: ignore
    """Compute the rows of H, their inverse effective masses, and the target velocities."""
    contacts, rows = workspace.contacts, workspace.rows
    speeds, middle = workspace.speeds, workspace.middle
    for k in range(touching):
        a, b = contacts.bodies[k]
        nx, ny = contacts.normal[k]
        (ma, ia), (mb, ib) = bodies.inverse_mass[a], bodies.inverse_mass[b]
        # moment arms of normal (n) and tangential (t) impulses
        xa, ya = _arm(bodies, middle, contacts.point[k], a)
        xb, yb = _arm(bodies, middle, contacts.point[k], b)
        na, ta = xa * ny - ya * nx, xa * nx + ya * ny
        nb, tb = xb * ny - yb * nx, xb * nx + yb * ny
        rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3] = na, nb, ta, tb
        # effective masses 1/(H M⁻¹ Hᵀ)
        rows[k, 4] = 1.0 / (ma + mb + ia * na * na + ib * nb * nb)
        rows[k, 5] = 1.0 / (ma + mb + ia * ta * ta + ib * tb * tb)
        # Newton's impact law, without rebound of slow impacts
        before = _relative_speed(speeds, (a, b), (nx, ny), (na, nb))
        bounce = -parameters.restitution * before if before < -parameters.min_impact_speed else 0.0
        # Centripetal accelerations ω² r change the relative velocity in half a step by ½ Δt times
        # their difference. Targets hold at the end of the step: a block that turns about its corner
        # then conserves its energy to O(Δt²)
        spin_a, spin_b = speeds[a, 2] ** 2, speeds[b, 2] ** 2
        pull_x, pull_y = spin_a * xa - spin_b * xb, spin_a * ya - spin_b * yb
        rows[k, 6] = bounce - 0.5 * parameters.dt * (pull_x * nx + pull_y * ny)
        rows[k, 7] = -0.5 * parameters.dt * (pull_y * nx - pull_x * ny)
        rows[k, 8] = bodies.friction[a, b]


@allocating_entry
def _arm(bodies, q, point, body):  # type: ignore
    """Return the vector from a body's centroid to a point; zero for the ground, which is fixed."""
    if body == len(q):
        return 0.0, 0.0
    x = point[0] - bodies.centre[body, 0] - q[body, 0]
    return x, point[1] - bodies.centre[body, 1] - q[body, 1]


@allocating_entry
def _relative_speed(speeds, pair, direction, arms):  # type: ignore
    """Return the velocity of the second body relative to the first along a direction."""
    one, two = speeds[pair[0]], speeds[pair[1]]
    translation = (two[0] - one[0]) * direction[0] + (two[1] - one[1]) * direction[1]
    return translation + arms[1] * two[2] - arms[0] * one[2]


@allocating_entry
def _apply_impulse(bodies, speeds, pair, direction, arms, impulse):  # type: ignore
    """Apply an impulse along a direction to the second body, and its reaction to the first."""
    for side in range(2):
        m, inertia = bodies.inverse_mass[pair[side]]
        body, signed = speeds[pair[side]], impulse if side else -impulse
        body[0] += m * direction[0] * signed
        body[1] += m * direction[1] * signed
        body[2] += inertia * arms[side] * signed


@allocating_entry
def _adds_energy(bodies, parameters, before, after, ground):  # type: ignore
    """Return whether the impulses of a step have done positive work, beyond the tolerance."""
    work = kinetic = 0.0
    for b in range(len(before)):
        m, inertia = bodies.mass[b]
        if bodies.inverse_mass[b, 0] == 0.0:
            continue
        # impulse m (v₁ - v₀ + Δt a) times the mean velocity
        (x0, y0, w0), (x1, y1, w1) = before[b], after[b]
        along = x1 - x0 + parameters.dt * ground[0]
        up = y1 - y0 + parameters.dt * (parameters.gravity + ground[1])
        work += 0.5 * m * (along * (x0 + x1) + up * (y0 + y1)) + 0.5 * inertia * (w1**2 - w0**2)
        kinetic += 0.5 * m * (x1**2 + y1**2) + 0.5 * inertia * w1**2
    return work > parameters.tolerance * kinetic


@allocating_entry
def _apply_initial_impulses(bodies, workspace, touching):  # type: ignore
    """Apply the impulses of the step before, as initial guess of the sweeps."""
    contacts, speeds = workspace.contacts, workspace.speeds
    for k in range(touching):
        a, b = contacts.bodies[k]
        nx, ny = contacts.normal[k]
        na, nb, ta, tb = workspace.rows[k, :4]
        _apply_impulse(bodies, speeds, (a, b), (nx, ny), (na, nb), contacts.impulse[k, 0])
        _apply_impulse(bodies, speeds, (a, b), (-ny, nx), (ta, tb), contacts.impulse[k, 1])


@allocating_entry
def _sweep_contacts(bodies, parameters, workspace, touching):  # type: ignore
    """Sweep over the contacts until impulses converge; return the number of sweeps."""
    contacts, speeds = workspace.contacts, workspace.speeds
    for sweep in range(1, parameters.max_sweeps + 1):
        change, largest = 0.0, 0.0
        for k in range(touching):
            a, b = contacts.bodies[k]
            nx, ny = contacts.normal[k]
            na, nb, ta, tb, kn, kt, target, slip, friction = workspace.rows[k]
            # normal impulse, projected on P_N >= 0
            old = contacts.impulse[k, 0]
            speed = _relative_speed(speeds, (a, b), (nx, ny), (na, nb))
            new = max(old - kn * (speed - target), 0.0)
            _apply_impulse(bodies, speeds, (a, b), (nx, ny), (na, nb), new - old)
            contacts.impulse[k, 0] = new
            change, largest = max(change, abs(new - old)), max(largest, new)
            # tangential impulse, projected on the friction cone of the new normal impulse
            old, limit = contacts.impulse[k, 1], friction * new
            speed = _relative_speed(speeds, (a, b), (-ny, nx), (ta, tb))
            new = min(max(old - kt * (speed - slip), -limit), limit)
            _apply_impulse(bodies, speeds, (a, b), (-ny, nx), (ta, tb), new - old)
            contacts.impulse[k, 1] = new
            change = max(change, abs(new - old))
        if change <= parameters.tolerance * largest:
            return sweep
    return parameters.max_sweeps + 1
