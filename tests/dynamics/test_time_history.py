"""Whole runs: what is recorded, events, interruption, restart, files."""

import os
import signal
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from archfem.cases.summary import joint_table, pair_table, verdict
from archfem.dynamics.events import CountedMechanism, EveryMechanism, MovingMechanism
from archfem.dynamics.history import Ending, History
from archfem.dynamics.ladder import build
from archfem.dynamics.schemes import HHT, Rayleigh
from archfem.dynamics.stepping.equation import Equation
from archfem.dynamics.stepping.exact import Exact
from archfem.dynamics.stepping.stepper import Stepper
from archfem.dynamics.time_history import Record, last_state, time_history
from archfem.dynamics.verdicts import first_mechanisms
from archfem.errors import DidNotConverge, InvalidInput
from archfem.joints.criteria import Criteria
from archfem.limit.verified import first_verified_mechanism, verified_mechanism
from archfem.models.model import Prediction
from archfem.motion.motion import Motion
from archfem.statics.equilibrium import dead_load

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


def test_a_model_knows_what_was_predicted_of_it(model):
    foreseen = Prediction(error=0.003, tolerance=0.005, dt=0.0025, considered=())
    chosen = model.predicted(foreseen)
    assert (chosen.prediction, model.prediction) == (foreseen, None)
    assert chosen.moved(chosen.supports).prediction == foreseen
    short = time_history(chosen, Motion.synthetic(duration=0.25, seed=2))
    assert np.diff(short.time) == pytest.approx(0.0025)
    assert short.dataset.attrs["predicted_error"] == 0.003


def test_what_is_recorded(run, model, motion):
    assert run.joints["eccentricity"].dims == ("time", "joint")
    assert run.joints.sizes == {"time": 601, "joint": 18}
    assert run.time[-1] == pytest.approx(3.0)
    assert run.dataset["q"].shape == (13, model.size)
    assert run.dataset["ground"].values == pytest.approx(motion.at(run.time))
    assert run.outcome == "reached the end of the motion"
    assert run.ended is Ending.FINISHED
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


LOOSE = Criteria(hinge=0.38)


@pytest.fixture(scope="module")
def weak(motion):
    """A motion under which joints hinge by |e| of 0.38, and never four by 0.46."""
    return motion.scaled(0.6)


@pytest.mark.parametrize("event", [CountedMechanism(limit=0.38), CountedMechanism(criteria=LOOSE)])
def test_criteria_of_the_event_are_those_of_the_run(model, weak, event):
    assert time_history(model, weak, damping=DAMPING).mechanism is None
    halted = time_history(model, weak, damping=DAMPING, until=event)
    assert halted.ended is Ending.EVENT
    assert halted.criteria == LOOSE
    assert halted.mechanism.time == halted.time[-1]


@pytest.mark.parametrize("event", [CountedMechanism(), MovingMechanism()])
def test_an_event_obeys_the_criteria_of_the_run(model, motion, event):
    criteria = Criteria(hinge=0.42, friction=0.4)
    whole = time_history(model, motion, damping=DAMPING, criteria=criteria)
    halted = time_history(model, motion, damping=DAMPING, criteria=criteria, until=event)
    found = whole.mechanism if event == CountedMechanism() else whole.verified.moved
    assert halted.time[-1] == found.time
    ended_by = halted.mechanism if event == CountedMechanism() else halted.verified.moved
    assert ended_by == found


def test_criteria_of_run_and_event_must_be_the_same(model, motion):
    given = {"damping": DAMPING, "criteria": Criteria(hinge=0.4)}
    with pytest.raises(InvalidInput, match=r"hinge=0\.4.*hinge=0\.38.*to the run alone"):
        time_history(model, motion, until=CountedMechanism(limit=0.38), **given)
    short = motion.cut(0.0, 0.5)
    same = time_history(model, short, until=CountedMechanism(limit=0.4), **given)
    assert same.criteria == given["criteria"]


@pytest.mark.parametrize("every", [1, 7, 100])
def test_the_step_that_ends_a_run_is_kept(model, motion, every):
    record = Record(every=every)
    halted = time_history(
        model, motion, damping=DAMPING, record=record, until=CountedMechanism(), dt=0.0049
    )
    assert halted.mechanism.time == halted.time[-1] == halted.dataset.attrs["last_time"]


@pytest.mark.parametrize("event", [EveryMechanism(), CountedMechanism(), MovingMechanism()])
def test_an_event_begins_afresh_in_each_run(model, motion, event):
    first, second = (time_history(model, motion, damping=DAMPING, until=event) for _ in range(2))
    assert first.ended is second.ended is Ending.EVENT
    assert first.outcome == second.outcome
    assert first.time[-1] == second.time[-1]


def test_everything_said_of_a_run_obeys_its_criteria(run, model, tmp_path):
    loose = run.judged_by(Criteria(hinge=0.3, failures=5))
    assert loose.mechanism.time < run.mechanism.time
    assert len(loose.mechanism.joints) >= 5
    assert loose.verified.moved.time < run.verified.moved.time
    found = first_mechanisms(loose)
    assert found == first_mechanisms(run, loose.criteria)
    assert found["any four joints"] == replace(loose.mechanism, blocks=())
    assert joint_table(loose.joints) != joint_table(run.joints)
    again = History.read(loose.save(tmp_path / "run.nc"), model.structure)
    assert again.criteria == loose.criteria
    assert again.mechanism == loose.mechanism
    assert run.criteria == Criteria()
    calm = loose.judged_by(Criteria(failures=18))
    assert verdict(calm).startswith("no mechanism by count: never 18 failed joints at once")


def test_flags_are_in_the_file_for_plain_xarray(run, tmp_path):
    with xr.open_dataset(run.save(tmp_path / "run.nc")) as plain:
        assert plain["slide"].dtype == plain["open"].dtype == plain["judged"].dtype == bool
        assert plain["hinge"].dtype == np.int8
        assert plain["hinge"].equals(run.joints["hinge"])
        assert plain.attrs["criteria_hinge"] == 0.46
        assert plain.attrs["ended"] == "finished"


def test_a_file_of_an_earlier_version(run, tmp_path):
    """It is judged by the usual criteria, and tells only in words how its run ended."""
    old = run.dataset.drop_vars(["hinge", "slide", "open", "judged"])
    old.attrs = {
        key: value
        for key, value in old.attrs.items()
        if key != "ended" and not key.startswith("criteria_")
    }
    read = History.read(History(old).save(tmp_path / "old.nc"), run.structure)
    assert read.mechanism == run.mechanism
    assert first_verified_mechanism(run.structure, read.joints).moved == run.verified.moved
    with pytest.raises(InvalidInput, match=r"only in words .* 'reached the end of the motion'"):
        _ = read.ended


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
    assert run.ended is Ending.INTERRUPTED
    assert not run.ended.by_itself
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
    assert caught.value.history.ended is Ending.FAILED


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
