"""Report sections on the checks of each run, and on versions, hashes and inputs."""

from hashlib import sha256
from typing import Any

import numpy as np
import xarray as xr

from archfem.cases.case import Case
from archfem.cases.provenance import hash_file
from archfem.cases.report.report_data import ReportData, missing_note
from archfem.dynamics.history import History
from archfem.dynamics.recorder import library_versions
from archfem.masonry.structure import Structure
from archfem.view.pages.document import Grid, Section, TextBlock


def build_check_section(data: ReportData) -> Section:
    """Build the section on predicted error, energy balance and model."""
    blocks: list[Any] = []
    if data.runs:
        head = ["run", "energy from nowhere", "supports bear", "Newton", "halved"]
        head += ["predicted error", "end"]
        rows = [_check_row(data.case, name, run) for name, run in data.runs.items()]
        caption = (
            "Checks of each run; energy relative to the largest exchanged, supports under dead load"
        )
        blocks.append(Grid(head, rows, caption))
    else:
        blocks.append(missing_note("a run to check", "A case with [motion] or [suite] has one."))
    blocks.append(Grid((), _describe_model(data), "Model and mesh"))
    if not any("predicted_error" in run.dataset.attrs for run in data.runs.values()):
        remedy = 'fidelity = "auto" predicts one.'
        blocks.append(missing_note("a predicted error of the model", remedy))
    caption = "Speed against error over fidelities, meshes and steps."
    remedy = "`archfem accuracy CASE.toml --out FOLDER` adds it to the folder."
    what = "a comparison of meshes and steps"
    blocks += data.read_result("accuracy.txt", "accuracy.png", caption, what, remedy)
    caption = "Residual displacement over each property; falls are above the line."
    what = "the range of the verdict"
    remedy = "`archfem verdict CASE.toml --out FOLDER` adds it to the folder."
    blocks += data.read_result("verdict_range.txt", "verdict_range.png", caption, what, remedy)
    return Section("Predicted error, checks and range of the verdict", blocks)


def _check_row(case: Case, name: str, run: History) -> list[str]:
    """Row of the checks of a run."""
    attrs = run.dataset.attrs
    predicted = attrs.get("predicted_error")
    iterations = run.dataset["iterations"].values if "iterations" in run.dataset else np.zeros(0)
    ratio = supported_weight_ratio(case.structure, run.joints.isel(time=0, drop=True))
    return [
        name,
        f"{abs(float(attrs.get('energy_drift', np.nan))):.1e}",
        f"{ratio:.4f} of the weight",
        f"≤ {int(iterations.max())} a record" if len(iterations) else "–",
        f"{int(attrs.get('halved_steps', 0))} steps",
        "–" if predicted is None else f"{float(predicted):.2g} in |e|",
        run.outcome,
    ]


def supported_weight_ratio(structure: Structure, joints: xr.Dataset) -> float:
    """Return the vertical reaction of the supports relative to the weight; 1 in equilibrium [-]."""
    # Force on the higher block of each joint (j, 2).
    force = joints["N"].values[:, None] * structure.normals
    force -= joints["V"].values[:, None] * structure.tangents
    reaction = 0.0
    for (lower, higher), (_, vertical) in zip(structure.pairs, force, strict=True):
        # A support bears the joint's force; a joint between two supports cancels.
        below, above = (structure.blocks[number].fixed for number in (lower, higher))
        reaction += vertical * (int(below) - int(above))
    return float(reaction / structure.weight)


def _describe_model(data: ReportData) -> list[tuple[str, str]]:
    """Describe fidelity, mesh and quadrature."""
    discretisation, rows = data.case.analysis.discretisation, []
    for run in list(data.runs.values())[:1]:  # all runs have the same model
        attrs, unknown = run.dataset.attrs, "unknown"
        rows = [
            ("fidelity of the model", str(attrs.get("fidelity", unknown))),
            ("coordinates", str(run.dataset.sizes.get("coordinate", unknown))),
            ("solver of the steps", str(attrs.get("method", unknown))),
        ]
    if data.case.analysis.selects_model:
        return [*rows, ("mesh", "selected with the fidelity, and not saved in the results")]
    rule = ("quadrature on joints", discretisation.rule.rule)
    if discretisation.fidelity == "rigid":
        return [*rows, ("mesh", "none, for blocks are rigid"), rule]
    through, along = discretisation.cells
    cells = ("cells at least", f"{through} through the thickness, {along} along each block")
    elements = ("elements", f"{discretisation.cell}s of degree {discretisation.degree}")
    return [*rows, cells, elements, rule]


def build_source_section(data: ReportData) -> Section:
    """Build the section on versions, digests of inputs and files, and the case itself."""
    runs = data.runs.items()
    # Usually one line: all runs were computed with the same versions.
    made = sorted({str(run.dataset.attrs.get("versions", "unknown")) for _, run in runs})
    rows = [("computed with", text) for text in made]
    rows.append(("report written with", library_versions()))
    rows += [
        (f"SHA-256 of case, files and program: {name}", str(run.dataset.attrs["inputs"]))
        for name, run in runs
        if "inputs" in run.dataset.attrs
    ]
    rows.append(("SHA-256 of the case", sha256(data.case.text().encode()).hexdigest()))
    blocks: list[Any] = [Grid((), rows)]
    if data.folder is not None:
        table = []
        for name, path in sorted(data.files.items()):
            table.append([name, f"{path.stat().st_size / 1e3:.1f}", hash_file(path)[:16]])
        caption = "Files of the folder that have the inputs of the run"
        blocks.append(Grid(["file", "kB", "SHA-256"], table, caption))
    blocks.append(TextBlock(data.case.text(), "lines"))
    return Section("Versions, hashes and the case as a file", blocks)
