"""Polygons that cover the blocks."""

import pytest


def test_rims_run_once_around_each_block(ring_model):
    cells = ring_model.cells
    start, end = cells.places[cells.rims].transpose(1, 0, 2)
    twice = start[:, 0] * end[:, 1] - end[:, 0] * start[:, 1]
    for number in ring_model.structure.free:
        own = cells.block[cells.rims[:, 0]] == number
        block_ = ring_model.structure.blocks[number]
        # The mesh has four chords where the block has arcs: 0.02 % of its area.
        assert abs(twice[own].sum()) / 2.0 == pytest.approx(block_.area, rel=5e-4)
