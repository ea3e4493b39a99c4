"""A structure where its blocks have gone."""

import numpy as np
import pytest

import archfem as af
from archfem.view.pages.player_data import Scene
from archfem.view.positions import (
    decisive_instant,
    peak_displacements,
    peak_instant,
    peak_joint_ends,
)
from archfem.view.structure import draw_critical, draw_during

TIMES = np.linspace(0.0, 2.0, 201)  # of a swing, in half periods


def labelled(figure, gid):
    (artist,) = [each for each in figure.axes[0].get_children() if each.get_gid() == gid]
    return artist


def test_blocks_are_drawn_where_they_are(column, toppled):
    q = toppled.dataset["last_q"].values
    figure = af.view.draw_displaced(column, q, joints=toppled.joints.isel(time=-1))
    drawn = np.concatenate([path.vertices for path in labelled(figure, "blocks").get_paths()])
    places = column.cells.places + column.cells.displacement(q)
    np.testing.assert_allclose(drawn.min(axis=0), places.min(axis=0))
    np.testing.assert_allclose(drawn.max(axis=0), places.max(axis=0))
    assert f"t = {toppled.time[-1]:.3f} s" in figure.axes[0].get_title()


def test_the_thrust_line_ends_where_faces_touch(column, toppled):
    """The lowest joint has turned by 0.3 rad: its thrust is where the stone still stands."""
    q = toppled.dataset["last_q"].values
    figure = af.view.draw_displaced(column, q, joints=toppled.joints.isel(time=-1))
    thrust = np.column_stack(labelled(figure, "thrust").get_data())
    corners = column.structure.ends[0]
    assert np.linalg.norm(thrust[0] - corners, axis=1).min() < 0.02


def test_an_instant_of_a_run_is_drawn_as_it_is_known(column, toppled):
    joints = toppled.joints.isel(time=-1)
    moved = draw_during(column.structure, toppled, joints, column)
    bare = af.History(toppled.dataset.drop_vars("q"), toppled.structure)
    built = draw_during(column.structure, bare, joints, column)
    wide = [np.ptp(figure.axes[0].dataLim.get_points()[:, 0]) for figure in (moved, built)]
    assert wide[0] > 1.1 * wide[1]


def test_small_displacements_of_a_run_are_magnified():
    """A stiff column that is shaken: drawn magnified by a round number, which is stated."""
    stones = af.column(breadth=0.4, heights=[0.8, 0.8])
    model = af.build(stones, fidelity="rigid")
    motion = af.Motion(np.full(21, 0.5), 0.005)
    run = af.time_history(model, motion, dt=0.005, record=af.Record(fields_every=5))
    figure = draw_during(stones, run, run.joints.isel(time=-1), model)
    by = float(" ".join(figure.axes[0].get_title().split()).partition("displacements × ")[2])
    drawn = np.concatenate([path.vertices for path in labelled(figure, "blocks").get_paths()])
    places = model.cells.places + by * model.cells.displacement(run.dataset["q"].values[-1])
    assert by >= 10.0
    np.testing.assert_allclose(drawn.min(axis=0), places.min(axis=0))


def shake(stones, motion, **settings):
    model = af.build(stones, fidelity="rigid", displacements="large")
    return model, af.time_history(model, motion, dt=0.005, **settings)


def test_the_largest_displacement_is_kept_without_fields():
    """Blocks and joints are where the fields of each step show them at that instant."""
    stones = af.column(breadth=0.4, heights=[0.8, 0.8])
    motion = af.Motion.synthetic(seed=3, duration=2.0, pga=2.5)
    model, run = shake(stones, motion, record=af.Record(fields_every=1))
    time, moved = peak_instant(run), run.displacement
    k = int(np.argmin(np.abs(moved["time"].values - time)))
    start = moved.values[0]
    assert k == np.linalg.norm(moved.values - start, axis=2).max(axis=1).argmax() > 0
    corners = np.column_stack([moved["x"], moved["y"]])
    owners = [block.name for block in stones.blocks]
    block = np.array([owners.index(name) for name in moved["block"].values])
    found = peak_displacements(stones, run, corners, block)
    np.testing.assert_allclose(found, moved.values[k], atol=1e-9)
    # of the overlap of both faces, which have slid a little
    ends = model.observer().joint_ends(run.dataset["q"].values[k])
    np.testing.assert_allclose(peak_joint_ends(stones, run), ends, atol=5e-4)


def test_a_run_without_fields_is_drawn_at_its_largest_displacement():
    stones = af.column(breadth=0.4, heights=[0.8, 0.8])
    _, run = shake(stones, af.Motion.synthetic(seed=3, duration=2.0, pga=2.5))
    with af.view.limit_width(85.0):
        assert len(draw_critical(stones, run).axes) == 2
    figure = draw_critical(stones, run)
    assert len(figure.axes) == 2
    title = " ".join(figure.axes[1].get_title().split())
    assert title.startswith(f"largest displacement, t = {peak_instant(run):.3f} s")
    # the stones that the verdict names
    most, left = (
        float(run.dataset[f"{x}_displacement"].values.argmax()) for x in ("largest", "residual")
    )
    names = {text.get_text() for text in figure.axes[1].texts}
    assert names == {f"block {most:.0f}", f"block {left:.0f}"}
    # the lower name below its point, so that those of neighbours stay apart
    sides = [(text.xy[1], text.get_va()) for text in figure.axes[1].texts]
    assert [side for _, side in sorted(sides)] == ["top", "bottom"][: len(names)]
    scene = Scene(stones, run)
    assert scene.initial_time == peak_instant(run) == scene.data["peak"]
    assert [len(part) for part in scene.moved] == [1, 1, 1]
    assert "the largest displacement alone" in scene.note


def test_a_run_that_ends_in_a_fall_is_drawn_at_its_collapse(column, toppled):
    assert peak_instant(toppled) is None
    assert len(draw_critical(column.structure, toppled, column).axes) == 1


@pytest.mark.slow
def test_a_stack_that_rocks_on_after_its_record_is_drawn_like_one_that_has_come_back():
    """A record ends at 0.75 s, in rocking, so that stones are followed as loose: none falls."""
    stones, swing = af.column(breadth=0.4, heights=[0.8, 0.8]), 4.5 * np.sin(np.pi * TIMES)
    whole, cut = (shake(stones, af.Motion(swing[:n], 0.005))[1] for n in (201, 151))
    assert "fall_pose" in cut.dataset
    assert "fall_pose" not in whole.dataset
    assert decisive_instant(cut) == decisive_instant(whole) == whole.mechanisms["verified"].time
    assert peak_instant(cut) == peak_instant(whole)
    assert len(draw_critical(stones, cut).axes) == 2


def test_a_largest_displacement_after_the_record_is_not_drawn():
    """It rocks out after its record, by 0.24 m rather than 0.20 m, and comes back."""
    stone = af.column(breadth=0.4, heights=[0.8])
    _, run = shake(stone, af.Motion(5.2 * np.sin(np.pi * TIMES), 0.005))
    assert run.fall.kind == "stands"
    assert run.fall.displacement > 1.1 * run.dataset["largest_displacement"].values.max()
    assert peak_instant(run) is None
    assert decisive_instant(run) == run.mechanisms["verified"].time
