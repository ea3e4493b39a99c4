"""What each run did: player, criteria per joint, mechanism, fall."""

from typing import Any

import numpy as np

from archfem.cases.dossier.display import player_of
from archfem.cases.dossier.results import Results, not_held
from archfem.cases.summary import LOOSE, joint_rows, pair_rows
from archfem.dynamics.history import History
from archfem.joints.criteria import judged
from archfem.statics.strength import utilisation_sentence
from archfem.view.envelopes import draw_envelope
from archfem.view.falls import draw_fall
from archfem.view.pages.document import Grid, Plate, Section, Words
from archfem.view.style import LINES

JOINTS = (
    "Criteria per joint: eccentricity under dead load, least and largest, largest V / N, and when "
    "and how long at most the joint hinged, slid and was open."
)
STEADY = "Least and largest eccentricity of each joint; dotted under dead load."
FELL = "Blocks on their way to the ground, over where they stood."


def run_sections(results: Results) -> list[Section]:
    """Return the sections on the runs.

    Args:
        results: of which the report is.
    """
    runs, missing = dict(results.runs), results.missing
    gone = [
        not_held(f"runs of {', '.join(missing)}", "`archfem run` again goes on with what is left.")
    ]
    if not runs:
        none = not_held("a run", "A case with [motion] or [suite] has one.")
        return [Section("Response", gone if missing else [none])]
    if results.case.suite is None:
        (name,) = runs
        return [
            Section("Response", _response(results, name, 1)),
            Section("Mechanism and collapse", _mechanism(runs[name])),
        ]
    sections = [Section("Response: all pairs", [*_together(results), *(gone if missing else [])])]
    sections.append(Section("Response: pair by pair", []))
    for name, run in runs.items():
        pieces = [*_response(results, name, len(runs)), *_mechanism(run)]
        sections.append(Section(name, pieces, level=3))
    return sections


def _response(results: Results, name: str, players: int) -> list[Any]:
    """Player, joints and strength of one run."""
    case, run = results.case, results.runs[name]
    title = case.title if case.suite is None else f"{case.title}: {name}"
    pieces: list[Any] = []
    if not run.ended.by_itself:
        pieces.append(Words(f"The run did not come to its end: {run.outcome}.", "doubt"))
    pieces.append(player_of(case, run, title, players))
    if case.suite is None:
        pieces.append(Plate.of(draw_envelope({name: run}, dead=results.dead), STEADY))
    pieces.append(_grid_of_joints(run, results))
    strength = utilisation_sentence(case.structure, run.joints)
    pieces.append(Words(_sentence(strength)))
    return pieces


def _grid_of_joints(run: History, results: Results) -> Grid:
    """Criteria per joint, without columns of what no joint did."""
    head, rows = joint_rows(run.joints, results.dead)
    kept = [k for k in range(len(head)) if any(row[k] != "-" for row in rows)]
    never = {head[k].split()[0] for k in range(len(head)) if k not in kept}
    words = {"hinge": "No joint hinged.", "slide": "No joint slid.", "open": "None came apart."}
    caption = " ".join([JOINTS, *(words[key] for key in words if key in never)])
    return Grid([head[k] for k in kept], [[row[k] for k in kept] for row in rows], caption)


def _mechanism(run: History) -> list[Any]:
    """The verdict, and the fall where it was followed."""
    pieces: list[Any] = [Words(_sentence(line)) for line in run.verdict.splitlines()]
    if run.fall is None:
        pieces.append(
            not_held(
                "what happens after blocks come loose, for displacements were taken as small",
                'model.displacements = "large" follows them.',
            )
        )
    elif "fall_pose" in run.dataset:
        pieces.append(Plate.of(draw_fall(run), FELL))
    return pieces


def _together(results: Results) -> list[Any]:
    """Table and envelopes of all runs, as many to a picture as colours tell apart."""
    pairs, most = list(results.runs.items()), len(LINES)
    head, rows = pair_rows(results.runs)
    columns = [head, *rows]
    first = [[row[0], *row[1:8]] for row in columns]
    second = [[row[0], *row[7:]] for row in columns]
    pieces: list[Any] = [
        Grid(first[0], first[1:], "Peaks of the ground, and the gravest joint of each run"),
        Grid([], _terms(second), "Mechanism and end of each run"),
    ]
    for start in range(0, len(pairs), most):
        part = dict(pairs[start : start + most])
        pieces.append(Plate.of(draw_envelope(part, dead=results.dead), STEADY))
    return pieces


def _terms(table: list[list[str]]) -> list[tuple[str, str]]:
    """A line for each run: what is known of it, without what is not there."""
    head, *rows = table
    return [
        (
            row[0],
            "; ".join(
                f"{key}: {value}"
                for key, value in zip(head[1:], row[1:], strict=True)
                if value != "-"
            ),
        )
        for row in rows
    ]


def facts_of(results: Results) -> list[tuple[str, str]]:
    """Return what is to be seen at once: a name and a value each.

    Args:
        results: of which the report is.
    """
    runs, structure = results.runs, results.case.structure
    facts = [("structure", f"{len(structure.free)} blocks, {len(structure.joints)} joints")]
    if not runs:
        return [*facts, ("runs", "none")]
    peak = max(float(np.abs(run.dataset["ground"].values[:, 0]).max()) for run in runs.values())
    tilts = {name: abs(judged(run.joints)["eccentricity"]).max() for name, run in runs.items()}
    slips = {name: judged(run.joints)["friction"].max() for name, run in runs.items()}
    moving = [name for name, run in runs.items() if run.mechanism is not None]
    fallen = [name for name, run in runs.items() if run.fall and run.fall.kind != "stands"]
    open_ones = sum(bool(judged(run.joints)["open"].any()) for run in runs.values())
    opened = " (joints came apart)" if open_ones else ""
    alone = results.case.suite is None
    facts += [
        ("peak of the ground", f"{peak:.2f} m/s²"),
        ("largest |e|", f"{max(map(float, tilts.values())):.3f}{opened}"),
        ("largest V / N", _ratio(max(map(float, slips.values())))),
        ("mechanism by count", _counted(moving, len(runs), alone, runs)),
    ]
    if any(run.fall is not None for run in runs.values()):
        words = next(run.fall.kind for run in runs.values() if run.fall)
        facts.append(("what is left", words if alone else f"{len(fallen)} of {len(runs)} fall"))
    return facts


def _ratio(value: float) -> str:
    """V / N, which says nothing of a joint that is all but open."""
    return f"{value:.3f}" if value < LOOSE else f"> {LOOSE:g}"


def _counted(moving: list[str], count: int, alone: bool, runs: Any) -> str:
    """How many runs met a mechanism, or when the only one did."""
    if not alone:
        return f"in {len(moving)} of {count} runs"
    if not moving:
        return "none"
    found = runs[moving[0]].mechanism
    return f"{found.kind}, at {found.time:.3f} s"


def _sentence(words: str) -> str:
    """Words with a capital at their beginning and a stop at their end."""
    words = words.strip()
    return words[:1].upper() + words[1:] + ("" if words.endswith(".") else ".")
