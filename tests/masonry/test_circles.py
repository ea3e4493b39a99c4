"""A circle fitted to surveyed points: exact on a circle, and the least there is beside it."""

import numpy as np
import pytest
from scipy.optimize import minimize

import archfem as af
from archfem.masonry import fitted_circle

# The intradoses of the three arches of Prusias ad Hypium, Table 1 of Demirel and Aldemir (2021):
# span along the centre line [m], embrace [degrees] and thickness [m].
ARCHES = [(4.71, 157.0, 0.527), (5.81, 159.0, 0.577), (4.89, 150.0, 0.546)]


def intrados(span, embrace, thickness, count=60):
    half = np.radians(embrace) / 2.0
    radius = span / (2.0 * np.sin(half)) - thickness / 2.0
    angles = np.linspace(-half, half, count)
    return radius, radius * np.column_stack([np.sin(angles), np.cos(angles)]) + (100.0, 20.0)


@pytest.mark.parametrize("arch", ARCHES)
def test_points_of_a_circle(arch):
    radius, points = intrados(*arch)
    found = fitted_circle(points)
    assert found.radius == pytest.approx(radius, rel=1e-9)
    assert found.centre == pytest.approx((100.0, 20.0), abs=1e-8)
    assert found.embrace == pytest.approx(arch[1], rel=1e-9)
    assert found.rms < 1e-9
    ring = af.circular_arch(span=found.span, rise=found.rise, thickness=arch[2], voussoirs=14)
    assert np.ptp(ring.middles[:, 0]) == pytest.approx(arch[0], rel=1e-9)  # the table's span


def test_rough_points_have_the_circle_of_least_squares():
    """A search that uses no property of circles finds the same."""
    radius, points = intrados(*ARCHES[1])
    points = points + np.random.default_rng(4).normal(0.0, 0.02, points.shape)
    found = fitted_circle(points)

    def square(given):
        return np.sum((np.linalg.norm(points - given[:2], axis=1) - given[2]) ** 2)

    best = minimize(square, (100.0, 20.0, radius), method="Nelder-Mead", tol=1e-12)
    assert (*found.centre, found.radius) == pytest.approx(best.x, abs=1e-5)  # of the search
    assert found.rms == pytest.approx(0.02, rel=0.25)  # of 60 points
    assert found.radius == pytest.approx(radius, abs=0.02)


def test_distances_of_a_symmetric_arc_are_square_to_every_change_of_the_circle():
    """The condition of the least sum, where the search starts on the axis of symmetry."""
    angles = np.radians(np.linspace(-70.0, 70.0, 36))
    radii = 2.0 + 4e-3 * np.tile([1.0, -1.0], 18)
    points = np.array([1.0, -0.5]) + radii[:, None] * np.stack([np.sin(angles), np.cos(angles)], 1)
    for given in (points, points[::-1]):
        found = fitted_circle(given)
        normals = given - found.centre
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        changes = np.column_stack([normals, np.ones(36)])
        # the search stops where the cosine between both is 1e-8; sizes are 4e-3 and 1 a point
        assert np.abs(found.distances @ changes).max() <= 1e-8 * 36 * 4e-3


CURVES = {
    # shape, span and rise [m], and largest distance from the circle [% of the span] that is doubted
    "circle": (af.circular_arch, 4.0, 2.0, None),
    "nearly a circle": (af.shapes.elliptical_arch, 4.0, 1.95, None),
    "ellipse": (af.shapes.elliptical_arch, 4.0, 1.3, 2.2),
    "pointed": (af.shapes.pointed_arch, 5.0, 3.57, 5.1),
}


@pytest.mark.parametrize("curve", CURVES)
def test_a_circle_of_another_curve_is_doubted(curve, caplog):
    """A ring along it needs 0.069 m at rest where the half ellipse needs 0.26 m."""
    build, span, rise, share = CURVES[curve]
    ring = build(span=span, rise=rise, thickness=0.4, voussoirs=19)
    found = fitted_circle([joint.intrados for joint in ring.joints])
    if share is None:
        assert not caplog.records
    else:
        misfit = 1e3 * np.abs(found.distances).max()
        assert f"up to {misfit:.3g} mm from the circle" in caplog.text
        assert f", {share} % of their extent: " in caplog.text
        assert "pointed_arch, elliptical_arch" in caplog.text


def test_points_are_as_far_from_their_circle_as_a_survey_errs(caplog):
    """Errors of 3 mm are none of the curve, and 20 mm on 5 m are."""
    for error, doubts in ((0.003, 0), (0.02, 1)):
        caplog.clear()
        _, points = intrados(*ARCHES[1])
        fitted_circle(points + np.random.default_rng(4).normal(0.0, error, points.shape))
        assert len(caplog.records) == doubts


@pytest.mark.parametrize(
    ("points", "says"),
    [
        ([], "0 points on a line"),
        ([(0, 0), (1, 1)], "make no circle"),
        ([(0, 0), (1, 1), (2, 2), (3, 3)], "make no circle"),
        ([(0, 0), (1, 1, 1)], r"points\[1\]"),
    ],
)
def test_points_on_no_circle_are_refused(points, says):
    with pytest.raises(af.InvalidInput, match=says):
        fitted_circle(points)


@pytest.mark.parametrize("chord", [1e-3, 1.0, 1e3])
def test_points_are_on_a_line_by_their_shape_at_any_size(chord):
    """An arc with a rise of 1e-5 of its chord is one, and 1e-7 of it is round-off of a survey."""
    across = np.linspace(-0.5, 0.5, 9)
    for rise in (1e-5, 1e-7):
        points = chord * np.column_stack([across, rise * (1.0 - 4.0 * across**2)])
        if rise > 1e-6:
            assert fitted_circle(points).radius == pytest.approx(chord / (8.0 * rise), rel=1e-3)
        else:
            with pytest.raises(af.InvalidInput, match="on a line"):
                fitted_circle(points)
