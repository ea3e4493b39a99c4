"""Which instants a film shows, and how fast: evenly, or in slow motion around what matters."""

from dataclasses import dataclass

import numpy as np

from archfem.arrays import Array
from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.joints.criteria import judged
from archfem.view.moved import Falls

BEFORE, AFTER = 0.25, 0.75
"""How long before and after the instant that matters a film is in slow motion [s]."""

SLOWEST, BETWEEN = 0.1, 4.0
"""Speed of slow motion, relative to the real one, and pictures between two kept fields at most:
what happens between them is not known."""

Window = str | tuple[float, float] | None
"""Where a film is in slow motion: "auto", from when until when [s], or nowhere."""


@dataclass(frozen=True, eq=False)
class Pace:
    """What a film shows when.

    Attributes:
        times: of its frames (frames,) [s].
        speeds: at which each is shown, relative to the real one (frames,) [-].
        fps: frames that a second shows.
    """

    times: Array
    speeds: Array
    fps: float


def even(known: Array, fps: float, seconds: float | None) -> Pace:
    """Return even times, in as many frames as the film lasts for, and no more than fields.

    Args:
        known: times of the fields that were kept (fields,) [s].
        fps: frames a second, at most.
        seconds: how long the film lasts [s]; None for as long as the run.

    Raises:
        InvalidInput: a number cannot be meant.
    """
    for key, value in (("fps", fps), ("seconds", seconds)):
        if value is not None and not 0.0 < value < 1e4:
            raise InvalidInput(f"{key} {value:.4g} is not between 0 and 10000")
    lasting = seconds or max(float(known[-1] - known[0]), 1.0 / fps)
    count = min(len(known), max(1, round(lasting * fps)))
    speed = float(known[-1] - known[0]) / lasting or 1.0
    return Pace(np.linspace(known[0], known[-1], count), np.full(count, speed), count / lasting)


def slowed(known: Array, fps: float, window: tuple[float, float]) -> Pace:
    """Return the times of a film in real time, but in slow motion from one instant to another.

    Args:
        known: times of the fields that were kept (fields,) [s].
        fps: frames a second, at most.
        window: from when until when it is slow [s].

    Raises:
        InvalidInput: the window is not one of the run.
    """
    real = even(known, fps, None)
    start, end = np.clip(window, known[0], known[-1])
    if not start < end:
        raise InvalidInput(
            f"window {window}: the run lasts from {known[0]:g} to {known[-1]:g} s; give two times "
            "of it, the earlier first, or 'auto'"
        )
    inside = known[(known >= start) & (known <= end)]
    apart = float(np.median(np.diff(inside))) if len(inside) > 1 else float(end - start)
    speed = float(np.clip(apart * real.fps / BETWEEN, SLOWEST, 1.0))
    marks = np.array([known[0], start, end, known[-1]])
    shown = np.append(0.0, np.cumsum(np.diff(marks) / [1.0, speed, 1.0]))
    times = np.interp(
        np.linspace(0.0, shown[-1], max(1, round(shown[-1] * real.fps))), shown, marks
    )
    slow = (times >= start) & (times < end)
    return Pace(times, np.where(slow, speed, 1.0), real.fps)


def decisive(run: History, falls: Falls | None) -> tuple[float, float]:
    """Return the time around what matters most in a run [s].

    That is where blocks come loose, or else the first mechanism by count, or else where a joint's
    thrust comes nearest to a face.

    Args:
        run: what happened.
        falls: what came loose, if anything did.
    """
    if falls is not None:
        instant = float(falls.times[0])
    elif run.mechanism is not None and run.mechanism.time is not None:
        instant = run.mechanism.time
    else:
        tilt = abs(judged(run.joints)["eccentricity"]).max("joint")
        instant = float(run.time[int(tilt.fillna(0.0).argmax("time"))])
    return instant - BEFORE, instant + AFTER


def pace_of(
    run: History, falls: Falls | None, known: Array, fps: float, seconds: float | None,
    window: Window,
) -> Pace:  # fmt: skip
    """Return which instants of a run its film shows, and how fast.

    Args:
        run: what happened.
        falls: what came loose, if anything did.
        known: times of the fields that were kept (fields,) [s].
        fps: frames a second, at most.
        seconds: how long the film lasts [s]; None for as long as the run, and slow motion.
        window: where it is in slow motion.

    Raises:
        InvalidInput: a number cannot be meant, or both a length and a window are given.
    """
    if window is None:
        return even(known, fps, seconds)
    if seconds is not None:
        raise InvalidInput(f"seconds {seconds:g} and window {window}: give one of the two")
    if isinstance(window, str):
        if window != "auto":
            raise InvalidInput(f"window '{window}': give 'auto', or two times in seconds")
        window = decisive(run, falls)
    return slowed(known, fps, window)
