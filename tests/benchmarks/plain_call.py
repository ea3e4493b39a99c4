"""`af.time_history(model, motion)` and nothing more, under real records: an answer to each?

    python tests/benchmarks/plain_call.py FOLDER [--duration 20]

The rigid validation ring, undamped, in steps that choose their length, under all horizontal records
in the folder and below: how each run ended, what it took, and what energy came from nowhere.
"""

import argparse
import logging
import time
from pathlib import Path

from energy_drift import motions
from setting import ring
from timing import table

import archfem as af
from archfem.dynamics.history import history_of

HEAD = ["record", "PGA [m/s²]", "the run", "steps", "CPU [s]", "drift", "tolerance unmet"]


def row(name: str, motion: af.Motion, model: af.models.Model) -> list[object]:
    """Run one record."""
    begun = time.process_time()
    try:
        run = af.time_history(model, motion)
    except af.DidNotConverge as error:
        run = history_of(error)
    told = run.dataset.attrs
    return [
        name,
        f"{motion.pga:.2f}",
        run.outcome[:60],
        told["steps"],
        f"{time.process_time() - begun:.1f}",
        f"{told['energy_drift']:.0e}",
        f"{told.get('tolerance_unmet', 0.0):.1%}",
    ]


def main(chosen: argparse.Namespace) -> None:
    """Run all of them, and print rows as they come."""
    logging.disable(logging.WARNING)
    model, rows = af.build(ring(), fidelity="rigid"), []
    for name, motion in motions(chosen.folder, chosen.duration):
        rows.append(row(name, motion, model))
        print(*rows[-1], sep=" | ", flush=True)
    print(f"\n{table(HEAD, rows)}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="with records, also in folders of its own")
    parser.add_argument("--duration", type=float, default=20.0, help="of each motion, at most [s]")
    main(parser.parse_args())
