"""A block on a joint: section law, frequencies, uplift, sliding, rocking.

Closed forms of the no-tension elastic joint, and of the rocking block with linear kinematics:

@article{housner1963, author={Housner, G. W.}, title={The behavior of inverted pendulum structures
during earthquakes}, journal={Bull. Seism. Soc. Am.}, volume={53}, pages={403--417}, year={1963}}
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

import archfem as af

GRAVITY = 9.81
STONE = af.Material(30e9, 0.2, 2000.0 * GRAVITY)
JOINT = af.Contact(1e9, 4e8, 0.6)


def block(breadth=0.6, height=2.4, contact=JOINT, material=STONE):
    return af.column(breadth=breadth, heights=[height], contact=contact, material=material)


def test_three_frequencies(verified):
    model = af.build(block(), fidelity="rigid")
    squares = eigh(model.tangent(np.zeros(3)).toarray(), model.mass.toarray(), eigvals_only=True)
    assert np.sqrt(squares) / (2.0 * np.pi) == pytest.approx([8.884, 72.644, 91.118], rel=1e-4)
    case = "block 0.6 × 2.4 m on a joint, frequencies [Hz]"
    known = [8.884, 72.644, 91.118]
    verified(case, known, "rigid body on springs, closed form", np.sqrt(squares) / (2.0 * np.pi))


def test_frequencies_of_an_elastic_block_approach_the_rigid_ones():
    hard = af.Material(3e13 / 10.0, 0.2, 2000.0 * GRAVITY)
    model = af.build(block(material=hard), fidelity="full", cells=(4, 8), degree=2)
    squares = eigh(
        model.tangent(np.zeros(model.size)).toarray(),
        model.mass.toarray(),
        eigvals_only=True,
        subset_by_index=[0, 2],
    )
    # A hundred times stiffer than stone: its own flexibility changes them by less than 0.3 %.
    assert np.sqrt(squares) / (2.0 * np.pi) == pytest.approx([8.884, 72.644, 91.118], rel=3e-3)


@pytest.mark.parametrize("e", [0.05, 0.15, 1.0 / 6.0, 0.25, 0.35, 0.45])
def test_section_law(e, verified):
    """Rotation of a joint under N and M = e N h, up to h/6 and beyond.

    64 facets with 3 Lobatto points: the edge of contact falls inside a facet, where the rule
    errs by less than one part in a thousand.
    """
    model = af.build(block(), fidelity="rigid", cells=(64, 1))
    normal, depth = 1e6, 0.6
    load = np.array([0.0, -normal, -e * normal * depth])  # clockwise presses the right edge
    found = af.statics.equilibrium_under(model, load)
    stiffness, width = JOINT.normal_stiffness, 1.0
    if e <= 1.0 / 6.0:
        rotation = 12.0 * e * normal * depth / (stiffness * width * depth**3)
    else:
        compressed = 3.0 * (0.5 - e) * depth
        rotation = 2.0 * normal / (stiffness * width * compressed**2)
    assert float(found.joints["eccentricity"][0]) == pytest.approx(e, rel=1e-9)
    assert -found.q[2] == pytest.approx(rotation, rel=1e-3)
    case = f"block 0.6 × 2.4 m, turn under N at e = {e:.3g} [rad]"
    verified(case, rotation, "no-tension section, closed form", -found.q[2])


def test_moment_approaches_its_limit_only_as_rotation_grows():
    """M = N (h/2 - (1/3) sqrt(2 N / (k_n w θ))) read at the rotation found."""
    model = af.build(block(), fidelity="rigid", cells=(256, 1))
    normal = 1e6
    found = af.statics.equilibrium_under(model, np.array([0.0, -normal, -0.49 * normal * 0.6]))
    rotation = -found.q[2]
    moment = normal * (0.3 - np.sqrt(2.0 * normal / (1e9 * rotation)) / 3.0)
    assert float(found.joints["M"][0]) == pytest.approx(moment, rel=2e-4)


@pytest.mark.parametrize(
    "contact",
    [JOINT, pytest.param(replace(JOINT, friction=None), marks=pytest.mark.slow)],
    ids=["μ", "glued"],
)
@pytest.mark.parametrize(
    ("fidelity", "rule"),
    [
        pytest.param("rigid", None, marks=pytest.mark.slow),
        ("rigid", "lobatto"),
        pytest.param("full", None, marks=pytest.mark.slow),  # the search that fails takes 15 s
    ],
)
def test_uplift_at_a_quarter_of_g(fidelity, rule, contact):
    """b/h = 0.25: just below, the base is hinged but holds; just above, nothing does."""
    model = af.build(block(contact=contact), fidelity=fidelity, cells=(4, 8), quadrature=rule)
    weight = af.statics.self_weight(model)
    held = af.statics.equilibrium_under(model, weight + model.load(af.BodyForce(0.245)))
    assert float(held.joints["eccentricity"][0]) == pytest.approx(2.0 * 0.245, rel=1e-6)
    assert int(held.joints["hinge"][0]) == 1
    with pytest.raises(af.DidNotConverge, match="no equilibrium beyond"):
        af.statics.equilibrium_under(model, weight + model.load(af.BodyForce(0.255)))


def pushed(factor, contact=JOINT):
    """A flat block on which a part of its weight acts sideways."""
    model = af.build(block(breadth=4.0, height=0.5, contact=contact), fidelity="rigid")
    load = af.statics.self_weight(model) + model.load(af.BodyForce(factor))
    return af.statics.equilibrium_under(model, load).joints


def test_sliding_at_the_coefficient_of_friction():
    """Just below it the block stays; just above it nothing holds the block."""
    found = pushed(0.599)
    assert float(found["friction"][0]) == pytest.approx(0.599, rel=1e-9)
    assert not found["slide"][0]
    with pytest.raises(af.DidNotConverge, match="no equilibrium beyond"):
        pushed(0.601)


@pytest.mark.parametrize(("factor", "slides"), [(0.59, False), (0.61, True)])
def test_a_joint_that_never_slides_is_judged_by_the_criteria(factor, slides):
    found = pushed(factor, replace(JOINT, friction=None))
    assert float(found["friction"][0]) == pytest.approx(factor, rel=1e-9)
    assert not found["slide"][0]
    judged = af.joints.criteria.with_failure_flags(found, af.Criteria(friction=0.6))
    assert bool(judged["slide"][0]) == slides


@pytest.mark.slow
def test_rocking_period(verified):
    """Quarter period of free rocking from θ₀ = 0.1 α: sqrt(2 I₀ θ₀ / (W b)), 0.737 s in all."""
    stiff = af.Contact(1e12, 1e12, 0.6)
    model = af.build(block(contact=stiff), fidelity="rigid", cells=(1, 1), quadrature="nodal")
    theta = 0.1 * np.arctan(0.25)
    still = af.Motion(np.zeros(2), 0.15)
    equation = af.dynamics.Equation(model, still)
    # Turned by θ₀ clockwise about the lower right corner, 0.3 m right and 1.2 m below its centre.
    start = equation.at_rest(np.array([1.2 * theta, 0.3 * theta, -theta]))
    start = equation.accelerated(replace(start))
    dt = 2e-4
    states = [step.state for step in af.dynamics.SnesSolver(equation).steps(start, dt, 0.25)]
    angles = np.array([-state.q[2] for state in states])
    landed = np.interp(
        0.0,
        -angles[: int(np.argmin(angles > 0.0)) + 1],
        [s.time for s in states][: int(np.argmin(angles > 0.0)) + 1],
    )
    radius, mass = np.hypot(0.3, 1.2), 2000.0 * 0.6 * 2.4
    period = 4.0 * np.sqrt(2.0 * (4.0 / 3.0) * mass * radius**2 * theta / (mass * GRAVITY * 0.3))
    assert period == pytest.approx(0.737, abs=5e-4)
    assert 4.0 * landed == pytest.approx(period, rel=2e-3)
    case = "block 0.6 × 2.4 m, rocking period from 0.1 α, linear kinematics [s]"
    verified(case, period, "4 √(2 I θ / W b)", 4.0 * landed)
