"""Findings of a study: kept in files, set side by side in tables."""

import json
import linecache

import numpy as np
import pytest

import archfem as af
from archfem.studies import Finding, study_table
from archfem.studies.comparison import write_finding
from archfem.studies.evaluators import Evaluator, evaluate_dead_load, findings_by_part

DEFINITIONS = af.dynamics.MECHANISM_DEFINITIONS


def finding(**given):
    brackets = dict.fromkeys(DEFINITIONS, (1.0, 0.9))
    run = {
        "eccentricity": {"arch": 0.4},
        "friction": {"arch": float("inf")},
        "mechanisms": dict.fromkeys((*DEFINITIONS, "Demirel and Aldemir")),
        "ended": "finished",
        "outcome": "reached the end of the motion",
    }
    every = {
        "case": "text",
        "frequency": 9.0,
        "mass": 0.7,
        "roles": {"arch": "ring"},
        "dead": {"arch": 0.2},
        "runs": {"a": run, "b": run},
        "scales": {"a": brackets, "b": brackets},
    }
    return Finding(**every | given)


def test_a_study_distinguishes_rings_from_piers_by_their_roles():
    named = {"runs": {}, "scales": {}, "dead": {"vault": 0.2, "stem": 0.1}}
    found = finding(roles={"vault": "ring", "stem": "pier"}, **named)
    run = finding().runs["a"] | {"eccentricity": {"vault": 0.41, "stem": 0.32}}
    found.runs = {"a": run}
    head, row = study_table({"bridge": found}).splitlines()[:2]
    assert row[head.index("|e| rings") :].split()[:2] == ["0.410", "0.320"]


def test_the_median_is_of_the_largest_of_all_rings_in_each_pair():
    """One of three pairs has a ring less; piers beside them do not count."""
    roles = {"one": "ring", "pier": "pier", "other": "ring"}
    eccentricities = (
        {"one": 0.1, "other": 0.3, "pier": 0.49},
        {"one": 0.25, "pier": 0.49},
        {"one": 0.4, "other": 0.2, "pier": 0.41},
    )
    plain = finding().runs["a"]
    runs = {
        str(pair): plain | {"eccentricity": values} for pair, values in enumerate(eccentricities)
    }
    both = finding(roles=roles, runs=runs)
    no_pier = finding(roles={"one": "ring", "pier": "other", "other": "ring"}, runs=runs)
    head, *rows = study_table({"both": both, "no pier": no_pier}).splitlines()[:3]
    cells = [row[head.index("|e| rings") :].split()[:2] for row in rows]
    assert cells == [["0.300", "0.490"], ["0.300", "-"]]


def test_findings_are_written_as_they_are(tmp_path):
    path = tmp_path / "case.json"
    write_finding(finding(search={"precision": 0.1, "between": [0.2, 2.0]}), path)
    kept = json.loads(path.read_text())
    assert set(kept["scales"]) == {"a", "b"}
    assert kept["runs"]["a"]["friction"]["arch"] == float("inf")
    assert kept["search"]["precision"] == 0.1


def test_a_table_counts_pairs_and_runs_that_broke_off():
    broken = finding().runs["a"] | {"ended": "failed", "outcome": "failed at 0.4 s: …"}
    complete = finding().runs["a"]
    table = study_table({"ring": finding(runs={"a": complete, "b": broken})})
    assert "ring: 1 of 2 runs broke off" in table
    table = study_table({"ring": finding(runs={"a": complete})})
    assert "broke off" not in table
    assert "0 of 1" in table


def test_a_study_counts_falls_where_displacements_may_be_large():
    def fell(kind):
        return finding().runs["a"] | {"fall": kind}

    large = finding(runs={"a": fell("fallen"), "b": fell("dislocated"), "c": fell("partly fallen")})
    lines = study_table({"large": large, "small": finding()}).splitlines()
    assert lines[0].endswith("blocks fall")
    assert lines[1].endswith("2 of 3")
    assert lines[2].endswith("-")
    assert "blocks fall" not in study_table({"small": finding()})


def test_findings_of_dead_load_are_the_largest_and_the_least_of_all_joints(small_ring):
    dead = af.cases.dead_load_of_case(small_ring)
    found = evaluate_dead_load(small_ring)
    normal, shear, moment = (dead.joints[name].values for name in "NVM")
    eccentricities = np.abs(moment / normal / small_ring.structure.depths)
    assert np.ptp(eccentricities) > 0.01
    assert found["eccentricity"] == pytest.approx(eccentricities.max(), rel=1e-9)
    assert found["friction"] == pytest.approx((np.abs(shear) / normal).max(), rel=1e-9)
    assert found["N"] == pytest.approx(normal.min(), rel=1e-9)


def test_findings_of_a_run_are_the_largest_over_time_and_the_joints_of_each_part():
    """A stack whose middle joint opens for one of three instants: 0.5 there, friction unlimited."""
    stack = af.column(breadth=1.0, heights=[1.0, 1.0, 1.0])
    resultants = np.tile([1000.0, 100.0, 50.0], (3, 3, 1))
    resultants[1, 0] = [1000.0, -250.0, -300.0]
    resultants[2, 1] = 0.0
    joints = af.joints.joint_dataset(stack, resultants, np.arange(3.0))
    run = af.History(joints.assign_attrs(ended="finished", outcome="reached the end"), stack)
    part = str(joints["part"].values[0])
    found = findings_by_part(run)
    assert found[f"eccentricity: {part}"] == pytest.approx(0.3)
    assert found[f"friction: {part}"] == pytest.approx(0.25)
    lost = resultants.copy()
    lost[:, 1] = 0.0  # never closed
    joints = af.joints.joint_dataset(stack, lost, np.arange(3.0))
    run = af.History(joints.assign_attrs(ended="finished", outcome="reached the end"), stack)
    found = findings_by_part(run)
    assert found[f"eccentricity: {part}"] == 0.5
    assert np.isinf(found[f"friction: {part}"])


def test_a_joint_that_opens_for_an_instant_counts_as_a_hinge(small_ring):
    dead = af.cases.dead_load_of_case(small_ring)
    run = af.cases.run_time_history(small_ring, small_ring.ground_motion(), dead)
    assert af.studies.of_history(run)["eccentricity"] < 0.5
    opened = run.dataset.copy(deep=True)
    for name in ("eccentricity", "friction"):
        opened[name][4, 2] = np.nan
    found = af.studies.of_history(af.History(opened, run.structure))
    assert (found["eccentricity"], found["friction"]) == (0.5, np.inf)


def test_a_function_is_identified_by_its_source_also_in_a_notebook():
    texts = []
    for power in (2, 3):
        name, source = f"<cell {power}>", f"def find(case):\n    return {{'x': 2**{power}}}\n"
        linecache.cache[name] = len(source), None, source.splitlines(keepends=True), name
        place = {"__name__": "__main__"}
        exec(compile(source, name, "exec"), place)
        texts.append(Evaluator(place["find"], {}).text)
    assert "2**2" in texts[0]
    assert "2**3" in texts[1]


def test_findings_are_numbers_texts_or_rows_of_numbers(small_ring):
    def find(case, value):
        return {"found": value}

    for given, kept in (
        ((1, 2.5), [1.0, 2.5]),
        (np.arange(2.0), [0.0, 1.0]),
        (True, 1),
        ("a", "a"),
    ):
        assert Evaluator(find, {"value": given}).evaluate(small_ring) == {"found": kept}
    for wrong in (["a", 1.0], {"b": 1.0}, [[1.0]], {1.0}):
        with pytest.raises(af.InvalidInput, match="found"):
            Evaluator(find, {"value": wrong}).evaluate(small_ring)


def test_a_table_has_the_median_and_the_range_of_factors_and_the_classes_of_mechanisms():
    """Eleven pairs, one of which stands at all scales; none that fails in another case."""
    factors = (*np.arange(0.7, 1.65, 0.1), np.inf)
    scales = {
        str(k): dict.fromkeys(DEFINITIONS, (factor, 0.5 * factor))
        for k, factor in enumerate(factors)
    }
    none = {"a": dict.fromkeys(DEFINITIONS, (np.inf, 2.0))}
    local = {key: {"kind": "local", "time": 1.0} for key in (*DEFINITIONS, "Demirel and Aldemir")}
    runs = {"a": finding().runs["a"], "b": finding().runs["a"] | {"mechanisms": local}}
    table = study_table(
        {
            "some": finding(scales=scales, runs=runs),
            "never": finding(scales=none),
            "no": finding(scales={}),
        }
    )
    first, second = (part.splitlines() for part in table.split("\n\n"))
    assert [row.split("  ")[-1].strip() for row in first[1:]] == ["1 local", "none", "none"]
    cells = [row.split("  ")[-1].strip() for row in second[1:]]
    assert cells == ["1.20 (0.70 to -)", "-", "-"]
