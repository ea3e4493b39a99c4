"""One analysis as one value, read from a TOML file.

Numbers are SI (angles in degrees), or quantities with a unit such as "1.48 MPa/mm". A key that is
not known, a wrong unit or an impossible geometry is an error that names the key and the remedy.
"""

import difflib
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tomli_w

from archfem.errors import ArchfemError, InvalidInput
from archfem.materials import CONTACTS, MATERIALS, Contact, Material
from archfem.motion import Motion
from archfem.quantities import in_unit
from archfem.schemes import HHT, Newmark, Rayleigh, Scheme
from archfem.shapes import circular_arch, column
from archfem.structure import Structure

Table = Mapping[str, Any]

# What a key may hold: a unit for a number, a Python type, or [unit] for a list of numbers.
RING = {
    "radius": "m",
    "embrace": "degree",
    "span": "m",
    "rise": "m",
    "thickness": "m",
    "voussoirs": int,
    "chords": int,
    "width": "m",
    "gravity": "m/s**2",
}
COLUMN = {"breadth": "m", "heights": ["m"], "width": "m", "gravity": "m/s**2"}
SHAPES: dict[str, tuple[Callable[..., Structure], Table]] = {
    "circular_arch": (circular_arch, RING),
    "column": (column, COLUMN),
}
MATERIAL = {"young": "Pa", "poisson": "1", "unit_weight": "N/m**3", "strength": "Pa"}
CONTACT = {"normal_stiffness": "Pa/m", "shear_stiffness": "Pa/m", "friction": "1"}
MODEL = {
    "fidelity": str,
    "cells": [int],
    "cell": str,
    "degree": int,
    "quadrature": str,
    "points": int,
}
SYNTHETIC = {"duration": "s", "pga": "m/s**2", "seed": int, "dt": "s", "vertical_ratio": "1"}
RECORD = {"file": str, "vertical": str, "column": int, "units": str, "dt": "s"}
CHANGES = {"scale": "1", "start": "s", "end": "s"}
MOTION = {"synthetic": dict, **RECORD, **CHANGES}
DAMPING = {"ratio": "1", "frequencies": ["Hz"], "joints": str}
ANALYSIS = {"dt": "s", "scheme": str, "alpha": "1", "damping": dict, "halt": bool}
OUTPUT = {"every": int, "fields_every": int, "joints": [int], "animation": bool}
SECTIONS = ("title", "structure", "materials", "contacts", "model", "motion", "analysis", "output")


@dataclass(frozen=True)
class Case:
    """One analysis: structure, model, motion, and what to do with them.

    Attributes:
        title: in words.
        structure: what stands.
        model: keywords of `build`.
        motion: what the file says of the ground motion, or None for dead load alone.
        analysis: what it says of the time history.
        output: what it says of what to keep and draw.
        settings: the whole case as it was understood, to be written again.
        folder: where relative file names start.
    """

    title: str
    structure: Structure
    model: dict[str, Any]
    motion: dict[str, Any] | None
    analysis: dict[str, Any]
    output: dict[str, Any]
    settings: dict[str, Any] = field(repr=False)
    folder: Path = Path()

    @classmethod
    def read(cls, path: str | Path, changes: Sequence[str] = ()) -> "Case":
        """Read a case file.

        Args:
            path: a TOML file.
            changes: "section.key=value" each, instead of what the file says.

        Raises:
            InvalidInput: what cannot be meant, with the key, the value and the remedy.
            InvalidStructure: lengths that do not make a structure.
        """
        path = Path(path)
        if not path.is_file():
            raise InvalidInput(f"there is no case file {path}")
        try:
            settings = tomllib.loads(path.read_text(encoding="utf-8"))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise InvalidInput(f"{path} is not TOML: {error}") from error
        for change in changes:
            _change(settings, change)
        try:
            return cls.of(settings, path.parent)
        except ArchfemError as error:
            raise type(error)(f"{path}: {error}") from error

    @classmethod
    def of(cls, settings: Table, folder: Path = Path()) -> "Case":
        """Make a case of tables such as a TOML file holds."""
        _known(settings, SECTIONS, "")
        for key in set(SECTIONS) - {"title"}:
            if not isinstance(settings.get(key, {}), dict):
                raise InvalidInput(f"{key} = {settings[key]!r} is not a table: write [{key}]")
        analysis = _values(settings.get("analysis", {}), ANALYSIS, "analysis")
        if "damping" in analysis:
            analysis["damping"] = _values(analysis["damping"], DAMPING, "analysis.damping")
        motion = settings.get("motion")
        case = cls(
            title=str(settings.get("title", "case")),
            structure=_structure(settings),
            model=_values(settings.get("model", {}), MODEL, "model"),
            motion=None if motion is None else _values(motion, MOTION, "motion"),
            analysis=analysis,
            output=_values(settings.get("output", {}), OUTPUT, "output"),
            settings=dict(settings),
            folder=folder,
        )
        _ = case.damping, case.scheme
        return case

    @property
    def damping(self) -> Rayleigh | None:
        """Damping of the time history."""
        if "damping" not in self.analysis:
            return None
        given = self.analysis["damping"]
        missing = {"ratio", "frequencies"} - set(given)
        if missing or len(given["frequencies"]) != 2:
            raise InvalidInput(
                f"analysis.damping = {given}: give a ratio and two frequencies, e.g. "
                "{ ratio = 0.05, frequencies = [8.0, 16.0] }"
            )
        return Rayleigh(given["ratio"], tuple(given["frequencies"]), given.get("joints", "closed"))

    @property
    def scheme(self) -> Scheme:
        """Time stepping of the time history."""
        name, alpha = self.analysis.get("scheme", "newmark"), self.analysis.get("alpha")
        if name == "hht":
            return HHT() if alpha is None else HHT(alpha)
        if name != "newmark" or alpha is not None:
            raise InvalidInput(
                f"analysis.scheme = {name!r} with alpha {alpha}: use 'newmark', or 'hht' and alpha"
            )
        return Newmark()

    def ground_motion(self) -> Motion:
        """Read or make the ground motion.

        Raises:
            InvalidInput: there is none, it is given twice, or its file cannot be read.
        """
        given = self.motion or {}
        if ("synthetic" in given) == ("file" in given):
            raise InvalidInput(
                "motion needs either a file, or synthetic = { seed = 1, … } to make one"
            )
        if "synthetic" in given:
            options = _values(given["synthetic"], SYNTHETIC, "motion.synthetic")
            motion = Motion.synthetic(**options)
        else:
            keys = set(RECORD) - {"file", "vertical"}
            options = {key: given[key] for key in keys & set(given)}
            upright = self.folder / given["vertical"] if "vertical" in given else None
            motion = Motion.read(self.folder / given["file"], vertical=upright, **options)
        if "start" in given or "end" in given:
            motion = motion.cut(given.get("start", 0.0), given.get("end"))
        return motion.scaled(given.get("scale", 1.0))

    def text(self) -> str:
        """The case as TOML, changes included."""
        return tomli_w.dumps(self.settings)


def _structure(settings: Table) -> Structure:
    """Build the structure that a case describes."""
    given = dict(settings.get("structure", {}))
    name = given.pop("shape", None)
    if name not in SHAPES:
        raise InvalidInput(f"structure.shape = {name!r} is not known: use one of {list(SHAPES)}")
    shape, keys = SHAPES[name]
    stone = _material(settings, given.pop("material", "stone"))
    contact = _contact(settings, given.pop("contact", "stone to stone"))
    try:
        return shape(material=stone, contact=contact, **_values(given, keys, "structure"))
    except TypeError as error:
        raise InvalidInput(f"structure of shape {name!r}: {error}") from error


def _material(settings: Table, name: str) -> Material:
    """A named material: a preset, changed or made by the case's own table."""
    return _named(settings, "materials", name, MATERIAL, (MATERIALS, Material))


def _contact(settings: Table, name: str) -> Contact:
    """A named contact, likewise."""
    return _named(settings, "contacts", name, CONTACT, (CONTACTS, Contact))


def _named(settings: Table, section: str, name: str, keys: Table, kind: tuple[Any, type]) -> Any:
    presets, make = kind
    own = settings.get(section, {})
    if name not in presets and name not in own:
        raise InvalidInput(
            f"'{name}' is not among the {section} {sorted(set(presets) | set(own))}: "
            f'name one of them or write a table [{section}."{name}"]'
        )
    base = {key: getattr(presets[name], key) for key in keys} if name in presets else {}
    values = {**base, **_values(own.get(name, {}), keys, f"{section}.{name}")}
    try:
        return make(**values, name=name)
    except TypeError as error:
        raise InvalidInput(f"{section}.{name}: {error}") from error


def _values(given: Any, keys: Table, section: str) -> dict[str, Any]:
    """Check the keys of a table and turn its values into what they must hold."""
    if not isinstance(given, Mapping):
        raise InvalidInput(f"{section} = {given!r} is not a table")
    _known(given, keys, section)
    return {key: _value(value, keys[key], f"{section}.{key}") for key, value in given.items()}


def _known(given: Table, keys: Any, section: str) -> None:
    """Refuse keys that nothing would read."""
    for key in given:
        if key not in keys:
            near = difflib.get_close_matches(key, list(keys), 1)
            hint = f"did you mean '{near[0]}'?" if near else f"the keys are {sorted(keys)}"
            raise InvalidInput(f"unknown key '{section + '.' if section else ''}{key}': {hint}")


def _value(value: Any, kind: Any, key: str) -> Any:
    """Turn one value into what its key must hold."""
    if isinstance(kind, str):
        return in_unit(value, kind, key)
    if isinstance(kind, list):
        if not isinstance(value, list):
            raise InvalidInput(f"{key} = {value!r} is not a list: write [a, b, …]")
        return [_value(item, kind[0], f"{key}[{n}]") for n, item in enumerate(value)]
    if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
        names = {int: "a whole number", str: "a word", bool: "true or false", dict: "a table"}
        raise InvalidInput(f"{key} = {value!r} is not {names[kind]}")
    return value


def _change(settings: dict[str, Any], change: str) -> None:
    """Set one value from "section.key=value", read as TOML, or as a word."""
    path, equals, text = change.partition("=")
    if not equals or not path.strip():
        raise InvalidInput(f"'{change}' is not a change: write section.key=value")
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        value = text.strip()
    *parents, last = path.strip().split(".")
    table: Any = settings
    for parent in parents:
        table = table.setdefault(parent, {})
        if not isinstance(table, dict):
            raise InvalidInput(f"'{change}': {parent} is not a table")
    table[last] = value
