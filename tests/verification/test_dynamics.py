"""Time stepping: order of accuracy, energy, damping, equivalence of formulations."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from glued import glued
from orders import observed_order
from scipy.linalg import eigh

import archfem as af
from archfem.joints.contact_law import is_closed

STILL = af.Motion(np.zeros(2), 1.0)
NEWMARK, CONSERVING = af.dynamics.Newmark(), af.dynamics.Conserving()


@pytest.fixture(scope="module")
def model(ring):
    """Joints that never slide, which every scheme steps."""
    return af.build(glued(ring), fidelity="rigid")


@pytest.fixture(scope="module")
def dead(model):
    return af.dead_load(model)


def swinging(model, dead, mode):
    """A start in one mode about the dead load, so small that no joint point changes status."""
    tangent = model.tangent(dead.q)
    squares, shapes = eigh(tangent.toarray(), model.mass.toarray())
    equation = af.dynamics.Equation(model, STILL)
    state = equation.at_rest(dead.q, memory=dead.model.memory)
    shape = 1e-9 * shapes[:, mode] / np.abs(shapes[:, mode]).max()
    return equation.accelerated(replace(state, q=dead.q + shape)), shape, np.sqrt(squares[mode])


@pytest.mark.parametrize(
    ("scheme", "bound"),
    [
        pytest.param(NEWMARK, 1.05, marks=pytest.mark.slow),
        (CONSERVING, 1.05),
        pytest.param(af.HHT(-0.1), 2.5, marks=pytest.mark.slow),
    ],
    ids=["newmark", "conserving", "hht"],
)
def test_second_order_in_time(model, dead, scheme, bound, verified):
    """Free vibration in the lowest mode against the cosine, over three periods.

    The period error of average acceleration, and of the midpoint rule, is (ω dt)²/12: 0.0062 of a
    period after three at 40 steps each, so the bound, a multiple of it, is about the theoretical
    value.
    """
    start, shape, omega = swinging(model, dead, 0)
    end = 3.0 * 2.0 * np.pi / omega
    errors, sizes = [], np.array([20, 40])
    for steps in 3 * sizes:
        stepper = af.dynamics.SnesSolver(af.dynamics.Equation(model, STILL, scheme=scheme))
        *_, last = stepper.steps(start, end / steps, end)
        amplitude = shape @ (last.state.q - dead.q) / (shape @ shape)
        velocity = shape @ last.state.velocity / (shape @ shape) / omega
        errors.append(np.hypot(amplitude - 1.0, velocity))
    theory = 3.0 * 2.0 * np.pi * (2.0 * np.pi / sizes[-1]) ** 2 / 12.0
    assert observed_order(1.0 / sizes, errors)[-1] == pytest.approx(2.0, abs=0.1)
    assert errors[-1] < bound * theory
    case = f"{type(scheme).__name__}, free vibration: order in time"
    order = observed_order(1.0 / sizes, errors)[-1]
    verified(case, 2.0, "theory", round(order, 2), difference=abs(order / 2.0 - 1.0))


def energies(model, start, dt, end, scheme):
    """Kinetic + potential energy less the work of weight, along a run."""
    weight = af.statics.self_weight(model)
    found = []
    equation = af.dynamics.Equation(model, STILL, scheme=scheme)
    for step in af.dynamics.SnesSolver(equation).steps(start, dt, end):
        state = step.state
        kinetic = 0.5 * state.velocity @ (model.mass @ state.velocity)
        found.append(kinetic + model.energy(state.q) - weight @ state.q)
    return np.array(found)


@pytest.mark.parametrize("scheme", [NEWMARK, CONSERVING], ids=["newmark", "conserving"])
def test_energy_is_conserved_while_joints_stay_closed(model, dead, scheme):
    start, _, omega = swinging(model, dead, 0)
    dt = 2.0 * np.pi / omega / 20.0
    energy = energies(model, start, dt, 50.0 * dt, scheme)
    rest = model.energy(dead.q) - af.statics.self_weight(model) @ dead.q
    kinetic = 0.5 * omega**2 * (start.q - dead.q) @ (model.mass @ (start.q - dead.q))
    # Both are differences of energies near 10 J: their rounding is 1e-15 J.
    assert np.ptp(energy) < 1e-6 * kinetic + 1e-13
    assert energy[0] - rest == pytest.approx(kinetic, rel=1e-3, abs=1e-13)


def pushed(model, dead):
    """The ring at 0.05 m/s, which opens joints; and its kinetic energy [J]."""
    equation = af.dynamics.Equation(model, STILL)
    velocity = np.zeros(model.size)
    velocity[0::3] = 0.05
    opened = ~is_closed(model.operator.effective_gaps(dead.q + 0.01 * velocity))
    assert opened.any()
    state = replace(equation.at_rest(dead.q, memory=dead.model.memory), velocity=velocity)
    return equation.accelerated(state), 0.5 * velocity @ (model.mass @ velocity)


@pytest.mark.slow
def test_energy_balance_of_an_undamped_rocking_ring(model, dead):
    """A push that opens joints: energy of the weight and the springs is kept, but for O(dt²)."""
    start, given = pushed(model, dead)
    drift = [np.ptp(energies(model, start, dt, 0.2, NEWMARK)) / given for dt in (5e-4, 2.5e-4)]
    assert drift[0] < 0.02
    assert drift[1] < 0.6 * drift[0]


def test_the_conserving_scheme_keeps_the_energy_of_a_rocking_ring(model, dead, verified):
    """The same push, with steps ten times as long: to the tolerance of SNES, 1e-8 of the forces."""
    start, given = pushed(model, dead)
    off = np.ptp(energies(model, start, 5e-3, 0.2, CONSERVING)) / given
    assert off < 1e-6
    case = "energy of an undamped ring that opens its joints, 5 ms steps"
    verified(case, "constant", "conservation", "constant", difference=off)


def test_work_of_the_ground_balances_energy(ring, model, dead):
    """Undamped, joints closed: energy gained = work of -M r a_g, to the trapezoidal rule."""
    times = np.arange(0.0, 0.5, 0.005)
    motion = af.Motion(0.002 * np.sin(2.0 * np.pi * 4.0 * times), 0.005)
    equation = af.dynamics.Equation(model, motion)
    start = equation.at_rest(dead.q)
    weight = af.statics.self_weight(model)
    states = [start] + [s.state for s in af.dynamics.SnesSolver(equation).steps(start, 0.005, 0.49)]
    force = [-model.mass_influence @ motion.at(s.time)[0] for s in states]
    moved = [b.q - a.q for a, b in pairwise(states)]
    work = sum(0.5 * (a + b) @ d for a, b, d in zip(force[:-1], force[1:], moved, strict=True))
    kinetic = 0.5 * states[-1].velocity @ (model.mass @ states[-1].velocity)
    stored = model.energy(states[-1].q) - model.energy(dead.q) - weight @ (states[-1].q - dead.q)
    assert kinetic + stored == pytest.approx(work, rel=1e-3)


def test_at_rest_stays_at_rest(model, dead):
    equation = af.dynamics.Equation(model, STILL, af.Rayleigh(0.05, (8.0, 16.0)))
    *_, last = af.dynamics.SnesSolver(equation).steps(equation.at_rest(dead.q), 0.02, 1.0)
    assert np.abs(last.state.q - dead.q).max() < 1e-12


def test_free_fall(stack, verified):
    """Ground that drops faster than g: nothing holds the blocks, which fall with g."""
    model = af.build(stack, fidelity="rigid")
    down = af.Motion(np.zeros(101), 0.001, np.full(101, -3.0 * 9.81))
    equation = af.dynamics.Equation(model, down)
    steps = list(
        af.dynamics.SnesSolver(equation).steps(equation.at_rest(af.dead_load(model).q), 0.001, 0.1)
    )
    # Relative to the ground the blocks rise at 2 g once the compressed joints have let go.
    late = steps[50:]
    rate = np.diff([s.state.velocity[1] for s in late]) / 0.001
    assert np.all(late[-1].resultants[:, 0] == 0.0)
    assert rate == pytest.approx(2.0 * 9.81, rel=1e-9)
    case = "blocks whose ground drops at 3 g: acceleration [m/s²]"
    verified(case, 2.0 * 9.81, "free fall", rate[-1])


@pytest.mark.parametrize(
    "joints",
    [
        "closed",
        pytest.param("initial", marks=pytest.mark.slow),
        pytest.param("none", marks=pytest.mark.slow),
    ],
)
def test_damping_ratio_is_met_at_its_frequencies(stack, joints):
    """Logarithmic decrement of a closed structure; "none" leaves rigid blocks the mass part."""
    model = af.build(stack, fidelity="rigid")
    dead = af.dead_load(model)
    start, shape, omega = swinging(model, dead, 0)
    low = omega / 2.0 / np.pi
    damping = af.Rayleigh(0.05, (low, 4.0 * low), joints)
    stepper = af.dynamics.SnesSolver(af.dynamics.Equation(model, STILL, damping))
    dt = 2.0 * np.pi / omega / 50.0
    steps = list(stepper.steps(start, dt, 50 * dt * 2.2))
    found = np.array([shape @ (s.state.q - dead.q) / (shape @ shape) for s in steps])
    peaks = [k for k in range(1, len(found) - 1) if found[k - 1] < found[k] > found[k + 1]]
    decrement = np.log(found[peaks[0]] / found[peaks[1]])
    ratio = decrement / np.hypot(2.0 * np.pi, decrement)
    expected = 0.05 if joints != "none" else 0.05 * 4.0 / 5.0
    assert ratio == pytest.approx(expected, rel=2e-3)


def test_closed_and_initial_damping_differ_only_where_joints_open(stack):
    model = af.build(stack, fidelity="rigid")
    dead = af.dead_load(model)
    for amplitude, same in ((0.2, True), (4.0, False)):
        times = np.arange(0.0, 0.2, 0.005)
        motion = af.Motion(amplitude * np.sin(2.0 * np.pi * 5.0 * times), 0.005)
        ends = []
        for joints in ("closed", "initial"):
            equation = af.dynamics.Equation(model, motion, af.Rayleigh(0.05, (5.0, 40.0), joints))
            *_, last = af.dynamics.SnesSolver(equation).steps(equation.at_rest(dead.q), 0.005, 0.15)
            ends.append(last.state.q)
        near = np.abs(ends[0] - ends[1]).max() < 1e-9 * np.abs(ends[0]).max()
        assert near == same


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: af.Rayleigh(5.0, (8.0, 16.0)), r"ratio \[-\] = 5.0 is"),
        (lambda: af.Rayleigh(0.05, (16.0, 8.0)), "lower one first"),
        (lambda: af.Rayleigh(0.05, (8.0, 16.0), "open"), "joints = 'open'"),
        (lambda: af.dynamics.Newmark(0.0, 0.5), "not stable"),
        (lambda: af.HHT(0.2), r"HHT alpha \[-\] = 0.2"),
    ],
)
def test_refusals(make, says):
    with pytest.raises(af.InvalidInput, match=says):
        make()
