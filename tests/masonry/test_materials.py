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
        (lambda: af.Contact(1e9, 1e9, 0.5, dilatancy=15.0), "dilatancy 15 .* between 0 and 0.5"),
        (lambda: af.Contact(1e9, 1e9, 0.5, dilatancy=-0.1), "dilatancy -0.1"),
        (lambda: af.Contact(1e9, 1e9, None, dilatancy=0.1), "never slides does not dilate"),
        (lambda: af.Contact(1e9, 1e9, 0.5, tension=-1.0), "tension -1"),
        (lambda: af.Contact(1e9, 1e9, 0.5, cohesion=1e3, tension=2.1e3), "between 0 and 2e.03 Pa"),
    ],
)
def test_wrong_units_are_refused(make, says):
    with pytest.raises(af.errors.InvalidInput, match=says):
        make()


def test_tension_goes_up_to_the_apex_of_coulombs_limit():
    assert af.Contact(1e9, 1e9, 0.5, cohesion=1e3, tension=2e3).tension == 2e3
    assert af.Contact(1e9, 1e9, None, tension=5e4).tension == 5e4
    assert af.Contact(1e9, 1e9, 0.0, tension=5e4).dilatancy == 0.0
