"""Data of the player are those of the history."""

import json

import numpy as np
import pytest
from pages import unpack

import archfem as af
from archfem.view.pages.player_data import Outlines, Scene


def arrays(scene):
    data = json.loads(scene.text)
    return data, unpack(data["pack"], data["bytes"])


def test_a_page_holds_the_history_to_its_quantum(rocked):
    model, run = rocked
    data, found = arrays(Scene(model.structure, run, model))
    quantum = {each["name"]: 0.501 * each["quantum"] for each in data["pack"]}
    names = {"e": "eccentricity", "ratio": "friction", "normal": "N", "opening": "opening"}
    for name, key in names.items():
        values = run.joints[key].values.T
        values = np.minimum(values, data["most"]) if name == "ratio" else values
        assert np.array_equal(np.isnan(found[name]), np.isnan(values))
        assert np.nanmax(np.abs(found[name] - values)) <= quantum[name]
    assert np.abs(found["time"][0] - run.time).max() <= quantum["time"]
    assert np.abs(found["ground"].T - run.dataset["ground"].values).max() <= quantum["ground"]
    hinge = (found["flags"].astype(int) & 3) - 1
    assert np.array_equal(hinge, run.joints["hinge"].values.T)
    turned = run.joints["rotation"].values > 0.0
    bits = {4: run.joints["slide"], 8: run.joints["open"], 16: run.joints["V"] > 0.0, 32: turned}
    for bit, state in bits.items():
        assert np.array_equal(found["flags"].astype(int) & bit > 0, np.asarray(state).T)
    moved = Outlines(model.structure).displacements(model, run.dataset["q"].values)
    rows = moved.reshape(len(moved), -1).T
    assert np.abs(found["frame_points"] - rows).max() <= quantum["frame_points"]
    assert np.allclose(found["frame_time"][0], run.dataset["frame_time"].values, atol=1e-6)
    assert (data["every"], data["note"], data["loose"]) == (1, "", None)


def test_points_of_the_thrust_line_are_those_of_the_history(rocked):
    """On the line through both ends of a joint, at 1/2 + e of the way."""
    model, run = rocked
    data, found = arrays(Scene(model.structure, run, model))
    ends = np.array([joint["ends"] for joint in data["joints"]])
    share = 0.5 + found["e"][:, 0, None]
    line = (1.0 - share) * ends[:, 0] + share * ends[:, 1]
    rest = run.joints.isel(time=0)
    assert np.allclose(line, af.joints.thrust_line(model.structure, rest).values, atol=1e-3)


def test_where_there_is_little_room_steps_are_left_out(rocked):
    model, run = rocked
    room = len(Scene(model.structure, run, model).packed[0].text) * 2 // 3
    data, found = arrays(Scene(model.structure, run, model, max_bytes=room))
    assert data["every"] > 1
    assert len(data["bytes"]) <= room
    assert found["time"][0, -1] == pytest.approx(run.time[-1], abs=1e-6)
    assert np.abs(found["time"][0] - data["still"]).min() < 1e-5


def test_frames_are_those_that_differ_for_the_eye(stack):
    """Of 200 fields a second 40 are kept, and the last."""
    model = af.build(stack, fidelity="rigid")
    motion = af.Motion.synthetic(seed=1, duration=0.32, pga=6.0)
    run = af.time_history(model, motion, dt=0.005, record=af.Record(fields_every=1))
    times = Scene(model.structure, run, model).moved[0]
    assert np.diff(times)[:-1] == pytest.approx(0.025)
    assert times[[0, -1]] == pytest.approx(run.time[[0, -1]])


def test_the_joint_shown_at_first_is_the_most_eccentric_of_that_instant(stack):
    """Another one has the largest |e| of the run, before or after what is shown."""
    model = af.build(stack, fidelity="rigid")
    motion = af.Motion.synthetic(seed=1, duration=0.32, pga=1.0)
    run = af.time_history(model, motion, dt=0.005, record=af.Record(fields_every=1))
    dataset = run.dataset.copy(deep=True)
    at = int(np.abs(run.time - Scene(model.structure, run, model).initial_time).argmin())
    assert at > 3
    dataset["eccentricity"][at] = [0.1, -0.4]
    dataset["eccentricity"][2] = [0.49, 0.0]
    dataset["open"][:] = False
    assert Scene(model.structure, af.History(dataset, stack), model).initial_joint == 1
    dataset["open"][at, 0] = True
    assert Scene(model.structure, af.History(dataset, stack), model).initial_joint == 0


def seen(points, moved):
    """Lower left and upper right corner of points, as built and moved."""
    every = np.concatenate([points, moved.reshape(-1, 2)])
    return every.min(axis=0), every.max(axis=0)


def test_the_view_has_room_for_displacements_that_are_magnified_somewhat_more(rocked):
    """By a fifth, and 4 % of the structure's size beside them."""
    model, run = rocked
    outlines, margin = Outlines(model.structure), 0.04 * model.structure.size
    points, moved = outlines.points, outlines.displacements(model, run.dataset["q"].values)
    scene = Scene(model.structure, run, model)
    assert scene.magnification > 1.0
    low, high = seen(points, points + 1.2 * scene.magnification * moved)
    assert scene.box == (pytest.approx(low - margin), pytest.approx(high + margin))
    still = Scene(model.structure, af.History(run.dataset.drop_vars(["q", "peak_displacement"])))
    low, high = seen(points, points)
    assert still.box == (pytest.approx(low - margin), pytest.approx(high + margin))


@pytest.mark.parametrize("away", [0.0, 0.2, -1e3, 1e3])
def test_the_view_follows_loose_blocks_as_far_as_half_a_structure(column, toppled, away):
    structure, outlines = column.structure, Outlines(column.structure)
    fallen, size = toppled.dataset.copy(deep=True), structure.size
    fallen["fall_pose"][..., 0] += away
    scene = Scene(structure, af.History(fallen, structure), column)
    fields = [*fallen["q"].values, fallen["last_q"].values]
    moved = outlines.displacements(column, np.array(fields))
    low, high = seen(outlines.points, outlines.points + 1.2 * moved)
    ends = outlines.points + scene.fallen[1].reshape(-1, *outlines.points.shape)
    left, right = ends[..., 0].min(), ends[..., 0].max()
    margin = 0.04 * size
    assert scene.box[0][0] == pytest.approx(min(low[0], max(left, low[0] - 0.5 * size)) - margin)
    assert scene.box[1][0] == pytest.approx(max(high[0], min(right, high[0] + 0.5 * size)) + margin)
    assert scene.box[0][1] == pytest.approx(scene.falls.level - margin, abs=0.02 * size)
    assert scene.box[0][1] <= scene.falls.level - margin


@pytest.mark.parametrize(
    ("opening", "by"), [(1e-5, 5e4), (0.03, 10.0), (0.21, 2.0), (0.23, 1.0), (0.9, 1.0)]
)
def test_openings_without_displacements_are_seen_as_a_third_of_the_depth(rocked, opening, by):
    """As nearly as a round number makes them: joints are 1 m deep."""
    model, run = rocked
    dataset = run.dataset.drop_vars(["q", "peak_displacement"])
    dataset["opening"] = dataset["opening"] * opening / float(dataset["opening"].max())
    assert (dataset["depth"] == 1.0).all()
    assert Scene(model.structure, af.History(dataset)).magnification == by


def test_without_displacements_blocks_stand_still(rocked):
    model, run = rocked
    data, found = arrays(
        Scene(model.structure, af.History(run.dataset.drop_vars(["q", "peak_displacement"])))
    )
    assert "contains no displacements" in data["note"]
    assert "fields_every = 8 in [record] of its case records them." in data["note"]
    assert "frame_points" not in found


def test_scenes_of_another_structure_or_model_are_refused(rocked, ring):
    model, run = rocked
    with pytest.raises(af.InvalidInput, match="has 2 joints, and the structure 18"):
        Scene(ring, run)
    dataset = run.dataset.isel(coordinate=slice(3)).drop_vars(["last_q"])
    with pytest.raises(af.InvalidInput, match="there are 3 coordinates, and the model has 6"):
        Scene(model.structure, af.History(dataset), model)


def test_the_legend_names_the_states_of_any_instant(rocked):
    model, run = rocked
    legend = {
        "hinge": ">hinge</span>",
        "slip": ">sliding joint</span>",
        "gap": ">open joint</span>",
    }
    still = af.time_history(model, af.Motion(np.zeros(11), 0.005), dt=0.005)
    for each in (run, still):
        flags, page = af.joints.assessed_joints(each.joints), each.player(model).page
        shown = {"hinge": flags["hinge"] != 0, "slip": flags["slide"], "gap": flags["open"]}
        for kind, text in legend.items():
            assert (text in page) == bool(shown[kind].any()), kind
    assert ">hinge</span>" in run.player(model).page
    assert ">sliding joint</span>" not in still.player(model).page
