"""Limit analysis as case files ask for it, against what `collapse_factor` finds."""

import numpy as np
import pytest

import archfem as af
from archfem.cases.limits import limit_asked

POINT = {"x": "1.4 m", "force": ["0 kN", "-1 kN"]}


@pytest.mark.parametrize(
    ("given", "live", "friction"),
    [
        ({"horizontal": 1.0}, [af.BodyForce(1.0)], "coulomb"),
        ({"horizontal": 1.0, "vertical": 0.3}, [af.BodyForce(1.0, 0.3)], "coulomb"),
        ({"point": POINT, "friction": "none"}, [af.PointLoad(1.4, (0.0, -1000.0))], None),
        (
            {"point": POINT, "horizontal": -0.1, "friction": "nonassociated"},
            [af.BodyForce(-0.1), af.PointLoad(1.4, (0.0, -1000.0))],
            "nonassociated",
        ),
    ],
)
def test_a_table_means_the_same_as_its_call(ring, given, live, friction):
    found = limit_asked(given).of(ring)
    expected = af.collapse_factor(ring, live=live, friction=friction)
    assert 0.0 < found.factor == expected.factor < np.inf
    assert found.hinges == expected.hinges


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({}, "limit has no load: give horizontal"),
        ({"friction": "none"}, "limit has no load"),
        ({"horizontl": 1.0}, "unknown key 'limit.horizontl': did you mean 'horizontal'"),
        ({"horizontal": "1 kN"}, "limit.horizontal = '1 kN' is not in a unit like"),
        ({"horizontal": 1.0, "friction": "some"}, "limit.friction = 'some' is not known"),
        ({"point": 3}, "limit.point = 3 is not a table"),
        ({"point": {"x": 1.4}}, "give a place and the two components of a force"),
        ({"point": {"x": 1.4, "force": [1.0]}}, "two components of a force"),
        ({"point": {**POINT, "y": 1}}, "unknown key 'limit.point.y'"),
        ({"point": {**POINT, "force": ["0 m", "1 kN"]}}, "limit.point.force.0. = '0 m'"),
        (3, "limit = 3 is not a table"),
    ],
)
def test_limits_that_cannot_be_meant(given, says):
    with pytest.raises(af.InvalidInput, match=says):
        limit_asked(given)


def test_a_load_beside_the_structure_is_refused(ring):
    with pytest.raises(af.InvalidInput, match=r"x = 9 m misses the structure"):
        limit_asked({"point": {**POINT, "x": 9.0}}).of(ring)
