"""Structures of case files: [structure], [materials] and [contacts], read and written.

The keys of a table are the arguments of the shape, part or material that it describes, with the
units of their annotations (`declared_keys`).

A structure is written by shape and lengths where these are known, or by its blocks. Either way the
tables are read once and compared, so that a file has every bit of it.
"""

import inspect
import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from itertools import product
from math import inf
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from archfem._recent import RecentResults
from archfem._validation import check_choice, declared_keys, given_fields
from archfem.cases.provenance import hash_file, list_input_files
from archfem.cases.toml_file import Table, check_table, format_key
from archfem.errors import ArchfemError, InvalidInput
from archfem.joints.own_law import JointLaw, build_registered_law, registered_laws
from archfem.masonry import joint_closing
from archfem.masonry.assembly import assembled
from archfem.masonry.backfill import jointed_fill
from archfem.masonry.block import Block
from archfem.masonry.joint_closing import FINISHED_KEYS, find_finish
from archfem.masonry.materials import CONTACT_PRESETS, MATERIAL_PRESETS, STONE, Contact, Material
from archfem.masonry.shapes import bridges, rings, walls
from archfem.masonry.shapes.bridge_parts import Arch, Backfill, Paving, Pier, Sidewall
from archfem.masonry.standing import StandingBody, carrying
from archfem.masonry.structure import Joint, Structure, join_names, suggest_name
from archfem.masonry.survey.layers import Layer
from archfem.masonry.survey.outlines import Survey, read_outlines, surveyed
from archfem.units import StatedWeight, Usual

Described = TypeVar("Described")

# Parts of which a shape has several, each under its name; those of a bridge from left to right
PARTS_BY_NAME: Mapping[str, Table] = {
    "bridge": {"arches": Arch, "piers": Pier, "sidewalls": Sidewall},
    "wall": {"openings": walls.Opening, "floors": walls.Floor},
}

# Parts of which a bridge has one
SINGLE_PARTS: Table = {"backfill": Backfill, "paving": Paving}

# Keys of a material: its fields, and the preset that has those that are left out
MATERIAL_KEYS = {**declared_keys(Material), "preset": str}

# Keys of a contact: its fields, or the finish of the faces in place of stiffnesses and closure
CONTACT_KEYS = {**declared_keys(Contact), "finish": str}

# Materials and contacts that no table need describe, by section
PRESETS: Mapping[str, Mapping[str, Any]] = {
    "materials": MATERIAL_PRESETS,
    "contacts": CONTACT_PRESETS,
}

# What has a material or a contact
_BEARERS = {"materials": "block", "contacts": "joint"}

# Joint.contact and Block.material of most parts stand once, above the lists
_SHARED = ("material", "contact")

# Fields of a structure beside its blocks and joints
_SIZES = ("width", "gravity", "above")

# studies alternate between few structures
_recent_structures = RecentResults[Structure](8)


def cached_structure(settings: Table, folder: Path = Path()) -> Structure:
    """Return the structure of a case under the case's title; recent ones are cached."""
    # structures are immutable: cases with the same tables and drawing share one
    # Only these sections describe the structure; the title is its name.
    sections = ("title", "structure", "materials", "contacts")
    tables = {name: settings[name] for name in sections if name in settings}
    drawings = list_input_files({"structure": tables.get("structure")}, folder)
    key = json.dumps([tables, [(str(path), hash_file(path)) for path in drawings]], default=repr)

    def build() -> Structure:
        structure = build_structure(settings, folder)
        return replace(structure, name=settings.get("title", structure.name))

    return _recent_structures.look_up(key, build)


def list_shapes() -> dict[str, Callable[..., Structure]]:
    """Return the function of each shape of [structure], whose arguments are its keys."""
    shapes = (
        *(rings.circular_arch, rings.pointed_arch, rings.elliptical_arch, rings.flat_arch),
        *(rings.arch_along, bridges.buttressed_arch, bridges.arcade, rings.column),
        *(rings.arch_on_piers, bridges.bridge, walls.wall),
    )
    return {shape.__name__: shape for shape in shapes} | {"outlines": surveyed, "blocks": assembled}


def shape_keys(name: str) -> dict[str, Any]:
    """Return the keys of [structure] for a shape."""
    keys = {**keys_of_part(list_shapes()[name]), "shape": str, "fill": dict, "standing": dict}
    if name == "blocks":
        keys["material"] = str
        keys["above"] = keys["width"]  # also a length
        del keys["name"], keys["fill"]  # the name is that of the case
    elif name == "outlines":
        keys["file"] = keys.pop("path")
        del keys["materials"]  # which are those of the case
    return keys | dict.fromkeys(PARTS_BY_NAME.get(name, ()), dict)


def build_structure(settings: Table, folder: Path = Path()) -> Structure:
    """Build the structure of a case; joints by a finish follow from their stones."""
    # every table is read: a misspelt name of a preset is an error then
    for section in PRESETS:
        for key in settings.get(section, {}):
            _resolve_preset(settings, section, key)
    structure = _build_shape(settings, folder)
    if (standing := settings["structure"].get("standing")) is not None:
        bodies = _build_parts(StandingBody, standing, "structure.standing", settings)
        structure = carrying(structure, bodies)
    for name, table in settings.get("contacts", {}).items():
        if "finish" in table:
            contact = _resolve_preset(settings, "contacts", name)
            structure = joint_closing.with_finish(structure, table["finish"], contact)
    for section, name, used in list_unused_tables(settings, structure):
        if name not in PRESETS[section]:
            word, path = section[:-1], f"{section}.{format_key(name)}"
            raise InvalidInput(
                f"[{path}] counts for nothing: no {_BEARERS[section]} has the {word} '{name}', and "
                f"those of this structure are {used}: {suggest_name(name, used)} Rename the table, "
                f'name it in [structure], as in {word} = "{name}", or leave it out '
                f"(remove = ['{path}'] leaves out that of a base)"
            )
    return structure


def list_unused_tables(
    settings: Table, structure: Structure
) -> Iterator[tuple[str, str, list[str]]]:
    """Yield section and name of tables that no block or joint has, and the names of those had."""
    had: Mapping[str, set[str]] = {
        "materials": {block.material.name for block in structure.blocks},
        "contacts": {joint.contact.name for joint in structure.joints},
    }
    text = json.dumps(settings["structure"], default=repr)
    for section, used in had.items():
        for name, table in settings.get(section, {}).items():
            if table.get("name", name) not in used and f": {json.dumps(name)}" not in text:
                yield section, name, sorted(used)


def _build_shape(settings: Table, folder: Path) -> Structure:
    """Build the structure of a case by its shape."""
    table, functions = settings.get("structure", {}), list_shapes()
    name = check_choice(table.get("shape"), "structure.shape", functions)
    values = check_table(table, shape_keys(name), "structure")
    for key in ("shape", "standing"):
        values.pop(key, None)
    if name == "blocks":
        return _read_blocks(values, settings)
    fill = values.pop("fill", {})
    values = _resolve_names(functions[name], values, settings)
    values = _shape_parts(name, values, settings)
    if name == "outlines":
        values = _outline_arguments(values, settings, folder)
    structure = _call(functions[name], f"structure of shape {name!r}", **values)
    return _divide_fill(structure, fill)


def fill_keys() -> dict[str, Any]:
    """Return the keys of structure.fill."""
    keys = {**declared_keys(jointed_fill), "law": str}
    del keys["structure"]
    return keys


def keys_of_part(declaration: Callable[..., Any]) -> dict[str, Any]:
    """Return the keys of a shape or part, where materials and contacts are names of tables."""
    return declared_keys(declaration, named=(Material, Contact))


def _read_blocks(values: dict[str, Any], settings: Table) -> Structure:
    """Return a structure whose blocks and joints are listed; without joints these are found."""
    shared = {"material": values.pop("material", "stone")}
    contact = values.pop("contact", "stone to stone")
    blocks = [
        _read_part(Block, {**shared, **part}, f"structure.blocks[{k}]", settings)
        for k, part in enumerate(values.pop("blocks", ()))
    ]
    joints = [
        _read_part(Joint, {"contact": contact, **part}, f"structure.joints[{k}]", settings)
        for k, part in enumerate(values.pop("joints", ()))
    ]
    above = values.pop("above", None)
    if joints:
        return Structure(tuple(blocks), tuple(joints), above=above, **values)
    made = assembled(blocks, _resolve_preset(settings, "contacts", contact), **values)
    return replace(made, above=above)


def _read_part(
    cls: Callable[..., Described], table: Table, section: str, settings: Table
) -> Described:
    """Return a block, joint or part of a bridge of a table."""
    values = check_table(table, keys_of_part(cls), section)
    return _call(cls, section, **_resolve_names(cls, values, settings))


def _divide_fill(structure: Structure, table: Table) -> Structure:
    """Divide the backfill of a structure into pieces, if the case says so."""
    fill = check_table(table, fill_keys(), "structure.fill")
    law = check_choice(fill.pop("law", "elastic"), "structure.fill.law", ("elastic", "jointed"))
    if law == "elastic":
        if fill:
            raise InvalidInput(f"structure.fill has {sorted(fill)}: they need law = 'jointed'")
        return structure
    if missing := sorted({"piece_size", "friction_angle"} - set(fill)):
        raise InvalidInput(
            f"structure.fill lacks {missing}: a jointed fill needs both, such as "
            'piece_size = "0.8 m", friction_angle = "30 degree"'
        )
    return jointed_fill(structure, **fill)


def _shape_parts(shape: str, values: dict[str, Any], settings: Table) -> dict[str, Any]:
    """Return the arguments of a shape, with the parts that its tables describe."""
    parts = dict(values)
    for key, part in PARTS_BY_NAME.get(shape, {}).items():
        if key in parts:
            parts[key] = _build_parts(part, parts[key], f"structure.{key}", settings)
    for key, single in SINGLE_PARTS.items():
        if key in parts:
            parts[key] = _read_part(single, parts[key], f"structure.{key}", settings)
    return parts


def _resolve_names(function: Callable[..., Any], values: Table, settings: Table) -> dict[str, Any]:
    """Return the arguments of a shape or part with the material and contact that they name."""
    arguments, parameters = dict(values), inspect.signature(function).parameters
    for key in ("material", "contact"):
        if key in parameters:  # a table may change the default one
            name = values[key] if key in values else parameters[key].default.name
            arguments[key] = _resolve_preset(settings, f"{key}s", name)
    return arguments


def _outline_arguments(values: dict[str, Any], settings: Table, folder: Path) -> dict[str, Any]:
    """Return the arguments of `surveyed`: drawing, layers, materials and contacts."""
    if "file" not in values:
        raise InvalidInput("structure of shape 'outlines' has no file: name the drawing")
    drawn = dict(values)
    drawn["path"] = folder / drawn.pop("file")
    if "layers" in drawn:
        drawn["layers"] = {
            name: Layer(**check_table(table, keys_of_part(Layer), f"structure.layers.{name}"))
            for name, table in drawn["layers"].items()
        }
    # Stone and backfill have a contact of their own unless the case names another.
    pairs = {"stone/backfill": "soil to stone"} | drawn.get("contacts", {})
    contacts = check_table(pairs, dict.fromkeys(pairs, str), "structure.contacts")
    drawn["contacts"] = {
        pair: _resolve_preset(settings, "contacts", name) for pair, name in contacts.items()
    }
    # Layers name their materials in the drawing, so that all materials are passed.
    names = sorted({*MATERIAL_PRESETS, *settings.get("materials", {})})
    drawn["materials"] = {name: _resolve_preset(settings, "materials", name) for name in names}
    return drawn


def find_drawing(settings: Table, folder: Path) -> dict[str, Any] | None:
    """Return path, unit, snap and ignored layers of the drawing of a case, None without one."""
    table = settings.get("structure")
    if not isinstance(table, dict) or table.get("shape") != "outlines" or "file" not in table:
        return None
    values = check_table(table, shape_keys("outlines"), "structure")
    layers = values.get("layers", {}).items()
    given = {key: values[key] for key in ("unit", "snap") if key in values}
    ignored = [name for name, layer in layers if isinstance(layer, dict) and layer.get("ignore")]
    return given | {"path": folder / values["file"], "ignored": ignored}


def read_survey(settings: Table, folder: Path) -> Survey | None:
    """Read the drawing of a case alone, without joints; None where it has no drawing."""
    if (table := settings["structure"]).get("shape") != "outlines":
        return None
    values = check_table(table, shape_keys("outlines"), "structure")
    given = _outline_arguments(_resolve_names(surveyed, values, settings), settings, folder)
    names = inspect.signature(read_outlines).parameters
    return read_outlines(**{name: given[name] for name in names if name in given})


def _build_parts(
    part: Callable[..., Described], table: Table, section: str, settings: Table
) -> list[Described]:
    """Return parts of one kind: common keys of the table, and a subtable for each part."""
    subtables = {name: value for name, value in table.items() if isinstance(value, dict)}
    if not subtables:
        raise InvalidInput(
            f'{section} names no part: write a table [{section}."its name"] for each'
        )
    keys = keys_of_part(part)
    del keys["name"]  # that of its table
    common = check_table({k: v for k, v in table.items() if k not in subtables}, keys, section)
    parts = []
    for name, subtable in subtables.items():
        place = f"{section}.{name}"
        values = common | check_table(subtable, keys, place)
        parts.append(_call(part, place, name=name, **_resolve_names(part, values, settings)))
    return parts


def _call(function: Callable[..., Described], section: str, **values: Any) -> Described:
    """Call a constructor with the values of a table; a missing value names the table."""
    parameters = inspect.signature(function).parameters.values()
    required = [key.name for key in parameters if key.default is key.empty]
    if missing := [key for key in required if key not in values]:
        known = sorted(PRESETS.get(section.partition(".")[0], ()))
        take = f", take them from preset = '{known[-1]}'" if known else ""
        names = f"; [structure] must name it, or it changes one of {known}" if known else ""
        stiff = " (rigid models take E and ν too, to find blocks that are softer than their joints)"
        raise InvalidInput(
            f"{section} lacks {', '.join(missing)}{stiff * ('poisson' in missing)}: give "
            f"them{take}, or correct the name of the table{names}"
        )
    return function(**values)


def _resolve_preset(settings: Table, section: str, name: str) -> Any:
    """Return a material or contact: a preset, or described or changed by a table of the case."""
    tables, presets = settings.get(section, {}), PRESETS[section]
    cls: Callable[..., Any] = Material if section == "materials" else Contact
    if name not in presets and name not in tables:
        raise InvalidInput(
            f"'{name}' is not among the {section} {sorted(set(presets) | set(tables))}: "
            f'name one of them or write a table [{section}."{name}"]'
        )
    # A table changes the preset of its name, or the one that it names, key by key.
    keys, place = declared_keys(cls), f"{section}.{name}"
    known = CONTACT_KEYS if cls is Contact else MATERIAL_KEYS
    given = check_table(tables.get(name, {}), known, place)
    preset = check_choice(given.pop("preset", name), f"{place}.preset", {*presets, name})
    values = {key: getattr(presets[preset], key) for key in keys} if preset in presets else {}
    if "finish" in given:
        values |= _read_finish(given, place)
    values |= given
    if isinstance(tables.get(name, {}).get("unit_weight"), str):
        values["unit_weight"] = StatedWeight(given["unit_weight"])
    if values.get("law") is not None:
        values["law"] = _joint_law(values["law"], f"{section}.{name}.law")
    return _call(cls, f"{section}.{name}", **{**values, "name": given.get("name", name)})


class DescribedItem(NamedTuple):
    """How a case describes a material or contact."""

    key: str  # of its table; it may differ from the name, which a table may give
    given: Table  # content of the table; empty for a preset as it is
    path: str  # of the table
    preset: Any  # that has what the table leaves out, or None


def find_table(settings: Table, item: Material | Contact) -> DescribedItem:
    """Return the table of a material or contact."""
    section = "materials" if isinstance(item, Material) else "contacts"
    tables = settings.get(section, {})
    keys = [key for key, table in tables.items() if table.get("name", key) == item.name]
    known = [*keys, item.name] if item.name in PRESETS[section] else keys
    equal = (key for key in known if _resolve_preset(settings, section, key) == item)
    # what follows from a finish differs from stone to stone
    key = next(equal, next(iter(keys), item.name))
    given = tables.get(key, {})
    preset = PRESETS[section].get(given.get("preset", key))
    return DescribedItem(key, given, f"{section}.{format_key(key)}", preset)


def _read_finish(table: dict[str, Any], section: str) -> dict[str, Any]:
    """Take the finish from the table of a contact, and return its law for usual stone."""
    finish = check_choice(table.pop("finish"), f"{section}.finish", joint_closing.CONDITIONS)
    if both := sorted({*FINISHED_KEYS, "law"}.intersection(table)):
        raise InvalidInput(
            f"{section} has a finish and {join_names(both)}, which follows from it: leave out one "
            f"(remove = ['{section}.finish'] leaves out that of a base)"
        )
    return {key: getattr(joint_closing.usual_law(finish), key) for key in FINISHED_KEYS}


def _joint_law(table: Table, section: str) -> JointLaw:
    """Return a joint law that a module of the user has registered."""
    values = dict(table)
    name = check_choice(values.pop("name", None), f"{section}.name", registered_laws)
    keys = declared_keys(registered_laws[name])
    if units := [k for k, v in values.items() if isinstance(v, str) and keys.get(k) == "1"]:
        raise InvalidInput(
            f"{section}.{units[0]} = {values[units[0]]!r} has a unit, and the field of the "
            'class has none: write it there, as in field(metadata={"unit": "Pa/m"})'
        )
    return build_registered_law(name, check_table(values, keys, section))


def write_structure(structure: Structure) -> dict[str, Any]:
    """Return the sections of a case file that describe a structure to the last bit."""
    found = {joint.contact: find_finish(structure, joint) for joint in structure.joints}
    finishes = {contact: finish for contact, finish in found.items() if finish}
    for write, written in product((_write_shape, _write_blocks), [finishes, {}]):
        names = _PresetNames(written)
        section = write(structure, names)
        if section is None:
            continue
        for contact in written:  # also one that the shape takes by default
            names.name_of(contact)
        tables = {"title": structure.name, "structure": section, **names.sections}
        try:
            if cached_structure(tables) == structure:  # which reading the file takes again
                return tables
        except ArchfemError:  # lengths of one's own shape, or changed after it was made
            if write is _write_blocks and not written:
                raise
    raise InvalidInput(f"structure '{structure.name}' has values that no case file describes")


@dataclass
class _PresetNames:
    """Materials and contacts of a structure by the names of their tables."""

    finishes: dict[Contact, str]  # of contacts whose stiffnesses follow from it
    objects: dict[tuple[str, str], Material | Contact] = field(default_factory=dict)

    def name_of(self, item: Material | Contact) -> str:
        """Return the name of the table of a material or contact, which is added if it is new."""
        section = "materials" if isinstance(item, Material) else "contacts"
        presets, number, name = PRESETS[section], 1, item.name
        # a table changes a preset of its name key by key: what it leaves out would be the preset's
        while self.objects.get((section, name), item) != item or (
            name in presets and set(_list_fields(presets[name])) - set(_list_fields(item))
        ):
            number += 1
            name = f"{item.name} {number}"
        self.objects[section, name] = item
        return name

    @property
    def sections(self) -> dict[str, Any]:
        """Sections [materials] and [contacts]; presets as they are need no table."""
        sections: dict[str, Any] = {}
        for (section, name), item in self.objects.items():
            # a changed copy of the preset of stone, whose own values remain defaults
            copied = isinstance(getattr(item, "strength", None), Usual)
            usual = STONE if copied else PRESETS[section].get(name, type(item))
            own = {key: x for key, x in _list_fields(item).items() if key != "name"}
            # what equals the default of reading is given by hand alone
            by_hand = {key for key, x in own.items() if x and not isinstance(x, Usual)}
            table = {k: x for k, x in own.items() if k in by_hand or x != getattr(usual, k, None)}
            table |= {"preset": STONE.name} if copied and name != STONE.name else {}
            table |= {"name": item.name} if item.name != name else {}
            if isinstance(item, Contact) and (finish := self.finishes.get(item)):
                table = {k: v for k, v in table.items() if k not in FINISHED_KEYS}
                table["finish"] = finish
            if table:
                sections.setdefault(section, {})[name] = table
        return sections


def _list_fields(item: Material | Contact) -> dict[str, Any]:
    """Return the fields of a material or contact that are not None, as a table."""
    table = {each.name: getattr(item, each.name) for each in fields(item)}
    table = {name: value for name, value in table.items() if value is not None}
    if isinstance(weight := table.get("unit_weight"), StatedWeight):
        table["unit_weight"] = f"{float(weight)!r} N/m**3"
    if table.get("friction") == inf:
        table["friction"] = "none"
    if "law" in table:
        table["law"] = _write_law(item)
    return table


def _write_law(contact: Any) -> dict[str, Any]:
    """Return the table of a law of the user, which must be registered."""
    for name, cls in registered_laws.items():
        if type(contact.law) is cls:
            return {"name": name, **{key: getattr(contact.law, key) for key in declared_keys(cls)}}
    raise InvalidInput(
        f"law {contact.law!r} of '{contact.name}' has no name in a file: register its class by "
        "archfem.joints.register_joint_law"
    )


def _write_shape(structure: Structure, names: _PresetNames) -> dict[str, Any] | None:
    """Return shape and lengths by which a structure was made; None where these are not known."""
    if structure.origin is None:
        return None
    shape, arguments = structure.origin
    try:
        section = {key: _write_argument(value, names) for key, value in arguments.items()}
    except TypeError:  # a function, which no file holds
        return None
    return {"shape": shape, **{key: v for key, v in section.items() if v is not None}}


def _write_argument(value: Any, names: _PresetNames) -> Any:
    """Return an argument of a shape, or a block or joint, as a value of a table."""
    if isinstance(value, Material | Contact):
        return names.name_of(value)
    if value is None or isinstance(value, str | bool | int | float):
        return value
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if is_dataclass(value) and not isinstance(value, type):
        return {key: _write_argument(own, names) for key, own in given_fields(value).items()}
    if isinstance(value, Mapping):
        return {key: _write_argument(each, names) for key, each in value.items()}
    if not isinstance(value, Sequence):
        raise TypeError(value)
    items = [_write_argument(each, names) for each in value]
    if not all(isinstance(each, dict) for each in items):
        return items
    # parts of a bridge are tables by their names, which may be the default one
    return {
        part.name: {key: own for key, own in table.items() if key != "name"}
        for part, table in zip(value, items, strict=True)
    }


def _write_blocks(structure: Structure, names: _PresetNames) -> dict[str, Any]:
    """Return all blocks and joints; the most frequent material and contact stand once."""
    sizes = {
        key: x for key, x in given_fields(structure).items() if key in ("width", "gravity", "above")
    }
    section: dict[str, Any] = {"shape": "blocks", **sizes}
    rows: dict[str, list[dict[str, Any]]] = {
        "blocks": [_write_argument(block, names) for block in structure.blocks],
        "joints": [_write_argument(joint, names) for joint in structure.joints],
    }
    for key, parts in zip(_SHARED, rows.values(), strict=True):
        ((usual, _),) = Counter(part[key] for part in parts).most_common(1) or ((None, 0),)
        if usual is not None:
            section[key] = usual
        for part in parts:
            if part[key] == usual:
                del part[key]
    return section | rows
