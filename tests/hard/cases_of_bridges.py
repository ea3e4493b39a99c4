"""Hard bridges: soft and stiff fill, soil joints, thin cover, tall piers, many spans."""

from dataclasses import replace

import numpy as np
from glued import glued

import archfem as af
from archfem.masonry import BACKFILL, SOIL_TO_STONE
from archfem.statics import Equilibrium, Newton, forces_on
from hard.setting import (
    DT,
    IN_BALANCE,
    Found,
    answer,
    case,
    off,
    peaks,
    quake,
    refused,
    shaken,
    unbalanced_steps,
)

TIGHT = Newton(tolerance=1e-12)
DAMPING = af.Rayleigh(0.05, (4.0, 20.0))
CLOSED = 1e-7
"""Forces on a block close within this part of the largest of all, after a dead load to 1e-12."""


def span(name="arch", **given) -> af.shapes.Arch:
    """A ring of 4 m."""
    lengths = {"span": 4.0, "embrace": 150.0, "thickness": 0.45, "voussoirs": 9}
    return af.shapes.Arch(measured="centre line", name=name, **{**lengths, **given})


def fill(cover=0.4, young=None, joints=1.0, **given) -> af.shapes.Backfill:
    """Fill of so stiff a soil, with joints to stone so many times stiffer."""
    soil = BACKFILL if young is None else replace(BACKFILL, young=young)
    contact = replace(
        SOIL_TO_STONE,
        normal_stiffness=joints * SOIL_TO_STONE.normal_stiffness,
        shear_stiffness=joints * SOIL_TO_STONE.shear_stiffness,
    )
    return af.shapes.Backfill(cover=cover, material=soil, contact=contact, **given)


def walls(**given) -> list[af.shapes.Sidewall]:
    """Two sidewalls."""
    lengths = {"length": 2.0, "height": 1.2, "above": 0.6}
    return [
        af.shapes.Sidewall(name=f"{side} sidewall", **{**lengths, **given})
        for side in ("west", "east")
    ]


def unbalanced(dead: Equilibrium) -> float:
    """Largest sum of the forces on any free block at rest, relative to the largest force."""
    model = dead.model
    bodies = [
        forces_on(model.structure, dead.joints, number, model.cells)
        for number in model.structure.free
    ]
    lacking = max(float(np.linalg.norm(body.sum)) for body in bodies)
    return lacking / max(float(body.sizes.max()) for body in bodies)


def standing(structure: af.Structure, **given) -> Equilibrium:
    """Dead load that leaves no block out of balance."""
    dead = af.dead_load(af.build(structure, **{"cells": (2, 2), **given}), TIGHT)
    off_balance = unbalanced(dead)
    assert off_balance < CLOSED, f"forces on a block lack {off_balance:.2g} of the largest"
    return dead


def both(dead, motion, **given) -> list[af.History]:
    """The same history by the stepper for large structures and by SNES."""
    options = {"start": dead, "damping": DAMPING, "newton": TIGHT, **given}
    return [shaken(dead.model, motion, method=m, **options) for m in ("compliance", "snes")]


def compared(structure, *, pga=3.0, duration=0.3, tolerance=1e-7, build=None, **given) -> Found:
    """Dead load in balance block by block, then 0.3 s in which steppers must agree.

    The motion starts where it is strong.
    """
    dead = standing(structure, **(build or {}))
    motion = quake(pga, seed=5).cut(1.0, 1.0 + duration)
    run, exact = both(dead, motion, **given)
    largest = np.nanmax(np.abs(dead.joints["eccentricity"].values))
    return answer(run, off(run, exact), tolerance, f"; {largest:.3f} at rest")


@case(
    "fill of 0.5 MPa", "soil 60 000 times softer than stone", young=0.5 * af.units.MPa, quick=True
)
@case("fill of 600 MPa", "soil as stiff as its joints", young=600e6)
@case("soil joints 100 × softer", "fill sinks by centimetres", joints=0.01, quick=True)
@case("cover of 45 mm", "fill as thin as it may be over the stones", cover=0.045, quick=True)
def filled(**given):
    """One filled span; compliance against SNES."""
    return compared(af.bridge(arches=[span()], backfill=fill(**given)))


IN_BALANCE_IN_HALVES = 4.0 * IN_BALANCE
"""The same of steps in halves: forces err by the rounding of displacements over the square of the
step. Found 7e-10; a motion or damping that is off by a millionth makes 2.7e-8 or more there."""


def stiffly_filled() -> tuple[af.History, Equilibrium, af.Motion]:
    """The run of a span with stiff joints of its fill, of which one step is taken in halves."""
    dead = standing(af.bridge(arches=[span()], backfill=fill(joints=100.0)))
    motion, record = quake(3.0, seed=5).cut(1.0, 1.3), af.Record(fields_every=1)
    given = {"start": dead, "damping": DAMPING, "newton": TIGHT, "record": record}
    return shaken(dead.model, motion, method="compliance", **given), dead, motion


@case("soil joints 100 × stiffer", "soil joints stiffer than stone joints")
def balanced():
    """Every step of compliance in balance, where SNES cycles and takes most steps in halves."""
    run, dead, motion = stiffly_filled()
    return answer(run, unbalanced_steps(run, dead, motion, DAMPING), IN_BALANCE_IN_HALVES)


BY_PART = {"backfill": "full", "rest": "faces"}


@case("filled span, condensed", "compliance against SNES", fidelity="condensed")
@case(
    "filled span, fidelities by part",
    "faces of stones, nodes of soil",
    fidelity=BY_PART,
    quick=True,
)
def fidelities(fidelity):
    return compared(af.bridge(arches=[span()], backfill=fill()), build={"fidelity": fidelity})


@case("filled segment of 30°", "thrust of many times the weight", quick=True)
def flat():
    arch = span(embrace=30.0, voussoirs=15)
    return compared(af.bridge(arches=[arch], backfill=fill()), tolerance=1e-6)


@case("piers of 20 m, 50 courses", "slender piers under rings", quick=True)
def tall():
    """Against half the step."""
    rings = [span("west arch"), span("east arch")]
    pier = af.shapes.Pier(gap=2.0, height=20.0, course=0.4)
    return against_half_the_step(af.bridge(arches=rings, piers=[pier]), fidelity="faces")


def against_half_the_step(structure, *, pga=0.5, tolerance=0.01, **build):
    """Largest |e| of every joint under a mild motion; a strong one is chaotic in tall piers."""
    dead = standing(structure, **build)
    motion = quake(pga, seed=5, duration=4.0)
    run, fine = (
        shaken(dead.model, motion, start=dead, dt=dt, damping=DAMPING) for dt in (DT, DT / 2)
    )
    return answer(run, float(np.nanmax(np.abs(peaks(run) - peaks(fine)))), tolerance)


@case("viaduct of 8 spans, bare", "120 joints in rings and piers", filled=False, quick=True)
@case("viaduct of 8 spans, filled", "all spans under one fill")
def viaduct(filled=True):
    """Bare against half the step, filled against SNES."""
    rings = [span(f"arch {k}", voussoirs=11) for k in range(1, 9)]
    piers = [af.shapes.Pier(name=f"pier {k}", gap=1.4, height=4.0) for k in range(1, 8)]
    if filled:
        return compared(af.bridge(arches=rings, piers=piers, backfill=fill()), duration=0.2)
    return against_half_the_step(af.bridge(arches=rings, piers=piers), fidelity="faces")


@case("paving on an eroded deck", "pavers along slopes, and on the hump", quick=True)
def paved():
    soil = fill(cover=0.8, erosion=0.4, hump=0.5)
    paving = af.shapes.Paving(thickness=0.2, length=0.5)
    return compared(af.bridge(arches=[span()], sidewalls=walls(), backfill=soil, paving=paving))


@case("sidewalls retained", "fixed wall behind courses", state="retained", quick=True)
@case("sidewalls fixed", "fill on one piece of rock", state="fixed")
@case("sidewalls free", "courses that the ring pushes outwards", state="free")
def retained(state):
    return compared(af.bridge(arches=[span()], sidewalls=walls(state=state), backfill=fill()))


@case("filled span at 0.8 g, also vertically", "unscaled record, 6 s")
@case("filled span at 0.8 g, 0.4 s", "as strong vertically", cut=(1.2, 1.6), quick=True)
def strong(cut=None):
    """Compliance against SNES."""
    dead = standing(af.bridge(arches=[span()], backfill=fill()))
    motion = quake(8.0, seed=5, vertical=1.0)
    run, exact = both(dead, motion.cut(*cut) if cut else motion)
    return answer(run, off(run, exact), 1e-6)


def damped(joints, scheme):
    """Steppers agree for every part that damping acts on; by HHT in joints that never slide."""
    damping = replace(DAMPING, joints=joints)
    made = af.bridge(arches=[span()], backfill=fill())
    return compared(glued(made) if scheme else made, damping=damping, scheme=scheme)


for _joints in ("none", "initial", "closed"):
    for _scheme, _name in ((None, "conserving"), (af.HHT(-0.1), "HHT(-0.1)")):
        case(
            f"filled span, damping '{_joints}', {_name}",
            "compliance against SNES",
            quick=_scheme is None and _joints == "none",
            joints=_joints,
            scheme=_scheme,
        )(damped)


@case("filled span, 20 ms steps", "sampled coarsely", quick=True)
def coarse_steps():
    return compared(af.bridge(arches=[span()], backfill=fill()), dt=0.02, duration=0.8)


@case("bare bridge of thin rings", "cannot stand", quick=True)
def thin():
    rings = [span("west arch", thickness=0.08), span("east arch", thickness=0.08)]
    return falls(af.bridge(arches=rings, piers=[af.shapes.Pier(gap=1.0, height=2.0)]))


@case("wide flat span on a slender pier", "side thrust topples the pier", quick=True)
def toppling():
    rings = [
        span("west arch", span=8.0, embrace=60.0, voussoirs=15),
        span("east arch", span=3.0),
    ]
    return falls(af.bridge(arches=rings, piers=[af.shapes.Pier(gap=0.5, height=6.0)]))


def falls(structure):
    """Limit analysis says that it cannot stand, and so does the dead load."""
    assert not af.stands(structure)
    model = af.build(structure, fidelity="faces", cells=(2, 2))
    return refused(
        lambda: af.dead_load(model), af.DidNotConverge, "does not stand under its own weight"
    )
