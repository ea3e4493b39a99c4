"""Match every component of every record of a folder to the spectrum of the case study.

    python tests/benchmarks/matched_records.py FOLDER_WITH_RECORDS

Prints misfit, drift, and peak, Arias intensity and significant duration before and after.
"""

import sys
import time
from pathlib import Path

from archfem.motion.design_spectra import Tbec2018
from archfem.motion.matching import matched
from archfem.motion.motion import Motion
from archfem.motion.records.read import read_channels
from archfem.units import STANDARD_GRAVITY


class Upright(Tbec2018):
    """The vertical spectrum in the place of the horizontal."""

    def horizontal(self, periods):
        return self.vertical(periods)


def rows(folder):
    """Yield a line of results for every component."""
    for path in sorted(path for path in folder.rglob("*") if path.suffix != ".md"):
        if not path.is_file():
            continue
        for channel in read_channels(path):
            kind = Upright if channel.is_vertical else Tbec2018
            motion = Motion(channel.samples, channel.dt, name=f"{path.stem} {channel.direction}")
            begun = time.perf_counter()
            match = matched(motion, kind(ss=1.140, s1=0.315, site="ZD"))
            before, after = match.before["horizontal"], match.after["horizontal"]
            drift = abs(match.motion.displacement()[-1])
            yield (
                f"{motion.name[-34:]:34s} {match.misfit['horizontal']:6.2%} {drift:8.1e} "
                f"{before.pga / STANDARD_GRAVITY:7.4f} {after.pga / STANDARD_GRAVITY:6.3f} "
                f"{before.arias:9.2e} {after.arias:6.2f} {after.pgd:6.3f} "
                f"{before.significant_duration:6.1f} {after.significant_duration:6.1f} "
                f"{time.perf_counter() - begun:5.1f}"
            )


if __name__ == "__main__":
    print(
        f"{'component':34s} misfit drift[m]  pga[g]     ->  arias[m/s]  -> pgd[m] D5-95[s]  ->  s"
    )
    for row in rows(Path(sys.argv[1])):
        print(row, flush=True)
