"""Digests of everything that determines a result: the case, its input files and the program.

Input files count by their content and archfem by that of its modules. A result in a folder is
reused only if its digest is equal, so that no result of another file or version is mistaken.
"""

import hashlib
import json
import sys
from collections.abc import Collection, Iterable, Iterator, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from archfem._files import check_file
from archfem.cases.toml_file import Table
from archfem.errors import InvalidInput


def list_input_files(settings: Table, folder: Path = Path()) -> list[Path]:
    """Return the records, drawings and meshes that a case names, existing or not."""
    suite = _as_table(settings.get("suite"))
    named = [("structure", "file"), ("model", "mesh_file")]
    files = [
        folder / str(table[key])
        for section, key in named
        if key in (table := _as_table(settings.get(section)))
    ]
    files += [folder / name for name in _record_names(settings.get("motion"))]
    for pair in _as_table(suite.get("pairs")).values():
        files += [folder / str(suite.get("folder", "")) / name for name in _record_names(pair)]
    return files


def hash_file(path: Path) -> str:
    """Return the SHA-256 of the content of a file; "missing" if it cannot be read."""
    try:
        with check_file(path, "file", sys.maxsize).open("rb") as content:
            return hashlib.file_digest(content, "sha256").hexdigest()
    except (OSError, InvalidInput):
        return "missing"


def describe_version() -> str:
    """Return the version of archfem, followed by a digest of its modules."""
    return f"{import_module('archfem').__version__}+{_hash_modules()[:12]}"


@cache
def _hash_modules() -> str:
    """Return the SHA-256 of all modules of archfem."""
    package, digest = Path(__file__).parents[1], hashlib.sha256()
    # The path is hashed as well: moving code between modules is a change.
    for module in sorted(package.rglob("*.py")):
        digest.update(str(module.relative_to(package)).encode() + module.read_bytes())
    return digest.hexdigest()


def hash_inputs(settings: Table, folder: Path = Path()) -> str:
    """Return the SHA-256 of a case, its input files and the program."""
    files = [(path.name, hash_file(path)) for path in list_input_files(settings, folder)]
    # Names without folders: a case that is moved with its files stays the same.
    # Keys are sorted, but the order of arches and piers is their order in the bridge.
    order = _tables_within(settings.get("structure"))
    text = json.dumps([describe_version(), settings, files, order], sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def hash_sections(
    settings: Table, folder: Path, sections: Iterable[str], left_out: Collection[str] = ()
) -> str:
    """Return the SHA-256 of sections of a case, without some of their keys, and their files."""
    tables = {
        name: {key: value for key, value in settings[name].items() if key not in left_out}
        for name in sections
        if name in settings
    }
    files = [(str(path), hash_file(path)) for path in list_input_files(tables, folder)]
    # keys are not sorted: the order of arches and piers is that in the bridge
    return hashlib.sha256(json.dumps([tables, files], default=str).encode()).hexdigest()


def remove_presentation(settings: Table) -> dict[str, Any]:
    """Return the settings without those that change no number: the title, and pictures and films.

    The largest values of a run are those of its records, so that `output.save_every` stays.
    """
    output = _as_table(settings.get("output"))
    kept = {key: value for key, value in output.items() if key == "save_every"}
    others = {key: value for key, value in settings.items() if key not in ("title", "output")}
    return others | ({"output": kept} if kept else {})


def _record_names(motion: Any) -> Iterator[str]:
    """Names of the files of records and responses of a motion and of its vertical."""
    source = _as_table(motion)
    yield from (str(source[key]) for key in ("file", "response") if key in source)
    vertical = source.get("vertical")
    if isinstance(vertical, str):
        yield vertical
    elif vertical is not None:
        yield from _record_names(vertical)


def _tables_within(table: Any) -> list[Any]:
    """Names of the tables within a table in their order, each with those within it."""
    items = _as_table(table).items()
    return [(name, _tables_within(value)) for name, value in items if isinstance(value, Mapping)]


def _as_table(value: Any) -> Table:
    """Return a value that is a table, or else an empty table."""
    return value if isinstance(value, Mapping) else {}
