"""Mechanisms by counting failed joints, and the classes of mechanisms."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import xarray as xr

from archfem.joints.criteria import Criteria, failed, flagged, roles_of
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
    """

    kind: str
    part: str
    joints: tuple[int, ...]
    time: float | None = None
    blocks: tuple[int, ...] = ()


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
    """Find the first instant at which enough joints have failed at once.

    The criterion of Demirel and Aldemir (2021): at least four hinging or sliding joints in one
    ring alone (local), with joints of one pier among them (semi-global), or of more rings and
    piers (global). A joint that has come apart counts too. The class is that of all joints failed
    at the instant; ask for `kinds=("local",)` to find four in one ring whatever else fails.

    Args:
        joints: over joint, or over time and joint; those of `judged` are counted.
        criteria: what makes a joint fail, and how many make a mechanism; by default those by which
            the joints were judged already.
        kinds: classes to look for.

    Returns:
        The mechanism, or None.
    """
    joints = flagged(joints, criteria)
    flags, failures = failed(joints), Criteria.of(joints).failures
    if "time" not in flags.coords:
        flags = flags.assign_coords(time=np.nan)
    if "time" not in flags.dims:
        flags = flags.expand_dims("time")
    flags = flags.transpose("time", "joint")
    part, up = flags["part"].values.astype(str), flags.values
    roles = roles_of(joints)
    names = judged_parts(roles)
    counts = np.array([up[:, part == name].sum(axis=1) for name in names]).reshape(-1, len(up)).T
    for instant in np.flatnonzero(counts.sum(axis=1) >= failures):
        count = dict(zip(names, counts[instant], strict=True))
        group = _widest_group(count, roles, failures, kinds)
        if group:
            time = float(flags["time"][instant])
            numbers = flags["joint"].values[up[instant] & np.isin(part, group)]
            return Mechanism(
                mechanism_kind([roles[name] for name in group]),
                " + ".join(group),
                tuple(int(number) for number in numbers),
                None if np.isnan(time) else time,
            )
    return None


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


def _widest_group(
    count: dict[str, int], roles: Mapping[str, str], failures: int, kinds: Sequence[str]
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
