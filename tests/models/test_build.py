"""Models that cannot be built."""

import pytest

import archfem as af


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"fidelity": "exact"}, "fidelity = 'exact' is not known"),
        ({"cells": (4, 4, 4)}, "has 3 values"),
        ({"quadrature": "simpson"}, "'simpson' is not known"),
    ],
)
def test_build_refuses(ring, given, says):
    with pytest.raises(af.InvalidInput, match=says):
        af.build(ring, **given)


@pytest.mark.parametrize("given", [{"dilatancy": 0.02}, {"tension": 1e3}])
def test_weak_forms_have_no_teeth_and_no_bond(given):
    contact = af.Contact(1e9, 4e8, 0.5, "toothed", cohesion=5e3, **given)
    one = af.column(breadth=1.0, heights=[1.0], contact=contact)
    with pytest.raises(af.InvalidInput, match=r"\['toothed'\] have dilatancy or tension"):
        af.build(one, fidelity="monolithic", cells=(1, 1))


def test_soft_blocks_of_a_fidelity_are_one_doubt():
    """Nine stones of ten metres, beside stiff joints."""
    lengths = {"radius": 30.0, "thickness": 4.5, "embrace": 150.0, "voussoirs": 9}
    ring = af.circular_arch(**lengths, contact=af.Contact(1e9, 3e8))
    (doubt,) = af.build(ring, fidelity="rigid").doubts
    assert "voussoir 1" in doubt.cause
    assert "voussoir 9" in doubt.cause
    two = af.build(ring, fidelity={"voussoir 1": "faces", "rest": "rigid"}, degree=2).doubts
    assert [doubt.remedy.split()[0] for doubt in two] == ["'rigid'", "'faces'"]
