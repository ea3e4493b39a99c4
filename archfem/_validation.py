"""Checks of arguments: numbers, sequences, and values that a function's annotations allow."""

import inspect
import os
import traceback
import unicodedata
from collections.abc import Callable, Collection, Hashable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from functools import cache, wraps
from math import inf, isfinite
from numbers import Integral
from pathlib import Path
from types import NoneType, SimpleNamespace, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from archfem._typing import Array
from archfem.errors import ArchfemError, InvalidInput

_NUMBER_TYPES = (int, float, np.integer, np.floating)


@contextmanager
def report_user_errors(what: str) -> Iterator[None]:
    """Turn an error of code of the user into one that names its module and line."""
    try:
        yield
    except ArchfemError:
        raise
    except Exception as error:
        # the innermost line that is neither of archfem nor of the import system
        package = str(Path(__file__).parent)
        frames = [
            frame
            for frame in traceback.extract_tb(error.__traceback__)
            if not frame.filename.startswith((package, "<")) and "importlib" not in frame.filename
        ]
        place = f" at {Path(frames[-1].filename).name}, line {frames[-1].lineno}" if frames else ""
        raise InvalidInput(f"{what} failed{place}: {type(error).__name__}: {error}") from error


def check_own_keys(what: str, cls: type) -> None:
    """Refuse a class of the user that is no dataclass of single numbers and words."""
    if not is_dataclass(cls):
        raise InvalidInput(f"{what}: {cls!r} is no dataclass: write @dataclass(frozen=True)")
    with report_user_errors(what):
        kinds = declared_keys(cls)
    for each in fields(cls):
        # a row would make a law that has no hash
        if each.init and not isinstance(kinds.get(each.name), str | type):
            raise InvalidInput(f"{what}, {each.name}: {each.type!r} is none of float, int and str")


def declared_keys(declaration: Callable[..., Any], named: tuple[type, ...] = ()) -> dict[str, Any]:
    """Return the keys of a case that a dataclass declares by its fields, a function by arguments.

    Each has the kind of its value for `check_table`: an annotation such as `Metres` its unit, or
    the field's `metadata={"unit": …}`; a dataclass or mapping a table; and objects of the classes
    `named` the name of a table. Values that no file can hold are left out.
    """
    return dict(_find_keys(inspect.unwrap(declaration), named))


@cache
def _find_keys(declaration: Callable[..., Any], named: tuple[type, ...]) -> dict[str, Any]:
    """Find the keys of a declaration once, which each case of a study needs."""
    hints = _hints(declaration, include_extras=True)
    units = dict.fromkeys(hints)
    if isinstance(declaration, type):
        units = {each.name: each.metadata.get("unit") for each in fields(declaration) if each.init}
    kinds = {name: unit or _kind_of(hints[name], named) for name, unit in units.items()}
    return {name: kind for name, kind in kinds.items() if kind is not None}


def given_fields(instance: Any) -> dict[str, Any]:
    """Return the fields of a dataclass that are not None and differ from their defaults."""
    given = {}
    for each in fields(instance):
        value = getattr(instance, each.name)
        if value is not None and value != each.default:
            # no file holds a number of NumPy
            given[each.name] = value.item() if isinstance(value, np.generic) else value
    return given


@cache
def _kind_of(hint: Any, named: tuple[type, ...]) -> Any:
    """Return the kind of a key with an annotation; None for values that no file can hold."""
    kind, inner = get_origin(hint) or hint, get_args(hint)
    plain = {float: "1", int: int, str: str, bool: bool, np.ndarray: ["1"]}
    plain |= dict.fromkeys(named, str)
    if kind is Annotated:  # with a unit, or the kind itself
        return [inner[1]] if get_origin(inner[0]) is np.ndarray else inner[1]
    if kind in (Union, UnionType):
        kinds = [each for each in (_kind_of(each, named) for each in inner) if each is not None]
        # of several rows, such as points and an array of points, the first counts
        rows = [each for each in kinds if isinstance(each, list)]
        kinds = [*dict.fromkeys(each for each in kinds if each not in rows), *rows[:1]]
        return tuple(kinds) if len(kinds) > 1 else next(iter(kinds), None)
    if kind in plain or not isinstance(kind, type):
        return plain.get(kind)
    if is_dataclass(kind) or issubclass(kind, Mapping):
        return dict
    each = _kind_of(inner[0], named) if inner and issubclass(kind, Iterable) else None
    return None if each is None else [each]


def short_repr(value: Any, max_length: int = 200) -> str:
    """Return the `repr` of any value, shortened for an error message."""
    try:
        text = repr(value.item() if isinstance(value, np.number) else value)
    except Exception:  # integers of thousands of digits, or a faulty `__repr__`
        return f"<{type(value).__name__} that cannot be written>"
    if len(text) <= max_length:
        return text
    return f"{text[: max_length - 20]} … {text[-17:]}"


def check_number(value: Any, name: str, *, minimum: float = -inf, maximum: float = inf) -> float:
    """Return a finite number within bounds as a float."""
    if not is_number(value):
        raise InvalidInput(f"{name} = {short_repr(value)} is not a finite number")
    if value < minimum:
        raise InvalidInput(f"{name} = {short_repr(value)} is below {minimum:g}, the least allowed")
    if value > maximum:
        raise InvalidInput(f"{name} = {short_repr(value)} is above {maximum:g}, the most allowed")
    return float(value)


def check_between(
    value: Any,
    name: str,
    low: float,
    high: float = inf,
    *,
    ends: str = "()",
    remedy: str = "",
    error: type[ArchfemError] = InvalidInput,
) -> float:
    """Return a finite number between bounds, of which a parenthesis in `ends` excludes one."""
    # NaN fails every comparison, and is refused as a number out of bounds
    number = value if isinstance(value, float) and value != value else check_number(value, name)
    reaches = number > low if ends[0] == "(" else number >= low
    if reaches and (number < high if ends[1] == ")" else number <= high):
        return number
    limits = f"between {low:g} and {high:g}" if high < inf else f"above {low:g}"
    raise error(f"{name} = {short_repr(value)} is not {limits}{remedy and ': '}{remedy}")


def check_words(value: Any, name: str, remedy: str = "give words") -> None:
    """Refuse all but text, and text with characters that no terminal prints and no file holds."""
    check_type(value, str, name, remedy)
    if value.isprintable():
        return
    # Control characters and halves of surrogate pairs; spaces and marks of any script are fine.
    if bad := [each for each in value if unicodedata.category(each) in ("Cc", "Cs")]:
        raise InvalidInput(
            f"{name} = {short_repr(value)} has {short_repr(bad[0])}, which cannot be printed: "
            "write it without"
        )


def is_one_of(value: Any, known: Collection[Any]) -> bool:
    """Return whether a value is one of some strings or numbers; arrays and lists never are."""
    return isinstance(value, (str, *_NUMBER_TYPES, NoneType)) and value in known


def check_choice(value: Any, name: str, choices: Collection[Any], remedy: str = "") -> Any:
    """Return a value that must be one of some strings or numbers."""
    if is_one_of(value, choices):
        return value
    cause = "is missing" if value is None else f"= {short_repr(value)} is not known"
    raise InvalidInput(f"{name} {cause}: use one of {list(choices)}{remedy}")


def is_number(value: Any) -> bool:
    """Return whether a value is a finite number that a float can hold."""
    try:
        return isinstance(value, _NUMBER_TYPES) and not isinstance(value, bool) and isfinite(value)
    except OverflowError:  # an integer beyond the range of floats
        return False


def check_integer(value: Any, name: str, *, minimum: int = 1, maximum: int = 2**62) -> int:
    """Return an integer within bounds as an int."""
    given = f"{name} = {short_repr(value)}"
    if not isinstance(value, Integral) or isinstance(value, bool) or value < minimum:
        raise InvalidInput(f"{given} is not a whole number of at least {minimum}")
    if int(value) > maximum:
        raise InvalidInput(f"{given} is above {maximum}, the most there is room for")
    return int(value)


def count_pieces(length: float, size: float, name: str, maximum: int = 10_000) -> int:
    """Return the number of pieces of about a given size in a length, at least one."""
    count = length / size
    if not count <= maximum:
        raise InvalidInput(
            f"{name}: {length:g} by {size:g} makes {count:.3g}, and there is room for {maximum}"
        )
    return max(1, round(count))


def check_numbers(value: Any, name: str, count: int | None = None) -> tuple[float, ...]:
    """Return a sequence of finite numbers as a tuple of floats."""
    values = check_sequence(value, name, count)
    return tuple(check_number(each, f"{name}[{k}]") for k, each in enumerate(values))


def check_array(value: Any, name: str) -> Array:
    """Return an array, or nested sequences, of finite unmasked numbers as an array of floats."""
    check_unmasked(value, name)
    if not _is_array(value):
        raise InvalidInput(f"{name} = {short_repr(value)} is no array of finite numbers")
    return np.asarray(value, dtype=float)


def check_unmasked(value: Any, name: str) -> None:
    """Refuse arrays with masked values, whose data below the mask are undefined."""
    count = int(np.sum(value.mask)) if isinstance(value, np.ma.MaskedArray) else 0
    if count:
        raise InvalidInput(f"{name} has {count} values masked: fill them in, or leave them out")


def check_sequence(value: Any, name: str, count: int | None = None) -> tuple[Any, ...]:
    """Return a sequence of any values as a tuple."""
    if isinstance(value, str | Mapping) or not isinstance(value, Iterable):
        raise InvalidInput(
            f"{name} = {short_repr(value)} is not a row of values: give {_example(count)}"
        )
    try:
        values = tuple(value)
    except TypeError as error:  # an array without axes
        raise InvalidInput(f"{name} = {short_repr(value)} is not a row: {error}") from error
    if count is not None and len(values) != count:
        raise InvalidInput(
            f"{name} = {short_repr(value)} has {len(values)} values: give {_example(count)}"
        )
    return values


def check_type(value: Any, expected: type | tuple[type, ...], name: str, remedy: str) -> None:
    """Refuse a value that is not an instance of the expected classes."""
    if not isinstance(value, expected):
        raise InvalidInput(f"{name} is a {type(value).__name__}: {remedy}")


def _example(count: int | None) -> str:
    """Return an example of a sequence of `count` values, as text."""
    return "(a, b, …)" if count is None else f"({', '.join('abcdef'[:count])})"


Function = TypeVar("Function", bound=Callable[..., Any])
Class = TypeVar("Class", bound=type)


def validate_arguments(function: Function) -> Function:
    """Decorate a function so that it refuses arguments which its annotations do not allow.

    Integers must be whole, arrays finite, and sequences hold the annotated types; a bool is no
    number. The function itself checks the rest, such as the sign of a length.
    """
    signature = inspect.signature(function)

    @wraps(function)
    def wrapper(*args: Any, **options: Any) -> Any:
        try:
            bound = signature.bind(*args, **options)
        except TypeError as error:
            raise TypeError(f"{function.__qualname__}() {error}") from None
        _check_values(bound.arguments, _hints(function))
        return function(*args, **options)

    return wrapper  # type: ignore[return-value]


def validate_methods(cls: Class) -> Class:
    """Decorate the public methods of a class with `validate_arguments`."""
    for name, method in list(vars(cls).items()):
        if inspect.isfunction(method) and not name.startswith("_"):
            setattr(cls, name, validate_arguments(method))
    return cls


def check_fields(instance: Any) -> None:
    """Refuse fields of a dataclass that do not match their annotations, in `__post_init__`."""
    hints = _hints(instance.__class__)
    values = {name: getattr(instance, name) for name in hints}
    _check_values(values, hints)
    for name, value in values.items():
        if isinstance(value, str):  # names are printed, and written to files
            check_words(value, name)


def _check_values(values: Mapping[str, Any], hints: Mapping[str, Any]) -> None:
    """Refuse values that do not match their annotations."""
    for name, value in values.items():
        if name in hints and not matches_annotation(value, hints[name]):
            raise InvalidInput(
                f"{name} = {short_repr(value)} is a {type(value).__name__}: give "
                f"{_describe(hints[name])}"
            )


@cache
def _hints(annotated: Any, include_extras: bool = False) -> dict[str, Any]:
    """Evaluate the annotations of a function's arguments or a class's fields, once."""
    if isinstance(annotated, type):
        return get_type_hints(annotated, include_extras=include_extras)
    # what is returned may be of a package that is imported late
    arguments = {key: hint for key, hint in annotated.__annotations__.items() if key != "return"}
    carrier = SimpleNamespace(__annotations__=arguments)
    return get_type_hints(carrier, annotated.__globals__, include_extras=include_extras)


def matches_annotation(value: Any, hint: Any) -> bool:
    """Return whether a value matches an annotation."""
    if type(value) is hint:
        return True
    origin, inner = _split_annotation(hint)
    if origin in (Union, UnionType):
        return any(matches_annotation(value, each) for each in inner)
    if origin is Literal:
        return is_one_of(value, inner)
    if origin is Callable:
        return callable(value)
    if origin is np.ndarray:
        return _is_array(value)
    if origin is Iterable:  # a generator is not consumed
        whole = isinstance(value, str | bytes) or (isinstance(value, np.ndarray) and not value.ndim)
        return isinstance(value, Iterable) and not whole
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return isinstance(value, origin) and all(
            matches_annotation(each, hint)
            for pair in value.items()
            for each, hint in zip(pair, inner, strict=True)
        )
    if isinstance(origin, type) and issubclass(origin, os.PathLike | type):
        return isinstance(value, origin)
    if isinstance(origin, type) and issubclass(origin, Iterable):
        return _is_sequence(value, origin, inner)
    return _is_instance(value, hint)


@cache
def _split_annotation(hint: Hashable) -> tuple[Any, tuple[Any, ...]]:
    """Return the container type of an annotation and its arguments, cached for speed."""
    return get_origin(hint), get_args(hint)


def _is_instance(value: Any, kind: Any) -> bool:
    """Return whether a value is an instance of a class or protocol, or a valid number."""
    if kind is float:  # the function itself checks for NaN and infinity
        return is_number(value) or (isinstance(value, float) and not isfinite(value))
    if kind is int:
        return is_number(value) and value == int(value) and not isinstance(value, float)
    if kind in (None, NoneType):
        return value is None
    if kind is Any or not isinstance(kind, type):
        return True
    if getattr(kind, "_is_protocol", False):
        members, missing = [name for name in vars(kind) if not name.startswith("_")], object()
        # properties are not evaluated, which may be expensive
        return all(inspect.getattr_static(value, name, missing) is not missing for name in members)
    return isinstance(value, kind)


def _is_array(value: Any) -> bool:
    """Return whether a value is an array, or nested sequences, of finite unmasked numbers."""
    if isinstance(value, str | np.ma.MaskedArray):
        return False
    try:
        return bool(np.isfinite(np.asarray(value, dtype=float)).all())
    except (TypeError, ValueError, OverflowError):
        return False


def _is_sequence(value: Any, kind: type, inner: tuple[Any, ...]) -> bool:
    """Return whether a value is a sequence of the annotated types and length."""
    if isinstance(value, str | bytes | bytearray | memoryview | Mapping | np.ma.MaskedArray):
        return False
    if not isinstance(value, Collection) or (isinstance(value, np.ndarray) and not value.ndim):
        return False
    if kind is tuple and inner[-1] is not ...:
        return len(value) == len(inner) and all(map(matches_annotation, value, inner))
    return all(matches_annotation(each, inner[0]) for each in value)


def _describe(hint: Any) -> str:
    """Describe an annotation in words."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return " or ".join(_describe(each) for each in inner)
    if origin is Literal:
        return f"one of {inner}"
    if origin is np.ndarray:
        return "an array of finite numbers"
    if origin is Callable:
        return "a function"
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return f"a table of {' and '.join(_describe(each) for each in inner)}"
    if isinstance(origin, type) and issubclass(origin, Iterable):
        items = [_describe(each) for each in inner if each is not ...]
        return f"a row of {', '.join(items)}"
    if hint in (None, NoneType):
        return "None"
    names = {float: "a number", int: "a whole number", bool: "True or False", str: "words"}
    return names.get(hint, getattr(hint, "__name__", str(hint)))
