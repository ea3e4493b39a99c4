"""Pictures of falling structures: joints while they hold, then blocks alone, to the ground."""

from types import SimpleNamespace

import imageio.v2 as imageio
import numpy as np
import pytest

import archfem as af
from archfem.view import film, films
from archfem.view.films.frames import frames_of_fall, frames_of_run
from archfem.view.films.renderer import FrameLayout
from archfem.view.films.settings import Setup
from archfem.view.pages.player_data import Scene
from archfem.view.positions import FallingBlocks, fields_at


@pytest.fixture
def falls(column, toppled):
    return FallingBlocks.of(column.structure, toppled)


@pytest.fixture
def setup(column, toppled, falls):
    fields = toppled.dataset["q"].values
    return Setup.of(column, fields, "displacement", None).with_falls(falls)


def test_large_displacements_are_shown_as_they_are(column, toppled):
    q = toppled.dataset["q"].values
    assert Setup.of(column, 1e-3 * q, "displacement", None).magnification == 1.0
    assert Setup.of(column, q, "displacement", 3.0).magnification == 3.0


def test_a_film_follows_blocks_to_the_ground(column, toppled, falls, tmp_path):
    path = film(column, toppled, tmp_path / "fall.gif", fps=2, size=(480, 320))
    lasting = falls.times[-1] - toppled.dataset["frame_time"].values[0]
    assert len(imageio.mimread(path)) == round(2 * lasting)


def test_the_view_has_room_for_falling_blocks_and_the_ground(setup, column, falls):
    for time in falls.times[::10]:
        places = falls.places(column.cells.places, column.cells.block, time)
        assert (places >= setup.low).all()
        assert (places <= setup.high).all()
    assert setup.ground[:, 1] == pytest.approx(falls.level)
    assert setup.low[1] < falls.level


def test_the_view_does_not_follow_blocks_that_fly_far(setup, falls, column):
    away = falls.poses + np.array([1e3, 0.0, 0.0])
    far = setup.with_falls(FallingBlocks(falls.structure, falls.times, away, falls.level))
    assert (
        np.ptp([far.low, far.high], axis=0).max()
        < 4.0 * column.structure.size + np.ptp([setup.low, setup.high], axis=0).max()
    )


def test_joints_are_marked_while_they_hold_and_not_after(setup, toppled, falls):
    times = np.array([0.1, 0.3, falls.times[0] - 1e-3])
    held = list(frames_of_run(setup, toppled, times, fields_at(toppled, times)))
    assert all(len(shot.marks.links) for shot in held)
    (loose,) = frames_of_fall(setup, falls, falls.times[-1:])
    assert list(loose.words) == ["blocks are loose"]
    assert not len(loose.marks.links)
    assert not len(loose.past)


@pytest.mark.slow
def test_blocks_that_rock_on_after_a_motion_and_stand_are_not_loose():
    """A joint parts within a motion, or opens again and again beyond its end."""
    rocking = af.build(
        af.column(breadth=0.4, heights=[2.4]), fidelity="rigid", displacements="large"
    )
    swing = 5.4 * np.sin(4.0 * np.pi * np.linspace(0.0, 0.5, 101))
    record = af.Record(fields_every=5)
    run = af.time_history(rocking, af.Motion(swing, 0.005), dt=0.005, record=record)
    assert (str(run.ending), run.fall.kind) == ("finished", "stands")
    assert run.dataset["fall_time"].size > 10
    data = Scene(rocking.structure, run, rocking).data
    assert (data["loose"], data["state"]) == (0.5, "rocking")
    falls = FallingBlocks.of(rocking.structure, run)
    setup = Setup.of(rocking, run.dataset["q"].values, "displacement", None).with_falls(falls)
    (frame,) = frames_of_fall(setup, falls, falls.times[-1:])
    assert list(frame.words) == ["blocks are rocking"]
    layout = FrameLayout(setup, (480, 320), run.joints, run)
    words = [text.get_text() for axes in layout._figure.axes for text in axes.texts]
    assert "blocks rocking" in words
    assert not any("loose" in word for word in words)


def test_pictures_pass_over_into_the_fall(setup, toppled, falls):
    """The last state that was kept is that in which blocks came loose."""
    time = falls.times[:1]
    (before,) = frames_of_run(setup, toppled, time, fields_at(toppled, time))
    (after,) = frames_of_fall(setup, falls, time)
    np.testing.assert_allclose(before.places, after.places, atol=1e-9)
    np.testing.assert_allclose(before.shades, after.shades, atol=1e-6)


def test_the_ground_is_known_throughout(toppled):
    fall, motion = toppled.dataset, 8.0 * np.sin(2.0 * np.pi * np.linspace(0.0, 1.0, 201))
    known = np.interp(fall["fall_time"], np.linspace(0.0, 1.0, 201), motion, right=0.0)
    np.testing.assert_allclose(fall["fall_ground"].values[:, 0], known, atol=1e-9)


def test_stills_of_large_displacements_are_true_to_scale(column, toppled):
    q = toppled.dataset["last_q"].values
    image = af.view.picture(column, q, joints=toppled.joints.isel(time=-1), size=(480, 320))
    assert image.shape == (320, 480, 3)
    assert image.std() > 10.0


def test_colours_span_the_fall_that_is_seen(setup, column, toppled, falls):
    """Before it the column moves by a fifth of it: that is seen as well, on a scale of roots."""
    scale, cells = setup.scale, column.cells
    places = [falls.places(cells.places, cells.block, time) for time in falls.times]
    lengths = 1e3 * np.linalg.norm(np.array(places) - cells.places, axis=2)
    assert scale.norm.vmax == pytest.approx(lengths.max())
    assert scale.extend == "neither"
    held = 1e3 * np.abs(column.cells.displacement(toppled.dataset["last_q"].values)).max()
    assert held < 0.3 * lengths.max()
    assert scale.norm(held) > 0.3
    away = falls.poses + np.array([1e3, 0.0, 0.0])
    far = setup.with_falls(FallingBlocks(falls.structure, falls.times, away, falls.level))
    assert far.scale.extend == "max"


def test_the_legend_names_the_drawn_states(setup, toppled, falls):
    """No joint of the column slides, and loose blocks have no marks at all."""
    assert not toppled.joints["slide"].any()
    layout = FrameLayout(setup, (480, 320), toppled.joints, toppled)
    legend = layout._legend
    assert [text.get_text() for text in legend.get_texts()] == [
        "thrust line", "hinge", "earlier hinge",
    ]  # fmt: skip
    time = falls.times[:1]
    (held,) = frames_of_run(setup, toppled, time, fields_at(toppled, time))
    (loose,) = frames_of_fall(setup, falls, falls.times[-1:])
    for frame, named in ((held, True), (loose, False), (held, True)):
        layout.compose(frame)
        assert legend.get_visible() is named


@pytest.mark.parametrize("size", [(480, 320), pytest.param((1280, 720), marks=pytest.mark.slow)])
def test_names_of_instants_do_not_overlap(setup, hinged_late, size):
    layout = FrameLayout(setup, size, hinged_late.joints, hinged_late)
    texts = {text.get_text(): text for axes in layout._figure.axes for text in axes.texts}
    first, second = (texts[name].get_window_extent() for name in ("mechanism", "blocks loose"))
    # a letter apart, so that they read as two
    assert 0.0 < first.x0 < first.x1 + 5.0 < second.x0 < second.x1 < size[0]


def test_failed_joints_are_counted_in_words(model, joints):
    """Of a state with three hinges, two sliding joints and two open ones; of one without any."""
    still = np.zeros(model.size)
    setup = Setup.of(model, still[None], "displacement", 1.0)
    assert films.frames.frame_of_state(setup, still, joints).words == [
        "3 hinging",
        "2 sliding",
        "2 open",
    ]
    assert films.frames.frame_of_state(setup, still, joints).time == 3.66
    held = joints.assign({name: 0 * joints[name] for name in ("hinge", "slide", "open")})
    assert films.frames.frame_of_state(setup, still, held).words == []


@pytest.mark.parametrize(
    ("triangles", "kept"), [(1, 60), (1666, 60), (2000, 50), (9091, 10), (20_000, 5), (10**6, 5)]
)
def test_a_page_holds_a_hundred_thousand_triangles(triangles, kept):
    """In sixty instants at most, and in five at least."""
    setup = SimpleNamespace(triangles=SimpleNamespace(cell=np.zeros(triangles)))
    times = np.linspace(1.0, 9.0, 801)
    chosen = films.film._thin(times, setup)
    assert len(chosen) == kept
    assert chosen[[0, -1]].tolist() == [1.0, 9.0]
    assert np.diff(chosen) == pytest.approx(8.0 / (kept - 1), abs=0.011)
    assert films.film._thin(times[:4], setup).tolist() == times[:4].tolist()
