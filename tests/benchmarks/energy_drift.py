"""Energy drift of undamped rings with large displacements, under records.

    python tests/benchmarks/energy_drift.py [FOLDER] [--duration 20] [--dt 0.005 0.0025]

Every horizontal record in the folder and below shakes the undamped validation ring, with a friction
of 0.60 and with joints that never slide. The drift is relative to the largest energy exchanged or
lost. A ring that collapses is computed until its blocks separate.
"""

import logging
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scenes import ring, with_friction
from setting import plain_options, quick_motion
from timing import table

import archfem as af

DRIFT_LIMIT = 1e-6
"""Documented limit of the drift, for steps of 5 ms and less [-]."""

VERTICAL = ("UP.", "DWN.", "HNZ.", ".UD")
"""Parts of the names of vertical components."""

PLAIN = {"erzikan.txt": [{"column": k, "units": "cm/s2", "dt": 0.005} for k in (1, 2)]}
"""Columns, units and time step of plain files, which do not state them."""


def motions(folder: Path | None, duration: float) -> list[tuple[str, af.Motion]]:
    """Read the beginning of every horizontal record of a folder; without one make a motion."""
    if folder is None:
        return [("synthetic", af.Motion.synthetic(duration=duration, pga=3.0, seed=3))]
    found = []
    for path in sorted(each for each in folder.rglob("*") if each.is_file()):
        if path.suffix == ".md" or any(word in path.name.upper() for word in VERTICAL):
            continue
        for keywords in PLAIN.get(path.name, [{}]):
            try:
                motion = af.Motion.read(path, **keywords)
            except af.ArchfemError as error:
                print(f"{path.name} left out: {str(error)[:100]}")
                continue
            name = " ".join([path.name, *map(str, keywords.values())][:2])
            found.append((name, motion.cut(0.0, min(duration, motion.duration))))
    return found


def drifts(motion: af.Motion, dt: float) -> tuple[list[object], float]:
    """Run a ring with friction and one without; return table cells and the larger drift."""
    cells, worst = [], 0.0
    for friction in (0.6, None):
        model = af.build(with_friction(ring(), friction), fidelity="rigid", displacements="large")
        begun = time.process_time()
        try:
            run = af.time_history(model, motion, dt=dt)
        except af.errors.DidNotConverge as error:
            if error.history is None:
                return [*cells, str(error)[:60]], np.inf
            run = error.history
        spent, about = 1e3 * (time.process_time() - begun), run.dataset.attrs
        drift = float(about["energy_drift"])
        worst = max(worst, abs(drift))
        turned = 1e3 * float(np.abs(run.joints["rotation"]).max())
        cells += [f"{drift:.1e}", f"{turned:.1f}", about["halved_steps"], run.fall.kind]
        cells += [f"{spent / about['steps']:.3f}"]
    return cells, worst


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table a step size, and the worst."""
    made = plain_options(__doc__)
    made.add_argument("folder", type=Path, nargs="?", help="with records; default: synthetic")
    made.add_argument("--duration", type=float, default=20.0)
    made.add_argument("--dt", type=float, nargs="+", default=[0.005, 0.0025])
    chosen = made.parse_args(arguments)
    logging.getLogger("archfem").setLevel(logging.ERROR)
    shaken = (
        [("quick", quick_motion(3.0))] if chosen.quick else motions(chosen.folder, chosen.duration)
    )
    about = ["drift", "turn mrad", "halved", "it", "ms/step"]
    head = ["record", *(f"{each}, {kind}" for kind in ("0.6", "none") for each in about)]
    for dt in chosen.dt:
        found = [(name, *drifts(motion, dt)) for name, motion in shaken]
        print(
            f"\nΔt = {1e3 * dt:g} ms\n{table(head, [[name, *cells] for name, cells, _ in found])}"
        )
        largest = max(each for *_, each in found)
        print(f"largest drift {largest:.1e}, documented limit {DRIFT_LIMIT:g}", flush=True)


if __name__ == "__main__":
    main()
