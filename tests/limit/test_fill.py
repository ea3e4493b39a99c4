"""The strength of a fill, and how a load spreads in it, against closed forms."""

import numpy as np
import pytest
from scipy.integrate import quad

import archfem as af
from archfem.limit.fill import Fill

ROUND_OFF = 1e-12


def test_rankine_coefficients():
    for angle, passive in ((0.0, 1.0), (30.0, 3.0), (45.0, 3.0 + 2.0 * 2.0**0.5)):
        fill = Fill(friction_angle=angle, mobilisation=1.0)
        least, most = fill.pressures(np.array([0.0, 1e3]))
        np.testing.assert_allclose(most, [0.0, passive * 1e3], rtol=ROUND_OFF)
        np.testing.assert_allclose(least, [0.0, 1e3 / passive], rtol=ROUND_OFF)


def test_cohesion_adds_to_passive_and_takes_from_active_pressure():
    """Mohr's circle that touches c + σ tan φ: σ_1 - σ_3 = (σ_1 + σ_3) sin φ + 2 c cos φ."""
    angle, c, vertical = 32.0, 5e3, np.array([60e3, 90e3])
    least, most = Fill(friction_angle=angle, cohesion=c, mobilisation=1.0).pressures(vertical)
    sine, cosine = np.sin(np.radians(angle)), np.cos(np.radians(angle))
    for small, large in ((vertical, most), (least, vertical)):
        touch = (large + small) * sine + 2.0 * c * cosine
        np.testing.assert_allclose(large - small, touch, rtol=ROUND_OFF)
    shallow, _ = Fill(friction_angle=angle, cohesion=c).pressures(np.array([1e3]))
    assert shallow == 0.0  # a crack: soil does not pull


def test_mobilisation_and_active_are_parts_and_active_is_the_floor():
    sigma = np.array([1e4])
    fill = Fill(friction_angle=30.0, mobilisation=0.5, active=0.5)
    assert fill.pressures(sigma) == (pytest.approx(1e4 / 6.0), pytest.approx(1.5e4))
    least, most = Fill(friction_angle=30.0, mobilisation=0.0).pressures(sigma)
    assert least == most == pytest.approx(1e4 / 3.0)


@pytest.mark.parametrize("dispersal", ["boussinesq", "uniform"])
def test_all_of_a_load_is_between_the_edges_of_its_fan(dispersal):
    fill = Fill(friction_angle=30.0, dispersal=dispersal, spread=40.0)
    edge = np.tan(np.radians(40.0))
    found = fill.share(np.array([-np.inf, -2.0 * edge, -edge, 0.0, edge, np.inf]))
    np.testing.assert_allclose(found, [0.0, 0.0, 0.0, 0.5, 1.0, 1.0], atol=ROUND_OFF)
    slopes = np.linspace(-edge, edge, 50)
    np.testing.assert_allclose(fill.share(slopes) + fill.share(-slopes), 1.0, rtol=ROUND_OFF)
    assert (np.diff(fill.share(slopes)) > 0.0).all()


def test_boussinesq_is_the_stress_under_a_line_load():
    """σ_z = 2 P z³ / (π (x² + z²)²), integrated over a level at a depth of 1.7 m."""
    fill, depth = Fill(friction_angle=30.0, spread=35.0), 1.7

    def stress(x):
        return 2.0 * depth**3 / (np.pi * (x * x + depth * depth) ** 2)

    edge = depth * np.tan(np.radians(35.0))
    whole = quad(stress, -edge, edge)[0]
    for x in (-0.9, 0.1, 0.7):
        part = quad(stress, -edge, x)[0] / whole
        assert fill.share(np.array(x / depth)) == pytest.approx(part, rel=1e-9)  # of quadrature


def test_a_uniform_fan_of_one_in_two():
    fill = Fill(friction_angle=30.0, dispersal="uniform", spread=np.degrees(np.arctan(0.5)))
    assert fill.share(np.array(0.25)) == pytest.approx(0.75)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"friction_angle": 0.6}, "give degrees"),
        ({"friction_angle": 70.0}, "give degrees"),
        ({"friction_angle": -1.0}, "below 0"),
        ({"friction_angle": "35"}, "has no unit"),
        ({"cohesion": 2e6}, "give Pa"),
        ({"mobilisation": 1.5}, "a part of the pressure"),
        ({"active": 3.0}, "a part of the pressure"),
        ({"dispersal": "elastic"}, "is not known"),
        ({"spread": 90.0}, "degrees from the vertical"),
        ({"spread": 0.52}, "looks like radians: give 29.79 for 0.52 rad"),
        ({"spread": 0.0}, "degrees from the vertical"),
    ],
)
def test_a_fill_that_cannot_be_meant_is_refused(given, says):
    with pytest.raises(af.InvalidInput, match=says):
        Fill(**{"friction_angle": 35.0, **given})
