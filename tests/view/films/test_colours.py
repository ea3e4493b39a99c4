"""Quantities by which blocks are coloured, their units, and their scales."""

import numpy as np
import pytest

import archfem as af
from archfem.view.films.settings import colour_values, fit_scale


def test_colours_are_millimetres_and_megapascals(coarse):
    """The crown carries its thrust: mean stress N / A, and more of it in the least principal."""
    dead = af.dead_load(coarse)
    lengths = np.linalg.norm(coarse.cells.displacement(dead.q), axis=1)
    assert colour_values(coarse.cells, dead.q, "displacement") == pytest.approx(1e3 * lengths)
    stress = colour_values(coarse.cells, dead.q, "stress")[coarse.cells.owner == 9]
    thrust = float(dead.joints["N"][8]) / (0.55 * 1.0) / 1e6
    assert stress.max() <= 1e-6
    assert stress.mean() == pytest.approx(-thrust, rel=0.05)


def test_scales_have_units_and_span_the_film(coarse):
    fields = np.array([af.dead_load(coarse).q])
    scale = fit_scale(coarse.cells, fields, "displacement")
    assert scale.label.endswith("[mm]")
    assert scale.norm.vmax == pytest.approx(
        colour_values(coarse.cells, fields[0], "displacement").max()
    )
    scale = fit_scale(coarse.cells, fields, "stress")
    assert scale.label.endswith("[MPa]")
    assert scale.norm.vmin < scale.norm.vmax == 0.0
