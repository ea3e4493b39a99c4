"""Exception classes, one for each remedy; messages give the value, the reason and the remedy."""

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

# Where two outlines of a drawing do not fit: kind of the fault, both names, place [m]
Fault = tuple[str, str, str, tuple[float, float]]

# Receives the warnings of all rooms
logger = logging.getLogger("archfem")


@contextmanager
def filter_log(keep: Callable[[logging.LogRecord], bool], *, first: bool = False) -> Iterator[None]:
    """Filter what is logged within a block, after or before the filters of blocks around it."""
    logger.filters.insert(0 if first else len(logger.filters), keep)
    try:
        yield
    finally:
        logger.removeFilter(keep)


@contextmanager
def keep_warnings() -> Iterator[list[str]]:
    """Yield a list of the warnings of a block, which are not logged."""
    warnings: list[str] = []

    def keep(record: logging.LogRecord) -> bool:
        if is_warning := record.levelno == logging.WARNING:
            warnings.append(record.getMessage())
        return not is_warning

    with filter_log(keep, first=True):
        yield warnings


class ArchfemError(Exception):
    """Base class of all errors that archfem raises on purpose."""

    def __init__(self, message: str = "") -> None:
        if len(message) > 4000:  # a quoted value may have any length
            message = f"{message[:3500]} … {message[-490:]}"
        super().__init__(message)


class InvalidInput(ArchfemError, ValueError):
    """A value, file or key that is not valid: correct it and call again."""


class InvalidStructure(ArchfemError, ValueError):
    """Blocks and joints that do not form a structure: correct the geometry."""

    def __init__(self, message: str = "", faults: Sequence[Fault] = ()) -> None:
        super().__init__(message)
        self.faults = tuple(faults)


class MeshError(ArchfemError):
    """A mesh that does not fit its structure: change the mesh settings."""


class StudyStopped(ArchfemError):
    """A study that was interrupted: finished rows are stored; remove the cause and run again."""


class DiskFull(ArchfemError, OSError):
    """A file that did not fit on the disk: free space, or give another folder, and run again.

    Attributes:
        errno: error number of the operating system.
    """

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.errno = code


class NotInstalled(ArchfemError, ImportError):
    """A package that is required and missing: install it, or choose options without it."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C or SIGTERM within a computation; results up to that point are attached.

    Attributes:
        last: frames of a fall, of the longest steps that were followed to its end, or so far; the
            `Collapse` of a search without dilatancy; or the table of a study.
    """

    def __init__(self, last: Any) -> None:
        super().__init__()
        self.last = last


class DidNotConverge(ArchfemError):
    """No equilibrium was found; results up to that point are attached.

    Attributes:
        last: the last equilibrium found (`Equilibrium` or `State`), frames of a fall, or None.
        history: the `History` up to that point, for a time history, or None.
    """

    def __init__(self, message: str, *, last: Any = None, history: Any = None) -> None:
        super().__init__(message)
        self.last = last
        self.history = history
