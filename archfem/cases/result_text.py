"""Results as text: sentences, and tables which the command line prints and the report shows."""

import logging
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from csv import writer
from io import StringIO
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from archfem._display import DOUBT_MARK, NOTE_MARK
from archfem._files import align_columns
from archfem.cases import defaults
from archfem.cases.analysis_keys import LimitAnalysis
from archfem.cases.case import Case
from archfem.cases.push_factors import PushFactors, compare_with_motion, compare_with_site
from archfem.cases.run import DeadLoadResult
from archfem.dynamics.accuracy import Accuracy
from archfem.dynamics.collapse_state import FALLEN_STATES
from archfem.dynamics.history import Ending, History
from archfem.dynamics.verdict import ALL_DEFINITIONS, Verdict, find_farthest
from archfem.errors import filter_log
from archfem.joints.criteria import assessed_joints, envelope, first_time, longest_duration
from archfem.limit.collapse import Collapse, Outcome, describe_fill
from archfem.limit.fill_strength import Fill, PlasticFill
from archfem.limit.mechanism_count import Mechanism, duration_text
from archfem.masonry.backfill import describe_held_ends
from archfem.masonry.loads import Action, Settlement, describe_massless
from archfem.masonry.out_of_plane import (
    UNCHECKED_ACROSS,
    describe_transverse_push,
    find_transverse_push,
)
from archfem.masonry.standing import describe_carried, describe_widths, find_bodies
from archfem.masonry.structure import (
    CLEAR_TURNS,
    Structure,
    join_joint_names,
    join_names,
    list_or_count,
)
from archfem.models.model import Doubt
from archfem.motion.matching import Match
from archfem.motion.motion import Motion, find_drift
from archfem.motion.response_spectra import measure_intensity
from archfem.statics.equilibrium import structure_doubts
from archfem.statics.pushover import Pushover
from archfem.statics.stress import strength_use_text, utilisation_text
from archfem.units import STANDARD_GRAVITY, format_mm, kN

# A doubt, or a line with a note
Remark = Doubt | str


@contextmanager
def record_doubts(structure: Structure) -> Iterator[list[Doubt]]:
    """Yield doubts about a structure, and the warnings of a block but those of runs."""
    doubts = structure_doubts(structure)

    def record(given: logging.LogRecord) -> bool:
        # doubts of runs are kept by the runs; interruptions and the pace are no doubts of an answer
        of_run = hasattr(given, "of_run") or any(isinstance(x, Doubt) for x in given.args or ())
        if given.levelno >= logging.WARNING and not of_run:
            # the remedy of a warning is behind its last semicolon
            doubts.append(Doubt(*given.getMessage().rsplit("; ", 1)))  # type: ignore[arg-type]
        return True

    with filter_log(record, first=True):  # a study keeps warnings from the log
        yield doubts


def mark_remarks(remarks: Iterable[Remark]) -> list[str]:
    """Return doubts and notes as lines with their marks, each once."""
    lines = (f"{DOUBT_MARK}{x}" if isinstance(x, Doubt) else x for x in remarks)
    return [*dict.fromkeys(lines)]


# Finding of a study with the doubts of a run, as results keep them
STATED_DOUBTS = "doubts, stated"

# Finding with the names of those that a search has not proved least
UPPER_BOUNDS = "upper_bounds"


def mark_bound(row: Mapping[str, Any], name: str, text: str) -> str:
    """Return the text of a finding of a point, behind "≤ " if it is an upper bound."""
    return f"≤ {text}" if name in str(row.get(UPPER_BOUNDS, "")).split(", ") else text


# What a run of a wall in bond checks across its plane
CHECKED_ACROSS = "across the plane of the drawing a run checks it as one rigid body"

# Begin of notes that are not about the least factor over what is assumed of a fill
OF_GIVEN_FILL = "with the fill as given, "


class ResultTable(NamedTuple):
    """Titles of the columns, and rows of as many cells; "-" is an empty cell."""

    head: list[str]
    rows: list[list[str]]

    @property
    def text(self) -> str:
        """The table with aligned columns, one line a row."""
        return align_columns(*self)

    @property
    def csv(self) -> str:
        """The table as comma-separated values."""
        lines = StringIO()
        writer(lines, lineterminator="\n").writerows([self.head, *self.rows])
        return lines.getvalue().rstrip()


def tabulate_joints(joints: xr.Dataset, dead: xr.Dataset | None = None) -> ResultTable:
    """Tabulate envelope and failures of the assessed joints: first time and longest duration."""
    joints = assessed_joints(joints)
    # Without dead load the column is undefined, which reads "open".
    at_rest = np.full(joints.sizes["joint"], np.nan)
    if dead is not None:
        at_rest = assessed_joints(dead)["eccentricity"].values
    extremes = envelope(joints)
    flags = {"hinge": joints["hinge"] != 0, "slide": joints["slide"], "open": joints["open"]}
    times = [(first_time(flag).values, longest_duration(flag).values) for flag in flags.values()]
    head = ["joint", "e dead", "e min", "e max", "max V/N"]
    head += [f"{flag} {column}" for flag in flags for column in ("from", "for")]
    rows = []
    for k, name in enumerate(joints["name"].values):
        numbers = [extremes[key].values[k] for key in ("lowest", "highest", "friction")]
        # A failure has a first time and a longest duration; both are empty if it never occurs.
        cells = [str(name), *map(format_ratio, (at_rest[k], *numbers))]
        for start, longest in times:
            cells += [_seconds(start[k]), _seconds(longest[k]) if longest[k] > 0.0 else "-"]
        rows.append(cells)
    return ResultTable(head, rows)


# Columns of `tabulate_runs` before those of the mechanisms
RUN_COLUMNS = (
    *("pair", "outcome", "doubts", "max |ax|", "max |ay|", "max |e|", "joint", "max V/N", "opened"),
    *("displacement", "residual"),
)


def tabulate_runs(runs: Mapping[str, History]) -> ResultTable:
    """Tabulate the runs of a suite: verdict, ground motion, critical joint, and mechanisms."""
    endings = {Ending.FINISHED: "reached", Ending.EVENT: "ended"}
    rows = []
    for name, run in runs.items():
        verdict, joints = run.verdict, assessed_joints(run.joints)
        size = abs(joints["eccentricity"])
        apart = joints["open"].any("time")
        largest = size.max("time").where(~apart, 0.5)  # |e| is undefined while a joint is open
        horizontal, vertical = run.dataset["ground"].attrs["peaks"]
        stones = verdict.fall.dislocated_stones if verdict.fall else ""
        row = [name, f"{verdict.outcome}{stones}", str(len(verdict.doubts) or "none")]
        # of a run that ended before its motion, not the PGA
        until = f" until {run.time[-1]:.2f} s" * (run.ending != Ending.FINISHED)
        row += [f"{horizontal:.2f} m/s²{until}", f"{vertical:.2f} m/s²"]
        row.append(f"{format_ratio(float(size.max()))}{verdict.until}")
        row.append(str(joints["name"].values[int(largest.values.argmax())]))
        row.append(f"{format_ratio(float(joints['friction'].max()))}{verdict.until}")
        row.append(f"{int(apart.sum())} joints" if apart.any() else "-")
        sizes = [verdict.said_displacement, format_mm(verdict.residual)]
        sizes[1] += " (moving)" * (verdict.fall is not None and not verdict.fall.resting)
        row += ["-", "-"] if verdict.outcome in FALLEN_STATES else sizes  # the way to the ground
        row += [_mechanism_cell(verdict, definition) for definition in ALL_DEFINITIONS]
        rows.append([*row, f"{endings.get(run.ending, run.ending)} {run.time[-1]:.2f} s"])
    verdicts = [run.verdict for run in runs.values()]
    counts = [_count_mechanisms(verdicts, name) for name in ALL_DEFINITIONS]
    rows.append(["all", *["-"] * (len(RUN_COLUMNS) - 1), *counts, "-"])
    return ResultTable([*RUN_COLUMNS, *ALL_DEFINITIONS, "end"], rows)


def _count_mechanisms(verdicts: Sequence[Verdict], definition: str) -> str:
    """Count the runs with a mechanism; "-" where the definition does not apply."""
    own = [x for x in verdicts if definition in x.mechanisms]
    count = sum(x.mechanisms[definition] is not None for x in own)
    # where joints were not followed to the end there may be more
    more = any(x.mechanisms[definition] is None and x.until for x in own)
    if not own or (more and not count):
        return "unknown" if own else "-"
    return f"{'≥ ' * more}{count} of {len(verdicts)}"


def describe_verdicts(runs: Iterable[History], structure: Structure) -> str:
    """Describe the verdict of a run, or how many of several runs have each outcome, in one line."""
    verdicts = [run.verdict for run in runs]
    doubtful = sum(bool(verdict.doubts) for verdict in verdicts)
    counts = f"{count_outcomes(verdicts)}; doubts in {doubtful or 'none'}"
    words = verdicts[0].headline if len(verdicts) == 1 else counts
    return "; ".join(filter(None, [words, describe_held_ends(structure)]))


def count_outcomes(verdicts: Sequence[Verdict]) -> str:
    """Say how many runs have each outcome."""
    outcomes = Counter(verdict.outcome for verdict in verdicts)
    text = ", ".join(f"{outcome} in {count}" for outcome, count in outcomes.items())
    return f"{text} of {len(verdicts)} runs"


def describe_pairs(runs: Mapping[str, History]) -> str:
    """Describe a suite: table, largest displacement of bodies on it, joints, and runs in doubt."""
    lines = ["displacements are of each motion as it is, and were not varied"]
    moved = [
        (size, f"{words}, under '{name}'")
        for name, run in runs.items()
        for size, words in find_farthest(run.dataset, run.structure)[1]
    ]
    lines += [max(moved)[1]] if moved else []
    lines += dict.fromkeys(run.verdict.assessed for run in runs.values())
    if doubtful := [name for name, run in runs.items() if run.doubts]:
        lines.append(f"in doubt, as their summaries say: {', '.join(doubtful)}")
    return "\n\n".join([tabulate_runs(runs).text, *filter(None, lines)])


def tabulate_motions(motions: Sequence[Motion]) -> ResultTable:
    """Tabulate time step and intensity measures of each component of some motions."""
    head = ["motion", "component", "samples", "dt", "PGA", "PGV", "PGD", "Arias", "CAV"]
    head += ["Housner", "D5-95", "length"]
    rows = []
    for motion in motions:
        for component in motion.components:
            measured = measure_intensity(motion, component)
            # The only component of a record may have any direction.
            row = [motion.name, component if len(motion.components) > 1 else "only one"]
            row += [str(len(motion.component(component))), f"{motion.dt:g} s"]
            row.append(f"{measured.pga / STANDARD_GRAVITY:.4f} g")
            left, _ = find_drift(motion, component)
            drift = f" (drifts: ends at {left:.2g} m/s)" * (left > 0.0)
            row += [f"{measured.pgv:.4f} m/s", f"{measured.pgd:.4f} m{drift}"]
            row += [f"{value:.3g} m/s" for value in (measured.arias, measured.cav)]
            row.append(f"{measured.housner:.3g} m")
            durations = measured.significant_duration, measured.duration
            rows.append([*row, *(f"{duration:.2f} s" for duration in durations)])
    return ResultTable(head, rows)


def tabulate_matches(matches: Sequence[Match]) -> ResultTable:
    """Tabulate misfit, and measures before and after spectral matching."""
    head = ["pair", "component", "misfit"]
    head += [word for measure in ("PGA", "PGD", "Arias", "D5-95") for word in (measure, "matched")]
    rows = []
    for match in matches:
        for component, misfit in match.misfit.items():
            before, after = match.before[component], match.after[component]
            cells = [match.motion.name, component, f"{misfit:.2%}"]
            cells += [f"{each.pga / STANDARD_GRAVITY:.4f} g" for each in (before, after)]
            cells += [f"{each.pgd:.4f} m" for each in (before, after)]
            cells += [f"{each.arias:.3g} m/s" for each in (before, after)]
            cells += [f"{each.significant_duration:.2f} s" for each in (before, after)]
            rows.append(cells)
    return ResultTable(head, rows)


def describe_dead_load(result: DeadLoadResult, *, explain: bool = False) -> str:
    """Describe size and fidelity of the model, and the use of joints and blocks at rest.

    Defaults are named in one line, or explained in a line each.
    """
    model, structure = result.dead.model, result.case.structure
    say_defaults = defaults.explain_defaults if explain else defaults.describe_defaults
    joints = assessed_joints(result.dead.joints)
    lines = [
        f"model: {model.fidelity}, {len(structure.free)} blocks, "
        f"{len(set(structure.face_names))} joints, "
        f"{model.size} coordinates ({result.seconds:.2f} s with the dead load)"
    ]
    lines += [] if model.prediction is None else [f"model: {model.prediction.text}"]
    # without equilibrium there is no result; doubts may be about it, and are printed below
    doubted = ", in doubt as below" if result.doubts else ""
    # a steep bed of a wall in bond is not the worst of a ring and of its piers
    walls = np.unique(result.dead.joints["part"].values[structure.heads])
    beds = np.isin(joints["part"].values, walls)
    first = joints if beds.all() else joints.isel(joint=~beds)
    lines.append(f"dead load: stands under its own weight{doubted}: {_describe_largest(first)}")
    if (idle := joints["name"][joints["N"] <= 1e-6 * joints["N"].max()]).size:
        lines[-1] += f", as nothing is carried by {join_joint_names(idle.values.tolist())}"
    used = result.dead.joints["friction"].values >= (1.0 - 1e-3) * structure.friction
    if spent := int(np.count_nonzero(used & structure.judged)):
        lines[-1] += f"; V/N is μ at {spent} joint{'s' * (spent > 1)}, which makes no mechanism"
    if 0 < beds.sum() < len(beds):
        own = _describe_largest(joints.isel(joint=beds))
        lines[-1] += f"; of beds of {join_names(walls.tolist())}, {own}"
    if structure.heads.any():
        heads = result.dead.joints.isel(joint=structure.heads)
        lines[-1] += f"; of head joints, which do not count, {_describe_largest(heads)}"
    lines += [
        *defaults.describe_margins_at_rest(result.case, structure),
        *note_masses(structure, parapets=result.case.parapets),
    ]
    lines += [*defaults.note_limit(result.case), *defaults.note_loads_left_out(result.case)]
    across = describe_transverse_push(structure)
    if result.case.has_motion and structure.heads.any():
        across = across.replace(UNCHECKED_ACROSS, CHECKED_ACROSS)
    lines += filter(None, [structure.assessment, across, say_defaults(result.case)])
    if result.strength_use is not None:
        lines.append(f"dead load: {strength_use_text(result.strength_use)}")
    return "\n".join([*lines, *mark_remarks(result.doubts)])


def _describe_largest(joints: xr.Dataset) -> str:
    """Return the largest |e| and V / N of joints, and their smallest compression."""
    return (
        f"|e| ≤ {float(abs(joints['eccentricity']).max()):.3f}, "
        f"V/N ≤ {float(joints['friction'].max()):.3f}, N ≥ {float(joints['N'].min()) / kN:.2f} kN"
    )


def describe_collapse(
    structure: Structure, collapse: Collapse, limit: LimitAnalysis, parapets: float = 0.0
) -> str:
    """Describe the result of limit analysis: load, hinges, sliding, crushing, and the fill."""
    faces, joints = structure.face_names, structure.joints
    sides = (f"{faces[k]} at the {joints[k].name_face(side)}" for k, side in collapse.hinges)
    hinges = list(dict.fromkeys(sides))
    sliding = list(dict.fromkeys(faces[k] for k in collapse.sliding))
    lines = [f"limit analysis: {collapse.sentence}"]
    both = len({faces[k] for k, _ in collapse.hinges} & {*sliding})
    slides = list_or_count(sliding, f"{both} of which hinge too, drawn in the picture")
    turns = list_or_count(hinges, CLEAR_TURNS)
    lines += [f"hinges, by the face in contact: {turns}"] if hinges else []
    lines += [f"sliding: {slides}"] if sliding else []
    yielding = "if bonds yield: " * bool(collapse.bonded)
    lines += [f"{yielding}{collapse.solutions}"] if collapse.solutions else []
    if collapse.over_fill:
        unit, name = abs(collapse.push) or 1.0, " g" * bool(collapse.push)
        lines.append(collapse.over_fill.describe_states(unit, name=name))
    crushing = limit.describe_crushing(structure)
    lines += filter(None, [crushing, describe_fill(limit.fill, structure)])
    lines += note_collapse(structure, collapse, limit, parapets)
    if structure.heads.any() and collapse.outcome is Outcome.COLLAPSES and collapse.push:
        lines.append(
            "blocks are rigid, and elastic joints may bear less: hold a push of "
            f"{0.9 * collapse.factor * collapse.push:.3g} g, a tenth below, by [motion] held"
        )
    return "\n".join(lines)


def note_collapse(
    structure: Structure, collapse: Collapse, limit: LimitAnalysis, parapets: float = 0.0
) -> list[str]:
    """Return the notes on a limit analysis: on crowns, on masses, and on the fill as given."""
    notes = note_lower_crowns(structure, limit.fill)
    notes += note_masses(structure, collapse.live, collapse.dead, parapets)
    if collapse.push and find_transverse_push(structure)[0] < collapse.factor * abs(collapse.push):
        notes.append(f"{NOTE_MARK}{describe_transverse_push(structure)}")
    return [*notes, *(f"{NOTE_MARK}{OF_GIVEN_FILL}{note}" for note in collapse.notes)]


def note_masses(
    structure: Structure,
    live: Settlement | Sequence[Action | Settlement] = (),
    dead: Sequence[Action] = (),
    parapets: float = 0.0,
) -> list[str]:
    """Return notes on loads that are not pushed as weights are, and on masses at other heights."""
    words = [describe_massless(live, dead), describe_carried(structure), describe_widths(structure)]
    if parapets and not any("parapet" in name.lower() for name in find_bodies(structure)):
        points = np.concatenate([structure.blocks[number].points for number in structure.free])
        weight = parapets * float(np.ptp(points[:, 0]))
        words.append(
            f"parapets of [rating], {parapets / kN:g} kN/m, are left out here: {weight / kN:.3g} "
            f"kN, {weight / structure.weight:.1%} of the weight; as a body "
            "[structure.standing.parapets] they weigh and are pushed"
        )
    return [f"{NOTE_MARK}{each}" for each in words if each]


def note_lower_crowns(structure: Structure, fill: Fill | PlasticFill | None) -> list[str]:
    """Return a note on the fill above lower rings, where the crowns of rings differ."""
    crowns = dict[str, float]()
    for block in structure.blocks:
        if block.role == "ring":
            crown = float(block.drawn()[:, 1].max())
            crowns[block.part] = max(crown, crowns.get(block.part, crown))
    low, high = min(crowns.values(), default=0.0), max(crowns.values(), default=0.0)
    # chords of rings of odd and of even numbers of stones differ by less
    if not isinstance(fill, Fill) or high - low < 0.01:
        return []
    by = f"crowns differ by {high - low:.2f} m: fill above '{min(crowns, key=crowns.__getitem__)}'"
    return [f"{NOTE_MARK}{by} bears none of the passive pressure of a higher ring"]


def describe_limit(
    case: Case, found: Collapse, opposite: Collapse | None
) -> tuple[Collapse, str, "PushFactors | None"]:
    """Return the lesser result of a load in both senses, the text on both, and their multiples."""
    others, site = [], compare_with_site(case, found, opposite)
    if opposite is not None:
        close = np.allclose(opposite.range, found.range, rtol=1e-4)
        if _order_senses(opposite) < _order_senses(found) and not close:
            found, opposite = opposite, found
        rank = _compare_senses(found, opposite)
        others.append(f"in the other sense: {opposite.sentence} ({rank})")
    others += filter(None, [defaults.describe_fill_defaults(case)])
    beside = f"{site} times {site.site}" if site else compare_with_motion(case, found)
    said = ""  # a sense without a state may bear less
    if site and Outcome.BRACKETED not in (found.outcome, opposite and opposite.outcome):
        said = f"a push by the ground {site.outcome}: "
    others += [f"{said}it begins to move at {beside}"] * bool(beside)
    others += defaults.note_loads_left_out(case)
    text = describe_collapse(case.structure, found, case.limit, case.parapets)
    return found, "\n".join([text, *others]), site


def _order_senses(found: Collapse) -> tuple[float, ...]:
    """Return the order of a sense: the least found, then the least bound, then one without end."""
    if found.outcome is Outcome.BRACKETED:
        return 1, found.upper
    return 2 * int(np.isinf(found.range[0])), *found.range


def _compare_senses(found: Collapse, opposite: Collapse) -> str:
    """Say whether a load bears more in the other sense, by results whose least is the first's."""
    rank = "higher" if opposite.range[0] > found.range[1] else "their ranges overlap"
    if rank != "higher" and opposite.outcome is Outcome.BRACKETED:
        return "which sense bears less is not known"
    if found.over_fill and opposite.over_fill:
        least, other = found.over_fill.values, opposite.over_fill.values
        rank = "higher" if all(other.get(key, 0.0) > least[key] for key in least) else rank
    if np.allclose(opposite.range, found.range, rtol=1e-4):
        rank = "the same"
    searched = any(each.solutions and each.solutions.may_be_less for each in (found, opposite))
    return f"{rank}, as far as a search can tell" if searched else rank


def describe_pushover(structure: Structure, push: Pushover, notes: Sequence[str]) -> str:
    """Describe a pushover: factor, end, the joints in the order in which they hinge, notes."""
    turning = [(structure.joints[number], side) for number, side in push.hinges]
    hinges = [f"{joint.name} at the {joint.name_face(side)}" for joint, side in turning]
    turns = [f"hinges in turn: {join_names(hinges, '; ')}"] if hinges else []
    return "\n".join([f"pushover: {push.sentence}", *turns, *notes])


def describe_accuracy(accuracy: Accuracy) -> str:
    """Describe a comparison of settings: table, reference, and the setting to choose."""
    choice = accuracy.choice.setting.label if accuracy.choice else "none: a finer model is needed"
    return (
        f"{accuracy.table()}\n\n"
        f"reference: {accuracy.reference.label}, in doubt by {accuracy.reference_error:.2g}\n"
        f"chosen for an error of {accuracy.tolerance:g}: {choice}"
    )


def describe_run(
    structure: Structure,
    run: History,
    dead: xr.Dataset,
    max_joints: int | None = None,
    across: str = "",
) -> str:
    """Describe a run: verdict, quality of the numbers, joints, and use of strength.

    With `max_joints` the table has as many joints, those of the largest |e|. The headline ends with
    a fall across the plane.
    """
    strength = utilisation_text(structure, run.joints)
    whole = tabulate_joints(run.joints, dead)
    table = whole.text
    if max_joints is not None and len(whole.rows) > max_joints:
        extremes = envelope(assessed_joints(run.joints))
        size = np.maximum(-extremes["lowest"].values, extremes["highest"].values)
        size = np.nan_to_num(size, nan=0.5)  # open throughout
        worst = np.sort(np.argsort(-size, kind="stable")[:max_joints])
        table = ResultTable(whole.head, [whole.rows[k] for k in worst]).text
        table += f"\n{max_joints} of {len(whole.rows)} joints, those of the largest |e|: "
        table += "summary.txt has all"
    head, line, verdict = str(run.verdict).partition("\n")
    verdict = f"{head}{across}{line}{verdict}"
    return "\n\n".join([verdict, describe_run_quality(run), table, strength])


def describe_run_quality(run: History) -> str:
    """Describe how a run was computed, and the checks of its numbers."""
    attrs = run.dataset.attrs
    # Only fidelity "auto" predicts the error of its model and time step.
    predicted = 'its error in |e| was not predicted, as fidelity = "auto" does'
    if "predicted_error" in attrs:
        predicted = f"predicted to err by {attrs['predicted_error']:.2g} in the largest |e|"
    return (
        f"outcome: {run.outcome}; {attrs['steps']} steps by '{attrs['method']}'\n"
        f"energy: drifts by {attrs['energy_drift']:+.1e} of the largest exchanged at most\n"
        f"model: fidelity '{attrs['fidelity']}', {predicted}"
    )


def format_ratio(value: float) -> str:
    """Format e or V / N, which is undefined at open joints and unbounded near opening."""
    if np.isnan(value):
        return "open"
    return f"{value:z.3f}" if value < 100.0 else "> 100"


def _mechanism_cell(verdict: Verdict, definition: str) -> str:
    """Return the cell of a mechanism, and of the first larger one if it is too small to matter."""
    if definition not in verdict.mechanisms:  # it does not apply, or the structure is unknown
        return "-"
    found = verdict.mechanisms[definition]
    first = _say_course(verdict, found)
    if found is None or found.below is None or found.larger is None:
        return first
    return f"{first}; beyond {format_mm(found.below)} {_say_course(verdict, found.larger)}"


def _say_course(verdict: Verdict, found: Mechanism | None) -> str:
    """Return class, time, duration and displacement of a mechanism in a few words."""
    if found is None:
        return f"none{verdict.until}"
    assert found.duration is not None  # a run has a duration
    opening = "" if found.opening is None else f", {format_mm(found.displacement)}"
    return f"{found.kind} {found.time:.2f} s, {duration_text(found.duration)}{opening}"


def _seconds(value: float) -> str:
    """Format a time or a duration; "-" if undefined, and a bound for parts of a millisecond."""
    return "-" if np.isnan(value) else "< 0.001 s" if 0.0 < value < 5e-4 else f"{value:.3f} s"
