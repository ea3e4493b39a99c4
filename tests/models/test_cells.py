"""Polygons that cover the blocks."""

import numpy as np
import pytest
from scipy.sparse.linalg import lsqr

import archfem as af
from archfem.masonry.block import measure_polygon
from archfem.masonry.structure import rigid_motion_matrix


def test_rims_run_once_around_each_block(ring_model):
    cells = ring_model.cells
    start, end = cells.places[cells.outline_edges].transpose(1, 0, 2)
    twice = start[:, 0] * end[:, 1] - end[:, 0] * start[:, 1]
    for number in ring_model.structure.free:
        own = cells.block[cells.outline_edges[:, 0]] == number
        block_ = ring_model.structure.blocks[number]
        # The mesh has four chords where the block has arcs: 0.02 % of its area.
        assert abs(twice[own].sum()) / 2.0 == pytest.approx(block_.area, rel=5e-4)


@pytest.mark.parametrize("fidelity", ["rigid", "faces", "full"])
def test_an_inclined_load_has_the_arm_of_the_arc(fidelity):
    """Its work on a turn of the whole plane, although meshes have chords for the arc."""
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=9)
    model = af.build(ring, fidelity=fidelity, cells=(2, 2))
    push = af.PointLoad(-0.7, (2e3, -1.5e3))
    turned = rigid_motion_matrix(model.cells.places, np.zeros(2)) @ [0.0, 0.0, 1.0]
    of_free = np.isin(model.cells.block, ring.free)
    rows = np.repeat(of_free, 2)
    q = lsqr(model.cells.shape_functions[rows], turned[of_free].ravel(), atol=1e-14, btol=1e-14)[0]
    height = np.sqrt((2.95 + 0.275) ** 2 - 0.7**2)
    assert model.load(push) @ q == pytest.approx(-0.7 * -1.5e3 - height * 2e3, rel=1e-8)


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize(("cell", "corners"), [("quadrilateral", 4), ("triangle", 3)])
def test_cells_of_all_nodes_cover_the_blocks_once(cell, corners, degree):
    """Cells with any nodes between their corners."""
    stack = af.column(breadth=1.0, heights=[1.0, 2.0])
    cells = af.build(stack, cells=(2, 2), cell=cell, degree=degree).cells
    assert {len(polygon) for polygon in cells.polygons} == {corners}
    area = sum(measure_polygon(cells.places[polygon])[0] for polygon in cells.polygons)
    assert area == pytest.approx(3.0, rel=1e-12)


def test_edges_of_outlines_run_in_the_sense_of_their_cells(stack):
    """Anticlockwise: triangles from the origin to each edge of a block sum up to its area."""
    model = af.build(stack, fidelity="full", cells=(2, 3))
    cells = model.cells
    start, end = (cells.places[ends] for ends in cells.outline_edges.T)
    twice = start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0]
    for block in stack.free:
        own = cells.block[cells.outline_edges[:, 0]] == block
        assert 0.5 * twice[own].sum() == pytest.approx(stack.blocks[block].area)


@pytest.mark.parametrize(
    ("point", "fraction", "beside"),
    [
        ((1.2, 0.25), 0.25, (0.2, 0.0)),
        ((1.2, -0.3), None, (0.2, -0.3)),
        ((-0.1, 1.4), None, (-0.1, 0.4)),
        ((0.5, 0.9), 0.5, (0.0, -0.1)),
    ],
)
def test_the_nearest_place_of_a_block_is_on_its_rim(point, fraction, beside):
    """Of a unit square: within a side, or at a corner."""
    model = af.build(af.column(breadth=1.0, heights=[1.0]), fidelity="rigid")
    cells = model.cells
    low = cells.places.min(axis=0)
    ends, share, vector = cells.nearest_edge(1, low + point)
    assert vector == pytest.approx(beside)
    a, b = cells.places[ends]
    assert a + share * (b - a) - low == pytest.approx(np.subtract(point, beside))
    assert share in (0.0, 1.0) if fraction is None else share == pytest.approx(fraction)


def test_readings_of_many_states_are_those_of_each(ring):
    """A support moved: joints have gaps in the first place."""
    model = af.build(ring, fidelity="rigid").settled(af.Settlement(0, (-0.01, 0.002, 0.001)))
    observer = model.observer()
    states = 1e-4 * np.random.default_rng(1).normal(size=(3, model.size))
    assert observer.read_many(states) == pytest.approx(np.array([observer.read(q) for q in states]))
    assert np.abs(observer.read(np.zeros(model.size))).max() == pytest.approx(0.01, rel=0.1)
    assert model.face_mismatch(states[0]) == (0.0, "")
