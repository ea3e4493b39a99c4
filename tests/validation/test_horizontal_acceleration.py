"""The constant horizontal acceleration at which a ring turns into a mechanism.

@article{Oppenheim1992,
  author  = {Oppenheim, Irving J.},
  title   = {The masonry arch as a four-link mechanism under base motion},
  journal = {Earthquake Engineering and Structural Dynamics},
  volume  = {21},
  pages   = {1005--1017},
  year    = {1992}
}

Oppenheim's arch: R = 10 m, t/R = 0.15, embrace 157.5°, seven voussoirs, 0.37 g. The table for 180
voussoirs, without sliding, is by linear programming of the static theorem.
"""

import numpy as np
import pytest

import archfem as af

HALF_A_DIGIT = 5.1e-4


def ring(embrace, ratio, voussoirs=180):
    return af.circular_arch(radius=1.0, thickness=ratio, embrace=embrace, voussoirs=voussoirs)


@pytest.mark.parametrize(
    ("embrace", "ratio", "factor"),
    [
        (120.0, 0.10, 0.580),
        (120.0, 0.15, 0.913),
        (120.0, 0.20, 1.264),
        (180.0, 0.15, 0.144),
        (180.0, 0.20, 0.284),
    ],
)
def test_ring_of_many_voussoirs(embrace, ratio, factor, verified):
    found = af.collapse_factor(ring(embrace, ratio), live=af.BodyForce(1.0), friction=None)
    assert found.factor == pytest.approx(factor, abs=HALF_A_DIGIT)
    assert [side for _, side in found.hinges] == ["intrados", "extrados"] * 2
    case = f"ring of {embrace:g}°, t/R = {ratio:g}, 180 stones: horizontal acceleration [g]"
    verified(
        case, factor, "linear programme of the static theorem, apart from archfem", found.factor
    )


def test_the_thickest_of_them_would_slide_first():
    """The table is of pure rotation; at a friction of 0.6 its springings slide before."""
    found = af.collapse_factor(ring(120.0, 0.20), live=af.BodyForce(1.0))
    assert set(found.sliding) == {0, 180}
    assert found.factor == pytest.approx(1.185, abs=1e-3)


def test_thin_semicircle_does_not_stand_at_all():
    thin = ring(180.0, 0.10)
    assert not af.stands(thin)
    assert af.collapse_factor(thin, live=af.BodyForce(1.0)).outcome == "infeasible"


def test_oppenheim_arch(verified):
    structure = af.circular_arch(radius=10.0, thickness=1.5, embrace=157.5, voussoirs=7)
    found = af.collapse_factor(structure, live=af.BodyForce(1.0))
    assert found.factor == pytest.approx(0.37, abs=0.005)
    moves = af.verified_mechanism(structure, found.joints)
    assert (moves.kind, len(moves.moved.joints)) == ("local", 4)
    case = "arch of seven stones, 157.5°: horizontal acceleration [g]"
    verified(case, 0.37, "Oppenheim (1992)", found.factor)


@pytest.mark.slow
def test_rings_lose_all_capacity_at_their_least_thickness():
    """Capacity vanishes along the known line of least thickness, and only there."""

    def capacity(embrace, ratio):
        made = af.circular_arch(radius=1.0, thickness=ratio, embrace=embrace, voussoirs=180)
        return af.collapse_factor(made, live=af.BodyForce(1.0), friction=None).factor

    assert capacity(120.0, 0.0229) == pytest.approx(0.0, abs=2e-3)
    assert capacity(180.0, 0.1076) == pytest.approx(0.0, abs=2e-3)
    assert np.isnan(capacity(180.0, 0.0229))
