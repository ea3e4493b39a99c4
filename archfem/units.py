"""Units: multipliers into SI, `young=30 * GPa`, and quantities as people write them.

"1.48 MPa/mm" is 1.48e9 Pa/m.
"""

import re
from functools import cache
from math import degrees, inf, isfinite, pi, prod, tan
from typing import Any

from archfem.annotated import as_annotated
from archfem.arguments import is_number, said
from archfem.errors import InvalidInput

mm = 1e-3  # m
kN = 1e3  # N
kPa = 1e3  # Pa
MPa = 1e6  # Pa
GPa = 1e9  # Pa

G = 9.81
"""Acceleration of gravity wherever none is given [m/s²]."""

STANDARD_GRAVITY = 9.80665
"""The g in which accelerograms are recorded and spectra are given [m/s²]."""


ACCELERATION = "m/s**2"
"""Where it is wanted, g is gravity and gal is Galileo's unit, not gram and gallon."""

ANGLES = {"radian", "degree", "grade", "turn", "arcminute", "arcsecond", "milliarcsecond"}
"""Units that pass for pure numbers and are none."""

LONGEST = 100
"""Most letters of a quantity."""

HIGHEST = 12
"""Highest power that a unit has, all those in a quantity multiplied."""

_POWER = re.compile(r"(?:\*\*|\^)\s*\(?\s*[-+]?\s*(\d{1,2}(?![\deE]))?")
_RAISED = re.compile(r"[⁰¹²³⁴⁵⁶⁷⁸⁹]{2}")

_DEGREES = re.compile(r"(\d+(?:\.\d*)?)\s*(?:deg|degrees?|°)")
"""Degrees as most write them, read without the registry of units."""


@cache
def _registry() -> Any:
    import pint  # slow to import, and only case files need it

    return pint.UnitRegistry()


@as_annotated
def in_unit(value: Any, unit: str, key: str) -> float:
    """Return a number, or a number with a unit, as a number in the given unit.

    Args:
        value: 2.95, "2.95 m", "1.48 MPa/mm"; a bare number is in `unit` already. For an
            acceleration "0.3 g" is 0.3 times standard gravity.
        unit: the unit wanted, "1" for a pure number.
        key: what to call the value in an error.

    Raises:
        InvalidInput: it is no number, not finite, or of another dimension; or an angle where a pure
            number is wanted.

    Example:
        >>> af.units.in_unit("1.48 MPa/mm", "Pa/m", "normal_stiffness")
        1480000000.0
    """
    if isinstance(value, str):
        number = _converted(value, unit, key)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        number = float(value) if is_number(value) else inf
    else:
        raise InvalidInput(f"{key} = {said(value)} is not a number: give one in {unit}")
    if not isfinite(number):
        raise InvalidInput(f"{key} = {said(value)} is not finite: give a number in {unit}")
    return number


def in_degrees(value: Any, key: str) -> float:
    """Return an angle as a number of degrees.

    Args:
        value: 159, "159 degree", "2.775 rad"; a bare number is in degrees, and refused up to 2π,
            where it is more likely meant in radians: with its unit it is taken at its word.
        key: what to call the value in an error.

    Raises:
        InvalidInput: it is no angle, text without a unit, or a bare number of so few degrees.
    """
    if isinstance(value, str) and (plain := _DEGREES.fullmatch(value.strip())):
        return float(plain[1])
    if isinstance(value, str) and not re.search(r"[^\W\d_]|[°'\"]", value):
        raise InvalidInput(f'{key} = {value!r} has no unit: write a number, or "{value} degree"')
    number = in_unit(value, "degree", key)
    if not isinstance(value, str) and 0.0 < abs(number) <= 2.0 * pi:
        raise InvalidInput(
            f"{key} = {value!r} would be a few degrees only, and looks like radians: give "
            f'{degrees(number):.4g} for {number:.4g} rad, or "{number:.6g} degree" if you mean that'
        )
    return number


def _check_text(text: str, unit: str, key: str) -> None:
    """Refuse what would be worked out for hours before it is found not to be a quantity."""
    if len(text) > LONGEST:
        raise InvalidInput(
            f"{key} = {said(text)} is no quantity, for it has {len(text)} letters: write a number "
            f"in {unit}"
        )
    powers = [found[1] for found in _POWER.finditer(text)]
    if _RAISED.search(text) or None in powers or prod(int(power) for power in powers) > HIGHEST:
        raise InvalidInput(f"{key} = {text!r} has a power no unit has: write a number in {unit}")


def _converted(text: str, unit: str, key: str) -> float:
    import pint

    for words in (text, unit):
        _check_text(words, unit, key)
    registry = _registry()
    wanted = "dimensionless" if unit == "1" else unit
    if unit == ACCELERATION:
        text = re.sub(r"\bg\b", "g_0", re.sub(r"\bgal\b", "Gal", text))
    try:
        quantity = registry.Quantity(text)
        if unit == "1" and ANGLES & {name for name, _ in quantity.unit_items()}:
            angle = float(quantity.to("radian").magnitude)
            raise InvalidInput(
                f"{key} = {text!r} is an angle, and a pure number is wanted: a coefficient of "
                f"friction is the tangent of its angle, {tan(angle):.3f}"
            )
        return float(quantity.to(wanted).magnitude)
    except InvalidInput:
        raise
    except pint.DimensionalityError as error:
        raise InvalidInput(f"{key} = {text!r} is not in a unit like {wanted}: {error}") from error
    except (pint.UndefinedUnitError, pint.PintError, ValueError, TypeError) as error:
        raise InvalidInput(
            f"{key} = {text!r} is not a quantity ({error}): write a number and a unit, e.g. "
            f'"1.5 {wanted}"'
        ) from error
    except Exception as error:  # pint lets its tokenizer's errors through
        raise InvalidInput(f"{key} = {text!r} is not a quantity: {error}") from error
