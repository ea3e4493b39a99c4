"""Release of blocks as rigid bodies, and their fall."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from loose_blocks import G
from portals import box

import archfem as af
from archfem.dynamics import RigidBlockSimulation, State, fall, release_blocks
from archfem.dynamics.rigid_body import simulation

# Attributes of a fall without doubts of energy and step
BALANCED = {"fall_unsettled_early": 0.0, "fall_gained_share": 0.0, "fall_step_change": 0.0}


@pytest.fixture(scope="module")
def tower():
    """Two blocks that may move far; coordinates are the motions of their centroids."""
    shape = af.column(breadth=0.5, heights=[0.5, 0.5])
    return af.build(shape, fidelity="rigid", displacements="large")


def test_a_fall_is_followed_for_twenty_seconds_after_the_motion(tower, monkeypatch):
    """Frames each fiftieth of a second, of joints that all slide and none of which is bonded."""
    calls = []

    class Simulation:
        def __init__(self, structure, *, dt, rocking_ratio):
            assert dt is None  # steps are halved until that changes nothing
            calls.append(structure)

        def frames(self, start, end, motion, *, spacing):
            calls.append((start, end, spacing))
            yield start

    settling = SimpleNamespace(residual=0.25, unsettled_share=0.5, steps=4)
    start = SimpleNamespace(
        time=1.0,
        poses=np.zeros((3, 3)),
        settling=settling,
        strain_energy=0.5,
        energy=SimpleNamespace(gained_share=0.125),
        step_change=0.75,
    )
    released = fall.ReleasedBlocks(start, 2.0, 1.5)
    monkeypatch.setattr(fall, "release_blocks", lambda model, state: released)
    monkeypatch.setattr(fall, "RigidBlockSimulation", Simulation)
    motion = af.Motion(np.arange(401.0) / 1e3, 0.01)
    for time, end in ((1.0, 24.0), (6.0, 26.0)):
        calls.clear()
        state = SimpleNamespace(time=time)
        dataset, frames = fall.simulate_fall(tower, state, motion)
        assert calls[1] == (start, pytest.approx(end), 0.02)
        assert frames == [start]
    assert dataset["fall_ground"].values == pytest.approx(np.array([[0.1, 0.0]]))
    assert dataset.attrs["handover_kinetic"].tolist() == [2.0, 1.5]
    assert dataset.attrs["handover_strain"] == 0.5
    assert dataset.attrs["fall_unsettled"] == 0.5
    assert (dataset.attrs["fall_gained_share"], dataset.attrs["fall_step_change"]) == (0.125, 0.75)
    dataset.attrs["fall_unsettled_early"] = 0.0
    causes = "\n".join(doubt.cause for doubt in fall._doubt_fall(tower.structure, dataset))
    assert "gained 0.12 of the energy exchanged" in causes
    assert "how far a block falls or moves by 75%" in causes


@pytest.mark.parametrize(
    "ratio", [*(pytest.param(each, marks=pytest.mark.slow) for each in (0.9, 0.8)), 0.5, None]
)
def test_a_block_handed_over_rocks_on_with_the_restitution_of_its_damping(ratio):
    """Rocking energies of the first three tilts, also below Housner's 1 - 3/2 sin² α = 0.603.

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
    wanted = ratio or housner
    assert peaks[0] > 0.3
    assert np.sqrt(energies[1:] / energies[:-1]) == pytest.approx(np.full(2, wanted), rel=0.01)


@pytest.mark.parametrize(("stiffness", "push", "doubted"), [(1e7, 0.24, True), (1e9, 0.4, False)])
def test_a_fall_of_which_rigid_blocks_know_nothing_is_doubted(stiffness, push, doubted):
    """A column of breadth to height 1 to 4 rocks under 0.24 g at most by its softness."""
    contact = af.Contact(stiffness, 0.4 * stiffness, 0.6)
    column = af.column(breadth=0.6, heights=[2.4], contact=contact)
    ground = af.Motion(np.r_[np.full(60, push * G), np.zeros(40)], 0.01)
    model = af.build(column, fidelity="rigid", displacements="large")
    run = af.time_history(model, ground, dt=2e-3)
    assert run.fall.kind == "fallen"
    causes = [doubt.cause for doubt in run.doubts]
    said = f"as rigid blocks none falls under this motion of {push * G / 9.80665:.3g} g: "
    assert any(said in cause for cause in causes) == doubted


@pytest.mark.parametrize(
    ("last", "remedy"), [(0.7, "hold the push longer"), (-0.7, "motion.rest=10")]
)
def test_a_push_to_the_end_is_to_be_held_longer(last, remedy):
    """A block slides at 0.7 g with μ = 0.6, and for a while when the ground turns."""
    contact = af.Contact(1e9, 4e8, 0.6)
    block = af.column(breadth=1.0, heights=[0.4], contact=contact)
    ground = af.Motion(np.r_[np.full(60, 0.7 * G), np.full(3, last * G)], 0.01)
    run = af.Analysis(block, fidelity="rigid", displacements="large", dt=2e-3).run(ground)
    assert run.fall.kind == "dislocated"
    assert [remedy in x.remedy for x in run.doubts if "still move" in x.cause] == [True]


def test_what_still_moves_is_judged_by_the_rest_that_its_motion_has(monkeypatch):
    """Of 64 samples each 0.01 s, the last four at rest."""
    rests = []
    monkeypatch.setattr(fall, "doubt_collapse", lambda *given: rests.append(given[-1]) or [])
    block = af.column(breadth=1.0, heights=[0.4])
    ground = af.Motion(np.r_[np.full(60, 0.7 * G), np.zeros(4)], 0.01)
    af.Analysis(block, fidelity="rigid", displacements="large", dt=2e-3).run(ground)
    assert rests == [pytest.approx(0.04)]


@pytest.mark.parametrize(
    ("whole", "followed", "outcome"),
    [
        (True, 0.2, "unknown"),
        (True, 0.6, "unknown"),  # 0.28 s after it was out of its place, for less than 0.71 s
        (True, 1.1, "fallen"),
        (False, 0.2, "unknown"),
        (False, 9.0, "fallen"),
    ],
)
def test_a_fall_that_cannot_be_followed_keeps_what_is_known(whole, followed, outcome, monkeypatch):
    """A column that topples under 0.4 g comes loose at 0.67 s, and is lost at 0.99 s.

    Not whole, it ends after as long as a free fall by the size of the structure, at a frame.
    """
    check = simulation._Run._check

    def fail_late(run, time):
        check(run, time)
        if time > 0.67 + followed:
            raise af.DidNotConverge("made to fail")

    monkeypatch.setattr(simulation._Run, "_check", fail_late)
    column = af.column(breadth=0.6, heights=[2.4], contact=af.Contact(1e9, 4e8, 0.6))
    analysis = af.Analysis(column, fidelity="rigid", displacements="large", dt=2e-3)
    push = af.Motion(np.full(100, 0.4 * G), 0.01)
    run = replace(analysis, record=af.Record(whole_fall=whole)).run(push)
    assert run.verdict.outcome == outcome
    assert run.ending is af.dynamics.Ending.PARTED
    last = run.dataset["fall_time"].values[-1]
    ends = whole or outcome == "unknown"
    free_fall = np.sqrt(2.0 * column.size / G)
    expected = 0.67 + followed if ends else run.fall.time + free_fall + 0.02
    assert expected - 0.021 < last <= expected
    broken_off = f"followed until {last:.2f} s alone, .*: .*made to fail"
    doubted = any(re.search(broken_off, doubt.cause) for doubt in run.doubts)
    assert doubted == (whole or outcome == "unknown")


@pytest.mark.parametrize(("after", "decided"), [(0.6, False), (1.2, True)])
def test_a_fall_that_ends_while_blocks_move_is_decided_after_a_free_fall(
    after, decided, monkeypatch
):
    """The column of the test above, 0.28 s and 0.88 s after it was out of its place."""
    simulate = fall.simulate_fall

    def stop(*given):
        dataset, frames = simulate(*given)
        return dataset, [each for each in frames if each.time < 0.67 + after]

    monkeypatch.setattr(fall, "simulate_fall", stop)
    column = af.column(breadth=0.6, heights=[2.4], contact=af.Contact(1e9, 4e8, 0.6))
    analysis = af.Analysis(column, fidelity="rigid", displacements="large", dt=2e-3)
    run = analysis.run(af.Motion(np.full(100, 0.4 * G), 0.01))
    assert run.verdict.outcome == ("fallen" if decided else "unknown")
    words = "not decided whether blocks fall: block 1 still moved out of place at 1.2"
    assert any(words in doubt.cause for doubt in run.doubts) != decided
    assert run.verdict.headline.startswith("unknown, not decided: still moving; ") != decided


@pytest.mark.parametrize(
    ("followed", "compared", "outcome"),
    [
        (0.2, False, "unknown"),
        (1.1, False, "fallen"),
        (99.0, True, "fallen"),
        (-1.0, False, "unknown"),
    ],
)
def test_a_fall_that_is_interrupted_keeps_what_was_computed(
    followed, compared, outcome, monkeypatch
):
    """The column of the test above; behind the fall, it is compared with rigid blocks."""
    check, doubt = simulation._Run._check, fall._doubt_joints

    def stop(run, time):
        check(run, time)
        if time > 0.67 + followed:
            raise KeyboardInterrupt

    def stop_comparison(*given):
        if compared:
            raise KeyboardInterrupt
        return doubt(*given)

    monkeypatch.setattr(simulation._Run, "_check", stop)
    monkeypatch.setattr(fall, "_doubt_joints", stop_comparison)
    column = af.column(breadth=0.6, heights=[2.4], contact=af.Contact(1e9, 4e8, 0.6))
    analysis = af.Analysis(column, fidelity="rigid", displacements="large", dt=2e-3)
    run = analysis.run(af.Motion(np.full(100, 0.4 * G), 0.01))
    assert run.ending is af.dynamics.Ending.INTERRUPTED
    assert run.verdict.outcome == outcome
    assert run.time[-1] == pytest.approx(0.67, abs=0.02)
    place = (
        "its comparison with rigid blocks"
        if compared
        else r"[\d.]+ s" + ", in a fall" * (followed > 0)
    )
    assert re.match(rf"interrupted at {place}", run.outcome)
    assert [x.remedy for x in run.doubts if "interrupted" in x.cause] == [
        "run the motion again, to its end"
    ]
    assert ("fall_pose" in run.dataset) == (followed > 0.0)
    if not compared and followed > 0.0:
        last = run.dataset["fall_time"].values[-1]
        assert 0.67 + followed - 0.021 < last <= 0.67 + followed


@pytest.mark.parametrize(
    ("end", "friction", "outcome", "doubted"),
    [
        (1.0, 0.15, "fallen", True),
        pytest.param(10.0, 0.15, "dislocated", False, marks=pytest.mark.slow),
        pytest.param(0.6, 0.9, "fallen", False, marks=pytest.mark.slow),
    ],
)
def test_stones_that_slide_off_the_drawn_ground_are_a_doubt(end, friction, outcome, doubted):
    """After 1 s of 3 m/s² of 1.53 m/s, they stop after v² (1 / 1.53 + 1 / 1.47) / 2 = 1.56 m."""
    dry = af.Contact(1e9, 4e8, friction=friction)
    blocks = [
        box(-1.0, -2.0, end, 0.0, "rock", fixed=True, part="rock", role="other"),
        *(box(0.0, y, 0.6, y + 0.6, f"{y}", part="pier", role="pier") for y in (0.0, 0.6)),
    ]
    push = np.concatenate([np.full(100, -3.0 if friction < 0.5 else -8.0), np.zeros(10)])
    analysis = af.Analysis(af.masonry.assembled(blocks, dry), fidelity="rigid")
    run = replace(analysis, displacements="large").run(af.Motion(push, 0.01).with_rest(4.0))
    assert run.verdict.outcome == outcome
    said = [each.cause for each in run.doubts if "fixed blocks" in each.cause]
    assert said == ["0.0 slid beyond the ends of all fixed blocks, and fell there"] * doubted
    remedies = "".join(each.remedy for each in run.doubts if "fixed blocks" in each.cause)
    assert ('of a shape without ground by `shape = "blocks"`' in remedies) == doubted
    if outcome == "dislocated":
        assert run.verdict.residual == pytest.approx(1.56, rel=0.01)


def test_motions_and_falls_show_their_progress(monkeypatch, tmp_path):
    """Every line has the name of the motion, which distinguishes those of a suite."""
    monkeypatch.setattr("archfem._display.MOTION_INTERVAL", 0.0)
    column = af.column(breadth=0.6, heights=[2.4], contact=af.Contact(1e9, 4e8, 0.6))
    analysis = af.Analysis(column, fidelity="rigid", displacements="large", dt=2e-3)
    with open(tmp_path / "errors", "w") as errors:
        monkeypatch.setattr("sys.stderr", errors)
        analysis.run(af.Motion(np.full(100, 0.4 * G), 0.01, name="push"))
    lines = (tmp_path / "errors").read_text().splitlines()
    said = [
        r"push: 0\.\d+ of 0\.99 s",
        r"push: loose blocks: [\d.]+ of 21 s at most \(20 s after the motion\), by steps of .* ms",
        r"push: compared: rigid blocks from rest; loose blocks: .* by steps of 0\.5 ms",
    ]
    for pattern in said:
        assert any(re.fullmatch(pattern, line) for line in lines), pattern
    monkeypatch.setattr("archfem._display.parent_process", object)  # of a worker
    with open(tmp_path / "none", "w") as errors:
        monkeypatch.setattr("sys.stderr", errors)
        analysis.run(af.Motion(np.full(100, 0.4 * G), 0.01, name="push"))
    assert (tmp_path / "none").read_text() == ""


def test_loose_stones_rub_as_their_joints_did_or_by_six_tenths():
    for friction, rubs, bond in ((0.45, 0.45, 1e4), (None, 0.6, 0.0)):
        contact = af.Contact(1e9, 4e8, friction, cohesion=1e4)
        loose = fall.with_sliding_joints(af.column(breadth=1.0, heights=[1.0], contact=contact))
        assert [joint.contact.friction for joint in loose.joints] == [rubs]
        assert [joint.contact.cohesion for joint in loose.joints] == [bond]


@pytest.mark.parametrize(
    ("contact", "words"),
    [
        (af.Contact(1e9, 4e8, 0.45), []),
        (af.Contact(1e9, 4e8, None), ["friction of 0.6 where their joints never slide: joint 0"]),
        (af.Contact(1e9, 4e8, 0.45, cohesion=1e4), ["also where the force is eccentric: joint 0"]),
    ],
)
def test_friction_that_loose_stones_are_given_is_doubted(contact, words):
    """A column on a cohesive joint topples under 0.4 g for 1 s at any friction."""
    column = af.column(breadth=0.6, heights=[2.4], contact=contact)
    run = af.time_history(
        af.build(column, fidelity="rigid", displacements="large"),
        af.Motion(np.full(100, 0.4 * G), 0.01),
        dt=2e-3,
    )
    assert run.fall.kind == "fallen"
    causes = " ".join(doubt.cause for doubt in run.verdict.doubts)
    assert all(word in causes for word in words)
    assert ("loose stones have" in causes) == bool(words)


@pytest.mark.parametrize(
    ("share", "early", "doubted"),
    [
        (0.02, 0.02, None),
        (0.0201, 0.0, "where blocks come to rest, and not that they fall: .* 2% of the steps, of"),
        (0.03, 0.02, "where blocks come to rest, and not that they fall: .* 3% of the steps, of"),
        (0.01, 0.04, "whether blocks fall: .* 4% of the steps before the first"),
        (0.5, 0.04, "whether blocks fall: .* 4% of the steps before the first"),
    ],
)
def test_impulses_that_did_not_settle_doubt_the_fall_or_the_heap(share, early, doubted):
    attrs = BALANCED | {"fall_unsettled": share, "fall_unsettled_early": early}
    column = af.column(breadth=0.5, heights=[0.5], contact=af.Contact(1e9, 4e8, 0.6))
    poses = {"fall_pose": (("fall_frame", "block", "pose"), np.zeros((1, 2, 3)))}
    doubts = [doubt.cause for doubt in fall._doubt_fall(column, xr.Dataset(poses, attrs=attrs))]
    assert len(doubts) == (doubted is not None)
    assert all(re.search(doubted, doubt) for doubt in doubts)


def test_impulses_are_early_up_to_the_first_lost_block(tower, monkeypatch):
    def numbered(*given, **options):
        dataset, frames = simulate(*given, **options)
        shares = (SimpleNamespace(unsettled_share=k / 1000.0) for k in range(len(frames)))
        return dataset, [replace(f, settling=each) for f, each in zip(frames, shares, strict=True)]

    simulate = fall.simulate_fall
    monkeypatch.setattr(fall, "simulate_fall", numbered)
    run = af.time_history(tower, af.Motion(np.full(100, 1.2 * G), 0.01), dt=2e-3)
    first = np.flatnonzero(run.dataset["fall_time"].values == run.fall.time)
    assert 0 < first < run.dataset.sizes["fall_frame"] - 1
    assert run.dataset.attrs["fall_unsettled_early"] == first / 1000.0


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


def test_blocks_that_joints_hold_to_the_end_are_not_lost():
    """A block that has sunk into a soft joint by more than half of its size, at rest."""
    slab = af.column(breadth=2.0, heights=[0.2], contact=af.Contact(11e3, 11e3, friction=0.6))
    analysis = af.Analysis(slab, fidelity="rigid", displacements="large", damping=None)
    run = analysis.run(af.Motion(np.full(5, 1e-3), 0.01))
    assert (run.verdict.fall.kind, run.verdict.fall.time) == ("stands", None)
    assert run.verdict.displacement < 1e-3  # from the dead load
