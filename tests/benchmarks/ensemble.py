"""Histories per second and core of an ensemble, beside the general solver of large displacements.

    python tests/benchmarks/ensemble.py [--records 8 --scales 2]

The ring of the README under synthetic motions of 8 s in steps of 2 ms. Both ways run in turn in one
process; times are of the processor. Largest differences of the displacements of a corner are
beside them.
"""

import time
from collections.abc import Sequence

import numpy as np
from setting import plain_options
from timing import table

import archfem as af
from archfem.dynamics.solvers import newton

WAYS = {"general solver": lambda equation: None, "chains": newton.find_stone_tree}


def measure(way: str, motions: Sequence[af.Motion], scales: Sequence[float]) -> tuple[float, float]:
    """Return processor time of an ensemble [s], and its displacements (motions, scales) [m]."""
    newton.find_stone_tree = WAYS[way]
    ring = af.circular_arch(radius=2.95, thickness=0.55, embrace=159.0, voussoirs=17)
    damping = af.StiffnessDamping(0.05, 8.0)
    settings = {"fidelity": "rigid", "displacements": "large", "damping": damping, "dt": 0.002}
    analysis = af.Analysis(ring, **settings)
    af.ensemble(analysis, motions[:1], scales=(1e-3,))  # loads compiled code
    begun = time.process_time()
    found = af.ensemble(analysis, motions, scales=scales)
    return time.process_time() - begun, found.displacement.values


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


if __name__ == "__main__":
    main()
