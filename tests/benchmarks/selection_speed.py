"""How long it takes to select 7 of 500 records, and how near the mean spectrum is.

    python tests/benchmarks/selection_speed.py [--count 500]

The records are synthetic, in PEER's format, 20 s at steps of 5 ms, filtered to bands of their own.
Each has an earthquake of its own day.
"""

import tempfile
import time
from collections.abc import Sequence
from datetime import date, timedelta
from pathlib import Path

from setting import plain_options
from timing import table

import archfem as af
from archfem.motion import SELECTION_RULES
from archfem.units import STANDARD_GRAVITY


def write_records(folder: Path, count: int, duration: float) -> None:
    """Write synthetic records of many peaks and bands."""
    for seed in range(count):
        motion = af.Motion.synthetic(
            duration=duration, seed=seed, pga=0.5 + 0.01 * (seed % 400), vertical_ratio=0.0
        )
        motion = motion.band_passed(0.3 + 0.1 * (seed % 7), 6.0 + 2.0 * (seed % 11))
        day = date(1970, 1, 1) + timedelta(days=seed)
        rows = "\n".join(f"{sample:.7f}" for sample in motion.horizontal / STANDARD_GRAVITY)
        head = f"PEER\nQuake, {day.month}/{day.day}/{day.year}, Station, 180\nUNITS OF G\n"
        text = f"{head}NPTS= {len(motion.horizontal)}, DT= {motion.dt:.4f} SEC\n{rows}\n"
        (folder / f"RSN{seed}_QUAKE_STA180.AT2").write_text(text)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print times and ratios by rule; a second selection reads no files."""
    parser = plain_options(__doc__)
    parser.add_argument("--count", type=int, default=500, help="how many records (500)")
    chosen = parser.parse_args(arguments)
    count, duration = (8, 2.0) if chosen.quick else (chosen.count, 20.0)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        write_records(Path(folder), count, duration)
        for rule in SELECTION_RULES:
            for attempt in ("first", "again"):
                begun = time.perf_counter()
                spectrum = af.Eurocode8(0.25, "B")
                try:
                    found = af.select_records(folder, spectrum, 0.4, rule=rule, scales=(0.2, 5.0))
                except af.DidNotConverge as error:
                    found = error.last
                low, high = found.bounds
                spent = f"{time.perf_counter() - begun:.1f}"
                bounds = [f"{low:.3f}", f"{high:.3f}", f"{found.shortfall:.3f}"]
                rows.append([rule, attempt, str(found.candidates), spent, *bounds])
    head = ["rule", "call", "records", "time [s]", "least ratio", "largest ratio", "missed by"]
    print(table(head, rows))


if __name__ == "__main__":
    main()
