"""Displacements of points, beside the coordinates."""

import numpy as np
import pytest

import archfem as af
from archfem.dynamics.corners import corner_displacements


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
    assert float(top[-1].max()) < 0.0  # the ground goes to the right, relative to it all goes left
    read = af.History.read(run.save(tmp_path / "run.nc"))
    np.testing.assert_array_equal(read.displacement, moved)


def test_a_run_without_fields_says_how_to_keep_them():
    model = af.build(af.column(breadth=0.4, heights=[0.8]), fidelity="rigid")
    run = af.time_history(model, af.Motion([0.0, 0.1, 0.0], 0.01), dt=0.005)
    with pytest.raises(af.InvalidInput, match="fields_every=10"):
        _ = run.displacement
