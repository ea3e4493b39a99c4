"""Dead load with thrust line and stress, modes, and limit analysis."""

from typing import Any

import numpy as np
import xarray as xr

from archfem.cases.dossier.results import Results, not_held
from archfem.joints.criteria import judged
from archfem.units import kN
from archfem.view.pages.document import Grid, Plate, Section, Words
from archfem.view.structure import draw_structure

THRUST = (
    "Thrust line under dead load. It is drawn where the resultant of each joint crosses it; within "
    "the middle third the joint is closed over its whole depth."
)


def rest_sections(results: Results) -> list[Section]:
    """Return the sections on dead load, modes and limit analysis.

    Args:
        results: of which the report is.
    """
    return [
        Section("Dead load", _dead(results)),
        Section("Modes", _modes(results)),
        Section("Limit analysis", _limit(results)),
    ]


def _dead(results: Results) -> list[Any]:
    """Thrust line, table by part, stress."""
    pieces: list[Any] = []
    if results.dead is not None:
        figure = draw_structure(
            results.case.structure, results.dead, criteria=results.case.criteria
        )
        pieces += [Plate.of(figure, THRUST), _by_part(judged(results.dead))]
    elif drawn := results.shown("dead.png", THRUST):
        pieces += drawn
    else:
        pieces.append(not_held("the dead load", "`archfem run CASE.toml --out FOLDER` finds it."))
    if (stress := results.quoted("dead_stress.txt")) is not None:
        pieces += results.shown("dead_stress.png", "Principal compression under dead load.")
        pieces.append(Words(stress, "lines"))
    elif results.case.model.get("fidelity") == "rigid":
        pieces.append(
            not_held(
                "stress in the blocks, for they are rigid",
                'A run with fidelity = "faces" or "full" has it.',
            )
        )
    else:
        pieces.append(
            not_held(
                "stress in the blocks", "A folder that `archfem run` wrote has it, unless rigid."
            )
        )
    pieces += results.shown("free_body.png", "A block cut free: forces on it, and their closing.")
    return pieces


def _by_part(joints: xr.Dataset) -> Grid:
    """What the joints of each part carry at rest."""
    rows = []
    for part in dict.fromkeys(joints["part"].values.astype(str).tolist()):
        own = joints.isel(joint=joints["part"].values.astype(str) == part)
        e, ratio, normal = (own[key].values for key in ("eccentricity", "friction", "N"))
        names = own["name"].values.astype(str)
        worst = int(np.nanargmax(np.abs(e))) if np.isfinite(e).any() else 0
        rows.append(
            [
                part or "–",
                f"{np.nanmax(np.abs(e), initial=0.0):.3f}",
                names[worst],
                f"{np.nanmax(ratio, initial=0.0):.3f}",
                f"{normal.min() / kN:.4g}",
                f"{normal.max() / kN:.4g}",
                str(int(own["open"].sum())),
            ]
        )
    head = ["part", "max |e|", "in", "max V/N", "min N [kN]", "max N [kN]", "open joints"]
    return Grid(head, rows, "Joints of rings and piers under dead load")


def _modes(results: Results) -> list[Any]:
    """Table and shapes, as an earlier command has found them."""
    text = results.quoted("modes.txt")
    if text is None:
        return [
            not_held("modes", "`archfem modes CASE.toml --out FOLDER` adds them to the folder.")
        ]
    shapes = results.shown("modes.png", "Shapes of the modes about dead load.")
    return [Words(text, "lines"), *shapes]


def _limit(results: Results) -> list[Any]:
    """What limit analysis found, where the case asks for it."""
    text = results.quoted("limit.txt")
    if text is None:
        remedy = "A case with a table [limit] asks for it."
        if results.case.limit is not None:
            remedy = "The case asks for it: `archfem run CASE.toml --out FOLDER` finds it."
        return [not_held("limit analysis", remedy)]
    return [
        Words(text, "lines"),
        *results.shown("collapse.png", "The mechanism of limit analysis, over the structure."),
    ]
