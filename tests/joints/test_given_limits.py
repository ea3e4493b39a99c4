"""Given limits of friction: Coulomb's forces where they are his, and a symmetric tangent."""

import numpy as np
import pytest

import archfem as af
from archfem.statics.relaxation import TrescaJoints


@pytest.fixture(scope="module")
def pushed():
    """Three courses, the top one pushed beyond friction, and coordinates at which it slides."""
    model = af.build(af.column(breadth=1.0, heights=[1.0, 1.0]), fidelity="rigid")
    q = np.array([1e-6, -3e-5, 0.0, 2e-4, -5e-5, 1e-6])
    return model, q


def test_with_coulombs_limits_forces_are_coulombs(pushed):
    model, q = pushed
    joints = model.operator
    own = joints.coulomb_limit(*joints.law.forces_and_area(joints.openings(q)))
    given = TrescaJoints.of(joints, own)
    assert np.any(np.abs(joints.trial_shear(q)) > own)
    assert np.array_equal(given.force(q), joints.force(q))


def test_the_tangent_is_symmetric_and_the_derivative_of_the_force(pushed):
    model, q = pushed
    half = TrescaJoints.of(model.operator, 0.5 * np.abs(model.operator.trial_shear(q)))
    held = model.with_joint_law(half)
    tangent = held.tangent(q).toarray()
    assert tangent == pytest.approx(tangent.T, abs=1e-12 * np.abs(tangent).max())
    step = 1e-9
    columns = [
        (held.force(q + step * e) - held.force(q - step * e)) / (2.0 * step)
        for e in np.eye(model.size)
    ]
    assert tangent == pytest.approx(np.array(columns).T, abs=1e-6 * np.abs(tangent).max())


@pytest.mark.parametrize(("share", "holds"), [(0.98, True), (1.02, False)])
def test_the_tangent_along_is_elastic_below_the_limit_and_zero_beyond(pushed, share, holds):
    model, q = pushed
    elastic = np.abs(model.operator.trial_shear(q))
    held = TrescaJoints.of(model.operator, elastic / share)
    across = len(held.law.stiffness(held.effective_gaps(q)))
    along = held.stiffness(q)[across : across + len(elastic)]
    assert np.all(elastic > 0.0)
    assert np.array_equal(along, model.operator.points.shear_spring * holds)
