"""Mechanisms that are verified: is there a motion that the failed joints, and only they, permit?"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import xarray as xr
from scipy import sparse
from scipy.optimize import linprog

from archfem.criteria import (
    HINGE,
    Mechanism,
    counted_mechanism,
    failed,
    hinged,
    mechanism_kind,
    opened,
    sliding,
)
from archfem.equilibrium import RigidBlocks
from archfem.errors import DidNotConverge, InvalidInput
from archfem.structure import Array, Structure

MOVING = 1e-6
"""Least motion, relative to the largest allowed, that counts as a motion."""


@dataclass(frozen=True, eq=False)
class VerifiedMechanism:
    """What the failed joints of an instant permit, beside what counting them says.

    Attributes:
        moved: the mechanism by motion, with the blocks that move; its kind is "none" where no
            motion exists.
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
        moved = f"{self.kind} ({self.moved.part})" if self.moved.blocks else "none"
        verdict = "agree" if self.agrees else "disagree"
        return f"motion and count {verdict}: by motion {moved}, by count {counted}"


def verified_mechanism(
    structure: Structure, joints: xr.Dataset, limit: float = HINGE
) -> VerifiedMechanism:
    """Look for a rigid-block motion that the joints failed at one instant permit.

    The largest motion v, within a box, that opens a joint only where it hinges (away from the face
    that stays in contact) or has come apart, slides only where friction is used up and in the
    sense of the shear force, and closes none:

        max Σ g   subject to   g = G v,   g >= 0 where the joint may move,   g = 0 elsewhere,

    with g the openings of both ends and the slip of each joint, and |v| <= 1. Where the maximum is
    zero the failures are not a mechanism, however many they are.

    Args:
        structure: whose blocks move.
        joints: as made by `joint_dataset`, at one instant.
        limit: of |e| for a hinge [-].

    Returns:
        The motion and its class by the rings and piers that move, beside the count.

    Raises:
        InvalidInput: `joints` has several instants, or those of another structure.

    References:
        Heyman, Int. J. Solids Struct. 2 (1966) 249-279: a mechanism needs hinges on alternating
        faces, not only four of them.
    """
    if joints["N"].dims != ("joint",) or joints.sizes["joint"] != len(structure.joints):
        raise InvalidInput(
            f"joints have dimensions {dict(joints.sizes)}: give one instant of the "
            f"{len(structure.joints)} joints of this structure, e.g. joints.isel(time=-1)"
        )
    blocks = RigidBlocks(structure)
    motion = blocks.motion(_largest_motion(blocks, *freedoms(joints, limit)))
    size = np.abs(motion * [1.0, 1.0, blocks.length]).max(axis=1)
    moving = tuple(int(number) for number in np.flatnonzero(size > MOVING))
    parts = list(dict.fromkeys(structure.blocks[number].part for number in moving))
    numbers = tuple(int(number) for number in np.flatnonzero(failed(joints, limit)))
    time = float(joints["time"]) if "time" in joints.coords else None
    moved = Mechanism(mechanism_kind(parts), " + ".join(parts), numbers, time, moving)
    return VerifiedMechanism(moved, counted_mechanism(joints, limit), motion)


def freedoms(joints: xr.Dataset, limit: float = HINGE) -> tuple[Array, Array]:
    """What each joint may do: of both openings, intrados ends first, and of the slip.

    Args:
        joints: as made by `joint_dataset`.
        limit: of |e| for a hinge [-].

    Returns:
        Openings (…, 2 n_joints), 1 where an end may open. Slips (…, n_joints), the sense in which
        a joint may slide, 1 or -1; 0 where it may not, and 2 for either sense.
    """
    side, apart = hinged(joints, limit).values, opened(joints).values
    ends = np.concatenate([(side > 0) | apart, (side < 0) | apart], axis=-1)
    sense, slides = np.sign(joints["V"].values), sliding(joints).values
    either = apart | (slides & (sense == 0.0))  # no friction and no shear force: either way
    return ends.astype(float), np.where(either, 2.0, np.where(slides, sense, 0.0))


def first_verified_mechanism(
    structure: Structure, joints: xr.Dataset, limit: float = HINGE
) -> VerifiedMechanism | None:
    """Find the first instant of a time history at which the failed joints permit a motion.

    Args:
        structure: whose blocks move.
        joints: over time and joint.
        limit: of |e| for a hinge [-].
    """
    free = np.concatenate(freedoms(joints.transpose("time", "joint"), limit), axis=1)
    changed = [True, *(bool(np.any(a != b)) for a, b in pairwise(free))]
    for instant in np.flatnonzero(free.any(axis=1) & changed):
        found = verified_mechanism(structure, joints.isel(time=int(instant)), limit)
        if found.moved.blocks:
            return found
    return None


def _largest_motion(blocks: RigidBlocks, openings: Array, slips: Array) -> Array:
    """Solve the programme of `verified_mechanism` for the scaled motion (3 n_free,)."""
    either = np.concatenate([np.zeros_like(openings), slips == 2.0]).astype(bool)
    sense = np.concatenate([openings, np.where(slips == 2.0, 0.0, slips)])
    gaps = blocks.kinematics @ sparse.diags(blocks.coordinates)
    free = sparse.diags(sense) @ gaps
    held = gaps[~either & (sense == 0.0)]
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
    return found.x
