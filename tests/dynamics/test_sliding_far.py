"""Blocks that slide far: contact follows the whole faces, of the stone and of what is below it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from repeats import each_once
from sliding_block import slide

import archfem as af
from archfem.dynamics.solvers.selection import stepper_for

STIFFNESS = 1e10
WEIGHT = 8000.0
"""Of a block of 1 × 0.4 m of 20 kN/m³ [N]."""

MASS = WEIGHT / af.units.G
STONE = af.Material(30e9, 0.2, 20e3)


def box(name, left, right, low, high, **options):
    outline = ((left, low), (right, low), (right, high), (left, high))
    return af.Block(outline, STONE, name, role="pier", corners=(0, 1, 2, 3), **options)


@cache
def block_on(*bases, fidelity="rigid", **given):
    """Model of a block on fixed bases."""
    return af.build(bases_and_block(*bases, **given), fidelity=fidelity, displacements="large")


def bases_and_block(*bases, friction=0.2, cohesion=0.0, stone=(0.0, 1.0), height=0.4):
    """Block on fixed bases, each from one place to another, side by side."""
    contact = af.Contact(STIFFNESS, STIFFNESS, friction, cohesion=cohesion)
    blocks, joints = [], []
    for k, (left, right) in enumerate(bases):
        blocks.append(box(f"base {k}", left, right, -1.0, 0.0, fixed=True))
        ends = max(left, stone[0]), min(right, stone[1])
        places = [(x, 0.0) for x in ends]
        joints.append(af.Joint((k, len(bases)), *places, contact, f"bed {k}", role="pier"))
    blocks.append(box("block", *stone, 0.0, height))
    return af.Structure(tuple(blocks), tuple(joints))


def push(acceleration, duration, end=0.9):
    """A rectangular push of the ground, straight between samples of 5 ms."""
    times = np.arange(0.0, end + 1e-9, 0.005)
    return af.Motion(np.where(times < duration - 1e-9, acceleration, 0.0), 0.005)


def expected_slip(motion, resistance):
    """Slip of a rigid block whose resistance is constant, and what the first step may add [m].

    Shear grows to its limit within the first step of 0.5 ms: up to half of its impulse is missing.
    """
    slip, _ = slide(motion.horizontal, motion.dt, resistance / MASS)
    return slip, 0.5 * 5e-4 * resistance / MASS * motion.duration


def shear_while_sliding(run):
    """Shear of all joints in the steps of fast slip (steps, joints) [N]."""
    slip, shear = run.joints["slip"].values, run.joints["V"].values
    fast = np.diff(slip[:, 0], prepend=0.0) > 1e-4
    assert fast.sum() > 200
    return shear[fast]


@pytest.mark.parametrize(
    ("fidelity", "shove"),
    each_once(("rigid", "faces"), ((0.2, 1e3, -5.0, 0.45, 0.2845), (0.0, 3e3, -9.0, 0.3, 0.5761))),
)
def test_a_block_bears_on_all_of_its_face_however_far_it_slides(fidelity, shove):
    """On a base from -2 to 4 m it resists by μ N + c · 1 m to the end."""
    friction, cohesion, acceleration, duration, residual = shove
    model = block_on((-2.0, 4.0), friction=friction, cohesion=cohesion, fidelity=fidelity)
    motion, resistance = push(acceleration, duration), friction * WEIGHT + cohesion
    run = af.time_history(model, motion, dt=5e-4)
    slip, error = expected_slip(motion, resistance)
    assert slip == pytest.approx(residual, abs=1e-4)
    assert run.joints["slip"].values[-1, 0] == pytest.approx(slip, abs=error)
    assert shear_while_sliding(run) == pytest.approx(resistance, rel=1e-3)
    assert run.verdict.outcome == "dislocated"
    assert abs(run.dataset.attrs["energy_drift"]) < 1e-8
    # all steps of fast slip, and with them the cohesion of the whole face, count as sliding
    slides = run.joints["slide"].values[:, 0]
    assert slides[np.diff(run.joints["slip"].values[:, 0], prepend=0.0) > 1e-4].all()


@pytest.mark.parametrize(
    ("bases", "friction", "cohesion", "acceleration", "duration"),
    [
        ([(-2.0, 4.0)], 0.2, 1e3, -5.0, 0.45),
        ([(-2.0, 4.0)], 0.0, 3e3, -9.0, 0.3),
        ([(-1.0, 0.5), (0.5, 3.0)], 0.1, 1e3, -6.0, 0.5),
    ],
)
def test_a_loose_block_bears_on_all_of_its_face_too(
    bases, friction, cohesion, acceleration, duration
):
    """The same as rigid blocks by the scheme of Moreau and Jean, which hold from the first step."""
    structure = bases_and_block(*bases, friction=friction, cohesion=cohesion)
    motion = push(acceleration, duration, end=1.5)
    slip, _ = expected_slip(motion, friction * WEIGHT + cohesion)
    simulation = af.dynamics.RigidBlockSimulation(structure, dt=5e-4)
    start = af.dynamics.LooseBlocks.as_built(structure)
    frame = simulation.final_frame(start, 3.0, motion)
    # the step in which it stops errs by a dt² / 8, and each bend of the push by as much
    assert frame.resting
    assert frame.poses[-1, 0] == pytest.approx(slip, abs=1e-4)
    assert np.abs(frame.poses[-1, 1:]).max() < 1e-6
    assert frame.energy.gained_share < 1e-6


def test_a_loose_block_on_its_corner_has_no_cohesion():
    """Tilted, and without friction: nothing holds its corner, and its centroid falls straight."""
    structure = bases_and_block((-2.0, 4.0), friction=0.0, cohesion=1e5)
    start, turn = af.dynamics.LooseBlocks.as_built(structure), 0.05
    c, s = np.cos(turn), np.sin(turn)
    start.poses[1] = 0.0, 0.5 * s + 0.2 * (c - 1.0), turn
    simulation = af.dynamics.RigidBlockSimulation(structure, dt=5e-4)
    frame = simulation.final_frame(start, 0.05)
    assert frame.poses[1, 2] < turn - 0.01
    assert abs(frame.poses[1, 0]) < 1e-9


def test_a_block_passes_from_one_base_to_the_next():
    """It leaves the first after 0.5 m; the cohesion of both is that of its face throughout."""
    model, motion = block_on((-1.0, 0.5), (0.5, 3.0), friction=0.1, cohesion=1e3), push(-6.0, 0.5)
    run = af.time_history(model, motion, dt=5e-4)
    slip, error = expected_slip(motion, 1800.0)
    assert slip > 0.7
    assert run.joints["slip"].values[-1] == pytest.approx(slip, abs=error)
    assert shear_while_sliding(run).sum(axis=1) == pytest.approx(1800.0, rel=2e-3)
    assert run.joints["N"].values[-1] == pytest.approx([0.0, WEIGHT], abs=1e-3 * WEIGHT)
    assert np.isnan(run.joints["eccentricity"].values[-1, 0])
    assert run.fall is None or run.fall.kind == "dislocated"
    # what bonds each joint, by its own length
    bonds = run.joints["cohesion_limit"].values
    lost = np.clip(run.joints["slip"].values[:, 0], 0.0, 0.5)
    assert bonds == pytest.approx(1e3 * np.stack([0.5 - lost, 0.5 + lost], axis=1), abs=0.1)


@pytest.mark.parametrize(("duration", "outcome"), [(0.305, "dislocated"), (0.365, "fallen")])
def test_a_block_tips_once_its_centre_has_passed_the_edge(duration, outcome):
    """The base ends 0.2 m beyond it: from 0.7 m on, less 0.04 m while it brakes, it tips."""
    motion = push(-6.0, duration, end=1.2)
    slip, error = expected_slip(motion, 0.2 * WEIGHT)
    assert (slip > 0.7) == (outcome == "fallen")
    run = af.time_history(block_on((-2.0, 1.2)), motion, dt=5e-4)
    assert run.verdict.outcome == outcome
    if outcome == "dislocated":
        assert 0.5 < slip < 0.66
        assert run.joints["slip"].values[-1, 0] == pytest.approx(slip, abs=5.0 * error)


def test_a_block_thrown_over_the_end_conserves_its_energy():
    """Without friction or damping, until a third of its face is left on the base."""
    model, motion = block_on((-2.0, 1.1), friction=0.0), af.Motion(np.zeros(2), 0.5)
    equation, dead = af.dynamics.Equation(model, motion), af.dead_load(model)
    rest = equation.at_rest(dead.q, memory=dead.model.memory)
    start = equation.accelerated(replace(rest, velocity=np.array([1.0, 0.0, 0.0])))
    (*_, last) = stepper_for("auto", equation).batches(start, 1e-3, motion.duration)
    state = last.state(len(last.times) - 1)
    energies = []
    for each in (start, state):
        kinetic = 0.5 * each.velocity @ (model.mass @ each.velocity)
        stored = model.with_memory(each.memory).energy(each.q)
        energies.append(kinetic + stored + WEIGHT * each.q[1])
    assert state.q[0] == pytest.approx(0.5, abs=1e-3)
    assert energies[1] == pytest.approx(energies[0], rel=1e-8)


def test_a_mirrored_block_slides_as_far_to_the_other_side():
    motion = push(-9.0, 0.3)
    right = af.time_history(block_on((-2.0, 1.3), cohesion=2e3), motion, dt=1e-3)
    mirrored = block_on((-1.3, 2.0), cohesion=2e3, stone=(-1.0, 0.0))
    left = af.time_history(mirrored, push(9.0, 0.3), dt=1e-3)
    assert right.joints["slip"].values[-1, 0] > 0.35
    for name, sign in {"N": 1.0, "V": -1.0, "M": -1.0, "slip": -1.0}.items():
        one, other = (run.joints[name].values for run in (right, left))
        # rounding of the places, times the stiffness
        assert sign * other == pytest.approx(one, abs=1e-7 * max(1.0, np.abs(one).max()))


@pytest.mark.parametrize("slip", [-1.1, -0.5, -0.1, 0.0, 0.2, 0.45, 1.0])
@pytest.mark.parametrize(
    ("base", "stone"),
    [
        ((-2.0, 4.0), (0.0, 1.0)),  # the lower face is longer, at both ends
        ((0.3, 0.7), (0.0, 1.0)),  # the higher one is
        ((-0.4, 0.6), (0.0, 1.0)),  # each extends at one end
        ((0.3, 3.0), (0.0, 1.0)),
        ((0.0, 1.0), (0.0, 1.0)),
    ],
)
def test_resultants_are_those_of_the_common_part_of_both_faces(base, stone, slip):
    """Pressed in by 1 µm at its middle and turned by ∓1 µrad: a linear traction, or a wedge.

    Its turn is so small that places along the base are those as built, to 1e-6.
    """
    model = block_on(base, stone=stone, cohesion=2e3)
    low, high = max(base[0], stone[0] + slip), min(base[1], stone[1] + slip)
    for turn in (1e-6, -5e-6):
        # the block turns about its centroid, 0.2 m above its face
        q = np.array([slip - 0.2 * turn, -1e-6, turn])
        normal, _, moment = model.resultants(q)[0]
        x = np.linspace(low, max(low, high), 20_001)
        weights = np.full(len(x), max(high - low, 0.0) / 20_000)
        weights[[0, -1]] *= 0.5
        pressure = STIFFNESS * np.maximum(1e-6 - turn * (x - 0.5 - slip), 0.0) * weights
        middle = 0.5 * (low + high)
        # ends of the overlap are rounded within 1e-5 of the depth
        rounded = 1e-5 * STIFFNESS * (1e-6 + abs(turn) * 1.6)
        assert normal == pytest.approx(pressure.sum(), rel=1e-5, abs=rounded)
        # traction beside the middle, toward the extrados, has a positive moment
        assert moment == pytest.approx((pressure * (x - middle)).sum(), rel=1e-4, abs=rounded)
        if high > low:
            ends = model.structure.ends[0] + model.observer().joint_ends(q)[0]
            assert ends[:, 0] == pytest.approx([low, high], abs=1e-5)
            # A further slip of 0.2 mm, against shear springs that reach the limit within 1 µm. The
            # overlap changes by at most 1e-3 of itself.
            closed = weights[pressure > 0.0].sum()
            away = model.with_memory(model.updated_memory(q))
            after = away.step_forces(q, q + np.array([2e-4, 0.0, 0.0]), 0.0).resultants[0]
            assert after[1] == pytest.approx(0.2 * normal + 2e3 * closed, rel=1e-2)
