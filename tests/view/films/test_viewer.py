"""pyvista's viewer of a run: blocks are where the history has them, at any time."""

import numpy as np
import pytest

import archfem as af
from archfem._optional import can_draw

pytestmark = pytest.mark.skipif(not can_draw(), reason="no library to draw with")


@pytest.fixture(scope="module")
def shaken():
    model = af.build(af.column(breadth=0.6, heights=[1.2, 1.2]), fidelity="rigid")
    motion = af.Motion.synthetic(seed=1, duration=0.4, pga=4.0)
    return model, af.time_history(model, motion, dt=0.01, record=af.Record(fields_every=4))


def test_the_slider_moves_the_blocks(shaken):
    model, run = shaken
    shown = af.view.viewer(run, model, magnification=3.0)
    blocks = shown._blocks
    for frame in (0, -1):
        shown.at(float(run.dataset["frame_time"][frame]))
        moved = model.cells.displacement(run.dataset["q"].values[frame])
        places = model.cells.places + 3.0 * moved
        assert blocks.points[:, :2].min(axis=0) == pytest.approx(places.min(axis=0), abs=1e-6)
        assert blocks.points[:, :2].max(axis=0) == pytest.approx(places.max(axis=0), abs=1e-6)
        assert np.ptp(blocks.points[:, 2]) == 0.0
        assert blocks["shade"].max() == pytest.approx(1e3 * np.hypot(*moved.T).max(), rel=1e-6)
    shown.plotter.close()


def test_a_run_without_fields_is_refused(shaken):
    model, _ = shaken
    run = af.time_history(model, af.Motion(np.array([0.0, 0.1, 0.0]), 0.01), dt=0.01)
    with pytest.raises(af.InvalidInput, match="no fields"):
        af.view.viewer(run, model)
