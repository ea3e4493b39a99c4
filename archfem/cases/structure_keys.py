"""Structures of case files: [structure], [materials], [contacts] and [dead_load].

The keys of a table are the arguments of the shape, part or material that it describes, with the
units of their annotations (`declared_keys`).
"""

import inspect
import json
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from archfem._validation import declared_keys
from archfem.cases.provenance import hash_file, list_input_files
from archfem.cases.toml_file import Table, check_choice, check_table
from archfem.errors import InvalidInput
from archfem.joints.own_law import JointLaw, build_registered_law, registered_laws
from archfem.masonry.assembly import assembled
from archfem.masonry.backfill import jointed_fill
from archfem.masonry.block import Block
from archfem.masonry.materials import CONTACT_PRESETS, MATERIAL_PRESETS, Contact, Material
from archfem.masonry.shapes import bridges, rings
from archfem.masonry.shapes.bridge_parts import Arch, Backfill, Paving, Pier, Sidewall
from archfem.masonry.structure import Joint, Structure
from archfem.masonry.survey.outlines import Layer, surveyed

Described = TypeVar("Described")

# Parts of which a bridge has several, from left to right, each under its name
BRIDGE_PARTS: Table = {"arches": Arch, "piers": Pier, "sidewalls": Sidewall}

_recent_structures: OrderedDict[str, Structure] = OrderedDict()


def cached_structure(settings: Table, folder: Path = Path(), max_cached: int = 8) -> Structure:
    """Return the structure of a case under the case's title; recent ones are cached."""
    # structures are immutable: cases with the same tables and drawing share one
    # Only these sections describe the structure; the title is its name.
    sections = ("title", "structure", "materials", "contacts")
    tables = {name: settings[name] for name in sections if name in settings}
    drawings = list_input_files({"structure": tables.get("structure")}, folder)
    key = json.dumps([tables, [(str(path), hash_file(path)) for path in drawings]], default=repr)
    if key not in _recent_structures:
        structure = build_structure(settings, folder)
        _recent_structures[key] = replace(structure, name=settings.get("title", structure.name))
        # Studies alternate between few structures: the least recently used one is dropped.
        while len(_recent_structures) > max_cached:
            _recent_structures.popitem(last=False)
    _recent_structures.move_to_end(key)
    return _recent_structures[key]


def build_structure(settings: Table, folder: Path = Path()) -> Structure:
    """Build the structure of a case."""
    shapes = (
        *(rings.circular_arch, rings.pointed_arch, rings.elliptical_arch, rings.flat_arch),
        *(rings.arch_along, bridges.buttressed_arch, bridges.arcade, rings.column),
        *(rings.arch_on_piers, bridges.bridge),
    )
    functions = {shape.__name__: shape for shape in shapes} | {"outlines": surveyed}
    table = settings.get("structure", {})
    name = check_choice(table.get("shape"), (*functions, "blocks"), "structure.shape")
    if name == "blocks":
        return _read_blocks(settings)
    keys = {**_keys_of(functions[name]), "shape": str, "fill": dict}
    if name == "bridge":  # whose parts are tables by name
        keys |= dict.fromkeys(BRIDGE_PARTS, dict)
    elif name == "outlines":
        keys["file"] = keys.pop("path")
        del keys["materials"]  # which are those of the case
    values = check_table(table, keys, "structure")
    del values["shape"]
    fill = values.pop("fill", {})
    values = _resolve_names(functions[name], values, settings)
    # All tables are read, also unused ones: a misspelt name of a preset is an error then.
    for material in settings.get("materials", {}):
        _material(settings, material)
    for joint in settings.get("contacts", {}):
        _contact(settings, joint)
    if name == "bridge":
        values = _bridge_parts(values, settings)
    elif name == "outlines":
        values = _outline_arguments(values, settings, folder)
    structure = _call(functions[name], f"structure of shape {name!r}", **values)
    return _divide_fill(structure, fill)


def _keys_of(declaration: Callable[..., Any]) -> dict[str, Any]:
    """Return the keys of a shape or part, where materials and contacts are names of tables."""
    return declared_keys(declaration, named=(Material, Contact))


def _read_blocks(settings: Table) -> Structure:
    """Return a structure whose blocks and joints are listed; without joints these are found."""
    keys = _keys_of(assembled) | {"shape": str, "material": str}
    del keys["name"]  # that of the case
    values = check_table(settings["structure"], keys, "structure")
    shared = {"material": values.pop("material", "stone")}
    contact = values.pop("contact", "stone to stone")
    del values["shape"]
    blocks = [
        _read_part(Block, {**shared, **part}, f"structure.blocks[{k}]", settings)
        for k, part in enumerate(values.pop("blocks", ()))
    ]
    joints = [
        _read_part(Joint, {"contact": contact, **part}, f"structure.joints[{k}]", settings)
        for k, part in enumerate(values.pop("joints", ()))
    ]
    if joints:
        return Structure(tuple(blocks), tuple(joints), **values)
    return assembled(blocks, _contact(settings, contact), **values)


def _read_part(cls: type[Described], table: Table, section: str, settings: Table) -> Described:
    """Return a block or joint of a table."""
    values = check_table(table, _keys_of(cls), section)
    return _call(cls, section, **_resolve_names(cls, values, settings))


def _divide_fill(structure: Structure, table: Table) -> Structure:
    """Divide the backfill of a structure into pieces, if the case says so."""
    keys = {**declared_keys(jointed_fill), "law": str}
    del keys["structure"]
    fill = check_table(table, keys, "structure.fill")
    law = check_choice(fill.pop("law", "elastic"), ("elastic", "jointed"), "structure.fill.law")
    if law == "elastic":
        if fill:
            raise InvalidInput(f"structure.fill has {sorted(fill)}: they need law = 'jointed'")
        return structure
    if missing := sorted({"piece_size", "friction_angle"} - set(fill)):
        raise InvalidInput(f"structure.fill lacks {missing}: a jointed fill needs both")
    return jointed_fill(structure, **fill)


def _bridge_parts(values: dict[str, Any], settings: Table) -> dict[str, Any]:
    """Return the arguments of `bridge`, with the parts that its tables describe."""
    parts = dict(values)
    for key, part in BRIDGE_PARTS.items():
        if key in parts:
            parts[key] = _build_parts(part, parts[key], f"structure.{key}")
    for key, single in {"backfill": Backfill, "paving": Paving}.items():
        if key in parts:
            given = check_table(parts[key], _keys_of(single), f"structure.{key}")
            given = _resolve_names(single, given, settings)
            parts[key] = _call(single, f"structure.{key}", **given)
    return parts


def _resolve_names(function: Callable[..., Any], values: Table, settings: Table) -> dict[str, Any]:
    """Return the arguments of a shape or part with the material and contact that they name."""
    arguments, parameters = dict(values), inspect.signature(function).parameters
    for key, find in (("material", _material), ("contact", _contact)):
        if key in parameters:  # a table may change the default one
            name = values[key] if key in values else parameters[key].default.name
            arguments[key] = find(settings, name)
    return arguments


def _outline_arguments(values: dict[str, Any], settings: Table, folder: Path) -> dict[str, Any]:
    """Return the arguments of `surveyed`: drawing, layers, materials and contacts."""
    if "file" not in values:
        raise InvalidInput("structure of shape 'outlines' has no file: name the drawing")
    drawn = dict(values)
    drawn["path"] = folder / drawn.pop("file")
    if "layers" in drawn:
        drawn["layers"] = {
            name: Layer(**check_table(table, _keys_of(Layer), f"structure.layers.{name}"))
            for name, table in drawn["layers"].items()
        }
    # Stone and backfill have a contact of their own unless the case names another.
    pairs = {"stone/backfill": "soil to stone"} | drawn.get("contacts", {})
    contacts = check_table(pairs, dict.fromkeys(pairs, str), "structure.contacts")
    drawn["contacts"] = {pair: _contact(settings, name) for pair, name in contacts.items()}
    # Layers name their materials in the drawing, so that all materials are passed.
    names = {*MATERIAL_PRESETS, *settings.get("materials", {})}
    drawn["materials"] = {name: _material(settings, name) for name in sorted(names)}
    return drawn


def _build_parts(part: Callable[..., Described], table: Table, section: str) -> list[Described]:
    """Return parts of one kind: common keys of the table, and a subtable for each part."""
    subtables = {name: value for name, value in table.items() if isinstance(value, dict)}
    if not subtables:
        raise InvalidInput(
            f'{section} names no part: write a table [{section}."its name"] for each'
        )
    keys = _keys_of(part)
    del keys["name"]  # that of its table
    common = check_table({k: v for k, v in table.items() if k not in subtables}, keys, section)
    parts = []
    for name, subtable in subtables.items():
        place = f"{section}.{name}"
        parts.append(_call(part, place, name=name, **common | check_table(subtable, keys, place)))
    return parts


def _call(function: Callable[..., Described], section: str, **values: Any) -> Described:
    """Call a constructor with the values of a table; a missing value names the table."""
    parameters = inspect.signature(function).parameters.values()
    required = [key.name for key in parameters if key.default is key.empty]
    if missing := [key for key in required if key not in values]:
        presets: Table = {"contacts": CONTACT_PRESETS, "materials": MATERIAL_PRESETS}
        known = sorted(presets.get(section.partition(".")[0], ()))
        names = f"; tables of these names change what is there: {known}" if known else ""
        raise InvalidInput(
            f"{section} lacks {', '.join(missing)}: give them, or correct the name of the "
            f"table{names}"
        )
    return function(**values)


def _material(settings: Table, name: str) -> Material:
    """Return a material: a preset, or described or changed by a table of the case."""
    return _resolve_preset(settings, "materials", name, MATERIAL_PRESETS, Material)


def _contact(settings: Table, name: str) -> Contact:
    """Return a contact: a preset, or described or changed by a table of the case."""
    return _resolve_preset(settings, "contacts", name, CONTACT_PRESETS, Contact)


def _resolve_preset(
    settings: Table, section: str, name: str, presets: Table, cls: Callable[..., Described]
) -> Described:
    """Return a named preset with the changes of its table, or the object of the table alone."""
    tables = settings.get(section, {})
    if name not in presets and name not in tables:
        raise InvalidInput(
            f"'{name}' is not among the {section} {sorted(set(presets) | set(tables))}: "
            f'name one of them or write a table [{section}."{name}"]'
        )
    # A table changes a preset of its name key by key.
    keys = declared_keys(cls)
    values = {key: getattr(presets[name], key) for key in keys} if name in presets else {}
    values |= check_table(tables.get(name, {}), keys, f"{section}.{name}")
    if values.get("law") is not None:
        values["law"] = _joint_law(values["law"], f"{section}.{name}.law")
    return _call(cls, f"{section}.{name}", **{"name": name, **values})


def _joint_law(table: Table, section: str) -> JointLaw:
    """Return a joint law that a module of the user has registered."""
    values = dict(table)
    name = check_choice(values.pop("name", None), registered_laws, f"{section}.name")
    keys = declared_keys(registered_laws[name])
    if units := [k for k, v in values.items() if isinstance(v, str) and keys.get(k) == "1"]:
        raise InvalidInput(
            f"{section}.{units[0]} = {values[units[0]]!r} has a unit, and the field of the "
            'class has none: write it there, as in field(metadata={"unit": "Pa/m"})'
        )
    return build_registered_law(name, check_table(values, keys, section))
