"""Impact and friction of single blocks, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from loose_blocks import KEPT, PULSE, TILT, G, floor, rocking_block, tilted, toppling_time
from repeats import each_once

import archfem as af
from archfem.dynamics import LooseBlocks, RigidBlockSimulation

INCLINE = np.radians(20.0)


def inclined(duration):
    """A ground whose acceleration turns gravity by the angle of the incline."""
    count = round(duration / 0.01) + 1
    level = np.full(count, -G * np.sin(INCLINE))
    return af.Motion(level, 0.01, np.full(count, G * (np.cos(INCLINE) - 1.0)))


def test_a_block_slides_down_an_incline(verified):
    """½ (sin α - μ cos α) g t²; the first step ends at its end's speed, ½ Δt late."""
    structure = floor((-0.3, 0.0, 0.3, 0.3), friction=0.3)
    end = RigidBlockSimulation(structure, dt=1e-3).final_frame(
        LooseBlocks.as_built(structure), 1.0, inclined(1.0)
    )
    slid = 0.5 * G * (np.sin(INCLINE) - 0.3 * np.cos(INCLINE))
    assert end.poses[1, 0] == pytest.approx(slid, rel=1e-6)
    assert end.energy.lost == pytest.approx(
        0.3 * np.cos(INCLINE) * structure.weight * slid, rel=1e-5
    )
    verified("block sliding down an incline for 1 s [m]", slid, "closed form", end.poses[1, 0])


def test_a_block_sticks_to_an_incline():
    structure = floor((-0.3, 0.0, 0.3, 0.3), friction=0.5)
    end = RigidBlockSimulation(structure, dt=1e-3).final_frame(
        LooseBlocks.as_built(structure), 10.0, inclined(10.0)
    )
    assert np.abs(end.poses).max() < 1e-9
    assert end.time == pytest.approx(10.0)


@pytest.mark.parametrize(("restitution", "height"), [(0.5, 0.25), (0.9, 0.81)])
def test_a_block_that_lands_flat_rebounds(restitution, height):
    """e² of the height it fell from, late by up to a step's way at impact: 1 ms of 4.4 m/s."""
    structure = floor((-0.5, 0.0, 0.5, 1.0))
    start = LooseBlocks.as_built(structure)
    start.poses[1, 1] = 1.0
    falling = RigidBlockSimulation(structure, dt=1e-3, restitution=restitution)
    frames = list(falling.frames(start, 0.45 + 2.0 * restitution * 0.45, spacing=1e-3))
    after = [frame.poses[1, 1] for frame in frames if frame.time > 0.46]
    assert max(after) == pytest.approx(height, abs=4.5e-3)
    assert np.abs([frame.poses[1, 2] for frame in frames]).max() < 1e-4  # sweeps end at 1e-5


@pytest.mark.parametrize(
    ("restitution", "speed"), each_once((0.0, 0.3), (1.0, 2.0, 3.0, 4.0, 5.0, 6.0))
)
def test_a_fast_block_does_not_sink_into_its_bed(speed, restitution):
    """Steps begin up to 3 mm above the bed; 0.05 mm counts as closed, 0.1 mm as beside rebounds."""
    structure = floor((-0.3, 0.0, 0.3, 0.3))
    start, energy = LooseBlocks.as_built(structure), 0.5 * structure.weight / G * speed**2
    start.poses[1, 1], start.velocities[1, 1] = 7e-3, -speed
    falling = RigidBlockSimulation(structure, dt=5e-4, restitution=restitution)
    bounces = 2.0 * restitution * speed / (G * (1.0 - restitution))  # a geometric series
    frames = list(falling.frames(start, 0.05 + bounces, spacing=5e-4))
    heights = np.array([frame.poses[1, 1] for frame in frames])
    assert heights.min() >= -1e-4
    assert abs(heights[-1]) <= 1e-4
    energies = np.array([frame.energy.kinetic + frame.energy.potential for frame in frames])
    assert np.diff(energies).max() <= 1e-12 * energy
    assert frames[-1].energy.lost == pytest.approx(energy + 7e-3 * structure.weight, rel=2e-3)


@pytest.mark.parametrize(("height", "rebounds"), [(2e-3, False), (4e-4, True)])
def test_a_foreseen_impact_rebounds_where_it_would_be_in_the_step(height, rebounds):
    """At 3 m/s a step of 0.5 ms crosses 1.5 mm: the impact has its whole speed, in that step."""
    structure = floor((-0.3, 0.0, 0.3, 0.3))
    start = LooseBlocks.as_built(structure)
    start.poses[1, 1], start.velocities[1, 1] = height, -3.0
    falling = RigidBlockSimulation(structure, dt=5e-4, restitution=0.3)
    end = falling.final_frame(start, 5e-4)
    speed = 0.9 if rebounds else -3.0 - G * 5e-4
    assert end.velocities[1, 1] == pytest.approx(speed, rel=1e-4)


def test_a_block_topples(verified):
    """From rest at 0.02 rad beyond balance to 1 rad: 1.15800 s, by quadrature."""
    structure = floor((-0.1, 0.0, 0.1, 1.0))
    exact = toppling_time(0.2, 1.0, 0.02, 1.0)
    assert exact == pytest.approx(1.15800, abs=1e-5)
    turns = {}
    for dt in (2e-3, 1e-3):
        start = tilted(structure, np.arctan(0.2) + 0.02)
        found = RigidBlockSimulation(structure, dt=dt).frames(start, 1.3, spacing=dt)
        times, angles = np.array([(frame.time, -frame.poses[1, 2]) for frame in found]).T
        turns[dt] = np.interp(1.0, angles[angles < 1.2], times[angles < 1.2])
    assert turns[1e-3] == pytest.approx(exact, rel=2e-6)
    verified("block toppling to 1 rad [s]", exact, "quadrature", turns[1e-3])
    assert turns[2e-3] - exact == pytest.approx(4.0 * (turns[1e-3] - exact), rel=0.1)


@pytest.mark.parametrize("restitution", [0.0, pytest.param(0.3, marks=pytest.mark.slow)])
def test_a_rocking_block_loses_the_energy_of_housner(restitution, verified):
    structure = rocking_block()
    start = tilted(structure, 0.5 * TILT)
    falling = RigidBlockSimulation(structure, dt=2e-4, restitution=restitution)
    frames = falling.frames(start, 3.2, spacing=1e-3)
    turn, speed = np.array([(frame.poses[1, 2], frame.velocities[1, 2]) for frame in frames]).T
    tops = np.flatnonzero(speed[1:] * speed[:-1] < 0.0)
    peaks = np.abs([0.5 * TILT, *turn[tops]])
    peaks = peaks[peaks > 0.1 * TILT][:5]
    rates = PULSE * np.sqrt(2.0 * (np.cos(TILT - peaks) - np.cos(TILT)))
    assert len(rates) == 5
    assert rates[1:] / rates[:-1] == pytest.approx(KEPT, abs=0.002)
    case = f"rocking block, restitution {restitution:g}: speed kept by four impacts"
    verified(case, KEPT, "Housner (1963)", rates[1:] / rates[:-1])


def test_a_heavy_block_pushes_a_light_one_by_momentum():
    """Two boxes on a floor without friction meet at 2 m/s: (1 + e) m₁ / (m₁ + m₂) of it."""
    structure = floor((0.0, 0.0, 1.0, 1.0), (1.5, 0.0, 2.0, 1.0), friction=0.0)
    start = LooseBlocks.as_built(structure)
    start.velocities[1, 0] = 2.0
    falling = RigidBlockSimulation(structure, restitution=0.5)
    end = falling.final_frame(start, 0.4)
    assert end.velocities[1:, 0] == pytest.approx([1.0, 2.0], rel=1e-6)
    lost = 0.5 * 0.75 * (20e3 / G) / 3.0 * 2.0**2  # ½ (1 - e²) of the reduced mass
    assert end.energy.lost == pytest.approx(lost, rel=1e-4)


def test_gravity_is_that_of_the_structure():
    structure = replace(floor((-0.5, 0.0, 0.5, 1.0)), gravity=1.62)
    start = LooseBlocks.as_built(structure)
    start.poses[1, 1] = 1.0
    end = RigidBlockSimulation(structure).final_frame(start, 0.5)
    assert end.poses[1, 1] == pytest.approx(1.0 - 0.5 * 1.62 * 0.25, rel=1e-12)


@pytest.mark.parametrize(
    ("ratio", "restitution", "last"),
    [
        pytest.param(0.936, 0.0, 7, marks=pytest.mark.slow),
        pytest.param(0.97, 0.5, 7, marks=pytest.mark.slow),
        *((0.85, 0.0, 4), (0.611, 0.0, 3)),
    ],
)
def test_a_rocking_block_keeps_the_ratio_given(ratio, restitution, last, verified):
    """Granite of 0.25 x 1.0 m: each of four impacts within 0.5 %, and the last at its time.

    Housner's ratio is 0.912: some keep more, others less, down to 0.67 of it as on rubber. The
    times between impacts are those of Housner's block, linear in the tilt, to 1 %.
    """
    structure = floor((-0.125, 0.0, 0.125, 1.0), friction=5.0, floor=(-4.0, 4.0))
    tilt, rate = np.arctan(0.25), np.sqrt(1.5 * G / np.hypot(0.25, 1.0))
    share, exact = 0.5, np.arccosh(2.0) / rate
    for _ in range(last - 1):
        share = 1.0 - np.sqrt(1.0 - ratio**2 * (1.0 - (1.0 - share) ** 2))
        exact += 2.0 * np.arccosh(1.0 / (1.0 - share)) / rate
    joint = {"joint 1": ratio}
    falling = RigidBlockSimulation(structure, restitution=restitution, rocking_ratio=joint)
    frames = list(falling.frames(tilted(structure, 0.5 * tilt), 1.05 * exact, spacing=2e-3))
    turn, speed = np.array([(frame.poses[1, 2], frame.velocities[1, 2]) for frame in frames]).T
    impacts = np.flatnonzero(turn[1:] * turn[:-1] < 0.0)
    assert frames[impacts[last - 1]].time == pytest.approx(exact, rel=0.01)
    tops = np.flatnonzero(speed[1:] * speed[:-1] < 0.0)
    peaks = np.abs([0.5 * tilt, *turn[tops]])
    peaks = peaks[peaks > 0.04 * tilt][:5]
    kept = np.sqrt(
        (np.cos(tilt - peaks[1:]) - np.cos(tilt)) / (np.cos(tilt - peaks[:-1]) - np.cos(tilt))
    )
    assert kept == pytest.approx(ratio, rel=0.005)
    assert frames[-1].energy.gained < 1e-4 * frames[-1].energy.lost
    case = f"rocking block with a ratio of {ratio:g}: time of its impact {last} [s]"
    verified(case, exact, "Housner (1963)", frames[impacts[last - 1]].time)


def test_rebounds_that_would_add_energy_are_reduced():
    """Blocks that tumble together with nine tenths of their speed lose energy, and never gain."""
    boxes = [(0.35 * k, 0.0, 0.35 * k + 0.3, 1.0) for k in range(5)]
    structure = floor(*boxes, friction=0.8)
    start = LooseBlocks.as_built(structure)
    start.velocities[1:] = np.random.default_rng(4).normal(size=(5, 3)) * [2.0, 1.0, 4.0]
    falling = RigidBlockSimulation(structure, dt=1e-3, restitution=0.9, rocking_ratio=0.97)
    end = falling.final_frame(start, 1.0)
    assert end.energy.gained < 1e-4 * end.energy.lost


def test_invalid_ratios_are_refused():
    structure = floor((0.0, 0.0, 0.5, 2.0))
    for ratio in (0.0, 1.1, {"joint 1": -0.5}, {"joint 7": 0.9}):
        with pytest.raises(af.errors.InvalidInput, match="rocking_ratio"):
            RigidBlockSimulation(structure, rocking_ratio=ratio)


def stack(*boxes):
    """Boxes (left, bottom, right, top), each on the one before, on a fixed floor."""
    structure = floor(boxes[0], friction=10.0)
    blocks, joints = list(structure.blocks), list(structure.joints)
    for k, (left, low, right, high) in enumerate(boxes[1:], 2):
        outline = ((left, low), (right, low), (right, high), (left, high))
        blocks.append(replace(blocks[1], outline=outline, name=f"block {k}"))
        ends = {"intrados": (left, low), "extrados": (right, low)}
        joints.append(replace(joints[0], blocks=(k - 1, k), name=f"joint {k}", **ends))
    return replace(structure, blocks=tuple(blocks), joints=tuple(joints))


def turning_about(structure, corner, rates):
    """Blocks as built that turn about a point, each at its rate [rad/s]."""
    start = LooseBlocks.as_built(structure)
    for block, rate in rates.items():
        x, y = structure.blocks[block].centroid - corner
        start.velocities[block] = -rate * y, rate * x, rate
    return start


def after_impact(structure, ratio, start):
    """Angular velocities one step of 10 µs later, in which weight adds 1e-4 rad/s."""
    falling = RigidBlockSimulation(structure, dt=1e-5, rocking_ratio=ratio)
    end = falling.final_frame(start, 1e-5)
    assert end.energy.gained == 0.0
    return end.velocities[1:, 2]


@pytest.mark.parametrize("ratio", [0.68, 0.6, 0.4, 0.2])
def test_two_blocks_that_rock_as_one_keep_the_ratio_of_their_base(ratio, verified):
    """The upper block, 1 x 1 m as the lower, turns with it, or on one end if the impulse requires.

    Momentum: the impulse on the upper block passes through their joint; where it would pass
    outside, that end is a hinge, about which the upper block conserves its angular momentum.
    Housner's ratio of both as one is 0.7.
    """
    lower, mass, inertia = ratio * 1.0, 1.0, 1.0 / 6.0
    # before, both turn by 1 rad/s about (1, 0); after, the lower block about (0, 0)
    before, together = np.array([-1.5, -0.5]), lower * np.array([-1.5, 0.5])
    impulse = mass * (together - before)
    place = 0.5 + (inertia * (lower - 1.0) - 0.5 * impulse[0]) / impulse[1]
    upper = lower
    if place < 0.0:
        # about the hinge (0, 1): I ω + m (r x v), with the hinge's velocity (-ω, 0) of the lower
        held = inertia * 1.0 + mass * (0.5 * before[1] - 0.5 * before[0])
        upper = (held - 0.5 * mass * lower) / (inertia + 0.5 * mass)
    structure = stack((0.0, 0.0, 1.0, 1.0), (0.0, 1.0, 1.0, 2.0))
    start = turning_about(structure, (1.0, 0.0), {1: 1.0, 2: 1.0})
    found = after_impact(structure, {"joint 1": ratio}, start)
    assert found == pytest.approx([lower, upper], abs=5e-4)
    assert (place < 0.0) == (upper > lower) == (ratio <= 0.4)
    case = f"two stacked blocks, ratio {ratio:g} of the base: rate of the upper block [rad/s]"
    verified(case, upper, "momentum", found[1])


@pytest.mark.parametrize("ratio", [0.8, 0.5, 0.1])
def test_a_block_on_a_standing_block_keeps_its_ratio(ratio):
    """Housner's is 0.85; the lower block rests on the floor and does not move."""
    structure = stack((-6.0, 0.0, 6.4, 0.5), (0.0, 0.5, 0.4, 1.7))
    start = turning_about(structure, (0.4, 0.5), {2: 1.0})
    found = after_impact(structure, {"joint 2": ratio}, start)
    assert found == pytest.approx([0.0, ratio], abs=5e-4)


def test_ratios_below_housners_never_add_energy_to_an_arch_that_falls():
    """Nine stones between supports, thrown to and fro; the ratio takes effect."""
    ring = af.circular_arch(radius=1.0, thickness=0.2, embrace=150.0, voussoirs=9)
    start, ends = LooseBlocks.as_built(ring), []
    start.velocities[list(ring.free)] = np.random.default_rng(2).normal(size=(9, 3)) * [
        2.0,
        1.0,
        4.0,
    ]
    for ratio in (0.95, 0.2):
        end = RigidBlockSimulation(ring, dt=5e-4, rocking_ratio=ratio).final_frame(start, 0.3)
        assert end.energy.gained < 1e-4 * end.energy.lost
        ends.append(end.poses)
    assert np.abs(ends[0] - ends[1]).max() > 1e-3
