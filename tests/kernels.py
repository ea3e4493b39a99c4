"""Kernels that only kernels call have no wrapper for Python; tests call them through one."""

from typing import Any

import numba

from archfem._numba import KERNEL_OPTIONS


def from_python(kernel: Any) -> Any:
    """Return a compiled function that calls a kernel, and that Python can call."""

    @numba.njit(**KERNEL_OPTIONS)
    def call(*arguments: Any) -> Any:
        return kernel(*arguments)

    return call
