"""Sections of a report: inputs, structure, capacity, further results, methods, sources."""

from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import nullcontext, suppress
from csv import reader
from dataclasses import replace
from hashlib import sha256
from typing import Any

import numpy as np
import xarray as xr

from archfem._display import DOUBT_MARK, NOTE_MARK
from archfem._files import read_listed
from archfem.cases.answers import RESULTS, Ratios, read_numbers
from archfem.cases.case import REPORT_KEYS
from archfem.cases.defaults import describe_margins_at_rest
from archfem.cases.report import response
from archfem.cases.report.capacities import tabulate_capacities
from archfem.cases.report.conclusion import (
    HEAD,
    MAX_DOUBTS,
    build_conclusion,
    build_signatures,
    describe_width,
    list_facts,
)
from archfem.cases.report.doubts import (
    list_doubts,
    list_elastic_fill,
    list_varied,
)
from archfem.cases.report.inputs import compare_inputs, describe_value, tabulate_inputs
from archfem.cases.report.motion_rules import find_rule
from archfem.cases.report.outcomes import sentence
from archfem.cases.report.report_data import STATIC_RESULTS, ReportData
from archfem.cases.report.scales import list_scales
from archfem.cases.report.study_findings import (
    StudyFindings,
    list_studied,
    say_what_changes,
    tabulate_study,
)
from archfem.cases.result_text import UPPER_BOUNDS
from archfem.cases.run import DRAWING_FILE
from archfem.dynamics.collapse_state import DISLOCATION, shallowest_part
from archfem.dynamics.history import SIGN_CONVENTION
from archfem.dynamics.motion_scaling import NO_ANSWER
from archfem.dynamics.recorder import library_versions
from archfem.errors import InvalidInput
from archfem.joints.criteria import assessed_joints
from archfem.masonry.block import Block
from archfem.masonry.joint_closing import describe_closing
from archfem.masonry.materials import COURSE_LENGTH
from archfem.masonry.structure import Structure, join_names, join_words
from archfem.motion.record_selection import SELECTION_RULES
from archfem.statics.assessment_checks import LIMIT_STATES, LimitState
from archfem.units import Ends, MPa, format_mm, kN
from archfem.view.pages.document import FigureBlock, Grid, Section, TextBlock
from archfem.view.structure import (
    draw_dimensions,
    draw_names,
    draw_structure,
    find_assessed_walls,
    find_named_stones,
    list_numbers,
)
from archfem.view.studies import draw_findings
from archfem.view.style import limit_width

# Of figure and table, with the file of the figure
_RISK_CAPTIONS = (
    "(a) Probability of a fall by intensity with its band, (b) hazard of the site, and (c) share "
    "of the rate by intensity; the rest lies above.",
    "risk.png",
    "Annual rate of collapse, and that of each alternative, with intervals of the samples alone: "
    "hazard and model are outside of them",
)

_THRUST = "Thrust line under dead load, drawn where the resultant of each joint crosses it."

MAX_SLENDERNESS = 2.6  # length over height of a structure that is legible at half the width
MAX_WIDTH = 170.0  # of a figure of many panels [mm]

_PLAYER_CAPTION = "The structure at the instant above it, the ground acceleration, and one joint."

# Sections on references, and on programs and digests, of which several cases have one at the end
METHODS, VERSIONS = "Norms and methods", "Versions and digests"

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


def build_joint_sections(parts: Mapping[str, ReportData]) -> list[Section]:
    """Build the sections of a report of several cases: drawings, inputs, and each case."""
    labels, signed = dict[str, list[str]](), dict[str, dict[str, None]]()
    for label, data in parts.items():
        labels.setdefault(data.case.structure.fingerprint, []).append(label)
        for key in ("author", "checked_by", "date"):
            signed.setdefault(key, {})[data.case.report.get(key, "")] = None
    report = {key: "; ".join(filter(None, texts)) for key, texts in signed.items()}
    firsts = {join_words(own): parts[own[0]].case.structure for own in labels.values()}
    drawn = [_draw_assessed(each, f"{own}: the") for own, each in firsts.items()]
    sections = [
        Section("Demand and capacity", tabulate_capacities(parts)),
        Section("Signatures and drawings", [build_signatures(report), *drawn]),
        Section("Inputs of all cases", compare_inputs(parts)),
    ]
    known, last = dict[str, list[Section]](), dict[str, dict[Sequence[str], list[str]]]()
    # in the head of all
    said = {HEAD[0], HEAD[-1], *(key.replace("_", " ") for key in REPORT_KEYS)}
    for label, data in parts.items():
        facts = [(x, text) for x, text in list_facts(data) if x not in said]
        known[label] = build_sections(data)
        sections.append(Section(data.name, [Grid((), facts)]))
        for each in known[label]:
            if each.title in (METHODS, VERSIONS):
                for row in each.pieces[0].rows:
                    last.setdefault(each.title, {}).setdefault(tuple(row), []).append(label)
                continue
            first = next(other for other, own in known.items() if each in own)
            pieces = each.pieces if first == label else [TextBlock(f"As of case {first}.")]
            sections.append(replace(each, pieces=pieces, level=each.level + 1))
    for title, rows in last.items():
        of_all = [(f"{row[0]} ({join_words(own)})", *row[1:]) for row, own in rows.items()]
        sections.append(Section(title, [Grid((), of_all)]))
    return sections


def build_sections(data: ReportData) -> list[Section]:
    """Build all sections of a case; those without any result are left out."""
    studies = [piece for each in data.studies for piece in _build_study(data, each)]
    sections = [
        build_conclusion(data),
        build_structure_section(data),
        build_input_section(data),
        *build_static_sections(data),
        response.build_ground_section(data),
        *response.build_run_sections(data),
        Section("Scale of the motion", _build_scale(data)),
        Section("Range over uncertain properties", response.build_range(data)),
        Section("Annual rate of collapse", data.read_result("risk", *_RISK_CAPTIONS)),
        Section("Study of many cases", studies),
        response.build_check_section(data),
        build_method_section(data),
        build_source_section(data),
    ]
    # a heading of subsections has no pieces of its own
    followed = [*(section.level for section in sections[1:]), 2]
    return [s for s, level in zip(sections, followed, strict=True) if s.pieces or level > s.level]


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
    supports = (block for block in data.case.structure.blocks if block.fixed)
    fixed = dict.fromkeys(_name_support(data.case.structure, block) for block in supports)
    large = data.case.analysis.discretisation.displacements == "large"
    moved = "of any size" if large else "small: equilibrium where blocks stood"
    follows = "; an assessment follows its mechanism" * ("assessment" in data.statements)
    if data.is_static:
        moved = f"none: equilibrium as built{follows}"
    elif data.statements.keys() & {*STATIC_RESULTS}:
        moved += f"; in limit analysis none: equilibrium as built{follows}"
    joints = [joint for joint in data.case.structure.joints if joint.role == "pier"]
    piers = dict.fromkeys(f"{joint.name_face('extrados')} of {joint.part}" for joint in joints)
    assumptions = [
        ("structure", "plane; forces are those of the whole width"),
        ("blocks", "rigid" if data.is_static else blocks.get(fidelity, f"by part: {fidelity}")),
        ("joints", _describe_joints(data)),
        ("displacements", moved),
        ("ground", f"rigid, moves as one; fixed to it: {join_names([*fixed])}"),
        ("units", "SI: m, kg, s, N, Pa, where no other unit stands; accelerations of spectra in g"),
        ("signs", SIGN_CONVENTION),
        *[("extrados", f"outer face of a ring; {join_names([*piers])}")] * bool(piers),
        ("e", "eccentricity M / (N h), h the depth of the joint: ±0.5 at its edges"),
        ("V / N", "mobilised friction |V| / N: at its limit μ, with c A / N added, it slides"),
    ]
    if fill := list_elastic_fill(data):
        words = "elastic in histories: it carries tension, and neither yields nor slides inside"
        assumptions.insert(2, ("fill", f"{words}; its E ({', '.join(fill)}) is among the inputs"))
    table = Grid((), assumptions, "Assumptions, units and signs")
    inputs = [] if data.label else [tabulate_inputs(data)]
    return Section("Inputs and assumptions", [*inputs, table])


def _describe_joints(data: ReportData) -> str:
    """Say what joints resist, and in which results they crush."""
    law = "dry: no tension but where a bond is given; Coulomb friction"
    if data.runs and (closing := describe_closing(data.case.structure)):
        varied = {"joint_rule", "k_n", "finish"}.intersection(list_varied(data))
        law += f"; {closing}, which was {'varied' if varied else 'not varied'}"
    strength = data.case.limit.strength
    computed = {"limit", "thickness", "rating", "assessment"} & data.statements.keys()
    if strength is None or strength == np.inf or not computed:  # infinite is "none"
        return f"{law}; no crushing"
    return f"{law}; crushing in limit analysis and assessments alone, at {strength / MPa:.3g} MPa"


def build_structure_section(data: ReportData) -> Section:
    """Build extent, drawing, thrust line, parts, and joints and stress under dead load."""
    case, structure = data.case, data.case.structure
    extent = np.ptp(np.concatenate([block.drawn() for block in structure.blocks]), axis=0)
    beside = not data.label and data.dead is not None and extent[0] < MAX_SLENDERNESS * extent[1]
    with limit_width(response.HALF_WIDTH) if beside else nullcontext():
        # of several cases the drawings stand before their inputs
        figures = [] if data.label else [_draw_assessed(structure)]
        if data.dead is not None:
            criteria = case.analysis.failure_criteria
            thrust = draw_structure(structure, data.dead, criteria=criteria)
            drawn = figures[0].figure if figures else None
            for own, other in zip(thrust.axes, drawn.axes if drawn else (), strict=False):
                own.set(xlim=other.get_xlim(), ylim=other.get_ylim())  # both at one scale
            figures.append(_untitle(thrust, _THRUST))
        else:
            figures += data.read_figure("dead.png", _THRUST)
    blocks: list[Any] = [TextBlock(_describe_extent(structure))]
    if (drawing := data.read_text(DRAWING_FILE)) is not None:
        blocks.append(TextBlock(f"The outlines were read from {drawing}."))
    at_rest = [
        x
        for x in describe_margins_at_rest(case, structure)
        # the section on the least thickness has both factors, with what differs
        if "thickness" not in data.statements or not x.startswith("geometric factor")
    ]
    blocks += [
        *(replace(each, beside=beside) for each in figures),
        _tabulate_parts(structure),
        *([] if data.dead is None else [_tabulate_dead_load(data.dead)]),
        *map(TextBlock, map(sentence, at_rest)),
    ]
    caption = "Principal compression under dead load."
    blocks += data.read_result("dead_stress", caption, table="Largest stresses of each part")
    caption = "A block cut free: forces on it, and their closing."
    return Section("Structure and dead load", blocks + data.read_figure("free_body.png", caption))


def _draw_assessed(structure: Structure, the: str = "The") -> FigureBlock:
    """Draw a structure with names of joints and stones, or with numbers of stones in bond."""
    figure, named = draw_names(structure), find_named_stones(structure)
    shown = ["with its assessed joints", *list_numbers(structure)]
    shown[0] += " and the names of stones" * bool(named)
    if find_assessed_walls(structure) and not named:
        shown = ["with numbers of stones in the order of the case, from 0 on"]
    if structure.heads.any():
        draw_dimensions(figure.axes[0], structure)
        shown[0] = f"{structure.width:g} m thick, {shown[0]}"
    return _untitle(figure, f"{the} structure, {'; '.join(shown)}.")


def _untitle(figure: Any, caption: str) -> FigureBlock:
    """Return a figure without the titles that its caption and the head of the report have."""
    figure.suptitle("")
    for axes in figure.axes:
        axes.set_title("")
    return FigureBlock.of(figure, caption)


def _describe_extent(structure: Structure) -> str:
    """Describe lengths, weight and numbers of what moves, and what blocks stand for besides."""
    # the ground is no part of its size
    moving = [structure.blocks[number] for number in structure.free]
    length, height = np.ptp(np.concatenate([block.drawn() for block in moving]), axis=0)
    along = f"{length:.3g} m long"
    if structure.above is not None:  # across the plane of a wall, which may lean
        along = f"{Ends.of(joint.depth for joint in structure.joints):.3g} m thick"
    text = (
        f"{along}, {height:.3g} m high and {describe_width(structure)}; "
        f"{len(moving)} blocks that can move, weighing {structure.weight / kN:.4g} kN, and "
        f"{len({*structure.face_names})} joints."
    )
    loads = Counter(block.material.stands_for for block in moving)
    for load, count in ((x, k) for x, k in loads.items() if x not in (None, COURSE_LENGTH)):
        text += (
            f" {count} block{'s' * (count > 1)} also stand{'s' * (count == 1)} for '{load}', which "
            "counts by its weight, at the middle of each block, and not in these lengths."
        )
    return text


def _name_support(structure: Structure, block: Block) -> str:
    """Return the name of a fixed block, or of its part where all of it is fixed."""
    whole = all(each.fixed for each in structure.blocks if each.part == block.part)
    return f"'{block.part}'" if block.part and whole else f"'{block.name}'"


def _tabulate_parts(structure: Structure) -> Grid:
    """Tabulate the parts of a structure."""
    rows, fixed = [], list[str]()
    for part in dict.fromkeys(block.part for block in structure.blocks):
        blocks = [block for block in structure.blocks if block.part == part]
        free = [block for block in blocks if not block.fixed]
        if not free:
            fixed.append(part or "–")
            continue
        assessed = zip(structure.joints, structure.judged, strict=True)
        depths = [joint.depth for joint, own in assessed if own and joint.part == part]
        weight = structure.width * sum(block.area * block.material.unit_weight for block in free)
        row = [part or "–", blocks[0].role or "–", str(len(blocks)), str(len(blocks) - len(free))]
        first, *others = dict.fromkeys(block.material.name for block in blocks)
        row.append(f"{first} and {len(others)} more" if others[1:] else ", ".join([first, *others]))
        row.append(f"{weight / kN:.4g}")
        ends = dict.fromkeys(f"{choose(depths):.3g}" for choose in (min, max) if depths)
        row.append(" – ".join(ends) or "–")
        rows.append(row)
    head = ["part", "role", "blocks", "of them fixed", "material", "weight [kN]"]
    head.append("depth of joints [m]")
    apart = f"; fixed as a whole: {join_names(fixed)}" if fixed else ""
    return Grid(head, rows, f"Parts that can move{apart}")


def build_static_sections(data: ReportData) -> list[Section]:
    """Build the sections on modes, limit analysis, pushover, rating, assessment."""
    collapse = "Thrust line at collapse, and the mechanism of limit analysis over the structure."
    curve = "Load factor over displacement, with the joints in the order of their first hinge."
    modes = data.read_result("modes", table="Modes about dead load: effective masses along x and y")
    return [
        Section("Limit analysis", data.read_result("limit", collapse, "collapse.png")),
        Section("Least thickness", data.read_result("thickness")),
        Section("Pushover", data.read_result("pushover", curve)),
        Section("Rating for a vehicle", _build_rating(data)),
        Section("Kinematic assessment", _build_assessment(data)),
        Section("Modes", modes),
    ]


def _build_rating(data: ReportData) -> list[Any]:
    """Build text and picture of a rating, below the table of several vehicles."""
    table, grids, of = data.read_text("vehicles.csv"), list[Any](), ""
    if table is not None:
        head, *rows = reader(table.splitlines())
        grids, of = [Grid(head, rows, "Factors of several vehicles", "words")], f", {rows[0][0]}"
        grids += data.read_figure("vehicles.png", "Factor of each vehicle over its place.")
        grids += data.read_figure("places.png", "Each vehicle at its worst place.")
    caption = f"(a) Factor along the bridge, and (b) mechanism at the worst place{of}"
    text, *figures = data.read_result("rating", caption) or [None]
    if text is None:
        return []
    # of several vehicles the text begins with the same table
    texts = text.text.split("\n\n")[1:] if grids else [text.text]
    if data.statements.keys() == {"rating"}:  # all of which the conclusion has
        stated = {*data.statements["rating"].sentences, *data.statements["rating"].notes}
        lines = [each.splitlines() for each in texts]
        kept = [[x for x in each if x.removeprefix(NOTE_MARK) not in stated] for each in lines]
        texts = ["\n".join(each) for each in kept]
    if (varied := data.read_text("rating_variations.csv")) is not None:
        head, *rows = reader(varied.splitlines())
        title = f"Factor of {head[0]} one property changed at a time"
        title += ", alone, as its factor is nearest to 1" * bool(grids)
        figures.insert(0, Grid(head, rows, title, "words"))
    return [*grids, *(TextBlock(each, "lines") for each in texts), *figures]


def _tabulate_dead_load(joints: xr.Dataset) -> Grid:
    """Tabulate the extremes of the joints of each part under dead load."""
    joints = assessed_joints(joints)
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
    head = ["part", "max |e|", "in", "max V/N", "min N [kN]", "max N [kN]", "open throughout"]
    return Grid(head, rows, "Joints of rings and piers under dead load")


def _build_assessment(data: ReportData) -> list[Any]:
    """Build text and pictures of kinematic assessments from the files of the folder."""
    if (text := data.read_text("assessment.txt")) is None:
        return []
    # the conclusion has its notes
    kept = [x for x in text.splitlines() if not x.startswith(NOTE_MARK)]
    texts = "\n".join(kept).strip().split("\n\n")
    names = sorted(name for name in data.files if name.startswith("assessment_"))
    checks = read_numbers(Ratios, data.statements.get("assessment"))
    moved = {way for each in checks if not each.linear for way in each.directions}
    captions = dict[str, str]()
    for name in names:  # numbered as the texts behind the margin
        way = texts[1 + int(name[len("assessment_") : -len(".png")])].partition(": kinematic ")[0]
        drawn = f"Mechanism as it begins, {way}; it has no curve, as it has no displacement check"
        if way in moved:
            drawn = "(a) Mechanism at the displacement capacity, and (b) capacity curve with demand"
            drawn += f", {way}"
        captions[name] = f"{drawn}."
    if len(names) == 2 and all(len(each.directions) == 2 for each in checks):
        del captions[names[1]]
        mirrored = "\nleft: the mirror image, with the same numbers"
        texts = [texts[0], texts[1] + mirrored, *texts[3:]]
    figures = [figure for each in captions.items() for figure in data.read_figure(*each)]
    defined = _define_assessment(data, text, bool(moved))
    return [TextBlock("\n\n".join(texts), "lines"), defined, *figures]


def _define_assessment(data: ReportData, text: str, moves: bool) -> Grid:
    """Tabulate the quantities of a kinematic assessment that were computed, and their rules."""
    state = data.case.assessment.options.get("limit_state", "NTC-2018 SLV")
    rules = state if isinstance(state, LimitState) else LIMIT_STATES[state]
    demand = f"the displacement spectrum, {100.0 * rules.damping:g} % damped, up to T"
    period = (
        f"{rules.period_factor:g} π √(d / a*(d)) at d = {rules.secant_share * rules.share:g} d_0*, "
        "with a* divided by FC; 2 π in place of it is the secant period"
    )
    takes_part = "M* = (Σ P δ)² / (g Σ P δ²), e* = g M* / Σ P, with the weights P that move alone"
    checked = f"capacity {rules.share:g} d_0*; demand {demand}; {rules.source}"
    free = data.case.assessment.options.get("free_period") or 0.0
    rows = [
        ("alpha_0", "multiple of the weights, as horizontal forces, that begins the mechanism"),
        ("e*, M*", f"share and mass that take part: {takes_part}"),
        ("a_0*", "acceleration that begins it"),
        (
            "linear",
            f"q a_0* / FC against the spectrum at T = {free:g}{' s' * bool(free)}, which small "
            "arches pass that fall in runs",
        ),
    ]
    if moves:
        point = "centroid of the blocks that move fastest, or of all weights that move where its "
        point += "ratio is less, d* = d / e*"
        ends = "displacement at which it resists nothing, or the end of its motion"
        rows += [("d_0*", ends), ("d*, d_0*", f"spectral displacements of the {point}")]
        rows += [("T_s", "secant period at 0.16 d_0*, that of NTC-2008")] * ("T_s" in text)
        rows += [("T", period), (rules.name, checked)]
    return Grid((), rows, "Quantities of the assessment; Circolare 7/2019, C8.7.1.2.1")


def _build_scale(data: ReportData) -> list[Any]:
    """Build text of each search of scales, and the picture of the least.

    The capacities have its scales, and its doubts stand once below, with their motions.
    """
    built, drawn = list[Any](), list[tuple[float, Any]]()
    held = {each.motion: each.held for each in list_scales(data)}
    for pair, place in data.list_parts("scale.txt").items():
        name, under = place.removesuffix(".txt"), f" under '{pair}'" if pair else ""
        caption = (
            f"Residual displacement{under} over the scale of the motion; falls are at the top; "
            f"each run is a row of {name}.csv."
        )
        text, *figures = data.read_result(name, caption)
        runs = data.read_text(f"{name}.csv") or ""
        answered = {row[3] for row in [*reader(runs.splitlines())][1:]} - {NO_ANSWER}
        shown = text.text.rpartition("\n\n")[0] if runs else text.text
        lines = [x for x in shown.splitlines() if not x.startswith(DOUBT_MARK)]
        built.append(replace(text, text="\n".join(lines)))
        drawn += [(held.get(pair, 0.0), each) for each in figures * bool(answered)]
    doubts = [doubt for result, doubt in list_doubts(data) if result == RESULTS["scale"]]
    texts = [f"{DOUBT_MARK}{replace(doubt, remedy='')}" for doubt in doubts]
    built += [TextBlock("\n".join(texts), "lines")] * (len(texts) > MAX_DOUBTS)
    return [*built, *(figure for _, figure in sorted(drawn, key=lambda x: x[0])[:1])]


def _build_study(data: ReportData, found: StudyFindings) -> list[Any]:
    """Build table and picture of a study: of a comparison of cases those that it has written."""
    caption = f"Study: {found.title}{found.under}"
    if not len(found.worst):
        read_listed(found.folder, "study.png")
        return [
            TextBlock(found.text, "lines", caption),
            FigureBlock.read(found.folder / "study.png", caption),
        ]
    # the conclusion says it where there are no runs
    said = say_what_changes(found) if data.runs or not found.is_own else ()
    blocks: list[Any] = [*(TextBlock(sentence(text)) for text in said), tabulate_study(found)]
    limit, key = DISLOCATION * shallowest_part(data.case.structure)[0], "residual displacement"
    with suppress(InvalidInput), limit_width(MAX_WIDTH):  # no number differs
        figure = draw_findings(found.numbers, max_panels=4, limits={key: 1e3 * limit})
        dotted = f", dotted the limit of dislocation of the case, {format_mm(limit)}"
        dotted += "; cases of other lengths have others" * ("lengths" in list_studied(found))
        caption += f"; all points{dotted * (key in found.numbers)}"
        # bars of falls are hatched
        has_bars = found.keys == ("case",) and found.worst["runs"].max() == 1
        falls = bool(found.worst["falls"].any() and not has_bars)
        caption += "; triangles at the end are falls" * falls
        bounds = np.any(found.table.get(UPPER_BOUNDS, "") != "")
        caption += "; open marks are upper bounds" * bool(bounds)
        blocks.append(FigureBlock.of(figure, sentence(caption)))
    doubts = [f"{DOUBT_MARK}{replace(doubt, remedy='')}" for doubt in found.doubts]
    return [*blocks, *[TextBlock("\n".join(doubts), "lines")] * bool(doubts)]


def build_method_section(data: ReportData) -> Section:
    """Build the section on norms and methods."""
    norm = [("norm", data.case.report["norm"])] if data.case.report.get("norm") else []
    suite, assessment = (data.case.settings.get(key, {}) for key in ("suite", "assessment"))
    given = filter(None, [suite.get("target"), assessment.get("spectrum")])
    named = (each["code"] if each["code"] == "table" else describe_value(each) for each in given)
    spectra = [("design spectrum", text) for text in dict.fromkeys(named)]
    used = [row[1:] for row in _METHODS if not row[0] or data.list_parts(row[0])]
    floor = "floor spectrum", "Circolare 7/2019, C7.2.3, by the first mode of the building"
    used += [floor] * any(text.startswith("code floor") for _, text in spectra)
    used = [row for row in used if data.runs or row[0] != "joints, criteria"]
    if find_rule(data) is SELECTION_RULES["EC8"]:
        without = {"assessment": "; EN 1998-1 itself has no such check"}
        used = [(name, text + without.get(name, "")) for name, text in used]
    methods = [("methods", "; ".join(f"{name}: {text}" for name, text in used))]
    return Section(METHODS, [Grid((), [*norm, *spectra, *methods])])


def build_source_section(data: ReportData) -> Section:
    """Build the section on versions, and digests of inputs and case."""
    runs = data.runs.items()
    # Usually one line: all runs were computed with the same versions.
    made = sorted({run.dataset.attrs["versions"] for _, run in runs})
    own = library_versions()
    rows = [("computed with", text) for text in made]
    rows += [] if made == [own] else [("report written with", own)]
    digests = {name: str(run.dataset.attrs.get("inputs", ""))[:12] for name, run in runs}
    inputs = ", ".join(f"{name} {text}" for name, text in digests.items() if text)
    rows += [("inputs, begin of SHA-256", inputs)] * bool(inputs)
    rows.append(("SHA-256 of the case", sha256(data.case.text().encode()).hexdigest()))
    place = "case.toml in the folder of the results"
    rows.append(("the case as a file", place if data.folder else "attribute 'case' of the history"))
    return Section(VERSIONS, [Grid((), rows)])
