"""Relaxation to equilibrium, soil joints that slide under dead load, and irreversible joints."""

from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
from scipy import sparse

import archfem as af
from archfem.joints import joint_dataset
from archfem.statics import relaxation, self_weight
from archfem.statics.continuation import LoadPath
from archfem.statics.newton import EquilibriumSolver, Solution
from archfem.statics.relaxation import _solve_creep_step, relax

REST = 1e-10
"""Out of balance relative to the load, to which equilibria are found."""


@pytest.fixture(scope="module")
def bridge():
    """One span with an elastic fill, whose joints to the stone slide from 0.60 on."""
    ring = af.shapes.Arch(
        measured="centre line", name="arch", span=4.0, rise=1.6, thickness=0.45, voussoirs=11
    )
    wall = {"length": 1.5, "height": 2.0, "above": 0.8}
    return af.bridge(
        arches=[ring],
        sidewalls=[
            af.shapes.Sidewall(name="left wall", **wall),
            af.shapes.Sidewall(name="right wall", **wall),
        ],
        backfill=af.shapes.Backfill(cover=0.5),
        width=4.0,
    )


def at_most_coulomb(structure, joints, cohesion=0.0):
    """Whether no joint bears more shear than Coulomb's law allows."""
    normal, shear = joints["N"].values, np.abs(joints["V"].values)
    limit = structure.friction * normal + cohesion * structure.width * structure.depths
    return bool(np.all(shear <= limit * (1.0 + 1e-9)))


def test_where_nothing_slides_creep_ends_where_newton_does(stack):
    model = af.build(stack, fidelity="rigid")
    weight = self_weight(model)
    after, solved = relax(EquilibriumSolver(model.size), model, weight, np.zeros(model.size))
    direct = af.dead_load(model)
    assert solved.q == pytest.approx(direct.q, rel=1e-6, abs=1e-15)
    assert not after.memory.any()


def test_a_block_that_flows_down_a_plane_is_given_up_soon():
    """On 0.3 rad with μ = 0.2: W (sin φ - μ cos φ) = 1.04 kN drives it on, whatever the step.

    Two dozen steps after the first, which took up what friction holds, nothing is nearer to rest.
    """
    turn = np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])

    def box(low, high, **given):
        corners = np.array([[-0.5, low], [0.5, low], [0.5, high], [-0.5, high]]) @ turn
        return af.Block(tuple(map(tuple, corners.tolist())), af.STONE, role="pier", **given)

    plane, block = box(-0.2, 0.0, name="plane", fixed=True), box(0.0, 0.5, name="block")
    bed = af.Joint((0, 1), *block.outline[:2], af.Contact(1e10, 4e9, 0.2), "bed", role="pier")
    model = af.build(af.Structure((plane, block), (bed,)), fidelity="rigid")
    with pytest.raises(af.DidNotConverge, match=r"in 25 steps of creep: 1\.08e\+03 of 1\.00e\+04"):
        relax(EquilibriumSolver(model.size), model, self_weight(model), np.zeros(model.size))


@pytest.mark.parametrize("fidelity", [pytest.param("faces", marks=pytest.mark.slow), "full"])
def test_soil_joints_slide_and_newton_finds_the_dead_load(bridge, fidelity):
    model = af.build(bridge, fidelity={"backfill": "full", "rest": fidelity}, cells=(2, 2))
    found = af.dead_load(model)
    assert at_most_coulomb(bridge, found.joints)
    assert found.steps == 1
    assert found.iterations <= 30
    soil = bridge.block_number("backfill")
    against = [k for k, pair in enumerate(bridge.pairs) if soil in pair]
    used = found.joints["friction"].values[against]
    assert np.nanmax(used) == pytest.approx(0.6, rel=1e-9)
    assert np.abs(found.model.memory).max() > 1e-5


def test_fill_in_pieces_creeps_to_rest(bridge):
    """Its free ends stand by cohesion; no joint bears more than Mohr and Coulomb."""
    fill = af.masonry.jointed_fill(bridge, 0.8, friction_angle=35.0, cohesion=10e3)
    model = af.build(fill, fidelity="rigid", cells=(2, 1))
    found = af.dead_load(model)
    weight = self_weight(model)
    rest = np.linalg.norm(found.model.force(found.q) - weight)
    assert rest <= REST * np.abs(weight).sum()
    assert at_most_coulomb(fill, found.joints, 10e3)


@pytest.mark.slow
def test_upright_ends_of_dry_sand_flow(bridge):
    fill = af.masonry.jointed_fill(bridge, 0.8, friction_angle=20.0)
    with pytest.raises(
        af.DidNotConverge, match=r"joints slide .* it stands from a coefficient of friction"
    ):
        af.dead_load(af.build(fill, fidelity="rigid", cells=(1, 1)))


@pytest.mark.slow
def test_a_support_spreads_under_fill_in_pieces(bridge):
    """Newton's method alone loses it after 3 cm; each step is in balance, and none beyond Coulomb.

    The work of the weights is the thrust on the support, and falls as it gives way.
    """
    fill = af.masonry.jointed_fill(bridge, 0.8, friction_angle=35.0, cohesion=10e3)
    model = af.build(fill, fidelity="rigid", cells=(2, 1))
    spread = af.Settlement("left wall, foundation", (-1.0, 0.0, 0.0))
    stop = af.statics.Stop(displacement=0.01)
    found = af.pushover(model, spread, stop=stop)
    assert found.outcome.startswith("the support moved by")
    assert at_most_coulomb(fill, found.joints, 10e3)
    assert found.factor < 0.9 * float(found.curve["factor"][0])


@pytest.mark.slow
def test_a_load_on_fill_in_pieces_continues_by_creep(bridge):
    """Each state is in balance and none beyond Coulomb; loads that cannot be borne add none."""
    fill = af.masonry.jointed_fill(bridge, 0.8, friction_angle=35.0, cohesion=10e3)
    dead = af.dead_load(af.build(fill, fidelity="rigid", cells=(2, 1)))
    path = LoadPath.of(dead.model, [af.BodyForce(1.0)], dead)
    assert path.advance_by_relaxation(0.1, farthest=0.5)
    rest = path.dead + 0.1 * path.load.first - path.model.force(path.states[-1])
    assert np.linalg.norm(rest) <= REST * np.abs(path.dead).sum()
    joints = joint_dataset(fill, path.joint_forces[-1])
    assert at_most_coulomb(fill, joints, 10e3)
    assert not path.advance_by_relaxation(0.01, farthest=1e-6)  # it moves farther than that
    assert path.factors == [0.0, 0.1]


def counting(monkeypatch):
    """How many iterations each solve has made, as a list that grows."""
    made, solve = [], EquilibriumSolver.solve

    def counted(solver, *given, **more):
        solved = solve(solver, *given, **more)
        made.append(solved.iterations)
        return solved

    monkeypatch.setattr(EquilibriumSolver, "solve", counted)
    return made


def test_reported_iterations_are_those_made(stack, ring, monkeypatch):
    """By creep, under dead load at once and in stages, on a support that moves, and by a push."""
    model, made = af.build(stack, fidelity="rigid"), counting(monkeypatch)
    _, solved = relax(
        EquilibriumSolver(model.size), model, self_weight(model), np.zeros(model.size)
    )
    assert solved.iterations == sum(made) > 0
    for stages in (None, af.masonry.usual_stages(stack)):
        made.clear()
        found = af.dead_load(model, stages=stages)
        assert found.iterations == sum(made) > 0
        assert found.steps == len(made)
    settled = model.settled(af.Settlement("base", (0.0, -0.01, 0.0)))
    made.clear()
    found = af.dead_load(settled)
    assert found.iterations == sum(made) > 0
    assert found.steps == len(made)


def test_where_newton_fails_a_step_of_creep_is_made_with_given_limits(stack, monkeypatch):
    """Six times, each from limits of the one before; the iterations of all are reported."""
    calls = []

    def dragged(solver, model, load, starts, drag, searches):
        calls.append((starts, searches, getattr(model, "operator", model)))
        if len(calls) == 1:
            raise af.DidNotConverge("made to fail")
        return Solution(starts[1] + 1.0, len(calls), 0.5)

    monkeypatch.setattr("archfem.statics.relaxation._solve_with_drag", dragged)
    model = af.build(stack, fidelity="rigid")
    load, start = self_weight(model), np.zeros(model.size)
    solved = _solve_creep_step(
        EquilibriumSolver(model.size), model, load, start, model.closed_tangent()
    )
    assert solved.iterations == sum(range(2, 8))
    assert [float(guess[0]) for (_, guess), _, _ in calls] == [0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    assert all(not first.any() for (first, _), _, _ in calls)
    assert [searches for _, searches, _ in calls] == [("basic",)] + [("basic", "cp")] * 6
    assert (solved.q == 6.0).all()


class Creeping:
    """A model of one coordinate, whose force nears the load by a part of what is left a step."""

    operator, memory = None, np.zeros(1)

    def __init__(self, part, left=1.0):
        self.part, self.left = part, left

    def closed_tangent(self):
        return sparse.csr_matrix([[1.0]])

    def tangent(self, q):
        return sparse.csr_matrix([[0.0]])

    def updated_memory(self, q):
        return self.left * (1.0 - self.part)

    def with_memory(self, left):
        return Creeping(self.part, left)

    def force(self, q):
        return np.array([1.0 - self.left])


@pytest.fixture
def drags(monkeypatch):
    """The drag of each step; a step takes what `iterations` says, or fails where that is None."""
    drag_history, iterations = [], []

    def crept(solver, model, load, start, drag):
        drag_history.append(float(drag[0, 0]))
        taken = iterations.pop(0) if len(iterations) > 1 else iterations[0]
        if taken is None:
            raise af.DidNotConverge("made to fail")
        return Solution(start, taken, 0.0)

    monkeypatch.setattr("archfem.statics.relaxation._solve_creep_step", crept)
    return drag_history, iterations


def creep(part):
    return relax(EquilibriumSolver(1), Creeping(part), np.ones(1), np.zeros(1))


def test_drag_falls_after_easy_steps_and_grows_after_failed_ones(drags):
    """By four; eight iterations are easy, nine are not. It is given up beyond 256."""
    drag_history, iterations = drags
    iterations += [8, 9, 9, None, 8]
    _, solved = creep(0.9999)
    assert drag_history == [1.0, 0.25, 0.25]
    assert solved.iterations == 8 + 9 + 9
    drag_history.clear()
    iterations[:] = [None]
    with pytest.raises(af.DidNotConverge, match="in 0 steps of creep"):
        creep(0.5)
    assert drag_history == [1.0, 4.0, 16.0, 64.0, 256.0]


@pytest.mark.parametrize(("part", "steps"), [(0.029, 24), (0.032, 100)])
def test_creep_continues_while_the_residual_halves_in_two_dozen_steps(drags, part, steps):
    """0.971²³ is 0.51, 0.968²³ is 0.47; a hundred steps are made at most."""
    drag_history, iterations = drags
    iterations += [9]
    with pytest.raises(af.DidNotConverge, match=f"in {steps} steps of creep") as caught:
        creep(part)
    assert len(drag_history) == steps
    assert f"{(1.0 - part) ** steps:.2e} of 1.00e+00 stays" in str(caught.value)


@pytest.mark.parametrize(
    ("stiffness", "tolerance"), [(1.0, 2e-10), (1e7, 8.0 * 2.0**-52 * 3e7), (1e9, 2e-7)]
)
def test_creep_ends_at_the_rounding_of_its_forces(stiffness, tolerance):
    """A coordinate at 3 m under 2 N: 1e-10 of the load, or 8 eps K q, but no more than 1e-7."""
    model = SimpleNamespace(tangent=lambda q: sparse.csr_matrix([[-stiffness]]))
    found = relaxation._relaxation_tolerance(EquilibriumSolver(1), model, np.array([3.0]), 2.0)
    assert found == pytest.approx(tolerance, rel=1e-12)


@pytest.mark.parametrize(("beyond", "holds"), [(0.0, True), (0.95e-9, True), (1.05e-9, False)])
def test_shear_beyond_its_limit_by_rounding_still_holds(stack, beyond, holds):
    """By a billionth of the limit."""
    joints = af.build(stack, fidelity="rigid").operator
    q = 1e-6 * np.random.default_rng(1).normal(size=6)
    shear = np.abs(joints.trial_shear(q))
    given = relaxation.TrescaJoints.of(joints, shear / (1.0 + beyond))
    stiffness = given.stiffness(q)  # of openings, of slips, and their coupling as of openings
    first = (len(stiffness) - len(shear)) // 2
    along = stiffness[first : first + len(shear)]
    assert along.tolist() == (holds * joints.points.shear_spring).tolist()


UPSET = SimpleNamespace(points=SimpleNamespace(is_plain=False), bonds=None)
"""Joints that dilate."""


class Toothed:
    """A model whose joints slide on by so much at each equilibrium."""

    force = tangent = None

    def __init__(self, further, memory=0.0, operator=UPSET):
        self.further, self.memory, self.operator = further, np.array([memory, 0.0]), operator

    def updated_memory(self, q):
        return float(self.memory[0]) + self.further

    def with_memory(self, memory):
        return Toothed(self.further, memory, self.operator)


@pytest.fixture
def found(monkeypatch):
    """Numbers of iterations by which equilibria are found, one after the other."""
    made = []

    def balanced(solver, model, load, start, searches):
        return Solution(start + 1.0, made.pop(0), 0.25)

    monkeypatch.setattr(relaxation, "_solve_balance", balanced)
    return made


def test_an_equilibrium_is_repeated_until_its_memory_is_in_balance(found):
    found += [3, 2, 0, 7]
    model, solved = relaxation.solve_irreversible(None, Toothed(-0.1), np.zeros(2), np.zeros(2))
    assert (solved.iterations, solved.residual) == (5, 0.25)
    assert solved.q.tolist() == [3.0, 3.0]
    assert model.memory[0] == pytest.approx(-0.2)
    assert found == [7]


def test_the_first_equilibrium_may_be_in_balance_by_chance(found):
    """The memory of its joints is checked even so."""
    found += [0, 0]
    _, solved = relaxation.solve_irreversible(None, Toothed(0.0), np.zeros(2), np.zeros(2))
    assert solved.q.tolist() == [2.0, 2.0]


def test_joints_that_only_slide_are_in_balance_at_once(found):
    found += [4]
    plain = SimpleNamespace(points=SimpleNamespace(is_plain=True))
    model, solved = relaxation.solve_irreversible(
        None, Toothed(0.5, 0.0, plain), np.zeros(2), np.zeros(2)
    )
    assert (solved.iterations, model.memory[0]) == (4, 0.5)


def test_joints_that_never_stop_are_given_up(found, monkeypatch):
    monkeypatch.setattr(relaxation, "MAX_IRREVERSIBLE_ITERATIONS", 3)
    found += [1] * 3
    with pytest.raises(
        af.DidNotConverge, match=r"in 3 rounds under the same load, by 0\.3 m in the"
    ):
        relaxation.solve_irreversible(None, Toothed(-0.3), np.zeros(2), np.zeros(2))


@pytest.mark.parametrize(
    ("felt", "iterations", "stays"), [(0.1, 0, False), (-0.1, 0, True), (-0.1, 1, False)]
)
def test_a_bond_that_is_torn_does_not_last(felt, iterations, stays):
    bonds = SimpleNamespace(find_exceeded=lambda gaps: gaps > 0.0)
    joints = SimpleNamespace(bonds=bonds, effective_gaps=lambda q: np.array([-1.0, felt]))
    assert (
        relaxation.is_stationary(SimpleNamespace(operator=joints), np.zeros(2), iterations) is stays
    )


def test_a_relaxed_state_is_that_of_a_load_in_steps(monkeypatch):
    arch = af.shapes.Arch(span=6.0, rise=1.5, thickness=0.4, voussoirs=15)
    cover = af.shapes.Backfill(cover=0.3)
    footbridge = af.bridge(arches=[arch], backfill=cover, width=3.0)
    fidelity = {"backfill": "full", "rest": "rigid"}
    model = af.build(footbridge, fidelity=fidelity, displacements="large", cells=(3, 2))
    creep = Mock(side_effect=relaxation.relax)
    monkeypatch.setattr(relaxation, "relax", creep)
    dead = af.dead_load(model)
    if not creep.called:
        pytest.skip("Newton's method converges here without creep")
    solver, state, q = EquilibriumSolver(model.size), model, np.zeros(model.size)
    for step in range(16):
        weight = (step + 1) / 16.0 * self_weight(model)
        state, solution = relaxation.solve_irreversible(solver, state, weight, q)
        q = solution.q
    stepwise = state.resultants(q)
    # where joints keep what creep made them slide, forces differ by 1e-3
    assert np.abs(dead.model.resultants(dead.q) - stepwise).max() < 1e-8 * stepwise.max()
