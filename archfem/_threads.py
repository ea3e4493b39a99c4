"""Linear algebra on one thread, so that results are equal bit for bit; signals of the main thread.

The threads of a BLAS split a sum among themselves, and the rounding depends on their number. Where
a joint is about to open, the last bit decides. Problems are small, so one thread is also fastest.
"""

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache, wraps
from typing import Any, TypeVar

from threadpoolctl import ThreadpoolController

Function = TypeVar("Function", bound=Callable[..., Any])

_thread = threading.local()


def single_threaded(function: Function) -> Function:
    """Decorate a function so that its linear algebra runs on one thread."""

    @wraps(function)
    def wrapper(*args: Any, **options: Any) -> Any:
        if getattr(_thread, "is_limited", False):  # a caller has set the limit already
            return function(*args, **options)
        with _find_libraries(len(sys.modules)).limit(limits=1, user_api="blas"):
            _thread.is_limited = True
            try:
                return function(*args, **options)
            finally:
                _thread.is_limited = False

    return wrapper  # type: ignore[return-value]


@lru_cache(maxsize=1)
def _find_libraries(_: int) -> ThreadpoolController:
    """Find the loaded BLAS libraries, again whenever the number of modules has changed (1 ms)."""
    return ThreadpoolController()


@contextmanager
def hold_signals() -> Iterator[None]:
    """Hold Ctrl-C and SIGTERM back in the main thread, and handle them behind the block.

    An exception within a callback of LLVM would be lost, and the compiled code with it. Libraries
    such as gmsh replace handlers by those of the system, which end the process at once: those of
    Python are restored.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    held = list[int]()
    known = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    own = {number: handler for number, handler in known.items() if callable(handler)}
    for number in own:
        signal.signal(number, lambda number, _: held.append(number))
    try:
        yield
    finally:
        for number, handler in own.items():
            signal.signal(number, handler)
        for again in dict.fromkeys(held):
            signal.raise_signal(again)
