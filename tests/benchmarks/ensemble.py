"""Histories per second and core of an ensemble and of an IDA, on the ring of the README.

    python tests/benchmarks/ensemble.py [--records 8 --scales 2]

Synthetic motions of 8 s in steps of 2 ms; times are of the processor. The ensemble runs beside the
general solver of large displacements, in turn in one process, with the largest differences of the
displacements of a corner. The IDA brackets four limit states of each motion to 5 %.
"""

import time
from collections.abc import Sequence

import numpy as np
from setting import plain_options
from timing import table

import archfem as af
from archfem.dynamics.solvers import newton

WAYS = {"general solver": lambda equation: None, "chains": newton.find_stone_tree}


def ring(damping: str | af.StiffnessDamping) -> af.Analysis:
    """Return the analysis of the ring with a damping."""
    stones = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
    settings = {"fidelity": "rigid", "displacements": "large", "damping": damping, "dt": 0.002}
    return af.Analysis(stones, **settings)


def measure(way: str, motions: Sequence[af.Motion], scales: Sequence[float]) -> tuple[float, float]:
    """Return processor time of an ensemble [s], and its displacements (motions, scales) [m]."""
    newton.find_stone_tree = WAYS[way]
    analysis = ring(af.StiffnessDamping(0.05, 8.0))
    af.ensemble(analysis, motions[:1], scales=(1e-3,))  # loads compiled code
    begun = time.process_time()
    found = af.ensemble(analysis, motions, scales=scales)
    return time.process_time() - begun, found.displacement.values


def measure_ida(motions: Sequence[af.Motion]) -> list[str]:
    """Return motions, runs, and processor times of a run and of a motion, of an IDA."""
    begun = time.process_time()
    found = af.ida(ring("effective"), motions, workers=1)
    seconds = time.process_time() - begun
    runs = int(np.isfinite(found.table["scale"].values).sum())
    times = f"{1e3 * seconds / runs:.0f}", f"{seconds / len(motions):.2f}"
    return [str(len(motions)), str(runs), *times]


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a line for each way."""
    parser = plain_options(__doc__)
    parser.add_argument("--records", type=int, default=8, help="number of motions")
    parser.add_argument("--scales", type=int, default=2, help="number of scales of each")
    chosen = parser.parse_args(arguments)
    duration, records = (0.5, 1) if chosen.quick else (8.0, chosen.records)
    motions = [
        af.Motion.synthetic(duration=duration, pga=6.0, seed=seed) for seed in range(records)
    ]
    scales = np.linspace(0.5, 1.0, chosen.scales)
    results = {way: measure(way, motions, scales) for way in WAYS}
    reference, count = results["general solver"], len(motions) * len(scales)
    rows = [
        [
            way,
            f"{count / seconds:.2f}",
            f"{reference[0] / seconds:.2f}",
            f"{np.nanmax(np.abs(moved - reference[1])):.1e}",
        ]
        for way, (seconds, moved) in results.items()
    ]
    print(table(["way", "histories/s", "times as fast", "difference [m]"], rows))
    print(table(["motions of IDA", "runs", "ms a run", "s a motion"], [measure_ida(motions)]))


if __name__ == "__main__":
    main()
