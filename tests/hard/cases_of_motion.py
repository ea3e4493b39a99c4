"""Hard motions: free flight, collapse, pulses, none at all, very long; mirrored and restarted."""

import tempfile
from pathlib import Path

import numpy as np
from glued import glued

import archfem as af
from archfem.dynamics import last_state
from hard.setting import DT, Found, answer, case, joints, off, peaks, quake, ring, shaken, still

G = 9.81


@case("free flight of one block", "all joints open, landing", quick=True)
def flight():
    """Ground falls at 2 g for 0.1 s and is stopped at 2 g: rises by ½ g T² (1 + 1/3)."""
    step = 0.0005
    times = np.arange(0.0, 2.0, step)
    up = np.where(times < 0.1, -2.0 * G, np.where(times < 0.2, 2.0 * G, 0.0))
    motion = af.Motion(np.zeros_like(up), step, up)
    block = af.column(breadth=1.0, heights=[1.0], contact=joints(10.0))
    model = af.build(block, fidelity="rigid")
    record = af.Record(fields_every=1)
    damping = af.Rayleigh(0.05, (1e-3, 100.0))  # none on the mass: nothing drags in flight
    run = shaken(model, motion, dt=step, record=record, damping=damping)
    height = run.dataset["q"].values[:, 1].max()
    known = 0.5 * G * 0.1**2 * (4.0 / 3.0)
    flown = (run.joints["N"].values == 0.0).any()
    rest = np.abs(run.joints["N"].values[-1] / run.joints["N"].values[0] - 1.0).max()
    error = abs(height / known - 1.0)
    said = f"rises {height:.4f} m, lands, rests to {rest:.1g} of its weight"
    return Found(said, bool(error < 0.01 and flown and rest < 1e-3), error, run)


@case("ring under 1.5 g vertical", "all joints open at once, landing", quick=True)
def thrown():
    """Sound throughout, and at rest again when the ground is; all joints open at some time."""
    times = np.arange(0.0, 6.0, DT)
    up = np.where(times < 1.0, -1.5 * G * np.sin(2.0 * np.pi * 2.0 * times), 0.0)
    model = af.build(ring(), fidelity="faces")
    dead = af.dead_load(model)
    run = shaken(model, af.Motion(np.zeros_like(up), DT, up), start=dead)
    apart = int((run.joints["N"].values == 0.0).sum(axis=1).max())
    left = np.abs(run.joints["N"].values[-1] - dead.joints["N"].values).max()
    error = float(left / dead.joints["N"].values.max())
    found = answer(run, error, 0.05, f"; {apart} of 18 joints open at once")
    return Found(found.outcome, found.right and apart == 18, error, run)


def scaled(factor, tolerance):
    """0.3 g scaled; against a fifth of the step, until the first mechanism."""
    model = af.build(ring(), fidelity="faces", cells=(4, 2))
    motion = quake(0.3 * G).scaled(factor)
    dead = af.dead_load(model)
    run, fine = (shaken(model, motion, start=dead, dt=dt) for dt in (DT, DT / 5))
    first = [r.mechanism.time if r.mechanism else None for r in (run, fine)]
    if None in first:
        error = float(np.abs(peaks(run) - peaks(fine)).max())
        return answer(run, error if first == [None, None] else 1.0, tolerance, "; no mechanism")
    error = abs(first[0] - first[1])
    words = f"; mechanism at {first[0]:.2f} s, its error in s"
    return answer(run, error, 0.05, words)


for _factor, _tolerance in ((0.1, 0.01), (0.3, 0.01), (1.0, 0.05), (2.0, 0), (3.0, 0), (5.0, 0)):
    case(
        f"record × {_factor:g}",
        "past the first mechanism" if _factor > 1.0 else "to the first mechanism",
        quick=_factor == 3.0,
        factor=_factor,
        tolerance=_tolerance,
    )(scaled)


@case("pulse of one step", "5 m/s² in one sample", quick=True)
def pulse():
    """Against a fifth of the step; two steps are all there is of the pulse."""
    samples = np.zeros(401)
    samples[40] = 5.0
    model = af.build(ring(), fidelity="faces")
    motion = af.Motion(samples, DT)
    run, fine = (shaken(model, motion, dt=dt) for dt in (DT, DT / 5))
    return answer(run, float(np.abs(peaks(run) - peaks(fine)).max()), 0.02)


@case("60 s of nothing", "must stay still", quick=True)
@case("60 s of nothing, undamped", "must stay still", quick=True, damping=None)
@case("60 s of nothing, HHT", "must stay still", damping=None, scheme=af.HHT(-0.1))
@case("60 s of nothing, full, SNES", "must stay still", fidelity="full", method="snes")
def nothing(fidelity="faces", **given):
    """By HHT in joints that never slide, which are all that it steps."""
    made = glued(ring()) if "scheme" in given else ring()
    model = af.build(made, fidelity=fidelity, cells=(2, 2))
    dead = af.dead_load(model)
    run = shaken(model, still(60.0), start=dead, **given)
    moved = np.abs(run.dataset["last_q"].values - dead.q).max() / np.abs(dead.q).max()
    forces = np.abs(run.joints["N"].values / dead.joints["N"].values - 1.0).max()
    return answer(run, float(max(moved, forces)), 1e-9)


@case("record of 300 s", "60 000 steps")
def long():
    """Against half the step."""
    model = af.build(ring(), fidelity="rigid")
    motion = quake(1.0, duration=300.0)
    run, fine = (shaken(model, motion, dt=dt) for dt in (DT, DT / 2))
    return answer(run, float(np.abs(peaks(run) - peaks(fine)).max()), 0.01)


@case("mirrored motion", "the mirrored result", quick=True)
def mirrored():
    """Joint k under the motion is joint 17 - k under its reverse; V turns round."""
    model = af.build(ring(), fidelity="faces", cells=(2, 2))
    motion = quake(1.5)
    turned = af.Motion(-motion.horizontal, motion.dt, motion.vertical)
    run, other = shaken(model, motion), shaken(model, turned)
    other = af.History(other.dataset.isel(joint=slice(None, None, -1)))
    other.dataset["V"] = -other.dataset["V"]
    return answer(run, off(run, other), 1e-7)


@case("restart from a stored state", "the same history", quick=True)
@case("restart, SNES", "the same history", method="snes", fidelity="rigid")
def restarted(method="auto", fidelity="faces"):
    """A run of 4 s that is restarted at 2 s, through a file."""
    model = af.build(ring(), fidelity=fidelity, cells=(2, 2))
    motion = quake(2.0, duration=4.0)
    whole = shaken(model, motion, method=method)
    with tempfile.TemporaryDirectory() as place:
        path = shaken(model, motion.cut(0.0, 2.0), method=method).save(Path(place) / "half.nc")
        start = last_state(af.History.read(path))
    rest = shaken(model, motion, start=start, method=method)
    after = slice(1 - len(rest.time), None)  # the first is a state, the others means over steps
    same, found = (af.History(run.dataset.isel(time=after)) for run in (whole, rest))
    return answer(rest, off(found, same), 1e-8)
