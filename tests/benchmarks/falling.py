"""Falling blocks against LMGC90: semicircles of 27 voussoirs about their least thickness.

`python tests/benchmarks/falling.py PYTHON`, where PYTHON has what prisms.py says.
"""

import sys

import numpy as np
from prisms import by_lmgc90
from timing import stopwatch

import archfem as af

LEAST = {0.31: 0.19600, 0.45: 0.10672}
"""Friction, and least thickness over radius by limit analysis."""

DT, STEPS = 1e-3, 1000
BARELY = 1e-9
"""Acceleration of the ground [m/s²] that keeps a run from ending at rest."""


def by_archfem(arch) -> tuple[np.ndarray, float]:
    """The same, by archfem."""
    falling = af.dynamics.Falling(arch, dt=DT, level=-100.0)
    ground = af.Motion(np.full(STEPS + 1, BARELY), DT)
    start = af.dynamics.Loose.built(arch)
    falling.last(start, 10.0 * DT, ground)  # compiles
    watch = stopwatch()
    end = falling.last(start, STEPS * DT, ground)
    return end.poses[:, :2], 1e3 * watch()[0] / STEPS


def main(python: str) -> None:
    """Print a line for each arch.

    Args:
        python: that has compas_lmgc90.
    """
    print("friction  t / least  largest displacement [mm]  apart [mm]  step [ms]")
    print("                       archfem     LMGC90                 archfem  LMGC90")
    for friction, least in LEAST.items():
        contact = af.Contact(1e9, 1e9, friction)
        for factor in (0.97, 0.99, 1.01, 1.03):
            arch = af.circular_arch(
                radius=5.0,
                thickness=5.0 * factor * least,
                embrace=180.0,
                voussoirs=27,
                chords=1,
                contact=contact,
            )
            ours, mine = by_archfem(arch)
            path, yours = by_lmgc90(python, arch, friction, DT, STEPS)
            theirs = path[-1]
            moved = [1e3 * np.abs(each).max() for each in (ours, theirs, ours - theirs)]
            print(
                f"{friction:8.2f} {factor:10.2f} {moved[0]:12.3f} {moved[1]:10.3f} "
                f"{moved[2]:10.3f} {mine:10.3f} {yours:7.2f}"
            )


if __name__ == "__main__":
    main(sys.argv[1])
