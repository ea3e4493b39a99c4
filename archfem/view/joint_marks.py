"""What a picture shows of the joints at one instant: thrust line, hinges, slips and gaps.

A state that is to be drawn: of which model, at which coordinates, and what its joints carry.
"""

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from archfem._typing import Array
from archfem.errors import InvalidInput
from archfem.joints.criteria import Criteria, with_failure_flags
from archfem.joints.resultants import check_instant, joint_dataset
from archfem.limit.linear_programme import RigidBlocks
from archfem.masonry.structure import Structure, rigid_motion_matrix
from archfem.models.model import Model
from archfem.statics.equilibrium import Equilibrium

# Outline of an arrow of length 1 along x (7, 2)
ARROW = np.array(
    [[-0.5, -0.09], [0.1, -0.09], [0.1, -0.25], [0.5, 0.0], [0.1, 0.25], [0.1, 0.09], [-0.5, 0.09]]
)

# Largest displacement in a picture, relative to the size of the structure
SWING = 0.06


# Length of the arrows of a slip, and their distance from the joint, relative to its depth
LENGTH, APART = 0.55, 0.14


# The same at most, relative to the distance to the next joint: arrows of both have room
SNUG = 0.9 / (2.0 * APART + 0.5 * LENGTH)

# What is known of joints that are marked
TOLD = ("eccentricity", "V", "hinge", "slide", "open")


@dataclass(frozen=True, eq=False)
class Marks:
    """Where to draw what."""

    # points of the thrust line (n_joints, 2) [m]; NaN in an open joint, and in one that is not of
    # a ring or pier
    thrust: Array
    # pieces of the thrust line, through the blocks between two such joints (n_links, 2, 2) [m]
    links: Array
    hinges: Array  # points where hinged joints stay in contact (n_hinges, 2) [m]
    # outlines of two opposite arrows beside each sliding joint: the higher block's, then the
    # lower's (2 n_sliding, 7, 2) [m]
    slips: Array
    gaps: Array  # ends of the joints that have come apart (n_open, 2, 2) [m]


# Of joints of which nothing is to be drawn
NO_MARKS = Marks(*(np.zeros((0, *rest)) for rest in ((2,), (2, 2), (2,), (7, 2), (2, 2))))


class Marker:
    """Finds what to draw at the joints of a structure, instant after instant."""

    def __init__(self, structure: Structure, shown: NDArray[np.bool_]) -> None:
        self._structure, self._shown = structure, shown
        self._pairs = linked(structure, shown)
        self._line = structure.tangents * structure.depths[:, None]

    def at(self, joints: xr.Dataset | Mapping[str, Array], shift: Array | None = None) -> Marks:
        """Return the marks of an instant, moved by `shift`."""
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
        return np.where(apart > 0.0, apart, np.inf).min(axis=1, initial=np.inf)

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
        # depth that arrows are made for at least, relative to the size of the structure
        depth = min(max(joint.depth, 0.03 * structure.size), SNUG * self._room[number])
        outline = ARROW * LENGTH * depth
        arrow = outline[:, :1] * sense + outline[:, 1:] * normal
        away = APART * depth * normal
        return np.array([middle + away + arrow, middle - away - arrow])


def joint_marks(structure: Structure, joints: xr.Dataset, *, shift: Array | None = None) -> Marks:
    """Find what to draw at the joints of rings and piers, or at all where there are neither."""
    return Marker(structure, joints["judged"].values).at(joints, shift)


def linked(structure: Structure, shown: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return pairs of joints with a block between them that has no other shown joint (n_links, 2)."""
    touching: list[list[int]] = [[] for _ in structure.blocks]
    for number in np.flatnonzero(shown):
        for block in structure.joints[number].blocks:
            touching[block].append(int(number))
    pairs = [numbers for numbers in touching if len(numbers) == 2]
    return np.array(pairs, dtype=np.intp).reshape(-1, 2)


def support_outlines(model: Model, magnification: float) -> list[Array]:
    """Return the outlines of the fixed blocks, where they have moved, each (k, 2) [m]."""
    return [
        block.drawn() + magnification * rigid_motion_matrix(block.drawn(), block.centroid) @ motion
        for block, motion in zip(model.structure.blocks, model.support_motion, strict=True)
        if block.fixed
    ]


def swung(structure: Structure, motion: Array) -> Array:
    """Return a motion of all blocks, scaled so that the farthest point moves by `SWING`."""
    return motion * SWING * structure.size / RigidBlocks(structure).largest_displacement(motion)


def displaced(structure: Structure, motion: Array) -> list[Array]:
    """Return the outlines of those blocks that move, each (k, 2) [m], where a motion takes them."""
    outlines = []
    for block, own in zip(structure.blocks, motion, strict=True):
        by = rigid_motion_matrix(block.drawn(), block.centroid) @ own
        # displacement too small to be drawn, relative to the size of the structure
        if np.abs(by).max() > 1e-4 * structure.size:
            outlines.append(block.drawn() + by)
    return outlines


def round_magnification(displacement: float) -> float:
    """Return one of 1, 2, 5, 10, … that brings a displacement nearest to `SWING`."""
    if displacement * 1.5 >= SWING or displacement == 0.0:
        return 1.0
    steps = np.outer(10.0 ** np.arange(12), [1.0, 2.0, 5.0]).ravel()
    return float(steps[np.argmin(np.abs(np.log(steps * displacement / SWING)))])


logger = logging.getLogger("archfem")


def drawn(model: Model, state: Equilibrium | Array) -> tuple[Model, Array]:
    """Return the model and the coordinates (n,) of a state."""
    found, q = (state.model, state.q) if isinstance(state, Equilibrium) else (model, state)
    if len(q) != model.size:
        raise InvalidInput(
            f"there are {len(q)} coordinates, and the model has {model.size}: give the model, of "
            "the same cells and degree, that they were computed with"
        )
    return found, q


def joints_at(
    model: Model, q: Array, joints: xr.Dataset | None, criteria: Criteria | None
) -> xr.Dataset:
    """Return what the joints carry in a state that is to be drawn.

    Coordinates alone do not tell shear forces where joints have slid: then it warns.
    """
    if joints is not None:
        check_instant(model.structure, joints)
        return with_failure_flags(joints, criteria)
    further = model.updated_memory(q) - model.memory
    if not model.memory.any() and further.any():
        logger.warning(
            "joints slide at these coordinates, and the model does not remember how far they had "
            "slid before: what is drawn of shear and sliding may be wrong; give the equilibrium "
            "in place of its coordinates, or joints=run.joints.sel(time=…)"
        )
    observer, moved = model.observer(), model.large_displacements
    faces = observer.faces(observer.read(q)) if moved else None
    return joint_dataset(
        model.structure, model.resultants(q), criteria=criteria, faces=faces, moved=moved
    )
