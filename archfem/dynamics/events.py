"""Events that end a time history: enough joints have failed, or the blocks can move.

An event says what to look for. Each run has a fresh watch of its own made by it, so that one event
serves any number of runs.
"""

from collections.abc import Callable, Sequence
from dataclasses import InitVar, dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
import xarray as xr

from archfem.arrays import Array
from archfem.dynamics.glance import Glance, Look, Seen
from archfem.errors import InvalidInput
from archfem.joints.criteria import Criteria, chosen
from archfem.joints.duration import Unbroken
from archfem.joints.resultants import joint_dataset
from archfem.limit.counted import (
    KINDS,
    Mechanism,
    counted_mechanism,
    counted_mechanisms,
    definitions_met,
)
from archfem.limit.verified import freedoms_of, verifier_of
from archfem.masonry.naming import listed_joints
from archfem.masonry.roles import judged_parts
from archfem.masonry.structure import Structure

Watch = Callable[[Array, float], str | None]
"""Looks at N, V, M (n_joints, 3) of a step and its length [s]; words that say why the run ends, or
None."""


@runtime_checkable
class Event(Protocol):
    """What may end a run.

    Attributes:
        criteria: what makes a joint fail, or None for those of the run.
    """

    @property
    def criteria(self) -> Criteria | None:
        """What makes a joint fail, or None for those of the run."""

    def watch(self, structure: Structure, criteria: Criteria) -> Watch:
        """Return a fresh watch over one run.

        Args:
            structure: that moves.
            criteria: of the run.
        """


Until = Event | Callable[[Structure, Array], str | None]
"""An event, or a function of the structure and N, V, M of a step that gives words or None."""


@dataclass(frozen=True, kw_only=True)
class CountedMechanism:
    """Event: so many joints of one part, or of several, hinge, slide or have come apart at once.

    They do for as long as the criteria say. Its words say whether the blocks can also move.

    Attributes:
        criteria: what makes a joint fail, and how many make a mechanism; None for those of the
            run. Given here and not to the run, they become those of the run.
        kinds: classes that end the run, of "local", "semi-global" and "global".

    Args:
        criteria: as above.
        kinds: as above.
        limit: of |e| for a hinge, instead of criteria [-].
        failures: how many make a mechanism, instead of criteria.

    Raises:
        InvalidInput: a class is not known, or a value cannot be meant.
    """

    criteria: Criteria | None = None
    kinds: tuple[str, ...] = KINDS
    limit: InitVar[float | None] = None
    failures: InitVar[int | None] = None

    def __post_init__(self, limit: float | None, failures: int | None) -> None:
        own = chosen(self.criteria, hinge=limit, failures=failures)
        object.__setattr__(self, "criteria", own)
        _check_kinds(self.kinds)

    def watch(self, structure: Structure, criteria: Criteria) -> Watch:
        """Return a fresh watch, whose words say which joints have failed.

        Args:
            structure: that moves.
            criteria: of the run.
        """
        verifier, unbroken = verifier_of(structure), Unbroken(criteria.duration)

        def found(joints: xr.Dataset) -> Mechanism | None:
            return counted_mechanism(joints, kinds=self.kinds)

        judged = np.flatnonzero(structure.judged).tolist()
        glance = Glance(structure, criteria, judged, lambda seen: _named(found(seen.labelled())))

        def told(now: frozenset[str], resultants: Array, step: float) -> str | None:
            if not unbroken.lasts(bool(now), step):
                return None
            joints = glance.labelled(resultants)
            counted, motion = found(joints), verifier.verified(joints)
            assert counted is not None
            return f"a mechanism of {counted.part} by {listed_joints(counted.names)}; {motion}"

        return Look(glance, criteria.failures, told)


@dataclass(frozen=True, kw_only=True)
class MovingMechanism:
    """Event: the failed joints, and they alone, permit a motion of the blocks.

    They do for as long as the criteria say. Its words say whether the count of failures agrees.

    Attributes:
        criteria: what makes a joint fail; None for those of the run. Given here and not to the
            run, they become those of the run.
        kinds: classes that end the run, of "local", "semi-global" and "global".

    Args:
        criteria: as above.
        kinds: as above.
        limit: of |e| for a hinge, instead of criteria [-].

    Raises:
        InvalidInput: a class is not known, or a value cannot be meant.
    """

    criteria: Criteria | None = None
    kinds: tuple[str, ...] = KINDS
    limit: InitVar[float | None] = None

    def __post_init__(self, limit: float | None) -> None:
        own = chosen(self.criteria, hinge=limit)
        object.__setattr__(self, "criteria", own)
        _check_kinds(self.kinds)

    def watch(self, structure: Structure, criteria: Criteria) -> Watch:
        """Return a fresh watch, whose words say which joints permit which motion.

        Args:
            structure: that moves.
            criteria: of the run.
        """
        verifier, unbroken = verifier_of(structure), Unbroken(criteria.duration)

        def moves(seen: Seen) -> frozenset[str]:
            found = verifier.moving(seen.labelled())
            return _named(found if found is not None and found.kind in self.kinds else None)

        glance = Glance(structure, criteria, verifier.skeleton.joints, moves)

        def told(now: frozenset[str], resultants: Array, step: float) -> str | None:
            if not unbroken.lasts(bool(now), step):
                return None
            found = verifier.verified(glance.labelled(resultants))
            return f"a mechanism that moves, by {listed_joints(found.moved.names)}; {found}"

        return Look(glance, 1, told)


@dataclass(frozen=True, kw_only=True)
class EveryMechanism:
    """Event: a mechanism by each definition has been met, at one time of the run or another.

    Each lasts for as long as the criteria say. Definitions that the structure has no joints for are
    not waited for.

    Attributes:
        criteria: what makes a joint fail, and how many make a mechanism; None for those of the
            run. Given here and not to the run, they become those of the run.

    Args:
        criteria: as above.
        limit: of |e| for a hinge, instead of criteria [-].

    Raises:
        InvalidInput: a value cannot be meant.
    """

    criteria: Criteria | None = None
    limit: InitVar[float | None] = None

    def __post_init__(self, limit: float | None) -> None:
        own = chosen(self.criteria, hinge=limit)
        object.__setattr__(self, "criteria", own)

    def watch(self, structure: Structure, criteria: Criteria) -> Watch:
        """Return a fresh watch, which remembers what has been met.

        Args:
            structure: that moves.
            criteria: of the run.
        """
        verifier = verifier_of(structure)
        concerned = sorted({*np.flatnonzero(structure.judged), *verifier.skeleton.joints})
        roles = {joint.part: joint.role for joint in structure.joints}
        parts = np.array([structure.joints[number].part for number in concerned])
        own = np.searchsorted(concerned, verifier.skeleton.joints)
        wanted = {"verified", *possible_counts(structure, criteria)}
        times = {name: Unbroken(criteria.duration) for name in wanted}
        met: set[str] = set()

        def moves(seen: Seen) -> bool:
            free = freedoms_of(seen.side[own], seen.slides[own], seen.apart[own], seen.sense[own])
            if not verifier.screen.permit(free):
                return False
            return verifier.verified(seen.labelled()).kind != "none"

        def holding(seen: Seen) -> frozenset[str]:
            count = {part: int(seen.failed[parts == part].sum()) for part in judged_parts(roles)}
            counted = definitions_met(count, roles, criteria.failures)
            return counted | ({"verified"} if "verified" not in met and moves(seen) else set())

        glance = Glance(structure, criteria, concerned, holding)

        def told(now: frozenset[str], _: Array, step: float) -> str | None:
            met.update(name for name, time in times.items() if time.lasts(name in now, step))
            return "a mechanism by each definition" if met >= wanted else None

        return Look(glance, 1, told)


def agreed(criteria: Criteria | None, until: Until | None) -> Criteria:
    """Criteria of a run and of the event that may end it, which are the same.

    Args:
        criteria: given to the run, or None.
        until: the event, or None.

    Returns:
        Those given to the run, or else to the event, or else the usual ones.

    Raises:
        InvalidInput: both were given, and differ: what ends the run would be no mechanism of it.
    """
    own = until.criteria if isinstance(until, Event) else None
    if criteria is not None and own is not None and criteria != own:
        raise InvalidInput(
            f"the run is judged by {criteria}, and its event by {own}: give criteria to the run "
            "alone, which its event then obeys"
        )
    return criteria or own or Criteria()


def begun(until: Until, structure: Structure, criteria: Criteria) -> Watch:
    """Return a fresh watch over one run.

    Args:
        until: an event, or a function of structure and resultants.
        structure: that moves.
        criteria: of the run.

    Raises:
        InvalidInput: it is neither.
    """
    if isinstance(until, type) or not (isinstance(until, Event) or callable(until)):
        raise InvalidInput(
            f"until = {until!r} is no event: give one, e.g. CountedMechanism(), or a function of "
            "the structure and of N, V, M of its joints"
        )
    if isinstance(until, Event):
        return until.watch(structure, criteria)
    return lambda resultants, step: until(structure, resultants)


def first_told(watch: Watch, resultants: Array, steps: Sequence[float]) -> tuple[int, str] | None:
    """Return the first step at which a watch ends the run, and its words; None where it does not.

    Args:
        watch: over the run.
        resultants: N, V, M of steps one after another (steps, n_joints, 3) [N, N, N m].
        steps: their lengths (steps,) [s].
    """
    if isinstance(watch, Look):
        return watch.first(resultants, steps)
    for number, step in enumerate(steps):
        if words := watch(resultants[number], step):
            return number, words
    return None


def possible_counts(structure: Structure, criteria: Criteria | None = None) -> tuple[str, ...]:
    """Return the definitions of `counted_mechanisms` that the structure has joints enough for.

    Args:
        structure: what may fail.
        criteria: say how many joints it takes; by default the usual ones.
    """
    apart = joint_dataset(structure, np.zeros((len(structure.joints), 3)), criteria=criteria)
    return tuple(name for name, found in counted_mechanisms(apart).items() if found is not None)


def _named(found: object) -> frozenset[str]:
    """What a look has found, by name: a mechanism, or nothing."""
    return frozenset() if found is None else frozenset({"mechanism"})


def _check_kinds(kinds: Any) -> None:
    """Refuse classes that no mechanism has."""
    if not isinstance(kinds, list | tuple) or not kinds or not all(each in KINDS for each in kinds):
        raise InvalidInput(f"kinds = {kinds!r}: give some of {KINDS}, as a tuple")
