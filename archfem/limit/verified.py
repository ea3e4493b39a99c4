"""Mechanisms that are verified: is there a motion that the failed joints, and only they, permit?"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import sparse
from scipy.optimize import linprog

from archfem.arguments import instance
from archfem.arrays import Array
from archfem.errors import DidNotConverge
from archfem.joints.criteria import Criteria, chosen, flagged
from archfem.joints.duration import first_lasting
from archfem.joints.resultants import check_instant
from archfem.limit.blocks import RigidBlocks
from archfem.limit.counted import Mechanism, counted_mechanism, mechanism_kind
from archfem.limit.screen import Screen
from archfem.limit.skeleton import Skeleton, skeleton_of
from archfem.masonry.roles import judged_parts
from archfem.masonry.structure import Structure

MOVING = 1e-6
"""Least motion, relative to the largest allowed, that counts as a motion."""


@dataclass(frozen=True, eq=False)
class VerifiedMechanism:
    """What the failed joints of an instant permit, beside what counting them says.

    Attributes:
        moved: the mechanism by motion, with the blocks that move and the joints that open or
            slip; its kind is "none" where no ring and no pier moves.
        counted: the mechanism by the count of `counted_mechanism`, or None.
        motion: of all blocks' centroids and rotations (n_blocks, 3) [m, m, rad]; translations, and
            rotations times the mean depth of the joints, are at most 1 m.
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
        """What moves, what the count says, and whether they agree."""
        counted = f"{self.counted.kind} ({self.counted.part})" if self.counted else "none"
        moved = f"{self.kind} ({self.moved.part})" if self.moved.part else "none"
        verdict = "agree" if self.agrees else "disagree"
        return f"motion and count {verdict}: by motion {moved}, by count {counted}"


def verified_mechanism(
    structure: Structure,
    joints: xr.Dataset,
    criteria: Criteria | None = None,
    *,
    limit: float | None = None,
) -> VerifiedMechanism:
    """Look for a rigid-block motion that the joints failed at one instant permit.

    The largest motion v, within a box, that opens a joint only where it hinges (away from the face
    that stays in contact) or has come apart, slides only where friction and cohesion are used up
    and in the sense of the shear force, and closes none:

        max Σ g   subject to   g = G v,   g >= 0 where the joint may move,   g = 0 elsewhere,

    with g the openings of both ends and the slip of each joint, and |v| <= 1. Where the maximum is
    zero the failures are not a mechanism, however many they are. Bodies that yield, such as a
    fill, are left out (`skeleton_of`). The class is that of the rings and piers that move, as
    `judged_parts` says; where only other parts can move it is "none".

    Args:
        structure: whose blocks move.
        joints: as made by `joint_dataset`, at one instant.
        criteria: what makes a joint fail; by default those by which the joints were judged already.
        limit: of |e| for a hinge, beside the usual criteria [-].

    Returns:
        The motion and its class, beside the count.

    Raises:
        InvalidInput: `joints` has several instants, or those of another structure; both criteria
            and a limit were given.

    References:
        Heyman, Int. J. Solids Struct. 2 (1966) 249-279: a mechanism needs hinges on alternating
        faces, not only four of them.

    Example:
        >>> ring = af.circular_arch(radius=10.0, thickness=1.5, embrace=157.5, voussoirs=7)
        >>> fall = af.collapse_factor(ring, live=af.BodyForce(1.0))
        >>> str(af.verified_mechanism(ring, fall.joints))
        'motion and count agree: by motion local (arch), by count local (arch)'
    """
    instance(structure, Structure, "structure", "give that whose joints these are")
    instance(joints, xr.Dataset, "joints", "give those of an instant, e.g. dead.joints")
    return verifier_of(structure).verified(flagged(joints, chosen(criteria, hinge=limit)))


def first_verified_mechanism(
    structure: Structure, joints: xr.Dataset, criteria: Criteria | None = None
) -> VerifiedMechanism | None:
    """Find the first instant of a time history from which on the failed joints permit a motion.

    They must permit one, whichever it is, for as long as the criteria say.

    Args:
        structure: whose blocks move; of its rings and piers, one at least must.
        joints: over time and joint.
        criteria: what makes a joint fail, and for how long; by default those by which the joints
            were judged already.

    Returns:
        The motion and its class at that instant; None where no ring and no pier ever moves.
    """
    verifier, joints = verifier_of(structure), flagged(joints, criteria)
    moving: dict[bytes, bool] = {}
    met: dict[int, VerifiedMechanism] = {}
    free = verifier.freedoms(joints)

    def at(instant: int) -> VerifiedMechanism:
        if instant not in met:
            met[instant] = verifier.verified(joints.isel(time=instant))
        return met[instant]

    def look(instant: int) -> int | None:
        state = free[instant].tobytes()
        if state not in moving:
            permitted = verifier.screen.permit(free[instant])
            moving[state] = permitted and at(instant).kind != "none"
        return instant if moving[state] else None

    instants = np.flatnonzero(free.any(axis=1))
    found = first_lasting(instants, joints["time"].values, Criteria.of(joints).duration, look)
    return None if found is None else at(found)


@dataclass(frozen=True, eq=False)
class Verifier:
    """Verifies mechanisms of one structure, instant by instant.

    Attributes:
        structure: whose blocks move.
    """

    structure: Structure

    @cached_property
    def skeleton(self) -> Skeleton:
        """Blocks and joints that can be part of a mechanism."""
        return skeleton_of(self.structure)

    @cached_property
    def blocks(self) -> RigidBlocks:
        """The skeleton's blocks, rigid."""
        return RigidBlocks(self.skeleton.structure)

    @cached_property
    def parts(self) -> tuple[str, ...]:
        """Parts whose motion is judged."""
        left = self.skeleton.structure
        return judged_parts({left.blocks[n].part: left.blocks[n].role for n in left.free})

    @cached_property
    def screen(self) -> Screen:
        """Tells at once of most states that they permit no motion of the judged parts."""
        return Screen(self.blocks, self.parts)

    def verified(self, joints: xr.Dataset) -> VerifiedMechanism:
        """Look for a motion at one instant, as `verified_mechanism` does.

        Args:
            joints: of the whole structure, as made by `joint_dataset`, with their flags.

        Returns:
            The motion and its class, beside the count.

        Raises:
            InvalidInput: `joints` has several instants, or is of another structure.
        """
        check_instant(self.structure, joints)
        scaled = _largest_motion(self.blocks, self.freedoms(joints))
        gaps = (self.blocks.kinematics @ (self.blocks.coordinates * scaled)).reshape(3, -1)
        working = np.flatnonzero(np.abs(gaps).max(axis=0) > MOVING)
        motion = self.blocks.motion(scaled)
        size = np.abs(motion * [1.0, 1.0, self.blocks.length]).max(axis=1)
        moving = np.flatnonzero(size > MOVING)
        blocks = self.skeleton.structure.blocks
        roles = {blocks[k].part: blocks[k].role for k in moving if blocks[k].part in self.parts}
        numbers = tuple(self.skeleton.joints[k] for k in working)
        moved = Mechanism(
            mechanism_kind(roles.values()),
            " + ".join(roles),
            numbers,
            float(joints["time"]) if "time" in joints.coords else None,
            tuple(self.skeleton.blocks[k] for k in moving),
            tuple(self.structure.joints[number].name for number in numbers),
        )
        counted = counted_mechanism(joints)
        return VerifiedMechanism(moved, counted, self.skeleton.in_whole(motion))

    def moving(self, joints: xr.Dataset) -> VerifiedMechanism | None:
        """Return the same, or None at once where rings and piers cannot move.

        Args:
            joints: as for `verified`.
        """
        if not self.screen.permit(self.freedoms(joints)):
            return None
        found = self.verified(joints)
        return None if found.kind == "none" else found

    def freedoms(self, joints: xr.Dataset) -> Array:
        """What each joint of the skeleton may do: open at its two ends, and slip.

        Args:
            joints: of the whole structure, as made by `joint_dataset`, with their flags.

        Returns:
            (…, 3 n_joints), intrados ends first, then extrados ends, then slips: 1 where an end
            may open, the sense in which a joint may slip, 1 or -1; 0 where it may not, and 2 where
            either sense will do.
        """
        own = list(self.skeleton.joints)
        side, slides, apart, shear = (
            joints.variables[name].transpose(..., "joint").values[..., own]
            for name in ("hinge", "slide", "open", "V")
        )
        return freedoms_of(side, slides, apart, np.sign(shear))


def freedoms_of(
    side: NDArray[Any], slides: NDArray[np.bool_], apart: NDArray[np.bool_], sense: NDArray[Any]
) -> Array:
    """Return what joints may do, as `Verifier.freedoms` does (…, 3 n_joints).

    Args:
        side: face on which each hinges, 1 extrados, -1 intrados, 0 none (…, n_joints).
        slides: whether its friction is used up (…, n_joints).
        apart: whether it has come apart (…, n_joints).
        sense: sign of its shear force (…, n_joints).
    """
    either = apart | (slides & (sense == 0.0))  # no friction and no shear force: either way
    slips = np.where(either, 2.0, np.where(slides, sense, 0.0))
    return np.concatenate([(side > 0) | apart, (side < 0) | apart, slips], axis=-1)


@lru_cache(maxsize=8)
def verifier_of(structure: Structure) -> Verifier:
    """Return the verifier of a structure, the same for structures that are equal.

    Args:
        structure: whose blocks move.
    """
    return Verifier(structure)


def _largest_motion(blocks: RigidBlocks, freedoms: Array) -> Array:
    """Solve the programme of `verified_mechanism` for the scaled motion (3 n_free,)."""
    either = freedoms == 2.0
    sense = np.where(either, 0.0, freedoms)
    gaps = blocks.kinematics @ sparse.diags(blocks.coordinates)
    free = sparse.diags(sense) @ gaps
    held = gaps[freedoms == 0.0]
    found = linprog(
        -np.asarray(free.sum(axis=0)).ravel(),
        A_ub=-free[sense != 0.0],
        b_ub=np.zeros(int(np.count_nonzero(sense))),
        A_eq=held,
        b_eq=np.zeros(held.shape[0]),
        bounds=(-1.0, 1.0),
        method="highs-ds",
    )
    if found.status != 0:
        raise DidNotConverge(f"the linear programme found no motion: {found.message}")
    motion: Array = found.x
    return motion
