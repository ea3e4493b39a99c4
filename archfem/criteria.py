"""When a joint has failed: hinging, sliding, opening; and when failures make a mechanism."""

import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import xarray as xr

HINGE = 0.46
"""|e| from which a joint counts as hinged, 8 % short of its edge: Demirel and Aldemir (2021)."""

USED_UP = 1e-6
"""Friction left, relative to its limit, below which it is used up: round-off decides nothing there.
Well above that of programmes and equilibria (1e-9), well below what friction is known to."""

FAILURES = 4
"""Hinging or sliding joints in one ring that make it a mechanism: Heyman (1966)."""

KINDS = ("local", "semi-global", "global")
"""Classes of mechanisms, smallest first."""

RING_WORDS, PIER_WORDS = frozenset({"arch", "ring"}), frozenset({"pier", "column"})
"""Words that make a part a ring or a pier; numbers after them do not matter ("arch 2")."""


def hinged(joints: xr.Dataset, limit: float = HINGE) -> xr.DataArray:
    """Side on which each joint hinges: 1 extrados, -1 intrados (where it stays closed), 0 none.

    Args:
        joints: with `eccentricity`.
        limit: of |e| [-].
    """
    e = joints["eccentricity"]
    side = xr.where(abs(e) >= limit, np.sign(e), 0.0).astype(np.int8)
    return side.rename("hinged")


def sliding(joints: xr.Dataset) -> xr.DataArray:
    """Whether the mobilised friction |V| / N of each joint has reached its coefficient μ."""
    return (joints["friction"] >= (1.0 - USED_UP) * joints["friction_limit"]).rename("sliding")


def opened(joints: xr.Dataset) -> xr.DataArray:
    """Whether each joint has come apart over its whole depth: no compression left."""
    return (joints["N"] <= 0.0).rename("opened")


def failed(joints: xr.Dataset, limit: float = HINGE) -> xr.DataArray:
    """Whether each joint hinges, slides or has come apart."""
    return ((hinged(joints, limit) != 0) | sliding(joints) | opened(joints)).rename("failed")


def first_time(flags: xr.DataArray) -> xr.DataArray:
    """First time at which each joint is flagged [s]; NaN where it never is.

    Args:
        flags: true or false over time and joint.
    """
    found = flags["time"].values[flags.argmax("time").values]
    return xr.where(flags.any("time"), found, np.nan).rename("first_time")


def longest_duration(flags: xr.DataArray) -> xr.DataArray:
    """Longest unbroken time for which each joint is flagged [s].

    A flag raised at a single instant lasts for one time step.
    """
    time = flags["time"].values
    step = np.diff(time, append=2.0 * time[-1] - time[-2]) if len(time) > 1 else np.zeros(1)
    up = flags.transpose("time", ...).values
    elapsed = np.cumsum(np.where(up, step[:, None], 0.0), axis=0)
    before = np.maximum.accumulate(np.where(up, 0.0, elapsed), axis=0)
    return xr.DataArray((elapsed - before).max(axis=0), {"joint": flags["joint"]}, ("joint",))


def envelope(joints: xr.Dataset) -> xr.Dataset:
    """Least and largest eccentricity, and largest friction, of each joint over a run."""
    return xr.Dataset(
        {
            "lowest": joints["eccentricity"].min("time"),
            "highest": joints["eccentricity"].max("time"),
            "friction": joints["friction"].max("time"),
        }
    )


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


def part_role(part: str) -> str:
    """What a part is to a mechanism, by the words of its name: "ring", "pier" or "other".

    A ring is called an arch or a ring ("main arch"), a pier a pier or a column ("north pier").
    Without a name a part counts as a ring. Anything else, such as backfill, side walls or
    abutments, follows what carries it and is not judged.
    """
    words = {word.rstrip("0123456789") for word in re.split(r"[\s_-]+", part.lower())}
    if words & RING_WORDS or not part:
        return "ring"
    return "pier" if words & PIER_WORDS else "other"


def judged_parts(parts: Iterable[str]) -> tuple[str, ...]:
    """Those parts whose failures and motions are judged: rings and piers, in the order given.

    Where there is neither, as in a wall by itself, every part is judged.
    """
    names = tuple(dict.fromkeys(parts))
    return tuple(name for name in names if part_role(name) != "other") or names


def judged(joints: xr.Dataset) -> xr.Dataset:
    """Those joints that are judged, as `judged_parts` says; they keep their numbers."""
    part = joints["part"].values.astype(str)
    return joints.isel(joint=np.isin(part, judged_parts(part)))


def mechanism_kind(parts: Collection[str]) -> str:
    """Class of a mechanism in these judged parts: "none", "local", "semi-global" or "global"."""
    roles = sorted(role for part in set(parts) if (role := part_role(part)) != "other")
    if len(roles) < 2:
        return "local" if parts else "none"
    return "semi-global" if roles == ["pier", "ring"] else "global"


def counted_mechanism(
    joints: xr.Dataset,
    limit: float = HINGE,
    failures: int = FAILURES,
    kinds: Sequence[str] = KINDS,
) -> Mechanism | None:
    """Find the first instant at which enough joints have failed at once.

    The criterion of Demirel and Aldemir (2021): at least four hinging or sliding joints in one
    ring alone (local), with joints of one pier among them (semi-global), or of more rings and
    piers (global). A joint that has come apart counts too. The class is that of all joints failed
    at the instant; ask for `kinds=("local",)` to find four in one ring whatever else fails.

    Args:
        joints: over joint, or over time and joint; those of `judged` are counted.
        limit: of |e| for a hinge [-].
        failures: how many make a mechanism.
        kinds: classes to look for.

    Returns:
        The mechanism, or None.
    """
    flags = failed(joints, limit)
    if "time" not in flags.coords:
        flags = flags.assign_coords(time=np.nan)
    if "time" not in flags.dims:
        flags = flags.expand_dims("time")
    flags = flags.transpose("time", "joint")
    part, up = flags["part"].values.astype(str), flags.values
    names = judged_parts(part)
    counts = np.array([up[:, part == name].sum(axis=1) for name in names]).reshape(-1, len(up)).T
    for instant in np.flatnonzero(counts.sum(axis=1) >= failures):
        count = dict(zip(names, counts[instant], strict=True))
        group = _widest_group(count, failures, kinds)
        if group:
            time = float(flags["time"][instant])
            numbers = flags["joint"].values[up[instant] & np.isin(part, group)]
            return Mechanism(
                mechanism_kind(group),
                " + ".join(group),
                tuple(int(number) for number in numbers),
                None if np.isnan(time) else time,
            )
    return None


def counted_mechanisms(joints: xr.Dataset, limit: float = HINGE) -> dict[str, Mechanism | None]:
    """Find the first mechanism by each of the definitions in use that count joints.

    "Any four joints" are of rings and piers, anywhere; "four in a ring" of one ring, whatever else
    fails; "ring and pier" four of one ring and one pier together, at least one of each.

    Args:
        joints: over joint, or over time and joint.
        limit: of |e| for a hinge [-].
    """
    part = joints["part"].values.astype(str)
    rings = np.array([part_role(name) == "ring" for name in part])
    return {
        "any four joints": counted_mechanism(joints, limit),
        "four in a ring": counted_mechanism(joints.isel(joint=rings), limit, kinds=("local",)),
        "ring and pier": counted_mechanism(joints, limit, kinds=("semi-global",)),
    }


def _widest_group(
    count: dict[str, int], failures: int, kinds: Sequence[str]
) -> tuple[str, ...] | None:
    """Parts whose failures together are enough, of the widest class asked for, or None."""
    hit = tuple(name for name in count if count[name])
    groups = [*combinations(hit, 1), *combinations(hit, 2), hit]
    enough = [
        group
        for group in groups
        if sum(count[name] for name in group) >= failures and mechanism_kind(group) in kinds
    ]
    return max(
        enough,
        key=lambda group: (
            KINDS.index(mechanism_kind(group)),
            sum(count[name] for name in group),
        ),
        default=None,
    )
