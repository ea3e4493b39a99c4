"""The least thickness that stands: a bracket, and families that have none."""

from dataclasses import replace

import pytest

import archfem as af
from archfem.limit.thickness import minimum_thickness


def ring(**changes):
    given = {"radius": 2.95, "thickness": 0.55, "embrace": 159.0, "voussoirs": 17}
    return af.circular_arch(**(given | changes))


def rough(friction):
    return replace(af.masonry.STONE_TO_STONE, friction=friction)


def test_least_thickness_is_a_bracket():
    def build(thickness):
        return af.circular_arch(radius=2.0, thickness=thickness, embrace=140.0, voussoirs=12)

    least = minimum_thickness(build, tolerance=1e-5)
    assert af.stands(build(least))
    assert not af.stands(build(least * (1.0 - 1.1e-5)))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: minimum_thickness(lambda t: ring(thickness=t), tolerance=0.0), "tolerance"),
        (
            lambda: minimum_thickness(
                lambda t: ring(thickness=t, contact=rough(0.0)), tolerance=1e-3
            ),
            "no thickness makes it stand",
        ),
        (
            lambda: minimum_thickness(lambda t: af.column(breadth=t, heights=[1.0])),
            "stands at any thickness",
        ),
        (lambda: minimum_thickness(lambda t: ring(thickness=-t)), "builds? makes no structure"),
    ],
)
def test_families_without_a_least_thickness_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
