"""Incremental dynamic analysis and fragility: positions of drawn objects."""

import numpy as np
import pytest

import archfem as af
from archfem.view import draw_fragility, draw_ida


def test_curves_turn_back_and_unreached_capacities_are_arrows():
    curves = [
        ("a", np.array([1.0, 2.0, 3.0]), np.array([0.1, 0.3, 0.2])),
        ("b", np.array([1.0, 2.0]), np.array([0.2, np.inf])),
    ]
    capacities = {"verified": (np.array([1.0, 2.0]), np.array([1.1, np.inf]))}
    figure = draw_ida(curves, capacities, fractiles=(np.array([1.0]), np.array([[0.1]] * 3)))
    left, right = figure.axes
    turned = left.lines[0].get_xydata()
    assert turned.tolist() == [[0.0, 0.0], [0.1, 1.0], [0.3, 2.0], [0.2, 3.0]]
    assert len(left.texts) == 1  # the arrow of the one that broke off
    (beyond,) = (line for line in right.lines if line.get_marker() == "^" and len(line.get_xdata()))
    assert beyond.get_ydata().tolist() == [2.0]
    (bracket,) = right.collections
    assert bracket.get_segments()[0][:, 1].tolist() == [1.0, 1.1]
    named = [text.get_text() for text in figure.legends[0].get_texts()]
    assert named == ["bracket of a motion", "not met up to here"]
    assert [text.get_text() for text in right.get_xticklabels()] == ["verified"]


def test_fragility_has_its_band_and_its_data():
    x = np.array([1.0, 2.0, 3.0])
    middle = np.array([0.1, 0.5, 0.9])
    figure = draw_fragility(
        {"verified": (middle, middle - 0.1, middle + 0.1)}, x, data={"verified": (x, middle)}
    )
    (axes,) = figure.axes
    assert axes.lines[0].get_ydata().tolist() == middle.tolist()
    assert axes.lines[1].get_marker() == "o"
    low = axes.collections[0].get_paths()[0].vertices[:, 1].min()
    assert np.isclose(low, 0.0)
    named = [text.get_text() for text in axes.get_legend().get_texts()]
    assert named == ["verified", "confidence band", "data of the fit"]


def test_fitted_curves_are_drawn_as_they_are():
    curve = af.studies.stripe_fragility([1.0, 2.0, 3.0], [1, 10, 19], [20, 20, 20])
    for given, name in ((curve, "limit state"), ({"verified": curve}, "verified")):
        (axes,) = draw_fragility(given).axes
        x, y = axes.lines[0].get_data()
        assert np.interp(curve.median, x, y) == pytest.approx(0.5, abs=1e-3)
        assert axes.get_legend().get_texts()[0].get_text() == name
    with pytest.raises(af.InvalidInput, match="give intensity, or a Fragility"):
        draw_fragility({"verified": (x, x, x)})


def test_a_median_and_brackets_alone_are_named_alone():
    low = np.array([1.0, 1.2, 1.5])
    (left, _) = draw_ida([("a", low, low)], {"collapse": (low + 5.0, low + 6.0)}).axes
    assert left.get_ylim()[1] > 7.5  # a fall has no demand: its bracket is above all curves
    figure = draw_ida([("a", low, low)], {"verified": (low, low + 0.1)})
    named = [text.get_text() for text in figure.legends[0].get_texts()]
    assert named == ["bracket of a motion", "median"]
    (axes,) = draw_fragility({"verified": (low, low, low)}, low).axes
    named = [text.get_text() for text in axes.get_legend().get_texts()]
    assert named == ["verified", "confidence band"]
