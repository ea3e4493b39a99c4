"""Sentences of a report's conclusion: margins, doubts by weight, and what was not varied."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

import archfem as af
from archfem.cases import result_text
from archfem.cases.report import conclusion
from archfem.cases.report.report_data import ReportData
from archfem.dynamics import VerdictRange
from archfem.models.model import Doubt


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
    assert [text for _, text in conclusion.list_doubts(data)] == [
        "2 of 3 runs: rigid differs by 0.092 to 0.1 in |e|, of joint 4 by 8 to 12 mm",
        "1 of 3 runs: rigid differs by 0.053 in |e|, of joint 5 by 9 mm",
        "1 of 3 runs: it turns",
    ]
    alone = data_of(case, a=verdict_of(doubts=[one]))
    assert [text for _, text in conclusion.list_doubts(alone)] == [one.cause]


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
        "fall. A corner was displaced by 3 mm. 3 more stand with the result."
    )


@pytest.mark.parametrize(
    ("outcomes", "verified", "moves"),
    [
        (("stands", "dislocated"), "rocks", True),
        (("stands", "stands"), None, False),
        (("stands", "fallen"), "rocks", False),
    ],
)
def test_a_push_is_no_margin_of_what_moves_and_scales_say_where_it_is_dislocated(
    case, outcomes, verified, moves
):
    data = data_of(
        case,
        **{f"m{k}": verdict_of(each, verified=verified) for k, each in enumerate(outcomes)},
    )
    scaled = "dislocated from 1.41 ×, stands again at 0.888 g (3.43 × the motion), falls at 0.9 g"
    rows = [
        ("scale of the motion", "'first'", scaled, "3.43"),
        ("scale of the motion", "'second'", "stands at 0.9 g (4.00 × the motion)", "4.00"),
        ("limit analysis", "the site's 0.2 g", "mechanism", "1.04"),
    ]
    pushed, rank = "the least margin is 1.04, for a push by the site's 0.2 g to begin to move it", 1
    if moves:
        pushed, rank = (
            "a static push of 1.04 times the site's 0.2 g begins to move it; in the runs it begins "
            "to move, and falls in none",
            0,
        )
    assert [*conclusion._describe_margin(data, rows)] == [
        pushed,
        f"{('the least margin', 'the next')[rank]} is 3.43 on 'first': up to there it falls in no "
        "run, and is dislocated from 1.41 × under 'first' on; the least of 2 motions",
    ]
    rows[-1] = ("limit analysis", "the site's 0.2 g", "mechanism", "0.9")
    assert next(conclusion._describe_margin(data, rows)).startswith("the least margin is 0.9, for")


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
    texts = [text for result, text in conclusion.list_doubts(data) if result == "variations"]
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
        lead = conclusion.build_conclusion(data).pieces[0].text
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
    notes = result_text.note_band(case, [still, found])
    assert len(notes) == noted
    assert all(
        note.startswith("note: the motions of the suite are matched from 0.05 to 2 s, and T = 2.04")
        for note in notes
    )
    assert result_text.note_band(SimpleNamespace(suite=None), [found]) == []
