"""Newton's method: its solutions, and systems that it passes to PETSc."""

import numpy as np
import pytest
from glued import glued
from scipy import sparse

import archfem as af
from archfem.statics import Newton
from archfem.statics.newton import EquilibriumSolver


def test_a_kink_is_solved_exactly():
    """k <x>_- = -1 from an open start: one step back to closed, one onto the answer."""
    matrices = {closed: sparse.csr_matrix([[2.0 if closed else 1e-3]]) for closed in (True, False)}
    solver = EquilibriumSolver(1)
    solved = solver.solve(
        lambda x: np.where(x < 0.0, 2.0, 1e-3) * x + 1.0,
        lambda x: matrices[bool(x[0] < 0.0)],
        np.array([5.0]),
        1.0,
    )
    assert solved.q[0] == pytest.approx(-0.5, rel=1e-12)
    assert solved.residual <= 1e-10


def test_petsc_options_are_passed_on_and_removed(ring):
    from petsc4py import PETSc

    before = dict(PETSc.Options().getAll())
    model = af.build(ring, fidelity="rigid")
    default = af.dead_load(model)
    other = af.dead_load(model, Newton(petsc={"pc_type": "svd"}))
    assert other.q == pytest.approx(default.q, rel=1e-9, abs=1e-15)
    assert dict(PETSc.Options().getAll()) == before


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"snes_typ": "newtontr"}, "'snes_typ' is not known, did you mean 'snes_type'"),
        ({"pc_type": "lu", "-ksp_monitor": ""}, "'-ksp_monitor' is not known, did you mean 'ksp_"),
        ({"unlike": 1}, "'unlike' is not known, and no name is like it"),
        ({"mat_mumps_icntl_14": 30}, "'mat_mumps_icntl_14' is of a solver that is not selected"),
        ({"snes_rtol": 1e-3}, r"\['snes_rtol'\] has no effect.*Newton\(tolerance=1e-10\)"),
        ({"snes_max_it": [1]}, "give a table of words and words or a number"),
    ],
)
def test_options_without_effect_are_refused(ring, options, words):
    with pytest.raises(af.InvalidInput, match=words):
        af.dead_load(af.build(ring, fidelity="rigid"), Newton(petsc=options))


@pytest.mark.parametrize("option", ["snes_monitor", "snes_view", "snes_converged_reason"])
def test_what_petsc_reads_in_every_solve_is_accepted(ring, option, tmp_path):
    """Some options are read by none but the solve, others by none but one line search."""
    printed = tmp_path / "log.txt"
    options = {option: f"ascii:{printed}::append", "snes_linesearch_alpha": 1e-3}
    newton, model = Newton(petsc=options), af.build(ring, fidelity="rigid")
    lengths = []
    for _ in range(2):
        af.dead_load(model, newton)
        lengths.append(len(printed.read_text()))
    assert lengths[1] == pytest.approx(2 * lengths[0], rel=0.05)  # names have a counter
    solver, entered = EquilibriumSolver(1, newton), len(printed.read_text())
    for load in (1.0, 2.0, 3.0):
        given = lambda x, f=load: x - f, lambda x: sparse.csr_matrix([[1.0]])
        assert solver.solve(*given, np.zeros(1), load).q[0] == pytest.approx(load)
    text = printed.read_text()[entered:]
    words = {"snes_monitor": "0 SNES Function", "snes_view": "SNES Object"}
    assert text.count(words.get(option, "Nonlinear")) == 3


@pytest.mark.parametrize("options", [{"pc_type": "cholesky"}, {"ksp_type": "cg", "pc_type": "icc"}])
def test_methods_for_symmetric_tangents_are_refused_where_joints_slide(ring, options):
    """They would take half of the matrix for all of it. Glued joints leave it symmetric."""
    with pytest.raises(af.InvalidInput, match="for symmetric matrices, and where joints slide"):
        af.dead_load(af.build(ring, fidelity="rigid"), Newton(petsc=options))
    model = af.build(glued(ring), fidelity="rigid")
    found = af.dead_load(model, Newton(petsc=options))
    assert found.q == pytest.approx(af.dead_load(model).q, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("error", [af.InvalidInput("no such joint"), KeyboardInterrupt()])
def test_an_error_within_a_solve_is_not_swallowed(error):
    def residual(q):
        if q[0] != 0.0:
            raise error
        return q + 1.0

    with pytest.raises(type(error)):
        EquilibriumSolver(1).solve(residual, lambda q: sparse.csr_matrix([[1.0]]), np.zeros(1), 1.0)


def test_rounding_is_that_of_the_stiffest_coordinate():
    """A soft spring that moves a kilometre, beside one that is stiff and barely moves.

    With 1e12 N/m rounding, 8 eps K q, is 1.8 N under a load of 1 N; with less it is nothing.
    """
    load = np.array([1.0, 1e-3])
    for stiff, found in ((1e-3, True), (1e3, True), (1e12, False)):
        matrix = sparse.diags([1e-3, stiff]).tocsr()
        solver, given = (
            EquilibriumSolver(2),
            (lambda q, m=matrix: m @ q - load, lambda q, m=matrix: m),
        )
        if found:
            solved = solver.solve(*given, np.zeros(2), 1.0)
            assert solved.q == pytest.approx([1e3, 1e-3 / stiff])
        else:
            with pytest.raises(af.DidNotConverge, match=r"rounding holds it|iterations"):
                solver.solve(*given, np.zeros(2), 1.0)


@pytest.mark.parametrize(
    ("stiffness", "out_of_balance", "scale", "refused"),
    [
        (1.0, 0.98e-10, 1.0, ""),
        (1.0, 1.02e-10, 1.0, "too many"),
        (1e7, 1.77e-8, 1.0, ""),
        (1e7, 1.79e-8, 1.0, "too many"),
        (1e9, 0.98e-7, 1.0, ""),
        (1e9, 1.02e-7, 1.0, "too many"),
        (5.5e14, 0.98e-7, 1e3, ""),
        (5.8e14, 0.98e-7, 1e3, "nothing but rounding holds it, displaced by 1.0e"),
    ],
)
def test_what_is_out_of_balance_is_accepted_up_to_rounding(
    stiffness, out_of_balance, scale, refused
):
    """A coordinate at 1 m, where rounding is 8 eps K: 17.8 nN for 1e7 N/m, a newton for 5.6e14.

    1e-10 of the load is always accepted, 1e-7 never; rounding of 1e-3 of the load holds nothing.
    """
    solver = EquilibriumSolver(1, prefer_scipy=True)
    tangent = sparse.csr_matrix([[stiffness]])
    force = np.array([out_of_balance])
    given = (lambda q: force, lambda q: tangent, np.ones(1), scale, ["basic"])
    if refused:
        with pytest.raises(af.DidNotConverge, match=f"after 12 iterations: {refused}"):
            solver.solve(*given)
    else:
        solved = solver.solve(*given)
        assert (solved.iterations, solved.residual) == (0, out_of_balance)
