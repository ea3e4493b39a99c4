"""What runs did to the joints, and how strong motions are, as tables of text."""

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from archfem.criteria import HINGE, envelope, first_time, hinged, longest_duration, opened, sliding
from archfem.history import History
from archfem.matching import Match
from archfem.measures import measures
from archfem.motion import Motion
from archfem.units import STANDARD_GRAVITY


def joint_table(joints: xr.Dataset, dead: xr.Dataset | None = None, limit: float = HINGE) -> str:
    """One line a joint: envelope, and when and how long it hinged, slid and was open.

    Args:
        joints: over time and joint.
        dead: over joint, under dead load alone.
        limit: of |e| for a hinge [-].
    """
    span = envelope(joints)
    flags = {
        "hinge": hinged(joints, limit) != 0,
        "slide": sliding(joints),
        "open": opened(joints),
    }
    times = {
        key: list(zip(first_time(flag).values, longest_duration(flag).values, strict=True))
        for key, flag in flags.items()
    }
    head = ["joint", "e dead", "e min", "e max", "max V/N"]
    head += [f"{key} {what}" for key in flags for what in ("from", "for")]
    rows = []
    for k, name in enumerate(joints["name"].values):
        numbers = [span[key].values[k] for key in ("lowest", "highest", "friction")]
        rest = np.nan if dead is None else float(dead["eccentricity"][k])
        cells = [str(name), *(_number(x) for x in (rest, *numbers))]
        for key in flags:
            start, longest = times[key][k]
            cells += [_seconds(start), _seconds(longest) if longest > 0.0 else "-"]
        rows.append(cells)
    return aligned(head, rows)


def pair_table(runs: Mapping[str, History]) -> str:
    """One line a run of a suite: its ground, the gravest joint, the mechanism, and how it ended.

    Args:
        runs: what to call each run, and the run.
    """
    head = ["pair", "max |ax|", "max |ay|", "max |e|", "joint", "max V/N", "apart"]
    head += ["mechanism", "at", "joints", "end"]
    rows = []
    for name, run in runs.items():
        size = abs(run.joints["eccentricity"])
        apart = opened(run.joints).any("time")
        worst = size.max("time").where(~apart, 0.5)
        found = run.mechanism
        level, upright = np.abs(run.dataset["ground"].values).max(axis=0)
        rows.append(
            [
                name,
                f"{level:.2f} m/s²",
                f"{upright:.2f} m/s²",
                _number(float(size.max())),
                str(run.joints["joint"].values[int(worst.values.argmax())]),
                _number(float(run.joints["friction"].max())),
                f"{int(apart.sum())} joints" if apart.any() else "-",
                found.kind if found else "none",
                _seconds(np.nan if found is None or found.time is None else found.time),
                " ".join(map(str, found.joints)) if found else "-",
                f"{run.outcome.split()[0]} {run.time[-1]:.2f} s",
            ]
        )
    return aligned(head, rows)


def motion_table(motions: Sequence[Motion]) -> str:
    """One line a component: its step and its intensity measures.

    The only component of a motion may have any direction, and is named so.

    Args:
        motions: each with a name.
    """
    head = ["motion", "component", "samples", "dt", "PGA", "PGV", "PGD", "Arias", "CAV"]
    head += ["Housner", "D5-95", "length"]
    rows = []
    for motion in motions:
        for component in motion.components:
            found = measures(motion, component)
            rows.append(
                [
                    motion.name,
                    component if len(motion.components) > 1 else "only one",
                    str(len(motion.component(component))),
                    f"{motion.dt:g} s",
                    f"{found.pga / STANDARD_GRAVITY:.4f} g",
                    f"{found.pgv:.4f} m/s",
                    f"{found.pgd:.4f} m",
                    f"{found.arias:.3g} m/s",
                    f"{found.cav:.3g} m/s",
                    f"{found.housner:.3g} m",
                    f"{found.significant_duration:.2f} s",
                    f"{found.duration:.2f} s",
                ]
            )
    return aligned(head, rows)


def match_table(matches: Sequence[Match]) -> str:
    """One line a component of matched motions: misfit, and measures before and after.

    Args:
        matches: as a `Suite` keeps them.
    """
    head = ["pair", "component", "misfit", "drift", "PGA", "matched", "Arias", "matched"]
    head += ["D5-95", "matched"]
    rows = []
    for match in matches:
        for component, misfit in match.misfit.items():
            before, after = match.before[component], match.after[component]
            rows.append(
                [
                    match.motion.name,
                    component,
                    f"{misfit:.2%}",
                    f"{abs(match.motion.displacement(component)[-1]):.0e} m",
                    f"{before.pga / STANDARD_GRAVITY:.4f} g",
                    f"{after.pga / STANDARD_GRAVITY:.4f} g",
                    f"{before.arias:.3g} m/s",
                    f"{after.arias:.3g} m/s",
                    f"{before.significant_duration:.2f} s",
                    f"{after.significant_duration:.2f} s",
                ]
            )
    return aligned(head, rows)


def aligned(head: list[str], rows: list[list[str]]) -> str:
    """Columns of text, the first to the left, the others to the right."""
    widths = [max(len(row[k]) for row in [head, *rows]) for k in range(len(head))]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if k == 0 else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in [head, *rows]
    )


def _number(value: float) -> str:
    return "open" if np.isnan(value) else f"{value:.3f}"


def _seconds(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.3f} s"
