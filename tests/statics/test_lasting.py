"""Equilibria that what joints remember of them upsets: how often they are sought, and given up."""

from types import SimpleNamespace

import numpy as np
import pytest

import archfem as af
from archfem.statics import lasting
from archfem.statics.newton import Solved

UPSET = SimpleNamespace(points=SimpleNamespace(plain=False), bonds=None)
"""Joints that dilate."""


class Toothed:
    """A model whose joints slide on by so much at each equilibrium."""

    force = tangent = None

    def __init__(self, further, memory=0.0, operator=UPSET):
        self.further, self.memory, self.operator = further, np.array([memory, 0.0]), operator

    def remembered(self, q):
        return float(self.memory[0]) + self.further

    def remembering(self, memory):
        return Toothed(self.further, memory, self.operator)


@pytest.fixture
def found(monkeypatch):
    """Numbers of iterations by which equilibria are found, one after the other."""
    made = []

    def balanced(solver, model, load, start, searches):
        return Solved(start + 1.0, made.pop(0), 0.25)

    monkeypatch.setattr(lasting, "_balanced", balanced)
    return made


def test_an_equilibrium_is_sought_until_it_is_in_balance_as_it_was_left(found):
    found += [3, 2, 0, 7]
    model, solved = lasting.lasting(None, Toothed(-0.1), np.zeros(2), np.zeros(2))
    assert (solved.iterations, solved.residual) == (5, 0.25)
    assert solved.q.tolist() == [3.0, 3.0]
    assert model.memory[0] == pytest.approx(-0.2)
    assert found == [7]


def test_the_first_may_be_in_balance_by_chance(found):
    """What its joints then remember is looked at all the same."""
    found += [0, 0]
    _, solved = lasting.lasting(None, Toothed(0.0), np.zeros(2), np.zeros(2))
    assert solved.q.tolist() == [2.0, 2.0]


def test_joints_that_only_slide_are_in_balance_at_once(found):
    found += [4]
    plain = SimpleNamespace(points=SimpleNamespace(plain=True))
    model, solved = lasting.lasting(None, Toothed(0.5, 0.0, plain), np.zeros(2), np.zeros(2))
    assert (solved.iterations, model.memory[0]) == (4, 0.5)


def test_joints_that_never_stop_are_given_up(found, monkeypatch):
    monkeypatch.setattr(lasting, "ROUNDS", 3)
    found += [1] * 3
    with pytest.raises(
        af.DidNotConverge, match=r"in 3 rounds under the same load, by 0\.3 m in the"
    ):
        lasting.lasting(None, Toothed(-0.3), np.zeros(2), np.zeros(2))


@pytest.mark.parametrize(
    ("felt", "iterations", "stays"), [(0.1, 0, False), (-0.1, 0, True), (-0.1, 1, False)]
)
def test_a_bond_that_is_torn_does_not_last(felt, iterations, stays):
    bonds = SimpleNamespace(torn=lambda gaps: gaps > 0.0)
    joints = SimpleNamespace(bonds=bonds, felt=lambda q: np.array([-1.0, felt]))
    assert lasting.lasts(SimpleNamespace(operator=joints), np.zeros(2), iterations) is stays
