"""What cannot be built."""

import pytest

import archfem as af


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"fidelity": "exact"}, "fidelity 'exact' is not known"),
        ({"cells": (4, 4, 4)}, "has 3 values"),
        ({"quadrature": "simpson"}, "'simpson' is not known"),
    ],
)
def test_build_refuses(ring, given, says):
    with pytest.raises(af.InvalidInput, match=says):
        af.build(ring, **given)
