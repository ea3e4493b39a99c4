"""Friction with memory in time: blocks on level and inclined beds, known in closed form."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from sliding_block import slide

import archfem as af
from archfem.dynamics.solvers.selection import stepper_for
from archfem.masonry.assembly import assembled

RECORDS = Path(__file__).parents[2].parent / "shared" / "records"

GRAVITY = af.units.G


@cache
def block(friction, stiffness):
    """A block so flat that its bed stays closed: 1 m broad and 0.1 m high."""
    contact = af.Contact(stiffness, stiffness, friction)
    structure = af.column(breadth=1.0, heights=[0.1], contact=contact)
    return af.build(structure, fidelity="rigid", quadrature="lobatto")


def run(model, motion, dt, start=None, damping=None):
    """States at the ends of the steps, N, V, M (steps, 3), and energies (steps, 4)."""
    equation = af.dynamics.Equation(model, motion, damping)
    if start is None:
        dead = af.dead_load(model)
        start = equation.at_rest(dead.q, memory=dead.model.memory)
    stepper = stepper_for("auto", equation)
    batches = list(stepper.batches(start, dt, motion.duration))
    states = [batch.state(k) for batch in batches for k in range(len(batch.times))]
    rows = (np.concatenate([getattr(b, key) for b in batches]) for key in ("resultants", "energy"))
    resultants, energy = rows
    return states, resultants[:, 0], energy


def pulse(peak=8.0, duration=0.4, end=1.0, dt=0.05):
    """One push of the ground, straight between samples."""
    times = np.arange(0.0, end + 0.5 * dt, dt)
    return af.Motion(
        np.where(times <= duration, peak * np.sin(np.pi * times / duration) ** 2, 0.0), dt
    )


def slid(friction, stiffness, motion, dt):
    """How far a block has slid for good [m]."""
    states, *_ = run(block(friction, stiffness), motion, dt)
    return float(states[-1].memory.mean())


def test_newmarks_block_slides_by_closed_form(verified):
    """The slip agrees to 1e-6 of 0.19 m, in steps of 0.25 ms at k = 3e11 Pa/m.

    In the step in which it stops the path is not straight: an error of a dt² / 8, here 3e-8 m. The
    elastic slip leaves 7e-7 (below), with the other sign.
    """
    expected, _ = slide(pulse().horizontal, 0.05, 0.3 * GRAVITY)
    way = slid(0.3, 3e11, pulse(), 2.5e-4)
    assert way == pytest.approx(expected, rel=1e-6)
    verified(
        "Newmark's sliding block, way [m]", abs(expected), "Newmark (1965), integrated", abs(way)
    )


@pytest.mark.parametrize("method", ["newton", "compliance"])
def test_a_block_that_slides_far_is_never_left_to_snes(method):
    """Its slip, 0.8 m, rounds to more than 1e-12 of its weight times its stiffness can tell."""
    model, motion, dt = block(0.1, 1e11), pulse(), 1e-3
    equation, dead = af.dynamics.Equation(model, motion), af.dead_load(model)
    start = equation.at_rest(dead.q, memory=dead.model.memory)
    batches = list(stepper_for(method, equation).batches(start, dt, motion.duration))
    assert not any(batch.fallback for batch in batches)
    assert np.abs(batches[-1].state(len(batches[-1].times) - 1).memory).min() > 0.5


@pytest.mark.slow
def test_elastic_slip_errs_in_proportion_to_its_size():
    """The error of a block that stops and stays is as 1/k_s, if steps are short enough."""
    expected, _ = slide(pulse().horizontal, 0.05, 0.3 * GRAVITY)
    sizes = np.array([1e8, 1e9, 1e10])
    errors = [abs(slid(0.3, k, pulse(), 1e-4) / expected - 1.0) for k in sizes]
    assert errors[-1] < 1e-4
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.5)
    assert errors[1] / errors[2] == pytest.approx(10.0, rel=0.5)


def test_a_block_below_its_limit_does_not_slide():
    states, resultants, energy = run(block(0.3, 1e11), pulse(peak=2.8), 1e-3)
    elastic = 0.3 * 2e3 / 1e11
    assert np.abs(states[-1].memory).max() < 0.1 * elastic  # of the edge that is pressed least
    assert np.abs(resultants[:, 1]).max() == pytest.approx(2e3 / GRAVITY * 2.8, rel=0.05)
    assert energy[:, 3].sum() < 0.1 * elastic * 0.3 * 2e3


@pytest.mark.parametrize(
    "friction",
    [pytest.param(0.1, marks=pytest.mark.slow), 0.2, pytest.param(0.3, marks=pytest.mark.slow)],
)
def test_newmarks_block_under_an_earthquake(friction):
    """A synthetic motion: within 1e-3 of the way that it slides to and fro.

    Where it reverses without rest, its shear passes from one limit to the other over twice the
    elastic slip, in which it gains speed as the root of 1/k_s. In that step the force has one sign:
    an error of order dt. So this converges slower than the block that stops.
    """
    motion = af.Motion.synthetic(duration=5.0, pga=6.0, seed=2, vertical_ratio=0.0)
    expected, path = slide(motion.horizontal, motion.dt, friction * GRAVITY)
    assert path > 0.01
    assert abs(slid(friction, 1e11, motion, 2.5e-4) - expected) < 1e-3 * path


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.1, 0.2, 0.3])
def test_newmarks_block_under_a_record(friction):
    """The first 10 s of Erzincan: 0.37, 0.20 and 0.06 m, to 1e-4 of the way."""
    motion = erzincan()
    expected, path = slide(motion.horizontal, motion.dt, friction * GRAVITY)
    assert abs(slid(friction, 1e11, motion, 5e-4) - expected) < 1e-4 * path


@pytest.mark.slow
def test_newmarks_block_under_a_record_in_the_limit():
    """Stiffer and in shorter steps to 1e-5 of the way: 6.8e-6 at k = 1e13 Pa/m and 0.02 ms.

    Elastic shear reaches no less. Each reversal errs as the root of 1/k and as dt. At k = 1e15 the
    slip of 0.2 m, times k, rounds to as much of the friction as the larger k gains.
    """
    motion = erzincan()
    expected, path = slide(motion.horizontal, motion.dt, 0.2 * GRAVITY)
    soft, stiff = (
        abs(slid(0.2, stiffness, motion, dt) - expected) / path
        for stiffness, dt in ((1e11, 1e-4), (1e13, 2e-5))
    )
    assert stiff < 1e-5 < 0.3 * soft


def erzincan():
    """The first 10 s of one component."""
    if not RECORDS.is_dir():
        pytest.skip(f"no records in {RECORDS}")
    motion = af.Motion.read(RECORDS / "plain_columns" / "erzikan.txt")
    return af.Motion(motion.horizontal[:2000], motion.dt)


# ---- an incline


def incline(angle, friction, stiffness=1e11):
    """A flat block on a plane that falls to the left, 0.1 m high."""
    across = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])

    def turned(*points):
        return tuple((float(x), float(y)) for x, y in np.array(points) @ across.T)

    plane = turned((-0.5, -0.2), (0.5, -0.2), (0.5, 0.0), (-0.5, 0.0))
    stone = turned((-0.5, 0.0), (0.5, 0.0), (0.5, 0.1), (-0.5, 0.1))
    contact = af.Contact(stiffness, stiffness, friction)
    structure = af.Structure(
        (
            af.Block(plane, af.STONE, "plane", fixed=True, role="pier"),
            af.Block(stone, af.STONE, "block", role="pier"),
        ),
        (af.Joint((0, 1), *turned((-0.5, 0.0), (0.5, 0.0)), contact, "bed", role="pier"),),
    )
    return af.build(structure, fidelity="rigid", quadrature="lobatto")


@pytest.mark.parametrize("over", [1e-6, 1e-3, 0.2])
def test_a_block_slides_down_an_incline_with_constant_acceleration(over):
    """At tan φ = μ + over: g (sin φ - μ cos φ), from rest where a little more friction held it."""
    friction = 0.5
    angle = np.arctan(friction + over)
    held = af.dead_load(incline(angle, friction + 1.01 * over))
    model = incline(angle, friction)
    motion = af.Motion(np.zeros(11), 0.1)
    equation = af.dynamics.Equation(model, motion)
    states, *_ = run(model, motion, 1e-3, equation.at_rest(held.q, memory=held.model.memory))
    down = np.array([-np.cos(angle), -np.sin(angle)])
    moved = np.array([(state.q - held.q)[:2] @ down for state in states])
    expected = GRAVITY * (np.sin(angle) - friction * np.cos(angle))
    assert 2.0 * moved[-1] / states[-1].time ** 2 == pytest.approx(expected, rel=1e-5, abs=1e-9)


def test_a_block_stays_on_an_incline_for_as_long_as_one_looks():
    """At tan φ = μ - 1e-6: ten seconds, and it has not moved by more than rounding."""
    model = incline(np.arctan(0.5 - 1e-6), 0.5)
    dead = af.dead_load(model)
    states, *_ = run(model, af.Motion(np.zeros(101), 0.1), 5e-3)
    assert np.abs(states[-1].q - dead.q).max() < 1e-6 * np.abs(dead.q).max()


# ---- work of friction


def test_shear_is_at_its_limit_while_a_block_slides():
    """|V| = μ N in every step that slides all the way; N varies with the ground's vertical motion.

    The work of friction is the sum of V over the slip, less what is stored in the elastic slip.
    """
    motion = af.Motion.synthetic(duration=4.0, pga=5.0, seed=4).cut(1.0, 2.5)
    model = block(0.25, 1e11)
    states, resultants, energy = run(model, motion, 1e-3)
    slip = np.array([model.operator.slips(state.q).mean() for state in states])
    moved = np.diff(slip)
    elastic = 0.25 * 2e3 / 1e11
    slides = np.abs(moved) > 20.0 * elastic
    normal, shear = resultants[1:, 0], resultants[1:, 1]
    assert slides.sum() > 200
    assert np.ptp(normal[slides]) > 0.3 * normal.mean()  # the vertical motion counts
    expected = 0.25 * (normal * np.sign(moved))[slides]
    assert shear[slides] == pytest.approx(expected, rel=1e-4)  # elastic slip follows N
    work, stored = (shear * moved).sum(), 0.5 * elastic**2 * 1e11
    assert energy[1:, 3].sum() == pytest.approx(work, abs=20.0 * stored)


def test_no_shear_passes_a_joint_that_is_open():
    """A block thrown up: while it flies, nothing acts on it but its weight."""
    model = block(0.6, 1e10)
    dead = af.dead_load(model)
    motion = af.Motion(np.zeros(2), 0.3)
    equation = af.dynamics.Equation(model, motion)
    thrown = equation.accelerated(
        replace(equation.at_rest(dead.q), velocity=np.array([0.7, 1.0, 0.0]))
    )
    states, resultants, _ = run(model, motion, 1e-3, thrown)
    gaps = np.array([model.operator.openings(state.q).min() for state in states])
    flies = np.flatnonzero(np.minimum(gaps[1:], gaps[:-1]) > 0.0) + 1
    assert len(flies) > 150  # 2 v / g = 0.2 s
    assert np.all(resultants[flies][:, :2] == 0.0)
    gained = np.diff([state.velocity[0] for state in states])[flies - 1]
    assert np.abs(gained).max() < 1e-9


def test_a_run_in_two_parts_is_one_run():
    """Memory passes from one to the other with the state."""
    model, motion = block(0.25, 1e10), af.Motion.synthetic(duration=1.0, pga=5.0, seed=4)
    whole, *_ = run(model, motion, 2e-3)
    first = whole[249]
    second, *_ = run(model, motion, 2e-3, first)
    assert np.abs(first.memory).max() > 1e-4
    assert second[-1].q == pytest.approx(whole[-1].q, rel=1e-7)


def test_a_history_can_be_continued():
    """`last_state` of a history has the memory of the joints."""
    model, motion = block(0.25, 1e10), af.Motion.synthetic(duration=1.0, pga=5.0, seed=4)
    given = {"dt": 2e-3, "record": af.Record(fields_every=1)}
    whole = af.time_history(model, motion, **given)
    part = af.time_history(model, motion.cut(0.0, 0.5), **given)
    rest = af.time_history(model, motion, start=af.dynamics.last_state(part), **given)
    assert rest.dataset["last_q"].values == pytest.approx(whole.dataset["last_q"].values, rel=1e-6)


@pytest.mark.slow
def test_pieces_that_nothing_presses_together_take_whole_steps():
    """Flat pieces of fill on a wall rest at gaps of 1e-9 m, where cohesion comes and goes.

    Were it to end at zero, 11 of 200 steps would be halved, with up to 92 iterations.
    """
    soil = af.Material(6.25e9, 0.0, 18e3, name="soil")
    fill = af.Contact(2.84e7, 2.84e7, 0.65, cohesion=5e3)
    base = af.Contact(5e7, 5e7, 0.6)
    spans = [(-0.2, 2.6, -1.0, 0.0), *((0.52 * k, 0.52 * k + 0.52, 0.0, 0.054) for k in range(4))]
    blocks = [
        af.Block(
            ((a, low), (b, low), (b, high), (a, high)), soil, f"{k}", fixed=k == 0, role="other"
        )
        for k, (a, b, low, high) in enumerate(spans)
    ]
    strip = assembled(blocks, fill, width=3.2)
    beds = [replace(joint, contact=base) if 0 in joint.blocks else joint for joint in strip.joints]
    strip = replace(strip, joints=tuple(beds))
    model = af.build(strip, fidelity="rigid", displacements="large")
    motion = af.Motion.synthetic(seed=3, duration=1.0, pga=0.5)
    run = af.time_history(model, motion, dt=0.005, damping=af.StiffnessDamping(0.05, 10.0))
    assert run.dataset.attrs["halved_steps"] == run.dataset.attrs["fallback_steps"] == 0
    assert run.dataset["iterations"].max() <= 12
