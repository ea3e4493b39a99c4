"""Units: factors into SI, as in `young=30 * GPa`, and quantities as text, as in "1.48 MPa/mm"."""

import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from functools import cache, partial
from math import degrees, inf, isfinite, pi, prod, tan
from typing import Any, Self

from archfem._validation import is_number, short_repr, validate_arguments
from archfem.errors import InvalidInput, logger

mm = 1e-3  # m
kN = 1e3  # N
kPa = 1e3  # Pa
MPa = 1e6  # Pa
GPa = 1e9  # Pa

# Default acceleration of gravity [m/s²]
G = 9.81

# Standard gravity, the unit g of accelerograms and spectra [m/s²]
STANDARD_GRAVITY = 9.80665


# SI unit and factor of common units, read without the registry of units, which loads for a second
COMMON_UNITS = {unit: (unit, 1.0) for unit in ("m", "s", "m/s**2", "Pa")}
COMMON_UNITS |= {"mm": ("m", 1e-3), "ms": ("s", 1e-3), "MPa": ("Pa", 1e6), "GPa": ("Pa", 1e9)}
COMMON_UNITS |= dict.fromkeys(("MPa/mm", "GPa/m"), ("Pa/m", 1e9))
COMMON_UNITS |= dict.fromkeys(("degree", "degrees", "deg", "°"), ("degree", 1.0))


@cache
def _registry() -> Any:
    """Load the registry of units."""
    import pint  # takes a second to import

    return pint.UnitRegistry()


@validate_arguments
def in_unit(value: Any, unit: str, key: str) -> float:
    """Convert a number, or a quantity as text, to a unit.

    Args:
        value: 2.95, "2.95 m", "1.48 MPa/mm"; a bare number is in `unit` already. For an
            acceleration "0.3 g" is 0.3 times standard gravity; for a frequency "10 rad/s" is the
            angular one, 10/2π Hz.
        unit: unit of the result, "1" for a pure number.
        key: name of the value in an error.

    Returns:
        The number in that unit.

    Raises:
        InvalidInput: it is not one number with one unit, not finite, or of another dimension; or
            an angle where a pure number is required.

    Example:
        >>> af.units.in_unit("1.48 MPa/mm", "Pa/m", "normal_stiffness")
        1480000000.0
    """
    plain_pattern = re.compile(
        r"([-+]?\d{1,20}(?:\.\d{0,20})?)\s*([a-zA-Z°]+(?:/[a-z]+(?:\*\*[23])?)?)"
    )
    if isinstance(value, str):
        plain = plain_pattern.fullmatch(value.strip())
        common = COMMON_UNITS.get(plain[2]) if plain else None
        if plain and common and common[0] == unit:
            number = float(plain[1]) * common[1]
        else:
            number = _convert(value, unit, key)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        number = float(value) if is_number(value) else inf
    else:
        raise InvalidInput(f"{key} = {short_repr(value)} is not a number: give one in {unit}")
    if not isfinite(number):
        raise InvalidInput(f"{key} = {short_repr(value)} is not finite: give a number in {unit}")
    return number


def in_degrees(value: Any, key: str) -> float:
    """Convert an angle to degrees.

    Args:
        value: 159, "159 degree", "2.775 rad"; a bare number is in degrees. Bare numbers up to 2π
            are refused, as they are probably radians: give the unit.
        key: name of the value in an error.

    Returns:
        The angle [degree].

    Raises:
        InvalidInput: it is no angle, text without a unit, or a bare number up to 2π.
    """
    if isinstance(value, str) and not re.search(r"[^\W\d_]|[°'\"]", value):
        raise InvalidInput(f'{key} = {value!r} has no unit: write a number, or "{value} degree"')
    number = in_unit(value, "degree", key)
    if not isinstance(value, str) and 0.0 < abs(number) <= 2.0 * pi:
        raise InvalidInput(
            f"{key} = {value!r} would be a few degrees only, and looks like radians: give "
            f'{degrees(number):.4g} for {number:.4g} rad, or "{number:.6g} degree" if that is right'
        )
    return number


def in_si_unit(values: Sequence[Any]) -> tuple[list[Any], str]:
    """Return quantities as numbers in one SI unit, angles in degrees; other values unchanged.

    The unit is empty where all values are plain numbers, or one is text that is no quantity.
    """
    # "g" is gravity, as no key of a case is a mass; a pure number is no angle
    units = ("m", "m/s**2", "Pa", "Pa/m", "N/m**3", "N/m", "s", "Hz", "N", "1", "degree")
    texts = [value for value in values if isinstance(value, str)]
    if not texts or not all(re.match(r"\s*[-+]?\.?\d", text) for text in texts):
        return list(values), ""
    # a common unit needs no registry
    common = COMMON_UNITS.get(texts[0].strip().lstrip("-+.0123456789 "), ("m", 1.0))[0]
    for unit in (common, *units):
        with suppress(InvalidInput):
            convert = partial(in_unit, unit=unit, key="value")
            return [None if value is None else convert(value) for value in values], unit
    return list(values), ""


def describe_if_in_g(acceleration: float, key: str) -> str:
    """Describe a peak acceleration [m/s²] that is probably a multiple of g; empty if not."""
    # up to about 0.05 g seismicity is very low (EN 1998-1, 3.2.1); a multiple of 9.80665 that was
    # given as one, as "0.03 g", has more than five digits
    if acceleration >= 0.5 or acceleration != float(f"{acceleration:.5g}"):
        return ""
    return (
        f"{key} is {acceleration:.3g} m/s², which is {acceleration / STANDARD_GRAVITY:.3g} g: "
        f"write {acceleration * STANDARD_GRAVITY:.3g} m/s² if it is {acceleration:.3g} g"
    )


def warn_if_in_g(acceleration: float, key: str) -> None:
    """Warn of a peak acceleration [m/s²] that is probably a multiple of g."""
    if words := describe_if_in_g(acceleration, key):
        logger.warning("%s", words)


def format_mm(length: float) -> str:
    """Return a length in millimetres, of a metre and more without decimals or powers of ten."""
    return f"{length / mm:.3g} mm" if abs(length) < 0.9995 else f"{length / mm:.0f} mm"


def format_ratio(ratio: float, digits: int = 3) -> str:
    """Return a ratio with some digits, and more where it would be rounded to or across 1."""
    texts = [f"{ratio:.{count}g}" for count in range(digits, 18)]
    return next(x for x in texts if (float(x) > 1.0, float(x) < 1.0) == (ratio > 1.0, ratio < 1.0))


class StatedWeight(float):
    """Unit weight that was given with its unit, so that none is guessed [N/m³]."""


class Usual(float):
    """Number of a preset or a default: an equal one that is given by hand is a plain one."""


class Ends(tuple[float, ...]):
    """Least and largest of a number, of one format; "mm" is that of lengths, "ratio" of ratios."""

    @classmethod
    def of(cls, numbers: Iterable[float]) -> Self:
        """Return the ends of some numbers."""
        known = [*numbers]
        return cls((min(known), max(known)))

    def __format__(self, spec: str) -> str:
        """Return both ends, or one where their texts do not differ."""
        if spec == "mm":
            texts = (format_mm(end).removesuffix(" mm") for end in self)
            return f"{' to '.join(dict.fromkeys(texts))} mm"
        texts = (format_ratio(end) if spec == "ratio" else format(end, spec) for end in self)
        return " to ".join(dict.fromkeys(texts))


def _check_text(text: str, unit: str, key: str) -> None:
    """Refuse commas, and long text and high powers, which pint would evaluate for hours."""
    power_pattern = re.compile(r"(?:\*\*|\^)\s*\(?\s*[-+]?\s*(\d{1,2}(?![\deE]))?")
    superscript_pattern = re.compile(r"[⁰¹²³⁴⁵⁶⁷⁸⁹]{2}")
    if len(text) > 100:
        raise InvalidInput(
            f"{key} = {short_repr(text)} is no quantity, for it has {len(text)} letters: write a "
            f"number in {unit}"
        )
    # pint would take the comma out: 2,95 m for 295 m
    if comma := re.search(r"\d,\d", text):
        raise InvalidInput(
            f"{key} = {text!r} has a comma in its number, {comma[0]!r}: write a point for "
            "decimals, and nothing between thousands"
        )
    powers = [match[1] for match in power_pattern.finditer(text)]
    # no unit of mechanics has a power above 12
    is_high = None in powers or prod(map(int, powers)) > 12
    if is_high or superscript_pattern.search(text):
        raise InvalidInput(f"{key} = {text!r} has a power no unit has: write a number in {unit}")


def _split_quantity(text: str, unit: str, key: str) -> tuple[str, str]:
    """Return the number and the unit of a quantity; pint multiplies the numbers of "2 500 mm"."""
    number_pattern = r"(?:[-+]?(?:\d+(?:_\d+)*\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|nan|inf)"
    power_pattern = r"(?<=[^\W\d])(?:[23]|_0)\b|(?<=.)(?:\*\*|\^)\s*\(?\s*-?\d+"
    number = re.match(number_pattern, text := text.strip())
    rest = text[number.end() :].strip() if number else ""
    # pint leaves out signs that it does not know, such as an apostrophe or a long dash
    if not number or re.search(r"\d|[^\w\s*/·()°%⁻]", re.sub(power_pattern, "", rest)):
        reason = f"{rest!r} is no unit" if number else "it does not begin with a number"
        raise InvalidInput(
            f"{key} = {text!r} is not a quantity, for {reason}: write one number, with nothing "
            f'between its digits, and then one unit, e.g. "1500.5 {unit}"'
        )
    return number[0], rest


def _suggest_unit(text: str, unit: str) -> str:
    """Return the question whether a quantity with usual letters of its unit was intended."""
    usual = ("N", "kN", "MN", "Pa", "kPa", "MPa", "GPa", "m", "mm", "cm", "s", "ms", "Hz", "g")
    letters = {each.lower(): each for each in usual} | {"tonf": "tf"}
    intended = re.sub(r"[^\W\d_]+", lambda word: letters.get(word[0].lower(), word[0]), text)
    with suppress(InvalidInput):
        if intended != text and in_unit(intended, unit, "value") is not None:
            return f"did you mean {intended!r}?"
    return ""


def _refuse_mass(quantity: Any, unit: str, words: str) -> None:
    """Refuse a mass in place of a weight, and a density in place of a weight by volume."""
    masses = {"N": ("a mass", "kg", "kN"), "N/m**3": ("a density", "kg/m**3", "kN/m³")}
    if unit in masses and quantity.check(masses[unit][1]):
        noun, mass, force = masses[unit]
        weight = f"{float(quantity.to(mass).magnitude) * G / kN:.4g} {force}"
        raise InvalidInput(f"{words} is {noun}: give its weight, times g: '{weight}'")


def _check_unit(registry: Any, unit: str, key: str) -> None:
    """Refuse a unit of the result that the registry does not know."""
    try:
        registry.Unit(unit)
    except Exception as error:  # also of pint's tokenizer
        raise InvalidInput(
            f"{unit!r}, into which {key} is converted, is no unit: {error}"
        ) from error


def _convert(text: str, unit: str, key: str) -> float:
    """Convert a quantity in text to a unit."""
    import pint

    for part in (text, unit):
        _check_text(part, unit, key)
    registry = _registry()
    number, name = _split_quantity(text, unit, key)
    target = "dimensionless" if unit == "1" else unit
    _check_unit(registry, target, key)
    name = re.sub(r"\b([A-Za-z]+)([23])\b", r"\1**\2", name)  # as in kN/m3
    if unit == "m/s**2":  # here g is gravity and gal the unit of Galileo, not gram and gallon
        name = re.sub(r"\bg\b", "g_0", re.sub(r"\bgal\b", "Gal", name))
    try:
        quantity = registry.Quantity(f"{number} {name}")
        # pint takes angles for pure numbers, and 1 rad/s for 1 Hz
        is_angle = "radian" in dict(quantity.to_root_units().unit_items())
        if is_angle and unit == "Hz":
            target = "turn/s"
        if is_angle and unit == "1":
            angle = float(quantity.to("radian").magnitude)
            raise InvalidInput(
                f"{key} = {text!r} is an angle, and this must be a pure number: a coefficient of "
                f"friction is the tangent of its angle, {tan(angle):.3f}"
            )
        _refuse_mass(quantity, unit, f"{key} = {text!r}")
        return float(quantity.to(target).magnitude)
    except InvalidInput:
        raise
    except pint.DimensionalityError as error:
        if unit == "1":
            plain = f", in g if it is an acceleration: write {number}" * (name == "g")
            raise InvalidInput(
                f"{key} = {text!r} has a unit, and this is a pure number{plain}"
            ) from error
        hint = f" ({question})" if (question := _suggest_unit(text, unit)) else f": {error}"
        reason = f"is not in a unit like {target}{hint}"
        usual = "kN" if target == "N" else target  # of axles and other loads
        plain = f'has no unit: write a number in {target}, or "{text} {usual}"'
        words = plain if str(error.units1) == "dimensionless" else reason
        raise InvalidInput(f"{key} = {text!r} {words}") from error
    except Exception as error:  # also of pint's tokenizer
        remedy = _suggest_unit(text, unit) or f'write a number and a unit, e.g. "1.5 {target}"'
        raise InvalidInput(f"{key} = {text!r} is not a quantity ({error}): {remedy}") from error
