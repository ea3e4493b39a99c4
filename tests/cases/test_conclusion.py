"""Sentences of a report's conclusion: margins, doubts by weight, and what was not varied."""

import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
import xarray as xr
from loose_blocks import BREADTH, HEIGHT, G, overturns, sine
from pages import head_of

import archfem as af
from archfem._files import read_sealed_json, write_sealed_json
from archfem.cases import answers
from archfem.cases.push_factors import PushFactors, site_acceleration
from archfem.cases.report import (
    capacities,
    conclusion,
    doubts,
    margins,
    outcomes,
    report_data,
    response,
    sections,
)
from archfem.cases.report.outcomes import sentence
from archfem.cases.report.report import _collect_data
from archfem.cases.report.report_data import ReportData, label_parts
from archfem.cases.report.scales import find_first_failures
from archfem.cases.report.study_findings import collect_findings, say_what_changes
from archfem.cases.result_text import UPPER_BOUNDS
from archfem.cases.run import MOTION_VARIABLE
from archfem.cases.toml_file import format_tables
from archfem.commands import margin
from archfem.dynamics import VerdictRange
from archfem.dynamics.collapse_state import RANGE_REMEDY
from archfem.dynamics.rigid_body.rocking_body import FirstFall
from archfem.dynamics.walls_across import (
    check_across,
    describe_falls_across,
    find_falls_across,
)
from archfem.errors import InvalidInput
from archfem.masonry.out_of_plane import UNCHECKED_ACROSS, find_transverse_push
from archfem.models.model import Doubt, read_doubts, write_doubts
from archfem.statics.assessment_checks import UPPER_BOUND, AssessmentCheck
from archfem.studies import variations
from archfem.studies.fragility import Rate
from archfem.units import format_ratio

SPECTRUM = {"spectrum": {"code": "EC8", "ag": 0.2, "ground": "A"}}


def verdict_of(outcome="stands", displacement=0.1, doubts=(), verified=None):
    """A made-up verdict of a run."""
    return SimpleNamespace(
        outcome=outcome,
        displacement=displacement,
        residual=0.0,
        doubts=doubts,
        mechanisms={"verified": verified},
        incomplete="",
        fall=None,
    )


def data_of(case, found=None, **verdicts):
    """Data of a report with made-up verdicts by motion."""
    runs = {
        name: SimpleNamespace(
            verdict=verdict,
            dataset=xr.Dataset(
                {
                    "ground": (("t", "x"), [[2.0, 0.0]]),
                    MOTION_VARIABLE: (("sample", "axis"), [[2.0, 0.0]] * 2, {"dt": 0.01}),
                },
                attrs={"motion": name, "pga": 2.0, "fidelity": ""},
            ),
        )
        for name, verdict in verdicts.items()
    }
    data = ReportData(case, runs)
    vars(data)["verdict_ranges"] = () if found is None else (found,)
    vars(data)["dead"] = None
    return data


def state(result, *numbers, words="in words", factor="1.1"):
    """A made-up statement of a result, whose sentences have none of its numbers."""
    rows = [answers.Row(result, words, words, factor, each._asdict()) for each in numbers]
    return answers.Statement([words], rows)


def scales(motion, held, **given):
    """Made-up results of a search of scales under a motion of 0.2 g: states, and other fields."""
    states = ("tension", "moves", "dislocated", "falls", "mechanism")
    found = {name: given.pop(name) for name in states if name in given}
    return answers.Scales(motion, 0.2, held, found, given.pop("unfinished", False), **given)


def words_of(data):
    """Return the paragraphs of the conclusion."""
    return [x.text for x in conclusion.build_conclusion(data).pieces if x.kind == "words"]


def say_margin(data, **statements):
    """Sentences on the margin of made-up results."""
    vars(data)["statements"] = statements
    return [*margins.describe_margin(data)]


def range_of(*displacements, outcome="stands", motion="first", sampled=False, error=""):
    """Made-up variations under a motion, of which the first has changed nothing."""
    count = len(displacements)
    rows = {"displacement": displacements, "residual": np.zeros(count)}
    rows |= {"outcome": [outcome] + ["stands"] * (count - 1)}
    rows |= {"error": [error] + [""] * (count - 1)}
    rows |= {"sampled": [sampled] + [True] * (count - 1), "dt": ["as given"] * count}
    columns = {name: ("run", np.asarray(values)) for name, values in rows.items()}
    return VerdictRange(xr.Dataset(columns, attrs={"properties": ["dt"], "motion": motion}))


@pytest.fixture
def case():
    """A case whose runs are made up."""
    return af.Case.of(
        {
            "title": "stack",
            "structure": {"shape": "column", "breadth": 0.5, "heights": [1.0, 1.0]},
            "model": {"fidelity": "rigid", "displacements": "large"},
            "motion": {"synthetic": {"duration": 1.0, "pga": 1.0}},
        }
    )


def test_equal_doubts_of_runs_are_one_with_the_range_of_its_numbers(case):
    """Numbers in names of joints are no values; a run may have several doubts of a kind."""
    words = "rigid differs by {:.3g} in |e|, of joint {} by {:mm}"
    one, two, three = (
        Doubt(words, "take faces", values)
        for values in ((0.092, "4", 0.012), (0.1, "4", 0.008), (0.053, "5", 0.009))
    )
    every = {"a": [one], "b": [two], "c": [three, Doubt("it turns")]}
    data = data_of(case, **{name: verdict_of(doubts=each) for name, each in every.items()})
    assert [f"{each}" for _, each in doubts.list_doubts(data)] == [
        "2 of 3 runs: rigid differs by 0.092 to 0.1 in |e|, of joint 4 by 8 to 12 mm; take faces",
        "1 of 3 runs: rigid differs by 0.053 in |e|, of joint 5 by 9 mm; take faces",
        "1 of 3 runs: it turns",
    ]
    alone = data_of(case, a=verdict_of(doubts=[one]))
    assert [each.cause for _, each in doubts.list_doubts(alone)] == [one.cause]
    assert read_doubts(write_doubts([one, two])) == (one, two)


def test_doubts_that_differ_in_numbers_and_examples_are_one_with_the_first_example(case):
    words = "joints that are not assessed fail: {}"
    given = [Doubt(words, "count them", (k,), example=f"joint {k}") for k in (3, 18)]
    assert read_doubts(write_doubts(given)) == tuple(given)
    data = data_of(case, a=verdict_of(doubts=given[:1]), b=verdict_of(doubts=given[1:]))
    (text,) = (str(doubt) for _, doubt in doubts.list_doubts(data))
    assert text == (
        "2 of 2 runs: joints that are not assessed fail: 3 to 18; for example joint 3; count them"
    )


def test_the_weightiest_doubts_of_a_result_are_not_folded_away(case):
    """Those that a range answers are of the outcome."""
    causes = [Doubt(f"it slips {k} times") for k in range(3)]
    causes += [Doubt("joints let it fall", RANGE_REMEDY)]
    causes += [Doubt("as rigid blocks none falls", f"{RANGE_REMEDY}, and check the stiffness")]
    data = data_of(case, a=verdict_of(doubts=causes))
    (text,) = (
        each.text
        for each in conclusion.build_conclusion(data).pieces
        if getattr(each, "text", "").startswith("In doubt")
    )
    assert text == (
        "In doubt, time histories: Joints let it fall. As rigid blocks none falls. It slips 0 "
        "times. 2 more: see section 'Response'."
    )


@pytest.mark.parametrize(
    ("outcomes", "verified", "moves"),
    [
        (("stands", "dislocated"), "rocks", "in the runs it moves, and falls in none"),
        (("stands", "stands"), None, ""),
        (("stands", "fallen"), None, "in the runs it moves"),
    ],
)
def test_a_push_is_no_margin_of_what_moves(case, outcomes, verified, moves):
    verdicts = (verdict_of(each, verified=verified) for each in outcomes)
    data = data_of(case, **{f"m{k}": each for k, each in enumerate(verdicts)})
    site = "the site's 0.2 g"
    bounded, elastic = PushFactors(1.04, 1.04, site, 0.9), PushFactors(1.02, 1.02, site)
    stated = {"limit": state("limit analysis", bounded), "pushover": state("pushover", elastic)}
    end = "to move is no collapse"
    if moves:
        end = "runs that are no stronger move it, so that this is no margin"
    said = [
        f"pushed sideways as rigid blocks it begins to move at 1.04 times {site}; it is the least "
        f"that a search found, and is proved to stand up to 0.9 times; {end}",
        f"pushed sideways with elastic joints it begins to move at 1.02 times {site}; {end}",
    ]
    # the table has a plain factor
    assert say_margin(data, **stated) == (said if moves else said[:1])
    unproved = {"limit": state("limit analysis", PushFactors(1.04, 1.04, site, 0.0))}
    assert f"found, and {margins.NO_PROOF}; {end}" in say_margin(data, **unproved)[0]
    less = {"limit": state("limit analysis", PushFactors(0.9, 0.9, site))}
    end = "to move is no collapse; elastic joints may bear less, and no pushover was computed"
    least = f"pushed sideways as rigid blocks it begins to move at 0.9 times {site}; {end}"
    # the head has it
    assert say_margin(data, **less) == [*filter(None, [moves])]
    assert sentence(least) in head_of(conclusion.list_facts(data))
    shaken = "shaken it may begin to move at less than by that push"
    assert say_margin(data_of(case), **less) == [shaken]


@pytest.mark.parametrize(("factor", "counts"), [(1.03, True), (1.01, False)])
def test_a_run_stronger_than_a_push_says_nothing_of_it(case, factor, counts):
    """The run has 2 m/s², 1.02 times the 0.2 g of the site."""
    data = data_of(case, a=verdict_of(verified="rocks"))
    vars(data)["case"] = af.Case.of({**case.settings, "assessment": SPECTRUM})
    found = state("limit analysis", PushFactors(factor, factor, "the site's 0.2 g"))
    (text,) = say_margin(data, limit=found)
    assert ("is no margin" in text) == counts


def test_runs_up_to_a_push_are_said_with_the_push(case):
    """Of 1.5 and 2 m/s² the first is below 0.9 × 0.2 g, which is 1.77 m/s²."""
    data = data_of(case, a=verdict_of(verified="rocks"), b=verdict_of())
    data.runs["a"].dataset.attrs["pga"] = 1.5
    vars(data)["case"] = af.Case.of({**case.settings, "assessment": SPECTRUM})
    push = PushFactors(0.9, 0.9, "the site's 0.2 g")
    for name, of in (("limit", "as rigid blocks"), ("pushover", "with elastic joints")):
        said = say_margin(data, **{name: state(name, push)})[-1]
        assert said == f"in the runs of up to 0.18 g, its push {of}, it moves, and falls in none"


@pytest.mark.parametrize("verified", ["rocks", None])
def test_a_check_of_what_begins_to_move_is_one_of_displacements_where_it_moves(case, verified):
    data = data_of(case, a=verdict_of(verified=verified))
    vars(data)["case"] = af.Case.of({**case.settings, "assessment": SPECTRUM})
    found = state("assessment", answers.Ratios("code", ["right"], 1.1, 1.1, moved=0.842))
    expected = [
        "the least margin is 0.842 by displacements, if it moved, and 1.1 until it moves, on the "
        "EC8 spectrum of PGA 0.2 g, by code, right",
        "1.1 times the spectrum begins to move it, at the acceleration of the mechanism divided by "
        "FC",
    ]
    if verified:
        expected = [
            "the least margin is 0.842 by displacements, on the EC8 spectrum of PGA 0.2 g, by "
            "code, right",
            "the check passes for what is at rest, and in the runs it moves, and falls in none",
        ]
    assert say_margin(data, assessment=found) == expected


def test_the_margin_of_scales_ends_where_it_is_dislocated(case):
    """Each state is at its least scale of all motions, with the motion."""
    every = [
        scales("a", 1.38, moves=0.85, moves_in_all=True, dislocated=1.41, falls=4.5),
        scales("b", 2.0, falls=2.1),
        scales("c", 0.0, falls=1.0),
    ]
    data = data_of(case)
    vars(data)["pairs"] = ("a", "b", "c", "d")
    assert say_margin(data, scale=state("scale", *every)) == [
        "the least margin is 1.38 on 'a', at a PGA of 0.276 g, of 2 motions",
        "no scale is known up to which it stands under 'c'",
        "'d' was not scaled",
    ]
    small = scales("a", 0.5, mechanism=0.55)
    assert say_margin(data, scale=state("scale", small))[0] == (
        "the least margin is 0.500 on 'a', at a PGA of 0.1 g, beyond which it fails, under one "
        "motion"
    )
    # an unfinished search is no margin, unless one of its runs fails
    for least, begin, end in (
        (
            1.3,
            "it stands at a scale of",
            ", under one motion: no margin, as a search is unfinished",
        ),
        (0.9, "the least margin is", ", beyond which it fails, under one motion"),
    ):
        begun = scales("a", 0.7, unfinished=True, moves=0.5, falls=least)
        assert say_margin(data, scale=state("scale", begun))[0] == (
            f"{begin} 0.700 so far (search unfinished) on 'a', at a PGA of 0.14 g{end}"
        )
        (fall,) = find_first_failures(data)
        at = f"at {0.2 * least:.3g} g, {least:#.3g} × the motion"
        assert fall == f"falls {at}; the search is unfinished: at less it may, too"


def test_rows_are_in_doubt_that_a_doubt_is_about_by_its_motion_or_its_check(case):
    def mark(rows, doubts, name):
        data = data_of(case)
        vars(data)["statements"] = {name: answers.Statement([], rows, doubts)}
        vars(data)["pairs"] = ("a", "b")
        pieces = conclusion.build_conclusion(data).pieces
        (table,) = [x for x in pieces if "Demand and capacity" in getattr(x, "caption", "")]
        own = [row for row in table.rows if row[0].startswith(name)]
        return [row[2].endswith("in words (in doubt)") for row in own]

    def checks(name):
        ratios = answers.Ratios(name, ["right"], 1.5, 1.5, linear=name == "linear")
        row = f"assessment: {name}, right", "1 m", "in words", "1.5", ratios._asdict()
        return answers.Row(*row)

    every = [checks("linear"), checks("SLV")]
    split = Doubt("{} passes by the split of weights, and else fails: {:.3g}", "", ("SLV", 0.9))
    of_all = Doubt("it is not known")
    assert mark(every, [split], "assessment") == [False, True]
    for own in ([of_all], [split, of_all]):
        assert mark(every, own, "assessment") == [True, True]
    # how far a tie is stretched says nothing of accelerations
    stretched = Doubt("the tie is stretched: the displacement check is {}", "", (UPPER_BOUND,))
    assert mark(every, [stretched], "assessment") == [False, True]
    only = "passes only with the pressure of the fill, in words"
    fails = Doubt("the bridge passes only with the pressure of the fill, for LM2 by a code")
    every = [
        answers.Row("rating", name, words, "1.2", {"passes": True, "least": 0.9})
        for name, words in {"LM1": "passes, in words", "LM2": only}.items()
    ]
    assert mark(every, [fails], "rating") == [False, True]
    assert mark(every, [of_all], "rating") == [True, True]
    every = [
        answers.Row("scale", f"'{x}', PGA 0.20 g", "in words", "1", scales(x, 1.0)._asdict())
        for x in "ab"
    ]
    assert mark(every, [replace(of_all, place="b")], "scale") == [False, True]


def test_a_first_fall_has_scale_peak_and_motion_of_one_search(case):
    """Two motions of unlike peaks fall at the same scale."""
    first, third = scales("first", 4.3, falls=4.56), scales("third", 4.3, falls=4.56)
    data = data_of(case, first=verdict_of(), third=verdict_of())
    vars(data)["statements"] = {"scale": state("scale", first, third._replace(pga=0.198))}
    (words,) = find_first_failures(data)
    over = "(by other motions or time steps up to 0.912 g, 4.56 × 'first')"
    assert words == f"first falls at 0.903 g, 4.56 × 'third' {over}"  # 4.56 × 0.198 g


def test_the_largest_scale_and_peak_of_a_first_fall_are_of_one_run(case):
    """2.32 × 'third' is 0.664 g, and less than 2.22 × 'first', 0.692 g."""
    first, third = scales("first", 1.35, falls=2.0), scales("third", 1.41, falls=2.28)
    pair = first._replace(pga=0.3117, all_steps=2.22), third._replace(pga=0.2862, all_steps=2.32)
    data = data_of(case, first=verdict_of(), third=verdict_of())
    vars(data)["statements"] = {"scale": state("scale", *pair)}
    (words,) = find_first_failures(data)
    assert words == (
        "first falls at 0.623 g, 2.00 × 'first' (by other motions or time steps up to 0.692 g, "
        "2.22 × 'first')"
    )


def test_the_least_peak_of_a_fall_is_of_all_motions_scaled_or_not(case):
    """'b' falls as it is, of 3 m/s²; 'c' was interrupted before its first run."""
    data = data_of(case, a=verdict_of(), b=verdict_of("fallen"), c=verdict_of())
    data.runs["b"].dataset.attrs["pga"] = 3.0
    empty = scales("c", 0.0, unfinished=True)
    vars(data)["statements"] = {"scale": state("scale", scales("a", 1.02, falls=1.06), empty)}
    assert [*find_first_failures(data)] == [
        "first falls at 0.212 g, 1.06 × 'a'; the least scale is 1.00 × 'b', of 0.306 g; "
        "1 of 3 motions was scaled: under others it may fail at less"
    ]
    vars(data)["pairs"] = tuple("abc")
    assert margins.rank_margins(data)[-1][2][-1] == "'c' was not scaled"


def test_the_range_of_a_first_fall_has_no_motion_that_was_not_searched(case):
    """The third falls as given, and may at any less."""
    data = data_of(case, a=verdict_of(), b=verdict_of(), c=verdict_of("fallen"))
    searched = scales("a", 0.4, falls=0.41, all_steps=0.44), scales("b", 0.6, falls=0.7)
    vars(data)["statements"] = {"scale": state("scale", *searched)}
    (words,) = find_first_failures(data)
    assert words == (
        "first falls at 0.082 g, 0.410 × 'a' (by other motions or time steps up to 0.14 g, "
        "0.700 × 'b'); 2 of 3 motions were scaled: under others it may fail at less"
    )
    vars(data)["statements"] = {"scale": state("scale", *searched, scales("c", 0.8, falls=0.9))}
    (words,) = find_first_failures(data)
    assert words == (
        "first falls at 0.082 g, 0.410 × 'a' (by other motions or time steps up to 0.18 g, "
        "0.900 × 'c')"
    )


def test_neither_a_push_nor_a_study_nor_what_was_not_checked_is_a_margin(case):
    """Across the plane it overturns at the width over twice the height of its centre."""
    names = ("foot", "west", "east", "beam")
    lows, sizes = [(-1, -1), (0, 0), (1, 0), (0, 1)], [(4, 1), (0.5, 1), (0.5, 1), (1.5, 0.4)]
    blocks = [
        {"name": name, "outline": [[x, y], [x + b, y], [x + b, y + h], [x, y + h]]}
        for name, (x, y), (b, h) in zip(names, lows, sizes, strict=True)
    ]
    blocks[0]["fixed"] = True
    centre = (2 * 0.5 * 0.5 + 0.6 * 1.2) / 1.6  # [m]
    structure = {"shape": "blocks", "width": 0.25, "blocks": blocks}
    settings = {**case.settings, "structure": structure, "assessment": SPECTRUM}
    data = data_of(af.Case.of(settings), a=verdict_of())
    check = state("assessment", answers.Ratios("linear, q = 2", ["right"], 1.85, 1.85))
    push = state("limit analysis", PushFactors(1.15, 1.15, "the site's 0.2 g"))
    least = 0.25 / (2.0 * centre) / 0.2
    assert least < 1.0
    said = say_margin(data, limit=push, assessment=check)
    assert said[0].startswith("the least margin is 1.85, on the EC8")
    assert said[0].endswith("; it is of the plane of the drawing alone")
    assert said[1].startswith("pushed sideways as rigid blocks it begins to move at 1.15 times")
    columns = {name: ("x", [0.9, 0.7]) for name in ("least_push_over_site", "least_push", "push")}
    vars(data)["studies"] = [collect_findings("", "", xr.Dataset(columns, {"x": [1.0, 2.0]}))]
    assert say_margin(data, limit=push, assessment=check) == said
    below = "In the study the least push, 0.7 g, is 0.7 times the site's acceleration, at x = 2"
    verdict = head_of(conclusion.list_facts(data))
    assert f"{below}." in verdict
    assert verdict.count("In the study") == 1
    assert verdict.index("it survives") < verdict.index("In the study")


def test_capacities_at_rest_stand_beside_those_of_demands():
    """Semicircles stand from 0.1075 of their mean radius on (Heyman, 1982), of many stones."""
    lengths = {"radius": 3.0, "thickness": 0.36, "embrace": 180.0, "voussoirs": 41}
    structure = {"shape": "circular_arch", "width": 10.0, **lengths}
    crown = {"block": 21, "point": [0.0, 3.0], "weight": "1 kN"}
    for loads, beside in (([], ""), ([crown], ", without the loads of [assessment]")):
        case = ring(structure=structure, assessment={**SPECTRUM, "loads": loads})
        data = ReportData(case, {})
        check = state("assessment", answers.Ratios("linear, q = 2", ["right"], 1.3, 1.3))
        vars(data)["statements"] = {"assessment": check}
        (table,) = capacities.tabulate_capacities({"": data})
        depth = next(row for row in table.rows if row[0] == "at rest")
        assert depth[:3] == (
            "at rest",
            "its own weight",
            "stands; the factor is of the depth of its joints under the same weight, without "
            f"crushing{beside}",
        )
        assert float(depth[3]) == pytest.approx(0.36 / 3.0 / 0.1075, rel=0.02)
        # on no demand it is no margin
        assert [each[0] for each in margins.rank_margins(data)] == [1.3]
    # a least thickness has that of all joints
    vars(data)["statements"] = {"thickness": answers.Statement([], [])}
    assert capacities.tabulate_capacities({"": data}) == []


def test_what_fails_under_a_motion_that_was_not_scaled_has_a_margin_below_one(case):
    """Of runs of 2 m/s²; a state that another motion reaches at a larger scale is no first one."""
    data = data_of(case, a=verdict_of(), b=verdict_of("dislocated"), c=verdict_of())
    vars(data)["pairs"] = ("a", "b", "c")
    assert say_margin(data, scale=state("scale", scales("a", 1.4, dislocated=2.0, falls=4.0))) == [
        "the least margin is below 1 on 'b', PGA 0.20 g, under which it is dislocated, and which "
        "was not scaled",
        "the next is 1.40 on 'a', at a PGA of 0.28 g, under one motion",
        "'c' was not scaled",
    ]
    plain = head_of(conclusion.list_facts(data))
    assert " The least margin is below 1 on 'b'" in plain
    falls = dict.fromkeys("bde", verdict_of("fallen"))
    many = data_of(case, a=verdict_of(), **falls, f=verdict_of("dislocated"))
    many.runs["e"].dataset.attrs["pga"] = 3.0  # g is 9.81 m/s²
    first, then, *_ = say_margin(many, scale=state("scale", scales("a", 1.4, falls=4.0)))
    assert first == (
        "the least margin is below 1 on 'b', 'd' and 'e', PGA 0.20 to 0.31 g, under which it "
        "falls, and which were not scaled"
    )
    assert then.startswith("the next is below 1 on 'f', PGA 0.20 g, under which it is dislocated")
    assert plain.startswith("It survives with damage: it is dislocated but stands under 1 of 3 mot")
    # 2 m/s² are 0.204 g
    said = "It is first dislocated at 0.204 g, 1.00 × 'b'. It first falls at 0.8 g, 4.00 × 'a'; "
    said += "1 of 3 motions was scaled: under others it may fail at less."
    assert said in plain


def test_the_stones_that_are_dislocated_stand_in_no_sentence_of_the_conclusion(case):
    """Under a motion that was scaled, and one that was not: section and table name them."""
    every = {"a": verdict_of(), "b": verdict_of("dislocated")}
    every["b"].fall = af.dynamics.CollapseState("dislocated", None, ("WC",), 0.1, 0.1, True)
    data = data_of(case, **every)
    vars(data)["pairs"] = tuple("ab")
    scaled = scales("a", 1.4, dislocated=1.5, falls=2.0, dislocated_stones=" (EC, WC)")
    said = say_margin(data, scale=state("scale", scaled))
    assert not any("EC" in each or "WC" in each for each in said)
    vars(data)["statements"] = {
        "scale": state("scale", scaled._replace(held=0.9, states={"dislocated": 0.95}))
    }
    plain = head_of(conclusion.list_facts(data))
    assert "it is dislocated but stands under 1 of 2 motions: b (PGA 0.20 g). It" in plain
    # 0.95 × 0.2 g, of a range of one searched motion
    first = "It is first dislocated at 0.19 g, 0.950 × 'a'; 1 of 2 motions was scaled: under"
    assert first in plain
    assert "Under 'a' it stands at 1.00 ×, but is dislocated at 0.950 ×: not" in plain
    assert "loses" not in words_of(data)[0]


def test_the_box_has_the_push_and_no_scale_of_a_fill_in_tension_at_all(case):
    data = data_of(case, a=verdict_of())
    push = PushFactors(0.737, 1.65, "the demand of 0.15 g")
    for held, tension, box in ((0.0, 0.1, False), (0.9, 1.0, True)):
        found = scales("a", held, tension=tension, dislocated=7.34)
        vars(data)["statements"] = {"scale": state("scale", found), "limit": state("limit", push)}
        said = head_of(conclusion.list_facts(data))
        assert ("first dislocated at 1.47 g" in said) == box  # 7.34 × 0.2 g
        begins = (
            "Pushed sideways as rigid blocks it begins to move at 0.737 to 1.65 times the demand"
        )
        assert begins in said
    vars(data)["statements"] = {
        "limit": state("limit", PushFactors(1.2, 1.65, "the demand of 0.15 g"))
    }
    assert "Pushed" not in head_of(conclusion.list_facts(data))


def test_a_motion_that_fells_it_at_a_smaller_scale_is_not_robust(case):
    """As shaken it stands, or is dislocated; what is as weak only above 1 × says nothing."""
    data = data_of(case, a=verdict_of(), b=verdict_of("dislocated"), c=verdict_of())
    found = (
        scales("a", 0.8, falls=0.895),
        scales("b", 0.7, dislocated=0.75, falls=0.9),
        scales("c", 1.1, falls=1.2),
    )
    vars(data)["statements"] = {"scale": state("scale", *found)}
    said = (
        "Under 'a' it stands at 1.00 ×, but falls at 0.895 ×: not robust. Under 'b' it is "
        "dislocated at 1.00 ×, but falls at 0.900 ×: not robust."
    )
    assert said in head_of(conclusion.list_facts(data))
    assert "not robust" not in str(say_margin(data, scale=state("scale", found[2])))


def test_the_margin_of_a_stack_is_the_lesser_of_courses_and_of_one_body(case):
    """Under 'b' courses stand to less than under 'a', but one body falls under 'a' before."""
    found = scales("b", 1.3, falls=1.35, as_one=1.5), scales("a", 1.4, falls=1.5)
    for at, fails in ((0.677, ", beyond which it fails"), (1.05, "")):
        one = scales("a", 1.4, falls=1.5, as_one=at)
        assert say_margin(data_of(case), scale=state("scale", found[0], one))[0] == (
            f"the least margin is below {at:#.3g} as one rigid body (1.40 in courses) on 'a', at a "
            f"PGA of {0.2 * at:.3g} g{fails}, of 2 motions"
        )
    said = say_margin(data_of(case), scale=state("scale", *found))
    assert said[0] == "the least margin is 1.30 on 'b', at a PGA of 0.26 g, of 2 motions"
    assert said[-1] == "as one rigid body it first falls at 1.50 × 'b'"
    # an assessment is ranked behind it
    data = data_of(case)
    vars(data)["case"] = af.Case.of({**case.settings, "assessment": SPECTRUM})
    check = state("assessment", answers.Ratios("code", ["right"], 1.1, 1.1))
    ranked = say_margin(data, assessment=check, scale=state("scale", one))
    assert [x.partition(" on ")[0] for x in ranked if "the next" in x or "least" in x] == [
        "the least margin is below 1.05 as one rigid body (1.40 in courses)",
        "the next is 1.1,",
    ]


def test_the_answer_has_displacements_the_first_fall_and_the_checks(case):
    """First falls are of all motions and time steps, on page 1 in one range; bounds decide none."""
    first, other = (
        scales("a", 1.1, falls=1.3),
        scales("b", 1.1, falls=1.41, all_steps=1.51),
    )
    steps, rigid = "its time steps find the first fall at", Doubt("none falls as rigid")
    ends = ("a", "1.3 to 1.38"), ("b", "1.4 to 1.51")
    scaled = [Doubt(f"{steps} {found} ×", place=name) for name, found in ends]
    scaled += [Doubt(rigid.words, place=name) for name in "ab"]
    bound = Doubt("the curve is {}", "", (UPPER_BOUND,))
    check = answers.Ratios("damage", ["right", "left"], 0.592, 0.592, bodies=0.488)
    data = data_of(case, a=verdict_of(displacement=0.06), b=verdict_of(displacement=0.08))
    searched = state("scale", first, other)._replace(doubts=scaled)
    vars(data)["statements"] = {
        "assessment": state("assessment", check)._replace(doubts=[bound]),
        "scale": searched,
    }
    facts = dict(conclusion.list_facts(data))
    assert head_of(facts.items()) == (
        "By the kinematic assessment it does not withstand the spectrum of the motion. Under its "
        "motions it survives: it stands under all 2 motions of PGA 0.20 g, and moves by 60 to 80 "
        "mm. The least margin is 0.488 (0.592 with the weights apart), on the spectrum of the "
        "motion, by damage, which it fails. It first falls at 0.26 g, 1.30 × 'a' (by other motions "
        "or time steps up to 0.302 g, 1.51 × 'b'). No property was varied. "
        "The stiffness of joints is a default: measured ones differ tenfold. "
        "Perpendicular to this section, as along a wall, it was not checked."
    )
    assert facts["in doubt"] == "scale of the motion"
    pieces = conclusion.build_conclusion(data).pieces
    texts = [getattr(piece, "text", "") for piece in pieces]
    # the head lists what stands as in doubt below, and no more
    assert "Note, kinematic assessment: The curve is an upper bound." in texts
    assert [x for x in texts if x.startswith("In doubt, ")] == [
        x for x in texts if "steps find" in x
    ]
    assert (
        f"In doubt, scale of the motion: Under 'a': {steps} 1.3 to 1.38 ×. Under 'b': {steps} "
        "1.4 to 1.51 ×. Under 'a' and 'b': none falls as rigid."
    ) in texts
    assert any("The doubts below, on scale of the motion, may change this." in x for x in texts)
    for at, said in (1.2, True), (1.35, False):
        parted = first._replace(states={"dislocated": at, "falls": 1.3})
        data.statements["scale"] = state("scale", parted, other)
        words = f" It is first dislocated at {0.2 * at:.3g} g, {at:.2f} × 'a'."
        assert (words in head_of(conclusion.list_facts(data))) == said
    data.statements["scale"] = state("scale", first._replace(unfinished=True), other)
    begun = head_of(conclusion.list_facts(data))
    assert "1.51 × 'b'). The search is unfinished: at less it may, too." in begun
    assert " It falls at " in begun
    data.statements["scale"] = searched
    vars(data)["case"] = af.Case.of({**case.settings, "assessment": SPECTRUM})
    passed = answers.Ratios("damage", ["right"], 1.1, 1.1, moved=0.842)
    for ratios, verified, found in (
        (passed, None, "it withstands"),
        (passed, "rocks", "it withstands at rest alone, and moves in the runs,"),
        (passed._replace(bodies=0.9), None, "it withstands or not, by the split of weights,"),
        (passed._replace(bounded=True), None, "it is not shown to withstand the EC8"),
        # of both splits of weights the least
        (
            passed._replace(bounded=True, bodies=1.04),
            None,
            "it is not shown to withstand the EC8 spectrum of PGA 0.2 g, as its ratio, 1.04,",
        ),
    ):
        data.runs["a"].verdict.mechanisms["verified"] = verified
        data.statements["assessment"] = state("assessment", ratios)._replace(doubts=[bound])
        facts = dict(conclusion.list_facts(data))
        assert f"By the kinematic assessment {found}" in head_of(facts.items())
        assert facts["in doubt"] == "kinematic assessment, scale of the motion"
    assert "; " not in head_of(facts.items())
    # in the other sense of a larger ratio: once, with the least
    both = state("assessment", ratios._replace(directions=["left"], bodies=1.07), ratios)
    data.statements["assessment"] = both._replace(doubts=[bound])
    verdict = head_of(conclusion.list_facts(data))
    assert verdict.count("not shown") == 1
    assert "as its ratio, 1.04, is" in verdict
    data.statements["assessment"] = state("assessment", ratios)._replace(doubts=[bound])
    said = " ".join(say_margin(data, assessment=data.statements["assessment"]))
    ratios = "0.842 by displacements, if it moved, and 1.04 (1.1 with the weights apart) until it"
    assert f"the least margin is {ratios} moves, on" in said
    assert "by damage, right, an upper bound 1.04 times the spectrum" in said
    assert "is an upper bound. The runs do not decide, for 3 at least are needed." in verdict


@pytest.mark.parametrize(("second", "varied"), [("2.5 ms", True), ("5 ms", False)])
def test_a_search_of_scales_by_several_time_steps_has_varied_the_step(case, second, varied):
    data = data_of(case, a=verdict_of())
    assert "time step" in doubts.list_unvaried(data)
    vars(data)["files"] = {"scale.csv": None}
    table = f"step,scale,properties,the structure\n5 ms,1,as given,stands\n{second},1.2,,stands\n"
    object.__setattr__(data, "read_text", {"scale.csv": table}.get)
    assert ("time step" not in doubts.list_unvaried(data)) is varied
    assert "fidelity" in doubts.list_unvaried(data)


def test_an_upper_bound_is_no_doubt_about_a_study_whose_cases_all_fail_by_it(case):
    bound, other = Doubt(f"the curve is {UPPER_BOUND}"), Doubt("no step converges")
    for each_margin, doubt, listed in (
        ([0.76, 0.72], bound, []),
        ([0.76, 1.02], bound, ["study"]),
        ([0.76, 0.72], other, ["study"]),
        ([], bound, ["study"]),
    ):
        data = data_of(case)
        found = SimpleNamespace(worst={"least_margin": each_margin}, doubts=[doubt], is_own=True)
        vars(data)["studies"] = [found]
        assert doubts.list_decisive_doubts(data, [(doubts.STUDIES, doubt)]) == listed


def test_what_can_only_fail_more_is_no_doubt_about_an_assessment_that_fails_in_one_sense(case):
    """To the left it fails by whatever split of weights and bound; to the right by some."""
    left = answers.Ratios("damage", ["left"], 0.68, 0.68, bodies=0.61, bounded=True)
    right = answers.Ratios("damage", ["right"], 1.02, 1.02, bodies=0.9)
    check = AssessmentCheck("damage", 1.02, 1.0, "m", 1.02, 1.0, "a code", bodies=0.9)
    (split,) = check.doubt_split()
    for checks, listed in (((right, left), []), ((right,), ["kinematic assessment"])):
        data = data_of(case)
        data.statements["assessment"] = state("assessment", *checks)
        for doubt in (Doubt("the curve is {}", "", (UPPER_BOUND,)), split):
            every = [("kinematic assessment", doubt)]
            assert doubts.list_decisive_doubts(data, every) == listed
    other = [("kinematic assessment", Doubt("no step converges"))]
    assert doubts.list_decisive_doubts(data, other) == ["kinematic assessment"]


@pytest.mark.parametrize(("share", "decided"), [(0.04, True), (0.06, False)])
def test_runs_that_lack_joints_in_strong_motion_decide_no_survival(share, decided):
    """Strong motion ends at 95 % of the Arias intensity."""
    case = af.Case.of({"structure": {"shape": "column", "breadth": 0.5, "heights": [1.0, 1.0]}})
    fall = af.dynamics.CollapseState("stands", None, (), 0.0, 0.0, True, loose_share=share)
    whole, loose = verdict_of(), verdict_of()
    loose.fall = fall
    verdict = head_of(conclusion.list_facts(data_of(case, a=whole, b=loose)))
    reason = "Not decided, as in 1 of 2 runs joints were not followed through strong motion. It "
    assert verdict.startswith("It survives: it " if decided else reason)


@pytest.mark.parametrize(
    ("count", "norm", "outcome", "answer", "under"),
    [
        (2, "", "stands", "Not decided, as 2 of 5 motions were run", "stands under 2 of 5"),
        (1, "", "stands", "Not decided, as 1 of 5 motions was run", "stands under 1 of 5"),
        (5, "", "stands", "It survives", "stands under all 5"),
        (5, "EN 1998-1", "stands", "", "stands under all 5"),  # of less than 10 s
        (
            *(2, "EN 1998-1", "stands"),
            "Not decided, as 2 of 5 motions were run and EN 1998-1 (from memory) requires 3 "
            "motions at least",
            "stands under 2 of 5",
        ),
        (2, "SIA 261", "fallen", "It does not survive", "falls under 2 of 5"),
    ],
)
def test_a_part_of_the_motions_that_are_needed_decides_no_survival(
    count, norm, outcome, answer, under
):
    """A fall under any motion is one; an assessment that fails comes before what is none."""
    tables = {
        "structure": {"shape": "column", "breadth": 0.5, "heights": [1.0, 1.0]},
        "model": {"fidelity": "rigid", "displacements": "large"},
        "suite": {"pairs": {x: {"synthetic": {"duration": 1.0, "pga": 1.0}} for x in "abcde"}},
        "report": {"norm": norm},
    }
    runs = {name: verdict_of(outcome) for name in "abcde"[:count]}
    data = replace(data_of(af.Case.of(tables), **runs), missing=tuple("abcde"[count:]))
    vars(data).update(verdict_ranges=(), dead=None)
    vars(data)["statements"] = {
        "assessment": state("assessment", answers.Ratios("damage", ["right"], 0.9, 0.9))
    }
    verdict = head_of(conclusion.list_facts(data))
    assessed = "By the kinematic assessment it does not withstand the spectrum of the motion."
    assert ("The motions do not meet EN 1998-1 by their " in verdict) == bool(
        norm.startswith("EN") and outcome == "stands"
    )
    answer = f"{answer}{'. It' if answer[:3] == 'Not' else ': it'}" if answer else "It"
    answer = f"{answer} {under} motions".replace("It su", "Under its motions it su")
    order = [verdict.index(answer), verdict.index(assessed)]
    assert order[outcome != "fallen"] == 0
    assert min(order) < max(order)
    assert verdict.count("withstand") == 1
    ((_, (_, _, stated, *_)), *_) = capacities._capacity_rows(data)
    left = ", ".join("abcde"[count:])
    assert (f"; not run: {left}" in stated) is bool(left)


TIE = [{"block": "block 1", "point": [0.0, 1.0], "force": [-1e3, 0.0], "passive": True}]


def test_what_no_check_shows_is_said_and_not_that_another_sense_withstands():
    """Pushed to the left a path by an upper bound alone, and to the right one that passes."""
    floor = {"code": "floor", "height": 5.0, "storeys": 1, "ground_spectrum": SPECTRUM["spectrum"]}
    data = ReportData(ring(assessment={"spectrum": floor}), {})
    shown = answers.Ratios("SLV", ["right"], 1.5, 1.5)
    vars(data)["statements"] = {"assessment": state("assessment", shown)}
    of = f"the floor spectrum above ground of PGA {capacities.find_demand(data):.3g} g"
    assert f"it withstands {of}" in head_of(conclusion.list_facts(data))
    other = answers.Ratios("SLV", ["left"], 1.2, 1.2, bounded=True)
    vars(data)["statements"] = {"assessment": state("assessment", shown, other)}
    verdict = head_of(conclusion.list_facts(data))
    assert f"it is not shown to withstand {of}, as its ratio, 1.2, is an upper bound" in verdict
    assert "it withstands" not in verdict
    methods = dict(sections.build_method_section(data).pieces[0].rows)
    assert "floor spectrum: Circolare 7/2019, C7.2.3" in methods["methods"]


@pytest.mark.parametrize(
    ("change", "outcome", "says"),
    [
        ({}, "stands", "the 3 motions matched to this spectrum, under which it stands, decide"),
        ({}, "fallen", "the 3 motions matched to this spectrum, under which it falls, decide"),
        ({}, "unknown", "the runs do not decide, for outcomes are unknown"),
        ({"scale": 0.8}, "stands", "the runs do not decide, for they have 0.8 of its size"),
        ({"reduction": 2.0}, "stands", "the runs do not decide, for they have 0.5 of its size"),
        ({"matched": False}, "stands", "the runs do not decide, for they are not matched to it, "),
        ({"displacements": "small"}, "stands", "the runs do not decide, for their displacements "),
        ({"ag": 0.25}, "stands", "the runs do not decide, for their target is another spectrum"),
        ({"loads": TIE}, "stands", "the runs do not decide, for they leave out the loads of [asse"),
    ],
)
def test_a_matched_suite_is_the_test_of_an_upper_bound_on_its_spectrum(change, outcome, says):
    """Unless it is weaker than the spectrum, of another, or in small displacements."""
    given = dict(change)
    loads = given.pop("loads", [])
    spectrum = {"code": "EC8", "ag": given.pop("ag", 0.2), "ground": "A"}
    pairs = {name: {"synthetic": {"seed": k, "duration": 1.0}} for k, name in enumerate("abc")}
    tables = {
        "structure": {"shape": "column", "breadth": 0.5, "heights": [1.0, 1.0]},
        "model": {"fidelity": "rigid", "displacements": given.pop("displacements", "large")},
        "suite": {"matched": True, "target": SPECTRUM["spectrum"], "pairs": pairs} | given,
        "assessment": {"spectrum": spectrum, "loads": loads},
    }
    runs = {"a": verdict_of(outcome), "b": verdict_of(), "c": verdict_of()}
    data = data_of(af.Case.of(tables), **runs)
    ratios = answers.Ratios("damage", ["right"], 1.5, 1.5, bounded=True)
    (said,) = say_margin(data, assessment=state("assessment", ratios))
    assert said.endswith(", an upper bound")
    says = sentence(says)[:-1]
    assert f" is an upper bound. {says}" in head_of(conclusion.list_facts(data))
    # one sentence has a linear check that passes too, as on the screen
    linear = answers.Ratios("linear", ["right"], 1.37, 1.37, linear=True)
    vars(data)["statements"] = {"assessment": state("assessment", linear, ratios)}
    both = (
        "passes the linear check (1.37), and is not shown to pass by displacements, as their "
        "ratio, 1.5, is an upper bound"
    )
    assert answers.compare_checks([linear, ratios]) == both
    assert f"of PGA {0.2 if 'ag' not in change else 0.25} g it {both}. {says}" in head_of(
        conclusion.list_facts(data)
    )
    assert answers.compare_checks([linear._replace(least=0.9), ratios]) == ""
    # with e* = 1, less than 1 or not, it is the ratio in doubt
    for floor in (1.2, 0.8):
        stated = {"assessment": state("assessment", ratios._replace(floor=floor))}
        said = f"margin is {floor:.3g} with e* = 1 (1.5 of the mechanism found), on the EC8"
        assert said in say_margin(data, **stated)[0]
        verdict = head_of(conclusion.list_facts(data))
        assert f"its ratio, {floor:.3g}, is an upper bound. {says}" in verdict
    vars(data)["runs"] = {}
    tests = "an upper bound. Time histories with large displacements under motions of this spec"
    if loads:
        tests = "an upper bound. No run can test it, for runs leave out the loads of [assessment]"
    assert tests in head_of(conclusion.list_facts(data))
    # the sense whose ratio is no bound says nothing more
    left = ratios._replace(directions=["left"], bounded=False)
    vars(data)["statements"] = {"assessment": state("assessment", linear, ratios, left)}
    assert head_of(conclusion.list_facts(data)).count(both) == 1


def test_rewording_a_sentence_changes_no_number_of_the_report(case):
    """Sentences, outcomes and factors in words are shown alone, and never read."""
    found = {
        "scale": state("scale", scales("a", 1.38, moves=0.85, falls=4.5)),
        "assessment": state("assessment", answers.Ratios("code", ["right"], 0.8, 1.2, "columns")),
        "limit": state("limit analysis", PushFactors(0.9, 1.1, "the site's 0.2 g")),
    }
    data = data_of(case, a=verdict_of())
    said = say_margin(data, **found), [*conclusion._say_plainly(data, [])]
    for words in (
        "fails at 9 ×, passes only with 7",
        "under 'b': falls from 3 × or less",
        "an upper",
    ):
        for name, each in found.items():
            rows = [
                row._replace(
                    demand=words, outcome=words, factor="9 until it moves (8 by displacements)"
                )
                for row in each.rows
            ]
            data.statements[name] = answers.Statement([words], rows)
        again = say_margin(data, **data.statements), [*conclusion._say_plainly(data, [])]
        assert again == said


def test_what_is_stated_of_a_result_is_read_as_it_was_written():
    stated = state("scale of the motion", scales("a", 1.5, falls=2.0, again=[]))
    stated = stated._replace(doubts=[Doubt("under {}: it falls", "hold it", ("a",))], notes=["x"])
    again = answers.Statement.read(stated.as_file("scale")["scale.json"])
    assert again == stated._replace(doubts=again.doubts)
    assert [str(each) for each in again.doubts] == [str(each) for each in stated.doubts]
    assert answers.read_numbers(answers.Scales, again)[0].states == {"falls": 2.0}


def test_the_verdict_of_several_cases_is_the_worst_and_names_its_case(case):
    """Falls, failed checks, unknown outcomes, damage, and then the least margin."""
    outcomes = ("stands", "fallen", "dislocated", "mechanism", "stands", "stands", "stands")
    ratios = (1.5, 2.0, 2.0, 2.0, 0.9, 1.4, None)
    parts = {}
    for ratio, outcome in zip(ratios, outcomes, strict=True):
        data = parts[f"{outcome} {ratio}"] = data_of(case, a=verdict_of(outcome))
        vars(data)["transverse_push"] = np.nan
        check = answers.Ratios("linear", ["right"], ratio or 1.0, ratio or 1.0)
        vars(data)["statements"] = {"assessment": state("assessment", check)} if ratio else {}
    lorry = answers.Row("rating", "LM1", "fails", "0.85", {"passes": False, "least": 0.8})
    load = answers.Row("limit analysis", "a load", "", "1.2", PushFactors(1.2, 1.2)._asdict())
    ranks = [((1, False), {"the vehicle": 0.8}, {"the vehicle": 0.85})]
    ranks += [((4, False), {"the given load": 1.2}, {"the given load": 1.2})]
    for name, row, rank in zip(("rating", "limit"), (lorry, load), ranks, strict=True):
        static = ReportData(case, {})
        vars(static)["statements"] = {name: answers.Statement([], [row])}
        assert conclusion._rank_verdict(static) == rank
    ranks = {name: conclusion._rank_verdict(each) for name, each in parts.items()}
    order = sorted(ranks, key=lambda x: (ranks[x][0], min(ranks[x][1].values(), default=np.inf)))
    assert order[:4] == ["fallen 2.0", "stands 0.9", "mechanism 2.0", "dislocated 2.0"]
    assert order[4:] == ["stands 1.4", "stands 1.5", "stands None"]
    facts = conclusion.list_joint_facts(parts)
    assert facts[1][1].startswith("The worst of 7 cases is fallen 2.0: It does not survive: ")
    assert facts[2][0] == "margin"
    least = "; ".join(
        f"of stands {x} {x} times the earthquake by linear, right" for x in (0.9, 1.4)
    )
    assert facts[2][1].startswith(f"The least margins are {least}")
    assert facts[2][1].endswith("; of stands None not known.")
    assert facts[3][0] == "not checked"  # the same for all
    assert [key for key, _ in facts[4:]] == [name for name in parts if name != "fallen 2.0"]


def test_margins_side_by_side_are_in_the_plane_and_what_is_across_it_is_said_once(case):
    """Across the plane, where nothing was checked, a push of 0.3 g overturns both at 0.3 × 1 g."""
    spectrum = {"code": "EC8", "type": 1, "ag": 1.0, "ground": "A"}
    settings = {**case.settings, "assessment": {**SPECTRUM, "spectrum": spectrum}}
    parts = {"strong": 1.5, "weak": 0.6}
    for name, factor in parts.items():
        data = parts[name] = ReportData(af.Case.of(settings), {})
        check = answers.Ratios("linear", ["right"], factor, factor)
        vars(data).update(transverse_push=0.3, across=({}, ""))
        vars(data)["statements"] = {"assessment": state("assessment", check)}
    facts = conclusion.list_joint_facts(parts)
    said = dict(facts)
    assert said["margin"] == (
        "The least margins are of weak 0.6 times the earthquake by linear, right; "
        "of strong 1.5 times the earthquake by linear, right."
    )
    assert conclusion._rank_verdict(parts["strong"])[0] == (1, False)  # it may overturn
    assert sum("cross the plane of" in text for _, text in facts) == 1
    assert said["not checked"] == (
        "strong and weak: Across the plane of the drawing it was not checked, where it may "
        "overturn from 0.3 g on (0.3 × the demand, 1 g)."
    )


@pytest.mark.parametrize("fails", [False, True])
def test_cases_are_ranked_by_the_kind_of_their_demand(case, fails):
    """Two pushes over the site's acceleration, and a lorry that may have the largest factor."""
    site = {"site": "the site's acceleration"}
    rows = {
        "hill": answers.Row("limit", "", "", "3", PushFactors(3.0, 3.1, **site)._asdict()),
        "road": answers.Row("rating", "LM1", "", "4", {"passes": not fails, "least": 4.0}),
        "vale": answers.Row("limit", "", "", "2", PushFactors(2.0, 2.5, **site)._asdict()),
    }
    parts = {name: ReportData(case, {}) for name in rows}
    for name, data in parts.items():
        vars(data)["transverse_push"] = np.nan
        stated = answers.Statement(["in words"], [rows[name]])
        vars(data)["statements"] = {rows[name].result: stated}
    push = "times the site's acceleration by a push"
    facts = dict(conclusion.list_joint_facts(parts))
    assert facts["margin"] == (
        f"The least margins are of vale 2 {push}; of hill 3 {push}; of road 4 times the "
        "vehicle, LM1."
    )
    if fails:  # a failure is the worst of whatever kind
        assert facts["verdict"].startswith("The worst of 3 cases is road: Rating for LM1: factor 4")
        return
    assert facts["verdict"] == (
        "All that was checked is passed: the worst of 3 cases, each by its kind of demand, are "
        f"vale (2 {push}) and road (4 times the vehicle, LM1)."
    )
    assert {*parts} < {*facts}
    doubtful = parts["hill"].statements["limit"]._replace(doubts=[Doubt("it is not known")])
    vars(parts["hill"])["statements"] = {"limit": doubtful}
    verdict = dict(conclusion.list_joint_facts(parts))["verdict"]
    assert verdict.startswith("All that was checked is passed, some of it in doubt: the worst of 3")


def test_the_least_margins_of_several_cases_are_at_most_what_is_an_upper_bound(case):
    """A search that may have missed less, associated flow, a path by a bound, and an exact push."""
    site = {"site": "the site's acceleration"}
    pushes = [PushFactors(x, x, **site, bounded=x == 1.5) for x in (1.2, 1.5, 1.6)]
    searched = PushFactors(1.4, 1.4, **site, proved=1.1)
    stated = {
        "exact": {"limit": state("limit analysis", pushes[0])},
        "path": {
            "assessment": state("assessment", answers.Ratios("c", [], 1.3, 1.3, bounded=True))
        },
        "searched": {"limit": state("limit analysis", searched)},
        "sliding": {"limit": state("limit analysis", pushes[1])},
        "other": {  # words of a doubt make no bound
            "limit": state("limit analysis", pushes[2])._replace(
                doubts=[Doubt("1.6 is an upper estimate")]
            )
        },
    }
    parts = {name: ReportData(case, {}) for name in stated}
    for name, data in parts.items():
        vars(data).update(statements=stated[name], transverse_push=np.nan)
    facts = dict(conclusion.list_joint_facts(parts))
    assert facts["margin"].replace(" times the site's acceleration by a push", "") == (
        "The least margins are of path at most 1.3 times the earthquake by c; of exact 1.2; of "
        "searched at most 1.4; of sliding at most 1.5; of other 1.6."
    )
    alone = (
        "Pushed sideways as rigid blocks it begins to move at most at 1.5 times the site's "
        "acceleration; to move"
    )
    assert facts["sliding"].startswith(alone)


@pytest.mark.parametrize(("breadth", "across"), [(0.5, True), (0.45, False)])
def test_a_stack_as_broad_as_another_case_is_wide_is_its_plane_across(
    case, breadth, across, monkeypatch
):
    """An arch on piers, which a push across its plane may overturn."""
    monkeypatch.setattr(ReportData, "transverse_slide", np.inf)
    lengths = {"radius": 1.5, "thickness": 0.4, "voussoirs": 9, "courses": [1.0]}
    lengths |= {"shape": "arch_on_piers", "pier_breadth": 1.0, "width": 0.5}
    stack = {"shape": "column", "breadth": breadth, "heights": [1.0, 1.0], "width": 4.0}
    settings = [{**case.settings, "structure": each} for each in (lengths, stack)]
    cases = [data_of(af.Case.of(each), a=verdict_of()) for each in settings]
    parts = label_parts(cases)
    facts = dict(conclusion.list_joint_facts(parts))
    assert facts["cases"] == "A: stack (None); B: stack (None)"
    said = f"{facts['verdict']} {facts.get('A', facts.get('B'))}"
    assert ("it was not checked" in facts.get("not checked", "")) is not across
    # each stands once, the wall across no other
    assert (said.count("Across its plane: B.") == said.count("its plane: ") - 1 == 1) is across
    assert ("In its plane: A." in said) is across
    (block,) = margins.build_transverse(parts["A"])
    assert (block.text == "It is that of case B.") is across
    assert (margins.find_unchecked_push(parts["A"]) is None) is across
    still = ReportData(cases[1].case, {})  # one without results checks nothing
    assert label_parts([cases[0], still])["A"].other_plane is None
    several = label_parts([cases[1], cases[1], cases[0]])
    (block,) = margins.build_transverse(several["C"])
    leads = [margins.build_transverse(several[label])[0].lead for label in "AB"]
    if across:
        assert (block.lead, block.text) == ("Across its plane?", "It is that of cases A and B.")
        assert leads == ["In its plane?"] * 2


def test_of_unequal_outcomes_the_worst_is_the_first(case):
    every = {"a": verdict_of(), "b": verdict_of("dislocated", 0.2), "c": verdict_of("fallen")}
    data = data_of(case, range_of(0.1, 0.1), **every)
    peak = "(PGA 0.20 g)"
    text = (
        f"It does not survive: it falls under 1 of 3 motions: c {peak}. It is dislocated but "
        f"stands under 1 of 3 motions: b {peak}. It stands under 1 of 3 motions: a {peak}, and "
        "moves by 100 to 200 mm. From which acceleration on it falls was not computed. With other "
        "plausible properties it falls in none of 2 variations"
    )
    rest = (
        f"No property that was varied decides. {sentence(conclusion.DEFAULT_STIFFNESS)} "
        "Perpendicular to this section, as along a wall, it was not checked."
    )
    assert head_of(conclusion.list_facts(data)) == f"{text}, under 'first'. {rest}"
    parted = data.verdict_ranges[0].dataset.assign(outcome=("run", ["stands", "dislocated"]))
    vars(data)["verdict_ranges"] = (VerdictRange(parted),)
    varied = f"{text} and is dislocated in 1, under 'first'. {rest}"
    assert head_of(conclusion.list_facts(data)) == varied
    # head and table have it, and no sentence below has it again
    assert "2 variations" in str(capacities.tabulate_capacities({"": data}))
    assert not any("2 variations" in text for text in words_of(data))


def test_doubts_of_several_motions_are_one(case):
    """With the ranges of their numbers; names differ in kind."""
    given = [
        Doubt("at {:.2f} × it falls by {}", "", values, place)
        for place, values in (
            ("a", (1.48, "joint 1")),
            ("b", (2.18, "joint 1")),
            ("c", (1.5, "joint 2")),
        )
    ]
    assert [*map(str, doubts._merge_motions([*given, Doubt("it errs by 1.5 %")]))] == [
        "under 'a' and 'b': at 1.48 to 2.18 × it falls by joint 1",
        "under 'c': at 1.50 × it falls by joint 2",
        "it errs by 1.5 %",
    ]


def test_a_displacement_has_the_range_of_its_time_steps_and_single_changes_are_said(case):
    """Those of one motion; equal words on several motions are one sentence."""
    ranges = [range_of(0.02, 0.12, 0.05, motion=name) for name in "ab"]
    for found in ranges:
        found.dataset["sampled"][:2] = False
        found.dataset["dt"][1] = "half"
    data = data_of(case, ranges[0], a=verdict_of(displacement=0.1), b=verdict_of())
    (row, *_) = (row for _, row in capacities._capacity_rows(data))
    assert row[2] == (
        "stands in 2 of 2 runs; displaced by up to 100 mm under 'a', 0 mm at the end; over time "
        "steps by 20 to 120 mm under 'a'"
    )
    same = "it falls with none of 1 single changes"
    moved = "unvaried it is displaced by 20 mm, by 120 mm with half the time step"
    causes = [each.what_changes for each in ranges]
    assert [*outcomes.say_by_motion(ranges, causes)] == [
        f"under 'a' and 'b': {same}",
        f"under 'a' and 'b': {moved}",
    ]
    assert [*outcomes.say_by_motion(ranges[:1], causes[:1])] == [same, moved]


@pytest.mark.parametrize(
    ("far", "outcome"), [(0.029, "stands"), (0.031, "stands"), (0.02, "dislocated")]
)
def test_what_displaces_it_most_does_so_by_more_than_time_steps(far, outcome):
    """Unvaried it moves by 20 mm, with half the step by 21 mm; steps may change it 1.5 times."""
    found = range_of(0.02, 0.021, far, motion="a")
    found.dataset["sampled"][:] = False
    found.dataset["dt"][1] = "half"
    found.dataset["sign"] = "run", np.array(["as given", "as given", "reversed"])
    found.dataset["outcome"] = "run", np.array(["stands", "stands", outcome])
    found.dataset.attrs["properties"] = ["dt", "sign"]
    (said,) = outcomes.say_what_decides([found])
    most = "of what was varied, motion reversed displaces it most: "
    assert (
        said
        == {
            (0.029, "stands"): "no property that was varied decides",
            (0.031, "stands"): f"{most}31 mm in place of 20 mm",
            (0.02, "dislocated"): "it is dislocated with motion reversed",
        }[far, outcome]
    )


@pytest.mark.parametrize(
    ("given", "half", "turned", "said"),
    [
        ("stands", "stands", "fallen", "it falls with motion reversed"),
        ("dislocated", "fallen", "fallen", "it falls with HALF and with motion reversed"),
        ("dislocated", "stands", "partly fallen", "it falls with motion reversed"),
        ("dislocated", "dislocated", "stands", "it is not dislocated with motion reversed"),
        ("fallen", "dislocated", "stands", "it does not fall with HALF and with motion reversed"),
        ("fallen", "unknown", "fallen", "no property that was varied decides"),
        (
            *("unknown", "stands", "stands"),
            "which property decides is unknown, for the unvaried run has no answer",
        ),
    ],
)
def test_a_single_change_of_another_outcome_stands_in_the_head(case, given, half, turned, said):
    """Where no property separates the sampled runs, of which none falls."""
    found = range_of(0.02, 0.02, 0.02, 0.02, motion="a")
    found.dataset["sampled"][:3] = False
    found.dataset["dt"] = "run", np.array(["as given", "half", "as given", "as given"])
    found.dataset["sign"] = "run", np.array(["as given", "as given", "reversed", "as given"])
    found.dataset["outcome"] = "run", np.array([given, half, turned, "stands"])
    found.dataset.attrs["properties"] = ["dt", "sign"]
    words = said.replace("HALF", "half the time step")
    data = data_of(case, found, a=verdict_of())
    assert f" {sentence(words)} " in dict(conclusion.list_facts(data))["depends on"]
    other = range_of(0.02, 0.02, motion="b")
    of_motion = words if said.startswith(("no ", "which ")) else f"under 'a': {words}"
    assert outcomes.say_what_decides([found, other]) == [of_motion]


def change_alone(motion, **outcomes_of):
    """Made-up variations: the unvaried stands, and single changes have outcomes; 20 samples."""
    values = {"friction": -0.2, "k_s": 0.01, "k_n": 2.0}
    count = 1 + len(outcomes_of)
    found = range_of(*[0.02] * (count + 20), motion=motion).dataset
    found["sampled"][:count] = False
    for name, neutral in {"friction": 0.0, "k_s": 1.0, "k_n": 1.0}.items():
        column = np.full(count + 20, neutral)
        column[1:count] = [values[x] if x == name else neutral for x in outcomes_of]
        column[count:] += np.tile([-0.1, 0.1], 10)  # of the samples
        found[name] = "run", column
    states = ["stands", *outcomes_of.values(), *["stands"] * 20]
    found["outcome"] = "run", np.array(states)
    found.attrs |= {"properties": ["friction", "k_s", "k_n"], "k_n": 1e9, "k_s": 1e9}
    return VerdictRange(found)


def test_a_survival_is_said_with_the_inputs_of_joints_without_which_it_falls(case):
    """Of two motions the worse outcome of a single change counts; others do not matter."""
    settings = {**case.settings, "contacts": {"stone to stone": {"friction": 0.5}}}
    settings["report"] = {"sources": {"contacts.stone to stone.friction": "assumed, sawn faces"}}
    data = data_of(af.Case.of(settings), a=verdict_of(), b=verdict_of())
    first = change_alone("a", friction="fallen", k_s="dislocated", k_n="stands")
    other = change_alone("b", friction="dislocated", k_s="stands", k_n="stands")
    vars(data)["verdict_ranges"] = (first, other)
    facts = dict(conclusion.list_facts(data))
    verdict = facts["verdict"]
    assert verdict.startswith("It survives with friction 0.5 (assumed, sawn faces) and shear stiff")
    assert " MPa/mm (default): it stands under all 2 motions" in verdict
    changes = "falls or is dislocated with friction - 0.2 and with shear stiffness / 100"
    assert f" In single changes it {changes}." in verdict
    assert "Friction was varied from 0.3 to 0.6 only." in facts["depends on"]
    # where it is damaged as given, it is no worse if dislocated
    for run in data.runs.values():
        run.verdict.outcome = "dislocated"
    for found in data.verdict_ranges:
        found.dataset["outcome"][0] = "dislocated"
    verdict = dict(conclusion.list_facts(data))["verdict"]
    assert verdict.startswith("It survives with damage with friction 0.5 (assumed, sawn faces): it")
    assert "In single changes it falls with friction - 0.2." in verdict
    # and nothing is said of what matters nowhere, nor beside a fall
    vars(data)["verdict_ranges"] = (change_alone("a", k_n="stands"),)
    assert "with friction" not in dict(conclusion.list_facts(data))["verdict"]
    vars(data)["verdict_ranges"] = (first,)
    data.runs["a"].verdict.outcome = "fallen"
    assert "with friction" not in dict(conclusion.list_facts(data))["verdict"]


def test_what_decides_has_the_properties_of_single_changes_that_alter_the_outcome(case):
    """Samples with small k_s fall, and of those with less friction none, as it varies by little."""
    found = change_alone("a", friction="fallen", k_s="fallen", k_n="stands")
    low = np.arange(len(found.dataset["outcome"])) >= 14
    found.dataset["k_s"].values[low] = 0.01
    found.dataset["outcome"].values[low] = "fallen"
    assert found.deciding == ("shear stiffness",)
    decide, *_ = outcomes.say_what_decides([found])
    assert decide == "of what was varied, shear stiffness and friction decide"
    (grid,) = response._tabulate_counts({"a": found})
    alone = "explain no more than chance, but single changes of friction alter the outcome"
    assert grid.caption.endswith(f"friction and k_n {alone}")


def test_the_head_begins_with_the_least_margin_and_what_it_is_of(case):
    """First falls of 1.3 × are beyond 1.1 ×, up to which it stands."""
    data = data_of(case, a=verdict_of())
    for ratio, of_check in (1.05, True), (1.15, False):
        check = state("assessment", answers.Ratios("linear", ["right"], ratio, ratio))
        searched = state("scale", scales("a", 1.1, falls=1.3))
        vars(data)["statements"] = {"assessment": check, "scale": searched}
        words = dict(conclusion.list_facts(data))["margin"]
        least = f"The least margin is {ratio}, on the spectrum of the motion, by linear, right"
        if not of_check:
            least = "The least margin is 1.10 on 'a', at a PGA of 0.22 g, under one motion"
        assert words.startswith(f"{least}. It first falls at 0.26 g, 1.30 × the motion.")
        assert words.count("least margin") == 1


def test_the_least_margin_is_by_displacements_where_these_are_less_than_at_rest(case):
    """1.35 begins to move it, 1.24 is what it withstands if it moved: the search has 1.3."""
    data = data_of(case, a=verdict_of())
    check = answers.Ratios("damage", ["right"], 1.35, 1.35, moved=1.24, displaced=1.24)
    vars(data)["statements"] = {
        "assessment": state("assessment", check),
        "scale": state("scale", scales("a", 1.3, falls=2.0)),
    }
    words = dict(conclusion.list_facts(data))["margin"]
    assert words.startswith(
        "The least margin is 1.24 by displacements, if it moved, and 1.35 until it moves, on the "
        "spectrum of the motion, by damage, right. "
    )
    joint = dict(conclusion.list_joint_facts({"A": data}))["margin"]
    assert "of A 1.24 times the earthquake by displacements (damage, right), if it moved" in joint
    # what falls short if it moved passes at rest alone, and is no failure
    failing = state("assessment", check._replace(moved=0.9, displaced=0.9))
    vars(data)["statements"] = {"assessment": failing}
    assert min(margins.list_margins(data))[0] == 1.35


@pytest.mark.parametrize(
    ("norm", "demand", "others"),
    [
        ("NTC 2018", "LM1", "Eurocodes"),
        ("NTC 2018 and EN 1991-2", "LM1", ""),
        ("SIA 269", "LM1", "others"),
        ("BD 21", "lorry by CS 454", ""),
        ("NTC 2018", "lorry", "others"),
        ("", "LM1", ""),
    ],
)
def test_a_rating_by_another_norm_than_that_of_the_report_is_noted(case, norm, demand, others):
    data = ReportData(af.Case.of({**case.settings, "report": {"norm": norm}}), {})
    row = answers.Row("rating", demand, "passes", "1.5", {"passes": True, "least": 1.5})
    vars(data)["statements"] = {"rating": answers.Statement([], [row])}
    noted = [f"archfem has no rating by {norm}: {others} stand for it"] * bool(others)
    assert doubts.list_notes(data).get("rating", []) == noted


def test_stiffness_of_unlike_joints_is_a_range_of_each(case):
    """Joints of fill and of stones of 0.1 and 2 MPa/mm, varied from 0.3 to 3 times their own."""
    found = range_of(0.02, 0.02)
    found.dataset["k_n"] = "run", np.array([0.3, 3.0])
    found.dataset.attrs |= {"properties": ["k_n"], "k_n": 1.05e9}
    data = data_of(case, found)
    (alone,) = doubts.list_ranges(data, found)
    assert alone == ("k_n", "0.315 to 3.15 MPa/mm", "default")
    pair = [
        SimpleNamespace(contact=SimpleNamespace(name=name, normal_stiffness=size))
        for name, size in (("fill", 1e8), ("stone to stone", 2e9))
    ]
    structure = SimpleNamespace(joints=pair)
    vars(data)["case"] = SimpleNamespace(structure=structure, settings={})
    (each,) = doubts.list_ranges(data, found)
    # 0.3 × 0.1 = 0.03, and so on
    of = "0.3 to 3 × that of each joint: fill 0.03 to 0.3; stone to stone 0.6 to 6 MPa/mm"
    assert each == ("k_n", of, "default")


def test_single_changes_are_tabulated_the_worst_first(case):
    """A fall has no displacement but that to the ground."""
    found = range_of(0.02, 0.12, 9.0)
    found.dataset["sampled"][:] = False
    found.dataset["dt"][1] = "half"
    found.dataset["sign"] = "run", np.array(["as given", "as given", "reversed"])
    found.dataset.attrs["properties"] = ["dt", "sign"]
    found.dataset["outcome"] = "run", np.array(["stands", "stands", "fallen"])
    (table,) = response._tabulate_single_changes(data_of(case), {"a": found})
    assert table.rows == [
        ("motion reversed", "fallen"),
        ("half the time step", "120 mm, 0 mm"),
        ("unvaried", "20 mm, 0 mm"),
    ]
    assert table.caption == (
        "Single changes, the worst first: outcome, if it does not stand, largest displacement, and "
        "that at the end; other time steps alone may change displacements 6 times"
    )
    found.dataset["outcome"] = "run", np.array(["stands", "stands", "dislocated"])
    found.dataset["residual"] = "run", np.array([0.01, 0.03, 0.06])
    both = {"a": found, "b": range_of(0.03, 0.02, motion="b")}
    both["b"].dataset["sampled"][:] = False
    both["b"].dataset["dt"][1] = "half"
    (table,) = response._tabulate_single_changes(data_of(case), both)
    assert table.head == ("single change", "'a'", "'b'")
    assert table.rows[0] == ("motion reversed", "dislocated, 9000 mm, 60 mm", "-")
    assert table.rows[1] == ("half the time step", "120 mm, 30 mm", "20 mm, 0 mm")
    # a tenth of the column's breadth
    assert "at the end; beyond 50 mm at the end it is dislocated" in table.caption
    varied = range_of(0.1, sampled=True)
    assert response._tabulate_single_changes(data_of(case), {"": varied}) == []


@pytest.mark.parametrize(
    ("found", "says"),
    [
        (range_of(0.0418, 0.2), "run is displaced by up to 109 mm; with another"),
        (range_of(0.3, 0.2), "or fidelity it is displaced by up to 300 mm"),
        (range_of(0.109, 0.2, outcome="fallen"), "or fidelity it falls"),
        (range_of(0.09, 0.2), ""),
        (range_of(0.0418, 0.2, motion="second"), ""),
        (range_of(0.0418, 0.2, motion=""), ""),
        (range_of(0.0418, 0.2, sampled=True), ""),
        (range_of(np.nan, 0.2, outcome="unknown", error="broken"), ""),
    ],
)
def test_a_run_and_its_unvaried_variation_may_differ_by_half(case, found, says):
    data = data_of(case, found, first=verdict_of(displacement=0.109))
    texts = [x.cause for result, x in doubts.list_doubts(data) if result == "variations"]
    assert len(texts) == (says != "")
    assert says in "".join(texts)


def test_what_was_not_varied_names_displacements(case):
    """Of one motion of several, those under the others; without variations, all."""
    none, range_ = "isplacements have no range", range_of(0.1, 0.1, motion="a")
    for found, names, first, last in (
        (None, "a", "Motion, lengths, stiffness,", none + "."),
        (range_, "a", "Motion, lengths, size of the motions", " not varied."),
        (range_, "ab", "Lengths, properties under 'b', size", " not varied."),
    ):
        data = data_of(case, found, **{name: verdict_of() for name in names})
        (lead,) = (
            each.text
            for each in conclusion.build_conclusion(data).pieces
            if getattr(each, "lead", "").startswith("What would change")
        )
        assert lead.partition("raise no doubt. ")[2].startswith(first)
        assert lead.endswith(last)
        assert (none in lead) == (found is None)


@pytest.mark.parametrize(
    ("studied", "unvaried"),
    [
        ({"friction", "damping"}, "stiffness under 'b'"),
        ({"stiffness", "friction", "damping"}, None),
        (set(), "properties under 'b'"),
    ],
)
def test_what_a_study_varied_under_a_motion_is_not_unvaried(monkeypatch, case, studied, unvaried):
    data = data_of(case, range_of(0.1, 0.1, motion="a"), a=verdict_of(), b=verdict_of())
    vars(data)["studies"] = [SimpleNamespace(motions=["b"], is_static=False, is_own=True)]
    monkeypatch.setattr(doubts, "list_studied", lambda study: studied)
    found = [each for each in doubts.list_unvaried(data) if "under" in each]
    assert found == [unvaried] * (unvaried is not None)


@pytest.mark.parametrize(
    ("period", "matched", "noted"),
    [(2.04, True, True), (1.9, True, False), (2.04, False, False), (np.nan, True, False)],
)
def test_motions_matched_to_shorter_periods_than_that_of_a_check_are_noted(period, matched, noted):
    case = SimpleNamespace(suite={"matched": matched})
    found = SimpleNamespace(checks=[SimpleNamespace(period=3.0), SimpleNamespace(period=period)])
    still = SimpleNamespace(checks=[SimpleNamespace(period=np.nan)])
    notes = answers.note_band(case, [still, found])
    assert len(notes) == noted
    assert all(
        note.startswith("note: the motions of the suite are matched from 0.05 to 2 s, and T = 2.04")
        for note in notes
    )
    assert answers.note_band(SimpleNamespace(suite=None), [found]) == []


@pytest.mark.parametrize(("width", "noted"), [(0.2, True), (5.0, False)])
def test_an_assessment_in_the_plane_names_a_weaker_plane_across(width, noted):
    """Half of the width over the height of the centre of weight of 2 m; alpha_0 is 0.3 g."""
    blocks = [af.Block(((0, -1), (9, -1), (9, 0), (0, 0)), af.STONE, "ground", fixed=True)]
    for x in (0.0, 2.0):
        outline = ((x, 0), (x + 0.6, 0), (x + 0.6, 2), (x, 2))
        blocks.append(af.Block(outline, af.STONE, f"pier at {x}", role="pier"))
    piers = af.masonry.assembled(blocks, af.Contact(1e9, 4e8), width=width)
    notes = answers.note_across(piers, [SimpleNamespace(alpha_0=0.3), SimpleNamespace(alpha_0=0.4)])
    words = f"note: {UNCHECKED_ACROSS}: held by nothing else, all of it begins to overturn at 0.1 g"
    assert [note.startswith(words) for note in notes] == [True] * noted


def test_the_head_of_a_push_says_when_it_begins_to_move(case):
    row = "limit analysis", "the site's 0.2 g", "four-hinge mechanism", "0.5"
    row = answers.Row(*row, PushFactors(0.5, 0.5, "the site's 0.2 g")._asdict())
    data = data_of(case)
    vars(data)["statements"] = {"limit": answers.Statement(["limit analysis"], [row])}
    begins = (
        "Pushed sideways as rigid blocks it begins to move at 0.5 times the site's 0.2 g; "
        "to move is no collapse."
    )
    unchecked = "Perpendicular to this section, as along a wall, it was not checked."
    assert head_of(conclusion.list_facts(data)) == f"{begins} {unchecked}"


def test_a_pushover_depends_on_the_stiffness_of_joints_and_limit_analysis_does_not(case):
    data, push = data_of(case), PushFactors(0.5, 0.5, "the site's 0.2 g")
    stated = {name: state(name, push) for name in ("limit", "pushover")}
    for names, unvaried in ((["limit"], ""), (stated, "stiffness")):
        vars(data)["statements"] = {name: stated[name] for name in names}
        facts = dict(conclusion.list_facts(data))
        said = facts.get("depends on", "")
        assert said == sentence(conclusion.DEFAULT_STIFFNESS) * bool(unvaried)
        assert ("stiffness" in doubts.list_unvaried(data)) == bool(unvaried)
        texts = " ".join(getattr(x, "text", "") for x in conclusion.build_conclusion(data).pieces)
        assert texts.count("Shaken it may begin to move at less") == 1
    given = {"normal_stiffness": 2e9, "shear_stiffness": 1e9, "friction": 0.6}
    measured = af.Case.of({**case.settings, "contacts": {"stone to stone": given}})
    assert "depends on" not in dict(conclusion.list_facts(replace(data, case=measured)))


@pytest.mark.parametrize(("least", "place"), [(0.6, ""), (0.4, "x = 2")])
@pytest.mark.parametrize(
    ("result", "finding", "words"),
    [
        ("limit", "least_push_over_site", "push, 0.08 g, is 0.4 times the site's acceleration"),
        ("assessment", "least_margin", "margin is ≤ 0.4"),
    ],
)
def test_a_study_that_finds_less_is_named_beside_the_result(
    case, result, finding, words, least, place
):
    """The margin of a result is that of its case alone."""
    push, check = (
        PushFactors(0.5, 0.7, "the site's 0.2 g"),
        answers.Ratios("SLV", ["right"], 0.5, 0.7),
    )
    stated = state(result, {"limit": push, "assessment": check}[result])
    data = data_of(case)
    vars(data)["case"] = af.Case.of({**case.settings, "assessment": SPECTRUM})
    found = np.array([0.7, least, np.nan])
    columns = {finding: ("x", found)} | dict.fromkeys(("least_push", "push"), ("x", 0.2 * found))
    table = xr.Dataset({finding: columns.pop(finding)}, {"x": [1.0, 2.0, 3.0]})
    table = table.assign(columns) if result == "limit" else table
    bounds = "least_margin" * (result == "assessment")
    table[UPPER_BOUNDS] = "x", [bounds] * 3
    vars(data)["studies"] = [collect_findings("", "", table)]
    margin = say_margin(data, **{result: stated})
    verdict = head_of(conclusion.list_facts(data))
    below = ", where the check fails" * bool(bounds)
    lower = f"in the study the least {words}, at {place}{below}"
    # in the head, and not again
    assert [x for x in margin if "study" in x] == []
    assert (sentence(lower) in verdict) == ("study" in verdict) == bool(place)


@pytest.mark.parametrize(
    ("norm", "first"),
    [
        ("Eurocodes", "by Eurocodes on a fair road"),
        ("EN 1991-2", "by Eurocodes on a fair road"),
        ("NTC 2018", "by Eurocodes on a fair road"),
        ("CS 454", "by CS 454"),
        ("", "by CS 454"),
    ],
)
def test_a_rating_is_stated_by_the_norm_of_the_report_alone(case, norm, first):
    """Its least factor over what is assumed, here 0.9 of that as given, is the margin."""
    codes = {"by CS 454": "0.8", "by Eurocodes on a fair road": "1.4", "by Eurocodes": "1.6"}
    rows = [
        answers.Row("rating", f"lorry {by}", "passes", x, {"passes": True, "least": 0.9 * float(x)})
        for by, x in codes.items()
    ]
    said = [f"lorry {by}: factor {factor}, passes" for by, factor in codes.items()]
    settings = {key: value for key, value in case.settings.items() if key != "motion"}
    data = ReportData(af.Case.of(settings | ({"report": {"norm": norm}} if norm else {})), {})
    vars(data)["statements"] = {"rating": answers.Statement(said, rows)}
    verdict = head_of(conclusion.list_facts(data))
    needed = ", 1 is required" * bool(norm)
    least = 0.9 * float(codes[first])
    assert verdict == f"Rating for lorry {first}: factor {codes[first]}{needed}, passes."
    assert conclusion._rank_verdict(data)[1] == {"the vehicle": pytest.approx(least)}
    assert words_of(data)[0].startswith(f"Lorry {first[:12]}")
    (table,) = capacities.tabulate_capacities({"": data})
    settings |= {"report": {"demand": "PGA 0.25 g"}}
    vars(data)["case"] = af.Case.of(settings)
    assert capacities.tabulate_demands(data) == []  # of a vehicle there is none of an earthquake
    assert table.caption.endswith("Factors are multiples of the demand: a load makes a mechanism")
    assert first in table.rows[0][1]
    assert {row[3] for row in table.rows} == {*codes.values()}  # others are not left out


@pytest.mark.parametrize(
    ("norm", "of_norm", "margin"),
    [
        ("NTC 2018", "by Eurocodes on a fair road (1.35 × 1.4, from memory): factor 1.858", 1.587),
        ("CS 454", "by CS 454 (1.9, and 1.8 on the worst axle, from memory): factor 1.176", 1.003),
        ("", "", 1.003),
    ],
)
def test_the_factor_without_a_code_and_its_place_stand_beside_that_of_the_norm(
    case, norm, of_norm, margin
):
    """Factors of a lorry on a bridge, as given and with less of fill and stones, least first."""
    place = ", without partial factors, with 2 axles of 3 at x = 11.39 and 12.69 m, 5.23 and 6.53 m"
    place += " from the left clear springing (the other at 15.89 m)"
    found = [
        (" by CS 454 (1.9, and 1.8 on the worst axle, from memory)", "", "1.176", 1.003, 1.052),
        (" by Eurocodes on a fair road (1.35 × 1.4, from memory)", "", "1.858", 1.587, 1.652),
        ("", place, "3.512", 3.0, 3.135),
    ]
    over = "{:.4g} without the pressure of the fill; {:.4g} if stones also crush at 5 MPa"
    rows = [
        answers.Row(
            "rating",
            f"lorry{by}",
            f"passes{at}; {over.format(middle, least)}",
            factor,
            {"passes": True, "least": least, "state": "with neither"},
        )
        for by, at, factor, least, middle in found
    ]
    settings = {key: value for key, value in case.settings.items() if key != "motion"}
    data = ReportData(af.Case.of(settings | ({"report": {"norm": norm}} if norm else {})), {})
    vars(data)["statements"] = {"rating": answers.Statement([], rows)}
    (by, middle), *_ = ((each[0], each[-1]) for each in found if each[3] == margin)
    first = f"Rating for lorry {of_norm} as given, 1 is required, passes; "
    first += f"{over.format(middle, margin)}. "
    bare = "Rating for lorry: factor 3.512 as given, passes, without partial factors; "
    bare += f"{over.format(3.135, 3.0)}. Worst with 2 axles of 3 at x = 11.39 and 12.69 m."
    assert head_of(conclusion.list_facts(data)) == first * bool(norm) + bare
    assert conclusion._rank_verdict(data)[1] == {"the vehicle": margin}
    margins = dict(conclusion.list_joint_facts({"A": data, "B": data}))["margin"]
    short = by.partition(" (")[0]  # the table has the partial factors
    of = f"{format_ratio(margin)} times the vehicle, lorry{short}, with neither"
    by_norm = f", ratings by codes that go with {norm}," * bool(norm)
    assert margins == f"The least margins{by_norm} are of A {of}; of B {of}."
    noted = "archfem has no rating by NTC 2018: Eurocodes stand for it"
    assert doubts.list_notes(data) == ({"rating": [noted]} if norm == "NTC 2018" else {})
    # a state that may have less bounds it from above
    part = "all unfavourable at once not computed"
    numbers = {"passes": True, "least": margin, "state": part}
    rows = [row._replace(numbers=numbers) for row in rows if row.numbers["least"] == margin]
    vars(data)["statements"] = {"rating": answers.Statement([], rows)}
    margins = dict(conclusion.list_joint_facts({"A": data, "B": data}))["margin"]
    assert f"of B at most {of.replace('with neither', part)}." in margins


@pytest.mark.parametrize(
    ("norm", "needed"), [("EN 1991-2", ", 1 is required"), ("SIA 269", ""), ("", "")]
)
def test_ratings_that_disagree_are_all_in_the_headline(case, norm, needed):
    """The least of the norm; of the others those that turn out otherwise."""
    says = "It fails too for lorry by CS 454 (0.95). It passes for lorry by Eurocodes (1.47)."
    found = {"LM1": "0.82", "lorry by CS 454": "0.95", "lorry by Eurocodes": "1.47"}
    rows = [
        answers.Row("rating", name, "in words", x, {"passes": float(x) >= 1.0, "least": float(x)})
        for name, x in found.items()
    ]
    data = ReportData(af.Case.of({**case.settings, "report": {"norm": norm}}), {})
    vars(data)["statements"] = {"rating": answers.Statement([], rows)}
    verdict = head_of(conclusion.list_facts(data))
    assert verdict.endswith(f"Rating for LM1: factor 0.82{needed}, in words. {says}")
    assert all(f"{name}: factor" in verdict or name in says for name in found)


def test_a_stricter_code_that_passes_only_on_some_fills_stands_beside_that_of_the_norm(case):
    """By CS 454 it fails without the pressure of the fill, and passes with it."""
    only, without = "passes only with the pressure of the fill", "without the pressure of the fill"
    found = {
        "lorry by Eurocodes": ("passes", "1.5", 1.1),
        "lorry by CS 454": (f"{only}; 0.9 (axle at x = 1 m) {without}", "1.005", 0.7),
        "LM1": (f"{only}, with 1 axle at x = 2 m; 0.8 {without}", "1.1", 0.8),
    }
    rows = [
        answers.Row("rating", name, words, x, {"passes": True, "least": least})
        for name, (words, x, least) in found.items()
    ]
    # 0.7 is of all that is unfavourable, and not of the pressure alone
    rows[1].numbers["state"] = "all unfavourable at once"
    settings = {key: value for key, value in case.settings.items() if key != "motion"}
    data = ReportData(af.Case.of(settings | {"report": {"norm": "EN 1991-2"}}), {})
    vars(data)["statements"] = {"rating": answers.Statement([], rows)}
    assert head_of(conclusion.list_facts(data)) == (
        "Rating for lorry by Eurocodes: factor 1.5, 1 is required, passes. It passes only with the "
        f"pressure of the fill for lorry by CS 454 (1.005, 0.9 {without}, 0.7 all unfavourable at "
        f"once) and LM1 (1.1, 0.8 {without})."
    )


def test_a_joint_head_states_what_differs_and_of_which_check_a_margin_is(case):
    """Three norms and one author; one check that is passed as nothing moves."""
    norms, parts = {"A": "EN 1991-2", "B": "EN 1998-1", "C": "EN 1998-1"}, {}
    for name, norm in norms.items():
        report = {"author": "A. Mason", "norm": norm} | ({"place": "Vale"} if name == "B" else {})
        data = parts[name] = ReportData(af.Case.of(case.settings | {"report": report}), {})
        rests = 1.25 if name == "B" else None
        check = answers.Ratios("damage", ["right"], 1.4, 1.4, displaced=rests)
        row = answers.Row("assessment", "in", "words", "1.4", check._asdict())
        vars(data)["statements"] = {"assessment": answers.Statement([], [row])}
        vars(data)["transverse_push"] = np.nan
    facts = dict(conclusion.list_joint_facts(parts))
    signed = {key: facts[key] for key in ("author", "norm", "place")}
    expected = {"author": "A. Mason", "norm": "EN 1991-2 (A); EN 1998-1 (B and C)"}
    assert signed == expected | {"place": "Vale (B)"}
    earth = "1.4 times the earthquake"
    rest = f"of B {earth} until it begins to move, 1.25 by displacements (damage, right)"
    by = f"{earth} by damage, right"
    assert facts["margin"] == f"The least margins are of A {by}; {rest}; of C {by}."


def test_without_a_norm_a_rating_without_a_code_comes_first(case):
    """Ratings by codes stand in the head where they fail."""
    codes = {"lorry by CS 454": ("1.6", True), "lorry": ("4.1", True)}
    codes |= {"lorry alone at walking pace (1.1 × 1, from memory)": ("4.5", True)}
    for least, passes in (("1.6", True), ("0.9", False)):
        codes["lorry by CS 454"] = least, passes
        rows = [
            answers.Row("rating", name, f"in words {name}", x, {"passes": each, "least": float(x)})
            for name, (x, each) in codes.items()
        ]
        settings = {key: value for key, value in case.settings.items() if key != "motion"}
        data = ReportData(af.Case.of(settings), {})
        vars(data)["statements"] = {"rating": answers.Statement([], rows)}
        fails = "" if passes else " It fails for lorry by CS 454 (0.9)."
        verdict = dict(conclusion.list_facts(data))["verdict"]
        assert verdict == f"Rating for lorry: factor 4.1, in words lorry.{fails}"
        tables = [x for x in conclusion.build_conclusion(data).pieces if hasattr(x, "rows")]
        assert tables[0].rows[0][1] == "lorry"
    # in one of the states that are assumed the bridge does not stand
    falls = "it does not stand without the backing"
    rows = [rows[1]._replace(outcome=f"passes; {falls}", numbers={"passes": True, "least": 0.0})]
    vars(data)["statements"] = {"rating": answers.Statement([], rows)}
    verdict = dict(conclusion.list_facts(data))["verdict"]
    assert verdict == f"Rating for lorry: factor 4.1 as given, passes; {falls}."


@pytest.mark.parametrize(("ag", "overturns"), [(0.1, False), (0.2, True)])
def test_a_demand_that_overturns_it_across_its_plane_is_in_the_conclusion(ag, overturns):
    """An arch on piers that overturns across its plane at 0.15 g; a site of 1.2 ag."""
    tables = {
        "structure": {
            "shape": "arch_on_piers",
            "radius": 1.5,
            "thickness": 0.4,
            "voussoirs": 9,
            "courses": [1.0],
            "pier_breadth": 1.0,
            "width": 0.5,
        },
        "assessment": {
            "spectrum": {"code": "NTC-2018", "ag": ag, "f0": 2.4, "tc_star": 0.32, "site": "B"}
        },
    }
    case = af.Case.of(tables)
    push, _ = find_transverse_push(case.structure)
    assert 0.12 < push < 0.24
    data = ReportData(case, {})
    vars(data)["statements"] = {"limit": answers.Statement([], [])}
    (block,) = margins.build_transverse(data)
    assert block.text.startswith("Held by nothing else, all of it begins to overturn at ")
    assert (block.manner == "doubt") is overturns
    words = f". The demand, {1.2 * ag:.3g} g, exceeds it ({1.2 * ag / push:.3g} ×)"
    assert (words in block.text) is overturns
    words = f"it was not checked, where it may overturn from {push:.3g} g on"
    words += f" ({push / (1.2 * ag):.3g} × the demand, {1.2 * ag:.3g} g)."
    assert words in head_of(conclusion.list_facts(data))
    # head and paragraph state it, and no row repeats it
    assert {row.result for _, row in capacities._capacity_rows(data)} == {"at rest"}
    shaken = data_of(case, a=verdict_of())
    verdict = head_of(conclusion.list_facts(shaken))  # by stronger motions of 0.204 g
    assert words in verdict
    assert verdict.startswith(f"Across the plane of the drawing {words} Under its") is overturns
    assert verdict.count("it was not checked") == 1
    # a least thickness is one in the plane, and a vehicle is no earthquake
    vars(data)["statements"] = {"thickness": answers.Statement([], [])}
    assert words in head_of(conclusion.list_facts(data))
    vars(data)["statements"] = {"rating": answers.Statement([], [])}
    assert margins.build_transverse(data) == []


def wall_in_bond(**section):
    """A wall of three courses, as thick and high as the block that rocks."""
    blocks = [{"name": "ground", "outline": [[0, -1], [4, -1], [4, 0], [0, 0]], "fixed": True}]
    for k, cuts in enumerate([(0, 1, 2, 3, 4), (0, 1.5, 2.5, 4), (0, 1, 2, 3, 4)]):
        low, high = (HEIGHT / 3.0 * np.array([k, k + 1])).round(9).tolist()
        blocks += [
            {"name": f"{k} {a}", "outline": [[a, low], [b, low], [b, high], [a, high]]}
            | {"part": "wall", "role": "pier"}
            for a, b in pairwise(cuts)
        ]
    structure = {"shape": "blocks", "width": BREADTH, "gravity": G, "blocks": blocks}
    return af.Case.of({"structure": structure, **section})


@pytest.mark.slow
def test_a_report_of_a_wall_has_its_falls_across_the_plane_as_one_rigid_body(monkeypatch):
    """The least half sine of frequency p that overturns it, integrated from impact to impact."""
    edge = 0.33033
    assert overturns(1.0, 1.002 * edge, 1)
    assert not overturns(1.0, 0.998 * edge, 1)
    data = data_of(wall_in_bond(), weak=verdict_of(), strong=verdict_of())
    vars(data)["motions"] = {
        name: replace(sine(1.0, edge / share, 1, 1e-3), name=name)
        for name, share in (("weak", 1.25), ("strong", 0.8))
    }
    assert data.across[0].keys() == {"strip", "whole"}  # a rectangle, which both are
    for first, name in data.across[0].values():
        assert name == "strong"
        assert 0.8 <= first.scale <= 0.8 * 1.01
    first = data.across[0]["strip"][0].scale
    scale, peak = f"{first:#.3g}", first * edge / 0.8 * G / 9.80665  # at the fall
    at = f"{peak:#.3g} g ({scale} × 'strong'): the strip"
    assert say_margin(data)[0].startswith(f"the least margin is below {at} across the plane")
    verdict = head_of(conclusion.list_facts(data))
    assert verdict.startswith("In its plane it stands under all 2 motions of PGA ")
    assert (
        f". Across its plane, held by nothing else, it first falls at {at} as one rigid" in verdict
    )
    assert "was not computed" not in verdict
    assert "survives" not in verdict
    (text,) = margins.build_transverse(data)
    assert text.text.startswith("Held by nothing else, ")
    rows = [row for name, row in capacities._capacity_rows(data) if not name]
    assert [(row.demand, row.factor) for row in rows] == [("'strong', of 0.1 to 2 ×", scale)] * 2
    # without the strong one it stands at the motion, and the margin is above one
    del data.motions["strong"]
    del vars(data)["across"]
    assert 1.25 <= data.across[0]["whole"][0].scale <= 1.25 * 1.01
    verdict = head_of(conclusion.list_facts(data))
    assert verdict.startswith("It survives: it stands under ")
    first = data.across[0]["strip"][0].scale
    peak = first * edge / 1.25 * G / 9.80665
    at = f"{peak:#.3g} g ({first:#.3g} × 'weak'): the strip as one rigid body"
    assert f"Across its plane, held by nothing else, it first falls at {at}. From which" in verdict
    assert "acceleration on it falls in its plane was not computed." in verdict
    # a failure of the columns is a clause, and stops no report
    data = data_of(data.case, weak=verdict_of())
    vars(data)["motions"] = {"weak": sine(1.0, edge, 1, 1e-3)}
    monkeypatch.setattr(report_data, "find_falls_across", Mock(side_effect=InvalidInput("no face")))
    (text,) = margins.build_transverse(data)
    assert text.text.endswith(". Not checked against the motions across: no face.")
    # a column is no wall in bond, and may be drawn across its plane
    column = data_of(af.Case.of({"structure": {"shape": "column", "breadth": 1, "heights": [2]}}))
    assert column.across == ({}, "")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("share", "falls"),
    [
        (0.8, True),
        (1.25, False),
        (2.5, None),
    ],
)
def test_a_run_of_a_wall_says_at_which_scale_it_falls_across_its_plane(
    share, falls, tmp_path, capsys, unplotted
):
    """The half sine above over the share: it falls at the share, in the headline only below 1."""
    pulse = sine(1.0, 0.33033 / share, 1, 1e-3)
    rows = np.column_stack([pulse.dt * np.arange(len(pulse.horizontal)), pulse.horizontal])
    np.savetxt(tmp_path / "pulse.csv", rows, delimiter=",", header="Time (s),Acc (m/s2)")
    given = wall_in_bond().settings
    model = {"fidelity": "rigid", "displacements": "large"}
    motion = {"file": "pulse.csv"}
    case = {**given, "model": model, "motion": motion}
    (tmp_path / "wall.toml").write_text(format_tables(case), encoding="utf-8")
    folder = tmp_path / "out"
    af.commands.main(["run", str(tmp_path / "wall.toml"), "--out", str(folder)])
    headline, *lines = capsys.readouterr().out.splitlines()
    (line,) = [line for line in lines if line.startswith("across its plane, as one rigid body")]
    of = "the strip falls at none; " if falls is None else "the strip first falls at "
    assert of in line
    if falls is not None:
        peak, _, scale, *_ = line.rpartition("first falls at ")[2].split()
        assert share <= float(scale.removeprefix("(")) <= 1.01 * share
        # the peak at the fall, and not that of the motion as given
        assert 0.998 <= float(peak) / (0.33033 * G / 9.80665) <= 1.012
    said = "; across its plane the strip first falls at 0.331 g (0.80"
    assert (said in headline) is bool(falls)
    assert ("across its plane" in headline) is bool(falls)
    # the first lines of the summary and of the range of the verdict have it too
    summary = (folder / "summary.txt").read_text(encoding="utf-8").splitlines()
    assert (said in summary[0]) is bool(falls)
    assert line in summary
    # one statement on what is checked across the plane, with the push that overturns it
    assert not [line for line in lines if "nothing is checked across" in line]
    (line,) = [line for line in lines if "begins to overturn" in line]
    assert line.startswith(
        "across the plane of the drawing a run checks it as one rigid body: held"
    )


@pytest.mark.parametrize(("share", "falls"), [(0.8, True), (1.25, False)])
def test_a_range_of_the_verdict_says_that_a_wall_falls_across_its_plane(
    share, falls, monkeypatch, capsys
):
    """Beside the headline, and below 1 × alone."""
    monkeypatch.setattr(variations, "verdict_range", lambda *_, **__: range_of(0.01, 0.02))
    pulse = sine(1.0, 0.33033 / share, 1, 1e-3)
    monkeypatch.setattr(margin, "_choose_motion", lambda *_: pulse)
    monkeypatch.setattr(af.Case, "read", lambda *_: wall_in_bond(title="wall"))
    af.commands.main(["verdict", "wall.toml"])
    _, headline, *rest = capsys.readouterr().out.splitlines()
    said = "; across its plane the strip first falls at 0.331 g (0.80"
    assert headline.startswith("falls in none of 2 variations")
    assert (said in headline) is falls
    assert ("across" in headline) is falls
    assert not [line for line in rest if "across" in line]


def test_a_structure_with_rings_that_stands_across_its_plane_was_checked(monkeypatch):
    """A ring beside a wall in bond, which a run checks as one rigid body too."""
    given = wall_in_bond().settings["structure"]
    beside = [[[6, y], [7, y], [7, y + 1], [6, y + 1]] for y in (-1, 0, 1)]
    ring = [
        {"name": f"r{k}", "outline": x, "part": "r", "role": "ring"} for k, x in enumerate(beside)
    ]
    ring[0] = {"name": "rock", "outline": beside[0], "fixed": True}
    data = data_of(
        af.Case.of({"structure": given | {"blocks": given["blocks"] + ring}}), m=verdict_of()
    )
    assert "ring" in {joint.role for joint in data.case.structure.joints}
    falls = {"strip": (FirstFall(np.inf, None), "m"), "whole": (FirstFall(np.inf, None), "m")}
    monkeypatch.setattr(report_data, "find_falls_across", lambda *_: falls)
    (text,) = margins.build_transverse(data)
    assert text.text.startswith("Held by nothing else, ")
    assert "not checked" not in head_of(conclusion.list_facts(data))
    rows = [row.outcome for name, row in capacities._capacity_rows(data) if not name]
    assert rows == ["as one rigid body it falls at none, held by nothing else"] * 2


def test_the_vertical_peak_of_a_demand_is_that_of_the_motion_and_not_of_a_run_that_ended(case):
    """The run ends before the motion's vertical peak of 1 m/s²."""
    motion = np.array([[2.0, 0.4], [0.0, -1.0]])
    data = data_of(case, m=verdict_of())
    data.runs["m"].dataset["ground"][0, 1] = 0.4
    data.runs["m"].dataset[MOTION_VARIABLE] = ("sample", "axis"), motion, {"dt": 0.01}
    ((name, *_),) = capacities.list_demands(data)
    assert name == "motions, with vertical ones of up to 0.1 g"


def test_a_wall_that_stands_again_says_so_beside_its_first_fall():
    """One sine of ω/p = 5, integrated from impact to impact: it does not fall at its full scale."""
    assert [overturns(5.0, peak, 2) for peak in (0.65, 0.75, 1.75)] == [False, True, False]
    sines = sine(5.0, 1.75, 2, 1e-3)
    wall = wall_in_bond().structure
    found = find_falls_across(wall, {"sines": sines})
    first, name = found["strip"]
    peak = first.scale * 1.75 * G / 9.80665
    assert 0.65 < first.scale * 1.75 < 0.75
    assert first.again[0] < 1.0 < first.again[1]
    assert name == "sines"
    assert (
        f"under 'sines' the strip first falls at {peak:#.3g} g ({first.scale:#.3g} × the motion), "
        f"and does not fall at some scales from {first.again[0]:#.3g} to {first.again[1]:#.3g} ×; "
        "under "
    ) in describe_falls_across(found, {"sines": sines})
    line, headline = check_across(wall, {"sines": sines})
    assert headline == (
        f"; across its plane the strip first falls at {peak:#.3g} g ({first.scale:#.3g} × the "
        f"motion), and does not fall at some scales from {first.again[0]:#.3g} to "
        f"{first.again[1]:#.3g} ×"
    )
    assert line == describe_falls_across(found, {"sines": sines})


def test_a_wall_that_slides_before_it_rocks_is_not_checked_across_its_plane(caplog):
    """One course as thick as high slides at its friction, 0.6, before it turns at 1 g."""
    blocks = [af.Block(((0, -1), (4, -1), (4, 0), (0, 0)), af.STONE, "ground", fixed=True)]
    for level, cuts in ((0.0, (0, 2, 4)), (0.5, (0, 1, 3, 4))):
        for a, b in pairwise(cuts):
            outline = ((a, level), (b, level), (b, level + 0.5), (a, level + 0.5))
            blocks.append(af.Block(outline, af.STONE, f"{level} {a}", part="wall", role="pier"))
    wall = af.masonry.assembled(blocks, af.Contact(1e9, 4e8, friction=0.6), width=1.0)
    motion = af.Motion(np.full(100, 8.0), 0.01, name="push")
    with pytest.raises(InvalidInput, match="no column of the wall rocks"):
        find_falls_across(wall, {"push": motion})
    assert find_falls_across(wall, {}) == {}
    assert check_across(wall, {"push": motion}) == ("", "")
    assert "the wall was not checked against the motions across its plane: " in caplog.text


@pytest.mark.parametrize("demand", [pytest.param(None, marks=pytest.mark.slow), "0.2 g"])
def test_a_push_is_compared_with_a_demand_in_numbers_and_words_are_not_read(
    demand, tmp_path, unplotted
):
    """A stone 0.5 m broad and 1 m high, which a push of 0.5 g overturns."""
    tables = {
        "title": "a stone",
        "structure": {"shape": "column", "breadth": 0.5, "heights": [1.0]},
        "contacts": {"stone to stone": {"friction": 0.8}},
        "limit": {"horizontal": 1.0},
        "report": {"demand": "0.3 g at the ground"},
    }
    if demand is not None:
        tables["limit"]["demand"] = demand
    path = tmp_path / "stone.toml"
    path.write_text(format_tables(tables), encoding="utf-8")
    assert af.commands.main(["limit", str(path), "--out", str(tmp_path / "out")]) == 0
    found = af.cases.open_results(tmp_path / "out")
    data = ReportData(found.case, {}, found.folder)
    demands, table = [x for x in conclusion.build_conclusion(data).pieces if x.kind == "grid"][:2]
    text = " ".join(words_of(data))
    own = [("push", "0.2 g", "[limit]", "limit analysis")] if demand else []
    assert [*demands.rows] == [
        (
            *("as stated", "0.3 g at the ground", "[report]"),
            "words alone, which are compared with none" + ": limit.demand is" * bool(demand),
        ),
        *own,
    ]
    verdict = head_of(conclusion.list_facts(data))
    ((_, shown, _, factor),) = table.rows
    if demand is None:
        assert (shown, factor) == (answers.NO_DEMAND, "-")
        assert verdict.startswith("Limit analysis: overturning about the toe of")
    else:
        assert (shown, factor) == ("the demand of 0.2 g", "2.5")
        assert verdict.startswith(
            "Pushed sideways as rigid blocks it begins to move at 2.5 times the demand of 0.2 g"
        )
    assert answers.NO_DEMAND not in text + verdict


@pytest.mark.parametrize(
    ("text", "equal"), [("ag = 0.2 g on rock", True), ("ag = 0.25 g", False), ("0.2 g", False)]
)
def test_a_stated_ag_is_compared_with_that_of_the_spectrum(case, text, equal):
    settings = {**case.settings, "assessment": SPECTRUM, "report": {"demand": text}}
    data = data_of(af.Case.of(settings), a=verdict_of())
    vars(data)["statements"] = {
        "assessment": state("assessment", answers.Ratios("a", [], 2.0, 2.0))
    }
    (grid,) = capacities.tabulate_demands(data)
    words = "those of the EC8 spectrum, as its ag is equal"
    assert (grid.rows[0][-1] == words) == equal
    assert ("compared with none" in grid.rows[0][-1]) != equal


def test_a_note_of_mirrored_mechanisms_stands_once_and_begins_with_its_symbol(case):
    """They differ in the names of blocks alone; others that differ in a number are two."""
    words = "d* is of the centroid of {}, at first the fastest, whose capacity is {} times"
    notes = [words.format("v 11", 1.28), "faces slide flat", words.format("v 1", 1.28)]
    notes.append(words.format("v 1", 1.5))
    data = data_of(case, a=verdict_of())
    checked = state("assessment", answers.Ratios("a", [], 2.0, 2.0))._replace(notes=notes)
    vars(data)["statements"] = {"assessment": checked}
    assert doubts.list_notes(data) == {"kinematic assessment": [notes[0], notes[1], notes[3]]}
    assert sentence(notes[0]).startswith("d* is of the centroid of v 11")
    assert [sentence(x) for x in ("it stands", "k_s is small", "a")] == [
        *("It stands.", "k_s is small.", "A.")
    ]


@pytest.mark.parametrize(("friction", "slides"), [(0.5, 0.45), (0.3, 0.15)])
def test_supports_slide_across_the_plane_by_the_friction_that_the_thrust_leaves(friction, slides):
    """By hand: 56.11 kN on springings inclined by 80.312°, with a thrust of 12.72 kN at rest."""
    inclined, weight, thrust = np.radians(80.312), 56.11e3, 12.72e3
    normal = 0.5 * weight * np.sin(inclined) + thrust * np.cos(inclined)
    shear = 0.5 * weight * np.cos(inclined) - thrust * np.sin(inclined)
    by_hand = 2.0 * np.sqrt((friction * normal) ** 2 - shear**2) / weight
    assert by_hand == pytest.approx(slides, abs=5e-3)  # two digits
    ring = {"shape": "circular_arch", "span": 3.2, "rise": 1.35, "thickness": 0.42}
    ring |= {"voussoirs": 13, "width": 1.0}
    settings = {"structure": ring, "contacts": {"stone to stone": {"friction": friction}}}
    settings |= {"materials": {"stone": {"unit_weight": 26000.0}}}
    settings |= {"motion": {"synthetic": {"duration": 1.0, "pga": 2.0}}}
    data = data_of(af.Case.of(settings), a=verdict_of())
    joints = len(data.case.structure.joints)
    forces = {"N": np.full(joints, 1e9), "V": np.zeros(joints)}
    for name, size in {"N": normal, "V": shear}.items():
        forces[name][[0, -1]] = size
    forces["V"][0] *= -1.0  # its sense does not matter
    vars(data)["dead"] = xr.Dataset({name: ("joint", each) for name, each in forces.items()})
    assert data.transverse_slide == pytest.approx(by_hand, rel=1e-3)  # of the weight by hand
    # the demand is 2 m/s², 0.204 g; the ring overturns at 0.489 g
    said = " ".join(conclusion._say_unchecked(data)[0])
    ratio = format_ratio(data.transverse_slide / (2.0 / 9.80665))
    words = (
        f"where it may slide from {by_hand:.3g} g on ({ratio} × the demand, 0.204 g), and overtur"
    )
    assert words in said
    assert conclusion._say_unchecked(data)[1] == (slides < 0.204)
    (block,) = margins.build_transverse(data)
    assert f"its supports slide across at {by_hand:.3g} g" in block.text
    assert block.manner == ("doubt" if slides < 0.204 else "plain")
    vars(data).pop("transverse_slide")
    vars(data)["dead"] = None
    (block,) = margins.build_transverse(data)
    assert "Sliding across it was not checked." in block.text


def test_the_factor_at_rest_stands_in_the_section_of_the_least_thickness_alone(case, undrawn):
    """That section has it with thinner stones, and of less deep joints under the same weight."""
    ring = {"shape": "circular_arch", "span": 3.2, "rise": 1.35, "thickness": 0.42}
    settings = {**case.settings, "structure": ring | {"voussoirs": 9}}
    for name, said in ("limit", True), ("thickness", False):
        data = data_of(af.Case.of(settings))
        vars(data)["statements"] = {name: state(name)}
        pieces = sections.build_structure_section(data).pieces
        text = " ".join(getattr(x, "text", "") for x in pieces)
        assert ("Geometric factor" in text) == said
        assert "coefficient of friction" in text


def test_runs_beyond_the_push_of_a_demand_say_nothing_of_it():
    """A run of 0.3 g that moves; a push of twice the demand is more than that, or less."""
    case = af.Case.of({"structure": {"shape": "column", "breadth": 0.5, "heights": [1.0]}})
    data = data_of(case, a=verdict_of("stands", verified="rocks"))
    run = data.runs["a"]
    run.dataset.attrs["pga"] = 0.3 * 9.80665
    assert margins._say_motion(data, 2.0, 0.2) == "in the runs it moves, and falls in none"
    assert margins._say_motion(data, 2.0, 0.1) == ""
    assert margins._say_motion(data, 2.0, np.nan) != ""


def test_a_demand_of_limit_analysis_comes_before_that_of_the_site():
    tables = {
        "structure": {"shape": "column", "breadth": 0.5, "heights": [1.0]},
        "limit": {"horizontal": 1.0, "demand": "2.5 m/s**2"},
        "assessment": SPECTRUM,
    }
    assert site_acceleration(af.Case.of(tables)) == pytest.approx(2.5 / 9.80665)
    del tables["limit"]["demand"]
    assert site_acceleration(af.Case.of(tables)) == pytest.approx(0.2)
    with pytest.raises(af.errors.InvalidInput, match=r"limit.demand"):
        af.Case.of({**tables, "limit": {"horizontal": 1.0, "demand": 0.0}})


def test_variations_that_miss_the_run_have_no_range_of_displacements(case):
    found = range_of(0.0012, 0.004)
    for moved, stated in ((0.0023, True), (0.0047, False), (0.0005, False)):
        data = data_of(case, found, first=verdict_of(displacement=moved))
        listed = str([*capacities._capacity_rows(data)])
        assert ("largest displacements 1.2 mm to 4 mm" in listed) is stated


def test_a_study_of_another_structure_has_no_part_in_the_answer(case, tmp_path, undrawn):
    """A block begins to move at the ratio of its sides; sites are of 0.2 g."""
    sides = {"own": "0.5", "a point": "0.4", "other": "0.4"}
    text = format_tables({**case.settings, "assessment": SPECTRUM, "limit": {"horizontal": 1.0}})
    (tmp_path / "case.toml").write_text(text)
    folders = [tmp_path / name for name in sides]
    for folder, (name, side) in zip(folders, sides.items(), strict=True):
        vary = "[0.5, 0.3]" if name == "a point" else "[0.35, 0.3]"
        study = tmp_path / f"{name}.toml"
        study.write_text(
            f'title = "{name}"\ncase = "case.toml"\nset = ["structure.breadth={side}"]\n'
            f'compute = "limit"\n[vary]\nstructure.breadth = {vary}\n'
        )
        command = ["study", str(study), "--out", str(folder), "--workers", "1"]
        assert af.commands.main(command) == 0
    given = af.Case.read(tmp_path / "case.toml")
    push = PushFactors(1.25, 1.25, "the site's 0.2 g")
    for shown, least in ((folders[:1], "own"), (folders[1:2], "a point"), (folders[2:], "")):
        data = ReportData(given, {}, study_folders=shown)
        vars(data)["statements"] = {"limit": state("limit", push)}
        facts = dict(conclusion.list_facts(data))
        words = "the least push, 0.15 g, is 0.75 times the site's acceleration"
        said = f"In the study '{least}' {words}"
        verdict = head_of(facts.items())
        assert (said in verdict) == ("study" in verdict) == bool(least)
        words = "The study 'other': none of its cases is known to have the structure of this report"
        texts = [getattr(each, "text", "") for each in conclusion.build_conclusion(data).pieces]
        assert any(f"In doubt, study: {words}." in text for text in texts) != bool(least)
    # a plan without structures is of an earlier version
    plan = folders[0] / "study.json"
    write_sealed_json(plan, {"points": read_sealed_json(plan, "study")["points"]})
    assert not ReportData(given, {}, study_folders=folders[:1]).own_studies


def test_the_push_is_the_margin_while_a_search_of_scales_is_unfinished(case):
    """A push over 0.1 g, of a structure whose motion has 2 m/s²; the scale is larger."""
    pushed = af.Case.of({**case.settings, "limit": {"horizontal": 1.0, "demand": "0.1 g"}})
    push = PushFactors(3.0, 4.0, "the demand of 0.1 g; vertical acceleration is left out")
    for unfinished in (True, False):
        data = data_of(pushed, a=verdict_of())
        vars(data)["transverse_push"] = np.nan
        found = scales("a", 8.0, moves=5.0, dislocated=9.0, unfinished=unfinished)
        searched = state("scale", found)._replace(doubts=[Doubt("interrupted")] * unfinished)
        vars(data)["statements"] = {"limit": state("limit", push), "scale": searched}
        facts = dict(conclusion.list_joint_facts({"A": data, "B": data}))
        beside = 3.0 * 0.1 * G / 2.0
        over = f"3 times the demand of 0.1 g by a push, {beside:.3g} times the 0.2 g of its motions"
        over += ", by which it may move and need not fall"
        least = over if unfinished else "8 times the earthquake"
        assert facts["margin"] == f"The least margins are of A {least}; of B {least}."
        result = "scale of the motion"
        in_doubt = f"A: {result}; B: {result}" if unfinished else None
        assert facts.get("in doubt") == in_doubt
    vars(data)["pairs"] = ("a", "b")  # of which one was scaled
    least = "8 times the earthquake by its scale under 'a', as not all motions were scaled"
    said = dict(conclusion.list_joint_facts({"A": data, "B": data}))["margin"]
    assert said == f"The least margins are of A {least}; of B {least}."
    # what fails under one motion decides, whatever is left to run under others
    vars(data)["statements"] = {
        "scale": state("scale", scales("b", 0.8, falls=0.9), scales("a", 0.5, unfinished=True))
    }
    assert [x for x, is_margin, _ in margins.list_margins(data) if is_margin] == [0.8]


def test_cases_are_compared_by_the_properties_as_given(case):
    """One lorry alone was varied, all at once to 0.6; the other has the less factor as given."""
    at_once, less = "all unfavourable at once", "without the pressure of the fill"
    parts, numbers = {}, {"A": ("1.3", 0.6, at_once), "B": ("1.1", 0.9, less)}
    for name, (factor, least, of) in numbers.items():
        row = {"passes": True, "least": least, "state": of}
        words = "passes only with the pressure of the fill"
        data = parts[name] = ReportData(case, {})
        stated = answers.Statement([], [answers.Row("rating", "lorry", words, factor, row)])
        vars(data).update(statements={"rating": stated}, transverse_push=np.nan)
    facts = dict(conclusion.list_joint_facts(parts))
    assert facts["verdict"].startswith("The worst of 2 cases is B: Rating for lorry: factor 1.1")
    assert facts["margin"] == (
        f"The least margins are of B 0.9 times the vehicle, lorry, {less}; "
        f"of A 0.6 times the vehicle, lorry, {at_once}."
    )


def test_what_cases_share_stands_with_the_first(case, undrawn):
    """The third has another structure; what the head of all has is not said again."""
    lower = {**case.settings, "structure": {**case.settings["structure"], "heights": [0.9, 1.0]}}
    every = [ReportData(af.Case.of(each), {}) for each in (case.settings, case.settings, lower)]
    every = label_parts(every)
    for data in every.values():
        vars(data)["statements"] = {"limit": state("limit", PushFactors(0.5, 0.5, "the site's"))}
    built = sections.build_joint_sections(every)
    starts = [k for k, each in enumerate(built) if each.level == 2][3:]
    *starts, methods, versions = starts
    # of all cases at the end, with their labels
    assert [name for name, _ in built[methods].pieces[0].rows] == ["methods (A, B and C)"]
    digests = [name for name, _ in built[versions].pieces[0].rows if name.startswith("SHA")]
    assert digests == ["SHA-256 of the case (A and B)", "SHA-256 of the case (C)"]
    built = built[:methods]
    parts = [built[k:end] for k, end in pairwise([*starts, len(built)])]
    for label, listed in zip("ABC", parts, strict=True):
        facts = dict(listed[0].pieces[0].rows)
        assert "structure" in facts
        assert not {"verdict", "not checked"} & {*facts}
        texts = {x.title: getattr(x.pieces[0], "text", "") for x in listed[1:]}
        again = [title for title, text in texts.items() if text == "As of case A."]
        assert ("Structure and dead load" in again) == (label == "B")
        assert ("Inputs and assumptions" in again) == (label != "A")


@pytest.mark.parametrize("varied", ["", "rating.vehicle"])
def test_a_study_stands_once_with_the_case_whose_rating_it_varied(case, monkeypatch, varied):
    """Three cases of one structure: pushed, rated for other vehicles, and for the one studied."""
    rated = {"rating": {"vehicle": {"name": "cart", "axles": ["40 kN"]}}}
    names = ("pushed", "others", "own")
    cases = [af.Case.of({**case.settings, **rated, "title": name}) for name in names]
    values = {"factor": ("case", [3.0, 2.0]), "geometric": ("case", [2.0, 1.5])}
    table = xr.Dataset(values, {"case": ["as given", "thinner"]}, attrs={"varied": varied})
    monkeypatch.setattr(
        report_data,
        "read_study",
        lambda place, _: replace(
            collect_findings("Doubts", "", table),
            name="the study 'Doubts'",
            folder=place,
            digests={"rated"},
        ),
    )
    monkeypatch.setattr(
        ReportData,
        "inputs",
        property(lambda self: "" if self.case.title == "pushed" else "rated"),
    )
    tables = {"others": {"vehicle": "LM1, LM2"}}
    monkeypatch.setattr(
        ReportData,
        "read_table",
        lambda self, key: tables.get(self.case.title, self.case.settings.get(key, {})),
    )
    stated = answers.Statement([], [])
    monkeypatch.setattr(
        ReportData,
        "statements",
        property(lambda self: {} if self.case.title == "pushed" else {"rating": stated}),
    )
    folder = Path("doubts")
    parts = label_parts([ReportData(each, {}, study_folders=[folder]) for each in cases])
    assert [len(each.studies) for each in parts.values()] == [0, 0, 1]
    (found,) = parts["C"].studies
    (said,) = say_what_changes(found)
    of = "" if varied else " for cart"
    assert said.startswith(f"in the study 'Doubts'{of} 'thinner' lowers the factor most, from 3")
    # of two that fit alike it stands with the first
    alike = label_parts([ReportData(cases[2], {}, study_folders=[folder])] * 2)
    assert [len(each.studies) for each in alike.values()] == [1, 0]


def long_sentences(data, chapters=()):
    """Sentences of head, conclusion and captions of more than 25 words, with letters or figures."""
    ended = conclusion.build_conclusion(data)
    said = [text for _, text in conclusion.list_facts(data)]
    said += [piece.text for piece in ended.pieces if piece.kind == "words"]
    captions = [getattr(x, "caption", "") for each in [ended, *chapters] for x in each.pieces]
    sentences = [x for text in said + captions for x in re.split(r"(?<=[.?]) (?=[^a-z])", text)]
    assert len(sentences) > 5
    return [x for x in sentences if sum(bool(re.search(r"\w", word)) for word in x.split()) > 25]


SITE = {"code": "EC8", "type": 1, "ag": 0.25, "ground": "B"}


def ring(**given):
    """A ring under three motions that reach 0.2 g."""
    structure = {"shape": "circular_arch", "radius": 3.0, "thickness": 0.5, "embrace": 160.0}
    structure["voussoirs"] = 5
    pairs = {name: {"synthetic": {"duration": 2.0, "pga": 2.0}} for name in "abc"}
    suite = {"pairs": pairs, "target": SITE, "matched": True}
    model = {"fidelity": "rigid", "displacements": "large"}
    return af.Case.of({"structure": structure, "model": model, "suite": suite, **given})


def test_sentences_are_short_of_a_ring_that_stands_is_scaled_and_has_a_study():
    case = ring(report={"norm": "EN 1998-1", "demand": "0.25 g once in 475 years"})
    worst = verdict_of("dislocated", 0.2)
    worst.fall = SimpleNamespace(
        blocks=("v1", "v2", "v3"), time=None, resting=False, lacks_joints=False, mechanism=""
    )
    data = data_of(case, a=verdict_of(), b=worst, c=verdict_of("fallen"))
    searched = (
        scales("a", 1.1, moves=0.85, dislocated=1.3, falls=1.7, dislocated_stones=" (v1, v2)"),
        scales("b", 0.7, dislocated=0.8, falls=1.5, unfinished=True)._replace(
            states={"moves": 0.75, "dislocated": 0.8, "falls": 1.5},
            dislocated_stones=" (block 8, block 7, block 6)",
            again=[3.74],
        ),
    )
    site = "the site's 0.25 g × S 1.2 (topography 1.0 by default)"
    push = PushFactors(0.8, 1.3, f"{site}; vertical acceleration is left out", 0.0)
    checks = answers.Ratios("significant damage", ["right", "left"], 1.5, 1.5, bounded=True)
    vars(data)["statements"] = {
        "limit": state("limit", push),
        "assessment": state("assessment", checks),
        "scale": state("scale", *searched),
    }
    names = [f"thickness of {k} cm" for k in (40, 36, 44, 48, 52)]
    falls = xr.Dataset(
        {
            "fall": ("case", ["stands", *["fallen"] * 4]),
            "residual_displacement": ("case", np.linspace(0.01, 0.05, 5), {"units": "m"}),
        },
        {"case": names},
    )
    vars(data)["studies"] = [collect_findings("Lengths of the portal by 10 %", "", falls)]
    assert long_sentences(data) == []


@pytest.mark.slow
def test_sentences_are_short_of_a_bridge_that_is_rated_and_shaken(kept_bridge):
    """All captions, too, of one motion and the rating of a lorry."""
    chapters = sections.number_captions(sections.build_sections(kept_bridge))
    assert long_sentences(kept_bridge, chapters) == []


@pytest.fixture(scope="module")
def kept_bridge(tmp_path_factory):
    """A bridge of one ring with fill, rated for a vehicle; and a run of it without the fill."""
    folder = tmp_path_factory.mktemp("bridge")
    text = """
title = "bridge"
[structure]
shape = "bridge"
width = 4.0
[structure.arches]
arch = { span = 4.0, rise = 1.5, thickness = 0.5, voussoirs = 9 }
[model]
fidelity = "rigid"
[motion]
synthetic = { seed = 1, duration = 1.0, pga = 1.0 }
[rating]
vehicle = "LM71"
[report]
norm = "EN 1991-2"
"""
    (folder / "bridge.toml").write_text(text)
    for command in ("run", "rate"):
        given = [command, str(folder / "bridge.toml"), "--out", str(folder / "out")]
        assert af.commands.main(given) in (0, 3)
    return _collect_data(af.cases.open_results(folder / "out"))


def test_sentences_are_short_of_a_wall_that_is_assessed_alone():
    wall = {"shape": "column", "breadth": 0.6, "heights": [0.6] * 4}
    case = af.Case.of({"structure": wall, "assessment": {"spectrum": SITE}})
    data = ReportData(case, {})
    check = answers.Ratios("linear, q = 2, FC = 1.35", ["right"], 0.7, 1.2, "the fill active")
    place = (
        "passes, with 2 axles over 'right arch' at x = 9.96 and 11.16 m, 0.52 and 1.72 m from the "
    )
    place += "left clear springing; the factor is 1.009 to 2.767 over what is assumed of the fill"
    lorry = answers.Row("rating", "LM1", place, "1.66", {"passes": True, "least": 1.009})
    vars(data)["statements"] = {
        "assessment": state("assessment", check),
        "limit": state("limit", PushFactors(0.9, 1.4, "the site's 0.25 g × S 1.2", 0.6)),
        "rating": answers.Statement(["rated"], [lorry]),
    }
    assert long_sentences(data) == []


def test_sentences_are_short_of_an_annual_rate_alone():
    found = SimpleNamespace(
        hazard=af.Hazard.from_return_periods({475.0: 3.0, 2475.0: 8.0}), doubts=(), sentence=""
    )
    found.sentence = (
        "falls at 0.002 a year (0.001 to 0.003 at 90 %), 0.095 in 50 years (0.049 to 0.14); in "
        "half of the cases from 6 m/s² of PGA"
    )
    found.rate = lambda: Rate(0.002, 0.001, 0.003)
    found.fragility = lambda: SimpleNamespace(median=6.0)
    data = ReportData(ring(), {})
    vars(data)["statements"] = {"risk": answers.state_risk(found)}
    assert long_sentences(data) == []


def test_a_column_of_a_wall_is_not_said_to_be_unchecked_across_its_plane():
    """It is across the plane of the wall that `columns_across` has cut it from."""
    for above, said in ((None, True), (0.0, False)):
        column = {"shape": "column", "breadth": 0.5, "heights": [1.0, 1.0]}
        column |= {} if above is None else {"above": above}
        data = ReportData(af.Case.of({"structure": column}), {})
        vars(data)["statements"] = {"limit": answers.Statement([], [])}
        assert bool(margins.build_transverse(data)) is said
        head = head_of(conclusion.list_facts(data))
        assert ("it was not checked" in head.lower()) is said


def test_a_pier_beside_a_door_rocks_first_across_the_plane():
    """Two piers of 1 × 3 m with half of 1 × 1 m above a door rock from 0.25 / 1.643 g on."""
    door = af.shapes.Opening(left=-0.5, breadth=1.0, head=2.0, name="door")
    wall = af.shapes.wall(breadth=3.0, height=3.0, width=0.5, openings=[door])
    motion = af.Motion.synthetic(duration=3.0, pga=5.0, seed=1)
    found = find_falls_across(wall, {"a": motion})
    assert [*found] == ["strip", "whole", "pier"]
    arm = (3.0 * 1.5 + 0.5 * 2.5) / 3.5
    assert found["pier"][0].rocks == pytest.approx(0.25 / arm * 9.81 / motion.pga, rel=5e-3)
    assert "under 'a' the pier falls" in describe_falls_across(found, {"a": motion})


def test_titles_and_names_of_studies_hold_any_character(case, tmp_path, undrawn):
    """A stack 2 m high begins to move at half its breadth [g]; clauses end at other semicolons."""
    (tmp_path / "case.toml").write_text(
        format_tables({**case.settings, "limit": {"horizontal": 1}})
    )
    study, folder = tmp_path / "study.toml", tmp_path / "out"
    study.write_text(
        'title = "Measures: one; two; three, or more: all"\ncase = "case.toml"\n'
        'compute = "limit"\n[cases]\n"as: given" = {}\n'
        '"wide; thick" = { set = ["structure.breadth=0.7"] }\n'
    )
    command = ["study", str(study), "--out", str(folder), "--workers", "1"]
    assert af.commands.main(command) == 0
    data = data_of(af.Case.read(tmp_path / "case.toml"), a=verdict_of())
    vars(data)["study_folders"] = [folder]
    depends = dict(conclusion.list_facts(data))["depends on"].replace("\N{NO-BREAK SPACE}", " ")
    assert depends == (
        "One motion was run, and others of its size may do otherwise. "
        "In the study 'Measures: one; two; three, or more: all' none lowers the push of "
        "'as: given', 0.25 g. 'wide; thick' raises the push most, to 0.35 g. "
        + sentence(conclusion.DEFAULT_STIFFNESS)
    )


def test_a_case_that_fails_all_its_checks_is_worse_than_one_that_passes_by_displacements(case):
    """The linear check of the latter alone has the least ratio of all."""
    parts, numbers = {}, {"mixed": (0.386, 1.03), "failing": (0.516, 0.663)}
    for name, (linear, damage) in numbers.items():
        data = parts[name] = ReportData(case, {})
        checks = (
            answers.Ratios("linear", ["right"], linear, linear, linear=True),
            answers.Ratios("life safety", ["right"], damage, damage),
        )
        vars(data).update(statements={"assessment": state("assessment", *checks)})
        vars(data).update(transverse_push=np.nan)
    facts = dict(conclusion.list_joint_facts(parts))
    assert facts["verdict"].startswith("The worst of 2 cases is failing: ")
    assert facts["margin"].startswith("The least margins are of mixed 0.386 times ")
