"""Common units, which are read without the registry of units."""

import numpy as np
import pint
import pytest

import archfem as af
from archfem.units import COMMON_UNITS


@pytest.fixture(scope="module")
def registry():
    return pint.UnitRegistry()


@pytest.mark.parametrize(("unit", "si"), [(name, si) for name, (si, _) in COMMON_UNITS.items()])
def test_common_units_are_those_of_the_registry(registry, unit, si):
    """To the last digit, so that a case gives the same numbers either way."""
    for number in (*np.random.default_rng(1).uniform(-1e3, 1e3, 50).round(3), 0.0, 1.48):
        expected = registry.Quantity(f"{number} {unit}").to(si).magnitude
        assert af.units.in_unit(f" {number}{unit}", si, "length") == expected


@pytest.mark.parametrize(("text", "si"), [("3 mm", "Pa"), ("2 s", "m"), ("1 GPa/m", "Pa")])
def test_a_common_unit_of_another_dimension_is_refused(text, si):
    with pytest.raises(af.errors.InvalidInput, match="is not in a unit like"):
        af.units.in_unit(text, si, "length")
