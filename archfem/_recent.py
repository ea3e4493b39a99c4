"""Recent results of one process."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

Value = TypeVar("Value")


class RecentResults(OrderedDict[Hashable, Value], Generic[Value]):
    """Results by their keys, of which the least recently used one is dropped."""

    def __init__(self, max_count: int) -> None:
        super().__init__()
        self._max_count = max_count

    def look_up(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """Return the result of a key, or make and keep it."""
        if key not in self:
            self[key] = make()
            while len(self) > self._max_count:
                self.popitem(last=False)
        self.move_to_end(key)
        return self[key]
