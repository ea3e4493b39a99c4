"""Compiled code, loaded once a process, and compiled once a machine, not once a worker."""

import fcntl
import hashlib
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from archfem.cases.case import Case
from archfem.cases.run import Rest, shaken

RING = {
    "structure": {
        "shape": "circular_arch",
        "radius": 3.0,
        "thickness": 0.5,
        "embrace": 150.0,
        "voussoirs": 3,
    },
    "model": {"fidelity": "rigid"},
    "analysis": {"dt": 0.005, "damping": {"ratio": 0.05, "frequency": 8.0}},
    "motion": {"synthetic": {"seed": 1, "duration": 0.3, "pga": 1.0}},
}
"""Case that needs what most cases do."""


@cache
def warm() -> None:
    """Shake a ring for a moment; where code is to be compiled for it, one process goes first."""
    case = Case.of(RING)
    with _alone():
        rest = Rest.of(case)
        shaken(case, case.ground_motion(), rest.dead, rest.damping[0], method="compliance")


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
