"""Steps between stiff joints: an arch of 17 stones under a pulse, beside rigid blocks in contact.

The arch is that of Lemos (2007): centre line 4.0 m, thickness 0.5 m, friction tan 35°, half sine of
0.25 s, stiffness damping of 5 % at 11 Hz.
"""

from functools import cache

import numpy as np
import pytest

import archfem as af
from archfem.dynamics import HHT, Equation, LooseBlocks, Newmark, RigidBlockSimulation, SnesSolver

DAMPING = af.StiffnessDamping(0.05, 11.0)
CROWN, FRICTION = 9, np.tan(np.radians(35.0))


def arch(stiffness, friction=FRICTION):
    return af.circular_arch(
        radius=4.0,
        thickness=0.5,
        embrace=180.0,
        voussoirs=17,
        contact=af.Contact(stiffness, stiffness, friction),
        material=af.Material(30e9, 0.2, 27e3),
        gravity=10.0,
    )


def pulse(peak, end):
    times = np.arange(0.0, end + 5e-4, 1e-3)
    return af.Motion(np.where(times <= 0.25, 10.0 * peak * np.sin(np.pi * times / 0.25), 0.0), 1e-3)


@cache
def shaken(stiffness, peak, end, dt=1e-3):
    model = af.build(arch(stiffness), fidelity="rigid", displacements="large")
    record = af.Record(fields_every=1)
    return af.time_history(model, pulse(peak, end), dt=dt, damping=DAMPING, record=record)


def swing(history):
    """Largest displacement of the crown's centroid along x [m]."""
    return np.abs(history.dataset["q"][:, 3 * (CROWN - 1)]).max().item()


@cache
def rigid_swing(peak, end, dt=5e-4):
    structure = arch(1e10)
    start = LooseBlocks.as_built(structure)
    frames = RigidBlockSimulation(structure, dt=dt).frames(
        start, end, pulse(peak, end), spacing=1e-3
    )
    return max(abs(frame.poses[CROWN, 0]) for frame in frames)


def test_a_slip_that_changes_its_sign_stops_no_step():
    """Steps took up to 88 iterations, and ended at 1.85 s in DidNotConverge however short."""
    history = shaken(1e10, 0.05, 2.0)
    assert history.dataset["iterations"].max() <= 10
    assert history.dataset["smallest_step"][1:].min() > 0.99e-3


def test_stiff_joints_tend_to_rigid_blocks(verified):
    """Within 4 %: two stiffnesses, extrapolated by k^(-1/2), the depth of what a hinge crushes."""
    soft, stiff = (swing(shaken(stiffness, 0.15, 0.6)) for stiffness in (1e12, 1e13))
    tends = stiff - (soft - stiff) / (np.sqrt(10.0) - 1.0)
    rigid = rigid_swing(0.15, 0.6)
    assert soft > 1.4 * rigid
    verified("arch under a pulse: first swing of the crown [m]", rigid, "rigid blocks", tends)
    assert tends == pytest.approx(rigid, rel=0.04)


@pytest.mark.slow
@pytest.mark.parametrize("dt", [1e-3, 5e-3, None])
@pytest.mark.parametrize("stiffness", [1e10, 1e11, 1e12, 1e13])
def test_an_arch_of_any_stiffness_ends_its_run(stiffness, dt):
    """It falls where joints are soft, and stands from 1 TPa/m on, as rigid blocks do."""
    for peak in (0.0869, 0.15):
        history = shaken(stiffness, peak, 2.0, dt)
        standing = stiffness >= (1e11 if peak < 0.1 else 1e12)
        assert (history.verdict.outcome == "stands") is standing
        # relative to the energy exchanged
        assert abs(history.dataset.attrs["energy_drift"]) < 1e-7


@pytest.mark.parametrize(
    ("displacements", "friction", "scheme", "proposed"),
    [
        ("large", None, None, False),
        ("small", 0.6, None, False),
        ("small", None, HHT(), False),
        ("small", None, Newmark(), True),
    ],
)
def test_damping_by_the_scheme_is_proposed_where_it_applies(
    displacements, friction, scheme, proposed
):
    model = af.build(arch(1e10, friction), fidelity="rigid", displacements=displacements)
    given = {} if scheme is None else {"scheme": scheme}
    solver = SnesSolver(Equation(model, pulse(0.1, 0.3), DAMPING, **given))
    assert ("HHT" in solver._remedy()) is proposed


@pytest.mark.parametrize(("stiffness", "rigid"), [(1e14, False), (1e15, True)])
def test_rigid_blocks_are_proposed_where_positions_are_too_coarse(stiffness, rigid):
    """At 1 PPa/m a joint of 0.5 m² has 1 N for the spacing of numbers at 9 m, and bears 100 kN."""
    model = af.build(arch(stiffness), fidelity="rigid", displacements="large")
    remedy = SnesSolver(Equation(model, pulse(0.1, 0.3), DAMPING))._remedy()
    assert ("RigidBlockSimulation" in remedy) is rigid
    assert ("smaller dt" in remedy) is not rigid
