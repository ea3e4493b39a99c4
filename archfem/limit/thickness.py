"""The least thickness at which a family of structures stands."""

from collections.abc import Callable

import numpy as np

from archfem.annotated import as_annotated
from archfem.arguments import instance
from archfem.errors import InvalidInput, InvalidStructure
from archfem.limit.collapse import stands
from archfem.limit.fill import Fill
from archfem.masonry.structure import Structure

THINNEST = 1e-4
"""Thickness at which the search for one that stands begins, relative to the structure's size."""

LIMIT = 1e-9
"""Relative width of the bracket of the thickness beyond which nothing can be built."""


@as_annotated
def minimum_thickness(
    build: Callable[[float], Structure],
    *,
    friction: str | None = "coulomb",
    strength: float | None = None,
    fill: Fill | None = None,
    tolerance: float = 1e-6,
) -> float:
    """Find the least thickness at which a family of structures stands, by bisection [m].

    The search doubles a very small thickness until one stands, and then halves the bracket.

    Args:
        build: makes the structure of a given thickness [m].
        friction: as for `collapse_factor`.
        strength: as for `collapse_factor` [Pa].
        fill: as for `collapse_factor`.
        tolerance: relative width of the last bracket [-].

    Returns:
        The end of the last bracket that stands [m].

    Raises:
        InvalidInput: no thickness makes it stand, or every one does, or build makes no structure.

    References:
        Milankovitch, Z. Math. Phys. 55 (1907) 1-27. Heyman, Int. J. Mech. Sci. 11 (1969) 363-372.

    Example:
        >>> def semicircle(t):
        ...     return af.circular_arch(radius=1.0, thickness=t, embrace=180.0, voussoirs=7)
        >>> round(af.minimum_thickness(semicircle, friction=None, tolerance=1e-4), 3)
        0.096
    """
    if not 1e-9 <= tolerance < 1.0:
        raise InvalidInput(f"tolerance {tolerance:.3g} is not between 1e-9 and 1")

    def holds(thickness: float) -> bool:
        return stands(build(thickness), friction=friction, strength=strength, fill=fill)

    low, high = _bracket(build, holds)
    while high - low > tolerance * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def _bracket(
    build: Callable[[float], Structure], holds: Callable[[float], bool]
) -> tuple[float, float]:
    """A thickness at which a family does not stand, and twice that, at which it does [m]."""
    thin = THINNEST * _size(build)
    if holds(thin):
        raise InvalidInput(
            f"it stands at any thickness, even {thin:.3g} m: there is no least one to look for"
        )
    while True:
        try:
            thick = holds(2.0 * thin)
        except InvalidStructure as error:
            return thin, _thickest(build, holds, thin, error)
        if thick:
            return thin, 2.0 * thin
        thin *= 2.0


def _thickest(
    build: Callable[[float], Structure],
    holds: Callable[[float], bool],
    low: float,
    refusal: InvalidStructure,
) -> float:
    """The greatest thickness that can be built, where twice a low one cannot; it must stand [m]."""
    high = 2.0 * low
    while high - low > LIMIT * high:
        middle = 0.5 * (low + high)
        try:
            build(middle)
            low = middle
        except InvalidStructure as error:
            high, refusal = middle, error
    if holds(low):
        return low
    raise InvalidInput(
        f"no thickness makes it stand: {low:.6g} m does not, and no greater one can be built "
        f"({refusal}): change the other lengths"
    ) from refusal


def _size(build: Callable[[float], Structure]) -> float:
    """Size of the first member of a family that can be built, from the thickest down [m]."""
    for thickness in 10.0 ** np.arange(2, -7, -1):
        try:
            built = build(float(thickness))
        except InvalidStructure as error:
            refusal = error
            continue
        instance(built, Structure, f"build({thickness:g})", "make a structure, thickness given")
        return built.size
    raise InvalidInput(f"build makes no structure 1e-6 to 100 m thick: {refusal}")
