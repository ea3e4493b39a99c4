"""Speed against error: settings that are tried and compared, by known runs."""

from itertools import pairwise
from time import process_time
from types import SimpleNamespace

import numpy as np
import pytest

import archfem as af
from archfem.dynamics import accuracy
from archfem.dynamics.accuracy import TimedRun, candidate_settings, compare_runs, reference_settings


@pytest.fixture
def settings(ring):
    return [*reference_settings(ring), *list(candidate_settings(ring, ("rigid", "faces")))[:4]]


def test_the_reference_is_the_finest_and_its_doubt_half_of_it(ring):
    labels = [each.label for each in reference_settings(ring)]
    assert labels == ["condensed 12×12 exact 1.25 ms", "condensed 6×6 exact 2.5 ms"]


def test_each_scene_is_tried_once(ring):
    """Three fidelities, meshes and steps by four rules; rigid stones and exact facets: no mesh."""
    labels = [each.label for each in candidate_settings(ring)]
    assert len(labels) == len(set(labels)) == 3 * (3 * 3 * 4) - 2 * 3
    assert labels[0] == "rigid 2×2 nodal 10 ms"
    assert [each for each in labels if each.startswith("rigid 1×1")] == [
        "rigid 1×1 exact 10 ms",
        "rigid 1×1 exact 5 ms",
        "rigid 1×1 exact 2.5 ms",
    ]
    assert labels[-1] == "condensed 8×8 exact 2.5 ms"


def test_errors_are_the_largest_difference_to_the_reference(settings):
    """The front has settings that none beats in both; the fastest within tolerance is chosen."""
    peaks = [[0.30, 0.2], [0.31, 0.2], [0.30, 0.25], [0.303, 0.2], None, [0.3, 0.202]]
    seconds = [9.0, 5.0, 0.5, 2.0, 0.0, 3.0]
    runs = [
        TimedRun(7, each, None if peak is None else np.array(peak))
        for each, peak in zip(seconds, peaks, strict=True)
    ]
    found = compare_runs(settings, runs, 10.0, 0.003)
    assert found.reference_error == pytest.approx(0.01)
    assert [each.error for each in found.trials] == pytest.approx([0.05, 0.003, np.inf, 0.002])
    assert [each.seconds for each in found.front] == [0.0, 0.5, 2.0, 3.0]
    assert found.choice.seconds == 3.0  # 0.303 - 0.3 rounds to more than the tolerance
    assert compare_runs(settings, runs, 10.0, 0.0031).choice.seconds == 2.0
    assert compare_runs(settings, runs, 10.0, 0.001).choice is None
    fastest, second, *_ = found.table().splitlines()[-4:]
    assert "failed" in fastest
    assert "20" in second.split()
    with pytest.raises(af.DidNotConverge, match=r"the reference, condensed 12×12 exact 1\.25 ms"):
        compare_runs(settings, [TimedRun(7, 1.0, None), *runs[1:]], 10.0, 0.003)


@pytest.mark.parametrize(
    "longest",
    [0.4, pytest.param(9.0, marks=pytest.mark.slow), pytest.param(300.0, marks=pytest.mark.slow)],
)
def test_labels_of_computing_times_stay_apart(settings, longest):
    """Numbers of seconds, over one decade up to four; the setting that was chosen is named."""
    seconds = [0.05, longest, 0.06, 0.1, 0.2, longest]
    errors = [0.30, 0.31, 0.302, 0.32, 0.34, 0.301]
    runs = [TimedRun(7, s, np.array([e])) for s, e in zip(seconds, errors, strict=True)]
    found = compare_runs(settings, runs, 10.0, 0.003)
    figure = af.view.draw_accuracy(found)
    figure.draw_without_rendering()
    (axes,) = figure.axes
    low, high = axes.get_xlim()
    ticks = axes.xaxis.get_major_ticks()
    seen = [tick.label1 for tick in ticks if low <= tick.get_loc() <= high]
    boxes = [label.get_window_extent() for label in seen if label.get_text()]
    assert len(boxes) >= 2
    assert all(left.x1 + 2.0 < right.x0 for left, right in pairwise(boxes))
    assert not any(tick.label1.get_text() for tick in axes.xaxis.get_minor_ticks())
    assert f"chosen:\n{found.choice.setting.label}" in axes.get_legend_handles_labels()[1]


@pytest.mark.parametrize("fails", [False, True])
def test_no_more_time_is_reported_than_has_passed(stack, fails, monkeypatch):
    model = af.build(stack, fidelity="rigid")
    motion = af.Motion.synthetic(duration=0.3, pga=0.5, seed=1)
    if fails:

        def failing(model, motion, **options):
            if motion.duration > 0.01:  # not the two steps beforehand
                raise af.DidNotConverge("made to fail")
            return af.time_history(model, motion, **options)

        monkeypatch.setattr(accuracy, "time_history", failing)
    begun = process_time()
    run = accuracy.time_run(model, motion, 0.001)  # two steps are less than one of the motion
    assert 0.0 <= run.seconds <= process_time() - begun
    assert (run.peaks is None) is fails
    assert run.size == 6


def test_an_interrupted_run_ends_the_comparison(monkeypatch, stack):
    model = af.build(stack, fidelity="rigid")
    run = SimpleNamespace(ending=af.dynamics.Ending.INTERRUPTED)
    monkeypatch.setattr(accuracy, "time_history", lambda *_, **given: run)
    with pytest.raises(KeyboardInterrupt):
        accuracy.time_run(model, af.Motion.synthetic(duration=0.25), 0.005)
