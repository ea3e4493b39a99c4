"""The text of a record: numbers distinguished from headers, and text that is taken for damage."""

from pathlib import Path

import numpy as np
import pytest

import archfem as af
from archfem.motion import RecordText
from archfem.motion.records.record_file import parse_unit

PLACE = Path("record.txt")


def text(*lines, ended=True):
    return RecordText(PLACE, lines, ended)


def test_numbers_of_a_line_are_read_with_any_separator():
    rows = text("1 -2.5 3E2", " 1,2; 3", "1.5-2.5+3.5", ".1D+01-.2d-01", "1000200030000", "")
    assert rows.parse_row(0) == [1.0, -2.5, 300.0]
    assert rows.parse_row(1) == [1.0, 2.0, 3.0]
    assert rows.parse_row(2) == [1.5, -2.5, 3.5]
    assert rows.parse_row(3) == [1.0, -0.02]
    assert rows.parse_row(4) == [1000200030000.0]
    assert rows.parse_row(5) == []


def test_columns_of_a_stated_width_separate_numbers_without_signs():
    """Numbers of ten letters each, without spaces."""
    line = "123.4567891.23456E01     -0.50"
    with pytest.raises(af.InvalidInput, match="line 1: not a number"):
        text(line).parse_row(0)
    with pytest.raises(af.InvalidInput, match="line 1: not a number"):
        text(line).parse_row(0, 9)
    assert text(line).parse_row(0, 10) == [123.456789, 12.3456, -0.5]


@pytest.mark.parametrize(
    ("line", "width"),
    [("Format=(8F10.3)", 10), ("( 5e15.6 )", 15), ("(10I8)", None), ("no format", None)],
)
def test_the_width_of_columns_is_read_off_their_format(line, width):
    assert RecordText.find_column_width(line) == width


def test_a_block_ends_where_its_count_is_reached():
    lines = text("head", "1.0 2.0", "3.0 4.0", "5.0")
    for count, first, after in ((1, 3, 4), (2, 1, 2), (4, 1, 3), (5, 1, 4)):
        numbers, line = lines.read_block(first, count)
        assert numbers.tolist() == [1.0, 2.0, 3.0, 4.0, 5.0][2 * (first - 1) :][:count]
        assert line == after
    for first, count, says in (
        (1, 6, "line 4: the header states 6 samples, the file holds 5: the file is cut short"),
        (1, 3, "line 3: the header states 3 samples, the file holds more: samples or"),
        (1, 0, "the header states 0 samples"),
    ):
        with pytest.raises(af.InvalidInput, match=says):
            lines.read_block(first, count)
    with pytest.raises(af.InvalidInput, match="line 4: more follows after the 4 samples"):
        lines.read_last_block(1, 4)
    assert lines.read_last_block(1, 5).tolist() == [1.0, 2.0, 3.0, 4.0, 5.0]


@pytest.mark.parametrize(("count", "damaged"), [(32, False), (35, True), (66, False), (68, True)])
def test_one_number_printed_unlike_three_in_a_hundred_is_damaged(count, damaged):
    """One of 34 is 3 %; of two among twice as many the first is named."""
    odd = 1 if count < 50 else 2
    lines = text(*["0.125"] * (count - odd), *["0.25"] * odd)
    if damaged:
        with pytest.raises(af.InvalidInput, match=f"line {count - odd + 1}: a number has not as"):
            lines.read_block(0, count)
    else:
        lines.read_block(0, count)


def test_a_last_number_that_is_shorter_is_cut_off():
    whole = ["0.125 0.250", "0.375 0.500"] * 6
    for last, ended, cut in (
        *(("0.375 0.5", False, True), ("0.375 0.5", True, False), ("0.375 0.500", False, False)),
        ("0.375 0.5000", False, False),
    ):
        lines = text(*whole[:-1], last, ended=ended)
        if cut:
            with pytest.raises(af.InvalidInput, match=r"line 12: the last number '0.5' is cut off"):
                lines.check_end()
        else:
            lines.check_end()


def test_patterns_are_found_between_two_lines():
    lines = text("NPTS 1", "2.0", "npts 3", "4.0")
    assert lines.find(r"NPTS\s(\d)")[0] == 0
    line, match = lines.find(r"NPTS\s(\d)", 1)
    assert (line, match[1]) == (2, "3")
    with pytest.raises(af.InvalidInput, match="no line has"):
        lines.find("NPTS", 1, 2)
    assert lines.contains("NPTS", 1)
    assert not lines.contains("NPTS", 2, 1)
    assert lines.contains("NPTS", 3, 1)
    assert lines.header_length() == 1


def test_steps_and_peaks_are_taken_up_to_their_bounds():
    """Ten samples a second at least; two per cent between samples and header."""
    for dt in (1e-4, 0.1):
        assert text("1").check_step(dt) == dt
    for dt in (0.0, -0.01, 0.1001, 1.0):
        with pytest.raises(af.InvalidInput, match=f"sampling interval {dt:g} s"):
            text("1").check_step(dt)
    samples = np.array([0.5, -1.0])
    for stated in (1.0, -1.0, 0.981, -1.0203):
        text("1").check_peak(samples, stated)
    for stated in (0.979, 1.0206, -1.0206, 0.0, np.nan):
        with pytest.raises(af.InvalidInput, match="one of them is damaged"):
            text("1").check_peak(samples, stated)


UNITS = {"g": 9.80665, "m/s2": 1.0, "cm/s2": 0.01, "gal": 0.01, "mm/s2": 0.001}


@pytest.mark.parametrize(("name", "unit"), UNITS.items())
def test_units_by_name_and_in_headers(name, unit):
    """The standard acceleration of gravity is 9.80665 m/s² by definition."""
    written = {"g": "units of g", "gal": "in gal", "m/s2": "acc. m/s^2"}.get(name, f"({name})")
    assert parse_unit(name) == pytest.approx(unit, rel=1e-15)
    assert list(RecordText.find_units(written)) == [pytest.approx(unit, rel=1e-15)]
    assert RecordText.find_units("nothing of the kind") == set()
