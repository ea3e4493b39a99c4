"""Self-weight in limit analysis: when rigid blocks are in equilibrium under it."""

from types import SimpleNamespace

import pytest

from archfem.limit.weight import UNBALANCED, balanced


@pytest.mark.parametrize("free", [1, 200])
@pytest.mark.parametrize(("share", "stands"), [(0.98, True), (1.02, False)])
def test_what_is_missing_may_be_the_rounding_of_as_many_blocks_as_move(free, share, stands):
    dead = SimpleNamespace(blocks=SimpleNamespace(structure=SimpleNamespace(free=range(free))))
    fall = SimpleNamespace(value=share * UNBALANCED * free)
    assert balanced(fall, dead) is stands
