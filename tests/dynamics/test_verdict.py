"""The verdict of a run: outcome, doubts, displacements and mechanisms."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import xarray as xr
from glued import glued
from portals import DRY, box

import archfem as af
from archfem.dynamics import MECHANISM_DEFINITIONS, verdict
from archfem.dynamics.collapse_state import CollapseState, describe_dislocation
from archfem.dynamics.history import with_fall
from archfem.dynamics.verdict import total_duration_remark
from archfem.joints.criteria import find_failed_joints
from archfem.limit import mechanism_over_record
from archfem.masonry.joint_closing import describe_closing


def failed_joints(run):
    return ((run.joints["hinge"] != 0) | run.joints["slide"] | run.joints["open"]).values


def test_the_words_are_written_from_the_fields(run):
    verdict = run.verdict
    first, *lines = str(verdict).splitlines()
    assert first == verdict.headline
    assert first.startswith("mechanism by any joints at once, ")
    assert first.endswith(f"; {len(verdict.doubts)} doubts")
    assert lines[: len(verdict.doubts)] == [f"in doubt: {doubt}" for doubt in verdict.doubts]
    names = [block.name for block in run.structure.blocks]
    most, left = (
        names[run.dataset[f"{key}_displacement"].values.argmax()] for key in ("largest", "residual")
    )
    assert (
        f"largest displacement of a corner {1e3 * verdict.displacement:.3g} mm ({most}), residual "
        f"{1e3 * verdict.residual:.3g} mm ({left}); not varied"
    ) in lines
    for name, found in verdict.mechanisms.items():
        (line,) = [text for text in lines if name in text.split(":")[0]]
        assert line.endswith(str(found) if found else "none")
    assert f"{describe_closing(run.structure)}, which was not varied" in lines
    assert repr(verdict) == f"Verdict({first!r})"
    assert verdict.headline in repr(run)


def test_a_residual_of_a_hundredth_of_the_depth_is_compared_with_rigid_joints(run):
    """Joints of presumed stiffness may ratchet, where rigid blocks stay; a fall has no residual."""
    depth, remedy = (
        run.structure.depths[0],
        "compare with rigid joints, `archfem verdict CASE.toml`",
    )
    np.testing.assert_allclose(run.structure.depths, depth)
    for share, time, said in ((0.011, None, True), (0.009, None, False), (0.011, 1.0, False)):
        fall = CollapseState("stands", time, (), 0.02, share * depth, True)
        assert (remedy in str(with_fall(run, fall).verdict)) == said


def test_largest_rotation_and_slip_are_those_of_the_record(run):
    """Looked up in the dataset by hand."""
    joints, words = run.joints, str(run.verdict)
    turned = abs(joints["rotation"]).where(joints["hinge"] != 0).fillna(0.0).values
    instant, joint = np.unravel_index(turned.argmax(), turned.shape)
    assert f"{1e3 * turned.max():.3g} mrad (joint {joint}, {run.time[instant]:.3f} s)" in words
    slip = abs(joints["slip"]).values
    assert f"slip {1e3 * slip.max():.3g} mm (joint {slip.max(axis=0).argmax()}, " in words


def test_mechanisms_have_time_joints_duration_and_opening(run):
    mechanisms = run.verdict.mechanisms
    assert list(mechanisms) == [
        *(name for name in MECHANISM_DEFINITIONS if name != "ring and pier at once"),
        "Demirel and Aldemir",
    ]
    for name, expected in (
        ("any joints at once", run.mechanism),
        ("Demirel and Aldemir", run.demirel_aldemir),
        ("verified", run.verified.moved),
    ):
        found = mechanisms[name]
        assert (found.time, found.joints) == (expected.time, expected.joints)
        # the time until one of its joints has not failed, and what is open till then, by hand
        failed = failed_joints(run)[:, list(found.joints)].all(axis=1)
        begin = int(np.flatnonzero(run.time == found.time)[0])
        count = int((np.append(failed[begin:], False)).argmin())
        assert found.duration == pytest.approx(count * (run.time[1] - run.time[0]))
        opening = run.joints["opening"].values[begin : begin + count, list(found.joints)]
        assert found.opening == expected.opening == opening.max()


def test_a_joint_that_has_failed_counts_over_the_record(run):
    """By a loop over the record; the opening is the largest at any time."""
    seen, first = set(), None
    for time, failed in zip(run.time, failed_joints(run), strict=True):
        before, seen = seen, seen | set(np.flatnonzero(failed).tolist())
        if seen and not before:
            first = time
        if len(seen) >= 4:
            break
    found = run.verdict.mechanisms["one part over the record"]
    assert (found.time, found.joints) == (time, tuple(sorted(seen)))
    assert found.duration == pytest.approx(time - first)
    assert found.opening == run.joints["opening"].values[:, sorted(seen)].max()
    assert found.time <= run.mechanism.time


def test_failures_at_different_times_count_over_the_record_alone():
    """Four joints of a ring that hinge one after the other; pier and ring do not add up."""
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=7)
    resultants = np.zeros((6, len(ring.joints), 3))
    resultants[..., 0] = 1e4
    for instant, joint in enumerate((0, 2, 5, 7)):
        resultants[instant + 1, joint, 2] = 0.5e4 * 0.55
    joints = af.joints.joint_dataset(ring, resultants, 0.01 * np.arange(6))
    assert af.limit.counted_mechanism(joints) is None
    found = mechanism_over_record(joints)
    assert (found.time, found.joints, found.kind) == (0.04, (0, 2, 5, 7), "local")
    # each failure lasts for one record of 10 ms
    assert mechanism_over_record(joints, af.Criteria(duration=0.01)) == found
    assert mechanism_over_record(joints, af.Criteria(duration=0.011)) is None
    assert mechanism_over_record(joints, af.Criteria(failures=5)) is None
    assert mechanism_over_record(joints.isel(time=4)) is None
    parts = np.where(np.arange(len(ring.joints)) < 3, "ring", "pier")
    apart = joints.assign_coords(part=("joint", parts), role=("joint", parts))
    assert mechanism_over_record(apart) is None


@pytest.mark.parametrize("dt", [0.005, pytest.param(None, marks=pytest.mark.slow)])
def test_an_event_over_the_record_ends_a_run_where_the_record_says(model, motion, dt):
    given, short = {"dt": dt, "damping": af.StiffnessDamping(0.05, 8.0)}, motion.cut(0.0, 1.5)
    event = af.dynamics.CountedMechanism(over="record")
    ended = af.time_history(model, short, until=event, **given)
    whole = af.time_history(model, short, **given)
    found = whole.verdict.mechanisms["one part over the record"]
    assert ended.time[-1] == found.time
    assert "a mechanism of arch over the record, by joints " in ended.outcome
    assert f"the run {ended.outcome}" in str(ended.verdict)


def test_counting_over_the_record_refuses_other_classes():
    with pytest.raises(af.InvalidInput, match="over = 'motion' is not known"):
        af.dynamics.CountedMechanism(over="motion")
    with pytest.raises(af.InvalidInput, match="leave kinds out"):
        af.dynamics.CountedMechanism(over="record", kinds=("global",))


def test_the_total_time_with_enough_failures_is_stated(run):
    """By a loop over the record."""
    lengths, count = [], 0
    for up in [*(failed_joints(run).sum(axis=1) >= 4), False]:
        count = count + 1 if up else (lengths.append(count) if count else None) or 0
    words = f"4 joints and more fail at once for {5 * sum(lengths):.3g} ms in all, "
    assert f"{words}{5 * max(lengths):.3g} ms at the longest" in str(run.verdict)


def test_a_run_that_was_broken_off_is_reported_first(model, motion):
    """After a failed step the state of collapse is unknown; earlier findings remain."""

    class Failing(af.dynamics.Stepper):
        def batches(self, start, dt, end):
            for number, batch in enumerate(super().batches(start, dt, end)):
                if number == 1:
                    raise af.DidNotConverge("no equilibrium")
                yield batch

    equation = af.dynamics.Equation(model, motion, af.StiffnessDamping(0.05, 8.0))
    failing = Failing(equation, exact=af.dynamics.SnesSolver(equation))
    with pytest.raises(af.DidNotConverge) as caught:
        af.time_history(model, motion, dt=0.005, method=failing)
    run = caught.value.history
    assert run.verdict.incomplete == f"failed at {run.time[-1]:.4g} s"
    assert run.verdict.headline.startswith(f"no mechanism, but the run {run.verdict.incomplete}; ")


def test_a_calm_run_is_reported_as_calm(model, motion):
    damping = af.Rayleigh(0.05, (8.0, 16.0))
    calm = af.time_history(model, motion.scaled(0.1), dt=0.005, damping=damping).verdict
    assert (calm.outcome, calm.headline) == (
        "no mechanism",
        "no mechanism; one motion, one set of properties: range not computed",
    )
    assert not any(calm.mechanisms.values())
    assert "no joint hinges, largest slip " in str(calm)
    assert ": |V| stays below its limit" in str(calm)
    none = ", verified, Demirel and Aldemir: none"
    assert str(calm).splitlines()[-1].endswith(none)
    # blocks that fall have moved, though by no mechanism of what had failed before
    fallen = replace(calm, fall=CollapseState("fallen", 1.0, ("a",), 0.1, 0.1, True))
    held = ", as joints that had not failed, assessed or not, held it"
    assert str(fallen).splitlines()[-1].endswith(f"{none}{held}")


@pytest.mark.parametrize(
    ("end", "elastic", "friction", "slides", "says"),
    [
        (0.0, 0.0, 0.6, False, ", elastic: |V| stays below its limit there"),
        (4e-4, 1.0, 0.6, False, ", elastic: |V| stays below its limit there"),
        (4e-4, 0.0, None, False, ", elastic: |V| stays below its limit there"),
        (
            4e-4,
            0.25,
            0.6,
            False,
            ", of which 0.3 mm remain, as part of the face slid: |V| stays below its limit",
        ),
        (4e-4, 0.0, 0.6, True, ""),
    ],
)
def test_the_largest_slip_says_what_of_it_is_left(run, end, elastic, friction, slides, says):
    """A slip within a face leaves a residual, which an elastic one, V / (k_s A), does not.

    By hand: at |e| = 5/12 a quarter of the depth is closed.
    """
    joints, joint = run.joints.copy(deep=True), run.structure.joints[3]
    for name in ("slip", "rotation", "slide", "V", "eccentricity"):
        joints[name] = xr.zeros_like(joints[name])
    joints["slip"].loc[{"joint": joints["joint"][3]}] = end
    joints["slip"][{"joint": 3, "time": 0}] = 0.0
    joints["slip"][{"joint": 3, "time": len(run.time) // 2}] = 6e-4
    joints["slide"][{"joint": 3, "time": 1}] = slides
    joints["eccentricity"][{"joint": 3, "time": -1}] = -5.0 / 12.0
    area = 0.25 * joint.depth * run.structure.width
    joints["V"][{"joint": 3, "time": -1}] = joint.contact.shear_stiffness * area * elastic * end
    contact = replace(joint.contact, friction=friction)
    changed = [replace(each, contact=contact) for each in run.structure.joints]
    structure = replace(run.structure, joints=tuple(changed))
    (text,) = verdict.extremes_remark(joints, structure)
    assert text.endswith(f" s){says}")
    assert "largest slip 0.6 mm (" in text


def test_files_have_the_verdict_of_the_run(run, tmp_path):
    """Without the structure, motions of the blocks are unknown."""
    path = run.save(tmp_path / "run.nc")
    assert str(af.History.read(path, run.structure).verdict) == str(run.verdict)
    alone = af.History.read(path).verdict
    assert (alone.outcome, alone.doubts) == (run.verdict.outcome, run.verdict.doubts)
    assert "verified" not in alone.mechanisms


def test_a_record_of_joints_alone_has_a_verdict_without_displacements(run):
    names = ["N", "V", "M"]
    resultants = np.stack([run.joints[name].values for name in names], axis=-1)
    joints = af.joints.joint_dataset(run.structure, resultants, run.time)
    alone = af.History(joints, run.structure).verdict
    assert np.isnan(alone.displacement)
    assert "largest displacement" not in str(alone)
    assert (alone.incomplete, alone.remarks[0][:7]) == ("", run.verdict.remarks[1][:7])
    assert alone.mechanisms["verified"].time == run.verified.moved.time


def test_displacement_is_that_of_the_farthest_corner_from_dead_load(model, motion):
    """By the coordinates of rigid blocks: corners turn about centroids."""
    damping, record = af.StiffnessDamping(0.05, 8.0), af.Record(fields_every=1)
    run = af.time_history(model, motion.cut(1.2, 1.8), dt=0.005, damping=damping, record=record)
    far = []
    for k, number in enumerate(model.structure.free):
        block, q = model.structure.blocks[number], run.dataset["q"].values[:, 3 * k : 3 * k + 3]
        for x, y in np.asarray(block.points) - block.centroid:
            u = q[:, :2] + q[:, 2:] * np.array([-y, x])
            far.append(np.linalg.norm(u - u[0], axis=1))
    assert run.verdict.displacement == pytest.approx(np.max(far), rel=1e-9)
    assert run.verdict.residual == pytest.approx(np.max(far, axis=0)[-1], rel=1e-9)
    of_blocks = run.dataset["largest_displacement"]
    assert float(of_blocks.max()) == pytest.approx(run.verdict.displacement, rel=1e-12)
    fixed = [block.fixed for block in model.structure.blocks]
    assert (of_blocks.values[fixed] == 0.0).all()


def test_damping_by_mass_is_doubted_where_joints_open(model, motion):
    """Its share of the losses by the kinetic energy of the recorded states."""
    damping, record = af.Rayleigh(0.05, (8.0, 16.0)), af.Record(fields_every=1)
    run = af.time_history(model, motion, dt=0.005, damping=damping)
    (doubt,) = [doubt for doubt in run.doubts if "proportional to mass" in doubt.cause]
    assert "effective_damping(model, ratio)" in doubt.remedy
    plain = af.time_history(model, motion, dt=0.005, damping=af.StiffnessDamping(0.05, 8.0))
    assert not [doubt for doubt in plain.doubts if "proportional to mass" in doubt.cause]
    calm = af.time_history(model, motion.scaled(0.1), dt=0.005, damping=damping, record=record)
    assert not calm.doubts


def test_the_share_of_damping_by_mass_is_that_of_the_energy_lost():
    """A rigid block on soft joints swings freely: all losses of mass damping alone are its own."""
    model = af.build(glued(af.column(breadth=1.0, heights=[0.5])), fidelity="rigid")
    damping = af.Rayleigh(0.05, (8.0, 16.0), joints="none")
    time = 0.005 * np.arange(101)
    motion = af.Motion(0.5 * np.sin(60.0 * time), 0.005)
    monitors = []
    with pytest.MonkeyPatch.context() as patch:
        from archfem.dynamics import time_history as module

        class Kept(module.RunMonitor):
            def __init__(self, *given, **options):
                super().__init__(*given, **options)
                monitors.append(self)

        patch.setattr(module, "RunMonitor", Kept)
        af.time_history(model, motion, dt=0.0005, damping=damping)
    # the power at the ends of steps exceeds that of their mean velocities by (ω Δt)² / 12 and more
    assert monitors[0].mass_damping_share == pytest.approx(1.0, rel=1e-2)


@pytest.mark.parametrize("fidelity", ["rigid", pytest.param("faces", marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "scheme",
    [pytest.param(af.dynamics.Conserving(), marks=pytest.mark.slow), af.dynamics.Newmark()],
)
def test_openings_follow_from_displacements_whatever_steps(ring, motion, fidelity, scheme):
    """Every method has those of SNES, and each frame those of its coordinates."""
    slides = scheme == af.dynamics.Conserving()
    model = af.build(ring if slides else glued(ring), fidelity=fidelity)
    given = {"damping": af.Rayleigh(0.05, (8.0, 16.0)), "scheme": scheme, "dt": 0.005}
    record, short = af.Record(every=3, fields_every=15), motion.cut(1.2, 1.35)
    gauges = model.observer()
    runs = {
        method: af.time_history(model, short, record=record, method=method, **given)
        for method in ("snes", "newton", "compliance")
    }
    for run in runs.values():
        for name in ("opening", "rotation", "slip"):
            expected = runs["snes"].joints[name].values
            off = np.abs(run.joints[name].values - expected).max()
            assert off < 1e-6 * np.abs(expected).max()  # SNES ends at 1e-8 of the forces
        faces = gauges.faces(np.array([gauges.read(q) for q in run.dataset["q"].values]))
        assert run.joints["rotation"].values[::5] == pytest.approx(faces[:, 1], abs=1e-13)
        assert run.joints["slip"].values[::5] == pytest.approx(faces[:, 2], abs=1e-13)


@pytest.fixture(scope="module")
def paced(model, motion):
    """A run whose steps choose their lengths, from 0.1 ms on."""
    return af.time_history(model, motion.cut(0.0, 2.0), damping=af.Rayleigh(0.05, (8.0, 16.0)))


@pytest.mark.slow
def test_mechanisms_too_short_to_count_are_reported(paced):
    """By a loop over the record: a counted mechanism lasts long enough, earlier ones are named."""
    step = np.diff(paced.time, prepend=0.0)
    failed = (paced.joints["hinge"].values != 0) | paced.joints["slide"] | paced.joints["open"]
    runs, begin = [], None
    for k, up in enumerate([*(failed.sum("joint").values >= 4), False]):
        begin = k if up and begin is None else begin
        if not up and begin is not None:
            runs.append((paced.time[begin], step[begin:k].sum()))
            begin = None
    first, longest = runs[0], max(length for _, length in runs)
    assert first[1] < longest
    assert paced.with_criteria(af.Criteria(duration=0.0)).mechanism.time == first[0]
    of_any = paced.with_criteria(af.Criteria(duration=0.0))
    assert "what begins at" not in str(of_any.verdict)
    for least in (1.01 * first[1], 1.01 * longest):
        strict = paced.with_criteria(af.Criteria(duration=least))
        counts = [time for time, length in runs if length >= least]
        assert (strict.mechanism and strict.mechanism.time) == (counts[0] if counts else None)
        words = f"begins at {first[0]:.4f} s lasts less than {1e3 * least:.3g} ms, and"
        assert words in str(strict.verdict)


@pytest.mark.slow
def test_an_event_ends_a_run_of_any_steps_in_its_first_mechanism(paced, model, motion):
    halted = af.time_history(
        model, motion, damping=af.Rayleigh(0.05, (8.0, 16.0)), until=af.CountedMechanism()
    )
    found = halted.mechanism
    assert found.time == paced.mechanism.time
    held = halted.time[halted.time >= found.time]
    before = halted.time[len(halted.time) - len(held) - 1]
    assert held[-1] - before >= 1e-3 * (1.0 - 1e-6)
    assert len(held) == 1 or held[-2] - before < 1e-3


def bonded_wall(first=0.25):
    """Four courses of three stones of 0.5 m by 0.25 m in running bond: ten head joints."""
    blocks = [box(-0.5, -0.5, 2.0, 0.0, "ground", fixed=True, part="ground")]
    for course in range(4):
        inner = (0.5, 1.0) if course % 2 else (first, 0.75, 1.25)
        for left, right in pairwise((0.0, *inner, 1.5)):
            outline = left, 0.25 * course, right, 0.25 * (course + 1)
            blocks.append(box(*outline, f"stone {len(blocks)}", part="wall", role="pier"))
    return af.masonry.assembled(blocks, replace(DRY, friction=0.3))


@pytest.fixture(scope="module", params=["small", pytest.param("large", marks=pytest.mark.slow)])
def wall_model(request):
    return af.build(bonded_wall(), fidelity="rigid", displacements=request.param)


def test_head_joints_of_a_wall_are_no_failures(wall_model):
    """Nothing has failed in a wall at rest, nor under a hundredth of its friction."""
    still = af.Motion(0.03 * np.sin(40.0 * np.arange(0.0, 0.2, 0.005)), 0.005)
    given = {"dt": 0.005, "damping": af.StiffnessDamping(0.05, 20.0)}
    run = af.time_history(wall_model, still, until=af.dynamics.CountedMechanism(), **given)
    heads = np.abs(wall_model.structure.normals[:, 0]) > 0.5
    np.testing.assert_array_equal(run.joints["head"].values, heads)
    np.testing.assert_array_equal(run.joints["judged"].values, ~heads)
    assert heads.sum() == 10
    assert run.verdict.assessed.endswith("not assessed: 10 head joints of wall")
    assert not find_failed_joints(run.joints).any()
    assert not any(run.verdict.mechanisms.values())
    assert run.ending is af.dynamics.Ending.FINISHED
    # taken for bed joints, their small forces and gaps count
    assert mechanism_over_record(run.joints.drop_vars("head")) is not None


def test_bed_joints_of_a_wall_still_fail_and_move(wall_model, tmp_path):
    """By sliding; head joints count in no number, and take part in the verified motion.

    A vibration doubles a force that begins at once, at most: friction of 0.3 holds below 0.15 g.
    """
    pulse = af.Motion(6.0 * np.sin(10.0 * np.arange(0.0, 0.3, 0.005)), 0.005)
    given = {"dt": 0.005, "damping": af.StiffnessDamping(0.05, 20.0)}
    run = af.time_history(wall_model, pulse, **given)
    counted, heads = run.mechanism, np.flatnonzero(run.joints["head"])
    assert 6.0 * np.sin(10.0 * counted.time) > 0.5 * 0.3 * 9.81
    assert not set(counted.joints) & set(heads)
    # the verdict has no count of a wall, whose bed joints touch and part in turn
    found = run.verdict.mechanisms
    assert found["verified"] is not None
    assert not any(found[name] for name in found if name != "verified")
    assert "fail at once" not in str(run.verdict)
    picture = af.view.draw_structure(run.structure, run.joints.sel(time=counted.time))
    assert "failed joints" not in picture.axes[0].get_title()
    ended = af.time_history(wall_model, pulse, until=af.dynamics.CountedMechanism(), **given)
    assert ended.time[-1] == counted.time
    bare = run.joints.drop_vars("head")
    found, other = (
        af.limit.first_verified_mechanism(run.structure, each) for each in (run.joints, bare)
    )
    assert found.moved == other.moved
    again = af.History.read(run.save(tmp_path / "run.nc"), run.structure)
    assert again.mechanism.joints == counted.joints


def test_head_joints_that_carry_at_rest_do_not_count_either():
    """A wall on two fixed stones, of which the middle sags: its head joints are pressed at rest."""
    blocks = [
        box(left, -0.5, left + 0.5, 0.0, f"foot at {left}", fixed=True, part="foot", role="other")
        for left in (0.0, 1.0)
    ]
    for course, inner in enumerate([(0.25, 0.75, 1.25), (0.5, 1.0), (0.25, 0.75, 1.25)]):
        for left, right in pairwise((0.0, *inner, 1.5)):
            outline = left, 0.25 * course, right, 0.25 * (course + 1)
            blocks.append(box(*outline, f"stone {len(blocks)}", part="wall", role="pier"))
    wall = af.masonry.assembled(blocks, DRY)
    joints = af.dead_load(af.build(wall, fidelity="rigid")).joints
    assert float(joints["N"].values[wall.heads].max()) > 0.1 * float(joints["N"].max())
    flags = joints["slide"] | joints["open"] | (joints["hinge"] != 0)
    assert flags.values[wall.heads].any()
    assert not find_failed_joints(joints).values[wall.heads].any()


def test_the_median_joint_of_the_shallowest_part_sets_what_is_dislocated(wall_model):
    """Of bed joints of 0.05 to 0.5 m, not of a sliver; a pier of 0.1 m beside it is shallower."""
    wall = bonded_wall(0.45)
    assert wall.depths[wall.judged].min() == pytest.approx(0.05)
    assert describe_dislocation(wall) == (
        "would count as dislocated beyond 25 mm of residual displacement, a tenth of the median "
        "depth of the joints of wall"
    )
    post = box(1.8, 0.0, 1.9, 0.5, "post", part="post", role="pier")
    beside = af.masonry.assembled([*wall.blocks, post], DRY)
    assert describe_dislocation(beside).startswith("would count as dislocated beyond 10 mm")
    still = af.Motion(np.zeros(20), 0.005)
    run = af.time_history(wall_model, still, dt=0.005)
    said = describe_dislocation(wall_model.structure) in str(run.verdict)
    assert said == wall_model.large_displacements


def test_a_single_joint_that_is_a_mechanism_is_named_in_the_singular():
    """A joint that hinges from 0.1 s on, of two, where one makes a mechanism."""
    column = af.column(breadth=0.5, heights=[1.0, 1.0])
    time = np.arange(0.0, 1.0, 0.1)
    forces = np.tile([1e4, 0.0, 0.0], (10, 2, 1))
    forces[1:, 0, 2] = 0.49 * 0.5 * 1e4
    joints = af.joints.joint_dataset(column, forces, time, criteria=af.Criteria(failures=1))
    assert total_duration_remark(joints) == (
        "one joint or more fails for 900 ms in all, 900 ms at the longest"
    )
    assert mechanism_over_record(joints).course == "it forms at once"


def test_a_stack_and_a_flat_row_of_stones_have_no_head_joints(run):
    assert "head" not in run.joints.coords
    assert not run.structure.heads.any()
    blocks = [box(k, 0.0, k + 1.0, 1.0, f"stone {k}", part="row", role="pier") for k in range(3)]
    ends = [
        box(x, 0.0, x + 1.0, 1.0, f"end {x}", fixed=True, part="end", role="other") for x in (-1, 3)
    ]
    assert not af.masonry.assembled([*blocks, *ends], DRY).heads.any()
