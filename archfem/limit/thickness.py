"""Least thickness of structures, and least depth of joints that carries axles, by bisection."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from archfem._validation import check_between, check_type, validate_arguments
from archfem.errors import InvalidInput, InvalidStructure
from archfem.limit.collapse import stands
from archfem.limit.fill_strength import Fill
from archfem.limit.instability import DeepenedBlocks
from archfem.limit.self_weight import is_balanced, self_weight_programme
from archfem.limit.vehicles import MovingLoad
from archfem.masonry.loads import PointLoad
from archfem.masonry.structure import CONTACT_TOLERANCE, Structure


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
    unequal stones that no longer touch.

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

    def is_stable(thickness: float) -> bool:
        return stands(build(thickness), friction=friction, strength=strength, fill=fill)

    low, high = _find_bracket(build, is_stable)
    while high - low > tolerance * high:
        middle = 0.5 * (low + high)
        try:
            stable = is_stable(middle)
        except InvalidStructure:  # thinner than one that can be built, which stands
            stable = False
        low, high = (low, middle) if stable else (middle, high)
    return high


def _find_bracket(
    build: Callable[[float], Structure], is_stable: Callable[[float], bool], tolerance: float = 1e-9
) -> tuple[float, float]:
    """Return an unstable thickness and a stable one, at most twice as large [m]."""
    thin, is_start = _find_thin_member(build)
    if is_stable(thin):
        if not is_start:
            return 0.5 * thin, thin
        raise InvalidInput(
            f"it stands at {thin:.3g} m, the least thickness tried, at which joints are hardly "
            "more than points: there is no least one to look for above it"
        )
    while True:
        try:
            if is_stable(2.0 * thin):
                return thin, 2.0 * thin
        except InvalidStructure as error:
            refusal = error
            break
        thin *= 2.0
    low, high = thin, 2.0 * thin  # the largest one between that can be built must stand
    while high - low > tolerance * high:
        middle = 0.5 * (low + high)
        try:
            build(middle)
            low = middle
        except InvalidStructure as error:
            high, refusal = middle, error
    if is_stable(low):
        return thin, low
    raise InvalidInput(
        f"no thickness makes it stand: {low:.6g} m does not, and no greater one can be built "
        f"({refusal}): change the other lengths"
    ) from refusal


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
        try:
            return thickness, build(thickness)
        except InvalidStructure:  # as of unequal stones that no longer touch
            thickness *= 2.0
    return largest, build(largest)


def _largest_member(build: Callable[[float], Structure]) -> tuple[float, float]:
    """Return the largest thickness that can be built, from 100 m down, and its size [m]."""
    for thickness in 10.0 ** np.arange(2, -7, -1):
        try:
            built = build(float(thickness))
        except InvalidStructure as error:
            refusal = error
            continue
        check_type(built, Structure, f"build({thickness:g})", "make a structure, thickness given")
        return float(thickness), built.size
    raise InvalidInput(f"build makes no structure 1e-6 to 100 m thick: {refusal}")


def find_geometric_factor(
    structure: Structure, moving: MovingLoad, options: dict[str, Any], tolerance: float = 1e-4
) -> tuple[float, float]:
    """Return the depth of joints over the least one that carries the worst row of axles [-].

    Where none does, it is NaN, and the factor of the deepest joints follows.
    """
    stones, dead = self_weight_programme(structure, **options)
    axles = stones.load([load for load in moving.worst.live if isinstance(load, PointLoad)])

    def factor_of(share: float) -> float:
        blocks = DeepenedBlocks(dead.blocks.structure, share)
        crushing = None if dead.crushing is None else share * dead.crushing
        changed = replace(dead, blocks=blocks, cohesion=share * dead.cohesion, crushing=crushing)
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
