"""Corners go where their blocks go."""

import numpy as np
import pytest

import archfem as af
from archfem.view.pages.player_data import Outlines
from archfem.view.positions import block_kinds


def test_chords_stay_near_their_arcs(ring):
    outlines = Outlines(ring)
    centre = np.array(ring.blocks[1].centre)
    for block, points in zip(ring.blocks, outlines.rings, strict=True):
        if block.centre is not None:
            half = len(points) // 2
            for arc in (points[:half], points[half:]):
                radii = np.linalg.norm(arc - centre, axis=1)
                middles = np.linalg.norm(0.5 * (arc[1:] + arc[:-1]) - centre, axis=1)
                assert np.ptp(radii) < 1e-9
                assert radii[0] - middles.min() < 2e-4 * ring.size
            # of the longer arc: one chord less would not
            arms = block.points[:2] - centre
            radius = np.linalg.norm(block.points - centre, axis=1).max()
            angle = np.arccos(arms[0] @ arms[1] / np.prod(np.linalg.norm(arms, axis=1)))
            assert radius * (angle / (half - 2)) ** 2 / 8.0 > 2e-4 * ring.size
    assert block_kinds(ring).count("support") == 2
    assert block_kinds(ring).count("stone") == 17


@pytest.mark.parametrize("displacements", ["small", "large"])
def test_corners_of_rigid_blocks_turn_with_them(ring, displacements):
    """q holds u, v and θ of each centroid, in the order of the blocks that move."""
    model, outlines = af.build(ring, fidelity="rigid", displacements=displacements), Outlines(ring)
    q = np.random.default_rng(0).normal(size=model.size) * 0.3
    moved = outlines.displacements(model, q[None])[0]
    for k, number in enumerate(ring.free):
        u, v, turn = q[3 * k : 3 * k + 3]
        own = outlines.block == number
        x, y = (outlines.points[own] - ring.blocks[number].centroid).T
        if displacements == "small":
            expected = [u - turn * y, v + turn * x]
        else:
            c, s = np.cos(turn), np.sin(turn)
            expected = [u + (c - 1.0) * x - s * y, v + s * x + (c - 1.0) * y]
        assert np.allclose(moved[own], np.column_stack(expected), atol=1e-12)


def test_corners_of_meshed_blocks_are_nodes(stack):
    model, outlines = af.build(stack, fidelity="full", cells=(1, 1)), Outlines(stack)
    cells, q = model.cells, np.random.default_rng(0).normal(size=model.size)
    moved = outlines.displacements(model, q[None])[0]
    nodes = cells.displacement(q)
    for point, number, found in zip(outlines.points, outlines.block, moved, strict=True):
        if stack.blocks[number].fixed:
            assert not found.any()
            continue
        same = (cells.block == number) & np.isclose(cells.places, point).all(axis=1)
        assert np.allclose(found, nodes[same], atol=1e-12)


def test_supports_that_moved_are_drawn_where_they_are(stack):
    base = next(number for number, block in enumerate(stack.blocks) if block.fixed)
    model = af.build(stack, fidelity="rigid")
    motions = np.zeros((len(stack.blocks), 3))
    motions[base] = [0.1, -0.2, 0.0]
    outlines = Outlines(stack)
    moved = outlines.displacements(model.with_support_motion(motions), np.zeros((1, model.size)))[0]
    assert np.allclose(moved[outlines.block == base], [0.1, -0.2])
    assert not moved[outlines.block != base].any()
