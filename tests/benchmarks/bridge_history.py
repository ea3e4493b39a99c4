"""Verdicts on the Roman bridge: table 3 of Demirel and Aldemir (2021), and time histories.

    python tests/benchmarks/bridge_history.py [--models] [--restored] [--pairs pair-1 …]
        [--paper] [--events "1999 Düzce" …]

The table has six earthquakes near the bridge, which stood through all of them, with a peak
acceleration at its site. `--models` compares these values with ground-motion models of pygmm. Else
the bridge is shaken by the synthetic pairs of its case, scaled to each of the six values: rigid
stones, large displacements, on elastic fill with all its nodes, stiffness-proportional damping.
`--paper` takes the law of the paper instead: five springs a joint that never slide, elastic stones,
small displacements, Rayleigh damping and Newmark's scheme.
"""

import argparse
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from setting import plain_options, print_left_out, quick_motion
from timing import table

import archfem as af
from archfem.models.builder import build
from archfem.motion import GROUND_MOTION_MODELS, peak_ground_acceleration
from archfem.units import STANDARD_GRAVITY, mm

MESHES = Path(__file__).parents[2] / "meshes"

EVENTS = {
    "1943 Hendek": (6.6, 35.0e3, 0.192),
    "1944 Gerede": (7.3, 90.0e3, 0.125),
    "1957 Abant": (7.1, 35.0e3, 0.233),
    "1967 Mudurnu": (6.8, 50.0e3, 0.172),
    "1999 Kocaeli": (7.5, 109.0e3, 0.108),
    "1999 Düzce": (7.1, 15.4e3, 0.299),
}
"""Moment magnitude, distance [m] and peak acceleration [g] of the paper's Table 3."""

GROUND = 270.0
"""Shear wave velocity of the middle of class ZD, 180 to 360 m/s, which the paper assumes [m/s]."""


def print_models() -> None:
    """Compare medians of all models with the paper's values, and fit these by a line."""
    paper = np.array([peak for _, _, peak in EVENTS.values()])
    rows = [["Demirel and Aldemir", *(f"{peak:.3f}" for peak in paper), "-", "-"]]
    cases = [(name, None) for name in GROUND_MOTION_MODELS] + [("BSSA14", "turkey")]
    for name, region in cases:
        title = name if region is None else f"{name}, {region}"
        try:
            answers = [
                peak_ground_acceleration(size, away, v_s30=GROUND, model=name, region=region)
                for size, away, _ in EVENTS.values()
            ]
        except af.InvalidInput as error:
            print(f"{title} does not apply: {error}")
            continue
        found = np.array([each.median for each in answers]) / STANDARD_GRAVITY
        scatter = np.mean([each.scatter for each in answers])
        apart = np.sqrt(np.mean(np.log(found / paper) ** 2))
        rows.append([title, *(f"{each:.3f}" for each in found), f"{scatter:.2f}", f"{apart:.2f}"])
    print(table(["PGA [g]", *EVENTS, "scatter", "rms ln apart"], rows))
    line = np.array([[1.0, size - 7.0, away / 1e3] for size, away, _ in EVENTS.values()])
    fit = np.linalg.lstsq(line, np.log(paper), rcond=None)[0]
    miss = np.abs(np.expm1(line @ fit - np.log(paper))).max()
    print(f"the paper's values: ln(PGA/g) = {fit[0]:.4f} + {fit[1]:.4f} (M - 7) + ", end="")
    print(f"{fit[2]:.5f} R/km within {miss:.1%}")


HEAD = ["earthquake", "PGA [g]", "pair", "outcome", "displaced [mm]", "left [mm]", "doubts"]


PAPER = [
    *(f"contacts.{name}.friction=none" for name in ("stone to stone", "soil to stone")),
    *("analysis.scheme=newmark", "model.quadrature=nodal", "model.fidelity=full"),
    "criteria.friction=0.60",
]
"""Changes that make the law of the paper."""


def prepare(name: str, paper: bool) -> tuple[af.Case, af.statics.Equilibrium, dict[str, object]]:
    """Build a bridge at rest, and the settings of its runs."""
    case = af.Case.read(MESHES / f"{name}.toml", ["suite.reduction=1", *(PAPER if paper else [])])
    if paper:
        dead = af.dead_load(build(case.structure, case.analysis.discretisation))
        damping = af.cases.damping_of(case, dead)[0]
        settings = {"scheme": case.analysis.scheme, "criteria": case.analysis.failure_criteria}
        return case, dead, {"damping": damping, **settings}
    fidelity = {"backfill": "full", "rest": "rigid"}
    model = af.build(case.structure, fidelity=fidelity, displacements="large", cells=(2, 2))
    return case, af.dead_load(model), {"damping": af.effective_damping(model, 0.05, "closed")}


def shake(name: str, chosen: argparse.Namespace) -> None:
    """Shake a bridge by its pairs at all levels; print a row of each run when it is ready."""
    case, dead, settings = prepare(name, chosen.paper)
    motions = [quick_motion(1.0)] if chosen.quick else case.ground_suite().motions
    motions = [each for each in motions if chosen.pairs is None or each.name in chosen.pairs]
    events = ["1943 Hendek"] if chosen.quick else chosen.events
    counts: dict[str, dict[str, int]] = {}
    begun = time.process_time()
    for event in events:
        for motion in motions:
            scaled = motion.scaled_to_pga(EVENTS[event][2] * STANDARD_GRAVITY)
            run = af.time_history(dead.model, scaled, start=dead, dt=0.005, **settings)
            verdict = run.verdict
            moved = [f"{verdict.displacement / mm:.0f}", f"{verdict.residual / mm:.0f}"]
            row = [event, EVENTS[event][2], motion.name, verdict.outcome, *moved]
            print(*row, len(verdict.doubts), sep=" | ", flush=True)
            for definition, found in verdict.mechanisms.items():
                here = counts.setdefault(definition, dict.fromkeys(events, 0))
                here[event] += found is not None
    print(f"\n{name}: runs with a mechanism, of {len(motions)}")
    rows = [[definition, *map(str, here.values())] for definition, here in counts.items()]
    print(table(["definition", *events], rows))
    print(f"{time.process_time() - begun:.0f} s of processor time")


def main(arguments: Sequence[str] | None = None) -> None:
    """Compare the models, or shake the bridge."""
    parser = plain_options(__doc__)
    parser.add_argument("--models", action="store_true", help="compare ground-motion models")
    parser.add_argument("--restored", action="store_true", help="the bridge after its restoration")
    parser.add_argument("--paper", action="store_true", help="joints and damping of the paper")
    parser.add_argument("--pairs", nargs="+", help="names of the pairs to take (all)")
    parser.add_argument("--events", nargs="+", default=[*EVENTS], help="earthquakes (all)")
    chosen = parser.parse_args(arguments)
    if chosen.models or chosen.quick:
        try:
            print_models()
        except af.errors.NotInstalled as error:
            print_left_out(str(error))
    if not chosen.models:
        print(*HEAD, sep=" | ")
        shake("prusias_restored" if chosen.restored else "prusias", chosen)


if __name__ == "__main__":
    main()
