"""Structures as tables describe them: shapes and their lengths, materials and contacts by name."""

import json
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from archfem.cases.inputs import content_digest, input_files
from archfem.cases.settings import NumberOr, Table, checked, chosen
from archfem.errors import InvalidInput
from archfem.masonry.fill import jointed_fill
from archfem.masonry.materials import CONTACTS, MATERIALS, Contact, Material
from archfem.masonry.shapes.arcades import arcade, buttressed_arch
from archfem.masonry.shapes.bridges import bridge
from archfem.masonry.shapes.curves import arch_along, elliptical_arch, flat_arch, pointed_arch
from archfem.masonry.shapes.parts import Arch, Backfill, Paving, Pier, Sidewall
from archfem.masonry.shapes.rings import arch_on_piers, circular_arch, column
from archfem.masonry.structure import Structure
from archfem.masonry.survey.survey import Layer, surveyed

Made = TypeVar("Made")

WORDS = {"shape": str, "material": str, "contact": str}
COMMON = {"width": "m", "gravity": "m/s**2"}
RING = {
    "radius": "m",
    "embrace": "degree",
    "span": "m",
    "rise": "m",
    "thickness": "m",
    "voussoirs": int,
    "chords": int,
    **COMMON,
}
COLUMN = {"breadth": "m", "heights": ["m"], **COMMON}
PIERS = {
    "radius": "m",
    "thickness": "m",
    "voussoirs": int,
    "pier_breadth": "m",
    "courses": ["m"],
    "chords": int,
    **COMMON,
}
CURVE = {"span": "m", "rise": "m", "thickness": "m", "voussoirs": int, "chords": int, **COMMON}
FLAT = {"span": "m", "thickness": "m", "voussoirs": int, "skewback": "degree", **COMMON}
ALONG = {"intrados": [["m"]], "thickness": "m", "voussoirs": int, "chords": int, **COMMON}
BUTTRESSED = {**CURVE, "embrace": "degree", "breadth": "m", "height": "m", "course": "m"}
ARCADE = {
    "spans": ["m"],
    "heights": ["m"],
    "breadths": ["m"],
    "thicknesses": ["m"],
    "voussoirs": [int],
    "rises": ["m"],
    "embraces": ["degree"],
    "course": "m",
    "chords": int,
    **COMMON,
}
BRIDGE = {
    "arches": dict,
    "piers": dict,
    "sidewalls": dict,
    "backfill": dict,
    "paving": dict,
    "chords": int,
    **COMMON,
}
OUTLINES = {
    "file": str,
    "unit": str,
    "snap": "m",
    "layers": dict,
    "contacts": dict,
    **COMMON,
}
LAYER = {"part": str, "role": str, "material": str, "fixed": bool, "ignore": bool}
USUAL_CONTACTS = {"stone/backfill": "soil to stone"}
"""How blocks of two materials touch, unless the case says otherwise."""
SHAPES: dict[str, tuple[Callable[..., Structure], Table]] = {
    "circular_arch": (circular_arch, RING),
    "pointed_arch": (pointed_arch, CURVE),
    "elliptical_arch": (elliptical_arch, CURVE),
    "flat_arch": (flat_arch, FLAT),
    "arch_along": (arch_along, ALONG),
    "buttressed_arch": (buttressed_arch, BUTTRESSED),
    "arcade": (arcade, ARCADE),
    "column": (column, COLUMN),
    "arch_on_piers": (arch_on_piers, PIERS),
    "bridge": (bridge, BRIDGE),
    "outlines": (surveyed, OUTLINES),
}
SEVERAL: dict[str, tuple[Callable[..., Any], Table]] = {
    "arches": (
        Arch,
        {"span": "m", "rise": "m", "embrace": "degree", "thickness": "m", "voussoirs": int},
    ),
    "piers": (Pier, {"gap": "m", "height": "m", "course": "m"}),
    "sidewalls": (
        Sidewall,
        {
            "length": "m",
            "height": "m",
            "course": "m",
            "above": "m",
            "setback": "m",
            "state": str,
        },
    ),
}
"""Parts of a bridge of which there may be several, from left to right, each under its name."""
FILL = {
    "cover": "m",
    "erosion": "m",
    "hump": "m",
    "spandrels": "m",
    "material": str,
    "contact": str,
}
LAWS = ("elastic", "jointed")
JOINTED = {"law": str, "size": "m", "friction_angle": "degree", "cohesion": "Pa"}
"""What [structure.fill] says of how soft bodies answer, in any shape."""
PAVING = {"thickness": "m", "length": "m"}
MATERIAL = {"young": "Pa", "poisson": "1", "unit_weight": "N/m**3", "strength": "Pa"}
CONTACT = {
    "normal_stiffness": "Pa/m",
    "shear_stiffness": "Pa/m",
    "friction": NumberOr("1", {"none": None}),
    "cohesion": "Pa",
    "dilatancy": "1",
    "tension": "Pa",
}
"""A friction of "none" is that of a joint that never slides."""


KEPT = 8
"""Structures that are kept, of those made last."""

_kept: OrderedDict[str, Structure] = OrderedDict()


def structure_of(settings: Table, folder: Path = Path()) -> Structure:
    """Return the structure that a case describes, under the title of the case where it has one.

    One that was described lately, to the letter and by the same drawing, is given again, for it
    cannot be changed.

    Args:
        settings: tables "structure", "materials" and "contacts", and the title.
        folder: where the names of drawings start.

    Raises:
        InvalidInput: as by `planned`.
        InvalidStructure: likewise.
    """
    sections = ("title", "structure", "materials", "contacts")
    told = {name: settings[name] for name in sections if name in settings}
    drawings = input_files({"structure": told.get("structure")}, folder)
    files = [(str(path), content_digest(path)) for path in drawings]
    key = json.dumps([told, files], default=repr)
    if key not in _kept:
        made = planned(settings, folder)
        _kept[key] = replace(made, name=settings.get("title", made.name))
        while len(_kept) > KEPT:
            _kept.popitem(last=False)
    _kept.move_to_end(key)
    return _kept[key]


def planned(settings: Table, folder: Path = Path()) -> Structure:
    """Return the structure that a case describes.

    Args:
        settings: tables "structure", "materials" and "contacts".
        folder: where the names of drawings start.

    Raises:
        InvalidInput: a shape, key, material or contact is not known, or a value cannot be meant.
        InvalidStructure: the lengths do not make a structure.
    """
    given = settings.get("structure", {})
    name = chosen(given.get("shape"), SHAPES, "structure.shape")
    shape, keys = SHAPES[name]
    values = checked(given, {**WORDS, **keys, "fill": dict}, "structure")
    del values["shape"]
    fill = values.pop("fill", {})
    stone = _material(settings, values.pop("material", "stone"))
    contact = _contact(settings, values.pop("contact", "stone to stone"))
    _check_tables(settings)
    if name == "bridge":
        values = _parts(values, settings)
    elif name == "outlines":
        values = _outlines(values, settings, folder)
    made = _made(shape, f"structure of shape {name!r}", material=stone, contact=contact, **values)
    return _filled(made, fill)


def _filled(structure: Structure, given: Table) -> Structure:
    """The structure with its fill as the case wants it."""
    fill = checked(given, JOINTED, "structure.fill")
    if chosen(fill.pop("law", "elastic"), LAWS, "structure.fill.law") == "elastic":
        if fill:
            raise InvalidInput(f"structure.fill has {sorted(fill)}: they need law = 'jointed'")
        return structure
    missing = sorted({"size", "friction_angle"} - set(fill))
    if missing:
        raise InvalidInput(f"structure.fill says nothing of {missing}: a jointed fill needs both")
    return jointed_fill(
        structure,
        fill["size"],
        angle=fill["friction_angle"],
        cohesion=fill.get("cohesion", 0.0),
    )


def _check_tables(settings: Table) -> None:
    """Make all that the case's own tables name, used or not: a misspelt preset is then missed."""
    for section, named in (("materials", _material), ("contacts", _contact)):
        for name in settings.get(section, {}):
            named(settings, name)


def _parts(values: dict[str, Any], settings: Table) -> dict[str, Any]:
    """Parts of a bridge from their tables."""
    parts = dict(values)
    for key, (make, keys) in SEVERAL.items():
        if key in parts:
            parts[key] = _several(make, keys, parts[key], f"structure.{key}")
    if "backfill" in parts:
        fill = checked(parts["backfill"], FILL, "structure.backfill")
        fill["material"] = _material(settings, fill.pop("material", "backfill"))
        fill["contact"] = _contact(settings, fill.pop("contact", "soil to stone"))
        parts["backfill"] = _made(Backfill, "structure.backfill", **fill)
    if "paving" in parts:
        paving = checked(parts["paving"], PAVING, "structure.paving")
        parts["paving"] = _made(Paving, "structure.paving", **paving)
    return parts


def _outlines(values: dict[str, Any], settings: Table, folder: Path) -> dict[str, Any]:
    """A drawing, what is on its layers and how that touches."""
    if "file" not in values:
        raise InvalidInput("structure of shape 'outlines' has no file: name the drawing")
    drawn = dict(values)
    drawn["path"] = folder / drawn.pop("file")
    if "layers" in drawn:
        drawn["layers"] = {
            name: Layer(**checked(own, LAYER, f"structure.layers.{name}"))
            for name, own in drawn["layers"].items()
        }
    pairs = USUAL_CONTACTS | drawn.get("contacts", {})
    named = checked(pairs, dict.fromkeys(pairs, str), "structure.contacts")
    drawn["contacts"] = {pair: _contact(settings, name) for pair, name in named.items()}
    names = {*MATERIALS, *settings.get("materials", {})}
    drawn["materials"] = {name: _material(settings, name) for name in sorted(names)}
    return drawn


def _several(make: Callable[..., Made], keys: Table, given: Table, section: str) -> list[Made]:
    """Parts of one kind: what the table says of all, and each subtable of the part it names."""
    each = {name: own for name, own in given.items() if isinstance(own, dict)}
    if not each:
        raise InvalidInput(
            f'{section} names no part: write a table [{section}."its name"] for each'
        )
    common = checked({k: v for k, v in given.items() if k not in each}, keys, section)
    return [
        _made(
            make, f"{section}.{name}", name=name, **common | checked(own, keys, f"{section}.{name}")
        )
        for name, own in each.items()
    ]


def _made(make: Callable[..., Made], section: str, **values: Any) -> Made:
    """Make something of the values of a table, naming the table where a value is missing."""
    try:
        return make(**values)
    except TypeError as error:
        raise InvalidInput(f"{section}: {error}") from error


def _material(settings: Table, name: str) -> Material:
    """A named material: a preset, changed or made by the case's own table."""
    return _named(settings, "materials", name, MATERIAL, (MATERIALS, Material))


def _contact(settings: Table, name: str) -> Contact:
    """A named contact, likewise."""
    return _named(settings, "contacts", name, CONTACT, (CONTACTS, Contact))


def _named(
    settings: Table, section: str, name: str, keys: Table, kind: tuple[Table, Callable[..., Made]]
) -> Made:
    presets, make = kind
    own = settings.get(section, {})
    if name not in presets and name not in own:
        raise InvalidInput(
            f"'{name}' is not among the {section} {sorted(set(presets) | set(own))}: "
            f'name one of them or write a table [{section}."{name}"]'
        )
    base = {key: getattr(presets[name], key) for key in keys} if name in presets else {}
    values = {**base, **checked(own.get(name, {}), keys, f"{section}.{name}")}
    return _made(make, f"{section}.{name}", **values, name=name)
