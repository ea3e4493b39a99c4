"""Mechanisms by counting failed joints, at once or over a record: classes, duration, opening.

Most mechanisms by count close again before anything falls: those of a record have a duration.
`mechanism_kinematics` checks whether the failed joints permit a motion.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from archfem._validation import validate_arguments
from archfem.joints.criteria import (
    HEAD_COORDINATE,
    Criteria,
    assessed_joints,
    find_failed_joints,
    find_first_lasting,
    lasting_flags,
    part_roles,
    step_lengths,
    with_failure_flags,
)
from archfem.masonry.parts import select_assessed_parts
from archfem.masonry.structure import join_joint_names, join_names
from archfem.units import format_mm

# Classes of mechanisms, from narrow to wide
MECHANISM_KINDS = ("local", "semi-global", "global")

# Definitions by joints that have failed at once, and the classes that each of them finds
DEFINITIONS_AT_ONCE = {
    "any joints at once": MECHANISM_KINDS,
    "one part at once": ("local",),
    "ring and pier at once": ("semi-global",),
}

# Definition by which a joint that has once failed counts from then on
OVER_RECORD = "one part over the record"


@dataclass(frozen=True)
class Mechanism:
    """Parts of a structure that fail, or move, together.

    Names and the course, by duration and opening, play no part in comparisons.

    Attributes:
        kind: class of the mechanism: "local" in one ring or one pier, "semi-global" in one ring
            and one pier, "global" in more; "none" where no ring and no pier moves.
        part: names of the rings and piers concerned, joined by " + ".
        joints: numbers of the failed joints; by motion, of those that open or slip.
        time: instant [s]; None for a static state.
        blocks: numbers of the blocks that can move; empty where rings and piers cannot, or for a
            mechanism by count.
        names: names of `joints`.
        block_names: names of `blocks`.
        duration: unbroken time for which all its joints stay failed, where a record stands for the
            step that ends with it; of "one part over the record", time from the first failure to
            the last one needed [s]. None for a static state.
        opening: largest opening of any of its joints meanwhile; of "one part over the record", at
            any time of the run [m]. None for a static state, or where openings are not recorded.
        closes: whether the duration ends before the record does; None over the record.
        slip: largest slip of any of its joints meanwhile, from its begin on; None as `opening`, and
            of "one part over the record" [m].
        below: displacement that a verified mechanism does not reach, being too small to matter [m];
            None for one that moves farther.
        larger: first verified mechanism that moves by more than `below`, or None.
    """

    kind: str
    part: str
    joints: tuple[int, ...]
    time: float | None = None
    blocks: tuple[int, ...] = ()
    names: tuple[str, ...] = field(default=(), compare=False)
    block_names: tuple[str, ...] = field(default=(), compare=False)
    duration: float | None = field(default=None, compare=False)
    opening: float | None = field(default=None, compare=False)
    closes: bool | None = field(default=None, compare=False)
    slip: float | None = field(default=None, compare=False)
    below: float | None = field(default=None, compare=False)
    larger: "Mechanism | None" = field(default=None, compare=False)

    @property
    def displacement(self) -> float:
        """Largest opening or slip of its joints, as far as they are known [m]."""
        return max(self.opening or 0.0, self.slip or 0.0)

    @property
    def decisive(self) -> "Mechanism | None":
        """This mechanism, or the first larger one if it is too small to matter."""
        return self if self.below is None else self.larger

    @property
    def course(self) -> str:
        """Duration, opening, and whether it closes again, in words; "" for a static state."""
        if self.duration is None:
            return ""
        wide = "" if self.opening is None else f"by up to {format_mm(self.displacement)}"
        if self.closes is None:
            span = f"joint by joint within {duration_text(self.duration)}"
            text = f"it forms {span if self.duration > 0.0 else 'at once'}"
            return f"{text}, opens {wide}" if wide else text
        verb = "slips" if self.slip and self.displacement == self.slip else "opens"
        text = f"it lasts {duration_text(self.duration)}" + (f", {verb} {wide}" if wide else "")
        end = "closes again" if self.closes else "has not closed when the record ends"
        return f"{text} and {end}"

    def __str__(self) -> str:
        """Class, part, time, joints and course, the blocks that can move, and a larger one."""
        time = "" if self.time is None else f" at {self.time:.3f} s"
        words = f"{self.kind} mechanism of {self.part}{time} by {join_joint_names(self.names)}"
        moving = f"moving: {join_names(self.block_names, '; ')}" if self.block_names else ""
        farther = ""
        if self.below is not None:
            farther = f"moves by more than {format_mm(self.below)}"
            farther = (
                f"the first that {farther}: {self.larger}" if self.larger else f"none {farther}"
            )
        return "; ".join(filter(None, [words, self.course, moving, farther]))


def duration_text(duration: float) -> str:
    """Return a duration as text, short ones in milliseconds."""
    return f"{duration:.3g} s" if duration >= 1.0 else f"{1e3 * duration:.3g} ms"


def mechanism_kind(roles: Collection[str]) -> str:
    """Return the class of a mechanism: "none", "local", "semi-global" or "global"."""
    carrying = sorted(role for role in roles if role != "other")
    if len(carrying) < 2:
        return "local" if roles else "none"
    return "semi-global" if carrying == ["pier", "ring"] else "global"


@validate_arguments
def counted_mechanism(
    joints: xr.Dataset, criteria: Criteria | None = None, *, kinds: Sequence[str] = MECHANISM_KINDS
) -> Mechanism | None:
    """Find the first instant from which on enough joints have failed at once.

    A wide reading of Demirel and Aldemir (2021) takes at least four hinging or sliding joints. They
    are in one ring alone (local), have joints of one pier among the four (semi-global), or belong
    to more rings and piers (global). `demirel_aldemir_mechanism` follows their words. A joint that
    has come apart counts too. The class is that of all joints failed at the instant;
    `kinds=("local",)` finds four in one ring regardless of further failures. Over time enough
    joints must have failed for as long as the criteria say, the same ones or others.

    Args:
        joints: over joint, or over time and joint; those of `judged` are counted.
        criteria: conditions of failure, number of failed joints that make a mechanism, and their
            duration; by default those by which the joints were judged already.
        kinds: classes of mechanisms to find.

    Returns:
        The mechanism, or None.
    """
    joints = with_failure_flags(joints, criteria)
    return _find_counted(joints, Failures.of(joints), kinds)


def _find_counted(
    joints: xr.Dataset, failures: "Failures", kinds: Sequence[str]
) -> Mechanism | None:
    """Return the result of `counted_mechanism`, from joints with their flags."""
    limits, roles, flags, counts = failures

    enough = np.flatnonzero(sum(counts.values()) >= limits.failures)
    if not len(enough):
        return None
    # over a run the same counts are frequent
    rows = np.array(list(counts.values()))[:, enough]
    patterns, places = np.unique(rows, axis=1, return_inverse=True)
    groups = [
        _widest_group(dict(zip(counts, numbers, strict=True)), roles, limits.failures, kinds)
        for numbers in patterns.T.tolist()
    ]
    holds = np.zeros(len(flags), bool)
    holds[enough] = np.array([group is not None for group in groups], bool)[places.ravel()]
    instant = find_first_lasting(holds, flags["time"].values, limits.duration)
    if instant is None:
        return None
    group = groups[int(places.ravel()[np.searchsorted(enough, instant)])]
    assert group is not None
    kind = mechanism_kind([roles[name] for name in group])
    return follow_mechanism(joints, _mechanism(flags, instant, kind, group), flags)


@validate_arguments
def demirel_aldemir_mechanism(
    joints: xr.Dataset, criteria: Criteria | None = None
) -> Mechanism | None:
    """Find the first mechanism by the criterion of Demirel and Aldemir (2021), as they word it.

    One ring must have four hinging or sliding joints of its own at once; then it has collapsed
    locally. Where joints of piers have failed too, the mechanism is semi-global or global. Joints
    of a pier thus change the class, and never help to make up the four, as they do in
    `counted_mechanism`. Open points of the paper are read so: a joint counts once, though it
    hinges and slides; one that has come apart, whose ratios are beyond any limit, counts as failed;
    with joints of one pier it is semi-global, with joints of more global. The number four is that
    of the criteria. Their hinge is at |e| = 0.46, 8 % short of the 0.5 of the paper's equation, as
    in its evaluation of the bridge. The paper does not word a duration; it is that of the criteria.

    Args:
        joints: over joint, or over time and joint.
        criteria: by default those by which the joints were judged already.

    Returns:
        The mechanism, of the rings that have collapsed and the piers with failed joints, or None.

    References:
        Demirel and Aldemir, Buildings 11 (2021), section 2, criteria 1 and 2 and the text after
        them.
    """
    joints = with_failure_flags(joints, criteria)
    limits, roles, flags = Criteria.of(joints), part_roles(joints), _flags_over_time(joints)
    counts = _count_by_part(flags, roles)
    rings = [name for name, role in roles.items() if role == "ring"]
    collapsed = np.array([counts[name] >= limits.failures for name in rings])
    collapsed = collapsed.reshape(-1, flags.sizes["time"])  # also without any ring
    instant = find_first_lasting(collapsed.any(axis=0), flags["time"].values, limits.duration)
    if instant is None:
        return None
    fallen = [name for name, down in zip(rings, collapsed[:, instant], strict=True) if down]
    piers = [name for name, role in roles.items() if role == "pier" and counts[name][instant]]
    group = [name for name in roles if name in (*fallen, *piers)]
    kind = MECHANISM_KINDS[min(len(piers), 2)]
    return follow_mechanism(joints, _mechanism(flags, instant, kind, group), flags)


@validate_arguments
def mechanism_over_record(joints: xr.Dataset, criteria: Criteria | None = None) -> Mechanism | None:
    """Find the instant at which enough joints of one ring or one pier have failed so far.

    A joint that has once failed, for the duration of the criteria, counts from then on, whether or
    not it has closed again. The joints need never have failed at once, so that this is a measure of
    damage over a record, and the widest of all definitions.

    Args:
        joints: over joint, or over time and joint; those of rings and piers are counted.
        criteria: by default those by which the joints were judged already.

    Returns:
        The mechanism, "local", with the joints that have failed until its time and its duration
        from the first of these failures, or None.
    """
    joints = with_failure_flags(joints, criteria)
    return _find_over_record(joints, Failures.of(joints))


def _find_over_record(joints: xr.Dataset, failures: "Failures") -> Mechanism | None:
    """Return the result of `mechanism_over_record`, from joints with their flags."""
    limits, roles, each, _ = failures
    failed = np.logical_or.accumulate(
        lasting_flags(each.values, each["time"].values, limits.duration), axis=0
    )
    flags = each.copy(data=failed)
    counts = _count_by_part(flags, select_assessed_parts(roles))
    instants = {
        part: int(np.argmax(count >= limits.failures))
        for part, count in counts.items()
        if count[-1] >= limits.failures
    }
    if not instants:
        return None
    part = min(instants, key=lambda name: instants[name])
    found = _mechanism(flags, instants[part], "local", [part])
    if found.time is None:
        return found
    own = np.isin(joints["joint"].values, found.joints)
    begin = float(each["time"][each.values[:, own].any(axis=1).argmax()])
    opening = float(joints["opening"].isel(joint=own).max()) if "opening" in joints else None
    return replace(found, duration=found.time - begin, opening=opening)


@validate_arguments
def counted_mechanisms(
    joints: xr.Dataset, criteria: Criteria | None = None
) -> dict[str, Mechanism | None]:
    """Find the first mechanism by each of the definitions in use that count joints.

    "Any joints at once" are of rings and piers, anywhere; "one part at once" of one ring or one
    pier, regardless of further failures; "ring and pier at once" of one ring and one pier together,
    at least one of each; "one part over the record" of one ring or one pier at any times, see
    `mechanism_over_record`. How many joints make a mechanism is set by the criteria.

    Args:
        joints: over joint, or over time and joint.
        criteria: by default those by which the joints were judged already.

    Returns:
        The first mechanism by each definition, or None, by the definition's name.
    """
    joints = with_failure_flags(joints, criteria)
    failures = Failures.of(joints)
    found = {
        definition: _find_counted(joints, failures, kinds)
        for definition, kinds in DEFINITIONS_AT_ONCE.items()
    }
    return {**found, OVER_RECORD: _find_over_record(joints, failures)}


def follow_mechanism(joints: xr.Dataset, found: Mechanism, flags: xr.DataArray) -> Mechanism:
    """Return a mechanism with duration, opening and slip, for as long as its joints stay failed.

    Failure flags are over time and joint.
    """
    if "time" not in joints.dims:
        return found
    times = joints["time"].values
    begin = int(np.flatnonzero(times == found.time)[0])
    own = np.isin(joints["joint"].values, found.joints)
    all_failed = flags.values[begin:, own].all(axis=1)
    count = len(all_failed) if all_failed.all() else int(all_failed.argmin())
    duration = float(step_lengths(times)[begin : begin + count].sum())
    moved = {
        name: joints.variables[name].transpose("time", "joint").values[begin : begin + count, own]
        for name in ("opening", "slip")
        if name in joints
    }
    if "slip" in moved:
        moved["slip"] = abs(moved["slip"] - moved["slip"][0])
    course: Any = {name: float(np.nanmax(values)) for name, values in moved.items()}
    return replace(found, duration=duration, closes=begin + count < len(times), **course)


class Failures(NamedTuple):
    """Failed joints over time, and their number in each part that counts."""

    criteria: Criteria
    roles: Mapping[str, str]  # of each part
    flags: xr.DataArray  # over time and joint
    counts: Mapping[str, NDArray[np.int64]]  # of each assessed part (steps,)

    @classmethod
    def of(cls, joints: xr.Dataset) -> "Failures":
        """Return the failures of joints with their flags."""
        roles, flags = part_roles(joints), _flags_over_time(joints)
        counts = _count_by_part(flags, select_assessed_parts(roles))
        return cls(Criteria.of(joints), roles, flags, counts)


def leave_out_walls(joints: xr.Dataset) -> xr.Dataset:
    """Return the joints without those of walls in bond, where a count says nothing."""
    # their bed joints touch and part in turn: any four of hundreds are no mechanism
    if HEAD_COORDINATE not in joints.coords:
        return joints
    parts = joints["part"].values.astype(str)
    walls = parts[joints[HEAD_COORDINATE].values]
    return joints.isel(joint=~np.isin(parts, walls)) if len(walls) else joints


def has_counted_mechanism(joints: xr.Dataset) -> xr.DataArray:
    """Return whether enough joints for a mechanism by count have failed at each instant."""
    return find_failed_joints(assessed_joints(joints)).sum("joint") >= Criteria.of(joints).failures


def matching_definitions(
    count: Mapping[str, int], roles: Mapping[str, str], failures: int
) -> frozenset[str]:
    """Return the definitions of `counted_mechanisms` that failed joints meet at an instant."""
    return frozenset(
        name
        for name, kinds in DEFINITIONS_AT_ONCE.items()
        if _widest_group(count, roles, failures, kinds) is not None
    )


def _flags_over_time(joints: xr.Dataset) -> xr.DataArray:
    """Return failure flags over time and joint; a static state has one instant, NaN."""
    flags = find_failed_joints(joints)
    if "time" not in flags.coords:
        flags = flags.assign_coords(time=np.nan)
    if "time" not in flags.dims:
        flags = flags.expand_dims("time")
    return flags if flags.dims == ("time", "joint") else flags.transpose("time", "joint")


def _count_by_part(flags: xr.DataArray, parts: Iterable[str]) -> dict[str, NDArray[np.int64]]:
    """Return the number of failed joints of each part, by its name, over time (steps,)."""
    part, failures = flags["part"].values.astype(str), flags.values
    return {name: failures[:, part == name].sum(axis=1) for name in parts}


def _mechanism(flags: xr.DataArray, instant: int, kind: str, group: Sequence[str]) -> Mechanism:
    """Return the mechanism of the failed joints of some parts at an instant."""
    chosen = flags.values[instant] & np.isin(flags["part"].values.astype(str), group)
    joints, names = (flags[name].values[chosen] for name in ("joint", "name"))
    joints, names, at = joints.tolist(), names.astype(str).tolist(), flags["time"].values[instant]
    time = None if np.isnan(at) else float(at)
    return Mechanism(kind, " + ".join(group), tuple(joints), time, names=tuple(names))


def _widest_group(
    count: Mapping[str, int], roles: Mapping[str, str], failures: int, kinds: Sequence[str]
) -> tuple[str, ...] | None:
    """Return the parts with enough failures together, of the widest permitted class, or None."""

    def kind(group: Sequence[str]) -> str:
        return mechanism_kind([roles[name] for name in group])

    def total(group: Sequence[str]) -> int:
        return sum(count[name] for name in group)

    hit = tuple(name for name in count if count[name])
    groups = [*combinations(hit, 1), *combinations(hit, 2), hit]
    enough = [group for group in groups if total(group) >= failures and kind(group) in kinds]
    # among groups of one class the one with most failures
    return max(
        enough, key=lambda group: (MECHANISM_KINDS.index(kind(group)), total(group)), default=None
    )
