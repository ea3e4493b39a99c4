"""Ground-motion models against their published equation, and their ranges."""

import sys
from math import exp, log, sqrt

import pytest

import archfem as af
from archfem.motion import GROUND_MOTION_MODELS, peak_ground_acceleration


def bssa14(magnitude, distance, v_s30):
    """Boore et al. (2014), tables of PGA: strike-slip, no regional and basin terms [m/s²]."""
    event = 0.4856 - 0.1662 * (magnitude - 5.5)  # above magnitude 5.5
    far = sqrt(distance**2 + 4.5**2)
    path = (-1.134 + 0.1917 * (magnitude - 4.5)) * log(far / 1.0) - 0.008088 * (far - 1.0)
    rock = exp(event + path)
    slope = -0.15 * (exp(-0.00701 * (min(v_s30, 760.0) - 360.0)) - exp(-0.00701 * 400.0))
    site = -0.6 * log(v_s30 / 760.0) + slope * log((rock + 0.1) / 0.1)
    return exp(event + path + site) * af.units.STANDARD_GRAVITY


@pytest.mark.parametrize(
    ("magnitude", "distance", "v_s30"),
    [(7.1, 15.4, 270.0), (6.6, 35.0, 760.0), (7.5, 109.0, 400.0)],
)
def test_peak_acceleration_is_that_of_the_published_equation(magnitude, distance, v_s30, verified):
    """Coefficients as published have four digits."""
    pytest.importorskip("pygmm")
    found = peak_ground_acceleration(magnitude, 1e3 * distance, v_s30=v_s30)
    exact = bssa14(magnitude, distance, v_s30)
    assert found.median == pytest.approx(exact, rel=2e-3)
    assert 0.5 < found.scatter < 0.65
    low, high = found.interval
    assert sqrt(low * high) == pytest.approx(found.median)
    assert log(high / low) == pytest.approx(2.0 * found.scatter)
    case = f"BSSA14, Mw {magnitude:g} at {distance:g} km, {v_s30:g} m/s: PGA [m/s²]"
    verified(case, round(exact, 3), "published equation", found.median)


def test_other_models_and_regions_differ_within_their_scatter():
    pytest.importorskip("pygmm")
    given = {"v_s30": 500.0, "mechanism": "strike-slip"}
    medians = {
        model: peak_ground_acceleration(6.5, 20e3, model=model, **given).median
        for model in set(GROUND_MOTION_MODELS) - {"DBC14"}
    }
    medians["DBC14"] = peak_ground_acceleration(6.5, 20e3, model="DBC14", depth=8e3, **given).median
    assert max(medians.values()) < 2.0 * min(medians.values())
    turkey = peak_ground_acceleration(7.3, 90e3, v_s30=270.0, region="turkey")
    assert turkey.median > peak_ground_acceleration(7.3, 90e3, v_s30=270.0).median


# Moment magnitude, distance [km] and peak [g]: Demirel and Aldemir (2021), Table 3
HISTORY = [
    *((6.6, 35.0, 0.192), (7.3, 90.0, 0.125), (7.1, 35.0, 0.233)),
    *((6.8, 50.0, 0.172), (7.5, 109.0, 0.108), (7.1, 15.4, 0.299)),
]


def test_peaks_of_the_six_earthquakes_at_the_bridge(verified):
    """The paper's values are above the medians, each within one standard deviation."""
    pytest.importorskip("pygmm")
    found = [
        peak_ground_acceleration(size, 1e3 * away, v_s30=270.0, region="turkey")
        for size, away, _ in HISTORY
    ]
    paper = [peak for *_, peak in HISTORY]
    for estimate, peak in zip(found, paper, strict=True):
        assert estimate.median < peak * af.units.STANDARD_GRAVITY < estimate.interval[1]
    medians = [round(estimate.median / af.units.STANDARD_GRAVITY, 3) for estimate in found]
    case = (
        "peaks of six earthquakes at the bridge [g], by BSSA14 for Turkey, each within its scatter"
    )
    verified(case, paper, "Demirel and Aldemir (2021), Table 3", medians)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"model": "DBC14"}, "DBC14: mag = 7.3 is outside its range from 4 to 7"),
        ({"model": "I14"}, "I14: v_s30 = 270 is outside its range from 450 to 1200"),
        (
            {"model": "CB14", "distance": 400e3},
            "dist_.* = 400 is outside its range from None to 300",
        ),
        ({"model": "CB14", "depth": 21e3}, "depth_hyp = 21 is outside its range from 0 to 20"),
        ({"model": "ASB14", "region": "italy"}, "ASB14 has no regions: leave out region = 'italy'"),
        ({"distance": 15.4}, "distance 15.4 m looks like kilometres"),
        ({"depth": 12.0}, "depth 12 m looks like kilometres"),
        ({"region": "mars"}, "BSSA14: region 'mars' is none of"),
        ({"model": "I14", "v_s30": 500.0, "mechanism": "normal"}, "mechanism 'NS' is none of"),
    ],
)
def test_values_outside_the_range_of_a_model_are_refused(given, says):
    pytest.importorskip("pygmm")
    settings = {"magnitude": 7.3, "distance": 90e3, "v_s30": 270.0} | given
    with pytest.raises(af.InvalidInput, match=says):
        peak_ground_acceleration(**settings)


def test_a_site_may_be_at_the_fault_and_a_hypocentre_at_the_surface():
    pytest.importorskip("pygmm")
    near = peak_ground_acceleration(6.5, 0.0, v_s30=760.0)
    assert near.median == pytest.approx(bssa14(6.5, 0.0, 760.0), rel=2e-3)
    shallow, deep = (
        peak_ground_acceleration(6.5, 5e3, v_s30=760.0, model="CB14", depth=depth).median
        for depth in (0.0, 15e3)
    )
    assert 0.0 < shallow < deep  # of CB14, whose term grows below 7 km


def test_wrong_models_and_a_missing_package_are_named(monkeypatch):
    with pytest.raises(af.InvalidInput, match="model 'KG04' is unknown: use ASK14, ASB14"):
        peak_ground_acceleration(7.0, 30e3, v_s30=300.0, model="KG04")
    with pytest.raises(af.InvalidInput, match=r"distance \[m\] = -1.0 is below 0"):
        peak_ground_acceleration(7.0, -1.0, v_s30=300.0)
    monkeypatch.setitem(sys.modules, "pygmm", None)
    with pytest.raises(af.errors.NotInstalled, match=r"pip install 'archfem\[hazard\]'"):
        peak_ground_acceleration(7.0, 30e3, v_s30=300.0)
