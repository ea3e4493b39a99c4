"""Tables of a case file: which keys they have, what the keys hold, and changes to them.

What a key may hold is written as a unit for a number, `NumberOr` for a number or one of a few
words, a Python type or several, or a list of one unit or type for a list.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from archfem.cases.toml import tables_of
from archfem.errors import InvalidInput
from archfem.masonry.naming import did_you_mean
from archfem.units import in_degrees, in_unit

Table = Mapping[str, Any]

_CHANGE = re.compile(r"""((?:[^"'=]|"[^"]*"|'[^']*')+)=(.*)""", re.DOTALL)
_DOT = re.compile(r"""\.(?=(?:[^"']|"[^"]*"|'[^']*')*$)""")
"""A path and a value parted by an equals sign, and a dot between names, neither in quotes."""

_WORDS = {int: "a whole number", str: "a word", bool: "true or false", dict: "a table"}


@dataclass(frozen=True)
class NumberOr:
    """What a key may hold that takes a number, or a word in its place.

    Attributes:
        unit: of the number.
        words: what each word stands for.
    """

    unit: str
    words: Mapping[str, Any]


def checked(given: Any, keys: Table, section: str) -> dict[str, Any]:
    """Check the keys of a table and turn its values into what they must hold.

    Args:
        given: the table as read.
        keys: what each key may hold.
        section: name of the table, for errors.

    Returns:
        The table with its numbers in the units asked for.

    Raises:
        InvalidInput: it is no table, a key is unknown or a value of the wrong kind.
    """
    if not isinstance(given, Mapping):
        raise InvalidInput(f"{section} = {given!r} is not a table")
    refuse_unknown(given, keys, section)
    return {key: _value(value, keys[key], f"{section}.{key}") for key, value in given.items()}


def refuse_unknown(given: Table, keys: Iterable[str], section: str = "") -> None:
    """Refuse keys that nothing would read.

    Args:
        given: the table as read.
        keys: those there are.
        section: name of the table, for errors; none for the whole case.

    Raises:
        InvalidInput: names the key, and the nearest one there is.
    """
    for key in given:
        if key not in keys:
            hint = did_you_mean(key, keys) or f"the keys are {sorted(keys)}"
            raise InvalidInput(f"unknown key '{section + '.' if section else ''}{key}': {hint}")


def chosen(value: Any, known: Iterable[str], key: str) -> str:
    """Return a word that must be one of several.

    Args:
        value: as read.
        known: the words there are.
        key: where it stands, for errors.

    Raises:
        InvalidInput: it is none of them.
    """
    words = list(known)
    if value not in words:
        raise InvalidInput(f"{key} = {value!r} is not known: use one of {words}")
    return str(value)


def merged(below: Table, above: Table) -> dict[str, Any]:
    """Return the tables of one case over those of another, key by key.

    Args:
        below: tables of the one that is changed.
        above: tables of the other, from which is taken what both have.
    """
    result = dict(below)
    for key, value in above.items():
        under = result.get(key)
        both = isinstance(under, Mapping) and isinstance(value, Mapping)
        result[key] = merged(under, value) if both else value  # type: ignore[arg-type]
    return result


def remove(settings: dict[str, Any], path: str) -> None:
    """Take out the table or value at "section.key".

    Args:
        settings: tables of a case, which are changed.
        path: names of tables and the key, with dots between them.

    Raises:
        InvalidInput: there is none.
    """
    *parents, last = keys_of(path)
    table: Any = settings
    for parent in parents:
        table = table.get(parent, {}) if isinstance(table, dict) else {}
    if not isinstance(table, dict) or last not in table:
        raise InvalidInput(f"without = '{path}': the base has no such key")
    del table[last]


def change(settings: dict[str, Any], text: str) -> None:
    """Set one value from "section.key=value", read as TOML, or as a word.

    Args:
        settings: tables of a case, which are changed.
        text: names of tables and the key with dots between them, "=" and the value.

    Raises:
        InvalidInput: the text is no change, or a parent of the key is not a table.
    """
    parted = _CHANGE.fullmatch(text)
    if not parted or not parted[1].strip():
        raise InvalidInput(f"'{text}' is not a change: write section.key=value")
    path, words = parted.groups()
    try:
        value = tables_of(f"value = {words}")["value"]
    except InvalidInput:
        value = words.strip()
    put(settings, path, value)


def put(settings: dict[str, Any], path: str, value: Any) -> None:
    """Set the value at "section.key"; tables on the way there are made.

    Args:
        settings: tables of a case, which are changed.
        path: names of tables and the key, with dots between them.
        value: what the key is to hold.

    Raises:
        InvalidInput: a parent of the key is not a table.
    """
    *parents, last = keys_of(path)
    table: Any = settings
    for parent in parents:
        table = table.setdefault(parent, {})
        if not isinstance(table, dict):
            raise InvalidInput(f"'{path}' = {value!r}: {parent} is not a table")
    table[last] = value


def keys_of(path: str) -> list[str]:
    """Return the names of the tables on the way to a key, and the key.

    Args:
        path: with dots between them; a name may stand in quotes, as TOML has it, and must where it
            holds a dot itself.

    Raises:
        InvalidInput: a quote does not end, or a name is empty.
    """
    names = [name.strip() for name in _DOT.split(path)]
    bare = [name[1:-1] if re.fullmatch(r"""".*"|'.*'""", name) else name for name in names]
    if not all(bare) or any(mark in name for name in bare for mark in "\"'"):
        raise InvalidInput(
            f"'{path}' names no key: write section.key, and names with dots in quotes, as in "
            'contacts."stone to stone".friction'
        )
    return bare


def _value(value: Any, kind: Any, key: str) -> Any:
    """Turn one value into what its key must hold."""
    if kind == "degree":
        number = in_degrees(value, key)
        return value if isinstance(value, str) else number  # the unit insists on a small angle
    if isinstance(kind, str):
        return in_unit(value, kind, key)
    if isinstance(kind, NumberOr):
        return _number_or_word(value, kind, key)
    if isinstance(kind, list):
        if not isinstance(value, list):
            raise InvalidInput(f"{key} = {value!r} is not a list: write [a, b, …]")
        return [_value(item, kind[0], f"{key}[{n}]") for n, item in enumerate(value)]
    kinds = kind if isinstance(kind, tuple) else (kind,)
    if not isinstance(value, kinds) or (isinstance(value, bool) and bool not in kinds):
        wanted = " or ".join(_WORDS[each] for each in kinds)
        raise InvalidInput(f"{key} = {value!r} is not {wanted}")
    return value


def _number_or_word(value: Any, kind: NumberOr, key: str) -> Any:
    """Turn one value into a number, or what its word stands for."""
    if isinstance(value, str) and value in kind.words:
        return kind.words[value]
    try:
        return in_unit(value, kind.unit, key)
    except InvalidInput as error:
        words = " or ".join(f'"{word}"' for word in kind.words)
        raise InvalidInput(f"{error}, or {words}") from error
