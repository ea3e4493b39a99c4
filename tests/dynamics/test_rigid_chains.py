"""Chains and trees of rigid stones: their solver beside the general one, and where it applies."""

import numpy as np
import pytest

import archfem as af
from archfem._numba import kernel
from archfem.dynamics.schemes import Conserving
from archfem.dynamics.solvers import newton
from archfem.dynamics.solvers.equation import Equation
from archfem.dynamics.solvers.rigid_chains import (
    _couple_joints,
    _evaluate_joints,
    _move_stones,
    _start_joints,
    chain_system,
)
from archfem.dynamics.solvers.stone_tree import find_stone_tree

DAMPING = af.StiffnessDamping(0.05, 8.0)


def ring(**changes):
    settings = {"radius": 2.95, "thickness": 0.45, "embrace": 159.0, "voussoirs": 7}
    return af.circular_arch(**{**settings, **changes})


def equation_of(structure, fidelity="rigid", displacements="large", damping=DAMPING, **options):
    model = af.build(structure, fidelity=fidelity, displacements=displacements, **options)
    return Equation(model, af.Motion.synthetic(duration=1.0), damping, Conserving())


def closed_loop():
    """Two stones side by side, and one on both of them."""

    def stone(name, left, low, right, **options):
        outline = ((left, low), (right, low), (right, low + 1.0), (left, low + 1.0))
        return af.Block(outline, af.STONE, name, part="wall", role="pier", **options)

    floor = stone("floor", -1.0, -1.0, 3.0, fixed=True)
    blocks = floor, stone("a", 0.0, 0.0, 1.0), stone("b", 1.0, 0.0, 2.0), stone("c", 0.5, 1.0, 1.5)
    lines = {
        (0, 1): ((0.0, 0.0), (1.0, 0.0)),
        (0, 2): ((1.0, 0.0), (2.0, 0.0)),
        (1, 2): ((1.0, 0.0), (1.0, 1.0)),
        (1, 3): ((0.5, 1.0), (1.0, 1.0)),
        (2, 3): ((1.0, 1.0), (1.5, 1.0)),
    }
    joints = [
        af.Joint(pair, *ends, af.masonry.STONE_TO_STONE, f"joint {k}", "wall", "pier")
        for k, (pair, ends) in enumerate(lines.items())
    ]
    return af.Structure(blocks, tuple(joints))


@pytest.mark.parametrize(
    "damping", [pytest.param(DAMPING, marks=pytest.mark.slow), af.Rayleigh(0.05, (8.0, 16.0))]
)
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
    # by matrices that are as good: 1518 and 1606, or 1573 and 1625
    chained, other = (int(run.dataset["iterations"].sum()) for run in runs)
    assert chained < 1.02 * other
    drifts = [abs(run.dataset.attrs["energy_drift"]) for run in runs]
    assert max(drifts) < 1e-7
    energies = [run.dataset["energy_drift"].values for run in runs]
    assert np.abs(energies[0] - energies[1]).max() < 1e-6 * np.abs(general["N"]).max()


def test_supports_that_have_moved_and_turned_stay_there(monkeypatch):
    """The frame of a joint turns with both of its stones, a fixed one too."""
    structure, motion = ring(), af.Motion.synthetic(duration=0.3, pga=5.0, seed=3)
    supports = np.zeros((len(structure.blocks), 3))
    supports[0], supports[-1] = (-0.002, 0.001, 0.02), (0.003, -0.001, -0.005)
    runs = []
    for find in (find_stone_tree, lambda equation: None):
        monkeypatch.setattr(newton, "find_stone_tree", find)
        model = af.build(structure, fidelity="rigid", displacements="large")
        model = model.with_support_motion(supports)
        runs.append(af.time_history(model, motion, dt=0.002, damping=DAMPING))
    for name in ("slip", "rotation", "N"):
        chain, general = (run.joints[name] for run in runs)
        size = float(np.abs(general).max())
        assert float(np.abs(chain - general).max()) < 1e-7 * size, name


@kernel
def evaluate_step(system, before, after):
    _move_stones(system.stones, before, before, True)
    _start_joints(system, 0)
    _move_stones(system.stones, before, after, False)
    _evaluate_joints(system, 0)
    _couple_joints(system, 0)


def test_coupling_of_stones_is_the_derivative_of_their_forces(each_way):
    """Central differences at 0.05 rad; joints that open are integrated by Gauss's rule."""
    structure = ring(contact=af.Contact(1e6, 4e5, None))
    equation = equation_of(structure)
    tree, rng = find_stone_tree(equation), np.random.default_rng(4)
    system = chain_system(equation, tree, 0.002)
    before, after = 0.05 * rng.standard_normal((2, len(system.mass) + 3))
    before[-3:] = after[-3:] = 0.0
    evaluate = each_way(evaluate_step)

    def forces(place, change):
        moved = after.copy()
        moved[place] += change
        evaluate(system, before, moved)
        return system.forces[:6].copy()

    forces(0, 0.0)
    coupling = system.coupling.reshape(2, 2, 3, 3, -1).copy()
    scale = np.abs(coupling).max()
    for joint in range(len(structure.joints)):
        for side, stone in enumerate(system.stone[:, joint]):
            for k in range(3 if stone < len(tree.parent) else 0):
                pair = [forces(3 * stone + k, sign * 1e-6)[:, joint] for sign in (1.0, -1.0)]
                expected = (pair[0] - pair[1]) / 2e-6
                found = coupling[:, side, :, k, joint].ravel()
                assert found == pytest.approx(expected, abs=1e-4 * scale), (joint, side, k)


@pytest.mark.slow
def test_tree_of_rings_on_a_pier_is_eliminated_from_its_leaves():
    piers = {"heights": (0.8, 1.2, 0.8), "breadths": (0.8, 0.6, 0.8)}
    structure = af.shapes.arcade(
        spans=(2.0, 2.0), thicknesses=0.3, voussoirs=5, embraces=150.0, **piers
    )
    tree = find_stone_tree(equation_of(structure))
    count = len(tree.parent)
    assert sorted(tree.order.tolist()) == list(range(3 * count))
    assert all(stone < parent <= count for stone, parent in enumerate(tree.parent))
    # one stone is eliminated last, and the middle pier carries two rings
    assert int(np.sum(tree.parent == count)) == 1
    links = np.bincount(tree.parent, minlength=count + 1)[:count] + (tree.parent < count)
    assert links.max() == 3
    motion = af.Motion.synthetic(duration=0.3, pga=3.0, seed=3)
    settings = {"fidelity": "rigid", "displacements": "large", "damping": DAMPING, "dt": 0.005}
    run = af.Analysis(structure, **settings).run(motion)
    general = af.Analysis(structure, **settings, method="snes").run(motion)
    scale = float(np.abs(general.joints["rotation"]).max())
    assert scale > 1e-5
    assert float(np.abs(run.joints["rotation"] - general.joints["rotation"]).max()) < 1e-6 * scale


def test_other_structures_are_left_to_the_general_solver():
    column = af.column(breadth=0.4, heights=[0.8, 0.8], width=1.0)
    assert find_stone_tree(equation_of(column)) is not None
    assert find_stone_tree(equation_of(column, displacements="small")) is None
    assert find_stone_tree(equation_of(column, fidelity="faces")) is None
    initial = af.StiffnessDamping(0.05, 8.0, joints="initial")
    assert find_stone_tree(equation_of(column, damping=initial)) is None
    assert find_stone_tree(equation_of(closed_loop())) is None
