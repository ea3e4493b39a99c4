"""Events that end a time history: enough joints have failed, or the blocks can move."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from archfem.counted import FAILURES, KINDS, counted_mechanism, counted_mechanisms
from archfem.criteria import HINGE, USED_UP
from archfem.mechanism import Verifier
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
    _watches: dict[int, "_Watch"] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def __call__(self, structure: Structure, resultants: Array) -> str | None:
        """Say which joints have failed, or None."""
        watch = _watch(self._watches, structure)
        state = watch.state(resultants, watch.judged, self.limit)
        if np.count_nonzero(state) < self.failures or state.tobytes() in watch.idle:
            return None
        joints = joint_dataset(structure, resultants)
        found = counted_mechanism(joints, self.limit, self.failures, self.kinds)
        if found is None:
            watch.idle.add(state.tobytes())
            return None
        motion = watch.verifier.verified(joints, self.limit)
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
    _watches: dict[int, "_Watch"] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def __call__(self, structure: Structure, resultants: Array) -> str | None:
        """Say which joints permit which motion, or None."""
        watch = _watch(self._watches, structure)
        state = watch.state(resultants, watch.skeleton, self.limit)
        if not state.any() or state.tobytes() in watch.idle:
            return None
        found = watch.verifier.moving(joint_dataset(structure, resultants), self.limit)
        if found is None or found.kind not in self.kinds:
            watch.idle.add(state.tobytes())
            return None
        return f"a mechanism that moves: joints {found.moved.joints}; {found}"


@dataclass(frozen=True, kw_only=True)
class EveryMechanism:
    """Event: a mechanism by each definition has been met, at one step or another.

    Definitions that the structure has no joints for are not waited for. It remembers what it has
    met, and so serves one run.

    Attributes:
        limit: of |e| for a hinge [-].
    """

    limit: float = HINGE
    _met: set[str] = field(default_factory=set, init=False, repr=False, compare=False)
    _watches: dict[int, "_Watch"] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def __call__(self, structure: Structure, resultants: Array) -> str | None:
        """Say that all have been met, or None."""
        watch = _watch(self._watches, structure)
        state = np.concatenate(
            [watch.state(resultants, each, self.limit) for each in (watch.judged, watch.skeleton)]
        )
        if not state.any() or state.tobytes() in watch.idle:
            return None
        watch.idle.add(state.tobytes())
        joints = joint_dataset(structure, resultants)
        counted = counted_mechanisms(joints, self.limit)
        self._met.update(name for name, found in counted.items() if found is not None)
        if "verified" not in self._met and watch.verifier.moving(joints, self.limit) is not None:
            self._met.add("verified")
        return "a mechanism by each definition" if self._met >= watch.wanted else None


def possible_counts(structure: Structure) -> tuple[str, ...]:
    """Definitions of `counted_mechanisms` that the structure has joints enough for."""
    apart = joint_dataset(structure, np.zeros((len(structure.joints), 3)))
    return tuple(name for name, found in counted_mechanisms(apart).items() if found is not None)


class _Watch:
    """A quick look at the joints of one structure at every step.

    Attributes:
        verifier: of mechanisms of the structure.
        judged: numbers of the joints that are judged.
        skeleton: numbers of the joints that can be part of a mechanism.
        idle: states of joints that are known to be no event, so that nobody looks twice.
    """

    def __init__(self, structure: Structure) -> None:
        joints = structure.joints
        self.verifier = Verifier(structure)
        self.judged = np.flatnonzero(structure.judged)
        self.skeleton = np.array(self.verifier.skeleton.joints)
        self.idle: set[bytes] = set()
        self._structure = structure
        self._depth = np.array([joint.depth for joint in joints])
        self._friction = np.array([joint.contact.friction for joint in joints])

    @cached_property
    def wanted(self) -> set[str]:
        """Definitions of a mechanism that the structure has joints enough for."""
        return {"verified", *possible_counts(self._structure)}

    def state(
        self, resultants: Array, numbers: NDArray[np.int64], limit: float
    ) -> NDArray[np.int8]:
        """How joints hinge and slide, one number a joint; zero where it does neither."""
        normal, shear, moment = resultants[numbers].T
        hinges = np.abs(moment) >= limit * normal * self._depth[numbers]
        slides = np.abs(shear) >= (1.0 - USED_UP) * self._friction[numbers] * normal
        ways = np.where(hinges, np.sign(moment), 0.0)
        ways += np.where(slides, 4.0 * (2.0 + np.sign(shear)), 0.0)
        return np.where(normal > 0.0, ways, 100.0).astype(np.int8)


def _watch(watches: dict[int, _Watch], structure: Structure) -> _Watch:
    """The watch over a structure, which is set up once."""
    if id(structure) not in watches:
        watches[id(structure)] = _Watch(structure)
    return watches[id(structure)]
