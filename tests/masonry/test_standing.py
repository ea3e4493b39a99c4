"""Bodies that stand on a structure: closed forms of walls and piers, joints, files, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from backfilled import arch_bridge, rectangle, row_of_stones

import archfem as af
from archfem.limit import Fill
from archfem.masonry import StandingBody, carrying

NO_PRESSURE = Fill(friction_angle=30.0, mobilisation=0.0, active=0.0)

LORRY = StandingBody(x=4.0, length=1.5, weight=50e3, centre_of_gravity=0.8, width=0.5, name="lorry")


def pier_under_soil(breadth=1.0, height=2.0, soil=0.5):
    """A stone on rock with soil on it, as broad as the stone."""
    half, top = 0.5 * breadth, height + soil
    blocks = [
        rectangle(-half, -1.0, half, 0.0, "rock", fixed=True),
        rectangle(-half, 0.0, half, height, "stone", role="pier"),
        rectangle(-half, height, half, top, "soil", af.masonry.BACKFILL),
    ]
    return af.masonry.assembled(blocks, af.masonry.STONE_TO_STONE)


def test_a_body_has_its_weight_at_its_centre_of_gravity_on_a_joint_to_the_road():
    bridge = arch_bridge(width=2.0)
    loaded = carrying(bridge, [LORRY])
    block, joint = loaded.blocks[-1], loaded.joints[-1]
    road = max(y for each in bridge.blocks for _, y in each.points)
    assert block.centroid == pytest.approx([4.0, road + 0.8])
    # 50 kN on half a metre of a width of two
    assert loaded.weight - bridge.weight == pytest.approx(200e3)
    assert (joint.name, joint.part, joint.role) == ("backfill to lorry", "lorry", "other")
    assert np.sort(joint.ends[:, 0]) == pytest.approx([3.25, 4.75])
    assert (loaded.blocks[:-1], loaded.joints[:-1]) == (bridge.blocks, bridge.joints)
    assert (loaded.judged[:-1] == bridge.judged).all()
    assert not loaded.judged[-1]


@pytest.mark.parametrize("offset", [0.0, 0.1])
@pytest.mark.parametrize("lever", [0.0, 1.0])
def test_a_body_on_the_fill_of_a_pier_is_pushed_at_its_centre_of_gravity(lever, offset, verified):
    """About the toe W b/2 = λ Σ W y; from the columns' feet the fill's own depth is no arm."""
    pier, (breadth, height, soil) = pier_under_soil(), (1.0, 2.0, 0.5)
    body = StandingBody(x=-offset, length=0.6, weight=30e3, centre_of_gravity=0.7)
    fill = replace(NO_PRESSURE, lever=lever)
    given = {"live": af.BodyForce(1.0), "fill": fill, "friction": None}
    found = af.collapse_factor(carrying(pier, [body]), **given).factor
    weights = np.array([20e3 * breadth * height, 18e3 * breadth * soil, 30e3])
    arms = 0.5 * breadth + np.array([0.0, 0.0, offset])
    depth = lever * soil
    heights = np.array([0.5 * height, height + 0.5 * depth, height + depth + 0.7])
    exact = weights @ arms / (weights @ heights)
    assert found == pytest.approx(exact, rel=1e-6)
    # as a load without mass it resists more
    dead = [af.PointLoad(-offset, (0.0, -30e3))]
    assert af.collapse_factor(pier, dead=dead, **given).factor > 1.3 * exact
    if lever and offset:
        source = "moments about the toe, body at its centre of gravity"
        verified("pier under soil and a body, pushed sideways", exact, source, found)


def test_a_body_on_a_wall_overturns_about_its_own_base():
    wall = af.column(breadth=2.0, heights=[0.5, 0.5])
    body = StandingBody(x=0.1, length=0.4, weight=5e3, centre_of_gravity=1.0, name="statue")
    found = af.collapse_factor(carrying(wall, [body]), live=af.BodyForce(1.0), friction=None)
    assert found.factor == pytest.approx(0.2)
    assert found.hinge_names == (f"{wall.blocks[-1].name} to statue",)


def test_a_body_stands_on_all_that_is_level_below_it_and_on_other_bodies():
    paved = row_of_stones(paving=0.2)
    base = StandingBody(x=3.0, length=2.0, weight=1e4, centre_of_gravity=0.5, name="base")
    upper = replace(base, length=1.0, name="upper")
    loaded = carrying(paved, [base, upper])
    assert [joint.name for joint in loaded.joints[-2:]] == ["paving to base", "base to upper"]
    cut = af.masonry.jointed_fill(arch_bridge(), piece_size=0.6, friction_angle=35.0, cohesion=5e3)
    many = carrying(cut, [LORRY])
    own = [joint for joint in many.joints if joint.part == "lorry"]
    assert len(own) > 2
    assert sum(joint.depth for joint in own) == pytest.approx(1.5)
    assert len(many.joints) == len(cut.joints) + len(own)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"x": 40.0}, "beside the structure"),
        ({"width": 3.0}, "the structure has 1 m"),
        ({"length": 1.5}, "not level"),
        ({"weight": 1e12}, "give newtons"),
        ({"length": 0.0}, "length"),
    ],
)
def test_a_body_that_cannot_stand_is_refused(changes, words):
    with pytest.raises(af.errors.InvalidInput, match=words):
        carrying(arch_bridge(), [replace(LORRY, **{"x": 0.2} | changes)])


def test_a_body_on_a_bare_ring_is_refused_with_a_remedy():
    ring = af.circular_arch(radius=3.0, thickness=0.5, embrace=160.0, voussoirs=15)
    with pytest.raises(af.errors.InvalidInput, match="give the structure a fill or a paving"):
        carrying(ring, [replace(LORRY, x=0.0)])


def test_axles_do_not_drive_over_a_body_nor_is_it_plastic_fill():
    loaded = carrying(arch_bridge(), [LORRY])
    with pytest.raises(af.errors.InvalidInput, match=r"remove = \[\"structure.standing\"\]"):
        af.rate(loaded, "LM1", fill=Fill(friction_angle=35.0))
    plastic = af.limit.PlasticFill(friction_angle=35.0, cohesion=5e3)
    with pytest.raises(af.errors.InvalidInput, match=r"\['lorry'\] on a plastic fill"):
        af.collapse_factor(loaded, live=af.BodyForce(1.0), fill=plastic)
