"""Example cases that are installed with archfem, and commented cases to begin with."""

import re
import shutil
import tomllib
from pathlib import Path

from archfem._files import atomic_write, create_result_folder
from archfem.errors import InvalidInput


def list_examples() -> dict[str, Path]:
    """Return the files of the example cases by name, in alphabetical order."""
    package = Path(__file__).parents[1]
    installed, checkout = package / "examples", package.parent / "meshes"
    # A wheel contains the cases; an editable installation reads those of the checkout.
    folder = installed if installed.is_dir() else checkout
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def list_example_titles() -> dict[str, str]:
    """Return the titles of the example cases by name."""
    return {
        name: str(tomllib.loads(path.read_text(encoding="utf-8")).get("title", ""))
        for name, path in list_examples().items()
    }


def read_example(name: str) -> tuple[str, list[Path]]:
    """Return the text of an example with absolute file names, and the files that it names."""
    path = _example_path(name)
    text, companions = path.read_text(encoding="utf-8"), _files_named_by(path)
    # The text may be saved anywhere, so that names beside the case become absolute.
    for file in companions:
        text = text.replace(f'"{file.name}"', f'"{file.resolve().as_posix()}"')
    return text, companions


def copy_example(name: str, folder: Path) -> list[Path]:
    """Copy an example and all files that it names, directly or through its base."""
    files = [_example_path(name)]
    for file in files:  # the list grows while it is read
        files += [path for path in _files_named_by(file) if path not in files]
    copies = [folder / file.name for file in files]
    existing = [str(copy) for copy in copies if copy.exists()]
    if existing:
        raise InvalidInput(f"{', '.join(existing)}: there already; give another folder")
    create_result_folder(folder)
    for file, copy in zip(files, copies, strict=True):
        shutil.copyfile(file, copy)
    return copies


def list_new_cases() -> dict[str, Path]:
    """Return the commented cases to begin with, by the kind of structure."""
    return {path.stem: path for path in sorted(Path(__file__).with_name("new").glob("*.toml"))}


def write_new_case(kind: str, path: Path, schema: Path) -> None:
    """Write a commented case that runs, which names its JSON schema for editors."""
    if path.exists():
        raise InvalidInput(f"{path} is there already: name another file with --out")
    text = list_new_cases()[kind].read_text(encoding="utf-8")
    with atomic_write(path) as draft:
        draft.write_text(f"#:schema {schema.resolve().as_uri()}\n{text}", encoding="utf-8")


def _example_path(name: str) -> Path:
    """Return the file of an example."""
    examples = list_examples()
    if name.removesuffix(".toml") not in examples:
        raise InvalidInput(f"archfem brings no case '{name}', but these: {', '.join(examples)}")
    return examples[name.removesuffix(".toml")]


def _files_named_by(path: Path) -> list[Path]:
    """Return the existing files beside a case that it names, each once."""
    pattern = r'"([\w.-]+\.(?:toml|geojson))"'  # name of a file, as the case writes it
    names = dict.fromkeys(re.findall(pattern, path.read_text(encoding="utf-8")))
    return [path.with_name(name) for name in names if path.with_name(name).is_file()]
