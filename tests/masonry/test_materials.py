"""Materials and contacts in wrong units are refused."""

import pytest

import archfem as af
from archfem.masonry import BACKFILL, SOIL_TO_STONE, STONE_TO_STONE


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: af.Material(30.0, 0.2, 20e3), "young of .* = 30.0 is not between"),
        (lambda: af.Material(30e9, 0.5, 20e3), "poisson of .* = 0.5 is not between"),
        (lambda: af.Material(30e9, 0.2, 2e6), "unit_weight of .* = 2000000.0 is not"),
        (lambda: af.Material(30e9, 0.2, 20.0), "looks like kN/m³: .* have 2e.04"),
        (lambda: af.Material(30e9, 0.2, 20e3, -1.0), r"5e6, = -1.0 is below 50000"),
        (lambda: af.Material(30e9, 0.2, 20e3, 9e3), "5 MPa are 5e6, = 9000.0 is below 50000"),
        (lambda: af.Contact(1.48, 0.3e9), "normal_stiffness of .* = 1.48 is not"),
        (lambda: af.Contact(1.48e9, 0.3e9, -0.1), "friction of .* = -0.1 is not"),
        (
            lambda: af.Contact(1e9, 1e9, 0.5, dilatancy=15.0),
            "dilatancy of .* = 15.0 .* between 0 and 0.5",
        ),
        (lambda: af.Contact(1e9, 1e9, 0.5, dilatancy=-0.1), "dilatancy of .* = -0.1 is not"),
        (lambda: af.Contact(1e9, 1e9, None, dilatancy=0.1), "never slides does not dilate"),
        (lambda: af.Contact(1e9, 1e9, 0.5, tension=-1.0), "tension of .* = -1.0 is not"),
        (lambda: af.Contact(1e9, 1e9, 0.5, cohesion=1e3, tension=2.1e3), "between 0 and 2000:"),
    ],
)
def test_wrong_units_are_refused(make, says):
    with pytest.raises(af.errors.InvalidInput, match=says):
        make()


def test_a_block_that_stands_for_a_press_may_weigh_more_than_any_material():
    with pytest.raises(af.errors.InvalidInput, match="stands_for='press'"):
        af.Material(30e9, 0.2, 1e6)
    assert af.Material(30e9, 0.2, 1e6, stands_for="press").unit_weight == 1e6
    with pytest.raises(af.errors.InvalidInput, match="and 250000"):
        af.Material(30e9, 0.2, 1e6, stands_for="")


def test_tension_goes_up_to_the_apex_of_coulombs_limit():
    assert af.Contact(1e9, 1e9, 0.5, cohesion=1e3, tension=2e3).tension == 2e3
    assert af.Contact(1e9, 1e9, None, tension=5e4).tension == 5e4
    assert af.Contact(1e9, 1e9, 0.0, tension=5e4).dilatancy == 0.0


def test_presets_are_those_of_table_2():
    """Demirel and Aldemir (2021), Table 2, copied a second time: k_n, k_s [MPa/mm], E [MPa]."""
    table = {"stone to stone": (1.48, 0.30), "soil to stone": (0.30, 0.24)}
    for name, (normal, shear) in table.items():
        contact = next(each for each in (STONE_TO_STONE, SOIL_TO_STONE) if each.name == name)
        assert contact.normal_stiffness == pytest.approx(1e9 * normal)
        assert contact.shear_stiffness == pytest.approx(1e9 * shear)
        assert contact.friction == 0.60
    stone, backfill = af.STONE, BACKFILL
    assert (stone.young, stone.poisson, stone.unit_weight, stone.strength) == (
        3e10,
        0.2,
        2e4,
        5.6e7,
    )
    assert (backfill.young, backfill.poisson, backfill.unit_weight) == (6.25e6, 0.2, 18e3)
    assert backfill.strength is None


BOUNDS = [
    (lambda x: af.Material(x, 0.2, 2e4), 1e3, 1e13),
    (lambda x: af.Material(3e10, x, 2e4), -1.0, 0.5),
    (lambda x: af.Material(3e10, 0.2, x), 1e-3, 1000.0),
    (lambda x: af.Material(3e10, 0.2, x), 4000.0, 250e3),
    (lambda x: af.Material(3e10, 0.2, 2e4, x), 5e4, None),
    (lambda x: af.Contact(x, 3e8), 1e3, 1e16),
    (lambda x: af.Contact(1.48e9, x), 1e3, 1e16),
    (lambda x: af.Contact(1.48e9, 3e8, x), 0.0, 10.0),
    (lambda x: af.Contact(1.48e9, 3e8, 0.6, cohesion=x), 0.0, 1e9),
    (lambda x: af.Contact(1.48e9, 3e8, 0.6, dilatancy=x), 0.0, 0.6),
    (lambda x: af.Contact(1.48e9, 3e8, None, tension=x), 0.0, 1e9),
    (lambda x: af.Contact(1.48e9, 3e8, 0.5, cohesion=1e6, tension=x), 0.0, 2e6),
]


@pytest.mark.parametrize(("make", "least", "most"), BOUNDS)
def test_values_are_accepted_up_to_their_documented_bounds(make, least, most):
    """A hundredth to either side of each bound, and 1e-9 to either side of zero."""
    for bound, outward in ((least, -1.0), (most, 1.0)):
        if bound is not None:
            step = 0.01 * abs(bound) or 1e-9
            make(bound - outward * step)
            with pytest.raises(af.InvalidInput):
                make(bound + outward * step)


def test_a_material_that_stands_for_less_may_weigh_less_than_soil():
    """As a course that is less broad than the structure is wide: 1429 N/m³, which kg/m³ have."""
    with pytest.raises(af.errors.InvalidInput, match="looks like kg/m³"):
        af.Material(30e9, 0.2, 1429.0)
    assert af.Material(30e9, 0.2, 1429.0, stands_for="its breadth").unit_weight == 1429.0
