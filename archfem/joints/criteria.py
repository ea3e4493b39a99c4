"""When a joint has failed: hinging, sliding, opening; and by which criteria."""

from collections.abc import Hashable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from archfem.arguments import instance, real, whole
from archfem.errors import InvalidInput
from archfem.joints.duration import step_lengths
from archfem.masonry.roles import judged_parts

HINGE = 0.46
"""|e| from which a joint counts as hinged, 8 % short of its edge: Demirel and Aldemir (2021)."""

FAILURES = 4
"""Hinging or sliding joints in one ring that make it a mechanism: Heyman (1966)."""

DURATION = 1e-3
"""Time for which a mechanism must hold to count as one [s]. A stone that lost all support would
fall by 5 µm in it, less than joints give elastically; and steps that choose their length go down to
a tenth of it, and would else decide. Among steps as long as this, or longer, each counts."""

USED_UP = 1e-6
"""Friction left, relative to its limit, below which it is used up: round-off decides nothing there.
Well above that of programmes and equilibria (1e-9), well below what friction is known to."""

AREA_OFF = 0.01
"""Relative: how much of cohesion is left out where a joint counts as sliding. The closed area that
follows from the means of N and e over a step is off by less; cohesion is known less well."""

BONDED = "tension"
"""Coordinate of a dataset with the tensile strengths of its joints; left out where none has any."""

PREFIX = "criteria_"
"""Of the attributes of a dataset that tell by which criteria its joints were judged."""


@dataclass(frozen=True, kw_only=True)
class Criteria:
    """What makes a joint fail, and how many failed joints make a mechanism.

    Criteria judge what was computed and change no force: a joint of a model slides, or does not,
    by its own law. A run carries its criteria, and all that is said of it obeys them.

    Attributes:
        hinge: |e| from which a joint counts as hinged, up to 0.5, its edge [-].
        failures: joints of rings and piers that, failed at once, count as a mechanism.
        friction: |V| / N from which every joint counts as sliding [-]; None takes friction and
            cohesion of each joint's own contact, |V| >= μ N + c A, with A the closed area.
        duration: for which a mechanism must hold without a break, whichever joints it is made of,
            to count as one over time [s]; shorter ones are named where they were met.
    """

    hinge: float = HINGE
    failures: int = FAILURES
    friction: float | None = None
    duration: float = DURATION

    def __post_init__(self) -> None:
        """Refuse limits that no joint, or every joint, would pass."""
        if not 0.0 < real(self.hinge, "criteria hinge [-]") <= 0.5:
            raise InvalidInput(
                f"criteria hinge = {self.hinge!r}: |e| of a hinge is above 0 and at most 0.5, the "
                f"edge of the joint; {HINGE} is usual"
            )
        whole(self.failures, "criteria failures")
        if self.friction is not None:
            real(self.friction, "criteria friction [-]", least=0.0)
        real(self.duration, "criteria duration [s]", least=0.0)

    @classmethod
    def of(cls, joints: xr.Dataset) -> "Criteria":
        """Return the criteria by which joints were judged; the usual ones where they do not tell.

        Args:
            joints: as made by `joint_dataset`, which tell them as attributes.
        """
        kinds = {"hinge": float, "failures": int, "friction": float, "duration": float}
        told = {key: joints.attrs.get(PREFIX + key) for key in kinds}
        return cls(**{key: kinds[key](value) for key, value in told.items() if value is not None})

    @property
    def attributes(self) -> dict[str, float | int]:
        """The criteria as attributes of a dataset; without friction where it is the joints' own."""
        return {PREFIX + key: value for key, value in asdict(self).items() if value is not None}

    def coefficients(self, own: Any) -> Any:
        """Return the coefficients of friction by which joints are judged [-].

        Args:
            own: those of the joints' contacts, of any shape [-].
        """
        return own if self.friction is None else np.full_like(own, self.friction)

    def cohesions(self, own: Any) -> Any:
        """Return the shear that cohesion holds in joints that are closed, as they are judged [N].

        Args:
            own: that of the joints' contacts, of any shape [N].
        """
        return own if self.friction is None else np.zeros_like(own)


def chosen(criteria: Criteria | None, **single: Any) -> Criteria | None:
    """Return criteria that were given as a whole, or by single values beside the usual others.

    Args:
        criteria: or None.
        single: fields of `Criteria`; None where it was not given.

    Raises:
        InvalidInput: both were given.
    """
    if criteria is not None:
        instance(criteria, Criteria, "criteria", "give Criteria(hinge=…, failures=…)")
    given = {key: value for key, value in single.items() if value is not None}
    if given and criteria is not None:
        raise InvalidInput(f"give {given} in criteria=Criteria(…), or without criteria; not both")
    return Criteria(**given) if given else criteria


def ratio_at_sliding(
    normal: NDArray[np.float64],
    eccentricity: NDArray[np.float64],
    coefficients: NDArray[np.float64],
    cohesions: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return |V| / N at which joints slide, μ + c A / N; undefined (NaN) where they are open.

    A joint is closed over 3 (1/2 - |e|) of its depth, at most all of it, as plane faces are that
    press on one another without tension. With exact joints between such faces that is so; where
    faces bend, or points stand for parts of a joint, it is an estimate once the joint opens, off by
    the area of a point.

    Args:
        normal: N (…, n_joints) [N].
        eccentricity: M / (N h) (…, n_joints) [-].
        coefficients: of friction (n_joints,) [-].
        cohesions: shear that cohesion holds in joints that are closed (n_joints,) [N].
    """
    closed = np.clip(3.0 * (0.5 - np.abs(eccentricity)), 0.0, 1.0)
    pressed = np.where(normal > 0.0, normal, np.nan)
    ratio: NDArray[np.float64] = coefficients + (1.0 - AREA_OFF) * closed * cohesions / pressed
    return ratio


def failing(
    eccentricity: NDArray[np.float64],
    friction: NDArray[np.float64],
    limits: NDArray[np.float64],
    hinge: float,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which joints hinge, and which slide; an open one, whose e is undefined, does neither.

    Args:
        eccentricity: M / (N h) (…, n_joints) [-].
        friction: mobilised, |V| / N (…, n_joints) [-].
        limits: of that, as by `ratio_at_sliding` (…, n_joints) [-].
        hinge: |e| from which a joint hinges [-].
    """
    return np.abs(eccentricity) >= hinge, friction >= (1.0 - USED_UP) * limits


def flags(
    dims: tuple[Hashable, ...],
    normal: NDArray[np.float64],
    ratios: tuple[NDArray[np.float64], NDArray[np.float64]],
    limits: NDArray[np.float64],
    hinge: float,
) -> dict[str, tuple[Any, ...]]:
    """Return flags of failure, as variables of a dataset.

    `hinge` is the face on which a joint hinges (1 extrados, -1 intrados, where it stays closed; 0
    none), `slide` says whether its mobilised friction has reached its limit, and `open` whether it
    has come apart over its whole depth. Bonds do not matter to the first two; a joint that is
    pulled and holds is not open.

    Args:
        dims: names of the dimensions, the last that of the joints.
        normal: N, its size alone where a joint has a bond (…, n_joints) [N].
        ratios: eccentricity and mobilised friction (…, n_joints) [-].
        limits: of mobilised friction, as by `ratio_at_sliding` (…, n_joints) [-].
        hinge: |e| from which a joint hinges [-].
    """
    hinges, slides = failing(*ratios, limits, hinge)
    side = np.where(hinges, np.sign(ratios[0]), 0.0).astype(np.int8)
    return {
        "hinge": (dims, side, {"long_name": "face on which it hinges, 1 extrados, -1 intrados"}),
        "slide": (dims, slides, {"long_name": "whether its friction is used up"}),
        "open": (dims, normal <= 0.0, {"long_name": "whether it has come apart"}),
    }


def borne(normal: NDArray[np.float64], tension: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return normal forces, of joints with a bond their size alone: pulled, they are not open [N].

    Args:
        normal: N (…, n_joints) [N].
        tension: tensile strengths (n_joints,) [Pa].
    """
    return np.where(tension > 0.0, np.abs(normal), normal)


def flagged(joints: xr.Dataset, criteria: Criteria | None = None) -> xr.Dataset:
    """Return joints with the flags of some criteria, which they then carry as attributes.

    Args:
        joints: N, eccentricity and friction, as made by `joint_dataset`.
        criteria: by default those by which the joints were judged already, or the usual ones.
    """
    if criteria is None and "hinge" in joints:
        return joints
    criteria = chosen(criteria) or Criteria.of(joints)
    normal, e, friction = (
        joints[name].transpose(..., "joint", missing_dims="ignore")
        for name in ("N", "eccentricity", "friction")
    )
    limits, ratios = sliding_limits(joints, criteria), (e.values, friction.values)
    carried = normal.values
    if BONDED in joints.coords:
        carried = borne(carried, joints[BONDED].values)
    result = joints.assign(flags(e.dims, carried, ratios, limits, criteria.hinge))
    counts = np.isin(joints["part"].values.astype(str), judged_parts(roles_of(joints)))
    result.coords["judged"] = (joints["part"].dims, counts)
    others = {key: value for key, value in joints.attrs.items() if not key.startswith(PREFIX)}
    result.attrs = others | criteria.attributes
    return result


def sliding_limits(joints: xr.Dataset, criteria: Criteria) -> NDArray[np.float64]:
    """Return |V| / N at which joints slide, as by `ratio_at_sliding` (…, n_joints) [-].

    Args:
        joints: N and eccentricity, as made by `joint_dataset`; files of earlier versions know no
            cohesion.
        criteria: by which they are judged.
    """
    normal, e = (
        joints[name].transpose(..., "joint", missing_dims="ignore").values
        for name in ("N", "eccentricity")
    )
    own = joints["friction_limit"].values
    held = joints["cohesion_limit"].values if "cohesion_limit" in joints.coords else 0.0 * own
    return ratio_at_sliding(normal, e, criteria.coefficients(own), criteria.cohesions(held))


def failed(joints: xr.Dataset) -> xr.DataArray:
    """Return whether each joint hinges, slides or has come apart.

    Args:
        joints: with the flags of `flagged`, of one instant or of many.
    """
    hinge = joints["hinge"]
    slide, apart = (
        joints.variables[name].transpose(*hinge.dims).values for name in ("slide", "open")
    )
    return xr.DataArray(
        (hinge.values != 0) | slide | apart, hinge.coords, hinge.dims, name="failed"
    )


def first_time(flags: xr.DataArray) -> xr.DataArray:
    """Return the first time at which each joint is flagged [s]; NaN where it never is.

    Args:
        flags: true or false over time and joint.
    """
    found, ever = flags["time"].values[flags.argmax("time").values], flags.any("time")
    return ever.copy(data=np.where(ever, found, np.nan)).rename("first_time")


def longest_duration(flags: xr.DataArray) -> xr.DataArray:
    """Return the longest unbroken time for which each joint is flagged [s].

    A flag raised at a single instant lasts for one time step.

    Args:
        flags: true or false over time and joint.
    """
    step, up = step_lengths(flags["time"].values), flags.transpose("time", ...).values
    elapsed = np.cumsum(np.where(up, step[:, None], 0.0), axis=0)
    before = np.maximum.accumulate(np.where(up, 0.0, elapsed), axis=0)
    return xr.DataArray((elapsed - before).max(axis=0), {"joint": flags["joint"]}, ("joint",))


def envelope(joints: xr.Dataset) -> xr.Dataset:
    """Return the `lowest` and `highest` eccentricity and largest `friction` of each joint [-].

    Args:
        joints: over time and joint, as made by `joint_dataset`.
    """
    return xr.Dataset(
        {
            "lowest": joints["eccentricity"].min("time"),
            "highest": joints["eccentricity"].max("time"),
            "friction": joints["friction"].max("time"),
        }
    )


def roles_of(joints: xr.Dataset) -> dict[str, str]:
    """Return the role of each part, by its name, in the order of the joints.

    Args:
        joints: as made by `joint_dataset`, with `part` and `role`.
    """
    parts, roles = (
        np.atleast_1d(joints[key].values).astype(str).tolist() for key in ("part", "role")
    )
    return dict(zip(parts, roles, strict=True))


def judged(joints: xr.Dataset) -> xr.Dataset:
    """Return those joints that are judged; they keep their numbers.

    Args:
        joints: with the coordinate `judged`, as made by `joint_dataset` or `flagged`.
    """
    return joints.isel(joint=joints["judged"].values)
