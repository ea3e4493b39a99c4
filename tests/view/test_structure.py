"""Pictures on paper show what the criteria say, where the joints are, with units."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from archfem.cases.case import Case
from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.joints.criteria import Criteria, flagged
from archfem.joints.resultants import joint_dataset, thrust_line
from archfem.view.envelopes import draw_eccentricity, draw_envelope
from archfem.view.joints import draw_joints
from archfem.view.marks import joint_ends, joint_marks
from archfem.view.structure import draw_structure
from archfem.view.style import save

WEIGHT = 1e4  # normal force in every joint [N]: only signs and ratios matter
HINGES = {0: -0.5, 6: 0.48, 12: -0.46}
SLIDING = {3: 0.7, 9: -0.9}  # V / N beyond the coefficient 0.6
APART = [4, 15]


@pytest.fixture
def joints(ring):
    """Three hinges, two sliding joints and two open ones at one instant."""
    return joint_dataset(ring, resultants(ring)).assign_coords(time=3.66)


def resultants(ring):
    found = np.zeros((len(ring.joints), 3))
    found[:, 0] = WEIGHT
    for number, e in HINGES.items():
        found[number, 2] = e * WEIGHT * ring.joints[number].depth
    for number, ratio in SLIDING.items():
        found[number, 1] = ratio * WEIGHT
    found[APART] = 0.0
    return found


@pytest.fixture(scope="module")
def bridge():
    """Three rings, two piers, sidewalls, and soil joints over all of them."""
    return Case.read(Path(__file__).parents[2] / "meshes" / "prusias.toml").structure


@pytest.fixture
def run(ring):
    """A second in which three joints hinge half-way, and two come apart at the end."""
    time = np.linspace(0.0, 1.0, 11)
    found = np.zeros((11, len(ring.joints), 3))
    found[..., 0] = WEIGHT
    found[5] = found[10] = resultants(ring)
    found[5, APART, 0] = WEIGHT
    dataset = joint_dataset(ring, found, time)
    dataset["ground"] = (("time", "axis"), np.column_stack([np.sin(9 * time), np.cos(9 * time)]))
    return History(dataset)


def drawn(figure, name):
    """The one thing of a figure that is called so."""
    found = figure.findobj(lambda artist: artist.get_gid() == name)
    return found[0] if found else None


def units(axes):
    """Whether every label of axes has a unit."""
    return all("[" in label for label in (axes.get_xlabel(), axes.get_ylabel()) if label)


def test_each_hinge_is_a_circle_at_the_face_in_contact(ring, joints):
    circles = drawn(draw_structure(ring, joints), "hinges").get_xydata()
    assert len(circles) == int((joints["hinge"] != 0).sum()) == 3
    ends = [
        ring.joints[n].extrados if e > 0 else ring.joints[n].intrados for n, e in HINGES.items()
    ]
    assert circles == pytest.approx(np.array(ends))


def test_hinges_are_drawn_by_the_criteria_given_or_carried(ring, joints, run):
    sharp = Criteria(hinge=0.47, friction=2.0)
    for figure in (
        draw_structure(ring, joints, criteria=sharp),
        draw_structure(ring, flagged(joints, sharp)),
    ):
        assert len(drawn(figure, "hinges").get_xydata()) == 2
        assert drawn(figure, "slips") is None
    axes = draw_joints(run.judged_by(sharp), [0]).axes
    heights = {float(line.get_ydata()[0]) for each in axes for line in each.lines[:8]}
    assert {0.47, 2.0} <= heights
    assert not {0.46, 0.6} & heights


def test_thrust_line_is_drawn_where_it_is_and_interrupted_at_open_joints(ring, joints):
    line = drawn(draw_structure(ring, joints), "thrust").get_xydata()
    assert line == pytest.approx(thrust_line(ring, joints).values, nan_ok=True)
    assert np.flatnonzero(np.isnan(line[:, 0])).tolist() == APART
    pieces = drawn(draw_structure(ring, joints), "links").get_xydata().reshape(-1, 3, 2)[:, :2]
    joined = [k for k in range(17) if k not in APART and k + 1 not in APART]
    assert pieces == pytest.approx(np.array([line[[k, k + 1]] for k in joined]))


def test_sliding_and_open_joints_have_their_own_marks(ring, joints):
    figure = draw_structure(ring, joints)
    assert len(drawn(figure, "slips").get_paths()) == 2 * int(joints["slide"].sum()) == 4
    gaps = drawn(figure, "gaps").get_xydata().reshape(-1, 3, 2)[:, :2]
    assert int(joints["open"].sum()) == len(gaps) == 2
    assert gaps == pytest.approx(np.array([ring.joints[number].ends for number in APART]))


def test_arrows_say_which_way_a_joint_slips(ring, joints):
    """V > 0: the higher block, on the side of the normal, moves toward the extrados."""
    arrows = joint_marks(ring, joints).slips.reshape(-1, 2, 7, 2)
    for number, pair in zip(SLIDING, arrows, strict=True):
        joint, normal = ring.joints[number], ring.normals[number]
        tip, tail = pair[0, 3], pair[0, [0, 6]].mean(axis=0)
        assert (pair[0].mean(axis=0) - joint.middle) @ normal > 0.0
        assert np.sign((tip - tail) @ joint.tangent) == np.sign(SLIDING[number])
        assert pair.mean(axis=(0, 1)) == pytest.approx(joint.middle)


def test_nothing_failed_leaves_only_the_thrust_line(ring):
    still = joint_dataset(ring, np.tile([WEIGHT, 0.0, 0.0], (len(ring.joints), 1)))
    figure = draw_structure(ring, still)
    assert [drawn(figure, name) for name in ("hinges", "slips", "gaps")] == [None] * 3
    assert figure.axes[0].get_title() == ring.name


def test_structure_is_drawn_true_to_scale_with_units_and_time(ring, joints):
    figure = draw_structure(ring, joints)
    axes = figure.axes[0]
    assert len(drawn(figure, "blocks").get_paths()) == len(ring.blocks)
    assert axes.get_aspect() == 1.0
    assert "[m]" in axes.get_xlabel()
    assert "[m]" in axes.get_ylabel()
    assert "3.660 s" in axes.get_title()


def test_only_joints_of_rings_and_piers_are_marked(bridge):
    """All joints hinge, or slide, or are open: those of soil and sidewalls show nothing."""
    judged = np.array([joint.role != "other" for joint in bridge.joints])
    assert 0 < judged.sum() < len(judged)
    depth = np.array([joint.depth for joint in bridge.joints])
    rows = np.zeros((len(depth), 3))
    rows[:, 0], rows[:, 1], rows[:, 2] = WEIGHT, WEIGHT, 0.48 * WEIGHT * depth
    marks = joint_marks(bridge, joint_dataset(bridge, rows))
    assert marks.hinges == pytest.approx(
        np.array([joint.extrados for joint, own in zip(bridge.joints, judged, strict=True) if own])
    )
    assert len(marks.slips) == 2 * judged.sum()
    assert np.isfinite(marks.thrust[:, 0]).tolist() == judged.tolist()
    assert len(joint_marks(bridge, joint_dataset(bridge, 0.0 * rows)).gaps) == judged.sum()


def test_a_thrust_line_runs_through_each_ring_and_pier(bridge):
    """One link a voussoir and a course between beds; none through soil or skewbacks."""
    rows = np.tile([WEIGHT, 0.0, 0.0], (len(bridge.joints), 1))
    links = joint_marks(bridge, joint_dataset(bridge, rows)).links
    assert len(links) == 14 + 17 + 15 + 2 * 4
    assert np.linalg.norm(links[:, 1] - links[:, 0], axis=1).max() < 0.7  # a stone is that long


def test_a_long_structure_has_a_wide_page_and_a_ring_has_not(ring, bridge):
    pages = [draw_structure(each).get_size_inches() for each in (ring, bridge)]
    assert pages[0][0] < 6.5
    assert pages[1][0] > 10.5
    assert pages[1][1] < 4.0


def test_drawing_into_given_axes_returns_their_figure(ring, joints):
    page = Figure()
    left, right = page.subplots(1, 2)
    assert draw_structure(ring, joints, axes=left) is page
    assert len(right.lines) == 0


def test_several_instants_are_refused(ring, run):
    with pytest.raises(InvalidInput, match=r"give one instant of the 18 joints"):
        draw_structure(ring, run.joints)


def test_envelope_shows_extremes_faces_and_dead_load(run):
    axes = draw_envelope({"quake": run}, dead=run.joints.isel(time=0)).axes[0]
    lines = {line.get_label(): line for line in axes.lines}
    highest = lines["quake"].get_ydata()
    assert highest[[6, 0, 3]] == pytest.approx([0.48, 0.0, 0.0])
    assert lines["dead load"].get_linestyle() == ":"
    assert {-0.5, -0.46, 0.46, 0.5} <= {float(line.get_ydata()[0]) for line in axes.lines[:5]}
    assert units(axes)
    crosses = [line for line in axes.lines if line.get_marker() == "x" and len(line.get_xdata())]
    assert crosses[0].get_xdata().tolist() == APART


def test_envelopes_of_runs_have_their_own_colours(run):
    figure = draw_envelope({"one": run, "other": run})
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names == ["one", "other", "came apart"]
    lines = {line.get_label(): line.get_color() for line in figure.axes[0].lines}
    assert lines["one"] != lines["other"]


def history(structure, e):
    """Two instants at which all joints have eccentricity e, then -e."""
    found = np.zeros((2, len(structure.joints), 3))
    found[..., 0] = WEIGHT
    depth = np.array([joint.depth for joint in structure.joints])
    found[0, :, 2], found[1, :, 2] = e * WEIGHT * depth, -e * WEIGHT * depth
    return History(joint_dataset(structure, found, np.arange(2.0)))


def test_each_ring_and_pier_has_a_panel_of_its_own(bridge):
    figure = draw_envelope({"quake": history(bridge, 0.3)})
    assert [axes.get_title() for axes in figure.axes] == [
        "north arch", "main arch", "south arch", "north pier", "south pier",
    ]  # fmt: skip
    for axes in figure.axes:
        count = sum(joint.part == axes.get_title() for joint in bridge.joints)
        (highest,) = [line for line in axes.lines if line.get_label() == "quake"]
        assert highest.get_xdata().tolist() == list(range(count))
        assert highest.get_ydata() == pytest.approx(np.full(count, 0.3))
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["quake"]


def test_two_bridges_are_told_apart_by_dots(bridge, ring):
    """Parts of one name share a panel, whatever the number of their joints."""
    runs = {"before": history(bridge, 0.4), "after": history(bridge, 0.1)}
    for axes in draw_envelope(runs, dotted=["before"]).axes:
        lines = {line.get_label(): line.get_linestyle() for line in axes.lines}
        assert (lines["before"], lines["after"]) == (":", "-")
    states = {name: run.joints.isel(time=0) for name, run in runs.items()}
    for axes in draw_eccentricity(states, dotted=["before"]).axes:
        lines = {line.get_label(): line for line in axes.lines}
        assert lines["before"].get_linestyle() == ":"
        assert lines["before"].get_ydata() == pytest.approx(0.4)
        assert lines["after"].get_ydata() == pytest.approx(0.1)


def test_many_parts_go_on_several_rows(ring):
    """Of ten rings of 18 joints four fit side by side; all panels share one scale."""
    parts = [f"arch {number}" for number in range(1, 11)]
    one = draw_envelope({"quake": history(ring, 0.2)}).axes[0]
    assert one.get_title() == ""
    dataset = joint_dataset(ring, np.tile([WEIGHT, 0.0, 0.0], (18, 1)))
    many = xr.concat(
        [dataset.assign_coords(part=("joint", [part] * 18)) for part in parts], "joint"
    )
    axes = draw_eccentricity({"dead load": many}).axes
    rows = [each.get_subplotspec().get_topmost_subplotspec().rowspan.start for each in axes]
    assert rows == [0] * 4 + [1] * 4 + [2] * 2
    assert {each.get_ylim() for each in axes} == {(-0.56, 0.56)}


def test_several_parts_do_not_go_into_one_pair_of_axes(bridge):
    with pytest.raises(InvalidInput, match=r"\['north arch', .* do not fit one pair of axes"):
        draw_envelope({"quake": history(bridge, 0.3)}, axes=Figure().add_subplot())


def test_eccentricity_over_time_is_refused(run):
    with pytest.raises(InvalidInput, match=r"\['quake'\] have several instants: give one"):
        draw_eccentricity({"quake": run.joints})


@pytest.mark.parametrize("count", [0, 7])
def test_too_few_or_many_runs_are_refused(run, count):
    with pytest.raises(InvalidInput, match=rf"{count} runs in one picture: give 1 to 6"):
        draw_envelope({str(k): run for k in range(count)})


def test_joint_histories_show_the_recorded_values_and_limits(run):
    figure = draw_joints(run, [6, 9])
    panels = np.array(figure.axes).reshape(3, 2)
    assert all(units(axes) for axes in figure.axes)
    for row, number in zip(panels[1:], (6, 9), strict=True):
        for axes, name in zip(row, ("eccentricity", "friction"), strict=True):
            shown = axes.lines[-1].get_ydata()
            own = run.joints.sel(joint=number)
            sense = np.sign(own["V"].values) if name == "friction" else 1.0
            assert shown == pytest.approx(sense * own[name].values)
        assert f"joint {number}" in row[0].get_ylabel()
        assert row[1].lines[0].get_ydata()[0] == pytest.approx(0.6)
    ground = {line.get_label(): line.get_ydata() for line in panels[0, 0].lines}
    assert ground["horizontal"] == pytest.approx(run.dataset["ground"].values[:, 0])
    assert ground["vertical"] == pytest.approx(run.dataset["ground"].values[:, 1])


def test_long_names_of_joints_are_broken_into_lines(bridge):
    run = history(bridge, 0.3)
    run.dataset["ground"] = (("time", "axis"), np.zeros((2, 2)))
    names = [joint.name for joint in bridge.joints]
    long = "main arch, voussoir 12 to backfill"
    axes = draw_joints(run, [names.index(long)]).axes[2]
    lines = axes.get_ylabel().splitlines()[:-1]
    assert " ".join(lines) == long
    assert max(map(len, lines)) <= 20


@pytest.mark.parametrize(("numbers", "said"), [([0, 18], r"\[18\]"), ([], "none")])
def test_joints_that_do_not_exist_are_refused(run, numbers, said):
    with pytest.raises(InvalidInput, match=rf"joints {said} cannot be drawn: .* 0 to 17"):
        draw_joints(run, numbers)


@pytest.mark.parametrize(("suffix", "start"), [(".png", b"\x89PNG"), (".pdf", b"%PDF")])
def test_a_figure_is_saved_whole(ring, tmp_path, suffix, start):
    path = save(draw_structure(ring), tmp_path / "new" / f"ring{suffix}")
    assert path.read_bytes().startswith(start)
    assert [each.name for each in path.parent.iterdir()] == [path.name]


def test_an_unknown_suffix_is_refused(ring, tmp_path):
    with pytest.raises(InvalidInput, match=r"suffix '\.xyz': use one of .*'png'"):
        save(draw_structure(ring), tmp_path / "ring.xyz")
    assert list(tmp_path.iterdir()) == []


def test_marks_follow_the_blocks(ring):
    """A rigid body displacement of all blocks carries every mark along."""
    still = joint_dataset(ring, resultants(ring))
    shift = np.tile([0.3, -0.2], (len(ring.joints), 2, 1))
    rest, moved = joint_marks(ring, still), joint_marks(ring, still, shift=shift)
    for name in ("thrust", "links", "hinges", "slips", "gaps"):
        expected = getattr(rest, name) + np.array([0.3, -0.2])
        assert getattr(moved, name) == pytest.approx(expected, nan_ok=True)


def test_ends_of_joints_move_as_the_mean_of_their_blocks(ring):
    """Translated free blocks: an inner joint goes all the way, a springing half of it."""
    from archfem.models.rigid import rigid

    model = rigid(ring)
    q = np.tile([0.01, 0.02, 0.0], len(ring.free))
    moved = (joint_ends(model) @ q).reshape(-1, 2, 2)
    assert moved[1:-1] == pytest.approx(np.broadcast_to([0.01, 0.02], (16, 2, 2)))
    assert moved[[0, -1]] == pytest.approx(np.broadcast_to([0.005, 0.01], (2, 2, 2)))
