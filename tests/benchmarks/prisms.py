"""Scenes given to LMGC90, whose Python has compas_lmgc90 (0.1.11 was tried):

    python -m venv lmgc90 && lmgc90/bin/pip install compas_lmgc90

LMGC90 steps prisms of the same outline, a metre deep, in three dimensions, by the scheme of Moreau
and Jean.
"""

import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np

import archfem as af


def prism(block: af.Block) -> dict:
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


def by_lmgc90(
    python: str,
    arch: af.Structure,
    friction: float,
    dt: float,
    steps: int,
    ground: tuple[np.ndarray, np.ndarray] | None = None,
    tolerance: float | None = None,
) -> tuple[np.ndarray, float]:
    """Step an arch in LMGC90.

    Args:
        python: that has compas_lmgc90.
        arch: of convex blocks.
        friction: coefficient between all blocks.
        dt: time step [s].
        steps: how many.
        ground: times [s] and velocities to the right [m/s] of the fixed blocks.
        tolerance: of the impulses; None for the usual one, 1.666e-4.

    Returns:
        How far each block has moved after each step (steps, n, 2) [m], and the processor time of a
        step [ms].
    """
    settings = {
        "prisms": [prism(block) for block in arch.blocks],
        "fixed": [block.fixed for block in arch.blocks],
        "friction": friction,
        "density": arch.density(arch.blocks[1]),
        "dt": dt,
        "steps": steps,
    }
    if ground is not None:
        settings["ground"] = [each.tolist() for each in ground]
    if tolerance is not None:
        settings["tolerance"] = tolerance
    with tempfile.TemporaryDirectory() as folder:
        given, out = Path(folder) / "blocks.json", Path(folder) / "moved.npy"
        given.write_text(json.dumps(settings))
        script = Path(__file__).with_name("lmgc90_fall.py")
        ran = subprocess.run(
            [python, str(script), str(given), str(out)],
            check=True,
            capture_output=True,
            text=True,
            cwd=folder,
        )
        return np.load(out)[:, :, [0, 2]], float(ran.stdout.split()[-1])
