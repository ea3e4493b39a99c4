"""Hard in time: long rocking, chatter on stiff joints, steps large and small, no damping."""

from dataclasses import replace
from functools import cache

import numpy as np
from glued import glued
from scipy.integrate import solve_ivp

import archfem as af
from archfem.dynamics import Equation
from hard.setting import DT, Found, answer, case, joints, peaks, quake, refused, ring, shaken, still


def _tilted(model, share=0.1):
    """A block 0.6 × 2.4 m turned clockwise about its corner by a share of its slenderness."""
    theta = share * np.arctan(0.25)
    equation = Equation(model, still(1.0))
    return equation.at_rest(np.array([1.2 * theta, 0.3 * theta, -theta]))


@cache
def _upright():
    """When that block first stands upright [s]: three equations of motion on a bed of springs."""
    block = af.column(breadth=0.6, heights=[2.4])
    contact, material = block.joints[0].contact, block.blocks[1].material
    mass = material.unit_weight * 0.6 * 2.4 / block.gravity
    inertia = mass * (0.6**2 + 2.4**2) / 12.0
    normal, along = contact.normal_stiffness, contact.shear_stiffness

    def rates(_, state):
        u, v, turn = state[:3]
        ends = v + turn * np.array([-0.3, 0.3])  # openings, linear between; closed where below 0
        low, high = -0.3, 0.3
        if ends.min() < 0.0 < ends.max():
            zero = -v / turn
            low, high = (zero, high) if ends[1] < 0.0 else (low, zero)
        area, first, second = ((high**k - low**k) / k for k in (1, 2, 3))
        closed = ends.min() < 0.0
        force = -normal * (v * area + turn * first) * closed
        moment = -normal * (v * first + turn * second) * closed
        shear = -along * 0.6 * (u + 1.2 * turn)
        pull = [shear / mass, force / mass - block.gravity, (moment + 1.2 * shear) / inertia]
        return [*state[3:], *pull]

    def upright(_, state):
        return state[2]

    upright.terminal = True
    theta = 0.1 * np.arctan(0.25)
    start = [1.2 * theta, 0.3 * theta, -theta, 0.0, 0.0, 0.0]
    done = solve_ivp(rates, (0.0, 1.0), start, "Radau", events=upright, rtol=1e-7, atol=1e-10)
    return float(done.t_events[0][0])


def rocking(scheme, dt):
    """It stands upright when it should, to a tenth of a step; then come 20 s of impacts.

    Energy over these is kept, or its loss is warned of, or the run is refused.
    """
    block = glued(af.column(breadth=0.6, heights=[2.4]))
    model = af.build(block, fidelity="rigid", cells=(16, 1))
    often = max(1, round(1e-3 / dt))
    given = {"dt": dt, "start": _tilted(model), "damping": None, "scheme": scheme}
    given["record"] = af.Record(every=often, fields_every=often)
    try:
        run, words = shaken(model, still(20.0), **given), ""
    except af.DidNotConverge as error:
        run, words = error.history, f"DidNotConverge: {str(error).split(', so')[0]}"
    turns, times = run.dataset["q"].values[:, 2], run.dataset["frame_time"].values
    upright = np.interp(0.0, turns[: np.argmax(turns > 0.0) + 1], times[: np.argmax(turns > 0) + 1])
    late = abs(upright - _upright())
    drift = abs(run.dataset.attrs["energy_drift"])
    verb = "keeps" if drift < 0.05 else "does not keep"
    said = f"{words or f'{verb} its energy over 20 s'}; upright at {upright:.4f} s"
    return Found(said, bool(late < 0.1 * max(dt, 1e-3)), late, run)


for _dt in (0.005, 0.001, 0.0002):
    for _scheme, _name in (
        (af.dynamics.Newmark(), "average acceleration"),
        (af.HHT(-0.05), "HHT(-0.05)"),
        (af.HHT(-0.1), "HHT(-0.1)"),
    ):
        case(
            f"rocking block, {_name}, {1e3 * _dt:g} ms",
            "20 s of impacts, undamped",
            quick=_dt == 0.001,
            scheme=_scheme,
            dt=_dt,
        )(rocking)


def chatter(alpha, dt):
    """A block of 1 m dropped by 10 mm on a stiff joint, with 1 % damping: at rest, or refused."""
    block = glued(af.column(breadth=1.0, heights=[1.0], contact=joints(1e3)))
    model = af.build(block, fidelity="rigid")
    damping = af.Rayleigh(0.01, (8.0, 16.0))
    held = Equation(model, still(1.0), damping)
    start = held.at_rest(np.array([0.0, 0.01, 0.0]))
    scheme = af.HHT(alpha) if alpha else af.dynamics.Newmark()
    given = {"dt": dt, "start": start, "damping": damping, "scheme": scheme}
    try:
        run = shaken(model, still(2.0), **given)
    except af.DidNotConverge as error:
        names_energy = "of the energy had" in str(error)
        return Found(
            f"DidNotConverge: {str(error).split(', so')[0]}", names_energy, run=error.history
        )
    force = run.joints["N"].values[:, 0] / abs(float(held.weight[1]))
    late = np.abs(force[len(force) // 2 :] - 1.0).max()
    words = "at rest after 1 s" if late < 1e-3 else f"hops, N to {late:.0f} × the weight after 1 s"
    return Found(f"{words}; impact {force.max():.0f} × the weight", late < 1e-3, float(late), run)


for _dt in (0.005, 0.001, 0.0002):
    for _alpha in (0.0, -0.05, -0.1, -0.3):
        case(
            f"chatter, {1e3 * _dt:g} ms, α = {_alpha:g}",
            "impacts on a joint 1000 × stiffer",
            quick=_dt == 0.001 and _alpha in (0.0, -0.1),
            alpha=_alpha,
            dt=_dt,
        )(chatter)


def steps(dt, tolerance):
    """Against a hundredth of the step, or 0.05 ms."""
    model = af.build(ring(), fidelity="rigid")
    motion = quake(1.0, duration=3.0)
    record = af.Record(every=max(1, round(DT / dt)))
    run = shaken(model, motion, dt=dt, record=record)
    least = max(5e-5, dt / 100.0)
    fine = shaken(model, motion, dt=least, record=af.Record(every=round(DT / least)))
    every = slice(None, None, max(1, round(dt / DT)))
    close = af.History(fine.dataset.isel(time=every))
    return answer(run, float(np.abs(peaks(run) - peaks(close)).max()), tolerance)


for _dt, _tolerance in ((0.02, 0.1), (0.01, 0.05), (0.005, 0.01), (0.001, 2e-3), (1e-4, 1e-4)):
    case(
        f"time step {1e3 * _dt:g} ms",
        "sampled too coarsely" if _dt > DT else "many steps",
        quick=_dt == 0.02,
        dt=_dt,
        tolerance=_tolerance,
    )(steps)


@case("undamped, average acceleration, full", "energy from nowhere", fidelity="full")
@case("undamped, average acceleration", "energy from nowhere", fidelity="rigid", quick=True)
def undamped(fidelity):
    """The trapezoidal rule feeds the highest modes at impacts: the guard must end it."""
    model = af.build(glued(ring()), fidelity=fidelity)
    scheme = af.dynamics.Newmark()
    return refused(
        lambda: shaken(model, quake(2.0), damping=None, scheme=scheme),
        af.DidNotConverge,
        "been gained without work",
    )


@case("undamped, HHT(-0.1)", "losses at impact are the scheme's", quick=True)
def undamped_hht():
    """Sound, but the drift is reported: the loss in impacts depends on the scheme."""
    model = af.build(glued(ring()), fidelity="rigid")
    run = shaken(model, quake(2.0), damping=None, scheme=af.HHT(-0.1))
    lost = run.dataset.attrs["energy_drift"]
    return Found(f"max e {peaks(run).max():.3f}; the drift is warned of", lost < -0.05, run=run)


@case("a step that no solve takes", "halved eight times, then an error", quick=True)
def impossible():
    """A state with a speed beyond sense."""
    model = af.build(ring(), fidelity="rigid")
    start = Equation(model, still(1.0)).at_rest(af.dead_load(model).q)
    start = replace(start, velocity=np.full(model.size, 1e160))
    with np.errstate(all="ignore"):
        return refused(
            lambda: af.time_history(model, still(1.0), start=start),
            af.DidNotConverge,
            "not numbers any more",
        )
