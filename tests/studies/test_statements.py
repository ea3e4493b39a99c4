"""Statements of a publication beside findings: the table, and the findings that only they need."""

from math import cos, radians

import numpy as np
import pytest

import archfem as af
from archfem.errors import InvalidInput
from archfem.studies.statements import FINDINGS, edge_factor

CASE = """
title = "a ring"
[structure]
shape = "circular_arch"
radius = 2.0
thickness = 0.3
embrace = 140.0
voussoirs = 7
[model]
fidelity = "rigid"
displacements = "small"
"""

SUITE = """
[suite]
name = "two short pairs"
reduction = 2.0
[suite.pairs]
a = { synthetic = { seed = 1, duration = 1.0, pga = 40.0 } }
b = { synthetic = { seed = 2, duration = 1.0, pga = 0.2 } }
[analysis]
dt = 0.005
[output]
joints = ["joint 3"]
"""

LOADS = """
[limit]
friction = "none"
point = [{ x = 0.6, force = [0.0, -1000.0] }, { x = 1.2, force = [0.0, -1000.0] }]
"""

STUDY = """
[columns]
"sliding" = []
"never" = ["contacts.stone to stone.friction=none", "criteria.friction=0.6"]
[cases]
"shaken" = { case = "shaken.toml" }
"loaded" = { case = "loaded.toml" }
"""


def statement(case: str, finding: str, **more: str) -> str:
    """Write a statement of a study file."""
    keys = {"where": "here", "words": finding, "published": "so", "case": case, "finding": finding}
    lines = [f'{key} = "{value}"' for key, value in (keys | more).items()]
    return "\n".join(["[[statements]]", *lines, ""])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with two cases."""
    folder = tmp_path_factory.mktemp("statements")
    (folder / "shaken.toml").write_text(CASE + SUITE)
    (folder / "loaded.toml").write_text(CASE + LOADS)
    return folder


def read(folder, statements: str):
    """Return the study of some statements."""
    path = folder / "study.toml"
    path.write_text(STUDY + statements)
    return af.Study.read(path)


@pytest.fixture(scope="module")
def answers(folder):
    """Return by finding the cells of a table: published, and two columns."""
    wanted = [statement("shaken", name) for name in ("rises", "largest compression", "dead load")]
    wanted += [statement("shaken", name) for name in ("modes", "peak acceleration", "envelope")]
    wanted += [statement("shaken", "mechanisms"), statement("shaken", "first mechanism", pair="b")]
    wanted += [statement("shaken", "joint", pair="a", joint="joint 3")]
    wanted += [statement("loaded", name) for name in ("capacity", "order of hinges")]
    study = read(folder, "".join(wanted))
    text = study.answers(study.run(workers=1))
    head, *lines = text.splitlines()
    assert head.startswith("statement ")
    assert head.endswith("never")
    cells = [[cell.strip() for cell in line.split("  ") if cell.strip()] for line in lines]
    return {words: [published, *found] for words, _, published, *found in cells}


@pytest.mark.slow
def test_a_circle_through_the_joints_has_the_rise_of_the_ring(answers):
    rise = 2.0 * (1.0 - cos(radians(70.0)))
    assert answers["rises"] == ["so", f"{rise:.2f} m", f"{rise:.2f} m"]


@pytest.mark.slow
def test_dead_load_is_that_of_the_analysis(answers, folder):
    dead = af.Case.read(folder / "shaken.toml").analysis.dead_load()
    joints, depth = dead.joints, 0.3
    # the exact rule: linear, or triangular over three times the distance to the edge
    mean, away = joints["N"].values / depth, abs(joints["eccentricity"].values)
    stress = np.where(away < 1 / 6, mean * (1 + 6 * away), 2 * mean / (3 * (0.5 - away)))
    assert answers["largest compression"][1] == f"{stress.max() / 1e6:.2f} MPa"
    used = float(abs(joints["V"] / joints["N"]).max())
    assert answers["dead load"][1] == f"|e| {away.max():.2f}, |V|/N {used:.2f}"


def test_modes_of_a_ring_without_fill_are_not_local(answers, folder):
    frequencies = af.modes(af.Case.read(folder / "shaken.toml").analysis, 3).frequencies
    listed = ", ".join(f"{each:.2f}" for each in frequencies)
    assert answers["modes"][1] == f"0 local ({listed} Hz)"


def test_motions_are_counted_by_pair_and_by_law(answers, folder):
    analysis = af.Case.read(folder / "shaken.toml").analysis
    motions = af.Case.read(folder / "shaken.toml").ground_suite().motions
    found = [af.first_mechanisms(analysis.run(each))["any joints at once"] for each in motions]
    assert [each is not None for each in found] == [True, False]
    assert answers["mechanisms"][1] == f"1 of 2 (1 {found[0].kind})"
    assert answers["first mechanism"][1] == "none"
    # the suite's pairs are divided by R = 2, the acceleration is that before
    assert answers["peak acceleration"][1] == f"{(40.0 + 0.2) / 2 / 9.81:.3f} g"


def test_a_joint_has_its_largest_values_under_one_pair(answers, folder):
    case = af.Case.read(folder / "shaken.toml")
    joint = case.analysis.run(case.ground_suite().motions[0]).joints.isel(joint=3)
    e, used = (float(abs(joint[name]).max()) for name in ("eccentricity", "friction"))
    assert answers["joint"][1] == f"|e| {e:.2f}, |V|/N {used:.2f}"


def test_two_loads_of_a_file_are_those_of_limit_analysis(answers, folder):
    loads = [af.PointLoad(x=x, force=(0.0, -1e3)) for x in (0.6, 1.2)]
    ring = af.Case.read(folder / "loaded.toml").structure
    collapse = af.collapse_factor(ring, live=loads, friction=None)
    assert answers["capacity"][1].endswith(f"limit analysis {collapse.factor:.4g}")
    # the four hinges of the mechanism, whichever comes first
    order = answers["order of hinges"][1].removeprefix("joints ").replace(" and ", " then ")
    assert {int(joint) for joint in order.split(" then ")} >= {
        joint for joint, _ in collapse.hinges
    }


@pytest.mark.parametrize("away", [0.0, 0.1, 1 / 6, 0.3, 0.45])
def test_the_edge_stress_balances_the_force_and_its_moment(away):
    """On a depth of one under a unit force: the integral of the stress, and its first moment."""
    edge = float(edge_factor(np.array(away)))
    closed = min(1.0, 3.0 * (0.5 - away))
    other = 2.0 - edge if closed == 1.0 else 0.0
    assert 0.5 * (edge + other) * closed == pytest.approx(1.0, abs=1e-12)
    centre = closed * (edge + 2.0 * other) / (3.0 * (edge + other))
    assert 0.5 - centre == pytest.approx(away, abs=1e-12)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (statement("shaken", "rise"), "finding 'rise' is unknown: .*rises"),
        (statement("shaken", "mechanisms", definition="verify"), "definition 'verify' is unknown"),
        (statement("drawn", "rises"), r"about \['drawn'\], but the cases are"),
    ],
)
def test_statements_that_nothing_answers_are_refused(folder, text, words):
    with pytest.raises(InvalidInput, match=words):
        read(folder, text)


def test_a_capacity_that_was_not_found_is_a_bound():
    row = {"peak": 0.5, "factor": np.nan, "factor_at_most": 0.6}
    assert FINDINGS["capacity"]({"": row}, None) == "pushover 0.5, limit analysis at most 0.6"
