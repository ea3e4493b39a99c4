"""How soft blocks are: closed forms of one block, and soil distinguished from stone."""

from dataclasses import replace

import numpy as np
import pytest

import archfem as af
from archfem.masonry.stiffness_ratio import (
    estimate_bending,
    estimate_block_stiffness,
    estimate_locking,
    find_soft_blocks,
    find_yielding_blocks,
    list_stones,
    mark_stone_joints,
    soften_joints,
)


def test_a_shear_wave_crosses_a_block_twice(stack):
    found = estimate_block_stiffness(stack, 1)
    wave = np.sqrt(30e9 / 2.4 / (20e3 / 9.81))  # of stone, which is 1 m large here
    assert found.inner == pytest.approx(wave / 2.0)
    assert found.ratio == pytest.approx(30e9 / 1.48e9)


def test_a_block_is_as_large_as_a_square_and_held_by_its_stiffest_joint():
    """One of 1 m by 4 m, which is 2 m large, between joints of which the upper is stiffer."""
    tower = af.column(breadth=1.0, heights=[4.0, 1.0])
    below, above = tower.joints
    stiff = replace(above, contact=replace(above.contact, normal_stiffness=5e9))
    found = estimate_block_stiffness(replace(tower, joints=(below, stiff)), 1)
    assert found.inner == pytest.approx(np.sqrt(30e9 / 2.4 / (20e3 / 9.81)) / 4.0)
    assert found.ratio == pytest.approx(30e9 / 2.0 / 5e9)


def test_joints_are_softened_by_the_halves_of_free_blocks(stack):
    """In series with half a metre of each stone; the ground adds nothing."""
    below, above = (joint.contact for joint in soften_joints(stack).joints)
    one, two = 0.5 / 30e9, 1.0 / 30e9
    assert below.normal_stiffness == pytest.approx(1.0 / (1.0 / 1.48e9 + one))
    assert above.normal_stiffness == pytest.approx(1.0 / (1.0 / 1.48e9 + two))
    dry = stack.joints[1].contact
    assert above.shear_stiffness == pytest.approx(1.0 / (1.0 / dry.shear_stiffness + 2.4 * two))
    assert (above.friction, above.name) == (dry.friction, dry.name)


def test_soil_is_soft_and_yields_and_stone_is_neither(viaduct):
    soil = viaduct.block_number("backfill")
    assert find_soft_blocks(viaduct) == find_yielding_blocks(viaduct) == (soil,)
    assert set(viaduct.free) - set(list_stones(viaduct)) == {soil}
    touches_soil = [soil in joint.blocks for joint in viaduct.joints]
    assert (~mark_stone_joints(viaduct)).tolist() == touches_soil


def test_bodies_yield_by_their_roles_and_not_their_names(viaduct):
    blocks, joints = (
        tuple(replace(each, part=f"Teil {len(each.part)}") for each in members)
        for members in (viaduct.blocks, viaduct.joints)
    )
    other = [each.part for each in blocks if each.role == "other"]
    assert not {each.part for each in blocks if each.role != "other"} & set(other)
    assert find_yielding_blocks(replace(viaduct, blocks=blocks, joints=joints)) == (
        viaduct.block_number("backfill"),
    )


def test_a_ring_never_yields_however_soft():
    pulp = af.Material(1e6, 0.2, 20e3)
    ring = af.circular_arch(radius=3, thickness=0.5, embrace=120, voussoirs=9, material=pulp)
    assert len(find_soft_blocks(ring)) == 9
    assert find_yielding_blocks(ring) == ()


@pytest.mark.parametrize(("young", "soft", "yields"), [(1.04, False, False), (0.96, True, True)])
def test_from_where_a_block_counts_as_soft(young, soft, yields):
    """Its first mode at ten times 25 Hz, and E / L at k_n, each met to 4 % of Young's modulus."""
    edge = 1.0
    shear = (250.0 * 2.0 * edge) ** 2 * 2e4 / 9.81  # c_s / (2 L) = 250 Hz
    tuned = af.Material(young * 2.4 * shear, 0.2, 2e4)
    shape = af.column(breadth=edge, heights=[edge], material=tuned)
    assert find_soft_blocks(shape) == ((1,) if soft else ())
    # as stiff as its joint of 0.3 GPa/m; and as fill is at most, 1 GPa, on a joint of 10 GPa/m
    for stiffness, contact in ((0.3e9, af.masonry.SOIL_TO_STONE), (1e9, af.Contact(1e10, 1e9))):
        as_stiff = af.Material(young * stiffness * edge, 0.2, 2e4)
        shape = af.column(breadth=edge, heights=[edge], material=as_stiff)
        blocks = tuple(replace(each, role="other") for each in shape.blocks)
        joints = tuple(replace(each, role="other", contact=contact) for each in shape.joints)
        other = replace(shape, blocks=blocks, joints=joints)
        assert find_yielding_blocks(other) == ((1,) if yields else ())


def test_stones_of_no_role_count_whatever_their_joints_are():
    """On joints of 40 GPa/m the large stone yields first, and is lost like the others."""
    contact = af.Contact(4e10, 2e10, 0.6)
    column = af.column(breadth=1.0, heights=[0.3, 2.0], contact=contact)
    blocks = tuple(replace(block, role="other") for block in column.blocks)
    joints = tuple(replace(joint, role="other") for joint in column.joints)
    structure = replace(column, blocks=blocks, joints=joints)
    ratios = [estimate_block_stiffness(structure, number).ratio for number in structure.free]
    assert min(ratios) < 1.0 < max(ratios)
    assert list_stones(structure) == list(structure.free)
    assert mark_stone_joints(structure).all()


def test_slender_blocks_bend_as_beams():
    """One frequency of a block on its foot, by all nodes and by Euler's beam; and held twice."""
    contact = af.Contact(1e14, 1e14, friction=None)
    column = af.column(breadth=0.4, heights=[8.0], contact=contact)
    beam = 3.516 / (2.0 * np.pi) * np.sqrt(30e9 * 0.4**2 / 12.0 / (20e3 / 9.81)) / 8.0**2
    assert estimate_bending(column, 1) == pytest.approx(beam, rel=5e-3)  # along its diagonal
    twice = af.column(breadth=0.4, heights=[8.0, 0.4], contact=contact)
    assert estimate_bending(twice, 1) / estimate_bending(column, 1) == pytest.approx(
        6.366, rel=1e-3
    )
    for fidelity in ("rigid", "faces", "condensed"):
        doubt, *cells = af.build(column, fidelity=fidelity).doubts
        assert "bend at 3.9 Hz or more" in str(doubt)
        assert len(cells) == (fidelity != "rigid")
    assert not af.build(column, fidelity="full", cells=(1, 4), degree=2).doubts
    # too short to bend slowly, and on joints that are far softer than the stone
    short = af.column(breadth=0.4, heights=[2.0], contact=contact)
    dry = af.column(breadth=0.4, heights=[8.0])
    assert not af.build(short, fidelity="rigid").doubts
    assert not af.build(dry, fidelity="faces").doubts
    # a course that lies on another one along its length is held by it
    assert estimate_bending(af.column(breadth=8.0, heights=[0.4], contact=contact), 1) == np.inf


@pytest.mark.parametrize("along", [4, 8, 16, 64])
def test_long_cells_of_degree_one_are_stiff_in_bending(along):
    """Against Euler's cantilever, of which shear of a slender one takes less than 1 %."""
    contact = af.Contact(1e14, 1e14, friction=None)
    column = af.column(breadth=0.4, heights=[8.0], contact=contact)
    beam = 3.516 / (2.0 * np.pi) * np.sqrt(30e9 * 0.4**2 / 12.0 / (20e3 / 9.81)) / 8.0**2
    model = af.build(column, fidelity="full", cells=(4, along))
    error = af.modes(model, 1, "closed").frequencies[0] / beam - 1.0
    assert estimate_locking(column, 1, along) == pytest.approx(error, abs=0.03, rel=0.05)
    assert any("cells of degree 1" in str(doubt) for doubt in model.doubts) == (along < 64)
    fine = af.build(column, fidelity="full", degree=2)
    assert af.modes(fine, 1, "closed").frequencies[0] == pytest.approx(beam, rel=0.01)
    assert not fine.doubts
