"""Incremental dynamic analysis: brackets, curves, and their summaries."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import trapezoid

import archfem as af
from archfem import ida
from archfem.dynamics.collapse_state import FALLEN_STATES
from archfem.dynamics.scale_search import MechanismScales
from archfem.studies import ida as ida_module
from archfem.studies.cache import dead_load_of
from archfem.studies.evaluators import run_motion


def made(count):
    motion = {"duration": 0.6, "pga": 9.0}
    return [{"synthetic": {"seed": seed, **motion}} for seed in range(1, count + 1)]


@pytest.fixture(scope="module")
def small_ida(tmp_path_factory):
    """Two motions on a rigid ring of seven stones."""
    case = af.Case.of(
        {
            "structure": {
                "shape": "circular_arch",
                "radius": 3.0,
                "thickness": 0.35,
                "embrace": 150.0,
                "voussoirs": 7,
            },
            "model": {"fidelity": "rigid"},
            "analysis": {"dt": 0.01, "damping": {"ratio": 0.05, "frequency": 8.0}},
        }
    )
    folder = tmp_path_factory.mktemp("ida")
    return (
        case,
        folder,
        af.ida(case, made(2), precision=0.2, between=(0.3, 2.5), folder=folder, workers=1),
    )


def test_brackets_agree_with_runs_at_their_ends(small_ida):
    case, _, found = small_ida
    assert found.limits == ("first hinge", "four failures", "verified")
    motion = af.Motion.synthetic(seed=2, duration=0.6, pga=9.0)
    dead = af.cases.dead_load_of_case(case)
    for limit, key in (("four failures", "any joints at once"), ("verified", "verified")):
        for end, met in ((f"{limit}, survives", False), (limit, True)):
            scale = float(found.table[end].sel(motion="seed 2"))
            run = af.cases.run_time_history(case, motion.scaled(scale), dead)
            assert (af.first_mechanisms(run)[key] is not None) == met
    for limit in found.limits:
        low, high = found.capacities(limit)
        assert (high / low <= 1.2).all()
        assert (found.table["first hinge"] <= found.table[limit]).all()


def test_runs_are_those_of_an_ensemble(small_ida):
    case, _, found = small_ida
    row = found.table.sel(motion="seed 2")
    scales = row["scale"].values[np.isfinite(row["scale"].values)]
    motion = af.Motion.synthetic(seed=2, duration=0.6, pga=9.0)
    runs = af.ensemble(case.analysis, motion, scales=scales.tolist()).dataset.isel(motion=0)
    # the same code from the same start: no bit may differ
    for name in ("eccentricity", "rotation", "slip"):
        assert np.array_equal(row[name].values[: len(scales)], runs[name].values)
    moved = row["largest_displacement"].values[: len(scales)]
    assert np.array_equal(moved, runs["displacement"].values)


def test_measures_grow_with_the_scale_by_their_definition(small_ida):
    _, _, found = small_ida
    motion = af.Motion.synthetic(seed=1, duration=0.6, pga=9.0)
    scale = float(found.table["verified"][0])
    period = float(found.table["period"][0])
    scaled = motion.scaled(scale)
    measures = {
        "pga": np.abs(scaled.horizontal).max(),
        "pgv": np.abs(scaled.velocity("horizontal")).max(),
        "sa": af.response_spectrum(scaled, [period])[0],
        "arias": np.pi / (2.0 * 9.80665) * trapezoid(scaled.horizontal**2, dx=scaled.dt),
    }
    for measure, value in measures.items():
        assert found.capacities("verified", measure)[1][0] == pytest.approx(value, rel=1e-9)
    sa = float(af.response_spectrum(motion, [period])[0])
    assert float(found.table["sa"][0]) == pytest.approx(sa)


def test_a_motion_alone_is_a_list_of_one(small_ida, monkeypatch):
    case, motion = small_ida[0], af.Motion.synthetic(duration=0.6, pga=9.0, seed=1)
    points = []

    def keep(study, *_, **__):
        points.append(study.points)

    monkeypatch.setattr(ida_module.Study, "run", keep)
    for given in (motion, [motion]):
        af.ida(case, given)
    assert points[0][0].changes == points[1][0].changes
    assert len(points[0]) == 1


def test_an_analysis_continues_where_it_ended(small_ida, monkeypatch):
    case, folder, found = small_ida

    def never(*_):
        raise AssertionError("searched again")

    monkeypatch.setattr("archfem.studies.process_pool.evaluate_serially", never)
    again = af.ida(case, made(2), precision=0.2, between=(0.3, 2.5), folder=folder, workers=1)
    assert again.table.identical(found.table)


@pytest.mark.parametrize("call", [pytest.param(2, marks=pytest.mark.slow), 4])
def test_each_run_is_kept_when_it_is_ended(small_ida, tmp_path, monkeypatch, call):
    case, _, found = small_ida
    runs, options = [], {"precision": 0.2, "between": (0.3, 2.5), "workers": 1}
    original = ida_module.run_motion

    def counted(result, motion, **options):
        runs.append(motion)
        if len(runs) == call:
            raise KeyboardInterrupt
        return original(result, motion, **options)

    monkeypatch.setattr(ida_module, "run_motion", counted)
    with pytest.raises(KeyboardInterrupt):
        af.ida(case, made(1), folder=tmp_path, **options)
    assert af.studies.status(tmp_path).runs == call - 1
    assert f"{call - 1} runs kept" in str(af.studies.status(tmp_path))
    again = af.ida(case, made(1), folder=tmp_path, **options)
    first = found.table.sel(motion=["seed 1"]).dropna("entry", how="all")
    assert len(runs) == first.sizes["entry"] + 1  # the run that was ended was begun twice
    assert again.table.drop_attrs().identical(first.drop_attrs())


def test_a_fractile_does_not_turn_back_where_a_motion_ends():
    """The strongest of three motions is run no further than 2: its demand is then unknown."""
    rows = {
        "pga": ("motion", [1.0, 1.0, 1.0]),
        "scale": (("motion", "entry"), [[1.0, 4.0], [1.0, 4.0], [1.0, 2.0]]),
        "rotation": (("motion", "entry"), [[1.0, 4.0], [2.0, 8.0], [10.0, 20.0]]),
    }
    found = af.studies.Ida(xr.Dataset(rows, {"motion": ["a", "b", "c"]}))
    low, middle, high = found.fractiles(np.array([1.0, 1.9, 2.1, 3.0, 4.0]))
    assert high[:2] == pytest.approx([10.0, 19.0])
    assert np.isinf(high[2:]).all()  # not 8, 12, 16: those of the motions that are left
    for fractile in (low, middle):
        assert (np.diff(fractile) > 0.0).all()


def test_fractiles_are_those_of_curves_drawn_by_hand():
    rows = {
        "pga": ("motion", [2.0, 2.0, 2.0]),
        "scale": (("motion", "entry"), [[0.5, 1.0, 2.0], [0.5, 1.0, np.nan], [0.5, 1.0, 2.0]]),
        "rotation": (
            ("motion", "entry"),
            [[1.0, 2.0, 4.0], [2.0, np.inf, np.nan], [3.0, 6.0, 5.0]],
        ),
        "verified": ("motion", [1.0, 1.0, np.inf]),
        "verified, survives": ("motion", [0.5, 0.5, 2.0]),
        "verified, survives above": ("motion", [0, 1, 0]),
    }
    found = af.studies.Ida(xr.Dataset(rows, {"motion": ["a", "b", "c"]}))
    half = found.fractiles(np.array([0.5, 1.0, 4.0, 9.0]))
    assert half[:, 0] == pytest.approx([0.5, 1.0, 1.5])  # halfway to the first run
    assert half[:, 1] == pytest.approx([1.0, 2.0, 3.0])
    assert half[:, 2] == pytest.approx([4.0, 5.0, np.inf])
    assert np.isnan(half[:, 3]).all()
    assert found.not_monotonic("verified") == ["b"]
    low, high = found.capacities("verified")
    assert (low.tolist(), high.tolist()) == ([1.0, 1.0, 4.0], [2.0, 2.0, np.inf])


def test_fractiles_are_the_median_and_a_standard_deviation_to_either_side():
    """Of 51 motions with demands 0 to 50: the 16th, 50th and 84th of a hundred."""
    rows = {
        "pga": ("motion", np.ones(51)),
        "scale": (("motion", "entry"), np.ones((51, 1))),
        "rotation": (("motion", "entry"), np.arange(51.0)[:, None]),
    }
    found = af.studies.Ida(xr.Dataset(rows, {"motion": [f"{k}" for k in range(51)]}))
    assert found.fractiles(np.array([1.0]))[:, 0] == pytest.approx([8.0, 25.0, 42.0])


@pytest.mark.parametrize(
    ("runs", "filled"),
    [
        ([1.0], []),
        ([1.0, 1.19], []),
        ([1.0, 1.21], [1.1]),
        ([1.0, 4.0, 4.5], [2.0, np.sqrt(2.0), np.sqrt(8.0), 2.0**0.25]),
        ([0.5, 1.0, 3.0], [np.sqrt(3.0), np.sqrt(0.5), 3.0**0.25, 3.0**0.75]),
    ],
)
def test_up_to_four_runs_fill_the_widest_gaps_of_a_curve(small_ring, monkeypatch, runs, filled):
    requested = {}

    def search(run_scaled, limits, precision, between):
        requested.update(precision=precision, between=between)
        scales = MechanismScales(limits)
        for scale in runs:
            scales = scales.with_run(run_scaled(scale))
        return scales

    reached = dict.fromkeys(ida_module.LIMIT_STATES, False)
    run = {
        "demands": dict.fromkeys(ida_module.DEMAND_LABELS, 1.0),
        "reached": reached,
        "fall": None,
    }
    ended = {"ending": "finished", "outcome": "reached the end"}
    monkeypatch.setattr(ida_module, "search_scales", search)
    monkeypatch.setattr(ida_module, "_run", lambda result, motion: run | ended)
    found = ida_module.search_limit_states(small_ring, None, 0.2, (0.3, 100.0))
    assert found["scale"] == pytest.approx(sorted([*runs, *filled]))
    # a peak of 3 m/s² may be scaled up to 5 g
    assert requested == {
        "precision": 0.2,
        "between": (0.3, pytest.approx(5.0 * 9.81 / 3.0, rel=1e-3)),
    }
    dead = af.cases.dead_load_of_case(small_ring)
    (frequency,) = af.modes(dead.model, 1, start=dead).frequencies
    assert found["period"] == pytest.approx(1.0 / frequency)


def test_pairs_of_a_suite_are_the_motions_where_none_are_given(small_ida):
    case, _, found = small_ida
    pairs = {"first": made(1)[0], "second": made(2)[1]}
    suite = af.Case.of({**case.settings, "suite": {"reduction": 2.0, "pairs": pairs}})
    few = {"precision": 0.5, "between": (2.0, 2.0), "limits": ["first hinge"], "workers": 1}
    halved = ida(suite, **few)
    assert halved.table["motion"].values.tolist() == ["first", "second"]
    assert halved.limits == ("first hinge",)
    assert halved.table["pga"].values == pytest.approx(0.5 * found.table["pga"].values)


def test_a_motion_is_that_of_its_table(small_ida):
    case, _, _ = small_ida
    motion = af.Motion.synthetic(seed=2, duration=0.6, pga=9.0)
    few = {"precision": 0.5, "between": (2.0, 2.0), "limits": ["first hinge"], "workers": 1}
    given = ida(case, [motion], **few).table
    same = ida(case, made(2)[1:], **few).table
    assert given["motion"].values.tolist() == [motion.name]
    for name in ("pga", "pgv", "arias", "first hinge", "rotation"):
        assert (given[name].values == same[name].values).all()
    unnamed = af.Motion(motion.horizontal, motion.dt)
    assert ida(case, [unnamed], **few).table["motion"].values.tolist() == ["motion 1"]


def test_invalid_analyses_are_refused(small_ring):
    with pytest.raises(af.InvalidInput, match="no motions were given"):
        ida(small_ring)
    with pytest.raises(af.InvalidInput, match="3 motions under 1 names"):
        ida(small_ring, made(1) * 3)
    with pytest.raises(af.InvalidInput, match="limits = 'colapse'"):
        ida(small_ring, made(1), limits=["colapse"])
    with pytest.raises(af.InvalidInput, match="a motion is a int"):
        ida(small_ring, [3])
    found = ida(small_ring, made(1), limits=["collapse"], workers=1)
    words = "1 without an answer, as InvalidInput: limit state 'collapse' cannot be met: collapse "
    assert f"{words}needs displacements = 'large'" in str(found)
    assert "collapse needs displacements = 'large'" in found.table["error"].item()


@pytest.mark.parametrize(
    "options",
    [
        {"precision": 0.0},
        {"between": (2.0, 0.5)},  # found hinges at its smaller end alone
        {"between": (-1.0, 2.0)},
        {"between": (float("nan"), 2.0)},
        {"between": (0.5, float("inf"))},
    ],
)
def test_ranges_without_a_search_are_refused(small_ring, options):
    motion = af.Motion.synthetic(duration=0.5, seed=1)
    with pytest.raises(af.InvalidInput, match=r"two scales above 0"):
        ida(small_ring, motion, **options)


@pytest.mark.slow
def test_collapse_is_that_of_whole_falls(small_ida):
    small, _, _ = small_ida
    analysis = replace(small.analysis, displacements="large")
    motion = af.Motion.synthetic(seed=1, duration=1.0, pga=8.0)
    options = {"precision": 0.2, "between": (0.8, 6.0), "workers": 1}
    found = af.ida(analysis, [motion], limits=["collapse"], **options)
    low, high = (end[0] / motion.pga for end in found.capacities("collapse"))
    whole = analysis.run(motion.scaled(high))
    assert whole.fall.kind in FALLEN_STATES
    assert analysis.run(motion.scaled(low)).fall.kind not in FALLEN_STATES
    # the search itself follows a fall no farther than it must
    result = dead_load_of(af.cases.case.case_of(analysis))
    brief = run_motion(result, motion.scaled(high), whole_fall=False)
    assert len(brief.dataset["fall_time"]) < len(whole.dataset["fall_time"])
    assert brief.fall.time == pytest.approx(whole.fall.time, abs=0.1)
