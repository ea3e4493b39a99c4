"""Tables of a case file: quantities, words, and changes."""

import pytest

import archfem as af
from archfem.cases.settings import change, chosen, keys_of, merged, remove


def test_quantities():
    assert af.units.in_unit("1.48 MPa/mm", "Pa/m", "k") == pytest.approx(1.48e9)
    assert af.units.in_unit("20 kN/m^3", "N/m**3", "weight") == pytest.approx(20e3)
    assert af.units.in_unit(159, "degree", "embrace") == 159.0
    assert af.units.in_unit("0.5 g_0", "m/s**2", "pga") == pytest.approx(0.5 * 9.80665)


@pytest.mark.parametrize(
    ("text", "value"),
    [("0.3 g", 2.941995), ("0.3 g_0", 2.941995), ("300 gal", 3.0), ("300 cm/s^2", 3.0)],
)
def test_of_an_acceleration_g_is_gravity_and_gal_no_gallon(text, value):
    assert af.units.in_unit(text, "m/s**2", "pga") == pytest.approx(value, rel=1e-9)
    with pytest.raises(af.InvalidInput, match="not in a unit like m"):
        af.units.in_unit("0.3 g", "m", "width")


@pytest.mark.parametrize(("text", "tangent"), [("35 deg", "0.700"), ("0.6109 rad", "0.700")])
def test_an_angle_is_no_pure_number(text, tangent):
    with pytest.raises(af.InvalidInput, match=f"is an angle.*{tangent}"):
        af.units.in_unit(text, "1", "friction")
    assert af.units.in_unit("5 percent", "1", "ratio") == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("value", "says"),
    [
        ("2 kg", "not in a unit like m"),
        ("two", "not a quantity"),
        ("9**9**9**9 m", "has a power no unit has"),
        ("(9**9)**(9**9) m", "has a power no unit has"),
        ("9 ^ 9 ^ 9 m", "has a power no unit has"),
        ("((((((9**9)**9)**9)**9)**9)**9) m", "has a power no unit has"),
        ("9" * 5000 + " m", "it has 5002 letters"),
        ("9⁹⁹⁹⁹⁹⁹⁹⁹⁹⁹ m", "has a power no unit has"),
        ("__import__('os').getpid() m", "not a quantity"),
        ("2 furlonks", "not a quantity"),
        ("(", "not a quantity"),
        (float("nan"), "not finite"),
        ("nan m", "not finite"),
        (True, "not a number"),
        ([1.0], "not a number"),
    ],
)
def test_what_is_no_quantity(value, says):
    with pytest.raises(af.InvalidInput, match=f"key = .*{says}"):
        af.units.in_unit(value, "m", "key")


def test_words_must_be_among_those_there_are():
    assert chosen("a", {"a": 1, "b": 2}, "section.key") == "a"
    for wrong in ("c", None, ["a"]):
        with pytest.raises(af.InvalidInput, match=r"section.key = .* is not known: use one of"):
            chosen(wrong, ("a", "b"), "section.key")


def test_tables_go_over_those_of_another_case():
    below = {"a": {"x": 1, "y": 2}, "b": 3}
    assert merged(below, {"a": {"y": 4}, "b": {"z": 5}}) == {"a": {"x": 1, "y": 4}, "b": {"z": 5}}
    assert below == {"a": {"x": 1, "y": 2}, "b": 3}
    remove(below, "a.x")
    change(below, "a.z='5 m'")
    change(below, "c.d=word")
    assert below == {"a": {"y": 2, "z": "5 m"}, "b": 3, "c": {"d": "word"}}


@pytest.mark.parametrize(
    ("path", "names"),
    [
        ("analysis.dt", ["analysis", "dt"]),
        ("contacts.stone to stone.friction", ["contacts", "stone to stone", "friction"]),
        ('contacts."stone to stone".friction', ["contacts", "stone to stone", "friction"]),
        ("suite.pairs.'M 6.4'.scale", ["suite", "pairs", "M 6.4", "scale"]),
        ('a . "b=c"', ["a", "b=c"]),
    ],
)
def test_names_with_spaces_and_dots_are_quoted_as_in_toml(path, names):
    assert keys_of(path) == names
    settings = {}
    change(settings, f"{path} = what's new")
    for name in names:
        settings = settings[name]
    assert settings == "what's new"


@pytest.mark.parametrize("path", ["a..b", ".a", 'a."b', 'a.""', ""])
def test_what_names_no_key(path):
    with pytest.raises(af.InvalidInput, match="names no key"):
        keys_of(path)


def test_a_part_is_taken_out_of_the_base():
    settings = {"structure": {"arches": {"main arch": {"span": 4}, "M 2.0": {"span": 2}}}}
    remove(settings, 'structure.arches."M 2.0"')
    remove(settings, "structure.arches.main arch")
    assert settings == {"structure": {"arches": {}}}
