"""Time a response spectrum of 200 periods on a motion of 60 s at 200 Hz.

python tests/benchmarks/spectrum_speed.py
"""

import time
from collections.abc import Sequence

import numpy as np
from setting import plain_options

import archfem as af


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the least time of some repetitions."""
    quick = plain_options(__doc__).parse_args(arguments).quick
    motion = af.Motion.synthetic(duration=2.0 if quick else 60.0, seed=1)
    periods = np.geomspace(0.02, 4.0, 200)
    times = []
    for _ in range(1 if quick else 7):
        begun = time.perf_counter()
        af.response_spectrum(motion, periods)
        times.append(time.perf_counter() - begun)
    samples = len(motion.horizontal)
    print(f"200 periods, {samples} samples: {1e3 * min(times):.0f} ms (best of {len(times)})")


if __name__ == "__main__":
    main()
