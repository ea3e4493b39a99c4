"""Files of what was found: tables and pictures, in a folder."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import xarray as xr

from archfem.cases.case import Case
from archfem.cases.run import Rest, Run
from archfem.dynamics.history import History
from archfem.dynamics.tradeoff import Accuracy
from archfem.files import in_one_stroke
from archfem.joints.criteria import judged
from archfem.limit.collapse import Collapse
from archfem.motion.design_spectra import DesignSpectrum
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite
from archfem.statics.modes import Modes
from archfem.statics.strength import use_table
from archfem.view.accuracy import draw_accuracy
from archfem.view.collapse import draw_collapse
from archfem.view.dead import draw_dead_load
from archfem.view.displaced import draw_during
from archfem.view.envelopes import draw_envelope
from archfem.view.falls import draw_fall
from archfem.view.freebody import draw_free_body
from archfem.view.joints import draw_joints, telling_joints
from archfem.view.modes import draw_modes
from archfem.view.motions import draw_motion, draw_spectra, draw_suite
from archfem.view.names import draw_names
from archfem.view.stress import draw_stress
from archfem.view.style import LINES, save

SUMMARY = "summary.txt"
"""Table of a run; it is written last, and so tells that the other files of the run are there."""


def write_limit(case: Case, found: Collapse, text: str, folder: Path) -> list[Path]:
    """Write what limit analysis found, and draw the mechanism over the structure.

    Args:
        case: what was asked.
        found: what limit analysis found.
        text: the same in words.
        folder: for the files.

    Returns:
        The files.
    """
    figure = draw_collapse(case.structure, found)
    return [_write(text, folder / "limit.txt"), save(figure, folder / "collapse.png")]


def write_dead(rest: Rest, folder: Path) -> list[Path]:
    """Draw names of joints, thrust lines of the dead load, stress on a mesh, a free body if asked.

    Args:
        rest: a case, which names the block to be cut free, if any, and its dead load.
        folder: for the files.

    Returns:
        The files, a table of stress by part among them.
    """
    case, dead, model, structure = rest.case, rest.dead, rest.dead.model, rest.case.structure
    files = [
        save(draw_dead_load(dead, criteria=case.criteria), folder / "dead.png"),
        save(draw_names(structure), folder / "names.png"),
    ]
    if rest.use is not None:
        files.append(save(draw_stress(model, dead), folder / "dead_stress.png"))
        files.append(_write(use_table(rest.use), folder / "dead_stress.txt"))
    if "free_body" in case.output:
        body = draw_free_body(structure, dead.joints, case.output["free_body"], cells=model.cells)
        files.append(save(body, folder / "free_body.png"))
    return files


def write_run(done: Run, rest: Rest, text: str, folder: Path) -> list[Path]:
    """Draw a run: its gravest instant, envelope, two joints over time, its fall; film it if asked.

    Args:
        done: a case, which tells title, which joints, and whether to film, and what happened.
        rest: the state before.
        text: table of the joints.
        folder: for the files.

    Returns:
        The files, the table of joints last.
    """
    case, run, dead = done.case, done.history, rest.dead
    tilt = abs(judged(run.joints)["eccentricity"])
    chosen = case.joints or telling_joints(run)
    figures = {
        "gravest.png": draw_during(dead.model, run, _gravest(run, tilt)),
        "envelope.png": draw_envelope({case.title: run}, dead=dead.joints),
        "joints.png": draw_joints(run, chosen),
    }
    if "fall_pose" in run.dataset:
        figures["fall.png"] = draw_fall(run)
    files = write_motion(done.motion, folder) if case.suite is not None else []
    files += [save(figure, folder / name) for name, figure in figures.items()]
    if case.output.get("animation", False):
        from archfem.view.films.scenes import film  # loads the encoder

        files.append(film(dead.model, run, folder / "hinges.mp4"))
    return [*files, _write(text, folder / SUMMARY)]


def is_written(done: Run) -> bool:
    """Return whether the files of a run are there already, and not older than its history.

    Args:
        done: a run that was kept in a file.
    """
    if done.path is None or not (summary := done.path.with_name(SUMMARY)).is_file():
        return False
    return summary.stat().st_mtime_ns >= done.path.stat().st_mtime_ns


def _gravest(run: History, tilt: xr.DataArray) -> xr.Dataset:
    """Return the joints at the first mechanism, or at the largest tilt (time, joint) [-]."""
    if run.mechanism is not None:
        return run.joints.sel(time=run.mechanism.time, method="nearest")
    return run.joints.isel(time=int(tilt.max("joint").argmax("time")))


def write_suite(suite: Suite, target: DesignSpectrum | None, folder: Path) -> list[Path]:
    """Draw the spectra of a suite beside its target.

    Args:
        suite: the motions.
        target: spectrum they were matched to, if any.
        folder: for the files.

    Returns:
        The files.
    """
    return [save(draw_suite(suite, target), folder / "spectra.png")]


def write_motion(motion: Motion, folder: Path) -> list[Path]:
    """Draw a motion as it is applied, with its integrals.

    Args:
        motion: of the ground.
        folder: for the files.

    Returns:
        The files.
    """
    return [save(draw_motion(motion), folder / "motion.png")]


def write_pairs(runs: Mapping[str, History], rest: Rest, text: str, folder: Path) -> list[Path]:
    """Write the table of a suite, and draw the envelopes of its runs, at most six to a picture.

    Args:
        runs: what to call each run, and the run.
        rest: the state before.
        text: table of the runs.
        folder: for the files.

    Returns:
        The files.
    """
    pairs, most = list(runs.items()), len(LINES)
    parts = [dict(pairs[first : first + most]) for first in range(0, len(pairs), most)]
    names = ["envelope.png", *(f"envelope_{number}.png" for number in range(2, len(parts) + 1))]
    files = [
        save(draw_envelope(part, dead=rest.dead.joints), folder / name)
        for name, part in zip(names, parts, strict=True)
    ]
    return [_write(text, folder / "suite.txt"), *files]


def write_modes(found: Modes, text: str, folder: Path) -> list[Path]:
    """Write the table of modes, and draw their shapes.

    Args:
        found: the modes.
        text: table of them.
        folder: for the files.

    Returns:
        The files.
    """
    return [_write(text, folder / "modes.txt"), save(draw_modes(found), folder / "modes.png")]


def write_accuracy(found: Accuracy, text: str, folder: Path) -> list[Path]:
    """Write and draw speed against error.

    Args:
        found: as by `archfem.accuracy`.
        text: table of it.
        folder: for the files.

    Returns:
        The files.
    """
    return [
        _write(text, folder / "accuracy.txt"),
        save(draw_accuracy(found), folder / "accuracy.png"),
    ]


def write_motions(motions: Sequence[Motion], folder: Path) -> list[Path]:
    """Draw each motion with its integrals, and the spectra of all.

    Args:
        motions: with names of their own, which the files bear.
        folder: for the files.

    Returns:
        The files.
    """
    files = [save(draw_motion(motion), folder / f"{motion.name}.png") for motion in motions]
    return [*files, save(draw_spectra(motions), folder / "spectra.png")]


def named_apart(motions: Sequence[Motion], names: Sequence[str]) -> list[Motion]:
    """Return motions with the names of their files; where names are the same, with a number behind.

    Args:
        motions: as read.
        names: of their files, as many.
    """
    named: list[Motion] = []
    for index, (motion, name) in enumerate(zip(motions, names, strict=True)):
        before = list(names[:index]).count(name)
        named.append(replace(motion, name=f"{name} ({before + 1})" if before else name))
    return named


def _write(text: str, path: Path) -> Path:
    """Write lines of text in one stroke."""
    with in_one_stroke(path) as draft:
        draft.write_text(text + "\n", encoding="utf-8")
    return path
