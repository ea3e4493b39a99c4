"""What a model is judged by before it is chosen."""

import numpy as np
import pytest
from mechanisms import filled, piers

import archfem as af
from archfem.dynamics.probe import peaks


def test_the_error_of_a_model_is_measured_on_rings_and_piers():
    model = af.build(filled(), fidelity="rigid")
    motion = af.Motion(np.array([0.0, 1.0, 0.0]), dt=0.05)
    run = af.time_history(model, motion, dt=0.01)
    own = abs(run.joints["eccentricity"]).max("time").values
    found = peaks(model, motion, None, 0.01)
    assert found == pytest.approx(own[: len(piers(chords=1).joints)])
