"""Stiffness of joints by the relations of Bandis, Lumsden and Barton, written a second time.

In MPa and mm, with k_n per mm of closure; faces are mismatched.
"""

from math import log10, radians, tan

import numpy as np
import pytest

import archfem as af

MPA_PER_MM = 1e9

FACES = {"dressed": (4.0, 8.0, 1.0), "hewn": (6.0, 12.0, 0.6), "weathered": (6.0, 12.0, 0.33)}
"""Least and largest JRC, and JCS over the strength of the stone."""


def closing(jrc, stone, jcs, sigma):
    """k_n of mismatched faces [MPa/mm], from the slope of the closure's hyperbola.

    Of σ = k_i u / (1 - u / v), which has the slope k_i / (1 - u / v)², at u = σ v / (k_i v + σ).
    """
    aperture = jrc / 5.0 * (0.2 * stone / jcs - 0.1)
    k_i = max(1.75 * jrc - 7.15 + 0.02 * jcs / aperture, 0.1)
    v = max(1.135 * (aperture / jcs) ** 0.251 - 0.0074 * jrc - 0.1032, 1e-3)
    u = sigma * v / (k_i * v + sigma)
    return k_i / (1.0 - u / v) ** 2 / (2.0 + 4.0 * jrc * jcs * sigma / 1e4)


@pytest.mark.parametrize("condition", FACES)
@pytest.mark.parametrize(
    ("stone", "sigma", "spacing"),
    [
        *((56.0, 0.05, 0.5), (200.0, 3.0, 0.3), (20.0, 15.0, 2.0), (2e3, 0.01, 0.4)),
        *((2e4, 1e-4, 0.4), (0.9, 0.05, 0.5)),
    ],
)
def test_ranges_are_those_of_the_relations(condition, stone, sigma, spacing):
    """Regressions are cut off where they would be negative, and angles at 70 degrees.

    Of the fourth stone closures and angles are, of the next all angles but the smoothest's; of the
    last, k_i of the smoothest dressed faces.
    """
    young, poisson = 20e9, 0.3
    given = {"strength": 1e6 * stone, "stress": 1e6 * sigma, "poisson": poisson}
    least, most, faces = FACES[condition]
    jcs = faces * stone
    normal = [closing(jrc, stone, jcs, sigma) for jrc in np.linspace(least, most, 21)]
    low, high = min(normal), max(normal)
    usual = np.sqrt(low * high)
    shear = [
        sigma * tan(radians(min(30.0 + jrc * log10(jcs / sigma), 70.0))) / (10.0 * spacing)
        for jrc in (least, most)
    ]
    layer = 2.0 * (1.0 + poisson)
    along = (min(*shear, 0.2 * low), 0.2 * usual, high / layer)
    found = af.joint_stiffness(young, spacing, condition, **given)
    assert found.normal == pytest.approx(MPA_PER_MM * np.array([low, usual, high]), rel=1e-9)
    assert found.shear == pytest.approx(MPA_PER_MM * np.array(along), rel=1e-9)
    # blocks that are rigid leave their stretch and their shear to the joints, in series
    rigid = af.joint_stiffness(young, spacing, condition, rigid=True, **given)
    modulus = young / layer
    assert 1.0 / np.array(rigid.normal) - 1.0 / np.array(found.normal) == pytest.approx(
        spacing / young, rel=1e-9
    )
    assert 1.0 / np.array(rigid.shear) - 1.0 / np.array(found.shear) == pytest.approx(
        spacing / modulus, rel=1e-9
    )


def test_usual_values_are_those_of_the_weight_of_a_wall():
    """56 MPa, 0.05 MPa and ν = 0.2, and a coefficient of friction of 0.6."""
    found = af.joint_stiffness(30e9, 0.5)
    stated = af.joint_stiffness(30e9, 0.5, strength=56e6, stress=5e4, poisson=0.2, rigid=False)
    assert (found.normal, found.shear) == (stated.normal, stated.shear)
    assert found.contact().friction == 0.6


@pytest.mark.parametrize("poisson", [0.0, 0.499])
def test_all_ratios_of_poisson_are_taken(poisson):
    found = af.joint_stiffness(30e9, 0.5, poisson=poisson)
    assert found.shear[2] == pytest.approx(found.normal[2] / (2.0 * (1.0 + poisson)))


def test_no_stone_widens_as_it_is_pulled():
    with pytest.raises(af.InvalidInput, match="poisson"):
        af.joint_stiffness(30e9, 0.5, poisson=0.51)
