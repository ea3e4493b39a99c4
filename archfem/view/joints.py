"""Joints over time: several of one run, or one of several runs."""

from collections.abc import Mapping, Sequence
from textwrap import wrap

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from archfem.arrays import Array
from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.joints.criteria import Criteria, judged, sliding_limits
from archfem.joints.duration import step_lengths
from archfem.masonry.structure import Structure
from archfem.view.envelopes import draw_faces
from archfem.view.style import COLUMN, HINGE, INK, LINES, SLIP, SMALL, WIDE, Page, dress, entitle

LETTERS = 20
"""That fit beside a panel."""

LOOSE, BEYOND = 1.5, 3.0
"""Mobilised friction at which its axis ends at least and at most, relative to the coefficient: a
joint about to open has any value, and what lies beyond is told."""

TWIN = 1e-6
"""Distance of joints from each other's mirror image that makes them twins, relative to the size of
the structure."""


def draw_joints(run: History, joints: Sequence[str | int] | None = None) -> Figure:
    """Draw eccentricity and mobilised friction of joints over time, below the ground's motion.

    Friction has the sense of the shear force. Lines are interrupted while a joint is open; limits
    are by the run's criteria.

    Args:
        run: what happened.
        joints: their names, or their numbers; by default the two that tell most.

    Returns:
        The page: the ground's motion, and a row for each joint.

    Raises:
        InvalidInput: there is no such joint.
    """
    joints = telling_joints(run) if joints is None else joints
    if not len(joints):
        raise InvalidInput("no joints to draw: give their names, e.g. ['main arch, joint 5']")
    chosen, rows = [run.joint(joint) for joint in joints], 1 + len(joints)
    figure = Page(figsize=(COLUMN, 0.9 + 1.15 * rows), layout="constrained")
    grid = figure.add_gridspec(rows, 2)
    ground = figure.add_subplot(grid[0, :])
    _ground(ground, run)
    ground.xaxis.set_major_locator(MaxNLocator(5))
    panels = []
    for row, own in enumerate(chosen, start=1):
        left, right = (figure.add_subplot(grid[row, k], sharex=ground) for k in range(2))
        criteria = Criteria.of(own)
        name = "\n".join(wrap(str(own["name"].values), LETTERS))
        dress(left, "", f"{name}\nM / (N h) [-]")
        _eccentricity(left, own, criteria)
        _friction(right, own, criteria)
        panels.append((left, right))
    for axes in panels[-1]:
        axes.set_xlabel("time [s]", fontsize=SMALL)
    for axes in (each for row in panels[:-1] for each in row):
        axes.tick_params(labelbottom=False)
    figure.align_ylabels([ground, *(left for left, _ in panels)])
    return figure


def draw_joint(runs: Mapping[str, History], joint: str | int) -> Figure:
    """Draw mobilised friction and eccentricity of one joint over time, a column for each run.

    Friction has the sense of the shear force. Lines are interrupted while the joint is open; dashed
    ones are the limits by the run's criteria: the coefficient of friction, and |e| of a hinge.

    Args:
        runs: what to call each run, and the run.
        joint: its name, or its number.

    Returns:
        The page, with a column for each run.

    Raises:
        InvalidInput: a run has no such joint.
    """
    figure = Page(figsize=(0.8 * WIDE, 4.2), layout="constrained")
    panels = figure.subplots(2, len(runs), sharex=True, sharey="row", squeeze=False)
    for column, (label, run) in zip(panels.T, runs.items(), strict=True):
        own = run.joint(joint)
        criteria = Criteria.of(own)
        _friction(column[0], own, criteria)
        dress(column[1], "time [s]", "eccentricity M / (N h) [-]")
        _eccentricity(column[1], own, criteria)
        entitle(column[0], f"{label}: {own['name'].values!s}")
        for axes in column:
            axes.set_xlim(run.time[0], run.time[-1])
            axes.label_outer()
    return figure


def _ground(axes: Axes, run: History) -> None:
    """Draw the acceleration of the ground."""
    dress(axes, "", "ground [m/s²]")
    time, ground = run.time, run.dataset["ground"].values
    axes.plot(time, ground[:, 0], color=INK, lw=0.6, label="horizontal")
    if ground[:, 1].any():
        axes.plot(time, ground[:, 1], color=LINES[4], lw=0.5, alpha=0.9, label="vertical")
        axes.legend(
            frameon=False, fontsize=SMALL, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 0.96)
        )
    axes.set_xlim(time[0], time[-1])


def _eccentricity(axes: Axes, joint: xr.Dataset, criteria: Criteria) -> None:
    """Draw where the thrust crosses a joint, against its faces."""
    draw_faces(axes, criteria.hinge)
    axes.plot(joint["time"], joint["eccentricity"], color=LINES[0], lw=0.6)
    axes.set_ylim(-0.56, 0.56)


def _friction(axes: Axes, joint: xr.Dataset, criteria: Criteria) -> None:
    """Draw mobilised friction with the sense of the shear force, between its limits."""
    dress(axes, "", "V / N [-]")
    limit = float(criteria.coefficients(joint["friction_limit"].values))
    if np.isfinite(limit):  # else it never slides
        _friction_limits(axes, joint, criteria, limit)
    ratio = np.sign(joint["V"].values) * joint["friction"].values
    axes.plot(joint["time"], ratio, color=LINES[0], lw=0.6)
    most, top = float(np.nanmax(np.abs(ratio), initial=0.0)), axes.get_ylim()[1]
    if np.isfinite(limit) and most > top:
        beyond = np.abs(np.nan_to_num(ratio)) > top
        edge = 0.97 * top * np.sign(ratio[beyond])
        axes.scatter(joint["time"].values[beyond], edge, marker="d", s=6, color=HINGE, zorder=4)
        _note(axes, f"◆ beyond, up to {most:.3g}", (0.0, 0.0), HINGE)


def _twins(structure: Structure | None, numbers: Array, first: int) -> NDArray[np.bool_]:
    """Whether joints of some numbers are mirror images of one of them (n,)."""
    if structure is None:
        return np.zeros(len(numbers), dtype=bool)
    middles, ends = structure.middles[numbers], structure.ends[..., 0]
    image = np.array([ends.min() + ends.max() - middles[first, 0], middles[first, 1]])
    found: NDArray[np.bool_] = np.linalg.norm(middles - image, axis=1) < TWIN * structure.size
    return found


def telling_joints(run: History) -> list[int]:
    """Return two joints that tell most of a run: one by where its thrust is, one by its friction.

    The first has the largest |e|, or opens; the second slides for the longest time, or else comes
    nearest to it. It is not the mirror image of the first, which does much the same, where the
    run knows its structure.

    Args:
        run: what happened.
    """
    own = judged(run.joints)
    numbers = own["joint"].values
    tilt = abs(own["eccentricity"]).max("time").fillna(0.5).values
    first = int(np.argmax(tilt))
    use = (own["friction"] / own["friction_limit"]).max("time").fillna(0.0).values
    slid = (own["slide"].transpose("time", "joint").values * step_lengths(run.time)[:, None]).sum(0)
    order = np.lexsort([-tilt, -np.where(np.isfinite(use), use, 0.0), -np.round(slid, 9)])
    twin = _twins(run.structure, numbers, first)
    others = [k for k in order if k != first and not twin[k]] or [k for k in order if k != first]
    return [int(numbers[k]) for k in (first, *others[:1])]


def _friction_limits(axes: Axes, joint: xr.Dataset, criteria: Criteria, limit: float) -> None:
    """Draw the ratios at which a joint slides: μ, and more by cohesion."""
    limits = np.nan_to_num(sliding_limits(joint, criteria), nan=limit)
    most = float(np.nanmax(joint["friction"].values, initial=0.0))
    top = float(np.clip(1.08 * most, LOOSE * limits[0], BEYOND * limits[0]))
    for side in (1.0, -1.0):
        axes.plot(joint["time"], side * limits, color=SLIP, lw=0.9, ls="--")
        axes.fill_between(joint["time"], side * limits, side * top, color=SLIP, alpha=0.12, lw=0)
    axes.set_ylim(-top, top)
    axes.annotate(
        f"μ = {limit:g}", (1.0, limit), (-3, 1), xycoords=("axes fraction", "data"),
        textcoords="offset points", fontsize=SMALL, ha="right", va="bottom", color=SLIP,
    )  # fmt: skip


def _note(axes: Axes, words: str, place: tuple[float, float], colour: str) -> None:
    """Write into a corner."""
    axes.annotate(
        words, place, (3, 2), xycoords="axes fraction", textcoords="offset points",
        fontsize=SMALL - 1.0, color=colour, ha="left", va="bottom",
    )  # fmt: skip
