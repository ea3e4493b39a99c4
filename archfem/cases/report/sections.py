"""Sections of a report: inputs, dead load, ground motion, response, checks, methods, sources."""

from collections import Counter
from collections.abc import Sequence
from csv import reader
from dataclasses import replace
from hashlib import sha256
from typing import Any

import numpy as np
import xarray as xr

from archfem.cases import result_text
from archfem.cases.case import Case
from archfem.cases.report.conclusion import (
    build_conclusion,
    describe_lost,
    describe_mechanism,
    list_elastic_fill,
    list_varied,
    sentence,
    summarise_outcomes,
)
from archfem.cases.report.inputs import describe_value, tabulate_inputs
from archfem.cases.report.report_data import (
    ReportData,
    build_live_page,
    build_player,
)
from archfem.cases.run import DRAWING_FILE
from archfem.dynamics.history import SIGN_CONVENTION, History
from archfem.dynamics.recorder import library_versions
from archfem.errors import InvalidInput
from archfem.joints.criteria import assessed_joints
from archfem.masonry.joint_closing import describe_closing
from archfem.masonry.structure import Structure
from archfem.motion.matching import DEFAULT_BAND
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite
from archfem.statics.assessment_checks import LIMIT_STATES, LimitState
from archfem.statics.stress import utilisation_text
from archfem.units import MPa, kN
from archfem.view.collapse import draw_fall
from archfem.view.histories import draw_envelopes
from archfem.view.motions import draw_motion, draw_spectra, draw_suite
from archfem.view.pages.document import FigureBlock, Grid, Section, TextBlock
from archfem.view.structure import draw_names, draw_structure

# Failed joints that each definition of a mechanism needs, in the number of the criteria
_DEFINITIONS = {
    "any joints at once": "of any rings and piers together",
    "one part at once": "of one ring or one pier",
    "ring and pier at once": "of a ring and a pier together",
    "one part over the record": "of one ring or one pier, each from its first failure on",
    "verified": "that permit a motion of the blocks",
    "Demirel and Aldemir": "of one ring, as worded in Buildings 11 (2021)",
}

# Of figure and table, with the file of the figure
_RISK_CAPTIONS = (
    "(a) Probability of a fall by intensity with its band, (b) hazard of the site, and (c) share "
    "of the rate by intensity; the rest lies above.",
    "risk.png",
    "Annual rate of collapse, and that of each alternative, with intervals of the samples alone: "
    "hazard and model are outside of them",
)

_PLAYER_CAPTION = "The structure at an instant, the ground acceleration, and one joint."

# References of the methods, with the file of the result that was made by each
_METHODS = (
    ("", "joints, criteria", "Demirel and Aldemir, Buildings 11 (2021)"),
    ("", "mechanisms", "Heyman, Int. J. Solids Struct. 2 (1966) 249-279"),
    ("limit.txt", "limit analysis", "Livesley, Int. J. Numer. Meth. Eng. 12 (1978) 1853-1871"),
    ("pushover.txt", "pushover", "Riks, Int. J. Solids Struct. 15 (1979) 529-551"),
    ("rating.txt", "rating", "Heyman, The Masonry Arch, Ellis Horwood (1982)"),
    ("assessment.txt", "assessment", "NTC 2018, with its Circolare 7/2019, C8.7.1.2"),
    ("verdict_range.txt", "range", "Clopper and Pearson, Biometrika 26 (1934) 404-413"),
    ("risk.txt", "annual rate of collapse", "Cornell et al., J. Struct. Eng. 128 (2002) 526-533"),
)


def build_sections(data: ReportData) -> list[Section]:
    """Build all sections of a report; those without any result are left out."""
    sections = [
        build_conclusion(data),
        build_input_section(data),
        Section("Structure", [*_build_geometry(data.case), *_describe_drawing(data)]),
        *build_dead_load_sections(data),
        build_ground_section(data),
        *build_run_sections(data),
        Section("Scale of the motion", data.read_result("scale", "")),
        Section("Annual rate of collapse", data.read_result("risk", *_RISK_CAPTIONS)),
        build_check_section(data),
        build_joint_section(data),
        build_method_section(data),
        build_source_section(data),
        *build_live_sections(data),
    ]
    # a heading of subsections has no pieces of its own
    followed = [*(section.level for section in sections[1:]), 2]
    kept = [s for s, level in zip(sections, followed, strict=True) if s.pieces or level > s.level]
    return number_captions(kept)


def number_captions(sections: Sequence[Section]) -> list[Section]:
    """Return sections whose figures and tables with captions are numbered through."""
    counts: Counter[str] = Counter()

    def number(piece: Any) -> Any:
        word = "Figure" if piece.kind in ("plate", "player") else "Table"
        caption = _PLAYER_CAPTION if piece.kind == "player" else getattr(piece, "caption", "")
        if not caption:
            return piece
        counts[word] += 1
        return replace(piece, caption=f"{word} {counts[word]}. {sentence(caption)}")

    return [replace(each, pieces=[number(piece) for piece in each.pieces]) for each in sections]


def build_input_section(data: ReportData) -> Section:
    """Build the section on inputs, assumptions, units and signs."""
    fidelity = data.fidelity
    blocks = {
        "rigid": "rigid; all compliance is in the joints",
        "faces": "elastic; each face of a joint moves as a plane, the rest is condensed statically",
        "condensed": "elastic; all nodes on joints are kept, the rest is condensed statically",
        "full": "elastic finite elements, all nodes kept",
        "monolithic": "elastic finite elements, all nodes kept, weak forms of joints",
    }
    large = data.case.analysis.discretisation.displacements == "large"
    assumptions = [
        ("structure", "plane; forces are those of the whole width"),
        ("blocks", "rigid" if data.is_static else blocks.get(fidelity, f"by part: {fidelity}")),
        ("joints", _describe_joints(data)),
        ("displacements", "of any size" if large else "small: equilibrium where blocks stood"),
        ("ground", "rigid, moves as one; abutments and foundations are fixed to it"),
        ("units", "SI: m, kg, s, N, Pa, where no other unit stands beside a number"),
        ("signs", SIGN_CONVENTION),
        ("e", "eccentricity M / (N h), h the depth of the joint: ±0.5 at its edges"),
        ("V / N", "mobilised friction |V| / N: at its limit μ, with c A / N added, it slides"),
    ]
    if fill := list_elastic_fill(data):
        words = "elastic in histories: it carries tension, and neither yields nor slides inside"
        assumptions.insert(2, ("fill", f"{words}; its E ({', '.join(fill)}) is among the inputs"))
    table = Grid((), assumptions, "Assumptions, units and signs")
    return Section("Inputs and assumptions", [tabulate_inputs(data), table])


def _describe_joints(data: ReportData) -> str:
    """Say what joints resist, and in which results they crush."""
    law = "dry: no tension but where a bond is given; Coulomb friction"
    if data.runs and (closing := describe_closing(data.case.structure)):
        varied = {"joint_rule", "k_n", "finish"}.intersection(list_varied(data))
        law += f"; {closing}, which was {'varied' if varied else 'not varied'}"
    strength = data.case.limit.strength
    computed = {"limit", "rating"} & data.statements.keys()
    if strength is None or strength == np.inf or not computed:  # infinite is "none"
        return f"{law}; no crushing"
    return f"{law}; crushing in limit analysis alone, at {strength / MPa:.3g} MPa"


def _build_geometry(case: Case) -> list[Any]:
    """Build extent, figure with joint names, and table of parts."""
    structure = case.structure
    caption = "The structure, and the numbers of the joints that are assessed."
    points = np.concatenate([block.drawn() for block in structure.blocks])
    length, height = np.ptp(points, axis=0)
    extent = (
        f"{length:.3g} m long, {height:.3g} m high and {structure.width:g} m wide; "
        f"{len(structure.free)} blocks that can move, weighing {structure.weight / kN:.4g} kN, and "
        f"{len(structure.joints)} joints."
    )
    figure = FigureBlock.of(draw_names(structure), caption)
    return [TextBlock(extent), _tabulate_parts(structure), figure]


def _describe_drawing(data: ReportData) -> list[TextBlock]:
    """Name the drawing of the blocks, its unit and tolerance, and how far corners were moved."""
    text = data.read_text(DRAWING_FILE)
    return [] if text is None else [TextBlock(f"The outlines were read from {text}.")]


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


def build_dead_load_sections(data: ReportData) -> list[Section]:
    """Build the sections on dead load, modes, limit analysis, pushover, rating, assessment."""
    collapse = "Thrust line at collapse, and the mechanism of limit analysis over the structure."
    curve = "Load factor over displacement, with the joints in the order of their first hinge."
    shapes, modes = "Shapes of the modes about dead load.", "Modes: effective masses along x and y"
    return [
        Section("Dead load", _build_dead_load(data)),
        Section("Modes", data.read_result("modes", shapes, table=modes)),
        Section("Limit analysis", data.read_result("limit", collapse, "collapse.png")),
        Section("Pushover", data.read_result("pushover", curve)),
        Section("Rating for a vehicle", _build_rating(data)),
        Section("Kinematic assessment", _build_assessment(data)),
    ]


def _build_rating(data: ReportData) -> list[Any]:
    """Build text and picture of a rating, below the table of several vehicles."""
    caption = "(a) Factor along the bridge, and (b) mechanism at the worst place."
    blocks = data.read_result("rating", caption)
    if (table := data.read_text("vehicles.csv")) is None:
        return blocks
    # the text begins with the same table, and the picture is of the worst vehicle
    text, *figures = blocks
    _, worst, *others = text.text.split("\n\n")
    head, *rows = reader(table.splitlines())
    grid = Grid(head, rows, "Factors of several vehicles, the worst first", "words")
    caption = "(a) Least factor of each vehicle, over its place. Others: each at its worst place."
    every = data.read_figure("vehicles.png", caption)
    return [
        grid,
        *every,
        TextBlock(worst, "lines"),
        *figures,
        *(TextBlock(x, "lines") for x in others),
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
    else:
        blocks += data.read_figure("dead.png", thrust)
    caption = "Principal compression under dead load."
    blocks += data.read_result("dead_stress", caption, table="Largest stresses of each part")
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
    if (text := data.read_text("assessment.txt")) is None:
        return []
    caption = "(a) Mechanism at the displacement capacity, and (b) capacity curve with demand."
    names = sorted(name for name in data.files if name.startswith("assessment_"))
    stated = data.statements.get("assessment")
    if stated and len(names) == 2 and all(x.endswith("right and left") for x, *_ in stated.rows):
        names = names[:1]
        caption = f"{caption[:-1]}, to the right; those to the left are its mirror image."
    figures = [figure for name in names for figure in data.read_figure(name, caption)]
    return [TextBlock(text, "lines"), *figures, _define_assessment(data)]


def _define_assessment(data: ReportData) -> Grid:
    """Tabulate the quantities of a kinematic assessment, their rules, and codes that are mixed."""
    state = data.case.assessment.options.get("limit_state", "NTC-2018 SLV")
    rules = state if isinstance(state, LimitState) else LIMIT_STATES[state]
    demand = f"the displacement spectrum, {100.0 * rules.damping:g} % damped, up to T"
    period = (
        f"{rules.period_factor:g} π √(d / a*(d)) at d = {rules.secant_share * rules.share:g} d_0*, "
        "with a* divided by FC; 2 π in place of it is the secant period"
    )
    rows = [
        ("alpha_0", "multiple of the weights, as horizontal forces, that begins the mechanism"),
        ("e*, M*", "share and mass that take part: M* = (Σ P δ)² / (g Σ P δ²), e* = g M* / Σ P"),
        ("a_0*, d_0*", "acceleration that begins it, and displacement at which it resists nothing"),
        (
            "linear",
            "q a_0* / FC against the spectrum at T = 0, which small arches pass that fall in runs",
        ),
        ("T_s", "secant period at 0.16 d_0*, that of NTC-2008"),
        ("T", period),
        (rules.name, f"capacity {rules.share:g} d_0*; demand {demand}; {rules.source}"),
    ]
    return Grid((), rows, "Quantities of the assessment; Circolare 7/2019, C8.7.1.2.1")


def build_ground_section(data: ReportData) -> Section:
    """Build the section on ground motions and spectra."""
    motions = list(data.motions.values())
    if not motions:
        return Section("Ground motion", [])
    longest = max(float(np.diff(run.time).max(initial=0.0)) for run in data.runs.values())
    caption = (
        f"Measures of the motions in the steps of the runs, up to {1e3 * longest:.3g} ms: peaks "
        "between steps are left out, and displacements drift; archfem motion measures the motion."
    )
    blocks: list[Any] = [Grid(*result_text.tabulate_motions(motions), caption)]
    if data.case.suite is None:
        applied = "Ground motion as applied: acceleration, velocity and displacement."
        blocks += [FigureBlock.of(draw_motion(motion), applied) for motion in motions]
    blocks += _build_spectra(data.case, motions)
    return Section("Ground motion" if len(motions) == 1 else "Ground motions", blocks)


def _build_spectra(case: Case, motions: list[Motion]) -> list[Any]:
    """Build the response spectra, beside the target spectrum if there is one."""
    if case.suite is None:
        return [FigureBlock.of(draw_spectra(motions), "Response spectra, 5 % damped, as applied.")]
    scale, reduction = case.suite.get("scale", 1.0), case.suite.get("reduction", 1.0)
    # The suite multiplies by scale and divides by R; recorded motions are as applied.
    pairs = tuple(motion.scaled(reduction / scale) for motion in motions)
    suite = Suite(case.suite.get("name", "suite"), pairs, scale=scale, reduction=reduction)
    caption = "Response spectra, 5 % damped, as applied"
    if case.suite.get("matched", False):
        caption += "; matched from {:g} to {:g} s".format(*DEFAULT_BAND)
    if reduction != 1.0:
        caption = (
            "Response spectra, 5 % damped, before they are divided by the reduction factor "
            f"R = {reduction:g}; motions were applied divided by it"
        )
    blocks: list[Any] = [FigureBlock.of(draw_suite(suite, case.target), caption)]
    if case.target is not None and not case.suite.get("matched", False):
        blocks.append(TextBlock("The motions were not matched to the target."))
    return blocks


def build_run_sections(data: ReportData) -> list[Section]:
    """Build the sections on the response of one run, or of all pairs and of each."""
    if not data.runs:
        return []
    absent = f"Not among the results: runs of {', '.join(data.missing)}."
    missing = [TextBlock(absent, "missing")] if data.missing else []
    if data.case.suite is None:
        (name,) = data.runs
        return [
            Section("Response", _build_response(data, name, 1)),
            Section("Mechanism and collapse", _build_mechanism(data, data.runs[name])),
        ]
    sections = [
        Section("Response: all pairs", [*_build_suite_response(data), *missing]),
        Section("Response: pair by pair", []),
    ]
    for name, run in data.runs.items():
        blocks = [*_build_response(data, name, len(data.runs)), *_build_mechanism(data, run)]
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
        blocks += [*_build_envelopes(data), _tabulate_joints(data, run)]
    blocks.append(TextBlock(sentence(utilisation_text(case.structure, run.joints))))
    return blocks


def build_joint_section(data: ReportData) -> Section:
    """Build the section of long tables: the joints of each run of a suite."""
    runs = {} if data.case.suite is None else data.runs
    tables = [_tabulate_joints(data, run, f" under '{name}'") for name, run in runs.items()]
    return Section("Joints of each run", tables)


def _build_envelopes(data: ReportData) -> list[FigureBlock]:
    """Draw the envelopes of all runs."""
    caption = "Least and largest eccentricity of each joint; dotted under dead load"
    figures = draw_envelopes(data.runs, data.dead)
    part = f"; part {{}} of {len(figures)} of the motions" if len(figures) > 1 else ""
    return [
        FigureBlock.of(figure, f"{caption}{part.format(number)}")
        for number, figure in enumerate(figures, start=1)
    ]


def _tabulate_joints(data: ReportData, run: History, label: str = "") -> Grid:
    """Return the table of joints without empty columns; the caption names these, and the joints."""
    head, rows = result_text.tabulate_joints(run.joints, data.dead)
    assessed = run.verdict.assessed
    # Most joints neither slide nor open in most runs.
    filled = [k for k in range(len(head)) if any(row[k] != "-" for row in rows)]
    empty = {title.split()[0] for k, title in enumerate(head) if k not in filled}
    notes = {"hinge": "No joint hinged.", "slide": "No joint slid.", "open": "None came apart."}
    caption = (
        f"Criteria per joint{label}: eccentricity under dead load, least and largest, largest "
        "V / N, and when and how long at most the joint hinged, slid and was open."
    )
    caption = " ".join([caption, *(note for flag, note in notes.items() if flag in empty)])
    caption += f" {sentence(assessed)}" if assessed else ""
    head, cells = [head[k] for k in filled], [[row[k] for k in filled] for row in rows]
    if len(head) <= 5 and len(cells) > 12:  # in two halves side by side
        half = (len(cells) + 1) // 2
        blank = [[""] * len(head)] * (2 * half - len(cells))
        right = cells[half:] + blank
        head, cells = [*head, *head], [a + b for a, b in zip(cells[:half], right, strict=True)]
    return Grid(head, cells, caption)


def _build_mechanism(data: ReportData, run: History) -> list[Any]:
    """Build verdict and mechanism in a line each, the definitions, and the fall of a run."""
    verdict, fall = run.verdict, run.verdict.fall
    lines = [
        f"Outcome: {summarise_outcomes(data, [run])}",
        *(f"In doubt: {doubt.cause}" for doubt in verdict.doubts),
    ]
    if fall is not None and fall.blocks:
        lines.append(f"lost: {describe_lost(fall, len(fall.blocks))}")
    lines.append(f"Mechanism: {describe_mechanism(verdict)}")
    # the assumptions name the law of closing, and whether it was varied
    law = describe_closing(data.case.structure)
    lines += [line for line in verdict.remarks if not law or not line.startswith(law)]
    stated = (
        [*map(sentence, lines)] if data.case.suite is None else [" ".join(map(sentence, lines))]
    )
    blocks: list[Any] = [*map(TextBlock, stated)]
    if data.case.suite is None or any(verdict.mechanisms.values()):
        caption = "Definitions of a mechanism: failed joints that it needs, and the first one"
        rows = [
            [name, _DEFINITIONS[name], "none" if found is None else str(found)]
            for name, found in verdict.mechanisms.items()
        ]
        blocks.append(Grid((), rows, caption))
    if run.fall is not None and "fall_pose" in run.dataset:
        caption = "Blocks on their way to the ground, (a) to (d), over where they stood."
        blocks.append(FigureBlock.of(draw_fall(run), caption))
    return blocks


def _build_suite_response(data: ReportData) -> list[Any]:
    """Build the tables of all runs, and their envelopes."""
    (head, rows), columns = result_text.tabulate_runs(data.runs), len(result_text.RUN_COLUMNS)
    # The mechanisms have too many columns for a page: a line for each definition instead.
    mechanisms = []
    for title, *cells in zip(head[columns:], *(row[columns:] for row in rows[:-1]), strict=True):
        named = [f"{row[0]}: {cell}" for row, cell in zip(rows, cells, strict=False)]
        if not {*cells} <= {"none", "-"}:
            text = "; ".join(named) if len({*cells}) > 1 else f"{cells[0]} in all"
            mechanisms.append((title, _DEFINITIONS.get(title, ""), text))
    caption = "Outcome, PGA, and the critical joint of each run"
    by_definition = "Mechanisms by definition, the failed joints that it needs, and end"
    table: Any = Grid([], mechanisms, by_definition)
    if len(mechanisms) == 1:  # the end alone
        text = f"No run forms a mechanism by any definition; end: {mechanisms[0][-1]}"
        table = TextBlock(sentence(text))
    return [
        Grid(head[:columns], [row[:columns] for row in rows[:-1]], caption),
        table,
        *_build_envelopes(data),
    ]


def build_check_section(data: ReportData) -> Section:
    """Build the section on predicted error, energy balance and model."""
    blocks: list[Any] = [TextBlock(data.deleted, "missing")] if data.deleted else []
    if data.runs:
        head = ["run", "energy drift", "support reaction", "Newton iterations", "halved steps"]
        head += ["predicted error", "end"]
        rows = [_check_row(data.case, name, run) for name, run in data.runs.items()]
        caption = (
            "Checks of each run: energy drift relative to the largest energy exchanged, reaction "
            "of the supports under dead load, by joints in their directions as built, and most "
            "Newton iterations between two records"
        )
        blocks.append(Grid(head, rows, caption))
    caption = "Speed against error over fidelities, meshes and steps."
    table = "Models in the order of their errors, with times"
    blocks += data.read_result("accuracy", caption, table=table)
    caption = (
        "Residual displacement over the properties that explain most of it, at most six; falls are "
        "above the line, and displacements below the axis at its lower end."
    )
    table = (
        "Falls by the value of each property: of k_n, k_s and damping ratio factors on the values "
        "of the case, of friction what is added"
    )
    blocks += data.read_result("verdict_range", caption, table=table)
    return Section("Checks of the numbers, and range of the verdict", blocks)


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


def build_method_section(data: ReportData) -> Section:
    """Build the section on norms and methods."""
    norm = [("norm", data.case.report["norm"])] if data.case.report.get("norm") else []
    suite, assessment = (data.case.settings.get(key, {}) for key in ("suite", "assessment"))
    given = filter(None, [suite.get("target"), assessment.get("spectrum")])
    spectra = [("design spectrum", text) for text in dict.fromkeys(map(describe_value, given))]
    used = [row[1:] for row in _METHODS if not row[0] or row[0] in data.files]
    used = [row for row in used if data.runs or row[0] != "joints, criteria"]
    return Section("Norms and methods", [Grid((), [*norm, *spectra, *used])])


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
    return [Section("Try it", [TextBlock(text), live], on_screen=True)]


def build_source_section(data: ReportData) -> Section:
    """Build the section on versions, digests of inputs, and the case itself."""
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
    blocks = [Grid((), rows), TextBlock(data.case.text(), "lines")]
    return Section("Versions, digests and the case as a file", blocks)
