"""State of collapse: whether a structure stands, is dislocated, or has partly or wholly fallen.

Positions of the blocks over time decide, whether joints or loose blocks were simulated.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from archfem._typing import Array, Flags
from archfem._validation import validate_arguments
from archfem.dynamics.rigid_body.bodies import FallFrame, LooseBlocks
from archfem.errors import InvalidInput
from archfem.limit.displaced_blocks import PlacedBlocks, bears_dead_load
from archfem.masonry.block import rotate
from archfem.masonry.standing import list_own_stones
from archfem.masonry.stiffness_ratio import find_soft_blocks, list_stones
from archfem.masonry.structure import Structure, join_names, list_first
from archfem.models.model import Doubt
from archfem.units import format_mm

# Kinds of collapse, in order of severity
COLLAPSE_STATES = ("stands", "dislocated", "partly fallen", "fallen")

# Displacement above which a structure is dislocated, over the depth of the shallowest part [-]
DISLOCATION = 0.1

# Ratio of the residual displacement to that limit within which other steps may change the kind [-]
NEAR_LIMIT = 1.5

# Share of the Arias intensity left when strong motion ends, after 95 % of it (Trifunac and Brady,
# BSSA 65, 1975) [-]
MAX_LOOSE_SHARE = 0.05

# Remedy where properties or steps may change the kind
RANGE_REMEDY = "state a range, `archfem verdict CASE.toml`"

# Kinds of collapse with lost blocks
FALLEN_STATES = COLLAPSE_STATES[2:]

# Kind of a run that ends while blocks are out of their places and may still come to rest there
UNDECIDED = "unknown"

# Share of the steps of a fall whose impulses need not settle [-]
MAX_UNSETTLED = 0.02

# Words of the doubt of what is undecided
STILL_MOVES = "it is not decided whether blocks fall: {} still moved out of place at {:.2f} s"

# Distance of faces that touch at rest, over the size of the structure: 0.5 mm of one of 5 m, by
# which blocks at rest may still move [-]
TOUCHING_AT_REST = 1e-4


@dataclass(frozen=True)
class CollapseState:
    """State of collapse at the end of a run.

    A loose block is out of its place where its centroid has sunk by more than half the root of its
    area, or it has turned by more than 45°. It is *lost* if it stays so to the end, unless all
    stones bear their weight where they are, by contacts of their joints with friction (limit
    analysis of the last shape, without fill): a ring that sags and closes again, or jams, has lost
    none. Fill does not count, and bodies that stand on the structure are not displaced with it.
    The structure

    - *stands*: no block is lost, and none is displaced by more than a tenth of the median joint
      depth of the shallowest ring or pier;
    - is *dislocated*: no block is lost, but some are displaced further;
    - is *partly fallen*: blocks are lost, but a ring retains all of its own;
    - is *fallen*: every ring has lost a block. Where there is no ring, the piers count instead,
      and where there is none, all blocks as one;
    - is *unknown*: blocks still move at the end, out of their places for less time than a free fall
      by the size of the structure takes, or in a shape that bears its weight.

    Blocks fall by far more than the limit or by far less, so that the kind is insensitive to the
    limits; the time is sensitive, by about the time in which a stone falls by its own size. Whether
    a structure falls under a record is sensitive to the scale of the record, the step, friction and
    restitution. State it as a range of scales, from runs at two steps.

    Attributes:
        kind: "stands", "dislocated", "partly fallen", "fallen" or "unknown".
        time: time of the first frame from which on a block was lost, None without [s].
        blocks: names of the lost blocks, in the order of the structure, or of those out of place
            where it is unknown; of a dislocated one those of the stones displaced beyond the limit,
            the farthest first.
        displacement: largest displacement of any corner of a free stone, see `Verdict` [m].
        residual: the same at the end [m].
        resting: whether all blocks were at rest at the end, or vibrated too weakly to overturn; if
            not, more may fall.
        admissible_step: time step that follows sliding; infinite where that of the run does [s].
        loose_share: share of the Arias intensity of the ground that loose blocks were followed
            through, without elastic joints [-].
        unsettled: share of the steps, until blocks were out of place, in which impulses of rigid
            blocks did not settle: beyond 2 % it is in doubt whether they fall [-].
        mechanism: joints of rings and piers that had failed when blocks became loose, of a fall, in
            words such as "by hinges (arch, joints 0 and 7) at 3.405 s, when blocks come loose".
    """

    kind: str
    time: float | None
    blocks: tuple[str, ...]
    displacement: float
    residual: float
    resting: bool
    admissible_step: float = inf
    loose_share: float = 0.0
    mechanism: str = ""
    unsettled: float = 0.0

    @property
    def lacks_joints(self) -> bool:
        """Whether blocks that did not fall were loose before strong motion was over."""
        return self.kind not in FALLEN_STATES and self.loose_share > MAX_LOOSE_SHARE

    @property
    def dislocated_stones(self) -> str:
        """Names of the stones that are dislocated, in brackets behind a space; "" for none."""
        return name_stones(self.blocks) if self.kind == COLLAPSE_STATES[1] else ""

    @property
    def text(self) -> str:
        """Kind of collapse, with the stones that are dislocated, or the time and those lost."""
        if self.kind == UNDECIDED:
            return f"not decided: still moving, out of place{name_stones(self.blocks)}"
        still = "" if self.resting else ", while blocks still move"
        if self.unsettled > MAX_UNSETTLED:
            still += f", in doubt: impulses did not settle in {self.unsettled:.0%} of the steps"
        if self.time is None:
            return f"{self.kind}{self.dislocated_stones}{still}"
        return f"{self.kind}, first at {self.time:.2f} s; lost: {join_names(self.blocks)}{still}"


def name_stones(names: Sequence[str], most: int = 3) -> str:
    """Return names of stones in brackets behind a space, many shortened; "" for none."""
    return f" ({list_first(names, most)})" * bool(names)


@validate_arguments
def classify_collapse(
    structure: Structure,
    frames: Iterable[LooseBlocks],
    start: Array | None = None,
    joined: bool = False,
) -> CollapseState:
    """Return the state of collapse from the positions of blocks over time.

    Args:
        structure: structure of free and fixed blocks.
        frames: frames of the run in order, such as those of `RigidBlockSimulation.frames`; the last
            one gives the residual displacement.
        start: poses of all blocks from which displacements count, such as those under dead load
            (n_blocks, 3) [m, m, rad]; by default those as built.
        joined: whether joints hold all blocks to the end, so that none is lost.

    Raises:
        InvalidInput: there is no frame.
    """
    free = list_stones(structure)
    start = np.zeros((len(structure.blocks), 3)) if start is None else start
    owner, corners = _place_corners(structure, list_own_stones(structure))
    origin, farthest, moved = corners(start), 0.0, np.zeros(len(owner))
    find_lost, since, last, early = mark_lost(structure), np.full(len(free), inf), None, 0.0
    for last in frames:
        if isinstance(last, FallFrame) and np.isinf(since).all():
            early = last.settling.unsettled_share
        moved = np.linalg.norm(corners(last.poses) - origin, axis=1)
        farthest = max(farthest, float(moved.max()))
        since = np.where(find_lost(last.poses), np.minimum(since, last.time), inf)
    if last is None:
        raise InvalidInput(
            "a run of no frames says nothing: give those of RigidBlockSimulation.frames"
        )
    away = np.isfinite(since) & (not joined)
    borne = bool(away.any()) and _bears_weight(structure, last.poses)
    rests = getattr(last, "resting", not last.velocities.any())
    decided = rests or (not borne and last.time - since.min() >= _fall_duration(structure))
    lost = away & (not borne or not rests)
    numbers = [number for number, gone in zip(free, lost, strict=True) if gone]
    kind = _fallen_kind(structure, numbers) if decided else UNDECIDED
    if not numbers:
        order, limit = np.argsort(-moved), DISLOCATION * shallowest_part(structure)[0]
        numbers = [*dict.fromkeys(owner[order][moved[order] > limit].tolist())]
        kind = COLLAPSE_STATES[len(numbers) > 0]
    return CollapseState(
        kind,
        float(since[lost].min()) if lost.any() and decided else None,
        tuple(structure.blocks[number].name for number in numbers),
        farthest,
        float(moved.max()),
        bool(getattr(last, "resting", False)),
        unsettled=early,
    )


def follow_until_lost(
    structure: Structure,
    frames: Iterable[FallFrame],
    restore: Callable[[FallFrame], LooseBlocks] = lambda frame: frame,
) -> Iterator[FallFrame]:
    """Yield frames until a stone is lost for good; `restore` returns those of the structure.

    It is once out of its place for as long as a free fall by the size of the structure takes, in a
    shape that does not bear its weight.
    """
    find_lost, since = mark_lost(structure), np.array(inf)
    for frame in frames:
        yield frame
        poses = restore(frame).poses
        since = np.where(find_lost(poses), np.minimum(since, frame.time), inf)
        long = frame.time - since.min() >= _fall_duration(structure)
        if long and not _bears_weight(structure, poses):
            return


def _fall_duration(structure: Structure) -> float:
    """Return the time of a free fall by the size of the structure [s]."""
    # stones of an arch 4.5 m across, which fall by that in 1 s, sank for 0.5 s and came back
    return float(np.sqrt(2.0 * structure.size / structure.gravity))


def _bears_weight(structure: Structure, poses: Array) -> bool:
    """Return whether stones bear their weight at poses of all blocks, by contacts of joints."""
    # fill is not rigid, and what of it has fallen where is not known here
    if len(list_stones(structure)) < len(structure.free):
        return False
    placed = replace(PlacedBlocks.at_rest(structure), near=TOUCHING_AT_REST)
    return bears_dead_load(placed.moved(poses))


def mark_lost(structure: Structure) -> Callable[[Array], Flags]:
    """Return a function from poses of all blocks to whether each free stone is out of its place."""
    stones = list_stones(structure)
    sizes = np.sqrt([structure.blocks[number].area for number in stones])
    return lambda poses: (
        (poses[stones, 1] < -0.5 * sizes) | (np.abs(poses[stones, 2]) > np.pi / 4.0)
    )


def _fallen_kind(structure: Structure, lost: list[int]) -> str:
    """Return the kind of collapse with lost blocks."""
    blocks = structure.blocks
    roles = {blocks[number].role for number in structure.free}
    role = next((role for role in ("ring", "pier") if role in roles), None)
    if role is None:
        return "fallen"
    parts = {blocks[number].part for number in structure.free if blocks[number].role == role}
    return "partly fallen" if parts - {blocks[number].part for number in lost} else "fallen"


def doubt_collapse(
    structure: Structure, fall: CollapseState, held: bool = False, rest: float = 0.0
) -> Iterator[Doubt]:
    """Yield doubts of a structure that has not fallen but was near another kind of collapse.

    It may be held by the ground, which accelerates to the end, or has a rest [s].
    """
    if fall.kind in FALLEN_STATES:
        return
    depth = shallowest_part(structure)[0]
    limit = DISLOCATION * depth
    # a portal that still rocked when its motion ended was dislocated by 70 mm, and at rest by none
    if not fall.resting and fall.displacement > limit:
        longer = f"rest={max(10, round(2.0 * rest))}"
        yield Doubt(
            "blocks still move at the end: they may come back from {:mm}, or go farther",
            "hold the push longer, until it falls or rests"
            if held
            else f"let the ground rest at the end, `--set motion.{longer}`, or "
            f"suite.pairs.NAME.{longer}",
            (fall.residual,),
        )
    # Of 200 random structures, 7 stand although rigid blocks fall or move farther: all moved by
    # more than 0.6, as did 14 of the others. A stack overturns at about 1.
    if fall.displacement > 0.6 * depth:
        yield Doubt(
            "a corner was displaced by {:mm}, {:.2g} of the depth of the shallowest part: "
            "other joints or time steps may let it fall",
            RANGE_REMEDY,
            (fall.displacement, fall.displacement / depth),
        )
    if limit / NEAR_LIMIT < fall.residual < NEAR_LIMIT * limit and fall.resting:
        yield Doubt(
            f"the residual displacement of {{:mm}} is within a factor of {NEAR_LIMIT} of "
            f"{format_mm(limit)}, from which on it counts as dislocated",
            "state the displacement rather than the kind",
            (fall.residual,),
        )


def doubt_standing(structure: Structure, kinds: Iterable[str], residuals: Array) -> Iterator[Doubt]:
    """Yield the doubt of a structure that stands in all runs, and is nearly dislocated in some."""
    limit = DISLOCATION * shallowest_part(structure)[0]
    near = residuals[residuals > limit / NEAR_LIMIT]
    if near.size and not {*kinds} & {*COLLAPSE_STATES[1:]}:
        words = f"in {{}} of {len(residuals)} runs a residual displacement, up to {{:mm}}, is "
        words += f"within a factor of {NEAR_LIMIT} of {format_mm(limit)}, where it is dislocated"
        remedy = "state the displacement rather than the kind"
        yield Doubt(words, remedy, (near.size, near.max()))


def shallowest_part(structure: Structure) -> tuple[float, str]:
    """Return the least depth of a ring or pier, the median of its joints [m], and its name."""
    judged = structure.judged if structure.judged.any() else np.ones_like(structure.judged)
    parts = np.array([joint.part for joint in structure.joints])
    # the median, as a sliver at the edge of a wall says nothing of the wall
    return min(
        (float(np.median(structure.depths[judged & (parts == part)])), str(part))
        for part in np.unique(parts[judged])
    )


def describe_dislocation(structure: Structure) -> str:
    """Return beyond which residual displacement a structure is dislocated, and by which part."""
    depth, part = shallowest_part(structure)
    return (
        f"would count as dislocated beyond {format_mm(DISLOCATION * depth)} of residual "
        f"displacement, a tenth of the median depth of the joints of {part or 'the ring'}"
    )


def explain_residual(structure: Structure, fall: CollapseState | None) -> str:
    """Return how to find whether a residual of a hundredth of the depth is one of soft joints."""
    small = 0.1 * DISLOCATION * shallowest_part(structure)[0]
    if fall is None or fall.time is not None or fall.residual < small:
        return ""
    return " and may decide the residual: compare with rigid joints, `archfem verdict CASE.toml`"


def doubt_soft_blocks(*structures: Structure) -> tuple[Doubt, ...]:
    """Return the doubts of falls with fill in one piece, or with soft stones as rigid bodies."""
    named: tuple[list[str], list[str]] = [], []  # of fill, and of stones
    for each in structures:
        stones = list_stones(each)
        for number in find_soft_blocks(each):
            named[number in stones].append(each.blocks[number].name)
    fill, soft = (join_names([*dict.fromkeys(names)]) for names in named)
    causes = {
        f"fill in one piece holds stones by tension until they are loose: {fill}": fill,
        f"a fall takes soft blocks for rigid bodies, each in one piece: {soft}": soft,
    }
    remedy = 'cut them with jointed_fill (law = "jointed" in a case)'
    return tuple(Doubt(cause, remedy) for cause, names in causes.items() if names)


def _place_corners(
    structure: Structure, blocks: Sequence[int]
) -> tuple[Array, Callable[[Array], Array]]:
    """Return blocks of corners, and a function from poses to these, from centroids as built [m]."""
    corners = [np.asarray(structure.blocks[k].points) - structure.centroids[k] for k in blocks]
    owner, arms = np.repeat(blocks, [len(each) for each in corners]), np.concatenate(corners)
    return owner, lambda poses: poses[owner, :2] + rotate(arms, poses[owner, 2])
