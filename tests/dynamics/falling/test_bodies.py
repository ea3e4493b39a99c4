"""Masses, shapes and friction of blocks."""

from dataclasses import replace

import numpy as np
import pytest
from loose_blocks import G, floor

import archfem as af
from archfem.dynamics.falling.bodies import bodies_of, check_dry


def test_mass_and_moment_of_a_box():
    structure = replace(floor((0.0, 0.0, 0.5, 2.0)), width=3.0)
    bodies = bodies_of(structure)
    mass = 20e3 / G * 0.5 * 2.0 * 3.0
    assert bodies.mass[1] == pytest.approx([mass, mass * (0.5**2 + 2.0**2) / 12.0], rel=1e-12)
    assert bodies.inverse[1] == pytest.approx(1.0 / bodies.mass[1], rel=1e-15)
    assert not bodies.inverse[[0, 2]].any()  # the floor, and the ground
    assert bodies.reach[1] == pytest.approx(np.hypot(0.25, 1.0), rel=1e-12)


def test_the_ground_is_where_the_fixed_blocks_end():
    structure = floor((0.0, 0.0, 0.5, 2.0))
    assert bodies_of(structure).level == -1.0
    assert bodies_of(structure, level=-3.0).level == -3.0
    with pytest.raises(af.errors.InvalidInput, match="above the foot of block 'block 1'"):
        bodies_of(structure, level=0.1)


def test_friction_is_that_of_the_joint_or_the_least():
    ring = af.circular_arch(radius=3.0, thickness=0.5, embrace=150.0, voussoirs=3)
    rough = replace(ring.joints[1].contact, friction=0.9)
    joints = tuple(
        replace(joint, contact=rough) if k == 1 else joint for k, joint in enumerate(ring.joints)
    )
    ring = replace(ring, joints=joints)
    found = bodies_of(ring).friction
    assert found[1, 2] == found[2, 1] == 0.9
    assert found[0, 1] == found[1, 3] == found[2, -1] == 0.6
    assert bodies_of(ring, friction=0.3).friction[1, 3] == 0.3


def test_friction_must_be_known():
    endless = af.circular_arch(
        radius=3.0,
        thickness=0.5,
        embrace=150.0,
        voussoirs=3,
        contact=af.Contact(1e9, 1e9, None),
    )
    with pytest.raises(af.errors.InvalidInput, match="give friction"):
        bodies_of(endless)
    assert np.isfinite(bodies_of(endless, friction=0.5).friction).all()


def test_a_sector_of_a_wide_angle_has_chords():
    ring = af.circular_arch(radius=3.0, thickness=0.5, embrace=150.0, voussoirs=3)
    bodies = bodies_of(ring)
    assert np.bincount(bodies.owner).tolist() == [1, 4, 4, 4, 1]  # 50° in chords of 12.5°
    cuts = ~bodies.outer
    assert np.bincount(bodies.owner.repeat(np.diff(bodies.start)), cuts).tolist() == [0, 6, 6, 6, 0]


def test_joints_with_cohesion_are_refused():
    ring = af.circular_arch(
        radius=3.0,
        thickness=0.5,
        embrace=150.0,
        voussoirs=3,
        contact=af.Contact(1e9, 1e9, 0.6, cohesion=1e4),
    )
    with pytest.raises(af.errors.InvalidInput, match=r"cohesion 1e\+04 Pa"):
        check_dry(ring)


def test_a_soft_body_is_doubted(caplog):
    soil = af.Material(6.25e6, 0.2, 18e3, name="soil")
    structure = floor((0.0, 0.0, 2.0, 2.0))
    blocks = (structure.blocks[0], replace(structure.blocks[1], material=soil))
    check_dry(replace(structure, blocks=blocks))
    assert "'block 1' is soft" in caplog.text
