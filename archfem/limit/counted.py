"""Mechanisms by counting failed joints, and the classes of mechanisms."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from archfem.joints.criteria import Criteria, failed, flagged, judged, roles_of
from archfem.joints.duration import first_lasting
from archfem.masonry.roles import judged_parts

KINDS = ("local", "semi-global", "global")
"""Classes of mechanisms, smallest first."""


@dataclass(frozen=True)
class Mechanism:
    """Parts of a structure that fail, or move, together.

    Attributes:
        kind: one of `KINDS`: "local" in one ring or one pier, "semi-global" in one ring and one
            pier, "global" in more; "none" where no ring and no pier moves.
        part: the rings and piers concerned, joined by " + ".
        joints: numbers of the failed joints; of those that open or slip, where motion tells.
        time: when [s]; None for a static state.
        blocks: numbers of the blocks that can move; empty where rings and piers cannot, or nobody
            asked.
        names: of those joints; they say the same again, and do not count in comparisons.
    """

    kind: str
    part: str
    joints: tuple[int, ...]
    time: float | None = None
    blocks: tuple[int, ...] = ()
    names: tuple[str, ...] = field(default=(), compare=False)


def mechanism_kind(roles: Collection[str]) -> str:
    """Return the class of a mechanism: "none", "local", "semi-global" or "global".

    Args:
        roles: of the judged parts that fail or move, one for each.
    """
    carrying = sorted(role for role in roles if role != "other")
    if len(carrying) < 2:
        return "local" if roles else "none"
    return "semi-global" if carrying == ["pier", "ring"] else "global"


def counted_mechanism(
    joints: xr.Dataset, criteria: Criteria | None = None, *, kinds: Sequence[str] = KINDS
) -> Mechanism | None:
    """Find the first instant from which on enough joints have failed at once.

    A wide reading of Demirel and Aldemir (2021): at least four hinging or sliding joints in one
    ring alone (local), with joints of one pier among the four (semi-global), or of more rings and
    piers (global); `demirel_aldemir_mechanism` keeps to their words. A joint that has come apart
    counts too. The class is that of all joints failed at the instant; ask for `kinds=("local",)` to
    find four in one ring whatever else fails. Over time enough joints must have failed for as long
    as the criteria say, the same ones or others.

    Args:
        joints: over joint, or over time and joint; those of `judged` are counted.
        criteria: what makes a joint fail, how many make a mechanism, and for how long; by default
            those by which the joints were judged already.
        kinds: classes to look for.

    Returns:
        The mechanism, or None.
    """
    own, roles = Criteria.of(joints := flagged(joints, criteria)), roles_of(joints)
    flags = _over_time(joints)
    counts = _counts(flags, judged_parts(roles))

    def look(instant: int) -> tuple[int, tuple[str, ...]] | None:
        count = {name: int(failures_of[instant]) for name, failures_of in counts.items()}
        group = _widest_group(count, roles, own.failures, kinds)
        return None if group is None else (instant, group)

    enough = np.flatnonzero(sum(counts.values()) >= own.failures)
    found = first_lasting(enough, flags["time"].values, own.duration, look)
    if found is None:
        return None
    return _mechanism(flags, found[0], mechanism_kind([roles[name] for name in found[1]]), found[1])


def demirel_aldemir_mechanism(
    joints: xr.Dataset, criteria: Criteria | None = None
) -> Mechanism | None:
    """Find the first mechanism by the criterion of Demirel and Aldemir (2021), as they word it.

    One ring must have four hinging or sliding joints of its own at once; then it has collapsed
    locally. Where joints of piers have failed too, the mechanism is semi-global or global. Joints
    of a pier thus change the class, and never help to make up the four, as they do in
    `counted_mechanism`. So it begins at the very instant of "four in a ring" of
    `counted_mechanisms`. What the paper leaves open is read so: a joint counts once, though it
    hinges and slides; one that has come apart, whose ratios are beyond any limit, counts as failed;
    with joints of one pier it is semi-global, with joints of more global. Four are as many as the
    criteria say, and their hinge is at |e| = 0.46, 8 % short of the 0.5 that the paper's equation
    has, as in its evaluation of the bridge. For how long they must is not worded; it is as the
    criteria say.

    Args:
        joints: over joint, or over time and joint.
        criteria: by default those by which the joints were judged already.

    Returns:
        The mechanism, of the rings that have collapsed and the piers with failed joints, or None.

    References:
        Demirel and Aldemir, Buildings 11 (2021), section 2, criteria 1 and 2 and what follows.
    """
    own, roles = Criteria.of(joints := flagged(joints, criteria)), roles_of(joints)
    flags = _over_time(joints)
    counts = _counts(flags, roles)
    rings = [name for name, role in roles.items() if role == "ring"]
    enough = np.array([counts[name] >= own.failures for name in rings]).reshape(
        -1, flags.sizes["time"]
    )
    times, up = flags["time"].values, np.flatnonzero(enough.any(axis=0))
    instant = first_lasting(up, times, own.duration, lambda number: number)
    if instant is None:
        return None
    fallen = [name for name, down in zip(rings, enough[:, instant], strict=True) if down]
    piers = [name for name, role in roles.items() if role == "pier" and counts[name][instant]]
    group = [name for name in roles if name in (*fallen, *piers)]
    return _mechanism(flags, instant, KINDS[min(len(piers), 2)], group)


def counts_as_mechanism(joints: xr.Dataset) -> xr.DataArray:
    """Return whether, at each instant, as many joints have failed as make a mechanism by count.

    Args:
        joints: over time and joint, with the flags of `flagged`.
    """
    return failed(judged(joints)).sum("joint") >= Criteria.of(joints).failures


def _over_time(joints: xr.Dataset) -> xr.DataArray:
    """Whether each joint has failed, over time, of one instant or of none where there is none."""
    flags = failed(joints)
    if "time" not in flags.coords:
        flags = flags.assign_coords(time=np.nan)
    if "time" not in flags.dims:
        flags = flags.expand_dims("time")
    return flags if flags.dims == ("time", "joint") else flags.transpose("time", "joint")


def _counts(flags: xr.DataArray, parts: Iterable[str]) -> dict[str, NDArray[np.int64]]:
    """Failed joints of each part, by its name, over time (steps,)."""
    part, up = flags["part"].values.astype(str), flags.values
    return {name: up[:, part == name].sum(axis=1) for name in parts}


def _mechanism(flags: xr.DataArray, instant: int, kind: str, group: Sequence[str]) -> Mechanism:
    """The mechanism of the joints of some parts that have failed at an instant."""
    own = flags.isel(time=instant)
    own = own[own.values & np.isin(own["part"].values.astype(str), group)]
    time = float(own["time"])
    return Mechanism(
        kind,
        " + ".join(group),
        tuple(own["joint"].values.tolist()),
        None if np.isnan(time) else time,
        names=tuple(own["name"].values.astype(str).tolist()),
    )


def counted_mechanisms(
    joints: xr.Dataset, criteria: Criteria | None = None
) -> dict[str, Mechanism | None]:
    """Find the first mechanism by each of the definitions in use that count joints.

    "Any four joints" are of rings and piers, anywhere; "four in a ring" of one ring, whatever else
    fails; "ring and pier" four of one ring and one pier together, at least one of each. Four are
    as many as the criteria say.

    Args:
        joints: over joint, or over time and joint.
        criteria: by default those by which the joints were judged already.

    Returns:
        The first mechanism by each definition, or None, by the definition's name.
    """
    joints = flagged(joints, criteria)
    rings = joints["role"].values.astype(str) == "ring"
    return {
        "any four joints": counted_mechanism(joints),
        "four in a ring": counted_mechanism(joints.isel(joint=rings), kinds=("local",)),
        "ring and pier": counted_mechanism(joints, kinds=("semi-global",)),
    }


def definitions_met(
    count: Mapping[str, int], roles: Mapping[str, str], failures: int
) -> frozenset[str]:
    """Return the definitions of `counted_mechanisms` that failed joints meet at an instant.

    Args:
        count: failed joints of each judged part, by its name.
        roles: of the parts.
        failures: how many make a mechanism.
    """
    rings = {name: number for name, number in count.items() if roles[name] == "ring"}
    looked = {
        "any four joints": (count, KINDS),
        "four in a ring": (rings, ("local",)),
        "ring and pier": (count, ("semi-global",)),
    }
    return frozenset(
        name
        for name, (own, kinds) in looked.items()
        if _widest_group(own, roles, failures, kinds) is not None
    )


def _widest_group(
    count: Mapping[str, int], roles: Mapping[str, str], failures: int, kinds: Sequence[str]
) -> tuple[str, ...] | None:
    """Parts whose failures together are enough, of the widest class asked for, or None."""

    def kind(group: Sequence[str]) -> str:
        return mechanism_kind([roles[name] for name in group])

    hit = tuple(name for name in count if count[name])
    groups = [*combinations(hit, 1), *combinations(hit, 2), hit]
    enough = [
        group
        for group in groups
        if sum(count[name] for name in group) >= failures and kind(group) in kinds
    ]
    return max(
        enough,
        key=lambda group: (
            KINDS.index(kind(group)),
            sum(count[name] for name in group),
        ),
        default=None,
    )
