"""Steps by SNES: Newton's tangent is that of the step, and what is said where steps fail."""

from dataclasses import replace

import numpy as np
import pytest
from repeats import each_once

import archfem as af
from archfem.dynamics import Equation

DAMPINGS = (
    None,
    af.StiffnessDamping(0.05, 8.0),
    af.Rayleigh(0.05, (8.0, 30.0)),
    af.Rayleigh(0.05, (8.0, 30.0), "initial"),
    af.Rayleigh(0.05, (8.0, 30.0), "none"),
)

SCHEMES = (af.dynamics.Conserving(), af.dynamics.Newmark(), af.HHT(-0.2))


def stack(contact, motion=None):
    model = af.build(af.column(breadth=1.0, heights=[0.6, 0.8], contact=contact), fidelity="rigid")
    return model, motion or af.Motion(0.3 * np.sin(np.arange(40) / 3.0), 0.005)


@pytest.mark.parametrize(("damping", "scheme"), each_once(DAMPINGS, SCHEMES))
def test_a_step_with_closed_joints_takes_one_iteration(damping, scheme):
    """The equation is linear then, and Newton's method exact, from any guess and for any step."""
    model, motion = stack(af.Contact(1e9, 4e8, None))
    equation = Equation(model, motion, damping, scheme)
    solver, state = af.dynamics.SnesSolver(equation), equation.at_rest(af.dead_load(model).q)
    for dt in (0.005, 0.02, 0.001):
        step = solver.whole(state, dt)
        assert step.iterations == 1
        state = step.state
        assert model.observer().faces(model.observer().read(state.q))[0].max() < 0.0
        assert step.smallest_step == dt


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_step_is_halved_eight_times_at_most(scheme):
    """Into two hundred and fifty-six parts; each half anew, from where the other ended."""
    model, motion = stack(af.Contact(1e9, 4e8, None))
    equation, tried = Equation(model, motion, None, scheme), []

    def fail(state, dt):
        tried.append(dt)
        raise af.DidNotConverge("made to")

    start = equation.at_rest(af.dead_load(model).q)
    with pytest.raises(af.DidNotConverge, match=r"step from t = 0 s failed, down to 3.91e-05 s"):
        next(af.dynamics.SnesSolver(equation, attempts=fail).steps(start, 0.01, 0.01))
    assert tried == pytest.approx(0.01 / 2.0 ** np.arange(9))


@pytest.mark.parametrize(
    ("scheme", "friction", "kind", "words"),
    [
        (af.dynamics.Newmark(), None, "small", "or scheme=HHT"),
        (af.HHT(-0.1), None, "small", "try a smaller dt$"),
        (af.dynamics.Conserving(), 0.6, "small", "try a smaller dt$"),
        (af.dynamics.Conserving(), None, "large", "try a smaller dt$"),
    ],
)
def test_damping_by_the_scheme_is_advised_where_it_applies(scheme, friction, kind, words):
    pile = af.column(breadth=1.0, heights=[0.6], contact=af.Contact(1e9, 4e8, friction))
    model = af.build(pile, fidelity="rigid", displacements=kind)
    equation = Equation(model, af.Motion(np.zeros(9), 0.01), None, scheme)

    def fail(state, dt):
        raise af.DidNotConverge("made to")

    start = equation.at_rest(np.zeros(model.size))
    with pytest.raises(af.DidNotConverge, match=words):
        next(af.dynamics.SnesSolver(equation, attempts=fail).steps(start, 0.01, 0.01))


@pytest.mark.parametrize(("share", "said"), [(0.95e-6, False), (1.05e-6, True)])
def test_joints_are_too_stiff_where_rounding_bears_a_millionth_of_the_weight(share, said):
    """Rounding of the size of the structure, at the stiffest joint over its whole area."""
    plain = af.column(breadth=1.0, heights=[0.6, 0.8], contact=af.Contact(1e9, 4e8, None))
    plain = replace(plain, width=3.0)
    depth = plain.depths.max()
    stiff = share * plain.weight / (2.0**-52 * plain.size * depth * 3.0)
    joints = tuple(
        replace(joint, contact=af.Contact(stiff / (2.0 - k), 4e8, None))
        for k, joint in enumerate(plain.joints)
    )
    model = af.build(replace(plain, joints=joints), fidelity="rigid")
    solver = af.dynamics.SnesSolver(Equation(model, af.Motion(np.zeros(9), 0.01)))
    assert solver._rounding_share() == pytest.approx(share, rel=1e-9)
    assert ("joints are so stiff" in solver._remedy()) is said
