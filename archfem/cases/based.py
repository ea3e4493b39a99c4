"""Tables of a case file over those of the file that it is based on."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from archfem.arguments import said
from archfem.cases.settings import merged, remove
from archfem.cases.toml import tables_in
from archfem.errors import InvalidInput

MOST_BASES = 20
"""Most files that are based one on the other."""


def based_tables(path: Path, above: Sequence[Path] = ()) -> dict[str, Any]:
    """Return the tables of a case file over those of its base.

    Args:
        path: the file.
        above: files that are based on it, one on the other.

    Raises:
        InvalidInput: there is no such file, it is not TOML, or its base cannot be meant.
    """
    settings = tables_in(path, "case file")
    if path.resolve() in above:
        raise InvalidInput(f"{path} is its own base: base must name another file")
    if len(above) >= MOST_BASES:
        raise InvalidInput(f"{path} is the base of {MOST_BASES} files, one on another: merge them")
    base = settings.pop("base", None)
    if base is None:
        return settings
    if not isinstance(base, str):
        raise InvalidInput(f"{path}: base = {base!r} is not the name of a file")
    below = based_tables(path.parent / base, (*above, path.resolve()))
    without = settings.pop("without", [])
    if not isinstance(without, list) or not all(isinstance(key, str) for key in without):
        raise InvalidInput(f'{path}: without = {said(without)}: write ["section.key", …]')
    for key in without:
        remove(below, key)
    return merged(below, settings)
