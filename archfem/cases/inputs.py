"""Files that a case reads besides its own: records and drawings."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from archfem.cases.settings import Table


def input_files(settings: Table, folder: Path = Path()) -> list[Path]:
    """Return the records and drawings that the tables of a case name, there or not.

    Args:
        settings: the tables by name.
        folder: where relative file names start.
    """
    structure, suite = (_table(settings.get(key)) for key in ("structure", "suite"))
    records = [folder / name for name in _named(settings.get("motion"))]
    own = folder / str(suite.get("folder", ""))
    for pair in _table(suite.get("pairs")).values():
        records += [own / name for name in _named(pair)]
    drawings = [folder / str(structure["file"])] if "file" in structure else []
    return [*drawings, *records]


def _named(motion: Any) -> Iterator[str]:
    """Names of the files of a motion and of its vertical."""
    source = _table(motion)
    if "file" in source:
        yield str(source["file"])
    upright = source.get("vertical")
    if isinstance(upright, str):
        yield upright
    elif upright is not None:
        yield from _named(upright)


def _table(given: Any) -> Table:
    """What was given, if it is a table, else an empty one."""
    return given if isinstance(given, Mapping) else {}
