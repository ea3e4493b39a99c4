"""Combinations of parameters of which the default tests take each value, and the slow ones all."""

from collections.abc import Sequence
from itertools import product
from typing import Any

import pytest


def each_once(*values: Sequence[Any]) -> list[Any]:
    """Return all combinations of values; all but a few of them are slow.

    The few are the diagonal: the first values of all parameters, the second ones, and so on, where
    a shorter list begins anew. So each value is in one of them at least.
    """
    rows = [tuple(number % len(each) for each in values) for number in range(max(map(len, values)))]
    places = product(*(range(len(each)) for each in values))
    combinations = product(*values)
    return [
        pytest.param(*each, marks=() if place in rows else pytest.mark.slow)
        for place, each in zip(places, combinations, strict=True)
    ]
