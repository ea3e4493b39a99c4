"""Joints that stiffen as they close, against quadrature, differences, closed forms and energy."""

from math import pi, sqrt

import numpy as np
import pytest
from kernels import either
from scipy.integrate import quad

import archfem as af
from archfem.dynamics.fall import release_blocks
from archfem.dynamics.solvers.equation import Equation
from archfem.dynamics.solvers.newton import NewtonSolver
from archfem.dynamics.solvers.selection import stepper_for
from archfem.joints.contact_law import LARGEST_CLOSING, ContactLaw
from archfem.joints.large import closing_law
from archfem.joints.normal_law import Facets, Springs
from archfem.joints.quadrature import JointPoints
from archfem.units import GPa, mm

STIFFNESS, CLOSURE = 3.0 * GPa, 0.1 * mm
"""k_n [Pa/m] and δ_m [m], p_0 = 0.3 MPa."""

TIMES = np.arange(0.0, 0.6, 0.005)
MOTION = af.Motion(4.0 * np.sin(4.0 * pi * TIMES) * (TIMES < 0.25), 0.005)

LAW = ContactLaw.of(af.Contact(STIFFNESS, 1e9, 0.6, closure=CLOSURE))

excess_means = either(closing_law.excess_means)
facet_step_excess = either(closing_law.facet_step_excess)
point_step_excess = either(closing_law.point_step_excess)

PROFILES = [
    (-0.1, 0.2),
    (0.01, 0.3),
    (0.2, 0.21),
    (0.2, 0.29),
    (-0.3, 0.97),
    (0.9, 1.2),
    (1.1, 1.2),
]
"""Closings of both ends over δ_m: open, closed, nearly equal, beyond the end of the law."""


def excess(closing):
    """The traction in excess of the linear law, by its formula [Pa]."""
    share = max(closing / CLOSURE, 0.0)
    inside = min(share, LARGEST_CLOSING)
    slope = 1.0 / (1.0 - LARGEST_CLOSING) ** 2
    pressure = inside / (1.0 - inside) + slope * (share - inside)
    return STIFFNESS * CLOSURE * (pressure - share)


@pytest.mark.usefixtures("each_way")
@pytest.mark.parametrize(("first", "last"), PROFILES)
def test_means_along_a_facet_are_those_of_quadrature(first, last):
    first, last = first * CLOSURE, last * CLOSURE
    breaks = [place for place in (0.0, LARGEST_CLOSING * CLOSURE) if first < place < last]
    breaks = [(place - first) / (last - first) for place in breaks]

    def mean(weight):
        def integrand(x):
            return excess(first + x * (last - first)) * weight(x)

        return quad(integrand, 0.0, 1.0, points=breaks or None, epsabs=0.0, epsrel=1e-11)[0]

    _, (near, far), _ = excess_means(STIFFNESS, 1.0 / CLOSURE, first, last)
    assert near == pytest.approx(mean(lambda x: 1.0 - x), rel=1e-9)
    assert far == pytest.approx(mean(lambda x: x), rel=1e-9)


@pytest.mark.usefixtures("each_way")
@pytest.mark.parametrize(("first", "last"), PROFILES)
def test_means_and_tangents_are_derivatives(first, last):
    ends, step = np.array([first, last]) * CLOSURE, 1e-6 * CLOSURE

    def differences(part):
        values = []
        for move in step * np.eye(2):
            low, high = (
                np.atleast_1d(excess_means(STIFFNESS, 1.0 / CLOSURE, *(ends + sign * move))[part])
                for sign in (-1.0, 1.0)
            )
            values.append((high - low) / (2.0 * step))
        return np.array(values)

    _, means, (first_pair, mixed, last_pair) = excess_means(STIFFNESS, 1.0 / CLOSURE, *ends)
    # central differences of values that round by 1e-15 of the largest
    tolerance = {"rtol": 1e-6, "atol": 1e-8 * STIFFNESS}
    np.testing.assert_allclose(differences(0).ravel(), means, **tolerance)
    np.testing.assert_allclose(
        differences(1), [[first_pair, mixed], [mixed, last_pair]], **tolerance
    )


STEPS = [
    (0.2, 0.1, 0.25, 0.13),
    (-0.1, 0.3, 0.2, 0.4),
    (0.5, -0.2, 0.9, -0.6),
    (0.2, 0.2, 0.6, 0.8),
]
"""Closings of both ends over δ_m before a step, then after it."""


@pytest.mark.usefixtures("each_way")
@pytest.mark.parametrize("ends", STEPS)
def test_mean_of_a_step_does_the_work_of_the_energy(ends):
    ends = np.array(ends) * CLOSURE
    (near, far), _ = facet_step_excess(STIFFNESS, 1.0 / CLOSURE, tuple(ends), 0.0, 1.0)
    stored = [excess_means(STIFFNESS, 1.0 / CLOSURE, *pair)[0] for pair in (ends[:2], ends[2:])]
    work = near * (ends[2] - ends[0]) + far * (ends[3] - ends[1])
    # Gauss's rule, where the change is small
    assert work == pytest.approx(stored[1] - stored[0], rel=1e-9)
    place, _ = point_step_excess(STIFFNESS, 1.0 / CLOSURE, ends[0], ends[2], 0.0, 1.0)
    stored = [excess_means(STIFFNESS, 1.0 / CLOSURE, end, end)[0] for end in ends[::2]]
    assert place * (ends[2] - ends[0]) == pytest.approx(stored[1] - stored[0], rel=1e-10)


@pytest.mark.usefixtures("each_way")
@pytest.mark.parametrize("ends", STEPS)
def test_tangent_of_a_step_is_nearly_the_derivative(ends):
    """Its off-diagonal entries are made equal; the others are exact but for quadrature in time."""
    lag, step = 0.1, 1e-6 * CLOSURE
    rates = lag * np.ones(4) + [0.0, 0.0, 1.0, 1.0]

    def means(*moves):
        moved = np.array(ends) * CLOSURE + rates * np.tile(moves, 2)
        means, _ = facet_step_excess(STIFFNESS, 1.0 / CLOSURE, tuple(moved), lag, 1.0 + lag)
        return np.array(means)

    found = [(means(*move) - means(*-move)) / (2.0 * step) for move in step * np.eye(2)]
    scaled = tuple(np.array(ends) * CLOSURE)
    _, (first, mixed, last) = facet_step_excess(STIFFNESS, 1.0 / CLOSURE, scaled, lag, 1.0 + lag)
    size = abs(first) + abs(last)
    assert [found[0][0], found[1][1]] == pytest.approx([first, last], abs=1e-3 * size)
    assert mixed == pytest.approx(0.5 * (found[0][1] + found[1][0]), abs=1e-3 * size)
    # this error is about the factor by which each iteration of Newton's method converges
    assert abs(found[0][1] - found[1][0]) < 0.2 * size


@pytest.mark.parametrize("kind", [Springs, Facets])
def test_definition_of_weak_forms_is_that_of_compiled_code(kind):
    """The traction by arithmetic, as UFL has it, where every place has the same gap."""
    gaps = CLOSURE * np.array([0.1, 0.0, -0.2, -0.6, -0.97, -0.99, -1.5])
    law = ContactLaw(*(np.full(2 * len(gaps), value) for value in LAW))
    points = JointPoints(np.arange(2 * len(gaps)) // 2, np.zeros(14), np.ones(14), law, len(gaps))
    openings = np.repeat(gaps, 2)
    expected = law.closing_traction(openings)
    assert kind(points).forces(openings) == pytest.approx(expected, rel=1e-9)
    energy = law.closing_energy(openings, np.log)
    assert kind(points).energies(openings) == pytest.approx(energy, rel=1e-9, abs=1e-12)


def closing_under(pressure):
    """The closing under a pressure, by the law solved for it [m]."""
    return pressure / STIFFNESS / (1.0 + pressure / (STIFFNESS * CLOSURE))


def stack(closure=CLOSURE, heights=(1.2, 1.2), friction=0.6):
    """A column of two blocks, 0.6 m broad."""
    contact = af.Contact(STIFFNESS, 1e9, friction, closure=closure)
    return af.column(breadth=0.6, heights=list(heights), contact=contact)


@pytest.mark.parametrize("displacements", ["small", "large"])
@pytest.mark.parametrize("quadrature", ["exact", "lobatto"])
def test_column_settles_by_the_law(displacements, quadrature):
    model = af.build(stack(), fidelity="rigid", quadrature=quadrature, displacements=displacements)
    lower, both = closing_under(48e3), closing_under(24e3)
    # 28.8 and 14.4 kN on 0.6 m
    dead = af.dead_load(model)
    assert dead.q[[1, 4]] == pytest.approx([-lower, -lower - both], rel=1e-9)


def test_modes_have_the_tangent_of_the_law():
    model = af.build(stack(heights=[1.2]), fidelity="rigid")
    pressure = 24e3
    tangent = STIFFNESS * (1.0 + pressure / (STIFFNESS * CLOSURE)) ** 2
    mass = pressure / af.units.G
    bounce = sqrt(tangent / mass) / (2.0 * pi)
    assert np.min(np.abs(af.modes(model, 3).frequencies - bounce)) < 1e-6 * bounce


def test_a_fall_takes_over_the_energy_that_joints_store():
    """Of both joints of a column, by the integral of the law."""
    model = af.build(stack(), fidelity="rigid", displacements="large")
    state = Equation(model, MOTION).at_rest(af.dead_load(model).q)
    shares = np.array([closing_under(48e3), closing_under(24e3)]) / CLOSURE
    stored = 0.6 * STIFFNESS * CLOSURE**2 * np.sum(-np.log(1.0 - shares) - shares)
    assert release_blocks(model, state).start.strain_energy == pytest.approx(stored, rel=1e-7)


def thin_ring(displacements, quadrature="exact", fidelity="rigid"):
    """A model of a ring that rocks."""
    contact = af.Contact(STIFFNESS, 1e9, 0.6, closure=CLOSURE)
    ring = af.circular_arch(radius=4.0, thickness=0.5, embrace=180.0, voussoirs=7, contact=contact)
    return af.build(ring, fidelity=fidelity, displacements=displacements, quadrature=quadrature)


def shaken(model, *, method="auto", damping=None, end=0.6):
    """The history of coordinates of a model, and energies of each step."""
    rest = af.dead_load(model)
    equation = Equation(rest.model, MOTION, damping)
    start = equation.at_rest(rest.q, memory=rest.model.memory)
    energies, coordinates = [equation.energy(start)], [start.q]
    for batch in stepper_for(method, equation).batches(start, 0.002, end):
        energies += list(batch.energy)
        coordinates += [batch.state(k).q for k in range(len(batch.times))]
    return np.array(coordinates), np.array(energies)


@pytest.mark.parametrize("quadrature", ["exact", "lobatto"])
@pytest.mark.parametrize("damping", [None, af.StiffnessDamping(0.05, 11.0)])
@pytest.mark.parametrize("displacements", ["small", "large"])
def test_steps_conserve_energy(displacements, damping, quadrature):
    """Kinetic and stored energy change by the work of the ground and of gravity, less the loss."""
    states, energies = shaken(thin_ring(displacements, quadrature), damping=damping)
    kinetic, stored, work, lost = energies.T
    balance = kinetic + stored - np.cumsum(work) + np.cumsum(lost)
    assert np.ptp(states) > 0.01  # it rocks
    assert np.ptp(balance) < 1e-8 * np.cumsum(np.abs(work))[-1]
    assert lost[1:].min() > -1e-12 * np.abs(work).max()


@pytest.mark.slow
def test_compiled_steps_are_those_of_snes():
    damping = af.StiffnessDamping(0.05, 11.0)
    compiled, _ = shaken(thin_ring("small"), damping=damping, end=0.3)
    found, _ = shaken(thin_ring("small"), method="snes", damping=damping, end=0.3)
    # impacts magnify the tolerance of SNES, 1e-10 of the loads
    assert np.abs(compiled - found).max() < 1e-6 * np.ptp(found)


@pytest.mark.slow
def test_steps_of_elastic_stones_that_begin_with_an_earlier_factor_are_those_of_snes():
    model, given = thin_ring("small", fidelity="condensed"), {"end": 0.06}
    given["damping"] = af.StiffnessDamping(0.05, 11.0)
    assert NewtonSolver.of(Equation(model, MOTION)).keeps_factor
    assert not NewtonSolver.of(Equation(thin_ring("small"), MOTION)).keeps_factor
    compiled, _ = shaken(model, **given)
    found, _ = shaken(model, method="snes", **given)
    assert np.abs(compiled - found).max() < 1e-6 * np.ptp(found)


def test_elastic_stones_conserve_energy_where_a_joint_opens_ahead_of_its_gap():
    """With the lag of damping a facet is open in steps in which it is closed without."""
    damping = af.StiffnessDamping(0.05, 11.0)
    _, energies = shaken(thin_ring("small", fidelity="condensed"), damping=damping, end=0.6)
    kinetic, stored, work, lost = energies.T
    balance = kinetic + stored - np.cumsum(work) + np.cumsum(lost)
    assert np.ptp(balance) < 1e-8 * np.cumsum(np.abs(work))[-1]


def test_a_large_closure_is_linear():
    linear = af.dead_load(af.build(stack(closure=None), fidelity="rigid"))
    nearly = af.dead_load(af.build(stack(closure=0.02), fidelity="rigid"))
    # σ / p_0 is 48 kPa / 60 MPa
    assert nearly.q[1] == pytest.approx(linear.q[1], rel=1e-3)
    assert nearly.q[1] > linear.q[1]


def test_dead_load_beyond_the_law_is_refused():
    with pytest.raises(af.InvalidInput, match=r"closes joint 'joint 0' by .* 2\.4 MPa: the law"):
        af.dead_load(af.build(stack(closure=1e-7, heights=[60.0, 60.0]), fidelity="rigid"))


@pytest.mark.parametrize("closure", [0.0, -1e-4, np.nan, 2.0, "small"])
def test_an_impossible_closure_is_refused(closure):
    with pytest.raises(af.InvalidInput, match="closure"):
        af.Contact(STIFFNESS, 1e9, 0.6, closure=closure)


def test_bonds_and_laws_of_the_user_have_no_closure():
    with pytest.raises(af.InvalidInput, match="beside a closure"):
        af.Contact(STIFFNESS, 1e9, 0.6, cohesion=1e5, tension=1e5, closure=CLOSURE)


def test_compliance_method_is_refused():
    with pytest.raises(af.InvalidInput, match="stiffen"):
        shaken(thin_ring("small"), method="compliance")


def test_a_monolithic_model_has_it_at_instants_only():
    pytest.importorskip("dolfinx")
    held = stack(friction=None)
    model = af.build(held, fidelity="monolithic", cells=(1, 1), quadrature="gauss")
    full = af.build(held, fidelity="full", cells=(1, 1), quadrature="gauss")
    assert af.dead_load(model).q == pytest.approx(af.dead_load(full).q, rel=1e-8, abs=1e-14)
    motion = af.Motion(np.ones(10), 0.01)
    with pytest.raises(af.InvalidInput, match="closure"):
        af.time_history(model, motion, dt=0.01)
    runs = [
        af.time_history(each, motion, dt=0.01, scheme=af.dynamics.Newmark(), method="snes")
        for each in (model, full)
    ]
    first, second = (run.joints["M"].values for run in runs)
    assert first == pytest.approx(second, rel=1e-6, abs=1e-6 * np.abs(second).max())
