"""Kernels that only kernels call have no wrapper for Python; tests call them through one."""

from types import FunctionType
from typing import Any

import numba
from numba.core.caching import FunctionCache, IndexDataCacheFile

from archfem._numba import KERNEL_OPTIONS, source_digest


class WrapperCache(FunctionCache):
    """Compiled wrappers on disk, used until a module with kernels changes."""

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        base = self._impl.filename_base
        self._cache_file = IndexDataCacheFile(self._cache_path, base, source_digest())


def call(*arguments: Any) -> Any:
    """Call a kernel, which is a global of each copy."""
    return KERNEL(*arguments)  # noqa: F821


def from_python(kernel: Any) -> Any:
    """Return a compiled function that calls a kernel, and that Python can call."""
    # numba stores nothing under a closure, whose kernel is another object in each process
    copy = FunctionType(call.__code__, {"KERNEL": kernel, "__name__": __name__}, kernel.__name__)
    copy.__qualname__ = f"{kernel.py_func.__module__}.{kernel.__name__}"
    wrapper = numba.njit(**KERNEL_OPTIONS)(copy)
    wrapper._cache = WrapperCache(copy)
    return wrapper
