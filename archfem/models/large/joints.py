"""Joint segments between blocks in corotational coordinates.

Between faces that stay plane a joint is one segment, on the overlap of the whole faces of both
blocks, which changes as they slide.
Where faces bend, or belong to a fill, each facet of the mesh is a segment between the two pairs of
nodes at its ends. Displacement and rotation of its faces are linear in the deformations of the
blocks in their frames. A segment therefore follows the equations of plane faces. Its places stay
opposite as in the mesh.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy import sparse

from archfem._typing import Array
from archfem.errors import InvalidInput
from archfem.joints.contact_law import ContactLaw
from archfem.joints.large.face_kinematics import FaceKinematics
from archfem.joints.large.forces import LargeDisplacementJoints
from archfem.joints.large.overlap_law import FaceLaw
from archfem.joints.large.point_law import CONTACT_RECORD
from archfem.joints.large.rates import find_rate_blocks
from archfem.joints.normal_law import Facets
from archfem.masonry.structure import Structure
from archfem.models.linear_blocks import LinearBlockModel, joint_orientation

# Deviation of a face from its nearest plane, relative to its motion, that counts as round-off [-]
PLANE_FACE_TOLERANCE = 1e-9

Blocks = Mapping[int, tuple[range, bool]]  # coordinates of each free block, and whether it rotates


@dataclass(frozen=True, eq=False)
class JointSegments:
    """Segments of the joints of a structure."""

    structure: Structure
    joint: Any  # joint of each segment (j,)
    first: Any  # first joint point of each segment, and the number of all (j + 1,)
    segment_offset: Array  # from the joint's mid-depth to that of the segment (j,) [m]
    depth: Array  # length of the segment (j,) [m]

    @classmethod
    def of(cls, model: LinearBlockModel) -> "JointSegments":
        """Return the segments of the joints of a model."""
        points, depths = model.operator.points, model.structure.depths
        bounds = np.searchsorted(points.joint, np.arange(points.joint_count + 1))
        segments: list[tuple[int, int, float, float]] = []
        for number, (begin, end) in enumerate(pairwise(bounds)):
            if _is_plane(model, begin, end):
                segments.append((number, begin, 0.0, depths[number]))
                continue
            if not isinstance(model.operator.law, Facets):  # they bend between springs
                raise InvalidInput(
                    f"the faces of joint '{model.structure.joints[number].name}' bend, and large "
                    "displacements of such joints exist with exact quadrature only: leave "
                    "quadrature out, or take fidelity 'faces' or 'rigid'"
                )
            for point in range(begin, end, 2):
                low, high = points.offset[point : point + 2]
                segments.append((number, point, 0.5 * (low + high), abs(high - low)))
        joint, first, offset, depth = map(np.array, zip(*segments, strict=True))
        return cls(model.structure, joint, np.append(first, len(points.offset)), offset, depth)

    @property
    def middles(self) -> Array:
        """Middles of the segments before anything moved (j, 2) [m]."""
        tangents = self.structure.tangents[self.joint]
        return self.structure.middles[self.joint] + self.segment_offset[:, None] * tangents

    @property
    def paired(self) -> Any:
        """Whether each segment is one of several of its joint (j,)."""
        return np.bincount(self.joint)[self.joint] > 1

    @property
    def of_point(self) -> Any:
        """Segment of each joint point (p,)."""
        return np.repeat(np.arange(len(self.joint)), np.diff(self.first))

    def fixed_poses(self, support_motion: Array) -> Array:
        """Return poses of the faces of fixed blocks, 0 of others (j, 2, 3) [m, m, rad]."""
        pairs = self.structure.pairs[self.joint]
        x, y, turn = np.moveaxis(support_motion[pairs], -1, 0)
        rx, ry = np.moveaxis(self.middles[:, None] - self.structure.centroids[pairs], -1, 0)
        # (R - I) r, with cos θ - 1 by the half angle
        less = -2.0 * np.sin(0.5 * turn) ** 2
        dx, dy = less * rx - np.sin(turn) * ry, np.sin(turn) * rx + less * ry
        return np.stack([x + dx, y + dy, turn], axis=-1)


def _is_plane(model: LinearBlockModel, begin: int, end: int) -> bool:
    """Return whether opening and slip stay linear along a joint."""
    operator, offset = model.operator, model.operator.points.offset[begin:end]
    if end - begin < 3:
        return True
    # projection onto deviations from straight lines
    line = np.column_stack([np.ones_like(offset), offset])
    deviation = np.eye(len(offset)) - line @ np.linalg.pinv(line)
    for rows in (operator.opening[begin:end], operator.slip[begin:end]):
        used = rows[:, np.unique(rows.indices)].toarray()
        largest = np.abs(deviation @ used).max(initial=0.0)
        if largest > PLANE_FACE_TOLERANCE * np.abs(used).max(initial=0.0):
            return False
    return True


def build_large_joints(
    model: LinearBlockModel, segments: JointSegments, blocks: Blocks, centres: Array
) -> LargeDisplacementJoints:
    """Build the joints between blocks in corotational coordinates."""
    structure, normals = model.structure, model.structure.normals[segments.joint]
    return LargeDisplacementJoints(
        _build_kinematics(model, segments, blocks, centres),
        _build_law(model, segments),
        np.arctan2(normals[:, 1], normals[:, 0]),
        joint_orientation(structure)[segments.joint],
        segments.joint,
        segments.segment_offset,
        len(structure.joints),
        np.zeros((len(segments.joint), 4)),
    )


def measure_segments(
    model: LinearBlockModel, segments: JointSegments, opening: Any, slip: Any
) -> list[Any]:
    """Return opening, slip, rotation, elongation of segments from those at points (j, …)."""
    points, segment = model.operator.points, segments.of_point
    orientation = joint_orientation(model.structure)[segments.joint]
    offset = orientation[segment] * (points.offset - segments.segment_offset[segment])
    # weighted mean over a segment, and slope along it, to the left of the normal
    shape, entries = (len(segments.joint), len(segment)), (segment, np.arange(len(segment)))
    weight = points.weight / np.bincount(segment, points.weight)[segment]
    mean = sparse.csr_matrix((weight, entries), shape)
    inertia = np.bincount(segment, weight * offset**2)[segment]
    slope = sparse.csr_matrix((weight * offset / inertia, entries), shape)
    to_left = sparse.diags(orientation[segment]) @ slip
    elongation = sparse.diags(segments.depth) @ (slope @ to_left)
    return [mean @ opening, mean @ to_left, -(slope @ opening), elongation]


def _build_kinematics(
    model: LinearBlockModel, segments: JointSegments, blocks: Blocks, centres: Array
) -> FaceKinematics:
    """Build the kinematics of the faces on both sides of the segments."""
    structure, count = model.structure, len(segments.joint)
    operator = model.operator
    measures = measure_segments(model, segments, operator.opening, operator.slip)
    measures = [matrix.tocsr() for matrix in measures]
    columns, has_frame = _face_coordinates(structure, segments, blocks, measures)
    most = max(3, *(len(numbers) for numbers in columns.values()))
    index, size = np.zeros((count, 2, most), int), np.zeros((count, 2), int)
    shapes, stretch = np.zeros((count, 2, 3, most)), np.zeros((count, 2, most))
    normals, left = structure.normals[segments.joint], np.zeros((count, 2))
    left[:, 0], left[:, 1] = -normals[:, 1], normals[:, 0]
    for (segment, side), numbers in columns.items():
        # rigid motions follow from the frame, not from shapes
        first, end = (3 if has_frame[segment, side] else 0), len(numbers)
        index[segment, side, :end], size[segment, side] = numbers, end
        sign = 2 * side - 1
        g, s, turn, longer = (
            sign * matrix[segment].toarray()[0, numbers[first:]] for matrix in measures
        )
        axes = np.column_stack([normals[segment], left[segment]])
        shapes[segment, side, :2, first:end] = axes @ np.stack([g, s])
        shapes[segment, side, 2, first:end] = turn
        stretch[segment, side, first:end] = longer
    if np.abs(stretch).max(initial=0.0) <= PLANE_FACE_TOLERANCE * np.abs(shapes).max(initial=0.0):
        stretch = stretch[:, :, :0]
    arm = segments.middles[:, None] - centres[structure.pairs[segments.joint]]
    fixed, starts = segments.fixed_poses(model.support_motion), find_rate_blocks(index, size)[0]
    return FaceKinematics(index, size, has_frame, arm, shapes, stretch, fixed, starts)


def _face_coordinates(
    structure: Structure, segments: JointSegments, blocks: Blocks, measures: list[Any]
) -> tuple[dict[tuple[int, int], Any], Any]:
    """Return the coordinates that move each face, and whether its block has a frame (j, 2)."""
    columns: dict[tuple[int, int], Any] = {}
    has_frame = np.zeros((len(segments.joint), 2), bool)
    used = sum(abs(matrix) for matrix in measures).tocsr()
    for segment, joint in enumerate(segments.joint):
        touched = used.indices[used.indptr[segment] : used.indptr[segment + 1]]
        for side, block in enumerate(map(int, structure.pairs[joint])):
            if block not in blocks:
                columns[segment, side] = np.zeros(0, int)
                continue
            span, has_frame[segment, side] = blocks[block]
            of_block = np.sort(touched[(touched >= span.start) & (touched < span.stop)])
            if has_frame[segment, side]:  # the frame moves every face
                of_block = np.concatenate([span[:3], of_block[of_block >= span.start + 3]])
            columns[segment, side] = of_block
    return columns, has_frame


def _build_law(model: LinearBlockModel, segments: JointSegments) -> FaceLaw:
    """Build the parameters of the law of the segments."""
    structure, points = model.structure, model.operator.points
    contacts = [structure.joints[joint].contact for joint in segments.joint]
    law, segment = model.operator.law, segments.of_point
    depth, orientation = segments.depth[segment], joint_orientation(structure)[points.joint]
    # intrados and extrados to the right and left of the normals
    end_slip = structure.end_slips * joint_orientation(structure)[:, None]
    end_slip = np.where(joint_orientation(structure)[:, None] > 0.0, end_slip, end_slip[:, ::-1])
    return FaceLaw(
        segments.depth,
        structure.width,
        np.array([ContactLaw.of(contact) for contact in contacts], CONTACT_RECORD),
        segments.first,
        orientation * (points.offset - segments.segment_offset[segment]) / depth,
        np.repeat(law.area, law.end_count) / (structure.width * depth),
        points.shear_spring,
        law.end_count == 2,
        segments.paired,
        np.ascontiguousarray(end_slip[segments.joint]),
    )
