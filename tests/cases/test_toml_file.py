"""TOML files: quantities, words, changes, and files that are refused before they cost time."""

import os
import time
import tomllib

import numpy as np
import pytest

import archfem as af
from archfem._validation import check_choice
from archfem.cases.toml_file import (
    format_tables,
    merge_tables,
    parse_change,
    read_with_base,
    refuse_unknown,
    remove_key,
    set_value,
    split_key_path,
)


def test_quantities():
    assert af.units.in_unit("1.48 MPa/mm", "Pa/m", "k") == pytest.approx(1.48e9)
    assert af.units.in_unit("20 kN/m^3", "N/m**3", "weight") == pytest.approx(20e3)
    assert af.units.in_unit(159, "degree", "embrace") == 159.0
    assert af.units.in_unit("0.5 g_0", "m/s**2", "pga") == pytest.approx(0.5 * 9.80665)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        *[("0.3 g", 2.941995), ("0.3g", 2.941995), ("0.3 g_0", 2.941995)],
        *[("300 gal", 3.0), ("300gal", 3.0), ("300 cm/s^2", 3.0), ("3e2cm/s^2", 3.0)],
    ],
)
def test_units_of_acceleration_take_g_as_gravity_and_gal_as_no_gallon(text, value):
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
def test_an_invalid_quantity_is_refused(value, says):
    with pytest.raises(af.InvalidInput, match=f"key = .*{says}"):
        af.units.in_unit(value, "m", "key")


def test_a_choice_must_be_one_of_the_known_words():
    assert check_choice("a", "section.key", {"a": 1, "b": 2}) == "a"
    for wrong, why in (("c", "= 'c' is not known"), (None, "is missing"), (["a"], "= .* known")):
        with pytest.raises(af.InvalidInput, match=rf"section.key {why}: use one of"):
            check_choice(wrong, "section.key", ("a", "b"))


def test_tables_override_those_of_another_case():
    below = {"a": {"x": 1, "y": 2}, "b": 3}
    assert merge_tables(below, {"a": {"y": 4}, "b": {"z": 5}}) == {
        "a": {"x": 1, "y": 4},
        "b": {"z": 5},
    }
    assert below == {"a": {"x": 1, "y": 2}, "b": 3}
    remove_key(below, "a.x")
    set_value(below, *parse_change("a.z='5 m'"))
    set_value(below, *parse_change("c.d=word"))
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
    assert split_key_path(path) == names
    settings = {}
    set_value(settings, *parse_change(f"{path} = what's new"))
    for name in names:
        settings = settings[name]
    assert settings == "what's new"


@pytest.mark.parametrize("path", ["a..b", ".a", 'a."b', 'a.""', ""])
def test_a_path_that_names_no_key_is_refused(path):
    with pytest.raises(af.InvalidInput, match="names no key"):
        split_key_path(path)


def test_a_part_is_taken_out_of_the_base():
    settings = {"structure": {"arches": {"main arch": {"span": 4}, "M 2.0": {"span": 2}}}}
    remove_key(settings, 'structure.arches."M 2.0"')
    remove_key(settings, "structure.arches.main arch")
    assert settings == {"structure": {"arches": {}}}


COLUMN = """
[structure]
shape = "column"
breadth = "1 m"
heights = [1.0]
[model]
fidelity = "rigid"
"""
RING = COLUMN.replace("column", "circular_arch").replace('breadth = "1 m"', "radius = 3")
SOON = 1.0
"""CPU time in which anything is refused [s]; all of these take milliseconds."""


def read(path, text):
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return af.Case.read(path)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (COLUMN + "x = " + "1" * 5000, "is not TOML"),
        (COLUMN + "x = 9223372036854775808", "whole number beyond"),
        (COLUMN + "x = " + "[" * 3000, "more than 20 tables or lists in each other"),
        (COLUMN + "x = " + "{a=" * 3000, "more than 20 tables or lists in each other"),
        ("a." * 20_000 + "b = 1\n", "more than 20 tables or lists in each other"),
        ('"a" . ' * 20_000 + "b = 1\n", "more than 20 tables or lists in each other"),
        ("[" + "a." * 20_000 + "b]\n", "more than 20 tables or lists in each other"),
        (COLUMN.replace("1 m", "1 " + "m" * 2**19), "has 524290 letters"),
        (COLUMN.replace("1 m", "9**9**9**9 m"), "a power no unit has"),
        (COLUMN.replace("1 m", "((9**9)**9)**9 m"), "a power no unit has"),
        (COLUMN.replace("1 m", "m**1e9"), "a power no unit has"),
        (COLUMN + "#" * 2**24, "has 16777.* bytes, and a case file at most 16777216"),
        (b"\xff\xfe" + COLUMN.encode("utf-16-le"), "not UTF-8"),
        ('remove = 3\nbase = "base.toml"', 'write \\["section.key", …\\]'),
        (
            RING.replace("heights = [1.0]", "thickness = 0.5\nembrace = 90\nvoussoirs = 10000000"),
            "voussoirs 10000000 is not a whole number from 1 to 10000",
        ),
    ],
    ids=range(15),
)
def test_absurd_files_are_refused_at_once(tmp_path, text, says):
    (tmp_path / "base.toml").write_text(COLUMN)
    begun = time.process_time()
    with pytest.raises(af.ArchfemError, match=says) as caught:
        read(tmp_path / "case.toml", text)
    assert time.process_time() - begun < SOON
    assert len(str(caught.value)) < 5000


@pytest.mark.parametrize("value", ["1", "[]", "{}"])
@pytest.mark.parametrize("head", [0, 10, 19])
def test_a_value_lies_twenty_deep_at_most(tmp_path, head, value):
    """Tables of a header and those of a dotted key count together."""
    header = f"[{'.'.join('a' * head)}]\n" if head else ""
    for depth, says in ((20, "unknown key 'a'"), (21, "more than 20 tables or lists")):
        text = f"{header}{'.'.join('a' * (depth - head))} = {value}\n"
        with pytest.raises(af.InvalidInput, match=says):
            read(tmp_path / "case.toml", text)


def test_a_byte_order_mark_is_ignored(tmp_path):
    assert read(tmp_path / "case.toml", b"\xef\xbb\xbf" + COLUMN.encode()).structure.free == (1,)


def test_a_chain_of_bases_is_refused_where_it_is_long(tmp_path):
    for k in range(40):
        (tmp_path / f"{k}.toml").write_text(f'base = "{k + 1}.toml"')
    with pytest.raises(af.InvalidInput, match="is the base of 20 files"):
        af.Case.read(tmp_path / "0.toml")


def devices(folder):
    os.mkfifo(folder / "pipe")
    return ["/dev/zero", folder / "pipe", folder]


@pytest.mark.parametrize("read", [af.Case.read, af.Motion.read, af.History.read])
def test_devices_pipes_and_folders_are_no_files(tmp_path, read):
    for path in devices(tmp_path):
        with pytest.raises(af.InvalidInput, match="is a folder, a device or a pipe: give a"):
            read(path)


def test_devices_and_pipes_are_no_drawings_of_a_case(tmp_path):
    os.mkfifo(tmp_path / "pipe.dxf")
    for path in [*devices(tmp_path), tmp_path / "pipe.dxf"]:
        drawn = {"shape": "outlines", "file": str(path), "unit": "m", "snap": 0.01}
        with pytest.raises(af.InvalidInput, match=r"is no drawing|a pipe: give a draw"):
            af.Case.of({"structure": drawn})


def test_counts_beyond_the_room_are_refused_before_they_take_any():
    ring = af.circular_arch(radius=3, thickness=0.5, embrace=90, voussoirs=5)
    with pytest.raises(af.errors.MeshError, match=r"a mesh of 1.1e.06 cells, and there is room"):
        af.build(ring, cells=(1000, 220))
    with pytest.raises(af.InvalidInput, match=r"makes 1e.12, and there is room for 10000000"):
        af.Motion.synthetic(duration=1e9, dt=1e-3)
    with pytest.raises(af.InvalidInput, match="there is room for 10000000"):
        af.Motion.synthetic(duration=1.0).resampled(1e-12)


@pytest.mark.parametrize(
    ("density", "weight"),
    [
        (2300, "22.56 kN/m³ for 2300 kg/m³"),
        ("2500 kg/m3", "24.52 kN/m³ for 2500 kg/m³"),
        ("1.9 t/m3", "18.63 kN/m³ for 1900 kg/m³"),
        ("heavy", "23.54 kN/m³ for 2400 kg/m³"),
    ],
)
def test_a_density_is_no_key_where_weights_are(density, weight):
    refused = r"materials\.stone\.density': give unit_weight, which .* times g: "
    with pytest.raises(af.InvalidInput, match=refused + weight):
        refuse_unknown({"density": density}, ["unit_weight", "young"], "materials.stone")
    with pytest.raises(af.InvalidInput, match="the keys are"):
        refuse_unknown({"density": 2300}, ["young"], "materials.stone")


def test_numbers_are_written_without_their_type():
    """As NumPy prints its own from version 2 on."""

    class Number(float):
        def __repr__(self):
            return f"np.float64({float(self)})"

    text = format_tables({"a": Number(0.1), "b": [np.int64(3), np.float64(1e-30)]})
    assert tomllib.loads(text) == {"a": 0.1, "b": [3, 1e-30]}


def test_a_material_without_strength_is_sent_to_limit_analysis():
    """`none` is a word of limit.strength alone."""
    settings = {
        "structure": {"shape": "column", "breadth": 0.5, "heights": [1.0]},
        "materials": {"stone": {"strength": "none"}},
    }
    with pytest.raises(af.InvalidInput, match=r'materials.stone.strength.*limit.strength = "none"'):
        af.Case.of(settings)
    settings |= {"materials": {}, "limit": {"strength": "none"}}
    assert af.Case.of(settings).limit.strength == np.inf


@pytest.mark.parametrize("own", [("left", "right"), ("left",)])
def test_a_common_key_over_parts_with_their_own_is_refused(tmp_path, own):
    walls = {name: "above = 0.3" if name in own else "length = 3.0" for name in ("left", "right")}
    text = "\n".join(f"[structure.sidewalls.{name}]\n{line}" for name, line in walls.items())
    (tmp_path / "base.toml").write_text(text, "utf-8")
    case = tmp_path / "case.toml"
    case.write_text('base = "base.toml"\n[structure.sidewalls]\nabove = 2.6\n', "utf-8")
    if len(own) == 1:  # the other wall takes it
        assert read_with_base(case)["structure"]["sidewalls"]["above"] == 2.6
        return
    with pytest.raises(af.errors.InvalidInput, match="would have no effect"):
        read_with_base(case)
    removed = 'remove = ["structure.sidewalls.left.above", "structure.sidewalls.right.above"]'
    case.write_text(f"{removed}\n{case.read_text('utf-8')}", "utf-8")
    assert read_with_base(case)["structure"]["sidewalls"]["above"] == 2.6
