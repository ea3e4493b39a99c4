"""What a run means, in words."""

import re
from dataclasses import replace

import numpy as np
import pytest
from glued import glued

import archfem as af
from archfem.dynamics.run_text import extremes_text, mechanism_text, one_line
from archfem.limit.mechanism_count import episode


def test_the_verdict_says_what_was_largest_and_what_is_left(run):
    """Each number and name against those looked up in the dataset by hand; a doubt comes first."""
    doubt, sentence, *lines = run.verdict.splitlines()
    assert doubt == f"in doubt: {run.warnings[0]}"
    joints = run.joints
    turned = abs(joints["rotation"]).where(joints["hinge"] != 0).fillna(0.0).values
    instant, joint = np.unravel_index(turned.argmax(), turned.shape)
    assert f"{1e3 * turned.max():.3g} mrad (joint {joint}, {run.time[instant]:.3f} s)" in sentence
    slip = abs(joints["slip"]).values
    assert f"slip {1e3 * slip.max():.3g} mm (joint {slip.max(axis=0).argmax()}, " in sentence
    moved, left = (run.dataset[name] for name in ("largest_displacement", "residual_displacement"))
    block = str(moved["block"][int(moved.values.argmax())].values)
    assert f"displacement {1e3 * float(moved.max()):.3g} mm ({block}, " in sentence
    assert f"farther than {1e3 * float(left.max()):.3g} mm (" in sentence
    assert [line.split(":")[0] for line in lines] == [
        "by count",
        "by Demirel and Aldemir",
        "verified",
    ]


def test_each_mechanism_has_its_duration_and_opening(run):
    counted, published, moved = run.verdict.splitlines()[2:]
    for line, found in (
        (counted, run.mechanism),
        (published, run.demirel_aldemir),
        (moved, run.verified.moved),
    ):
        assert f"local mechanism of arch at {found.time:.3f} s by joints " in line
        assert f"; {episode(run.joints, found)}" in line
    names = [run.structure.blocks[k].name for k in run.verified.moved.blocks]
    assert f"; moving: {names[0]}; " in moved
    assert "at its beginning rings and piers cannot move" in counted


def test_how_long_so_many_fail_in_all(run):
    """By a loop over the record."""
    failed = (run.joints["hinge"].values != 0) | run.joints["slide"] | run.joints["open"]
    enough = failed.sum("joint").values >= 4
    lengths, count = [], 0
    for up in [*enough, False]:
        count = count + 1 if up else (lengths.append(count) if count else None) or 0
    words = f"so many fail for {5 * sum(lengths):.3g} ms in all, {5 * max(lengths):.3g} ms at the"
    assert words in run.verdict


def test_a_calm_run_says_so(model, motion):
    damping = af.Rayleigh(0.05, (8.0, 16.0))
    calm = af.time_history(model, motion.scaled(0.1), dt=0.005, damping=damping)
    assert calm.verdict.startswith("No joint hinges, the largest slip ")
    assert calm.verdict.splitlines()[1:] == [
        "by count: no mechanism, never 4 failed joints at once in rings and piers",
        "by Demirel and Aldemir: no mechanism, never 4 failed joints at once in one ring",
        "verified: no mechanism, at no instant could rings or piers move",
    ]


def test_a_run_that_did_not_finish_says_so_first(model, motion):
    halted = af.time_history(model, motion, dt=0.005, until=af.CountedMechanism())
    first, _, counted, *_ = halted.verdict.splitlines()[len(halted.warnings) :]
    assert first == f"outcome: {halted.outcome}"
    assert "a mechanism of arch by joint" in first
    assert f"{halted.time[-1]:.3f} s by joint" in counted
    assert "it lasts 5 ms, opens by up to " in counted


def test_the_verdict_of_files(run, tmp_path):
    """What lies in the file is told; of an earlier version's what it has."""
    path = run.save(tmp_path / "run.nc")
    assert af.History.read(path, run.structure).verdict == run.verdict
    alone = af.History.read(path).verdict.splitlines()
    assert alone[0] == run.verdict.splitlines()[0]
    assert len(alone) == 4
    new = ["opening", "rotation", "slip"]
    blocks = ["largest_displacement", "largest_displacement_time", "residual_displacement"]
    old = af.History(run.dataset.drop_vars([*new, *blocks, "block"]))
    read = af.History.read(old.save(tmp_path / "old.nc"), run.structure)
    assert extremes_text(read.dataset) == ""
    _, counted, _, moved = read.verdict.splitlines()
    lasts = re.search(r"it lasts \S+ ms", run.verdict).group()
    assert f"{lasts} and closes again" in counted
    assert moved.startswith("verified: local")


@pytest.mark.parametrize("fidelity", ["rigid", pytest.param("faces", marks=pytest.mark.slow)])
@pytest.mark.parametrize("scheme", [af.dynamics.Conserving(), af.dynamics.Newmark()])
def test_openings_follow_from_displacements_whatever_steps(ring, motion, fidelity, scheme):
    """Of every method those of SNES, and at each frame those that the coordinates give."""
    slides = scheme == af.dynamics.Conserving()
    model = af.build(ring if slides else glued(ring), fidelity=fidelity)
    given = {"damping": af.Rayleigh(0.05, (8.0, 16.0)), "scheme": scheme, "dt": 0.005}
    record, short = af.Record(every=3, fields_every=15), motion.cut(1.2, 1.5)
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


def test_displacements_of_blocks_against_their_coordinates(model, motion):
    """Rigid blocks have their centroids' displacements as coordinates."""
    damping, record = af.Rayleigh(0.05, (8.0, 16.0)), af.Record(every=50, fields_every=1)
    run = af.time_history(model, motion.cut(1.2, 1.8), dt=0.005, damping=damping, record=record)
    moved = run.dataset["q"].values.reshape(len(run.dataset["q"]), -1, 3)[..., :2]
    far = np.linalg.norm(moved - moved[0], axis=2)
    free = run.dataset.isel(block=list(model.structure.free))
    # the middle of a block is the mean of its corners, not quite its centroid
    assert free["largest_displacement"].values == pytest.approx(far.max(axis=0), rel=2e-2)
    assert free["residual_displacement"].values == pytest.approx(far[-1], rel=5e-2)
    when = run.dataset["frame_time"].values[far.argmax(axis=0)]
    assert free["largest_displacement_time"].values == pytest.approx(when, abs=0.011)
    fixed = run.dataset["largest_displacement"].values[[b.fixed for b in model.structure.blocks]]
    assert (fixed == 0.0).all()


@pytest.fixture(scope="module")
def paced(model, motion):
    """A run whose steps choose their lengths, from 0.1 ms on."""
    return af.time_history(model, motion, damping=af.Rayleigh(0.05, (8.0, 16.0)))


@pytest.mark.slow
def test_mechanisms_too_short_to_count_are_told(paced):
    """By a loop over the record: what counts lasts long enough, and what came before is named."""
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
    assert "what begins at" not in paced.with_criteria(af.Criteria(duration=0.0)).verdict
    for least in (1.01 * first[1], 1.01 * longest):
        strict = paced.with_criteria(af.Criteria(duration=least))
        counts = [time for time, length in runs if length >= least]
        assert (strict.mechanism and strict.mechanism.time) == (counts[0] if counts else None)
        counted = strict.verdict.splitlines()[len(strict.warnings) + 1]
        assert f"begins at {first[0]:.4f} s lasts less than {1e3 * least:.3g} ms, and" in counted
    assert f"4 failed joints at once in rings and piers for {1e3 * least:.3g} ms; what" in counted


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


def test_a_run_in_a_line(run):
    largest = float(np.nanmax(np.abs(run.joints["eccentricity"].values)))
    said = one_line(run.dataset)
    assert f"{len(run.time)} records to {run.time[-1]:.4g} s, |e| ≤ {largest:.3f}; " in said


def test_what_cannot_move_is_only_said_of_a_count_that_nothing_bears_out(run):
    """Where the blocks that move are known, they are named instead."""
    found = replace(run.mechanism, blocks=(2, 3))
    names = [block.name for block in run.structure.blocks]
    told = {"by count": found, "verified": found}
    for line in mechanism_text(run.joints, told, names, told):
        assert "cannot move" not in line
        assert line.endswith(f"; moving: {names[2]}; {names[3]}")
    still = {"by count": run.mechanism}
    (line,) = mechanism_text(run.joints, still, None, still)
    assert "cannot move" not in line
