"""A user's own tagged mesh as a survey, and refused meshes."""

from pathlib import Path

import numpy as np
import pytest

import archfem as af
from archfem.masonry.survey import outlines
from archfem.masonry.survey.drawings import infer_part, read_physical_surfaces

gmsh = pytest.importorskip("gmsh")
meshio = pytest.importorskip("meshio")

LAYERS = {"ground": af.masonry.Layer(fixed=True), "pier": af.masonry.Layer()}


def own(path, *, version=4.1, binary=False, curve="waist", apart=False, **mesh):
    """A mesh as a user makes it: two stones on the ground, tags and names of the user's own."""
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        occ = gmsh.model.occ
        boxes = [(-1.0, -0.3, 2.0, 0.3), (-0.5, 0.0, 1.0, 1.0), (-0.5, 1.0, 1.0, 0.8)]
        made = [(2, occ.addRectangle(x, y, 0.0, dx, dy)) for x, y, dx, dy in boxes]
        occ.fragment(made[:1], made[1:])
        occ.synchronize()
        names = {"ground": [], "pier, stone 1": [], "pier, stone 2": []}
        for _, tag in gmsh.model.getEntities(2):
            y = occ.getCenterOfMass(2, tag)[1]
            names[list(names)[2 if y > 1 or (apart and y < 0) else int(y > 0)]].append(tag)
        for number, (name, tags) in enumerate(reversed(names.items())):
            if tags:
                gmsh.model.addPhysicalGroup(2, tags, 30 + 7 * number, name)
        for _, tag in gmsh.model.getEntities(1):
            x, y, _ = occ.getCenterOfMass(1, tag)
            if curve and abs(y - 1.0) < 1e-9 and abs(x) < 0.4:
                gmsh.model.addPhysicalGroup(1, [tag], 5, curve)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.3)
        for name, value in mesh.items():
            gmsh.option.setNumber(f"Mesh.{name}", value)
        gmsh.model.mesh.generate(2)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", int(binary))
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    return path


@pytest.mark.parametrize(
    ("version", "binary"), [(4.1, False), (4.1, True), (2.2, False), (2.2, True)]
)
def test_blocks_by_physical_surface_and_joints_found(tmp_path, version, binary):
    path = own(tmp_path / "own.msh", version=version, binary=binary)
    structure = af.masonry.surveyed(path, layers=LAYERS)
    blocks = {block.name: block for block in structure.blocks}
    assert set(blocks) == {"ground", "pier, stone 1", "pier, stone 2"}
    assert len(blocks["pier, stone 1"].outline) == 4  # without the nodes along its sides
    assert blocks["pier, stone 2"].area == pytest.approx(0.8, rel=1e-9)
    assert blocks["ground"].fixed
    assert {joint.name for joint in structure.joints} == {"pier, base", "waist"}
    assert structure.depths == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize(("quads", "incomplete"), [(0, 0), (1, 0), (1, 1)])
def test_cells_of_second_order_count_by_their_corners(tmp_path, quads, incomplete):
    """Triangles of six nodes, quadrilaterals of nine or eight, and lines of three."""
    order = {"ElementOrder": 2, "SecondOrderIncomplete": incomplete, "RecombineAll": quads}
    structure = af.masonry.surveyed(own(tmp_path / "own.msh", **order), layers=LAYERS)
    assert sorted(block.area for block in structure.blocks) == pytest.approx([0.6, 0.8, 1.0])
    assert {joint.name for joint in structure.joints} == {"pier, base", "waist"}


@pytest.mark.parametrize("curve", ["waist", pytest.param(None, marks=pytest.mark.slow)])
def test_a_model_on_that_mesh(tmp_path, curve):
    """Its own cells carry it: the weight above each joint, from triangles of the file."""
    path = own(tmp_path / "own.msh", curve=curve)
    structure = af.masonry.surveyed(path, layers=LAYERS)
    model = af.build(structure, mesh_file=path)
    dead = af.dead_load(model).joints
    assert sorted(dead["N"].values) == pytest.approx([16e3, 36e3], rel=1e-6)  # of the solver
    triangles = sum(len(cell) == 3 for cell in model.cells.polygons)
    assert triangles == len(model.cells.polygons) > 20
    (tmp_path / "case.toml").write_text(
        '[structure]\nshape = "outlines"\nfile = "own.msh"\n'
        "[structure.layers]\nground = { fixed = true }\npier = {}\n"
        '[model]\nmesh_file = "own.msh"\n'
    )
    case = af.Case.read(tmp_path / "case.toml")
    mesh_file = case.analysis.mesh_file
    assert af.build(case.structure, mesh_file=mesh_file).size == model.size


def test_a_surface_in_pieces_is_refused(tmp_path):
    path = own(tmp_path / "own.msh", apart=True)
    with pytest.raises(af.InvalidInput, match="'pier, stone 2' is in pieces or has a hole"):
        read_physical_surfaces(path)


def test_a_mesh_of_another_structure_is_refused(tmp_path):
    path = own(tmp_path / "own.msh")
    with pytest.raises(af.errors.MeshError, match="3 physical surfaces, of which"):
        af.build(af.column(breadth=1.0, heights=[1.0, 0.8]), mesh_file=path)
    with pytest.raises(af.InvalidInput, match="'rigid' has no mesh"):
        af.build(af.column(breadth=1.0, heights=[1.0]), fidelity="rigid", mesh_file=path)
    with pytest.raises(af.InvalidInput, match="'auto' chooses"):
        af.build(af.column(breadth=1.0, heights=[1.0]), fidelity="auto", mesh_file=path)
    (tmp_path / "words.msh").write_text("words")
    with pytest.raises(af.InvalidInput, match="no mesh of gmsh"):
        af.masonry.read_outlines(tmp_path / "words.msh")


def test_parts_by_the_names_of_blocks():
    names = ["north arch, voussoir 3", "voussoir 12", "left abutment", "3"]
    assert [infer_part(name) for name in names] == ["north arch", "voussoir", "left abutment", ""]


def test_edges_of_a_mesh_follow_an_arc(tmp_path):
    """A mesh that archfem wrote is read as a survey: a ring of stones in chords."""
    ring = af.circular_arch(radius=2.0, thickness=0.4, embrace=150.0, voussoirs=3)
    af.models.write_mesh(ring, tmp_path / "ring.msh", af.models.Discretisation(cells=(2, 4)))
    layers = {name: af.masonry.Layer(fixed=True) for name in ("left abutment", "right abutment")}
    layers["voussoir"] = af.masonry.Layer(role="ring")
    again = af.masonry.surveyed(tmp_path / "ring.msh", layers=layers)
    assert [joint.name for joint in again.joints] == [joint.name for joint in ring.joints]
    turn = np.radians(150.0) / 3 / 4
    assert again.weight == pytest.approx(ring.weight * np.sin(turn) / turn, rel=1e-9)


@pytest.mark.parametrize(
    ("ends", "off", "named"),
    [
        ((-0.49, 0.49), 0.0, True),
        ((-0.49, 0.51), 0.0, False),
        ((-0.51, 0.1), 0.0, False),
        ((0.2, 0.3), 1.1e-6, False),
        ((0.2, 0.3), 0.9e-6, True),
    ],
)
def test_a_joint_has_the_name_of_a_curve_that_lies_on_it(stack, monkeypatch, ends, off, named):
    """Middles of the curve's edges decide: all between the joint's ends, and none beside it.

    Beside it begins a millionth of the structure's size away.
    """
    middles = np.array([[x, 1.0 + off * stack.size] for x in ends])
    monkeypatch.setattr(outlines, "read_physical_curves", lambda path, factor: [("mine", middles)])
    found = outlines._name_joints(stack, Path("any.msh"), None)
    assert [joint.name == "mine" for joint in found.joints] == [False, named]


WORDS = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
1
2 1 "stone"
$EndPhysicalNames
$Nodes
4
1 0 0 0
2 1 0 0
3 1 1 0
4 0 1 0
$EndNodes
$Elements
2
1 2 2 1 1 1 2 3
2 2 2 1 1 1 3 4
$EndElements
"""


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        ("\n4 0 1 0\n", "\n7 0 1 0\n", r"cells \(triangle\) have nodes that are not in the file"),
        ("1 1 3 4\n", "1 1 3 9\n", "no mesh of gmsh that meshio reads"),
        ("1 2 2 1 1 1 2 3\n2 2 2 1 1 1 3 4", "1 2 0 1 2 3\n2 2 0 1 3 4", "no physical surface"),
        ("1 1 3 4\n", "1 1 3 2\n", "'stone' is in pieces or has a hole"),
        (
            "2\n1 2 2 1 1 1 2 3\n",
            "3\n3 2 2 1 1 1 2 3\n1 2 2 1 1 1 2 3\n",
            "'stone' .* or its cells overlap",
        ),
        ("3 1 1 0\n4 0 1 0\n", "3 2 0 0\n4 3 0 0\n", "'stone' has no area"),
        ("3 1 1 0\n", "3 1 nan 0\n", "the mesh has coordinates that are no finite points"),
        ("3 1 1 0\n", "3 1 1e300 0\n", "a coordinate of 1e"),
        ("3 1 1 0\n", "3 1 1 1\n", "does not lie in the plane of x and y"),
        ("$Nodes\n4\n", "$Nodes\n40000000000\n", "no mesh of gmsh that meshio reads"),
        ("\n3 1 1 0\n", "\n1500000000 1 1 0\n", r"meshio reads \(MemoryError: .* save it again"),
    ],
)
def test_a_damaged_mesh_is_refused_in_words(before, after, says, tmp_path):
    path = tmp_path / "stone.msh"
    path.write_text(WORDS)
    (name, outline), *_ = read_physical_surfaces(path)
    assert (name, len(outline)) == ("stone", 4)
    assert before in WORDS
    path.write_text(WORDS.replace(before, after))
    with pytest.raises(af.InvalidInput, match=says):
        read_physical_surfaces(path)


@pytest.mark.parametrize("left", [1, 2])
def test_a_mesh_cut_off_in_its_cells_is_refused(left, tmp_path):
    path = own(tmp_path / "own.msh", binary=True)
    *_, last = meshio.gmsh.read(path).cells
    whole = path.read_bytes()
    # a triangle has four numbers of eight bytes: its own and three corners
    cut = (4 - left) * 8 * len(last.data)
    path.write_bytes(whole[: whole.index(b"\n$EndElements") - cut])
    with pytest.raises(af.InvalidInput, match=r"\(triangle\) have no 3 nodes"):
        read_physical_surfaces(path)


FAN = """$MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
6
1 0 0 0
2 1 0 0
3 1 1 0
4 0 1 0
5 1.1 0.5 0
6 0.5 {} 0
$EndNodes
$Elements
4
1 2 2 1 1 1 6 4
2 2 2 1 1 6 2 3
3 2 2 1 1 6 4 3
4 2 2 1 1 2 5 3
$EndElements
"""


@pytest.mark.parametrize("scale", [1e-2, 1.0, 1e2])
@pytest.mark.parametrize(("sine", "kept"), [(0.95e-9, False), (1.05e-9, True)])
def test_an_outline_bends_where_a_sine_is_above_a_billionth(tmp_path, scale, sine, kept):
    """Cells large and small, one of which is given clockwise, around a point in the lower side."""
    (tmp_path / "fan.msh").write_text(FAN.format(f"{-sine / 4.0:.17g}"))
    ((_, outline),) = read_physical_surfaces(tmp_path / "fan.msh", scale)
    corners = [(0.0, 0.0), *([(0.5, 0.0)] if kept else []), (1.0, 0.0), (1.1, 0.5), (1.0, 1.0)]
    corners = scale * np.array([*corners, (0.0, 1.0)])
    first = int(np.argmin(np.abs(outline).sum(axis=1)))
    assert np.roll(outline, -first, axis=0) == pytest.approx(corners, abs=1e-8 * scale)
