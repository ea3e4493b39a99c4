"""Hard joints: stiff, soft, slippery; and the two steppers against each other."""

import numpy as np

import archfem as af
from archfem.statics import Newton
from hard.setting import (
    DAMPING,
    DT,
    IN_BALANCE,
    Found,
    answer,
    case,
    joints,
    off,
    peaks,
    quake,
    ring,
    shaken,
    unbalanced_steps,
)

G = 9.81

SLIP = 1e-3
"""Off in the slip of a block, of itself: the closed form takes the block not to rock on its joint,
which makes shear softer by 12 k_s/k_n (h/2b)² = 1 %, and the step is a quarter of a radian of its
vibration. Found 1e-4 and 2.5e-4. A bed that is rigid until it slides is off by 0.09 at μ = 0.3."""


@case("joints 1000 × softer", "dead load compresses by centimetres", stiffer=1e-3, quick=True)
@case("joints 10 × softer", "the ring's own periods lengthen", stiffer=0.1)
@case("joints 10 × stiffer", "contact faster than the step", stiffer=10.0, tolerance=0.02)
@case("joints 1000 × stiffer", "contact far faster than the step", stiffer=1e3)
def stiffness(stiffer, fidelity="rigid", tolerance=0.01):
    """Against a fifth of the step."""
    model = af.build(ring(contact=joints(stiffer)), fidelity=fidelity)
    dead = af.dead_load(model)
    run, fine = (shaken(model, quake(1.0), start=dead, dt=dt) for dt in (DT, DT / 5))
    return answer(run, float(np.abs(peaks(run) - peaks(fine)).max()), tolerance)


@case("joints 1000 × softer, full", "stone a million times as stiff")
def soft_under_elastic_stones():
    """The Newton solver against equilibrium solves."""
    model = af.build(ring(contact=joints(1e-3)), cells=(2, 2))
    given = {"newton": Newton(tolerance=1e-12), "start": af.dead_load(model)}
    run, exact = (
        shaken(model, quake(0.5, duration=3.0), method=m, **given) for m in ("newton", "snes")
    )
    return answer(run, off(run, exact), 1e-6)


@case("joints 1000 × stiffer, full", "joints stiffer than the stone")
def stiff_under_elastic_stones():
    """Every step of the Newton solver in balance; SNES cycles at 0.22 s, and halves that step."""
    model, motion = af.build(ring(contact=joints(1e3)), cells=(2, 2)), quake(0.5, duration=3.0)
    dead, record = af.dead_load(model), af.Record(fields_every=1)
    run = shaken(model, motion, method="newton", start=dead, record=record)
    return answer(run, unbalanced_steps(run, dead, motion, DAMPING), IN_BALANCE)


@case("friction 0.01", "slides for seconds after a push", friction=0.01, push=1.0, quick=True)
@case("friction 0.3", "elastic shear lends it speed", friction=0.3, push=3.5, quick=True)
def slippery(friction, push, last=0.2, step=5e-4):
    """A block on ground that is pushed slips as far as an elastic-plastic oscillator does."""
    hold = friction * G
    times = np.arange(0.0, 1.2 * push * last / hold, step)
    pushed = (times > step / 2.0) & (times < last + step / 2.0)
    motion = af.Motion(np.where(pushed, push, 0.0), step)
    block = af.column(breadth=4.0, heights=[0.5], contact=joints(friction=friction))
    run = shaken(af.build(block, fidelity="rigid"), motion, dt=step, damping=None)
    stone, contact = block.blocks[1], block.joints[0].contact
    square = contact.shear_stiffness * G / (stone.material.unit_weight * 0.5)
    known = _slip(hold, push, last, step, square)
    slipped = np.abs(run.joints["slip"].values).max()
    error = float(abs(slipped / known - 1.0))
    use = np.abs(run.joints["V"].values / run.joints["N"].values).max()
    said = f"slips by {slipped:.4f} m, V/N to {use:.4f}"
    return Found(said, bool(error < SLIP and use < (1.0 + 1e-6) * friction), error, run)


def _slip(hold, push, last, step, square):
    """Farthest slip [m] after a push a for T whose ends are ramps of a step r, in closed form.

    Shear grows with ω² per unit mass up to μ g, at y = μ g / ω². The push reaches that while the
    block lags behind, which is then faster by v than a rigid bed would have it: to first order the
    slip is (a - μ g) a T² / (2 μ g) + v a T / (μ g), and v may be a tenth of the push's speed.
    """
    way, yields = np.sqrt(square), hold / square
    along = push * (1.0 / square - np.sin(way * step) / (way**3 * step))  # at the end of the ramp
    speed = push * (1.0 - np.cos(way * step)) / (square * step)
    size = np.hypot(along - push / square, speed / way)
    ahead = np.arctan2(speed / way, along - push / square)
    until = (ahead - np.arccos((yields - push / square) / size)) / way % (2.0 * np.pi / way)
    speed = way * size * np.sin(ahead - way * until)
    left = last - step - until
    slip = yields + left * (speed + left * (push - hold) / 2.0)
    speed += left * (push - hold)
    slip += step * (speed + step * (push / 3.0 - hold / 2.0))
    speed += step * (push / 2.0 - hold)
    return slip + speed**2 / (2.0 * hold)


def _compared(fidelity, rule, pga, method):
    """By a solver and by SNES; "newton" with Newmark's method, and joints that never slide."""
    newmark = method == "newton"
    contact = joints(friction=None) if newmark else joints()
    model = af.build(ring(contact=contact), fidelity=fidelity, quadrature=rule, cells=(2, 2))
    newton = Newton(tolerance=1e-13)
    given = {"newton": newton, "start": af.dead_load(model, newton)}
    given["scheme"] = af.dynamics.Newmark() if newmark else None
    motion = quake(pga, duration=3.0, seed=5)
    return [shaken(model, motion, method=m, **given) for m in (method, "snes")]


def steppers(fidelity, rule, method):
    """The same history by both steppers, joints opening and closing."""
    run, exact = _compared(fidelity, rule, 2.0, method)
    return answer(run, off(run, exact), 1e-8)


for _rule in ("lobatto", "nodal", "gauss", "exact"):
    for _method, _fidelities in (
        ("compliance", ("rigid", "faces", "condensed", "full")),
        ("newton", ("rigid", "faces", "condensed", "full")),
    ):
        for _fidelity in _fidelities:
            case(
                f"{_method} stepper, {_fidelity}, {_rule}",
                "active set against SNES",
                quick=_fidelity == "faces" and _rule == "exact",
                fidelity=_fidelity,
                rule=_rule,
                method=_method,
            )(steppers)


@case("newton with Newmark at 1.2 g, exact", "active set cycles?", rule="exact", method="newton")
@case(
    "newton with Newmark at 1.2 g, lobatto", "active set cycles?", rule="lobatto", method="newton"
)
@case("compliance at 1.2 g, lobatto", "active set cycles?", rule="lobatto")
@case("compliance at 1.2 g, nodal", "active set cycles?", rule="nodal")
@case("compliance at 1.2 g, gauss", "active set cycles?", rule="gauss")
@case("compliance at 1.2 g, exact", "active set cycles?", rule="exact")
def violent(rule, method="compliance"):
    """Chaotic: rounding grows, so they agree to 1e-6 for half a second; both stay sound."""
    run, exact = _compared("faces", rule, 12.0, method)
    apart = np.abs(run.joints["N"] - exact.joints["N"]).max("joint").values
    apart /= np.abs(exact.joints["N"].values).max()
    until = run.time[int(np.argmax(apart > 1e-6))] if (apart > 1e-6).any() else run.time[-1]
    early = float(apart[run.time <= 0.5].max())
    return answer(run, early, 1e-6, f"; the same to 1e-6 until {until:.2f} s")
