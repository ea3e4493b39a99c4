"""Meshes: what they cover, their files, and what is refused."""

from dataclasses import replace

import meshio
import numpy as np
import pytest

from archfem.errors import InvalidInput, MeshError
from archfem.mesh import Meshing, mesh, read_mesh, write_mesh
from archfem.models.full import full
from archfem.quadrature import Quadrature
from archfem.shapes import circular_arch, column
from archfem.space import broken_space
from archfem.structure import Block


@pytest.mark.parametrize(
    ("meshing", "cells", "facets"),
    [
        (Meshing(), 17 * 16 + 2 * 4, 18 * 4),
        (Meshing(2, 3), 17 * 6 + 2 * 2, 18 * 2),
        (Meshing(2, 3, "triangle"), 2 * (17 * 6 + 2 * 2), 18 * 2),
    ],
)
def test_numbers_of_cells_and_joint_facets(ring, meshing, cells, facets):
    made = mesh(ring, meshing)
    assert len(made.blocks) == cells
    assert np.bincount(made.joints[1]).tolist() == [facets // 18] * 18


def test_nodes_lie_on_the_circle(ring):
    """Four cells along a sector follow it by four chords: 1 - sin(φ/4)/(φ/4) is lost in weight."""
    model = full(broken_space(mesh(ring)), Quadrature())
    turn = np.radians(159.0) / 17 / 4
    weight = model.body[:, 1].sum() * ring.gravity
    assert weight / ring.weight == pytest.approx(np.sin(turn) / turn, rel=1e-10)


def test_a_chorded_ring_keeps_its_own_weight():
    ring = circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17, chords=2)
    model = full(broken_space(mesh(ring, Meshing(2, 6))), Quadrature())
    assert model.body[:, 1].sum() * ring.gravity == pytest.approx(ring.weight, rel=1e-10)


def test_file_and_back(ring, tmp_path):
    path = tmp_path / "ring.msh"
    write_mesh(ring, path, Meshing(2, 2))
    again, fresh = read_mesh(ring, path), mesh(ring, Meshing(2, 2))
    assert np.array_equal(np.bincount(again.blocks), np.bincount(fresh.blocks))
    assert np.array_equal(np.bincount(again.joints[1]), np.bincount(fresh.joints[1]))
    outside = meshio.read(path)
    assert set(outside.field_data) >= {"voussoir 9", "joint 8", "left abutment"}
    assert outside.field_data["joint 8"].tolist() == [9, 1]


def test_an_unstructured_block_conforms_to_its_neighbours(stack):
    """A block without corners is meshed freely, with the nodes of the joints it shares."""
    top = stack.blocks[2]
    free = Block((*top.outline, (0.0, 2.5)), top.material, top.name, part=top.part)
    made = mesh(replace(stack, blocks=(*stack.blocks[:2], free)), Meshing(4, 4, "triangle"))
    assert np.bincount(made.joints[1]).tolist() == [4, 4]
    weight = full(broken_space(made), Quadrature()).body[:, 1].sum() * 9.81
    assert weight == pytest.approx(20e3 * 2.25, rel=1e-10)


def test_the_mesh_of_another_structure_is_refused(ring, stack, tmp_path):
    path = tmp_path / "ring.msh"
    write_mesh(ring, path, Meshing(1, 1))
    with pytest.raises(MeshError, match="of another structure"):
        read_mesh(stack, path)
    narrower = circular_arch(radius=2.95, thickness=0.50, embrace=159.0, voussoirs=17)
    with pytest.raises(MeshError, match="facets cover"):
        read_mesh(narrower, path)


@pytest.mark.parametrize(
    ("make", "error", "says"),
    [
        (lambda: Meshing(0, 4), InvalidInput, "cells through = 0"),
        (lambda: Meshing(4, 2.5), InvalidInput, "cells along = 2.5"),
        (lambda: Meshing(cell="hexagon"), InvalidInput, "'hexagon' is not known"),
        (lambda: read_mesh(None, "none.msh"), InvalidInput, "no mesh file none.msh"),
    ],
)
def test_refusals(make, error, says):
    with pytest.raises(error, match=says):
        make()


def test_a_face_of_several_chords_gets_a_cell_for_each():
    ring = circular_arch(radius=1.0, thickness=0.2, embrace=90.0, voussoirs=3, chords=4)
    assert len(mesh(ring, Meshing(2, 2)).blocks) == 3 * 8 + 2 * 2


def test_a_file_that_is_no_mesh(stack, tmp_path):
    path = tmp_path / "bad.msh"
    path.write_text("not a mesh")
    with pytest.raises(MeshError):
        read_mesh(stack, path)


def test_degrees_beyond_two_are_refused():
    with pytest.raises(InvalidInput, match="degree 3"):
        broken_space(mesh(column(breadth=1.0, heights=[1.0]), Meshing(1, 1)), 3)
