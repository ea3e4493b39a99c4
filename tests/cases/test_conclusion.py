"""Sentences of a report's conclusion: margins, doubts by weight, and what was not varied."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

import archfem as af
from archfem.cases import answers
from archfem.cases.report import conclusion, doubts, sections
from archfem.cases.report.report_data import ReportData
from archfem.dynamics import VerdictRange
from archfem.models.model import Doubt

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
            dataset=xr.Dataset({"ground": (("t", "x"), [[2.0, 0.0]])}, attrs={"motion": name}),
        )
        for name, verdict in verdicts.items()
    }
    data = ReportData(case, runs)
    vars(data)["verdict_ranges"] = () if found is None else (found,)
    vars(data)["dead"] = None
    return data


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
    one, two, three = (
        Doubt(f"rigid differs by {x} in |e|, of joint {k} by {size} mm", "take faces")
        for x, k, size in (("0.092", 4, 12), ("0.1", 4, 8), ("0.053", 5, 9))
    )
    every = {"a": [one], "b": [two], "c": [three, Doubt("it turns", "")]}
    data = data_of(case, **{name: verdict_of(doubts=each) for name, each in every.items()})
    assert [text for _, text in doubts.list_doubts(data)] == [
        "2 of 3 runs: rigid differs by 0.092 to 0.1 in |e|, of joint 4 by 8 to 12 mm",
        "1 of 3 runs: rigid differs by 0.053 in |e|, of joint 5 by 9 mm",
        "1 of 3 runs: it turns",
    ]
    alone = data_of(case, a=verdict_of(doubts=[one]))
    assert [text for _, text in doubts.list_doubts(alone)] == [one.cause]


def test_the_weightiest_doubts_of_a_result_are_not_folded_away(case):
    causes = ["steps are long", "it slips", "energy drifts", "a corner was displaced by 3 mm"]
    causes += ["joints let it fall", "blocks fall, and as rigid blocks none falls"]
    data = data_of(case, a=verdict_of(doubts=[Doubt(cause, "") for cause in causes]))
    (text,) = (
        each.text
        for each in conclusion.build_conclusion(data).pieces
        if getattr(each, "text", "").startswith("In doubt")
    )
    assert text == (
        "In doubt, time histories: Blocks fall, and as rigid blocks none falls. Joints let it "
        "fall. A corner was displaced by 3 mm. 3 more: see section 'Response'."
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
    bounded, elastic = "1.04 (proved ≥ 0.9)", "1.02"
    rows = [
        ("limit analysis", "the site's 0.2 g", "mechanism", bounded),
        ("pushover", "the site's 0.2 g", "factor 0.204", elastic),
    ]
    bodies = {f"at most {bounded}": "as rigid blocks", elastic: "with elastic joints"}
    if moves:
        expected = [
            f"a push of {size} times the site's 0.2 g {body} is no margin: {moves}"
            for size, body in bodies.items()
        ]
    else:
        expected = [
            f"a push of {size} times the site's 0.2 g begins to move it {body}, "
            "which is no collapse"
            for size, body in bodies.items()
        ]
    assert [*conclusion._describe_margin(data, rows)] == expected
    rows[:] = [("limit analysis", "the site's 0.2 g", "mechanism", "0.9")]
    least = "a push of 0.9 times the site's 0.2 g begins to move it, which is no collapse"
    assert [*conclusion._describe_margin(data, rows)] == [least, *filter(None, [moves])]
    unshaken = [*conclusion._describe_margin(data_of(case), rows)]
    assert unshaken == [least, "shaken it may begin to move at less"]


@pytest.mark.parametrize(("factor", "counts"), [("1.03", True), ("1.01", False)])
def test_a_run_stronger_than_a_push_says_nothing_of_it(case, factor, counts):
    """The run has 2 m/s², 1.02 times the 0.2 g of the site."""
    data = data_of(case, a=verdict_of(verified="rocks"))
    vars(data)["case"] = af.Case.of({**case.settings, "assessment": SPECTRUM})
    rows = [("limit analysis", "the site's 0.2 g", "mechanism", factor)]
    (text,) = conclusion._describe_margin(data, rows)
    assert ("is no margin" in text) == counts


@pytest.mark.parametrize("verified", ["rocks", None])
def test_a_check_of_what_begins_to_move_is_one_of_displacements_where_it_moves(case, verified):
    data = data_of(case, a=verdict_of(verified=verified))
    vars(data)["case"] = af.Case.of({**case.settings, "assessment": SPECTRUM})
    row = ("assessment: code, right", "1 m/s²", "2 m/s², passes", "1.1 (0.842 by displacements)")
    expected = [
        "the least margin is 1.1 (0.842 by displacements), on the EC8 spectrum of PGA 0.2 g, by "
        "code, right",
        "1.1 times the spectrum begins to move it",
        "if it moved, it could be displaced by 0.842 times the demand",
    ]
    if verified:
        expected = [
            "the least margin is 0.842 by displacements, on the EC8 spectrum of PGA 0.2 g, by "
            "code, right",
            "the check passes for what is at rest, and in the runs it moves, and falls in none",
        ]
    assert [*conclusion._describe_margin(data, [row])] == expected


def test_the_margin_of_scales_ends_where_it_is_dislocated(case):
    rocks = "stands at 0.3 g (1.38 × the motion), a mechanism from 0.85 × or less"
    rows = [
        ("scale of the motion", f"'{name}', PGA 0.2 g", outcome, factor)
        for name, outcome, factor in (
            ("a", f"{rocks}, dislocated from 1.41 ×, falls at 0.9 g (4.5 × the motion)", "1.38"),
            ("b", "stands at 2.00 × the motion, falls at 0.5 g (2.10 × the motion)", "2.00"),
            ("c", "falls at 0.2 g (1.00 × the motion); no smaller scale is known", "-"),
        )
    ]
    data = data_of(case)
    vars(data)["pairs"] = ("a", "b", "c", "d")
    assert [*conclusion._describe_margin(data, rows)] == [
        "the least margin is 1.38 on 'a', PGA 0.2 g, of 2 motions",
        "it moves as a mechanism from 0.85 × or less on, is dislocated from 1.41 × on and falls "
        "from 4.5 × on",
        "it falls first under 'b', from 2.10 × on",
        "no scale is known up to which it stands under 'c'",
        "'d' was not scaled",
    ]
    small = (
        "no mechanism at 0.1 g (0.5 × the motion), first mechanism at 0.11 g (0.55 × the motion)"
    )
    rows = [("scale of the motion", "'a', PGA 0.2 g", small, "0.5")]
    assert [*conclusion._describe_margin(data, rows)][:2] == [
        "the least margin is 0.5 on 'a', PGA 0.2 g, which it fails",
        "it forms a mechanism from 0.55 × on",
    ]
    other = "stands at 0.3 g (1.5 × the motion), falls at no scale that was tried"
    rows = [("scale of the motion", "'a', PGA 0.2 g", other, "1.5")]
    assert [*conclusion._describe_margin(data, rows)][1] == "it falls in no run"
    begun = (
        "stands at 0.3 g (0.7 × the motion), search unfinished, a mechanism from 0.5 ×, falls at"
    )
    for end, fails in (("1.3", ""), ("0.9", ", which it fails")):
        rows = [
            (
                "scale of the motion",
                "'a', PGA 0.2 g",
                f"{begun}, falls at {end} × the motion",
                "0.7",
            )
        ]
        assert next(conclusion._describe_margin(data, rows)) == (
            f"the least margin is 0.7 (search unfinished) on 'a', PGA 0.2 g{fails}"
        )


def test_the_answer_has_displacements_the_first_fall_and_the_checks(case):
    """First falls are of all motions and time steps, on page 1 in one range; bounds decide none."""
    falls = {
        "a": "a mechanism from 0.5 × or less, falls at 0.34 g (1.30 × the motion)",
        "b": "falls at 0.4 g (1.41 × the motion), the other time step first falls at 1.51 ×",
    }
    result, holds = "scale of the motion", "stands at 0.3 g (1.1 × the motion)"
    rows = [(result, f"'{name}', PGA 0.2 g", f"{holds}, {x}", "1.1") for name, x in falls.items()]
    steps = "its time steps find the first fall from"
    rigid = "blocks fall, and as rigid blocks none falls"
    loose = f"at 1.30 × by 2 ms (likewise at 1.38 × by 1 ms): {rigid}"
    scaled = [f"under 'a': {steps} 1.30 to 1.38 ×: between 1.27 and 1.30 × by 5 ms"]
    scaled += [f"under 'b': {steps} 1.41 to 1.51 ×: between 1.38 and 1.41 × by 5 ms"]
    scaled += [f"under '{name}': {loose}" for name in "ab"]
    check = (
        "assessment: damage, right and left",
        "0.09 m",
        "0.06 m, fails",
        "0.592 (0.488 bodies)",
    )
    data = data_of(case, a=verdict_of(displacement=0.06), b=verdict_of(displacement=0.08))
    bound = "the curve is an upper bound"
    vars(data)["statements"] = {
        "assessment": answers.Statement([], [check], [bound]),
        "scale": answers.Statement([], rows, scaled),
    }
    answer = (
        "moves by 60 to 80 mm, first falls at 1.30 × the motion (1.30 to 1.51 over motions and "
        "time steps); the displacement check of damage is not met (0.488 to 0.592 × the spectrum)"
    )
    facts = dict(conclusion.list_facts(data))
    assert facts["verdict"] == f"stands under 2 of 2 motions, {answer}"
    assert facts["in doubt"] == "scale of the motion"
    pieces = conclusion.build_conclusion(data).pieces
    assert pieces[0].text == f"The structure stands under all 2 motions of PGA 0.20 g, {answer}."
    texts = [getattr(piece, "text", "") for piece in pieces]
    assert f"In doubt, kinematic assessment: T{bound[1:]}." in texts
    assert (
        "In doubt, scale of the motion: Under 'a' and 'b': blocks fall, and as rigid blocks none "
        "falls. Under 'a' and 'b' it first falls between 1.30 and 1.51 × over its time steps."
    ) in texts
    assert any("The doubts below, on scale of the motion, may change this." in x for x in texts)
    for at, said in ("1.20", True), ("1.35", False):
        parted = rows[0][2].replace(", falls", f", dislocated from {at} ×, falls")
        changed = [(*rows[0][:2], parted, "1.1"), rows[1]]
        data.statements["scale"] = answers.Statement([], changed, scaled)
        words = f", is first dislocated at {at} × the motion; "
        assert (words in dict(conclusion.list_facts(data))["verdict"]) == said
    data.statements["scale"] = answers.Statement([], rows, scaled)
    rows[0] = (*rows[0][:2], f"search unfinished, {rows[0][2]}", "1.1")
    facts = dict(conclusion.list_facts(data))
    assert "over motions and time steps, search unfinished); " in facts["verdict"]
    passed = (
        "assessment: damage, right",
        "0.09 m",
        "0.1 m, passes",
        "1.1 (0.842 by displacements)",
    )
    data.statements["assessment"] = answers.Statement([], [passed], [bound])
    facts = dict(conclusion.list_facts(data))
    rested = "the displacement check of damage, right is met at rest (0.842 by displacements)"
    assert facts["verdict"].endswith(rested)
    vars(data)["case"] = af.Case.of({**case.settings, "assessment": SPECTRUM})
    data.runs["a"].verdict.mechanisms["verified"] = "rocks"
    moves = rested.replace("at rest", "at rest alone, and it moves")
    assert dict(conclusion.list_facts(data))["verdict"].endswith(moves)
    assert facts["in doubt"] == "kinematic assessment, scale of the motion"


def test_of_unequal_outcomes_the_worst_is_the_first(case):
    every = {"a": verdict_of(), "b": verdict_of("dislocated", 0.2), "c": verdict_of("fallen")}
    data = data_of(case, range_of(0.1, 0.1), **every)
    text = (
        "falls under 1, is dislocated but stands under 1, stands under 1 of 3 motions, "
        "moves by 100 to 200"
    )
    assert dict(conclusion.list_facts(data))["verdict"] == f"{text} mm"
    data.verdict_ranges[0].dataset["outcome"] = "run", np.array(["stands", "dislocated"])
    varied = "falls in none of 2 variations and is dislocated in 1"
    assert dict(conclusion.list_facts(data))["verdict"] == f"{text} mm; {varied}"
    text = conclusion.build_conclusion(data).pieces[0].text
    assert text.startswith("The structure falls under 1 of 3 motions of PGA 0.20 g: c; it is disl")
    assert "0.20 g: a; it moves by 100 to 200 mm. Under 'first' it falls in none of 2 var" in text


def test_doubts_of_several_motions_are_one(case):
    """With ranges of a few numbers, else in the numbers of the first; others stay as they are."""
    given = [
        ("scale", f"under '{name}': at {scale} × by 2 ms: joints let it fall")
        for name, scale in (("a", "1.48"), ("b", "2.18"))
    ]
    given += [
        ("scale", f"under '{name}': it falls between {low} and {low}1 ×, by 1 ms from {low}2 ×")
        for name, low in (("a", "1.4"), ("b", "2.4"), ("c", "1.7"))
    ]
    given += [("risk", "it errs by 1.5 %"), ("risk", "it errs by 2.5 %")]
    assert [*doubts._merge_motions(given)] == [
        ("scale", "under 'a' and 'b': at 1.48 to 2.18 × by 2 ms: joints let it fall"),
        (
            "scale",
            "under 'a': it falls between 1.4 and 1.41 ×, by 1 ms from 1.42 ×; likewise under 'b' "
            "and 'c'",
        ),
        *given[-2:],
    ]


def test_a_displacement_has_the_range_of_its_time_steps_and_single_changes_are_said(case):
    """Those of one motion; equal words on several motions are one sentence."""
    ranges = [range_of(0.02, 0.12, 0.05, motion=name) for name in "ab"]
    for found in ranges:
        found.dataset["sampled"][:2] = False
        found.dataset["dt"][1] = "half"
    data = data_of(case, ranges[0], a=verdict_of(displacement=0.1), b=verdict_of())
    (row, *_) = (row for _, row in conclusion._capacity_rows(data))
    assert row[2] == (
        "stands in 2 of 2 runs; displaced by up to 100 mm (over time steps 20 mm to 120 mm under "
        "'a'), 0 mm at the end"
    )
    same = "it falls with none of 1 single changes"
    moved = "unvaried it is displaced by 20 mm, by 120 mm with half the time step"
    assert [*conclusion._say_causes(ranges)] == [
        f"under 'a' and 'b': {same}",
        f"under 'a' and 'b': {moved}",
    ]
    assert [*conclusion._say_causes(ranges[:1])] == [same, moved]
    assert [*conclusion._describe_ranges(ranges)][:2] == [
        f"under '{motion}' it falls in none of 3 variations" for motion in "ab"
    ]


def test_single_changes_are_drawn_and_tabulated_the_worst_first(case):
    """The bar of a fall would hide the others; where all are alike there is no picture."""
    found = range_of(0.02, 0.12, 9.0)
    found.dataset["sampled"][:] = False
    found.dataset["dt"][1] = "half"
    found.dataset["sign"] = "run", np.array(["as given", "as given", "reversed"])
    found.dataset.attrs["properties"] = ["dt", "sign"]
    found.dataset["outcome"] = "run", np.array(["stands", "stands", "fallen"])
    figure, table = sections._build_single_changes(data_of(case), found, "a")
    assert [row[:3] for row in table.rows] == [
        ("motion reversed", "fallen", "-"),
        ("half the time step", "stands", "120 mm"),
        ("unvaried", "stands", "20 mm"),
    ]
    assert table.caption == "Single changes under 'a', the worst first"
    (axes,) = figure.figure.axes
    assert [bar.get_width() for bar in axes.patches] == pytest.approx(
        [20.0, np.nan, 120.0], nan_ok=True
    )
    found.dataset["outcome"] = "run", np.array(["stands", "stands", "dislocated"])
    found.dataset["residual"] = "run", np.array([0.01, 0.03, 0.06])
    figure, table = sections._build_single_changes(data_of(case), found, "a")
    (axes,) = figure.figure.axes
    assert [bar.get_width() for bar in axes.patches] == pytest.approx([10.0, 60.0, 30.0])
    limits = [x.get_xdata()[0] for x in axes.get_lines() if x.get_linestyle() == "-"]
    assert limits == pytest.approx([50.0])  # a tenth of the column's breadth
    assert figure.caption.endswith("'a'; beyond the line, 50 mm, it counts as dislocated.")
    assert "by the residual displacement, the worst first" in table.caption
    found.dataset["outcome"][2] = "fallen"
    found.dataset["displacement"][:] = 0.02
    assert [each.kind for each in sections._build_single_changes(data_of(case), found, "")] == [
        "grid"
    ]
    assert sections._build_single_changes(data_of(case), range_of(0.1, sampled=True), "") == []


@pytest.mark.parametrize(
    ("found", "says"),
    [
        (range_of(0.0418, 0.2), "displaced by up to 109 mm, the unvaried one"),
        (range_of(0.3, 0.2), "another fidelity, displaced by up to 300 mm"),
        (range_of(0.109, 0.2, outcome="fallen"), "another fidelity, fallen"),
        (range_of(0.09, 0.2), ""),
        (range_of(0.0418, 0.2, motion="second"), ""),
        (range_of(0.0418, 0.2, motion=""), ""),
        (range_of(0.0418, 0.2, sampled=True), ""),
        (range_of(np.nan, 0.2, outcome="unknown", error="broken"), ""),
    ],
)
def test_a_run_and_its_unvaried_variation_may_differ_by_half(case, found, says):
    data = data_of(case, found, first=verdict_of(displacement=0.109))
    texts = [text for result, text in doubts.list_doubts(data) if result == "variations"]
    assert len(texts) == (says != "")
    assert says in "".join(texts)


def test_what_was_not_varied_names_displacements(case):
    """Of one motion of several, those under the others; without variations, all."""
    none, range_ = ", and displacements have no range", range_of(0.1, 0.1, motion="a")
    for found, names, first, last in (
        (None, "a", "Motion, lengths, stiffness,", f" not varied{none}."),
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


def test_the_head_of_a_push_says_when_it_begins_to_move(case):
    row = ("limit analysis", "the site's 0.2 g", "four-hinge mechanism, at 0.1 g", "0.5")
    data = data_of(case)
    vars(data)["statements"] = {"limit": answers.Statement(["limit analysis"], [row])}
    begins = "a push begins to move it at 0.5 times the site's 0.2 g"
    assert dict(conclusion.list_facts(data))["verdict"] == begins
