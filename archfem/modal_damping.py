"""Damping that is right at the first and the last mode that an earthquake along x excites.

A mode counts as effective where its effective mass is at least 5 % of what can move: the measure
by which Eurocode 8 (EN 1998-1, 4.3.3.3.1(3)) says which modes an analysis may not leave out; the
Turkish code (TBEC-2018, 4.8.1.2) says 3 %. Its other measure, modes that together make up 90 %, is
of no use here: where fill has hundreds of modes of a little mass each, the last one needed depends
on how many were computed.
"""

import logging
from dataclasses import dataclass

import numpy as np

from archfem.errors import InvalidInput
from archfem.modal import Modes, modes
from archfem.models import Model
from archfem.schemes import EFFECTIVE, Rayleigh
from archfem.statics import Equilibrium

logger = logging.getLogger("archfem")

FEW, MOST = 32, 1024
"""Modes computed at first, and at most."""


@dataclass(frozen=True, eq=False)
class EffectiveRange:
    """The modes that are effective along x.

    Attributes:
        modes: all that were computed.
        numbers: of those that are effective, counted from 1.
        share: of the mass along x that makes a mode effective [-].
    """

    modes: Modes
    numbers: tuple[int, ...]
    share: float

    @property
    def frequencies(self) -> tuple[float, float]:
        """Of the first and of the last effective mode [Hz]."""
        first, last = self.numbers[0] - 1, self.numbers[-1] - 1
        return float(self.modes.frequencies[first]), float(self.modes.frequencies[last])

    @property
    def found(self) -> float:
        """Share of the mass along x of all modes that were computed [-]."""
        return float(self.modes.mass_ratios[:, 0].sum())

    @property
    def text(self) -> str:
        """Which modes these are, in a sentence."""
        ratios, frequencies = self.modes.mass_ratios[:, 0], self.modes.frequencies
        each = ", ".join(
            f"{number} ({frequencies[number - 1]:.2f} Hz, {_percent(ratios[number - 1])})"
            for number in self.numbers
        )
        return (
            f"modes with at least {_percent(self.share)} of the mass along x: {each}; "
            f"{len(ratios)} modes with {_percent(self.found)} looked at"
        )


def effective_range(
    model: Model, about: Equilibrium | None = None, *, share: float = EFFECTIVE
) -> EffectiveRange:
    """Find the modes with at least a share of the mass along x.

    Modes are computed until those still unknown have less than the share between them, so that
    none of them can be effective; where 1024 do not suffice, a warning says how much is unknown.

    Args:
        model: any rung of the ladder.
        about: the state, such as the dead load of this model; None: all joints closed.
        share: of the mass that can move along x [-].

    Raises:
        InvalidInput: the share is not one, or fewer than two modes have it.
        DidNotConverge: the structure is a mechanism in that state, or modes were not found.
    """
    if not 0.0 < share < 1.0:
        raise InvalidInput(f"share {share} of the mass is not between 0 and 1: 5 % is 0.05")
    count = min(FEW, model.size)
    while True:
        found = modes(model, count, about)
        ratios = found.mass_ratios[:, 0]
        if ratios.sum() > 1.0 - share or count == min(MOST, model.size):
            break
        count = min(4 * count, MOST, model.size)
    numbers = tuple(int(number) + 1 for number in np.flatnonzero(ratios >= share))
    if len(numbers) < 2:
        largest = " and ".join(_percent(ratio) for ratio in np.sort(ratios)[:-3:-1])
        raise InvalidInput(
            f"{len(numbers)} of {count} modes have at least {_percent(share)} of the mass along x, "
            f"and damping needs two; the largest have {largest}: lower the share, or give the "
            "frequencies"
        )
    if ratios.sum() <= 1.0 - share:
        logger.warning(
            "%d modes, up to %.1f Hz, have %s of the mass along x: one with %s may lie above them",
            count,
            found.frequencies[-1],
            _percent(ratios.sum()),
            _percent(share),
        )
    return EffectiveRange(found, numbers, share)


def effective_damping(
    model: Model,
    ratio: float = 0.05,
    about: Equilibrium | None = None,
    *,
    joints: str = "closed",
    share: float = EFFECTIVE,
) -> Rayleigh:
    """Damping with a ratio at the first and the last mode effective along x, less between them.

    So Demirel and Aldemir (Buildings 11 (2021), section 2) choose it: no mode that counts along
    the structure is damped by more than the ratio. `effective_range` tells which modes these are.

    Args:
        model: any rung of the ladder.
        ratio: of critical damping [-].
        about: the state, such as the dead load of this model; None: all joints closed.
        joints: what the stiffness part acts on, as in `Rayleigh`.
        share: of the mass along x that makes a mode effective [-].

    Raises:
        InvalidInput: a value cannot be meant, or fewer than two modes are effective.
        DidNotConverge: the structure is a mechanism in that state, or modes were not found.
    """
    return Rayleigh(ratio, effective_range(model, about, share=share).frequencies, joints)


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"
