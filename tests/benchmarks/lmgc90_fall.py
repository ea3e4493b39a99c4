"""Lets prisms fall in LMGC90: `python lmgc90_fall.py BLOCKS.json OUT.npy`, by prisms.py.

It runs under a Python of its own, with compas_lmgc90 and without archfem. OUT says how far the
centres of the prisms have moved after each step (steps, n, 3) [m], and the last line printed how
long a step took [ms].
"""

import ctypes
import json
import sys
import time
from pathlib import Path

import compas_lmgc90._lmgc90
import numpy as np
from compas_lmgc90.solver import Solver

TOLERANCE = np.float64(np.float32(1.666e-4))
"""Of LMGC90's impulses as compiled, to which compas_lmgc90 gives no access."""


def set_tolerance(tolerance: float) -> None:
    """Overwrite the tolerance of the impulses in the memory of the loaded program."""
    library = compas_lmgc90._lmgc90.__file__
    # Data that may be written: the only copies of the file's bytes in which the value may change.
    lines = Path("/proc/self/maps").read_text().splitlines()
    ours = [line.split() for line in lines if line.endswith(library)]
    found = []
    for bounds in (words[0] for words in ours if words[1].startswith("rw")):
        start, end = (int(bound, 16) for bound in bounds.split("-"))
        data = ctypes.string_at(start, end - start)
        place = data.find(TOLERANCE.tobytes())
        found += [start + place] if place >= 0 else []
    if len(found) != 1:
        raise RuntimeError(f"the tolerance was found {len(found)} times: is it version 0.1.11?")
    ctypes.c_double.from_address(found[0]).value = tolerance


def main(given: str, out: str) -> None:
    """Step through time.

    Args:
        given: path of the prisms, their friction, density, step and number of steps, and where
            the ground moves its times [s] and velocities to the right [m/s]; the tolerance of the
            impulses where it is not the usual one.
        out: path of the result.
    """
    settings = json.loads(Path(given).read_text())
    if "tolerance" in settings:
        set_tolerance(settings["tolerance"])
    solver = Solver(dt=settings["dt"], theta=0.5, density=settings["density"])
    solver.geometry_from_v_f(settings["prisms"])
    solver.supports = settings["fixed"]
    for number, fixed in enumerate(settings["fixed"]):
        if fixed:
            solver.v_drvdof[number] = {freedom: np.zeros(6) for freedom in range(1, 7)}
            if "ground" in settings:
                solver.apply_velocity(number, "Vx", np.array(settings["ground"]))
    solver.contact_law("IQS_CLB", settings["friction"])
    solver.preprocess()
    took, places = [], []
    for _ in range(settings["steps"]):
        start = time.process_time()
        result = solver.lmgc90.compute_one_step()
        took.append(time.process_time() - start)
        places.append([list(place) for place in result.bodies])
    np.save(out, np.array(places) - places[0])
    print(f"\n{1e3 * np.mean(took[1:])}")


if __name__ == "__main__":
    main(*sys.argv[1:])
