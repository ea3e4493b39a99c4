"""Code spectra at their corner periods, against values worked out by hand from the tables."""

import numpy as np
import pytest

import archfem as af
from archfem.motion import Eurocode8, TableSpectrum, Tbec2018

ROUND_OFF = 1e-12


def test_tbec_at_its_corners(verified):
    spectrum = Tbec2018(ss=1.140, s1=0.315, site="ZD")
    # F_S = 1.1 - 0.1 * 0.14/0.25 = 1.044, F_1 = 2.0 - 0.1 * 0.15 = 1.985.
    sds, sd1 = 1.044 * 1.140, 1.985 * 0.315
    assert spectrum.sds == pytest.approx(sds, rel=ROUND_OFF)
    assert spectrum.sd1 == pytest.approx(sd1, rel=ROUND_OFF)
    corner = sd1 / sds
    periods = [0.0, 0.1 * corner, 0.2 * corner, corner, 1.0, 6.0, 12.0]
    expected = [0.4 * sds, 0.7 * sds, sds, sds, sd1, sd1 / 6.0, sd1 * 6.0 / 144.0]
    assert spectrum.horizontal(periods) == pytest.approx(expected, rel=ROUND_OFF)
    found = spectrum.horizontal(periods)
    verified("TBEC-2018 at its corners, horizontal [g]", expected, "by hand from its tables", found)
    periods = [0.0, 0.1 * corner / 3, 0.2 * corner / 3, corner / 3, 1.0, 3.0]
    level = 0.8 * sds
    expected = [0.32 * sds, 0.56 * sds, level, level, level * corner / 3, level * corner / 9]
    assert spectrum.vertical(periods) == pytest.approx(expected, rel=ROUND_OFF)


@pytest.mark.parametrize(
    ("site", "ss", "s1", "sds", "sd1"),
    [
        ("ZA", 0.1, 0.05, 0.08, 0.04),
        ("ZB", 2.0, 0.9, 1.8, 0.72),
        ("ZC", 0.625, 0.55, 0.625 * 1.25, 0.55 * 1.45),
        ("ZD", 0.2, 0.05, 0.32, 0.12),
        ("ZE", 0.5, 0.2, 0.85, 0.66),
        ("ZE", 1.9, 0.7, 1.52, 1.4),
    ],
)
def test_tbec_site_factors(site, ss, s1, sds, sd1):
    spectrum = Tbec2018(ss=ss, s1=s1, site=site)
    assert (spectrum.sds, spectrum.sd1) == pytest.approx((sds, sd1), rel=ROUND_OFF)


# The tables once more, column by column, as others have copied them from the printed codes: a slip
# in one of both copies is found out. Site classes ZA to ZE downwards; tables 2.1 and 2.2.
TBEC_SHORT = {
    0.25: "0.8 0.9 1.3 1.6 2.4",
    0.50: "0.8 0.9 1.3 1.4 1.7",
    0.75: "0.8 0.9 1.2 1.2 1.3",
    1.00: "0.8 0.9 1.2 1.1 1.1",
    1.25: "0.8 0.9 1.2 1.0 0.9",
    1.50: "0.8 0.9 1.2 1.0 0.8",
}
TBEC_LONG = {
    0.10: "0.8 0.8 1.5 2.4 4.2",
    0.20: "0.8 0.8 1.5 2.2 3.3",
    0.30: "0.8 0.8 1.5 2.0 2.8",
    0.40: "0.8 0.8 1.5 1.9 2.4",
    0.50: "0.8 0.8 1.5 1.8 2.2",
    0.60: "0.8 0.8 1.4 1.7 2.0",
}
# Ground types A to E downwards; tables 3.2 and 3.3.
EUROCODE = {
    1: {
        "S": "1.0 1.2 1.15 1.35 1.4",
        "TB": "0.15 0.15 0.20 0.20 0.15",
        "TC": "0.4 0.5 0.6 0.8 0.5",
        "TD": "2.0 2.0 2.0 2.0 2.0",
    },
    2: {
        "S": "1.0 1.35 1.5 1.8 1.6",
        "TB": "0.05 0.05 0.10 0.10 0.05",
        "TC": "0.25 0.25 0.25 0.30 0.25",
        "TD": "1.2 1.2 1.2 1.2 1.2",
    },
}


@pytest.mark.parametrize("place", range(5))
def test_every_cell_of_the_tables_of_tbec(place):
    site = ("ZA", "ZB", "ZC", "ZD", "ZE")[place]
    for ss, column in TBEC_SHORT.items():
        factor = float(column.split()[place])
        assert Tbec2018(ss, 0.3, site).sds == pytest.approx(factor * ss, rel=ROUND_OFF)
    for s1, column in TBEC_LONG.items():
        factor = float(column.split()[place])
        assert Tbec2018(1.0, s1, site).sd1 == pytest.approx(factor * s1, rel=ROUND_OFF)


@pytest.mark.parametrize("type_", [1, 2])
@pytest.mark.parametrize("place", range(5))
def test_every_cell_of_the_tables_of_the_eurocode(type_, place):
    """Soil factor and periods, seen in the spectrum: its start, its corners and its end."""
    soil, rise, falls, far = (float(row.split()[place]) for row in EUROCODE[type_].values())
    spectrum = Eurocode8(ag=0.2, ground="ABCDE"[place], type=type_)
    found = spectrum.horizontal([0.0, rise / 2.0, rise, falls, far, 4.0])
    level = [0.4, 0.7, 1.0, 1.0, falls / far, falls * far / 16.0]
    assert found == pytest.approx(0.5 * soil * np.array(level), rel=ROUND_OFF)


@pytest.mark.parametrize(
    ("ag", "ground", "type_", "periods", "expected"),
    [
        # T = 0, T_B, T_C, T_D and 4 s: a_g S (1, 2.5, 2.5, 2.5 T_C/T_D, 2.5 T_C T_D/16).
        (0.3, "A", 1, (0, 0.15, 0.4, 2, 4), (0.3, 0.75, 0.75, 0.15, 0.0375)),
        (0.3, "C", 1, (0, 0.2, 0.6, 2, 4), (0.345, 0.8625, 0.8625, 0.25875, 0.0646875)),
        (0.2, "D", 2, (0, 0.1, 0.3, 1.2, 4), (0.36, 0.9, 0.9, 0.225, 0.02025)),
        (0.2, "E", 2, (0, 0.05, 0.25, 1.2, 4), (0.32, 0.8, 0.8, 1 / 6, 0.015)),
        (0.1, "B", 1, (0.075, 0.5, 1.0), (0.21, 0.3, 0.15)),
    ],
)
def test_eurocode_horizontal_at_its_corners(ag, ground, type_, periods, expected, verified):
    spectrum = Eurocode8(ag=ag, ground=ground, type=type_)
    assert spectrum.horizontal(periods) == pytest.approx(expected, rel=ROUND_OFF)
    case = f"EN 1998-1:2004, type {type_}, ground {ground}, a_g {ag:g} g, at its corners [g]"
    verified(case, expected, "by hand from its tables", spectrum.horizontal(periods))


@pytest.mark.parametrize(("type_", "ratio"), [(1, 0.9), (2, 0.45)])
def test_eurocode_vertical_at_its_corners(type_, ratio):
    found = Eurocode8(ag=0.3, ground="D", type=type_).vertical([0, 0.05, 0.15, 1, 4])
    # No soil factor: a_vg (1, 3, 3, 3 * 0.15, 3 * 0.15/16).
    assert found == pytest.approx(np.array([1, 3, 3, 0.45, 0.028125]) * 0.3 * ratio, rel=ROUND_OFF)


def test_eurocode_damping_lowers_all_but_the_start():
    spectrum = Eurocode8(ag=0.2, ground="A", damping=0.15)
    reduction = np.sqrt(10.0 / 20.0)
    assert spectrum.horizontal([0.0, 0.3]) == pytest.approx([0.2, 0.5 * reduction], rel=ROUND_OFF)
    assert Eurocode8(ag=0.2, ground="A", damping=0.5).horizontal(0.3) == pytest.approx(
        0.2 * 2.5 * 0.55
    )


def test_table_is_straight_between_its_points():
    table = TableSpectrum([0.0, 1.0, 2.0], [1.0, 3.0, 2.0], [0.5, 1.0, 1.0])
    assert table.horizontal([0.5, 1.5, 2.0]) == pytest.approx([2.0, 2.5, 2.0])
    assert table.vertical(0.5) == pytest.approx(0.75)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Tbec2018(ss=1.0, s1=0.3, site="ZF"), "needs a site study"),
        (lambda: Tbec2018(ss=1.0, s1=0.3, site="C"), "ground class = 'C' is not known"),
        (lambda: Tbec2018(ss=-1.0, s1=0.3, site="ZC"), "both are between 0 and 10 g"),
        (lambda: Tbec2018(ss=0.1, s1=0.6, site="ZD"), "T_B = .* = 6.3. s is beyond T_L"),
        (lambda: Tbec2018(ss=1.0, s1=0.3, site="ZC").vertical(3.01), "defined up to 3 s"),
        (lambda: Tbec2018(ss=1.0, s1=0.3, site="ZC").horizontal(-0.1), "from 0 s upwards"),
        (lambda: Eurocode8(ag=0.2, ground="S1"), "expected type 1 or 2 on ground A"),
        (lambda: Eurocode8(ag=0.2, ground="A", type=3), "expected type 1 or 2"),
        (lambda: Eurocode8(ag=0.0, ground="A"), r"\[g\] = 0.0 is not between 0 and 1"),
        (lambda: Eurocode8(ag=1.5, ground="A"), "not between 0 and 1: 1.5 m/s² are 0.153 g"),
        (lambda: Eurocode8(ag=0.2, ground="A").horizontal(4.5), "defined up to 4 s"),
        (lambda: TableSpectrum([0.0, 0.0], [1.0, 1.0]), "a row that grows"),
        (lambda: TableSpectrum([0.0, 1.0], [1.0, -1.0]), "2 positive values"),
        (lambda: TableSpectrum([0.0, 1.0], [1.0, 1.0]).vertical(0.5), "has no vertical"),
        (lambda: TableSpectrum([0.1, 1.0], [1.0, 1.0]).horizontal(0.05), "begin the table at 0 s"),
    ],
)
def test_spectra_that_codes_do_not_define_are_refused(build, message):
    with pytest.raises(af.errors.InvalidInput, match=message):
        build()


def test_the_values_of_a_code_are_stated():
    """Soil factor 1.15 and corner periods of ground C, type 1; vertical 0.9 (EN 1998-1, 3.2.2)."""
    assert af.motion.Eurocode8(ag=0.22, ground="C").describe() == (
        "horizontal: PGA 0.253 g = 1.15 ag, plateau 0.633 g, T_B 0.2 s, T_C 0.6 s, T_D 2 s; "
        "vertical: PGA 0.198 g = 0.9 ag, plateau 0.594 g, T_B 0.05 s, T_C 0.15 s, T_D 1 s"
    )
    american = af.motion.Asce2022(sds=1.0, sd1=0.5, tl=8.0).describe()
    assert american == "horizontal: PGA 0.4 g, plateau 1 g, T_0 0.1 s, T_S 0.5 s, T_L 8 s"
