"""Findings of a study: kept in files, set side by side in tables."""

import json

import archfem as af
from archfem.studies import Finding, study_table
from archfem.studies.comparison import write_finding

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
