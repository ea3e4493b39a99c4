"""Restitution of a rocking block, against its equations of motion integrated by SciPy."""

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import archfem as af
from archfem.dynamics import Equation, restitution, restitution_damping
from archfem.dynamics.damping import _restitution_from_energies, _RockingBlock
from archfem.dynamics.solvers.selection import stepper_for

BREADTH, HEIGHT, WEIGHT = 0.6, 2.4, 19620.0

STONE = af.Material(30e9, 0.2, WEIGHT)

TABLE = {0.05: 0.989, 0.1: 0.985, 0.2: 0.977, 0.5: 0.961, 1.0: 0.940, 1.5: 0.924, 3.0: 0.881}
"""r for damping of the bounce on the whole base, of critical, at k_n = 1 MPa/mm: computed apart
from this package by an energy-momentum scheme with finite rotations."""


def contact(normal=1e9, friction=0.6):
    return af.Contact(normal, 0.4 * normal, friction)


def of_bounce(ratio, normal=1e9):
    """Damping with a given ratio of the bounce on the whole base, at its frequency."""
    mass = WEIGHT / 9.81 * HEIGHT
    omega = np.sqrt(normal / mass)
    return af.StiffnessDamping(0.3 * ratio, 0.3 * omega / (2.0 * np.pi))


def pressed(left, right):
    """∫ <y>₋ ds and ∫ s <y>₋ ds over the base, y straight from the left end to the right one."""
    slope, half = (right - left) / BREADTH, BREADTH / 2.0
    low, high = -half, half
    if left >= 0.0 and right >= 0.0:
        return 0.0, 0.0
    if left * right < 0.0:
        zero = -half - left / slope
        low, high = (low, zero) if left < 0.0 else (zero, high)
    middle, size = 0.5 * (low + high), high - low
    value = 0.5 * (left + right) + slope * middle
    return value * size, value * middle * size + slope * size**3 / 12.0


def stored(left, right):
    """½ ∫ <y>₋² ds over the base."""
    if left >= 0.0 and right >= 0.0:
        return 0.0
    size = BREADTH
    if left * right < 0.0:
        size *= abs(min(left, right)) / abs(right - left)
        left, right = min(left, right), 0.0
    return size * (left**2 + left * right + right**2) / 6.0


@cache
def integrated(lag, normal=1e9, impacts=2):
    """r of the block let go from half of α: three coordinates, dashpots where springs press."""
    mass = WEIGHT / 9.81 * BREADTH * HEIGHT
    inertia = mass * (BREADTH**2 + HEIGHT**2) / 12.0
    shear = 0.4 * normal * BREADTH
    ends = np.array([-BREADTH / 2.0, BREADTH / 2.0])

    def rates(_, state):
        q, v = state[:3], state[3:]
        late = q + lag * v
        force, moment = pressed(*(late[1] + late[2] * ends))
        along = shear * (late[0] + late[2] * HEIGHT / 2.0)
        turning = (-normal * moment - along * HEIGHT / 2.0) / inertia
        return np.array([*v, -along / mass, -normal * force / mass - 9.81, turning])

    def turning(_, state):
        return state[5]

    tilt = 0.5 * np.arctan(BREADTH / HEIGHT)
    strip = np.sqrt(2.0 * mass * 9.81 / (normal * tilt))
    start = [tilt * HEIGHT / 2.0, tilt * (BREADTH / 2.0 - strip), -tilt, 0.0, 0.0, 0.0]
    run = solve_ivp(
        rates, (0.0, 1.9), start, "LSODA", max_step=5e-3, rtol=1e-6, atol=1e-9, events=turning
    )

    def energy(state):
        q, v = state[:3], state[3:]
        slip = q[0] + q[2] * HEIGHT / 2.0
        kinetic = 0.5 * mass * (v[0] ** 2 + v[1] ** 2) + 0.5 * inertia * v[2] ** 2
        joint = normal * stored(*(q[1] + q[2] * ends)) + 0.5 * shear * slip**2
        return kinetic + joint + mass * 9.81 * q[1]

    rest = -0.5 * (mass * 9.81) ** 2 / (normal * BREADTH)
    turns = [np.array(start)]
    for state in run.y_events[0]:
        if state[2] * turns[-1][2] < 0.0:
            turns.append(state)
        elif abs(state[2]) > abs(turns[-1][2]):
            turns[-1] = state
    first, last = (energy(turns[k]) - rest for k in (0, impacts))
    return np.sqrt(last / first) ** (1.0 / impacts)


@pytest.mark.slow
@pytest.mark.parametrize("wanted", [0.97, 0.95, 0.92])
def test_found_damping_gives_the_wanted_restitution(wanted):
    """Within 1e-3, by the block's own equations, and by a run of the package on a finer scale."""
    given = {"contact": contact(friction=None), "material": STONE}
    damping = restitution_damping(wanted, BREADTH, HEIGHT, **given)
    assert damping.mass == 0.0
    assert restitution(damping, BREADTH, HEIGHT, **given) == pytest.approx(wanted, abs=1e-4)
    assert integrated(damping.stiffness) == pytest.approx(wanted, abs=1e-3)


@pytest.mark.parametrize(
    ("ratio", "known"),
    [
        pytest.param(*each, marks=() if each[0] in (0.05, 0.5, 3.0) else pytest.mark.slow)
        for each in TABLE.items()
    ],
)
def test_restitution_falls_with_damping(ratio, known):
    """To 2e-3: rotations are small here and finite there."""
    found = restitution(of_bounce(ratio), BREADTH, HEIGHT, contact=contact(), material=STONE)
    assert found == pytest.approx(known, abs=2e-3)


def in_large_motion(damping, impacts=2, dt=1e-3):
    """r of the block that turns as far as it likes, let go from half of α."""
    structure = af.column(breadth=BREADTH, heights=[HEIGHT], contact=contact(), material=STONE)
    model = af.build(structure, fidelity="rigid", displacements="large")
    dead = af.dead_load(model)
    tilt, base = 0.5 * np.arctan(BREADTH / HEIGHT), structure.joints[0].contact.normal_stiffness
    strip = np.sqrt(2.0 * WEIGHT * BREADTH * HEIGHT / (base * tilt))
    arm = np.array([strip - BREADTH / 2.0, HEIGHT / 2.0])  # from the edge that bears
    turn = np.array([[np.cos(tilt), np.sin(tilt)], [-np.sin(tilt), np.cos(tilt)]])
    equation = Equation(model, af.Motion(np.zeros(2), 4.0), damping)
    start = equation.at_rest(np.append(turn @ arm - arm, -tilt), memory=dead.model.memory)
    rest = equation.energy(equation.at_rest(dead.q, memory=dead.model.memory))[:2].sum()
    turns = [(tilt, equation.energy(start)[:2].sum() - rest)]
    for batch in stepper_for("newton", equation).batches(start, dt, 4.0):
        for k, energy in enumerate(batch.energy[:, :2].sum(axis=1) - rest):
            angle = -batch.state(k).q[2]
            if angle * turns[-1][0] < 0.0:
                turns.append((angle, energy))
            elif abs(angle) > abs(turns[-1][0]):
                turns[-1] = angle, energy
    return (turns[impacts][1] / turns[0][1]) ** (0.5 / impacts)


@pytest.mark.parametrize("ratio", [0.1, pytest.param(0.5, marks=pytest.mark.slow), 1.5])
def test_blocks_that_move_far_lose_as_much(ratio):
    """Damping that is found by small displacements therefore serves large ones.

    Ratios agree to 5e-3. Beyond critical damping a part is lost between impacts, whose time is
    longer the less of its moment a tilted block keeps.
    """
    assert in_large_motion(of_bounce(ratio)) == pytest.approx(TABLE[ratio], abs=5e-3)


def test_friction_that_holds_does_not_matter():
    given = {"breadth": BREADTH, "height": HEIGHT, "material": STONE}
    found = [
        restitution(of_bounce(0.5), contact=contact(friction=each), **given) for each in (0.6, None)
    ]
    assert found[0] == pytest.approx(found[1], abs=1e-3)


def test_housner_is_the_default_where_it_can_be_reached():
    """At 1 - 3/2 sin² α = 0.9118; the damping is 1.9 times critical of the bounce."""
    given = {"contact": contact(), "material": STONE}
    damping = restitution_damping(None, BREADTH, HEIGHT, **given)
    wanted = 1.0 - 1.5 * np.sin(np.arctan(BREADTH / HEIGHT)) ** 2
    assert restitution(damping, BREADTH, HEIGHT, **given) == pytest.approx(wanted, abs=1e-4)
    assert wanted == pytest.approx(0.9118, abs=1e-4)


def test_the_usual_damping_lets_a_block_rock():
    """Less is lost than at rigid impacts; Rayleigh damping loses most of the energy each swing."""
    shape = af.column(breadth=BREADTH, heights=[HEIGHT], contact=contact(), material=STONE)
    model = af.build(shape, fidelity="rigid", quadrature="exact")
    free, dragged = (
        restitution(
            af.dynamics.effective_damping(model, kind=kind),
            BREADTH,
            HEIGHT,
            contact=contact(),
            material=STONE,
        )
        for kind in ("stiffness", "rayleigh")
    )
    assert 0.9118 < free == pytest.approx(0.965, abs=2e-3)
    assert dragged < 0.5


@pytest.mark.parametrize("wanted", [0.5, 0.999, 1.2])
def test_an_unreachable_restitution_is_refused_with_the_reachable_range(wanted):
    with pytest.raises(af.InvalidInput, match=r"out of reach.* from 0\.88\d to 0\.99\d: give"):
        restitution_damping(wanted, BREADTH, HEIGHT, contact=contact(), material=STONE)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"height": 0.4}, "0.6 m broad and 0.4 m high does not rock"),
        ({"breadth": -1.0}, "-1.0 m broad"),
        ({"breadth": "wide"}, "is not a finite number"),
        ({"contact": contact(friction=0.1)}, r"slides before it turns .* is 0\.1: it needs 0\.18"),
        ({"contact": 1e9}, "contact is a float"),
        ({"material": 2e4}, "material is a float"),
    ],
)
def test_invalid_blocks_are_refused(change, words):
    given = {"breadth": BREADTH, "height": HEIGHT, "contact": contact(), "material": STONE}
    with pytest.raises(af.InvalidInput, match=words):
        restitution_damping(0.95, **{**given, **change})


def test_a_block_on_its_joint_by_closed_forms():
    """Bounce, turning on the closed base, Housner's r, and the start on an edge that bears it."""
    block = _RockingBlock(BREADTH, HEIGHT, contact(), STONE)
    bounce = np.sqrt(1e9 / (WEIGHT / 9.81 * HEIGHT))
    assert block.bounce == pytest.approx(bounce)
    inertia = (BREADTH**2 + HEIGHT**2) / 3.0 * BREADTH * HEIGHT * WEIGHT / 9.81
    turning = np.sqrt(1e9 * BREADTH**3 / 12.0 / inertia)
    assert block.rocking == pytest.approx(turning / (2.0 * np.pi))
    assert block.housner == pytest.approx(1.0 - 1.5 * np.sin(np.arctan(BREADTH / HEIGHT)) ** 2)
    assert block.tilt == pytest.approx(0.5 * np.arctan(0.25))
    lag = 2.0 * 0.3 / bounce
    assert block.damping(0.3).stiffness == pytest.approx(lag)
    weight = WEIGHT * BREADTH * HEIGHT
    x, y, turn = block.tilt_coordinates(weight)
    ends = y + turn * np.array([-BREADTH / 2.0, BREADTH / 2.0])
    assert x == pytest.approx(-turn * HEIGHT / 2.0)  # no slip at the base
    assert turn == pytest.approx(-block.tilt)
    assert pressed(*ends)[0] == pytest.approx(-weight / 1e9)


@pytest.mark.parametrize(
    ("given", "rocks"),
    [
        ({"height": 1.19 * BREADTH}, False),
        ({"height": 1.21 * BREADTH}, True),
        ({"contact": contact(friction=0.175)}, False),
        ({"contact": contact(friction=0.178)}, True),
    ],
)
def test_which_blocks_rock(given, rocks):
    """1.2 times as high as broad; pushed by μ: 3/4 sin α cos α slides first (Housner's pivot)."""
    whole = {"breadth": BREADTH, "height": HEIGHT, "contact": contact(), "material": STONE} | given
    assert 0.175 < 0.75 * BREADTH * HEIGHT / (BREADTH**2 + HEIGHT**2) < 0.178
    if rocks:
        assert _RockingBlock(**whole).height == whole["height"]
    else:
        with pytest.raises(af.InvalidInput, match=r"does not rock|slides before"):
            _RockingBlock(**whole)


def test_restitution_follows_from_energy_at_the_largest_tilts():
    """Energies 1, 0.9 and 0.64 at the turning points: the fourth root of 0.64 an impact."""
    angle = np.array([0.2, 0.3, 0.1, -0.1, -0.25, -0.1, 0.1, 0.2, 0.15])
    energy = np.array([7.0, 1.0, 7.0, 7.0, 0.9, 7.0, 7.0, 0.64, 7.0])
    assert _restitution_from_energies(angle, energy) == pytest.approx(0.64**0.25)
    assert _restitution_from_energies(angle[:6], energy[:6]) == 0.0  # it came to rest before


@pytest.mark.parametrize("size", [0.1, 10.0])
def test_a_block_is_followed_for_two_impacts_and_a_half(size, monkeypatch):
    """From tilt to level it takes √(2 θ I / M) under the moment M of its weight about the edge."""
    calls = []

    class Stepper:
        @staticmethod
        def batches(start, dt, end):
            calls.append((dt, end))
            return []

    monkeypatch.setattr("archfem.dynamics.damping.stepper_for", lambda *_: Stepper)
    block = _RockingBlock(size * BREADTH, size * HEIGHT, contact(), STONE)
    assert block.measure_restitution(None) == 0.0  # no impact happens here
    mass = WEIGHT / 9.81 * size**2 * BREADTH * HEIGHT
    inertia = mass * size**2 * (BREADTH**2 + HEIGHT**2) / 3.0
    swing = np.sqrt(2.0 * block.tilt * inertia / (mass * 9.81 * size * BREADTH / 2.0))
    fine = 2.0 * np.pi / np.sqrt(1e9 / (WEIGHT / 9.81 * size * HEIGHT)) / 20.0
    assert calls == [(pytest.approx(min(1e-3, fine)), pytest.approx(4.5 * swing))]
