"""Eccentricity part by part: its range over runs, and its value at one instant."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from pictures import APART, WEIGHT, history

import archfem as af
from archfem.view import draw_eccentricity, draw_envelope
from archfem.view.histories import draw_envelopes

MESHES = Path(__file__).parents[2] / "meshes"


def test_envelope_shows_extremes_faces_and_dead_load(run):
    axes = draw_envelope({"quake": run}, dead=run.joints.isel(time=0)).axes[0]
    lines = {line.get_label(): line for line in axes.lines}
    highest = lines["quake"].get_ydata()
    assert highest[[6, 0, 3]] == pytest.approx([0.48, 0.0, 0.0])
    assert lines["dead load"].get_linestyle() == ":"
    assert {-0.5, -0.46, 0.46, 0.5} <= {float(line.get_ydata()[0]) for line in axes.lines[:5]}
    assert all("[" in label for label in (axes.get_xlabel(), axes.get_ylabel()))
    crosses = [line for line in axes.lines if line.get_marker() == "x" and len(line.get_xdata())]
    assert crosses[0].get_xdata().tolist() == APART


def test_each_joint_of_a_low_column_has_its_number_at_the_axis():
    column = af.column(breadth=0.6, heights=[0.3] * 8)
    figure = draw_envelope({"run": history(column, 0.3)})
    figure.draw_without_rendering()
    written = [label.get_text() for label in figure.axes[0].get_xticklabels()]
    assert [text for text in written if text] == [str(k) for k in range(8)]


def test_envelopes_of_runs_have_their_own_colours(run):
    figure = draw_envelope({"one": run, "other": run})
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names == ["hinge from |e| = 0.46", "one", "other", "opened"]
    lines = {line.get_label(): line.get_color() for line in figure.axes[0].lines}
    assert lines["one"] != lines["other"]


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
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names == ["hinge from |e| = 0.46", "quake"]


def test_two_bridges_are_distinguished_by_dots(bridge, ring):
    """Parts of one name share a panel, for any number of their joints."""
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


@pytest.fixture(scope="module")
def short():
    """The bridge after its piers were made 0.8 m lower: they lose their two lowest joints."""
    return af.Case.read(MESHES / "prusias_piers.toml").structure


def test_piers_that_differ_are_drawn_by_height(bridge, short):
    """The base of a lower pier is drawn where it is, beside a joint of the higher one."""
    runs = {"high": history(bridge, 0.3), "low": history(short, 0.2)}
    dead = {name: run.joints.isel(time=0) for name, run in runs.items()}
    panels = {axes.get_title(): axes for axes in draw_envelope(runs, dead=dead).axes}
    states = draw_eccentricity(dead).axes
    for panel in (panels["south pier"], states[-1]):
        assert panel.get_xlabel() == "height [m]"
        lines = {line.get_label(): line for line in panel.lines}
        for structure, name in ((bridge, "high"), (short, "low")):
            own = [j.middle[1] for j in structure.joints if j.part == "south pier"]
            assert lines[name].get_xdata() == pytest.approx(own)
    lines = {line.get_label(): line for line in panels["main arch"].lines}
    assert lines["high"].get_xdata().tolist() == list(range(18))
    assert lines["dead load low"].get_ydata() == pytest.approx(0.2)
    assert lines["dead load low"].get_color() == lines["low"].get_color()


def test_runs_of_one_structure_share_a_colour(run):
    """Runs under several motions: each has its lines, and the label has one entry."""
    figure = draw_envelope({"both": [run, run], "one": run})
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names == ["hinge from |e| = 0.46", "both", "one", "opened"]
    colours = [line.get_color() for line in figure.axes[0].lines if line.get_marker() == "o"]
    assert colours == [colours[0]] * 4 + [colours[4]] * 2
    assert colours[0] != colours[4]


def test_many_parts_go_on_several_rows(ring):
    """Four of ten rings of 18 joints fit side by side; all panels share one scale."""
    parts = [f"arch {number}" for number in range(1, 11)]
    one = draw_envelope({"quake": history(ring, 0.2)}).axes[0]
    assert one.get_title() == ""
    dataset = af.joints.joint_dataset(ring, np.tile([WEIGHT, 0.0, 0.0], (18, 1)))
    many = xr.concat(
        [dataset.assign_coords(part=("joint", [part] * 18)) for part in parts], "joint"
    )
    axes = draw_eccentricity({"dead load": many}).axes
    rows = [each.get_subplotspec().get_topmost_subplotspec().rowspan.start for each in axes]
    assert rows == [0] * 4 + [1] * 4 + [2] * 2
    assert {each.get_ylim() for each in axes} == {(-0.56, 0.56)}


def test_several_parts_do_not_go_into_one_pair_of_axes(bridge):
    with pytest.raises(af.InvalidInput, match=r"\['north arch', .* do not fit one pair of axes"):
        draw_envelope({"quake": history(bridge, 0.3)}, axes=Figure().add_subplot())


def test_eccentricity_over_time_is_refused(run):
    with pytest.raises(af.InvalidInput, match=r"\['quake'\] have several instants: give one"):
        draw_eccentricity({"quake": run.joints})


@pytest.mark.parametrize("count", [0, 7])
def test_too_few_or_many_runs_are_refused(run, count):
    with pytest.raises(af.InvalidInput, match=rf"{count} runs in one picture: give 1 to 6"):
        draw_envelope({str(k): run for k in range(count)})
    with pytest.raises(af.InvalidInput, match=r"\['none'\] have no runs"):
        draw_envelope({"none": [], "one": run})


def test_ticks_are_names_of_joints():
    """The ring on piers counts its joints through, so that a part need not begin at 0."""
    built = af.arch_on_piers(
        radius=3.0, thickness=0.6, voussoirs=15, pier_breadth=1.2, courses=[0.5, 0.5]
    )
    names = {joint.part: [] for joint in built.joints}
    for joint in built.joints:
        names[joint.part].append(joint.name)
    for panel in draw_envelope({"run": history(built, 0.3)}).axes:
        formatter = panel.xaxis.get_major_formatter()
        for number, name in enumerate(names[panel.get_title()]):
            assert f"joint {formatter(number, 0)}" == name
        assert formatter(99, 0) == ""


def test_many_runs_are_shared_evenly_among_figures(run):
    """Not six in one, and the seventh alone."""
    figures = draw_envelopes({f"run {k}": run for k in range(7)}, None)
    shown = [[line.get_label() for line in each.axes[0].lines] for each in figures]
    names = [sum(label.startswith("run") for label in labels) for labels in shown]
    assert names == [4, 3]
