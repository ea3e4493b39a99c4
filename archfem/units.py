"""Units: multipliers into SI, `young=30 * GPa`, and quantities as people write them.

"1.48 MPa/mm" is 1.48e9 Pa/m.
"""

import re
from functools import cache
from math import isfinite, tan
from typing import Any

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


@cache
def _registry() -> Any:
    import pint  # slow to import, and only case files need it

    return pint.UnitRegistry()


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
        number = float(value)
    else:
        raise InvalidInput(f"{key} = {value!r} is not a number: give one in {unit}")
    if not isfinite(number):
        raise InvalidInput(f"{key} = {value!r} is not finite: give a number in {unit}")
    return number


def _converted(text: str, unit: str, key: str) -> float:
    import pint

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
