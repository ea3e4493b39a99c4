"""Time a response spectrum of 200 periods on a motion of 60 s at 200 Hz.

python tests/benchmarks/spectrum_speed.py
"""

import time

import numpy as np

from archfem.motion.motion import Motion
from archfem.motion.spectra import response_spectrum

if __name__ == "__main__":
    motion = Motion.synthetic(duration=60.0, seed=1)
    periods = np.geomspace(0.02, 4.0, 200)
    times = []
    for _ in range(7):
        begun = time.perf_counter()
        response_spectrum(motion, periods)
        times.append(time.perf_counter() - begun)
    print(f"200 periods, 12001 samples: {1e3 * min(times):.0f} ms (best of {len(times)})")
