"""Random structures under random motions: every run ends in an answer or in an error of ours.

    python tests/benchmarks/random_structures.py [--count 200] [--seed 0] [--displacements large]

Rings, arches on piers and columns of stones, of random shapes, joints and friction, under made
motions of up to 2 g; a line for each that is not plain, and the totals.
"""

import argparse
import logging
import time
from collections import Counter

import numpy as np

import archfem as af

DT = 0.005


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


def tried(seed: int, displacements: str) -> tuple[str, str, float]:
    """Run one: what came of it in a word, what there is to say, and the steps' ms of CPU time."""
    rng = np.random.default_rng(seed)
    try:
        built = structure(rng)
        motion = af.Motion.synthetic(
            duration=4.0, pga=rng.uniform(0.5, 20.0), seed=int(rng.integers(1000))
        )
        damping = None if rng.random() < 0.3 else af.StiffnessDamping(0.05, 8.0)
        rung = ("rigid", "faces")[int(rng.random() < 0.15)]
        model = af.build(built, fidelity=rung, cells=(2, 2), displacements=displacements)
        begun = time.process_time()
        run = af.time_history(model, motion, dt=DT, damping=damping)
        spent = 1e3 * (time.process_time() - begun) / len(run.time)
    except af.ArchfemError as error:
        return type(error).__name__, str(error)[:160], 0.0
    except Exception as error:  # what no user should ever see
        return "FOREIGN", f"{type(error).__name__}: {error}"[:160], 0.0
    told = run.dataset.attrs
    drift, finite = told["energy_drift"], bool(np.isfinite(run.joints["N"]).all())
    words = f"drift {drift:.1e}, {told['fallback_steps']} steps by SNES"
    if not finite or abs(drift) > 1e-4:
        return "WRONG", words, spent
    return (run.fall.kind if run.fall else "answer"), words, spent


def main() -> None:
    """Print what is not plain, and the totals."""
    made = argparse.ArgumentParser(description=__doc__)
    made.add_argument("--count", type=int, default=200)
    made.add_argument("--seed", type=int, default=0)
    made.add_argument("--displacements", default="small", choices=("small", "large"))
    asked = made.parse_args()
    logging.getLogger("archfem").setLevel(logging.ERROR)
    found, spent, left = Counter(), [], 0
    for seed in range(asked.seed, asked.seed + asked.count):
        kind, words, ms = tried(seed, asked.displacements)
        found[kind] += 1
        left += "steps by" in words and ", 0 steps" not in words
        spent += [ms] if ms else []
        if kind in ("FOREIGN", "WRONG", "InvalidInput", "DidNotConverge"):
            print(f"{seed:5} {kind:16} {words}", flush=True)
    print(dict(found), f"{left} runs with steps by SNES; median {np.median(spent):.3f} ms a step")


if __name__ == "__main__":
    main()
