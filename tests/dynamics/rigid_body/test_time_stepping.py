"""Rigid blocks from a pose to rest: overturning, dominoes, arches, energy."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
import shapely
from loose_blocks import G, floor, overturns, rocking_block, sine, tilted
from repeats import each_once

import archfem as af
from archfem.dynamics import LooseBlocks, RigidBlockSimulation
from archfem.dynamics.rigid_body import simulation, time_stepping

THRESHOLDS = [(1.0, 0.33033), (3.0, 0.57432), (8.0, 1.20181)]
"""Frequency over p, and the least half sine that overturns the block 0.6 × 2.4 m, over g."""

ISLANDS = [(2.0, 0.30583), (3.0, 0.35008), (3.0, 0.88670), (3.0, 0.91579)]
"""The same of one sine, with Housner's restitution: where it begins or ceases to overturn."""

LEAST = {0.31: 0.19600, 0.45: 0.10672}
"""Friction, and least thickness over radius of a semicircle of 27 voussoirs, by limit analysis."""


def falls(ratio, peak, halves, dt=5e-4):
    """Whether the rocking block falls over under half sines."""
    structure = rocking_block()
    motion = sine(ratio, peak, halves, dt)
    for frame in RigidBlockSimulation(structure, dt=motion.dt).frames(
        LooseBlocks.as_built(structure), 12.0, motion
    ):
        turn, speed = abs(frame.poses[1, 2]), np.abs(frame.velocities[1]).max()
        if turn > 1.0:
            return True
        if frame.time > motion.duration and turn < 1e-3 and speed < 0.02:
            return False
    return False


@pytest.mark.parametrize(
    ("ratio", "least"),
    [*(pytest.param(*each, marks=pytest.mark.slow) for each in THRESHOLDS[:2]), THRESHOLDS[2]],
)
def test_a_half_sine_overturns_above_its_threshold(ratio, least, verified):
    """Within 0.01 %, five digits of the threshold being known to 0.001 %."""
    for factor, wanted in ((0.9999, False), (1.0001, True)):
        assert overturns(ratio, factor * least, 1) is wanted
        assert falls(ratio, factor * least, 1) is wanted
    case = f"block overturned by a half sine, ω/p = {ratio:g}: least peak [g]"
    verified(case, least, "rigid block integrated event by event", "the same", difference=1e-4)


@pytest.mark.parametrize(
    ("ratio", "edge"),
    [
        pytest.param(*island, marks=() if number == 2 else pytest.mark.slow)
        for number, island in enumerate(ISLANDS)
    ],
)
def test_a_sine_overturns_in_islands(ratio, edge):
    """Within 0.1 %, with the impacts of the engine in place of Housner's."""
    above = edge != ISLANDS[2][1]
    for factor, wanted in ((0.999, not above), (1.001, above)):
        assert overturns(ratio, factor * edge, 2) is wanted
        assert falls(ratio, factor * edge, 2) is wanted


@pytest.mark.slow
def test_the_map_of_one_sine_is_that_of_housner():
    for ratio, peaks in ((2.0, np.linspace(0.26, 0.6, 18)), (3.0, np.linspace(0.3, 1.0, 36))):
        for peak in peaks:
            assert falls(ratio, peak, 2) == overturns(ratio, peak, 2), (ratio, peak)


@pytest.mark.slow
def test_dominoes_all_fall_at_one_speed():
    """Each takes as long as the one before; the speed does not depend on the step."""
    boxes = [(0.6 * k, 0.0, 0.6 * k + 0.2, 1.0) for k in range(20)]
    structure = floor(*boxes, friction=0.4)
    speeds = []
    for dt in (2e-3, 1e-3):
        start = tilted(structure, np.arctan(0.2) + 0.02)
        met = np.full(21, np.inf)
        for frame in RigidBlockSimulation(structure, dt=dt).frames(start, 6.0, spacing=dt):
            turned = -frame.poses[:, 2] > 0.01
            met[turned] = np.minimum(met[turned], frame.time)
            if turned[-1]:
                break
        speeds.append(0.6 * 8 / (met[19] - met[11]))
        assert frame.overlap < 0.01
    assert speeds == pytest.approx([3.158, 3.158], rel=3e-3)


@pytest.fixture(scope="module")
def chords():
    return af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17, chords=1)


def pulse(peak, duration):
    return af.Motion(np.full(round(duration / 0.01), peak * G), 0.01)


def test_a_ring_falls_to_the_ground_and_comes_to_rest():
    chords = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=9, chords=1)
    falling = RigidBlockSimulation(chords, dt=1e-3)
    frames = list(falling.frames(LooseBlocks.as_built(chords), 15.0, pulse(0.7, 0.5)))
    last = frames[-1]
    assert last.resting
    assert last.time < 10.0
    levels = [
        block.centroid[1] + pose[1] for block, pose in zip(chords.blocks, last.poses, strict=True)
    ]
    assert max(levels) - falling.bodies.level < 1.0  # no stone lies higher than on another
    assert last.overlap < 0.01
    spent = [frame.energy.work - frame.energy.potential - frame.energy.kinetic for frame in frames]
    exchanged = max(spent)
    assert np.diff(spent).min() > -1e-5 * exchanged
    assert last.energy.gained < 1e-5 * exchanged
    assert last.energy.kinetic < 1e-12 * exchanged


def test_a_ring_at_rest_stays(chords):
    start = LooseBlocks.as_built(chords)
    count = 1001
    breath = af.Motion(1e-9 * np.ones(count), 1e-3)  # keeps the run going
    end = RigidBlockSimulation(chords).final_frame(start, 1.0, breath)
    assert end.time == pytest.approx(1.0)
    assert np.abs(end.poses).max() < 1e-6


@pytest.mark.parametrize("chords", [None, 2])
def test_stones_of_several_pieces_fall_as_far(chords):
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=150.0, voussoirs=5, chords=chords)
    falling = RigidBlockSimulation(ring, dt=1e-3)
    assert len(falling.bodies.owner) > len(ring.blocks)
    end = falling.final_frame(LooseBlocks.as_built(ring), 15.0, pulse(1.2, 0.5))
    assert end.resting
    assert end.poses[3, 1] < -1.5
    assert end.energy.gained < 1e-4 * end.energy.lost


def semicircle_stands(friction, ratio):
    contact = af.Contact(1e9, 1e9, friction)
    arch = af.circular_arch(
        radius=5.0, thickness=5.0 * ratio, embrace=180.0, voussoirs=27, chords=1, contact=contact
    )
    for frame in RigidBlockSimulation(arch, dt=1e-3).frames(LooseBlocks.as_built(arch), 6.0):
        if np.abs(frame.poses[:, :2]).max() > 0.2:
            return False
    return frame.resting


@pytest.mark.parametrize(
    "friction", [pytest.param(each, marks=pytest.mark.slow if each > 0.4 else ()) for each in LEAST]
)
def test_a_semicircle_stands_by_friction_from_its_least_thickness_on(friction):
    least = LEAST[friction]
    assert not semicircle_stands(friction, 0.99 * least)
    assert semicircle_stands(friction, 1.01 * least)


@pytest.mark.slow
@pytest.mark.parametrize(("friction", "least"), LEAST.items())
def test_a_semicircle_stands_by_friction_farther_from_its_least_thickness(friction, least):
    assert not semicircle_stands(friction, 0.97 * least)
    assert semicircle_stands(friction, 1.03 * least)


def test_the_ground_may_be_moved_up_and_down():
    """Weightless on a ground that falls as fast: a thrown block moves in a straight line."""
    structure = floor((0.0, 0.0, 0.5, 0.5))
    start = LooseBlocks.as_built(structure)
    start.velocities[1] = 0.5, 1.0, 2.0
    ground = af.Motion(np.zeros(101), 0.01, np.full(101, -G))
    end = RigidBlockSimulation(structure).final_frame(start, 1.0, ground)
    assert end.poses[1] == pytest.approx([0.5, 1.0, 2.0], rel=1e-9)
    assert end.energy.lost < 1e-9 * end.energy.kinetic


def test_frames_come_at_equal_times_and_at_the_end():
    structure = floor((0.0, 0.0, 0.5, 0.5))
    start = replace(LooseBlocks.as_built(structure), time=2.0)
    start.poses[1, 1] = 5.0
    times = [
        frame.time for frame in RigidBlockSimulation(structure).frames(start, 2.05, spacing=0.02)
    ]
    assert times == pytest.approx([2.0, 2.02, 2.04, 2.05], abs=1e-9)


def test_invalid_numbers_are_refused():
    structure = floor((0.0, 0.0, 0.5, 0.5))
    for settings in ({"dt": 0.1}, {"restitution": 1.5}, {"friction": -1.0}, {"level": 5.0}):
        with pytest.raises(af.errors.InvalidInput):
            RigidBlockSimulation(structure, **settings)
    with pytest.raises(af.errors.InvalidInput, match="structure is a str"):
        RigidBlockSimulation("ring")
    falling, start = RigidBlockSimulation(structure), LooseBlocks.as_built(structure)
    with pytest.raises(af.errors.InvalidInput, match="not after the start"):
        falling.final_frame(start, 0.0)
    with pytest.raises(af.errors.InvalidInput, match="below the step"):
        list(falling.frames(start, 1.0, spacing=1e-5))
    with pytest.raises(af.errors.InvalidInput, match="give finite numbers of shape"):
        falling.final_frame(replace(start, poses=start.poses[:1]), 1.0)


def test_blocks_that_begin_inside_each_other_are_refused():
    structure = floor((0.0, 0.0, 0.5, 0.5))
    start = LooseBlocks.as_built(structure)
    start.poses[1, 1] = -0.2
    with pytest.raises(af.errors.DidNotConverge, match=r"overlap by 0\.2 m"):
        RigidBlockSimulation(structure).final_frame(start, 1.0)


@pytest.mark.parametrize("share", [1.0, 0.25])
def test_strain_energy_lifts_blocks_out_of_compressed_joints(share):
    """A block that is 2 mm in its support, to the admissible overlap or as far as that pays for."""
    structure = floor((0.0, 0.0, 0.8, 0.8))
    weight = structure.weight
    start = LooseBlocks.as_built(structure)
    start.poses[1, 1] = -2e-3
    energy = share * weight * 2e-3
    start = replace(start, strain_energy=energy)
    end = RigidBlockSimulation(structure).final_frame(start, 0.02)
    # the admissible overlap is 0.05 mm
    lift = min(2e-3 - 5e-5, share * 2e-3)
    assert end.poses[1, 1] + 2e-3 == pytest.approx(lift, rel=0.02)
    assert end.energy.potential == pytest.approx(weight * lift, rel=0.02)
    assert end.energy.potential <= energy * (1.0 + 1e-12)
    assert end.energy.gained < 1e-5 * energy


def _outlines(structure, poses):
    """Polygons of all blocks at their poses."""
    shapes = []
    for block, pose in zip(structure.blocks, poses, strict=True):
        c, s = np.cos(pose[2]), np.sin(pose[2])
        arms = (block.points - block.centroid) @ np.array([[c, s], [-s, c]])
        shapes.append(shapely.Polygon(arms + block.centroid + pose[:2]))
    return shapes


@pytest.mark.parametrize(("turn", "speed"), each_once((0.0, 0.01, 0.3), (1.0, 5.0)))
def test_fast_blocks_stop_at_the_floor(speed, turn):
    """Whenever in a step they hit it: 5 m/s are 2.5 mm in a step, and 14 μm are admissible."""
    structure = floor((-0.1, 0.0, 0.1, 0.2))
    simulation = RigidBlockSimulation(structure, dt=5e-4)
    for phase in np.linspace(0.0, 1.0, 6, endpoint=False):
        start = LooseBlocks.as_built(structure)
        start.poses[1] = 0.0, 0.04 + phase * speed * simulation.dt, turn
        start.velocities[1, 1] = -speed
        kinetic = 0.5 * structure.weight / G * speed**2
        for frame in simulation.frames(start, 0.1 / speed + 0.02, spacing=simulation.dt):
            _, block = _outlines(structure, frame.poses)
            assert block.bounds[1] >= -1.05 * simulation.bodies.slop
        assert frame.energy.gained < 1e-5 * kinetic
        # a flat impact leaves no velocity
        assert turn or frame.energy.kinetic < 1e-6 * kinetic


@pytest.mark.parametrize("turn", [0.0, 0.01])
def test_fast_blocks_stop_at_each_other(turn):
    """Two loose blocks at 4 m/s, of which one flies at the other: momentum is kept."""
    structure = floor((0.0, 0.0, 0.2, 0.2), (0.3, 0.0, 0.5, 0.2), friction=0.0)
    simulation = RigidBlockSimulation(structure, dt=5e-4, friction=0.0)
    for phase in np.linspace(0.0, 1.0, 6, endpoint=False):
        start = LooseBlocks.as_built(structure)
        start.poses[1:] = (-phase * 2e-3, 5.0, turn), (0.0, 5.0, 0.0)
        start.velocities[1, 0] = 4.0
        for frame in simulation.frames(start, 0.04, spacing=simulation.dt):
            _, one, two = _outlines(structure, frame.poses)
            # the overlap is at most a wedge along the face
            assert one.intersection(two).area <= 0.2 * 1.05 * simulation.bodies.slop
        assert frame.velocities[1:, 0].sum() == pytest.approx(4.0, rel=1e-9)
        assert frame.velocities[2, 0] > 1.9


def test_energy_from_nowhere_is_refused(monkeypatch, chords):
    """A coarse step gains energy beyond a bound that is set far below the true one."""
    monkeypatch.setattr("archfem.dynamics.rigid_body.simulation.REFUSED_ENERGY_GAIN", 1e-12)
    monkeypatch.setattr("archfem.dynamics.rigid_body.simulation.ENERGY_GAIN_NOISE", 0.0)
    with pytest.raises(af.errors.DidNotConverge, match="J without work, of"):
        RigidBlockSimulation(chords, dt=5e-3).final_frame(
            LooseBlocks.as_built(chords), 15.0, pulse(0.7, 0.5)
        )


@pytest.mark.slow
def test_a_fall_without_a_step_halves_steps_until_that_changes_little():
    """Three drums under a synthetic motion: 9.8 mm by 0.5 ms, 33.5 mm by half, 34.9 mm at last."""
    drums = af.column(breadth=0.6, heights=[0.8, 0.7, 0.9], contact=af.Contact(1e9, 4e8, 0.5))
    motion = af.Motion.synthetic(duration=2.5, pga=3.5, seed=5)
    start, found = LooseBlocks.as_built(drums), {}
    for dt in (None, 5e-4, 6.25e-5):
        frames = list(RigidBlockSimulation(drums, dt=dt).frames(start, 6.0, motion))
        moved = af.dynamics.classify_collapse(drums, frames).displacement
        found[dt] = moved, frames[-1].step_change
    assert found[None][0] == pytest.approx(found[6.25e-5][0], rel=0.05)
    assert found[5e-4][0] < 0.5 * found[6.25e-5][0]
    assert found[None][1] < 0.2
    assert np.isnan(found[5e-4][1])


def test_steps_that_fail_are_halved_and_the_last_error_is_raised(chords, monkeypatch):
    begin, count = LooseBlocks.as_built(chords), []

    def fail(simulation, dt, *_):
        count.append(dt)
        raise af.DidNotConverge("made to fail")

    monkeypatch.setattr(RigidBlockSimulation, "_take_steps", fail)
    with pytest.raises(af.DidNotConverge, match=r"by steps of 0\.5 to 0\.0625 ms: made to fail"):
        RigidBlockSimulation(chords).final_frame(begin, 1.0)
    assert count == [5e-4, 2.5e-4, 1.25e-4, 6.25e-5]


@pytest.mark.parametrize(("end", "count"), [(0.0, 3), (0.3, 3), (0.49, 2), (0.6, 2)])
def test_steps_are_halved_where_a_block_comes_back_by_one_of_them_alone(end, count, monkeypatch):
    """A block of 1 m² sinks by 0.6 m by all steps, and back by the first; a fifth is 0.1 m."""
    structure, taken = floor((0.0, 0.0, 0.5, 2.0)), []
    first = next(RigidBlockSimulation(structure).frames(LooseBlocks.as_built(structure), 1.0))

    def sink(simulation, dt, *_):
        taken.append(dt)
        for depth in (0.0, 0.6, end if len(taken) == 1 else 0.6):
            poses = np.zeros((2, 3))
            poses[1, 1] = -depth
            yield replace(first, poses=poses)

    monkeypatch.setattr(RigidBlockSimulation, "_take_steps", sink)
    last = RigidBlockSimulation(structure).final_frame(LooseBlocks.as_built(structure), 1.0)
    assert (len(taken), last.step_change) == (count, pytest.approx(0.02 * (end == 0.49)))


def test_rest_is_reported_only_once_the_ground_rests(chords):
    ground = af.Motion(1e-9 * np.ones(101), 0.01)
    end = RigidBlockSimulation(chords, dt=1e-3).final_frame(
        LooseBlocks.as_built(chords), 5.0, ground
    )
    assert end.resting
    assert end.time == pytest.approx(1.5, abs=0.05)  # half a second after the motion


def test_a_column_that_swings_slowly_does_not_rest():
    """A tenth of a degree beyond balance a column takes over a second to be seen to move."""
    structure = floor((-0.3, 0.0, 0.3, 2.4), friction=5.0)
    start = tilted(structure, np.arctan(0.25) + 0.002)
    end = RigidBlockSimulation(structure, dt=1e-3).final_frame(start, 10.0)
    assert end.resting
    assert end.poses[1, 2] == pytest.approx(-np.pi / 2.0, abs=1e-3)


@pytest.mark.parametrize(
    ("duration", "least"), [(0.2, 1.070), pytest.param(1.5, 0.3827, marks=pytest.mark.slow)]
)
def test_an_arch_falls_under_a_pulse_as_by_joints_of_springs(duration, least):
    """Oppenheim's arch, against stiff joints and conserved energy: within 1 % of their pulse [g].

    Four links that turn about fixed hinges take 1.129 and 0.387 g: no stone slides, and hinges that
    may move can only lower that.
    """
    arch = af.circular_arch(
        radius=10.0,
        thickness=1.5,
        embrace=157.5,
        voussoirs=7,
        contact=af.Contact(1e9, 1e9, 5.0),
    )
    for factor, wanted in ((0.99, False), (1.01, True)):
        samples = np.full(round(duration / 1e-3) + 1, factor * least * G)
        motion = af.Motion(samples, 1e-3)
        frames = RigidBlockSimulation(arch, dt=1e-3).frames(
            LooseBlocks.as_built(arch), 8.0, motion, spacing=0.1
        )
        assert any(np.abs(frame.poses[:, :2]).max() > 2.0 for frame in frames) is wanted


@pytest.mark.parametrize("seed", range(3))
def test_impulses_that_are_cut_short_add_no_energy(seed, monkeypatch):
    """After five sweeps of the hundreds that they take: else a run gains 1 to 3 % here."""
    monkeypatch.setattr(time_stepping, "MAX_SWEEPS", 5)
    monkeypatch.setattr(simulation, "FIRST_STEP_SWEEPS", 5)
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
    start = LooseBlocks.as_built(ring)
    speeds = 0.3 * np.random.default_rng(seed).normal(size=start.velocities.shape)
    falling = RigidBlockSimulation(ring, dt=5e-4)
    end = falling.final_frame(replace(start, velocities=speeds), 0.1)
    assert end.energy.gained < time_stepping.MAX_ENERGY_GAIN * end.energy.lost


@pytest.mark.slow
def test_a_ring_near_its_mechanism_moves_as_far_at_any_step():
    """The shipped ring under its motion, whose peak has jumped to a seventh at single steps."""
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
    motion = af.Motion.synthetic(seed=3, duration=6.0, pga=6.0)
    peaks = []
    for dt in (1.05e-3, 1e-3, 0.95e-3, 0.5e-3):
        frames = list(
            RigidBlockSimulation(ring, dt=dt).frames(LooseBlocks.as_built(ring), 2.0, motion)
        )
        peaks.append(max(np.hypot(*frame.poses[9, :2]) for frame in frames))
        assert frames[-1].settling.unsettled_share < 0.02
    assert peaks == pytest.approx(np.full(4, 0.0300), rel=0.15)


def test_impulses_that_are_cut_short_are_counted(monkeypatch, chords):
    start = LooseBlocks.as_built(chords)
    falling = RigidBlockSimulation(chords, dt=5e-4)
    settled = falling.final_frame(start, 0.1, pulse(0.7, 0.5)).settling
    assert settled.unsettled_share <= 0.02
    assert settled.sweeps >= settled.steps == 200
    monkeypatch.setattr(time_stepping, "MAX_SWEEPS", 2)
    cut = falling.final_frame(start, 0.1, pulse(0.7, 0.5)).settling
    assert cut.unsettled_share > 0.1
    assert cut.residual > time_stepping.SETTLED


def test_stones_of_a_fall_end_beside_each_other(chords):
    """No corner below the ground, nor two stones in each other, by 0.5 % of a stone."""
    falling = RigidBlockSimulation(chords, dt=1e-3)
    end = falling.final_frame(LooseBlocks.as_built(chords), 15.0, pulse(0.9, 0.5))
    shapes = _outlines(chords, end.poses)
    admissible = 0.005 * np.sqrt(min(chords.blocks[k].area for k in chords.free))
    low = min(shapes[k].bounds[1] for k in chords.free)
    assert low > falling.bodies.level - admissible
    for one, two in combinations(shapes, 2):
        assert one.intersection(two).buffer(-0.5 * admissible).is_empty
    assert end.energy.gained < 1e-5 * end.energy.lost
