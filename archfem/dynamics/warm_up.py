"""Compilation of all kernels ahead of time: some minutes, once, cached on disk from then on.

Kernels are compiled at their first use, for each solver and scheme. Here each combination steps a
small arch in a process of its own, so that later runs find all kernels in the cache.
"""

import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from time import perf_counter
from typing import Any, cast

import numpy as np

from archfem.dynamics.fall import simulate_fall
from archfem.dynamics.schemes import HHT, Conserving, Newmark, StiffnessDamping
from archfem.dynamics.separation import MeetingMonitor
from archfem.dynamics.solvers.equation import Equation
from archfem.dynamics.solvers.integrator import Stepper
from archfem.dynamics.solvers.newton import NewtonSolver
from archfem.dynamics.time_history import last_state, time_history
from archfem.joints.large.forces import facet_slips
from archfem.masonry.materials import Contact
from archfem.masonry.shapes.rings import circular_arch, column
from archfem.models.builder import build
from archfem.models.discretisation import Discretisation
from archfem.motion.motion import Motion

# Solvers and schemes that are compiled independently, the slowest first
COMPILED_VARIANTS = (
    "newton, large displacements",
    "newton, large displacements, chain of rigid stones",
    "compliance, Conserving",
    "newton, Conserving",
    "compliance, Newmark",
    "newton, Newmark",
)

# Ground motion of a few time steps
_SHORT_MOTION = Motion(np.full(5, 0.1), 0.005)


def compile_all(processes: int | None = None) -> Iterator[tuple[str, float]]:
    """Compile all variants in parallel; yield each with the time since the start [s]."""
    start = perf_counter()
    workers = min(processes or os.cpu_count() or 1, len(COMPILED_VARIANTS))
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        tasks = {pool.submit(compile_variant, variant): variant for variant in COMPILED_VARIANTS}
        for task in as_completed(tasks):
            task.result()
            yield tasks[task], perf_counter() - start


def compile_variant(variant: str) -> None:
    """Compile the kernels of one solver and scheme."""
    method, scheme, *kind = variant.split(", ")
    if scheme == "large displacements":
        _compile_large_displacements(is_chain=bool(kind))
        return
    friction = 0.6 if scheme == "Conserving" else None
    contact = Contact(1e9, 4e8, friction=friction)
    arch = circular_arch(radius=3.0, thickness=0.6, embrace=150.0, voussoirs=3, contact=contact)
    model = build(arch, Discretisation("rigid"))
    damping = StiffnessDamping(0.05, 9.0)
    for each in (Conserving(),) if scheme == "Conserving" else (Newmark(), HHT(-0.1)):
        time_history(
            model, _SHORT_MOTION, dt=_SHORT_MOTION.dt, method=method, scheme=each, damping=damping
        )


def _compile_large_displacements(*, is_chain: bool) -> None:
    """Compile steps with large displacements; of chains of rigid stones, their fall as well."""
    block = column(breadth=0.6, heights=[0.6, 0.6])
    model = build(block, Discretisation("rigid", displacements="large"))
    # damping by the joints at rest couples more than a chain's blocks
    joints = "closed" if is_chain else "initial"
    equation = Equation(model, _SHORT_MOTION, StiffnessDamping(0.05, 9.0, joints))
    stepper = Stepper(equation, NewtonSolver(equation))
    run = time_history(model, _SHORT_MOTION, dt=_SHORT_MOTION.dt, method=stepper)
    if not is_chain:
        return
    end = last_state(run)
    model.observer().joint_ends(end.q)  # pose of a face, as films need it
    # of elastic blocks, with which a run of stiff joints is compared
    facet_slips(cast(Any, model).joints, np.array(end.q))
    simulate_fall(model, end, _SHORT_MOTION)
    # a negative tolerance, so that even blocks that have not moved are tested
    batch = next(stepper.batches(end, _SHORT_MOTION.dt, end.time + _SHORT_MOTION.dt))
    MeetingMonitor(model, end, tolerance=-1.0).find_first(batch)
