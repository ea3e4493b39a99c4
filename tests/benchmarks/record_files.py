"""Which record files of a folder are read: a table by format, and why the others are refused.

    python tests/benchmarks/record_files.py FOLDER [--all]

Files of equal content count once. miniSEED takes the StationXML of its station in its folder, where
there is one. Text formats compare the samples with the peak of their header where they state one,
so a file that is read has the peak that its network published. `--all` prints every file.
"""

import argparse
import re
from collections import Counter, defaultdict
from hashlib import sha256
from pathlib import Path

import numpy as np

from archfem import ArchfemError
from archfem.motion import RecordText
from archfem.motion.records.reader import find_format, read_channels
from archfem.motion.records.waveforms import find_waveform_format

# Files beside records that are none: events, stations, pictures, archives
OTHER_FILES = "json xml yml yaml csv png html h5 xlsx grd md pdf mat zip pkl"


def list_records(folder):
    """Yield files that may be records, each content once."""
    seen = set()
    for path in sorted(folder.rglob("*")):
        if not path.is_file() or path.suffix[1:].lower() in OTHER_FILES.split():
            continue
        digest = sha256(path.read_bytes()).digest()
        if digest not in seen:
            seen.add(digest)
            yield path


def name_format(path):
    """Return the name of the format of a file."""
    content = path.read_bytes()
    if form := find_waveform_format(content):
        return form
    try:
        form = find_format(RecordText.decode(path, content))
    except ArchfemError:
        return "not a record"
    return "plain columns" if form is None else form.name


def find_response(path):
    """Return the StationXML beside a file that begins as its name does, or None."""
    station = re.match(r"\w+\.\w+", path.name)
    return next(path.parent.glob(f"{station[0]}*.xml"), None) if station else None


def read(path, form):
    """Return a line about the channels of a file, and whether it was read."""
    response = find_response(path) if form == "miniSEED" else None
    try:
        channels = read_channels(path, response=response)
    except ArchfemError as error:
        return str(error).replace(str(path), "").lstrip(":, "), False
    peaks = ", ".join(f"{each.direction} {np.abs(each.samples).max():.4g}" for each in channels)
    return f"{len(channels[0].samples)} × {channels[0].dt:g} s, peaks {peaks} m/s²", True


def main():
    options = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    options.add_argument("folder", type=Path)
    options.add_argument("--all", action="store_true")
    given = options.parse_args()
    table, reasons = defaultdict(Counter), defaultdict(list)
    for path in list_records(given.folder):
        form = name_format(path)
        line, was_read = read(path, form)
        table[form][was_read] += 1
        if not was_read:
            # alike but for line, channel and values
            alike = re.sub(r"^line \d+: |(?<=channel )\S+|[-+\d.]*\d|\d+T\S+", "…", line)
            reasons[form, alike].append((path, line))
        if given.all:
            print(f"{'read   ' if was_read else 'refused'} {path}: {line}")
    print(f"{'format':<32}{'files':>6}{'read':>6}{'refused':>9}")
    for form, counts in sorted(table.items()):
        print(f"{form:<32}{counts.total():>6}{counts[True]:>6}{counts[False]:>9}")
    every = sum(table.values(), Counter())
    print(f"{'all':<32}{every.total():>6}{every[True]:>6}{every[False]:>9}\n")
    for (form, _), files in sorted(reasons.items()):
        path, line = files[0]
        print(f"{len(files):>4} {form}: {line} ({path.name})")


if __name__ == "__main__":
    main()
