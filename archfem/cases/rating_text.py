"""Ratings of bridges in words: statements, tables, doubts and notes."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from archfem._display import NOTE_MARK
from archfem.cases import defaults
from archfem.cases.analysis_keys import LimitAnalysis
from archfem.cases.answers import Row, Statement
from archfem.cases.case import Case
from archfem.cases.result_text import Remark, ResultTable, mark_remarks, note_lower_crowns
from archfem.limit.fill_strength import as_pressure
from archfem.limit.instability import describe_geometric_factor
from archfem.limit.rating import Rating
from archfem.masonry.structure import join_words
from archfem.models.model import Doubt
from archfem.units import format_ratio

# Note on abutments, which a rating varies
IMMOVABLE = "abutments are taken as immovable"

# Note on the stiffness of joints, which counts for nothing in limit analysis
RIGID_JOINTS = (
    "joints are rigid in this factor: with elastic ones and large displacements three rings bore "
    "0.45 of theirs, and with joints ten times as stiff 0.7; repeat the worst place by "
    'archfem pushover, displacements = "large" and control = "path", with the k_n of these joints'
)

# All that is unfavourable in the variations of a rating, which may be left out
ALL_AT_ONCE, NOT_COMPUTED = "all unfavourable at once", "not computed"
AT_ONCE_BY_CS454 = f"{ALL_AT_ONCE}, by CS 454"

# Begin of the doubt of a bridge that fails without what is assumed, which are the next words
ONLY = "the bridge passes only with "


def state_ratings(
    rated: Sequence[tuple[Rating, Sequence[Remark]]], varied: ResultTable | None = None
) -> Statement:
    """State the factor of each vehicle, by codes too, least first; sentences are of the first.

    `varied` has the factors of one of them with other properties.
    """
    rows, first = list[tuple[float, Row]](), rated[0][0]
    for found, _ in rated:
        for code, each in {"": found, **found.by_codes}.items():
            demand, words = f"{found.vehicle.name} {code}".strip(), each.short_outcome
            at, flips = f", {each.place}" if each is found else "", ""
            own = varied is not None and varied.head[0] == f"{found.label} with"
            if varied and own and each.passes and "CS 454" not in code:  # on one axle, no multiple
                flips = _say_flips(each.factor / found.factor, varied)
            stands = not np.isnan(each.factor)
            at += "".join(f"; {x}" for x in (*(each.say_losses() if stands else []), flips) if x)
            least, state = each.least, ", ".join(of for _, of in each.list_losses() if stands)
            if varied and own:
                least, state = _compare_at_once(each, code, found.factor, varied, state)
            factor = "-" if np.isnan(each.factor) else format_ratio(each.factor, 4)
            numbers = {"passes": bool(each.passes), "least": least} | (
                {"state": state} if state else {}
            )
            rows.append((each.factor, Row("rating", demand, f"{words}{at}", factor, numbers)))
    sentences = [repr(first)]
    if not np.isnan(first.factor):
        outcome, *others = first.clauses
        outcome = f"rating for {first.vehicle.name}: {first.said_factor}, {outcome}"
        sentences = [outcome, f"worst {first.place}", *others]
    if len(rated) > 1:
        least, code = first.rank
        words = f", {least:.4g} {code}" * bool(code)
        sentences.append(f"of {len(rated)} vehicles it has the least factor{words}")
    sentences += [*first.describe_codes(), *first.describe_pressure(), *first.describe_backing()]
    least_first = [row for _, row in sorted(rows, key=lambda each: each[0])]
    stated = Statement(sentences, least_first)
    return stated.with_remarks([each for _, own in rated for each in own])


def _compare_at_once(
    rated: Rating, code: str, given: float, varied: ResultTable, state: str
) -> tuple[float, str]:
    """Return the least factor, with all that is unfavourable at once too, and its state in words.

    `given` is the factor of the varied vehicle. With an impact on one axle that is no share of it.
    """
    by_axle = "CS 454" in code and len(rated.by_cs454) > 0
    cell = dict(varied.rows).get(AT_ONCE_BY_CS454 if by_axle else ALL_AT_ONCE, "-")
    if cell in ("-", NOT_COMPUTED):
        return rated.least, ", ".join(filter(None, [state, f"{ALL_AT_ONCE} {NOT_COMPUTED}"]))
    share = 1.0 if by_axle else rated.factor / given
    factor = share * float(cell.replace("does not stand", "0"))
    return (factor, ALL_AT_ONCE) if factor < rated.least else (rated.least, state)


def _say_flips(share: float, varied: ResultTable) -> str:
    """Say with which properties a bridge that passes fails, by a multiple of their factors."""
    factors = {
        name: share * float(cell.replace("does not stand", "0"))
        for name, cell in varied.rows
        if cell not in ("-", NOT_COMPUTED) and name != AT_ONCE_BY_CS454
    }
    fails = [f"{name} ({x:.3g})" for name, x in factors.items() if x < 1.0]
    return f"fails with {join_words(fails)}" * bool(fails)


def tabulate_ratings(ratings: Iterable[Rating]) -> ResultTable:
    """Tabulate the ratings of a bridge for several vehicles."""
    rows, columns, rated = [], list[str](), list(ratings)
    by_codes = any(found.rank[1] for found in rated)
    for found in rated:
        columns, numbers = [*found.factors], found.factors.values()
        cells = ["-" if np.isnan(value) else f"{value:.4g}" for value in numbers]
        values = {"live": found.live, "impact": found.impact}
        by = ("none" if key in found.missing else f"{x:g}" for key, x in values.items())
        first, *others = found.clauses
        outcome = "; ".join([f"{first}, {found.place}", *others])
        least, code = found.least_by_codes
        cells += [f"{least:.4g} {code.partition(' (')[0]}".strip()] * by_codes
        rows.append([found.vehicle.name, " × ".join(by), *cells, outcome])
    columns += ["least by codes"] * by_codes
    head = ["vehicle", "live × impact", *(column.replace("_", " ") for column in columns)]
    return ResultTable([*head, "outcome, and axles at the worst place"], rows)


def describe_ratings(
    case: Case, rated: Sequence[tuple[Rating, Sequence[Remark]]], varied: ResultTable | None = None
) -> tuple[str, dict[str, str]]:
    """Return the text of ratings and their doubts, and this and its tables as files."""
    lines = [[*str(found).splitlines(), *mark_remarks(own)] for found, own in rated]
    files, tables = {"rating.csv": rated[0][0].table()}, list[str]()
    if len(rated) > 1:
        summary = tabulate_ratings([found for found, _ in rated])
        files["vehicles.csv"] = summary.csv
        pairs = zip(summary.rows, rated, strict=True)
        short = [[*row[:-1], x.short_outcome] for row, (x, _) in pairs]
        tables = [ResultTable([*summary.head[:-1], "outcome"], short).text]
        common = [line for line in lines[0] if all(line in other for other in lines)]
        lines = [[line for line in own if line not in common] for own in lines]
        lines.append(["of all vehicles:", *common])
    at_rest = "" if np.isnan(rated[0][0].factor) else _describe_standing(case)
    of_case = [at_rest, defaults.describe_fill_defaults(case)]
    texts = [*tables, *("\n".join(each) for each in lines), *of_case]
    files["rating.txt"] = "\n\n".join(filter(None, texts))
    if varied is None:
        return files["rating.txt"], files
    files["rating_variations.csv"] = varied.csv
    return f"{files['rating.txt']}\n\n{varied.text}", files


def _describe_standing(case: Case) -> str:
    """Say that a bridge stands under its own weight, with its factor of safety."""
    limit, left_out = case.limit, defaults.say_loads_left_out(case)
    depth = describe_geometric_factor(case.structure, limit.strength, limit.fill)
    without = ", without parapets" * bool(case.parapets)
    return f"it stands under its own weight{left_out}{without}{f': {depth}' * bool(depth)}"


def doubt_rating(found: Rating, limit: LimitAnalysis) -> list[Remark]:
    """Return doubts about a rating, equilibrium and a strength left out, and notes."""
    if np.isnan(found.factor):
        words = "limit analysis finds no equilibrium of the bridge under its own weight"
        return [Doubt(words, "check the thickness of its rings and piers, and the fill")]
    lines = list[Remark]()
    if limit.strength is None and found.crushing_text:
        words = "joints do not crush, as no strength of the stones is given: "
        remedy = "give strength in [materials] or [limit]"
        lines.append(Doubt(f"{words}{found.crushing_text}", remedy))
    lines += _doubt_assumed(found)
    if "from memory" in str(found):
        words = "values from memory were not compared with the text of their code"
        lines.append(f"{NOTE_MARK}{words}: look them up before you sign")
    if (fill := as_pressure(found.fill)) is not None:
        least = fill.active / fill.passive_coefficient**2  # over the passive pressure
        if fill.mobilisation < least:
            words = f"mobilisation {fill.mobilisation:.2g} counts as {least:.2g}, the active"
            lines.append(f"{NOTE_MARK}{words} pressure; 0 is not without pressure, which is beside")
    structure = found.structure
    lines += note_lower_crowns(structure, found.fill)
    lines.append(f"{NOTE_MARK}{RIGID_JOINTS}")
    rings = [joint for joint in structure.joints if joint.role == "ring"]
    if any(structure.blocks[number].fixed for joint in rings for number in joint.blocks):
        words = 'state = "free" tests them, of [structure.sidewalls]'
        lines.append(f"{NOTE_MARK}{IMMOVABLE}: {words}")
    left_out = ["a second lorry that meets the vehicle", "all that spandrel walls carry"]
    if not found.parapets:
        left_out.append('parapets (their weight is parapets = "… kN/m" of [rating])')
    return [*lines, f"{NOTE_MARK}left out: {join_words(left_out)}"]


def _doubt_assumed(found: Rating) -> Iterator[Doubt]:
    """Yield doubts of a bridge that passes only with what is assumed, also by codes."""
    only = dict[str, list[str]]()
    for code, each in {"": found, **found.by_codes}.items():
        if each.passes and each.needed:
            only.setdefault(each.needed, []).append(code and f"{found.vehicle.name} {code}")
    for needed, of in only.items():
        by = f", for {join_words(of)}" * all(of)
        remedy = "show by tests that these act, or judge by the least factor"
        yield Doubt(f"{ONLY}{needed}{by}", remedy)
