"""What a case says of the ground: one motion, or a suite of them and its target spectrum."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from archfem.cases.settings import Table, checked, chosen
from archfem.errors import InvalidInput
from archfem.motion.design_spectra import DesignSpectrum, Eurocode8, TableSpectrum, Tbec2018
from archfem.motion.motion import Motion
from archfem.motion.newer_codes import Asce2022, Eurocode2024, Ntc2018
from archfem.motion.suite import Suite

SYNTHETIC = {"duration": "s", "pga": "m/s**2", "seed": int, "dt": "s", "vertical_ratio": "1"}
SOURCE = {
    **{"file": str, "column": int, "units": str, "dt": "s"},
    "synthetic": dict,
    "samples": ["m/s**2"],
}
IDLE: dict[str, set[str]] = {
    "file": set(),
    "synthetic": {"column", "units", "dt"},
    "samples": {"column", "units"},
}
"""Keys that say nothing of a motion from elsewhere than a file."""

MOTION = {
    **SOURCE,
    "vertical": (str, dict),
    "resample": "s",
    "start": "s",
    "end": "s",
    "scale": "1",
    "reversed": bool,
}
SUITE = {
    "name": str,
    "folder": str,
    "reversed": bool,
    "target": dict,
    "matched": bool,
    "scale": "1",
    "reduction": "1",
    "pairs": dict,
}
TARGETS: dict[str, tuple[Callable[..., DesignSpectrum], Table]] = {
    "TBEC-2018": (Tbec2018, {"ss": "1", "s1": "1", "site": str}),
    "EC8": (Eurocode8, {"ag": "1", "ground": str, "type": int}),
    "NTC-2018": (
        Ntc2018,
        {"ag": "1", "f0": "1", "tc_star": "s", "site": str, "topography": "1"},
    ),
    "ASCE-7-22": (Asce2022, {"sds": "1", "sd1": "1", "tl": "s"}),
    "EC8-2024": (
        Eurocode2024,
        {"s_alpha": "1", "s_beta": "1", "f_alpha": "1", "f_beta": "1", "topography": "1"},
    ),
    "table": (TableSpectrum, {"periods": ["s"], "values": ["1"], "vertical_values": ["1"]}),
}
"""Design spectra by name, for 5 % damping; accelerations are in g."""


def motion_settings(given: Any, section: str = "motion") -> dict[str, Any]:
    """Return what a case says of one motion, checked.

    Args:
        given: the table as read.
        section: its name, for errors.

    Raises:
        InvalidInput: a key or value cannot be meant, or it is not clear where the motion is from.
    """
    settings = _source_settings(given, MOTION, section)
    if isinstance(settings.get("vertical"), dict):
        upright = _source_settings(settings["vertical"], SOURCE, f"{section}.vertical")
        if "vertical_ratio" in upright.get("synthetic", {}):
            raise InvalidInput(
                f"{section}.vertical.synthetic.vertical_ratio: a vertical has none, its pga is its "
                "own peak"
            )
        settings["vertical"] = upright
    return settings


def ground_motion(settings: Table, folder: Path = Path(), section: str = "motion") -> Motion:
    """Return a motion as a case describes it: read or made, then resampled, cut and scaled.

    Args:
        settings: as checked by `motion_settings`.
        folder: where relative file names start.
        section: name of the table, for errors.

    Raises:
        InvalidInput: a file cannot be read, or horizontal and vertical differ in step.
    """
    motion = _from_source(settings, folder)
    step = settings.get("resample")
    motion = motion if step is None else motion.resampled(step)
    if "vertical" in settings:
        upright = settings["vertical"]
        other = _upright({"file": upright} if isinstance(upright, str) else upright, folder)
        other = other if step is None else other.resampled(step)
        if abs(other.dt - motion.dt) > 1e-6 * motion.dt:
            raise InvalidInput(
                f"{section}: the vertical has a step of {other.dt:g} s, the horizontal of "
                f'{motion.dt:g} s: bring both to one with {section}.resample = "{motion.dt:g} s"'
            )
        motion = motion.with_vertical(other)
    if "start" in settings or "end" in settings:
        motion = motion.cut(settings.get("start", 0.0), settings.get("end"))
    motion = motion.reversed() if settings.get("reversed", False) else motion
    return motion.scaled(settings.get("scale", 1.0))


def suite_settings(given: Any) -> dict[str, Any]:
    """Return what a case says of a suite, checked.

    Args:
        given: the table as read.

    Raises:
        InvalidInput: a key or value cannot be meant, there is no pair, or no target to match.
    """
    settings = checked(given, SUITE, "suite")
    pairs = settings.get("pairs", {})
    if not pairs:
        raise InvalidInput(
            "suite.pairs is empty: write a table for each pair, e.g. "
            "[suite.pairs.first] with synthetic = { seed = 1 }"
        )
    for name in pairs:
        if not re.fullmatch(r"\w[\w +-]*", name):
            raise InvalidInput(
                f"suite.pairs: '{name}' names a folder of results too: use letters, digits, _ and -"
            )
    settings["pairs"] = {
        name: motion_settings(pair, f"suite.pairs.{name}") for name, pair in pairs.items()
    }
    if settings.get("matched", False) and "target" not in settings:
        raise InvalidInput(
            "suite.matched = true needs a target, e.g. "
            'target = { code = "TBEC-2018", ss = 1.14, s1 = 0.315, site = "ZD" }'
        )
    target_spectrum(settings)
    return settings


def target_spectrum(settings: Table) -> DesignSpectrum | None:
    """Return the target spectrum of a suite, or None where it has none.

    Args:
        settings: as checked by `suite_settings`.

    Raises:
        InvalidInput: the code is not known, or what it needs is missing or out of range.
    """
    if "target" not in settings:
        return None
    given = dict(settings["target"])
    code = chosen(given.pop("code", None), TARGETS, "suite.target.code")
    make, keys = TARGETS[code]
    try:
        return make(**checked(given, keys, "suite.target"))
    except TypeError as error:
        raise InvalidInput(f"suite.target of {code}: {error}") from error


def ground_pairs(settings: Table, folder: Path = Path()) -> tuple[Motion, ...]:
    """Return the pairs of a suite, read or made, under their own names, not matched yet.

    Args:
        settings: as checked by `suite_settings`.
        folder: where relative file names start, or the name of the suite's own folder.

    Raises:
        InvalidInput: a file cannot be read.
    """
    files = folder / settings.get("folder", "")
    return tuple(
        replace(ground_motion(pair, files, f"suite.pairs.{name}"), name=name, transverse=None)
        for name, pair in settings["pairs"].items()
    )


def ground_suite(settings: Table, folder: Path = Path()) -> Suite:
    """Return a suite of pairs, read or made, under their own names, and matched where asked.

    Args:
        settings: as checked by `suite_settings`.
        folder: where relative file names start, or the name of the suite's own folder.

    Raises:
        InvalidInput: a file cannot be read or a pair not be matched.
        DidNotConverge: a pair did not come near the target.
    """
    suite = Suite(
        settings.get("name", "suite"),
        ground_pairs(settings, folder),
        scale=settings.get("scale", 1.0),
        reduction=settings.get("reduction", 1.0),
    )
    target = target_spectrum(settings)
    suite = suite.matched(target) if target and settings.get("matched", False) else suite
    return suite.reversed() if settings.get("reversed", False) else suite


def _source_settings(given: Any, keys: Table, section: str) -> dict[str, Any]:
    """Check a table that says where a motion is from: a file, its own samples, or a seed."""
    settings = checked(given, keys, section)
    sources = sorted({"file", "synthetic", "samples"} & set(settings))
    if len(sources) != 1:
        raise InvalidInput(
            f"{section} needs either a file, or synthetic = {{ seed = 1, … }} to make one, or "
            f"samples = [ … ] and dt; it has {sources or 'none of them'}"
        )
    if "synthetic" in settings:
        settings["synthetic"] = checked(settings["synthetic"], SYNTHETIC, f"{section}.synthetic")
    idle = sorted(IDLE[sources[0]] & set(settings))
    if idle:
        raise InvalidInput(f"{section}.{idle[0]} belongs to a file, not to {sources[0]}")
    if sources == ["samples"] and "dt" not in settings:
        raise InvalidInput(f'{section}.samples needs the time between them, e.g. dt = "5 ms"')
    return settings


def _upright(settings: Table, folder: Path) -> Motion:
    """A vertical, read or made: what is asked of one that is made is asked of its vertical."""
    if "synthetic" not in settings:
        return _from_source(settings, folder)
    return Motion.synthetic(**settings["synthetic"], vertical_ratio=1.0)


def _from_source(settings: Table, folder: Path) -> Motion:
    """Read a file by its own keywords, take the samples that are given, or make a motion."""
    if "samples" in settings:
        return Motion(np.array(settings["samples"]), settings["dt"])
    if "synthetic" in settings:
        return Motion.synthetic(**settings["synthetic"])
    options = {key: settings[key] for key in ("column", "units", "dt") if key in settings}
    return Motion.read(folder / settings["file"], **options)
