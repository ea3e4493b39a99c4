"""Hard in time: long rocking, chatter on stiff joints, steps large and small, no damping."""

from dataclasses import replace

import numpy as np

import archfem as af
from archfem.contact import ContactStepper
from hard.setting import DT, Found, answer, case, joints, peaks, quake, refused, ring, shaken, still


def _tilted(model, share=0.1):
    """A block 0.6 × 2.4 m turned clockwise about its corner by a share of its slenderness."""
    theta = share * np.arctan(0.25)
    stepper = ContactStepper(model, still(1.0))
    return stepper.at_rest(np.array([1.2 * theta, 0.3 * theta, -theta]))


def rocking(scheme, dt, tolerance):
    """Energy left after 20 s of free rocking, 27 periods at first, without damping."""
    block = af.column(breadth=0.6, heights=[2.4], contact=joints(10.0))
    model = af.build(block, fidelity="rigid", cells=(16, 1))
    start = _tilted(model)
    run = shaken(model, still(20.0), dt=dt, start=start, damping=None, scheme=scheme)
    return answer(run, abs(run.dataset.attrs["energy_drift"]), tolerance, "; error is the drift")


for _dt in (0.005, 0.001):
    for _scheme, _name, _tolerance in (
        (None, "average acceleration", 0.05),
        (af.HHT(-0.05), "HHT(-0.05)", 1.0),
        (af.HHT(-0.1), "HHT(-0.1)", 1.0),
    ):
        case(
            f"rocking block, {_name}, {1e3 * _dt:g} ms",
            "20 s of impacts, undamped",
            quick=_dt == 0.005 and _scheme is None,
            scheme=_scheme,
            dt=_dt,
            tolerance=_tolerance,
        )(rocking)


def chatter(scheme):
    """Rms change of N from step to step at the base of a stiff stack, by its weight."""
    stack = af.column(breadth=1.0, heights=[1.0, 1.0], contact=joints(1e3))
    model = af.build(stack, fidelity="rigid")
    damping = af.Rayleigh(0.05, (8.0, 16.0), "initial")
    motion = quake(4.0)
    run = shaken(model, motion, scheme=scheme, damping=damping)
    fine = shaken(model, motion, dt=DT / 10)
    base = run.joints["N"].values[:, 0]
    rough = float(np.sqrt(np.mean(np.diff(base) ** 2)) / base[0])
    error = float(np.abs(peaks(run) - peaks(fine)).max())
    return answer(run, error, 0.05, f"; N changes by {rough:.2f} of the weight a step")


for _alpha in (0.0, -0.05, -0.1, -0.3):
    case(
        f"chatter, α = {_alpha:g}",
        "impacts on joints 1000 × stiffer",
        quick=_alpha == -0.1,
        scheme=af.HHT(_alpha) if _alpha else None,
    )(chatter)


def steps(dt, tolerance):
    """Against 0.05 ms."""
    model = af.build(ring(), fidelity="rigid")
    motion = quake(1.0, duration=3.0)
    record = af.Record(every=max(1, round(DT / dt)))
    run = shaken(model, motion, dt=dt, record=record)
    fine = shaken(model, motion, dt=5e-5, record=af.Record(every=100))
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
    model = af.build(ring(), fidelity=fidelity)
    return refused(
        lambda: shaken(model, quake(2.0), damping=None), af.DidNotConverge, "come from nowhere"
    )


@case("undamped, HHT(-0.1)", "losses at impact are the scheme's", quick=True)
def undamped_hht():
    """Sound, but the drift is said: what impacts lose is the scheme's choice."""
    model = af.build(ring(), fidelity="rigid")
    run = shaken(model, quake(2.0), damping=None, scheme=af.HHT(-0.1))
    lost = run.dataset.attrs["energy_drift"]
    return Found(f"max e {peaks(run).max():.3f}; the drift is warned of", lost < -0.05, run=run)


@case("a step that no solve takes", "halved eight times, then an error", quick=True)
def impossible():
    """A state with a speed beyond sense."""
    model = af.build(ring(), fidelity="rigid")
    start = ContactStepper(model, still(1.0)).at_rest(af.dead_load(model).q)
    start = replace(start, velocity=np.full(model.size, 1e160))
    with np.errstate(all="ignore"):
        return refused(
            lambda: af.time_history(model, still(1.0), start=start), af.DidNotConverge, ""
        )
