"""Actions: where loads stand, which supports settle, and what is refused."""

import numpy as np
import pytest

import archfem as af
from archfem.masonry.actions import loads


def test_a_point_load_stands_on_the_extrados(ring):
    number, point = af.PointLoad(0.4, (0.0, -1.0)).place(ring)
    assert ring.blocks[number].name in ("voussoir 9", "voussoir 10")
    outer = 2.95 + 0.55 / 2.0
    # On one of 16 chords of a stone, which lie within 5 mm of its face.
    assert point == pytest.approx([0.4, np.sqrt(outer**2 - 0.4**2)], abs=5e-3)


def test_a_point_load_beside_the_structure_is_refused(stack):
    with pytest.raises(af.errors.InvalidInput, match=r"x = 0.6 m misses .* from -0.5 to 0.5 m"):
        af.PointLoad(0.6, (0.0, -1.0)).place(stack)


def test_settlements_add_up_on_their_support(stack):
    sunk = af.Settlement("base", (0.0, -0.01, 0.0))
    at_rest = np.zeros((3, 3))
    once = sunk.added(stack, at_rest)
    assert sunk.added(stack, once).tolist() == [[0.0, -0.02, 0.0], [0.0] * 3, [0.0] * 3]
    assert not at_rest.any()
    assert af.Settlement(0, (0.0, 0.0, 0.1)).place(stack) == 0


@pytest.mark.parametrize("block", ["block 1", 1, "abutment", 7])
def test_only_supports_settle(stack, block):
    with pytest.raises(
        af.errors.InvalidInput, match=r"cannot settle: the supports are {'base': 0}"
    ):
        af.Settlement(block, (0.0, 0.0, 0.0)).place(stack)


def test_one_load_or_several():
    push, weight = af.BodyForce(0.1), af.PointLoad(0.0, (0.0, -1.0))
    assert loads(push) == [push]
    assert loads((push, weight)) == [push, weight]
    with pytest.raises(af.errors.InvalidInput, match="a Settlement comes alone"):
        loads([push, af.Settlement(0, (0.0, 0.0, 0.0))])
