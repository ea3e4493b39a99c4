"""Meshes: their area, their files, and refused structures."""

from dataclasses import replace
from itertools import pairwise, product

import meshio
import numpy as np
import pytest
from repeats import each_once

import archfem as af
from archfem.models import read_mesh, write_mesh
from archfem.models.fem.mesh import generate_mesh


@pytest.mark.parametrize(
    ("meshing", "cells", "facets"),
    [
        (af.models.Discretisation(), 17 * 16 + 2 * 4, 18 * 4),
        (af.models.Discretisation(cells=(2, 3)), 17 * 6 + 2 * 2, 18 * 2),
        (af.models.Discretisation(cells=(2, 3), cell="triangle"), 2 * (17 * 6 + 2 * 2), 18 * 2),
    ],
)
def test_numbers_of_cells_and_joint_facets(ring, meshing, cells, facets):
    made = generate_mesh(ring, meshing)
    assert len(made.blocks) == cells
    assert np.bincount(made.joints[1]).tolist() == [facets // 18] * 18


def test_nodes_lie_on_the_circle(ring):
    """Four cells along a sector follow it by four chords: 1 - sin(φ/4)/(φ/4) is lost in weight."""
    model = af.build(ring, fidelity="full")
    turn = np.radians(159.0) / 17 / 4
    weight = model.mass_influence[:, 1].sum() * ring.gravity
    assert weight / ring.weight == pytest.approx(np.sin(turn) / turn, rel=1e-10)


def test_a_chorded_ring_keeps_its_own_weight():
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17, chords=2)
    model = af.build(ring, fidelity="full", cells=(2, 6))
    assert model.mass_influence[:, 1].sum() * ring.gravity == pytest.approx(ring.weight, rel=1e-10)


def test_file_and_back(ring, tmp_path):
    path = tmp_path / "ring.msh"
    write_mesh(ring, path, af.models.Discretisation(cells=(2, 2)))
    again, fresh = (
        read_mesh(ring, path),
        generate_mesh(ring, af.models.Discretisation(cells=(2, 2))),
    )
    assert np.array_equal(np.bincount(again.blocks), np.bincount(fresh.blocks))
    assert np.array_equal(np.bincount(again.joints[1]), np.bincount(fresh.joints[1]))
    outside = meshio.read(path)
    assert set(outside.field_data) >= {"voussoir 9", "joint 8", "left abutment"}
    assert outside.field_data["joint 8"].tolist() == [9, 1]


def test_an_unstructured_block_conforms_to_its_neighbours(stack):
    """A block without corners is meshed freely, with the nodes of the joints it shares."""
    top = stack.blocks[2]
    free = af.Block((*top.outline, (0.0, 2.5)), top.material, top.name, part=top.part)
    structure = replace(stack, blocks=(*stack.blocks[:2], free))
    made = generate_mesh(structure, af.models.Discretisation(cells=(4, 4), cell="triangle"))
    assert np.bincount(made.joints[1]).tolist() == [4, 4]
    model = af.build(structure, fidelity="full", cells=(4, 4), cell="triangle")
    weight = model.mass_influence[:, 1].sum() * 9.81
    assert weight == pytest.approx(20e3 * 2.25, rel=1e-10)


def test_the_mesh_of_another_structure_is_refused(ring, stack, tmp_path):
    path = tmp_path / "ring.msh"
    write_mesh(ring, path, af.models.Discretisation(cells=(1, 1)))
    with pytest.raises(af.errors.MeshError, match="of another structure"):
        read_mesh(stack, path)
    narrower = af.circular_arch(radius=2.95, thickness=0.50, embrace=159.0, voussoirs=17)
    with pytest.raises(af.errors.MeshError, match="facets cover"):
        read_mesh(narrower, path)


def test_a_file_that_is_not_there(ring):
    with pytest.raises(af.InvalidInput, match=r"no mesh file none\.msh"):
        read_mesh(ring, "none.msh")


@pytest.mark.parametrize("hidden", ["", "\n", "// $MeshFormat\n", "$Comments\n$EndComments\n"])
def test_a_script_is_not_a_mesh_and_is_never_run(stack, tmp_path, hidden):
    mark, path = tmp_path / "ran", tmp_path / "script.msh"
    path.write_text(f'{hidden}SystemCall "touch {mark}";\n')
    with pytest.raises(
        af.errors.MeshError, match=r"does not begin with \$MeshFormat.*run it as a script"
    ):
        read_mesh(stack, path)
    assert not mark.exists()


def test_nothing_beside_or_behind_a_mesh_is_run(stack, tmp_path):
    """Gmsh merges the options beside a file, a script; text after the last section is ignored."""
    mark, path = tmp_path / "ran", tmp_path / "stack.msh"
    write_mesh(stack, path)
    call = f'SystemCall "touch {mark}";\n'
    path.with_suffix(".msh.opt").write_text(call)
    path.write_bytes(path.read_bytes() + call.encode())
    read_mesh(stack, path)
    assert not mark.exists()


HEAD = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"


@pytest.mark.parametrize(
    ("text", "ending"),
    [
        (HEAD + "{call}", "msh"),
        (HEAD + "{call}", "geo"),
        ("$MeshFormat;\n{call}", "msh"),
        ("$MeshFormat\n2.2 0 8\n{call}$EndMeshFormat\n", "msh"),
        (HEAD + "$Comments\n{call}$EndComments\n", "msh"),
        (HEAD + "$InterpolationScheme\n{call}$EndInterpolationScheme\n", "msh"),
        (HEAD + "$View\n{call}$EndView\n$ONELAB\n{call}$EndONELAB\n", "opt"),
        ('Include "{other}";\n', "msh"),
        ('Merge "{other}";\n', "step"),
        ("{call}", "brep"),
    ],
)
def test_no_file_of_any_name_runs_code(stack, tmp_path, text, ending):
    """Scripts of gmsh behind a header, in known sections, and in files named elsewhere."""
    mark, other = tmp_path / "ran", tmp_path / "other.geo"
    call = f'SystemCall "touch {mark}";\n'
    other.write_text(call)
    path = tmp_path / f"hostile.{ending}"
    path.write_text(text.format(call=call, other=other))
    with pytest.raises(af.errors.MeshError):
        read_mesh(stack, path)
    link = tmp_path / "link.msh"
    link.symlink_to(path)
    with pytest.raises(af.errors.MeshError):
        read_mesh(stack, link)
    assert not mark.exists()


def test_a_face_of_several_chords_gets_a_cell_for_each():
    ring = af.circular_arch(radius=1.0, thickness=0.2, embrace=90.0, voussoirs=3, chords=4)
    assert len(generate_mesh(ring, af.models.Discretisation(cells=(2, 2))).blocks) == 3 * 8 + 2 * 2


def test_a_file_that_is_no_mesh(stack, tmp_path):
    path = tmp_path / "bad.msh"
    path.write_text("not a mesh")
    with pytest.raises(af.errors.MeshError):
        read_mesh(stack, path)


def viaduct(**parts):
    """Two spans with fill, piers and sidewalls that rise above the springing."""
    return af.bridge(
        arches=[
            af.shapes.Arch(
                measured="centre line",
                span=4.0,
                embrace=150.0,
                thickness=0.5,
                voussoirs=9,
                name="left arch",
            ),
            af.shapes.Arch(
                measured="centre line",
                span=5.0,
                embrace=140.0,
                thickness=0.5,
                voussoirs=11,
                name="right arch",
            ),
        ],
        piers=[af.shapes.Pier(gap=1.2, height=1.0, name="pier")],
        sidewalls=[
            af.shapes.Sidewall(length=2.0, height=1.0, name="left wall"),
            af.shapes.Sidewall(length=6.0, height=1.0, above=0.8, setback=0.1, name="right wall"),
        ],
        backfill=af.shapes.Backfill(cover=0.4),
        **parts,
    )


def one_arch(**parts):
    """One span between fixed abutments, with fill that ends in wedges on the springings."""
    ring = af.shapes.Arch(
        measured="centre line", span=5.0, embrace=160.0, thickness=0.5, voussoirs=13
    )
    return af.bridge(arches=[ring], backfill=af.shapes.Backfill(cover=0.3), **parts)


def scaled_jacobians(cells):
    """Least scaled Jacobian of each cell: 1 for squares and equilateral triangles, 0 for lines."""
    points = cells.places[np.array(cells.polygons)]
    ahead = np.roll(points, -1, axis=1) - points
    behind = np.roll(ahead, 1, axis=1)
    turn = behind[..., 0] * ahead[..., 1] - behind[..., 1] * ahead[..., 0]
    sine = turn / np.linalg.norm(ahead, axis=2) / np.linalg.norm(behind, axis=2)
    best = 1.0 if points.shape[1] == 4 else np.sqrt(3.0) / 2.0
    return sine.min(axis=1) / best


# with more cells than one, an even and an odd number of each kind
SOUND = {(one_arch, "triangle", 2), (one_arch, "quadrilateral", 2)}


@pytest.mark.parametrize(
    ("make", "cell", "count"),
    [
        pytest.param(*each, marks=() if each in SOUND else pytest.mark.slow)
        for each in product((viaduct, one_arch), ("quadrilateral", "triangle"), (1, 2, 3, 4, 6))
    ],
)
def test_meshes_of_bridges_are_sound(make, cell, count):
    """Sharp wedges and strips between stones included; slender triangles lie in slender stones."""
    structure = make(paving=af.shapes.Paving(thickness=0.2))
    cells = af.build(structure, fidelity="full", cells=(count, count), cell=cell).cells
    quality = scaled_jacobians(cells)
    stones = np.array([b.corners is not None for b in structure.blocks])[cells.owner]
    assert quality[~stones].min() > 0.15
    assert quality.min() > (0.15 if cell == "quadrilateral" else 0.05)


def outer_edges(cells, places):
    """Edges that only one cell has, as pairs of places (e, 2)."""
    own = places[np.array(cells.polygons)]
    pairs = np.sort(np.stack([own, np.roll(own, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    edges, times = np.unique(pairs, axis=0, return_counts=True)
    assert times.max() == 2
    return edges[times == 1]


@pytest.mark.parametrize(
    ("make", "cell"), each_once((viaduct, one_arch), ("quadrilateral", "triangle"))
)
def test_cells_of_touching_blocks_meet(make, cell):
    """Patch test, all of stone and stuck together: a uniform strain needs forces at the rim alone.

    The rim, edges of one cell, is as long as the blocks' outlines less twice the joints.
    """
    structure = make()
    blocks = tuple(replace(block, material=af.STONE) for block in structure.blocks)
    structure = replace(structure, blocks=blocks)
    model = af.build(structure, fidelity="full", cells=(3, 4), cell=cell)
    points, places = np.unique(model.cells.places.round(9), axis=0, return_inverse=True)
    rim = outer_edges(model.cells, places.ravel())
    length = np.linalg.norm(points[rim[:, 0]] - points[rim[:, 1]], axis=1).sum()
    free = set(structure.free)
    outlines = [structure.blocks[number].points for number in free]
    around = sum(np.linalg.norm(np.roll(p, 1, axis=0) - p, axis=1).sum() for p in outlines)
    inner = sum(joint.depth for joint in structure.joints if free.issuperset(joint.blocks))
    assert length == pytest.approx(around - 2.0 * inner, rel=1e-9)
    stretched = model.cells.places @ np.array([[1e-3, 2e-4], [-5e-4, 3e-4]])
    forces = np.zeros((len(points), 2))
    np.add.at(forces, places.ravel(), (model.block_stiffness @ stretched.ravel()).reshape(-1, 2))
    inside = np.setdiff1d(np.arange(len(points)), rim)
    assert np.abs(forces[inside]).max() < 1e-9 * np.abs(forces).max()
    held = [not free.issuperset(joint.blocks) for joint in structure.joints]
    between = ~np.array(held)[model.operator.points.joint]
    for gaps in (model.operator.opening, model.operator.slip):
        assert np.abs((gaps @ stretched.ravel())[between]).max() < 1e-12


@pytest.mark.parametrize(
    "cell", [pytest.param("quadrilateral", marks=pytest.mark.slow), "triangle"]
)
def test_supports_of_a_bridge_carry_its_weight(cell):
    structure = viaduct(paving=af.shapes.Paving(thickness=0.2))
    made = af.build(structure, fidelity="full", cells=(2, 2), cell=cell)
    joints, carried = af.dead_load(made, af.statics.Newton(tolerance=1e-13)).joints, np.zeros(2)
    for k, joint in enumerate(structure.joints):
        fixed = [structure.blocks[number].fixed for number in (joint.lower, joint.higher)]
        if any(fixed):
            push = float(joints["N"][k]) * structure.normals[k]
            push -= float(joints["V"][k]) * joint.tangent  # both act on the higher block
            carried += push if fixed[0] else -push
    assert carried == pytest.approx([0.0, structure.weight], abs=1e-9 * structure.weight)


def test_soil_has_the_cells_that_its_stones_impose():
    """Four on each extrados, and cells inside that grow to the given size at most."""
    structure = viaduct()
    soil = next(k for k, block in enumerate(structure.blocks) if block.name == "backfill")
    stones = {k for k, block in enumerate(structure.blocks) if block.part.endswith("arch")}
    pairs = [set(joint.blocks) for joint in structure.joints]
    extrados = [k for k, pair in enumerate(pairs) if soil in pair and pair & stones]
    assert len(extrados) == 20
    counts = []
    for coarse in (None, 0.3, 0.2):
        made = generate_mesh(structure, af.models.Discretisation(max_cell_size=coarse))
        assert set(np.bincount(made.joints[1])[extrados]) == {4}
        counts.append(np.sum(made.blocks == soil))
    area = structure.blocks[soil].area
    assert counts[0] < counts[1] < counts[2]
    assert counts[1] > 0.8 * area / 0.3**2
    assert counts[2] > 0.8 * area / 0.2**2


def block(name, *outline, corners=(0, 1, 2, 3), fixed=False):
    """A stone, by default with a structured mesh."""
    return af.Block(outline, af.STONE, name, fixed=fixed, corners=corners)


def box(name, left, right, low, high, **given):
    """A rectangular stone."""
    return block(name, (left, high), (left, low), (right, low), (right, high), **given)


def wall_in_bond():
    """Stones across the joints of the course below, one three times as wide as its neighbour."""
    rows = ([0.0, 1.0, 4.0], [0.0, 2.0, 4.0], [0.0, 0.7, 2.5, 4.0])
    stones = [box("ground", 0.0, 4.0, -0.3, 0.0, fixed=True)]
    for k, ends in enumerate(rows):
        stones += [
            box(f"stone {k}.{n}", left, right, 0.5 * k, 0.5 * k + 0.5)
            for n, (left, right) in enumerate(pairwise(ends))
        ]
    return af.masonry.assembled(stones, af.masonry.STONE_TO_STONE)


@pytest.mark.parametrize(
    ("cell", "cells"), each_once(("quadrilateral", "triangle"), ((1, 1), (4, 4), (2, 5)))
)
def test_stones_in_bond_fit(cell, cells):
    """Opposite sides agree although a long side faces two short ones."""
    made = af.build(wall_in_bond(), fidelity="full", cells=cells, cell=cell).cells
    of_block = np.bincount(made.owner)[1:]
    assert of_block.min() >= cells[0] * cells[1] * (1 if cell == "quadrilateral" else 2)
    assert scaled_jacobians(made).min() > (0.3 if cell == "quadrilateral" else 0.05)


def test_neighbours_that_wish_different_numbers_take_the_larger():
    """The side of one stone is the bed of another."""
    low, high = box("low", 0.0, 1.0, 0.0, 1.0), box("high", 0.0, 1.0, 1.0, 2.0)
    high = replace(high, corners=(1, 2, 3, 0))
    ground = box("ground", 0.0, 1.0, -0.3, 0.0, fixed=True)
    made = generate_mesh(
        af.masonry.assembled([ground, low, high], af.masonry.STONE_TO_STONE),
        af.models.Discretisation(cells=(2, 5)),
    )
    assert np.bincount(made.blocks).tolist() == [5, 25, 10]
    assert np.bincount(made.joints[1]).tolist() == [5, 5]


def test_cells_of_a_long_stone_are_not_absurdly_long():
    """No longer than twice its thickness: ten cells in eight metres of 0.4 m."""
    ground = box("ground", 0.0, 8.0, -0.3, 0.0, fixed=True)
    made = generate_mesh(
        af.masonry.assembled([ground, box("bed", 0.0, 8.0, 0.0, 0.4)], af.masonry.STONE_TO_STONE),
        af.models.Discretisation(cells=(2, 2)),
    )
    assert np.bincount(made.joints[1]).tolist() == [10]


def test_sides_that_cannot_agree():
    """Round a spiral a stone's end is one side of its beginning and another stone besides."""
    turns = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]
    rays = [[(r * x, r * y) for r in (1.0, 2.0)] for x, y in turns]
    stones = [
        block(f"stone {k}", a[0], a[1], b[1], b[0]) for k, (a, b) in enumerate(pairwise(rays))
    ]
    stones.append(block("last", rays[3][0], rays[3][1], (3.0, 0.0), rays[0][0]))
    stones.append(block("rest", (2.0, 0.0), (3.0, 0.0), (3.0, 1.0), (2.5, 1.0), fixed=True))
    with pytest.raises(af.errors.MeshError, match="leaving out their corners"):
        generate_mesh(
            af.masonry.assembled(stones, af.masonry.STONE_TO_STONE),
            af.models.Discretisation(cells=(2, 2)),
        )
    free = replace(stones[3], corners=None)
    assert generate_mesh(
        af.masonry.assembled([*stones[:3], free, stones[4]], af.masonry.STONE_TO_STONE),
        af.models.Discretisation(cells=(2, 2)),
    )


def test_an_outline_that_crosses_itself():
    ground = box("ground", 0.0, 1.0, -0.3, 0.0, fixed=True)
    bow = block("bow", (0.0, 0.0), (1.0, 0.0), (0.4, 2.0), (0.6, 2.0), corners=None)
    with pytest.raises(af.InvalidStructure, match="'bow' crosses or touches itself"):
        af.masonry.assembled([ground, bow], af.masonry.STONE_TO_STONE)


@pytest.mark.parametrize("cells", [8, pytest.param(16, marks=pytest.mark.slow)])
def test_cells_of_outlines_refine_their_inside_too(cells):
    """The first mode of a clamped beam of eight stones, 84.90 Hz by elements of a program apart."""
    places = [-1.0, *np.linspace(0.0, 4.0, 9), 5.0]
    material = af.Material(20e9, 0.2, 2400.0 * 9.81)
    blocks = [
        af.Block(
            ((a, 0.0), (b, 0.0), (b, 0.5), (a, 0.5)),
            material,
            f"stone {k}",
            fixed=k in (0, 9),
            part="beam",
            role="ring",
        )
        for k, (a, b) in enumerate(pairwise(places))
    ]
    beam = af.masonry.assembled(blocks, af.Contact(1e14, 1e14, friction=None))
    made = af.build(beam, fidelity="full", cells=(cells, cells))
    found = float(af.modes(made, 1, start="closed").frequencies[0])
    assert found == pytest.approx(84.90, rel=0.45 / cells**2)  # of second order
