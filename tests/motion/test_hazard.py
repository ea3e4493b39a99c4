"""Hazard curves: power laws are straight in double logarithm, and files of OpenQuake are read."""

import numpy as np
import pytest

import archfem as af


def test_a_power_law_is_that_law():
    site = af.Hazard.power(2e-3, 2.5)
    x = np.array([1e-3, 0.3, 1.0, 7.0, 500.0])  # also beyond the points
    assert site.rate_of(x) == pytest.approx(2e-3 * x**-2.5, rel=1e-12)
    # its points are those of codes, and none is made up
    assert 1.0 / site.rate == pytest.approx([475.0, 2475.0], rel=1e-12)
    periods = np.array([1.0, 475.0, 1e5])
    assert site.intensity_of(periods) == pytest.approx((2e-3 * periods) ** 0.4, rel=1e-12)
    with pytest.raises(af.InvalidInput, match="return period -1"):
        site.intensity_of(-1.0)


@pytest.mark.parametrize(("factor", "exponent"), [(1.0, 1.0), (0.02, 1e-3)])
def test_a_law_of_another_unit_is_refused(factor, exponent):
    """At 2475 years 2475 m/s², or more than a number can be."""
    with pytest.raises(af.InvalidInput, match=r"hazard reaches 2475|= inf"):
        af.Hazard.power(factor, exponent)


def test_intensities_of_return_periods_are_those_of_their_rates():
    site = af.Hazard.from_return_periods({30.0: 0.5, 475.0: 4.0, 2475.0: 7.0, 9975.0: 9.0})
    x = np.array([0.1, 0.5, 3.0, 4.0, 6.0, 20.0])
    assert site.intensity_of(1.0 / site.rate_of(x)) == pytest.approx(x, rel=1e-12)


def test_return_periods_are_met_and_joined_in_logarithms():
    site = af.Hazard.from_return_periods({2475.0: 7.0, 475.0: 4.0}, measure="sa", period=0.2)
    assert site.rate_of([4.0, 7.0]) == pytest.approx([1 / 475, 1 / 2475], rel=1e-12)
    assert site.rate_of(np.sqrt(28.0)) == pytest.approx((475 * 2475) ** -0.5, rel=1e-12)
    assert (site.measure, site.period) == ("sa", 0.2)


def test_a_file_of_openquake_is_read(tmp_path):
    path = tmp_path / "hazard_curve-mean-PGA.csv"
    path.write_text(
        "#,,,\"generated_by='OpenQuake engine 3.16', kind='mean', investigation_time=50.0, "
        "imt='SA(0.3)'\"\n"
        "lon,lat,depth,poe-0.1,poe-0.2,poe-0.4,poe-0.8\n"
        "31.16,40.84,0.0,6.3212056E-01,2.2119922E-01,4.8770576E-02,0.0\n"
    )
    site = af.Hazard.read(path)
    # probabilities 1 - exp(-1), 1 - exp(-1/4), 1 - exp(-1/20) in 50 years; the last is zero
    assert site.rate_of(9.80665 * np.array([0.1, 0.2, 0.4])) == pytest.approx(
        [1 / 50, 1 / 200, 1 / 1000], rel=1e-6
    )
    assert (site.measure, site.period, len(site.rate)) == ("sa", 0.3, 3)
    with pytest.raises(af.InvalidInput, match="no row 1"):
        af.Hazard.read(path, site=1)


@pytest.mark.parametrize(
    ("intensity", "rate"),
    [([1.0], [0.1]), ([1.0, 2.0], [0.1, 0.2]), ([2.0, 1.0], [0.2, 0.1]), ([0.0, 1.0], [0.2, 0.1])],
)
def test_a_curve_that_does_not_fall_is_refused(intensity, rate):
    with pytest.raises(af.InvalidInput, match="hazard with intensities"):
        af.Hazard(intensity, rate)


@pytest.mark.parametrize(
    ("points", "options"),
    [
        ({475.0: 250.0}, {}),  # gal
        ({3.0: 475.0}, {}),  # swapped
        ({475.0: 25.0}, {"measure": "pgv"}),  # cm/s
    ],
)
def test_intensities_of_a_wrong_unit_are_refused(points, options):
    with pytest.raises(af.InvalidInput, match="can only be a wrong unit"):
        af.Hazard.from_return_periods({1.0: 0.1} | points, **options)


def hazard_file(folder, probabilities, measure="PGA"):
    """A file of OpenQuake with four intensities, after a mark of byte order."""
    path = folder / "curve.csv"
    head = f"\ufeff#,,,\"investigation_time=50.0, imt='{measure}'\"\n"
    path.write_text(
        f"{head}lon,lat,depth,poe-0.1,poe-0.2,poe-0.4,poe-0.8\n31,40,0,{probabilities}\n",
        encoding="utf-8",
    )
    return path


def test_of_equal_probabilities_the_largest_intensity_has_the_rate(tmp_path):
    """Rates between them would be too low from the smallest."""
    site = af.Hazard.read(hazard_file(tmp_path, "0.9,0.9,0.1,0.01"))
    assert site.intensity == pytest.approx(9.80665 * np.array([0.2, 0.4, 0.8]))
    assert site.rate_of(9.80665 * 0.2) == pytest.approx(-np.log(0.1) / 50.0)


@pytest.mark.parametrize(
    ("probabilities", "words"),
    [
        ("nan,0.3,0.1,0.01", "damaged"),  # the rest alone made a curve
        ("0.9,0.1,0.3,0.01", "damaged"),
        ("0.9,-0.1,0.01,0.001", "damaged"),
        ("1.9,0.3,0.1,0.01", "damaged"),
        ("0.9,0.3", "damaged"),
        ("0.9,0.3,x,0.01", "row 0: could not convert"),
    ],
)
def test_damaged_probabilities_are_refused(tmp_path, probabilities, words):
    with pytest.raises(af.InvalidInput, match=words):
        af.Hazard.read(hazard_file(tmp_path, probabilities))


def test_a_measure_of_another_kind_is_refused(tmp_path):
    """Its period was dropped, and that of the structure taken."""
    with pytest.raises(af.InvalidInput, match="does not name"):
        af.Hazard.read(hazard_file(tmp_path, "0.9,0.3,0.1,0.01", measure="SA(0.3,0.1)"))


def test_wrong_arguments_of_a_curve_are_named():
    for call in (lambda: af.Hazard.power("a", 2.0), lambda: af.Hazard.from_return_periods([475])):
        with pytest.raises(af.InvalidInput, match="give a"):
            call()


def test_a_power_law_of_velocities_ends_where_no_unit_is_wrong():
    site = af.Hazard.power(2e-5, 2.5, measure="pgv")
    assert float(site.rate_of(0.3)) == pytest.approx(2e-5 * 0.3**-2.5)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"measure": "sa", "period": 0.0}, "period"),  # not that of the structure
        ({"measure": "sa", "period": -0.5}, "period"),
        ({"measure": "pga", "period": 0.5}, "it belongs to 'sa'"),
    ],
)
def test_periods_that_belong_to_no_spectrum_are_refused(options, words):
    with pytest.raises(af.InvalidInput, match=words):
        af.Hazard([1.0, 2.0], [0.1, 0.01], **options)


@pytest.mark.parametrize("intensity", [0.0, -1.0, [2.0, 0.0]])
def test_intensities_that_are_not_above_zero_have_no_rate(intensity):
    with pytest.raises(af.InvalidInput, match="a rate needs one above 0"):
        af.Hazard.power(2e-3, 2.5).rate_of(intensity)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(af.InvalidInput, match=r"nothing\.csv"):
        af.Hazard.read(tmp_path / "nothing.csv")
