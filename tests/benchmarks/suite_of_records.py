"""The suite of the case study: six horizontal and three vertical records, matched.

    python tests/benchmarks/suite_of_records.py FOLDER_WITH_RECORDS [FOLDER_FOR_PICTURES]

Matches the pairs to the spectrum of TBEC-2018 (S_S 1.140, S_1 0.315, class ZD). Prints misfit and
drift of each component, with PGA, Arias intensity and significant duration before and after, and
the difference between mean and target. Saves the accelerograms (figure 8 of the paper) and the
spectra against their target (figure 9) to the second folder, by default out/suite.
"""

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from setting import plain_options, print_left_out

import archfem as af
from archfem.cases.result_text import tabulate_matches
from archfem.units import STANDARD_GRAVITY
from archfem.view import draw_suite, save
from archfem.view.style import Colour, Size, style_axes

TARGET = af.Tbec2018(ss=1.140, s1=0.315, site="ZD")
STEP = 0.005  # s, that of most of the records

# Each vertical goes with the two horizontals of its own station.
STATIONS = {
    "Duzce": "RSN1158_KOCAELI_DZC",
    "El Centro": "RSN6_IMPVALL.I_I-ELC",
    "Tolmezzo": "RSN125_FRIULI.A_A-TMZ",
}
DIRECTIONS = {"Duzce": ("180", "270"), "El Centro": ("180", "270"), "Tolmezzo": ("000", "270")}


def records(folder):
    """Read the six pairs, each under the name of its station and direction."""
    for station, stem in STATIONS.items():
        upright = af.Motion.read(folder / f"{stem}-UP.AT2").resampled(STEP)
        for direction in DIRECTIONS[station]:
            level = af.Motion.read(folder / f"{stem}{direction}.AT2").resampled(STEP)
            yield replace(level.with_vertical(upright), name=f"{station} {direction}")


def draw_accelerograms(suite):
    """Draw the matched accelerograms, divided by R: six horizontals, three verticals."""
    figure = Figure(figsize=(1.5 * Size.COLUMN, 9.0), layout="constrained")
    axes = figure.subplots(5, 2, sharex=True)
    motions = suite.motions
    panels = [(motion, "horizontal") for motion in motions]
    panels += [(motion, "vertical") for motion in motions[::2]]
    for axis, (motion, component) in zip(axes.flat, panels, strict=False):
        values = motion.component(component) / STANDARD_GRAVITY
        axis.plot(motion.times(component), values, Colour.LINES[component == "vertical"], lw=0.5)
        name = motion.name if component == "horizontal" else motion.name.rpartition(" ")[0]
        axis.set_title(f"{name}, {component}", fontsize=Size.TITLE)
        style_axes(axis, "", "acceleration [g]")
        top = values[np.argmax(np.abs(values))]
        axis.text(
            0.98, 0.9, f"{top:.3f} g", transform=axis.transAxes, ha="right", fontsize=Size.LABEL
        )
        axis.set_ylim(-0.25, 0.25)
    axes[-1, -1].set_visible(False)
    for axis in (axes[-1, 0], axes[-2, 1]):
        axis.set_xlabel("time [s]", fontsize=Size.LABEL)
        axis.tick_params(labelbottom=True)
    return figure


def mean_difference(suite, component):
    """Return root mean square, smallest and largest of mean/target - 1 from 0.05 to 2 s."""
    periods = np.geomspace(0.05, 2.0, 150)
    mean = suite.spectra(periods, component=component).mean(axis=0) / STANDARD_GRAVITY
    apart = mean / getattr(TARGET, component)(periods) - 1.0
    return np.sqrt(np.mean(apart**2)), apart.min(), apart.max()


def main(arguments: Sequence[str] | None = None) -> None:
    """Match, print and draw."""
    parser = plain_options(__doc__)
    parser.add_argument("folder", nargs="?", type=Path, help="with records")
    parser.add_argument("pictures", nargs="?", type=Path, default=Path("out/suite"))
    chosen = parser.parse_args(arguments)
    if chosen.folder is None:
        print_left_out("no folder with records is given")
        return
    nested = chosen.folder / "peer_at2"
    begun = time.perf_counter()
    motions = tuple(records(nested if nested.is_dir() else chosen.folder))
    suite = af.Suite("TBEC-2018, class ZD", motions, reduction=3.0).matched(TARGET)
    print(tabulate_matches(suite.matches).text)
    print(f"matched in {time.perf_counter() - begun:.1f} s; before the reduction R = 3")
    for component in ("horizontal", "vertical"):
        rms, least, most = mean_difference(suite, component)
        print(f"mean of {component} against target: rms {rms:.2%}, {least:+.1%} to {most:+.1%}")
    print(f"wrote {save(draw_accelerograms(suite), chosen.pictures / 'accelerograms.png')}")
    print(f"wrote {save(draw_suite(suite, TARGET), chosen.pictures / 'spectra.png')}")


if __name__ == "__main__":
    main()
