"""Carry out campaigns and print their table; the exit status says whether all ended well.

    python -m fuzz [--count 100] [--seed 0] [--only case_files] [--trials 17,18]

Without a count each campaign has its own, some ten minutes in all. What ended badly is kept under
--out, with what was tried; `--only … --trials NUMBER` does it again.
"""

import argparse
import resource
import sys
from collections import Counter
from pathlib import Path

from fuzz.staff import carried_out
from fuzz.trial import BAD, KINDS, Came

COUNTS = {"case_files": 10_000, "records": 10_000, "drawings": 30_000, "calls": 2000, "shakes": 500}
"""Campaigns, and their default number of trials."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=COUNTS, action="append", help="campaigns")
    parser.add_argument("--count", type=int, help="trials of each campaign")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--trials", help="numbers of single trials, which are printed")
    parser.add_argument("--out", type=Path, default=Path("out/fuzz"), help="keeps what ended badly")
    given = parser.parse_args()
    single = [int(number) for number in given.trials.split(",")] if given.trials else None
    lines = [f"{'campaign':12} {'tried':>7} " + " ".join(f"{k:>9}" for k in KINDS) + "   CPU [s]"]
    bad = 0
    for name in given.only or COUNTS:
        numbers = single or range(given.count or COUNTS[name])
        tally, before = Counter[str](), _spent()
        for number, came in carried_out(name, given.seed, numbers):
            tally[came.kind] += 1
            if came.kind in BAD or single:
                print(f"{name} {number}: {came.kind}: {came.words}", flush=True)
                print(came.input if single else "", end="\n" if single else "", flush=True)
            if came.kind in BAD:
                _kept(given.out, f"{name}-{given.seed}-{number}", came)
        bad += sum(tally[kind] for kind in BAD)
        counts = " ".join(f"{tally[kind]:9}" for kind in KINDS)
        lines.append(f"{name:12} {tally.total():7} {counts} {_spent() - before:9.0f}")
    print("\n".join(lines))
    return int(bad > 0)


def _spent() -> float:
    """CPU time of the processes that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _kept(folder: Path, name: str, came: Came) -> None:
    """Keep a trial that ended badly."""
    folder.mkdir(parents=True, exist_ok=True)
    text = f"{came.kind}: {came.words}\n\n{came.input}"
    (folder / f"{name}.txt").write_text(text, encoding="utf-8", errors="backslashreplace")


if __name__ == "__main__":
    sys.exit(main())
