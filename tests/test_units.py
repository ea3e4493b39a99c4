"""Common units, which are read without the registry of units."""

import numpy as np
import pint
import pytest

import archfem as af
from archfem.units import Ends, format_ratio


@pytest.fixture(scope="module")
def registry():
    return pint.UnitRegistry()


@pytest.mark.parametrize(
    ("unit", "si"), [(name, si) for name, (si, _) in af.units.COMMON_UNITS.items()]
)
def test_common_units_are_those_of_the_registry(registry, unit, si):
    """Units agree to the last digit, so that a case gives the same numbers either way."""
    for number in (*np.random.default_rng(1).uniform(-1e3, 1e3, 50).round(3), 0.0, 1.48):
        expected = registry.Quantity(f"{number} {unit}").to(si).magnitude
        assert af.units.in_unit(f" {number}{unit}", si, "length") == expected


@pytest.mark.parametrize(("text", "si"), [("3 mm", "Pa"), ("2 s", "m"), ("1 GPa/m", "Pa")])
def test_a_common_unit_of_another_dimension_is_refused(text, si):
    with pytest.raises(af.errors.InvalidInput, match="is not in a unit like"):
        af.units.in_unit(text, si, "length")


@pytest.mark.parametrize(
    ("text", "si", "value"),
    [
        ("20 kN/m3", "N/m**3", 2e4),
        ("1e3 mm/s2", "m/s**2", 1.0),
        ("9 kN / m2", "Pa", 9e3),
        ("2kN/m2", "Pa", 2e3),
        ("22 kN/m³", "N/m**3", 22e3),
        ("22e-1kN/m^3", "N/m**3", 2.2e3),
        ("5 kN/(m·mm)", "Pa", 5e6),
        ("10 s⁻¹", "Hz", 10.0),
        ("1_500 mm", "m", 1.5),
        ("0.3 g", "m/s**2", 0.3 * 9.80665),
    ],
)
def test_one_number_and_one_unit_may_be_written_in_many_ways(text, si, value):
    assert af.units.in_unit(text, si, "x") == pytest.approx(value)


@pytest.mark.parametrize("text", ["2,95 m", "1,000 m", "-0,5e3 mm"])
def test_a_comma_in_a_number_is_refused(text):
    with pytest.raises(af.InvalidInput, match=r"has a comma in its number.*write a point"):
        af.units.in_unit(text, "m", "length")


def test_an_acceleration_as_a_multiple_of_g_is_refused_with_its_number():
    with pytest.raises(af.InvalidInput, match=r"ag = '0\.22 g' .* if it is an acc.*: write 0\.22$"):
        af.units.in_unit("0.22 g", "1", "ag")


def test_a_number_as_a_text_is_refused_with_its_remedy():
    with pytest.raises(af.InvalidInput, match=r"x = '2\.25' has no unit: .* or \"2\.25 m\""):
        af.units.in_unit("2.25", "m", "x")
    with pytest.raises(af.InvalidInput, match=r"write a number in N, or \"60 kN\""):
        af.units.in_unit("60", "N", "axles")


@pytest.mark.parametrize(
    ("text", "unit", "rest"),
    [
        ("2 500 mm", "m", "500 mm"),
        ("1\u00a0500 mm", "m", "500 mm"),
        ("1\u202f500 mm", "m", "500 mm"),
        ("1'500 mm", "m", "'500 mm"),
        ("-1 200 kN", "N", "200 kN"),
        ("22 500 N/m**3", "N/m**3", "500 N/m**3"),
        ("10 000 Pa", "Pa", "000 Pa"),
        ("5–6 m", "m", "–6 m"),
        ("5 ± 1 m", "m", "± 1 m"),
        ("1 1/2 m", "m", "1/2 m"),
        ("1/2 m", "m", "/2 m"),
        ("1.2.3 m", "m", ".3 m"),
        ("2*3 m", "m", "*3 m"),
        ("5**2 m", "m", "**2 m"),
        ("0.3 · 9.81 m/s2", "m/s**2", "· 9.81 m/s2"),
        ("1:2", "1", ":2"),
        ("1- m", "m", "- m"),
        ("159 ° 30'", "degree", "° 30'"),
    ],
)
def test_another_number_or_sign_than_one_before_the_unit_is_refused(text, unit, rest):
    with pytest.raises(af.InvalidInput, match=r"is not a quantity.*write one number") as error:
        af.units.in_unit(text, unit, "x")
    assert f"x = {text!r} is not a quantity, for {rest!r} is no unit" in str(error.value)


@pytest.mark.parametrize("unit", ["metre per", "foo", "m/sec_"])
def test_an_unknown_unit_is_to_blame_and_not_the_value(unit):
    with pytest.raises(af.InvalidInput, match=f"^'{unit}', into which x is converted, is no unit"):
        af.units.in_unit("5 m", unit, "x")


@pytest.mark.parametrize("text", ["~5 m", "<5 m", "(5) m", "½ m", "m"])
def test_a_quantity_begins_with_its_number(text):
    with pytest.raises(af.InvalidInput, match="does not begin with a number: write one number"):
        af.units.in_unit(text, "m", "x")


@pytest.mark.parametrize(
    ("text", "frequency"),
    [("10 rad/s", 10.0 / (2.0 * np.pi)), ("600 rpm", 10.0), ("10 Hz", 10.0), ("3 cycle/s", 3.0)],
)
def test_an_angular_frequency_is_converted_by_a_full_turn(text, frequency):
    assert af.units.in_unit(text, "Hz", "x") == pytest.approx(frequency, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "unit", "intended"),
    [
        ("5 KN", "N", "5 kN"),
        ("5 kn", "N", "5 kN"),
        ("5 tonf", "N", "5 tf"),
        ("5 Mpa", "Pa", "5 MPa"),
        ("20 KN/m3", "N/m**3", "20 kN/m3"),
        ("0.3 G", "m/s**2", "0.3 g"),
    ],
)
def test_a_unit_in_letters_of_the_wrong_size_is_refused_with_the_usual_one(text, unit, intended):
    with pytest.raises(af.InvalidInput, match=f"did you mean '{intended}'"):
        af.units.in_unit(text, unit, "x")


@pytest.mark.parametrize(
    ("length", "words"),
    [(1.5e-7, "0.00015 mm"), (0.0728, "72.8 mm"), (0.9999, "1000 mm"), (2.084, "2084 mm")],
)
def test_a_length_of_a_fall_has_no_power_of_ten(length, words):
    assert af.units.format_mm(length) == words


@pytest.mark.parametrize("mass", ["10 t", "10000 kg"])
def test_a_mass_in_place_of_a_weight_is_refused_with_its_weight(mass):
    with pytest.raises(af.InvalidInput, match=r"is a mass: give its weight, times g: '98\.1 kN'"):
        af.units.in_unit(mass, "N", "axles")


@pytest.mark.parametrize("density", ["2300 kg/m³", "2300 kg/m3", "2.3 t/m**3"])
def test_a_density_in_place_of_a_unit_weight_is_refused_with_its_weight(density):
    words = r"is a density: give its weight, times g: '22\.56 kN/m³'"
    with pytest.raises(af.InvalidInput, match=words):
        af.units.in_unit(density, "N/m**3", "unit_weight")


@pytest.mark.parametrize(
    ("values", "numbers", "unit"),
    [
        (["0.5 m", "40 cm", 0.3], [0.5, 0.4, 0.3], "m"),
        (["0.3 g", None], [0.3 * 9.80665, None], "m/s**2"),
        (["159 degree"], [159.0], "degree"),
        (["1.48 MPa/mm"], [1.48e9], "Pa/m"),
        (["rigid", "0.5 m"], ["rigid", "0.5 m"], ""),
        (["3 pairs"], ["3 pairs"], ""),
        ([0.5, 1], [0.5, 1], ""),
    ],
)
def test_quantities_of_one_unit_are_numbers_and_other_values_stay(values, numbers, unit):
    found, found_unit = af.units.in_si_unit(values)
    assert found == pytest.approx(numbers) if unit else found == numbers
    assert found_unit == unit


@pytest.mark.parametrize(
    ("ratio", "text"),
    [(1.0122, "1.01"), (1.0004, "1.0004"), (0.99996, "0.99996"), (1.0, "1"), (1.6466, "1.65")],
)
def test_a_ratio_is_not_rounded_to_one_or_across_it(ratio, text):
    assert format_ratio(ratio) == text
    assert f"{Ends((0.5, ratio)):ratio}" == f"0.5 to {text}"
