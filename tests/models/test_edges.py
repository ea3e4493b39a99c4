"""Edges of blocks, cut where corners of others lie on them."""

import numpy as np
import pytest

import archfem as af
from archfem.models.fem.mesh import _insert_points_on_edges, find_edges

NEAR = 1e-6


@pytest.mark.parametrize("size", [0.02, 1.0, 50.0])
@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_points_on_an_edge_are_inserted_in_order(size, turn):
    """A square of any size: points within `NEAR` of either side, its ends left out."""
    square = size * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    on = size * np.array([[0.7, 0.0], [0.2, 0.0], [1.0, 0.5]])
    aside = [0.9 * NEAR, -0.9 * NEAR, 1.1 * NEAR, -1.1 * NEAR]
    beside = np.array([[0.4 * size, y] for y in aside])
    ends = np.array([[0.9 * NEAR, 0.0], [size - 0.9 * NEAR, 0.0]])
    inner = np.array([[1.1 * NEAR, 0.0], [size - 1.1 * NEAR, 0.0]])
    points = np.concatenate([square, on, beside, ends, inner])
    cosine, sine = np.cos(turn), np.sin(turn)
    points = points @ np.array([[cosine, sine], [-sine, cosine]])
    found = _insert_points_on_edges(np.arange(4), points, NEAR).tolist()
    low = [0, 13, 5, 7, 8, 4, 14, 1, 6, 2, 3]
    assert found == low or found == [0, 13, 5, 8, 7, 4, 14, 1, 6, 2, 3]


def test_a_joint_has_the_edges_that_both_blocks_have_between_its_ends():
    """A narrow block on a wide one: of the wide one's top only the part under it."""
    wide, narrow = af.column(breadth=1.0, heights=[0.5]), af.column(breadth=0.4, heights=[0.5])
    top = np.array(narrow.blocks[1].outline) + np.array([0.1, 0.5])
    upper = af.Block(tuple(map(tuple, top)), af.STONE, "upper", part="column", role="pier")
    contact = wide.joints[0].contact
    bed = af.Joint((1, 2), (-0.1, 0.5), (0.3, 0.5), contact, "bed", "column", "pier")
    blocks = (*wide.blocks, upper)
    structure = af.Structure(blocks, (*wide.joints, bed))
    found = find_edges(structure, [1] * 3)
    lengths = [found.lengths[edges].sum() for edges in found.joints]
    assert lengths == pytest.approx([1.0, 0.4])
    assert [len(edges) for edges in found.joints] == [1, 1]
    assert found.lengths[found.around[1]].sum() == pytest.approx(3.0)
    assert len(found.boundaries[1]) == 6
    assert sorted(found.structured + found.unstructured) == [0, 1, 2]


@pytest.mark.parametrize(("off", "points"), [(0.9e-6, 6), (1.1e-6, 8)])
@pytest.mark.parametrize("size", [0.05, 40.0])
def test_corners_are_one_up_to_a_millionth_of_the_structure(size, off, points):
    """A square on another, moved along their joint; both lie in a box of 1 by 2."""
    lower = size * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    shift = off * size * np.hypot(1.0, 2.0)
    upper = lower + np.array([shift, size])
    given = {"part": "pier", "role": "pier", "corners": (0, 1, 2, 3)}
    blocks = [
        af.Block(tuple(map(tuple, each)), af.STONE, name, name == "base", **given)
        for each, name in ((lower, "base"), (upper, "stone"))
    ]
    contact = af.masonry.STONE_TO_STONE
    bed = af.Joint((0, 1), (shift, size), (size, size), contact, "bed", "pier", "pier")
    found = find_edges(af.Structure(tuple(blocks), (bed,)), [1, 1])
    assert len(found.points) == points
