"""Joint forces and memory over a step at large displacements, compiled.

Poses and measures are by `face_kinematics`, the law is by `overlap_law`; `rates` assembles the
derivative by the coordinates at the end. At an instant, a step without displacement, forces are
those of statics, and twice the derivative is the tangent.
"""

from typing import Any, NamedTuple

import numpy as np

from archfem._numba import allocating_entry, entry, inlined_kernel, kernel
from archfem._typing import Array
from archfem.joints.large import overlap_law
from archfem.joints.large.face_kinematics import (
    FaceKinematics,
    face_forces,
    face_pose,
    force_derivative,
    gather_face_forces,
    joint_measures,
    relative_stretch,
    rotation_stiffness,
    step_measures,
    step_poses,
)
from archfem.joints.large.rates import JointRates


class LargeDisplacementJoints(NamedTuple):
    """Joint segments between blocks of large displacements."""

    kinematics: FaceKinematics
    face_law: overlap_law.FaceLaw
    normal_angle: Array  # direction of the normals before anything moved (j,) [rad]
    # 1 where the extrados is on the left of the normal, -1 on the right: slip, rotation, V and M of
    # the structure's joints are positive toward the extrados (j,)
    orientation: Array
    # joint of each segment; a joint whose faces bend is divided as by the nodes of the mesh (j,)
    joint: Any
    segment_offset: Array  # of a segment's middle from mid-depth, toward the extrados (j,) [m]
    joint_count: int  # number of joints of the structure
    # opening, slip, rotation and relative elongation before anything moved, due to construction
    # (j, 4) [m, m, -, m]
    initial_measures: Array


class JointStepForces(NamedTuple):
    """Joint forces over a step, filled by `compute_step_forces`."""

    # mean generalised forces of each segment on the coordinates of both faces (j, 2, s)
    force: Array
    rates: JointRates
    resultants: Array  # mean N, V, M of the joints of the structure (n_joints, 3) [N, N, N m]
    irreversible_slip: Array  # of each point at the end (p,) [m]
    dissipation: Array  # energy lost to friction and damping (j,) [J]
    # slip direction of each point in the last evaluation, 1 or -1; 0 where it held, or before the
    # first evaluation (p,)
    slip_direction: Array
    reverses: Any  # whether the slip direction of points of a segment has reversed (j,)
    # correction to `force` of such segments, computed as if these points stick, of which `rates`
    # are the derivatives (j, 2, s)
    missing_force: Array


def allocate_step_forces(joints: LargeDisplacementJoints) -> JointStepForces:
    """Return zero arrays for the forces of a step."""
    count, size = len(joints.normal_angle), joints.kinematics.shapes.shape[-1]
    points = len(joints.face_law.place)
    return JointStepForces(
        np.zeros((count, 2, size)),
        JointRates(np.zeros((count, 5, 5)), np.zeros((count, 2, 9)), np.zeros((count, 2, 5))),
        np.zeros((joints.joint_count, 3)),
        np.zeros(points),
        np.zeros(count),
        np.zeros(points),
        np.zeros(count, bool),
        np.zeros((count, 2, size)),
    )


@inlined_kernel
def segment_measures(joints, segment, q):  # type: ignore
    """Return opening, slip and rotation of a segment, to the left of its normal [m, m, -]."""
    lower = face_pose(joints.kinematics, segment, 0, q)
    higher = face_pose(joints.kinematics, segment, 1, q)
    measures = joint_measures(lower, higher, joints.normal_angle[segment])
    return _add_initial_measures(joints, segment, measures)


@inlined_kernel
def _add_initial_measures(joints, segment, measures):  # type: ignore
    """Return opening, slip and rotation since the segment was built free of stress."""
    (opening, slip, turn), initial = measures, joints.initial_measures[segment]
    return opening + initial[0], slip + initial[1], turn + initial[2]


@allocating_entry
def measure_states(joints, states):  # type: ignore
    """Return opening, slip and rotation of the structure's joints (k, n_joints, 3) [m, m, -]."""
    measures = np.zeros((len(states), joints.joint_count, 3))
    sums = np.empty((joints.joint_count, 4))
    for k in range(len(states)):
        _measure_state(joints, states[k], sums, measures[k])
    return measures


@kernel
def _measure_state(joints, q, sums, measures):  # type: ignore
    """Store the measures of one state, with the plane nearest to the openings of the segments."""
    # sums over the segments of a joint, d their depth and a their offset: Σ d, Σ d a, Σ d a² with
    # the segments' own moment, and Σ d a g with that of their openings
    sums[:] = 0.0
    for segment in range(len(joints.normal_angle)):
        own = segment_measures(joints, segment, q)
        orientation, joint = joints.orientation[segment], joints.joint[segment]
        depth, place = joints.face_law.depth[segment], joints.segment_offset[segment]
        spread = 0.25 * depth**3
        measures[joint, 0] += depth * own[0]
        measures[joint, 1] += depth * orientation * own[1]
        sums[joint, 0] += depth
        sums[joint, 1] += depth * place
        sums[joint, 2] += depth * place**2 + spread
        sums[joint, 3] += depth * place * own[0] - spread * orientation * own[2]
    # rotation, opening at mid-depth, mean slip
    for joint in range(joints.joint_count):
        total, first = sums[joint, 0], sums[joint, 1]
        middle = first / total
        turn = middle * measures[joint, 0] - sums[joint, 3]
        turn /= sums[joint, 2] - middle * first
        measures[joint, 0] = measures[joint, 0] / total + turn * middle
        measures[joint, 1] /= total
        measures[joint, 2] = turn


@allocating_entry
def facet_slips(joints, q):  # type: ignore
    """Return the slip over the length of segments whose points are paired as built (j,) [-]."""
    slips, law = np.zeros(len(joints.normal_angle)), joints.face_law
    for segment in range(len(slips)):
        if law.paired[segment]:
            slips[segment] = abs(segment_measures(joints, segment, q)[1]) / law.depth[segment]
    return slips


@entry
def joint_energy(joints, q, slip):  # type: ignore
    """Return the energy stored in all joints [J]."""
    total, law = 0.0, joints.face_law
    for segment in range(len(joints.normal_angle)):
        measures = segment_measures(joints, segment, q)
        longer = joints.initial_measures[segment, 3]
        longer = longer + relative_stretch(joints.kinematics, segment, q)
        # across: w ℓ Φ
        (length, _), (middle, _) = overlap_law.overlap(law, segment, measures[1])
        opening = measures[0] - middle * measures[2]
        phi = overlap_law.closing_energy(law, segment, length, opening, measures[2])[0]
        total += law.width * length * phi
        # along: the shear spring of each point
        for point in range(law.first_point[segment], law.first_point[segment + 1]):
            elastic = measures[1] + law.place[point] * longer - slip[point]
            total += 0.5 * law.shear_spring[point] * elastic**2
    return total


@entry
def compute_step_forces(joints, before, after, lag, slip, forces):  # type: ignore
    """Compute the joint forces of a step."""
    forces.resultants[:] = 0.0
    for segment in range(len(joints.normal_angle)):
        _compute_segment(joints, segment, (before, after), lag, slip, forces)


@inlined_kernel
def _compute_segment(joints, segment, states, lag, slip, forces):  # type: ignore
    """Compute the forces of a segment over a step."""
    sides, law, (before, after) = joints.kinematics, joints.face_law, states
    # poses of both faces, and measures, at both ends of the step
    lower, lower_rotation, lower_rates = step_poses(sides, segment, 0, before, after)
    higher, higher_rotation, higher_rates = step_poses(sides, segment, 1, before, after)
    angle = joints.normal_angle[segment]
    start, end, rates, now, step = step_measures(lower, higher, angle)
    longer = joints.initial_measures[segment, 3]
    first = longer + relative_stretch(sides, segment, before)
    last = longer + relative_stretch(sides, segment, after)
    start = _add_initial_measures(joints, segment, start)
    end = _add_initial_measures(joints, segment, end)
    # forces on the measures, and their derivative
    memory = slip, forces.irreversible_slip, forces.slip_direction
    force, law_rate, stretch_rate, others = overlap_law.segment_forces(
        law, segment, (start, end, (first, last)), lag, memory
    )
    (shear, moment), loss, missing = others
    forces.dissipation[segment] = loss + overlap_law.damping_loss(law, segment, (start, end), lag)
    joint, orientation = joints.joint[segment], joints.orientation[segment]
    forces.resultants[joint, 0] -= force[0]
    forces.resultants[joint, 1] += orientation * shear
    forces.resultants[joint, 2] += orientation * moment - joints.segment_offset[segment] * force[0]
    # generalised forces, and their correction where points should stick
    means = lower_rates[0], higher_rates[0]
    push = face_forces(rates, force)
    _store_forces(sides, segment, means, push, force[3], forces.force)
    forces.reverses[segment] = missing[0] != 0.0 or missing[1] != 0.0
    if forces.reverses[segment]:
        push = face_forces(rates, (0.0, missing[0], 0.0))
        _store_forces(sides, segment, means, push, missing[1], forces.missing_force)
    # derivatives, of the forces with that correction
    force = force[0], force[1] + missing[0], force[2]
    x, y, low, high = face_forces(rates, force)
    derivative = force_derivative(step, rates, now, force, law_rate)
    of_law, motion, bend = forces.rates
    _store_derivative(of_law[segment], derivative)
    _store_motion(motion[segment, 0], lower_rates)
    _store_motion(motion[segment, 1], higher_rates)
    _store_bend(bend[segment, 0], lower_rotation, (-x, -y, low))
    _store_bend(bend[segment, 1], higher_rotation, (x, y, high))
    if sides.stretch.shape[2] > 0:
        of_stretch = face_forces(now, law_rate[3])
        by_stretch = face_forces(rates, (0.0, stretch_rate[0], 0.0))
        _store_stretch(of_law[segment], of_stretch, by_stretch, stretch_rate[1])


@kernel
def _store_forces(sides, segment, means, push, pull, forces):  # type: ignore
    """Store the generalised forces of a force on the jump and one on the relative elongation."""
    x, y, low, high = push
    gather_face_forces(sides, segment, 0, means[0], (-x, -y, low), forces[segment, 0])
    gather_face_forces(sides, segment, 1, means[1], (x, y, high), forces[segment, 1])
    if sides.stretch.shape[2] > 0:
        for side, sign in ((0, -1.0), (1, 1.0)):
            for k in range(sides.size[segment, side]):
                forces[segment, side, k] += sign * pull * sides.stretch[segment, side, k]


@inlined_kernel
def _store_derivative(law_rate, rows):  # type: ignore
    """Store the derivatives of the forces on the jump and the angles by these."""
    for k in range(4):
        _store_row(law_rate[k], rows[k])


@inlined_kernel
def _store_row(row, values):  # type: ignore
    """Store four numbers."""
    row[0], row[1], row[2], row[3] = values


@inlined_kernel
def _store_motion(motion, rates):  # type: ignore
    """Store the derivative of a pose by its coordinates, mean over the step and at its end."""
    ((c, s), factor, (x, y)), ((c1, s1), _, (x1, y1)) = rates
    motion[0], motion[1], motion[2], motion[3], motion[4] = c, s, factor, x, y
    motion[5], motion[6], motion[7], motion[8] = c1, s1, x1, y1


@inlined_kernel
def _store_bend(row, rotation, push):  # type: ignore
    """Store the rotation stiffness of a face, which counts for blocks with a frame only."""
    row[0], row[1], row[2], row[3], row[4] = rotation_stiffness(rotation, push)


@inlined_kernel
def _store_stretch(law_rate, of_stretch, by_stretch, both):  # type: ignore
    """Store the derivative of the force on the elongation, and of all forces by the elongation."""
    _store_row(law_rate[4], of_stretch)
    law_rate[0, 4], law_rate[1, 4], law_rate[2, 4], law_rate[3, 4] = by_stretch
    law_rate[4, 4] = both
