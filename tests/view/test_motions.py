"""Content of the pictures of motions, read back from the drawn lines."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

import archfem as af
from archfem.motion import Match
from archfem.view import draw_accelerograms, draw_motion, draw_spectra, draw_suite, limit_width


@pytest.fixture(scope="module")
def shaking():
    return af.Motion.synthetic(duration=6.0, seed=1, pga=2.0)


def test_accelerogram_shows_all_components_and_integrals(shaking, low_resolution, tmp_path):
    figure = draw_motion(shaking)
    axes = figure.get_axes()
    assert len(axes) == 6
    drawn = axes[0].get_lines()[0].get_ydata()
    assert np.abs(drawn).max() == pytest.approx(2.0 / af.units.STANDARD_GRAVITY)
    assert axes[4].get_lines()[0].get_ydata() == pytest.approx(shaking.displacement())
    figure.savefig(tmp_path / "motion.png")
    assert (tmp_path / "motion.png").stat().st_size > 10_000


def test_peaks_and_labels_of_a_half_page_cover_no_axis(shaking):
    """As a report draws it; a quantity stands once in its row."""
    with limit_width(84.0):
        figure = draw_motion(replace(shaking, horizontal=-np.abs(shaking.horizontal)))
    figure.draw_without_rendering()
    for axes in figure.axes:
        (peak,) = axes.texts
        assert "-" not in peak.get_text()
        assert peak.get_window_extent().y0 > axes.bbox.y0
    labels = [axes.yaxis.label for axes in figure.axes]
    assert [bool(label.get_text()) for label in labels] == [True, False] * 3
    boxes = [label.get_window_extent() for label in labels[::2]]
    assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))


def test_spectra_show_horizontal_and_vertical(shaking):
    figure = draw_spectra([shaking, shaking.with_vertical(None)])
    level, upright = figure.get_axes()
    assert len(level.get_lines()) == 2
    assert len(upright.get_lines()) == 1
    periods = np.geomspace(0.02, 3.0, 150)
    expected = af.response_spectrum(shaking, periods) / af.units.STANDARD_GRAVITY
    assert level.get_lines()[0].get_ydata() == pytest.approx(expected)
    with pytest.raises(af.InvalidInput, match="no motion"):
        draw_spectra([])


def test_suite_spectra_show_mean_and_target(shaking):
    suite = af.Suite("two", (shaking, shaking.scaled(3.0)), reduction=3.0)
    target = af.Tbec2018(ss=1.0, s1=0.3, site="ZC")
    level, upright = draw_suite(suite, target).get_axes()
    periods = np.geomspace(0.02, 3.0, 150)
    first, _, mean, aim = (line.get_ydata() for line in level.get_lines())
    assert mean == pytest.approx(2.0 * first)
    assert aim == pytest.approx(target.horizontal(periods))
    assert upright.get_lines()[-1].get_ydata() == pytest.approx(target.vertical(periods))


def test_accelerograms_of_a_suite_share_one_scale(shaking):
    """Each is its acceleration before division by R, from a baseline of its own."""
    pairs = (shaking, shaking.scaled(0.5).with_vertical(None))
    figure = draw_accelerograms(af.Suite("two", pairs, scale=2.0, reduction=3.0))
    level, upright = figure.get_axes()
    places = dict(zip(["first", "second"], level.get_yticks(), strict=True))
    for line, pair, base in zip(level.get_lines(), pairs, places.values(), strict=False):
        drawn = (line.get_ydata() - base) * af.units.STANDARD_GRAVITY
        assert drawn == pytest.approx(2.0 * pair.horizontal)
    assert len(upright.get_lines()) == 1
    assert level.get_ylim() == upright.get_ylim()
    # peaks of two neighbours in opposite directions do not meet
    peak = 4.0 / af.units.STANDARD_GRAVITY
    assert places["first"] - places["second"] > 1.5 * peak
    assert [text.get_text() for text in level.texts] == [f"{peak:.2f} g", f"{peak / 2:.2f} g"]
    assert figure.get_suptitle() == "two, before division by R = 3"


def test_spectra_say_that_they_are_not_yet_divided(shaking):
    for reduction, title in ((3.0, "one, before division by R = 3"), (1.0, "one")):
        suite = af.Suite("one", (shaking,), reduction=reduction)
        assert draw_suite(suite).get_suptitle() == title


def test_target_is_drawn_where_it_is_defined(shaking):
    target = af.motion.TableSpectrum([0.1, 1.0], [1.0, 0.5])
    level, upright = draw_suite(af.Suite("one", (shaking,)), target).get_axes()
    periods, values = level.get_lines()[-1].get_data()
    assert 0.1 <= periods.min() < 0.11
    assert 0.95 < periods.max() <= 1.0
    assert values == pytest.approx(target.horizontal(periods))
    assert len(upright.get_lines()[-1].get_xdata()) == 0


def test_more_motions_than_colours_differ_in_their_dashes(shaking):
    figure = draw_spectra([shaking.with_vertical(None)] * 7)
    (axes,) = figure.get_axes()
    first, last = axes.get_lines()[0], axes.get_lines()[5]
    assert first.get_color() == last.get_color()
    assert first.get_linestyle() != last.get_linestyle()
    assert axes.get_title() == "horizontal or only component"


def test_the_matched_band_is_shaded():
    shaking = af.Motion.synthetic(duration=5.0, seed=1)
    match = Match(shaking, {"horizontal": 0.02}, {}, {}, (0.1, 1.5))
    suite = af.Suite("one", (shaking,), matches=(match,))
    legend = [text.get_text() for text in draw_suite(suite).legends[0].get_texts()]
    assert "matched, 0.1 to 1.5 s" in legend


def test_mean_and_target_of_a_suite_have_colours_of_their_own(shaking):
    suite = af.Suite("six", tuple(shaking.scaled(k) for k in range(1, 7)))
    level, _ = draw_suite(suite, af.Tbec2018(ss=1.0, s1=0.3, site="ZC")).get_axes()
    *pairs, mean, target = (line.get_color() for line in level.get_lines())
    assert len(pairs) == 6
    assert len({mean, target, *pairs}) == 2 + len(set(pairs))


def test_selection_shows_records_mean_target_and_bounds(tmp_path):
    for seed in range(3):
        motion = af.Motion.synthetic(duration=2.0, seed=seed, dt=0.02, vertical_ratio=0.0)
        samples = motion.horizontal / af.units.STANDARD_GRAVITY
        rows = "\n".join(f"{sample:.6f}" for sample in samples)
        head = f"PEER\nQuake, {seed + 1}/1/1990, A, 180\nUNITS OF G\nNPTS= 101, DT= .0200 SEC\n"
        (tmp_path / f"{seed}180.AT2").write_text(f"{head}{rows}\n")
    rule = replace(af.motion.SELECTION_RULES["NTC-2018"], lower=0.2, upper=4.0)
    target = af.Eurocode8(0.2, "B")
    found = af.select_records(tmp_path, target, 0.3, count=3, rule=rule)
    (axes,) = found.plot().get_axes()
    *records, mean, aim, low, high = axes.get_lines()
    assert len(records) == 3
    drawn = np.mean([line.get_ydata() for line in records], axis=0)
    assert mean.get_ydata() == pytest.approx(drawn)
    expected = found.suite().spectra(records[0].get_xdata()) / af.units.STANDARD_GRAVITY
    assert records[1].get_ydata() == pytest.approx(expected[1])
    assert aim.get_ydata() == pytest.approx(target.horizontal(aim.get_xdata()))
    assert low.get_ydata() == pytest.approx(0.2 * aim.get_ydata())
    assert high.get_ydata() == pytest.approx(4.0 * aim.get_ydata())
