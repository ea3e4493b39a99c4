"""The least thickness that stands: a bracket, and families that have none."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import archfem as af
from archfem.limit import minimum_thickness, thickness


def ring(**changes):
    given = {"radius": 2.95, "thickness": 0.55, "embrace": 159.0, "voussoirs": 7}
    return af.circular_arch(**(given | changes))


def on_piers(thickness, breadth):
    lengths = {"radius": 2.0, "voussoirs": 9, "courses": [0.5]}
    return af.arch_on_piers(thickness=thickness, pier_breadth=breadth, **lengths)


def rough(friction):
    return replace(af.masonry.STONE_TO_STONE, friction=friction)


def test_least_thickness_is_a_bracket():
    def build(thickness):
        return af.circular_arch(radius=2.0, thickness=thickness, embrace=140.0, voussoirs=7)

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
            r"stands at 1\.2e-05 m, the least thickness tried",
        ),
        (lambda: minimum_thickness(lambda t: ring(thickness=-t)), "builds? makes no structure"),
        (
            lambda: minimum_thickness(lambda t: on_piers(t, breadth=0.1)),
            r"0\.1 m does not, and no greater one can be built \(pier_breadth 0\.1 m is",
        ),
    ],
)
def test_families_without_a_least_thickness_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.slow
def test_the_greatest_that_can_be_built_may_be_the_only_one_that_stands():
    """Doubling passes over it."""
    free = minimum_thickness(lambda t: ring(thickness=t), tolerance=1e-4)

    def bounded(thickness):
        if thickness > 1.01 * free:
            raise af.InvalidStructure("thicker than there is room for")
        return ring(thickness=thickness)

    assert minimum_thickness(bounded, tolerance=1e-4) == pytest.approx(free, rel=2e-4)


@pytest.mark.parametrize(
    "share", [*(pytest.param(share, marks=pytest.mark.slow) for share in (0.5, 1.0)), 1.4]
)
def test_a_thickness_too_thin_to_build_does_not_stand(share):
    """The least that can be built stands where it is thicker than the least that stands."""
    free = minimum_thickness(lambda t: ring(thickness=t), tolerance=1e-4)

    def bounded(thickness):
        if thickness < share * free:
            raise af.InvalidStructure("stones do not touch")
        return ring(thickness=thickness)

    found = minimum_thickness(bounded, tolerance=1e-4)
    assert found == pytest.approx(max(1.0, share) * free, rel=2e-4)


@pytest.mark.slow
def test_a_least_thickness_far_below_the_greatest_that_can_be_built_is_found():
    """A ring along its intrados may be 100 m thick, and this one stands from 14 mm on."""
    x = np.linspace(-2.0, 2.0, 2001)
    parabola = np.column_stack([x, 1.0 - 0.25 * x**2])

    def build(thickness):
        return af.shapes.arch_along(parabola, thickness=thickness, voussoirs=16)

    least = minimum_thickness(build, friction=None, tolerance=1e-4)
    assert least == pytest.approx(0.01406, rel=5e-3)  # by a linear programme of its own
    assert not af.stands(build(0.99 * least), friction=None)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("voussoirs", "expected"),
    [(8, 5.2052e-4), (16, 1.38943e-4)],
)
def test_the_least_thickness_of_a_catenary_is_found(voussoirs, expected):
    """A half span of 3 m and a rise of 4 m: the thrust line leaves it by the stones' size alone."""
    parameter = brentq(lambda a: a * (np.cosh(3.0 / a) - 1.0) - 4.0, 0.1, 100.0)
    along = np.linspace(-1.0, 1.0, 4001) * parameter * np.sinh(3.0 / parameter)
    x = parameter * np.arcsinh(along / parameter)
    catenary = np.column_stack([x, 4.0 - parameter * (np.cosh(x / parameter) - 1.0)])

    def build(thickness):
        return af.shapes.arch_along(catenary, thickness=thickness, voussoirs=voussoirs)

    least = minimum_thickness(build, friction=None, tolerance=1e-4)
    assert least == pytest.approx(expected, rel=2e-3)  # by a linear programme of its own
    assert not af.stands(build(0.99 * least), friction=None)


@pytest.mark.parametrize(("strength", "searches"), [(None, 1), (np.inf, 1), (5e6, 2)])
def test_a_factor_without_crushing_is_not_searched_again(monkeypatch, strength, searches):
    calls, bridge = [], ring(embrace=180.0)
    moving = af.limit.moving_load(bridge, 1e4, positions=[1.0])
    monkeypatch.setattr(
        thickness,
        "find_geometric_factor",
        lambda *given: (float(len(calls.append(given) or calls)), 0),
    )
    options = {"friction": "coulomb", "strength": strength, "fill": None, "dead": ()}
    found = thickness.find_geometric_factors(bridge, moving, options)
    assert [given[2]["strength"] for given in calls] == [strength, np.inf][:searches]
    assert (found["geometric"], found["geometric_hard"]) == (1.0, searches)
