"""Opening, rotation and slip of whole joints."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import sparse

import archfem as af
from archfem.joints.resultants import face_matrix
from archfem.joints.rigid_kinematics import rigid_joint_operator

DEPTH = 0.55
"""Of the ring's joints [m]."""


def turned(structure, number, angle, about):
    """Coordinates that turn one block by a small angle about a point, anticlockwise."""
    block = structure.blocks[number]
    arm = block.centroid - np.asarray(about)
    q = np.zeros((len(structure.free), 3))
    q[structure.free.index(number)] = -angle * arm[1], angle * arm[0], angle
    return q.ravel()


@pytest.mark.parametrize("rule", ["lobatto", "exact", "nodal", "gauss"])
def test_a_block_that_turns_about_the_end_of_a_joint(ring, rule):
    """About the extrados it opens the intrados by θ h, without slip, and the reverse."""
    operator = rigid_joint_operator(ring, 4, af.joints.Quadrature(rule))
    matrix, offset = face_matrix(operator)
    joint, angle = ring.joints[5], 1e-3
    sense = np.sign(np.linalg.det([ring.normals[5], joint.tangent]))
    for end, side in ((joint.extrados, 1.0), (joint.intrados, -1.0)):
        q = turned(ring, joint.higher, side * sense * angle, end)
        faces = (matrix @ q + offset).reshape(3, -1)
        found = af.joints.joint_dataset(ring, np.ones((18, 3)), faces=faces).isel(joint=5)
        assert float(found["rotation"]) == pytest.approx(side * angle, rel=1e-12)
        assert float(found["opening"]) == pytest.approx(angle * DEPTH, rel=1e-12)
        assert float(found["slip"]) == pytest.approx(0.0, abs=1e-15)


def test_a_block_that_slides_or_presses(ring):
    """Along the joint all is slip; into the joint below nothing opens, and behind it a gap."""
    matrix, _ = face_matrix(rigid_joint_operator(ring, 4, af.joints.Quadrature()))
    joint = ring.joints[5]
    for direction, slip, gap in ((joint.tangent, 1e-3, 0.0), (ring.normals[5], 0.0, 1e-3)):
        q = np.zeros((len(ring.free), 3))
        q[ring.free.index(joint.higher), :2] = 1e-3 * direction
        middle, rotation, along = (matrix @ q.ravel()).reshape(3, -1)[:, 5]
        assert (along, middle) == pytest.approx((slip, gap), abs=1e-15)
        assert rotation == pytest.approx(0.0, abs=1e-15)
    faces = (matrix @ -q.ravel()).reshape(3, -1)
    found = af.joints.joint_dataset(ring, np.ones((18, 3)), faces=faces)["opening"].values
    assert found[5] == 0.0
    assert found[6] > 0.9e-3


def test_openings_that_are_not_plane_give_the_nearest_plane():
    """Against numpy's weighted polynomial fit of gaps at the points of an elastic joint."""
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=5)
    model = af.build(ring, fidelity="full", cells=(3, 3), quadrature="nodal")
    operator, q = model.operator, np.random.default_rng(1).normal(size=model.size)
    matrix, _ = face_matrix(operator)
    middle, rotation, slip = (matrix @ q).reshape(3, -1)
    points, gaps, slips = operator.points, operator.openings(q), operator.slips(q)
    for joint in range(points.joint_count):
        own = points.joint == joint
        weight = points.weight[own]
        slope, level = np.polyfit(points.offset[own], gaps[own], 1, w=np.sqrt(weight))
        assert (-slope, level) == pytest.approx((rotation[joint], middle[joint]), rel=1e-9)
        assert np.average(slips[own], weights=weight) == pytest.approx(slip[joint], rel=1e-9)


@pytest.mark.parametrize("fidelity", ["rigid", "monolithic"])
def test_gauges_follow_supports_that_have_moved(fidelity):
    """The left abutment sinks away from a ring that stays: its joint opens and slips by that."""
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=5)
    model = af.build(ring, fidelity=fidelity)
    model = model.settled(af.Settlement("left abutment", (0.0, -1e-3, 0.0)))
    gauges = model.observer()
    middle, rotation, slip = gauges.faces(gauges.read(np.zeros(model.size)))
    up = np.array([0.0, 1e-3])  # of the higher block relative to the abutment
    assert middle[0] == pytest.approx(ring.normals[0] @ up, rel=1e-9)
    assert slip[0] == pytest.approx(ring.tangents[0] @ up, rel=1e-9)
    assert np.abs([*middle[1:], *rotation, *slip[1:]]).max() < 1e-12


def test_points_that_are_not_about_the_middle_give_its_displacement():
    """Faces part by g_0 - θ a, at three places a of any weights."""
    arm, weight = np.array([-0.1, 0.3, 0.6]), np.array([1.0, 2.0, 1.0])
    points = SimpleNamespace(joint=np.zeros(3, int), offset=arm, weight=weight, joint_count=1)
    gaps, slips = 2e-3 - 1e-2 * arm, np.array([1e-3, 2e-3, 5e-3])
    columns = sparse.csr_matrix(np.column_stack([gaps, np.zeros(3)]))
    along = sparse.csr_matrix(np.column_stack([np.zeros(3), slips]))
    operator = SimpleNamespace(points=points, opening=columns, slip=along, gap_offset=None)
    matrix, offset = face_matrix(operator)
    assert matrix.toarray()[:, 0] == pytest.approx([2e-3, 1e-2, 0.0], abs=1e-15)
    assert matrix.toarray()[:, 1] == pytest.approx([0.0, 0.0, 2.5e-3], abs=1e-15)
    assert not offset.any()
