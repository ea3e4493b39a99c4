"""The derivative of joint forces by the coordinates at the end of a step, compiled.

A joint segment sees its two faces by five numbers: the jump between them (x, y), both angles, and
the relative elongation. The derivative of its forces is Uᵀ L V plus a rotation stiffness. L (5, 5)
is the derivative of the law; U and V hold the derivatives of the five numbers by the coordinates,
mean over the step and at its end. Segments between the same coordinates share a block of places.
"""

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from archfem._numba import entry, kernel
from archfem._typing import Array
from archfem.joints.large.face_kinematics import shape_rates


class JointRates(NamedTuple):
    """Data from which the derivative of the forces of all joint segments is assembled."""

    # derivative of the forces on the jump (x, y), on both angles and on the elongation, by their
    # values at the end (j, 5, 5)
    law: Array
    # derivative of each face's pose by its coordinates: cosine, sine, factor of the shapes, and the
    # middle by the angle, mean over the step; cosine, sine, middle by the angle, at the end
    # (j, 2, 9)
    motion: Array
    bend: Array  # rotation stiffness of each face, by `rotation_stiffness` (j, 2, 5)


def list_blocks(pairs: Iterable[tuple[tuple[int, ...], tuple[int, ...]]]) -> tuple[Any, Any]:
    """List the entries of a matrix in blocks, each between the coordinates of rows and columns.

    Equal pairs of coordinates share a block. The first result is where the block of each pair
    begins among the entries (k,), the second are rows and columns of all entries (2, e).
    """
    blocks: dict[Any, int] = {}
    begin, ends, count = [], [], 0
    for pair in pairs:
        if pair not in blocks:
            blocks[pair] = count
            ends.append([end.ravel() for end in np.meshgrid(*pair, indexing="ij")])
            count += len(ends[-1][0])
        begin.append(blocks[pair])
    return np.array(begin), np.concatenate(ends, axis=1).astype(np.int64)


def find_rate_blocks(index: Any, size: Any) -> tuple[Any, Any]:
    """Return where blocks of derivatives begin (j, 2, 2), and their rows and columns (2, e)."""
    counts = zip(index, size, strict=True)
    faces = [[tuple(row[:n].tolist()) for row, n in zip(*both, strict=True)] for both in counts]
    # segments with the same coordinates on both faces share a block
    begin, ends = list_blocks((own[a], own[b]) for own in faces for a, b in np.ndindex(2, 2))
    return begin.reshape(-1, 2, 2), ends


@entry
def assemble_rates(sides, rates, workspace, places, entries):  # type: ignore
    """Add the derivatives of all joints to the entries of a matrix at the places of all blocks."""
    for joint in range(len(sides.size)):
        add_rates(sides, joint, rates, 1.0, workspace, places, entries)


@kernel
def add_rates(sides, joint, rates, factor, workspace, places, entries):  # type: ignore
    """Add the derivatives of a joint segment, times a factor, to the entries of a matrix."""
    law = rates.law[joint]
    # Uᵀ L V of each pair of faces
    for side in range(2):
        count, own = sides.size[joint, side], workspace[side]
        _face_derivatives(sides, joint, side, rates.motion[joint, side], own)
        _multiply_law(law, factor, 2 + side, own[1][:, :count], own[2])
    for side in range(2):
        for other in range(2):
            counts = sides.size[joint, side], sides.size[joint, other]
            own = places[sides.block_start[joint, side, other] :]
            _add_product(counts, workspace[side, 0], workspace[other, 2], 2 + side, own, entries)
    # rotation stiffness of each face with a frame
    for side in range(2):
        if sides.has_frame[joint, side]:
            count, own = sides.size[joint, side], places[sides.block_start[joint, side, side] :]
            bend = rates.bend[joint, side]
            _add_rotation_stiffness(sides.shapes[joint, side], count, bend, factor, own, entries)


@kernel
def copy_rates(source, target, joint):  # type: ignore
    """Copy the data from which the derivatives of a joint segment are assembled."""
    for row in range(5):
        for column in range(5):
            target.law[joint, row, column] = source.law[joint, row, column]
    for side in range(2):
        for k in range(9):
            target.motion[joint, side, k] = source.motion[joint, side, k]
        for k in range(5):
            target.bend[joint, side, k] = source.bend[joint, side, k]


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


@kernel
def _multiply_law(law, factor, angle, last, images):  # type: ignore
    """Store L V, the forces by the coordinates of a face; `angle` is the number of its angle."""
    p, q, r, s = last[0], last[1], last[2], last[3]
    # rows of L: x, y, angle of the lower face, angle of the higher face, elongation
    for number in range(5):
        row = law[number]
        a, b, c, d = factor * row[0], factor * row[1], factor * row[angle], factor * row[4]
        image = images[number]
        for m in range(len(p)):
            image[m] = a * p[m] + b * q[m] + c * r[m] + d * s[m]


@kernel
def _add_product(counts, mean, images, angle, places, entries):  # type: ignore
    """Add the derivative Uᵀ L V of one face's forces by another's coordinates."""
    (rows, columns), p, q, r, s = counts, images[0], images[1], images[angle], images[4]
    for k in range(rows):
        x, y, turn, longer = mean[0, k], mean[1, k], mean[2, k], mean[3, k]
        own = places[k * columns : (k + 1) * columns]
        for m in range(columns):
            entries[own[m]] += x * p[m] + y * q[m] + turn * r[m] + longer * s[m]


@kernel
def _add_rotation_stiffness(shapes, count, bend, factor, places, entries):  # type: ignore
    """Add the derivative of generalised forces at a constant force on the face."""
    # moment by the angle, force on each shape by the angle, moment by each shape
    a, b, c, d, e = bend[0], bend[1], bend[2], bend[3], bend[4]
    entries[places[2 * count + 2]] += factor * a
    for k in range(3, count):
        u, v = shapes[0, k], shapes[1, k]
        entries[places[k * count + 2]] += factor * (b * u + c * v)
        entries[places[2 * count + k]] += factor * (d * u + e * v)
