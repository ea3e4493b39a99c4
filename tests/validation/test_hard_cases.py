"""The quick ones of the hard cases, each judged by its own study; all: `python -m hard`."""

import pytest
from hard.table import CASES


@pytest.mark.parametrize("case", [c for c in CASES if c.quick], ids=lambda case: case.name)
def test_hard_case(case):
    cells, right = case.row()
    assert right, " | ".join(cells)
