"""Kernels that only kernels call have no wrapper for Python; tests call them through one."""

from contextlib import suppress
from typing import Any

import numba
from numba.core.caching import FunctionCache, IndexDataCacheFile

from archfem._numba import KERNEL_OPTIONS, source_digest

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
