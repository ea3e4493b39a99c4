"""Falling blocks against LMGC90: semicircles of 27 voussoirs near their minimum thickness.

    python tests/benchmarks/falling.py [PYTHON]

PYTHON is an interpreter with compas_lmgc90, as prisms.py says; without it only archfem runs.
"""

from collections.abc import Sequence
from itertools import product

import numpy as np
from prisms import by_lmgc90
from setting import plain_options, print_left_out
from timing import stopwatch, table

import archfem as af

MINIMUM_THICKNESS = {0.31: 0.19600, 0.45: 0.10672}
"""Minimum thickness over radius by limit analysis, by friction [-]."""

DT = 1e-3
"""Time step [s]."""


def run_archfem(arch: af.Structure, steps: int) -> tuple[np.ndarray, float]:
    """Return displacements of the blocks at the end [m], and the time of a step [ms]."""
    falling = af.dynamics.RigidBlockSimulation(arch, dt=DT, level=-100.0)
    # A negligible acceleration keeps the run from ending when all blocks are at rest.
    ground = af.Motion(np.full(steps + 1, 1e-9), DT)
    start = af.dynamics.LooseBlocks.as_built(arch)
    falling.final_frame(start, 2.0 * DT, ground)  # compiles
    watch = stopwatch()
    end = falling.final_frame(start, steps * DT, ground)
    return end.poses[:, :2], 1e3 * watch()[0] / steps


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a line for each arch."""
    parser = plain_options(__doc__)
    parser.add_argument("python", nargs="?", help="interpreter with compas_lmgc90")
    chosen = parser.parse_args(arguments)
    if chosen.python is None:
        print_left_out("LMGC90, as no Python interpreter with compas_lmgc90 is given")
    frictions = [0.31] if chosen.quick else list(MINIMUM_THICKNESS)
    factors = [1.03] if chosen.quick else [0.97, 0.99, 1.01, 1.03]
    steps = 5 if chosen.quick else 1000
    head = ["friction", "t / minimum", "archfem [mm]", "step [ms]"]
    head += ["LMGC90 [mm]", "step [ms]", "difference [mm]"] if chosen.python else []
    rows = []
    for friction, factor in product(frictions, factors):
        arch = af.circular_arch(
            radius=5.0,
            thickness=5.0 * factor * MINIMUM_THICKNESS[friction],
            embrace=180.0,
            voussoirs=27,
            chords=1,
            contact=af.Contact(1e9, 1e9, friction),
        )
        own, own_step = run_archfem(arch, steps)
        row = [f"{friction:.2f}", f"{factor:.2f}", f"{1e3 * np.abs(own).max():.3f}"]
        row += [f"{own_step:.3f}"]
        if chosen.python:
            path, other_step = by_lmgc90(chosen.python, arch, friction, DT, steps)
            row += [f"{1e3 * np.abs(path[-1]).max():.3f}", f"{other_step:.2f}"]
            row += [f"{1e3 * np.abs(own - path[-1]).max():.3f}"]
        rows.append(row)
    print(table(head, rows))


if __name__ == "__main__":
    main()
