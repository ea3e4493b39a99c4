"""The stored map of checks and falls: its size, its arches, and the numbers of its page."""

import csv
import math
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import archfem as af

ROOT = Path(__file__).parents[2]
TABLE = ROOT / "docs" / "assessment_map.csv"
PAGE = (ROOT / "docs" / "assessment_map.md").read_text("utf-8")
WORDS = {"arch", "motion", "variant", "error"}


@pytest.fixture(scope="module")
def lines():
    """Lines of the stored table, numbers as numbers."""
    with TABLE.open(encoding="utf-8") as file:
        return [
            {k: v if k in WORDS else float(v or "nan") for k, v in line.items()}
            for line in csv.DictReader(file)
        ]


@pytest.fixture(scope="module")
def brackets(lines):
    return [line for line in lines if line["variant"] == "map"]


@pytest.fixture(scope="module")
def script():
    """The script that computes the table."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "tests" / "benchmarks")
        import assessment_map

        yield assessment_map
        for name in ("assessment_map", "setting"):
            sys.modules.pop(name, None)


def falls_below(line, check):
    """Whether the arch fell at the acceleration of a check or below; half a digit of rounding."""
    return line["falls"] <= line[check] * 1.0005


def share(brackets, check):
    return sum(falls_below(line, check) for line in brackets) / len(brackets)


def test_the_map_has_its_size(brackets):
    assert TABLE.stat().st_size < 300e3
    assert len({line["arch"] for line in brackets}) >= 50
    assert len({line["motion"] for line in brackets}) >= 10
    assert len({line["stiffness"] for line in brackets}) == 2
    bounded = [b for b in brackets if b["stands"] > 0.0 and math.isfinite(b["falls"])]
    assert len(bounded) >= 500
    # bisected to a tenth; four digits are stored
    assert max(b["falls"] / b["stands"] for b in bounded) < 1.101


def test_the_table_is_that_of_the_script(lines, script):
    points = script.list_points(50, 10)
    assert len(lines) == len(points)
    for line, point in zip(lines, points, strict=True):
        assert all(line[name] == point[name] for name in (*script.RANGES, "stiffness"))
        assert (line["arch"], line["motion"]) == (str(point["arch"]), point["motion"])
        assert line["variant"] == point["variant"]


def row_of(start):
    """Percentages of a row of the page's table."""
    (row,) = re.findall(rf"^\| {re.escape(start)} \|(.*)$", PAGE, re.MULTILINE)
    return [float(number) for number in re.findall(r"[\d.]+", row)]


@pytest.mark.parametrize(
    ("check", "start"),
    [
        ("linear", "linear, q = 2, FC = 1.35"),
        ("linear_1", "linear, q = 2, FC = 1"),
        ("displacement", "displacement, SLV, FC = 1.35"),
        ("displacement_1", "displacement, SLV, FC = 1"),
    ],
)
def test_the_page_has_the_shares_of_the_table(brackets, check, start):
    stated, low, high, undecided = row_of(start)
    assert stated == pytest.approx(100.0 * share(brackets, check), abs=0.051)
    between = [b["stands"] < b[check] * 0.9995 and b["falls"] > b[check] * 1.0005 for b in brackets]
    assert undecided == pytest.approx(100.0 * np.mean(between), abs=0.051)
    # Brackets of resampled arches and motions; 90 % bounds of 1000 draws scatter by a point.
    arches, motions = ({line[key] for line in brackets} for key in ("arch", "motion"))
    place = {name: k for names in (arches, motions) for k, name in enumerate(sorted(names))}
    cube = np.zeros((len(arches), len(motions), 2))
    for line in brackets:
        cell = cube[place[line["arch"]], place[line["motion"]]]
        cell += falls_below(line, check), 1.0
    number, draws = np.random.default_rng(7), []
    for _ in range(1000):
        rows, columns = (number.integers(0, n, n) for n in cube.shape[:2])
        draws.append(np.divide(*cube[np.ix_(rows, columns)].sum(axis=(0, 1))))
    assert [low, high] == pytest.approx(100.0 * np.quantile(draws, (0.05, 0.95)), abs=1.5)


def test_the_page_has_the_counts_of_the_table(lines, brackets):
    arches = sorted({line["arch"] for line in brackets})
    shares = [share([b for b in brackets if b["arch"] == arch], "linear") for arch in arches]
    text = " ".join(PAGE.split())
    assert f"{sum(s > 0.0 for s in shares)} of the 50 arches fall below it in at least one" in text
    assert f"{sum(s >= 0.5 for s in shares)} in at least half of theirs" in text
    worst = min(b["falls"] / b["linear"] for b in brackets)
    assert f"falls at {worst:.2f} of the acceleration" in text
    small, large = (
        share([b for b in brackets if (b["radius"] < 2.5) == is_small], "linear")
        for is_small in (True, False)
    )
    assert f"{100 * small:.1f} % fall below it; of the others, {100 * large:.1f} %" in text
    safe = 2.0 * np.quantile([b["stands"] / b["linear"] for b in brackets], 0.1)
    assert f"A behaviour factor of {safe:.2f}" in text
    runs, seconds = (sum(line[key] for line in lines) for key in ("runs", "seconds"))
    assert f"{len(lines)} searches made {runs:.0f} runs in {seconds / 60:.0f} minutes" in text


def test_the_page_has_the_effects_of_the_settings(lines, brackets):
    def fall(line):
        return math.sqrt(line["stands"] * line["falls"])

    softest = min(b["stiffness"] for b in brackets)
    soft = {(b["arch"], b["motion"]): fall(b) for b in brackets if b["stiffness"] == softest}
    groups = {"joints ten times as stiff": [b for b in brackets if b["stiffness"] > softest]}
    for line in lines:
        if line["variant"] != "map":
            groups.setdefault(line["variant"], []).append(line)
    assert len(groups) == 6
    for name, group in groups.items():
        ratios = [fall(line) / soft[line["arch"], line["motion"]] for line in group]
        count, *stated, below = row_of(name)
        assert count == len(group)
        assert stated == pytest.approx(np.quantile(ratios, (0.5, 0.1, 0.9)), abs=0.0051)
        assert below == pytest.approx(100.0 * share(group, "linear"), abs=0.051)


def test_the_page_has_the_shares_of_the_variance(brackets):
    """The properties were sampled independently: squared correlations are shares."""
    ratio = np.log([math.sqrt(b["stands"] * b["falls"]) / b["linear"] for b in brackets])

    def explained(name):
        values = np.array([b[name] for b in brackets])
        scaled = np.log(values) if name in ("radius", "stiffness") else values
        return 100.0 * np.corrcoef(scaled, ratio)[0, 1] ** 2

    motions = [b["motion"] for b in brackets]
    means = {name: ratio[np.array(motions) == name].mean() for name in set(motions)}
    motion = 100.0 * np.var([means[name] for name in motions]) / ratio.var()
    text = " ".join(PAGE.split())
    stated = (
        f"The radius has {explained('radius'):.0f} % of the variance of ln(fall / linear check), "
        f"the friction {explained('friction'):.0f} %, the motion {motion:.0f} %, "
        f"the joint stiffness {explained('stiffness'):.0f} %, "
        f"the embrace {explained('embrace'):.0f} %, "
        f"the thickness ratio {explained('thickness_ratio'):.0f} %"
    )
    assert stated in text


def test_the_linear_check_follows_from_limit_analysis(brackets):
    """By its factor and its motion at rest: 2 α₀ g / (e* FC), to the four digits stored."""
    for line in brackets[::200]:
        joint = af.Contact(line["stiffness"], line["stiffness"] * 0.30 / 1.48, line["friction"])
        ring = af.circular_arch(
            radius=line["radius"],
            thickness=line["thickness_ratio"] * line["radius"],
            embrace=line["embrace"],
            voussoirs=13,
            contact=joint,
        )
        collapse = af.collapse_factor(ring, live=af.BodyForce(1.0, 0.0))
        weights = np.array([ring.blocks[k].area for k in ring.free])  # of one material and width
        along = np.array([collapse.motion[k][0] for k in ring.free])
        moving = np.array([np.abs(collapse.motion[k]).max() > 1e-9 for k in ring.free])
        mass = weights[moving].sum()
        e_star = (weights @ along) ** 2 / mass / (weights @ along**2)
        allowed = 2.0 * collapse.factor / e_star / 1.35 * ring.gravity / 9.80665
        assert allowed == pytest.approx(line["linear"], rel=5e-4)


@pytest.mark.slow
def test_a_line_of_the_table_is_computed_again(lines, script):
    line, point = lines[40], script.list_points(50, 10)[40]
    study = af.Study(script.base_case(10), [point["changes"]], script.evaluate)
    table = study.run()
    for name in ("linear", "displacement", "stands", "falls"):
        assert float(table[name].values[0]) == pytest.approx(line[name], rel=5e-4)
