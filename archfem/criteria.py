"""When a joint has failed: hinging, sliding, opening; and when failures make a mechanism."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

HINGE = 0.46
"""|e| from which a joint counts as hinged, 8 % short of its edge: Demirel and Aldemir (2021)."""

FAILURES = 4
"""Hinging or sliding joints in one ring that make it a mechanism: Heyman (1966)."""


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
    """Whether the mobilised friction |V| / N of each joint exceeds its coefficient μ."""
    return (joints["friction"] > joints["friction_limit"]).rename("sliding")


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
    """Failures that may turn a structure into a mechanism.

    Attributes:
        kind: "local" where they are in one ring.
        part: the ring.
        joints: numbers of the failed joints.
        time: when they were first found together [s]; None for a static state.
    """

    kind: str
    part: str
    joints: tuple[int, ...]
    time: float | None = None


def counted_mechanism(
    joints: xr.Dataset, limit: float = HINGE, failures: int = FAILURES
) -> Mechanism | None:
    """Find the first instant at which enough joints of one part have failed at once.

    The criterion of Demirel and Aldemir (2021): at least four hinging or sliding joints in one
    ring. A joint that has come apart counts too.

    Args:
        joints: over joint, or over time and joint.
        limit: of |e| for a hinge [-].
        failures: how many make a mechanism.

    Returns:
        The mechanism, or None.
    """
    flags = failed(joints, limit)
    if "time" not in flags.dims:
        flags = flags.expand_dims(time=[np.nan])
    found = [
        Mechanism("local", str(part), *first)
        for part, own in flags.groupby("part")
        if (first := _first_count(own, failures)) is not None
    ]
    return min(found, key=lambda mechanism: mechanism.time or 0.0, default=None)


def _first_count(flags: xr.DataArray, failures: int) -> tuple[tuple[int, ...], float | None] | None:
    """Joints and time of the first instant with so many flags, or None."""
    enough = (flags.sum("joint") >= failures).values
    if not enough.any():
        return None
    instant = flags.isel(time=int(enough.argmax()))
    time = float(instant["time"])
    joints = tuple(int(j) for j in instant["joint"].values[instant.values])
    return joints, None if np.isnan(time) else time
