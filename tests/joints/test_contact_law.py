"""One law, written twice: NumPy and UFL by one definition, compiled code by another.

States are random, of joints that hold, slide, never slide, with cohesion and without, closed, open,
opening, closing and just touching. The same numbers are found in three ways, and every tangent is
the central difference of what it belongs to.
"""

import numpy as np
import pytest
from kernels import either, interpreted

import archfem as af
from archfem.joints import contact_law
from archfem.joints.contact_law import (
    NO_LIMIT,
    ContactLaw,
    clip_to_friction,
    contact_fraction,
    contact_fraction_rate,
    is_closed,
    lagged_path,
    mean_shear_tangent,
    shear_loss,
    shear_over_step,
    shear_tangent,
)
from archfem.joints.large import point_law
from archfem.joints.large.point_law import CONTACT_RECORD
from archfem.joints.normal_law import Facets
from archfem.joints.quadrature import JointPoints

SAME = 1e-13
"""Rounding of sums of a few terms, relative to the largest."""

COUNT = 400

joint_means = either(point_law.joint_means)
mean_tractions = either(point_law.mean_tractions)
closed_means = either(point_law.closed_means)
shear_means = either(point_law.shear_means)
shear_limit = either(point_law.shear_limit)
damping_tractions = either(point_law.damping_tractions)
facet_energy = either(point_law.facet_energy)
point_energy = either(point_law.point_energy)


def contacts(random, count=COUNT):
    """Contacts that slide, with cohesion or without, among them frictionless ones, or never do."""
    kinds = [(0.6, 0.0), (0.4, 2e4), (0.0, 1e4), (0.0, 0.0), (None, 0.0), (np.inf, 3e4)]
    stiffness = 10.0 ** random.uniform(8.0, 10.0, (count, 2))
    return [
        af.Contact(*stiffness[k], kinds[k % 6][0], cohesion=kinds[k % 6][1]) for k in range(count)
    ]


def random_gaps(random, shape):
    """Openings of micrometres to centimetres, of either sign, and some that just touch."""
    size = 10.0 ** random.uniform(-6.0, -2.0, shape)
    return size * random.choice([-1.0, -1.0, -1.0, 0.0, 1.0], shape)


def states(seed, count=COUNT):
    """A law at points, its records, gaps at start and end, and elastic shear with its change."""
    random = np.random.default_rng(seed)
    law = ContactLaw.at_points(contacts(random, count), np.arange(count))
    records = np.array(list(zip(*law, strict=True)), CONTACT_RECORD)
    start, end = random_gaps(random, (2, count))
    scale = 10.0 ** random.uniform(-2.0, 1.0, count) * 1e5
    first, change = scale * random.standard_normal((2, count))
    return law, records, (start, end), (first, change)


def compiled(function, *columns):
    """A kernel of a point's numbers, at all points: a row for each of its results."""
    return np.array([function(*row) for row in zip(*columns, strict=True)]).T


def same(found, expected):
    """Whether numbers agree to rounding of the larger one; a guarded zero may be 1e-250."""
    size = np.maximum(np.abs(found), np.abs(expected))
    return np.all(np.abs(found - expected) <= SAME * size + 1e-250)


def mean_response(law, gaps, shear, lag, *, loss=shear_loss):
    """Means over a step by the definition of NumPy and UFL: traction, closed, limit, shear, …."""
    path = lagged_path(*gaps, lag)
    normal = law.mean_normal_traction(*path)
    closed = contact_fraction(*map(law.cohesive_gap, path))
    limit = law.shear_limit(normal, closed)
    return normal, closed, limit, *shear_over_step(*shear, lag, limit), loss(*shear, lag, limit)


@pytest.mark.usefixtures("each_way")
@pytest.mark.parametrize("lag", [0.0, 0.3])
def test_numpy_and_compiled_means_of_a_step_are_equal(lag):
    law, records, gaps, shear = states(1)
    normal, closed, limit, mean, lost, loss = mean_response(law, gaps, shear, lag)
    path = lagged_path(*gaps, lag)

    def at_point(contact, a, b, first, change):
        normals, _, _ = joint_means(contact, (a, a, b, b), lag, 1.0 + lag, False)
        times = closed_means(contact, (a, a, b, b), lag, False)[0]
        limit = shear_limit(contact, normals[0], times[0])
        mean, over, _, _, rubbing = shear_means(first, change, lag, limit)
        return normals[0], times[0], limit, mean, over, rubbing

    found = compiled(at_point, records, *path, *shear)
    for own, expected in zip(found[:3], (normal, closed, limit), strict=True):
        assert same(own, expected)
    # differences round as the trial shear does
    scale = np.abs(shear).sum(axis=0)
    assert np.all(np.abs(found[3] - mean) <= SAME * scale)
    assert np.all(np.abs(found[4] - lost) <= SAME * scale)
    assert np.all(np.abs(found[5] - loss) <= 8.0 * SAME * scale**2)
    assert np.all(loss >= -SAME * scale**2)
    # states of every kind are among them
    slides = lost != 0.0
    assert 0.1 < slides.mean() < 0.9
    assert closed.min() < 1e-250
    assert closed.max() == 1.0
    assert np.any((closed > 0.01) & (closed < 0.99))
    assert np.any(gaps[0] == 0.0)
    assert np.any(~slides & (limit > 0.0) & (limit < NO_LIMIT))


@pytest.mark.slow
def test_ufl_and_numpy_means_of_a_step_are_equal():
    """UFL evaluates its own expressions of the same definition, and differentiates them."""
    ufl, lag = pytest.importorskip("ufl"), 0.3
    law, _, gaps, shear = states(2, count := 4)
    constant = constants_of_ufl()
    symbols = [constant() for _ in range(len(law) + 4)]
    symbolic, (a, b, first, change) = ContactLaw(*symbols[: len(law)]), symbols[len(law) :]
    after, moved = ufl.variable(b), ufl.variable(change)
    expressions = mean_response(symbolic, (a, after), (first, moved), lag)
    expected = mean_response(law, gaps, shear, lag)
    across = law.mean_normal_tangent(*lagged_path(*gaps, lag), (lag, 1.0 + lag))
    along = mean_shear_tangent(*shear, lag, expected[2])[0]
    rates = ufl.diff(expressions[0], after), ufl.diff(expressions[3], moved)
    for k in range(count):
        row = dict(zip(symbols, (v[k] for v in (*law, *gaps, *shear)), strict=True))
        assert [expression((), row) for expression in expressions] == [v[k] for v in expected]
        # derivatives of the mean tractions, which are one-sided where faces just touch
        if k % 3 == 0 and 0.0 not in (gaps[0][k], gaps[1][k]):
            found = [rate((), row) for rate in rates]
            assert abs(found[0] - across[k]) <= 4.0 * SAME * law.normal_stiffness[k]
            assert abs(found[1] - along[k]) <= 1e-9


def constants_of_ufl():
    """A function that returns constants of a form."""
    mesh = pytest.importorskip("dolfinx").mesh
    from mpi4py import MPI

    from archfem.models.fem import _fenicsx

    grid = mesh.create_unit_square(MPI.COMM_SELF, 1, 1)
    return lambda: _fenicsx.constant(grid, 0.0)


@pytest.mark.usefixtures("each_way")
@pytest.mark.parametrize("lag", [0.0, 0.3])
def test_tangents_of_a_step_are_equal_and_central_differences(lag):
    law, records, gaps, (first, change) = states(3)
    path, rates = lagged_path(*gaps, lag), (lag, 1.0 + lag)
    across = law.mean_normal_tangent(*path, rates)
    cohesive = [*map(law.cohesive_gap, path)]
    closing = contact_fraction_rate(*cohesive, rates)
    limit = mean_response(law, gaps, (first, change), lag)[2]
    along, by_limit = mean_shear_tangent(first, change, lag, limit)

    def at_point(contact, a, b, first, change, limit):
        ends = a, a, b, b
        _, _, by_change, by_limit, _ = shear_means(first, change, lag, limit)
        tangent, rate = (f(contact, ends, lag, False)[1][0] for f in (mean_tractions, closed_means))
        return tangent, rate, by_change, by_limit

    found = compiled(at_point, records, *path, first, change, limit)
    assert np.all(np.abs(found[0] - across) <= SAME * law.normal_stiffness)
    total, between = np.abs(path).sum(axis=0), np.abs(cohesive).sum(axis=0)
    assert np.all(np.abs(found[1] - closing) * between <= 2.0 * SAME)
    assert np.abs(found[2] - along).max() <= SAME
    assert np.abs(found[3] - by_limit)[limit > 1e-250].max() <= SAME
    # central differences, away from kinks: where steps of two sizes agree, and nothing just touches
    touches = (gaps[0] == 0.0) | (gaps[1] == 0.0)

    def gap_path(end):
        return lagged_path(gaps[0], end, lag)

    def fraction_at(end):
        return contact_fraction(*map(law.cohesive_gap, gap_path(end)))

    force, size = law.normal_stiffness * total, np.abs(first) + np.abs(change)
    for own, function, place, terms in (
        (across, lambda end: law.mean_normal_traction(*gap_path(end)), gaps[1], force),
        (closing, fraction_at, gaps[1], 1.0),
        (along, lambda end: shear_over_step(first, end, lag, limit)[0], change, size),
        (by_limit, lambda end: shear_over_step(first, change, lag, end)[0], limit, size),
    ):
        steps = [part * np.where(place == 0.0, 1e-5, np.abs(place)) for part in (1e-5, 2e-5)]
        slopes = [(function(place + h) - function(place - h)) / (2.0 * h) for h in steps]
        rounding = 1e-15 * terms / steps[0]
        smooth = np.abs(slopes[0] - slopes[1]) <= 1e-6 * np.abs(slopes[0]) + rounding
        smooth &= (place < NO_LIMIT) & (rounding < 1e-6 * (1.0 + np.abs(own))) & ~touches
        assert smooth.mean() > 0.25
        scale = np.abs(own) + np.abs(slopes[0])
        assert np.all(np.abs(own - slopes[0])[smooth] <= (1e-5 * scale + rounding)[smooth])


@pytest.mark.usefixtures("each_way")
def test_an_instant_is_the_same_in_numpy_and_compiled():
    """Traction, energy and tangent; shear at rest, as a step without displacement."""
    law, records, (gap, _), (trial, _) = states(4)
    normal, closed = law.normal_traction(gap), is_closed(law.cohesive_gap(gap))
    limit = law.shear_limit(normal, closed)
    shear = clip_to_friction(trial, limit)
    along, by_limit = shear_tangent(trial, limit, closed)

    def at_point(contact, gap, trial):
        energy, traction = point_energy(contact, gap)
        ends = 4 * (gap,)
        normals, _, _ = joint_means(contact, ends, 0.0, 1.0, False)
        times = closed_means(contact, ends, 0.0, False)[0]
        limit = shear_limit(contact, normals[0], times[0])
        mean, over, by_change, by_limit, _ = shear_means(trial, 0.0, 0.0, limit)
        rate = mean_tractions(contact, ends, 0.0, False)[1][0]
        return energy, traction, normals[0], mean, over, 2.0 * by_change, by_limit, 2.0 * rate

    found = compiled(at_point, records, gap, trial)
    energy, tangent = law.normal_energy(gap), law.normal_tangent(gap)
    expected = energy, normal, normal, shear, trial - shear, along, by_limit, tangent
    for number, (own, other) in enumerate(zip(found, expected, strict=True)):
        if number == 5:  # a sliding point retains 1e-9 of its stiffness in statics
            assert np.abs(own - other).max() <= 1e-9
        elif number == 6:  # a limit of zero has no derivative
            assert np.array_equal(own[limit > 0.0], other[limit > 0.0])
        else:
            scale = np.maximum(np.abs(own), np.abs(other)) + (np.abs(trial) if number == 4 else 0.0)
            assert np.all(np.abs(own - other) <= SAME * scale), number
    assert 0.2 < np.mean(by_limit != 0.0) < 0.8


@pytest.mark.usefixtures("each_way")
@pytest.mark.parametrize("lag", [0.0, 0.3])
def test_facets_are_the_same_in_numpy_and_compiled(lag):
    """Ends of a facet that is closed, open, or opens along its length and in the step."""
    random, count = np.random.default_rng(5), 200
    kinds = contacts(random, count)
    law = ContactLaw.at_points(kinds, np.repeat(np.arange(count), 2))
    ones = np.full(2 * count, 0.5)
    points = JointPoints(np.zeros(2 * count, int), np.zeros(2 * count), ones, law, 1)
    facets = Facets(points)
    gaps = random_gaps(random, (2, 2 * count))
    gaps[:, 1:81:2] = 0.0  # far ends that touch all the time: the parts of a facet end there
    gaps[:, 0::2] += np.where(gaps[:, 0::2] == 0.0, 1e-6, 0.0)  # one end at most just touches
    path, rates = lagged_path(*gaps, lag), (lag, 1.0 + lag)
    pairs = [each.reshape(-1, 2) for each in path]
    ends = np.column_stack([pairs[0], pairs[1]])
    records = np.array([ContactLaw.of(kind) for kind in kinds], CONTACT_RECORD)

    def at_facet(contact, *ends):
        normals, _, _ = joint_means(contact, ends, *rates, True)
        pressed, tangent = mean_tractions(contact, ends, lag, True)
        times, moves = closed_means(contact, ends, lag, True)
        whole, last = facet_energy(contact, *ends[:2]), facet_energy(contact, *ends[2:])
        return *normals, *times, *tangent, *moves, *whole, *last, *pressed

    found = compiled(at_facet, records, *ends.T)
    normal, closed = (each.reshape(-1, 2).T for each in facets.step_means(*path))
    stiffness = np.abs(facets.contact.normal_stiffness)
    size = np.abs(ends).max(axis=1)
    for own in (found[:2], found[16:]):
        assert np.all(np.abs(own - normal) <= SAME * stiffness * size)
    assert np.abs(found[2:4] - closed).max() <= SAME
    both = facets.mean_stiffness(*path, rates).reshape(4, -1)[[0, 1, 3]]
    assert np.all(np.abs(found[4:7] - both) <= SAME * stiffness)
    moves = facets.mean_area_rate(*path, rates).reshape(4, -1)[[0, 1, 3]]
    # the rate of the closed fraction is as large as one over the distance from where it changes;
    # where nothing moves it is that of an instant
    steps = np.any(ends[:, :2] != ends[:, 2:], axis=1)
    assert steps.mean() > 0.95
    assert np.all((np.abs(found[7:10] - moves) <= 1e-9 * np.abs(moves) + 1e-9)[:, steps])
    # an energy, its force and its moment, at start and end
    for gaps, own in zip(path, (found[10:13], found[13:16]), strict=True):
        force = facets.forces(gaps).reshape(-1, 2)
        energy = facets.energies(gaps).reshape(-1, 2).sum(axis=1)
        whole = np.abs(gaps).reshape(-1, 2).max(axis=1)
        assert np.all(np.abs(own[0] - energy) <= SAME * stiffness * whole**2)
        assert np.all(np.abs(own[1] - force.sum(axis=1)) <= SAME * stiffness * whole)
        assert np.all(np.abs(own[2] - 0.5 * np.diff(force)[:, 0]) <= SAME * stiffness * whole)
    partly = (np.sign(ends).max(axis=1) > 0.0) & (np.sign(ends).min(axis=1) < 0.0)
    assert 0.2 < partly.mean() < 0.9


@pytest.mark.parametrize("lag", [pytest.param(0.0, marks=pytest.mark.slow), 0.3])
def test_a_facet_at_rest_presses_by_closed_form_and_loses_nothing(each_way, lag):
    """Partly closed, with gaps that differ by rounding from the start to the end of a step."""
    random, count = np.random.default_rng(6), 2000 if each_way is interpreted else 20000
    record, stiffness = np.array([ContactLaw.of(af.Contact(1e9, 1e9, 0.6))], CONTACT_RECORD)[0], 1e9
    sizes = 10.0 ** random.uniform(-16.0, -4.0, (2, count))
    ends = sizes * np.array([[-1.0], [1.0]])
    rounded = ends * (1.0 + np.finfo(float).eps * random.integers(-3, 4, (2, count)))
    # closed over this share, with a traction that falls to zero there
    share = sizes[0] / sizes.sum(axis=0)
    far = stiffness * ends[0] * share**2 / 6.0
    near = 0.5 * stiffness * ends[0] * share - far
    scale = stiffness * sizes.max(axis=0)
    pressed = compiled(lambda *gaps: mean_tractions(record, gaps, lag, True)[0], *ends, *rounded)
    damped = compiled(lambda *gaps: damping_tractions(record, gaps, lag, True), *ends, *rounded)
    assert np.all(np.abs(pressed - [near, far]) <= 1e-14 * scale)
    assert np.all(np.abs(damped) <= 1e-14 * scale)


def test_joints_that_never_slide_are_linear_along_to_the_last_digit():
    """None and infinity are one encoding: a limit that no shear reaches, also where open."""
    one, other = (ContactLaw.of(af.Contact(1e9, 3e8, friction)) for friction in (None, np.inf))
    assert one == other
    assert (one.friction, one.cohesion, one.resistance) == (0.0, 0.0, NO_LIMIT)
    random = np.random.default_rng(6)
    start, change = 1e6 * random.standard_normal((2, 100))
    for normal, closed in ((-1e6, 1.0), (0.0, 0.0)):
        limit = np.full(100, one.shear_limit(normal, closed))
        mean, lost = shear_over_step(start, change, 0.25, limit)
        assert same(mean, start + 0.75 * change)
        assert not lost.any()
        assert np.array_equal(clip_to_friction(start, limit), start)
        along, by_limit = shear_tangent(start, limit, np.full(100, closed))
        assert np.array_equal(along, np.ones(100))
        assert not by_limit.any()
        assert np.array_equal(mean_shear_tangent(start, change, 0.25, limit)[0], np.full(100, 0.75))


def test_a_parameter_of_contacts_is_one_of_points_records_and_forms():
    """Whatever the law depends on reaches every place by its name alone."""
    contact = af.Contact(2e9, 1e9, 0.5, cohesion=3e3, closure=1e-3)
    stone = af.column(breadth=1.0, heights=[1.0], contact=contact)
    points = af.build(stone, fidelity="rigid").operator.points
    law = ContactLaw.of(stone.joints[0].contact)
    assert law == (2e9, 1e9, 0.5, 3e3, 0.0, 1e3)
    assert [set(values) for values in points.contact] == [{value} for value in law]
    assert CONTACT_RECORD.names == contact_law.ContactLaw._fields


@pytest.mark.usefixtures("each_way")
def test_joints_that_rest_without_pressure_cohere_whichever_way_they_move():
    """Within 1e-4 of c / k_n = 1e-3 m of zero; beyond they cohere for the time before."""
    record = np.array([ContactLaw.of(af.Contact(5e7, 5e7, 0.6, cohesion=5e4))], CONTACT_RECORD)[0]
    for facet, whole in ((False, (1.0, 0.0)), (True, (0.5, 0.5))):
        for start, end in ((0.0, 1e-9), (1e-9, -1e-9), (-2e-9, 3e-8), (9e-8, 2e-8)):
            (near, far), rates = closed_means(record, (start, start, end, end), 0.0, facet)
            assert (near, far) == pytest.approx(whole, abs=1e-15)
            assert rates == (0.0, 0.0, 0.0)
        (near, far), _ = closed_means(record, (0.0, 0.0, 4e-7, 4e-7), 0.0, facet)
        assert near + far == pytest.approx(0.25)
