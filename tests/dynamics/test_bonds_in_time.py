"""Joints that dilate and bonds that break, in time: against closed forms, and their energy."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import archfem as af
from archfem.dynamics.solvers.selection import stepper_for

GRAVITY = af.units.G

STILL = af.Motion(np.zeros(6), 0.1)


@cache
def block(stiffness, **given):
    """A block so flat that its bed stays closed: 1 m broad and 0.1 m high, 2 kN."""
    contact = af.Contact(stiffness, stiffness, **given)
    structure = af.column(breadth=1.0, heights=[0.1], contact=contact)
    return af.build(structure, fidelity="rigid", quadrature="lobatto")


def run(model, motion, dt, velocity=None, damping=None):
    """Start, states, N, V, M of the first joint (steps, 3), and energies (steps, 4)."""
    equation, dead = af.dynamics.Equation(model, motion, damping), af.dead_load(model)
    start = equation.at_rest(dead.q, memory=dead.model.memory)
    if velocity is not None:
        start = equation.accelerated(replace(start, velocity=np.array(velocity)))
    stepper = stepper_for("auto", equation)
    assert stepper.name == "snes"
    batches = list(stepper.batches(start, dt, motion.duration))
    states = [batch.state(0) for batch in batches]
    resultants = np.concatenate([batch.resultants for batch in batches])[:, 0]
    energy = np.concatenate([batch.energy for batch in batches])
    return start, states, resultants, (equation.energy(start), energy)


def drift(energies):
    """Largest energy from nowhere, relative to the largest kinetic one, and the least loss."""
    first, energy = energies
    stored = energy[:, 0] + energy[:, 1] - first[0] - first[1]
    balance = stored - np.cumsum(energy[:, 2]) + np.cumsum(energy[:, 3])
    largest = max(energy[:, 0].max(), first[0])
    return np.abs(balance).max() / largest, energy[:, 3].min() / largest


@pytest.mark.slow
@pytest.mark.parametrize("dt", [8e-3, 2e-3])
def test_a_block_thrown_up_its_teeth_stops_by_closed_form(dt):
    """m (g + t s̈) = N and m s̈ = -μ N: it stops after v² (1 + μ t) / (2 μ g), risen by t of that.

    On the way N = m g / (1 + μ t), and friction takes (μ - t) N s. The elastic slip of its bed,
    1e-6 m of 0.112 m, and the step in which it stops leave less than 1e-4; energy is kept to 1e-8.
    """
    friction, teeth, speed = 0.5, 0.2, 1.0
    model = block(1e9, friction=friction, dilatancy=teeth)
    start, states, resultants, energies = run(model, STILL, dt, [speed, teeth * speed, 0.0])
    along = 1.0 + friction * teeth
    way = speed**2 * along / (2.0 * friction * GRAVITY)
    moved = states[-1].q - start.q
    assert moved[0] == pytest.approx(way, rel=1e-4)
    assert moved[1] == pytest.approx(teeth * way, rel=1e-4)
    assert states[-1].memory == pytest.approx(np.full(len(states[-1].memory), way), rel=1e-4)
    sliding = int(0.9 * speed * along / (friction * GRAVITY) / dt)
    assert resultants[:sliding, 0].mean() == pytest.approx(2e3 / along, rel=0.01)
    off, least = drift(energies)
    assert off < 1e-8
    assert least >= -1e-12
    lost = energies[1][:, 3].sum()
    assert lost == pytest.approx((friction - teeth) * 2e3 / along * way, rel=1e-3)


@pytest.mark.slow
def test_without_teeth_and_bonds_nothing_changes():
    """Dilatancy 0 and tension 0 are the contact as it was, to the last bit of a history."""
    plain, given = block(1e8, friction=0.5), block(1e8, friction=0.5, dilatancy=0.0, tension=0.0)
    assert plain is not given
    assert plain.structure == given.structure
    assert given.operator.points.is_plain
    histories = [af.time_history(each, pulse(), dt=0.01, method="snes") for each in (plain, given)]
    assert np.array_equal(*(each.dataset["last_q"].values for each in histories))


def pulse(peak=8.0, duration=0.4, dt=0.05):
    """One push of the ground, and back."""
    times = np.arange(0.0, 1.0 + 0.5 * dt, dt)
    return af.Motion(
        np.where(times <= duration, peak * np.sin(2 * np.pi * times / duration), 0.0), dt
    )


@pytest.mark.slow
def test_a_block_that_slides_to_and_fro_rises_by_how_far_it_is_out():
    """For any path: at every step the rise is tan ψ |slid|, but for compression."""
    model = block(1e8, friction=0.3, dilatancy=0.15)
    start, states, _, energies = run(model, pulse(), 4e-3)
    slid = np.array([state.memory.mean() for state in states])
    rise = np.array([state.q[1] - start.q[1] for state in states])
    assert np.ptp(slid) > 0.02
    assert np.any(np.diff(np.abs(slid)) < -1e-5)  # it also moves down
    pressed = 2.0 * 2e3 / 1e8  # twice that of the weight alone, where the motion lifts it
    assert rise == pytest.approx(0.15 * np.abs(slid), abs=pressed)
    assert rise.max() > 50.0 * pressed
    off, least = drift(energies)
    assert off < 1e-8
    assert least >= -1e-12


def test_a_bonded_block_swings_as_a_linear_one_until_it_breaks():
    """Thrown up at v: u = v / ω sin ω t with ω² = k A / m, if k u - m g stays below f_t A.

    Just above, all bonds break at once, and it flies by (v² - lost) / 2 g with the energy left.
    """
    stiffness, mass, tension = 1e6, 2e3 / GRAVITY, 4e3
    model = block(stiffness, friction=None, tension=tension)
    omega = np.sqrt(stiffness / mass)
    speed = (tension + 2e3) / stiffness * omega
    # a period of 0.09 s, and the break at 0.02 s with some of the flight
    period, flight = (af.Motion(np.zeros(2), end) for end in (0.1, 0.05))
    start, states, resultants, energies = run(model, period, 5e-4, [0.0, 0.99 * speed, 0.0])
    assert not states[-1].memory.any()
    times = np.array([state.time for state in states])
    moved = np.array([state.q[1] for state in states]) - start.q[1]
    size = 0.99 * speed / omega
    assert moved == pytest.approx(size * np.sin(omega * times), abs=5e-3 * size)
    assert resultants[:, 0].min() == pytest.approx(2e3 - stiffness * size, rel=1e-3)
    assert drift(energies)[0] < 1e-8
    start, states, resultants, energies = run(model, flight, 5e-4, [0.0, 1.1 * speed, 0.0])
    count = len(states[-1].memory) // 2
    assert np.all(states[-1].memory[count:] == 1.0)
    off, least = drift(energies)
    assert off < 1e-8
    assert least >= -1e-12
    lost = energies[1][:, 3].sum()
    assert lost == pytest.approx(0.5 * tension**2 / stiffness, rel=0.05)
    assert np.sum(resultants[:, 0] == 0.0) > 50  # it flies for 30 ms of 50


def test_the_loss_of_a_bond_tends_to_its_elastic_energy():
    """f_t² A / (2 k): in a step it is held at f_t to the end, an error of first order in dt."""
    stiffness, mass, tension = 1e6, 2e3 / GRAVITY, 4e3
    model = block(stiffness, friction=None, tension=tension)
    speed = 1.1 * (tension + 2e3) / stiffness * np.sqrt(stiffness / mass)
    short, expected = af.Motion(np.zeros(2), 0.03), 0.5 * tension**2 / stiffness
    errors = []
    for dt in (1e-3, 2e-4):
        *_, energies = run(model, short, dt, [0.0, speed, 0.0])
        errors.append(energies[1][:, 3].sum() / expected - 1.0)
    assert 0.0 <= errors[1] < 0.02
    assert errors[1] <= errors[0] < 0.2


@pytest.mark.slow
@pytest.mark.parametrize("rule", ["lobatto", "exact"])
@pytest.mark.parametrize("damping", [None, af.StiffnessDamping(0.05, 20.0)])
def test_a_ring_of_teeth_and_bonds_neither_gains_nor_loses(rule, damping):
    """Bonds break, joints slide and rise; exchanged energy is kept to 1e-8, no step gains."""
    contact = af.Contact(1.48e9, 0.3e9, 0.3, cohesion=60e3, dilatancy=0.2, tension=40e3)
    structure = af.circular_arch(
        radius=2.95, thickness=0.55, embrace=159.0, voussoirs=5, contact=contact
    )
    model = af.build(structure, fidelity="rigid", quadrature=rule, cells=(1, 1))
    motion = af.Motion.synthetic(duration=2.0, pga=8.0, seed=3).cut(0.4, 0.6)
    _, states, _, energies = run(model, motion, 0.005, damping=damping)
    memory = states[-1].memory
    count = len(memory) // 2
    assert memory[count:].sum() > 0.3 * count
    assert np.abs(memory[:count]).max() > 1e-4
    off, least = drift(energies)
    assert off < 1e-8
    assert least >= -1e-12


@pytest.mark.slow
def test_a_history_can_be_continued_from_its_file(tmp_path):
    """Broken bonds and slips pass with `last_state`, also of a saved run."""
    given = {"friction": 0.3, "cohesion": 6e2, "tension": 2e3, "dilatancy": 0.1}
    model = block(1e9, **given)
    motion = pulse()
    whole = af.time_history(model, motion, dt=5e-3)
    part = af.time_history(model, motion.cut(0.0, 0.3), dt=5e-3)
    assert part.dataset.attrs["method"] == "snes"
    part.save(tmp_path / "part.nc")
    kept = af.dynamics.History.read(tmp_path / "part.nc")
    state = af.dynamics.last_state(kept)
    count = len(model.operator.points.offset)
    assert state.memory.shape == (2 * count,)
    assert state.memory[count:].any()
    rest = af.time_history(model, motion, dt=5e-3, start=state)
    assert rest.dataset["last_q"].values == pytest.approx(whole.dataset["last_q"].values, rel=1e-6)
    assert "tension" in kept.joints.coords


def test_compiled_methods_and_other_schemes_refuse_bonds():
    model = block(1e9, friction=0.3, dilatancy=0.1)
    with pytest.raises(af.InvalidInput, match="neither dilate, nor resist tension"):
        af.time_history(model, STILL, dt=1e-3, method="newton")
    bonded = block(1e9, friction=None, tension=1e3)
    with pytest.raises(af.InvalidInput, match="follows no bonds"):
        af.time_history(bonded, STILL, dt=1e-3, scheme=af.dynamics.Newmark())
