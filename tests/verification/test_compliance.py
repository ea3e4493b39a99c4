"""The stepper for large structures: its factor, its small problem, and the histories it gives."""

import time
from dataclasses import replace

import numba
import numpy as np
import pytest
from glued import glued
from scipy import sparse
from scipy.sparse.linalg import splu

import archfem as af
from archfem.dynamics.stepping.banded import Banded
from archfem.dynamics.stepping.choice import LEAD, SHORTEST, TIMED, _places, chosen, stepper_for
from archfem.dynamics.stepping.compliance import Compliance
from archfem.dynamics.stepping.elimination import Elimination
from archfem.dynamics.stepping.joint_law import Law
from archfem.dynamics.stepping.loop import advance
from archfem.dynamics.stepping.modal import Modal
from archfem.dynamics.stepping.newmark import follow, numbers_of
from archfem.dynamics.stepping.panels import backward, factorised, forward
from archfem.dynamics.stepping.small_problem import release
from archfem.dynamics.stepping.sparse import Sparse
from archfem.joints.facets import Facets
from archfem.joints.points import JointPoints
from archfem.joints.springs import Springs

TIGHT = af.statics.Newton(tolerance=1e-13)
STRONG = af.Motion.synthetic(duration=4.0, pga=5.0, seed=5).cut(1.0, 1.6)
BRIEF = STRONG.cut(0.0, 0.3)
NEWMARK, CONSERVING = af.dynamics.Newmark(), af.dynamics.Conserving()


@numba.njit
def released(law, start, rows, compliance, force, enough):
    """`release` by the type of the law, which is chosen where it is compiled."""
    return release(law, start, rows, compliance, force, enough)


@pytest.fixture(scope="module")
def filled():
    """One span under backfill."""
    arch = af.shapes.Arch(span=5.8, embrace=159.0, thickness=0.58, voussoirs=9, name="main arch")
    return af.bridge(arches=[arch], backfill=af.shapes.Backfill(cover=0.4))


@pytest.mark.parametrize("rule", [pytest.param("lobatto", marks=pytest.mark.slow), "exact"])
@pytest.mark.parametrize(
    ("joints", "scheme"),
    [
        ("closed", CONSERVING),
        ("closed", NEWMARK),
        ("initial", af.HHT(-0.1)),
        ("none", CONSERVING),
        pytest.param("none", af.HHT(-0.2), marks=pytest.mark.slow),
    ],
)
def test_history_is_that_of_snes(filled, rule, joints, scheme):
    """To 1e-8 of the largest, with a sixth of the joint points open, and the energies too.

    A few steps in which exact facets slide, fewer than a tenth, do not settle and are left to SNES.
    """
    structure = filled if scheme == CONSERVING else glued(filled)
    model = af.build(structure, quadrature=rule, cells=(2, 2))
    given = {
        "start": af.dead_load(model, TIGHT),
        "damping": af.Rayleigh(0.05, (4.0, 20.0), joints),
        "scheme": scheme,
        "newton": TIGHT,
        "dt": 0.005,
    }
    slow, fast = (
        af.time_history(model, BRIEF, method=method, **given) for method in ("snes", "compliance")
    )
    assert fast.dataset.attrs["method"] == "compliance"
    hard = rule == "exact" and scheme == CONSERVING
    assert fast.dataset.attrs["fallback_steps"] <= (0.1 * len(fast.time) if hard else 0)
    last = model.operator.openings(fast.dataset["last_q"].values)
    assert np.mean(last > 0.0) > 1.0 / 6.0
    for key in ("N", "V", "M"):
        off = np.abs(fast.joints[key] - slow.joints[key]).max()
        assert off < 1e-8 * np.abs(slow.joints[key]).max()
    drift = fast.dataset["energy_drift"] - slow.dataset["energy_drift"]
    assert np.abs(drift).max() < 1e-6  # of a joule, where hundreds are exchanged


@pytest.mark.slow
def test_steps_that_do_not_settle_are_left_to_snes(filled):
    model = af.build(filled, fidelity="rigid")
    equation = af.dynamics.Equation(model, STRONG, af.Rayleigh(0.05, (4.0, 20.0)))

    def impatient(series, memories, results, ground, system):
        count = advance(series, memories, results, ground, system)
        many = np.flatnonzero(results[1][:count] > 4)
        return int(many[0]) if len(many) else count

    solves = af.dynamics.Exact(equation, TIGHT)
    given = {"newton": TIGHT, "dt": 0.005}
    alone = af.dynamics.Stepper(equation, exact=solves)
    exact = af.time_history(model, STRONG, method=alone, **given)
    stepper = af.dynamics.Stepper(equation, Sparse.of(equation), exact=solves, advance=impatient)
    run = af.time_history(model, STRONG, method=stepper, **given)
    assert run.dataset.attrs["fallback_steps"] > 3
    off = np.abs(run.joints["M"] - exact.joints["M"]).max()
    assert off < 1e-8 * np.abs(exact.joints["M"]).max()


class Laborious(Sparse):
    """A strategy that takes a second to begin, where a run of a thousand steps takes a tenth."""

    tries = 0

    @classmethod
    def of(cls, equation):
        cls.tries += 1
        begun = time.process_time()
        while time.process_time() < begun + 1.0:
            pass
        return super().of(equation)


@pytest.mark.slow
def test_the_fastest_strategy_is_taken_and_remembered(ring):
    model = af.build(glued(ring), fidelity="rigid", cells=(1, 1), quadrature="exact")
    equation = af.dynamics.Equation(model, STRONG, af.Rayleigh(0.05, (8.0, 16.0)), NEWMARK)
    start, dt = equation.at_rest(af.dead_load(model).q), STRONG.duration / SHORTEST
    ways = (Laborious, Banded)
    assert isinstance(chosen(equation, start, dt, ways), Banded)
    assert Laborious.tries == 1
    again = af.dynamics.Equation(model, STRONG, equation.damping, NEWMARK)
    assert isinstance(chosen(again, start, dt, ways), Banded)
    assert Laborious.tries == 1  # the motion may be another
    assert isinstance(chosen(equation, start, 0.99 * dt, ways), Banded)
    assert Laborious.tries == 2  # the step may not


def test_short_runs_take_the_first_that_applies(ring):
    model = af.build(glued(ring), fidelity="rigid")
    equation = af.dynamics.Equation(model, STRONG, scheme=NEWMARK)
    start = equation.at_rest(af.dead_load(model).q)
    averaged = af.dynamics.Equation(model, STRONG)
    assert isinstance(chosen(averaged, start, 0.005, (Banded, Sparse)), Sparse)
    assert isinstance(chosen(equation, start, 0.005, (Banded, Sparse)), Banded)
    undamped = af.dynamics.Equation(model, STRONG, af.Rayleigh(0.05, (8.0, 16.0), "none"))
    assert isinstance(chosen(undamped, start, 0.005, (Modal, Sparse)), Sparse)
    slow = af.dynamics.Equation(af.build(ring, cells=(1, 1), fidelity="monolithic"), STRONG)
    assert stepper_for("auto", slow, start, 0.005).name == "snes"


def test_what_is_timed_does_not_settle(ring):
    """A strategy that gives up steps about the peak is not taken, whatever it costs."""
    model = af.build(glued(ring), fidelity="rigid", cells=(1, 1), quadrature="exact")
    equation = af.dynamics.Equation(model, STRONG, af.Rayleigh(0.05, (8.0, 16.0)), NEWMARK)
    start, dt = equation.at_rest(af.dead_load(model).q), STRONG.duration / SHORTEST

    class Indefinite(Banded):
        def system(self, dt):
            made = super().system(dt)
            return made._replace(without=-made.without)

    assert isinstance(chosen(equation, start, dt, (Indefinite, Sparse)), Sparse)


def test_supports_that_have_moved_are_refused_by_schemes_at_an_instant(ring):
    model = af.build(glued(ring), fidelity="rigid")
    moved = model.settled(af.Settlement(0, (0.0, -1e-3, 0.0)))
    equation = af.dynamics.Equation(moved, STRONG, scheme=NEWMARK)
    with pytest.raises(af.InvalidInput, match="supports have not moved"):
        stepper_for("compliance", equation, None, 0.005)
    averaged = af.dynamics.Equation(moved, STRONG)
    assert stepper_for("compliance", averaged, None, 0.005).name == "compliance"


def laplacian(side):
    """A matrix of a grid, and one of a piece apart from it."""
    line = sparse.diags([-1.0, 2.01, -1.0], [-1, 0, 1], (side, side))
    whole = sparse.identity(side)
    grid = sparse.kron(line, whole) + sparse.kron(whole, line)
    return sparse.block_diag([grid, line], format="csr")


@pytest.mark.parametrize("side", [2, 7, 30])
def test_factor_solves(side):
    matrix = laplacian(side)
    plan = Elimination.of(matrix)
    factor = factorised(matrix[plan.order][:, plan.order], plan)
    right = np.random.default_rng(1).standard_normal(matrix.shape[0])
    everywhere, room = np.ones(len(factor.parent), dtype=bool), np.empty(len(right))
    found = right[plan.order]
    forward(factor, found, room)
    half = found.copy()
    backward(factor, found, room, everywhere)
    solution = np.empty(len(right))
    solution[plan.order] = found
    assert matrix @ solution == pytest.approx(right, abs=1e-12)
    # A part of the tree is solved the same without the rest.
    branch, group = np.zeros(len(factor.parent), dtype=bool), 0
    while group >= 0:
        branch[group] = True
        group = factor.parent[group]
    backward(factor, half, room, branch)
    kept = branch[plan.group_of]
    assert half[kept] == pytest.approx(found[kept], abs=1e-13)


def with_crumbs(rng):
    """A symmetric matrix but for some entries that are mere rounding, each without its mirror."""
    size = int(rng.integers(5, 60))
    sides = rng.integers(size, size=(2, 2 * size))
    matrix = np.zeros((size, size))
    matrix[sides[0], sides[1]] = rng.uniform(size=2 * size)
    matrix += matrix.T + 10.0 * size * np.eye(size)
    crumbs = rng.integers(size, size=(2, 6))
    matrix[tuple(crumbs)] += np.where(matrix[tuple(crumbs)] == 0.0, 1e-16, 0.0)
    return matrix


def test_factor_bears_entries_that_rounding_has_left_on_one_side():
    """Of 300 matrices, three such entries used to lie outside the plan of the factor."""
    rng = np.random.default_rng(1)
    for _ in range(300):
        matrix = with_crumbs(rng)
        plan = Elimination.of(sparse.csr_matrix(matrix))
        ordered = sparse.csr_matrix(matrix)[plan.order][:, plan.order]
        factor, right = factorised(ordered, plan), rng.standard_normal(len(matrix))
        found, room = right[plan.order], np.empty(len(right))
        forward(factor, found, room)
        backward(factor, found, room, np.ones(len(factor.parent), dtype=bool))
        assert found == pytest.approx(np.linalg.solve(matrix, right)[plan.order], abs=1e-13)


def test_an_entry_outside_the_plan_is_refused():
    """It would be put anywhere."""
    plan = Elimination.of(sparse.identity(8, format="csr"))
    matrix = sparse.identity(8, format="lil")
    matrix[7, 0] = matrix[0, 7] = 0.1
    with pytest.raises(ValueError, match="the plan has not"):
        factorised(matrix.tocsr(), plan)


def shuffled_structure(rng):
    """A ring, a column, or a ring on piers, of stones some of which are soft as soil."""
    kind, contact = rng.integers(3), af.Contact(10.0 ** rng.uniform(8.5, 11.0), 3e8, 0.6)
    radius = rng.uniform(1.0, 4.0)
    if kind == 0:
        made = af.column(breadth=radius, heights=list(rng.uniform(0.3, 2.0, 4)), contact=contact)
    elif kind == 1:
        made = af.circular_arch(
            radius=radius,
            thickness=0.2 * radius,
            embrace=rng.uniform(100.0, 180.0),
            voussoirs=int(rng.integers(4, 12)),
            contact=contact,
        )
    else:
        made = af.arch_on_piers(
            radius=radius,
            thickness=0.2 * radius,
            voussoirs=int(rng.integers(4, 9)),
            pier_breadth=rng.uniform(0.4, 0.8) * radius,
            courses=[0.4 * radius] * int(rng.integers(1, 4)),
            contact=contact,
        )
    soft = replace(af.STONE, young=10.0 ** rng.uniform(6.0, 9.0), name="soft")
    stones = tuple(
        replace(block, material=soft) if rng.random() < 0.4 else block for block in made.blocks
    )
    return replace(made, blocks=stones)


@pytest.mark.parametrize(
    ("first", "count"), [(0, 40), pytest.param(40, 2000, marks=pytest.mark.slow)]
)
def test_each_solve_of_a_random_structure_is_that_of_superlu(first, count):
    """In another order, by another factor: 1e-8, with 1e12 between stiff and soft at most."""
    for seed in range(first, first + count):
        rng = np.random.default_rng(seed)
        rung = "rigid" if rng.random() < 0.85 else "faces"
        model = af.build(shuffled_structure(rng), fidelity=rung, cells=(2, 2))
        equation = af.dynamics.Equation(model, STRONG, af.StiffnessDamping(0.05, 8.0))
        strategy = Sparse.of(equation)
        system = strategy.system(0.005)
        inertia, rate = system.linear.numbers.inertia, system.linear.numbers.rate
        whole = model.closed() + inertia * model.mass + rate * equation.rest
        right, room = rng.standard_normal(model.size), np.empty(model.size)
        found = right.copy()
        forward(system.factor, found, room)
        backward(system.factor, found, room, np.ones(len(system.factor.parent), dtype=bool))
        wanted = splu(whole.tocsc()[strategy.order][:, strategy.order]).solve(right)
        assert np.abs(found - wanted).max() <= 1e-8 * np.abs(wanted).max(), seed


def test_factor_keeps_sparse():
    """A grid of 900 fills in to a tenth of the dense factor at most."""
    matrix = laplacian(30)
    plan = Elimination.of(matrix)
    factor = factorised(matrix[plan.order][:, plan.order], plan)
    assert len(factor.panels) < 0.1 * matrix.shape[0] ** 2 / 2.0


def test_matrix_that_is_not_definite_is_refused():
    matrix = laplacian(4)
    plan = Elimination.of(matrix)
    matrix = matrix - 3.0 * sparse.identity(matrix.shape[0], format="csr")
    with pytest.raises(np.linalg.LinAlgError):
        factorised(matrix[plan.order][:, plan.order], plan)


@pytest.mark.slow
@pytest.mark.parametrize("rule", ["springs", "facets"])
def test_released_forces_leave_no_tension(rule):
    """Against the joint law as SNES has it: closed stiffness less λ is the law's own force."""
    rng = np.random.default_rng(3)
    one = np.ones(40)
    points = JointPoints(
        np.zeros(40, int), 0.0 * one, 0.5 * one, 2.0 * one, one, np.inf * one, 0.0 * one, 1
    )
    facets = rule == "facets"
    law = Facets(points) if facets else Springs(points)
    spread = rng.standard_normal((40, 60))
    compliance = spread @ spread.T
    compliance *= 0.9 / np.linalg.eigvalsh(compliance)[-1] / 2.0  # 1 - F J stays definite
    start, force = rng.standard_normal(40), np.zeros(40)
    rows, stiffness = np.arange(40), np.full(40, 2.0 if facets else 1.0)
    compiled = Law(facets, stiffness, points.arm, points.joint)
    passes = released(compiled, start, rows, Compliance.of(compliance), force, 1e-13)
    gap = start + compliance @ force
    first, second = law.entries
    closed = sparse.csr_matrix((law.stiffness(np.full(40, -1.0)), (first, second)))
    assert passes > 1
    assert np.count_nonzero(force) > 10
    assert closed @ gap - force == pytest.approx(law.forces(gap), abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("others", [1, 20])
def test_a_facet_that_hardly_opens_is_released(others):
    """By so little that the integral of its nearer end is all rounding; directly and by CG."""
    size = 2 * others + 2
    law = Law(True, np.full(size, 2.0), np.zeros(size), np.zeros(size, dtype=int))
    compliance = Compliance.of(0.1 * np.eye(size))
    start, force, rows = np.full(size, -1.0), np.zeros(size), np.arange(size)
    for part in np.geomspace(1e-9, 1e-5, 200):
        start[0], start[1] = -1.0, part / (1.0 - part)
        assert released(law, start, rows, compliance, force, 1e-13) > 0
        assert force == pytest.approx(0.0, abs=2.0 * part)


def test_images_follow_the_state():
    """Of a random matrix, under HHT, against its products with the state."""
    rng = np.random.default_rng(4)
    numbers = numbers_of(0.005, (0.3025, 0.6, -0.1), 1e-3, 0.4)
    matrix = rng.standard_normal((8, 8))
    before, contact = rng.standard_normal((3, 8)), rng.standard_normal(8)
    after, image = np.empty((3, 8)), np.empty((3, 8))
    follow(contact, before, after, numbers)
    follow(matrix @ contact, before @ matrix.T, image, numbers)
    assert image == pytest.approx(after @ matrix.T, rel=1e-9)


def test_steps_are_timed_where_a_motion_is_weak_usual_strong_and_strongest():
    """Of a motion that swells and fades; also where its peak is too late, or its lull too early."""
    swelling = np.concatenate([np.linspace(0.0, 1.0, 600), np.linspace(1.0, 0.0, 601)[1:]])
    places = _places(swelling)
    means = [swelling[place : place + TIMED].mean() for place in places]
    beginning = LEAD / 900  # which is too early to be timed, as part of what is weaker
    assert np.allclose(means, [1 / 6, 1 / 2, 5 / 6, 1.0], rtol=0.0, atol=beginning)
    for strength in (swelling[600:], swelling[:600]):
        assert all(LEAD <= place <= len(strength) - TIMED for place in _places(strength))
