"""Studies in reports: a row for each case, those that fall first, and what changes the answer."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

import archfem as af
from archfem.cases.report import sections, study_findings
from archfem.studies.evaluators import evaluate_limit
from archfem.view import draw_findings


def study(falls=(), cases=30, dislocated=(), failed=(), doubts=None, **attrs):
    """Return the findings of cases under two motions; some fall under the second.

    Others are dislocated under both, or fail under the second.
    """
    rows = [(f"case {k}", pair) for k in range(cases) for pair in ("first", "second")]
    sizes = [0.001 * (1 + k // 2) for k in range(2 * cases)]
    for k in falls:
        sizes[2 * k + 1] = 1.7
    states = ["fallen" if size == 1.7 else "stands" for size in sizes]
    errors = [""] * 2 * cases
    for k in dislocated:
        states[2 * k : 2 * k + 2] = ["dislocated"] * 2
    for k in failed:
        states[2 * k + 1], sizes[2 * k + 1], errors[2 * k + 1] = "", np.nan, "DidNotConverge"
    stated = [af.models.model.write_doubts((doubts or {}).get(k, ())) for k in range(2 * cases)]
    table = xr.Dataset(
        {
            "residual_displacement": ("point", sizes, {"units": "m"}),
            "fall": ("point", states),
            "error": ("point", errors),
            "doubts, stated": ("point", stated),
        },
        {
            "point": np.arange(2 * cases),
            "case": ("point", [case for case, _ in rows]),
            "pair": ("point", [pair for _, pair in rows]),
        },
        attrs=attrs,
    )
    return study_findings.collect_findings("Title", "", table)


def test_each_case_has_a_row_and_those_that_fall_are_the_first():
    grid = study_findings.tabulate_study(study(falls=[29]))
    assert grid.head == ["case", "residual displacement", "outcome"]
    assert len(grid.rows) == study_findings.MAX_CASES
    # the first motion, which does not fall, leaves it 30 mm
    assert grid.rows[0] == ["case 29", "30 mm", "fallen, in 1 of 2"]
    both = study(falls=[0], dislocated=[0], cases=2).table
    both["fall"][:2] = ["dislocated", "fallen"]
    rows = study_findings.tabulate_study(study_findings.collect_findings("", "", both)).rows
    assert rows[0] == ["case 0", "1 mm", "fallen, in 1 of 2; dislocated, in 1"]
    both["fall"][:2] = ["fallen", "fallen"]
    rows = study_findings.tabulate_study(study_findings.collect_findings("", "", both)).rows
    assert rows[0] == ["case 0", "-", "fallen, in 2 of 2"]
    assert grid.rows[1][:2] == ["case 0", "1 mm"]
    assert grid.caption.endswith(
        "its motions that do not fall; 6 of 30 cases are left out, of which 0 fall"
    )
    many = study_findings.tabulate_study(study(falls=range(27)))
    assert many.caption.endswith("6 of 30 cases are left out, of which 3 fall")
    assert "left out" not in study_findings.tabulate_study(study(cases=24)).caption


def test_a_case_without_an_outcome_has_no_number():
    found = study(failed=[1], cases=2)
    alone = study_findings.collect_findings("", "", found.table.isel(point=[0, 3]))
    grid = study_findings.tabulate_study(alone)
    assert [row[-2:] for row in grid.rows] == [["1 mm", "stands"], ["-", "no outcome"]]
    pushed = xr.Dataset({"push": ("x", [0.3, np.nan])}, {"x": [1.0, 2.0]})
    grid = study_findings.tabulate_study(study_findings.collect_findings("", "", pushed))
    assert grid.rows == [["1", "0.3"], ["2", "-"]]


def test_findings_are_drawn_in_words_and_mm_and_a_fall_has_none():
    found = study(falls=[1], cases=2)
    drawn = found.numbers["residual displacement"]
    assert drawn.attrs["units"] == "mm"
    np.testing.assert_allclose(drawn, [1.0, 1.0, 2.0, np.nan])
    # the line is that of the limit, in a panel of its own
    (axes,) = draw_findings(found.numbers, limits={"residual displacement": 40.0}).axes
    assert axes.get_xlabel() == "residual displacement [mm]"
    assert axes.lines[-1].get_xdata()[0] == 40.0
    swept = found.numbers.isel(point=[0, 2]).drop_vars(["pair", "case"])
    swept = swept.assign_coords(width=("point", [1.0, 2.0]))
    (axes,) = draw_findings(swept, limits={"residual displacement": 40.0}).axes
    assert axes.lines[-1].get_ydata()[0] == 40.0


def test_a_case_that_falls_is_a_hatched_bar_and_the_lines_differ():
    """The displacement of a fall is that to the ground: without a bar it would seem to be none."""
    found = study(falls=[1, 2], cases=4)
    one = found.numbers.isel(point=slice(1, None, 2))
    (axes,) = draw_findings(one, limits={"residual displacement": 40.0}).axes
    hatched = [bar for bar in axes.patches if bar.get_hatch()]
    assert [bar.get_y() + 0.5 * bar.get_height() for bar in hatched] == pytest.approx([1.0, 2.0])
    ends = [bar.get_window_extent().x1 for bar in hatched]
    assert ends == pytest.approx([axes.bbox.x1] * 2, abs=2.0)
    assert [line.get_linestyle() for line in axes.lines] == ["--", ":"]
    legend = [text.get_text() for text in axes.figure.legends[0].get_texts()]
    assert sorted(legend) == ["case 0, the first", "falls"]


def test_falls_under_some_motions_are_triangles_at_the_end_of_the_picture():
    """Case 1 falls under the second of two motions; of a sweep falls are at the top."""
    found = study(falls=[1], cases=3)
    (axes,) = draw_findings(found.numbers).axes
    marks = [x for x in axes.lines if x.get_marker() == ">" and len(x.get_xdata())]
    assert [(list(x.get_xdata()), list(x.get_ydata())) for x in marks] == [([1.0], [1])]
    assert marks[0].get_color() == axes.lines[1].get_color()  # of the second motion
    swept = found.numbers.drop_vars("case").assign_coords(width=("point", np.r_[1, 1, 2, 2, 3, 3]))
    axes = draw_findings(swept).axes[1]  # beside the one over the motions
    marks = [x for x in axes.lines if x.get_marker() == "^" and len(x.get_xdata())]
    assert [(list(x.get_xdata()), list(x.get_ydata())) for x in marks] == [([2], [1.0])]


def test_of_many_cases_those_with_doubts_stand_before_others():
    found = study(cases=30)
    found.worst["doubts"] = [*[0.0] * 29, 1.0]
    rows = study_findings.tabulate_study(found).rows
    assert [row[0] for row in rows[:3]] == ["case 29", "case 0", "case 1"]


def test_of_many_pushes_the_least_stand_before_those_with_doubts():
    push = np.r_[np.linspace(0.9, 0.3, 30), np.nan]
    names = {"least_push": ("x", push), "doubts": ("x", np.r_[3, [0] * 30])}
    errors = ("x", [""] * 30 + ["DidNotConverge"])
    names |= {"push": ("x", 2.0 * push)}
    table = xr.Dataset(names, {"x": range(31)})
    found = study_findings.collect_findings("t", "", table.assign(error=errors))
    grid = study_findings.tabulate_study(found)
    assert [row[0] for row in grid.rows] == [str(k) for k in range(29, 5, -1)]
    said = "7 of 31 cases are left out, with no less least push or no outcome"
    assert grid.caption.endswith(said)


def test_two_studies_of_the_same_cases_have_one_order():
    """Whichever of them fall or have doubts, as the tables of a report stand beside one another."""
    plain, other = study(cases=3), study(cases=3, falls=[2])
    other.worst["doubts"] = [0.0, 1.0, 0.0]
    for each in plain, other:
        names = [row[0] for row in study_findings.tabulate_study(each).rows]
        assert names == ["case 0", "case 1", "case 2"]


def test_a_study_of_ratings_has_a_column_for_all_of_the_passive_pressure():
    factors = {"factor": [2.5, 2.0], "without_pressure": [0.7, 0.5], "full_pressure": [5.9, 4.0]}
    columns = {name: ("case", values) for name, values in factors.items()}
    table = xr.Dataset(columns, {"case": ["as given", "thin"]})
    found = study_findings.collect_findings("ring", "", table)
    shown = study_findings.tabulate_study(found)
    assert shown.head == ["case", "factor", "without pressure", "full pressure"]
    assert shown.rows[1] == ["thin", "2", "0.5", "4"]


@pytest.mark.parametrize(("key", "own"), [("structure.thickness", True), ("model.dt", False)])
def test_a_study_of_lengths_says_that_the_limit_of_dislocation_is_that_of_the_case(ring, key, own):
    """A tenth of the joints' depth, of which the line in the picture is the one of the case."""
    found = study(cases=3, varied=key)
    data = SimpleNamespace(case=SimpleNamespace(structure=ring), runs={})
    *_, figure = sections._build_study(data, found)
    limit = f"{100.0 * np.median(ring.depths):.3g} mm"
    assert f"dotted the limit of dislocation of the case, {limit}" in figure.caption
    assert ("; cases of other lengths have others" in figure.caption) is own


@pytest.mark.parametrize(
    ("falls", "words"),
    [
        (
            (),
            "in the study under 'first' and 'second' none of 9 cases falls, and 'case 8' raises "
            "the residual displacement most, from 1 mm of 'case 0' to 9 mm",
        ),
        (
            [8],
            "in the study under 'first' and 'second' 1 of 9 cases falls: 'case 8', under 1 of 2 "
            "motions; of the others "
            "'case 7' raises the residual displacement most, from 1 mm of 'case 0' to 8 mm",
        ),
        (
            range(1, 9),
            "in the study under 'first' and 'second' 8 of 9 cases fall: 'case 1', under 1 of 2 "
            "motions; 'case 2', under 1 of 2 motions; 'case 3', under 1 of 2 motions; 'case 4', "
            "under 1 of 2 motions and 4 more",
        ),
    ],
)
def test_one_sentence_says_what_changes_the_answer(falls, words):
    assert [*study_findings.say_what_changes(study(falls, 9))] == [words]


def test_of_a_case_that_falls_the_study_says_with_which_others_it_stands():
    for cases, words in ((2, "'case 1'"), (3, "each of 'case 1', 'case 2'")):
        *_, said = study_findings.say_what_changes(study([0], cases))
        assert said == f"it stands with {words}"
    for states in ({"falls": [0], "dislocated": [1]}, {"falls": [1]}):  # none, and no fall
        assert "stands" not in str([*study_findings.say_what_changes(study(cases=2, **states))])


@pytest.mark.parametrize(
    ("states", "words"),
    [
        (
            {"dislocated": [8]},
            "none of 9 cases falls; 1 is dislocated: 'case 8', under 2 of 2 motions; of the others "
            "'case 7' raises the residual displacement most, from 1 mm of 'case 0' to 8 mm",
        ),
        (
            {"falls": [5], "dislocated": [0, 8], "failed": [7]},
            "1 of 9 cases falls: 'case 5', under 1 of 2 motions; 2 are dislocated: 'case 0', under "
            "2 of 2 motions; 'case 8', under 2 of 2 motions; 1 has no outcome: 'case 7', under 1 "
            # the first case, which is the given one, is not among these
            "of 2 motions; of the others the residual displacement is largest, 7 mm, at 'case 6'",
        ),
    ],
)
def test_cases_that_are_dislocated_or_have_no_outcome_fail_too(states, words):
    found = study(cases=9, **states)
    (said,) = study_findings.say_what_changes(found)
    assert said == f"in the study under 'first' and 'second' {words}"
    rows = {row[0]: row[-1] for row in study_findings.tabulate_study(found).rows}
    assert rows["case 8"] == "dislocated, in 2 of 2"


@pytest.mark.parametrize(
    ("states", "said"),
    [
        ({"falls": [0], "dislocated": [1]}, "falls or is dislocated at width = 1.5 m and below"),
        ({"dislocated": [3]}, "is dislocated at width = 2.5 m and above"),
        ({"falls": [0], "dislocated": [2]}, "falls or is dislocated at width = 1 m, width = 2 m"),
        ({}, ""),
    ],
)
def test_failures_of_a_swept_number_are_said_with_its_threshold(states, said):
    table = study(cases=4, **states).table
    widths = ("point", np.repeat([1.0, 1.5, 2.0, 2.5], 2), {"units": "m"})
    swept = study_findings.collect_findings("", "", table.drop_vars("case").assign_coords(w=widths))
    found = study_findings.collect_findings(
        "", "", table.drop_vars("case").assign_coords(width=widths)
    )
    assert swept.keys == ("w",)
    assert study_findings.say_failures(found) == said
    named = study_findings.say_failures(study(cases=4, **states))
    assert ("case" in named) == bool(said)
    only = study_findings.say_failures(found, damaged=True)
    assert ("dislocated" in only, bool(only)) == (False, "falls" in states)


def test_a_study_states_each_doubt_of_its_runs_once_and_their_cases():
    steps = [af.models.model.Doubt("steps of {:g} ms are long", "halve them", (x,)) for x in (5, 2)]
    drift = af.models.model.Doubt("the energy drifts")
    found = study(cases=3, doubts={1: steps[:1], 2: [drift], 4: steps[1:]})
    assert [*map(str, found.doubts)] == [
        "'case 0' under 'second', 'case 2' under 'first': steps of 2 to 5 ms are long; halve them",
        "'case 1' under 'first': the energy drifts",
    ]


@pytest.mark.parametrize(
    ("pairs", "under"),
    [(["m1"] * 6, " under 'm1'"), ([*"abcdef"], " under 6 motions"), (None, "")],
)
def test_a_study_names_its_motions(pairs, under):
    table = study(cases=3).table.drop_vars("pair")
    table = table if pairs is None else table.assign_coords(pair=("point", pairs))
    found = study_findings.collect_findings("Lengths", "", table)
    said = f"in the study{under} none of 3 cases falls, and 'case 2' raises"
    assert next(study_findings.say_what_changes(found)).startswith(said)
    assert study_findings.tabulate_study(found).caption.startswith(f"Study: Lengths{under}")


def test_a_row_has_the_largest_of_each_column_and_noise_is_no_finding():
    """The residual is largest under another motion than the displacement, which decides."""
    rows = [
        ("as is", 64.0, 11.8),
        ("as is", 80.0, 11.3),
        ("thin", 76.0, 11.4),
        ("thin", 87.0, 11.9),
    ]
    names, largest, residual = zip(*rows, strict=True)
    sizes = {"residual_displacement": residual, "largest_displacement": largest}
    table = xr.Dataset(
        {name: ("point", 1e-3 * np.array(x), {"units": "m"}) for name, x in sizes.items()}
        | {"fall": ("point", ["stands"] * 4)},
        {"case": ("point", [*names]), "pair": ("point", ["a", "b"] * 2)},
    )
    found = study_findings.collect_findings("", "", table)
    assert study_findings.tabulate_study(found).rows == [
        ["as is", "80 mm", "11.8 mm", "stands"],
        ["thin", "87 mm", "11.9 mm", "stands"],
    ]
    assert [*study_findings.say_what_changes(found)] == [
        "in the study under 'a' and 'b' none of 2 cases falls"
    ]
    table["largest_displacement"][3] = 0.109
    (text,) = study_findings.say_what_changes(study_findings.collect_findings("", "", table))
    said = ", and 'thin' raises the largest displacement most, from 80 mm of 'as is' to 109 mm"
    assert text.endswith(said)


def test_of_factors_the_least_is_the_worst():
    table = xr.Dataset({"factor": ("case", [0.6, 0.7, np.inf, 0.5])}, {"case": [*"abcd"]})
    (text,) = study_findings.say_what_changes(study_findings.collect_findings("", "", table))
    raised = "'b' raises the factor most, to 0.7"
    assert text == f"in the study 'd' lowers the factor most, from 0.6 of 'a' to 0.5; {raised}"
    higher = table.isel(case=[0, 1])
    (text,) = study_findings.say_what_changes(study_findings.collect_findings("", "", higher))
    assert text == f"in the study none lowers the factor of 'a', 0.6; {raised}"
    (text,) = study_findings.say_what_changes(study_findings.collect_findings("", "", 1.0 / higher))
    assert text == "in the study 'b' lowers the factor most, from 1.67 of 'a' to 1.43"
    near = table.assign(factor=0.6 * table["factor"] ** 0 + [0.0, 0.1, 0.0, -0.01])
    (text,) = study_findings.say_what_changes(study_findings.collect_findings("", "", near))
    assert text == f"in the study {raised}"
    pushed = table.assign(
        push=("case", [0.25, 0.3, 0.4, 0.2], {"units": "g"}),
        least_push_over_site=("case", [1.16, 1.4, 1.9, 0.926]),
    )
    found = study_findings.collect_findings("", "", pushed)
    assert [*study_findings.say_what_changes(found)] == [
        "in the study 'd' lowers the push most, from 0.25 g of 'a' to 0.2 g; 'c' raises the push "
        "most, to 0.4 g"
    ]
    assert [*study_findings.say_below_site(found)] == [
        "1 of 4 cases begins to move below the site's acceleration: 'd', at 0.926 of it",
    ]
    assert study_findings.tabulate_study(found).head == [
        "case",
        "push [g]",
        "over the site's acceleration",
    ]
    varied = xr.Dataset(
        {"factor": (("friction", "width"), [[0.6, 0.7], [0.5, 0.4]])},
        {"friction": [0.5, 0.4], "width": [1.0, 2.0]},
    )
    (text,) = study_findings.say_what_changes(study_findings.collect_findings("", "", varied))
    assert text == "in the study the factor is least, 0.4, at friction = 0.4, width = 2"


def test_what_changes_nothing_is_said_once():
    table = xr.Dataset({"push": ("case", [0.6, 0.7, 0.6])}, {"case": ["as is", "thick", "soft"]})
    found = study_findings.collect_findings("t", "", table)
    assert study_findings.tabulate_study(found).caption == "Study: t; 'soft' changed nothing"
    axes = {"friction": [0.5, 0.4], "young": [1.0, 2.0]}
    for values, said in (
        ([[0.6, 0.6], [0.5, 0.5]], "; young changed nothing"),
        ([[0.6, 0.7], [0.5, 0.5]], ""),
    ):
        varied = xr.Dataset({"push": ((*axes,), values)}, axes)
        found = study_findings.collect_findings("t", "", varied)
        assert study_findings.tabulate_study(found).caption == f"Study: t{said}"
    # samples differ in all of what is varied
    rows = {"friction": ("point", [0.5, 0.4]), "young": ("point", [1.0, 2.0])}
    sampled = xr.Dataset({"push": ("point", [0.6, 0.6])}, rows)
    assert study_findings.collect_findings("t", "", sampled).idle == []


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ([0.6, 0.4, 0.5], "at x = 2; neighbours differ by up to 50%: take smaller steps there"),
        ([0.5, 0.4, 0.45], "at x = 2; neighbours differ by up to 25%: take smaller steps there"),
        ([0.41, 0.4, 0.411], "at x = 2"),
        ([0.4, 0.6, 0.5], "at x = 1, where the sweep ends: less may lie beyond"),
        ([0.6, 0.5, 0.4], "at x = 4, where the sweep ends: less may lie beyond"),
    ],
)
def test_the_least_at_an_end_of_a_sweep_may_not_be_the_least(values, said):
    swept = xr.Dataset({"factor": ("x", values)}, {"x": [1.0, 2.0, 4.0]})
    found = study_findings.collect_findings("", "", swept)
    assert [*study_findings.say_what_changes(found)] == [
        f"in the study the factor is least, 0.4, {said}"
    ]
    # of two values each is an end, and samples have none
    (text,) = study_findings.say_what_changes(
        study_findings.collect_findings("", "", swept.isel(x=[0, 2]))
    )
    assert text.endswith(f"at x = {1 if values[0] < values[2] else 4}")
    drawn = study_findings.collect_findings("", "", swept.swap_dims(x="sample"))
    assert "beyond" not in next(study_findings.say_what_changes(drawn))
    wide = swept.expand_dims(y=[1.0, 2.0, 3.0]) + xr.DataArray(
        [0.0, -0.1, 0.0], {"y": [1, 2, 3]}, "y"
    )
    (text,) = study_findings.say_what_changes(study_findings.collect_findings("", "", wide))
    assert ("where the sweep of x ends" in text) == ("ends" in said)


def test_the_largest_displacement_at_an_end_of_a_sweep_may_not_be_the_largest():
    swept = xr.Dataset(
        {"largest_displacement": ("scale", [0.01, 0.02, 0.04], {"units": "m"})},
        {"scale": [1.0, 1.5, 2.0]},
    )
    (text,) = study_findings.say_what_changes(study_findings.collect_findings("", "", swept))
    assert text.endswith("at scale = 2, where the sweep ends: more may lie beyond")
    # seeds have no order
    seeds = swept.rename(scale="motion.synthetic.seed")
    (text,) = study_findings.say_what_changes(study_findings.collect_findings("", "", seeds))
    assert text.endswith("at motion.synthetic.seed = 2")


def test_a_swept_key_that_leaves_the_least_equal_is_no_end_and_no_place():
    """Bounds are open in the picture, and a note on all cases lists none of them."""
    frictions, depths = [0.4, 0.5, 0.6, 0.7], [0.3, 0.4, 0.5]
    keys = "contacts.stone_to_stone.friction", "structure.thickness"
    pushes = np.array([[0.12, 0.137, 0.14], *[[0.12, 0.15, 0.18]] * 3])
    pushes[3, 0] -= 1e-5
    names = np.where(pushes > 0.13, "least_push_over_site", "")
    columns = {"push": (keys, pushes, {"units": "g"}), "upper_bounds": (keys, names)}
    columns |= {"least_push_over_site": (keys, pushes / 0.4)}
    stated = af.models.model.write_doubts([af.models.model.Doubt("it may slide")])
    columns |= {"doubts, stated": (keys, np.full(pushes.shape, stated))}
    table = xr.Dataset(columns, dict(zip(keys, (frictions, depths), strict=True)))
    found = study_findings.collect_findings("", "", table)
    place = "thickness = 0.3 m, whatever the friction of stone to stone"
    assert [*study_findings.say_what_changes(found)] == [
        f"in the study the push is least, 0.12 g, at {place}, where the sweep of thickness ends: "
        "less may lie beyond"
    ]
    name = study_findings.OVER_SITE
    assert study_findings.find_least([found], name)[2] == place
    assert found.doubts[0].place == "12 cases"
    assert study_findings.list_studied(found) == {"lengths", "friction"}
    grid = study_findings.tabulate_study(found)
    assert grid.head == ["friction of stone to stone", "thickness [m]", "push [g]", name]
    assert grid.caption.endswith("below which the value may lie: such values show no trend")
    figure = draw_findings(found.numbers)
    drawn = [line for axes in figure.axes[2:] for line in axes.lines]
    hollow = np.concatenate([x.get_ydata() for x in drawn if x.get_mfc() == "white"])
    bounded = (pushes / 0.4)[names != ""]
    np.testing.assert_allclose(np.sort(hollow), np.sort([*bounded, *bounded]))
    assert not [
        line for axes in figure.axes[:2] for line in axes.lines if line.get_mfc() == "white"
    ]
    named = xr.Dataset({"push": ("case", [0.2, 0.3]), "upper_bounds": ("case", ["", "push"])})
    (axes,) = draw_findings(named.assign_coords(case=["a", "b"])).axes
    assert [bar.get_facecolor()[3] for bar in axes.patches] == [1.0, 0.0]
    # the least at one friction alone is at its end
    alone = table.assign(push=table["push"] - [[0.01], [0.0], [0.0], [0.0]])
    (text,) = study_findings.say_what_changes(study_findings.collect_findings("", "", alone))
    assert "at friction of stone to stone = 0.4, thickness = 0.3 m, where" in text


def test_words_and_states_of_the_users_own_function_are_no_findings():
    """It may give any names, and the command states findings of each study."""
    cases = {"case": [*"ab"]}
    words = xr.Dataset({"factor": ("case", ["low", "high"])}, cases)
    assert not [*study_findings.say_what_changes(study_findings.collect_findings("", "", words))]
    other = xr.Dataset({"factor": ("case", [0.6, 0.5]), "fall": ("case", ["leans", ""])}, cases)
    (text,) = study_findings.say_what_changes(study_findings.collect_findings("", "", other))
    assert text.endswith("'b' lowers the factor most, from 0.6 of 'a' to 0.5")


def push_columns(folder, cases):
    """Table of a study of named cases of a column of 0.5 × 2 m that is pushed."""
    (folder / "column.toml").write_text(
        '[structure]\nshape = "column"\nheights = [2.0]\nbreadth = 0.5\n[limit]\nhorizontal = 1.0\n'
    )
    (folder / "study.toml").write_text(f'case = "column.toml"\ncompute = "limit"\n{cases}')
    return af.Study.read(folder / "study.toml").run(workers=1)


def test_the_table_of_a_study_names_what_it_varies(tmp_path):
    """Also what named cases change; a value that all cases share is not varied."""
    table = push_columns(
        tmp_path,
        'set = ["structure.width=2"]\n[cases]\n"a" = {}\n'
        '"b" = { set = ["structure.breadth=1", \'contacts."stone to stone".friction=0.4\'] }\n',
    )
    assert table.attrs["varied"] == "contacts.stone to stone.friction; structure.breadth"
    found = study_findings.collect_findings("", "", table)
    assert study_findings.list_studied(found) == {"lengths", "friction"}


def test_a_case_of_several_changes_is_compared_with_the_one_that_differs_least(tmp_path):
    """The push of a column is its breadth over its height."""
    table = push_columns(
        tmp_path,
        '[cases]\n"a" = {}\n"b" = { set = ["structure.breadth=0.4"] }\n'
        '"c" = { set = ["structure.breadth=0.4", "structure.heights=[2.5]"] }\n',
    )
    found = study_findings.collect_findings("", "", table)
    assert [*study_findings.say_what_changes(found)] == [
        "in the study 'c' lowers the push most, from 0.25 g of 'a' to 0.16 g; 'b', which differs "
        "least from it, 0.2 g"
    ]
    # 'b' differs least from 'a', the first
    two = study_findings.collect_findings("", "", table.isel(case=[0, 1]))
    assert [*study_findings.say_what_changes(two)] == [
        "in the study 'b' lowers the push most, from 0.25 g of 'a' to 0.2 g"
    ]


def test_the_least_push_of_a_study_is_that_of_both_senses(tmp_path):
    """A stone on a slope of 1 in 10 slides at (μ + s) / (1 - μ s) uphill, and less downhill."""
    lean = 0.1
    base, top = [[0, -1], [1, -1], [1, lean], [0, 0]], [[0, 0], [1, lean], [1, 0.5], [0, 0.4]]
    outlines = {"ground": base, "stone": top}
    blocks = [{"name": x, "outline": y, "fixed": y is base} for x, y in outlines.items()]
    structure = {"shape": "blocks", "blocks": blocks}
    friction, push = 0.3, {"horizontal": 1.0}
    contact = {"stone to stone": {"friction": friction}}
    case = af.Case.of({"structure": structure, "contacts": contact, "limit": push})
    found = evaluate_limit(case)
    down, up = ((friction + s) / (1.0 - s * friction) for s in (-lean, lean))
    assert found["least_push"] == pytest.approx(down, rel=1e-9)
    assert found["push"] == pytest.approx(up, rel=1e-9)


@pytest.mark.slow
def test_a_push_over_the_acceleration_of_the_site_is_the_least_over_the_fill():
    wall = {"length": 1.0, "height": 0.5, "above": 0.5, "state": "fixed"}
    ring = {"span": 6.0, "rise": 1.5, "thickness": 0.4, "voussoirs": 15}
    bridge = {"shape": "bridge", "width": 3.0, "arches": {"arch": ring}}
    bridge |= {"sidewalls": {"left": wall, "right": wall}, "backfill": {"cover": 0.3}}
    limit = {"horizontal": 1.0, "demand": "0.6 g", "fill": {"friction_angle": 35.0}}
    found = evaluate_limit(af.Case.of({"structure": bridge, "limit": limit}))
    assert found["least_push"] < 0.6 < found["push"]  # what the favourable end hides
    assert found["least_push_over_site"] == pytest.approx(found["least_push"] / 0.6)
    assert "outcome" not in found  # that of any finite factor: it reads as if it fell
