"""Where the code's checks and falls differ: 50 arches, ten matched motions, two joint stiffnesses.

    python tests/benchmarks/assessment_map.py --out out/map [--workers 2] [--table FILE.csv]

Every arch has the ground acceleration that the linear check allows, that of the displacement check,
and brackets of the acceleration at which it falls. Further points repeat some of them with one
setting changed. Finished points are stored in the folder: the same command continues a run that was
interrupted. The table has a line per bracket; accelerations are in g, in multiples of the spectrum.
"""

import argparse
import csv
import json
import math
import tempfile
import time
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from scipy.stats import qmc
from setting import plain_options

import archfem as af

# Ground of class A: the shape of the spectrum does not depend on its ground acceleration.
SPECTRUM = {"code": "NTC-2018", "ag": 0.25, "f0": 2.5, "tc_star": 0.35, "site": "A"}

# Least and largest value of each property of the arches; sizes are sampled by their logarithm.
RANGES = {
    "thickness_ratio": (0.10, 0.18),
    "embrace": (120.0, 170.0),
    "radius": (0.75, 8.0),
    "friction": (0.4, 0.8),
}

# Joints of Demirel and Aldemir (2021), and joints ten times as stiff [Pa/m]
STIFFNESSES = (1.48e9, 14.8e9)
SHEAR_RATIO = 0.30 / 1.48

# One change each; the first is the map itself
VARIANTS: dict[str, dict[str, Any]] = {
    "map": {},
    "half the time step": {"analysis.dt": 1.25e-3},
    "damping 2 %": {"analysis.damping.ratio": 0.02},
    "damping 10 %": {"analysis.damping.ratio": 0.10},
    "26 stones": {"structure.voussoirs": 26},
    "three points a joint": {"model.quadrature": "trapezoidal", "model.quadrature_points": 3},
}

COLUMNS = (
    *("arch", *RANGES, "stiffness", "motion", "variant", "linear", "displacement"),
    *("linear_1", "displacement_1", "stands", "falls", "above", "unanswered", "runs"),
    *("dislocated", "pga", "seconds", "error"),
)


def sample_arches(count: int, seed: int = 1) -> list[dict[str, float]]:
    """Sample arches by a Latin hypercube."""
    arches = []
    for shares in qmc.LatinHypercube(len(RANGES), seed=seed).random(count):
        arch = {}
        for (name, (least, most)), share in zip(RANGES.items(), shares, strict=True):
            if name == "radius":
                arch[name] = float(least * (most / least) ** share)
            else:
                arch[name] = float(least + (most - least) * share)
        arches.append({name: round(value, 4) for name, value in arch.items()})
    return arches


def base_case(motions: int) -> af.Case:
    """Return the case that every point changes."""
    made = {"duration": 10.0, "vertical_ratio": 0.0}
    pairs = {f"motion {k}": {"synthetic": {"seed": k, **made}} for k in range(1, motions + 1)}
    joint = {"normal_stiffness": STIFFNESSES[0], "shear_stiffness": 0.3e9, "friction": 0.6}
    shape = {"shape": "circular_arch", "radius": 3.0, "thickness": 0.45, "embrace": 150.0}
    return af.Case.of(
        {
            "title": "map of checks and falls",
            "structure": {**shape, "voussoirs": 13, "contact": "stone to stone"},
            "contacts": {"stone to stone": joint},
            "model": {"fidelity": "rigid", "displacements": "large"},
            "suite": {"target": SPECTRUM, "matched": True, "pairs": pairs},
            "analysis": {"dt": 2.5e-3, "damping": {"ratio": 0.05, "modes": "effective"}},
        }
    )


def changes_of(arch: dict[str, float], stiffness: float, motion: str) -> dict[str, Any]:
    """Return the keys of the case for an arch, a joint stiffness and a motion."""
    return {
        "structure.radius": arch["radius"],
        "structure.thickness": arch["thickness_ratio"] * arch["radius"],
        "structure.embrace": arch["embrace"],
        "contacts.stone to stone.friction": arch["friction"],
        "contacts.stone to stone.normal_stiffness": stiffness,
        "contacts.stone to stone.shear_stiffness": SHEAR_RATIO * stiffness,
        "suite.pair": motion,
    }


def list_points(arches: int, motions: int) -> list[dict[str, Any]]:
    """Return arch, stiffness, motion, variant and changed keys of each point.

    All of the first stiffness come first, then the variants: a run that is cut short has whole
    parts.
    """
    sampled, names = sample_arches(arches), [f"motion {k}" for k in range(1, motions + 1)]

    def point(number: int, stiffness: float, motion: str, variant: str) -> dict[str, Any]:
        keys = changes_of(sampled[number], stiffness, motion) | VARIANTS[variant]
        place = {"arch": number, "stiffness": stiffness, "motion": motion, "variant": variant}
        return {**place, **sampled[number], "changes": keys}

    map_points = [
        [point(k, stiffness, motion, "map") for k in range(arches) for motion in names]
        for stiffness in STIFFNESSES
    ]
    # Every fifth arch under the first two motions, with one setting changed
    repeated = [
        point(k, STIFFNESSES[0], motion, variant)
        for variant in list(VARIANTS)[1:]
        for k in range(0, arches, 5)
        for motion in names[:2]
    ]
    return [*map_points[0], *repeated, *map_points[1]]


@cache
def allowed_accelerations(structure_text: str, friction: float) -> dict[str, float]:
    """Return the ground accelerations that the checks allow, also without a confidence factor."""
    table = {**json.loads(structure_text), "contact": "joint"}
    joint = {"normal_stiffness": STIFFNESSES[0], "shear_stiffness": 0.3e9, "friction": friction}
    structure = af.Case.of({"structure": table, "contacts": {"joint": joint}}).structure
    spectrum = af.motion.Ntc2018(**{key: SPECTRUM[key] for key in SPECTRUM if key != "code"})
    allowed = {}
    for name, factor in (("", 1.35), ("_1", 1.0)):
        found = af.kinematic_assessment(structure, spectrum, confidence_factor=factor)
        assert found.displacement is not None
        allowed[f"linear{name}"] = found.linear.ratio * SPECTRUM["ag"]
        allowed[f"displacement{name}"] = found.displacement.ratio * SPECTRUM["ag"]
    return allowed


def evaluate(case: af.Case, precision: float = 0.1) -> dict[str, Any]:
    """Return the accelerations allowed by both checks, and the bracket of the fall [g]."""
    begun = time.process_time()
    friction = case.settings["contacts"]["stone to stone"]["friction"]
    # Limit analysis of the map's 13 stones, for every number of stones of a variant.
    text = json.dumps({**case.settings["structure"], "voussoirs": 13}, sort_keys=True)
    allowed = allowed_accelerations(text, friction)
    result, motion = af.studies.dead_load_of(case), af.studies.ground_motion(case)
    # The search begins at the acceleration of the linear check, scale 1.
    unit = allowed["linear"] / SPECTRUM["ag"]
    step = case.analysis.dt
    search = af.collapse_scale(
        result.dead.model,
        motion.scaled(unit),
        start=result.dead,
        damping=result.damping[0],
        dt=(step,),
        precision=precision,
        between=(1.0 / 16.0, 16.0),
    )
    if search.searches[step].interrupted:
        raise KeyboardInterrupt
    falls = [run.fall for run in search.searches[step].runs]
    return {
        **allowed,
        "stands": search.lower * allowed["linear"],
        "falls": search.upper * allowed["linear"],
        "above": len(search.above),
        "unanswered": len(search.unanswered),
        "runs": len(falls),
        "dislocated": sum(fall is not None and fall.kind == "dislocated" for fall in falls),
        "pga": motion.pga / (SPECTRUM["ag"] * 9.80665),
        "seconds": time.process_time() - begun,
    }


def run_map(arches: int, motions: int, folder: Path, **options: Any) -> list[dict[str, Any]]:
    """Compute the brackets that are missing in a folder; return a line for each point."""
    points = list_points(arches, motions)
    study = af.Study(
        base_case(motions),
        [point["changes"] for point in points],
        {"name": "assessment_map:evaluate", "precision": options.pop("precision", 0.1)},
    )
    table = study.run(folder, **options)
    lines = []
    for k, point in enumerate(points):
        found = {name: table[name].values[k] for name in COLUMNS if name in table}
        # numbers of a study are floats; the name of a motion is a coordinate of it
        lines.append({**found, **{name: point[name] for name in COLUMNS if name in point}})
    return lines


def write_lines(lines: Sequence[dict[str, Any]], path: Path) -> None:
    """Write the table: arches as they were sampled, four digits of every other number."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        for line in lines:
            short = {k: f"{v:.4g}" for k, v in line.items() if isinstance(v, float)}
            exact = {name: line[name] for name in (*RANGES, "stiffness")}
            writer.writerow({**line, **short, **exact})


def main(arguments: Sequence[str] | None = None) -> None:
    """Compute the map, write its table and print its cost."""
    parser = plain_options(__doc__ or "")
    add = parser.add_argument
    add("--out", type=Path, help="folder of finished points; by default none are kept")
    add("--table", type=Path, help="file of the table; by default map.csv in the folder")
    add("--workers", type=int, default=1, help="processes")
    chosen: argparse.Namespace = parser.parse_args(arguments)
    size: dict[str, Any] = {"arches": 50, "motions": 10}
    if chosen.quick:
        size = {"arches": 2, "motions": 1, "precision": 1.0}
    with tempfile.TemporaryDirectory() as scratch:
        folder = chosen.out or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        lines = run_map(**size, folder=folder, workers=chosen.workers)
        write_lines(lines, chosen.table or folder / "map.csv")
    seconds = [line["seconds"] for line in lines if math.isfinite(line.get("seconds", math.nan))]
    failed = sum(bool(line["error"]) for line in lines)
    runs = sum(line["runs"] for line in lines if math.isfinite(line.get("runs", math.nan)))
    print(f"{len(lines)} brackets, {failed} without an answer, {runs:.0f} runs")
    print(f"{sum(seconds):.0f} s of processor time, {sum(seconds) / len(lines):.2f} s a bracket")


if __name__ == "__main__":
    main()
