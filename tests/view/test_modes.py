"""Pictures of vibration shapes."""

import numpy as np
import pytest

import archfem as af
from archfem.view import draw_modes


def drawn(axes):
    """Corners of the blocks that move, as drawn."""
    (blocks,) = [each for each in axes.collections if each.get_gid() == "blocks"]
    return [path.vertices[:-1] for path in blocks.get_paths()]


def test_picture_of_shapes(ring_model):
    found = af.modes(ring_model, 3, start="closed")
    axes = draw_modes(found, [1, 3]).axes
    assert axes[0].get_title() == "mode 1: 8.08 Hz\neffective mass: x 72 %, y 0 %"
    assert axes[1].get_title().startswith("mode 3: 27.75 Hz")
    blocks = drawn(axes[0])
    assert len(blocks) == len(ring_model.cells.polygons)
    cells, size = ring_model.cells, ring_model.structure.size
    moves = cells.displacement(found.shapes[:, 0])
    moved = cells.places + 0.04 * size * moves / np.linalg.norm(moves, axis=1).max()
    for corner in np.concatenate(blocks):
        assert np.linalg.norm(moved - corner, axis=1).min() < 1e-9 * size
    for numbers in ([], [0], [4]):
        with pytest.raises(af.InvalidInput, match="cannot be drawn: there are 1 to 3"):
            draw_modes(found, numbers)
