"""Sections of a report: case, dead load, ground motion, response, checks, sources."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from hashlib import sha256
from typing import Any

import numpy as np
import xarray as xr

from archfem.cases import result_text
from archfem.cases.case import Case
from archfem.cases.defaults import describe_defaults, list_default_keys
from archfem.cases.provenance import hash_file
from archfem.cases.report.report_data import (
    ReportData,
    build_live_page,
    build_player,
    missing_note,
)
from archfem.dynamics.collapse_state import CollapseState
from archfem.dynamics.history import SIGN_CONVENTION, History
from archfem.dynamics.recorder import library_versions
from archfem.dynamics.schemes import EffectiveDamping, Rayleigh, interpret_damping
from archfem.dynamics.verdict import Verdict
from archfem.errors import InvalidInput
from archfem.joints.criteria import assessed_joints
from archfem.masonry.materials import Contact, Material
from archfem.masonry.structure import Structure
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite
from archfem.statics.stress import utilisation_text
from archfem.units import MPa, kN
from archfem.view.collapse import draw_fall
from archfem.view.histories import draw_envelopes
from archfem.view.motions import draw_motion, draw_spectra, draw_suite
from archfem.view.pages.document import FigureBlock, Grid, Section, TextBlock
from archfem.view.structure import draw_names, draw_structure


def build_sections(data: ReportData) -> list[Section]:
    """Build all sections of a report."""
    return [
        *build_case_sections(data),
        *build_dead_load_sections(data),
        build_ground_section(data),
        *build_run_sections(data),
        build_check_section(data),
        build_source_section(data),
        *build_live_sections(data),
    ]


def build_case_sections(data: ReportData) -> list[Section]:
    """Build the sections on assumptions, units, signs and geometry."""
    case = data.case
    assumptions = Grid((), _list_assumptions(data), "Assumptions of the analysis")
    signs = [
        ("units", "SI: m, kg, s, N, Pa, where no other unit stands beside a number"),
        ("signs", SIGN_CONVENTION),
        ("e", "eccentricity M / (N h), h the depth of the joint: ±0.5 at its edges"),
        ("V / N", "mobilised friction |V| / N: at its limit μ, with c A / N added, it slides"),
    ]
    return [
        Section("Case and assumptions", [assumptions]),
        Section("Units and signs", [Grid((), signs)]),
        Section("Geometry and materials", _build_geometry(case)),
    ]


def _list_assumptions(data: ReportData) -> list[tuple[str, str]]:
    """List the assumptions of the analysis."""
    case, criteria = data.case, data.case.analysis.failure_criteria
    # Runs record the fidelity that "auto" selected.
    recorded = {str(run.dataset.attrs.get("fidelity", "")) for run in data.runs.values()}
    fidelity = ", ".join(sorted(recorded)) if recorded else case.analysis.discretisation.name
    blocks = {
        "rigid": "rigid; all compliance is in the joints",
        "faces": "elastic; each face of a joint moves as a plane, the rest is condensed statically",
        "condensed": "elastic; all nodes on joints are kept, the rest is condensed statically",
        "full": "elastic finite elements, all nodes kept",
        "monolithic": "elastic finite elements, all nodes kept, weak forms of joints",
    }
    large = case.analysis.discretisation.displacements == "large"
    own_limit = "its own limit, μ + c A / N"
    sliding = own_limit if criteria.friction is None else f"{criteria.friction:g}"
    count = (
        f"{criteria.failures} joints of rings and piers that hinge or slide at once, for "
        f"{criteria.duration:g} s at least"
    )
    dt = case.analysis.dt
    step = "steps of a length that the error chooses" if dt is None else f"steps of {1e3 * dt:g} ms"
    return [
        ("structure", "plane; forces are those of the whole width"),
        ("blocks", blocks.get(fidelity, f"by part: {fidelity}")),
        ("joints", "dry: no tension but where a bond is given; Coulomb friction; no crushing"),
        ("displacements", "of any size" if large else "small: equilibrium where blocks stood"),
        ("ground", "rigid, moves as one; abutments and foundations are fixed to it"),
        ("damping", _describe_damping(case)),
        ("time steps", f"{type(case.analysis.scheme).__name__.lower()} scheme, {step}"),
        ("a joint hinges", f"where |e| ≥ {criteria.hinge:g}"),
        ("a joint slides", f"where |V| / N reaches {sliding}"),
        ("a mechanism by count", count),
        ("defaults", describe_defaults(case) or "none: the case gives all that decides"),
    ]


def _describe_damping(case: Case) -> str:
    """Describe the damping of a case."""
    damping = interpret_damping(case.analysis.damping)
    if damping is None:
        return "none but that of friction"
    ratio, joints = f"{100.0 * damping.ratio:g} % of critical", f"joints {damping.joints}"
    if isinstance(damping, EffectiveDamping):
        return f"{ratio} at the effective modes, {damping.kind}, {joints}"
    if isinstance(damping, Rayleigh):
        low, high = damping.frequencies
        return f"{ratio} at {low:.3g} and {high:.3g} Hz (Rayleigh), {joints}"
    return f"{ratio} at {damping.frequency:.3g} Hz, proportional to stiffness, {joints}"


def _build_geometry(case: Case) -> list[Any]:
    """Build extent, figure with joint names, and tables of parts, materials and contacts."""
    structure = case.structure
    caption = "The structure, and the numbers of the joints that are judged."
    points = np.concatenate([block.drawn() for block in structure.blocks])
    length, height = np.ptp(points, axis=0)
    extent = (
        f"{length:.3g} m long, {height:.3g} m high and {structure.width:g} m wide; "
        f"{len(structure.free)} blocks that can move, weighing {structure.weight / kN:.4g} kN, and "
        f"{len(structure.joints)} joints. Gravity is {structure.gravity:g} m/s²."
    )
    figure = FigureBlock.of(draw_names(structure), caption)
    return [TextBlock(extent), figure, _tabulate_parts(structure), *_tabulate_materials(case)]


def _tabulate_parts(structure: Structure) -> Grid:
    """Tabulate the parts of a structure."""
    rows = []
    for part in dict.fromkeys(block.part for block in structure.blocks):
        blocks = [block for block in structure.blocks if block.part == part]
        free = [block for block in blocks if not block.fixed]
        depths = [joint.depth for joint in structure.joints if joint.part == part]
        weight = structure.width * sum(block.area * block.material.unit_weight for block in free)
        row = [part or "–", blocks[0].role or "–", str(len(blocks)), str(len(blocks) - len(free))]
        row.append(", ".join(dict.fromkeys(block.material.name for block in blocks)))
        row.append(f"{weight / kN:.4g}")
        row.append(f"{min(depths):.3g} – {max(depths):.3g}" if depths else "–")
        rows.append(row)
    head = ["part", "role", "blocks", "of them fixed", "material", "weight [kN]", "joints [m]"]
    return Grid(head, rows, "Parts; the last column is the depth of their joints")


def _tabulate_materials(case: Case) -> list[Grid]:
    """Tabulate the materials of blocks and the contacts of joints, with defaults marked."""
    structure = case.structure

    def mark(item: Material | Contact, key: str, text: str) -> str:
        return f"{text} (default)" if key in list_default_keys(case, item) else text

    materials, contacts = [], []
    for material in dict.fromkeys(block.material for block in structure.blocks):
        row = [material.name, mark(material, "young", f"{material.young / MPa:.6g}")]
        row.append(f"{material.poisson:g}")
        row.append(mark(material, "unit_weight", f"{material.unit_weight / kN:g}"))
        strength = "not known"
        if material.strength is not None:
            strength = mark(material, "strength", f"{material.strength / MPa:g}")
        materials.append([*row, strength])
    for contact in dict.fromkeys(joint.contact for joint in structure.joints):
        row = [contact.name if contact.law is None else f"{contact.name}: {contact.law}"]
        row.append(mark(contact, "normal_stiffness", f"{contact.normal_stiffness / 1e9:.3g}"))
        row.append(mark(contact, "shear_stiffness", f"{contact.shear_stiffness / 1e9:.3g}"))
        friction = mark(contact, "friction", f"{contact.coefficient:g}")
        row.append(friction if contact.slides else "never slides")
        row += [f"{contact.cohesion / 1e3:g}", f"{contact.tension / 1e3:g}"]
        contacts.append([*row, f"{contact.dilatancy:g}"])
    material_head = ["material", "E [MPa]", "ν [–]", "weight [kN/m³]", "strength [MPa]"]
    contact_head = ["contact", "normal [MPa/mm]", "shear [MPa/mm]", "μ [–]", "c [kPa]"]
    contact_head += ["tension [kPa]", "dilatancy [–]"]
    return [Grid(material_head, materials, "Blocks"), Grid(contact_head, contacts, "Joints")]


def build_dead_load_sections(data: ReportData) -> list[Section]:
    """Build the sections on dead load, modes, limit analysis, rating and assessment."""
    caption = "Shapes of the modes about dead load."
    remedy = "`archfem modes CASE.toml --out FOLDER` adds them to the folder."
    modes = data.read_result("modes.txt", "modes.png", caption, "modes", remedy)
    remedy = "A case with a load in its table [limit] includes it."
    if data.case.limit is not None and data.case.limit.live:
        remedy = "The case includes it: `archfem limit CASE.toml --out FOLDER` finds it."
    caption = "Thrust line at collapse, and the mechanism of limit analysis over the structure."
    limit = data.read_result("limit.txt", "collapse.png", caption, "limit analysis", remedy)
    remedy = "`archfem rate CASE.toml --vehicle LM1 --out FOLDER` adds it to the folder."
    caption = "Factor along the bridge, and mechanism at the worst place."
    rating = data.read_result("rating.txt", "rating.png", caption, "a rating", remedy)
    return [
        Section("Dead load", _build_dead_load(data)),
        Section("Modes", modes),
        Section("Limit analysis", limit),
        Section("Rating for a vehicle", rating),
        Section("Kinematic assessment", _build_assessment(data)),
    ]


def _build_dead_load(data: ReportData) -> list[Any]:
    """Build thrust line, table by part, stress and free body."""
    case, blocks = data.case, list[Any]()
    thrust = (
        "Thrust line under dead load. It is drawn where the resultant of each joint crosses it; "
        "within the middle third the joint is closed over its whole depth."
    )
    if data.dead is not None:
        figure = draw_structure(case.structure, data.dead, criteria=case.analysis.failure_criteria)
        blocks += [FigureBlock.of(figure, thrust), _tabulate_dead_load(assessed_joints(data.dead))]
    elif drawn := data.read_figure("dead.png", thrust):
        blocks += drawn
    else:
        remedy = "`archfem run CASE.toml --out FOLDER` finds it."
        blocks.append(missing_note("the dead load", remedy))
    if (stress := data.read_text("dead_stress.txt")) is not None:
        blocks += data.read_figure("dead_stress.png", "Principal compression under dead load.")
        blocks.append(TextBlock(stress, "lines"))
    elif case.analysis.fidelity == "rigid":
        remedy = 'A run with fidelity = "faces" or "full" has it.'
        blocks.append(missing_note("stress in the blocks, for they are rigid", remedy))
    else:
        remedy = "A folder that `archfem run` wrote has it, unless rigid."
        blocks.append(missing_note("stress in the blocks", remedy))
    caption = "A block cut free: forces on it, and their closing."
    return blocks + data.read_figure("free_body.png", caption)


def _tabulate_dead_load(joints: xr.Dataset) -> Grid:
    """Tabulate the extremes of the joints of each part under dead load."""
    rows, part_of_joint = [], joints["part"].values.astype(str)
    for part in dict.fromkeys(part_of_joint.tolist()):
        selected = joints.isel(joint=part_of_joint == part)
        e, ratio, normal = (selected[key].values for key in ("eccentricity", "friction", "N"))
        names = selected["name"].values.astype(str)
        # e is undefined where a joint is open.
        largest = int(np.nanargmax(np.abs(e))) if np.isfinite(e).any() else 0
        row = [part or "–", f"{np.nanmax(np.abs(e), initial=0.0):.3f}", names[largest]]
        row.append(f"{np.nanmax(ratio, initial=0.0):.3f}")
        row += [f"{normal.min() / kN:.4g}", f"{normal.max() / kN:.4g}"]
        rows.append([*row, str(int(selected["open"].sum()))])
    head = ["part", "max |e|", "in", "max V/N", "min N [kN]", "max N [kN]", "open joints"]
    return Grid(head, rows, "Joints of rings and piers under dead load")


def _build_assessment(data: ReportData) -> list[Any]:
    """Build text and pictures of kinematic assessments from the files of the folder."""
    text = data.read_text("assessment.txt")
    if text is None:
        remedy = "`archfem assess CASE.toml --out FOLDER` adds it to the folder."
        return [missing_note("a kinematic assessment", remedy)]
    caption = "Mechanism at the displacement capacity, and capacity curve with demand."
    names = sorted(name for name in data.files if name.startswith("assessment_"))
    figures = [figure for name in names for figure in data.read_figure(name, caption)]
    return [TextBlock(text, "lines"), *figures]


def build_ground_section(data: ReportData) -> Section:
    """Build the section on ground motions and spectra."""
    motions = list(data.motions.values())
    if not motions:
        shaken = data.case.has_motion
        remedy = "`archfem run` shakes the structure." if shaken else "The case has none."
        return Section("Ground motion", [missing_note("a motion of the ground", remedy)])
    caption = "Measures of the motions as applied, read at the steps that the runs recorded."
    blocks: list[Any] = [Grid(*result_text.tabulate_motions(motions), caption)]
    if data.case.suite is None:
        applied = "Ground motion as applied."
        blocks += [FigureBlock.of(draw_motion(motion), applied) for motion in motions]
    blocks += _build_spectra(data.case, motions)
    return Section("Ground motion" if len(motions) == 1 else "Ground motions", blocks)


def _build_spectra(case: Case, motions: list[Motion]) -> list[Any]:
    """Build the response spectra, beside the target spectrum if there is one."""
    if case.suite is None:
        caption = "Response spectra, 5 % damped, as applied."
        figure = FigureBlock.of(draw_spectra(motions), caption)
        return [figure, missing_note("a target spectrum", "A [suite] of motions may have one.")]
    scale, reduction = case.suite.get("scale", 1.0), case.suite.get("reduction", 1.0)
    # The suite multiplies by scale and divides by R; recorded motions are as applied.
    pairs = tuple(motion.scaled(reduction / scale) for motion in motions)
    suite = Suite(case.suite.get("name", "suite"), pairs, scale=scale, reduction=reduction)
    caption = (
        "Response spectra, 5 % damped, before they are divided by the reduction factor "
        f"R = {reduction:g}; motions were applied divided by it."
    )
    blocks: list[Any] = [FigureBlock.of(draw_suite(suite, case.target), caption)]
    if case.target is None:
        remedy = "suite.target = { code = …, … } gives one."
        blocks.append(missing_note("a target spectrum", remedy))
    elif not case.suite.get("matched", False):
        text = "The motions were not matched to the target: suite.matched = false."
        blocks.append(TextBlock(text))
    return blocks


def build_run_sections(data: ReportData) -> list[Section]:
    """Build the sections on the response of one run, or of all pairs and of each."""
    remedy = "`archfem run` again runs the pairs that are left."
    missing = [missing_note(f"runs of {', '.join(data.missing)}", remedy)] if data.missing else []
    if not data.runs:
        none = [missing_note("a run", "A case with [motion] or [suite] has one.")]
        return [Section("Response", missing or none)]
    if data.case.suite is None:
        (name,) = data.runs
        return [
            Section("Response", _build_response(data, name, 1)),
            Section("Mechanism and collapse", _build_mechanism(data.runs[name])),
        ]
    sections = [
        Section("Response: all pairs", [*_build_suite_response(data), *missing]),
        Section("Response: pair by pair", []),
    ]
    for name, run in data.runs.items():
        blocks = [*_build_response(data, name, len(data.runs)), *_build_mechanism(run)]
        sections.append(Section(name, blocks, level=3))
    return sections


def _build_response(data: ReportData, name: str, players: int) -> list[Any]:
    """Build player, envelope, criteria per joint and use of strength of one run."""
    case, run = data.case, data.runs[name]
    title = case.title if case.suite is None else f"{case.title}: {name}"
    blocks: list[Any] = []
    if not run.ending.is_complete:
        blocks.append(TextBlock(f"The run is not complete: {run.outcome}.", "doubt"))
    blocks.append(build_player(case, run, title, players))
    if case.suite is None:
        blocks += _build_envelopes(data)
    table = result_text.tabulate_joints(run.joints, data.dead)
    blocks.append(_shorten_joint_table(table, run.verdict.assessed))
    blocks.append(TextBlock(_sentence(utilisation_text(case.structure, run.joints))))
    return blocks


def _build_envelopes(data: ReportData) -> list[FigureBlock]:
    """Draw the envelopes of all runs."""
    caption = "Least and largest eccentricity of each joint; dotted under dead load."
    return [FigureBlock.of(figure, caption) for figure in draw_envelopes(data.runs, data.dead)]


def _shorten_joint_table(table: result_text.ResultTable, assessed: str) -> Grid:
    """Return the table of joints without empty columns; the caption names these, and the joints."""
    head, rows = table
    # Most joints neither slide nor open in most runs.
    filled = [k for k in range(len(head)) if any(row[k] != "-" for row in rows)]
    empty = {title.split()[0] for k, title in enumerate(head) if k not in filled}
    notes = {"hinge": "No joint hinged.", "slide": "No joint slid.", "open": "None came apart."}
    caption = (
        "Criteria per joint: eccentricity under dead load, least and largest, largest V / N, and "
        "when and how long at most the joint hinged, slid and was open."
    )
    caption = " ".join([caption, *(note for flag, note in notes.items() if flag in empty)])
    caption += f" {_sentence(assessed)}" if assessed else ""
    return Grid([head[k] for k in filled], [[row[k] for k in filled] for row in rows], caption)


def _build_mechanism(run: History) -> list[Any]:
    """Build the verdict, and the fall of a run with large displacements."""
    lines = str(_without_lost(run.verdict)).splitlines()
    if run.fall is not None and run.fall.blocks:
        lines.insert(1, f"lost: {_describe_lost(run.fall, len(run.fall.blocks))}")
    blocks: list[Any] = [TextBlock(_sentence(line)) for line in lines]
    if run.fall is None:
        what = "what happens after blocks come loose, for displacements were taken as small"
        blocks.append(missing_note(what, 'model.displacements = "large" follows them.'))
    elif "fall_pose" in run.dataset:
        caption = "Blocks on their way to the ground, over where they stood."
        blocks.append(FigureBlock.of(draw_fall(run), caption))
    return blocks


def _build_suite_response(data: ReportData) -> list[Any]:
    """Build the tables of all runs, and their envelopes."""
    (head, rows), columns = result_text.tabulate_runs(data.runs), len(result_text.RUN_COLUMNS)
    # The mechanisms have too many columns for a page: a line of text for each run instead.
    mechanisms = []
    for row in rows:
        cells = zip(head[columns:], row[columns:], strict=True)
        named = (f"{title}: {cell}" for title, cell in cells if cell != "-")
        mechanisms.append((row[0], "; ".join(named)))
    caption = "Outcome, PGA, and the critical joint of each run"
    return [
        Grid(head[:columns], [row[:columns] for row in rows[:-1]], caption),
        Grid([], mechanisms, "Mechanism and end of each run"),
        *_build_envelopes(data),
    ]


def list_facts(data: ReportData) -> list[tuple[str, str]]:
    """List the principal results by name, which the report shows first."""
    runs, structure = list(data.runs.values()), data.case.structure
    blocks = [("structure", f"{len(structure.free)} blocks, {len(structure.joints)} joints")]
    blocks += [("joints", structure.assessment)] if structure.assessment else []
    if not runs:
        return [*blocks, ("runs", "none")]
    facts = [*_verdict_facts(runs), *blocks]
    # Files of older versions have the acceleration at their steps alone.
    pga = max(
        run.dataset.attrs.get("pga", float(np.abs(run.dataset["ground"].values[:, 0]).max()))
        for run in runs
    )
    joints = [assessed_joints(run.joints) for run in runs]
    eccentricity = max(float(abs(each["eccentricity"]).max()) for each in joints)
    opened = " (joints came apart)" if any(bool(each["open"].any()) for each in joints) else ""
    friction = max(float(each["friction"].max()) for each in joints)
    sizes = [("PGA", f"{pga:.2f} m/s²"), ("largest |e|", f"{eccentricity:.3f}{opened}")]
    return [*facts, *sizes, ("largest V / N", result_text.format_ratio(friction))]


def _verdict_facts(runs: Sequence[History]) -> list[tuple[str, str]]:
    """Return outcome and doubts of a run, or how many of several runs have each."""
    verdicts = [run.verdict for run in runs]
    if len(verdicts) == 1:
        verdict, fall = verdicts[0], verdicts[0].fall
        facts = [("verdict", _without_lost(verdict).headline)]
        facts += [("lost", _describe_lost(fall))] if fall is not None and fall.blocks else []
        return [*facts, *(("in doubt", str(doubt)) for doubt in verdict.doubts)]
    facts = [("verdict", result_text.describe_verdicts(runs))]
    reasons = Counter(str(doubt) for verdict in verdicts for doubt in verdict.doubts)
    facts += [
        ("in doubt", f"{count} of {len(verdicts)} runs: {text}") for text, count in reasons.items()
    ]
    for name in verdicts[0].mechanisms:
        met = sum(verdict.mechanisms.get(name) is not None for verdict in verdicts)
        facts.append((f"mechanism by {name}", f"{met} of {len(verdicts)} runs"))
    return facts


def _without_lost(verdict: Verdict) -> Verdict:
    """Return a verdict that does not list the lost blocks."""
    fall = verdict.fall
    return verdict if fall is None else replace(verdict, fall=replace(fall, time=None))


def _describe_lost(fall: CollapseState, max_names: int = 3) -> str:
    """Return the number of lost blocks, the time of the first, and the first names."""
    names = ", ".join([*fall.blocks[:max_names], *(["…"] if fall.blocks[max_names:] else [])])
    return f"{len(fall.blocks)} blocks, the first at {fall.time:.2f} s: {names}"


def _sentence(text: str) -> str:
    """Return a text with a capital at its beginning and a full stop at its end."""
    text = text.strip()
    return text[:1].upper() + text[1:] + ("" if text.endswith(".") else ".")


def build_check_section(data: ReportData) -> Section:
    """Build the section on predicted error, energy balance and model."""
    blocks: list[Any] = [TextBlock(data.deleted, "missing")] if data.deleted else []
    if data.runs:
        head = ["run", "energy drift", "support reaction", "Newton iterations", "halved steps"]
        head += ["predicted error", "end"]
        rows = [_check_row(data.case, name, run) for name, run in data.runs.items()]
        caption = (
            "Checks of each run: energy drift relative to the largest energy exchanged, reaction "
            "of the supports under dead load, and most Newton iterations between two records"
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
        f"≤ {int(iterations.max())}" if len(iterations) else "–",
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


def build_live_sections(data: ReportData) -> list[Section]:
    """Build the section with the arch to shake, where stones are rigid and no fill acts."""
    try:
        live = build_live_page(data)
    except InvalidInput:
        return []
    text = (
        "Change the arch, and shake it: rigid stones fall to the ground. `archfem page FOLDER` "
        "writes this as a page of its own."
    )
    return [Section("Try it", [TextBlock(text), live])]


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
