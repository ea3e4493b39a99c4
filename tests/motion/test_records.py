"""The record readers: every format by content, every doubt refused with file and line."""

import re
import runpy
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

import archfem as af
from archfem.motion import RecordText
from archfem.motion.records.reader import find_format, read_channels, read_components

DAMAGE = runpy.run_path(str(Path(__file__).parents[1] / "fuzz" / "damaged_records.py"))
SAMPLES, mutants = DAMAGE["SAMPLES"], DAMAGE["mutants"]

RECORDS = Path(__file__).parents[2].parent / "shared" / "records"

# File, samples, step [s] and peak [g] of each component, as published with the files.
TABLE = [
    ("peer_at2/RSN1158_KOCAELI_DZC180.AT2", 0.005, [(5437, 0.3119)]),
    ("peer_at2/RSN1158_KOCAELI_DZC270.AT2", 0.005, [(5437, 0.3642)]),
    ("peer_at2/RSN1158_KOCAELI_DZC-UP.AT2", 0.005, [(5437, 0.2063)]),
    ("peer_at2/RSN6_IMPVALL.I_I-ELC180.AT2", 0.01, [(5372, 0.2808)]),
    ("peer_at2/RSN6_IMPVALL.I_I-ELC270.AT2", 0.01, [(5346, 0.2107)]),
    ("peer_at2/RSN6_IMPVALL.I_I-ELC-UP.AT2", 0.01, [(5378, 0.1781)]),
    ("peer_at2/RSN125_FRIULI.A_A-TMZ000.AT2", 0.005, [(7277, 0.3571)]),
    ("peer_at2/RSN125_FRIULI.A_A-TMZ270.AT2", 0.005, [(7279, 0.3151)]),
    ("peer_at2/RSN125_FRIULI.A_A-TMZ-UP.AT2", 0.005, [(7278, 0.2770)]),
    ("peer_at2/RSN126_GAZLI_GAZ000.AT2", 0.0066, [(2048, 0.7017)]),
    ("peer_at2/RSN126_GAZLI_GAZ090.AT2", 0.0066, [(1984, 0.8639)]),
    ("peer_at2/RSN126_GAZLI_GAZ-UP.AT2", 0.0066, [(2080, 1.6982)]),
    ("peer_at2/RSN77_SFERN_PUL164.AT2", 0.01, [(4172, 1.2190)]),
    ("peer_at2/RSN77_SFERN_PUL254.AT2", 0.01, [(4172, 1.2383)]),
    ("peer_at2/RSN77_SFERN_PULDWN.AT2", 0.01, [(4172, 0.6874)]),
    ("peer_at2/RSN181_IMPVALL.H_H-E06140.AT2", 0.005, [(7817, 0.4473)]),
    ("peer_at2/RSN181_IMPVALL.H_H-E06230.AT2", 0.005, [(7818, 0.4490)]),
    ("peer_at2/RSN181_IMPVALL.H_H-E06-UP.AT2", 0.005, [(7815, 1.8950)]),
    ("peer_at2/RSN763_LOMAP_GIL067.AT2", 0.005, [(7999, 0.3585)]),
    ("peer_at2/RSN763_LOMAP_GIL337.AT2", 0.005, [(7999, 0.3266)]),
    ("peer_at2/NIS090.AT2", 0.01, [(4096, 0.5027)]),
    ("plain_columns/erzikan.txt", 0.005, [(4260, 0.5154), (4260, 0.4957)]),
    (
        "other_formats/20170720223109_0921.txt",
        0.01,
        [(28683, 0.0135), (28683, 0.0124), (28683, 0.0100)],
    ),
    ("other_formats/HL.DLFA..HNE.D.20190728.160908.C.ACC.ASC", 0.005, [(13876, 0.00023)]),
    ("other_formats/HL.DLFA..HNN.D.20190728.160908.C.ACC.ASC", 0.005, [(13876, 0.00019)]),
    ("other_formats/HL.DLFA..HNZ.D.20190728.160908.C.ACC.ASC", 0.005, [(13876, 0.00021)]),
    ("other_formats/ce36456p_CE36456.V2", 0.02, [(3251, 0.2732), (3250, 0.0967), (3250, 0.2613)]),
    (
        "other_formats/us1000hyfh_akbmrp_AKBMR--n.1000hyfh.BNZ.--.acc.V2c",
        0.005,
        [(42000, 0.0070)],
    ),
    ("other_formats/0111a.smc", 0.005, [(6001, 0.1065)]),
    ("other_formats/CHB0031412312349.EW", 0.01, [(6000, 0.0082)]),
    ("other_formats/CHB0031412312349.NS", 0.01, [(6000, 0.0083)]),
    ("other_formats/CHB0031412312349.UD", 0.01, [(6000, 0.0025)]),
]

SIBLING = re.compile(r"(270|090|254|230|337|-UP|DWN)\.AT2|HN[NZ]\.D")
"""Files of a component whose station has another one in the table, in the same format."""


@pytest.fixture
def write(tmp_path):
    def write(content, name="record.txt", encoding="utf-8"):
        path = tmp_path / name
        path.write_bytes(content.encode(encoding))
        return path

    return write


@pytest.fixture
def recorded():
    if not RECORDS.is_dir():
        pytest.skip(f"no records in {RECORDS}")
    return RECORDS


@pytest.mark.parametrize(
    ("name", "dt", "components"),
    [
        pytest.param(name, *row, marks=pytest.mark.slow if SIBLING.search(name) else (), id=name)
        for name, *row in TABLE
    ],
)
def test_real_records_have_their_published_count_and_peak(recorded, name, dt, components):
    channels = read_channels(recorded / name)
    assert [len(channel.samples) for channel in channels] == [count for count, _ in components]
    for channel, (_, peak) in zip(channels, components, strict=True):
        assert channel.dt == dt
        # Half of the last digit of the table.
        digits = 0.5e-5 if peak < 0.001 else 0.5e-4
        reached = np.abs(channel.samples).max() / af.units.STANDARD_GRAVITY
        assert reached == pytest.approx(peak, abs=digits * 1.001)


def test_accelerations_beyond_five_g_are_refused_by_every_reader(write):
    """Beyond 5 g the unit is wrong, and the file is named; one of two columns may be sound."""
    path = write("0.1 0.1\n0.2 -60.0\n0.0 0.1\n0.1 0.0\n")
    given = {"units": "m/s2", "dt": 0.01}
    for read in (read_channels, read_components, af.Motion.read):
        with pytest.raises(af.InvalidInput, match=rf"{path.name}: .* 6.12 g, more than 5 g"):
            read(path, column=2, **given)
        read(path, column=1, **given)


def test_a_downward_vertical_is_turned_up(recorded):
    # The first sample of the file is -0.4595648E-03 g, positive downwards.
    motion = af.Motion.read(
        recorded / "peer_at2/RSN77_SFERN_PUL164.AT2",
        vertical=recorded / "peer_at2/RSN77_SFERN_PULDWN.AT2",
    )
    assert motion.vertical[0] == pytest.approx(0.4595648e-3 * af.units.STANDARD_GRAVITY)
    assert motion.horizontal[0] == pytest.approx(-0.4486975e-3 * af.units.STANDARD_GRAVITY)


def test_two_horizontals_of_two_files_can_be_rotated(recorded):
    files = [recorded / f"peer_at2/RSN125_FRIULI.A_A-TMZ{angle}.AT2" for angle in ("000", "270")]
    motion = af.Motion.read(files[0], transverse=files[1])
    turned = motion.rotated(90.0)
    assert turned.pga == pytest.approx(0.3151 * af.units.STANDARD_GRAVITY, rel=2e-4)
    # Each keeps its own length until they are mixed; then the longer one counts.
    assert (len(motion.horizontal), len(turned.horizontal)) == (7277, 7279)


def test_three_components_of_one_file_are_kept_together(recorded):
    motion = af.Motion.read(recorded / "other_formats/ce36456p_CE36456.V2")
    peaks = [np.abs(motion.component(name)).max() for name in motion.components]
    assert motion.components == ("horizontal", "vertical", "transverse")
    assert peaks == pytest.approx([2.67957, 0.948, 2.5626], rel=2e-3)
    assert len(motion.horizontal) == 3251
    assert len(motion.vertical) == 3250


def test_one_component_is_chosen_by_its_number(recorded):
    path = recorded / "plain_columns/erzikan.txt"
    motion = af.Motion.read(path, column=2)
    assert motion.components == ("horizontal",)
    assert motion.pga == pytest.approx(0.4957 * af.units.STANDARD_GRAVITY, rel=1e-4)
    with pytest.raises(af.errors.InvalidInput, match="choose from 1 to 2"):
        af.Motion.read(path, column=3)
    with pytest.raises(af.errors.InvalidInput, match="has 1 components"):
        af.Motion.read(recorded / "peer_at2/NIS090.AT2", column=2)
    with pytest.raises(af.errors.InvalidInput, match="leave out"):
        af.Motion.read(recorded / "peer_at2/NIS090.AT2", dt=0.01)


def test_components_are_distinguished_by_their_directions(write):
    rows = "1 2 3\n-4 5 6\n0 8 8.5\n"
    path = write("# gal, dt = 0.01 s: N-S, E-W, U-D\n" + rows)
    found = read_components(path)
    assert {name: channel.direction for name, channel in found.items()} == {
        "horizontal": "N-S",
        "transverse": "E-W",
        "vertical": "U-D",
    }
    assert read_components(path, column=3).keys() == {"horizontal"}
    for directions in ("N-S, E-W, NS", "N-S, U-D, UP"):
        with pytest.raises(af.errors.InvalidInput, match="not those of one instrument"):
            read_components(write(f"# gal, dt = 0.01 s: {directions}\n" + rows))


VALUES = "  .1000000E+00 -.2000000E+00  .3000000E+00\n  .0500000E+00\n"
TITLE = "PEER NGA RECORD\nFriuli, 5/6/1976, Tolmezzo, 0\nACCELERATION TIME SERIES IN UNITS OF G\n"


@pytest.mark.parametrize(
    "counted",
    [
        "NPTS=   4, DT=   .0100 SEC,   ",
        "NPTS=  4, DT= .01000 SEC",
        "npts = 4, dt = 1.0E-2 sec",
        "   4    0.0100    NPTS, DT",
        "4 .0100 NPTS, DT",
        "DT=  .0100, NPTS=   4",
        "NPTS: 4 DT: 0.01",
        "NPTS=4,DT=.01 SEC",
        "4, .01, NPTS, DT",
        "NPTS, DT:  4  .0100 SEC",
        "NPTS=    4\nDT=   .0100 SEC",
    ],
)
def test_peer_headers_of_all_kinds(write, counted):
    for blank, end in (("", "\n"), ("\n\n", "\r\n")):
        path = write((blank + TITLE + counted + "\n" + VALUES).replace("\n", end))
        motion = af.Motion.read(path)
        expected = np.array([0.1, -0.2, 0.3, 0.05]) * af.units.STANDARD_GRAVITY
        assert motion.dt == 0.01
        assert motion.horizontal == pytest.approx(expected)


def test_a_header_of_free_words(write):
    """As in the El Centro record that OpenSees ships: nothing says "acceleration" but its unit."""
    head = (
        "A Valley, 1940, North South Component (of Somebody's Version)\n"
        "4 points at equal spacing of 0.02 sec\n"
        "Points are listed in the format of 8F10.5, i.e., 8 points across in a row\n"
        "The units are (g)\nNPTS=  4, DT= .02000 SEC\n"
    )
    motion = af.Motion.read(write(head + "   0.10000  -0.20000   0.30000   0.05000\n"))
    assert motion.dt == 0.02
    assert motion.pga == pytest.approx(0.3 * af.units.STANDARD_GRAVITY)


def test_numbers_run_together_and_fortran_exponents(write):
    values = "-.1000000D+00-.2000000D+00 .3000000D+00-.5000000D-01\n"
    motion = af.Motion.read(write(TITLE + "NPTS= 4, DT= .01 SEC\n" + values))
    assert motion.horizontal / af.units.STANDARD_GRAVITY == pytest.approx([-0.1, -0.2, 0.3, -0.05])


@pytest.mark.parametrize("direction", ["DWN", "DOWN (USGS STATION 279)", "DN"])
def test_downward_words(write, direction):
    text = TITLE.replace("Tolmezzo, 0", f"Dam (upper, left), {direction}")
    channel = read_channels(write(text + "NPTS= 4, DT= .01 SEC\n" + VALUES))[0]
    assert channel.is_vertical
    assert channel.samples[0] == pytest.approx(-0.1 * af.units.STANDARD_GRAVITY)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (TITLE + "NPTS= 5, DT= .01 SEC\n" + VALUES, "states 5 samples, the file holds 4"),
        (TITLE + "NPTS= 3, DT= .01 SEC\n" + VALUES, "line 6: more follows after the 3 samples"),
        (TITLE + "NPTS= 2, DT= .01 SEC\n" + VALUES, "line 5: the header states 2 samples"),
        (TITLE + "NPTS= 4, DT= .00 SEC\n" + VALUES, "line 4: sampling interval 0 s"),
        (TITLE + "NPTS= 4, DT= 5.0 SEC\n" + VALUES, "line 4: sampling interval 5 s"),
        (TITLE + "NPTS= 4, DT=    SEC\n" + VALUES, "no line has"),
        (TITLE + "NPTS= **, DT= .01 SEC\n" + VALUES, "no line has"),
        (TITLE + "NPTS= 4, DT= .01 SEC\n" + VALUES[:-3], "'.0500000E+' is cut off|not a number"),
        (TITLE + "NPTS= 4, DT= .01 SEC\n" + VALUES.replace("-.2", "-x2"), "line 5: numbers exp"),
        (TITLE + "NPTS= 4, DT= .01 SEC\n" + VALUES.replace(".3", ".3.3"), "line 5: not a number"),
        (TITLE + "NPTS= 40, DT= .01 SEC\n" + VALUES * 9 + VALUES.replace(".3000", ".3"), "digits"),
        (
            TITLE + "NPTS= 4, DT= .01 SEC\n" + VALUES.replace(".3000000E+00", "NaN"),
            "line 5: numbers",
        ),
        (TITLE + "NPTS= 4, DT= .01 SEC\n" + VALUES.replace("+00", "+03", 1), "wrong unit"),
        (TITLE + "NPTS= 4, DT= .01 SEC\n" + VALUES.replace("E+00", "E999", 1), "too large"),
        (TITLE.replace("OF G", "") + "NPTS= 4, DT= .01 SEC\n" + VALUES, "does not state one unit"),
        (
            TITLE.replace("ACCELERATION", "VELOCITY") + "NPTS= 4, DT= .01 SEC\n" + VALUES,
            "does not state an acceleration",
        ),
        (TITLE + f"NPTS= {'9' * 5000}, DT= .01 SEC\n" + VALUES, "no line has"),
        (SAMPLES["knet"].replace("100Hz", "1e999Hz"), "are positive numbers"),
        (SAMPLES["knet"].replace("(gal)   5", "(gal)   9"), "states a peak of"),
        (SAMPLES["esm"].replace("s^2\nPGA", "s\nPGA"), "UNITS is not a unit"),
        (SAMPLES["esm"].replace("0.40", "0.80"), "do not last 0.80 s"),
        (SAMPLES["esm"].replace("ACCEL", "VEL"), "DATA_TYPE is 'VELERATION'"),
        (SAMPLES["csmip"].replace("END OF DATA FOR CHANNEL  3", ""), "no line has"),
        (SAMPLES["smc"].replace("|made", "made"), "comment lines expected"),
        (SAMPLES["cosmos"].replace("units=cm/sec2", "units=counts"), "no single unit"),
        (SAMPLES["afad"].replace("(gal)", ""), "unit of the peaks|no line has"),
        ("", "is empty"),
        ("\0\1", "not a text file"),
        ("just words\nand more\n", "no line of numbers"),
    ],
)
def test_doubtful_files_are_refused_by_name_and_line(write, content, message):
    path = write(content)
    with pytest.raises(af.errors.InvalidInput, match=message) as caught:
        af.Motion.read(path)
    assert path.name in str(caught.value)


def test_files_that_are_not_there_are_refused(tmp_path):
    said = r"(cannot read the|there is no|give a) record"
    for path in (tmp_path / "missing.AT2", tmp_path, "a\0b", None):
        with pytest.raises(af.errors.InvalidInput, match=said):
            af.Motion.read(path)


def test_time_and_acceleration_in_columns(write):
    rows = "".join(f"{0.02 * i:.3f}\t{0.1 * (-1) ** i:.4f}\n" for i in range(50))
    for header, given, unit in (
        ("# time (s), acceleration (m/s^2)\n", {}, 1.0),
        ("time [s], acc [g]\n", {}, af.units.STANDARD_GRAVITY),
        ("% acc. in cm/sec^2\n", {}, 0.01),
        ("", {"units": "gal"}, 0.01),
        ("", {"units": "g", "column": 2, "dt": 0.02}, af.units.STANDARD_GRAVITY),
    ):
        motion = af.Motion.read(write(header + rows), **given)
        assert motion.dt == pytest.approx(0.02)
        assert motion.pga == pytest.approx(0.1 * unit)
        assert len(motion.horizontal) == 50


SHAKING = af.Motion.synthetic(duration=9.99, seed=2, dt=0.01)
UPRIGHT, ACROSS = SHAKING.vertical, af.Motion.synthetic(duration=9.99, seed=5, dt=0.01).horizontal


def table(*columns, between=" "):
    """Print columns of numbers, of which a time has six decimals."""
    rows = zip(*columns, strict=True)
    return "".join(between.join(f"{value:.6f}" for value in row) + "\n" for row in rows)


@pytest.mark.parametrize("width", [2, 3, 7, 8])
def test_samples_that_follow_one_another_along_the_lines_are_read_in_order(write, width):
    """As in 8F10.6, with a shorter last line where their number is no multiple."""
    rows = [SHAKING.horizontal[k : k + width] for k in range(0, 1000, width)]
    text = "".join("".join(f"{value:10.6f}" for value in row) + "\n" for row in rows)
    path = write("# m/s2, dt = 0.01 s\n" + text)
    (found,) = read_channels(path)
    assert found.samples == pytest.approx(SHAKING.horizontal, abs=1e-6)
    with pytest.raises(af.InvalidInput, match="column 2 is not an acceleration of this file"):
        read_channels(path, column=2)


@pytest.mark.parametrize("others", [(UPRIGHT, ACROSS), (SHAKING.horizontal,) * 2, (UPRIGHT,) * 7])
def test_columns_beside_one_another_are_no_samples_along_the_lines(write, others):
    """Components of their own, the same one again, and an instrument among others."""
    path = write("# m/s2, dt = 0.01 s\n" + table(SHAKING.horizontal, *others))
    said = r"columns could be .* choose with column=.* name them above.* write one a line"
    with pytest.raises(af.InvalidInput, match=said):
        read_channels(path)
    (found,) = read_channels(path, column=1)
    assert found.samples == pytest.approx(SHAKING.horizontal, abs=1e-6)


@pytest.mark.parametrize(
    ("head", "timed"),
    [
        ("Z,N,E (m/s2)", False),
        ("Time (s),HNZ (m/s2),HNN (m/s2),HNE (m/s2)", True),
        ("# station 41.2 N 29.0 E, m/s2\n# t acc_Z acc_N acc_E", True),
        ("m/s2\nsec; vertical; north; east", True),
    ],
)
def test_heads_name_components_by_letters_codes_and_words(write, head, timed):
    columns = [UPRIGHT, SHAKING.horizontal, ACROSS]
    columns = [SHAKING.times(), *columns] if timed else columns
    between = ";" if ";" in head else ","
    path = write(f"{head}\n" + table(*columns, between=between))
    motion = af.Motion.read(path, dt=None if timed else 0.01)
    assert motion.components == ("horizontal", "vertical", "transverse")
    for name, row in (("horizontal", SHAKING.horizontal), ("vertical", UPRIGHT)):
        assert motion.component(name) == pytest.approx(row, abs=1e-6)
    assert motion.transverse == pytest.approx(ACROSS, abs=1e-6)


def test_single_letters_in_other_words_name_no_columns(write):
    path = write("# 41.2 N 29.0 E, m/s2, dt = 0.01 s\n" + table(UPRIGHT, ACROSS))
    with pytest.raises(af.InvalidInput, match="2 columns could be the acceleration"):
        read_channels(path)


@pytest.mark.parametrize(
    ("form", "begin"),
    [
        ("%Y/%m/%d %H:%M:%S.%f", 1704125409.0),
        ("%Y-%m-%dT%H:%M:%S.%fZ", 1704125409.0),
        ("%d.%m.%Y,%H:%M:%S.%f", 1704125409.0),
        ("%H:%M:%S.%f", 58209.0),
    ],
)
def test_a_clock_in_the_first_column_is_time(write, form, begin):
    """1704125409 s after 1970 it was 16:10:09 UTC on the first of January 2024."""
    start = datetime(2024, 1, 1, 16, 10, 9)
    clock = [(start + timedelta(milliseconds=10 * k)).strftime(form) for k in range(1000)]
    rows = table(SHAKING.horizontal, ACROSS, UPRIGHT, between=",").splitlines()
    lines = (f"{time},{row}\n" for time, row in zip(clock, rows, strict=True))
    path = write(
        "Station,CHB003\nRecord Time,2024/01/01 16:10:09\n"
        "Time,N-S(m/s2),E-W(m/s2),U-D(m/s2)\n" + "".join(lines)
    )
    motion = af.Motion.read(path)
    assert (motion.dt, motion.start_time) == (0.01, begin)
    assert motion.vertical == pytest.approx(UPRIGHT, abs=1e-6)
    assert motion.transverse == pytest.approx(ACROSS, abs=1e-6)


@pytest.mark.parametrize(
    ("head", "unit"),
    [
        ("time (s), acc (gal/10)", 1e-3),
        ("time (s), acc (10 x cm/s2)", 0.1),
        ("# units of g/10", 0.980665),
        ("acc (gal), PGA 312.5 gal", 1e-2),
        ("# 0.1 gal", None),
        ("# 10^-2 x m/s2", None),
        ("# in gal/count", None),
        ("# in gal/10^2", None),
    ],
)
def test_factors_of_a_unit_count_or_are_refused(write, head, unit):
    path = write(f"{head}\n" + table(SHAKING.times(), SHAKING.horizontal))
    if unit is None:
        with pytest.raises(af.InvalidInput, match=r"no unit|several units"):
            af.Motion.read(path)
        unit = 1e-3
        motion = af.Motion.read(path, units="0.1 gal")
    else:
        motion = af.Motion.read(path)
    assert motion.pga == pytest.approx(unit * SHAKING.pga, rel=1e-6)


def knet_from(second):
    """The sample of K-NET, whose record begins at a second of a minute."""
    return SAMPLES["knet"].replace("Sampl", f"Record Time       2014/12/31 23:49:{second}\nSampl")


def test_components_of_stated_times_are_shifted_by_their_difference(write):
    """CSV of the seconds 0 and 3; K-NET of 15 and 15 s; ESM of a millisecond's clock."""
    rows = table(np.arange(40) * 0.01, DAMAGE["WAVE"])
    later = table(0.3 + np.arange(40) * 0.01, 2.0 * DAMAGE["WAVE"])
    files = [write("# m/s2\n" + text, name) for text, name in ((rows, "a"), (later, "b"))]
    shifted = np.append(np.zeros(30), 2.0 * DAMAGE["WAVE"])
    motion = af.Motion.read(files[0], vertical=files[1])
    assert motion.start_time == 0.0
    assert motion.vertical == pytest.approx(shifted, abs=1e-6)
    assert motion.horizontal == pytest.approx(DAMAGE["WAVE"], abs=1e-6)
    # the other way round the horizontal waits, and a part of the motion keeps its time
    motion = af.Motion.read(files[1], vertical=files[0]).cut(0.1)
    assert motion.horizontal == pytest.approx(shifted[10:], abs=1e-6)
    again = motion.with_transverse(af.Motion.read(files[1]))
    assert again.transverse == pytest.approx(shifted[10:], abs=1e-6)
    # a motion of no file begins with the other
    assert len(motion.with_vertical(af.Motion(np.ones(9), 0.01)).vertical) == 9


@pytest.mark.parametrize(
    ("form", "key", "value"),
    [
        ("knet", "Sampling Freq", "Record Time       2014/12/31 23:49:1{}\n"),
        ("afad", "NUMBER", "RECORD TIME             : 20/07/2017 22:30:5{}.000000 (GMT)\r\n"),
        ("esm", "NDATA", "DATE_TIME_FIRST_SAMPLE_YYYYMMDD_HHMMSS: 20190728_16090{}.000\n"),
        ("cwb", "#RecordLength", "#StartTime: 2018/02/06-23:50:4{}.000\n"),
        ("cosmos", " 100 Int", "Rcrd start time: 11/30/2018, 17:29:3{}.000 UTC (Q=5)\n"),
    ],
)
def test_formats_state_the_time_of_their_first_sample(write, form, key, value):
    at = SAMPLES[form].index(key)
    begins = []
    for second in (5, 8):
        text = SAMPLES[form][:at] + value.format(second) + SAMPLES[form][at:]
        begins.append(read_channels(write(text))[0].start_time)
    assert begins[1] - begins[0] == 3.0
    assert begins[0] % 60.0 == float(re.search(r"(\d){}", value)[1] + "5")
    damaged = (
        value.replace("2014/12", "2014/19").replace("20/07", "20/13").replace("201907", "201913")
    )
    damaged = damaged.replace("/02/06", "/02/31").replace("11/30", "21/30").format(5)
    with pytest.raises(af.InvalidInput, match="is no time"):
        read_channels(write(SAMPLES[form][:at] + damaged + SAMPLES[form][at:]))


def test_components_without_a_time_in_common_are_refused(write):
    """K-NET of records 3 s apart that last 0.4 s; and a date beside the seconds of a file."""
    files = [write(knet_from(second), f"{second}.EW") for second in (15, 18)]
    rows = "# m/s2\n" + table(np.arange(40) * 0.01, DAMAGE["WAVE"])
    said = r"horizontal from 2014-12-31T23:49:15.000, vertical from .*their times contradict"
    for other in (files[1], write(rows)):
        with pytest.raises(af.InvalidInput, match=said):
            af.Motion.read(files[0], vertical=other)


@pytest.mark.parametrize(
    "stated",
    [
        *("dt=0.005 sec", "dt = 5 ms", "time step: .005", "Sampling rate: 200 Hz", "DT 5.0E-3 s"),
        *("dt [ms] = 5", "time step 5 milliseconds", "sampling interval (msec): 5", "dt 5 [ms]"),
        *("dt = 5000 µs", "dt_ms = 5", "delta t 5000 microsec", "dt=0.005; minimum 3"),
    ],
)
def test_the_step_stated_in_a_comment(write, stated):
    motion = af.Motion.read(write(f"% gal, {stated}\n1\n-2\n3\n"))
    assert motion.dt == pytest.approx(0.005)
    assert motion.pga == pytest.approx(0.03)


@pytest.mark.parametrize(
    ("head", "unit"),
    [
        *(("Time (ms),Acc (gal)", 1e-3), ("# Time [msec]\tAcc [gal]", 1e-3)),
        *(("time_ms,a in gal", 1e-3), ("t/ms,a/gal", 1e-3), ("time ms acc gal", 1e-3)),
        *(("Time (µs),Acc (gal)", 1e-6), ("Zeit (min);gal", 60.0), ("Time,gal\nms,", 1e-3)),
        *(("Elapsed time (milliseconds), gal", 1e-3), ("# min/max, gal", 1.0)),
        *(("Time (s),a (gal)", 1.0), ("# atoms, gal", 1.0), ("# max min values, gal", 1.0)),
    ],
)
def test_a_time_column_is_in_the_unit_of_its_head(write, head, unit):
    """At 10 kHz times in milliseconds would pass for steps of 0.1 s."""
    rows = "".join(f"{1e-4 * i / unit:.9g} {i % 7}\n" for i in range(200))
    motion = af.Motion.read(write(f"{head}\n{rows}"))
    assert motion.dt == pytest.approx(1e-4)


@pytest.mark.parametrize(
    "stated",
    ["NPTS= 3, DT= 5 MSEC", "NPTS= 3, DT= .005 SEC", "3 5 NPTS, DT (ms)", "NPTS, DT 3 5 MS"],
)
def test_the_step_of_peer_is_in_its_unit(write, stated):
    content = f"PEER\nA, B, 1\nACCELERATION IN UNITS OF G\n{stated}\n.1 .2 .1\n"
    assert af.Motion.read(write(content)).dt == pytest.approx(0.005)


def test_a_record_in_utf_16_is_refused_with_its_encoding(tmp_path):
    path = tmp_path / "record.txt"
    path.write_text("# m/s2, dt = 0.01\n1.0\n2.0\n", encoding="utf-16")
    with pytest.raises(af.InvalidInput, match="is encoded in UTF-16, and UTF-8 is read"):
        af.Motion.read(path)


def test_rounded_times_still_give_the_step(write):
    rows = "".join(f"{0.0066 * i:.3f} {i % 7}\n" for i in range(200))
    # Times are rounded to 0.0005 s, over 199 steps: 4e-4 of the step.
    assert af.Motion.read(write(rows), units="gal").dt == pytest.approx(0.0066, rel=5e-4)


@pytest.mark.parametrize(
    ("content", "given", "message"),
    [
        ("0.0 1\n0.01 2\n0.02 3\n", {}, "state no unit"),
        ("1\n2\n3\n", {"units": "gal"}, "give dt="),
        ("1\n2\n3\n", {"units": "furlong", "dt": 0.01}, "units 'furlong' are unknown"),
        ("# in g\n1\n2\n", {"units": "gal", "dt": 0.01}, "contradicts the unit"),
        ("# dt = 0.02 s\n1\n2\n", {"units": "gal", "dt": 0.01}, "stated twice"),
        ("0 1\n.01 2\n.02 3\n.04 2\n.05 1\n.06 0\n", {"units": "gal"}, "line 4: .*0.02 to 0.04 s"),
        ("1 2\n3 4\n1 5\n", {"units": "gal", "dt": 0.01}, "2 columns could be"),
        ("0.00 1 2\n0.01 4 1\n0.02 5 1\n", {"units": "gal"}, "2 columns could be"),
        ("0.00 1\n0.01 4\n0.02 5\n", {"units": "gal", "column": 1}, "choose from 2 to 2"),
        ("1 2\n3\n1 5\n", {"units": "gal", "dt": 0.01, "column": 1}, "line 2: 1 columns"),
        ("0,1\n0,2\n", {"units": "gal", "dt": 0.01, "column": 1}, "decimal commas"),
        ("0.00;0,1\n0.01;0,2\n", {"units": "gal", "column": 2}, "line 1: .*decimal commas"),
        ("# dt = 0,01 s\n1.0\n2.0\n", {"units": "gal"}, "'dt = 0,01': these look like decimal"),
        ("5\n", {"units": "gal", "dt": 0.01}, "one row is no accelerogram"),
        ("1\n2\n", {"units": "gal", "dt": "10 ms"}, "dt = '10 ms' is no number: .*seconds"),
        ("1\n2\nend\n", {"units": "gal", "dt": 0.01}, "line 3: numbers expected, got 'end'"),
        ("1\n2\n", {"units": "gal", "dt": 3.0}, "sampling interval 3 s.*unit if it is 3 ms"),
    ],
)
def test_doubtful_columns_are_refused(write, content, given, message):
    with pytest.raises(af.errors.InvalidInput, match=message):
        af.Motion.read(write(content), **given)


def test_an_error_names_the_turkish_file_too(write):
    content = SAMPLES["afad"].replace("GAZIANTEP", "AYDIN").replace("AYDIN", "AYDİN")
    motion = af.Motion.read(write(content, encoding="cp1254"))
    assert motion.components == ("horizontal", "vertical", "transverse")


@pytest.mark.parametrize("form", SAMPLES)
def test_shipped_samples_of_all_formats_are_read(write, form):
    channels = read_channels(write(SAMPLES[form]))
    for channel in channels:
        assert channel.dt == 0.01
        # Every sample holds this wave, to the digits of its format.
        assert channel.samples == pytest.approx(DAMAGE["WAVE"], abs=2e-4)


@pytest.mark.slow
def test_damaged_files_raise_no_foreign_error(tmp_path):
    path = tmp_path / "damaged.txt"
    refused = 0
    for content in mutants(200, seed=1):
        path.write_bytes(content)
        try:
            assert af.Motion.read(path).pga > 0.0
        except af.errors.InvalidInput as error:
            refused += path.name in str(error)
    # Not every change damages; most do.
    assert 50 < refused < 200


PEAK = DAMAGE["PEAK"]
KNET_PEAK, AFAD_PEAK = f"(gal)   {PEAK:.3f}", f"(U-D) {PEAK}"


@pytest.mark.parametrize(
    ("form", "was", "becomes", "accepted"),
    [
        # K-NET's peak was taken after another estimate of the offset: 2 %
        ("knet", KNET_PEAK, f"(gal)   {1.018 * PEAK:.3f}", True),
        ("knet", KNET_PEAK, f"(gal)   {1.022 * PEAK:.3f}", False),
        # AFAD's before the offset was taken out: a half
        ("afad", AFAD_PEAK, f"(U-D) {1.96 * PEAK}", True),
        ("afad", AFAD_PEAK, f"(U-D) {2.04 * PEAK}", False),
        ("afad", AFAD_PEAK, f"(U-D) {0.52 * PEAK}", True),
        ("afad", AFAD_PEAK, f"(U-D) {0.48 * PEAK}", False),
        # ESM's duration by two steps and a millisecond, to either side
        ("esm", "S: 0.40", "S: 0.420", True),
        ("esm", "S: 0.40", "S: 0.3795", True),
        ("esm", "S: 0.40", "S: 0.422", False),
        ("esm", "S: 0.40", "S: 0.378", False),
        # COSMOS states whole seconds: by one and a step; -999 is a peak that is not known
        ("cosmos", "approx    0", "approx    1", True),
        ("cosmos", "approx    0", "approx    2", False),
        ("cosmos", f"{PEAK:15.6f}", f"{-999.0:15.6f}", True),
        ("cosmos", f"{PEAK:15.6f}", f"{-998.0:15.6f}", False),
        ("cosmos", f"{PEAK:15.6f}", f"{-1098.9:15.6f}", False),
        # SMC: a number beyond 1e38 is one that is not known
        ("smc", f"{DAMAGE['WAVE'].max() * 100.0:15.7E}", f"{1.02e38:15.7E}", True),
        ("smc", f"{DAMAGE['WAVE'].max() * 100.0:15.7E}", f"{0.98e38:15.7E}", False),
    ],
)
def test_headers_are_believed_up_to_their_bounds(write, form, was, becomes, accepted):
    assert SAMPLES[form].count(was) == 1
    path = write(SAMPLES[form].replace(was, becomes))
    if accepted:
        for channel in read_channels(path):
            assert channel.samples == pytest.approx(DAMAGE["WAVE"], abs=2e-4)
    else:
        with pytest.raises(af.InvalidInput, match=r"states a peak of|do not last"):
            read_channels(path)


@pytest.mark.parametrize(
    ("form", "was", "becomes", "direction", "sense"),
    [
        ("cosmos", f"{90:8d}", f"{400:8d}", "Up", 1.0),
        ("cosmos", f"{90:8d}", f"{401:8d}", "Down, turned up", -1.0),
        ("cosmos", f"{90:8d}", f"{402:8d}", "Vertical", 1.0),
        ("cosmos", f"{90:8d}", f"{403:8d}", "HNE", None),
        ("smc", f"{90:10d}{360:10d}", f"{0:10d}{360:10d}", "UP", 1.0),
        ("smc", f"{90:10d}{360:10d}", f"{180:10d}{360:10d}", "DOWN, turned up", -1.0),
        ("smc", f"{90:10d}{360:10d}", f"{1:10d}{360:10d}", "360", None),
        ("knet", "Dir.              E-W", "Dir.              3", "U-D", 1.0),
        ("knet", "Dir.              E-W", "Dir.              6", "U-D", 1.0),
        ("knet", "Dir.              E-W", "Dir.              5", "5", None),
    ],
)
def test_directions_that_are_numbers(write, form, was, becomes, direction, sense):
    """Codes of the formats' descriptions: what points up, what down, and what is level."""
    assert SAMPLES[form].count(was) == 1
    (found,) = read_channels(write(SAMPLES[form].replace(was, becomes)))
    assert (found.direction, found.is_vertical) == (direction, sense is not None)
    assert found.samples == pytest.approx((sense or 1.0) * DAMAGE["WAVE"], abs=2e-4)


@pytest.mark.parametrize(("words", "direction"), [("ABCDEFGHIJKL", True), ("ABCDEFGHIJKLM", False)])
def test_a_direction_of_peer_has_twelve_letters_at_most(write, words, direction):
    head = TITLE.replace("Tolmezzo, 0", f"Tolmezzo, {words}")
    (found,) = read_channels(write(head + "NPTS= 4, DT= .01 SEC\n" + VALUES))
    assert found.direction == (words if direction else "")


@pytest.mark.parametrize(("jitter", "uniform"), [(0.24, True), (0.26, False)])
def test_times_may_stray_by_a_quarter_of_a_step(write, jitter, uniform):
    """One time of many steps is off, which barely moves the line through all of them."""
    times = 0.01 * np.arange(400.0)
    times[200] += 0.01 * jitter
    rows = "".join(f"{time:.7f} {k % 7}\n" for k, time in enumerate(times))
    path = write("# gal\n" + rows)
    if uniform:
        assert read_channels(path)[0].dt == pytest.approx(0.01, rel=1e-4)
    else:
        with pytest.raises(af.InvalidInput, match=r"time is not uniform: 2\.0026 to 2\.01 s"):
            read_channels(path)


def test_a_step_that_is_stated_twice_is_the_same_to_a_hundredth(write):
    rows = "1\n-2\n3\n"
    for stated, same in ((0.009905, True), (0.00989, False), (0.010095, True), (0.0102, False)):
        path = write(f"# gal, dt = {stated} s\n" + rows)
        if same:
            assert read_channels(path, dt=0.01)[0].dt == 0.01
        else:
            with pytest.raises(af.InvalidInput, match="stated twice"):
                read_channels(path, dt=0.01)


@pytest.mark.parametrize("given", [{}, {"column": 2, "dt": 0.01}])
def test_times_that_run_backwards_are_refused(write, given):
    """With a step and a column stated, the samples were read from their end."""
    rows = [f"{0.01 * k:.2f},{np.sin(k):.5f}" for k in reversed(range(40))]
    path = write("\n".join(["time [s],acceleration [m/s2]", *rows, ""]))
    with pytest.raises(af.InvalidInput, match="run backwards"):
        af.Motion.read(path, **given)


def test_a_first_column_is_time_where_nine_in_ten_steps_grow(write):
    """One of twenty steps goes back, which is an error; with three it is another component."""
    for back, says in (([9], "time is not uniform"), ([5, 9, 13], "2 columns could be")):
        times = np.arange(21.0) * 0.01
        times[back] = times[[k - 1 for k in back]]
        rows = "".join(f"{time:.3f} {k % 7}\n" for k, time in enumerate(times))
        with pytest.raises(af.InvalidInput, match=says):
            read_channels(write("# gal, dt = 0.01 s\n" + rows))


@pytest.mark.parametrize(("bow", "even"), [(0.24, True), (0.26, False)])
def test_times_begin_anywhere_and_keep_to_their_line_by_a_quarter_of_a_step(write, bow, even):
    """Two lines that meet in the middle, no step of which is off by more than two per cent.

    Their least squares leave half of the height of the bow at its ends and its top.
    """
    count = np.arange(101)
    times = 5.0 + 0.01 * (count + 2.0 * bow * (1.0 - np.abs(count / 50.0 - 1.0)))
    path = write("# gal\n" + "".join(f"{t:.7f} {k % 7}\n" for k, t in enumerate(times)))
    if even:
        assert read_channels(path)[0].dt == pytest.approx(0.01)
    else:
        with pytest.raises(af.InvalidInput, match="time is not uniform"):
            read_channels(path)


def test_columns_of_afad_are_named_on_their_last_line(write):
    """Another line that names three directions, before the peaks, counts for nothing."""
    head, peaks = SAMPLES["afad"].split("RAW PGA")
    (first, *others) = read_channels(write(f"{head}  U-D  N-S  E-W\r\nRAW PGA{peaks}"))
    assert [each.direction for each in (first, *others)] == ["N-S", "E-W", "U-D"]
    assert first.samples == pytest.approx(DAMAGE["WAVE"], abs=2e-4)


def test_a_title_of_peer_has_two_commas_or_names_no_direction(write):
    """A station and a date come before the direction."""
    for title, direction in (("Friuli, Tolmezzo, 90", "90"), ("Friuli, 90", "")):
        head = TITLE.replace("Friuli, 5/6/1976, Tolmezzo, 0", title)
        (found,) = read_channels(write(head + "NPTS= 4, DT= .01 SEC\n" + VALUES))
        assert found.direction == direction


def test_channels_of_cosmos_follow_one_another_from_the_first_line_on(write):
    """Nothing between the end of one and the header of the next, nor before the first."""
    lines = SAMPLES["cosmos"].splitlines()
    first = next(k for k, line in enumerate(lines) if "Integer-header" in line)
    level = "\n".join(lines[first:])
    upright = level.replace(f"{90:8d}", f"{400:8d}")
    found = read_channels(write(f"{level}\n{upright}\n{level}\n"))
    assert [each.is_vertical for each in found] == [False, True, False]
    for each in found:
        assert each.samples == pytest.approx(DAMAGE["WAVE"], abs=2e-4)


def test_counts_of_knet_are_about_their_mean(write):
    """An instrument's zero is no acceleration."""
    *head, _ = SAMPLES["knet"].partition("Memo")
    counts = np.array(SAMPLES["knet"].split("Memo")[1].split()[-40:], dtype=int) + 5000
    memo = SAMPLES["knet"].split("Memo")[1].splitlines()[0]
    (found,) = read_channels(write("".join(head) + memo + "\n" + "\n".join(map(str, counts))))
    assert found.samples == pytest.approx(DAMAGE["WAVE"] - DAMAGE["WAVE"].mean(), abs=2e-4)


@pytest.mark.parametrize("jitter", [0.24, 0.26])
def test_a_film_is_read_at_even_times(write, jitter):
    """Beyond a quarter of a step its trace, straight between the points, is sampled each 1 ms."""
    times = 0.01 * np.arange(101.0)
    times[50] += 0.01 * jitter  # of so many points one barely moves the line through all
    slope = 2.0  # m/s² per second: a straight line, which stays one
    numbers = np.column_stack([times, 100.0 * slope * times]).ravel()
    head = SAMPLES["smc_film"].partition("|made for a test\n")[0]
    head = head.replace(f"{80:10d}", f"{202:10d}")
    for wave in (DAMAGE["WAVE"].max(), DAMAGE["WAVE"].min()):
        head = head.replace(f"{100.0 * wave:15.7E}", f"{100.0 * slope:15.7E}")
    path = write(head + "|made for a test\n" + DAMAGE["rows"](numbers, "13.5E", 8))
    (found,) = read_channels(path)
    assert found.dt == pytest.approx(0.001 if jitter > 0.25 else 0.01, rel=1e-3)
    assert len(found.samples) == (1001 if jitter > 0.25 else 101)
    if jitter > 0.25:
        assert found.samples == pytest.approx(slope * 0.001 * np.arange(1001), abs=1e-5)


@pytest.mark.parametrize(
    ("form", "was", "becomes", "message"),
    [
        ("smc_film", f"{0.02:11.3E}", f"{0.2:11.3E}", "times decrease"),
        ("smc_film", f"{80:10d}", f"{64:10d}", "more follows after the 64 numbers"),
        ("smc_film", "1 UNC", "2 C", "does not state the sampling rate"),
        ("spaced", "40 Accelerogram", "16 Accelerogram", "more numbers follow after the 16"),
        (
            "spaced",
            "Uncorrected Acc",
            "Response and Fourier amplitude spectra",
            "volume 3.*volume 2",
        ),
        ("volume_1", "LENGTH =  0.390", "LENGTH =  0.790", "do not last 0.79 s"),
        ("volume_1", "G/10.     MAX", "G.     MAX", "states a peak of"),
        (
            "volume_1",
            "NO. OF POINTS =     40",
            "NO. OF POINTS =     41",
            "the file holds|numbers exp",
        ),
        ("usc", "AND G/10", "AND G/10\nRMS ACCLN. OF COMPLETE RECORD = 5.0 G/10", "the rms of"),
        ("bhrc", "COMP V2", "", "second channel begins"),
        ("bhrc", "DURATION =    .400", "DURATION =  40.000", "sampling interval 1 s"),
        ("geonet", f"peak {10.0 * DAMAGE['PEAK']:8.1f}", "peak  9999.0", "states a peak of"),
        ("geonet", f"{0:8d}" * 10 + "\n", "", "a line is lost"),
        ("unam", "/40/40/40", "/40/40/41", "differ in number of samples"),
        ("unam", "/40/40/40", "/39/39/39", "more follows"),
        ("unam", "/0.01/0.01", "/fast/fast", "differ in number|a number is expected"),
        ("unam", f"{DAMAGE['PEAK']:.4f}/", "9.9/", "states a peak of"),
        ("cwb", "(Hz): 100", "(Hz): 50", "the file holds|more follows|does not grow"),
        ("cwb", "(Hz): 100\n#", "(Hz): 40\n#RecordLength(sec): 1\n#", "more follows|does not grow"),
        ("cwb", f"{0.05:10.3f}", f"{0.08:10.3f}", "does not grow by 0.01 s"),
        ("cwb", "U(+); N(+)", "U(-); N(+)", "no line has"),
        ("cosmos", "acceleration pts", "raw accel.   pts", "no line has|volume 0"),
    ],
)
def test_doubts_about_further_formats(write, form, was, becomes, message):
    assert was in SAMPLES[form]
    with pytest.raises(af.InvalidInput, match=message):
        af.Motion.read(write(SAMPLES[form].replace(was, becomes, 1)))


def test_raw_counts_of_cosmos_are_named(write):
    content = SAMPLES["cosmos"].replace("acceleration pts", "raw accel.   pts")
    with pytest.raises(af.InvalidInput, match=r"volume 0\): use volume 1 or 2"):
        af.Motion.read(write(content.replace("units=cm/sec2(04)", "units=counts (50)")))


def test_a_response_belongs_to_binary_files(write):
    path = write(SAMPLES["knet"])
    with pytest.raises(af.InvalidInput, match="response= belongs to miniSEED and SAC"):
        af.Motion.read(path, response=path)


def test_zeros_that_fill_a_block_end_a_file(write):
    content = SAMPLES["smc_film"] + "\0" * 80 + "\n\x1a"
    assert read_channels(write(content))[0].samples == pytest.approx(DAMAGE["WAVE"], abs=2e-4)


def test_an_odd_count_of_numbers_of_a_film_includes_the_whole_last_pair(write):
    content = SAMPLES["smc_film"].replace(f"{80:10d}", f"{79:10d}")
    assert read_channels(write(content))[0].samples == pytest.approx(DAMAGE["WAVE"], abs=2e-4)


def test_one_line_left_over_in_the_last_block_of_a_film_is_no_sample(write):
    content = SAMPLES["smc_film"] + DAMAGE["rows"](np.array([9.0, 1.0, 9.1, 2.0]), "11.3E", 8)
    assert len(read_channels(write(content))[0].samples) == 40


def test_a_long_number_of_a_narrow_column_may_lose_its_decimals():
    """-11026 stands for -11026.2 where columns have eight letters; -933 for -933.5 does not."""
    for odd, sound in (("-11026", True), ("-933", False)):
        text = RecordText(Path("any"), (*[" -9333.5"] * 40, f"  {odd}"), True)
        if sound:
            assert text.read_block(0, 41)[0][-1] == -11026.0
        else:
            with pytest.raises(af.InvalidInput, match="not as many digits"):
                text.read_block(0, 41)


KEYS = [
    ("SMC", "2 CORRECTED ACCELEROGRAM", "*", 11),
    ("AFAD", "SAMPLING INTERVAL (sec) : 0.01", "NUMBER OF DATA : 40", 40),
    ("AFAD", "NUMBER OF DATA : 40", "SAMPLING INTERVAL (sec) : 0.01", 40),
    ("CSMIP", "", "   40 POINTS OF ACCEL DATA EQUALLY SPACED AT  .010 SEC.", 120),
    ("COSMOS", "", "Corrected acceleration (Format v01.20", 40),
    ("COSMOS", "", " 100 Integer-header values follow", 40),
    ("ESM", "", "NDATA: 40", 80),
    ("ESM", "", "SAMPLING_INTERVAL_S: 0.01", 80),
    ("K-NET", "", "Scale Factor      7845(gal)/8000000", 20),
    ("K-NET", "", "Sampling Freq(Hz) 100Hz", 20),
    ("UNAM", "", "ARCHIVO ESTANDAR DE ACELERACION:", 20),
    ("CWB", "", "#DataSequence: Time U(+); N(+); E(+)", 30),
    ("BHRC", "", "* VOL1DS FILE:  1/01", 3),
    ("volume 1", "", "NO. OF POINTS =  40  RECORD LENGTH =  0.390 SEC", 120),
    ("PEER", "NPTS= 40", "DT= .01 SEC", 12),
    ("PEER", "DT= .01 SEC", "NPTS= 40", 12),
]
"""A first line, another by which a format then is known, and how far down that may stand."""


@pytest.mark.parametrize(("form", "first", "key", "last"), KEYS)
def test_a_format_is_known_by_lines_of_its_header(form, first, key, last):
    for place, known in ((2, True), (last, True), (last + 1, False)):
        text = RecordText(Path("any"), (first, *["x"] * (place - 2), key, "x"), True)
        found = find_format(text)
        assert (found is not None and found.name.startswith(form)) is known
    assert find_format(RecordText(Path("any"), (first, "x"), True)) is None
