"""Marks at the joints at one instant: thrust line, hinges, sliding and open joints.

Also the state to be drawn: its model, coordinates and joint resultants.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from archfem._typing import Array
from archfem.errors import logger
from archfem.joints.criteria import Criteria, with_failure_flags
from archfem.joints.resultants import check_instant, joint_dataset
from archfem.limit.linear_programme import RigidBlocks
from archfem.masonry.structure import Structure, rigid_motion_matrix
from archfem.models.model import Model, check_coordinate_count
from archfem.statics.equilibrium import Equilibrium

# Largest displacement in a figure, relative to the size of the structure
DRAWN_DISPLACEMENT = 0.06

# Variables of a joint dataset from which marks are derived
MARKED_QUANTITIES = ("eccentricity", "V", "hinge", "slide", "open")


@dataclass(frozen=True, eq=False)
class Marks:
    """Places of the marks at one instant; none by default."""

    # points of the thrust line (n_joints, 2) [m]; NaN in an open joint, and in one that is not of
    # a ring or pier
    thrust: Array = field(default_factory=lambda: np.zeros((0, 2)))
    # segments of the thrust line across the blocks between two such joints (n_links, 2, 2) [m]
    links: Array = field(default_factory=lambda: np.zeros((0, 2, 2)))
    # contact points of hinged joints (n_hinges, 2) [m]
    hinges: Array = field(default_factory=lambda: np.zeros((0, 2)))
    # outlines of two opposite arrows beside each sliding joint: the upper block's, then the
    # lower's (2 n_sliding, 7, 2) [m]
    slips: Array = field(default_factory=lambda: np.zeros((0, 7, 2)))
    # ends of the open joints (n_open, 2, 2) [m]
    gaps: Array = field(default_factory=lambda: np.zeros((0, 2, 2)))


class Marker:
    """Computes the marks of a structure at successive instants."""

    def __init__(self, structure: Structure, shown: NDArray[np.bool_]) -> None:
        self._structure, self._shown = structure, shown
        self._pairs = joint_pairs(structure, shown)
        self._depth_vectors = structure.tangents * structure.depths[:, None]

    def at(self, joints: xr.Dataset | Mapping[str, Array], shift: Array | None = None) -> Marks:
        """Return the marks at an instant, with joint ends displaced by `shift`."""
        structure, shown = self._structure, self._shown
        e, shear, hinge, slide, opened = (np.asarray(joints[key]) for key in MARKED_QUANTITIES)
        shift = np.zeros((len(structure.joints), 2, 2)) if shift is None else shift
        ends, share = structure.ends + shift, 0.5 + e[:, None]
        # displacement of the point of the thrust, interpolated between the joint's ends
        carried = (1.0 - share) * shift[:, 0] + share * shift[:, 1]
        side = np.where(shown, hinge, 0)
        hinged = np.flatnonzero(side)
        sliding = np.flatnonzero(shown & slide).tolist()
        slips = [self._slip_arrows(k, ends[k], shear[k]) for k in sliding]
        thrust = carried + self.points(e)
        links = thrust[self._pairs]
        return Marks(
            thrust=thrust,
            links=links[np.isfinite(links).all(axis=(1, 2))],
            hinges=ends[hinged, (side[hinged] > 0).astype(int)],
            slips=np.array(slips).reshape(-1, 7, 2),
            gaps=ends[shown & opened],
        )

    def points(self, eccentricity: Array) -> Array:
        """Return points in undisplaced joints (n_joints, 2) [m]; NaN in those not shown."""
        points = self._structure.middles + eccentricity[:, None] * self._depth_vectors
        return np.where(self._shown[:, None], points, np.nan)

    @cached_property
    def _spacing(self) -> Array:
        """Distance of each joint to the nearest other one that is shown (n_joints,) [m]."""
        middles = self._structure.middles
        distance = np.linalg.norm(middles[:, None] - middles[self._shown], axis=2)
        return np.where(distance > 0.0, distance, np.inf).min(axis=1, initial=np.inf)

    def _slip_arrows(self, number: int, ends: Array, shear: float) -> Array:
        """Return outlines of two arrows along a joint with these ends (2, 7, 2) [m]."""
        structure = self._structure
        joint, normal, middle = structure.joints[number], structure.normals[number], ends.mean(0)
        along, length = ends[1] - ends[0], float(np.linalg.norm(ends[1] - ends[0]))
        tangent = along / length if length > 0.0 else np.array(joint.tangent)
        # the normal rotates with the joint, by the angle between its old and new tangent
        cos, sin = tangent @ joint.tangent, tangent @ [-joint.tangent[1], joint.tangent[0]]
        normal = np.array([[cos, -sin], [sin, cos]]) @ normal
        # length of the arrows and their distance from the joint, relative to its depth
        arrow_length, distance = 0.55, 0.14
        # arrows of neighbouring joints must not overlap; those of a shallow joint must be seen
        fitting = 0.9 / (2.0 * distance + 0.5 * arrow_length) * self._spacing[number]
        depth = min(max(joint.depth, 0.03 * structure.size), fitting)
        # outline of an arrow of length 1 along x
        x = arrow_length * depth * np.array([-0.5, 0.1, 0.1, 0.5, 0.1, 0.1, -0.5])[:, None]
        y = arrow_length * depth * np.array([-0.09, -0.09, -0.25, 0.0, 0.25, 0.09, 0.09])[:, None]
        arrow = x * np.sign(shear) * tangent + y * normal
        offset = distance * depth * normal
        return np.array([middle + offset + arrow, middle - offset - arrow])


def joint_marks(structure: Structure, joints: xr.Dataset, *, shift: Array | None = None) -> Marks:
    """Return the marks at joints of rings and piers, or at all where there are neither."""
    return Marker(structure, joints["judged"].values).at(joints, shift)


def joint_pairs(structure: Structure, shown: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return pairs of shown joints between which the thrust line crosses a block (n_links, 2)."""
    touching: list[list[int]] = [[] for _ in structure.blocks]
    for number in np.flatnonzero(shown):
        for block in structure.joints[number].blocks:
            touching[block].append(int(number))
    # A block passes on a single thrust if it is free, has two joints, and is of a part whose joints
    # are shown: no line runs along the ground from one pier to the next. Walls in bond have no
    # line, as only blocks at their edges have two joints.
    roles = {structure.joints[number].role for number in np.flatnonzero(shown)}
    walls = {structure.joints[number].part for number in np.flatnonzero(structure.heads)}
    free = [(number, structure.blocks[number]) for number in structure.free]
    passing = [k for k, block in free if block.role in roles and block.part not in walls]
    pairs = [touching[number] for number in passing if len(touching[number]) == 2]
    return np.array(pairs, dtype=np.intp).reshape(-1, 2)


def support_outlines(model: Model, magnification: float) -> list[Array]:
    """Return the outlines of the fixed blocks, displaced with the supports, each (k, 2) [m]."""
    return [
        block.drawn() + magnification * rigid_motion_matrix(block.drawn(), block.centroid) @ motion
        for block, motion in zip(model.structure.blocks, model.support_motion, strict=True)
        if block.fixed
    ]


def scale_motion(structure: Structure, motion: Array) -> Array:
    """Scale a motion of all blocks (n_blocks, 3) so that it can be seen in a figure."""
    largest = RigidBlocks(structure).largest_displacement(motion)
    return motion * DRAWN_DISPLACEMENT * structure.size / largest


def outline_moving_blocks(structure: Structure, motion: Array) -> list[Array]:
    """Return the displaced outlines of the blocks that move, each (k, 2) [m]."""
    outlines = []
    for block, block_motion in zip(structure.blocks, motion, strict=True):
        displacement = rigid_motion_matrix(block.drawn(), block.centroid) @ block_motion
        # a smaller displacement cannot be seen
        if np.abs(displacement).max() > 1e-4 * structure.size:
            outlines.append(block.drawn() + displacement)
    return outlines


def round_magnification(displacement: float) -> float:
    """Return the magnification 1, 2, 5, 10, … that best shows a displacement relative to size."""
    if displacement * 1.5 >= DRAWN_DISPLACEMENT or displacement == 0.0:
        return 1.0
    steps = np.outer(10.0 ** np.arange(12), [1.0, 2.0, 5.0]).ravel()
    return float(steps[np.argmin(np.abs(np.log(steps * displacement / DRAWN_DISPLACEMENT)))])


def model_and_coordinates(model: Model, state: Equilibrium | Array) -> tuple[Model, Array]:
    """Return the model and the coordinates (n,) of a state."""
    model, q = (state.model, state.q) if isinstance(state, Equilibrium) else (model, state)
    check_coordinate_count(model, len(q))
    return model, q


def joints_of_state(
    model: Model, q: Array, joints: xr.Dataset | None, criteria: Criteria | None
) -> xr.Dataset:
    """Return the joints in a state to be drawn; warn where coordinates leave shear ambiguous."""
    if joints is not None:
        check_instant(model.structure, joints)
        return with_failure_flags(joints, criteria)
    further = model.updated_memory(q) - model.memory
    if not model.memory.any() and further.any():
        logger.warning(
            "joints slide at these coordinates, and the model does not contain their slip before: "
            "shear and sliding in the figure may be wrong; give the equilibrium "
            "in place of its coordinates, or joints=run.joints.sel(time=…)"
        )
    observer, moved = model.observer(), model.large_displacements
    faces = observer.faces(observer.read(q)) if moved else None
    given = model.structure, model.resultants(q)
    return joint_dataset(*given, criteria=criteria, faces=faces, moved=moved)
