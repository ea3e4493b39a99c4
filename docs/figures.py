"""Draw the figures of the theory, and two of other pages: `python docs/figures.py`, in seconds."""

import tempfile
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Polygon

import archfem as af

FOLDER = Path(__file__).parent / "figures"
STONE, EDGE, RED, BLUE = "#e8e2d6", "#5c5648", "#c0392b", "#2e6da4"
ARROW = {"arrowstyle": "-|>", "lw": 1.4, "shrinkA": 0.0, "shrinkB": 0.0}

mpl.rcParams.update(
    {
        "svg.hashsalt": "archfem",
        "font.size": 9.0,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "mathtext.fontset": "cm",
    }
)


def save(figure: Figure, name: str) -> None:
    """Write a figure as SVG, the same bytes at every run."""
    figure.savefig(FOLDER / f"{name}.svg", metadata={"Date": None})


def page(width: float, height: float, columns: int = 1) -> tuple[Figure, list[Axes]]:
    """Return a figure with axes side by side."""
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, list(np.atleast_1d(figure.subplots(1, columns)))


def bare(axes: Axes) -> None:
    """Hide the axes of a drawing, and draw it to scale."""
    axes.set_axis_off()
    axes.set_aspect("equal")


def arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float], colour: str) -> None:
    """Draw an arrow between two points."""
    axes.annotate("", end, start, arrowprops={**ARROW, "color": colour})


def stone(axes: Axes, points: list[tuple[float, float]]) -> None:
    """Draw the outline of a stone."""
    axes.add_patch(Polygon(points, facecolor=STONE, edgecolor=EDGE, lw=1.0))


def signs() -> None:
    """Draw positive N, V, M and e of a joint, its opening, rotation and slip."""
    figure, (left, right) = page(7.6, 2.3, 2)
    stone(left, [(-1.5, 0.0), (0.0, 0.0), (0.0, 1.0), (-1.5, 1.0)])
    left.plot([0.35, 0.35], [0.0, 1.0], color=EDGE, lw=1.0)
    left.plot([-1.5, 0.6], [0.5, 0.5], ls=":", color=EDGE, lw=0.8)
    arrow(left, (1.25, 0.72), (0.37, 0.72), RED)
    left.text(1.3, 0.72, "$N$", va="center", color=RED)
    arrow(left, (0.52, 0.2), (0.52, 0.62), BLUE)
    left.text(0.58, 0.3, "$V$", va="center", color=BLUE)
    arrow(left, (0.28, 0.5), (0.28, 0.72), EDGE)
    left.text(0.06, 0.63, "$e\\,h$", va="center", fontsize=8.0)
    left.plot([0.0, 0.35], [0.72, 0.72], ls=":", color=RED, lw=0.8)
    arrow(left, (-1.62, 0.0), (-1.62, 1.0), EDGE)
    left.text(-1.68, 0.5, "$h$", ha="right", va="center")
    left.text(-0.75, 1.04, "extrados, $e = +1/2$", ha="center", va="bottom")
    left.text(-0.75, -0.04, "intrados, $e = -1/2$", ha="center", va="top")
    left.text(-0.75, 0.25, "lower-numbered\nblock", ha="center", va="center", color=EDGE)
    left.set(xlim=(-1.9, 1.9), ylim=(-0.3, 1.35))
    turn = 0.24
    c, s = np.cos(turn), np.sin(turn)
    stone(right, [(-1.3, 0.0), (0.0, 0.0), (0.0, 1.0), (-1.3, 1.0)])
    base = np.array([(0.0, -1.0), (1.3, -1.0), (1.3, 0.0), (0.0, 0.0)])
    moved = base @ np.array([[c, s], [-s, c]]) + [0.02, 1.12]
    stone(right, [tuple(place) for place in moved])
    right.add_patch(Arc((0.02, 1.12), 1.7, 1.7, theta1=-90.0, theta2=-90.0 + np.degrees(turn)))
    right.text(0.12, 0.42, "$\\sigma$", ha="center", va="center")
    arrow(right, (-0.08, 1.0), (-0.08, 1.14), BLUE)
    right.text(-0.14, 1.12, "slip $s > 0$", ha="right", va="bottom", color=BLUE)
    arrow(right, (0.0, -0.06), (0.25, -0.06), RED)
    right.text(0.12, -0.12, "opening $> 0$ of the intrados", ha="center", va="top", color=RED)
    right.text(-0.65, 0.45, "lower", ha="center", color=EDGE)
    right.text(0.85, 0.62, "higher", ha="center", color=EDGE)
    right.set(xlim=(-1.9, 1.9), ylim=(-0.3, 1.55))
    for axes in (left, right):
        bare(axes)
    save(figure, "signs")


def law() -> None:
    """Draw normal and shear traction of a joint, and its mean over a step."""
    figure, (normal, shear, step) = page(8.4, 2.5, 3)
    g = np.array([-1.0, 0.0, 1.0])
    normal.plot(g, np.minimum(g, 0.0), color=RED)
    normal.set(xlabel="opening $g$", ylabel="$t_n$", title="across", xticks=[0.0], yticks=[0.0])
    normal.text(-0.95, -0.5, "$k_n$", color=RED)
    slip = np.array([0.0, 0.5, 1.4, 0.4, -0.6, 0.4, 1.4])
    held = np.array([0.0, 0.5, 0.5, -0.5, -0.5, 0.5, 0.5])
    shear.plot(slip, held, color=BLUE)
    for sign in (-1.0, 1.0):
        shear.axhline(0.5 * sign, color=EDGE, ls=":", lw=0.8)
    shear.text(-0.6, 0.54, "$\\mu\\,|t_n| + c$")
    shear.text(0.3, 0.18, "$k_s$", color=BLUE)
    shear.set(xlabel="slip $s$", ylabel="$t_s$", title="along", xticks=[0.0], yticks=[0.0])
    shear.set(ylim=(-0.8, 0.8))
    x = np.linspace(0.0, 1.0, 101)
    force = np.minimum(-0.6 + 1.6 * x, 0.0)
    step.plot(x, force, color=RED)
    step.axhline(force.mean(), color=RED, ls="--", lw=1.0)
    step.fill_between(x, force, 0.0, color=RED, alpha=0.12, lw=0.0)
    step.text(0.55, force.mean() - 0.05, "its mean", color=RED, va="top")
    step.set(xlabel="from start to end of a step", title="over a step", xticks=[0.0, 1.0])
    step.set(yticks=[0.0], ylabel="$t_n$")
    save(figure, "law")


def section() -> None:
    """Draw moment over rotation of a joint under constant force, exact and by springs."""
    figure, (axes,) = page(5.0, 2.8)
    turn = np.linspace(1e-3, 12.0, 400)  # over N / (k_n w h²)
    exact = np.where(turn <= 2.0, turn / 12.0, 0.5 - np.sqrt(2.0 / turn) / 3.0)
    axes.plot(turn, exact, color=RED, label="exact facets")
    place, weight = np.linspace(-0.5, 0.5, 5), np.array([1, 2, 2, 2, 1]) / 8.0
    moment = []
    for each in turn:
        low, high = -20.0, 20.0
        for _ in range(60):
            middle = 0.5 * (low + high)
            total = -(weight * np.minimum(middle - place * each, 0.0)).sum()
            low, high = (middle, high) if total > 1.0 else (low, middle)
        moment.append(-(weight * place * np.minimum(low - place * each, 0.0)).sum())
    axes.plot(turn, moment, color=BLUE, label="five springs")
    axes.axhline(0.5, color=EDGE, ls="--", lw=1.0, label="rigid blocks")
    axes.axhline(1.0 / 6.0, color=EDGE, ls=":", lw=0.8)
    axes.text(12.0, 0.175, "opens", ha="right")
    axes.set(xlabel="turn $\\theta\\, k_n w h^2 / N$", ylabel="$e = M / (N h)$", ylim=(0.0, 0.54))
    axes.legend(frameon=False, loc="lower right", bbox_to_anchor=(1.0, 0.36))
    save(figure, "section")


def rules() -> None:
    """Draw the quadrature points of a joint of four facets."""
    figure, (axes,) = page(5.4, 1.9)
    facets = np.linspace(0.0, 1.0, 5)
    gauss = 0.5 + 0.5 * np.sqrt(0.6) * np.array([-1.0, 0.0, 1.0])
    points = {"exact": None, "lobatto": np.array([0.0, 0.5, 1.0]), "gauss": gauss}
    points["nodal"] = np.array([0.0, 1.0])
    for row, (name, unit) in enumerate(points.items()):
        axes.plot([0.0, 1.0], [-row, -row], color=EDGE, lw=1.0)
        axes.plot(facets, np.full(5, -row), "|", color=EDGE, ms=9.0)
        if unit is None:
            axes.plot([0.0, 1.0], [-row, -row], color=RED, lw=4.0, alpha=0.5)
        else:
            place = (facets[:-1, None] + 0.25 * unit).ravel()
            axes.plot(place, np.full(len(place), -row), "o", color=RED, ms=4.0)
        axes.text(-0.03, -row, name, ha="right", va="center")
    axes.text(0.0, 0.45, "intrados", ha="center")
    axes.text(1.0, 0.45, "extrados", ha="center")
    axes.set(xlim=(-0.16, 1.06), ylim=(-3.5, 0.9))
    axes.set_axis_off()
    save(figure, "rules")


def frame() -> None:
    """Draw two faces after large displacements: mean frame, overlap, linear gap."""
    figure, (axes,) = page(4.6, 3.2)
    turn, slip = 0.36, 0.22

    def face(angle: float, middle: tuple[float, float], side: float) -> None:
        c, s = np.cos(angle), np.sin(angle)
        base = np.array([(0.0, -0.5), (side, -0.5), (side, 0.5), (0.0, 0.5)])
        stone(axes, [tuple(p) for p in base @ np.array([[c, s], [-s, c]]) + middle])

    face(-turn / 2.0, (-0.1, 0.0), -0.9)
    face(turn / 2.0, (0.1, slip), 0.9)
    axes.plot([0.0, 0.0], [-0.75, 0.95], ls="--", color=BLUE, lw=1.0)
    axes.text(0.03, 0.97, "mean line", color=BLUE)
    axes.plot([0.0, 0.0], [-0.5 + slip, 0.5], color=BLUE, lw=3.0, alpha=0.6)
    axes.text(0.06, 0.02, "$\\ell = h - |s|$", color=BLUE, va="center")
    arrow(axes, (-0.85, 0.0), (-0.85, slip), RED)
    axes.plot([-0.9, 0.1], [slip, slip], color=RED, lw=0.6)
    axes.plot([-0.9, -0.1], [0.0, 0.0], color=RED, lw=0.6)
    axes.text(-0.9, slip / 2.0, "$s$", color=RED, ha="right", va="center")
    axes.text(-0.55, -0.25, "$\\theta_A$", color=EDGE)
    axes.text(0.55, 0.3, "$\\theta_B$", color=EDGE)
    axes.text(0.0, -0.82, "gap at $x$:  $g - x\\,\\ell\\,\\sigma$", ha="center", va="top")
    axes.set(xlim=(-1.3, 1.3), ylim=(-1.0, 1.1))
    bare(axes)
    save(figure, "frame")


def ladder() -> None:
    """Draw the coordinates of a stone at each fidelity."""
    figure, axes = page(7.6, 1.9, 4)
    low, high = np.linspace(0.0, 1.0, 5), np.array([0.0, 1.4])
    for each, name in zip(axes, ("rigid", "faces", "condensed", "full"), strict=True):
        stone(each, [(0.0, 0.0), (1.4, 0.0), (1.4, 1.0), (0.0, 1.0)])
        if name == "rigid":
            each.plot([0.7], [0.5], "o", color=RED)
            each.text(0.7, 0.62, "3", ha="center", color=RED)
        if name == "faces":
            for x in high:
                each.plot([x, x], [0.0, 1.0], color=RED, lw=3.0)
            each.text(0.7, 0.5, "2 × 3", ha="center", va="center", color=RED)
        if name == "condensed":
            for x in high:
                each.plot(np.full(5, x), low, "o", color=RED, ms=4.0)
            each.text(0.7, 0.5, "20", ha="center", va="center", color=RED)
        if name == "full":
            x, y = np.meshgrid(np.linspace(0.0, 1.4, 5), low)
            each.plot(x.ravel(), y.ravel(), "o", color=RED, ms=4.0)
            each.text(0.7, -0.12, "50", ha="center", va="top", color=RED)
        each.set(title=name, xlim=(-0.15, 1.55), ylim=(-0.3, 1.1))
        bare(each)
    save(figure, "ladder")


def states() -> None:
    """Draw the pressure along a joint: closed, partly open, hinged, sliding."""
    figure, axes = page(7.6, 1.9, 4)
    shapes = {
        "closed": [(0.0, 0.3), (1.0, 0.7)],
        "open in part": [(0.0, 0.0), (0.45, 0.0), (1.0, 1.1)],
        "hinge, $|e| \\geq 0.46$": [(0.0, 0.0), (0.88, 0.0), (1.0, 1.6)],
        "slides, $|V| = \\mu N$": [(0.0, 0.5), (1.0, 0.5)],
    }
    for each, (name, points) in zip(axes, shapes.items(), strict=True):
        y, p = np.array(points).T
        each.fill_betweenx(y, 0.0, p, color=RED, alpha=0.3, lw=0.0)
        each.plot(p, y, color=RED, lw=1.0)
        each.plot([0.0, 0.0], [0.0, 1.0], color=EDGE, lw=1.5)
        weights = np.interp(np.linspace(0, 1, 501), y, p)
        place = (weights * np.linspace(0, 1, 501)).sum() / weights.sum()
        arrow(each, (1.8, place), (0.0, place), EDGE)
        if name.startswith("slides"):
            arrow(each, (-0.15, 0.2), (-0.15, 0.8), BLUE)
        each.set(title=name, xlim=(-0.3, 1.9), ylim=(-0.1, 1.15))
        each.set_axis_off()
    save(figure, "states")


def programme() -> None:
    """Draw the strength of a joint in limit analysis."""
    figure, (moment, shear) = page(6.4, 2.5, 2)
    n = np.linspace(0.0, 1.0, 101)
    moment.plot(n, 0.5 * n, color=RED, label="no crushing")
    moment.plot(n, 0.5 * n - 0.5 * n**2, color=BLUE, label="strength $\\sigma$")
    for sign in (1.0, -1.0):
        moment.fill_between(n, 0.0, sign * (0.5 * n - 0.5 * n**2), color=BLUE, alpha=0.1, lw=0.0)
    moment.plot(n, -0.5 * n, color=RED)
    moment.plot(n, -0.5 * n + 0.5 * n**2, color=BLUE)
    moment.legend(frameon=False, fontsize=8, loc="lower left")
    moment.set(
        xlabel="$N / (\\sigma w h)$", ylabel="$M / (\\sigma w h^2)$", xticks=[0, 1], yticks=[0]
    )
    shear.fill_between(n, -0.1 - 0.6 * n, 0.1 + 0.6 * n, color=RED, alpha=0.1, lw=0.0)
    for sign in (1.0, -1.0):
        shear.plot(n, sign * (0.1 + 0.6 * n), color=RED)
    shear.text(0.45, 0.5, "$c A + \\mu N$", ha="right")
    shear.set(xlabel="$N$", ylabel="$V$", xticks=[0], yticks=[0])
    save(figure, "programme")


def selection() -> None:
    """Draw seven of sixty synthetic records, selected by the rule of NTC 2018."""
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(60):
            motion = af.Motion.synthetic(duration=20.0, seed=seed, dt=0.01, vertical_ratio=0.0)
            motion = motion.band_passed(0.25 + 0.1 * (seed % 5), 5.0 + 2.0 * (seed % 9))
            rows = "\n".join(f"{sample:.5f}" for sample in motion.horizontal)
            name = f"19900{1 + seed // 28}{1 + seed % 28:02d}.txt"  # each on a day of its own
            (Path(folder) / name).write_text(f"# acceleration [m/s2], dt = 0.01 s\n{rows}\n")
        spectrum = af.Eurocode8(0.25, "B")
        found = af.select_records(folder, spectrum, 0.4, rule="NTC-2018")
    found.plot().savefig(FOLDER / "selection.png", dpi=140)


def assessment_map() -> None:
    """Draw the accelerations of checks and falls of 50 arches, and their ratios."""
    table = pd.read_csv(FOLDER.parent / "assessment_map.csv")
    found = table[(table.variant == "map") & (table.stands > 0.0) & np.isfinite(table.falls)]
    each = found.assign(fall=np.sqrt(found.stands * found.falls)).groupby("arch")
    arches = each.first().assign(low=each.fall.min(), high=each.fall.max(), mid=each.fall.median())
    figure = Figure(figsize=(7.2, 6.4), layout="constrained")
    axes = figure.subplots(2, 1, sharex=True)
    checks = {"linear": "#d7261e", "displacement": "#0b4f8a"}
    for letter, ax, by in zip("ab", axes, (1.0, arches.linear), strict=True):
        low, mid, high = (arches[name] / by for name in ("low", "mid", "high"))
        ax.vlines(arches.radius, low, high, color="#cfcac0", lw=3.0, label="falls, range")
        ax.plot(arches.radius, mid, "o", color="#1b1b1b", ms=4.0, label="their median")
        for name, color in checks.items():
            mark = {"color": color, "ms": 9.0, "mew": 2.0, "label": f"{name} check"}
            ax.plot(arches.radius, arches[name] / by, "_", **mark)
        ax.set(xscale="log", yscale="log")
        ax.minorticks_off()
        marks = [0.2, 0.5, 1.0, 2.0, 4.0]
        ax.set_yticks(marks, [f"{mark:g}" for mark in marks])
        ax.grid(axis="y", alpha=0.3)
        ax.set_title(f"({letter})", loc="left", fontsize=9.0)
    axes[0].legend(frameon=False, ncols=4, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    axes[0].set_ylabel("ground acceleration [g]")
    axes[1].set(ylabel="as a multiple of the linear check's", xlabel="radius [m]")
    axes[1].set_xticks([1.0, 2.0, 4.0, 8.0], ["1", "2", "4", "8"])
    figure.savefig(FOLDER / "assessment_map.png", dpi=150)


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    drawings = (signs, law, section, rules, frame, ladder, states, programme)
    for draw in (*drawings, selection, assessment_map):
        draw()
