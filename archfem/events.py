"""Events that end a time history: enough joints have failed, or the blocks can move."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from archfem.criteria import FAILURES, HINGE, KINDS, USED_UP, counted_mechanism
from archfem.mechanism import freedoms, verified_mechanism
from archfem.resultants import joint_dataset
from archfem.structure import Array, Structure

Event = Callable[[Structure, Array], str | None]
"""Looks at N, V, M (n_joints, 3) of a step; words that say why the run ends, or None."""


@dataclass(frozen=True, kw_only=True)
class CountedMechanism:
    """Event: so many joints of one part, or of several, hinge, slide or have come apart at once.

    Its words say whether the blocks can also move.

    Attributes:
        limit: of |e| for a hinge [-].
        failures: how many make a mechanism.
        kinds: classes that end the run, of "local", "semi-global" and "global".
    """

    limit: float = HINGE
    failures: int = FAILURES
    kinds: tuple[str, ...] = KINDS

    def __call__(self, structure: Structure, resultants: Array) -> str | None:
        """Say which joints have failed, or None."""
        if _down(structure, resultants, self.limit).sum() < self.failures:
            return None
        joints = joint_dataset(structure, resultants)
        found = counted_mechanism(joints, self.limit, self.failures, self.kinds)
        if found is None:
            return None
        motion = verified_mechanism(structure, joints, self.limit)
        return f"a mechanism: joints {found.joints} of the {found.part}; {motion}"


@dataclass(frozen=True, kw_only=True)
class MovingMechanism:
    """Event: the failed joints, and they alone, permit a motion of the blocks.

    Its words say whether the count of failures agrees. States that recur are looked at once.

    Attributes:
        limit: of |e| for a hinge [-].
        kinds: classes that end the run, of "local", "semi-global" and "global".
    """

    limit: float = HINGE
    kinds: tuple[str, ...] = KINDS
    _known: dict[bytes, str | None] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def __call__(self, structure: Structure, resultants: Array) -> str | None:
        """Say which joints permit which motion, or None."""
        if not _down(structure, resultants, self.limit).any():
            return None
        joints = joint_dataset(structure, resultants)
        state = np.concatenate(freedoms(joints, self.limit)).tobytes()
        if state not in self._known:
            found = verified_mechanism(structure, joints, self.limit)
            words = f"a mechanism that moves: joints {found.moved.joints}; {found}"
            self._known[state] = words if found.kind in self.kinds else None
        return self._known[state]


def _down(structure: Structure, resultants: Array, limit: float) -> NDArray[np.bool_]:
    """Whether each joint hinges, slides or has come apart: a quick look at every step."""
    normal, shear, moment = np.abs(resultants.T)
    depth = np.array([joint.depth for joint in structure.joints])
    friction = np.array([joint.contact.friction for joint in structure.joints])
    used_up = shear >= (1.0 - USED_UP) * friction * normal
    return (moment >= limit * normal * depth) | used_up | (resultants[:, 0] <= 0.0)
