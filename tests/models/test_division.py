"""Into how many cells edges are cut: alike on both sides, and dealt evenly."""

import numpy as np
import pytest

import archfem as af
from archfem.models.fem.division import divided


def one_arch(**parts):
    """One span between fixed abutments, with fill that ends in wedges on the springings."""
    ring = af.shapes.Arch(span=5.0, embrace=160.0, thickness=0.5, voussoirs=13)
    return af.bridge(arches=[ring], backfill=af.shapes.Backfill(cover=0.3), **parts)


def cells_on_edges(structure, meshing):
    """Middles of the edges of blocks that can move (m, 2), and the cells on each (m,)."""
    division = divided(structure, meshing)
    own = np.unique(np.concatenate([division.edges.around[k] for k in structure.free]))
    middles = division.edges.points[division.edges.ends[own]].mean(axis=1)
    return middles, np.array([len(division.stations[edge]) - 1 for edge in own])


@pytest.mark.parametrize("cells", [(2, 2), (3, 5), (4, 4)])
@pytest.mark.parametrize("cell", ["quadrilateral", "triangle"])
@pytest.mark.parametrize("make", ["ring of 16", "ring in chords", "fill", "fill on chords"])
def test_mirror_images_are_cut_alike(make, cell, cells):
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
    """Fill asks an even number of each of three chords, six in all: the intrados has two each."""
    made = one_arch(chords=3)
    division = divided(made, af.models.Discretisation(cells=(2, 2)))
    keystone = next(k for k, each in enumerate(made.blocks) if each.name == "arch, voussoir 7")
    faces = division.edges.sides[keystone]
    found = [[len(division.stations[edge]) - 1 for edge in side] for side in faces]
    assert sorted(found) == [[2], [2], [2, 2, 2], [2, 2, 2]]
