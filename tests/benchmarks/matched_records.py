"""Match every component of every record of a folder to the spectrum of the case study.

    python tests/benchmarks/matched_records.py FOLDER_WITH_RECORDS

Prints misfit, drift, and PGA, Arias intensity and significant duration before and after.
"""

import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from setting import plain_options, print_left_out

import archfem as af
from archfem.motion.records.reader import read_channels
from archfem.units import STANDARD_GRAVITY


class VerticalSpectrum(af.Tbec2018):
    """The vertical design spectrum in place of the horizontal one."""

    def horizontal(self, periods):
        """Return the vertical spectrum."""
        return self.vertical(periods)


def channels(folder: Path) -> Iterator[tuple[af.Motion, bool]]:
    """Yield every component of the records in a folder, and whether it is vertical."""
    for path in sorted(path for path in folder.rglob("*") if path.suffix != ".md"):
        if not path.is_file():
            continue
        for channel in read_channels(path):
            name = f"{path.stem} {channel.direction}"
            yield af.Motion(channel.samples, channel.dt, name=name), channel.is_vertical


def match_row(motion: af.Motion, vertical: bool) -> str:
    """Match one component and write its line."""
    kind = VerticalSpectrum if vertical else af.Tbec2018
    begun = time.perf_counter()
    match = af.matched(motion, kind(ss=1.140, s1=0.315, site="ZD"))
    before, after = match.before["horizontal"], match.after["horizontal"]
    drift = abs(match.motion.displacement()[-1])
    return (
        f"{motion.name[-34:]:34s} {match.misfit['horizontal']:6.2%} {drift:8.1e} "
        f"{before.pga / STANDARD_GRAVITY:7.4f} {after.pga / STANDARD_GRAVITY:6.3f} "
        f"{before.arias:9.2e} {after.arias:6.2f} {after.pgd:6.3f} "
        f"{before.significant_duration:6.1f} {after.significant_duration:6.1f} "
        f"{time.perf_counter() - begun:5.1f}"
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a line for each component."""
    parser = plain_options(__doc__)
    parser.add_argument("folder", nargs="?", type=Path, help="with records")
    chosen = parser.parse_args(arguments)
    if chosen.quick:
        motions = [(af.Motion.synthetic(duration=5.0, dt=0.02, seed=1), False)]
    elif chosen.folder is None:
        print_left_out("no folder with records is given")
        return
    else:
        motions = channels(chosen.folder)
    print(
        f"{'component':34s} misfit drift[m]  pga[g]     ->  arias[m/s]  -> pgd[m] D5-95[s]  ->  s"
    )
    for motion, vertical in motions:
        print(match_row(motion, vertical), flush=True)


if __name__ == "__main__":
    main()
