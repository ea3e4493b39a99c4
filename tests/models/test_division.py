"""Numbers of cells along edges: equal on both sides, and dealt evenly."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from repeats import each_once
from scipy.integrate import quad

import archfem as af
from archfem.models.fem.mesh import (
    CellSizes,
    _check_cell_count,
    _grade_edges,
    _side_cells,
    divide_edges,
    find_edges,
)


def one_arch(**parts):
    """One span between fixed abutments, with fill that ends in wedges on the springings."""
    ring = af.shapes.Arch(
        measured="centre line", span=5.0, embrace=160.0, thickness=0.5, voussoirs=13
    )
    return af.bridge(arches=[ring], backfill=af.shapes.Backfill(cover=0.3), **parts)


def cells_on_edges(structure, meshing):
    """Middles of the edges of blocks that can move (m, 2), and the cells on each (m,)."""
    division = divide_edges(structure, meshing)
    own = np.unique(np.concatenate([division.edges.around[k] for k in structure.free]))
    middles = division.edges.points[division.edges.ends[own]].mean(axis=1)
    return middles, np.array([len(division.stations[edge]) - 1 for edge in own])


@pytest.mark.parametrize(
    ("make", "cell", "cells"),
    each_once(
        ("ring of 16", "ring in chords", "fill", "fill on chords"),
        ("quadrilateral", "triangle"),
        ((2, 2), (3, 5), (4, 4)),
    ),
)
def test_mirror_images_are_cut_equally(make, cell, cells):
    lengths = {"radius": 2.95, "thickness": 0.55, "embrace": 159.0, "voussoirs": 16}
    made = {
        "ring of 16": lambda: af.circular_arch(**lengths),
        "ring in chords": lambda: af.circular_arch(**lengths, chords=2),
        "fill": one_arch,
        "fill on chords": lambda: one_arch(chords=3),
    }[make]()
    middles, counts = cells_on_edges(made, af.models.Discretisation(cells=cells, cell=cell))
    x = middles[:, 0]
    turned = middles * [-1.0, 1.0] + [x.min() + x.max(), 0.0]
    away = np.linalg.norm(middles[:, None] - turned, axis=2)
    assert away.min(axis=0).max() < 1e-9
    assert counts[away.argmin(axis=0)].tolist() == counts.tolist()


def test_cells_forced_by_another_side_are_dealt_evenly():
    """Fill needs an even number on each of three chords, six in all: the intrados has two each."""
    made = one_arch(chords=3)
    division = divide_edges(made, af.models.Discretisation(cells=(2, 2)))
    keystone = next(k for k, each in enumerate(made.blocks) if each.name == "arch, voussoir 7")
    faces = division.edges.sides[keystone]
    found = [[len(division.stations[edge]) - 1 for edge in side] for side in faces]
    assert sorted(found) == [[2], [2], [2, 2, 2], [2, 2, 2]]


def slab(length, height=1.0, corners=(1, 2, 3, 0)):
    """A slab on a support as long."""
    outline = ((0.0, 0.0), (length, 0.0), (length, height), (0.0, height))
    below = ((0.0, -0.5), (length, -0.5), (length, 0.0), (0.0, 0.0))
    given = {"part": "wall", "role": "pier"}
    base = af.Block(below, af.STONE, "base", True, corners=(1, 2, 3, 0), **given)
    made = af.Block(outline, af.STONE, "slab", corners=corners, **given)
    contact = af.masonry.STONE_TO_STONE
    return af.Structure((base, made), (af.Joint((0, 1), *outline[:2], contact, "bed", **given),))


@pytest.mark.parametrize(
    ("length", "along"), [(3.9, 2), (4.0, 2), (4.0 + 1.5e-6, 2), (4.1, 3), (0.24, 1), (6.1, 4)]
)
def test_cells_are_twice_as_long_as_a_stone_is_thick_at_most(length, along):
    """A slab a metre high has one cell through its thickness; a millionth of a cell adds none.

    Where it is less than half a metre long, it is its height that is cut: at 0.24 m by three.
    """
    edges = find_edges(slab(length), [1, 1])
    discretisation = af.models.Discretisation(cells=(1, 1))
    wanted = _side_cells(edges, 1, discretisation)
    assert sorted(wanted) == sorted([along, 1] if length > 0.5 else [1, 3])
    assert _side_cells(edges, 0, discretisation) == [1, 1]  # a support does not deform
    assert sorted(_side_cells(edges, 1, af.models.Discretisation(cells=(5, 7)))) == [5, 7]


def test_a_mesh_has_a_million_cells_at_most():
    """Those of the slab, and of its support, which has one along; free ones by their size."""
    edges = find_edges(slab(2.0), [1, 1])
    _check_cell_count(edges, af.models.Discretisation(cells=(1000, 999)))
    with pytest.raises(af.errors.MeshError, match=r"a mesh of 1e.06 cells, and there is room for"):
        _check_cell_count(edges, af.models.Discretisation(cells=(1000, 1000)))
    free = find_edges(slab(2.0, corners=None), [1, 1])
    for size, fits in ((0.0014144, True), (0.0014140, False)):
        discretisation = af.models.Discretisation(cells=(1, 1), max_cell_size=size)
        if fits:
            _check_cell_count(free, discretisation)
        else:
            with pytest.raises(af.errors.MeshError, match="a mesh of 1e"):
                _check_cell_count(free, discretisation)


def test_cells_grow_with_the_distance_from_fine_ones():
    """By 0.35 of the distance from the end of the nearest, up to the largest size."""
    sizes = CellSizes(np.array([[0.0, 0.0], [10.0, 0.0]]), np.array([0.2, 0.4]), 1.0)
    places = np.array([[0.05, 0.0], [0.1, 0.0], [1.1, 0.0], [9.0, 0.0], [5.0, 0.0], [0.0, -1.1]])
    known = [0.2, 0.2, 0.2 + 0.35, 0.4 + 0.35 * 0.8, 1.0, 0.2 + 0.35]
    assert sizes.evaluate(places) == pytest.approx(known)


def test_an_edge_far_from_stones_has_as_many_cells_as_fit():
    """∫ ds over the size, by SciPy; the largest is 4 A / P over the number along."""
    structure = slab(3.0, 2.0, corners=None)
    discretisation = af.models.Discretisation(cells=(8, 5), cell="triangle")
    made = divide_edges(structure, discretisation)
    edges, size = made.edges, made.sizes[1]
    assert size.max_size == pytest.approx(4.0 * 6.0 / 10.0 / 5.0)
    assert size.lengths == pytest.approx(3.0 / 8.0)
    assert sorted(size.middles[:, 0]) == pytest.approx(3.0 * (np.arange(8) + 0.5) / 8.0)
    for edge in edges.around[1]:
        ends = edges.points[edges.ends[edge]]
        if (ends[:, 1] == 0.0).all():
            continue
        length = np.linalg.norm(ends[1] - ends[0])

        def density(s, ends=ends, length=length):
            return length / float(size.evaluate(ends[0] + s * (ends[1] - ends[0])))

        fit = quad(density, 0.0, 1.0, limit=200)[0]
        stations = made.stations[edge]
        assert len(stations) - 1 == round(fit)
        for first, last in pairwise(stations):
            share = quad(density, first, last, limit=200)[0] * (len(stations) - 1) / fit
            assert share == pytest.approx(1.0, abs=0.01)  # of 500 pieces each


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_an_edge_between_blocks_has_the_cells_of_the_finer(order):
    """The order of blocks does not matter; edges through a structured block are not cut."""
    edges = SimpleNamespace(
        structured=[2],
        around={0: np.array([0, 1]), 1: np.array([1, 2]), 2: np.array([2])},
        points=np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 3.0]]),
        ends=np.array([[0, 1], [1, 2], [2, 0]]),
        lengths=np.array([1.0, 3.0, 10.0**0.5]),
    )
    sizes = {
        number: SimpleNamespace(
            evaluate=lambda places, size=(0.5, 0.2)[number]: np.full(len(places), size)
        )
        for number in order
    }
    found = _grade_edges(edges, sizes)
    assert {edge: through[-1] for edge, through in found.items()} == pytest.approx(
        {0: 1.0 / 0.5, 1: 3.0 / 0.2}
    )
    assert np.diff(found[1], 2) == pytest.approx(0.0, abs=1e-12)
