"""Lets prisms fall in LMGC90: `python lmgc90_fall.py BLOCKS.json OUT.npy`, by prisms.py.

It runs under a Python of its own, with compas_lmgc90 and without archfem. OUT says how far the
centres of the prisms have moved after each step (steps, n, 3) [m], and the last line printed how
long a step took [ms].
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
        given: path of the prisms, their friction, density, step and number of steps, and where
            the ground moves its times [s] and velocities to the right [m/s].
        out: path of the result.
    """
    told = json.loads(Path(given).read_text())
    solver = Solver(dt=told["dt"], theta=0.5, density=told["density"])
    solver.geometry_from_v_f(told["prisms"])
    solver.supports = told["fixed"]
    for number, fixed in enumerate(told["fixed"]):
        if fixed:
            solver.v_drvdof[number] = {freedom: np.zeros(6) for freedom in range(1, 7)}
            if "ground" in told:
                solver.apply_velocity(number, "Vx", np.array(told["ground"]))
    solver.contact_law("IQS_CLB", told["friction"])
    solver.preprocess()
    took, places = [], []
    for _ in range(told["steps"]):
        start = time.process_time()
        result = solver.lmgc90.compute_one_step()
        took.append(time.process_time() - start)
        places.append([list(place) for place in result.bodies])
    np.save(out, np.array(places) - places[0])
    print(f"\n{1e3 * np.mean(took[1:])}")


if __name__ == "__main__":
    main(*sys.argv[1:])
