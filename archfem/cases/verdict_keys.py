"""Section [verdict]: ranges of the properties that `archfem verdict` varies."""

from collections.abc import Iterable, Mapping
from typing import Any

from archfem._validation import check_number
from archfem.cases.toml_file import check_table
from archfem.errors import InvalidInput
from archfem.masonry.joint_closing import FINISHES, find_finish, finish_range
from archfem.masonry.structure import Structure
from archfem.motion.motion import Motion

VERDICT_KEYS: dict[str, Any] = {"vary": dict}

# What is varied by default: values, of which numbers are the ends of a range
DEFAULT_RANGES: dict[str, tuple[Any, ...]] = {
    # exact integration, springs at the ends and the middle (as in 3DEC), rigid contact
    "joint_rule": ("exact", "three points", "rigid"),
    "k_n": (1.0 / 3.0, 3.0),
    "k_s": (1.0 / 3.0, 3.0),
    "friction": (-0.1, 0.1),
    "damping_ratio": (0.5, 2.0),
    "damping_kind": ("stiffness", "mass and stiffness"),
    "sign": ("as given", "reversed"),
    "dt": ("as given", "half"),
}

# And on request: finish of the faces, whose usual law of closing replaces that given, and motion
RANGES = {**DEFAULT_RANGES, "finish": ("as given", *FINISHES), "scale": (1.0,)}

# Values at which a run is as given
NEUTRAL = {"joint_rule": "exact", "finish": "as given", "k_n": 1.0, "k_s": 1.0, "friction": 0.0}
NEUTRAL |= {"damping_ratio": 1.0, "scale": 1.0, "sign": "as given", "dt": "as given"}


def default_ranges(*structures: Structure) -> dict[str, tuple[Any, ...]]:
    """Return what is varied by default, the stiffness of a finish over its own range."""
    own = list[list[tuple[float, ...]]]()
    for structure in structures:
        one = {(joint.contact, find_finish(structure, joint)): joint for joint in structure.joints}
        for (_, finish), joint in one.items():
            factors = [DEFAULT_RANGES["k_n"], DEFAULT_RANGES["k_s"]]
            if finish:
                law = finish_range(structure, joint, finish)
                factors = [tuple(x / k[1] for x in k) for k in (law.initial, law.shear)]
            own.append(factors)
    joined = [(min(map(min, each)), max(map(max, each))) for each in zip(*own, strict=True)]
    return {**DEFAULT_RANGES, "k_n": joined[0], "k_s": joined[1]}


def parse_verdict(table: Any) -> dict[str, Any]:
    """Return the arguments of `archfem.verdict_range` in the table of a case."""
    values = check_table(table, VERDICT_KEYS, "verdict")
    try:
        return {key: check_ranges(ranges) for key, ranges in values.items()}
    except InvalidInput as error:
        raise InvalidInput(f"verdict.vary: {error}") from error


def check_ranges(ranges: Mapping[str, Any]) -> dict[str, Any]:
    """Return the ranges, or refuse unknown names and values."""
    checked: dict[str, Any] = {}
    for name, values in ranges.items():
        if isinstance(values, Mapping):
            for value in [*values.values()] or [None]:
                if not isinstance(value, Structure | Motion):
                    raise InvalidInput(
                        f"{name} = {value!r}: give labels with structures or with motions"
                    )
            checked[name] = dict(values)
            continue
        if name not in RANGES:
            raise InvalidInput(
                f"{name!r} cannot be varied: name one of {sorted(RANGES)}, or give a mapping from "
                "labels to structures or to motions"
            )
        several = isinstance(values, Iterable) and not isinstance(values, str)
        values, labels = tuple(values) if several else (values,), RANGES[name]
        if isinstance(labels[0], str):
            unknown = [value for value in values if value not in labels]
            if unknown or not values:
                raise InvalidInput(f"{name} = {values!r}: give some of {labels}")
        else:
            values = tuple(float(check_number(value, name)) for value in values)
            if not values or (name != "friction" and min(values) <= 0.0):
                raise InvalidInput(f"{name} = {values!r}: give the ends of a range above 0")
        checked[name] = values
    return checked
