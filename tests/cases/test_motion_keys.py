"""Motions, suites and target spectra of case files."""

import tomllib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import archfem as af
from archfem.cases import motion_keys
from archfem.cases.motion_keys import build_motion, build_suite, parse_motion, parse_suite

SHIPPED = Path(__file__).parents[2] / "meshes" / "ring_suite.toml"


def pair(**keys):
    return {"synthetic": {"seed": 1, "duration": 5.0}, **keys}


def test_shipped_suite_is_six_horizontals_and_three_verticals():
    case = af.Case.read(SHIPPED, ["suite.matched=false"])
    suite = case.ground_suite()
    assert len(suite.pairs) == 6
    assert len({motion.horizontal.tobytes() for motion in suite.pairs}) == 6
    assert len({motion.vertical.tobytes() for motion in suite.pairs}) == 3
    assert suite.reduction == 3.0
    assert case.target == af.Tbec2018(ss=1.140, s1=0.315, site="ZD")
    assert suite.motions[0].name == "pair-1"
    assert suite.motions[0].pga == pytest.approx(suite.pairs[0].pga / 3.0)


def test_a_suite_is_matched_on_request_of_the_case():
    target = {"code": "TBEC-2018", "ss": 1.140, "s1": 0.315, "site": "ZD"}
    one = {"synthetic": {"seed": 1, "duration": 5.0, "vertical_ratio": 0.0}}
    settings = {"matched": True, "target": target, "pairs": {"one": one}}
    (match,) = build_suite(parse_suite(settings)).matches
    # Bounds of the matched spectrum over its band.
    assert max(match.misfit.values()) < 0.05
    assert match.motion.name == "one"
    (match,) = build_suite(parse_suite({**settings, "band": ["0.03 s", "1.5 s"]})).matches
    assert match.band == (0.03, 1.5)
    assert max(match.misfit.values()) < 0.05


@pytest.mark.slow
def test_ground_rests_behind_a_matched_motion_as_it_was_matched():
    """Matching with the rest would shake the ground there."""
    target = {"code": "EC8", "ag": 0.25, "ground": "B"}
    suites = []
    for rest in (0.0, 2.0):
        one = {"synthetic": {"seed": 1, "duration": 4.5}, "rest": rest}
        settings = {"matched": True, "target": target, "pairs": {"one": one}}
        suites.append(build_suite(parse_suite(settings)))
    bare, rested = (suite.pairs[0] for suite in suites)
    count = len(bare.horizontal)
    assert rested.duration == pytest.approx(bare.duration + 2.0)
    for name in ("horizontal", "vertical"):
        found = rested.component(name)
        np.testing.assert_array_equal(found[:count], bare.component(name))
        assert not found[count:].any()


@pytest.mark.parametrize(
    ("target", "expected"),
    [
        ({"code": "EC8", "ag": 0.25, "ground": "C"}, af.Eurocode8(0.25, "C")),
        ({"code": "EC8", "ag": 0.25, "ground": "C", "type": 2}, af.Eurocode8(0.25, "C", 2)),
        (
            {"code": "table", "periods": ["0 s", "200 ms"], "values": [0.4, 1.0]},
            af.motion.TableSpectrum([0.0, 0.2], [0.4, 1.0]),
        ),
    ],
)
def test_targets_are_those_of_the_codes(small, target, expected):
    tables = tomllib.loads(small.read_text())
    tables["suite"]["target"] = target
    periods = np.linspace(0.0, 0.2, 9)
    assert af.Case.of(tables).target.horizontal(periods) == pytest.approx(
        expected.horizontal(periods)
    )


def test_samples_may_stand_in_the_case():
    upright = {"samples": ["0.1 g", 0.0, -1.0], "dt": "10 ms"}
    given = {"samples": [0.5, 1.0], "dt": 0.01, "vertical": upright, "scale": 2.0}
    motion = build_motion(parse_motion(given))
    assert motion.horizontal.tolist() == [1.0, 2.0]
    assert motion.vertical.tolist() == [0.2 * 9.80665, 0.0, -2.0]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("suite.reductoin=3", "unknown key 'suite.reductoin': did you mean 'reduction'"),
        ("suite.pairs={}", "suite.pairs is empty"),
        ("suite.pairs.a/b={synthetic={seed=1}}", "'a/b' names a folder"),
        ("suite.pairs.third={}", "suite.pairs.third needs either a file, or synthetic"),
        ("suite.pairs.third={synthetic={sed=1}}", "unknown key 'suite.pairs.third.synthetic.sed'"),
        ("suite.pairs.third={synthetic={}, units='g'}", "units belongs to a file"),
        ("suite.pairs.third={synthetic={}, response='a.xml'}", "response belongs to a file"),
        ("suite.pairs.third={held={}}", r"third.held = {}: .*'push'"),
        (
            "suite.pairs.third={held={push=1.0, rise=0}}",
            "rise of a held push .* not between 0 and 10",
        ),
        ("suite.pairs.third={held={push=1.0}, dt=0.01}", "dt belongs to a file, not to held"),
        ("suite.pairs.third={samples=[0.0, 1.0]}", "needs the time between them"),
        (
            "suite.pairs.third={samples=[0.0, 1.0], synthetic={}}",
            "has .'samples', 'synthetic'.+remove =",
        ),
        ("suite.pairs.first.vertical=3", "vertical = 3 is not a word or a table"),
        ("suite.pairs.first.vertical={}", "suite.pairs.first.vertical needs either a file"),
        ("suite.matched=true", "suite.matched = true needs a target"),
        ("suite.band=[0.1]", r"suite.band = \[0.1\]: give two periods"),
        ("suite.target={code='UBC'}", "suite.target.code = 'UBC' is not known"),
        ("suite.target={code='EC8', ag=0.2}", "suite.target of EC8: .*'ground'"),
        ("suite.target={code='EC8', ag=0.2, ground='Z'}", "ground 'Z'"),
        (
            "suite.target={code='NTC-2018', ag=0.2, f0=2.5}",
            r"NTC-2018: give also 'tc_star', T_C\* of the site.*; 'site', category of .* E$",
        ),
        ("motion={synthetic={seed=1}}", "either one motion or a suite"),
        ("suite.scale=0", "scale 0"),
    ],
)
def test_refusals_name_the_key(small, change, says):
    with pytest.raises(af.InvalidInput, match=says):
        af.Case.read(small, [change]).ground_suite()


@pytest.mark.parametrize(
    ("push", "outcome"),
    [(0.24, "stands"), (0.26, "fallen"), pytest.param(-0.26, "fallen", marks=pytest.mark.slow)],
)
def test_a_held_push_overturns_a_block_from_breadth_over_height_on(push, outcome):
    """Of 0.5 × 2 m: by hand from 0.25 g on, towards the side that it is pushed to."""
    tables = {
        "structure": {"shape": "column", "breadth": 0.5, "heights": [2.0]},
        "contacts": {"stone to stone": {"normal_stiffness": 1e12, "shear_stiffness": 1e12}},
        "model": {"fidelity": "rigid", "displacements": "large"},
        "analysis": {"damping": "effective"},
        "motion": {"held": {"push": f"{push} g", "duration": "4 s"}},
    }
    case = af.Case.of(tables)
    history = case.analysis.run(case.ground_motion())
    assert history.verdict.outcome == outcome
    if outcome == "fallen":
        assert history.dataset["fall_pose"].values[-1, 1, 0] * push > 0.0


def test_files_of_a_pair_have_their_own_units_and_steps(tmp_path, at2):
    level, upright = tmp_path / "level.AT2", tmp_path / "up.txt"
    at2(level, [0.0, 0.1, -0.1, 0.0], 0.01)
    upright.write_text("0 0\n0 49.05\n0 0\n")
    given = {"file": "level.AT2", "vertical": {"file": "up.txt", "column": 2, "units": "gal"}}
    given["vertical"]["dt"] = 0.005
    settings = parse_suite({"pairs": {"one": {**given, "resample": "5 ms"}}})
    (motion,) = build_suite(settings, tmp_path).motions
    assert motion.dt == 0.005
    assert motion.vertical == pytest.approx([0.0, 0.4905, 0.0])
    assert motion.pga == pytest.approx(0.980665)
    with pytest.raises(af.InvalidInput, match=r'suite\.pairs\.one\.resample = "0\.005 s"'):
        build_suite(parse_suite({"pairs": {"one": given}}), tmp_path)


def test_a_baseline_is_corrected_before_the_record_is_cut(tmp_path, at2):
    at2(tmp_path / "drifts.AT2", (0.1 + np.sin(np.arange(400) * 0.1)).tolist(), 0.01)
    given = {"file": "drifts.AT2", "end": "2 s", "baseline_corrected": True}
    motion = build_motion(parse_motion(given), tmp_path)
    whole = af.Motion.read(tmp_path / "drifts.AT2").baseline_corrected()
    assert whole.velocity()[-1] == pytest.approx(0.0, abs=1e-9)
    assert motion.horizontal == pytest.approx(whole.horizontal[:201])
    assert motion.recorded


def test_a_synthetic_vertical_has_the_given_peak():
    """It used to be the vertical of a motion whose horizontal had that peak: two thirds of it."""
    level = {"seed": 1, "pga": 1.0, "duration": 2.0}
    upright = {"synthetic": {"seed": 2, "pga": 2.0, "duration": 2.0}}
    settings = parse_motion({"synthetic": level, "vertical": upright})
    made = build_motion(settings)
    assert abs(made.vertical).max() == pytest.approx(2.0, rel=1e-12)
    assert made.pga == pytest.approx(1.0, rel=1e-12)
    with pytest.raises(af.InvalidInput, match="vertical_ratio: a vertical has none"):
        parse_motion(
            {"synthetic": level, "vertical": {"synthetic": {"seed": 2, "vertical_ratio": 0.5}}}
        )


@pytest.mark.parametrize(
    ("target", "period", "value"),
    [
        ('{code="NTC-2018", ag=0.25, f0=2.5, tc_star="0.35 s", site="A"}', 0.2, 0.625),
        ('{code="ASCE-7-22", sds=1.2, sd1=0.6, tl="8 s"}', 1.0, 0.6),
        ('{code="EC8-2024", s_alpha=0.5, s_beta=0.15, f_alpha=1.2, f_beta=1.6}', 0.2, 0.6),
    ],
)
def test_codes_by_name(small, target, period, value):
    spectrum = af.Case.read(small, [f"suite.target={target}"]).target
    assert spectrum.horizontal(period) == pytest.approx(value)


@pytest.mark.parametrize(
    ("columns", "level"),
    [("N-S E-W U-D", 1), ("N-S E-W U-D", 2), ("U-D N-S E-W", 3), ("time E-W N-S U-D", 3)],
)
def test_a_selected_record_is_read_again_from_its_columns(columns, level, tmp_path):
    """Components of one file: either horizontal one of them, and the vertical."""
    names = columns.split()
    table = np.random.default_rng(1).normal(size=(20, len(names))).round(4)
    if "time" in names:
        table[:, 0] = (0.01 * np.arange(20)).round(2)
    path, upright = tmp_path / "three.txt", names.index("U-D")
    rows = "\n".join(" ".join(f"{value:.4f}" for value in row) for row in table)
    path.write_text(f"# {columns} m/s2, dt = 0.01\n{rows}\n")
    motion = af.Motion(table[:, level - 1], 0.01, table[:, upright], "three E-W")
    record = SimpleNamespace(
        motion=motion, scale=1.5, sources={"horizontal": (path, 1), "vertical": (path, 2)}
    )
    selection = SimpleNamespace(rule=SimpleNamespace(name="EC8"), records=[record])
    target = {"code": "EC8", "ag": 0.25, "ground": "B"}
    text = motion_keys.write_selected_suite(selection, tmp_path, target)
    (pair,) = build_suite(parse_suite(tomllib.loads(text)["suite"])).pairs
    assert pair.horizontal.tolist() == (1.5 * motion.horizontal).tolist()
    assert pair.vertical.tolist() == (1.5 * motion.vertical).tolist()


def test_a_component_of_a_later_time_is_selected_and_read_at_its_time(tmp_path):
    """Files of one instrument, of which the vertical begins 0.2 s after the horizontal."""
    shaking = af.Motion.synthetic(duration=4.0, dt=0.01, seed=4)
    parts = ("NS", 7.0, shaking.horizontal), ("UD", 7.2, shaking.vertical)
    for number in range(3):
        for name, begin, row in parts:
            rows = [f"{begin + 0.01 * k:.2f} {value:.5f}" for k, value in enumerate(row)]
            head = f"# 1990-01-{number + 1:02d} m/s2\n# time {name}\n"
            (tmp_path / f"r{number}.{name}").write_text(head + "\n".join(rows) + "\n")
    target = {"code": "EC8", "ag": 0.25, "ground": "B"}
    rule = replace(af.motion.SELECTION_RULES["EC8"], lower=0.0, zero_period=0.0)
    found = af.select_records(tmp_path, af.Eurocode8(0.25, "B"), 0.3, count=3, rule=rule)
    text = motion_keys.write_selected_suite(found, tmp_path, target)
    later = np.append(np.zeros(20), shaking.vertical)
    for record, pair in zip(
        found.records, build_suite(parse_suite(tomllib.loads(text)["suite"])).pairs, strict=True
    ):
        for motion in (record.motion.scaled(record.scale), pair):
            assert motion.vertical == pytest.approx(record.scale * later, abs=1e-4)
            assert motion.horizontal == pytest.approx(record.scale * shaking.horizontal, abs=1e-4)
    # a day later there is no time in common, and the files are left out with the reason
    (tmp_path / "r0.UD").write_text("# m/s2\n# time UD\n100.00 1.0\n100.01 -1.0\n100.02 0.0\n")
    with pytest.raises(af.InvalidInput, match=r"r0.NS: .*no time in common \(horizontal from 7 s"):
        af.select_records(tmp_path, af.Eurocode8(0.25, "B"), 0.3, count=3, rule=rule)


def test_a_motion_of_a_case_is_cut_and_then_rests():
    samples = {"samples": [1.0, 2.0, 3.0, 4.0], "dt": "0.01 s"}
    keys = {"end": "0.02 s", "rest": "0.02 s", "scale": 2.0}
    motion = build_motion(parse_motion(samples | keys))
    assert motion.horizontal.tolist() == [2.0, 4.0, 6.0, 0.0, 0.0]
