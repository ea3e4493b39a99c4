"""Cause of a structure that does not stand under its own weight: support, friction or thickness.

Limit analysis of the weight is repeated with one property relaxed at a time. The property that
lets the structure stand is the cause, and the least change of it the remedy.
"""

from bisect import bisect_left
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations

import numpy as np
from scipy import sparse

from archfem._typing import Array
from archfem._validation import check_type
from archfem.errors import DidNotConverge, InvalidInput
from archfem.limit.backfill import attach_fill
from archfem.limit.fill_range import vary_pressure
from archfem.limit.fill_strength import Fill, PlasticFill, as_pressure
from archfem.limit.linear_programme import Programme, RigidBlocks
from archfem.limit.self_weight import (
    check_options,
    is_balanced,
    refuse_bonds,
    say_strength,
    self_weight_programme,
)
from archfem.masonry.block import Block, as_point, say_place
from archfem.masonry.structure import CONTACT_TOLERANCE, Structure, join_joint_names


@dataclass(frozen=True, eq=False)
class DeepenedBlocks(RigidBlocks):
    """Rigid blocks with joints deepened about their mid-points by a factor, at unchanged weight."""

    factor: float

    @property
    def balance(self) -> sparse.csr_matrix:
        """Equilibrium matrix of the free blocks for forces at the ends of the deepened joints."""
        count = len(self.structure.depths)
        # an end at ± f h/2 is the sum of (1 ± f)/2 of the forces at the ends at ± h/2
        near, far = (0.5 * (1.0 + s * self.factor) * sparse.identity(count) for s in (1.0, -1.0))
        shear = sparse.identity(count)
        ends = sparse.bmat([[near, far, None], [far, near, None], [None, None, shear]])
        return (RigidBlocks(self.structure).balance @ ends).tocsr()


def deepen(dead: Programme, factor: float) -> Programme:
    """Return the programme with joints deepened by a factor."""
    crushing = None if dead.crushing is None else factor * dead.crushing
    blocks, cohesion = DeepenedBlocks(dead.blocks.structure, factor), factor * dead.cohesion
    return replace(dead, blocks=blocks, cohesion=cohesion, crushing=crushing)


def explain_instability(structure: Structure) -> str | None:
    """Return why rigid blocks cannot rest under their weight, and the remedy; None if they can."""
    refuse_bonds(structure)
    stones, dead = self_weight_programme(structure, "coulomb", np.inf, None)
    fall = dead.minimise_residual()
    if is_balanced(fall, dead):
        return None
    intrados, extrados, slip = dead.blocks.gaps(dead.blocks.motion(fall.multipliers))
    moving = 1e-6 * np.abs([intrados, extrados, slip]).max()
    names = np.array([structure.joints[number].name for number in stones.rigid_regions.joints])
    sliding = join_joint_names(names[np.abs(slip) > moving])
    turning = join_joint_names(names[np.abs(extrados - intrados) > moving])
    rigid, speeds = dead.blocks.structure, np.abs(fall.multipliers.reshape(-1, 3)).max(axis=1)
    falling = np.array(rigid.free)[speeds > 1e-6 * speeds.max()]
    # depth, as a multiple of that given, and friction from which more does not help [-]
    unlimited = 1e3
    ways = [sliding and f"slide ({sliding})", turning and f"hinge ({turning})"]
    moves = f"joints {' and '.join(filter(None, ways))}"
    if cut := _name_cut_ring(structure):
        return f"{moves}: {cut}"
    if _stands(dead, friction=unlimited):
        least = _least_friction(dead, "friction", float(dead.blocks.structure.friction.min()), 10.0)
        text = f"joints slide ({sliding}): {_say_friction(least)}"
        if end := name_free_end(rigid, falling):
            return f"{text}; {end}"
        return text + ", and no thickness helps" * (not _stands(dead, depth=unlimited))
    if _stands(dead, depth=unlimited):
        least = _least_value(dead, "depth", 1.0, unlimited)
        return (
            f"joints hinge ({turning}): it stands if they are {least:.3g} times as deep, at the "
            "same weight; no friction helps"
        )
    missing = _name_interruption(rigid, falling)
    if _stands(dead, friction=unlimited, depth=unlimited):
        return f"{moves}: " + (
            missing
            or "a stone or a support is missing, or it needs both more friction and deeper joints"
        )
    block = rigid.blocks[rigid.free[int(speeds.argmax())]].name
    return missing or (
        f"no compression in its joints can hold '{block}', however deep and rough they are: add a "
        "support, or check the outline, and that the drawing is upright"
    )


# Coefficient of friction below which a least one is not sought, as no stone has it
_LITTLE_FRICTION = 0.05

# Share of the depth of joints below which a least one is not sought: a factor of safety of 20, or
# of 100 with a fill, whose weight holds the thrust line near the middle
_LITTLE_DEPTH, _LITTLE_DEPTH_WITH_FILL = 0.05, 0.01

# States of a fill in which a factor at rest is stated beside that of the fill as given
_FILL_STATES = {
    "without_pressure": "without its pressure",
    "full_pressure": "with all of its passive pressure",
    "without_backing": "without the backing",
    "without_either": "without backing and pressure",
    "active_alone": "with its active pressure alone",
    "active_without_backing": "with that alone and without backing",
}


@lru_cache(maxsize=8)
def least_friction(structure: Structure) -> float | None:
    """Return the coefficient of friction from which it stands, where no joint has more.

    None where it does not stand with its own, or limit analysis does not apply.
    """
    most = min(float(structure.friction.max(initial=0.0)), 1e3)
    return _find_least(structure, "cap", _LITTLE_FRICTION, most)


def geometric_factor(
    structure: Structure, strength: float | None = np.inf, *, fill: Fill | None = None
) -> float | None:
    """Find Heyman's geometric factor of safety of a structure at rest: of all joints at once.

    The joints become less deep about their middles, at the same weight, until a thrust line
    within them exists no more. For a ring of constant thickness that is the factor on its
    thickness. Piers take part, which `minimum_thickness` of their ring leaves out.

    Args:
        structure: structure with its friction and cohesion.
        strength: as for `collapse_factor`, where the joints crush [Pa]; they do not by default.
        fill: as for `collapse_factor`. It weighs, and presses on the faces as built.

    Returns:
        Depth of the joints over the least one [-], at most 1e-3 of it too small; 20 where it is
        that or more, or 100 with a fill; None where the structure does not stand, or joints with
        bonds have no such factor.

    Raises:
        InvalidInput: bodies too soft to be rigid are without the strength of a fill.

    References:
        Heyman, Int. J. Mech. Sci. 11 (1969) 363-385.

    Example:
        >>> ring = af.circular_arch(radius=1.0, thickness=0.2, embrace=180.0, voussoirs=17)
        >>> round(af.limit.geometric_factor(ring), 2)
        1.89
    """
    check_type(structure, Structure, "structure", "give one, e.g. circular_arch(…)")
    strength = check_options(structure, "coulomb", strength)
    attach_fill(structure, fill)  # refuses a fill without its strength
    return _find_geometric_factor(structure, strength, fill)


@lru_cache(maxsize=32)
def _find_geometric_factor(
    structure: Structure, strength: float | None, fill: Fill | None
) -> float | None:
    """Return `geometric_factor`; None also where it is refused."""
    low = _LITTLE_DEPTH if fill is None else _LITTLE_DEPTH_WITH_FILL
    least = _find_least(structure, "depth", low, 1.0, strength, fill)
    return None if least is None else 1.0 / least


def find_factors_at_rest(
    structure: Structure, strength: float | None, fill: Fill | PlasticFill | None
) -> dict[str, float]:
    """Return geometric factors in the states of a fill, by their words; as given first, by "" [-].

    One is 0 where the structure does not stand; there is none where it stands in no state.
    """
    given = as_pressure(fill)
    states = {"": given} | ({} if given is None else vary_pressure(given))
    found = {key: _find_geometric_factor(structure, strength, x) for key, x in states.items()}
    known = {_FILL_STATES.get(key, key): factor or 0.0 for key, factor in found.items()}
    return known if any(known.values()) else {}


def _find_least(
    structure: Structure,
    name: str,
    low: float,
    high: float,
    strength: float | None = np.inf,
    fill: Fill | None = None,
) -> float | None:
    """Return the least value of a property with which it stands, from `low` on."""
    try:
        refuse_bonds(structure)
        _, dead = self_weight_programme(structure, "coulomb", strength, fill)
        if _stands(dead, **{name: low}):
            return low
        find = _least_friction if name == "cap" else _least_value
        return find(dead, name, low, high) if _stands(dead) else None
    except (InvalidInput, DidNotConverge):  # soft bodies, bonds
        return None


def describe_friction(structure: Structure) -> str:
    """Describe the friction from which a structure stands; empty where it is not known."""
    if (least := least_friction(structure)) is None:
        return ""
    less = " or less" if least == _LITTLE_FRICTION else ""
    return f"{_say_friction(least)}{less}"


def describe_geometric_factor(
    structure: Structure, strength: float | None, fill: Fill | PlasticFill | None = None
) -> str:
    """Describe the geometric factor of safety at rest, with its range over a fill; "" for none."""
    factors = find_factors_at_rest(structure, strength, fill)
    if not factors:
        return ""
    said = {key: _say_factor(factor, fill) for key, factor in factors.items()}
    factor, first = factors[""], said.pop("")
    hard = _say_factor(find_factors_at_rest(structure, np.inf, fill)[""], fill)
    crushing = say_strength(structure, strength, hard)
    pieces = ", those of the fill too," * any(block.grain for block in structure.blocks)
    if factor:
        depth = f"all joints{pieces} {1.0 / factor:.3g} times as deep"
        first += f", as it stands with {depth} under the same weight"
    others = f"; {', '.join(f'{x} {key}' for key, x in said.items())}" * bool(said)
    of = " with the fill" * (fill is not None)
    return f"geometric factor of safety at rest{of}, {crushing}: {first}{others}"


def list_margins_at_rest(
    structure: Structure, strength: float | None, fill: Fill | PlasticFill | None = None
) -> Iterator[tuple[float, str]]:
    """Yield the factors of safety at rest of stones that are known, and what they are of."""
    if any(block.grain for block in structure.blocks):
        return
    factors = find_factors_at_rest(structure, strength, fill)
    if 0.0 < (depth := min(factors.values(), default=0.0)) < 1.0 / _LITTLE_DEPTH:
        over = ", the least over what is assumed of its fill" * (len(factors) > 1)
        hard = min(find_factors_at_rest(structure, np.inf, fill).values())
        crushing = say_strength(structure, strength, _say_factor(hard, fill))
        yield depth, f"the depth of its joints under the same weight, {crushing}{over}"
    if (least := least_friction(structure)) and least > _LITTLE_FRICTION:
        yield float(structure.friction.max()) / least, "the friction of its joints"


def _say_factor(factor: float, fill: Fill | PlasticFill | None) -> str:
    """Say a factor of safety on the depth of joints, "none" for 0."""
    most = 1.0 / (_LITTLE_DEPTH if fill is None else _LITTLE_DEPTH_WITH_FILL)
    return f"{factor:.3g}{' or more' * (factor >= most)}" if factor else "none"


def _say_friction(least: float) -> str:
    """Say from which friction it stands."""
    return f"it stands from a coefficient of friction of {least:g}"


def name_free_end(structure: Structure, falling: Collection[int]) -> str:
    """Return where pieces of a fill fall out of an end of it that nothing holds; "" for nowhere."""
    points = {k: block.points for k, block in enumerate(structure.blocks) if block.grain}
    if not points:
        return ""
    along = np.concatenate([*points.values()])[:, 0]
    near = CONTACT_TOLERANCE * structure.size
    for end in (along.min(), along.max()):
        beside = {k for k, corners in points.items() if np.sum(abs(corners[:, 0] - end) < near) > 1}
        held = {
            number
            for joint in structure.joints
            if np.ptp(joint.ends[:, 0]) < near and abs(joint.middle[0] - end) < near
            for number in joint.blocks
        }
        if (beside - held) & {*falling}:
            return (
                f"pieces of the fill fall out of its free end at x = {end:.2f} m, which more "
                "cohesion would hold, or a wall as high as the fill (`above` of the sidewalls of a "
                "bridge)"
            )
    return ""


def _name_cut_ring(structure: Structure) -> str:
    """Return where a stone of a ring is missing between two others; empty for nowhere."""
    blocks, owners = structure.blocks, [joint.role != "other" for joint in structure.joints]
    across = np.bincount(structure.pairs[owners].ravel(), minlength=len(blocks))
    ends = [k for k in structure.free if blocks[k].role == "ring" and across[k] < 2]
    for one, other in combinations(ends, 2):
        size = np.hypot(*np.ptp(blocks[one].points, axis=0))
        near = blocks[one].distance_to(blocks[other]) <= 1.5 * size
        if near and blocks[one].part == blocks[other].part:
            return f"the ring {_say_gap(blocks[one], blocks[other])}"
    return ""


def _say_gap(block: Block, other: Block) -> str:
    """Return that something is interrupted between two stones, and the remedy."""
    gap, stone = block.distance_to(other), np.ptp(block.points, axis=0).min()
    remedy = "add the stone between them, which may be on an ignored layer"
    if gap < 0.25 * stone:
        remedy = "close the joint between them, by faces that touch"
    place = say_place(as_point(block.centroid))
    return f"is interrupted, {gap:.3g} m from '{block.name}' at {place} to '{other.name}': {remedy}"


def _name_interruption(structure: Structure, moving: Sequence[int]) -> str:
    """Return where a chain of moving blocks ends: at a gap, or at nothing; empty if nowhere."""
    near: dict[int, set[int]] = {number: set() for number in range(len(structure.blocks))}
    for one, other in structure.pairs:
        near[one].add(int(other))
        near[other].add(int(one))
    blocks = structure.blocks
    # a block that touches a support alone may hang below it, and ends no chain
    ends = [n for n in moving if len(near[n]) == 1 and not any(blocks[k].fixed for k in near[n])]
    for end in ends:
        own = (end, *near[end], *_find_supports(structure, near, [end]))
        others = [n for n in near if n not in own]
        others = [n for n in others if blocks[n].fixed or len(near[n]) == 1]
        gaps = {n: blocks[end].distance_to(blocks[n]) for n in others}
        other = min(gaps, key=gaps.__getitem__, default=end)
        # a missing stone is hardly larger than the one beside it
        if other != end and gaps[other] <= 1.5 * np.hypot(*np.ptp(blocks[end].points, axis=0)):
            return f"it {_say_gap(blocks[end], blocks[other])}"
    if not ends:
        return ""
    named = [f"'{blocks[n].name}' at {say_place(as_point(blocks[n].centroid))}" for n in ends]
    held = _find_supports(structure, near, ends)
    only = f", and only '{blocks[held[0]].name}' holds the others" if len(held) == 1 else ""
    rest = f"{' and '.join(named[:2])} rest{'s' * (len(ends) == 1)} on nothing"
    return f"{rest}{only}: add a support, or the stones that are missing"


def _find_supports(
    structure: Structure, near: Mapping[int, set[int]], starts: Sequence[int]
) -> list[int]:
    """Return the fixed blocks that blocks touch, themselves or through others that move."""
    found, left = set(starts), list(starts)
    while left:
        number = left.pop()
        if not structure.blocks[number].fixed:
            left += near[number] - found
            found |= near[number]
    return sorted(number for number in found if structure.blocks[number].fixed)


def _stands(
    dead: Programme,
    friction: float | None = None,
    depth: float = 1.0,
    cap: float = np.inf,
    enough: float = 1e-3,
) -> bool:
    """Return whether blocks stand with friction in a range, and joints deepened by a factor.

    A bound of the residual above `enough` suffices [mean block weights].
    """
    coefficient: Array = dead.blocks.structure.friction
    if friction is not None:
        coefficient = np.maximum(coefficient, friction)
    relaxed = replace(deepen(dead, depth), friction=np.minimum(coefficient, cap))
    return is_balanced(relaxed.minimise_residual(enough), relaxed)


def _least_friction(dead: Programme, name: str, lower: float, upper: float) -> float:
    """Return the least thousandth of friction with which blocks stand, whatever the range."""
    first, last = (int(np.ceil(1e3 * value)) for value in (lower, upper))
    tried = range(first, last)
    found = bisect_left(tried, True, key=lambda k: _stands(dead, **{name: k / 1e3}))
    return (first + found) / 1e3


def _least_value(
    dead: Programme, name: str, lower: float, upper: float, enough: float = 1e-3
) -> float:
    """Return the least value of a property with which blocks stand, by bisection."""
    precision = 1e-3
    if dead.crushing is not None and enough > 0.0:
        # crushing cuts of states take long: upwards from where the first bound lets blocks stand
        lower = least = _least_value(dead, name, lower, upper, -np.inf)
        step = precision
        while not _stands(dead, **{name: least}):
            lower, least, step = least, min(upper, least * (1.0 + step)), 2.0 * step
        upper = least
    while upper > (1.0 + precision) * max(lower, precision):
        middle = 0.5 * (lower + upper)
        if upper > 4.0 * max(lower, precision):  # far apart: by the geometric mean
            middle = float(np.sqrt(max(lower, precision) * upper))
        stands = _stands(dead, **{name: middle}, enough=enough)
        lower, upper = (lower, middle) if stands else (middle, upper)
    return upper
