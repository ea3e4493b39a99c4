"""How soft blocks are: closed forms of one block, and soil told from stone."""

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


def test_a_ring_never_yields_however_soft():
    pulp = af.Material(1e6, 0.2, 20e3)
    ring = af.circular_arch(radius=3, thickness=0.5, embrace=120, voussoirs=9, material=pulp)
    assert len(soft_blocks(ring)) == 9
    assert yielding_blocks(ring) == ()
