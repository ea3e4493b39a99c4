"""Tables of a TOML file, refused where nobody means them: too deep, too large, too long."""

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from archfem.errors import InvalidInput
from archfem.files import text_of

LARGEST = 2**20
"""Most bytes of a case: that is a thousand times those there are."""

DEEPEST = 20
"""Most tables and lists in each other."""

WHOLE = 2**63
"""TOML knows no whole number of this size."""

_PART = r"(?:[\w-]++|\"[^\"\n]*+\"|'[^'\n]*+')"
_DEEP_KEY = re.compile(rf"(?<![\w-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{DEEPEST}}}")
_DEEP_VALUE = re.compile(rf"(?:[\[{{]\s*+(?:{_PART}\s*+=\s*+)?+){{{DEEPEST}}}")


def tables_in(path: Path, what: str) -> dict[str, Any]:
    """Return the tables of a file.

    Args:
        path: the file.
        what: it should be, for errors: "case file", "study".

    Raises:
        InvalidInput: there is none, it is not TOML, or nobody means it.
    """
    text = text_of(path, what, LARGEST)
    try:
        return tables_of(text)
    except InvalidInput as error:
        raise InvalidInput(f"{path} is not TOML: {error}") from error


def tables_of(text: str) -> dict[str, Any]:
    """Return the tables that a text holds.

    Args:
        text: TOML.

    Raises:
        InvalidInput: it is not TOML, or nobody means it.
    """
    for pattern in (_DEEP_KEY, _DEEP_VALUE):  # before they are parsed, which would take hours
        if found := pattern.search(text):
            line = text.count("\n", 0, found.start()) + 1
            raise InvalidInput(f"more than {DEEPEST} tables or lists in each other (line {line})")
    try:
        tables = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise InvalidInput(str(error)) from error
    _check(tables, "", 0)
    return tables


def _check(value: Any, key: str, depth: int) -> None:
    """Refuse numbers that TOML does not know, and what is too deep."""
    if depth > DEEPEST:
        raise InvalidInput(f"{key:.80} has more than {DEEPEST} tables or lists in each other")
    if isinstance(value, int) and not -WHOLE <= value < WHOLE:
        raise InvalidInput(f"{key} is a whole number beyond ±2⁶³")
    if isinstance(value, list):
        value = dict(enumerate(value))
    for name, each in value.items() if isinstance(value, Mapping) else ():
        _check(each, f"{key}.{name}".removeprefix("."), depth + 1)
