"""Whole runs: what is recorded, events, interruption, restart, files."""

import os
import signal
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from archfem.errors import DidNotConverge, InvalidInput
from archfem.history import History
from archfem.mechanism import verified_mechanism
from archfem.models.build import build
from archfem.motion import Motion
from archfem.runs import CountedMechanism, Record, last_state, time_history
from archfem.schemes import HHT, Rayleigh
from archfem.statics import dead_load
from archfem.stepping.equation import Equation
from archfem.stepping.exact import Exact
from archfem.stepping.stepper import Stepper
from archfem.summary import pair_table, verdict

DAMPING = Rayleigh(0.05, (8.0, 16.0))


@pytest.fixture(scope="module")
def model(ring):
    return build(ring, fidelity="rigid")


@pytest.fixture(scope="module")
def motion():
    return Motion.synthetic(duration=3.0, pga=6.0, seed=2)


@pytest.fixture(scope="module")
def run(model, motion):
    return time_history(model, motion, damping=DAMPING, record=Record(fields_every=50))


def test_what_is_recorded(run, model, motion):
    assert run.joints["eccentricity"].dims == ("time", "joint")
    assert run.joints.sizes == {"time": 601, "joint": 18}
    assert run.time[-1] == pytest.approx(3.0)
    assert run.dataset["q"].shape == (13, model.size)
    assert run.dataset["ground"].values == pytest.approx(motion.at(run.time))
    assert run.outcome == "reached the end of the motion"
    assert "archfem" in run.dataset.attrs["versions"]
    assert "extrados" in run.dataset.attrs["signs"]


def test_the_first_record_is_the_dead_load(run, model):
    dead = dead_load(model).joints
    assert run.joints["N"][0].values == pytest.approx(dead["N"].values, rel=1e-9)


def test_fields_are_kept_only_on_demand(model, motion):
    short = time_history(model, motion.cut(0.0, 0.5), damping=DAMPING, record=Record(every=10))
    assert "q" not in short.dataset
    assert short.joints.sizes["time"] == 11


def test_every_third_step_is_the_same_run(run, model, motion):
    sparse = time_history(model, motion, damping=DAMPING, record=Record(every=3))
    assert sparse.joints["M"].values == pytest.approx(run.joints["M"].values[::3], abs=1e-6)


def test_an_event_ends_the_run(run, model, motion):
    assert run.mechanism is not None
    halted = time_history(model, motion, damping=DAMPING, until=CountedMechanism())
    assert halted.time[-1] == pytest.approx(run.mechanism.time)
    assert "a mechanism: joints" in halted.outcome
    assert halted.mechanism == run.mechanism


def test_a_run_goes_on_where_it_stopped(run, model, motion):
    first = time_history(model, motion.cut(0.0, 1.5), damping=DAMPING)
    second = time_history(model, motion, damping=DAMPING, start=last_state(first))
    assert second.time[0] == pytest.approx(1.5)
    whole = run.joints["M"].sel(time=slice(1.499, None)).values
    assert second.joints["M"].values == pytest.approx(whole, rel=1e-6, abs=1e-3)


def test_file_and_back(run, tmp_path):
    path = run.save(tmp_path / "deep" / "run.nc")
    again = History.read(path, run.structure)
    assert again.joints["eccentricity"].equals(run.joints["eccentricity"])
    assert again.mechanism == run.mechanism
    with xr.open_dataset(path) as plain:
        assert plain["N"].attrs["units"] == "N"
        assert plain.attrs["outcome"] == run.outcome
    assert [each.name for each in path.parent.iterdir()] == ["run.nc"]


def test_a_history_knows_what_can_move(run, model, motion, tmp_path):
    """The blocks at the counted instant, and the first motion of all: looked for anew."""
    assert run.structure is model.structure
    instant = run.joints.sel(time=run.mechanism.time)
    assert run.mechanism.blocks == verified_mechanism(model.structure, instant).moved.blocks
    assert run.mechanism.blocks == ()  # four hinges, too many of them on one face
    first = int(np.flatnonzero(run.time == run.verified.moved.time)[0])
    before = [
        verified_mechanism(model.structure, run.joints.isel(time=k)).kind
        for k in range(first - 40, first + 1)
    ]
    assert before == ["none"] * 40 + ["local"]
    assert run.verified.moved.blocks
    assert run.verified is run.verified
    calm = time_history(model, motion.scaled(0.1), damping=DAMPING)
    assert calm.verified is None
    assert calm.mechanism is None


def test_a_history_without_its_structure_says_so(run, tmp_path, stack):
    path = run.save(tmp_path / "run.nc")
    alone = History.read(path)
    assert alone.mechanism == replace(run.mechanism, blocks=())
    with pytest.raises(InvalidInput, match=r"History\.read\(path, structure\)"):
        _ = alone.verified
    again = History.read(path, run.structure)
    assert again.verified.moved == run.verified.moved
    with pytest.raises(InvalidInput, match="18 joints from 'joint 0' to 'joint 17'"):
        History.read(path, stack)


def test_a_joint_by_name_or_number(run, model):
    by_name = run.joint("joint 7")
    assert by_name["N"].dims == ("time",)
    assert by_name["N"].equals(run.joints["N"].isel(joint=7))
    assert run.joint(7).identical(by_name)
    assert float(dead_load(model).joint("joint 7")["N"]) == pytest.approx(float(by_name["N"][0]))
    with pytest.raises(InvalidInput, match="no joint 'jiont 7': did you mean 'joint 7'"):
        run.joint("jiont 7")
    with pytest.raises(InvalidInput, match="no joint 18: give a number from 0 to 17"):
        run.joint(18)


def test_verdict_tells_count_and_motion(run, tmp_path):
    counted, moved = verdict(run).splitlines()
    assert f"by count: local mechanism of arch at {run.mechanism.time:.3f} s" in counted
    assert "rings and piers cannot move then" in counted
    assert f"verified: local mechanism of arch at {run.verified.moved.time:.3f} s" in moved
    names = [run.structure.blocks[k].name for k in run.verified.moved.blocks]
    assert f"moving: {names[0]}; " in moved
    assert len(names) <= 8 or f"({len(names)} in all)" in moved
    alone = verdict(History.read(run.save(tmp_path / "run.nc")))
    assert alone == counted.removesuffix("; rings and piers cannot move then")


def test_pair_table_tells_both(run, tmp_path):
    row = pair_table({"pair": run}).splitlines()[1]
    joints = " ".join(map(str, run.mechanism.joints))
    assert f"local  {run.mechanism.time:.3f} s  {joints}" in row
    assert f"local  {run.verified.moved.time:.3f} s" in row.split(joints)[1]
    alone = pair_table({"pair": History.read(run.save(tmp_path / "run.nc"))})
    assert "unknown" in alone


def test_a_failed_write_leaves_the_old_file(run, tmp_path, monkeypatch):
    path = run.save(tmp_path / "run.nc")
    before = path.read_bytes()

    def fail(*_):
        raise OSError("disk full")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(OSError, match="disk full"):
        run.save(path)
    assert path.read_bytes() == before
    assert [each.name for each in tmp_path.iterdir()] == ["run.nc"]


def test_files_that_are_no_history(tmp_path):
    with pytest.raises(InvalidInput, match="no history file"):
        History.read(tmp_path / "none.nc")
    bad = tmp_path / "bad.nc"
    bad.write_text("nothing")
    with pytest.raises(InvalidInput, match="not a NetCDF file"):
        History.read(bad)
    other = tmp_path / "other.nc"
    xr.Dataset({"N": ("x", [1.0])}).to_netcdf(other)
    with pytest.raises(InvalidInput, match="not a time history"):
        History.read(other)


def test_ctrl_c_keeps_what_was_computed(model, motion):
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # may be ignored here
    seen = []

    def press(structure, resultants):
        seen.append(resultants)
        if len(seen) == 300:
            os.kill(os.getpid(), signal.SIGINT)

    try:
        run = time_history(model, motion, damping=DAMPING, until=press)
    finally:
        signal.signal(signal.SIGINT, before)
    assert "interrupted at" in run.outcome
    assert 0.5 < run.time[-1] < 1.6
    assert run.joints["N"].notnull().all()


def breaking(model, motion, breaks):
    """A stepper whose attempts fail where `breaks(time, dt)` says so."""
    equation = Equation(model, motion, DAMPING)
    real = Exact(equation)

    def attempt(state, dt):
        if breaks(state.time, dt):
            raise DidNotConverge("made to fail")
        return real.attempt(state, dt)

    return Stepper(equation, exact=Exact(equation, attempts=attempt))


def test_a_failure_carries_the_history(model, motion):
    stepper = breaking(model, motion, lambda time, _: time > 0.2)
    with pytest.raises(DidNotConverge, match="made to fail") as caught:
        time_history(model, motion, method=stepper)
    assert caught.value.history.time[-1] == pytest.approx(0.205, abs=0.006)
    assert caught.value.last.time == pytest.approx(0.205, abs=0.006)
    assert "failed at" in caught.value.history.outcome


def test_a_step_that_fails_is_halved(model, motion):
    short = motion.cut(0.0, 0.4)
    stepper = breaking(model, short, lambda time, dt: 0.2 < time < 0.21 and dt > 0.002)
    found = time_history(model, short, method=stepper)
    smallest = found.dataset["smallest_step"].values
    assert smallest.min() == pytest.approx(0.00125)
    assert found.time[-1] == pytest.approx(0.4)


def test_hht_damps_less_than_it_changes(model, motion):
    """At α = -0.05 the largest eccentricity stays within 5 % of average acceleration's."""
    weak = motion.scaled(0.3)
    peaks = [
        float(
            abs(time_history(model, weak, damping=DAMPING, scheme=s).joints["eccentricity"]).max()
        )
        for s in (None, HHT(-0.05))
    ]
    assert peaks[0] == pytest.approx(peaks[1], rel=0.05)


def test_refusals(model, motion):
    with pytest.raises(InvalidInput, match=r"dt 0\.5 s"):
        time_history(model, motion, dt=0.5)
    with pytest.raises(InvalidInput, match="record every = 0"):
        Record(every=0)
