"""Limit analysis of blocks at displaced places: contacts, mechanism, rigid bodies that move.

After finite rotations and slips the blocks of a joint touch at corners, or along a part of their
faces. Forces at these contacts balance the loads: compression along the face's normal and, along
its tangent, friction. The largest factor of the horizontal forces and its mechanism follow from a
linear programme as at rest (`collapse`). Joints that neither open nor slip are then welded, so
that few rigid bodies remain.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph, csr_matrix

from archfem._typing import Array, Flags, Numbers
from archfem.errors import DidNotConverge
from archfem.joints.rigid_kinematics import jump_rates
from archfem.limit.linear_programme import HELD_SHARE, NoEquilibrium, solve_linear
from archfem.masonry.block import rotate
from archfem.masonry.loads import AttachedLoad
from archfem.masonry.structure import Structure, largest_displacement

# Distance of points that touch, relative to the size of the structure [-]
TOUCHING = 1e-6

# Velocities, relative to the largest of any corner, that count as zero [-]
STILL = 1e-6

# Strain at which the iron of a tie breaks [-]
BREAKING_STRAIN = 0.02


class Contact(NamedTuple):
    """A corner of one block on the face of another, or two corners that coincide."""

    joint: int
    corner: int  # number of the block whose corner it is
    face: int  # number of the block whose face it is
    point: Array  # present place of the corner (2,) [m]
    normal: Array  # unit normal of the face, towards the block of the corner (2,)
    slip: int = 0  # sense along the face's tangent in which it slides, 1 or -1; 0 where it sticks


@dataclass(frozen=True, eq=False)
class KinematicChain:
    """A mechanism at a place: rigid bodies and the contacts between them that persist."""

    factor: float  # α of the horizontal forces that sets it in motion [-]
    # velocities of centroids and rotations, the fastest corner at 1 m/s (n_blocks, 3)
    motion: Array
    body: Numbers  # number of the body of each block; -1 at rest (n_blocks,)
    contacts: tuple[Contact, ...]  # those that persist
    is_flat: bool = False  # whether contacts were found to slide without dilatancy


class FillPressure(NamedTuple):
    """Horizontal forces of a fill on pieces of the stones' faces, which keep their size."""

    block: Numbers  # (n,)
    points: Array  # at rest, of the least pressure and of what a passive one adds (2, n, 2) [m]
    forces: Array  # least force, and the largest that a passive pressure adds (2, n, 2) [N]
    shared: csr_matrix  # whether a piece has the passive pressure of an unknown (n, n)


class Tie(NamedTuple):
    """A tie at its present place."""

    name: str  # of the blocks at its ends
    block: int
    anchor: int | None  # block at the other end, None for the ground
    place: Array  # (2,) [m]
    force: Array  # largest, towards the other end (2,) [N]
    stretch: float  # from rest; to the ground that along its force [m]
    limit: float  # stretch at which it breaks, infinite where its free length is not known [m]

    @property
    def size(self) -> float:
        """Size of its largest force [N]."""
        return float(np.hypot(*self.force))


@dataclass(frozen=True, eq=False)
class PlacedBlocks:
    """Rigid blocks after displacements of any size, with the loads that they carry."""

    structure: Structure
    displacement: Array  # of centroids, and rotations (n_blocks, 3) [m, m, rad]
    corners: Array  # of each joint's faces at rest, lower and higher block (2, n_joints, 2, 2) [m]
    loads: tuple[AttachedLoad, ...] = ()
    direction: float = 1.0  # sense of the horizontal forces along x, 1 or -1
    fill: FillPressure | None = None
    growing: tuple[AttachedLoad, ...] = ()  # forces that grow, instead of the horizontal ones
    # by which faces end before each joint, where it crushes (n_joints,) [m]
    setback: Array = field(default_factory=lambda: np.zeros(0))
    longest: float | Array = 0.0  # largest stretch of each tie so far (n_ties,) [m]
    near: float = TOUCHING  # distance of points that touch, over the structure's size [-]

    @classmethod
    def at_rest(
        cls,
        structure: Structure,
        loads: Sequence[AttachedLoad] = (),
        direction: float = 1.0,
        fill: FillPressure | None = None,
    ) -> "PlacedBlocks":
        """Return the blocks of a structure at rest."""
        still = np.zeros((len(structure.blocks), 3))
        given = structure, still, find_corners(structure), tuple(loads), direction, fill
        return cls(*given, setback=np.zeros(len(structure.joints)))

    def moved(self, displacement: Array) -> "PlacedBlocks":
        """Return the blocks at other displacements from rest."""
        return replace(self, displacement=displacement)

    def set_back(self, setback: Array) -> "PlacedBlocks":
        """Return the blocks with faces that end a distance before each joint (n_joints,) [m]."""
        inwards = (setback[:, None] * self.structure.tangents)[:, None] * [[1.0], [-1.0]]
        corners = find_corners(self.structure) + inwards
        return replace(self, corners=corners, setback=setback)

    @cached_property
    def centroids(self) -> Array:
        """Present centroids (n_blocks, 2) [m]."""
        return self.structure.centroids + self.displacement[:, :2]

    def places(self, points: Array, block: int) -> Array:
        """Return the present places of points of a block, given at rest (…, 2) [m]."""
        arm = points - self.structure.centroids[block]
        return rotate(arm, self.displacement[block, 2]) + self.centroids[block]

    @cached_property
    def outlines(self) -> list[Array]:
        """Present outlines of the blocks, arcs as chords."""
        drawn = (block.drawn() for block in self.structure.blocks)
        return [self.places(points, number) for number, points in enumerate(drawn)]

    def largest_speed(self, motion: Array) -> float:
        """Return the largest speed of a corner of any block [m/s]."""
        return largest_displacement(self.outlines, self.centroids, motion)

    @cached_property
    def masses(self) -> list[tuple[int, Array, float]]:
        """Block, present place and weight of all that is accelerated [m, N]."""
        structure = self.structure
        weights = [
            (k, self.centroids[k], b.area * b.material.unit_weight * structure.width)
            for k, b in enumerate(structure.blocks)
        ]
        carried = [(k, place, load.weight) for k, place, load in self.attached if load.weight]
        return weights + carried

    @cached_property
    def attached(self) -> list[tuple[int, Array, AttachedLoad]]:
        """Block and present place of each attached load [m]."""
        return self.attach(self.loads)

    def attach(self, loads: Sequence[AttachedLoad]) -> list[tuple[int, Array, AttachedLoad]]:
        """Return block and present place of loads [m]."""
        numbers = [(self.structure.block_number(load.block), load) for load in loads]
        return [(k, self.places(np.array(load.point), k), load) for k, load in numbers]

    @cached_property
    def dead(self) -> Array:
        """Weights and constant forces, about the centroids (n_blocks, 3) [N, N, N m]."""
        forces = [(k, place, (0.0, -weight)) for k, place, weight in self.masses]
        forces += [(k, place, x.force) for k, place, x in self.attached if not x.passive]
        return self._resultants(forces)

    @cached_property
    def ties(self) -> list[Tie]:
        """Ties; those between two blocks pull along their present chord."""
        found, pulled = [], [x for x in self.loads if x.passive and any(x.force)]
        for block, place, load in self.attach(pulled):
            force, anchor, rest = np.array(load.force), None, np.array(load.point)
            stretch = (rest - place) @ force / np.hypot(*force)
            if load.anchor is not None:
                anchor = self.structure.block_number(load.anchor)
                chord = self.places(np.array(load.anchor_point), anchor) - place
                stretch = np.hypot(*chord) - np.hypot(*(load.anchor_point - rest))
                force = np.hypot(*force) * chord / np.hypot(*chord)
            ends = [self.structure.blocks[k].name for k in (block, anchor) if k is not None]
            limit = BREAKING_STRAIN * (load.free_length or np.inf)
            given = place, force, float(stretch), limit
            found.append(Tie(" and ".join(ends), block, anchor, *given))
        return found

    @cached_property
    def stretches(self) -> Array:
        """Present stretch of each tie (n_ties,) [m]."""
        return np.array([tie.stretch for tie in self.ties])

    @cached_property
    def slack(self) -> Flags:
        """Whether each tie is shorter than it was before, or at rest (n_ties,)."""
        return self.stretches < self.longest - TOUCHING * self.structure.size

    def keep_stretches(self) -> "PlacedBlocks":
        """Return the blocks with the present stretches of ties among those so far."""
        return replace(self, longest=np.maximum(self.longest, self.stretches))

    @cached_property
    def live(self) -> Array:
        """Forces that grow, at a factor of one, about the centroids (n_blocks, 3) [N, N, N m]."""
        return self._resultants(self.pulls)

    @cached_property
    def pulls(self) -> list[tuple[int, Array, tuple[float, float]]]:
        """Block, present place and force of all that grows, at a factor of one [m, N]."""
        if self.growing:
            return [(k, place, load.force) for k, place, load in self.attach(self.growing)]
        return [(k, place, (self.direction * weight, 0.0)) for k, place, weight in self.masses]

    def _resultants(self, forces: Sequence[tuple[int, Array, Sequence[float]]]) -> Array:
        """Return the resultants of forces on each block about its centroid (n_blocks, 3)."""
        total = np.zeros((len(self.structure.blocks), 3))
        for block, place, (x, y) in forces:
            arm = place - self.centroids[block]
            total[block] += (x, y, arm[0] * y - arm[1] * x)
        return total

    @cached_property
    def faces(self) -> Array:
        """Present corners of the faces of lower and higher blocks (2, n_joints, 2, 2) [m]."""
        block = self.structure.pairs.T
        arm = self.corners - self.structure.centroids[block][:, :, None]
        turned = rotate(arm, self.displacement[block, 2, None])
        return turned + self.centroids[block][:, :, None]

    @cached_property
    def normals(self) -> Array:
        """Normals of the faces, towards the other block (2, n_joints, 2)."""
        turns = self.displacement[self.structure.pairs.T, 2]
        return np.array([1.0, -1.0])[:, None, None] * rotate(self.structure.normals, turns)

    @cached_property
    def gaps(self) -> Array:
        """Gap of each corner from the other block's face (2, n_joints, 2) [m].

        First axis: corners of the lower, of the higher block. Infinite beside the face.
        """
        near = self.near * self.structure.size
        gaps = np.full((2, len(self.structure.joints), 2), np.inf)
        for side in (0, 1):
            face, corners = self.faces[1 - side], self.faces[side]
            along = face[:, 1] - face[:, 0]
            depth = np.linalg.norm(along, axis=1)[:, None]
            arm = corners - face[:, :1]
            share = np.einsum("jei,ji->je", arm, along) / depth
            height = np.einsum("jei,ji->je", arm, self.normals[1 - side])
            beside = (share < -near) | (share > depth + near)
            gaps[side] = np.where(beside, np.inf, height)
        return gaps

    def touching(self, joints: Sequence[int]) -> list[Contact]:
        """Return the contacts at some joints; corners that coincide are one contact."""
        near, contacts = self.near * self.structure.size, []
        for joint in joints:
            pair = self.structure.pairs[joint]
            apart = np.linalg.norm(self.faces[1, joint] - self.faces[0, joint], axis=1)
            for side in (1, 0):
                for end in np.flatnonzero(np.abs(self.gaps[side, joint]) <= near):
                    if side == 0 and apart[end] <= near:
                        continue  # the corner of the higher block is at the same place
                    point, normal = self.faces[side, joint, end], self.normals[1 - side, joint]
                    contacts.append(Contact(joint, pair[side], pair[1 - side], point, normal))
        return contacts


def find_corners(structure: Structure) -> Array:
    """Return the corners of the faces at each joint, at rest (2, n_joints, 2, 2) [m].

    A face that extends beyond the joint has its corner there, and the other block slides on it.
    """
    along = structure.face_spans[..., None] * structure.tangents[:, None]
    return structure.ends[:, :1] + along


def tangent(normal: Array) -> Array:
    """Return the unit tangent of a face, a quarter turn clockwise from its normal (2,)."""
    return np.array([normal[1], -normal[0]])


def merge_blocks(structure: Structure, welded: Sequence[int] | Numbers | Flags) -> Numbers:
    """Return the number of the body of each block, -1 for those welded to fixed ones."""
    vertices = structure.first_coordinates // 3 + 1  # number of each block, 0 for the ground
    one, other = vertices[structure.pairs[welded]].T
    size = len(structure.free) + 1
    graph = csr_matrix((np.ones(len(one)), (one, other)), (size, size))
    # numbered by their first vertex, hence 0 with the ground
    labels = csgraph.connected_components(graph, directed=False)[1]
    return np.asarray(labels[vertices] - 1, dtype=np.intp)


@dataclass(frozen=True, eq=False)
class Bodies:
    """Rigid bodies at a place, and the rates of their contacts."""

    blocks: PlacedBlocks
    body: Numbers  # number of the body of each block, -1 at rest (n_blocks,)

    @cached_property
    def count(self) -> int:
        """Number of bodies that move."""
        return int(self.body.max()) + 1

    @property
    def force_unit(self) -> float:
        """Mean weight of a body [N]."""
        return float(np.abs(self.blocks.dead[:, 1]).sum() / self.count)

    @cached_property
    def units(self) -> Array:
        """Units of the coordinates, rotations over the size (3 n_bodies,) [m, m, rad]."""
        return np.tile([1.0, 1.0, 1.0 / self.blocks.structure.size], self.count)

    @cached_property
    def references(self) -> Array:
        """Reference point of each body, the mean of its centroids (n_bodies, 2) [m]."""
        body, total = self.body[self.moving], np.zeros((self.count, 2))
        np.add.at(total, body, self.blocks.centroids[self.moving])
        return total / np.bincount(body, minlength=self.count)[:, None]

    @cached_property
    def moving(self) -> Numbers:
        """Numbers of the blocks that move."""
        return np.flatnonzero(self.body >= 0)

    @cached_property
    def arms(self) -> Array:
        """Centroids of the blocks that move, from the reference of their body (n_moving, 2) [m]."""
        return self.blocks.centroids[self.moving] - self.references[self.body[self.moving]]

    def spread(self, velocity: Array) -> Array:
        """Return the velocities of all blocks from those of the bodies (n_blocks, 3)."""
        motion = np.zeros((len(self.body), 3))
        own, (x, y) = velocity.reshape(-1, 3)[self.body[self.moving]], self.arms.T
        turn = own[:, 2]
        motion[self.moving] = np.stack([own[:, 0] - turn * y, own[:, 1] + turn * x, turn], axis=1)
        return motion

    def gather(self, motion: Array) -> Array:
        """Return the velocities of the bodies from those of all blocks (3 n_bodies,)."""
        (u, v, turn), (x, y) = motion[self.moving].T, self.arms.T
        velocity = np.zeros((self.count, 3))
        velocity[self.body[self.moving]] = np.stack([u + turn * y, v - turn * x, turn], axis=1)
        return velocity.ravel()

    def generalised(self, loads: Array) -> Array:
        """Return generalised forces of the bodies from those of the blocks (3 n_bodies,)."""
        (f_x, f_y, moment), (x, y) = loads[self.moving].T, self.arms.T
        total = np.zeros((self.count, 3))
        own = np.stack([f_x, f_y, moment + x * f_y - y * f_x], axis=1)
        np.add.at(total, self.body[self.moving], own)
        return total.ravel()

    def rates(self, contacts: Sequence[Contact]) -> Array:
        """Return rates of the contacts' gaps and slips (2, n_contacts, 3 n_bodies)."""
        return np.stack([rates.toarray() for rates in self.sparse_rates(contacts)])

    def sparse_rates(self, contacts: Sequence[Contact]) -> list[csr_matrix]:
        """Return the rates of gaps and of slips, each (n_contacts, 3 n_bodies)."""
        points = np.array([contact.point for contact in contacts]).reshape(-1, 2)
        normal = np.array([contact.normal for contact in contacts]).reshape(-1, 2)
        along = np.stack([normal[:, 1], -normal[:, 0]], axis=1)
        # a jump is the motion of the corner's block less that of the face's
        pairs = np.array([(c.face, c.corner) for c in contacts], dtype=np.intp).reshape(-1, 2)
        places, bodies = (np.concatenate([each, each]) for each in (points, self.body[pairs]))
        rates = jump_rates(np.concatenate([normal, along]), places, bodies, self.references)
        return [rates[: len(contacts)], rates[len(contacts) :]]

    @cached_property
    def tie_forces(self) -> csr_matrix:
        """Generalised largest forces of the ties (n_ties, 3 n_bodies)."""
        ties = self.blocks.ties
        # a force along the bar has the same moment about both its ends
        forces = np.array([tie.force for tie in ties]).reshape(-1, 2)
        places = np.array([tie.place for tie in ties]).reshape(-1, 2)
        return jump_rates(forces, places, self.tied_bodies, self.references)

    @cached_property
    def tied_bodies(self) -> Numbers:
        """Bodies at the far and the near end of each tie, -1 at rest (n_ties, 2)."""
        ends = [
            (-1 if tie.anchor is None else self.body[tie.anchor], self.body[tie.block])
            for tie in self.blocks.ties
        ]
        return np.array(ends, dtype=np.intp).reshape(-1, 2)

    @cached_property
    def bounded_forces(self) -> tuple[csr_matrix, csr_matrix]:
        """Return generalised least forces of the fill, and those that it and the ties may add.

        Each is (n, 3 n_bodies); of the latter a share from 0 to 1 acts. Slack ties have no force.
        """
        fill, blocks, pulls = self.blocks.fill, self.blocks, self.tie_forces
        if blocks.slack.any():
            pulls = (sparse.diags(1.0 - blocks.slack) @ pulls).tocsr()
        if fill is None:
            return csr_matrix((0, 3 * self.count)), pulls
        arms = fill.points - blocks.structure.centroids[fill.block]
        turned = rotate(arms, blocks.displacement[fill.block, 2])
        body = self.body[fill.block]
        pairs = np.stack([np.full_like(body, -1), body], axis=1)
        least, further = (
            jump_rates(forces, places, pairs, self.references)
            for forces, places in zip(
                fill.forces, turned + blocks.centroids[fill.block], strict=True
            )
        )
        further = (fill.shared.T @ further).tocsr()
        if blocks.ties:  # a stack of matrices takes longer than all before
            further = sparse.vstack([further, pulls], format="csr")
        return least, further

    def find_held_ties(self, velocity: Array) -> Numbers:
        """Return the taut ties whose length a velocity keeps, between two bodies."""
        far, near = self.tied_bodies.T
        sizes = np.array([tie.size for tie in self.blocks.ties])
        keeps = np.abs(self.tie_forces @ velocity) <= STILL * sizes
        return np.flatnonzero(keeps & (far != near) & ~self.blocks.slack)

    def dead_forces(self, velocity: Array | None = None, held: Numbers | None = None) -> Array:
        """Return the generalised forces that do not grow (3 n_bodies,).

        The fill presses actively, and passively where a velocity moves a stone into it. A tie that
        it stretches pulls with all of its force, unless it is slack. Held ones are left out.
        """
        least, further = self.bounded_forces
        dead = self.generalised(self.blocks.dead) + least.sum(axis=0).A1
        if velocity is not None:
            acts = further @ velocity < 0.0
            acts[further.shape[0] - len(self.blocks.ties) :][held] = held is None
            dead += further.T @ acts
        return np.asarray(dead)


def find_mechanism(
    blocks: PlacedBlocks, joints: Sequence[int], friction: Array, *, flat: bool = False
) -> KinematicChain | None:
    """Find the mechanism of least factor at the present places; None where no factor moves them."""
    # Forces N >= 0 and |T| <= μ N act at the contacts of the joints that may move. The largest
    # factor at which they balance the loads is sought; its dual is the motion. Without dilatancy,
    # if `flat`, |T| <= μ N₀ with N₀ of the solution before, until it repeats (Gilbert, Casapulla
    # and Ahmed, Comput. Struct. 84 (2006) 873-887).
    bodies, contacts, coefficient = _select_bodies(blocks, joints, friction)
    # Corners that coincide slide on the face of either block, which an open joint turns apart; on
    # which one follows from the motion, so that its contacts are those of a second programme.
    for _ in range(4):
        given = bodies, contacts, coefficient
        if not bodies.count or (solution := _solve_static(*given)) is None:
            return None
        factor, velocity, forces = solution
        if flat:
            factor, velocity = _solve_flat(*given, factor, forces[: len(contacts)])
        motion = bodies.spread(velocity)
        motion = motion / blocks.largest_speed(motion)
        before, contacts = contacts, face_slips(blocks, contacts, motion)
        normals = np.array([[each.normal for each in some] for some in (before, contacts)])
        (x, y), (u, v) = (np.reshape(own, (-1, 2)).T for own in normals)
        if np.abs(x * v - y * u).max(initial=0.0) <= STILL:
            break
    dilates = np.zeros(len(contacts)) if flat else coefficient
    found = classify_motion(blocks, joints, motion, dilates, contacts, factor)
    return replace(found, is_flat=flat)


def bears_dead_load(blocks: PlacedBlocks) -> bool:
    """Return whether forces at the contacts of all joints balance weights and constant forces."""
    structure = blocks.structure
    given = _select_bodies(blocks, range(len(structure.joints)), structure.friction)
    with suppress(DidNotConverge):  # infeasible, or not known
        return _solve_static(*given, fixed=0.0) is not None
    return False


def find_tie_shares(
    blocks: PlacedBlocks, joints: Sequence[int], friction: Array, factor: float
) -> Array:
    """Return the shares of the ties, of least sum, by which the blocks bear a factor (n_ties,)."""
    given = _select_bodies(blocks, joints, friction)
    solution = _solve_static(*given, fixed=HELD_SHARE * factor)
    assert solution is not None  # a sum of shares is bounded from below
    return solution[2][-1 - len(blocks.ties) : -1]


def find_thrusts(blocks: PlacedBlocks, joints: Sequence[int], friction: Array) -> Array:
    """Return the normal forces at the least factor, zero without a mechanism (n_joints,) [N]."""
    bodies, contacts, _ = given = _select_bodies(blocks, joints, friction)
    thrusts = np.zeros(len(blocks.structure.joints))
    if bodies.count and (solution := _solve_static(*given)) is not None:
        forces = bodies.force_unit * solution[2][: len(contacts)]
        np.add.at(thrusts, [contact.joint for contact in contacts], forces)
    return thrusts


def _select_bodies(
    blocks: PlacedBlocks, joints: Sequence[int], friction: Array
) -> tuple[Bodies, list[Contact], Array]:
    """Return the bodies between the joints that may move, their contacts and friction."""
    among = set(joints)
    welded = [k for k in range(len(blocks.structure.joints)) if k not in among]
    contacts = blocks.touching(joints)
    coefficient = friction[[contact.joint for contact in contacts]]
    return Bodies(blocks, merge_blocks(blocks.structure, welded)), contacts, coefficient


def _solve_flat(
    bodies: Bodies, contacts: Sequence[Contact], coefficient: Array, bound: float, forces: Array
) -> tuple[float, Array]:
    """Return factor and velocities of sliding without dilatancy, from first normal forces.

    The factor with dilatancy is its bound.
    """
    before = np.inf
    for _ in range(40):
        solution = None
        with suppress(NoEquilibrium):
            solution = _solve_static(bodies, contacts, coefficient, forces)
        if solution is None:
            break
        factor, velocity, found = solution
        # one that repeats beyond its bound is of forces that still change
        if abs(factor - before) <= 1e-7 * abs(factor) and factor <= bound + 1e-6 * abs(bound):
            return factor, velocity
        # half steps: whole ones may alternate between two states
        before, forces = factor, 0.5 * (forces + found[: len(contacts)])
    raise DidNotConverge(
        "no mechanism was found whose faces slide without dilatancy: af.collapse_factor(…, "
        "friction='nonassociated') searches for one, at rest"
    )


def _solve_static(
    bodies: Bodies,
    contacts: Sequence[Contact],
    coefficient: Array,
    held: Array | None = None,
    fixed: float | None = None,
) -> tuple[float, Array, Array] | None:
    """Return the largest factor, velocities by duality and the unknowns [mean body weights].

    With `held` normal forces, friction is limited by these. At a `fixed` factor the shares of the
    ties have the least sum.
    """
    normal, along = bodies.sparse_rates(contacts)
    dead, live = bodies.dead_forces(), bodies.generalised(bodies.blocks.live)
    further = bodies.bounded_forces[1]
    # forces in mean body weights and lengths in metres over the size keep coefficients near one
    unit, count = bodies.force_unit, len(contacts)
    slides = np.isfinite(coefficient)
    coefficient_or_zero = np.where(slides, coefficient, 0.0)
    balance = sparse.hstack([normal.T, along.T, further.T / unit, (live / unit)[:, None]])
    slope, one = (sparse.diags(v).tocsr()[slides] for v in (coefficient_or_zero, np.ones(count)))
    strength = np.zeros(2 * int(slides.sum()))
    if held is not None:
        strength = np.tile((coefficient_or_zero * held)[slides], 2)
        slope = 0.0 * slope
    pieces = further.shape[0]
    none = csr_matrix((slope.shape[0], pieces + 1))
    limits = sparse.bmat([[-slope, one, none], [-slope, -one, none]], format="csr")
    # forces across joints, along them, shares of passive pressure and ties, and the factor
    anything, share = [-np.inf, np.inf], [0.0, 1.0]
    kinds, numbers = [[0.0, np.inf], anything, share, anything], [count, count, pieces, 1]
    bounds = np.repeat(kinds, numbers, axis=0)
    cost = np.append(np.zeros(2 * count + pieces), -1.0)
    if fixed is not None:
        bounds[-1], cost[-1 - len(bodies.blocks.ties) :] = fixed, 1.0
    equations = sparse.diags(bodies.units) @ balance, -bodies.units * dead / unit
    if (result := solve_linear(cost, bounds, equations, (limits, strength))) is None:
        return None
    velocity = -bodies.units * result.equation_multipliers
    return float(result.x[-1]), velocity, result.x


def classify_motion(
    blocks: PlacedBlocks,
    joints: Sequence[int],
    motion: Array,
    coefficient: Array,
    contacts: Sequence[Contact],
    factor: float,
) -> KinematicChain:
    """Weld joints that do not move, and select the contacts that a motion keeps."""
    every, contacts = Bodies(blocks, np.arange(len(motion))), face_slips(blocks, contacts, motion)
    normal, along = (rates @ motion.ravel() for rates in every.sparse_rates(contacts))
    # associated flow opens a sliding contact by μ |slip|; flat sliding by nothing
    dilation = np.where(np.isfinite(coefficient), coefficient, 0.0) * np.abs(along)
    keeps = (np.abs(normal) <= STILL) | (np.abs(normal - dilation) <= STILL)
    opens = _find_opening_joints(blocks, motion)
    opens &= np.isin(np.arange(len(opens)), joints)
    body = merge_blocks(blocks.structure, ~opens)
    kept = tuple(
        contact
        for contact, keep in zip(contacts, keeps, strict=True)
        if keep and body[contact.corner] != body[contact.face]
    )
    return KinematicChain(factor, motion, body, kept)


def face_slips(blocks: PlacedBlocks, contacts: Sequence[Contact], motion: Array) -> list[Contact]:
    """Return contacts with the slips of a motion, at corners that stay on the other's face."""
    rates = Bodies(blocks, np.arange(len(motion))).sparse_rates(contacts)[1] @ motion.ravel()
    slips = np.where(np.abs(rates) > STILL, np.sign(rates), 0.0).astype(int)
    return [_sliding_contact(blocks, *each) for each in zip(contacts, slips.tolist(), strict=True)]


def _find_opening_joints(blocks: PlacedBlocks, motion: Array) -> Flags:
    """Return whether the blocks of each joint have different rigid motions (n_joints,)."""
    pairs = blocks.structure.pairs
    arm = blocks.faces.mean(axis=(0, 2))[:, None] - blocks.centroids[pairs]
    u, v, turn = np.moveaxis(motion[pairs], -1, 0)
    depths = blocks.structure.depths[:, None]
    jumps = np.diff([u - turn * arm[..., 1], v + turn * arm[..., 0], turn * depths])
    return np.abs(jumps).max(axis=(0, 2)) > STILL


def _sliding_contact(blocks: PlacedBlocks, contact: Contact, slip: int) -> Contact:
    """Return a contact with its slip, at the corner that stays on the other block's face."""
    joint, pair = contact.joint, blocks.structure.pairs[contact.joint]
    faces, own = blocks.faces[:, joint], int(contact.corner == pair[1])
    end = int(np.linalg.norm(faces - contact.point, axis=-1).min(axis=0).argmin())
    apart = np.linalg.norm(faces[1, end] - faces[0, end])
    if not slip or apart > TOUCHING * blocks.structure.size:
        return contact._replace(slip=slip)
    # Of corners that coincide, that which slides inwards stays on the other block's face.
    outward = faces[1 - own, end] - faces[1 - own, 1 - end]
    if slip * (tangent(contact.normal) @ outward) < 0.0:
        return contact._replace(slip=slip)
    # the corner's velocity relative to the face, and the face's tangent, both change sign
    point, normal = faces[1 - own, end], blocks.normals[own, joint]
    return Contact(joint, contact.face, contact.corner, point, normal, slip)
