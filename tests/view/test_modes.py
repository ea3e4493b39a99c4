"""Pictures of vibration shapes."""

from dataclasses import replace

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


def test_a_mode_of_the_fill_alone_is_called_local(bridge):
    """Shapes of the first coordinates of a stone of a ring, of a sidewall, and of both."""
    model = af.build(bridge, fidelity="rigid")
    owner, shapes = model.cells.coordinate_owner, np.zeros((model.size, 3))
    roles = np.array([bridge.blocks[number].role for number in owner])
    ring, other = (np.flatnonzero(roles == role)[0] for role in ("ring", "other"))
    shapes[ring, 0] = shapes[other, 1] = shapes[other, 2] = 1.0
    shapes[ring, 2] = 0.6
    found = af.statics.Modes(model, np.arange(1.0, 4.0), shapes, model.mass_influence.sum(axis=0))
    assert found.local.tolist() == [False, True, False]
    figure = draw_modes(found)
    titles = [axes.get_title().partition("\n")[0] for axes in figure.axes]
    assert titles == ["mode 1: 1.00 Hz", "mode 2: 2.00 Hz, local", "mode 3: 3.00 Hz"]
    assert "local: other parts move more than twice as far" in figure.get_supxlabel()
    assert "local" not in draw_modes(found, [1]).get_supxlabel()


def test_no_mode_of_a_structure_without_rings_and_piers_is_local(stack):
    blocks, joints = ([replace(x, role="other") for x in y] for y in (stack.blocks, stack.joints))
    wall = replace(stack, blocks=tuple(blocks), joints=tuple(joints))
    found = af.modes(af.build(wall, fidelity="rigid"), 2)
    assert not found.local.any()
