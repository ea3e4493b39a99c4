"""Predicted error of the model, checks of the run, and what it was computed with."""

from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from archfem.cases.case import Case
from archfem.cases.dossier.results import Results, not_held
from archfem.dynamics.history import History
from archfem.dynamics.recorder import versions
from archfem.masonry.structure import Structure
from archfem.view.pages.document import Grid, Section, Words

DRIFT, BALANCE = 0.01, 0.01
"""Energy from nowhere, relative to what was exchanged, and weight that supports do not bear, beyond
which a report says that something is to be looked at. Arcs that are meshed as chords make a ring of
17 voussoirs 0.3 % lighter."""

HEAD = ["run", "energy from nowhere", "supports bear", "Newton", "halved", "predicted error", "end"]


def check_section(results: Results) -> Section:
    """Return the section on how far the results can be trusted.

    Args:
        results: of which the report is.
    """
    pieces: list[Any] = []
    if results.runs:
        rows = [_checked(results.case, name, run) for name, run in results.runs.items()]
        about = (
            "Checks of each run; energy relative to the largest exchanged, supports under dead load"
        )
        pieces += [Grid(HEAD, rows, about), *_doubts(results)]
    else:
        pieces.append(not_held("a run to check", "A case with [motion] or [suite] has one."))
    pieces.append(Grid((), _mesh(results), "Model and mesh"))
    if not any("predicted_error" in run.dataset.attrs for run in results.runs.values()):
        pieces.append(not_held("a predicted error of the model", 'fidelity = "auto" predicts one.'))
    if (text := results.quoted("accuracy.txt")) is not None:
        pieces.append(Words(text, "lines"))
        pieces += results.shown("accuracy.png", "Speed against error over rungs, meshes and steps.")
    else:
        remedy = "`archfem accuracy CASE.toml --out FOLDER` adds it to the folder."
        pieces.append(not_held("a comparison of meshes and steps", remedy))
    return Section("Predicted error and checks", pieces)


def _checked(case: Case, name: str, run: History) -> list[str]:
    """A row of the checks."""
    told = run.dataset.attrs
    predicted = told.get("predicted_error")
    iterations = run.dataset["iterations"].values if "iterations" in run.dataset else np.zeros(0)
    return [
        name,
        f"{abs(float(told.get('energy_drift', np.nan))):.1e}",
        f"{borne_share(case.structure, run.joints.isel(time=0, drop=True)):.4f} of the weight",
        f"≤ {int(iterations.max())} a record" if len(iterations) else "–",
        f"{int(told.get('halved_steps', 0))} steps",
        "–" if predicted is None else f"{float(predicted):.2g} in |e|",
        f"{run.outcome}",
    ]


def borne_share(structure: Structure, joints: xr.Dataset) -> float:
    """Return which share of the weight the supports bear upwards [-]; 1 in equilibrium.

    Args:
        structure: at rest.
        joints: of it, under dead load.
    """
    force = joints["N"].values[:, None] * structure.normals
    force -= joints["V"].values[:, None] * structure.tangents  # on the higher block
    borne = 0.0
    for (lower, higher), (_, up) in zip(structure.pairs, force, strict=True):
        below, above = (structure.blocks[number].fixed for number in (lower, higher))
        borne += up * (int(below) - int(above))
    return float(borne / structure.weight)


def _doubts(results: Results) -> list[Words]:
    """What is to be looked at."""
    found = []
    for name, run in results.runs.items():
        drift = abs(float(run.dataset.attrs.get("energy_drift", 0.0)))
        share = borne_share(results.case.structure, run.joints.isel(time=0, drop=True))
        if not drift <= DRIFT:
            found.append(
                f"{name}: {drift:.1%} of the energy exchanged came from nowhere, or went nowhere: "
                "try shorter steps."
            )
        if not abs(share - 1.0) <= BALANCE:
            found.append(
                f"{name}: at its start the supports bear {share:.4f} of the weight: it did not "
                "start at rest under dead load, or its mesh leaves too much out."
            )
        if not run.ended.by_itself:
            found.append(f"{name}: {run.outcome}.")
    return [Words(each, "doubt") for each in found]


def _mesh(results: Results) -> list[tuple[str, str]]:
    """What the structure was modelled by."""
    asked, rows = results.case.discretisation, []
    for run in results.runs.values():
        told = run.dataset.attrs
        rows = [
            ("rung of the model", str(told.get("fidelity", "not told"))),
            ("coordinates", str(run.dataset.sizes.get("coordinate", "not told"))),
            ("stepper", str(told.get("method", "not told"))),
        ]
        break
    if results.case.chooses:
        return [*rows, ("mesh", "chosen with the rung, and not kept in the results")]
    if asked.fidelity == "rigid":
        return [*rows, ("mesh", "none, for blocks are rigid"), ("rule on joints", asked.rule.rule)]
    through, along = asked.cells
    return [
        *rows,
        ("cells at least", f"{through} through the thickness, {along} along each block"),
        ("elements", f"{asked.cell}s of degree {asked.degree}"),
        ("rule on joints", asked.rule.rule),
    ]


def source_section(results: Results) -> Section:
    """Return the section on what the results were computed with, and from what.

    Args:
        results: of which the report is.
    """
    made = sorted(
        {str(run.dataset.attrs.get("versions", "not told")) for run in results.runs.values()}
    )
    rows = [("computed with", words) for words in made]
    rows.append(("report written with", versions()))
    rows += [
        (f"SHA-256 of case, files and program: {name}", str(run.dataset.attrs["inputs"]))
        for name, run in results.runs.items()
        if "inputs" in run.dataset.attrs
    ]
    rows.append(("SHA-256 of the case", digest(results.case.text().encode())))
    pieces: list[Any] = [Grid((), rows)]
    pieces += [
        Words(
            f"{name}: the run carries another case than that of this report; its SHA-256 is "
            f"{digest(str(run.dataset.attrs['case']).encode())}. Run the case again.",
            "doubt",
        )
        for name, run in results.runs.items()
        if "case" in run.dataset.attrs and run.dataset.attrs["case"] != own_text(results, name)
    ]
    if results.folder is not None:
        files = sorted(path for path in results.folder.rglob("*") if path.is_file() and _told(path))
        listed = [
            [str(path.relative_to(results.folder)), f"{path.stat().st_size / 1e3:.1f}", _hash(path)]
            for path in files
        ]
        pieces.append(
            Grid(["file", "kB", "SHA-256"], listed, "Files that the report was written from")
        )
    pieces.append(Words(results.case.text(), "lines"))
    return Section("Versions, hashes and the case as a file", pieces)


def own_text(results: Results, name: str) -> str:
    """Return the case of one run as text: of a suite, with its own pair alone.

    Args:
        results: of which the report is.
        name: of the run.
    """
    case = results.case
    return case.text() if case.suite is None else case.alone(name).text()


def digest(content: bytes) -> str:
    """Return the SHA-256 of some bytes.

    Args:
        content: the bytes.
    """
    return sha256(content).hexdigest()


def _told(path: Path) -> bool:
    """Whether a file is one that reports are written from."""
    return path.suffix in (".nc", ".toml", ".txt") or path.name in (
        "dead.png", "dead_stress.png", "free_body.png", "modes.png", "collapse.png", "accuracy.png",
    )  # fmt: skip


def _hash(path: Path) -> str:
    """The beginning of a file's SHA-256, which tells it from any other."""
    with path.open("rb") as opened:
        hashed = sha256()
        while piece := opened.read(1 << 20):
            hashed.update(piece)
    return hashed.hexdigest()[:16]
