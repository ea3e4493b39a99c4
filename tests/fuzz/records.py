"""Damaged record files of every format."""

from functools import cache
from pathlib import Path

import numpy as np

from archfem.motion.records.read import read_channels
from fuzz.damaged_records import SAMPLES, damaged
from fuzz.trial import Came, judged

FASTEST = 1e-4
"""No record is sampled faster [s]."""

PEAK = 1e4
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
        for channel in read_channels(path):
            if not np.isfinite(channel.samples).all():
                return "samples that are no numbers"
            if not FASTEST <= channel.dt <= 0.1:
                return f"step {channel.dt:g} s"
            if np.abs(channel.samples).max() > PEAK:
                return f"peak {np.abs(channel.samples).max():g} m/s²"
        return None

    return judged(read, repr(content))
