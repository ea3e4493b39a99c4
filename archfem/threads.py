"""Linear algebra on one thread: problems are small, and the same sums come out bit for bit.

Threads of a BLAS share a sum out among themselves, and round it otherwise with their number; where
a joint all but opens, the last bit decides. So what computes takes one thread, whatever the
environment says, and gives back what it found.
"""

import sys
import threading
from collections.abc import Callable
from functools import lru_cache, wraps
from typing import Any, TypeVar

from threadpoolctl import ThreadpoolController

Function = TypeVar("Function", bound=Callable[..., Any])

_here = threading.local()


def on_one_thread(function: Function) -> Function:
    """Make a function do its linear algebra on one thread.

    Args:
        function: that computes; it may call others that are so made.

    Returns:
        The function.
    """

    @wraps(function)
    def alone(*args: Any, **given: Any) -> Any:
        if getattr(_here, "alone", False):
            return function(*args, **given)
        with _libraries(len(sys.modules)).limit(limits=1, user_api="blas"):
            _here.alone = True
            try:
                return function(*args, **given)
            finally:
                _here.alone = False

    return alone  # type: ignore[return-value]


@lru_cache(maxsize=1)
def _libraries(_: int) -> ThreadpoolController:
    """Linear algebra that is loaded; looked for anew, in a millisecond, as modules are imported."""
    return ThreadpoolController()
