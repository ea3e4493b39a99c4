"""A plain `af.time_history(model, motion)` under records: does every run end with a result?

    python tests/benchmarks/plain_call.py [FOLDER] [--duration 20]

The rigid validation ring, undamped, with adaptive steps, under all horizontal records in the folder
and below: outcome of each run, its processor time, and its energy drift.
"""

import logging
import time
from collections.abc import Sequence
from pathlib import Path

from energy_drift import motions
from scenes import ring
from setting import plain_options, quick_motion
from timing import table

import archfem as af

HEAD = ["record", "PGA [m/s²]", "the run", "steps", "CPU [s]", "drift", "tolerance unmet"]


def row(name: str, motion: af.Motion, model: af.models.Model) -> list[object]:
    """Run one record."""
    begun = time.process_time()
    try:
        run = af.time_history(model, motion)
    except af.DidNotConverge as error:
        run = af.dynamics.partial_history(error)
    attrs = run.dataset.attrs
    return [
        name,
        f"{motion.pga:.2f}",
        run.outcome[:60],
        attrs["steps"],
        f"{time.process_time() - begun:.1f}",
        f"{attrs['energy_drift']:.0e}",
        f"{attrs.get('tolerance_unmet', 0.0):.1%}",
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run all records, and print each row when it is ready."""
    parser = plain_options(__doc__)
    parser.add_argument("folder", type=Path, nargs="?", help="with records; default: synthetic")
    parser.add_argument("--duration", type=float, default=20.0, help="of each motion, at most [s]")
    chosen = parser.parse_args(arguments)
    logging.disable(logging.WARNING)
    model, rows = af.build(ring(), fidelity="rigid"), []
    shaking = (
        [("quick", quick_motion(1.6))] if chosen.quick else motions(chosen.folder, chosen.duration)
    )
    for name, motion in shaking:
        rows.append(row(name, motion, model))
        print(*rows[-1], sep=" | ", flush=True)
    print(f"\n{table(HEAD, rows)}")


if __name__ == "__main__":
    main()
