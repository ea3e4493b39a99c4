"""Sections [motion] and [suite] of case files: ground motions, suites and target spectra."""

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from inspect import getdoc, signature
from pathlib import Path
from typing import Any

import numpy as np

from archfem._typing import Array
from archfem._validation import check_choice, declared_keys
from archfem.cases.toml_file import Table, check_table, format_tables, read_object
from archfem.errors import InvalidInput
from archfem.motion import design_spectra
from archfem.motion.design_spectra import DesignSpectrum, FloorSpectrum
from archfem.motion.matching import DEFAULT_BAND
from archfem.motion.motion import Motion
from archfem.motion.record_selection import RecordSelection
from archfem.motion.suite import Suite

# What makes a motion of the keys of its table
MADE: Mapping[str, Callable[..., Motion]] = {"synthetic": Motion.synthetic, "held": Motion.held}


def source_keys() -> dict[str, Any]:
    """Return the keys of the source of a component: a file, samples, or synthetic."""
    source = declared_keys(Motion.read) | {"synthetic": dict, "samples": ["m/s**2"]}
    source["file"] = source.pop("path")
    for component in ("vertical", "transverse"):  # which has a source of its own, or is not felt
        del source[component]
    return source


def motion_keys() -> dict[str, Any]:
    """Return the keys of one motion."""
    own = declared_keys(Motion.cut) | declared_keys(Motion.with_rest)
    own |= {"vertical": (str, dict), "held": dict}
    own |= {"resample": "s", "scale": "1", "reversed": bool, "baseline_corrected": bool}
    return source_keys() | own


def suite_keys() -> dict[str, Any]:
    """Return the keys of [suite]."""
    keys = declared_keys(Suite) | {"pairs": dict, "folder": str, "target": dict}
    keys |= {"matched": bool, "band": ["s"], "reversed": bool}
    del keys["matches"]  # results of matching
    return keys


def parse_motion(table: Any, section: str = "motion") -> dict[str, Any]:
    """Return the checked keys of one motion."""
    source = source_keys()
    settings = _parse_source(table, motion_keys(), section)
    if isinstance(settings.get("vertical"), dict):
        vertical = _parse_source(settings["vertical"], source, f"{section}.vertical")
        if "vertical_ratio" in vertical.get("synthetic", {}):
            raise InvalidInput(
                f"{section}.vertical.synthetic.vertical_ratio: a vertical has none, its pga is its "
                "own peak"
            )
        settings["vertical"] = vertical
    return settings


def build_motion(settings: Table, folder: Path = Path(), section: str = "motion") -> Motion:
    """Read or synthesise a motion, then resample, correct, cut, extend, reverse and scale it."""
    motion = _build_source(settings, folder)
    step = settings.get("resample")
    motion = motion if step is None else motion.resampled(step)
    if "vertical" in settings:
        vertical = _build_vertical(settings["vertical"], folder)
        vertical = vertical if step is None else vertical.resampled(step)
        if abs(vertical.dt - motion.dt) > 1e-6 * motion.dt:  # equal but for round-off
            raise InvalidInput(
                f"{section}: the vertical has a step of {vertical.dt:g} s, the horizontal of "
                f"{motion.dt:g} s: bring both to the shorter with {section}.resample = "
                f'"{min(vertical.dt, motion.dt):g} s"'
            )
        motion = motion.with_vertical(vertical)
    if settings.get("baseline_corrected", False):
        motion = motion.baseline_corrected()
    # Times of the case are those of the resampled motion, before it is reversed.
    if "start" in settings or "end" in settings:
        motion = motion.cut(settings.get("start", 0.0), settings.get("end"))
    motion = motion.with_rest(settings.get("rest", 0.0))
    motion = motion.reversed() if settings.get("reversed", False) else motion
    return motion.scaled(settings.get("scale", 1.0))


def write_motion(motion: Any) -> dict[str, Any]:
    """Return a motion, the file of a record, or a table, as [motion]."""
    if isinstance(motion, str | Path):
        return {"file": str(motion)}
    if isinstance(motion, Mapping):
        return dict(motion)
    if isinstance(motion, Motion):
        table = {"samples": motion.horizontal.tolist(), "dt": float(motion.dt)}
        if motion.vertical is None:
            return table
        return table | {"vertical": table | {"samples": motion.vertical.tolist()}}
    raise InvalidInput(
        f"a motion is a {type(motion).__name__}: give a Motion, a record's file, or a table as "
        "under [motion]"
    )


def parse_suite(table: Any) -> dict[str, Any]:
    """Return the checked keys of a suite."""
    settings = check_table(table, suite_keys(), "suite")
    pairs = settings.get("pairs", {})
    if not pairs:
        raise InvalidInput(
            "suite.pairs is empty: write a table for each pair, e.g. "
            "[suite.pairs.first] with synthetic = { seed = 1 }"
        )
    # Each pair has a result folder of its name.
    for name in pairs:
        if not re.fullmatch(r"\w[\w +-]*", name):
            raise InvalidInput(
                f"suite.pairs: '{name}' names a folder of results too: use letters, digits, _ and -"
            )
    settings["pairs"] = {
        name: parse_motion(pair, f"suite.pairs.{name}") for name, pair in pairs.items()
    }
    if settings.get("matched", False) and "target" not in settings:
        raise InvalidInput(
            "suite.matched = true needs a target, e.g. "
            'target = { code = "TBEC-2018", ss = 1.14, s1 = 0.315, site = "ZD" }'
        )
    if len(band := settings.get("band", DEFAULT_BAND)) != 2:
        raise InvalidInput(f"suite.band = {band}: give two periods, as in ['0.03 s', '2 s']")
    build_target_spectrum(settings)  # refuses parameters of the code that are out of range
    return settings


def build_target_spectrum(settings: Table) -> DesignSpectrum | None:
    """Return the target spectrum of a suite, or None."""
    return build_spectrum(settings["target"], "suite.target") if "target" in settings else None


def build_spectrum(table: Table, section: str) -> DesignSpectrum:
    """Return the design spectrum of a table with its code, whose accelerations are in g."""
    values, known = dict(table), design_spectra.registered_spectra
    code = check_choice(values.pop("code", None), f"{section}.code", known)
    spectrum = known[code]
    own, every = declared_keys(spectrum), map(declared_keys, known.values())
    if others := sorted(set().union(*every).intersection(values).difference(own)):
        raise InvalidInput(
            f"unknown key '{section}.{others[0]}': it is of another code than {code}, whose keys "
            f'are {sorted(own)}: leave it out (remove = ["{section}"] leaves out the table of a '
            "base)"
        )
    values = check_table(values, own, section)
    if "ground_spectrum" in values and spectrum is FloorSpectrum:
        key = "ground_spectrum"
        values[key] = build_spectrum(values[key], f"{section}.{key}")
    given = signature(spectrum).parameters.items()
    missing = [key for key, each in given if each.default is each.empty and key not in values]
    if missing:
        text = getdoc(spectrum) or ""
        stated = {key: re.search(rf"^ +{key}: ([^;:\n]+)", text, re.M) for key in missing}
        listed = [f"'{key}'" + (f", {x[1].rstrip('.')}" if x else "") for key, x in stated.items()]
        raise InvalidInput(f"{section} of {code}: give also {'; '.join(listed)}")
    return design_spectra.build_registered_spectrum(code, values)


def build_pairs(settings: Table, folder: Path = Path()) -> tuple[Motion, ...]:
    """Return the pairs of a suite under their names, before spectral matching and rest."""
    files = folder / settings.get("folder", "")
    pairs = {
        name: build_motion(pair | {"rest": 0.0}, files, f"suite.pairs.{name}")
        for name, pair in settings["pairs"].items()
    }
    # Without the transverse component, which plane structures do not feel.
    return tuple(replace(pair, name=name, transverse=None) for name, pair in pairs.items())


def find_matched_band(suite: Table | None) -> tuple[float, float] | None:
    """Return the periods from which and up to which a suite is matched [s], or None."""
    if not suite or not suite.get("matched", False):
        return None
    low, high = suite.get("band", DEFAULT_BAND)
    return low, high


def build_suite(settings: Table, folder: Path = Path()) -> Suite:
    """Return a suite of pairs, matched to its target spectrum if the case says so."""
    factors = {key: settings.get(key, 1.0) for key in ("scale", "reduction")}
    suite = Suite(settings.get("name", "suite"), build_pairs(settings, folder), **factors)
    target = build_target_spectrum(settings)
    if target and (band := find_matched_band(settings)):
        suite = suite.matched(target, band=band)
    # matching would shake the ground at rest
    rests = [pair.get("rest", 0.0) for pair in settings["pairs"].values()]
    rested = (pair.with_rest(rest) for pair, rest in zip(suite.pairs, rests, strict=True))
    suite = replace(suite, pairs=tuple(rested))
    return suite.reversed() if settings.get("reversed", False) else suite


def write_selected_suite(selection: RecordSelection, folder: Path, target: Table) -> str:
    """Write the [suite] of selected records of a folder, with a target spectrum, as TOML."""
    pairs: dict[str, Any] = {}
    for record in selection.records:
        name = re.sub(r"[^\w +-]", "_", record.motion.name)
        name = f"{name} {len(pairs) + 1}" if name in pairs else name
        pair = {
            component: _locate_component(path, record.motion.component(component), folder)
            for component, (path, _) in record.sources.items()
            if component != "transverse"  # which plane structures do not feel
        }
        pairs[name] = pair.pop("horizontal") | pair | {"scale": record.scale}
    suite = {"name": selection.rule.name, "folder": str(folder), "target": target, "pairs": pairs}
    return format_tables({"suite": suite})


def _locate_component(path: Path, samples: Array, folder: Path) -> dict[str, Any]:
    """Return the file of a component, and its column where it is not the first."""
    # columns of plain files count a column of times, which numbers of channels do not; a component
    # that begins later than another one has zeros in front
    shaken = np.trim_zeros(samples, "f")
    for column in (None, 1, 2, 3, 4):
        try:
            read = Motion.read(path, column=column).horizontal
            if np.array_equal(np.trim_zeros(read, "f"), shaken):
                number = {} if column is None else {"column": column}
                return {"file": path.absolute().relative_to(folder).as_posix(), **number}
        except InvalidInput:
            continue
    raise InvalidInput(f"{path} was changed while it was read: select again")


def _parse_source(table: Any, keys: Table, section: str) -> dict[str, Any]:
    """Check the keys of the source of a motion: a file, samples, or synthetic."""
    settings = check_table(table, keys, section)
    sources = sorted({"file", "samples", *MADE} & set(settings))
    if len(sources) != 1:
        raise InvalidInput(
            f"{section} needs either a file, or synthetic = {{ seed = 1, … }} to make one, or "
            f'held = {{ push = "0.4 g" }}, or samples = [ … ] and dt; it has '
            f"{sources or 'none of them'} "
            f'(remove = ["{section}.synthetic"] leaves out that of a base)'
        )
    (source,) = sources
    if source in MADE:
        keys = declared_keys(MADE[source])
        settings[source] = check_table(settings[source], keys, f"{section}.{source}")
    # Keys that describe a file are errors beside another source; samples have a step.
    of_files = {"column", "units", "response"} | ({"dt"} if source in MADE else set())
    if unused := sorted(of_files & set(settings) if source != "file" else ()):
        raise InvalidInput(f"{section}.{unused[0]} belongs to a file, not to {source}")
    if source == "held":  # its keys depend on each other, and one has no default
        read_object(MADE[source], settings[source], f"{section}.{source}")
    if source == "samples" and "dt" not in settings:
        raise InvalidInput(f'{section}.samples needs the time between them, e.g. dt = "5 ms"')
    return settings


def _build_vertical(source: str | Table, folder: Path) -> Motion:
    """Return the vertical motion of a file, of samples, or synthetic with a peak of its own."""
    settings: Table = {"file": source} if isinstance(source, str) else source
    if "synthetic" in settings:
        # The vertical component of a synthetic motion: ratio 1 gives it the PGA of the table.
        return Motion.synthetic(**settings["synthetic"], vertical_ratio=1.0)
    return _build_source(settings, folder)


def _build_source(settings: Table, folder: Path) -> Motion:
    """Return the motion of samples, of a seed, or of a file with its keywords."""
    if "samples" in settings:
        return Motion(np.array(settings["samples"]), settings["dt"])
    for source in MADE.keys() & settings.keys():
        return MADE[source](**settings[source])
    options = {key: settings[key] for key in ("column", "units", "dt") if key in settings}
    if "response" in settings:
        options["response"] = folder / settings["response"]
    return Motion.read(folder / settings["file"], **options)
