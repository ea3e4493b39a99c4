"""States as files, read back by programs that are not ours."""

import locale

import ezdxf
import numpy as np
import pytest
import shapely

import archfem as af
from archfem.models import write_state

meshio = pytest.importorskip("meshio")
pyvista = pytest.importorskip("pyvista")


@pytest.fixture(autouse=True)
def keep_locale():
    """Restore the locale, which VTK's reader of old files leaves as "C", where text is ASCII."""
    given = locale.setlocale(locale.LC_ALL)
    yield
    locale.setlocale(locale.LC_ALL, given)


@pytest.mark.parametrize("magnification", [1.0, 50.0])
def test_a_drawing_of_where_the_blocks_are(tmp_path, magnification):
    column = af.column(breadth=1.0, heights=[1.0, 2.0])
    model = af.build(column, fidelity="full", cells=(2, 3))
    q = np.tile([0.01, -0.002], model.size // 2)
    path = write_state(model, q, tmp_path / "moved.dxf", magnification=magnification)
    drawing = ezdxf.readfile(path)
    assert drawing.units == ezdxf.units.M
    space = drawing.modelspace()
    moved = [e for e in space.query("LWPOLYLINE") if e.dxf.layer == "column"]
    assert len(moved) == 3
    assert all(each.closed for each in moved)
    places = [np.array(list(each.vertices())) for each in moved]
    shift = magnification * np.array([0.01, -0.002])
    for block, own in zip(column.blocks, places, strict=True):
        expected = block.centroid + (0.0 if block.fixed else shift)
        polygon = shapely.Polygon(own)
        assert polygon.exterior.is_ccw
        assert polygon.area == pytest.approx(block.area, rel=1e-12)
        assert (polygon.centroid.x, polygon.centroid.y) == pytest.approx(expected, abs=1e-12)
    assert {text.dxf.text for text in space.query("TEXT")} == {"base", "block 1", "block 2"}
    joints = [e for e in space.query("LWPOLYLINE") if e.dxf.layer == "joints"]
    ends = np.array([list(each.vertices()) for each in joints])
    assert ends == pytest.approx(column.ends, abs=1e-12)


def test_a_drawing_is_a_survey_again(tmp_path):
    """The drawing of a state at rest is read as its structure."""
    ring = af.circular_arch(radius=2.0, thickness=0.4, embrace=150.0, voussoirs=5, chords=1)
    model = af.build(ring, fidelity="rigid")
    path = write_state(model, np.zeros(model.size), tmp_path / "ring.dxf")
    ignored = af.masonry.Layer(ignore=True)
    layers = dict.fromkeys(("as built", "joints", "arch names"), ignored)
    layers |= {f"{side} abutment names": ignored for side in ("left", "right")}
    layers |= {f"{side} abutment": af.masonry.Layer(fixed=True) for side in ("left", "right")}
    again = af.masonry.surveyed(path, layers={"arch": af.masonry.Layer(role="ring"), **layers})
    assert again.weight == pytest.approx(ring.weight, rel=1e-9)
    assert len(again.joints) == len(ring.joints)


@pytest.mark.parametrize("suffix", [".vtu", ".vtk", ".xdmf"])
def test_cells_of_a_state(tmp_path, suffix):
    column = af.column(breadth=1.0, heights=[1.0, 2.0])
    model = af.build(column, fidelity="full", cells=(2, 3))
    dead = af.dead_load(model)
    path = write_state(model, dead.q, tmp_path / f"dead{suffix}")
    read = meshio.read(path)
    inner = len(model.cells.places)
    expected = model.cells.displacement(dead.q)
    assert read.points[:inner, :2] == pytest.approx(model.cells.places, abs=1e-12)
    assert read.point_data["displacement"][:inner, :2] == pytest.approx(expected, abs=1e-15)
    stress = np.concatenate(read.cell_data["stress_yy"])[: len(model.cells.polygons)]
    known = (model.cells.stress @ dead.q).reshape(-1, 3)[:, 1]
    assert stress == pytest.approx(known, rel=1e-9)
    assert set(np.concatenate(read.cell_data["block"]).tolist()) == {0, 1, 2}


def test_rigid_blocks_for_paraview(tmp_path):
    ring = af.circular_arch(radius=2.0, thickness=0.4, embrace=150.0, voussoirs=5)
    model = af.build(ring, fidelity="rigid")
    grid = pyvista.read(write_state(model, np.zeros(model.size), tmp_path / "ring.vtu"))
    assert set(grid.celltypes) == {7, 9}  # VTK: polygons, and supports of four corners
    rings = [shapely.Polygon(grid.get_cell(k).points[:, :2]) for k in range(grid.n_cells)]
    turn = np.radians(150.0) / 5 / 16  # each arc is drawn by 16 chords
    inner = sum(ring.area for ring, k in zip(rings, grid.cell_data["block"], strict=True) if k % 6)
    assert inner == pytest.approx(2.0 * 0.4 * np.radians(150.0) * np.sin(turn) / turn, rel=1e-9)


def test_states_that_cannot_be_written_are_refused(tmp_path):
    column = af.column(breadth=1.0, heights=[1.0])
    model = af.build(column, fidelity="rigid")
    with pytest.raises(af.InvalidInput, match="meshio does not write this model as"):
        write_state(model, np.zeros(3), tmp_path / "column.words")
    with pytest.raises(af.InvalidInput, match="the model has 3"):
        write_state(model, np.zeros(4), tmp_path / "column.dxf")
    arc = af.build(
        af.circular_arch(radius=3.0, thickness=0.6, embrace=150.0, voussoirs=5), fidelity="rigid"
    )
    with pytest.raises(af.InvalidInput, match="meshio does not write this model as"):
        write_state(arc, np.zeros(arc.size), tmp_path / "arch.vtk")


@pytest.mark.parametrize("suffix", [".vtk", ".vtu"])
@pytest.mark.parametrize(
    ("cell", "kind", "count"), [("triangle", "triangle", 12), ("quadrilateral", "quad", 6)]
)
def test_cells_are_of_their_kind(tmp_path, suffix, cell, kind, count):
    """Triangles or quadrilaterals of the block, and one quadrilateral of what it stands on."""
    column = af.column(breadth=1.0, heights=[1.0])
    model = af.build(column, fidelity="full", cells=(2, 3), cell=cell)
    path = write_state(model, np.zeros(model.size), tmp_path / f"state{suffix}")
    kinds = [(each.type, len(each.data)) for each in meshio.read(path).cells]
    assert sum(n for name, n in kinds if name == kind) == count + (kind == "quad")
    assert sum(n for _, n in kinds) == count + 1
    area = pyvista.read(path).compute_cell_sizes(length=False, volume=False)["Area"]
    assert area.sum() == pytest.approx(1.0 + column.blocks[0].area)


@pytest.mark.parametrize("suffix", [".vtu", ".vtk"])
def test_vectors_of_the_plane_become_those_of_space(tmp_path, suffix):
    """Points and displacements; cell data of one number stay of one."""
    model = af.build(af.column(breadth=1.0, heights=[1.0]), fidelity="full", cells=(2, 3))
    q = np.tile([0.01, -0.002], model.size // 2)
    path = write_state(model, q, tmp_path / f"state{suffix}", magnification=1.0)
    grid = pyvista.read(path)
    assert not grid.points[:, 2].any()
    moved = grid.point_data["displacement"]
    assert moved[moved[:, 0] > 0.0] == pytest.approx(np.tile([0.01, -0.002, 0.0], (12, 1)))
    assert {grid.cell_data[name].ndim for name in grid.cell_data} == {1}
