"""Kernels that only kernels call have no wrapper for Python; tests call them through one.

Or they run as Python, with the same arithmetic: compiling takes seconds where code is new.
"""

from contextlib import suppress
from functools import cache
from types import FunctionType
from typing import Any

import numba
import numpy as np
import pytest
from numba.core.caching import FunctionCache, IndexDataCacheFile

from archfem._numba import KERNEL_OPTIONS, source_digest
from archfem.joints.large import lanes
from archfem.joints.large.lanes import WIDTH

# mypy: disable-error-code="no-untyped-call"


class WrapperCache(FunctionCache):
    """Compiled code of a wrapper on disk, used again until a module with kernels changes."""

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        base = self._impl.filename_base
        self._cache_file = IndexDataCacheFile(self._cache_path, base, source_digest())

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        """Return a key without the kernel, whose pickled form differs in each process."""
        return sig, codegen.magic_tuple()


@cache
def from_python(kernel: Any) -> Any:
    """Return a compiled function that calls a kernel, and that Python can call."""

    def call(*arguments: Any) -> Any:
        return kernel(*arguments)

    # one file of code for each kernel: the name is a part of its file name
    call.__qualname__ = f"{kernel.__module__}.{kernel.__name__}".replace(".", "_")
    wrapper = numba.njit(**KERNEL_OPTIONS)(call)
    with suppress(RuntimeError):  # there is no folder that numba may write to
        wrapper._cache = WrapperCache(call)
    return wrapper


class Lanes(np.ndarray):
    """Eight numbers or conditions, which no operation changes in place."""

    __iadd__ = np.ndarray.__add__
    __isub__ = np.ndarray.__sub__
    __imul__ = np.ndarray.__mul__


def choose(condition: Any, a: Any, b: Any) -> Any:
    """Return the first numbers where conditions hold, else the second; or of single ones."""
    if isinstance(condition, np.ndarray):
        return np.where(condition, a, b).view(Lanes)
    return a if condition else b


def store_lanes(array: Any, row: int, first: int, values: Any) -> None:
    """Store eight numbers in a row of an array."""
    array[row, first : first + WIDTH] = values


LANE_NUMBERS = np.arange(WIDTH)

# Functions of `lanes`, for arrays of eight numbers or single ones
LANE_FUNCTIONS = {
    lanes.least: np.minimum,
    lanes.greatest: np.maximum,
    lanes.select: choose,
    lanes.logarithm: np.log,
    lanes.any_lane: np.any,
    lanes.lane: lambda values, number: values[number],
    lanes.with_lane: lambda values, number, value: choose(number == LANE_NUMBERS, value, values),
    lanes.spread: lambda value: np.full(WIDTH, value).view(Lanes),
    lanes.load: lambda array, row, first: array[row, first : first + WIDTH].copy().view(Lanes),
    lanes.store: store_lanes,
    lanes.gather: lambda array, row, places, side, first: array[
        row, places[side, first : first + WIDTH]
    ].view(Lanes),
}


def with_attributes(value: Any) -> Any:
    """Return an argument whose records have their fields as attributes, as in compiled code."""
    if isinstance(value, np.ndarray | np.void) and value.dtype.names:
        return value.view((np.record, value.dtype))
    if not isinstance(value, tuple):
        return value
    fields = map(with_attributes, value)
    return type(value)(*fields) if hasattr(value, "_fields") else tuple(fields)


@cache
def interpreted(kernel: Any) -> Any:
    """Return a kernel as a function of Python, in which all kernels that it calls are such too."""
    made: dict[Any, Any] = {}

    def find(value: Any) -> Any:
        if isinstance(value, FunctionType):
            return LANE_FUNCTIONS.get(value, value)
        return make(value.py_func) if isinstance(value, numba.core.dispatcher.Dispatcher) else value

    def make(function: Any) -> Any:
        if function not in made:
            known: dict[str, Any] = {}
            made[function] = FunctionType(function.__code__, known, function.__name__)
            used, names = function.__globals__, function.__code__.co_names
            known.update({name: find(used[name]) for name in names if name in used})
        return made[function]

    def call(*arguments: Any) -> Any:
        with np.errstate(all="ignore"):  # parts that are not selected may divide by zero
            return run(*map(with_attributes, arguments))

    run = make(kernel.py_func)
    return call


def either(kernel: Any) -> Any:
    """Return a function that calls a kernel in the way of `each_way`."""
    return lambda *arguments: WAY["way"](kernel)(*arguments)


WAY = {"way": interpreted}


@pytest.fixture(params=[interpreted, pytest.param(from_python, marks=pytest.mark.slow)])
def each_way(request: Any, monkeypatch: Any) -> Any:
    """How kernels run: as Python by default, since compiling takes longer than a test of them."""
    monkeypatch.setitem(WAY, "way", request.param)
    return request.param
