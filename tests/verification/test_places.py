"""Results do not depend on where a structure stands: the origin of a drawing is arbitrary.

Places go with the structure; forces, displacements and factors are what they were. A centre added
where it is to be taken away, or a level in place of a rise, is nothing about the origin.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from backfilled import arch_bridge

import archfem as af

AWAY = np.array([37.0, -53.0])
"""Some ten times as far as structures are large [m]."""

SAME = 1e-8
"""Of states that Newton's method ends at 1e-10 of the load; places lose one digit or two."""


def moved(structure, away):
    """The same structure elsewhere."""

    def at(point):
        return None if point is None else tuple(np.asarray(point) + away)

    blocks = tuple(
        replace(each, outline=tuple(map(at, each.outline)), centre=at(each.centre))
        for each in structure.blocks
    )
    joints = tuple(
        replace(each, intrados=at(each.intrados), extrados=at(each.extrados))
        for each in structure.joints
    )
    return replace(structure, blocks=blocks, joints=joints)


def of_joints(joints, prefix):
    names = ("N", "M", "eccentricity", "rotation", "opening", "slip")
    return {f"{prefix}, {key}": joints[key].values for key in names}


def at_rest(away):
    """A ring on piers, at three fidelities, under its weight and a load, and as blocks move far."""
    portal = af.arch_on_piers(
        radius=2.0, thickness=0.5, voussoirs=5, pier_breadth=0.7, courses=[0.6]
    )
    there, found = moved(portal, away), {}
    push = af.PointLoad(float(away[0]) - 0.7, (2e3, -1.5e3))
    found["weight"] = there.weight
    for fidelity, kind in (("rigid", "small"), ("faces", "large"), ("full", "small")):
        model = af.build(there, fidelity=fidelity, cells=(1, 1), displacements=kind)
        dead = af.dead_load(model)
        name = f"{fidelity}, {kind}"
        found |= of_joints(dead.joints, name)
        found[f"{name}, work"] = model.load(push) @ dead.q
        found[f"{name}, energy"] = model.energy(dead.q)
        found[f"{name}, moved"] = model.cells.displacement(dead.q)
        found[f"{name}, places"] = model.cells.places - away
        line = af.joints.thrust_line(there, dead.joints).values
        found[f"{name}, line"] = line - away
        body = af.statics.forces_on(there, dead.joints, there.free[3], model.cells)
        found[f"{name}, body"] = np.column_stack([body.points - away, body.forces])
        if fidelity == "full":
            stress = af.statics.principal_stresses(model, dead.q)
            found |= {key: stress[key].values for key in ("s1", "s2")}
            found["use"] = af.statics.strength_use(model, dead.q)["use"].values
    return found


def at_the_limit(away):
    """A bridge with its fill: factors, moving parts, and blocks into which a fill is cut."""
    bridge, found = moved(arch_bridge(), away), {}
    gravel, x = af.limit.Fill(friction_angle=35.0), float(away[0])
    for name, live in (
        ("sideways", af.BodyForce(1.0)),
        ("a load", af.PointLoad(x + 3.0, (0.0, -1e4))),
    ):
        each = af.collapse_factor(bridge, live=live, fill=gravel)
        found |= {name: each.factor, f"{name}, moves": each.motion}
        found[f"{name}, hinges"] = [number for number, _ in each.hinges]
    axle = af.moving_load(bridge, 1e4, positions=x + np.array([3.0, 4.0]), fill=gravel)
    found["an axle"] = axle.factors["factor"].values
    grains = af.masonry.jointed_fill(bridge, 1.0, friction_angle=35.0)
    found["grains"] = [len(grains.blocks), sum(block.area for block in grains.blocks)]
    placed = af.masonry.usual_stages(bridge)
    found["stages"] = [len(stage.blocks) for stage in placed]
    joined = af.masonry.assembled(bridge.blocks, af.masonry.STONE_TO_STONE)
    found["touching"] = sorted(map(tuple, np.round(joined.middles - away, 6)))
    return found


known = cache(lambda answers: answers(np.zeros(2)))


@pytest.mark.parametrize("answers", [at_rest, pytest.param(at_the_limit, marks=pytest.mark.slow)])
def test_answers_do_not_depend_on_the_origin(answers):
    for name, value in answers(AWAY).items():
        expected = np.asarray(known(answers)[name], float)
        most = np.nanmax(np.abs(expected), initial=0.0)
        np.testing.assert_allclose(value, expected, atol=SAME * most, rtol=SAME, err_msg=name)
