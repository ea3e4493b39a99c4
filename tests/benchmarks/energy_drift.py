"""Drift of energy of undamped rings whose displacements are large, under real records.

    python tests/benchmarks/energy_drift.py FOLDER [--duration 20] [--dt 0.005 0.0025]

Every horizontal record in the folder and below shakes the validation ring, with joints that slide
at 0.60 and that never do, without any damping. The drift is relative to the largest energy that was
exchanged or lost; a ring that falls is followed until its blocks part.
"""

import argparse
import logging
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from setting import ring
from timing import table

import archfem as af

SAID = 1e-6
"""Drift that is promised, for steps of 5 ms and less."""

VERTICAL = ("UP.", "DWN.", "HNZ.", ".UD")
"""What names of vertical components have in them."""

PLAIN = {"erzikan.txt": [{"column": k, "units": "cm/s2", "dt": 0.005} for k in (1, 2)]}
"""What plain files of several columns do not say of themselves."""


def motions(folder: Path, duration: float) -> list[tuple[str, af.Motion]]:
    """Read the beginning of every horizontal record that can be read without doubt."""
    found = []
    for path in sorted(each for each in folder.rglob("*") if each.is_file()):
        if path.suffix == ".md" or any(word in path.name.upper() for word in VERTICAL):
            continue
        for told in PLAIN.get(path.name, [{}]):
            try:
                motion = af.Motion.read(path, **told)
            except af.ArchfemError as error:
                print(f"{path.name} left out: {str(error)[:100]}")
                continue
            name = " ".join([path.name, *map(str, told.values())][:2])
            found.append((name, motion.cut(0.0, min(duration, motion.duration))))
    return found


def rubbing(friction: float | None) -> af.Structure:
    """The validation ring with one coefficient of friction in all joints."""
    bare = ring()
    joints = [replace(j, contact=replace(j.contact, friction=friction)) for j in bare.joints]
    return replace(bare, joints=tuple(joints))


def drifts(motion: af.Motion, dt: float) -> tuple[list[object], float]:
    """How a ring with friction and one without came through, and the larger drift."""
    told, worst = [], 0.0
    for friction in (0.6, None):
        model = af.build(rubbing(friction), fidelity="rigid", displacements="large")
        begun = time.process_time()
        try:
            run = af.time_history(model, motion, dt=dt)
        except af.errors.DidNotConverge as error:
            if error.history is None:
                return [*told, str(error)[:60]], np.inf
            run = error.history
        spent, about = 1e3 * (time.process_time() - begun), run.dataset.attrs
        drift = float(about["energy_drift"])
        worst = max(worst, abs(drift))
        turned = 1e3 * float(np.abs(run.joints["rotation"]).max())
        told += [f"{drift:.1e}", f"{turned:.1f}", about["halved_steps"], run.fall.kind]
        told += [f"{spent / about['steps']:.3f}"]
    return told, worst


def main() -> None:
    """Print a table a step size, and the worst."""
    made = argparse.ArgumentParser(description=__doc__)
    made.add_argument("folder", type=Path)
    made.add_argument("--duration", type=float, default=20.0)
    made.add_argument("--dt", type=float, nargs="+", default=[0.005, 0.0025])
    asked = made.parse_args()
    logging.getLogger("archfem").setLevel(logging.ERROR)
    shaken = motions(asked.folder, asked.duration)
    about = ["drift", "turn mrad", "halved", "it", "ms/step"]
    head = ["record", *(f"{each}, {kind}" for kind in ("0.6", "none") for each in about)]
    for dt in asked.dt:
        found = [(name, *drifts(motion, dt)) for name, motion in shaken]
        print(f"\nΔt = {1e3 * dt:g} ms\n{table(head, [[name, *told] for name, told, _ in found])}")
        largest = max(each for *_, each in found)
        print(f"largest drift {largest:.1e}, promised {SAID:g}", flush=True)


if __name__ == "__main__":
    main()
