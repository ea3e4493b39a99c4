"""Least thickness of structures, and least depth of joints that carries axles, by bisection."""

from collections.abc import Callable
from typing import Any

import numpy as np

from archfem._validation import check_between, check_type, validate_arguments
from archfem.errors import InvalidInput, InvalidStructure, logger
from archfem.limit.fill_range import FillAssumption, FillRange, vary_fill
from archfem.limit.fill_strength import Fill
from archfem.limit.instability import deepen
from archfem.limit.self_weight import (
    check_options,
    is_balanced,
    self_weight_programme,
    stands_as_given,
)
from archfem.limit.vehicles import MovingLoad
from archfem.masonry.loads import PointLoad
from archfem.masonry.structure import CONTACT_TOLERANCE, Structure, structure_of


@validate_arguments
def minimum_thickness(
    build: Callable[[float], Structure],
    *,
    friction: str | None = "coulomb",
    strength: float | None = None,
    fill: Fill | None = None,
    tolerance: float = 1e-6,
) -> float:
    """Find the least thickness at which a family of structures stands, by bisection [m].

    The search doubles a thickness of 1e-5 of the size of a thin structure until one stands, and
    then halves the bracket. A structure so thin that it cannot be built does not stand, such as
    unequal stones that no longer touch. A warning has the range over what is assumed of a fill.

    Args:
        build: function from a thickness [m] to the structure.
        friction: as for `collapse_factor`.
        strength: as for `collapse_factor` [Pa].
        fill: as for `collapse_factor`.
        tolerance: relative width of the last bracket [-].

    Returns:
        The end of the last bracket that stands [m].

    Raises:
        InvalidInput: no thickness makes it stand, or the least one tried does, or build makes no
            structure.

    References:
        Milankovitch, Z. Math. Phys. 55 (1907) 1-27. Heyman, Int. J. Mech. Sci. 11 (1969) 363-372.

    Example:
        >>> def semicircle(t):
        ...     return af.circular_arch(radius=1.0, thickness=t, embrace=180.0, voussoirs=7)
        >>> round(af.minimum_thickness(semicircle, friction=None, tolerance=1e-4), 3)
        0.096
    """
    check_between(tolerance, "tolerance", 1e-9, 1.0, ends="[)")

    def find(fill: Fill | None) -> float:
        def is_stable(built: Structure) -> bool:
            return stands_as_given(structure_of(built), friction, strength, fill)

        def is_enough(thickness: float) -> bool:
            built = _attempt(build, thickness)
            # what cannot be built is thinner than one that can, which stands
            return not isinstance(built, InvalidStructure) and is_stable(built)

        return _halve(*_find_bracket(build, is_stable), is_enough, tolerance)[1]

    least, values = find(fill), dict[FillAssumption, float]()
    for assumption, (_, other) in vary_fill(fill, pushed=False).items() if fill else ():
        try:
            values[assumption] = least if other == fill else find(other)
        except InvalidInput as error:
            logger.warning("the least thickness with %s is not known: %s", assumption, error)
    if len({f"{x:.4g}" for x in values.values()}) > 1:
        logger.warning("the least thickness is %s", FillRange(values).describe(name=" m"))
    return least


def _attempt(build: Callable[[float], Structure], thickness: float) -> Structure | InvalidStructure:
    """Return a structure of a thickness, or why it cannot be built."""
    try:
        return build(thickness)
    except InvalidStructure as error:
        return error


def _halve(
    low: float, high: float, is_high: Callable[[float], bool], tolerance: float
) -> tuple[float, float]:
    """Halve an interval to a relative tolerance, at whose upper end alone a condition holds."""
    while high - low > tolerance * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if is_high(middle) else (middle, high)
    return low, high


def _find_bracket(
    build: Callable[[float], Structure], is_stable: Callable[[Structure], bool]
) -> tuple[float, float]:
    """Return an unstable thickness and a stable one, at most twice as large [m]."""
    thin, is_start = _find_thin_member(build)
    if is_stable(build(thin)):
        if not is_start:
            return 0.5 * thin, thin
        raise InvalidInput(
            f"it stands at {thin:.3g} m, the least thickness tried, at which joints are hardly "
            "more than points: there is no least one to look for above it"
        )
    while not isinstance(built := _attempt(build, 2.0 * thin), InvalidStructure):
        if is_stable(built):
            return thin, 2.0 * thin
        thin *= 2.0

    def is_refused(thickness: float) -> bool:
        return isinstance(_attempt(build, thickness), InvalidStructure)

    # the largest one between that can be built must stand
    low, high = _halve(thin, 2.0 * thin, is_refused, 1e-9)
    if is_stable(build(low)):
        return thin, low
    refusal = _attempt(build, high)
    raise InvalidInput(
        f"no thickness makes it stand: {low:.6g} m does not, and no greater one can be built "
        f"({refusal}): change the other lengths"
    )


def _find_thin_member(build: Callable[[float], Structure]) -> tuple[float, bool]:
    """Return a thickness smaller than any built, or the least to be had [m]; whether it is one."""
    largest, size = _largest_member(build)
    # the largest may be all thickness: the search starts at a share of the size of a thin one
    _, member = _double_until_built(build, 1e-4 * size, largest)
    start = 10.0 * CONTACT_TOLERANCE * member.size
    thin, _ = _double_until_built(build, start, largest)
    return thin, thin == start


def _double_until_built(
    build: Callable[[float], Structure], thickness: float, largest: float
) -> tuple[float, Structure]:
    """Return the first thickness that can be built, and its structure."""
    while thickness < largest:
        # as of unequal stones that no longer touch
        if not isinstance(built := _attempt(build, thickness), InvalidStructure):
            return thickness, built
        thickness *= 2.0
    return largest, build(largest)


def _largest_member(build: Callable[[float], Structure]) -> tuple[float, float]:
    """Return the largest thickness that can be built, from 100 m down, and its size [m]."""
    for thickness in 10.0 ** np.arange(2, -7, -1):
        if not isinstance(built := _attempt(build, float(thickness)), InvalidStructure):
            remedy = "make a structure, thickness given"
            check_type(built, Structure, f"build({thickness:g})", remedy)
            return float(thickness), built.size
    raise InvalidInput(f"build makes no structure 1e-6 to 100 m thick: {built}")


def find_geometric_factor(
    structure: Structure, moving: MovingLoad, options: dict[str, Any], tolerance: float = 1e-4
) -> tuple[float, float]:
    """Return the depth of joints over the least one that carries the worst row of axles [-].

    Where none does, it is NaN, and the factor of the deepest joints follows.
    """
    stones, dead = self_weight_programme(structure, **options)
    axles = stones.load([load for load in moving.worst.live if isinstance(load, PointLoad)])

    def factor_of(share: float) -> float:
        changed = deepen(dead, share)
        if not is_balanced(changed.minimise_residual(), changed):
            return np.nan
        optimum = changed.with_load_factor(axles).solve()
        return np.inf if optimum is None else -optimum.value

    # what narrower joints carry wider ones carry, so that halving finds the least
    low, high = 0.0, 1.0
    while not moving.worst.factor >= 1.0 and not (found := factor_of(high)) >= 1.0:
        low, high = high, 2.0 * high
        if high > 1e3:  # no depth helps
            return np.nan, found
    while high - low > tolerance * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if factor_of(middle) >= 1.0 else (middle, high)
        if high < tolerance:
            return np.inf, np.nan
    return 1.0 / high, np.nan


def find_geometric_factors(
    structure: Structure, moving: MovingLoad, options: dict[str, Any]
) -> dict[str, float]:
    """Return both of `find_geometric_factor`, and the first without crushing, as of a rating."""
    own, deepest = find_geometric_factor(structure, moving, options)
    hard, crushes = own, check_options(structure, options["friction"], options["strength"]) < np.inf
    if crushes:
        hard, _ = find_geometric_factor(structure, moving, options | {"strength": np.inf})
    return {"geometric": own, "deepest": deepest, "geometric_hard": hard}
