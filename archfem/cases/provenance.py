"""Digests of all that determines a result: case, input files, program and modules of the user.

Input files count by their content and archfem by that of its modules. A result in a folder is
reused only if its digest is equal, so that no result of another file or version is mistaken.

Python modules of the user, which a case names in `extensions`, are such files. They are code, which
no file runs by itself: a module is loaded after `load_extension`, or by a command with
`--own-code`.
Permissions are stored in the environment, which worker processes inherit.

Installed packages may add to archfem as well, by entry points of the group `archfem.extensions`.
They need no permission: the user has installed them. Their version is part of a digest.
"""

import hashlib
import json
import os
import sys
from collections.abc import Collection, Iterable, Iterator, Mapping
from functools import cache
from importlib import import_module
from importlib.metadata import EntryPoints, entry_points
from pathlib import Path
from types import ModuleType
from typing import Any

from archfem._files import check_file, hash_content
from archfem._validation import report_user_errors, validate_arguments
from archfem.cases.toml_file import Table, check_table
from archfem.errors import InvalidInput
from archfem.units import in_si_unit

# Environment variable with the permitted modules; "*" permits those of all cases
OWN_CODE_VARIABLE = "ARCHFEM_OWN_CODE"

# Sections of a case that define its structure
STRUCTURE_SECTIONS = ("structure", "materials", "contacts")

# SHA-256 of each loaded module, by its name
_loaded: dict[str, str] = {}


def list_input_files(settings: Table, folder: Path = Path()) -> list[Path]:
    """Return the records, drawings, meshes and modules that a case names, existing or not."""
    suite = _as_table(settings.get("suite"))
    named = [("structure", "file"), ("model", "mesh_file")]
    files = [
        folder / str(table[key])
        for section, key in named
        if key in (table := _as_table(settings.get(section)))
    ]
    own = map(str, settings.get("extensions", ()))
    files += [folder / name for name in own if name.endswith(".py")]
    files += [folder / name for name in _record_names(settings.get("motion"))]
    for pair in _as_table(suite.get("pairs")).values():
        files += [folder / str(suite.get("folder", "")) / name for name in _record_names(pair)]
    return files


def hash_file(path: Path) -> str:
    """Return the SHA-256 of the content of a file; "missing" if it cannot be read."""
    try:
        return hash_content(check_file(path, "file", sys.maxsize))
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
    """Return the SHA-256 of a case but for who signs it, its input files and the program."""
    files = [(path.name, hash_file(path)) for path in list_input_files(settings, folder)]
    files += _package_versions(settings)
    # Names without folders: a case that is moved with its files stays the same.
    # Keys are sorted, but the order of arches and piers is their order in the bridge.
    order = _tables_within(settings.get("structure"))
    counted = _in_si({key: value for key, value in settings.items() if key != "report"})
    text = json.dumps([describe_version(), counted, files, order], sort_keys=True, default=str)
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
    # any section may name what a module of the user has registered
    named = tables | {"extensions": settings.get("extensions", ())}
    files = [(str(path), hash_file(path)) for path in list_input_files(named, folder)]
    files += _package_versions(named)
    # keys are not sorted: the order of arches and piers is that in the bridge
    return hashlib.sha256(json.dumps([_in_si(tables), files], default=str).encode()).hexdigest()


def _in_si(value: Any) -> Any:
    """Return values of a case as numbers in SI units, in which equal quantities are equal."""
    if isinstance(value, Mapping):
        return {key: _in_si(own) for key, own in value.items()}
    if isinstance(value, list | tuple):
        return [_in_si(own) for own in value]
    if isinstance(value, str):
        return _read_quantity(value)
    return float(value) if type(value) is int else value


@cache
def _read_quantity(text: str) -> float | str:
    """Return a quantity in its SI unit; other text, such as a date or a name, unchanged."""
    (number,), unit = in_si_unit([text])
    # 15 digits are those of the decimal number, without the round-off of a factor
    return text if unit in ("", "1") else float(f"{number:.15g}")


def remove_presentation(settings: Table) -> dict[str, Any]:
    """Return the settings without those that change no number: title, pictures and films."""
    # the largest values of a run are those of its records, so that `record.every` stays
    record = _as_table(settings.get("record"))
    kept = {key: value for key, value in record.items() if key == "every"}
    presentation = ("title", "output", "record")
    others = {key: value for key, value in settings.items() if key not in presentation}
    return others | ({"record": kept} if kept else {})


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


@validate_arguments
def load_extension(path: str | Path) -> ModuleType:
    """Run a Python module of the user, once, which adds to archfem by functions `register_…`.

    The module runs with all rights of the user: load only what you trust. Cases that name this file
    in `extensions` may load it as well from then on, also in worker processes.

    Args:
        path: file of the module, *.py; modules beside it can be imported by it. Or the name of an
            installed extension, an entry point of the group `archfem.extensions`.

    Returns:
        The module.

    Raises:
        InvalidInput: there is no such file or package, or it ends in an error; its name is that of
            another module; or it was changed after it had been loaded.
    """
    if not str(path).endswith(".py"):
        return _load_package(str(path))
    path = Path(path)
    digest, name = hash_file(path), path.stem
    if digest == "missing":
        raise InvalidInput(f"extension {path} is no file of a Python module: give its path, *.py")
    path = path.resolve()
    if _loaded.setdefault(name, digest) != digest:
        raise InvalidInput(
            f"extension {path} has changed since it was loaded, or another one has its name: "
            "start Python again, or give it another name"
        )
    if str(path.parent) not in sys.path:  # workers inherit this path too
        sys.path.insert(0, str(path.parent))
    try:
        with report_user_errors(f"extension {path.name}"):
            module = import_module(name)
        if Path(module.__file__ or "").resolve() != path:
            raise InvalidInput(f"extension {path}: Python has another module '{name}': rename it")
    except BaseException:
        del _loaded[name]  # a corrected file may be loaded
        raise
    permit_extensions(str(path))
    return module


def _find_extensions() -> EntryPoints:
    """Return the entry points by which installed packages add to archfem."""
    return entry_points(group="archfem.extensions")


def _package_versions(settings: Table) -> list[tuple[str, str]]:
    """Return names and versions of the installed packages that a case names in `extensions`."""
    return [
        (name, entry.dist.version if entry.dist else "unknown")
        for name in map(str, settings.get("extensions", ()))
        for entry in _find_extensions().select(name=name)
    ]


def _load_package(name: str) -> ModuleType:
    """Import the module of an installed extension, which adds to archfem."""
    found = list(_find_extensions().select(name=name))
    if len(found) != 1:
        known = sorted(_find_extensions().names)
        raise InvalidInput(
            f"extension '{name}' is that of {len(found)} installed packages: name one of {known}, "
            "or a file *.py"
        )
    with report_user_errors(f"extension '{name}'"):
        module: ModuleType = found[0].load()
    return module


def find_extensions(objects: Iterable[Any], folder: Path | None) -> list[str]:
    """Return the extensions that define some objects, as a case in a folder names them."""
    own = {str(getattr(each, "__module__", "")) for each in objects}
    modules = {name for name in own if name.partition(".")[0] not in ("", "archfem", "builtins")}
    # a search for installed packages takes 0.1 s
    installed = _find_extensions() if modules else ()
    packages = [entry.name for entry in installed if entry.module in modules]
    files = [str(sys.modules[name].__file__) for name in sorted(modules & set(_loaded))]
    return [*packages, *(name_from(file, folder) for file in files)]


def name_from(file: str | Path, folder: Path | None) -> str:
    """Return the name of a file as seen from a folder; without one, from the root."""
    place = Path(file).resolve()
    return place.as_posix() if folder is None else Path(os.path.relpath(place, folder)).as_posix()


def permit_extensions(name: str = "*") -> None:
    """Permit an extension of cases that this process and its workers read, or all of them."""
    known = os.environ.get(OWN_CODE_VARIABLE, "").split(os.pathsep)
    os.environ[OWN_CODE_VARIABLE] = os.pathsep.join(dict.fromkeys([*filter(None, known), name]))


def load_extensions_of(settings: Table, folder: Path) -> None:
    """Load the extensions of a case, or refuse those that are not permitted."""
    given = {key: settings[key] for key in ("extensions",) if key in settings}
    for name in check_table(given, {"extensions": [str]}, "case").get("extensions", []):
        if not name.endswith(".py"):
            _load_package(name)
            continue
        path = (folder / name).resolve()
        # a report reads its case without the files of it
        if path.stem in _loaded and not path.exists():
            continue
        permitted = os.environ.get(OWN_CODE_VARIABLE, "").split(os.pathsep)
        if not {"*", str(path)} & set(permitted):
            raise InvalidInput(
                f"extensions: '{name}' is code, which no file runs by itself: if you trust it, say "
                f"so, by --own-code or archfem.cases.load_extension('{name}')"
            )
        load_extension(path)
