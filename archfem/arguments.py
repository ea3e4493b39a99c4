"""What a caller gave: numbers, whole numbers and rows of them, or an error that says what was."""

from collections.abc import Iterable, Mapping
from math import inf, isfinite
from numbers import Integral, Real
from typing import Any

import numpy as np

from archfem.errors import InvalidInput


def real(value: Any, name: str, *, least: float = -inf) -> float:
    """Return a value that must be a finite number.

    Args:
        value: what was given.
        name: what to call it in an error, with its unit.
        least: smallest value that can be meant.

    Raises:
        InvalidInput: it is no number, not finite or too small.
    """
    if not isinstance(value, Real) or isinstance(value, bool) or not isfinite(value):
        raise InvalidInput(f"{name} = {value!r} is not a finite number")
    if value < least:
        raise InvalidInput(f"{name} = {value!r} is below {least:g}, the least that can be meant")
    return float(value)


def whole(value: Any, name: str, *, least: int = 1) -> int:
    """Return a value that must be a whole number.

    Args:
        value: what was given.
        name: what to call it in an error.
        least: smallest value that can be meant.

    Raises:
        InvalidInput: it is no whole number, or too small.
    """
    if not isinstance(value, Integral) or isinstance(value, bool) or value < least:
        raise InvalidInput(f"{name} = {value!r} is not a whole number of at least {least}")
    return int(value)


def reals(value: Any, name: str, count: int | None = None) -> tuple[float, ...]:
    """Return a row of finite numbers.

    Args:
        value: what was given.
        name: what to call it in an error, with its unit.
        count: how many there must be; None for any number of them.

    Raises:
        InvalidInput: it is no row, holds another number of values, or something else than numbers.
    """
    values = row(value, name, count)
    return tuple(real(each, f"{name}[{k}]") for k, each in enumerate(values))


def unmasked(value: Any, name: str) -> None:
    """Refuse arrays of which something is masked: under the mask is what nobody means.

    Args:
        value: what was given.
        name: what to call it in an error.

    Raises:
        InvalidInput: something is masked.
    """
    if np.ma.is_masked(value):
        raise InvalidInput(
            f"{name} has {np.ma.count_masked(value)} values masked: fill them in, or leave them out"
        )


def row(value: Any, name: str, count: int | None = None) -> tuple[Any, ...]:
    """Return a row of values, whatever they are.

    Args:
        value: what was given.
        name: what to call it in an error.
        count: how many there must be; None for any number of them.

    Raises:
        InvalidInput: it is no row, or one of another length.
    """
    if isinstance(value, str | Mapping) or not isinstance(value, Iterable):
        raise InvalidInput(f"{name} = {value!r} is not a row of values: give {_example(count)}")
    values = tuple(value)
    if count is not None and len(values) != count:
        raise InvalidInput(f"{name} = {value!r} has {len(values)} values: give {_example(count)}")
    return values


def instance(value: Any, kind: type | tuple[type, ...], name: str, remedy: str) -> None:
    """Refuse a value that is not of its kind.

    Args:
        value: what was given.
        kind: class, or classes, that it must be of.
        name: what to call it in an error.
        remedy: what to give instead.

    Raises:
        InvalidInput: it is of another class.
    """
    if not isinstance(value, kind):
        raise InvalidInput(f"{name} is a {type(value).__name__}: {remedy}")


def _example(count: int | None) -> str:
    """A row of so many values, as it is written."""
    return "(a, b, …)" if count is None else f"({', '.join('abcdef'[:count])})"
