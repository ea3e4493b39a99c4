"""Limit analysis as case files ask for it, against what `collapse_factor` finds."""

import numpy as np
import pytest
from backfilled import arch_bridge

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


def test_a_fill_means_the_same_as_its_call():
    structure = arch_bridge()
    table = {
        "friction_angle": "35 degree",
        "cohesion": "2 kPa",
        "mobilisation": 0.5,
        "active": 0.8,
        "dispersal": "uniform",
        "spread": 26.6,
    }
    point = {"x": "3.2 m", "force": ["0 kN", "-1 kN"]}
    found = limit_asked({"point": point, "fill": table}).of(structure)
    fill = af.limit.Fill(**table | {"friction_angle": 35.0, "cohesion": 2e3})
    live = af.PointLoad(3.2, (0.0, -1e3))
    assert found.factor == af.collapse_factor(structure, live=live, fill=fill).factor


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"horizontal": 1.0, "fill": {}}, "lacks its angle of friction"),
        ({"horizontal": 1.0, "fill": {"angle": 35}}, "unknown key 'limit.fill.angle'"),
        ({"horizontal": 1.0, "fill": {"friction_angle": "0.6 rad", "spread": 85}}, "not between"),
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
