"""Rigid bodies of a structure's blocks: convex pieces, masses, friction, poses and velocities.

Contact detection works on convex polygons. Outlines are cut into triangles by ears (Meisters,
American Mathematical Monthly 82 (1975) 648). Triangles are merged while the union is convex (Hertel
and Mehlhorn 1983), which gives at most four times the smallest number of pieces.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations, pairwise
from math import inf, isinf
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from archfem._typing import Array
from archfem._validation import check_number
from archfem.errors import InvalidInput, InvalidStructure, logger
from archfem.masonry.block import Block, drop_straight_vertices
from archfem.masonry.stiffness_ratio import find_soft_blocks
from archfem.masonry.structure import CONTACT_TOLERANCE, Structure

# Numbers of the vertices of a convex piece, anticlockwise
Piece = tuple[int, ...]


class Bodies(NamedTuple):
    """Rigid bodies of convex pieces above a level ground; the ground is one more body."""

    inverse_mass: Array  # 1/m and 1/I, zero for fixed bodies (b + 1, 2) [1/kg, 1/(kg m²)]
    mass: Array  # m and I, zero for fixed bodies (b, 2) [kg, kg m²]
    centre: Array  # centroids as built (b + 1, 2) [m]
    reach: Array  # distance of the farthest vertex from the centroid (b,) [m]
    friction: Array  # coefficient between two bodies (b + 1, b + 1) [-]
    # resistance of closed faces by cohesion, for the whole width (b + 1, b + 1) [N/m]
    cohesion: Array
    owner: NDArray[np.int64]  # body of each piece (p,)
    piece_starts: NDArray[np.int64]  # first vertex of each piece, and the number of all (p + 1,)
    # vertices from the body's centroid, as built, anticlockwise in each piece (k, 2) [m]
    arms: Array
    normals: Array  # outward, of the edges from these vertices to the next, as built (k, 2)
    outer: NDArray[np.bool_]  # whether that edge is part of the outline, and no cut (k,)
    level: float  # of the ground [m]
    contact_gap: float  # largest gap of a contact [m]
    slop: float  # overlap that is not corrected [m]
    rocking: Array  # ratio of speeds of a rocking face, zero for none (b + 1, b + 1) [-]


@dataclass(frozen=True, eq=False)
class LooseBlocks:
    """Poses and velocities of all blocks of a structure at one time, relative to the ground.

    Attributes:
        time: time since the start of the motion [s].
        poses: displacement of each block's centroid from its position as built, and its rotation,
            anticlockwise (n_blocks, 3) [m, m, rad].
        velocities: rates of the poses; those of fixed blocks have no effect (n_blocks, 3).
        strain_energy: of joints and blocks, which rigid blocks lose, except for what lifts them out
            of the compression of joints [J].
    """

    time: float
    poses: Array
    velocities: Array
    strain_energy: float = field(default=0.0, kw_only=True)

    @classmethod
    def as_built(cls, structure: Structure, time: float = 0.0) -> Self:
        """Return the blocks as built, at rest.

        Args:
            structure: structure of the blocks.
            time: time since the start of the motion [s].

        Returns:
            Zero poses and velocities.
        """
        count = len(structure.blocks)
        return cls(time, np.zeros((count, 3)), np.zeros((count, 3)))


@dataclass(frozen=True)
class FallEnergy:
    """Energy since the start of a simulation, relative to the ground [J]."""

    kinetic: float  # of all blocks
    potential: float  # of their weight, zero at the start
    work: float  # of the ground motion
    lost: float  # in impacts and by friction
    # largest decrease of `lost` below an earlier value; zero for an exact solution
    gained: float
    gained_share: float  # the same, beyond rounding, relative to the largest energy exchanged [-]


@dataclass(frozen=True)
class Settling:
    """Convergence of the contact impulses of all steps since the start of a simulation."""

    # largest speed by which a contact violates its condition, relative to that which a body gains
    # by its weight in a step [-]
    residual: float
    unsettled: int  # number of steps whose residual is above the tolerance
    steps: int  # number of all steps
    sweeps: int  # over the contacts, of all steps

    @property
    def unsettled_share(self) -> float:
        """Share of the steps whose impulses did not settle [-]."""
        return self.unsettled / max(self.steps, 1)


@dataclass(frozen=True, eq=False)
class FallFrame(LooseBlocks):
    """Blocks at one time of a simulation."""

    energy: FallEnergy
    overlap: float  # deepest overlap of two blocks, or with the ground, since the start [m]
    settling: Settling
    resting: bool = False  # whether all blocks are at rest
    # change of a block's displacement since twice the step, of the last frame; NaN: not compared
    step_change: float = float("nan")


def make_bodies(
    structure: Structure,
    friction: float | None = None,
    level: float | None = None,
    rocking_ratio: float | Mapping[str, float] | None = None,
) -> Bodies:
    """Return the blocks of a structure as bodies, in their order."""
    blocks = structure.blocks
    ground = _ground_level(structure, level)
    shapes = [_block_pieces(block) for block in blocks]
    owner = [body for body, pieces in enumerate(shapes) for _ in pieces]
    pieces = [piece for shape in shapes for piece in shape]
    arms = np.concatenate([points for points, _ in pieces])
    edges = np.concatenate([np.roll(points, -1, axis=0) - points for points, _ in pieces])
    # an edge turned clockwise points outward
    across = np.column_stack([edges[:, 1], -edges[:, 0]])
    mass = masses_of(structure)
    smallest = float(np.sqrt(min(blocks[number].area for number in structure.free)))
    closed = min(1e-4 * smallest, 5e-5)
    inverse_mass = np.zeros((len(blocks) + 1, 2))
    inverse_mass[list(structure.free)] = 1.0 / mass[list(structure.free)]
    return Bodies(
        inverse_mass,
        mass,
        np.array([*(block.centroid for block in blocks), (0.0, ground)]),
        np.array([max(np.hypot(*points.T).max() for points, _ in shape) for shape in shapes]),
        _friction_table(structure, friction),
        _cohesion_table(structure),
        np.array(owner, dtype=np.int64),
        np.cumsum([0, *(len(points) for points, _ in pieces)]).astype(np.int64),
        arms,
        across / np.linalg.norm(across, axis=1)[:, None],
        np.concatenate([outer for _, outer in pieces]),
        ground,
        # Rounding and the time steps move points of a closed face apart. Where these are taken for
        # open, impacts depend on the step; where much more is closed, hinges are.
        max(CONTACT_TOLERANCE * structure.size, closed),
        closed,
        _rocking_table(structure, rocking_ratio),
    )


def check_rigid_blocks(structure: Structure) -> None:
    """Refuse bonds and laws of the user, and warn of soft blocks, which are not rigid."""
    if structure.has_own_laws:
        raise InvalidInput(
            "contacts have a law of their own, which blocks that fall do not follow: leave it out"
        )
    for joint in structure.joints:
        if joint.contact.tension > 0.0:
            raise InvalidInput(
                f"joint '{joint.name}' has tensile strength {joint.contact.tension:.3g} Pa, and "
                "blocks that fall have none: leave tension out"
            )
    for number in find_soft_blocks(structure):
        if not structure.blocks[number].fixed:
            logger.warning(
                "block '%s' is soft, and falls here as one rigid body: cut it with jointed_fill "
                '(law = "jointed" in a case)',
                structure.blocks[number].name,
            )


def masses_of(structure: Structure) -> Array:
    """Return mass and moment of inertia of all blocks, zero for fixed ones (b, 2) [kg, kg m²]."""
    masses = np.zeros((len(structure.blocks), 2))
    for number in structure.free:
        block = structure.blocks[number]
        density = structure.density(block) * structure.width
        masses[number] = density * block.area, density * block.polar_moment
    return masses


def _friction_table(structure: Structure, default: float | None) -> Array:
    """Return coefficients between any two bodies, the ground the last of them."""
    smallest = float(structure.friction.min(initial=inf))
    if default is None and isinf(smallest):
        raise InvalidInput(
            "no joint of the structure slides, so that there is no friction between stones that "
            "fall: give friction"
        )
    general = smallest if default is None else check_number(default, "friction", minimum=0.0)
    # infinite friction of joints that never slide becomes 1000, since kernels multiply by it
    return np.minimum(_least_between(structure, structure.friction, general), 1e3)


def _cohesion_table(structure: Structure) -> Array:
    """Return c w between any two bodies, the least of their joints, and zero without a joint."""
    cohesion = np.array([joint.contact.cohesion for joint in structure.joints])
    return _least_between(structure, structure.width * cohesion, 0.0)


def _least_between(structure: Structure, values: Array, default: float) -> Array:
    """Return the least value of the joints between any two bodies, or the default without any."""
    count = len(structure.blocks) + 1
    table = np.full((count, count), np.nan)
    np.fmin.at(table, tuple(structure.pairs.T), values)
    table = np.fmin(table, table.T)
    return np.where(np.isnan(table), default, table)


def _rocking_table(structure: Structure, ratio: float | Mapping[str, float] | None) -> Array:
    """Return the rocking restitution between any two bodies, zero where none is given."""
    count = len(structure.blocks) + 1
    table = np.zeros((count, count))
    if ratio is None:
        return table
    if isinstance(ratio, Mapping):
        pairs = {joint.name: joint.blocks for joint in structure.joints}
        for name, value in ratio.items():
            if name not in pairs:
                raise InvalidInput(
                    f"rocking_ratio names joint {name!r}, which the structure has not"
                )
            a, b = pairs[name]
            table[a, b] = table[b, a] = _check_ratio(value)
    else:
        table[:] = _check_ratio(ratio)
    return table


def _check_ratio(ratio: float) -> float:
    """Return the restitution of a rocking block, which must be between 0 and 1."""
    if not 0.0 < check_number(ratio, "rocking_ratio") <= 1.0:
        raise InvalidInput(
            f"rocking_ratio {ratio:g} is not between 0 and 1: give the angular velocity after an "
            "impact over that before"
        )
    return float(ratio)


def _ground_level(structure: Structure, level: float | None) -> float:
    """Return the level of the ground, by default that of the lowest fixed block [m]."""
    feet = [float(block.points[:, 1].min()) for block in structure.blocks]
    fixed = [foot for foot, block in zip(feet, structure.blocks, strict=True) if block.fixed]
    ground = min(fixed) if level is None else check_number(level, "level [m]")
    number = min(structure.free, key=feet.__getitem__)
    if feet[number] < ground - CONTACT_TOLERANCE * structure.size:
        raise InvalidInput(
            f"the ground at {ground:.4g} m lies above the foot of block "
            f"'{structure.blocks[number].name}' at {feet[number]:.4g} m: give a lower level"
        )
    return ground


def _block_pieces(block: Block) -> list[tuple[Array, NDArray[np.bool_]]]:
    """Return convex pieces: vertices from the block's centroid, and whether edges are outer."""
    points = drop_straight_vertices(block.drawn(_chord_count(block))) - block.centroid
    count = len(points)
    return [
        (
            points[list(piece)],
            np.array([(a + 1) % count == b for a, b in pairwise((*piece, piece[0]))]),
        )
        for piece in split_convex(points)
    ]


def _chord_count(block: Block, chord: float = np.radians(15.0)) -> int:
    """Return the number of chords for an arc; at 15° they deviate by 0.9 % of the radius."""
    if block.centre is None:
        return 1
    start, end = block.points[:2] - np.array(block.centre)
    turn = abs(np.arctan2(start[0] * end[1] - start[1] * end[0], start @ end))
    return int(np.ceil(turn / chord - 1e-9))


def split_convex(points: Array) -> list[Piece]:
    """Split an outline into convex pieces, as numbers of its vertices, anticlockwise."""
    outline = tuple(range(len(points)))
    if _is_convex(points, outline):
        return [outline]
    pieces = _triangulate(points)
    while (merged := _merge_two(points, pieces)) is not None:
        pieces = merged
    return pieces


def _signed_area(points: Array, a: int, b: int, c: int) -> float:
    """Return twice the area of a triangle, positive if anticlockwise."""
    (ux, uy), (vx, vy) = points[b] - points[a], points[c] - points[b]
    return float(ux * vy - uy * vx)


def _is_convex(points: Array, piece: Piece) -> bool:
    """Return whether a piece turns left at each of its vertices."""
    n = len(piece)
    turns = [_signed_area(points, piece[k - 1], piece[k], piece[(k + 1) % n]) for k in range(n)]
    return min(turns) > 0.0


def _triangulate(points: Array) -> list[Piece]:
    """Cut an outline into triangles, one ear after another."""
    remaining = list(range(len(points)))
    triangles: list[Piece] = []
    while len(remaining) > 2:
        count = len(remaining)
        ear = next((k for k in range(count) if _is_ear(points, remaining, k)), None)
        if ear is None:
            raise InvalidStructure(
                f"an outline of {len(points)} vertices near {points[remaining[0]]} crosses itself: "
                "correct it there"
            )
        triangles.append((remaining[ear - 1], remaining[ear], remaining[(ear + 1) % count]))
        del remaining[ear]
    return triangles


def _is_ear(points: Array, remaining: list[int], k: int) -> bool:
    """Return whether the triangle at a vertex is inside, with no other vertex in it."""
    a, b, c = remaining[k - 1], remaining[k], remaining[(k + 1) % len(remaining)]
    if _signed_area(points, a, b, c) <= 0.0:
        return False
    return not any(
        min(_signed_area(points, *edge, other) for edge in ((a, b), (b, c), (c, a))) >= 0.0
        for other in remaining
        if other not in (a, b, c)
    )


def _merge_two(points: Array, pieces: list[Piece]) -> list[Piece] | None:
    """Return the pieces with two of them merged, or None if no union is convex."""
    for one, other in combinations(pieces, 2):
        union = _union(one, other)
        if union is not None and _is_convex(points, union):
            return [piece for piece in pieces if piece not in (one, other)] + [union]
    return None


def _union(one: Piece, other: Piece) -> Piece | None:
    """Return the union of two pieces across their common edge, or None without."""
    for k in range(len(one)):
        start, end = one[k], one[(k + 1) % len(one)]
        if start in other and other[(other.index(start) - 1) % len(other)] == end:
            first = other.index(start)
            around = other[first:] + other[:first]  # from start, all the way to end
            turned = one[k + 1 :] + one[: k + 1]  # from end, all the way to start
            return turned[:-1] + around[:-1]
    return None
