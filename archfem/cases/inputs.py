"""What an answer hangs on besides the case's own words: the files it reads, and the program.

Records and drawings count by their content, and archfem by that of its modules, so that nothing is
taken for an answer that was found from another file or by another program.
"""

import hashlib
import json
import sys
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from archfem.cases.settings import Table
from archfem.errors import InvalidInput
from archfem.files import check_file

PACKAGE = Path(__file__).parents[1]

LETTERS = 12
"""Of the digest of the program that a version shows."""


def input_files(settings: Table, folder: Path = Path()) -> list[Path]:
    """Return the records, drawings and meshes that the tables of a case name, there or not.

    Args:
        settings: the tables by name.
        folder: where relative file names start.
    """
    structure, suite = (_table(settings.get(key)) for key in ("structure", "suite"))
    records = [folder / name for name in _named(settings.get("motion"))]
    own = folder / str(suite.get("folder", ""))
    for pair in _table(suite.get("pairs")).values():
        records += [own / name for name in _named(pair)]
    shapes = (structure, _table(settings.get("model")))
    drawings = [folder / str(table["file"]) for table in shapes if "file" in table]
    return [*drawings, *records]


def content_digest(path: Path) -> str:
    """Return what tells the content of a file, read anew; a word where it cannot be read.

    Args:
        path: the file.
    """
    try:
        with check_file(path, "file", sys.maxsize).open("rb") as content:
            return hashlib.file_digest(content, "sha256").hexdigest()
    except (OSError, InvalidInput):
        return "missing"


def package_version() -> str:
    """Return the version of archfem that runs, with a digest of its modules behind it."""
    return f"{import_module('archfem').__version__}+{_modules_digest()[:LETTERS]}"


@cache
def _modules_digest() -> str:
    """Digest of all modules of archfem."""
    told = hashlib.sha256()
    for module in sorted(PACKAGE.rglob("*.py")):
        told.update(str(module.relative_to(PACKAGE)).encode() + module.read_bytes())
    return told.hexdigest()


def inputs_digest(settings: Table, folder: Path = Path()) -> str:
    """Return what tells a case, its files and the program from all others.

    Args:
        settings: the tables by name.
        folder: where relative file names start.
    """
    files = [(path.name, content_digest(path)) for path in input_files(settings, folder)]
    order = _tables_within(settings.get("structure"))  # arches and piers stand in theirs
    text = json.dumps([package_version(), settings, files, order], sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()


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


def _tables_within(table: Any) -> list[Any]:
    """Names of the tables within a table, in their order, each with those within it."""
    own = _table(table).items()
    return [(name, _tables_within(each)) for name, each in own if isinstance(each, Mapping)]


def _table(given: Any) -> Table:
    """What was given, if it is a table, else an empty one."""
    return given if isinstance(given, Mapping) else {}
