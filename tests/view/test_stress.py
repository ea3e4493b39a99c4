"""Maps of stress in the blocks."""

import numpy as np
import pytest
from pictures import drawn

import archfem as af
from archfem.view import draw_stress


@pytest.fixture(scope="module")
def backfilled():
    """A bridge of one arch below soil."""
    arch = af.shapes.Arch(span=6.0, rise=1.5, thickness=0.4, voussoirs=5)
    return af.bridge(arches=[arch], backfill=af.shapes.Backfill(cover=0.3), width=3.0)


@pytest.fixture(scope="module")
def dead(ring_model):
    return af.dead_load(ring_model)


def test_the_map_shows_compression_at_corners_with_thrust_line_and_crosses(ring_model, dead):
    figure = draw_stress(ring_model, dead.q)
    shown = drawn(figure, "compression").get_array() * af.units.MPa
    assert shown.max() == pytest.approx(
        float(af.statics.strength_use(ring_model, dead.q)["compression"].max())
    )
    assert shown.min() >= 0.0
    bar = figure.axes[0].child_axes[0]
    assert bar.get_ylabel() == "compression [MPa]"
    assert drawn(figure, "thrust").get_xydata().shape == (18, 2)
    crosses = figure.axes[0].findobj(lambda artist: artist.get_label() == "compression")[0]
    directions = np.diff(np.array(crosses.get_segments()), axis=1)[:, 0]
    middles = np.array(crosses.get_segments()).mean(axis=1)
    radial = np.abs(np.sum(directions * middles, axis=1))
    apart = np.linalg.norm(directions, axis=1) * np.linalg.norm(middles, axis=1)
    assert np.median(radial / apart) < 0.2  # compression follows the ring


@pytest.mark.slow
def test_the_map_of_one_part_has_its_own_scale(backfilled):
    """Soil is left out unless it is requested; there stresses are kPa."""
    model = af.build(backfilled, fidelity="full", cells=(2, 2))
    q = af.dead_load(model).q
    labels = [
        draw_stress(model, q, parts=parts).axes[0].child_axes[0].get_ylabel()
        for parts in (None, ["backfill"])
    ]
    assert labels == ["compression [MPa]", "compression [kPa]"]
    with pytest.raises(af.InvalidInput, match=r"parts \['deck'\] cannot be shaded: .*'backfill'"):
        draw_stress(model, q, parts=["deck"])


@pytest.mark.slow
def test_under_rigid_stones_the_soil_is_shaded(backfilled):
    """Rigid stones have no stress, and a map of none would have a scale without meaning."""
    model = af.build(backfilled, fidelity={"backfill": "full", "rest": "rigid"}, cells=(2, 2))
    q = af.dead_load(model).q
    shown, alone = (
        drawn(draw_stress(model, q, parts=parts), "compression").get_array()
        for parts in (None, ["backfill"])
    )
    assert shown.max() == alone.max() > 1.0  # [kPa]
