"""Failure criteria of joints: hinging, sliding, opening, and durations of failure.

Forces of a record are means over the time step that ends with it, so a record has the duration of
that step. The first record, of the start, is given the duration of the second.
"""

from collections.abc import Callable, Hashable, Iterable
from dataclasses import asdict, dataclass
from typing import Any, TypeVar

import numpy as np
import xarray as xr

from archfem._typing import Array, Flags, Seconds
from archfem._validation import (
    check_between,
    check_integer,
    check_number,
    check_type,
    validate_arguments,
)
from archfem.masonry.parts import select_assessed_parts
from archfem.masonry.structure import describe_assessment

Found = TypeVar("Found")

# Coordinate of a dataset with the tensile strengths of its joints; absent without bonds
TENSION_COORDINATE = "tension"

# Coordinate of a dataset with the head joints of walls; absent without any
HEAD_COORDINATE = "head"

# Coordinate of a structure with curved faces: the name of the face of which a joint is a chord
FACE_COORDINATE = "face"

# Prefix of dataset attributes with the criteria
CRITERIA_PREFIX = "criteria_"


def step_lengths(time: Array) -> Array:
    """Return the duration of each record (steps,) [s]; 0 of a single one."""
    steps = np.diff(time)
    return np.concatenate([steps[:1] if len(steps) else np.zeros(1), steps])


class DurationCounter:
    """Sums the time for which a condition holds without a break, step by step."""

    def __init__(self, required: float) -> None:
        # a sum of steps may fall short of the required duration by round-off
        self._required, self._elapsed = (1.0 - 1e-6) * required, 0.0

    def add_step(self, holds: bool, step: float) -> bool:
        """Add a step, and return whether the condition has held for the required duration."""
        self._elapsed = self._elapsed + step if holds else 0.0
        return holds and self._elapsed >= self._required


def find_lasting(
    instants: Iterable[int], time: Array, duration: float, evaluate: Callable[[int], Found | None]
) -> Found | None:
    """Return the first result, not None, of a sequence of records that lasts for a duration."""
    lengths, counter = step_lengths(time), DurationCounter(duration if len(time) > 1 else 0.0)
    previous, first = -1, None
    for instant in map(int, instants):
        result = evaluate(instant)
        if result is None or instant != previous + 1:
            counter.add_step(False, 0.0)
            first = None
        previous = instant
        if result is None:
            continue
        first = result if first is None else first
        if counter.add_step(True, float(lengths[instant])):
            return first
    return None


def lasting_flags(flagged: Flags, time: Array, duration: float) -> Flags:
    """Return whether each joint has by then been flagged for a duration [s] (steps, joints)."""
    if len(flagged) == 1:
        return flagged
    # a sum of steps may fall short of the duration by round-off
    return flagged & (unbroken_durations(flagged, time) >= (1.0 - 1e-6) * duration)


def find_first_lasting(holds: Flags, time: Array, duration: float) -> int | None:
    """Return the record from which on a condition first holds for a duration, without a break."""
    lasts = lasting_flags(holds[:, None], time, duration)[:, 0]
    if not lasts.any():
        return None
    end = int(lasts.argmax())
    breaks = np.flatnonzero(~holds[:end])
    return int(breaks[-1]) + 1 if len(breaks) else 0


@dataclass(frozen=True, kw_only=True)
class Criteria:
    """Define when a joint has failed, and how many failed joints make a mechanism.

    Criteria assess computed forces and change none: joints of a model slide by their own law. A
    run carries its criteria, and all statements on it follow them.

    Attributes:
        hinge: |e| from which a joint counts as hinged, up to 0.5, its edge [-]; the default is 8 %
            short of it, as in Demirel and Aldemir (2021).
        failures: number of joints of rings and piers that, failed at once, count as a mechanism;
            by default four, as Heyman (1966).
        friction: |V| / N from which every joint counts as sliding [-]; None takes friction and
            cohesion of each joint's own contact, |V| >= μ N + c A, with A the closed area.
        duration: time for which a mechanism must persist without a break, whichever joints it
            consists of [s]; shorter ones are reported where they occur.

    Raises:
        InvalidInput: no joint, or every joint, would fail.
    """

    hinge: float = 0.46
    failures: int = 4
    friction: float | None = None
    # A stone without support falls by 5 µm in 1 ms, less than the elastic deformation of joints.
    # Adaptive steps are down to a tenth as long, and would otherwise matter; among steps of this
    # length or more, each one counts.
    duration: Seconds = 1e-3

    def __post_init__(self) -> None:
        """Refuse limits that no joint, or every joint, would pass."""
        remedy = "|e| is 0.5 at the edge of a joint; 0.46 is usual for a hinge"
        check_between(self.hinge, "criteria hinge [-]", 0.0, 0.5, ends="(]", remedy=remedy)
        check_integer(self.failures, "criteria failures")
        if self.friction is not None:
            check_number(self.friction, "criteria friction [-]", minimum=0.0)
        check_number(self.duration, "criteria duration [s]", minimum=0.0)

    @classmethod
    def of(cls, joints: xr.Dataset) -> "Criteria":
        """Return the criteria by which joints were assessed; default values where not stored.

        Args:
            joints: as made by `joint_dataset`, with the criteria as attributes.
        """
        kinds = {"hinge": float, "failures": int, "friction": float, "duration": float}
        stored = {key: joints.attrs.get(CRITERIA_PREFIX + key) for key in kinds}
        return cls(**{key: kinds[key](value) for key, value in stored.items() if value is not None})

    @property
    def attributes(self) -> dict[str, float | int]:
        """Criteria as attributes of a dataset, without friction if it is that of the contacts."""
        return {CRITERIA_PREFIX + key: v for key, v in asdict(self).items() if v is not None}

    def coefficients(self, own: Any) -> Any:
        """Return the coefficients of friction by which joints are assessed [-].

        Args:
            own: those of the joints' contacts, of any shape [-].
        """
        return own if self.friction is None else np.full_like(own, self.friction)

    def cohesions(self, own: Any) -> Any:
        """Return the shear resistance by cohesion of closed joints, as they are assessed [N].

        Args:
            own: that of the joints' contacts, of any shape [N].
        """
        return own if self.friction is None else np.zeros_like(own)


def check_criteria(criteria: object) -> None:
    """Refuse values that are neither criteria nor None."""
    if criteria is not None:
        check_type(criteria, Criteria, "criteria", "give Criteria(hinge=…, failures=…)")


def sliding_ratio(
    normal: Array, eccentricity: Array, coefficients: Array, cohesions: Array
) -> Array:
    """Return |V| / N at which joints slide, μ + c A / N; undefined (NaN) where they are open."""
    if not np.any(cohesions):
        return np.where(normal > 0.0, coefficients, np.nan)
    # Plane faces without tension are closed over 3 (1/2 - |e|) of the depth, at most all of it.
    # That is exact for exact joints between such faces; where faces bend, or points represent parts
    # of a joint, it is an estimate once the joint opens, within the area of a point.
    closed = np.clip(3.0 * (0.5 - np.abs(eccentricity)), 0.0, 1.0)
    pressed = np.where(normal > 0.0, normal, np.nan)
    # 1 % of the cohesion is left out: the closed area from the means of N and e over a step has a
    # smaller error, and cohesion is not that accurate
    return coefficients + 0.99 * closed * cohesions / pressed


def judge_joints(
    eccentricity: Array, friction: Array, limits: Array, hinge: float
) -> tuple[Flags, Flags]:
    """Return which joints hinge, and which slide; open ones, with undefined e, do neither."""
    # the margin is well above the round-off of programmes and equilibria (1e-9)
    return np.abs(eccentricity) >= hinge, friction >= (1.0 - 1e-6) * limits


def failure_flags(
    dims: tuple[Hashable, ...],
    normal: Array,
    ratios: tuple[Array, Array],
    limits: Array,
    hinge: float,
) -> dict[str, tuple[Any, ...]]:
    """Return flags of failure, as variables of a dataset.

    `hinge` is the face on which a joint hinges (1 extrados, -1 intrados, where it stays closed; 0
    none), `slide` whether its mobilised friction has reached its limit, and `open` whether it is
    open over its whole depth. Bonds do not affect the first two; a joint whose bond carries tension
    is not open.

    Args:
        dims: names of the dimensions, the last that of the joints.
        normal: N, its magnitude where a joint has a bond (…, n_joints) [N].
        ratios: eccentricity and mobilised friction (…, n_joints) [-].
        limits: mobilised friction at which joints slide (…, n_joints) [-].
        hinge: |e| from which a joint hinges [-].

    Returns:
        Dimensions, values (…, n_joints) and attributes of each flag.
    """
    hinges, slides = judge_joints(*ratios, limits, hinge)
    side = np.where(hinges, np.sign(ratios[0]), 0.0).astype(np.int8)
    return {
        "hinge": (dims, side, {"long_name": "face on which it hinges, 1 extrados, -1 intrados"}),
        "slide": (dims, slides, {"long_name": "whether its friction is used up"}),
        "open": (dims, normal <= 0.0, {"long_name": "whether it has come apart"}),
    }


def tension_margin(normal: Array, tension: Array) -> Array:
    """Return normal forces, in absolute value in joints with a bond, which are never open [N]."""
    return np.where(tension > 0.0, np.abs(normal), normal)


def with_failure_flags(joints: xr.Dataset, criteria: Criteria | None = None) -> xr.Dataset:
    """Return joints with the failure flags and attributes of some criteria; None keeps those."""
    if criteria is None:
        return joints
    check_criteria(criteria)
    normal, e, friction = (
        joints[name].transpose(..., "joint", missing_dims="ignore")
        for name in ("N", "eccentricity", "friction")
    )
    limits, ratios = sliding_limits(joints, criteria), (e.values, friction.values)
    forces = normal.values
    if TENSION_COORDINATE in joints.coords:
        forces = tension_margin(forces, joints[TENSION_COORDINATE].values)
    result = joints.assign(failure_flags(e.dims, forces, ratios, limits, criteria.hinge))
    assessed = np.isin(joints["part"].values.astype(str), select_assessed_parts(part_roles(joints)))
    if HEAD_COORDINATE in joints.coords:
        assessed &= ~joints[HEAD_COORDINATE].values
    result.coords["judged"] = (joints["part"].dims, assessed)
    others = {k: value for k, value in joints.attrs.items() if not k.startswith(CRITERIA_PREFIX)}
    result.attrs = others | criteria.attributes
    return result


def sliding_limits(joints: xr.Dataset, criteria: Criteria) -> Array:
    """Return |V| / N at which joints slide, as by `sliding_ratio` (…, n_joints) [-]."""
    normal, e, cohesion = (  # which is over time too where faces slide far
        joints[name].transpose(..., "joint", missing_dims="ignore").values
        for name in ("N", "eccentricity", "cohesion_limit")
    )
    friction = joints["friction_limit"].values
    return sliding_ratio(normal, e, criteria.coefficients(friction), criteria.cohesions(cohesion))


def find_failed_joints(joints: xr.Dataset) -> xr.DataArray:
    """Return whether each joint hinges, slides or is open; never of head joints of a wall.

    A wall in bond stands on its bed joints: that a head joint is open, or that its small force
    leaves its middle, is no failure.
    """
    hinge = joints["hinge"]
    slides, is_open = (
        joints.variables[name].transpose(*hinge.dims).values for name in ("slide", "open")
    )
    failed = hinge.copy(data=(hinge.values != 0) | slides | is_open)
    if HEAD_COORDINATE in joints.coords:
        failed = failed & ~joints[HEAD_COORDINATE]
    return failed.rename("failed")


def first_time(flags: xr.DataArray) -> xr.DataArray:
    """Return the first time at which each joint is flagged [s]; NaN where it never is."""
    first, ever = flags["time"].values[flags.argmax("time").values], flags.any("time")
    return ever.copy(data=np.where(ever, first, np.nan)).rename("first_time")


def longest_duration(flags: xr.DataArray) -> xr.DataArray:
    """Return the longest unbroken time for which each joint is flagged [s]."""
    time, columns = flags["time"].values, flags.transpose("joint", "time").values
    # one joint at a time: the record may be long
    longest = [float(unbroken_durations(each[:, None], time).max()) for each in columns]
    return xr.DataArray(longest, {"joint": flags["joint"]}, ("joint",))


def unbroken_durations(flagged: Flags, time: Array) -> Array:
    """Return the time [s] for which each joint has by then been flagged (steps, joints)."""
    elapsed = np.cumsum(np.where(flagged, step_lengths(time)[:, None], 0.0), axis=0)
    # less the flagged time until the last record without the flag
    before = np.maximum.accumulate(np.where(flagged, 0.0, elapsed), axis=0)
    return np.asarray(elapsed - before)


def envelope(joints: xr.Dataset) -> xr.Dataset:
    """Return the `lowest` and `highest` eccentricity and largest `friction` of each joint [-]."""
    e, friction = joints["eccentricity"], joints["friction"].max("time")
    return xr.Dataset({"lowest": e.min("time"), "highest": e.max("time"), "friction": friction})


@validate_arguments
def part_roles(joints: xr.Dataset) -> dict[str, str]:
    """Return the role of each part, by its name, in the order of the joints.

    Args:
        joints: as made by `joint_dataset`, with `part` and `role`.
    """
    rows = (np.atleast_1d(joints[key].values).astype(str).tolist() for key in ("part", "role"))
    return dict(zip(*rows, strict=True))


def eccentricity_magnitude(joints: xr.Dataset) -> xr.DataArray:
    """Return |e| of joints [-], 0.5 where they are open."""
    return abs(joints["eccentricity"]).fillna(0.5)


@validate_arguments
def assessed_joints(joints: xr.Dataset) -> xr.Dataset:
    """Return the joints of rings and piers, or all where there are neither, without head joints.

    Args:
        joints: with the coordinate `judged`, as made by `joint_dataset`.
    """
    judged = joints["judged"].values
    # a selection is a copy, which is large of a long record
    return joints if judged.all() else joints.isel(joint=judged)


def describe_assessed_joints(joints: xr.Dataset) -> str:
    """Describe which joints are assessed, and which are not; empty where all are."""
    face = FACE_COORDINATE if FACE_COORDINATE in joints.coords else "name"
    names, parts, judged = (np.atleast_1d(joints[key].values) for key in (face, "part", "judged"))
    heads = np.atleast_1d(joints.coords.get(HEAD_COORDINATE, xr.zeros_like(joints["judged"])))
    words = names.astype(str).tolist(), parts.astype(str).tolist()
    return describe_assessment(*words, judged, heads)
