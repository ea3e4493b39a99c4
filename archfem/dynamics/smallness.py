"""What it errs by to take displacements as small: where joints turn, the thrust moves with them.

Rigid blocks are shaken twice, with small displacements and with large ones, by the strongest part
of a motion: how far geometry changes hardly depends on how blocks strain. Blocks of soil keep
their places in this comparison; with them the error is only estimated, from how far joints turn.
"""

import numpy as np

from archfem.dynamics.history import Ending, History
from archfem.dynamics.probe import largest_difference, peaks_of
from archfem.dynamics.time_history import time_history
from archfem.dynamics.yardstick import SAFETY, Steps, Yardstick
from archfem.errors import DidNotConverge
from archfem.masonry.softness import soft_blocks
from archfem.models.build import build
from archfem.models.discretisation import Discretisation
from archfem.models.model import Model

QUIET = 1e-4
"""Turn of a joint up to which displacements are small without a look [rad]."""

PER_TURN = 7.0
"""Largest change of |e| by large displacements, over the turn of a joint [1/rad]: met at turns of
0.6 mrad in six arches and columns under four motions each; it falls to about 1 at 20 mrad."""


def error_of_small(yardstick: Yardstick, steps: Steps) -> float:
    """Return what taking displacements as small errs by in the largest |e| of a joint [-].

    Args:
        yardstick: of the structure, with the part of the motion that counts.
        steps: of the run.

    Returns:
        The error; infinite where blocks fall that small displacements let stand.
    """
    structure = yardstick.model.structure
    if soft_blocks(structure):
        return PER_TURN * yardstick.turn(steps)

    def shaken(model: Model) -> History:
        return time_history(
            model,
            yardstick.window,
            damping=yardstick.damping,
            dt=steps.dt,
            tolerance=steps.pace,
        )

    run = shaken(build(structure, _rigid("small")))
    turn = float(np.abs(run.joints["rotation"]).max())
    if turn <= QUIET:
        return PER_TURN * turn
    try:
        far = shaken(build(structure, _rigid("large")))
    except DidNotConverge:
        return np.inf
    if far.ended is Ending.PARTED:
        return np.inf
    return SAFETY * largest_difference(peaks_of(run), peaks_of(far))


def _rigid(displacements: str) -> Discretisation:
    """Rigid blocks on exact joints."""
    return Discretisation("rigid", quadrature="exact", displacements=displacements)
