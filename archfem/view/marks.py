"""What a picture shows of the joints at one instant: thrust line, hinges, slips and gaps."""

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import sparse

from archfem.arrays import Array
from archfem.joints.resultants import thrust_line
from archfem.limit.blocks import RigidBlocks
from archfem.masonry.rigid_motion import motion_of
from archfem.masonry.structure import Structure
from archfem.models.model import Model

ARROW = np.array(
    [[-0.5, -0.09], [0.1, -0.09], [0.1, -0.25], [0.5, 0.0], [0.1, 0.25], [0.1, 0.09], [-0.5, 0.09]]
)
"""Outline of an arrow of length 1 along x (7, 2)."""

SWING = 0.06
"""Largest displacement in a picture, relative to the size of the structure."""

STILL = 1e-4
"""Displacement too small to be drawn, relative to the size of the structure."""

LENGTH, APART = 0.55, 0.14
"""Length of the arrows of a slip, and their distance from the joint, relative to its depth."""

SHORTEST = 0.03
"""Depth that arrows are made for at least, relative to the size of the structure."""


@dataclass(frozen=True, eq=False)
class Marks:
    """Where to draw what.

    Attributes:
        thrust: points of the thrust line (n_joints, 2) [m]; NaN in an open joint, and in one that
            is not of a ring or pier.
        links: pieces of the thrust line, through the blocks between two such joints
            (n_links, 2, 2) [m].
        hinges: points where hinged joints stay in contact (n_hinges, 2) [m].
        slips: outlines of two opposite arrows beside each sliding joint: the higher block's,
            then the lower's (2 n_sliding, 7, 2) [m].
        gaps: ends of the joints that have come apart (n_open, 2, 2) [m].
    """

    thrust: Array
    links: Array
    hinges: Array
    slips: Array
    gaps: Array


NO_MARKS = Marks(*(np.zeros((0, *rest)) for rest in ((2,), (2, 2), (2,), (7, 2), (2, 2))))
"""Of joints of which nothing is to be drawn."""


def joint_marks(structure: Structure, joints: xr.Dataset, *, shift: Array | None = None) -> Marks:
    """Find what to draw at the joints of rings and piers, or at all where there are neither.

    Args:
        structure: whose joints they are.
        joints: as made by `joint_dataset`, at one instant, with their flags.
        shift: displacements, as drawn, of both ends of each joint, intrados first
            (n_joints, 2, 2) [m]; by default none.

    Returns:
        The marks, moved by `shift`.
    """
    shift = np.zeros((len(structure.joints), 2, 2)) if shift is None else shift
    ends = structure.ends + shift
    share = 0.5 + joints["eccentricity"].values[:, None]
    carried = (1.0 - share) * shift[:, 0] + share * shift[:, 1]
    shown = joints["judged"].values
    side = np.where(shown, joints["hinge"].values, 0)
    failed = np.flatnonzero(side)
    slipping = np.flatnonzero(shown & joints["slide"].values)
    arrows = [_slip(structure, k, ends[k], joints["V"].values[k]) for k in slipping]
    thrust = np.where(shown[:, None], carried + thrust_line(structure, joints).values, np.nan)
    links = thrust[linked(structure, shown)]
    return Marks(
        thrust=thrust,
        links=links[np.isfinite(links).all(axis=(1, 2))],
        hinges=ends[failed, (side[failed] > 0).astype(int)],
        slips=np.array(arrows).reshape(-1, *ARROW.shape),
        gaps=ends[shown & joints["open"].values],
    )


def linked(structure: Structure, shown: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return pairs of joints with a block between them that has no other shown joint (n_links, 2).

    Args:
        structure: whose joints they are.
        shown: whether each joint is (n_joints,).
    """
    touching: list[list[int]] = [[] for _ in structure.blocks]
    for number in np.flatnonzero(shown):
        for block in structure.joints[number].blocks:
            touching[block].append(int(number))
    pairs = [numbers for numbers in touching if len(numbers) == 2]
    return np.array(pairs, dtype=np.intp).reshape(-1, 2)


def _slip(structure: Structure, number: int, ends: Array, shear: float) -> Array:
    """Two arrows that say how a joint slips, whose ends are there (2, 7, 2) [m]."""
    joint, normal, middle = structure.joints[number], structure.normals[number], ends.mean(axis=0)
    along, length = ends[1] - ends[0], float(np.linalg.norm(ends[1] - ends[0]))
    if length > 0.0:
        (x, y), (c, s) = normal, along / length
        turn = np.array([c, s]) @ joint.tangent, s * joint.tangent[0] - c * joint.tangent[1]
        normal = np.array([turn[0] * x - turn[1] * y, turn[1] * x + turn[0] * y])
    else:
        c, s = joint.tangent
    sense = np.sign(shear) * np.array([c, s])
    depth = max(joint.depth, SHORTEST * structure.size)
    outline = ARROW * LENGTH * depth
    arrow = outline[:, :1] * sense + outline[:, 1:] * normal
    away = APART * depth * normal
    return np.array([middle + away + arrow, middle - away - arrow])


def joint_ends(model: Model) -> sparse.csr_matrix:
    """Return what gives displacements of both ends of each joint from coordinates.

    Each is the mean of the two blocks' displacements there, without what moving supports add.

    Args:
        model: whose joints they are.

    Returns:
        A matrix (4 n_joints, n): x and y of the intrados, then of the extrados, joint by joint.
    """
    still = sparse.csr_matrix((2, model.size))
    blocks = model.structure.blocks
    rows = [
        sum(
            still if blocks[number].fixed else 0.5 * model.cells.at(number, end)
            for number in joint.blocks
        )
        for joint in model.structure.joints
        for end in joint.ends
    ]
    return sparse.vstack(rows, format="csr")


def support_shift(model: Model) -> Array:
    """Return what moving supports add to the displacements of `joint_ends`.

    Args:
        model: with the motions of its supports.

    Returns:
        Displacements (n_joints, 2, 2) [m]: by joint, end (intrados first) and axis.
    """
    structure = model.structure
    shift = np.zeros((len(structure.joints), 2, 2))
    for number, joint in enumerate(structure.joints):
        for block in joint.blocks:
            motion = motion_of(joint.ends, structure.blocks[block].centroid)
            shift[number] += 0.5 * motion @ model.supports[block]
    return shift


def support_outlines(model: Model, magnification: float) -> list[Array]:
    """Return the outlines of the fixed blocks, where they have moved, each (k, 2) [m].

    Args:
        model: with the motions of its supports.
        magnification: of those motions [-].
    """
    return [
        block.drawn() + magnification * motion_of(block.drawn(), block.centroid) @ motion
        for block, motion in zip(model.structure.blocks, model.supports, strict=True)
        if block.fixed
    ]


def swung(structure: Structure, motion: Array) -> Array:
    """Return a motion of all blocks, scaled so that the farthest point moves by `SWING`.

    Args:
        structure: whose blocks move.
        motion: of any size (n_blocks, 3) [m, m, rad].

    Returns:
        The same motion, as large as it is drawn (n_blocks, 3) [m, m, rad].
    """
    return motion * SWING * structure.size / RigidBlocks(structure).reach(motion)


def displaced(structure: Structure, motion: Array) -> list[Array]:
    """Return the outlines of those blocks that move, each (k, 2) [m], where a motion takes them.

    Args:
        structure: whose blocks move.
        motion: about their centroids (n_blocks, 3) [m, m, rad].
    """
    outlines = []
    for block, own in zip(structure.blocks, motion, strict=True):
        by = motion_of(block.drawn(), block.centroid) @ own
        if np.abs(by).max() > STILL * structure.size:
            outlines.append(block.drawn() + by)
    return outlines
