"""What can go wrong: one class for each remedy; messages say what, why and what to do."""

from typing import Any

LONGEST = 4000
"""Most letters of an error: what it quotes may have been of any length."""


class ArchfemError(Exception):
    """Anything archfem refuses or fails to do."""

    def __init__(self, message: str = "") -> None:
        if len(message) > LONGEST:
            message = f"{message[: LONGEST - 500]} … {message[-490:]}"
        super().__init__(message)


class InvalidInput(ArchfemError, ValueError):
    """A value, a file or a key that cannot be meant: correct it and call again."""


class InvalidStructure(ArchfemError, ValueError):
    """Blocks and joints that do not form a structure: correct the geometry."""


class MeshError(ArchfemError):
    """A mesh that does not fit its structure: change the mesh settings."""


class StudyStopped(ArchfemError):
    """A study that could not go on; what was finished is kept: make good what is said, go on."""


class DiskFull(ArchfemError, OSError):
    """A file for which there is no room: make room, or give another folder, and run again.

    Attributes:
        errno: as the system has it.
    """

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.errno = code


class NotInstalled(ArchfemError, ImportError):
    """A package that is asked for and not there: get it as said, or ask for what needs it not."""


class DidNotConverge(ArchfemError):
    """No equilibrium was found; what was computed up to there is kept.

    Attributes:
        last: the last equilibrium found (`Equilibrium` or `State`), or None.
        history: the `History` up to there, for a time history, or None.
    """

    def __init__(self, message: str, *, last: Any = None, history: Any = None) -> None:
        super().__init__(message)
        self.last = last
        self.history = history
