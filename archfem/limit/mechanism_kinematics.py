"""Mechanisms verified by kinematics: rigid-block motions that only the failed joints permit.

The motion is the optimum of a linear programme over the block motions (`verified_mechanism`).
Before it is solved, a smaller problem rules out most states. Blocks between which no joint has
failed are one body; where all are joined to the ground, nothing moves. The gaps g of the joints
between bodies, openings and slips, are compatible where every closed loop of bodies closes:
Rᵀ g = 0, with R a basis of the self-stresses, Gᵀ R = 0. A motion that the failed joints permit is
then a point of a small cone:

    Rᵀ g = 0,   g >= 0 where a joint moves one way only,   g = 0 where it does not move.

It has three equations a loop (Gordan's alternative: either such a point exists, or a self-stress
that presses every failed joint shut).
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import sparse
from scipy.optimize import nnls
from scipy.sparse.csgraph import dijkstra

from archfem._display import ProgressReport
from archfem._recent import RecentResults
from archfem._typing import Array, Flags, Numbers
from archfem._validation import check_type, validate_arguments
from archfem.errors import InvalidInput
from archfem.joints.criteria import (
    HEAD_COORDINATE,
    Criteria,
    find_failed_joints,
    find_lasting,
    with_failure_flags,
)
from archfem.joints.resultants import check_instant
from archfem.joints.rigid_kinematics import jump_entries
from archfem.limit.displaced_blocks import merge_blocks
from archfem.limit.linear_programme import RigidBlocks, solve_linear
from archfem.limit.mechanism_count import (
    Mechanism,
    counted_mechanism,
    follow_mechanism,
    mechanism_kind,
)
from archfem.masonry.parts import select_assessed_parts
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure, find_supported_blocks


@dataclass(frozen=True, eq=False)
class RigidRegions:
    """A structure without its yielding bodies, such as an elastic fill."""

    structure: Structure  # the remaining blocks and joints
    blocks: tuple[int, ...]  # numbers of its blocks in the whole structure
    joints: tuple[int, ...]  # numbers of its joints in the whole structure
    size: int  # number of blocks of the whole structure

    @cached_property
    def place(self) -> Numbers:
        """Index of each block of the whole structure among its blocks, -1 for others (size,)."""
        place = np.full(self.size, -1)
        place[list(self.blocks)] = np.arange(len(self.blocks))
        return place

    def expand_motion(self, motion: Array) -> Array:
        """Return the motion of all blocks of the whole structure, zero for the yielding ones."""
        whole = np.zeros((self.size, 3))
        whole[list(self.blocks)] = motion
        return whole


def find_rigid_regions(structure: Structure) -> RigidRegions:
    """Remove the yielding bodies, and the blocks that do not stand on fixed ground without them."""
    everything = set(range(len(structure.blocks)))
    blocks = find_supported_blocks(structure, everything - set(find_yielding_blocks(structure)))
    # A structure of nothing but yielding bodies is taken as rigid.
    if not blocks & set(structure.free):
        return take_all_rigid(structure)
    return _select_blocks(structure, tuple(sorted(blocks)))


def take_all_rigid(structure: Structure) -> RigidRegions:
    """Return the regions in which every block is rigid."""
    return _select_blocks(structure, tuple(range(len(structure.blocks))))


def _select_blocks(structure: Structure, blocks: tuple[int, ...]) -> RigidRegions:
    """Return some of the blocks, with their joints except those between supports."""
    place, free = {number: k for k, number in enumerate(blocks)}, set(structure.free)
    joints = tuple(
        number
        for number, joint in enumerate(structure.joints)
        if place.keys() >= set(joint.blocks) and free & set(joint.blocks)
    )
    if len(blocks) == len(structure.blocks) and len(joints) == len(structure.joints):
        return RigidRegions(structure, blocks, joints, len(blocks))
    kept = [structure.joints[number] for number in joints]
    renumbered = (replace(j, blocks=(place[j.blocks[0]], place[j.blocks[1]])) for j in kept)
    those = tuple(structure.blocks[number] for number in blocks)
    selected = replace(structure, blocks=those, joints=tuple(renumbered))
    return RigidRegions(selected, blocks, joints, len(structure.blocks))


@dataclass(frozen=True, eq=False)
class VerifiedMechanism:
    """Mechanism found as a rigid-block motion at an instant, and that found by counting joints.

    Attributes:
        moved: mechanism by motion, with the blocks that move and the joints that open or slip; its
            kind is "none" where no ring and no pier moves.
        counted: mechanism by the count of `counted_mechanism`, or None.
        motion: displacements of all blocks' centroids and rotations (n_blocks, 3) [m, m, rad];
            translations, and rotations times the mean depth of the joints, are at most 1 m.
    """

    moved: Mechanism
    counted: Mechanism | None
    motion: Array

    @property
    def kind(self) -> str:
        """Class by motion: "none", "local", "semi-global" or "global"."""
        return self.moved.kind

    @property
    def agrees(self) -> bool:
        """Whether count and motion give the same class."""
        return self.moved.kind == (self.counted.kind if self.counted else "none")

    def __str__(self) -> str:
        """Describe the classes by motion and by count, and whether they agree."""
        counted = f"{self.counted.kind} ({self.counted.part})" if self.counted else "none"
        moved = f"{self.kind} ({self.moved.part})" if self.moved.part else "none"
        verdict = "agree" if self.agrees else "disagree"
        return f"motion and count {verdict}: by motion {moved}, by count {counted}"


def verified_mechanism(
    structure: Structure, joints: xr.Dataset, criteria: Criteria | None = None
) -> VerifiedMechanism:
    """Search for a rigid-block motion that the joints failed at one instant permit.

    The motion v is the largest within a box that closes no joint. It opens a joint only where the
    joint hinges (away from the face that stays in contact) or has come apart. It slides only where
    friction and cohesion are used up, and in the sense of the shear force:

        max Σ g   subject to   g = G v,   g >= 0 where the joint may move,   g = 0 elsewhere.

    The gaps g are the openings of both ends and the slip of each joint, and |v| <= 1. Where the
    maximum is zero the failures are not a mechanism, however many they are. Bodies that yield, such
    as a fill, are left out. The class is that of the rings and piers that move
    (`select_assessed_parts`); where only other parts can move it is "none".

    Args:
        structure: structure whose blocks move.
        joints: as made by `joint_dataset`, at one instant.
        criteria: conditions of failure; by default those by which the joints were judged already.

    Returns:
        The motion and its class, beside the count.

    Raises:
        InvalidInput: `joints` has several instants, or those of another structure.

    References:
        Heyman, Int. J. Solids Struct. 2 (1966) 249-279: a mechanism needs hinges on alternating
        faces, not only four of them.

    Example:
        >>> ring = af.circular_arch(radius=10.0, thickness=1.5, embrace=157.5, voussoirs=7)
        >>> fall = af.collapse_factor(ring, live=af.BodyForce(1.0))
        >>> str(af.verified_mechanism(ring, fall.joints))
        'motion and count agree: by motion local (arch), by count local (arch)'
    """
    check_type(structure, Structure, "structure", "give that whose joints these are")
    check_type(joints, xr.Dataset, "joints", "give those of an instant, e.g. dead.joints")
    joints = with_failure_flags(joints, criteria)
    return get_verifier(structure).verify(joints)


@validate_arguments
def first_verified_mechanism(
    structure: Structure,
    joints: xr.Dataset,
    criteria: Criteria | None = None,
    *,
    beyond: float = 0.0,
) -> VerifiedMechanism | None:
    """Find the first instant of a time history from which on the failed joints permit a motion.

    They must permit one, the same or another, for as long as the criteria say.

    Args:
        structure: structure whose blocks move; of its rings and piers, one at least must.
        joints: over time and joint.
        criteria: conditions of failure, and their duration; by default those by which the joints
            were judged already.
        beyond: opening or slip that one of its joints must exceed while they stay failed [m]; by
            default none.

    Returns:
        The motion and its class at that instant; None where no ring and no pier ever moves.

    Raises:
        InvalidInput: openings or slips are unknown, of which one must exceed a value.
    """
    verifier, joints = get_verifier(structure), with_failure_flags(joints, criteria)
    side, slides, apart, shear = verifier.find_failures(joints)
    failed = (side != 0) | slides | apart
    # head joints take part in a verified motion
    flags = find_failed_joints(joints.drop_vars(HEAD_COORDINATE, errors="ignore"))
    flags = flags.transpose("time", "joint")
    if beyond > 0.0:  # joints that stay closer take part in no such motion alone
        if not {"opening", "slip"} <= joints.keys():
            raise InvalidInput(f"beyond = {beyond:g} needs opening and slip: give joints of a run")
        opening, slip = (
            joints.variables[name].transpose("time", "joint").values for name in ("opening", "slip")
        )
        able = (opening.max(axis=0) > beyond) | (np.ptp(slip, axis=0) > beyond)
        failed = failed & able[list(verifier.rigid_regions.joints)]
    instants = np.flatnonzero(failed.any(axis=1))
    failures = (values[instants] for values in (side, slides, apart, np.sign(shear)))
    freedoms = dict(zip(instants.tolist(), joint_freedoms(*failures), strict=True))

    def find_motion(instant: int) -> int | None:
        def move() -> Mechanism | None:
            known = len(verifier.moves)
            progress.show(f"{times[instant]:.3g} of {times[-1]:.3g} s, {known} patterns")
            permitted = verifier.loop_check.permits_motion(freedoms[instant])
            motion = verifier.verify(joints.isel(time=instant)) if permitted else None
            return motion.moved if motion and motion.kind != "none" else None

        # instants with the same pattern of freedoms share the answer
        moved = verifier.moves.look_up(freedoms[instant].astype(np.int8).tobytes(), move)
        if moved is not None and beyond > 0.0:
            followed = follow_mechanism(joints, replace(moved, time=float(times[instant])), flags)
            moved = moved if followed.displacement > beyond else None
        return None if moved is None else instant

    times, duration = joints["time"].values, Criteria.of(joints).duration
    with ProgressReport("verified mechanism", None, rarely=True) as progress:
        first = find_lasting(freedoms, times, duration, find_motion)
    if first is None:
        return None
    found = verifier.verify(joints.isel(time=first))
    return replace(found, moved=follow_mechanism(joints, found.moved, flags))


@dataclass(frozen=True, eq=False)
class Verifier:
    """Verifies mechanisms of one structure, instant by instant.

    Attributes:
        structure: structure whose blocks move.
    """

    structure: Structure

    @cached_property
    def rigid_regions(self) -> RigidRegions:
        """Blocks and joints that can be part of a mechanism."""
        return find_rigid_regions(self.structure)

    @cached_property
    def blocks(self) -> RigidBlocks:
        """Rigid blocks of the rigid regions."""
        return RigidBlocks(self.rigid_regions.structure)

    @cached_property
    def parts(self) -> tuple[str, ...]:
        """Names of the parts whose motion decides the class."""
        rigid = self.rigid_regions.structure
        roles = {rigid.blocks[n].part: rigid.blocks[n].role for n in rigid.free}
        return select_assessed_parts(roles)

    @cached_property
    def loop_check(self) -> "LoopCheck":
        """Fast check that excludes most states in which the assessed parts cannot move."""
        return LoopCheck(self.blocks, self.parts)

    def verify(self, joints: xr.Dataset) -> VerifiedMechanism:
        """Search for a motion at one instant, as `verified_mechanism` does.

        Args:
            joints: results of all joints, as made by `joint_dataset`, with their flags.

        Returns:
            The motion and its class, beside the count.

        Raises:
            InvalidInput: `joints` has several instants, or is of another structure.
        """
        check_instant(self.structure, joints)
        freedoms = self.freedoms(joints)
        scaled = self._motions.look_up(
            freedoms.tobytes(), lambda: _largest_motion(self.blocks, freedoms)
        )
        tolerance = 1e-6  # least motion, relative to the largest allowed, that counts as one
        gaps = (self.blocks.kinematics @ (self.blocks.coordinate_units * scaled)).reshape(3, -1)
        working = np.flatnonzero(np.abs(gaps).max(axis=0) > tolerance)
        motion = self.blocks.motion(scaled)
        size = np.abs(motion * [1.0, 1.0, self.blocks.length_unit]).max(axis=1)
        moving = np.flatnonzero(size > tolerance)
        regions, blocks = self.rigid_regions, self.rigid_regions.structure.blocks
        roles = {blocks[k].part: blocks[k].role for k in moving if blocks[k].part in self.parts}
        numbers = tuple(regions.joints[k] for k in working)
        names = tuple(self.structure.joints[number].name for number in numbers)
        free = tuple(regions.blocks[k] for k in moving)
        free_names = tuple(blocks[k].name for k in moving)
        kind, time = mechanism_kind(roles.values()), joints.coords.get("time")
        at = None if time is None else float(time)
        moved = Mechanism(kind, " + ".join(roles), numbers, at, free, names, free_names)
        return VerifiedMechanism(moved, counted_mechanism(joints), regions.expand_motion(motion))

    @cached_property
    def moves(self) -> RecentResults[Mechanism | None]:
        """Mechanisms by the freedoms, or None: several searches of one history share them."""
        return RecentResults(MAX_KNOWN_MOVES)

    @cached_property
    def _motions(self) -> RecentResults[Array]:
        """Largest motions by the freedoms, scaled (3 n_free,): many histories share them."""
        return RecentResults(MAX_KNOWN_PATTERNS)

    def verify_if_moving(self, joints: xr.Dataset) -> VerifiedMechanism | None:
        """Search for a motion as `verify` does, after the fast check of the loops.

        Args:
            joints: as for `verify`.

        Returns:
            The motion and its class; None where no ring and no pier can move.
        """
        if not self.loop_check.permits_motion(self.freedoms(joints)):
            return None
        mechanism = self.verify(joints)
        return None if mechanism.kind == "none" else mechanism

    def freedoms(self, joints: xr.Dataset) -> Array:
        """Return the freedoms of each joint of the rigid regions: to open at its ends, and to slip.

        Args:
            joints: results of all joints, as made by `joint_dataset`, with their flags.

        Returns:
            (…, 3 n_joints), intrados ends first, then extrados ends, then slips: 1 where an end
            may open, the sense in which a joint may slip, 1 or -1; 0 where it may not, and 2 where
            it may in either sense.
        """
        side, slides, apart, shear = self.find_failures(joints)
        return joint_freedoms(side, slides, apart, np.sign(shear))

    def find_failures(self, joints: xr.Dataset) -> tuple[NDArray[Any], ...]:
        """Return flags and V of the joints of the rigid regions, each (…, n_joints).

        Flags are the face of a hinge, whether friction is used up, and whether the joint is open.
        """
        numbers: Any = list(self.rigid_regions.joints)
        if len(numbers) == joints.sizes["joint"]:
            numbers = slice(None)  # of all joints, which needs no copy
        return tuple(
            joints.variables[name].transpose(..., "joint").values[..., numbers]
            for name in ("hinge", "slide", "open", "V")
        )


def joint_freedoms(side: NDArray[Any], slides: Flags, apart: Flags, sense: NDArray[Any]) -> Array:
    """Return the permitted openings and slips of joints, as `Verifier.freedoms` (…, 3 n_joints)."""
    either = apart | (slides & (sense == 0.0))  # no friction and no shear force: either way
    slips = np.where(either, 2.0, np.where(slides, sense, 0.0))
    return np.concatenate([(side > 0) | apart, (side < 0) | apart, slips], axis=-1)


@lru_cache(maxsize=8)
def get_verifier(structure: Structure) -> Verifier:
    """Return the verifier of a structure, the same for structures that are equal."""
    return Verifier(structure)


def _largest_motion(blocks: RigidBlocks, freedoms: Array) -> Array:
    """Solve the programme of `verified_mechanism` for the scaled motion (3 n_free,)."""
    sense = np.where(freedoms == 2.0, 0.0, freedoms)
    gaps = blocks.kinematics @ sparse.diags(blocks.coordinate_units)
    free = sparse.diags(sense) @ gaps
    fixed = gaps[freedoms == 0.0]
    one_way = -free[sense != 0.0], np.zeros(int(np.count_nonzero(sense)))
    cost = -np.asarray(free.sum(axis=0)).ravel()
    box = np.tile([-1.0, 1.0], (len(cost), 1))
    result = solve_linear(cost, box, (fixed, np.zeros(fixed.shape[0])), one_way)
    assert result is not None  # the box bounds it
    return result.x


# Patterns of failed joints whose answers are kept, of some kilobytes each at most
MAX_KNOWN_PATTERNS = 4096

# Those whose mechanism is kept, or that there is none, of some hundred bytes each: a run of 30 s of
# a gate of 52 stones has 14 000, and is searched again by other criteria and from its file
MAX_KNOWN_MOVES = 100_000


@dataclass(frozen=True, eq=False)
class LoopCheck:
    """Compatibility of gaps around all loops of bodies, for the motion of some parts.

    A body is made of blocks between which no joint has failed.
    """

    blocks: RigidBlocks
    parts: tuple[str, ...]  # names of the parts that must move

    @cached_property
    def judged(self) -> Numbers:
        """Numbers of the free blocks of the parts."""
        structure = self.blocks.structure
        judged = [k for k in structure.free if structure.blocks[k].part in self.parts]
        return np.array(judged, dtype=np.intp)

    def find_bodies(self, failed: Flags) -> Numbers:
        """Return the body of each block, -1 for the ground, where some joints have failed."""
        return merge_blocks(self.blocks.structure, ~failed)

    def self_stresses(self, joints: Numbers, bodies: Numbers) -> Array:
        """Return an orthonormal basis R of the self-stresses of joints (3 n_joints, r) [-]."""
        structure = self.blocks.structure
        (intrados, extrados), normals = structure.ends[joints].swapaxes(0, 1), structure.normals
        directions = normals[joints], normals[joints], structure.tangents[joints]
        references = structure.centroids[np.unique(bodies, return_index=True)[1][1:]]
        row, body, values = jump_entries(
            np.concatenate(directions),
            np.concatenate([intrados, extrados, intrados]),
            np.tile(bodies[structure.pairs[joints]], (3, 1)),
            references,
        )
        gaps = np.zeros((3 * len(joints), len(references), 3))
        gaps[row, body] = values
        gaps = gaps.reshape(len(gaps), -1)
        basis = np.linalg.qr(gaps, mode="complete")[0][:, gaps.shape[1] :]
        return np.where(np.abs(basis) > 1e-12, basis, 0.0)  # round-off: the joint is in no loop

    @cached_property
    def _answers(self) -> RecentResults[bool]:
        """Answers of `permits_motion` by the freedoms: many histories share them."""
        return RecentResults(MAX_KNOWN_PATTERNS)

    def permits_motion(self, freedoms: Array) -> bool:
        """Return whether the failed joints may permit a motion of the parts."""
        return self._answers.look_up(
            freedoms.tobytes(), lambda: self._closes_any_loops(freedoms.reshape(3, -1))
        )

    def _closes_any_loops(self, freedoms: Array, large: int = 50) -> bool:
        """Return `permits_motion`, by the loops between bodies.

        Where more than `large` joints between bodies have failed, the programme takes less time: in
        a wall of 417 joints 14 ms, and the loops of 46, 81 and 113 joints 10 ms, 0.2 and 1.1 s.
        """
        bodies = self.find_bodies(freedoms.any(axis=0))
        judged = np.unique(bodies[self.judged])
        judged = judged[judged >= 0]
        if not len(judged):
            return False  # all parts are joined to the ground
        one, other = bodies[self.blocks.structure.pairs].T
        joints = np.flatnonzero(one != other)
        if len(joints) > large:
            return True
        required = np.ones(3 * len(joints), dtype=bool)
        if len(judged) <= bodies.max():  # others may move without them
            required = np.tile(_find_paths(one[joints], other[joints], judged), 3)
        freedoms = freedoms[:, joints].ravel()
        # one column for each freedom, two for a slip in either sense
        either = np.flatnonzero(freedoms == 2.0)
        rows = np.concatenate([np.flatnonzero(freedoms), either])
        sense = np.concatenate([np.sign(freedoms[freedoms != 0.0]), -np.ones(len(either))])
        columns = self.self_stresses(joints, bodies)[rows].T * sense
        # some required joint must move: any one-way gap, or a two-way slip in one of its senses
        gaps = [np.where(required[rows] & (freedoms[rows] != 2.0), 1.0, 0.0)]
        for slip in either[required[either]]:
            gaps += [side * sense * (rows == slip) for side in (1, -1)]
        return any(_closes_loops(columns, gap) for gap in gaps)


def _find_paths(one: Numbers, other: Numbers, judged: Numbers) -> Flags:
    """Return the joints, between bodies, on a path from the ground to each judged body."""
    # A body whose path neither opens nor slips anywhere does not move. Weights make paths avoid
    # joints between other bodies, whose own motion does not count.
    near = np.isin(one, judged) | np.isin(other, judged)
    size, vertices = int(max(one.max(), other.max())) + 2, (one + 1, other + 1)
    weights = np.zeros((size, size))
    weights[vertices] = weights[vertices[::-1]] = np.where(near, 1.0, float(len(one)))
    before = dijkstra(weights, indices=0, return_predecessors=True)[1]
    on_path, pending = np.zeros((size, size), dtype=bool), judged + 1
    while len(pending := pending[pending > 0]):
        on_path[pending, before[pending]] = on_path[before[pending], pending] = True
        pending = np.unique(before[pending])
    return on_path[vertices]


def _closes_loops(columns: Array, gap: Array, tolerance: float = 1e-5) -> bool:
    """Return whether movements x >= 0 with gap·x = 1 close every loop, columns x = 0."""
    # The tolerance of the misfit is well above that of the linear programme (1e-7), so that the
    # programme and not this check decides close cases.
    if not gap.any():
        return False
    try:
        misfit = nnls(np.vstack([columns, gap]), np.append(np.zeros(len(columns)), 1.0))[1]
    except RuntimeError:  # no convergence: let the programme decide
        return True
    return bool(misfit < tolerance)
