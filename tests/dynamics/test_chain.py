"""Joints that slide, solved in the band of a chain of blocks or with the sparse tangent of all."""

from dataclasses import replace

import numpy as np
import pytest

import archfem as af
from archfem.dynamics.stepping.choice import chosen
from archfem.dynamics.stepping.exact import Exact
from archfem.dynamics.stepping.modal import Modal
from archfem.dynamics.stepping.stepper import Stepper
from archfem.dynamics.stepping.tangent import Tangent

DT = 0.005

MOTION = af.Motion.synthetic(duration=5.0, pga=6.0, seed=1)


def sliding_ring(fidelity="rigid", friction=0.3, damping=None):
    """Equation of motion of a ring whose joints slide, and its rest."""
    bare = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=9)
    joints = [replace(j, contact=replace(j.contact, friction=friction)) for j in bare.joints]
    model = af.build(replace(bare, joints=tuple(joints)), fidelity=fidelity, cells=(2, 2))
    equation, dead = af.dynamics.Equation(model, MOTION, damping), af.dead_load(model)
    return equation, equation.at_rest(dead.q, memory=dead.model.memory)


@pytest.mark.parametrize("fidelity", ["rigid", "faces"])
@pytest.mark.parametrize("joints", ["closed", "initial"])
def test_band_of_a_chain_is_the_compliance_of_all(fidelity, joints):
    """(1 + F₀ K) F = F₀, F from the modes of the closed structure, to what its solution rounds."""
    equation, _ = sliding_ring(fidelity, damping=af.Rayleigh(0.05, (8.0, 16.0), joints=joints))
    strategy = Modal.of(equation)
    system = strategy.system(DT)
    chain = system.linear.law.chain
    assert chain.half == 5  # three rows a joint, coupled to those of two neighbours
    f = system.compliance.whole[np.ix_(chain.order, chain.order)]
    loose, closed = (unbanded(each, chain.half) for each in (chain.loose, chain.closed))
    assert np.abs(closed @ f - loose).max() < 1e-8 * np.abs(loose).max()


def unbanded(band, half):
    """A matrix from its band."""
    full = np.zeros((len(band), len(band) + 2 * half))
    for row, values in enumerate(band):
        full[row, row : row + 2 * half + 1] = values
    return full[:, half:-half]


@pytest.mark.parametrize("damping", [None, af.StiffnessDamping(0.05, 8.0)])
def test_tangent_of_all_gives_the_history_of_snes(damping):
    """And again the same bits."""
    equation, start = sliding_ring(damping=damping)
    fast = [list(Stepper(equation, Tangent(equation)).batches(start, DT, 0.5)) for _ in range(2)]
    assert not any(batch.fallback for batch in fast[0])
    found, again = (np.concatenate([b.resultants for b in batches]) for batches in fast)
    assert np.array_equal(found, again)
    expected = [batch.resultants for batch in Exact(equation).batches(start, DT, 0.5)]
    assert np.abs(found - np.concatenate(expected)).max() < 1e-7 * np.abs(found).max()
    assert np.abs(fast[0][-1].state(len(fast[0][-1].times) - 1).memory).max() > 1e-4


def test_tangent_is_for_what_is_no_chain():
    equation, start = sliding_ring()
    assert Tangent.of(equation) is None
    assert chosen(equation, replace(start, time=4.0), DT).name == "compliance"
