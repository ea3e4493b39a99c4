"""Hard shapes: cells, thin, flat, large, wide, renumbered."""

from dataclasses import replace

import numpy as np

import archfem as af
from hard.setting import DT, Found, answer, case, joints, off, peaks, quake, refused, ring, shaken

LEAST = 0.10546
"""t/R of the thinnest semicircle of 17 stones cut along chords."""


@case("cells 1 × 8", "one facet a joint", cells=(1, 8), tolerance=0.05)
@case("cells 8 × 1", "cells eight times as long as deep", cells=(8, 1), tolerance=0.005)
@case("cells 1 × 1", "one cell a stone", cells=(1, 1), tolerance=0.05, quick=True)
@case("cells 16 × 2", "slivers", cells=(16, 2), tolerance=0.005)
@case("triangles", "4 × 4 pairs of triangles", cells=(4, 4), cell="triangle", tolerance=0.005)
@case("triangles 8 × 1", "needles", cells=(8, 1), cell="triangle", tolerance=0.005)
def cells(tolerance, **given):
    """Against 8 × 8 quadrilaterals with all nodes."""
    motion = quake(1.0)
    reference = peaks(shaken(af.build(ring(), fidelity="condensed", cells=(8, 8)), motion))
    run = shaken(af.build(ring(), **given), motion)
    return answer(run, float(np.abs(peaks(run) - reference).max()), tolerance)


@case("three very wide voussoirs", "stones of 53°, 8 cells of skewed shape", quick=True)
def wide():
    """Against twice as fine a mesh."""
    shape, motion = ring(voussoirs=3), quake(1.0)
    run = shaken(af.build(shape, cells=(4, 8)), motion)
    fine = shaken(af.build(shape, fidelity="condensed", cells=(8, 16)), motion)
    return answer(run, float(np.abs(peaks(run) - peaks(fine)).max()), 0.01)


def semicircle(ratio, stiffer=1000.0):
    """17 stones cut along chords, on joints so stiff that the ring barely shortens."""
    return af.circular_arch(
        radius=3.0,
        thickness=3.0 * ratio,
        embrace=180.0,
        voussoirs=17,
        chords=1,
        contact=joints(stiffer),
    )


@case("1.02 × least thickness, rigid", "hardly stands", fidelity="rigid", quick=True)
@case("1.02 × least thickness, faces", "hardly stands", fidelity="faces")
@case("1.02 × least thickness, full", "hardly stands", fidelity="full")
def hardly(fidelity):
    """It stands, on at least four hinges nearly; the thrust stays inside."""
    dead = af.dead_load(af.build(semicircle(1.02 * LEAST), fidelity=fidelity))
    e = np.sort(np.abs(dead.joints["eccentricity"].values))[::-1]
    said = f"stands in {dead.steps} steps, {dead.iterations} iterations; e {e[0]:.3f}"
    return Found(said, bool(0.4 < e[0] < 0.5 + 1e-9 and np.isfinite(e).all()))


@case("0.98 × least thickness, rigid", "cannot stand", fidelity="rigid", quick=True)
@case("0.98 × least thickness, faces", "cannot stand", fidelity="faces")
@case("0.98 × least thickness, full", "cannot stand", fidelity="full")
def too_thin(fidelity):
    model = af.build(semicircle(0.98 * LEAST), fidelity=fidelity)
    return refused(
        lambda: af.dead_load(model), af.DidNotConverge, "does not stand under its own weight"
    )


@case("0.98 × least, soft joints", "compliance must not hide it", quick=True)
def too_thin_and_soft():
    model = af.build(semicircle(0.98 * LEAST, 1.0), fidelity="rigid")
    return refused(
        lambda: af.dead_load(model), af.DidNotConverge, "does not stand under its own weight"
    )


@case("flat ring, 20°", "thrust ten times the weight", embrace=20.0, quick=True)
@case("over-semicircular ring, 200°", "overhanging springings", embrace=200.0, thickness=0.9)
def embraces(**given):
    """Against 8 × 8 cells."""
    motion = quake(1.0)
    run = shaken(af.build(ring(**given), cells=(4, 4)), motion)
    fine = shaken(af.build(ring(**given), fidelity="condensed", cells=(8, 8)), motion)
    return answer(run, float(np.abs(peaks(run) - peaks(fine)).max()), 0.01)


@case("one voussoir", "a single stone between abutments", voussoirs=1, embrace=40.0, quick=True)
@case("500 voussoirs", "1500 coordinates, joints of 16 mm pitch", voussoirs=500, embrace=159.0)
def counts(**given):
    """Against half the step; joints stiffer as there are more, so that rings are as compliant."""
    stiffer = (given["voussoirs"] + 1) / 18.0
    model = af.build(ring(contact=joints(stiffer), **given), fidelity="rigid")
    motion = quake(1.0, duration=2.0)
    dead = af.dead_load(model)
    run, fine = (shaken(model, motion, start=dead, dt=dt) for dt in (DT, DT / 2))
    return answer(run, float(np.abs(peaks(run) - peaks(fine)).max()), 0.01)


@case("width 1 mm", "forces a thousandth", width=1e-3, quick=True)
@case("width 100 m", "forces a hundredfold", width=100.0, quick=True)
def widths(width):
    """Per width, results are those of one metre."""
    runs = [
        shaken(af.build(ring(width=w), fidelity="faces", cells=(2, 2)), quake(1.5))
        for w in (width, 1.0)
    ]
    for key in ("N", "V", "M"):
        runs[0].dataset[key] = runs[0].dataset[key] / width
    return answer(runs[0], off(*runs), 1e-8)


def permuted(structure, seed):
    """The same structure with blocks and joints in another order, joints' sides exchanged."""
    random = np.random.default_rng(seed)
    order = random.permutation(len(structure.blocks))
    place = np.argsort(order)
    others = []
    for number in random.permutation(len(structure.joints)):
        joint = structure.joints[number]
        blocks = tuple(int(place[b]) for b in joint.blocks)
        others.append(replace(joint, blocks=blocks[:: random.choice([-1, 1])]))
    return replace(
        structure, blocks=tuple(structure.blocks[b] for b in order), joints=tuple(others)
    )


@case("blocks and joints renumbered", "nothing may change", fidelity="rigid", quick=True)
@case("renumbered, full", "nothing may change", fidelity="full")
def renumbered(fidelity):
    """N, |V|, M by the names of the joints; V is that of the higher block and may turn round."""
    runs = []
    for shape in (permuted(ring(), 1), ring()):
        run = shaken(af.build(shape, fidelity=fidelity, cells=(2, 2)), quake(1.5))
        order = np.argsort(run.joints["name"].values)
        run = af.History(run.dataset.isel(joint=order))
        run.dataset["V"] = abs(run.dataset["V"])
        runs.append(run)
    return answer(runs[0], off(*runs), 1e-7)
