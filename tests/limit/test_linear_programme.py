"""Rigid-block equilibrium as a linear programme: loads, gaps, balance and crushing cuts."""

from dataclasses import replace

import highspy
import numpy as np
import pytest
from granite import granite_wall
from kinematics import gaps
from mechanisms import arch
from scipy import sparse
from scipy.optimize import linprog
from scipy.sparse import csr_matrix

import archfem as af
from archfem.limit import linear_programme, rating
from archfem.limit.linear_programme import RigidBlocks
from archfem.limit.self_weight import self_weight_programme


@pytest.fixture
def motion():
    """A motion of all blocks of the arch, supports included."""
    return np.random.default_rng(3).standard_normal((19, 3))


def test_gaps_are_those_of_the_points_at_the_joints(motion):
    found = RigidBlocks(arch()).gaps(motion)
    assert pytest.approx(gaps(arch(), motion), abs=1e-12) == found.T


def test_forces_do_the_work_of_their_balance(motion):
    """F and V on the gaps of a motion, against their resultants on the blocks."""
    blocks = RigidBlocks(arch())
    motion[[0, -1]] = 0.0
    forces = np.random.default_rng(4).standard_normal(3 * 18)
    intrados, extrados, slip = blocks.gaps(motion)
    work = forces @ np.concatenate([-intrados, -extrados, slip])
    left = blocks.balance @ forces
    assert left @ (motion[1:-1].ravel() / blocks.coordinate_units) == pytest.approx(work)


def test_loads_are_forces_at_centroids():
    structure = arch()
    weights = [b.area * b.material.unit_weight for b in structure.blocks[1:-1]]
    push = af.PointLoad(0.0, (2e3, -1e3))
    found = RigidBlocks(structure).load([af.BodyForce(0.5, -1.0), push]).reshape(-1, 3)
    block, point = push.place(structure)
    x, y = point - structure.blocks[block].centroid
    expected = np.outer(weights, [0.5, -1.0, 0.0])
    expected[block - 1] += [2e3, -1e3, -1e3 * x - 2e3 * y]
    assert found == pytest.approx(expected)


class RecordedHighs(highspy.Highs):
    """HiGHS whose options and iterations are recorded, and whose simplex method may fail."""

    fails = False

    def __init__(self):
        super().__init__()
        self.given = {}
        self.runs.append(self)

    def setOptionValue(self, name, value):
        self.given[name] = value
        return super().setOptionValue(name, value)

    def getModelStatus(self):
        failed = self.fails and self.given["solver"] == "simplex"
        return highspy.HighsModelStatus.kSolveError if failed else super().getModelStatus()

    @property
    def iterations(self):
        return self.getInfo().simplex_iteration_count


@pytest.fixture
def runs(monkeypatch):
    """The runs of HiGHS."""
    monkeypatch.setattr(RecordedHighs, "runs", [], raising=False)
    monkeypatch.setattr(linear_programme.highspy, "Highs", RecordedHighs)
    return RecordedHighs.runs


ONE = csr_matrix(np.ones((1, 1))), np.ones(1)
NO_LIMITS = csr_matrix((0, 1)), np.zeros(0)


@pytest.mark.parametrize(("cost", "presolved"), [(0.0, ["on"]), (1.0, ["off"])])
def test_presolve_comes_first_where_there_is_no_cost(cost, presolved, runs):
    given = np.array([cost]), np.array([[0.0, 2.0]]), ONE, NO_LIMITS
    assert linear_programme.solve_linear(*given).x == pytest.approx([1.0])
    assert [run.given["presolve"] for run in runs] == presolved


def test_the_interior_point_is_tried_where_the_simplex_method_fails(runs, monkeypatch):
    monkeypatch.setattr(RecordedHighs, "fails", True)
    given = np.ones(1), np.array([[0.0, 2.0]]), ONE, NO_LIMITS
    assert linear_programme.solve_linear(*given).x == pytest.approx([1.0])
    assert [run.given["solver"] for run in runs] == ["simplex"] * 3 + ["ipm"]


def change_cost(rng, cost, limits, right):
    return cost + 0.3 * rng.random(len(cost)), limits, right


def change_right(rng, cost, limits, right):
    return cost, limits, right + 0.01 * rng.random(len(right))


def add_rows(rng, cost, limits, right):
    rows = rng.standard_normal((5, len(cost)))
    return cost, np.vstack([limits, rows]), np.append(right, rows.sum(axis=1))


@pytest.mark.parametrize("change", [change_cost, change_right, add_rows])
def test_a_programme_starts_from_the_last_and_ends_at_its_own_optimum(change, runs):
    """As linprog of SciPy does from nothing, in a fraction of the iterations."""
    rng = np.random.default_rng(7)
    balance, limits = rng.standard_normal((30, 80)), rng.standard_normal((60, 80))
    known, found = None, []
    given = rng.random(80), limits, limits @ np.ones(80) + rng.random(60)
    for cost, rows, right in (given, change(rng, *given)):
        equations = balance, balance @ np.ones(80)
        known = linear_programme.solve_linear(
            *(cost, np.tile([0.0, np.inf], (80, 1))),
            *((csr_matrix(left), side) for left, side in (equations, (rows, right))),
            *("simplex", known),
        )
        found.append(known)
    expected = linprog(cost, rows, right, *equations)
    assert known.x == pytest.approx(expected.x, abs=1e-7)
    assert known.equation_multipliers == pytest.approx(expected.eqlin.marginals, abs=1e-7)
    assert known.limit_multipliers == pytest.approx(expected.ineqlin.marginals, abs=1e-7)
    assert abs(known.x - found[0].x).max() > 1e-3
    assert runs[1].iterations < 0.5 * runs[0].iterations


SIDEWAYS = af.BodyForce(1.0)


def ring(**changes):
    given = {"radius": 2.95, "thickness": 0.55, "embrace": 159.0, "voussoirs": 17}
    return af.circular_arch(**(given | changes))


def test_strength_moves_the_hinge_inside_the_joint():
    """The base crushes over W / (σ w): the block tilts about the middle of that strip."""
    block = af.column(breadth=0.6, heights=[2.4], width=0.5)
    strip = block.weight / (0.5 * af.units.MPa * 0.5)
    found = af.collapse_factor(block, live=SIDEWAYS, strength=0.5 * af.units.MPa)
    assert found.factor == pytest.approx((0.6 - strip) / 2.4, rel=1e-6)  # cuts: 1e-7 of σ w h
    assert found.hinges == ((0, "extrados"),)


def test_strength_lowers_the_factor_steadily():
    factors = [
        af.collapse_factor(ring(), live=SIDEWAYS, strength=s * af.units.MPa).factor
        for s in (0.3, 1, 10, 1e6)
    ]
    assert np.all(np.diff(factors) > 0.0)
    assert factors[-1] == pytest.approx(af.collapse_factor(ring(), live=SIDEWAYS).factor, rel=1e-5)
    assert (
        af.collapse_factor(ring(), live=SIDEWAYS, strength=0.1 * af.units.MPa).outcome
        == "infeasible"
    )


@pytest.mark.slow
def test_the_strength_of_a_material_is_that_of_its_stones_and_no_default_is(monkeypatch):
    """In the functions of limit analysis alike; infinite is none."""
    monkeypatch.setattr(rating, "_places_along", lambda *_: (-0.3, 0.6))
    weak = replace(af.STONE, strength=0.5 * af.units.MPa)
    vehicle, stones, given = (
        "CS454-single",
        ring(material=weak, voussoirs=7),
        {"strength": weak.strength},
    )
    answers = [
        [
            af.collapse_factor(structure, live=SIDEWAYS, **options).factor,
            af.rate(structure, vehicle, **options).factor,
        ]
        for structure, options in (
            (stones, {}),
            (ring(voussoirs=7), given),
            (ring(voussoirs=7), {}),
            (stones, {"strength": np.inf}),
        )
    ]
    assert answers[0] == answers[1]
    assert answers[2] == answers[3]
    assert np.all(np.array(answers[0]) < 0.9 * np.array(answers[2]))
    brittle = ring(material=replace(weak, strength=0.1 * af.units.MPa))
    assert not af.stands(brittle)
    assert af.stands(brittle, strength=np.inf)
    for wrong, says in (
        (-1.0, "is not above 0: leave it out for no limit"),
        (5.0, r"strength \[Pa\], of which 5 MPa are 5e6, = 5.0 is below 50000"),
        (9e3, r"strength \[Pa\], of which 5 MPa are 5e6, = 9000.0 is below 50000"),
    ):
        with pytest.raises(af.InvalidInput, match=says):
            af.collapse_factor(stones, live=SIDEWAYS, strength=wrong)


def test_strong_joints_respect_the_stress_block():
    structure, strength = ring(), 0.5 * af.units.MPa
    joints = af.collapse_factor(structure, live=SIDEWAYS, strength=strength).joints
    most = joints["N"] * joints["depth"] / 2 - joints["N"] ** 2 / (2 * strength * structure.width)
    crushing = strength * structure.width * joints["depth"]
    assert float((abs(joints["M"]) - most).max()) < 1e-6 * float((crushing * joints["depth"]).max())


def test_further_unknowns_keep_within_their_limit():
    """A stay holds a column back with up to T at its top: λ W h/2 = W b/2 + T h."""
    block = af.column(breadth=0.6, heights=[2.4])
    _, dead = self_weight_programme(block, "coulomb", None, None)
    sideways = dead.with_load_factor(RigidBlocks(block).load([SIDEWAYS]))
    for limit in (0.0, 0.05, 0.1):
        pull = RigidBlocks(block).load([af.PointLoad(0.0, (-block.weight, 0.0))])
        column = sparse.csr_matrix(-dead.blocks.dimensionless(pull)[:, None])
        found = sideways.with_unknowns(column, np.zeros(1), limit).solve()
        assert -found.value == pytest.approx(0.25 + 2.0 * limit, rel=1e-6)
        assert found.unknowns[0] == pytest.approx(limit, abs=1e-9)


def test_stones_of_a_wall_crush_though_its_forces_are_not_unique(verified):
    """46 stones under 100 kN, pushed: 37.50466 kN at 20 MPa by 190 rounds of cuts, from above.

    From below by the state itself, which holds |M| <= N h/2 - N²/(2 σ w) in every joint.
    """
    wall, strength = granite_wall(), 20e6
    live = af.PointLoad(0.0, (1e3, 0.0), y=1.325)
    dead = [af.PointLoad(0.5, (0.0, 1e3 - 100e3), y=1.325)]
    found = af.collapse_factor(wall, live=live, dead=dead, strength=strength)
    assert found.factor == pytest.approx(37.5046599152, rel=3e-6)
    normal, moment = found.joints["N"].values, found.joints["M"].values
    largest = 0.5 * normal * wall.depths - normal**2 / (2.0 * strength * wall.width)
    assert np.all(np.abs(moment) <= largest + 1e-6 * strength * wall.width * wall.depths**2)
    assert np.all(normal >= -1e-6)
    case = "granite wall whose stones of 20 MPa crush: force [kN]"
    verified(case, 37.5046599152, "cutting planes", found.factor)


def test_an_optimum_that_stands_still_between_rounds_of_cuts_is_not_taken_for_converged():
    """Pieces of 30° on a lattice of 30°: held there, HiGHS ends in an error, not "infeasible".

    By 401 tangents to each joint's crushing limit at once, unreduced, 17.06594.
    """
    bridge = af.bridge(
        arches=[af.shapes.Arch(span=3.0, rise=1.0, thickness=0.4, voussoirs=5)],
        backfill=af.shapes.Backfill(cover=0.3),
        sidewalls=[af.shapes.Sidewall(length=1.5, height=1.0, state="fixed", name=n) for n in "ab"],
        material=replace(af.STONE, unit_weight=22e3),
        width=3.0,
    )
    fill = af.masonry.jointed_fill(bridge, 1.5, friction_angle=30.0, cohesion=20e3)
    axles = [af.PointLoad(x, (0.0, f)) for x, f in ((2.4255979314, -135e3), (3.6255979314, -90e3))]
    found = af.collapse_factor(fill, live=axles, strength=4e6)
    assert found.factor == pytest.approx(17.06594, rel=3e-6)
