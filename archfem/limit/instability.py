"""Cause of a structure that does not stand under its own weight: support, friction or thickness.

Limit analysis of the weight is repeated with one property relaxed at a time. The property that
lets the structure stand is the cause, and the least change of it the remedy.
"""

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from archfem._typing import Array
from archfem.limit.backfill import is_balanced, refuse_bonds, self_weight_programme
from archfem.limit.linear_programme import Programme, RigidBlocks
from archfem.masonry.block import as_point, say_place
from archfem.masonry.structure import Structure, join_joint_names


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


def explain_instability(structure: Structure) -> str | None:
    """Return why rigid blocks cannot rest under their weight, and the remedy; None if they can."""
    refuse_bonds(structure)
    stones, dead = self_weight_programme(structure, "coulomb", None, None)
    fall = dead.minimise_residual()
    if is_balanced(fall, dead):
        return None
    intrados, extrados, slip = dead.blocks.gaps(dead.blocks.motion(fall.multipliers))
    moving = 1e-6 * np.abs([intrados, extrados, slip]).max()
    names = np.array([structure.joints[number].name for number in stones.rigid_regions.joints])
    sliding = join_joint_names(names[np.abs(slip) > moving])
    turning = join_joint_names(names[np.abs(extrados - intrados) > moving])
    # depth, as a multiple of that given, and friction from which more does not help [-]
    unlimited = 1e3
    if _stands(dead, friction=unlimited):
        least = _least_value(dead, "friction", float(dead.blocks.structure.friction.min()), 10.0)
        text = f"joints slide ({sliding}): it stands from a coefficient of friction of {least:.2g}"
        if not _stands(dead, depth=unlimited):
            text += ", and no thickness helps"
        return text
    if _stands(dead, depth=unlimited):
        least = _least_value(dead, "depth", 1.0, unlimited)
        return (
            f"joints hinge ({turning}): it stands if they are {least:.3g} times as deep, at the "
            "same weight; no friction helps"
        )
    if _stands(dead, friction=unlimited, depth=unlimited):
        moves = [sliding and f"slide ({sliding})", turning and f"hinge ({turning})"]
        return (
            f"joints {' and '.join(filter(None, moves))}: a stone or a support is missing"
            f"{_name_ends(structure)}, or it needs both more friction and deeper joints"
        )
    number = int(np.abs(fall.multipliers.reshape(-1, 3)).max(axis=1).argmax())
    block = dead.blocks.structure.blocks[dead.blocks.structure.free[number]].name
    return (
        f"no compression in its joints can hold '{block}', however deep and rough they are: add a "
        "support, or check the outline"
    )


def _name_ends(structure: Structure) -> str:
    """Return the free blocks with one joint, which may lack a neighbour, in words."""
    count = Counter(number for joint in structure.joints for number in joint.blocks)
    ends = [structure.blocks[number] for number in structure.free if count[number] == 1]
    places = [f"'{end.name}' at {say_place(as_point(end.centroid))}" for end in ends[:4]]
    return f" beside {' or '.join(places)}" if places else ""


def _stands(dead: Programme, friction: float | None = None, depth: float = 1.0) -> bool:
    """Return whether blocks stand with at least this friction, and joints deepened by a factor."""
    blocks: RigidBlocks = dead.blocks
    coefficient: Array = blocks.structure.friction
    if friction is not None:
        coefficient = np.maximum(coefficient, friction)
    relaxed = replace(dead, blocks=DeepenedBlocks(blocks.structure, depth), friction=coefficient)
    return is_balanced(relaxed.minimise_residual(), relaxed)


def _least_value(
    dead: Programme, name: str, lower: float, upper: float, precision: float = 2e-3
) -> float:
    """Return the least value of a property with which blocks stand, by bisection."""
    while upper > (1.0 + precision) * max(lower, precision):
        middle = 0.5 * (lower + upper)
        if upper > 4.0 * max(lower, precision):  # far apart: by the geometric mean
            middle = float(np.sqrt(max(lower, precision) * upper))
        lower, upper = (lower, middle) if _stands(dead, **{name: middle}) else (middle, upper)
    return upper
