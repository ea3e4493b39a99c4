"""TOML files: read safely, merged with their base, checked against tables of keys, and changed.

A file that is too large or too deeply nested is refused before it is parsed. The parser of the
standard library would take hours or exhaust the memory.

A table of keys gives for each key the kind of its value. A kind is a unit such as "m" for a number
or a quantity, `NumberOrWord`, or a Python type. A list of one kind is for a list of values, and a
tuple for one of several kinds. `declared_keys` reads it from a dataclass or function.
"""

import json
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from math import isfinite
from pathlib import Path
from typing import Any

from archfem._files import read_text
from archfem._typing import NumberOrWord
from archfem._validation import declared_keys, short_repr
from archfem.errors import InvalidInput
from archfem.masonry.structure import suggest_name
from archfem.units import STANDARD_GRAVITY, in_degrees, in_unit, kN

Table = Mapping[str, Any]


def read_with_base(path: Path, above: Sequence[Path] = ()) -> dict[str, Any]:
    """Return the tables of a case file, merged over those of its base."""
    max_bases = 20  # a chain of bases that is longer is an error of the user
    settings = read_tables(path, "case file")
    # Links may give one file two names.
    if path.resolve() in above:
        raise InvalidInput(f"{path} is its own base: base must name another file")
    if len(above) >= max_bases:
        raise InvalidInput(f"{path} is the base of {max_bases} files, one on another: merge them")
    # `base` and `remove` are directives, which are not settings of the merged case.
    base = settings.pop("base", None)
    if base is None:
        return settings
    if not isinstance(base, str):
        raise InvalidInput(f"{path}: base = {base!r} is not the name of a file")
    below = read_with_base(path.parent / base, (*above, path.resolve()))
    remove_keys(below, settings.pop("remove", []), f"{path}: ")
    _refuse_hidden_keys(below, settings, path)
    return merge_tables(below, settings)


def _refuse_hidden_keys(below: Table, above: Table, path: Path) -> None:
    """Refuse a value for all parts of a structure where in the base each part has its own."""
    parts, known = above.get("structure", {}), below.get("structure", {})
    for section, table in parts.items() if isinstance(parts, Mapping) else ():
        under = known.get(section) if isinstance(known, Mapping) else None
        if not (isinstance(table, Mapping) and isinstance(under, Mapping)):
            continue
        named = {name: each for name, each in under.items() if isinstance(each, Mapping)}
        for key, value in table.items():
            alike = not isinstance(value, Mapping) and named
            if alike and all(key in each for each in named.values()):
                raise InvalidInput(
                    f"{path}: {key} of [structure.{section}] would have no effect, as each of "
                    f"{[*named]} has its own in the base: give it under each, or take these out "
                    f"by remove = ['structure.{section}.{format_key(next(iter(named)))}.{key}', …]"
                )


def read_tables(path: Path, what: str) -> dict[str, Any]:
    """Return the tables of a file."""
    text = read_text(path, what, max_bytes=2**24)  # ten times that of a wall of 1600 blocks
    try:
        return parse_tables(text)
    except InvalidInput as error:
        raise InvalidInput(f"{path} is not TOML: {error}") from None


def parse_tables(text: str, max_depth: int = 20) -> dict[str, Any]:
    """Return the tables of a text in TOML."""
    # One part of a dotted key, bare or quoted; possessive quantifiers (++, *+) keep matching linear
    part, many = r"(?:[\w-]++|\"[^\"\n]*+\"|'[^'\n]*+')", f"{{{max_depth}}}"
    deep_key = rf"(?<![\w-]){part}(?:[ \t]*+\.[ \t]*+{part}){many}"
    deep_value = rf"(?:[\[{{]\s*+(?:{part}\s*+=\s*+)?+){many}"
    # Deep nesting is detected before parsing, whose time and memory would explode.
    for pattern in (deep_key, deep_value):
        if match := re.search(pattern, text):
            line = text.count("\n", 0, match.start()) + 1
            raise InvalidInput(f"more than {max_depth} tables or lists in each other (line {line})")
    try:
        tables = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise InvalidInput(str(error)) from None
    _check_nesting(tables, "", 0, max_depth)
    return tables


def _check_nesting(value: Any, key: str, depth: int, max_depth: int) -> None:
    """Refuse integers beyond 64 bits and values that are nested too deeply."""
    if depth > max_depth:
        raise InvalidInput(f"{key:.80} has more than {max_depth} tables or lists in each other")
    if isinstance(value, int) and not -(2**63) <= value < 2**63:  # range of integers in TOML
        raise InvalidInput(f"{key} is a whole number beyond ±2⁶³")
    if isinstance(value, list):
        value = dict(enumerate(value))
    for name, inner in value.items() if isinstance(value, Mapping) else ():
        _check_nesting(inner, f"{key}.{name}".removeprefix("."), depth + 1, max_depth)


def merge_tables(below: Table, above: Table) -> dict[str, Any]:
    """Return the tables of one case over those of another, key by key."""
    merged = dict(below)
    for key, value in above.items():
        under = merged.get(key)
        if isinstance(under, Mapping) and isinstance(value, Mapping):
            value = merge_tables(under, value)
        merged[key] = value
    return merged


def remove_keys(settings: dict[str, Any], removed: Any, place: str = "") -> None:
    """Remove the tables and values of a list of paths, which is given at a place."""
    if not isinstance(removed, list) or not all(isinstance(key, str) for key in removed):
        raise InvalidInput(f'{place}remove = {short_repr(removed)}: write ["section.key", …]')
    for key in removed:
        remove_key(settings, key)


def remove_key(settings: dict[str, Any], path: str) -> None:
    """Remove the table or value at "section.key"."""
    *parents, last = split_key_path(path)
    table: Any = settings
    for parent in parents:
        table = table.get(parent, {}) if isinstance(table, dict) else {}
    if not isinstance(table, dict) or last not in table:
        raise InvalidInput(f"remove = '{path}': there is no such key")
    del table[last]


def parse_change(text: str) -> tuple[str, Any]:
    """Return path and value of "section.key=value", read as TOML, or else as a word."""
    # A path and a value on both sides of an equals sign that is not in quotes.
    match = re.fullmatch(r"""((?:[^"'=]|"[^"]*"|'[^']*')+)=(.*)""", text, re.DOTALL)
    if not match or not match[1].strip():
        raise InvalidInput(f"'{text}' is not a change: write section.key=value")
    path, word = match.groups()
    # Shells strip quotes: `model.fidelity=rigid` is not TOML, but a word.
    try:
        return path, parse_tables(f"value = {word}")["value"]
    except InvalidInput:
        return path, word.strip()


def set_value(settings: dict[str, Any], path: str, value: Any) -> None:
    """Set the value at "section.key"; missing tables of the path are added."""
    *parents, last = split_key_path(path)
    table: Any = settings
    for parent in parents:
        table = table.setdefault(parent, {})
        if not isinstance(table, dict):
            raise InvalidInput(f"'{path}' = {value!r}: {parent} is not a table")
    table[last] = value


def apply_change(settings: dict[str, Any], path: str, value: Any) -> None:
    """Set the value at "section.key", or remove what the list of "remove" names."""
    if path.strip() == "remove":
        remove_keys(settings, value)
    else:
        set_value(settings, path, value)


def split_key_path(path: str) -> list[str]:
    """Split "section.key" into the names of the tables and the key."""
    # at each dot between names that is not in quotes
    names = [name.strip() for name in re.split(r"""\.(?=(?:[^"']|"[^"]*"|'[^']*')*$)""", path)]
    names = [name[1:-1] if re.fullmatch(r"""".*"|'.*'""", name) else name for name in names]
    if not all(names) or any(mark in name for name in names for mark in "\"'"):
        raise InvalidInput(
            f"'{path}' names no key: write section.key, and names with dots in quotes, as in "
            'contacts."stone to stone".friction'
        )
    return names


def check_table(table: Any, keys: Table, section: str) -> dict[str, Any]:
    """Check the keys of a table, and convert its values to their kinds."""
    if not isinstance(table, Mapping):
        raise InvalidInput(
            f"{section} = {table!r} is not a table: the keys of one are {sorted(keys)}"
        )
    refuse_unknown(table, keys, section)
    return {key: _convert(value, keys[key], f"{section}.{key}") for key, value in table.items()}


def read_object(cls: Callable[..., Any], table: Any, section: str) -> Any:
    """Return an object whose fields are the keys of a table."""
    keys = declared_keys(cls)
    values = check_table(table, keys, section)
    try:
        return cls(**{name: tuple(v) if isinstance(v, list) else v for name, v in values.items()})
    except TypeError as error:  # a key is missing
        raise InvalidInput(f"{section} = {dict(table)}: {error}; its keys are {[*keys]}") from error


def format_tables(tables: Table, path: tuple[str, ...] = ()) -> str:
    """Return tables as TOML, one line for each value and for each table of a list."""
    own = {key: value for key, value in tables.items() if not isinstance(value, Mapping)}
    lines = [
        f"{format_key(key)} = {_format_value(value, rows=True)}\n" for key, value in own.items()
    ]
    if path and (own or not tables):
        lines.insert(0, f"[{'.'.join(map(format_key, path))}]\n")
    inner = [format_tables(tables[key], (*path, key)) for key in tables if key not in own]
    return "\n".join(["".join(lines)] * bool(lines) + inner)


def format_key(key: str) -> str:
    """Return a key, in quotes where it is not bare."""
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _format_value(key)


def _format_value(value: Any, rows: bool = False) -> str:
    """Return a value as TOML; rows of tables are on lines of their own."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, Mapping):
        items = [f"{format_key(key)} = {_format_value(each)}" for key, each in value.items()]
        return f"{{ {', '.join(items)} }}" if items else "{}"
    if isinstance(value, list | tuple):
        items = [_format_value(each) for each in value]
        if rows and any(isinstance(each, Mapping) for each in value):
            return "".join(["[\n", *(f"    {item},\n" for item in items), "]"])
        return f"[{', '.join(items)}]"
    # NumPy from 2 on prints the type of its numbers
    return float.__repr__(value) if isinstance(value, float) else str(value)


def refuse_unknown(table: Table, keys: Iterable[str], section: str = "") -> None:
    """Refuse keys that are not among those of a section."""
    for key in table:
        if key not in keys:
            hint = suggest_name(key, keys) or f"the keys are {sorted(keys)}"
            if section == "structure" and key in ("materials", "contacts"):
                hint = f"[{key}] stands beside [structure], at the top of the file"
            if key == "density" and "unit_weight" in keys:
                density = 2400.0
                with suppress(InvalidInput):
                    density = in_unit(table[key], "kg/m**3", key)
                weight = f"{density * STANDARD_GRAVITY / kN:.4g} kN/m³ for {density:.5g} kg/m³"
                hint = f"give unit_weight, which is the density times g: {weight}"
            raise InvalidInput(f"unknown key '{section + '.' if section else ''}{key}': {hint}")


def _convert_row(values: Any, kind: Any, key: str) -> list[Any]:
    """Convert the values of a row to their kind."""
    if not isinstance(values, list | tuple):
        raise InvalidInput(f"{key} = {values!r} is not a list: write [a, b, …]")
    # such as thousands of samples of a motion, which each point of a study has
    is_unit = isinstance(kind, str) and kind != "degree"
    if is_unit and all(type(value) is float and isfinite(value) for value in values):
        return list(values)
    return [_convert(value, kind, f"{key}[{n}]") for n, value in enumerate(values)]


def _refuse_none(value: Any, key: str) -> Any:
    """Return a value, and refuse that of limit.strength where a material has its own."""
    if value == "none" and key.endswith(".strength"):
        raise InvalidInput(
            f"{key} = 'none' is no stress: a material may leave its strength out, and "
            'limit.strength = "none" leaves crushing out of limit analysis'
        )
    return value


def _convert(value: Any, kind: Any, key: str) -> Any:
    """Convert one value to the kind of its key."""
    if kind == "degree":
        number = in_degrees(value, key)
        # A quantity keeps its unit: "5 degree" confirms a small angle, a bare 5 may be radians.
        return value if isinstance(value, str) else number
    if isinstance(kind, str):
        return in_unit(_refuse_none(value, key), kind, key)
    if isinstance(kind, NumberOrWord):
        try:
            return None if value == kind.word else in_unit(value, kind.unit, key)
        except InvalidInput as error:
            raise InvalidInput(f'{error}, or "{kind.word}"') from error
    if isinstance(kind, list):
        return _convert_row(value, kind[0], key)
    several = kind if isinstance(kind, tuple) else (kind,)
    kinds = tuple(each for each in several if isinstance(each, type))
    # bool is a subclass of int, and `voussoirs = true` is an error.
    if not isinstance(value, kinds) or (isinstance(value, bool) and bool not in kinds):
        # A value or a row of them, such as one height for all piers or one for each
        for each in several:
            if each not in kinds and isinstance(each, list) == isinstance(value, list):
                return _convert(value, each, key)
        table = f"a table, as in {key.rpartition('.')[2]} = {{ … }}"
        words = {int: "a whole number", str: "a word", bool: "true or false", dict: table}
        reason = f"{key} = {value!r} is not {' or '.join(words[each] for each in kinds)}"
        pair = key.removeprefix("structure.contacts.")
        if pair != key and isinstance(value, Mapping):  # of a law, where its name is expected
            reason += f": write its law under [contacts.{format_key(pair)}], at the top of the file"
        raise InvalidInput(reason)
    return value
