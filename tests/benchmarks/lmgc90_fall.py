"""Lets prisms fall in LMGC90: `python lmgc90_fall.py BLOCKS.json OUT.npy`, by falling.py.

It runs under a Python of its own, with compas_lmgc90 and without archfem. OUT says how far the
centres of the prisms have moved (n, 3) [m], and the last line printed how long a step took [ms].
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
from compas_lmgc90.solver import Solver


def main(given: str, out: str) -> None:
    """Step through time.

    Args:
        given: path of the prisms, their friction, density, step and number of steps.
        out: path of the result.
    """
    told = json.loads(Path(given).read_text())
    solver = Solver(dt=told["dt"], theta=0.5, density=told["density"])
    solver.geometry_from_v_f(told["prisms"])
    solver.supports = told["fixed"]
    for number, fixed in enumerate(told["fixed"]):
        if fixed:
            solver.v_drvdof[number] = {freedom: np.zeros(6) for freedom in range(1, 7)}
    solver.contact_law("IQS_CLB", told["friction"])
    solver.preprocess()
    first = np.array([list(place) for place in solver.lmgc90.compute_one_step().bodies])
    start = time.perf_counter()
    for _ in range(told["steps"] - 1):
        result = solver.lmgc90.compute_one_step()
    took = (time.perf_counter() - start) / (told["steps"] - 1)
    np.save(out, np.array([list(place) for place in result.bodies]) - first)
    print(f"\n{1e3 * took}")


if __name__ == "__main__":
    main(*sys.argv[1:])
