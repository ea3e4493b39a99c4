"""Linkage of rigid bodies: contacts that persist as constraints, velocities and equilibrium.

Hinges are pins at corners, and a sliding corner stays on the face that it touches, without
dilatancy. Ties that keep their length are constraints as well.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import linprog

from archfem._typing import Array, Flags, Numbers
from archfem.limit.displaced_blocks import (
    STILL,
    Bodies,
    Contact,
    KinematicChain,
    PlacedBlocks,
    tangent,
)
from archfem.masonry.block import rotate


@dataclass(frozen=True, eq=False)
class Linkage:
    """Bodies and contacts of a mechanism, which stay the same until an event."""

    start: PlacedBlocks
    mechanism: KinematicChain

    @cached_property
    def anchors(self) -> list[tuple[Array, Array, Array]]:
        """At rest: point on the corner's block, on the face's, normal of the face."""
        found = []
        for contact in self.mechanism.contacts:
            on_corner = self._at_rest(contact.point, contact.corner)
            on_face = self._at_rest(contact.point, contact.face)
            normal = rotate(contact.normal, -self.start.displacement[contact.face, 2])
            found.append((on_corner, on_face, normal))
        return found

    def _at_rest(self, point: Array, block: int) -> Array:
        """Return the place at rest of a point that moves with a block (2,) [m]."""
        arm = rotate(point - self.start.centroids[block], -self.start.displacement[block, 2])
        return arm + self.start.structure.centroids[block]

    @cached_property
    def first_velocity(self) -> Array:
        """Velocities of the bodies at the start (3 n_bodies,)."""
        return Bodies(self.start, self.mechanism.body).gather(self.mechanism.motion)

    @cached_property
    def held(self) -> Numbers:
        """Numbers of the ties that keep their length, where the contacts alone do not keep it."""
        kept = list[int]()
        bodies, contacts = Bodies(self.start, self.mechanism.body), self.mechanism.contacts
        normal, along = bodies.rates(contacts) * bodies.units
        rows = np.vstack([normal, along[[not contact.slip for contact in contacts]]])
        for k in bodies.find_held_ties(self.first_velocity):
            rate = bodies.tie_forces[[k]].toarray() / self.start.ties[k].size
            more = np.vstack([rows, rate * bodies.units])
            if np.linalg.matrix_rank(more, tol=1e-9) > np.linalg.matrix_rank(rows, tol=1e-9):
                rows = more
                kept.append(k)
        return np.array(kept, dtype=np.intp)

    def place(self, blocks: PlacedBlocks, motion: Array) -> "LinkageState":
        """Return the state after a finite motion of the bodies from other places of the blocks."""
        body = self.mechanism.body
        bodies = Bodies(blocks, body)
        displacement = blocks.displacement.copy()
        for number, (x, y, turn) in enumerate(motion.reshape(-1, 3)):
            own, reference = body == number, bodies.references[number]
            arm = blocks.centroids[own] - reference
            displacement[own, :2] += rotate(arm, turn) - arm + (x, y)
            displacement[own, 2] += turn
        return LinkageState(self, blocks.moved(displacement))


@dataclass(frozen=True, eq=False)
class LinkageState:
    """A linkage at one place along its path."""

    linkage: Linkage
    blocks: PlacedBlocks

    @cached_property
    def bodies(self) -> Bodies:
        """Bodies at this place."""
        return Bodies(self.blocks, self.linkage.mechanism.body)

    @cached_property
    def contacts(self) -> list[Contact]:
        """Contacts at this place."""
        moved, kept = [], self.linkage.mechanism.contacts
        for contact, (on_corner, _, normal) in zip(kept, self.linkage.anchors, strict=True):
            normal = rotate(normal, self.blocks.displacement[contact.face, 2])
            point = self.blocks.places(on_corner, contact.corner)
            moved.append(contact._replace(point=point, normal=normal))
        return moved

    @cached_property
    def misfits(self) -> Array:
        """Violation of each constraint: gaps, slips that stick, ties that shorten [m]."""
        gaps, slips = [], []
        for contact, (_, on_face, _) in zip(self.contacts, self.linkage.anchors, strict=True):
            jump = contact.point - self.blocks.places(on_face, contact.face)
            gaps.append(contact.normal @ jump)
            if not contact.slip:
                slips.append(tangent(contact.normal) @ jump)
        shorter = self.linkage.start.stretches - self.blocks.stretches
        return np.array([*gaps, *slips, *shorter[self.linkage.held]])

    @cached_property
    def held_sizes(self) -> Array:
        """Largest forces of the held ties (n_held,) [N]."""
        return np.array([self.linkage.start.ties[k].size for k in self.linkage.held])

    @cached_property
    def shortening_rates(self) -> Array:
        """Rates at which the held ties become shorter (n_held, 3 n_bodies)."""
        if not len(self.linkage.held):
            return np.zeros((0, 3 * self.bodies.count))
        forces = self.bodies.tie_forces[self.linkage.held].toarray()
        return np.asarray(forces / self.held_sizes[:, None])

    @cached_property
    def rates(self) -> Array:
        """Rates of gaps and slips of all contacts (2, n_contacts, 3 n_bodies)."""
        return self.bodies.rates(self.contacts)

    @cached_property
    def sticks(self) -> Flags:
        """Whether each contact sticks (n_contacts,)."""
        return np.array([not contact.slip for contact in self.contacts], dtype=bool)

    @cached_property
    def jacobian(self) -> Array:
        """Rates of the constraints with scaled velocities (n_constraints, 3 n_bodies)."""
        normal, along = self.rates
        rows = np.vstack([normal, along[self.sticks], self.shortening_rates])
        return rows * self.bodies.units

    def velocity(self, previous: Array) -> Array | None:
        """Return the velocities of the bodies that are nearest to previous ones, or None."""
        # A basis of all motions that the constraints permit; usually it is one motion.
        _, singular, basis = np.linalg.svd(self.jacobian)
        rank = int(np.sum(singular > 1e-9 * max(singular.max(initial=0.0), 1.0)))
        free = basis[rank:]
        velocity = self.bodies.units * (free.T @ (free @ (previous / self.bodies.units)))
        motion = self.bodies.spread(velocity)
        speed = self.blocks.largest_speed(motion)
        if speed <= STILL * self.blocks.largest_speed(self.bodies.spread(previous)):
            return None
        return velocity / speed

    def corrected(self, iterations: int = 12) -> "LinkageState | None":
        """Return the nearest state that fulfils the constraints, by Newton's method."""
        state, size = self, self.blocks.structure.size
        for _ in range(iterations):
            if np.abs(state.misfits).max(initial=0.0) <= 1e-13 * size:
                return state
            step = np.linalg.lstsq(state.jacobian, -state.misfits, rcond=1e-10)[0]
            state = state.linkage.place(state.blocks, self.bodies.units * step)
        # redundant constraints that contradict each other: the linkage locks
        return state if np.abs(state.misfits).max() <= 1e-9 * size else None

    def advanced(self, velocity: Array, step: float) -> "tuple[LinkageState, Array] | None":
        """Return state and velocities after a step along the path, by the mid-point rule."""
        start = self.blocks.keep_stretches()
        middle = self.linkage.place(start, 0.5 * step * velocity).corrected()
        if middle is None or (halfway := middle.velocity(velocity)) is None:
            return None
        end = self.linkage.place(start, step * halfway).corrected()
        if end is None or (after := end.velocity(halfway)) is None:
            return None
        # constraints that contradict each other beyond first order bring a step back
        moved = (end.blocks.displacement - self.blocks.displacement).ravel()
        expected = step * self.bodies.spread(velocity).ravel()
        return (end, after) if moved @ expected > 0.5 * (expected @ expected) else None

    def balance(self, velocity: Array, friction: Array) -> tuple[float, Array]:
        """Return the factor α in equilibrium, and the forces (n_contacts + n_held,) [N].

        They are normal forces and those of held ties. Those that equilibrium does not determine
        are undefined (NaN).
        """
        normal, along = self.rates
        dead = self.bodies.dead_forces(velocity, self.linkage.held)
        live = self.bodies.generalised(self.blocks.live)
        slipping = np.flatnonzero(~self.sticks)
        coefficient = friction[[contact.joint for contact in self.contacts]]
        forces = normal.copy()
        senses = np.sign(along[slipping] @ velocity)
        # friction opposes the slip
        forces[slipping] -= (coefficient[slipping] * senses)[:, None] * along[slipping]
        # unknown: these, forces of held ties, shear of sticking contacts, factor
        forces = np.vstack([forces, self.shortening_rates])
        columns = np.vstack([forces, along[self.sticks], live]).T * self.bodies.units[:, None]
        solution, _, rank, _ = np.linalg.lstsq(columns, -self.bodies.units * dead, rcond=1e-10)
        determined = rank == columns.shape[1]
        if not determined and len(slipping):
            solution = self._least_factor(columns, -self.bodies.units * dead, solution)
        # Virtual work on the velocity, with the work of friction.
        found = solution[: len(forces)]
        work = dead @ velocity + found @ (forces @ velocity)
        factor = -work / (live @ velocity)
        return float(factor), found if determined else np.full(len(forces), np.nan)

    def _least_factor(self, columns: Array, loads: Array, fallback: Array) -> Array:
        """Return the forces of least factor where friction makes it indeterminate."""
        unit = np.abs(loads).max()
        pressed = len(self.contacts) + len(self.linkage.held)
        free = [(None, None)] * (columns.shape[1] - pressed)
        objective = np.append(np.zeros(columns.shape[1] - 1), 1.0)
        scaled = columns.copy()
        scaled[:, -1] /= unit
        bounds = [(0.0, None)] * pressed + free
        equations = {"A_eq": scaled, "b_eq": loads / unit}
        result = linprog(objective, **equations, bounds=bounds, method="highs")
        if result.status != 0:
            return fallback
        return np.append(result.x[:-1] * unit, result.x[-1])
