"""Pictures of surveyed points against circles."""

import numpy as np
import pytest

import archfem as af
from archfem.view import draw_circle_fit


def test_distances_of_points_are_drawn_over_their_angles():
    """Points 4 mm outside and inside a circle of 2 m in turn, about a centre at (1, -0.5)."""
    angles = np.radians(np.linspace(-70.0, 70.0, 36))
    offsets = 4e-3 * np.tile([1.0, -1.0], 18)
    # offsets that no change of the circle can take up, to first order
    modes = np.stack([np.ones(36), np.sin(angles), np.cos(angles)], axis=1)
    offsets -= modes @ np.linalg.lstsq(modes, offsets, rcond=None)[0]
    radii = 2.0 + offsets
    points = np.array([1.0, -0.5]) + radii[:, None] * np.stack([np.sin(angles), np.cos(angles)], 1)
    above, below = draw_circle_fit({"survey": points, "turned": points[::-1]}).axes
    drawn = {line.get_color(): line for line in below.lines if line.get_marker() == "o"}
    first, second = drawn.values()
    # a shift of the circle changes distances by terms of second order, 4 mm squared over 2 m
    assert first.get_ydata() == pytest.approx(1e3 * offsets, abs=0.02)
    assert first.get_xdata() == pytest.approx(np.degrees(angles), abs=0.01)
    assert second.get_xdata() == pytest.approx(first.get_xdata()[::-1], abs=0.01)
    (text, _) = above.get_legend_handles_labels()[1]
    assert text == f"survey: R = 2.000 m, rms {1e3 * np.sqrt(np.mean(offsets**2)):.2f} mm"
    arc, dots = above.lines[0].get_xydata(), above.lines[1].get_xydata()
    assert np.linalg.norm(arc - [1.0, -0.5], axis=1) == pytest.approx(2.0, abs=1e-4)
    assert dots == pytest.approx(points)


def test_rings_of_a_structure_are_on_their_circles(bridge):
    """Built on circles: the clear radius of each is that of its intrados, without round-off."""
    above, below = draw_circle_fit(bridge).axes
    labels = above.get_legend_handles_labels()[1]
    radius = 4.71 / 2.0 / np.sin(np.radians(157.0 / 2.0)) - 0.527 / 2.0
    assert labels[0] == f"north arch: R = {radius:.3f} m, rms 0.00 mm"
    assert [label.partition(":")[0] for label in labels] == [
        "north arch", "main arch", "south arch",
    ]  # fmt: skip
    assert below.get_ylim() == (-0.1, 0.1)


def test_a_structure_without_rings_has_no_circle(stack):
    with pytest.raises(af.InvalidInput, match="0 arcs in one picture"):
        draw_circle_fit(stack)
