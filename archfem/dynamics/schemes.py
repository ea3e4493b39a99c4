"""Time integration schemes and viscous damping of a time history.

Damping forces are C v with C = a M + b K: Rayleigh damping has both parts, stiffness damping b K
alone. A scheme has the weights β, γ of the new acceleration, and the instant t + (1 + α) Δt at
which forces are taken.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi

import numpy as np

from archfem._typing import Hertz
from archfem._validation import (
    check_between,
    check_choice,
    check_number,
    check_numbers,
    is_one_of,
    short_repr,
)
from archfem.errors import InvalidInput
from archfem.masonry.structure import Structure

# Shortest time step accepted [s]: anything below is a slip of the unit
MIN_TIME_STEP = 1e-6

# Share of the mass along x up to the last effective mode (EN 1998-1, 4.3.3.3.1(3)) [-]
EFFECTIVE_MASS_SHARE = 0.90


@dataclass(frozen=True)
class Rayleigh:
    """Damping proportional to mass and stiffness.

    The ratio at a frequency f is a/(4 π f) + b π f. Both coefficients follow from one ratio at two
    frequencies (Clough and Penzien, 1993, section 12-4). The mass part drags all motion relative to
    the ground, also that of a loose block: 5 % at 8 and 16 Hz are 27 % of critical at 1 Hz.
    `StiffnessDamping` has no such part.

    Attributes:
        ratio: damping ratio at both frequencies, ζ [-].
        frequencies: the two frequencies, the lower first; between them damping is below the
            ratio [Hz].
        joints: bodies on which the stiffness part acts. "closed": blocks and the closed part of
            joints; "initial": blocks and all joints as if they were closed, a dashpot even in an
            open joint; "none": the blocks alone.
    """

    ratio: float
    frequencies: tuple[Hertz, Hertz]
    joints: str = "closed"

    def __post_init__(self) -> None:
        """Refuse negative damping, frequencies out of order and unknown options."""
        low, high = check_numbers(self.frequencies, "damping frequencies [Hz]", 2)
        _check_ratio(self.ratio)
        if not 0.0 < low < high:
            raise InvalidInput(
                f"damping frequencies {self.frequencies} Hz: give two, the lower one first"
            )
        object.__setattr__(self, "frequencies", (low, high))
        _check_joints(self.joints)

    @property
    def mass(self) -> float:
        """Coefficient of the mass matrix, a [1/s]."""
        low, high = self.frequencies
        return 4.0 * pi * self.ratio * low * high / (low + high)

    @property
    def stiffness(self) -> float:
        """Coefficient of the stiffness matrix, b [s]."""
        return self.ratio / (pi * sum(self.frequencies))


@dataclass(frozen=True)
class StiffnessDamping:
    """Damping proportional to stiffness alone; rigid motion is not damped.

    The ratio at a frequency f is b π f: prescribed at one frequency, less below, more above. A
    block in flight loses no energy, and a block that rocks on its edge almost none. Energy is lost
    where blocks and the closed part of joints deform, above all when a block lands
    (`restitution_damping` sets how much).

    Attributes:
        ratio: damping ratio at the frequency, ζ [-].
        frequency: frequency at which damping has the ratio [Hz].
        joints: joints on which it acts besides the blocks, as in `Rayleigh`; only with "closed",
            the default, are open joints undamped.
        restitution: ratio of rocking blocks, with which loose blocks go on after such damping, see
            `restitution_damping`; None is that of rigid impacts [-].

    Example:
        >>> round(af.StiffnessDamping(0.05, 8.0).stiffness, 6)
        0.001989
    """

    ratio: float
    frequency: Hertz
    joints: str = "closed"
    restitution: float | None = None

    mass = 0.0

    def __post_init__(self) -> None:
        """Refuse negative damping, frequencies out of range and unknown options."""
        _check_ratio(self.ratio)
        if self.restitution is not None:
            check_between(self.restitution, "restitution", 0.0, 1.0, ends="(]")
        _check_joints(self.joints)
        check_between(self.frequency, "damping frequency [Hz]", 1e-3, 1e6, ends="[]")

    @property
    def stiffness(self) -> float:
        """Coefficient of the stiffness matrix, b [s]."""
        return self.ratio / (pi * self.frequency)


# Damping of a run
Viscous = Rayleigh | StiffnessDamping


@dataclass(frozen=True)
class EffectiveDamping:
    """Damping whose frequencies are those of modes about the dead load, as `effective_damping`.

    Attributes:
        ratio: damping ratio at the first mode effective along x, and with kind "rayleigh" at the
            last one too [-].
        kind: "stiffness", or "rayleigh" for a mass part too.
        joints: bodies on which the stiffness part acts, as in `Rayleigh`.
        mass_share: with "rayleigh", share of the mass that can move along x of the modes up to the
            last effective one [-].
    """

    ratio: float = 0.05
    kind: str = "stiffness"
    joints: str = "closed"
    mass_share: float = EFFECTIVE_MASS_SHARE

    def __post_init__(self) -> None:
        """Refuse values out of range and unknown options."""
        _check_ratio(self.ratio)
        _check_joints(self.joints)
        check_choice(self.kind, "damping kind", ("stiffness", "rayleigh"))
        check_between(self.mass_share, "share of the mass [-]", 0.0, 1.0)


def interpret_damping(damping: object) -> Viscous | EffectiveDamping | None:
    """Return damping, of which the word "effective" stands for that by effective modes."""
    if damping is None or isinstance(damping, Viscous | EffectiveDamping):
        return damping
    if is_one_of(damping, ("effective",)):
        return EffectiveDamping()
    raise InvalidInput(
        f"damping = {short_repr(damping)}: give 'effective', EffectiveDamping(0.05), "
        "StiffnessDamping(0.05, 8.0), Rayleigh(0.05, (8.0, 16.0)), or None"
    )


def check_time_step(dt: object) -> float:
    """Return a time step [s]; refuse those that are slips of the unit."""
    return check_between(dt, "dt [s]", MIN_TIME_STEP, 0.1, ends="[]")


def _check_ratio(ratio: float) -> None:
    check_between(ratio, "damping ratio [-]", 0.0, 1.0, ends="[)", remedy="5 % is 0.05")


def _check_joints(joints: str) -> None:
    # closed part of the joints, all joints as if closed, blocks only
    check_choice(joints, "damping joints", ("closed", "initial", "none"))


@dataclass(frozen=True)
class Newmark:
    """Newmark's method; the default is average acceleration, which conserves energy.

    Reference: Newmark, J. Eng. Mech. Div. ASCE 85 (1959).

    Attributes:
        beta: weight of the new acceleration in the displacement, β [-].
        gamma: weight of the new acceleration in the velocity, γ [-].
    """

    beta: float = 0.25
    gamma: float = 0.5

    alpha = 0.0

    def __post_init__(self) -> None:
        """Refuse explicit and unstable schemes."""
        check_number(self.beta, "Newmark beta [-]")
        check_number(self.gamma, "Newmark gamma [-]")
        # unconditional stability; 1e-12 admits values that round below the bound
        if not (self.gamma >= 0.5 and self.beta >= 0.25 * (0.5 + self.gamma) ** 2 - 1e-12):
            raise InvalidInput(
                f"Newmark with beta {self.beta}, gamma {self.gamma} is not stable at every step: "
                "keep gamma ≥ 1/2 and beta ≥ (1/2 + gamma)²/4"
            )


@dataclass(frozen=True)
class HHT:
    """Hilber, Hughes and Taylor's method: second order, with damping of unresolved frequencies.

    Internal forces and loads are taken at t + (1 + α) Δt.
    Reference: Earthquake Eng. Struct. Dyn. 5 (1977) 283.

    Attributes:
        alpha: α, from -1/3 (most damping) to 0 (average acceleration) [-].
    """

    alpha: float = -0.1

    def __post_init__(self) -> None:
        """Refuse values outside the range of stability."""
        check_between(self.alpha, "HHT alpha [-]", -1.0 / 3.0 - 1e-12, 0.0, ends="[]")

    @property
    def beta(self) -> float:
        """Newmark's β for second order."""
        return 0.25 * (1.0 - self.alpha) ** 2

    @property
    def gamma(self) -> float:
        """Newmark's γ for second order."""
        return 0.5 - self.alpha


@dataclass(frozen=True)
class Conserving:
    """Midpoint rule with forces averaged along each step; it conserves energy at any step length.

    Displacements are linear over a step, and every force is its mean along that path: blocks and
    closed joints at the middle of the step, joints that open, close or slide by integration. The
    work of a step is then the change of the stored energy plus the energy exchanged by friction,
    damping and ground motion. The method is the averaged vector field, of second order (Quispel and
    McLaren, J. Phys. A 41 (2008) 045206). Resultants are means over steps.
    """

    beta = 0.5
    gamma = 1.0
    alpha = -0.5


Scheme = Newmark | HHT | Conserving

# Schemes by their words in a case
SCHEMES: Mapping[str, type] = {"conserving": Conserving, "newmark": Newmark, "hht": HHT}


def check_large_displacement_scheme(scheme: Scheme) -> None:
    """Refuse schemes that do not conserve energy at large rotations."""
    if not isinstance(scheme, Conserving):
        raise InvalidInput(
            f"{scheme} does not keep the energy of blocks that turn far, and makes some from "
            "nothing: use Conserving() where displacements are large"
        )


def check_friction_scheme(scheme: Scheme, structure: Structure) -> None:
    """Refuse schemes with forces at an instant where joints can slide or break."""
    if isinstance(scheme, Conserving):
        return
    name, friction = type(scheme).__name__, structure.friction
    if structure.has_own_laws:
        raise InvalidInput(
            f"{name} follows no history, and contacts have a law of their own: use "
            'scheme=Conserving(), the default, in a case "conserving"'
        )
    if np.isfinite(friction).any():
        raise InvalidInput(
            f"{name} follows no sliding, and joints slide at "
            f"μ = {np.min(friction):g}: use scheme=Conserving(), the default, in a case "
            '"conserving"; or joints that never slide, Contact(friction=None), in a case '
            'friction = "none"'
        )
    if structure.tension.any():
        raise InvalidInput(
            f"{name} follows no bonds that break, and joints have a tensile strength of "
            f"{structure.tension.max():g} Pa: use scheme=Conserving(), the default, or joints "
            "without, Contact(tension=0.0)"
        )
