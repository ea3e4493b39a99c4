"""One block cut free: forces of its joints and its weight balance, with the right senses."""

from pathlib import Path

import numpy as np
import pytest
from repeats import each_once

import archfem as af
from archfem.statics import FreeBody, forces_on

BALANCED = 1e-9
"""Newton's method stops at 1e-10 of the load, and forces on a block are of its order."""

BRIDGE = Path(__file__).parents[2] / "meshes" / "prusias.toml"


@pytest.fixture(scope="module")
def portal():
    return af.arch_on_piers(
        radius=2.0, thickness=0.6, voussoirs=11, pier_breadth=0.6, courses=[0.5, 0.5]
    )


def check_balance(model, joints):
    """Forces and moments of every free block add up to nothing; return what is left of forces."""
    structure, left = model.structure, []
    for number in structure.free:
        body = forces_on(structure, joints, number, model.cells)
        reach = np.ptp(body.points, axis=0).max()
        assert body.closing_error < BALANCED, body.block.name
        assert abs(body.moment) < BALANCED * reach * body.sizes.max(), body.block.name
        left.append(body.closing_error)
    return max(left)


@pytest.mark.parametrize(
    ("name", "fidelity"), each_once(("ring", "stack", "portal"), ("rigid", "faces", "full"))
)
def test_forces_on_every_block_balance(request, name, fidelity):
    model = af.build(request.getfixturevalue(name), fidelity=fidelity)
    check_balance(model, af.dead_load(model).joints)


@pytest.mark.slow
def test_forces_on_every_block_of_a_bridge_balance(verified):
    """Soil joints, skewbacks and the backfill itself included."""
    model = af.build(af.Case.read(BRIDGE).structure, fidelity="full")
    left = check_balance(model, af.dead_load(model).joints)
    case = "forces on every block of the bridge, soil too"
    verified(case, "balance", "statics", "balance", difference=left)


@pytest.mark.parametrize("tilt", [-0.1, 0.1])
def test_shear_and_moment_have_the_senses_they_are_drawn_with(portal, tilt):
    """Under a horizontal body force the joints' forces must carry it: V and M of either sign."""
    model = af.build(portal, fidelity="rigid")
    state = af.statics.equilibrium_under(model, model.load(af.BodyForce(tilt, -1.0)))
    for number in portal.free:
        body = forces_on(portal, state.joints, number)
        weight = body.sizes[-1]
        assert body.sum == pytest.approx([-tilt * weight, 0.0], abs=BALANCED * body.sizes.max())
        assert abs(body.moment) < BALANCED * body.sizes.max()  # it acts at the centroid


def test_forces_of_a_joint_on_its_two_blocks_are_opposite(ring, ring_model):
    joints = af.dead_load(ring_model).joints
    lower, higher = (forces_on(ring, joints, number) for number in (5, 6))
    assert lower.names == ("joint 4", "joint 5", "weight")
    assert lower.forces[1] == pytest.approx(-higher.forces[0])
    assert lower.points[1] == pytest.approx(higher.points[0])


def test_the_left_abutment_pushes_the_ring_up_and_inwards(ring, ring_model):
    push = forces_on(ring, af.dead_load(ring_model).joints, "voussoir 1").forces[0]
    assert push[0] > 0.0
    assert push[1] == pytest.approx(ring.weight / 2.0, rel=1e-3)  # by symmetry; chords are lighter


def test_weight_is_that_of_the_outline_or_of_the_cells(ring, ring_model):
    """Four chords to a sector of angle φ weigh 1 - (φ / 4)² / 6 of it."""
    joints = af.dead_load(ring_model).joints
    true, meshed = (forces_on(ring, joints, 9, s).sizes[-1] for s in (None, ring_model.cells))
    turn = np.radians(159.0 / 17)
    assert true == pytest.approx(ring.weight / 17)
    assert meshed / true == pytest.approx(1.0 - (turn / 4.0) ** 2 / 6.0, abs=1e-6)


def test_an_open_joint_acts_at_its_middle(stack):
    """Nothing presses, and shear springs still hold: they act along the joint."""
    joints = af.joints.joint_dataset(stack, np.array([[3e4, 0.0, 0.0], [0.0, 500.0, 0.0]]))
    body = forces_on(stack, joints, "block 2")
    assert body.points[0] == pytest.approx(stack.joints[1].middle)
    assert body.forces[0] == pytest.approx([-500.0, 0.0])


def test_blocks_that_cannot_be_cut_free_are_refused(stack):
    joints = af.joints.joint_dataset(stack, np.array([[3e4, 0.0, 0.0], [1e4, 0.0, 0.0]]))
    with pytest.raises(af.InvalidInput, match=r"'base' is fixed.*that can move"):
        forces_on(stack, joints, "base")
    with pytest.raises(af.InvalidInput, match=r"no block 'blok 1': did you mean 'block 1'"):
        forces_on(stack, joints, "blok 1")
    with pytest.raises(af.InvalidInput, match=r"no block 3: give a number from 0 to 2"):
        forces_on(stack, joints, 3)
    over_time = af.joints.joint_dataset(stack, np.ones((4, 2, 3)), np.arange(4.0))
    with pytest.raises(af.InvalidInput, match=r"give one instant of the 2 joints"):
        forces_on(stack, over_time, "block 1")


def test_the_residual_is_relative_to_the_largest_force():
    body = FreeBody(
        af.column(breadth=1.0, heights=[1.0]).blocks[1],
        ("joint 0", "joint 1", "weight"),
        (0, 1),
        np.array([[1.0, 0.0], [0.0, 2.0], [0.0, 0.0]]),
        np.array([[0.0, 5.0], [3.0, -1.0], [0.0, 0.0]]),
    )
    assert body.sizes == pytest.approx([5.0, np.sqrt(10.0), 0.0])
    assert body.closing_error == pytest.approx(np.hypot(3.0, 4.0) / 5.0)
    assert body.moment == pytest.approx(5.0 - 6.0)


def test_forces_are_those_on_the_whole_width():
    stack = af.column(breadth=1.0, heights=[1.0, 1.0], width=2.5)
    model = af.build(stack, fidelity="rigid")
    body = forces_on(stack, af.dead_load(model).joints, 2)
    weight = 2.5 * af.STONE.unit_weight
    assert body.forces == pytest.approx(np.array([[0.0, weight], [0.0, -weight]]), abs=1e-6)
