"""What a run means, in words: how far it went, what was left, and what each mechanism came to."""

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from archfem.joints.criteria import Criteria, judged, longest_duration
from archfem.joints.duration import step_lengths
from archfem.limit.counted import Mechanism, counts_as_mechanism
from archfem.limit.episodes import episode, lasting
from archfem.masonry.naming import listed, listed_joints
from archfem.units import mm

mrad = 1e-3  # rad


def extremes(dataset: xr.Dataset) -> str:
    """Return a sentence on the largest hinge rotation, slip and displacement, and what is left.

    Rotations are those of joints of rings and piers while they hinge, slips those of all joints of
    rings and piers; displacements are of the blocks' middles, from the start of the run.

    Args:
        dataset: of a run.

    Returns:
        The sentence; empty where openings and displacements were not kept, as in files of earlier
        versions.
    """
    if "rotation" not in dataset or "largest_displacement" not in dataset:
        return ""
    joints = judged(dataset)
    turned = abs(joints["rotation"]).where(joints["hinge"] != 0, 0.0)
    if float(turned.max()) > 0.0:
        rotation = f"the largest hinge rotation is {_peak(turned, mrad, 'mrad')}"
    else:
        rotation = "no joint hinges"
    slip = _peak(abs(joints["slip"]), mm, "mm")
    far = dataset.isel(block=int(dataset["largest_displacement"].values.argmax()))
    last = dataset.isel(block=int(dataset["residual_displacement"].values.argmax()))
    most, when = float(far["largest_displacement"]), float(far["largest_displacement_time"])
    left = float(last["residual_displacement"])
    sentence = (
        f"{rotation}, the largest slip {slip}, the largest displacement "
        f"{most / mm:.3g} mm ({far['block'].item()}, {when:.3f} s), and {_end(dataset)} farther "
        f"than {left / mm:.3g} mm ({last['block'].item()}) from where it stood."
    )
    return sentence[0].upper() + sentence[1:]


def _end(dataset: xr.Dataset) -> str:
    """The beginning of what is said of the last instant at which joints hold."""
    return (
        "before blocks came loose none was" if "fall_pose" in dataset else "at the end no block is"
    )


def _peak(values: xr.DataArray, unit: float, name: str) -> str:
    """The largest of values over time and joint, with the joint and the time."""
    values = values.transpose("time", "joint")
    instant, joint = np.unravel_index(int(values.values.argmax()), values.shape)
    largest, time = float(values.values[instant, joint]), float(values["time"][instant])
    return f"{largest / unit:.3g} {name} ({values['name'].values[joint]}, {time:.3f} s)"


def mechanism_lines(
    joints: xr.Dataset,
    found: Mapping[str, Mechanism | None],
    blocks: Sequence[str] | None,
    brief: Mapping[str, Mechanism | None],
) -> list[str]:
    """Return a line for each way to look for a mechanism.

    Args:
        joints: over time and joint, in which they were found.
        found: the first mechanism each way, or None, "by count" and "verified" among them.
        blocks: names of the blocks that may move; None where nobody knows them.
        brief: the first each way, however short.
    """
    lines = []
    for way, each in found.items():
        short = brief[way]
        if each is not None:
            words = _told(way, each, joints, blocks)
        else:
            words = _none(way, joints, short is not None)
        if short is not None and (each is None or short.time != each.time):
            words += f"; what begins at {short.time:.4f} s lasts less than {_least(joints)}"
            words += ", and does not count"
        lines.append(f"{way}: {words}")
    return lines


def _least(joints: xr.Dataset) -> str:
    """The time for which a mechanism must hold to count, in words."""
    return lasting(Criteria.of(joints).duration)


def _none(way: str, joints: xr.Dataset, short: bool) -> str:
    """That there was no mechanism, and why; whether there were some too short to count."""
    never = f"never {Criteria.of(joints).failures} failed joints at once"
    words = {
        "by count": f"no mechanism, {never} in rings and piers",
        "verified": "no mechanism, at no instant could rings or piers move",
    }.get(way, f"no mechanism, {never} in one ring")
    return f"{words} for {_least(joints)}" if short else words


def _told(way: str, found: Mechanism, joints: xr.Dataset, blocks: Sequence[str] | None) -> str:
    """A mechanism, what it came to, and what moves."""
    words = (
        f"{found.kind} mechanism of {found.part} at {found.time:.3f} s by "
        f"{listed_joints(found.names)}; {episode(joints, found)}"
    )
    if way == "by count":
        words += f"; {_in_all(joints)}"
        if blocks is not None and not found.blocks:
            words += "; at its beginning rings and piers cannot move"
    if blocks is not None and found.blocks:
        words += f"; moving: {listed([blocks[k] for k in found.blocks], '; ')}"
    return words


def _in_all(joints: xr.Dataset) -> str:
    """For how long as many joints fail as make a mechanism by count."""
    flags = counts_as_mechanism(joints).expand_dims(joint=[0])
    steps = step_lengths(flags["time"].values)
    total = float(steps[flags.transpose("joint", "time").values[0]].sum())
    longest = float(longest_duration(flags)[0])
    return f"so many fail for {lasting(total)} in all, {lasting(longest)} at the longest"


def in_a_line(dataset: xr.Dataset) -> str:
    """Return what a run is: its title, how long it lasts, its largest |e|, and how it ended.

    Args:
        dataset: of the run.
    """
    told, times = dataset.attrs, dataset["time"].values
    tilt = float(abs(judged(dataset)["eccentricity"]).max())
    return (
        f"History '{told.get('title', '')}': {len(times)} records to {times[-1]:.4g} s, "
        f"|e| ≤ {tilt:.3f}; {told.get('outcome', '')}"
    )
