"""A study in one picture: medians, ranges, and unreached capacities."""

from itertools import pairwise

import numpy as np
import pytest
import xarray as xr

import archfem as af
from archfem.dynamics.collapse_state import CollapseState
from archfem.dynamics.history import Ending
from archfem.dynamics.motion_scaling import CollapseScale
from archfem.dynamics.scale_search import MechanismScales, ScaledRun
from archfem.view import draw_findings, draw_study
from archfem.view.verdicts import draw_scale

FOUND = {
    "weak": {"four joints": np.array([0.3, 0.5, 0.9]), "moves": np.array([0.8, 1.2, np.inf])},
    "strong": {"four joints": np.array([0.6, 0.7, 2.0]), "moves": np.full(3, np.inf)},
}


def lines(axes, marker):
    """Points drawn with a marker, by height."""
    found = [line.get_xydata() for line in axes.lines if line.get_marker() == marker]
    return np.concatenate(found)


def test_medians_are_marks_and_unreached_capacities_are_arrows():
    axes = draw_study(FOUND, reduction=3.0).axes[0]
    assert sorted(lines(axes, "o")[:, 0]) == pytest.approx([0.5, 0.7, 1.2])
    ((place, row),) = lines(axes, ">")
    assert place == pytest.approx(1.3 * 2.0)
    assert round(row) == 1
    assert [text.get_text() for text in axes.get_yticklabels()] == ["weak", "strong"]


def test_the_level_of_the_reduced_motions_is_named_where_it_is_another():
    for reduction, named in (
        (1.0, {"unscaled": 1.0}),
        (4.0, {"unscaled": 1.0, "1 / R, R = 4": 0.25}),
    ):
        axes = draw_study(FOUND, reduction).axes[0]
        assert {text.get_text(): text.xy[0] for text in axes.texts} == named


def test_definitions_by_which_nothing_fails_have_no_sign():
    """That of a ring and a pier, where there are no piers; the others are explained."""
    many = {
        "ring": {
            "any joints at once": np.array([0.5, 2.0]),
            "ring and pier at once": np.full(2, np.inf),
        }
    }
    page = draw_study(many, title="a $ study")
    legend = [text.get_text() for text in page.legends[0].get_texts()]
    assert legend == ["enough joints fail at once", "median, and range of the pairs"]
    assert "first mechanism" in page.legends[0].get_title().get_text()


def test_points_that_differ_in_one_number_are_joined_and_coloured_by_the_case():
    table = xr.Dataset(
        {
            "factor": (("case", "width"), [[0.4, 0.5, np.inf], [0.6, 0.7, 0.8]]),
            "error": (("case", "width"), np.full((2, 3), "", dtype=object)),
        },
        {"case": ["thin", "thick"], "width": ("width", [1.0, 2.0, 3.0], {"units": "m"})},
    )
    over_case, over_width = draw_findings(table).axes
    assert over_width.get_xlabel() == "width [m]"
    assert over_case.get_ylabel() == "factor"
    assert [line.get_ydata().tolist() for line in over_width.lines] == [[0.4, 0.5], [0.6, 0.7, 0.8]]
    named = [text.get_text() for text in over_width.get_legend().get_texts()]
    assert named == ["thin", "thick"]
    # 0.35 m from 35 cm has a digit of rounding
    third = {"case": ["thin", "thick"], "width": [0.35000000000000003, 0.4, 0.5]}
    legend = draw_findings(table.assign_coords(third)).axes[0].get_legend()
    assert [text.get_text() for text in legend.get_texts()] == ["0.35", "0.4", "0.5"]
    assert [text.get_text() for text in over_case.get_xticklabels()] == ["thin", "thick"]
    assert all(line.get_linestyle() == "None" for line in over_case.lines)
    with pytest.raises(af.InvalidInput, match="no finding is a number"):
        draw_findings(table[["error"]])


def test_cases_alone_are_bars_beside_their_names():
    """A panel for each finding, in rows of three; a dashed line is at the first case."""
    values = {f"finding {k}": ("case", [1.0 + k, 1.1 + k]) for k in range(4)}
    values["slip"] = "case", [0.01, np.inf], {"units": "m"}
    values["drift"] = "case", [-1.0, 1.0]
    values["same"] = "case", [2.0, 2.0]
    table = xr.Dataset(values, {"case": ["thin", "thick"]})
    panels = draw_findings(table.drop_vars("slip")).axes
    assert [axes.get_xlabel() for axes in panels] == [*(f"finding {k}" for k in range(4)), "drift"]
    for axes, name in zip(panels, [*(f"finding {k}" for k in range(4)), "drift"], strict=True):
        assert [bar.get_width() for bar in axes.patches] == table[name].values.tolist()
        assert [line.get_xdata()[0] for line in axes.lines] == [table[name].values[0]]
    assert [text.get_text() for text in panels[0].get_yticklabels()] == ["thin", "thick"]
    assert panels[0].get_ylim()[0] > panels[0].get_ylim()[1]  # the first one is on top
    assert panels[0].get_xlim()[0] == 0.0
    assert panels[0].get_position().y0 > panels[3].get_position().y0
    assert len(draw_findings(table, max_panels=2).axes) == 2
    table["slip"] = "case", [0.01, 0.02], {"units": "m"}
    assert "slip [m]" in [axes.get_xlabel() for axes in draw_findings(table).axes]


def test_cases_under_several_motions_are_dots_beside_their_names():
    """A colour for each motion; a fall of metres leaves millimetres legible."""
    names = [f"case {k}" for k in range(14) for _ in range(2)]
    moved = np.array([*np.linspace(0.0005, 0.004, 27), 1.7])
    table = xr.Dataset(
        {"moved": ("point", moved, {"units": "m"})},
        {"case": ("point", names), "pair": ("point", ["first", "second"] * 14)},
    )
    figure = draw_findings(table)
    (axes,) = figure.axes
    assert [text.get_text() for text in axes.get_yticklabels()] == [*dict.fromkeys(names)]
    assert [line.get_xdata().tolist() for line in axes.lines] == [
        moved[::2].tolist(),
        moved[1::2].tolist(),
    ]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["first", "second"]
    assert axes.get_xscale() == "log"
    (near,) = draw_findings(table.isel(point=slice(26))).axes
    assert near.get_xscale() == "linear"


def test_names_of_many_ratings_do_not_overlap():
    """Only the factors have panels, with a line at 1."""
    names = [f"mobilisation {k}, dispersal uniform, 1 in 2" for k in range(14)]
    factors = 2.0 + 0.1 * np.arange(14)
    table = xr.Dataset(
        {
            "position": ("case", factors),
            "factor": ("case", factors),
            "without_pressure": ("case", factors),
        },
        {"case": names},
    )
    pushed = draw_findings(table.drop_vars(["position", "without_pressure"]))
    assert [line.get_xdata()[0] for line in pushed.axes[0].lines] == [2.0]
    figure = draw_findings(table)
    assert [axes.get_xlabel() for axes in figure.axes] == ["factor", "without_pressure"]
    assert [line.get_xdata()[0] for line in figure.axes[0].lines] == [2.0, 1.0]
    figure.draw_without_rendering()
    boxes = [text.get_window_extent() for text in figure.axes[0].get_yticklabels()]
    assert not any(first.overlaps(second) for first, second in pairwise(boxes))
    assert min(box.x0 for box in boxes) >= 0.0


def test_a_figure_of_scales_has_the_runs_of_all_steps():
    """Colours are steps, marks outcomes; those of steps that were too long are among them."""
    made = {}
    for dt, scale in ((0.01, 2.0), (0.005, 2.1)):
        runs = [
            ScaledRun(at, {}, Ending.FINISHED, "", CollapseState(kind, None, (), 0.1, size, True))
            for at, kind, size in ((1.0, "stands", 0.01), (scale, "fallen", 7.0))
        ]
        made[dt] = MechanismScales(("collapse",), tuple(runs))
    found = CollapseScale({0.005: made[0.005]}, longer={0.01: made[0.01]})
    figure = draw_scale(found, 0.04)
    places = [(*line.get_xdata(), *line.get_ydata()) for line in figure.axes[0].lines]
    assert places[:4] == [(1.0, 10.0), (2.0, 120.0), (1.0, 10.0), (2.1, 120.0)]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        *("10 ms", "5 ms", "stands", "fallen", "limit of dislocation")
    ]
