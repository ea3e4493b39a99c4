"""Displacements of joint faces and blocks as linear functions of the coordinates.

At each joint the gap at mid-depth, rotation and slip of its faces, and the displacements of the
corners of all free blocks: D q + d.
"""

from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from archfem._typing import Array
from archfem.joints.operator import JointOperator
from archfem.joints.resultants import face_matrix
from archfem.masonry.structure import Structure, rigid_motion_matrix
from archfem.models.model import Cells, Model, Observer

_observers: WeakKeyDictionary[Model, "LinearObserver"] = WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class LinearObserver(Observer):
    """Observer of a model of small displacements."""

    matrix: sparse.csr_matrix  # D, from coordinates to readings (r, n)
    offset: Array  # d, readings at q = 0, due to moved supports and construction (r,)
    joint_count: int
    corner_blocks: NDArray[np.intp]
    structure: Structure
    cells: Cells
    support_motion: Array  # (n_blocks, 3) [m, m, rad]

    def read(self, q: Array) -> Array:
        """Return gaps, rotations and slips of joints, then corner displacements, in a row (r,)."""
        return np.asarray(self.matrix @ q + self.offset)

    def read_many(self, states: Array) -> Array:
        """Return the rows of `read` for many states (steps, r)."""
        return np.asarray((self.matrix @ states.T).T + self.offset)

    def joint_ends(self, q: Array) -> Array:
        """Return the displacements of both ends of each joint (n_joints, 2, 2) [m]."""
        return (self._end_rows @ q).reshape(-1, 2, 2) + self._end_shift

    @cached_property
    def _end_rows(self) -> sparse.csr_matrix:
        """Matrix from coordinates to displacements of the joint ends (4 n_joints, n)."""
        # an end is midway between its two blocks, and supports do not depend on the coordinates
        fixed = sparse.csr_matrix((2, self.matrix.shape[1]))
        rows = [
            sum(
                fixed
                if self.structure.blocks[number].fixed
                else 0.5 * self.cells.displacement_rows(number, end)
                for number in joint.blocks
            )
            for joint in self.structure.joints
            for end in joint.ends
        ]
        return sparse.vstack(rows, format="csr")

    @cached_property
    def _end_shift(self) -> Array:
        """Displacements of the joint ends due to moved supports (n_joints, 2, 2) [m]."""
        shift = np.zeros((len(self.structure.joints), 2, 2))
        for number, joint in enumerate(self.structure.joints):
            for block in joint.blocks:
                motion = rigid_motion_matrix(joint.ends, self.structure.blocks[block].centroid)
                shift[number] += 0.5 * motion @ self.support_motion[block]
        return shift


def linear_observer(model: Model, operator: JointOperator) -> LinearObserver:
    """Return the observer of a model of small displacements, built once for each model."""
    if model not in _observers:
        _observers[model] = _build_observer(model, operator)
    return _observers[model]


def _build_observer(model: Model, operator: JointOperator) -> LinearObserver:
    """Build an observer from the joint operator and the cells."""
    structure, cells = model.structure, model.cells
    of_faces, face_offset = face_matrix(operator)
    corners = cells.corners(structure)
    of_corners = cells.shape_functions[np.add.outer(2 * corners, (0, 1)).ravel()]
    return LinearObserver(
        sparse.vstack([of_faces, of_corners], "csr"),
        # corners are read from zero on
        np.concatenate([face_offset, np.zeros(2 * len(corners))]),
        len(structure.joints),
        cells.block[corners],
        structure,
        cells,
        model.support_motion,
    )
