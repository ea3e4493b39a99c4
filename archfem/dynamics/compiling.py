"""All compiled code, compiled beforehand: it takes a minute once, and is then kept on disk.

What is compiled is compiled when a run first needs it, for each strategy and scheme anew. Here
each steps a small arch once, in processes of their own, so that later runs find all of it.
"""

import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from time import perf_counter

import numpy as np

from archfem.dynamics.collapse import fallen
from archfem.dynamics.schemes import HHT, Conserving, Newmark, StiffnessDamping
from archfem.dynamics.time_history import last_state, time_history
from archfem.masonry.materials import Contact
from archfem.masonry.shapes.rings import circular_arch, column
from archfem.models.build import build
from archfem.models.discretisation import Discretisation
from archfem.models.moving import Moving
from archfem.motion.motion import Motion

KINDS = (
    "large displacements",
    "compliance, Conserving",
    "contact, Conserving",
    "compliance, Newmark",
    "contact, Newmark",
    "chain, Newmark",
)
"""What is compiled apart from each other, what takes longest first: method and scheme."""

STEP = 0.005
"""Time step of the runs that are made [s]."""

QUIET = Motion(np.full(5, 0.1), STEP)
"""Motion of the ground, a few steps long."""


def compile_all(processes: int | None = None) -> Iterator[tuple[str, float]]:
    """Compile what steps of every kind need, unless it is compiled already.

    Args:
        processes: how many work at a time; by default one a core.

    Yields:
        A kind that is ready, and the time since the start [s].
    """
    start = perf_counter()
    workers = min(processes or os.cpu_count() or 1, len(KINDS))
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        asked = {pool.submit(compile_kind, kind): kind for kind in KINDS}
        for ready in as_completed(asked):
            ready.result()
            yield asked[ready], perf_counter() - start


def compile_kind(kind: str) -> None:
    """Compile what steps of one kind need.

    Args:
        kind: one of `KINDS`.
    """
    if kind == "large displacements":
        _large()
        return
    method, scheme = kind.split(", ")
    friction = 0.6 if scheme == "Conserving" else None
    contact = Contact(1e9, 4e8, friction=friction)
    arch = circular_arch(radius=3.0, thickness=0.6, embrace=150.0, voussoirs=3, contact=contact)
    for rule in ("exact", "lobatto"):
        model = build(arch, Discretisation("rigid", quadrature=rule))
        for each in (Conserving(),) if scheme == "Conserving" else (Newmark(), HHT(-0.1)):
            time_history(
                model, QUIET, dt=STEP, method=method, scheme=each, damping=StiffnessDamping(0.05, 9)
            )


def _large() -> None:
    """Compile what blocks need that move far, and that fall."""
    block = column(breadth=0.6, heights=[0.6, 0.6])
    for rule in ("exact", "lobatto"):
        model = build(block, Discretisation("rigid", quadrature=rule, displacements="large"))
        run = time_history(model, QUIET, dt=STEP, damping=StiffnessDamping(0.05, 9.0))
    assert isinstance(model, Moving)
    fallen(model, last_state(run), QUIET)
