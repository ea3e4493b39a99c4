"""The pictures of runs, suites and motions, written to a folder."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import xarray as xr

from archfem.cases.case import Case
from archfem.dynamics.history import History
from archfem.joints.criteria import judged
from archfem.motion.design_spectra import DesignSpectrum
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite
from archfem.statics.equilibrium import Equilibrium
from archfem.statics.strength import strength_use, use_table
from archfem.view.envelopes import draw_envelope
from archfem.view.freebody import draw_free_body
from archfem.view.joints import draw_joints
from archfem.view.motions import draw_motion, draw_spectra, draw_suite
from archfem.view.stress import draw_stress
from archfem.view.structure import draw_structure
from archfem.view.style import LINES, save


def write_dead(case: Case, dead: Equilibrium, folder: Path) -> list[Path]:
    """Draw the dead load: thrust lines; where there is a mesh, stress; a free body where asked.

    Args:
        case: names the block to be cut free, if any.
        dead: the equilibrium.
        folder: for the files.

    Returns:
        The files, a table of stress by part among them.
    """
    model, structure = dead.model, dead.model.structure
    files = [
        save(draw_structure(structure, dead.joints, criteria=case.criteria), folder / "dead.png")
    ]
    if model.cells.stress is not None:
        files.append(save(draw_stress(model, dead.q), folder / "dead_stress.png"))
        table = folder / "dead_stress.txt"
        table.write_text(use_table(strength_use(model, dead.q)) + "\n", encoding="utf-8")
        files.append(table)
    if "free_body" in case.output:
        body = draw_free_body(structure, dead.joints, case.output["free_body"], cells=model.cells)
        files.append(save(body, folder / "free_body.png"))
    return files


def write_run(case: Case, run: History, dead: Equilibrium, folder: Path) -> list[Path]:
    """Draw a run: its gravest instant, envelope, two joints over time, and film it where asked.

    Args:
        case: tells title, which joints, and whether to film.
        run: what happened.
        dead: the state before.
        folder: for the files.

    Returns:
        The files.
    """
    tilt = abs(judged(run.joints)["eccentricity"])
    worst = tilt.max("time").fillna(0.5)
    chosen = case.joints or [int(worst["joint"][k]) for k in worst.argsort()[::-1][:2]]
    figures = {
        "gravest.png": draw_structure(case.structure, _gravest(run, tilt)),
        "envelope.png": draw_envelope({case.title: run}, dead=dead.joints),
        "joints.png": draw_joints(run, chosen),
    }
    files = [save(figure, folder / name) for name, figure in figures.items()]
    if case.output.get("animation", False):
        from archfem.view.films.scenes import film  # loads pyvista, which is slow

        files.append(film(dead.model, run, folder / "hinges.mp4"))
    return files


def _gravest(run: History, tilt: xr.DataArray) -> xr.Dataset:
    """Return the joints at the first mechanism, or at the largest tilt (time, joint) [-]."""
    if run.mechanism is not None:
        return run.joints.sel(time=run.mechanism.time, method="nearest")
    return run.joints.isel(time=int(tilt.max("joint").argmax("time")))


def write_suite(suite: Suite, target: DesignSpectrum | None, folder: Path) -> list[Path]:
    """Draw the spectra of a suite beside its target."""
    return [save(draw_suite(suite, target), folder / "spectra.png")]


def write_motion(motion: Motion, folder: Path) -> list[Path]:
    """Draw a motion as it is applied, with its integrals."""
    return [save(draw_motion(motion), folder / "motion.png")]


def write_envelopes(runs: Mapping[str, History], dead: Equilibrium, folder: Path) -> list[Path]:
    """Draw the envelopes of all runs in one picture, or six to a picture where there are more."""
    pairs, most = list(runs.items()), len(LINES)
    parts = [dict(pairs[first : first + most]) for first in range(0, len(pairs), most)]
    names = ["envelope.png", *(f"envelope_{number}.png" for number in range(2, len(parts) + 1))]
    return [
        save(draw_envelope(part, dead=dead.joints), folder / name)
        for name, part in zip(names, parts, strict=True)
    ]


def write_motions(motions: Sequence[Motion], folder: Path) -> list[Path]:
    """Draw each motion with its integrals, and the spectra of all.

    Args:
        motions: with names of their own, which the files bear.
        folder: for the files.
    """
    files = [save(draw_motion(motion), folder / f"{motion.name}.png") for motion in motions]
    return [*files, save(draw_spectra(motions), folder / "spectra.png")]


def named_apart(motions: Sequence[Motion], names: Sequence[str]) -> list[Motion]:
    """Give motions the names of their files; where names are the same, with a number behind."""
    named: list[Motion] = []
    for index, (motion, name) in enumerate(zip(motions, names, strict=True)):
        before = list(names[:index]).count(name)
        named.append(replace(motion, name=f"{name} ({before + 1})" if before else name))
    return named
