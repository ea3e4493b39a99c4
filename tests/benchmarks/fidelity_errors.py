"""Errors of the lower fidelities: random structures under strong motions, against all nodes.

    python tests/benchmarks/fidelity_errors.py [--count 30] [--seed 0]

Rings, arches on piers and columns of `random_structures`, damped, with 4 × 4 cells and the same
steps of 5 ms at every fidelity. A line for each: E / (L k_n), the stiffness of the softest stone
over that of its joints; the largest |e| of all nodes; the errors of `rigid` and `faces` in the
largest |e| of every joint; and the fidelities at which a mechanism forms by count. Then the shares
beyond the errors that the README states for its ring.
"""

import logging
from collections.abc import Sequence

import numpy as np
from random_structures import structure
from setting import plain_options

import archfem as af
from archfem.dynamics.accuracy import peak_eccentricities
from archfem.dynamics.error_estimation import largest_difference
from archfem.masonry.stiffness_ratio import estimate_block_stiffness

PROMISED = {"rigid": 0.005, "faces": 0.002}
"""Errors in the largest |e| of the ring of the README."""


def compared(
    seed: int, duration: float
) -> tuple[float, float, dict[str, float], dict[str, bool]] | None:
    """Stiffness ratio, largest |e|, errors and mechanisms by fidelity; None if a run ends early."""
    rng = np.random.default_rng(seed)
    built = structure(rng)
    pga = rng.uniform(0.5, 6.0)
    motion = af.Motion.synthetic(duration=duration, pga=pga, seed=int(rng.integers(1000)))
    damping, found, formed = af.StiffnessDamping(0.05, 8.0), {}, {}
    for fidelity in ("rigid", "faces", "full"):
        try:
            model = af.build(built, fidelity=fidelity, cells=(4, 4))
            run = af.time_history(model, motion, dt=0.005, damping=damping, method="compliance")
        except af.ArchfemError as error:
            print(f"{seed:4} {fidelity}: {str(error)[:90]}")
            return None
        found[fidelity], formed[fidelity] = peak_eccentricities(run), run.mechanism is not None
    errors = {fidelity: largest_difference(found[fidelity], found["full"]) for fidelity in PROMISED}
    ratio = min(estimate_block_stiffness(built, number).ratio for number in built.free)
    return ratio, float(found["full"].max()), errors, formed


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table and the shares."""
    made = plain_options(__doc__)
    made.add_argument("--count", type=int, default=30)
    made.add_argument("--seed", type=int, default=0)
    chosen = made.parse_args(arguments)
    duration = 4.0
    if chosen.quick:
        chosen.count, duration = 1, 0.5
    logging.getLogger("archfem").setLevel(logging.CRITICAL)
    rows = []
    for seed in range(chosen.seed, chosen.seed + chosen.count):
        if (row := compared(seed, duration)) is None:
            continue
        rows.append(row)
        ratio, largest, errors, formed = row
        written = ", ".join(f"{fidelity} {error:.4f}" for fidelity, error in errors.items())
        kinds = " ".join(str(int(each)) for each in formed.values())
        print(f"{seed:4} E/(L k_n) {ratio:7.1f}  |e| {largest:.3f}  {written}  mechanism {kinds}")
    for fidelity, promised in PROMISED.items():
        errors = np.array([row[2][fidelity] for row in rows])
        print(
            f"{fidelity}: median {np.median(errors):.4f}, "
            f"90 % below {np.quantile(errors, 0.9):.4f}, "
            f"largest {errors.max():.4f}; {np.sum(errors > promised)} of {len(errors)} beyond "
            f"{promised}"
        )
    changed = sum(len(set(row[3].values())) > 1 for row in rows)
    print(f"a mechanism forms at some fidelities and not at others: {changed} of {len(rows)}")


if __name__ == "__main__":
    main()
