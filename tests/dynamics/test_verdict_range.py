"""Statistics of a range of verdicts against closed forms and made-up runs."""

import json
from itertools import pairwise
from math import comb

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_rgb
from scipy.stats import beta, rankdata

import archfem as af
from archfem.dynamics import VerdictRange


def made_up(falls, sampled=None, error=None, residual=None, parted=None, **columns):
    """Runs that fall or stand, with the properties of the columns."""
    falls = np.asarray(falls)
    count = len(falls)
    data = {name: ("run", np.asarray(values)) for name, values in columns.items()}
    data["outcome"] = "run", np.where(falls, "fallen", "stands").astype("U12")
    if parted is not None:
        data["outcome"][1][parted] = "dislocated"
    residual = np.zeros(count) if residual is None else residual
    data["displacement"] = data["residual"] = "run", np.asarray(residual, float)
    data["time"] = "run", np.where(falls, 1.0, np.nan)
    data["error"] = "run", np.array([""] * count if error is None else error)
    data["sampled"] = "run", np.ones(count, bool) if sampled is None else np.asarray(sampled)
    attrs = {"properties": list(columns), "k_n": 2e9, "k_s": 1e9}
    return VerdictRange(xr.Dataset(data, attrs=attrs))


@pytest.mark.parametrize(("falls", "count"), [(0, 26), (3, 26), (26, 26), (1, 2)])
@pytest.mark.parametrize("confidence", [0.5, 0.95])
def test_the_interval_is_that_of_clopper_and_pearson(falls, count, confidence):
    found = made_up(np.arange(count) < falls, k_n=np.linspace(0.5, 2.0, count))
    assert found.share == falls / count
    tail = 0.5 * (1.0 - confidence)
    low = beta.ppf(tail, falls, count - falls + 1) if falls else 0.0
    high = beta.ppf(1.0 - tail, falls + 1, count - falls) if falls < count else 1.0
    assert found.interval(confidence) == pytest.approx((low, high), abs=1e-9)


def test_runs_beside_the_sample_count_for_the_sentence_alone():
    found = made_up([True, False, False, True], [False, False, True, True], sign=list("aabb"))
    assert found.share == 0.5
    assert found.sentence.startswith("falls in 2 of 4 variations: ")
    shares = "; 1 of the 2 that vary one property or none, 1 of the 2 that vary all "
    shares += "(1% to 99% at 95%)"
    assert shares in found.sentence


def test_no_share_is_given_where_no_run_falls_or_every_one_does():
    columns = {"residual": [0.0, 1.0, 2.0, 3.0], "sign": list("aabb")}
    none, all_fall = (made_up([falls] * 4, **columns) for falls in (False, True))
    five = made_up(np.arange(12) < 5, sign=list("aaaaaabbbbbb"), dt=list("gh" * 6))
    assert none.table().split() == [
        "property",
        "falls",
        "sign",
        *("a:", "0", "of", "2,", "b:", "0", "of", "2"),
    ]
    assert "%" not in all_fall.table()
    assert five.table().startswith("property  explains, of the variance of the outcome")
    # between groups 12 · (5/12)², of all 5 · 7/12; of the other 1/35
    assert [*five.importance().values()] == pytest.approx([5.0 / 7.0, 1.0 / 35.0])
    shares = [line.split("  ")[-2].strip() for line in five.table().splitlines()[1:]]
    assert shares == ["71%", "no more than chance"]
    for found, shown in ((none, False), (all_fall, False), (five, True)):
        figure = found.plot()
        axes, places = figure.axes, ("left", "center", "right")
        titles = ["".join(each.get_title(loc=place) for place in places) for each in axes]
        assert ["explains 71%" in title for title in titles] == [shown, False][: len(titles)]
        assert "explains 3%" not in "".join(titles)
        said = " ".join(figure.get_suptitle().split())
        assert ("shares are of the variance of the outcome" in said) == shown


def test_shares_agree_with_the_sentence():
    """All falls have one damping; friction explains how far the others move, and no fall."""
    rows = np.arange(240)
    damping, friction = np.where(rows % 2, "stiffness", "none"), np.linspace(-0.1, 0.1, 240)
    falls = (rows % 2 == 1) & (rows % 8 == 1)
    residual = np.where(falls, 9.0, 1.0 + friction)
    found = made_up(falls, residual=residual, damping_kind=damping, friction=friction)
    assert "all falls are with damping kind 'stiffness', where 30 of 120 fall" in found.sentence
    shares = found.importance()
    assert shares["damping_kind"] == pytest.approx(1.0 / 7.0)  # (1/8)² over 1/8 · 7/8
    assert shares["friction"] < 0.01
    stand = made_up(np.zeros(240, bool), residual=residual, damping_kind=damping, friction=friction)
    assert stand.importance()["friction"] > 0.5


def test_doubts_follow_the_sentence_and_are_kept(tmp_path):
    found = made_up([True, False], sign=list("ab"))
    assert found.doubts == ()
    found.dataset.attrs["doubts"] = json.dumps([("fill is rigid", "cut it")])
    kept = VerdictRange.read(found.save(tmp_path / "range.nc"))
    assert str(kept).splitlines()[1].endswith("fill is rigid; cut it")


def test_runs_in_doubt_under_dead_load_are_counted_marked_and_drawn():
    """Beyond a millimetre; one that is not answered counts for nothing."""
    columns = {"k_s": [1.0, 0.1, 0.2, 0.5, 0.3, 2.0], "error": [""] * 5 + ["broken"]}
    sampled = [False, False, True, True, True, True]
    found = made_up([False, True, False, False, True, False], sampled, parted=[2, 3], **columns)
    assert found.doubts == ()
    found.dataset["slip_at_rest"] = "run", 1e-3 * np.array([0.3, 4.0, 1.01, 0.99, 1.5, 3.0])
    assert found.in_doubt.tolist() == [False, True, True, False, True, True]
    counted = "falls in 2 of 5 variations and is dislocated in 2 (3 of these 4 in doubt under"
    assert found.headline.startswith(f"{counted} dead load)")
    (doubt,) = found.doubts
    assert doubt.cause == (
        "shear displaces joints by up to 4 mm under dead load in 3 of 5 variations, which do not "
        "stand as drawn: of them 2 fall and 1 are dislocated, of the others 0 and 1"
    )
    # the largest of 4 × 0.1, 1.01 × 0.2 and 1.5 × 0.3 is displaced by 1 mm, with 5 % added
    assert "verdict.vary.k_s=[0.47,2]" in doubt.remedy
    assert str(found).splitlines()[1].endswith(str(doubt))
    assert found.groups.endswith("; shares count 3 runs in doubt under dead load")
    assert found.share == pytest.approx(1.0 / 3.0)  # of three that are sampled and answered
    marked = "shear stiffness / 10 (in doubt under dead load)"
    assert [each.name for each in found.single_changes] == [marked, "unvaried"]
    drawn = {line.get_label(): line for line in found.plot().axes[0].get_lines()}
    assert drawn["in doubt under dead load"].get_xdata().tolist() == [0.1, 0.2, 0.3]
    # all are where the case is
    found.dataset["slip_at_rest"] += 1e-3
    assert [each.name for each in found.single_changes] == ["shear stiffness / 10", "unvaried"]


def test_dislocated_runs_are_counted_and_drawn_apart():
    names = {"sign": list("aabbb"), "error": ["", "", "", "", "broken"]}
    found = made_up([True, False, False, False, False], parted=[1, 4], **names)
    assert found.count == "falls in 1 of 4 variations and is dislocated in 1"
    assert found.sentence.startswith(found.count)
    assert found.dislocated.tolist() == [False, True, False, False, True]
    (axes, *_) = found.plot().axes
    drawn = {line.get_label(): line for line in axes.get_lines() if line.get_marker() != "None"}
    sizes = [len(line.get_xdata()) for line in drawn.values()]
    assert dict(zip(drawn, sizes, strict=True)) == {
        "stands": 2,
        "dislocated": 1,
        "falls, above the dashed line": 1,
    }
    # apart in grey, and by their marks
    greys = [np.dot(to_rgb(line.get_color()), (0.299, 0.587, 0.114)) for line in drawn.values()]
    assert np.diff(np.sort(greys)).min() > 0.1
    assert len({line.get_marker() for line in drawn.values()}) == 3
    upright = made_up([False] * 2, sign=list("ab"))
    assert "dislocated" not in upright.sentence
    # neither the line nor the words of falls where none is
    assert [x.get_label() for x in upright.plot().axes[0].get_lines()] == ["stands"]


def test_dislocations_are_explained_where_none_falls():
    """All have one damping; the single changes are the worst first by what remains."""
    rows = np.arange(48)
    damping, parted = np.where(rows % 2, "mass", "stiffness"), (rows % 4 == 3) & (rows >= 4)
    values = {"damping_kind": damping, "friction": np.linspace(-0.1, 0.1, 48)}
    values["friction"][:2] = 0.0
    found = made_up([False] * 48, rows >= 2, parted=parted, **values)
    for name, ends in ("displacement", [0.09, 0.05]), ("residual", [0.01, 0.04]):
        found.dataset[name] = "run", np.append(ends, np.zeros(46))
    where = "all dislocations are with damping kind 'mass', where 11 of 24 are dislocated"
    groups = "0 of the 2 that vary one property or none, 11 of the 46 that vary all"
    counted = f"falls in none of 48 variations and is dislocated in 11: {where}; {groups}; share of"
    assert found.sentence.startswith(f"{counted} falls 0% to ")
    assert found.table().splitlines()[0].split()[-1] == "dislocated"
    assert "mass: 11 of 23, stiffness: 0 of 23" in found.table()
    assert next(iter(found.importance())) == "damping_kind"
    assert [each.name for each in found.single_changes] == ["damping kind 'mass'", "unvaried"]
    assert found.what_changes == [
        "it is dislocated or falls with none of 1 single changes",
        "unvaried it remains displaced by 10 mm, by 40 mm with damping kind 'mass'",
    ]
    found.dataset["outcome"][5] = "fallen"
    assert [each.name for each in found.single_changes] == ["unvaried", "damping kind 'mass'"]
    # one fall is too few, and both kinds have that damping
    both = VerdictRange(found.dataset)
    assert "damping kind 'mass', where 12 of 24 fall or are dislocated" in both.sentence


def test_displacements_of_the_runs_that_hold_are_a_range():
    """Of a hundred from 1 to 100 mm; that of a fall, and of a run without an answer, is none."""
    sizes = np.append(np.linspace(0.001, 0.1, 100), [5.0, 9.0])
    error, falls = [""] * 101 + ["broken"], np.arange(102) == 100
    found = made_up(falls, residual=sizes, error=error, sign=["a"] * 102)
    usual = "largest displacements 1 mm to 100 mm, in 95 % of 100 runs 95 mm or less"
    assert found.displacements == usual
    sizes[:7] = 1e-6
    rules = ["rigid"] * 6 + ["exact"] * 96
    found = made_up(falls, residual=sizes, error=error, joint_rule=rules)
    assert found.displacements.endswith("in 95 % of 100 runs 95 mm or less")
    # rigid ones alone hardly move: the range is that of the 93 others, from 8 to 100 mm
    sizes[0] = 1e-5
    rules[6] = "rigid"
    found = made_up(falls, residual=sizes, error=error, joint_rule=rules)
    assert found.displacements == (
        "largest displacements 8 mm to 100 mm, in 95 % of 93 runs 96 mm or less; with "
        "rigid joints 0.001 mm to 0.01 mm"
    )
    # one of them moves by 1.1 % of the largest, and counts among the rigid ones all the same
    sizes[6] = 0.0011
    found = made_up(falls, residual=sizes, error=error, joint_rule=rules)
    assert found.displacements == (
        "largest displacements 8 mm to 100 mm, in 95 % of 93 runs 96 mm or less; with "
        "rigid joints 0.001 mm to 1.1 mm"
    )
    # without others there are no two groups
    found = made_up(falls, residual=sizes, error=error, joint_rule=["rigid"] * 102)
    assert found.displacements == (
        "largest displacements 0.001 mm to 100 mm, in 95 % of 100 runs 95 mm or less"
    )
    assert found.sentence.endswith("; 1 of 102 have no answer, the first: broken")
    assert made_up([True], sign=["a"]).displacements == ""


@pytest.mark.parametrize(
    ("falls", "parted", "clauses"),
    [
        (
            [],
            [],
            [
                "it falls with none of 4 single changes",
                "unvaried it is displaced by 10 mm, by 90 mm with normal stiffness / 3, by 30 mm "
                "with half the time step",
            ],
        ),
        (
            [1],
            [4],
            [
                "it falls with 1 of 4 single changes: normal stiffness / 3",
                "it is dislocated with 1: half the time step",
                "unvaried it is displaced by 10 mm, by 30 mm with half the time step",
            ],
        ),
        (
            [0, 1, 2, 4],
            [],
            ["unvaried it falls, and with 1 of 4 single changes it does not: damping × 2"],
        ),
        (
            [0, 1, 2, 3, 4],
            [],
            ["unvaried it falls, and so with all of 4 single changes"],
        ),
    ],
)
def test_single_changes_say_what_would_change_the_answer(falls, parted, clauses):
    """The last run varies all properties, and counts as none of them."""
    properties = {
        "k_n": [1.0, 1.0 / 3.0, 1.0, 1.0, 1.0, 0.5],
        "friction": [0.0, 0.0, -0.1, 0.0, 0.0, 0.1],
        "damping_ratio": [1.0, 1.0, 1.0, 2.0, 1.0, 0.5],
        "dt": ["as given"] * 4 + ["half"] * 2,
    }
    sizes, sampled = [0.01, 0.09, 0.011, 0.002, 0.03, 5.0], np.arange(6) == 5
    found = made_up(
        np.isin(np.arange(6), falls), sampled, residual=sizes, parted=parted, **properties
    )
    assert found.what_changes == clauses
    assert "; ".join(clauses) in str(found).splitlines()
    names = [each.name for each in found.single_changes]
    if not falls:
        assert names == [
            *("normal stiffness / 3", "half the time step", "friction - 0.1", "unvaried"),
            "damping × 2",
        ]


@pytest.mark.parametrize(
    ("half", "ratio", "said"),
    [
        (1.02, 1.5, "by 14 mm with damping / 2: other time steps alone may change it as much"),
        (1.5 * 1.02, 1.53, "by 15.3 mm with half the time step"),
        (0.5, 2.0, "by 14 mm with damping / 2: other time steps alone may change it as much"),
    ],
)
def test_changes_within_the_error_of_the_steps_are_not_ranked(half, ratio, said):
    """As far as half the step, or 1.5 times as far: unvaried it is displaced by 10 mm."""
    columns = {"damping_ratio": [1.0, 0.5, 1.0], "dt": ["as given", "as given", "half"]}
    sizes = [0.01, 0.014, 0.01 * half]
    found = made_up([False] * 3, [False] * 3, residual=sizes, **columns)
    assert found.step_ratio == pytest.approx(ratio)
    assert found.what_changes[-1] == f"unvaried it is displaced by 10 mm, {said}"


@pytest.mark.parametrize("size", [0.0007, 0.0013])
def test_of_quiet_runs_no_ratio_of_time_steps_is_said(size):
    """Up to a millimetre, by which joints may move under dead load, it is as drawn."""
    columns = {"damping_ratio": [1.0, 0.5, 1.0], "dt": ["as given", "as given", "half"]}
    found = made_up([False] * 3, [False] * 3, residual=[size, 1.4 * size, 0.99 * size], **columns)
    assert found.is_quiet == (size < 0.001)
    assert found.what_changes[-1].endswith("other time steps alone may change it as much") == (
        not found.is_quiet
    )


def test_single_changes_that_end_a_dislocation_are_said_and_chance_counts_the_samples():
    """Unvaried it is dislocated; of 12 samples, which alone are tested, one is."""
    rules = ["exact", "exact", "rigid", "three points"] + ["exact", "rigid"] * 6
    friction, rows = [0.0, -0.1, 0.0, 0.0] + [0.0] * 12, np.arange(16)
    sizes = [0.04, 0.09, 0.001, 0.02] + [0.0] * 12
    columns = {"joint_rule": rules, "friction": friction}
    found = made_up(rows < 0, rows > 3, residual=sizes, parted=[0, 1, 4], **columns)
    assert found.what_changes == [
        "unvaried it is dislocated, and with 2 of 3 single changes it is not: joint rule "
        "'three points', joint rule 'rigid'",
        "unvaried it remains displaced by 40 mm, by 90 mm with friction - 0.1",
    ]
    where = "no property separates dislocations from the others by more than chance among the 12 "
    alone = "2 of 3 single changes alter the outcome"
    assert found.where == f"{where}that vary all, but {alone}"
    assert "exact: 1 of 6, rigid: 0 of 6" in found.table()
    found = made_up(rows < 0, rows > 3, residual=sizes, parted=[*range(5)], **columns)
    assert found.what_changes[0] == (
        "unvaried it is dislocated, and so with all of 3 single changes"
    )


def test_a_broken_single_change_is_the_last_and_counts_for_none():
    found = made_up([False] * 3, [False] * 3, residual=[0.02, np.nan, 0.01], sign=list("abc"))
    found.dataset["outcome"][1] = "unknown"
    assert [each.name for each in found.single_changes] == ["unvaried", "motion c", "motion b"]
    assert found.what_changes[0] == "it falls with none of 1 single changes"
    found.dataset["outcome"][0] = "unknown"
    assert found.what_changes == []


def test_the_sentence_names_the_only_motion():
    """An interval of one motion holds for that motion; without a name motions are varied."""
    found = made_up([False] * 4, sign=list("aabb"))
    shares = "0 of the 4 that vary all (0% to 60% at 95%)"
    assert found.sentence == f"falls in none of 4 variations; {shares}"
    found.dataset.attrs["motion"] = "synthetic 1"
    assert found.sentence.endswith("(0% to 60% at 95%), under 'synthetic 1' alone")


def test_a_run_without_an_answer_neither_stands_nor_falls():
    names = ["x", "x", "y", "y", "y"]
    found = made_up(
        [True, False, False, True, False],
        error=["", "", "", "", "did not converge"],
        sign=names,
    )
    assert found.answered.tolist() == [True] * 4 + [False]
    assert found.share == 0.5
    assert found.sentence.startswith("falls in 2 of 4 variations")
    assert found.sentence.split(", the first: ")[0].endswith(" have no answer")
    assert found.unanswered.startswith("; 1 of ")
    without = made_up([True, False, False, True], sign=names[:4])
    assert found.interval() == without.interval()
    assert found.importance() == without.importance()
    assert found.table() == without.table()


def test_falls_of_nearly_all_runs_are_not_explained():
    """Every condition leaves out more falls than runs that stand."""
    falls = np.ones(12, bool)
    falls[3] = False
    found = made_up(falls, scale=np.tile([0.5, 1.0, 2.0], 4))
    assert "no property separates falls from the others" in found.sentence


def test_runs_that_all_fail_are_reported():
    found = made_up([False, False], scale=np.array([1.0, 2.0]))
    found.dataset["error"] = "run", np.array(["DidNotConverge: no equilibrium"] * 2)
    assert found.sentence == "2 of 2 runs have no answer: DidNotConverge: no equilibrium"


def test_importance_is_the_correlation_ratio_of_ranks():
    """By its definition, for a label and for numbers in thirds."""
    rng = np.random.default_rng(0)
    residual, number = rng.random(30), rng.permutation(30) / 30.0
    label = np.where(rng.random(30) < 0.4, "a", "b")
    found = made_up(np.zeros(30, bool), residual=residual, sign=label, scale=number)
    ranks = rankdata(residual)
    thirds = [np.sort(number)[10 * k : 10 * k + 10] for k in range(3)]
    groups = {
        "sign": [ranks[label == each] for each in "ab"],
        "scale": [ranks[np.isin(number, each)] for each in thirds],
    }
    expected = {
        name: sum(len(each) * (each.mean() - ranks.mean()) ** 2 for each in members)
        / np.sum((ranks - ranks.mean()) ** 2)
        for name, members in groups.items()
    }
    assert found.importance() == pytest.approx(expected)
    assert list(found.importance()) == sorted(expected, key=lambda name: -expected[name])


def test_a_deciding_property_explains_all_and_a_constant_one_nothing():
    label = np.array(["a", "b"] * 10)
    found = made_up(label == "a", sign=label, dt=["as given"] * 20, scale=np.arange(20.0))
    assert found.importance()["sign"] == pytest.approx(1.0)
    assert found.importance()["dt"] == 0.0
    # distances to the ground say nothing about fallen structures
    far = made_up(np.ones(20, bool), residual=np.arange(20.0), scale=np.arange(20.0))
    assert far.importance() == {"scale": 0.0}
    same = made_up(np.ones(4, bool), sign=list("aabb"))
    assert same.importance() == {"sign": 0.0}


@pytest.mark.parametrize(
    ("columns", "falls", "where"),
    [
        (
            {"k_n": np.array([0.5, 0.8, 1.5, 2.5]), "sign": list("abab")},
            [True, True, False, False],
            "all falls are with k_n below 2.3 MPa/mm, where 16 of 16 fall",
        ),
        (
            {"friction": np.array([-0.1, 0.0, 0.05, 0.1])},
            [False, False, True, True],
            "all falls are with friction above that given +0.025, where 16 of 16 fall",
        ),
        (
            {"damping_ratio": np.array([0.5, 1.0, 1.5, 2.0])},
            [True, False, False, False],
            "all falls are with damping ratio below × 0.75, where 8 of 8 fall",
        ),
        (
            {"joint_rule": ["exact", "rigid", "rigid", "exact"], "dt": list("hhgh")},
            [False, True, False, False],
            "all falls are with joint rule 'rigid' and dt 'h', where 8 of 8 fall",
        ),
    ],
)
def test_the_sentence_names_the_properties_that_separate_falls(columns, falls, where):
    columns = {name: np.tile(values, 8) for name, values in columns.items()}
    assert made_up(np.tile(falls, 8), **columns).sentence.split(": ")[1].split(";")[0] == where


CHANCE = "no property separates falls from the others by more than chance"


def test_falls_and_dislocations_are_explained_where_falls_alone_are_too_few():
    """Two fall and eight are dislocated of 40, all with the least friction.

    Of two falls both are in a third of the runs by chance, once in ten: 13 · 12 / (40 · 39).
    """
    friction = np.linspace(-0.1, 0.1, 40)
    falls, parted = np.isin(np.arange(40), (2, 9)), np.isin(np.arange(40), [0, 1, *range(3, 9)])
    sign = np.tile(list("ab"), 20)
    found = made_up(falls, parted=parted, friction=friction, sign=sign)
    where = "all falls and dislocations are with friction below that given -0.051"
    assert found.where == f"{where}, where 10 of 10 fall or are dislocated"
    assert np.array_equal(found.decisive, friction < -0.05)
    text = f"falls in 2 of 40 variations and is dislocated in 8: {found.where}; 10 of the 40 that "
    assert found.sentence.startswith(f"{text}vary all; share of falls 1% to 17% at 95% by the 40")
    assert found.plot().get_suptitle().replace("\n", " ").startswith(found.headline)
    # thirds of 13, 14 and 13 runs, with 10 decisive in the first
    share = (13 * (10 / 13 - 0.25) ** 2 + 27 * 0.25**2) / (40 * 0.25 * 0.75)
    assert found.importance()["friction"] == pytest.approx(share)
    assert found.tabulate()[0][-1] == "falls or dislocated"
    # where dislocations have no such friction, falls alone are named
    mixed = np.isin(np.arange(40), (0, 5, 12, 17, 23, 28, 33, 38))
    other = made_up(falls, parted=mixed, friction=friction, sign=sign)
    assert (other.where, other.counted) == (CHANCE, "falls")


def test_falls_that_a_property_separates_are_named_without_dislocations():
    """All of ten falls are with the least friction, and dislocations everywhere."""
    rows = np.arange(40)
    found = made_up(rows < 10, parted=rows[12::3], friction=np.linspace(-0.1, 0.1, 40))
    assert found.where.startswith("all falls are with friction below ")
    assert found.counted == "falls"


@pytest.mark.parametrize(("falls", "chance"), [(4, True), (5, False)])
def test_a_property_is_named_if_chance_names_it_less_than_once_in_twenty(falls, chance):
    """All falls in one of two halves of twelve: by counting subsets, in one of 16.5 and of 66."""
    exact = 2 * comb(6, falls) / comb(12, falls)
    assert (exact > 0.05) == chance
    found = made_up(np.arange(12) < falls, sign=["a"] * 6 + ["b"] * 6)
    assert (CHANCE in found.sentence) == chance
    # no subset explains a larger share of the variance
    assert found.beyond_chance == (set() if chance else {"sign"})
    none = "no varied property explains the variance of the outcomes more than chance does"
    assert (none in str(found).splitlines()) == chance
    assert ("%" in found.table()) != chance


@pytest.mark.slow
def test_runs_without_a_rule_rarely_get_one():
    """Of ranges whose falls are drawn by chance one in twenty may name properties."""
    random = np.random.default_rng(5)
    named, explained = 0, 0
    for _ in range(60):
        columns = {name: random.random(26) for name in ("k_n", "k_s", "friction", "damping_ratio")}
        labels = random.choice(["a", "b"], (3, 26))
        columns |= dict(zip(("joint_rule", "sign", "dt"), labels, strict=True))
        found = made_up(random.permutation(26) < 6, **columns)
        named += CHANCE not in found.sentence
        explained += bool(found.beyond_chance)
    # 8 or more have a probability of 1 in 100
    assert max(named, explained) < 8


def test_single_changes_test_no_property():
    """They share all other values, so that their falls seem to be due to these."""
    sampled = np.arange(40) >= 14
    k_n = np.where(sampled, np.linspace(0.3, 3.0, 40), 1.0)
    falls = ~sampled
    falls[[15, 22, 30, 38]] = True
    assert CHANCE in made_up(falls, sampled, k_n=k_n).sentence


def test_a_rule_of_all_falls_separates_better_than_one_run():
    """Five of 250 fall, all of 91 with exact joints; one of them has the softest joints of all."""
    rule = np.array(["exact"] * 91 + ["rigid"] * 159)
    soft = np.random.default_rng(1).permutation(np.linspace(1.0, 3.0, 250))
    soft[40] = 0.4
    falls = np.isin(np.arange(250), (5, 23, 40, 61, 88))
    sentence = made_up(falls, k_s=soft, joint_rule=rule).sentence
    assert "all falls are with joint rule 'exact'" in sentence


def test_without_a_difference_no_condition_is_named():
    for falls, first in (
        (False, "falls in none of 3 variations; "),
        (True, "falls in 3 of 3 variations; "),
    ):
        assert made_up([falls] * 3, sign=list("aba")).sentence.startswith(first)


def test_the_table_counts_falls_by_value():
    found = made_up([True] * 4, sign=list("aabb"), k_n=[0.5, 0.5, 0.5, 2.0])
    (_, *rows) = found.table().splitlines()
    assert {row.split("  ", 1)[1].strip() for row in rows} == {
        "a: 2 of 2, b: 2 of 2",
        "0.5: 3 of 3, 2: 1 of 1",
    }
    assert str(found) == f"{found.sentence}\n{found.table()}"
    assert found.sentence in repr(found)


def test_a_saved_range_is_read_again(tmp_path):
    found = made_up([True, False], error=["", "no answer"], sign=list("ab"))
    again = VerdictRange.read(found.save(tmp_path / "folder" / "range.nc"))
    assert again.dataset.equals(found.dataset)
    assert (again.sentence, again.properties) == (found.sentence, ("sign",))
    with pytest.raises(af.InvalidInput):
        VerdictRange.read(tmp_path / "nothing.nc")


def test_each_property_has_a_panel():
    found = made_up([True, False, False], sign=list("aab"), k_n=[0.5, 1.0, 2.0])
    figure = found.plot()
    assert len([axes for axes in figure.axes if axes.get_visible()]) == 2
    # without what the sentence says of sampled runs
    assert " ".join(figure.get_suptitle().split()) == found.headline
    assert found.sentence.startswith(f"{found.headline}; 1 of the 3 that vary all (")


def test_factors_over_more_than_a_decade_have_a_logarithmic_axis():
    ends = {"k_s": (0.0035, 4.36), "k_n": (0.44, 4.36), "friction": (-0.1, 0.1)}
    columns = {name: np.linspace(*each, 4) for name, each in ends.items()}
    figure = made_up([True, False, False, True], **columns).plot()
    scales = {axes.get_xlabel().split(",")[0]: axes.get_xscale() for axes in figure.axes}
    expected = {"shear stiffness": "log", "normal stiffness": "linear", "friction": "linear"}
    assert scales == expected


@pytest.mark.parametrize("low", [0.26, 0.0035])
def test_labels_of_a_logarithmic_axis_stay_apart(low):
    values = np.geomspace(low, 4.0, 4)
    figure = made_up([True, False, False, True], k_n=values, friction=[0.0, 0.1, 0.2, 0.3]).plot()
    (axes,) = (each for each in figure.axes if "stiffness" in each.get_xlabel())
    figure.draw_without_rendering()
    ticks = [*axes.xaxis.get_major_ticks(), *axes.xaxis.get_minor_ticks()]
    left, right = axes.get_xlim()
    labels = [x.label1 for x in ticks if left <= x.get_loc() <= right and x.label1.get_text()]
    assert len(labels) > 1
    boxes = sorted((x.get_window_extent() for x in labels), key=lambda box: box.x0)
    assert all(one.x1 < other.x0 for one, other in pairwise(boxes))
