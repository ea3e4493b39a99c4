"""Records of every format, damaged at random, and outcomes of reading one."""

import numpy as np

from archfem import InvalidInput
from archfem.motion.records.reader import read_channels

WAVE = 0.5 * np.sin(0.7 * np.arange(40)) - 0.5 * np.sin(0.7 * np.arange(40)).mean()  # m/s²
PEAK = 100.0 * np.abs(WAVE).max()  # cm/s²


def rows(values, form, per_line):
    """Print values in lines."""
    cells = [format(value, form) for value in values]
    lines = ("".join(cells[at : at + per_line]) for at in range(0, len(cells), per_line))
    return "\n".join(lines) + "\n"


def peer():
    head = "PEER NGA RECORD\nTown, 1/2/1999, Place, 90\nACCELERATION TIME SERIES IN UNITS OF G\n"
    return head + "NPTS=     40, DT=   .0100 SEC,\n" + rows(WAVE / 9.80665, "16.7E", 5)


def afad():
    head = (
        "STRONG GROUND MOTION RECORDS OF TURKIYE\nPLACE                   : GAZIANTEP\n"
        "NUMBER OF DATA          : 40\nSAMPLING INTERVAL (sec) : 0.01\n"
        f"RAW PGA VALUES (gal)    : (N-S) {PEAK} (E-W) {PEAK} (U-D) {PEAK}\nCopyright\n"
        "       N-S          E-W          U-D\n"
    )
    return (head + rows(np.repeat(100.0 * WAVE, 3), "13.6f", 3)).replace("\n", "\r\n")


def esm():
    return (
        "EVENT_NAME: TOWN\nSTATION_CODE: PLC\nSAMPLING_INTERVAL_S: 0.010000\nNDATA: 40\n"
        "DURATION_S: 0.40\nSTREAM: HNE\nUNITS: cm/s^2\n"
        f"PGA_CM/S^2: {PEAK:.6f}\n"
        "HEADER_FORMAT: DYNA 1.2\nDATA_TYPE: ACCELERATION\nUSER1: \n"
    ) + rows(100.0 * WAVE, ".6f", 1)


def csmip():
    channels = []
    for number, direction in ((1, "90 DEG"), (2, "UP"), (3, " 0 DEG")):
        head = (
            f"CORRECTED ACCELEROGRAM   1-2       CHAN  {number}: {direction}     FROM\n"
            f"TOWN EARTHQUAKE\nPEAK ACCELERATION = {PEAK:9.3f}    CM/SEC/SEC  AT    .100   SEC.\n"
        )
        blocks = [
            f"   40 POINTS OF {kind} DATA EQUALLY SPACED AT  .010 SEC.  (UNITS: CM/SEC{more})\n"
            + rows(100.0 * WAVE, "10.3f", 8)
            for kind, more in (("ACCEL", "/SEC"), ("VELOC", ""))
        ]
        end = f"/&  ----------  END OF DATA FOR CHANNEL  {number}  ----------\n"
        channels.append(head + "".join(blocks) + end)
    return "".join(channels)


def cosmos():
    codes = np.full(100, -999)
    values = np.full(100, -999.0)
    codes[53] = 90
    values[[61, 62, 63]] = 10.0, 0.4, PEAK
    return (
        "Corrected acceleration    (Format v01.20 with 13 text lines)\nRecord of Town\n"
        " 100 Integer-header values follow on  10 lines, Format= (10I8)\n"
        + rows(codes, "8d", 10)
        + " 100 Real-header values follow on  20 lines, Format= (5F15.6)\n"
        + rows(values, "15.6f", 5)
        + '   1 Comment line(s) follow, each starting with a "|":\n| none\n'
        + "      40 acceleration pts, approx    0 secs, units=cm/sec2(04),Format=(1E15.6)\n"
        + rows(100.0 * WAVE, "15.6e", 1)
        + "End-of-data for ChanHNE acceleration\n"
    )


def smc():
    integers = np.full(48, -32768)
    reals = np.full(50, 1.7e38)
    integers[[12, 13, 15, 16]] = 90, 360, 2, 40
    reals[[1, 29, 31]] = 100.0, WAVE.max() * 100.0, WAVE.min() * 100.0
    head = "2 CORRECTED ACCELEROGRAM\n*\nPLC\n" + "station = Town    component= 360\n"
    comments = "|\n|made for a test\n"
    return (
        head + "*\n" * 7 + rows(integers, "10d", 8) + rows(reals, "15.7E", 5) + comments
    ) + rows(100.0 * WAVE, "10.3E", 8)


def smc_film():
    """Pairs of a time and a sample, of which the count is that of numbers."""
    integers = np.full(48, -32768)
    reals = np.full(50, 1.7e38)
    integers[[12, 13, 15, 16]] = 90, 360, 1, 80
    reals[[29, 31]] = WAVE.max() * 100.0, WAVE.min() * 100.0
    head = "1 UNCORRECTED ACCELEROGRAM\n*\nPLC\nstation = Town    component= 360\n" + "*\n" * 7
    headers = rows(integers, "10d", 8) + rows(reals, "15.7E", 5) + "|made for a test\n"
    return head + headers + rows(pairs(100.0 * WAVE), "11.3E", 8)


def pairs(values):
    """Put the times of samples before them."""
    return np.column_stack([0.01 * np.arange(len(values)), values]).ravel()


def spaced():
    """Volume 1 of a digital instrument, in g, without end marks."""
    channels = []
    for number, direction in ((1, "90 Deg"), (2, "Up")):
        head = (
            f"Uncorrected Accelerogram Data\nRcrd of a town\nChan  {number}: {direction}\n"
            f"Units of uncor data are sec and g.   Max  = {PEAK / 980.665:7.4f} g, at   .100 sec.\n"
            "   40 Accelerogram points at 100 pts/sec in units of g.       Format: (8f9.6)\n"
        )
        channels.append(head + rows(WAVE / 9.80665, "9.6f", 8))
    return "".join(channels)


def volume_1():
    """Pairs of a time and a sample in tenths of g, as RENADIC, USC and CDMG print them."""
    channels = []
    for number, direction in ((1, "L"), (2, "V"), (3, "T")):
        head = (
            f"UNCORRECTED ACCELEROGRAM DATA\nTOWN\nCHAN  {number}: {direction}        (STA CHN)\n"
            "NO. OF POINTS =     40  RECORD LENGTH =  0.390 SEC\n"
            "UNITS OF UNCOR ACCEL ARE SEC AND G/10.     "
            f"MAX  = {PEAK / 980.665:6.3f} G, AT   0.100 SEC\n"
            f"RMS ACCEL OF COMPLETE RECORD = {np.std(WAVE) / 9.80665:5.3f} G\n"
        )
        zeros = rows(np.zeros(100, int), "5d", 16) + rows(np.zeros(50), "10.3f", 8)
        end = f"/&  ----------  END OF DATA FOR CHANNEL {number}  ----------\n"
        channels.append(head + zeros + rows(pairs(WAVE / 0.980665), "9.4f", 10) + end)
    return "".join(channels)


def usc():
    """One channel, with the rms of its samples in place of their peak."""
    rms = np.std(WAVE) / 0.980665
    return (
        "FILE     0 OF UNCORRECTED ACCELEROGRAM DATA OF VOLUME I:\nTOWN\nCOMP N90E\n"
        "NO. OF POINTS =     40      DURATION =    .390 SEC\nUNITS ARE SEC AND G/10\n"
        f"RMS ACCLN. OF COMPLETE RECORD =     {rms:.3f} G/10\n"
        + rows(np.zeros(100, int), "5d", 16)
        + rows(np.zeros(50), "10.3f", 8)
        + rows(pairs(WAVE / 0.980665), "9.4f", 10)
    )


def bhrc():
    channels = []
    for name in ("L1", "V2", "T3"):
        head = (
            f"COMP {name}\nTown\nNO. OF POINTS =     40      DURATION =    .400\n"
            "UNITS ARE SECONDS AND G/10\n\n"
        )
        zeros = rows(np.zeros(100, int), "5d", 16) + rows(np.zeros(50), "12.6E", 8)
        channels.append(head + zeros + rows(WAVE / 0.980665, "14.6E", 10))
    return "* VOL1DS FILE:  1/01\nInst Type = SSA-2\n" + "".join(channels)


def geonet():
    channels = []
    for name in ("S90E", "N00E", "Up"):
        head = (
            "Corrected accelerogram 1_PLC_20 GNS Science\nTown\n"
            "Number of points  40    Duration   0.39 sec\n"
            "Instrument corrected data at 0.010 sec intervals\n"
            f"Component {name}  Accelerometer Axis\n"
            f"Acceleration:  peak {10.0 * PEAK:8.1f} mm/s/s at   0.10 sec     rms      1.0 mm/s/s\n"
        )
        numbers = rows(np.zeros(40, int), "8d", 10) + rows(np.zeros(60), "8.3f", 10)
        channels.append(head + numbers + rows(1000.0 * WAVE, "8.1f", 10) + rows(WAVE, "8.2f", 10))
    return "".join(channels)


def unam():
    shared = "{0}/{0}/{0}".format
    return (
        "ARCHIVO ESTANDAR DE ACELERACION:\nORIENTACION C1-C6 (rumbo;orientacion)  : /V/N00E/N90E\n"
        f"INTERVALO DE MUESTREO, C1-C6 (s)       : /{shared(0.01)}\n"
        f"NUM. TOTAL DE MUESTRAS, C1-C6          : /{shared(40)}\n"
        f"ACEL. MAX.(Gal), C1-C6                 : /{shared(f'{PEAK:.4f}')}\n"
        "UNIDADES DE LOS DATOS                  : Gal (cm/s/s)\nDATOS DE ACELERACION:\n"
        "---------+---------+---------+\n         V      N00E      N90E\n"
    ) + rows(np.repeat(100.0 * WAVE, 3), "10.4f", 3)


def cwb():
    highs = (100.0 * WAVE.max(), 100.0 * WAVE.min())
    peaks = "".join(f"#AmplitudeMAX. {c}: {highs[0]:8.3f}~ {highs[1]:8.3f}\n" for c in "UNE")
    table = np.column_stack([0.01 * np.arange(40), *[100.0 * WAVE] * 3])
    return (
        "#StationCode: PLC\n#RecordLength(sec): 0.4\n#SampleRate(Hz): 100\n"
        f"#AmplitudeUnit:  gal. DCoffset(corr)\n{peaks}"
        "#DataSequence: Time U(+); N(+); E(+)\n#Data: 4F10.3\n"
    ) + rows(table.ravel(), "10.3f", 4)


def knet():
    counts = np.rint(WAVE * 8e6 / 78.45).astype(int)
    head = (
        "Origin Time       2014/12/31 23:49:00\nStation Code      PLC001\n"
        "Sampling Freq(Hz) 100Hz\nDuration Time(s)  0.4\nDir.              E-W\n"
        "Scale Factor      7845(gal)/8000000\n"
        f"Max. Acc. (gal)   {PEAK:.3f}\nMemo.             \n"
    )
    return head + rows(counts, "9d", 8)


def columns():
    lines = (f"{0.01 * step:.3f}  {value:.6f}\n" for step, value in enumerate(WAVE))
    return "# time (s)  acceleration (m/s2)\n" + "".join(lines)


FORMATS = (peer, afad, esm, csmip, cosmos, smc, knet, columns)
FORMATS += (smc_film, spaced, volume_1, usc, bhrc, geonet, unam, cwb)
SAMPLES = {make.__name__: make() for make in FORMATS}


def damaged(content, random):
    """Return a content (bytes) with one to three damages."""
    for _ in range(random.integers(1, 4)):
        content = _damage(content, random)
    return content


def _damage(content, random):
    at = int(random.integers(0, max(len(content), 1)))
    kind = random.integers(0, 9)
    if kind == 0:
        return content[:at]
    if kind == 1:
        return content[:at] + content[at + int(random.integers(1, 30)) :]
    if kind == 2:
        return content[:at] + bytes(random.integers(0, 256, 3, dtype=np.uint8)) + content[at:]
    if kind == 3:
        return (
            content[:at]
            + bytes(random.choice(list(b"0123456789+-.eE ,\n"), 1).astype(np.uint8))
            + content[at + 1 :]
        )
    lines = content.split(b"\n")
    line = int(random.integers(0, min(len(lines), 60)))
    if kind == 4:
        del lines[line]
    elif kind == 5:
        lines.insert(line, lines[int(random.integers(0, len(lines)))])
    elif kind == 6:
        other = int(random.integers(0, len(lines)))
        lines[line], lines[other] = lines[other], lines[line]
    elif kind == 7:
        words = lines[line].split(b" ")
        words[int(random.integers(0, len(words)))] = bytes(
            random.choice([b"nan", b"inf", b"1e999", b"-1", b"0", b"99999999999", b"****", b""])
        )
        lines[line] = b" ".join(words)
    else:
        lines[line] = lines[line].lower() if random.random() < 0.5 else b""
    return b"\n".join(lines)


def mutants(count, *, seed, sources=None):
    """Yield damaged files (bytes), by default of the samples above."""
    random = np.random.default_rng(seed)
    sources = sources or [sample.encode() for sample in SAMPLES.values()]
    for number in range(count):
        yield damaged(sources[number % len(sources)], random)


def outcome(path, original):
    """Return the outcome of reading a damaged file, given the undamaged channels."""
    try:
        channels = read_channels(path)
    except InvalidInput:
        return "refused"
    if [channel.samples.shape for channel in channels] != [row.samples.shape for row in original]:
        return "read, other number of samples"
    apart = [
        np.count_nonzero(~np.isclose(one.samples, two.samples, rtol=1e-6, atol=1e-9))
        for one, two in zip(channels, original, strict=True)
    ]
    steps = [one.dt != two.dt for one, two in zip(channels, original, strict=True)]
    if any(steps):
        return "read, other step"
    return "read, as undamaged" if max(apart) == 0 else f"read, {min(max(apart), 3)} samples differ"
