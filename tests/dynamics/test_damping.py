"""Damping by the modes that are effective along x."""

from types import SimpleNamespace

import numpy as np
import pytest

import archfem as af
from archfem.dynamics import effective_damping
from archfem.dynamics.damping import (
    EffectiveModeRange,
    _modes_with_share,
    effective_mode_range,
    resolve_effective_damping,
)
from archfem.dynamics.solvers.selection import stepper_for

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
    everything = af.modes(model, 51, start=dead)
    for share in (0.8, 0.9, 0.999):
        found = effective_mode_range(model, dead, mass_share=share)
        reached = [everything.mass_ratios[:number, 0].sum() for number in range(52)]
        assert reached[found.first - 1] < 0.05 <= reached[found.first]
        assert reached[found.last - 1] < share <= reached[found.last]
        assert found.mass_share == pytest.approx(reached[found.last], abs=1e-9)
        ends = everything.frequencies[[found.first - 1, found.last - 1]]
        assert found.frequencies == pytest.approx(ends, rel=SAME)
    text = effective_mode_range(model, dead, mass_share=0.8).text
    assert text.startswith("modes 1 and 4, the first and the last effective along x; up to the ")
    assert "88.2 % of the mass, most of it 1 (7.91 Hz, 70.7 %), 2 (" in text


@pytest.mark.parametrize("cells", [(2, 2), (3, 3)])
def test_the_last_effective_mode_barely_depends_on_the_mesh(ring, cells):
    """The third mode along x, near 41 Hz, whose mass is 8 % on one mesh and 4 % on the other."""
    model = af.build(ring, fidelity="full", cells=cells)
    assert effective_mode_range(model, af.dead_load(model)).frequencies[1] == pytest.approx(
        40.8, rel=0.02
    )


def test_search_continues_until_the_share_is_reached(ring):
    model = af.build(ring, fidelity="rigid")
    whole = effective_mode_range(model, "closed")
    assert effective_mode_range(model, "closed", initial_count=1).frequencies == pytest.approx(
        whole.frequencies, rel=SAME
    )


def test_a_search_that_is_cut_short_is_reported(ring, caplog):
    model = af.build(ring, fidelity="rigid")
    found = effective_mode_range(model, "closed", mass_share=0.95, initial_count=2, max_count=4)
    assert (found.first, found.last) == (1, 4)
    assert "4 modes, up to 29.7 Hz, have only 90.1 % of the mass along x, not 95 %" in caplog.text


def test_effective_damping_has_its_ratio_at_the_first_effective_mode(ring):
    """By the complex modes of the damped closed structure, not by the formula for the ratio."""
    model = af.build(ring, fidelity="rigid")
    damping = effective_damping(model, 0.05, "closed")
    first, _ = effective_mode_range(model, "closed").frequencies
    assert damping == af.StiffnessDamping(0.05, first)
    mass, stiffness = model.mass.toarray(), model.closed_tangent().toarray()
    lag = damping.mass * mass + damping.stiffness * stiffness
    none, one = np.zeros_like(mass), np.eye(len(mass))
    first = np.block(
        [[none, one], [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, lag)]]
    )
    roots = np.linalg.eigvals(first)
    swaying = roots[roots.imag > 0.0]
    slowest = swaying[np.argmin(abs(swaying))]
    assert -slowest.real / abs(slowest) == pytest.approx(0.05, rel=1e-6)
    assert abs(slowest) == pytest.approx(2.0 * np.pi * damping.frequency, rel=1e-6)


def test_first_effective_mode_is_reported(ring):
    model = af.build(ring, fidelity="rigid")
    _, text = resolve_effective_damping("effective", model, af.dead_load(model))
    assert text.endswith("; mode 1, the first effective along x, has 70.7 % of the mass")


def test_a_block_in_flight_is_not_dragged():
    """It falls as fast as undamped, while Rayleigh damping slows it; nothing touches it."""
    model = block()
    ends = {}
    for name, damping in {
        "free": None,
        "stiffness": effective_damping(model),
        "rayleigh": effective_damping(model, kind="rayleigh"),
    }.items():
        equation = af.dynamics.Equation(model, af.Motion(np.zeros(2), 0.2), damping)
        q = np.array([0.0, 0.5, 0.0])
        start = equation.at_rest(q, memory=af.dead_load(model).model.memory)
        *_, last = stepper_for("snes", equation).batches(start, 0.04, 0.2)
        ends[name] = last.state(len(last.times) - 1).velocity[1]
    assert ends["free"] == pytest.approx(-9.81 * 0.2, rel=1e-9)
    assert ends["stiffness"] == pytest.approx(ends["free"], rel=1e-9)
    assert abs(ends["rayleigh"]) < 0.7 * abs(ends["free"])


def test_rayleigh_damping_has_its_ratio_at_both_ends(ring):
    model = af.build(ring, fidelity="rigid")
    damping = effective_damping(model, 0.05, kind="rayleigh", joints="none")
    first, last = effective_mode_range(model).frequencies
    for frequency in (first, last):
        omega = 2.0 * np.pi * frequency
        ratio = 0.5 * (damping.mass / omega + damping.stiffness * omega)
        assert ratio == pytest.approx(0.05, rel=1e-12)
    assert damping == af.Rayleigh(0.05, (first, last), "none")


def test_too_few_effective_modes():
    with pytest.raises(af.InvalidInput, match=r"mode 1 alone has 75\.3 % of the mass along x"):
        effective_mode_range(block(), mass_share=0.5)
    with pytest.raises(af.InvalidInput, match=r"share of the mass \[-\] = 5\.0 is not"):
        effective_mode_range(block(), mass_share=5.0)
    with pytest.raises(af.InvalidInput, match="damping kind = 'mass' is not known"):
        effective_damping(block(), kind="mass")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((5.0, 8.0), r"ratio \[-\] = 5.0 is"),
        ((0.05, 0.0), r"damping frequency \[Hz\] = 0.0 is not between 0.001"),
        ((0.05, (8.0, 16.0)), "is not a finite number"),
        ((0.05, 8.0, "open"), "joints = 'open'"),
    ],
)
def test_invalid_stiffness_damping_is_refused(given, words):
    with pytest.raises(af.InvalidInput, match=words):
        af.StiffnessDamping(*given)


@pytest.mark.parametrize(("breadth", "number"), [(0.14, 2), (0.145, 1)])
def test_the_first_effective_mode_has_five_percent(breadth, number):
    """A slender block beside a wide one has the lowest mode, with 4.9 or 5.1 % of the mass."""
    contact = af.Contact(1e9, 0.5e9)

    def box(left, right, low, high, name):
        outline = ((left, high), (left, low), (right, low), (right, high))
        return af.Block(outline, af.STONE, name, low < 0, (0, 1, 2, 3), "pier", role="pier")

    blocks = (
        box(-2.0, 4.0, -1.0, 0.0, "base"),
        box(0.0, 2.0, 0.0, 1.0, "wide"),
        box(-1.0, breadth - 1.0, 0.0, 1.0, "slender"),
    )
    beds = (
        af.Joint((0, 1), (0.0, 0.0), (2.0, 0.0), contact, "wide", "pier", "pier"),
        af.Joint((0, 2), (-1.0, 0.0), (breadth - 1.0, 0.0), contact, "slender", "pier", "pier"),
    )
    model = af.build(af.Structure(blocks, beds), fidelity="rigid")
    dead = af.dead_load(model)
    found = af.modes(model, 2, dead)
    damping, text = resolve_effective_damping("effective", model, dead)
    assert damping.frequency == pytest.approx(found.frequencies[number - 1], rel=SAME)
    assert f"; mode {number}, the first effective along x, has " in text
    assert found.mass_ratios[0, 0] == pytest.approx(0.05, abs=0.0012)


@pytest.mark.parametrize(
    ("reached", "counts"), [(3, [3]), (4, [3, 6]), (10, [3, 6, 10]), (99, [3, 6, 10])]
)
def test_twice_as_many_modes_are_computed_until_they_have_the_share(
    reached, counts, monkeypatch, caplog
):
    """The modes of a model with 50 coordinates have the share from some number on."""
    computed = []

    def modes(model, count, start):
        computed.append(count)
        ratios = np.zeros((count, 2))
        ratios[min(reached, count) - 1, 0] = 0.91 if reached <= count else 0.5
        return SimpleNamespace(mass_ratios=ratios, frequencies=1.0 + np.arange(count))

    monkeypatch.setattr("archfem.dynamics.damping.modes", modes)
    monkeypatch.setattr("archfem.dynamics.damping.resolve_start", lambda *given: given)
    found, total = _modes_with_share(SimpleNamespace(size=50), "closed", 0.9, 3, 10)
    assert computed == counts
    assert len(total) == len(found.frequencies) == counts[-1]
    assert bool(caplog.text) is (reached == 99)


def test_four_modes_of_large_mass_are_named_in_their_order():
    ratios = np.zeros((6, 2))
    ratios[:, 0] = 0.3, 0.02, 0.25, 0.05, 0.2, 0.1
    given = SimpleNamespace(mass_ratios=ratios, frequencies=np.arange(1.0, 7.0))
    text = EffectiveModeRange(given, 1, 6).text
    assert text.endswith(
        "1 (1.00 Hz, 30.0 %), 3 (3.00 Hz, 25.0 %), 5 (5.00 Hz, 20.0 %), 6 (6.00 Hz, 10.0 %)"
    )
