"""The dead load in a picture has its numbers beside it."""

import re

import pytest

import archfem as af
from archfem.view import draw_dead_load


@pytest.mark.parametrize("heights", [[0.8, 0.8], [0.8, 0.8, 0.4]])
def test_numbers_of_a_column_are_the_weights_above(heights):
    """Stones of the default density: N at the base is the weight of all."""
    stones = af.column(breadth=0.4, heights=heights)
    dead = af.dead_load(af.build(stones, fidelity="rigid"))
    page = draw_dead_load(dead)
    heavy = stones.weight / 1e3
    light = heavy * heights[-1] / sum(heights)
    title = " ".join(page.axes[0].get_title().split())
    assert f"weight {heavy:.4g} kN" in title
    assert f"N from {light:.3g} to {heavy:.3g} kN" in title
    legend = " ".join(text.get_text() for text in page.legends[0].get_texts())
    assert f"largest N = {heavy:.3g} kN" in re.sub(r"\s+", " ", legend)


def test_a_force_beyond_a_meganewton_is_written_without_a_power_of_ten():
    stones = af.column(breadth=3.0, heights=[20.6], width=9.6)  # 11 866 kN
    page = draw_dead_load(af.dead_load(af.build(stones, fidelity="rigid")))
    assert "N from 11900 to 11900 kN" in " ".join(page.axes[0].get_title().split())
    assert any("largest N = 11900 kN" in text.get_text() for text in page.legends[0].get_texts())


def test_letters_stand_at_the_joints_of_the_legend(ring):
    page = draw_dead_load(af.dead_load(af.build(ring, fidelity="rigid")))
    letters = {text.get_text() for text in page.axes[0].texts}
    legend = [text.get_text() for text in page.legends[0].get_texts()]
    assert letters == {"a", "b"}
    assert sum(each.startswith("joint ") for each in legend) == 2
