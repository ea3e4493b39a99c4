"""Run the hard cases and print their table; the exit status says whether all are as they should."""

import argparse
import sys
from multiprocessing import get_context
from pathlib import Path

from hard.setting import HEAD
from hard.table import CASES, row


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="run cases whose name contains this")
    parser.add_argument("--jobs", type=int, default=2, help="cases run at a time")
    parser.add_argument("--out", type=Path, help="file that the table is written to as well")
    given = parser.parse_args()
    chosen = [number for number, case in enumerate(CASES) if given.only in case.name]
    lines = [f"| {' | '.join(HEAD)} |", "|" + "---|" * len(HEAD)]
    print("\n".join(lines), flush=True)
    wrong = 0
    with get_context("spawn").Pool(given.jobs) as pool:
        for cells, right in pool.imap(row, chosen):
            lines.append(f"| {' | '.join(cells)} |")
            print(lines[-1], flush=True)
            wrong += not right
    if given.out:
        given.out.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print(f"\n{len(chosen) - wrong} of {len(chosen)} cases are as they should be")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
