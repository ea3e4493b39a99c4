"""Text of a run: extremes, residual displacements, and mechanisms with duration and opening."""

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from archfem.joints.criteria import Criteria, assessed_joints, longest_duration, step_lengths
from archfem.limit.mechanism_count import Mechanism, duration_text, episode, has_counted_mechanism
from archfem.masonry.structure import join_joint_names, join_names
from archfem.units import mm


def extremes_text(dataset: xr.Dataset) -> str:
    """Return a sentence on the largest hinge rotation, slip and displacement, and the residual."""
    if "rotation" not in dataset or "largest_displacement" not in dataset:
        return ""
    # rotations of joints while they hinge, slips of all joints, both of rings and piers
    joints = assessed_joints(dataset)
    rotations = abs(joints["rotation"]).where(joints["hinge"] != 0, 0.0)
    if float(rotations.max()) > 0.0:
        rotation = f"the largest hinge rotation is {_peak_text(rotations, 1e-3, 'mrad')}"
    else:
        rotation = "no joint hinges"
    slip = _peak_text(abs(joints["slip"]), mm, "mm")
    # displacements of the middles of blocks, from the start of the run
    far = dataset.isel(block=int(dataset["largest_displacement"].values.argmax()))
    last = dataset.isel(block=int(dataset["residual_displacement"].values.argmax()))
    largest, time = float(far["largest_displacement"]), float(far["largest_displacement_time"])
    residual = float(last["residual_displacement"])
    # the record of a falling structure ends where its blocks separate
    end = (
        "before blocks came loose none was" if "fall_pose" in dataset else "at the end no block is"
    )
    sentence = (
        f"{rotation}, the largest slip {slip}, the largest displacement "
        f"{largest / mm:.3g} mm ({far['block'].item()}, {time:.3f} s), and {end} farther "
        f"than {residual / mm:.3g} mm ({last['block'].item()}) from where it stood."
    )
    return sentence[0].upper() + sentence[1:]


def _peak_text(values: xr.DataArray, unit: float, name: str) -> str:
    """Return the largest of values over time and joint, with the joint and the time."""
    values = values.transpose("time", "joint")
    instant, joint = np.unravel_index(int(values.values.argmax()), values.shape)
    largest, time = float(values.values[instant, joint]), float(values["time"][instant])
    return f"{largest / unit:.3g} {name} ({values['name'].values[joint]}, {time:.3f} s)"


def mechanism_text(
    joints: xr.Dataset,
    mechanisms: Mapping[str, Mechanism | None],
    blocks: Sequence[str] | None,
    brief: Mapping[str, Mechanism | None],
) -> list[str]:
    """Return a line for each method of detection; `brief` are mechanisms of any duration."""
    lines = []
    for method, mechanism in mechanisms.items():
        short = brief[method]
        if mechanism is not None:
            words = _describe(method, mechanism, joints, blocks)
        else:
            words = _describe_none(method, joints, short is not None)
        if short is not None and (mechanism is None or short.time != mechanism.time):
            words += f"; what begins at {short.time:.4f} s lasts less than {_min_duration(joints)}"
            words += ", and does not count"
        lines.append(f"{method}: {words}")
    return lines


def _min_duration(joints: xr.Dataset) -> str:
    """Return the minimum duration of a mechanism as text."""
    return duration_text(Criteria.of(joints).duration)


def _describe_none(method: str, joints: xr.Dataset, has_brief: bool) -> str:
    """Return the statement that there was no mechanism, and why."""
    never = f"never {Criteria.of(joints).failures} failed joints at once"
    words = {
        "by count": f"no mechanism, {never} in rings and piers",
        "verified": "no mechanism, at no instant could rings or piers move",
    }.get(method, f"no mechanism, {never} in one ring")
    return f"{words} for {_min_duration(joints)}" if has_brief else words


def _describe(
    method: str, mechanism: Mechanism, joints: xr.Dataset, blocks: Sequence[str] | None
) -> str:
    """Return a mechanism, its duration and opening, and the blocks that move."""
    words = (
        f"{mechanism.kind} mechanism of {mechanism.part} at {mechanism.time:.3f} s by "
        f"{join_joint_names(mechanism.names)}; {episode(joints, mechanism)}"
    )
    if method == "by count":
        words += f"; {_durations_text(joints)}"
        if blocks is not None and not mechanism.blocks:
            words += "; at its beginning rings and piers cannot move"
    if blocks is not None and mechanism.blocks:
        words += f"; moving: {join_names([blocks[k] for k in mechanism.blocks], '; ')}"
    return words


def _durations_text(joints: xr.Dataset) -> str:
    """Return the total and the longest time with enough failed joints for a mechanism."""
    flags = has_counted_mechanism(joints).expand_dims(joint=[0])
    steps = step_lengths(flags["time"].values)
    total = float(steps[flags.transpose("joint", "time").values[0]].sum())
    longest = float(longest_duration(flags)[0])
    return (
        f"so many fail for {duration_text(total)} in all, {duration_text(longest)} at the longest"
    )


def one_line(dataset: xr.Dataset) -> str:
    """Return title, length, largest |e| and outcome of a run in one line."""
    attrs, times = dataset.attrs, dataset["time"].values
    largest = float(abs(assessed_joints(dataset)["eccentricity"]).max())
    return (
        f"History '{attrs.get('title', '')}': {len(times)} records to {times[-1]:.4g} s, "
        f"|e| ≤ {largest:.3f}; {attrs.get('outcome', '')}"
    )
