"""Parts of a bridge: rings, piers, sidewalls, backfill and paving.

The origin is at the left end of the deck (x) and at the springing level (y). At this level the
centre lines of all rings intersect their springing joints. Gaps and lengths of piers and sidewalls
end there too, however the rings are measured.
"""

from dataclasses import dataclass, field, replace
from math import atan2, radians, sin
from typing import Any, ClassVar

import numpy as np

from archfem._typing import Angle, Metres
from archfem._validation import check_between, short_repr
from archfem.errors import InvalidStructure
from archfem.masonry.block import Point
from archfem.masonry.materials import BACKFILL, SOIL_TO_STONE, Contact, Material
from archfem.units import in_degrees


@dataclass(frozen=True, kw_only=True)
class Arch:
    """One ring of a bridge.

    Attributes:
        span: clear span between its springings [m].
        embrace: subtended angle [degrees], a small one with its unit, "5 degree"; or
        rise: clear rise of the intrados above its springings [m].
        thickness: thickness of the ring [m].
        voussoirs: number of stones.
        measured: "intrados"; or "centre line", along which span and rise are measured then.
        name: name of the part.
    """

    role: ClassVar[str] = "ring"

    span: Metres
    thickness: Metres
    voussoirs: int
    embrace: Angle | None = None
    rise: Metres | None = None
    measured: str = "intrados"
    name: str = "arch"

    def __post_init__(self) -> None:
        """Check the lengths, how they are measured, and the embrace."""
        if self.measured not in ("intrados", "centre line"):
            raise InvalidStructure(
                f"'{self.name}': measured = {short_repr(self.measured)} is unknown: span and rise "
                "are those of the 'intrados' or of the 'centre line'"
            )
        if (self.embrace is None) == (self.rise is None):
            raise InvalidStructure(f"'{self.name}': give either embrace or rise, the other follows")
        _check_lengths(self, "span", "thickness", *(["rise"] if self.embrace is None else []))
        if self.rise is None:
            embrace = in_degrees(self.embrace, f"'{self.name}': embrace")
            object.__setattr__(self, "embrace", embrace)
            name = f"'{self.name}': embrace [°]"
            check_between(embrace, name, 0.0, 360.0, error=InvalidStructure)
        elif self.rise > self.span / 2.0:
            raise InvalidStructure(
                f"'{self.name}': rise {self.rise:.4g} m is above half the span {self.span:.4g} m: "
                "an arch by span and rise is at most a semicircle; give span and embrace beyond"
            )

    @property
    def half(self) -> float:
        """Half the embrace [rad]."""
        if self.embrace is not None:
            return radians(float(self.embrace)) / 2.0
        assert self.rise is not None
        # tangent half-angle: the chord from springing to crown makes half the angle with the span
        return 2.0 * atan2(self.rise, self.span / 2.0)

    @property
    def radius(self) -> float:
        """Radius of the centre line [m]."""
        radius = self.span / (2.0 * sin(self.half))
        return radius if self.measured == "centre line" else radius + 0.5 * self.thickness

    @property
    def centre_line_span(self) -> float:
        """Span of the centre line [m]."""
        return self.span if self.measured == "centre line" else 2.0 * self.radius * sin(self.half)

    @property
    def reach(self) -> float:
        """Horizontal projection of half a springing joint [m]."""
        return 0.5 * self.thickness * sin(self.half)


@dataclass(frozen=True, kw_only=True)
class Pier:
    """A pier of stone courses, flush with the intrados of the rings that spring from it.

    Its top course is one skewback between the two springing joints, or behind the only one. Where
    rings are less than 10 mm apart, it takes their lowest voussoirs up to where they part.

    Attributes:
        breadth: breadth of the courses, between the clear spans beside them [m]; or
        gap: between the springings of the neighbouring centre lines, or from that of the only
            one to the outer face [m]. Half a springing joint at each end stands on more.
        height: height from foundation to springing level [m].
        course: height of a course, about; courses of a pier are equally high [m].
        name: name of the part.
    """

    role: ClassVar[str] = "pier"

    breadth: Metres | None = None
    gap: Metres | None = None
    height: Metres
    course: Metres = 0.40
    name: str = "pier"

    def __post_init__(self) -> None:
        """Check the lengths."""
        if (self.breadth is None) == (self.gap is None):
            raise InvalidStructure(
                f"'{self.name}': give either breadth, as it is measured between the clear spans, "
                "or gap, between the springings of the centre lines"
            )
        _check_lengths(self, "gap" if self.breadth is None else "breadth", "height", "course")

    def gap_beside(self, *reaches: float) -> float:
        """Return the gap, where halves of springing joints reach so far over the pier [m]."""
        if self.gap is not None:
            return self.gap
        assert self.breadth is not None
        return self.breadth - sum(reaches)


@dataclass(frozen=True, kw_only=True)
class Sidewall:
    """Stone courses behind an outer springing, which support it and the parts above.

    Attributes:
        length: length from the springing outwards [m].
        height: height from foundation to springing level [m].
        course: height of a course, about [m].
        above: height of the courses above the springing, an abutment to the fill [m].
        setback: setback of those courses, and so the depth of the skewback, behind the extrados
            [m].
        state: "free" courses; "retained" by a fixed wall at their outer end; or "fixed".
        name: name of the part.
    """

    role: ClassVar[str] = "other"

    length: Metres
    height: Metres
    course: Metres = 0.40
    above: Metres = 0.0
    setback: Metres = 0.40
    state: str = "free"
    name: str = "sidewall"

    def __post_init__(self) -> None:
        """Check the lengths, and that the courses are free, retained or fixed."""
        _check_lengths(self, "length", "height", "course")
        _check_lengths(self, "above", "setback", zero=True)
        if self.state not in ("free", "retained", "fixed"):
            raise InvalidStructure(
                f"'{self.name}': state '{self.state}' is unknown: free, retained or fixed"
            )


@dataclass(frozen=True, kw_only=True)
class Backfill:
    """The fill on rings, skewbacks and sidewalls, up to the deck; its far ends are free.

    Attributes:
        cover: height of fill above the highest corner of the rings' stones, up to the level of the
            deck [m]. Of an even number of stones it is that above the crown of the arc. Of an odd
            number n the crown is higher by R (1 - cos(φ / 2n)), with the radius R of the extrados
            and the embrace φ: by 6 mm with 19 stones of a span of 5.4 m, by 44 mm with 7.
        erosion: settlement of the fill below that level [m], except within
        hump: this distance to either side of the highest crown [m].
        spandrels: total thickness of the two spandrel walls, whose weight replaces that of the
            fill [m].
        material: material of the fill.
        contact: with stone.
    """

    cover: Metres
    erosion: Metres = 0.0
    hump: Metres = 1.0
    spandrels: Metres = 0.0
    material: Material = BACKFILL
    contact: Contact = SOIL_TO_STONE
    name: str = field(default="backfill", init=False)

    def __post_init__(self) -> None:
        """Check the lengths."""
        _check_lengths(self, "cover", zero=True, high=30.0)
        _check_lengths(self, "erosion", "hump", "spandrels", zero=True, high=100.0)

    def surface(self, left: float, right: float, crown: Point) -> list[Point]:
        """Return points of the surface, from left to right [m].

        Args:
            left: x of the left end of the deck [m].
            right: x of its right end [m].
            crown: the highest point of the rings below [m].
        """
        deck = crown[1] + self.cover
        # The surface falls by 1 in 2 from the hump to the eroded level on both sides.
        low, slope = deck - self.erosion, 2.0 * self.erosion
        reach = crown[0] + np.array([-self.hump - slope, -self.hump, self.hump, self.hump + slope])
        breaks = reach[(reach > left) & (reach < right)] if self.erosion else reach[:0]
        x = np.array([left, *breaks, right])
        y = np.interp(x, reach, [low, deck, deck, low])
        return [(float(px), float(py)) for px, py in zip(x, y, strict=True)]

    def loaded(self, width: float, stone: Material) -> Material:
        """Return the fill material with the weight of the spandrels, averaged over the width.

        Args:
            width: width of the bridge, out of plane [m].
            stone: stone of the spandrels.

        Raises:
            InvalidStructure: the spandrels are as wide as the bridge.
        """
        if not self.spandrels < width:
            raise InvalidStructure(
                f"spandrels of {self.spandrels:.3g} m do not fit into a width of {width:.3g} m"
            )
        share = self.spandrels / width
        weight = (1.0 - share) * self.material.unit_weight + share * stone.unit_weight
        return replace(self.material, unit_weight=weight)


@dataclass(frozen=True, kw_only=True)
class Paving:
    """Paving stones on the fill.

    Attributes:
        thickness: thickness of the stones [m].
        length: length of a stone, about [m].
    """

    thickness: Metres
    length: Metres = 1.0
    name: str = field(default="paving", init=False)

    def __post_init__(self) -> None:
        """Check the lengths."""
        _check_lengths(self, "thickness", "length")


def _check_lengths(part: Any, *keys: str, zero: bool = False, high: float = 1e3) -> None:
    """Check that lengths are positive, or also zero, and below a limit [m]."""
    options: Any = {"ends": "[)" if zero else "()", "error": InvalidStructure}
    for key in keys:  # more is a mistake of units
        check_between(getattr(part, key), f"'{part.name}': {key} [m]", 0.0, high, **options)
