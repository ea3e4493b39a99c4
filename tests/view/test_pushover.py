"""The picture of a pushover: curves, hinges in order, limits."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

import archfem as af
from archfem.view import draw_pushover
from archfem.view.statics import _merge_close_discs

RING = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
MODEL = af.build(RING, fidelity="rigid", quadrature="lobatto")
"""Its points at the faces let a hinge be reached, which exact joints only come near to."""


@pytest.fixture(scope="module")
def push():
    return af.pushover(MODEL, af.BodyForce(1.0))


def test_curve_hinges_and_limit_are_drawn(push):
    figure = draw_pushover({"sideways": push}, limits={"limit analysis": 0.457})
    axes = figure.axes[0]
    curve = next(line for line in axes.lines if line.get_label() == "sideways")
    np.testing.assert_allclose(curve.get_ydata(), push.curve["factor"])
    np.testing.assert_allclose(curve.get_xdata(), 1e3 * push.curve["displacement"])
    words = [text.get_text() for text in axes.texts]
    (limit,) = [line for line in axes.lines if line.get_label() == "limit analysis: 0.457"]
    assert set(limit.get_ydata()) == {0.457}
    (label,) = [word for word in words if "extrados" in word]
    assert label.splitlines()[0] == "1  joint 6, extrados"
    assert len(label.splitlines()) == len(set(push.hinge_steps))
    figure.draw_without_rendering()


def test_long_names_of_joints_are_listed_below_the_curve(push):
    names = [f"course {k}, stone {k} to course {k}, stone {k + 1}" for k in range(18)]
    joints = push.joints.assign_coords(name=("joint", names))
    axes = draw_pushover(replace(push, joints=joints)).axes[0]
    words = [text.get_text() for text in axes.texts]
    assert not any("extrados" in word for word in words)
    (label,) = [each for each in axes.get_legend_handles_labels()[1] if "extrados" in each]
    assert label.splitlines()[0] == f"1  {names[6]}, extrados"


def test_several_curves_keep_their_discs_and_lose_the_words(push):
    other = af.pushover(MODEL, af.BodyForce(-1.0))
    axes = draw_pushover({"right": push, "left": other}).axes[0]
    assert not axes.texts
    discs = [line for line in axes.lines if line.get_marker() == "o" and len(line.get_xdata())]
    assert len(discs) == len({*push.hinge_steps}) + len({*other.hinge_steps})


@pytest.mark.parametrize("softens", [False, True])
def test_a_curve_is_shown_up_to_its_plateau_and_as_a_whole_where_it_has_none(push, softens):
    """From 1 mm on it keeps 98% of its factor, or loses it at a constant rate to 10 mm."""
    displacement = np.array([0.0, 0.5, 1.0, *range(2, 11)])
    factor = np.minimum(displacement, 1.0)
    factor[3:] -= softens * 0.09 * np.arange(1, 10)
    curve = push.curve.isel(step=slice(len(factor)))
    curve = curve.assign(
        factor=("step", factor, curve["factor"].attrs),
        displacement=("step", 1e-3 * displacement, curve["displacement"].attrs),
    )
    hinges, steps = push.hinges[:2], (2, 10 if softens else 2)
    pushed = replace(push, curve=curve, hinges=hinges, hinge_steps=steps)
    axes = draw_pushover(pushed).axes[0]
    left, right = axes.get_xlim()
    assert (left, right) == (0.0, pytest.approx(10.4 if softens else 1.3))
    discs = [line for line in axes.lines if line.get_marker() == "o" and len(line.get_xdata())]
    assert len(discs) == len({*steps})


def test_the_axis_of_a_settlement_names_its_quantity():
    push = af.pushover(MODEL, af.Settlement("left abutment", (-1.0, 0.0, 0.0)))
    assert "settlement" in draw_pushover({"spread": push}).axes[0].get_ylabel()


def test_hinges_are_in_order_and_depend_on_their_criterion(push):
    assert list(push.hinge_steps) == sorted(push.hinge_steps)
    strict = af.pushover(MODEL, af.BodyForce(1.0), criteria=af.Criteria(hinge=0.4999))
    assert set(strict.hinges) <= set(push.hinges)
    assert max(strict.hinge_steps) >= max(push.hinge_steps)


def test_one_to_six_curves_fit_a_picture(push):
    for pushes in ({}, {str(k): push for k in range(7)}):
        with pytest.raises(af.InvalidInput, match="give 1 to 6"):
            draw_pushover(pushes)


def test_discs_that_are_near_share_a_label():
    axes = Figure().subplots()
    axes.set(xlim=(0.0, 100.0), ylim=(0.0, 1.0))
    runs = _merge_close_discs(
        [(1.0, 0.4), (20.0, 0.5), (21.0, 0.5), (23.0, 0.5), (60.0, 0.6)], axes
    )
    assert [run[:2] for run in runs] == [(1, 1), (2, 4), (5, 5)]
