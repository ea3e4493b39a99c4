"""Finite movement of a support: equilibrium in the displaced geometry, step by step.

A small movement of a support makes rigid blocks a mechanism, whose hinges the linear programme of
`collapse_factor` finds. Here the blocks move along with it, by finite rotations, and the programme
is set up again at their places. The gaps g at the ends of the joints are the present ones, and s
those that a further movement alone would cause. The forces of

    min (g + s)·x   subject to   A x = f_dead,   F_i, F_e >= 0,

and the motion that is dual to them are those of the state of least potential energy: ends with
g + s > 0 carry nothing, and hinges close and new ones open where that costs less. Where no forces
balance the weights in the present geometry the structure falls.

The two faces of a joint move with their blocks and need not coincide any more. An end is open by
the distance of the higher block's corner from the lower block's face. Slip is counted at the end
that is nearer to contact. The rates of openings and slip are exact for corners that touch, so that
the forces of hinges act where the hinges are.
"""

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from archfem._display import ExplainedWord
from archfem._typing import Array
from archfem._validation import check_between, validate_arguments
from archfem.errors import DidNotConverge, InvalidInput, logger
from archfem.limit.backfill import SELF_WEIGHT
from archfem.limit.displaced_blocks import PlacedBlocks
from archfem.limit.linear_programme import NoEquilibrium, Optimum, Programme, RigidBlocks
from archfem.limit.nonassociated import RESISTANCE_MARGIN, normal_forces, shear_resistance
from archfem.limit.self_weight import stands
from archfem.masonry.block import rotate
from archfem.masonry.loads import Settlement
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure, join_joint_names, join_names

# First and longest step, as a share of the full movement [-]
MAX_MOVEMENT_STEP = 0.01

# Penetration, slip, and work of forces on gaps per weight, relative to the size, that count as zero
GEOMETRY_TOLERANCE = 1e-8


class End(ExplainedWord):
    """Reason for which a movement ends."""

    FALLS = ("falls", "beyond, no thrust line fits into the shape that it has taken, and it falls")
    LEAPS = "leaps", "beyond, no equilibrium lies near: it leaps to another, or falls"
    SLIDES = "slides", "beyond, a joint needs more than its friction and slides"
    LOCKS = "locks", "without sliding in its joints it cannot follow any further"
    HOLDS = "holds", "it stands at the whole movement"


@dataclass(frozen=True)
class Stage:
    """One state of equilibrium under a moving support.

    Attributes:
        share: share of the full movement [-].
        work: work of the weights on the full movement, at its present rate [N m]: for a
            translation by 1 m, the thrust on the support along it, in N.
        hinges: joints that are open, with the face where the blocks stay in contact.
        names: names of these joints.
        faces: the same faces in words, left or right in a pier.
    """

    share: float
    work: float
    hinges: tuple[tuple[int, str], ...]
    names: tuple[str, ...]
    faces: tuple[str, ...]

    def __str__(self) -> str:
        """Describe the share of the movement, the work, and the hinges, in one line."""
        sides = zip(self.names, self.faces, strict=True)
        hinges = [f"{name} at the {face}" for name, face in sides]
        return (
            f"from {self.share:.4f} of the movement, work {self.work:.4g} N m: "
            f"hinges: {join_names(hinges, '; ') or 'none'}"
        )


@dataclass(frozen=True, eq=False)
class Movement:
    """Largest movement of a support that a structure survives.

    Attributes:
        structure: structure on the support.
        full_settlement: full movement, at which the analysis ends.
        largest: largest share of it at which the structure still stands [-].
        end: reason for which it ends; `end.sentence` gives its meaning.
        stages: states of equilibrium from rest to the largest movement.
        displacement: displacement of every block's centroid, and its rotation, at the largest
            movement (n_blocks, 3) [m, m, rad].
        sliding: names of the joints that need more than their friction beyond; none unless it ends
            by sliding.
    """

    structure: Structure
    full_settlement: Settlement
    largest: float
    end: End
    stages: tuple[Stage, ...]
    displacement: Array
    sliding: tuple[str, ...] = ()

    @property
    def settlement(self) -> Settlement:
        """Largest movement survived."""
        x, y, turn = (self.largest * component for component in self.full_settlement.motion)
        return replace(self.full_settlement, motion=(x, y, turn))

    @property
    def sequence(self) -> tuple[Stage, ...]:
        """Stages at which the hinges differ from those before."""
        pairs = zip((None, *self.stages[:-1]), self.stages, strict=True)
        return tuple(b for a, b in pairs if a is None or a.hinges != b.hinges)

    def __str__(self) -> str:
        """Describe the largest movement, its end, and the hinges, line by line."""
        x, y, turn = self.settlement.motion
        head = (
            f"support {self.full_settlement.block} moves by {x:.4g} m, {y:.4g} m and "
            f"{turn:.4g} rad: {self.end.sentence}"
        )
        if self.sliding:
            head = f"{head}: {join_joint_names(self.sliding)}"
        return "\n".join([head, *map(str, self.sequence)])


@validate_arguments
def largest_movement(
    structure: Structure,
    settlement: Settlement,
    *,
    friction: str | None = "coulomb",
    tolerance: float = 1e-4,
) -> Movement:
    """Find the movement of a support at which a structure falls under its own weight.

    The support moves in steps, and rigid blocks follow it without sliding: at each step hinges are
    those of least potential energy in the present geometry, and may jump from joint to joint. A
    step without equilibrium is halved.

    Args:
        structure: supports are its fixed blocks.
        settlement: settlement of a support; its motion is the direction, and the full movement.
        friction: "coulomb" ends where equilibrium needs |V| > c A + μ N in a joint, as for
            `collapse_factor`; None never slides.
        tolerance: width of the last step, as a share of the movement [-].

    Returns:
        The largest movement and the states of equilibrium up to it.

    Raises:
        InvalidInput: it does not stand to begin with; the settlement moves nothing, or no support;
            an option is unknown.

    Note:
        Joints do not slide, so that a bonded wall, whose upright joints would have to, locks at
        once. Where it ends by sliding or locks, it may survive more movement, and a warning says
        so. Blocks touch at the ends of their joints only. Where it falls there may be
        equilibrium elsewhere, which it could reach by a leap alone: that does not count as
        standing.

    References:
        Ochsendorf, The Structural Engineer 84 (2), 2006. Portioli and Cascini, Eng. Struct. 148
        (2017) 485-496.

    Example:
        >>> ring = af.circular_arch(radius=1.0, thickness=0.15, embrace=180.0, voussoirs=8)
        >>> spread = af.Settlement("left abutment", (-1.0, 0.0, 0.0))
        >>> round(af.limit.largest_movement(ring, spread, friction=None).largest, 4)
        0.2269
    """
    check_between(tolerance, "tolerance", 1e-8, MAX_MOVEMENT_STEP, ends="[]")
    if friction not in ("coulomb", None):
        raise InvalidInput(f"friction {friction!r} is not known here: use 'coulomb' or None")
    support = settlement.added(structure, np.zeros((len(structure.blocks), 3)))
    if not support.any():
        raise InvalidInput(f"settlement {settlement.motion} moves nothing: give a direction")
    blocks = structure.blocks
    soil = [number for number in find_yielding_blocks(structure) if not blocks[number].grain]
    if soil:
        raise InvalidInput(
            f"blocks {[blocks[number].name for number in soil]} are fill, of which this analysis "
            "takes no strength: leave the fill out, or give the settlement to af.pushover with a "
            "finite-element model"
        )
    if not stands(structure, friction=friction):
        raise InvalidInput("it does not stand under its own weight before any support moves")
    return _MovementPath(structure, settlement, support, friction is not None).follow(tolerance)


@dataclass(frozen=True, eq=False)
class DisplacedBlocks(RigidBlocks):
    """Rigid blocks after displacements and rotations of any size."""

    # of every block's centroid along x and y, and anticlockwise rotation (n_blocks, 3) [m, m, rad]
    displacement: Array

    def moved(self, motion: Array) -> "DisplacedBlocks":
        """Return the blocks after a further motion."""
        return DisplacedBlocks(self.structure, self.displacement + motion)

    @cached_property
    def faces(self) -> Array:
        """Ends of the joints on the lower and on the higher blocks (2, n_joints, 2, 2) [m]."""
        both = np.stack([self.structure.ends, self.structure.ends])
        return PlacedBlocks(self.structure, self.displacement, both).faces

    @cached_property
    def axes(self) -> Array:
        """Normals and tangents of the lower blocks' faces (2, n_joints, 2)."""
        initial = np.stack([self.structure.normals, self.structure.tangents])
        return rotate(initial, self.displacement[self.structure.pairs[:, 0], 2])

    @cached_property
    def current_gaps(self) -> Array:
        """Openings at the intrados and the extrados, and slip (3, n_joints) [m]."""
        jump = self.faces[1] - self.faces[0]
        openings, slips = np.einsum("jea,kja->kej", jump, self.axes)
        nearer = np.argmin(openings, axis=0)
        return np.vstack([openings, slips[nearer, np.arange(len(nearer))]])

    @cached_property
    def rates(self) -> sparse.csr_matrix:
        """Rates of `current_gaps` with motions of all blocks (3 n_joints, 3 n_blocks)."""
        # Both blocks move the corners of the higher one: the lower block's axes turn with it.
        corners, (normals, tangents) = np.moveaxis(self.faces[1], 1, 0), self.axes
        nearer = corners[np.argmin(self.current_gaps[:2], axis=0), np.arange(len(normals))]
        centroids = self.structure.centroids + self.displacement[:, :2]
        return self.end_rates(normals, tangents, (*corners, nearer), centroids)


class _PathEnd(Exception):
    """Raised with the reason where no further equilibrium is found."""

    def __init__(self, end: End, sliding: tuple[str, ...] = ()) -> None:
        super().__init__(end.sentence)
        self.end, self.sliding = end, sliding


@dataclass(frozen=True, eq=False)
class _MovementPath:
    """States of equilibrium under a moving support, each from the one before."""

    structure: Structure
    settlement: Settlement
    support: Array  # full motion of all blocks, zero but for the support (n_blocks, 3)
    has_friction: bool  # whether |V| is limited

    def follow(self, tolerance: float) -> Movement:
        """Move the support as far as there is equilibrium."""
        blocks = DisplacedBlocks(self.structure, np.zeros_like(self.support))
        share, step, end = 0.0, MAX_MOVEMENT_STEP, End.HOLDS
        sliding: tuple[str, ...] = ()
        stages = [self._stage(0.0, *self._equilibrate(blocks))]
        while share < 1.0 and step >= tolerance:
            step = min(step, 1.0 - share)
            try:
                trial, state = self._equilibrate(self._predict(blocks, step))
                self._check_friction(trial, state)
            except _PathEnd as stop:
                end, sliding, step = stop.end, stop.sliding, 0.5 * step
                continue
            blocks, share = trial, share + step
            stages.append(self._stage(share, trial, state))
            # after the first failure steps only shrink: the bracket of the end is bisected
            step = min(2.0 * step, MAX_MOVEMENT_STEP) if end is End.HOLDS else step
        if share >= 1.0:
            end, sliding = End.HOLDS, ()
        found = Movement(
            *(self.structure, self.settlement, share, end, tuple(stages)),
            *(blocks.displacement, sliding),
        )
        if self.has_friction and end in (End.SLIDES, End.LOCKS):
            logger.warning(
                "%s; it may survive more than this movement, sliding, which is not followed here: "
                "af.pushover with the Settlement does so",
                str(found).partition("\n")[0],
            )
        return found

    def _programme(self, blocks: DisplacedBlocks, further: Array | None = None) -> Programme:
        """Return the equilibrium programme of least work on present and imposed gaps."""
        gaps = blocks.current_gaps
        # gaps of round-off make the solver of programmes stall
        gaps = np.where(np.abs(gaps) > 1e-10 * self.structure.size, gaps, 0.0)
        if further is not None:
            gaps = gaps + blocks.gaps(further)
        load = blocks.dimensionless(blocks.load([SELF_WEIGHT]))
        rough = np.full(len(self.structure.joints), np.inf)  # friction is checked afterwards
        cost = np.concatenate([*gaps[:2], -gaps[2]])
        return Programme(blocks, load, rough, np.zeros(len(rough)), force_cost=cost)

    def _solve(self, programme: Programme) -> Optimum:
        """Return the optimum; where there is none, raise the reason for which the movement ends."""
        try:
            optimum = programme.solve()
        except NoEquilibrium as error:
            raise _PathEnd(End.FALLS) from error
        if optimum is None:
            raise _PathEnd(End.LOCKS)
        return optimum

    def _predict(self, blocks: DisplacedBlocks, step: float) -> DisplacedBlocks:
        """Move the support by a share of its movement, and the blocks with it to first order."""
        further = step * self.support
        optimum = self._solve(self._programme(blocks, further))
        return blocks.moved(blocks.motion(optimum.multipliers) + further)

    def _equilibrate(
        self, blocks: DisplacedBlocks, max_iterations: int = 40
    ) -> tuple[DisplacedBlocks, Optimum]:
        """Move the blocks to where they are in equilibrium and do not overlap."""
        size, start = self.structure.size, blocks
        for _ in range(max_iterations):  # as Newton's method, in about four
            state = self._solve(self._programme(blocks))
            penetration = float(-blocks.current_gaps[:2].min())
            slip = float(np.abs(blocks.current_gaps[2]).max())
            work = abs(state.value) / len(self.structure.free)
            if max(penetration, slip, work) <= GEOMETRY_TOLERANCE * size:
                return blocks, state
            blocks = blocks.moved(blocks.motion(state.multipliers))
            # beyond a tenth of the size the step is too long: another equilibrium may be found
            if blocks.largest_displacement(blocks.displacement - start.displacement) > 0.1 * size:
                break
        raise _PathEnd(End.LEAPS)

    def _check_friction(self, blocks: DisplacedBlocks, rolling: Optimum) -> None:
        """End the movement by sliding where no equilibrium satisfies the friction limits."""
        if not self.has_friction:
            return
        rough, friction = self._programme(blocks), self.structure.friction
        limited, state = replace(rough, friction=friction, cohesion=blocks.cohesion), None
        with suppress(DidNotConverge):
            state = limited.solve()
        tolerance = 10.0 * GEOMETRY_TOLERANCE * self.structure.size
        if state is None or abs(state.value) / len(self.structure.free) > tolerance:
            excess = abs(rolling.forces.reshape(3, -1)[2])
            excess = excess - shear_resistance(limited, normal_forces(rolling.forces))
            beyond = np.isfinite(friction) & (excess > RESISTANCE_MARGIN)
            names = (self.structure.joints[joint].name for joint in np.flatnonzero(beyond))
            raise _PathEnd(End.SLIDES, tuple(names))

    def _stage(self, share: float, blocks: DisplacedBlocks, state: Optimum) -> Stage:
        """Return thrust and hinges of a state."""
        gaps = blocks.gaps(self.support)
        cost = np.concatenate([*gaps[:2], -gaps[2]])
        intrados, extrados, _ = blocks.current_gaps
        # a joint hinges from an opening of a millionth of its depth
        open_joints = np.flatnonzero(np.abs(extrados - intrados) > 1e-6 * self.structure.depths)
        hinges = tuple(
            (int(j), "intrados" if intrados[j] < extrados[j] else "extrados") for j in open_joints
        )
        turning = [(self.structure.joints[j], side) for j, side in hinges]
        names = tuple(joint.name for joint, _ in turning)
        faces = tuple(joint.name_face(side) for joint, side in turning)
        return Stage(share, float(blocks.force_unit * (cost @ state.forces)), hinges, names, faces)
