"""The skeleton of stone below a fill: parts that are left out, and parts that can move."""

from dataclasses import replace

import pytest
from mechanisms import FOUR, failing, filled, piers

import archfem as af
from archfem.limit.mechanism_kinematics import find_rigid_regions
from archfem.masonry.stiffness_ratio import find_yielding_blocks


def test_fill_and_parts_on_it_are_left_out():
    whole, bare = filled(), piers(chords=1)
    assert len(whole.joints) == len(bare.joints) + 5 + 2 + 1  # under, on, and between the pavers
    found = find_rigid_regions(whole)
    assert [whole.blocks[number].name for number in find_yielding_blocks(whole)] == ["fill"]
    assert found.structure.blocks == bare.blocks
    assert found.structure.joints == bare.joints
    assert found.blocks == tuple(range(len(bare.blocks)))
    assert found.joints == tuple(range(len(bare.joints)))


def test_numbers_are_those_of_the_whole_structure():
    """Blocks and joints in another order: the skeleton keeps count."""
    whole = filled()
    last = len(whole.blocks) - 1
    turned = replace(
        whole,
        blocks=whole.blocks[::-1],
        joints=tuple(
            replace(joint, blocks=(last - joint.blocks[0], last - joint.blocks[1]))
            for joint in whole.joints[::-1]
        ),
    )
    found = find_rigid_regions(turned)
    assert found.blocks == tuple(range(3, last + 1))
    for inner, outer in zip(found.structure.joints, found.joints, strict=True):
        assert inner.name == turned.joints[outer].name
        names = [found.structure.blocks[block].name for block in inner.blocks]
        assert names == [turned.blocks[block].name for block in turned.joints[outer].blocks]


def test_the_mechanism_is_that_without_the_fill():
    whole, bare = filled(), piers(chords=1)
    soil = dict.fromkeys(range(len(bare.joints), len(whole.joints)), 0.7)
    found = af.verified_mechanism(whole, failing(whole, FOUR, soil))
    alone = af.verified_mechanism(bare, failing(bare, FOUR))
    assert alone.kind == "semi-global"
    assert found.moved == alone.moved
    assert found.counted == alone.counted
    assert found.motion.shape == (len(whole.blocks), 3)
    assert found.motion[: len(bare.blocks)] == pytest.approx(alone.motion, abs=1e-9)
    assert not found.motion[len(bare.blocks) :].any()


def test_a_stiff_body_of_the_same_shape_holds_the_ring():
    whole = filled(af.STONE, "spandrel")
    assert find_yielding_blocks(whole) == ()
    assert find_rigid_regions(whole).structure.blocks == whole.blocks
    assert af.verified_mechanism(whole, failing(whole, FOUR)).kind == "none"


def test_rings_and_piers_are_never_left_out():
    soft = af.circular_arch(
        radius=3.0, thickness=0.6, embrace=160.0, voussoirs=7, material=replace(af.STONE, young=1e6)
    )
    assert find_yielding_blocks(soft) == ()


def test_stones_without_a_role_on_stiff_joints_are_no_fill():
    """A stone of 1 m and 30 GPa is softer than joints of 40 GPa/m; soil of 50 MPa is soft."""
    column = af.column(breadth=1.0, heights=[1.0], contact=af.Contact(4e10, 2e10, 0.6))
    base, stone = (replace(block, role="other") for block in column.blocks)
    joint = replace(column.joints[0], role="other")
    soil = replace(stone, material=af.masonry.BACKFILL)
    for block, found in ((stone, ()), (soil, (1,))):
        structure = replace(column, blocks=(base, block), joints=(joint,))
        assert find_yielding_blocks(structure) == found


def test_a_structure_of_soil_alone_is_its_own_skeleton():
    base = af.Block(
        ((0.0, -0.5), (1.0, -0.5), (1.0, 0.0), (0.0, 0.0)), af.STONE, "base", fixed=True
    )
    body = af.Block(
        ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)), af.masonry.BACKFILL, "fill", part="fill"
    )
    structure = af.masonry.assembled([base, body], af.masonry.SOIL_TO_STONE)
    assert find_yielding_blocks(structure) == (1,)
    assert find_rigid_regions(structure).blocks == (0, 1)
    assert af.verified_mechanism(structure, failing(structure, {0: 0.5})).kind == "local"


def test_limit_analysis_refuses_a_fill():
    whole = filled()
    for analysis in (af.stands, lambda each: af.collapse_factor(each, live=af.BodyForce(1.0))):
        with pytest.raises(af.InvalidInput, match=r"blocks \['fill'\] are softer than the joints"):
            analysis(whole)
    assert af.stands(find_rigid_regions(whole).structure)
