"""Damaged record files of every format."""

from functools import cache
from pathlib import Path

import numpy as np

import archfem as af
from fuzz.damaged_records import SAMPLES, damaged
from fuzz.trial import Came, judged

FASTEST = 1e-4
"""No record is sampled faster [s]."""

PEAK = 50.0
"""No ground shakes harder [m/s²]."""


def ready() -> None:
    """Nothing is loaded late."""


@cache
def _samples() -> list[bytes]:
    return [sample.encode() for sample in SAMPLES.values()]


def trial(seed: int, number: int, folder: Path) -> Came:
    """Read one damaged file."""
    rng = np.random.default_rng((seed, number))
    content = _samples()[number % len(_samples())]
    for _ in range(rng.integers(1, 4)):
        content = damaged(content, rng)
    path = folder / "record.txt"
    path.write_bytes(content)

    def read() -> str | None:
        motion = af.Motion.read(path)
        if not FASTEST <= motion.dt <= 0.1:
            return f"step {motion.dt:g} s"
        for name in motion.components:
            samples = motion.component(name)
            if not np.abs(samples).max() < PEAK:  # neither are there any that are no numbers
                return f"peak {np.abs(samples).max():g} m/s²"
        return None

    return judged(read, repr(content))
