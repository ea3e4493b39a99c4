"""The recorder of a run: quantities, and their frequency."""

import subprocess
import sys

import numpy as np
import pytest

import archfem as af
from archfem.cases.result_text import tabulate_runs
from archfem.dynamics.monitor import RunMonitor
from archfem.dynamics.recorder import GrowingArray, Recorder, doubt_drift

DAMPING = af.Rayleigh(0.05, (8.0, 16.0))
MOTION = af.Motion.synthetic(duration=4.0, pga=2.0, seed=3)


def test_batches_of_any_length_follow_one_another():
    rows, whole = np.arange(60.0).reshape(20, 3), GrowingArray()
    for start, end in ((0, 1), (1, 2), (2, 9), (9, 9), (9, 20)):
        whole.add(rows[start:end])
        assert np.array_equal(whole.rows, rows[:end])


MEMORY = """
import resource, sys
import archfem as af
from archfem import _petsc  # as in a run whose modes are computed

ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
model = af.build(ring, fidelity="rigid", displacements="large")
motion = af.Motion.synthetic(duration=float(sys.argv[1]), pga=3.0, seed=3)
run = af.time_history(model, motion, dt=0.002, damping=af.StiffnessDamping(0.05, 8.0))
run.save(sys.argv[2])
structure, size = run.structure, run.joints["N"].size
del run
str(af.History.read(sys.argv[2], structure).verdict)
print(size, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.slow
def test_a_long_run_needs_little_more_memory_than_its_record(tmp_path):
    """A joint and step has 8 numbers of 8 bytes: 64 bytes, and 25 in the file while it is written.

    The bound leaves room for temporaries; with copies of the record it was 240.
    """
    measured = []
    for duration in (10.0, 200.0):
        command = [sys.executable, "-c", MEMORY, str(duration), str(tmp_path / "run.nc")]
        text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        measured.append([int(word) for word in text.split()])
    (size, peak), (long_size, long_peak) = measured
    assert long_size - size == 95_000 * 18
    assert 1024 * (long_peak - peak) / (long_size - size) < 140


@pytest.mark.parametrize(("steps", "peaks"), [(6, (3.0, 1.0)), (2, (2.0, 0.5))])
def test_peaks_of_the_ground_between_the_steps_are_recorded(steps, peaks):
    """Samples of 5 ms; steps of 20 ms, of which the second or sixth ends the run, beside peaks."""
    level, up = np.zeros((2, 25))
    level[[2, 14]], up[[3, 10]] = (2.0, -3.0), (0.5, 1.0)
    model = af.build(af.column(breadth=0.6, heights=[1.0]), fidelity="rigid")
    ends = iter([None] * (steps - 1) + ["enough"])
    motion = af.Motion(level, 0.005, up)
    run = af.time_history(model, motion, dt=0.02, until=lambda *_: next(ends))
    assert run.time[-1] == pytest.approx(0.02 * steps)
    assert run.dataset["ground"].values[:, 0] == pytest.approx(0.0)
    assert run.dataset["ground"].attrs["peaks"] == pytest.approx(peaks)
    (row, _) = tabulate_runs({"spikes": run}).rows
    until = f" until {run.time[-1]:.2f} s"
    assert row[3:5] == [f"{peaks[0]:.2f} m/s²{until}", f"{peaks[1]:.2f} m/s²"]


def test_a_record_that_drifts_is_doubted_and_its_remedy_helps(tmp_path):
    """An offset of 0.5 m/s² pushes a column; by hand it is the mean acceleration of the record.

    Corrected, the largest displacement is that without offset, as the synthetic record itself has
    no part of the polynomial; the file's 18 digits leave far less than 1e-6.
    """
    column = af.column(breadth=0.6, heights=[1.2, 1.2])
    model, damping = af.build(column, fidelity="rigid"), af.StiffnessDamping(0.05, 10.0)
    ground, moved = af.Motion.synthetic(duration=6.0, pga=1.5, seed=1, vertical_ratio=0.0), {}
    for name, offset in (("clean", 0.0), ("drifts", -0.5)):
        rows = np.column_stack([ground.times(), ground.horizontal + offset])
        np.savetxt(tmp_path / f"{name}.csv", rows, delimiter=",", header="Time (s),Acc (m/s2)")
        motion = af.Motion.read(tmp_path / f"{name}.csv")
        for key, each in ((name, motion), ("corrected", motion.baseline_corrected())):
            moved[key] = af.time_history(model, each, dt=0.005, damping=damping)
        (*doubts,) = doubt_drift(motion.with_rest(5.0).scaled(1.7))  # both leave the share
        assert doubts == [x for x in moved[name].doubts if "drifts" in x.words]
        assert len(doubts) == (name == "drifts")
    share = 0.5 / abs(ground.horizontal - 0.5).max()
    assert doubts[0].values == ("horizontal", pytest.approx(share, rel=0.01))
    sizes = {key: run.verdict.displacement for key, run in moved.items()}
    assert sizes["corrected"] == pytest.approx(sizes["clean"], rel=1e-6)
    assert sizes["drifts"] > 1.5 * sizes["clean"]
    assert not any("drifts" in each.words for each in moved["corrected"].doubts)


@pytest.mark.parametrize("component", ["horizontal", "vertical"])
def test_only_drift_of_records_that_pushes_is_doubted(component):
    """Whole sines in 10 s with an offset: by hand the offset over the peak, from 1 % on."""
    wave = np.sin(2.0 * np.pi * np.arange(2001) * 0.005)

    def record(offset, **options):
        rows = {"horizontal": wave, "vertical": wave} | {component: wave + offset}
        return af.Motion(dt=0.005, **rows, **options)

    (doubt,) = doubt_drift(record(0.02, recorded=True))
    assert doubt.values == (component, pytest.approx(0.02 / 1.02, rel=0.01))
    assert not list(doubt_drift(record(0.009, recorded=True)))
    assert not list(doubt_drift(record(0.02)))
    assert not list(doubt_drift(af.Motion.held(push=2.0)))
    synthetic = af.Motion(wave, 0.005).with_vertical(record(0.02, recorded=True))
    assert bool(list(doubt_drift(synthetic))) == (component == "vertical")


def test_recorded_quantities_have_their_dimensions_and_values(run, model, motion):
    assert run.joints["eccentricity"].dims == ("time", "joint")
    assert run.joints.sizes == {"time": 601, "joint": 18}
    assert run.time[-1] == pytest.approx(3.0)
    assert run.dataset["q"].shape == (13, model.size)
    assert run.dataset["ground"].values == pytest.approx(motion.at(run.time))
    assert run.outcome == "reached the end of the motion"
    assert run.ending is af.dynamics.Ending.FINISHED
    assert "archfem" in run.dataset.attrs["versions"]
    assert "extrados" in run.dataset.attrs["signs"]


def test_the_first_record_is_the_dead_load(run, model):
    dead = af.dead_load(model).joints
    assert run.joints["N"][0].values == pytest.approx(dead["N"].values, rel=1e-9)


def test_fields_are_kept_only_on_demand(model, motion):
    short = af.time_history(
        model, motion.cut(0.0, 0.5), dt=0.005, damping=DAMPING, record=af.Record(every=10)
    )
    assert "q" not in short.dataset
    assert short.joints.sizes["time"] == 11


def test_every_third_step_is_the_same_run(run, model, motion):
    sparse = af.time_history(model, motion, dt=0.005, damping=DAMPING, record=af.Record(every=3))
    assert sparse.joints["M"].values == pytest.approx(run.joints["M"].values[::3], abs=1e-6)


@pytest.mark.parametrize("every", [1, 7, 100])
def test_the_step_that_ends_a_run_is_kept(model, motion, every):
    record = af.Record(every=every)
    halted = af.time_history(
        model, motion, damping=DAMPING, record=record, until=af.CountedMechanism(), dt=0.0049
    )
    assert halted.mechanism.time == halted.time[-1] == halted.dataset.attrs["last_time"]


def test_effort_between_records_is_kept(model):
    every = af.time_history(model, MOTION, dt=0.005, damping=DAMPING)
    third = af.time_history(model, MOTION, dt=0.005, damping=DAMPING, record=af.Record(every=4))
    assert third.dataset["iterations"].sum() == every.dataset["iterations"].sum()
    drift = every.dataset["energy_drift"].values[::4]
    assert third.dataset["energy_drift"].values == pytest.approx(drift, rel=1e-12)


def test_ctrl_c_amid_a_batch_leaves_whole_records(model, motion):
    """It arrives when the coordinates of the third step are read."""
    start = af.dynamics.Equation(model, motion).at_rest(af.dead_load(model).q)
    record = af.Record(fields_every=1)

    def batch(times, state):
        resultants = np.ones((len(times), len(model.structure.joints), 3))
        energy = np.zeros((len(times), 4))
        ones = np.ones(len(times), dtype=np.int64)
        readings = np.array([model.observer().read(start.q)] * len(times))
        return af.dynamics.Batch(
            times, resultants, ones, 0.005 * ones, energy, state, readings=readings
        )

    def pressed(k):
        if k == 2:
            raise KeyboardInterrupt
        return start

    first = batch(np.zeros(1), lambda _: start)
    guard = RunMonitor(model, first)
    recorder = Recorder(guard, start, "by hand", 0.005, record, af.Criteria())
    recorder.add(first)
    with pytest.raises(KeyboardInterrupt):
        recorder.add(batch(0.005 * np.arange(1.0, 5.0), pressed))
    kept = recorder.build_history(motion, af.dynamics.Ending.INTERRUPTED, "by hand").dataset
    assert kept["frame_time"].values == pytest.approx([0.0, 0.005, 0.01])
    assert kept["q"].shape == (3, model.size)
    assert kept["N"].notnull().all()
    assert kept.sizes["time"] == 5
