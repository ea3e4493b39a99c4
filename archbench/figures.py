"""Figures of the bench from its stored answers: `python -m archbench.figures`."""

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from archbench.scene import read_references
from archbench.table import PROGRAMS, ROOT, Row, rows
from archfem.view.style import Colour, Size

FOLDER = ROOT / "docs" / "figures"

# Names as the programs write them
NAMES = dict(
    zip(PROGRAMS, ("archfem", "HybriDFEM", "LMGC90", "OpenSees", "rbe", "Siconos"), strict=True)
)
COLOURS = dict(zip(PROGRAMS, Colour.LINES, strict=True))
MARKERS = dict(zip(PROGRAMS, "oP^sDv", strict=True))
DASHES = dict(zip(PROGRAMS, ("-", "-.", "--", ":", "-", "--"), strict=True))


WIDTH = Size.PAGE
"""Width of a figure, at which type is printed as it is [inch]."""


def measured(found: list[Row]) -> Figure:
    """Draw answers over measured values, with the uncertainty of each as a bar."""
    shown = [row for row in found if row.kind == "E"]
    figure = Figure(figsize=(WIDTH, 0.29 * len(shown) + 1.2), layout="constrained")
    axes: Axes = figure.subplots()
    labels = []
    for place, row in enumerate(shown):
        middle, half = row.reference
        memory = row.grade == "m"
        name = "" if place else "uncertainty of the measured value"
        start = 1 - half / middle
        axes.barh(place, 2 * half / middle, left=start, color="0.85", height=0.6, label=name)
        title = row.title.split(",")[0].removeprefix("free rocking: ")
        mark = " (from memory)" if memory else " (lengths from memory)" if row.from_memory else ""
        labels.append(title + mark)
        answered = [name for name in PROGRAMS if row.numbers(name)]
        for step, name in enumerate(answered):
            numbers = np.array(row.numbers(name)) / middle
            at = place + 0.22 * (step - 0.5 * (len(answered) - 1))
            axes.plot([numbers.min(), numbers.max()], [at, at], color=COLOURS[name], lw=1.5)
            face = "none" if memory else COLOURS[name]
            axes.plot(numbers[0], at, MARKERS[name], color=COLOURS[name], mfc=face, ms=6)
        if not answered:
            axes.text(1.0, place, "cannot", ha="center", va="center", fontsize=7, color="0.4")
    axes.axvline(1.0, color="k", lw=0.8)
    axes.set_xscale("log")
    ticks = [0.2, 0.3, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0]
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.set_xticks([], minor=True)
    axes.set_yticks(range(len(shown)), labels)
    axes.invert_yaxis()
    axes.set_xlabel("answer over measured value")
    names = [name for name in PROGRAMS if any(row.numbers(name) for row in shown)]
    for name in names:
        axes.plot([], [], MARKERS[name], color=COLOURS[name], label=NAMES[name])
    figure.legend(loc="outside upper center", ncols=len(names) + 1, frameon=False)
    return figure


def first_run(row: Row, program: str, variant: str | None = None) -> dict[str, Any] | None:
    """Return the first run of a program that succeeded, or that of a variant."""
    for run in row.answers.get(program, {}).get("runs", []):
        if "failed" not in run and run["settings"].get("variant") == variant:
            return run
    return None


RULES = {
    None: "three points",
    "exact": "exact",
    "two points": "two points",
    "rigid": "rigid",
}


def crown(found: list[Row]) -> Figure:
    """Draw the crown of the arch of Lemos by program and by archfem's joint rules, and its fall."""
    (row, *_), (fall,) = ([r for r in found if r.scene == name] for name in ("S05", "S06"))
    figure = Figure(figsize=(WIDTH, 5.0), layout="constrained")
    axes = figure.subplot_mosaic([["programs", "rules"], ["fall", "fall"]], height_ratios=(3, 2))
    for name in PROGRAMS:
        if run := first_run(row, name):
            times, u = _series(run)
            axes["programs"].plot(times, u, color=COLOURS[name], ls=DASHES[name], label=NAMES[name])
    for (variant, text), dash, hue in zip(
        RULES.items(), ("-", "--", ":", "-."), Colour.LINES, strict=False
    ):
        if run := first_run(row, "archfem", variant):
            axes["rules"].plot(*_series(run), color=hue, ls=dash, label=text)
    peaks = {v.quantity: v.number for v in read_references("S05")}
    titles = ("programs", "(a) by program"), ("rules", "(b) by archfem's joint rules")
    for key, title in titles:
        for level in (peaks["peak"], -peaks["rebound"]):
            axes[key].axhline(level, color="k", lw=0.8, ls=":")
        axes[key].set(title=title, xlabel="time [s]", ylabel="crown [mm]", ylim=(-22, 30))
        axes[key].set_xlim(0.0, 2.0)
        axes[key].legend(frameon=False, fontsize=7, loc="lower center", ncols=2)
    axes["programs"].text(1.98, peaks["peak"], "3DEC", ha="right", va="bottom", fontsize=7)
    bars = [(f"archfem, {text}", first_run(fall, "archfem", v)) for v, text in RULES.items()]
    bars += [(NAMES[name], first_run(fall, name)) for name in PROGRAMS[1:]]
    known = [(text, run["values"]["scale"]) for text, run in bars if run]
    axes["fall"].barh([text for text, _ in known], [value for _, value in known], color="0.6")
    axes["fall"].axvline(0.15, color="k", lw=0.8, ls=":")
    axes["fall"].text(0.15, 1.0, "3DEC stands at 0.15 g ", ha="right", va="center", fontsize=7)
    axes["fall"].set_title("(c) the fall")
    axes["fall"].invert_yaxis()
    axes["fall"].set_xlabel("least peak of the half sine under which it falls [g]")
    return figure


def _series(run: dict[str, Any]) -> tuple[Any, Any]:
    """Return times and displacements, the first swing upward."""
    times, u = np.array(run["series"]["time"]), np.array(run["series"]["u"])
    return times, u * np.sign(u[np.argmax(np.abs(u))])


def column(found: list[Row]) -> Figure:
    """Draw the domain in which the column of Dimitri falls."""
    shown = sorted((row for row in found if row.scene.startswith("S08")), key=lambda r: r.scene)
    durations = [float(row.scene[4:]) / 100.0 for row in shown]
    figure = Figure(figsize=(WIDTH, 4.2), layout="constrained")
    axes: Axes = figure.subplots()
    for place, name in enumerate(("UDEC", "HybriDFEM", "LMGC90")):
        values = [row.references[place].number for row in shown]
        axes.plot(
            durations,
            values,
            ls=("-", "--", ":")[place],
            lw=1,
            color=("0.2", "0.45", "0.6")[place],
            marker="x+1"[place],
            ms=8,
            label=f"{name}, published",
        )
    for name in PROGRAMS:
        points = [(t, row.numbers(name)) for t, row in zip(durations, shown, strict=True)]
        points = [(t, numbers) for t, numbers in points if numbers]
        if points:
            values = [numbers[0] for _, numbers in points]
            axes.plot(
                [t for t, _ in points],
                values,
                MARKERS[name],
                color=COLOURS[name],
                label=NAMES[name],
            )
            for t, numbers in points:
                axes.plot([t, t], [min(numbers), max(numbers)], color=COLOURS[name])
    rigid = [
        (t, first_run(row, "archfem", "rigid")) for t, row in zip(durations, shown, strict=True)
    ]
    known = [(t, run["values"]["scale"]) for t, run in rigid if run]
    axes.plot(*np.array(known).T, "s", mfc="none", ms=8, color="k", label="archfem, rigid")
    axes.set(
        yscale="log", xlabel="duration of the first rectangle [s]", ylabel="least amplitude [g]"
    )
    ticks = [0.2, 0.3, 0.5, 1.0, 2.0]
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.set_yticks([], minor=True)
    axes.legend(frameon=False, fontsize=7)
    return figure


def main(folder: Path = FOLDER) -> None:
    """Draw all figures."""
    found = rows()
    # no type is smaller than 7 points
    with mpl.rc_context({"font.size": 8.0, "axes.titlesize": 9.0}):
        for name, draw in (("measured", measured), ("crown", crown), ("column", column)):
            draw(found).savefig(folder / f"archbench_{name}.png", dpi=150)


if __name__ == "__main__":
    main()
