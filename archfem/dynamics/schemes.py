"""Settings of a time history: damping, and the scheme that steps it."""

from dataclasses import dataclass
from math import pi

import numpy as np

from archfem.arguments import among, real, reals
from archfem.errors import InvalidInput
from archfem.masonry.structure import Structure

JOINTS = ("closed", "initial", "none")

KINDS = ("stiffness", "rayleigh")

EFFECTIVE = 0.90
"""Share of the mass along an axis that the modes up to the last effective one have together."""


@dataclass(frozen=True)
class Rayleigh:
    """Damping proportional to mass and stiffness.

    The ratio at a frequency f is a/(4 π f) + b π f; the two coefficients make it the wanted one
    at two frequencies (Clough and Penzien, 1993, section 12-4). The mass part drags whatever moves
    against the ground, also a block that is loose: 5 % at 8 and 16 Hz are 27 % of critical at 1 Hz.
    `StiffnessDamping` has none.

    Attributes:
        ratio: of critical damping at both frequencies [-].
        frequencies: between which damping is at most the ratio [Hz].
        joints: what the stiffness part acts on: blocks and the closed part of joints ("closed"),
            blocks and all joints as if they were closed ("initial", which leaves a dashpot in an
            open joint), or the blocks alone ("none").
    """

    ratio: float
    frequencies: tuple[float, float]
    joints: str = "closed"

    def __post_init__(self) -> None:
        """Refuse negative damping, frequencies out of order and unknown words."""
        low, high = reals(self.frequencies, "damping frequencies [Hz]", 2)
        _check_ratio(self.ratio)
        if not 0.0 < low < high:
            raise InvalidInput(
                f"damping frequencies {self.frequencies} Hz: give two, the lower one first"
            )
        _check_joints(self.joints)

    @property
    def mass(self) -> float:
        """Coefficient of the mass matrix [1/s]."""
        low, high = self.frequencies
        return 4.0 * pi * self.ratio * low * high / (low + high)

    @property
    def stiffness(self) -> float:
        """Coefficient of the stiffness matrix [s]."""
        return self.ratio / (pi * sum(self.frequencies))


@dataclass(frozen=True)
class StiffnessDamping:
    """Damping proportional to stiffness alone: what moves without deforming is not dragged.

    The ratio at a frequency f is b π f: the wanted one at one frequency, less below, more above. A
    block in flight loses nothing and one that turns on its edge hardly anything; energy is lost
    where blocks and the closed part of joints deform, above all when a block lands
    (`restitution_damping` sets how much).

    Attributes:
        ratio: of critical damping at the frequency [-].
        frequency: at which damping has the ratio [Hz].
        joints: what it acts on beside the blocks, as in `Rayleigh`; only with "closed", the
            default, do open joints stay free.

    Example:
        >>> round(af.StiffnessDamping(0.05, 8.0).stiffness, 6)
        0.001989
    """

    ratio: float
    frequency: float
    joints: str = "closed"

    mass = 0.0

    def __post_init__(self) -> None:
        """Refuse negative damping, a frequency that is none and unknown words."""
        _check_ratio(self.ratio)
        _check_joints(self.joints)
        if not 1e-3 <= real(self.frequency, "damping frequency [Hz]") <= 1e6:
            raise InvalidInput(
                f"damping frequency {self.frequency} Hz is not between 1 mHz and 1 MHz: try 8.0"
            )

    @property
    def stiffness(self) -> float:
        """Coefficient of the stiffness matrix [s]."""
        return self.ratio / (pi * self.frequency)


Viscous = Rayleigh | StiffnessDamping
"""Damping of a run."""


@dataclass(frozen=True)
class EffectiveDamping:
    """Damping whose frequencies are yet to be found, for want of a model.

    Attributes:
        ratio: at the first mode effective along x, and with kind "rayleigh" at the last [-].
        kind: "stiffness" or "rayleigh", as in `effective_damping`.
        joints: what the stiffness part acts on, as in `Rayleigh`.
        share: of the mass along x, of the modes up to the last effective one [-].
    """

    ratio: float
    kind: str = "stiffness"
    joints: str = "closed"
    share: float = EFFECTIVE

    def __post_init__(self) -> None:
        """Refuse what could not become damping."""
        _check_ratio(self.ratio)
        _check_joints(self.joints)
        if not among(self.kind, KINDS):
            raise InvalidInput(f"damping kind = {self.kind!r}: use one of {KINDS}")
        if not 0.0 < real(self.share, "damping share [-]") < 1.0:
            raise InvalidInput(f"share {self.share} of the mass is not between 0 and 1")


def _check_ratio(ratio: float) -> None:
    if not 0.0 <= real(ratio, "damping ratio [-]") < 1.0:
        raise InvalidInput(f"damping ratio {ratio} is not between 0 and 1: 5 % is 0.05")


def _check_joints(joints: str) -> None:
    if not among(joints, JOINTS):
        raise InvalidInput(f"damping joints = {joints!r}: use one of {JOINTS}")


@dataclass(frozen=True)
class Newmark:
    """Newmark's method; the default is average acceleration, which conserves energy.

    Reference: Newmark, J. Eng. Mech. Div. ASCE 85 (1959).

    Attributes:
        beta: weight of the new acceleration in the displacement.
        gamma: weight of the new acceleration in the velocity.
    """

    beta: float = 0.25
    gamma: float = 0.5

    alpha = 0.0

    def __post_init__(self) -> None:
        """Refuse schemes that are explicit or grow by themselves."""
        real(self.beta, "Newmark beta [-]")
        real(self.gamma, "Newmark gamma [-]")
        if not (self.gamma >= 0.5 and self.beta >= 0.25 * (0.5 + self.gamma) ** 2 - 1e-12):
            raise InvalidInput(
                f"Newmark with beta {self.beta}, gamma {self.gamma} is not stable at every step: "
                "keep gamma ≥ 1/2 and beta ≥ (1/2 + gamma)²/4"
            )


@dataclass(frozen=True)
class HHT:
    """Hilber, Hughes and Taylor's method: second order, damping what a step cannot resolve.

    Internal forces and loads are taken at t + (1 + α) dt.
    Reference: Earthquake Eng. Struct. Dyn. 5 (1977) 283.

    Attributes:
        alpha: from -1/3 (most damping) to 0 (average acceleration).
    """

    alpha: float = -0.1

    def __post_init__(self) -> None:
        """Refuse values outside the range of stability."""
        if not -1.0 / 3.0 - 1e-12 <= real(self.alpha, "HHT alpha [-]") <= 0.0:
            raise InvalidInput(f"HHT alpha {self.alpha} is not between -1/3 and 0")

    @property
    def beta(self) -> float:
        """Newmark's β that keeps second order."""
        return 0.25 * (1.0 - self.alpha) ** 2

    @property
    def gamma(self) -> float:
        """Newmark's γ that keeps second order."""
        return 0.5 - self.alpha


@dataclass(frozen=True)
class Conserving:
    """The midpoint rule with forces averaged along each step: energy is neither made nor lost.

    Displacements go straight over a step, and what acts is the mean of each force on the way:
    of blocks and closed joints that at its middle, of a joint that opens, closes or slides its
    own. The work of a step then is the change of the stored energy, and what friction, damping and
    the ground take or give, whatever the length of the step (the averaged vector field of Quispel
    and McLaren, J. Phys. A 41 (2008) 045206; of second order). Resultants are means over steps.
    """

    beta = 0.5
    gamma = 1.0
    alpha = -0.5


Scheme = Newmark | HHT | Conserving


def check_turning(scheme: Scheme) -> None:
    """Refuse a scheme that cannot follow blocks which move as far as they like.

    Args:
        scheme: that is to step.

    Raises:
        InvalidInput: it writes the equation at an instant, and makes energy of blocks that turn.
    """
    if not isinstance(scheme, Conserving):
        raise InvalidInput(
            f"{scheme} does not keep the energy of blocks that turn far, and makes some from "
            "nothing: use Conserving() where displacements are large"
        )


def check_sliding(scheme: Scheme, structure: Structure) -> None:
    """Refuse schemes that write the equation at an instant where joints can slide, or break.

    Args:
        scheme: of the run to come.
        structure: whose joints they are.

    Raises:
        InvalidInput: joints can slide or have tensile strength, and the scheme has no memory.
    """
    if isinstance(scheme, Conserving):
        return
    name, friction = type(scheme).__name__, structure.friction
    if np.isfinite(friction).any():
        raise InvalidInput(
            f"{name} follows no sliding, and joints slide at "
            f"μ = {np.min(friction):g}: use scheme=Conserving(), the default, or joints that never "
            "slide, Contact(friction=None)"
        )
    if structure.tension.any():
        raise InvalidInput(
            f"{name} follows no bonds that break, and joints have a tensile strength of "
            f"{structure.tension.max():g} Pa: use scheme=Conserving(), the default, or joints "
            "without, Contact(tension=0.0)"
        )
