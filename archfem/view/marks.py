"""What a picture shows of the joints at one instant: thrust line, hinges, slips and gaps."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import sparse

from archfem.arrays import Array
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

SNUG = 0.9 / (2.0 * APART + 0.5 * LENGTH)
"""The same at most, relative to the distance to the next joint: arrows of both have room."""

TOLD = ("eccentricity", "V", "hinge", "slide", "open")
"""What is known of joints that are marked."""


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


class Marker:
    """Finds what to draw at the joints of a structure, instant after instant.

    Args:
        structure: whose joints they are.
        shown: which joints have marks: those that are judged (n_joints,).
    """

    def __init__(self, structure: Structure, shown: NDArray[np.bool_]) -> None:
        self._structure, self._shown = structure, shown
        self._pairs = linked(structure, shown)
        self._line = structure.tangents * structure.depths[:, None]

    def at(self, joints: xr.Dataset | Mapping[str, Array], shift: Array | None = None) -> Marks:
        """Return the marks of an instant, moved by `shift`.

        Args:
            joints: eccentricity, V, hinge, slide and open, each (n_joints,).
            shift: displacements, as drawn, of both ends of each joint, intrados first
                (n_joints, 2, 2) [m]; by default none.
        """
        structure, shown = self._structure, self._shown
        tilt, shear, hinge, slide, apart = (np.asarray(joints[key]) for key in TOLD)
        shift = np.zeros((len(structure.joints), 2, 2)) if shift is None else shift
        ends, share = structure.ends + shift, 0.5 + tilt[:, None]
        carried = (1.0 - share) * shift[:, 0] + share * shift[:, 1]
        line = structure.middles + tilt[:, None] * self._line
        side = np.where(shown, hinge, 0)
        failed = np.flatnonzero(side)
        slips = [self._slip(int(k), ends[k], shear[k]) for k in np.flatnonzero(shown & slide)]
        thrust = np.where(shown[:, None], carried + line, np.nan)
        links = thrust[self._pairs]
        return Marks(
            thrust=thrust,
            links=links[np.isfinite(links).all(axis=(1, 2))],
            hinges=ends[failed, (side[failed] > 0).astype(int)],
            slips=np.array(slips).reshape(-1, *ARROW.shape),
            gaps=ends[shown & apart],
        )

    @cached_property
    def _room(self) -> Array:
        """Distance of each joint to the next that is shown (n_joints,) [m]."""
        middles = self._structure.middles
        apart = np.linalg.norm(middles[:, None] - middles[self._shown], axis=2)
        found: Array = np.where(apart > 0.0, apart, np.inf).min(axis=1, initial=np.inf)
        return found

    def _slip(self, number: int, ends: Array, shear: float) -> Array:
        """Two arrows that say how a joint slips, whose ends are there (2, 7, 2) [m]."""
        structure = self._structure
        joint, normal, middle = structure.joints[number], structure.normals[number], ends.mean(0)
        along, length = ends[1] - ends[0], float(np.linalg.norm(ends[1] - ends[0]))
        if length > 0.0:
            (x, y), (c, s) = normal, along / length
            turn = np.array([c, s]) @ joint.tangent, s * joint.tangent[0] - c * joint.tangent[1]
            normal = np.array([turn[0] * x - turn[1] * y, turn[1] * x + turn[0] * y])
        else:
            c, s = joint.tangent
        sense = np.sign(shear) * np.array([c, s])
        depth = min(max(joint.depth, SHORTEST * structure.size), SNUG * self._room[number])
        outline = ARROW * LENGTH * depth
        arrow = outline[:, :1] * sense + outline[:, 1:] * normal
        away = APART * depth * normal
        return np.array([middle + away + arrow, middle - away - arrow])


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
    return Marker(structure, joints["judged"].values).at(joints, shift)


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


def round_magnification(displacement: float) -> float:
    """Return one of 1, 2, 5, 10, … that brings a displacement nearest to `SWING`.

    Args:
        displacement: the largest, relative to the size of the structure [-].
    """
    if displacement * 1.5 >= SWING or displacement == 0.0:
        return 1.0
    steps = np.outer(10.0 ** np.arange(12), [1.0, 2.0, 5.0]).ravel()
    return float(steps[np.argmin(np.abs(np.log(steps * displacement / SWING)))])
