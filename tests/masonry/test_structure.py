"""Blocks, joints and structures: measures, orientation, and what is refused."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from archfem.errors import InvalidInput, InvalidStructure
from archfem.masonry.materials import STONE, STONE_TO_STONE, Contact, Material
from archfem.masonry.shapes import circular_arch, column
from archfem.masonry.structure import Block, Joint, Structure

SQUARE = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0))


def test_polygon_measures():
    block = Block(SQUARE, STONE, "square")
    assert block.area == pytest.approx(2.0)
    assert block.centroid == pytest.approx([1.0, 0.5])
    assert block.polar_moment == pytest.approx(2.0 * (4.0 + 1.0) / 12.0)


def test_sector_measures_are_the_limit_of_its_polygons(ring):
    sector = ring.blocks[4]
    fine = Block(tuple(map(tuple, sector.drawn(2000))), STONE, "fine")
    # A polygon of k chords misses φ²/(6 k²) of the area: 1e-9 here.
    assert sector.area == pytest.approx(fine.area, rel=1e-8)
    assert sector.centroid == pytest.approx(fine.centroid, rel=1e-7)
    assert sector.polar_moment == pytest.approx(fine.polar_moment, rel=1e-6)


def test_ring_weighs_what_it_should(ring):
    assert ring.weight == pytest.approx(20e3 * 0.55 * 2.95 * radians(159.0), rel=1e-12)
    chorded = circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17, chords=1)
    turn = radians(159.0) / 17
    assert chorded.weight / ring.weight == pytest.approx(np.sin(turn) / turn, rel=1e-12)


def test_span_and_rise_are_clear(ring):
    arch = circular_arch(span=5.0, rise=2.0, thickness=0.4, voussoirs=11)
    feet = [arch.joints[0].intrados, arch.joints[-1].intrados]
    assert feet[1][0] - feet[0][0] == pytest.approx(5.0)
    crown = max(y for block in arch.blocks[1:-1] for x, y in block.drawn()[:17])
    assert crown - feet[0][1] == pytest.approx(2.0, abs=1e-12)


def test_normals_point_from_lower_to_higher_block(ring):
    ahead = [ring.blocks[j.higher].centroid - ring.blocks[j.lower].centroid for j in ring.joints]
    assert np.all(np.sum(ring.normals * ahead, axis=1) > 0.0)
    assert np.sum(ring.normals * [j.tangent for j in ring.joints], axis=1) == pytest.approx(0.0)


def test_over_semicircular_and_single_stone_rings():
    assert len(circular_arch(radius=1, thickness=0.2, embrace=200, voussoirs=9).joints) == 10
    assert len(circular_arch(radius=1, thickness=0.2, embrace=80, voussoirs=1).blocks) == 3


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"thickness": -0.1}, "thickness -0.1 m is not between"),
        ({"thickness": 7.0}, "twice the radius"),
        ({"embrace": 400.0}, "embrace 400"),
        ({"voussoirs": 0}, "voussoirs 0"),
        ({"voussoirs": 2.5}, "voussoirs 2.5"),
        ({"span": 5.0}, "either radius and embrace"),
        ({"radius": None, "embrace": None, "span": 5.0, "rise": 2.6}, "half the span"),
        ({"width": 0.0}, "width 0 m"),
        ({"gravity": -9.81}, "gravity -9.81"),
    ],
)
def test_impossible_rings_are_refused(change, says):
    given = {"radius": 2.95, "thickness": 0.55, "embrace": 159.0, "voussoirs": 17}
    with pytest.raises(InvalidStructure, match=says):
        circular_arch(**{**given, **change})


def test_joints_must_lie_between_their_blocks(stack):
    moved = replace(stack.joints[0], intrados=(-0.5, 0.1), extrados=(0.5, 0.1))
    with pytest.raises(InvalidStructure, match="share no face"):
        replace(stack, joints=(moved, stack.joints[1]))
    wrong = replace(stack.joints[1], blocks=(0, 2))
    with pytest.raises(InvalidStructure, match="share no face"):
        replace(stack, joints=(stack.joints[0], wrong))
    with pytest.raises(InvalidStructure, match="two different numbers"):
        replace(stack, joints=(stack.joints[0], replace(stack.joints[1], blocks=(1, 7))))


def test_a_loose_block_is_named(stack):
    with pytest.raises(InvalidStructure, match=r"\['block 2'\] rest on nothing"):
        replace(stack, joints=stack.joints[:1])


def test_other_refusals(stack):
    with pytest.raises(InvalidStructure, match="anticlockwise"):
        Block(SQUARE[::-1], STONE, "turned")
    with pytest.raises(InvalidStructure, match="used twice"):
        replace(stack, blocks=(*stack.blocks[:2], replace(stack.blocks[2], name="block 1")))
    with pytest.raises(InvalidStructure, match="no block is free"):
        Structure((replace(stack.blocks[0]),), ())
    with pytest.raises(InvalidInput, match="no joint 'key'"):
        stack.joint_number("key")
    bad = Joint((0, 1), (0.0, 0.0), (0.0, 0.0), STONE_TO_STONE, "point")
    with pytest.raises(InvalidStructure, match="one point"):
        replace(stack, joints=(bad, stack.joints[1]))
    with pytest.raises(InvalidStructure, match="lengths above 0"):
        column(breadth=1.0, heights=[])


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Material(30.0, 0.2, 20e3), "young 30 Pa"),
        (lambda: Material(30e9, 0.5, 20e3), "poisson 0.5"),
        (lambda: Material(30e9, 0.2, 2e6), "unit_weight 2e"),
        (lambda: Material(30e9, 0.2, 20e3, -1.0), "strength -1"),
        (lambda: Contact(1.48, 0.3e9), "normal_stiffness 1.48"),
        (lambda: Contact(1.48e9, 0.3e9, -0.1), "friction -0.1"),
    ],
)
def test_wrong_units_are_refused(make, says):
    with pytest.raises(InvalidInput, match=says):
        make()


def test_arrays_of_joints_are_those_of_each_joint(stack):
    for number, joint in enumerate(stack.joints):
        assert stack.ends[number].tolist() == joint.ends.tolist()
        assert stack.middles[number].tolist() == joint.middle.tolist()
        assert stack.tangents[number].tolist() == joint.tangent.tolist()
        assert stack.depths[number] == joint.depth
        assert stack.friction[number] == joint.contact.friction
        assert tuple(stack.pairs[number]) == (joint.lower, joint.higher)


def test_blocks_and_joints_by_name_or_number(stack):
    assert stack.block_number("block 2") == stack.block_number(2) == 2
    assert stack.joint_number(stack.joints[1].name) == stack.joint_number(1) == 1
    with pytest.raises(InvalidInput, match="no block 'blok 2': did you mean 'block 2'"):
        stack.block_number("blok 2")
