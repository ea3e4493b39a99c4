"""Falling blocks against LMGC90: semicircles of 27 voussoirs about their least thickness.

`python tests/benchmarks/falling.py PYTHON`, where PYTHON has compas_lmgc90 (0.1.11 was tried):

    python -m venv lmgc90 && lmgc90/bin/pip install compas_lmgc90

LMGC90 steps prisms of the same outline, a metre deep, in three dimensions, by the same scheme.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from timing import stopwatch

import archfem as af

LEAST = {0.31: 0.19600, 0.45: 0.10672}
"""Friction, and least thickness over radius by limit analysis."""

DT, STEPS = 1e-3, 1000
BARELY = 1e-9
"""Acceleration of the ground [m/s²] that keeps a run from ending at rest."""


def prism(block) -> dict:
    """A block a metre deep, x to the right, y away and z up."""
    n = len(block.points)
    return {
        "vertices": [(x, y, z) for y in (0.0, 1.0) for x, z in block.points.tolist()],
        "faces": [
            list(range(n)),
            [n + k for k in reversed(range(n))],
            *([(k + 1) % n, k, n + k, n + (k + 1) % n] for k in range(n)),
        ],
    }


def by_lmgc90(python: str, arch, friction: float) -> tuple[np.ndarray, float]:
    """How far each block has moved (n, 2) [m], and the time of a step [ms]."""
    told = {
        "prisms": [prism(block) for block in arch.blocks],
        "fixed": [block.fixed for block in arch.blocks],
        "friction": friction,
        "density": arch.density(arch.blocks[1]),
        "dt": DT,
        "steps": STEPS,
    }
    with tempfile.TemporaryDirectory() as folder:
        given, out = Path(folder) / "blocks.json", Path(folder) / "moved.npy"
        given.write_text(json.dumps(told))
        script = Path(__file__).with_name("lmgc90_fall.py")
        ran = subprocess.run(
            [python, str(script), str(given), str(out)],
            check=True,
            capture_output=True,
            text=True,
            cwd=folder,
        )
        return np.load(out)[:, [0, 2]], float(ran.stdout.split()[-1])


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
            (ours, mine), (theirs, yours) = by_archfem(arch), by_lmgc90(python, arch, friction)
            moved = [1e3 * np.abs(each).max() for each in (ours, theirs, ours - theirs)]
            print(
                f"{friction:8.2f} {factor:10.2f} {moved[0]:12.3f} {moved[1]:10.3f} "
                f"{moved[2]:10.3f} {mine:10.3f} {yours:7.2f}"
            )


if __name__ == "__main__":
    main(sys.argv[1])
