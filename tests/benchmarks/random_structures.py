"""Random structures under random motions: every run ends in an answer or in an error of ours.

    python tests/benchmarks/random_structures.py [--count 200] [--seed 0] [--displacements large]

Rings, arches on piers and columns of stones, of random shapes, joints and friction, under made
motions of up to 2 g, where displacements are large to the ground or to rest; a line for each that
is not plain, or for each, and the totals. Energy that rises by more than 1e-4 of what was exchanged
is wrong; loose stones that gain more than that end in an error of ours.
"""

import logging
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from setting import plain_options

import archfem as af

DT = 0.005

RISE = 1e-4
"""Energy from nowhere, relative to the largest exchanged, from which a run is wrong."""

WIDTH = 160
"""Most letters of what there is to say."""


def contact(rng: np.random.Generator) -> af.Contact:
    """Joints from soft to nearly rigid, from slippery to such that never slide."""
    stiff = 10.0 ** rng.uniform(8.5, 11.0)
    friction = None if rng.random() < 0.15 else rng.uniform(0.3, 0.9)
    return af.Contact(stiff, rng.uniform(0.1, 0.6) * stiff, friction)


def structure(rng: np.random.Generator) -> af.Structure:
    """A ring, an arch on piers, or a column."""
    joints, kind = contact(rng), rng.integers(3)
    if kind == 0:
        radius = rng.uniform(1.0, 8.0)
        return af.circular_arch(
            radius=radius,
            thickness=radius * rng.uniform(0.1, 0.3),
            embrace=rng.uniform(100.0, 180.0),
            voussoirs=int(rng.integers(5, 26)),
            contact=joints,
        )
    if kind == 1:
        radius = rng.uniform(1.0, 4.0)
        return af.arch_on_piers(
            radius=radius,
            thickness=radius * rng.uniform(0.15, 0.3),
            voussoirs=int(rng.integers(7, 18)),
            pier_breadth=radius * rng.uniform(0.4, 0.8),
            courses=[radius * rng.uniform(0.2, 0.5)] * int(rng.integers(1, 5)),
            contact=joints,
        )
    breadth = rng.uniform(0.3, 1.5)
    return af.column(
        breadth=breadth,
        heights=[breadth * rng.uniform(0.4, 2.0) for _ in range(rng.integers(1, 6))],
        contact=joints,
    )


@dataclass(frozen=True)
class Came:
    """What came of a run.

    Attributes:
        kind: in a word.
        words: what there is to say.
        steps: that were taken.
        halved: of those, that had to be halved.
        left: steps that a strategy left to SNES.
        drift: of energy, relative to the largest exchanged [-].
        spent: CPU time of a step, what fell included [ms].
    """

    kind: str
    words: str
    steps: int = 0
    halved: int = 0
    left: int = 0
    drift: float = 0.0
    spent: float = 0.0


def tried(seed: int, displacements: str, duration: float = 4.0) -> Came:
    """Run one structure under one motion."""
    rng = np.random.default_rng(seed)
    try:
        built = structure(rng)
        motion = af.Motion.synthetic(
            duration=duration, pga=rng.uniform(0.5, 20.0), seed=int(rng.integers(1000))
        )
        damping = None if rng.random() < 0.3 else af.StiffnessDamping(0.05, 8.0)
        rung = ("rigid", "faces")[int(rng.random() < 0.15)]
        model = af.build(built, fidelity=rung, cells=(2, 2), displacements=displacements)
        begun = time.process_time()
        run = af.time_history(model, motion, dt=DT, damping=damping)
        spent = 1e3 * (time.process_time() - begun)
    except af.ArchfemError as error:
        return Came(type(error).__name__, str(error)[:WIDTH])
    except Exception as error:  # what no user should ever see
        return Came("FOREIGN", f"{type(error).__name__}: {error}"[:WIDTH])
    told, finite = run.dataset.attrs, bool(np.isfinite(run.joints["N"]).all())
    steps, drift = told["steps"], float(told["energy_drift"])
    counts = steps, told["halved_steps"], told["fallback_steps"], drift
    words = f"{built.name}, {rung}: {run.fall.words if run.fall else run.outcome}"[:WIDTH]
    kind = run.fall.kind if run.fall else "answer"
    wrong = not finite or abs(drift) > RISE
    return Came("WRONG" if wrong else kind, words, *counts, spent / steps)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print what is not plain, and the totals."""
    made = plain_options(__doc__)
    made.add_argument("--count", type=int, default=200)
    made.add_argument("--seed", type=int, default=0)
    made.add_argument("--displacements", default="small", choices=("small", "large"))
    made.add_argument("--all", action="store_true", help="print a line for each run")
    chosen = made.parse_args(arguments)
    duration = 4.0
    if chosen.quick:
        chosen.count, duration = 2, 0.5
    logging.getLogger("archfem").setLevel(logging.ERROR)
    runs = []
    for seed in range(chosen.seed, chosen.seed + chosen.count):
        came = tried(seed, chosen.displacements, duration)
        runs.append(came)
        if chosen.all or not came.steps or came.kind == "WRONG":
            print(
                f"{seed:5} {came.kind:16} {came.steps:4} steps, {came.halved} halved, "
                f"{came.left} by SNES, drift {came.drift:.1e}, {came.spent:.3f} ms; {came.words}",
                flush=True,
            )
    done = [came for came in runs if came.steps]
    print(dict(Counter(came.kind for came in runs)))
    print(
        f"{sum(came.steps for came in done)} steps, {sum(came.halved for came in done)} halved, "
        f"{sum(came.left for came in done)} by SNES in {sum(came.left > 0 for came in done)} runs; "
        f"largest drift {max(abs(came.drift) for came in done):.1e}; "
        f"median {np.median([came.spent for came in done]):.3f} ms a step"
    )


if __name__ == "__main__":
    main()
