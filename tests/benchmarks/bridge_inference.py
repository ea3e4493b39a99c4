"""Which lengths that the paper does not print fit all that it prints of the three-span bridge.

    python tests/benchmarks/bridge_inference.py --out out/inference [--records FOLDER] [--workers 2]

Demirel and Aldemir (2021) print no height of piers, cover or erosion of the fill, and more. Points
of `UNPRINTED` are drawn evenly, and then around the best, 120 of 35 s in all. Each is the bridge as
it stands and restored under six pairs, by the paper's law: five springs a joint that never slide,
Newmark's scheme, R = 3; stones are rigid, the fill has all its nodes. `ROWS` compare it with what
the paper prints: a misfit is 1 where it is one tolerance away, 2 for each pair or mode that
differs, and at most `WORST`. Erzincan E-W counts by time with `--records` alone: its file may not
be redistributed.

Each point is appended to `points.jsonl` when it is known, and the same command continues. The
table and the picture follow from that file.
"""

import argparse
import json
import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from scipy.stats import qmc
from setting import plain_options, quick_motion
from timing import table

import archfem as af
from archfem.dynamics import History
from archfem.joints import assessed_joints
from archfem.statics.equilibrium import Equilibrium
from archfem.studies.statements import edge_factor

MESHES = Path(__file__).parents[2] / "meshes"

PAPERS_LAW = (
    "contacts.stone to stone.friction=none",
    "contacts.soil to stone.friction=none",
    "criteria.friction=0.60",
    "analysis.scheme=newmark",
    "model.quadrature=nodal",
    "model.fidelity={ backfill = 'full', rest = 'rigid' }",
)


class Unprinted(NamedTuple):
    """A value that the paper does not print: its range, and what is assumed without the study."""

    low: float
    high: float
    assumed: float
    unit: str


UNPRINTED = {
    "height of piers and sidewalls": Unprinted(1.6, 3.4, 2.0, "m"),
    "cover": Unprinted(0.2, 2.2, 0.4, "m"),
    "erosion": Unprinted(0.0, 0.8, 0.6, "m"),
    "course": Unprinted(0.3, 0.6, 0.4, "m"),
    "gap between springings": Unprinted(0.8, 1.3, 1.02, "m"),
    "abutment above springing": Unprinted(0.2, 1.6, 0.8, "m"),
    "E of the fill": Unprinted(6.25, 24.0, 6.25, "MPa"),
    "motions reversed": Unprinted(0.0, 1.0, 0.0, ""),
}
"""Ranges of what is not printed. E is printed as 6.25 MPa, within a range of tests up to 24 MPa."""

WORST = 3.0
"""Misfit at which a row counts no more: beyond it a statement is missed, by whatever distance."""

HOPELESS = 25.0
"""Sum of squares of the misfits as it stands from which on the restored bridge is not run."""

STRESS, INSTANT = 0.6e6, 3.055
"""Largest compression of the stones under dead load [Pa], and time of the global mechanism under
Erzincan E-W [s], as printed.
"""

N5 = "north arch, joint 5"
"""The joint of the paper's figure 16, if joints of the north arch are counted from its left."""

Point = dict[str, float]
Findings = dict[str, Any]


def changes_of(point: Point, restored: bool) -> list[str]:
    """Write a point as changes of the case of the bridge."""
    height, reduced = point["height of piers and sidewalls"], 0.8 if restored else 0.0
    above = point["abutment above springing"]
    changes = {
        "structure.piers.height": height - reduced,
        "structure.sidewalls.height": height,
        "structure.piers.course": point["course"],
        "structure.sidewalls.course": point["course"],
        "structure.piers.gap": point["gap between springings"],
        "structure.sidewalls.south sidewall.above": above,
        "structure.sidewalls.north sidewall.above": above if restored else 0.0,
        "structure.backfill.cover": point["cover"],
        "structure.backfill.erosion": 0.0 if restored else point["erosion"],
    }
    written = [f"{key}={value:.4f} m" for key, value in changes.items()]
    return [*written, f"materials.backfill.young={point['E of the fill']:.4f} MPa"]


def bridge(point: Point, restored: bool) -> af.Analysis:
    """Return the analysis of a point by the paper's law."""
    path = MESHES / f"prusias{'_restored' if restored else ''}.toml"
    return af.Case.read(path, [*PAPERS_LAW, *changes_of(point, restored)]).analysis


@cache
def motions(records: str | None, is_reversed: bool) -> list[af.Motion]:
    """Return the six pairs, matched to the spectrum and divided by R."""
    options = [f"suite.reversed={str(is_reversed).lower()}"]
    if records is None:
        return list(af.Case.read(MESHES / "prusias.toml", options).ground_suite().motions)
    options.append(f"suite.folder={records}")
    return list(af.Case.read(MESHES / "prusias_records.toml", options).ground_suite().motions)


def edge_stress(dead: Equilibrium) -> float:
    """Return the largest compression at the edge of a joint [Pa]."""
    joints, structure = assessed_joints(dead.joints), dead.model.structure
    mean = joints["N"].values / (structure.width * structure.depths[joints["joint"].values])
    return float(np.nanmax(mean * edge_factor(joints["eccentricity"].values)))


def run_pairs(analysis: af.Analysis, pairs: Sequence[af.Motion]) -> Findings:
    """Run all pairs; return mechanisms by definition, largest |e| of joints, and use of N5."""
    mechanisms, largest, used = [], [], []
    for motion in pairs:
        run = analysis.run(motion)
        mechanisms.append(_counted(run))
        joints = assessed_joints(run.joints)
        largest.append(abs(joints["eccentricity"]).max("time").fillna(0.5).values.tolist())
        used.append(_use_of_n5(joints))
    return {"mechanisms": mechanisms, "largest": largest, "n5": used}


def _counted(run: History) -> dict[str, tuple[str, float] | None]:
    """Return class and time of the first mechanism by each definition."""
    found = af.first_mechanisms(run)
    return {
        name: None if each is None else (str(each.kind), float(each.time))
        for name, each in found.items()
    }


def _use_of_n5(joints: Any) -> float:
    """Return how far the most used of both criteria is used in joint N5 over a run [-]."""
    own = joints.isel(joint=list(joints["name"].values).index(N5))
    hinging = float(abs(own["eccentricity"]).max()) / 0.46
    sliding = float(abs(own["V"] / own["N"].where(own["N"] > 0.0)).max()) / 0.60
    return max(hinging, sliding)


def examine(point: Point, records: str | None) -> Findings:
    """Return all that the study compares, of a point as it stands and restored."""
    begun = time.perf_counter()
    pairs = motions(records, point["motions reversed"] >= 0.5)
    analysis = bridge(point, restored=False)
    dead = analysis.dead_load()
    joints = assessed_joints(dead.joints)
    found: Findings = {
        "stress": edge_stress(dead),
        "eccentricity": float(abs(joints["eccentricity"]).max()),
        "friction": float(abs(joints["V"] / joints["N"]).max()),
        "local modes": int(np.sum(analysis.modes(3).local)),
        "existing": run_pairs(analysis, pairs),
    }
    if total(misfits(found, records)) < HOPELESS:
        found["restored"] = run_pairs(bridge(point, restored=True), pairs)
    return {**found, "seconds": time.perf_counter() - begun}


def _mechanisms(found: Findings, state: str) -> list[tuple[str, float]]:
    """Return class and time of the first four failed joints of each pair that has them."""
    return [each["any joints at once"] for each in found[state]["mechanisms"] if _has(each)]


def _has(mechanisms: dict[str, Any]) -> bool:
    return mechanisms["any joints at once"] is not None


def _instant(found: Findings) -> float:
    """Return how far the global mechanism under the first pair is from the printed time [s]."""
    first = found["existing"]["mechanisms"][0]["any joints at once"]
    return abs(first[1] - INSTANT) if first is not None and first[0] == "global" else math.inf


def _nearer(found: Findings) -> float:
    """Return the mean largest |e| of ring joints when restored, over that as it stands [-]."""
    means = [np.mean(found[state]["largest"]) for state in ("restored", "existing")]
    return float(means[0] / means[1])


ROWS: dict[str, Callable[[Findings], float]] = {
    "0.6 MPa under dead load": lambda it: abs(math.log(it["stress"] / STRESS)) / math.log(1.25),
    "no criterion exceeded under dead load": lambda it: (
        0.0 if it["eccentricity"] < 0.46 and it["friction"] < 0.60 else WORST
    ),
    "no local mode among three": lambda it: 2.0 * it["local modes"],
    "a mechanism under all six": lambda it: 2.0 * (6.0 - len(_mechanisms(it, "existing"))),
    "none of them local": lambda it: (
        2.0 * sum(kind == "local" for kind, _ in _mechanisms(it, "existing"))
    ),
    "Erzincan E-W global at 3.055 s": lambda it: _instant(it) / 0.2,
    "restored, none": lambda it: 2.0 * len(_mechanisms(it, "restored")),
    "restored, nearer the centre line": lambda it: 0.0 if _nearer(it) < 1.0 else WORST,
    "N5 beyond a limit, less so restored": lambda it: (
        0.0 if it["existing"]["n5"][0] >= max(1.0, it["restored"]["n5"][0] + 1e-3) else WORST
    ),
}
"""Misfits by what the paper prints. Four failed joints of rings and piers are a mechanism."""


def misfits(found: Findings, records: str | None) -> dict[str, float]:
    """Return the misfit of each row that is known, at most `WORST`."""
    absent = [] if "restored" in found else ["restored"]
    absent += ["3.055"] if records is None else []
    return {
        name: min(row(found), WORST)
        for name, row in ROWS.items()
        if not any(word in name for word in absent)
    }


def total(row: dict[str, float]) -> float:
    """Return the misfit of a point: the sum of squares of its rows."""
    return sum(value**2 for value in row.values())


def draw_points(count: int) -> list[Point]:
    """Draw points evenly over the ranges of `UNPRINTED`, the assumed values first."""
    shares = qmc.Sobol(len(UNPRINTED), seed=1).random(count)
    drawn = [
        {
            name: each.low + float(share) * (each.high - each.low)
            for share, (name, each) in zip(row, UNPRINTED.items(), strict=True)
        }
        for row in shares
    ]
    return [{name: each.assumed for name, each in UNPRINTED.items()}, *drawn[1:]]


def move(parent: Point, rng: np.random.Generator) -> Point:
    """Return a point near another: each value moves by about an eighth of its range."""
    moved = {}
    for name, each in UNPRINTED.items():
        span = each.high - each.low
        value = parent[name] + rng.normal(0.0, 0.12 * span)
        if name == "motions reversed":
            value = 1.0 - parent[name] if rng.random() < 0.15 else parent[name]
        moved[name] = float(np.clip(value, each.low, each.high))
    return moved


class Store:
    """Points that are known, one a line of a file."""

    def __init__(self, folder: Path):
        """Read what an earlier run left."""
        folder.mkdir(parents=True, exist_ok=True)
        self.path = folder / "points.jsonl"
        text = self.path.read_text() if self.path.exists() else ""
        # a line that a killed run left unfinished is not known
        lines = [line for line in text.split("\n")[:-1] if line]
        self.rows: list[dict[str, Any]] = [json.loads(line) for line in lines]

    def add(self, point: Point, found: Findings) -> None:
        """Append a point."""
        self.rows.append({"point": point, "found": found})
        with self.path.open("a") as file:
            file.write(json.dumps(self.rows[-1]) + "\n")

    @property
    def answered(self) -> list[dict[str, Any]]:
        """Points that have an answer, the others ended in an error."""
        return [row for row in self.rows if "error" not in row["found"]]

    def ranked(self, records: str | None) -> list[tuple[float, Point, dict[str, float]]]:
        """Return total misfit, point and misfits by row of what is known, the best first."""
        rows = [(misfits(each["found"], records), each["point"]) for each in self.answered]
        return sorted(((total(row), point, row) for row, point in rows), key=lambda each: each[0])


def examine_safely(point: Point, records: str | None) -> Findings:
    """Return what `examine` finds, or the error that a point ends in, such as a course too high."""
    try:
        return examine(point, records)
    except af.ArchfemError as error:
        return {"error": str(error)}


def search(store: Store, chosen: argparse.Namespace) -> None:
    """Examine points, the drawn ones and then neighbours of the best, until there are enough."""
    drawn = draw_points(chosen.drawn)[len(store.rows) :]
    rng = np.random.default_rng(len(store.rows))
    pending: dict[Future[Findings], Point] = {}
    left = chosen.points - len(store.rows)
    with ProcessPoolExecutor(chosen.workers) as pool:
        while left > 0 or pending:
            while left > 0 and len(pending) < chosen.workers:
                best = store.ranked(chosen.records)[:8]
                parent = best[rng.integers(len(best))][1] if best else {}
                point = drawn.pop(0) if drawn else move(parent, rng)
                pending[pool.submit(examine_safely, point, chosen.records)] = point
                left -= 1
            for done in wait(pending, return_when=FIRST_COMPLETED).done:
                store.add(pending.pop(done), done.result())
                _print_progress(store, chosen.records)


def _print_progress(store: Store, records: str | None) -> None:
    """Print the misfit of the last point beside the least."""
    found, ranked = store.rows[-1]["found"], store.ranked(records)
    if "error" in found:
        print(f"{len(store.rows)}: {found['error']}", flush=True)
        return
    last, least = total(misfits(found, records)), ranked[0][0]
    print(
        f"{len(store.rows)}: misfit {last:.1f}, least {least:.1f}, {found['seconds']:.0f} s",
        flush=True,
    )


def best_ranges(store: Store, records: str | None) -> dict[str, tuple[float, float, float]]:
    """Return each value of the best point, and the range of the best tenth."""
    ranked = store.ranked(records)
    best = [point for _, point, _ in ranked[: max(len(ranked) // 10, 1)]]
    values = {name: [point[name] for point in best] for name in UNPRINTED}
    return {name: (each[0], min(each), max(each)) for name, each in values.items()}


def excluded(store: Store, records: str | None) -> list[tuple[str, str, float]]:
    """Return pairs of rows that no point meets together though each is met, by least misfit."""
    rows = [row for _, _, row in store.ranked(records)]
    names = [name for name in rows[0] if min(row.get(name, WORST) for row in rows) <= 1.0]
    pairs = [(a, b) for k, a in enumerate(names) for b in names[k + 1 :]]
    least = [
        (a, b, min(max(row.get(a, WORST), row.get(b, WORST)) for row in rows)) for a, b in pairs
    ]
    return [each for each in least if each[2] > 1.0]


def report(store: Store, records: str | None) -> str:
    """Write the tables: values, misfits of the best points by row, rows that exclude each other."""
    ranked = store.ranked(records)
    spans = [
        [
            f"{name} [{each.unit}]" if each.unit else name,
            each.assumed,
            *best_ranges(store, records)[name],
            f"{each.low:g} to {each.high:g}",
        ]
        for name, each in UNPRINTED.items()
    ]
    values = table(["value", "assumed", "best", "tenth from", "to", "range"], spans)
    assumed = misfits(store.answered[0]["found"], records)
    rows = [
        [
            name,
            assumed.get(name, "-"),
            *(row.get(name, "-") for _, _, row in ranked[:5]),
            sum(row.get(name, WORST) <= 1.0 for *_, row in ranked),
        ]
        for name in ROWS
    ]
    rows.append(["sum of squares", total(assumed), *(each for each, *_ in ranked[:5]), ""])
    places = ["best", "2nd", "3rd", "4th", "5th"][: len(ranked)]
    head = ["misfit", "assumed", *places, f"met by, of {len(ranked)}"]
    apart = [f"- {a} | {b}: {least:.2f} at least" for a, b, least in excluded(store, records)]
    seconds = sum(row["found"]["seconds"] for row in store.answered)
    words = f"{len(store.rows)} points, {seconds / 60:.0f} min of one process each"
    return "\n\n".join(
        [values, table(head, rows), "never met together:\n" + "\n".join(apart), words]
    )


def draw(store: Store, records: str | None) -> plt.Figure:
    """Draw the misfit over each value; the best tenth in colour, what was assumed as a line."""
    ranked = store.ranked(records)
    limit = ranked[max(len(ranked) // 10, 1) - 1][0]
    figure, axes = plt.subplots(2, 4, figsize=(6.7, 3.6), sharey=True, layout="constrained")
    for axis, (name, each) in zip(axes.flat, UNPRINTED.items(), strict=True):
        for misfit, point, _ in ranked:
            colour, size = ("#c44e00", 14) if misfit <= limit else ("#9aa5b1", 7)
            axis.scatter(point[name], misfit, s=size, color=colour, linewidths=0)
        axis.axvline(each.assumed, color="#333333", linewidth=0.8, linestyle=":")
        axis.set_xlabel(f"{name} [{each.unit}]" if each.unit else name, fontsize=7)
        axis.tick_params(labelsize=7)
    for axis in axes[:, 0]:
        axis.set_ylabel("misfit", fontsize=7)
    return figure


def options() -> argparse.ArgumentParser:
    """Make the parser of the command line."""
    parser = plain_options(__doc__)
    parser.add_argument("--out", type=Path, help="folder of the points, the tables and the picture")
    parser.add_argument("--records", help="folder of the records that prusias_records.toml names")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--points", type=int, default=120, help="points in all")
    parser.add_argument("--drawn", type=int, default=32, help="of them drawn evenly")
    return parser


def main(arguments: Sequence[str] | None = None) -> None:
    """Examine the points that are missing, print the tables and draw the picture."""
    chosen = options().parse_args(arguments)
    if chosen.quick:
        point = {name: each.assumed for name, each in UNPRINTED.items()}
        found = run_pairs(bridge(point, restored=True), [quick_motion(1.0)])
        print(
            table(
                ["definition", "mechanism"], [list(each) for each in found["mechanisms"][0].items()]
            )
        )
        return
    store = Store(chosen.out)
    search(store, chosen)
    text = report(store, chosen.records)
    (chosen.out / "tables.md").write_text(text + "\n")
    draw(store, chosen.records).savefig(chosen.out / "inference.png", dpi=300)
    print(text)


if __name__ == "__main__":
    main()
