"""Chains and trees of rigid stones: the block solver beside the general one, and where it applies."""

import numpy as np
import pytest

import archfem as af
from archfem.dynamics.schemes import Conserving
from archfem.dynamics.solvers import newton
from archfem.dynamics.solvers.equation import Equation
from archfem.dynamics.solvers.rigid_chains import find_stone_tree

DAMPING = af.StiffnessDamping(0.05, 8.0)


def ring(**changes):
    settings = {"radius": 2.95, "thickness": 0.45, "embrace": 159.0, "voussoirs": 7}
    return af.circular_arch(**{**settings, **changes})


def equation_of(structure, fidelity="rigid", displacements="large", damping=DAMPING, **options):
    model = af.build(structure, fidelity=fidelity, displacements=displacements, **options)
    return Equation(model, af.Motion.synthetic(duration=0.1), damping, Conserving())


@pytest.mark.parametrize("damping", [DAMPING, af.Rayleigh(0.05, (8.0, 16.0))])
def test_history_equals_that_of_the_general_solver(monkeypatch, damping):
    motion = af.Motion.synthetic(duration=1.0, pga=7.0, seed=3)
    runs = []
    for find in (find_stone_tree, lambda equation: None):
        monkeypatch.setattr(newton, "find_stone_tree", find)
        model = af.build(ring(), fidelity="rigid", displacements="large")
        runs.append(af.time_history(model, motion, dt=0.002, damping=damping))
    chain, general = (run.joints for run in runs)
    slip, turn = np.abs(general["slip"]).max(), np.abs(general["rotation"]).max()
    assert slip > 1e-4
    assert turn > 1e-3
    # both solve each step to 1e-9 of the weight: joints that open and slide amplify that
    for name, size in (("slip", slip), ("rotation", turn), ("N", general["N"].max())):
        assert float(np.abs(chain[name] - general[name]).max()) < 1e-7 * float(size)
    drifts = [abs(run.dataset.attrs["energy_drift"]) for run in runs]
    assert max(drifts) < 1e-7
    energies = [run.dataset["energy_drift"].values for run in runs]
    assert np.abs(energies[0] - energies[1]).max() < 1e-6 * np.abs(general["N"]).max()


def test_tree_of_rings_on_a_pier_is_eliminated_from_its_leaves():
    tree = find_stone_tree(equation_of(ring()))
    assert sorted(tree.order.tolist()) == list(range(21))
    count = len(tree.parent)
    assert all(stone < parent <= count for stone, parent in enumerate(tree.parent))
    # one chain has one last stone
    assert int(np.sum(tree.parent == count)) == 1


def test_other_structures_are_left_to_the_general_solver():
    column = af.column(breadth=0.4, heights=[0.8, 0.8], width=1.0)
    assert find_stone_tree(equation_of(column)) is not None
    assert find_stone_tree(equation_of(column, displacements="small")) is None
    assert find_stone_tree(equation_of(column, fidelity="faces")) is None
    initial = af.StiffnessDamping(0.05, 8.0, joints="initial")
    assert find_stone_tree(equation_of(column, damping=initial)) is None
    wall = af.shapes.wall(length=1.2, height=0.6, block_length=0.4, block_height=0.2)
    assert find_stone_tree(equation_of(wall)) is None
