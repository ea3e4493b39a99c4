"""Settings that are constant over a film: magnification, and the view."""

import numpy as np

import archfem as af
from archfem.view.films.settings import Setup


def test_a_support_that_moved_is_drawn_where_it_is(model):
    """All of the ring 5 cm to the left, supports too: the same picture, moved with its frame."""
    moved = model
    for block in (0, 18):
        moved = moved.settled(af.Settlement(block, (-0.05, 0.0, 0.0)))
    setups = [
        Setup.of(each, af.dead_load(each).q[None], "displacement", 1.0) for each in (model, moved)
    ]
    np.testing.assert_allclose(setups[1].low, setups[0].low - [0.05, 0.0], atol=1e-4)


def test_the_automatic_magnification_shows_the_displacement(ring, model, run):
    fields = run.dataset["q"].values
    setup = Setup.of(model, fields, "displacement", None)
    largest = max(np.abs(model.cells.displacement(q)).max() for q in fields)
    shown = setup.magnification * largest / ring.size
    assert 0.6 * 0.06 < shown < 1.6 * 0.06
    assert Setup.of(model, 0.0 * fields, "displacement", None).magnification == 1.0
