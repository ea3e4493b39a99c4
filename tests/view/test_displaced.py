"""A structure where its blocks have gone."""

import numpy as np

import archfem as af
from archfem.view.structure import draw_during


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
    moved = draw_during(column, toppled, joints)
    bare = af.History(toppled.dataset.drop_vars("q"), toppled.structure)
    built = draw_during(column, bare, joints)
    wide = [np.ptp(figure.axes[0].dataLim.get_points()[:, 0]) for figure in (moved, built)]
    assert wide[0] > 1.1 * wide[1]


def test_small_displacements_of_a_run_are_magnified():
    """A stiff column that is shaken: drawn magnified by a round number, which is stated."""
    stones = af.column(breadth=0.4, heights=[0.8, 0.8])
    model = af.build(stones, fidelity="rigid")
    motion = af.Motion(np.full(21, 0.5), 0.005)
    run = af.time_history(model, motion, dt=0.005, record=af.Record(fields_every=5))
    figure = draw_during(model, run, run.joints.isel(time=-1))
    by = float(" ".join(figure.axes[0].get_title().split()).partition("displacements × ")[2])
    drawn = np.concatenate([path.vertices for path in labelled(figure, "blocks").get_paths()])
    places = model.cells.places + by * model.cells.displacement(run.dataset["q"].values[-1])
    assert by >= 10.0
    np.testing.assert_allclose(drawn.min(axis=0), places.min(axis=0))
