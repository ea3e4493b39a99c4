"""Sections of a report on ground motions, responses of runs, their ranges, and checks."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from archfem.cases import result_text
from archfem.cases.case import Case
from archfem.cases.motion_keys import find_matched_band
from archfem.cases.report.doubts import list_ranges, spans_run
from archfem.cases.report.motion_rules import find_target, tabulate_checks
from archfem.cases.report.outcomes import (
    describe_lost,
    find_worst_run,
    list_changing,
    list_lost,
    sentence,
)
from archfem.cases.report.report_data import ReportData, build_player
from archfem.dynamics.collapse_state import DISLOCATION, FALLEN_STATES, shallowest_part
from archfem.dynamics.history import History
from archfem.dynamics.verdict_range import COUNTED, VerdictRange, property_text
from archfem.masonry.joint_closing import describe_closing
from archfem.masonry.structure import Structure, join_words
from archfem.models.model import group_doubts, merge_doubts
from archfem.motion.motion import Motion
from archfem.motion.suite import Suite
from archfem.statics.stress import utilisation_text
from archfem.units import STANDARD_GRAVITY, format_mm
from archfem.view.collapse import draw_fall
from archfem.view.histories import draw_envelopes
from archfem.view.motions import draw_motion, draw_spectra, draw_suite
from archfem.view.pages.document import FigureBlock, Grid, Section, TextBlock
from archfem.view.style import Colour, limit_width

# Width of figures of which two stand side by side [mm]
HALF_WIDTH = 84.0

# Rows of a table of joints, of which a bridge of several spans has as many
MAX_JOINTS = 60


def build_ground_section(data: ReportData) -> Section:
    """Build the section on ground motions and spectra."""
    motions = list(data.motions.values())
    if not motions:
        return Section("Ground motion", [])
    caption = "Measures of the motions as applied, at their own samples, without a correction"
    blocks: list[Any] = [Grid(*result_text.tabulate_motions(motions), caption)]
    blocks += tabulate_checks(data)
    if missed := [*_list_missed_peaks(data)]:
        blocks.append(TextBlock(f"Steps of runs miss peaks: {'; '.join(missed)}."))
    if data.case.suite is None:
        applied = "Ground motion as applied: acceleration, velocity and displacement."
        with limit_width(HALF_WIDTH):
            figures = [FigureBlock.of(draw_motion(motions[0]), applied)]
            figures += _build_spectra(data, motions)
        blocks += [replace(figure, beside=True) for figure in figures]
    else:
        blocks += _build_spectra(data, motions)
    return Section("Ground motion" if len(motions) == 1 else "Ground motions", blocks)


def _list_missed_peaks(data: ReportData, share: float = 0.98) -> Iterator[str]:
    """Yield the peaks of motions that the steps of their runs do not meet."""
    for name, motion in data.motions.items():
        met = float(np.abs(data.runs[name].dataset["ground"].values[:, 0]).max())
        # a run that ended early has not met them all
        if met < share * motion.pga and data.runs[name].time[-1] > 0.999 * motion.duration:
            peaks = " of ".join(f"{each / STANDARD_GRAVITY:.3g}" for each in (met, motion.pga))
            yield f"of '{name}' {peaks} g"


def _build_spectra(data: ReportData, motions: list[Motion]) -> list[Any]:
    """Build the response spectra, beside that of their suite or of an assessment."""
    own, target = data.case.suite or {}, find_target(data)
    caption = "Response spectra, 5 % damped, as applied"
    if data.case.suite is None and target is None:
        return [FigureBlock.of(draw_spectra(motions), f"{caption}.")]
    scale, reduction = own.get("scale", 1.0), own.get("reduction", 1.0)
    # The suite multiplies by scale and divides by R; recorded motions are as applied.
    pairs = tuple(motion.scaled(reduction / scale) for motion in motions)
    name = own.get("name", "suite" if own else motions[0].name)
    suite = Suite(name, pairs, scale=scale, reduction=reduction)
    if band := find_matched_band(own):
        caption += "; matched from {:g} to {:g} s".format(*band)
    if reduction != 1.0:
        caption = (
            "Response spectra, 5 % damped, before they are divided by the reduction factor "
            f"R = {reduction:g}; motions were applied divided by it"
        )
    if target is not None and not find_matched_band(own):
        caption += "; they were not matched to the target"
        caption += ", which is the spectrum of [assessment]" * (data.case.target is None)
    return [FigureBlock.of(draw_suite(suite, target), caption)]


def build_run_sections(data: ReportData) -> list[Section]:
    """Build the sections on the response of one run, or of all pairs and of each."""
    if not data.runs:
        return []
    absent = f"Not among the results: runs of {', '.join(data.missing)}."
    missing = [TextBlock(absent, "missing")] if data.missing else []
    if data.case.suite is None:
        (name,) = data.runs
        return [Section("Response", _build_response(data, name, 1))]
    every = Section("Response: all pairs", [*_build_suite_response(data), *missing])
    if not data.shows_all:
        worst = find_worst_run(data)
        title = f"The worst as given, by outcome and then displacement: {worst}"
        return [every, Section(title, _build_response(data, worst, 1), level=3)]
    sections = [every, Section("Response: pair by pair", [])]
    for name in data.runs:
        sections.append(Section(name, _build_response(data, name, len(data.runs)), level=3))
    return sections


def _build_response(data: ReportData, name: str, players: int) -> list[Any]:
    """Build envelope, criteria per joint, use of strength, mechanism and player of one run."""
    case, run = data.case, data.runs[name]
    title = case.title if case.suite is None else f"{case.title}: {name}"
    blocks: list[Any] = []
    if not run.ending.is_complete:
        blocks.append(TextBlock(f"The run is not complete: {run.outcome}.", "doubt"))
    if case.suite is None:
        blocks += [_tabulate_joints(data, run), *_build_envelopes(data)]
    blocks.append(TextBlock(sentence(utilisation_text(case.structure, run.joints))))
    return [*blocks, *_build_mechanism(data, run), build_player(case, run, title, players)]


def _build_envelopes(data: ReportData) -> list[FigureBlock]:
    """Draw the envelopes of all runs."""
    caption = "Least and largest eccentricity of each joint; dotted under dead load"
    runs: Mapping[str, History | Sequence[History]] = data.runs
    if len(runs) > len(Colour.LINES) and not data.shows_all:
        worst = find_worst_run(data)
        others = [run for name, run in data.runs.items() if name != worst]
        runs = {worst: data.runs[worst], f"{len(others)} other motions": others}
    figures = draw_envelopes(runs, data.dead)
    for figure in figures:
        figure.suptitle("")  # which the head of the report says
    part = f"; part {{}} of {len(figures)} of the motions" if len(figures) > 1 else ""
    return [
        FigureBlock.of(figure, f"{caption}{part.format(number)}")
        for number, figure in enumerate(figures, start=1)
    ]


def _tabulate_joints(data: ReportData, run: History) -> Grid:
    """Return the table of joints without empty columns; the caption names these, and the joints."""
    head, rows = result_text.tabulate_joints(run.joints, data.dead)
    assessed = run.verdict.assessed
    # Most joints neither slide nor open in most runs.
    filled = [k for k in range(len(head)) if any(row[k] != "-" for row in rows)]
    empty = {title.split()[0] for k, title in enumerate(head) if k not in filled}
    notes = {"hinge": "No joint hinged.", "slide": "None slid as a whole."}
    notes["open"] = "None came apart."
    caption = (
        "Criteria per joint: eccentricity under dead load, least and largest, and largest V / N. "
        "Then when and how long at most it hinged, slid as a whole (|V| at its limit) and was open."
    )
    caption = " ".join([caption, *(note for flag, note in notes.items() if flag in empty)])
    caption += f" {sentence(assessed)}" if assessed else ""
    if len(rows) > MAX_JOINTS:  # as in a wall of courses: each has a line or two
        ranked = sorted(range(len(rows)), key=lambda k: _rank_joint(rows[k]))
        caption += f" The {MAX_JOINTS} of {len(rows)} that failed longest, then by largest |e|."
        rows = [rows[k] for k in sorted(ranked[:MAX_JOINTS])]
    if until := run.verdict.until:
        caption += f" All are of the time{until}, before blocks were loose."
    head, cells = [head[k] for k in filled], [[row[k] for k in filled] for row in rows]
    if len(head) <= 5 and len(cells) > 12:  # in two halves side by side
        half = (len(cells) + 1) // 2
        blank = [[""] * len(head)] * (2 * half - len(cells))
        right = cells[half:] + blank
        head, cells = [*head, *head], [a + b for a, b in zip(cells[:half], right, strict=True)]
    return Grid(head, cells, caption)


def _rank_joint(row: Sequence[str]) -> tuple[float, float]:
    """Return minus the time for which a joint of the table failed, and minus its largest |e|."""
    failed = sum(float(cell.split()[0]) for cell in row[6::2] if cell != "-")
    return -failed, -max((abs(float(e)) for e in row[2:4] if e != "open"), default=0.5)


def summarise_outcome(data: ReportData, run: History) -> str:
    """Return the outcome of a run, with its doubts or its range."""
    own = run.dataset.attrs.get("motion")
    ranges = {each.dataset.attrs.get("motion"): each for each in data.verdict_ranges}
    found = ranges.get(own)
    if found is None and len(data.runs) == 1:  # a range over several motions has no name
        found = next(iter(ranges.values()), None)
    # lost blocks have a line of their own, and the conclusion says what was not varied
    text = run.verdict.brief
    return text if found is None else f"{text}; {found.count}{found.unanswered}"


def describe_mechanism(verdict: Any) -> str:
    """Return the first mechanism of a run, verified or by another definition."""
    for definition in ("verified", *verdict.mechanisms):
        if (found := verdict.mechanisms.get(definition)) is not None:
            return f"{'by ' * (definition != 'verified')}{definition}, {found}"
    return f"none by any definition{verdict.until}"


def _build_mechanism(data: ReportData, run: History) -> list[Any]:
    """Build verdict and mechanism in a line each, and the fall of a run."""
    verdict, fall = run.verdict, run.verdict.fall
    lines = [f"Outcome: {summarise_outcome(data, run)}"]
    if len(data.runs) == 1:  # of several there are tables
        lines += [f"In doubt: {doubt.cause}" for doubt in verdict.doubts]
        if fall is not None and fall.time is not None:
            lines.append(f"lost: {describe_lost(data.case.structure, [fall])}")
    lines.append(f"Mechanism: {describe_mechanism(verdict)}")
    # the assumptions name the law of closing, and whether it was varied
    law = describe_closing(data.case.structure)
    lines += [line for line in verdict.remarks if not law or not line.startswith(law)]
    blocks: list[Any] = [TextBlock(" ".join(map(sentence, lines)))]
    if verdict.outcome in FALLEN_STATES and "fall_pose" in run.dataset:
        caption = "Blocks on their way to the ground, (a) to (d), over where they stood."
        blocks.append(FigureBlock.of(draw_fall(run), caption))
    return blocks


def _build_suite_response(data: ReportData) -> list[Any]:
    """Build the table of all runs, and their envelopes."""
    (head, rows), columns = result_text.tabulate_runs(data.runs), len(result_text.RUN_COLUMNS)
    caption = "Outcome, PGA, and the critical joint of each run"
    tables = [Grid(head[:columns], [row[:columns] for row in rows[:-1]], caption)]
    if not data.shows_all:  # which state it with each run
        first = [
            (name, describe_mechanism(run.verdict).partition("; it ")[0])
            for name, run in data.runs.items()
        ]
        caption = "First mechanisms at 1.00 × each motion"
        caption += "; scaled ones form others at other scales" * ("scale" in data.statements)
        tables.append(Grid(("pair", "first mechanism"), first, caption, "words"))
    falls, structure = {k: run.verdict.fall for k, run in data.runs.items()}, data.case.structure
    lost = [
        (name, f"{len(fall.blocks)}", f"{fall.time:.2f} s", list_lost(structure, fall.blocks))
        for name, fall in falls.items()
        if fall is not None and fall.time is not None
    ]
    if lost:
        tables.append(Grid(("run", "lost", "the first at", "blocks"), lost, "Lost blocks", "words"))
    own = {name: run.verdict.doubts for name, run in data.runs.items()}
    doubts = [
        (merge_doubts(same).cause, join_words([name for name in own if {*own[name]} & {*same}]))
        for same in group_doubts(doubt for each in own.values() for doubt in each)
    ]
    if doubts:
        tables.append(Grid(("in doubt", "runs"), doubts, "Doubts of the runs", "words"))
    return [*tables, *_build_envelopes(data)]


def build_range(data: ReportData) -> list[Any]:
    """Build a paragraph on each range, tables with a column for each, and the worst's picture."""
    built, found, ranges = list[Any](), dict[str, VerdictRange](), iter(data.verdict_ranges)
    for pair, place in data.list_parts("verdict_range.txt").items():
        # a command without an answer leaves its reason alone
        if place.replace(".txt", ".nc") not in data.files:
            built += data.read_result(place.removesuffix(".txt"))
            continue
        found[pair] = each = next(ranges)
        moved = each.displacements * spans_run(data, each)
        told = filter(None, [each.sentence, moved, *each.what_changes])
        built.append(TextBlock(sentence("; ".join(told))))
    if not found:
        return built
    # what falls or is dislocated most is the worst
    order = sorted(found, key=lambda x: (-found[x].falls.sum(), -found[x].dislocated.sum()))
    found = {pair: found[pair] for pair in order}
    count = found[order[0]].dataset["sampled"].values.sum()
    varied = {k: {x: f"{y} ({m})" for x, y, m in list_ranges(data, v)} for k, v in found.items()}
    built += _set_abreast(varied, "property", f"Varied properties; {count} samples, and each alone")
    changes = _tabulate_single_changes(data, found)
    if any(each.decisive.any() for each in found.values()):
        built += _tabulate_counts(found)
    elif changes:  # where all stand, these say more than shares
        return [*built, *changes]
    under = f" under '{order[0]}'" * bool(order[0])
    caption = (
        f"Residual displacement{under} over the properties that explain most of it, at most six; "
        "falls are above a dashed line, and displacements below the axis at its lower end"
    )
    others = join_words([f"'{pair}'" for pair in order[1:]])
    caption += f". Those of {others} are in the folder of the results" * bool(others)
    name = data.list_parts("verdict_range.txt")[order[0]].replace(".txt", ".png")
    return [*built, *changes, *data.read_figure(name, f"{caption}.")]


def _set_abreast(cells: Mapping[str, Mapping[str, str]], head: str, caption: str) -> list[Grid]:
    """Tabulate texts by row, with a column for each motion, or one for all that are alike."""
    alike = len(cells) > 1 and len({tuple(own.items()) for own in cells.values()}) == 1
    caption += f", under each of {len(cells)} motions" * alike
    columns = dict([*cells.items()][:1]) if alike else cells
    names = dict.fromkeys(name for own in columns.values() for name in own)
    rows = [(name, *(own.get(name, "-") for own in columns.values())) for name in names]
    titles = (f"'{pair}'" * (len(columns) > 1) for pair in columns)
    return [Grid((head, *titles), rows, caption, "words")] if rows else []


def _tabulate_counts(found: Mapping[str, VerdictRange]) -> list[Grid]:
    """Tabulate how many runs fall or are dislocated by the value of each property."""
    tables = {pair: each.tabulate()[1] for pair, each in found.items()}
    cells = {k: {x: ": ".join(own) for x, *own in rows} for k, rows in tables.items()}
    telling = {property_text(x) for each in found.values() for x in each.beyond_chance}
    counted = {each.counted for each in found.values()}
    kind = counted.pop() if len(counted) == 1 else "falls or dislocated"
    caption = (
        f"{COUNTED[kind][0].capitalize()} by the value of each property: of k_n, k_s and "
        "damping ratio factors on the values of the case, of friction what is added"
    )
    if telling:
        caption += ". Before it stands the share of the variance of the outcome that it explains"
        if others := [x for x in next(iter(cells.values())) if x not in telling]:
            caption += f"; {join_words(others)} explain no more than chance"
            changing = dict.fromkeys(x for each in found.values() for x in list_changing(each))
            if alone := [x for x in others if x in changing]:
                caption += f", but single changes of {join_words(alone)} alter the outcome"
        cells = {k: {x: own[x] for x in own if x in telling} for k, own in cells.items()}
    return _set_abreast(cells, "property", caption)


def _tabulate_single_changes(data: ReportData, found: Mapping[str, VerdictRange]) -> list[Grid]:
    """Tabulate the runs in which one property differs, the worst of the first motion first."""
    shown = {pair: each for pair, each in found.items() if each.what_changes}
    caption = (
        "Single changes, the worst first: outcome, if it does not stand, largest displacement, and "
        "that at the end"
    )
    if any(each.is_dislocation_worst for each in shown.values()):
        limit = DISLOCATION * shallowest_part(data.case.structure)[0]
        caption += f"; beyond {format_mm(limit)} at the end it is dislocated"
    ratios = [each.step_ratio for each in shown.values() if not each.is_quiet]
    if ratios:
        caption += f"; other time steps alone may change displacements {max(ratios):.2g} times"
    cells = {
        pair: {
            # of a fall it is the way to the ground
            x.name: x.outcome
            if x.outcome in FALLEN_STATES
            else f"{x.outcome}, ".removeprefix("stands, ")
            + f"{format_mm(x.displacement)}, {format_mm(x.residual)}"
            for x in each.single_changes
        }
        for pair, each in shown.items()
    }
    return _set_abreast(cells, "single change", caption)


def build_check_section(data: ReportData) -> Section:
    """Build the section on predicted error, energy balance and model."""
    blocks: list[Any] = [TextBlock(data.deleted, "missing")] if data.deleted else []
    if data.runs:
        head = ["run", "energy drift", "support reaction", "iterations", "halved steps"]
        head += ["predicted error", "end"]
        rows = [_check_row(data.case, name, run) for name, run in data.runs.items()]
        caption = (
            "Checks of each run. Energy drifts relative to the largest exchanged. Supports react "
            "under dead load. Iterations of Newton are the most between records"
        )
        blocks.append(Grid(head, rows, caption))
    caption = "Speed against error over fidelities, meshes and steps."
    table = "Models in the order of their errors, with times"
    blocks += data.read_result("accuracy", caption, table=table)
    return Section("Checks of the numbers", blocks)


def _check_row(case: Case, name: str, run: History) -> list[str]:
    """Row of the checks of a run."""
    attrs = run.dataset.attrs
    predicted = attrs.get("predicted_error")
    large = case.analysis.displacements == "large"
    dead = run.joints.isel(time=0, drop=True)
    ratio = supported_weight_ratio(case.structure, dead, large=large)
    return [
        name,
        f"{abs(float(attrs['energy_drift'])):.1e}",
        f"{ratio:.4f} of the weight",
        f"≤ {int(run.dataset['iterations'].max())}",
        f"{int(attrs['halved_steps'])}",
        "–" if predicted is None else f"{float(predicted):.2g} in |e|",
        run.outcome,
    ]


def supported_weight_ratio(
    structure: Structure, joints: xr.Dataset, *, large: bool = False
) -> float:
    """Return the vertical reaction of the supports relative to the weight; 1 in equilibrium [-]."""
    fixed = np.array([[structure.blocks[n].fixed for n in pair] for pair in structure.pairs])
    bears = fixed[:, 0].astype(float) - fixed[:, 1]  # a joint between two supports cancels
    # Force on the higher block of each joint (j, 2).
    force = joints["N"].values[:, None] * structure.normals
    force -= joints["V"].values[:, None] * structure.tangents
    # Large displacements turn a joint by the mean angle of its blocks, of which one is fixed.
    angle = 0.5 * bears * joints["rotation"].values * large
    vertical = force[:, 1] * np.cos(angle) + force[:, 0] * np.sin(angle)
    return float(bears @ vertical / structure.weight)
