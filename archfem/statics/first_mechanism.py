"""First mechanism of stones at rest: their loads, the joints that may open, and the least factor.

A fill becomes weights that are attached to the stones below, and pressures on their faces.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from archfem._typing import Array
from archfem.errors import InvalidInput
from archfem.limit.backfill import BlocksWithFill, FillProfile
from archfem.limit.displaced_blocks import (
    FillPressure,
    KinematicChain,
    PlacedBlocks,
    find_mechanism,
    find_tie_shares,
)
from archfem.limit.linear_programme import NoEquilibrium
from archfem.limit.mechanism_kinematics import find_rigid_regions
from archfem.masonry.loads import AttachedLoad
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure, join_names
from archfem.units import kN


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
            "an assessment takes no axles on an elastic fill, on which a vehicle leans: give each "
            "axle to the stone below it as a weight of `loads`, times the width of the structure "
            "over that of the vehicle, cut the fill into pieces, or push it by `archfem limit`"
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


def find_first_mechanism(
    placed: PlacedBlocks, joints: list[int], coefficient: Array
) -> KinematicChain | None:
    """Return the mechanism of least factor at rest; None where there is none."""
    why = "af.stands and `archfem check` say why"
    if any(any(load.force) and not load.passive for load in placed.loads):
        why = "their forces act whole; a tie, which bears up to its force, is `passive = true`"
    refusal = DoesNotStand(
        f"{placed.structure.name} does not stand under its own weight and the attached loads: {why}"
    )
    # At rest constant forces may be missing: a tie pulls only once the mechanism moves.
    weights = tuple(replace(load, force=(0.0, 0.0)) for load in placed.loads)
    opposite = replace(placed, loads=weights, direction=-placed.direction)
    try:
        mechanism = find_mechanism(placed, joints, coefficient)
        # The least factor in the other direction is below zero where it stands only if pushed.
        others = [find_mechanism(opposite, joints, coefficient)]
    except NoEquilibrium as error:
        raise refusal from error
    if any(found is not None and found.factor <= 1e-9 for found in (mechanism, *others)):
        raise refusal
    return mechanism


def describe_ties(
    placed: PlacedBlocks, joints: list[int], coefficient: Array, factor: float
) -> str:
    """Describe the forces of the ties at a factor; empty without ties."""
    if not placed.ties:
        return ""
    shares, needs = find_tie_shares(placed, joints, coefficient, factor), []
    for share, (block, _, force) in zip(shares, placed.ties, strict=True):
        size, name = np.hypot(*force) / kN, placed.structure.blocks[block].name
        need = f"{share * size:.4g}" if share > 1e-4 else "none"
        needs.append(f"{need} of the {size:.4g} kN of the tie at {name}")
    side = "right" if placed.direction > 0.0 else "left"
    return f"pushed to the {side}, alpha_0 needs {join_names(needs)}"
