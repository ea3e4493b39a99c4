"""Pictures of a block cut free: arrows where forces act, and a polygon that closes."""

from pathlib import Path

import numpy as np
import pytest

import archfem as af
from archfem.view import draw_free_body

BRIDGE = Path(__file__).parents[2] / "meshes" / "prusias.toml"


def arrows(axes):
    """Tails and heads of the arrows in axes (n, 2, 2)."""
    drawn = [each for each in axes.texts if getattr(each, "arrow_patch", None)]
    return np.array([(each.xyann, each.xy) for each in drawn])


def test_the_picture_shows_forces_where_they_act_and_a_closed_polygon(ring, ring_model):
    joints = af.dead_load(ring_model).joints
    figure = draw_free_body(ring, joints, "voussoir 5", cells=ring_model.cells)
    body = af.statics.forces_on(ring, joints, "voussoir 5", ring_model.cells)
    left, right = figure.axes
    beside = arrows(left)
    assert beside[:-1, 1] == pytest.approx(body.points[:-1])  # joints push at their points
    assert beside[-1, 0] == pytest.approx(body.points[-1])  # the weight hangs from the centroid
    ratio = np.linalg.norm(beside[:, 1] - beside[:, 0], axis=1) / body.sizes
    assert ratio == pytest.approx(ratio[0])
    chain = arrows(right)
    assert chain[1:, 0] == pytest.approx(chain[:-1, 1])
    assert chain[-1, 1] == pytest.approx(chain[0, 0], abs=1e-6 * body.sizes.max() / 1e3)
    assert sorted(np.linalg.norm(chain[:, 1] - chain[:, 0], axis=1)) == pytest.approx(
        sorted(body.sizes / 1e3)
    )
    assert right.get_title() == f"closes to {body.closing_error:.0e} of the largest force"
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert [word.split(":")[0] for word in words] == ["1  joint 4", "2  joint 5", "3  weight"]
    assert f"{body.sizes[0] / 1e3:.1f} kN" in words[0]


def test_an_open_joint_is_named_and_has_no_arrow():
    """Two stones side by side on the ground touch without a push."""

    def box(name, left, right, low, high, fixed=False):
        outline = ((left, low), (right, low), (right, high), (left, high))
        return af.Block(outline, af.STONE, name, fixed)

    stones = [box("a", 0.0, 1.0, 0.0, 1.0), box("b", 1.0, 2.0, 0.0, 1.0)]
    pair = af.masonry.assembled(
        [box("ground", 0.0, 2.0, -0.3, 0.0, True), *stones], af.masonry.STONE_TO_STONE
    )
    dead = af.dead_load(af.build(pair, fidelity="rigid"))
    figure = draw_free_body(pair, dead.joints, "a")
    figure.draw_without_rendering()
    left, right = figure.axes
    assert (len(arrows(left)), len(arrows(right))) == (2, 2)  # weight and ground
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert any(each.endswith("a to b: open") for each in words)


def test_a_polygon_of_too_many_forces_is_refused():
    bridge = af.Case.read(BRIDGE).structure
    joints = af.joints.joint_dataset(bridge, np.tile([1e4, 0.0, 0.0], (len(bridge.joints), 1)))
    with pytest.raises(af.InvalidInput, match=r"'backfill' has \d+ joints: .* choose a stone"):
        draw_free_body(bridge, joints, "backfill")
