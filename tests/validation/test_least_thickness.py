"""The least thickness of circular arches under self-weight, and the friction they need.

@article{Milankovitch1907,
  author  = {Milankovitch, Milutin},
  title   = {Theorie der {Druckkurven}},
  journal = {Zeitschrift f{\"u}r Mathematik und Physik},
  volume  = {55},
  pages   = {1--27},
  year    = {1907}
}
@article{Heyman1969,
  author  = {Heyman, Jacques},
  title   = {The safety of masonry arches},
  journal = {International Journal of Mechanical Sciences},
  volume  = {11},
  pages   = {363--385},
  year    = {1969}
}
@article{Cocchetti2011,
  author  = {Cocchetti, Giuseppe and Colasante, Giada and Rizzi, Egidio},
  title   = {On the analysis of minimum thickness in circular masonry arches},
  journal = {Applied Mechanics Reviews},
  volume  = {64},
  number  = {5},
  pages   = {050802},
  year    = {2011}
}

Radial joints, sectors as stones. Milankovitch's 0.1075 and hinges at 54.5° take the weight of each
sector at its true centroid, as archfem does; with all weight on the centre line, as Cocchetti and
others first do, the semicircle needs t/R = 0.1074 and a friction of 0.3958.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import archfem as af

PRINTED = 6e-5
"""Half of the last digit with which the values for few voussoirs are known, and a little."""


def ring(thickness, voussoirs, embrace=180.0, friction=0.6):
    return af.circular_arch(
        radius=1.0,
        thickness=thickness,
        embrace=embrace,
        voussoirs=voussoirs,
        contact=replace(af.masonry.STONE_TO_STONE, friction=friction),
    )


@cache
def least_of(voussoirs):
    """The least thickness of a semicircle, by the bound of the search, which two tests need."""
    return af.minimum_thickness(lambda t: ring(t, voussoirs), friction=None)


@pytest.fixture(scope="module")
def least():
    """Joints 20 of 66 stones from the crown lie at 54.55°, near enough to 54.48°."""
    return af.minimum_thickness(lambda t: ring(t, 66), friction=None)


@pytest.mark.parametrize(
    ("voussoirs", "ratio"),
    [
        (7, 0.0962),
        pytest.param(11, 0.1049, marks=pytest.mark.slow),
        pytest.param(17, 0.1056, marks=pytest.mark.slow),
        pytest.param(27, 0.1068, marks=pytest.mark.slow),
        pytest.param(50, 0.1075, marks=pytest.mark.slow),
    ],
)
def test_semicircle_of_few_voussoirs(voussoirs, ratio, verified):
    found = least_of(voussoirs)
    assert found == pytest.approx(ratio, abs=PRINTED)
    assert af.stands(ring(1.02 * found, voussoirs))
    assert not af.stands(ring(0.98 * found, voussoirs))
    case = f"semicircle of {voussoirs} voussoirs, least t/R"
    verified(case, ratio, "thrust lines by hand and by programme, Cocchetti et al. (2011)", found)


@pytest.mark.slow
def test_semicircle_with_a_joint_where_it_hinges(least, verified):
    assert least == pytest.approx(0.10748, abs=1e-5)
    spread = af.collapse_factor(
        ring(least, 66), live=af.Settlement(0, (-1.0, 0.0, 0.0)), friction=None
    )
    angles = [90.0 - 180.0 / 66 * joint for joint, _ in spread.hinges]
    assert angles == pytest.approx([54.5, 0.0, -54.5], abs=0.1)
    source = "Milankovitch (1907)"
    verified("semicircle, least t/R, a joint where it hinges", 0.10748, source, least)
    verified("semicircle, angle of hinges at the haunches [degree]", 54.48, source, angles[0])
    assert [side for _, side in spread.hinges] == ["intrados", "extrados", "intrados"]


@pytest.mark.slow
def test_thrust_at_the_least_thickness_by_statics(least):
    """From extrados at the crown to extrados at the springing, H = V (1 - x_c / (R + t/2))."""
    joints = af.collapse_factor(
        ring(least, 66), live=af.Settlement(0, (-1.0, 0.0, 0.0)), friction=None
    ).joints
    arm = (1.0 + least**2 / 12.0) / (np.pi / 2.0)
    expected = 1.0 - arm / (1.0 + least / 2.0)
    assert float(joints["friction"][0]) == pytest.approx(expected, rel=1e-4)  # least: 1e-6


@pytest.mark.slow
def test_friction_that_a_semicircle_needs(least, verified):
    """It is H / V at the springing: 0.3953; 0.3958 with all weight on the centre line."""
    thickness = 1.00001 * least
    low, high = 0.3, 0.6
    while high - low > 1e-4:
        middle = 0.5 * (low + high)
        holds = af.stands(ring(thickness, 66, friction=middle))
        low, high = (low, middle) if holds else (middle, high)
    assert high == pytest.approx(0.3953, abs=2e-4)
    assert high == pytest.approx(0.3958, rel=2e-3)
    centre_line = 1.0 - (2.0 / np.pi) / (1.0 + 0.107426 / 2.0)
    assert centre_line == pytest.approx(0.3958, abs=5e-5)
    verified(
        "semicircle, friction that it needs",
        0.3953,
        "thrust over weight at the springing, by statics",
        high,
    )


@pytest.mark.slow
def test_below_that_friction_more_thickness_is_needed():
    free = af.minimum_thickness(lambda t: ring(t, 50), friction=None, tolerance=1e-5)
    assert af.stands(ring(1.0001 * free, 50, friction=0.40))
    assert not af.stands(ring(1.02 * free, 50, friction=0.39))


@pytest.mark.slow
def test_embrace_of_120_degrees(verified):
    """Joints 25 of 76 stones from the crown lie at 39.47°, near enough to 39.5°."""
    found = af.minimum_thickness(lambda t: ring(t, 76, embrace=120.0), friction=None)
    assert found == pytest.approx(0.02285, abs=1e-5)
    thicker = ring((1.0 + 1e-6) * found, 76, embrace=120.0)  # by the tolerance of the search
    settled = af.Settlement(0, (-1.0, 0.0, 0.0))
    spread = af.collapse_factor(thicker, live=settled, friction=None)
    assert 60.0 - 120.0 / 76 * spread.hinges[0][0] == pytest.approx(39.5, abs=0.05)
    verified(
        "arch of 120°, least t/R",
        0.02285,
        "Milankovitch's problem, thrust line in closed form",
        found,
    )


@pytest.mark.parametrize(
    ("voussoirs", "ratio"), [(7, 0.0957), pytest.param(17, 0.10546, marks=pytest.mark.slow)]
)
def test_stones_cut_along_chords_need_less(voussoirs, ratio):
    """Chords take weight from the flanks of long stones: 0.6 % less at 7 stones, 0.1 % at 17."""
    found = af.minimum_thickness(
        lambda t: af.circular_arch(
            radius=1.0, thickness=t, embrace=180.0, voussoirs=voussoirs, chords=1
        ),
        friction=None,
    )
    assert found == pytest.approx(ratio, abs=1e-5)
    assert found < least_of(voussoirs)
