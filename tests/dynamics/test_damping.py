"""Damping by the modes that are effective along x."""

import numpy as np
import pytest

import archfem as af
from archfem.dynamics.damping import effective_damping, effective_range

SAME = 1e-9
"""Two ways to the same numbers: rounding of a stiffness whose ω² span eight decades."""


def block():
    """A stone on a joint, rigid: three coordinates."""
    material = af.Material(30e9, 0.2, 19620.0)
    shape = af.column(
        breadth=0.6, heights=[2.4], contact=af.Contact(1e9, 4e8, 0.6), material=material
    )
    return af.build(shape, fidelity="rigid")


def test_effective_modes_are_those_of_all_modes(ring):
    model = af.build(ring, fidelity="rigid")
    dead = af.dead_load(model)
    everything = af.modes(model, 51, about=dead)
    for share in (0.8, 0.9, 0.999):
        found = effective_range(model, dead, share=share)
        reached = [everything.mass_ratios[:number, 0].sum() for number in range(52)]
        assert reached[found.first - 1] < 0.05 <= reached[found.first]
        assert reached[found.last - 1] < share <= reached[found.last]
        assert found.share == pytest.approx(reached[found.last], abs=1e-9)
        ends = everything.frequencies[[found.first - 1, found.last - 1]]
        assert found.frequencies == pytest.approx(ends, rel=SAME)
    text = effective_range(model, dead, share=0.8).text
    assert text.startswith("modes 1 and 4, the first and the last effective along x; up to the ")
    assert "89.1 % of the mass, most of it 1 (8.04 Hz, 71.5 %), 2 (" in text


@pytest.mark.parametrize("cells", [(2, 2), (3, 3)])
def test_the_mesh_hardly_moves_the_last_effective_mode(ring, cells):
    """The third mode along x, near 41 Hz, whose mass is 8 % on one mesh and 4 % on the other."""
    model = af.build(ring, fidelity="full", cells=cells)
    assert effective_range(model, af.dead_load(model)).frequencies[1] == pytest.approx(
        40.8, rel=0.02
    )


def test_search_goes_on_until_the_share_is_reached(ring):
    model = af.build(ring, fidelity="rigid")
    whole = effective_range(model)
    assert effective_range(model, few=1).frequencies == pytest.approx(whole.frequencies, rel=SAME)


def test_a_search_that_is_cut_short_says_so(ring, caplog):
    model = af.build(ring, fidelity="rigid")
    found = effective_range(model, share=0.95, few=2, most=4)
    assert (found.first, found.last) == (1, 4)
    assert "4 modes, up to 29.7 Hz, have only 90.1 % of the mass along x, not 95 %" in caplog.text


def test_effective_damping_has_its_ratio_at_both_ends(ring):
    model = af.build(ring, fidelity="rigid")
    damping = effective_damping(model, 0.05, joints="none")
    first, last = effective_range(model).frequencies
    for frequency in (first, last):
        omega = 2.0 * np.pi * frequency
        ratio = 0.5 * (damping.mass / omega + damping.stiffness * omega)
        assert ratio == pytest.approx(0.05, rel=1e-12)
    assert damping == af.Rayleigh(0.05, (first, last), "none")


def test_too_few_effective_modes():
    with pytest.raises(af.InvalidInput, match=r"mode 1 alone has 75\.3 % of the mass along x"):
        effective_range(block(), share=0.5)
    with pytest.raises(af.InvalidInput, match=r"share 5\.0 of the mass"):
        effective_range(block(), share=5.0)
    with pytest.raises(af.InvalidInput, match="modes to compute at first = 0"):
        effective_range(block(), few=0)
