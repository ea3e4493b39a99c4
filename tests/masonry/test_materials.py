"""Materials and contacts in wrong units are refused."""

import pytest

import archfem as af


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: af.Material(30.0, 0.2, 20e3), "young 30 Pa"),
        (lambda: af.Material(30e9, 0.5, 20e3), "poisson 0.5"),
        (lambda: af.Material(30e9, 0.2, 2e6), "unit_weight 2e"),
        (lambda: af.Material(30e9, 0.2, 20e3, -1.0), "strength -1"),
        (lambda: af.Contact(1.48, 0.3e9), "normal_stiffness 1.48"),
        (lambda: af.Contact(1.48e9, 0.3e9, -0.1), "friction -0.1"),
    ],
)
def test_wrong_units_are_refused(make, says):
    with pytest.raises(af.errors.InvalidInput, match=says):
        make()
