"""What a caller gave: numbers, whole numbers and rows of them, or an error that says what was."""

from collections.abc import Collection, Iterable, Mapping
from math import inf, isfinite
from numbers import Integral
from types import NoneType
from typing import Any

import numpy as np

from archfem.errors import InvalidInput

LONGEST = 200
"""Most letters of a value that an error quotes."""

_NUMBERS = (int, float, np.integer, np.floating)


def said(value: Any) -> str:
    """Return a value as an error quotes it: not at length, and whatever it is.

    Args:
        value: what was given.
    """
    try:
        words = repr(value)
    except Exception:  # whole numbers of thousands of digits, or what others have written
        return f"<{type(value).__name__} that cannot be written>"
    return words if len(words) <= LONGEST else f"{words[: LONGEST - 20]} … {words[-17:]}"


def real(value: Any, name: str, *, least: float = -inf) -> float:
    """Return a value that must be a finite number.

    Args:
        value: what was given.
        name: what to call it in an error, with its unit.
        least: smallest value that can be meant.

    Raises:
        InvalidInput: it is no number, not finite or too small.
    """
    if not is_number(value):
        raise InvalidInput(f"{name} = {said(value)} is not a finite number")
    if value < least:
        raise InvalidInput(f"{name} = {said(value)} is below {least:g}, the least that is meant")
    return float(value)


def among(value: Any, known: Collection[Any]) -> bool:
    """Return whether a value is one of some words or numbers; an array, a table, a list is none.

    Args:
        value: what was given.
        known: of which it must be one.
    """
    return isinstance(value, (str, *_NUMBERS, NoneType)) and value in known


def is_number(value: Any) -> bool:
    """Return whether a value is a finite number that a float can hold.

    Args:
        value: what was given.
    """
    try:
        return isinstance(value, _NUMBERS) and not isinstance(value, bool) and isfinite(value)
    except OverflowError:  # a whole number too large
        return False


def whole(value: Any, name: str, *, least: int = 1, most: int = 2**62) -> int:
    """Return a value that must be a whole number.

    Args:
        value: what was given.
        name: what to call it in an error.
        least: smallest value that can be meant.
        most: largest value that there is room for.

    Raises:
        InvalidInput: it is no whole number, too small or too large.
    """
    if not isinstance(value, Integral) or isinstance(value, bool) or value < least:
        raise InvalidInput(f"{name} = {said(value)} is not a whole number of at least {least}")
    if int(value) > most:
        raise InvalidInput(f"{name} = {said(value)} is above {most}, the most there is room for")
    return int(value)


def pieces(length: float, size: float, name: str, most: int = 10_000) -> int:
    """Return into how many pieces of about a size a length is cut, one at least.

    Args:
        length: that is cut.
        size: of a piece, above 0.
        name: what to call the pieces in an error, with what makes them fewer.
        most: as many as there is room for.

    Raises:
        InvalidInput: there would be more.
    """
    count = length / size
    if not count <= most:
        raise InvalidInput(
            f"{name}: {length:g} by {size:g} makes {count:.3g}, and there is room for {most}"
        )
    return max(1, round(count))


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
    hidden = int(np.sum(value.mask)) if isinstance(value, np.ma.MaskedArray) else 0
    if hidden:
        raise InvalidInput(f"{name} has {hidden} values masked: fill them in, or leave them out")


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
        raise InvalidInput(f"{name} = {said(value)} is not a row of values: give {_example(count)}")
    try:
        values = tuple(value)
    except TypeError as error:  # an array without axes
        raise InvalidInput(f"{name} = {said(value)} is not a row: {error}") from error
    if count is not None and len(values) != count:
        raise InvalidInput(
            f"{name} = {said(value)} has {len(values)} values: give {_example(count)}"
        )
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
