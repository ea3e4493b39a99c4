"""First mechanism of stones at rest: their loads, the joints that may open, and the least factor.

A fill becomes weights that are attached to the stones below, and pressures on their faces.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from archfem._typing import Array
from archfem.errors import InvalidInput
from archfem.limit import displaced_blocks
from archfem.limit.backfill import BlocksWithFill, FillProfile
from archfem.limit.collapse import collapse_factor
from archfem.limit.displaced_blocks import (
    BREAKING_STRAIN,
    FillPressure,
    KinematicChain,
    PlacedBlocks,
    Tie,
)
from archfem.limit.finite_mechanism import MechanismPath
from archfem.limit.linear_programme import NoEquilibrium
from archfem.limit.mechanism_kinematics import find_rigid_regions
from archfem.limit.self_weight import joint_strengths
from archfem.masonry.loads import AttachedLoad, BodyForce, name_side
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure, join_names, list_stack
from archfem.models.model import Doubt
from archfem.statics.assessment_checks import UPPER_BOUND, measure_blocks
from archfem.units import MPa, format_mm, kN

# Stretch from which a tie whose free length is not known is doubted, that of 2 m [m]
MAX_STRETCH = 2.0 * BREAKING_STRAIN

# Begin of the note on the forces of ties, which is the same of all mechanisms
OF_TIES = "forces of ties are "

# Load over the weight of the lightest block, below which its unit is probably wrong [-]
TINY_LOAD = 0.01

# Slope up to which a joint is a level bed [-]
LEVEL_BED = 0.05

# Rounds of thrusts and hinges, of which two or three usually suffice
MAX_ROUNDS = 40


class DoesNotStand(InvalidInput):
    """The structure does not stand under its own weight and the attached loads."""


def take_fill_as_loads(
    structure: Structure, lever: float
) -> tuple[Structure, tuple[AttachedLoad, ...]]:
    """Return the stones without yielding bodies, and the weight of these on each stone."""
    if not find_yielding_blocks(structure):
        return structure, ()
    regions = find_rigid_regions(structure)
    stones = np.isin(np.arange(len(structure.blocks)), regions.blocks)
    columns = FillProfile(structure, stones).columns(lever)
    if columns.lean.any():
        raise InvalidInput(
            "an assessment takes no axles on a fill, on which a vehicle leans: push it by `archfem "
            "limit`, which compares it with the site's acceleration, or run motions on a fill in "
            "pieces; as weights of `loads`, axles do not press the fill against the stones, and "
            "ratios were up to 2.4 times too high; as bodies by `weight` none leans on the others, "
            "and pushes were 0.7 to 1.2 times those of axles"
        )
    loads = []
    for number in np.unique(columns.stone):
        own = columns.stone == number
        weight = columns.weight[own]
        if not structure.blocks[number].fixed and weight.sum() > 0.0:
            x, y = np.average(columns.place[own], axis=0, weights=weight)
            name = structure.blocks[number].name
            loads.append(AttachedLoad(name, (float(x), float(y)), float(weight.sum())))
    return regions.structure, tuple(loads)


def press_stones(filled: BlocksWithFill) -> FillPressure:
    """Return the forces of a fill on the stones, from its active pressure to its passive one."""
    contacts, width = filled.contacts, filled.whole.width
    ranges = contacts.least, contacts.most - contacts.least
    points, forces = zip(*(contacts.thrust(each, width) for each in ranges), strict=True)
    return FillPressure(contacts.block, np.array(points), np.array(forces), contacts.shared)


def select_joints(
    structure: Structure, part: str | None, blocks: Sequence[int | str] | None
) -> list[int]:
    """Return the joints that may open or slip."""
    if part is not None and blocks is not None:
        raise InvalidInput("part and blocks are both given: name either a part or its blocks")
    if part is not None:
        parts = list(dict.fromkeys(structure.blocks[k].part for k in structure.free))
        if part not in parts:
            raise InvalidInput(f"there is no part {part!r} that moves: use one of {parts}")
        chosen = {k for k in structure.free if structure.blocks[k].part == part}
    elif blocks is not None:
        chosen = {structure.block_number(block) for block in blocks} & set(structure.free)
        if not chosen:
            raise InvalidInput(
                f"blocks {list(blocks)} has none that moves: name some of "
                f"{join_names([structure.blocks[k].name for k in structure.free])}"
            )
    else:
        chosen = set(structure.free)
    return [k for k, pair in enumerate(structure.pairs.tolist()) if chosen & set(pair)]


def find_weakest_bodies(
    structure: Structure,
    loads: Sequence[AttachedLoad],
    direction: float,
    rate: Callable[[float, Array, Array], tuple[float, ...]],
) -> dict[int, list[int]]:
    """Return bed and blocks of each part of a stack of stones above a bed that has a least ratio.

    It turns about the toe of the bed as one body: a*(d*) is straight from α₀ g to an arm, that of
    its weight, with the moment of forces and ties over the weight. Of such a curve at a height
    above the ground `rate` returns the ratios. None unless it is a stack.
    """
    stack = None if find_yielding_blocks(structure) else list_stack(structure)
    if stack is None:
        return {}
    lows = structure.ends[..., 1].min(axis=1)
    ground = lows[stack[0][0]] - (structure.above or 0.0)
    placed, found = PlacedBlocks.at_rest(structure, loads, direction), []
    for k, (bed, _) in enumerate(stack):
        own = [block for _, block in stack[k:]]
        toe = max(structure.ends[bed], key=lambda end: direction * end[0])
        masses = [
            (weight, *(place - toe)) for block, place, weight in placed.masses if block in own
        ]
        weight, x, y = np.array(masses).T
        moment = -direction * (weight @ x)
        for block, place, load in placed.attached:
            (right, up), force = place - toe, load.force
            resists = direction * (force[1] * right - force[0] * up) * (block in own)
            moment += max(resists, 0.0) if load.passive else resists
        curve = [0.0, moment / weight.sum()], [structure.gravity * moment / (weight @ y), 0.0]
        found.append((rate(float(lows[bed] - ground), *map(np.array, curve)), bed, own))
    least = np.array([ratios for ratios, _, _ in found]).argmin(axis=0)
    return dict(found[k][1:] for k in least)


def find_first_mechanism(
    placed: PlacedBlocks, joints: list[int], coefficient: Array, strength: float
) -> tuple[PlacedBlocks, KinematicChain | None]:
    """Return the blocks with crushed edges, and their mechanism of least factor, if any."""
    why = "af.stands and `archfem check` say why"
    if any(any(load.force) and not load.passive for load in placed.loads):
        why = "their forces act whole; a tie, which bears up to its force, is `passive = true`"
    crushed = f" where joints crush at {strength / MPa:.3g} MPa" * bool(np.isfinite(strength))
    refusal = DoesNotStand(
        f"{placed.structure.name} does not stand under its own weight and the attached "
        f"loads{crushed}: {why}"
    )
    # At rest constant forces may be missing: a tie pulls only once the mechanism moves.
    weights = tuple(replace(load, force=(0.0, 0.0)) for load in placed.loads)
    try:
        placed = _crush_edges(placed, joints, coefficient, strength)
        opposite = replace(placed, loads=weights, direction=-placed.direction)
        mechanism = displaced_blocks.find_mechanism(placed, joints, coefficient)
        # The least factor in the other direction is below zero where it stands only if pushed.
        others = [displaced_blocks.find_mechanism(opposite, joints, coefficient)]
    except NoEquilibrium as error:
        raise refusal from error
    if any(found is not None and found.factor <= 1e-9 for found in (mechanism, *others)):
        raise refusal
    return placed, mechanism


def _crush_edges(
    placed: PlacedBlocks, joints: list[int], coefficient: Array, strength: float
) -> PlacedBlocks:
    """Return the blocks with hinges at the resultants of edges that crush, N / (2 w f) inside."""
    structure = placed.structure
    forces = joint_strengths(structure, strength) * structure.width * structure.depths
    shares = np.zeros(len(forces))  # N / (w f h), of the state with the hinges before
    for number in range(MAX_ROUNDS if np.isfinite(strength) else 0):
        before, shares = shares, displaced_blocks.find_thrusts(placed, joints, coefficient) / forces
        if number > 5:  # where many states are optimal, each round may find another one
            shares = np.maximum(shares, before)
        if (np.abs(shares - before) <= 1e-4).all():
            break
        placed = placed.set_back(0.5 * structure.depths * np.minimum(shares, 0.999))
    if (shares >= 0.999).any():
        raise NoEquilibrium("joints crush over their whole depth")
    return placed


def search_flat(
    placed: PlacedBlocks, joints: list[int], first: KinematicChain, friction: str | None
) -> tuple[KinematicChain, Doubt | None]:
    """Return the mechanism of the search without dilatancy, or the first, and a doubt."""
    structure = placed.structure
    dilates = Doubt(
        "faces dilate as this mechanism slides: alpha_0 = {:.4g} is {}",
        "a search without dilatancy takes no part, loads and fill",
        (first.factor, UPPER_BOUND),
    )
    if len(joints) < len(structure.joints) or placed.loads:
        if friction == "nonassociated":
            raise InvalidInput(
                "friction 'nonassociated' is searched for the whole structure only: leave out "
                "part and blocks, or use 'coulomb'"
            )
        return first, dilates
    inwards = placed.setback[:, None] * structure.tangents
    ends = structure.ends[:, 0] + inwards, structure.ends[:, 1] - inwards
    dry = [
        replace(x, contact=replace(x.contact, cohesion=0.0), intrados=one, extrados=other)
        for x, one, other in zip(structure.joints, *ends, strict=True)
    ]
    wall, live = replace(structure, joints=tuple(dry)), BodyForce(placed.direction)
    found = collapse_factor(wall, live=live, friction="nonassociated", strength=np.inf)
    if not np.isfinite(found.factor):
        words = "a search without dilatancy found none: hold a motion"
        return first, replace(dilates, remedy=words)
    contacts, doubt = placed.touching(joints), None
    moves = found.motion, np.zeros(len(contacts)), contacts, found.factor  # nothing dilates
    if found.solutions is not None and found.solutions.may_be_less:
        doubt = Doubt(
            "alpha_0 is {}, the least that a search without dilatancy found, and a weaker "
            "mechanism may exist; a tenth below it is {:.3g} g",
            "hold such a push by [motion] held",
            (UPPER_BOUND, 0.9 * found.factor),
        )
    return displaced_blocks.classify_motion(placed, joints, *moves), doubt


def describe_ties(
    placed: PlacedBlocks, joints: list[int], coefficient: Array, factor: float
) -> str:
    """Describe the forces of the ties at a factor; empty without ties."""
    if not placed.ties:
        return ""
    shares, needs = displaced_blocks.find_tie_shares(placed, joints, coefficient, factor), []
    for share, tie in zip(shares, placed.ties, strict=True):
        size = tie.size / kN
        need = f"{share * size:.4g}" if share > 1e-4 else "none"
        needs.append(f"{need} of the {size:.4g} kN of the tie at {tie.name}")
    side, listed = name_side(placed.direction), join_names(needs)
    split = ", or another split" * bool(len(needs) > 1 and max(shares) > 1e-4)
    return f"pushed to the {side}, alpha_0 needs {listed}{split}"


def describe_tied_length(structure: Structure) -> str:
    """Say for which length of a wall the forces of ties are, and that they are without a factor."""
    of = "width" if structure.above is None else "wall at its foot"
    return f"in all for {structure.width:g} m of {of}, without a factor on the tie"


def find_foot(structure: Structure, path: MechanismPath | None) -> float:
    """Return the height above the ground of the foot of what moves, of rings their springings [m].

    The ground is that of the fixed blocks, on the next level below.
    """
    lows, joints = structure.ends[..., 1].min(axis=1), structure.joints
    moved = {contact.joint for contact in path.mechanisms[0].contacts} if path else set()
    # level beds are of rings by default, and of their feet
    steep = [k for k in moved if abs(structure.normals[k, 0]) > LEVEL_BED]
    rings = {joints[k].part for k in steep if joints[k].role == "ring"}
    moved |= {k for k, each in enumerate(joints) if each.role == "ring" and each.part in rings}
    foot = min(lows[[*moved]], default=lows.min())
    on_ground = ~np.isin(structure.pairs, structure.free).all(axis=1) & (lows <= foot)
    ground = lows[on_ground].max(initial=lows.min())
    return float(foot - ground) + (structure.above or 0.0)


def find_stretches(
    path: MechanismPath | None, moved: Array, share: float
) -> list[tuple[Tie, float]]:
    """Return each tie and its largest stretch up to a share of a displacement on a path [m]."""
    if path is None or len(moved) == 1:
        return []
    place = share * moved[-1], np.maximum.accumulate(moved)
    # a hundredth of a millimetre is round-off
    sizes = [round(float(np.interp(*place, each)), 5) for each in path.stretches.T]
    return list(zip(path.blocks.ties, sizes, strict=True))


def doubt_stretches(stretches: Sequence[tuple[Tie, float]]) -> list[Doubt]:
    """Return the doubts about ties that are stretched further than a short bar bears."""
    words = (
        "at the capacity the tie at {} is stretched by {:mm}, by which iron that bears 2 % breaks "
        "unless {:.3g} m of bar are free: the displacement check is {}"
    )
    remedy = "verify its free length, and give it as `free_length`"
    return [
        Doubt(words, remedy, (tie.name, size, size / BREAKING_STRAIN, UPPER_BOUND))
        for tie, size in stretches
        if size > MAX_STRETCH and tie.limit == np.inf
    ]


def doubt_loads(placed: PlacedBlocks, loads: Sequence[AttachedLoad]) -> list[Doubt]:
    """Return doubts about tiny loads, and ties to the ground that pull towards each other."""
    own, found = placed.masses[: len(placed.structure.blocks)], list[Doubt]()
    least = min(weight for block, _, weight in own if block in placed.structure.free)
    for load in loads:
        if (size := float(np.hypot(*load.force)) + load.weight) < TINY_LOAD * least:
            tiny = "the load at {} is {:.3g} N, below 1 % of the lightest block, {:.3g} kN"
            remedy = 'give its unit, as in "9 kN"'
            found.append(Doubt(tiny, remedy, (str(load.block), size, least / kN)))
    words = (
        "the ties at {} and {} pull towards each other, and each counts as held by the ground: a "
        "bar between both blocks holds neither to the ground"
    )
    for one, other in combinations(placed.ties, 2):
        chord = other.place - one.place
        pulls = np.array([one.force @ chord, -(other.force @ chord)]) / np.hypot(*chord)
        sizes = [tie.size for tie in (one, other)]
        held = one.anchor is other.anchor is None and one.block != other.block
        if held and (pulls > 0.99 * np.array(sizes)).all():  # within 8° of the chord
            remedy = "give one tie with `anchor` and `anchor_point`"
            found.append(Doubt(words, remedy, (one.name, other.name)))
    return found


def describe_loads(
    path: MechanismPath,
    loads: Sequence[AttachedLoad],
    ties: str,
    stretches: Sequence[tuple[Tie, float]],
) -> list[str]:
    """Describe loads along the motion: fill, ties and constant forces; and masses far away."""
    found, placed, pulls = list[str](), path.blocks, path.pulls
    if placed.fill is not None:
        found.append(
            "all along the motion the pressures of the fill on the stones are those of the "
            "weights as built: that the fill stays in place is not checked"
        )
    if ties:
        known = [f" (it breaks at {format_mm(x.limit)})" * (x.limit < np.inf) for x, _ in stretches]
        sizes = zip(stretches, known, strict=True)
        at = ", ".join(f"{format_mm(size)} at {tie.name}{more}" for (tie, size), more in sizes)
        each = zip(pulls, placed.ties, strict=len(pulls) > 0)  # none where nothing moves on
        held = [f"{pull / kN:.4g} kN at {x.name}" for pull, x in each if pull > 1e-4 * x.size]
        ties += f"; up to the capacity stretched by {at}" * bool(at)
        ties += f"; where its length is kept pulling up to {join_names(held)}" * bool(held)
        found += [
            ties,
            f"{OF_TIES}{describe_tied_length(placed.structure)}, those of alpha_0 as it begins to "
            "move, none to design for; along the motion a tie pulls with all of its force where it "
            "gets longer than it ever was, with what equilibrium needs where it keeps its length, "
            "and else with none: verify bar and anchor",
        ]
    if forces := [load.force for load in loads if any(load.force) and not load.passive]:
        pushes = any(force[0] * placed.direction > 0.0 for force in forces)
        found.append(
            "constant forces have no mass, so that they are not pushed, and count from the start "
            "of the motion to its end; attach only those whose presence is verified up to collapse"
            + ("; one pushes in this sense: a tie is `passive = true`" * pushes)
        )
    far = []
    for load in loads:
        block = placed.structure.blocks[placed.structure.block_number(load.block)]
        away = block.distance_to(load.point)
        if load.weight and away > measure_blocks(block):
            far.append(f"{load.weight / kN:.4g} kN {away:.3g} m from {block.name}")
    if far:
        words = "masses act further from their blocks than these are large"
        found.append(f"{words}, {join_names(far)}: verify their points")
    return found
