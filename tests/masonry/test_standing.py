"""Bodies that stand on a structure: closed forms of walls and piers, joints, files, refusals."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from backfilled import arch_bridge, rectangle, row_of_stones

import archfem as af
from archfem.cases.result_text import describe_pairs, note_masses
from archfem.cases.structure_text import describe_depths
from archfem.limit import Fill
from archfem.masonry import StandingBody, carrying
from archfem.statics.equilibrium import structure_doubts

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
    line = "note: 'lorry' of 50 kN counts as 200 kN: by the whole width of 2 m over its 0.5 m"
    assert note_masses(loaded) == [line]
    assert note_masses(carrying(bridge, [replace(LORRY, width=None)])) == []
    assert (joint.name, joint.part, joint.role) == ("backfill to lorry", "lorry", "other")
    assert np.sort(joint.ends[:, 0]) == pytest.approx([3.25, 4.75])
    assert (loaded.blocks[:-1], loaded.joints[:-1]) == (bridge.blocks, bridge.joints)
    assert (loaded.judged[:-1] == bridge.judged).all()
    assert not loaded.judged[-1]


TRUCK = StandingBody(
    x=0.0,
    length=0.4,
    axles=[60e3, 115e3, 90e3],
    spacings=[1.5, 1.2],
    centre_of_gravity=1.3,
    width=0.5,
    name="truck",
)


def test_a_vehicle_presses_with_its_axles_and_tips_over_the_last_one_at_its_centre_of_gravity():
    """On a stiff wall the joints below its wheels bear the axle loads, twice on half the width."""
    wall = af.column(breadth=8.0, heights=[0.5, 0.5])
    loaded = carrying(wall, [TRUCK])
    axles, places = np.array(TRUCK.axles), np.array([-1.35, 0.15, 1.35])
    middle = axles @ places / axles.sum()
    assert loaded.blocks[-1].centroid == pytest.approx([middle, 1.0 + 1.3])
    joints = af.dead_load(af.build(loaded, fidelity="rigid")).joints
    assert joints["N"].values[-3:] == pytest.approx(2.0 * axles, rel=1e-6)
    wheels = np.array([joint.depth for joint in loaded.joints[-3:]])
    assert wheels == pytest.approx(0.4 * axles / 115e3)
    for sense, tip in ((1.0, 1.35 + 0.5 * wheels[2]), (-1.0, -1.35 - 0.5 * wheels[0])):
        found = af.collapse_factor(loaded, live=af.BodyForce(sense), friction=None)
        assert found.factor == pytest.approx(sense * (tip - middle) / 1.3)


@pytest.mark.slow
def test_a_vehicle_on_pieces_of_fill_comes_to_rest_on_all_its_wheels():
    """Two spans; the joints below its wheels bear its weight, below its centre of gravity."""
    arches = [
        af.shapes.Arch(span=5.0, rise=1.4, thickness=0.45, voussoirs=17, name=name)
        for name in ("west", "east")
    ]
    walls = [
        af.shapes.Sidewall(length=1.5, height=1.0, above=0.9, state="fixed", name=name)
        for name in ("left wall", "right wall")
    ]
    parts = {"piers": [af.shapes.Pier(breadth=1.1, height=2.0)], "sidewalls": walls, "width": 4.0}
    bridge = af.bridge(arches=arches, backfill=af.shapes.Backfill(cover=0.5), **parts)
    cut = af.masonry.jointed_fill(bridge, 0.6, friction_angle=35.0, cohesion=5e3)
    axles, spacings = np.array([93.2e3, 93.2e3, 68.7e3]), [1.35, 3.6]
    lorry = replace(TRUCK, x=4.0, length=0.3, axles=axles.tolist(), spacings=spacings, width=2.1)
    loaded = carrying(cut, [lorry])
    found = af.dead_load(af.build(loaded, fidelity="rigid", displacements="large")).joints
    own = [k for k, joint in enumerate(loaded.joints) if joint.part == "truck"]
    force, arm = found["N"].values[own], found["M"].values[own]
    places = np.array([loaded.joints[k].middle[0] for k in own])
    assert force.sum() == pytest.approx(4.0 / 2.1 * axles.sum(), rel=1e-3)
    middle = np.average(4.0 + np.array([-2.475, -1.125, 2.475]), weights=axles)
    assert (force @ places - arm.sum()) / force.sum() == pytest.approx(middle, abs=0.03)
    assert all(force[abs(places - x) < 0.2].sum() > 0.0 for x in (1.525, 2.875, 6.475))


@pytest.mark.parametrize("lever", [0.0, pytest.param(1.0, marks=pytest.mark.slow)])
def test_a_vehicle_on_two_piers_leans_on_the_one_in_front(lever, verified, caplog):
    """The pier behind loses λ W h / L of its axle; moments about its toe, of stone, soil, axle."""
    span, blocks = 5.0, []
    for k in (0, 1):
        for block in pier_under_soil().blocks:
            points = tuple((float(x) + k * span, float(y)) for x, y in block.points)
            given = {"fixed": block.fixed, "part": block.part, "role": block.role}
            blocks.append(af.Block(points, block.material, f"{block.name} {k}", **given))
    piers = af.masonry.assembled(blocks, af.masonry.STONE_TO_STONE)
    axles = 20e3, 30e3
    truck = replace(TRUCK, x=2.5, axles=axles, spacings=[span], width=None)
    given = {"live": af.BodyForce(1.0), "friction": None}
    loaded, fill = carrying(piers, [truck]), replace(NO_PRESSURE, lever=lever)
    found = af.collapse_factor(loaded, fill=fill, **given).factor
    weights = np.array([20e3 * 2.0, 18e3 * 0.5, axles[0]])
    heights = np.array([1.0, 2.0 + 0.25 * lever, 2.0 + 0.5 * lever])
    exact = weights.sum() * 0.5 / (weights @ heights + sum(axles) * 1.3 / span * 0.5)
    assert found == pytest.approx(exact, rel=1e-6)
    assert "has lifted" not in caplog.text
    source = "moments about the toe, with the load that leaves its axle"
    verified("vehicle on two piers, the one behind pushed over", exact, source, found)
    # of a light one λ W h / L is all its load at 0.125 g
    light = replace(truck, axles=(5e3, 45e3), centre_of_gravity=4.0)
    assert af.collapse_factor(carrying(piers, [light]), fill=fill, **given).factor > 0.2
    assert "an axle has lifted, at 0.125 g" in caplog.text
    # pieces are loads of an assessment too, and axles as weights do not press the fill
    pieces = carrying(af.masonry.jointed_fill(piers, 0.4, friction_angle=30.0), [truck])
    words = r"on a fill, .*push it by .*, which compares it with the site's .*too high"
    for each in (loaded, pieces):
        with pytest.raises(af.errors.InvalidInput, match=words):
            af.kinematic_assessment(each, af.Eurocode8(ag=0.25, ground="C"))


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
    bond = af.shapes.wall(breadth=4.0, height=2.0, eaves=2.0, course=0.25, stone=0.5, width=1.0)
    assert "lintel" not in describe_depths(carrying(bond, [replace(TRUCK, width=None)]))  # its gaps


def test_a_body_stands_on_all_that_is_level_below_it_and_on_other_bodies():
    paved = row_of_stones(paving=0.2)
    base = StandingBody(x=3.0, length=2.0, weight=1e4, centre_of_gravity=0.5, name="base")
    upper = replace(base, length=1.0, weight=600.0, name="upper")  # less than any axle
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
        ({"length": 1.5}, "stands on 0.95 m of its 1.5 m, as the structure ends at x = 0 m"),
        ({"weight": 1e12}, "give newtons"),
        ({"weight": 50.0}, "'lorry' presses with 50 N: that can only be a wrong unit"),  # kN
        ({"weight": None, "axles": [50.0, 9e4], "spacings": [3.4]}, "50 N and 90000 N: that can"),
        ({"length": 0.0}, "length"),
        ({"axles": [1e4]}, "either its weight, or axles"),
        ({"weight": None}, "either its weight, or axles"),
        ({"weight": None, "axles": [1e4, 1e4]}, "2 axles and 0 spacings"),
        ({"weight": None, "axles": [1e4, 1e4], "spacings": [1.2]}, "wheels overlap by 0.3 m"),
    ],
)
def test_a_body_that_cannot_stand_is_refused(changes, words):
    with pytest.raises(af.errors.InvalidInput, match=words):
        carrying(arch_bridge(), [replace(LORRY, **{"x": 0.2} | changes)])


def test_a_body_on_a_bare_ring_is_refused_with_a_remedy():
    ring = af.circular_arch(radius=3.0, thickness=0.5, embrace=160.0, voussoirs=15)
    with pytest.raises(af.errors.InvalidInput, match="give the structure a fill or a paving"):
        carrying(ring, [replace(LORRY, x=0.0)])


@cache
def mill_bridge():
    """A bridge of which another linear programme gave the pushes that tests compare with.

    It has the ring by its arcs, the fill in 40 columns a stone without pressure, N, V and M at
    joints as unknowns, and crushing at 10 MPa by tangents to its parabola.
    """
    walls = [
        af.shapes.Sidewall(length=1.5, height=1.0, above=0.9, state="fixed", name=name)
        for name in ("left wall", "right wall")
    ]
    return af.bridge(
        arches=[af.shapes.Arch(span=7.4, rise=2.0, thickness=0.48, voussoirs=25)],
        sidewalls=walls,
        backfill=af.shapes.Backfill(cover=0.6),
        width=4.2,
        material=replace(af.STONE, unit_weight=23e3),
    )


def push(structure, lever, sense=1.0):
    """The push of a structure on which no fill presses [g]."""
    fill = replace(NO_PRESSURE, lever=lever)
    given = {"live": af.BodyForce(sense), "fill": fill, "strength": 10e6}
    return af.collapse_factor(structure, **given).factor


@pytest.mark.slow
def test_parapets_as_a_body_along_the_bridge_weigh_and_are_pushed():
    """13.8 kN/m, their centre 0.5 m above the road; answers of the programme of `mill_bridge`."""
    bridge = mill_bridge()
    (soil,) = (block for block in bridge.blocks if block.name == "backfill")
    left, right = soil.points[:, 0].min(), soil.points[:, 0].max()
    length = float(right - left)
    parapets = StandingBody(
        x=0.5 * (left + right), length=length, weight=13.8e3 * length, centre_of_gravity=0.5
    )
    for structure, lever, known in (
        (bridge, 0.0, 0.6055),
        (carrying(bridge, [parapets]), 0.0, 0.6123),
        (bridge, 1.0, 0.4574),
        (carrying(bridge, [parapets]), 1.0, 0.4593),
    ):
        assert push(structure, lever) == pytest.approx(known, rel=2e-3)


LONG = {
    "x": 5.2,
    "centre_of_gravity": 1.5,
    "axles": (93.2e3, 93.2e3, 68.7e3),
    "spacings": (1.35, 3.6),
}
SHORT = {"x": 6.6, "axles": (60e3, 115e3), "spacings": (4.0,), "centre_of_gravity": 1.3}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lorry", "lever", "right", "left"),
    [
        (LONG, 0.0, 0.5482, 0.8152),
        (LONG, 1.0, 0.3918, 0.5537),
        (SHORT, 0.0, 0.6568, 0.6065),
        (SHORT, 1.0, 0.4357, 0.3924),
    ],
)
def test_a_vehicle_on_an_arch_leans_as_in_another_linear_programme(lorry, lever, right, left):
    """Answers of the programme of `mill_bridge`, with axle loads in proportion along its wheels."""
    loaded = carrying(mill_bridge(), [replace(TRUCK, **{"length": 0.3, "width": 2.1} | lorry)])
    assert push(loaded, lever) == pytest.approx(right, rel=2e-3)
    assert push(loaded, lever, -1.0) == pytest.approx(left, rel=2e-3)


def test_axles_do_not_drive_over_a_body_nor_is_it_plastic_fill():
    loaded = carrying(arch_bridge(), [LORRY])
    with pytest.raises(af.errors.InvalidInput, match=r"remove = \[\"structure.standing\"\]"):
        af.rate(loaded, "LM1", fill=Fill(friction_angle=35.0))
    plastic = af.limit.PlasticFill(friction_angle=35.0, cohesion=5e3)
    with pytest.raises(af.errors.InvalidInput, match=r"\['lorry'\] on a plastic fill"):
        af.collapse_factor(loaded, live=af.BodyForce(1.0), fill=plastic)


@pytest.mark.slow
def test_a_body_that_slides_has_a_line_of_its_own_and_the_structure_stands():
    """Closed form: pushed by a on friction μ it slides by (a - μ g) t² / 2."""
    push, friction, time = 2.0, 0.1, 0.5
    body = StandingBody(
        x=-0.2,
        length=0.3,
        weight=1e3,
        centre_of_gravity=0.1,
        contact=replace(af.masonry.STONE_TO_STONE, friction=friction),
        name="box",
    )
    loaded = carrying(af.column(breadth=1.0, heights=[0.5]), [body])
    motion = af.Motion(np.full(round(time / 0.005) + 1, push), 0.005)
    run = af.Analysis(loaded, fidelity="rigid", displacements="large", dt=1e-3).run(motion)
    moved = 0.5 * (push - friction * 9.81) * time**2
    at = [block.name for block in loaded.blocks].index("box")
    assert run.dataset["largest_displacement"].values[at] == pytest.approx(moved, rel=0.03)
    assert run.verdict.outcome == "stands"  # though the box moves by more than a tenth of 1 m
    assert moved > 0.1
    assert run.verdict.displacement < 1e-3
    assert set(run.verdict.farthest) == {loaded.blocks[1].name}
    largest = 1e3 * run.dataset["largest_displacement"].values[at]
    said = f"'box', which stands on it, was displaced by up to {largest:.3g} mm, "
    assert said in str(run.verdict)
    weaker = af.Analysis(loaded, fidelity="rigid", displacements="large", dt=1e-3).run(
        motion.scaled(0.6)
    )
    (line,) = [x for x in describe_pairs({"a": weaker, "b": run}).splitlines() if "'box'" in x]
    assert line.startswith(said)
    assert line.endswith(" at the end, under 'b'")


def test_an_axle_beyond_the_end_of_a_bridge_is_named_with_its_place():
    bridge = arch_bridge(width=2.0)
    end = max(x for block in bridge.blocks for x, _ in block.points)
    axles = {"axles": [90e3, 90e3, 70e3], "spacings": [1.0, 2.0], "width": 2.0}
    lorry = StandingBody(x=end - 1.0, length=0.3, centre_of_gravity=1.2, name="lorry", **axles)
    # halfway between axles 3 m apart is 1.5 m before the last
    said = f"its axle at x = {end + 0.5:.4g} m is beyond the structure: make the sidewalls"
    with pytest.raises(af.errors.InvalidInput, match=said):
        carrying(bridge, [lorry])
    # a wheel of which a third is beyond the end
    single = StandingBody(x=end - 0.05, length=0.3, weight=9e3, centre_of_gravity=1.2)
    said = f"stands on 0.2 m of its 0.3 m, as the structure ends at x = {end:.4g} m: make the side"
    with pytest.raises(af.errors.InvalidInput, match=said):
        carrying(bridge, [single])


@pytest.mark.slow
def test_a_body_on_many_stones_of_a_wall_in_bond_is_a_doubt():
    """It ties them together: cut into pieces, the same weight falls at less."""
    wall = af.shapes.wall(breadth=3.0, height=1.5, width=0.5, course=0.25, stone=0.5)

    def roof(left, right):
        size = {"x": 0.5 * (left + right), "length": right - left}
        weight = 20e3 * (right - left)
        return StandingBody(**size, weight=weight, centre_of_gravity=0.2, name=f"roof {left}")

    pieces = [roof(left, left + 0.5) for left in np.arange(-1.5, 1.4, 0.5)]
    axles = {"axles": [10e3] * 4, "spacings": [0.6] * 3, "length": 0.1}
    truck = StandingBody(x=0.0, **axles, centre_of_gravity=0.5, name="truck")
    bodies = {"whole": [roof(-1.5, 1.5)], "pieces": pieces, "axles": [truck]}
    walls = {key: carrying(wall, own) for key, own in bodies.items()}
    found = {key: structure_doubts(each) for key, each in walls.items()}
    assert (found["pieces"], found["axles"]) == ([], [])
    (doubt,) = found["whole"]
    stones = [x for x in wall.blocks if np.isclose(x.points[:, 1].max(), 1.5)]
    assert doubt.cause.startswith(f"'roof -1.5' lies on {len(stones)} stones of a wall")
    factors = [
        af.collapse_factor(walls[key], live=af.BodyForce(1.0)).factor for key in ("whole", "pieces")
    ]
    assert factors[0] > 1.1 * factors[1]
    # the fill of a bridge has no bond
    road = replace(LORRY, length=8.0, width=None)
    assert structure_doubts(carrying(arch_bridge(width=2.0), [road])) == []
