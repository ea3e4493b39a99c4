"""All hard cases, in the order of the table."""

from hard import (  # noqa: F401
    cases_of_bridges,
    cases_of_joints,
    cases_of_motion,
    cases_of_shape,
    cases_of_time,
)
from hard.setting import CASES as CASES


def row(number: int) -> tuple[list[str], bool]:
    """Cells of one line, and whether all is as it should be."""
    return CASES[number].row()
