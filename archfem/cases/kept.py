"""Histories that an earlier command left, where they still answer what is asked."""

from pathlib import Path

import numpy as np

from archfem.cases.case import Case
from archfem.cases.inputs import inputs_digest
from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.motion.motion import Motion

HISTORY = "history.nc"
"""Name of a history's file."""

SAME = 1e-6
"""Accelerations nearer than this are of the same motion [m/s²]; matching ends with round-off."""


def finished(path: Path, case: Case, motion: Motion) -> History | None:
    """Return what an earlier run left, where it ended by itself, of the same case and motion.

    The files that the case reads, and archfem itself, must be those of then, to the letter.

    Args:
        path: file of the history.
        case: to compare with the one in the file.
        motion: to compare with the ground motion in the file.

    Returns:
        The history; None where there is none, or one that broke off, or of another case or motion.
    """
    try:
        run = History.read(path, case.structure)
        whole = run.ended.by_itself
    except InvalidInput:
        return None
    told = run.dataset.attrs
    if not whole or told.get("inputs") != inputs_digest(case.settings, case.folder):
        return None
    before, now = run.dataset["ground"].values, motion.at(run.time)
    return run if np.allclose(before, now, rtol=0.0, atol=SAME) else None
