"""Sections [limit], [rating] and [assessment]: capacity and kinematic assessment."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from archfem._validation import validate_methods
from archfem.cases.motion_keys import build_spectrum
from archfem.cases.toml_file import Table, check_choice, check_table
from archfem.errors import InvalidInput
from archfem.limit.backfill import Fill
from archfem.limit.collapse import Collapse, collapse_factor
from archfem.limit.vehicles import Rating, Vehicle, rate
from archfem.masonry.loads import Action, AttachedLoad, BodyForce, PointLoad
from archfem.masonry.structure import Structure
from archfem.motion.design_spectra import DesignSpectrum
from archfem.motion.motion import Motion
from archfem.statics.mechanism_assessment import (
    KinematicAssessment,
    LimitState,
    assess_parts,
    kinematic_assessment,
)

# Keys of the tables by section, and the kind of each value
SECTION_KEYS: Mapping[str, Table] = {
    "limit": {"horizontal": "1", "vertical": "1", "point": dict, "friction": str, "fill": dict},
    "limit.point": {"x": "m", "force": ["N"]},
    "limit.fill": {
        **{"friction_angle": "degree", "cohesion": "Pa", "mobilisation": "1", "active": "1"},
        **{"dispersal": str, "spread": "degree"},
    },
    "rating": {"vehicle": (str, dict), "live": "1", "impact": "1", "dead": "1", "width": "m"},
    "rating.vehicle": {"name": str, "axles": ["N"], "spacings": ["m"]},
    "assessment": {
        **{"spectrum": dict, "direction": "1", "friction": str, "part": str},
        **{"blocks": [(int, str)], "loads": [dict], "limit_state": (str, dict), "q": "1"},
        "confidence_factor": "1",
    },
    "assessment.loads": {"block": (int, str), "point": ["m"], "weight": "N", "force": ["N"]},
    "assessment.limit_state": {
        **{"name": str, "share": "1", "period_factor": "1", "secant_share": "1", "damping": "1"},
        "source": str,
    },
}


def _check_section(table: Any, section: str) -> dict[str, Any]:
    """Check the keys of the table of a section, and convert its values to their kinds."""
    return check_table(table, SECTION_KEYS[section], section)


@validate_methods
@dataclass(frozen=True)
class LimitAnalysis:
    """Limit analysis of a case: the live load, the friction law and the strength of a fill.

    Attributes:
        live: loads that grow together; the collapse factor multiplies them. Without any, friction
            and fill are those of a rating.
        friction: friction law, "coulomb", "nonassociated", or None without sliding.
        fill: strength of the fill, or None.
    """

    live: Sequence[Action]
    friction: str | None
    fill: Fill | None = None

    def solve(self, structure: Structure) -> Collapse:
        """Compute the load factor at which a structure of rigid blocks becomes a mechanism.

        Args:
            structure: structure of the case.

        Returns:
            Result of `archfem.collapse_factor`.

        Raises:
            InvalidInput: there is no load, a load misses the structure, or blocks are too soft to
                be rigid and the case gives no strength of a fill.
        """
        if not self.live:
            raise InvalidInput(
                "limit has no load: give horizontal = 1.0, a multiple of each block's weight, or "
                'point = { x = "1.4 m", force = ["0 kN", "-1 kN"] }'
            )
        return collapse_factor(structure, live=self.live, friction=self.friction, fill=self.fill)


def parse_limit(table: Any) -> LimitAnalysis:
    """Return the limit analysis of a case."""
    values = _check_section(table, "limit")
    live: list[Action] = []
    if "horizontal" in values or "vertical" in values:
        live.append(BodyForce(values.get("horizontal", 0.0), values.get("vertical", 0.0)))
    if "point" in values:
        live.append(_point_load(values["point"]))
    friction = _check_friction(values.get("friction", "coulomb"), "limit.friction")
    fill = _fill(values["fill"]) if "fill" in values else None
    return LimitAnalysis(tuple(live), friction, fill)


def _check_friction(value: Any, key: str) -> str | None:
    """Return the friction law of limit analysis; None without sliding."""
    law = check_choice(value, ("coulomb", "nonassociated", "none"), key)
    return None if law == "none" else law


def _fill(table: Any) -> Fill:
    """Return the strength of the fill."""
    fill = _check_section(table, "limit.fill")
    if "friction_angle" not in fill:
        raise InvalidInput(
            f"limit.fill = {table} lacks its angle of friction: give friction_angle = "
            '"35 degree", which well-packed gravel has'
        )
    return Fill(**fill)


def _point_load(table: Any) -> PointLoad:
    """Return a concentrated live load."""
    point = _check_section(table, "limit.point")
    if len(point) < 2 or len(point["force"]) != 2:
        raise InvalidInput(
            f"limit.point = {table}: give a place and the two components of a force, e.g. "
            '{ x = "1.4 m", force = ["0 kN", "-1 kN"] }'
        )
    return PointLoad(point["x"], point["force"])


def parse_rating(table: Any) -> Table:
    """Return the rating of a case: the arguments of `rate` that it gives."""
    options = _check_section(table, "rating")
    if isinstance(vehicle := options.get("vehicle"), dict):
        options["vehicle"] = _build("rating.vehicle", Vehicle, vehicle)
    return options


def rate_case(
    structure: Structure, rating: Table, limit: LimitAnalysis | None, given: Table
) -> Rating:
    """Rate the bridge of a case, by the joints and the fill of its [limit]."""
    options = {**rating, **given}
    if "vehicle" not in options:
        raise InvalidInput(
            'a rating needs a vehicle: write [rating] with vehicle = "LM1", or give --vehicle LM1'
        )
    if limit is not None:
        options |= {"friction": limit.friction, "fill": limit.fill}
    return rate(structure, options.pop("vehicle"), **options)


@dataclass(frozen=True)
class AssessmentSettings:
    """Kinematic assessment of a case."""

    spectrum: DesignSpectrum | None  # of the demand; None for that of the case's suite or motion
    directions: tuple[float, ...]  # of the horizontal forces, 1 to the right and -1 to the left
    options: dict[str, Any]  # other arguments of `kinematic_assessment`

    def solve(
        self, structure: Structure, demand: DesignSpectrum | Motion | None, parts: bool = False
    ) -> dict[str, KinematicAssessment]:
        """Assess the structure, or each part by itself, in each direction."""
        spectrum = self.spectrum if self.spectrum is not None else demand
        if spectrum is None:
            raise InvalidInput(
                "an assessment needs a spectrum: write [assessment] with spectrum = { code = "
                '"NTC-2018", ag = 0.25, f0 = 2.4, tc_star = 0.32, site = "B" }, or a motion'
            )
        found: dict[str, KinematicAssessment] = {}
        for direction in self.directions:
            side, options = ("right", "left")[direction < 0.0], {**self.options}
            options["direction"] = direction
            if parts:
                each = assess_parts(structure, spectrum, **options)
                found |= {f"{name or 'part'}, {side}": result for name, result in each.items()}
            else:
                found[side] = kinematic_assessment(structure, spectrum, **options)
        return found


def parse_assessment(table: Any) -> AssessmentSettings:
    """Return the kinematic assessment of a case."""
    options = _check_section(table, "assessment")
    spectrum = None
    if "spectrum" in options:
        spectrum = build_spectrum(options.pop("spectrum"), "assessment.spectrum")
    directions = (options.pop("direction"),) if "direction" in options else (1.0, -1.0)
    if not set(directions) <= {1.0, -1.0}:
        raise InvalidInput(
            f"assessment.direction = {directions[0]:g}: give 1 for right or -1 for left, or leave "
            "it out for both"
        )
    if "friction" in options:
        options["friction"] = _check_friction(options["friction"], "assessment.friction")
    if isinstance(state := options.get("limit_state"), dict):
        options["limit_state"] = _build("assessment.limit_state", LimitState, state)
    if "loads" in options:
        loads = options["loads"]
        options["loads"] = [_build("assessment.loads", AttachedLoad, load) for load in loads]
    return AssessmentSettings(spectrum, directions, options)


def _build(section: str, kind: Callable[..., Any], table: Table) -> Any:
    """Return an object made of the keys of a table."""
    try:
        return kind(**_check_section(table, section))
    except TypeError as error:
        keys = list(SECTION_KEYS[section])
        raise InvalidInput(f"{section} = {dict(table)}: {error}; its keys are {keys}") from error
