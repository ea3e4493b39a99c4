"""Two equal vertical loads on the ring with which springs were validated.

@article{Demirel2021,
  author  = {Demirel, Ismail Ozan and Aldemir, Alper},
  title   = {Simplified Approach for Seismic Performance Assessment of Dry-Joint Masonry Arch
             Bridges},
  journal = {Buildings},
  volume  = {11},
  number  = {7},
  pages   = {313},
  year    = {2021}
}

Centre-line radius 2.95 m, thickness 0.55 m, width 1 m, embrace 159°. The paper does not print where
the loads stand. At the quarter points their thrust line fits inside the ring, so that with friction
above 0.43 no load is a limit; near the crown there is one.
"""

from dataclasses import replace

import numpy as np
import pytest

import archfem as af


def ring(friction=0.6):
    contact = replace(af.masonry.STONE_TO_STONE, friction=friction)
    return af.circular_arch(
        radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17, contact=contact
    )


def pair(x):
    return [af.PointLoad(side * x, (0.0, -1e3)) for side in (-1.0, 1.0)]


QUARTER = 1.40
KEYSTONE = abs(ring().joints[8].extrados[0]) * (1.0 - 1e-9)


@pytest.mark.parametrize("friction", [0.44, 0.6])
def test_no_limit_at_the_quarter_points_with_enough_friction(friction):
    found = af.collapse_factor(ring(friction), live=pair(QUARTER))
    assert (found.outcome, found.factor) == ("unbounded", np.inf)


@pytest.mark.parametrize("friction", [0.30, 0.42, 0.43])
def test_sliding_limits_loads_at_the_quarter_points_with_less(friction):
    found = af.collapse_factor(ring(friction), live=pair(QUARTER))
    assert found.outcome == "collapses"
    assert found.sliding
    assert not found.hinges


def test_limit_near_the_crown_by_hinges_at_springings_crown_and_haunches():
    found = af.collapse_factor(ring(), live=pair(KEYSTONE), friction=None)
    assert found.factor == pytest.approx(72.65, rel=1e-3)
    e = found.joints["eccentricity"].values
    np.testing.assert_allclose(e[[0, 4, 8, 9, 13, 17]], [0.5, -0.5, 0.5, 0.5, -0.5, 0.5], atol=1e-6)
    np.testing.assert_allclose(e, e[::-1], atol=1e-6)


def test_limit_near_the_crown_by_hand(verified):
    """Moments about the hinges at haunch and springing of what lies between them and the crown.

    At the crown hinge act the thrust H, the load P beside it and half the weight of the keystone.
    """
    structure = ring()
    found = af.collapse_factor(structure, live=pair(KEYSTONE), friction=None)
    crown = np.array(structure.joints[9].extrados)
    half_keystone = 20e3 * structure.blocks[9].area / 2.0
    rows, known = [], []
    for pivot, last in ((structure.joints[13].intrados, 13), (structure.joints[17].extrados, 17)):
        stones = structure.blocks[10 : last + 1]
        known.append(
            half_keystone * (pivot[0] - crown[0])
            + sum(20e3 * stone.area * (pivot[0] - stone.centroid[0]) for stone in stones)
        )
        rows.append([crown[1] - pivot[1], KEYSTONE - pivot[0]])
    _, load = np.linalg.solve(rows, known)
    assert 1e3 * found.factor == pytest.approx(load, rel=1e-6)  # KEYSTONE is 1e-9 off the edge
    case = "validation ring, two loads at the keystone's edges [kN]"
    verified(case, 1e-3 * load, "moments about the hinges by hand", found.factor)


def test_friction_lowers_the_limit_near_the_crown():
    rough, slippery = (
        af.collapse_factor(ring(mu), live=pair(KEYSTONE)).factor for mu in (0.6, 0.43)
    )
    assert 0.0 < slippery < rough < 72.65


def test_one_load_at_the_quarter_point_makes_four_hinges():
    found = af.collapse_factor(ring(), live=af.PointLoad(QUARTER, (0.0, -1e3)))
    assert [side for _, side in found.hinges] == ["extrados", "intrados"] * 2
    assert not found.sliding
    assert found.factor == pytest.approx(62.19, rel=1e-3)
