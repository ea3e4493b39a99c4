"""Mechanisms verified by kinematics: rigid-block motions that only the failed joints permit.

The motion is the optimum of a linear programme over the block motions (`verified_mechanism`).
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import sparse

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


@lru_cache(maxsize=8)
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
            motion = verifier.verify_if_moving(joints.isel(time=instant))
            return motion.moved if motion else None

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
            freedoms.tobytes(), lambda: largest_motion(self.blocks, freedoms)
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
        """Search for a motion of rings and piers, as `verify` does.

        Args:
            joints: as for `verify`.

        Returns:
            The motion and its class; None where no ring and no pier can move.
        """
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


def largest_motion(blocks: RigidBlocks, freedoms: Array) -> Array:
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
