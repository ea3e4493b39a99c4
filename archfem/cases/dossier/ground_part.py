"""Motions of the ground as they were applied, and their spectra."""

from typing import Any

from archfem.cases.dossier.results import Results, not_held
from archfem.cases.summary import motion_rows
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite
from archfem.view.motions import draw_motion, draw_spectra, draw_suite
from archfem.view.pages.document import Grid, Plate, Section, Words

AT = "Measures of the motions as applied, read at the steps that the runs recorded."


def ground_section(results: Results) -> Section:
    """Return the section on the motions.

    Args:
        results: of which the report is.
    """
    motions = list(results.grounds.values())
    if not motions:
        asks = results.case.moves
        remedy = "The case asks for none." if not asks else "`archfem run` shakes the structure."
        return Section("Ground motion", [not_held("a motion of the ground", remedy)])
    pieces: list[Any] = [Grid(*motion_rows(motions), AT)]
    if results.case.suite is None:
        pieces += [Plate.of(draw_motion(motion), "Ground motion as applied.") for motion in motions]
    pieces += _spectra(results, motions)
    return Section("Ground motion" if len(motions) == 1 else "Ground motions", pieces)


def _spectra(results: Results, motions: list[Motion]) -> list[Any]:
    """Spectra, beside the target where there is one."""
    case = results.case
    target = case.target
    if case.suite is None:
        figure = Plate.of(draw_spectra(motions), "Response spectra, 5 % damped, as applied.")
        return [figure, not_held("a target spectrum", "A [suite] of motions may have one.")]
    scale, divided = case.suite.get("scale", 1.0), case.suite.get("reduction", 1.0)
    pairs = tuple(motion.scaled(divided / scale) for motion in motions)
    suite = Suite(case.suite.get("name", "suite"), pairs, scale=scale, reduction=divided)
    caption = (
        "Response spectra, 5 % damped, before they are divided by the reduction factor "
        f"R = {divided:g}; motions were applied divided by it."
    )
    found: list[Any] = [Plate.of(draw_suite(suite, target), caption)]
    if target is None:
        found.append(not_held("a target spectrum", "suite.target = { code = …, … } gives one."))
    elif not case.suite.get("matched", False):
        found.append(Words("The motions were not matched to the target: suite.matched = false."))
    return found
