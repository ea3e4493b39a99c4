"""Compiled code, loaded once a process, and compiled once a machine, not once a worker."""

import fcntl
import hashlib
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from archfem.dynamics.compiling import compile_kind

USUAL = "compliance, Conserving"
"""What most cases step by, of the kinds that are compiled apart from each other."""


@cache
def warm() -> None:
    """Step a small arch once; where code is to be compiled for it, one process goes first."""
    with _alone():
        compile_kind(USUAL)


@contextmanager
def _alone() -> Iterator[None]:
    """Let one process go first, unless one has before since the sources were last changed."""
    done = Path(tempfile.gettempdir()) / f"archfem-{os.getuid()}-{_sources()}.warm"
    if done.exists():
        yield
        return
    with done.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
        done.touch()


def _sources() -> str:
    """What tells this state of the modules that are compiled from any other."""
    rooms = Path(__file__).parents[1]
    times = [
        f"{path} {path.stat().st_mtime_ns}"
        for room in ("dynamics", "joints")
        for path in sorted((rooms / room).rglob("*.py"))
    ]
    return hashlib.sha256("\n".join(times).encode()).hexdigest()[:16]
