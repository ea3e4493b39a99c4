"""Arguments held against the annotations of the function that takes them."""

import inspect
import os
from collections.abc import Callable, Collection, Hashable, Iterable, Mapping
from functools import cache, wraps
from math import isfinite
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from archfem.arguments import is_number, said
from archfem.errors import InvalidInput

Function = TypeVar("Function", bound=Callable[..., Any])
Kind = TypeVar("Kind", bound=type)

_WORDS = {float: "a number", int: "a whole number", bool: "True or False", str: "words"}


def as_annotated(function: Function) -> Function:
    """Make a function refuse what its annotations do not allow, before it does anything.

    Whole numbers must be whole, arrays finite, and rows hold what they say; a bool is no number.
    What an annotation cannot say, such as the sign of a length, is left to the function.

    Args:
        function: whose parameters are annotated.

    Returns:
        The function, which then raises `InvalidInput` with name, value and what to give.
    """
    signature = inspect.signature(function)

    @wraps(function)
    def held(*args: Any, **given: Any) -> Any:
        _check(signature.bind(*args, **given).arguments, _hints(function))
        return function(*args, **given)

    return held  # type: ignore[return-value]


def methods_as_annotated(kind: Kind) -> Kind:
    """Make the public methods of a class refuse what their annotations do not allow.

    Args:
        kind: the class.

    Returns:
        The same class.
    """
    for name, method in list(vars(kind).items()):
        if inspect.isfunction(method) and not name.startswith("_"):
            setattr(kind, name, as_annotated(method))
    return kind


def check_fields(instance: Any) -> None:
    """Refuse fields of a dataclass that are not as annotated; for its `__post_init__`.

    Args:
        instance: of the dataclass.

    Raises:
        InvalidInput: names the field, what was given and what to give.
    """
    hints = _hints(instance.__class__)
    _check({name: getattr(instance, name) for name in hints}, hints)


def _check(given: Mapping[str, Any], hints: Mapping[str, Any]) -> None:
    for name, value in given.items():
        if name in hints and not fits(value, hints[name]):
            kind = type(value).__name__
            raise InvalidInput(f"{name} = {said(value)} is a {kind}: give {_wanted(hints[name])}")


@cache
def _hints(annotated: Hashable) -> dict[str, Any]:
    return get_type_hints(annotated)


def fits(value: Any, hint: Any) -> bool:
    """Return whether a value is as an annotation says.

    Args:
        value: what was given.
        hint: the annotation.
    """
    if type(value) is hint:
        return True
    origin, inner = _parts(hint)
    if origin in (Union, UnionType):
        return any(fits(value, each) for each in inner)
    if origin is Literal:
        return value in inner
    if origin is _CALLABLE:
        return callable(value)
    if origin is np.ndarray:
        return _is_array(value)
    if isinstance(origin, type) and issubclass(origin, os.PathLike | Mapping | type):
        return isinstance(value, origin)
    if isinstance(origin, type) and issubclass(origin, Iterable):
        return _is_row(value, origin, inner)
    return _is_plain(value, hint)


@cache
def _parts(hint: Hashable) -> tuple[Any, tuple[Any, ...]]:
    """What an annotation is of, and what it holds."""
    return get_origin(hint), get_args(hint)


_CALLABLE = get_origin(Callable[[], None])
_TABLES = (Mapping, dict)
_MISSING = object()


def _is_plain(value: Any, kind: Any) -> bool:
    """Whether a value is of a class, or a number that can be meant."""
    if kind is float:  # what is beyond all bounds, or none, is left to the function
        return is_number(value) or (isinstance(value, float) and not isfinite(value))
    if kind is int:
        return is_number(value) and value == int(value) and not isinstance(value, float)
    if kind in (None, NoneType):
        return value is None
    if kind is Any or not isinstance(kind, type):
        return True
    if getattr(kind, "_is_protocol", False):
        offered = [name for name in vars(kind) if not name.startswith("_")]
        return all(
            inspect.getattr_static(value, name, _MISSING) is not _MISSING for name in offered
        )
    return isinstance(value, kind)


def _is_array(value: Any) -> bool:
    """Whether a value is an array of finite numbers, none of them masked, or a row of such."""
    if isinstance(value, str | np.ma.MaskedArray):
        return False
    try:
        return bool(np.isfinite(np.asarray(value, dtype=float)).all())
    except (TypeError, ValueError, OverflowError):
        return False


def _is_row(value: Any, kind: type, inner: tuple[Any, ...]) -> bool:
    """Whether a value is a row of what it should hold, and of as many."""
    if isinstance(value, str | bytes | bytearray | memoryview | Mapping):
        return False
    if not isinstance(value, Collection) or (isinstance(value, np.ndarray) and not value.ndim):
        return False
    if isinstance(value, np.ma.MaskedArray):
        return False
    if kind is tuple and inner[-1] is not ...:
        return len(value) == len(inner) and all(map(fits, value, inner))
    return all(fits(each, inner[0]) for each in value)


def _wanted(hint: Any) -> str:
    """What an annotation asks for, in words."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return " or ".join(_wanted(each) for each in inner)
    if origin is Literal:
        return f"one of {inner}"
    if origin is np.ndarray:
        return "an array of finite numbers"
    if origin is _CALLABLE:
        return "a function"
    if isinstance(origin, type) and issubclass(origin, Iterable) and origin not in _TABLES:
        some = [_wanted(each) for each in inner if each is not ...]
        return f"a row of {', '.join(some)}"
    if hint in (None, NoneType):
        return "None"
    return _WORDS.get(hint, getattr(hint, "__name__", str(hint)))
