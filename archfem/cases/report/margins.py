"""Margins of a report: checks, pushes, scales and falls across the plane over their demands."""

from collections.abc import Iterator

import numpy as np

from archfem.cases.answers import Ratios, compare_checks, read_numbers
from archfem.cases.defaults import note_loads_left_out
from archfem.cases.push_factors import PushFactors, peak_of_spectrum, site_acceleration
from archfem.cases.report.capacities import find_demand, name_spectrum
from archfem.cases.report.doubts import list_checks, object_to_motions, peak_of_ground
from archfem.cases.report.outcomes import find_worst, sentence
from archfem.cases.report.report_data import ReportData
from archfem.cases.report.scales import describe_scales
from archfem.cases.report.study_findings import OVER_SITE, find_least
from archfem.dynamics.collapse_state import COLLAPSE_STATES, FALLEN_STATES
from archfem.dynamics.rigid_body.rocking_body import describe_first_fall, say_scale
from archfem.masonry.out_of_plane import UNCHECKED_ACROSS, describe_transverse_push
from archfem.units import Ends, format_ratio
from archfem.view.pages.document import TextBlock

# What is known below the least push that a search has found, if nothing is
NO_PROOF = "may begin at any less, as no lower bound is known"

# What the ends of a range are of, where stones bear on fill
OVER_FILL = "; its range is over what is assumed of the fill"

# What is said of a push below which shaking moves a structure
NO_MARGIN = "runs that are no stronger move it, so that this is no margin"


def find_unchecked_push(data: ReportData) -> tuple[float, float] | None:
    """Return which push may overturn it across its plane, and the demand; None if it was checked.

    The push is NaN where it is unknown, as of a single stack [g].
    """
    if data.across[0] or data.other_plane or not _leaves_plane_across(data):
        return None
    return data.transverse_push, find_demand(data)


def _leaves_plane_across(data: ReportData) -> bool:
    """Return whether results of earthquakes are in the plane alone, and not of a wall across it."""
    return data.is_shaken and data.case.structure.above is None


def say_less(data: ReportData) -> Iterator[tuple[float, str, str]]:
    """Yield the least margin and the least push of studies where they are below the result's.

    They are a number, a sentence and the name of the study.
    """
    margins = [x.decisive for x in read_numbers(Ratios, data.statements.get("assessment"))]
    pushes = [x.least for x in read_numbers(PushFactors, data.statements.get("limit")) if x.site]
    site = "the least push{} is {} times the site's acceleration"
    studies = [each for each in data.own_studies if each.folder not in data.shared]
    for name, words, own in (
        ("least_margin", "the least margin{} is {}", margins),
        (OVER_SITE, site, pushes),
    ):
        least, texts, place, study = find_least(studies, name)
        fails = ", where the check fails" * (name == "least_margin" and least < 1.0)
        if least < 0.999 * min(own, default=np.inf):
            yield least, f"in {study} {words.format(*texts)}, at {place}{fails}", study


def judge_check(data: ReportData, check: Ratios) -> tuple[str, str]:
    """Return whether the structure withstands the spectrum by a check, and why its ratio fails."""
    of = name_spectrum(data)
    if check.needed:
        words = f"; it is passed only with {check.needed}"
        return f"it does not withstand under some assumptions on the fill {of}", words
    differs = compare_checks(read_numbers(Ratios, data.statements.get("assessment")))
    differs = f"on {of} it {differs}" * bool(differs)
    if check.unshown:
        words = differs or f"it is not shown to withstand {of}, by {check.range}"
        return f"{words}. {_say_test(data)}", ", a lower bound"
    if check.least < 1.0:
        return differs or f"it does not withstand {of}", ", which it fails"
    if check.by_split:
        words = ", which it fails with one weight a body"
        return differs or f"it withstands or not, by the split of weights, {of}", words
    if check.bounded:
        least = min(each.decisive for each in list_checks(data) if each.bounded)
        bound = f"its ratio, {format_ratio(least)}, is an upper bound"
        words = differs or f"it is not shown to withstand {of}, as {bound}"
        return f"{words}. {_say_test(data)}", ", an upper bound"
    if check.moved and _say_motion(data, check.least, peak_of_spectrum(data.case)):
        return f"it withstands at rest alone, and moves in the runs, {of}", ""
    return differs or f"it withstands {of}", ""


def _say_test(data: ReportData) -> str:
    """Say whether the runs decide what a ratio that is an upper bound does not."""
    if not data.runs and note_loads_left_out(data.case):
        return "No run can test it, for runs leave out the loads of [assessment]"
    if not data.runs:
        return "Time histories with large displacements under motions of this spectrum can test it"
    if objection := object_to_motions(data):
        return f"The runs do not decide, for {objection}"
    count = len(data.runs)
    motions = f"The {count} motions" if count > 1 else "The motion"
    of = "matched to" if (data.case.suite or {}).get("matched") else "of"
    decide = f"decide{'s' * (count == 1)}"
    return f"{motions} {of} this spectrum, under which it {find_worst(data)[0]}, {decide}"


def build_transverse(data: ReportData) -> list[TextBlock]:
    """Build the paragraph on what is not checked across the plane, for results of earthquakes."""
    if not _leaves_plane_across(data):
        return []
    if data.other_plane:
        plane, labels = data.other_plane
        cases = f"case{'s' * (' and ' in labels)} {labels}"
        return [TextBlock(f"It is that of {cases}.", lead=f"{plane.capitalize()}?")]
    text = describe_transverse_push(data.case.structure)
    push, demand, slide = data.transverse_push, find_demand(data), data.transverse_slide
    if push < demand:
        text += f"; the demand, {demand:.3g} g, exceeds it ({format_ratio(demand / push)} ×)"
    # the head says that it was not checked
    text = text.removeprefix(f"{UNCHECKED_ACROSS}: ") + data.across[1]
    if slide < np.inf:
        text += f"; with the thrust at rest its supports slide across at {slide:.3g} g, by the "
        text += "friction that N and V leave over, sqrt((μ N)² - V²)"
        text += f": the demand is {demand:.3g} g" * bool(slide < demand)
    elif push > 0.0:
        text += "; sliding across it was not checked"
    manner = "doubt" if min(push, slide) < demand else "plain"
    return [TextBlock(sentence(text), manner, lead="Across its plane?")]


def say_least(data: ReportData) -> Iterator[str]:
    """Yield the least margin in the plane, which the head has; that across it stands by itself."""
    found = [each for each in list_margins(data) if each[1]]
    if found and min(found)[0] not in [scale for scale, *_ in say_across(data)]:
        yield next(describe_margin(data))


def describe_margin(data: ReportData) -> Iterator[str]:
    """Yield the factors on the demands of an earthquake: margins, the least first, then pushes."""
    found = rank_margins(data)
    ranks = "the least margin is ", "the next is ", "then follows "
    for k, texts in enumerate(texts for _, is_margin, texts in found if is_margin):
        yield f"{ranks[min(k, 2)]}{texts[0]}"
        yield from texts[1:]
    for texts in (texts for _, is_margin, texts in found if not is_margin):
        yield from texts


def rank_margins(data: ReportData) -> list[tuple[float, bool, list[str]]]:
    """Return what `list_margins` yields, the least first.

    Of what a push may overturn across the plane, unchecked, the least is said to be in the plane.
    """
    margins = sorted(list_margins(data), key=lambda each: each[0])
    push, demand = find_unchecked_push(data) or (np.nan, 0.0)
    for factor, _, texts in [each for each in margins if each[1]][:1]:
        if push < demand * factor:
            texts[0] += "; it is of the plane of the drawing alone"
    return margins


def list_margins(
    data: ReportData, *, across: bool = True
) -> Iterator[tuple[float, bool, list[str]]]:
    """Yield factors on demands, whether they are margins, and sentences.

    The first sentence of a margin lacks its subject and verb. To move by a push is no collapse, and
    a study is of other properties: neither is a margin. A push below which it moves has an infinite
    factor.
    """
    checks = read_numbers(Ratios, data.statements.get("assessment"))
    ratios = sorted(_describe_check(data, each) for each in checks)
    for least, texts in [*ratios[:1], *describe_scales(data)]:
        yield least, least < np.inf, texts
    for least, at, _, body in sorted(say_across(data))[:across]:
        text = f"below {at}: {body} across the plane as one rigid body, held by nothing else"
        yield least, True, [text]
    for name in (x for x in ("limit", "pushover") if x in data.statements):
        for push in (x for x in read_numbers(PushFactors, data.statements[name]) if x.site):
            texts = [*describe_push(data, name, push)]
            least = np.inf if NO_MARGIN in texts[0] else push.least
            # the table has a plain factor, and the head any without runs
            plain = push.proved is None and push.most == push.least
            in_table = plain and not push.bounded and "pushover" in data.statements
            said = not data.runs or push.least < 1.0 or (in_table and least < np.inf)
            yield least, False, texts[said:]
    for least, words, _ in say_less(data):
        yield least, False, [words] * (bool(data.runs) and least >= 1.0)


def say_across(data: ReportData) -> Iterator[tuple[float, str, str, str]]:
    """Yield the scale at which each body across the plane first falls, in words, and the body."""
    for key, (first, name) in data.across[0].items():
        if first.scale < np.inf:
            given = data.motions[name].pga, f"'{name}'"
            at, falls = say_scale(first.scale, *given), describe_first_fall(first, *given)
            yield first.scale, at, falls, f"the {key}"


def describe_push(data: ReportData, name: str, push: PushFactors) -> Iterator[str]:
    """Yield at which multiple of the site's acceleration a push begins to move a structure."""
    elastic = name == "pushover"
    bounded = push.proved is not None  # the least found, without proof that none is less
    of = "with elastic joints" if elastic else "as rigid blocks"
    moves = _say_motion(data, push.least, site_acceleration(data.case), f", its push {of},")
    over = OVER_FILL * (push.most > push.least)
    size = f"{Ends((push.least, push.most)):ratio} times {push.site}{over}"
    text = f"pushed sideways {of} it begins to move {'at most ' * push.bounded}at {size}"
    if bounded:
        proved = push.proved and f"is proved to stand up to {format_ratio(push.proved)} times"
        text += f"; it is the least that a search found, and {proved or NO_PROOF}"
    if moves and push.least >= 1.0:  # shaken it moves before
        yield f"{text}; {NO_MARGIN}"
        return
    beside = elastic or not data.runs or "pushover" in data.statements
    less = "; elastic joints may bear less, and no pushover was computed" * (not beside)
    yield f"{text}; to move is no collapse{less}"
    if then := moves if data.runs else "shaken it may begin to move at less than by that push":
        yield then


def _describe_check(data: ReportData, check: Ratios) -> tuple[float, list[str]]:
    """Return the ratio of a check of an assessment, and its sentences."""
    over = OVER_FILL * (check.most not in (check.least, check.decisive, np.inf))
    by = f"on {name_spectrum(data)}, by {check.name}"
    moves = _say_motion(data, check.least, peak_of_spectrum(data.case))
    if check.moved is not None and moves:  # what moves at less than the push that begins it is
        begins = f"the check passes for what is at rest, and {moves}"  # judged by how far
        return check.moved, [f"{check.moved:.3g} by displacements, {by}", begins]
    _, fails = judge_check(data, check)
    if check.moved is None:
        return check.decisive, [f"{check.range}{check.beside}, {by}{fails}{over}"]
    at_rest = f"{check.range}{check._replace(moved=None).beside} until it moves"
    if_moved = f"{check.moved:.3g} by displacements, if it moved"
    ordered = [at_rest, if_moved][:: 1 if check.decisive <= check.moved else -1]  # the least first
    of_fc = "at the acceleration of the mechanism divided by FC"
    texts = [f"{', and '.join(ordered)}, {by}{fails}{over}"]
    texts.append(f"{check.range} times the spectrum begins to move it, {of_fc}")
    # what passes at rest alone is no failure
    return (min(check.decisive, check.moved) if check.moved >= 1.0 else check.decisive), texts


def _say_motion(data: ReportData, factor: float, site: float, push_of: str = "") -> str:
    """Say that a structure moves in a run no stronger than a multiple of the site's acceleration.

    It is empty if it moves in none. Without a spectrum the runs are the demand. Of a push the last
    argument says which it is.
    """
    push = np.nan_to_num(factor * site, nan=np.inf)
    runs = [run for run in data.runs.values() if peak_of_ground(run) <= push]
    verdicts = [run.verdict for run in runs]
    if not any(x.mechanisms.get("verified") or x.outcome in FALLEN_STATES for x in verdicts):
        return ""
    held = all(verdict.outcome in COLLAPSE_STATES[:2] for verdict in verdicts)
    of = f" of up to {push:.2f} g{push_of}" * (len(runs) < len(data.runs))
    return f"in the runs{of} it moves{', and falls in none' * held}"
