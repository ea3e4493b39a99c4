"""The largest movement of a support that a structure survives, in the geometry that it takes.

A small movement of a support makes rigid blocks a mechanism, whose hinges the linear programme of
`collapse_factor` finds. Here the blocks move along with it, by finite rotations, and the programme
is set up again where they are. With g the gaps at the ends of the joints now, and s those that a
further movement alone would cause, the forces of

    min (g + s)·x   subject to   A x = f_dead,   F_i, F_e >= 0,

and the motion that is dual to them are those of the state of least potential energy: ends with
g + s > 0 carry nothing, hinges close and new ones open where that costs less, and where no forces
balance the weights in the present geometry it falls.
"""

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from archfem.arguments import instance, real
from archfem.arrays import Array
from archfem.errors import DidNotConverge, InvalidInput
from archfem.limit.blocks import rigid_load
from archfem.limit.collapse import stands
from archfem.limit.displaced import DisplacedBlocks
from archfem.limit.programme import NoState, Optimum, Programme, friction_limits, no_limits
from archfem.limit.weight import SELF_WEIGHT
from archfem.masonry.actions import Settlement
from archfem.masonry.structure import Structure

FIRST = 0.01
"""First step, as a share of the movement asked for, and the longest."""

ROUNDS = 40
"""Programmes within one step; finite rotations settle like Newton's method, in about four."""

SETTLED = 1e-8
"""Penetration, slip, and work of forces on gaps per weight, that count as none [sizes]."""

CLOSED = 1e-10
"""Gap that is round-off, which the solver of programmes would stumble over [sizes]."""

LEAP = 0.1
"""Largest motion of a corner within one step [sizes]: beyond, the step is shortened."""

OPEN = 1e-6
"""Opening from which a joint counts as a hinge [depths]."""


class End(StrEnum):
    """Why a movement goes no further."""

    FALLS = "falls"
    LEAPS = "leaps"
    SLIDES = "slides"
    LOCKS = "locks"
    HOLDS = "holds"

    @property
    def sentence(self) -> str:
        """What it means."""
        return _SENTENCES[self]


_SENTENCES = {
    End.FALLS: "beyond, no thrust line fits into the shape that it has taken, and it falls",
    End.SLIDES: "beyond, a joint needs more than its friction and slides",
    End.LEAPS: "beyond, no equilibrium lies near: it leaps to another, or falls",
    End.LOCKS: "without sliding in its joints it cannot follow any further",
    End.HOLDS: "it stands at the whole movement",
}


@dataclass(frozen=True)
class Stage:
    """One state of equilibrium on the way.

    Attributes:
        share: of the movement asked for [-].
        work: of the weights on that movement, at its present rate [N m]: for a translation by 1 m,
            the thrust on the support along it, in N.
        hinges: joints that are open, with the face where the blocks stay in contact.
        names: of these joints.
    """

    share: float
    work: float
    hinges: tuple[tuple[int, str], ...]
    names: tuple[str, ...]

    def __str__(self) -> str:
        """Share, work, and hinges by number and name, in one line."""
        words = [
            f"{joint} ({name}) {side}"
            for (joint, side), name in zip(self.hinges, self.names, strict=True)
        ]
        return (
            f"from {self.share:.4f} of the movement, work {self.work:.4g} N m: "
            f"hinges {', '.join(words) or 'none'}"
        )


@dataclass(frozen=True, eq=False)
class Movement:
    """How far a support can move.

    Attributes:
        structure: that follows.
        asked: the movement up to which it was followed.
        largest: share of it at which the structure still stands [-].
        end: why it goes no further; `end.sentence` says what that means.
        stages: states of equilibrium on the way, from rest to the largest movement.
        displacement: of every block's centroid, and its rotation, at the largest movement
            (n_blocks, 3) [m, m, rad].
    """

    structure: Structure
    asked: Settlement
    largest: float
    end: End
    stages: tuple[Stage, ...]
    displacement: Array

    @property
    def settlement(self) -> Settlement:
        """The largest movement survived."""
        x, y, turn = (self.largest * each for each in self.asked.motion)
        return replace(self.asked, motion=(x, y, turn))

    @property
    def sequence(self) -> tuple[Stage, ...]:
        """Stages at which the hinges are others than before."""
        pairs = zip((None, *self.stages[:-1]), self.stages, strict=True)
        return tuple(b for a, b in pairs if a is None or a.hinges != b.hinges)

    def __str__(self) -> str:
        """Largest movement, its end, and the hinges by number and name, line by line."""
        x, y, turn = self.settlement.motion
        head = (
            f"support {self.asked.block} moves by {x:.4g} m, {y:.4g} m and {turn:.4g} rad: "
            f"{self.end.sentence}"
        )
        return "\n".join([head, *map(str, self.sequence)])


def largest_movement(
    structure: Structure,
    settlement: Settlement,
    *,
    friction: str | None = "coulomb",
    tolerance: float = 1e-4,
) -> Movement:
    """Find how far a support can move before the structure falls under its own weight.

    The support moves in steps, and rigid blocks follow it without sliding: at each step hinges are
    those of least potential energy in the present geometry, and may jump from joint to joint. A
    step that finds no equilibrium is halved.

    Args:
        structure: supports are its fixed blocks.
        settlement: of a support; its motion is the direction, and the farthest that is looked at.
        friction: "coulomb" ends where equilibrium needs |V| > c A + μ N in a joint, as for
            `collapse_factor`; None never slides.
        tolerance: width of the last step, as a share of the movement [-].

    Returns:
        The largest movement and the states on the way.

    Raises:
        InvalidInput: it does not stand to begin with; the settlement moves nothing, or no support;
            an option is unknown.

    Note:
        Joints do not slide on the way, so that a bonded wall, whose upright joints would have to,
        locks at once; and blocks touch at the ends of their joints only. Where it
        falls there may be equilibrium elsewhere, which it could reach by a leap alone: that is not
        counted as standing.

    References:
        Ochsendorf, The Structural Engineer 84 (2), 2006. Portioli and Cascini, Eng. Struct. 148
        (2017) 485-496.

    Example:
        >>> ring = af.circular_arch(radius=1.0, thickness=0.15, embrace=180.0, voussoirs=8)
        >>> spread = af.Settlement("left abutment", (-1.0, 0.0, 0.0))
        >>> round(af.limit.largest_movement(ring, spread, friction=None).largest, 4)
        0.2269
    """
    instance(structure, Structure, "structure", "give one, e.g. circular_arch(…)")
    instance(settlement, Settlement, "settlement", "give Settlement('left abutment', (-1, 0, 0))")
    if not 1e-8 <= real(tolerance, "tolerance [-]") <= FIRST:
        raise InvalidInput(f"tolerance {tolerance:.3g} is not between 1e-8 and {FIRST}")
    if friction not in ("coulomb", None):
        raise InvalidInput(f"friction {friction!r} is not known here: use 'coulomb' or None")
    support = settlement.added(structure, np.zeros((len(structure.blocks), 3)))
    if not support.any():
        raise InvalidInput(f"settlement {settlement.motion} moves nothing: give a direction")
    if not stands(structure, friction=friction):
        raise InvalidInput("it does not stand under its own weight before any support moves")
    return _Path(structure, settlement, support, friction is not None).followed(tolerance)


@dataclass(frozen=True, eq=False)
class _Path:
    """States of equilibrium under a support that moves, one from the other."""

    structure: Structure
    asked: Settlement
    support: Array
    rough: bool

    def followed(self, tolerance: float) -> Movement:
        """Go as far as there is equilibrium."""
        blocks = DisplacedBlocks(self.structure, np.zeros_like(self.support))
        share, step, end = 0.0, FIRST, End.HOLDS
        stages = [self._stage(0.0, *self._at_rest(blocks))]
        while share < 1.0 and step >= tolerance:
            step = min(step, 1.0 - share)
            try:
                there, state = self._at_rest(self._followed(blocks, step))
                self._check_friction(there)
            except _Ends as stop:
                end, step = stop.end, 0.5 * step
                continue
            blocks, share = there, share + step
            stages.append(self._stage(share, there, state))
            step = min(2.0 * step, FIRST) if end is End.HOLDS else step
        end = End.HOLDS if share >= 1.0 else end
        displacement = blocks.displacement
        return Movement(self.structure, self.asked, share, end, tuple(stages), displacement)

    def _programme(self, blocks: DisplacedBlocks, further: Array | None = None) -> Programme:
        """Ask for the forces of least work on the gaps, with those of a further movement."""
        gaps = np.where(np.abs(blocks.opened) > CLOSED * self.structure.size, blocks.opened, 0.0)
        if further is not None:
            gaps = gaps + blocks.gaps(further)
        load = blocks.scaled(rigid_load(self.structure, [SELF_WEIGHT]))
        limits = no_limits(len(self.structure.joints))
        return Programme(blocks, load, limits, cost=np.concatenate([*gaps[:2], -gaps[2]]))

    def _solved(self, programme: Programme) -> Optimum:
        """Return the optimum, or say what it means that there is none."""
        try:
            found = programme.solve()
        except NoState as error:
            raise _Ends(End.FALLS) from error
        if found is None:
            raise _Ends(End.LOCKS)
        return found

    def _followed(self, blocks: DisplacedBlocks, step: float) -> DisplacedBlocks:
        """Move the support by a share of its movement, and the blocks with it to first order."""
        further = step * self.support
        found = self._solved(self._programme(blocks, further))
        return blocks.moved(blocks.motion(found.coordinates) + further)

    def _at_rest(self, blocks: DisplacedBlocks) -> tuple[DisplacedBlocks, Optimum]:
        """Move the blocks to where they are in equilibrium and do not overlap."""
        size, begun = self.structure.size, blocks
        weights = len(self.structure.free)
        for _ in range(ROUNDS):
            state = self._solved(self._programme(blocks))
            wrong = max(float(-blocks.opened[:2].min()), float(np.abs(blocks.opened[2]).max()))
            if max(wrong, abs(state.value) / weights) <= SETTLED * size:
                return blocks, state
            blocks = blocks.moved(blocks.motion(state.coordinates))
            if blocks.reach(blocks.displacement - begun.displacement) > LEAP * size:
                break
        raise _Ends(End.LEAPS)

    def _check_friction(self, blocks: DisplacedBlocks) -> None:
        """Look for a state at the same places that friction permits too."""
        if not self.rough:
            return
        limits = friction_limits(self.structure.friction, blocks.cohesion)
        try:
            state = replace(self._programme(blocks), limits=limits).solve()
        except DidNotConverge as error:
            raise _Ends(End.SLIDES) from error
        weights = len(self.structure.free)
        if state is None or abs(state.value) / weights > 10.0 * SETTLED * self.structure.size:
            raise _Ends(End.SLIDES)

    def _stage(self, share: float, blocks: DisplacedBlocks, state: Optimum) -> Stage:
        """Return thrust and hinges of a state."""
        gaps = blocks.gaps(self.support)
        cost = np.concatenate([*gaps[:2], -gaps[2]])
        intrados, extrados, _ = blocks.opened
        hinged = np.flatnonzero(np.abs(extrados - intrados) > OPEN * self.structure.depths)
        hinges = tuple(
            (int(j), "intrados" if intrados[j] < extrados[j] else "extrados") for j in hinged
        )
        names = tuple(self.structure.joints[j].name for j, _ in hinges)
        return Stage(share, float(blocks.force * (cost @ state.forces)), hinges, names)


class _Ends(Exception):
    """No further."""

    def __init__(self, end: End) -> None:
        """Tell why."""
        super().__init__(end.sentence)
        self.end = end
