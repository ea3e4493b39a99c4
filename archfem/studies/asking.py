"""What a study asks of each case: one function, by name or given, and its options."""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from archfem.cases.case import Case
from archfem.errors import InvalidInput
from archfem.masonry.naming import did_you_mean
from archfem.studies.finders import FINDERS

Value = float | int | str | list[float]
"""One finding: a number, words, or a row of numbers."""

Find = Callable[..., Mapping[str, Any]]
"""Finds something of a case: a flat table of numbers, words and rows of numbers."""


@dataclass(frozen=True)
class Asked:
    """A function from a case to findings, with its options.

    Attributes:
        find: the function; it takes a case and the options as keywords.
        options: of the function, by name.
    """

    find: Find
    options: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, given: Any) -> "Asked":
        """Return what is asked for.

        Args:
            given: name of a finder ("history", "scales", …), "package.module:function", a function,
                or a table with its `name` and its options.

        Raises:
            InvalidInput: there is no such finder, or it does not take these options.
        """
        options: dict[str, Any] = {}
        if isinstance(given, Mapping):
            options = dict(given)
            given = options.pop("name", None)
        find = _by_name(given) if isinstance(given, str) else given
        if not callable(find):
            raise InvalidInput(
                f"find = {given!r}: name one of {sorted(FINDERS)}, or 'package.module:function'"
            )
        try:
            inspect.signature(find).bind(None, **options)
        except TypeError as error:
            raise InvalidInput(f"find = {given!r} does not take {options}: {error}") from error
        return cls(find, options)

    @property
    def text(self) -> str:
        """What tells this from anything else that is asked: the function's module, and options."""
        name = f"{self.find.__module__}:{getattr(self.find, '__qualname__', repr(self.find))}"
        try:
            source = _source(self.find)
        except (OSError, TypeError):
            source = ""
        return f"{name} {sorted(self.options.items())!r}\n{source}"

    def of_case(self, case: Case) -> dict[str, Value]:
        """Return what is found of a case.

        Args:
            case: what is asked about.

        Raises:
            InvalidInput: the function gives something else than numbers, words and rows of them.
        """
        found = self.find(case, **self.options)
        if not isinstance(found, Mapping):
            raise InvalidInput(f"find gave a {type(found).__name__}: it is to give a flat table")
        return {str(key): _value(key, value) for key, value in found.items()}


def refuse_code(given: Any) -> None:
    """Refuse what a file says is to be found if that is code of its own.

    Args:
        given: as for `Asked.of`.

    Raises:
        InvalidInput: it names a function of a module.
    """
    name = given.get("name") if isinstance(given, Mapping) else given
    if isinstance(name, str) and ":" in name:
        raise InvalidInput(
            f"find = '{name}' is code, which no file runs by itself: if you trust it, say so, "
            "archfem study --own-code, or Study.read(…, own_code=True)"
        )


def _source(find: Find) -> str:
    """Source of the module that a function is of; of the function alone where it has no file."""
    file = inspect.getsourcefile(find)
    if file is None or not Path(file).is_file():
        return inspect.getsource(find)
    return Path(file).read_text(encoding="utf-8")


def _by_name(name: str) -> Find:
    """A function of ours by its name, or one of the user's by that of its module."""
    if name in FINDERS:
        return FINDERS[name]
    module, colon, function = name.partition(":")
    if not colon:
        hint = did_you_mean(name, FINDERS) or f"use one of {sorted(FINDERS)}"
        raise InvalidInput(f"find = '{name}' is not known: {hint}, or 'package.module:function'")
    try:
        found: Find = getattr(import_module(module), function)
    except (ImportError, AttributeError) as error:
        raise InvalidInput(f"find = '{name}': {error}") from error
    return found


def _value(key: str, value: Any) -> Value:
    """One finding as JSON can hold it."""
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, bool):
        return int(value)
    if value is None:
        return float("nan")
    if isinstance(value, str):
        return str(value)
    if isinstance(value, int | float):
        return value
    if isinstance(value, list | tuple) and all(isinstance(each, int | float) for each in value):
        return [float(each) for each in value]
    raise InvalidInput(
        f"finding '{key}' is a {type(value).__name__}: give a number, words, or a row of numbers"
    )
