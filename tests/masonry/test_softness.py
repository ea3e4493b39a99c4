"""How soft blocks are: closed forms of one block, and soil told from stone."""

from dataclasses import replace

import numpy as np
import pytest

import archfem as af
from archfem.masonry.softness import soft_blocks, softness, yielding_blocks


def test_a_shear_wave_crosses_a_block_twice(stack):
    found = softness(stack, 1)
    wave = np.sqrt(30e9 / 2.4 / (20e3 / 9.81))  # of stone, which is 1 m large here
    assert found.inner == pytest.approx(wave / 2.0)
    assert found.ratio == pytest.approx(30e9 / 1.48e9)


def test_soil_is_soft_and_yields_and_stone_is_neither(viaduct):
    soil = viaduct.block_number("backfill")
    assert soft_blocks(viaduct) == yielding_blocks(viaduct) == (soil,)


def test_bodies_yield_by_their_roles_whatever_they_are_called(viaduct):
    blocks, joints = (
        tuple(replace(each, part=f"Teil {len(each.part)}") for each in members)
        for members in (viaduct.blocks, viaduct.joints)
    )
    other = [each.part for each in blocks if each.role == "other"]
    assert not {each.part for each in blocks if each.role != "other"} & set(other)
    assert yielding_blocks(replace(viaduct, blocks=blocks, joints=joints)) == (
        viaduct.block_number("backfill"),
    )


def test_a_ring_never_yields_however_soft():
    pulp = af.Material(1e6, 0.2, 20e3)
    ring = af.circular_arch(radius=3, thickness=0.5, embrace=120, voussoirs=9, material=pulp)
    assert len(soft_blocks(ring)) == 9
    assert yielding_blocks(ring) == ()
