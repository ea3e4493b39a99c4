"""Arrays in a page are read as they were written, to half a quantum."""

import numpy as np
import pytest
from pages import unpack

from archfem.view.pages.player_data import PackedArrays


def test_arrays_come_back_within_half_a_quantum():
    values = np.random.default_rng(0).normal(size=(3, 500)).cumsum(axis=1)
    values[1, 100:120] = values[2, 0] = np.nan
    pack = PackedArrays()
    pack.add("first", values)
    quantum = pack.head[0]["quantum"]
    pack.add("times", np.linspace(0.0, 100.0, 77)[None], 1e-6)
    found = unpack(pack.head, pack.text)
    assert np.array_equal(np.isnan(found["first"]), np.isnan(values))
    assert np.nanmax(np.abs(found["first"] - values)) <= 0.501 * quantum
    assert np.abs(found["times"] - np.linspace(0.0, 100.0, 77)).max() <= 0.501e-6
    assert quantum == pytest.approx(np.nanmax(np.abs(values)) / 4000)


@pytest.mark.parametrize("value", [0.0, np.nan])
def test_the_quantum_of_zero_is_one(value):
    pack = PackedArrays()
    pack.add("zero", np.full((2, 3), value))
    assert pack.head[0]["quantum"] == 1.0


def test_steady_values_take_next_to_no_room():
    pack = PackedArrays()
    pack.add("steady", np.full((100, 4000), 3.0), 1e-3)
    assert len(pack.text) < 10_000
