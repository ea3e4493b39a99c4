"""What the pictures of motions show, read back from the drawn lines."""

import numpy as np
import pytest

from archfem.codes import Tbec2018
from archfem.errors import InvalidInput
from archfem.motion import Motion
from archfem.spectra import response_spectrum
from archfem.suite import Suite
from archfem.units import STANDARD_GRAVITY
from archfem.view import motions as view


@pytest.fixture(scope="module")
def shaking():
    return Motion.synthetic(duration=6.0, seed=1, pga=2.0)


def test_accelerogram_shows_all_components_and_integrals(shaking, tmp_path):
    figure = view.accelerogram(shaking)
    axes = figure.get_axes()
    assert len(axes) == 6
    drawn = axes[0].get_lines()[0].get_ydata()
    assert np.abs(drawn).max() == pytest.approx(2.0 / STANDARD_GRAVITY)
    assert axes[4].get_lines()[0].get_ydata() == pytest.approx(shaking.displacement())
    figure.savefig(tmp_path / "motion.png")
    assert (tmp_path / "motion.png").stat().st_size > 10_000


def test_spectra_show_horizontal_and_vertical(shaking):
    figure = view.spectra([shaking, shaking.with_vertical(None)])
    level, upright = figure.get_axes()
    assert len(level.get_lines()) == 2
    assert len(upright.get_lines()) == 1
    expected = response_spectrum(shaking, view.PERIODS) / STANDARD_GRAVITY
    assert level.get_lines()[0].get_ydata() == pytest.approx(expected)
    with pytest.raises(InvalidInput, match="no motion"):
        view.spectra([])


def test_suite_spectra_show_mean_and_target(shaking):
    suite = Suite("two", (shaking, shaking.scaled(3.0)), reduction=3.0)
    target = Tbec2018(ss=1.0, s1=0.3, site="ZC")
    level, upright = view.suite_spectra(suite, target).get_axes()
    first, _, mean, aim = (line.get_ydata() for line in level.get_lines())
    assert mean == pytest.approx(2.0 * first)
    assert aim == pytest.approx(target.horizontal(view.PERIODS))
    assert upright.get_lines()[-1].get_ydata() == pytest.approx(target.vertical(view.PERIODS))
