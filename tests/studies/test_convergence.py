"""Orders, limits and error bars of values whose law is known, and of a ring's."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import archfem as af
from archfem.studies import converged, convergence


@pytest.mark.parametrize("order", [0.6, 1.0, 2.0])
@pytest.mark.parametrize("sizes", [(4.0, 2.0, 1.0), (5.0, 2.0, 1.0), (9.0, 4.0, 2.0, 1.0)])
def test_powers_of_the_size_give_their_order_and_limit(order, sizes):
    values = 3.0 + 0.2 * np.array(sizes) ** order
    found = converged(0.5 * np.array(sizes), values)
    assert found.sizes.tolist() == list(sizes)  # relative to the finest
    assert found.order == pytest.approx(order, rel=1e-8)
    assert found.limit == pytest.approx(3.0, abs=1e-8)
    assert found.error == pytest.approx(1.25 * 0.2, rel=1e-7)


def test_values_that_do_not_settle_have_no_order_and_a_wide_bar():
    for values in ([1.0, 2.0, 1.5], [1.0, 1.1, 1.3]):
        found = converged([4.0, 2.0, 1.0], values)
        assert np.isnan(found.order)
        assert found.error == pytest.approx(3.0 * np.ptp(values))
    fast = converged([4.0, 2.0, 1.0], 3.0 + np.array([4.0, 2.0, 1.0]) ** 5)
    assert fast.order == pytest.approx(5.0)
    assert fast.error > abs(fast.limit - 3.0)
    assert converged([4.0, 2.0, 1.0], [1.0, 1.0, 1.0]).error == 0.0


@pytest.mark.slow
def test_error_bar_of_a_ring_holds_its_converged_eccentricity():
    """The crown's |e| converges to 0.2853 (README); the springings have the largest."""
    ring = {"shape": "circular_arch", "radius": 2.95, "thickness": 0.55, "embrace": 159.0}
    case = af.Case.of({"structure": {**ring, "voussoirs": 17}, "model": {"fidelity": "condensed"}})
    found = af.mesh_sensitivity(case, rungs=["rigid"], rules=["exact"], workers=1)
    fine = af.dead_load(af.build(case.structure, fidelity="condensed", cells=(12, 12)))
    finest = float(abs(fine.joints["eccentricity"]).max())
    assert abs(finest - found.mesh.limit) <= found.error
    assert found.step is None
    assert found.rules["exact"] == pytest.approx(found.mesh.values[-1])
    assert found.of("N").mesh.error < 0.01 * found.of("N").mesh.limit
    assert "fidelity rigid" in found.text()


def test_findings_that_have_no_numbers(small_ring):
    few = {"rules": ["exact"], "rungs": ["rigid"], "compute": "dead load", "workers": 1}
    with pytest.raises(af.InvalidInput, match="'colour' is none of the numbers"):
        af.mesh_sensitivity(small_ring, "colour", **few)
    with pytest.raises(af.InvalidInput, match="the coarsest first"):
        converged([1.0, 2.0, 4.0], [1.0, 2.0, 3.0])


@pytest.mark.parametrize(
    ("order", "plausible"), [(0.45, False), (0.51, True), (2.09, True), (2.2, False)]
)
def test_orders_from_a_half_to_that_of_the_scheme_are_plausible(order, plausible):
    """A tenth above two is left to chance."""
    sizes = np.array([4.0, 2.0, 1.0])
    found = converged(sizes, 3.0 + 0.2 * sizes**order)
    assert found.order == pytest.approx(order, rel=1e-8)
    assert (found.limit == pytest.approx(3.0, abs=1e-8)) is plausible
    assert list(found.sizes) == [4.0, 2.0, 1.0]


def test_differences_that_barely_fall_have_an_order_near_zero():
    found = converged([40.0, 20.0, 10.0], [1.0, 2.04, 3.0])
    assert found.order == pytest.approx(np.log2(1.04 / 0.96), rel=1e-9)
    assert list(found.sizes) == [4.0, 2.0, 1.0]
    assert found.limit == 3.0
    assert found.error == pytest.approx(6.0)
    assert np.isnan(converged([4.0, 2.0, 1.0], [1.0, 2.0, 3.0]).order)


class StudyArguments(Exception):
    """Raised with the arguments of a study."""


@pytest.mark.parametrize(
    ("compute", "shaken", "computed"),
    [
        (None, True, "history"),
        (None, False, "dead load"),
        ("dead load", True, "dead load"),
        ("scales", False, "scales"),
    ],
)
def test_a_given_quantity_is_computed_or_else_the_history_or_the_dead_load(
    small_ring, monkeypatch, compute, shaken, computed
):
    """Over three meshes, four rules, three fidelities, and time steps of what moves."""

    def study(case, points, compute, **given):
        raise StudyArguments(compute, len(points), points[0])

    monkeypatch.setattr(convergence, "Study", study)
    case = small_ring if shaken else af.Case.of({"structure": small_ring.settings["structure"]})
    assert case.has_motion is shaken
    with pytest.raises(StudyArguments) as caught:
        af.mesh_sensitivity(case, compute=compute)
    still = computed == "dead load"
    finest = {"model.cells": [2, 2]} | ({} if still else {"analysis.dt": 0.0025})
    assert caught.value.args == (computed, 10 if still else 13, finest)


def tabulated(values):
    """A table of three meshes and three steps."""
    varied = {"varied": 3 * ["mesh"] + 3 * ["step"], "to": ["4", "2", "1"] * 2}
    found = {"slip": ("point", values), "error": ("point", 6 * [""])}
    return xr.Dataset(found, {name: ("point", each) for name, each in varied.items()})


def test_errors_of_mesh_and_step_add_up():
    """Values of first order in both, with bars of 1.25 times the rest."""
    found = convergence._sensitivity(tabulated([1.4, 1.2, 1.1, 1.7, 1.3, 1.1]), "slip")
    assert found.mesh.error == pytest.approx(1.25 * 0.1)
    assert found.step.error == pytest.approx(1.25 * 0.2)
    assert found.error == pytest.approx(1.25 * 0.3)
    assert replace(found, step=None).error == pytest.approx(1.25 * 0.1)
    for wrong in (np.nan, np.inf):
        with pytest.raises(af.InvalidInput, match=f"'slip' is {wrong} for a mesh or a step"):
            convergence._sensitivity(tabulated([1.4, 1.2, 1.1, 1.7, wrong, 1.1]), "slip")


def test_a_setting_that_failed_has_no_coordinates_and_no_time():
    found = convergence._to_run(xr.Dataset({"coordinates": np.nan}))
    assert (found.size, found.seconds, found.peaks) == (0, np.inf, None)
