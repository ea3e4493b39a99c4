"""Strength of a fill: as weight and pressure on stones, or as a plastic continuum around them.

`backfill` has the effects of the first on the stones, `fill_bounds` the bounds with the second.
"""

from dataclasses import dataclass, replace
from math import radians, sqrt, tan
from typing import Any, TypeVar

import numpy as np

from archfem._typing import Array, Degrees, Metres, Pascals
from archfem._validation import check_between, check_choice, check_number
from archfem.errors import InvalidInput
from archfem.masonry.structure import Structure
from archfem.units import in_degrees, kPa

# `Fill` or `PlasticFill`, or None
AnyFill = TypeVar("AnyFill", bound=Any)


@dataclass(frozen=True, kw_only=True)
class Fill:
    """Strength of a fill, and the way in which it spreads loads that stand on it.

    Limit analysis takes a fill not as a body but as an action on the stones below:

    - its weight, column by column, rests on the stone below the column;
    - it presses on the stones' faces horizontally, by anything from the active pressure to a part
      of the passive one (Rankine, smooth faces). With the vertical stress σ of the columns above

        a max(K_a σ - 2 c √K_a, 0) <= p <= m (K_p σ + 2 c √K_p),   K_p = 1 / K_a = tan²(45° + φ/2),

      so that stones which move into the fill are held back and those which move away are pushed;
    - a load on its surface spreads down in a straight fan to the stones that it meets first.

    The vertical stress is that of the weights alone: live loads do not raise the pressures, and
    neither does a body force, as an earthquake would (Mononobe and Okabe). Shear between fill and
    stones is neglected. Between two faces, as above a pier, fill and backing press on both equally.
    Beside the ground the fill is long enough to bear its reactions: its own balance and failure are
    not checked.

    Attributes:
        friction_angle: friction angle φ of the fill [degrees].
        cohesion: cohesion c of the fill [Pa].
        mobilisation: mobilised part m of the passive pressure, from 0 for none to 1 for all; the
            whole of it needs more movement than a bridge may have [-].
        active: part a of the active pressure that always acts, from 0 to 1 [-]. Neglecting it
            is customary for arches, and wrong for walls that hold a fill back. Where some passive
            pressure beyond it is counted on, the whole is on the safe side of any part. Results of
            a push also state both ends, no pressure and the active one alone.
        dispersal: distribution of a load within the fan: "boussinesq", as through an elastic
            half-plane under a line load, or "uniform", evenly on each level.
        spread: half the angle of the fan, from the vertical [degrees]. The part that Boussinesq's
            stresses would carry outside of it is distributed inside.
        lever: where the horizontal force of each column acts, from 0 for its foot to 1 for its
            centroid. At 0 shear between the columns carries its moment to ends that hold the fill,
            at 1 the stone below carries all of it. Neither is measured: results state both [-].
        backing: level, a y coordinate, up to which there is masonry behind the haunches, not fill
            [m]; None for none. It holds the stones' faces horizontally, without tension: against
            the ground or, above a pier, against each other. It never pushes.
        backing_height: the same as a height above the lowest clear springing [m], which is the
            lowest end of a ring's intrados; in place of `backing`.
        backing_strength: greatest pressure of the backing [Pa]. Rubble in lime mortar has 1 to 2
            MPa (from memory). A finite one makes factors continuous in the level of the backing.

    References:
        Gilbert, RING Theory and Modelling Guide, University of Sheffield (2005). Rankine, Phil.
        Trans. R. Soc. 147 (1857) 9-27. Flamant, C. R. Acad. Sci. 114 (1892) 1465-1468.

    Example:
        >>> af.limit.Fill(friction_angle=30.0).mobilisation
        0.3333333333333333
    """

    friction_angle: Degrees
    cohesion: Pascals = 0.0
    mobilisation: float = 1.0 / 3.0
    active: float = 1.0
    dispersal: str = "boussinesq"
    spread: Degrees = 30.0
    lever: float = 0.0
    backing: Metres | None = None
    backing_height: Metres | None = None
    backing_strength: Pascals = 1e6

    def __post_init__(self) -> None:
        """Refuse values outside their range, most of them wrong units."""
        read_strength(self, "mobilisation", "active", "lever")
        remedy = "with more it is masonry, to be modelled by blocks"
        check_between(self.cohesion, "fill, cohesion [Pa]", 0.0, 1e6, ends="[]", remedy=remedy)
        given, name = self.backing_strength, "fill, backing_strength [Pa]"
        check_between(given, name, 1e4, 1e8, ends="[]", remedy="rubble in lime mortar has 1e6")
        for key in ("mobilisation", "active", "lever"):
            check_number(getattr(self, key), f"fill, {key}, a part", maximum=1.0)
        check_choice(self.dispersal, "fill, dispersal", ("boussinesq", "uniform"))
        remedy = "give degrees from the vertical; 1 in 2 is 26.6"
        check_between(self.spread, "fill, spread [degrees]", 0.1, 80.0, ends="[]", remedy=remedy)

    @property
    def passive_coefficient(self) -> float:
        """Rankine's K_p, passive over vertical stress of a fill without cohesion [-]."""
        return tan(radians(45.0 + self.friction_angle / 2.0)) ** 2

    @property
    def edge(self) -> float:
        """Slope of the outermost rays along which a load spreads, horizontal to vertical [-]."""
        return tan(radians(self.spread))

    def pressures(self, overburden: Array) -> tuple[Array, Array]:
        """Return the least and the greatest horizontal pressure, shaped as the argument [Pa].

        Args:
            overburden: vertical stress σ in the fill, any shape [Pa].
        """
        passive = self.passive_coefficient
        least = overburden / passive - 2.0 * self.cohesion / sqrt(passive)
        least = self.active * np.maximum(least, 0.0)
        most = self.mobilisation * (passive * overburden + 2.0 * self.cohesion * sqrt(passive))
        return least, np.maximum(least, most)

    def share(self, slope: Array) -> Array:
        """Return the part of a load that spreads to the left of some rays, shaped as given [-].

        Under a line load on an elastic half-plane stresses are radial (Flamant). The force between
        two rays of the fan is therefore the same on any face that it meets.

        Args:
            slope: tan θ of rays at θ from the vertical, positive to the right, any shape.
        """
        inside = np.clip(slope, -self.edge, self.edge)
        if self.dispersal == "uniform":
            return np.asarray(0.5 + 0.5 * inside / self.edge)
        return np.asarray(0.5 + 0.5 * _flamant(inside) / _flamant(np.array(self.edge)))


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
        backing_height: the same above the lowest clear springing, in place of `backing` [m].

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
    backing_height: Metres | None = None

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


def read_strength(fill: Any, *shares: str) -> None:
    """Convert the angles of a fill to degrees, and check strength, some shares, and backing."""
    if fill.backing_height is not None:
        check_number(fill.backing_height, "fill, backing_height [m]", minimum=0.0)
        if fill.backing is not None:
            raise InvalidInput(
                f"fill has backing up to y = {fill.backing:g} m and backing_height "
                f"{fill.backing_height:g} m: give one of them"
            )
    for key in ("friction_angle", "spread"):
        if isinstance(value := getattr(fill, key), str) or key == "spread":
            object.__setattr__(fill, key, in_degrees(value, f"fill, {key}"))
    for key in ("friction_angle", "cohesion", *shares, "spread"):
        check_number(getattr(fill, key), f"fill, {key}", minimum=0.0)
    if 0.0 < fill.cohesion < 100.0:
        raise InvalidInput(
            f"fill, cohesion {fill.cohesion:.4g} Pa is less than soil has: give pascals, "
            f"{fill.cohesion * kPa:.4g} for {fill.cohesion:.4g} kPa, or 0"
        )
    if not (fill.friction_angle == 0.0 or 1.0 <= fill.friction_angle <= 60.0):
        raise InvalidInput(
            f"fill, friction_angle {fill.friction_angle:.4g}° is neither 0 nor between 1° and "
            "60°: give degrees; gravel has about 35"
        )


def change_fill(fill: AnyFill, **values: Any) -> AnyFill:
    """Return the strength of a fill with other values."""
    return replace(fill, **({"spread": _in_words(fill.spread)} | values))


def as_pressure(fill: Fill | PlasticFill | None) -> Fill | None:
    """Return a plastic fill as weight and pressure of the same strength; other ones as they are."""
    if not isinstance(fill, PlasticFill):
        return fill
    keys = ("friction_angle", "cohesion", "backing", "backing_height")
    values: Any = {key: getattr(fill, key) for key in keys}
    return Fill(spread=_in_words(fill.spread), **values)


def _in_words(degrees: float) -> Any:
    """Return an angle with its unit, without which a small one is refused as if in radians."""
    return f"{degrees!r} degree"


def has_backing(fill: Fill | PlasticFill | None) -> bool:
    """Return whether masonry holds the haunches, up to a level or a height."""
    return fill is not None and (fill.backing, fill.backing_height) != (None, None)


def find_clear_springing(structure: Structure) -> float:
    """Return the lowest end of the intrados of any ring; NaN without one [m]."""
    ends = [joint.intrados[1] for joint in structure.joints if joint.role == "ring"]
    return float(min(ends, default=np.nan))


def place_backing(fill: AnyFill, structure: Structure) -> AnyFill:
    """Return a fill whose backing, if it is given by its height, is given by its level."""
    if fill is None or fill.backing_height is None:
        return fill
    level = find_clear_springing(structure) + fill.backing_height
    if np.isnan(level):
        raise InvalidInput("fill, backing_height: there is no ring; give backing, a level y")
    return change_fill(fill, backing=level, backing_height=None)


def _flamant(slope: Array) -> Array:
    """Return θ + sin θ cos θ, proportional to the force in the sector from vertical to ray."""
    return np.asarray(np.arctan(slope) + slope / (1.0 + slope**2), dtype=float)
