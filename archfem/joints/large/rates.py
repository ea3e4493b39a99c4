"""The derivative of joint forces by the coordinates at the end of a step, compiled.

A joint segment sees its two faces by five numbers: the jump between them (x, y), both angles, and
the relative elongation. The derivative of its forces is Uᵀ L V plus a rotation stiffness. L (5, 5)
is the derivative of the law; U and V hold the derivatives of the five numbers by the coordinates,
mean over the step and at its end. Segments between the same coordinates add to one shared block.
"""

from typing import Any

import numpy as np

from archfem._numba import entry, kernel, summing_kernel
from archfem.joints.large.face_kinematics import FaceKinematics, shape_rates


def find_block_starts(index: Any, size: Any) -> Any:
    """Return the first entry of each block of `JointStepForces.rate` (j, 2, 2)."""
    # segments with the same coordinates on both faces share a block
    starts, count = np.zeros((len(index), 2, 2), np.int64), 0
    blocks: dict[Any, int] = {}
    for joint, counts in enumerate(size):
        coordinates = [tuple(index[joint, side, : counts[side]].tolist()) for side in range(2)]
        for side, other in np.ndindex(2, 2):
            key = coordinates[side], coordinates[other]
            if key not in blocks:
                blocks[key] = count
                count += len(key[0]) * len(key[1])
            starts[joint, side, other] = blocks[key]
    return starts


def count_entries(sides: FaceKinematics) -> int:
    """Return the number of entries of `JointStepForces.rate`."""
    sizes = sides.size[:, :, None] * sides.size[:, None, :]
    return int((sides.block_start + sizes).max(initial=0))


def find_rate_pairs(sides: FaceKinematics) -> Any:
    """Return the coordinates of rows and columns of `JointStepForces.rate` (2, e)."""
    pairs, done = np.zeros((2, count_entries(sides)), np.int64), set()
    for joint, side, other in np.ndindex(sides.block_start.shape):
        start = int(sides.block_start[joint, side, other])
        rows = sides.index[joint, side, : sides.size[joint, side]]
        columns = sides.index[joint, other, : sides.size[joint, other]]
        count = len(rows) * len(columns)
        if count and start not in done:
            done.add(start)
            pairs[0, start : start + count] = np.repeat(rows, len(columns))
            pairs[1, start : start + count] = np.tile(columns, len(rows))
    return pairs


@entry
def assemble_rates(sides, forces, workspace):  # type: ignore
    """Assemble the rate of all joints from the derivatives stored by `compute_step_forces`."""
    for k in range(len(forces.rate)):
        forces.rate[k] = 0.0
    for joint in range(len(sides.size)):
        _assemble_joint(sides, joint, forces, workspace)


@kernel
def _assemble_joint(sides, joint, forces, workspace):  # type: ignore
    """Add the rate of a joint segment."""
    law, rate = forces.law_rate[joint], forces.rate
    # Uᵀ L V of each pair of faces
    if _has_entries(law):
        for side in range(2):
            count, own = sides.size[joint, side], workspace[side]
            _face_derivatives(sides, joint, side, forces.motion[joint, side], own)
            _multiply_law(law, 2 + side, own[1][:, :count], own[2])
        for side in range(2):
            for other in range(2):
                counts = sides.size[joint, side], sides.size[joint, other]
                start = sides.block_start[joint, side, other]
                block = rate[start : start + counts[0] * counts[1]]
                _add_product(counts, workspace[side, 0], workspace[other, 2], 2 + side, block)
    # rotation stiffness of each face with a frame
    for side in range(2):
        if sides.has_frame[joint, side]:
            count, start = sides.size[joint, side], sides.block_start[joint, side, side]
            block = rate[start : start + count * count]
            bend = forces.bend[joint, side]
            _add_rotation_stiffness(sides.shapes[joint, side], count, bend, block)


@kernel
def _has_entries(law):  # type: ignore
    """Return whether forces change at all; those of an open joint do not."""
    for row in range(5):
        for column in range(5):
            if law[row, column] != 0.0:
                return True
    return False


@kernel
def _face_derivatives(sides, joint, side, motion, derivatives):  # type: ignore
    """Store jump, angle and elongation by the coordinates of a face, mean and at the end."""
    count, has_frame = sides.size[joint, side], sides.has_frame[joint, side]
    sign = 2.0 * side - 1.0  # the higher face less the lower one
    mean = (motion[0], motion[1]), motion[2], (motion[3], motion[4])
    last = (motion[5], motion[6]), 1.0, (motion[7], motion[8])
    for end in range(2):
        rate, rows, first = mean if end == 0 else last, derivatives[end], 0
        if has_frame:
            # displacement of the centroid, and rotation about it
            first = 3
            rows[0, 0], rows[0, 1], rows[0, 2] = sign, 0.0, sign * rate[2][0]
            rows[1, 0], rows[1, 1], rows[1, 2] = 0.0, sign, sign * rate[2][1]
            rows[2, 0], rows[2, 1], rows[2, 2] = 0.0, 0.0, 1.0
        # elastic modes, or the shapes of a block without frame
        for k in range(first, count):
            x, y, turn = shape_rates(sides, joint, side, k, rate)
            rows[0, k], rows[1, k], rows[2, k] = sign * x, sign * y, turn
        for k in range(count):
            rows[3, k] = sign * sides.stretch[joint, side, k] if sides.stretch.shape[2] else 0.0


@summing_kernel
def _multiply_law(law, angle, last, images):  # type: ignore
    """Store L V, the forces by the coordinates of a face; `angle` is the number of its angle."""
    p, q, r, s = last[0], last[1], last[2], last[3]
    # rows of L: x, y, angle of the lower face, angle of the higher face, elongation
    for number in range(5):
        row = law[number]
        a, b, c, d, image = row[0], row[1], row[angle], row[4], images[number]
        for m in range(len(p)):
            image[m] = a * p[m] + b * q[m] + c * r[m] + d * s[m]


@summing_kernel
def _add_product(counts, mean, images, angle, block):  # type: ignore
    """Add the derivative Uᵀ L V of one face's forces by another's coordinates to their block."""
    (rows, columns), p, q, r, s = counts, images[0], images[1], images[angle], images[4]
    for k in range(rows):
        x, y, turn, longer = mean[0, k], mean[1, k], mean[2, k], mean[3, k]
        row = block[k * columns : (k + 1) * columns]
        for m in range(columns):
            row[m] += x * p[m] + y * q[m] + turn * r[m] + longer * s[m]


@kernel
def _add_rotation_stiffness(shapes, count, bend, block):  # type: ignore
    """Add the derivative of generalised forces at a constant force on the face."""
    # moment by the angle, force on each shape by the angle, moment by each shape
    a, b, c, d, e = bend[0], bend[1], bend[2], bend[3], bend[4]
    block[2 * count + 2] += a
    for k in range(3, count):
        u, v = shapes[0, k], shapes[1, k]
        block[k * count + 2] += b * u + c * v
        block[2 * count + k] += d * u + e * v
