"""Why a structure does not stand under its own weight, and the values from which it would."""

import re
from dataclasses import replace

import numpy as np
import pytest

import archfem as af
from archfem.limit.instability import explain_instability

STONE = af.STONE


def on_a_bed(outline, *, friction=0.6, tilt=0.0):
    """A block on a fixed one, 1 m broad and tilted [rad]."""
    c, s = np.cos(tilt), np.sin(tilt)
    turn = np.array([[c, s], [-s, c]])
    bed = np.array([[0.0, -0.5], [1.0, -0.5], [1.0, 0.0], [0.0, 0.0]])
    blocks = [
        af.Block(tuple(map(tuple, bed @ turn)), STONE, "bed", fixed=True),
        af.Block(tuple(map(tuple, np.array(outline) @ turn)), STONE, "stone"),
    ]
    return af.masonry.assembled(blocks, af.Contact(1e10, 4e9, friction))


def value(pattern, text):
    return float(re.search(pattern, text)[1])


def test_a_block_on_a_slope_needs_the_friction_of_its_angle():
    cube = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.0, 0.5]]
    text = explain_instability(on_a_bed(cube, friction=0.2, tilt=np.arctan(0.35)))
    assert value(r"coefficient of friction of ([\d.]+)", text) == pytest.approx(0.35, rel=0.02)
    assert "no thickness helps" in text
    assert explain_instability(on_a_bed(cube, friction=0.36, tilt=np.arctan(0.35))) is None


def test_a_block_that_leans_out_needs_a_bed_up_to_its_centroid():
    """A parallelogram, its centroid 0.8 m from the middle of a bed of half a metre to each side."""
    leaning = [[0.0, 0.0], [1.0, 0.0], [2.6, 2.0], [1.6, 2.0]]
    text = explain_instability(on_a_bed(leaning))
    assert value(r"if they are ([\d.]+) times as deep", text) == pytest.approx(1.6, rel=0.01)
    assert "no friction helps" in text


def test_a_smooth_ring_is_not_helped_by_thickness():
    """The message of a failed dead load; by `stands` it holds from the coefficient named."""

    def ring(friction, thickness=0.55):
        return af.circular_arch(
            radius=2.95,
            thickness=thickness,
            embrace=159.0,
            voussoirs=9,
            contact=af.Contact(1e11, 4e10, friction),
        )

    with pytest.raises(af.DidNotConverge, match="no thickness helps") as caught:
        af.dead_load(af.build(ring(0.2), fidelity="rigid"))
    least = value(r"coefficient of friction of ([\d.]+)", str(caught.value))
    assert not af.stands(ring(least - 0.01))
    assert af.stands(ring(least + 0.005))
    assert not af.stands(ring(0.2, 1.5))
    assert "joints hinge (joints " in explain_instability(
        af.circular_arch(radius=2.95, thickness=0.12, embrace=180.0, voussoirs=17)
    )


def test_nothing_holds_a_block_that_hangs():
    """Below a fixed block, it would need tension."""
    hanging = [[0.0, -1.0], [1.0, -1.0], [1.0, -0.5], [0.0, -0.5]]
    text = explain_instability(on_a_bed(hanging))
    assert text.startswith("no compression in its joints can hold 'stone'")


def test_the_joint_that_slides_and_the_block_that_nothing_holds_are_named():
    """A stack on a slope of 0.35, one of its beds smooth; and a second block that hangs."""
    tilt = np.arctan(0.35)
    c, s = np.cos(tilt), np.sin(tilt)

    def cube(low, name, **kind):
        points = np.array([[0.0, low], [1.0, low], [1.0, low + 0.5], [0.0, low + 0.5]])
        turned = points @ np.array([[c, s], [-s, c]])
        return af.Block(tuple(map(tuple, turned)), STONE, name, **kind)

    blocks = [cube(-0.5, "bed", fixed=True), cube(0.0, "low"), cube(0.5, "top")]
    stack = af.masonry.assembled(blocks, af.Contact(1e10, 4e9, 0.9))
    smooth = replace(stack.joints[1].contact, friction=0.2)
    joints = (stack.joints[0], replace(stack.joints[1], contact=smooth))
    text = explain_instability(replace(stack, joints=joints))
    assert text.startswith(f"joints slide ({joints[1].name}): it stands from")
    assert value(r"coefficient of friction of ([\d.]+)", text) == pytest.approx(0.35, rel=0.02)
    outlines = {"lintel": (-0.5, 0.0), "hanging": (-1.0, -0.5)}
    shifted = [
        af.Block(((3.0, a), (4.0, a), (4.0, b), (3.0, b)), STONE, name, fixed=name == "lintel")
        for name, (a, b) in outlines.items()
    ]
    both = af.masonry.assembled([*blocks[:2], *shifted], af.Contact(1e10, 4e9, 0.9))
    text = explain_instability(both)
    assert text.startswith("no compression in its joints can hold 'hanging'")


def test_an_arch_without_its_keystone_is_said_to_lack_a_stone():
    ring = af.circular_arch(radius=3.0, thickness=0.6, embrace=150.0, voussoirs=7)
    blocks = [block for k, block in enumerate(ring.blocks) if k != ring.free[3]]
    text = explain_instability(af.masonry.assembled(blocks, af.Contact(1e10, 4e9, 0.6)))
    ends = "beside 'voussoir 3' at (-1.093, 2.786) or 'voussoir 5' at (1.093, 2.786), or it needs"
    assert f"a stone or a support is missing {ends}" in text
    assert "()" not in text
