"""Carry out what a case describes: dead load, time histories, and what earlier runs have left."""

from pathlib import Path
from typing import Any

import numpy as np

from archfem.cases.case import Case
from archfem.dynamics.damping import effective_range
from archfem.dynamics.events import CountedMechanism
from archfem.dynamics.history import History
from archfem.dynamics.ladder import Damping, build
from archfem.dynamics.schemes import EffectiveRayleigh, Rayleigh
from archfem.dynamics.time_history import Record, time_history
from archfem.errors import DidNotConverge, InvalidInput
from archfem.motion.motion import Motion
from archfem.statics.equilibrium import Equilibrium, dead_load

FRAMES = 10
"""Steps between two fields that are kept for an animation, unless the case says otherwise."""

SAME = 1e-6
"""Accelerations nearer than this are of the same motion [m/s²]; matching ends with round-off."""


def at_rest(case: Case) -> Equilibrium:
    """Build the model of a case and find its dead load.

    With fidelity "auto" the model is chosen for the case's own motion, or the first of its suite.

    Raises:
        DidNotConverge: the structure does not stand.
    """
    return dead_load(build(case.structure, **case.model, **_wanted(case)))


def _wanted(case: Case) -> dict[str, Any]:
    """What the choice of a model needs to know of the run to come."""
    if case.model.get("fidelity") != "auto":
        return {}
    motion = None
    if case.motion is not None:
        motion = case.ground_motion()
    elif case.suite is not None:
        first = next(iter(case.suite["pairs"]))  # the others need not be matched for this
        motion = case.alone(first).ground_suite().motions[0]
    return {"motion": motion, "damping": expected_damping(case), "dt": case.analysis.get("dt")}


def expected_damping(case: Case) -> Damping:
    """Damping of a case whose model is not yet chosen: known, or a function of the finest model."""
    if isinstance(case.damping, EffectiveRayleigh):
        return lambda model: damping_of(case, dead_load(model))[0]
    return case.damping


def damping_of(case: Case, dead: Equilibrium) -> tuple[Rayleigh | None, str]:
    """Damping of a case about its dead load, and in words how it was found.

    Raises:
        InvalidInput: it is to be that of the effective modes, and fewer than two are.
    """
    damping, how = case.damping, ""
    if isinstance(damping, EffectiveRayleigh):
        found = effective_range(dead.model, dead, share=damping.share)
        damping, how = damping.between(found.frequencies), f"; {found.text}"
    if damping is None:
        return None, "damping: none"
    low, high = damping.frequencies
    return damping, f"damping: {100.0 * damping.ratio:g} % at {low:.2f} and {high:.2f} Hz{how}"


def shaken(
    case: Case, motion: Motion, dead: Equilibrium, damping: Rayleigh | None = None
) -> History:
    """Run the time history of a case under a motion; the history carries the case.

    Args:
        case: tells steps, scheme, damping, and what to record.
        motion: of the ground.
        dead: where it starts.
        damping: as by `damping_of`, which is asked where it is not given.

    Raises:
        DidNotConverge: a step failed; `history` is the record up to it.
    """
    output = case.output
    animated = FRAMES if output.get("animation", False) else None
    try:
        run = time_history(
            dead.model,
            motion,
            dt=case.analysis.get("dt"),
            start=dead,
            damping=damping or damping_of(case, dead)[0],
            scheme=case.scheme,
            record=Record(
                every=output.get("every", 1), fields_every=output.get("fields_every", animated)
            ),
            until=CountedMechanism() if case.analysis.get("halt", False) else None,
            criteria=case.criteria,
        )
    except DidNotConverge as error:
        if error.history is not None:
            error.history.dataset.attrs["case"] = case.text()
        raise
    run.dataset.attrs["case"] = case.text()
    return run


def finished(path: Path, case: Case, motion: Motion) -> History | None:
    """Read what an earlier run left, where it ended by itself, of the same case and motion.

    Args:
        path: file of the history.
        case: to compare with the one in the file.
        motion: to compare with the ground motion in the file.
    """
    try:
        run = History.read(path, case.structure)
        whole = run.ended.by_itself
    except InvalidInput:
        return None
    if not whole or run.dataset.attrs.get("case") != case.text():
        return None
    before, now = run.dataset["ground"].values, motion.at(run.time)
    return run if np.allclose(before, now, rtol=0.0, atol=SAME) else None
