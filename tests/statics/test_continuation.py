"""Loads that grow: their size, their forces, and how far they move along themselves."""

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import splu

import archfem as af
from archfem.statics import continuation, newton_iteration
from archfem.statics.continuation import GrowingLoad

ACTIONS = [af.BodyForce(0.3, -0.4), af.PointLoad(0.2, (3e3, -4e3))]


@pytest.fixture(params=["small", "large"])
def model(request):
    tower = af.column(breadth=1.0, heights=[1.0, 1.0])
    return af.build(tower, fidelity="rigid", displacements=request.param)


def test_the_size_of_a_load_is_the_sum_of_its_actions(model):
    load = GrowingLoad.of(model, ACTIONS)
    assert load.size == pytest.approx(0.5 * model.structure.weight + 5e3)
    assert GrowingLoad.of(model, ACTIONS[1:]).size == pytest.approx(5e3)
    with pytest.raises(af.InvalidInput, match="the load is zero"):
        GrowingLoad.of(model, [af.BodyForce(0.0)])


def test_a_load_moves_by_its_work_over_its_size(model):
    """Blocks shifted without turning: weights and force go as far, on whichever block."""
    load, q = GrowingLoad.of(model, ACTIONS), np.tile([0.02, -0.01, 0.0], 2)
    weight = model.structure.weight
    work = weight * (0.3 * 0.02 + 0.4 * 0.01) + 3e3 * 0.02 + 4e3 * 0.01
    assert load.displacement(q) == pytest.approx(work / load.size)
    forces = load.forces(np.zeros(model.size))
    assert forces == pytest.approx(load.first)
    assert forces[[0, 3]].sum() == pytest.approx(0.3 * weight + 3e3)
    assert forces[[1, 4]].sum() == pytest.approx(-0.4 * weight - 4e3)


def test_forces_of_a_load_are_the_slope_of_its_work(model):
    """Their rate is their slope, by central differences; there is none unless blocks turn."""
    load, q = GrowingLoad.of(model, ACTIONS), 0.1 * np.array([1.0, -2.0, 3.0, 1.0, 2.0, -2.0])
    steps = 1e-6 * np.eye(model.size)
    slope = [
        (load.displacement(q + e) - load.displacement(q - e)) * load.size / 2e-6 for e in steps
    ]
    assert load.forces(q) == pytest.approx(slope, abs=1e-3)
    rate = load.rate(q)
    bent = np.array([(load.forces(q + e) - load.forces(q - e)) / 2e-6 for e in steps])
    if rate is None:
        assert not bent.any()
    else:
        assert rate.toarray() == pytest.approx(bent, abs=1e-3)
        assert np.abs(bent).max() > 100.0


@pytest.mark.parametrize("size", [12, 450])
def test_the_sense_of_a_path_is_the_sign_of_a_determinant(size):
    """By NumPy's dense factors, whatever the units of the coordinates."""
    rng = np.random.default_rng(size)
    signs = []
    for _ in range(5):
        tangent, load, row = rng.normal(size=(size, size)), *rng.normal(size=(2, size + 1))
        tangent *= 10.0 ** rng.uniform(-8.0, 8.0, (size, 1))
        matrix = np.vstack([np.column_stack([tangent, -load[:size]]), row])
        signs.append(np.linalg.slogdet(matrix)[0])
        found = continuation._determinant_sign(sparse.csr_matrix(tangent), load[:size], row)
        assert found == signs[-1]
    assert set(signs) == {-1.0, 1.0}


def test_a_path_has_no_sense_where_two_motions_meet_no_resistance():
    """Its matrix is singular but for rounding, whose sign is a coin toss.

    Two directions bear nothing, and the border holds one of them. A spring of 1e-9 of the stiffness
    along the other gives the sign back: the determinant is its stiffness times positive numbers.
    """
    rng = np.random.default_rng(1)
    turned = np.linalg.qr(rng.normal(size=(30, 30)))[0]
    load, row = turned[:, 0], np.append(turned[:, 0], 0.0)
    for spring, sign in ((0.0, {0.0}), (1e-9, {1.0}), (-1e-9, {-1.0})):
        stiffness = np.r_[0.0, spring, np.ones(28)] * 1e11
        for scale in (1.0, 3.0, 7.0):  # which round otherwise
            tangent = sparse.csr_matrix((turned * stiffness * scale) @ turned.T)
            assert {continuation._determinant_sign(tangent, load, row)} == sign


def steps_matrix(size, seed):
    """A regular tangent with entries beside its diagonal, a load and a row (n + 1,)."""
    rng = np.random.default_rng(seed)
    near = sparse.diags(rng.uniform(-1.0, 1.0, (3, size)), (-2, 1, 7), (size, size))
    tangent = (near + sparse.diags(rng.choice([-3.0, 3.0], size))).tocsr()
    return tangent, rng.standard_normal(size), rng.standard_normal(size + 1)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("size", [9, 399, 400, 403])
def test_steps_of_state_and_factor_solve_both_equations(size, seed):
    """By dense and by sparse matrices; the determinant's sign is that of LAPACK."""
    tangent, load, row = steps_matrix(size, seed)
    right = np.random.default_rng(9).standard_normal(size + 1)
    step = continuation._solve_bordered(tangent, load, row, right)
    assert tangent @ step[:-1] - step[-1] * load == pytest.approx(right[:-1], abs=1e-8)
    assert row @ step == pytest.approx(right[-1], abs=1e-8)
    whole = np.block([[tangent.toarray(), -load[:, None]], [row]])
    assert continuation._determinant_sign(tangent, load, row) == np.linalg.slogdet(whole)[0]


@pytest.mark.parametrize("size", [8, 401])
def test_a_matrix_of_steps_that_overflow_has_no_solution(size):
    tangent, load, row = steps_matrix(size, 0)
    tangent = sparse.diags(np.append(1e-320, np.ones(size - 1))).tocsr() @ tangent
    load[0] = 0.0
    assert continuation._solve_bordered(tangent, load, row, np.ones(size + 1)) is None


@pytest.mark.parametrize("kind", ["a block without joints", "not a number", "infinite"])
def test_superlu_is_given_no_matrix_on_which_it_may_end_the_process(kind, monkeypatch):
    """Of 3 coordinates without stiffness, only one has a pivot in the column of the load.

    Of 250 such matrices SuperLU gave BLAS illegal arguments in 18, and in a natural order it ended
    the process. A regular matrix reaches it.
    """
    given = []
    monkeypatch.setattr(
        newton_iteration, "splu", lambda matrix: given.append(matrix) or splu(matrix)
    )
    tangent, load, row = steps_matrix(402, 0)
    assert continuation._solve_bordered(tangent, load, row, np.ones(403)) is not None
    assert len(given) == 1
    if kind == "a block without joints":
        tangent = sparse.block_diag([tangent[:399, :399], sparse.csr_matrix((3, 3))], "csr")
    else:
        tangent.data[7] = np.nan if kind == "not a number" else np.inf
    assert continuation._solve_bordered(tangent, load, row, np.ones(403)) is None
    assert continuation._determinant_sign(tangent, load, row) == 0.0
    assert newton_iteration.ScipyNewton()._step(None, tangent, None, load, "basic")[1] != ""
    assert len(given) == 1


@pytest.mark.parametrize("size", [8, 401])
def test_a_singular_matrix_of_steps_has_no_solution_and_no_sign(size):
    tangent, load, row = steps_matrix(size, 0)
    tangent = sparse.diags(np.append(0.0, np.ones(size - 1))).tocsr() @ tangent
    load[0] = 0.0
    assert continuation._solve_bordered(tangent, load, row, np.ones(size + 1)) is None
    assert continuation._determinant_sign(tangent, load, row) == 0.0


def test_lengths_of_steps_are_mass_weighted_means_in_units_of_the_first(model):
    """Shifted by the first displacement, or loaded by the first factor, a step is one long."""
    dead = af.dead_load(model)
    path = continuation.LoadPath.of(model, ACTIONS, dead)
    assert path.unit[0] == pytest.approx(1e-6 * model.structure.size)
    stiff = path.load.first @ np.linalg.solve(model.tangent(dead.q).toarray(), path.load.first)
    assert path.unit[1] == pytest.approx(path.unit[0] * path.load.size / stiff, rel=1e-9)
    shift = np.tile([0.6, 0.8, 0.0], 2) * path.unit[0]
    path.states += [dead.q + shift, dead.q + 3.0 * shift, dead.q + 3.0 * shift]
    path.factors += [0.0, 0.0, 5.0 * path.unit[1]]
    for number, length in ((1, 5.0), (2, 2.0), (3, 1.0)):
        step, weighted = path._last_steps(number)
        assert np.sqrt(step @ weighted) == pytest.approx(length, rel=1e-9)
    step, _ = path._last_steps(2)
    assert step == pytest.approx([*(2.0 * shift), 0.0], abs=1e-12 * path.unit[0])
