"""The cases that archfem brings, wherever it is installed."""

import re
import shutil
import tomllib
from pathlib import Path

from archfem.errors import InvalidInput

REFERENCE = re.compile(r'"([\w.-]+\.(?:toml|geojson))"')
"""How a case names a file beside it."""


def shipped() -> dict[str, Path]:
    """Return the files of the cases, by name in alphabetical order."""
    package = Path(__file__).parents[1]
    inside, checkout = package / "examples", package.parent / "meshes"
    folder = inside if inside.is_dir() else checkout
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def shipped_titles() -> dict[str, str]:
    """Return what each of the cases is, in a few words, by name."""
    return {
        name: str(tomllib.loads(path.read_text(encoding="utf-8")).get("title", ""))
        for name, path in shipped().items()
    }


def shipped_text(name: str) -> tuple[str, list[Path]]:
    """Return a case as text that can be read from anywhere, and the files that it refers to.

    Args:
        name: of the case.

    Returns:
        The text, in which files beside the case have their whole paths; and those files.

    Raises:
        InvalidInput: there is no such case.
    """
    path = _path(name)
    text, beside = path.read_text(encoding="utf-8"), _beside(path)
    for file in beside:
        text = text.replace(f'"{file.name}"', f'"{file.resolve().as_posix()}"')
    return text, beside


def copy_shipped(name: str, folder: Path) -> list[Path]:
    """Copy a case, and all that it refers to.

    Args:
        name: of the case.
        folder: to which; it is made.

    Returns:
        The copies, that of the case first.

    Raises:
        InvalidInput: there is no such case, or one of the files is there already.
    """
    files = [_path(name)]
    for file in files:
        files += [each for each in _beside(file) if each not in files]
    copies = [folder / file.name for file in files]
    there = [str(copy) for copy in copies if copy.exists()]
    if there:
        raise InvalidInput(f"{', '.join(there)}: there already; give another folder")
    folder.mkdir(parents=True, exist_ok=True)
    for file, copy in zip(files, copies, strict=True):
        shutil.copyfile(file, copy)
    return copies


def _path(name: str) -> Path:
    """File of a case."""
    found = shipped()
    if name.removesuffix(".toml") not in found:
        raise InvalidInput(f"archfem brings no case '{name}', but these: {', '.join(found)}")
    return found[name.removesuffix(".toml")]


def _beside(path: Path) -> list[Path]:
    """Files beside a case that it refers to, each once."""
    names = dict.fromkeys(REFERENCE.findall(path.read_text(encoding="utf-8")))
    return [path.with_name(name) for name in names if path.with_name(name).is_file()]
