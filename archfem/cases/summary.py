"""What limit analysis and runs found, and how strong motions are, as text."""

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from archfem.dynamics.history import Ending, History
from archfem.dynamics.tradeoff import Accuracy
from archfem.joints.criteria import envelope, first_time, flagged, judged, longest_duration
from archfem.limit.collapse import Collapse, Outcome
from archfem.limit.counted import Mechanism
from archfem.limit.episodes import episode, lasting
from archfem.masonry.naming import listed, listed_joints
from archfem.masonry.structure import Structure
from archfem.motion.matching import Match
from archfem.motion.measures import measures
from archfem.motion.motion import Motion
from archfem.statics.strength import utilisation_sentence
from archfem.tables import aligned
from archfem.units import STANDARD_GRAVITY, mm

ENDS = {Ending.FINISHED: "reached", Ending.EVENT: "ended"}
"""Words for how a run ended, other than its own."""

NONE = ("none", "-", "-", "-")
"""Cells of a mechanism that was not found."""

LOOSE = 100.0
"""Mobilised friction V / N beyond which a joint is all but open, and its value says nothing."""


Rows = tuple[list[str], list[list[str]]]
"""Titles of the columns of a table, and its rows."""


def joint_table(joints: xr.Dataset, dead: xr.Dataset | None = None) -> str:
    """Return one line a joint: envelope, and when and how long it hinged, slid and was open.

    Only joints that are `judged` have a line.

    Args:
        joints: over time and joint.
        dead: over joint, under dead load alone.
    """
    return aligned(*joint_rows(joints, dead))


def joint_rows(joints: xr.Dataset, dead: xr.Dataset | None = None) -> Rows:
    """Return the cells of `joint_table`.

    Args:
        joints: over time and joint.
        dead: over joint, under dead load alone.
    """
    joints = judged(flagged(joints))
    rest = np.full(joints.sizes["joint"], np.nan)
    if dead is not None:
        rest = judged(dead)["eccentricity"].values
    span = envelope(joints)
    flags = {"hinge": joints["hinge"] != 0, "slide": joints["slide"], "open": joints["open"]}
    times = {
        key: list(zip(first_time(flag).values, longest_duration(flag).values, strict=True))
        for key, flag in flags.items()
    }
    head = ["joint", "e dead", "e min", "e max", "max V/N"]
    head += [f"{key} {what}" for key in flags for what in ("from", "for")]
    rows = []
    for k, name in enumerate(joints["name"].values):
        numbers = [span[key].values[k] for key in ("lowest", "highest", "friction")]
        cells = [str(name), *(_number(x) for x in (rest[k], *numbers))]
        for key in flags:
            start, longest = times[key][k]
            cells += [_seconds(start), _seconds(longest) if longest > 0.0 else "-"]
        rows.append(cells)
    return head, rows


def pair_table(runs: Mapping[str, History]) -> str:
    """Return one line a run of a suite: its ground, the gravest joint, the mechanism, its end.

    Args:
        runs: what to call each run, and the run.
    """
    return aligned(*pair_rows(runs))


def pair_rows(runs: Mapping[str, History]) -> Rows:
    """Return the cells of `pair_table`.

    Args:
        runs: what to call each run, and the run.
    """
    head = ["pair", "max |ax|", "max |ay|", "max |e|", "joint", "max V/N", "apart"]
    head += ["by count", "at", "for", "opens", "joints", "Demirel & Aldemir", "at"]
    head += ["verified", "at", "for", "opens", "end"]
    rows = []
    for name, run in runs.items():
        joints = judged(run.joints)
        size = abs(joints["eccentricity"])
        apart = joints["open"].any("time")
        worst = size.max("time").where(~apart, 0.5)
        found = run.mechanism
        moved = run.verified.moved if run.structure is not None and run.verified else None
        moving = ("unknown", *NONE[1:]) if run.structure is None else _told(moved, run)
        level, upright = np.abs(run.dataset["ground"].values).max(axis=0)
        rows.append(
            [
                name,
                f"{level:.2f} m/s²",
                f"{upright:.2f} m/s²",
                _number(float(size.max())),
                str(joints["name"].values[int(worst.values.argmax())]),
                _number(float(joints["friction"].max())),
                f"{int(apart.sum())} joints" if apart.any() else "-",
                *_told(found, run),
                listed_joints(found.names) if found else "-",
                *_told(run.demirel_aldemir, run)[:2],
                *moving,
                _end(run),
            ]
        )
    return head, rows


def _end(run: History) -> str:
    """How a run ended, and when; what it left where displacements may be large."""
    words = f"{ENDS.get(run.ended, run.ended)} {run.time[-1]:.2f} s"
    return words if run.fall is None else f"{words}, {run.fall.kind}"


def collapse_words(structure: Structure, found: Collapse) -> str:
    """Return what limit analysis found in words: outcome and factor, hinges, sliding joints.

    Args:
        structure: whose joints they are.
        found: as by `collapse_factor`.
    """
    joints = structure.joints
    outcome = f"limit analysis: {found.outcome.sentence}"
    if found.outcome in (Outcome.COLLAPSES, Outcome.BRACKETED):
        outcome += f", at a factor of {found.factor:.4g} on the load"
    hinges = [f"{joints[number].name} at the {side}" for number, side in found.hinges]
    sliding = [joints[number].name for number in found.sliding]
    lines = [outcome]
    lines += [f"hinges, by the face in contact: {listed(hinges)}"] if hinges else []
    lines += [f"sliding: {listed_joints(sliding)}"] if sliding else []
    lines += [str(found.solutions)] if found.solutions else []
    return "\n".join(lines)


def accuracy_words(found: Accuracy) -> str:
    """Return the table of a comparison of settings, its reference, and the setting to choose.

    Args:
        found: as by `archfem.accuracy`.
    """
    chosen = found.chosen.setting.label if found.chosen else "none: a finer model is needed"
    lines = [
        found.table(),
        "",
        f"reference: {found.reference.label}, in doubt by {found.doubt:.2g}",
        f"chosen for an error of {found.tolerance:g}: {chosen}",
    ]
    return "\n".join(lines)


def run_words(structure: Structure, run: History, dead: xr.Dataset) -> str:
    """Return what a run did: its verdict, how it was found, its joints, and the use of strength.

    Args:
        structure: what was shaken.
        run: what happened.
        dead: joints under dead load alone.
    """
    strength = utilisation_sentence(structure, run.joints)
    parts = [run.verdict, found_words(run), joint_table(run.joints, dead), strength]
    return "\n\n".join(parts)


def found_words(run: History) -> str:
    """Return how the numbers of a run came about, and what speaks for them, in a few lines.

    Args:
        run: what happened.
    """
    told = run.dataset.attrs
    predicted = (
        f"predicted to err by {told['predicted_error']:.2g} in the largest |e|"
        if "predicted_error" in told
        else 'its error in |e| was not predicted, as fidelity = "auto" does'
    )
    lines = [
        f"outcome: {run.outcome}; {told['steps']} steps by '{told['method']}'",
        f"energy: drifts by {told['energy_drift']:+.1e} of the largest exchanged at most",
        f"displacements: no block farther than {told['largest_displacement'] / mm:.3g} mm",
        f"model: rung '{told['fidelity']}', {predicted}",
        f"doubts: {len(run.doubts) or 'none'}",
    ]
    return "\n".join(lines)


def motion_table(motions: Sequence[Motion]) -> str:
    """Return one line a component: its step and its intensity measures.

    The only component of a motion may have any direction, and is named so.

    Args:
        motions: each with a name.
    """
    return aligned(*motion_rows(motions))


def motion_rows(motions: Sequence[Motion]) -> Rows:
    """Return the cells of `motion_table`.

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
    return head, rows


def match_table(matches: Sequence[Match]) -> str:
    """Return one line a component of matched motions: misfit, and measures before and after.

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


def _told(found: Mechanism | None, run: History) -> tuple[str, str, str, str]:
    """Four cells of a table: class, time, duration and opening of a mechanism."""
    if found is None or found.time is None:
        return NONE
    met = episode(run.joints, found)
    wide = "-" if met.opening is None else f"{met.opening / mm:.3g} mm"
    return found.kind, _seconds(found.time), lasting(met.duration), wide


def _number(value: float) -> str:
    if np.isnan(value):
        return "open"
    return f"{value:.3f}" if value < LOOSE else f"> {LOOSE:g}"


def _seconds(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.3f} s"
