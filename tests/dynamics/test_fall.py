"""Separation of blocks, their release as rigid bodies, and the state of collapse."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from loose_blocks import G, floor

import archfem as af
from archfem.dynamics import (
    LooseBlocks,
    RigidBlockSimulation,
    State,
    classify_collapse,
    fall,
    release_blocks,
)
from archfem.dynamics.time_history import _doubt_impulses, _doubt_tolerance
from archfem.masonry.stiffness_ratio import estimate_block_stiffness

BREADTH = 0.5


@pytest.fixture(scope="module")
def tower():
    """Two blocks that may move far; coordinates are the motions of their centroids."""
    shape = af.column(breadth=BREADTH, heights=[0.5, 0.5])
    return af.build(shape, fidelity="rigid", displacements="large")


def batch(*states):
    """Steps that end in some states."""

    def read(gauges):
        return np.array([gauges.read(np.array(q, dtype=float)) for q in states])

    return SimpleNamespace(times=0.01 * np.arange(len(states)), read=read)


def leant(turn):
    """The upper block turned about the middle of its joint, at a height of half a metre."""
    return [0.0, 0.0, 0.0, -0.25 * np.sin(turn), 0.25 * (np.cos(turn) - 1.0), turn]


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_joint_lets_go_where_it_has_turned_by_three_tenths(tower, side):
    assert fall.SeparationMonitor(tower).find_first(batch(leant(0.0), leant(side * 0.295))) is None
    k, why = fall.SeparationMonitor(tower).find_first(
        batch(leant(0.0), leant(side * 0.305), leant(side * 0.4))
    )
    assert k == 1
    assert why == "'joint 1' had turned by 0.3 rad"


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_joint_lets_go_where_it_has_slid_off_its_face(tower, side):
    near, off = (
        [side * share * BREADTH, 0, 0, side * share * BREADTH, 0, 0] for share in (0.99, 1)
    )
    assert fall.SeparationMonitor(tower).find_first(batch(near, near)) is None
    assert fall.SeparationMonitor(tower).find_first(batch(near, off)) == (
        1,
        "'joint 0' had slid by 0.5 m, off its face",
    )


@pytest.mark.parametrize(
    ("turn", "speed", "falls"), [(0.049, 1.0, False), (0.051, 1.0, True), (0.051, 0.0, False)]
)
def test_blocks_that_lean_and_move_are_followed(tower, turn, speed, falls):
    velocity = np.zeros(tower.size)
    velocity[3] = speed
    state = af.dynamics.State(1.0, np.array(leant(turn)), velocity, np.zeros(tower.size))
    assert fall.is_overturning(tower, state) is falls


@pytest.mark.parametrize(
    ("turn", "speed", "shaken", "rests"),
    [
        (0.0, 0.044, False, True),
        (0.0, 0.045, False, False),
        (0.0, 0.044, True, False),
        (0.0195, 0.0, True, True),
        (0.0195, 0.044, False, True),
        (0.0205, 0.044, False, False),
    ],
)
def test_blocks_rest_that_can_only_vibrate(tower, turn, speed, shaken, rests):
    """A speed of 44.3 mm/s raises a block by 0.1 mm, a five-thousandth of the depth of a joint."""
    assert pytest.approx(2e-4 * BREADTH, rel=1e-2) == 0.0443**2 / (2.0 * G)
    velocity = np.zeros(tower.size)
    velocity[4] = speed
    start = State(0.0, *np.zeros((3, tower.size)))
    state = State(1.0, np.array(leant(turn)), velocity, np.zeros(tower.size))
    assert fall.standing_state(tower, start, state, shaken).resting is rests


def test_vibration_that_counts_as_rest_cannot_overturn_a_slender_column():
    """Height by which a column of slenderness 20 rises about its edge, from 20 mrad to its tip."""
    slope = np.arctan(1.0 / 20.0)
    to_edge = 0.5 * BREADTH / np.sin(slope)
    assert to_edge * (1.0 - np.cos(slope - 0.02)) > 20 * 2e-4 * BREADTH


def test_a_fall_is_followed_for_twenty_seconds_after_the_motion(tower, monkeypatch):
    """Frames each fiftieth of a second, of joints that all slide and none of which is bonded."""
    calls = []

    class Simulation:
        def __init__(self, structure, *, dt, rocking_ratio):
            calls.append(structure)

        def frames(self, start, end, motion, *, spacing):
            calls.append((start, end, spacing))
            yield start

    settling = SimpleNamespace(residual=0.25, unsettled_share=0.5)
    start = SimpleNamespace(time=1.0, poses=np.zeros((3, 3)), settling=settling, strain_energy=0.5)
    released = fall.ReleasedBlocks(start, 2.0, 1.5)
    monkeypatch.setattr(fall, "release_blocks", lambda model, state: released)
    monkeypatch.setattr(fall, "RigidBlockSimulation", Simulation)
    monkeypatch.setattr(fall, "classify_collapse", lambda structure, frames, start: len(frames))
    motion = af.Motion(np.arange(401.0) / 1e3, 0.01)
    for time, end in ((1.0, 24.0), (6.0, 26.0)):
        calls.clear()
        state = SimpleNamespace(time=time)
        rest = af.dynamics.State(0.0, *np.zeros((3, tower.size)))
        dataset, count = fall.simulate_fall(tower, rest, state, motion)
        assert calls[1] == (start, pytest.approx(end), 0.02)
        assert count == 1
    assert dataset["fall_ground"].values == pytest.approx(np.array([[0.1, 0.0]]))
    assert dataset.attrs["handover_kinetic"].tolist() == [2.0, 1.5]
    assert dataset.attrs["handover_strain"] == 0.5
    assert (dataset.attrs["fall_violation"], dataset.attrs["fall_unsettled"]) == (0.25, 0.5)


@pytest.mark.parametrize("ratio", [0.9, 0.8, 0.5, None])
def test_a_block_handed_over_rocks_on_with_the_restitution_of_its_damping(ratio):
    """Rocking energies of the first three tilts; Housner's 1 - 3/2 sin² α at least, with a doubt.

    Parabolas through frames 20 ms apart give the tilts, to 1 % of the ratio of speeds.
    """
    breadth, height, tilt = 0.6, 1.0, np.arctan(0.6)
    column = af.column(breadth=breadth, heights=[height], contact=af.Contact(1e10, 1e10, 5.0))
    model = af.build(column, fidelity="rigid", displacements="large")
    damping = replace(af.StiffnessDamping(0.3, 30.0), restitution=ratio)
    ground = af.Motion(np.r_[np.full(31, -8.4), np.zeros(10)], 0.01)
    run = af.time_history(model, ground, dt=2e-3, damping=damping)
    turn = np.abs(run.dataset["fall_pose"].values[:, 1, 2])
    tops = 1 + np.flatnonzero((turn[1:-1] > turn[:-2]) & (turn[1:-1] >= turn[2:]))[:3]
    before, top, after = turn[tops - 1], turn[tops], turn[tops + 1]
    peaks = top + (after - before) ** 2 / (8.0 * (2.0 * top - before - after))
    energies = np.cos(tilt - peaks) - np.cos(tilt)
    housner = 1.0 - 1.5 * np.sin(tilt) ** 2
    wanted = max(ratio or 0.0, housner)
    doubted = ["keep at least 0.6029 at" in doubt.cause for doubt in run.doubts]
    assert any(doubted) == (ratio == 0.5)
    assert peaks[0] > 0.3
    assert np.sqrt(energies[1:] / energies[:-1]) == pytest.approx(np.full(2, wanted), rel=0.01)


@pytest.mark.parametrize("longest", [5e-4, 3e-4, 1.25e-4, 1e-4])
def test_a_fall_that_fails_is_repeated_with_shorter_steps(tower, monkeypatch, longest):
    """Steps go down to an eighth of a millisecond, beyond which the error states remedies."""

    class Simulation:
        def __init__(self, structure, *, dt, rocking_ratio):
            self.dt = dt

        def frames(self, start, end, motion, *, spacing):
            settled = SimpleNamespace(residual=0.0, unsettled_share=0.0)
            yield SimpleNamespace(**vars(start), settling=settled)
            if self.dt > longest:
                raise af.errors.DidNotConverge(f"overlap by {self.dt} s")

    monkeypatch.setattr(fall, "RigidBlockSimulation", Simulation)
    rest = State(1.0, *np.zeros((3, tower.size)))
    still = af.Motion(np.zeros(3), 1.0)
    if longest < 1.25e-4:
        with pytest.raises(
            af.errors.DidNotConverge, match=r"1 s on, by steps of 0\.5 to 0\.125 ms"
        ):
            fall.simulate_fall(tower, rest, rest, still)
        return
    dataset, found = fall.simulate_fall(tower, rest, rest, still)
    assert found.kind == "stands"
    expected = {5e-4: 5e-4, 3e-4: 2.5e-4, 1.25e-4: 1.25e-4}[longest]
    assert dataset.attrs["fall_step"] == expected
    assert dataset.sizes["fall_frame"] == 1


def test_loose_stones_rub_as_their_joints_did_or_by_six_tenths():
    for friction, rubs in ((0.45, 0.45), (None, 0.6)):
        contact = af.Contact(1e9, 4e8, friction, cohesion=1e4)
        loose = fall._with_sliding_joints(af.column(breadth=1.0, heights=[1.0], contact=contact))
        assert [joint.contact.friction for joint in loose.joints] == [rubs]
        assert [joint.contact.cohesion for joint in loose.joints] == [0.0]


@pytest.mark.parametrize(
    ("contact", "words"),
    [
        (af.Contact(1e9, 4e8, 0.45), []),
        (af.Contact(1e9, 4e8, None), ["friction of 0.6 where their joints never slide: joint 0"]),
        (af.Contact(1e9, 4e8, 0.45, cohesion=1e4), ["no cohesion, in intact joints too: joint 0"]),
    ],
)
def test_friction_that_loose_stones_are_given_is_doubted(contact, words):
    """A column on a cohesive joint topples under 0.4 g for 1 s at any friction."""
    column = af.column(breadth=0.6, heights=[2.4], contact=contact)
    run = af.time_history(
        af.build(column, fidelity="rigid", displacements="large"), pulse(0.4, 1.0), dt=2e-3
    )
    assert run.fall.kind == "fallen"
    causes = " ".join(doubt.cause for doubt in run.verdict.doubts)
    assert all(word in causes for word in words)
    assert ("loose stones have" in causes) == bool(words)


@pytest.fixture(scope="module")
def model(ring):
    return af.build(ring, fidelity="rigid", displacements="large")


@pytest.fixture(scope="module")
def state(model):
    rng = np.random.default_rng(3)
    shape = np.tile([0.02, 0.02, 0.01], model.size // 3)
    q, v = (shape * rng.normal(size=model.size) for _ in range(2))
    return State(1.5, q, 10.0 * v, np.zeros_like(q))


def test_rigid_blocks_keep_pose_and_velocity(ring, model, state):
    found = release_blocks(model, state)
    assert found.start.time == 1.5
    assert found.start.poses[list(ring.free)].ravel() == pytest.approx(state.q, abs=1e-12)
    speeds = found.start.velocities[list(ring.free)].ravel()
    assert speeds == pytest.approx(state.velocity, abs=1e-11)
    assert found.kinetic_after == pytest.approx(found.kinetic_before, rel=1e-12)
    assert found.start.strain_energy == pytest.approx(model.energy(state.q), rel=1e-12)
    assert not found.start.poses[[0, -1]].any()


def test_faces_of_joints_are_where_the_model_has_them(ring, state):
    """Elastic blocks turn about another point than the centroid of their outline."""
    model = af.build(ring, fidelity="faces", cells=(2, 2), displacements="large")
    q = np.zeros(model.size)
    velocity = np.zeros(model.size)
    for k, first in enumerate(model.block_starts[:-1]):
        q[first : first + 3] = state.q[3 * k : 3 * k + 3]
        velocity[first : first + 3] = state.velocity[3 * k : 3 * k + 3]
    found = release_blocks(model, State(0.0, q, velocity, np.zeros_like(q)))
    opening = model.measures(q)[:, 0]
    poses = found.start.poses
    for joint, (lower, higher) in enumerate(ring.pairs):
        ends = []
        for block in (lower, higher):
            arm = ring.middles[joint] - ring.blocks[block].centroid
            c, s = np.cos(poses[block, 2]), np.sin(poses[block, 2])
            turned = np.array([[c, -s], [s, c]]) @ arm
            ends.append(poses[block, :2] + turned - arm)
        jump = ends[1] - ends[0]
        mean = 0.5 * (poses[lower, 2] + poses[higher, 2])
        c, s = np.cos(mean), np.sin(mean)
        normal = np.array([[c, -s], [s, c]]) @ ring.normals[joint]
        assert jump @ normal == pytest.approx(opening[joint], abs=1e-10)
    assert found.kinetic_after == pytest.approx(
        found.kinetic_before, rel=3e-3
    )  # chords of the mesh


def test_supports_stay_where_they_have_moved(ring, model, state):
    supports = np.zeros((len(ring.blocks), 3))
    supports[0] = -0.01, 0.0, 0.002
    assert release_blocks(model.with_support_motion(supports), state).start.poses[
        0
    ] == pytest.approx(supports[0])


def test_a_ring_thrown_up_falls_from_there(ring, model):
    """The handover of a ring whose blocks fly apart at 2 m/s is smooth."""
    q, velocity = np.zeros(model.size), np.zeros(model.size)
    velocity[1::3] = 2.0
    found = release_blocks(model, State(0.0, q, velocity, np.zeros_like(q)))
    end = RigidBlockSimulation(ring).final_frame(found.start, 0.1)
    lift = 2.0 * 0.1 - 0.5 * ring.gravity * 0.1**2
    assert end.poses[list(ring.free), 1] == pytest.approx(lift, rel=1e-9)


def test_a_model_of_small_displacements_is_refused(ring, state):
    with pytest.raises(af.errors.InvalidInput, match="large displacements"):
        release_blocks(af.build(ring, fidelity="rigid"), state)


def pulse(peak, duration=0.5):
    return af.Motion(np.full(round(duration / 0.01), peak * G), 0.01)


def shaken(structure, motion):
    falling = RigidBlockSimulation(structure, dt=1e-3)
    return classify_collapse(
        structure, falling.frames(LooseBlocks.as_built(structure), 15.0, motion)
    )


def test_a_ring_that_hardly_moves_stands(ring):
    found = shaken(ring, pulse(0.3))
    assert (found.kind, found.time, found.blocks, found.resting) == ("stands", None, (), True)
    assert found.residual < 1e-3


def test_a_ring_shaken_hard_has_fallen(ring):
    found = shaken(ring, pulse(0.7))
    assert found.kind == "fallen"
    assert found.resting
    assert 0.5 < found.time < 2.0
    assert "voussoir 9" in found.blocks
    assert found.residual > 1.0


def test_a_block_that_has_slid_is_dislocated():
    """Newmark's block: ½ (a - μ g) t² a / (μ g) under 0.8 g for 0.3 s at μ = 0.5."""
    structure = floor((-0.5, 0.0, 0.5, 0.5), friction=0.5)
    found = shaken(structure, af.Motion(np.repeat([0.8 * G, 0.0], [301, 2]), 1e-3))
    assert found.kind == "dislocated"
    slid = 0.5 * (0.8 - 0.5) * G * 0.3**2 * 0.8 / 0.5
    assert found.residual == pytest.approx(slid, rel=5e-3)  # the pulse ends 0.5 ms later


def test_a_toppled_column_has_fallen():
    column = af.column(breadth=0.6, heights=[2.4])
    found = shaken(column, pulse(0.4, 1.0))
    assert found.kind == "fallen"
    assert found.blocks == ("block 1",)


def arches(thin):
    """Two rings apart from each other on feet of their own, the second thinner."""
    rings = [
        af.circular_arch(radius=3.0, thickness=t, embrace=150.0, voussoirs=9, chords=1)
        for t in (0.9, thin)
    ]
    blocks, joints = [], []
    for k, ring in enumerate(rings):
        first = len(blocks)
        for block in ring.blocks:
            outline = tuple((x + 10.0 * k, y) for x, y in block.outline)
            blocks.append(
                af.Block(
                    outline,
                    block.material,
                    f"{block.name} of {k}",
                    fixed=block.fixed,
                    part=f"{block.part} of {k}",
                    role=block.role,
                )
            )
        for joint in ring.joints:
            ends = [(x + 10.0 * k, y) for x, y in joint.ends.tolist()]
            pair = tuple(number + first for number in joint.blocks)
            name, part = f"{joint.name} of {k}", f"{joint.part} of {k}"
            joints.append(af.Joint(pair, *ends, joint.contact, name, part, "ring"))
    return af.Structure(tuple(blocks), tuple(joints))


def test_one_ring_of_two_has_partly_fallen():
    found = shaken(arches(0.35), pulse(0.5))
    assert found.kind == "partly fallen"
    assert all(name.endswith(" of 1") for name in found.blocks)


def test_a_block_is_lost_once_it_has_sunk_or_turned():
    structure = floor((0.0, 0.0, 0.5, 2.0))
    for pose, kind in (
        ((0.04, 0.0, 0.0), "stands"),
        ((0.06, 0.0, 0.0), "dislocated"),
        ((0.0, -0.49, 0.0), "dislocated"),
        ((0.0, -0.51, 0.0), "fallen"),
        ((0.0, 0.0, 0.78), "dislocated"),
        ((0.0, 0.0, -0.79), "fallen"),
    ):
        start = LooseBlocks.as_built(structure, 3.0)
        start.poses[1] = pose
        found = classify_collapse(structure, [start])
        assert (found.kind, found.time) == (kind, 3.0 if kind == "fallen" else None)
    start.poses[1] = 0.0, 0.0, np.pi / 2.0
    assert classify_collapse(structure, [start]).residual == pytest.approx(
        np.sqrt(2.0) * np.hypot(0.25, 1.0)
    )


def test_a_run_without_frames_is_refused():
    with pytest.raises(af.errors.InvalidInput, match="no frames"):
        classify_collapse(floor((0.0, 0.0, 0.5, 2.0)), [])


@pytest.mark.parametrize(("share", "count"), [(0.0199, 0), (0.0201, 1)])
def test_steps_that_missed_their_tolerance_are_doubted(share, count):
    attributes = {"tolerance": 1e-3, "tolerance_unmet": share}
    doubts = _doubt_tolerance(SimpleNamespace(dataset=xr.Dataset(attrs=attributes)))
    assert len(doubts) == count
    assert all("more than 0.001 in |e| in 2% of the run" in doubt.cause for doubt in doubts)


@pytest.mark.parametrize(("share", "count"), [(0.02, 0), (0.0201, 1), (0.03, 1)])
def test_a_fall_whose_impulses_did_not_settle_is_doubted(share, count):
    history = SimpleNamespace(
        dataset=xr.Dataset(attrs={"fall_unsettled": share, "fall_violation": 0.2})
    )
    doubts = _doubt_impulses(history)
    assert len(doubts) == count
    assert all(
        f"did not settle in {share:.0%} of the steps" in doubt.cause
        and "by up to 0.2 of" in doubt.cause
        for doubt in doubts
    )


@pytest.mark.parametrize(
    ("kind", "displacement", "residual", "words"),
    [
        ("stands", 0.059, 0.006, []),
        ("stands", 0.062, 0.006, ["displaced by 62 mm, 0.62 of the depth"]),
        ("stands", 0.03, 0.0068, ["stands by little: residual displacement 6.8 mm, limit 10 mm"]),
        ("dislocated", 0.03, 0.0148, ["is dislocated by little"]),
        ("dislocated", 0.07, 0.0152, ["displaced by 70 mm"]),
        ("fallen", 0.09, 0.012, []),
    ],
)
def test_a_kind_of_collapse_near_another_is_doubted(kind, displacement, residual, words):
    """Limits of a column 0.1 m deep: 60 mm on the way, and 10 mm × 1.5 and / 1.5 at the end."""
    column = af.column(breadth=0.1, heights=[0.3])
    state = fall.CollapseState(kind, None, (), displacement, residual, resting=True)
    doubts = fall.doubt_collapse(column, state)
    assert len(doubts) == len(words)
    assert all(word in doubt.cause for word, doubt in zip(words, doubts, strict=True))


def test_stones_of_no_role_count_whatever_their_joints_are():
    """On joints of 40 GPa/m the large stone yields first, and is lost like the others."""
    contact = af.Contact(4e10, 2e10, 0.6)
    column = af.column(breadth=1.0, heights=[0.3, 2.0], contact=contact)
    blocks = tuple(replace(block, role="other") for block in column.blocks)
    joints = tuple(replace(joint, role="other") for joint in column.joints)
    structure = replace(column, blocks=blocks, joints=joints)
    ratios = [estimate_block_stiffness(structure, number).ratio for number in structure.free]
    assert min(ratios) < 1.0 < max(ratios)
    assert fall.list_stones(structure) == list(structure.free)
