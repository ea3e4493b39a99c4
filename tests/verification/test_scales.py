"""Results do not depend on scale: an arch in other units of force, and a small copy of it.

Buckingham's theorem: with lengths l, widths w and weights per volume γ times as large, forces are
γ l² w, stresses γ l, stiffnesses of joints γ and times √l times as large, and all ratios the same.
Nothing that is compared with a zero, or that only keeps a quotient from 0 / 0, is a number of
newtons, metres or seconds.
"""

from functools import cache

import numpy as np
import pytest

import archfem as af

SAME = 1e-8
"""Of states that Newton's method ends at 1e-10 of the load, over some sixty steps."""

SCALES = [(4e-3, 1e-3, 1.0), (1.0, 0.04, 0.04)]
"""Of γ, w and l: joints bear some hundredths of a newton; a ring that spans 23 cm."""

FREQUENCIES = (8.0, 16.0)


def ring(weight, width, length, cohesion=0.0, tension=0.0):
    """Seven stones with plane faces."""
    stress = weight * length
    stone = af.Material(30e9 * stress, 0.2, 20e3 * weight, 50e6 * stress)
    held = {"cohesion": cohesion * stress, "tension": tension * stress}
    contact = af.Contact(1.48e9 * weight, 0.3e9 * weight, 0.6, **held)
    lengths = {"radius": 2.95 * length, "thickness": 0.45 * length, "width": width}
    given = {"embrace": 159.0, "voussoirs": 7, "chords": 1, "material": stone, "contact": contact}
    return af.circular_arch(**lengths, **given)


def of_joints(joints, force, length, prefix):
    """Ratios that joints have, at an instant or over time."""
    found = {key: joints[key].values for key in ("eccentricity", "friction", "rotation", "hinge")}
    found |= {key: joints[key].values / length for key in ("opening", "slip")}
    found |= {"N": joints["N"].values / force, "M": joints["M"].values / (force * length)}
    return {f"{prefix}, {key}": value for key, value in found.items()}


def at_rest(weight, width, length):
    """Under its weight and pushed, dry and with bonds, of rigid blocks and of such as yield."""
    force, found = weight * width * length**2, {}
    sizes = np.array([length, length, 1.0])
    for cohesion, fidelity in ((0.0, "rigid"), (2e4, "rigid"), (0.0, "faces")):
        structure = ring(weight, width, length, cohesion, cohesion)
        model = af.build(structure, fidelity=fidelity, cells=(1, 1))
        dead = af.dead_load(model)
        name = f"{fidelity}, {cohesion:g}"
        found |= of_joints(dead.joints, force, length, name)
        found[f"{name}, energy"] = model.energy(dead.q) / (force * length)
        found[f"{name}, modes"] = af.modes(model, 4).frequencies * np.sqrt(length)
        found[f"{name}, use"] = af.statics.utilisation(structure, dead.joints).values
        stages = af.masonry.usual_stages(structure)
        found |= of_joints(
            af.dead_load(model, stages=stages).joints, force, length, f"{name}, built"
        )
        push = af.pushover(
            model, af.BodyForce(1.0), stop=af.statics.Stop(steps=4, displacement=0.1 * length)
        )
        found[f"{name}, push"] = push.factor
        found |= of_joints(push.joints.isel(step=-1), force, length, f"{name}, pushed")
        body = af.statics.forces_on(structure, dead.joints, 3)
        found[f"{name}, body"] = body.forces / force
        found[f"{name}, points"] = body.points / length
        if fidelity == "rigid":
            found[f"{name}, q"] = (dead.q.reshape(-1, 3) / sizes).ravel()
    return found


def at_the_limit(weight, width, length):
    """Factors of limit analysis."""
    force, found = weight * width * length**2, {}
    dry, push = ring(weight, width, length), af.BodyForce(1.0)
    strength = 2e7 * weight * length
    for name, given in (
        ("associated", {}),
        ("flat", {"friction": "nonassociated"}),
        ("crushing", {"strength": strength}),
    ):
        found[name] = af.collapse_factor(dry, live=push, **given).factor
    load = af.PointLoad(-0.7 * length, (0.0, -force))
    found["a load"] = af.collapse_factor(dry, live=load).factor
    glued = ring(weight, width, length, 2e4)
    found["cohesion"] = af.collapse_factor(glued, live=push).factor
    places = np.array([-1.0, 0.5]) * length
    found["an axle"] = af.moving_load(dry, 1e4 * force, positions=places).worst.factor
    return found


def shaken(weight, width, length):
    """Under a motion that makes it a mechanism."""
    time, force = np.sqrt(length), weight * width * length**2
    whole = af.Motion.synthetic(duration=2.0, pga=9.0, seed=2)
    motion = af.Motion(whole.horizontal[100:280], whole.dt * time)
    damping = af.Rayleigh(0.05, tuple(each / time for each in FREQUENCIES))
    criteria = af.Criteria(duration=1e-3 * time)
    model = af.build(ring(weight, width, length), fidelity="rigid")
    run = af.time_history(model, motion, dt=0.005 * time, damping=damping, criteria=criteria)
    found = of_joints(run.joints, force, length, "shaken")
    found["begins"] = run.mechanism.time / time
    found["moves"] = run.verified.moved.time / time
    return found


known = cache(lambda answers: answers(1.0, 1.0, 1.0))


@pytest.mark.parametrize(
    "answers",
    [*(pytest.param(each, marks=pytest.mark.slow) for each in (at_rest, at_the_limit)), shaken],
)
@pytest.mark.parametrize(
    "scale", [pytest.param(SCALES[0], marks=pytest.mark.slow), SCALES[1]], ids=["light", "small"]
)
def test_ratios_do_not_depend_on_scale(answers, scale):
    for name, value in answers(*scale).items():
        expected = np.asarray(known(answers)[name], float)
        most = np.nanmax(np.abs(expected), initial=0.0)
        np.testing.assert_allclose(value, expected, atol=SAME * most, rtol=SAME, err_msg=name)
