"""Histories: files, criteria, first mechanisms, and displacements of corners."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import xarray as xr

import archfem as af
from archfem.dynamics import CollapseState, History, first_mechanisms, partial_history
from archfem.dynamics.history import LOOSE_BLOCKS, MEETING_REMEDY, with_fall
from archfem.dynamics.recorder import corner_displacements

DAMPING = af.Rayleigh(0.05, (8.0, 16.0))


def test_all_findings_of_a_run_follow_its_criteria(run, model, tmp_path):
    loose = run.with_criteria(af.Criteria(hinge=0.3, failures=5))
    assert loose.mechanism.time < run.mechanism.time
    assert len(loose.mechanism.joints) >= 5
    assert loose.verified.moved.time < run.verified.moved.time
    again = History.read(loose.save(tmp_path / "run.nc"), model.structure)
    assert again.criteria == loose.criteria
    assert again.mechanism == loose.mechanism
    assert run.criteria == af.Criteria()


def test_flags_are_in_the_file_for_plain_xarray(run, tmp_path):
    with xr.open_dataset(run.save(tmp_path / "run.nc")) as plain:
        assert plain["slide"].dtype == plain["open"].dtype == plain["judged"].dtype == bool
        assert plain["hinge"].dtype == np.int8
        assert plain["hinge"].equals(run.joints["hinge"])
        assert plain.attrs["criteria_hinge"] == 0.46
        assert plain.attrs["ended"] == "finished"


def test_file_and_back(run, tmp_path):
    path = run.save(tmp_path / "deep" / "run.nc")
    again = History.read(path, run.structure)
    # single precision has 24 bits
    xr.testing.assert_allclose(again.joints, run.joints, rtol=2.0**-24, atol=1e-37)
    assert again.joints["N"].dtype == np.float64
    for flag in ("hinge", "slide", "open", "judged"):
        assert again.joints[flag].equals(run.joints[flag])
    assert again.dataset["last_q"].equals(run.dataset["last_q"])
    assert again.mechanism == run.mechanism
    # a history that was read is written unchanged
    twice = History.read(again.save(tmp_path / "twice.nc"), run.structure)
    assert twice.dataset.identical(again.dataset)
    with xr.open_dataset(path) as plain:
        assert plain["N"].attrs["units"] == "N"
        assert plain.attrs["outcome"] == run.outcome
    assert [each.name for each in path.parent.iterdir()] == ["run.nc"]


@pytest.mark.slow
def test_file_of_a_bridge_whose_fill_lies_on_chords(tmp_path):
    arch = af.shapes.Arch(span=4.0, rise=1.6, thickness=0.3, voussoirs=5)
    bridge = af.bridge(arches=[arch], backfill=af.shapes.Backfill(cover=0.5), chords=2)
    motion = af.Motion(np.full(4, 0.1), dt=0.001)
    run = af.Analysis(bridge, fidelity="rigid", damping=DAMPING, dt=0.001).run(motion)
    again = History.read(run.save(tmp_path / "run.nc"), bridge)
    assert np.unique(again.joints["face"]).size == 6 + 5 < len(bridge.joints)


def test_arrays_over_time_and_joint_are_packed(run, tmp_path):
    with xr.open_dataset(run.save(tmp_path / "run.nc")) as plain:
        assert plain["N"].ndim == 2
        assert plain["N"].encoding["zlib"]
        assert not plain["time"].encoding["zlib"]


def test_a_history_has_the_blocks_that_can_move(run, model, motion, tmp_path):
    """The blocks at the counted instant, and the first motion of all: looked for anew."""
    assert run.structure is model.structure
    instant = run.joints.sel(time=run.mechanism.time)
    assert run.mechanism.blocks == af.verified_mechanism(model.structure, instant).moved.blocks
    assert run.mechanism.blocks == ()  # four hinges, too many of them on one face
    first = int(np.flatnonzero(run.time == run.verified.moved.time)[0])
    before = [
        af.verified_mechanism(model.structure, run.joints.isel(time=k)).kind
        for k in range(first - 40, first + 1)
    ]
    assert before == ["none"] * 40 + ["local"]
    assert run.verified.moved.blocks
    assert run.verified is run.verified
    calm = af.time_history(model, motion.scaled(0.1), dt=0.005, damping=DAMPING)
    assert calm.verified is None
    assert calm.mechanism is None


def test_a_history_without_its_structure_is_refused_with_the_reason(run, tmp_path, stack):
    path = run.save(tmp_path / "run.nc")
    alone = History.read(path)
    assert alone.mechanism == replace(run.mechanism, blocks=())
    with pytest.raises(af.InvalidInput, match=r"History\.read\(path, structure\)"):
        _ = alone.verified
    again = History.read(path, run.structure)
    assert again.verified.moved == run.verified.moved
    with pytest.raises(af.InvalidInput, match="18 joints from 'joint 0' to 'joint 17'"):
        History.read(path, stack)


def test_a_joint_by_name_or_number(run, model):
    by_name = run.joint("joint 7")
    assert by_name["N"].dims == ("time",)
    assert by_name["N"].equals(run.joints["N"].isel(joint=7))
    assert run.joint(7).identical(by_name)
    assert float(af.dead_load(model).joint("joint 7")["N"]) == pytest.approx(float(by_name["N"][0]))
    with pytest.raises(af.InvalidInput, match="no joint 'jiont 7': did you mean 'joint 7'"):
        run.joint("jiont 7")
    with pytest.raises(af.InvalidInput, match="no joint 18: give a number from 0 to 17"):
        run.joint(18)


def test_a_failed_write_leaves_the_old_file(run, tmp_path):
    path = run.save(tmp_path / "run.nc")
    before = path.read_bytes()
    unknown = History(run.dataset.assign_attrs(thing=object()))
    with pytest.raises(TypeError, match=r"attribute b?'thing'"):
        unknown.save(path)
    assert path.read_bytes() == before
    assert [each.name for each in tmp_path.iterdir()] == ["run.nc"]


def test_files_that_are_no_history(tmp_path):
    with pytest.raises(af.InvalidInput, match="no history file"):
        History.read(tmp_path / "none.nc")
    bad = tmp_path / "bad.nc"
    bad.write_text("nothing")
    with pytest.raises(af.InvalidInput, match="not a NetCDF file"):
        History.read(bad)
    other = tmp_path / "other.nc"
    xr.Dataset({"N": ("x", [1.0])}).to_netcdf(other)
    with pytest.raises(af.InvalidInput, match="written by another version of archfem"):
        History.read(other)


def test_the_history_that_a_failure_carries(run):
    assert partial_history(af.DidNotConverge("failed", history=run)) is run
    early = af.DidNotConverge("failed before the first step")
    with pytest.raises(af.DidNotConverge, match="before the first step") as caught:
        partial_history(early)
    assert caught.value is early


@pytest.mark.parametrize(("held", "counts"), [(2, False), (9, False), (10, True)])
def test_a_mechanism_counts_from_a_millisecond_on_and_is_known_before(ring, held, counts):
    """Four joints that slide for some records of a tenth of a millisecond."""
    resultants = np.zeros((40, 18, 3))
    resultants[..., 0] = 1000.0
    resultants[5 : 5 + held, [0, 6, 12, 17], 1] = 700.0
    run = af.History(af.joints.joint_dataset(ring, resultants, 1e-4 * np.arange(40.0)))
    brief = "what begins at 0.0005 s lasts less than 1 ms, and does not count"
    assert (run.verdict.mechanisms["any joints at once"] is not None) is counts
    assert (brief in str(run.verdict)) is not counts
    longer = af.History(af.joints.joint_dataset(ring, resultants, 1e-3 * np.arange(40.0)))
    assert "does not count" not in str(longer.verdict)
    uneven = np.concatenate([1e-4 * np.arange(20.0), 2e-3 + 1e-2 * np.arange(20.0)])
    some = af.History(af.joints.joint_dataset(ring, resultants, uneven))
    assert (brief in str(some.verdict)) is not counts


def test_corners_of_a_rigid_block_move_with_it():
    """A column of one stone: translation and a small turn about its centroid, by hand."""
    model = af.build(af.column(breadth=0.4, heights=[0.8]), fidelity="rigid")
    found = corner_displacements(model, np.array([[0.0, 0.0, 0.0], [0.01, -0.02, 0.003]]))
    x, y = found["corner_x"].values, found["corner_y"].values
    u = found["displacement"].values
    assert sorted(set(np.round(x, 9))) == [-0.2, 0.2]
    assert not u[0].any()
    centre = model.structure.blocks[model.structure.free[0]].centroid
    expected = [0.01 - 0.003 * (y - centre[1]), -0.02 + 0.003 * (x - centre[0])]
    np.testing.assert_allclose(u[1].T, expected, atol=1e-12)


def test_ratios_beyond_single_precision_are_infinite(run, tmp_path):
    huge = run.dataset.assign(friction=run.dataset["friction"] * 0.0 + 1e300)
    again = History.read(History(huge).save(tmp_path / "huge.nc"))
    assert np.isinf(again.joints["friction"].values[np.isfinite(huge["friction"].values)]).all()


def test_a_run_gives_displacements_over_time_point_and_direction(tmp_path):
    model = af.build(af.column(breadth=0.4, heights=[0.8, 0.8]), fidelity="rigid")
    motion = af.Motion(np.full(21, 0.5), 0.005)
    run = af.time_history(model, motion, dt=0.005, record=af.Record(fields_every=5))
    moved = run.displacement
    assert moved.dims == ("time", "point", "xy")
    assert moved.attrs["units"] == "m"
    np.testing.assert_array_equal(moved["time"], run.dataset["frame_time"])
    top = moved.where(moved["block"] == model.structure.blocks[-1].name, drop=True).sel(xy="x")
    assert top.sizes["point"] == 4
    assert float(top[-1].max()) < 0.0  # the ground moves right, relative to it all moves left
    read = af.History.read(run.save(tmp_path / "run.nc"))
    np.testing.assert_array_equal(read.displacement, moved)


def test_a_run_without_fields_is_refused_with_the_option_that_keeps_them():
    model = af.build(af.column(breadth=0.4, heights=[0.8]), fidelity="rigid")
    run = af.time_history(model, af.Motion([0.0, 0.1, 0.0], 0.01), dt=0.005)
    with pytest.raises(af.InvalidInput, match="fields_every=10"):
        _ = run.displacement


def test_definitions_obey_the_criteria_of_the_run(run):
    loose = run.with_criteria(af.Criteria(hinge=0.3, failures=5))
    found = first_mechanisms(loose)
    assert found == first_mechanisms(run, loose.criteria)
    assert found["any joints at once"] == replace(loose.mechanism, blocks=())


# What a file may have in an attribute of a history, of which archfem writes none
WRONG_ATTRIBUTES = {
    "ended": ("halted", 1, np.array([1.0, 2.0])),
    "fall": ("wobbles", 2.0),
    "displacements": ("huge", 0),
    "displacement": ("1 mm", "0.001", np.array([1.0, 2.0])),
    "halved_steps": (np.nan, "many"),
    "criteria_failures": (4.5, "four"),
    "criteria_hinge": ("always",),
    "pga": ("strong",),
    "structure": (np.array([1.0, 2.0]),),
}


@pytest.fixture(scope="module")
def few_instants(run):
    """Data of the first instants alone: a file is written and read in a fraction of the time."""
    return run.dataset.isel(time=slice(0, 8))


@pytest.mark.parametrize("name", WRONG_ATTRIBUTES)
def test_attributes_that_no_run_has_are_refused_by_name(
    name, few_instants, run, tmp_path, monkeypatch
):
    """Whoever changes a file can seal it again. The first value is read from a file."""
    fall = {"fall": "stands", "fall_time": np.nan, "fall_blocks": ""}
    whole = few_instants.assign_attrs(fall, fall_residual=0.0, fall_resting=1, fall_loose_share=0.0)
    path = tmp_path / "run.nc"
    refused = partial(
        pytest.raises, af.InvalidInput, match=f"lacks attribute {name}, or has something else"
    )
    first, *others = WRONG_ATTRIBUTES[name]
    History(whole.assign_attrs({name: first})).save(path)
    with refused():
        History.read(path, run.structure)
    for value in others:
        changed = whole.assign_attrs({name: value})
        monkeypatch.setattr("archfem.dynamics.history.read_dataset", lambda *_, c=changed: c)
        with refused():
            History.read(path, run.structure)
    monkeypatch.setattr("archfem.dynamics.history.read_dataset", lambda *_: whole)
    assert History.read(path, run.structure).fall.kind == "stands"


@pytest.mark.slow
def test_variables_that_no_run_has_are_refused_by_name(few_instants, run, tmp_path):
    History.read(History(few_instants).save(tmp_path / "run.nc"), run.structure)
    changed = {
        "N": few_instants["N"].T,
        "V": few_instants["V"].astype("S1"),
        "part": few_instants["part"][0],
        "rotation": few_instants["rotation"].astype("S1"),
    }
    for name in ["M", "time", "slip", "open", "role", "cohesion_limit", *changed]:
        dataset = few_instants.drop_vars(name)
        if name in changed:
            dataset = few_instants.assign({name: changed[name].variable})
        path = History(dataset).save(tmp_path / "run.nc")
        with pytest.raises(af.InvalidInput, match=f"lacks {name}, or has"):
            History.read(path, run.structure)


@pytest.mark.parametrize(
    ("ended", "kind", "share", "doubted"),
    [
        ("met", "stands", 0.06, True),
        ("met", "stands", 0.04, False),  # strong motion ends at 95 % of the Arias intensity
        ("parted", "dislocated", 0.06, True),
        ("parted", "partly fallen", 0.9, False),
        ("met", "fallen", 0.9, False),
    ],
)
def test_blocks_that_were_loose_in_strong_motion_and_did_not_fall_are_in_doubt(
    ended, kind, share, doubted, run
):
    fall = CollapseState(kind, None, (), 0.0, 0.0, True, loose_share=share)
    outcome = "went on with loose blocks from 1 s on, due to stones meeting: 'a' met 'b'"
    dataset = run.dataset.assign_attrs(ended=ended, outcome=outcome, displacement=0.0)
    loose = with_fall(History(dataset, run.structure), fall)
    found = [doubt for doubt in loose.doubts if doubt.words == LOOSE_BLOCKS]
    assert len(found) == doubted
    for doubt in found:
        assert doubt.example == "'a' met 'b'"
        assert doubt.values == (run.time[-1], share)
        assert (doubt.remedy == MEETING_REMEDY) == (ended == "met")
    until = f" until {run.time[-1]:.2f} s"
    assert loose.verdict.until == until
    assert (f"(with joints{until})" in str(loose.verdict)) == doubted
    assert loose.with_doubts(loose.doubts).doubts == loose.doubts  # is not stored


@pytest.mark.parametrize("ended", ["interrupted", "failed"])
def test_a_run_that_was_broken_off_is_in_doubt(ended, run):
    assert run.doubts == History(run.dataset.assign_attrs(ended="finished"), run.structure).doubts
    dataset = run.dataset.assign_attrs(ended=ended, outcome=f"{ended} at 1.5 s: no equilibrium")
    broken = History(dataset, run.structure)
    (doubt,) = set(broken.doubts) - set(run.doubts)
    assert doubt.cause == f"the run {ended} at 1.5 s, and what comes after is not known"
    assert "range not computed" not in broken.verdict.headline
    assert broken.with_doubts(broken.doubts).doubts == broken.doubts  # is not stored
