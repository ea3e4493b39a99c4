"""What a case asks of limit analysis: loads that grow over self-weight, and how joints slide."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from archfem.cases.settings import checked, chosen
from archfem.errors import InvalidInput
from archfem.limit.collapse import Collapse, collapse_factor
from archfem.limit.fill import Fill
from archfem.masonry.actions import Action, BodyForce, PointLoad
from archfem.masonry.structure import Structure

LIMIT = {"horizontal": "1", "vertical": "1", "point": dict, "friction": str, "fill": dict}
POINT = {"x": "m", "force": ["N"]}
FILL = {
    "friction_angle": "degree",
    "cohesion": "Pa",
    "mobilisation": "1",
    "active": "1",
    "dispersal": str,
    "spread": "degree",
}
FRICTION = {"coulomb": "coulomb", "nonassociated": "nonassociated", "none": None}
"""How joints slide, by the word in a case file."""


@dataclass(frozen=True)
class Limit:
    """Limit analysis as a case asks for it.

    Attributes:
        live: loads that grow together; the collapse factor multiplies them.
        friction: as `collapse_factor` takes it.
        fill: strength of the fill, or None.
    """

    live: Sequence[Action]
    friction: str | None
    fill: Fill | None = None

    def of(self, structure: Structure) -> Collapse:
        """Find the factor at which a structure of rigid blocks becomes a mechanism.

        Args:
            structure: of the case.

        Returns:
            As `collapse_factor`.

        Raises:
            InvalidInput: a load misses the structure, or blocks are too soft to be taken as rigid
                and the case does not tell the strength of a fill.
        """
        return collapse_factor(structure, live=self.live, friction=self.friction, fill=self.fill)


def limit_asked(given: Any) -> Limit:
    """Return what a case asks of limit analysis.

    Args:
        given: the table [limit] as read: `horizontal` and `vertical`, a force on every block in
            multiples of its weight, or `point`, a force on the extrados at x, or both;
            `friction`; `fill`, the strength of the backfill.

    Raises:
        InvalidInput: a key or value cannot be meant, or there is no load.
    """
    values = checked(given, LIMIT, "limit")
    live: list[Action] = []
    if "horizontal" in values or "vertical" in values:
        live.append(BodyForce(values.get("horizontal", 0.0), values.get("vertical", 0.0)))
    if "point" in values:
        live.append(_point(values["point"]))
    if not live:
        raise InvalidInput(
            "limit has no load: give horizontal = 1.0, a multiple of each block's weight, or "
            'point = { x = "1.4 m", force = ["0 kN", "-1 kN"] }'
        )
    word = chosen(values.get("friction", "coulomb"), FRICTION, "limit.friction")
    return Limit(tuple(live), FRICTION[word], _fill(values["fill"]) if "fill" in values else None)


def _fill(given: Any) -> Fill:
    fill = checked(given, FILL, "limit.fill")
    if "friction_angle" not in fill:
        raise InvalidInput(
            f"limit.fill = {given} lacks its angle of friction: give friction_angle = "
            '"35 degree", which well-packed gravel has'
        )
    return Fill(**fill)


def _point(given: Any) -> PointLoad:
    point = checked(given, POINT, "limit.point")
    if set(point) != set(POINT) or len(point["force"]) != 2:
        raise InvalidInput(
            f"limit.point = {given}: give a place and the two components of a force, e.g. "
            '{ x = "1.4 m", force = ["0 kN", "-1 kN"] }'
        )
    return PointLoad(point["x"], point["force"])
