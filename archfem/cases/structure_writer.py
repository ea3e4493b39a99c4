"""Structures as tables of a case file: by shape and lengths where these are known, or by blocks.

Either way the tables are read once and compared, so that a file has every bit of its structure.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from math import inf
from typing import Any

import numpy as np

from archfem._validation import declared_keys
from archfem.cases.structure_keys import cached_structure
from archfem.errors import ArchfemError, InvalidInput
from archfem.joints.own_law import registered_laws
from archfem.masonry.block import Block
from archfem.masonry.materials import CONTACT_PRESETS, MATERIAL_PRESETS, Contact, Material
from archfem.masonry.structure import Joint, Structure

# Joint.contact and Block.material of most parts stand once, above the lists
_SHARED = ("material", "contact")


def write_structure(structure: Structure) -> dict[str, Any]:
    """Return the sections of a case file that describe a structure to the last bit."""
    for write in (_write_shape, _write_blocks):
        names = _PresetNames()
        section = write(structure, names)
        if section is None:
            continue
        tables = {"title": structure.name, "structure": section, **names.sections}
        try:
            if cached_structure(tables) == structure:  # which reading the file takes again
                return tables
        except ArchfemError:  # lengths of one's own shape, or changed after it was made
            if write is _write_blocks:
                raise
    raise InvalidInput(f"structure '{structure.name}' has values that no case file describes")


@dataclass
class _PresetNames:
    """Materials and contacts of a structure by the names of their tables."""

    objects: dict[tuple[str, str], Material | Contact] = field(default_factory=dict)

    def name_of(self, item: Material | Contact) -> str:
        """Return the name of the table of a material or contact, which is added if it is new."""
        section, presets = (
            ("materials", MATERIAL_PRESETS)
            if isinstance(item, Material)
            else ("contacts", CONTACT_PRESETS)
        )
        number, name = 1, item.name
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
        presets: Mapping[str, Any] = {**MATERIAL_PRESETS, **CONTACT_PRESETS}
        for (section, name), item in self.objects.items():
            if presets.get(name) != item:
                table = _list_fields(item)
                if table.pop("name") != name:
                    table["name"] = item.name
                sections.setdefault(section, {})[name] = table
        return sections


def _list_fields(item: Material | Contact) -> dict[str, Any]:
    """Return the fields of a material or contact that are not None, as a table."""
    table = {each.name: getattr(item, each.name) for each in fields(item)}
    table = {name: value for name, value in table.items() if value is not None}
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
    """Return an argument of a shape as a value of a table."""
    if isinstance(value, Material | Contact):
        return names.name_of(value)
    if value is None or isinstance(value, str | bool | int | float):
        return value
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if is_dataclass(value) and not isinstance(value, type):  # a part of a bridge
        own = {each.name: getattr(value, each.name) for each in fields(value)}
        defaults = {each.name: each.default for each in fields(value)}
        return {k: _write_argument(v, names) for k, v in own.items() if v != defaults[k]}
    if isinstance(value, Sequence):
        items = [_write_argument(each, names) for each in value]
        named = items and all(isinstance(each, dict) for each in items)
        return {each.pop("name"): each for each in items} if named else items
    raise TypeError(value)


def _write_blocks(structure: Structure, names: _PresetNames) -> dict[str, Any]:
    """Return all blocks and joints; the most frequent material and contact stand once."""
    section: dict[str, Any] = {"shape": "blocks"}
    section |= {"width": structure.width, "gravity": structure.gravity}
    rows: dict[str, list[dict[str, Any]]] = {
        "blocks": [_write_part(block, names) for block in structure.blocks],
        "joints": [_write_part(joint, names) for joint in structure.joints],
    }
    for key, parts in zip(_SHARED, rows.values(), strict=True):
        ((usual, _),) = Counter(part[key] for part in parts).most_common(1) or ((None, 0),)
        if usual is not None:
            section[key] = usual
        rows |= {}
        for part in parts:
            if part[key] == usual:
                del part[key]
    return section | rows


def _write_part(part: Block | Joint, names: _PresetNames) -> dict[str, Any]:
    """Return the fields of a block or joint that differ from their defaults."""
    table: dict[str, Any] = {}
    for each in fields(part):
        value = getattr(part, each.name)
        if value is None or value == each.default:
            continue
        if isinstance(value, Material | Contact):
            value = names.name_of(value)
        table[each.name] = value
    return table
