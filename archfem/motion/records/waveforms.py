"""Binary files of seismology, miniSEED and SAC, read with ObsPy."""

import re
import warnings
from io import BytesIO
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from archfem._files import read_bytes
from archfem._optional import require_package
from archfem.errors import InvalidInput
from archfem.motion.records.record_file import Channel, RecordText, parse_unit


def find_waveform_format(content: bytes) -> str | None:
    """Return miniSEED or SAC where the content of a file is of that format."""
    if re.match(rb"\d{6}[DRQM][ \0]|MS\x03", content):
        return "miniSEED"
    # SAC has no mark but the version of its header, number 77 of its words of four bytes
    version = content[304:308]
    known = {number.to_bytes(4, order) for number in (6, 7) for order in ("little", "big")}
    return "SAC" if version in known else None


def read(
    path: str | PathLike[str], *, form: str, units: str | None, response: str | PathLike[str] | None
) -> list[Channel]:
    """Read every channel of a file, without its mean: an instrument's zero is no acceleration."""
    with require_package("ObsPy"):
        import obspy
    if units is not None and response is not None:
        raise InvalidInput(f"{path}: give either units= or response=, which has a unit of its own")
    stream = _read_foreign(obspy.read, path, form)
    inventory = None
    if response is not None:
        inventory = _read_foreign(obspy.read_inventory, response, "StationXML")
    channels = []
    for name in dict.fromkeys(trace.id for trace in stream):
        trace = _merge_traces(path, name, stream)
        if units is not None:
            scale = parse_unit(units)
        elif inventory is not None:
            scale = _find_scale(path, trace, inventory)
        else:
            raise InvalidInput(
                f"{path}: {form} states no unit, and channel {name} may be counts of an instrument:"
                " give response= with its StationXML, or units= of samples that are accelerations"
            )
        samples = np.asarray(trace.data, dtype=float)
        samples = (samples - samples.mean()) * scale
        dt = RecordText(Path(path), (), True).check_step(float(trace.stats.delta))
        begin = float(trace.stats.starttime.timestamp)
        channels.append(Channel.from_direction(samples, dt, trace.stats.channel, begin))
    return channels


def _read_foreign(read: Any, path: str | PathLike[str], form: str) -> Any:
    """Read a file by ObsPy, whose errors are of many classes."""
    # ObsPy would load names as addresses and patterns, and guess formats that run code
    content = BytesIO(read_bytes(path, form))
    code = {"miniSEED": "MSEED"}.get(form, form.upper())
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = read(content, format=code)
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
        raise InvalidInput(f"{path} is no {form} that ObsPy reads ({reason})") from error
    if not len(found):
        raise InvalidInput(f"{path} holds no samples")
    return found


def _merge_traces(path: str | PathLike[str], name: str, stream: Any) -> Any:
    """Return the single trace of a channel, of pieces without gaps."""
    pieces = stream.select(id=name).copy()
    try:
        pieces.merge(method=-1)
    except Exception as error:  # ObsPy raises plain exceptions where steps or types differ
        raise InvalidInput(f"{path}: the pieces of channel {name} differ: {error}") from error
    if len(pieces) > 1:
        gaps = pieces.get_gaps()
        raise InvalidInput(
            f"{path}: channel {name} has {len(pieces)} pieces with a gap of {gaps[0][6]:g} s at "
            f"{gaps[0][4]}: give a file without gaps"
        )
    return pieces[0]


def _find_scale(path: str | PathLike[str], trace: Any, inventory: Any) -> float:
    """Return the acceleration of one count [m/s²], negative where a vertical counts downwards."""
    # Below a third of its corner an accelerometer answers by one number, its sensitivity.
    try:
        found = inventory.get_response(trace.id, trace.stats.starttime).instrument_sensitivity
        place = inventory.get_channel_metadata(trace.id, trace.stats.starttime)
        value, unit = float(found.value), str(found.input_units)
    except Exception as error:
        raise InvalidInput(
            f"{path}: the StationXML has no sensitivity of channel {trace.id} at "
            f"{trace.stats.starttime}: {error}"
        ) from error
    sensed = re.fullmatch(r"([NMC]?)M/(?:S(?:\*\*|\^)?2|S/S)", unit.strip().upper())
    if sensed is None:
        raise InvalidInput(
            f"{path}: channel {trace.id} records {unit}, no acceleration: use an accelerometer, "
            "whose code has N as its second letter"
        )
    if not 0.0 < abs(value) < np.inf:
        raise InvalidInput(f"{path}: channel {trace.id} has a sensitivity of {value:g} counts")
    if not np.array_equal(trace.data, np.rint(trace.data)):
        raise InvalidInput(
            f"{path}: channel {trace.id} has no whole numbers, so its samples are no counts: give "
            "units= in place of response="
        )
    scale = {"": 1.0, "C": 1e-2, "M": 1e-3, "N": 1e-9}[sensed[1]]
    return -scale / value if (place.get("dip") or 0.0) > 45.0 else scale / value
