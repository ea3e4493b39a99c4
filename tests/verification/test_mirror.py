"""What does not depend on the side from which a structure is seen: it and its mirror image.

Under x → -x tangents, normals and the order of blocks stay those of the joints, so that N, V, M,
opening, rotation and slip are the same. Motions along x and turns change their sign, and so do
loads and ground motions along x. The structure is skew: its own image is another one.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import archfem as af

SAME = 1e-8
"""Of states that Newton's method ends at 1e-10 of the load, over some tens of steps."""

SKEW = 0.12
"""By which the ring leans, of its height."""

SENSES = np.array([-1.0, 1.0, -1.0])
"""Of a motion u, v and θ in the image."""


def skew(structure, contact):
    """A structure with plane faces, sheared along x."""

    def at(place):
        return place[0] + SKEW * place[1], place[1]

    blocks = tuple(
        replace(each, outline=tuple(map(at, each.outline)), centre=None)
        for each in structure.blocks
    )
    joints = tuple(
        replace(each, contact=contact, intrados=at(each.intrados), extrados=at(each.extrados))
        for each in structure.joints
    )
    return replace(structure, blocks=blocks, joints=joints)


def image(structure):
    """The mirror image: outlines run the other way round."""

    def at(place):
        return -place[0], place[1]

    blocks = []
    for each in structure.blocks:
        last = len(each.outline) - 1
        corners = each.corners and tuple(last - k for k in each.corners[::-1])
        outline = tuple(map(at, each.outline[::-1]))
        blocks.append(replace(each, outline=outline, corners=corners))
    joints = tuple(
        replace(each, intrados=at(each.intrados), extrados=at(each.extrados))
        for each in structure.joints
    )
    return replace(structure, blocks=tuple(blocks), joints=joints)


def ring(side, contact=af.masonry.STONE_TO_STONE):
    """Seven stones, or their image."""
    given = {"radius": 2.0, "thickness": 0.6, "embrace": 150.0, "voussoirs": 7, "chords": 1}
    found = skew(af.circular_arch(**given), contact)
    return found if side > 0.0 else image(found)


def of_joints(joints, name):
    keys = ("N", "V", "M", "eccentricity", "friction", "rotation", "opening", "slip")
    return {f"{name}, {key}": joints[key].values for key in keys}


def unmirrored(motion, side):
    """Motions of blocks (…, n_blocks, 3) as they are in the structure itself."""
    return motion * (SENSES if side < 0.0 else 1.0)


def at_rest(side):
    """Rigid blocks under their weight, loads, and a support that moves; dry, and with bonds."""
    found, stop = {}, af.statics.Stop(steps=2)
    held = af.Contact(1.48e9, 0.3e9, 0.6, cohesion=2e4, tension=2e4, dilatancy=0.1)
    spread = af.Settlement(0, (-0.01 * side, -0.02, 0.03 * side))
    loads = [af.BodyForce(side, -0.1), af.PointLoad(-0.4 * side, (3e3 * side, -5e3))]
    cases = ((af.masonry.STONE_TO_STONE, "large", loads), (held, "small", spread))
    for contact, displacements, load in cases:
        structure = ring(side, contact)
        model = af.build(structure, fidelity="rigid", displacements=displacements)
        dead = af.dead_load(model)
        found |= of_joints(dead.joints, displacements)
        found[f"{displacements}, q"] = unmirrored(dead.q.reshape(-1, 3), side)
        found[f"{displacements}, modes"] = af.modes(model, 3, dead).frequencies
        path = af.pushover(model, load, start=dead, stop=stop)
        found[f"{displacements}, path"] = path.curve["factor"].values
        found |= of_joints(path.joints, f"{displacements}, path")
        mirror, body = np.array([side, 1.0]), af.statics.forces_on(structure, dead.joints, 3)
        found[f"{displacements}, body"] = np.hstack([body.points * mirror, body.forces * mirror])
    return found


def in_the_blocks(side):
    """Stresses of blocks that yield."""
    structure = ring(side)
    model = af.build(structure, fidelity="full", cells=(1, 1))
    dead = af.dead_load(model)
    use, stress = (
        each(model, dead.q) for each in (af.statics.strength_use, af.statics.principal_stresses)
    )
    angle = side * stress["angle"].values
    found = {key: use[key].values for key in ("compression", "tension")}
    found |= {key: stress[key].values for key in ("s1", "s2")}
    return found | {"angle": angle, "x": side * stress["x"].values}


def at_the_limit(side):
    """Factors, mechanisms, and a vehicle."""
    structure, found = ring(side), {}
    ways = {"associated": {}, "rough": {"friction": None}, "crushing": {"strength": 1e6}}
    for name, given in ways.items():
        each = af.collapse_factor(structure, live=af.BodyForce(side, 0.1), **given)
        found |= {name: each.factor, f"{name}, moves": unmirrored(each.motion, side)}
        found[f"{name}, hinges"] = [number for number, _ in each.hinges]
    spread = af.Settlement(0, (-side, -0.5, 0.2 * side))
    found["settled"] = af.collapse_factor(structure, live=spread).factor
    places = [-0.9 * side, 0.4 * side]
    axles = af.moving_load(structure, [1e4, 2e4], spacings=[0.8], positions=places)
    found["vehicle"] = axles.factors["factor"].values[:: int(side)]
    return found


def assessed(side):
    """The finite motion of a pile that leans."""
    found, pile = {}, skew(af.column(breadth=0.8, heights=[0.7, 1.1]), af.Contact(1e9, 1e9, 1.0))
    pile = pile if side > 0.0 else image(pile)
    each = af.kinematic_assessment(pile, af.Eurocode8(ag=0.2, ground="B"), direction=side)
    for key in ("alpha_0", "M_star", "e_star", "a_0_star", "d_0_star"):
        found[key] = getattr(each, key)
    found["path"] = unmirrored(each.path.displacements, side)
    found["demand"] = each.displacement.demand
    return found


def shaken(side):
    """A motion along both axes."""
    found, whole, part = {}, af.Motion.synthetic(duration=2.0, pga=5.0, seed=2), slice(100, 160)
    motion = af.Motion(side * whole.horizontal[part], whole.dt, whole.vertical[part])
    for displacements in ("small", "large"):
        model = af.build(ring(side), fidelity="rigid", displacements=displacements)
        run = af.time_history(model, motion, dt=0.005, damping=af.StiffnessDamping(0.05, 8.0))
        found |= of_joints(run.joints, displacements)
    return found


known = cache(lambda answers: answers(1.0))


@pytest.mark.parametrize(
    "answers",
    [
        at_rest,
        in_the_blocks,
        at_the_limit,
        pytest.param(assessed, marks=pytest.mark.slow),
        shaken,
    ],
)
def test_answers_do_not_depend_on_the_side(answers):
    for name, value in answers(-1.0).items():
        expected = np.asarray(known(answers)[name], float)
        most = np.nanmax(np.abs(expected), initial=0.0)
        np.testing.assert_allclose(value, expected, atol=SAME * most, rtol=SAME, err_msg=name)
