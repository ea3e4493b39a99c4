"""Tornado and convergence: positions of drawn objects."""

import numpy as np
import pytest

import archfem as af
from archfem.view import draw_convergence, draw_tornado


def test_the_most_important_property_is_at_the_top():
    figure = draw_tornado({"k_n": (0.9, 1.1), "k_s": (0.5, 1.2), "damping": (1.0, 1.01)}, 1.0)
    (axes,) = figure.axes
    assert [text.get_text() for text in axes.get_yticklabels()] == ["damping", "k_n", "k_s"]
    widths = [patch.get_width() for patch in axes.patches[-2:]]
    assert widths == pytest.approx([-0.5, 0.2])
    one_side = draw_tornado({"k_s": (1.1, 1.4)}, 1.0).axes[0].patches
    assert [patch.get_width() for patch in one_side] == pytest.approx([0.4, 0.1])


@pytest.mark.slow
def test_a_sensitivity_is_drawn_as_it_is():
    case = af.Case.of(
        {
            "structure": {"shape": "column", "breadth": 0.6, "heights": [0.5, 0.5]},
            "motion": {"synthetic": {"seed": 1, "duration": 0.5, "pga": 2.0}},
            "analysis": {"damping": {"ratio": 0.05, "frequency": 9.0}},
        }
    )
    found = af.mesh_sensitivity(case, "rotation", cells=(1, 2, 3), rules=[], rungs=[], workers=1)
    figure = draw_convergence(found)
    assert [axes.get_xlabel().split(":")[0] for axes in figure.axes] == ["mesh", "step"]
    assert figure.axes[0].get_ylabel() == "rotation"
    assert figure.axes[1].lines[0].get_ydata().tolist() == found.step.values.tolist()


def test_the_limit_is_at_size_zero():
    path = (np.array([4.0, 2.0, 1.0]), np.array([1.4, 1.2, 1.1]), 1.0, 0.05)
    figure = draw_convergence({"mesh": path, "step": path})
    for axes in figure.axes:
        assert axes.lines[0].get_xdata().tolist() == [4.0, 2.0, 1.0]
        (limit,) = (line for line in axes.lines if line.get_marker() == "D")
        assert (limit.get_xdata()[0], limit.get_ydata()[0]) == (0.0, 1.0)
