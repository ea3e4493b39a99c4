"""A study's file as tables."""

import tomllib
from pathlib import Path
from typing import Any

from archfem.errors import InvalidInput


def study_tables(path: Path) -> dict[str, Any]:
    """Return the tables of a study's file.

    Args:
        path: the file, TOML.

    Raises:
        InvalidInput: there is none, or it is not TOML.
    """
    if not path.is_file():
        raise InvalidInput(f"there is no study {path}")
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InvalidInput(f"{path} is not TOML: {error}") from error
