"""Fill as limit analysis takes it: earth pressure on stones, and loads spread on the way down."""

from dataclasses import dataclass
from math import radians, sqrt, tan

import numpy as np

from archfem.arguments import real
from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.units import in_degrees

DISPERSALS = ("boussinesq", "uniform")


@dataclass(frozen=True, kw_only=True)
class Fill:
    """Strength of a fill, and how it spreads loads that stand on it.

    Limit analysis does not take a fill as a body but as what it does to the stones below:

    - its weight, column by column, rests on the stone below the column;
    - it presses on the stones' faces horizontally, by anything from the active pressure to a part
      of the passive one (Rankine, smooth faces), with the vertical stress σ of the columns above,

        a max(K_a σ - 2 c √K_a, 0) <= p <= m (K_p σ + 2 c √K_p),   K_p = 1 / K_a = tan²(45° + φ/2),

      so that stones which move into the fill are held back and those which move away are pushed;
    - a load on its surface goes down in a straight fan to the stones that it meets first.

    The vertical stress is that of the weights alone: live loads do not raise the pressures, and a
    body force, which pulls at each column's foot, does not change them as an earthquake would
    (Mononobe and Okabe). Shear between fill and stones is neglected, and the fill is long enough to
    bear what it resists: its own balance and failure are not asked for, and what presses on one
    arch does not press on the next.

    Attributes:
        friction_angle: φ of the fill [degrees].
        cohesion: c of the fill [Pa].
        mobilisation: m, the part of the passive pressure that is counted on, from 0 for none to 1
            for all; the whole of it needs more movement than a bridge may have [-].
        active: a, the part of the active pressure that always acts, from 0 to 1 [-]. Neglecting it
            is customary for arches, and wrong for walls that hold a fill back. Where some passive
            pressure beyond it is counted on, the whole is on the safe side of any part.
        dispersal: how a load spreads within the fan: "boussinesq", as through an elastic half-plane
            under a line load, or "uniform", evenly on each level.
        spread: half the angle of the fan, from the vertical [degrees]. What Boussinesq's stresses
            would carry outside of it is shared out inside.

    References:
        Gilbert, RING Theory and Modelling Guide, University of Sheffield (2005). Rankine, Phil.
        Trans. R. Soc. 147 (1857) 9-27. Flamant, C. R. Acad. Sci. 114 (1892) 1465-1468.

    Example:
        >>> af.limit.Fill(friction_angle=30.0).mobilisation
        0.3333333333333333
    """

    friction_angle: float
    cohesion: float = 0.0
    mobilisation: float = 1.0 / 3.0
    active: float = 1.0
    dispersal: str = "boussinesq"
    spread: float = 30.0

    def __post_init__(self) -> None:
        """Refuse what is no fill, or can only be a wrong unit."""
        for key in ("friction_angle", "spread"):
            if isinstance(value := getattr(self, key), str) or key == "spread":
                object.__setattr__(self, key, in_degrees(value, f"fill, {key}"))
        for key in ("friction_angle", "cohesion", "mobilisation", "active", "spread"):
            real(getattr(self, key), f"fill, {key}", least=0.0)
        if not (self.friction_angle == 0.0 or 1.0 <= self.friction_angle <= 60.0):
            raise InvalidInput(
                f"fill, friction_angle {self.friction_angle:.4g}° is neither 0 nor between 1° and "
                "60°: give degrees; gravel has about 35"
            )
        if self.cohesion > 1e6:
            raise InvalidInput(
                f"fill, cohesion {self.cohesion:.4g} Pa is above 1 MPa: give Pa; with so much it "
                "is masonry, to be modelled by blocks"
            )
        for key in ("mobilisation", "active"):
            if getattr(self, key) > 1.0:
                raise InvalidInput(
                    f"fill, {key} {getattr(self, key):.4g} is above 1: give a part of the pressure"
                )
        if self.dispersal not in DISPERSALS:
            raise InvalidInput(
                f"fill, dispersal {self.dispersal!r} is not known: use one of {DISPERSALS}"
            )
        if not 0.1 <= self.spread <= 80.0:
            raise InvalidInput(
                f"fill, spread {self.spread:.4g}° is not between 0.1° and 80°: give degrees from "
                "the vertical; 1 in 2 is 26.6"
            )

    @property
    def passive_coefficient(self) -> float:
        """K_p, passive over vertical stress of a fill without cohesion [-]."""
        return tan(radians(45.0 + self.friction_angle / 2.0)) ** 2

    @property
    def edge(self) -> float:
        """Slope of the fan's edges, horizontal to vertical [-]."""
        return tan(radians(self.spread))

    def pressures(self, overburden: Array) -> tuple[Array, Array]:
        """Return the least and the greatest horizontal pressure, two arrays as given [Pa].

        Args:
            overburden: vertical stress σ in the fill, any shape [Pa].
        """
        passive = self.passive_coefficient
        least = overburden / passive - 2.0 * self.cohesion / sqrt(passive)
        least = self.active * np.maximum(least, 0.0)
        most = self.mobilisation * (passive * overburden + 2.0 * self.cohesion * sqrt(passive))
        return least, np.maximum(least, most)

    def share(self, slope: Array) -> Array:
        """Return the part of a load that goes down to the left of some rays, as given [-].

        Under a line load on an elastic half-plane stresses are radial (Flamant), so that what
        crosses the fan between two rays is the same on whatever face it meets.

        Args:
            slope: tan θ of rays at θ from the vertical, positive to the right, any shape.
        """
        inside = np.clip(slope, -self.edge, self.edge)
        if self.dispersal == "uniform":
            return np.asarray(0.5 + 0.5 * inside / self.edge)
        return np.asarray(0.5 + 0.5 * _flamant(inside) / _flamant(np.array(self.edge)))


def _flamant(slope: Array) -> Array:
    """θ + sin θ cos θ, which grows as the vertical force between the vertical and a ray."""
    return np.asarray(np.arctan(slope) + slope / (1.0 + slope**2), dtype=float)
