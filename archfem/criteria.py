"""When a joint has failed: hinging, sliding, opening."""

import numpy as np
import xarray as xr

from archfem.roles import judged_parts

HINGE = 0.46
"""|e| from which a joint counts as hinged, 8 % short of its edge: Demirel and Aldemir (2021)."""

USED_UP = 1e-6
"""Friction left, relative to its limit, below which it is used up: round-off decides nothing there.
Well above that of programmes and equilibria (1e-9), well below what friction is known to."""


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


def roles_of(joints: xr.Dataset) -> dict[str, str]:
    """Role of each part, by its name, in the order of the joints.

    Args:
        joints: as made by `joint_dataset`, with `part` and `role`.
    """
    parts, roles = (joints[key].values.astype(str).tolist() for key in ("part", "role"))
    return dict(zip(parts, roles, strict=True))


def judged(joints: xr.Dataset) -> xr.Dataset:
    """Those joints that are judged, as `judged_parts` says; they keep their numbers."""
    part = joints["part"].values.astype(str)
    return joints.isel(joint=np.isin(part, judged_parts(roles_of(joints))))
