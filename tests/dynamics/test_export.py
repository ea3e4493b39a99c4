"""Runs as files, read back by programs that are not ours."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import archfem as af
from archfem.dynamics.export import _xdmf_cell_type, frames
from archfem.models.export import Solids

h5py = pytest.importorskip("h5py")
meshio = pytest.importorskip("meshio")
pyvista = pytest.importorskip("pyvista")


def shaken(fidelity, **options):
    ring = af.circular_arch(radius=2.0, thickness=0.4, embrace=150.0, voussoirs=3, chords=1)
    model = af.build(ring, fidelity=fidelity, cells=(2, 1), **options)
    motion = af.Motion.synthetic(duration=0.5, pga=4.0, seed=1)
    record = af.Record(fields_every=10)
    return model, af.time_history(model, motion, dt=0.01, record=record)


@pytest.fixture(scope="module", params=["rigid", "full"])
def run(request):
    return shaken(request.param)


def joints_of(model, run, number):
    """Gaps of the joints in a frame from the model's own joint displacements (n_joints, 2, 2)."""
    q = run.dataset["q"].values[number]
    structure = model.structure
    faces = np.zeros((len(structure.joints), 2, 2, 2))
    for k, joint in enumerate(structure.joints):
        for side, block in enumerate((joint.lower, joint.higher)):
            for end, point in enumerate(joint.ends):
                if not structure.blocks[block].fixed:
                    faces[k, side, end] = model.cells.displacement_rows(block, point) @ q
    return faces


def test_paraview_sees_openings(run, tmp_path):
    model, history = run
    path = history.to_vtk(model, tmp_path / "run.pvd")
    series = pyvista.PVDReader(str(path))
    assert series.time_values == pytest.approx(history.dataset["frame_time"].values)
    for number in (0, 3):
        series.set_active_time_point(number)
        blocks, joints = series.read()
        assert joints.n_cells == len(model.structure.joints)
        for k, joint in enumerate(model.structure.joints):
            corners = joints.get_cell(k).points[:, :2]
            assert corners == pytest.approx(np.array([*joint.ends, *joint.ends[::-1]]))
        moved = joints["displacement"].reshape(-1, 4, 3)[:, :, :2]
        faces = joints_of(model, history, number)
        assert moved[:, :2] == pytest.approx(faces[:, 0], abs=1e-15)
        assert moved[:, 2:] == pytest.approx(faces[:, 1, ::-1], abs=1e-15)
        step = history.joints.sel(time=series.time_values[number], method="nearest")
        for name in ("N", "M", "eccentricity", "hinge"):
            assert joints.cell_data[name] == pytest.approx(step[name].values, nan_ok=True)
        areas = blocks.compute_cell_sizes(length=False, volume=False)["Area"]
        whole = [areas[blocks.cell_data["block"] == k].sum() for k in range(5)]
        drawn = [polygon_area(block.points) for block in model.structure.blocks]
        assert whole == pytest.approx(drawn, rel=1e-12)
        assert ("stress_xx" in blocks.cell_data) == (model.fidelity == "full")


def polygon_area(points):
    x, y = points.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def test_xdmf_and_its_numbers(run, tmp_path):
    model, history = run
    path = history.to_xdmf(model, tmp_path / "run.xdmf")
    with h5py.File(tmp_path / "run.h5") as numbers:
        moved = numbers["displacement_3"][:, :2]
        inner = len(model.cells.places)
        q = history.dataset["q"].values[3]
        assert moved[:inner] == pytest.approx(model.cells.displacement(q), abs=1e-15)
        assert not moved[inner:].any()  # of the abutments
    if model.fidelity == "rigid":
        return  # its polygons of many corners are read by ParaView, not by meshio
    with meshio.xdmf.TimeSeriesReader(path) as series:
        points, cells = series.read_points_cells()
        time, at_points, in_cells = series.read_data(3)
    assert time == pytest.approx(history.dataset["frame_time"].values[3])
    assert len(points) == len(moved)
    assert at_points["displacement"][:, :2] == pytest.approx(moved)
    expected = (model.cells.stress @ q).reshape(-1, 3)[:, 1]
    assert np.concatenate(in_cells["stress_yy"])[: len(expected)] == pytest.approx(expected)
    assert sum(len(block) for block in cells) == len(model.cells.polygons) + 2
    assert {block.type for block in cells} == {"quad"}


@pytest.mark.parametrize(
    ("suffix", "read", "needs"),
    [
        (".csv", pd.read_csv, "pandas"),
        (".parquet", pd.read_parquet, "pyarrow"),
        (".xlsx", pd.read_excel, "openpyxl"),
    ],
)
def test_tables_of_joints(run, tmp_path, suffix, read, needs):
    pytest.importorskip(needs)
    _, history = run
    table = read(history.to_table(tmp_path / f"joints{suffix}"))
    assert len(table) == history.joints.sizes["time"] * 4
    one = table[table["name"] == "joint 2"]
    joint = history.joint("joint 2")
    for name in ("N", "V", "eccentricity", "slip"):
        assert one[name].to_numpy() == pytest.approx(joint[name].values, rel=1e-12, nan_ok=True)
    assert set(one["part"]) == {"arch"}


@pytest.mark.slow
def test_a_fall_is_followed_to_the_ground(tmp_path):
    """After blocks come loose, points move as the rigid bodies of the record do."""
    column = af.column(breadth=0.5, heights=[1.0, 1.0])
    model = af.build(column, fidelity="rigid", displacements="large")
    time = np.arange(0.0, 2.0, 0.01)
    motion = af.Motion(8.0 * np.sin(2.0 * np.pi * time), 0.01)
    history = af.time_history(model, motion, record=af.Record(fields_every=20))
    assert history.ending is af.dynamics.Ending.PARTED
    series = pyvista.PVDReader(str(history.to_vtk(model, tmp_path / "fall.pvd")))
    last = history.dataset["fall_pose"].values[-1]
    series.set_active_time_point(len(series.time_values) - 1)
    blocks, _ = series.read()
    for number, block in enumerate(column.blocks):
        points = blocks.points + blocks["displacement"]
        own = points[np.isin(np.arange(len(points)), corners(blocks, number))][:, :2]
        c, s = np.cos(last[number, 2]), np.sin(last[number, 2])
        turned = (block.points - block.centroid) @ np.array([[c, s], [-s, c]])
        expected = block.centroid + last[number, :2] + turned
        assert np.sort(own, axis=0) == pytest.approx(np.sort(expected, axis=0), abs=1e-9)


def corners(grid, number):
    cells = np.flatnonzero(grid.cell_data["block"] == number)
    return np.unique(np.concatenate([grid.get_cell(int(cell)).point_ids for cell in cells]))


def test_histories_that_cannot_be_written_are_refused(run, tmp_path):
    model, history = run
    with pytest.raises(af.InvalidInput, match=r"does not end in \.pvd"):
        history.to_vtk(model, tmp_path / "run.vtk")
    with pytest.raises(af.InvalidInput, match="a table is written as"):
        history.to_table(tmp_path / "joints.ods")
    bare = af.History(history.dataset.drop_vars("q"), model.structure)
    with pytest.raises(af.InvalidInput, match="no fields to write"):
        bare.to_xdmf(model, tmp_path / "run.xdmf")
    other = af.build(af.column(breadth=1.0, heights=[1.0]), fidelity="rigid")
    with pytest.raises(af.InvalidInput, match="the model has 3"):
        history.to_vtk(other, tmp_path / "run.pvd")


def test_frames_of_a_fall_turn_blocks_about_their_centroids():
    """Every point by a rotation of complex numbers; loose blocks bear nothing."""
    ring = af.circular_arch(radius=2.0, thickness=0.4, embrace=150.0, voussoirs=3)
    model = af.build(ring, fidelity="full", cells=(2, 1))
    poses = np.random.default_rng(0).uniform(-1.0, 1.0, (2, len(ring.blocks), 3))
    run = xr.Dataset(
        {
            "q": (("frame", "n"), np.zeros((1, model.size))),
            "fall_pose": (("fall_frame", "block", "pose"), poses),
        },
        {"frame_time": ("frame", [1.0]), "fall_time": ("fall_frame", [1.5, 1.52])},
    )
    solids = Solids(model)
    shown = list(frames(solids, run))
    assert [frame.time for frame in shown] == [1.0, 1.5, 1.52]
    for frame, pose in zip(shown[1:], poses, strict=True):
        for number, block in enumerate(ring.blocks):
            own = solids.cells.block == number
            arm = (solids.cells.places[own] - block.centroid) @ [1.0, 1.0j]
            to = arm * np.exp(1j * pose[number, 2]) + block.centroid @ [1.0, 1.0j]
            to += pose[number, :2] @ [1.0, 1.0j]
            moved = (solids.cells.places[own] + frame.displacement[own]) @ [1.0, 1.0j]
            assert moved == pytest.approx(to, abs=1e-12)
        assert frame.stress.shape == shown[0].stress.shape
        assert not frame.stress.any()


def test_kinds_of_cells_are_those_of_xdmf():
    """Its numbers of topologies: 4 a triangle, 5 a quadrilateral, 3 a polygon and its corners."""
    assert [_xdmf_cell_type(size) for size in (3, 4, 5, 17)] == [(4,), (5,), (3, 5), (3, 17)]
