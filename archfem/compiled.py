"""Where compiled code is kept between runs, and a word when it has to be made.

Numba keeps it beside the sources. Where these cannot be written to, as in an installation for all
users, it is kept in the user's own cache; where that cannot be either, until the process ends.
"""

import atexit
import hashlib
import logging
import os
import shutil
import sys
import tempfile
from functools import cache
from multiprocessing import parent_process
from pathlib import Path
from typing import Any

logger = logging.getLogger("archfem")

SOURCES = tuple(
    Path(__file__).parent / room
    for room in ("joints/moving", "dynamics/stepping", "dynamics/falling")
)
"""Folders of modules with functions that are compiled."""

GIVEN = "NUMBA_CACHE_DIR"
"""Variable of the environment that says where to keep compiled code."""

NOTICE = (
    "archfem: compiling what time steps need, which takes about a minute and is kept for later runs"
    " ('archfem compile' makes all of it, 'archfem doctor' says where it is)\n"
)


@cache
def prepare() -> None:
    """Choose where compiled code is kept; called before the first function is declared."""
    import numba
    from numba.core import event

    folder = _chosen()
    if folder is not None:  # processes that this one starts take it from the environment
        os.environ[GIVEN] = str(folder)
        numba.config.CACHE_DIR = str(folder)  # type: ignore[attr-defined]

    class Notice(event.Listener):
        """Says once that something is compiled that was kept nowhere."""

        def on_start(self, event: Any) -> None:
            function = getattr(event.data["dispatcher"], "py_func", None)
            if getattr(function, "__module__", "").startswith("archfem."):
                _tell()

        def on_end(self, event: Any) -> None:
            pass

    if parent_process() is None:
        event.register("numba:compile", Notice())  # type: ignore[no-untyped-call]


@cache
def _tell() -> None:
    """Write the notice once."""
    sys.stderr.write(NOTICE)
    sys.stderr.flush()


def kept_in() -> list[Path]:
    """Return the folders in which compiled code is kept, there or not."""
    folder = os.environ.get(GIVEN)
    if folder is None:
        return [source / "__pycache__" for source in SOURCES]
    return [found for source in SOURCES for found in Path(folder).glob(f"{source.name}_*")]


def count_kept() -> int:
    """Return how many functions are kept compiled, as their sources are today."""
    newest = 0.0
    if os.environ.get(GIVEN) is None:  # else the folder's name stands for the sources
        newest = max(path.stat().st_mtime for path in _sources())
    kept = [path for folder in kept_in() for path in folder.glob("*.nbi")]
    return sum(path.stat().st_mtime >= newest for path in kept)


def _chosen() -> Path | None:
    """Folder for compiled code; None for that beside the sources."""
    given = os.environ.get(GIVEN)
    if given is None and all(_writable(source / "__pycache__") for source in SOURCES):
        return None
    # Numba looks at the source of each function alone, not at that of what it calls.
    own = f"archfem-{_digest()}"
    places = [Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")) / own]
    if given is not None:
        base = Path(given)  # or what a process chose that started this one
        places.insert(0, (base.parent if base.name.startswith("archfem-") else base) / own)
    for place in places:
        if _writable(place):
            return place
    passing = Path(tempfile.mkdtemp(prefix="archfem-"))
    atexit.register(shutil.rmtree, passing, ignore_errors=True)
    logger.warning(
        "compiled code cannot be kept: neither beside %s nor in %s may be written, so that every "
        "run compiles for a minute; set %s to a folder that you may write to",
        SOURCES[0],
        " or ".join(map(str, places)),
        GIVEN,
    )
    return passing


def _writable(folder: Path) -> bool:
    """Whether files can be made in a folder, which is made where there is none."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def _sources() -> list[Path]:
    """All modules of which something is compiled."""
    return sorted(path for source in SOURCES for path in source.glob("*.py"))


def _digest() -> str:
    """What tells these sources from any others."""
    found = hashlib.sha256()
    for path in _sources():
        found.update(path.name.encode() + path.read_bytes())
    return found.hexdigest()[:16]
