"""What the pictures of motions show, read back from the drawn lines."""

import numpy as np
import pytest

from archfem.errors import InvalidInput
from archfem.motion.design_spectra import TableSpectrum, Tbec2018
from archfem.motion.motion import Motion
from archfem.motion.spectra import response_spectrum
from archfem.motion.suite import Suite
from archfem.units import STANDARD_GRAVITY
from archfem.view import motions as view


@pytest.fixture(scope="module")
def shaking():
    return Motion.synthetic(duration=6.0, seed=1, pga=2.0)


def test_accelerogram_shows_all_components_and_integrals(shaking, tmp_path):
    figure = view.draw_motion(shaking)
    axes = figure.get_axes()
    assert len(axes) == 6
    drawn = axes[0].get_lines()[0].get_ydata()
    assert np.abs(drawn).max() == pytest.approx(2.0 / STANDARD_GRAVITY)
    assert axes[4].get_lines()[0].get_ydata() == pytest.approx(shaking.displacement())
    figure.savefig(tmp_path / "motion.png")
    assert (tmp_path / "motion.png").stat().st_size > 10_000


def test_spectra_show_horizontal_and_vertical(shaking):
    figure = view.draw_spectra([shaking, shaking.with_vertical(None)])
    level, upright = figure.get_axes()
    assert len(level.get_lines()) == 2
    assert len(upright.get_lines()) == 1
    expected = response_spectrum(shaking, view.PERIODS) / STANDARD_GRAVITY
    assert level.get_lines()[0].get_ydata() == pytest.approx(expected)
    with pytest.raises(InvalidInput, match="no motion"):
        view.draw_spectra([])


def test_suite_spectra_show_mean_and_target(shaking):
    suite = Suite("two", (shaking, shaking.scaled(3.0)), reduction=3.0)
    target = Tbec2018(ss=1.0, s1=0.3, site="ZC")
    level, upright = view.draw_suite(suite, target).get_axes()
    first, _, mean, aim = (line.get_ydata() for line in level.get_lines())
    assert mean == pytest.approx(2.0 * first)
    assert aim == pytest.approx(target.horizontal(view.PERIODS))
    assert upright.get_lines()[-1].get_ydata() == pytest.approx(target.vertical(view.PERIODS))


def test_target_is_drawn_where_it_is_defined(shaking):
    target = TableSpectrum([0.1, 1.0], [1.0, 0.5])
    level, upright = view.draw_suite(Suite("one", (shaking,)), target).get_axes()
    periods, values = level.get_lines()[-1].get_data()
    assert 0.1 <= periods.min() < 0.11
    assert 0.95 < periods.max() <= 1.0
    assert values == pytest.approx(target.horizontal(periods))
    assert len(upright.get_lines()[-1].get_xdata()) == 0


def test_more_motions_than_colours_differ_in_their_dashes(shaking):
    figure = view.draw_spectra([shaking.with_vertical(None)] * 7)
    (axes,) = figure.get_axes()
    first, last = axes.get_lines()[0], axes.get_lines()[6]
    assert first.get_color() == last.get_color()
    assert first.get_linestyle() != last.get_linestyle()
    assert axes.get_title() == "horizontal or only component"
