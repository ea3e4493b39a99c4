"""A study's file as tables."""

from pathlib import Path
from typing import Any

from archfem.cases.toml import tables_in


def study_tables(path: Path) -> dict[str, Any]:
    """Return the tables of a study's file.

    Args:
        path: the file, TOML.

    Raises:
        InvalidInput: there is none, or it is not TOML.
    """
    return tables_in(path, "study")
