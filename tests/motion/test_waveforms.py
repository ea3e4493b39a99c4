"""miniSEED and SAC: counts by the StationXML of their instrument, samples by their unit."""

import struct
import sys

import numpy as np
import pytest

import archfem as af
from archfem.cases.motion_keys import build_motion, parse_motion
from archfem.cases.provenance import hash_inputs

COUNTS = np.rint(4e5 * 0.5 * np.sin(0.7 * np.arange(400))).astype(np.int32) + 5000
SENSITIVITY = 4e5  # counts per m/s²
WAVE = (COUNTS - COUNTS.mean()) / SENSITIVITY


def sac(samples, order="<", channel="HNE", version=6):
    """Lay out a SAC file: 70 floats, 40 integers, 24 words of eight letters, samples."""
    floats, integers = np.full(70, -12345.0), np.full(40, -12345)
    floats[[0, 5, 6]] = 0.01, 0.0, 0.01 * (len(samples) - 1)
    integers[[0, 1, 2, 3, 4, 5]] = 2020, 1, 0, 0, 0, 0
    integers[[6, 9, 15, 35]] = version, len(samples), 1, 1
    words = [b"-12345  "] * 24
    words[0], words[20], words[21] = b"PLC     ", channel.encode().ljust(8), b"XX      "
    head = struct.pack(f"{order}70f40i", *floats, *integers)
    return head + b"".join(words) + struct.pack(f"{order}{len(samples)}f", *samples)


def station(tmp_path, *, unit="M/S**2", value=SENSITIVITY, code="HNE", dip=0.0):
    path = tmp_path / "station.xml"
    place = "<Latitude>0</Latitude><Longitude>0</Longitude><Elevation>0</Elevation>"
    path.write_text(
        '<FDSNStationXML xmlns="http://www.fdsn.org/xml/station/1" schemaVersion="1.1">'
        "<Source>test</Source><Created>2020-01-01T00:00:00</Created>"
        f'<Network code="XX"><Station code="PLC">{place}<Site><Name>Town</Name></Site>'
        f'<Channel code="{code}" locationCode="">{place}<Depth>0</Depth><Azimuth>90</Azimuth>'
        f"<Dip>{dip}</Dip><SampleRate>100</SampleRate><Response><InstrumentSensitivity>"
        f"<Value>{value}</Value><Frequency>1</Frequency><InputUnits><Name>{unit}</Name>"
        "</InputUnits><OutputUnits><Name>COUNTS</Name></OutputUnits></InstrumentSensitivity>"
        "</Response></Channel></Station></Network></FDSNStationXML>"
    )
    return path


@pytest.fixture
def miniseed(tmp_path):
    """Return a writer of a miniSEED file with one channel, of pieces that begin at some times."""
    obspy = pytest.importorskip("obspy", reason="ObsPy is not installed")

    def write(*pieces, code="HNE"):
        header = {"network": "XX", "station": "PLC", "channel": code, "delta": 0.01}
        traces = [
            obspy.Trace(data, {**header, "starttime": obspy.UTCDateTime(begin)})
            for begin, data in pieces
        ]
        obspy.Stream(traces).write(tmp_path / "record.mseed", format="MSEED")
        return tmp_path / "record.mseed"

    return write


def test_without_obspy_the_error_names_the_extra(tmp_path, monkeypatch):
    path = tmp_path / "record.sac"
    monkeypatch.setitem(sys.modules, "obspy", None)
    for order, version in (("<", 6), (">", 6), ("<", 7), (">", 7)):
        path.write_bytes(sac(WAVE, order, version=version))
        with pytest.raises(af.errors.NotInstalled, match=r"pip install 'archfem\[seismology\]'"):
            af.Motion.read(path, units="m/s2")
    path.write_bytes(b"000001D PLC  ")
    with pytest.raises(af.errors.NotInstalled, match="miniSEED and SAC need it"):
        af.Motion.read(path)


def test_binary_files_of_other_kinds_are_no_records(tmp_path):
    path = tmp_path / "record.bin"
    path.write_bytes(bytes(1000) + b"x")
    with pytest.raises(af.InvalidInput, match="not a text file"):
        af.Motion.read(path)


@pytest.mark.parametrize("order", "<>")
def test_sac_has_the_unit_that_is_given(tmp_path, order):
    pytest.importorskip("obspy", reason="ObsPy is not installed")
    path = tmp_path / "record.sac"
    path.write_bytes(sac(100.0 * WAVE + 3.0, order))
    motion = af.Motion.read(path, units="gal")
    assert motion.dt == pytest.approx(0.01, rel=1e-6)  # single precision
    # the offset of 3 gal is no acceleration; samples have single precision
    assert motion.horizontal == pytest.approx(WAVE, abs=1e-6)
    with pytest.raises(af.InvalidInput, match="SAC states no unit"):
        af.Motion.read(path)
    with pytest.raises(af.InvalidInput, match="SAC states its step itself"):
        af.Motion.read(path, units="gal", dt=0.01)
    with pytest.raises(af.InvalidInput, match="has 1 components"):
        af.Motion.read(path, units="gal", column=2)


def test_counts_become_accelerations_by_the_stationxml(miniseed, tmp_path):
    motion = af.Motion.read(miniseed((0, COUNTS)), response=station(tmp_path))
    assert motion.dt == 0.01
    assert motion.horizontal == pytest.approx(WAVE, abs=1e-12)


def test_a_case_names_its_response_beside_its_record(miniseed, tmp_path):
    station(tmp_path)
    settings = {"file": miniseed((0, COUNTS)).name, "response": "station.xml"}
    motion = build_motion(parse_motion(settings), tmp_path)
    assert motion.horizontal == pytest.approx(WAVE, abs=1e-12)
    # results are computed again where the response changes
    digests = set()
    for value in (SENSITIVITY, 2.0 * SENSITIVITY):
        station(tmp_path, value=value)
        digests.add(hash_inputs({"motion": settings}, tmp_path))
    assert len(digests) == 2


def test_a_channel_that_begins_later_is_shifted(miniseed, tmp_path):
    """Zeros stand where the instrument of the vertical did not record yet."""
    obspy = pytest.importorskip("obspy")
    header = {"network": "XX", "station": "PLC", "delta": 0.01}
    begin = obspy.UTCDateTime(2020, 1, 1)
    codes = ("HNZ", 3.0), ("HNN", 0.0), ("HNE", 0.004)
    traces = [
        obspy.Trace(COUNTS, {**header, "channel": code, "starttime": begin + later})
        for code, later in codes
    ]
    path = tmp_path / "three.mseed"
    obspy.Stream(traces).write(path, format="MSEED")
    motion = af.Motion.read(path, units="0.0000025 m/s2")
    assert motion.start_time == begin.timestamp
    assert motion.vertical == pytest.approx(np.append(np.zeros(300), WAVE), abs=1e-12)
    for name in ("horizontal", "transverse"):  # to the nearest step
        assert motion.component(name) == pytest.approx(WAVE, abs=1e-12)
    traces[0].stats.starttime = begin + 9.0
    obspy.Stream(traces).write(path, format="MSEED")
    with pytest.raises(af.InvalidInput, match=r"vertical from 2020-01-01T00:00:09\.000"):
        af.Motion.read(path, units="0.0000025 m/s2")


def test_pieces_that_meet_are_one_and_a_gap_is_refused(miniseed, tmp_path):
    path = miniseed((0, COUNTS[:150]), (1.5, COUNTS[150:]))
    assert af.Motion.read(path, response=station(tmp_path)).horizontal == pytest.approx(WAVE)
    path = miniseed((0, COUNTS[:150]), (2.0, COUNTS[150:]))
    with pytest.raises(af.InvalidInput, match=r"HNE has 2 pieces with a gap of 0\.5 s"):
        af.Motion.read(path, response=station(tmp_path))


@pytest.mark.parametrize(("dip", "sense"), [(-90.0, 1.0), (90.0, -1.0), (44.0, 1.0), (46.0, -1.0)])
def test_a_vertical_that_is_positive_downwards_is_turned_up(miniseed, tmp_path, dip, sense):
    path = miniseed((0, COUNTS), code="HNZ")
    unit = {"unit": "nm/s**2", "value": 1e-9 * SENSITIVITY}
    motion = af.Motion.read(path, response=station(tmp_path, code="HNZ", dip=dip, **unit))
    assert motion.horizontal == pytest.approx(sense * WAVE, abs=1e-12)


@pytest.mark.parametrize(
    ("made", "message"),
    [
        ({"unit": "M/S"}, "records M/S, no acceleration"),
        ({"value": 0.0}, "sensitivity of 0 counts"),
        ({"code": "HNN"}, "no sensitivity of channel XX.PLC..HNE"),
    ],
)
def test_responses_of_no_accelerometer_are_refused(miniseed, tmp_path, made, message):
    path = miniseed((0, COUNTS))
    with pytest.raises(af.InvalidInput, match=message):
        af.Motion.read(path, response=station(tmp_path, **made))


def test_doubtful_waveforms_are_refused(miniseed, tmp_path):
    path, response = miniseed((0, WAVE)), station(tmp_path)
    with pytest.raises(af.InvalidInput, match="no counts: give units="):
        af.Motion.read(path, response=response)
    with pytest.raises(af.InvalidInput, match="give either units= or response="):
        af.Motion.read(path, response=response, units="g")
    with pytest.raises(af.InvalidInput, match="no StationXML that ObsPy reads"):
        af.Motion.read(path, response=path)
    with pytest.raises(af.InvalidInput, match="there is no StationXML https://"):
        af.Motion.read(path, response="https://service.example/station.xml")
    with pytest.raises(af.InvalidInput, match="may be counts of an instrument"):
        af.Motion.read(path)
    path.write_bytes(path.read_bytes()[:60])
    with pytest.raises(af.InvalidInput, match=r"no miniSEED that ObsPy reads|holds no"):
        af.Motion.read(path, units="g")


# libmseed's messages about damaged letters are decoded by ObsPy, which fails in a callback
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_damaged_waveforms_raise_no_foreign_error(miniseed, tmp_path):
    rng = np.random.default_rng(5)
    whole = [miniseed((0, COUNTS)).read_bytes(), sac(WAVE)]
    response = station(tmp_path)
    for number in range(60):
        content = bytearray(whole[number % 2])
        for place in rng.integers(0, min(len(content), 700), 4):
            content[place] = rng.integers(0, 256)
        (tmp_path / "damaged").write_bytes(content)
        try:
            motion = af.Motion.read(tmp_path / "damaged", response=response)
        except af.InvalidInput:
            continue
        assert motion.pga > 0.0
