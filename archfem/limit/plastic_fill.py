"""Strength of a fill that is a plastic continuum; `fill_bounds` has the bounds on the factor."""

from dataclasses import dataclass
from math import radians, tan

from archfem._typing import Degrees, Metres, Pascals
from archfem._validation import check_number
from archfem.limit.backfill import read_strength


@dataclass(frozen=True, kw_only=True)
class PlasticFill:
    """Strength of a fill that is taken as a plastic continuum around rigid stones.

    The fill is a Mohr-Coulomb body without tension, with associated flow, and with the weight of
    its block. Stones are rigid, and the fill sticks to them by its own strength, or a share of
    that. The answer is a pair of bounds. Loads on the fill reach the stones by the fan of `Fill`:
    the fill below a wheel does not fail locally. Paving that rests on the fill counts as fill.

    Attributes:
        friction_angle: friction angle φ [degrees].
        cohesion: cohesion c [Pa].
        roughness: tangent of the friction along stones, over tan φ, from 0 to 1 [-].
        adhesion: cohesion along stones, over c, from 0 to 1 [-].
        holds_ends: whether more fill holds vertical ends without a block beside them; else they are
            free surfaces, at which a fill without cohesion does not stand.
        gap: largest distance of the two bounds, over the upper one [-].
        spread: half the angle of the fan of a load on the fill, from the vertical [degrees].
        backing: level up to which masonry holds the stones, as for `Fill` [m].

    References:
        Sloan, Int. J. Numer. Anal. Meth. Geomech. 12 (1988) 61-77. Makrodimopoulos and Martin,
        Int. J. Numer. Anal. Meth. Geomech. 31 (2007) 835-865.

    Example:
        >>> af.limit.PlasticFill(friction_angle=30.0, cohesion=5e3).roughness
        1.0
    """

    friction_angle: Degrees
    cohesion: Pascals = 0.0
    roughness: float = 1.0
    adhesion: float = 1.0
    holds_ends: bool = True
    gap: float = 0.03
    spread: Degrees = 30.0
    backing: Metres | None = None

    def __post_init__(self) -> None:
        """Refuse values outside their range, most of them wrong units."""
        read_strength(self, "roughness", "adhesion", "gap")
        for key in ("roughness", "adhesion"):
            # else it fails beside the stone before it slides on it
            check_number(getattr(self, key), f"fill, {key}", maximum=1.0)
        check_number(self.gap, "fill, gap [-]", minimum=1e-3)

    @property
    def angle(self) -> float:
        """Friction angle φ [rad]."""
        return radians(self.friction_angle)

    @property
    def contact_friction(self) -> float:
        """Coefficient of friction along stones [-]."""
        return self.roughness * tan(self.angle)
