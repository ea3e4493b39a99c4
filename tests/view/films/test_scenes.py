"""Films and stills: the given number of frames, of the right size, that show the motion."""

import imageio.v2 as imageio
import numpy as np
import pytest
import xarray as xr

import archfem as af
from archfem.view import film, picture
from archfem.view.films.frames import even_timing
from archfem.view.positions import fields_at

SIZE = (640, 400)  # small: rendering takes the time
RED, GREEN = np.array([215, 38, 30]), np.array([0, 158, 115])  # of hinges and mechanisms


def reds(image):
    """Pixels as red as a hinge, below the header and above the legend."""
    inside = image[40:-170, :-130].astype(int)
    return int((np.abs(inside - RED).max(axis=-1) < 12).sum())


@pytest.mark.parametrize("suffix", [".mp4", pytest.param(".gif", marks=pytest.mark.slow)])
def test_a_film_decodes_to_its_frames(model, run, tmp_path, suffix):
    path = tmp_path / "new" / f"film{suffix}"
    assert film(model, run, path, fps=10, seconds=0.3, size=SIZE) == path
    frames = [frame[..., :3] for frame in imageio.mimread(path)]
    assert [frame.shape for frame in frames] == [(SIZE[1], SIZE[0], 3)] * 3
    assert all(frame.std() > 20.0 for frame in frames)
    assert np.abs(frames[0].astype(float) - frames[2]).max() > 100.0
    assert [each.name for each in path.parent.iterdir()] == [path.name]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "frames", "fps"),
    [
        ({}, 6, 20.0),  # as long as the run
        ({"seconds": 3.0}, 13, 13 / 3.0),  # no more frames than fields
        ({"seconds": 0.1, "fps": 50.0}, 5, 50.0),
    ],
)
def test_a_film_lasts_for_the_given_time(model, run, tmp_path, options, frames, fps):
    path = film(model, run, tmp_path / "film.mp4", size=(480, 320), **options)
    with imageio.get_reader(path) as read:
        assert read.count_frames() == frames
        assert read.get_meta_data()["fps"] == pytest.approx(fps, rel=0.01)


def test_frames_follow_at_even_times_whatever_the_steps(model):
    """Fields crowd at first; coordinates that grow with time do so in the film."""
    kept = np.concatenate([np.linspace(0.0, 0.1, 50), [0.3, 0.45, 1.0]])
    q = np.outer(kept, np.arange(1.0, 4.0))
    run = af.History(
        xr.Dataset({"q": (("frame", "coordinate"), q)}, {"frame_time": ("frame", kept)})
    )
    pace = even_timing(kept, 20.0, None)
    times, fps = pace.times, pace.fps
    assert fps == 20.0
    assert np.diff(times) == pytest.approx(1.0 / 19.0)
    assert fields_at(run, times) == pytest.approx(np.outer(times, np.arange(1.0, 4.0)))


@pytest.mark.slow
def test_frames_of_a_run_that_chose_its_steps(model, tmp_path):
    """Each frame states its own time, and its joints are of a record next to it."""
    time = np.linspace(0.0, 0.3, 61)
    motion = af.Motion(6.0 * np.sin(2.0 * np.pi * time / 0.3), 0.005)
    run = af.time_history(model, motion, record=af.Record(fields_every=2))
    steps = np.diff(run.dataset["frame_time"].values)
    assert steps.max() > 5.0 * steps.min()
    times = even_timing(run.dataset["frame_time"].values, 100.0, None).times
    fields = fields_at(run, times)
    assert np.diff(times) == pytest.approx(times[1] - times[0])
    nearest = run.dataset["q"].values[
        np.abs(run.dataset["frame_time"].values[:, None] - times).argmin(axis=0)
    ]
    assert np.abs(fields - nearest).max() < 0.2 * np.abs(fields).max()
    path = film(model, run, tmp_path / "film.gif", fps=10, size=SIZE)
    assert len(imageio.mimread(path)) == 3


@pytest.mark.slow
def test_a_picture_has_the_memory_of_joints_or_warns_that_it_has_not(coarse, caplog):
    """An equilibrium has its own memory; coordinates alone are warned of."""
    dead = af.dead_load(coarse)
    assert dead.model.memory.any()
    of_state = picture(coarse, dead, size=SIZE)
    of_joints = picture(coarse, dead.q, joints=dead.joints, size=SIZE)
    assert not caplog.records
    assert (of_state == of_joints).all()
    picture(coarse, dead.q, size=SIZE)
    assert "does not contain their slip" in caplog.text
    with pytest.raises(af.InvalidInput, match="of the 18 joints of this structure"):
        picture(coarse, dead, joints=dead.joints.isel(joint=slice(3)), size=SIZE)


@pytest.mark.slow
def test_a_mechanism_is_outlined_from_its_instant_on(model, run, tmp_path):
    """Four hinges that alternate, as if found at 0.2 s: green lines in the later frames alone."""
    resultants = np.zeros((18, 3))
    resultants[:, 0] = 1e4
    resultants[[0, 6, 12, 17], 2] = 0.5e4 * 0.55 * np.array([-1.0, 1.0, -1.0, 1.0])
    joints = af.joints.joint_dataset(model.structure, resultants).assign_coords(time=0.2)
    found = af.verified_mechanism(model.structure, joints)
    path = film(model, run, tmp_path / "film.gif", fps=10, size=SIZE, mechanism=found)
    green = [
        int((np.abs(frame[40:-170, :-130, :3].astype(int) - GREEN).max(axis=-1) < 40).sum())
        for frame in imageio.mimread(path)
    ]
    assert max(green[:2]) == 0
    assert min(green[2:]) > 500


def test_hinges_are_red_where_there_are_some(model, run):
    """At rest no pixel is red; with hinges, about as many discs' worth as the criteria count."""
    fields, times = run.dataset["q"].values, run.dataset["frame_time"].values
    count = (run.joints["hinge"] != 0).sum("joint").sel(time=times, method="nearest").values
    last = int(np.argmax(count))
    assert count[last] >= 4
    assert reds(picture(model, fields[0], size=SIZE)) == 0
    one = reds(picture(model, fields[int(np.flatnonzero(count == 1)[0])], size=SIZE))
    many = reds(picture(model, fields[last], size=SIZE))
    assert one > 20
    assert 0.5 * count[last] * one < many < 1.5 * count[last] * one


@pytest.mark.slow
def test_magnified_blocks_move_and_supports_do_not(model, run):
    q = run.dataset["q"].values[-1]
    small, large = (picture(model, q, magnification=by, size=SIZE) for by in (1.0, 20.0))
    assert np.abs(small.astype(float) - large).max() > 100.0
    rest = picture(model, 0.0 * q, size=SIZE)
    assert rest.std() > 20.0


def test_the_opening_under_the_ring_is_empty(model):
    """Rigid voussoirs are concave polygons: they must not be filled across their hollow."""
    image = picture(model, np.zeros(model.size), size=SIZE)
    middle = image[:, (SIZE[0] - 125) // 2]
    stone = np.flatnonzero((middle[40:-40] < 250).any(axis=1))
    assert len(stone) > 20
    assert np.ptp(stone) < 0.25 * SIZE[1]


def test_stress_is_seen_in_elastic_blocks(coarse):
    dead = af.dead_load(coarse)
    colours = ("displacement", "stress")
    seen = [picture(coarse, dead.q, colour=colour, size=SIZE) for colour in colours]
    assert np.abs(seen[0].astype(float) - seen[1]).max() > 100.0


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"colour": "stress"}, r"rigid blocks have no stress: .*fidelity='full'"),
        (
            {"colour": "mood"},
            r"colour = 'mood' is not known: use one of \['displacement', 'stress'",
        ),
        ({"magnification": -2.0}, r"magnification = -2.0 is not between 0 and"),
        ({"size": (641, 400)}, r"size \(641, 400\): give an even width and height"),
        ({"size": (64, 40)}, r"at least \(480, 320\) pixels"),
        ({"fps": 0.0}, r"fps = 0.0 is not between"),
        ({"seconds": -1.0}, r"seconds = -1.0 is not between"),
    ],
)
def test_impossible_options_are_refused(model, run, tmp_path, options, said):
    with pytest.raises(af.InvalidInput, match=said):
        film(model, run, tmp_path / "film.mp4", **options)
    assert list(tmp_path.iterdir()) == []


def test_unknown_suffixes_are_refused(model, run, tmp_path):
    with pytest.raises(af.InvalidInput, match=r"suffix '\.mov': use one of \('\.mp4', '\.gif'\)"):
        film(model, run, tmp_path / "film.mov")


def test_runs_without_fields_or_of_another_model_are_refused(model, coarse, run, tmp_path):
    bare = af.History(run.dataset.drop_vars("q"))
    with pytest.raises(af.InvalidInput, match=r"record them with .*fields_every=10"):
        film(model, bare, tmp_path / "film.mp4")
    with pytest.raises(af.InvalidInput, match=rf"51 coordinates, and the model has {coarse.size}"):
        film(coarse, run, tmp_path / "film.mp4")
    with pytest.raises(af.InvalidInput, match=r"3 coordinates, and the model has 51"):
        picture(model, np.zeros(3))
