"""Damping that is right at the modes that an earthquake along x excites.

Codes take as many modes, the lowest first, as together have 90 % of the mass that can move (EN
1998-1, 4.3.3.3.1(3); ASCE 7-16, 12.9.1.1): the last of them is the last effective one here. The
first is the lowest that those below it and itself give 5 %, what the same clause of EN 1998-1 calls
too much to leave out. Both hold when the mesh changes. Two other definitions do not: modes with 5 %
each, for modes close to each other share their mass now so, now so; and 90 % by decreasing mass,
which where fill has hundreds of small modes depends on how many were computed.
"""

import logging
from dataclasses import dataclass

import numpy as np

from archfem.arguments import real, whole
from archfem.arrays import Array
from archfem.dynamics.schemes import EFFECTIVE, KINDS, Rayleigh, StiffnessDamping, Viscous
from archfem.errors import InvalidInput
from archfem.models.model import Model, check_model
from archfem.statics.equilibrium import Equilibrium
from archfem.statics.modes import Modes, modes

logger = logging.getLogger("archfem")

FIRST_SHARE = 0.05
"""Share of the mass along x that the modes up to the first effective one have together."""

FEW, MOST = 32, 1024
"""Modes computed at first, and at most."""

NAMED = 4
"""Modes of large mass that are named in the text."""


@dataclass(frozen=True, eq=False)
class EffectiveRange:
    """The first and the last mode that are effective along x.

    Attributes:
        modes: all that were computed.
        first: number of the first, counted from 1.
        last: number of the last.
    """

    modes: Modes
    first: int
    last: int

    @property
    def frequencies(self) -> tuple[float, float]:
        """Of both [Hz]."""
        low, high = self.modes.frequencies[[self.first - 1, self.last - 1]]
        return float(low), float(high)

    @property
    def share(self) -> float:
        """Share of the mass along x of all modes up to the last [-]."""
        return float(self.modes.mass_ratios[: self.last, 0].sum())

    @property
    def text(self) -> str:
        """Which modes these are, and which of those between have the most mass."""
        ratios, frequencies = self.modes.mass_ratios[: self.last, 0], self.modes.frequencies
        large = ", ".join(
            f"{number + 1} ({frequencies[number]:.2f} Hz, {100.0 * ratios[number]:.1f} %)"
            for number in np.sort(np.argsort(-ratios)[:NAMED])
        )
        return (
            f"modes {self.first} and {self.last}, the first and the last effective along x; up to "
            f"the last they have {100.0 * self.share:.1f} % of the mass, most of it {large}"
        )


@dataclass(frozen=True, eq=False)
class FirstEffective:
    """The first mode that is effective along x.

    Attributes:
        modes: all that were computed.
        number: of the mode, counted from 1.
    """

    modes: Modes
    number: int

    @property
    def frequency(self) -> float:
        """Of the mode [Hz]."""
        return float(self.modes.frequencies[self.number - 1])

    @property
    def text(self) -> str:
        """Which mode it is, and how much of the mass it has."""
        share = 100.0 * self.modes.mass_ratios[self.number - 1, 0]
        return f"mode {self.number}, the first effective along x, has {share:.1f} % of the mass"


def first_effective(model: Model, about: Equilibrium | None = None) -> FirstEffective:
    """Find the first mode effective along x.

    Args:
        model: any rung of the ladder.
        about: the state, such as the dead load of this model; None: all joints closed.

    Returns:
        The mode, and all that were computed.

    Raises:
        DidNotConverge: the structure is a mechanism in that state, or modes were not found.
    """
    check_model(model)
    found, reached = _modes_up_to(model, about, FIRST_SHARE, FEW, MOST)
    number = int(np.searchsorted(reached, FIRST_SHARE)) + 1
    return FirstEffective(found, min(number, len(reached)))


def effective_range(
    model: Model,
    about: Equilibrium | None = None,
    *,
    share: float = EFFECTIVE,
    few: int = FEW,
    most: int = MOST,
) -> EffectiveRange:
    """Find the first and the last mode effective along x.

    A few modes are computed, and then twice as many as before until they have the share; where
    `most` have not, the last of them is given, and a warning says how much they have.

    Args:
        model: any rung of the ladder.
        about: the state, such as the dead load of this model; None: all joints closed.
        share: of the mass that can move along x, of the modes up to the last [-].
        few: number of modes to compute at first.
        most: number of modes not to go beyond.

    Returns:
        Both, and all modes that were computed.

    Raises:
        InvalidInput: the share is not one, or a single mode has it.
        DidNotConverge: the structure is a mechanism in that state, or modes were not found.
    """
    check_model(model)
    if not FIRST_SHARE < real(share, "share of the mass [-]") < 1.0:
        raise InvalidInput(
            f"share {share} of the mass is not between {FIRST_SHARE} and 1: 90 % is 0.9"
        )
    few, most = whole(few, "modes to compute at first"), whole(most, "modes to compute at most")
    found, reached = _modes_up_to(model, about, share, few, most)
    first = int(np.searchsorted(reached, FIRST_SHARE)) + 1
    last = min(int(np.searchsorted(reached, share)) + 1, len(reached))
    if first >= last:
        raise InvalidInput(
            f"mode {last} alone has {100.0 * found.mass_ratios[last - 1, 0]:.1f} % of the mass "
            "along x, and Rayleigh damping needs two modes: raise the share, give the frequencies, "
            "or take damping of kind 'stiffness'"
        )
    return EffectiveRange(found, first, last)


def effective_damping(
    model: Model,
    ratio: float = 0.05,
    about: Equilibrium | None = None,
    *,
    kind: str = "stiffness",
    joints: str = "closed",
    share: float = EFFECTIVE,
) -> Viscous:
    """Return damping with a ratio at the first mode effective along x, proportional to stiffness.

    No mass is dragged, so that blocks fly, rock and fall freely. The ratio is set at the first
    effective mode because most of the mass sways in it: in rings and arches on piers whose joints
    do not yet come apart the largest |e| is then within 0.02 of that by Rayleigh damping. Set at
    the last effective mode such damping is hardly any, 1 % at the first. Higher modes and the
    landing of blocks lose more than the ratio, yet not too much: at 5 % a block of 0.6 m by 2.4 m
    on a joint of 1 MPa/mm keeps 0.965 of its turning from one landing to the next, where rigid
    impacts leave 0.912, and Rayleigh damping 0.46 (see `restitution`).

    With kind "rayleigh" it is set at the first and the last effective mode, with less between them,
    as Demirel and Aldemir choose it (Buildings 11 (2021), section 2); its mass part also drags
    blocks that are loose. `first_effective` and `effective_range` tell which modes these are.

    Args:
        model: any rung of the ladder.
        ratio: of critical damping [-].
        about: the state, such as the dead load of this model; None: all joints closed.
        kind: "stiffness", or "rayleigh" for a mass part too.
        joints: what the stiffness part acts on, as in `Rayleigh`.
        share: with "rayleigh", of the mass that can move along x, of the modes up to the last [-].

    Raises:
        InvalidInput: a value cannot be meant, or a single mode has the share.
        DidNotConverge: the structure is a mechanism in that state, or modes were not found.
    """
    if kind not in KINDS:
        raise InvalidInput(f"damping kind = {kind!r}: use one of {KINDS}")
    if kind == "rayleigh":
        return Rayleigh(ratio, effective_range(model, about, share=share).frequencies, joints)
    return StiffnessDamping(ratio, first_effective(model, about).frequency, joints)


def _modes_up_to(
    model: Model, about: Equilibrium | None, share: float, few: int, most: int
) -> tuple[Modes, Array]:
    """Modes that have a share of the mass along x, and what they have up to each (modes,)."""
    count = 0
    while count < min(most, model.size):
        count = min(max(few, 2 * count), most, model.size)
        found = modes(model, count, about)
        reached = np.cumsum(found.mass_ratios[:, 0])
        if reached[-1] >= share:
            break
    else:
        logger.warning(
            "%d modes, up to %.1f Hz, have only %.1f %% of the mass along x, not %.0f %%: the last "
            "of them is taken for the last effective one",
            *(count, found.frequencies[-1], 100.0 * reached[-1], 100.0 * share),
        )
    return found, reached
